"""A state of a history of frictional contact on square cells."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..model.types import Array, Flags
from .surface_solution import SurfaceCells


@dataclass(frozen=True, repr=False, eq=False)
class SlidingCells(SurfaceCells):
    """A solution at loads (P, Q), with its Increment.

    Attributes
    ----------
    increment : Increment
    """

    increment: Any = None

    @property
    def energy(self) -> float:
        return float(self.increment.energy)

    @property
    def work(self) -> float:
        return float(self.increment.work)

    @property
    def stiffness(self) -> None:
        """None: sticking places make it larger than without friction, and it has a value for each way on."""

    @property
    def shear_traction(self) -> Array:
        """q on cells, array (2, n, n) (stress)."""
        return np.asarray(self.increment.tangential / self.grid.area)

    @property
    def slip(self) -> Array:
        """Slip since first contact, array (2, n, n) (length)."""
        return np.asarray(self.increment.slip)

    @property
    def stick(self) -> Flags:
        return np.asarray(self.increment.stick)

    def with_friction(self) -> dict[str, Any]:
        return {
            "shear": self.increment.shear,
            "shear_traction": self.shear_traction.reshape(2, -1).T,
            "stick": self.stick.ravel(),
            "dissipation": float(self.increment.dissipation),
            "tangential_approach": self.increment.motion,
        }

    def shear_at(self, places: Array) -> Array:
        """Returns q at places, array (n, 2), linear between the cells, within what friction allows."""
        x = places.T[:2]
        q = np.array([self.interpolated(values, *x) for values in self.shear_traction])
        bound = self.solver.law.friction * self.interpolated(self.total, *x)
        sizes = np.maximum(np.hypot(*q), np.finfo(float).tiny)
        return np.asarray((q * np.minimum(1.0, bound / sizes)).T)
