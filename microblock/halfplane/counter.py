"""Normal displacement of the second body of a contact line from pressures under the corners."""

from dataclasses import replace

import numpy as np

from .averages import normal_averages
from .kernels import normal_kernel
from .panels import response


def counter_kernel(problem, distance, target, source):
    """Displacement of the second body under a unit force (length/force)."""
    return normal_kernel(problem.counter, distance)


def counter_response(problem, panels, places):
    """Displacement of the second body along x2 from q and the known logarithms: arrays (n, m), (n,)."""
    both = panels.whole(problem)
    matrix, known = np.zeros((len(places), len(both.e) * both.order)), 0.0
    whole, none = replace(problem, mirror=False), np.zeros(len(places))
    for corner, shift in enumerate(problem.shifts):
        own = both.corner == corner
        if own.any():
            part, more = response(whole, both.of(own), places + shift, none, counter_kernel)
            matrix[:, np.repeat(own, both.order)] = part
            known = known + more
    half = matrix.shape[1] // 2
    return (matrix[:, :half] + matrix[:, half:] if problem.mirror else matrix), known


def counter_flexibility(problem, x, widths):
    """Gaps of all corners from pressures of cells by way of the second body: array (corners n, corners n)."""
    places = np.concatenate([x - shift for shift in problem.shifts])
    widths = np.tile(np.broadcast_to(widths, x.shape), len(problem.shifts))
    return normal_averages(problem.counter, places[:, None] - places, widths, widths[:, None])
