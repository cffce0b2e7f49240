"""A solution on square cells of the surface of a half-space."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.ndimage import map_coordinates

from ..corners.on_cells import Grid
from ..model.state import Solution
from ..model.types import AnyArray as Array


@dataclass(frozen=True, repr=False, eq=False)
class SurfaceCells(Solution):
    """A solution on square cells.

    Attributes
    ----------
    solver : SurfaceSolver
    load, approach : float
        Force, that of one period; approach (length).
    grid : Grid
    pressures : array (corners, n, n)
        Those of least norm.
    psi, micromoment : arrays (2, n, n)
        About x1 and x2 (radians), and couples or the reaction to psi = 0 (stress x length).
    displacement, opposite : arrays (n, n)
        Into the body, and of a second body along x3 (lengths).
    closed : array (n, n) of int
        Number of closed corners.
    residual, iterations : float, int
        Relative residual, and products with the flexibility.
    error_estimate : float or None
        None without a coarser grid.
    notes : tuple of str
    seen_width : float or None
        As of `microblock.State`.
    """

    solver: Any
    load: float
    approach: float
    grid: Grid
    pressures: Array
    psi: Array
    displacement: Array
    opposite: Array
    micromoment: Array
    closed: Array
    residual: float
    iterations: int
    error_estimate: float | None = None  # type: ignore[assignment]
    notes: tuple[str, ...] = ()
    seen_width: float | None = None

    method = "cells"

    @cached_property
    def total(self) -> Array:
        """Total pressure (stress)."""
        return np.sum(self.pressures, axis=0)

    def pressure(self, corner: int, places: Array) -> Array:
        """Returns the pressure of a corner, by number, at places, array (k, 2) or (k, 3)."""
        return self.between(self.pressures[corner], places)

    def between(self, values: Array, places: Array) -> Array:
        """Returns values on cells, array (n, n), at places, array (k, 2) or (k, 3)."""
        return self.interpolated(values, *places.T[:2])

    def counter_displacement(self, places: Array) -> Array:
        """Returns the displacement along x3 of a second body at places, array (k,)."""
        return self.between(self.opposite, places)

    def interpolated(self, values: Array, x1: Array, x2: Array) -> Array:
        """Returns values on cells, array (n, n), between their centres; 0 beyond."""
        places, n = self.grid.steps(x1, x2), self.grid.count
        periodic = self.solver.period is not None
        mode = "grid-wrap" if periodic else "nearest"
        found = map_coordinates(values, places, order=1, mode=mode)
        return np.where(periodic | np.all(np.abs(places - (n - 1) / 2) <= n / 2, axis=0), found, 0.0)

    @property
    def unknowns(self) -> int:
        """Corner forces."""
        return self.pressures.size

    @property
    def energy(self) -> float:
        """Elastic energy of both bodies: half the work of the corner forces."""
        gaps = self.solver.gaps(*self.grid.places)
        lowered = self.approach - np.where(np.isfinite(gaps), gaps, 0.0)
        return float(np.sum(self.pressures * self.grid.width**2 * lowered) / 2)
