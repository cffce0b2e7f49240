"""Friction at the corners of a body on a mesh: histories on its condensed contact nodes."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse

from ..corners.follower import AT_LIMIT, Follower, FrictionalContact, Moment
from ..corners.nodal import zones_of
from ..errors import BadArgument, out_of_reach, require_kind
from ..halfplane.friction_events import events
from ..model import law as laws
from ..model.deformable import body_of
from ..model.history import History, OfMoment, change
from ..model.refinement import levels
from ..model.state import State
from .body import Body
from .condensation import Condensed, condensed
from .facets import FLAT, initial_gaps
from .mesh_solution import MeshSolution


class SlipNodes(Condensed):
    """Body of one or two dimensions condensed with u.t as a third field, t = (n2, -n1); periods and
    prescribed values are taken.

    Attributes
    ----------
    response : array (3 n, 3 n), symmetric
        (u.n, psi, u.t) from (forces along n, moments, forces along t), per thickness.
    """

    def _require_pressed(self, body, boundary):
        """Any body is followed."""

    @cached_property
    def onto(self):
        """R with rows of u.t."""
        along = np.column_stack((self.normals[:, 1], -self.normals[:, 0]))
        return sparse.vstack((super().onto, self.motion(along, 0 * along)), format="csr")

    def _matrix(self):
        self.response, n = super()._matrix(), len(self.weights)
        return self.response[: 2 * n, : 2 * n]

    @cached_property
    def unloaded(self):
        """Fields without contact; None where supports prescribe nothing."""
        return self.body.solve() if self.body.prescribed else None

    def fields(self, loads):
        """Fields under nodal loads (n, moments, t), array (3 n,)."""
        found = super().fields(loads)
        if self.unloaded is not None:
            for part, own in zip(found, self.unloaded):
                part.vec.data += own.vec
            found.forces += self.unloaded.forces
        return found


class FrictionFacets:
    """The contact with friction of a body of one or two dimensions.

    Parameters
    ----------
    body : Body
    law : a law with friction
    obstacle : see `microblock.model.obstacles.gap`
    boundary : str, name or pattern of the contact boundary

    Attributes
    ----------
    nodes : SlipNodes
    onto : sparse array (corners n + n, 3 n)
        Changes of gaps, and displacements along t, from (u.n, psi, u.t).
    start : array (3 n,), (u.n, psi, u.t) without contact
    gaps : array (corners, n), inf where a corner cannot touch

    Raises
    ------
    BadArgument
        If the law has no friction, or the obstacle faces no node.

    Examples
    --------
    >>> from microblock.fem import meshes
    >>> from microblock.corners.follower import Follower
    >>> from microblock.fem.friction import FrictionFacets
    >>> body = mb.Body(meshes.line(depth=1.0, elements=2), mb.Cosserat(E=2.6, nu=0.3, ell=0.2, beta=1),
    ...                order=4, fixed="middle")
    >>> facets = FrictionFacets(body, mb.Microblock(friction=0.5), mb.Plane())
    >>> round(float(Follower(facets.contact()).to(0.01, 0.002).tangential[0]), 9)
    0.002
    """

    def __init__(self, body, law, obstacle, boundary="contact"):
        require_kind(Body, "a Body", body=body)
        if not getattr(law, "friction", 0.0):
            raise BadArgument("law", law, "has no friction: solve and path find its states")
        require_kind(str, "the name of a boundary", boundary=boundary)
        self.nodes, self.law = condensed(body, boundary, law.clamps_rotation, SlipNodes), law
        nodes, normals, ell = self.nodes, self.nodes.normals, body.solid.ell
        arms, along = ell * law.arms(nodes.points, normals), np.column_stack((normals[:, 1], -normals[:, 0]))
        one = sparse.identity(len(normals))
        rows = [[-one, sparse.diags(-np.sum(arm * along, axis=1)), None] for arm in arms]
        # psi0 is 0: corners slip alike
        rows += [[None, sparse.diags(-np.sum(arms[0] * normals, axis=1)), one]]
        self.onto, self.start = sparse.bmat(rows, format="csr"), np.zeros(3 * len(normals))
        if nodes.unloaded is not None:
            self.start = nodes.onto @ nodes.unloaded.values
        gaps = initial_gaps(law, nodes, obstacle)
        gaps = gaps + (self.onto @ self.start)[: gaps.size].reshape(gaps.shape)
        nearest = np.arange(len(gaps))[:, None] == np.argmin(gaps, axis=0)
        self.gaps = np.where(nodes.twins & ~nearest, np.inf, gaps)
        if not np.isfinite(self.gaps).any():
            raise BadArgument("obstacle", obstacle, "lies over no point of the contact boundary")

    def contact(self, coupled=True):
        """The FrictionalContact; `coupled` if shear tractions act on the gaps."""
        m, normals = self.gaps.size, self.nodes.normals
        response = self.onto @ (self.onto @ self.nodes.response).T
        level = np.abs(normals[:, 0]).max() <= FLAT
        return FrictionalContact(
            response[:m, :m],
            response[m:, :m],
            response[m:, m:],
            self.gaps.ravel(),
            self.law.friction,
            coupled,
            None if level else normals,
        )

    def solution(self, solver, moment, method):
        nodes, shape = self.nodes, self.gaps.shape
        loads = self.onto.T @ np.concatenate((moment.normal, moment.tangential))
        raised, psi, _ = np.split(self.start + nodes.response @ loads, 3)
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
            method,
            gaps=self.gaps,
            closed=closed | (nodes.twins & closed.any(axis=0)),
            moment=moment,
            loads=loads,
        )


@dataclass(frozen=True, eq=False, repr=False)
class FrictionSolution(OfMoment, MeshSolution):
    """A solution at a pair of loads, with its Moment, and `loads`, array (3 n,)."""

    moment: Moment | None = None
    loads: np.ndarray | None = None

    @property
    def nodes(self):
        return condensed(self.solver.body, self.solver.body.contact, self.law.clamps_rotation, SlipNodes)

    @property
    def energy(self):
        return super().energy if self.nodes.unloaded is None else float(self.fields.energy())

    @property
    def tangential_approach(self):
        return self.moment.offset

    @property
    def _moments(self):
        return self.loads[len(self.x) : 2 * len(self.x)]

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


def history(solver, pairs, coupled, rtol, method):
    """The History through pairs, array (n, 2); BadArgument for an rtol or a second body."""
    if body_of(solver.obstacle) is not None:
        raise BadArgument(
            "obstacle", solver.obstacle, "deforms: histories on a mesh take rigid obstacles alone"
        )
    if rtol is not None:
        raise BadArgument(
            "rtol", rtol, "is not for histories on a mesh, which stays as it is: refine it yourself"
        )
    facets = FrictionFacets(solver.body, solver.law, solver.obstacle, solver.body.contact)
    contact = facets.contact(coupled)
    path = Follower(contact)
    states = [State(facets.solution(solver, path.to(*map(float, pair)), method)) for pair in pairs]
    x = states[-1].x  # nodes stand for half the way to their neighbours
    borders = np.concatenate((x[:1], (x[1:] + x[:-1]) / 2, x[-1:]))
    edges = np.column_stack((borders[:-1], borders[1:]))
    return History(solver.contact, states, events(path.changes, contact.friction, edges, pairs))


def history_to(rtol, solvers, pairs, coupled):
    """The History through pairs, array (n, 2), of the first solver with an error estimate of rtol at most,
    each on squares half as long; NotConverged without one. Errors follow from changes between three, of an
    order from 1/2 to 1 (Richardson), and are at least half of the change before the last.
    """

    def changes(coarser, finer):
        both = zip(finer.states, coarser.states)
        found = [change(a.solution, b.solution, a.weights, a.solid.ell, a.law.friction) for a, b in both]
        return np.array(found)

    best = np.inf
    for _, finer, _, known in levels(lambda own, _: own.history(pairs, coupled, None), solvers, changes):
        if len(known) > 1:
            before, last = known[-2:]
            order = np.clip(np.log2(before.max() / last.max()), 0.5, 1)
            errors = np.maximum(last, before / 2) / (2**order - 1)
            best = min(best, max(errors))
            if best <= rtol:
                states = [
                    State(one.solution, error_estimate=float(e)) for one, e in zip(finer.states, errors)
                ]
                return History(finer.problem, states, finer.events)
    raise out_of_reach(rtol, best, besides="take shorter squares, Uniform(h=...)")
