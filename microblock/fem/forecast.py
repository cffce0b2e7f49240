"""What finite elements are expected to take."""

from .. import cost
from ..errors import require
from ..halfplane.forecast import likely_zones
from ..model.solver import Solver
from ..model.zones import common, zone_edges
from .fitted_mesh import along_surface


def fitted_cost(solver, load, rtol):
    """The Cost of a FittedSolver with a picture to rtol; BadArgument for zones beyond the body."""
    likely, inside = likely_zones(solver.problem, solver.picture), [(-solver.furthest, solver.furthest)]
    zones = {corner: common(own, inside) for corner, own in likely.items()}
    if not any(zones.values()):
        raise solver.unsettled(load, likely, 0)
    ground, parts = solver.surface(zones)
    tips = {*solver.features(ground), *zone_edges(zones)}
    order, depth = solver.levels(rtol, even=False)[:2][-1]
    # a mesh has some 6 elements for one at the surface, with 1.2 unknowns for each pair of orders
    return cost.of("fitted", 7 * order**2 * along_surface(tips, parts, depth))


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
