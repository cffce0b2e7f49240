"""The conditions (26) on a fitted state, wherever a corner could touch: gaps on all of the surface, pressures
in all zones.

Out of contact the surface is smooth between the edges. Its displacement and rotation are interpolated there
on panels like those in contact, which open the square roots at the edges. The obstacle is not so smooth: the
gap is taken at all sites of its picture. A violation is measured as the state's error is, in L2 of the
pressure over that of the state: an overlap d on a width w as ``E* d/sqrt(w)``.
"""

from dataclasses import dataclass

import numpy as np
from numpy.polynomial.legendre import legvander

from ..model.zones import contains, runs
from .panels import make_panels


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
    problem, size = state.problem, np.sqrt(state.weights @ state.pressures.sum(axis=0) ** 2)
    violations, least, beyond, surface = list(_tensile(state, size)), [], False, _Surface(state)
    for corner in problem.corners:
        x, gaps, noise = _gaps(state, surface, corner)
        violations += _overlaps(state, corner, x, gaps, noise, problem.E_star / size)
        least += [
            (corner, float(x[i]), float(gaps[i])) for i in _minima(gaps) if _stands_out(gaps, i, noise[i])
        ]
        beyond = beyond or _beyond(problem, corner, surface)
    return Survey(violations, least, beyond)


class _Surface:
    """What the gaps of a state out of contact have more than at first, interpolated on panels there."""

    def __init__(self, state):
        self.problem = problem = state.problem
        # four points more than in contact: the panels are longer
        self.panels = panels = make_panels(problem, state.zones, state.panels.order + 4, outside=True)
        panel, _, x, _ = panels.nodes
        u, psi = state.displacement_and_rotation(x)
        u = (
            u
            - state.approach
            + state.counter_displacement(x - np.array(problem.shifts)[panels.corner[panel]])
        )
        self._values = np.array((u, problem.ell / 2 * psi)).reshape(2, -1, panels.order)
        # the last terms of a Legendre series are the error of the others
        points, weights = panels.points
        last = np.arange(panels.order - 2, panels.order)
        series = (2 * last + 1) * weights[:, None] * legvander(2 * points - 1, panels.order - 1)[:, -2:]
        self._noise = 4 * np.abs(self._values @ series).sum(axis=(0, 2))

    def __call__(self, corner, x):
        """The gaps without the initial ones, and their errors, at x out of contact: arrays (n,)."""
        number, v = self.panels.at(corner, x)
        u, phi = self.panels.interpolated(self._values, number, v)
        return u + self.problem.lever(np.full(len(x), corner), x) * phi, self._noise[number]

    def places(self, corner):
        """Abscissae at which the gap of a corner is taken: sites of the obstacle, and some on each panel."""
        panels = self.panels
        number = np.repeat(np.flatnonzero(panels.corner == corner), 2 * panels.order)
        v = np.resize((np.arange(2 * panels.order) + 0.5) / (2 * panels.order), len(number))
        own, sites = panels.x(number, v), self.problem.sites(corner)
        return np.union1d(own, sites[(sites > own.min(initial=np.inf)) & (sites < own.max(initial=-np.inf))])


def _gaps(state, surface, corner):
    """Places on all of the surface, ascending, the gaps of a corner there and their errors; between the
    sites of the obstacle as well, if less is there. At the edges of zones, which keep stretches apart, the
    gaps are nan.
    """

    def at(x):
        rise, noise = surface(corner, x)
        return np.array((x, problem.initial_gap(np.full(len(x), corner), x) + rise, noise))

    problem, edges = state.problem, np.ravel(state.zones[corner])
    places = surface.places(corner)
    known = at(places[~contains(state.zones[corner], places)])
    known = np.concatenate((known, np.array((edges, *np.full((2, len(edges)), np.nan)))), axis=1)
    for _ in range(4):
        x, gaps, noise = known = known[:, np.argsort(known[0], kind="stable")]
        least = _minima(gaps)
        # what a parabola through three neighbours, and twice that, may fall below the middle one
        least = least[2 * gaps[least] < np.maximum(gaps[least - 1], gaps[least + 1])]
        if not len(least):
            break
        more = np.linspace(x[least - 1], x[least + 1], 9).ravel()
        known = np.concatenate((known, at(np.setdiff1d(more, x))), axis=1)
    return known[:, np.argsort(known[0], kind="stable")]


def _minima(gaps):
    """Indices of the local minima of gaps that are no end of a stretch."""
    return np.flatnonzero((gaps[1:-1] < gaps[:-2]) & (gaps[1:-1] <= gaps[2:])) + 1


def _stands_out(gaps, i, noise):
    """Whether the gap at a minimum is less than it is further away on both sides of its stretch, by more than
    its error.
    """
    ends = np.flatnonzero(np.isnan(gaps))
    first, last = np.split(ends, [np.searchsorted(ends, i)])
    left, right = gaps[max(first, default=-1) + 1 : i], gaps[i + 1 : min(last, default=len(gaps))]
    return min(left.max(initial=-np.inf), right.max(initial=-np.inf)) > max(gaps[i], 0) + noise


def _overlaps(state, corner, x, gaps, noise, unit):
    """Intervals of x in which the gaps are negative; those within their errors are taken anew without
    interpolation.
    """
    doubtful, gaps = np.abs(gaps) < noise, gaps.copy()
    if doubtful.any():
        gaps[doubtful] = state.gaps(corner, x[doubtful])
    for first, last in runs(gaps < 0):
        before, after = max(first - 1, 0), min(last + 1, len(x) - 1)
        # next to an edge, where the gap begins with 0
        if doubtful[first : last + 1].all() and np.isnan(gaps[[before, after]]).any():
            continue
        left, right = float(x[before] + x[first]) / 2, float(x[last] + x[after]) / 2
        depth = -float(gaps[first : last + 1].min())
        if right > left:
            yield Violation(corner, left, right, depth, float(unit * depth / np.sqrt(right - left)))


def _tensile(state, size):
    """Intervals of the zones in which a corner is in tension: at the nodes, and near slope discontinuities.

    Where the slope of the obstacle falls the pressure has the logarithm of an infinite tension: panels that
    begin there are seen at distances down to rounding.
    """
    panels = state.panels
    valley = np.flatnonzero(panels.log_size < 0)
    near = (panels.e[valley, None] + panels.h[valley, None] * np.geomspace(1e-12, 0.1, 45)).ravel()
    for corner in state.problem.corners:
        places = np.union1d(state.x, near[np.repeat(panels.corner[valley] == corner, 45)])
        for left, right in state.zones[corner]:
            x = places[(left <= places) & (places <= right)]
            borders = np.concatenate(([left], (x[1:] + x[:-1]) / 2, [right]))
            lengths, p = np.diff(borders), state.pressure(corner, x)
            for first, last in runs(p < 0):
                own = slice(first, last + 1)
                worth = float(np.sqrt(lengths[own] @ p[own] ** 2) / size)
                yield Violation(corner, float(borders[first]), float(borders[last + 1]), 0.0, worth)


def _beyond(problem, corner, surface):
    """Whether the surface comes higher than the picture looks, somewhere out of its stretches."""
    if problem.picture is None:
        return False
    x, shift = surface.places(corner), problem.shift(corner)
    x = x[~contains(np.add(problem.picture.stretches, shift), x)]
    rise, noise = surface(corner, x)
    return bool(np.any(problem.picture.allowed(x - shift) + rise < -noise))
