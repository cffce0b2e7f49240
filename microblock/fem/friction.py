"""Friction at the corners of a body on a mesh: one more multiplier at each node of its contact facets.

`FrictionFacets` stands beside `ContactFacets`, of which it has the nodes and the gaps of the corners; it adds
the shear traction q and the slip of each node. What is made of them is the discrete system that
`corners.coulomb` follows, with all unknowns of the body, and so for periodic and for one-dimensional bodies
as well.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import ngsolve as ng
import numpy as np

from ..corners import coulomb
from ..errors import BadArgument, require_choice, require_kind, require_positive
from .body import Body, Fields, Loads
from .bulk import as_csr
from .facets import ContactFacets
from .newton import CONTROLS, NodalState


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


def usual_rho(facets):
    """Stiffness lambda + 2 mu over the shortest length of surface that a node stands for."""
    solid = facets.body.solid
    return (solid.lam + 2 * solid.mu) / float(facets.nodes.weights.min())


class MonolithicFriction:
    """Frictional contact of a body on a mesh, with all its unknowns.

    Parameters
    ----------
    facets : FrictionFacets
    loads : Loads besides the contact
    rho : float, optional
        Regularisation (stress per length); states do not depend on it. Without it lambda + 2 mu over the
        shortest length of surface of a node, with which the active sets settle most often.
    control : "load" or "approach"
        Whether pairs are loads (P, Q) or motions (approach along -e2, shift along e1) of the obstacle.
    coupled : bool
        Whether shear tractions act on the gaps.
    reduced : bool
        Whether each step of Newton eliminates the unknowns of the body, by factors of its stiffness.
        A body that stands on the contact alone needs ``False``.

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

    def __init__(self, facets, *, loads=Loads(), rho=None, control="load", coupled=True, reduced=True):
        require_kind(FrictionFacets, "FrictionFacets", facets=facets)
        require_kind(Loads, "Loads", loads=loads)
        require_choice(CONTROLS, control=control)
        require_kind(bool, "True or False", coupled=coupled)
        require_kind(bool, "True or False", reduced=reduced)
        self.facets, self.body, self.coupled, self._reduced = facets, facets.body, coupled, reduced
        self.rho = usual_rho(facets) if rho is None else rho
        require_positive(rho=self.rho)
        self.prescribed = (control == "approach",) * 2
        self._assemble(loads)

    def _assemble(self, loads):
        """Stiffness, loads and prescribed values in all unknowns of the body."""
        space = self.body.space
        self.stiffness, self._loads = as_csr(self.body.bulk().mat), self.body.acting(loads)
        supports = ng.GridFunction(space)
        self.body.prescribe(supports.components)
        self._supports = supports.vec.FV().NumPy().copy()
        self._free = np.array(space.FreeDofs())

    @cached_property
    def system(self):
        """The System of the free unknowns."""
        nodes, free, held = self.facets.nodes, self._free, np.where(self._free, 0.0, self._supports)
        reachable = np.array([nodes.can_touch[corner] for corner in nodes.corners])
        initial = np.array([nodes.initial_gaps[corner] for corner in nodes.corners])
        moved = np.array([each @ held for each in self.facets.normal.values()])
        slip = self.facets.slip[:, free]
        made = coulomb.System(
            stiffness=self.stiffness[free][:, free],
            forces=(self._loads - self.stiffness @ held)[free],
            normal=tuple(each[:, free] for each in self.facets.normal.values()),
            tangential=slip,
            dragged=slip,
            gaps=np.where(reachable, initial, np.inf) - moved,
            normals=nodes.normals,
            weights=nodes.weights,
            friction=self.facets.friction,
            rho=self.rho,
        )
        made = made if self.coupled else made.uncoupled()
        return made.reduced() if self._reduced else made

    def follow(self, pairs):
        """Yields a NodalFriction at each pair of loads or motions, in their order, from (0, 0) on.

        Raises
        ------
        NotConverged
            Where no state follows, as when all nodes slip; it says at which pair.
        """
        for reached in coulomb.History(self.system, self.prescribed).follow(pairs):
            yield NodalFriction(self, reached)

    @property
    def unknowns(self):
        """Number of free unknowns, those of the contact and motions of the obstacle included."""
        _, p, q, _ = self.system.parts
        return int(self._free.sum()) + q.stop - p.start + 2 - int(sum(self.prescribed))

    def vector(self, iterate):
        """All unknowns of the body of an iterate, array."""
        own = iterate.fields.reshape(1 if self.coupled else 2, -1).sum(axis=0)
        whole = np.where(self._free, 0.0, self._supports)
        whole[self._free] = own
        return whole


@dataclass(frozen=True, eq=False)
class NodalFriction:
    """A state of a history, at the contact nodes in the order of the facets.

    Attributes
    ----------
    newton : MonolithicFriction
    reached : corners.coulomb.Reached, with pressures (corners, n), gaps, loads, work and dissipation
    """

    newton: MonolithicFriction
    reached: coulomb.Reached

    @property
    def normal(self):
        """P, force per thickness (per area in one dimension)."""
        return float(self.reached.iterate.loads[0])

    @property
    def shear(self):
        """Q, along e1 on the body."""
        return float(self.reached.iterate.loads[1])

    @property
    def shear_traction(self):
        """q at the nodes, array (n,)."""
        return self.reached.iterate.shear

    @property
    def pressures(self):
        """Pressure of each corner, array (corners, n); corners that cannot but move together share theirs."""
        found = self.reached.iterate.pressures
        return np.where(self.newton.facets.nodes.twins, found.mean(axis=0), found)

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
        return self.reached.iterate.shift

    @property
    def slip(self):
        """How far the obstacle has moved over the surface since first contact, array (n,)."""
        return self.reached.slip

    @property
    def stick(self):
        """Nodes that stick, boolean array (n,)."""
        return self.reached.sets.stick

    @property
    def slips(self):
        """Nodes that slip, array (n,) of -1, 0, 1: the sign of q."""
        return self.reached.sets.slips

    @cached_property
    def nodal(self):
        """What `MonolithicNewton` makes of a state without friction, with this one's micromoment."""
        nodes, reached = self.newton.facets.nodes, self.reached
        return NodalState(
            level=float(reached.level[0]),
            approach=reached.iterate.approach,
            load=self.normal,
            fields=self.fields,
            psi=nodes.values("psi", self.fields),
            gaps=dict(zip(nodes.corners, reached.iterate.gaps)),
            multipliers=dict(zip(nodes.corners, -self.pressures)),
            closed=dict(zip(nodes.corners, reached.sets.closed)),
            traction=-self.pressures.sum(axis=0),
            micromoment=self.micromoment,
            iterations=len(reached.changes),
            kkt=self.residual,
            vector=None,  # none to start from: a history starts from the unloaded body
        )

    @cached_property
    def residual(self):
        """The largest violated condition of contact and friction over the largest pressure, of equilibrium
        of body and obstacle over the largest force.
        """
        newton, loads = self.newton, self.reached.iterate.loads
        left, size = (
            self.fields.forces[newton._free],
            newton.facets.nodes.weights.max() * self.pressures.max(),
        )
        missing = 0.0 if newton.prescribed[0] else np.abs(loads - self.reached.level).max() / loads[0]
        return float(max(self.reached.residual, np.abs(left).max() / size, missing))

    @cached_property
    def fields(self):
        """Fields of the body."""
        newton, body = self.newton, self.newton.body
        kept = ng.GridFunction(body.space)
        kept.vec.FV().NumPy()[:] = newton.vector(self.reached.iterate)
        exerted = newton.stiffness @ kept.vec.FV().NumPy() - newton._loads
        facets = newton.facets
        nodes, acting = facets.nodes, np.zeros_like(exerted)
        for each, pressure in zip(facets.normal.values(), self.reached.iterate.pressures):
            acting += each.T @ (nodes.weights * pressure)
        acting -= facets.slip.T @ (nodes.weights * self.reached.iterate.shear)
        return Fields(body, kept.components, exerted + acting)

    @property
    def energy(self):
        """Elastic energy per thickness, of displacements that supports prescribe as well."""
        vector = self.newton.vector(self.reached.iterate)
        return float(vector @ (self.newton.stiffness @ vector)) / 2

    @property
    def work(self):
        """Of the obstacle on the body since the beginning, per thickness."""
        return self.reached.work

    @property
    def dissipation(self):
        """Of friction since the beginning, per thickness."""
        return self.reached.dissipation
