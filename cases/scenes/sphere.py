"""Sphere pressed on a half-space with microblocks, rigid or a second body: nano-indentation.

Geometry   half-space x3 < 0; a sphere of radius R, rigid or a second half-space of that shape; blocks are
           cubes of side ell, with sides along x1 and x2, and touch with four corners. The paper
           leaves this out: its law is one of the plane.
Equations  (10)-(17) in the half-space, gaps of four corners, conditions (26) on each; a corner presses the
           second body where it stands.
Model      square cells of the surface, products by FFT, from grid to grid to rtol
           (docs/theory/halfspace.md).
Reference  Hertz for alpha -> 0, with the moduli of both bodies.
Look at    pressure, number of closed corners, moments; beside the unilateral law, radius and pressure of a
           sphere that is as small as its blocks.
Units      R = 1 and P = 1: lengths over a_Hz, pressures over p_Hz of the sphere, loads are multiples of P; M
           over p_Hz ell, psi as psi R/a_Hz, approach as d R/a_Hz^2; in Hertz's
           formulas 1/E* = 1/E1* + 1/E2* and E1* = 1.
"""

import time
from dataclasses import dataclass, replace

import numpy as np

import microblock as mb

from ..common import second_body
from ..common.case import over
from ..common.laws import LAWS
from ..common.options import Checked, coupling, option, poisson
from ..common.records import print_table, returned

RTOL = 1e-2
SHOWN = (
    "load",
    "pressure_centre",
    "pressure_max",
    "radius",
    "radius_x",
    "radius_diagonal",
    "approach",
    "error_estimate",
)
SECOND = (
    "two numbers E2 (over the first body's modulus) and NU2 of a classical one, or four: E2, NU2, BETA2, "
    "ALPHA2 (ell2 over a_Hz)"
)
KEPT = 128  # cells a side of which the records of the picture are made, at most


@dataclass(frozen=True)
class Parameters(Checked):
    alpha: float = option(0.25, "size of a block over Hertz's radius at the load 1", above=0)
    loads: tuple = option((1.0,), "loads, multiples of P", above=0, nargs="+", metavar="LOAD")
    nu: float = poisson()
    beta: float = coupling()
    contact: str = option("microblock", "contact law", str, choices=tuple(LAWS))
    alpha_prime: float = option(0.0, "alpha' of (12)")
    beta_prime: float = option(0.0, "beta' of (12)")
    cells: int | None = option(
        None, "cells a side: fixes what --rtol would choose", int, at_least=32, at_most=2048
    )
    rtol: float | None = option(
        None,
        "relative L2 error of pressure and of micromoment over ell, of means over cells "
        f"({RTOL:g} if nothing is given)",
        above=0,
        below=1,
        not_with={"cells": "it chooses the cells"},
    )
    period: float | None = option(
        None, "period along x1 and x2 over a_Hz; without it there is one sphere", above=2
    )
    second: tuple = option(
        second_body.RIGID,
        f"the sphere: rigid, same as the half-space, or {SECOND}",
        str,
        nargs="+",
        metavar="BODY",
    )

    def relate(self):
        self._numbers()

    def _numbers(self):
        """E, nu, beta and alpha of the second body; None of a rigid one."""
        if self.second == second_body.SAME:
            return 1 - self.nu**2, self.nu, self.beta, self.alpha
        numbers = second_body.numbers(self.second, SECOND, rest=(0, 1))
        return None if numbers is None else (numbers[0] * (1 - self.nu**2), *numbers[1:])

    @property
    def E_star(self):
        """That of both bodies; of the half-space alone it is 1."""
        numbers = self._numbers()
        return 1.0 if numbers is None else 1 / (1 + (1 - numbers[1] ** 2) / numbers[0])

    @property
    def a_Hz(self):
        """Hertz's radius of the contact at the load 1, for R = 1."""
        return (3 / 4 / self.E_star) ** (1 / 3)

    @property
    def p_Hz(self):
        """Hertz's largest pressure at the load 1."""
        return 3 / (2 * np.pi * self.a_Hz**2)

    def solid(self):
        """The half-space's solid, of E* = 1."""
        return mb.Cosserat(
            E=1 - self.nu**2,
            nu=self.nu,
            ell=self.alpha * self.a_Hz,
            beta=self.beta,
            alpha_prime=self.alpha_prime,
            beta_prime=self.beta_prime,
        )

    def problem(self):
        period = None if self.period is None else self.period * self.a_Hz
        body, obstacle, numbers = mb.HalfSpace(self.solid(), period), mb.Sphere(R=1.0), self._numbers()
        if numbers is not None:
            E, nu, beta, alpha = numbers
            other = mb.Cosserat(E=E, nu=nu, ell=alpha * self.a_Hz, beta=beta)
            other = self.solid() if self.second == second_body.SAME else other
            obstacle = mb.Deformable(mb.HalfSpace(other, period), obstacle)
        return mb.Contact(body, obstacle, LAWS[self.contact](), mb.Cells(nodes=self.cells))

    def resolved(self):
        return replace(self, rtol=RTOL if self.cells is None and self.rtol is None else self.rtol)


def solve(parameters):
    """The SurfaceState at each load."""
    problem = parameters.problem()
    return [problem.solve(load=load, rtol=parameters.rtol) for load in parameters.loads]


def reference(parameters, load):
    """Hertz's radius, largest pressure and approach at a load, in the case's units."""
    return {"radius": load ** (1 / 3), "pressure_max": load ** (1 / 3), "approach": load ** (2 / 3)}


def observe(parameters, state):
    """What the case returns of a state."""
    a, p = parameters.a_Hz, parameters.p_Hz
    m = p * (parameters.alpha * a)
    units = {"x1": a, "pressure": p, "m1": m, "m2": m, "psi1": a, "psi2": a}
    axis, diagonal = (over(state.along(name), units) for name in ("x1", "diagonal"))
    cells = np.bincount(state.closed.ravel(), minlength=5)[1:5] * state.width**2 / (np.pi * a**2)
    return {
        "load": state.load,
        "pressure_centre": float(np.interp(0.0, axis["x1"], axis["pressure"])),
        "pressure_max": float(state.pressure.max() / p),
        "radius": state.radius / a,
        "radius_x": _reach(axis, state.width / a),
        "radius_diagonal": np.sqrt(2) * _reach(diagonal, state.width / a),
        "approach": state.approach / a**2,
        "closed": cells.tolist(),
        "iterations": state.iterations,
        "residual": state.residual,
        "error_estimate": state.error_estimate,
        "unknowns": state.unknowns,
        "profile": {"axis": axis, "diagonal": diagonal},
    }


def _reach(cut, width):
    """Half of the length on which there is pressure."""
    return float(np.count_nonzero(np.greater(cut["pressure"], 0)) * width / 2)


def result(parameters, quiet=True):
    """The case's object: a state for each load."""
    start = time.perf_counter()
    parameters = parameters.resolved()
    return returned(parameters, start, states=[observe(parameters, state) for state in solve(parameters)])


def show(answer):
    """Print the states, and Hertz beside them."""
    print_table(answer["states"], SHOWN)
    loads = [state["load"] for state in answer["states"]]
    print_table(
        [{"Hertz at load": load, **reference(None, load)} for load in loads],
        ("Hertz at load", "radius", "pressure_max", "approach"),
    )


def rows(parameters, answer):
    """Records of the picture at the last load: cells with their pressure, moment and closed corners."""
    parameters = parameters.resolved()
    last = replace(
        parameters, loads=parameters.loads[-1:], cells=min(KEPT, parameters.cells or KEPT), rtol=None
    )
    (state,) = solve(last)
    p, a, ell = parameters.p_Hz, parameters.a_Hz, parameters.alpha * parameters.a_Hz
    x1, x2 = np.meshgrid(state.x1 / a, state.x2 / a, indexing="ij")
    fields = {
        "x1": x1,
        "x2": x2,
        "pressure": state.pressure / p,
        "m1": state.micromoment[0] / (p * ell),
        "m2": state.micromoment[1] / (p * ell),
        "closed": state.closed,
    }
    return [
        {"load": state.load, **{name: float(values[i, j]) for name, values in fields.items()}}
        for i, j in np.ndindex(state.pressure.shape)
    ]


def figure(records):
    """Pressure, number of closed corners and the length of the moment under a sphere, from above; beside them
    the pressure along the axis and on the diagonal, and Hertz's.
    """
    from microblock.data.records import column
    from microblock.view import plots
    from microblock.view.surface_figure import closed_map, colour_map

    n = int(np.sqrt(len(records)))
    grid = {
        name: np.reshape(column(records, name), (n, n))
        for name in ("x1", "x2", "pressure", "m1", "m2", "closed")
    }
    drawing, axes = plots.figure(2, 2, height=2.5, width=6.0)
    edge = -grid["x1"][0, 0] * n / (n - 1)
    box = (-edge, edge, -edge, edge)
    colour_map(axes[0, 0], grid["pressure"], box, r"pressure $p/p_{\mathrm{Hz}}$")
    closed_map(axes[0, 1], grid["closed"], box, max(1, int(grid["closed"].max())))
    moment = np.hypot(grid["m1"], grid["m2"])
    colour_map(axes[1, 0], moment, box, r"micromoment $|M|/(p_{\mathrm{Hz}}\ell)$")
    for axis in (axes[0, 0], axes[0, 1], axes[1, 0]):
        axis.set(xlabel=r"$x_1/a_{\mathrm{Hz}}$", ylabel=r"$x_2/a_{\mathrm{Hz}}$")
    x, middle = grid["x1"][:, 0], [n // 2 - 1, n // 2]
    axes[1, 1].plot(x, grid["pressure"][:, middle].mean(axis=1), label="axis")
    axes[1, 1].plot(np.sqrt(2) * x, np.diagonal(grid["pressure"]), "--", label="diagonal")
    load = records[0]["load"]
    axes[1, 1].plot(
        x,
        load ** (1 / 3) * np.sqrt(np.maximum(1 - (x / load ** (1 / 3)) ** 2, 0)),
        ":",
        color="0.4",
        label="Hertz",
    )
    axes[1, 1].set(xlabel=r"$r/a_{\mathrm{Hz}}$", xlim=(-edge, edge))
    axes[1, 1].set_title(r"pressure $p/p_{\mathrm{Hz}}$")
    axes[1, 1].set_box_aspect(1)
    axes[1, 1].legend(loc="lower center", frameon=False, handlelength=1.2)
    return drawing


FIGURES = {"sphere": (rows, figure)}
