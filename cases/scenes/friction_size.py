"""Size effects of friction: stick, dissipation a cycle, and the micromoments that a cycle leaves behind.

Geometry   the rigid cylinder with friction on the half-plane of `tangential`: pressed down, sheared until all
           slips, back to no shear, and once around.
Equations  those of `tangential`, coupled, for the three laws.
Model      cells graded towards all edges, loads followed from event to event (docs/theory/friction.md).
Reference  alpha -> 0: one limit for all three laws, without coupling that of Cattaneo and Mindlin.
Look at    what a cycle dissipates: under microblocks it falls with the size of the blocks, which turn with
           the obstacle before they slip.
Units      those of `tangential`: lengths over a_Hz, energies over P a_Hz^2/R, M over p_Hz ell, slip over
           a_Hz^2/R.
"""

import time
from dataclasses import dataclass

import numpy as np
from tqdm import tqdm

import microblock as mb
from microblock.data.records import column, grouped

from ..common.case import of_kinds
from ..common.options import Checked, coupling, option, poisson
from ..common.records import print_table, returned
from . import tangential

ALPHAS = (0.1, 0.2, 0.4, 0.8, 1.5)
SHEARS = (0.25, 0.5, 0.75)  # at which the stick zone is measured
CYCLE = (1.0, 0.0, -1.0, 1.0)
LOOP = (1.0, 0.5, 0.0, -0.5, -1.0, -0.5, 0.0, 0.5, 1.0)
DRAWN = 0.1  # rtol of the loops, which many pairs of loads make costly
FINER = 0.4  # times the first estimate, to which states are computed again: the changes are the errors
MEASURES = (*(f"stick_{shear:g}" for shear in SHEARS), "dissipation", "moment", "moment_left")


@dataclass(frozen=True)
class Parameters(Checked):
    alphas: tuple = option(ALPHAS, "ratios ell/a_Hz", above=0, nargs="+", metavar="ALPHA", order="ascending")
    friction: float = option(0.3, "coefficient of friction", above=0)
    nu: float = poisson()
    beta: float = coupling()
    rtol: float = option(
        5e-2, "relative L2 error of the states; those shown are a second, finer set", above=0, below=0.5
    )

    def history(self, alpha, contact, shears, rtol):
        """The scales of `tangential`, and its states for these shear loads."""
        chosen = tangential.Parameters(
            alpha=(alpha,),
            friction=self.friction,
            contact=contact,
            nu=self.nu,
            beta=self.beta,
            shear=shears,
            rtol=rtol,
        )
        return chosen, tangential.solve(chosen, alpha).states


def solve(parameters, alpha, contact):
    """The measures at one size of the blocks, with their errors: changes from states that are less exact; where
    no more exact ones are in reach, the share of the states' own estimate.
    """
    coarse = _measured(parameters, alpha, contact, parameters.rtol)
    try:
        fine = _measured(parameters, alpha, contact, FINER * coarse["error_estimate"])
        errors = {f"{name}_error": abs(fine[name] - coarse[name]) for name in MEASURES}
    except mb.NotConverged:
        fine = coarse
        errors = {f"{name}_error": fine["error_estimate"] * fine[name] for name in MEASURES}
    return {"contact": contact, "alpha": alpha, **fine, **errors}


def _measured(parameters, alpha, contact, rtol):
    """Stick zones on the way to full slip, and what a cycle dissipates and leaves behind."""
    _, sheared = parameters.history(alpha, contact, SHEARS, rtol)
    chosen, (pressed, full, unloaded, _, last) = parameters.history(alpha, contact, CYCLE, rtol)
    scale = chosen.E_star / 2 * alpha
    found = {
        f"stick_{shear:g}": sum(right - left for left, right in state.zones["stick"]) / 2
        for shear, state in zip(SHEARS, sheared[1:])
    }
    return found | {
        "half_width": pressed.half_width,
        "dissipation": (last.dissipation - full.dissipation) / chosen.unit,
        "moment": float(np.abs(pressed.micromoment).max()) / scale,
        "moment_left": float(np.abs(unloaded.micromoment).max()) / scale,
        "error_estimate": max(state.error_estimate for state in (*sheared, pressed, unloaded, last)),
    }


def looped(parameters, alpha, contact):
    """Shear over f P, and the slip at the middle of the contact, once around."""
    chosen, (pressed, *around) = parameters.history(alpha, contact, LOOP, DRAWN)
    middle, size = np.argmin(np.abs(pressed.x)), chosen.friction * pressed.normal
    slips = [float(state.slip[middle]) for state in around]
    return [
        {"shear": state.shear / size, "slip": slip - slips[0], "step": step}
        for step, (state, slip) in enumerate(zip(around, slips))
    ]


def result(parameters, quiet=True):
    """The case's object: a row for each law and size of the blocks, and the loops."""
    start = time.perf_counter()
    places = [(contact, alpha) for contact in tangential.LAWS for alpha in parameters.alphas]
    sizes, loops = [], []
    for contact, alpha in tqdm(places, disable=quiet, unit="cycle"):
        sizes.append(solve(parameters, alpha, contact))
        loops += [{"contact": contact, "alpha": alpha, **one} for one in looped(parameters, alpha, contact)]
    return returned(parameters, start, states=sizes, loops=loops)


def show(answer):
    """Print the measures with their errors."""
    print_table(answer["states"], ("contact", "alpha", *(n for m in MEASURES for n in (m, f"{m}_error"))))


def rows(parameters, answer):
    """A row for each law and size, and one for each point of a loop."""
    return of_kinds(size=answer["states"], loop=answer["loops"])


def _curves(records, names, ylabel, legend):
    from microblock.view import plots

    drawing, axes = plots.figure(1, 1)
    axis = np.ravel(axes)[0]
    for contact, own in grouped(grouped(records, "kind")["size"], "contact").items():
        colour = None
        for name, line in names.items():
            bars = axis.errorbar(
                column(own, "alpha"),
                column(own, name),
                column(own, f"{name}_error"),
                fmt=f"o{line}",
                ms=2.5,
                color=colour,
                label=legend(contact, name),
            )
            colour = bars[0].get_color()
    axis.set(xscale="log", xlabel=r"$\alpha = \ell/a_\mathrm{Hz}$", ylabel=ylabel, ylim=(0, None))
    axis.legend(frameon=False, fontsize="small")
    return drawing


def stick(records):
    """Without corners larger blocks stick on more of the contact, microblocks do not.

    Half of the length that sticks under a cylinder, over a_Hz, for three shear loads (full lines 0.25 f P,
    broken 0.5, dotted 0.75); bars are changes from states that are half as exact.

    Seen: three families of curves, one above the other.
    """
    lines = dict(zip(MEASURES, ("-", "--", ":")))
    return _curves(
        records,
        lines,
        r"stick $/a_\mathrm{Hz}$",
        lambda contact, name: contact if name == MEASURES[0] else None,
    )


def dissipation(records):
    """What a full cycle of shear dissipates depends on the size of the blocks.

    Dissipation from full slip to full slip the other way and back, over P a_Hz^2/R.

    Seen: one curve for each law.
    """
    return _curves(
        records, {"dissipation": "-"}, r"dissipation$\;/(P a_\mathrm{Hz}^2/R)$", lambda contact, name: contact
    )


def moment(records):
    """A cycle leaves micromoments behind.

    Largest micromoment without shear, pressed for the first time (full) and back from full slip (broken).

    Seen: for each law with moments two curves.
    """
    kept = [row for row in records if row["kind"] != "size" or row["contact"] != "unilateral"]
    return _curves(
        kept,
        {"moment": "-", "moment_left": "--"},
        r"largest $|M|/(p_\mathrm{Hz}\ell)$",
        lambda contact, name: contact if name == "moment" else f"{contact}, after slip",
    )


def loop(records):
    """Under microblocks the loop of shear and slip gets narrower as blocks grow.

    Shear over f P against the slip at the middle of the contact, from full slip around and back.

    Seen: closed loops, one inside the other.
    """
    from microblock.view import plots

    drawing, axes = plots.figure(1, 1)
    axis = np.ravel(axes)[0]
    own = [row for row in records if row["kind"] == "loop" and row["contact"] == "microblock"]
    by_size = grouped(own, "alpha")
    chosen = [alpha for alpha in by_size if alpha in (0.05, 0.2, 0.7, 1.5)] or list(by_size)
    for colour, alpha in zip(plots.shades(len(chosen)), chosen):
        axis.plot(
            column(by_size[alpha], "slip"),
            column(by_size[alpha], "shear"),
            "o-",
            ms=2.0,
            color=colour,
            label=rf"$\alpha = {alpha:g}$",
        )
    axis.set(xlabel=r"slip at the middle $\cdot\, R/a_\mathrm{Hz}^2$", ylabel=r"$Q/(fP)$")
    axis.legend(frameon=False, fontsize="small")
    return drawing


FIGURES = {
    "friction_stick": (rows, stick),
    "friction_loop": (rows, loop),
    "friction_dissipation": (rows, dissipation),
    "friction_moment": (rows, moment),
}
