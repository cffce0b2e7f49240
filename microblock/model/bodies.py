"""Bodies that are given by a solid and a size or period, and what a body of a user's own offers."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Protocol, TypeVar

from ..errors import BadArgument, Checked, checked, require, require_positive
from .material import Cosserat, require_number_solid
from .methods import Fitted, MethodLike, Uniform, offered

AnyBody = TypeVar("AnyBody", bound="OfSolid")


class BodyLike(Protocol):
    """A body of one solid."""

    @property
    def solid(self) -> Cosserat:
        """The solid of the body."""

    @property
    def methods(self) -> Sequence[type[MethodLike]]:
        """The methods that solve on it, the usual one first."""


@dataclass(frozen=True)
class BodyAttributes:
    """What a body may offer beside its `solid` and its `methods`, with defaults.

    1. A body is any object with a `solid`, a Cosserat, and `methods`, a tuple of method classes that solve on
       it, the usual one first; see `microblock.model.methods`.
    2. What it does not have of the attributes below is as here.
    3. `microblock.model.methods.GivenCompliance` asks it besides for ``compliance(clamped)``, a
       `microblock.contact_solvers.compliance.Compliance`.

    Attributes
    ----------
    of : callable or None
        ``of(solid)`` returns the same body of another solid, for sliders and ``with_(solid=...)``.
    in_space : bool
        Whether obstacles have heights over a surface, functions of (x1, x2).
    solvers : dict
        {method class: Solver}, in place of the solvers that methods name.
    period : float or None
        Length after which the surface repeats.
    mesh : Mesh or None
        Of a body on a mesh, which has a length by itself.
    surface : callable or None
        ``surface()`` returns its contact boundary as an obstacle: the shape of a second body without another.
    """

    of: Callable[[Cosserat], Any] | None = None
    in_space: bool = False
    solvers: Mapping[type, Any] = field(default_factory=dict)
    period: float | None = None
    mesh: Any = None
    surface: Callable[[], Any] | None = None


def offered_by(body: Any) -> BodyAttributes:
    """Returns what a body offers."""
    return offered(body, BodyAttributes)


@dataclass(frozen=True)
class OfSolid(Checked):
    """Base of bodies that a solid and numbers give."""

    solid: Cosserat = field(metadata=checked(require_number_solid))

    def of(self: AnyBody, solid: Cosserat) -> AnyBody:
        """Returns the same body of another solid."""
        return replace(self, solid=solid)


@dataclass(frozen=True)
class Unbounded(OfSolid):
    """Base of bodies without an end, of a solid and a period (or None)."""

    period: float | None = field(default=None, metadata=checked(require_positive))


@dataclass(frozen=True)
class Block(OfSolid):
    """A block, x1 from -size to size and x2 from -size to 0, whose bottom is constrained; the program makes
    its mesh.

    Parameters
    ----------
    solid : Cosserat
    size : float
        Half of its width, and its depth (length). With inf it is a half-plane, cut off where that is a small
        part of rtol.

    Raises
    ------
    BadArgument
        If the solid is no Cosserat, or the size no positive number.

    Examples
    --------
    >>> solid = mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1)
    >>> problem = mb.Contact(mb.Block(solid, 10.0), mb.Cylinder(R=10), mb.Microblock())
    >>> state = problem.solve(load=1.0, rtol=1e-2)
    >>> state.error_estimate <= 1e-2, state.approach > 0
    (True, True)
    """

    size: float = math.inf

    methods = (Fitted, Uniform)

    def __post_init__(self) -> None:
        super().__post_init__()
        if not (isinstance(self.size, float) and self.size == math.inf):
            require_positive(size=self.size)


def require_body(body: Any) -> None:
    """Raises BadArgument unless this is a body."""
    lacking = [name for name in ("solid", "methods") if _is_nothing(getattr(body, name, None))]
    if lacking or isinstance(body, type):
        words = "must be a HalfPlane, a HalfSpace, a Block or a Body (mb.HalfPlane(solid)?)"
        raise BadArgument("body", body, words + "".join(f": it has no {name}" for name in lacking[:1]))
    require_number_solid(solid=body.solid)
    methods = body.methods
    classes = isinstance(methods, (tuple, list)) and all(isinstance(method, type) for method in methods)
    require(classes, "methods", methods, "must be a tuple of method classes, as (mb.Panels, mb.Cells)")
    period = offered_by(body).period
    if period is not None:
        require_positive(period=period)


def _is_nothing(part: Any) -> bool:
    return part is None or (isinstance(part, (tuple, list)) and not part)


def over_surface(body: Any) -> bool:
    """Returns whether obstacles have heights over a surface."""
    return bool(getattr(body, "in_space", BodyAttributes.in_space))
