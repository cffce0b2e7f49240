"""Candidates for contact on a half-space: samples of the initial gap that are below a bound on the approach.

f is the least initial gap of a block's corners. A place with f above the bound of
`microblock.halfspace.approach_bound` cannot touch. Where the obstacle has its lowest place, and how wide the
contact may be, is not known before:

1. Squares about (0, 0), each twice as wide as the one before, are sampled in rows and columns at random,
   until the lowest sample is well inside.
2. Local minima of the samples ("valleys") are followed down by a pattern search.
3. Flat punches about the lowest place bound the approach.
4. Squares about the lowest place are sampled, from the punch's disc outwards. If candidates lie farther
   out than an eighth of them, 2 to 4 are repeated.
5. Squares about all other valleys below the bound are sampled, and their valleys followed.
6. Squares of cells that are to be solved are sampled densely, with as much again on all sides.

With a window of the user's or a period, 1 and 4 are replaced by the window, and what is beside it.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple, NoReturn

import numpy as np
from scipy.ndimage import distance_transform_edt

from ..contact_solvers.fft_compliance import Grid
from ..errors import BOUNDED, BadArgument, require
from ..model.periodic import EQUAL
from ..model.types import Array, Integers
from .approach_bound import Gaps, mean_heights
from .squares import Squares

SMALLEST_SQUARE = 1e-6  # of ell: side of the first square
LARGEST_SQUARE = 1e4  # of ell, and of the disc's radius: side of the last one
SEARCH_LIMIT = 1e15  # of ell: squares beyond it are not sampled
COARSE_ROWS = 32  # rows and columns of squares
CONTACT_ROWS = 320  # of those about the contact
AT_ONCE = 2**15  # samples, which a cache holds: heights of a million in one array take twice as long
VALLEYS = 64  # of a square that are followed down; about which others are looked for
VALLEY_DISTANCE = 0.25  # of the disc's radius, between two valleys
ROWS_INSIDE = 4  # of a square to an edge of the obstacle: fewer do not show how far it is

RISES = "rise in every direction"
UNSEEN = (
    "have finite heights: none was seen, and what is narrower than a hundredth of its distance from "
    "(0, 0) may be missed; move it near there, which changes nothing else"
)
FALLS = "have a lowest place: without one it falls without end"


class SampledSquare(NamedTuple):
    """Samples f, array (n, n), at x1 of rows and x2 of columns, arrays (n,) (lengths)."""

    x1: Array
    x2: Array
    f: Array

    def samples(self, numbers: Integers) -> Array:
        """Returns x1, x2 and f of numbered samples, array (k, 3)."""
        rows, columns = np.divmod(numbers, len(self.x2))
        return np.column_stack((self.x1[rows], self.x2[columns], self.f[rows, columns]))


class CandidateSquares:
    """Samples of f, for a contact under a load or at an approach.

    Parameters
    ----------
    gaps : function
        Of (x1, x2), array (corners, ...) (lengths).
    ell : float
        Length of the blocks (length).
    punch_loads : (float, float)
        P/(2 E*) for all corners alike and for one (length^2).
    approach : float or None
        Instead of a load (length).
    obstacle : object
        Named in errors.
    window : Grid, optional
    repeats : bool
        Whether the window is a period.

    Attributes
    ----------
    samples, valleys : arrays (n, 3), (k, 3)
        x1, x2 and f (lengths).
    bound : float
        On the approach (length).
    radius : float
        Of the punch that gives the bound: about that of the contact (length).
    seen_width : float
        Diameter of a disc in which there is a sample, in the squares that were sampled last (length).

    Raises
    ------
    BadArgument
        If the obstacle is nowhere, or falls or could touch without end.
    """

    def __init__(
        self,
        gaps: Gaps,
        ell: float,
        punch_loads: tuple[float, float],
        approach: float | None,
        obstacle: object,
        window: Grid | None = None,
        repeats: bool = False,
    ) -> None:
        self.gaps = gaps
        self.ell = ell
        self.punch_loads = punch_loads
        self.approach = approach
        self.obstacle = obstacle
        self.repeats = repeats
        self.samples = np.empty((0, 3))
        self.valleys = np.empty((0, 3))
        self.bound = np.inf
        self.radius = 0.0
        self.seen_width = 0.0
        self._starts = np.empty((0, 4))  # of valleys: x1, x2, f and the distance of their samples
        self._random = np.random.default_rng(0)
        self._widest = 0.0  # square whose discs bound the approach
        self._inner_place: Array | None = None  # (x1, x2) farthest from the edges of an obstacle
        self._edge_distance = 0.0
        if window is None:
            self._sample_from_origin()
            self._sample_about_lowest()
            self._sample_about_valleys()
        else:
            self.radius = window.side / CONTACT_ROWS
            self._sample_window(window)

    @property
    def lowest(self) -> Array:
        """x1, x2 and f of the lowest sample, array (3,) (lengths)."""
        return np.asarray(self.samples[np.argmin(self.samples[:, 2])])

    @property
    def lowest_places(self) -> Array:
        """Places as low as the lowest one, array (k, 2) (lengths)."""
        f = self.lowest[2]
        return np.vstack((self.lowest, self.samples_below(f + EQUAL * (self.bound - f))))[:, :2]

    def samples_below(self, approach: float) -> Array:
        """Returns x1, x2 and f of the samples below an approach, array (m, 3) (lengths)."""
        return self.samples[self.samples[:, 2] < approach]

    def separate_valleys(self, approach: float) -> Array:
        """Returns (x1, x2) of separate valleys below an approach, array (k, 2) (lengths)."""
        low = self.valleys[np.argsort(self.valleys[:, 2])]
        low = low[low[:, 2] < approach, :2]
        separate = []
        while len(low):
            separate.append(low[0])
            low = low[np.abs(low - low[0]).max(axis=1) > VALLEY_DISTANCE * self.radius]
        return np.array(separate).reshape(-1, 2)

    def count_and_aspect(self, approach: float, window: Grid | None) -> tuple[int, float]:
        """Returns the number of separate valleys below an approach, and the length over the width of what is
        below; with a window of what is inside, and the side of the window over the width.
        """
        valleys = self.separate_valleys(approach)
        low = self.samples_below(approach)[:, :2]
        if window:
            valleys = valleys[window.distance_outside(*valleys.T) <= 0]
            low = low[window.distance_outside(*low.T) <= 0]
        count = max(len(valleys), 1)
        if len(low) < 9:
            return count, 1.0
        principal_axes = np.linalg.eigh(np.cov(low.T))[1]
        width, length = np.sort(np.ptp(low @ principal_axes, axis=0))
        return count, float((window.side if window else length) / width)

    def sample_squares(self, window: Grid | Squares) -> None:
        """Samples squares of cells, and as far again on all sides, and follows the valleys there (6)."""
        for square in self._squares_of_cells(window):
            self._keep(square)
        self._follow_valleys()

    def _squares_of_cells(self, window: Grid | Squares) -> Iterator[SampledSquare]:
        """Yields the samples of `sample_squares`."""
        width = 1 if self.repeats and isinstance(window, Grid) else 3
        rows = int(CONTACT_ROWS / np.sqrt(len(window.grids)))
        # a disc of this diameter holds two rows and two columns, and so the square of one sample
        self.seen_width = float(8**0.5 * np.max(window.side) / rows)
        for grid in window.grids:
            yield self._sampled(grid.middle, width * grid.side, width * rows)

    def _sample_from_origin(self, rows: int = COARSE_ROWS) -> None:
        """Samples squares about (0, 0), each twice as wide, until the lowest is well inside (1 to 3)."""
        side = SMALLEST_SQUARE * self.ell
        inside = False
        while not inside or side < LARGEST_SQUARE * max(self.ell, self.radius):
            self._sample_square(np.zeros(2), side, rows)  # 1
            side *= 2
            if len(self.samples) and side > LARGEST_SQUARE * self.ell:
                self._bound_approach(side)
                inside = 8 * np.hypot(*self.lowest[:2]) < side
            if side > SEARCH_LIMIT * self.ell:
                if rows == COARSE_ROWS and not len(self.samples):
                    self._sample_from_origin(CONTACT_ROWS)
                    return
                self._refuse(RISES if inside else FALLS if len(self.samples) else UNSEEN)
        self._follow_valleys()  # 2
        if side < 8 * np.hypot(*self.lowest[:2]):
            self._refuse(FALLS)
        self._bound_approach(side)  # 3

    def _sample_about_lowest(self) -> None:
        """Samples squares about the lowest place, until no candidate is far out (4)."""
        distance = 0.0
        side_sampled = 0.0
        while side_sampled <= 8 * distance:
            *middle, least = self.lowest
            side_sampled = LARGEST_SQUARE * max(self.ell, self.radius, distance)
            self._sample_square(middle, 8 * self.radius, CONTACT_ROWS)
            for side in self.radius * 2.0 ** np.arange(1, np.ceil(np.log2(side_sampled / self.radius))):
                self._sample_square(middle, side, COARSE_ROWS)
            self._follow_valleys()
            self._bound_approach(side_sampled)
            distance = np.abs(self.samples_below(self.bound)[:, :2] - middle).max(initial=0.0)
            if max(side_sampled, np.hypot(*self.lowest[:2])) > SEARCH_LIMIT * self.ell:
                falls = least - self.lowest[2] > EQUAL * (self.bound - least)
                touches = f"{RISES}: at a distance of {distance:.2g} it could still touch"
                self._refuse(FALLS if falls else touches)

    def _sample_about_valleys(self) -> None:
        """Samples about valleys farther than VALLEY_DISTANCE from all others, up to VALLEYS (5)."""
        places = self.lowest[None, :2]
        while len(places) <= VALLEYS:
            low = self.separate_valleys(self.bound)
            distances = np.abs(low[:, None] - places).max(axis=2).min(axis=1)
            new = low[distances > VALLEY_DISTANCE * self.radius][:VALLEYS]
            if not len(new):
                return
            for place in new:
                distance = np.abs(place - places[0]).max()
                for side in self.radius * 2.0 ** np.arange(np.ceil(np.log2(4 * distance / self.radius) + 1)):
                    self._sample_square(place, side, COARSE_ROWS)
            places = np.vstack((places, new))
            self._follow_valleys()

    def _sample_window(self, window: Grid) -> None:
        """Samples a window, and beside it, and bounds the approach; of the samples those below it are kept,
        far fewer than all.
        """
        widths = 2.0 ** np.arange(2, 1 if self.repeats else 7)
        squares = [self._sampled(window.middle, width * window.side, COARSE_ROWS) for width in widths]
        squares += self._squares_of_cells(window)
        self._follow_valleys()  # the lowest one has the lowest sample
        require(
            len(self.samples),
            "obstacle",
            self.obstacle,
            "must have a finite height within the window: no sample has one",
        )
        self._bound_approach(window.side)
        for square in squares:
            self._keep(square)

    def _sample_square(self, middle: Array | Sequence[float], side: float, count: int) -> None:
        """Adds the samples of a square below the bound."""
        self._keep(self._sampled(middle, side, count))

    def _keep(self, square: SampledSquare) -> None:
        """Adds those samples of a square that are below the bound."""
        self.samples = np.vstack((self.samples, square.samples(np.flatnonzero(square.f < self.bound))))

    def _sampled(self, middle: Array | Sequence[float], side: float, count: int) -> SampledSquare:
        """Returns samples of a square in `count` rows and columns:

        a. f at random places of rows and columns;
        b. the place farthest from where there is no obstacle is noted,
        c. and starts of valleys, which no neighbour undercuts.
        """
        in_rows = (np.arange(count) + self._random.random(count)) / count - 0.5  # a
        in_columns = (np.arange(count) + self._random.random(count)) / count - 0.5
        x1 = middle[0] + side * in_rows
        x2 = middle[1] + side * in_columns
        padded = np.full((count + 2, count + 2), np.inf)
        f = padded[1:-1, 1:-1]
        for rows in np.array_split(np.arange(count), 1 + count**2 // AT_ONCE):
            f[rows] = self._least_gap(*np.meshgrid(x1[rows], x2, indexing="ij"))
        square = SampledSquare(x1, x2, f)
        if np.isinf(f).any():
            self._note_inner_place(square, side / count)  # b
        starts = square.samples(_local_minima(padded))  # c
        starts = starts[np.argsort(starts[:, 2])[:VALLEYS]]
        self._starts = np.vstack((self._starts, np.insert(starts, 3, side / count, axis=1)))
        return square

    def _note_inner_place(self, square: SampledSquare, distance: float) -> None:
        """Keeps the place farthest from the edges of the obstacle, of samples at a mean distance (length)."""
        rows = distance_transform_edt(np.isfinite(square.f))
        farthest = np.atleast_1d(np.argmax(rows))
        edge_distance = rows.flat[farthest[0]] * distance
        if rows.flat[farthest[0]] >= ROWS_INSIDE and edge_distance > self._edge_distance:
            self._inner_place = square.samples(farthest)[0, :2]
            self._edge_distance = edge_distance

    def _follow_valleys(self) -> None:
        """Adds the valleys below the local minima of samples by a pattern search (2)."""
        places = self._starts[:, :3]
        step = self._starts[:, 3]
        directions = np.array([(a, b) for a in (-1, 0, 1) for b in (-1, 0, 1) if a or b])
        # shorter ones turn across a valley that falls along it
        directions = np.vstack((directions, directions / 4))
        for _ in range(200):  # at most, a quarter of the step before once a shorter one is lower
            if not np.any(step > 1e-5 * self.radius):
                break
            around = places[:, None, :2] + step[:, None, None] * directions
            f = self._least_gap(around[..., 0], around[..., 1])
            lowest = np.argmin(f, axis=1)
            best = np.arange(len(lowest)), lowest
            falls = f[best] < places[:, 2]
            places = np.where(falls[:, None], np.column_stack((around[best], f[best])), places)
            step = np.where(falls & (lowest < len(directions) // 2), step, step / 4)
        self.samples = np.vstack((self.samples, places))
        self.valleys = np.vstack((self.valleys, places))
        self._starts = self._starts[:0]

    def _bound_approach(self, widest: float) -> None:
        """Sets bound and radius by punches up to a width (length) about the lowest place and about the place
        farthest from all edges (3).
        """
        self._widest = widest
        least = float(self.lowest[2])
        middles = self.lowest[None, :2]
        if self._inner_place is not None:
            middles = np.vstack((middles, self._inner_place))
        heights = mean_heights(self.gaps, middles, widest, least)
        if self.approach is None:
            bounds = (discs.under_load(*self.punch_loads) for discs in heights)
        else:
            bounds = (discs.at_rise(self.approach - least) for discs in heights)
        rise, self.radius = next(filter(None, bounds))
        self.bound = least + rise

    def _least_gap(self, x1: Array, x2: Array) -> Array:
        """Returns f, array like x1 (length)."""
        with np.errstate(all="ignore"):  # far away heights overflow
            return np.asarray(self.gaps(x1, x2).min(axis=0))

    def _refuse(self, demand: str) -> NoReturn:
        """Raises BadArgument that says what an obstacle must do, or ell where it is too small for it."""
        least = LARGEST_SQUARE / SEARCH_LIMIT * self.radius
        words = f"must be at least {least:.2g} for a contact of radius {self.radius:.2g}"
        # a flat obstacle has the widest disc of all
        require(demand != RISES or self.ell > least or self.radius > self._widest / 8, "ell", self.ell, words)
        bounded = "" if demand == UNSEEN else f"; {BOUNDED}"
        raise BadArgument("obstacle", self.obstacle, f"must {demand}{bounded}")


def _local_minima(padded: Array) -> Integers:
    """Returns the numbers of the samples, within a frame of inf, array (n + 2, n + 2), that are below their
    neighbours; of a horizontal face one, or few.
    """
    width = len(padded)
    # few are below both neighbours in their row: these alone are compared with the other six
    middle = padded[1:-1, 1:-1]
    lower = (middle < padded[1:-1, :-2]) & (middle <= padded[1:-1, 2:])
    rows, columns = np.nonzero(lower)
    around = (rows + 1) * width + columns + 1
    values = padded.ravel()
    is_minimum = np.ones(len(rows), bool)
    for step in (-1, 0, 1):
        is_minimum &= values[around] < values[around - width + step]
        is_minimum &= values[around] <= values[around + width + step]
    return np.asarray(rows * (width - 2) + columns)[is_minimum]
