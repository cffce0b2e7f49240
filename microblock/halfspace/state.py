"""A solution on square cells of the surface of a half-space."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..model.state import Solution
from ..model.types import AnyArray as Array


@dataclass(frozen=True, repr=False, eq=False)
class SurfaceCells(Solution):
    """A solution on square cells, and what lies between their centres.

    Attributes
    ----------
    solver : SurfaceSolver
    load, approach : float
        Force, on a period that of one period; approach as of `microblock.State` (length).
    x1, x2 : arrays (n,)
        Centres of the cells (length).
    width : float
        Side of a cell (length).
    pressures : array (corners, n, n)
        Those of least norm: of four closed corners the resultants alone are unique.
    psi, micromoment : arrays (2, n, n)
        About x1 and x2 (radians), and couples of the corners' forces, or the reaction to psi = 0 (stress x
        length).
    displacement, opposite : arrays (n, n)
        Normal displacement into the body, and that of a second body along x3, 0 of a rigid one (lengths).
    closed : array (n, n) of int
        Number of closed corners at each cell: those with a force, and all four where no gap is open.
    residual, iterations : float, int
        Largest relative residual of the contact conditions, and products with the flexibility on this grid.
    error_estimate : float or None
        None where there is no coarser grid.
    notes : tuple of str
    seen_width : float or None
        As of `microblock.State`.
    """

    solver: Any
    load: float
    approach: float
    x1: Array
    x2: Array
    width: float
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
        """Total pressure, array (n, n) (stress)."""
        return np.sum(self.pressures, axis=0)

    def pressure(self, corner: int, places: Array) -> Array:
        """Returns the pressure of a corner, by its number, at places, array (k, 2) or (k, 3)."""
        return self.between(self.pressures[corner], places)

    def between(self, values: Array, places: Array) -> Array:
        """Returns values on the cells, array (n, n), at places, array (k, 2) or (k, 3)."""
        return self.interpolated(values, *places.T[:2])

    def counter_displacement(self, places: Array) -> Array:
        """Returns the displacement along x3 of the surface of a second body at places, array (k,)."""
        return self.between(self.opposite, places)

    def interpolated(self, values: Array, x1: Array, x2: Array) -> Array:
        """Returns values on the cells, array (n, n), between their centres; 0 beyond the cells."""
        n, (i, j) = len(self.x1), ((x - axis[0]) / self.width for x, axis in ((x1, self.x1), (x2, self.x2)))
        inside = True
        if self.solver.period is None:
            inside = (np.abs(i - (n - 1) / 2) <= n / 2) & (np.abs(j - (n - 1) / 2) <= n / 2)
            i, j = (np.clip(each, 0, n - 1) for each in (i, j))
        first, second = (np.floor(each).astype(int) for each in (i, j))
        s, t = i - first, j - second
        (a, b), (c, d) = ((each % n, (each + 1) % n) for each in (first, second))
        low, high = (1 - t) * values[a, c] + t * values[a, d], (1 - t) * values[b, c] + t * values[b, d]
        return np.where(inside, (1 - s) * low + s * high, 0.0)

    def nearest(self, x1: Array, x2: Array) -> tuple[Array, ...]:
        """Returns the numbers along x1 and x2 of the cells that are nearest to these, arrays of int."""
        places = (x1, self.x1), (x2, self.x2)
        steps = (np.rint((x - centres[0]) / self.width).astype(int) for x, centres in places)
        return tuple(np.clip(step, 0, len(self.x1) - 1) for step in steps)

    @property
    def unknowns(self) -> int:
        """Corner forces."""
        return self.pressures.size

    @property
    def energy(self) -> float:
        """Elastic energy of both bodies: half the work of the corner forces from the unloaded state on."""
        gaps = self.solver.initial_gaps(self.x1, self.x2)
        lowered = self.approach - np.where(np.isfinite(gaps), gaps, 0.0)
        return float(np.sum(self.pressures * self.width**2 * lowered) / 2)
