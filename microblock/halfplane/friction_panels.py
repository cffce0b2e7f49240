"""Histories of frictional contact between equal bodies on panels by `friction_memory`."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np

from ..corners.friction_events import legs
from ..errors import BadArgument, NotConverged, out_of_reach
from ..model.events import Event
from ..model.history import History
from ..model.quadrature import gauss_rule
from ..model.state import Solution, State
from ..model.zones import common, contains, without
from .friction_memory import Memory
from .kernels import kernels
from .panel_solution import PanelSolution
from .panels import response


def require_superposition(contact: Any, order: int | None) -> None:
    """BadArgument unless the bodies are equal, the law is unilateral, and rtol chooses the order."""
    if order is not None:
        raise BadArgument("method", contact.method, "must be Panels() without an order: rtol chooses it")
    counter = getattr(contact.obstacle, "body", None)
    equal = counter is not None and counter.solid == contact.solid
    if not equal or len(contact.law.corners) != 1 or contact.law.clamps_rotation:
        raise BadArgument(
            "method",
            "Panels",
            "follows friction between two equal bodies (Deformable) under the law Unilateral alone, where "
            "shear and pressure do not act on each other: take method=Cells()",
        )


class FrictionPanels:
    """Histories of one Contact of a PanelSolver through pairs, array (n, 2)."""

    def __init__(self, solver, pairs):
        require_superposition(solver.contact, solver.options.order)
        self.solver, self.pairs, self.friction = solver, pairs, float(solver.law.friction)
        self.memories = [Memory()]
        for P, Q in pairs:
            self.memories.append(self.memories[-1].to(float(P), float(Q), self.friction))

    def history(self, rtol):
        """Returns the History to rtol; NotConverged if it is out of reach."""
        rtol = asked = 1e-6 if rtol is None else rtol
        worst = np.inf
        for _ in range(2):  # shear is a sum of several states
            try:
                solutions = self._solutions(asked)
            except NotConverged as failure:
                if worst == np.inf:
                    raise
                raise out_of_reach(rtol, worst) from failure
            worst = max(one.error_estimate for one in solutions)
            if worst <= rtol:
                return History(self.solver.contact, [State(one) for one in solutions], self._events())
            asked = rtol * rtol / worst / 4
        raise out_of_reach(rtol, worst)

    def _solutions(self, rtol):
        self._rtol, self._known = rtol, {}
        dissipation, first, found = 0.0, [], []
        for memory in self.memories[1:]:
            rubbed = sum(self.friction * abs(one.change) * self._rubbed(one) for one in memory.slipped)
            dissipation += max(0.0, rubbed)  # under a punch it is a difference of equal numbers
            if not first or memory.load > first[-1].load:
                first.append(memory)
            found.append(PanelFriction(self, memory, tuple(first), dissipation))
        self._require_growing()
        return found

    def at(self, load) -> PanelSolution:
        if load not in self._known:
            self._known[load] = self.solver.at(load, self._rtol, fallback=False)
        return self._known[load]

    def contact_at(self, load):
        """Contact zones at a load, [(left, right), ...]."""
        return self.at(load).zones_by_name["contact"]

    def _require_growing(self):
        """NotConverged unless contacts grow with the load."""
        for low, high in pairwise(sorted(self._known)):
            outer = self.contact_at(high)
            slack = 1e-3 * (outer[-1][1] - outer[0][0])  # edges have errors
            for left, right in self.contact_at(low):
                if not any(a - slack <= left and right <= b + slack for a, b in outer):
                    raise NotConverged(
                        f"the contact at load {low:g} is not within that at load {high:g}, so that shear is "
                        "no sum of pressures: take method=Cells()"
                    )

    @property
    def _lowest(self):
        return self.solver._picture(float(self.pairs[:, 0].max())).lowest

    def scalars(self, load):
        """d, and the integrals of d over smaller loads and of p times height."""
        if load == 0:
            lowest = self.solver.problem.initial_gap(np.zeros(1, int), np.array([self._lowest]))
            return np.array([float(lowest[0]), 0.0, 0.0])
        one = self.at(load)
        work = load * one.approach
        return np.array([one.approach, work - one.energy, work - 2 * one.energy])

    def _rubbed(self, one):
        """Work of friction in a layer for g = 1: integral of P d' - d(P) + H'."""
        low, high = self.scalars(one.lower), self.scalars(one.upper)
        approach, area, height = high - low
        P, R, width = one.load_at_lower, one.load_at_upper, one.upper - one.lower
        if abs(R - P) <= 1e-9 * R:
            return R * approach - self.scalars(R)[0] * width + height
        slope, loads = (R - P) / width, (self.scalars(R) - self.scalars(P))[1]
        return R * high[0] - P * low[0] - slope * area - loads / slope + height

    def _events(self):
        found, slipped = [], False

        def note(memory, kind, zone, x):
            found.append(Event(memory.load, 0.0, kind, zone, x, memory.shear, leg))

        for leg, (*_, turns, slides) in enumerate(legs(self.pairs, self.friction)):
            before, after = self.memories[leg : leg + 2]
            ends = np.ravel(self.contact_at(after.load))
            if not leg and after.stuck:
                note(before, "born", "stick", self._lowest)
            if turns and slipped:
                note(before, "reversal", "slip", (ends[0] + ends[-1]) / 2)
            if not slipped and (after.slipped or not after.stuck):
                slipped = True
                note(before, "first slip", "slip", ends[0])
            if slides:
                note(after, "full slip", "slip", (ends[0] + ends[-1]) / 2)
        return found


def shear_kernel(problem, distance, target, source):
    """Displacement -u.n of the surface (`target` 0), or ell/2 psi (1), under a unit shear force."""
    solid = problem.solid
    along, even = kernels(solid.nu, solid.beta, solid.curvature)(distance / solid.ell, (5, 6))
    return (1 - solid.nu) / solid.mu * ((1 - target) * along - target * even)


@dataclass(frozen=True, eq=False, repr=False)
class PanelFriction(Solution):
    """A state of a history as a sum of states without friction.

    Attributes
    ----------
    plain : FrictionPanels
    memory : Memory
    first : tuple of Memory, with the largest normal forces so far
    dissipation : float
    """

    plain: Any
    memory: Memory
    first: tuple
    dissipation: float

    method = "panels"
    tangential_approach = None

    @property
    def _own(self) -> PanelSolution:
        return self.plain.at(self.memory.load)

    @cached_property
    def _parts(self):
        return self._parts_of(self.memory)

    def _parts_of(self, memory):
        """[(factor, state), ...] at a Memory."""
        steps = zip(memory.bounds[1:], memory.shares, (*memory.shares[1:], 0.0))
        return [(share - after, self.plain.at(load)) for load, share, after in steps if share != after]

    @property
    def holders(self):
        return self, self.memory, self._own

    @property
    def solver(self):
        return self.plain.solver

    @property
    def problem(self):
        return self._own.problem

    @property
    def approach(self):
        return self._own.approach

    @cached_property
    def error_estimate(self):
        """Of pressure and q/f: the sum over the parts."""
        sums = sum(abs(factor) * one.error_estimate for factor, one in self._parts)
        return max(self._own.error_estimate, sums / self.plain.friction)

    @cached_property
    def residual(self):
        """Of the parts, the loads, and the friction bound over the largest pressure."""
        p, q, w = self.pressures[0], self.shear_traction, self.weights
        beyond = (np.abs(q) - self.plain.friction * p).max() / p.max()
        missing = max(abs(w @ p - self.memory.load), abs(w @ q - self.memory.shear)) / self.memory.load
        return float(max(*(one.residual for one in self._states), beyond, missing))

    @cached_property
    def _rule(self):
        contact = self._own.zones_by_name["contact"]
        panels = [one.panels.whole(one.problem) for one in self._states]
        ends = np.concatenate([each for own in panels for each in (own.e, own.e + own.h)])
        ends = np.unique(np.concatenate((ends, np.ravel(contact))))
        size = contact[-1][1] - contact[0][0]
        ends = ends[np.concatenate(([True], np.diff(ends) > 1e-12 * size))]
        middle = (ends[1:] + ends[:-1]) / 2
        inside = contains(contact, middle)
        left, right = ends[:-1][inside, None], ends[1:][inside, None]
        points, weights = gauss_rule(16)  # clustered towards both ends
        x = left + (right - left) * np.sin(np.pi / 2 * points) ** 2
        return x.ravel(), ((right - left) * np.pi / 2 * np.sin(np.pi * points) * weights).ravel()

    @property
    def _states(self):
        return [self._own, *(one for _, one in self._parts)]

    @property
    def x(self):
        return self._rule[0]

    @property
    def weights(self):
        return self._rule[1]

    @cached_property
    def pressures(self):
        return self.pressure(0, self.x)[None]

    def pressure(self, corner, x):
        return self._own.pressure(corner, x)

    def gap(self, corner, x):
        return self._own.gap(corner, x)

    @cached_property
    def shear_traction(self):
        return sum((factor * one.pressure(0, self.x) for factor, one in self._parts), np.zeros_like(self.x))

    @cached_property
    def zones_by_name(self):
        found, stuck = self._own.zones_by_name, self.memory.stuck
        stick = common(self.plain.contact_at(stuck), found["contact"]) if stuck else []
        slip = found["contact"]
        for pair in stick:
            slip = without(slip, *pair)
        return {**found, "stick": stick, "slip": slip}

    @cached_property
    def zone_errors(self):
        errors = {}
        for load in filter(None, (self.memory.stuck, self.memory.load)):
            zones, error = self.plain.contact_at(load), self.plain.at(load).error_estimate
            size = zones[-1][1] - zones[0][0]
            errors |= {
                end: error * size / 2 * np.sqrt(size / (zone[1] - zone[0])) for zone in zones for end in zone
            }
        return {
            name: [tuple(errors[end] for end in zone) for zone in zones]
            for name, zones in self.zones_by_name.items()
        }

    def _displaced(self, memory):
        found = np.zeros_like(self.x)
        start = self.problem.initial_gap(np.zeros(len(self.x), int), self.x) - self.plain.scalars(0)[0]
        for factor, one in self._parts_of(memory):
            outside = ~contains(one.zones_by_name["contact"], self.x)
            found += factor * start
            found[outside] -= factor * one.gap(0, self.x[outside])
        return found

    @cached_property
    def slip(self):
        found, waiting = self._displaced(self.memory), np.ones(len(self.x), bool)
        begun = np.zeros_like(found)
        for memory in self.first:
            new = waiting & contains(self.plain.contact_at(memory.load), self.x)
            begun[new] = self._displaced(memory)[new]
            waiting &= ~new
        return found - begun

    @cached_property
    def energy(self):
        scalars = {one.load: self.plain.scalars(one.load) for _, one in self._parts}
        total = 0.0
        for factor, one in self._parts:
            for other, another in self._parts:
                low, high = sorted((one.load, another.load))
                total += factor * other * (low * scalars[high][0] - scalars[low][2]) / 2
        return float(self._own.energy) + total

    @property
    def work(self):
        return self.energy + self.dissipation

    def _of_shear(self, x, target):
        found, targets = np.zeros_like(x), np.full_like(x, target)
        for factor, one in self._parts:
            matrix, known = response(one.problem, one.panels, x, targets, shear_kernel)
            found += factor * (matrix @ one.q + known)
        return found

    @cached_property
    def displacement(self):
        return self._own.displacement_at(self.x, np.zeros_like(self.x)) + self._of_shear(self.x, 0.0)

    @cached_property
    def psi(self):
        return self._own.rotation(self.x) + 2 / self.problem.solid.ell * self._of_shear(self.x, 1.0)

    @property
    def micromoment(self):
        return np.zeros_like(self.x)

    def counter_displacement(self, x):
        """Displacement of the second surface at x, array (n,); shear acts oppositely on it."""
        return self._own.counter_displacement(x) - self._of_shear(x, 0.0)
