"""What finite elements are expected to take."""

import math

import numpy as np

from .. import cost
from ..model.picture import low


def fitted_cost(picture, corners, rtol):
    """The Cost of fitted meshes under a picture."""
    # edges of zones and slope discontinuities have elements that shrink towards them; more where corners
    # meet them apart
    valleys, kinks = (np.count_nonzero(low(picture, x)) for x in (picture.minima, picture.kinks))
    places = (3 + corners) / 4 * max(valleys, 1) + (1.4 * corners - 0.6) * kinks
    return cost.of("fitted", 370 * places * math.log10(rtol) ** 2)


def body_cost(method, body, rtol):
    """The Cost of a method on a body's mesh, or on finer ones to rtol."""
    unknowns = body.space.FreeDofs().NumSet()
    if rtol is not None:  # errors of recovery fall like the elements of edges and of the surface
        unknowns = max(unknowns, 600 / rtol)
    return cost.of(f"{method} in space" if body.in_space else method, unknowns)
