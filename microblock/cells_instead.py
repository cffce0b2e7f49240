"""Uniform cells where panels find no zones, or do not reach what was asked for: the larger model where the smaller one fails."""

from dataclasses import replace

import numpy as np

from .errors import MicroblockError, NotConverged
from .grid_contact import FIRST, GridContact

MOST = 2**17         # cells: some ten seconds with two corners
AROUND = 0.05        # of the low stretches, left free on either side
FEATURE = 12         # cells on the shortest piece on which the height is a polynomial, at least: a feature shows on some of them
OFFERED = 1e-3       # rtol at which cells are tried before they are advised


def by_cells(scene, found, load, rtol, failure):
    """The GridState of a half-plane's problem under an obstacle of this Picture; `failure` says why panels have none.

    Raises
    ------
    NotConverged
        If cells do not reach rtol either: with what they do reach.
    """
    if failure.reached is not None and failure.reached < OFFERED:      # better than what cells would be tried for
        raise failure
    ell = scene.solid.ell
    left, right = found.stretches[0][0] - ell, found.stretches[-1][1] + ell
    margin = AROUND*(right - left)
    window = left - margin, right + margin
    least = FEATURE*(window[1] - window[0])/min(found.lengths.min(initial=np.inf), window[1] - window[0])
    sizes = [size for size in FIRST*2**np.arange(12) if size <= MOST]
    cells = GridContact(scene.body, scene.obstacle, scene.law, window)
    asked = max(rtol, OFFERED)
    if least > MOST:
        raise NotConverged(f"{failure}; more than {MOST} cells would be needed to see all features of the obstacle") from failure
    try:
        state = cells.upto(load, rtol if rtol >= OFFERED/10 else asked, sizes, max(4*FIRST, least))
    except MicroblockError as other:
        raise NotConverged(f"{failure}; uniform cells: {other}", reached=failure.reached) from failure
    if state.error_estimate <= rtol:
        return replace(state, instead=f"uniform cells instead of panels ({failure})")
    best = min(state.error_estimate, failure.reached or np.inf)
    raise NotConverged(f"{failure}; uniform cells have an error estimate of {state.error_estimate:.1e}: "
                       f"ask for {_above(best):.0e}", reached=best) from failure


def _above(estimate):
    """A power of ten above an estimate."""
    return 10.0**np.ceil(np.log10(estimate))
