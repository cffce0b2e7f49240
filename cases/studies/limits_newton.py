"""Maps of the monolithic methods and of the linear solvers: regularisation, supports.

Augmented Lagrangian and the condensed body solve one discrete problem, so that one verifies the other; the
penalty's error is that against the half-plane or the closed form.
"""

from dataclasses import replace
from functools import partial

import ngsolve as ng
import numpy as np

import microblock as mb
from microblock.fem.body import Loads
from microblock.fem.meshes import rectangles
from microblock.fem.newton import WORST

from ..scenes import strip
from .judged_line import Draw, error_of_elements
from .limits_maps import Axis, Map, Outcome, choice
from .limits_meshes import ALPHA, half_plane, squares

DOMAIN = 18.0  # over a_Hz, the paper's
STRIP_ORDER = 8  # where the strip's mesh is not in question: its error is rounding
HEIGHT, BLOCK = 1.0, 0.25  # of the block whose supports are taken away, and its elements
BLOCK_LOAD = 0.01  # on it
# to which energy is half the work: what a matrix with supports leaves, and one without does not
CLAPEYRON = 1e-6
NU = 0.3


def problem_of(alpha):
    return Draw("", "microblock", alpha, NU, 1.0).problem()


def on_squares(problem, spacing, kind, rho):
    """The state on equal squares by Newton's method; rho over the stiffness lambda + 2 mu over a_Hz."""
    stiffness = problem.solid.lam + 2 * problem.solid.mu
    return squares(problem, 1, spacing, DOMAIN, newton=mb.Newton(kind, rho * stiffness))


def penalty_in_strip(rho, elements):
    parameters = replace(strip.Parameters(), method="penalty", order=1, elements=elements)
    solid = parameters.solid
    solution = strip.solve_once(replace(parameters, rho=rho * (solid.lam + 2 * solid.mu)))
    found = strip.errors(solution)
    return Outcome(max(found["error_psi"], found["error_u"]), iterations=solution.state.iterations)


def penalty_on_squares(rho, spacing, alpha):
    problem = problem_of(alpha)
    state = on_squares(problem, spacing, "penalty", rho)
    return Outcome(error_of_elements(state, half_plane(problem)), iterations=state.iterations)


def lagrangian_in_strip(rho, elements, ell_over_H):
    parameters = replace(strip.Parameters(), order=STRIP_ORDER, elements=elements, ell_over_H=ell_over_H)
    solid = parameters.solid
    solution = strip.solve_once(replace(parameters, rho=rho * (solid.lam + 2 * solid.mu)))
    found = strip.errors(solution)
    return Outcome(max(found["error_psi"], found["error_u"]), WORST, iterations=solution.state.iterations)


def lagrangian_on_squares(rho, spacing, alpha):
    problem = problem_of(alpha)
    state = on_squares(problem, spacing, "al", rho)
    condensed = squares(problem, 1, spacing, DOMAIN)
    p, true = (np.array(list(one.pressures.values())) for one in (state, condensed))
    off = float(np.linalg.norm(p - true) / np.linalg.norm(true))
    return Outcome(off, WORST, iterations=state.iterations)


SUPPORTS = {  # of a block, from enough to none
    "all": {"u1": "bottom", "u2": "bottom", "psi": "bottom"},
    "psi free": {"u1": "bottom", "u2": "bottom"},
    "u1 free": {"u2": "bottom", "psi": "bottom"},
    "u2 free": {"u1": "bottom", "psi": "bottom"},
    "rotation free": {"u1": "bottom"},
    "none": {},
}


def supported(solver, supports, beta, order, nu, ell):
    """A block with more or fewer supports than it needs; answers are verified by Clapeyron: energy is half
    the work.
    """
    nx, ny = round(2 / BLOCK), round(HEIGHT / BLOCK)
    names = ("bottom", "right", "contact", "left")
    mesh = rectangles(np.linspace(-1, 1, nx + 1), np.linspace(-1, 0, ny + 1), names=names)
    body = mb.Body(
        mesh, mb.Cosserat(E=2 * (1 - nu**2), nu=nu, ell=ell, beta=beta), order, fixed=SUPPORTS[supports]
    )
    energy, work, iterations = BY_SOLVER[solver](body)
    return Outcome(abs(energy / work - 1), CLAPEYRON, iterations)


def _bulk(body):
    loads = Loads(traction={"contact": (0.1, -1.0)}, micromoment={"contact": 0.1})
    fields = body.solve(loads)
    work = ng.Integrate((0.1 * fields.u1 - fields.u2 + 0.1 * fields.psi) * ng.ds("contact"), body.mesh)
    return fields.energy(), work / 2, None


def _condensed(body):
    state = mb.Contact(body, mb.Cylinder(1.0), mb.Microblock()).solve(load=BLOCK_LOAD)
    return state.fields.energy(), state.energy, state.iterations


def _newton(body, method):
    problem = mb.Contact(body, mb.Cylinder(1.0), mb.Microblock(), mb.Newton(method))
    facets, state = problem.solver.facets, problem.solve(load=BLOCK_LOAD).solution.nodal
    forces = {corner: -state.multipliers[corner] * facets.weights for corner in facets.corners}
    changes = facets.gap_changes(*state.fields, 0.0)  # what the body gives way at each corner
    work = sum(
        forces[corner] @ np.where(forces[corner] > 0, changes[corner], 0.0) for corner in facets.corners
    )
    return state.fields.energy(), work / 2, state.iterations


BY_SOLVER = {
    "bulk": _bulk,
    "condensed": _condensed,
    "al": partial(_newton, method="al"),
    "penalty": partial(_newton, method="penalty"),
}
RHO = Axis("rho", "rho a_Hz/(lambda + 2 mu)", 1e-6, 1e6, degenerate="both")
PENALTIES = Axis("rho", RHO.label, 1e-2, 1e10, degenerate="both")
SQUARES = Axis("spacing", "h/a_Hz", 0.4, 0.2)
IN_STRIP = {"rho": "rho H/(lambda + 2 mu)"}
MAPS = (
    Map(
        "penalty_strip",
        "Strip: which rho of the penalty is best on a mesh, and where does it spoil the matrix?",
        penalty_in_strip,
        (replace(PENALTIES, label=IN_STRIP["rho"]), Axis("elements", "elements", 2, 512, whole=True)),
        share=0.5,
    ),
    Map(
        "penalty_squares",
        "Cylinder: which rho of the penalty is best on a mesh, and where does it spoil the matrix?",
        penalty_on_squares,
        (PENALTIES, SQUARES, ALPHA),
        share=0.6,
    ),
    Map(
        "lagrangian_strip",
        "Strip: does the augmented Lagrangian depend on rho?",
        lagrangian_in_strip,
        (
            replace(RHO, label=IN_STRIP["rho"]),
            Axis("elements", "elements", 8, 32, whole=True),
            Axis("ell_over_H", "ell/H", 0.1, 10.0),
        ),
        share=0.3,
    ),
    Map(
        "lagrangian_squares",
        "Cylinder: does the augmented Lagrangian depend on rho?",
        lagrangian_on_squares,
        (RHO, SQUARES, ALPHA),
        share=0.6,
    ),
    Map(
        "supports",
        "What becomes of matrices that are singular, or nearly?",
        supported,
        (
            choice("supports", "supports", *SUPPORTS, degenerate="high"),
            choice("beta", "beta", 0.0, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3, 1.0, 1.999999, degenerate="low"),
            choice("order", "order", 1, 2, 3, 4),
            Axis("nu", "nu", 0.0, 0.49, "linear"),
            Axis("ell", "ell", 0.01, 1.0),
        ),
        ("solver", tuple(BY_SOLVER)),
        0.5,
    ),
)
