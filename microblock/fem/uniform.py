"""Contact of a block on one mesh of equal squares near the contact (section 4.2), condensed to the contact
nodes or by Newton's method.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache, cached_property
from typing import Any

import numpy as np

from ..errors import NotConverged, require
from ..model import contact_candidates, methods
from ..model.history import History
from ..model.types import Array
from .body import Body
from .friction import history_to
from .ground import FAR, GroundSolver
from .mesh_solution import MeshSolution, of_block
from .meshes import Ground, uniform
from .newton import usual_rho


class UniformSolver(GroundSolver):
    """States of a Block on one mesh; its `options` are `Uniform`."""

    @property
    def penalizes(self) -> bool:
        newton = self.options.newton
        return newton is not None and newton.kind == "penalty"

    def solve(
        self, load: float | None, approach: float | None, rtol: float | None, initial: Any = None
    ) -> MeshSolution:
        require(rtol is None, "rtol", rtol, "chooses the mesh: Uniform(h=...) fixes it; take Fitted()")
        if load is not None:
            solver = self._reaching(load)
            return solver._unfolded(load, solver.on_mesh.solve(self.share(load), None, None))
        level: Any = approach
        load = self.first_load(level)
        tried = []
        while (solver := self._reaching(load)) not in tried:  # squares that the load asks for
            part = solver.on_mesh.solve(None, approach, None)
            load = part.load / self.share(1.0)
            tried.append(solver)
        return tried[-1]._unfolded(load, part)

    def history(self, pairs: Array, coupled: bool, rtol: float | None) -> History:
        words = "must have a size: histories know displacements, which the far end decides"
        require(self.has_approach, "body", self.body, words)
        if rtol is not None:
            shorter = [replace(self.options, h=self.options.h / 2**number) for number in range(4)]
            solvers = [UniformSolver(self.contact, options) for options in shorter]
            return history_to(rtol, solvers, pairs, coupled)
        largest = float(pairs[:, 0].max())
        solver = self._reaching(largest)
        contact = self.contact.with_(body=solver._body(half=False), method=solver._method)
        history = contact.history([(float(P), float(Q)) for P, Q in pairs], coupled=coupled)
        zones = [zone for state in history.states for zone in state.zones["contact"]]
        solver._require_within(max(abs(edge) for zone in zones for edge in zone), largest)
        return history

    @property
    def reach(self) -> float | None:
        return self.options.reach

    def _reaching(self, load: float) -> "UniformSolver":
        """Returns the solver with equal squares that the contact of a load fits in, made once."""
        if self.reach is not None:
            return self
        half_width, _ = contact_candidates.classical(self.problem, load, 0.0)
        return self._with_squares(math.ceil((2 * half_width + self.solid.ell) / self.options.h))

    @cached_property
    def _with_squares(self) -> Callable[[int], "UniformSolver"]:
        """The UniformSolver of a number of squares up to their end, made once."""
        h = self.options.h
        return cache(lambda count: UniformSolver(self.contact, replace(self.options, reach=count * h)))

    def prepare(self) -> Any:
        """Returns the `NodalSolver.system`, or Newton's, made once."""
        return self.on_mesh.newton("load") if self.options.newton else self.on_mesh.system

    @cached_property
    def on_mesh(self) -> Any:
        """The solver of the body, or of its half, on the mesh."""
        return self.contact.with_(body=self._body(self.symmetric), method=self._method).solver

    @property
    def _method(self) -> Any:
        newton = self.options.newton
        if newton is None:
            return methods.Condensed()
        return replace(newton, rho=newton.rho or usual_rho(self.solid, newton.kind, self._given_reach()))

    def _given_reach(self) -> float:
        """Returns the reach; raises BadArgument where no load has chosen it."""
        words = "must be given where no load chooses it: Uniform(reach=...)"
        require(self.reach is not None, "reach", None, words)
        return float(self.options.reach)

    def _body(self, half: bool) -> Body:
        """Returns the body, or its half x1 > 0."""
        reach = self._given_reach()
        far = FAR * reach if self.domain == math.inf else self.domain
        ground = Ground(far, (0.0 if half else -reach, reach), half)
        mesh = uniform(ground, self.options.h, self.options.shape == "quadrilaterals")
        return Body(mesh, self.solid, self.options.order, fixed=ground.supports)

    def _unfolded(self, load: float, part: MeshSolution) -> MeshSolution:
        """Returns the solution of the whole block from that of its computed part."""
        self._require_within(np.abs(part.x[part.closed.any(axis=0)]).max(initial=0), load)
        return of_block(self, part, load, self.runs(part.x, part.closed, part.forces / part.nodes.weights))

    def _require_within(self, outer: float, load: float) -> None:
        """Raises NotConverged where the contact leaves the equal squares."""
        if outer > self._given_reach() - self.options.h / 2:
            raise NotConverged(
                f"at load {load:g} the contact leaves the region of equal squares, |x1| < "
                f"{self.reach:g}: take a larger reach, Uniform(reach=...), or smaller loads"
            )
