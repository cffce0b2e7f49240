"""The nodes of a contact boundary, and the contact law on them, (25)-(40), in one, two and three dimensions.

Gaps are checked, and multipliers live, at the Gauss-Lobatto points of each facet (the paper's nodal
quadrature, for any order): of segments, of quadrilaterals as tensor products, and of triangles of order 1 the
vertices. On triangles of higher order such rules have weights that vanish or are negative, or have other
points than the elements' unknowns: they are refused. `ContactNodes` numbers these nodes, `ContactFacets` adds
law and obstacle, as the contact term (`microblock.fem.contact_term`) asks for them. With Gauss's rule the
multipliers stay nodal, but (37) is integrated, and gaps are checked, at Gauss points: for comparison, as
pressures then oscillate.
"""

from copy import copy
from functools import cached_property, lru_cache

import ngsolve as ng
import numpy as np
from scipy.sparse import csr_matrix, diags, vstack
from scipy.sparse.linalg import splu
from scipy.special import roots_jacobi

from ..errors import BadArgument, require_choice, require_kind
from ..model.law import check as check_law
from ..model.methods import RULES
from ..model.quadrature import gauss_rule, lagrange
from ..model.zones import joined
from . import contact_term
from .body import PLACES, Body

SAME_GAP = 1e-12  # of ell: two corner gaps that differ by less are one function
STRAIGHT = 1e-9  # of the normals: gaps of a boundary that bends more are no polynomials between its nodes
UPWARDS = 1e-9  # distance of the normal from e3, within which a facet in space is horizontal
SAME_PLACE = 1e-12  # of the body's size: a node that is so near to a vertex's coordinate has it
DIGITS = 9  # of coordinates over the body's size, by which nodes in space stand in rows
VANISHES = 1e-14  # value of a shape function that is 0 but for rounding
FLAT = 1e-12  # component of a direction below which a displacement along the axis does not enter
STEEP = 0.5  # component of the normal along e3, from which on a facet beside the contact can be touched
BETWEEN = 3  # places along a facet, more than its order, at which states look for penetration
TRIANGLE = [(1, 0), (0, 1), (0, 0)]  # reference coordinates of the vertices, in NGSolve's order


@lru_cache(maxsize=64)
def lobatto(order):
    """Gauss-Lobatto rule of order + 1 points on [0, 1], exact for degree 2 order - 1: points, weights."""
    inner = roots_jacobi(order - 1, 1, 1)[0] if order > 1 else np.zeros(0)
    points = np.concatenate(([-1.0], inner, [1.0]))
    legendre = np.polynomial.legendre.Legendre.basis(order)(points)
    return (points + 1) / 2, 1 / (order * (order + 1) * legendre**2)


@lru_cache(maxsize=64)
def nodal_rule(kind, order):
    """NGSolve's rule whose points are the nodes of a facet of this kind and order."""
    points, weights = lobatto(order)
    if kind == ng.ET.POINT:
        return ng.IntegrationRule([(0.0,)], [1.0])
    if kind == ng.ET.TRIG:
        return ng.IntegrationRule(TRIANGLE, [1 / 6] * 3)
    if kind == ng.ET.SEGM:
        return ng.IntegrationRule([(float(t),) for t in points], [float(w) for w in weights])
    pairs = [(float(s), float(t)) for s in points for t in points]
    return ng.IntegrationRule(pairs, [float(v * w) for v in weights for w in weights])


class ContactNodes:
    """The nodes of the contact boundary of a body, those that facets share once.

    Facets have the lower one of the orders of u and psi. Nodes are in the order of x1, in space in rows of
    x1.

    Parameters
    ----------
    body : Body, of any orders and dimension
    boundary : str, name or pattern of the contact boundary

    Attributes
    ----------
    points, normals : arrays (n, 2), in space (n, 3); in 1D the contact point is (0, x2) with normal e2
    weights : array (n,), lengths or areas (1 in 1D)
    facets : list of arrays, the nodes of each facet: from one of its ends to the other, of a quadrilateral
        (k, k) in its tensor product, of a triangle (3,)
    apart : boolean array (n - 1,), in the plane: whether the boundary is interrupted between a node and the
        next
    traces : {field: sparse array (n, unknowns of the field)}, its values at the nodes
    shares : array (n,), in space: the areas that the nodal rule gives the nodes, on quadrilaterals that are
        no parallelograms others than `weights`

    Raises
    ------
    BadArgument
        If supports hold what an obstacle presses; in space also for facets that do not face upwards, and for
        triangles of an order above 1.

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

    def __init__(self, body, boundary=None):
        require_kind(Body, "a Body", body=body)
        boundary = body.contact if boundary is None else boundary
        require_kind(str, "the name of a boundary", boundary=boundary)
        self.body, self.boundary, self.region = body, boundary, body.pressed(boundary)
        self.dim = body.mesh.dim
        if self.dim == 3:
            self._require_upwards()
        self._number_nodes()
        if self.dim == 3 and not self.free["u3"].any():
            raise BadArgument(
                "contact",
                body.contact,
                f"is constrained in u3 by the supports on {body.fixed['u3']}: an obstacle cannot press what "
                "cannot move",
            )

    def __reduce__(self):
        """A copy, or what comes out of a file, is made anew: factors and regions of NGSolve do not travel."""
        return type(self), (self.body, self.boundary)

    def _require_upwards(self):
        """BadArgument unless all facets are horizontal, above their elements, and have a rule."""
        mesh, kinds = self.body.mesh, {facet.type for facet in self.region.Elements()}
        if self.body.order != self.body.order_psi:
            words = "must be the order of u on a body in space that is pressed"
            raise BadArgument("order_psi", self.body.order_psi, words)
        if kinds != {ng.ET.QUAD} and self.body.order > 1:
            raise BadArgument(
                "order",
                self.body.order,
                "must be 1 where triangles are in contact: of higher orders they have no nodal rule with "
                "positive weights; take hexahedra, or prisms with quadrilaterals on top",
            )
        corners = ng.IntegrationRule(TRIANGLE, [0.0] * 3)  # of both kinds of facets
        places = mesh.MapToAllElements({kind: corners for kind in kinds}, self.region)
        normals = np.asarray(ng.specialcf.normal(3)(places)).reshape(-1, 3)
        if not np.all(np.abs(np.abs(normals[:, 2]) - 1) < UPWARDS):
            raise BadArgument("contact", self.boundary, "must be horizontal, its normal e3")
        faces = {facet.faces[0].nr: _heights(mesh, facet) for facet in self.region.Elements()}
        below = {
            face.nr: _heights(mesh, element)
            for element in mesh.Elements()
            for face in element.faces
            if face.nr in faces
        }
        if not all(below[face].mean() < own.mean() for face, own in faces.items()):
            raise BadArgument("contact", self.boundary, "must face upwards, its normal e3")
        self.depths = np.array([own.mean() - below[face].min() for face, own in faces.items()])

    def _number_nodes(self):
        """A node has the number of the unknown of a scalar space that stands for it: neighbours share it."""
        body, elements = self.body, list(self.region.Elements())
        u, psi = ([body.spaces[i].GetDofNrs(facet) for facet in elements] for i in (0, -1))
        plane = [min(len(a), len(b)) - 1 for a, b in zip(u, psi)]
        self.orders = plane if self.dim == 2 else [min(body.order, body.order_psi)] * len(elements)
        lower = u if body.order <= body.order_psi else psi
        ids = [_numbers(facet.type, *own) for facet, *own in zip(elements, lower, self.orders)]
        known, inverse = np.unique(np.concatenate([own.ravel() for own in ids]), return_inverse=True)
        ends = np.cumsum([own.size for own in ids])[:-1]
        members = [own.reshape(part.shape) for own, part in zip(np.split(inverse, ends), ids)]
        points, normals, weights = self._measured(elements, members, len(known))
        if self.dim == 3:  # rows of x1 one after the other
            points = self._snapped(points)
            order = np.lexsort(np.round(points / np.ptp(points, axis=0).max(), DIGITS).T)
        else:
            order = np.lexsort(points.T[::-1])
        self.facets = [np.argsort(order)[own] for own in members]
        self.points, self.weights, normals = points[order], weights[order], normals[order]
        if self.dim == 3:
            self.shares = self._by_rule[order]
        self.normals = normals / np.linalg.norm(normals, axis=1)[:, None]
        own = self._trace(body.spaces[0], elements, u), self._trace(body.spaces[-1], elements, psi)
        self.traces = {name: own[name[0] == "p"] for name in body.names}
        if self.dim == 2:
            self.apart = interruptions(body.mesh, self.region, self.points[:, 0])

    def _measured(self, elements, members, count):
        """Points, normals times weights, and weights of the nodes."""
        dim, mesh = max(self.dim, 2), self.body.mesh
        points, normals, weights = np.zeros((count, dim)), np.zeros((count, dim)), np.zeros(count)
        if self.dim == 1:
            for facet, own in zip(elements, members):
                transformation = mesh.GetTrafo(facet)  # a mapped point does not keep it alive
                place = transformation(0.0)
                points[own, 1], weights[own] = place.point[0], 1.0
                normals[own, 1] = ng.specialcf.normal(1)(place)
            return points, normals, weights
        sides, self._by_rule, points[:] = outward_sides(mesh, self.region), np.zeros(count), np.inf
        kinds = np.array([facet.type == ng.ET.TRIG for facet in elements])
        for order in set(self.orders):
            rules = {facet.type: nodal_rule(facet.type, order) for facet in elements}
            places, sizes, outwards = at_rules(self.body.mesh, self.region, rules)
            starts = np.cumsum([0, *(len(rules[facet.type]) for facet in elements)])[:-1]
            for triangular in set(kinds):
                here = np.flatnonzero((kinds == triangular) & (np.array(self.orders) == order))
                there = np.array([members[i].ravel() for i in here])
                flat = starts[here, None] + np.arange(there.shape[1])
                np.minimum.at(points, there, places[flat])  # of a period its left end
                outward = sides[here, None, None] * outwards[flat]
                if triangular:
                    shares = sizes[flat] / 6
                elif dim == 3:
                    shares = self._areas(order, len(elements))[here]
                else:
                    shares = lobatto(order)[1] * sizes[flat]
                np.add.at(weights, there, shares)
                rule = [point.weight for point in rules[elements[here[0]].type]]
                np.add.at(self._by_rule, there, rule * sizes[flat])
                np.add.at(normals, there, shares[..., None] * outward)
        return points, normals, weights

    def _areas(self, order, count):
        """Integrals of the nodal polynomials over quadrilaterals, array (facets, nodes): the Gauss-Lobatto
        weights, but for order 1 on one that is no parallelogram, where those would fail the patch test.
        """
        points, weights = gauss_rule(order + 1)
        square = [(float(s), float(t)) for s in points for t in points]
        rule = ng.IntegrationRule(square, [0.0] * len(square))
        sizes = at_rules(self.body.mesh, self.region, {ng.ET.QUAD: rule, ng.ET.TRIG: rule})[1]
        shares = weights[:, None] * lagrange(lobatto(order)[0], points)
        sizes = sizes.reshape(count, len(points), len(points))
        return np.einsum("si,fst,tj->fij", shares, sizes, shares).reshape(count, -1)

    def _snapped(self, points):
        """Points whose coordinates are those of the mesh's vertices where they differ by rounding: whether a
        node lies below the face of a punch is decided there."""
        vertices = np.array([vertex.point for vertex in self.body.mesh.vertices])
        size = np.ptp(vertices, axis=0).max()
        for axis in range(3):
            known = np.unique(vertices[:, axis])
            after = np.clip(np.searchsorted(known, points[:, axis]), 1, len(known) - 1)
            for near in (known[after], known[after - 1]):
                points[:, axis] = np.where(
                    np.abs(near - points[:, axis]) < SAME_PLACE * size, near, points[:, axis]
                )
        return points

    def _trace(self, space, elements, dofs):
        """Values at the nodes from the unknowns of a space, sparse (n, unknowns)."""
        shapes, rows = {}, [()] * len(self.points)
        for facet, own, members, order in zip(elements, dofs, self.facets, self.orders):
            vertices = np.unique(own[: len(facet.vertices)], return_inverse=True)[1]
            key = facet.type, len(own), order, *vertices  # functions depend on the directions of edges
            if key not in shapes:
                fel = space.GetFE(facet)
                values = np.array([fel.CalcShape(*_place(point)) for point in nodal_rule(facet.type, order)])
                shapes[key] = np.where(np.abs(values) > VANISHES, values, 0.0)
            for number, shape in zip(members.ravel(), shapes[key]):
                rows[number] = own, shape
        found = _rows(rows, space.ndof)
        found.eliminate_zeros()
        return found

    def is_free(self, name, body):
        """Whether no support of a body on this mesh holds a field at the nodes, boolean array (n,)."""
        return abs(self.traces[name]) @ np.array(body.space.FreeDofs())[body.unknowns_of(name)] > 0

    @cached_property
    def free(self):
        """{field: boolean array (n,)}, where no support holds it."""
        return {name: self.is_free(name, self.body) for name in self.body.names}

    def motion(self, directions, arms):
        """Displacement along directions of what lies at `arms` from the centres of blocks, u + psi x arm:
        sparse array (n, unknowns of the body); both are arrays (n, dim)."""
        along, arms = _in_space(directions), _in_space(arms)
        factors = np.hstack((along, np.cross(arms, along))).T
        found = csr_matrix((len(along), self.body.space.ndof))
        for name in self.body.names:
            factor = factors[PLACES[name]]
            if np.abs(factor).max() > FLAT:
                found = found + diags(factor) @ self.at(name)
        return found

    def at(self, name):
        """Values of a field at the nodes from all unknowns of the body, sparse array (n, unknowns)."""
        trace, first = self.traces[name], self.body.unknowns_of(name).start
        shape = len(self.points), self.body.space.ndof
        return csr_matrix((trace.data, trace.indices + first, trace.indptr), shape=shape)

    @cached_property
    def onto(self):
        """R of `microblock.fem.condensation`."""
        return self._onto()

    def _onto(self):
        """R, from all unknowns: (u.n, psi) at the nodes, in space (u, phi1, phi2), u into the body and
        phi = (-psi2, psi1) ell/2; sparse.
        """
        if self.dim < 3:
            return vstack((self.motion(self.normals, 0 * self.normals), self.at("psi")), format="csr")
        half = self.body.solid.ell / 2
        return vstack((-self.at("u3"), -half * self.at("psi2"), half * self.at("psi1")), format="csr")

    def values(self, name, fields):
        """A field (its name) of Fields of the body at the nodes, array (n,)."""
        return self.traces[name] @ getattr(fields, name).vec.FV().NumPy()

    def moments_of(self, name, exerted):
        """Nodal moments, array (n,), of what is exerted in all unknowns of a body: its work on psi, or on one
        of its components.

        On the nodes' polynomials, a constant among them, the work is exact; psi of a higher order has more of
        them than there are nodes.
        """
        space = self.body.spaces[-1]  # hierarchical: the first unknowns are those of the lower orders
        counts = [own.size for own in self.facets]
        dofs = [space.GetDofNrs(facet)[:count] for facet, count in zip(self.region.Elements(), counts)]
        used = np.unique(np.concatenate(dofs))
        trace = self.traces[name][:, used].T.tocsc()
        return splu(trace).solve(exerted[self.body.unknowns_of(name)][used])

    @cached_property
    def interpolation(self):
        """[(left, right, numbers of its nodes)] of the facets of a boundary along x1, all left to right."""
        found = []
        for members in self.facets:
            members = members[np.argsort(self.points[members, 0])]
            found.append((self.points[members[0], 0], self.points[members[-1], 0], members))
        return sorted(found, key=lambda facet: facet[0])

    def interpolate(self, values, x):
        """Nodal values (array (nodes,)) at x1 = x: on each facet the polynomial through its nodes, 0 beyond
        the boundary.
        """
        found = np.zeros_like(x)
        facets = self.interpolation
        place = np.searchsorted([right for _, right, _ in facets], x)
        for number in np.unique(place[(x >= facets[0][0]) & (place < len(facets))]):
            left, right, members = facets[number]
            here = (place == number) & (x >= left)
            own = values[members]
            if own.any():
                found[here] = (
                    lagrange(
                        (self.points[members, 0] - left) / (right - left), (x[here] - left) / (right - left)
                    )
                    @ own
                )
        return found

    @cached_property
    def beyond(self):
        """Numbers of the vertices of what faces upwards, or downwards, and is no contact: array (k,)."""
        mesh, inside, found = self.body.mesh, self.region.Mask(), set()
        for facet in mesh.Elements(ng.BND):
            if not inside[facet.index]:
                a, b, c = (np.array(mesh[vertex].point) for vertex in facet.vertices[:3])
                across = np.cross(b - a, c - a)
                if abs(across[2]) > STEEP * np.linalg.norm(across):
                    found |= {vertex.nr for vertex in facet.vertices}
        own = {vertex.nr for facet in self.region.Elements() for vertex in facet.vertices}
        return np.array(sorted(found - own), int)

    @cached_property
    def between(self):
        """(Places between the nodes in space, array (k, 3), values there from those at the nodes, sparse
        (k, n)).
        """
        order, rows, places = self.orders[0], [], []
        inner = gauss_rule(order + BETWEEN)[0]
        along = lagrange(lobatto(order)[0], inner)
        square = [(s, t) for s in inner for t in inner], np.kron(along, along)
        for facet, members in zip(self.region.Elements(), self.facets):
            there, shares = square if members.ndim == 2 else ([(1 / 3, 1 / 3)], np.full((1, 3), 1 / 3))
            transformation = self.body.mesh.GetTrafo(facet)  # a mapped point does not keep it alive
            places += [transformation(*map(float, place)).point for place in there]
            rows += [(members.ravel(), share) for share in shares]
        return np.array(places), _rows(rows, len(self.points))

    @cached_property
    def triangles(self):
        """Triangles between the nodes in space, array (m, 3), to draw on."""
        found = []
        for members in self.facets:
            if members.ndim == 1:
                found.append(members[None])
                continue
            a, b, c, d = (
                part.ravel()
                for part in (members[:-1, :-1], members[1:, :-1], members[1:, 1:], members[:-1, 1:])
            )
            found += [np.column_stack((a, b, c)), np.column_stack((a, c, d))]
        return np.concatenate(found)

    # what the contact term asks for

    @cached_property
    def multipliers(self):
        """The H1 space of one corner's multiplier."""
        return ng.Compress(self.body.scalar(self.orders[0], definedon=self.region))

    @cached_property
    def _multiplier(self):
        """Values at the nodes from the unknowns of a multiplier, and the factors of this matrix."""
        elements = list(self.region.Elements())
        trace = self._trace(self.multipliers, elements, [self.multipliers.GetDofNrs(own) for own in elements])
        return trace, splu(trace.tocsc())

    def field(self, values):
        """An expression with these values at the nodes, array (n,), or a vector of (n, dim) with three
        components.
        """
        if values.ndim == 1:
            function = ng.GridFunction(self.multipliers)
            function.vec.FV().NumPy()[:] = self._multiplier[1].solve(np.asarray(values, float))
            return function
        return ng.CF(tuple(self.field(part) if part.any() else ng.CF(0) for part in _in_space(values).T))

    def multiplier(self, unknowns):
        """Values at the nodes from the unknowns of a multiplier, array."""
        return self._multiplier[0] @ unknowns

    def lowering(self, approach):
        """The displacement of an obstacle that is lowered by `approach`, an expression."""
        return -approach * ng.CF((0, 1, 0) if self.dim < 3 else (0, 0, 1))

    @cached_property
    def rules(self):
        """{kind of a facet: NGSolve's rule}, whose points are the nodes."""
        return {facet.type: nodal_rule(facet.type, self.orders[0]) for facet in self.region.Elements()}

    def integral(self, density, rules=None):
        """The integral of an expression over the contact boundary by the rule, or other ones; in space its
        weights are made the areas of the nodes.
        """
        if self.dim == 3:
            density = density * self.field(self.weights / self.shares)
        return density * ng.ds(definedon=self.region, intrules=rules or self.rules)


class ContactFacets(ContactNodes):
    """The nodes of a contact boundary and the terms of a contact law on them.

    Parameters
    ----------
    body : Body
    law : a law of `microblock.model.law`
    obstacle : see `microblock.model.obstacles.gap`
    boundary : str, name or pattern of the contact boundary
    rule : "nodal", or "gauss": order + 1 Gauss points a facet, for the augmented Lagrangian on a straight
        boundary in 2D, all of it below the obstacle, with one order for all fields

    Attributes
    ----------
    points, normals, weights, ... : as of `ContactNodes`
    corners : names of the law's corners
    levers, initial_gaps : {corner: array (n,)}
    can_touch : {corner: boolean array (n,)}; False where there is no obstacle above the corner, and
        for all corners but the nearest where psi is prescribed, so that the others never get nearer
    twins : boolean array (n,); there all corners have the same gap, and share the nearest one's multiplier
    multipliers : the H1 space of one corner's multiplier

    Examples
    --------
    >>> from microblock.fem import meshes
    >>> body = mb.Body(meshes.column(depth=1.0, elements=2),
    ...                mb.Cosserat(E=2.6, nu=0.3, ell=0.2, beta=1), order=4,
    ...                fixed={"u1": "middle", "u2": "middle"}, periodic=True)
    >>> from microblock.fem.facets import ContactFacets
    >>> facets = ContactFacets(body, mb.Microblock(psi0=0.02), mb.Plane(level=0.002))
    >>> sorted(facets.corners), round(float(facets.weights.sum()), 9)
    (['A', 'B'], 0.5)
    """

    def __init__(self, body, law, obstacle, boundary="contact", rule="nodal"):
        require_choice(RULES, rule=rule)
        require_kind(Body, "a Body", body=body)
        require_kind(str, "the name of a boundary", boundary=boundary)
        check_law(law)
        if getattr(law, "friction", 0.0):
            raise BadArgument(
                "friction", law.friction, "belongs to FrictionFacets: these terms know no shear tractions"
            )
        if body.element_orders is not None:
            raise BadArgument(
                "body",
                body,
                "must have one order for all elements: the contact rule is the same on every facet",
            )
        self._made_of = body, law, obstacle, boundary, rule
        super().__init__(body, boundary)
        self.law, self.corners, self.nodal = law, law.corners, rule == "nodal"
        ell = body.solid.ell
        self.levers = law.levers(self.points[:, 0])
        self.initial_gaps = law.initial_gaps(self.points, self.normals, ell, obstacle)
        self.can_touch = self._reachable()
        if not any(mask.any() for mask in self.can_touch.values()):
            raise BadArgument("obstacle", obstacle, "lies over no point of the contact boundary")
        if not self.nodal:
            self._take_gauss_points()

    def __reduce__(self):
        """A copy, or what comes out of a file, is made anew: rules and regions of NGSolve do not travel."""
        return ContactFacets, self._made_of

    def _take_gauss_points(self):
        """The rule of Gauss, the values of nodal polynomials at its points, and the integrals of
        |multipliers' functions|.
        """
        body = self.body
        for excluded, why in (
            (body.mesh.dim != 2, "needs a 2D body"),
            (body.order != body.order_psi, "needs one order for all fields"),
            (np.ptp(self.normals, axis=0).max() > STRAIGHT, "needs a straight contact boundary"),
            (
                not all(mask.all() for mask in self.can_touch.values()),
                "needs an obstacle above all of the contact boundary, and psi free there",
            ),
        ):
            if excluded:
                raise BadArgument("rule", "gauss", why)
        rule = ng.IntegrationRule(ng.SEGM, 2 * self.orders[0] + 1)
        rows, weights = [], []
        for facet in self.region.Elements():
            element, dofs = self.multipliers.GetFE(facet), self.multipliers.GetDofNrs(facet)
            for point in rule:
                rows.append((dofs, element.CalcShape(point.point[0])))
                weights.append(point.weight * body.mesh.GetTrafo(facet)(point.point[0]).measure)
        self.rules, self._at_rule = {ng.SEGM: rule}, _rows(rows, self.multipliers.ndof)
        self.extents = abs(self._at_rule).T @ np.array(weights)

    def at_rule(self, values):
        """Values at the points of the rule of the piecewise polynomial with these values, array (n,), at the
        nodes.
        """
        return values if self.nodal else self._at_rule @ self._multiplier[1].solve(values)

    def _reachable(self):
        fixed = ~self.free["psi"]
        if self.law.clamps_rotation and not fixed.all():
            raise BadArgument(
                "law",
                self.law,
                "prescribes psi on the surface: the body must fix psi on its contact boundary",
            )
        supports = ng.GridFunction(self.body.space)
        self.body.prescribe(supports.components)
        turn = self.body.solid.ell / 2 * self.traces["psi"] @ supports.components[2].vec.FV().NumPy()
        gaps = np.array([self.initial_gaps[corner] + self.levers[corner] * turn for corner in self.corners])
        nearest = np.argmin(gaps, axis=0)
        spread = np.where(np.isfinite(gaps.max(axis=0)), gaps.max(axis=0), 0) - gaps.min(
            axis=0, initial=np.inf
        )
        self.twins = fixed & (len(self.corners) > 1) & (np.abs(spread) <= SAME_GAP * self.body.solid.ell)
        # between the nodes twins are no twins: both keep their multipliers there, tied at the node
        if not self.nodal:
            fixed = fixed & ~self.twins
        return {
            corner: np.isfinite(self.initial_gaps[corner]) & (~fixed | (nearest == number))
            for number, corner in enumerate(self.corners)
        }

    @property
    def psi_held(self):
        """Whether supports hold or prescribe psi on the contact boundary."""
        return "psi" in self.body.held_on(self.boundary)

    @property
    def first_touch(self):
        """Approach at which the first corner touches the undeformed body."""
        return min(
            float((self.initial_gaps[corner] / self.normals[:, 1])[mask].min())
            for corner, mask in self.can_touch.items()
            if mask.any()
        )

    def lowered(self, approach):
        """These facets under the same obstacle, lowered by `approach`."""
        other = copy(self)
        other.initial_gaps = {
            corner: gap - approach * self.normals[:, 1] for corner, gap in self.initial_gaps.items()
        }
        return other

    @cached_property
    def arms(self):
        """Places of the corners from the centres of their blocks, array (corners, n, 2) (lengths)."""
        return self.body.solid.ell * self.law.arms(self.points, self.normals)

    @property
    def g0(self):
        """Initial gaps, array (corners, n); inf where a corner cannot touch."""
        each = [(self.can_touch[corner], self.initial_gaps[corner]) for corner in self.corners]
        return np.array([np.where(reachable, gaps, np.inf) for reachable, gaps in each])

    @cached_property
    def moved(self):
        """[displacement of each corner along the normal], sparse arrays (n, unknowns of the body)."""
        return [self.motion(self.normals, arms) for arms in self.arms]

    def gaps(self, fields, approach):
        """The gap (22) of each corner, array (corners, n), from the unknowns of the body, array, the obstacle
        lowered by `approach`.
        """
        initial = np.array(list(self.initial_gaps.values()))
        return initial - [corner @ fields for corner in self.moved] - approach * self.normals[:, -1]

    def contact(self, components, multipliers, approach, rho):
        """The contact term of (37), or of (31) without multipliers."""
        lams, vectors = multipliers or [ng.CF(0)] * len(self.corners), self.body.vectors(components)
        total = contact_term.contact(self, self.g0, self.arms, *vectors, lams, self.lowering(approach), rho)
        if self.nodal or not self.twins.any():
            return total
        # where psi is constrained at a node the gaps determine the sum of its multipliers only: their
        # difference is 0 by symmetry
        first, second = multipliers
        tie = self.field(self.twins) * (first - second) ** 2 / (2 * rho)
        rules = {ng.SEGM: nodal_rule(ng.SEGM, self.orders[0])}
        return total - self.integral(tie, rules)


def interruptions(mesh, region, x):
    """Whether no facet of a boundary lies between a node and the next; x ascends."""
    spans = [sorted(mesh[vertex].point[0] for vertex in facet.vertices) for facet in region.Elements()]
    left, right = np.array(joined(map(tuple, spans))).T
    middle = (x[1:] + x[:-1]) / 2
    place = np.searchsorted(left, middle, side="right") - 1
    return (np.diff(x) > 0) & ((place < 0) | (middle > right[place]))


def at_all_facets(mesh, region, xis):
    """The points of all facets of a boundary at reference coordinates, as NGSolve's functions take them."""
    rule = ng.IntegrationRule(points=[(float(xi),) for xi in xis], weights=[0.0] * len(xis))
    return mesh.MapToAllElements({ng.SEGM: rule}, region)


def at_rules(mesh, region, rules):
    """Points of all facets of a boundary at those of rules, array (points, dim), what a unit of the reference
    coordinates is long (large) there, array (points,), and NGSolve's normals, array (points, dim).
    """
    dim, there = mesh.dim, mesh.MapToAllElements(rules, region)
    points, normals, slopes = (
        np.asarray(function(there))
        for function in (
            ng.CF((ng.x, ng.y, ng.z)[:dim]),
            ng.specialcf.normal(dim),
            ng.specialcf.JacobianMatrix(dim, dim - 1),
        )
    )
    slopes = slopes.reshape(-1, dim, dim - 1)
    sizes = np.sqrt(np.linalg.det(np.swapaxes(slopes, 1, 2) @ slopes))
    return points.reshape(-1, dim), sizes, normals.reshape(-1, dim)


def mapped(mesh, region, xis):
    """What `at_rules` returns at reference coordinates of the facets of a 2D mesh: arrays (facets, xis, 2),
    (facets, xis) and (facets, xis, 2).
    """
    rule = ng.IntegrationRule(points=[(float(xi),) for xi in xis], weights=[0.0] * len(xis))
    points, sizes, normals = at_rules(mesh, region, {ng.SEGM: rule})
    return points.reshape(-1, len(xis), 2), sizes.reshape(-1, len(xis)), normals.reshape(-1, len(xis), 2)


def elements_at(mesh, region):
    """Numbers of the elements of a 2D mesh at the facets of a boundary, array (facets,)."""
    return np.array([mesh[facet.edges[0]].elements[0].nr for facet in region.Elements()])


def outward_sides(mesh, region):
    """For each facet of a boundary 1, or in the plane -1 where NGSolve's normal points inwards, array
    (facets,): it follows the facet's own orientation.
    """
    if mesh.dim != 2:
        return np.ones(len(list(region.Elements())))
    inside = [
        [mesh[vertex].point for vertex in mesh[ng.ElementId(ng.VOL, int(number))].vertices]
        for number in elements_at(mesh, region)
    ]
    ends = [[mesh[vertex].point for vertex in facet.vertices] for facet in region.Elements()]
    away = np.mean(ends, axis=1) - [np.mean(own, axis=0) for own in inside]
    _, _, normals = mapped(mesh, region, (0.5,))
    return np.where(np.sum(away * normals[:, 0], axis=1) > 0, 1.0, -1.0)


def _numbers(kind, dofs, order):
    """The unknown that stands for each node of a facet, of its unknowns in a scalar H1 space of this order:
    array (order + 1,), of a quadrilateral (order + 1, order + 1), of a triangle (3,)."""
    dofs, inner = np.array(dofs), order - 1
    if kind in (ng.ET.POINT, ng.ET.TRIG):
        return dofs

    def between(start, end, edge):  # unknowns of an edge, from one vertex to another
        return edge if start < end else edge[::-1]

    if kind == ng.ET.SEGM:  # reference coordinate 0 is the second vertex
        return np.array([dofs[1], *between(dofs[1], dofs[0], dofs[2 : 2 + inner]), dofs[0]])
    grid, (a, b, c, d) = np.empty((order + 1,) * 2, int), dofs[:4]
    bottom, top, left, right = dofs[4 : 4 + 4 * inner].reshape(4, inner)
    grid[[0, -1, -1, 0], [0, 0, -1, -1]] = a, b, c, d
    grid[1:-1, 0], grid[1:-1, -1] = between(a, b, bottom), between(d, c, top)
    grid[0, 1:-1], grid[-1, 1:-1] = between(a, d, left), between(b, c, right)
    grid[1:-1, 1:-1] = dofs[4 + 4 * inner :].reshape(inner, inner)
    return grid


def _place(point):
    """The reference coordinates of a point of a rule, as `CalcShape` takes them: two at most."""
    return [float(coordinate) for coordinate in point.point[:2]]


def _in_space(vectors):
    """Vectors with three components, arrays (..., 3), of some in the plane."""
    missing = 3 - vectors.shape[-1]
    return np.concatenate((vectors, np.zeros((*vectors.shape[:-1], missing))), axis=-1)


def _heights(mesh, element):
    """x3 of the vertices of an element or a facet, array."""
    return np.array([mesh[vertex].point[2] for vertex in element.vertices])


def _rows(rows, width):
    """The sparse matrix of these rows, (columns, values)."""
    i = np.repeat(np.arange(len(rows)), [len(columns) for columns, _ in rows])
    columns, values = (np.concatenate([row[part] for row in rows]) for part in (0, 1))
    return csr_matrix((values, (i, columns)), shape=(len(rows), width))
