"""Normal displacement of the second body of a contact line from pressures under the corners
(docs/theory/two_bodies.md).
"""

import numpy as np

from ..model.problem import Problem
from ..model.types import Array
from .averages import averaged
from .kernels import on_the_line


def second_body_kernel(problem: Problem, distance: Array, target: Array, source: Array) -> Array:
    """Returns the displacement of the second body under a unit force, at distances (length/force)."""
    assert problem.counter is not None
    return on_the_line(problem.counter, distance, (0,))[0]


def second_body_flexibility(problem: Problem, x: Array, widths: Array) -> Array:
    """Returns gaps of all corners from pressures of cells about x, array (n,), by way of the second body:
    array (corners n, corners n).
    """
    below = np.concatenate([x - shift for shift in problem.shifts])
    widths = np.tile(np.broadcast_to(widths, x.shape), len(problem.shifts))
    assert problem.counter is not None
    return averaged(problem.counter, below[:, None] - below, widths, widths[:, None], (0,))[0]
