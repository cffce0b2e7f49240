"""Contact of a body on a mesh with a rigid obstacle: condensed once, every state and event from its contact
nodes.

On the body's own mesh the states are exact for the discrete problem, and so are the path and its events. With
an rtol the mesh is refined first, where `recovery.estimate` asks for it.
"""

from ..corners.nodal import NodalPath, NodalSolver
from ..halfplane.kernels import coalescence_exponent
from .body_solution import BodySolution
from .condensation import condensed, require_pressed
from .friction_solution import of_body
from .recovery import refine_until


class BodySolver(NodalSolver):
    """States of a two-dimensional body on its contact nodes.

    All rigid motions of the body have to be supported, with the value 0, and u2 nowhere on the contact
    boundary; a law that prescribes psi adds psi = 0 on the contact boundary to the supports.
    """

    solution = BodySolution

    def __init__(self, contact, options):
        super().__init__(contact, options)
        require_pressed(self.body, self.body.contact, condensed=True)

    def solve(self, load, approach, rtol, initial=None, progress=False):
        if rtol is not None:
            return refine_until(self, load, approach, rtol, progress)
        return self.at(load, approach, initial)

    def path(self, last, rtol, progress=False):
        contact = (
            self.contact if rtol is None else refine_until(self, last, None, rtol, progress).solver.contact
        )
        return NodalPath(contact, last, None)

    def history(self, pairs, coupled, rtol, progress=False):
        return of_body(self, pairs, coupled, rtol)

    @property
    def crossing(self):
        """That of the surface of the body's solid."""
        return 2 * coalescence_exponent(self.solid)

    @property
    def nodes(self):
        """The body condensed to its contact nodes."""
        return condensed(self.body, self.body.contact, self.law.clamps_rotation)

    @property
    def compliance(self):
        return self.nodes.compliance

    def on(self, mesh):
        """The solver of the same problem on another mesh of the same geometry."""
        return self.contact.with_(body=self.body.on(mesh)).solver
