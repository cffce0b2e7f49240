"""Contact of a body in space by Newton's method, without factorisation of the whole body."""

from functools import cached_property

from .condensation import require_pressed, with_psi_constrained
from .facets import ContactFacets
from .newton import MonolithicNewton
from .solver3d import Solver3D


class NewtonSolver3D(Solver3D):
    """States of a body in space by penalty or augmented Lagrangian; its `options` are `Newton`."""

    @cached_property
    def nodes(self):
        """The contact nodes, psi1 and psi2 fixed there if the law prescribes psi."""
        body, clamped = self.body, self.surface_law.clamped
        require_pressed(body, body.contact, condensed=True)
        if clamped:
            body = body.once("clamped", lambda: with_psi_constrained(body, body.contact))
        return ContactFacets(body, self.law, self.obstacle, body.contact)

    def solve(self, load, approach, rtol, initial=None, progress=False):
        """Returns the SurfaceNodes; parameters and errors are those of `Solver.solve`."""
        self.require_no_rtol(rtol)
        nodes, control = self.nodes, "load" if approach is None else "approach"
        newton = MonolithicNewton(
            nodes.body, nodes, method=self.options.kind, rho=self.options.rho, control=control
        )
        state = newton.solve(load if approach is None else approach)
        reached = state.forces, state.closed, state.surface, state.kkt, state.iterations
        return self.solution(state.load, state.approach, *reached, method="newton", found=state.fields)
