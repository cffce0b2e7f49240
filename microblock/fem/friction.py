"""Friction at the corners of a body on a mesh: histories on its condensed contact nodes."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy import sparse

from ..contact_solvers.compliance import nearest_alone
from ..contact_solvers.event_driven import EventDrivenContact
from ..contact_solvers.friction_events import events
from ..contact_solvers.friction_pivots import AT_LIMIT
from ..contact_solvers.frictional_contact import FrictionalContact, FrictionState
from ..contact_solvers.nodal import zones_of
from ..errors import NotConverged, out_of_reach, require, require_kind
from ..model import law as laws
from ..model.corner_geometry import Blocks
from ..model.deformable import body_of
from ..model.history import History, PairSolution, change
from ..model.intervals import borders
from ..model.law import Law
from ..model.progress import kept
from ..model.refinement import GeometricSeries, RefinementLevel, levels, refine
from ..model.solver import Solver
from ..model.state import changed
from ..model.types import Array, ObstacleLike, Zones
from . import supports
from .body import Body
from .body_fields import BodyFields
from .condensation import CondensedNodes, condensed
from .facet_rules import ROUNDED
from .facets import gaps_at_nodes
from .mesh_solution import MeshSolution


class FrictionFacets:
    """The contact with friction of a body of one or two dimensions.

    Parameters
    ----------
    body : Body
    law : a law with friction
    obstacle : see `microblock.model.obstacles.initial_gap`

    Attributes
    ----------
    nodes : CondensedNodes
    onto : sparse array (corners n + n, unknowns), changes of gaps, and displacements along t = (n2, -n1)
    gaps : array (corners, n), inf where a corner cannot touch
    heights : array (n,), of the corners over the centres of their blocks

    Raises
    ------
    BadArgument
        If the law has no friction, or the obstacle faces no node.

    Examples
    --------
    >>> from microblock.fem import meshes
    >>> from microblock.contact_solvers.event_driven import EventDrivenContact
    >>> from microblock.fem.friction import FrictionFacets
    >>> body = mb.Body(meshes.line(depth=1.0, elements=2), mb.Cosserat(E=2.6, nu=0.3, ell=0.2, beta=1),
    ...                order=4, fixed="middle")
    >>> facets = FrictionFacets(body, mb.Microblock(friction=0.5), mb.Plane())
    >>> round(float(EventDrivenContact(facets.contact()).follow(0.01, 0.002).tangential[0]), 9)
    0.002
    """

    def __init__(self, body: Body, law: Law, obstacle: ObstacleLike) -> None:
        require_kind(Body, "a Body", body=body)
        laws.check(law)
        self.friction: float = law.friction
        require(self.friction, "law", law, "has no friction: solve and path find its states")
        nodes = condensed(body, law.clamps_rotation, followed=True)
        self.nodes = nodes
        geometry = Blocks(law, body.solid.ell).under(obstacle, nodes.points, nodes.normals)
        arms = geometry.offsets_from_centre
        rows = [-nodes.motion(nodes.normals, arm) for arm in arms]
        rows.append(nodes.motion(laws.tangents(nodes.normals), arms[0]))  # psi0 is 0: corners slip alike
        self.onto = sparse.vstack(rows, format="csr")
        self.heights: Array = np.sum(arms[0] * nodes.normals, axis=1)
        self.gaps = nearest_alone(gaps_at_nodes(geometry, nodes), nodes.twins)

    def contact(self, coupled: bool = True) -> FrictionalContact:
        """Returns the FrictionalContact; `coupled` if shear tractions act on the gaps."""
        m = self.gaps.size
        normals = self.nodes.normals
        response = self.nodes.response(self.onto)
        level = np.abs(normals[:, 0]).max() <= ROUNDED
        return FrictionalContact(
            response[:m, :m],
            response[m:, :m],
            response[m:, m:],
            self.gaps.ravel(),
            self.friction,
            coupled,
            None if level else normals,
        )

    def solution(self, solver: Any, friction_state: FrictionState) -> "FrictionSolution":
        """Returns the solution of a state of the contact."""
        nodes = self.nodes
        shape = self.gaps.shape
        normal_displacement, psi = nodes.surface(
            np.concatenate((friction_state.normal, friction_state.tangential)), self.onto
        )
        closed = friction_state.closed.reshape(shape)
        return FrictionSolution(
            solver,
            friction_state.load,
            friction_state.approach,
            friction_state.normal.reshape(shape),
            -normal_displacement,
            psi,
            friction_state.residual,
            friction_state.iterations,
            nodes.unknowns,
            gaps=self.gaps,
            closed=closed | (nodes.twins & closed.any(axis=0)),
            friction_state=friction_state,
        )


@dataclass(frozen=True, eq=False, repr=False)
class FrictionSolution(PairSolution, MeshSolution):
    """A solution at a pair of loads, with its FrictionState."""

    friction_state: Any = None

    @property
    def nodes(self) -> CondensedNodes:
        return self.solver.frictional.nodes

    @cached_property
    def fields(self) -> BodyFields:
        forces = np.concatenate((self.friction_state.normal, self.friction_state.tangential))
        return self.nodes.fields(forces, self.solver.frictional.onto)

    @property
    def tangential_approach(self) -> float:
        return self.friction_state.offset

    @property
    def _moments(self) -> Array:
        return super()._moments - self.solver.frictional.heights * self.friction_state.tangential

    @cached_property
    def zones_by_name(self) -> Zones:
        """With those that stick and slip."""
        bound = self.law.friction * self.pressures.sum(axis=0)
        stick = self.friction_state.stick & (np.abs(self.shear_traction) < bound - AT_LIMIT * bound.max())
        zones = dict(super().zones_by_name)
        one_corner = laws.Unilateral()
        for name, flags in (("stick", stick), ("slip", self.closed.any(axis=0) & ~stick)):
            zones[name] = zones_of(self.x, flags[None], one_corner, self.interrupted, self.end)["contact"]
        return zones


class FollowsFriction(Solver):
    """Base of solvers of a body that follow friction."""

    body: Body

    @cached_property
    def frictional(self) -> FrictionFacets:
        """The FrictionFacets, of a rigid obstacle."""
        return FrictionFacets(self.body, self.law, self.obstacle)

    def history(self, pairs: Array, coupled: bool, rtol: float | None) -> History:
        """Returns the History through pairs, array (n, 2); raises BadArgument for an rtol or a second
        body.
        """
        require_given(self.obstacle, rtol)
        planes = supports.planes_of_symmetry(self.body, self.body.boundary(self.body.contact))
        words = (
            "holds a plane of symmetry at the contact, across which the sum of shear forces is not given: "
            "histories with friction in the plane need the whole body"
        )
        require(not planes, "fixed", self.body.fixed, words)
        contact = self.frictional.contact(coupled)
        path = EventDrivenContact(contact)
        states = [self.frictional.solution(self, path.follow(*map(float, pair))).state() for pair in pairs]
        ends = borders(states[-1].x)
        edges = np.column_stack((ends[:-1], ends[1:]))
        return History(self.contact, states, events(path.changes, contact.friction, edges, pairs))


def require_given(obstacle: ObstacleLike, rtol: float | None) -> None:
    """Raises BadArgument for a second body, or an rtol that no mesh is refined to in a history."""
    words = "deforms: histories on a mesh take rigid obstacles alone"
    require(body_of(obstacle) is None, "obstacle", obstacle, words)
    words = "is not for histories on a mesh, which stays as it is: refine it yourself"
    require(rtol is None, "rtol", rtol, words)


def history_to(rtol: float, solvers: Iterable[Any], pairs: Array, coupled: bool) -> History:
    """Returns the History through pairs, array (n, 2), of the first solver with an error estimate of rtol at
    most, each on squares half as long; raises NotConverged without one. Errors follow from changes between
    three, of an order from 1/2 to 1 (Richardson), and are at least half of the change before the last.
    """
    series = GeometricSeries(slowest=2**0.5, fastest=2.0, luck=2.0)

    def follow(solver: Any, coarser: History | None) -> History:
        return solver.history(pairs, coupled, None)

    def changes(coarser: Any, finer: Any) -> Any:
        """Returns the changes of all states, array (pairs,)."""
        states = zip(finer.states, coarser.states)
        friction = finer.states[0].solution.law.friction
        return np.array([change(a.solution, b.solution, a.weights, a.solid.ell, friction) for a, b in states])

    def refined() -> Iterator[RefinementLevel[History]]:
        for _, finer, _, all_changes in levels(follow, solvers, changes):
            if len(all_changes) < 2:
                kept(finer)
                continue
            last_two: Any = all_changes[-2:]
            ratio = series.ratio([largest.max() for largest in last_two])
            errors = series.error(last_two, ratio)
            states = [
                changed(state, error_estimate=float(error)) for state, error in zip(finer.states, errors)
            ]
            yield RefinementLevel(History(finer.problem, states, finer.events), float(max(errors)))

    def refusal(
        best: RefinementLevel[History], last: RefinementLevel[History], failure: NotConverged | None
    ) -> NotConverged:
        return failure or out_of_reach(rtol, best.error, besides="take shorter squares, Uniform(h=...)")

    return refine(refined(), rtol, refusal).result
