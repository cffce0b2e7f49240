"""What the samples of an obstacle leave open of the pressure."""

from copy import copy
from dataclasses import replace

import numpy as np

from ..contact_solvers.fft_compliance import Grid
from ..model.deformable import shape_of
from ..model.obstacles import Samples

MOST = 0.5  # that is left open of a pressure for which cells go on: 10 000 samples with noise would take 26 s
CELLS = 2048  # on which pressures are compared: of 10 000 samples these see that they leave all open


def sampling_uncertainty(solver, state):
    """Largest change of the pressure, relative in L2, under an obstacle that the samples cannot tell from
    their own, on cells of a `LineSolver` about the contact of a solution; 0 of other obstacles.
    """
    samples, known = shape_of(solver.obstacle), solver.sampling_uncertainty
    if not isinstance(samples, Samples) or state.load in known:
        return known.get(state.load, 0.0)
    left, right = np.reshape(state.zones_by_name["contact"], -1)[[0, -1]]
    side = 1.1 * (right - left) + 2 * solver.solid.ell
    window = solver.given_window() or Grid(1, side, ((left + right) / 2,))
    asked = window.of(CELLS), state.load, None, solver.loose / CELLS
    here, changes = solver.solved(*asked), []
    for alike in samples.alike():
        other = copy(solver)
        other.obstacle = alike if samples is solver.obstacle else replace(solver.obstacle, shape=alike)
        changes.append(solver.change(other.solved(*asked, here), here))
    known[state.load] = max(changes)
    return known[state.load]


def with_sampling_note(solver, state, rtol):
    """A solution with a note if its samples leave far more open than rtol."""
    share = sampling_uncertainty(solver, state)
    stopped = rtol < state.error_estimate and (share > MOST or state.error_estimate <= share)
    if share < 10 * rtol and not stopped:
        return state
    noise = " or moved up and down by the noise" * bool(shape_of(solver.obstacle).noise)
    words = (
        f"the samples leave {share:.1g} of the pressure open: with every second one left out{noise} it "
        "differs by that in L2"
    )
    if stopped:
        words += f", so that {state.method} stop at an error of {state.error_estimate:.1g}"
        words += ", and zones and pressures are those of noise" * (share > MOST)
    else:
        words += f"; rtol = {rtol:g} is far below and holds for the straight lines between them"
    return replace(state, notes=(*state.notes, words))
