"""What finite elements are expected to take."""

import math

import numpy as np

from .. import cost
from ..errors import require
from ..model.picture import low
from ..model.solver import Solver


def fitted_cost(picture, corners, rtol):
    """The Cost of fitted meshes under a picture."""
    # edges of zones and slope discontinuities have elements that shrink towards them; more where corners
    # meet them apart
    valleys, kinks = (np.count_nonzero(low(picture, x)) for x in (picture.minima, picture.kinks))
    places = (3 + corners) / 4 * max(valleys, 1) + (1.4 * corners - 0.6) * kinks
    return cost.of("fitted", 370 * places * math.log10(rtol) ** 2)


class OnGivenMesh(Solver):
    """Base of solvers of a body on its mesh.

    Attributes
    ----------
    refines : bool, whether it makes finer ones to an rtol
    no_rtol : str, why it does not
    rate : str, of `cost.RATES`, in the plane
    """

    verifies, refines, rate = True, False, "condensed"

    def require_given_mesh(self, rtol):
        """BadArgument for an rtol that no mesh is refined to."""
        require(rtol is None or self.refines, "rtol", rtol, self.no_rtol)

    def predicted(self, load, approach, rtol):
        self.require_given_mesh(rtol)
        unknowns = self.body.unknowns
        if rtol is not None:  # errors of recovery fall like the elements of edges and of the surface
            unknowns = max(unknowns, 600 / rtol)
        return cost.of(self.rate + " in space" * self.body.in_space, unknowns)
