"""The contact law: corners of a microblock, their levers and initial gaps, (20)-(22), (29), (41).

A corner at r from the centre of its block, its arm, moves by u + psi x r. So each corner alpha has the gap

    g_alpha = g0_alpha - n.(u + psi x r_alpha) = g0_alpha - u.n + (ell/2) lever_alpha psi,

    r_A = (ell/2) (N - S), r_B = (ell/2) (N + S),     lever_A = n.(S + N), lever_B = n.(S - N),

and a multiplier lambda_alpha <= 0, which together give traction and micromoment (29)

    t_n = sum lambda_alpha,     M = -(ell/2) sum lever_alpha lambda_alpha.

With the small-angle form (41) in the local frame, n.N = 1 and n.S = psi0.
"""

from collections.abc import Collection
from dataclasses import dataclass, field, fields
from typing import Any, cast

import numpy as np

from ..errors import BadArgument, Checked, checked, real_numbers, require, require_choice, require_finite
from . import obstacles
from .types import Array, Function, Tilt

ACTS_IN = ("gaps and levers", "levers")  # where psi0 may act


class Law:
    """Base of laws, also of a user's: it names corners, and says where on their blocks they are.

    Over a surface blocks have sides along t1 and t2 of `side_directions`: e1 and e2 where it is horizontal.

    Attributes
    ----------
    corners : tuple of str
        Names of the corners, from left to right.
    clamps_rotation : bool
        Whether psi = 0 on the whole contact surface.
    even : bool
        Whether the law is known to be symmetric about x1 = 0.
    uniform : bool
        Whether arms, places and initial rotation are known to be the same at all points in the frame of t and
        n: one block is then asked for all.
    friction : float
        Coefficient of Coulomb; histories alone know it.
    psi0_in_gaps : bool
        Whether kinks of `varying_psi0` are kinks of the gaps.
    surface_corners : tuple of str
        Names of the corners over a surface; none of a law that is not known there.
    """

    corners: tuple[str, ...] = ("C",)
    surface_corners: tuple[str, ...] = ()
    clamps_rotation = False
    friction: Any = 0.0
    even: Any = False  # a bool, or a property
    uniform: Any = False  # as well
    psi0_in_gaps: Any = True

    @property
    def varying_psi0(self) -> Function | None:
        """Initial rotation that is a function of x1, whose kinks methods look for."""
        return None

    def arms(self, points: Array, normals: Array) -> Array:
        """Returns the places of the corners from the centre of their block, over its side: array (corners, n,
        2), in space (corners, n, 3), at points (lengths) with unit normals.
        """
        raise NotImplementedError

    def initial_rotation(self, x: Array) -> Array:
        """Returns what psi0 adds to the rotation of the blocks at x, array (n,) (radians)."""
        return np.zeros(np.shape(x))

    def places(self, points: Array, normals: Array) -> Array:
        """Returns the places of the corners from the contact point, the middle of the block's outer side,
        over the side: array (corners, n, 2). Here arms less ``N/2``, of ``N = n - psi0 t``.
        """
        turned = self.initial_rotation(points[:, 0])[:, None] * tangents(normals)
        return self.arms(points, normals) - (normals - turned) / 2

    def levers(self, x: Array) -> dict[str, Array]:
        """Returns the levers of (29) at x: {corner: array}, -2 times the arm along the surface."""
        arms = self.arms(*horizontal_surface(np.ravel(x)))[:, :, 0]
        return {name: -2 * arm.reshape(np.shape(x)) for name, arm in zip(self.corners, arms)}


class _Coulomb(Law, Checked):
    def __repr__(self) -> str:
        values = [(entry, getattr(self, entry.name)) for entry in fields(cast(Any, self))]
        unusual = [f"{entry.name}={value!r}" for entry, value in values if value != entry.default]
        return f"{type(self).__name__}({', '.join(unusual)})"


def _not_negative(friction: float) -> None:
    require_finite(friction=friction)
    require(friction >= 0, "friction", friction, "must be 0 or positive")


_coefficient = checked(_not_negative)


@dataclass(frozen=True, repr=False)
class Microblock(_Coulomb):
    """The microblock law of section 3: two corners at each point of the surface.

    Parameters
    ----------
    psi0 : float, callable or pair
        Initial rotation of the blocks (radians, counterclockwise), or a function of x1. In space a number is
        the rotation about -e2; a pair holds those about x1 and x2, each a number or a function of (x1, x2).
        On a tilted surface they are about the sides t1 and t2 of blocks (`Body`).
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
    friction: float = field(default=0.0, metadata=_coefficient)

    corners = ("A", "B")
    surface_corners = ("--", "-+", "+-", "++")

    def __post_init__(self) -> None:
        super().__post_init__()
        words = "must be 0 where psi0 is other than 0: the two corners of a block then slip differently"
        require(not self.friction or self.even, "friction", self.friction, words)
        if isinstance(self.psi0, tuple):
            require(len(self.psi0) == 2, "psi0", self.psi0, "must be a pair of rotations, about x1 and x2")
        for angle in self._angles:
            if not callable(angle):
                require_finite(psi0=angle)
                rotation(angle, np.zeros(1))

    @property
    def _angles(self) -> tuple[Any, ...]:
        """The rotation, or those about x1 and x2, each a number or a function."""
        if isinstance(self.psi0, tuple):
            return self.psi0
        return (self.psi0,)

    @property
    def even(self) -> bool:
        """Whether no block is rotated initially, so that left and right are mirror images."""
        return not callable(self.psi0) and self.psi0 == 0

    @property
    def psi0_in_gaps(self) -> bool:
        """Whether psi0 acts in gaps, not in levers alone."""
        return self.psi0_in == ACTS_IN[0]

    @property
    def varying_psi0(self) -> Function | None:
        if callable(self.psi0):
            return self.psi0
        return None

    @property
    def uniform(self) -> bool:
        """Whether psi0 is the same at all places."""
        return not any(map(callable, self._angles))

    def arms(self, points: Array, normals: Array) -> Array:
        """Returns (N + s.S)/2, (20), of ``S_i = e_i + psi0 x e_i`` and ``N = n + psi0 x n``, s = -1 for A and
        1 for B, over a surface s = (a, b) with a, b = -1, 1.
        """
        signs, tilt = self._signs_and_tilt(points)
        return in_frame(normals, (signs - tilt) / 2, (1 + np.sum(signs * tilt, axis=1)) / 2)

    def places(self, points: Array, normals: Array) -> Array:
        """Returns s.S/2, (20), with the initial rotation, psi0 where it acts in the gaps."""
        signs, tilt = self._signs_and_tilt(points)
        if points.shape[1] == 2:
            along_normals = signs[:, 0] * self.initial_rotation(points[:, 0]) / 2
        else:
            along_normals = np.sum(signs * tilt, axis=1) / 2 * self.psi0_in_gaps
        return in_frame(normals, signs / 2 + 0 * tilt, along_normals)

    def _signs_and_tilt(self, points: Array) -> tuple[Array, Array]:
        """Returns the signs s of the corners, array (corners, axes, 1), and the slopes of the outer sides of
        blocks at points, array (axes, n): psi0, or (-psi0_2, psi0_1) over a surface.
        """
        x = points[:, :-1].T
        if len(x) == 1:
            return np.array([[[-1.0]], [[1.0]]]), self.angle(x[0])[None]
        signs = np.array([(a, b) for a in (-1.0, 1.0) for b in (-1.0, 1.0)])
        if isinstance(self.psi0, tuple):
            tilt = -rotation(self.psi0[1], *x), rotation(self.psi0[0], *x)
        else:
            tilt = rotation(self.psi0, *x), np.zeros(x.shape[1])  # a number is the rotation about -e2
        return signs[:, :, None], np.array(tilt)

    def initial_rotation(self, x: Array) -> Array:
        """Returns psi0 at x, array (n,) (radians), where it acts in the gaps; else 0."""
        return self.angle(x) * self.psi0_in_gaps

    def angle(self, x: Array) -> Array:
        """Returns psi0 at x, array (n,) (radians); raises BadArgument if it is a pair, or not below 1."""
        words = "must be a number or a function of x1: a pair belongs to a HalfSpace"
        require(not isinstance(self.psi0, tuple), "psi0", self.psi0, words)
        return rotation(self.psi0, x)


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

    friction: float = field(default=0.0, metadata=_coefficient)

    surface_corners = ("C",)
    even = True
    uniform = True

    def arms(self, points: Array, normals: Array) -> Array:
        return np.zeros((1, *points.shape))

    places = arms


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


def rotation(psi0: Any, *x: Array) -> Array:
    """Returns psi0, a number or a function, at places: an array of their shape (radians); raises BadArgument
    if it fails, or is not below 1.
    """
    shape = np.shape(x[0])
    if not callable(psi0):
        angles = np.full(shape, float(psi0))
    else:
        angles = obstacles.evaluated(
            lambda *x: np.array(np.broadcast_to(real_numbers(psi0(*x)), shape)),
            *x,
            name="psi0",
            given=psi0,
            allowed="must take an array for each coordinate and return as many numbers",
        )
    words = "must be finite and below 1 in absolute value (radians): beyond it levers (41) change sign"
    require(np.all(np.abs(angles) < 1), "psi0", psi0, words)  # nor NaN
    return angles


def exact_slopes(law: Law, points: Array) -> Array | None:
    """Returns the slopes of the outer sides of blocks in the levers at points, array (axes, n), with all
    digits, where arms lose those of small ones; None of a law with arms of its own.
    """
    if isinstance(law, Microblock) and type(law).arms is Microblock.arms:
        return law._signs_and_tilt(points)[1]
    return None


def in_frame(normals: Array, along: Array, up: Array) -> Array:
    """Returns vectors from their components along the surface, array (corners, axes, n), and along its unit
    normals, array (corners, n): array (corners, n, dim).
    """
    if normals.shape[-1] == 3 and np.all(normals[..., 2] == 1):  # as of half-spaces, which have many blocks
        return np.stack((along[:, 0], along[:, 1], up), axis=-1)
    vectors = up[..., None] * normals
    for axis, side in enumerate(side_directions(normals)):
        vectors = vectors + along[:, axis, ..., None] * side
    return vectors


def side_directions(normals: Array) -> tuple[Array, ...]:
    """Returns the directions of the sides of blocks at unit normals, arrays (..., dim): along a line the
    tangent, over a surface t1 and t2.

    t1 and t2 are e1 and e2 turned with the surface, by the rotation that takes e3 to n the shortest way:
    ``t_i = e_i - n_i (n + e3)/(1 + n3)``. So t1 is the direction of x1 in the tangent plane where n1 or n2 is
    0, and a scene that is turned about e3 by a quarter has the same blocks. Where n = -e3 they are e1 and e2.
    """
    if normals.shape[-1] == 2:
        return (tangents(normals),)
    axes = np.eye(3)
    bisector = (normals + axes[2]) / np.maximum(1 + normals[..., [2]], np.finfo(float).tiny)
    return tuple(axis - normals[..., [i]] * bisector for i, axis in enumerate(axes[:2]))


def horizontal_surface(x: Array) -> tuple[Array, Array]:
    """Returns the points of x2 = 0 at x, and its normals, arrays (n, 2)."""
    points = np.column_stack((x, np.zeros(len(x))))
    return points, upwards(points)


def upwards(points: Array) -> Array:
    """Returns the normals of a horizontal surface at points, arrays (..., dim); in space views of one."""
    normals = np.broadcast_to(np.eye(points.shape[-1])[-1], points.shape)
    return normals if points.shape[-1] == 3 else normals.copy()


def tangents(normals: Array) -> Array:
    """Returns the unit tangents n x e3 of unit normals, arrays (..., 2)."""
    return np.stack((normals[..., 1], -normals[..., 0]), axis=-1)


def check(law: Any, in_space: bool = False) -> None:
    """Raises BadArgument unless this is a law, `in_space` one that is known there."""
    if isinstance(law, type):
        home = "mb." * law.__module__.startswith("microblock")
        raise BadArgument("law", law, f"must be an instance, {home}{law.__name__}()")
    words = (
        "must be a law, such as mb.Microblock() or mb.Unilateral(), or one of your own with "
        "microblock.model.law.Law as its base"
    )
    if not hasattr(law, "arms") or type(law).arms is Law.arms:
        words += ": it has no arms"
    require(isinstance(law, Law) and type(law).arms is not Law.arms, "law", law, words)
    if type(law) in BUILT_IN:
        if in_space and law.varying_psi0 is not None:
            words = "must be a number, or a pair of numbers or functions of (x1, x2), over a surface"
            raise BadArgument("psi0", law.psi0, words)
        return
    require(not in_space, "law", law, "must be Microblock, Unilateral or Microclamped over a surface")
    _check_corners(law)


def is_uniform(law: Law) -> bool:
    """Returns whether a law says that it is uniform, of the blocks that it has."""
    return bool(law.uniform) and _of_its_blocks(law, "uniform")


def is_even(law: Law) -> bool:
    """Returns whether a law says that it is even, of the blocks that it has."""
    return bool(law.even) and _of_its_blocks(law, "even")


def _of_its_blocks(law: Law, name: str) -> bool:
    """Returns whether no class derived from the one that has an attribute has functions of its own for what
    the blocks are.
    """
    kinds = type(law).mro()
    owner = next(kind for kind in kinds if name in vars(kind))
    geometry = {"arms", "places", "initial_rotation", "angle"}
    return not any(geometry & set(vars(kind)) for kind in kinds[: kinds.index(owner)])


def _check_corners(law: Law) -> None:
    """Raises BadArgument unless a user's law names its corners, and has arms and nothing beside them."""
    for name in ("clamps_rotation", "even", "uniform", "psi0_in_gaps"):
        value = getattr(law, name)
        require(isinstance(value, (bool, np.bool_)), "law", law, f"{name} must be True or False: {value!r}")
    _not_negative(law.friction)
    words = f"must name its corners, a tuple: {law.corners!r}"
    require(isinstance(law.corners, Collection), "law", law, words)
    names = tuple(law.corners)
    plain = all(isinstance(name, str) for name in names) and not {"full", "contact"} & {*names}
    words = f'must name its corners, each in another way and none "full" or "contact": {law.corners!r}'
    require(plain and len({*names}) == len(names) > 0, "law", law, words)
    for name in ("levers", "initial_gaps", "shifts"):
        words = f"must not have {name} of its own, which follow from its arms"
        require(getattr(type(law), name, None) is getattr(Law, name, None), "law", law, words)
    arms, places = (
        next(kind for kind in type(law).mro() if name in vars(kind)) for name in ("arms", "places")
    )
    words = f"has arms of its own and the places of {places.__name__}: give both, or take Law as base"
    require(places not in BUILT_IN or issubclass(places, arms), "law", law, words)
    words = "initial_rotation must return finite real numbers, an array (n,) at x, array (n,)"
    angles = obstacles.evaluated(law.initial_rotation, np.zeros(1), name="law", given=law, allowed=words)
    good = np.shape(angles) == (1,) and np.isrealobj(angles) and np.isfinite(angles).all()
    require(good, "law", law, f"{words}: {angles!r}")
    for name in ("arms", "places"):
        words = f"{name} must take points and normals, arrays (n, 2)"
        function = getattr(law, name)
        origin = horizontal_surface(np.zeros(1))
        vectors = obstacles.evaluated(function, *origin, name="law", given=law, allowed=words)
        good = (
            np.shape(vectors) == (len(names), 1, 2) and np.isrealobj(vectors) and np.isfinite(vectors).all()
        )
        words = f"{name} must return finite real numbers, an array (corners, n, 2): {vectors!r}"
        require(good, "law", law, words)
    sizes = [float(lever) for lever in law.levers(np.zeros(())).values()]
    words = f"must name its corners from left to right, the largest lever first: {sizes}"
    require(np.all(np.diff(sizes) <= 0), "law", law, words)


def require_shifts(law: Law, ell: float) -> None:
    """Raises BadArgument unless corners are everywhere as far from their contact point along the surface."""
    if type(law) in BUILT_IN:
        return
    along = law.places(*horizontal_surface(obstacles.scales(ell)))[:, :, 0]
    words = "must have its corners everywhere at one distance from the contact point: a Body takes others"
    require(np.ptp(along, axis=1).max() <= 1e-9, "law", law, words)


def require_pure_force(law: Law, ell: float) -> None:
    """Raises BadArgument where the only corner has a lever: half-planes then know no moment."""
    if len(law.corners) == 1:
        words = "has one corner with a lever: on a half-plane it must be 0, a Block or a Body takes any"
        (levers,) = law.levers(obstacles.scales(ell)).values()
        require(not levers.any(), "law", law, words)
