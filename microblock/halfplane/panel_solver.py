"""Contact of a half-plane on panels."""

import math
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from ..cost import Cost
from ..errors import BadArgument, MicroblockError, NotConverged, at_least, out_of_reach, require
from ..model import contact_candidates
from ..model.contact_candidates import ContactCandidates
from ..model.contact_like import ContactLike
from ..model.deformable import second_solid, shape_of
from ..model.events import LoadPath
from ..model.history import History
from ..model.intervals import contact_zones
from ..model.law import require_pure_force
from ..model.methods import Cells
from ..model.obstacles import Samples
from ..model.problem import Problem
from ..model.refinement import Usual
from ..model.solution import Solution
from ..model.solver import Solver
from ..model.types import Array
from .edges import zones_of_neighbour
from .forecast import panels_cost
from .kernels import HalfPlane
from .panel_solution import PanelSolution
from .zone_search import solve_on_panels


class PanelSolver(Solver):
    """States of a half-plane without images on fitted panels; its `options` are `Panels`.

    The way of a state: `Problem` has corners, gaps and levers over ell; `zone_search.solve_on_panels` finds
    zones on cells and moves their edges (`edges.newton_zone_edges`); at given edges `panels.response`
    integrates `kernels.gap_kernel`, a function of distance/ell, and the system gives the `PanelSolution`
    that a `State` asks for pressures.
    """

    has_approach = False
    has_fitted_zones = True
    usual_rtol = 1e-3
    usual_history_rtol = 1e-6
    counter_bodies = (HalfPlane,)

    def __init__(self, contact: ContactLike, options: Any) -> None:
        super().__init__(contact, options)
        self._problems: dict[float, Problem] = {}
        require_pure_force(self.law, self.solid.ell)
        self.require_lowest()

    def solve(
        self, load: float | None, approach: float | None, rtol: float | None, initial: Solution | None = None
    ) -> PanelSolution:
        load = self._require_load(load, approach)
        if self.options.order is not None and rtol is not None:
            raise BadArgument("rtol", rtol, "chooses the order: not together with Panels(order=...)")
        rtol = self.goal(rtol)
        state = self.solution_at(load, rtol, self.options.order, initial)
        if self.options.order or not isinstance(shape_of(self.obstacle), Samples):
            return state  # without the cells that samples are compared on
        from .line_solver import LineSolver  # here: other obstacles do without cells
        from .sampling_uncertainty import with_sampling_note

        return with_sampling_note(LineSolver(self.contact, Cells()), state, rtol)

    def predicted(self, load: float | None, approach: float | None, rtol: float | None) -> Cost:
        load = self._require_load(load, approach)
        self._check_width(load)
        return panels_cost(self._candidate_problem(load), load, rtol, self.options.order)

    def _require_load(self, load: float | None, approach: float | None) -> float:
        """Returns the load; raises BadArgument if the approach is given instead."""
        words = (
            "has no meaning on a half-plane, whose additive constant is arbitrary: give "
            "the load, or take a Block or a period"
        )
        require(approach is None, "approach", approach, words)
        assert load is not None
        return load

    def follows(self, pairs: Array) -> bool:
        """Returns whether panels follow a history through pairs, array (n, 2)."""
        from .friction_panels import FrictionPanels  # here: a single state does without

        try:
            FrictionPanels(self, pairs)
            self._candidate_problem(float(pairs[:, 0].max()))
        except BadArgument:
            return False
        return True

    def history(self, pairs: Array, coupled: bool, rtol: float | None) -> History:
        from .friction_panels import FrictionPanels

        return FrictionPanels(self, pairs).history(rtol)

    def sensitivity(self, solution: PanelSolution, low: ContactLike, high: ContactLike) -> dict[str, float]:
        """Returns changes of half-width and contact area, by `edges.zones_of_neighbour`."""
        changes = {"half_width": 0.0, "contact_area": 0.0}
        for sign, contact in ((-1, low), (1, high)):
            problem = replace(solution.problem, solid=contact.solid, blocks=contact.blocks)
            zones = problem.all_zones(zones_of_neighbour(solution, problem))
            touching = contact_zones(zones, self.law.corners)["contact"]
            changes["half_width"] += sign * float(np.ptp(touching)) / 2
            changes["contact_area"] += sign * sum(right - left for left, right in touching)
        return changes

    def path(self, last: float, rtol: float | None) -> LoadPath:
        from .zone_path import ZonePath  # here: a single state does without

        return ZonePath(self, last, rtol)

    def _neighbour(self, initial: Any) -> PanelSolution | None:
        """Returns an initial solution if its zones are of this problem."""
        if not isinstance(initial, PanelSolution) or len(initial.problem.law.corners) != len(
            self.law.corners
        ):
            return None
        # one may touch nowhere
        zones = {corner: initial.all_zones[corner] for corner in self.problem.corners}
        return replace(initial, zones=zones) if any(zones.values()) else None

    @cached_property
    def problem(self) -> Problem:
        return Problem(
            self.body.solid,
            self.law,
            shape_of(self.obstacle),
            self.symmetric,
            counter=second_solid(self.obstacle),
            blocks=self.blocks,
        )

    def _candidate_problem(self, load: float) -> Problem:
        """Returns the Problem with its candidates; raises BadArgument if the height of the obstacle jumps."""
        problem = self._with_candidates(load)
        if problem.candidates.height_jumps:
            raise BadArgument(
                "obstacle",
                self.obstacle,
                f"must not jump on panels, as its height does at x = {problem.candidates.height_jumps[0]:g}: "
                "Cells() take it",
            )
        return problem

    def candidates(self, load: float) -> ContactCandidates:
        """Returns the ContactCandidates of the obstacle for a load."""
        return self._with_candidates(load).candidates

    def _with_candidates(self, load: float) -> Problem:
        """Returns the Problem with its candidates for loads up to the next power of 4 times E* ell."""
        unit = self.problem.E_star * self.problem.ell
        bracket = unit * 4.0 ** math.ceil(math.log(load / unit, 4) - 1e-9)
        if bracket not in self._problems:
            try:
                candidates = contact_candidates.find_candidates(self.problem, bracket)
            except MicroblockError:  # it may carry this load, though not that of the bracket
                candidates = contact_candidates.find_candidates(self.problem, load)
            obstacle = contact_candidates.with_detected_kinks(self.problem.obstacle, candidates)
            self._problems[bracket] = replace(self.problem, obstacle=obstacle, candidates=candidates)
        return self._problems[bracket]

    def solution_at(
        self, load: float, rtol: float | None = usual_rtol, order: int | None = None, near: Any = None
    ) -> PanelSolution:
        """Returns the PanelSolution at a load, to rtol or of a fixed order; NotConverged if no zones fit or
        the accuracy is out of reach, unless it is `Usual`.
        """
        self._check_width(load)
        near = self._neighbour(near)
        try:
            return self._solved(load, rtol, order, near)
        except NotConverged as failure:
            if order is not None or isinstance(rtol, Usual):
                raise
            raise self._reachable(load, rtol, failure) from None

    def _reachable(self, load: float, rtol: Any, failure: NotConverged) -> NotConverged:
        """Returns the NotConverged with an rtol near to the best estimate that was reached by asking for it,
        as edges move less far for another rtol; the failure, without one, where none was.
        """
        asked = 1.25 * (failure.rtol_reached or math.inf)
        met = 0.0
        while asked < (met / 1.5 or 1):
            asked = float(at_least(asked))
            try:
                error: Any = self._solved(load, asked, None, None).error_estimate
                met = asked
                asked = 1.25 * error
            except NotConverged:
                if met:
                    break
                asked *= 4
        if met:
            return out_of_reach(rtol, met, load=load)
        failure.rtol_reached = None
        return failure

    def _solved(
        self, load: float, rtol: float | None, order: int | None, near: PanelSolution | None
    ) -> PanelSolution:
        return solve_on_panels(self, self._candidate_problem(load), load, rtol, order, near)

    def _check_width(self, load: float) -> None:
        """Raises NotConverged for a contact of too many blocks."""
        if len(self.law.corners) == 1:
            return
        # of 2e6 blocks no zones are found
        most = 2e5
        blocks = 2 * self.candidates(load).half_width / self.solid.ell
        if blocks > most:
            raise NotConverged(
                f"the contact at load {load:g} is some {blocks:.1g} blocks wide, and up to {most:.0g} are in "
                "reach: take a larger ell, or the unilateral law, from which this one hardly differs there"
            )
