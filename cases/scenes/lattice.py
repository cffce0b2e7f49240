"""Cylinder on rigid blocks with elastic interfaces: the microstructure that the law idealises.

Geometry   half-plane of blocks of side b in rows and columns, joined by interfaces with normal and shear
           springs; a rigid cylinder pressed on the corners of the blocks of the surface.
Equations  balance of forces and couples on each block; conditions (26) on each corner, exact here.
Model      surface of the blocks from Fourier sums over a period of 2 far, images taken away to leading order;
           contact by block pivoting. Beside it the continuum with the moduli of long waves, ell = b, and
           the laws, on panels, averaged over each block.
Reference  closed forms of the blocks (cases/common/blocks.py), and of the couples in full contact.
Look at    forces agree better the smaller the blocks are; couples on the blocks stay about four times those
           of the continuum, as derived (docs/theory/lattice.md).
Units      a_Hz = R = 1, that of the cylinder at the load 1: lengths over a_Hz, forces on a block over p_Hz b,
           couples over p_Hz b^2; loads are multiples of P. Springs and E are stresses in one unit.
"""

import time
from dataclasses import dataclass

import numpy as np

import microblock as mb
from microblock.data.records import column, grouped

from ..common.blocks import BlockHalfPlane, Springs, identified
from ..common.laws import LAWS
from ..common.options import Checked, option
from ..common.records import print_table, returned

RTOL = 1e-6  # of the continuum, relative to the pressure: couples of small blocks are 1e-2 of it times ell
MOST_UNEQUAL = 100  # springs; beyond it layers are many blocks thick, or nothing beside a block
ISOTROPIC = 1e-12  # of the ratio of the springs
MOST_BLOCKS = 512  # from the middle to the last one that may touch: matrices of 2000 corners
DERIVED = "microblock, derived couple"
# of the study of convergence: blocks on a_Hz, and places of the middle block over b
SIZES, SHIFTS = (4, 8, 16, 32, 64), (0.0, 0.25, 0.5)
NOT_ISOTROPIC = "unequal springs: the solid of long waves is not isotropic, as the half-plane has to be"


@dataclass(frozen=True)
class Parameters(Checked):
    blocks_per_a: float = option(8.0, "blocks on Hertz's half-width at the load 1", at_least=1, at_most=256)
    spring: tuple = option(
        (1.0, 1.0),
        "normal and shear stiffness of the interfaces per length, times b",
        above=0,
        nargs=2,
        metavar=("NORMAL", "SHEAR"),
    )
    far: float = option(9.0, "half of the period of the Fourier sums over a_Hz", above=0, at_most=1000)
    loads: tuple = option((1.0,), "loads, multiples of P", above=0, nargs="+", metavar="LOAD")
    shift: float = option(
        0.0, "place of the middle block over b: 0 under the apex, 1/2 a joint there", at_least=0, at_most=0.5
    )

    def relate(self):
        if len(self.spring) != 2:
            raise mb.BadArgument("spring", self.spring, "must be two stiffnesses, normal and shear")
        if max(self.spring) > MOST_UNEQUAL * min(self.spring):
            raise mb.BadArgument(
                "spring", self.spring, f"must not differ by more than a factor {MOST_UNEQUAL}"
            )
        if self.reach * self.blocks_per_a > MOST_BLOCKS:
            raise mb.BadArgument(
                "loads",
                self.loads,
                f"press on more than {MOST_BLOCKS} blocks on either side; take fewer --blocks-per-a",
            )
        if self.far < 2 * self.reach:
            raise mb.BadArgument(
                "far", self.far, f"must be at least {2 * self.reach:g} for these blocks and loads"
            )

    @property
    def b(self):
        return 1 / self.blocks_per_a

    @property
    def springs(self):
        return Springs(*self.spring)

    @property
    def P(self):
        return np.pi * self.springs.E_star / 4

    @property
    def p_Hz(self):
        return self.springs.E_star / 2

    @property
    def reach(self):
        """Distance from the apex within which blocks may touch."""
        return 1.2 * max(self.loads) ** 0.5 + 3 * self.b

    @property
    def isotropic(self):
        return abs(self.spring[0] / self.spring[1] - 1) < ISOTROPIC

    def solid(self, curvature=None):
        """The continuum of long waves, or with another gamma'."""
        moduli = self.springs.moduli
        return mb.Cosserat(
            E=moduli["E"],
            nu=moduli["nu"],
            ell=self.b,
            beta=moduli["beta"],
            curvature=curvature or moduli["gamma'"],
        )

    def body(self):
        """The half-plane of blocks."""
        most = int(np.ceil(self.reach / self.b))
        x = (np.arange(-most, most + 1) + self.shift) * self.b
        return BlockHalfPlane(self.solid(), self.springs, x, 2 * int(np.ceil(self.far / self.b)))


def problems(parameters):
    """{name: contact problem} of the blocks and, where they are isotropic, of the continua beside them."""
    cylinder = mb.Cylinder(R=1.0)
    found = {"blocks": mb.Contact(parameters.body(), cylinder, mb.Microblock())}
    if parameters.isotropic:
        for name, law in LAWS.items():
            found[name] = mb.Contact(mb.HalfPlane(parameters.solid()), cylinder, law())
        derived = parameters.solid(parameters.springs.full_contact_couple)  # nu = 0
        found[DERIVED] = mb.Contact(mb.HalfPlane(derived), cylinder, mb.Microblock())
    return found


def solve(parameters, load, given=None):
    """{name: state} of the blocks and the continua at a multiple of P."""
    states = {}
    for name, problem in (given or problems(parameters)).items():
        states[name] = problem.solve(load=load * parameters.P, rtol=None if name == "blocks" else RTOL)
    blocks = states["blocks"]
    if (blocks.pressure[[0, 1, -2, -1]] > 0).any():
        raise mb.NotConverged(f"the contact at load {load:g} reaches the last block; take a smaller load")
    return states


def over_blocks(state, x, b):
    """Forces and couples of a continuum on blocks with centres x, arrays (n,): integrals over b.

    Panels between the borders of blocks and of zones; points gather at their ends, where pressures may have
    square roots.
    """
    borders = np.append(x - b / 2, x[-1] + b / 2)
    edges = np.array([edge for zones in state.zones.values() for pair in zones for edge in pair])
    inside = edges[(edges > borders[0]) & (edges < borders[-1])]
    ends = np.unique(np.concatenate((borders, inside)))
    gauss, weights = np.polynomial.legendre.leggauss(12)
    part = (gauss + 1) / 2
    place, weights = part**2 * (3 - 2 * part), 3 * part * (1 - part) * weights
    lengths = np.diff(ends)[:, None]
    points, weights = (ends[:-1, None] + lengths * place).ravel(), (lengths * weights).ravel()
    block = np.searchsorted(borders[1:-1], points)
    forces = np.bincount(block, weights * state.pressure_at(points), len(x))
    if len(state.pressures) == 1:
        return forces, np.zeros(len(x))
    difference = state.pressure_at(points, corner="A") - state.pressure_at(points, corner="B")
    return forces, np.bincount(block, weights * b / 2 * difference, len(x))


def loads_on_blocks(parameters, states):
    """x (n,) and {name: (forces, couples)} on the blocks, normalised."""
    b, blocks = parameters.b, states["blocks"]
    found = {"blocks": (blocks.pressure * b, blocks.micromoment * b)}
    for name, state in states.items():
        if name != "blocks":
            found[name] = over_blocks(state, blocks.x, b)
    unit = parameters.p_Hz * b
    return blocks.x, {
        name: (forces / unit, couples / (unit * b)) for name, (forces, couples) in found.items()
    }


def difference(values, blocks):
    """Difference in L2, over the norm of the blocks' values."""
    return float(np.linalg.norm(values - blocks) / np.linalg.norm(blocks))


def observe(parameters, load, states):
    """What the case returns of one load."""
    x, found = loads_on_blocks(parameters, states)
    compared = {}
    for kind, name in enumerate(("forces", "couples")):
        own = found["blocks"][kind]
        beside = {law: values[kind] for law, values in found.items() if law != "blocks"}
        if kind:
            beside.pop("microclamped", None)  # its couples are reactions, of which panels know nothing
        compared[name] = {
            "blocks": own.tolist(),
            "continuum": beside["microblock"].tolist() if beside else None,
            "derived": beside[DERIVED].tolist() if beside else None,
            "difference": difference(beside["microblock"], own) if beside else None,
            "differences": {law: difference(values, own) for law, values in beside.items()},
        }
    return {
        "load": load,
        "half_width": {name: state.half_width for name, state in states.items()},
        "residual": states["blocks"].residual,
        "x": x.tolist(),
        **compared,
    }


def convergence(sizes, shifts=(0.0, 0.5), core=None):
    """Differences in L2 at the load 1 for equal springs: {(name, quantity): array (sizes, shifts)}.

    `core`: of the blocks within that distance from the apex alone.
    """
    found = {}
    for size in sizes:
        for shift in shifts:
            parameters = Parameters(blocks_per_a=size, shift=shift)
            x, loads = loads_on_blocks(parameters, solve(parameters, 1.0))
            kept = np.abs(x) < (core or np.inf)
            for name, values in loads.items():
                for kind, quantity in enumerate(("forces", "couples")):
                    one = difference(values[kind][kept], loads["blocks"][kind][kept])
                    found.setdefault((name, quantity), []).append(one)
    return {key: np.reshape(values, (len(sizes), len(shifts))) for key, values in found.items()}


def order(sizes, differences):
    """(order of convergence in b, its standard error) from the differences of `convergence`."""
    numbers = np.repeat(np.log(sizes), differences.shape[1])
    fit, covariance = np.polyfit(numbers, np.log(differences.ravel()), 1, cov=True)
    return float(-fit[0]), float(covariance[0, 0] ** 0.5)


def moduli(parameters):
    """Moduli from waves on the blocks, their closed form and the residual of the fit."""
    exact = parameters.springs.moduli
    return {
        name: {"value": value, "closed_form": exact[name], "residual": residual}
        for name, (value, residual) in identified(parameters.springs).items()
    }


def result(parameters, quiet=True):
    """The case's object: moduli, a state for each load, forces and couples at the last one."""
    start = time.perf_counter()
    given = problems(parameters)
    states = [observe(parameters, load, solve(parameters, load, given)) for load in parameters.loads]
    return returned(
        parameters,
        start,
        moduli=moduli(parameters),
        decay=parameters.springs.decay,
        full_contact_couple=parameters.springs.full_contact_couple,
        forces=states[-1]["forces"],
        couples=states[-1]["couples"],
        states=states,
        reason=None if parameters.isotropic else NOT_ISOTROPIC,
    )


def show(answer):
    """Print the moduli and the differences."""
    print_table(
        [{"modulus": name, **values} for name, values in answer["moduli"].items()],
        ("modulus", "value", "closed_form", "residual"),
        9,
    )
    rows = [
        {
            "load": state["load"],
            "continuum": law,
            "forces": value,
            "couples": state["couples"]["differences"].get(law),
        }
        for state in answer["states"]
        for law, value in state["forces"]["differences"].items()
    ]
    if rows:
        print("differences in L2")
        print_table(rows, ("load", "continuum", "forces", "couples"))
    else:
        print(f"no continuum beside the blocks ({answer['reason']})")


def rows(parameters, answer):
    """A row a block at each load."""
    names = [(kind, name) for kind in ("forces", "couples") for name in ("blocks", "continuum", "derived")]
    return [
        {
            "load": state["load"],
            "x": x,
            **{f"{kind}_{name}": (state[kind][name] or {i: None})[i] for kind, name in names},
        }
        for state in answer["states"]
        for i, x in enumerate(state["x"])
    ]


def figure(records):
    """Forces on the blocks are those of the continuum; couples are about four times as large, as derived.

    Markers: blocks at the last load; lines: continuum with the moduli of long waves, and with the couple
    derived from the blocks in full contact, averaged over each block.

    Seen: forces (a) on an ellipse; couples (b), odd about the apex, with markers far from the first line and
    on the second one except at the two ends.
    """
    from microblock.view import plots

    drawing, axes = plots.figure(2, 1, height=1.9, sharex=True)
    nodes = list(grouped(records, "load").values())[-1]
    x = column(nodes, "x")
    lines = ("continuum", "long waves", "-"), ("derived", "derived couple", "--")
    for axis, kind in zip(axes, ("forces", "couples")):
        axis.plot(x, column(nodes, f"{kind}_blocks"), "o", color=plots.COLOURS[1], label="blocks")
        for number, (name, words, look) in enumerate(lines):
            if nodes[0][f"{kind}_{name}"] is not None:
                axis.plot(
                    x, column(nodes, f"{kind}_{name}"), look, color=plots.COLOURS[2 * number], label=words
                )
    axes[0].set_ylabel(r"force$/(p_\mathrm{Hz} b)$")
    axes[1].set(xlabel=r"$x_1/a_\mathrm{Hz}$", ylabel=r"couple$/(p_\mathrm{Hz} b^2)$")
    plots.letter(axes)
    plots.legend_of_all(drawing, axes[0])
    return drawing


def convergence_rows(parameters, answer):
    """Records of `convergence`, for equal springs: a difference for each size, place, law and quantity."""
    if parameters.springs.normal != parameters.springs.shear:
        return []
    return [
        {
            "curve": f"{quantity}, {name}",
            "blocks_per_a": size,
            "shift": shift,
            "difference": float(values[i, j]),
        }
        for (name, quantity), values in convergence(SIZES, SHIFTS).items()
        if name != "blocks" and (quantity == "forces" or name in ("microblock", DERIVED))
        for i, size in enumerate(SIZES)
        for j, shift in enumerate(SHIFTS)
    ]


def convergence_figure(records):
    """With smaller blocks forces become those of every law, couples those of none: of the microblock law
    three quarters of them are missing, and a derived factor mends that but for the ends of the contact.

    Differences in L2 over all blocks; marks: means over three places of the cylinder, bars from the least to
    the largest; orders are fitted, with their standard errors.

    Seen: three falling lines of forces, nearly straight, and two level ones of couples above.
    """
    from microblock.view import plots

    drawing, axis = plots.figure(height=3.3)
    curves = {words: own for words, own in grouped(records, "curve").items() if words != f"forces, {DERIVED}"}
    for number, (words, own) in enumerate(curves.items()):
        values = np.reshape(column(own, "difference"), (len(SIZES), len(SHIFTS)))
        mean, falls = values.mean(axis=1), words.startswith("forces")
        if falls:
            words += ": order {:.2f} ± {:.2f}".format(*order(SIZES, values))
        axis.errorbar(
            SIZES,
            mean,
            (mean - values.min(axis=1), values.max(axis=1) - mean),
            color=plots.COLOURS[number],
            marker=plots.MARKERS[number],
            linestyle="-" if falls else "--",
            label=words,
            capsize=2,
        )
    axis.set(xscale="log", yscale="log", ylabel="difference in L2")
    axis.set_xlabel(r"blocks on $a_\mathrm{Hz}$")
    axis.set_xticks(SIZES, [str(size) for size in SIZES])
    axis.minorticks_off()
    drawing.legend(*axis.get_legend_handles_labels(), loc="outside upper left", ncols=1)
    return drawing


FIGURES = {"lattice": (rows, figure), "lattice_convergence": (convergence_rows, convergence_figure)}
