"""Maps of the monolithic methods and of the linear solvers: regularisation, load steps, first guesses, first contact, supports.

Augmented Lagrangian and the condensed body solve one discrete problem, so that one judges the other; the penalty's error is
that against the half-plane or the closed form.
"""

from dataclasses import dataclass, replace
from functools import partial

import ngsolve as ng
import numpy as np
from ngsolve.meshes import MakeStructured2DMesh

from cases import accuracy, accuracy_fe, strip
from cases.accuracy import Draw
from cases.limits_maps import Axis, Map, Outcome, choice
from cases.limits_meshes import ALPHA, REACH, half_plane
from microblock.body import Body, Loads
from microblock.body_contact import BodyContact
from microblock.facets import ContactFacets
from microblock.law import Microblock
from microblock.material import Cosserat
from microblock.meshes import Ground, graded
from microblock.newton import PENALTY, WORST, Newton
from microblock.newton_path import load_path
from microblock.obstacles import Cylinder
from microblock.uniform import UniformContact

DOMAIN = 18.0         # over a_Hz, the paper's
COARSE = 0.3          # side of squares over a_Hz where the mesh is not in question
STRIP_ORDER = 8       # where the strip's mesh is not in question: its error is rounding
HEIGHT, BLOCK = 1.0, 0.25      # of the block whose supports are taken away, and its elements
LOAD = 0.01           # on it
CLAPEYRON = 1e-6      # to which energy is half the work: what a matrix with supports leaves, and one without does not
NU = 0.3


def squares(method, alpha, spacing, psi0=0.0, rho=None):
    """A scene on equal squares; rho over the stiffness lambda + 2 mu over a_Hz."""
    scene = Draw("", "microblock", alpha, NU, 1.0, psi0).scene()
    solid = scene.body.solid
    rho = None if rho is None else rho*(solid.lam + 2*solid.mu)
    return scene, UniformContact(solid, scene.obstacle, scene.law, DOMAIN, spacing, 1, REACH, method, rho)


def distance(found, true):
    """Relative distance of corner pressures, arrays (corners, n)."""
    return float(np.linalg.norm(found - true)/np.linalg.norm(true))


def condensed(contact, load):
    """Corner pressures of the same discrete problem without Newton's method, array (corners, n)."""
    state, = replace(contact, method="condensed", rho=None).states([load])
    return state.pressures


def penalty_in_strip(rho, elements):
    parameters = replace(strip.Parameters(), method="penalty", order=1, elements=elements)
    solid = parameters.solid
    solution = strip.solve_once(replace(parameters, rho=rho*(solid.lam + 2*solid.mu)))
    found = strip.errors(solution)
    return Outcome(max(found["error_psi"], found["error_u"]), iterations=solution.state.iterations)


def penalty_on_squares(rho, spacing, alpha):
    scene, contact = squares("penalty", alpha, spacing, rho=rho)
    state, = contact.states([accuracy.LOAD])
    return Outcome(accuracy_fe.error(state, half_plane(scene)), iterations=state.iterations)


def lagrangian_in_strip(rho, elements, ell_over_H):
    parameters = replace(strip.Parameters(), order=STRIP_ORDER, elements=elements, ell_over_H=ell_over_H)
    solid = parameters.solid
    solution = strip.solve_once(replace(parameters, rho=rho*(solid.lam + 2*solid.mu)))
    found = strip.errors(solution)
    return Outcome(max(found["error_psi"], found["error_u"]), WORST, iterations=solution.state.iterations)


def lagrangian_on_squares(rho, spacing, alpha):
    _, contact = squares("al", alpha, spacing, rho=rho)
    state, = contact.states([accuracy.LOAD])
    return Outcome(distance(state.pressures, condensed(contact, accuracy.LOAD)), WORST, iterations=state.iterations)


def noisy(solver, state, size, seed):
    """A state with noise of `size` times its largest unknown on all that are free."""
    vector, own = state.vector.CreateVector(), state.vector.FV().NumPy()
    noise = np.random.default_rng(seed).standard_normal(len(own))*np.array(list(solver.free))
    vector.FV().NumPy()[:] = own + size*np.abs(own).max()*noise
    return replace(state, vector=vector)


def newton(way, step, guess, psi0, rho, seed):
    """From a state at 1 - step of the load, with noise of `guess` times its largest unknown, to the whole load."""
    method, walk = way.split(", ")
    _, contact = squares(method, 0.25, COARSE, psi0, rho*(PENALTY if method == "penalty" else 1))
    _, facets, solver = contact.prepare()
    load = contact.share(accuracy.LOAD)
    start = None
    if step < 1:
        *_, start = load_path(solver, [(1 - step)*load])
        start = noisy(solver, start, guess, seed)
    if walk == "one step":
        state = solver.solve(load, start)
    else:
        *_, state = load_path(solver, [load], start=start)
    found, true = np.array([-state.multipliers[corner] for corner in facets.corners]), condensed(contact, accuracy.LOAD)
    return Outcome(distance(found, true[:, -found.shape[1]:]), WORST if method == "al" else None, state.iterations)


def cycling(way, levels, alpha, order, off, rho, start):
    """On a mesh graded to edges that are wrong by `off` of themselves, from nothing or from noise to the whole load."""
    scene = Draw("", "microblock", alpha, NU, 1.0).scene()
    solid = scene.body.solid
    edges = [(1 + off)*abs(edge) for pair in half_plane(scene, 1e-3).all_zones[0] for edge in pair]
    ground = Ground(DOMAIN, (0.0, REACH))
    body = Body(graded(ground, edges, spacing=COARSE*order, levels=levels), solid, order, fixed=ground.supports)
    facets = ContactFacets(body, scene.law, scene.obstacle)
    true = BodyContact(body, scene.obstacle, scene.law).at(accuracy.LOAD/2)
    solver = Newton(body, facets, rho=rho*(solid.lam + 2*solid.mu), control="load")
    first = None if start == "nothing" else noisy(solver, solver.solve(accuracy.LOAD/20), 1.0, levels)
    if way == "one step":
        state = solver.solve(accuracy.LOAD/2, first)
    else:
        *_, state = load_path(solver, [accuracy.LOAD/2], start=first)
    found = np.array([-state.multipliers[corner] for corner in facets.corners])
    return Outcome(distance(found*facets.weights, true.pressures*facets.weights), WORST, state.iterations)


def first_contact(method, load, height, rho, alpha):
    """A load (over that of a_Hz) on a cylinder that waits above the ground."""
    solid = Draw("", "microblock", alpha, NU, 1.0).scene().body.solid
    contact = UniformContact(solid, Lifted(accuracy.RADIUS, height), Microblock(), DOMAIN, COARSE, 1, REACH, method,
                             rho*(solid.lam + 2*solid.mu)*(PENALTY if method == "penalty" else 1))
    state, = contact.states([load*accuracy.LOAD])
    return Outcome(distance(state.pressures, condensed(contact, load*accuracy.LOAD)), WORST if method == "al" else None,
                   state.iterations)


@dataclass(frozen=True)
class Lifted(Cylinder):
    """A cylinder that starts at a height above the ground."""

    lift: float = 0.0

    def height(self, x):
        return super().height(x) + self.lift


SUPPORTS = {      # of a block, from enough to none
    "all": {"u1": "bottom", "u2": "bottom", "psi": "bottom"},
    "psi free": {"u1": "bottom", "u2": "bottom"},
    "u1 free": {"u2": "bottom", "psi": "bottom"},
    "u2 free": {"u1": "bottom", "psi": "bottom"},
    "rotation free": {"u1": "bottom"},
    "none": {},
}


def supported(solver, supports, beta, order, nu, ell):
    """A block with more or fewer supports than it needs; answers are judged by Clapeyron: energy is half the work."""
    mesh = MakeStructured2DMesh(quads=True, nx=round(2/BLOCK), ny=round(HEIGHT/BLOCK), mapping=lambda x, y: (2*x - 1, y - 1))
    mesh.ngmesh.SetBCName([*mesh.GetBoundaries()].index("top"), "contact")
    body = Body(ng.Mesh(mesh.ngmesh), Cosserat(E=2*(1 - nu**2), nu=nu, ell=ell, beta=beta), order, fixed=SUPPORTS[supports])
    energy, work, iterations = BY_SOLVER[solver](body)
    return Outcome(abs(energy/work - 1), CLAPEYRON, iterations)


def _bulk(body):
    loads = Loads(traction={"contact": (0.1, -1.0)}, micromoment={"contact": 0.1})
    fields = body.solve(loads)
    work = ng.Integrate((0.1*fields.u1 - fields.u2 + 0.1*fields.psi)*ng.ds("contact"), body.mesh)
    return fields.energy(), work/2, None


def _condensed(body):
    state = BodyContact(body, Cylinder(1.0), Microblock()).at(LOAD)
    return state.fields.energy(), state.energy, state.iterations


def _newton(body, method):
    facets = ContactFacets(body, Microblock(), Cylinder(1.0))
    state = Newton(body, facets, method=method, control="load").solve(LOAD)
    forces = {corner: -state.multipliers[corner]*facets.weights for corner in facets.corners}
    changes = facets.gap_changes(*state.fields, 0.0)      # what the body gives way at each corner
    work = sum(forces[corner] @ np.where(forces[corner] > 0, changes[corner], 0.0) for corner in facets.corners)
    return state.fields.energy(), work/2, state.iterations


BY_SOLVER = {"bulk": _bulk, "condensed": _condensed, "al": partial(_newton, method="al"),
             "penalty": partial(_newton, method="penalty")}
RHO = Axis("rho", r"$\rho a_\mathrm{Hz}/(\lambda + 2\mu)$", 1e-6, 1e6, degenerate="both")
PENALTIES = Axis("rho", RHO.label, 1e-2, 1e10, degenerate="both")
SQUARES = Axis("spacing", r"$h/a_\mathrm{Hz}$", 0.4, 0.2)
IN_STRIP = {"rho": r"$\rho H/(\lambda + 2\mu)$"}
MAPS = (
    Map("penalty_strip", "Strip: which rho of the penalty is best on a mesh, and where does it spoil the matrix?",
        penalty_in_strip, (replace(PENALTIES, label=IN_STRIP["rho"]), Axis("elements", "elements", 2, 512, whole=True)),
        share=0.5),
    Map("penalty_squares", "Cylinder: which rho of the penalty is best on a mesh, and where does it spoil the matrix?",
        penalty_on_squares, (PENALTIES, SQUARES, ALPHA), share=0.6),
    Map("lagrangian_strip", "Strip: does the augmented Lagrangian depend on rho?", lagrangian_in_strip,
        (replace(RHO, label=IN_STRIP["rho"]), Axis("elements", "elements", 8, 32, whole=True),
         Axis("ell_over_H", r"$\ell/H$", 0.1, 10.0)), share=0.3),
    Map("lagrangian_squares", "Cylinder: does the augmented Lagrangian depend on rho?", lagrangian_on_squares,
        (RHO, SQUARES, ALPHA), share=0.6),
    Map("newton", "From how far does Newton's method find the state, at once or with load stepping?", newton,
        (Axis("step", "step over the whole load", 1e-3, 1.0, degenerate="high"),
         Axis("guess", "noise of the first guess", 1e-8, 1e4, degenerate="high"),
         Axis("psi0", r"$\psi_0 R/a_\mathrm{Hz}$", 0.0, 0.5, "linear", "low"), Axis("rho", RHO.label, 1e-2, 1e2),
         Axis("seed", "seed", 0, 2**31, "linear", whole=True)),
        ("way", ("al, one step", "al, load path", "penalty, one step", "penalty, load path"))),
    Map("cycling", "Does the plain active set cycle on meshes graded to the edges?", cycling,
        (Axis("levels", "levels of grading", 0, 8, "linear", "high", whole=True),
         Axis("off", "edge off by", 1e-4, 0.1), choice("order", "order", 1, 2, 3), ALPHA, Axis("rho", RHO.label, 1e-2, 1e2),
         choice("start", "first guess", "nothing", "noise")), ("way", ("one step", "load path")), 0.5),
    Map("first_contact", "Is the free approach found from a distance, and the first node that touches?", first_contact,
        (Axis("load", "load", 1e-12, 1e-2, degenerate="low"), Axis("height", r"height$/a_\mathrm{Hz}$", 1e-6, 1e3),
         Axis("rho", RHO.label, 1e-2, 1e2), ALPHA), ("method", ("al", "penalty")), 0.5),
    Map("supports", "What becomes of matrices that are singular, or nearly?", supported,
        (choice("supports", "supports", *SUPPORTS, degenerate="high"),
         choice("beta", r"$\beta$", 0.0, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3, 1.0, 1.999999, degenerate="low"),
         choice("order", "order", 1, 2, 3, 4), Axis("nu", r"$\nu$", 0.0, 0.49, "linear"), Axis("ell", r"$\ell$", 0.01, 1.0)),
        ("solver", tuple(BY_SOLVER)), 0.5),
)
