"""How far two states are apart, by what states of every method return; a state on cells as arrays."""

from types import SimpleNamespace

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


def on_cells(state):
    """What a state on cells has, as arrays (n, n) over its cells, or (2, n, n) of what has two components."""
    flat = {name: getattr(state, name) for name in ("pressure", "displacement", "opposite", "closed")}
    turned = {name: getattr(state, name).T.reshape(2, *state.shape) for name in ("psi", "micromoment")}
    pressures = {name: values.reshape(state.shape) for name, values in state.pressures.items()}
    cells = {name: values if values is None else values.reshape(state.shape) for name, values in flat.items()}
    names = ("x1", "x2", "width", "approach", "load", "problem", "warnings", "seen_width")
    plain = {name: getattr(state, name) for name in names}
    return SimpleNamespace(**plain, **cells, **turned, pressures=pressures, weights=state.width**2)
