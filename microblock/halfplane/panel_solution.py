"""A state on panels fitted to the zones of each corner."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..model.intervals import contains, distance, without, zone_edges
from ..model.law import horizontal_surface
from ..model.problem import Problem
from ..model.quadrature import lagrange
from ..model.solution import ErrorParts, LineSolution
from ..model.surface import Surface
from ..model.types import Array, CornerZones, Integers, Interval
from ..threads import bounded
from .kernels import both_gap_kernels, clamping_kernel, gap_kernel
from .panels import Kernel, PanelGrid, response
from .second_body_kernel import second_body_kernel
from .subsurface import HalfPlaneBelow
from .surface_loads import PanelLoads
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
    next_zones : zones after one more step
    notes : sentences
    """

    problem: Problem
    load: float
    zones: CornerZones
    panels: PanelGrid
    q: Array
    approach: float
    iterations: int
    estimate: PanelErrors
    next_zones: Any = None
    solver: Any = None  # a Solver, which puts itself in
    notes: tuple[str, ...] = ()

    method = "panels"

    @property
    def residual(self) -> float:
        return self.estimate.conditions

    @property
    def unknowns(self) -> int:
        return len(self.q) + 1

    @cached_property
    def all_zones(self) -> CornerZones:
        """{corner number: ((left, right), ...)} of all corners, also those known by symmetry."""
        return self.problem.all_zones(self.zones)

    @cached_property
    def whole(self) -> tuple[PanelGrid, Array]:
        """The panels of all corners, and q, array (panels, order)."""
        panels = self.panels.whole(self.problem)
        return panels, np.resize(self.q, (len(panels.e), panels.order))

    @cached_property
    def _at_anchors(self) -> Array:
        """q at the anchors of root panels, but for fixed edges: those of the obstacle, and those at its
        apexes (`edges.APEX_WIDTH`).
        """
        panels, rows = self.whole
        ends = [end for pair in self.problem.ends.values() for end in pair if np.isfinite(end)]
        ends += [edge for edge in zone_edges(self.zones) if edge in self.problem.kinks]
        ends += [-end for end in ends if self.problem.mirror]
        infinite = transmitted_singularities(self.problem, dict.fromkeys(ends, 1.0), panels.order)
        values = rows @ lagrange(panels.points[0], np.zeros(1))[0]
        return np.where(panels.root & ~np.isin(panels.e, infinite), values, 0.0)

    def pressure(self, corner: int, x: Array) -> Array:
        return np.maximum(self.traction(corner, x), 0.0)

    def traction(self, corner: int, x: Array) -> Array:
        """Returns pressure or tension of a corner at x, array (n,)."""
        x = np.asarray(x, float)
        traction = np.zeros_like(x)
        inside = contains(self.all_zones[corner], x)
        if inside.any():
            panels, rows = self.whole
            panel, v = panels.locate(corner, x[inside])
            v = np.maximum(v, 1e-10)  # at an edge or a kink the pressure is 0/0 or infinite
            q = panels.interpolated(rows, panel, v) - self._at_anchors[panel]
            traction[inside] = q / panels.slope(panel, v) + panels.logarithm(panel, v)
        return traction

    @cached_property
    def x(self) -> Array:
        x = np.sort(self.whole[0].nodes[2])
        return x[np.concatenate(([True], np.diff(x) > 1e-13 * (x[-1] - x[0])))]

    @cached_property
    def weights(self) -> Array:
        weights = np.zeros_like(self.x)
        weights[self._numbers] = self.whole[0].rule
        return weights

    @cached_property
    def _numbers(self) -> Integers:
        """Numbers of the points `x` at the nodes, array (m,)."""
        return np.searchsorted((self.x[1:] + self.x[:-1]) / 2, self.whole[0].nodes[2])

    @cached_property
    def pressures(self) -> Array:
        """Pressure of each corner at `x`, array (corners, n): 0 where the error of an edge leaves tension."""
        return self._carrying(np.maximum(self.tractions, 0.0))

    @cached_property
    def tractions(self) -> Array:
        """Pressure or tension of each corner at `x`, array (corners, n)."""
        panels, rows = self.whole
        panel, v, _, _ = panels.nodes
        at_edges = [e in np.ravel(self.all_zones[corner]) for e, corner in zip(panels.e, panels.corner)]
        q = rows.ravel() - np.where(at_edges, self._at_anchors, 0.0)[panel]
        tractions = np.zeros((len(self.problem.law.corners), len(self.x)))
        at_nodes = panels.corner[panel], self._numbers
        tractions[at_nodes] = q / panels.slope(panel, v) + panels.logarithm(panel, v)
        return self._carrying(tractions)

    def _carrying(self, pressures: Array) -> Array:
        """Returns pressures scaled to the load, arrays (corners, n)."""
        return pressures * (self.load / (self.weights @ pressures.sum(axis=0)))

    def reaction(self, x: Array) -> Array:
        """Returns M that holds psi = 0 at x, arrays (n,)."""
        return self.integral(x, np.zeros_like(x), clamping_kernel)

    @cached_property
    def _at_points(self) -> tuple[Array, Array]:
        """Displacement and microrotation at `x`, of one integral."""
        return self.displacement_and_rotation(self.x)

    @property
    def psi(self) -> Array:
        return self._at_points[1]

    @property
    def displacement(self) -> Array:
        return self._at_points[0]

    def displacement_and_rotation(self, x: Array) -> tuple[Array, Array]:
        """Returns -u.n and the microrotation of the surface at x, arrays (n,)."""
        lever = np.zeros_like(x)
        if self.problem.law.clamps_rotation:
            return self.integral(x, lever, gap_kernel), lever
        displacement, with_lever = self.integral(x, lever, both_gap_kernels)
        return displacement, 2 / self.problem.solid.ell * (with_lever - displacement)

    def integral(
        self, x: Array, lever: Array, kernel: Kernel, shifts: tuple[float, ...] = (0.0, 0.0)
    ) -> Array:
        """Returns the integrals of a kernel against the pressures, as `response`: array (n,) or (values,
        n).
        """
        matrix, logarithms = response(self.problem, self.panels, x, lever, kernel, shifts)
        return matrix @ self.q + logarithms

    def gap(self, corner: int, x: Array) -> Array:
        numbers = np.full(len(x), corner)
        return (
            self.problem.initial_gap(numbers, x)
            - self.approach
            + self.integral(x, self.problem.lever(numbers, x), gap_kernel)
            + self.counter_displacement(x - self.problem.shifts[corner])
        )

    def counter_displacement(self, x: Array) -> Array:
        """Returns the displacement of the second surface at x, arrays (n,)."""
        lever = np.zeros_like(x)
        if self.problem.counter is None:
            return lever
        return self.integral(x, lever, second_body_kernel, self.problem.shifts)

    @bounded
    def surface(self, window: Interval | None = None) -> Surface:
        """Returns the Surface at `x` and out of contact within a window (left, right), or around the
        contact.
        """
        contact = self.zones_by_name["contact"]
        margin = 0.3 * (contact[-1][1] - contact[0][0]) + 2 * self.problem.solid.ell
        holes = [window or (contact[0][0] - margin, contact[-1][1] + margin)]
        for zone in contact:
            holes = without(holes, *zone)
        fractions = (1 - np.cos(np.pi * np.linspace(0, 1, 30))) / 2
        x = np.unique(np.concatenate([self.x, *(left + (right - left) * fractions for left, right in holes)]))
        values = np.zeros((len(self.pressures) + 1, len(x)))
        values[:, np.searchsorted(x, self.x)] = *self.pressures, self.micromoment
        if self.problem.law.clamps_rotation:
            values[-1] = self.reaction(x)
        displacement, psi = self.displacement_and_rotation(x)
        return self.surface_at(*horizontal_surface(x), values[:-1], values[-1], psi, displacement)

    @property
    def shear_terms(self) -> Sequence[tuple[float, Any]]:
        """Factors of the pressures of other solutions in the shear traction."""
        return ()

    @cached_property
    def fields(self) -> HalfPlaneBelow:
        problem = self.problem
        clamped = problem.law.clamps_rotation
        shear = [PanelLoads(solution, factor) for factor, solution in self.shear_terms]
        second = None
        if problem.counter is not None:  # shear acts oppositely on it
            opposite = [PanelLoads(solution, -factor) for factor, solution in self.shear_terms]
            loads = PanelLoads(self, shifts=problem.shifts)
            second = HalfPlaneBelow(problem.counter, False, [loads, *opposite], upper=True)
        return HalfPlaneBelow(problem.solid, clamped, [PanelLoads(self), *shear], second=second)


class PanelSolution(OnPanels):
    """A solution without friction."""


def relative_change(coarse: OnPanels, fine: OnPanels) -> float:
    """Returns max(|dp|, |dM|/ell)/|p| in L2 between two solutions of one problem."""
    problem = fine.problem
    x = fine.x
    p = np.array([coarse.traction(corner, x) for corner in fine.all_zones]) - fine.tractions
    if problem.law.clamps_rotation:
        moment = coarse.reaction(x) - fine.micromoment
    else:
        moment = problem.ell / 2 * np.sum(problem.levers(x) * p, axis=0)
    return distance(fine.weights, p.sum(axis=0), moment / problem.ell, fine.tractions.sum(axis=0))
