"""A contact surface along x1, with what acts and happens on it."""

from __future__ import annotations

from dataclasses import dataclass

from .types import Array, Flags


@dataclass(frozen=True)
class Surface:
    """A state along the surface, at points in the order of x1; what is not said here is as of `State`.

    Attributes
    ----------
    points : array (n, 2)
        Points of the undeformed surface (lengths).
    pressures, gaps : arrays (corners, n)
        Stresses and lengths; a gap is inf where there is no obstacle over the corner.
    obstacle : array (n,)
        Height of the obstacle over the undeformed surface, along n (length).
    """

    points: Array
    normals: Array
    pressures: Array
    gaps: Array
    micromoment: Array
    psi: Array
    rotation: Array
    displacement: Array
    obstacle: Array
    corners: tuple[str, ...]
    ell: float
    interrupted: Flags | None = None

    @property
    def x(self) -> Array:
        """Abscissae x1 of the points, array (n,)."""
        return self.points[:, 0]
