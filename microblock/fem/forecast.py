"""What finite elements are expected to take."""

from .. import cost
from ..halfplane.forecast import likely_zones
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


def body_cost(method, body):
    """The Cost of a method on the mesh of a body."""
    unknowns = body.space.FreeDofs().NumSet()
    return cost.of(f"{method} in space" if body.in_space else method, unknowns)


def refined_cost(body, obstacle, rtol):
    """The Cost of meshes that are cut from that of a body on, to rtol."""
    # recovery errs like the elements at the surface, and cuts those at slope discontinuities again and again
    kinks = len(getattr(obstacle, "kinks", ()))
    return cost.of("refined", max(body.space.FreeDofs().NumSet(), 200 / rtol + 600 * kinks))
