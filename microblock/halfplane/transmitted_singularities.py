"""Singular places that a second body carries from corner to corner (docs/theory/two_bodies.md).

A singularity of p_A at x is one of B's gap at x - ell, of p_B one of A's gap at x + ell.
"""

import numpy as np

from ..model.intervals import contains, zone_edges
from .kernels import counter_short_waves, short_waves

MOST = 24  # steps
SAME = 1e-9  # of ell: places this near to each other are one


def decay(problem):
    """Factor by which singularities fade in a step, 0 to 1; 0 without a second body or with one corner.

    ``A_m, B_m ~ t^m`` solve ``(c_AA + c) A + (c_AB + c/t) B = 0`` and ``(c_AB + c t) A + (c_BB + c) B = 0``,
    c of the second body.
    """
    if problem.counter is None or len(problem.law.corners) == 1:
        return 0.0
    (displacement, rotation), own = short_waves(problem.solid), counter_short_waves(problem.counter)
    a, b = problem.levers(np.zeros(1))[:, 0]
    coupling = abs(displacement + rotation * a * b)
    if not coupling:
        return 0.0
    both = (displacement + rotation * a**2 + own) * (displacement + rotation * b**2 + own)
    half = (both - coupling**2 - own**2) / (2 * coupling * own)
    return float(1 / (half + np.sqrt(half**2 - 1)))


def ways(problem, order, share=1.0):
    """Lengths by which places worth `share` are carried on panels of an order."""
    factor = decay(problem)
    if not factor:
        return []
    # panels of order 4 leave singularities a share of 1, and for each four points more a digit less
    enough = 1 - ((order - 4) / 4 * np.log(10) + np.log(share)) / np.log(factor)
    steps = int(np.clip(np.ceil(enough), 0, MOST))
    return [step * problem.solid.ell for step in range(-steps, steps + 1) if step]


def carried_edges(problem, zones, order):
    """Edges of zones {corner: intervals} and places they are carried to."""
    shares, every = {}, problem.all_zones(zones)
    if not decay(problem):
        return zone_edges(every)
    whole = np.ptp(zone_edges(zones))
    for intervals in every.values():
        edges = np.ravel(intervals)
        apart = np.minimum(np.diff(edges) / whole, 1.0)
        near = np.sqrt(np.minimum(np.append(apart, 1.0), np.insert(apart, 0, 1.0)))
        shares |= {x: max(share, shares.get(x, 0.0)) for x, share in zip(edges.tolist(), near.tolist())}
    return transmitted_singularities(problem, shares, order)


def transmitted_singularities(problem, shares, order):
    """{place: worth} and where they are carried, ascending list."""
    found = sorted(shares)
    for x in sorted(x + way for x, share in shares.items() for way in ways(problem, order, share)):
        if min(abs(each - x) for each in found) > SAME * problem.solid.ell:
            found.append(x)
    return sorted(found)


def log_sizes(problem, zones, order):
    """{contact point: {corner: K}} of ``p ~ K log(1/|x - place|)`` at jumps of the slope."""
    whole, found = problem.all_zones(zones), {kink: {} for kink in problem.kinks}
    if not found:
        return found
    most = MOST if decay(problem) else 0  # its end is none of the problem's
    corner, step = np.divmod(np.arange((2 * most + 1) * len(whole)), 2 * most + 1)
    kinks = np.array([*found])
    places = kinks[:, None] + (step - most) * problem.solid.ell
    jumps = np.array([[known.get(each, 0.0) for each in corner] for known in problem.kinks.values()])
    jumps = jumps.reshape(places.shape) * (step == most)
    closed = np.empty(places.shape, bool)
    for each, intervals in whole.items():
        edges, x = np.sort(np.ravel(intervals)), places[:, corner == each]
        before, through = (np.searchsorted(edges, x, side=side) for side in ("left", "right"))
        closed[:, corner == each] = (before == through) & (before % 2 == 1)
    met = np.flatnonzero(closed.any(axis=1))
    for rows in np.array_split(met, 1 + len(met) * len(corner) ** 2 // 10**6):  # of 10 MB
        sizes = sizes_at(problem, places[rows], corner, closed[rows], jumps[rows])
        least = 10 ** (-order / 4) * np.abs(sizes).max(axis=1, initial=0.0)
        for row, n in np.argwhere(closed[rows] & (np.abs(sizes) >= least[:, None])):
            x, size = float(places[rows[row], n]), float(sizes[row, n])
            near = (other for other in found if abs(other - x) <= SAME * problem.solid.ell)
            at = found.setdefault(x if x in found else next(near, x), {})
            at[int(corner[n])] = at.get(int(corner[n]), 0.0) + size
    return {place: sizes for place, sizes in found.items() if sizes}


def sizes_at(problem, x, corner, closed, jumps):
    """K of ``p ~ K log(1/|x - place|)`` at places of numbered corners, of which some are closed, from jumps
    of the slope: arrays (k, n), the numbers (n,).
    """
    between = _short_waves_between(problem, x, corner)
    both = closed[:, None] & closed[..., None]
    between = np.where(both, between, np.eye(len(corner)))
    return np.linalg.solve(between, (closed * jumps)[..., None])[..., 0] / np.pi


def log_sizes_of(problem, zones, places, corner):
    """K of ``p ~ K log(1/|x - place|)`` of a corner, were it closed at these slope discontinuities, array
    (k,).
    """
    whole = problem.all_zones(zones)
    numbers, x = np.arange(len(whole)), np.tile(places[:, None], len(whole))
    closed = np.transpose([contains(whole[number], places) | (number == corner) for number in numbers])
    jumps = np.array([[problem.kinks[place].get(number, 0.0) for number in numbers] for place in places])
    return sizes_at(problem, x, numbers, closed, jumps)[:, corner]


def _short_waves_between(problem, x, corner):
    """Limits of k times the gaps from pressures between places of corners, (..., n): array (..., n, n)."""
    lever = np.reshape(problem.lever(np.resize(corner, x.size), x.ravel()), x.shape)
    pressed, near = x - np.array(problem.shifts)[corner], SAME * problem.solid.ell
    displacement, rotation = short_waves(problem.solid)
    same, opposite = (np.abs(own[..., None] - own[..., None, :]) < near for own in (x, pressed))
    own = same * (displacement + rotation * lever[..., None] * lever[..., None, :])
    return own + opposite * counter_short_waves(problem.counter)


def meeting_exponent(problem, zones, x):
    """s of p ~ x^s where edges of two corners meet at x: that of `coalescence_exponent`, of these levers and
    of what a second body carries.
    """
    others = [
        (x + way, corner)
        for way in ways(problem, 26)
        for corner, intervals in zones.items()
        if any(left < x + way < right for left, right in intervals)
    ]
    places, corner = map(np.array, zip((x, 0), (x, 1), *others))
    matrix = _short_waves_between(problem, places, corner)
    own = matrix[:2, :2] - matrix[:2, 2:] @ np.linalg.solve(matrix[2:, 2:], matrix[2:, :2])
    return float(np.arccos(own[0, 1] / np.sqrt(own[0, 0] * own[1, 1])) / np.pi)
