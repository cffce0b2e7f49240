"""Histories of frictional contact on cells that are small at edges (docs/theory/friction.md)."""

from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from .. import cost
from ..contact_solvers.event_driven import AT_LIMIT, EventDrivenContact, FrictionState
from ..contact_solvers.friction_events import events
from ..errors import BadArgument, NotConverged, at_least, out_of_reach
from ..model import contact_candidates
from ..model.history import History, OfMoment, change
from ..model.intervals import common, contains, distance_to_ends, runs
from ..model.missed_contact import apart, overlaps
from ..model.periodic import EQUAL
from ..model.problem import Problem
from ..model.progress import kept
from ..model.quadrature import gauss_rule
from ..model.refinement import FEWEST_GRADED, GeometricSeries, RefinementLevel, levels, refine
from ..model.solution import ErrorParts
from .friction_cells import Feature, cells, first_features, places_of_tips
from .friction_edges import zones_on_cells
from .shear_cells import frictional_contact, surface, with_second_body

# of the estimates: the fourth level divides them by SLOW or more (by 2.3 to 70 in 15 histories; the next ones
# may gain nothing), and so many that are left by QUICK or less: by 3.5, 13 and 420 at most as seen
SLOW, QUICK = 2.0, (np.inf, 5.0, 25.0, 1000.0)


class ContactLeavesCells(NotConverged):
    """The contact reaches the end of the cells."""


@dataclass(frozen=True)
class Errors(ErrorParts):
    """Parts of the relative L2 error of pressure, M/ell and q/f.

    Attributes
    ----------
    discretisation : what finer levels would change, and the loss where q/f jumps
    """

    discretisation: float


@dataclass(frozen=True, eq=False, repr=False)
class FrictionCells(OfMoment):
    """A solution at a pair of loads, on cells of constant tractions.

    Attributes
    ----------
    edges : array (n, 2), of the cells
    moment : Moment, forces and gaps, with a tangential force for each cell
    displacement, psi, micromoment : arrays (n,), averages over the cells
    opposite : array (corners, n), displacement of a second body under the corners
    unknowns : number of forces
    estimate : Errors, or None without a level before
    notes : why cells were taken
    """

    solver: Any
    problem: Problem
    edges: np.ndarray
    moment: FrictionState
    displacement: np.ndarray
    psi: np.ndarray
    micromoment: np.ndarray
    unknowns: int
    opposite: np.ndarray
    estimate: Errors | None = None
    notes: tuple = ()

    @cached_property
    def x(self):
        return self.edges.mean(axis=1)

    @cached_property
    def weights(self):
        return self.edges[:, 1] - self.edges[:, 0]

    @cached_property
    def pressures(self):
        return self.moment.normal.reshape(-1, len(self.x)) / self.weights

    @property
    def closed(self):
        return self.moment.closed.reshape(-1, len(self.x))

    @property
    def load(self):
        return self.moment.load

    @property
    def approach(self):
        return self.moment.approach

    @property
    def residual(self):
        return self.moment.residual

    @property
    def iterations(self):
        return self.moment.iterations

    @cached_property
    def _fitted(self):
        return zones_on_cells(
            self.edges,
            self.closed,
            self.moment.stick & ~self.moment.at_limit,
            self.pressures,
            self.problem.law.friction * self.pressures.sum(axis=0),
            self.shear_traction,
            places_of_tips(self.problem),
            self.problem.law.corners,
        )

    @property
    def zones_by_name(self):
        return self._fitted[0]

    @property
    def doubts(self):
        return self._fitted[1]

    @cached_property
    def jumping(self):
        """Numbers of cells with a jump of q/f by more than half of the pressure."""
        p, q = self.pressures.sum(axis=0), self.shear_traction / self.problem.law.friction
        jumping = (p[1:] > 0) & (p[:-1] > 0) & (np.abs(np.diff(q)) > (p[1:] + p[:-1]) / 4)
        return np.flatnonzero(jumping)

    @property
    def lost_in_jumps(self):
        """Relative L2 error of q/f where it jumps."""
        p, at = self.pressures.sum(axis=0), self.jumping
        half = np.diff(self.shear_traction)[at] / self.problem.law.friction / 2
        return float(np.sqrt(half**2 @ (self.norm[at] + self.norm[at + 1]) / (self.norm @ p**2)))

    @cached_property
    def hidden(self):
        """Places where a corner that is open overlaps the obstacle, which cells are too wide to see."""
        least = EQUAL * np.ptp(self.moment.raised)
        places = []
        for corner, closed in enumerate(self.closed):
            x = self.problem.sites(corner)
            x = x[contains(self.edges, x)]
            valleys = self.problem.candidates.minima + self.problem.shifts[corner]
            looked_at = contains(self.edges[apart(closed)], x)
            looked_at |= np.isin(x, valleys) & ~contains(self.edges[closed], x)
            gaps = np.where(looked_at, self.gap(corner, x), np.nan)
            places += [overlap.place for overlap in overlaps(corner, x, gaps, 1.0, least)]
        return places

    @cached_property
    def spots(self):
        """Contacts of fewer than FEWEST_GRADED cells: (first, last) of their cells."""
        return [(i, j) for i, j in runs(self.closed.any(axis=0)) if j - i < FEWEST_GRADED - 1]

    @property
    def lost_in_spots(self):
        """Relative L2 norm of the pressure of `spots`."""
        squares = self.norm * self.pressures.sum(axis=0) ** 2
        return float(np.sqrt(sum(squares[i : j + 1].sum() for i, j in self.spots) / squares.sum()))

    @cached_property
    def norm(self):
        """Weights of errors, array (n,); at an edge of the obstacle times the distance."""
        ends = getattr(self.problem.obstacle, "ends", ())
        return self.weights * distance_to_ends(self.x, ends, self.problem.shifts)

    def pressure(self, corner, x):
        """Pressure of a corner at x, array (n,): a polygon through the centres."""
        there = contains(self.edges[self.closed[corner]], x)
        return np.where(there, np.interp(x, self.x, self.pressures[corner]), 0.0)

    def gap(self, corner, x):
        """Gap of a corner at x, array (n,); BadArgument beyond the cells."""
        low, high = self.edges[0, 0], self.edges[-1, 1]
        if not np.all((x >= low) & (x <= high)):
            raise BadArgument("x", x, f"must lie within the cells, from {low} to {high}")
        raised = self.moment.raised.reshape(-1, len(self.x))[corner]
        return self.problem.initial_gaps(x)[corner] - self.approach + np.interp(x, self.x, raised)


@dataclass(frozen=True, eq=False)
class Level:
    """A history on cells with edges, array (n, 2): a solution for each pair, and events. Edges of zones, and
    places near which q/f is `steep`, as it jumps or a stick zone is born, are known to `band` or better.
    """

    edges: np.ndarray
    solutions: list
    events: list
    band: float
    steep: list


@dataclass(frozen=True)
class HistoryLevel(RefinementLevel[History]):
    """A refinement level with its cells, and the number of levels that are `left`."""

    cells: Level | None = None
    left: int = 0


@dataclass(frozen=True)
class FrictionSolver:
    """Histories of one Contact through pairs of loads, array (n, 2); `solver` is that without history. Cells
    lie where the contact under so many `times` the largest load may be.
    """

    solver: Any
    pairs: np.ndarray
    coupled: bool
    times: float = 1.0

    @cached_property
    def problem(self):
        plain = self.solver.problem
        return replace(
            plain,
            candidates=contact_candidates.find_candidates(plain, self.times * float(self.pairs[:, 0].max())),
        )

    def history(self, rtol):
        """Returns the History to rtol; NotConverged if it is out of reach."""
        try:
            return self._history(rtol)
        except ContactLeavesCells:  # a hill that is much narrower than others is pressed deeper
            if self.times > 16:
                raise
            return replace(self, times=4 * self.times).history(rtol)

    def _history(self, rtol):
        goal = self.solver.history_goal(rtol)

        def refusal(best, last, failure):
            if last.cannot_reach:
                return self._refused(goal, best.error, last.cells, last.left)
            return out_of_reach(goal, best.error, f" ({failure})" if failure else "")

        return refine(self._levels(goal), goal, refusal).result

    def _levels(self, rtol):
        """Yields the HistoryLevels with an error estimate."""
        numbers, least = range(6), np.inf
        for number, finer, coarser, changes in levels(self.level, numbers, _change):
            errors = _estimates(changes, finer)
            least = min(least, max(errors))
            if max(errors) == np.inf:
                states = [solution.state() for solution in finer.solutions]
                kept(History(self.solver.contact, states, finer.events))
                continue
            left = numbers[-1] - number
            yield HistoryLevel(
                self._estimated(finer, coarser, errors),
                max(errors),
                cost.history_seconds(2 * finer.solutions[0].unknowns, len(self.pairs)),
                # large errors have no rule
                cannot_reach=len(changes) > 1 and 0.1 > least > rtol * QUICK[left],
                cells=finer,
                left=left,
            )

    def _estimated(self, finer, coarser, errors):
        """Returns the History of the finer of two Levels, with its errors."""
        parts = zip(finer.solutions, coarser.solutions, map(Errors, errors))
        states = [
            replace(replace(one, estimate=error).state(), zone_errors=_zone_errors(one, other))
            for one, other, error in parts
        ]
        return History(self.solver.contact, states, _with_errors(finer.events, coarser.events))

    def _refused(self, rtol, best, level, left):
        """The NotConverged of an rtol that no level reaches, with one that is reached."""
        if left > 2:
            with suppress(NotConverged):
                forces = level.solutions[0].unknowns
                cost.require_history(2 * len(level.edges), 2 * forces, len(self.pairs))
                best /= SLOW
        figure = at_least(best)
        return NotConverged(
            f"rtol = {rtol:g} is out of reach, as {len(level.edges)} cells show; ask for rtol={figure}",
            rtol_reached=float(figure),
        )

    def level(self, number, before):
        """Returns the Level on finer cells towards the edges of the one before."""
        # length of a cell over the half-width, at that distance of an edge
        a, fineness = self.problem.candidates.half_width, 0.16 / 2**number
        width = sum(right - left for left, right in self.problem.stretches)
        first = max(a / 20, width / 200)
        # smaller cells at edges than a quarter of the square of the fineness gain nothing
        smallest = max(fineness**2 * a / 4, (first if before is None else before.band) / 8)
        features = first_features(self.problem, fineness)
        if before is None:
            return self.on(cells(self.problem, first / a, features), first)
        known = _features(before, smallest)
        reach = known[0].place, known[-1].place
        return self.on(cells(self.problem, fineness, features + known, reach), smallest, before)

    def on(self, edges, band=0.0, before=None):
        """Returns the Level on cells, with steep places of the Level before that are farther than its `band`
        from others, as finer cells may resolve them.
        """
        points, weights = gauss_rule(4)
        places = edges[:, :1] + (edges[:, 1:] - edges[:, :1]) * points
        gaps = self.problem.initial_gaps(places.ravel()).reshape(-1, *places.shape) @ weights
        corners = len(gaps)
        forces = corners + (1 if self.problem.counter is None else corners)
        cost.require_history(len(edges), forces * len(edges), len(self.pairs))
        own = frictional_contact(self.problem, edges, gaps, self.coupled)
        path = EventDrivenContact(with_second_body(own, self.problem, edges))
        solutions = [self._solution(edges, own, path, *pair) for pair in self.pairs.tolist()]
        changes = events(path.changes, own.friction, edges, self.pairs)
        steep = [float(edge) for one in solutions for edge in one.edges[one.jumping, 1]]
        steep += [float(event.x) for event in changes if event.kind == "born"]
        for one in solutions:
            steep += [*one.hidden, *(float(one.edges[i, 0]) for i, _ in one.spots)]
        known = () if before is None else before.steep
        steep += [place for place in known if all(abs(place - new) > before.band for new in steep)]
        return Level(edges, solutions, changes, band, steep)

    def _solution(self, edges, own, path, load, shear):
        """The FrictionCells to which the path goes on; `own` is without the second body."""
        both, corners = path.contact, path.to(load, shear)
        self._require_inside(edges, corners.closed.reshape(-1, len(edges)))
        moment = _by_cell(corners, len(edges))
        displaced = own.normal @ moment.normal + own.cross.T @ moment.tangential
        all_displaced = both.normal @ corners.normal + both.cross.T @ corners.tangential
        return FrictionCells(
            self.solver,
            self.problem,
            edges,
            moment,
            *surface(self.problem, edges, displaced, moment),
            opposite=(all_displaced - displaced).reshape(-1, len(edges)),
            unknowns=len(own.gaps) + both.nodes,
        )

    def _require_inside(self, edges, closed):
        """Beyond where a corner touches at the end of the cells and the obstacle goes on."""
        ends = np.ravel(list(self.problem.ends.values()))
        for place in np.intersect1d(edges[closed.any(axis=0)], self.problem.stretches):
            if not np.isclose(place, ends, rtol=1e-9, atol=0.0).any():
                raise ContactLeavesCells(
                    f"the contact reaches x = {place:g}, beyond which no contact was expected"
                )


def _features(before, smallest):
    found = []
    edges = {edge: doubt for one in before.solutions for edge, doubt in one.doubts.items()}
    edges |= dict.fromkeys(before.steep, before.band)
    for edge, doubt in sorted(edges.items()):
        band = min(max(4 * doubt, smallest), before.band)
        if not found or edge - found[-1].place > smallest:
            found.append(Feature(edge, band, smallest))
        else:
            found[-1] = replace(found[-1], band=max(band, found[-1].band))
    return found


def _change(coarser, finer):
    ell, friction = finer.solutions[0].problem.ell, finer.solutions[0].problem.law.friction
    pairs = zip(finer.solutions, coarser.solutions)
    return np.array([change(one, other, one.norm, ell, friction) for one, other in pairs])


def _estimates(changes, level):
    """Errors of the solutions of a Level, list of float: that of the changes, and what jumps and contacts of
    few cells lose; inf where a contact is not seen.
    """
    if not changes:
        return [np.inf]
    lost = [np.inf if one.hidden else one.lost_in_jumps + one.lost_in_spots for one in level.solutions]
    series = GeometricSeries(2.0, 1.4, 2.5, luck=np.inf)  # ratios from 2 to 6 were seen
    return (series.error(changes[-2:]) + lost).tolist()


def _zone_errors(finer, coarser):
    """Errors of the edges of zones, as of `State`: change from the level before plus twice the doubt,
    since two levels may agree and be off together.
    """
    found = dict.fromkeys(finer.zones_by_name)
    for name, own in finer.zones_by_name.items():
        others = coarser.zones_by_name[name]
        if len(own) == len(others) == len(common(own, others)):
            doubts = [[2 * finer.doubts[edge] for edge in pair] for pair in own]
            found[name] = [*map(tuple, (np.abs(np.subtract(own, others)) + doubts).tolist())]
    return found


def _with_errors(finer, coarser):
    """The finer level's events, in order, with their distance to the coarser ones."""
    if [(one.pair, one.kind) for one in finer] != [(one.pair, one.kind) for one in coarser]:
        return finer
    errors = [abs(one.load - other.load) + abs(one.shear - other.shear) for one, other in zip(finer, coarser)]
    return [replace(one, load_error=error) for one, error in zip(finer, errors)]


def _by_cell(moment, n):
    """The Moment of cells, where corners may have tangential forces of their own."""
    if len(moment.tangential) == n:
        return moment
    names = "normal", "tangential", "slip", "closed", "stick", "at_limit"
    normal, t, slip, closed, stick, limit = (getattr(moment, name).reshape(-1, n) for name in names)
    together = np.abs(t.sum(axis=0)) >= (1 - AT_LIMIT) * np.abs(t).sum(axis=0)
    return replace(
        moment,
        tangential=t.sum(axis=0),
        slip=(normal * slip).sum(axis=0) / np.maximum(normal.sum(axis=0), np.finfo(float).tiny),
        stick=stick.any(axis=0),
        at_limit=np.all(limit | ~closed, axis=0) & closed.any(axis=0) & together,
    )
