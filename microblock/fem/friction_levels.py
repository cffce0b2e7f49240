"""Histories with friction of blocks to a tolerance: the same history on meshes of half the length each."""

import numpy as np

from ..errors import out_of_reach
from ..model.history import History, change
from ..model.state import State

LEVELS = 4  # meshes, of which the last has squares an eighth as long as the first
ORDERS = 0.5, 1.0  # that a measured order is taken for: edges within elements leave the first one


def history_to(rtol, follow):
    """The History on the first mesh of which the error estimate is rtol at most, from the third on.

    The largest changes between three meshes have an order, from which follows what the last one lacks
    (Richardson). As the changes of one state are uneven, half of that before the last counts as well.

    Parameters
    ----------
    rtol : float
        Relative L2 error of pressure, of micromoment over ell and of shear traction over the friction, all
        over the pressure.
    follow : function of a number, the History on squares 2**number times shorter

    Raises
    ------
    NotConverged
        If the last mesh does not do.
    """
    found, changes, best = [follow(0)], [], np.inf
    for number in range(1, LEVELS):
        found.append(follow(number))
        changes.append(
            [
                change(finer.solution, coarser.solution, finer.weights, finer.solid.ell, finer.law.friction)
                for finer, coarser in zip(found[-1].states, found[-2].states)
            ]
        )
        if len(changes) == 1:
            continue
        errors = _lacking(*np.array(changes[-2:]))
        best = min(best, max(errors))
        if max(errors) <= rtol:
            last = found[-1]
            pairs = zip(last.states, errors)
            states = [State(one.solution, error_estimate=float(error)) for one, error in pairs]
            return History(last.problem, states, last.events)
    raise out_of_reach(rtol, best, besides="take shorter squares, Uniform(h=...)")


def _lacking(before, last):
    """What the last mesh lacks, array, from changes of all states between three meshes, arrays."""
    order = np.clip(np.log2(before.max() / last.max()), *ORDERS)
    return np.maximum(last, before / 2) / (2**order - 1)
