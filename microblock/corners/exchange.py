"""Contact states of few corners: all corners that are wrong change sides at once, until none is.

Conditions (a) of `microblock.corners.active_set` with c = 1. With the corners of a face closed their forces
follow from one factorisation; those that pull open, open ones that are pressed in close. From the face of a
coarser grid one to four faces do, from all corners up to twelve; of 900 seeded grids 6 did not settle.
Nothing is proven of it (M. Hintermueller, K. Ito, K. Kunisch, SIAM J. Optim. 13 (2002) 865, have conditions):
whoever asks keeps another method for faces that do not settle, and looks at what is left of (a). At a given
load the rigid level, which no state of it feels, is added to H, so that the factorisation is Cholesky's also
where H is definite on zero-sum forces alone.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg.lapack import dposv

from ..model.types import AnyArray, Array

FACES = 20  # that are tried; problems that need more are rare, and go on by another method
FLAT = 1e-6  # of the largest response of a corner to itself: pivots below are rounding
ROUNDING = 1e-14  # of the largest force, and of the range of the displacement: below it a sign means nothing


def exchange(H: Array, g0: Array, face: AnyArray, load: float | None) -> tuple[Array, int] | None:
    """Returns forces, array (m,), and the number of faces, or None if they do not settle.

    Parameters
    ----------
    H : array (m, m)
        Symmetric, length per force.
    g0 : array (m,)
        Initial gaps, finite; less the approach if that is given.
    face : boolean array (m,)
        Closed corners to begin with; those that are pressed in without forces if there are none.
    load : float or None
        None where the approach is given.
    """
    largest = float(H.diagonal().max())
    level = 0.0 if load is None else largest - min(float(H.min()), 0.0)
    lifted = H + level
    face = face if face.any() else np.less(g0, 0)
    for number in range(1, FACES + 1):
        closed = np.flatnonzero(face)
        own = g0[closed]
        sides = np.column_stack((own, np.ones(len(own))))
        factor, found, failed = dposv(lifted[closed[:, None], closed].T, sides, overwrite_a=1)
        if failed or factor.diagonal().min() ** 2 < FLAT * largest:
            return None
        pulled, pressed = found.T
        d = 0.0 if load is None else (load + pulled.sum()) / pressed.sum()
        forces = np.zeros(len(g0))
        forces[closed] = d * pressed - pulled
        displacement = H @ forces
        gaps = g0 + displacement - (d if load is None else d - level * load)
        least = -ROUNDING * (forces.max() - forces.min()), -ROUNDING * np.ptp(displacement)
        wrong = np.where(face, forces < least[0], gaps < least[1])
        if not wrong.any():
            return np.maximum(forces, 0.0), number
        face = face ^ wrong
        if not face.any():
            return None
    return None
