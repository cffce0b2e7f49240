"""Singular pressures at slope discontinuities and where edges of two corners meet (docs/theory/halfplane.md).

Short waves decide them: their limits of the kernels.
"""

import numpy as np

from .kernels import counter_short_waves, short_waves


def slope_jumps(problem):
    """Contact points at which the slope of a gap jumps, (k,), ascending, and jumps, array (corners, k)."""
    known, x = problem.kinks, sorted(problem.kinks)
    jumps = [[known[place].get(corner, 0.0) for place in x] for corner in range(len(problem.shifts))]
    return np.array(x), np.array(jumps)


def log_strengths(problem, x, jumps, closed):
    """K of ``p ~ K log(1/|x - place|)`` at `slope_jumps`, array (corners, k), where `closed` says so,
    booleans of that shape.
    """
    alone = np.eye(len(jumps))[..., None]
    between = np.where(closed & closed[:, None], _between(problem, x), alone)
    return np.linalg.solve(between.T, (closed * jumps).T[..., None])[..., 0].T / np.pi


def log_sizes(problem, zones):
    """{contact point: {corner: K}} of `log_strengths` within zones {corner: intervals}."""
    (x, jumps), whole = slope_jumps(problem), problem.all_zones(zones)
    closed = [[any(a < place < b for a, b in whole[corner]) for place in x] for corner in range(len(jumps))]
    sizes = log_strengths(problem, x, jumps, np.array(closed, bool).reshape(jumps.shape)).T.tolist()
    inside = [{corner: K for corner, K in enumerate(own) if K} for own in sizes]
    return {place: own for place, own in zip(x.tolist(), inside) if own}


def _between(problem, x):
    """Limits of k times the gaps at x from pressures of corners there: array (corners, corners, n)."""
    levers, (displacement, rotation) = problem.levers(x), short_waves(problem.solid)
    alone = np.eye(len(levers))[..., None]
    return displacement + rotation * levers * levers[:, None] + counter_short_waves(problem.counter) * alone


def meeting_exponent(problem, x):
    """s of p ~ x^s where edges of two corners meet at x: that of `coalescence_exponent`, of these levers."""
    own = _between(problem, np.array([x]))[..., 0]
    return float(np.arccos(own[0, 1] / np.sqrt(own[0, 0] * own[1, 1])) / np.pi)
