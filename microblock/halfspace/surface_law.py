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
        raise BadArgument("law", law, "must be Microblock, Unilateral or Microclamped on a HalfSpace")
    if callable(law.psi0):
        raise BadArgument("psi0", law.psi0, "must be a number on a HalfSpace")
    offsets = np.array(list(CORNERS.values()), float)
    levers = -offsets + np.array((law.psi0, 0.0))
    tilt = float(law.psi0) if law.psi0_in == ACTS_IN[0] else 0.0
    return SurfaceLaw(tuple(CORNERS), offsets, levers, tilt)
