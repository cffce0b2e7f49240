"""Bodies that are given by a solid and a size alone."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..errors import make_plain, require_kind, require_positive
from .material import Cosserat
from .methods import Fitted, Uniform
from .summary import Row, Shown, Summary


@dataclass(frozen=True, repr=False)
class Block(Shown):
    """A square block, x1 from -size to size and x2 from -size to 0, whose bottom is constrained; the program
    makes its mesh.

    Parameters
    ----------
    solid : Cosserat
    size : float
        Half of its width, and its depth (length). With inf the block stands for the half-plane, cut off so
        far away that the error of that is a small part of rtol.

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

    solid: Cosserat
    size: float = math.inf

    methods = (Fitted, Uniform)

    def __post_init__(self) -> None:
        make_plain(self)
        require_kind(Cosserat, "a Cosserat", solid=self.solid)
        if not (isinstance(self.size, float) and self.size == math.inf):
            require_positive(size=self.size)

    def of(self, solid: Cosserat) -> Block:
        """Returns the same block of another solid."""
        return Block(solid, self.size)

    def summary(self) -> Summary:
        """Returns size and moduli, for a notebook."""
        words = "half-plane by finite elements" if self.size == math.inf else f"block of size {self.size:g}"
        return Summary("Block", words, (Row("size", "", self.size, "length"), *self.solid.summary().rows))
