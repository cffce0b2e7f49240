"""A hole with a pin in it."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from ..errors import Checked, checked, require, require_numbers, require_positive
from ..model.obstacles import RigidObstacle
from ..model.types import Array, Interval


@dataclass(frozen=True)
class Bore(RigidObstacle, Checked):
    """Circular hole around a body in the plane, a pin for instance; loads press its upper wall on the body.

    Gaps are the distances to the wall along the normals of the body, so that the contact may turn through
    nearly 90 degrees to either side, where heights end at 60. The contact boundary is the upper half of the
    body. The wall goes up to it where the clearance is small: contacts are then conforming.

    Parameters
    ----------
    R : float
        Radius (length).
    centre : (float, float)
        Place of its centre (lengths).

    Raises
    ------
    BadArgument
        If the radius is not positive, or the centre no pair of numbers.

    Examples
    --------
    >>> from microblock.fem.bore import Bore
    >>> hole = Bore(R=1.1, centre=(0.0, 0.0))
    >>> side = np.array([[0.8, 0.6]])      # on a pin of radius 1, its normal as well
    >>> hole.normal_gap(side, side).round(12).tolist(), hole.height(np.array([0.0, 2.0])).tolist()
    ([0.1], [1.1, inf])
    """

    R: float = field(metadata=checked(require_positive))
    centre: Interval = (0.0, 0.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        place = require_numbers(centre=self.centre)
        require(place.shape == (2,), "centre", self.centre, "must be a pair of numbers, x1 and x2")

    def height(self, x: ArrayLike) -> Array:
        """Returns the height of the upper wall at x, array (n,) (lengths); inf beside the hole."""
        square = self.R**2 - (np.asarray(x, float) - self.centre[0]) ** 2
        return np.where(square >= 0, self.centre[1] + np.sqrt(np.maximum(square, 0.0)), np.inf)

    def normal_gap(self, points: Array, normals: Array) -> Array:
        """Returns the distances s, array (n,), at which ``|x + s n - centre| = R`` (lengths), of points x
        with unit normals n, arrays (n, 2), below 0 outside of the hole; inf where n misses it.
        """
        offset = points - np.array(self.centre)
        along = np.sum(offset * normals, axis=1)
        across = np.sum(offset**2, axis=1) - along**2
        return np.where(across <= self.R**2, np.sqrt(np.maximum(self.R**2 - across, 0.0)) - along, np.inf)
