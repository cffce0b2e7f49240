"""A contact law on a surface: corners of a block and their tilt.

Blocks are cubes with sides along x1 and x2, but for initial rotations psi0 = (psi0_1, psi0_2) about them.
With t = (-psi0_2, psi0_1) corner (a, b), a, b = -1, 1, lies ``(ell/2) (a, b)`` from the contact point
along the surface and ``(ell/2) (a, b).t`` above it. With phi1 = -(ell/2) psi2, phi2 = (ell/2) psi1 its gap is

    g = h - (ell/2) (a, b).t + u + lever.phi,     lever = t - (a, b),

u the displacement into the body. On a cylinder along x2 this is the law (20)-(29), with a = -1 for A and
psi0 = -psi0_2.
"""

from dataclasses import dataclass

import numpy as np

from ..errors import require
from ..model.law import ACTS_IN, surface_tilt
from ..model.obstacles import heights
from .fft_compliance import TWIST_MODE, of_least_norm, twisted

CORNERS = {"--": (-1, -1), "-+": (-1, 1), "+-": (1, -1), "++": (1, 1)}


@dataclass(frozen=True)
class SurfaceLaw:
    """The corners of a law on a surface.

    Attributes
    ----------
    names : tuple of str
        "--", "-+", "+-" and "++" (signs of a and b), or "C".
    offsets : array (corners, 2)
        (a, b), places over ell/2; 0 of one corner.
    psi0 : number, or (number or function, number or function), or None
        Initial rotation about -e2, or those about x1 and x2 (radians).
    in_gaps : bool
        Whether psi0 acts in gaps, not in levers alone.
    """

    names: tuple
    offsets: np.ndarray
    psi0: object = None
    in_gaps: bool = True

    def tilt(self, x1, x2):
        """Returns t at (x1, x2), array (2, ...), or (0, ...); raises BadArgument if a function psi0 fails, or
        is not below 1 in absolute value.
        """
        if self.psi0 is None:
            return np.zeros((0, *np.shape(x1)))
        return surface_tilt(self.psi0, x1, x2)

    def initial_gaps(self, obstacle, ell, x1, x2):
        """Returns the initial gaps of blocks at (x1, x2), array (corners, ...) (lengths)."""
        above = [heights(obstacle, x1 + ell / 2 * a, x2 + ell / 2 * b) for a, b in self.offsets]
        return np.array(above) - self.raised(ell, x1, x2)

    def raised(self, ell, x1, x2):
        """Returns how far psi0 raises the corners of blocks at (x1, x2), array (corners, ...) (lengths)."""
        tilt = self.tilt(x1, x2)
        return ell / 2 * self.in_gaps * np.tensordot(self.offsets[:, : len(tilt)], tilt, 1)

    def of_least_norm(self, forces, closed):
        """Returns the forces of least norm with the same resultants, none negative; arrays (corners, ...).
        Only blocks with four closed corners have a choice.
        """
        if len(forces) != len(TWIST_MODE):
            return forces
        return twisted(forces, of_least_norm(forces), np.all(closed, axis=0))


def closed_corners(forces, closed):
    """Returns how many corners of each block touch: those with a force, or all where no gap is open."""
    touching = (forces > 0) | (closed.all(axis=0) & (len(forces) > 1))
    return np.asarray(touching.sum(axis=0))


def on_surface(law):
    """Returns the SurfaceLaw of a law of the plane; raises BadArgument if psi0 is a function of x1."""
    if len(law.corners) == 1:
        return SurfaceLaw(("C",), np.zeros((1, 2)))
    require(
        not callable(law.psi0),
        "psi0",
        law.psi0,
        "must be a number, or a pair of numbers or functions of (x1, x2), over a surface",
    )
    offsets = np.array(list(CORNERS.values()), float)
    return SurfaceLaw(tuple(CORNERS), offsets, law.psi0, law.psi0_in == ACTS_IN[0])
