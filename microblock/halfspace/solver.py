"""Contact on square cells of the half-space, from coarse grids to finer ones.

1. A window is found about the lowest place of the obstacle: cells on it that press near its rim, and places
   outside at which a gap is negative, widen it; then it is cut to the contact.
2. Grids of 32, 64, ... cells a side are solved (`microblock.corners.projected_gradients`), each started from
   the one before, until the estimate is below rtol.

The estimate compares means over the cells of the grid before: successive changes fall by a factor between
that of the edge of the contact, which cells cut into steps, and that of the smooth inside.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.sparse import csr_array
from tqdm.auto import tqdm

from ..corners import projected_gradients
from ..errors import BOUNDED, NOT_YET, BadArgument, NotConverged, out_of_reach
from ..halfplane.counter import require_same_period
from ..halfplane.kernels import is_classical
from ..model.deformable import body_of
from ..model.events import LoadPath
from ..model.material import joint_modulus
from ..model.solver import Solver
from ..model.types import AnyArray as Array
from ..model.types import ContactLike, Interval
from .cells import Flexibility, flexibility
from .counter import Counter
from .half_space import HalfSpace
from .kernels import kernels
from .obstacles import heights, repeated
from .state import SurfaceState
from .surface_law import closed_corners, on_surface

FIRST, MOST = 32, 1024  # cells a side of the coarsest and of the finest grid that rtol may ask for
COARSE_RESIDUAL = 1e-3  # of the coarser grids, over their cells a side
WINDOW_CELLS = 48  # cells a side, on which the window is found
WIDENED = 1.5  # times, where the contact reaches the rim of the window
TRIES = 30  # windows
RIM = 2  # cells at the rim that must not press
SPARE = 0.08  # of the contact's size, free on either side
LOOKED = 96  # places along either axis, and as many radii and directions, at which gaps outside are looked at
FARTHEST = 1e3  # times the window, to which gaps are looked at
OVERLAP = 1e-6  # of the approach: a gap that is more negative is a contact
SLOWEST, FASTEST = 1.6, 2.5  # ratio of successive changes from grid to grid that the estimate takes
FITS = 1e-6  # of their range, heights and psi0 at both ends of a period may differ; so may periods
PLACES = 65  # on an edge of a period, at which they are compared
DISTANCES = np.geomspace(1e-4, 1e5, 121)  # of ell, at which an obstacle is looked at


@dataclass(frozen=True)
class Grid:
    """Equal square cells: their number a side, width, and centres."""

    count: int
    width: float
    middle: tuple[float, float]

    @cached_property
    def axes(self) -> tuple[Array, Array]:
        """Centres along x1 and along x2, arrays (count,)."""
        x = self.width * (np.arange(self.count) - (self.count - 1) / 2)
        return self.middle[0] + x, self.middle[1] + x


class SurfaceSolver(Solver):
    """States of a HalfSpace; its `options` are `Cells`, whose nodes count along each axis."""

    usual_rtol = 1e-2
    most_corners = None
    counter_bodies = (HalfSpace,)
    state_class = SurfaceState

    def __init__(self, contact: ContactLike, options: Any) -> None:
        super().__init__(contact, options)
        self._require_bodies()
        self.surface_law = on_surface(self.law)
        self.period: float | None = self.body.period  # type: ignore[attr-defined]
        if self.period is not None and options.window is not None:
            raise BadArgument("window", options.window, "belongs to a half-space without images")
        if options.nodes is not None and options.nodes > 2 * MOST:
            raise BadArgument("nodes", options.nodes, f"counts along each axis: at most {2 * MOST}")
        self._require_repeating()
        self._kept: dict[Grid, Flexibility] = {}

    def _require_bodies(self) -> None:
        """Raises BadArgument for a first body whose blocks nothing holds, and for bodies of two periods."""
        if is_classical(self.solid):
            raise BadArgument(
                "beta", self.solid.beta, "must hold the rotation of blocks: a second body alone may have 0"
            )
        require_same_period(self.body, self.obstacle)

    def _require_repeating(self) -> None:
        """Raises BadArgument unless obstacle and psi0 fit the period: what is cut off must go on where it
        begins.
        """
        own, period = getattr(self.obstacle, "period", None), self.period
        if own is not None and (period is None or abs(period / own - round(period / own)) > FITS):
            raise BadArgument("period", period, f"must be a multiple of that of the obstacle, {own}")
        if period is None:
            return
        if not _repeats(lambda x1, x2: heights(self.obstacle, x1, x2), period):
            raise BadArgument("obstacle", self.obstacle, f"must repeat with the period, {period:g}")
        if not _repeats(self.surface_law.tilt, period):
            psi0 = getattr(self.law, "psi0", None)
            raise BadArgument("psi0", psi0, f"must repeat with the period, {period:g}")

    @property
    def has_level(self) -> bool:  # type: ignore[override]
        return True

    def path(self, last: float, rtol: float | None, progress: bool = False) -> LoadPath:
        """Raises BadArgument: events of a surface are not followed."""
        raise BadArgument(
            "method",
            type(self.options).__name__,
            "cannot follow events on a HalfSpace: solve the loads one by one, each with the state before as "
            "`initial`",
        )

    def state(self, solution: Any) -> Any:
        """Returns the SurfaceState that `solve` has made."""
        return solution

    def initial_gaps(self, x1: Array, x2: Array) -> Array:
        """Returns the initial gaps of all corners at cells with these centres, array (corners, n, n)."""
        obstacle = self.obstacle if self.period is None else repeated(self.obstacle, self.period)
        return self.surface_law.initial_gaps(obstacle, self.solid.ell, *np.meshgrid(x1, x2, indexing="ij"))

    def solve(
        self,
        load: float | None,
        approach: float | None,
        rtol: float | None,
        initial: Any = None,
        progress: bool = False,
    ) -> Any:
        """Returns the SurfaceState; parameters and errors are those of `Solver.solve`."""
        nodes = self.options.nodes
        if nodes is not None and rtol is not None:
            raise BadArgument("rtol", rtol, "chooses the nodes: not together with Cells(nodes=...)")
        side, middle = self._window(load, approach)
        sizes = (
            _halvings(nodes)
            if nodes is not None
            else [FIRST * 2**i for i in range(int(np.log2(MOST / FIRST)) + 1)]
        )
        goal = self.usual_rtol if rtol is None else rtol
        similar = isinstance(initial, SurfaceState) and tuple(initial.pressures) == self.surface_law.names
        near = initial if similar else None
        state: Any = None
        before, changes = None, list[float]()
        with tqdm(total=len(sizes), unit=" grids", disable=not progress) as bar:
            for count in sizes:
                last = count == sizes[-1]
                residual = self.options.residual if last else COARSE_RESIDUAL / count
                grid = Grid(count, side / count, middle)
                start = _start(state, near, grid)
                before, state = state, self._solved(grid, load, approach, residual, start)
                bar.update()
                if before is not None and before.width == 2 * state.width:
                    changes.append(_change(before, state, self.solid.ell))
                state = replace(state, error_estimate=_estimate(changes))
                if nodes is None and len(changes) > 1 and state.error_estimate <= goal:
                    return self._finished(grid, load, approach, state)
        if nodes is not None:
            return state
        besides = f"fix Cells(nodes=...): there were {MOST} x {MOST} cells"
        raise out_of_reach(goal, state.error_estimate, load, approach, besides)

    def _finished(
        self, grid: Grid, load: float | None, approach: float | None, state: SurfaceState
    ) -> SurfaceState:
        """Returns the state to the residual that was asked for, on the grid that is fine enough."""
        if state.residual <= self.options.residual:
            return state
        final = self._solved(grid, load, approach, self.options.residual, _spread(state, grid))
        return replace(final, error_estimate=state.error_estimate)

    def _flexibility(self, grid: Grid) -> Flexibility:
        own, period = Grid(grid.count, grid.width, (0.0, 0.0)), self.period
        law = self.surface_law
        tilt = law.tilt(*np.meshgrid(*grid.axes, indexing="ij"))
        if own not in self._kept:
            self._kept.clear()  # the last one alone: they are large
            where = grid.width, grid.count, period is not None
            second = body_of(self.obstacle)
            counter = second and Counter.on(second.solid, self.solid.ell, law.offsets, *where)
            self._kept[own] = flexibility(
                self.solid, law.offsets, tilt, grid.width, period is not None, law.clamped, counter
            )
        return replace(self._kept[own], tilt=tilt)

    def _solved(
        self, grid: Grid, load: float | None, approach: float | None, residual: float, start: Array | None
    ) -> SurfaceState:
        """Returns the state on a grid, begun from pressures of the corners, array (corners, n, n)."""
        x1, x2 = grid.axes
        g0 = self.initial_gaps(x1, x2)
        H, area = self._flexibility(grid), grid.width**2
        first = None if start is None else start * area
        found = projected_gradients.solve(H, g0, load=load, approach=approach, start=first, rtol=residual)
        if not found.load > 0:
            raise BadArgument("approach", approach, NOT_YET)
        surface, forces, other = H.surface(found.forces), found.forces, np.zeros(g0.shape[1:])
        if H.counter is not None:
            other = H.counter.over(H.counter.displacement(H.counter.pressed(forces)))
        closed = found.gaps <= 2 * max(found.kkt, residual) * np.ptp(surface[0] + other)
        if H.counter is None:
            forces = self.surface_law.of_least_norm(forces, closed)
        pressures = forces / area
        psi, moment = self._turned(H, forces, surface, area)
        return SurfaceState(
            self.contact,
            found.load,
            found.approach,
            x1,
            x2,
            grid.width,
            dict(zip(self.surface_law.names, pressures)),
            psi,
            surface[0],
            other,
            moment,
            closed_corners(forces, closed),
            found.kkt,
            found.products,
        )

    def _turned(self, H: Flexibility, forces: Array, surface: Array, area: float) -> tuple[Array, Array]:
        """Returns psi and M, arrays (2, n, n): phi = (-psi2, psi1) ell/2 and m = (-M2, M1) 2/ell."""
        half = self.solid.ell / 2
        if len(surface) == 3:
            m = H.resultants(forces)[1:] / area
            return np.array((surface[2], -surface[1])) / half, np.array((m[1], -m[0])) * half
        nothing = np.zeros((2, *surface.shape[1:]))
        beside = H.beside(forces)
        if self.surface_law.clamped:
            return nothing, np.array((beside[1], -beside[0])) / area * half
        return np.array((beside[1], -beside[0])) / half, nothing

    # the window

    def _window(self, load: float | None, approach: float | None) -> tuple[float, tuple[float, float]]:
        """Returns (side, middle) of the square of cells."""
        if self.period is not None:
            return self.period, (0.0, 0.0)
        if self.options.window is not None:
            left, right = self.options.window
            return right - left, ((left + right) / 2,) * 2
        middle: Any
        side, middle = self._first_window(load, approach)
        for _ in range(TRIES):
            grid = Grid(WINDOW_CELLS, side / WINDOW_CELLS, middle)
            state = self._solved(grid, load, approach, COARSE_RESIDUAL / WINDOW_CELLS, None)
            box: Any = _box(state, grid)
            outside = self._touching_outside(state, side, middle)
            if outside is not None:
                box = tuple((min(a, c), max(b, d)) for (a, b), (c, d) in zip(box, outside))
            size = max(b - a for a, b in box)
            reaches = any(
                a < m - side / 2 + (RIM + 0.5) * grid.width or b > m + side / 2 - (RIM + 0.5) * grid.width
                for (a, b), m in zip(box, middle)
            )
            if outside is None and not reaches and size >= 0.6 * side:
                return side, middle
            middle = tuple((a + b) / 2 for a, b in box)
            wider = WIDENED * max(size, side) if reaches and outside is None else 0.0
            side = max(wider, size * (1 + 2 * SPARE) + 2 * (RIM + 1) * size / WINDOW_CELLS)
            if not reaches and outside is None:
                return side, middle
        raise NotConverged(
            f"no window holds the contact after {TRIES} tries, the last of side {side:g}; give "
            "Cells(window=(left, right))"
        )

    def _first_window(self, load: float | None, approach: float | None) -> tuple[float, tuple[float, float]]:
        """Returns (side, middle) about the lowest place, as wide as a classical contact or an approach."""
        ell, turns = self.solid.ell, np.linspace(0, 2 * np.pi, 32, endpoint=False)
        middle = np.zeros(2)
        for _ in range(6):  # the lowest place seen on all scales, from there on again
            r = np.concatenate(([0.0], ell * DISTANCES))
            x1, x2 = middle[0] + np.outer(r, np.cos(turns)), middle[1] + np.outer(r, np.sin(turns))
            h = heights(self.obstacle, x1, x2)
            place = np.unravel_index(np.argmin(h), h.shape)
            if h[place] >= h[0, 0]:
                break
            middle = np.array((x1[place], x2[place]))
        if place[0] == len(r) - 1 and h[place] < h[0, 0]:
            raise BadArgument("obstacle", self.obstacle, "must be lowest somewhere: it falls without end")
        lowest = np.where(np.isfinite(h), h, np.inf).min(axis=1) - h.min()
        rise = np.nanmean(np.where(np.isfinite(h), h, np.nanmax(h[np.isfinite(h)])), axis=1) - h.min()
        there = np.isfinite(h).any(axis=1)
        r, rise = r[there][1:], rise[there][1:]
        needed = approach - h.min() if load is None else load / (2 * self._modulus * r)
        enough = np.flatnonzero(rise >= needed)
        if lowest[-1] < np.min(needed):
            raise BadArgument(
                "obstacle",
                self.obstacle,
                f"must rise in every direction to carry the load {load:g}: {BOUNDED}",
            )
        if len(enough):
            reach = r[enough[0]]
        elif not np.all(there):  # a flat face: all of it
            reach = r[-1]
        else:
            raise BadArgument(
                "obstacle", self.obstacle, f"does not rise enough to carry the load {load:g}: {BOUNDED}"
            )
        if not np.isfinite(h).all():
            reach = min(reach, r[-1] * 1.05)
        return 3 * reach + 2 * ell, (float(middle[0]), float(middle[1]))

    @property
    def _modulus(self) -> float:
        """E* of both bodies (stress)."""
        second = body_of(self.obstacle)
        return joint_modulus(self.solid, second and second.solid)

    def _touching_outside(
        self, state: SurfaceState, side: float, middle: tuple[float, float]
    ) -> tuple[Interval, Interval] | None:
        """Returns the box of places outside of the window at which a gap is negative; None without any."""
        square = side * np.linspace(-3, 3, LOOKED)
        r, turns = (
            side * np.geomspace(0.5, FARTHEST, LOOKED),
            np.linspace(0, 2 * np.pi, LOOKED, endpoint=False),
        )
        x1 = middle[0] + np.concatenate((np.repeat(square, LOOKED), np.outer(r, np.cos(turns)).ravel()))
        x2 = middle[1] + np.concatenate((np.tile(square, LOOKED), np.outer(r, np.sin(turns)).ravel()))
        out = np.maximum(np.abs(x1 - middle[0]), np.abs(x2 - middle[1])) > side / 2
        x1, x2 = x1[out], x2[out]
        gaps = self.surface_law.initial_gaps(self.obstacle, self.solid.ell, x1, x2) - state.approach
        low = gaps.min(axis=0) < 0
        if not low.any():
            return None
        x1, x2, gaps = x1[low], x2[low], gaps[:, low]
        u, phi = self._surface_at(state, x1, x2)
        gaps += u - np.tensordot(self.surface_law.offsets, phi, 1)
        gaps += (self.surface_law.tilt(x1, x2) * phi[: len(self.surface_law.psi0)]).sum(axis=0)
        counter = self._flexibility(_grid(state)).counter
        if counter is not None:
            forces = np.array(list(state.pressures.values())) * state.width**2
            gaps += counter.at(forces, (state.x1, state.x2), x1, x2)
        low = gaps.min(axis=0) < -OVERLAP * abs(state.approach)
        if not low.any():
            return None
        return (float(x1[low].min()), float(x1[low].max())), (float(x2[low].min()), float(x2[low].max()))

    def _surface_at(self, state: SurfaceState, x1: Array, x2: Array) -> tuple[Array, Array]:
        """Returns u, array (n,), and the phi that corners see, array (2, n), at places outside, under the
        forces of the cells as points.
        """
        solid, corners = self.solid, len(self.surface_law.psi0) > 0
        table = kernels(solid.nu, solid.beta, solid.curvature, solid.alpha_prime, solid.beta_prime)
        i, j = np.nonzero(state.pressure)
        scale = state.width**2 * (1 - solid.nu) / solid.mu / solid.ell
        p = scale * state.pressure[i, j]
        M1, M2 = state.micromoment[:, i, j]
        m1, m2 = -2 / solid.ell * scale * M2, 2 / solid.ell * scale * M1
        u, phi = np.zeros(len(x1)), np.zeros((2, len(x1)))
        for block in np.array_split(np.arange(len(x1)), 1 + len(x1) * len(i) // 2**20):
            away = (x1[block, None] - state.x1[i]) / solid.ell, (x2[block, None] - state.x2[j]) / solid.ell
            if not corners:
                u[block] = (table.clamped if self.surface_law.clamped else table.components)(*away)[0] @ p
                continue
            own, v1, v2, w11, w12, w22 = table.components(*away)
            u[block] = own @ p - v1 @ m1 - v2 @ m2
            phi[:, block] = v1 @ p + w11 @ m1 + w12 @ m2, v2 @ p + w12 @ m1 + w22 @ m2
        return u, phi


def _halvings(nodes: int) -> list[int]:
    """Returns sizes of grids up to one of so many cells a side, ascending, halves of the next."""
    sizes = [nodes]
    while sizes[-1] % 2 == 0 and sizes[-1] // 2 >= FIRST // 2 and len(sizes) < 6:
        sizes.append(sizes[-1] // 2)
    return sizes[::-1]


def _repeats(values: Callable[[Array, Array], Array], period: float) -> bool:
    """Returns whether values, arrays (..., places), are the same on opposite edges of a period."""
    along, edge = period * np.linspace(-0.5, 0.5, PLACES), np.full(PLACES, period / 2)
    inside = values(np.repeat(along, PLACES), np.tile(along, PLACES))
    most = FITS * np.ptp(inside[np.isfinite(inside)]) if np.isfinite(inside).any() else 0.0
    pairs = (values(edge, along), values(-edge, along)), (values(along, edge), values(along, -edge))
    return all(np.allclose(one, other, rtol=0, atol=most) for one, other in pairs)


def _start(before: SurfaceState | None, near: SurfaceState | None, grid: Grid) -> Array | None:
    """Returns pressures to begin with on a grid: those of the grid before, with what is finer of a similar
    state.
    """
    if before is None or near is None:
        known = near if before is None else before
        return None if known is None else _spread(known, grid)
    coarse = replace(before, pressures=dict(zip(before.pressures, _spread(near, _grid(before)))))
    return _spread(before, grid) + _spread(near, grid) - _spread(coarse, grid)


def _spread(state: SurfaceState, grid: Grid) -> Array:
    """Returns pressures of a state as means over the cells of another grid, array (corners, n, n)."""
    first, second = (_overlaps(old, new) for old, new in zip((state.x1, state.x2), grid.axes))
    return np.array([first @ one @ second.T for one in state.pressures.values()])


def _overlaps(old: Array, new: Array) -> csr_array:
    """Returns the shares of new cells that lie in old ones, sparse (new, old), of their centres."""
    width, (first, last) = old[1] - old[0], (1.5 * new[0] - 0.5 * new[1], 1.5 * new[-1] - 0.5 * new[-2])
    edges = (np.linspace(first, last, len(new) + 1) - old[0]) / width + 0.5  # in old cells
    cuts = np.unique(np.concatenate((np.clip(edges, 0, len(old)), np.arange(len(old) + 1.0))))
    middles = (cuts[1:] + cuts[:-1]) / 2
    within = (middles > edges[0]) & (middles < edges[-1])
    places = np.searchsorted(edges, middles[within]) - 1, middles[within].astype(int)
    shares = np.diff(cuts)[within] / (edges[1] - edges[0])
    return csr_array((shares, places), shape=(len(new), len(old)))


def _means(values: Array) -> Array:
    """Returns means over 2 x 2 cells, of the last two axes."""
    n = values.shape[-1] // 2
    return values.reshape(*values.shape[:-2], n, 2, n, 2).mean(axis=(-3, -1))


def _change(coarse: SurfaceState, fine: SurfaceState, ell: float) -> float:
    """Returns max(|dp|, |dM|/ell)/|p| in L2 between two grids, on the cells of the coarser."""
    size = np.linalg.norm(coarse.pressure)
    pressure = np.linalg.norm(_means(fine.pressure) - coarse.pressure)
    moment = np.linalg.norm(_means(fine.micromoment) - coarse.micromoment) / ell
    return float(max(pressure, moment) / size)


def _estimate(changes: list[float]) -> float | None:
    """Returns the error of the last grid from successive changes; None without any."""
    if not changes:
        return None
    ratio = changes[-2] / changes[-1] if len(changes) > 1 and changes[-1] > 0 else SLOWEST
    last = max(changes[-1], changes[-2] / FASTEST) if len(changes) > 1 else changes[-1]
    return last / (min(max(ratio, SLOWEST), FASTEST) - 1)


def _grid(state: SurfaceState) -> Grid:
    return Grid(len(state.x1), state.width, (float(state.x1.mean()), float(state.x2.mean())))


def _box(state: SurfaceState, grid: Grid) -> tuple[Interval, Interval]:
    """Returns the rectangle of the cells that press: ((left, right), (lower, upper))."""
    there = state.closed > 0
    half = grid.width / 2
    found = []
    for axis, x in zip((1, 0), grid.axes):
        own = x[there.any(axis=axis)]
        found.append((float(own[0] - half), float(own[-1] + half)))
    return found[0], found[1]
