"""First zones from a complementarity problem on cells of constant pressure."""

import numpy as np

from ..contact_solvers import active_set
from ..errors import NotConverged
from ..model.intervals import runs
from ..model.quadrature import gauss_rule
from .kernels import cell_rule, on_the_line
from .panels import Panel, short_enough
from .second_half_plane import counter_flexibility


def first_zones(problem, load):
    """Yields zones {corner number: ((left, right), ...)} of all corners, finer each time; NotConverged if the
    obstacle asks for too many cells.
    """
    cells, closed, of_all, trials = _first_cells(problem), None, 2000, 0
    most, rounds = of_all / len(problem.law.corners), 10
    if len(cells) > most:
        raise NotConverged(
            f"more than {of_all} cells of varied size would be needed to see all features of the obstacle"
        )
    for number in range(rounds):
        forces, closed = _pressed(problem, load, cells, closed)
        wide = np.diff(cells)[:, 0] > 4 * np.spacing(np.abs(cells).max())
        parts = np.where(_unresolved(closed) & wide, 4, 1)
        if parts.max() == 1 or number == rounds - 1 or parts.sum() > most:
            yield {corner: _zones(problem, cells, *own) for corner, own in enumerate(zip(forces, closed))}
            trials, parts = trials + 1, np.where(_changing(closed) & wide, 4, 1)
            if trials == 4 or parts.sum() > most:
                return
        cells, closed = _divided(cells, parts), np.repeat(closed, parts, axis=1)


def _first_cells(problem):
    ends = np.array([end for corner in range(len(problem.shifts)) for end in problem.ends_of(corner)])
    cells = []
    for left, right in problem.stretches:
        edges = np.union1d(np.linspace(left, right, 49), ends[(left < ends) & (ends < right)]).tolist()
        for start, end in zip(edges, edges[1:]):
            cells += [
                (x, x + width) for x, width, _ in short_enough(problem, Panel(start, end - start, False))
            ]
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
    """Flags (n,) of cells in and beside short zones and holes."""
    few = np.zeros(closed.shape[1], bool)
    for own in closed:
        # what lies beyond the outermost zones is no hole
        for first, last in [*runs(own), *runs(~own & (np.cumsum(own) > 0) & (np.cumsum(own) < own.sum()))]:
            few[max(first - 1, 0) : last + 2] |= last - first < 2
    return few


def _changing(closed):
    steps = np.any(closed[:, 1:] != closed[:, :-1], axis=0)
    return np.append(steps, False) | np.insert(steps, 0, False)


def _zones(problem, cells, pressures, closed):
    """Intervals of closed cells, array (n,), of which those of two stretches are two."""
    x = cells.mean(axis=1)
    stretch = np.searchsorted([left for left, _ in problem.stretches], x)
    zones = []
    for number in np.unique(stretch):
        for first, last in runs(closed & (stretch == number)):
            left = _edge(cells, x, pressures, first, last, 1)
            right = _edge(cells, x, pressures, last, first, -1)
            zones.append((left, right))
    return tuple(zones)


def _edge(cells, x, p, first, last, way):
    border = cells[first, (1 - way) // 2]
    if first == last or p[first] >= p[first + way]:
        return float(border)
    beyond = way * (x[first + way] - x[first]) * p[first] ** 2 / (p[first + way] ** 2 - p[first] ** 2)
    width = cells[first, 1] - cells[first, 0]
    return float(x[first] - way * min(beyond, width))


def _flexibility(problem, x, widths):
    clamped, count = problem.law.clamps_rotation, len(problem.law.corners)
    found = _averages(problem, x, widths, (3,) if clamped else (0, 1, 2)[: 2 * count - 1])
    matrix = found[0]
    if count > 1 and not clamped:
        (U, V, W), levers = found, [problem.lever(np.full(len(x), corner), x) for corner in range(2)]
        matrix = np.block([[U + a[:, None] * b * W + (a[:, None] - b) * V for b in levers] for a in levers])
    if problem.counter is not None:
        matrix = matrix + counter_flexibility(problem, x, widths)
    return (matrix + matrix.T) / 2


def _averages(problem, x, widths, which):
    """Kernels at x_i averaged over cell j: array (len(which), n, n)."""
    apart, own = x[:, None] - x, np.eye(len(x), dtype=bool)
    # two Gauss points are enough farther away than 2.9 lengths, which is no distance of equal cells
    near = np.abs(apart) < 2.9 * np.maximum(widths, widths[:, None])
    points, weights = cell_rule(0, 1, 16)
    both = np.concatenate((0.5 - points, 0.5 + points)), np.tile(weights / 2, 2)
    found = np.empty((len(which), len(x), len(x)))
    for mask, (points, weights) in (~near, gauss_rule(2)), (near & ~own, gauss_rule(10)), (own, both):
        columns = np.nonzero(mask)[1]
        places = apart[mask][:, None] - widths[columns][:, None] * (points - 0.5)
        found[:, mask] = on_the_line(problem.solid, places, which) @ weights
    return found
