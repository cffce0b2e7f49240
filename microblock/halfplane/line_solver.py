"""A state of a half-plane at one load on fitted panels: trial zones, edges by Newton's method, the conditions
looked at everywhere, and higher orders until the estimate holds.

1. Trial zones: a neighbour's, the classical contact's, those of a few cells; under an obstacle that is not
simple, and where
   these do not fit, graded cells on all of the surface that could touch, finer from round to round.
2. The edges move until the pressure vanishes there (`contact_line.fit`).
3. The state is surveyed (`survey`): what overlaps is added to the zones, what is in tension is taken out,
until nothing does.
4. The order of the panels rises until two neighbours agree; what the edges, the kernel's table and the
violations that are
   left are worth stands beside that in the estimate.
"""

from dataclasses import dataclass, replace

from ..errors import NotConverged
from ..model.problem import Problem, half_line
from ..model.refinement import refine
from . import contact_line, panel_solution, topology
from .graded_cells import of_corners, trial_zones
from .survey import survey

ORDERS = (6, 10, 14, 18, 22, 26)
FIXED_ORDER_EDGES = 1e-9  # tolerance of the edges where the order is fixed: rounding
CROSSINGS = 6  # of edges of the two corners, in one fit
AMENDMENTS = 8  # of zones that a fitted state shows wrong
EDGE_SHARE = 0.1  # of rtol, to which the edges are driven
COARSE_SHARE = 0.5  # the same of the coarser of two orders: the distance between the two has it
# {order: (rtol below which its distance to the next order is hardly ever: under cylinders that is 3e-5 to
# 3e-4, 1e-7 to 1e-6, 7e-10 to 5e-9; how far edges are driven on it where less is asked for: the next step
# leaves about the square of that)}
ON_THE_WAY = {6: (1e-4, 1e-2), 10: (5e-7, 7e-4), 14: (4e-9, 6e-5)}
SHORT_CUT = 14  # order from which on edges come by two orders on the way
CONDITIONS_SHARE = 0.3  # of rtol, above which a violation changes the zones
# cells: opposite edges of the two corners this near to each other may be joined or apart
MEETING = 4.0
# of the edges, from a neighbour's on: if there are more the coarse grid is the shorter way
NEAR_STEPS = 5
AMPLE = 0.03  # of rtol: a neighbour as good as that had more order than needed


class LooksTooNear(Exception):
    """Something beyond the obstacle's picture could touch: look farther."""


@dataclass(frozen=True)
class LineSolver:
    """Of one Problem, with its picture, on one half-plane, at one load (force per thickness)."""

    problem: Problem
    body: object
    load: float

    def solve(self, rtol, order=None, near=None):
        """The PanelSolution to rtol, or of a fixed order, from a neighbour on if there is one.

        Raises
        ------
        NotConverged
            With `rtol_reached`, the best estimate, if zones exist but rtol is out of reach; else no zones
            fit.
        """
        allowed = ORDERS if order is None else (order,)
        edges, conditions = (
            (EDGE_SHARE * rtol, CONDITIONS_SHARE * rtol) if order is None else (FIXED_ORDER_EDGES, 0.0)
        )
        failure = None
        for zones, orders in self._trials(near, allowed, rtol):
            try:
                if order is None and self.problem.picture.simple:
                    state = self._looked_at_last(zones, orders, rtol, edges, conditions)
                    if state is not None:
                        return state
                states = self._on(zones, orders, edges, conditions)
                return states[order] if order is not None else self._climb(states, rtol, edges, conditions)
            except NotConverged as objection:
                if objection.rtol_reached is not None:  # on zones that hold: others are none
                    raise
                failure = objection
        raise NotConverged(f"no zones fit at load {self.load:g}: {failure}")

    def _trials(self, near, allowed, rtol):
        """Zones and orders to try, the likely ones first: next to coalescence a coarse one may fit neither
        side.
        """
        problem, load = self.problem, self.load
        if near:  # if they do not fit at once, a coarse grid is the shorter way
            yield near.zones, _orders_of(near, rtol) if len(allowed) > 1 else allowed
        simple = problem.picture.simple
        orders = allowed[:2] if simple or len(allowed) == 1 else allowed[1:3]
        if half_line(problem):
            yield from ((topology.classical(problem, load), (order,)) for order in orders)
        if simple:
            yield from self._seen_by_cells(orders, topology.CELLS[:1])
        for zones, cell in list(trial_zones(problem, load))[::-1]:  # the smallest cells first
            found = topology.set_apart(problem, of_corners(problem, zones), cell)
            others = topology.variants(problem, found, MEETING * cell)
            yield from ((each, (order,)) for order in orders for each in others)
        yield from self._seen_by_cells(orders, topology.CELLS[1:] if simple else topology.CELLS)

    def _seen_by_cells(self, orders, counts):
        for cells in counts:
            variants = topology.variants(
                self.problem, topology.coarse(self.problem, self.body, self.load, cells)
            )
            yield from ((zones, (order,)) for order in orders for zones in variants)

    def _looked_at_last(self, zones, orders, rtol, edges, conditions):
        """The state to rtol under a simple obstacle, looked at everywhere at its last order; None where that
        does not do.
        """
        before, first = _on_the_way(orders, rtol)
        try:
            for order in before:
                zones = self._fit(zones, order, ON_THE_WAY[order][1]).further
            coarse = self._fit(zones, first, COARSE_SHARE * rtol)
            return self._climb({first: coarse}, rtol, edges, conditions, last=True)
        except NotConverged:
            return None

    def _on(self, zones, orders, edges, conditions):
        """{order: state} from these zones on: orders before the last are near it and fit soon, or not at
        all.
        """
        states = {}
        for order in orders[:-1]:
            states[order] = self._fit(zones, order, edges, steps=NEAR_STEPS)
            zones = states[order].zones
        states[orders[-1]] = self._amended(self._fit(zones, orders[-1], edges), edges, conditions)
        return states

    def _fit(self, zones, order, edges, **steps):
        """The state with its edges fitted; edges of the two corners that run into each other are exchanged,
        and zones of one corner joined that nothing keeps apart.
        """
        state = self._with_edges_exchanged(zones, order, edges, **steps)
        whole = topology.healed(state.zones, edges)
        if whole == state.zones:
            return state
        try:
            other = contact_line.fit(self.problem, self.load, whole, order=order, tolerance=edges, **steps)
        except NotConverged:
            return state
        worth = survey(other).worth
        return other if worth <= edges or worth <= survey(state).worth else state

    def _with_edges_exchanged(self, zones, order, edges, **steps):
        good = None
        for _ in range(CROSSINGS):
            try:
                return contact_line.fit(self.problem, self.load, zones, order=order, tolerance=edges, **steps)
            except contact_line.EdgesMeet as meeting:
                good, zones = (
                    good or meeting.state,
                    topology.crossed(self.problem, meeting.zones, meeting.edges),
                )
                if zones is None and good is None:
                    raise
            except NotConverged:
                if good is None:
                    raise
                zones = None
            if zones is None:
                return good
        # next to the load at which they meet: neither is worth more than the edges' tolerance
        if good is not None:
            return good
        raise NotConverged(f"edges of the zones run into each other again and again at load {self.load:g}")

    def _amended(self, state, edges, conditions):
        """A fitted state looked at everywhere, its zones amended until they hold."""
        order = state.panels.order
        for _ in range(AMENDMENTS):
            found = survey(state)
            if found.beyond:
                raise LooksTooNear
            state = replace(
                state, estimate=replace(state.estimate, conditions=found.worth), least=tuple(found.least)
            )
            better = topology.amended(state, found, conditions)
            if better is None:
                return state
            try:
                other = self._fit(better, order, edges)
            except NotConverged:
                if found.worth > topology.tolerated(order):
                    raise
                # a zone that hardly begins to touch, or none after all: the estimate has what it is worth
                return state
            if topology.alike(state.zones, other.zones, edges):
                return state  # what is left is the panels' own error, which the estimate has
            state = other
        raise NotConverged(f"zones still changing after {AMENDMENTS} amendments at load {self.load:g}")

    def _climb(self, states, rtol, edges, conditions, last=False):
        """State to rtol, from the lowest order of {order: state} on; each is looked at everywhere, or the
        last one alone.
        """
        first = min(states)

        def at_order(order):
            if order not in states:
                coarser = states[max(states)]
                fitted = self._fit(coarser.further if last else coarser.zones, order, edges)
                states[order] = fitted if last else self._amended(fitted, edges, conditions)
            return states[order]

        def error(coarse, fine):
            parts = replace(fine.estimate, discretisation=panel_solution.difference(coarse, fine))
            if last and parts.total <= rtol:
                looked = self._amended(fine, edges, conditions)
                # of zones that hold the same pressures come back, and their distance is known
                distance = (
                    parts.discretisation if looked.q is fine.q else panel_solution.difference(coarse, looked)
                )
                parts, fine = replace(looked.estimate, discretisation=distance), looked
            states[fine.panels.order] = replace(fine, estimate=parts)
            return parts.total

        fine, _ = refine(at_order, ORDERS[ORDERS.index(first) :], error, rtol, self.load)
        return states[fine.panels.order]


def _on_the_way(orders, rtol):
    """Orders on which edges are driven a part of the way, from the first of `orders` on, and the one from
    which the order rises to rtol.
    """
    low = [order for order, (least, _) in ON_THE_WAY.items() if rtol < least]
    first = max(orders[0], ORDERS[len(low)])
    start = orders[0] if len(orders) == 1 else ORDERS[0]
    return [order for order in ON_THE_WAY if start <= order < min(first, SHORT_CUT)], first


def _orders_of(near, rtol):
    """(an order, the next) for the neighbour of a state: up to its own, or to one lower where that was
    ample.
    """
    number = max(1, ORDERS.index(near.panels.order) if near.panels.order in ORDERS else 1)
    if number > 1 and near.error_estimate is not None and near.error_estimate < AMPLE * rtol:
        number -= 1
    return ORDERS[number - 1], ORDERS[number]
