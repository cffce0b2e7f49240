"""A solution on square cells of the surface of a half-space."""

from __future__ import annotations

from dataclasses import dataclass

from ..corners.cell_solver import CellSolution
from ..model.types import AnyArray as Array


@dataclass(frozen=True, repr=False, eq=False)
class SurfaceCells(CellSolution):
    """A solution on square cells, with pressures of least norm.

    Attributes
    ----------
    closed : array (n, n) of int
        Number of closed corners.
    seen_width : float or None
        As of `microblock.State`.
    """

    closed: Array | None = None
    seen_width: float | None = None

    def pressure(self, corner: int, places: Array) -> Array:
        """Returns the pressure of a corner, by number, at places, array (k, 2) or (k, 3)."""
        return self.between(self.pressures[corner], places)

    def between(self, values: Array, places: Array) -> Array:
        """Returns values on cells, array (n, n), at places, array (k, 2) or (k, 3)."""
        return self.interpolated(values, *places.T[:2])

    def counter_displacement(self, places: Array) -> Array:
        """Returns the displacement along x3 of a second body at places, array (k,)."""
        return self.between(self.opposite, places)
