"""The nodes of a horizontal contact boundary in three dimensions, and values of fields there.

On quadrilaterals they are the tensor products of the Gauss-Lobatto points of the elements' order, on
triangles of order 1 the vertices. On triangles of higher order such rules have weights that vanish or are
negative, or have other points than the elements' unknowns: they are refused.
"""

from functools import cached_property

import ngsolve as ng
import numpy as np
from scipy.sparse import bmat, csr_matrix
from scipy.sparse.linalg import splu

from ..errors import BadArgument, require_kind
from ..model.quadrature import lagrange
from .body3d import FIELDS, Body3D
from .facets import lobatto

UPWARDS = 1e-9  # distance of the normal from e3, within which a facet is horizontal
SAME_PLACE = 1e-12  # of the body's size: a node that is so near to a vertex's coordinate has it
DIGITS = 9  # of the shape functions' values by which nodes of neighbouring facets are known as one
STEEP = 0.5  # component of the normal along e3, from which on a facet beside the contact can be touched
BETWEEN = 3  # places along a facet, more than its order, at which states look for penetration
SHARED = ("u3", "psi1", "psi2")  # the fields that the corners of blocks see


class ContactNodes3D:
    """The nodes of the contact boundary of a body in three dimensions, those that facets share once.

    Parameters
    ----------
    body : Body3D

    Attributes
    ----------
    points : array (n, 3)
    weights : array (n,), areas
    facets : list of arrays (k, k) or (3,), the nodes of each facet in its tensor product, or at its vertices
    values : sparse array (n, unknowns of one field)
    depths : array (facets,), how far the element below each facet reaches (length)
    triangles : array (m, 3), triangles between nodes, to draw on

    Raises
    ------
    BadArgument
        If a facet does not face upwards, is a triangle of an order above 1, or supports hold u3 on all of the
        boundary.

    Examples
    --------
    >>> from microblock.fem import meshes3d
    >>> from microblock.fem.nodes3d import ContactNodes3D
    >>> x = np.linspace(0, 1, 3)
    >>> solid = mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1)
    >>> nodes = ContactNodes3D(mb.Body3D(meshes3d.block(x, x, x - 1), solid, order=2, fixed="bottom"))
    >>> len(nodes.points), round(float(nodes.weights.sum()), 12)
    (25, 1.0)
    """

    def __init__(self, body):
        require_kind(Body3D, "a Body3D", body=body)
        self.body, self.region = body, body.boundary(body.contact, "contact")
        self._require_upwards()
        self._number_nodes()
        self.free = {name: self.is_free(name, body) for name in SHARED}
        if not self.free["u3"].any():
            raise BadArgument(
                "contact",
                body.contact,
                f"is constrained in u3 by the supports on {body.fixed['u3']}: an obstacle cannot press what "
                "cannot move",
            )

    def __reduce__(self):
        """A copy, or what comes out of a file, is made anew: regions of NGSolve do not travel."""
        return type(self), (self.body,)

    def _require_upwards(self):
        """BadArgument unless all facets are horizontal, above their elements, and have a rule."""
        mesh, contact = self.body.mesh, self.body.contact
        kinds = {facet.type for facet in self.region.Elements()}
        if kinds != {ng.ET.QUAD} and self.body.order > 1:
            raise BadArgument(
                "order",
                self.body.order,
                "must be 1 where triangles are in contact: of higher orders they have no nodal rule with "
                "positive weights; take hexahedra, or prisms with quadrilaterals on top",
            )
        corners = ng.IntegrationRule([(0, 0), (1, 0), (0, 1)], [0.0] * 3)  # of both kinds of facets
        places = mesh.MapToAllElements({kind: corners for kind in kinds}, self.region)
        normals = np.asarray(ng.specialcf.normal(3)(places)).reshape(-1, 3)
        if not np.all(np.abs(np.abs(normals[:, 2]) - 1) < UPWARDS):
            raise BadArgument("contact", contact, "must be horizontal, its normal e3")
        faces = {facet.faces[0].nr: _heights(mesh, facet) for facet in self.region.Elements()}
        below = {
            face.nr: _heights(mesh, element)
            for element in mesh.Elements()
            for face in element.faces
            if face.nr in faces
        }
        if not all(below[face].mean() < own.mean() for face, own in faces.items()):
            raise BadArgument("contact", contact, "must face upwards, its normal e3")
        self.depths = np.array([own.mean() - below[face].min() for face, own in faces.items()])

    def _number_nodes(self):
        """Nodes, weights, facets and the values of one field at the nodes."""
        mesh, space = self.body.mesh, ng.H1(self.body.mesh, order=self.body.order)
        xi = lobatto(self.body.order)[0]
        places = {ng.ET.QUAD: [(s, t) for s in xi for t in xi], ng.ET.TRIG: [(1, 0), (0, 1), (0, 0)]}
        numbers, points, weights, rows, self.facets = {}, [], [], [], []
        for facet in self.region.Elements():
            element, dofs, own = space.GetFE(facet), np.array(space.GetDofNrs(facet)), []
            transformation = mesh.GetTrafo(facet)  # a mapped point does not keep it alive
            for place, weight in zip(places[facet.type], self._areas(facet.type, transformation)):
                values = np.array(element.CalcShape(*map(float, place)))
                used = np.abs(values) > 1e-14
                key = tuple(sorted(zip(dofs[used].tolist(), np.round(values[used], DIGITS).tolist())))
                if key not in numbers:
                    numbers[key] = len(points)
                    points.append(np.array(transformation(*map(float, place)).point))
                    weights.append(0.0)
                    rows.append((dofs[used], values[used]))
                weights[numbers[key]] += weight
                own.append(numbers[key])
            self.facets.append(np.reshape(own, (len(xi),) * 2 if facet.type == ng.ET.QUAD else 3))
        size = np.ptp(points, axis=0).max()
        order = np.lexsort(np.round(np.array(points) / size, DIGITS).T)  # rows of x1 one after the other
        place = np.argsort(order)
        self.facets = [place[members] for members in self.facets]
        self.points = self._snapped(np.array(points)[order])
        self.weights = np.array(weights)[order]
        counts = np.repeat(np.arange(len(order)), [len(rows[i][0]) for i in order])
        columns, values = (np.concatenate([rows[i][part] for i in order]) for part in (0, 1))
        self.values = csr_matrix((values, (counts, columns)), shape=(len(order), space.ndof))

    def _areas(self, kind, transformation):
        """Integrals of the nodal polynomials over a facet: the Gauss-Lobatto weights, but for order 1 on a
        quadrilateral that is no parallelogram, where those would fail the patch test."""
        if kind == ng.ET.TRIG:
            return np.full(3, transformation(1 / 3, 1 / 3).measure / 6)
        points, weights = np.polynomial.legendre.leggauss(self.body.order + 1)
        points, weights = points / 2 + 0.5, weights / 2
        shares = weights[:, None] * lagrange(lobatto(self.body.order)[0], points)
        measures = np.array([[transformation(s, t).measure for t in points] for s in points])
        return (shares.T @ measures @ shares).ravel()

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

    def is_free(self, field, body):
        """Whether no support of a body on this mesh holds a field at the nodes, boolean array (n,)."""
        free = np.array(body.space.FreeDofs())[body.unknowns_of(field)]
        return abs(self.values) @ free > 0

    @cached_property
    def onto(self):
        """(u, phi1, phi2) at the nodes, u into the body and phi = (-psi2, psi1) ell/2, from all unknowns of
        the body: sparse array (3 n, unknowns)."""
        half, parts = self.body.solid.ell / 2, [[None] * len(FIELDS) for _ in range(3)]
        for row, (name, factor) in enumerate((("u3", -1.0), ("psi2", -half), ("psi1", half))):
            parts[row][FIELDS.index(name)] = factor * self.values
        empty = csr_matrix(self.values.shape)
        return bmat([[empty if part is None else part for part in row] for row in parts], format="csr")

    def moments_of(self, exerted):
        """Nodal moments (m1, m2), array (2, n), in the measure of phi, of what supports that hold psi1 and
        psi2 on the contact boundary exert in each unknown of the body, array (unknowns,)."""
        used = np.unique(self.values.indices)
        nodal = splu(self.values[:, used].T.tocsc())
        m1, m2 = (nodal.solve(exerted[self.body.unknowns_of(name)][used]) for name in SHARED[1:])
        return np.array((-m2, m1)) * 2 / self.body.solid.ell

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
        """(Places between the nodes, array (k, 3), values there from those at the nodes, sparse (k, n))."""
        places, rows, columns, values = [], [], [], []
        inner = np.polynomial.legendre.leggauss(self.body.order + BETWEEN)[0] / 2 + 0.5
        along = lagrange(lobatto(self.body.order)[0], inner)
        for facet, members in zip(self.region.Elements(), self.facets):
            transformation = self.body.mesh.GetTrafo(facet)
            if members.ndim == 1:
                shares = [((1 / 3, 1 / 3), np.full(3, 1 / 3))]
            else:
                shares = [
                    ((s, t), np.outer(a, b).ravel())
                    for s, a in zip(inner, along)
                    for t, b in zip(inner, along)
                ]
            for place, share in shares:
                rows.append(np.full(members.size, len(places)))
                columns.append(members.ravel())
                values.append(share)
                places.append(transformation(*map(float, place)).point)
        shape = len(places), len(self.points)
        entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
        return np.array(places), csr_matrix(entries, shape=shape)

    @cached_property
    def triangles(self):
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


def _heights(mesh, element):
    """x3 of the vertices of an element or a facet, array."""
    return np.array([mesh[vertex].point[2] for vertex in element.vertices])
