"""The nodes of a contact boundary, and the contact law on them, (25)-(40), in one to three dimensions.

Gaps are checked, and multipliers live, at the Gauss-Lobatto points of each facet, of triangles of order 1 at
the vertices: at Gauss points pressures would oscillate.
"""

from functools import cache, cached_property, lru_cache
from weakref import proxy

import ngsolve as ng
import numpy as np
from scipy.sparse import csr_matrix, diags, vstack
from scipy.sparse.linalg import splu
from scipy.special import roots_jacobi

from ..contact_solvers.compliance import nearest_alone
from ..errors import require, require_kind
from ..model import law as laws
from ..model.corner_geometry import Blocks, CornerGeometry
from ..model.fields import squares
from ..model.obstacles import STEEPEST
from ..model.types import Array
from . import contact_term, supports
from .body import PLACES, Body
from .meshes import elements_at
from .off_node_violations import Facets

FLAT = 1e-12  # of unit vectors, shape functions and lengths over their scale: differences that are rounding
TRIANGLE = [(1, 0), (0, 1), (0, 0)]  # reference coordinates of the vertices, in NGSolve's order


@lru_cache
def lobatto(order):
    """Gauss-Lobatto rule of order + 1 points on [0, 1]: points, weights."""
    inner = roots_jacobi(order - 1, 1, 1)[0] if order > 1 else np.zeros(0)
    points = np.concatenate(([-1.0], inner, [1.0]))
    legendre = np.polynomial.legendre.Legendre.basis(order)(points)
    return (points + 1) / 2, 1 / (order * (order + 1) * legendre**2)


@lru_cache
def nodal_rule(kind, order):
    """NGSolve's rule whose points are the nodes of a facet."""
    points, weights = lobatto(order)
    if kind == ng.ET.POINT:
        return rule_at([(0.0,)], [1.0])
    if kind == ng.ET.TRIG:
        return rule_at(TRIANGLE, [1 / 6] * 3)
    if kind == ng.ET.SEGM:
        return rule_at(points[:, None], weights)
    return rule_at([(s, t) for s in points for t in points], np.outer(weights, weights).ravel())


def shapes(element, rule):
    """The functions of an element at the points of a rule: array (points, functions)."""
    values = np.array([element.CalcShape(*point.point[:2]) for point in rule])
    return np.where(np.abs(values) > FLAT, values, 0.0)


def nodal_shapes(kind, order, rule):
    """The nodal polynomials of a facet there: array (points, nodes)."""
    element = ng.fem.H1FE(kind, order)
    return np.linalg.solve(shapes(element, nodal_rule(kind, order)).T, shapes(element, rule).T).T


def rule_at(places, weights=None):
    """NGSolve's rule of reference coordinates, [(s, ...)], and weights."""
    weights = np.zeros(len(places)) if weights is None else weights
    return ng.IntegrationRule([tuple(map(float, place)) for place in places], list(map(float, weights)))


class ContactNodes:
    """The nodes of the contact boundary of a body, in the order of x1, in space in rows of x1.

    Facets have the lower one of the orders of u and psi.

    Parameters
    ----------
    body : Body, of any orders and dimension

    Attributes
    ----------
    points, normals : arrays (n, 2), in space (n, 3); in 1D (0, x2) and e2
    weights : array (n,), lengths or areas (1 in 1D)
    facets : list of arrays, the nodes of each facet from end to end, of a quadrilateral row by row
    joined : array (n - 1,), in the plane the number of the facet that joins a node and the next, or -1
    apart : boolean array (n - 1,), whether none does
    traces : {field: sparse array (n, unknowns)}, its values at the nodes from all unknowns
    shares : array (n,), in space, areas by the rule

    Raises
    ------
    BadArgument
        If supports hold what an obstacle presses; in space for other facets than those of `Body`.

    Examples
    --------
    >>> from microblock.fem import meshes3d
    >>> from microblock.fem.facets import ContactNodes
    >>> x = np.linspace(0, 1, 3)
    >>> solid = mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1)
    >>> nodes = ContactNodes(mb.Body(meshes3d.block(x, x, x - 1), solid, order=2, fixed="bottom"))
    >>> len(nodes.points), round(float(nodes.weights.sum()), 12)
    (25, 1.0)
    """

    def __init__(self, body):
        require_kind(Body, "a Body", body=body)
        self.body, self.dim, self.region = body, body.mesh.dim, supports.pressed(body)
        self._made_of = (body,)
        if self.dim > 1:
            elements_at(body.mesh, self.region)  # which checks that there are some
        if self.dim == 3:
            self._require_upwards()
        self._number_nodes()
        require(
            self.dim < 3 or self.free["u3"].any(),
            "contact",
            body.contact,
            f"is constrained in u3 by the supports on {body.fixed.get('u3')}: an obstacle cannot press what "
            "cannot move",
        )

    def __reduce__(self):
        """A copy is made anew."""
        return type(self), self._made_of

    def _require_upwards(self):
        facets = list(self.region.Elements())
        words = "must be the order of u on a body in space that is pressed"
        require(self.body.order_psi in (0, self.body.order), "order_psi", self.body.order_psi, words)
        require(
            self.body.order == 1 or all(facet.type != ng.ET.TRIG for facet in facets),
            "order",
            self.body.order,
            "must be 1 where triangles are in contact: of higher orders they have no nodal rule with "
            "positive weights; take hexahedra, or prisms with quadrilaterals on top",
        )
        normals = at_rules(self.body.mesh, facets, [rule_at(TRIANGLE)] * len(facets))[2]
        require(
            normals[:, 2].min() > 1 - 1e-9,
            "contact",
            self.body.contact,
            "must be horizontal and face upwards, its normal e3",
        )

    def _number_nodes(self):
        """Nodes are one where the functions of the vertices have the same values."""
        body, elements = self.body, list(self.region.Elements())
        self.orders = [min(body.order, body.order_psi or body.order)] * len(elements)
        if body.element_orders is not None:
            self.orders = [len(body.spaces[0].GetDofNrs(facet)) - 1 for facet in elements]
        numbers, members = {}, []
        for facet, (dofs, values) in zip(elements, self._shapes(body.spaces[0])):
            corners = np.argsort(dofs[: len(facet.vertices)], kind="stable")
            keys = [tuple((dofs[i], round(row[i], 9)) for i in corners if row[i]) for row in values]
            members.append(np.array([numbers.setdefault(key, len(numbers)) for key in keys]))
        there, rules = (
            np.concatenate(members),
            map(nodal_rule, (facet.type for facet in elements), self.orders),
        )
        places, shares, outward = at_rules(body.mesh, elements, rules)
        if self.dim == 1:
            places, outward = (np.column_stack((np.zeros(len(part)), part)) for part in (places, outward))
        points = np.full((len(numbers), places.shape[1]), np.inf)
        np.minimum.at(points, there, places)  # of a period its left end
        weights, normals = np.bincount(there, shares), np.zeros_like(points)
        np.add.at(normals, there, shares[:, None] * outward)
        if self.dim == 3:  # rows of x1 one after the other
            points = self._snapped(points)
            order = np.lexsort(np.round(points / (FLAT * np.ptp(points, axis=0).max())).T)
        else:
            beside = np.zeros(len(points))  # twins at a crack are ordered as the facets on either side are
            for own in members:
                beside[own] += points[own, 0].mean()
            order = np.lexsort((beside, *points.T[::-1]))
        self.facets = [np.argsort(order)[own] for own in members]
        self.points, self.weights, normals = points[order], weights[order], normals[order]
        self.normals = normals / np.linalg.norm(normals, axis=1)[:, None]
        traces = {"u": self._trace(body.spaces[0]), "p": self._trace(body.spaces[-1])}
        shape = len(self.points), body.space.ndof
        self.traces = {name: csr_matrix(shape) for name in body.all_names}
        for name in body.names:
            own, first = traces[name[0]], body.unknowns_of(name).start
            self.traces[name] = csr_matrix((own.data, own.indices + first, own.indptr), shape=shape)
        self.joined = np.full(len(self.points) - 1, -1)
        for number, own in enumerate(self.facets):
            self.joined[own.min() : own.max()] = number
        self.apart = self.joined < 0
        if self.dim == 3:
            self.shares, self.weights = self.weights, self._areas()

    def _areas(self):
        """Integrals of the nodal polynomials, array (n,): the rule fails the patch test on skew
        quadrilaterals.
        """
        integral = self.multipliers.TestFunction() * ng.ds(definedon=self.region, bonus_intorder=2)
        values = ng.LinearForm(integral).Assemble().vec.FV().NumPy()
        return self._multiplier[1].solve(values, trans="T")

    def _snapped(self, points):
        """Points with coordinates of vertices: no rounding decides whether a node lies below a punch."""
        vertices = self.body.mesh.ngmesh.Coordinates()
        size = np.ptp(vertices, axis=0).max()
        for known, own in zip(map(np.unique, vertices.T), points.T):
            near = known[np.searchsorted((known[1:] + known[:-1]) / 2, own)]
            own[:] = np.where(np.abs(near - own) < FLAT * size, near, own)
        return points

    def _shapes(self, space):
        """Of each facet the unknowns of a space, and its functions at the nodes, array (nodes, unknowns):
        alike where the vertices are numbered in the same order.
        """
        known = {}
        for facet, order in zip(self.region.Elements(), self.orders):
            dofs, turned = space.GetDofNrs(facet), np.argsort([vertex.nr for vertex in facet.vertices])
            kind = facet.type, order, len(dofs), *turned
            if kind not in known:
                known[kind] = shapes(space.GetFE(facet), nodal_rule(facet.type, order))
            yield dofs, known[kind]

    def _trace(self, space):
        """Values at the nodes from the unknowns of a space, sparse (n, unknowns)."""
        rows = [()] * len(self.points)
        for members, (dofs, values) in zip(self.facets, self._shapes(space)):
            for number, row in zip(members, values):
                rows[number] = dofs, row
        trace = _rows(rows, space.ndof)
        trace.eliminate_zeros()
        return trace

    def free_of(self, body):
        """{field: whether a body on this mesh does not hold it at a node, boolean array (n,)}."""
        free = np.array(body.space.FreeDofs())
        return {name: abs(self.traces[name]) @ free > 0 for name in body.all_names}

    @cached_property
    def free(self):
        return self.free_of(self.body)

    def motion(self, directions, arms):
        """Displacement u + psi x arm along directions, (n, dim): sparse (n, unknowns)."""
        along, arms = (np.pad(part, ((0, 0), (0, 3 - part.shape[1]))) for part in (directions, arms))
        factors = np.hstack((along, np.cross(arms, along))).T
        found = csr_matrix((len(along), self.body.space.ndof))
        for name in self.body.names:
            factor = factors[PLACES[name]]
            if np.abs(factor).max() > FLAT:
                found = found + diags(factor) @ self.traces[name]
        return found

    @cached_property
    def onto(self):
        """R: (u.n, psi) at the nodes from all unknowns, in space (u, phi1, phi2), u into the body and phi =
        (-psi2, psi1) ell/2; sparse.
        """
        if self.dim < 3:
            return vstack((self.motion(self.normals, 0 * self.normals), self.traces["psi"]), format="csr")
        (u3, psi1, psi2), half = (
            (self.traces[name] for name in ("u3", "psi1", "psi2")),
            self.body.solid.ell / 2,
        )
        return vstack((-u3, -half * psi2, half * psi1), format="csr")

    def moments_of(self, name, exerted):
        """Nodal moments, array (n,), that do the work of what is exerted on a psi."""
        space = self.body.spaces[-1]  # hierarchical: the first unknowns are those of the lower orders
        counts = [own.size for own in self.facets]
        dofs = [space.GetDofNrs(facet)[:count] for facet, count in zip(self.region.Elements(), counts)]
        used = np.unique(np.concatenate(dofs)) + self.body.unknowns_of(name).start
        return splu(self.traces[name][:, used].T.tocsc()).solve(exerted[used])

    @cached_property
    def along(self):
        return Facets(proxy(self), -np.inf)  # no cycle: a matrix is given back at once

    @cached_property
    def beyond(self):
        """Vertices of facets beside the contact that face upwards, array (k,)."""
        beside = list((~self.region).Elements())
        normals = at_rules(self.body.mesh, beside, [rule_at([(1 / 3, 1 / 3)])] * len(beside))[2]
        upper = [facet for facet, normal in zip(beside, normals) if normal[2] > 0.5]
        found, own = (
            {v.nr for facet in some for v in facet.vertices} for some in (upper, self.region.Elements())
        )
        return np.array(sorted(found - own), int)

    def at_points(self, rules):
        """At the points of rules, {kind of a facet: NGSolve's}: places, (k, dim), weights, (k,), and values
        from the nodes, sparse (k, n).
        """
        values = cache(lambda kind, order: nodal_shapes(kind, order, rules[kind]))
        facets = list(self.region.Elements())
        parts = zip(facets, self.facets, self.orders)
        rows = [(own, row) for facet, own, order in parts for row in values(facet.type, order)]
        measured = at_rules(self.body.mesh, facets, [rules[facet.type] for facet in facets])[:2]
        return *measured, _rows(rows, len(self.points))

    @cached_property
    def triangles(self):
        """Triangles between the nodes in space, array (m, 3), to draw on."""
        size = self.orders[0] + 1
        place = np.arange(size * size).reshape(size, size)
        cut = squares(place.T)[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
        return np.concatenate([own[cut] if len(own) > 3 else own[None] for own in self.facets])

    def interpolated(self, values, x1, x2):
        """Nodal values, array (m, n), at places: array (m, k), linear on triangles, nan beyond."""
        from matplotlib.tri import LinearTriInterpolator, Triangulation  # here: it takes its time

        points, found = self.points, np.nan
        levels = np.rint(points[self.triangles[:, 0], 2] / (FLAT * np.ptp(points)))
        for level in np.unique(levels):  # at a step nodes lie one above the other
            surface = Triangulation(*points[:, :2].T, self.triangles[levels == level])
            there = [LinearTriInterpolator(surface, nodal)(x1, x2).filled(np.nan) for nodal in values]
            found = np.where(np.isnan(there), found, there)
        return found

    # what the contact term asks for

    @cached_property
    def multipliers(self):
        """The H1 space of one corner's multiplier."""
        return ng.Compress(self.body.scalar(self.orders[0], definedon=self.region))

    @cached_property
    def _multiplier(self):
        """Values at the nodes from unknowns of a multiplier, and factors of this matrix."""
        trace = self._trace(self.multipliers)
        return trace, splu(trace.tocsc())

    def field(self, values):
        """An expression with nodal values, array (n,), or (n, dim) of a vector."""
        if values.ndim == 1:
            function = ng.GridFunction(self.multipliers)
            function.vec.FV().NumPy()[:] = self._multiplier[1].solve(np.asarray(values, float))
            return function
        parts = [self.field(part) if part.any() else ng.CF(0) for part in values.T]
        return ng.CF((*parts, 0)[:3])

    def within(self, values):
        """A function in the body with nodal values, array (n,), at the boundary: NGSolve finds elements at
        places, and facets not.
        """
        function = ng.GridFunction(self.body.scalar(self.orders[0]))
        dofs = [function.space.GetDofNrs(facet) for facet in self.region.Elements()]
        used = np.unique(np.concatenate(dofs))  # in the order of `multipliers`
        function.vec.FV().NumPy()[used] = self.field(values).vec.FV().NumPy()
        return function

    def multiplier(self, unknowns):
        return self._multiplier[0] @ unknowns

    @cached_property
    def rules(self):
        """{kind of a facet: NGSolve's rule}, whose points are the nodes."""
        return {facet.type: nodal_rule(facet.type, self.orders[0]) for facet in self.region.Elements()}

    def integral(self, density):
        """The integral over the contact boundary by these rules; in space with `weights`."""
        if self.dim == 3:
            density = density * self.field(self.weights / self.shares)
        return density * ng.ds(definedon=self.region, intrules=self.rules)


class ContactFacets(ContactNodes):
    """The nodes of a contact boundary and the terms of a contact law on them.

    Parameters
    ----------
    body : Body
    law : a law of `microblock.model.law`
    obstacle : see `microblock.model.obstacles.gap`

    Attributes
    ----------
    points, normals, weights, ... : as of `ContactNodes`
    arms : array (corners, n, dim), places of the corners from the centres of their blocks (lengths)
    g0 : array (corners, n), initial gaps; inf where a corner cannot touch
    twins : boolean array (n,); there all corners have the same gap, and share one multiplier

    Examples
    --------
    >>> from microblock.fem import meshes
    >>> body = mb.Body(meshes.column(depth=1.0, elements=2),
    ...                mb.Cosserat(E=2.6, nu=0.3, ell=0.2, beta=1), order=4,
    ...                fixed={"u1": "middle", "u2": "middle"}, periodic=True)
    >>> from microblock.fem.facets import ContactFacets
    >>> facets = ContactFacets(body, mb.Microblock(psi0=0.02), mb.Plane(level=0.002))
    >>> facets.g0.shape, round(float(facets.weights.sum()), 9)
    ((2, 4), 0.5)
    """

    twins = False  # in space

    def __init__(self, body, law, obstacle):
        laws.check(law)
        words = "belongs to FrictionFacets: these terms know no shear tractions"
        friction = getattr(law, "friction", 0.0)
        require(not friction, "friction", friction, words)
        super().__init__(body)
        self._made_of = body, law, obstacle
        require(
            body.element_orders is None,
            "body",
            body,
            "must have one order for all elements: the contact rule is the same on every facet",
        )
        self.law = law
        blocks = Blocks(law, body.solid.ell, body.in_space)
        geometry = blocks.under(obstacle, self.points, self.normals)
        self.arms = np.broadcast_to(geometry.offsets_from_centre, (len(blocks.names), *self.points.shape))
        self.g0 = initial_gaps(geometry, self)
        if self.dim < 3:
            self._take_nearest()

    def _take_nearest(self):
        """Where psi is held, leave the nearest corner alone; corners with one gap are twins."""
        fixed, size = ~self.free["psi"], self.body.solid.ell
        require(
            fixed.all() or not self.law.clamps_rotation,
            "law",
            self.law,
            "prescribes psi on the surface: the body must fix psi on its contact boundary",
        )
        held = ng.GridFunction(self.body.space)
        supports.prescribe(self.body, held.components)
        turned = self.g0 - self.displacements(held.vec.FV().NumPy())
        self.twins = fixed & (len(turned) > 1) & (turned.max(axis=0) <= turned.min(axis=0) + FLAT * size)
        self.g0 = np.where(np.isfinite(nearest_alone(turned, fixed)), self.g0, np.inf)

    @cached_property
    def _moved(self):
        return vstack([self.motion(self.normals, arms) for arms in self.arms], format="csr")

    def displacements(self, fields):
        """Displacements of corners along the normal, (corners, n), from unknowns of the body."""
        return (self._moved @ fields).reshape(len(self.arms), -1)

    def contact(self, g0, components, multipliers, approach, rho):
        """The contact term of (37), or of (31), from initial gaps, array (corners, n)."""
        vectors, up = self.body.vectors(components), (0, 1, 0) if self.dim < 3 else (0, 0, 1)
        return contact_term.contact(self, g0, self.arms, *vectors, multipliers, -approach * ng.CF(up), rho)


def require_upwards(nodes):
    """BadArgument where a contact boundary in the plane is too steep for any obstacle."""
    upwards = min(nodes.normals[:, 1].max(), 1.0)  # which rounding exceeds
    tilt = np.degrees(np.arccos(upwards))
    words = f"must face upwards: it is tilted by {tilt:.0f} degrees, and from 60 on no surface can touch"
    require(upwards > STEEPEST, "contact", nodes.body.contact, words)


def initial_gaps(geometry: CornerGeometry, nodes: ContactNodes) -> Array:
    """Returns the initial gaps of corners at nodes, array (corners, n): inf where no obstacle is above, and
    in space where u3 is held; raises BadArgument if all are.
    """
    if nodes.dim < 3:
        require_upwards(nodes)
    gaps = geometry.initial_gaps.copy()
    if nodes.dim == 3:
        gaps[:, ~nodes.free["u3"]] = np.inf
    touching = np.isfinite(gaps).any()
    require(touching, "obstacle", geometry.obstacle, "lies over no node of the contact boundary")
    return gaps


def at_rules(mesh, facets, rules):
    """At the points of a rule on each of some facets: places, (points, dim), weights, (points,), and outward
    normals.
    """
    dim, there, weights = mesh.dim, [], []
    for facet, rule in zip(facets, rules):
        there.append(mesh.GetTrafo(facet)(rule))
        weights += [point.weight for point in rule]
    # numpy promotes the fields of each part
    points = np.frombuffer(b"".join(there), there[0].dtype)
    functions = ng.CF((ng.x, ng.y, ng.z)[:dim]), outward(mesh), ng.specialcf.JacobianMatrix(dim, dim - 1)
    x, normals, slopes = (np.asarray(function(points)) for function in functions)
    slopes = slopes.reshape(len(x), -1)[:, : dim * (dim - 1)].reshape(len(x), dim, dim - 1)
    sizes = np.sqrt(np.linalg.det(np.swapaxes(slopes, 1, 2) @ slopes))  # 1 for points
    return x.reshape(-1, dim), weights * sizes, normals.reshape(-1, dim)


def outward(mesh):
    """The outward normal of a boundary: NGSolve's may point inwards in the plane."""
    normal, places = ng.specialcf.normal(mesh.dim), ng.CF((ng.x, ng.y, ng.z)[: mesh.dim])
    if mesh.dim == 1:
        return normal
    middles = ng.GridFunction(ng.L2(mesh, order=0, dim=mesh.dim))
    middles.Set(places)
    away = places - ng.BoundaryFromVolumeCF(middles)
    return ng.IfPos(ng.InnerProduct(normal, away), 1, -1) * normal


def _rows(rows, width):
    """The sparse matrix of these rows, (columns, values)."""
    i = np.repeat(np.arange(len(rows)), [len(columns) for columns, _ in rows])
    columns, values = (np.concatenate([row[part] for row in rows]) for part in (0, 1))
    return csr_matrix((values, (i, columns)), shape=(len(rows), width))
