"""A state on panels fitted to the zones of each corner."""

from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np

from ..model.intervals import contains, distance, without, zone_edges
from ..model.law import level_surface
from ..model.problem import Problem
from ..model.quadrature import lagrange
from ..model.state import ErrorParts, LineSolution
from ..model.types import CornerZones
from ..threads import bounded
from .kernels import both_gap_kernels, clamping_kernel, gap_kernel
from .panels import PanelGrid, response
from .second_half_plane import second_body_kernel
from .subsurface import fields_at
from .transmitted_singularities import transmitted_singularities


@dataclass(frozen=True)
class PanelErrors(ErrorParts):
    """Parts of the relative L2 error of pressure and micromoment; `total` is their sum.

    Attributes
    ----------
    discretisation : distance to the next coarser order; None where the order was prescribed
    edges : of pressures at the edges
    kernel : of the kernel's rounding
    conditions : of violations of (26)
    """

    discretisation: float | None
    edges: float
    kernel: float
    conditions: float = 0.0


@dataclass(frozen=True, eq=False, repr=False)
class OnPanels(LineSolution):
    """Base of solutions on fitted panels.

    Attributes
    ----------
    load : force per thickness
    zones : {corner number: ((left, right), ...)} of the corners that are computed
    panels, q : the unknowns, see `microblock.halfplane.panels`
    approach : up to a constant
    iterations : steps of Newton's method
    further : zones after one more step
    notes : sentences
    """

    problem: Problem
    load: float
    zones: CornerZones
    panels: PanelGrid
    q: np.ndarray
    approach: float
    iterations: int
    estimate: PanelErrors
    further: Any = None
    solver: Any = None  # a Solver, which puts itself in
    notes: tuple = ()

    method = "panels"

    @property
    def residual(self):
        return self.estimate.conditions

    @property
    def unknowns(self):
        return len(self.q) + 1

    @cached_property
    def all_zones(self) -> CornerZones:
        """{corner number: ((left, right), ...)} of all corners, also those known by symmetry."""
        return self.problem.all_zones(self.zones)

    @cached_property
    def whole(self):
        """The panels of all corners, and q, array (panels, order)."""
        panels = self.panels.whole(self.problem)
        return panels, np.resize(self.q, (len(panels.e), panels.order))

    @cached_property
    def _anchored(self):
        """q at the anchors of root panels, but for fixed edges: those of the obstacle, and those at its tips
        (`edges.TIP_WIDTH`).
        """
        panels, rows = self.whole
        ends = [end for ends in self.problem.ends.values() for end in ends if np.isfinite(end)]
        ends += [edge for edge in zone_edges(self.zones) if edge in self.problem.kinks]
        ends += [-end for end in ends if self.problem.mirror]
        infinite = transmitted_singularities(self.problem, dict.fromkeys(ends, 1.0), panels.order)
        values = rows @ lagrange(panels.points[0], np.zeros(1))[0]
        return np.where(panels.root & ~np.isin(panels.e, infinite), values, 0.0)

    def pressure(self, corner, x):
        return np.maximum(self.traction(corner, x), 0.0)

    def traction(self, corner, x):
        """Pressure or tension of a corner at x, array (n,)."""
        x = np.asarray(x, float)
        found, here = np.zeros_like(x), np.flatnonzero(contains(self.all_zones[corner], x))
        if len(here):
            panels, rows = self.whole
            number, v = panels.at(corner, x[here])
            v = np.maximum(v, 1e-10)  # at an edge or a kink the pressure is 0/0 or infinite
            q = panels.interpolated(rows, number, v) - self._anchored[number]
            found[here] = q / panels.slope(number, v) + panels.logarithm(number, v)
        return found

    @cached_property
    def x(self):
        x = np.sort(self.whole[0].nodes[2])
        return x[np.concatenate(([True], np.diff(x) > 1e-13 * (x[-1] - x[0])))]

    @cached_property
    def weights(self):
        found = np.zeros_like(self.x)
        found[self._numbers] = self.whole[0].rule
        return found

    @cached_property
    def _numbers(self):
        middles, panels = (self.x[1:] + self.x[:-1]) / 2, self.whole[0]
        return np.searchsorted(middles, panels.nodes[2])

    @cached_property
    def pressures(self):
        """Pressure of each corner at `x`, array (corners, n): 0 where the error of an edge leaves tension."""
        return self._carrying(np.maximum(self.tractions, 0.0))

    @cached_property
    def tractions(self):
        """Pressure or tension of each corner at `x`, array (corners, n)."""
        panels, rows = self.whole
        panel, v, _, _ = panels.nodes
        own = [e in np.ravel(self.all_zones[corner]) for e, corner in zip(panels.e, panels.corner)]
        q = rows.ravel() - np.where(own, self._anchored, 0.0)[panel]
        found = np.zeros((len(self.problem.law.corners), len(self.x)))
        found[panels.corner[panel], self._numbers] = q / panels.slope(panel, v) + panels.logarithm(panel, v)
        return self._carrying(found)

    def _carrying(self, pressures):
        """Pressures scaled to the load."""
        return pressures * (self.load / (self.weights @ pressures.sum(axis=0)))

    def reaction(self, x):
        """M that holds psi = 0 at x, array (n,)."""
        return self.integral(x, np.zeros_like(x), clamping_kernel)

    @cached_property
    def psi(self):
        return self.displacement_and_rotation(self.x)[1]

    @cached_property
    def displacement(self):
        return self.displacement_and_rotation(self.x)[0]

    def displacement_and_rotation(self, x):
        """-u.n and the microrotation of the surface at x, arrays (n,)."""
        none = np.zeros_like(x)
        if self.problem.law.clamps_rotation:
            return self.integral(x, none, gap_kernel), none
        without, with_lever = self.integral(x, none, both_gap_kernels)
        return without, 2 / self.problem.solid.ell * (with_lever - without)

    def integral(self, x, *kernel):
        matrix, known = response(self.problem, self.panels, x, *kernel)
        return matrix @ self.q + known

    def gap(self, corner, x):
        numbers = np.full(len(x), corner)
        return (
            self.problem.initial_gap(numbers, x)
            - self.approach
            + self.integral(x, self.problem.lever(numbers, x), gap_kernel)
            + self.counter_displacement(x - self.problem.shifts[corner])
        )

    def counter_displacement(self, x):
        none = np.zeros_like(x)
        if self.problem.counter is None:
            return none
        return self.integral(x, none, second_body_kernel, self.problem.shifts)

    @bounded
    def surface(self, window=None):
        """The Surface at `x` and out of contact within a window (left, right), or around the contact."""
        contact = self.zones_by_name["contact"]
        margin = 0.3 * (contact[-1][1] - contact[0][0]) + 2 * self.problem.solid.ell
        holes = [window or (contact[0][0] - margin, contact[-1][1] + margin)]
        for zone in contact:
            holes = without(holes, *zone)
        share = (1 - np.cos(np.pi * np.linspace(0, 1, 30))) / 2
        x = np.unique(np.concatenate([self.x, *(left + (right - left) * share for left, right in holes)]))
        values = np.zeros((len(self.pressures) + 1, len(x)))
        values[:, np.searchsorted(x, self.x)] = *self.pressures, self.micromoment
        if self.problem.law.clamps_rotation:
            values[-1] = self.reaction(x)
        displacement, psi = self.displacement_and_rotation(x)
        return self.surface_at(*level_surface(x), values[:-1], values[-1], psi, displacement)


class PanelSolution(OnPanels):
    """A solution without friction, which knows the fields below."""

    @cached_property
    def fields(self):
        return partial(fields_at, self)

    def fields_below(self, box):
        """Points, psi and stresses in a box ((left, right), depth) below the surface."""
        from ..view.below import half_plane_grid

        x1, x2, triangles = half_plane_grid(box)
        found = self.fields(x1, x2)
        return x1, x2, triangles, found.psi, found.stress


def relative_change(coarse, fine):
    """max(|dp|, |dM|/ell)/|p| in L2 between two solutions of one problem."""
    x, weights, ell = fine.x, fine.weights, fine.problem.solid.ell
    own, total = fine.tractions, fine.tractions.sum(axis=0)
    p = np.array([coarse.traction(corner, x) for corner in fine.all_zones]) - own
    moment = ell / 2 * np.sum(fine.problem.levers(x) * p, axis=0)
    if fine.problem.law.clamps_rotation:
        moment = coarse.reaction(x) - fine.micromoment
    return distance(weights, p.sum(axis=0), moment / ell, total)
