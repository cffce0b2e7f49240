"""Tractions on the line as sources of the fields below, from near to far of an abscissa.

Sources give, for each distance, the force p, the moment M and the shear force q, each as the sum and as the
difference of those to the left and to the right: weights, array (6, m).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from ..model.quadrature import gauss_rule, lagrange
from ..model.types import Array, Flags, Integers
from .panels import PanelGrid

CUT = 3.0  # ratio of distances from the point that an interval of sources spans
TINY = np.finfo(float).tiny  # of parameters, so that an anchor is not divided by
FEW_POINTS = {64.0: 2, 8.0: 4}  # Gauss points of intervals this many times their length away: 1e-7 of waves
SAME_PLACE = 1e-6  # widths of a cell, within which neighbours have one edge
SHALLOWEST = 1e-3  # widths of a cell, above which tractions on cells mean nothing

Sources = Iterator[tuple[Array, Array]]


class SurfaceLoads(Protocol):
    """Tractions on the surface."""

    @property
    def extent(self) -> float:
        """Largest distance from the origin (length)."""

    @property
    def shallowest(self) -> float:
        """Depth to which points nearer to the surface are moved (length)."""

    @property
    def resolved(self) -> float:
        """As of `FieldsBelow` (length)."""

    def sources(self, x1: float, nearest: float, order: int) -> Sources:
        """Yields distances from x1 and weights, arrays (m,) and (6, m), from near to far; intervals nearer
        than `nearest` are not cut.
        """


def _shells(start: Array, end: Array, nearest: float) -> tuple[Array, Array, Integers, Integers]:
    """Returns intervals of distances, cut at `nearest` times powers of CUT: where the parts begin and end,
    their shells, and the numbers of the intervals, arrays (m,).
    """
    count = max(0, int(np.ceil(np.log(end.max() / nearest) / np.log(CUT))))
    cuts = np.concatenate(([0.0], nearest * CUT ** np.arange(count + 1)))
    first = np.maximum(start, cuts[:-1, None])
    last = np.minimum(end, cuts[1:, None])
    shell, number = np.nonzero(first < last)
    return first[shell, number], last[shell, number], shell, number


def _both_sides(loads: Array, side: Array) -> Array:
    """Returns sums and differences of loads, array (3, ...), 1 where the source lies to the left: array
    (6, ...).
    """
    return np.stack((loads, side * loads), axis=1).reshape(6, *loads.shape[1:])


@dataclass(frozen=True, eq=False)
class CellLoads:
    """Tractions on cells, linear in each.

    Attributes
    ----------
    left, right : arrays (n,)
    at_ends : array (3, n, 2), of p, M and q
    period : float or None
    """

    left: Array
    right: Array
    at_ends: Array
    period: float | None = None

    @property
    def extent(self) -> float:
        return float(np.abs((self.left, self.right)).max(initial=0.0))

    @property
    def shallowest(self) -> float:
        return 2 * SHALLOWEST * self.resolved

    @property
    def resolved(self) -> float:
        return float((self.right - self.left).min(initial=np.inf)) / 2

    def sources(self, x1: float, nearest: float, order: int) -> Sources:
        start, end, side, loads = self._halves(x1)
        if not len(start):
            return
        first, last, shell, number = _shells(start, end, nearest)
        points = np.full(len(first), order)
        for ratio, few in sorted(FEW_POINTS.items()):
            points[first > ratio * (last - first)] = few
        slope = np.diff(loads, axis=2)[..., 0] / (end - start)
        for cut, count in np.unique((shell, points), axis=1).T.tolist():
            part = (shell == cut) & (points == count)
            sigma, gauss = gauss_rule(count)
            length = (last - first)[part, None]
            source = number[part, None]
            distance = first[part, None] + length * sigma
            values = loads[:, source, 0] + slope[:, source] * (distance - start[source])
            weights = _both_sides(values * (length * gauss), side[source])
            yield distance.ravel(), weights.reshape(6, -1)

    def _halves(self, x1: float) -> tuple[Array, Array, Array, Array]:
        """Returns the parts of all cells to either side of x1, on a period up to a period away: distances at
        which they begin and end, 1 to the left and -1 to the right, arrays (m,), and loads there, array (3,
        m, 2).
        """
        left: Array = self.left - x1
        farthest = np.inf
        shifts: Array = np.zeros(1)
        if self.period is not None:
            farthest = self.period
            left = np.asarray(left % self.period, float)
            shifts = self.period * np.array((0.0, -1.0, -2.0))
        width = self.right - self.left
        near = (left + shifts[:, None]).ravel()
        far = near + np.tile(width, len(shifts))
        # distances grow to the right of x1 with the place, to its left against it
        begins = np.append(near, -far)
        ends = np.append(far, -near)
        loads = np.tile(self.at_ends, (1, len(shifts), 1))
        loads = np.concatenate((loads, loads[..., ::-1]), axis=1)
        side = np.repeat((-1.0, 1.0), len(near))
        start = np.maximum(begins, 0.0)
        end = np.minimum(ends, farthest)
        slope = np.diff(loads, axis=2)[..., 0] / (ends - begins)
        values = np.stack([loads[..., 0] + slope * (place - begins) for place in (start, end)], axis=2)
        there = start < end
        return start[there], end[there], side[there], values[:, there]


def lesser_slopes(after: Array, axis: int) -> Array:
    """Returns the lesser of the slopes to the next cell along an axis, `after`, and to the one before, 0
    where they have different signs: arrays of one shape.
    """
    before = np.roll(after, 1, axis)
    lesser = np.sign(after) * np.minimum(np.abs(after), np.abs(before))
    return np.where(after * before > 0, lesser, 0.0)


def cell_loads(
    left: Array, right: Array, means: Array, pressed: Flags, period: float | None = None
) -> CellLoads:
    """Returns the CellLoads of means over cells, array (3, n): linear in each cell that is pressed, with the
    lesser slope of those to both neighbours, so that forces stay.
    """
    width = right - left
    beside = np.roll(left, -1)
    if period is None:
        beside[-1] = np.inf
    else:
        beside[-1] += period
    joined = pressed & np.roll(pressed, -1) & (np.abs(beside - right) < SAME_PLACE * width)
    rise = np.roll(means, -1, axis=1) - means
    after = np.where(joined, 2 * rise / (width + np.roll(width, -1)), 0.0)
    half = lesser_slopes(after, 1) * width / 2
    loaded = np.any(means != 0, axis=0)
    at_ends = np.stack((means - half, means + half), axis=2)
    return CellLoads(left[loaded], right[loaded], at_ends[:, loaded], period)


@dataclass(frozen=True, eq=False)
class PanelHalves:
    """Panels cut at the points nearest to an abscissa, with the distance from it as their coordinate.

    Attributes
    ----------
    panel : array (n,), number of the panel
    v0, way : arrays (n,), the parameter of the nearest point, and the sign with which v goes away from there
    start, end : arrays (n,), distances there and at the end of the panel (lengths)
    h, root : arrays (n,), length of the panel, and whether its abscissae are quadratic in v
    """

    panel: Integers
    v0: Array
    way: Array
    start: Array
    end: Array
    h: Array
    root: Flags

    def select(self, numbers: Integers) -> "PanelHalves":
        """Returns those of the numbers, array (m,), as columns (m, 1)."""
        return PanelHalves(**{name: values[numbers, None] for name, values in vars(self).items()})

    def step(self, distance: Array) -> Array:
        """Returns |v - v0| at distances, columns (m, 1)."""
        ratio = (distance - self.start) / self.h
        v = np.sqrt(np.maximum(self.v0**2 + self.way * ratio, 0))
        return ratio / np.maximum(self.mean_slope(v), TINY)

    def mean_slope(self, v: Array) -> Array:
        """Returns the mean of |dx/dv|/h from v0 to v, array like v."""
        return np.where(self.root, self.v0 + v, 1.0)


@dataclass(frozen=True, eq=False)
class PanelLoads:
    """Tractions of a solution on panels.

    Attributes
    ----------
    solution : OnPanels
    shear : float or None
        Factor of its pressures in a shear traction, which these loads are then.
    shifts : sequence of float, or None
        Of each corner, by how much its pressures act left of the contact point, without moments: on a second
        body.
    """

    solution: Any
    shear: float | None = None
    shifts: Sequence[float] | None = None
    resolved: float = 0.0

    @property
    def extent(self) -> float:
        panels = self.solution.panels
        most = np.abs(np.concatenate((panels.e, panels.e + panels.h))).max()
        return float(most) + max(map(abs, self.shifts or (0.0,)))

    @property
    def shallowest(self) -> float:
        # nearer to the surface rounding shows in theta,2
        return 1e-7 * float(self.solution.problem.solid.ell)

    def sources(self, x1: float, nearest: float, order: int) -> Sources:
        """Yields distances and weights, as of SurfaceLoads. Distances are sums of steps: as differences of
        abscissae they would miss the slope of theta at the surface by percents.
        """
        panels = self.solution.whole[0]
        halves = _halves(panels, x1 + np.asarray(self.shifts or np.zeros(2))[panels.corner])
        first, last, shell, number = _shells(halves.start, halves.end, nearest)
        pieces = halves.select(number)
        low = pieces.step(first[:, None])
        high = pieces.step(last[:, None])
        sigma, gauss = gauss_rule(order)
        step = low + (high - low) * sigma
        v = pieces.v0 + pieces.way * step
        distance = pieces.start + pieces.h * step * pieces.mean_slope(v)
        weights = self._weights(pieces, v, (high - low) * gauss)
        for cut in np.unique(shell):
            between = shell == cut
            yield distance[between].ravel(), weights[:, between].reshape(6, -1)

    def _weights(self, pieces: PanelHalves, v: Array, dv: Array) -> Array:
        """Returns the weights of pieces at parameters v with weights dv, arrays (m, n): array (6, m, n)."""
        panels, rows = self.solution.whole
        problem = self.solution.problem
        panel = pieces.panel
        q = np.einsum("ijn,in->ij", lagrange(panels.points[0], v), rows[panel[:, 0]])
        force = dv * (q + panels.slope(panel, v) * panels.logarithm(panel, np.maximum(v, TINY)))
        side = np.broadcast_to(-np.sign(panels.h)[panel] * pieces.way, v.shape)
        if self.shear is not None:
            return _both_sides(np.array((0 * force, 0 * force, self.shear * force)), side)
        if self.shifts is not None:
            return _both_sides(np.array((force, 0 * force, 0 * force)), side)
        lever = problem.lever(np.broadcast_to(panels.corner[panel], v.shape), panels.x(panel, v))
        return _both_sides(np.array((force, problem.solid.ell / 2 * lever * force, 0 * force)), side)


def _halves(panels: PanelGrid, x1: Array) -> PanelHalves:
    """Returns both halves of all panels about the abscissa x1 of each, array (panels,), the lower ones
    first.
    """
    numbers = np.arange(len(panels.e))
    along = np.clip((x1 - panels.e) / panels.h, 0, 1)
    v0 = panels.parameter(numbers, x1)
    start = np.abs(x1 - panels.x(numbers, v0))
    start[(along > 0) & (along < 1)] = 0.0
    h = np.abs(panels.h)
    return PanelHalves(
        panel=np.tile(numbers, 2),
        v0=np.tile(v0, 2),
        way=np.repeat((-1.0, 1.0), len(v0)),
        start=np.tile(start, 2),
        end=np.concatenate((start + h * along, start + h * (1 - along))),
        h=np.tile(h, 2),
        root=np.tile(panels.root, 2),
    )
