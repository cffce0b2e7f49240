"""Kernels of a half-plane averaged over the loaded and the responding cell (docs/theory/friction.md).

The average is a second difference of the kernel's second antiderivative F, tabulated over x^2; far away Gauss
points replace it.
"""

from collections.abc import Sequence
from itertools import product

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import ArrayLike

from ..model.material import Cosserat
from ..model.types import Array
from .kernels import TABULATED, LineKernels, kernels


class SecondAntiderivatives(LineKernels):
    """F of the kernels of `LineKernels`, F'' = K and F(0) = F'(0) = 0, over x^2."""

    def _values(self, solid: Cosserat, x: Array) -> Array:
        values = kernels(solid.nu, solid.beta, solid.curvature)(x, range(9))
        nodes = chebyshev.chebpts1(x.shape[1])
        count = len(nodes)
        nearest = TABULATED[0]
        logarithms = np.log(x[0] / nearest)
        # integrals in log x to the nodes of a piece, and to its end
        sums = chebyshev.chebint(np.linalg.inv(chebyshev.chebvander(nodes, count - 1)), lbnd=-1)
        sums = chebyshev.chebvander(np.append(nodes, 1.0), count) @ sums * logarithms.mean()
        rate, constant = np.polyfit(logarithms, values[:, 0].T, 1)[:, :, None]  # next to x = 0
        moments = []  # the integral of K, and that of x K over x
        for power in 1, 2:
            integrals = values * x**power @ sums.T
            ends = nearest**power * (constant - rate / power) / power
            ends = ends + np.cumsum(integrals[:, :, -1], axis=1)
            integrals += (ends - integrals[:, :, -1])[:, :, None]
            moments.append(integrals[:, :, :-1] / x**power)
        return moments[0] - moments[1]


def averaged(
    solid: Cosserat, distance: Array, source: ArrayLike, target: ArrayLike, which: Sequence[int]
) -> Array:
    """Returns kernels averaged over cells of the widths `source` and `target` at a `distance` (lengths,
    arrays that broadcast): array (len(which), ...) of lengths per force.
    """
    material = solid.nu, solid.beta, solid.curvature
    table = kernels(*material)
    antiderivatives = kernels(*material, SecondAntiderivatives)
    distance, source, target = (x / solid.ell for x in np.broadcast_arrays(distance, source, target))
    # beyond 16 widths of the larger cell two Gauss points on either leave 1e-9
    near = np.abs(distance) <= 16 * np.maximum(source, target)
    averages = np.zeros((len(which), *distance.shape))
    for a, b in product((-0.5, 0.5), repeat=2):
        step = a * target - b * source
        place = (distance + step)[near]
        averages[:, near] -= 4 * a * b * place**2 * antiderivatives(place, which) / (source * target)[near]
        averages[:, ~near] += table((distance + step / np.sqrt(3))[~near], which) / 4
    return (1 - solid.nu) / solid.mu * averages
