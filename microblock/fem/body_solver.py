"""Contact of a body on a mesh, as it is or refined to an rtol."""

from functools import cached_property

from ..contact_solvers.nodal import NodalPath, NodalSolver
from ..halfplane.kernels import coalescence_exponent
from ..model.deformable import body_of
from ..model.progress import counting
from .body import Body
from .condensation import require_pressed
from .facets import require_upwards
from .forecast import OnGivenMesh
from .friction import FollowsFriction
from .mesh_solution import MeshSolution
from .recovery import refine_until
from .second_body import CounterBody


class BodySolver(FollowsFriction, OnGivenMesh, NodalSolver):
    """States of a supported two-dimensional body on its contact nodes."""

    no_rtol = "refines the mesh of the first body alone: with a second body solve without it"
    solution = MeshSolution
    counter_bodies = (Body,)

    def set_up(self):
        super().set_up()
        require_pressed(self.body)
        self.counter  # which checks the second body

    def solve(self, load, approach, rtol, initial=None):
        self.require_given_mesh(rtol)
        if rtol is not None:
            return refine_until(self, load, approach, rtol)
        return self.at(load, approach, initial)

    @cached_property
    def counter(self):
        """The CounterBody; None of a rigid obstacle."""
        if body_of(self.obstacle) is None:
            return None
        return CounterBody(self.obstacle, self.nodes, self.blocks.shifts)

    @property
    def refines(self):
        return self.counter is None

    @cached_property
    def system(self):
        """(flexibility, initial gaps, shares in the load) of the law's corners on both bodies."""
        require_upwards(self.nodes)
        flexibility, gaps, share = super().system
        more = 0.0 if self.counter is None else self.counter.flexibility(gaps)
        return flexibility + more, gaps, share

    def path(self, last, rtol):
        self.require_given_mesh(rtol)
        with counting("mesh"):  # its states are not what a path leaves
            finest = self if rtol is None else refine_until(self, last, None, rtol).solver
        return NodalPath(self.contact, last, rtol, followed=finest.contact)

    @property
    def crossing(self):
        """That of the surface of the solid."""
        return 2 * coalescence_exponent(self.solid)

    @property
    def compliance(self):
        return self.nodes.compliance

    def on(self, mesh):
        """The solver of the same problem on another mesh."""
        return self.contact.with_(body=self.body.on(mesh)).solver
