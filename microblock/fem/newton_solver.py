"""Contact of a body on a mesh by the monolithic Newton method."""

from collections.abc import Callable
from functools import cache, cached_property
from typing import Any

from ..errors import require
from ..model.events import LoadPath
from ..model.history import History
from ..model.solver import SOLVED, Solver
from ..model.types import Array
from .condensation import clamped_on_contact, require_nothing_prescribed, require_pressed
from .facets import ContactFacets
from .forecast import OnGivenMesh
from .friction import FollowsFriction
from .mesh_solution import MeshSolution, OnMesh
from .newton import ContactGuess, MonolithicNewton, NodalState
from .solver3d import Solver3D
from .state3d import SurfaceNodes
from .supports import pressed


class NewtonSolver(FollowsFriction, OnGivenMesh):
    """States of a body of one or two dimensions."""

    no_rtol = "needs a condensed body or a mesh that the program makes; Newton() takes it as it is"
    rate = "newton"
    iterates = True

    def set_up(self) -> None:
        super().set_up()
        if self.body.in_space:
            require_pressed(self.body, iterated=True)
        else:
            pressed(self.body)

    @property
    def penalizes(self) -> bool:
        return bool(self.options.kind == "penalty")

    @cached_property
    def nodes(self) -> ContactFacets:
        """The contact nodes, with psi = 0 where the law prescribes it."""
        body = clamped_on_contact(self.body) if self.law.clamps_rotation else self.body
        return ContactFacets(body, self.law, self.obstacle)

    def path(self, last: float, rtol: float | None) -> LoadPath:
        if not self.body.in_space:
            require_nothing_prescribed(self.body)  # for which this method was taken, and no other follows
        return super().path(last, rtol)

    def solution_at(self, load: float | None, approach: float | None, initial: Any = None) -> OnMesh:
        """Returns the solution on the mesh as it is, from a solution on the same body on."""
        alike = isinstance(initial, OnMesh) and len(initial.forces) == len(self.nodes.g0)
        alike = alike and initial.fields.body is self.nodes.body
        return self.solution_from(initial if alike else None, load, approach)

    def solution_from(
        self, start: Any, load: float | None, approach: float | None, residual: float = 0.0
    ) -> OnMesh:
        """Returns the solution from a start and to a residual of `MonolithicNewton.solve`."""
        control = "load" if approach is None else "approach"
        level: Any = load if approach is None else approach
        return self.of(self.newton(control).solve(level, start, residual))

    def of(self, state: NodalState) -> OnMesh:
        """Returns the MeshSolution of a NodalState."""
        normal_displacement, psi = state.surface
        return MeshSolution(
            self,
            state.load,
            state.approach,
            state.forces,
            -normal_displacement,
            psi,
            state.kkt,
            state.iterations,
            state.unknowns,
            computed=state.fields,
            gaps=self.nodes.g0,
            closed=state.closed,
        )

    def history(self, pairs: Array, coupled: bool, rtol: float | None) -> History:
        kind = self.options.kind
        require(kind == "al", "kind", kind, 'does not follow friction: Newton("al") does')
        return super().history(pairs, coupled, rtol)

    @cached_property
    def newton(self) -> Callable[[str], MonolithicNewton]:
        """The MonolithicNewton of a control, made once."""
        nodes = self.nodes
        options = self.options
        return cache(
            lambda control: MonolithicNewton(nodes, method=options.kind, rho=options.rho, control=control)
        )


class NewtonSolver3D(NewtonSolver, Solver3D):
    """States of a body in space, without factorisation of all of it."""

    history = Solver.history
    counter_bodies = ()
    refines = Solver3D.refines
    rate = "newton in space"
    time_factor = 1.0  # its states are those of Condensed()

    @property
    def most_unknowns(self) -> int:  # type: ignore[override]
        """Unknowns of a mesh that is refined, which take some minutes; fewer of boxes, cut in whole rows."""
        return Solver3D.most_unknowns if self.grid_lines else 1_000_000

    def refined_at(self, load: float | None, approach: float | None, coarse: SurfaceNodes) -> OnMesh:
        guess = ContactGuess(coarse.approach, coarse.pressures_over(self))
        if self.penalizes or not guess.pressures.any():
            return self.solution_at(load, approach)
        return self.solution_from(guess, load, approach, SOLVED)

    def follows(self, pairs: Array) -> bool:
        return False

    def path(self, last: float, rtol: float | None) -> LoadPath:
        kind = self.options.kind
        require(kind == "al", "kind", kind, 'does not follow events: Newton("al") does')
        return super().path(last, rtol)

    def of(self, state: NodalState) -> OnMesh:
        return self.solution(
            state.load,
            state.approach,
            state.forces,
            state.closed,
            state.surface,
            state.kkt,
            state.iterations,
            computed=state.fields,
        )
