"""How far two states are apart, by what states of every method return."""

import numpy as np


def apart(state, exact, ends=()):
    """max(|dp|, |dM|/ell)/|p| in L2 over the surface, at the points of the second state (no
    nodes of the first); near places `ends` where the pressure is infinite weighted with the distance.
    """
    changes = [state.pressure_at(exact.x, name) - pressure for name, pressure in exact.pressures.items()]
    # at a distance ell/2 from the centres of blocks, up to their rotation
    moments = (changes[0] - changes[-1]) / 2
    far = [2 * np.abs(exact.x - end) / np.ptp(ends) for end in ends]
    weights = exact.weights * np.min([np.ones_like(exact.x), *far], axis=0)
    size = weights @ exact.pressure**2
    return float(np.sqrt(max(weights @ change**2 for change in (sum(changes), moments)) / size))
