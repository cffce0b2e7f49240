"""Frozen contact of bodies on meshes in the plane in names of the library, beside `tests.frozen.library`."""

from functools import cache

import ngsolve as ng
import numpy as np
from ngsolve.meshes import MakeStructured2DMesh

import microblock as mb
from microblock.fem.loads import Loads

from . import library
from . import problems_mesh as given

estimated = library.estimated
METHODS = {
    "condensed": lambda **_: mb.Condensed(),
    "al": lambda **rho: mb.Newton("al", **rho),
    "penalty": lambda **rho: mb.Newton("penalty", **rho),
    "fitted": mb.Fitted,
    "uniform": mb.Uniform,
}
OF_BOTH = (
    "zone contact",
    "zone full",
    "zones contact",
    "zones full",
)  # zones of both corners follow from theirs
OF_NODES = (
    "half_width",
    "pressure_max",
    "micromoment_max",
)  # the largest of nodes, whose places are the method's
WARNINGS = {  # kinds of warnings, by words that a text of the kind has
    "few nodes": "nodes in contact and no error estimate",
    "layer": "do not resolve the layer",
    "features": "features shorter than the elements",
    "overlap": "inside the obstacle",
    "deep": "deep into a body",
}


@cache
def mesh_of(name):
    """A mesh with a straight contact boundary, or with one along a circle, of straight edges."""
    if name != "bent":
        return library.mesh_of(name)
    mapped = lambda x, y: (1.6 * x - 0.8, y * np.sqrt(1 - (1.6 * x - 0.8) ** 2 / 4))  # noqa: E731
    return library.with_contact(MakeStructured2DMesh(quads=False, nx=16, ny=8, mapping=mapped))


def body_of(problem):
    solid = library.material(problem)
    if problem["solver"] in ("fitted", "uniform"):
        return mb.Block(solid, problem["domain"])
    mesh = mesh_of(problem["mesh"])
    if problem["orders"] == "graded":
        return mb.Body(mesh, solid, np.where(np.arange(mesh.ne) % 3, 2, 3), fixed="bottom")
    order, order_psi = problem["orders"]
    return mb.Body(mesh, solid, order, order_psi=order_psi, fixed="bottom")


def contact_of(problem):
    options = {name: problem[name] for name in ("rho", "order", "h", "reach") if name in problem}
    touching = library.obstacle_of(problem), library.law_of(problem)
    return mb.Contact(body_of(problem), *touching, METHODS[problem["solver"]](**options))


def solve(problem):
    approach = {"approach": problem["approach"]} if "approach" in problem else {}
    return contact_of(problem).solve(problem["load"], **approach)


def measured(state, problem):
    """{quantity: number} of a state, what its supports exert, and kinds of its warnings."""
    numbers = short(library.measured(state, problem))
    numbers["warnings"] = ", ".join(kinds_of(state.warnings)) or "none"
    names = "AB" if len(state.law.corners) == 2 else "C"
    numbers |= {
        f"gap {name} at 0.45": float(state.gap_at(name, 0.45)) for name in names if problem["at"][-1] > 0.1
    }
    if problem["solver"] in ("condensed", "al", "penalty"):
        force, moment = state.reaction("bottom")
        numbers |= {"reaction f1": force[0], "reaction f2": force[1], "reaction moment": moment}
        numbers["energy of fields"] = state.solution.fields.energy()
    return numbers


def short(found):
    """Numbers of a state without those that follow from others, or depend on where nodes are."""
    corners = any(name.startswith(("zone A", "zones A")) for name in found)
    left_out = OF_NODES + OF_BOTH * corners
    return {name: value for name, value in found.items() if not name.startswith(left_out)}


def kinds_of(warnings):
    """The kinds of warnings; a text of no kind is its own."""
    return [next((kind for kind, part in WARNINGS.items() if part in words), words) for words in warnings]


def that_travel():
    """States that were copied and pickled, and what they compute afterwards."""
    rows = {}
    for problem in (given.STATES[number] for number in (6, 9, 12)):
        state = solve(problem)
        for way, again in library.copies(state).items():
            values = {
                "is the same": str(np.array_equal(again.pressure, state.pressure)),
                "energy": again.solution.fields.energy(),
                "reaction moment": again.reaction("bottom")[1],
                "psi below": again.fields([0.1], [-0.1]).psi[0],
            }
            rows |= {f"{problem['name']} {way} {name}": value for name, value in values.items()}
    return rows


def of_bodies():
    """Bodies without contact: values that are prescribed, orders, periods; a picture; a load path's state."""
    rows = {}
    solid = library.material({"solid": given.SOLID})
    mesh = library.mesh_of("block")
    loads = Loads(
        force=(0.1, -0.2), couple=0.05, traction={"contact": (ng.x, -1)}, micromoment={"contact": 0.1}
    )
    values = {"u1": {"left": 0.01 * ng.y}, "psi": {"right": 0.02}}
    bodies = {
        "prescribed": mb.Body(mesh, solid, 2, fixed="bottom", prescribed=values),
        "orders of elements": mb.Body(mesh, solid, np.where(np.arange(mesh.ne) % 3, 2, 3), fixed="bottom"),
        "psi of order 1": mb.Body(mesh, solid, 3, order_psi=1, fixed="bottom"),
        "triangles": mb.Body(mesh_of("bent"), solid, 3, fixed="bottom"),
    }
    for name, body in bodies.items():
        numbers = library.under_loads(body.solve(loads), (0.31, 0.2 if name == "triangles" else -0.27))
        rows |= {f"under loads {name} {part}": value for part, value in numbers.items()}
    below, triangles = solve(given.STATES[0]).solution.fields_below(((-0.5, 0.5), 0.4))
    path = mb.Contact(mb.Block(solid, 4.0), mb.Cylinder(R=10.0), mb.Microblock(), mb.Fitted(order=3)).path(
        1.0
    )
    rows |= {
        "picture points number": len(below.x1),
        "picture triangles number": len(triangles),
        "picture psi": below.psi @ below.x1,
        "picture s22": below.stress[1, 1] @ below.x2,
        "picture s12": below.stress[0, 1] @ below.x1,
        "fitted path half_width": path.at(0.5).half_width,
        "fitted path energy": path.at(0.5).energy,
    }
    return {f"mesh {name}": value for name, value in rows.items()}
