"""A contact law on a surface: which corners a block has there, where they are and what lever each has.

A block is a cube with sides along x1 and x2. Its corner (a, b), a, b = -1, 1, lies at ``(ell/2) (a, b)`` from
the contact point; with phi1 = -(ell/2) psi2 and phi2 = (ell/2) psi1 its gap is

    g = g0 + u + lever.phi,     lever = (-a, -b),

u the normal displacement into the body. On a cylinder along x2 this is the law (20)-(29), with a = -1 for A.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import BadArgument
from ..model.law import ACTS_IN, Microblock
from ..model.types import AnyArray as Array
from ..model.types import LawLike
from .obstacles import heights

CORNERS = {"--": (-1, -1), "-+": (-1, 1), "+-": (1, -1), "++": (1, 1)}
NONE = np.array((1.0, -1.0, -1.0, 1.0))  # forces on them that have neither a resultant nor a moment


@dataclass(frozen=True)
class SurfaceLaw:
    """The corners of a law on a surface.

    Attributes
    ----------
    names : tuple of str
        "--", "-+", "+-" and "++" (signs of a and b), or "C".
    offsets, levers : arrays (corners, 2)
        Places from the contact point over ell/2; levers.
    tilt : float
        psi0, the rotation of all blocks that gaps have in them (radians), about -e2 as in the plane x1, x3.
    clamped : bool
        Whether psi = 0 on the whole surface.
    """

    names: tuple[str, ...]
    offsets: Array
    levers: Array
    tilt: float = 0.0
    clamped: bool = False

    def initial_gaps(self, obstacle: object, ell: float, x1: Array, x2: Array) -> Array:
        """Returns the initial gaps of all corners of blocks at (x1, x2), array (corners, ...) (lengths)."""
        return np.array(
            [
                heights(obstacle, x1 + ell / 2 * a, x2 + ell / 2 * b) - ell / 2 * a * self.tilt
                for a, b in self.offsets
            ]
        )

    def of_least_norm(self, forces: Array, closed: Array) -> Array:
        """Returns the forces of least norm with the same resultants, array (corners, ...).

        Only blocks with all four corners closed have a choice: the forces 1, -1, -1, 1 on them have no
        resultant. None becomes negative.

        Parameters
        ----------
        forces : array (corners, ...)
        closed : boolean array (corners, ...)
            Whether the gap is closed, with or without a force.
        """
        if len(forces) != len(NONE):
            return forces
        free = closed.all(axis=0)
        signs = NONE.reshape(-1, *[1] * free.ndim)
        least = (
            np.where(signs > 0, forces, np.inf).min(axis=0),
            np.where(signs < 0, forces, np.inf).min(axis=0),
        )
        share = np.clip(-(signs * forces).sum(axis=0) / len(NONE), -least[0], least[1])
        return np.maximum(forces + np.where(free, share, 0.0) * signs, 0.0)


def on_surface(law: LawLike) -> SurfaceLaw:
    """Returns the SurfaceLaw of a law of the plane.

    Raises
    ------
    BadArgument
        If the law is none of Microblock, Unilateral and Microclamped, or psi0 is a function.
    """
    if len(law.corners) == 1:
        return SurfaceLaw(("C",), np.zeros((1, 2)), np.zeros((1, 2)), clamped=law.clamps_rotation)
    if not isinstance(law, Microblock):
        raise BadArgument("law", law, "must be Microblock, Unilateral or Microclamped over a surface")
    if callable(law.psi0):
        raise BadArgument("psi0", law.psi0, "must be a number over a surface")
    offsets = np.array(list(CORNERS.values()), float)
    levers = -offsets + np.array((law.psi0, 0.0))
    tilt = float(law.psi0) if law.psi0_in == ACTS_IN[0] else 0.0
    return SurfaceLaw(tuple(CORNERS), offsets, levers, tilt)
