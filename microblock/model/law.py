"""The contact law: corners of a microblock, their levers and initial gaps, (20)-(22), (29), (41).

A corner at r from the centre of its block, its arm, moves by u + psi x r. So each corner alpha has the gap

    g_alpha = g0_alpha - n.(u + psi x r_alpha) = g0_alpha - u.n + (ell/2) lever_alpha psi,

    r_A = (ell/2) (N - S), r_B = (ell/2) (N + S),     lever_A = n.(S + N), lever_B = n.(S - N),

and a multiplier lambda_alpha <= 0, which together give traction and micromoment (29)

    t_n = sum lambda_alpha,     M = -(ell/2) sum lever_alpha lambda_alpha.

With the small-angle form (41) in the local frame, n.N = 1 and n.S = psi0.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any, cast

import numpy as np

from ..errors import BadArgument, Checked, checked, require_choice, require_finite
from . import obstacles
from .summary import is_told
from .types import Array, Function, LawLike, ObstacleLike, Tilt

ACTS_IN = ("gaps and levers", "levers")  # where psi0 may act


class Law:
    """Base of laws, also of a user's: it names corners, their levers and initial gaps.

    Attributes
    ----------
    corners : tuple of str
        Names of the corners, from left to right.
    clamps_rotation : bool
        Whether psi = 0 on the whole contact surface.
    even : bool
        Whether the law is known to be symmetric about x1 = 0.
    """

    corners: tuple[str, ...] = ("C",)
    clamps_rotation = False
    even: Any = False  # a bool, or a property

    def levers(self, x: Array) -> dict[str, Array]:
        """Returns the levers of (29) at x, array (n,): {corner: array (n,)} in the order of `corners`."""
        raise NotImplementedError

    def initial_gaps(
        self, points: Array, normals: Array, ell: float, obstacle: ObstacleLike
    ) -> dict[str, Array]:
        """Returns the initial gaps along the normal, {corner: array (n,)} (lengths), inf without an obstacle,
        of points (lengths) with unit normals, arrays (n, 2), and the side `ell` of a block (length).
        """
        raise NotImplementedError

    def initial_rotation(self, x: Array) -> Array:
        """Returns what psi0 adds to the rotation of the blocks at x, array (n,) (radians)."""
        return np.zeros(np.shape(x))

    def shifts(self, ell: float) -> tuple[float, ...]:
        """Returns how far right of each corner its contact point lies, if S is horizontal (lengths)."""
        return (0.0,) * len(self.corners)

    def arms(self, points: Array, normals: Array) -> Array:
        """Returns the places of the corners from the centre of their block, over its side: array (corners, n,
        2), in space (corners, n, 3), at points (lengths) with unit normals. Here they follow from the levers;
        corners that have one lie half a side above the centre.
        """
        levers = np.array(list(self.levers(points[:, 0]).values()))[:, :, None]
        if not levers.any():
            return np.zeros((len(levers), *points.shape))
        return (normals - levers * tangents(normals)) / 2


class _Coulomb(Law, Checked):
    friction: float = 0.0

    def __repr__(self) -> str:
        known = [(each.name, getattr(self, each.name), each) for each in fields(cast(Any, self))]
        listed = [f"{name}={value!r}" for name, value, each in known if is_told(each, value)]
        return f"{type(self).__name__}({', '.join(listed)})"


def _not_negative(friction: float) -> None:
    require_finite(friction=friction)
    if friction < 0:
        raise BadArgument("friction", friction, "must be 0 or positive")


def _coefficient() -> float:
    return field(default=0.0, metadata={"told": "if other than usual"} | checked(_not_negative))


@dataclass(frozen=True, repr=False)
class Microblock(_Coulomb):
    """The microblock law of section 3: two corners at each point of the surface.

    Parameters
    ----------
    psi0 : float, callable or pair
        Initial rotation of the blocks (radians, counterclockwise), or a function of x1. On a `HalfSpace` a
        number is the rotation about -e2; a pair holds those about x1 and x2, each a number or a function of
        (x1, x2).
    psi0_in : "gaps and levers" or "levers"
        Where psi0 acts (docs/differences.md, "Initial rotation of Fig. 9").
    friction : float
        Coefficient f of Coulomb; states then depend on their history, see `Contact.history`.

    Raises
    ------
    BadArgument
        If psi0 is not below 1 in absolute value, or no pair of such, or `psi0_in` is neither word; if the
        friction is negative, or not 0 where psi0 is other than 0.

    Examples
    --------
    >>> law = mb.Microblock(psi0=0.25)
    >>> law.corners, law.levers(np.zeros(1))["A"].tolist()
    (('A', 'B'), [1.25])
    """

    psi0: float | Function | tuple[Tilt, Tilt] = 0.0
    psi0_in: str = field(default=ACTS_IN[0], metadata=checked(require_choice, ACTS_IN))
    friction: float = _coefficient()

    corners = ("A", "B")

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.friction and not self.even:
            raise BadArgument(
                "friction",
                self.friction,
                "must be 0 where psi0 is other than 0: the two corners of a block then slip differently",
            )
        parts: tuple[Any, ...] = self.psi0 if isinstance(self.psi0, tuple) else (self.psi0,)
        if len(parts) != 2 and parts is self.psi0:
            raise BadArgument("psi0", self.psi0, "must be a pair of rotations, about x1 and x2")
        for part in parts:
            if not callable(part):
                require_finite(psi0=part)
                rotation(part, np.zeros(1))

    @property
    def even(self) -> bool:
        return not callable(self.psi0) and self.psi0 == 0

    def shifts(self, ell: float) -> tuple[float, ...]:
        return ell / 2, -ell / 2

    def arms(self, points: Array, normals: Array) -> Array:
        """Returns (N - S)/2 and (N + S)/2, (20), of ``S = t + psi0 n`` and ``N = n - psi0 t``; in space (N +
        a S1 + b S2)/2 with a, b = -1, 1, of ``S_i = e_i + psi0 x e_i`` and ``N = e3 + psi0 x e3``.
        """
        if points.shape[1] == 3:
            t1, t2 = surface_tilt(self.psi0, *points.T[:2])
            places = [(a - t1, b - t2, 1 + a * t1 + b * t2) for a in (-1, 1) for b in (-1, 1)]
            return np.moveaxis(np.array(places), 1, 2) / 2
        psi0, along = self.angle(points[:, 0])[:, None], tangents(normals)
        across, up = along + psi0 * normals, normals - psi0 * along
        return np.array((up - across, up + across)) / 2

    def initial_rotation(self, x: Array) -> Array:
        """Returns psi0 at x, array (n,) (radians), where it acts in the gaps; else 0."""
        angle = self.angle(x)
        return angle if self.psi0_in == ACTS_IN[0] else np.zeros(np.shape(x))

    def angle(self, x: Array) -> Array:
        """Returns psi0 at x, array (n,) (radians); raises BadArgument if it is a pair, or not below 1."""
        if isinstance(self.psi0, tuple):
            raise BadArgument(
                "psi0", self.psi0, "must be a number or a function of x1: a pair belongs to a HalfSpace"
            )
        return rotation(self.psi0, x)

    def levers(self, x: Array) -> dict[str, Array]:
        """Returns n.(S + N) of corner A and n.(S - N) of corner B, with n.N = 1 and n.S = psi0, (41)."""
        psi0 = self.angle(x)
        return {"A": 1 + psi0, "B": psi0 - 1}

    def initial_gaps(
        self, points: Array, normals: Array, ell: float, obstacle: ObstacleLike
    ) -> dict[str, Array]:
        """Returns the gaps over the corners at ``x -+ (ell/2) S``, (20)."""
        side = ell / 2 * (tangents(normals) + self.initial_rotation(points[:, 0])[:, None] * normals)
        return {
            "A": obstacles.gap(obstacle, points - side, normals),
            "B": obstacles.gap(obstacle, points + side, normals),
        }


@dataclass(frozen=True, repr=False)
class Unilateral(_Coulomb):
    """The classic law: one gap at the contact point itself and M = 0.

    Parameters
    ----------
    friction : float
        As of `Microblock`.

    Raises
    ------
    BadArgument
        If the friction is negative.

    Examples
    --------
    >>> mb.Unilateral().corners      # the contact point itself
    ('C',)
    """

    friction: float = _coefficient()

    even = True

    def levers(self, x: Array) -> dict[str, Array]:
        return {"C": np.zeros(np.shape(x))}

    def initial_gaps(
        self, points: Array, normals: Array, ell: float, obstacle: ObstacleLike
    ) -> dict[str, Array]:
        return {"C": obstacles.gap(obstacle, points, normals)}


@dataclass(frozen=True, repr=False)
class Microclamped(Unilateral):
    """The classic gap with psi = 0 on the whole contact surface.

    Parameters
    ----------
    friction : float
        As of `Microblock`.

    Raises
    ------
    BadArgument
        If the friction is negative.

    Examples
    --------
    >>> mb.Microclamped().clamps_rotation
    True
    """

    clamps_rotation = True


BUILT_IN = Microblock, Unilateral, Microclamped  # and nothing derived from them


def surface_tilt(psi0: Any, x1: Array, x2: Array) -> Array:
    """Returns t = (-psi0_2, psi0_1) over a surface, array (2, ...), of a pair or, about -e2, of a number."""
    about = psi0 if isinstance(psi0, tuple) else (0.0, -psi0)
    return np.array([-rotation(about[1], x1, x2), rotation(about[0], x1, x2)])


def rotation(psi0: Any, *x: Array) -> Array:
    """Returns psi0, a number or a function, at places: an array of their shape (radians); raises BadArgument
    if it fails, or is not below 1.
    """
    shape = np.shape(x[0])
    angles = np.full(shape, 0.0 if callable(psi0) else float(psi0))
    if callable(psi0):
        angles = obstacles.evaluated(
            lambda *x: np.array(np.broadcast_to(obstacles.real(psi0(*x)), shape)),
            *x,
            name="psi0",
            given=psi0,
            allowed="must take an array for each coordinate and return as many numbers",
        )
    if not np.all(np.abs(angles) < 1):  # nor NaN
        raise BadArgument(
            "psi0",
            psi0,
            "must be finite and below 1 in absolute value (radians): beyond it levers (41) change sign",
        )
    return angles


def tangents(normals: Array) -> Array:
    """Returns the unit tangents n x e3 of unit normals, arrays (n, 2)."""
    return np.column_stack((normals[:, 1], -normals[:, 0]))


def has_constant_levers(law: object) -> bool:
    return type(law) in BUILT_IN and not callable(getattr(law, "psi0", None))


def check(law: object, in_space: bool = False) -> None:
    """Raises BadArgument unless this is a law, `in_space` one that is known there."""
    if isinstance(law, type):
        home = "mb." * law.__module__.startswith("microblock")
        raise BadArgument("law", law, f"must be an instance, {home}{law.__name__}()")
    missing = [name for name in dir(Law) if not name.startswith("_") and not hasattr(law, name)]
    missing += [name for name in ("levers", "initial_gaps") if getattr(type(law), name, 0) is vars(Law)[name]]
    if missing:
        raise BadArgument(
            "law",
            law,
            "must be a law, such as mb.Microblock() or mb.Unilateral(), or one of your own with "
            f"microblock.model.law.Law as its base: it has no {missing[0]}",
        )
    if type(law) in BUILT_IN:
        return
    if in_space:
        raise BadArgument("law", law, "must be Microblock, Unilateral or Microclamped over a surface")
    _check_corners(law)


def _check_corners(law: Any) -> None:
    """Raises BadArgument unless a user's law has gaps, levers and shifts of its corners."""
    point, normal = np.zeros((1, 2)), np.array([[0.0, 1.0]])
    names = tuple(law.corners)
    plain = all(isinstance(name, str) for name in names) and len(set(names)) == len(names)
    if not names or not plain or {"full", "contact"} & set(names):
        words = f'must name its corners, each in another way and none "full" or "contact": {law.corners!r}'
        raise BadArgument("law", law, words)
    levers = law.levers(np.zeros(1))
    for name, found in (
        ("levers", levers),
        ("initial_gaps", law.initial_gaps(point, normal, 1.0, obstacles.Plane(level=1.0))),
    ):
        shapes = isinstance(found, dict) and {key: np.shape(value) for key, value in found.items()}
        if shapes != dict.fromkeys(names, (1,)) or tuple(found) != names:
            words = f"{name} must return an array for each of its corners, in the order {', '.join(names)}"
            raise BadArgument("law", law, words + (f": at one point shapes are {shapes}" if shapes else ""))
        values = np.ravel(list(found.values()))
        if not np.isrealobj(values) or not np.all(np.isfinite(values)):
            raise BadArgument("law", law, f"{name} must be finite real numbers under a plane: {values}")
    shifts = law.shifts(1.0)
    if np.shape(shifts) != (len(names),) or not np.all(np.isfinite(np.asarray(shifts, float))):
        raise BadArgument("law", law, f"shifts must return a finite number for each corner: {shifts!r}")
    in_order = np.ravel(list(levers.values()))
    if np.any(np.diff(in_order) > 0):
        raise BadArgument(
            "law",
            law,
            f"must name its corners from left to right, the largest lever first: {in_order.tolist()}",
        )


def require_shifts(law: LawLike) -> None:
    """Raises BadArgument unless gaps of the law under a slope are those of its shifts."""
    if type(law) in BUILT_IN:
        return
    slope, place, up = 2.0**-10, np.zeros((1, 2)), np.array([[0.0, 1.0]])
    inclined = obstacles.Obstacle(lambda x: 1 + slope * x)
    flat, inclined_gaps = (law.initial_gaps(place, up, 1.0, one) for one in (obstacles.Plane(1.0), inclined))
    wanted = [float((flat[corner] - inclined_gaps[corner])[0]) / slope for corner in law.corners]
    if not np.allclose(law.shifts(1.0), wanted, rtol=0, atol=1e-6):
        words = f"must have shifts(ell) where its gaps have them, at {wanted} ell, and not {law.shifts(1.0)}"
        raise BadArgument("law", law, words)


def require_pure_force(law: LawLike, ell: float) -> None:
    """Raises BadArgument where the only corner has a lever: half-planes then know no moment."""
    right = obstacles.scales(ell)
    if len(law.corners) == 1 and np.any(list(law.levers(np.concatenate((-right, [0.0], right))).values())):
        words = "has one corner with a lever: on a half-plane it must be 0, a Block or a Body takes any"
        raise BadArgument("law", law, words)
