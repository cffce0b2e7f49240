"""Contact problems on a line, drawn or named, and what verifies them: panels of another kind for the
half-plane, the half-plane for elements.

Units: E* = 20 and R = 10, so that at the load pi/2 the half-width of Hertz is 1.
"""

from dataclasses import dataclass

import numpy as np

import microblock as mb
from microblock.corners import active_set
from microblock.errors import MicroblockError, NotConverged
from microblock.model.zones import runs, zone_edges

from ..common.three_ways import seen
from . import reference_line as judge

LOAD, RADIUS = np.pi / 2, 10.0
SLOPE = 0.02  # of wedges
ORDERS = 8, 12, 14  # refinement levels of the reference; the last one verifies
BELIEVED = 1e-7  # largest violation of (26) of a reference
START = 1e-3  # rtol of the solver's zones from which the reference starts
# of the grids from which it starts where the solver has none, or wrong ones
CELLS = 200, 600
HALF_PLANES = 1e-8, 1e-7, 1e-6  # rtol of the half-plane that verifies elements, the first that it reaches
ACTS_IN = {"gap": "gaps and levers", "lever": "levers"}  # where psi0 acts, by the word of the records


@dataclass(frozen=True)
class Draw:
    """One contact: kind and parameters as drawn (psi0 times R/a_Hz; for wedges the half-width over ell)."""

    kind: str
    contact: str
    alpha: float
    nu: float
    beta: float
    psi0: float = 0.0
    reading: str = "gap"
    width: float | None = None

    def problem(self):
        """The `Contact` of this draw."""
        law = {
            "microblock": mb.Microblock(self.psi0 / RADIUS, ACTS_IN[self.reading]),
            "unilateral": mb.Unilateral(),
            "microclamped": mb.Microclamped(),
        }[self.contact]
        stiffness = 2 * RADIUS if self.width is None else LOAD / (SLOPE * self.width * self.alpha)  # E*
        obstacle = mb.Cylinder(RADIUS) if self.width is None else mb.Wedge(SLOPE)
        solid = mb.Cosserat(E=stiffness * (1 - self.nu**2), nu=self.nu, ell=self.alpha, beta=self.beta)
        return mb.Contact(mb.HalfPlane(solid), obstacle, law)


def reference(problem, load=LOAD, orders=ORDERS):
    """(reference, its own error) of a problem at a load: the last two of its refinement levels, on zones on
    which (26) hold.

    Raises
    ------
    NotConverged
        If none is found.
    """
    setting, complaint = judge.Problem(problem, load), "no zones to start from"
    for start in (_zones_of_solver, *(_zones_of_grid(cells) for cells in CELLS)):
        try:
            zones = {
                corner: list(pairs)
                for corner, pairs in start(problem, load).items()
                if corner in setting.corners
            }
            *_, coarse, fine = judge.fit(setting, zones, orders)
        except (MicroblockError, ArithmeticError, ValueError, np.linalg.LinAlgError) as failure:
            complaint = str(failure)
            continue
        violation = judge.violation(fine)
        if violation < BELIEVED:
            return fine, judge.distance(
                judge.fields(coarse), judge.fields(fine), judge.breaks([coarse, fine])
            )
        complaint = f"(26) violated by {violation:.1e}"
    raise NotConverged(f"no reference: {complaint}")


def _zones_of_solver(problem, load):
    return problem.solve(load=load, rtol=START).solution.all_zones


def _zones_of_grid(cells):
    """A function: problem and load -> zones {corner: [(left, right), ...]} of the closed cells of a grid."""

    def zones(problem, load):
        law = problem.law
        reach = 1.6 if problem.solver.symmetric and isinstance(problem.obstacle, mb.Cylinder) else 3.0
        reach = reach + 2 * problem.solid.ell
        for _ in range(3):
            x = np.linspace(-reach, reach, cells + 1)
            compliance = problem.body.compliance(x, law.clamps_rotation)
            system = compliance.corner_system(law, problem.obstacle)
            state = active_set.solve(system[0], system[1], load=load, c=system[2])
            closed = state.closed.reshape(len(law.corners), -1)
            reach = min(reach, 1.2 * np.abs(x[closed.any(axis=0)]).max() + 3 * (x[1] - x[0]))
        half = (x[1] - x[0]) / 2
        found = {}
        for corner, flags in enumerate(closed):
            # the corners set apart by a hair: coinciding edges are one break too few
            hair = (0.1 + 0.2 * corner) * half
            found[corner] = [(x[i] - half + hair, x[j] + half - hair) for i, j in runs(flags)]
        return found

    return zones


def error(state, fine):
    """max(|dp|, |dM|/ell)/|p| in L2 of a State against the reference.

    By tanh-sinh between all edges and breaks of either; M of microclamped states, which are known at their
    own points only, by those.
    """
    panels, law = fine.panels, state.law
    places = {
        sign * x for sign in (1, -1) for x in (*panels.e, *(panels.e + panels.h), *zone_edges(state.zones))
    }
    turning = 0.0
    if law.clamps_rotation:
        wrong = state.micromoment / state.solid.ell - fine.micromoment(state.x)
        turning = np.sqrt(state.weights @ wrong**2 / (state.weights @ state.pressure**2))

    def without_moment(fields):
        return lambda x: (fields(x)[0], 0 * x)

    pair = seen(state), judge.fields(fine)
    if law.clamps_rotation:
        pair = map(without_moment, pair)
    return max(float(turning), judge.distance(*pair, sorted(places)))


def half_plane(problem):
    """The half-plane's state at the smallest rtol of HALF_PLANES that it reaches, and its error; NotConverged
    if none.
    """
    for rtol in HALF_PLANES:
        try:
            state = problem.solve(load=LOAD, rtol=rtol)
            return state, state.error_estimate
        except NotConverged as failure:
            objection = failure
    raise objection


def error_of_elements(state, true):
    """Relative L2 distance of a block's State to a half-plane's, between edges, kinks and ends of facets."""
    facets = [end for left, right, _ in state.solution.body.interpolation for end in (left, right)]
    edges, half = zone_edges(state.zones) + zone_edges(true.zones), state.solid.ell / 2
    kinks = [kink + shift for kink in getattr(state.obstacle, "kinks", ()) for shift in (half, 0, -half)]
    outermost = max(map(abs, edges))
    places = {sign * x for x in (*facets, *edges, *kinks) for sign in (1, -1) if abs(x) <= 1.01 * outermost}
    return judge.distance(seen(state), seen(true), sorted(places))
