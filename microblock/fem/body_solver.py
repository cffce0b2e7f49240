"""Contact of a body on a mesh, as it is or refined to an rtol."""

from functools import cached_property

from ..contact_solvers.compliance import Compliance
from ..contact_solvers.nodal import NodalPath, NodalSolver
from ..halfplane.kernels import coalescence_exponent
from ..model.progress import counting
from ..model.types import Array
from .body import Body
from .condensation import require_pressed
from .forecast import OnGivenMesh
from .friction import FollowsFriction
from .mesh_solution import MeshSolution
from .recovery import refine_until
from .second_body import REFINES_ONE


class BodySolver(FollowsFriction, OnGivenMesh, NodalSolver):
    """States of a supported two-dimensional body on its contact nodes."""

    no_rtol = REFINES_ONE
    solution = MeshSolution
    counter_bodies = (Body,)

    def set_up(self) -> None:
        super().set_up()
        require_pressed(self.body, iterated=True)  # by another method
        self.counter  # which checks the second body

    @property
    def refines(self) -> bool:
        return self.counter is None

    @cached_property
    def system(self) -> tuple[Array, Array, Array]:
        """(flexibility, initial gaps, weights in the load) of the law's corners on both bodies."""
        self.nodes.require_upwards()
        flexibility, gaps, weights = super().system
        if self.counter is not None:
            gaps = self.counter.over(gaps.reshape(len(self.blocks.names), -1)).ravel()
            flexibility = flexibility + self.counter.flexibility
        return flexibility, gaps, weights

    def path(self, last: float, rtol: float | None) -> NodalPath:
        self.require_given_mesh(rtol)
        followed = self.contact
        if rtol is not None:
            with counting("mesh"):  # its states are not what a path leaves
                followed = refine_until(self, last, None, rtol).solver.contact
        return NodalPath(self.contact, last, rtol, followed=followed)

    @property
    def crossing(self) -> float:
        """That of the surface of the solid."""
        return 2 * coalescence_exponent(self.solid)

    @property
    def compliance(self) -> Compliance:
        return self.nodes.compliance
