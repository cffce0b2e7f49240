"""Maps of contact states: active sets, uniform cells, users' meshes that are refined, the length of the
layer.
"""

from functools import lru_cache

import numpy as np

import microblock as mb
from microblock.corners import active_set
from microblock.errors import NotConverged

from ..common import bodies
from ..scenes import layers
from .limits_maps import Axis, Map, Outcome

LOAD = np.pi / 2  # with E* = 2 and R = 1: a_Hz = 1
NU = 0.3
KKT = 1e-10  # what `active_set` promises
SETS = 1000  # of a plain active set before it counts as lost
LINE = 1e-6  # rtol of the contact line where it verifies


# contact states on a compliance


def _spd(rng, size, logarithm):
    """A positive definite matrix whose eigenvalues are spread evenly in the logarithm over so many
    decades.
    """
    basis = np.linalg.qr(rng.normal(size=(size, size)))[0]
    return (basis * 10.0 ** rng.uniform(-logarithm, 0, size)) @ basis.T


def _residual(H, g0, c, state, load):
    """Largest relative residual of (a) from the data alone, as the tests of `active_set` measure it."""
    touch, share = np.isfinite(g0), c * state.forces
    H, g0, share = H[np.ix_(touch, touch)] / c[touch, None] / c[touch], g0[touch] / c[touch], share[touch]
    gaps = g0 - state.approach + H @ share
    length = (np.abs(g0) + abs(state.approach) + np.abs(H) @ share)[state.closed[touch]].max(initial=0) or 1.0
    return max(
        0.0,
        -gaps.min() / length,
        np.abs(share * gaps).sum() / (share.sum() * length),
        -share.min() / load,
        abs(share.sum() - load) / load,
    )


def _plain(H, g0, load):
    """(forces, approach, sets tried) by the primal-dual active set as it is written most often."""
    closed, seen = g0 - g0.min() <= 0, set()
    for steps in range(1, SETS):
        chosen = np.flatnonzero(closed)
        one = np.ones((len(chosen), 1))
        system = np.block([[H[np.ix_(chosen, chosen)], -one], [one.T, np.zeros((1, 1))]])
        solution = np.linalg.lstsq(system, np.append(-g0[chosen], load), rcond=None)[0]
        forces, approach = np.zeros(len(g0)), solution[-1]
        forces[chosen] = solution[:-1]
        gaps = g0 - approach + H @ forces
        fresh = np.where(closed, forces > 0, gaps < -1e-13 * (np.abs(g0) + np.abs(H) @ np.abs(forces)))
        if np.array_equal(fresh, closed):
            return forces, approach, steps
        if fresh.tobytes() in seen or not fresh.any():
            raise NotConverged(
                f"the plain active set {'cycles' if fresh.any() else 'opens every corner'} "
                f"after {steps} sets; "
                "active_set.solve does not",
                iterations=steps,
            )
        seen.add(fresh.tobytes())
        closed = fresh
    raise NotConverged(f"the plain active set still changes after {SETS} sets", iterations=SETS)


def random_states(method, condition, size, load, start, seed):
    """Forces of a random problem of a condition number 10^condition."""
    rng, size = np.random.default_rng(int(seed)), int(round(size))
    H, g0, c = _spd(rng, size, condition), rng.normal(size=size), np.ones(size)
    return _solved(method, H, g0, c, load, start, rng)


def _solved(method, H, g0, c, load, start, rng):
    if method == "plain":
        forces, approach, steps = _plain(H / c / c[:, None], g0 / c, load)
        state = active_set.ContactState(forces / c, g0, forces > 0, approach, load, steps, 0, 0, 0.0, 0.0)
    elif method == "path":
        state = active_set.path(H, g0, [load / 7, load], c=c).states[1]
    else:
        first = active_set.solve(H, g0, load=load, c=c)
        closed = {
            "nothing": None,
            "near": active_set.solve(H, g0, load=0.9 * load, c=c).closed,
            "absurd": ~first.closed,
            "random": rng.random(len(g0)) < 0.5,
        }[start]
        state = active_set.solve(H, g0, load=load, c=c, start=closed)
    return Outcome(
        _residual(H, g0, c, state, load),
        KKT,
        state.iterations,
        state.kkt,
        "load path" if state.followed else None,
    )


def degenerate_states(problem, degree, size, method, seed):
    """Forces of a problem that is degenerate up to `degree`: vanishing weights, copies, no gaps, pairs,
    missing rank.
    """
    rng, size = np.random.default_rng(int(seed)), int(round(size))
    H, g0, c = _spd(rng, size, 2), np.abs(rng.normal(size=size)), np.ones(size)
    if problem == "weights":  # some stand for next to no surface, as ends of facets of unequal length
        c = np.where(rng.random(size) < 0.5, degree, 1.0)
        H, g0 = H * c * c[:, None], g0 * c
    elif problem == "copies":
        copy = rng.integers(0, size, size)
        H, g0 = H[np.ix_(copy, copy)], g0[copy] + degree * rng.choice((0, 1), size)
    elif problem == "no gaps":
        g0 = degree * rng.choice((-1, 0, 1), size)
    elif problem == "pairs":  # corners of one node under a flat obstacle, mirrored
        even, odd = (one + one[::-1, ::-1] for one in (_spd(rng, size, 2), degree * _spd(rng, size, 2)))
        H, c = np.block([[even + odd, even - odd], [even - odd, even + odd]]), np.ones(2 * size)
        g0 = np.tile(np.abs(rng.normal(size=size)).round(), 2)
    elif problem == "rank":
        factors = rng.normal(size=(size, max(1, size // 3)))
        H = factors @ factors.T + degree * np.eye(size)
    return _solved(method, H, g0, c, 1.0, "nothing", rng)


# uniform cells


def cells_asked(alpha, rtol, psi0):
    """A cylinder on as many cells as a tolerance asks for."""
    law = mb.Microblock(psi0)
    solid = mb.Cosserat(E=2 * (1 - NU**2), nu=NU, ell=alpha, beta=1.0)
    problem, reach = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(1.0), law), 1.5 + alpha
    line = problem.solve(load=LOAD, rtol=LINE)
    state = problem.with_(method=mb.Cells(window=(-reach, reach))).solve(load=LOAD, rtol=rtol)
    true = line.pressure_at(state.x)
    error = np.linalg.norm(state.pressure - true) / np.linalg.norm(true)
    return Outcome(float(error), rtol, state.iterations, state.error_estimate)


# users' meshes

LAWS = {"microblock": mb.Microblock(), "unilateral": mb.Unilateral()}
SIDE = 6.0  # of the square, over a_Hz
FACETS = np.linspace(-1.8, 1.8, 9)  # of its contact boundary, at first


@lru_cache(maxsize=12)
def _square(alpha, contact):
    """The same square on fitted elements, of one order everywhere: what verifies makes no use of orders that
    fall with distance.
    """
    solid = mb.Cosserat(E=2 * (1 - NU**2), nu=NU, ell=alpha, beta=1.0)
    problem = mb.Contact(mb.Block(solid, SIDE), mb.Cylinder(1.0), LAWS[contact], mb.Fitted(even=True))
    return problem.solve(load=LOAD, rtol=1e-3)


def asked_of_mesh(rtol, alpha, contact):
    """A user's coarse mesh, refined until a tolerance holds."""
    solid = mb.Cosserat(E=2 * (1 - NU**2), nu=NU, ell=alpha, beta=1.0)
    corners = [(SIDE, 0), (SIDE, -SIDE), (-SIDE, -SIDE), (-SIDE, 0), *((float(x), 0) for x in FACETS)]
    names = ["side", "bottom", "side", "free", *["contact"] * (len(FACETS) - 1), "free"]
    body = mb.Body(bodies.mesh_of(bodies.polygon(corners, names), SIDE / 3, 1), solid, 3, fixed="bottom")
    state = mb.Contact(body, mb.Cylinder(1.0), LAWS[contact]).solve(load=LOAD, rtol=rtol)
    other = _square(alpha, contact)
    return Outcome(
        state.solution.difference(other.solution.pressure),
        rtol + other.error_estimate,
        state.unknowns,
        state.error_estimate,
    )


def layer(alpha, x1, beta):
    """The length of the layer by the fit (51), beside that of the micropolar mode; a fit that is not
    determined says why.
    """
    (row,) = layers._by_modes(alpha, layers.Parameters(alphas=(alpha,), positions=(x1,), beta=beta))[0]
    length, mode = row["L_bl_over_ell"], row["mode_length_over_ell"]
    if length is None:
        raise NotConverged(row["reason"])
    return Outcome(abs(length / mode - 1) if mode else None, None, None, row["L_bl_error"] / length)


SEED = Axis("seed", "", 0, 2**31, "linear")
SIZE = Axis("size", "corners", 2, 300)
STARTS = Axis("start", "", choices=("nothing", "near", "absurd", "random"))
CONTACTS = Axis("contact", "", choices=("microblock", "unilateral"))
THIN_TO_THICK = Axis("alpha", "alpha", 1e-3, 2.0, degenerate="both")
MAPS = (
    Map(
        "states_random",
        "What does a plain active set do that block pivoting and the path do not?",
        random_states,
        (
            Axis("condition", "log10 of the condition number", 0.0, 14.0, "linear", "high"),
            SIZE,
            Axis("load", "load", 1.0, 1e4),
            STARTS,
            SEED,
        ),
        ("method", ("plain", "pivoting", "path")),
        1.0,
        "residual of (a)",
    ),
    Map(
        "states_degenerate",
        "Are degenerate problems solved, up to the very degeneracy?",
        degenerate_states,
        (
            Axis("degree", "degree", 1.0, 1e-16, degenerate="high"),
            SIZE,
            Axis("method", "", choices=("pivoting", "path")),
            SEED,
        ),
        ("problem", ("weights", "copies", "no gaps", "pairs", "rank")),
        1.0,
        "residual of (a)",
    ),
    Map(
        "cells_asked",
        "Does the grid keep the tolerance it is asked for?",
        cells_asked,
        (
            Axis("alpha", "alpha", 1e-3, 3.0, degenerate="both"),
            Axis("rtol", "rtol", 1e-1, 1e-3),
            Axis("psi0", "", 1e-5, 0.3),
        ),
        share=0.5,
    ),
    Map(
        "body_asked",
        "Does refinement of a user's mesh keep the tolerance it is asked for?",
        asked_of_mesh,
        (Axis("rtol", "rtol", 3e-1, 5e-3), Axis("alpha", "alpha", 0.05, 1.0), CONTACTS),
        share=0.2,
    ),
    Map(
        "layer_fit",
        "Where is the length of the layer determined, and is the reason said where it is not?",
        layer,
        (
            THIN_TO_THICK,
            Axis("x1", "x1/a_Hz", 1e-3, 10.0, degenerate="both"),
            Axis("beta", "", 0.1, 1.9, "linear"),
        ),
        share=0.3,
        error="|L_bl/L_mode - 1|",
    ),
)
