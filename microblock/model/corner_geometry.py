"""Places and levers of the corners of blocks, and their gaps, (20)-(22).

    g = g0 + u + (ell/2) lever.phi + (w - d) n2,

g0 the initial gap, u the displacement into the body, phi the microrotation (over a surface (-psi2, psi1), of
the rotations about the sides t1 and t2 of the block), d the approach, and w the displacement of a second body
where the corner stands. Over a surface n3 stands for n2.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .law import Law, exact_slopes, in_frame, is_uniform, upwards
from .obstacles import along_normals, as_obstacle, clearance, heights, initial_gap
from .types import Array, ObstacleLike


@dataclass(frozen=True, eq=False)
class Blocks:
    """Blocks of a law along a line or over a surface. Of a `uniform` law they ask one block alone.

    Attributes
    ----------
    law : Law
    ell : float
        Side of a block (length).
    in_space : bool
        Whether they lie on a surface, not along a line.
    """

    law: Law
    ell: float
    in_space: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the corners."""
        if self.in_space:
            return self.law.surface_corners
        return self.law.corners

    @cached_property
    def uniform(self) -> bool:
        """Whether one block stands for all."""
        return is_uniform(self.law)

    @cached_property
    def _reference_vectors(self) -> tuple[Array, Array]:
        """Places of the corners from the centre and from the contact point, over ell, of the block at the
        origin of a horizontal surface: arrays (corners, dim).
        """
        points = np.zeros((1, 2 + self.in_space))
        normals = upwards(points)
        return self.law.arms(points, normals)[:, 0], self.law.places(points, normals)[:, 0]

    @cached_property
    def offsets(self) -> Array:
        """Places along the surface from the contact point, over ell/2: array (corners, axes)."""
        return 2 * self._reference_vectors[1][:, :-1]

    @cached_property
    def shifts(self) -> tuple[float, ...]:
        """How far right of each corner its contact point lies on a horizontal line (lengths)."""
        return tuple((-self.ell * self._reference_vectors[1][:, 0]).tolist())

    @cached_property
    def _angles(self) -> Array:
        """Initial rotation of the blocks of a uniform law, array (1,) (radians)."""
        return self.law.initial_rotation(np.zeros(1))

    def rotation(self, x: Array) -> Array:
        """Returns the initial rotation of the blocks at abscissae where it acts in gaps, else 0, array (n,)
        (radians).
        """
        if self.uniform:
            return self._angles + 0 * x
        return self.law.initial_rotation(x)

    def levers(self, *x: Array) -> Array:
        """Returns the levers of (29) on a horizontal surface: along a line, at x1, array (corners, ...), over
        a surface, at x1 and x2, array (corners, 2, ...).
        """
        shape = np.shape(x[0])
        arms = self._reference_vectors[0][:, None]
        if not self.uniform:
            points = self._points(*x)
            arms = self.law.arms(points, upwards(points))
        levers = np.moveaxis(-2 * arms[..., :-1], 2, 1)
        corners = levers.shape[:2]
        levers = np.broadcast_to(levers, (*corners, np.size(x[0]))).reshape(*corners, *shape)
        if self.in_space:
            return levers
        return levers[:, 0]

    def _points(self, *x: Array) -> Array:
        """Returns the points of a level surface at x1, or x1 and x2, one after the other, array (n, dim)."""
        return np.column_stack([*map(np.ravel, x), np.zeros(np.size(x[0]))])

    def tilt(self, *x: Array) -> Array:
        """Returns the slopes of the outer sides of the blocks in the levers, array (axes, ...); (0, ...) of
        one corner.
        """
        if len(self.names) == 1:
            return np.empty((0, *np.shape(x[0])))
        origin = np.zeros((1, 2 + self.in_space))
        slopes = exact_slopes(self.law, origin if self.uniform else self._points(*x))
        if slopes is not None:
            slopes = np.broadcast_to(slopes, (len(slopes), np.size(x[0])))
            return slopes.reshape(-1, *np.shape(x[0]))
        offset = self.offsets[0].reshape(-1, *[1] * np.ndim(x[0]))
        lever = self.levers(*x)[0]
        return lever.reshape(-1, *np.shape(x[0])) + offset

    def under(self, obstacle: ObstacleLike, points: Array, normals: Array | None = None) -> CornerGeometry:
        """Returns the geometry of blocks at points under an obstacle; horizontal without normals."""
        if normals is None:
            normals = upwards(points)
        return CornerGeometry(self, obstacle, points, normals)

    def on_horizontal_surface(self, obstacle: ObstacleLike, *x: Array) -> CornerGeometry:
        """Returns the geometry of blocks at x1, or x1 and x2, of a horizontal surface under an obstacle."""
        return self.under(obstacle, np.stack((*x, 0.0 * x[0]), axis=-1))

    def initial_gaps_over_surface(self, obstacle: ObstacleLike, x1: Array, x2: Array) -> Array:
        """Returns the initial gaps at (x1, x2) of a horizontal surface, array (corners, ...) (lengths).
        Arrays of points, which a uniform law does not need, would take three times the memory of heights.
        """
        if not self.uniform:
            return self.on_horizontal_surface(obstacle, x1, x2).initial_gaps
        offsets = self.ell * self._reference_vectors[1]
        return np.array([heights(obstacle, x1 + a, x2 + b) - up for a, b, up in offsets])

    def initial_gap(self, obstacle: ObstacleLike, corner: int, x: Array) -> Array:
        """Returns the initial gap of a numbered corner at x1 of a horizontal line, array (n,) (lengths)."""
        if not self.uniform or as_obstacle(obstacle).normal_gap is not None:
            return self.on_horizontal_surface(obstacle, x).initial_gaps[corner]
        along, up = self.ell * self._reference_vectors[1][corner]
        return clearance(obstacle, up, x + along)


@dataclass(frozen=True, eq=False)
class CornerGeometry:
    """The corners of blocks at points of a surface, and their gaps to an obstacle.

    Attributes
    ----------
    blocks : Blocks
    obstacle : obstacle or callable
    points, normals : arrays (..., dim)
        Contact points (lengths) and outward unit normals.
    """

    blocks: Blocks
    obstacle: ObstacleLike
    points: Array
    normals: Array

    def _from(self, which: int, places: Callable[[Array, Array], Array]) -> Array:
        blocks = self.blocks
        shape = self.points.shape
        if blocks.uniform:
            corners = blocks.ell * blocks._reference_vectors[which]
            corners = corners.reshape(len(corners), *[1] * (len(shape) - 1), -1)
            return in_frame(self.normals, np.moveaxis(corners[..., :-1], -1, 1), corners[..., -1])
        vectors = places(self.points.reshape(-1, shape[-1]), self.normals.reshape(-1, shape[-1]))
        return blocks.ell * vectors.reshape(len(vectors), *shape)

    @cached_property
    def offsets_from_centre(self) -> Array:
        """Places of the corners from the centres of their blocks, arrays (corners, ..., dim) (lengths)."""
        return self._from(0, self.blocks.law.arms)

    @cached_property
    def offsets_from_contact_point(self) -> Array:
        """Places of the corners from the contact points, arrays (corners, ..., dim) (lengths)."""
        return self._from(1, self.blocks.law.places)

    @cached_property
    def corners(self) -> Array:
        """Places of the corners, arrays (corners, ..., dim) (lengths)."""
        return self.points + self.offsets_from_contact_point

    @cached_property
    def levers(self) -> Array:
        """Levers of (29), array (corners, ...), over a surface (corners, 2, ...)."""
        return self.blocks.levers(*np.moveaxis(self.points[..., :-1], -1, 0))

    @cached_property
    def initial_gaps(self) -> Array:
        """Initial gaps along the normals, array (corners, ...) (lengths); inf without an obstacle."""
        if self.blocks.in_space and as_obstacle(self.obstacle).normal_gap is None:
            return np.array([self._gaps_over_surface(offset) for offset in self.offsets_from_contact_point])
        return np.array([initial_gap(self.obstacle, places, self.normals) for places in self.corners])

    def _gaps_over_surface(self, offset: Array) -> Array:
        """Returns the initial gaps of a corner with this offset, array (..., dim), axis by axis, as arrays of
        points are slow to take apart.
        """
        x1, x2, x3 = (self.points[..., axis] + offset[..., axis] for axis in range(3))
        return along_normals(heights(self.obstacle, x1, x2) - x3, self.normals)

    @cached_property
    def directions(self) -> Array:
        """What (u, phi) add to the gaps over a surface, (1, lever), array (corners, 3, n)."""
        return np.insert(self.levers, 0, 1.0, axis=1)

    def rotated(self, psi: Array) -> Array:
        """Returns what the microrotation, array (n,), over a surface (2, n), adds to the gaps, array
        (corners, n) (lengths).
        """
        half = self.blocks.ell / 2
        if self.blocks.in_space:
            return half * (self.levers[:, 1] * psi[0] - self.levers[:, 0] * psi[1])
        return half * self.levers * psi

    def gaps(
        self,
        displacement: Array,
        psi: Array,
        approach: float,
        second: Callable[[Array, Array], Array] | None = None,
    ) -> Array:
        """Returns the gaps (22) of all corners from fields at the points, array (corners, n) (lengths).

        Parameters
        ----------
        displacement : array (n,)
            -u.n (length).
        psi : array (n,), over a surface (2, n)
            Microrotation (radians), over a surface about t1 and t2.
        approach : float
            Of the obstacle (length).
        second : callable, optional
            Displacement of a second body's surface along unit normals of points, arrays (n, dim): array (n,)
            (length).
        """
        lifted = np.array(0.0)
        if second is not None:
            lifted = np.array([second(places, self.normals) for places in self.corners])
        along = approach * self.normals[..., -1]
        return self.initial_gaps + displacement + self.rotated(psi) + lifted - along
