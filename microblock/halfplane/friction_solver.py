"""Histories of frictional contact on cells that are small at edges (docs/theory/friction.md)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import NDArray

from .. import cost
from ..corners.follower import AT_LIMIT, Follower, FrictionalContact, Moment
from ..corners.friction_events import events
from ..errors import BadArgument, NotConverged, out_of_reach
from ..model import picture
from ..model.events import Event
from ..model.history import History, OfMoment, change
from ..model.problem import Problem
from ..model.quadrature import gauss_rule
from ..model.refinement import levels
from ..model.state import ErrorParts, State
from ..model.types import Array, Flags, Interval, ZoneErrors, Zones
from ..model.zones import common, distance_to_ends
from .friction_cells import Feature, cells, fixed, touching
from .friction_edges import zones_on_cells
from .shear_cells import frictional_contact, surface, with_counter

if TYPE_CHECKING:
    from ..model.solver import Solver


@dataclass(frozen=True)
class Errors(ErrorParts):
    """Parts of the relative L2 error of pressure, M/ell and q/f.

    Attributes
    ----------
    discretisation : change from the level before, or the loss where q/f jumps
    """

    discretisation: float


@dataclass(frozen=True, eq=False, repr=False)
class FrictionCells(OfMoment):
    """A solution at a pair of loads, on cells of constant tractions.

    Attributes
    ----------
    edges : array (n, 2), of the cells
    moment : Moment, forces and gaps
    psi, displacement, micromoment : arrays (n,), averages over the cells
    raised : array (corners, n) or None, displacement of a second body
    estimate, before : Errors and zones of the level before, or None
    notes : why cells were taken
    """

    solver: Solver
    problem: Problem
    edges: Array
    moment: Moment
    psi: Array
    displacement: Array
    micromoment: Array
    raised: Array | None = None
    estimate: Errors | None = None
    before: Zones | None = None
    notes: tuple[str, ...] = ()

    method = "cells"
    tangential_approach = None

    @cached_property
    def x(self) -> Array:
        return self.edges.mean(axis=1)

    @cached_property
    def weights(self) -> Array:
        return self.edges[:, 1] - self.edges[:, 0]

    @cached_property
    def pressures(self) -> Array:
        return self.moment.normal.reshape(-1, len(self.x)) / self.weights

    @property
    def approach(self) -> float:
        return self.moment.approach

    def counter_displacement(self, x: Array) -> Array:
        if self.raised is None:
            return np.zeros_like(x)
        places = np.concatenate([self.x - shift for shift in self.problem.shifts])
        order = np.argsort(places)
        return np.interp(x, places[order], self.raised.ravel()[order])

    @property
    def unknowns(self) -> int:
        corners = self.moment.normal.size
        return corners + (len(self.x) if self.problem.counter is None else corners)

    @cached_property
    def _fitted(self) -> tuple[Zones, dict[float, float]]:
        law: Any = self.problem.law
        return zones_on_cells(
            self.edges,
            self.moment.closed.reshape(-1, len(self.x)),
            self.moment.stick & ~self.moment.at_limit,
            self.pressures,
            law.friction * self.pressures.sum(axis=0),
            self.shear_traction,
            fixed(self.problem),
            law.corners,
        )

    @property
    def zones_by_name(self) -> Zones:
        return self._fitted[0]

    @cached_property
    def jumping(self) -> NDArray[np.integer[Any]]:
        """Numbers of cells with a jump of q/f by more than half of the pressure."""
        p, q = self.pressures.sum(axis=0), self.shear_traction / cast(Any, self.problem.law).friction
        jumping = (p[1:] > 0) & (p[:-1] > 0) & (np.abs(np.diff(q)) > (p[1:] + p[:-1]) / 4)
        return np.flatnonzero(jumping)

    @property
    def lost_in_jumps(self) -> float:
        """Relative L2 error of q/f where it jumps."""
        p, f, at = self.pressures.sum(axis=0), cast(Any, self.problem.law).friction, self.jumping
        half = (self.shear_traction[at + 1] - self.shear_traction[at]) / f / 2
        lost = half**2 @ (self.norm[at] + self.norm[at + 1])
        return float(np.sqrt(lost / (self.norm @ p**2)))

    @cached_property
    def norm(self) -> Array:
        """Weights of errors, array (n,); at an edge of the obstacle times the distance."""
        own = self.problem
        ends = distance_to_ends(self.x, getattr(own.obstacle, "ends", ()), own.law.shifts(own.ell))
        return self.weights * np.broadcast_to(ends, len(self.x))

    @property
    def doubts(self) -> dict[float, float]:
        return self._fitted[1]

    @property
    def zone_errors(self) -> ZoneErrors | None:
        """Errors of the edges of `zones_by_name`: change from the level before plus doubt."""
        if self.before is None:
            return None

        def errors(own: list[Interval], others: list[Interval]) -> list[Interval] | None:
            if len(own) != len(others) or len(common(own, others)) != len(own):
                return None
            doubts = np.reshape([self.doubts[end] for pair in own for end in pair], (-1, 2))
            return [
                (float(a), float(b))
                for a, b in np.abs(np.reshape(own, (-1, 2)) - np.reshape(others, (-1, 2))) + doubts
            ]

        return {name: errors(own, self.before[name]) for name, own in self.zones_by_name.items()}

    def _cell(self, x: Array) -> tuple[NDArray[np.integer[Any]], Flags]:
        number = np.clip(np.searchsorted(self.edges[:, 0], x, side="right") - 1, 0, len(self.edges) - 1)
        return number, (x >= self.edges[number, 0]) & (x <= self.edges[number, 1])

    def pressure(self, corner: int, x: Array) -> Array:
        """Pressure of a corner at x, array (n,): a polygon through the centres."""
        number, inside = self._cell(x)
        closed = self.moment.closed.reshape(-1, len(self.x))[corner][number]
        return np.where(inside & closed, np.interp(x, self.x, self.pressures[corner]), 0.0)

    def gap(self, corner: int, x: Array) -> Array:
        """Gap of a corner at x, array (n,); BadArgument beyond the cells."""
        low, high = self.edges[0, 0], self.edges[-1, 1]
        if not np.all((x >= low) & (x <= high)):
            raise BadArgument("x", x, f"must lie within the cells, from {low} to {high}")
        over = self.moment.raised.reshape(-1, len(self.x))[corner]
        initial = self.problem.initial_gap(np.full(len(x), corner), x) - self.approach
        return initial + np.interp(x, self.x, over)


@dataclass(frozen=True, eq=False)
class _Level:
    edges: Array
    solutions: list[FrictionCells]
    events: list[Event]
    band: float


@dataclass(frozen=True)
class FrictionSolver:
    """Histories of one Contact through pairs of loads, array (n, 2); `solver` is that without history."""

    solver: Any
    pairs: Array
    coupled: bool

    @cached_property
    def problem(self) -> Problem:
        plain: Problem = replace(self.solver.problem, mirror=False)
        found = picture.picture(plain, float(self.pairs[:, 0].max()))
        return replace(plain, picture=found)

    def history(self, rtol: float | None, progress: bool) -> History:
        """Returns the History to rtol; NotConverged if it is out of reach."""
        rtol, best = 1e-2 if rtol is None else rtol, np.inf
        numbers = range(5)
        try:
            for number, finer, coarser, changes in levels(self.level, numbers, _change, progress):
                errors: Any = changes[-1] if changes else [np.inf]
                best = min(best, max(errors))
                if best <= rtol:
                    parts = zip(finer.solutions, coarser.solutions, map(Errors, errors))
                    states = [
                        State(replace(one, estimate=error, before=other.zones_by_name))
                        for one, other, error in parts
                    ]
                    found = _with_errors(finer.events, coarser.events)
                    return History(self.solver.contact, states, found)
                if best > rtol * 2.0 ** (3 * (numbers[-1] - number)) and changes:
                    break  # the levels that are left would not do, at the fastest ratio of changes
        except NotConverged as failure:
            if not np.isfinite(best):
                raise
            raise out_of_reach(rtol, best, f" ({failure})") from failure
        raise out_of_reach(rtol, best)

    def level(self, number: int, before: _Level | None) -> _Level:
        """Returns the history on finer cells towards the edges of the level before."""
        assert self.problem.picture is not None
        # length of a cell over the half-width, at that distance of an edge
        a, fineness = self.problem.picture.half_width, 0.16 / 2**number
        width = sum(right - left for left, right in self.problem.stretches)
        first = max(a / 10, width / 200)
        # smaller cells at edges than a quarter of the square of the fineness gain nothing
        smallest = max(fineness**2 * a / 4, (first if before is None else before.band) / 8)
        features, reach = touching(self.problem, fineness), None
        if before is not None:
            known = _features(before, smallest)
            features += known
            reach = (known[0].place, known[-1].place) if known else None
        edges = cells(self.problem, fineness if before else first / a, features, reach)
        corners = len(self.problem.law.corners)
        forces = corners + (1 if self.problem.counter is None else corners)
        cost.require_history(len(edges), forces * len(edges), len(self.pairs))
        walk = Walk(self, edges)
        solutions = [walk.to(float(P), float(Q)) for P, Q in self.pairs]
        found = events(walk.path.changes, walk.path.contact.friction, edges, self.pairs)
        return _Level(edges, solutions, found, first if before is None else smallest)

    def walk(self) -> Walk:
        return Walk(self, self.level(1, self.level(0, None)).edges)

    def on(self, edges: Array) -> tuple[FrictionalContact, FrictionalContact]:
        """Returns the problem on cells, without and with a second body."""
        points, weights = gauss_rule(4)
        places = edges[:, :1] + (edges[:, 1:] - edges[:, :1]) * points
        gaps = self.problem.initial_gaps(places.ravel()).reshape(-1, *places.shape) @ weights
        own = frictional_contact(self.problem, edges, gaps, self.coupled)
        return own, with_counter(own, self.problem, edges)

    def require_inside(self, edges: Array, moment: Moment) -> None:
        """NotConverged where a corner touches at the end of the cells and the obstacle goes on."""
        closed = edges[moment.closed.reshape(-1, len(edges)).any(axis=0)]
        ends = np.ravel(list(self.problem.ends.values()))
        for place in np.intersect1d(closed, self.problem.stretches):
            if not np.isclose(place, ends, rtol=1e-9, atol=0.0).any():
                raise NotConverged(f"the contact reaches x = {place:g}, beyond which no contact was expected")


def _features(before: _Level, smallest: float) -> list[Feature]:
    found: list[Feature] = []
    edges = {edge: doubt for one in before.solutions for edge, doubt in one.doubts.items()}
    edges |= {float(edge): before.band for one in before.solutions for edge in one.edges[one.jumping, 1]}
    for edge, doubt in sorted(edges.items()):
        band = min(max(4 * doubt, smallest), before.band)
        if not found or edge - found[-1].place > smallest:
            found.append(Feature(edge, band, smallest))
        else:
            found[-1] = replace(found[-1], band=max(band, found[-1].band))
    return found


def _change(coarser: _Level, finer: _Level) -> Any:
    pairs: Any = zip(finer.solutions, coarser.solutions)
    return [
        max(change(one, other, one.norm, one.problem.ell, one.problem.law.friction), one.lost_in_jumps)
        for one, other in pairs
    ]


def _with_errors(finer: list[Event], coarser: list[Event]) -> list[Event]:
    """The finer level's events, in order, with their distance to the coarser ones."""
    if [(one.pair, one.kind) for one in finer] != [(one.pair, one.kind) for one in coarser]:
        return finer
    places: list[Any] = [[(one.load, one.shear) for one in level] for level in (finer, coarser)]
    errors = np.abs(np.subtract(*places)).reshape(-1, 2).sum(axis=1)
    return [replace(one, load_error=float(error)) for one, error in zip(finer, errors)]


def _by_cell(moment: Moment, n: int) -> Moment:
    """The Moment of cells with tangential forces of corners."""
    t, closed = moment.tangential.reshape(-1, n), moment.closed.reshape(-1, n)
    if len(t) == 1:
        return moment
    normal, still = moment.normal.reshape(-1, n), moment.stick.reshape(-1, n)
    slip = (normal * moment.slip.reshape(-1, n)).sum(axis=0) / np.maximum(
        normal.sum(axis=0), np.finfo(float).tiny
    )
    limit = np.all(moment.at_limit.reshape(-1, n) | ~closed, axis=0) & closed.any(axis=0)
    together = np.abs(t.sum(axis=0)) >= (1 - AT_LIMIT) * np.abs(t).sum(axis=0)
    return replace(
        moment,
        tangential=t.sum(axis=0),
        slip=slip,
        stick=np.asarray(still.any(axis=0)),
        at_limit=limit & together,
    )


class Walk:
    """A history on given cells that goes on from where it is; its `path` is the Follower."""

    def __init__(self, solver: FrictionSolver, edges: Array) -> None:
        self._solver, self._edges = solver, edges
        self._own, contact = solver.on(edges)
        self.path = Follower(contact)

    def to(self, load: float, shear: float) -> FrictionCells:
        corners, n = self.path.to(load, shear), len(self._edges)
        self._solver.require_inside(self._edges, corners)
        problem, own, raised = self._solver.problem, self._own, None
        moment = _by_cell(corners, n)
        displacement, psi, moments = surface(problem, self._edges, own, moment)
        if problem.counter is not None:
            both = self.path.contact
            raised = (both.normal - own.normal) @ corners.normal
            raised += (both.cross - np.tile(own.cross, (both.nodes // n, 1))).T @ corners.tangential
            raised = raised.reshape(-1, n)
        return FrictionCells(
            self._solver.solver, problem, self._edges, moment, psi, displacement, moments, raised
        )
