"""Histories of frictional contact on cells that are small at edges (docs/theory/friction.md)."""

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from .. import cost
from ..contact_solvers.event_driven import EventDrivenContact
from ..contact_solvers.friction_events import events
from ..contact_solvers.frictional_contact import FrictionalContact
from ..errors import NotConverged, at_least, out_of_reach
from ..model import contact_candidates
from ..model.events import Event
from ..model.history import History, change
from ..model.intervals import common
from ..model.problem import Problem
from ..model.progress import kept
from ..model.quadrature import gauss_rule
from ..model.refinement import GeometricSeries, RefinementLevel, levels, refine
from ..model.state import State, changed
from ..model.types import Array, Flags, ZoneErrors
from .friction_cells import Feature, cells, first_features
from .friction_solution import FrictionCells, FrictionErrors, one_force_a_cell
from .shear_cells import frictional_contact, surface, with_second_body

# of the estimates: the fourth level divides them by SLOW or more (by 2.3 to 70 in 15 histories; the next ones
# may gain nothing), and so many that are left by QUICK or less: by 3.5, 13 and 420 at most as seen
SLOW, QUICK = 2.0, (np.inf, 5.0, 25.0, 1000.0)


class ContactLeavesCells(NotConverged):
    """The contact reaches the end of the cells."""


@dataclass(frozen=True, eq=False)
class HistoryOnCells:
    """A history on cells with edges, array (n, 2): a solution for each pair, and events. Edges of zones, and
    places near which q/f is `steep`, as it jumps or a stick zone is born, are known to `band` or better.
    """

    edges: Array
    solutions: list[FrictionCells]
    events: list[Event]
    band: float
    steep: list[float]


@dataclass(frozen=True)
class HistoryLevel(RefinementLevel[History]):
    """A refinement level with its cells, and the number of levels that are `left`."""

    cells: HistoryOnCells | None = None
    left: int = 0


@dataclass(frozen=True)
class FrictionSolver:
    """Histories of one Contact through pairs of loads, array (n, 2), or with bulk stresses (n, 3); `solver`
    is that without history. Cells lie where the contact under so many `times` the largest load may be.
    """

    solver: Any
    pairs: Array
    coupled: bool
    times: float = 1.0

    @cached_property
    def problem(self) -> Problem:
        problem = self.solver.problem
        load = self.times * float(self.pairs[:, 0].max())
        return replace(problem, candidates=contact_candidates.find_candidates(problem, load))

    def history(self, rtol: float | None) -> History:
        """Returns the History to rtol; NotConverged if it is out of reach."""
        try:
            return self._history(rtol)
        except ContactLeavesCells:  # a hill that is much narrower than others is pressed deeper
            if self.times > 16:
                raise
            return replace(self, times=4 * self.times).history(rtol)

    def _history(self, rtol: float | None) -> History:
        goal = self.solver.history_goal(rtol)

        def refusal(best: Any, last: Any, failure: NotConverged | None) -> NotConverged:
            if last.cannot_reach:
                return self._refused(goal, best.error, last.cells, last.left)
            return out_of_reach(goal, best.error, f" ({failure})" if failure else "")

        return refine(self._levels(goal), goal, refusal).result

    def _levels(self, rtol: float) -> Iterator[HistoryLevel]:
        """Yields the HistoryLevels with an error estimate."""
        numbers = range(6)
        least = np.inf
        for number, finer, coarser, changes in levels(self.refined, numbers, _change):
            states = [solution.state() for solution in finer.solutions]
            if least == np.inf:  # no level so far has an estimate
                kept(History(self.solver.contact, states, finer.events))
            errors = _estimates(changes, finer)
            least = min(least, max(errors))
            if max(errors) == np.inf:
                continue
            left = numbers[-1] - number
            yield HistoryLevel(
                History(
                    self.solver.contact,
                    [*map(_estimated, states, finer.solutions, coarser.solutions, errors)],
                    _with_errors(finer.events, coarser.events),
                ),
                max(errors),
                cost.history_seconds(2 * finer.solutions[0].unknowns, len(self.pairs)),
                # large errors have no rule
                cannot_reach=len(changes) > 1 and 0.1 > least > rtol * QUICK[left],
                cells=finer,
                left=left,
            )

    def _refused(self, rtol: float, best: float, finest: HistoryOnCells, left: int) -> NotConverged:
        """Returns the NotConverged of an rtol that no level reaches, with one that is reached."""
        if left > 2:
            with suppress(NotConverged):
                forces = finest.solutions[0].unknowns
                cost.require_history(2 * len(finest.edges), 2 * forces, len(self.pairs))
                best /= SLOW
        figure = at_least(best)
        return NotConverged(
            f"rtol = {rtol:g} is out of reach, as {len(finest.edges)} cells show; ask for rtol={figure}",
            rtol_reached=float(figure),
        )

    def refined(self, number: int, before: HistoryOnCells | None) -> HistoryOnCells:
        """Returns the history on finer cells towards the edges of the one before."""
        a = self.problem.candidates.half_width
        fineness = 0.16 / 2**number  # length of a cell over the half-width, at that distance of an edge
        width = sum(right - left for left, right in self.problem.stretches)
        first = max(a / 20, width / 200)
        # smaller cells at edges than a quarter of the square of the fineness gain nothing
        smallest = max(fineness**2 * a / 4, (first if before is None else before.band) / 8)
        features = first_features(self.problem, fineness)
        if before is None:
            return self.on_cells(cells(self.problem, first / a, features), first)
        edges = _features(before, smallest)
        reach = edges[0].place, edges[-1].place
        return self.on_cells(cells(self.problem, fineness, features + edges, reach), smallest, before)

    def on_cells(
        self, edges: Array, band: float = 0.0, before: HistoryOnCells | None = None
    ) -> HistoryOnCells:
        """Returns the history on cells, array (n, 2), with steep places of the one before that are farther
        than its `band` from others, as finer cells may resolve them.
        """
        points, weights = gauss_rule(4)
        x = edges[:, :1] + (edges[:, 1:] - edges[:, :1]) * points
        gaps = self.problem.initial_gaps(x.ravel()).reshape(-1, *x.shape) @ weights
        corners = len(gaps)
        forces = corners + (1 if self.problem.counter is None else corners)
        cost.require_history(len(edges), forces * len(edges), len(self.pairs))
        first = frictional_contact(self.problem, edges, gaps, self.coupled)
        path = EventDrivenContact(with_second_body(first, self.problem, edges))
        solutions = [self._solution(edges, first, path, *pair) for pair in self.pairs.tolist()]
        noted = events(path.changes, first.friction, edges, self.pairs[:, :2])
        steep = _steep_places(solutions, noted)
        if before is not None:
            steep += [x for x in before.steep if all(abs(x - place) > before.band for place in steep)]
        return HistoryOnCells(edges, solutions, noted, band, steep)

    def _solution(
        self, edges: Array, first: FrictionalContact, path: EventDrivenContact, *loads: float
    ) -> FrictionCells:
        """Returns the FrictionCells to which the path goes on; `first` is without the second body."""
        forces = path.follow(*loads)
        self._require_inside(edges, forces.closed.reshape(-1, len(edges)))
        by_cell = one_force_a_cell(forces, len(edges))
        gap_changes = first.normal @ by_cell.normal + first.cross.T @ by_cell.tangential
        all_gap_changes = path.contact.normal @ forces.normal + path.contact.cross.T @ forces.tangential
        return FrictionCells(
            self.solver,
            self.problem,
            edges,
            by_cell,
            *surface(self.problem, edges, gap_changes, by_cell),
            opposite=(all_gap_changes - gap_changes).reshape(-1, len(edges)),
            unknowns=len(first.gaps) + path.contact.nodes,
        )

    def _require_inside(self, edges: Array, closed: Flags) -> None:
        """Raises ContactLeavesCells where a corner touches at the end of the cells and the obstacle goes
        on.
        """
        ends = np.ravel(list(self.problem.ends.values()))
        for place in np.intersect1d(edges[closed.any(axis=0)], self.problem.stretches):
            if not np.isclose(place, ends, rtol=1e-9, atol=0.0).any():
                raise ContactLeavesCells(
                    f"the contact reaches x = {place:g}, beyond which no contact was expected"
                )


def _steep_places(solutions: list[FrictionCells], noted: list[Event]) -> list[float]:
    """Returns places where q/f jumps, a stick zone is born, or cells are too wide for a contact."""
    steep = [edge for solution in solutions for edge in solution.edges[solution.jumping, 1].tolist()]
    steep += [event.x for event in noted if event.kind == "born"]
    for solution in solutions:
        steep += [*solution.hidden, *(float(solution.edges[first, 0]) for first, _ in solution.spots)]
    return steep


def _features(before: HistoryOnCells, smallest: float) -> list[Feature]:
    """Returns the Features of edges and steep places of the history before, ascending."""
    features: list[Feature] = []
    edges = {edge: doubt for solution in before.solutions for edge, doubt in solution.doubts.items()}
    edges |= dict.fromkeys(before.steep, before.band)
    for edge, doubt in sorted(edges.items()):
        band = min(max(4 * doubt, smallest), before.band)
        if not features or edge - features[-1].place > smallest:
            features.append(Feature(edge, band, smallest))
        else:
            features[-1] = replace(features[-1], band=max(band, features[-1].band))
    return features


def _change(coarser: HistoryOnCells, finer: HistoryOnCells) -> Any:
    """Returns the relative changes of the solutions from one history to a finer one, array (pairs,)."""
    pairs = zip(finer.solutions, coarser.solutions)
    return np.array([change(new, old, new.norm, new.problem.ell, new.friction) for new, old in pairs])


def _estimates(changes: list[Any], finest: HistoryOnCells) -> list[float]:
    """Returns the errors of the solutions of the finest history: that of the changes, and what jumps and
    contacts of few cells lose; inf where a contact is not seen.
    """
    if not changes:
        return [np.inf]
    lost = [np.inf if s.hidden else s.lost_in_jumps + s.lost_in_spots for s in finest.solutions]
    series = GeometricSeries(2.0, 1.4, 2.5, luck=np.inf)  # ratios from 2 to 6 were seen
    return (series.error(changes[-2:]) + lost).tolist()


def _estimated(state: State, finer: FrictionCells, coarser: FrictionCells, error: float) -> State:
    """Returns the State of the finer of two solutions with its errors."""
    parts = FrictionErrors(error)
    return changed(
        state,
        solution=finer.changed(estimate=parts),
        error_estimate=error,
        error_parts=parts,
        zone_errors=_zone_errors(finer, coarser),
    )


def _zone_errors(finer: FrictionCells, coarser: FrictionCells) -> ZoneErrors:
    """Returns errors of the edges of zones, as of `State`: change from the level before plus twice the doubt,
    since two levels may agree and be off together.
    """
    errors: ZoneErrors = dict.fromkeys(finer.zones_by_name)
    for name, zones in finer.zones_by_name.items():
        before = coarser.zones_by_name[name]
        if len(zones) == len(before) == len(common(zones, before)):
            doubts = [[2 * finer.doubts[edge] for edge in zone] for zone in zones]
            errors[name] = [*map(tuple, (np.abs(np.subtract(zones, before)) + doubts).tolist())]
    return errors


def _with_errors(finer: list[Event], coarser: list[Event]) -> list[Event]:
    """Returns the finer level's events, in order, with their distance to the coarser ones."""
    if [(event.pair, event.kind) for event in finer] != [(event.pair, event.kind) for event in coarser]:
        return finer
    pairs: Iterator[Any] = zip(finer, coarser)
    return [
        replace(new, load_error=abs(new.load - old.load) + abs(new.shear - old.shear)) for new, old in pairs
    ]
