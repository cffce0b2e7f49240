"""A boundary of a mesh as its facets are curved: where straight lines meet it, and the obstacle that it is.

A facet is the polynomial X of its reference coordinates xi. The line x + s n meets it where X(xi) - x has no
part across n, which Newton's method solves on all facets whose spheres the line crosses.
"""

from collections.abc import Sequence
from functools import cached_property
from typing import Any, NamedTuple

import ngsolve as ng
import numpy as np
from numpy.typing import ArrayLike

from ..model.law import side_directions, upwards
from ..model.obstacles import RigidObstacle
from ..model.results import line
from ..model.types import Array, Flags, Integers
from .facet_rules import at_rules, rule_at

PAIRS = 1_000_000  # of lines and facets that are looked at at once
NEWTON_STEPS = 20  # of Newton's method; facets that are straight take one
REACHED = 1e-12  # last step in reference coordinates
BESIDE = 1e-9  # of a facet, in reference coordinates, which rounding may take a line beside it


class Lattice(NamedTuple):
    """Polynomials on a reference facet by their values at points.

    Attributes
    ----------
    powers : array (k, axes) of int, of the k monomials
    points : array (k, axes)
    inverse : array (k, k), monomials' coefficients from values at the points
    """

    powers: Integers
    points: Array
    inverse: Array

    def monomials(self, places: Array) -> Array:
        """Returns the monomials at places, (n, axes): array (n, k)."""
        return np.asarray(np.prod(places[:, None, :] ** self.powers, axis=2), float)

    def slopes(self, places: Array) -> Array:
        """Returns their derivatives at places, (n, axes): array (n, k, axes)."""
        slopes = np.empty((len(places), *self.powers.shape))
        for axis in range(self.powers.shape[1]):
            lower = self.powers.copy()
            lower[:, axis] = np.maximum(lower[:, axis] - 1, 0)
            slopes[:, :, axis] = self.powers[:, axis] * np.prod(places[:, None, :] ** lower, axis=2)
        return slopes


def lattice(kind: Any, order: int) -> Lattice:
    """Returns the Lattice of polynomials of an order on a kind of facet."""
    grid = np.array(list(np.ndindex(*(1 if kind == ng.ET.SEGM else 2) * (order + 1,))))
    powers = grid[grid.sum(axis=1) <= order] if kind == ng.ET.TRIG else grid
    points = powers / max(order, 1)
    polynomials = Lattice(powers, points, np.eye(len(points)))
    inverse: Array = np.asarray(np.linalg.inv(polynomials.monomials(points)), float)
    return polynomials._replace(inverse=inverse)


class Hits(NamedTuple):
    """Where n lines meet a surface.

    Attributes
    ----------
    facets : array (n,) of int, -1 where a line meets none
    places : array (n, axes), reference coordinates there
    distances : array (n,), along the lines (lengths); inf where a line meets none
    signs : array (n, dim), -1 of vectors' components that planes of symmetry turn round
    """

    facets: Integers
    places: Array
    distances: Array
    signs: Array


class SymmetryPlane(NamedTuple):
    """A plane of symmetry, across an axis at a place; `side` is 1 where the body is above, else -1."""

    axis: int
    place: float
    side: int

    def beyond(self, points: Array) -> Flags:
        """Returns whether points, array (n, dim), lie on the other side, boolean array (n,)."""
        return np.asarray(self.side * (points[:, self.axis] - self.place) < 0)

    def mirrored(self, points: Array) -> Array:
        """Returns the mirror images of points, arrays (n, dim)."""
        images = points.copy()
        images[:, self.axis] = 2 * self.place - images[:, self.axis]
        return images


class MeshSurface(RigidObstacle):
    """The surface of a boundary of a mesh, which an obstacle's height and normal gaps are those of.

    Parameters
    ----------
    region : ngsolve.Region, of the boundary, in two or three dimensions
    planes : sequence of SymmetryPlane, beyond which lines meet the mirror image

    Attributes
    ----------
    facets : list of NGSolve's facets
    points : array (k, dim), of the facets (lengths)
    normals : array (facets, dim), outward unit normals in the middle of each
    radii : array (facets,), of spheres around them (lengths)

    Examples
    --------
    >>> from microblock.fem import meshes
    >>> from microblock.fem.mesh_surface import MeshSurface
    >>> mesh = meshes.uniform(meshes.Ground(far=2.0, reach=(-1.0, 1.0), half=False), 0.5)
    >>> bottom = MeshSurface(mesh.Boundaries("bottom"))
    >>> bottom.height(np.array([0.3, 5.0])).tolist()
    [-2.0, inf]
    >>> bottom.normal_gap(np.array([[0.0, -3.0]]), np.array([[0.6, 0.8]])).round(12).tolist()
    [1.25]
    """

    def __init__(self, region: Any, planes: Sequence[SymmetryPlane] = ()) -> None:
        self.planes = planes
        self.region = region
        self.mesh = region.mesh
        self.dim: int = region.mesh.dim
        self.facets = list(region.Elements())
        order = max(self.mesh.GetCurveOrder(), 1)
        self._kinds = sorted({facet.type for facet in self.facets}, key=str)
        self._lattices = [lattice(kind, order) for kind in self._kinds]
        self._kind_of: Integers = np.array([self._kinds.index(facet.type) for facet in self.facets])
        rules = [rule_at(polynomials.points) for polynomials in self._lattices]
        middle = rule_at([(1 / 3, 1 / 3)])
        self.points, _, _ = at_rules(self.mesh, self.facets, [rules[kind] for kind in self._kind_of])
        _, _, self.normals = at_rules(self.mesh, self.facets, [middle] * len(self.facets))
        ends = np.cumsum([len(self._lattices[kind].points) for kind in self._kind_of])[:-1]
        parts = np.split(self.points, ends)
        self._coefficients = [
            np.array([polynomials.inverse @ part for part, its in zip(parts, self._kind_of) if its == kind])
            for kind, polynomials in enumerate(self._lattices)
        ]
        self._among_its_kind: Integers = np.zeros(len(parts), int)
        for kind in range(len(self._kinds)):
            chosen = self._kind_of == kind
            self._among_its_kind[chosen] = np.arange(np.count_nonzero(chosen))
        self._middles = np.array([part.mean(axis=0) for part in parts])
        reach = [np.linalg.norm(part - middle, axis=1).max() for part, middle in zip(parts, self._middles)]
        self.radii: Array = 1.2 * np.array(reach)  # curved facets leave the sphere of their points a little

    def __repr__(self) -> str:
        return line("surface of a mesh", f"{len(self.facets)} facets in {self.dim}D")

    def __reduce__(self) -> tuple[Any, ...]:
        """A copy is made anew: NGSolve's facets have none."""
        return _remade, (self.mesh, self.mesh.GetCurveOrder(), list(self.region.Mask()), self.planes)

    def height(self, *x: ArrayLike) -> Array:
        """Returns the height of the lowest facet that faces downwards at x1, or x1 and x2, arrays (n,): array
        (n,) (lengths); inf where there is none.
        """
        places = np.column_stack([np.ravel(np.asarray(along, float)) for along in x])
        heights = self._below + self.above(places).distances
        return np.asarray(heights.reshape(np.shape(x[0])), float)

    @property
    def _below(self) -> float:
        """A height below all facets (length)."""
        return float(self.points[:, -1].min() - self.radii.max())

    def above(self, places: Array) -> Hits:
        """Returns the Hits of the lowest facets that face downwards at x1, or x1 and x2, array (n, axes)."""
        starts = np.column_stack((places, np.full(len(places), self._below)))
        return self.met(starts, upwards(starts))

    def normal_gap(self, points: Array, normals: Array) -> Array:
        """Returns the distances along unit normals of points, arrays (n, dim), from the nearest facet that
        faces them, array (n,) (lengths), below 0 behind it; inf where there is none.
        """
        return self.met(points, normals).distances

    def met(self, points: Array, directions: Array) -> Hits:
        """Returns the Hits of the lines through points along unit directions, arrays (n, dim): of the facets
        that face a line the nearest to its point.
        """
        signs = np.ones(points.shape)
        for plane in self.planes:
            beyond = plane.beyond(points)
            points = np.where(beyond[:, None], plane.mirrored(points), points)
            signs[beyond, plane.axis] = -1.0
        directions = directions * signs
        hits = Hits(
            np.full(len(points), -1),
            np.zeros((len(points), self.dim - 1)),
            np.full(len(points), np.inf),
            signs,
        )
        rows = max(PAIRS // len(self.facets), 1)
        for first in range(0, len(points), rows):
            chosen = slice(first, first + rows)
            lines, facets = self._crossed(points[chosen], directions[chosen])
            for kind in range(len(self._kinds)):
                of_kind = self._kind_of[facets] == kind
                numbers = lines[of_kind] + first
                self._take_nearest(hits, kind, numbers, facets[of_kind], points, directions)
        return hits

    def _crossed(self, points: Array, directions: Array) -> tuple[Integers, Integers]:
        """Returns pairs of numbers of lines and facets that face them, whose spheres they cross."""
        middle = self._middles.mean(axis=0)  # products of places far from the origin would lose digits
        centres = self._middles - middle
        starts = points - middle
        starts = starts - np.sum(starts * directions, axis=1)[:, None] * directions
        along = directions @ centres.T
        square = np.sum(starts**2, axis=1)[:, None] - 2 * starts @ centres.T + np.sum(centres**2, axis=1)
        crossed = square - along**2 <= self.radii**2
        lines, facets = np.nonzero(crossed)
        return lines, facets

    def _take_nearest(
        self, hits: Hits, kind: int, lines: Integers, facets: Integers, points: Array, directions: Array
    ) -> None:
        """Enters where lines meet facets of a kind, pairs of numbers, into the hits that are farther."""
        polynomials = self._lattices[kind]
        coefficients = self._coefficients[kind][self._among_its_kind[facets]]
        along = directions[lines]
        across = np.stack(side_directions(along), axis=1)
        starts = points[lines]
        places = np.tile(polynomials.points.mean(axis=0), (len(lines), 1))
        step = np.full(len(lines), np.inf)
        moving = np.arange(len(lines))
        for _ in range(NEWTON_STEPS):
            if not len(moving):
                break
            here = places[moving]
            off = np.einsum("nk,nkd->nd", polynomials.monomials(here), coefficients[moving]) - starts[moving]
            slopes = np.einsum("nka,nkd->nda", polynomials.slopes(here), coefficients[moving])
            matrix = across[moving] @ slopes
            change = _solved(matrix, np.einsum("nad,nd->na", across[moving], off))
            places[moving] = np.clip(here - change, -1.0, 2.0)  # beside the facet, but not far away
            step[moving] = np.abs(places[moving] - here).max(axis=1)
            moving = moving[step[moving] > REACHED]
        inside = (step <= REACHED) & (places.min(axis=1, initial=1.0) >= -BESIDE)
        far = places.sum(axis=1) if self._kinds[kind] == ng.ET.TRIG else places.max(axis=1, initial=0.0)
        inside &= far <= 1 + BESIDE
        inside &= self._faces(kind, places, facets, coefficients, along)
        off = np.einsum("nk,nkd->nd", polynomials.monomials(places), coefficients) - starts
        distances = np.where(inside, np.sum(off * along, axis=1), np.inf)
        order = np.argsort(-np.abs(distances), kind="stable")  # the last one of a line stays
        order = order[inside[order]]
        nearest = np.full(len(points), -1)
        nearest[lines[order]] = order
        pairs = nearest[nearest >= 0]
        pairs = pairs[np.abs(distances[pairs]) < np.abs(hits.distances[lines[pairs]])]
        hits.facets[lines[pairs]] = facets[pairs]
        hits.places[lines[pairs]] = np.clip(places[pairs], 0.0, 1.0)
        hits.distances[lines[pairs]] = distances[pairs]

    def _faces(self, kind: int, places: Array, facets: Integers, coefficients: Array, along: Array) -> Flags:
        """Returns whether outward normals of facets at places point against directions, boolean array
        (n,).
        """
        slopes = np.einsum("nka,nkd->nad", self._lattices[kind].slopes(places), coefficients)
        return self._signs[facets] * np.sum(_across(slopes) * along, axis=1) < 0

    @cached_property
    def _signs(self) -> Array:
        """Of each facet 1 where the normal of its reference coordinates points outwards, else -1."""
        signs = np.ones(len(self.facets))
        for kind, polynomials in enumerate(self._lattices):
            chosen = self._kind_of == kind
            middle = np.full((1, self.dim - 1), 1 / 3)
            slopes = np.einsum("ka,nkd->nad", polynomials.slopes(middle)[0], self._coefficients[kind])
            signs[chosen] = np.sign(np.sum(_across(slopes) * self.normals[chosen], axis=1))
        return signs

    def trace(self, space: Any, facets: Integers, places: Array) -> tuple[Integers, Integers, Array]:
        """Returns the functions of a scalar H1 space at places, (n, axes), on facets of given numbers: rows,
        unknowns and values, arrays (k,).
        """
        rows, unknowns, values = [], [], []
        for number in np.unique(facets):
            chosen = np.flatnonzero(facets == number)
            element = space.GetFE(self.facets[number])
            functions = np.array([element.CalcShape(*place) for place in places[chosen]])
            dofs = np.array(space.GetDofNrs(self.facets[number]), int)
            rows.append(np.repeat(chosen, len(dofs)))
            unknowns.append(np.tile(dofs, len(chosen)))
            values.append(functions.ravel())
        if not rows:
            return np.zeros(0, int), np.zeros(0, int), np.zeros(0)
        return np.concatenate(rows), np.concatenate(unknowns), np.concatenate(values)


def _across(slopes: Array) -> Array:
    """Returns vectors across surfaces with slopes, (n, axes, dim): array (n, dim)."""
    if slopes.shape[1] == 1:
        return np.asarray(slopes[:, 0, ::-1] * (1, -1), float)
    return np.cross(slopes[:, 0], slopes[:, 1])


def _solved(matrices: Array, right: Array) -> Array:
    """Returns the solutions of one or two equations each, arrays (n, axes, axes) and (n, axes)."""
    if right.shape[1] == 1:
        return right / _nonzero(matrices[:, 0])
    (a, b), (c, d) = np.moveaxis(matrices, 0, -1)
    first, second = right.T
    change = np.column_stack((d * first - b * second, a * second - c * first))
    return change / _nonzero(a * d - b * c)[:, None]


def _nonzero(values: Array) -> Array:
    """Returns values, those of 0 as the least number: lines along a facet do not meet it."""
    return np.where(np.abs(values) > 0, values, np.finfo(float).tiny)


def _remade(mesh: Any, curve_order: int, mask: list[bool], planes: Sequence[SymmetryPlane]) -> MeshSurface:
    """Returns the surface of a boundary, the boundaries of a mask, in a copy: NGSolve mixes up curves of a
    refined mesh.
    """
    if curve_order > 1:
        mesh.Curve(curve_order)
    return MeshSurface(ng.Region(mesh, ng.BND, ng.BitArray(mask)), planes)
