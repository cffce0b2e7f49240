"""A body condensed to the nodes of a contact boundary: its compliance, and the fields of any contact state.

The bulk is assembled once; the interiors of the elements are eliminated while that is done. What is left is
factorised with the unknowns of the contact boundary last, in a fill-reducing order for the others: the
trailing block of the Cholesky factor is that of the Schur complement S, with no solve at all. With R the
values of u.n and psi at the Gauss-Lobatto points of the contact facets the compliance is ``R S^-1 R^T``.
"""

from functools import cached_property

import ngsolve as ng
import numpy as np
from scipy.linalg.lapack import dpotri
from scipy.sparse import bmat, csr_matrix, diags

from .. import cost
from ..corners.compliance import Compliance
from ..errors import BadArgument, require_kind
from ..model.quadrature import lagrange
from ..threads import bounded, released
from .body import FIELDS, Body, Fields
from .bulk import Bulk
from .facets import interruptions, lobatto, mapped, nodal_moments, outward_sides

FLAT = 1e-12  # n1 below which a displacement along x1 does not enter the gaps
HELD = "are rigid motions fixed, and psi where beta = 0?"


class ContactNodes:
    """The Gauss-Lobatto points of the facets of a boundary: p + 1 on a facet of order p, the lower one of u
    and psi, those on shared vertices once.

    Nodes are in the order of x1.

    Parameters
    ----------
    body : Body, two-dimensional, of any orders
    boundary : str, name or pattern of the contact boundary

    Attributes
    ----------
    points, normals : arrays (n, 2)
    weights : array (n,), lengths
    facets : list of arrays, the nodes of each facet from one of its ends to the other
    apart : boolean array (n - 1,), whether the boundary is interrupted between a node and the next
    """

    def __init__(self, body, boundary="contact"):
        require_kind(Body, "a Body", body=body)
        require_kind(str, "the name of a boundary", boundary=boundary)
        self.body, self.boundary, self.region = body, boundary, require_pressed(body, boundary)
        self._number_nodes()

    def __reduce__(self):
        """A copy, or what comes out of a file, is made anew: factors and regions of NGSolve do not travel."""
        return type(self), (self.body, self.boundary)

    def _number_nodes(self):
        """Nodes and the rows of R, of u1, of u2 and of psi."""
        facets, spaces = list(self.region.Elements()), self.body.spaces[1:]
        dofs = [[space.GetDofNrs(facet) for facet in facets] for space in spaces]
        orders = np.min([[len(own) - 1 for own in of_field] for of_field in dofs], axis=0)
        # reference coordinate 0 is the second vertex
        ends = np.array([[vertex.nr for vertex in facet.vertices[::-1]] for facet in facets])
        members = _members(ends, orders)
        measured = self._measured(orders, members)
        order = np.lexsort(measured[0].T[::-1])
        places = np.argsort(order)
        self.facets = [places[own] for own in members]
        self.points, self.weights, normals = (each[order] for each in measured)
        self.normals = normals / np.linalg.norm(normals, axis=1)[:, None]
        self.apart = interruptions(self.body.mesh, self.region, self.points[:, 0])
        falling = ends[:, 0] > ends[:, 1]
        u, psi = (self._values_of(space, facets, own, falling) for space, own in zip(spaces, dofs))
        self._values = [u, u, psi]

    def _values_of(self, space, facets, dofs, falling):
        """Values at the nodes from the unknowns of a space, sparse (n, unknowns)."""
        rows, shapes = [()] * len(self.points), {}
        for facet, own, numbers, turned in zip(facets, dofs, self.facets, falling):
            key = len(own), len(numbers), turned  # functions of an edge depend on its order and direction
            if key not in shapes:
                xis, _ = lobatto(len(numbers) - 1)
                shapes[key] = [np.array(space.GetFE(facet).CalcShape(float(xi))) for xi in xis]
            for number, shape in zip(numbers, shapes[key]):
                rows[number] = (own, shape)
        return _rows(rows, space.ndof)

    def _measured(self, orders, members):
        """Points, weights and normals times weights of the nodes of all facets, those of one order at a
        time.
        """
        count = 1 + max(own.max() for own in members)
        points, weights, normals = np.zeros((count, 2)), np.zeros(count), np.zeros((count, 2))
        sides = outward_sides(self.body.mesh, self.region)
        for order in np.unique(orders):
            here = np.flatnonzero(orders == order)
            there = np.array([members[i] for i in here])
            xis, shares = lobatto(int(order))
            place, lengths, outward = (each[here] for each in mapped(self.body.mesh, self.region, xis))
            points[there] = place
            np.add.at(weights, there, shares * lengths)
            np.add.at(normals, there, (sides[here, None] * shares * lengths)[..., None] * outward)
        return points, weights, normals

    def values(self, name, fields):
        """u1, u2 or psi (its name) of Fields of the body at the nodes, array (n,)."""
        return self._values[FIELDS.index(name)] @ getattr(fields, name).vec.FV().NumPy()

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


class Condensed(ContactNodes):
    """Body condensed to the nodes of its contact boundary.

    Parameters
    ----------
    body : Body, of any orders
    boundary : str, name or pattern of the contact boundary

    Attributes
    ----------
    compliance : Compliance
    form : BilinearForm of the bulk, with the interiors of the elements eliminated
    unknowns : int, free unknowns of the bulk

    Raises
    ------
    NotConverged
        If the supports leave a rigid motion free, or matrices would need more memory than there is.
    BadArgument
        If a support prescribes values other than 0, or holds u2 on the contact boundary, or none holds u1 or
        u2; for a periodic body.

    Examples
    --------
    >>> from microblock.fem import meshes
    >>> mesh = meshes.uniform(meshes.Ground(far=2.0, reach=(-1.0, 1.0), half=False), 0.5)
    >>> body = mb.Body(mesh, mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1), order=2, fixed="bottom")
    >>> from microblock.fem.condensation import Condensed
    >>> nodes = Condensed(body)
    >>> nodes.compliance.matrix.shape == (2*len(nodes.points), 2*len(nodes.points)),
    ...     round(float(nodes.weights.sum()), 9)
    (True, 4.0)
    """

    @bounded
    def __init__(self, body, boundary="contact"):
        require_kind(Body, "a Body", body=body)
        require_pressed(body, boundary, condensed=True)
        super().__init__(body, boundary)
        self._require_room()
        self._assemble()
        self._factorise()
        self.compliance = Compliance(
            self.points, self.normals, self.weights, self._matrix(), body.solid.ell, self.apart
        )

    def _require_room(self):
        """NotConverged where factors and compliance need more memory than is there."""
        mesh, space = self.body.mesh, self.body.space
        self.unknowns = space.FreeDofs().NumSet()
        # of an element; of each all unknowns there are linked
        sides = (2 * mesh.nedge - mesh.GetNE(ng.BND)) / mesh.ne
        orders = (
            self.body.element_orders
            if self.body.element_orders is not None
            else np.full(mesh.ne, self.body.order)
        )
        entries = np.sum((len(self.body.spaces) * sides * orders) ** 2)
        needed = cost.of_factors(space.FreeDofs(True).NumSet(), entries) + cost.of_nodes(len(self.weights))
        cost.require_room(
            needed,
            f"a body of {self.unknowns} unknowns with {len(self.weights)} contact nodes",
            "take longer elements, a lower order or a larger rtol, or name less of the surface as "
            "contact boundary",
        )

    def _assemble(self):
        """The bulk's bilinear form, the second variation of (10)."""
        solid, space = self.body.solid, self.body.space
        (u1, u2, psi), (v1, v2, chi) = space.TnT()
        gradient, kappa = self.body.gradients(u1, u2, psi)
        (s11, s12), (s21, s22) = solid.stress(gradient, psi)
        m = solid.couple_stress(kappa)
        varied, turned = self.body.gradients(v1, v2, chi)
        self.form = ng.BilinearForm(space, symmetric=True, condense=True)
        density = (
            s11 * varied[0, 0]
            + s12 * (varied[0, 1] + chi)
            + s21 * (varied[1, 0] - chi)
            + s22 * varied[1, 1]
            + m[0] * turned[0]
            + m[1] * turned[1]
        )
        self.form += density.Compile() * self.body.dx
        self.form.Assemble()

    def _factorise(self):
        onto = self._onto()
        advice = "take longer elements, a lower order or a larger rtol"
        self._bulk = Bulk(self.form, onto.indices, advice, HELD)
        self._rows = onto[:, self._bulk.contact]

    def _onto(self):
        """R, (u.n, psi) at the nodes from all unknowns, sparse (2 n, unknowns)."""
        un = [
            diags(part) @ values if np.abs(part).max() > FLAT else csr_matrix(values.shape)
            for part, values in zip(self.normals.T, self._values)
        ]
        return bmat([[*un, None], [None, None, self._values[-1]]], format="csr")

    def _matrix(self):
        with released(len(self._bulk.block)):
            upper, _ = dpotri(self._bulk.block.T)  # of S^-1; what is below the diagonal stays 0
        inverse = upper + upper.T
        np.fill_diagonal(inverse, np.diag(upper))
        matrix = self._rows @ (self._rows @ inverse).T
        return (matrix + matrix.T) / 2

    @bounded
    def fields(self, forces, moments):
        """Fields under nodal forces along n and nodal moments, arrays (n,), by one back-substitution."""
        state = ng.GridFunction(self.body.space)
        exerted = self._bulk.solve(self._onto().T @ np.concatenate((forces, moments)), state)
        return Fields(self.body, state.components, exerted)

    @bounded
    def reaction(self, fields):
        """Nodal moments, array (n,), that hold psi = 0 where it is prescribed on the contact boundary."""
        orders, exerted = [len(members) - 1 for members in self.facets], self._bulk.matrix @ fields.values
        return nodal_moments(self._values[-1], self.body, self.region, orders, exerted)


def require_pressed(body, boundary, condensed=False):
    """The region of the contact boundary of a body that can be pressed there, and `condensed`; else
    BadArgument.
    """
    if body.mesh.dim != 2:
        raise BadArgument("body", body, "must be two-dimensional")
    if body.periodic:  # its ends are one node; as two they would share their force at random
        raise BadArgument("body", body, "must not be periodic: Newton() solves on periodic bodies")
    if condensed and body.prescribed:
        raise BadArgument("prescribed", body.prescribed, "supports of a condensed body hold the value 0")
    pressed = body.pressed(boundary)
    if condensed:
        body.require_held()
    return pressed


def condensed(body, boundary="contact", clamped=False):
    """A body as `Condensed`, made once and kept with the body; if `clamped`, psi is constrained on the
    contact.
    """
    key = "condensed", boundary, clamped
    return body.once(
        key, lambda: Condensed(with_psi_constrained(body, boundary) if clamped else body, boundary)
    )


def with_psi_constrained(body, boundary):
    """A body with psi = 0 on its contact boundary besides its own supports."""
    psi = "|".join(filter(None, (body.fixed.get("psi"), boundary)))
    return body.on(body.mesh, fixed={**body.fixed, "psi": psi})


def _members(ends, orders):
    """Numbers of the nodes of each facet: first those of the vertices, then the inner ones."""
    vertices, numbers = np.unique(ends, return_inverse=True)
    starts = len(vertices) + np.cumsum(orders - 1) - (orders - 1)
    return [
        np.concatenate((pair[:1], np.arange(start, start + order - 1), pair[1:]))
        for pair, start, order in zip(numbers.reshape(-1, 2), starts, orders)
    ]


def _rows(rows, width):
    i = np.repeat(np.arange(len(rows)), [len(dofs) for dofs, _ in rows])
    return csr_matrix(
        (np.concatenate([shape for _, shape in rows]), (i, np.concatenate([dofs for dofs, _ in rows]))),
        shape=(len(rows), width),
    )
