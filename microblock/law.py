"""The contact law: corners of a microblock, their levers and initial gaps, (20)-(22), (29), (41).

A law names its corners. Each corner alpha has the gap

    g_alpha = g0_alpha - u.n + (ell/2) lever_alpha psi,     lever_A = n.(S + N), lever_B = n.(S - N),

and a multiplier lambda_alpha <= 0, which together give traction and micromoment (29)

    t_n = sum lambda_alpha,     M = -(ell/2) sum lever_alpha lambda_alpha.

With the small-angle form (41) in the local frame, n.N = 1 and n.S = psi0. Everything here is plain
numbers: no mesh, no NGSolve.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from . import obstacles
from .errors import BadArgument, MicroblockError, require_choice, require_finite

READINGS = ("gap", "lever")


@dataclass(frozen=True)
class Microblock:
    """The microblock law of section 3: two corners at each point of the surface.

    Parameters
    ----------
    psi0 : float or callable
        Initial rotation of the blocks (radians, counterclockwise), or a function of x1.
    reading : "gap" or "lever"
        Where psi0 acts: in gaps and levers, or in the levers alone (docs/theory.md, "Fig. 9").

    Examples
    --------
    >>> law = mb.Microblock(psi0=0.25)
    >>> law.corners, law.levers(np.zeros(1))["A"].tolist()
    (('A', 'B'), [1.25])
    """

    psi0: float | Callable = 0.0
    reading: str = "gap"

    clamps_rotation = False
    corners = ("A", "B")

    def __post_init__(self):
        require_choice(READINGS, reading=self.reading)
        if not callable(self.psi0):
            require_finite(psi0=self.psi0)
            self.angle(np.zeros(1))

    def angle(self, x):
        """psi0 at the abscissae x, shape (n,)."""
        if not callable(self.psi0) and abs(self.psi0) < 1:
            return np.full(np.shape(x), float(self.psi0))
        try:
            psi0 = np.broadcast_to(obstacles.real(self.psi0(x) if callable(self.psi0) else self.psi0), np.shape(x))
        except MicroblockError:
            raise
        except Exception as failure:      # whatever the user's function does
            raise BadArgument("psi0", self.psi0, f"must take an array of x and return as many numbers ({failure!r})") from failure
        if not np.all(np.isfinite(psi0)) or not np.all(np.abs(psi0) < 1):
            raise BadArgument("psi0", self.psi0, "must be finite and below 1 in absolute value (radians): "
                              "beyond it the levers of (41) change sign")
        return psi0.copy()

    def levers(self, x):
        """n.(S + N) of corner A and n.(S - N) of corner B at the abscissae x."""
        psi0 = self.angle(x)
        return {"A": psi0 + 1, "B": psi0 - 1}

    def initial_gaps(self, points, normals, ell, obstacle):
        """Gap over each corner, the corners being at ``x -+ (ell/2) S`` with ``S = s + psi0 n``, (20).

        Parameters
        ----------
        points, normals : arrays (n, 2), the contact points C and outward normals
        ell : side of the block (length)
        obstacle : see `microblock.obstacles.gap`
        """
        turn = self.angle(points[:, 0]) if self.reading == "gap" else np.zeros(len(points))
        tangent = np.column_stack((normals[:, 1], -normals[:, 0]))
        side = ell/2*(tangent + turn[:, None]*normals)
        return {"A": obstacles.gap(obstacle, points - side, normals),
                "B": obstacles.gap(obstacle, points + side, normals)}


@dataclass(frozen=True)
class Unilateral:
    """The classic law: one gap at the contact point itself and M = 0.

    Examples
    --------
    >>> mb.Unilateral().corners      # the contact point itself
    ('C',)
    """

    clamps_rotation = False
    corners = ("C",)

    def levers(self, x):
        return {"C": np.zeros(np.shape(x))}

    def initial_gaps(self, points, normals, ell, obstacle):
        return {"C": obstacles.gap(obstacle, points, normals)}


@dataclass(frozen=True)
class Microclamped(Unilateral):
    """The classic gap with psi = 0 on the whole contact surface.

    Examples
    --------
    >>> mb.Microclamped().clamps_rotation
    True
    """

    clamps_rotation = True


def traction(multipliers):
    """t_n of (29) from the multipliers of all corners."""
    return sum(multipliers.values())


def micromoment(multipliers, levers, ell):
    """M of (29) from multipliers and levers of all corners."""
    return -ell/2*sum(levers[corner]*multiplier for corner, multiplier in multipliers.items())


def check(law):
    """BadArgument unless this is a law."""
    if isinstance(law, type):
        raise BadArgument("law", law, f"must be an instance, mb.{law.__name__}()")
    if not all(hasattr(law, part) for part in ("corners", "levers", "initial_gaps", "clamps_rotation")):
        raise BadArgument("law", law, "must be a law, such as mb.Microblock() or mb.Unilateral()")


def corner_shifts(law, ell):
    """What the contact point lies right of each corner, or of itself, as far as S is horizontal."""
    return (0.0,) if len(law.corners) == 1 else (ell/2, -ell/2)


def symmetric(law, obstacle):
    """Whether obstacle and blocks are known to be symmetric about x = 0."""
    even = isinstance(obstacle, (obstacles.Plane, obstacles.Cylinder, obstacles.Wedge)) or (
        isinstance(obstacle, obstacles.Punch) and obstacle.tilt == 0)
    return even and (not isinstance(law, Microblock) or (not callable(law.psi0) and law.psi0 == 0))
