"""What finite elements are expected to take."""

import math

import numpy as np

from .. import cost
from ..errors import require
from ..halfplane.forecast import likely_zones
from ..model.solver import Solver
from ..model.zones import common
from .fitted_mesh import LAYERS, along_surface
from .meshes import RATIO, lowest_order


def fitted_cost(solver, load, rtol):
    """The Cost of a FittedSolver with a picture to rtol; BadArgument for zones beyond the body."""
    likely, inside = likely_zones(solver.problem, solver.picture), [(-solver.furthest, solver.furthest)]
    zones = {corner: common(own, inside) for corner, own in likely.items()}
    if not any(zones.values()):
        raise solver.unsettled(load, likely, 0)
    ground, parts = solver.surface(zones)
    even, kinks, longest = solver.options.even, solver.features(ground), max(length for *_, length in parts)
    # of two corners one is open beside an edge, the width of a layer
    inward = LAYERS * solver.solid.layer_length * (len(solver.law.corners) > 1)
    edges = np.ravel([(left + inward, right - inward) for own in zones.values() for left, right in own])
    tips = np.unique([*kinks, *(np.abs(edges) if ground.half else edges)])
    _, *levels = solver.levels(rtol, even)
    top, depth = next((own for own in levels if not kinks or RATIO ** (own[1] / 2) <= rtol), levels[-1])
    # netgen makes some 6 triangles for an element at the surface, and 18, on a half 9 of them, for each e-fold
    # of lengths: to the far field, and down to the distance of two tips; around a tip a level has 2.7
    # quadrilaterals. A triangle of order p has p^2/2 unknowns of a field, a quadrilateral p^2
    near = 6 * (along_surface((), parts, 0) + len(solver._sizes(ground, longest)) / 2)
    folds = math.log(ground.far / max(map(abs, ground.reach))) / (1 + ground.half)
    folds += np.log(np.maximum(longest / np.diff(tips), 1)).sum()
    lowest = top if even else lowest_order(top)
    falling = (top**2 + top * lowest + lowest**2) / 3
    return cost.of("fitted", 1.5 * (near * top**2 + (18 * folds + 5.4 * depth * len(tips)) * falling))


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
        if rtol is None:
            return cost.of(self.rate + " in space" * self.body.in_space, unknowns)
        # recovery errs like the elements at the surface, and cuts those at kinks again and again
        kinks = len(getattr(self.obstacle, "kinks", ()))
        return cost.of("refined", max(unknowns, 200 / rtol + 600 * kinks))
