"""Pressure singularities that a second body transmits one block length on (docs/theory/two_bodies.md).

Corners press the second body half a block length beside their contact points: a singularity of p_A at x is
one of B's gap at x - ell, of p_B one of A's gap at x + ell. So contact points come in chains, with a block
length from each to the next.

1. Along a chain singularities fade by a factor a block length (`decay`), and panels of an order see the first
   few (`transmission_lengths`).
2. At edges of zones they are powers of the distance: panels are graded towards them (`singular_edges`).
3. At slope discontinuities they are logarithms ``K log(1/r)``. Short waves alone decide on K: on the closed
   points of a chain ``sum_j c_ij K_j = jump_i/pi``, with the limits c of k times the gap under a pressure
   (`log_sizes`).
4. Where edges of both corners meet, the pressure is a power of the distance (`meeting_exponent`).
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np

from ..model.intervals import contains, zone_edges
from ..model.problem import Problem
from ..model.types import Array, CornerZones, Flags, Integers
from .kernels import counter_short_waves, short_waves

MOST_BLOCKS = 24  # block lengths that a singularity is followed
SAME_PLACE = 1e-9  # of ell: places this near to each other are one


def decay(problem: Problem) -> float:
    """Returns the factor by which singularities fade in a block length, 0 to 1; 0 without a second body or
    with one corner.

    ``A_m, B_m ~ t^m`` solve ``(c_AA + c) A + (c_AB + c/t) B = 0`` and ``(c_AB + c t) A + (c_BB + c) B = 0``,
    c of the second body.
    """
    if problem.counter is None or len(problem.law.corners) == 1:
        return 0.0
    displacement, rotation = short_waves(problem.solid)
    second = counter_short_waves(problem.counter)
    a, b = problem.levers(np.zeros(1))[:, 0]
    coupling = abs(displacement + rotation * a * b)
    if not coupling:
        return 0.0
    product = (displacement + rotation * a**2 + second) * (displacement + rotation * b**2 + second)
    half = (product - coupling**2 - second**2) / (2 * coupling * second)
    return float(1 / (half + np.sqrt(half**2 - 1)))


def transmission_lengths(problem: Problem, order: int, strength: float = 1.0) -> list[float]:
    """Returns lengths by which singularities of a relative strength are transmitted on panels."""
    factor = decay(problem)
    if not factor:
        return []
    # panels of order 4 leave singularities of the strength 1, and for each four points more a digit less
    enough = 1 - ((order - 4) / 4 * np.log(10) + np.log(strength)) / np.log(factor)
    count = int(np.clip(np.ceil(enough), 0, MOST_BLOCKS))
    return [step * problem.solid.ell for step in range(-count, count + 1) if step]


def singular_edges(problem: Problem, zones: CornerZones, order: int) -> list[float]:
    """Returns edges of zones and places they are transmitted to, ascending (lengths)."""
    every = problem.all_zones(zones)
    if not decay(problem):
        return zone_edges(every)
    width = np.ptp(zone_edges(zones))
    strengths: dict[float, float] = {}
    for intervals in every.values():
        edges = np.ravel(intervals)
        distance = np.minimum(np.diff(edges) / width, 1.0)
        nearest = np.minimum(np.append(distance, 1.0), np.insert(distance, 0, 1.0))
        for x, strength in zip(edges.tolist(), np.sqrt(nearest).tolist()):
            strengths[x] = max(strength, strengths.get(x, 0.0))
    return transmitted_singularities(problem, strengths, order)


def transmitted_singularities(problem: Problem, strengths: Mapping[float, float], order: int) -> list[float]:
    """Returns the places of singularities, {place: relative strength}, and where they are transmitted to,
    ascending.
    """
    places = sorted(strengths)
    transmitted = [
        x + way for x, strength in strengths.items() for way in transmission_lengths(problem, order, strength)
    ]
    for x in sorted(transmitted):
        if min(abs(place - x) for place in places) > SAME_PLACE * problem.solid.ell:
            places.append(x)
    return sorted(places)


@dataclass(frozen=True, eq=False)
class Chains:
    """Contact points of numbered corners, chain by chain, some of them closed; at some of them slopes of gaps
    jump.

    Attributes
    ----------
    x : array (k, n), abscissae (lengths)
    corner : array (n,), numbers of the corners
    closed : boolean array (k, n), whether the corner is in contact
    jumps : array (k, n), of the slopes of the gaps
    """

    x: Array
    corner: Integers
    closed: Flags
    jumps: Array

    def select(self, chains: Integers) -> "Chains":
        """Returns the chains of the numbers, array (m,)."""
        return Chains(self.x[chains], self.corner, self.closed[chains], self.jumps[chains])


def _chains(problem: Problem, zones: CornerZones) -> Chains:
    """Returns the Chains of the zones of all corners, of one link where nothing is transmitted."""
    most = MOST_BLOCKS if decay(problem) else 0  # its end is none of the problem's
    corner, step = np.divmod(np.arange((2 * most + 1) * len(zones)), 2 * most + 1)
    x = np.array([*problem.kinks])[:, None] + (step - most) * problem.solid.ell
    jumps = [[jumps.get(number, 0.0) for number in corner] for jumps in problem.kinks.values()]
    closed = np.empty(x.shape, bool)
    for number, intervals in zones.items():
        edges = np.sort(np.ravel(intervals))
        before = np.searchsorted(edges, x[:, corner == number], side="left")
        through = np.searchsorted(edges, x[:, corner == number], side="right")
        closed[:, corner == number] = (before == through) & (before % 2 == 1)
    return Chains(x, corner, closed, np.reshape(jumps, x.shape) * (step == most))


def log_sizes(problem: Problem, zones: CornerZones, order: int) -> dict[float, dict[int, float]]:
    """Returns {contact point: {corner: K}} of ``p ~ K log(1/|x - place|)`` at jumps of the slope (stress)."""
    sizes: dict[float, dict[int, float]] = {kink: {} for kink in problem.kinks}
    if not sizes:
        return sizes
    all_chains = _chains(problem, problem.all_zones(zones))
    met = np.flatnonzero(all_chains.closed.any(axis=1))
    for numbers in np.array_split(met, 1 + len(met) * len(all_chains.corner) ** 2 // 10**6):  # of 10 MB
        chains = all_chains.select(numbers)
        K = sizes_on(problem, chains)
        least = 10 ** (-order / 4) * np.abs(K).max(axis=1, keepdims=True, initial=0.0)
        for i, n in np.argwhere(chains.closed & (np.abs(K) >= least)):
            by_corner = sizes.setdefault(_place_of(problem, sizes, float(chains.x[i, n])), {})
            corner = int(chains.corner[n])
            by_corner[corner] = by_corner.get(corner, 0.0) + float(K[i, n])
    return {place: by_corner for place, by_corner in sizes.items() if by_corner}


def _place_of(problem: Problem, places: Collection[float], x: float) -> float:
    """Returns which of some places x is (lengths), but for rounding; x itself if it is none."""
    if x in places:
        return x
    return next((place for place in places if abs(place - x) <= SAME_PLACE * problem.solid.ell), x)


def sizes_on(problem: Problem, chains: Chains) -> Array:
    """Returns K of ``p ~ K log(1/|x - place|)`` (stress) at the points of Chains, array (k, n)."""
    closed = chains.closed
    coupled = closed[:, None] & closed[..., None]
    gaps = _short_waves_between(problem, chains.x, chains.corner)
    limits = np.where(coupled, gaps, np.eye(len(chains.corner)))
    K = np.linalg.solve(limits, (closed * chains.jumps)[..., None])[..., 0]
    return np.asarray(K, float) / np.pi


def log_sizes_of(problem: Problem, zones: CornerZones, places: Array, corner: int) -> Array:
    """Returns K of ``p ~ K log(1/|x - place|)`` of a corner, were it closed at these slope discontinuities,
    arrays (k,).
    """
    every = problem.all_zones(zones)
    numbers = range(len(every))
    x = np.tile(places[:, None], len(every))
    closed = np.transpose([contains(every[number], places) | (number == corner) for number in numbers])
    jumps = np.array([[problem.kinks[place].get(number, 0.0) for number in numbers] for place in places])
    return sizes_on(problem, Chains(x, np.array(numbers), closed, jumps))[:, corner]


def _short_waves_between(problem: Problem, x: Array, corner: Integers) -> Array:
    """Returns limits of k times the gaps from pressures between places of corners, (..., n): array
    (..., n, n).
    """
    lever = np.reshape(problem.lever(np.resize(corner, x.size), x.ravel()), x.shape)
    below = x - np.array(problem.shifts)[corner]  # on the second body
    displacement, rotation = short_waves(problem.solid)
    tolerance = SAME_PLACE * problem.solid.ell
    same, opposite = (np.abs(y[..., None] - y[..., None, :]) < tolerance for y in (x, below))
    first = same * (displacement + rotation * lever[..., None] * lever[..., None, :])
    return first + opposite * counter_short_waves(problem.counter)


def meeting_exponent(problem: Problem, zones: CornerZones, x: float) -> float:
    """Returns s of p ~ x^s where edges of two corners meet at x: that of `coalescence_exponent`, of these
    levers and of what a second body transmits.
    """
    closed = [
        (x + way, corner)
        for way in transmission_lengths(problem, 26)
        for corner, intervals in zones.items()
        if any(left < x + way < right for left, right in intervals)
    ]
    places, corner = map(np.array, zip((x, 0), (x, 1), *closed))
    matrix = _short_waves_between(problem, places, corner)
    met = matrix[:2, :2] - matrix[:2, 2:] @ np.linalg.solve(matrix[2:, 2:], matrix[2:, :2])
    return float(np.arccos(met[0, 1] / np.sqrt(met[0, 0] * met[1, 1])) / np.pi)
