"""A state of a half-plane at one load by the steps of docs/theory/halfplane.md: zones, edges, conditions."""

from dataclasses import replace

import numpy as np

from .. import cost
from ..errors import NotConverged, out_of_reach
from ..model import contact_candidates
from ..model.intervals import joined, without, zone_edges
from ..model.missed_contact import total_worth
from ..model.problem import half_line
from ..model.refinement import RefinementLevel, Usual, refine
from .contact_violations import contact_violations
from .edges import newton_zone_edges, tolerated
from .first_zones import first_zones
from .panel_solution import relative_change
from .panels import orders, unresolved

CONDITIONS_SHARE = 0.3  # of rtol, above which a violation changes the zones


def solve(solver, problem, load, rtol, order=None, near=None):
    """Returns the PanelSolution of a PanelSolver and its Problem with candidates at a load (force per
    thickness), to rtol or of an order; for an rtol that is `Usual` the best one.

    Trial zones are taken until the conditions hold on those that they lead to.

    Raises NotConverged, with `rtol_reached` if zones fit, and BadArgument if the obstacle could touch beyond
    its picture.
    """
    failure = None
    for zones in _trials(problem, load, near):
        try:
            if order is None:
                return _refined(solver, problem, load, zones, rtol)
            state = _verified(_amended(newton_zone_edges(problem, load, zones, order, 1e-9), 0.0))
            return state.changed(solver=solver)
        except NotConverged as objection:
            if objection.rtol_reached is not None:  # on zones that hold: others are none
                raise
            failure = objection
    raise NotConverged(f"no zones fit at load {load:g}: {failure}") from failure


def _trials(problem, load, near):
    if near:
        yield near.zones
    if half_line(problem) and problem.candidates.simple:
        half = contact_candidates.classical(problem, load, problem.candidates.lowest)[0]
        yield {0: ((-half, half),)}
    yield from map(problem.computed, first_zones(problem, load))


def _refined(solver, problem, load, zones, rtol):
    """Returns the PanelSolution to rtol from trial zones on."""

    def refusal(best, last, failure):
        besides = "fix the discretisation instead"
        return failure or out_of_reach(rtol, best.error, load=load, besides=besides, met_again=False)

    # paths and histories, which keep what they have, ask for states on the way
    state = refine(_orders(solver, problem, load, zones, rtol), rtol, refusal, keeps=False).result
    if state.estimate.total >= 1:
        raise NotConverged(f"errors are as large as the pressure at load {load:g}")
    return state


def _orders(solver, problem, load, zones, rtol):
    """Yields RefinementLevels of ascending orders, from the second on."""
    coarse = None
    for order in orders(problem.candidates.simple, 0.0):
        tolerance = rtol * (0.1 if coarse else 0.5)  # the distance to the coarser one has its edges
        if rtol < unresolved(order):  # and its neighbour will not agree
            tolerance = max(tolerance, np.sqrt(tolerated(order)))
        state = newton_zone_edges(problem, load, zones, order, tolerance)
        if coarse is None and not problem.candidates.simple:
            state = _verified(_amended(state, CONDITIONS_SHARE * rtol))
        if coarse is not None:
            state = _beside(coarse, state)
            if isinstance(rtol, Usual) or state.estimate.total <= rtol:
                before, state = state, _amended(state, CONDITIONS_SHARE * rtol)
                state = state if state.panels is before.panels else _beside(coarse, state)
            state = state.changed(solver=solver)
            seconds = cost.predict("panels", 1.5 * state.unknowns).seconds
            yield RefinementLevel(state, state.estimate.total, seconds)
        coarse = state
        zones = state.further


def _verified(state):
    """A state whose violations are no more than its order leaves; raises NotConverged for others."""
    wrong = state.estimate.conditions
    if wrong > np.sqrt(tolerated(state.panels.order)):
        raise NotConverged(f"zones violate the contact conditions by {wrong:.1e} of the pressure")
    return state


def _beside(coarse, state):
    error = relative_change(coarse, state)
    return state.changed(estimate=replace(state.estimate, discretisation=error))


def _amended(state, tolerance):
    """A state with its zones amended until violations vanish or, twice, have not halved."""
    best, worth, idle = state, np.inf, 0
    while True:
        violations = contact_violations(state)
        size = total_worth(violations)
        idle = 0 if size < worth / 2 else idle + 1
        if size < worth:
            best, worth = state.changed(estimate=replace(state.estimate, conditions=size)), size
        zones = amended(state, violations, tolerance)
        if zones is None or idle == 2:
            return best
        edges = max(state.estimate.edges, tolerance / 3)
        try:
            state = newton_zone_edges(state.problem, state.load, zones, state.panels.order, edges)
        except NotConverged:  # a zone that hardly touches, or none: the estimate has what it is worth
            return best


def amended(state, violations, tolerance):
    """Zones without tension and with overlaps worth the tolerance or apart from all edges, or None.
    NotConverged if no zone is left.
    """
    least = max(tolerance, tolerated(state.panels.order))
    edges = np.array(zone_edges(state.all_zones))
    zones, wrong = {corner: list(own) for corner, own in state.zones.items()}, False
    for each in violations:
        left, right, own = each.left, each.right, zones[each.corner]
        apart = each.depth > 0 and np.abs(edges - (left + right) / 2).min() > right - left
        if not apart and each.worth <= least:
            continue
        wrong = True
        if each.depth:
            near = [edge for edge in np.ravel(own) if abs(2 * edge - left - right) < 1.1 * (right - left)]
            zones[each.corner] = joined([*own, (min([left, *near]), max([right, *near]))])
        else:
            # tension at an edge of another corner goes on beyond it, where it is too narrow to be seen
            beyond = (right - left) * np.isin((left, right), edges)
            zones[each.corner] = sorted(set(without(own, left - beyond[0], right + beyond[1])))
    if wrong and not any(zones.values()):
        raise NotConverged(f"all zones are in tension at load {state.load:g}")
    return state.problem.computed({corner: tuple(own) for corner, own in zones.items()}) if wrong else None
