"""Forces of the corners of blocks on a surface: four corners exert three resultants."""

from __future__ import annotations

import numpy as np

from ..model.types import Array, Flags, Integers
from .fft_compliance import TWIST_MODE, of_least_norm, twisted


def least_norm_where_closed(forces: Array, closed: Flags) -> Array:
    """Returns the forces of least norm with the same resultants, none negative, arrays (corners, ...), of
    blocks whose corners are all closed: no other has a choice.
    """
    if len(forces) != len(TWIST_MODE):
        return forces
    return np.asarray(twisted(forces, of_least_norm(forces), np.all(closed, axis=0)))


def closed_corners(forces: Array, closed: Flags) -> Integers:
    """Returns how many corners of each block touch: those with a force, or all where no gap is open."""
    touching = (forces > 0) | (closed.all(axis=0) & (len(forces) > 1))
    return np.asarray(touching.sum(axis=0))
