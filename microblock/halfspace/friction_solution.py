"""A state of a history of frictional contact on square cells."""

from dataclasses import dataclass
from typing import Any

from ..contact_solvers.friction_increments import SlidingSolution
from ..model.types import Array
from .surface_solution import SurfaceCells


@dataclass(frozen=True, repr=False, eq=False)
class SlidingCells(SlidingSolution, SurfaceCells):
    """A solution at loads (P, Q), with its Increment.

    Attributes
    ----------
    increment : Increment
    """

    increment: Any = None

    @property
    def areas(self) -> float:
        return float(self.grid.area)

    def along_surface(self, values: Array, places: Array) -> Array:
        """Returns values on cells, array (n, n), at places, (k, 2) or (k, 3): array (k,)."""
        return self.interpolated(values, *places.T[:2])
