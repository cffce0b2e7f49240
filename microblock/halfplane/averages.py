"""The normal displacement of a half-plane under cells of constant pressure, averaged over cells.

Averages over both cells, of the pressure and of the displacement, make a matrix that is positive definite
whatever the distances of the cells: corners press a second body at places that are no multiples of a cell
apart. Near a load U is -c_u/pi log|x|, far away -c/pi log|x|; both logarithms are averaged in closed form,
with a complex distance x + i L for what one has more than the other, and what is left by Gauss points.
"""

import numpy as np

from ..model.quadrature import gauss_rule
from .kernels import NEAREST, is_classical, normal_kernel, short_waves

FAR = 100.0  # cells, beyond which two terms of a series average a logarithm, to 1e-10
NEAR, GAUSS = 4.0, 4  # cells and layers within which what is left is averaged, by so many points on a cell
TINY = 1e-300


def normal_averages(solid, distance, source, target):
    """`kernels.normal_kernel` averaged over cells of the widths `source` and `target` at distances, arrays
    of one shape: lengths per force.
    """
    distance, source, target = np.broadcast_arrays(np.asarray(distance, float), source, target)
    near, level = short_waves(solid)[0] / np.pi, np.log(solid.ell)
    found = -near * (_log_average(distance, source, target) - level)
    if is_classical(solid):
        return found
    layer, more = solid.layer_length, (1 - solid.nu) / solid.mu / np.pi - near
    found -= more * (_log_average(distance, source, target, layer) - level)

    def left(x):
        x = np.maximum(np.abs(x), NEAREST * solid.ell)
        logarithms = near * np.log(x / solid.ell) + more * np.log(np.hypot(x, layer) / solid.ell)
        return normal_kernel(solid, x) + logarithms

    close = np.abs(distance) < NEAR * np.maximum(np.maximum(source, target), layer)
    points, weights = gauss_rule(GAUSS)
    ways = source[close, None, None] * (points - 0.5) - target[close, None, None] * (points[:, None] - 0.5)
    found[close] += (left(distance[close, None, None] + ways) @ weights) @ weights
    found[~close] += left(distance[~close])
    return found


def _log_average(distance, source, target, depth=0.0):
    """Averages of log|x + i depth|."""
    z, half = distance + 1j * depth, (source + target) / 2
    far = np.abs(z) > FAR * np.maximum(source, target)
    found = np.empty(distance.shape)
    away = z[far]
    found[far] = np.log(np.abs(away)) - ((source[far] ** 2 + target[far] ** 2) / 24 / away**2).real
    z, half, less = z[~far], half[~far], ((source - target) / 2)[~far]
    whole = _twice(z + half) + _twice(z - half) - _twice(z + less) - _twice(z - less)
    found[~far] = whole / (source * target)[~far]
    return found


def _twice(z):
    """Real part of the second integral of log z."""
    return (z**2 * (np.log(np.where(z == 0, TINY, z)) / 2 - 0.75)).real
