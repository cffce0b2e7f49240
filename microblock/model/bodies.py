"""Bodies that are given by a solid and a size or period."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TypeVar

from ..errors import Checked, checked, require_kind, require_positive
from .material import Cosserat
from .methods import Fitted, Uniform
from .summary import Row, Shown, Summary

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
