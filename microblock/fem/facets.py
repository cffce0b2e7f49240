"""The contact law as NGSolve boundary-facet terms on a nodal rule, (25)-(40).

Gaps are checked, and multipliers live, at the Gauss-Lobatto points of each facet (the paper's
nodal quadrature, for any order): `ContactFacets` numbers these nodes and builds the penalty
term (31) and the augmented Lagrangian term (37). With Gauss's rule the multipliers stay nodal, but
(37) is integrated, and gaps are checked, at Gauss points: for comparison, as pressures then oscillate.
"""

import itertools
from copy import copy
from functools import lru_cache

import ngsolve as ng
import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.linalg import splu
from scipy.special import roots_jacobi

from ..errors import BadArgument, require_choice, require_kind
from ..model.law import check as check_law
from ..model.methods import RULES
from ..model.zones import joined
from .body import FIELDS, Body

SAME_GAP = 1e-12  # of ell: two corner gaps that differ by less are one function
STRAIGHT = 1e-9  # of the normals: gaps of a boundary that bends more are no polynomials between its nodes


@lru_cache(maxsize=64)
def lobatto(order):
    """Gauss-Lobatto rule of order + 1 points on [0, 1], exact for degree 2 order - 1: points, weights."""
    inner = roots_jacobi(order - 1, 1, 1)[0] if order > 1 else np.zeros(0)
    points = np.concatenate(([-1.0], inner, [1.0]))
    legendre = np.polynomial.legendre.Legendre.basis(order)(points)
    return (points + 1) / 2, 1 / (order * (order + 1) * legendre**2)


class ContactFacets:
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
    points, normals : arrays (n, 2); in 1D the contact point is (0, x2) with normal e2
    weights : array (n,), lengths (1 in 1D)
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
        self.body, self.law, self.corners = body, law, law.corners
        self.region = body.pressed(boundary)
        self.order = min(body.order, body.order_psi)
        self.nodal = rule == "nodal"
        self._number_nodes()
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

    def _number_nodes(self):
        """Nodes are the Lobatto points of all facets, those on shared vertices once."""
        body, mesh = self.body, self.body.mesh
        self.multipliers = ng.Compress(body.scalar(self.order, definedon=self.region))
        spaces = dict(zip(FIELDS, body.spaces), multiplier=self.multipliers)
        points, weights = lobatto(self.order) if mesh.dim == 2 else (np.zeros(1), np.ones(1))
        self.rule = ng.IntegrationRule(
            points=[(float(t),) for t in points], weights=[float(w) for w in weights]
        )
        self._nodal_rule = self.rule
        outward = ng.specialcf.normal(mesh.dim)
        numbers, nodes, rows = {}, [], {name: [] for name in spaces}
        for facet, side in zip(self.region.Elements(), outward_sides(mesh, self.region)):
            local = {name: (space.GetFE(facet), space.GetDofNrs(facet)) for name, space in spaces.items()}
            transformation = mesh.GetTrafo(facet)
            for j, (xi, weight) in enumerate(zip(points, weights)):
                shape = {name: _point_row(element, dofs, xi) for name, (element, dofs) in local.items()}
                at_vertex = j in (0, len(points) - 1)
                key = ("vertex", *shape["multiplier"]) if at_vertex else (facet.nr, j)
                mapped = transformation(xi)
                normal = side * np.array(outward(mapped))
                measure = weight * (mapped.measure if mesh.dim == 2 else 1.0)
                if key in numbers:
                    nodes[numbers[key]][1] += measure
                    nodes[numbers[key]][2] += measure * _plane(normal, mesh.dim)
                    continue
                numbers[key] = len(nodes)
                nodes.append([_plane(mapped.point, mesh.dim), measure, measure * _plane(normal, mesh.dim)])
                for name in spaces:
                    rows[name].append(shape[name])
        order = np.lexsort(np.array([point for point, _, _ in nodes]).T[::-1])
        self.points = np.array([nodes[i][0] for i in order])
        self.weights = np.array([nodes[i][1] for i in order])
        normals = np.array([nodes[i][2] for i in order])
        self.normals = normals / np.linalg.norm(normals, axis=1)[:, None]
        self._values = {
            name: _matrix([rows[name][i] for i in order], space.ndof) for name, space in spaces.items()
        }
        self._interpolation = splu(self._values["multiplier"].tocsc())

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
        self.rule = ng.IntegrationRule(ng.SEGM, 2 * self.order + 1)
        rows, weights = [], []
        for facet in self.region.Elements():
            element, dofs = self.multipliers.GetFE(facet), self.multipliers.GetDofNrs(facet)
            for point in self.rule:
                rows.append(_point_row(element, dofs, point.point[0]))
                weights.append(point.weight * body.mesh.GetTrafo(facet)(point.point[0]).measure)
        self._at_rule = _matrix(rows, self.multipliers.ndof)
        self.extents = abs(self._at_rule).T @ np.array(weights)

    def at_rule(self, values):
        """Values at the points of the rule of the piecewise polynomial with these values, array (n,), at the
        nodes.
        """
        return values if self.nodal else self._at_rule @ self._interpolation.solve(values)

    def _reachable(self):
        free = self.body.spaces[FIELDS.index("psi")].FreeDofs()
        fixed = np.array([not any(free[int(d)] for d in row.indices) for row in self._values["psi"]])
        if self.law.clamps_rotation and not fixed.all():
            raise BadArgument(
                "law",
                self.law,
                "prescribes psi on the surface: the body must fix psi on its contact boundary",
            )
        supports = ng.GridFunction(self.body.space)
        self.body.prescribe(supports.components)
        turn = self.body.solid.ell / 2 * self.at_nodes("psi", supports.components[2])
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
        return "psi" in self.body.held_on(self._made_of[3])

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

    @property
    def rows(self):
        """Values at the nodes of u1, u2 and psi from the unknowns of each, sparse matrices (n, unknowns)."""
        return [self._values[name] for name in FIELDS]

    def at_nodes(self, name, function):
        """Values at the nodes of a grid function of the field `name` ("u1", "u2", "psi", "multiplier")."""
        return self._values[name] @ function.vec.FV().NumPy()

    def reaction(self, fields):
        """Nodal moments, array (n,), that hold psi where it is prescribed."""
        orders = itertools.repeat(self.order)
        return nodal_moments(self._values["psi"], self.body, self.region, orders, fields.forces)

    def interpolate(self, values):
        """Grid function of the multiplier space with these values (array (n,)) at the nodes."""
        function = ng.GridFunction(self.multipliers)
        function.vec.FV().NumPy()[:] = self._interpolation.solve(np.asarray(values, float))
        return function

    def gap_changes(self, u1, u2, psi, approach):
        """{corner: gap minus initial gap, at the nodes} of grid functions, the obstacle lowered by
        `approach`.
        """
        un = self.normals[:, 0] * self.at_nodes("u1", u1) + self.normals[:, 1] * self.at_nodes("u2", u2)
        turn = self.body.solid.ell / 2 * self.at_nodes("psi", psi)
        return {
            corner: self.levers[corner] * turn - un - approach * self.normals[:, 1] for corner in self.corners
        }

    def nodal_gaps(self, u1, u2, psi, approach):
        """{corner: gap (22) at the nodes} of grid functions, the obstacle lowered by `approach` along -e2."""
        changes = self.gap_changes(u1, u2, psi, approach)
        return {corner: self.initial_gaps[corner] + change for corner, change in changes.items()}

    def gap(self, corner, u1, u2, psi, approach):
        """The gap (22) of a corner as an expression, exact at the nodes."""
        finite = np.where(self.can_touch[corner], self.initial_gaps[corner], 0.0)
        n1, n2 = (self.interpolate(component) for component in self.normals.T)
        return (
            self.interpolate(finite)
            - n2 * approach
            - (n1 * u1 + n2 * u2)
            + self.body.solid.ell / 2 * self.interpolate(self.levers[corner]) * psi
        )

    def integral(self, density, rule=None):
        """Integral of an expression over the contact boundary by the rule, or another one."""
        return density * ng.ds(definedon=self.region, intrules={ng.SEGM: self.rule if rule is None else rule})

    def penalty(self, rho, u1, u2, psi, approach):
        """The contact term of (31), the sum of rho/2 <g>_-^2 of all corners: (37) without multipliers."""
        nothing = [ng.CF(0)] * len(self.corners)
        return self.augmented_lagrangian(rho, u1, u2, psi, nothing, approach)

    def augmented_lagrangian(self, rho, u1, u2, psi, multipliers, approach):
        """The contact term of (37): sum over the corners of L(g, lambda), (38); `multipliers` by corner."""
        total = 0
        for corner, multiplier in zip(self.corners, multipliers, strict=True):
            gap = self.gap(corner, u1, u2, psi, approach)
            separation = -(multiplier**2) / (2 * rho)
            contact = (multiplier + rho / 2 * gap) * gap
            total += self._where(corner, ng.IfPos(multiplier + rho * gap, separation, contact), separation)
        if self.nodal or not self.twins.any():
            return self.integral(total)
        # where psi is constrained at a node the gaps determine the sum of its multipliers only: their
        # difference is 0 by symmetry
        first, second = multipliers
        tie = self.interpolate(self.twins.astype(float)) * (first - second) ** 2 / (2 * rho)
        return self.integral(total) - self.integral(tie, self._nodal_rule)

    def _where(self, corner, term, otherwise):
        """`term` where the corner can touch."""
        mask = self.can_touch[corner]
        if mask.all():
            return term
        return ng.IfPos(self.interpolate(mask.astype(float)) - 0.5, term, otherwise)


def nodal_moments(values, body, region, orders, forces):
    """Nodal moments, array (n,), of what is exerted in all unknowns of a body: its work on psi.

    `values` are those of psi at the nodes from its unknowns, sparse (n, unknowns), and `orders` those of the
    nodes' polynomials on the facets. On these polynomials, a constant among them, the work is exact; psi of a
    higher order has more of them than there are nodes.
    """
    space = body.spaces[-1]  # hierarchical: the first unknowns of a facet are those of the lower orders
    facets = [space.GetDofNrs(facet)[: order + 1] for facet, order in zip(region.Elements(), orders)]
    used = np.unique(np.concatenate(facets))
    return splu(values[:, used].T.tocsc()).solve(forces[-space.ndof :][used])


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


def mapped(mesh, region, xis):
    """Points of all facets of a boundary of a 2D mesh at reference coordinates, array (facets, xis, 2), what
    a unit of these is long there, array (facets, xis), and NGSolve's normals, array (facets, xis, 2).
    """
    there = at_all_facets(mesh, region, xis)
    points, normals, along = (
        function(there).reshape(-1, len(xis), 2)
        for function in (ng.CF((ng.x, ng.y)), ng.specialcf.normal(2), ng.specialcf.JacobianMatrix(2, 1))
    )
    return points, np.hypot(along[..., 0], along[..., 1]), normals


def elements_at(mesh, region):
    """Numbers of the elements of a 2D mesh at the facets of a boundary, array (facets,)."""
    return np.array([mesh[facet.edges[0]].elements[0].nr for facet in region.Elements()])


def outward_sides(mesh, region):
    """For each facet of a boundary 1, or -1 where NGSolve's normal points inwards, array (facets,): it
    follows the facet's own orientation.
    """
    if mesh.dim == 1:
        return np.ones(len(list(region.Elements())))
    inside = [
        [mesh[vertex].point for vertex in mesh[ng.ElementId(ng.VOL, int(number))].vertices]
        for number in elements_at(mesh, region)
    ]
    ends = [[mesh[vertex].point for vertex in facet.vertices] for facet in region.Elements()]
    away = np.mean(ends, axis=1) - [np.mean(own, axis=0) for own in inside]
    _, _, normals = mapped(mesh, region, (0.5,))
    return np.where(np.sum(away * normals[:, 0], axis=1) > 0, 1.0, -1.0)


def _point_row(element, dofs, xi):
    """{dof: value} of the shape functions that do not vanish at xi (identified dofs added up)."""
    row = {}
    for dof, value in zip(dofs, element.CalcShape(float(xi))):
        if abs(value) > 1e-14:
            row[dof] = row.get(dof, 0.0) + value
    return row


def _plane(vector, dim):
    """A point or normal in the plane; in 1D the only coordinate is x2."""
    return np.array([0.0, vector[0]]) if dim == 1 else np.array(vector[:2])


def _matrix(rows, width):
    entries = [(i, dof, value) for i, row in enumerate(rows) for dof, value in row.items()]
    i, j, values = zip(*entries)
    return csr_matrix((values, (i, j)), shape=(len(rows), width))
