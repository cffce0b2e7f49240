"""A contact state of a body on a mesh: pressures, micromoment, zones, energy, fields, error estimate, a picture.

Nodes lie on a straight or curved contact boundary in the order of x1; nothing is mirrored, the load is that of the body.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from . import between, meshes
from .errors import BadArgument
from .law import corner_shifts
from .mesh_fields import BelowOnMesh
from .observables import contact_zones, distance, distance_to_ends, runs
from .surface_view import Setting, StateView, surface

MISSED = 0.03        # of the pressure: what nodes miss of the obstacle, from which on a state says so


@dataclass(frozen=True, repr=False)
class BodyState(BelowOnMesh, StateView):
    """A state on the contact nodes of a condensed body.

    Attributes
    ----------
    scene : BodyContact, the body on the mesh of this state
    load, approach : float, resultant force per thickness and approach of the obstacle
    forces, gaps : arrays (corners, nodes), forces along -n and initial gaps, inf where a corner cannot touch
    closed : boolean array (corners, nodes), the solver's own set
    kkt : float, largest relative residual
    iterations : int, contact sets that were tried
    error_estimate : float, relative error of pressures and fields (`refined.estimate`); None on a mesh that was prescribed

    Examples
    --------
    >>> from microblock import meshes
    >>> mesh = meshes.uniform(mb.Ground(far=2.0, reach=(-1.0, 1.0), half=False), 0.5)
    >>> body = mb.Body(mesh, mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1), order=3, fixed="bottom")
    >>> state = mb.Contact(body, mb.Cylinder(R=10), mb.Microblock()).at(0.5)
    >>> sorted(state.zones), state.approach > 0, state.kkt < 1e-9
    (['A', 'B', 'contact', 'full'], True, True)
    """

    scene: object
    load: float
    approach: float
    forces: np.ndarray
    gaps: np.ndarray
    closed: np.ndarray
    kkt: float
    iterations: int
    error_estimate: float | None = None

    @property
    def nodes(self):
        """The body condensed to its contact nodes."""
        return self.scene.nodes

    @property
    def law(self):
        return self.scene.law

    @property
    def solid(self):
        return self.nodes.body.solid

    @property
    def setting(self):
        return Setting(self.scene.obstacle, self.law, self.nodes.compliance.ell)

    @property
    def named_zones(self):
        """`zones`, by the name that states of every kind have for them."""
        return self.zones

    @property
    def warnings(self):
        """Where the model leaves its ground, where nodes are few or miss features of the obstacle, and where elements do not
        resolve the layer below the contact.

        All but the first on a mesh that was prescribed: an estimate speaks for itself.
        """
        coarse = [] if self.error_estimate is not None else self._unresolved() + self._missed
        return super().warnings + self._few_nodes("ask for rtol=") + coarse

    @cached_property
    def _missed(self):
        """What is wrong, in a list of sentences, where the obstacle has features that the nodes do not see."""
        try:
            square = between.of_body(self).sum()
        except BadArgument as failure:
            return [f"between the nodes the obstacle was not looked at: {failure}"]
        share = np.sqrt(square/(self.weights @ self.pressures.sum(axis=0)**2))
        return [] if share < MISSED else ["the obstacle has features shorter than the elements, worth "
                                          f"{share:.1g} of the pressure: cut the elements below them, or ask for an rtol"]

    def _unresolved(self):
        body, closed = self.nodes.body, self.closed.any(axis=0)
        numbers, across = meshes.thicknesses(body.mesh, self.nodes.region)
        pressed = np.array([closed[members].any() for members in self.nodes.facets])
        orders = np.full(body.mesh.ne, min(body.order, body.order_psi)) if body.element_orders is None else body.element_orders
        for order in np.unique(orders[numbers[pressed]]):
            longest = meshes.longest_element(self.solid, int(order))
            if across[pressed & (orders[numbers] == order)].max() > longest:
                return [f"elements of order {order} that reach deeper than {longest:.2g} below the contact do not resolve the "
                        "layer at the surface: cut them, take a higher order, or ask for an rtol"]
        return []

    def surface(self, window=None):
        """The Surface at the nodes."""
        return surface(self.setting, self.approach, self.nodes.points, self.nodes.normals, pressures=self.pressures,
                       micromoment=self.micromoment, psi=self.psi, sinking=self.sinking)

    @property
    def x(self):
        """x1 of the nodes."""
        return self.nodes.points[:, 0]

    @property
    def weights(self):
        """Lengths of the surface, curved or not: pressures act along -n, so that the load is ``weights @ (p*n2)``."""
        return self.nodes.weights

    @property
    def unknowns(self):
        return self.nodes.unknowns

    @property
    def pressures(self):
        """Pressure of each corner, array (corners, n); where corners move together each has its half."""
        found = self.forces/self.weights
        if len(found) == 2:
            found = np.where(self.nodes.compliance.held, found.mean(axis=0), found)
        return found

    @property
    def micromoment(self):
        """M of (29); where psi is prescribed, the reaction to it."""
        if self.law.clamps_rotation:
            return self.nodes.reaction(self.fields)/self.weights
        levers = np.array(list(self.law.levers(self.x).values()))
        return self.nodes.compliance.ell/2*np.sum(levers*self.pressures, axis=0)

    @property
    def _loads(self):
        """Nodal normal forces and moments, array (2 n,)."""
        return self.nodes.compliance.onto_corners(self.law).T @ self.forces.ravel()

    @cached_property
    def psi(self):
        return self.nodes.compliance.matrix[len(self.x):] @ self._loads

    @cached_property
    def sinking(self):
        """-u.n at the nodes."""
        return -self.nodes.compliance.matrix[:len(self.x)] @ self._loads

    @cached_property
    def zones(self):
        """{"A", "B", "full", "contact": [(left, right), ...]} of x1; a node stands for half the way to its neighbours."""
        return zones_of(self.x, self.closed, self.law)

    @cached_property
    def energy(self):
        """Elastic energy per thickness: half the work of the corner forces."""
        pressed = self.forces > 0
        sunk = np.where(pressed, self.approach*self.nodes.normals[:, 1] - np.where(pressed, self.gaps, 0), 0)
        return float(np.sum(self.forces*sunk)/2)

    @cached_property
    def fields(self):
        """Displacement, microrotation and stresses as NGSolve functions, by one back-substitution."""
        return self.nodes.fields(*np.split(self._loads, 2))

    def pressure(self, corner, x):
        """Pressure of a corner (its number) at x1 = x, array (n,): on each facet the polynomial through its nodes."""
        return self.nodes.interpolate(self.pressures[corner], x)

    def tamed(self, x):
        """1; near ends of the obstacle, where the pressure is infinite, the distance from them over half of its width."""
        shifts = corner_shifts(self.law, self.nodes.compliance.ell)
        return distance_to_ends(x, getattr(self.scene.obstacle, "ends", ()), shifts)

    def difference(self, pressure):
        """``max(|dp|, |dM|/ell)/|p|`` in L2 over the surface from pressures of another kind, `pressure(corner number, x)`.

        At Gauss points between the nodes, near ends of the obstacle weighted with the distance (`tamed`).
        """
        points, weights = np.polynomial.legendre.leggauss(self.nodes.body.order + 2)
        facets = self.nodes.interpolation
        x = np.concatenate([(left + right + (right - left)*points)/2 for left, right, _ in facets])
        weights = np.concatenate([(right - left)/2*weights for left, right, _ in facets])*self.tamed(x)
        own, other = (np.array([one(corner, x) for corner in range(len(self.forces))]) for one in (self.pressure, pressure))
        levers = np.array(list(self.law.levers(x).values()))
        return distance(weights, (own - other).sum(axis=0), np.sum(levers/2*(own - other), axis=0), other.sum(axis=0))


def zones_of(x, closed, law):
    """{name: intervals} of closed nodes."""
    borders = np.concatenate((x[:1], (x[1:] + x[:-1])/2, x[-1:]))
    own = []
    for flags in closed:
        flags = flags | np.concatenate(([False], flags[:-2] & flags[2:], [False]))      # one node may close after its neighbours
        own.append([(float(borders[first]), float(borders[last + 1])) for first, last in runs(flags)])
    return contact_zones(dict(enumerate(own)), law.corners)
