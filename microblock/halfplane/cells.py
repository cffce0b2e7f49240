"""The half-plane on n equal cells, matrix-free: corner forces to corner gaps by FFT."""

from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from ..corners.on_cells import flexibility
from ..corners.rounding import PATHS
from ..errors import BadArgument
from .counter_cells import CounterCells
from .kernels import HalfPlane, at_rest, symbol


@dataclass(frozen=True)
class CellGrid:
    """n equal cells on [left, right] of the surface, or on one of its periods."""

    body: HalfPlane
    left: float
    right: float
    count: int

    @property
    def width(self):
        return (self.right - self.left) / self.count

    @cached_property
    def x(self):
        return self.left + self.width * (np.arange(self.count) + 0.5)

    @property
    def periodic(self):
        return self.body.period is not None

    def flexibility(self, law, counter=None):
        """The `Flexibility` of a law's corners, with a second body of the solid `counter`."""
        offsets = np.array([[-2 * shift] for shift in law.shifts(1.0)])
        clamping = law.clamps_rotation
        tilt = np.empty((0, self.count)) if len(offsets) == 1 else _tilt(law, offsets, self.x)[None]
        solid, shifts = self.body.solid, law.shifts(self.body.solid.ell)
        other = counter and CounterCells.on(counter, shifts, self.width, self.count, self.periodic)

        def cells():
            found = self.body.cells(self.count, self.width, (3, 4) if clamping else (0, 1, 2))
            if clamping:  # kernel 4 is -m, over 1/ell instead of c, from a unit force
                found[1] *= -self.width / solid.ell * solid.mu / (1 - solid.nu)
            return found

        rest, waves = at_rest(solid) if self.periodic else None, partial(symbol, solid)
        return flexibility(offsets, tilt, clamping, self.width, rest, waves, cells, other)


def _tilt(law, offsets, x):
    """t at x, array (n,)."""
    tilts = np.array(list(law.levers(x).values())) + offsets
    if np.ptp(tilts, axis=0).max() > PATHS:
        words = "must have levers that differ as 2 shifts / ell do on Cells(): Panels() take others"
        raise BadArgument("law", law, words)
    return tilts[0]
