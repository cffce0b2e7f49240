"""A state of a half-space on square cells."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..contact_solvers.cell_solver import CellSolution
from ..contact_solvers.fft_compliance import Grid, spots
from ..errors import require
from ..model.refinement import FEWEST
from ..model.solution import SpaceSolution
from ..model.types import Array
from .subsurface import HalfSpaceBelow, SquareLoads, joined, square_loads

SPOT = FEWEST**2  # cells of a contact


class ContactLeavesWindow(Exception):
    """A wider window must hold more places, array (k, 2)."""

    def __init__(self, places: Array) -> None:
        super().__init__()
        self.places = places


@dataclass(frozen=True, repr=False, eq=False)
class SurfaceCells(CellSolution, SpaceSolution):
    """A solution on square cells, with pressures of least norm.

    Attributes
    ----------
    closed : array (n, n) of int
        Number of closed corners.
    seen_width : float or None
        As of `microblock.State`.
    """

    closed: Any = None
    seen_width: float | None = None

    def state(self) -> Any:
        """Returns the State on cells, square after square and row after row."""
        grids = self.grid.grids
        points = np.concatenate([np.stack((*grid.places, 0 * grid.places[0]), axis=-1) for grid in grids])
        areas = np.repeat([grid.area for grid in grids], grids[0].count ** 2)
        cells: dict[str, Any] = {"squares": grids, "seen_width": self.seen_width}
        if len(grids) == 1:
            x1, x2 = grids[0].axes
            cells |= {"shape": grids[0].places[0].shape, "x1": x1, "x2": x2, "width": float(grids[0].width)}
        normals = np.tile([0.0, 0.0, 1.0], (len(areas), 1))
        return self.state_at(points.reshape(-1, 3), normals, areas, **cells)

    @property
    def shear_traction(self) -> Array | None:
        """q on cells, array (2, ...) (stress), with friction."""
        return None

    @cached_property
    def fields(self) -> HalfSpaceBelow:
        solver = self.solver
        clamped = solver.law.clamps_rotation
        moments = np.zeros_like(self.micromoment) if clamped else self.micromoment
        shear = np.zeros_like(moments) if self.shear_traction is None else self.shear_traction
        loads = self._loads(np.concatenate((self.total[None], shear, moments)))
        second = None
        if solver.second is not None:
            # corners press it where they stand; shear, under one corner alone, acts oppositely on it
            shear = -shear / len(solver.offsets)
            above = [
                self._loads(
                    np.concatenate((pressure[None], shear, 0 * moments)), solver.solid.ell / 2 * offset
                )
                for pressure, offset in zip(self.pressures, solver.offsets)
            ]
            second = HalfSpaceBelow(solver.second, False, joined(above), self.period, upper=True)
        return HalfSpaceBelow(solver.solid, clamped, loads, self.period, second=second)

    def _loads(self, means: Array, shift: Array | float = 0.0) -> SquareLoads:
        """Returns the SquareLoads of means over cells, array (5, ...), shifted by (x1, x2)."""
        grids = self.grid.grids
        squares = means.reshape(len(means), len(grids), *grids[0].places[0].shape).swapaxes(0, 1)
        loads = joined([square_loads(grid, part, self.is_whole) for grid, part in zip(grids, squares)])
        return replace(loads, places=loads.places + np.reshape(shift, (-1, 1)))

    @property
    def is_whole(self) -> bool:
        """Whether the cells are those of a whole period."""
        return self.period is not None and isinstance(self.grid, Grid)

    def pressure(self, corner: int, places: Array) -> Array:
        """Returns the pressure of a corner, by number, at places, array (k, 2) or (k, 3)."""
        return self.interpolated(self.pressures[corner], *places.T[:2])

    def between(self, values: Array, places: Array) -> Array:
        """Returns micromoments on cells, array (n, n), at places, array (k, 2) or (k, 3)."""
        return self._within_squares(values, places, vanishes=not self.solver.law.clamps_rotation)

    def counter_displacement(self, places: Array) -> Array:
        """Returns the displacement along x3 of a second body at places, array (k,)."""
        return self._within_squares(self.opposite, places, vanishes=not self.opposite.any())

    def _within_squares(self, values: Array, places: Array, vanishes: bool) -> Array:
        """Returns values on cells at places; raises BadArgument beside the cells unless they vanish there."""
        inside = vanishes or self.is_whole or np.all(self.grid.distance_outside(*places.T[:2]) <= 0)
        require(inside, "points", places, "must lie in the squares, beside which this is not known")
        return self.interpolated(values, *places.T[:2])


def load_fraction_on_spots(state: SurfaceCells, least: float) -> float:
    """Returns the fraction of the load on spots of fewer cells."""
    load = 0.0
    count = state.grid.count
    for forces in state.total.reshape(-1, count, count) * np.reshape(state.grid.area, (-1, 1, 1)):
        labels = spots(forces > 0, state.is_whole)
        load += forces[(np.bincount(labels.ravel())[labels] < least) & (labels > 0)].sum()
    return float(load / state.load)
