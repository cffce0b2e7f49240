"""Quadrature and interpolation on the reference interval [0, 1]."""

from functools import lru_cache

import numpy as np
from numpy.polynomial.legendre import leggauss

from .types import Array


@lru_cache
def gauss_rule(order: int) -> tuple[Array, Array]:
    """Returns Gauss points and weights on [0, 1], arrays (order,)."""
    points, weights = leggauss(order)
    return (points + 1) / 2, weights / 2


def lagrange(points: Array, v: Array) -> Array:
    """Returns the Lagrange polynomials of the points at v: array v.shape + (k,); of points (..., k) each
    row's at its entry of v.
    """
    difference = points[..., :, None] - points[..., None, :] + np.eye(points.shape[-1])
    distances = v[..., None] - points
    distances[np.abs(distances) < 1e-100] = 1e-100  # at a point itself its own term outweighs all others
    terms = 1 / (difference.prod(axis=-1) * distances)
    terms /= terms.sum(axis=-1, keepdims=True)
    return terms


def form_grid(x1: Array, x2: Array) -> bool:
    """Returns whether places (x1, x2) are rows of equal x1 and columns of equal x2, arrays (n, m)."""
    return x1.ndim == 2 and bool(np.all(x1 == x1[:, :1]) and np.all(x2 == x2[:1]))


def in_blocks(count: int, each: int) -> list[Array]:
    """Returns numbers up to a count in parts of at most a million values."""
    return np.array_split(np.arange(count), 1 + count * each // 2**20)
