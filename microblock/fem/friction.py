"""Friction at the corners of a body on a mesh: histories on its condensed contact nodes."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy import sparse

from ..contact_solvers.compliance import nearest_alone
from ..contact_solvers.event_driven import AT_LIMIT, EventDrivenContact, FrictionalContact, FrictionState
from ..contact_solvers.friction_events import events
from ..contact_solvers.nodal import zones_of
from ..errors import out_of_reach, require, require_kind
from ..model import law as laws
from ..model.corner_geometry import Blocks
from ..model.deformable import body_of
from ..model.history import History, OfMoment, change
from ..model.intervals import borders
from ..model.progress import kept
from ..model.refinement import GeometricSeries, RefinementLevel, levels, refine
from .body import Body
from .condensation import condensed
from .facet_rules import ROUNDED
from .facets import gaps_at_nodes
from .mesh_solution import MeshSolution


class FrictionFacets:
    """The contact with friction of a body of one or two dimensions.

    Parameters
    ----------
    body : Body
    law : a law with friction
    obstacle : see `microblock.model.obstacles.gap`

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
    >>> round(float(EventDrivenContact(facets.contact()).to(0.01, 0.002).tangential[0]), 9)
    0.002
    """

    def __init__(self, body, law, obstacle):
        require_kind(Body, "a Body", body=body)
        frictional = getattr(law, "friction", 0.0)
        require(frictional, "law", law, "has no friction: solve and path find its states")
        self.nodes = nodes = condensed(body, law.clamps_rotation, followed=True)
        self.law, normals = law, nodes.normals
        geometry = Blocks(law, body.solid.ell).under(obstacle, nodes.points, normals)
        arms = geometry.offsets_from_centre
        # psi0 is 0: corners slip alike
        rows = [*(-nodes.motion(normals, arm) for arm in arms), nodes.motion(laws.tangents(normals), arms[0])]
        self.onto = sparse.vstack(rows, format="csr")
        self.heights = np.sum(arms[0] * normals, axis=1)
        self.gaps = nearest_alone(gaps_at_nodes(geometry, nodes), nodes.twins)

    def contact(self, coupled=True):
        """The FrictionalContact; `coupled` if shear tractions act on the gaps."""
        m, normals, response = self.gaps.size, self.nodes.normals, self.nodes.response(self.onto)
        level = np.abs(normals[:, 0]).max() <= ROUNDED
        return FrictionalContact(
            response[:m, :m],
            response[m:, :m],
            response[m:, m:],
            self.gaps.ravel(),
            self.law.friction,
            coupled,
            None if level else normals,
        )

    def solution(self, solver, moment):
        nodes, shape = self.nodes, self.gaps.shape
        raised, psi = nodes.surface(np.concatenate((moment.normal, moment.tangential)), self.onto)
        closed = moment.closed.reshape(shape)
        return FrictionSolution(
            solver,
            moment.load,
            moment.approach,
            moment.normal.reshape(shape),
            -raised,
            psi,
            moment.residual,
            moment.iterations,
            nodes.unknowns,
            gaps=self.gaps,
            closed=closed | (nodes.twins & closed.any(axis=0)),
            moment=moment,
        )


@dataclass(frozen=True, eq=False, repr=False)
class FrictionSolution(OfMoment, MeshSolution):
    """A solution at a pair of loads, with its Moment."""

    moment: FrictionState | None = None

    @property
    def nodes(self):
        return self.solver.frictional.nodes

    @cached_property
    def fields(self):
        forces = np.concatenate((self.moment.normal, self.moment.tangential))
        return self.nodes.fields(forces, self.solver.frictional.onto)

    @property
    def tangential_approach(self):
        return self.moment.offset

    @property
    def _moments(self):
        return super()._moments - self.solver.frictional.heights * self.moment.tangential

    @cached_property
    def zones_by_name(self):
        """With those that stick and slip."""
        bound = self.law.friction * self.pressures.sum(axis=0)
        stick = self.moment.stick & (np.abs(self.shear_traction) < bound - AT_LIMIT * bound.max())
        own, plain = {"stick": stick, "slip": self.closed.any(axis=0) & ~stick}, laws.Unilateral()
        return super().zones_by_name | {
            name: zones_of(self.x, flags[None], plain, self.apart, self.end)["contact"]
            for name, flags in own.items()
        }


class FollowsFriction:
    """Base of solvers of a body that follow friction."""

    @cached_property
    def frictional(self):
        """The FrictionFacets, of a rigid obstacle."""
        return FrictionFacets(self.body, self.law, self.obstacle)

    def history(self, pairs, coupled, rtol):
        """The History through pairs, array (n, 2); BadArgument for an rtol or a second body."""
        words = "deforms: histories on a mesh take rigid obstacles alone"
        require(body_of(self.obstacle) is None, "obstacle", self.obstacle, words)
        words = "is not for histories on a mesh, which stays as it is: refine it yourself"
        require(rtol is None, "rtol", rtol, words)
        contact = self.frictional.contact(coupled)
        path = EventDrivenContact(contact)
        states = [self.frictional.solution(self, path.to(*map(float, pair))).state() for pair in pairs]
        ends = borders(states[-1].x)
        edges = np.column_stack((ends[:-1], ends[1:]))
        return History(self.contact, states, events(path.changes, contact.friction, edges, pairs))


def history_to(rtol, solvers, pairs, coupled):
    """The History through pairs, array (n, 2), of the first solver with an error estimate of rtol at most,
    each on squares half as long; NotConverged without one. Errors follow from changes between three, of an
    order from 1/2 to 1 (Richardson), and are at least half of the change before the last.
    """

    series = GeometricSeries(2.0, 2**0.5, 2.0, luck=2.0)

    def changes(coarser, finer):
        both = zip(finer.states, coarser.states)
        found = [change(a.solution, b.solution, a.weights, a.solid.ell, a.law.friction) for a, b in both]
        return np.array(found)

    def refined():
        for _, finer, _, all_changes in levels(
            lambda own, _: own.history(pairs, coupled, None), solvers, changes
        ):
            if len(all_changes) < 2:
                kept(finer)
                continue
            ratio = series.ratio([change.max() for change in all_changes[-2:]])
            errors = series.error(all_changes[-2:], ratio)
            states = [replace(state, error_estimate=float(e)) for state, e in zip(finer.states, errors)]
            yield RefinementLevel(History(finer.problem, states, finer.events), float(max(errors)))

    def refusal(best, last, failure):
        return failure or out_of_reach(rtol, best.error, besides="take shorter squares, Uniform(h=...)")

    return refine(refined(), rtol, refusal).result
