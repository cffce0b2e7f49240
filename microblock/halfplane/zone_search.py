"""A state of a half-plane at one load by the steps of docs/theory/halfplane.md: zones, edges, conditions."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from .. import cost
from ..errors import NotConverged, out_of_reach
from ..model import contact_candidates
from ..model.intervals import joined, without, zone_edges
from ..model.missed_contact import Violation, total_worth
from ..model.problem import Problem, half_line
from ..model.refinement import Abandoned, RefinementLevel, Usual, refine
from ..model.types import CornerZones
from .contact_violations import contact_violations
from .edges import newton_zone_edges, tolerated
from .first_zones import first_zones
from .panel_solution import PanelSolution, relative_change
from .panels import orders, unresolved

CONDITIONS_PART = 0.3  # of rtol, above which a violation changes the zones


def solve_on_panels(
    solver: Any,
    problem: Problem,
    load: float,
    rtol: Any,
    order: int | None = None,
    near: PanelSolution | None = None,
) -> PanelSolution:
    """Returns the PanelSolution of a PanelSolver and its Problem with candidates at a load (force per
    thickness), to rtol or of an order; for an rtol that is `Usual` the best one.

    Trial zones are taken until the conditions hold on those that they lead to.

    Raises NotConverged, with `rtol_reached` if zones fit, and BadArgument if the obstacle could touch where
    no contact was expected.
    """
    failure = None
    poor: list[RefinementLevel[PanelSolution]] = []
    for zones in _trials(problem, load, near):
        try:
            if order is None:
                level = _refined(solver, problem, load, zones, rtol)
                if level.error < 1:
                    return level.result
                poor.append(level)  # other zones may be better
                continue
            state = _verified(_amended(newton_zone_edges(problem, load, zones, order, 1e-9), 0.0))
            return state.changed(solver=solver)
        except NotConverged as objection:
            if objection.rtol_reached is not None:  # on zones that hold: others are none
                raise
            failure = objection
    if poor:
        return min(poor, key=lambda level: level.error).result
    raise NotConverged(f"no zones fit at load {load:g}: {failure}") from failure


def _trials(problem: Problem, load: float, near: PanelSolution | None) -> Iterator[CornerZones]:
    """Yields trial zones: those of a similar state, of a classical contact, of cells."""
    if near:
        yield near.zones
    if half_line(problem) and problem.candidates.simple:
        half = contact_candidates.classical(problem, load, problem.candidates.lowest)[0]
        yield {0: ((-half, half),)}
    yield from map(problem.computed, first_zones(problem, load))


def _refined(
    solver: Any, problem: Problem, load: float, zones: CornerZones, rtol: Any
) -> RefinementLevel[PanelSolution]:
    """Returns the RefinementLevel to rtol from trial zones on, for an rtol that is `Usual` the best one."""

    def refusal(best: Any, last: Any, failure: NotConverged | None) -> NotConverged:
        besides = "fix the discretisation instead"
        return failure or out_of_reach(rtol, best.error, load=load, besides=besides, met_again=False)

    # paths and histories, which keep what they have, ask for states on the way
    return refine(_orders(solver, problem, load, zones, rtol), rtol, refusal, keeps=False)


def _orders(
    solver: Any, problem: Problem, load: float, zones: CornerZones, rtol: Any
) -> Iterator[RefinementLevel[PanelSolution]]:
    """Yields RefinementLevels of ascending orders, from the second on."""
    coarse: PanelSolution | None = None
    for order in orders(problem.candidates.simple, 0.0):
        tolerance = rtol * (0.1 if coarse else 0.5)  # the distance to the coarser one has its edges
        if rtol < unresolved(order):  # and its neighbour will not agree
            tolerance = max(tolerance, np.sqrt(tolerated(order)))
        state = newton_zone_edges(problem, load, zones, order, tolerance)
        if coarse is None and not problem.candidates.simple:
            state = _verified(_amended(state, CONDITIONS_PART * rtol))
        if coarse is not None:
            state = _compared(coarse, state)
            if isinstance(rtol, Usual) or state.estimate.total <= rtol:
                panels = state.panels
                try:
                    state = _amended(state, CONDITIONS_PART * rtol)
                except NotConverged as failure:  # all zones are in tension: others are tried
                    raise Abandoned(failure) from failure
                if state.panels is not panels:
                    state = _compared(coarse, state)
            state = state.changed(solver=solver)
            seconds = cost.predict("panels", 1.5 * state.unknowns).seconds
            yield RefinementLevel(state, state.estimate.total, seconds)
        coarse = state
        zones = state.next_zones


def _verified(state: PanelSolution) -> PanelSolution:
    """Returns a state whose violations are no more than its order leaves; raises NotConverged for others."""
    violation = state.estimate.conditions
    if violation > np.sqrt(tolerated(state.panels.order)):
        raise NotConverged(f"zones violate the contact conditions by {violation:.1e} of the pressure")
    return state


def _compared(coarse: PanelSolution, state: PanelSolution) -> Any:
    """Returns a state with the change from a coarser one as its error of discretisation."""
    errors = replace(state.estimate, discretisation=relative_change(coarse, state))
    return state.changed(estimate=errors)


def _amended(state: PanelSolution, tolerance: float) -> PanelSolution:
    """Returns a state with its zones amended until violations vanish or, twice, have not halved."""
    best = state
    least = np.inf
    idle = 0
    while True:
        violations = contact_violations(state)
        worth = total_worth(violations)
        idle = 0 if worth < least / 2 else idle + 1
        if worth < least:
            least = worth
            best = state.changed(estimate=replace(state.estimate, conditions=worth))
        zones = amended(state, violations, tolerance)
        if zones is None or idle == 2:
            return best
        edges = max(state.estimate.edges, tolerance / 3)
        try:
            state = newton_zone_edges(state.problem, state.load, zones, state.panels.order, edges)
        except NotConverged:  # a zone that hardly touches, or none: the estimate has what it is worth
            return best


def amended(state: PanelSolution, violations: Sequence[Violation], tolerance: float) -> CornerZones | None:
    """Returns zones without tension and with overlaps worth the tolerance or away from all edges, or None;
    raises NotConverged if no zone is left.
    """
    least = max(tolerance, tolerated(state.panels.order))
    edges = np.array(zone_edges(state.all_zones))
    zones = {corner: list(intervals) for corner, intervals in state.zones.items()}
    counted = [
        violation
        for violation in violations
        if violation.worth > least or _is_away_from_edges(violation, edges)
    ]
    for violation in counted:
        left = violation.left
        right = violation.right
        width = right - left
        intervals = zones[violation.corner]
        if violation.depth:
            near = [x for x in np.ravel(intervals) if abs(2 * x - left - right) < 1.1 * width]
            zones[violation.corner] = joined([*intervals, (min([left, *near]), max([right, *near]))])
        else:
            # tension at an edge of another corner goes on beyond it, where it is too narrow to be seen
            past = width * np.isin((left, right), edges)
            zones[violation.corner] = sorted(set(without(intervals, left - past[0], right + past[1])))
    if not counted:
        return None
    if not any(zones.values()):
        raise NotConverged(f"all zones are in tension at load {state.load:g}")
    return state.problem.computed({corner: tuple(intervals) for corner, intervals in zones.items()})


def _is_away_from_edges(violation: Violation, edges: Any) -> bool:
    """Returns whether a violation is an overlap away from all edges, array (n,)."""
    middle = (violation.left + violation.right) / 2
    return violation.depth > 0 and np.abs(edges - middle).min() > violation.right - violation.left
