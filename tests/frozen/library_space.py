"""Frozen problems in three dimensions in the names of the library, beside `tests.frozen.library`.

`solve` makes a state of a problem, `measured` numbers of a state: integrals over the contact, what single
nodes or cells have, and fields in the body.
"""

from functools import cache

import ngsolve as ng
import numpy as np
from ngsolve.meshes import MakeStructured3DMesh

import microblock as mb
from microblock.contact_solvers.corner_forces import least_norm_where_closed
from microblock.contact_solvers.fft_compliance import Grid
from microblock.fem import meshes, meshes3d
from microblock.fem.contact_nodes import ContactNodes
from microblock.fem.loads import Loads
from microblock.halfplane.kernels import at_rest, normal_symbol
from microblock.halfspace import kernels, second_half_space, symbol
from microblock.model.corner_geometry import Blocks

from . import problems_space as given
from .library import copies, material, with_contact

WARNINGS = {  # kinds of warnings, by words that a text of the kind has
    "rough": "pressures and edges are rough",
    "few nodes": "nodes in contact: take a finer mesh",
    "deep": "deep into a body",
    "long elements": "do not resolve the layer",
    "beside": "beside the contact boundary",
    "between nodes": "between nodes",
    "cut": "window cuts the contact",
    "outside": "outside of the window",
    "between cells": "between cells",
}
METHODS = {"condensed": mb.Condensed, "al": mb.Newton, "penalty": lambda **rho: mb.Newton("penalty", **rho)}
BRIEF = "load", "approach", "energy", "energy of fields", "pressure squared", "pressure x1"
BRIEF += "contact area", "micromoment squared 1", "psi squared 2"
RESIDUAL = 1e-12  # of cells: a tenth of the digits of a row at most are the solver's


def _made(pair):
    """A law or an obstacle of its name and arguments, or a function of its name."""
    if isinstance(pair, str):
        return given.FUNCTIONS[pair]
    name, options = pair
    options = {key: _functions(value) for key, value in options.items()}
    return getattr(mb, name)(**options)


def _functions(value):
    if isinstance(value, tuple):
        return tuple(map(_functions, value))
    return given.FUNCTIONS.get(value, value) if isinstance(value, str) else value


X = np.linspace(0, 1, 5)
GRADED = meshes3d.graded(reach=0.6, step=0.15, far=2.0, growth=2.0)
MESHES = {  # all but the quarter are 1 x 1 wide; their contact boundary is "contact"
    "block": lambda: meshes3d.block(X, X, X[:3] - X[2]),
    "coarse": lambda: meshes3d.block(X[::2], X[::2], X[:2] - X[1]),
    "quarter": lambda: meshes3d.block(GRADED, GRADED, -GRADED[[-1, 5, 2, 0]], reach=0.6),
    "two heights": lambda: _raised(meshes3d.block(np.linspace(0, 1, 6), X[::2], X[:3:2] - X[2])),
    "tetrahedra": lambda: with_contact(
        MakeStructured3DMesh(hexes=False, nx=3, nz=2, mapping=lambda x, y, z: (x, y, (z - 1) / 2))
    ),
    "bent": lambda: with_contact(
        MakeStructured3DMesh(
            nx=2,
            nz=2,
            mapping=lambda x, y, z: (x + 0.6 * x * (1 - x) * y, y - 0.4 * y * (1 - y) * x, z - 1.3),
        )
    ),
}


@cache
def mesh_of(name):
    return MESHES[name]()


def _raised(mesh):
    """A block of which the middle third of the top becomes a ramp, no longer "contact", beside two levels."""
    plain = mesh.ngmesh
    ramp = list(mesh.GetBoundaries()).index("top") + 1
    points = plain.Points()
    for number in range(1, len(points) + 1):
        x1, x2, x3 = points[number].p
        if x3 == 0 and x1 > 0.5:
            points[number][2] = 0.05
    heights = {number: points[number].p[2] for number in range(1, len(points) + 1)}
    for facet in plain.Elements2D():
        levels = [heights[vertex.nr] for vertex in facet.vertices]
        if min(levels) == 0 and max(levels) > 0:
            facet.index = ramp
    return ng.Mesh(plain)


def body_of(problem):
    fixed = "bottom"
    if problem["mesh"] == "quarter":
        fixed = meshes3d.supports("bottom", x1="left", x2="front")
    mesh = "coarse" if problem["mesh"] == "block" and problem["order"] > 1 else problem["mesh"]
    return mb.Body(mesh_of(mesh), material(problem), problem["order"], fixed=fixed)


def contact_of(problem):
    law, obstacle = _made(problem["law"]), _made(problem["obstacle"])
    if problem["method"] == "body":
        options = {"rho": problem["rho"]} if "rho" in problem else {}
        return mb.Contact(body_of(problem), obstacle, law, METHODS[problem["solver"]](**options))
    period = problem.get("period")
    if "second" in problem:
        second = mb.HalfSpace(mb.Cosserat(**problem["second"]), period)
        obstacle = mb.Deformable(second, obstacle)
    cells = mb.Cells(problem["nodes"], problem.get("window"), RESIDUAL)
    return mb.Contact(mb.HalfSpace(material(problem), period), obstacle, law, cells)


def solve(problem):
    """The state of a problem."""
    options = {name: problem[name] for name in ("approach", "rtol") if name in problem}
    return contact_of(problem).solve(problem["load"], **options)


def measured(state, problem):
    """{quantity: number} of a state."""
    numbers = {"energy of fields": state.fields.energy()} if problem["method"] == "body" else {}
    numbers |= totals(state)
    if problem.get("brief"):
        numbers = {name: value for name, value in numbers.items() if name in BRIEF}
    del numbers["approach" if "approach" in problem else "load"]
    numbers |= {
        f"{name} at {x1:g} {x2:g}": value
        for x1, x2 in problem.get("at", ())
        for name, value in _at(state, x1, x2).items()
    }
    for x1, x2 in problem.get("between", ()):
        numbers[f"pressure_at {x1:g} {x2:g}"] = state.pressure_at([(x1, x2)])[0]
        corner = list(state.pressures)[-1]
        numbers[f"pressure_at {corner} {x1:g} {x2:g}"] = state.pressure_at([(x1, x2, 0.0)], corner)[0]
    if problem.get("along"):
        for direction in ("x1", "diagonal"):
            line = state.along(direction)
            numbers |= {f"along {direction} {name}": np.abs(values).sum() for name, values in line.items()}
    if problem["method"] == "body" and not problem.get("brief"):
        numbers |= fields_at(state.fields, problem.get("below", ()))
        numbers |= {n: x for n, x in reactions(state.fields).items() if n[9:] in ("f3", "m1", "m2")}
    return numbers


def totals(state):
    """Integrals over the contact, its area by the number of closed corners, and what was computed."""
    w = state.weights
    p = state.pressure
    (x1, x2, _) = state.points.T
    moment, psi = state.micromoment.T, state.psi.T
    names = "load", "approach", "energy", "contact_area", "unknowns", "iterations", "error_estimate"
    numbers = {name.replace("t_a", "t a"): getattr(state, name, None) for name in names}
    numbers |= {"pressure squared": w @ p**2, "pressure x1": w @ (p * x1), "pressure x2": w @ (p * x2)}
    numbers |= {f"micromoment squared {i}": w @ component**2 for i, component in enumerate(moment, 1)}
    numbers |= {f"psi squared {i}": w @ component**2 for i, component in enumerate(psi, 1)}
    numbers |= {f"area of {n} closed": w @ (state.closed == n) for n in range(1, len(state.pressures) + 1)}
    return (
        {name: value for name, value in numbers.items() if value is not None}
        | {"displacement squared": w @ state.displacement**2}
        | {"warnings": ", ".join(kinds_of(state.warnings)) or "none"}
        | dict(zip(["counter displacement squared"], [w @ component**2 for component in _above(state)]))
    )


def _above(state):
    """The displacement of a second body that gives way, if there is one."""
    return [] if state.opposite is None or not state.opposite.any() else [state.opposite]


def kinds_of(warnings):
    """The kinds of warnings; a text of no kind is its own."""
    return [next((kind for kind, part in WARNINGS.items() if part in words), words) for words in warnings]


def _at(state, x1, x2):
    """What a node or a cell near (x1, x2) has."""
    index = np.argmin(np.hypot(*(state.points[:, :2] - (x1, x2)).T))
    if state.shape:
        cell = np.argmin(np.abs(state.x1 - x1)), np.argmin(np.abs(state.x2 - x2))
        index = np.ravel_multi_index(cell, state.shape)
    vectors = {"micromoment": state.micromoment.T, "psi": state.psi.T}
    return (
        {"displacement": state.displacement[index]}
        | {f"pressure {name}": values[index] for name, values in state.pressures.items()}
        | {f"{name} {i}": values[i - 1][index] for name, values in vectors.items() for i in (1, 2)}
        | dict(zip(["counter displacement"], [displacement[index] for displacement in _above(state)]))
    )


def fields_at(fields, points):
    """Displacement, rotation, gamma, stresses and couple stresses at points (x1, x2, x3)."""
    fields_by_name = {"u": fields.u, "psi": fields.psi, "s": fields.stress, "m": fields.couple_stress}
    return {
        f"{name}{i // 3 + 1}{i % 3 + 1 if name in 'sm' else ''} at "
        + " ".join(f"{x:g}" for x in point): value
        for point in points
        for name, part in fields_by_name.items()
        for i, value in zip(range(9) if name in "sm" else range(0, 9, 3), part(fields.body.mesh(*point)))
    }


def reactions(fields):
    force, moment = fields.reaction("bottom")
    return {
        f"reaction {name}{i}": x
        for name, vector in (("f", force), ("m", moment))
        for i, x in enumerate(vector, 1)
    }


def of_bodies():
    """Bodies without contact under loads, nodes, graded coordinates, and what travels."""
    rows = {}
    loads = Loads(
        force=(0.1, -0.2, 0.3),
        couple=(0.05, -0.02, ng.x),
        traction={"contact": (0.3, -0.4, -1 - ng.x * ng.y)},
        micromoment={"contact": (0.1, 0.2, -0.3)},
    )
    for mesh, order in (("block", 1), ("tetrahedra", 2), ("bent", 3)):
        fields = mb.Body(mesh_of(mesh), mb.Cosserat(**given.TWISTED), order, fixed="bottom").solve(loads)
        values = fields_at(fields, given.BENT if mesh == "bent" else given.INSIDE) | reactions(fields)
        values["energy"] = fields.energy()
        rows |= {f"body3d under loads {mesh} order={order} {part}": value for part, value in values.items()}
    for mesh, order in (("block", 2), ("tetrahedra", 1), ("bent", 2)):
        nodes = ContactNodes(mb.Body(mesh_of(mesh), mb.Cosserat(**given.SOLID), order, fixed="bottom"))
        values = {
            "number": len(nodes.points),
            "weights x1 x2": nodes.weights @ nodes.points[:, :2].prod(axis=1),
            "weights squared": nodes.weights @ nodes.weights,
            "depths": meshes.thicknesses(nodes.body.mesh, nodes.region).sum(),
        }
        rows |= {f"contact nodes {mesh} order={order} {part}": value for part, value in values.items()}
    x = meshes3d.graded(reach=0.5, step=0.2, far=4.0, growth=1.5)
    return rows | {f"graded {number}": x[number] for number in (1, 3, 4, -2)} | {"graded number": len(x)}


def that_travel(method):
    """{what travels: its largest pressures, or an energy, before and after}."""
    rows = {}
    problems = (given.BODIES[3], given.BODIES[4], given.SPACES[0], given.SPACES[6])
    for problem in (
        problem_of_method for problem_of_method in problems if problem_of_method["method"] == method
    ):
        state = solve(problem)
        for way, again in copies(state).items():
            same = np.array_equal(again.pressure, state.pressure) and np.array_equal(again.psi, state.psi)
            values = {"is the same": str(same), "energy": again.energy}
            if method == "body":
                values["energy of fields"] = again.fields.energy()
                values["reaction"] = again.fields.reaction("bottom").moment[0]
            rows |= {f"{problem['name']} {way} {name}": value for name, value in values.items()}
    return rows


def of_kernels():
    """Symbols at wavenumbers, kernels at distances and averaged over cells."""
    rows = {}
    k = np.array(given.WAVENUMBERS)
    r = np.array(given.DISTANCES)
    names = ("u", "v", "w0", "w2", "u clamped", "m clamped")
    components = ("u", "v1", "v2", "w11", "w12", "w22")
    for name, options in given.SOLIDS.items():
        solid = mb.Cosserat(**options)
        table, ell = kernels.surface_kernels(solid), solid.ell
        # over c/ell, moments of psi = 0 over 1/ell^2
        scale = np.array([ell * solid.mu / (1 - solid.nu)] * 5 + [ell**2])
        cells = {
            "free": (table.cells(14, 0.2 * ell).T * scale[0]).T,
            "clamped": (table.cells(14, 0.2 * ell, clamped=True).T * scale[[4, 5, 5]]).T,
        }
        symbols = zip(("U", "V", "W", "W along"), symbol.surface_symbol(solid, k))
        rows |= {
            **{
                f"symbol {name} {part} at k={at:g}": x for part, column in symbols for at, x in zip(k, column)
            },
            **{
                f"kernel {name} {part} at r={at:g}": x
                for part, column in zip(names, (table(r * ell).T * scale).T)
                for at, x in zip(r, column)
                if part != "w2" or at > 1e-3  # w2 vanishes there, a difference of equal numbers
            },
            **{
                f"cells {name} {kind} {part} at {i} {j}": column[i, j]
                for kind, values in cells.items()
                for part, column in zip(components, values)
                for i, j in ((0, 0), (13, 5))
            },
            f"symbol {name} W at rest": at_rest(solid),
        }
    return rows


FORCES = np.cos(np.arange(4 * 64.0)).reshape(4, 8, 8) ** 2


def of_second_bodies():
    """The response of second bodies: symbol, shares, products."""
    rows, offsets = {}, Blocks(mb.Microblock(), 0.3, True).offsets
    for name, options in (("softer", given.SOFTER), ("classical", given.CLASSICAL)):
        solid = mb.Cosserat(**options)
        waves = zip(given.WAVENUMBERS, normal_symbol(solid, np.array(given.WAVENUMBERS)))
        values = {f"symbol at k={k:g}": value for k, value in waves}
        for where, periodic in (("alone", False), ("on a period", True)):
            cells = second_half_space.SecondBodyCells(solid, 0.3, offsets, 0.11, 8, periodic)
            values |= {f"{where} gap {i}": gap[3, 5] for i, gap in enumerate(cells @ FORCES)}
            values[f"{where} pressed"] = cells.pressed(FORCES)[4, 6]
        rows |= {f"second {name} {part}": value for part, value in values.items()}
    return rows


def of_products():
    """The flexibility of cells on a field of forces, and its preconditioner."""
    rows = {}
    solid = mb.Cosserat(**given.TWISTED)
    grid = Grid(8, 0.11, (0.385, 0.385))
    for name, pair in {**given.LAWS, "varying": given.VARYING}.items():
        solver = mb.Contact(mb.HalfSpace(solid), mb.Sphere(1.0), _made(pair), mb.Cells()).solver
        forces = FORCES[: len(solver.offsets)]
        for where, periodic in (("alone", False), ("on a period", True)):
            H = solver.alone(grid, periodic)
            products = {"gap": H @ forces, "preconditioned": H.on_face(np.ones(forces.shape, bool))(forces)}
            beside = {} if len(forces) > 1 else dict(enumerate(H.beside(forces)[:, 3, 5], 1))
            values = {
                f"{part} {i}": field[3, 5]
                for part, fields in products.items()
                for i, field in enumerate(fields)
            }
            values |= {f"beside {i}": value for i, value in beside.items()}
            rows |= {f"flexibility {name} {where} {part}": value for part, value in values.items()}
    return rows


def of_least_norm():
    """Forces of least norm with the same resultants, of blocks of which all corners are closed, or three."""
    forces = np.array([[3.0, 1.0, 0.5, 2.0], [0.2, 0.0, 1.0, 0.1], [3.0, 1.0, 0.5, 2.0]]).T
    closed = np.array([[True] * 4, [True] * 4, [True, True, False, True]]).T
    least = least_norm_where_closed(forces, closed)
    return {f"least norm corner {c} block {b}": least[c, b] for c, b in np.ndindex(4, 3)}


def of_surfaces():
    """Obstacles over a surface at two places, and gaps of corners of laws there."""
    x1, x2 = np.array([-0.3, 0.17]), np.array([0.2, 0.05])
    heights = {name: _made(pair).height(x1, x2) for name, pair in given.OVER.items()}
    rough = _made(given.ROUGH).height(*np.meshgrid(x1, x2, indexing="ij"))
    laws = {**given.LAWS, "levers": given.LEVERS, "varying": given.VARYING}
    laws = {name: Blocks(_made(pair), 0.3, True) for name, pair in laws.items()}
    gaps = {
        f"{name} gap": blocks.on_horizontal_surface(_made("skew"), x1, x2).initial_gaps
        for name, blocks in laws.items()
    }
    gaps |= {f"{name} tilt": law.tilt(x1, x2) for name, law in laws.items()}
    return {
        **{
            f"surface {name} height {i}": x if np.isfinite(x) else "none"
            for name, table in heights.items()
            for i, x in enumerate(table)
        },
        **{f"surface rough on a grid {i} {j}": rough[i, j] for i, j in np.ndindex(2, 2)},
        **{
            f"surface law {name} {c} {i}": table[c, i]
            for name, table in gaps.items()
            for c, i in np.ndindex(table.shape)
        },
    }


def warned():
    """{what is left out: kinds of the warnings}."""
    solid, sphere = mb.Cosserat(**given.SOLID), mb.Sphere(10.0)
    spike = lambda x1, x2: sphere.height(x1, x2) - 0.02 * (np.hypot(x1 - 0.2, x2) < 0.03)  # noqa: E731
    states = {
        "window that cuts": (sphere, (-0.2, 0.2)),
        "window that misses": (given.hills, (0.1, 0.9)),
        "spike": (spike, (-1.0, 1.0)),
    }
    return {
        f"half-space warnings {name}": ", ".join(
            kinds_of(
                mb.Contact(mb.HalfSpace(solid), shape, mb.Unilateral(), mb.Cells(32, window))
                .solve(load=1.0)
                .warnings
            )
        )
        for name, (shape, window) in states.items()
    }
