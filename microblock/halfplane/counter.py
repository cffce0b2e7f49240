"""The second body of a contact line: its normal displacement from the pressures where the corners stand."""

from dataclasses import replace

import numpy as np

from ..errors import BadArgument
from ..model.deformable import body_of
from .averages import normal_averages
from .kernels import normal_kernel
from .panels import log_response, response


def counter_kernel(problem, distance, target, source):
    """Displacement of the second body under a unit force (length/force); levers play no part."""
    return normal_kernel(problem.counter, distance)


def counter_response(problem, panels, places):
    """Displacement of the second body along x2 at places of its surface, from q: array (n, m)."""
    both = panels.with_mirror() if problem.mirror else panels
    matrix = np.zeros((len(places), len(both.e) * both.order))
    for own, where in _by_corner(problem, both, places):
        matrix[:, np.repeat(own, both.order)] = response(*where)
    return matrix[:, : matrix.shape[1] // 2] + matrix[:, matrix.shape[1] // 2 :] if problem.mirror else matrix


def counter_log_response(problem, panels, places):
    both = panels.with_mirror() if problem.mirror else panels
    return sum(log_response(*where) for _, where in _by_corner(problem, both, places))


def _by_corner(problem, panels, places):
    shifts = problem.shifts
    whole = replace(problem, mirror=False)
    for corner, shift in enumerate(shifts):
        own = panels.corner == corner if len(shifts) > 1 else np.ones(len(panels.e), bool)
        if own.any():
            yield own, (whole, panels.of(own), places + shift, np.zeros(len(places)), counter_kernel)


def require_same_period(body, obstacle):
    """Raises BadArgument for a second body of another period than the first."""
    counter = body_of(obstacle)
    if counter is not None and counter.period != body.period:
        raise BadArgument(
            "period", counter.period, f"of the second body must be that of the first, {body.period}"
        )


def counter_flexibility(problem, x, widths):
    """What cells of constant pressure add to the gaps of all corners at the centres by way of the second
    body: array (corners n, corners n).
    """
    places = np.concatenate([x - shift for shift in problem.shifts])
    widths = np.tile(np.broadcast_to(widths, x.shape), len(problem.shifts))
    return normal_averages(problem.counter, places[:, None] - places, widths, widths[:, None])
