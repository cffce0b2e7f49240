"""Frozen problems in the names of the library: this follows when names change, problems and numbers stay.

`solve` makes a state of a problem, `measured` numbers of a state: at prescribed abscissae, or as integrals
and maxima, on the whole line, whatever half of it the state holds. The other functions without an underscore
give what else is frozen.
"""

import contextlib
import copy
import io
import pickle
from functools import cache

import netgen.occ as occ
import ngsolve as ng
import numpy as np
from ngsolve.meshes import MakeStructured2DMesh

import microblock as mb
from cases.__main__ import main
from cases.size_effect import axis_closes
from microblock.fem import contact_term, meshes
from microblock.fem.loads import Loads
from microblock.halfplane import kernels
from microblock.model.corner_geometry import Blocks

from . import problems as given

ROUNDING = 1e-12  # residuals below it are noise
PSI0_IN = {"reading": "psi0_in", "gap": "gaps and levers", "lever": "levers"}
FEW = 3  # zones of a kind that are listed one by one


def material(problem):
    return mb.Cosserat(**problem["solid"])


def obstacle_of(problem):
    if isinstance(problem["obstacle"], str):
        return given.FUNCTIONS[problem["obstacle"]]
    name, options = problem["obstacle"]
    make = {"Profile": mb.Obstacle.from_samples, "Shape": mb.Obstacle}.get(name) or getattr(mb, name)
    return make(**_with_functions(options))


def law_of(problem):
    name, options = problem["law"]
    options = {
        PSI0_IN.get(key, key): PSI0_IN.get(value, value) if key == "reading" else value
        for key, value in options.items()
    }
    return getattr(mb, name)(**_with_functions(options))


def _with_functions(options):
    """The arguments, with the functions that FUNCTIONS has under a name."""
    return {
        name: given.FUNCTIONS.get(value, value) if isinstance(value, str) else value
        for name, value in options.items()
    }


def copies(state):
    """The state after pickling, and its copy."""
    return {"pickled": pickle.loads(pickle.dumps(state)), "copied": copy.deepcopy(state)}


def with_contact(mesh, side="top"):
    """The mesh with one of its sides called "contact"."""
    for number, name in enumerate(mesh.GetBoundaries()):
        mesh.ngmesh.SetBCName(number, {side: "contact"}.get(name, name))
    return ng.Mesh(mesh.ngmesh)


def dome(maxh=0.2, order=3, base="bottom"):
    face = occ.WorkPlane().Circle(1.0).Face() * occ.WorkPlane().MoveTo(-2, 0).Rectangle(4, 2).Face()
    face.edges.name, face.edges.Min(occ.Y).name = "contact", base
    return ng.Mesh(occ.OCCGeometry(face, dim=2).GenerateMesh(maxh=maxh)).Curve(order)


MESHES = {  # of the problems; their contact boundary is called "contact"
    "line": lambda: meshes.line(1.0, 3),
    "column": lambda: meshes.column(1.0, 3),
    "dome": dome,
    "cap": lambda: dome(0.3, 2, "base"),
    "block": lambda: with_contact(MakeStructured2DMesh(nx=20, ny=8, mapping=lambda x, y: (2 * x - 1, y - 1))),
}


@cache
def mesh_of(name):
    return MESHES[name]()


def body_of(problem):
    middle = {"u1": "middle", "u2": "middle"}
    fixed = {"line": middle, "column": middle, "cap": "base"}.get(problem["mesh"], "bottom")
    return mb.Body(
        mesh_of(problem["mesh"]),
        material(problem),
        problem.get("order", 3),
        fixed=fixed,
        periodic=problem["mesh"] == "column",
    )


def contact_of(problem):
    """The contact problem itself, before it is asked for a load."""
    method = problem["method"]
    touching = (obstacle_of(problem), law_of(problem))
    newton = mb.Newton(problem.get("newton", "al"), problem.get("rho"))
    if method in ("panels", "cells"):
        body = mb.HalfPlane(material(problem), **_given(problem, "period"))
    else:
        block = method in ("fitted", "uniform")
        body = mb.Block(material(problem), problem.get("domain", np.inf)) if block else body_of(problem)
    if method == "uniform":
        options = {"newton": newton if "newton" in problem else None}
        chosen = mb.Uniform(**_given(problem, "h", "reach", "order", "shape"), **options)
    else:
        make, *names = METHODS[method]
        chosen = make(**_given(problem, *names)) if make else newton if method == "newton" else None
    return mb.Contact(body, *touching, chosen)


METHODS = {
    "panels": (mb.Panels, "order"),
    "cells": (mb.Cells, "nodes", "window"),
    "fitted": (mb.Fitted, "order", "even"),
    "body": (None,),
    "newton": (None,),
}


def _given(problem, *names):
    return {name: problem[name] for name in names if name in problem}


def solve(problem):
    """The state of a problem."""
    if problem["method"] == "newton":  # in one step, as it was frozen
        return by_newton(
            contact_of(problem).solver, problem.get("approach", problem["load"]), problem["load"]
        )
    return contact_of(problem).solve(problem["load"], **_given(problem, "approach", "rtol"))


def by_newton(solver, level, load=None, start=None):
    """The solution of Newton's method at a load, or without at an approach."""
    return solver.of(solver.newton("approach" if load is None else "load").solve(level, start))


def estimated(problem):
    """Whether the state is as accurate as was asked for, on nodes that follow from that."""
    return "rtol" in problem or (problem["method"] == "panels" and "order" not in problem)


def measured(state, problem):
    """{quantity: number} of a state."""
    if problem["method"] == "newton":
        return _of_newton(state)
    numbers = {
        "load": state.load,
        "approach": state.solution.approach,
        "half_width": state.half_width,
        "energy": state.energy,
        "pressure_max": state.pressure.max(),
        "pressure squared": state.weights @ state.pressure**2,
        "micromoment_max": np.abs(state.micromoment).max(),
        "micromoment squared": state.weights @ state.micromoment**2,
        "error_estimate": state.error_estimate,
        "residual": max(state.residual, ROUNDING),
        "unknowns": state.unknowns + (problem["method"] == "cells"),
        "iterations": state.iterations,
    }
    left_out = ()
    if problem["method"] == "fitted" and "domain" not in problem:  # they grow with the size of the mesh
        left_out = "approach", "energy"
    if estimated(problem):  # the largest at a node is the nodes' own, and under a punch's edge infinite
        squares = ("pressure squared", "micromoment squared") if problem["obstacle"][0] == "Punch" else ()
        left_out += "pressure_max", "micromoment_max", *squares
    groups = [{name: value for name, value in numbers.items() if name not in left_out}]
    groups += [_edges(name, intervals) for name, intervals in state.zones.items()]
    groups += [_at(state, problem, x) for x in problem.get("at", ())]
    groups += [below(state, *point) for point in problem.get("below", ())]
    return {name: value for part in groups for name, value in part.items()}


def _edges(name, intervals):
    """Edges of few zones, number, length and outermost edges of many."""
    if len(intervals) > FEW:
        return {
            f"zones {name} number": len(intervals),
            f"zones {name} length": np.diff(intervals).sum(),
            f"zones {name} left": intervals[0][0],
            f"zones {name} right": intervals[-1][1],
        }
    return {
        f"zone {name} {number} {side}": edge
        for number, interval in enumerate(intervals)
        for side, edge in zip(("left", "right"), interval)
    }


def _at(state, problem, x):
    """Pressures of closed corners, gaps of open ones, micromoment and rotation at x.

    Between the nodes of cells and meshes all but the pressure on meshes are taken as linear.
    """
    numbers = {}
    law = law_of(problem)
    place = np.array([x])
    panels, cells = (problem["method"] == kind for kind in ("panels", "cells"))
    by_itself = panels or estimated(problem)  # nodes are those that the accuracy asked for

    def nodal(values):
        return np.interp(x, state.x, values)

    names = "AB" if len(law.corners) == 2 else ["contact"]
    closed = [any(left < x < right for left, right in state.zones[name]) for name in names]
    pressures = np.zeros(len(closed))
    for number, corner in enumerate(law.corners):
        if closed[number]:
            pressures[number] = nodal(state.pressures[corner]) if cells else state.pressure_at(x, corner)
            numbers[f"pressure {corner}"] = pressures[number]
        else:
            numbers[f"gap {corner}"] = (
                state.gap_at(corner, x) if by_itself else nodal(state.surface().gaps[number])
            )
    if any(closed) and len(law.corners) == 2:
        levers = np.array([lever[0] for lever in law.levers(place).values()])
        numbers["micromoment"] = problem["solid"]["ell"] / 2 * levers @ pressures
    elif any(closed) and law.clamps_rotation:
        numbers["micromoment"] = state.solution.reaction(place)[0] if panels else nodal(state.micromoment)
    if not law.clamps_rotation and (panels or not by_itself):
        numbers["psi"] = state.solution.displacement_and_rotation(place)[1][0] if panels else nodal(state.psi)
    return {f"{name} at {x:g}": value for name, value in numbers.items()}


def below(state, x1, x2):
    """Fields at a point below the surface."""
    fields = state.fields([x1], [x2])
    names = "psi", "s11", "s12", "s21", "s22", "m1", "m2"
    values = np.concatenate([np.ravel(part) for part in (fields.psi, fields.stress, fields.couple_stress)])
    return {f"{name} at x1={x1:g} x2={x2:g}": value for name, value in zip(names, values)}


def _of_newton(state):
    """The same of a state of Newton's method on its own, whose contact nodes need no line."""
    numbers = {
        "load": state.load,
        "approach": state.approach,
        "energy": state.fields.energy(),
        "iterations": state.iterations,
        "pressure_max": state.pressures.sum(axis=0).max(),
        "traction squared": np.mean(state.pressures.sum(axis=0) ** 2),
        "psi_max": np.abs(state.psi).max(),
        "micromoment_max": np.abs(state.micromoment).max(),
        "residual": max(state.residual, ROUNDING),
    }
    closed = zip(state.law.corners, state.closed)
    return numbers | {f"closed {corner} number": flags.sum() for corner, flags in closed}


def path_of(problem):
    """The load path of a problem up to its load: (events, function of a load that gives a state)."""
    path = contact_of(problem).path(problem["load"], **_given(problem, "rtol"))
    return path.events, path.at


def coalescence_of(problem):
    """Load at which two zones of partial contact touch on the axis."""
    contact = contact_of(problem)
    if problem["method"] != "panels":
        return axis_closes(contact.solver)
    (event,) = (event for event in contact.path(problem["load"]).events if event.kind == "merged")
    return event.load


SOLIDS = {
    "beta=1": {},
    "beta=0.1 curvature=1": {"beta": 0.1, "curvature": 1.0},
    "mu_c=10 nu=0": {"mu_c": 10.0, "beta": None, "nu": 0.0},
    "eta=3 nu=0.49": {"eta": 3.0, "beta": None, "nu": 0.49},
}


def of_materials():
    rows, mesh = {}, MakeStructured2DMesh(nx=1, ny=1)
    place = mesh(0.5, 0.5)
    gradient = ng.CF((0.01, 0.002, 0, -0.004, -0.02, 0, 0, 0, 0), dims=(3, 3))
    gamma = contact_term.relative_deformation(gradient, ng.CF((0, 0, 0.005)))
    kappa = ng.CF((0, 0, 0, 0, 0, 0, 0.3, -0.2, 0), dims=(3, 3))
    for name, moduli in SOLIDS.items():
        solid = material({"solid": given.solid(**moduli)})
        attributes = "mu", "lam", "mu_c", "beta", "eta", "E_star", "layer_length"
        values = {part: getattr(solid, part) for part in attributes}
        values["energy density"] = contact_term.energy(solid, (gamma, kappa))(place)
        stress = contact_term.stress(solid, gamma)(place)
        values |= zip(("s11", "s12", "s21", "s22"), (stress[i] for i in (0, 1, 3, 4)))
        values |= zip(("m1", "m2"), contact_term.couple_stress(solid, kappa)(place)[6:8])
        values |= zip(("short waves U", "short waves W"), kernels.short_waves(solid))
        values["exponent of coalescence"] = kernels.coalescence_exponent(solid)
        rows |= {f"material {name} {part}": value for part, value in values.items()}
    return rows


def of_obstacles():
    samples = ("Profile", {"x": (-1.0, -0.1, 0.2, 1.0), "z": (0.03, 0.0, 0.001, 0.04)})
    kinds = {
        "plane": ("Plane", {"level": 0.1}),
        "cylinder": given.CYLINDER,
        "wedge": given.WEDGE,
        "tilted punch": given.TILTED,
        "wave": given.WAVE,
        "rough": given.ROUGH,
        "samples": samples,
        "function": ("Shape", {"height": "skew wedge", "kinks": (0.1,)}),
    }
    x = np.array([-0.3, 0.17])
    return {
        f"obstacle {name} height at {place:g}": value
        for name, obstacle in kinds.items()
        for place, value in zip(x, obstacle_of({"obstacle": obstacle}).height(x))
    }


def of_laws():
    rows, points = {}, np.array([[-0.3, 0.01], [0.17, -0.02]])
    normals = np.array([[0.0, 1.0], [0.6, 0.8]])
    for name, law in {
        "psi0=0.01": given.ROTATED,
        "psi0=0.01 in levers": given.LEVERS,
        "psi0(x)": given.VARYING,
        "unilateral": given.UNILATERAL,
    }.items():
        law_at = law_of({"law": law})
        cylinder = obstacle_of({"obstacle": given.CYLINDER})
        gaps = Blocks(law_at, 0.085).under(cylinder, points, normals).initial_gaps
        rows |= {
            f"law {name} {kind} {corner} at {x:g}": value
            for kind, values in (
                ("gap", dict(zip(law_at.corners, gaps))),
                ("lever", law_at.levers(points[:, 0])),
            )
            for corner in law_at.corners
            for x, value in zip(points[:, 0], values[corner])
        }
    return rows


def of_kernels():
    rows = {}
    waves = np.array([1e-3, 1.0, 30.0, 1e4])
    places = np.array([1e-8, 0.01, -1.0, 50.0])
    for name, moduli in (("beta=1", {}), ("beta=1.9 nu=0.45", {"beta": 1.9, "nu": 0.45})):
        solid = material({"solid": given.solid(**moduli)})
        UVW = kernels.plane_symbol(solid, waves)
        table = kernels.kernels(solid.nu, solid.beta, solid.curvature)
        symbols = zip(("U", "V", "W", "U clamped"), (*UVW, kernels.clamped(*UVW)))
        rows |= {
            f"symbol {name} {part} at k={k:g}": x for part, column in symbols for k, x in zip(waves, column)
        }
        rows |= {
            f"kernel {name} {part} at x/ell={x:g}": value
            for part, column in zip("UVW", table(places))
            for x, value in zip(places, column)
        }
    return rows


def of_bodies():
    """A body without contact, Newton's steps, layer lengths, the largest shear."""
    loads = Loads(
        force=(0.1, -0.2), couple=0.05, traction={"contact": (0.3, -1)}, micromoment={"contact": 0.1}
    )
    fields = body_of({"solid": given.SOLID, "mesh": "block", "order": 3}).solve(loads)
    rows = {f"body under loads {name}": value for name, value in under_loads(fields, (0.31, -0.27)).items()}
    strip = next(problem for problem in given.NEWTON if problem["name"] == "newton strip line")
    solver, last = contact_of(strip).solver, None
    for level in (0.002, 0.004, 0.02):
        last = by_newton(solver, level, start=last)
    traction = -last.pressures.sum(axis=0)[0]
    moment = last.micromoment[0]
    u1 = (last.nodes.traces["u1"] @ last.fields.values)[0]
    solid = body_of(strip).solid
    psi = last.psi[0]
    slope = moment / (solid.curvature * solid.ell**2 * solid.mu)
    return rows | {
        "strip load path last traction": traction,
        "strip load path last micromoment": moment,
        "strip layer length psi": psi / slope,
        "strip layer length u1": -u1 / psi * (solid.mu + solid.mu_c) / (2 * solid.mu_c),
    }


def under_loads(fields, point):
    """Fields of a body without contact at a point, its energy, and what its supports exert."""
    force, moment = fields.reaction("bottom")
    place = fields.body.mesh(*point)
    numbers = {name: field(place) for name, field in zip(("u1", "u2", "psi"), fields)}
    reactions = {"reaction f1": force[0], "reaction f2": force[1], "reaction moment": moment}
    return numbers | reactions | {"energy": fields.energy()}


def of_two_faces():
    """A strip whose two faces turn differently: displacements under a pressure and two micromoments."""
    solid = mb.Cosserat(E=2.6, nu=0.3, ell=0.5, beta=1.0)
    body = mb.Body(meshes.line(2.0, 1), solid, 14, fixed={"u1": "middle", "u2": "middle"})
    fields = body.solve(
        Loads(traction={"contact": (0, -0.06)}, micromoment={"contact": -0.0147, "middle": 0.0093})
    )
    return {
        f"strip of two faces {name} at {depth:g}": field(body.mesh(depth - 1.0))
        for depth in (-1.0, -0.4, 1.0)
        for name, field in zip(("u1", "u2", "psi"), fields)
    }


def refused(call):
    """The error's class and the argument that it names."""
    try:
        call()
    except mb.MicroblockError as failure:
        return " ".join([type(failure).__name__, *([failure.name] if hasattr(failure, "allowed") else [])])
    return "answered"


def answered(words):
    """(exit status, what is printed on standard output) of a command line."""
    out = io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(io.StringIO()):
        try:
            status = main([*words.split(), "--json", "-"])
        except SystemExit as stop:  # argparse's own way out
            status = stop.code
    return status, out.getvalue()
