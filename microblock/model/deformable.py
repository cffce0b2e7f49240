"""A counter-body: an obstacle that deforms."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from numpy.typing import ArrayLike

from ..errors import BadArgument, require
from .bodies import BodyLike, offered_by, over_surface, require_body
from .obstacles import RigidObstacle, as_obstacle, asks_another, check
from .types import ObstacleLike


@dataclass(frozen=True)
class Deformable(RigidObstacle):
    """Second body that is pressed on the first, as an obstacle that deforms.

    Its surface is smooth: it takes pressures and no moments. Each corner presses it where the corner stands,
    A at x1 - ell/2 and B at x1 + ell/2, the four of a cube at x1 -+ ell/2 and x2 -+ ell/2.

    Parameters
    ----------
    body : HalfPlane, HalfSpace or Body
        The second body, of the kind of the first, also classical (``beta=0``) if unbounded. A `Body` lies
        above its contact boundary.
    shape : obstacle or callable, optional
        Its lower surface before it deforms. Under a `Body` with a shape the contact boundary is straight and
        horizontal, and spans all corners below the shape. Without a shape it is the contact boundary of the
        `Body`, curved and tilted as it is: gaps are distances along the normals of the first body.

    Raises
    ------
    BadArgument
        If the body is none, or the shape no obstacle over it, or left out of a body without a mesh.

    Examples
    --------
    >>> solid = mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1)
    >>> steel = mb.Cosserat(E=200, nu=0.3, ell=0.1, beta=0)
    >>> roller = mb.Deformable(mb.HalfPlane(steel), mb.Cylinder(R=10))
    >>> problem = mb.Contact(mb.HalfPlane(solid), roller, mb.Microblock())
    >>> round(problem.solve(load=1.0).half_width, 2)      # 0.36 under a rigid cylinder
    0.45
    """

    body: BodyLike
    shape: ObstacleLike | None = None

    def __post_init__(self) -> None:
        require_body(self.body)
        given = self.shape is not None or offered_by(self.body).surface is not None
        words = f"must be given: a {type(self.body).__name__} has no mesh, whose surface would be the shape"
        require(given, "shape", self.shape, words)
        words = "must be that of the body, and is another body"
        require(not isinstance(self.shape, Deformable), "shape", self.shape, words)
        try:
            check(shape_of(self), over_surface(self.body))
        except BadArgument as failure:
            if failure.name != "obstacle":  # but what the shape says of itself
                raise
            raise BadArgument("shape", self.shape, failure.allowed) from failure

    @property
    def height(self) -> Callable[..., ArrayLike]:
        return shape_of(self).height


def _of_shape(obstacle: Deformable, name: str) -> Any:
    """Returns what the shape of a second body says."""
    return getattr(shape_of(obstacle), name)


asks_another(Deformable, _of_shape)


def shape_of(obstacle: ObstacleLike) -> RigidObstacle:
    """Returns the rigid shape of an obstacle."""
    if not isinstance(obstacle, Deformable):
        return as_obstacle(obstacle)
    surface = offered_by(obstacle.body).surface
    if obstacle.shape is None and surface is not None:
        return as_obstacle(surface())
    return as_obstacle(obstacle.shape)


def body_of(obstacle: ObstacleLike) -> Any:
    """Returns the second body, None of a rigid obstacle."""
    if isinstance(obstacle, Deformable):
        return obstacle.body
    return None


def second_solid(obstacle: ObstacleLike) -> Any:
    """Returns the solid of the second body, None of a rigid obstacle."""
    if isinstance(obstacle, Deformable):
        return obstacle.body.solid
    return None


def require_same_kind(body: BodyLike, obstacle: ObstacleLike) -> None:
    """Raises BadArgument unless both bodies meet obstacles over a line, or both over a surface."""
    second = body_of(obstacle)
    if second is None:
        return
    kinds = {True: "surface", False: "line"}
    words = (
        f"has a second body, a {type(second).__name__}, that meets obstacles over a "
        f"{kinds[over_surface(second)]}, and a {type(body).__name__} meets them over a "
        f"{kinds[over_surface(body)]}: take two of one kind"
    )
    require(over_surface(second) == over_surface(body), "obstacle", obstacle, words)
