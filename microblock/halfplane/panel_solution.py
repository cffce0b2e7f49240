"""A state on panels fitted to the zones of each corner."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..model.problem import Problem, half_line, level_surface
from ..model.quadrature import lagrange
from ..model.state import ErrorParts, LineSolution, surface
from ..model.types import CornerZones
from ..model.zones import contains, distance, moved_on
from ..threads import bounded
from .carried import carried
from .counter import counter_response
from .kernels import both_gap_kernels, clamping_kernel, gap_kernel
from .panels import Panels, response


@dataclass(frozen=True)
class Estimate(ErrorParts):
    """Parts of the relative L2 error of pressure and micromoment; `total` is their sum.

    Attributes
    ----------
    discretisation : float, distance to the next coarser order; None where the order was prescribed
    edges : float, what pressures at the edges are worth
    kernel : float, what rounding of the kernel does
    conditions : float, what violations of (26) are worth
    """

    discretisation: float | None
    edges: float
    kernel: float
    conditions: float = 0.0


@dataclass(frozen=True, eq=False, repr=False)
class PanelSolution(LineSolution):
    """A solution on fitted panels.

    Attributes
    ----------
    problem : Problem
    load : float, force per thickness
    zones : {corner number: ((left, right), ...)} of the corners that are computed
    panels, q : the unknowns, see `microblock.halfplane.panels`
    approach : float, up to a constant
    iterations : int, steps of Newton's method
    estimate : Estimate
    least : ((corner, x, gap), ...), local minima of the gaps out of contact
    further : zones after one more step
    solver : PanelSolver
    """

    problem: Problem
    load: float
    zones: dict
    panels: Panels
    q: np.ndarray
    approach: float
    iterations: int
    estimate: Estimate
    least: tuple = ()
    further: Any = None
    solver: Any = None  # a Solver, which puts itself in

    method = "panels"

    @property
    def residual(self):
        """What violations of (26) are worth in the norm of the error."""
        return self.estimate.conditions

    @property
    def unknowns(self):
        return len(self.q) + 1

    @cached_property
    def all_zones(self) -> CornerZones:
        """{corner number: ((left, right), ...)} of all corners, also those known by symmetry."""
        return self.problem.all_zones(self.zones)

    def moved_on(self, earlier, share):
        moved = moved_on(self.all_zones, earlier.all_zones, share)
        return replace(self, zones={corner: moved[corner] for corner in self.zones}) if moved else self

    @cached_property
    def _anchored(self):
        """q at the anchor of each panel with a square root, but for edges that the obstacle fixes."""
        basis = lagrange(self.panels.points[0], np.zeros(1))[0]
        values = self.q.reshape(-1, self.panels.order) @ basis
        ends = [end for ends in self.problem.ends.values() for end in ends]
        ends += [-end for end in ends if self.problem.mirror]
        infinite = carried(self.problem, ends, self.panels.order)
        return np.where(self.panels.root & ~np.isin(self.panels.e, infinite), values, 0.0)

    @cached_property
    def _at_own_edges(self):
        own = [
            {edge for interval in self.zones[corner] for edge in interval} for corner in self.panels.corner
        ]
        return np.where([e in edges for e, edges in zip(self.panels.e, own)], self._anchored, 0.0)

    def pressure(self, corner, x):
        x = np.asarray(x, float)
        if half_line(self.problem):
            x = np.abs(x)
        elif self.problem.mirror and corner == 1:
            return self.pressure(0, -x)
        found, here = np.zeros_like(x), np.flatnonzero(contains(self.zones[corner], x))
        if len(here):
            number, v = self.panels.at(corner, x[here])
            v = np.maximum(v, 1e-10)  # at an edge or a kink the pressure is 0/0 or infinite
            rows = self.q.reshape(-1, self.panels.order)
            q = self.panels.interpolated(rows, number, v) - self._anchored[number]
            found[here] = q / self.panels.slope(number, v) + self.panels.logarithm(number, v)
        return found

    @cached_property
    def x(self):
        x = self.panels.nodes[2]
        return _distinct(np.concatenate((x, -x)) if self.problem.mirror else x)

    @cached_property
    def weights(self):
        x, weights = self.panels.nodes[2], self.panels.rule
        if self.problem.mirror:
            x, weights = np.concatenate((x, -x)), np.tile(weights, 2)
        found = np.zeros_like(self.x)
        found[_places(self.x, x)] = weights
        return found

    @cached_property
    def pressures(self):
        """Pressure of each corner at `x`, array (corners, n), brought to the load."""
        panel, v, x, _ = self.panels.nodes
        p = (self.q - self._at_own_edges[panel]) / self.panels.slope(panel, v) + self.panels.logarithm(
            panel, v
        )
        found = np.zeros((len(self.problem.law.corners), len(self.x)))
        found[self.panels.corner[panel], _places(self.x, x)] = p
        if self.problem.mirror:
            found = found + found[::-1, ::-1]
        return found * (self.load / (self.weights @ found.sum(axis=0)))

    def _reaction_at_nodes(self):
        return self.reaction(self.x)

    def reaction(self, x):
        """M that holds psi = 0 at x, array (n,)."""
        return self._response(x, np.zeros_like(x), clamping_kernel)

    @cached_property
    def psi(self):
        return self.rotation(self.x)

    @cached_property
    def displacement(self):
        return self.displacement_at(self.x, np.zeros_like(self.x))

    def rotation(self, x):
        if self.problem.law.clamps_rotation:
            return np.zeros_like(x)
        return self.displacement_and_rotation(x)[1]

    def displacement_and_rotation(self, x):
        """-u.n and the microrotation of the surface at x, arrays (n,)."""
        none = np.zeros_like(x)
        if self.problem.law.clamps_rotation:
            return self.displacement_at(x, none), none
        without, with_lever = self._response(x, none, both_gap_kernels)
        return without, 2 / self.problem.solid.ell * (with_lever - without)

    def _response(self, x, lever, kernel):
        matrix, known = response(self.problem, self.panels, x, lever, kernel)
        return matrix @ self.q + known

    def displacement_at(self, x, lever):
        """u, or the gap without height and approach of a corner with such levers, at x, array (n,)."""
        return self._response(x, lever, gap_kernel)

    def gaps(self, corner, x):
        numbers = np.full(len(x), corner)
        return (
            self.problem.initial_gap(numbers, x)
            - self.approach
            + self.displacement_at(x, self.problem.lever(numbers, x))
            + self.counter_displacement(x - np.array(self.problem.shifts)[numbers])
        )

    gap = gaps  # of a State's contract

    def counter_displacement(self, x):
        if self.problem.counter is None:
            return np.zeros_like(x)
        matrix, known = counter_response(self.problem, self.panels, x)
        return matrix @ self.q + known

    @bounded
    def surface(self, window=None):
        """The Surface at `x` and out of contact within a window (left, right), or around the contact."""
        contact = self.zones_by_name["contact"]
        margin = 0.3 * (contact[-1][1] - contact[0][0]) + 2 * self.problem.solid.ell
        left, right = window or (contact[0][0] - margin, contact[-1][1] + margin)
        ends = [left, *(edge for interval in contact for edge in interval if left < edge < right), right]
        share = (1 - np.cos(np.pi * np.linspace(0, 1, 30))) / 2
        outside = np.concatenate(
            [
                one + (other - one) * share
                for one, other in zip(ends, ends[1:])
                if not any(a <= (one + other) / 2 <= b for a, b in contact)
            ]
            or [np.array((left, right))]
        )
        x, own = np.concatenate((outside, self.x)), np.arange(len(outside), len(outside) + len(self.x))
        x, first = np.unique(x, return_index=True)
        values = np.zeros((len(self.pressures) + 1, len(outside) + len(self.x)))
        values[:-1, own], values[-1, own] = self.pressures, self.micromoment
        if self.problem.law.clamps_rotation:
            values[-1, : len(outside)] = self.reaction(outside)
        values = values[:, first]
        displacement, psi = self.displacement_and_rotation(x)
        return surface(
            self.problem,
            self.approach,
            *level_surface(x),
            pressures=values[:-1],
            micromoment=values[-1],
            psi=psi,
            displacement=displacement,
            counter=None if self.problem.counter is None else self.counter_displacement,
        )

    @cached_property
    def fields(self):
        from .subsurface import FieldsBelow

        return FieldsBelow(self)

    def fields_below(self, box):
        """Points, psi and stresses in a box ((left, right), depth) below the surface."""
        from ..view.below import half_plane_grid

        x1, x2, triangles = half_plane_grid(box)
        found = self.fields(x1, x2)
        return x1, x2, triangles, found.psi, found.stress


def difference(coarse, fine):
    """max(|dp|, |dM|/ell)/|p| in L2 over the contact, between two solutions of one problem."""
    x, weights, ell = fine.x, fine.weights, fine.problem.solid.ell
    p = np.array([coarse.pressure(corner, x) for corner in range(len(fine.pressures))])
    if fine.problem.law.clamps_rotation:
        moment = (coarse.reaction(x) - fine.micromoment) / ell
    else:
        levers = [fine.problem.lever(np.full(len(x), corner), x) for corner in range(len(p))]
        moment = (ell / 2 * np.sum(levers * p, axis=0) - fine.micromoment) / ell
    total = fine.pressures.sum(axis=0)
    return distance(weights, p.sum(axis=0) - total, moment, total)


def _distinct(x):
    x = np.sort(x)
    return x[np.concatenate(([True], np.diff(x) > 1e-13 * (x[-1] - x[0])))]


def _places(sorted_x, x):
    right = np.clip(np.searchsorted(sorted_x, x), 1, len(sorted_x) - 1)
    return np.where(np.abs(sorted_x[right - 1] - x) < np.abs(sorted_x[right] - x), right - 1, right)
