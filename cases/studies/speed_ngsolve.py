"""The classical line contact by NGSolve's own ContactBoundary: plane strain, penalty, a rigid counterpart
with a mesh.

Geometry   half of a square of ground, graded to the far field: line for line the mesh of
           `microblock.fem.meshes.uniform`; above it a row of elements, all of whose unknowns are prescribed:
           the parabola of the cylinder and its approach.
Equations  classical elasticity; p = rho <penetration>, by ContactBoundary.AddEnergy as in NGSolve's tutorial
           6.2.
Model      VectorH1 of any order, Newton with sparsecholesky as there. The approach is one more unknown of
           Newton's method: two right-hand sides of one factorisation meet the load. The gap is measured
           between nearest points of the deformed bodies, so the radius is RADIUS contact widths: slopes of
           1e-4 change it by 1e-8 of itself.
Tuned      in favour of NGSolve: rho, the best for each mesh; the counterpart of bilinear elements is finer
           than the ground (a straight side off the parabola would be an error of its own); as many Gauss
           points on a facet as the fields have values there; Newton starts at about the right approach; the
           pressure is read in two ways, of which the better counts: rho times the penetration, or the nodal
           forces over their lengths, which do not oscillate with rho.
"""

from dataclasses import dataclass
from functools import cached_property

import netgen.meshing as netgen
import ngsolve as ng
import numpy as np

from microblock.errors import NotConverged
from microblock.fem.facets import lobatto
from microblock.fem.meshes import uniform_lines
from microblock.model.quadrature import lagrange

RADIUS = 1e4  # over the unit of length
FINER = {1: 8}  # elements of the counterpart on one of the ground, by order; others ONE
ONE = 1
SEARCHED = 1e-2  # unit lengths: how far pairs of points are looked for, far beyond all gaps
ENOUGH = 1e-10  # residual of Newton over the load
ROUNDING = 10  # the residual is not asked for below this many units in the last place
STEPS = 40  # of Newton; two to six are needed


@dataclass(frozen=True)
class Surface:
    """A state on the surface of the half x1 > 0.

    Attributes
    ----------
    ends : array (facets + 1,), abscissae of the facets
    places : array (points,), Gauss points of each facet in [0, 1]
    penalty : array (facets, points), rho times the penetration, negative where there is none
    approach : float
    iterations : int, of Newton's method
    """

    ends: np.ndarray
    places: np.ndarray
    penalty: np.ndarray
    approach: float
    iterations: int

    def by_penetration(self, x):
        """Pressure at x1 >= 0, array (n,): rho times the penetration."""
        return np.maximum(self._polynomials(x, self.places, self.penalty), 0)

    def by_forces(self, x):
        """Pressure at x1 >= 0, array (n,): forces of the Lobatto nodes over their lengths, polynomials
        between them.
        """
        nodes, shares = lobatto(len(self.places) - 1)
        weights = np.polynomial.legendre.leggauss(len(self.places))[1] / 2
        forces = np.maximum(self.penalty, 0) * weights @ lagrange(nodes, self.places)
        lengths = np.tile(shares, (len(forces), 1))
        for values in (forces, lengths):  # of a node on two facets
            shared = values[1:, 0] + values[:-1, -1]
            values[1:, 0] = values[:-1, -1] = shared
        return self._polynomials(x, nodes, forces / lengths)

    def _polynomials(self, x, places, values):
        facet = np.clip(np.searchsorted(self.ends, x) - 1, 0, len(values) - 1)
        side = self.ends[1] - self.ends[0]
        found = np.einsum("ij,ij->i", lagrange(places, (x - self.ends[facet]) / side), values[facet])
        return np.where(x <= self.ends[-1], found, 0)


@dataclass(frozen=True)
class Ground:
    """A quarter of ground, 0 < x1 < far and -far < x2 < 0, with equal squares within `reach`, under a
    parabola.

    Parameters
    ----------
    lam, mu : Lame's constants of plane strain
    far, reach, h : size, region of equal squares and of contact, their side
    order : of the displacement
    rho : stress per length
    """

    lam: float
    mu: float
    far: float
    reach: float
    h: float
    order: int
    rho: float

    def prepare(self):
        """Mesh, spaces, forms and pairs of points, made once and kept."""
        return self._system

    @cached_property
    def _system(self):
        mesh = _mesh(uniform_lines(self.reach, self.far, self.h), self.reach, FINER.get(self.order, ONE))
        space = ng.VectorH1(mesh, order=self.order, dirichletx="bottom|axis", dirichlety="bottom")
        u = space.TrialFunction()
        strain = ng.Sym(ng.Grad(u))
        energy = self.lam / 2 * ng.Trace(strain) ** 2 + self.mu * ng.InnerProduct(strain, strain)
        form = ng.BilinearForm(space, symmetric=True)
        form += ng.Variation(energy * ng.dx("ground"))
        contact = ng.ContactBoundary(mesh.Boundaries("contact"), mesh.Boundaries("under"))
        place = ng.CF((ng.x, ng.y))
        penetration = (place + u - place.Other() - u.Other()) * contact.normal
        contact.AddEnergy(ng.IfPos(penetration, self.rho / 2 * penetration**2, 0))
        state, lowered = ng.GridFunction(space), ng.GridFunction(space)
        state.Set(ng.CF((0, ng.x**2 / 2 / RADIUS)), definedon=mesh.Materials("tool"))
        lowered.Set(ng.CF((0, -1)), definedon=mesh.Materials("tool"))
        contact.Update(state, form, intorder=2 * self.order + 1, maxdist=SEARCHED)
        free = space.FreeDofs() & ~space.GetDofs(mesh.Materials("tool"))
        return space, form, contact, state, lowered, free

    @property
    def unknowns(self):
        """Free unknowns."""
        return sum(self.prepare()[-1])

    def solve(self, load, approach):
        """The state at half the whole load under the cylinder of radius 1; `approach`: the first guess.

        Raises
        ------
        NotConverged
            If Newton's method has not ended after STEPS.
        """
        space, form, _, shape, lowered, free = self.prepare()
        load, approach = load / RADIUS, approach / RADIUS  # all of them small like the slopes
        state = ng.GridFunction(space)
        state.vec.data = shape.vec + approach * lowered.vec
        residual, moved, first, second, product = (state.vec.CreateVector() for _ in range(5))
        inside = ng.Projector(free, True)
        rounding = (
            ROUNDING * np.finfo(float).eps * self.rho * approach * self.reach
        )  # of rho times the penetration
        enough = max(ENOUGH * load, rounding)
        for iteration in range(1, STEPS + 1):
            form.Apply(state.vec, residual)
            force = ng.InnerProduct(lowered.vec, residual)
            product.data = inside * residual
            if max(product.Norm(), abs(force - load)) < enough:
                return self._surface(state, approach, iteration)
            form.AssembleLinearization(state.vec)
            inverse = form.mat.Inverse(free, "sparsecholesky")
            moved.data = form.mat * lowered.vec
            first.data, second.data = inverse * residual, inverse * moved
            product.data = form.mat * first
            at_first = ng.InnerProduct(lowered.vec, product)
            product.data = form.mat * second
            stiffness = ng.InnerProduct(lowered.vec, moved) - ng.InnerProduct(lowered.vec, product)
            further = (load - force + at_first) / stiffness
            state.vec.data += further * lowered.vec - first - further * second
            approach += further
        raise NotConverged(f"Newton has not ended after {STEPS} steps", iterations=STEPS)

    def _surface(self, state, approach, iteration):
        mesh = self.prepare()[0].mesh
        rule = ng.IntegrationRule(ng.SEGM, 2 * self.order + 1)
        mapped = mesh.MapToAllElements({ng.SEGM: rule}, mesh.Boundaries("contact"))
        x, lowered = (np.ravel(field(mapped)) for field in (ng.x, state.components[1]))
        order = np.argsort(x)
        x, lowered = (values[order].reshape(-1, len(rule)) for values in (x, lowered))
        ends = np.linspace(0, self.reach, len(x) + 1)
        penalty = self.rho * RADIUS * (lowered - x**2 / 2 / RADIUS + approach)
        return Surface(ends, (x[0] - ends[0]) / ends[1], penalty, approach * RADIUS, iteration)


def _mesh(lines, reach, finer):
    """Ground and counterpart as one mesh: boundaries "contact" (within the reach), "free", "bottom", "side",
    "axis", "under".
    """
    mesh = netgen.Mesh(dim=2)
    near = round(np.searchsorted(lines, reach * (1 + 1e-9))) - 1
    _block(
        mesh,
        "ground",
        lines,
        -lines[::-1],
        {
            "bottom": np.s_[0, :],
            "side": np.s_[:, -1],
            "free": np.s_[-1, : near - 1 if near else None : -1],
            "contact": np.s_[-1, near::-1],
            "axis": np.s_[::-1, 0],
        },
    )
    _block(
        mesh,
        "tool",
        np.linspace(0, reach, near * finer + 1),
        np.array((0, lines[1])),
        {"under": np.s_[0, :], "right": np.s_[:, -1], "over": np.s_[1, ::-1], "left": np.s_[::-1, 0]},
    )
    return ng.Mesh(mesh)


def _block(mesh, name, across, up, sides):
    """Add a rectangle of quadrilaterals; `sides`: {boundary: index of its nodes, the body to their left}."""
    nodes = np.array(
        [mesh.Add(netgen.MeshPoint(netgen.Pnt(float(x), float(y), 0))).nr for y in up for x in across]
    )
    nodes = nodes.reshape(len(up), len(across))
    domain = mesh.AddRegion(name, dim=2)
    cells = np.stack((nodes[:-1, :-1], nodes[:-1, 1:], nodes[1:, 1:], nodes[1:, :-1]), axis=-1).reshape(-1, 4)
    for cell in cells.tolist():
        mesh.Add(netgen.Element2D(domain, [netgen.PointId(node) for node in cell]))
    for side, index in sides.items():
        number = mesh.AddRegion(side, dim=1)
        for ends in zip(nodes[index].tolist(), nodes[index].tolist()[1:]):
            mesh.Add(netgen.Element1D([netgen.PointId(node) for node in ends], index=number))
