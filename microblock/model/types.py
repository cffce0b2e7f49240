"""Types that signatures share."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

if TYPE_CHECKING:
    import matplotlib.axes
    import matplotlib.figure


Array: TypeAlias = NDArray[np.float64]
AnyArray: TypeAlias = NDArray[Any]  # also complex
Flags: TypeAlias = NDArray[np.bool_]
Integers: TypeAlias = NDArray[np.intp]
Function: TypeAlias = Callable[[Array], Array]  # of abscissae, array (n,)
Tilt: TypeAlias = float | Callable[[AnyArray, AnyArray], ArrayLike]  # a rotation, or a function of (x1, x2)
Interval: TypeAlias = tuple[float, float]  # (left, right) of x1
Axes: TypeAlias = "matplotlib.axes.Axes"
Figure: TypeAlias = "matplotlib.figure.Figure"
Target: TypeAlias = "str | PathLike[str] | None"  # file of a figure
Zones: TypeAlias = dict[str, list[Interval]]  # by the name of the zone
ZoneErrors: TypeAlias = "dict[str, list[Interval] | None]"  # of the left and right ends, by the zone's name
CornerZones: TypeAlias = Mapping[int, Sequence[Interval]]  # by the number of the corner


class HasHeight(Protocol):
    """An obstacle that is an object."""

    def height(self, x: Array, /) -> ArrayLike:
        """Returns x2 of the lower surface at x, array (n,), or inf."""


ObstacleLike: TypeAlias = HasHeight | Callable[[Array], ArrayLike]
