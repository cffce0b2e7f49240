"""Uncertainty of the pressure from the samples of an obstacle."""

from copy import copy
from dataclasses import replace
from typing import Any

import numpy as np

from ..model.deformable import shape_of
from ..model.obstacles import Samples
from .window import Window

EXHAUSTED = 0.5  # of a pressure, above which cells go on no more: 10 000 samples with noise would take 26 s
COMPARED_CELLS = 2048  # for pressures: of 10 000 samples these see that they leave all uncertain


def sampling_uncertainty(solver: Any, state: Any) -> float:
    """Returns the largest change of the pressure, relative in L2, under an obstacle that the samples cannot
    tell from their own, on cells of a `LineSolver` about the contact of a solution; 0 of other obstacles.
    """
    samples: Any = shape_of(solver.obstacle)
    cached: dict[float, float] = solver.sampling_uncertainty
    if not isinstance(samples, Samples) or state.load in cached:
        return cached.get(state.load, 0.0)
    left, right = np.reshape(state.zones_by_name["contact"], -1)[[0, -1]]
    side = 1.1 * (right - left) + 2 * solver.solid.ell
    window = solver.given_window() or Window(1, side, ((left + right) / 2,))
    arguments = window.with_count(COMPARED_CELLS), state.load, None, solver.loose / COMPARED_CELLS
    reference = solver.solved(*arguments)
    changes = []
    for alike in samples.alike():
        variant = copy(solver)
        variant.obstacle = alike if samples is solver.obstacle else replace(solver.obstacle, shape=alike)
        changes.append(solver.change(variant.solved(*arguments, reference), reference))
    cached[state.load] = max(changes)
    return cached[state.load]


def with_sampling_note(solver: Any, state: Any, rtol: Any) -> Any:
    """Returns a solution with a note if its samples leave the pressure far more uncertain than rtol."""
    samples: Any = shape_of(solver.obstacle)
    uncertainty = sampling_uncertainty(solver, state)
    stopped = rtol < state.error_estimate and (uncertainty > EXHAUSTED or state.error_estimate <= uncertainty)
    if uncertainty < 10 * rtol and not stopped:
        return state
    noise = " or moved up and down by the noise" * bool(samples.noise)
    words = (
        f"the samples leave the pressure uncertain by {uncertainty:.1g}: with every second one left "
        f"out{noise} it differs by that in L2"
    )
    if stopped:
        words += f", so that {state.method} stop at an error of {state.error_estimate:.1g}"
        words += ", and zones and pressures are those of noise" * (uncertainty > EXHAUSTED)
    else:
        words += f"; rtol = {rtol:g} is far below and holds for the straight lines between them"
    return state.changed(notes=(*state.notes, words))
