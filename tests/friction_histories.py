"""Seeded histories of friction on half-planes: what comes of each. Estimates beside true errors: the set
`friction` of `cases.benchmarks.verification`.

    python -m tests.friction_histories 300

prints a line each: law, obstacle, sizes, the outcome: "right", "NotConverged", "refused", or "wrong" and why,
and the seconds it took.
"""

import sys
import time

import numpy as np

import microblock as mb
from microblock.corners.follower import Follower
from microblock.halfplane.friction_solver import FrictionSolver

RTOL = 0.05  # of the outcomes
BALANCED = 1e-8  # of the work, over load times the height of the obstacle at the edge; rounding leaves 1e-13
SAME = 1e-7  # of tractions over the largest, with pairs put in between
BETWEEN = 3  # of them on each way


def scene(seed):
    """(words, Contact, pairs, coupled) of a seed; heights are x^2/2 at the distance 1, E* = 1."""
    draw = np.random.default_rng(seed)
    alpha, f = (float(np.exp(draw.uniform(*np.log(ends)))) for ends in ((0.01, 2.0), (0.05, 1.0)))
    nu, beta, curvature = draw.uniform(0, 0.45), draw.uniform(0.1, 1.9), draw.uniform(0.5, 3.0)
    words, obstacle = OBSTACLES[seed % len(OBSTACLES)](draw)
    law = LAWS[draw.integers(len(LAWS))](friction=f)
    solid = mb.Cosserat(1 - nu**2, nu, alpha, beta=beta, curvature=curvature)
    if draw.random() < 0.25:
        words = f"{words} on a body"
        second = mb.Cosserat(draw.uniform(0.3, 3.0), draw.uniform(0, 0.45), draw.uniform(0.01, 0.5), beta=1.0)
        obstacle = mb.Deformable(mb.HalfPlane(second), obstacle)
    coupled = bool(draw.random() < 0.7)
    named = (
        f"{type(law).__name__:12s} {words:24s} alpha {alpha:4.2f} f {f:4.2f} {'' if coupled else 'un'}coupled"
    )
    return named, mb.Contact(mb.HalfPlane(solid), obstacle, law), pairs(draw, f), coupled


def pairs(draw, f):
    """Two to five pairs (P, Q): pressing, then shear and normal force up, down, back or over to full slip."""
    P, Q, found = draw.uniform(0.2, 0.8), 0.0, []
    if draw.random() < 0.7:
        found.append((P, 0.0))
    for _ in range(draw.integers(2, 5)):
        P = P * (1.0 if draw.random() < 0.5 else draw.uniform(0.4, 1.6))
        Q = float(np.clip(draw.uniform(-1.3, 1.3), -1, 1)) * f * P
        found.append((P, Q))
    return found


def _power(draw):
    power = draw.uniform(1.5, 4.0)
    return f"|x|^{power:.1f}", lambda x: np.abs(x) ** power / 2


def _ripples(draw):
    high, number = draw.uniform(0.002, 0.05), draw.uniform(3, 12)
    return f"ripples {high:.3f}", lambda x: x**2 / 2 + high * (1 - np.cos(number * x))


def _waves(draw):
    """A wave on a wide cylinder, which several crests of it touch."""
    high, number = draw.uniform(0.01, 0.1), draw.uniform(2, 8)
    return f"waves {high:.3f}", lambda x: x**2 / 20 + high * (1 - np.cos(number * x))


def _uneven(draw):
    return "uneven", lambda x: np.where(x > 0, 0.3, 0.8) * x**2


OBSTACLES = (
    lambda draw: ("cylinder", mb.Cylinder(1.0)),
    lambda draw: ("wedge", mb.Wedge(draw.uniform(0.2, 0.8))),
    _power,
    _ripples,
    lambda draw: ("punch", mb.Punch(1.0, draw.uniform(-0.1, 0.1))),
    _uneven,
    _waves,
)
LAWS = mb.Microblock, mb.Microblock, mb.Unilateral, mb.Microclamped


def faults(contact, history, coupled):
    """What is wrong with a history, as words."""
    f, found, before = contact.law.friction, [], 0.0
    for state in history.states:
        p, q, weights = state.pressure, state.shear_traction, state.weights
        fields = p, q, state.micromoment, state.psi, state.slip, [state.energy, state.work, state.dissipation]
        if not all(np.isfinite(each).all() for each in fields):
            found.append("not finite")
        size = state.load
        if abs(state.work - state.energy - state.dissipation) > BALANCED * size:
            found.append(f"work {abs(state.work - state.energy - state.dissipation) / size:.0e}")
        if state.dissipation < before - 1e-12 * size:
            found.append(f"dissipation {(state.dissipation - before) / size:.0e}")
        lost = max(abs(weights @ p - state.load), abs(weights @ q - state.shear)) / size
        beyond = float((np.abs(q) - f * p).max() / p.max())
        least = float(state.solution.pressures.min() / p.max())
        if lost > BALANCED or beyond > BALANCED or least < -BALANCED:
            found.append(f"forces {lost:.0e} {beyond:.0e} {least:.0e}")
        if not 0 < state.error_estimate <= RTOL:
            found.append(f"estimate {state.error_estimate}")
        before = state.dissipation
    return found + _between(contact, history, coupled)


def _between(contact, history, coupled):
    """Pairs put in between, on the last state's cells."""
    given = [(state.load, state.shear) for state in history.states]
    edges = history.states[-1].solution.edges
    own = FrictionSolver(contact.solver, np.array(given), coupled)
    path, last = Follower(own.on(edges)[1]), (0.0, 0.0)
    for pair in given:
        for share in np.arange(1, BETWEEN + 2) / (BETWEEN + 1):
            moment = path.to(*(np.array(last) + share * np.subtract(pair, last)))
        last = pair
    once = history.states[-1].solution.moment
    widths = np.ptp(edges, axis=1)
    largest = (once.normal.reshape(-1, len(edges)) / widths).max()
    tangential = moment.tangential.reshape(-1, len(edges)).sum(axis=0)  # where each corner has its own
    off = np.abs(tangential - once.tangential) / widths / largest
    return [f"between {off.max():.0e}"] if off.max() > SAME else []


def outcome(seed):
    """(words, outcome, seconds) of a seed."""
    words, contact, given, coupled = scene(seed)
    begun = time.perf_counter()
    try:
        history = contact.history(given, coupled=coupled, rtol=RTOL)
        wrong = faults(contact, history, coupled)
        found = "wrong: " + ", ".join(wrong) if wrong else "right"
    except mb.NotConverged as failure:
        found = f"NotConverged: {failure}"
    except mb.BadArgument as failure:
        found = f"refused: {failure}"
    return words, found, time.perf_counter() - begun


if __name__ == "__main__":
    for number in range(int(sys.argv[1])):
        print(f"{number:3d}", *outcome(number), flush=True)
