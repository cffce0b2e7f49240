"""Size effects under the sphere: radius, approach and hardness over the size of the blocks.

Geometry   the sphere on the half-space of `sphere`, at fixed load.
Equations  those of `sphere`, for the three laws.
Model      square cells of the surface on three grids (docs/theory/halfspace.md).
Reference  alpha -> 0: Hertz. alpha -> infinity: Hertz again, stiffer by 1 + (1 - nu) beta, for one corner;
           for microblocks four contacts of a quarter of the load each, one for each corner.
Look at    hardness falling with the size of the block under microblocks, rising under the unilateral law;
           the approach falls under both.
Units      those of `sphere`; hardness, the load over the area of contact, over P/(pi a_Hz^2).
"""

import time
from dataclasses import dataclass, replace

from tqdm import tqdm

import microblock as mb
from microblock.data.records import column

from ..common.options import Checked, coupling, option, poisson
from ..common.records import print_table, returned
from . import sphere

ALPHAS = (0.05, 0.1, 0.2, 0.35, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0)
MEASURES = ("radius", "approach", "hardness")
WORDS = {"radius": r"radius $a/a_\mathrm{Hz}$", "approach": r"approach $d R/a_\mathrm{Hz}^2$"}
WORDS["hardness"] = r"hardness over $P/(\pi a_\mathrm{Hz}^2)$"


@dataclass(frozen=True)
class Parameters(Checked):
    alphas: tuple = option(ALPHAS, "ratios ell/a_Hz", above=0, nargs="+", metavar="ALPHA", order="ascending")
    nu: float = poisson()
    beta: float = coupling()
    cells: int = option(128, "cells a side of the finest of three grids", int, at_least=128, at_most=2048)

    def relate(self):
        if self.cells % 4:
            raise mb.BadArgument("cells", self.cells, "must be a multiple of 4")

    def sphere(self, alpha, contact):
        """The parameters of `sphere` at one alpha."""
        return sphere.Parameters(alpha=alpha, nu=self.nu, beta=self.beta, contact=contact, cells=self.cells)


def solve(parameters, alpha, contact):
    """The measures on the finest grid, and their errors: the larger of its change and half of that before; of
    the radius no less than a quarter of a cell, as cells cut the rim into steps.
    """
    found = []
    for parts in (4, 2, 1):
        chosen = replace(parameters.sphere(alpha, contact), cells=parameters.cells // parts)
        (state,) = sphere.solve(chosen)
        seen = sphere.observe(chosen, state)
        found.append(
            {"radius": seen["radius"], "approach": seen["approach"], "hardness": seen["radius"] ** -2}
        )
    coarse, middle, fine = found
    errors = {
        f"{name}_error": max(abs(fine[name] - middle[name]), abs(middle[name] - coarse[name]) / 2)
        for name in MEASURES
    }
    steps = state.width / chosen.a_Hz / 4
    errors["radius_error"] = max(errors["radius_error"], steps)
    errors["hardness_error"] = max(errors["hardness_error"], 2 * fine["hardness"] * steps / fine["radius"])
    return {"contact": contact, "alpha": alpha, **fine, **errors}


def reference(parameters, contact):
    """Radius, approach and hardness for alpha -> infinity.

    Short waves see the compliance 2/(k E*) over 1 + (1 - nu) beta; a block on one corner, whose rotation
    gives way as well, has 1/(2 gamma' mu k) more. Hertz: a^3 ~ P/E*, d ~ a^2.
    """
    solid = parameters.sphere(1.0, contact).solid()
    softer = 1 / (1 + (1 - solid.nu) * solid.beta)
    contacts = 1
    if contact == "microblock":
        softer += 1 / (2 * solid.curvature * (1 - solid.nu))
        contacts = 4
    radius = (softer / contacts) ** (1 / 3)
    return {"radius": contacts**0.5 * radius, "approach": radius**2, "hardness": 1 / (contacts * radius**2)}


def result(parameters, quiet=True):
    """The case's object: a row for each law and alpha, and the other end."""
    start = time.perf_counter()
    places = [(contact, alpha) for contact in sphere.LAWS for alpha in parameters.alphas]
    rows = [solve(parameters, alpha, contact) for contact, alpha in tqdm(places, disable=quiet, unit="state")]
    ends = {contact: reference(parameters, contact) for contact in sphere.LAWS}
    return returned(parameters, start, states=rows, ends=ends)


def show(answer):
    """Print the states, and the end of large blocks below."""
    shown = ("contact", "alpha", *(name for one in MEASURES for name in (one, f"{one}_error")))
    print_table(answer["states"], shown)
    print_table(
        [{"alpha -> infinity": contact, **end} for contact, end in answer["ends"].items()],
        ("alpha -> infinity", *MEASURES),
    )


def rows(parameters, answer):
    """A row for each law and alpha, with the end of large blocks."""
    return [
        {**row, **{f"{name}_end": value for name, value in answer["ends"][row["contact"]].items()}}
        for row in answer["states"]
    ]


def figure(records):
    """Under microblocks a sphere touches more as blocks grow, so that the hardness falls, though it sinks in
    less.

    Radius (a), approach (b) and hardness (c), the load over the area of contact, of a sphere at a fixed load
    over the size of the blocks, each over Hertz's; bars are errors by three grids. Short lines at the right
    are the ends for large blocks. The law microblock ends with four contacts of a quarter of the load, one
    for each corner: together wider than one, and less deep. With one corner the hardness rises instead.

    Seen: curves that leave 1 as blocks grow; in (a) that of microblocks rises, the others fall; in (b) all
    fall, that of microblocks the furthest; in (c) that of microblocks falls, the others rise.
    """
    from microblock.view import plots

    drawing, axes = plots.figure(3, 1, height=1.5, sharex=True)
    for contact in sphere.LAWS:
        chosen = [row for row in records if row["contact"] == contact]
        alpha = column(chosen, "alpha")
        for axis, name in zip(axes, MEASURES):
            bars = axis.errorbar(
                alpha, column(chosen, name), column(chosen, f"{name}_error"), fmt="o-", ms=2.5, label=contact
            )
            end = chosen[0][f"{name}_end"]
            axis.plot((1.15 * alpha[-1], 1.8 * alpha[-1]), (end, end), color=bars[0].get_color())
    for axis, name in zip(axes, MEASURES):
        axis.set(xscale="log", ylabel=WORDS[name])
    axes[-1].set_xlabel(r"$\alpha = \ell/a_\mathrm{Hz}$")
    axes[1].legend(frameon=False, loc="lower left")
    plots.letter(axes)
    return drawing


FIGURES = {"sphere_size": (rows, figure)}
