"""Size effects of friction: stick, dissipation a cycle, and the micromoments that it leaves.

Geometry   the rigid cylinder with friction on the half-plane of `tangential`: pressed down, sheared until all
           slips, back to no shear, and once around.
Equations  those of `tangential`, coupled, for the three laws.
Model      cells graded towards all edges, loads followed from event to event (docs/theory/friction.md).
Reference  alpha -> 0: one limit for all three laws, without coupling that of Cattaneo and Mindlin.
Look at    what a cycle dissipates: under microblocks less than without corners, and least where a block is
           some 0.3 of the contact's half-width; blocks turn with the obstacle before they slip.
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

ALPHAS = (0.1, 0.2, 0.3, 0.4, 0.6, 0.8, 1.5)
SHEARS = (0.25, 0.5, 0.75)  # at which the stick zone is measured
CYCLE = (1.0, 0.0, -1.0, 1.0)
LOOP = (1.0, 0.5, 0.0, -0.5, -1.0, -0.5, 0.0, 0.5, 1.0)
DRAWN = 0.1  # rtol of the loops, which many pairs of loads make costly
FINER = 0.4  # times the first estimate, to which states are computed again: the changes are the errors
MEASURES = (*(f"stick_{shear:g}" for shear in SHEARS), "dissipation", "moment", "moment_left")


@dataclass(frozen=True)
class Parameters(Checked):
    alphas: tuple = option(ALPHAS, "ratios ell/a_Hz", above=0, nargs="+", metavar="ALPHA", order="ascending")
    contacts: tuple = option(
        tuple(tangential.LAWS), "contact laws", str, choices=tuple(tangential.LAWS), nargs="+", metavar="LAW"
    )
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
    """The measures at one size of the blocks, with their errors: changes from states that are less exact;
    where no more exact ones are in reach, the share of the states' own estimate.
    """
    found = {"contact": contact, "alpha": alpha, "error_estimate": 0.0}
    for measure, shears in ((_stick, SHEARS), (_cycle, CYCLE)):
        coarse, estimate = measure(*parameters.history(alpha, contact, shears, parameters.rtol))
        found["error_estimate"] = max(found["error_estimate"], estimate)
        try:
            finer = parameters.history(alpha, contact, shears, FINER * estimate)
            fine, _ = measure(*finer)
            errors = {f"{name}_error": abs(fine[name] - coarse[name]) for name in coarse}
        except mb.NotConverged:
            fine, errors = coarse, {f"{name}_error": estimate * coarse[name] for name in coarse}
        found |= fine | errors
    return found


def _stick(chosen, states):
    """Half of what sticks, on the way to full slip, and the estimate."""
    found = {
        f"stick_{shear:g}": sum(right - left for left, right in state.zones["stick"]) / 2
        for shear, state in zip(SHEARS, states[1:])
    }
    return found, max(state.error_estimate for state in states)


def _cycle(chosen, states):
    """What a cycle dissipates and leaves behind, and the estimate."""
    pressed, full, unloaded, _, last = states
    scale = chosen.E_star / 2 * chosen.alpha[0]
    found = {
        "dissipation": (last.dissipation - full.dissipation) / chosen.unit,
        "moment": float(np.abs(pressed.micromoment).max()) / scale,
        "moment_left": float(np.abs(unloaded.micromoment).max()) / scale,
    }
    return found, max(state.error_estimate for state in states)


def looped(parameters, alpha, contact):
    """Shear over f P, and the mean of the slip with the pressure as weight, once around."""
    chosen, (pressed, *around) = parameters.history(alpha, contact, LOOP, DRAWN)
    size = chosen.friction * pressed.normal
    slips = [float(state.weights @ (state.pressure * state.slip)) / state.normal for state in around]
    return [
        {"shear": state.shear / size, "slip": slip - slips[0], "step": step}
        for step, (state, slip) in enumerate(zip(around, slips))
    ]


def result(parameters, quiet=True):
    """The case's object: a row for each law and size of the blocks, and the loops."""
    start = time.perf_counter()
    places = [(contact, alpha) for contact in parameters.contacts for alpha in parameters.alphas]
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
    axis.legend(frameon=False)
    return drawing


def stick(records):
    """Under microblocks what sticks hardly depends on the blocks' size; without corners it grows at first.

    Half of the length that sticks under a cylinder, over a_Hz, for three shear loads (full lines 0.25 f P,
    broken 0.5, dotted 0.75); bars are changes from states that are half as exact.

    Seen: three families of curves, one above the other; those of microblocks are nearly level.
    """
    lines = dict(zip(MEASURES, ("-", "--", ":")))
    return _curves(
        records,
        lines,
        r"stick $/a_\mathrm{Hz}$",
        lambda contact, name: contact if name == MEASURES[0] else None,
    )


def dissipation(records):
    """A cycle of shear dissipates less under microblocks than with one corner; least where blocks are 0.3 of
    the contact's half-width.

    Dissipation from full slip to full slip the other way and back, over P a_Hz^2/R, over the size of the
    blocks; bars are errors. Blocks on two corners turn with the cylinder before they slip; there, beside the
    least value, stands its share of what the unilateral law dissipates.

    Seen: two curves that fall slowly with alpha, those of the laws with one corner; below them that of
    microblocks, which falls to a third of them at 0.3, rises up to 0.8 and falls again.
    """
    from microblock.view import plots

    drawing = _curves(
        records,
        {"dissipation": "-"},
        r"dissipation$\;/(P a_\mathrm{Hz}^2 R^{-1})$",
        lambda contact, name: contact,
    )
    laws = grouped(grouped(records, "kind")["size"], "contact")
    if laws.keys() >= {"microblock", "unilateral"}:
        pairs = zip(laws["microblock"], laws["unilateral"])
        least, other = min(pairs, key=lambda pair: pair[0]["dissipation"])
        share = f"{least['dissipation'] / other['dissipation']:.0%} of\nunilateral"
        plots.label(drawing.axes[0], least["alpha"], least["dissipation"], share, plots.COLOURS[0], (0, -14))
    return drawing


def moment(records):
    """A cycle leaves micromoments behind.

    Largest micromoment without shear, pressed for the first time (full) and back from full slip (broken).

    Seen: for each law with moments two curves.
    """
    kept = [row for row in records if row["contact"] != "unilateral"]
    return _curves(
        kept,
        {"moment": "-", "moment_left": "--"},
        r"largest $|M|/(p_\mathrm{Hz}\ell)$",
        lambda contact, name: contact if name == "moment" else f"{contact}, after slip",
    )


def loop(records):
    """Under microblocks the loop of shear and slip is narrowest at blocks of some 0.3 of the half-width.

    Shear over f P against the mean slip, with the pressure as weight, from full slip around and back.

    Seen: closed loops of different width.
    """
    from microblock.view import plots

    drawing, axes = plots.figure(1, 1)
    axis = np.ravel(axes)[0]
    law = records[0]["contact"]  # the first one: microblocks as a rule
    own = [row for row in records if row["kind"] == "loop" and row["contact"] == law]
    by_size = grouped(own, "alpha")
    chosen = [alpha for alpha in by_size if alpha in (0.1, 0.3, 1.5)] or list(by_size)
    for colour, alpha in zip(plots.shades(len(chosen)), chosen):
        axis.plot(
            column(by_size[alpha], "slip"),
            column(by_size[alpha], "shear"),
            "o-",
            ms=2.0,
            color=colour,
            label=rf"$\alpha = {alpha:g}$",
        )
    axis.set(xlabel=r"mean slip $\cdot\, R/a_\mathrm{Hz}^2$", ylabel=r"$Q/(fP)$")
    axis.locator_params(axis="x", nbins=5)
    axis.legend(frameon=False)
    return drawing


FIGURES = {
    "friction_stick": (rows, stick),
    "friction_loop": (rows, loop),
    "friction_dissipation": (rows, dissipation),
    "friction_moment": (rows, moment),
}
