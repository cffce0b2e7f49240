"""Self-affine surface pressed on a half-space with microblocks: how much of it touches.

Geometry   half-space x3 < 0; a rigid self-affine surface of one period (seeded phases) pressed down by a mean
           pressure; blocks are cubes of side ell and touch with four corners.
Equations  (10)-(17) in the half-space, gaps of four corners, conditions (26) on each.
Model      one period of uniform cells, products by FFT (docs/theory/halfspace.md), from load to load.
Reference  the classical half-space: beta -> 0 under the unilateral law, and the straight line of small loads,
           A/A0 = kappa p0/(E* h'), kappa = sqrt(8/pi) = 1.6 (Persson) to sqrt(2 pi) = 2.5 (Bush, Gibson and
           Thomas); the program tamaas on the same cells.
Look at    the fraction that touches over the mean pressure p0, for the three laws and the classical limit.
Units      lengths over the period, pressures over E* times the root mean square slope h'; ell over the
           shortest wave is alpha.
"""

import math
import time
from dataclasses import dataclass

import numpy as np

import microblock as mb
from microblock.data.records import column

from ..common.options import Checked, coupling, option, poisson
from ..common.records import print_table, returned

LAWS = {
    "classical": mb.Unilateral,
    "unilateral": mb.Unilateral,
    "microclamped": mb.Microclamped,
    "microblock": mb.Microblock,
}
NO_COUPLING = 1e-9  # beta of the classical half-space
SLOPE = 0.1
LOADS = (0.003, 0.01, 0.03, 0.1, 0.3, 1.0)
SHOWN = ("law", "load", "contact", "full", "kappa", "kappa_rim", "approach", "error_estimate")
# part of a cell that each side between cells that touch and cells that do not adds to the area (Yastrebov,
# Anciaux and Molinari 2017)
RIM = (math.pi - 1 + math.log(2)) / 24
BAND = math.sqrt(8 / math.pi), math.sqrt(2 * math.pi)  # kappa of Persson, and of Bush, Gibson and Thomas


@dataclass(frozen=True)
class Parameters(Checked):
    alpha: float = option(0.5, "size of a block over the shortest wave", above=0)
    loads: tuple = option(
        LOADS, "mean pressures over E* times the slope", above=0, nargs="+", metavar="LOAD", order="ascending"
    )
    cells: int = option(256, "cells a side", int, at_least=32, at_most=2048)
    seed: int = option(1, "seed of the phases", int, at_least=0)
    hurst: float = option(0.8, "exponent of the surface, 0 to 1", at_least=0, at_most=1)
    longest: int = option(2, "longest waves, in waves to the period", int, at_least=1)
    shortest: int = option(16, "shortest waves, in waves to the period", int, at_least=1)
    nu: float = poisson()
    beta: float = coupling()

    def relate(self):
        if self.longest > self.shortest:
            raise mb.BadArgument("longest", self.longest, "must not be larger than --shortest")
        if self.cells < 4 * self.shortest:
            raise mb.BadArgument(
                "cells", self.cells, f"must be at least four to the shortest wave, {4 * self.shortest}"
            )

    @property
    def surface(self):
        return mb.RoughSurface(1.0, SLOPE, self.hurst, (self.longest, self.shortest), self.seed)

    def problem(self, law):
        """The Contact of a law of `LAWS`; E* times the slope is 1."""
        beta = NO_COUPLING if law == "classical" else self.beta
        solid = mb.Cosserat((1 - self.nu**2) / SLOPE, self.nu, self.alpha / self.shortest, beta=beta)
        return mb.Contact(
            mb.HalfSpace(solid, period=1.0), self.surface, LAWS[law](), mb.Cells(nodes=self.cells)
        )


def solve(parameters, law):
    """The SurfaceState at each load, ascending, each begun from the one before."""
    problem, states = parameters.problem(law), []
    for load in parameters.loads:
        states.append(problem.solve(load=load, initial=states[-1] if states else None))
    return states


def reference(parameters, load):
    """The pressures on the same cells of the classical half-space, by tamaas."""
    import tamaas

    tamaas.initialize(1)  # threads
    tamaas.set_log_level(tamaas.LogLevel.error)
    x = (np.arange(parameters.cells) + 0.5) / parameters.cells - 0.5
    model = tamaas.ModelFactory.createModel(
        tamaas.model_type.basic_2d, [1.0, 1.0], [parameters.cells, parameters.cells]
    )
    model.E, model.nu = 1 / SLOPE, 0.0
    surface = -parameters.surface.height(*np.meshgrid(x, x, indexing="ij"))
    tamaas.PolonskyKeerRey(model, surface, 1e-9).solve(load)
    return np.array(model.traction)


def observe(law, state):
    """What the case returns of a state; `kappa` as counted by cells, `kappa_rim` without what a rim of cells
    adds.
    """
    touches = state.closed > 0
    contact = float(np.mean(touches))
    sides = sum(float(np.mean(touches != np.roll(touches, 1, axis))) for axis in (0, 1))
    return {
        "law": law,
        "load": state.load,
        "contact": contact,
        "full": float(np.mean(state.closed >= min(len(state.pressures), 3))),
        "kappa": contact / state.load,
        "kappa_rim": (contact - RIM * sides) / state.load,
        "pressure_max": float(state.pressure.max()),
        "approach": state.approach / SLOPE,
        "iterations": state.iterations,
        "residual": state.residual,
        "error_estimate": state.error_estimate,
    }


def result(parameters, quiet=True):
    """The case's object: a row for each law and load."""
    start = time.perf_counter()
    rows = [observe(law, state) for law in LAWS for state in solve(parameters, law)]
    return returned(parameters, start, states=rows)


def show(answer):
    print_table(answer["states"], SHOWN)


def rows(parameters, answer):
    """A row for each law and load."""
    return answer["states"]


def figure(records):
    """More of a rough surface touches where microblocks have half the size of its shortest waves; less does
    where blocks have one corner.

    (a) The fraction of a self-affine surface that touches, over the mean pressure; blocks count that touch
    with a corner. (b) The same over the pressure: kappa. The classical curve (dashed) begins at the upper rim
    of the band of the theories for small pressures, Persson (lower) and Bush, Gibson and Thomas (upper); they
    have no microstructure, so that the other laws may leave it. In (b) what cells at the rims of contacts
    count too much is taken off. This one surface is 1.5 % beyond the band at the smallest pressure, where few
    contacts are left.

    Seen: four curves that rise and lie close together; in (b) all fall, that of microblocks from above the
    band, the classical one from its upper rim, the two of one corner from its lower rim.
    """
    from microblock.view import plots

    drawing, axes = plots.figure(2, 1, height=1.8, sharex=True)
    for law in LAWS:
        chosen = [row for row in records if row["law"] == law]
        load, contact = np.array(column(chosen, "load")), np.array(column(chosen, "contact"))
        style = (
            {"color": "0.4", "linestyle": "--"} if law == "classical" else {"marker": "o", "markersize": 3}
        )
        axes[0].plot(load, contact, label=law, **style)
        axes[1].plot(load, column(chosen, "kappa_rim"), **style)
    axes[1].axhspan(*BAND, color="0.9", zorder=0)
    plots.label(
        axes[1], LOADS[-1], BAND[1], "classical theories,\nsmall pressures", "0.35", (0, -10), ha="right"
    )
    axes[0].set(xscale="log", yscale="log", ylabel="fraction that touches $A/A_0$")
    axes[1].set(xscale="log", ylabel=r"$\kappa = (A/A_0)\, E^* h'/p_0$")
    axes[1].set_xlabel("mean pressure $p_0/(E^* h')$")
    axes[0].legend(frameon=False)
    plots.letter(axes)
    return drawing


FIGURES = {"rough3d": (rows, figure)}
