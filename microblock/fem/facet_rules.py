"""Quadrature rules of facets whose points are the contact nodes, and shape functions at them."""

from collections.abc import Iterable, Sequence
from functools import lru_cache
from itertools import product
from typing import Any

import ngsolve as ng
import numpy as np
from numpy.typing import ArrayLike
from scipy.special import roots_jacobi

from ..errors import require
from ..model.quadrature import gauss_rule
from ..model.types import Array

ROUNDED = (
    1e-12  # of unit vectors, shape functions and lengths over their scale: differences that are rounding
)
TRIANGLE = [(1, 0), (0, 1), (0, 0)]  # reference coordinates of the vertices, in NGSolve's order
SIDES = [(0, 0.5), (0.5, 0), (0.5, 0.5)]  # those of the middles of the sides opposite to them


@lru_cache
def lobatto(order: int) -> tuple[Array, Array]:
    """Returns the Gauss-Lobatto rule on [0, 1]: points and weights, arrays (order + 1,)."""
    inner = roots_jacobi(order - 1, 1, 1)[0] if order > 1 else np.zeros(0)
    points = np.concatenate(([-1.0], inner, [1.0]))
    legendre: Array = np.polynomial.legendre.Legendre.basis(order)(points)
    return (points + 1) / 2, 1 / (order * (order + 1) * legendre**2)


def require_nodal_rule(facets: Iterable[Any], order: int) -> None:
    """Raises BadArgument where triangles are among facets of an order that has no nodal rule for them."""
    words = "must be 1 or 2 where triangles are in contact: of higher orders they have no nodal rule with "
    words += "positive weights; take hexahedra, or prisms with quadrilaterals on top"
    require(order <= 2 or all(facet.type != ng.ET.TRIG for facet in facets), "order", order, words)


def between_vertices(kind: Any, order: int) -> bool:
    """Returns whether no node of a facet is a vertex: of order 2 the integrals of a triangle's functions at
    the vertices are 0, and those at the middles of its sides a third each.
    """
    return bool(kind == ng.ET.TRIG and order == 2)


@lru_cache
def nodal_rule(kind: Any, order: int) -> Any:
    """Returns NGSolve's rule whose points are the nodes of a facet."""
    points, weights = lobatto(order)
    if kind == ng.ET.POINT:
        return rule_at([(0.0,)], [1.0])
    if kind == ng.ET.TRIG:
        return rule_at(SIDES if between_vertices(kind, order) else TRIANGLE, [1 / 6] * 3)
    if kind == ng.ET.SEGM:
        return rule_at(points[:, None], weights)
    return rule_at([(s, t) for s in points for t in points], np.outer(weights, weights).ravel())


@lru_cache
def composite(kind: Any, pieces: int, order: int = 6) -> Any:
    """Returns NGSolve's rule of a triangle or quadrilateral that is cut into pieces along each side, exact up
    to an order on each.
    """
    steps = np.array(list(product(range(pieces), repeat=2)), float)
    rule = ng.IntegrationRule(kind, order)
    points = np.array([point.point[:2] for point in rule])
    parts = [steps[:, None] + points]
    if kind == ng.ET.TRIG:
        upright = steps[steps.sum(axis=1) < pieces]
        turned = steps[steps.sum(axis=1) < pieces - 1] + 1
        parts = [upright[:, None] + points, turned[:, None] - points]
    places = np.concatenate(parts).reshape(-1, 2) / pieces
    weights = np.tile([point.weight for point in rule], len(places) // len(rule)) / pieces**2
    return rule_at(places, weights)


def composite_line(ends: Array) -> Any:
    """Returns NGSolve's rule of a segment, exact up to the order 23 between ends, array (k,), from 0 to 1."""
    points, weights = gauss_rule(12)
    lengths = np.diff(ends)[:, None]
    return rule_at((ends[:-1, None] + lengths * points).reshape(-1, 1), np.ravel(lengths * weights))


def rule_at(places: Sequence[Any] | Array, weights: ArrayLike = 0.0) -> Any:
    """Returns NGSolve's rule of reference coordinates, (points, coordinates), and weights, (points,)."""
    coordinates = [tuple(map(float, place)) for place in places]
    return ng.IntegrationRule(coordinates, np.broadcast_to(weights, len(places)).astype(float).tolist())


def shapes(element: Any, rule: Any) -> Array:
    """Returns the functions of an element at the points of a rule: array (points, functions)."""
    values: Array = np.array([element.CalcShape(*point.point[:2]) for point in rule])
    return np.where(np.abs(values) > ROUNDED, values, 0.0)


def nodal_shapes(kind: Any, order: int, rule: Any) -> Array:
    """Returns the nodal polynomials of a facet at the points of a rule: array (points, nodes)."""
    element = ng.fem.H1FE(kind, 1 if between_vertices(kind, order) else order)
    at_nodes = shapes(element, nodal_rule(kind, order))
    return np.asarray(np.linalg.solve(at_nodes.T, shapes(element, rule).T).T, float)


def at_rules(mesh: Any, facets: Iterable[Any], rules: Sequence[Any]) -> tuple[Array, Array, Array]:
    """Returns places, (points, dim), weights, (points,), and outward normals, (points, dim), at the points of
    a rule on each of some facets.
    """
    dim = mesh.dim
    mapped = [mesh.GetTrafo(facet)(rule) for facet, rule in zip(facets, rules)]
    # numpy promotes the fields of each part
    points = np.frombuffer(b"".join(mapped), mapped[0].dtype)
    places = np.asarray(_place(dim)(points)).reshape(-1, dim)
    normals = np.asarray(outward(mesh)(points)).reshape(-1, dim)
    slopes = np.asarray(ng.specialcf.JacobianMatrix(dim, dim - 1)(points))
    slopes = slopes.reshape(len(places), -1)[:, : dim * (dim - 1)].reshape(len(places), dim, dim - 1)
    sizes = np.sqrt(np.linalg.det(np.swapaxes(slopes, 1, 2) @ slopes))  # 1 for points
    weights = np.array([point.weight for rule in rules for point in rule])
    return places, weights * sizes, normals


def outward(mesh: Any) -> Any:
    """Returns the outward normal of a boundary: NGSolve's may point inwards in the plane."""
    normal = ng.specialcf.normal(mesh.dim)
    if mesh.dim == 1:
        return normal
    middles = ng.GridFunction(ng.L2(mesh, order=0, dim=mesh.dim))
    middles.Set(_place(mesh.dim))
    from_middle = _place(mesh.dim) - ng.BoundaryFromVolumeCF(middles)
    return ng.IfPos(ng.InnerProduct(normal, from_middle), 1, -1) * normal


def units(vectors: Array) -> Array:
    """Returns unit vectors along vectors, arrays (n, dim), along an axis to the last digit."""
    along = vectors / np.linalg.norm(vectors, axis=1)[:, None]
    along[np.abs(along) < ROUNDED] = 0.0
    return np.asarray(along / np.linalg.norm(along, axis=1)[:, None], float)


def _place(dim: int) -> Any:
    """Returns the place as an expression."""
    return ng.CF((ng.x, ng.y, ng.z)[:dim])
