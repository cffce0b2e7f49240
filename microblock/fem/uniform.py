"""Contact of a block on one mesh of equal squares near the contact (section 4.2), condensed to the contact
nodes or by Newton's method.
"""

import math
from dataclasses import replace
from functools import cache, cached_property

import numpy as np

from ..errors import NotConverged, require
from ..model import contact_candidates, methods
from .body import Body
from .friction import history_to
from .ground import FAR, GroundSolver
from .mesh_solution import of_block
from .meshes import Ground, uniform
from .newton import usual_rho


class UniformSolver(GroundSolver):
    """States of a Block on one mesh; its `options` are `Uniform`."""

    def solve(self, load, approach, rtol, initial=None):
        require(rtol is None, "rtol", rtol, "chooses the mesh: Uniform(h=...) fixes it; take Fitted()")
        if approach is None:
            solver = self._reaching(load)
            return solver._unfolded(load, solver.on_mesh.solve(self.share(load), None, None))
        load, tried = self.first_load(approach), []
        while (solver := self._reaching(load)) not in tried:  # squares that the load asks for
            found = solver.on_mesh.solve(None, approach, None)
            load = found.load / self.share(1.0)
            tried.append(solver)
        return tried[-1]._unfolded(load, found)

    def history(self, pairs, coupled, rtol):
        words = "must have a size: histories know displacements, which the far end decides"
        require(self.has_level, "body", self.body, words)
        if rtol is not None:
            shorter = [replace(self.options, h=self.options.h / 2**number) for number in range(4)]
            return history_to(rtol, [UniformSolver(self.contact, each) for each in shorter], pairs, coupled)
        solver = self._reaching(float(pairs[:, 0].max()))
        whole = self.contact.with_(body=solver._body(half=False), method=solver._method)
        found = whole.history(pairs, coupled=coupled)
        outer = max(abs(edge) for state in found.states for zone in state.zones["contact"] for edge in zone)
        solver._require_within(outer, float(pairs[:, 0].max()))
        return found

    @property
    def reach(self):
        return self.options.reach

    def _reaching(self, load):
        """The solver with equal squares that the contact of a load fits in, made once."""
        if self.reach is not None:
            return self
        half_width, _ = contact_candidates.classical(self.problem, load, 0.0)
        squares = math.ceil((2 * half_width + self.solid.ell) / self.options.h)
        return self._with_squares(squares)

    @cached_property
    def _with_squares(self):
        """The UniformSolver of a number of squares up to their end, made once."""
        h = self.options.h
        return cache(lambda count: UniformSolver(self.contact, replace(self.options, reach=count * h)))

    def prepare(self):
        """The `NodalSolver.system`, or Newton's, made once."""
        return self.on_mesh.newton("load") if self.options.newton else self.on_mesh.system

    @cached_property
    def on_mesh(self):
        """The solver of the body, or of its half, on the mesh."""
        return self.contact.with_(body=self._body(self.symmetric), method=self._method).solver

    @property
    def _method(self):
        newton = self.options.newton
        if newton is None:
            return methods.Condensed()
        return replace(newton, rho=newton.rho or usual_rho(self.solid, newton.kind, self.reach))

    def _body(self, half):
        """The body, or its half x1 > 0."""
        words = "must be given where no load chooses it: Uniform(reach=...)"
        require(self.reach is not None, "reach", None, words)
        far = FAR * self.reach if self.domain == math.inf else self.domain
        ground = Ground(far, (0.0 if half else -self.reach, self.reach), half)
        mesh = uniform(ground, self.options.h, self.options.shape == "quadrilaterals")
        return Body(mesh, self.solid, self.options.order, fixed=dict(ground.supports))

    def _unfolded(self, load, found):
        self._require_within(np.abs(found.x[found.closed.any(axis=0)]).max(initial=0), load)
        zones = self.runs(found.x, found.closed, found.forces / found.nodes.weights)
        return of_block(self, found, load, zones)

    def _require_within(self, outer, load):
        """NotConverged where the contact leaves the equal squares."""
        if outer > self.reach - self.options.h / 2:
            raise NotConverged(
                f"at load {load:g} the contact leaves the region of equal squares, |x1| < "
                f"{self.reach:g}: take a larger reach, Uniform(reach=...), or smaller loads"
            )
