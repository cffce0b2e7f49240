"""Rough microblocks under a cylinder: how hardness and real contact scatter with psi0(x).

Geometry   half-plane x2 < 0; a cylinder pressed down by a force P; blocks of side ell = alpha a_Hz, rotated
           by a self-affine psi0(x) of seeded phases, many seeds at each root mean square.
Equations  (10)-(18) in the half-plane, the corner gaps (20)-(22) and conditions (26) on its surface.
Model      uniform cells on a window, products by FFT, no mesh (`Cells`, psi0 a callable).
Reference  four times as many cells, for the first seeds of each roughness; aligned blocks (psi0 = 0): panels
           fitted to the edges.
Look at    up to about 0.05 a_Hz/R nothing but full contact suffers; beyond it the contact breaks into zones,
           real contact shrinks, the largest pressure grows, and so does the scatter from seed to seed.
Units      lengths over a_Hz, pressures over p_Hz, loads over P; psi0 over a_Hz/R, the slope of the cylinder
           at the edge of Hertz's contact.
"""

import math
import time
from dataclasses import dataclass

import numpy as np
from tqdm import tqdm

import microblock as mb
from microblock.data.records import column, grouped

from ..common.options import Checked, coupling, option, poisson
from ..common.records import print_entries, print_table, returned
from .rough import rough_psi0

RADIUS = 20.0  # over a_Hz: psi0 of a_Hz/R is 2.9 degrees
LOAD = math.pi / 2  # gives a_Hz = p_Hz = 1 with E* = 2 R
WINDOW = 2.0  # half of it, over a_Hz; also half the period of psi0
HURST = 0.8
LONGEST = 4  # waves of psi0 in the window: a_Hz long
VERIFIED = 2  # seeds of each roughness that are solved on four times as many cells
OBSERVED = ("hardness_apparent", "hardness_real", "contact", "full_contact", "pressure_max", "zones")


@dataclass(frozen=True)
class Parameters(Checked):
    amplitudes: tuple = option(
        (0.0, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0),
        "root mean squares of psi0 over a_Hz/R",
        at_least=0,
        at_most=2,
        order="ascending",
        nargs="+",
        metavar="PSI0",
    )
    seeds: int = option(20, "profiles at each of them", int, at_least=2, at_most=10000)
    first_seed: int = option(1, "the first of them", int, at_least=0)
    alpha: float = option(0.1, "ell over a_Hz", at_least=0.01, at_most=1)
    shortest: float = option(0.5, "shortest wave of psi0 over ell", above=0)
    nodes: int = option(4096, "cells of the window of four a_Hz", int, at_most=2**18)
    nu: float = poisson()
    beta: float = coupling()

    def relate(self):
        if self.waves[1] < LONGEST:
            raise mb.BadArgument("shortest", self.shortest, f"must leave waves up to {1 / self.alpha:g} ell")
        if self.nodes < 8 * self.waves[1]:
            raise mb.BadArgument(
                "nodes", self.nodes, f"must be at least eight to the shortest wave, {8 * self.waves[1]}"
            )

    @property
    def waves(self):
        """Numbers of the longest and the shortest wave in the window."""
        return LONGEST, int(2 * WINDOW / (self.shortest * self.alpha)) if self.shortest > 0 else 0

    @property
    def solid(self):
        return mb.Cosserat(E=2 * RADIUS * (1 - self.nu**2), nu=self.nu, ell=self.alpha, beta=self.beta)

    def problem(self, amplitude, seed, finer=1):
        """The contact problem of one profile of psi0; `finer` times as many cells."""
        profile = mb.Rough(2 * WINDOW, 1.0, HURST, self.waves, seed)
        law = mb.Microblock(rough_psi0(profile, amplitude / RADIUS) if amplitude else 0.0)
        return mb.Contact(
            mb.HalfPlane(self.solid),
            mb.Cylinder(RADIUS),
            law,
            mb.Cells(nodes=finer * self.nodes, window=(-WINDOW, WINDOW)),
        )


def solve(parameters, amplitude, seed, finer=1):
    """The State of one profile of psi0; `finer` times as many cells."""
    return parameters.problem(amplitude, seed, finer).solve(load=LOAD)


def observe(state):
    """What a state shows: hardness as P over the half-width, and over the half of all contact."""
    pressure, width = state.pressure, state.weights[0]
    closed = np.flatnonzero(pressure > 0)
    contact = width * len(closed)
    outer = (closed[-1] - closed[0] + 1) * width / 2
    return {
        "hardness_apparent": float(1 / outer),
        "hardness_real": float(2 / contact),
        "contact": float(contact),
        "full_contact": float(width * np.sum(np.all(np.array(list(state.pressures.values())) > 0, axis=0))),
        "pressure_max": float(pressure.max()),
        "zones": int(1 + np.sum(np.diff(closed) > 1)),
        "error_estimate": state.error_estimate,
    }


def reference(parameters):
    """The State of aligned blocks on panels fitted to the edges."""
    problem = mb.Contact(mb.HalfPlane(parameters.solid), mb.Cylinder(RADIUS), mb.Microblock())
    return problem.solve(load=LOAD, rtol=1e-6)


def verified(parameters, amplitude, seed, coarse):
    """Change of a state from its own to four times as many cells: in the pressure (relative L2), hardness and
    contact.
    """
    fine = solve(parameters, amplitude, seed, finer=4)
    p, q = np.interp(fine.x, coarse.x, coarse.pressure), fine.pressure
    seen, better = observe(coarse), observe(fine)
    return {
        "difference": float(np.linalg.norm(p - q) / np.linalg.norm(q)),
        "change_hardness": abs(seen["hardness_real"] / better["hardness_real"] - 1),
        "change_full": abs(seen["full_contact"] - better["full_contact"]),
    }


def result(parameters, quiet=True):
    """The case's object: a row a state, and mean and scatter of each roughness."""
    start, states = time.perf_counter(), []
    chosen = [
        (amplitude, parameters.first_seed + number)
        for amplitude in parameters.amplitudes
        for number in range(parameters.seeds if amplitude else 1)
    ]
    for amplitude, seed in tqdm(chosen, disable=quiet, unit="state"):
        state = solve(parameters, amplitude, seed)
        against = dict.fromkeys(("difference", "change_hardness", "change_full"))
        if seed < parameters.first_seed + VERIFIED:
            against = verified(parameters, amplitude, seed, state)
        states.append({"amplitude": amplitude, "seed": seed, **observe(state), **against})
    summaries = [summary(amplitude, own) for amplitude, own in grouped(states, "amplitude").items()]
    return returned(
        parameters, start, model="halfplane", states=states, summary=summaries, aligned=aligned(parameters)
    )


def aligned(parameters):
    """Distance of the cells to the panels for psi0 = 0: relative L2 of the pressure, and half-width."""
    cells, panels = solve(parameters, 0.0, 0), reference(parameters)
    exact, outer = panels.pressure_at(cells.x), panels.zones["contact"][-1][1]
    return {
        "difference": float(np.linalg.norm(cells.pressure - exact) / np.linalg.norm(exact)),
        "estimate": cells.error_estimate,
        "half_width": float(1 / observe(cells)["hardness_apparent"]),
        "half_width_panels": outer,
    }


def summary(amplitude, rows):
    """Mean, standard deviation (over the seeds) and standard error of what is observed."""
    found = {"amplitude": amplitude, "seeds": len(rows)}
    for name in OBSERVED:
        values = np.array(column(rows, name), float)
        spread = float(values.std(ddof=1)) if len(values) > 1 else 0.0
        found |= {
            name: float(values.mean()),
            f"{name}_sd": spread,
            f"{name}_se": spread / math.sqrt(len(values)),
        }
    known = [row for row in rows if row["difference"] is not None]
    return found | {
        name: max(column(known, name)) for name in ("error_estimate", "difference", "change_hardness")
    }


def show(answer):
    print_table(
        answer["summary"],
        (
            "amplitude",
            "seeds",
            "hardness_real",
            "hardness_real_sd",
            "contact",
            "contact_sd",
            "full_contact",
            "full_contact_sd",
            "pressure_max",
            "pressure_max_sd",
            "zones",
            "error_estimate",
            "difference",
            "change_hardness",
        ),
    )
    print("aligned blocks against panels:")
    print_entries(answer["aligned"], tuple(answer["aligned"]))


def rows(parameters, answer):
    """A row a state."""
    return answer["states"]


def figure(records):
    """Unevenly rotated blocks lose full contact first; hardness changes once psi0 is a fifth of the
    obstacle's slope.

    A cylinder on blocks rotated by a rough psi0(x), several seeds at each root mean square (over a_Hz/R, the
    slope of the cylinder at the edge of the contact; 0: aligned). Small dots: seeds; marks with bars: mean
    and standard deviation. (a) Hardness by the length in contact (real) and by the outermost edges
    (apparent); (b) length on one corner or both, and on both.

    Seen: in (a) flat curves up to 0.1, then the real hardness rises with a growing scatter and the apparent
    hardness stays; in (b) the length on both corners falls from 0.05 on to nothing, that on one or both from
    0.2 on.
    """
    from microblock.view import plots

    drawing, axes = plots.figure(2, 1, height=1.9, sharex=True)
    shown = (
        (axes[0], (("hardness_real", "real", (-8, 4)), ("hardness_apparent", "apparent", (-4, -9)))),
        (axes[1], (("contact", "one corner or both", (-8, -6)), ("full_contact", "both corners", (-10, -6)))),
    )
    groups = grouped(records, "amplitude")
    smallest = min((amplitude for amplitude in groups if amplitude > 0), default=1.0)
    for axis, named in shown:
        for (name, words, beside), colour, marker, shift in zip(
            named, plots.COLOURS, plots.MARKERS, (0.96, 1.04)
        ):
            places = [shift * (amplitude or smallest / 2) for amplitude in groups]
            for place, own in zip(places, groups.values()):
                axis.plot([place] * len(own), column(own, name), ".", color=colour, markersize=2, alpha=0.5)
            means, spread = (
                [found(column(own, name)) for own in groups.values()] for found in (np.mean, np.std)
            )
            axis.errorbar(places, means, spread, color=colour, marker=marker, capsize=2)
            at = -1 - min(2 if name == "full_contact" else 1, len(means) - 1)
            plots.label(axis, places[at], means[at], words, colour, beside)
        axis.set(xscale="log")
        axis.margins(y=0.22)  # room for names below the lowest curve
    axes[1].set_xticks(
        [amplitude or smallest / 2 for amplitude in groups], [f"{amplitude:g}" for amplitude in groups]
    )
    axes[1].minorticks_off()
    axes[0].set(ylabel=r"hardness over $P/(2 a_\mathrm{Hz})$")
    axes[1].set(xlabel=r"rms of $\psi_0 R/a_\mathrm{Hz}$", ylabel=r"length over $a_\mathrm{Hz}$")
    axes[1].set_ylim(0, None)
    plots.letter(axes)
    return drawing


FIGURES = {"scatter": (rows, figure)}
