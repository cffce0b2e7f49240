"""Contact of the ground with a rigid obstacle the paper's way: a mesh of equal squares, graded outwards.

The same discrete problem is solved condensed to the contact nodes, or monolithically by augmented Lagrangian or penalty
Newton (`newton.py`), load by load from first touch.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from . import active_set
from .body import Body
from .condensation import Condensed, ContactNodes
from .errors import BadArgument, NotConverged, require_choice, require_positive, require_whole
from .facets import RULES, ContactFacets
from .ground import GroundScene
from .meshes import Ground, uniform
from .newton import PENALTY, Newton
from .newton_path import load_path
from .surface_state import SurfaceState, surface_state
from .threads import bounded

METHODS = ("condensed", "al", "penalty")
SHAPES = ("quadrilaterals", "triangles")
FAR = 1000.0         # size of an unbounded domain over the region of equal squares


@dataclass(frozen=True)
class UniformContact(GroundScene):
    """A scene on one mesh of equal squares.

    Parameters
    ----------
    h : side of the squares (length)
    order : of all fields
    reach : half-width and depth of the region of equal squares (length)
    method : "condensed", "al" or "penalty"
    rho : regularisation of the last two (stress per length), as of `Newton`
    shape : "quadrilaterals", or "triangles": the same squares, each cut into two
    rule : "nodal", or "gauss" for the contact term of "al", as of `ContactFacets`

    Examples
    --------
    >>> solid = mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1)
    >>> scene = mb.UniformContact(solid, mb.Cylinder(R=10), mb.Microblock(), domain=4.0, h=0.1, reach=0.8)
    >>> [state.load for state in scene.states([0.5, 1.0])]
    [0.5, 1.0]
    """

    h: float = 1.0
    order: int = 1
    reach: float = 1.0
    method: str = "condensed"
    rho: float | None = None
    shape: str = "quadrilaterals"
    rule: str = "nodal"

    def __post_init__(self):
        super().__post_init__()
        require_choice(METHODS, method=self.method)
        require_choice(SHAPES, shape=self.shape)
        require_choice(RULES, rule=self.rule)
        require_positive(h=self.h, reach=self.reach, rho=1.0 if self.rho is None else self.rho)
        require_whole(1, order=self.order)
        if self.rho is not None and self.method == "condensed":
            raise BadArgument("rho", self.rho, "belongs to the methods al and penalty")
        if self.rule == "gauss" and self.method != "al":
            raise BadArgument("rule", self.rule, "belongs to the method al: the others have their pressures at nodes")

    @bounded
    def states(self, loads):
        """SurfaceStates at the loads (force per thickness), in their order; from load to load in ascending order.

        Raises
        ------
        NotConverged
            Also where the contact leaves the region of equal squares.
        """
        loads = list(loads) if np.iterable(loads) else [loads]
        for load in loads:
            self.check_load(load)
        ascending = sorted(set(loads))
        solved = self._condensed(ascending) if self.method == "condensed" else self._monolithic(ascending)
        found = dict(zip(ascending, solved))
        return [found[load] for load in loads]

    @bounded
    def prepare(self):
        """Mesh and matrices, made once and kept for further loads: condensed or, of Newton's method, not yet factorised."""
        return self._prepared

    @cached_property
    def _prepared(self):
        body = self._body()
        if self.method == "condensed":
            nodes = Condensed(body)
            flexibility, gaps, share = nodes.compliance.corner_system(self.law, self.obstacle)
            return nodes, flexibility, self._within(nodes, gaps), share
        nodes = (Condensed if self.law.clamps_rotation else ContactNodes)(body)      # the bulk's matrix gives the reaction
        facets = ContactFacets(body, self.law, self.obstacle, rule=self.rule)
        return nodes, facets, Newton(body, facets, method=self.method, rho=self.rho or self._rho(), control="load")

    @bounded
    def axis_closes(self):
        """Load (force per thickness) at which the node on the axis closes for good, as the load path of this mesh has it."""
        if not self.symmetric:
            raise BadArgument("scene", self, "must be symmetric")
        nodes = Condensed(self._body())
        flexibility, gaps, share = nodes.compliance.corner_system(self.law, self.obstacle)
        last = self.solid.E_star*self.reach**2/4      # classical contact would fill the squares under some times that
        history = active_set.path(flexibility, self._within(nodes, gaps), [last], c=share).events
        loads = [event.load for event in history if event.corner == 0 and event.kind == "closes"]
        if not loads:
            raise NotConverged(f"the axis is open up to the load {2*last:g}", reached=2*last)
        return 2*loads[-1]

    def _body(self):
        far = FAR*self.reach if self.domain == math.inf else self.domain
        ground = Ground(far, (0.0 if self.symmetric else -self.reach, self.reach), self.symmetric)
        supports = dict(ground.supports)
        if self.law.clamps_rotation:
            supports["psi"] += "|contact"
        return Body(uniform(ground, self.h, self.shape == "quadrilaterals"), self.solid, self.order, fixed=supports)

    def _condensed(self, loads):
        nodes, flexibility, gaps, share = self.prepare()
        closed = None
        for load in loads:
            found = active_set.solve(flexibility, gaps, load=self.share(load), c=share, start=closed)
            closed = found.closed
            yield surface_state(self.line, nodes, load, found, self._zones(nodes, load, closed, found.forces), found.iterations)

    def _within(self, nodes, gaps):
        """Initial gaps with inf beyond the region of equal squares: there nothing would be resolved."""
        beyond = np.abs(nodes.points[:, 0]) > self.reach*(1 + 1e-9)
        return np.where(np.tile(beyond, len(self.law.corners)), np.inf, gaps)

    def _monolithic(self, loads):
        nodes, facets, newton = self.prepare()
        for load, state in zip(loads, load_path(newton, [self.share(load) for load in loads])):
            forces = np.array([-state.multipliers[corner]*facets.weights for corner in facets.corners])
            closed = np.concatenate([state.closed[corner] for corner in facets.corners])
            yield SurfaceState(self.line, nodes, load, state.approach, forces, self._zones(nodes, load, closed, forces),
                               state.iterations, state.kkt, newton.unknowns, state.psi, None, state.fields)

    def _rho(self):
        """As Newton's own, but over the size of the contact: the body may be a thousand times as high."""
        stiffness = (self.solid.lam + 2*self.solid.mu)/self.reach
        return stiffness if self.method == "al" else PENALTY*stiffness

    def _zones(self, nodes, load, closed, forces):
        x, count = nodes.points[:, 0], len(self.law.corners)
        closed, forces = closed.reshape(count, -1), forces.reshape(count, -1)
        if np.abs(x[closed.any(axis=0)]).max(initial=0) > self.reach - self.h/2:
            raise NotConverged(f"at load {load:g} the contact leaves the region of equal squares, {self.reach:g} wide: "
                               "ask for smaller loads")
        return self.runs(x, closed, forces/nodes.weights)
