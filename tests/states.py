"""How far two states are apart, by what states of every method return."""

import numpy as np


def apart(state, exact):
    """max(|dp|, |dM|/ell)/|p| in L2 over the surface, at the points of the second state."""
    changes = [state.pressure_at(exact.x, name) - pressure for name, pressure in exact.pressures.items()]
    # at a distance ell/2 from the centres of blocks, up to their rotation
    moments = (changes[0] - changes[-1]) / 2
    size = exact.weights @ exact.pressure**2
    return float(np.sqrt(max(exact.weights @ change**2 for change in (sum(changes), moments)) / size))
