"""What a second body carries from corner to corner: singular places of the pressures, a block's side apart.

Corner A presses the second body at x - ell/2, B at x + ell/2. What is singular in p_A at x is so in the gap of
B at x - ell, and p_B follows; what is singular in p_B at x goes to A at x + ell, and the body carries both from
corner to corner at one x. So the singular places of a pressure go on by steps of ell, and get fainter by a
factor below 1/2 each (docs/theory/two_bodies.md).
"""

import numpy as np

from ..model.problem import half_line
from .kernels import counter_short_waves, short_waves

FAINT = 1e-7  # of a singularity: carried ones below it are left to the panels' order
MOST = 12  # steps
SAME = 1e-9  # of ell: places this near to each other are one


def steps(problem):
    """How often a singular place is carried on until it is faint; 0 if the obstacle is rigid, or has one corner
    to a block.
    """
    if problem.counter is None or len(problem.law.corners) == 1:
        return 0
    (displacement, rotation), own = short_waves(problem.solid), counter_short_waves(problem.counter)
    factor = own * max(displacement, rotation) / ((2 * displacement + own) * (2 * rotation + own))
    return int(min(MOST, np.ceil(1 + np.log(FAINT) / np.log(min(factor, 0.5)))))


def carried(problem, places):
    """Singular places and those they are carried to, ascending list; the given ones stay as they are."""
    own = sorted(float(x) for x in places)
    ways = [each for each in range(-steps(problem), steps(problem) + 1) if each]
    further = sorted(x + way * problem.solid.ell for x in own for way in ways)
    found = list(own)
    for x in further:
        if min(abs(each - x) for each in found) > SAME * problem.solid.ell:
            found.append(x)
    return sorted(found)


def log_sizes(problem, zones):
    """{contact point: {corner: K}} of ``p ~ K log(1/|x - place|)`` of the corners in contact there.

    A jump J in the slope of a corner's initial gap needs ``pi J`` from the logarithms through the limits of k
    U and k W for k -> infinity (docs/theory/halfplane.md, "Contact line"). A second body joins those of
    different corners at the same place of its surface.
    """
    whole = (
        {**zones, 1: [(-right, -left) for left, right in zones[0]]}
        if problem.mirror and not half_line(problem)
        else zones
    )
    found = {kink: {} for kink in problem.kinks}
    for kink, jumps in problem.kinks.items():
        chain = [kink + way * problem.solid.ell for way in range(-steps(problem), steps(problem) + 1)]
        for (x, corner), size in _sizes(problem, whole, chain, kink, jumps).items():
            place = min(found, key=lambda each: abs(each - x))
            if abs(place - x) > SAME * problem.solid.ell:
                place = x
                found[x] = {}
            found[place][corner] = found[place].get(corner, 0.0) + size
    return {place: sizes for place, sizes in found.items() if sizes}


def _sizes(problem, zones, chain, kink, jumps):
    """{(place, corner): K} on a chain of places, from the jumps at one of them."""
    inside = [
        (x, corner)
        for x in chain
        for corner, intervals in zones.items()
        if any(left < x < right for left, right in intervals)
    ]
    if not inside:
        return {}
    x, corner = np.array([each[0] for each in inside]), np.array([each[1] for each in inside])
    lever = np.array(problem.lever(corner, x), float)
    pressed = x - np.array([problem.shift(each) for each in corner])
    displacement, rotation = short_waves(problem.solid)
    near = SAME * problem.solid.ell
    matrix = (np.abs(x - x[:, None]) < near) * (displacement + rotation * np.outer(lever, lever))
    matrix += (np.abs(pressed - pressed[:, None]) < near) * counter_short_waves(problem.counter)
    right = np.array([jumps.get(each, 0.0) if place == kink else 0.0 for place, each in inside])
    return dict(zip(inside, np.linalg.solve(matrix, right) / np.pi))
