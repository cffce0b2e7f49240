"""What finite elements are expected to take."""

import math
from collections.abc import Callable
from functools import cached_property
from typing import Any

import ngsolve as ng
import numpy as np

from .. import cost
from ..errors import require
from ..halfplane.forecast import likely_zones
from ..model.deformable import Deformable, body_of
from ..model.intervals import zone_edges
from ..model.solver import Solver
from .body import Body
from .condensation import condensed, require_nothing_prescribed, without_idle_rotation
from .fitted_mesh import LAYERS, along_surface
from .recovery import refine_until
from .second_body import SecondBody


def fitted_cost(solver: Any, load: float, rtol: float) -> cost.Cost:
    """Returns the Cost of a FittedSolver with candidates to rtol; raises BadArgument for zones beyond the
    body.

    netgen makes some 5 triangles for an element at the surface, and 18, on a half 9, for each e-fold of
    lengths: to the far field, and down to the distance of two places towards which elements shrink; each
    level has 2.7 quadrilaterals at such a place. A triangle of order p has p^2/2 unknowns of a field, a
    quadrilateral p^2; orders that fall have half.
    """
    zones = solver.inside(load, likely_zones(solver.problem, solver.candidates))
    ground, stretches = solver.surface(zones)
    corners = len(solver.law.corners)
    # one of two corners is open beside an edge, the width of a layer
    edges = np.add(zone_edges(zones), LAYERS * solver.solid.layer_length * (corners > 1))
    grading_points = np.unique([*solver.features(ground), *(np.abs(edges) if ground.half else edges)])
    levels = solver.levels(rtol, solver.options.even)
    order, depth = next((level for level in levels[1:] if solver.left(level[1]) <= rtol), levels[-1])
    gaps = np.minimum(np.diff(grading_points) / stretches[0][2], 1)
    folds = math.log(ground.far / ground.reach[1]) / (1 + ground.half) - np.log(gaps).sum()
    graded = 18 * folds + 5.4 * depth * len(grading_points)
    if not solver.options.even:
        graded /= 2
    along = along_surface((), stretches, 0)
    nodes = order * along
    forecast = cost.predict("fitted", 1.5 * order**2 * (5 * along + graded))
    dense = 3e-10 * (corners * nodes) ** 3  # seconds, the same on two cylinders and a punch
    memory = max(forecast.memory, cost.dense_bytes(nodes))
    return forecast._replace(seconds=forecast.seconds + dense, memory=memory)


class OnGivenMesh(Solver):
    """Base of solvers of a body on its mesh.

    Attributes
    ----------
    no_rtol : str, why it makes no finer ones to an rtol
    iterates : bool, on all unknowns: supports may prescribe values
    solution_at : function of a load, an approach, and a solution on the same nodes or None, which returns the
        solution on the mesh as it is
    """

    body: Body
    solution_at: Callable[..., Any]
    verifies = True
    no_rtol: str
    iterates = False

    @property
    def refines(self) -> bool:
        """Whether it makes finer meshes to an rtol."""
        return False

    @property
    def rate(self) -> str:
        """Name of its rate in `cost.RATES`."""
        return "condensed"

    def set_up(self) -> None:
        super().set_up()
        self.body = without_idle_rotation(self.body, self.law)

    @property
    def nodes(self) -> Any:
        """The condensed body; a law that prescribes psi constrains it."""
        return condensed(self.body, self.law.clamps_rotation)

    @cached_property
    def counter(self) -> SecondBody | None:
        """The SecondBody; None of a rigid obstacle."""
        if not isinstance(self.obstacle, Deformable):
            return None
        return SecondBody(self.obstacle, self.nodes, self.blocks)

    def require_given_mesh(self, rtol: float | None) -> None:
        """Raises BadArgument for an rtol that no mesh is refined to."""
        require(rtol is None or self.refines, "rtol", rtol, self.no_rtol)

    def solve(
        self, load: float | None, approach: float | None, rtol: float | None, initial: Any = None
    ) -> Any:
        self.require_given_mesh(rtol)
        if rtol is not None:
            return refine_until(self, load, approach, rtol)
        return self.solution_at(load, approach, initial)

    def refined_at(self, load: float | None, approach: float | None, coarse: Any) -> Any:
        """Returns the solution on the mesh as it is, a finer one than that of the solution `coarse`."""
        return self.solution_at(load, approach, coarse)

    def on(self, mesh: Any) -> Any:
        """Returns the solver of the same problem on another mesh."""
        return self.contact.with_(body=self.body.on(mesh), method=self.options).solver

    def predicted(self, load: float | None, approach: float | None, rtol: float | None) -> cost.Cost:
        self.require_given_mesh(rtol)
        if not self.iterates:
            require_nothing_prescribed(self.body)
        if rtol is None:
            return self._given_cost()
        return self.refined_cost(rtol)

    def _given_cost(self) -> cost.Cost:
        """Returns the Cost of the mesh as it is, and of a second body's."""
        first = cost.predict(self.rate, self.body.unknowns)
        second = body_of(self.obstacle)
        if second is None:
            return first
        other = cost.predict(self.rate, second.unknowns)
        return first._replace(seconds=first.seconds + other.seconds, memory=first.memory + other.memory)

    def refined_cost(self, rtol: float) -> cost.Cost:
        """Returns the Cost of meshes that are refined to an rtol, in the plane."""
        body = self.body
        order = body.order
        # elements at slope discontinuities are cut again and again, and those at ends of each corner more
        ends = len(self.obstacle.ends)
        sharp = len(self.obstacle.kinks) + 3 * len(self.law.corners) * ends
        needed = body.unknowns + 70 * order * (5 * rtol ** (-1 / order) + sharp * math.log10(rtol) ** 2)
        if self.law.clamps_rotation:  # which leaves a layer below all of the surface
            surface = body.boundary(body.contact)
            needed += 80 * ng.Integrate(1, body.mesh, definedon=surface) / self.solid.layer_length
        return cost.predict("refined", needed)
