"""The conditions (26) on a fitted state, wherever a corner could touch.

Displacement and rotation are interpolated out of contact on panels. Overlaps are those of
`microblock.model.missed_contact`.
"""

import numpy as np
from numpy.polynomial.legendre import legvander

from ..contact_solvers.rounding import EPS_TERM
from ..errors import BadArgument
from ..model.intervals import borders, contains, runs
from ..model.missed_contact import Violation, log_tension, overlaps
from ..model.problem import half_line
from .panels import panels_outside


def contact_violations(state):
    """[Violation] of a state; raises BadArgument if the obstacle could touch beyond its picture."""
    problem, surface = state.problem, _Surface(state)
    # a violation that is computed stands for its mirror image, too
    size = np.sqrt(state.weights @ state.tractions.sum(axis=0) ** 2 / (2 if problem.mirror else 1))
    found = [*_tensile(state, size), *_at_valleys(state, size)]
    for corner in problem.corners:
        found += _overlaps(state, corner, *_gaps(state, surface, corner), problem.E_star / size)
        if _beyond(problem, corner, surface):
            raise BadArgument(
                "obstacle",
                problem.obstacle,
                f"could touch at load {state.load:g} where it is too high for that under a classical "
                "half-plane",
            )
    return found


class _Surface:
    def __init__(self, state):
        self.problem, self.panels = state.problem, panels_outside(state.problem, state.zones, 10)
        points, weights = self.panels.points
        x, order = self.panels.nodes[2], self.panels.order
        u, psi = state.displacement_and_rotation(x)
        rises = [u - state.approach + state.counter_displacement(x - shift) for shift in self.problem.shifts]
        self._values = np.reshape((*rises, self.problem.ell / 2 * psi), (len(rises) + 1, -1, order))
        # the last terms of a Legendre series are the error of the others
        last = np.arange(order - 2, order)
        series = (2 * last + 1) * weights[:, None] * legvander(2 * points - 1, order - 1)[:, -2:]
        self._noise = 4 * np.abs(self._values @ series).sum(axis=(0, 2))

    def __call__(self, corner, x):
        """Changes of the gaps, and their errors, at x out of contact: arrays (n,)."""
        number, v = self.panels.at(0, x)
        rise, phi = self.panels.interpolated(self._values[[corner, -1]], number, v)
        return rise + self.problem.lever(np.full(len(x), corner), x) * phi, self._noise[number]

    def places(self, corner):
        count = 4 * self.panels.order
        number = np.repeat(np.arange(len(self.panels.e)), count)
        own = self.panels.x(number, np.resize((np.arange(count) + 0.5) / count, len(number)))
        sites = self.problem.sites(corner)
        return np.union1d(own, sites[(sites > own.min(initial=np.inf)) & (sites < own.max(initial=-np.inf))])


def _gaps(state, surface, corner):
    """Places, ascending, gaps, nan at edges of zones, and their errors."""

    def at(x):
        rise, noise = surface(corner, x)
        return np.array((x, problem.initial_gap(np.full(len(x), corner), x) + rise, noise))

    problem, edges = state.problem, np.ravel(state.zones[corner])
    places = surface.places(corner)
    known = at(places[~contains(state.zones[corner], places)])
    known = np.concatenate((known, np.array((edges, *np.full((2, len(edges)), np.nan)))), axis=1)
    for _ in range(4):
        x, gaps, _ = known = known[:, np.argsort(known[0], kind="stable")]
        least = _minima(gaps)
        # what a parabola through three neighbours, and twice that, may fall below the middle one
        above = np.maximum(gaps[least - 1], gaps[least + 1])
        least = least[above - gaps[least] > np.maximum(gaps[least], _rounding(state))]
        if not len(least):
            break
        more = np.linspace(x[least - 1], x[least + 1], 9).ravel()
        known = np.concatenate((known, at(np.setdiff1d(more, x))), axis=1)
    return known[:, np.argsort(known[0], kind="stable")]


def _rounding(state):
    """Gaps (length) that are sums of larger terms."""
    return EPS_TERM * (abs(state.approach) + state.load / state.problem.E_star)


def _minima(gaps):
    return np.flatnonzero((gaps[1:-1] < gaps[:-2]) & (gaps[1:-1] <= gaps[2:])) + 1


def _overlaps(state, corner, x, gaps, noise, unit):
    doubtful, gaps = np.abs(gaps) < noise, gaps.copy()
    if doubtful.any():
        gaps[doubtful] = state.gap(corner, x[doubtful])
    least = _rounding(state)
    for first, last in runs(gaps < -least):
        beside = [max(first - 1, 0), min(last + 1, len(x) - 1)]
        # next to an edge, where the gap begins with 0
        if doubtful[first : last + 1].all() and np.isnan(gaps[beside]).any():
            gaps[first : last + 1] = np.nan
    return overlaps(corner, x, gaps, unit, least)


def _tensile(state, size):
    for corner in state.problem.corners:
        for left, right in state.zones[corner]:
            left = max(left, 0.0) if half_line(state.problem) else left
            inside = (left <= state.x) & (state.x <= right)
            x, p, weights = state.x[inside], state.tractions[corner, inside], state.weights[inside]
            edges = borders(x, left, right)
            for first, last in runs(p < 0):
                part = slice(first, last + 1)
                worth = float(np.sqrt(weights[part] @ p[part] ** 2) / size)
                yield Violation(corner, float(edges[first]), float(edges[last + 1]), 0.0, worth)


def _at_valleys(state, size):
    """Yields tension beside slope discontinuities, where ``p = A + K log(|h|/r)`` with K < 0."""
    panels = state.panels
    v = panels.points[0][0]
    for number in np.flatnonzero(panels.log_size < 0):
        smooth = state.q[number * panels.order] / panels.slope(number, v)
        if smooth + panels.logarithm(number, v) > 0:  # else the nodes show it
            r0, worth = log_tension(abs(panels.h[number]), smooth, panels.log_size[number])
            end = panels.e[number] + np.copysign(r0, panels.h[number])
            left, right = sorted((panels.e[number], end))
            yield Violation(int(panels.corner[number]), float(left), float(right), 0.0, worth / size)


def _beyond(problem, corner, surface):
    x, shift = surface.places(corner), problem.shifts[corner]
    x = x[~contains(np.add(problem.candidates.stretches, shift), x)]
    rise, noise = surface(corner, x)
    return bool(np.any(problem.candidates.allowed(x - shift) + rise < -noise))
