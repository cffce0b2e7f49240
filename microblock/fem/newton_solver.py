"""Contact of a body on a mesh by the monolithic Newton method, augmented Lagrangian or penalty."""

from functools import cached_property

from ..errors import BadArgument
from ..model.solver import Solver
from .condensation import with_psi_constrained
from .facets import ContactFacets
from .friction import history
from .mesh_solution import MeshSolution, of_newton
from .newton import MonolithicNewton
from .newton_path import load_path


class NewtonSolver(Solver):
    """States of a body on a mesh of one or two dimensions, also a periodic one."""

    verifies = True

    def __init__(self, contact, options):
        super().__init__(contact, options)
        self.body.pressed(self.body.contact)  # BadArgument where it cannot be

    @cached_property
    def nodes(self):
        """The contact nodes of the body, with psi = 0 there where the law prescribes it."""
        body = self.body
        supported = with_psi_constrained(body, body.contact) if self.law.clamps_rotation else body
        return ContactFacets(supported, self.law, self.obstacle, boundary=body.contact)

    def solve(self, load, approach, rtol, initial=None, progress=False):
        if rtol is not None:
            raise BadArgument(
                "rtol",
                rtol,
                "needs a condensed body or a mesh that the program makes; Newton() takes the mesh as it is",
            )
        newton = self.newton("load" if approach is None else "approach")
        known = isinstance(initial, MeshSolution) and initial.fields.body is newton.body
        known = known and len(initial.forces) == len(self.law.corners)
        level, start = load if approach is None else approach, initial if known else None
        return of_newton(self, *load_path(newton, [level], start=start), newton.unknowns)

    def history(self, pairs, coupled, rtol, progress=False):
        if self.options.kind != "al":
            raise BadArgument("kind", self.options.kind, 'does not follow friction: Newton("al") does')
        return history(self, pairs, coupled, rtol, "newton")

    def newton(self, control):
        """The MonolithicNewton of a control, "load" or "approach", made once."""
        if control not in self._systems:
            options = self.options
            self._systems[control] = MonolithicNewton(
                self.nodes.body, self.nodes, method=options.kind, rho=options.rho, control=control
            )
        return self._systems[control]

    @cached_property
    def _systems(self):
        """{control: MonolithicNewton}."""
        return {}
