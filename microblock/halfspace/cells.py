"""The half-space on n x n equal cells, matrix-free: its `microblock.corners.on_cells.Flexibility`, by FFT.

In Fourier space (u, phi) = C (p, m), phi and m as in `microblock.halfspace.symbol`, with C = D R D^H, D =
diag(1, -i, -i) and R real and symmetric. Without images R is that of cells in a doubled period.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from scipy.fft import next_fast_len

from ..corners.convolution import Waves, embedded
from ..corners.on_cells import Flexibility
from ..model.material import Cosserat
from ..model.types import AnyArray as Array
from .kernels import kernels
from .symbol import at_rest, symbol

if TYPE_CHECKING:
    from .counter import Counter

Six: TypeAlias = Sequence[Array]  # u, v1, v2 and the components 11, 12, 22 of the tensor


def flexibility(
    solid: Cosserat,
    offsets: Array,
    tilt: Array,
    width: float,
    periodic: bool,
    clamped: bool,
    counter: Counter | None = None,
) -> Flexibility:
    """Returns the Flexibility of corners on as many cells as there are tilts."""
    count = tilt.shape[-1]
    length, near = (count if periodic else next_fast_len(parts * count, real=True) for parts in (2, 1))
    size, back = (length, length), (near, near)
    if periodic:
        whole = _smooth(solid, length, width)
        for part, rest in zip(whole, (0.0, 0.0, 0.0, at_rest(solid), 0.0, at_rest(solid))):
            part[0, 0] = rest / width**2
        whole = _held(whole) if clamped else whole
    else:
        whole = _embedded(solid, count, length, width, clamped)
    shortest = np.array([np.pi / width])  # wave of the cells, shorter or longer than the blocks
    displaced, _, rotated, _ = np.ravel(shortest * symbol(solid, shortest))
    short = np.array((1.0, rotated / displaced, rotated / displaced))
    aside = Waves(size, [[one] for one in whole[1:3]], even=(0, 1)) if len(offsets) == 1 else None
    response = Waves(size, [whole[:1]] if aside else _symmetric(whole))

    @cache
    def inverse() -> Waves:
        if aside:
            smooth = _smooth(solid, near, width)
            smooth = _held(smooth) if clamped else smooth
            own = smooth[0] if counter is None else smooth[0] + counter.smooth(near, width)
            return Waves(back, [[1 / own]])
        rows = _symmetric(_smooth(solid, near, width, True))
        if counter is None:
            return Waves(back, rows)
        return Waves(back, counter.with_inverse(rows, near, width, displaced), even=(2, 2))

    if counter is not None and not aside:
        short = counter.with_short(short, displaced, near, width)
    return Flexibility(offsets, tilt, response, inverse, aside, clamped, counter, short)


def _symmetric(six: Six) -> list[list[Array]]:
    u, v1, v2, w11, w12, w22 = six
    return [[u, v1, v2], [v1, w11, w12], [v2, w12, w22]]


def wavenumbers(length: int, width: float) -> tuple[Array, Array, Array]:
    """Returns k1, array (length, 1), k2, array (1, length//2 + 1), and k of a period; at k = 0 half of the
    smallest stands for the mean.
    """
    step = 2 * np.pi / (length * width)
    k1 = (np.fft.fftfreq(length) * length * step)[:, None]
    k2 = (np.arange(length // 2 + 1) * step)[None, :]
    k = np.hypot(k1, k2)
    k[0, 0] = step / 2
    return k1, k2, k


def _smooth(solid: Cosserat, length: int, width: float, inverse: bool = False) -> list[Array]:
    """Returns R of the symbol, or its inverse, on a period, positive definite."""
    k1, k2, k = wavenumbers(length, width)
    U, V, W, other = np.array(symbol(solid, k)) / width**2
    V[0, 0], W[0, 0] = 0, (W[0, 0] + other[0, 0]) / 2
    other[0, 0] = W[0, 0]
    if inverse:
        U, V, W, other = np.array((W, -V, U, (U * W - V**2) / other)) / (U * W - V**2)
    c, s = k1 / k, k2 / k
    odd1, odd2 = c * np.ones_like(k), s * np.ones_like(k)
    if length % 2 == 0:  # of the shortest wave cells see no odd part
        odd1[length // 2] = 0
        odd2[:, -1] = 0
    apart = W - other
    return [U, V * odd1, V * odd2, other + apart * c**2, apart * odd1 * odd2, other + apart * s**2]


def _embedded(solid: Cosserat, count: int, length: int, width: float, clamped: bool) -> list[Array]:
    """Returns R of cells without images in a period; where psi = 0, those of `_held`."""
    found = []
    for number, quarter in enumerate(kernels(solid).cells(count, width / solid.ell, clamped)):
        moment = clamped and number > 0
        quarter *= (width / solid.ell) ** 2 if moment else (1 - solid.nu) / solid.mu / solid.ell
        found.append(embedded(quarter, length, number in (1, 4), number in (2, 4)))  # along x1, along x2
    return found


def _held(six: Six) -> list[Array]:
    """Returns u, m1 and m2 from p where psi = 0."""
    u, v1, v2, w11, w12, w22 = six
    determinant = w11 * w22 - w12**2
    m1, m2 = (w12 * v2 - w22 * v1) / determinant, (w12 * v1 - w11 * v2) / determinant
    return [u + v1 * m1 + v2 * m2, m1, m2]
