"""Types that signatures share: arrays, intervals and zones, and what obstacles, laws, bodies and methods have
to offer.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

if TYPE_CHECKING:
    from ..contact import Contact
    from .law import Microblock
    from .material import Cosserat
    from .solver import Solver
    from .summary import Summary

Array: TypeAlias = NDArray[np.float64]
AnyArray: TypeAlias = NDArray[Any]  # also complex
Flags: TypeAlias = NDArray[np.bool_]
Integers: TypeAlias = NDArray[np.intp]
Function: TypeAlias = Callable[[Array], Array]  # of abscissae, array (n,)
Tilt: TypeAlias = float | Callable[[AnyArray, AnyArray], ArrayLike]  # a rotation, or a function of (x1, x2)
Interval: TypeAlias = tuple[float, float]  # (left, right) of x1
Target: TypeAlias = "str | PathLike[str] | None"  # file of a figure
Zones: TypeAlias = dict[str, list[Interval]]  # by the name of the zone
CornerZones: TypeAlias = Mapping[int, Sequence[Interval]]  # by the number of the corner
ContactLike: TypeAlias = "Contact"  # as solvers, states and load paths see it, below the class
AngledLaw: TypeAlias = "Microblock"  # one whose psi0 is a function


class HasHeight(Protocol):
    """An obstacle that is an object."""

    def height(self, x: Array, /) -> ArrayLike:
        """Returns x2 of the lower surface at the abscissae x, array (n,); inf where there is no obstacle."""
        ...


ObstacleLike: TypeAlias = HasHeight | Callable[[Array], ArrayLike]


class LawLike(Protocol):
    """A contact law; `microblock.model.law.Law` documents its parts and has defaults for some of them."""

    @property
    def corners(self) -> tuple[str, ...]: ...

    @property
    def clamps_rotation(self) -> bool: ...

    @property
    def even(self) -> bool: ...

    def levers(self, x: Array) -> Mapping[str, Array]: ...

    def initial_gaps(
        self, points: Array, normals: Array, ell: float, obstacle: ObstacleLike
    ) -> Mapping[str, Array]: ...

    def initial_rotation(self, x: Array) -> Array: ...

    def shifts(self, ell: float) -> tuple[float, ...]: ...


class MethodLike(Protocol):
    """A method as the user names it; `solver` is a Solver class, or its dotted path below microblock."""

    @property
    def solver(self) -> str | type[Solver]: ...


class BodyLike(Protocol):
    """A body: its solid, and the classes of the methods that solve on it, the usual one first."""

    @property
    def solid(self) -> Cosserat: ...

    @property
    def methods(self) -> Sequence[type[MethodLike]]: ...

    def of(self, solid: Cosserat) -> BodyLike:
        """Returns the same body of another solid."""
        ...

    def summary(self) -> Summary: ...
