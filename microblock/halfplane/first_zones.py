"""First zones from cells of constant pressure on all that could touch: a complementarity problem."""

import numpy as np

from ..corners import active_set
from ..errors import NotConverged
from ..model.quadrature import gauss_rule
from ..model.zones import runs
from .counter import counter_flexibility
from .kernels import cell_rule, kernels
from .panels import short_enough

ROUNDS, TRIALS = 10, 4  # of division, and of zones
MOST = 2000  # cells, of all corners together


def first_zones(problem, load):
    """Yields zones {corner number: ((left, right), ...)} of all corners and the longest cell at an edge,
    finer each time.

    Raises
    ------
    NotConverged
        If the cells are used up before the obstacle's features are resolved.
    """
    cells, closed = _first_cells(problem), None
    most = MOST / len(problem.law.corners)
    if len(cells) > most:
        raise NotConverged(
            f"more than {MOST} cells of varied size would be needed to see all features of the obstacle"
        )
    trials = 0
    for number in range(ROUNDS):
        forces, closed = _pressed(problem, load, cells, closed)
        split, changing = _unresolved(closed), _changing(closed)
        if not split.any() or number == ROUNDS - 1 or _many(cells, split) > most:
            zones = {corner: _zones(cells, *own) for corner, own in enumerate(zip(forces, closed))}
            yield zones, float((cells[:, 1] - cells[:, 0])[changing].max(initial=0.0))
            trials, split = trials + 1, changing
            if trials == TRIALS or _many(cells, split) > most:
                return
        parts = np.where(split, 4, 1)
        cells, closed = _divided(cells, parts), np.repeat(closed, parts, axis=1)


def _many(cells, split):
    return len(cells) + 3 * np.count_nonzero(split)


def _first_cells(problem):
    ends = np.array([end for corner in range(len(problem.shifts)) for end in problem.ends_of(corner)])
    cells = []
    for left, right in problem.stretches:
        edges = np.union1d(np.linspace(left, right, 49), ends[(left < ends) & (ends < right)]).tolist()
        for start, end in zip(edges, edges[1:]):
            cells += [(x, x + width) for x, width, _ in short_enough(problem, start, end - start, False)]
    return np.array(cells)


def _divided(cells, parts):
    number = np.arange(parts.sum()) - np.repeat(np.cumsum(parts) - parts, parts)
    left, width = np.repeat(cells[:, 0], parts), np.repeat((cells[:, 1] - cells[:, 0]) / parts, parts)
    return np.column_stack((left + number * width, left + (number + 1) * width))


def _pressed(problem, load, cells, start):
    count, x, widths = len(problem.law.corners), cells.mean(axis=1), cells[:, 1] - cells[:, 0]
    numbers = np.repeat(np.arange(count), len(x))
    gaps = problem.initial_gap(numbers, np.tile(x, count))
    if start is None:  # where a classical contact would be, over a parabola
        start = gaps <= gaps.min() + 2 * load / (np.pi * problem.E_star)
    found = active_set.solve(_flexibility(problem, x, widths), gaps, load=load, start=start.ravel())
    return found.forces.reshape(count, -1) / widths, found.closed.reshape(count, -1)


def _unresolved(closed):
    """Cells of zones and holes that have few of them, and their neighbours: flags (n,)."""
    few = np.zeros(closed.shape[1], bool)
    for own in closed:
        # what lies beyond the outermost zones is no hole
        for first, last in [*runs(own), *runs(~own & (np.cumsum(own) > 0) & (np.cumsum(own) < own.sum()))]:
            few[max(first - 1, 0) : last + 2] |= last - first < 2
    return few


def _changing(closed):
    steps = np.any(closed[:, 1:] != closed[:, :-1], axis=0)
    return np.append(steps, False) | np.insert(steps, 0, False)


def _zones(cells, pressures, closed):
    x, found = cells.mean(axis=1), []
    for first, last in runs(closed):
        found.append(
            (_edge(cells, x, pressures, first, last, 1), _edge(cells, x, pressures, last, first, -1))
        )
    return tuple(found)


def _edge(cells, x, p, first, last, way):
    border = cells[first, (1 - way) // 2]
    if first == last or p[first] >= p[first + way]:
        return float(border)
    beyond = way * (x[first + way] - x[first]) * p[first] ** 2 / (p[first + way] ** 2 - p[first] ** 2)
    width = cells[first, 1] - cells[first, 0]
    return float(x[first] - way * min(beyond, width))


def _flexibility(problem, x, widths):
    matrix = _of_body(problem, x, widths)
    if problem.counter is not None:
        matrix = matrix + counter_flexibility(problem, x, widths)
    return (matrix + matrix.T) / 2


def _of_body(problem, x, widths):
    U, V, W, clamped = _averages(problem, x, widths)
    if problem.law.clamps_rotation:
        return clamped
    if len(problem.law.corners) == 1:
        return U
    levers = [problem.lever(np.full(len(x), corner), x) for corner in range(2)]
    return np.block([[U + a[:, None] * b * W + (a[:, None] - b) * V for b in levers] for a in levers])


def _averages(problem, x, widths):
    """U, V, W and the clamped kernel at x_i, averaged over the cell j: arrays (n, n)."""
    solid = problem.solid
    table, c = kernels(solid.nu, solid.beta, solid.curvature), (1 - solid.nu) / solid.mu
    apart = x[:, None] - x
    which = (3,) if problem.law.clamps_rotation else (0,) if len(problem.law.corners) == 1 else (0, 1, 2)
    found = np.zeros((4, len(x), len(x)))

    def over(rows, columns, points, weights):
        places = apart[rows, columns][:, None] - widths[columns][:, None] * points
        return c * table(places / solid.ell, which) @ weights

    # two Gauss points are enough farther away than 2.9 lengths, which is no distance of equal cells
    near = np.abs(apart) < 2.9 * np.maximum(widths, widths[:, None])
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
