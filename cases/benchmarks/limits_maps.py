"""Maps of the study `limits`, as data: each map is a function that solves one problem and verifies it, and
the ranges of its parameters.

Units of the problems on a line: E* = 20, R = 10 and the load pi/2, so that a classical contact has the
half-width 1. `eta` is mu_c/mu: beta = 2 eta/(1 + eta) vanishes with it and tends to 2 beyond it.
"""

import math

import ngsolve as ng
import numpy as np

import microblock as mb
from microblock.contact_solvers import active_set
from microblock.fem import meshes, meshes3d
from microblock.fem.body import Loads
from microblock.model.intervals import distance, zone_edges
from microblock.model.solver import SOLVED

from .. import layers
from .. import strip as script
from ..closed_forms import Strip
from .sampling import Axis, Map, Outcome
from .verification import NoAnswer, lines, panels

LOAD, RADIUS = np.pi / 2, 10.0
ALPHA_MID = 0.8343132323  # where two zones touch, for nu = 0.3 and beta = 1
# the first and the last rtol that a method is asked for
RTOLS = {"panels": (1e-2, 1e-7), "cells": (1e-1, 1e-3), "fitted": (1e-2, 1e-3), "mesh": (3e-1, 1e-2)}
BLOCK, REACH = 6.0, 2.0  # size of a bounded block; half-width of equal squares
DOMAIN = 18.0  # size of the paper's block
CLAPEYRON = 1e-6  # energy is half the work: what a matrix with supports leaves, and one without does not
SUPPORTS = {
    "all": {"u1": "bottom", "u2": "bottom", "psi": "bottom"},
    "psi free": {"u1": "bottom", "u2": "bottom"},
    "u1 free": {"u2": "bottom", "psi": "bottom"},
    "u2 free": {"u1": "bottom", "psi": "bottom"},
    "rotation free": {"u1": "bottom"},
    "none": {},
}


def solid_of(alpha, nu=0.3, eta=1.0, E_star=2 * RADIUS):
    return mb.Cosserat(E=E_star * (1 - nu**2), nu=nu, ell=alpha, beta=2 * eta / (1 + eta))


def compared(state, true, promise=None, **more):
    """The Outcome of a State beside a more accurate State, or a `panels.Reference`."""
    return Outcome(lines.error(state, true), promise, state.error_estimate, **more)


def on_panels(problem, load, state, rtol):
    """The Outcome of a State on panels, by the second code; by uniform cells where that has no answer."""
    try:
        true, own = panels.reference(problem, load, state)
        return compared(state, true, rtol + own, judge="panels")
    except NoAnswer:
        grid = problem.with_(method=mb.Cells(nodes=4096)).solve(load=load)
        return compared(state, grid, rtol + grid.error_estimate, judge="cells")


def asked(method, contact, strictness, nu, eta, alpha, psi0, slope):
    """A cylinder or wedge, solved to an rtol: 0 to 1 of `strictness` are the ends of RTOLS."""
    first, last = RTOLS[method]
    rtol, blocks, E_star = first * (last / first) ** strictness, contact.split()[-1], 2 * RADIUS
    obstacle = mb.Wedge(slope) if "wedge" in contact else mb.Cylinder(RADIUS)
    if "wedge" in contact:
        psi0, E_star = min(psi0, 1.0) * slope, LOAD / slope
    law = {
        "rotated": mb.Microblock(psi0),
        "levers": mb.Microblock(psi0, "levers"),
        "unilateral": mb.Unilateral(),
    }
    solid = solid_of(alpha, nu, eta, E_star)
    problem = mb.Contact(mb.HalfPlane(solid), obstacle, law.get(blocks, mb.Microblock()))
    if method == "panels":
        return on_panels(problem, LOAD, problem.solve(load=LOAD, rtol=rtol), rtol)
    ground = meshes.Ground(far=BLOCK, reach=(-REACH, REACH), half=False)
    ways = {
        "cells": {"method": mb.Cells()},
        "fitted": {"body": mb.Block(solid)},
        "mesh": {"body": mb.Body(meshes.uniform(ground, 0.5), solid, 3, fixed="bottom")},
    }
    state = problem.with_(**ways[method]).solve(load=LOAD, rtol=rtol)
    if method == "mesh":  # one order everywhere: the state in question has orders that fall with distance
        problem = problem.with_(body=mb.Block(solid, BLOCK), method=mb.Fitted(even=True))
    true = problem.solve(load=LOAD, rtol=rtol / 30)
    return compared(state, true, rtol + true.error_estimate, judge=true.method)


def event(kind_of, distance, strictness, psi0, alpha):
    """A load next to an event: two zones apart or joined, or the second corner of rotated blocks touches."""
    rtol, load, law = 1e-2 * 1e-6**strictness, LOAD, mb.Microblock()
    if kind_of == "touching":
        law = mb.Microblock(psi0)
    else:
        alpha = ALPHA_MID * (1 + distance * (1 if kind_of == "apart" else -1))
    problem = mb.Contact(mb.HalfPlane(solid_of(alpha)), mb.Cylinder(RADIUS), law)
    if kind_of == "touching":
        path = problem.path(load=LOAD + 50 * RADIUS * alpha * psi0)
        births = [one.load for one in path.events if one.kind == "born" and one.zone in "AB" and one.load > 0]
        load = (1 + distance) * min(births, default=path.last)
    return on_panels(problem, load, problem.solve(load=load, rtol=rtol), rtol)


# ---- contact states on a compliance


def positive(rng, size, decades):
    """A positive definite matrix whose eigenvalues are spread evenly over so many decades."""
    basis = np.linalg.qr(rng.normal(size=(size, size)))[0]
    return (basis * 10.0 ** rng.uniform(-decades, 0, size)) @ basis.T


def states(problem, method, degree, size, start, seed):
    """Forces of a random problem that is degenerate to the power `degree`, 0 to 1."""
    rng, tiny = np.random.default_rng(int(seed)), 10 ** (-16 * degree)
    decades = 14 * degree if problem == "ill-conditioned" else 2
    H, gaps, c = positive(rng, size, decades), np.abs(rng.normal(size=size)), np.ones(size)
    if problem == "copies":
        copy = rng.integers(0, size, size)
        H, gaps = H[np.ix_(copy, copy)], gaps[copy] + tiny * rng.choice((0, 1), size)
    elif problem == "no gaps":
        gaps = tiny * rng.choice((-1.0, 0.0, 1.0), size)
    elif problem == "rank":
        factors = rng.normal(size=(size, max(1, size // 3)))
        H = factors @ factors.T + tiny * np.eye(size)
    elif problem == "weights":  # some corners stand for next to no surface
        c = np.where(rng.random(size) < 0.5, tiny, 1.0)
        H, gaps = H * c * c[:, None], gaps * c
    if method == "path":
        changes = [event.corner for event in active_set.path(H, gaps, 1.0, c=c)]
        closed = np.bincount(changes, minlength=len(gaps)) % 2 == 1
        state = active_set.solve(H, gaps, load=1.0, c=c, start=closed)
    else:
        first = active_set.solve(H, gaps, load=1.0, c=c)
        closed = {"nothing": None, "absurd": ~first.closed, "random": rng.random(size) < 0.5}[start]
        state = active_set.solve(H, gaps, load=1.0, c=c, start=closed)
    H, gaps, forces = H / c / c[:, None], gaps / c, c * state.forces
    now = gaps - state.approach + H @ forces
    length = (np.abs(gaps) + abs(state.approach) + np.abs(H) @ np.abs(forces))[forces > 0].max()
    wrong = np.abs(forces * now).sum() / length, -now.min() / length, -forces.min(), abs(forces.sum() - 1)
    # 1e-10 is what `active_set` promises
    return Outcome(max(wrong), 1e-10)


# ---- finite elements


def squares(order, contact, nu, eta, alpha, psi0, spacing):
    """Equal squares whose nodes have a spacing: error, what alternates between nodes, and tension between
    them, over the largest pressure.
    """
    law = {"microblock": mb.Microblock(), "rotated": mb.Microblock(psi0), "unilateral": mb.Unilateral()}[
        contact
    ]
    solid = solid_of(alpha, nu, eta)
    problem = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(RADIUS), law)
    way = mb.Uniform(h=order * spacing, order=order, reach=REACH)
    block = problem.with_(body=mb.Block(solid), method=way)
    state, true = block.solve(load=LOAD), problem.solve(load=LOAD, rtol=1e-5)
    nodes = np.unique(state.x)
    nodes = nodes[np.abs(nodes) < 0.8 * np.abs(zone_edges(true.zones)).min()]
    wrong = state.pressure_at(nodes) - true.pressure_at(nodes)
    alternating = (wrong[:-2] - 2 * wrong[1:-1] + wrong[2:]) / 4
    between = np.array([state.pressure_at(np.linspace(-REACH, REACH, 2001), c) for c in state.pressures])
    largest = between.sum(axis=0).max()
    return compared(
        state,
        true,
        oscillation=float(np.sqrt(np.mean(alternating**2)) / largest) if len(nodes) > 2 else None,
        tension=max(0.0, float(-between.min() / largest)),
    )


def stretched(shape, order, aspect, spacing, alpha):
    """A user's block of ground: elements `aspect` times as long as high, growing downwards and outwards."""
    side, far = order * spacing, 100.0
    across = meshes3d.graded(REACH, side, far, growth=1.7)
    height = min(side / aspect, far / 2)
    down, names = meshes3d.graded(height, height, far, growth=1.7), ("bottom", "side", "contact", "axis")
    mesh = meshes.rectangles(across, -down[::-1], shape == "quadrilaterals", names)
    problem = mb.Contact(mb.HalfPlane(solid_of(alpha)), mb.Cylinder(RADIUS), mb.Microblock())
    body = mb.Body(mesh, problem.solid, order, fixed=meshes.Ground(far, (0.0, REACH)).supports)
    state, true = problem.with_(body=body).solve(load=LOAD / 2), problem.solve(load=LOAD, rtol=1e-5)
    facets = state.solution.nodes.along
    ends = np.column_stack((facets.left, facets.right))
    points, weights = np.polynomial.legendre.leggauss(order + 2)  # between the nodes
    x = (ends.mean(axis=1)[:, None] + np.diff(ends) / 2 * points).ravel()
    p, exact = (np.array([one.pressure_at(x, corner) for corner in true.pressures]) for one in (state, true))
    moments = np.sum(np.array(list(problem.law.levers(x).values())) / 2 * (p - exact), axis=0)
    weights = (np.diff(ends) / 2 * weights).ravel()
    return Outcome(distance(weights, (p - exact).sum(axis=0), moments, exact.sum(axis=0)))


def newton(kind_of, rho, spacing, alpha):
    """A monolithic method on the paper's block, rho over (lambda + 2 mu)/a_Hz: the penalty beside the
    half-plane, the augmented Lagrangian beside the condensed body, which is the same discrete problem.
    """
    solid = solid_of(alpha)
    problem = mb.Contact(mb.Block(solid, DOMAIN), mb.Cylinder(RADIUS), mb.Microblock())
    way = mb.Newton(kind_of, rho * (solid.lam + 2 * solid.mu))
    state = problem.with_(method=mb.Uniform(h=spacing, newton=way, reach=REACH)).solve(load=LOAD)
    if kind_of == "penalty":
        return compared(state, problem.with_(body=mb.HalfPlane(solid)).solve(load=LOAD, rtol=1e-5))
    same = problem.with_(method=mb.Uniform(h=spacing, reach=REACH)).solve(load=LOAD)
    p, true = (np.array(list(one.pressures.values())) for one in (state, same))
    return Outcome(float(np.linalg.norm(p - true) / np.linalg.norm(true)), SOLVED)


def strip(kind_of, order, elements, ell_over_h, nu, eta, rho):
    """The strip in partial contact, ell over the length of an element: largest relative error of traction,
    micromoment and layer lengths beside the closed form.
    """
    ell, beta = ell_over_h / elements, 2 * eta / (1 + eta)
    contact = script.problem(ell, math.degrees(2e-3), nu, beta, order=order, elements=elements)
    way = mb.Newton(kind_of, rho * (contact.solid.lam + 2 * contact.solid.mu))
    delta_fc = Strip(ell, contact.law.psi0, nu, beta, 1.0).delta_fc
    state = contact.with_(method=way).solve(approach=0.5 * delta_fc)
    exact, values = script.closed_form(state), (-state.pressure[0], state.micromoment[0])
    true = exact.traction, exact.micromoment, exact.L_psi, exact.L_u
    pairs = zip((*values, *script.lengths(state)), true)
    return Outcome(float(max(abs(one / other - 1) for one, other in pairs)))


def supported(solver, supports, eta, order, nu, ell):
    """A block with more or fewer supports than it needs, verified by Clapeyron: energy is half the work."""
    mesh = meshes.rectangles(np.linspace(-1, 1, 9), np.linspace(-1, 0, 5))
    body = mb.Body(mesh, solid_of(ell, nu, eta, 2.0), order, fixed=SUPPORTS[supports], contact="top")
    if solver == "no contact":
        state = body.solve(Loads(traction={"top": (0.1, -1.0)}, micromoment={"top": 0.1}))
        work = ng.Integrate((0.1 * state.u1 - state.u2 + 0.1 * state.psi) * ng.ds("top"), mesh) / 2
        return Outcome(abs(state.energy() / work - 1), CLAPEYRON)
    way = None if solver == "condensed" else mb.Newton(solver)
    state = mb.Contact(body, mb.Cylinder(1.0), mb.Microblock(), way).solve(load=0.01)
    if way is None:
        return Outcome(abs(state.fields.energy() / state.energy - 1), CLAPEYRON)
    same = mb.Contact(body, mb.Cylinder(1.0), mb.Microblock()).solve(load=0.01)
    return Outcome(
        abs(state.fields.energy() / same.fields.energy() - 1), CLAPEYRON if solver == "al" else None
    )


def friction(body, friction, alpha, contact):
    """Pressed, sheared to full slip, and back to full slip the other way: a cylinder on a half-plane by cells
    or on a block by finite elements, a plane on all of a square. Work is energy and dissipation.
    """
    solid, obstacle, way, rtol = solid_of(alpha, E_star=2.0), mb.Cylinder(1.0), None, None
    law = (mb.Microblock if contact == "microblock" else mb.Unilateral)(friction=friction)
    if body == "half-plane":
        ground, rtol = mb.HalfPlane(solid), 0.3
    elif body == "block":
        ground, way = mb.Block(solid, 12.0), mb.Uniform(h=0.2, order=2, reach=2.6, newton=mb.Newton())
    else:
        mesh = meshes.rectangles(np.linspace(-1, 1, 9), np.linspace(-2, 0, 9))
        ground, obstacle = mb.Body(mesh, solid, 2, fixed="bottom", contact="top"), mb.Plane()
    pairs = [(LOAD, share * friction * LOAD) for share in (0.0, 0.5, 0.999, -0.999)]
    state = mb.Contact(ground, obstacle, law, way).history(pairs, rtol=rtol).states[-1]
    return Outcome(float(abs(state.work - state.energy - state.dissipation) / abs(state.work)), 1e-8)


def layer(alpha, x1, beta):
    """The length of the layer by the fit (51) below x1, beside that of the micropolar mode."""
    (row,) = layers.solve(alphas=(alpha,), positions=(x1,), beta=beta)["layers"]
    if None in (row["L_bl_over_ell"], row["mode_length_over_ell"]):
        raise mb.NotConverged(row["reason"])
    return Outcome(abs(row["L_bl_over_ell"] / row["mode_length_over_ell"] - 1))


ALPHA, NU = Axis("alpha", 0.05, 1.5), Axis("nu", 0.5, 1e-4, "below 1/2", ends=(1,))
ETA, PSI0 = Axis("eta", 1e-4, 1e3, ends=(0, 1)), Axis("psi0", 1e-6, 0.35, ends=(0, 1))
STRICT, SPACING = Axis("strictness", 0.0, 1.0, "linear", ends=(1,)), Axis("spacing", 0.15, 0.33)
MAPS = (
    Map("asked", asked, 240, (
        Axis("method", names=tuple(RTOLS)), Axis("contact", names=(
            "microblock", "rotated", "levers", "unilateral", "wedge", "wedge rotated", "wedge unilateral")),
        STRICT, NU, ETA, ALPHA, PSI0,
        Axis("slope", 1e-4, 1.0, ends=(0,)))),
    Map("event", event, 100, (
        Axis("kind_of", names=("apart", "joined", "touching")),
        Axis("distance", 1e-1, 1e-10, ends=(1,)), STRICT, Axis("psi0", 1e-3, 0.1), Axis("alpha", 0.1, 2.0))),
    Map("states", states, 240, (
        Axis("problem", names=("ill-conditioned", "copies", "no gaps", "rank", "weights")),
        Axis("method", names=("pivoting", "path")), Axis("degree", 0.0, 1.0, "linear", ends=(1,)),
        Axis("size", 2, 300, "whole"), Axis("start", names=("nothing", "absurd", "random")),
        Axis("seed", 0, 2**31, "linear"))),
    Map("squares", squares, 120, (
        Axis("order", 1, 6, "whole"),
        Axis("contact", names=("microblock", "rotated", "unilateral")), NU, ETA,
        Axis("alpha", 0.02, 1.0, ends=(0,)), PSI0, SPACING)),
    Map("stretched", stretched, 60, (
        Axis("shape", names=("quadrilaterals", "triangles")), Axis("order", 1, 6, "whole"),
        Axis("aspect", 1e-2, 1e4, ends=(0, 1)), SPACING, ALPHA)),
    Map("newton", newton, 120, (
        Axis("kind_of", names=("penalty", "al")), Axis("rho", 1e-4, 1e8, ends=(0, 1)), SPACING, ALPHA)),
    Map("strip", strip, 160, (
        Axis("kind_of", names=("penalty", "al")), Axis("order", 1, 6, "whole"),
        Axis("elements", 1, 64, "whole"), Axis("ell_over_h", 0.01, 100.0, ends=(0,)),
        Axis("nu", 0.0, 0.45, "linear"), Axis("eta", 0.03, 20.0), Axis("rho", 1e-4, 1e8, ends=(0, 1)))),
    Map("supported", supported, 120, (
        Axis("solver", names=("no contact", "condensed", "al", "penalty")),
        Axis("supports", names=tuple(SUPPORTS)), Axis("eta", 1e-12, 1e6, ends=(0, 1)),
        Axis("order", 1, 4, "whole"), Axis("nu", 0.0, 0.49, "linear"), Axis("ell", 0.01, 1.0))),
    Map("friction", friction, 120, (
        Axis("body", names=("half-plane", "block", "square")), Axis("friction", 0.3, 10.0, ends=(1,)),
        Axis("alpha", 0.01, 3.0, ends=(0, 1)), Axis("contact", names=("microblock", "unilateral")))),
    Map("layer", layer, 60, (
        Axis("alpha", 1e-3, 2.0, ends=(0, 1)), Axis("x1", 1e-3, 10.0, ends=(0, 1)),
        Axis("beta", 0.1, 1.9, "linear"))),
)  # fmt: skip
