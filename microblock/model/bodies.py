"""Bodies that are given by a solid and a size or period, and what a body of a user's own offers.

A body is any object with these attributes; `docs/howto/extend.md` has one.

solid      Cosserat
methods    tuple of method classes that solve on it, the usual one first; see `microblock.model.methods`
of         optional, ``of(solid)``: the same body of another solid, for sliders and ``with_(solid=...)``
summary    optional, ``summary()``: the `Summary` that a terminal and a notebook show
in_space   optional, True where obstacles have heights over a surface; then ``check(obstacle)`` raises
           BadArgument for others
solvers    optional, {method class: Solver}, in place of the solvers that methods name

`GivenCompliance` asks besides for ``compliance(clamped)``, a `microblock.corners.compliance.Compliance`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

from ..errors import BadArgument, Checked, checked, require_kind, require_positive
from . import obstacles
from .material import Cosserat
from .methods import Fitted, Uniform
from .summary import Row, Shown, Summary, short

AnyUnbounded = TypeVar("AnyUnbounded", bound="Unbounded")


@dataclass(frozen=True, repr=False)
class Unbounded(Checked, Shown):
    """Base of bodies without an end, of a solid and a period (or None)."""

    solid: Cosserat = field(metadata=checked(require_kind, Cosserat, "a Cosserat"))
    period: float | None = field(default=None, metadata=checked(require_positive))

    def of(self: AnyUnbounded, solid: Cosserat) -> AnyUnbounded:
        """Returns the same body of another solid."""
        return replace(self, solid=solid)

    def summary(self) -> Summary:
        moduli = self.solid.summary()
        rows = (
            moduli.rows if self.period is None else (Row("period", "", self.period, "length"), *moduli.rows)
        )
        return replace(moduli, title=type(self).__name__, rows=rows)


@dataclass(frozen=True, repr=False)
class Block(Checked, Shown):
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

    solid: Cosserat = field(metadata=checked(require_kind, Cosserat, "a Cosserat"))
    size: float = math.inf

    methods = (Fitted, Uniform)

    def __post_init__(self) -> None:
        super().__post_init__()
        if not (isinstance(self.size, float) and self.size == math.inf):
            require_positive(size=self.size)

    def of(self, solid: Cosserat) -> Block:
        """Returns the same block of another solid."""
        return Block(solid, self.size)

    def summary(self) -> Summary:
        words = "half-plane by finite elements" if self.size == math.inf else f"block of size {self.size:g}"
        return Summary("Block", words, (Row("size", "", self.size, "length"), *self.solid.summary().rows))


def require_body(body: Any) -> None:
    """Raises BadArgument unless this is a body."""
    lacking = [name for name in ("solid", "methods") if not hasattr(body, name)]
    if lacking or isinstance(body, type):
        words = "must be a HalfPlane, a HalfSpace, a Block or a Body (mb.HalfPlane(solid)?)"
        raise BadArgument("body", body, words + "".join(f": it has no {name}" for name in lacking[:1]))


def over_surface(body: Any) -> bool:
    """Returns whether obstacles have heights over a surface."""
    return bool(getattr(body, "in_space", False))


def require_over(body: Any, obstacle: Any) -> None:
    """Raises BadArgument unless the obstacle has heights over the body's line or surface."""
    (body.check if over_surface(body) else obstacles.check)(obstacle)


def summary_of(body: Any) -> Summary:
    """Returns what is shown of a body, of one without a summary its name."""
    return body.summary() if hasattr(body, "summary") else Summary(type(body).__name__, short(body))
