"""Contact of a block on one mesh of equal squares near the contact, graded outwards (section 4.2).

The same discrete problem is solved condensed to the contact nodes, or monolithically by augmented Lagrangian
or penalty Newton (`newton.py`), load by load from first touch.
"""

import math
from dataclasses import replace
from functools import cached_property

import numpy as np

from ..corners import active_set
from ..errors import BadArgument, NotConverged
from ..model import methods, picture
from .body import Body
from .condensation import Condensed
from .facets import ContactFacets
from .friction import history_to
from .ground import FAR, GroundSolver
from .meshes import Ground, uniform
from .newton import PENALTY, MonolithicNewton
from .newton_path import load_path
from .surface_solution import SurfaceSolution, surface_solution

# half-width and depth of their region, less a block, over the half-width of a classical contact
EQUAL_SQUARES = 2.0
ROUGH = 1e-3  # of the logarithm of a load that chooses the region of equal squares for an approach


class UniformSolver(GroundSolver):
    """States of a Block on one mesh of equal squares; its `options` are `Uniform`."""

    @property
    def method(self):
        """How the discrete problem is solved: "condensed", "al" or "penalty"."""
        return "condensed" if self.options.newton is None else self.options.newton.kind

    def solve(self, load, approach, rtol, initial=None, progress=False):
        if rtol is not None:
            raise BadArgument("rtol", rtol, "chooses the mesh: Uniform(h=...) fixes it; take Fitted()")
        if approach is None:
            return self.states([load])[0]
        self.require_approach(approach)
        if self.reach is None:
            condensed = UniformSolver(self.contact, replace(self.options, newton=None, rule="nodal"))
            load = condensed.at_approach(approach, lambda load, near: condensed.states([load])[0], ROUGH).load
        return self._reaching(load)._at(approach)

    def states(self, loads):
        """SurfaceSolutions at the loads (force per thickness), in their order; from load to load ascending.

        Raises
        ------
        NotConverged
            Also where the contact leaves the region of equal squares.
        """
        ascending = sorted(set(loads))
        solver = self._reaching(ascending[-1])
        solved = solver._condensed(ascending) if self.method == "condensed" else solver._monolithic(ascending)
        found = dict(zip(ascending, solved))
        return [found[load] for load in loads]

    def history(self, pairs, coupled, rtol, progress=False):
        if self.domain == math.inf:
            raise BadArgument(
                "body", self.body, "must have a size: histories know displacements, which the far end decides"
            )
        if rtol is not None:
            return history_to(rtol, lambda number: self._halved(number).history(pairs, coupled, None))
        solver = self._reaching(float(pairs[:, 0].max()))
        whole = self.contact.with_(body=solver._whole(), method=self.options.newton or methods.Condensed())
        found = whole.history(pairs, coupled=coupled)
        outer = max(abs(edge) for state in found.states for zone in state.zones["contact"] for edge in zone)
        solver._require_within(outer, float(pairs[:, 0].max()))
        return found

    def _halved(self, number):
        """The solver on squares 2**number times shorter."""
        return UniformSolver(self.contact, replace(self.options, h=self.options.h / 2**number))

    def _whole(self):
        """The body with both halves, whatever the symmetry: shear has another one."""
        ground = Ground(self.domain, (-self.reach, self.reach), False)
        mesh = uniform(ground, self.options.h, self.options.shape == "quadrilaterals")
        return Body(mesh, self.solid, self.options.order, fixed=dict(ground.supports))

    @property
    def reach(self):
        return self.options.reach

    def _reaching(self, load):
        """The solver with a region of equal squares for a load: its own, or one that the contact fits in.

        That is a whole number of squares wide, and made once for all loads that ask for it.
        """
        if self.reach is not None:
            return self
        half_width, _ = picture.classical(self.problem, load, 0.0)
        squares = math.ceil((EQUAL_SQUARES * half_width + self.solid.ell) / self.options.h)
        if squares not in self._solvers:
            self._solvers[squares] = UniformSolver(
                self.contact, replace(self.options, reach=squares * self.options.h)
            )
        return self._solvers[squares]

    @cached_property
    def _solvers(self):
        """{squares from the axis to the end of their region: UniformSolver}."""
        return {}

    def prepare(self):
        """Mesh and matrices, made once for all loads: condensed, or of Newton's method not factorised."""
        return self._prepared

    @cached_property
    def _prepared(self):
        body = self._body()
        if self.method == "condensed":
            nodes = Condensed(body)
            flexibility, gaps, share = nodes.compliance.corner_system(self.law, self.obstacle)
            return nodes, flexibility, self._within(nodes, gaps), share
        facets = ContactFacets(body, self.law, self.obstacle, rule=self.options.rule)
        rho = self.options.newton.rho or self._rho()
        return facets, facets, MonolithicNewton(body, facets, method=self.method, rho=rho, control="load")

    def _body(self):
        if self.reach is None:
            raise BadArgument("reach", None, "must be given where no load chooses it: Uniform(reach=...)")
        far = FAR * self.reach if self.domain == math.inf else self.domain
        ground = Ground(far, (0.0 if self.symmetric else -self.reach, self.reach), self.symmetric)
        supports = dict(ground.supports)
        if self.law.clamps_rotation:
            supports["psi"] += "|contact"
        mesh = uniform(ground, self.options.h, self.options.shape == "quadrilaterals")
        return Body(mesh, self.solid, self.options.order, fixed=supports)

    def _at(self, approach):
        """The SurfaceSolution at an approach on the mesh of this solver."""
        if self.method == "condensed":
            nodes, flexibility, gaps, share = self.prepare()
            found = active_set.solve(flexibility, gaps, approach=approach, c=share)
            return self._of_condensed(nodes, found.load / self.share(1.0), found)
        nodes, facets, newton = self.prepare()
        newton = MonolithicNewton(newton.body, facets, method=self.method, rho=newton.rho)
        (state,) = load_path(newton, [approach])
        return self._of_newton(nodes, facets, newton, state.load / self.share(1.0), state)

    def _condensed(self, loads):
        nodes, flexibility, gaps, share = self.prepare()
        closed = None
        for load in loads:
            found = active_set.solve(flexibility, gaps, load=self.share(load), c=share, start=closed)
            closed = found.closed
            yield self._of_condensed(nodes, load, found)

    def _of_condensed(self, nodes, load, found):
        zones = self._zones(nodes, load, found.closed, found.forces)
        return surface_solution(self, nodes, load, found, zones, found.iterations, method="uniform")

    def _within(self, nodes, gaps):
        """Initial gaps with inf beyond the region of equal squares: there nothing would be resolved."""
        beyond = np.abs(nodes.points[:, 0]) > self.reach * (1 + 1e-9)
        return np.where(np.tile(beyond, len(self.law.corners)), np.inf, gaps)

    def _monolithic(self, loads):
        nodes, facets, newton = self.prepare()
        for load, state in zip(loads, load_path(newton, [self.share(load) for load in loads])):
            yield self._of_newton(nodes, facets, newton, load, state)

    def _of_newton(self, nodes, facets, newton, load, state):
        forces = np.array([-state.multipliers[corner] * facets.weights for corner in facets.corners])
        closed = np.concatenate([state.closed[corner] for corner in facets.corners])
        return SurfaceSolution(
            self,
            nodes,
            load,
            state.approach,
            forces,
            self._zones(nodes, load, closed, forces),
            state.iterations,
            state.kkt,
            newton.unknowns,
            state.psi,
            None,
            state.fields,
            "uniform",
        )

    def _rho(self):
        """As Newton's own, but over the size of the contact: the body may be a thousand times as high."""
        stiffness = (self.solid.lam + 2 * self.solid.mu) / self.reach
        return stiffness if self.method == "al" else PENALTY * stiffness

    def _zones(self, nodes, load, closed, forces):
        x, count = nodes.points[:, 0], len(self.law.corners)
        closed, forces = closed.reshape(count, -1), forces.reshape(count, -1)
        self._require_within(np.abs(x[closed.any(axis=0)]).max(initial=0), load)
        return self.runs(x, closed, forces / nodes.weights)

    def _require_within(self, outer, load):
        """NotConverged where the contact reaches from the region of equal squares."""
        if outer > self.reach - self.options.h / 2:
            raise NotConverged(
                f"at load {load:g} the contact leaves the region of equal squares, |x1| < "
                f"{self.reach:g}: take a larger reach, Uniform(reach=...), or smaller loads"
            )
