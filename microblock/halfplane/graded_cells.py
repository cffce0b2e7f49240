"""Trial zones from cells of constant pressure on all of the surface that could touch: small where the
obstacle changes quickly, and smaller round by round where the contact begins or ends. One complementarity
problem a round, so that no contact is left out.
"""

import numpy as np

from ..corners import active_set
from ..errors import NotConverged
from ..model.problem import half_line
from ..model.quadrature import gauss_rule
from ..model.zones import runs
from .counter import counter_flexibility
from .kernels import cell_rule, kernels

PER_STRETCH, PER_CONTACT = 24, 10  # cells of a low stretch, and of the half-width of a contact, at least
SMALLEST = 2e-4  # cell, over the half-width
GRADING = 0.5  # length that a cell may have for each length away from a feature
PARTS = 4  # of a cell beside an edge, from round to round
ROUNDS = 6
MOST = 2000  # cells, of all corners together
FAR = 3.0  # lengths of a cell, beyond which two Gauss points are enough on it


def trial_zones(problem, load):
    """Zones {corner number: ((left, right), ...)} of all corners, round by round.

    Raises
    ------
    NotConverged
        If the cells are used up before the obstacle's features are resolved.
    """
    edges = _first_cells(problem)
    closed = None
    for _ in range(ROUNDS):
        x, widths = (edges[1:] + edges[:-1]) / 2, np.diff(edges)
        # what lies between two low stretches is no cell
        owned = ~np.isin(edges[:-1], [right for _, right in problem.stretches[:-1]])
        x, widths, lower = x[owned], widths[owned], edges[:-1][owned]
        closed = _closed(problem, load, x, widths, closed)
        upper = lower + widths
        zones = {
            corner: tuple((float(lower[i]), float(upper[j])) for i, j in runs(own))
            for corner, own in enumerate(closed)
        }
        yield zones, float(widths[_changing(closed)].max(initial=widths.min()))
        split = _changing(closed) & (widths > SMALLEST * problem.picture.half_width)
        if not split.any() or len(x) + (PARTS - 1) * np.count_nonzero(split) > MOST / len(
            problem.law.corners
        ):
            return
        finer = lower[split, None] + widths[split, None] * np.arange(1, PARTS) / PARTS
        parts = np.where(split, PARTS, 1)
        closed = np.repeat(closed, parts, axis=1)
        edges = np.union1d(edges, finer.ravel())


def _first_cells(problem):
    """Edges of the first cells."""
    edges, half = [], problem.picture.half_width
    for left, right in problem.stretches:
        largest, x = min((right - left) / PER_STRETCH, half / PER_CONTACT), left
        own = [left]
        while right - x > 1e-9 * (right - left):
            step = largest
            for _ in range(2):  # once more with what the interval itself asks for
                step = min(largest, max(problem.scale(x, x + step, GRADING) / 2, SMALLEST * half))
            x = min(x + step, right)
            own.append(x)
            if len(own) + len(edges) > MOST / len(problem.law.corners):
                raise NotConverged(
                    f"more than {MOST} cells of varied size would be needed to see all features of the "
                    "obstacle"
                )
        edges += own
    return np.unique(edges)


def _closed(problem, load, x, widths, start):
    """Whether the corners of each cell are closed: array (corners, n)."""
    count = len(problem.law.corners)
    matrix = _flexibility(problem, x, widths)
    numbers = np.repeat(np.arange(count), len(x))
    gaps = problem.initial_gap(numbers, np.tile(x, count))
    found = active_set.solve(matrix, gaps, load=load, start=None if start is None else start.ravel())
    return found.closed.reshape(count, -1)


def _flexibility(problem, x, widths):
    """Gaps of all corners at the centres from forces on the cells, made symmetric: array (corners n, corners
    n).
    """
    matrix = _of_body(problem, x, widths)
    if problem.counter is not None:
        matrix = matrix + counter_flexibility(problem, x, widths)
    return (matrix + matrix.T) / 2


def _of_body(problem, x, widths):
    """The same of the body alone, not symmetric."""
    U, V, W, clamped = _averages(problem, x, widths)
    if problem.law.clamps_rotation:
        return clamped
    if len(problem.law.corners) == 1:
        return U
    levers = [problem.lever(np.full(len(x), corner), x) for corner in range(2)]
    return np.block([[U + a[:, None] * b * W + (a[:, None] - b) * V for b in levers] for a in levers])


def _averages(problem, x, widths):
    """U, V, W and the clamped kernel (length per force), at x_i averaged over the cell j: arrays (n, n)."""
    solid = problem.solid
    table, c = kernels(solid.nu, solid.beta, solid.curvature), (1 - solid.nu) / solid.mu
    apart = x[:, None] - x
    which = (3,) if problem.law.clamps_rotation else (0,) if len(problem.law.corners) == 1 else (0, 1, 2)
    found = np.zeros((4, len(x), len(x)))

    def over(rows, columns, points, weights):
        places = apart[rows, columns][:, None] - widths[columns][:, None] * points
        return c * table(places / solid.ell, which) @ weights

    near = np.abs(apart) < FAR * np.maximum(widths, widths[:, None])
    for mask, order in ((~near, 2), (near & ~np.eye(len(x), dtype=bool), 10)):
        rows, columns = np.nonzero(mask)
        points, gauss = gauss_rule(order)
        found[np.array(which)[:, None], rows, columns] = over(rows, columns, points - 0.5, gauss)
    points, weights = cell_rule(0, 1, 16)
    own = c * table(points * widths[:, None] / solid.ell, which) @ weights
    diagonal = np.arange(len(x))
    for number, values in zip(which, own):
        found[number, diagonal, diagonal] = 0.0 if number == 1 else values
    return found


def _changing(closed):
    """Cells beside which a corner's contact begins or ends, boolean array (n,)."""
    found = np.zeros(closed.shape[1], bool)
    steps = np.any(closed[:, 1:] != closed[:, :-1], axis=0)
    found[1:] |= steps
    found[:-1] |= steps
    return found


def of_corners(problem, zones):
    """Of zones of all corners those that are computed."""
    if half_line(problem):
        outer = max(abs(edge) for pair in zones[0] for edge in pair)
        return {0: ((-outer, outer),)}
    return {corner: zones[corner] for corner in problem.corners}
