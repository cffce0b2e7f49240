"""The half-plane on n equal cells, matrix-free: corner forces to corner gaps by FFT."""

from functools import partial

import numpy as np

from ..corners import on_cells
from ..corners.rounding import PATHS
from ..errors import BadArgument
from .counter_cells import CounterCells
from .kernels import at_rest, symbol


def flexibility(body, law, grid, counter=None):
    """The `Flexibility` of a law's corners on a Grid, with a second body of the solid `counter`."""
    solid, count, width, shifts = body.solid, grid.count, grid.width, law.shifts(body.solid.ell)
    offsets, periodic = np.array([[-2 * shift] for shift in law.shifts(1.0)]), body.period is not None
    other = counter and CounterCells.on(counter, shifts, width, count, periodic)

    def cells():
        found = body.cells(count, width, (3, 4) if law.clamps_rotation else (0, 1, 2))
        if law.clamps_rotation:  # kernel 4 is -m, over 1/ell instead of c, from a unit force
            found[1] *= -width / solid.ell * solid.mu / (1 - solid.nu)
        return found

    rest, waves = at_rest(solid) if periodic else None, partial(symbol, solid)
    tilts, clamped = tilt(law, offsets, *grid.axes), law.clamps_rotation
    return on_cells.flexibility(offsets, tilts, clamped, width, rest, waves, cells, other)


def tilt(law, offsets, x):
    """t at x, array (1, n), or of one corner (0, n)."""
    if len(offsets) == 1:
        return np.empty((0, len(x)))
    tilts = np.array(list(law.levers(x).values())) + offsets
    if np.ptp(tilts, axis=0).max() > PATHS:
        words = "must have levers that differ as 2 shifts / ell do on Cells(): Panels() take others"
        raise BadArgument("law", law, words)
    return tilts[:1]
