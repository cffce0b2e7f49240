"""The conditions (26) on a fitted state, wherever a corner could touch: gaps on all of the surface, pressures
at all nodes.

Out of contact the displacement of the surface is smooth between the edges: on each stretch between them it is
known from some POINTS, in a parameter that opens the square roots at the edges and the logarithm far away.
The obstacle is not so smooth; its heights are those of its picture, at all sites of which the gap is looked
at. What a violation is worth is measured as the state's error is: in L2 of the pressure over that of the
state, for an overlap d on a width w as ``E* d/sqrt(w)``.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.polynomial.chebyshev import chebpts1, chebvander

from ..model.problem import half_line
from ..model.zones import contains, runs, zone_edges
from .carried import carried, carried_edges

POINTS = 20  # of a stretch; where the kernel's scales are many, more
PER_SCALE = 4  # for each factor e of them
DENSER = 3  # times as many places at which a stretch is looked at, beside the sites of the obstacle
NOISE = 4.0  # times the last coefficients of the series: errors of a gap
ZOOMS, CLOSER = 4, 9  # looks nearer at a minimum between sites, and places of each
LOOKED_AT = 7  # places of an overlap at which it is verified
# of ell, or of the contact's width if that is less: scale of the parameter far from the contact
CORE = 0.5


@dataclass(frozen=True)
class Violation:
    """An interval of x in which a corner overlaps the obstacle (depth > 0, a length) or is in tension (depth
    0).

    `worth` is its share of the error.
    """

    corner: int
    left: float
    right: float
    depth: float
    worth: float


@dataclass(frozen=True)
class Survey:
    """What was seen of a state: `violations`, `least`: [(corner, x, gap)] of the local minima of the gaps,
    `beyond`: whether something beyond the obstacle's picture could touch."""

    violations: list
    least: list
    beyond: bool

    @property
    def worth(self):
        """Of all violations together."""
        return float(np.sqrt(sum(each.worth**2 for each in self.violations)))


def survey(state):
    """The Survey of a PanelSolution."""
    problem = state.problem
    size = np.sqrt(state.weights @ state.pressures.sum(axis=0) ** 2)
    violations, least, beyond = _pulled(state, size), [], False
    found = list(_series(state))
    places = [_sites(problem, stretch) for stretch, _, _ in found]
    corners = np.concatenate(
        [np.full(len(x), stretch.corner) for x, (stretch, _, _) in zip(places, found)] or [np.zeros(0, int)]
    )
    heights = problem.initial_gap(corners, np.concatenate(places or [np.zeros(0)]))
    heights = np.split(heights, np.cumsum([len(x) for x in places])[:-1])
    for x, height, (stretch, series, noise) in zip(places, heights, found):
        x, rise, gaps = _between_sites(problem, stretch, series, x, height)
        violations += _overlaps(state, stretch, x, gaps, noise, problem.E_star / size)
        inner = np.flatnonzero((gaps[1:-1] < gaps[:-2]) & (gaps[1:-1] <= gaps[2:])) + 1
        least += [(stretch.corner, float(x[i]), float(gaps[i])) for i in inner if _stands_out(gaps, i, noise)]
        beyond = beyond or _beyond(problem, problem.picture, stretch, x, rise, noise)
    return Survey(violations, least, beyond)


@dataclass(frozen=True)
class _Stretch:
    """Between two neighbouring edges, out of the zones of a corner; outer ones have one edge (the other is
    inf).
    """

    corner: int
    left: float
    right: float
    core: float
    far: float

    @property
    def _reach(self):
        return np.arcsinh(np.sqrt(self.far / self.core))

    @property
    def count(self):
        return POINTS + (0 if np.isfinite(self.left + self.right) else int(PER_SCALE * self._reach))

    def at(self, t):
        """Abscissae at parameters in [-1, 1]."""
        share = (1 + t) / 2
        if np.isfinite(self.left + self.right):
            return self.left + (self.right - self.left) * (1 - np.cos(np.pi * share)) / 2
        away = self.core * np.sinh(self._reach * share) ** 2
        return self.left + away if np.isinf(self.right) else self.right - away

    def parameter(self, x):
        """Its inverse, for x within."""
        if np.isfinite(self.left + self.right):
            share = np.arccos(np.clip(1 - 2 * (x - self.left) / (self.right - self.left), -1, 1)) / np.pi
        else:
            away = x - self.left if np.isinf(self.right) else self.right - x
            share = np.arcsinh(np.sqrt(np.maximum(away, 0) / self.core)) / self._reach
        return 2 * share - 1


def _stretches(state):
    """All stretches of the corners that are computed."""
    problem, zones = state.problem, state.all_zones
    edges = np.array(zone_edges(zones))
    left, right = problem.reach
    core = CORE * min(problem.solid.ell, edges[-1] - edges[0])
    for corner in problem.corners:
        kinks = carried(problem, _kinks_inside(problem, zones, corner), state.panels.order)
        breaks = [*carried_edges(problem, state.zones, state.panels.order), *kinks]
        breaks = np.unique([0.0, *(each for each in breaks if each > 0)] if half_line(problem) else breaks)
        pieces = [*zip(breaks, breaks[1:]), (breaks[-1], np.inf)]
        for a, b in pieces if half_line(problem) else [(-np.inf, breaks[0]), *pieces]:
            far = (right - a) if np.isinf(b) else (b - left)
            middle = (a + b) / 2 if np.isfinite(a + b) else (a + core if np.isinf(b) else b - core)
            if far > core * 1e-6 and not any(one <= middle <= other for one, other in zones[corner]):
                yield _Stretch(corner, float(a), float(b), float(core), float(max(far, core)))


def _kinks_inside(problem, zones, corner):
    """Contact points at which the pressure of another corner has a logarithm."""
    others = [pair for number, own in zones.items() if number != corner for pair in own]
    return [kink for kink in problem.kinks if any(left < kink < right for left, right in others)]


def _series(state):
    """(stretch, Chebyshev series of -approach + u and of phi, error) of all stretches, with one look at the
    kernels.
    """
    problem, stretches = state.problem, list(_stretches(state))
    places = [stretch.at(chebpts1(stretch.count)) for stretch in stretches]
    if not places:
        return
    x = np.concatenate(places)
    corner = np.concatenate([np.full(len(own), stretch.corner) for own, stretch in zip(places, stretches)])
    cuts = np.cumsum([len(own) for own in places])[:-1]
    numbers = np.array(corner, int)
    raised = state.counter_displacement(x - np.array(problem.shifts)[numbers]) - state.approach
    if varies(problem):
        flat = state.displacement_at(x, np.zeros_like(x))
        both = np.array((flat + raised, state.displacement_at(x, np.ones_like(x)) - flat))
    else:
        both = (state.displacement_at(x, problem.lever(corner, x)) + raised)[None]
    for stretch, values in zip(stretches, np.split(both, cuts, axis=1)):
        series = values @ _onto_series(stretch.count)
        yield stretch, series, NOISE * float(np.abs(series[:, -2:]).sum())


@lru_cache(maxsize=64)
def _onto_series(count):
    """From values at the Chebyshev points to coefficients: array (count, count), to multiply with from the
    right.
    """
    return np.linalg.inv(chebvander(chebpts1(count), count - 1)).T


def varies(problem):
    """Whether the levers change along the line."""
    return problem.picture is not None and problem.picture.angle is not None


def _risen(problem, stretch, series, x):
    """What the gap has more than at first, at x in a stretch."""
    angles = np.arccos(np.clip(stretch.parameter(x), -1, 1))
    values = series @ np.cos(np.arange(series.shape[1])[:, None] * angles)
    return (
        values[0]
        if len(values) == 1
        else values[0] + problem.lever(np.full(len(x), stretch.corner), x) * values[1]
    )


def _sites(problem, stretch):
    """Places in a stretch at which its gap is looked at, ascending."""
    t = -np.cos(np.pi * (np.arange(DENSER * stretch.count) + 0.5) / (DENSER * stretch.count))
    own = stretch.at(t)
    sites = problem.sites(stretch.corner)
    return np.unique(np.concatenate((own, sites[(sites > own.min()) & (sites < own.max())])))


def _between_sites(problem, stretch, series, x, height):
    """Places in a stretch, what gaps have there more than at first, and the gaps; between the sites as well,
    if less is there.
    """
    rise = _risen(problem, stretch, series, x)
    gaps = height + rise
    for _ in range(ZOOMS):
        least = np.flatnonzero((gaps[1:-1] <= gaps[:-2]) & (gaps[1:-1] <= gaps[2:])) + 1
        # what a parabola through three neighbours, and twice that, may fall below the middle one
        least = least[2 * gaps[least] < np.maximum(gaps[least - 1], gaps[least + 1])]
        if not len(least):
            break
        more = np.unique(np.concatenate([np.linspace(x[i - 1], x[i + 1], CLOSER) for i in least]))
        more = more[~np.isin(more, x)]
        risen = _risen(problem, stretch, series, more)
        added = problem.initial_gap(np.full(len(more), stretch.corner), more) + risen
        order = np.argsort(np.concatenate((x, more)), kind="stable")
        x, rise, gaps = (np.concatenate(pair)[order] for pair in ((x, more), (rise, risen), (gaps, added)))
    return x, rise, gaps


def _stands_out(gaps, i, noise):
    """Whether the gap at a minimum is less than it is further away on both sides, by more than its error."""
    return min(gaps[:i].max(initial=-np.inf), gaps[i + 1 :].max(initial=-np.inf)) > max(gaps[i], 0) + noise


def _overlaps(state, stretch, x, gaps, noise, unit):
    """Intervals of x in which the gaps are negative where they are looked at without a series: there it is
    below its noise.
    """
    found = []
    for first, last in runs(gaps < noise):
        doubtful = gaps[first : last + 1].min() >= -noise
        # next to an edge, where the gap begins with 0
        if doubtful and (first == 0 or last == len(x) - 1):
            continue
        looked = np.unique(
            (*np.linspace(first, last, LOOKED_AT).astype(int), first + int(np.argmin(gaps[first : last + 1])))
        )
        direct = state.gaps(stretch.corner, x[looked])
        if doubtful and (direct < 0).any():
            first, last = looked[direct < 0][[0, -1]]
        left = (x[first - 1] + x[first]) / 2 if first else x[first]
        right = (x[last] + x[last + 1]) / 2 if last + 1 < len(x) else x[last]
        depth = float(-direct.min())
        if right > left and depth > 0:
            found.append(
                Violation(
                    stretch.corner,
                    float(left),
                    float(right),
                    depth,
                    float(unit * depth / np.sqrt(right - left)),
                )
            )
    return found


def _pulled(state, size):
    """Intervals of the zones in which a corner is in tension."""
    found = []
    for corner in state.problem.corners:
        for left, right in state.zones[corner]:
            inside = np.flatnonzero((left <= state.x) & (state.x <= right))
            x, p, weights = state.x[inside], state.pressures[corner, inside], state.weights[inside]
            for first, last in runs(p < 0):
                a = (x[first - 1] + x[first]) / 2 if first else left
                b = (x[last] + x[last + 1]) / 2 if last + 1 < len(x) else right
                worth = np.sqrt(weights[first : last + 1] @ p[first : last + 1] ** 2) / size
                found.append(Violation(corner, float(a), float(b), 0.0, float(worth)))
    return found + list(_pulled_at_valleys(state, size))


def _pulled_at_valleys(state, size):
    """The same nearer to slope discontinuities than the nodes: where the slope of the obstacle falls the
    pressure has the logarithm of an infinite tension.

    With ``p = A + K log(|h|/r)``, K < 0, it is negative up to ``r0 = |h| exp(A/K)``; in L2 that is worth
    sqrt(2 r0) |K| on either side.
    """
    panels, v = state.panels, state.panels.points[0][0]
    slopes = {}
    for number in np.flatnonzero(panels.log_size < 0):
        h, smooth = panels.h[number], state.q[number * panels.order] / panels.slope(number, v)
        if smooth + panels.logarithm(number, v) > 0:  # else the nodes show it
            reach = abs(h) * np.exp(smooth / panels.log_size[number])
            ends = slopes.setdefault((int(panels.corner[number]), float(panels.e[number])), {})
            ends[np.sign(h)] = reach, 2 * reach * panels.log_size[number] ** 2
    for (corner, kink), ends in slopes.items():
        left, right = (ends.get(side, (0.0, 0.0))[0] for side in (-1, 1))
        worth = np.sqrt(sum(square for _, square in ends.values())) / size
        if left + right > 0:
            yield Violation(corner, kink - left, kink + right, 0.0, float(worth))


def _beyond(problem, picture, stretch, x, rise, noise):
    """Whether the surface comes higher than the picture looks, somewhere out of its stretches."""
    if picture is None or (np.isfinite(stretch.left + stretch.right) and len(picture.stretches) == 1):
        return False
    shift = problem.shift(stretch.corner)
    out = ~contains(np.add(picture.stretches, shift), x)
    return bool(np.any(picture.allowed(x[out] - shift) + rise[out] < -noise))
