"""Contact on equal cells of a surface, matrix-free, on grids from coarse to fine."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from .. import cost
from ..errors import BadArgument, NotConverged, out_of_reach, require
from ..model.deformable import shape_of
from ..model.intervals import distance
from ..model.law import Microblock
from ..model.periodic import EQUAL, Repeated, agree_at_ends
from ..model.refinement import RefinementLevel, levels, refine
from ..model.solution import Solution
from ..model.solver import Solver
from ..model.types import Array
from . import projected_gradients
from .active_set import ContactState
from .fft_compliance import Flexibility, Grid


@dataclass(frozen=True, eq=False, repr=False)
class CellSolution(Solution):
    """A solution on equal cells of a line or a surface.

    Attributes
    ----------
    solver : CellSolver
    grid : Grid
    load, approach : force of a period, approach over the mean of the surface where it has one
    pressures : array (corners, n, ...)
    micromoment, psi : arrays (n,) or (2, n, n), M or the reaction to psi = 0, and psi
    displacement : array (n, ...), into the body
    residual : `kkt` of `microblock.contact_solvers.projected_gradients.solve_matrix_free`
    iterations : products with the flexibility
    error_estimate : float, or None without a coarser grid
    notes : sentences
    opposite : displacement of a second body, or None: in the plane under the corners, array (corners, n)
    data_exhausted : whether a note says that no rtol helps
    """

    solver: Any
    grid: Grid
    load: float
    approach: float
    pressures: Array
    micromoment: Array
    psi: Array
    displacement: Array
    residual: float
    iterations: int
    error_estimate: float | None = None
    notes: tuple[str, ...] = ()
    opposite: Any = None
    data_exhausted: bool = False

    method = "cells"

    @property
    def unknowns(self) -> int:
        return self.pressures.size

    @property
    def period(self) -> float | None:  # type: ignore[override]
        return self.solver.period

    @cached_property
    def total(self) -> Array:
        """Total pressure (stress)."""
        return np.sum(self.pressures, axis=0)

    @property
    def energy(self) -> float:
        """Elastic energy of both bodies: half the work of the corner forces."""
        gaps = self.solver.gaps(*self.grid.places)
        lowered = self.approach - np.where(np.isfinite(gaps), gaps, 0.0)
        return float(np.sum(self.pressures * lowered * self.grid.area) / 2)

    @property
    def stiffness(self) -> float | None:
        """dP/dd; inf where a period is in full contact, which no load presses deeper."""
        face = self.pressures > 0
        if self.period is not None and face.all():
            return math.inf
        return float(projected_gradients.forces_by_approach(self.solver.prepared(self.grid)[0], face).sum())

    def interpolated(self, values: Array, *x: Array) -> Array:
        """Returns values on cells, array (n, ...), between their centres; 0 beyond."""
        return self.grid.interpolated(values, self.period is not None, *x)


class CellSolver(Solver):
    """Base of solvers on equal cells along one axis or two; their `options` are `Cells`.

    A solver defines `gaps`, `tilt`, `flexibility`, `turned`, `estimate`, `cannot_reach` and `completed`.

    Attributes
    ----------
    dimensions : int, axes of the surface
    coarsest, most : int, cells along an axis of the first grid and the last that rtol may ask for
    few : int, at which halving a given number of cells ends
    loose : float, residual of coarser grids over their cells along an axis
    rate : str, of `cost.RATES`
    solution : class of its solutions
    besides : str, advice besides another rtol
    gaps : function of places, an array for each axis, that returns initial gaps, array (corners, ...)
    tilt : function of places that returns t, array (dimensions, ...); (0, ...) of one corner
    """

    usual_rtol = 1e-2
    dimensions: int
    coarsest: int
    most: int
    few: int
    loose: float
    rate: str
    solution: type[CellSolution]
    besides: Any = ""
    offsets: Array
    body: Any
    gaps: Callable[..., Array]
    tilt: Callable[..., Array]

    def flexibility(self, grid: Any) -> Any:
        """Returns the Flexibility of a grid."""
        raise NotImplementedError

    def turned(self, own: Array) -> Array:
        """Returns rotations of phi, or moments, about the axes of the solution."""
        raise NotImplementedError

    def estimate(self, changes: list[float], before: Any, state: Any) -> float:
        """Returns the error estimate of a solution, from changes between grids so far and the one before."""
        raise NotImplementedError

    def cannot_reach(
        self, changes: list[float], before: Any, goal: float, finer: float, least: float
    ) -> bool:
        """Returns whether grids so many times finer miss a goal that was asked for; `least` is the smallest
        estimate. Where no estimate is in sight it is not before the last few grids, whose estimates show
        what is in reach.
        """
        raise NotImplementedError

    def completed(self, state: Any, flexibility: Any, minimum: Any) -> Any:
        """Returns a solution with what the minimum on its cells tells besides."""
        raise NotImplementedError

    def set_up(self) -> None:
        self.period = self.body.period
        require(
            self.period is None or self.options.window is None,
            "window",
            self.options.window,
            "belongs to a surface without images; here it is the period",
        )

    @cached_property
    def shape(self) -> Any:
        """The rigid shape of the obstacle, on a period with its images."""
        shape = shape_of(self.obstacle)
        return shape if self.period is None else Repeated(shape, self.period, self.dimensions)

    def require_repeating(self) -> None:
        """Raises BadArgument unless the obstacle and psi0 fit the period."""
        period = self.period
        if period is None:
            return
        inner = self.obstacle.period or period
        fits = abs(period / inner - round(period / inner)) <= EQUAL
        require(fits, "period", period, f"must be a multiple of that of the obstacle, {inner}")
        words = f"must repeat with the period, {period:g}"
        require(self.shape.repeats(), "obstacle", self.obstacle, words)
        along = period * np.linspace(-0.5, 0.5, 257 if self.dimensions == 1 else 65)
        places = np.meshgrid(*[along] * self.dimensions, indexing="ij")
        tilts = np.reshape(self.tilt(*map(np.ravel, places)), (-1, *places[0].shape))
        angle = self.law.psi0 if isinstance(self.law, Microblock) else None
        require(agree_at_ends(tilts, range(1, tilts.ndim)), "psi0", angle, words)

    def given_window(self) -> Any:
        """Returns the period or the window of the options as a Grid of one cell, or None."""
        left, right = self.options.window or (0.0, 0.0)
        side = self.period or right - left
        return Grid(1, side, ((left + right) / 2,) * self.dimensions) if side else None

    def goal(self, rtol: float | None) -> float | None:
        require(
            self.options.nodes is None or rtol is None,
            "rtol",
            rtol,
            "chooses the nodes: not together with Cells(nodes=...)",
        )
        return None if self.options.nodes else super().goal(rtol)

    def within(
        self,
        window: Any,
        load: float | None,
        approach: float | None,
        goal: Any,
        missed: Callable[[Any], tuple[tuple[str, ...], bool]],
        initial: Any = None,
    ) -> Any:
        """Returns the solution in a window on the first grid with an estimate below the goal, or the best one
        for a goal that is `Usual`. `missed` returns notes of a solution, and whether something between cells
        would touch; it raises an error of its own for a window that must be wider.
        """

        def refusal(best: Any, last: Any, failure: NotConverged | None) -> NotConverged:
            words = " x ".join([str(best.result.grid.count)] * self.dimensions)
            why = "; ".join((f" on {words} cells", *best.result.notes))
            margin = last.margin
            return failure or out_of_reach(
                goal, best.error, why, self.besides, load=load, approach=approach, margin=margin
            )

        similar = isinstance(initial, CellSolution) and len(initial.pressures) == len(self.offsets)
        near = initial if similar else None
        sizes = self.sizes(window)

        def solve(count: int, before: Any) -> Any:
            grid = window.with_count(count)
            return self._on_grid(grid, load, approach, before or near, sizes)

        return refine(self._grids(solve, sizes, goal, missed), goal, refusal).result

    def sizes(self, window: Any) -> list[int]:
        """Returns numbers of cells along an axis of a window, ascending, to those that were named."""
        if self.options.nodes:
            return halvings(self.options.nodes, self.few)
        coarsest = self.first_cells(window)
        finer = np.log2(self.most / coarsest / len(window.grids) ** 0.5)
        return [coarsest * 2**n for n in range(1 + int(finer))]

    def _on_grid(
        self, grid: Any, load: float | None, approach: float | None, start: Any, sizes: list[int]
    ) -> Any:
        """Returns the solution on one of the grids of these sizes; None where an approach above the mean
        height that few cells see presses nothing yet.
        """
        count = grid.count
        is_last = count == sizes[-1]
        residuals = [self.options.residual]
        if not is_last:
            # rounding may keep a coarse grid from what it would gain from, where ell is very small
            residuals = [self.coarse_residual(count), 100 * self.coarse_residual(count)]
        for residual in residuals:
            try:
                return self.solved(grid, load, approach, residual, start)
            except BadArgument:
                if is_last or count > 8 * sizes[0]:
                    raise
                return None
            except NotConverged as objection:
                failure = objection
        raise failure

    def _grids(
        self,
        solve: Callable[[int, Any], Any],
        sizes: list[int],
        goal: Any,
        missed: Callable[[Any], tuple[tuple[str, ...], bool]],
    ) -> Iterator[RefinementLevel[Any]]:
        """Yields the RefinementLevels of `within`."""
        nodes = self.options.nodes
        least = np.inf
        for count, state, before, changes in levels(solve, sizes, self.change):
            if changes:
                state = replace(state, error_estimate=self.estimate(changes, before, state))
            if count < sizes[-1] and (nodes or len(changes) < 2):
                continue
            notes, unseen = missed(state)
            state = replace(state, notes=notes)
            error = np.inf if unseen else state.error_estimate
            if nodes or error <= goal or error <= self.enough(goal, state):
                yield RefinementLevel(state, error, suffices=True)
                return
            least = min(least, error)
            # what errors that fall a little slower than so far are on the last grid; large ones have no rule
            last = max(changes[-1], np.finfo(float).tiny)
            fall = np.clip(changes[-2] / last, 1, 2) if least < 0.1 else 1
            yield RefinementLevel(
                replace(state, error_estimate=error),
                error,
                cost.predict(self.rate, 2**self.dimensions * state.unknowns).seconds,
                self.cannot_reach(changes, before, goal, sizes[-1] // count, least),
                margin=fall ** (0.75 * np.log2(count / sizes[-1])),
            )

    def sensitivity(self, solution: Any, low: Any, high: Any) -> dict[str, float]:
        """Returns the change of the approach, f' . (dH f + dg0) on closed corners, f' their forces by the
        load; none without an approach, or in full contact on a period.
        """
        face = solution.pressures > 0
        if not self.has_approach or (self.period is not None and face.all()):
            return {}
        grid = solution.grid
        rates = projected_gradients.forces_by_approach(self.prepared(grid)[0], face)
        gaps = []
        for contact in (low, high):
            H, g0 = contact.solver.prepared(grid)
            gaps.append((H @ (solution.pressures * grid.area) + g0)[face])
        return {"approach": float(rates[face] @ (gaps[1] - gaps[0]) / rates.sum())}

    def first_cells(self, window: Any) -> int:
        """Returns the number of cells along an axis of the first grid in a window."""
        return self.coarsest

    def coarse_residual(self, count: int) -> float:
        """Returns the residual of so many cells along an axis of a grid that is not the last, or of a window
        that is looked for: looser where that is asked for, up to a hundredth.
        """
        return max(self.loose / count, min(self.options.residual, 0.01))

    def enough(self, goal: float, state: Any) -> float:
        """Returns the error that suffices where a state misses its goal."""
        return goal

    def path(self, last: float, rtol: float | None) -> Any:
        from .cell_path import CellPath  # here: a single state does without

        return CellPath(self, last, self.goal(rtol))

    def gaps_on(self, grid: Any) -> Array:
        """Returns the initial gaps of the cells of a grid, array (corners, ...)."""
        return self.gaps(*grid.places)

    @cached_property
    def _prepared(self) -> dict[Any, tuple[Any, Array]]:
        return {}

    def prepared(self, grid: Any) -> tuple[Any, Array]:
        """Returns (flexibility, initial gaps) of a grid; those of one window are kept."""
        if any(
            earlier.middle != grid.middle or not np.allclose(earlier.side, grid.side)
            for earlier in self._prepared
        ):
            self._prepared.clear()
        if grid not in self._prepared:
            self._prepared[grid] = self.flexibility(grid), self.gaps_on(grid)
        return self._prepared[grid]

    def solved(
        self, grid: Any, load: float | None, approach: float | None, residual: float, start: Any = None
    ) -> Any:
        """Returns the solution on a grid, from that on another one."""
        H, g0 = self.prepared(grid)
        words = "has a finite height over no cell"
        if self.period is not None:
            words += ": on a period it is looked for within 1.5 periods of 0, or between its `ends`"
        require(np.isfinite(g0).any(), "obstacle", self.obstacle, words)
        minimum = self._minimum_from(start, grid, load=load, approach=approach, rtol=residual)
        surface = H.surface(minimum.forces)
        half = self.solid.ell / 2
        phi, m = H.rotations_and_moments(minimum.forces, surface)
        state = self.solution(
            self,
            grid,
            minimum.load if load is None else load,
            minimum.approach,
            minimum.forces / grid.area,
            self.turned(m) * half / grid.area,
            self.turned(phi) / half,
            surface[0],
            minimum.kkt,
            minimum.iterations,
        )
        return self.completed(state, H, minimum)

    def _minimum_from(self, start: Any, grid: Any, **options: Any) -> ContactState:
        """Returns the contact state on a grid, from the solution on another one or None. From a coarser grid
        at the same load or approach it is first that of the cells about its contact, and then looked at on
        all of them.
        """
        H, g0 = self.prepared(grid)
        if start is None:
            return self.minimum(H, g0, **options)
        forces = grid.area * start.pressures[(slice(None), *start.grid.nearest(*grid.places))]
        part = grid
        if start.load == options["load"] or start.approach == options["approach"]:
            part, cells = self.about(start, grid)
        if part is grid:
            return self.minimum(H, g0, start=forces, **options)
        inside = self.minimum(self.flexibility(part), g0[cells], start=forces[cells], **options)
        forces[:] = 0.0
        forces[cells] = inside.forces
        whole = projected_gradients.state_of(H, g0, forces, **options)
        if whole is None:  # corners touch outside of the part
            whole = self.minimum(H, g0, start=forces, **options)
        return replace(whole, iterations=inside.iterations + whole.iterations)

    def minimum(self, H: Flexibility, g0: Array, **options: Any) -> ContactState:
        """Returns the contact state on a grid."""
        return projected_gradients.solve_matrix_free(H, g0, **options)

    def about(self, start: Any, grid: Any) -> tuple[Any, Any]:
        """Returns the part of a grid that holds the contact of a coarser one with a margin, and the slices of
        its cells; or the grid itself.
        """
        return grid, ...

    def change(self, coarse: Any, fine: Any) -> float:
        """Returns max(|dp|, |dM|/ell)/|p| in L2 between two grids, at the finer cells."""
        places = fine.grid.places
        shape = fine.total.shape
        moments = fine.micromoment.reshape(-1, *shape)
        coarse_moments = coarse.micromoment.reshape(-1, *coarse.total.shape)
        dp = coarse.interpolated(coarse.total, *places) - fine.total
        dM = [
            coarse.interpolated(values, *places) - moment for values, moment in zip(coarse_moments, moments)
        ]
        weights = np.broadcast_to(self.weights(fine.grid) * fine.grid.area, shape).ravel()
        turned = np.linalg.norm(dM, axis=0).ravel()
        return distance(weights, dp.ravel(), turned / self.solid.ell, fine.total.ravel())

    def weights(self, grid: Any) -> Array:
        """Returns weights of squares in the norm, on the cells of a grid."""
        return np.ones(1)


def halvings(nodes: int, few: int = 1024) -> list[int]:
    """Returns numbers of cells along an axis up to a given one, three at least."""
    sizes = [nodes]
    while sizes[-1] > 2 * few or len(sizes) < 3:
        sizes.append((sizes[-1] + 1) // 2)
    return sizes[::-1]
