"""Histories of frictional contact between equal bodies on panels: sums of states without friction
(`friction_memory`, docs/theory/friction.md).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np

from ..errors import BadArgument, NotConverged, out_of_reach
from ..model.events import Event
from ..model.history import SLIDING, History
from ..model.quadrature import gauss_rule
from ..model.state import Solution, State
from ..model.zones import common, contains, without
from .friction_memory import Memory
from .kernels import kernels
from .panel_solution import PanelSolution
from .panels import response

NESTED = 1e-3  # of the contact, by which a smaller load's may stand out: edges have errors


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
        self.solver, self.pairs = solver, pairs

    @cached_property
    def memories(self):
        """The Memory at each pair, and the first one."""
        found = [Memory()]
        for P, Q in self.pairs:
            found.append(found[-1].to(float(P), float(Q), float(self.solver.law.friction)))
        return found

    def history(self, rtol):
        """Returns the History to rtol; NotConverged if it is out of reach."""
        rtol = 1e-6 if rtol is None else rtol
        friction, memories = float(self.solver.law.friction), self.memories
        solutions, plain = self._solutions(memories, rtol)
        worst = max(one.error_estimate for one in solutions)
        if worst > rtol:  # shear is a sum of several states
            try:
                solutions, plain = self._solutions(memories, rtol * rtol / worst / 4)
            except NotConverged as failure:
                raise out_of_reach(rtol, worst) from failure
            worst = max(one.error_estimate for one in solutions)
        if worst > rtol:
            raise out_of_reach(rtol, worst)
        states = [State(one) for one in solutions]
        return History(self.solver.contact, states, _events(memories, plain, friction))

    def _solutions(self, memories, rtol):
        plain = _Plain(self.solver, float(self.pairs[:, 0].max()), rtol)
        friction, dissipation, first, found = float(self.solver.law.friction), 0.0, [], []
        for memory in memories[1:]:
            rubbed = sum(friction * abs(one.change) * plain.rubbed(one) for one in memory.slipped)
            dissipation += max(0.0, rubbed)  # under a punch it is a difference of equal numbers
            if not first or memory.load > first[-1].load:
                first.append(memory)
            found.append(PanelFriction(self.solver, plain, memory, tuple(first), dissipation))
        plain.require_growing()
        return found, plain


class _Plain:
    def __init__(self, solver, largest, rtol):
        self._solver, self._largest, self._rtol, self._known = solver, largest, rtol, {}

    def at(self, load) -> PanelSolution:
        if load not in self._known:
            self._known[load] = self._solver.at(load, self._rtol, fallback=False)
        return self._known[load]

    def require_growing(self):
        """NotConverged unless the contact of a load holds those of smaller ones."""
        for low, high in pairwise(sorted(self._known)):
            inner, outer = (self._known[load].zones_by_name["contact"] for load in (low, high))
            size = outer[-1][1] - outer[0][0]
            for left, right in inner:
                if not any(a - NESTED * size <= left and right <= b + NESTED * size for a, b in outer):
                    raise NotConverged(
                        f"the contact at load {low:g} is not within that at load {high:g}, so that shear is "
                        "no sum of pressures: take method=Cells()"
                    )

    def scalars(self, load):
        """d, the integral of d over the loads up to this one, and that of p times the height."""
        if load == 0:
            lowest = self._solver.problem.initial_gap(np.zeros(1, int), np.array([self.lowest]))
            return float(lowest[0]), 0.0, 0.0
        one = self.at(load)
        approach, energy = float(one.approach), float(one.energy)
        return approach, load * approach - energy, load * approach - 2 * energy

    @property
    def lowest(self):
        return self._solver._picture(self._largest).lowest

    def rubbed(self, one):
        """Integral of P d' - d(P) + H' over a layer, H that of p times the height: what friction has done
        there for g = 1.
        """
        low, high = self.scalars(one.lower), self.scalars(one.upper)
        approach, area, height = (after - before for before, after in zip(low, high))
        P, R, width = one.load_at_lower, one.load_at_upper, one.upper - one.lower
        if abs(R - P) <= 1e-9 * R:
            return R * approach - self.scalars(R)[0] * width + height
        slope = (R - P) / width
        return (
            R * high[0]
            - P * low[0]
            - slope * area
            - (self.scalars(R)[1] - self.scalars(P)[1]) / slope
            + height
        )


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
    solver : PanelSolver
    plain : _Plain
    memory : Memory
    first : tuple of Memory, at which the normal force was larger than ever before
    dissipation : float
    """

    solver: Any
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
        bounds, shares = self.memory.bounds, (*self.memory.shares, 0.0)
        steps = zip(bounds[1:], shares[:-1], shares[1:])
        return [(share - after, self.plain.at(load)) for load, share, after in steps if share != after]

    @property
    def holders(self):
        return self, self.memory, self._own

    @property
    def problem(self):
        return self._own.problem

    @property
    def approach(self):
        return self._own.approach

    @property
    def notes(self):
        return self._own.notes

    @cached_property
    def error_estimate(self):
        """Of pressure, and of q over the friction: the sum of those of its parts."""
        friction = float(self.solver.law.friction)
        sums = sum(abs(factor) * one.error_estimate for factor, one in self._parts)
        return max(self._own.error_estimate, sums / friction)

    @cached_property
    def residual(self):
        """Of the states of the sum, of the loads, and of what friction allows over the largest pressure."""
        p, q, w = self.pressures[0], self.shear_traction, self.weights
        beyond = (np.abs(q) - float(self.solver.law.friction) * p).max() / p.max()
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
        stick = common(self.plain.at(stuck).zones_by_name["contact"], found["contact"]) if stuck else []
        slip = found["contact"]
        for pair in stick:
            slip = without(slip, *pair)
        return {**found, "stick": stick, "slip": slip}

    @cached_property
    def zone_errors(self):
        """What the pressure's error leaves to the edges, more of narrow zones."""
        errors = {}
        for one in (self.plain.at(load) for load in (self.memory.stuck, self.memory.load) if load):
            zones = one.zones_by_name["contact"]
            size = zones[-1][1] - zones[0][0]
            for zone in zones:
                own = one.error_estimate * size / 2 * np.sqrt(size / (zone[1] - zone[0]))
                errors |= dict.fromkeys(zone, own)
        return {
            name: [tuple(errors[end] for end in zone) for zone in zones]
            for name, zones in self.zones_by_name.items()
        }

    def _gap_under(self, load):
        if not load:
            initial = self.problem.initial_gap(np.zeros(len(self.x), int), self.x)
            return initial - self.plain.scalars(0)[0]
        one = self.plain.at(load)
        inside = contains(one.zones_by_name["contact"], self.x)
        found = np.zeros_like(self.x)
        found[~inside] = one.gap(0, self.x[~inside])
        return found

    def _displaced(self, memory):
        layers = zip(memory.bounds[:-1], memory.bounds[1:], memory.shares)
        gaps = {load: self._gap_under(load) for load in memory.bounds} if any(memory.shares) else {}
        return sum(
            (share * (gaps[low] - gaps[high]) for low, high, share in layers if share), np.zeros_like(self.x)
        )

    @cached_property
    def slip(self):
        found, waiting = self._displaced(self.memory), np.ones(len(self.x), bool)
        begun = np.zeros_like(found)
        for memory in self.first:
            zones = self.plain.at(memory.load).zones_by_name["contact"]
            new = waiting & contains(zones, self.x)
            begun[new] = self._displaced(memory)[new]
            waiting &= ~new
        return found - begun

    @cached_property
    def energy(self):
        """Elastic energy of pressures and shear, up to a constant."""
        scalars = {one.load: self.plain.scalars(one.load) for _, one in self._parts}
        total = 0.0
        for factor, one in self._parts:
            for other, another in self._parts:
                low, high = sorted((one.load, another.load))
                total += factor * other * (low * scalars[high][0] - scalars[low][2]) / 2
        return float(self._own.energy) + total

    @property
    def work(self):
        """Of the loads: energy and dissipation, up to the constant of the energy."""
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
        """Displacement of the second surface at x, array (n,), to which shear does the opposite."""
        return self._own.counter_displacement(x) - self._of_shear(x, 0.0)


def _events(memories, plain, friction):
    found, slipped, direction = [], False, 0.0

    def note(leg, memory, kind, zone, x):
        found.append(Event(memory.load, 0.0, kind, zone, x, memory.shear, leg))

    for leg, (before, after) in enumerate(zip(memories[:-1], memories[1:])):
        contact = plain.at(after.load).zones_by_name["contact"]
        if not leg and after.stuck:
            note(leg, before, "born", "stick", plain.lowest)
        change = after.shear - before.shear
        if change * direction < 0 and slipped:
            note(leg, before, "reversal", "slip", (contact[0][0] + contact[-1][1]) / 2)
        direction = change or direction
        if not slipped and (after.slipped or not after.stuck):
            slipped = True
            note(leg, before, "first slip", "slip", contact[0][0])
        limits = [abs(one.shear) >= friction * one.load * (1 - SLIDING) for one in (before, after)]
        if limits[1] and not (limits[0] and before.load and before.shear * after.shear > 0):
            note(leg, after, "full slip", "slip", (contact[0][0] + contact[-1][1]) / 2)
    return found
