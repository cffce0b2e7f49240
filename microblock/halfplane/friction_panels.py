"""Histories of frictional contact between equal bodies on panels: the shear traction is a sum of pressures
without friction (docs/theory/friction.md),

    q(x) = integral over 0 < xi < P of g(xi) dp(x; xi)/dxi,     |g| <= f.
"""

from dataclasses import dataclass, fields
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np

from ..contact_solvers.friction_events import legs
from ..contact_solvers.rounding import EPS_PIVOT
from ..errors import BadArgument, NotConverged, out_of_reach
from ..model.deformable import second_solid
from ..model.events import Event
from ..model.history import History, with_stick
from ..model.intervals import common, contains
from ..model.quadrature import gauss_rule
from ..model.state import State
from .kernels import kernels
from .panel_solution import OnPanels


def require_superposition(contact: Any, order: int | None) -> None:
    """BadArgument unless the bodies are equal, the law is unilateral, and rtol chooses the order."""
    if order is not None:
        raise BadArgument("method", contact.method, "must be Panels() without an order: rtol chooses it")
    if (
        second_solid(contact.obstacle) != contact.solid
        or len(contact.law.corners) != 1
        or contact.law.clamps_rotation
    ):
        raise BadArgument(
            "method",
            "Panels",
            "follows friction between two equal bodies (Deformable) under the law Unilateral alone, where "
            "shear and pressure do not act on each other: take method=Cells()",
        )


@dataclass(frozen=True, eq=False)
class LoadingHistory:
    """The integral of g, a polyline: loads along it lead to the same state without slip.

    Attributes
    ----------
    loads, shears : arrays (n,), corners of the polyline from (0, 0) to (P, Q), loads ascending
    stuck : the load whose contact has stuck since the pair before
    """

    loads: np.ndarray
    shears: np.ndarray
    stuck: float = 0.0

    @property
    def load(self):
        return float(self.loads[-1])

    def __call__(self, loads):
        return np.interp(loads, self.loads, self.shears)

    def left(self, loads, limit):
        """Shear that slip to g = `limit`, f or -f, may still add under loads (ascending), array (n,)."""
        return np.abs(limit * loads - self(loads))

    @property
    def parts(self):
        """[(factor, load), ...] of the pressures of which q is the sum."""
        g = np.diff(self.shears) / np.diff(self.loads)
        factors, large = -np.diff(g, append=0.0), EPS_PIVOT * np.abs(g).max(initial=0.0)
        parts = zip(factors.tolist(), self.loads[1:].tolist())
        return [(factor, load) for factor, load in parts if abs(factor) > large]

    def to(self, load, shear, friction):
        """Returns the memory at the next pair; BadArgument where friction cannot bear the shear."""
        load = self.load if abs(load - self.load) <= EPS_PIVOT * load else load
        grows = load > self.load
        if grows and abs(shear - self.shears[-1]) > friction * (load - self.load) * (1 + EPS_PIVOT):
            raise BadArgument(
                "pairs",
                (load, shear),
                "must not add more shear force than friction times the normal force it adds: panels "
                "follow slip while the normal force is constant or falls; method=Cells() follows both",
            )
        missing, stuck, least = shear - self(load), load, EPS_PIVOT * friction * load
        if abs(missing) > least and not grows:
            limit = np.copysign(friction, missing)
            target = abs(limit * load - shear)
            stuck = (
                float(np.interp(target, self.left(self.loads, limit), self.loads)) if target > least else 0.0
            )
        loads = np.unique((0.0, *self.loads[self.loads < stuck * (1 - EPS_PIVOT)], stuck, load))
        return LoadingHistory(loads, np.append(self(loads[:-1]), shear), stuck)


class FrictionPanels:
    """Histories of one Contact of a PanelSolver through pairs, array (n, 2)."""

    def __init__(self, solver, pairs):
        require_superposition(solver.contact, solver.options.order)
        self.solver, self.pairs, self.friction = solver, pairs, float(solver.law.friction)
        self.memories, self._known = [LoadingHistory(np.zeros(1), np.zeros(1))], {}
        for P, Q in pairs.tolist():
            self.memories.append(self.memories[-1].to(P, Q, self.friction))

    def history(self, rtol):
        """Returns the History to rtol; NotConverged if it is out of reach."""
        rtol = self.solver.history_goal(rtol)
        # errors of the shear traction over f are those of its parts times so much
        sums = max(sum(abs(factor) for factor, _ in memory.parts) for memory in self.memories)
        share = max(1.0, sums / self.friction)
        self._rtol, dissipation, states = type(rtol)(rtol / share), 0.0, []  # as usual as rtol
        try:
            for before, memory in pairwise(self.memories):
                dissipation += self._dissipated(before, memory)
                states.append(State(self._solution(memory, dissipation)))
            self._require_growing()
        except NotConverged as failure:
            if failure.rtol_reached is None:
                raise
            raise out_of_reach(rtol, failure.rtol_reached * share, load=failure.reached) from failure
        return History(self.solver.contact, states, self._events())

    def at(self, load):
        """The PanelSolution without friction at a load."""
        if load not in self._known:
            self._known[load] = self.solver.at(load, self._rtol)
        return self._known[load]

    def contact_at(self, load):
        """Contact zones at a load, [(left, right), ...]."""
        return self.at(load).zones_by_name["contact"] if load else []

    def scalars(self, loads):
        """Approaches d and energies at loads: arrays (n,)."""
        start = self.solver.problem.initial_gaps(np.array([self._lowest])).item(), 0.0
        known = [(self.at(load).approach, self.at(load).energy) if load else start for load in loads.tolist()]
        return np.transpose(known)

    @property
    def _lowest(self):
        return self.solver.candidates(float(self.pairs[:, 0].max())).lowest

    def _solution(self, memory, dissipation):
        own = self.at(memory.load)
        return PanelFriction(
            **{**{each.name: getattr(own, each.name) for each in fields(own)}, "estimate": None},
            plain=self,
            own=own,
            memory=memory,
            parts=[(factor, self.at(load)) for factor, load in memory.parts],
            shear=float(memory.shears[-1]),
            dissipation=dissipation,
        )

    def _dissipated(self, before, after):
        """Work of friction from one memory to the next: f times the integral of ``P d' - d(P) + H'`` times
        the change of g, over the loads whose contact slips, P the load under which that begins.
        """
        if after.stuck == after.load:
            return 0.0
        limit = np.copysign(self.friction, after.shears[-1] - before(after.load))
        bounds = np.union1d(after.stuck, before.loads[before.loads > after.stuck])
        left = before.left(bounds, limit)
        begins = np.interp(left, left[[0, -1]], (after.load, before.load))
        (d, energies), (means, others) = self.scalars(bounds), self.scalars(begins)
        integrals, heights = bounds * d - energies, bounds * d - 2 * energies  # of d and of p h
        widths, steps, sums = np.diff(bounds), np.diff(begins), np.diff(begins * means - others)
        means = np.divide(sums, steps, out=means[1:], where=steps > 1e-9 * begins[1:])
        rubbed = np.diff(begins * d + heights) - steps / widths * np.diff(integrals) - widths * means
        # under a punch it is a difference of equal numbers
        return max(0.0, float(self.friction * (np.diff(left) / widths) @ rubbed))

    def _require_growing(self):
        """NotConverged unless contacts grow with the load."""
        for low, high in pairwise(sorted(self._known)):
            inner, outer = self.contact_at(low), self.contact_at(high)
            lost = np.diff(inner).sum() - np.diff(common(inner, outer)).sum()
            if lost > 1e-3 * np.ptp(outer):  # edges have errors
                raise NotConverged(
                    f"the contact at load {low:g} is not within that at load {high:g}, so that shear is "
                    "no sum of pressures: take method=Cells()"
                )

    def _events(self):
        found, slips = [], [after.stuck < after.load for after in self.memories[1:]]
        for leg, (*_, turns, slides) in enumerate(legs(self.pairs, self.friction)):
            before, after = self.memories[leg : leg + 2]
            ends, slipped = np.ravel(self.contact_at(after.load)), any(slips[:leg])
            middle = (ends[0] + ends[-1]) / 2
            events = (
                (not leg and after.stuck, before, "born", "stick", self._lowest),
                (turns and slipped, before, "reversal", "slip", middle),
                (slips[leg] and not slipped, before, "first slip", "slip", ends[0]),
                (slides, after, "full slip", "slip", middle),
            )
            found += [
                Event(at.load, 0.0, kind, zone, x, float(at.shears[-1]), leg)
                for happens, at, kind, zone, x in events
                if happens
            ]
        return found


def both_shear_kernels(problem, distance, target, source):
    """Displacement -u.n of the surface, and ell/2 psi, under a unit shear force: array (2, ...)."""
    solid = problem.solid
    along, even = kernels(solid.nu, solid.beta, solid.curvature)(distance / solid.ell, (5, 6))
    return (1 - solid.nu) / solid.mu * np.array((along, -even))


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class PanelFriction(OnPanels):
    """A state of a history, that without friction at its load and a sum of others.

    Attributes
    ----------
    plain : FrictionPanels
    own : PanelSolution, without friction
    memory : LoadingHistory
    parts : [(factor, PanelSolution), ...], of the shear traction
    """

    plain: Any
    own: Any
    memory: LoadingHistory
    parts: list
    shear: float
    dissipation: float

    @cached_property
    def error_estimate(self):
        """Of pressure and q/f: the sum over the parts."""
        sums = sum(abs(factor) * one.error_estimate for factor, one in self.parts)
        return max(self.own.error_estimate, sums / self.plain.friction)

    @cached_property
    def residual(self):
        """Of the parts, the loads, and the friction bound over the largest pressure."""
        p, q, w = self.pressures[0], self.shear_traction, self.weights
        beyond = (np.abs(q) - self.plain.friction * p).max() / p.max()
        missing = max(abs(w @ p - self.load), abs(w @ q - self.shear)) / self.load
        return float(max(self.own.residual, *(one.residual for _, one in self.parts), beyond, missing))

    @cached_property
    def _rule(self):
        """Points clustered towards both ends of the panels of all states together, and weights."""
        contact = self.zones_by_name["contact"]
        panels = [one.whole[0] for one in (self.own, *(one for _, one in self.parts))]
        ends = np.unique(np.concatenate([contact, *((one.e, one.e + one.h) for one in panels)], axis=None))
        ends = ends[np.diff(ends, prepend=-np.inf) > 1e-12 * np.ptp(contact)]
        left, length = ends[:-1], np.diff(ends)
        inside = contains(contact, left + length / 2)
        points, weights = gauss_rule(16)
        x = left[inside, None] + length[inside, None] * np.sin(np.pi / 2 * points) ** 2
        return x.ravel(), (length[inside, None] * np.pi / 2 * np.sin(np.pi * points) * weights).ravel()

    @property
    def x(self):
        return self._rule[0]

    @property
    def weights(self):
        return self._rule[1]

    @cached_property
    def pressures(self):
        return self.pressure(0, self.x)[None]

    @cached_property
    def shear_traction(self):
        return self.shear_at(self.x)

    def shear_at(self, x):
        return sum((factor * one.pressure(0, x) for factor, one in self.parts), np.zeros_like(x))

    @cached_property
    def zones_by_name(self):
        return with_stick(self.own.zones_by_name, self.plain.contact_at(self.memory.stuck))

    @cached_property
    def zone_errors(self):
        errors = {}
        for load in filter(None, (self.memory.stuck, self.load)):
            zones, error = self.plain.contact_at(load), self.plain.at(load).error_estimate
            size = np.ptp(zones)
            errors |= {
                end: float(error * size / 2 * np.sqrt(size / (zone[1] - zone[0])))
                for zone in zones
                for end in zone
            }
        return {
            name: [tuple(errors[end] for end in zone) for zone in zones]
            for name, zones in self.zones_by_name.items()
        }

    def _displaced(self, memory):
        """By how much the surface at x stays behind the second body, the parts of a memory together."""
        start = self.problem.initial_gaps(self.x)[0] - self.plain.scalars(np.zeros(1))[0]
        found = np.zeros_like(self.x)
        for factor, load in memory.parts:
            outside = ~contains(self.plain.contact_at(load), self.x)
            found += factor * start
            found[outside] -= factor * self.plain.at(load).gap(0, self.x[outside])
        return found

    @cached_property
    def slip(self):
        begun, waiting = np.zeros_like(self.x), np.ones(len(self.x), bool)
        for memory in self.plain.memories[1:]:
            new = waiting & contains(self.plain.contact_at(memory.load), self.x)
            if new.any():
                begun[new] = self._displaced(memory)[new]
            waiting &= ~new
        return self._displaced(self.memory) - begun

    @cached_property
    def energy(self):
        """With that of the shear, which is what loading along the memory takes."""
        loads, shears = self.memory.loads, self.memory.shears
        d, energies = self.plain.scalars(loads)
        g = np.diff(shears) / np.diff(loads)
        work = (shears[:-1] - g * loads[:-1]) * np.diff(d) + g * np.diff(energies)
        return float(self.own.energy + g @ work)

    @property
    def work(self):
        return self.energy + self.dissipation

    def gap(self, corner, x):
        return self.own.gap(corner, x)  # shear moves both surfaces alike

    def _sheared(self, x):
        none = np.zeros_like(x)
        parts = (factor * one._response(x, none, both_shear_kernels) for factor, one in self.parts)
        return sum(parts, np.zeros((2, len(x))))

    def displacement_and_rotation(self, x):
        displacement, rotation = super().displacement_and_rotation(x)
        sheared, turned = self._sheared(x)
        return displacement + sheared, rotation + 2 / self.problem.solid.ell * turned

    def counter_displacement(self, x):
        """Displacement of the second surface at x, array (n,); shear acts oppositely on it."""
        return super().counter_displacement(x) - self._sheared(x)[0]
