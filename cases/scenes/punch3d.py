"""Flat punch pressed on a block with microblocks in three dimensions, beside the half-space.

Geometry   block |x1|, |x2| < size, -size < x3 < 0, its bottom constrained, its sides free; a rigid punch with
           a square or round flat face. A quarter is modelled, with two planes of symmetry.
Equations  (10)-(17) in three dimensions, gaps of four corners, conditions (26) on each.
Model      hexahedra, smaller below the punch, condensed to their contact nodes; two sizes of the block. The
           rim of the face lies between two rows of nodes, where the areas of the last ones end.
Reference  the half-space on square cells, which shares neither mesh nor kernel with it, and for small blocks
           the classical punch.
Look at    corners of blocks beside the face that still stand below it; pressure and micromoment beside those
           of the half-space; the approach, which the finite size takes 1/size from.
Units      lengths over the half-width of the face, pressures over P over its area, M over that times ell,
           approach as d E* half-width/P.
"""

import time
from dataclasses import dataclass

import numpy as np

import microblock as mb
from microblock.fem import meshes3d

from ..common.case import of_kinds, over
from ..common.laws import LAWS
from ..common.options import Checked, coupling, option, poisson
from ..common.records import print_table, returned

FACES = {"square": 4.0, "round": np.pi}  # and their areas
GROWTH = 1.8  # of the elements away from the punch
SHOWN = ("model", "size", "unknowns", "approach", "pressure_centre", "contact_area", "residual", "seconds")
DEEP = 0.5  # depth of the small elements


@dataclass(frozen=True)
class Parameters(Checked):
    alpha: float = option(0.5, "size of a block over the half-width of the face", above=0)
    face: str = option("square", "face of the punch", str, choices=tuple(FACES))
    contact: str = option("microblock", "contact law", str, choices=tuple(LAWS))
    nu: float = poisson()
    beta: float = coupling()
    size: float = option(10.0, "half-width and depth of the block over the half-width of the face", above=2)
    facets: int = option(8, "facets along the half-width of the face", int, at_least=2, at_most=40)
    order: int = option(1, "order of the elements", int, at_least=1, at_most=4)
    cells: int = option(96, "cells a side of the half-space beside it", int, at_least=32, at_most=1024)

    def solid(self):
        return mb.Cosserat(E=1 - self.nu**2, nu=self.nu, ell=self.alpha, beta=self.beta)

    def problem(self, body, method=None):
        return mb.Contact(body, mb.FlatPunch(1.0, self.face), LAWS[self.contact](), method)

    @property
    def reach(self):
        """Half of the side of the contact boundary: corners stand half of a block beside their nodes."""
        return 1 + self.step + (self.alpha / 2 if self.contact == "microblock" else 0)

    @property
    def step(self):
        """Length of a facet below the punch, whose rim is where the area of the last node ends."""
        return 1 / (self.facets + 1 / (self.order * (self.order + 1)))

    def block(self, size):
        """A quarter of the block."""
        step = self.step
        x = meshes3d.graded(step * np.ceil(self.reach / step - 1e-9), step, size, GROWTH)
        depth = meshes3d.graded(DEEP, step, size, GROWTH)
        mesh = meshes3d.block(x, x, -depth[::-1], reach=self.reach)
        fixed = meshes3d.supports("bottom", x1="left", x2="front")
        return mb.Body3D(mesh, self.solid(), self.order, fixed=fixed)


def solve(parameters):
    """{model: (size, state, seconds)}; the load is 1, a quarter of it on a quarter of the block."""
    found = {}
    for name, size in (("half of the size", parameters.size / 2), ("block", parameters.size)):
        start = time.perf_counter()
        state = parameters.problem(parameters.block(size)).solve(load=0.25)
        found[name] = size, state, time.perf_counter() - start
    start = time.perf_counter()
    cells = mb.Cells(nodes=parameters.cells, residual=1e-6)
    state = parameters.problem(mb.HalfSpace(parameters.solid()), cells).solve(load=1.0)
    found["half-space"] = None, state, time.perf_counter() - start
    return found


def reference(parameters):
    """Approach of the classical punch on the half-space: 1/2 of a round face, 0.4378 of a square one (King,
    Int. J. Solids Struct. 23 (1987) 1657: 2 times 1.012 times the root of the area over pi).
    """
    return 0.5 if parameters.face == "round" else np.sqrt(np.pi / 4) / (2 * 1.012)


def observe(parameters, name, size, state, seconds):
    """What the case returns of a state."""
    mean = 1 / FACES[parameters.face]
    cut = axis(state)
    return {
        "model": name,
        "size": size,
        "unknowns": state.unknowns,
        "approach": state.approach,
        "pressure_centre": float(cut["pressure"][np.argmin(np.abs(cut["x1"]))] / mean),
        "contact_area": state.contact_area * (1 if size is None else 4),
        "residual": state.residual,
        "iterations": state.iterations,
        "warnings": list(state.warnings),
        "seconds": seconds,
        "profile": over(cut, {"x1": 1, "pressure": mean, "m2": mean * parameters.alpha}),
    }


def axis(state):
    """x1, pressure and M2 along x2 = 0, from the middle outwards."""
    if hasattr(state, "along"):
        cut = state.along("x1")
        half = cut["x1"] > 0
        return {name: cut[name][half] for name in ("x1", "pressure", "m2")}
    row = np.flatnonzero(state.x2 == 0)
    return {"x1": state.x1[row], "pressure": state.pressure[row], "m2": state.micromoment[1][row]}


def result(parameters, quiet=True):
    """The case's object: a state for each model, and the approach of an unbounded block."""
    start = time.perf_counter()
    found = solve(parameters)
    states = [observe(parameters, name, *one) for name, one in found.items()]
    near, block, half = (state["approach"] for state in states)
    answer = returned(parameters, start, states=states, approach_unbounded=2 * block - near)
    answer["approach_classical"] = float(reference(parameters))
    answer["nodes"] = _nodes(parameters, found["block"][1])
    return answer


def _nodes(parameters, state):
    """Records of the contact nodes."""
    mean = 1 / FACES[parameters.face]
    moment = np.hypot(*state.micromoment) / (mean * parameters.alpha)
    return {
        "x1": state.x1.tolist(),
        "x2": state.x2.tolist(),
        "pressure": (state.pressure / mean).tolist(),
        "moment": moment.tolist(),
        "closed": state.closed.tolist(),
    }


def show(answer):
    """Print the states, and the approach of an unbounded block from both sizes."""
    print_table(answer["states"], SHOWN)
    half = answer["states"][-1]["approach"]
    found = answer["approach_unbounded"]
    print(
        f"approach of an unbounded block: {found:.4f}, of the half-space {half:.4f} ({found / half - 1:+.1%})"
    )
    print(f"classical, for small blocks and the unilateral law: {answer['approach_classical']:.4f}")
    for state in answer["states"]:
        for words in state["warnings"]:
            print(f"{state['model']}: {words}")


def rows(parameters, answer):
    """Contact nodes, and the cuts of block and half-space along x1."""
    tables = {"node": [dict(zip(answer["nodes"], one)) for one in zip(*answer["nodes"].values())]}
    for state in answer["states"][1:]:
        profile = state["profile"]
        tables[state["model"]] = [
            {"x1": x1, "x2": 0.0, "pressure": p, "moment": abs(m), "closed": None}
            for x1, p, m in zip(*profile.values())
        ]
    return of_kinds(**tables)


def figure(records):
    """Blocks beside a flat face still stand below it with some of their corners, which spreads its pressure:
    finite elements and half-space agree.

    Pressure, number of closed corners and length of the micromoment at the contact nodes of a quarter of the
    block, from above; and pressure and micromoment along x1, of the block (marks) and of the half-space
    (lines). Lengths over the half-width of the face.

    Seen: three maps of a quarter and one diagram; the pressure is highest in bands along the rim of the face
    and does not end there.
    """
    from microblock.data.records import column, grouped
    from microblock.view import plots
    from microblock.view.nodes_figure import closed_nodes

    kinds = grouped(records, "kind")
    x1, x2, pressure, moment, closed = (
        np.array(column(kinds["node"], name)) for name in ("x1", "x2", "pressure", "moment", "closed")
    )
    drawing, axes = plots.figure(2, 2, height=2.5, width=6.0)
    for panel, values, label in (
        (axes[0, 0], pressure, r"pressure $p A/P$"),
        (axes[1, 0], moment, r"micromoment $|M| A/(P\ell)$"),
    ):
        shown = panel.tripcolor(x1, x2, values, shading="gouraud", cmap="cividis", rasterized=True)
        panel.set_title(label)
        drawing.colorbar(shown, ax=panel, shrink=0.9, pad=0.02)
    closed_nodes(axes[0, 1], x1, x2, closed.astype(int), max(1, int(closed.max())))
    for panel in (axes[0, 0], axes[0, 1], axes[1, 0]):
        panel.set(xlabel="$x_1/a$", ylabel="$x_2/a$", aspect="equal")
    cut = axes[1, 1]
    for kind, marks in (("block", "o"), ("half-space", "-")):
        x = column(kinds[kind], "x1")
        for name, colour, label in (
            ("pressure", plots.COLOURS[0], "$p A/P$"),
            ("moment", plots.COLOURS[1], r"$|M_2| A/(P\ell)$"),
        ):
            words = label if kind == "half-space" else None
            cut.plot(x, column(kinds[kind], name), marks, color=colour, markersize=3, label=words)
    cut.set(xlabel="$x_1/a$", xlim=(0, x1.max()))
    cut.set_title("along $x_1$: marks elements, lines half-space", fontsize="small")
    cut.legend(frameon=False)
    return drawing


FIGURES = {"punch3d": (rows, figure)}
