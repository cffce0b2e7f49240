"""Uniform cells where panels fail."""

from dataclasses import replace

import numpy as np

from ..errors import MicroblockError, NotConverged, out_of_reach
from ..model.history import History
from ..model.methods import Cells
from ..model.state import State
from .cell_solver import LineSolver, around

OFFERED = 1e-3  # rtol at which cells are tried before they are advised


def by_cells(solver, found, load, rtol, failure):
    """The LineCells under a Picture after a failure of panels; NotConverged if cells miss rtol, too, with the
    rtol that cells reach.
    """
    window = around(found, solver.solid.ell)
    # a feature shows on some of 12 cells on the shortest polynomial; 2^17 cells take some ten seconds
    cells = LineSolver(solver.contact, Cells())
    cells.most, least = 2**17, 12 * window.side / min(found.lengths.min(initial=np.inf), window.side)
    if least > cells.most:
        words = f"{failure}; more than {cells.most} cells would be needed to see all features of the obstacle"
        raise NotConverged(words, reached=load) from None
    try:
        goal = rtol if rtol >= OFFERED / 10 else OFFERED
        cells.coarsest *= 2 ** max(0, int(np.ceil(np.log2(least / cells.coarsest))) - 2)
        state, _ = cells.within(window, load, None, goal, cells.missed)
        if state.error_estimate > rtol:
            raise out_of_reach(rtol, state.error_estimate, load=load)
    except MicroblockError as other:
        met = getattr(other, "rtol_reached", None)
        raise NotConverged(f"{failure}; uniform cells: {other}", reached=load, rtol_reached=met) from None
    return replace(state, notes=(f"uniform cells instead of panels ({failure})",))


def cells_follow(solver, pairs, coupled, rtol, progress, failure):
    """The History on cells after a failure of panels; raises NotConverged as `by_cells`."""
    try:
        found = LineSolver(solver.contact, Cells()).history(pairs, coupled, rtol, progress)
    except NotConverged as other:
        raise NotConverged(f"{failure}; cells: {other}", rtol_reached=other.rtol_reached) from None
    notes = (f"cells instead of panels ({failure})",)
    states = [State(replace(one.solution, notes=notes), zone_errors=one.zone_errors) for one in found.states]
    return History(found.problem, states, found.events)
