"""Friction at the corners of a body on a mesh: one more multiplier at each node of its contact facets.

`FrictionFacets` stands beside `ContactFacets`, of which it has the nodes and the gaps of the corners; it adds
the shear traction q and the slip of each node. By factors of the stiffness all unknowns of the body are
eliminated, and `corners.follower` follows what remains: so also for curved, periodic and one-dimensional
bodies.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import ngsolve as ng
import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from ..corners.follower import Follower, FrictionalContact, Moment
from ..errors import BadArgument, NotConverged, require_choice, require_kind
from .body import Body, Fields, Loads
from .bulk import UNSOLVED, as_csr
from .facets import ContactFacets
from .factors import SYMMETRIC
from .newton import CONTROLS, NodalState

SINGULAR = "the equations are singular: is the body supported, psi where beta = 0 as well?"
AT_ONCE = 64  # right-hand sides of the body's factors: more take memory alone


def slip_lever(law):
    """Height of the corners over the centre of their block, over ell: they move by u.t - lever ell psi along
    the surface; 0 of a law that knows the contact point alone.
    """
    return float(law.arms(np.zeros((1, 2)), np.array([[0.0, 1.0]]))[0, 0, 1])


def require_friction(law):
    """BadArgument for a law that has none."""
    if not getattr(law, "friction", 0.0):
        raise BadArgument("law", law, "has no friction: solve and path find its states")


class FrictionFacets:
    """The nodes of a contact boundary with friction: slip and shear traction beside gaps and pressures.

    Parameters
    ----------
    body, law, obstacle, boundary
        As of `ContactFacets`; the law has friction.

    Attributes
    ----------
    nodes : ContactFacets of the same law without friction
    slip : sparse matrix (n, unknowns of the body), displacement of the corners along the tangent (n2, -n1)
    normal : {corner: sparse matrix (n, unknowns)}, displacement of each corner along n

    Raises
    ------
    BadArgument
        If the law has no friction, or for what `ContactFacets` does not take.

    Examples
    --------
    >>> from microblock.fem import meshes
    >>> body = mb.Body(meshes.line(depth=1.0, elements=2), mb.Cosserat(E=2.6, nu=0.3, ell=0.2, beta=1),
    ...                order=4, fixed="middle")
    >>> from microblock.fem.friction import FrictionFacets
    >>> facets = FrictionFacets(body, mb.Microblock(friction=0.5), mb.Plane())
    >>> facets.slip.shape[0], facets.friction
    (1, 0.5)
    """

    def __init__(self, body, law, obstacle, boundary="contact"):
        require_kind(Body, "a Body", body=body)
        require_friction(law)
        self.body, self.law, self.friction = body, law, law.friction
        self.nodes = ContactFacets(body, replace(law, friction=0.0), obstacle, boundary)
        self.normal = dict(zip(self.nodes.corners, self.nodes.moved))
        along = np.column_stack((self.nodes.normals[:, 1], -self.nodes.normals[:, 0]))
        self.slip = self.nodes.motion(along, self.nodes.arms[0])  # psi0 is 0: corners slip alike


class MonolithicFriction:
    """Frictional contact of a body on a mesh, its unknowns eliminated by factors of its stiffness.

    Parameters
    ----------
    facets : FrictionFacets
    loads : Loads besides the contact
    control : "load" or "approach"
        Whether pairs are loads (P, Q) or motions (approach along -e2, shift along e1) of the obstacle.
    coupled : bool
        Whether shear tractions act on the gaps.

    Examples
    --------
    A strip that sticks under a flat obstacle, and slips at Q = f P:

    >>> from microblock.fem import meshes
    >>> body = mb.Body(meshes.line(depth=1.0, elements=2), mb.Cosserat(E=2.6, nu=0.3, ell=0.2, beta=1),
    ...                order=4, fixed="middle")
    >>> from microblock.fem.friction import FrictionFacets, MonolithicFriction
    >>> facets = FrictionFacets(body, mb.Microblock(friction=0.5), mb.Plane())
    >>> first, last = MonolithicFriction(facets).follow([(0.01, 0.0), (0.01, 0.002)])
    >>> round(float(last.shear_traction[0]), 9), bool(last.stick[0])
    (0.002, True)
    """

    def __init__(self, facets, *, loads=Loads(), control="load", coupled=True):
        require_kind(FrictionFacets, "FrictionFacets", facets=facets)
        require_kind(Loads, "Loads", loads=loads)
        require_choice(CONTROLS, control=control)
        require_kind(bool, "True or False", coupled=coupled)
        self.facets, self.body, self.coupled, self.control = facets, facets.body, coupled, control
        self._assemble(loads)

    def _assemble(self, loads):
        """Stiffness, loads and prescribed values in all unknowns of the body."""
        space = self.body.space
        self.stiffness, self.loads = as_csr(self.body.bulk().mat), self.body.acting(loads)
        supports = ng.GridFunction(space)
        self.body.prescribe(supports.components)
        self._free = np.array(space.FreeDofs())
        self._held = np.where(self._free, 0.0, supports.vec.FV().NumPy())
        # forces of the obstacle on the body do work on -u.n of the corners and on the slip
        normal = [-each for each in self.facets.normal.values()]
        self.onto = sparse.vstack((*normal, self.facets.slip)).tocsr()

    @cached_property
    def _solve(self):
        """A function that solves with the stiffness of the free unknowns."""
        matrix = self.stiffness[self._free][:, self._free].tocsc()
        try:
            solve = splu(matrix, permc_spec="MMD_AT_PLUS_A", **SYMMETRIC).solve
        except RuntimeError as failure:
            raise NotConverged(SINGULAR) from failure
        trial = np.ones(matrix.shape[0])
        if not np.abs(matrix @ solve(trial) - trial).max() <= UNSOLVED:
            raise NotConverged(SINGULAR)
        return solve

    def vector(self, forces):
        """All unknowns of the body under forces of corners and nodes, array."""
        right, found = self.loads + self.onto.T @ forces, self._held.copy()
        for _ in range(2):  # the second time what rounding has left
            found[self._free] += self._solve((right - self.stiffness @ found)[self._free])
        return found

    @cached_property
    def contact(self):
        """The FrictionalContact of the nodes."""
        nodes, onto = self.facets.nodes, self.onto[:, self._free]
        m, count = len(nodes.corners) * len(nodes.weights), onto.shape[0]
        response = np.empty((count, count))
        for first in range(0, count, AT_ONCE):
            some = slice(first, first + AT_ONCE)
            response[:, some] = onto @ self._solve(onto[some].T.toarray())
        response = (response + response.T) / 2
        gaps = (self.onto @ self.vector(np.zeros(count)))[:m].reshape(len(nodes.corners), -1)
        for corner, each in zip(nodes.corners, gaps):
            each += np.where(nodes.can_touch[corner], nodes.initial_gaps[corner], np.inf)
        return FrictionalContact(
            response[:m, :m],
            response[m:, :m],
            response[m:, m:],
            gaps.ravel(),
            self.facets.friction,
            self.coupled,
            nodes.normals,
        )

    def follow(self, pairs):
        """Yields a NodalFriction at each pair of loads or motions, in their order, from (0, 0) on.

        Raises
        ------
        NotConverged
            Where no state follows, as when all nodes slip; it says at which pair.
        """
        follower = Follower(self.contact, by_motions=self.control == "approach")
        for pair in pairs:
            yield NodalFriction(self, follower.to(*pair), tuple(follower.changes))

    @property
    def unknowns(self):
        """Number of free unknowns, those of the contact and motions of the obstacle included."""
        return int(self._free.sum()) + self.onto.shape[0] + 2 * (self.control == "load")


@dataclass(frozen=True, eq=False)
class NodalFriction:
    """A state of a history, at the contact nodes in the order of the facets.

    Attributes
    ----------
    newton : MonolithicFriction
    moment : corners.follower.Moment, with forces in place of tractions
    changes : tuple of corners.follower.Change, since the beginning
    """

    newton: MonolithicFriction
    moment: Moment
    changes: tuple

    @property
    def normal(self):
        """P, force per thickness (per area in one dimension)."""
        return self.moment.load

    @property
    def shear(self):
        """Q, along e1 on the body."""
        return self.moment.shear

    @property
    def shear_traction(self):
        """q at the nodes, array (n,)."""
        return self.moment.tangential / self.newton.facets.nodes.weights

    @property
    def pressures(self):
        """Pressure of each corner, array (corners, n); corners that cannot but move together share theirs."""
        nodes = self.newton.facets.nodes
        found = self._by_corner(self.moment.normal) / nodes.weights
        return np.where(nodes.twins, found.mean(axis=0), found)

    def _by_corner(self, values):
        return values.reshape(len(self.newton.facets.nodes.corners), -1)

    @property
    def micromoment(self):
        """Moment of corner pressures and shear traction on the body, array (n,)."""
        facets, ell = self.newton.facets, self.newton.body.solid.ell
        levers = np.array(list(facets.nodes.levers.values()))
        return ell * (
            np.sum(levers * self.pressures, axis=0) / 2 - slip_lever(facets.law) * self.shear_traction
        )

    @property
    def offset(self):
        """Displacement of the obstacle along e1 (length)."""
        return self.moment.offset

    @property
    def slip(self):
        """How far the obstacle has moved over the surface since first contact, array (n,)."""
        return self.moment.slip

    @property
    def stick(self):
        """Nodes that stick, boolean array (n,)."""
        return self.moment.stick

    @property
    def slips(self):
        """Nodes that slip, array (n,) of -1, 0, 1: the sign of q."""
        return self.moment.slips

    @cached_property
    def nodal(self):
        """What `MonolithicNewton` makes of a state without friction, with this one's micromoment."""
        nodes, moment = self.newton.facets.nodes, self.moment
        return NodalState(
            level=moment.load if self.newton.control == "load" else moment.approach,
            approach=moment.approach,
            load=self.normal,
            fields=self.fields,
            psi=nodes.values("psi", self.fields),
            gaps=dict(zip(nodes.corners, self._by_corner(moment.gaps))),
            multipliers=dict(zip(nodes.corners, -self.pressures)),
            closed=dict(zip(nodes.corners, self._by_corner(moment.closed))),
            traction=-self.pressures.sum(axis=0),
            micromoment=self.micromoment,
            iterations=moment.pieces,
            kkt=self.residual,
            vector=None,  # none to start from: a history starts from the unloaded body
        )

    @cached_property
    def residual(self):
        """The largest violated condition of contact and friction over the largest pressure, of equilibrium
        of body and obstacle over the largest force.
        """
        left = self.fields.forces[self.newton._free]
        return float(max(self.moment.residual, np.abs(left).max() / self.moment.normal.max()))

    @property
    def _forces(self):
        return np.concatenate((self.moment.normal, self.moment.tangential))

    @cached_property
    def fields(self):
        """Fields of the body."""
        newton = self.newton
        kept = ng.GridFunction(newton.body.space)
        vector = kept.vec.FV().NumPy()
        vector[:] = newton.vector(self._forces)
        exerted = newton.stiffness @ vector - newton.loads - newton.onto.T @ self._forces
        return Fields(newton.body, kept.components, exerted)

    @property
    def energy(self):
        """Elastic energy per thickness, of displacements that supports prescribe as well."""
        vector = self.newton.vector(self._forces)
        return float(vector @ (self.newton.stiffness @ vector)) / 2

    @property
    def work(self):
        """Of the obstacle on the body since the beginning, per thickness."""
        return self.moment.work

    @property
    def dissipation(self):
        """Of friction since the beginning, per thickness."""
        return self.moment.dissipation
