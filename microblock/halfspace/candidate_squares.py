"""Samples of the initial gaps as far as a contact can be, and a bound on the approach.

f is the least initial gap of a block's corners. By reciprocity with a flat punch on a disc A of radius a,

    approach <= P/(2 E* a) + <h>_A,

<h>_A the mean height under the punch's pressure. No place with f above the least over all discs can touch.
One corner of a block may carry all, which yields more, and the bound is doubled, as the energy of the least
forces is convex in P.

Samples lie in squares about the lowest place, each twice as wide, in rows and columns at random.
"""

import numpy as np
from scipy.ndimage import distance_transform_edt

from ..errors import BOUNDED, BadArgument, require
from ..model.periodic import EQUAL
from ..model.quadrature import gauss_rule

NEAREST, FARTHEST = 1e-6, 1e4  # of ell, and of the disc's radius: sides of squares
WIDEST = 1e15  # of ell: squares beyond it are not looked at
COARSE, FINE = 32, 320  # rows and columns of squares; of those about the contact
VALLEYS = 64  # of a square that are followed down; about which others are looked for
SAME = 0.25  # of the disc's radius, between two valleys
INSIDE = 4  # rows and columns of a square to an edge of the obstacle: fewer do not show how far it is

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

    def __init__(self, gaps, ell, needed, obstacle, window=None, repeats=False):
        self.gaps, self.ell, self.needed, self.obstacle, self.repeats = gaps, ell, needed, obstacle, repeats
        self.samples, self.valleys, self._starts = np.empty((0, 3)), np.empty((0, 3)), np.empty((0, 4))
        self.bound, self.radius = np.inf, window.side / FINE if window else 0.0
        self._draw, self._widest = np.random.default_rng(0), 0.0
        self._middle, self._half_width = None, 0.0  # of an obstacle with edges
        if window is not None:
            for times in 2.0 ** np.arange(2, 1 if repeats else 7):
                self.look(window.middle, times * window.side, COARSE)
            self.look_about(window)
            require(
                len(self.samples),
                "obstacle",
                obstacle,
                "must have a finite height within the window: no sample has one",
            )
            self._bound(window.side)
        else:
            self._everywhere()
            self._beside_valleys()

    @property
    def lowest(self):
        """x1, x2 and f of the lowest sample."""
        return self.samples[np.argmin(self.samples[:, 2])]

    @property
    def deepest(self):
        """Places as low as the lowest one, array (k, 2)."""
        least = self.lowest[2]
        return np.vstack((self.lowest, self.low(least + EQUAL * (self.bound - least))))[:, :2]

    def low(self, approach):
        """Returns the samples below an approach, array (m, 3)."""
        return self.samples[self.samples[:, 2] < approach]

    def separate(self, approach):
        """Returns separate valleys below an approach, array (k, 2)."""
        low, found = self.valleys[np.argsort(self.valleys[:, 2])], []
        low = low[low[:, 2] < approach, :2]
        while len(low):
            found.append(low[0])
            low = low[np.abs(low - low[0]).max(axis=1) > SAME * self.radius]
        return np.array(found).reshape(-1, 2)

    def spread(self, approach, window):
        """Returns the number of separate valleys below an approach, and the length of what is below, or the
        side of the window, over its width; inside the window if there is one.
        """
        found, low = self.separate(approach), self.low(approach)[:, :2]
        if window:
            found, low = (own[window.beyond(*own.T) <= 0] for own in (found, low))
        if len(low) < 9:
            return max(len(found), 1), 1.0
        width, length = np.sort(np.ptp(low @ np.linalg.eigh(np.cov(low.T))[1], axis=0))
        return max(len(found), 1), (window.side if window else length) / width

    def look(self, middle, side, count):
        """Adds samples of a square."""
        rows, columns = ((np.arange(count) + self._draw.random(count)) / count - 0.5 for _ in range(2))
        x1, x2 = np.meshgrid(middle[0] + side * rows, middle[1] + side * columns, indexing="ij")
        f = self._least(x1, x2)
        depths = distance_transform_edt(np.isfinite(f))
        deepest = np.unravel_index(np.argmax(depths), depths.shape)
        half_width = depths[deepest] * side / count
        if np.isinf(f).any() and depths[deepest] >= INSIDE and half_width > self._half_width:
            self._middle, self._half_width = (x1[deepest], x2[deepest]), half_width
        padded, lower = np.pad(f, 1, constant_values=np.inf), np.isfinite(f)
        for number in np.delete(np.arange(9), 4):  # of a level face one sample, or few
            other = padded[number // 3 :, number % 3 :][:count, :count]
            lower &= (f < other) if number < 4 else (f <= other)
        low, starts = (np.column_stack((x1[there], x2[there], f[there])) for there in (f < self.bound, lower))
        starts = starts[np.argsort(starts[:, 2])[:VALLEYS]]
        self.samples = np.vstack((self.samples, low))
        self._starts = np.vstack((self._starts, np.insert(starts, 3, side / count, axis=1)))

    def look_about(self, window):
        """Looks at squares, and as far again on all sides, and follows what is low."""
        times = 1 if self.repeats and not np.ndim(window.side) else 3
        rows = int(FINE / np.sqrt(len(window.grids)))
        for grid in window.grids:
            self.look(grid.middle, times * grid.side, times * rows)
        self.follow()
        self.seen = float(8**0.5 * np.max(window.side) / rows)  # in a disc of so many rows there is a sample

    def follow(self):
        """Adds the valleys below samples that no neighbour undercuts."""
        places, step, rows = self._starts[:, :3], self._starts[:, 3], np.arange(len(self._starts))
        ways = np.array([(a, b) for a in (-1, 0, 1) for b in (-1, 0, 1) if a or b])
        ways = np.vstack((ways, ways / 4))  # which turn across a valley that falls along it
        for _ in range(200):  # at most, a quarter of the one before once less is nearer
            if not np.any(step > 1e-5 * self.radius):
                break
            around = places[:, None, :2] + step[:, None, None] * ways
            f = self._least(around[..., 0], around[..., 1])
            best = rows, np.argmin(f, axis=1)
            lower = f[best] < places[:, 2]
            places = np.where(lower[:, None], np.column_stack((around[best], f[best])), places)
            step = np.where(lower & (best[1] < len(ways) // 2), step, step / 4)
        self.samples, self.valleys = (np.vstack((all, places)) for all in (self.samples, self.valleys))
        self._starts = self._starts[:0]

    def _least(self, x1, x2):
        with np.errstate(all="ignore"):  # far away heights overflow
            return self.gaps(x1, x2).min(axis=0)

    def _everywhere(self, count=COARSE):
        side, inside = NEAREST * self.ell, False
        while not inside or side < FARTHEST * max(self.ell, self.radius):
            self.look(np.zeros(2), side, count)
            side *= 2
            if len(self.samples) and side > FARTHEST * self.ell:
                self._bound(side)
                inside = 8 * np.hypot(*self.lowest[:2]) < side
            if side > WIDEST * self.ell:
                if count == COARSE and not len(self.samples):
                    return self._everywhere(FINE)
                self._refuse(RISES if inside else FALLS if len(self.samples) else UNSEEN)
        self.follow()
        if side < 8 * np.hypot(*self.lowest[:2]):
            self._refuse(FALLS)
        self._bound(side)
        away = 0.0
        while True:  # about what is lower still, and farther while it could touch there
            (*middle, least), reach = self.lowest, FARTHEST * max(self.ell, self.radius, away)
            self.look(middle, 8 * self.radius, FINE)
            for side in self.radius * 2.0 ** np.arange(1, np.ceil(np.log2(reach / self.radius))):
                self.look(middle, side, COARSE)
            self.follow()
            self._bound(reach)
            away = np.abs(self.low(self.bound)[:, :2] - middle).max(initial=0.0)
            if max(reach, np.hypot(*self.lowest[:2])) > WIDEST * self.ell:
                falls = least - self.lowest[2] > EQUAL * (self.bound - least)
                self._refuse(FALLS if falls else f"{RISES}: at a distance of {away:.2g} it could still touch")
            if reach > 8 * away:
                break

    def _refuse(self, what):
        least = FARTHEST / WIDEST * self.radius
        words = f"must be at least {least:.2g} for a contact of radius {self.radius:.2g}"
        # a flat obstacle has the widest disc of all that were looked at
        require(what != RISES or self.ell > least or self.radius > self._widest / 8, "ell", self.ell, words)
        raise BadArgument("obstacle", self.obstacle, f"must {what}" + f"; {BOUNDED}" * (what != UNSEEN))

    def _beside_valleys(self):
        seen = self.lowest[None, :2]
        while len(seen) <= VALLEYS:
            low = self.separate(self.bound)
            new = low[np.abs(low[:, None] - seen).max(axis=2).min(axis=1) > SAME * self.radius][:VALLEYS]
            if not len(new):
                return
            for place in new:
                apart = np.abs(place - seen[0]).max()
                for side in self.radius * 2.0 ** np.arange(np.ceil(np.log2(4 * apart / self.radius) + 1)):
                    self.look(place, side, COARSE)
            seen = np.vstack((seen, new))
            self.follow()

    def _bound(self, widest):
        """Sets bound and radius by discs up to a width about the lowest place, which may be at an edge of the
        obstacle, and about the place farthest from all edges.
        """
        self._widest, lowest = widest, self.lowest
        radii = widest / 2 * 2.0 ** (-np.arange(FINE) / 2)
        (z, weights), turns = gauss_rule(8), 2 * np.pi * (np.arange(16) + 0.5) / 16
        r, shares = np.sqrt(1 - z**2), np.repeat(weights, len(turns)) / len(turns)
        middles = np.array([lowest[:2], *([self._middle] if self._middle else [])])
        x1, x2 = (
            middles[:, axis, None, None] + radii[:, None] * np.outer(r, way(turns)).ravel()
            for axis, way in enumerate((np.cos, np.sin))
        )
        with np.errstate(all="ignore"):
            means = self.gaps(x1, x2) @ shares - lowest[2]
        corners = len(means) > 1
        means = np.array((means.mean(axis=0), means.min(axis=0))).min(axis=1)  # of the better disc
        if np.ndim(self.needed):
            sums = (np.array(self.needed)[:, None] / radii + means).min(axis=0)
            best = int(np.argmin(sums))
            above = (1 + corners) * float(sums[best])
        else:
            enough = np.flatnonzero(means[1] < self.needed - lowest[2])
            best = max(int(enough[0]) - 1, 0) if len(enough) else FINE - 1
            above = self.needed - lowest[2]
        self.radius, self.bound = float(radii[best]), float(lowest[2] + above)
