"""Contact of a body on a mesh by the monolithic Newton method."""

from functools import cache, cached_property

from ..errors import require
from ..model.solver import Solver
from .condensation import clamped_on_contact, require_pressed
from .facets import ContactFacets
from .forecast import OnGivenMesh
from .friction import FollowsFriction
from .mesh_solution import MeshSolution
from .newton import MonolithicNewton
from .solver3d import Solver3D
from .supports import pressed


class NewtonSolver(FollowsFriction, OnGivenMesh):
    """States of a body of one or two dimensions."""

    no_rtol = "needs a condensed plane body or a mesh that the program makes; Newton() takes it as it is"
    rate = "newton"

    def set_up(self):
        super().set_up()
        check = require_pressed if self.body.in_space else pressed
        check(self.body)

    @cached_property
    def nodes(self):
        """The contact nodes, with psi = 0 where the law prescribes it."""
        body = clamped_on_contact(self.body) if self.law.clamps_rotation else self.body
        return ContactFacets(body, self.law, self.obstacle)

    def solve(self, load, approach, rtol, initial=None):
        self.require_given_mesh(rtol)
        known = isinstance(initial, MeshSolution) and initial.fields.body is self.nodes.body
        known = known and len(initial.forces) == len(self.law.corners)
        newton = self.newton("load" if approach is None else "approach")
        return self.of(newton.solve(load if approach is None else approach, initial if known else None))

    def of(self, state):
        """The MeshSolution of a NodalState."""
        raised, psi = state.surface
        return MeshSolution(
            self,
            state.load,
            state.approach,
            state.forces,
            -raised,
            psi,
            state.kkt,
            state.iterations,
            state.unknowns,
            found=state.fields,
            gaps=self.nodes.g0,
            closed=state.closed,
        )

    def history(self, pairs, coupled, rtol):
        kind = self.options.kind
        require(kind == "al", "kind", kind, 'does not follow friction: Newton("al") does')
        return super().history(pairs, coupled, rtol)

    @cached_property
    def newton(self):
        """The MonolithicNewton of a control, made once."""
        nodes, kind, rho = self.nodes, self.options.kind, self.options.rho
        return cache(lambda control: MonolithicNewton(nodes, method=kind, rho=rho, control=control))


class NewtonSolver3D(NewtonSolver, Solver3D):
    """States of a body in space, without factorisation of all of it."""

    history = Solver.history
    rate = "newton in space"
    handicap = 1.0  # its states are those of Condensed()

    def of(self, state):
        return self.solution(
            state.load,
            state.approach,
            state.forces,
            state.closed,
            state.surface,
            state.kkt,
            state.iterations,
            found=state.fields,
        )
