"""The contact problem: a body, an obstacle and a law, solved by the method that suits the body."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property, partial
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from .errors import (
    BadArgument,
    plain,
    require,
    require_choice,
    require_depth,
    require_flag,
    require_kind,
    require_positive,
    require_size,
    require_tolerance,
    require_values,
    shown,
)
from .model import law as laws
from .model import obstacles
from .model.bodies import BodyLike, Unbounded, offered_by, over_surface, require_body
from .model.corner_geometry import Blocks
from .model.deformable import require_same_kind
from .model.events import LoadPath
from .model.history import History, pairs_of
from .model.law import Law
from .model.material import Cosserat, Elastic
from .model.methods import MethodAttributes, MethodLike, offered
from .model.plan import Candidate, Plan, first_answer, planned
from .model.problem import require_even, require_jumps, require_uniform
from .model.progress import counted, counting, kept
from .model.refinement import Usual
from .model.results import line
from .model.scales import on_own_scale
from .model.solver import ACCURACIES
from .model.state import State
from .model.types import ObstacleLike
from .threads import bounded

if TYPE_CHECKING:
    from .model.solver import Solver


@dataclass(frozen=True, repr=False)
class Contact:
    """Contact of a body with an obstacle that comes down along -e2, a rigid one or a second body.

    Parameters
    ----------
    body : HalfPlane, HalfSpace, Block or Body
    obstacle : obstacle or callable
        `Plane`, `Cylinder`, `Wedge`, `Punch`, `Wave`, `Rough`, `Obstacle`; one of these as shape of a second
        body, `Deformable`; or a function height(x1) of an array (lengths). An object with a method
        ``height(x)`` may also have `kinks` (ascending abscissae at which its slope or a higher derivative is
        discontinuous), `jumps` (of the slope there), `ends` (left and right edge) and `even` (symmetric).
    law : Microblock, Unilateral, Microclamped, or a `Law` of your own
        With friction `history` follows the loads, without it `solve` and `path` find the states.
    method : Panels, Cells, Fitted, Uniform, Condensed or Newton, optional
        Answers alone. Without it the method that is expected to take the least seconds does, as `plan` shows;
        where it fails the next one answers, which the state's `warnings` say.

    Raises
    ------
    BadArgument
        If an argument is none of these, or the method does not solve on the body.

    Examples
    --------
    >>> solid = mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1)
    >>> problem = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Microblock())
    >>> state = problem.solve(load=1.0, rtol=1e-4)
    >>> state.error_estimate <= 1e-4, state.zones["full"][0][0] < 0
    (True, True)
    """

    body: BodyLike
    obstacle: ObstacleLike
    law: Law
    method: MethodLike | None = None

    def __post_init__(self) -> None:
        require_body(self.body)
        require_same_kind(self.body, self.obstacle)
        self._take(on_own_scale(self.body, self.obstacle))
        in_space = over_surface(self.body)
        obstacles.check(self.obstacle, in_space)
        laws.check(self.law, in_space)
        solid = self.body.solid
        law = self.law
        classical = len(law.corners) == 1 and not law.clamps_rotation
        words = "must be Unilateral() on a solid without blocks, Elastic"
        require(classical or not isinstance(solid, Elastic), "law", law, words)
        held = solid.beta or in_space or not isinstance(self.body, Unbounded)
        words = "must be positive on a half-plane, but under Unilateral(): nothing holds its rotation"
        turns = not held and (law.clamps_rotation or self.blocks.levers(np.zeros(1)).any())
        require(not turns, "beta", solid.beta, words)
        allowed = " or ".join(f"{method.__name__}()" for method in self.body.methods)
        words = f"must be {allowed} on a {type(self.body).__name__}"
        if isinstance(self.body, Unbounded) and self.body.period is not None:
            words += " with a period"
        solves = self.method is None or isinstance(self.method, tuple(self.body.methods))
        require(solves, "method", self.method, words)
        if not in_space and solid.has_length:  # else once the load gives one
            require_even(law, self.obstacle, solid.ell)
            require_uniform(law, solid.ell)
            require_jumps(self.obstacle, solid.ell)
        self.solver  # which checks what it is given

    def _take(self, parts: tuple[BodyLike, ObstacleLike]) -> None:
        for name, part in zip(("body", "obstacle"), parts):
            object.__setattr__(self, name, part)

    def _on_scale(self, load: float | None, approach: float | None = None) -> Contact:
        """Returns the problem whose classical solids have the length of the contact under this load or at
        this approach.
        """
        if (load, approach) not in self._scaled:
            body, obstacle = on_own_scale(self.body, self.obstacle, load, approach)
            same = body is self.body and obstacle is self.obstacle
            self._scaled.clear()
            self._scaled[load, approach] = self if same else replace(self, body=body, obstacle=obstacle)
        return self._scaled[load, approach]

    @cached_property
    def _scaled(self) -> dict[tuple[float | None, float | None], Contact]:
        """{(load, approach): problem} of the last call of `_on_scale`."""
        return {}

    @cached_property
    def blocks(self) -> Blocks:
        """The blocks of the law."""
        return Blocks(self.law, self.body.solid.ell, over_surface(self.body))

    @cached_property
    def solver(self) -> Solver:
        """The Solver that the method stands for."""
        return self._solver_of(self.body.methods[0]() if self.method is None else self.method)

    @cached_property
    def _solvers(self) -> list[Solver]:
        """The Solver of the method that is named, or those of all that need no argument, the usual first."""
        solvers = [self.solver]
        if self.method is None:
            for method in self.body.methods[1:]:
                if not offered(method, MethodAttributes).by_name:
                    with suppress(BadArgument):  # it does not know the law or the second body
                        solvers.append(self._solver_of(method()))
        return solvers

    def plan(
        self,
        load: float | None = None,
        *,
        approach: float | None = None,
        rtol: float | None = None,
        accuracy: str = "pressure",
    ) -> Plan:
        """Returns what each method is expected to take for `solve`.

        Seconds and memory follow from what is cheap to know: kinks, valleys and widths of the obstacle, the
        law, the elements of a mesh, and rtol. They are the same on every machine.

        Parameters
        ----------
        load, approach, rtol, accuracy : optional
            As of `solve`.

        Raises
        ------
        BadArgument
            If an argument is out of range.

        Examples
        --------
        >>> solid = mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1)
        >>> problem = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Microblock())
        >>> plan = problem.plan(load=1.0, rtol=1e-4)
        >>> [each.name for each in plan.candidates], plan.reason
        (['panels', 'cells'], 'the fastest')
        """
        load, approach, rtol = self._checked(load, approach, rtol)
        solvers = self._on_scale(load, approach)._estimating(accuracy)
        return planned(solvers, load, approach, rtol)

    def _estimating(self, accuracy: str) -> list[Solver]:
        """Returns the solvers whose estimates are of an accuracy."""
        require_choice(ACCURACIES, accuracy=accuracy)
        if accuracy == self.solver.accuracy:
            return self._solvers
        return [self.solver.estimating(accuracy)]

    def _goal(self, rtol: float | None) -> float | None:
        """Returns rtol, or the usual one of the body where several methods can answer."""
        return self.solver.goal(rtol) if len(self._solvers) > 1 else rtol

    def _ordered(
        self, load: float | None, approach: float | None, rtol: float | None, accuracy: str = "pressure"
    ) -> Sequence[Candidate]:
        """Returns the candidates of the plan; the usual one if none can answer."""
        solvers = self._estimating(accuracy)
        several = len(solvers) > 1 and planned(solvers, load, approach, rtol).candidates
        return several or (Candidate(solvers[0]),)

    def _solver_of(self, options: MethodLike) -> Solver:
        solvers = offered_by(self.body).solvers
        solver = solvers.get(type(options), offered(options, MethodAttributes).solver)
        require(solver, "method", options, "has no attribute `solver`, a Solver class or its path")
        if isinstance(solver, str):
            module, _, name = solver.rpartition(".")
            solver = getattr(import_module(f"{__package__}.{module}"), name)
        return solver(self, options)

    @property
    def solid(self) -> Cosserat:
        """The solid of the body."""
        return self.body.solid

    @bounded
    def solve(
        self,
        load: float | None = None,
        *,
        approach: float | None = None,
        rtol: float | None = None,
        accuracy: str = "pressure",
        initial: State | None = None,
        progress: bool | None = None,
    ) -> State:
        """Returns the state at a load or at an approach.

        Parameters
        ----------
        load : float
            Force per thickness; on a period, that of one period.
        approach : float
            Approach of the obstacle (length), in place of the load; not of an unbounded body without a
            period, whose rigid-body constant is arbitrary.
        rtol : float, optional
            Relative error, that of `State.error_estimate`, which is obtained or refused. Without it the usual
            one of the body is aimed at (1e-3; 1e-2 where it has cells alone), and the best state returned
            that a few seconds give; or the discretisation that the method or the mesh fixes, which refuse
            an rtol. Under samples that leave more open of the pressure `Cells` may stay above it,
            which `State.warnings` say.
        accuracy : "pressure", "load", "depth" or "stiffness"
            What rtol and `State.error_estimate` are of, where they are not of pressure and micromoment: on a
            `HalfSpace` the load at the approach, the depth from first touch at the load, whichever of both is
            given, or the stiffness. These need fewer cells by far; pressures and edges may then be rough.
        initial : State, optional
            A state of a similar problem to start from.
        progress : bool, optional
            Whether a bar shows steps, error so far and expected seconds. Without an answer it appears after
            one second in a terminal or a notebook, unless the environment has TQDM_DISABLE.

        Returns
        -------
        State

        Raises
        ------
        BadArgument
            If an argument is out of range, or the method does not take it.
        NotConverged
            If an rtol that is given is out of reach, or no zones are found.
        Interrupted
            At Ctrl-C; `reached` is the best State so far, or None.

        Examples
        --------
        >>> solid = mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1)
        >>> problem = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Microblock())
        >>> state = problem.solve(load=1.0)
        >>> problem.solve(load=1.1, initial=state).half_width > state.half_width
        True
        """
        load, approach, rtol = self._checked(load, approach, rtol, initial)
        problem = self._on_scale(load, approach)
        start = getattr(initial, "solution", initial)
        goal = problem._goal(rtol)

        def answer(candidate: Candidate) -> State:
            solver = candidate.solver

            def given(solution: Any) -> State:
                return solution.state().noting("interrupted: rtol was not reached")

            with counting(f"solve by {type(solver.options).__name__}()", progress, given=given):
                if candidate.cost:
                    counted(0, expected=f"{candidate.cost.seconds:.2g} s")
                state = solver.solve(load, approach, goal, start).state()
            if approach is not None:
                depth = np.abs(state.displacement).max() if state.load > 0 else 0.0
                require_depth(approach, depth, np.abs(state.points).max())
            solver.require_solved(state, load, approach)
            estimated = rtol is None or state.error_estimate is not None
            require(estimated, "rtol", rtol, f"cannot be asked of {state.method}, which estimates no error")
            return state

        def shortfall(state: State) -> str:
            return "" if state.solution.data_exhausted else _shortfall(problem.solver.goal(rtol), state)

        candidates = problem._ordered(load, approach, rtol, accuracy)
        return first_answer(candidates, answer, shortfall if rtol is None else None)

    def states(
        self,
        loads: Sequence[float],
        *,
        rtol: float | None = None,
        accuracy: str = "pressure",
        progress: bool | None = None,
    ) -> list[State]:
        """Returns the states at many loads, each computed from the one before.

        Parameters
        ----------
        loads : sequence of float
            Forces per thickness, in any order, so of loading and unloading: without friction states do not
            depend on the way.
        rtol, accuracy, progress : optional
            As of `solve`, whose errors it raises.

        Examples
        --------
        >>> solid = mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1)
        >>> problem = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Microblock())
        >>> [state.load for state in problem.states([0.5, 1.0])]
        [0.5, 1.0]
        """
        loads = require_values(loads=loads)
        states: list[Any] = [None]
        with counting("states", progress, total=len(loads), given=lambda states: states[1:]):
            kept(states)
            for load in loads:
                states.append(self.solve(load, rtol=rtol, accuracy=accuracy, initial=states[-1]))
                counted(load=load)
        return states[1:]

    def _checked(
        self, load: Any, approach: Any, rtol: float | None, initial: State | None = None
    ) -> tuple[float | None, float | None, float | None]:
        """Returns load, approach and rtol as Python's numbers; raises BadArgument for wrong ones."""
        friction = self.law.friction
        words = "makes states depend on what came before: follow the loads by history([(P, Q), ...])"
        require(not friction, "friction", friction, words)
        load = plain(load)
        approach = plain(approach)
        require((load is None) != (approach is None), "load", load, "give either load or approach")
        if load is not None:
            require_positive(load=load)
        else:
            require_size(approach=approach)
        rtol = require_tolerance(rtol)
        if initial is not None:
            require_kind(State, "a State", initial=initial)
            kind = None
            if not initial.flat:
                kind = "nodes" if initial.squares is None else "cells"
            words = "must be a State of the same kind of body"
            require(kind == self.solver.in_space, "initial", initial, words)
        return load, approach, rtol

    @bounded
    def path(self, load: float, *, rtol: float | None = None, progress: bool | None = None) -> LoadPath:
        """Returns the load path from first touch to a load: its `events`, and states `at` any load.

        Parameters
        ----------
        load : float
            Last load of the path, force per thickness.
        rtol, progress : optional
            As of `solve`, for the states `at` a load; events have their own `load_error`.

        Returns
        -------
        LoadPath

        Raises
        ------
        BadArgument
            If an argument is out of range, or the method cannot follow events.

        Examples
        --------
        >>> solid = mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1)
        >>> path = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Microblock()).path(load=1.0)
        >>> path.at(0.25).load
        0.25
        """
        last, _, rtol = self._checked(load, None, rtol)
        with counting("load path", progress):
            # events ask for more than states to a loose rtol
            problem = self._on_scale(last)
            solver = problem._ordered(last, None, None)[0].solver
            path = solver.path(last, problem._goal(rtol))
        path.progress = progress
        if progress:  # the events are what lasts
            path.events
        return path

    @bounded
    def history(
        self,
        pairs: Sequence[Sequence[float]],
        *,
        coupled: bool = True,
        rtol: float | None = None,
        progress: bool | None = None,
    ) -> History:
        """Returns the states along a history of normal and shear forces, under a law with friction.

        Without a method `Panels()` follow it where they can: between two equal half-planes under
        `Unilateral`, while shear grows no faster than friction times a growing normal force; else `Cells()`
        on a half-plane.

        Parameters
        ----------
        pairs : sequence of (P, Q) or (P, Q, S), in three dimensions of (P, Q1, Q2)
            Normal and shear force per thickness, followed on straight ways from (0, 0); Q > 0 drags the
            surface along x1. S is a bulk stress along x1 of a half-plane, tensile if positive, as of
            fretting fatigue; a second half-plane has none. In three dimensions forces along x1 and x2, on a
            half-space or a mesh whose contact boundary is level.
        coupled : bool
            Whether shear tractions act on the gaps; pressures act on the tangential problem in any case.
        rtol : float, optional
            As of `solve`. Without it cells aim at 5e-2 and panels at 1e-6; blocks stay on
            the mesh of their method; bodies on meshes of your own take none.
        progress : bool, optional
            As of `solve`.

        Returns
        -------
        History

        Raises
        ------
        BadArgument
            If the law has no friction, a pair is out of range (P > 0, absolute value of Q up to f P), or the
            method cannot follow friction, such as blocks on a second half-space, or a bulk stress.
        NotConverged
            If an rtol that is given is out of reach, or the friction so large that the answer is not unique.

        Examples
        --------
        >>> solid = mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1)
        >>> problem = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Unilateral(friction=0.3))
        >>> loaded, sheared = problem.history([(1.0, 0.0), (1.0, 0.2)], rtol=0.05).states
        >>> sheared.dissipation > loaded.dissipation
        True
        """
        friction = self.law.friction
        words = "has no friction: its states do not depend on a history, solve them"
        require(friction, "law", self.law, words)
        require_flag(coupled=coupled)
        rtol = require_tolerance(rtol)
        loads = pairs_of(pairs, friction, over_surface(self.body))
        problem = self._on_scale(float(loads[:, 0].max()))
        able = problem._solvers
        if loads.shape[1] > 2 and not over_surface(self.body):
            able = [solver for solver in able if solver.takes_bulk_stress]
            require(able, "pairs", pairs, "have a bulk stress, which Cells() on a HalfPlane follows alone")
        followers = [solver for solver in able if solver.follows(loads)] or [problem.solver]
        with counting("history", progress):
            return first_answer(
                map(Candidate, followers),
                lambda candidate: candidate.solver.history(loads, bool(coupled), rtol),
                partial(_shortfall, followers[-1].history_goal(rtol)),
            )

    def with_(
        self,
        *,
        body: BodyLike | None = None,
        solid: Cosserat | None = None,
        obstacle: ObstacleLike | None = None,
        law: Law | None = None,
        method: MethodLike | None = None,
    ) -> Contact:
        """Returns the problem with some of its parts replaced.

        Parameters
        ----------
        body, obstacle, law, method : optional
            As of `Contact`.
        solid : Cosserat, optional
            Solid of the same body, not together with `body`.

        Examples
        --------
        >>> solid = mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1)
        >>> problem = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Microblock())
        >>> problem.with_(law=mb.Unilateral()).law
        Unilateral()
        """
        if solid is not None:
            require(body is None, "solid", solid, "is that of the body: give one of the two")
            require_kind(Cosserat, "a Cosserat", solid=solid)
            if solid != self.solid:
                words = f"is that of the {type(self.body).__name__}, which has no of(solid): give a body"
                of = offered_by(self.body).of
                if of is None:
                    raise BadArgument("solid", solid, words)
                body = of(solid)
        replaced: dict[str, Any] = {"body": body, "obstacle": obstacle, "law": law, "method": method}
        return replace(self, **{name: part for name, part in replaced.items() if part is not None})

    def __repr__(self) -> str:
        return line("Contact problem", f"{shown(self.obstacle)} on {shown(self.body)}, {shown(self.law)}")


def _shortfall(goal: float | None, result: State | History) -> str:
    """Returns in words that a result misses a goal that is `Usual`, or nothing."""
    error = result.error_estimate
    if not isinstance(goal, Usual) or error is None or error <= goal:
        return ""
    reached = f": the estimate is {error:.1e}" if np.isfinite(error) else ""
    return f"the usual rtol of {goal:g} was not reached{reached}; name an rtol to go on"
