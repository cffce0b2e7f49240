"""Rough obstacle and rough psi0(x) on a half-plane with microblocks: a large problem, matrix-free.

Geometry   half-plane x2 < 0; a self-affine profile of one period (seeded phases) pressed down by a mean
           pressure; blocks of side ell, rotated by a psi0(x) that is as rough as the profile.
Equations  (10)-(18) in the half-plane, the corner gaps (20)-(22) and conditions (26) on its surface.
Model      one period of uniform cells, products by FFT, no mesh (docs/theory/halfplane.md, "Large problems").
Reference  four times as many cells.
Look at    ten thousand cells in contact, dozens of zones, some 150 products; psi0 tears the zones of the
           corners apart.
Units      lengths over the period, pressures over E* times the root mean square slope; M over that and ell.
"""

import math
import time
from dataclasses import dataclass, replace

import numpy as np

import microblock as mb
from microblock.data.records import column

from ..common.case import profiles
from ..common.options import Checked, coupling, option, poisson
from ..common.records import print_entries, returned

DRAWN = 2000  # cells around the largest pressure that the records keep
BESIDE = 0.05  # of what touches among them: what the figure shows on either side of it


@dataclass(frozen=True)
class Parameters(Checked):
    nodes: int = option(2**16, "cells of the period", int, at_most=2**22)
    seed: int = option(1, "seed of the phases of the profile; psi0 has the next one", int, at_least=0)
    load: float = option(0.05, "mean pressure over E* times the slope", above=0)
    slope: float = option(0.1, "root mean square slope of the profile", above=0)
    hurst: float = option(0.8, "exponent of the profile, 0 to 1", at_least=0, at_most=1)
    longest: int = option(4, "longest wave, in waves to the period", int, at_least=1)
    shortest: int = option(256, "shortest wave, in waves to the period", int, at_least=1)
    ell: float = option(2e-3, "length scale of the material over the period", above=0)
    nu: float = poisson()
    beta: float = coupling()
    psi0_deg: float = option(
        1.0,
        "root mean square of psi0 in degrees",
        at_least=0,
        at_most=10,
        only_with={"contact": "microblock"},
    )
    contact: str = option("microblock", "contact law", str, choices=("microblock", "unilateral"))

    def relate(self):
        if self.longest > self.shortest:
            raise mb.BadArgument("longest", self.longest, "must not be larger than --shortest")
        if self.nodes < 4 * self.shortest:
            raise mb.BadArgument(
                "nodes", self.nodes, f"must be at least four to the shortest wave, {4 * self.shortest}"
            )

    @property
    def solid(self):
        """E* slope = 1."""
        return mb.Cosserat(E=(1 - self.nu**2) / self.slope, nu=self.nu, ell=self.ell, beta=self.beta)

    @property
    def profile(self):
        return mb.Rough(1.0, self.slope, self.hurst, (self.longest, self.shortest), self.seed)

    @property
    def psi0(self):
        """psi0(x): the height of another such profile, brought to the root mean square asked for."""
        return rough_psi0(
            mb.Rough(1.0, 1.0, self.hurst, (self.longest, self.shortest), self.seed + 1),
            math.radians(self.psi0_deg),
        )

    @property
    def problem(self):
        law = mb.Microblock(self.psi0) if self.contact == "microblock" else mb.Unilateral()
        return mb.Contact(mb.HalfPlane(self.solid, period=1.0), self.profile, law, mb.Cells(nodes=self.nodes))


def rough_psi0(profile, size):
    """psi0(x) of a root mean square `size` (radians), with the waves of a Rough profile."""
    height = math.sqrt(np.sum(np.abs(profile.amplitudes) ** 2) / 2)
    return lambda x: size / height * profile.height(x)


def solve(parameters):
    """The State at the load."""
    return parameters.problem.solve(load=parameters.load)


def reference(parameters):
    """The State on four times as many cells, which verifies the error estimate."""
    return solve(replace(parameters, nodes=4 * parameters.nodes))


def result(parameters, quiet=True):
    """The case's object."""
    start = time.perf_counter()
    state = solve(parameters)
    pressure, corners = state.pressure, list(state.pressures.values())
    profile = {
        "x": state.x.tolist(),
        "weight": state.weights.tolist(),
        "pressure": pressure.tolist(),
        "micromoment": (state.micromoment / parameters.ell).tolist(),
        "psi": state.psi.tolist(),
    }
    return returned(
        parameters,
        start,
        model="halfplane",
        unknowns=state.unknowns + 1,
        contact_fraction=float(np.mean(pressure > 0)),
        full_contact_fraction=float(np.mean(np.all(np.array(corners) > 0, axis=0))),
        zones=[len(state.zones[name]) for name in ("AB" if len(corners) == 2 else ("contact",))],
        pressure_max=float(pressure.max()),
        micromoment_max=float(np.abs(state.micromoment).max() / parameters.ell),
        approach=state.approach,
        energy=state.energy,
        kkt=state.residual,
        products=state.iterations,
        error_estimate=state.error_estimate,
        profile=profile,
    )


def show(answer):
    print_entries(
        answer,
        (
            "unknowns",
            "contact_fraction",
            "full_contact_fraction",
            "zones",
            "pressure_max",
            "micromoment_max",
            "approach",
            "kkt",
            "products",
            "error_estimate",
        ),
    )


def rows(parameters, answer):
    """A row a cell around the largest pressure."""
    middle = int(np.argmax(answer["profile"]["pressure"]))
    chosen = slice(max(middle - DRAWN // 2, 0), middle + DRAWN // 2)
    profile = {name: answer["profile"][name][chosen] for name in ("x", "pressure", "micromoment", "psi")}
    return profiles([{"profile": profile, "error_estimate": answer["error_estimate"]}], "error_estimate")


def figure(records):
    """On a rough obstacle, rough blocks carry the load on many small zones, each mostly on one corner.

    A self-affine obstacle on a half-plane whose blocks are rotated by a psi0(x) that is as rough: pressure
    (a) and micromoment (b) around the largest pressure, of a problem of some ten thousand cells in contact
    that is solved without a matrix. The micromoment is over that of the unit of pressure on one corner alone,
    ell/2 from the middle: where it is as large as the pressure, one corner carries all of it (to 3 %, by
    which rotated blocks change the lever).

    Seen: narrow peaks of pressure between gaps, with peaks of the micromoment of either sign below them,
    most of them as high.
    """
    from microblock.view import plots

    drawing, axes = plots.figure(2, 1, height=1.5, sharex=True)
    for axis, name in zip(axes, ("pressure", "micromoment")):
        scale = 2 if name == "micromoment" else 1
        axis.plot(column(records, "x"), scale * np.array(column(records, name)), linewidth=0.8)
    touching = [row["x"] for row in records if row["pressure"] > 0]
    margin = BESIDE * (touching[-1] - touching[0])
    axes[0].set_xlim(touching[0] - margin, touching[-1] + margin)
    axes[0].set_ylabel(r"$p/(E^* h'_\mathrm{rms})$")
    axes[1].set(xlabel="$x_1$ over the period", ylabel=r"$2M/(E^* h'_\mathrm{rms}\,\ell)$")
    plots.letter(axes)
    return drawing


FIGURES = {"rough": (rows, figure)}
