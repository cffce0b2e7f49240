"""Histories of frictional contact between equal bodies on panels: the shear traction is a sum of pressures
without friction (`LoadingHistory`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np

from ..contact_solvers.friction_events import legs
from ..errors import BadArgument, NotConverged, out_of_reach
from ..model.deformable import second_solid
from ..model.events import Event
from ..model.history import History, with_stick
from ..model.intervals import common, contains
from ..model.problem import Problem
from ..model.quadrature import gauss_rule
from ..model.types import Array, Interval, ZoneErrors, Zones
from .kernels import kernels
from .loading_history import LoadingHistory
from .panel_solution import OnPanels, PanelSolution


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


class FrictionPanels:
    """Histories of one Contact of a PanelSolver through pairs, array (n, 2).

    Attributes
    ----------
    loadings : list of LoadingHistory, from no load on, one more than pairs
    """

    def __init__(self, solver: Any, pairs: Array) -> None:
        require_superposition(solver.contact, solver.options.order)
        self.solver = solver
        self.pairs = pairs
        self.friction = float(solver.law.friction)
        self.loadings = [LoadingHistory(np.zeros(1), np.zeros(1))]
        self._solutions: dict[float, PanelSolution] = {}
        for P, Q in pairs.tolist():
            self.loadings.append(self.loadings[-1].extended(P, Q, self.friction))

    def history(self, rtol: float | None) -> History:
        """Returns the History to rtol; NotConverged if it is out of reach."""
        rtol = self.solver.history_goal(rtol)
        # errors of the shear traction over f are those of its terms times so much
        sums = max(sum(abs(factor) for factor, _ in loading.pressure_terms) for loading in self.loadings)
        amplification = max(1.0, sums / self.friction)
        self._rtol = type(rtol)(rtol / amplification)  # as usual as rtol
        dissipation = 0.0
        states = []
        try:
            for before, after in pairwise(self.loadings):
                dissipation += self._dissipated(before, after)
                states.append(self._solution(after, dissipation).state())
            self._require_growing()
        except NotConverged as failure:
            if failure.rtol_reached is None:
                raise
            raise out_of_reach(rtol, failure.rtol_reached * amplification, load=failure.reached) from failure
        return History(self.solver.contact, states, self._events())

    def solution_at(self, load: float) -> PanelSolution:
        """Returns the PanelSolution without friction at a load."""
        if load not in self._solutions:
            self._solutions[load] = self.solver.solution_at(load, self._rtol)
        return self._solutions[load]

    def contact_at(self, load: float) -> list[Interval]:
        """Returns the contact zones at a load."""
        return self.solution_at(load).zones_by_name["contact"] if load else []

    def scalars(self, loads: Array) -> Array:
        """Returns approaches d and energies at loads, array (n,): array (2, n)."""
        touch = self.solver.problem.initial_gaps(np.array([self._lowest])).item(), 0.0
        pairs = [
            (self.solution_at(load).approach, self.solution_at(load).energy) if load else touch
            for load in loads.tolist()
        ]
        return np.transpose(pairs)

    @property
    def _lowest(self) -> float:
        return float(self.solver.candidates(float(self.pairs[:, 0].max())).lowest)

    def _solution(self, loading: LoadingHistory, dissipation: float) -> "PanelFriction":
        frictionless = self.solution_at(loading.load)
        copied = {field.name: getattr(frictionless, field.name) for field in fields(frictionless)}
        return PanelFriction(
            **copied | {"estimate": None},
            superposition=self,
            frictionless=frictionless,
            loading=loading,
            terms=[(factor, self.solution_at(load)) for factor, load in loading.pressure_terms],
            shear=loading.shear,
            dissipation=dissipation,
        )

    def _dissipated(self, before: LoadingHistory, after: LoadingHistory) -> float:
        """Returns the work of friction from one loading to the next: f times the integral of
        ``P d' - d(P) + H'`` times the change of g, over the loads whose contact slips, P the load under which
        that begins.
        """
        if after.stuck == after.load:
            return 0.0
        limit = float(np.copysign(self.friction, after.shear - before(after.load)))
        bounds = np.union1d(after.stuck, before.loads[before.loads > after.stuck])
        reserve = before.reserve(bounds, limit)
        begins = np.interp(reserve, reserve[[0, -1]], (after.load, before.load))
        rubbed = self._rubbed(bounds, begins)
        # under a punch it is a difference of equal numbers
        return max(0.0, float(self.friction * (np.diff(reserve) / np.diff(bounds)) @ rubbed))

    def _rubbed(self, bounds: Array, begins: Array) -> Array:
        """Returns the integral of ``P d' - d(P) + H'`` over the loads between bounds, where P goes linearly
        from begin to begin, arrays (n,): array (n - 1,).
        """
        d, energies = self.scalars(bounds)
        d_begin, energies_begin = self.scalars(begins)
        integrals = bounds * d - energies  # of d
        heights = bounds * d - 2 * energies  # of p h
        widths = np.diff(bounds)
        begin_changes = np.diff(begins)
        sums = np.diff(begins * d_begin - energies_begin)
        means = np.divide(sums, begin_changes, out=d_begin[1:], where=begin_changes > 1e-9 * begins[1:])
        return np.diff(begins * d + heights) - begin_changes / widths * np.diff(integrals) - widths * means

    def _require_growing(self) -> None:
        """Raises NotConverged unless contacts grow with the load."""
        for low, high in pairwise(sorted(self._solutions)):
            inner = self.contact_at(low)
            outer = self.contact_at(high)
            lost = np.diff(inner).sum() - np.diff(common(inner, outer)).sum()
            if lost > 1e-3 * np.ptp(outer):  # edges have errors
                raise NotConverged(
                    f"the contact at load {low:g} is not within that at load {high:g}, so that shear is "
                    "no sum of pressures: take method=Cells()"
                )

    def _events(self) -> list[Event]:
        events = []
        slips = [after.stuck < after.load for after in self.loadings[1:]]
        for number, leg in enumerate(legs(self.pairs, self.friction)):
            before, after = self.loadings[number : number + 2]
            ends = np.ravel(self.contact_at(after.load))
            middle = (ends[0] + ends[-1]) / 2
            slipped = any(slips[:number])
            noted = (
                (not number and after.stuck, before, "born", "stick", self._lowest),
                (leg.turns and slipped, before, "reversal", "slip", middle),
                (slips[number] and not slipped, before, "first slip", "slip", ends[0]),
                (leg.slides, after, "full slip", "slip", middle),
            )
            events += [
                Event(at.load, 0.0, kind, zone, x, at.shear, number)
                for happens, at, kind, zone, x in noted
                if happens
            ]
        return events


def both_shear_kernels(problem: Problem, distance: Array, target: Array, source: Array) -> Array:
    """Returns the displacement -u.n of the surface, and ell/2 psi, under a unit shear force, at distances:
    array (2, ...).
    """
    solid = problem.solid
    along, even = kernels(solid.nu, solid.beta, solid.curvature)(distance / solid.ell, (5, 6))
    return (1 - solid.nu) / solid.mu * np.array((along, -even))


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class PanelFriction(OnPanels):
    """A state of a history, that without friction at its load and a sum of others.

    Attributes
    ----------
    superposition : FrictionPanels
    frictionless : PanelSolution, at the load
    loading : LoadingHistory
    terms : [(factor, PanelSolution), ...], of the shear traction
    shear : force per thickness
    dissipation : energy per thickness
    """

    superposition: FrictionPanels
    frictionless: Any
    loading: LoadingHistory
    terms: list[tuple[float, Any]]
    shear: float
    dissipation: float

    @property
    def shear_terms(self) -> Sequence[tuple[float, Any]]:
        return self.terms

    @cached_property
    def error_estimate(self) -> float:
        """Of pressure and q/f: the sum over the terms."""
        sums = sum(abs(factor) * solution.error_estimate for factor, solution in self.terms)
        return max(self.frictionless.error_estimate, sums / self.superposition.friction)

    @cached_property
    def residual(self) -> float:
        """Of the terms, the loads, and the friction bound over the largest pressure."""
        p = self.pressures[0]
        q = self.shear_traction
        excess = (np.abs(q) - self.superposition.friction * p).max() / p.max()
        forces = abs(self.weights @ p - self.load), abs(self.weights @ q - self.shear)
        residuals = [self.frictionless.residual, *(solution.residual for _, solution in self.terms)]
        return float(max(*residuals, excess, max(forces) / self.load))

    @cached_property
    def _rule(self) -> tuple[Array, Array]:
        """Points clustered towards both ends of the panels of all states together, and weights."""
        contact = self.zones_by_name["contact"]
        grids = [solution.whole[0] for solution in (self.frictionless, *(s for _, s in self.terms))]
        ends = np.unique(np.concatenate([contact, *((g.e, g.e + g.h) for g in grids)], axis=None))
        ends = ends[np.diff(ends, prepend=-np.inf) > 1e-12 * np.ptp(contact)]
        inside = contains(contact, ends[:-1] + np.diff(ends) / 2)
        left = ends[:-1][inside, None]
        length = np.diff(ends)[inside, None]
        points, weights = gauss_rule(16)
        x = left + length * np.sin(np.pi / 2 * points) ** 2
        return x.ravel(), (length * np.pi / 2 * np.sin(np.pi * points) * weights).ravel()

    @property
    def x(self) -> Array:
        return self._rule[0]

    @property
    def weights(self) -> Array:
        return self._rule[1]

    @cached_property
    def pressures(self) -> Array:
        return self.pressure(0, self.x)[None]

    @cached_property
    def shear_traction(self) -> Array:
        return self.shear_at(self.x)

    def with_friction(self) -> dict[str, Any]:
        """Returns the fields of a State that friction adds."""
        return {
            "shear": self.shear,
            "shear_traction": self.shear_traction,
            "dissipation": self.dissipation,
            "zone_errors": self.zone_errors,
        }

    def shear_at(self, x: Array) -> Array:
        """Returns q at x, arrays (n,)."""
        return sum((factor * solution.pressure(0, x) for factor, solution in self.terms), np.zeros_like(x))

    @cached_property
    def zones_by_name(self) -> Zones:
        stuck = self.superposition.contact_at(self.loading.stuck)
        return with_stick(self.frictionless.zones_by_name, stuck)

    @cached_property
    def zone_errors(self) -> ZoneErrors:
        errors: dict[float, float] = {}
        for load in filter(None, (self.loading.stuck, self.load)):
            zones = self.superposition.contact_at(load)
            size = np.ptp(zones)
            scale = self.superposition.solution_at(load).error_estimate * size / 2
            for left, right in zones:
                errors[left] = errors[right] = float(scale * np.sqrt(size / (right - left)))
        return {
            name: [(errors[left], errors[right]) for left, right in zones]
            for name, zones in self.zones_by_name.items()
        }

    def _lag(self, loading: LoadingHistory) -> Array:
        """Returns by how much the surface at x stays behind the second body, the terms of a loading together,
        array (n,).
        """
        touch = self.problem.initial_gaps(self.x)[0] - self.superposition.scalars(np.zeros(1))[0]
        lag = np.zeros_like(self.x)
        for factor, load in loading.pressure_terms:
            outside = ~contains(self.superposition.contact_at(load), self.x)
            lag += factor * touch
            lag[outside] -= factor * self.superposition.solution_at(load).gap(0, self.x[outside])
        return lag

    @cached_property
    def slip(self) -> Array:
        at_touch = np.zeros_like(self.x)
        waiting = np.ones(len(self.x), bool)
        for loading in self.superposition.loadings[1:]:
            new = waiting & contains(self.superposition.contact_at(loading.load), self.x)
            if new.any():
                at_touch[new] = self._lag(loading)[new]
            waiting &= ~new
        return self._lag(self.loading) - at_touch

    @cached_property
    def energy(self) -> float:
        """With that of the shear, which is what loading along the polyline takes."""
        loads = self.loading.loads
        g = self.loading.slopes
        d, energies = self.superposition.scalars(loads)
        work = (self.loading.shears[:-1] - g * loads[:-1]) * np.diff(d) + g * np.diff(energies)
        return float(self.frictionless.energy + g @ work)

    @property
    def work(self) -> float:
        return self.energy + self.dissipation

    def gap(self, corner: int, x: Array) -> Array:
        return self.frictionless.gap(corner, x)  # shear moves both surfaces alike

    def _sheared(self, x: Array) -> Array:
        """Returns the displacement and ell/2 psi that shear adds at x, array (2, n)."""
        terms = (factor * solution.integral(x, 0 * x, both_shear_kernels) for factor, solution in self.terms)
        return sum(terms, np.zeros((2, len(x))))

    def displacement_and_rotation(self, x: Array) -> tuple[Array, Array]:
        displacement, rotation = super().displacement_and_rotation(x)
        sheared, rotated = self._sheared(x)
        return displacement + sheared, rotation + 2 / self.problem.solid.ell * rotated

    def counter_displacement(self, x: Array) -> Array:
        """Returns the displacement of the second surface at x, array (n,); shear acts oppositely on it."""
        return super().counter_displacement(x) - self._sheared(x)[0]
