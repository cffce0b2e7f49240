"""Contact of a body on a mesh by the monolithic Newton method."""

from functools import cache, cached_property

from ..errors import BadArgument
from ..model.solver import Solver
from .condensation import clamped_on_contact, require_pressed
from .facets import ContactFacets
from .friction import FollowsFriction
from .mesh_solution import MeshSolution, of_newton
from .newton import MonolithicNewton, default_rho
from .solver3d import Solver3D
from .supports import pressed


class NewtonSolver(FollowsFriction, Solver):
    """States of a body of one or two dimensions; `rule` and `length` are those of `ContactFacets` and
    `default_rho`.
    """

    verifies = True

    def __init__(self, contact, options, rule="nodal", length=None):
        self.rule, self.length = rule, length
        super().__init__(contact, options)
        check = require_pressed if self.body.mesh.dim == 3 else pressed
        check(self.body)

    @cached_property
    def nodes(self):
        """The contact nodes, with psi = 0 where the law prescribes it."""
        body = clamped_on_contact(self.body) if self.law.clamps_rotation else self.body
        return ContactFacets(body, self.law, self.obstacle, self.rule)

    def solve(self, load, approach, rtol, initial=None):
        if rtol is not None:
            words = (
                "needs a condensed plane body or a mesh that the program makes; Newton() takes it as it is"
            )
            raise BadArgument("rtol", rtol, words)
        known = isinstance(initial, MeshSolution) and initial.fields.body is self.nodes.body
        known = known and len(initial.forces) == len(self.law.corners)
        newton = self.newton("load" if approach is None else "approach")
        return self.of(newton.solve(load if approach is None else approach, initial if known else None))

    of = of_newton

    def history(self, pairs, coupled, rtol):
        if self.options.kind != "al":
            raise BadArgument("kind", self.options.kind, 'does not follow friction: Newton("al") does')
        return super().history(pairs, coupled, rtol)

    @cached_property
    def newton(self):
        """The MonolithicNewton of a control, made once."""
        nodes, kind = self.nodes, self.options.kind
        rho = self.options.rho or default_rho(nodes, kind, self.length)
        return cache(lambda control: MonolithicNewton(nodes, method=kind, rho=rho, control=control))


class NewtonSolver3D(NewtonSolver, Solver3D):
    """States of a body in space, without factorisation of all of it."""

    history = Solver.history

    def of(self, state):
        reached = state.forces, state.closed, state.surface, state.kkt, state.iterations
        return self.solution(state.load, state.approach, *reached, method="newton", found=state.fields)
