"""Fields at points below a surface, of whatever body."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .types import Array


@dataclass(frozen=True, eq=False)
class PointFields:
    """Fields at points, arrays over the points last.

    Attributes
    ----------
    x1, x2 : arrays (n,)
        The points (lengths).
    psi : array (n,)
        Microrotation (radians).
    u : array (2, n)
        Displacement (length); of a half-plane u2 up to its additive constant, which is that of its kernels.
    stress : array (2, 2, n)
        Force stress, stress[0, 1] = sigma_12.
    couple_stress : array (2, n)
        Couple stress (stress x length).
    """

    x1: Array
    x2: Array
    psi: Array
    u: Array
    stress: Array
    couple_stress: Array

    @property
    def shear(self) -> Array:
        """Largest shear stress over all planes through each point: of the symmetric and the skew part."""
        (s11, s12), (s21, s22) = self.stress
        found: Array = np.hypot((s11 - s22) / 2, (s12 + s21) / 2) + np.abs(s12 - s21) / 2
        return found
