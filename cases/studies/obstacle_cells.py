"""What verifies contacts under any obstacle: graded cells of constant pressure on all of the window, one
complementarity problem.

It knows nothing of the solver's zones, and shares with it the symbol's formula alone: kernels are those of
`cases.studies.reference_kernels`, integrated once.

Unknowns    pressures of all corners on cells; gaps are looked at in the cells' centres.
Solution    primal-dual active sets; if these do not settle, of the wrong corners the worst ones alone are
            exchanged.
Cells       at first wherever the obstacle is low enough to touch, graded towards the features that the sample
            names; then near the zones, graded towards every edge of either corner.
Outside     after each solution gaps are looked at on the whole window, at a hundred thousand abscissae and
            about each named feature, and beyond it on a geometric scale; where one is negative there are
            cells next time.
Error       of the change when all cells are halved: at least that, more where changes fall by less than two.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from scipy.interpolate import CubicSpline

import microblock as mb
from microblock.errors import NotConverged
from microblock.model.zones import contact_zones, distance, runs

from . import reference_kernels
from .reference_panels import Problem, gauss

# distances over ell between which integrals are tabulated; the kernels' table ends there
NEAREST, FARTHEST = 1e-15, 1.6e4
STEP, DEGREE = 0.06, 5  # pieces of the table in log x, and their degree: 1e-12
SETS = 60  # active sets that are tried
# of them without fewer wrong corners, before the worst alone are exchanged
PATIENCE = 12
SAMPLES = 100_000  # abscissae on the window at which gaps are looked at
# of the scale of the gaps: overlap outside the cells that calls for some there
OVERLAP = 1e-6
ROUNDS = 14  # of grids, till there is none
STEEP = 0.12  # growth of cells away from edges and features
FACTORS = 4.0, 2.2, 1.2, 0.66, 0.36, 0.21  # of growth and sizes, grid by grid
MOST = 1700  # cells of the finest grid
ENOUGH = 1e-4  # error at which no finer grid is asked for
SLOWEST, FASTEST = 1.4, 3.0  # ratio of successive changes that is believed; the second order has 3.3


@dataclass(frozen=True)
class Window:
    """What the sample knows of an obstacle: where it could touch, its smallest scale, its features [(x,
    width)], 0 for kinks.
    """

    left: float
    right: float
    scale: float
    features: tuple = ()


class Integrals:
    """Integrals from 0 to x of the kernels of a solid over c: array (kernels, ...), lengths over ell."""

    def __init__(self, nu, beta, curvature, names):
        solid = mb.Cosserat(E=2 * (1 + nu), nu=nu, ell=1.0, beta=beta, curvature=curvature)
        self.names = names
        self._odd = np.array([name in reference_kernels.ODD for name in names])
        self._start = np.log(NEAREST)
        pieces = int(np.ceil((np.log(FARTHEST) - self._start) / STEP))
        t = np.cos(np.pi * (np.arange(DEGREE + 1) + 0.5) / (DEGREE + 1))
        x = np.exp(self._start + STEP * (np.arange(pieces)[:, None] + (t + 1) / 2))
        points, weights = gauss(24)
        places = x[..., None] * points**8  # flattens the logarithm
        rows = np.linalg.inv(np.vander(t, increasing=True)).T
        self._tables = []
        for name, odd in zip(names, self._odd):
            parts = ({}, {name: 1.0}) if odd else ({name: 1.0}, {})
            mean = reference_kernels.table(solid, *parts)(places) @ (8 * points**7 * weights)
            self._tables.append(np.ascontiguousarray((mean @ rows).T))

    def __call__(self, x):
        size = np.clip(np.abs(x), NEAREST, FARTHEST * (1 - 1e-9))
        place = (np.log(size) - self._start) / STEP
        piece = np.minimum(place.astype(np.intp), self._tables[0].shape[1] - 1)
        t = 2 * (place - piece) - 1
        found = np.empty((len(self.names), *x.shape))
        for value, table, odd in zip(found, self._tables, self._odd):
            value[...] = table[DEGREE].take(piece)
            for row in table[DEGREE - 1 :: -1]:
                value *= t
                value += row.take(piece)
            value *= np.abs(x) if odd else x  # of an odd kernel even, and the other way round
        return found


@lru_cache(maxsize=2)
def integrals(nu, beta, curvature, clamped):
    return Integrals(nu, beta, curvature, ("clamped", "reaction") if clamped else ("U", "V", "W"))


class Setting:
    """One contact problem at one load: gaps, levers and responses of cells."""

    def __init__(self, contact, load, window):
        self.problem, self.window, self.load = Problem(contact, load), window, load
        solid = contact.solid
        self.ell, self.E_star = solid.ell, solid.E_star
        self.levers = np.array(self.problem.levers)
        self.table = integrals(solid.nu, solid.beta, solid.curvature, self.problem.clamped)

    @property
    def corners(self):
        return range(len(self.levers))

    def heights(self, x):
        """Initial gaps of all corners, array (corners, n); inf where there is no obstacle."""
        return np.array([self.problem.gap(corner, x) for corner in self.corners])

    def responses(self, x, left, right):
        """Kernels integrated over cells at x: array (kernels, targets, cells), lengths."""
        ends, which = np.unique(np.concatenate((left, right)), return_inverse=True)
        values = self.table((x[:, None] - ends) / self.ell)
        return self.ell * (values[..., which[: len(left)]] - values[..., which[len(left) :]])

    def flexibility(self, x, left, right):
        """Gaps of all corners at x from the pressures of all corners: array (corners targets, corners
        cells).
        """
        found, c = self.responses(x, left, right), self.problem.c
        if self.problem.clamped or len(self.levers) == 1:
            return c * found[0]
        U, V, W = found
        return c * np.block([[U + t * s * W + (t - s) * V for s in self.levers] for t in self.levers])

    @cached_property
    def size(self):
        """Of gaps: what the load makes of the surface at most, a point load seen at the smallest of
        scales.
        """
        span = (self.window.right - self.window.left) / min(
            [self.window.scale, *(w for _, w in self.window.features if w)]
        )
        return 2 * self.load / (np.pi * self.E_star) * (np.log(span) + 4)

    @cached_property
    def places(self):
        """[(contact point, width)] of the features, at each corner that may meet them."""
        return [(x - shift, width) for x, width in self.window.features for shift in self.problem.shifts]

    @cached_property
    def looked(self):
        """Abscissae at which gaps are looked at, and the initial gaps there."""
        left, right = self.window.left - self.ell, self.window.right + self.ell
        around = np.concatenate(([0.0], np.geomspace(1e-4, 10, 60), -np.geomspace(1e-4, 10, 60)))
        far = min((right - left) * 100, FARTHEST * self.ell / 2)
        outside = (right - left) / 100 * np.geomspace(1, max(far / (right - left) * 100, 2), 400)
        x = np.concatenate(
            [
                np.linspace(left, right, SAMPLES),
                left - outside,
                right + outside,
                *(place + max(width, 1e-3 * self.ell) * around for place, width in self.places),
            ]
        )
        x = np.unique(x)
        return x, self.heights(x)


@dataclass(frozen=True)
class Cells:
    """A solved state on cells: pressures (corners, n), approach."""

    setting: Setting
    left: np.ndarray
    right: np.ndarray
    pressures: np.ndarray
    approach: float

    @cached_property
    def x(self):
        return (self.left + self.right) / 2

    @property
    def weights(self):
        return self.right - self.left

    @cached_property
    def micromoment(self):
        """M over ell at the centres."""
        return self.moment_at(self.x)

    def moment_at(self, x):
        """M over ell at x, array (n,): of polygons, or the reaction to psi = 0."""
        if self.setting.problem.clamped:
            return (
                -self.setting.responses(x, self.left, self.right)[1]
                @ self.pressures[0]
                / (2 * self.setting.ell)
            )
        return self.setting.levers @ [self.pressure(corner, x) for corner in self.setting.corners] / 2

    def pressure(self, corner, x):
        """Of a corner at x, as a polygon through the centres."""
        return np.interp(x, self.x, self.pressures[corner], left=0.0, right=0.0)

    def gaps(self, x, heights):
        """Gaps of all corners (corners, n) at x, where the initial gaps are `heights`."""
        loaded = self.pressures.any(axis=0)
        lowered = np.concatenate(
            [
                self.setting.flexibility(part, self.left[loaded], self.right[loaded]).reshape(
                    len(heights), len(part), -1
                )
                @ self.pressures[:, loaded].ravel()
                for part in np.array_split(x, 1 + len(x) * loaded.sum() // 10**6)
            ],
            axis=1,
        )
        return heights - self.approach + lowered

    @cached_property
    def zones(self):
        """{corner: [(left, right), ...]} of the cells with pressure."""
        apart = np.flatnonzero(self.left[1:] > self.right[:-1]) + 1
        found = {}
        for corner, own in enumerate(self.pressures):
            found[corner] = [
                (float(self.left[block[first]]), float(self.right[block[last]]))
                for block in np.split(np.arange(len(own)), apart)
                for first, last in runs(own[block] > 0)
            ]
        return found

    @property
    def named_zones(self):
        """As those of the library's states."""
        return contact_zones(self.zones, self.setting.problem.law.corners)

    def share(self, interval):
        """Of the load within an interval."""
        covered = np.clip(np.minimum(self.right, interval[1]) - np.maximum(self.left, interval[0]), 0, None)
        return float(covered @ self.pressures.sum(axis=0) / self.setting.load)


def grid(intervals, sizes, breaks=()):
    """Cells (left, right) on intervals; `sizes(x)` is about the size of one that begins at x, 0 < x."""
    left, right = [], []
    for a, b in intervals:
        stops = [a, *sorted(x for x in breaks if a < x < b), b]
        for start, stop in zip(stops, stops[1:]):
            x = start
            while x < stop:
                step = sizes(x)
                step = min(step, max(sizes(x + step), step / 4))
                following = stop if x + 1.4 * step >= stop else x + step
                left.append(x)
                right.append(following)
                x = following
    return np.array(left), np.array(right)


def sizes_from(places, largest):
    """Sizes of cells: of `places` [(x, size, growth)] there, more by the growth times the distance, no larger
    than one.
    """
    if not places:
        return lambda x: largest
    where, least, growth = map(np.array, zip(*places))
    return lambda x: min(largest, float(np.min(least + growth * np.abs(where - x))))


def solved(setting, left, right, start):
    """Cells under (26): pressures of the primal-dual active set that begins with the corners `start`, boolean
    (corners, n).
    """
    x, count = (left + right) / 2, len(setting.levers)
    heights = setting.heights(x).ravel()
    H, weights = setting.flexibility(x, left, right), np.tile(right - left, count)
    closed, fewest, left_over = start.ravel() & np.isfinite(heights), np.inf, PATIENCE
    for _ in range(SETS):
        own = np.flatnonzero(closed)
        system = np.empty((len(own) + 1, len(own) + 1))
        system[:-1, :-1], system[:-1, -1] = H[np.ix_(own, own)], -1.0
        system[-1, :-1], system[-1, -1] = weights[own], 0.0
        answer = np.linalg.solve(system, np.append(-heights[own], setting.load))
        p = np.zeros(len(heights))
        p[own], approach = answer[:-1], answer[-1]
        gaps = heights - approach + H[:, own] @ answer[:-1]
        wrong = np.where(closed, -p / np.abs(p).max(), -gaps / setting.size)
        chosen = np.where(closed, p < 0, gaps < -1e-13 * setting.size)
        number = np.count_nonzero(chosen)
        if not number:
            return Cells(setting, left, right, p.reshape(count, -1), float(approach))
        left_over = PATIENCE if number < fewest else left_over - 1
        fewest = min(fewest, number)
        if left_over < 0:
            worst = np.sort(wrong[chosen])[-max(1, number // 4)]
            chosen &= wrong >= worst
        closed = closed ^ chosen
        if not closed.any():
            closed[np.argmin(heights)] = True
    raise NotConverged(f"judge: active set of {len(heights)} corners does not settle, {fewest} wrong at best")


def _merged(intervals, least=0.0):
    found = []
    for a, b in sorted(intervals):
        if found and a <= found[-1][1] + least:
            found[-1][1] = max(found[-1][1], b)
        else:
            found.append([a, b])
    return [tuple(pair) for pair in found]


def first(setting):
    """Cells wherever the obstacle is low enough, features graded; the first solution."""
    x, heights = setting.looked
    window = setting.window
    low = np.min(heights, axis=0) < heights.min() + setting.size
    inside = (x >= window.left - setting.ell) & (x <= window.right + setting.ell)
    step = (window.right - window.left) / SAMPLES
    intervals = _merged([(x[i] - 2 * step, x[j] + 2 * step) for i, j in runs(low & inside)], 4 * step)
    span = sum(b - a for a, b in intervals)
    largest = max(min(span / 300, setting.ell, window.scale / 4), span / 1200)
    places = [(place, max(width / 3, 1e-3 * largest), 0.4) for place, width in setting.places]
    left, right = grid(intervals, sizes_from(places, largest))
    centre = (left + right) / 2
    start = setting.heights(centre)
    return solved(setting, left, right, start < start.min() + 0.05 * setting.size)


def overlooked(state, kept):
    """Intervals outside the kept ones in which a gap is negative."""
    setting = state.setting
    x, heights = setting.looked
    edges = [edge for pairs in state.zones.values() for pair in pairs for edge in pair]
    widths = [
        max(1e-7 * setting.ell, 3e-3 * (b - a))
        for pairs in state.zones.values()
        for a, b in pairs
        for _ in (a, b)
    ]
    free = _outside(kept, x[0], x[-1])
    found = []
    for a, b in free:
        own = (x >= a) & (x <= b)
        if not own.any():
            continue
        nodes = np.append(
            grid([(a, b)], sizes_from([(*pair, 0.1) for pair in zip(edges, widths)], np.inf))[0], b
        )
        nodes = np.linspace(a, b, 6) if len(nodes) < 6 else nodes
        lowered = state.gaps(nodes, np.zeros((len(heights), len(nodes))))
        gaps = np.min(heights[:, own] + CubicSpline(nodes, lowered, axis=1)(x[own]), axis=0)
        place = x[own]
        for i, j in runs(gaps < -OVERLAP * setting.size):
            found.append((place[max(i - 1, 0)], place[min(j + 1, len(place) - 1)]))
    return found


def _outside(kept, left, right):
    ends = [left, *(edge for pair in kept for edge in pair), right]
    return [(a, b) for a, b in zip(ends[::2], ends[1::2]) if a < b]


def regrid(state, factor, extra=()):
    """Cells near the zones of a state, and on `extra` intervals: (left, right), closed flags to begin with,
    kept intervals.

    Between an edge and where the cells are as large as they may be they grow geometrically. A square root
    leaves growth^2/32 on cells that grow so, and the size of the first one over the width; a logarithm
    growth^2/8 and the root of that size.
    """
    setting, growth = state.setting, STEEP * factor
    pairs = [pair for own in state.zones.values() for pair in own]
    near = np.interp([(a + b) / 2 for a, b in pairs], state.x, state.weights)
    margins = [max(3 * cell, 0.06 * (b - a)) for (a, b), cell in zip(pairs, near)]
    kept = _merged(
        [*((a - m, b + m) for (a, b), m in zip(pairs, margins)), *((2 * a - b, 2 * b - a) for a, b in extra)]
    )
    places = []
    for a, b in pairs:
        own = growth * min(3.0, _weight(state, a, b) ** -0.5)
        places += [(edge, max(own**2 / 30 * (b - a), 1e-9 * setting.ell), own) for edge in (a, b)]
    largest = min(setting.window.scale / 8 * factor, max(b - a for a, b in kept) / 25 * factor)
    kinks = [x for x, width in setting.places if width == 0 and any(a < x < b for a, b in kept)]
    places += [
        (x, max(growth**4 / 64 * min(setting.ell, setting.window.scale), 1e-10 * setting.ell), growth)
        for x in kinks
    ]
    places += [
        (x, width / 6 * factor, growth)
        for x, width in setting.places
        if width and any(2 * a - b < x < 2 * b - a for a, b in kept)
    ]
    places += [((a + b) / 2, (b - a) / 12, growth) for a, b in extra]
    left, right = grid(kept, sizes_from(places, largest), kinks)
    x = (left + right) / 2
    closed = np.array(
        [
            np.any([(a < x) & (x < b) for a, b in [*state.zones[corner], *extra]] or [x != x], axis=0)
            for corner in setting.corners
        ]
    )
    return left, right, closed, kept


def _weight(state, a, b):
    """Share of an interval in the norm of the pressure."""
    p, own = state.pressures.sum(axis=0), (a <= state.x) & (state.x <= b)
    return np.sqrt(max(state.weights[own] @ p[own] ** 2 / (state.weights @ p**2), 1e-8))


def judged(contact, load, window, enough=ENOUGH, most=MOST):
    """(Cells, their error) of a contact problem at a load, max(|dp|, |dM|/ell)/|p| in L2.

    Raises
    ------
    NotConverged
        If there is none, or there are too many cells.
    """
    setting = Setting(contact, load, window)
    state, changes, number = first(setting), [], 0
    kept = _merged(list(zip(state.left, state.right)))
    for _ in range(ROUNDS):
        extra = overlooked(state, kept)
        if not extra and (number == len(FACTORS) or (len(changes) > 1 and _error(changes) < enough)):
            return state, _error(changes)
        number -= bool(extra and number)
        left, right, closed, around = regrid(state, FACTORS[number], extra)
        if len(left) > most:
            if changes and not extra:
                return state, _error(changes)
            raise NotConverged(f"judge: {len(left)} cells")
        finer = solved(setting, left, right, closed)
        if number:
            changes = [] if extra else [*changes, difference(finer, state)]
        state, kept, number = finer, around, number + 1
    raise NotConverged("judge: gaps outside the cells still negative")


def _error(changes):
    before, last = changes[-2:] if len(changes) > 1 else (2 * changes[-1], changes[-1])
    last = max(last, before / 4)  # more is luck
    return last / (min(max(before / last, SLOWEST), FASTEST) - 1)


def difference(finer, coarser):
    """max(|dp|, |dM|/ell)/|p| in L2, both as polygons, on the finer cells."""
    p = finer.pressures.sum(axis=0)
    other = sum(coarser.pressure(corner, finer.x) for corner in finer.setting.corners)
    return distance(finer.weights, p - other, finer.micromoment - coarser.moment_at(finer.x), p)
