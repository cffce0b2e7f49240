"""Samples of the initial gaps as far as a contact can be, and a bound on the approach.

f is the least initial gap of a block's corners. By reciprocity with a flat punch on a disc A of radius a,

    approach <= P/(2 E* a) + <h>_A,

<h>_A the mean height under the punch's pressure. No place with f above the least over all discs can touch.
One corner of a block may carry all, which yields more, and the bound is doubled, as the energy of the least
forces is convex in P.

Samples lie in squares about the lowest place, each twice as wide, in rows and columns at random.
"""

from collections.abc import Callable, Sequence
from typing import NoReturn

import numpy as np
from scipy.ndimage import distance_transform_edt

from ..contact_solvers.fft_compliance import Grid
from ..errors import BOUNDED, BadArgument, require
from ..model.periodic import EQUAL
from ..model.quadrature import gauss_rule
from ..model.types import Array
from .squares import Squares

SMALLEST_SQUARE = 1e-6  # of ell: side of the first square
LARGEST_SQUARE = 1e4  # of ell, and of the disc's radius: side of the last one
SEARCH_LIMIT = 1e15  # of ell: squares beyond it are not looked at
COARSE_ROWS = 32  # rows and columns of squares
CONTACT_ROWS = 320  # of those about the contact
VALLEYS = 64  # of a square that are followed down; about which others are looked for
VALLEY_DISTANCE = 0.25  # of the disc's radius, between two valleys
ROWS_INSIDE = 4  # of a square to an edge of the obstacle: fewer do not show how far it is

RISES = "rise in every direction"
UNSEEN = (
    "have finite heights: none was seen, and what is narrower than a hundredth of its distance from "
    "(0, 0) may be missed; move it near there, which changes nothing else"
)
FALLS = "have a lowest place: without one it falls without end"


class CandidateSquares:
    """Samples of f, for a contact under a load or at an approach.

    Parameters
    ----------
    gaps : function
        Of (x1, x2), array (corners, ...) (lengths).
    ell : float
    needed : (float, float) or float
        P/(2 E*) for all corners alike and for one (length^2); or the approach (length).
    obstacle : object
    window : Grid, optional
    repeats : bool
        Whether the window is a period.

    Attributes
    ----------
    samples, valleys : arrays (n, 3), (k, 3)
        x1, x2 and f.
    bound, radius, seen : float
        Bound on the approach, radius of its disc, and diameter of a disc in which there is a sample, of those
        that were looked at last (lengths).

    Raises
    ------
    BadArgument
        If the obstacle is nowhere, or falls or could touch without end.
    """

    def __init__(
        self,
        gaps: Callable[[Array, Array], Array],
        ell: float,
        needed: tuple[float, float] | float,
        obstacle: object,
        window: Grid | None = None,
        repeats: bool = False,
    ) -> None:
        self.gaps = gaps
        self.ell = ell
        self.needed = needed
        self.obstacle = obstacle
        self.repeats = repeats
        self.samples = np.empty((0, 3))
        self.valleys = np.empty((0, 3))
        self.bound = np.inf
        self.radius = 0.0
        self.seen = 0.0
        self._starts = np.empty((0, 4))  # of valleys: x1, x2, f and the step of their samples
        self._random = np.random.default_rng(0)
        self._widest = 0.0  # square whose discs were looked at
        self._inner_place: tuple[float, float] | None = None  # farthest from the edges of an obstacle
        self._edge_distance = 0.0
        if window is None:
            self._search_everywhere()
            self._search_beside_valleys()
        else:
            self.radius = window.side / CONTACT_ROWS
            self._search_about(window)

    @property
    def lowest(self) -> Array:
        """x1, x2 and f of the lowest sample."""
        return np.asarray(self.samples[np.argmin(self.samples[:, 2])])

    @property
    def deepest(self) -> Array:
        """Places as low as the lowest one, array (k, 2)."""
        f = self.lowest[2]
        return np.vstack((self.lowest, self.low(f + EQUAL * (self.bound - f))))[:, :2]

    def low(self, approach: float) -> Array:
        """Returns the samples below an approach, array (m, 3)."""
        return self.samples[self.samples[:, 2] < approach]

    def separate(self, approach: float) -> Array:
        """Returns separate valleys below an approach, array (k, 2)."""
        low = self.valleys[np.argsort(self.valleys[:, 2])]
        low = low[low[:, 2] < approach, :2]
        separate = []
        while len(low):
            separate.append(low[0])
            low = low[np.abs(low - low[0]).max(axis=1) > VALLEY_DISTANCE * self.radius]
        return np.array(separate).reshape(-1, 2)

    def spread(self, approach: float, window: Grid | None) -> tuple[int, float]:
        """Returns the number of separate valleys below an approach, and the length of what is below, or the
        side of the window, over its width; inside the window if there is one.
        """
        valleys = self.separate(approach)
        low = self.low(approach)[:, :2]
        if window:
            valleys = valleys[window.distance_outside(*valleys.T) <= 0]
            low = low[window.distance_outside(*low.T) <= 0]
        count = max(len(valleys), 1)
        if len(low) < 9:
            return count, 1.0
        width, length = np.sort(np.ptp(low @ np.linalg.eigh(np.cov(low.T))[1], axis=0))
        return count, float((window.side if window else length) / width)

    def sample_square(self, middle: Array | Sequence[float], side: float, count: int) -> None:
        """Adds samples of a square in `count` rows and columns:

        1. f at random places of rows and columns;
        2. the place farthest from where there is no obstacle;
        3. samples below the bound, and starts of valleys, which no neighbour undercuts.
        """
        rows = (np.arange(count) + self._random.random(count)) / count - 0.5
        columns = (np.arange(count) + self._random.random(count)) / count - 0.5
        x1, x2 = np.meshgrid(middle[0] + side * rows, middle[1] + side * columns, indexing="ij")
        f = self._least_gap(x1, x2)  # 1
        if np.isinf(f).any():
            self._note_inner_place(f, x1, x2, side / count)  # 2
        below = f < self.bound  # 3
        self.samples = np.vstack((self.samples, np.column_stack((x1[below], x2[below], f[below]))))
        padded = np.pad(f, 1, constant_values=np.inf)
        undercut_by_none = np.isfinite(f)
        for number in np.delete(np.arange(9), 4):  # of a level face one sample, or few
            neighbour = padded[number // 3 :, number % 3 :][:count, :count]
            undercut_by_none &= (f < neighbour) if number < 4 else (f <= neighbour)
        starts = np.column_stack((x1[undercut_by_none], x2[undercut_by_none], f[undercut_by_none]))
        starts = starts[np.argsort(starts[:, 2])[:VALLEYS]]
        self._starts = np.vstack((self._starts, np.insert(starts, 3, side / count, axis=1)))

    def _note_inner_place(self, f: Array, x1: Array, x2: Array, step: float) -> None:
        """Keeps the place farthest from the edges of the obstacle."""
        rows = distance_transform_edt(np.isfinite(f))
        farthest = np.unravel_index(np.argmax(rows), rows.shape)
        edge_distance = rows[farthest] * step
        if rows[farthest] >= ROWS_INSIDE and edge_distance > self._edge_distance:
            self._inner_place = (x1[farthest], x2[farthest])
            self._edge_distance = edge_distance

    def look_about(self, window: Grid | Squares) -> None:
        """Looks at squares, and as far again on all sides, and follows what is low."""
        times = 1 if self.repeats and isinstance(window, Grid) else 3
        rows = int(CONTACT_ROWS / np.sqrt(len(window.grids)))
        for grid in window.grids:
            self.sample_square(grid.middle, times * grid.side, times * rows)
        self._follow_valleys()
        # in a disc of so many rows there is a sample
        self.seen = float(8**0.5 * np.max(window.side) / rows)

    def _follow_valleys(self) -> None:
        """Adds the valleys below samples that no neighbour undercuts."""
        places = self._starts[:, :3]
        step = self._starts[:, 3]
        rows = np.arange(len(self._starts))
        directions = np.array([(a, b) for a in (-1, 0, 1) for b in (-1, 0, 1) if a or b])
        # shorter ones turn across a valley that falls along it
        directions = np.vstack((directions, directions / 4))
        for _ in range(200):  # at most, a quarter of the one before once less is nearer
            if not np.any(step > 1e-5 * self.radius):
                break
            around = places[:, None, :2] + step[:, None, None] * directions
            f = self._least_gap(around[..., 0], around[..., 1])
            lowest = np.argmin(f, axis=1)
            best = rows, lowest
            falls = f[best] < places[:, 2]
            places = np.where(falls[:, None], np.column_stack((around[best], f[best])), places)
            step = np.where(falls & (lowest < len(directions) // 2), step, step / 4)
        self.samples = np.vstack((self.samples, places))
        self.valleys = np.vstack((self.valleys, places))
        self._starts = self._starts[:0]

    def _least_gap(self, x1: Array, x2: Array) -> Array:
        """Returns f, array like x1."""
        with np.errstate(all="ignore"):  # far away heights overflow
            return np.asarray(self.gaps(x1, x2).min(axis=0))

    def _search_about(self, window: Grid) -> None:
        """Looks at a window, and beside it, and bounds the approach."""
        for times in 2.0 ** np.arange(2, 1 if self.repeats else 7):
            self.sample_square(window.middle, times * window.side, COARSE_ROWS)
        self.look_about(window)
        require(
            len(self.samples),
            "obstacle",
            self.obstacle,
            "must have a finite height within the window: no sample has one",
        )
        self._bound_approach(window.side)

    def _search_everywhere(self, rows: int = COARSE_ROWS) -> None:
        """Looks at squares about (0, 0), each twice as wide, until the lowest place is well inside, then
        about that place.
        """
        side = SMALLEST_SQUARE * self.ell
        inside = False
        while not inside or side < LARGEST_SQUARE * max(self.ell, self.radius):
            self.sample_square(np.zeros(2), side, rows)
            side *= 2
            if len(self.samples) and side > LARGEST_SQUARE * self.ell:
                self._bound_approach(side)
                inside = 8 * np.hypot(*self.lowest[:2]) < side
            if side > SEARCH_LIMIT * self.ell:
                if rows == COARSE_ROWS and not len(self.samples):
                    self._search_everywhere(CONTACT_ROWS)
                    return
                self._refuse(RISES if inside else FALLS if len(self.samples) else UNSEEN)
        self._follow_valleys()
        if side < 8 * np.hypot(*self.lowest[:2]):
            self._refuse(FALLS)
        self._bound_approach(side)
        self._search_about_lowest()

    def _search_about_lowest(self) -> None:
        """Looks about what is lower still, and farther while it could touch there."""
        distance = 0.0
        reach = 0.0
        while reach <= 8 * distance:
            *middle, least = self.lowest
            reach = LARGEST_SQUARE * max(self.ell, self.radius, distance)
            self.sample_square(middle, 8 * self.radius, CONTACT_ROWS)
            for side in self.radius * 2.0 ** np.arange(1, np.ceil(np.log2(reach / self.radius))):
                self.sample_square(middle, side, COARSE_ROWS)
            self._follow_valleys()
            self._bound_approach(reach)
            distance = np.abs(self.low(self.bound)[:, :2] - middle).max(initial=0.0)
            if max(reach, np.hypot(*self.lowest[:2])) > SEARCH_LIMIT * self.ell:
                falls = least - self.lowest[2] > EQUAL * (self.bound - least)
                touches = f"{RISES}: at a distance of {distance:.2g} it could still touch"
                self._refuse(FALLS if falls else touches)

    def _refuse(self, what: str) -> NoReturn:
        least = LARGEST_SQUARE / SEARCH_LIMIT * self.radius
        words = f"must be at least {least:.2g} for a contact of radius {self.radius:.2g}"
        # a flat obstacle has the widest disc of all that were looked at
        require(what != RISES or self.ell > least or self.radius > self._widest / 8, "ell", self.ell, words)
        bounded = "" if what == UNSEEN else f"; {BOUNDED}"
        raise BadArgument("obstacle", self.obstacle, f"must {what}{bounded}")

    def _search_beside_valleys(self) -> None:
        """Looks about valleys that are farther than VALLEY_DISTANCE from all before, up to VALLEYS."""
        places = self.lowest[None, :2]
        while len(places) <= VALLEYS:
            low = self.separate(self.bound)
            distances = np.abs(low[:, None] - places).max(axis=2).min(axis=1)
            new = low[distances > VALLEY_DISTANCE * self.radius][:VALLEYS]
            if not len(new):
                return
            for place in new:
                distance = np.abs(place - places[0]).max()
                for side in self.radius * 2.0 ** np.arange(np.ceil(np.log2(4 * distance / self.radius) + 1)):
                    self.sample_square(place, side, COARSE_ROWS)
            places = np.vstack((places, new))
            self._follow_valleys()

    def _bound_approach(self, widest: float) -> None:
        """Sets bound and radius by discs up to a width about the lowest place, which may be at an edge of the
        obstacle, and about the place farthest from all edges.
        """
        self._widest = widest
        lowest = self.lowest
        radii = widest / 2 * 2.0 ** (-np.arange(CONTACT_ROWS) / 2)
        middles = [lowest[:2]] if self._inner_place is None else [lowest[:2], np.array(self._inner_place)]
        z, weights = gauss_rule(8)
        angles = 2 * np.pi * (np.arange(16) + 0.5) / 16
        r = np.sqrt(1 - z**2)
        shares = np.repeat(weights, len(angles)) / len(angles)
        x1, x2 = (
            np.array(middles)[:, axis, None, None] + radii[:, None] * np.outer(r, direction(angles)).ravel()
            for axis, direction in enumerate((np.cos, np.sin))
        )
        with np.errstate(all="ignore"):
            means = self.gaps(x1, x2) @ shares - lowest[2]
        corners = len(means)
        of_all, of_one = (mean.min(axis=0) for mean in (means.mean(axis=0), means.min(axis=0)))
        if isinstance(self.needed, tuple):
            all_alike, one_alone = self.needed
            sums = np.minimum(all_alike / radii + of_all, one_alone / radii + of_one)
            best = int(np.argmin(sums))
            above = float(sums[best]) * (1 if corners == 1 else 2)
        else:
            above = self.needed - float(lowest[2])
            enough = np.flatnonzero(of_one < above)
            best = max(int(enough[0]) - 1, 0) if len(enough) else CONTACT_ROWS - 1
        self.radius = float(radii[best])
        self.bound = float(lowest[2] + above)
