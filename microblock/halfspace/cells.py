"""The half-space on n x n equal cells, matrix-free."""

from __future__ import annotations

import numpy as np

from ..corners import on_cells
from ..corners.on_cells import Flexibility
from ..halfplane.kernels import at_rest
from ..model.material import Cosserat
from ..model.types import AnyArray as Array
from .counter import Counter
from .kernels import kernels
from .symbol import symbol


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

    def cells() -> Array:
        found = kernels(solid).cells(tilt.shape[-1], width / solid.ell, clamped)
        found *= (1 - solid.nu) / solid.mu / solid.ell
        if clamped:
            found[1:] *= width**2 / solid.ell * solid.mu / (1 - solid.nu)
        return found

    rest = at_rest(solid) if periodic else None

    def waves(k: Array) -> Array:
        return np.array(symbol(solid, k))

    return on_cells.flexibility(offsets, tilt, clamped, width, rest, waves, cells, counter)
