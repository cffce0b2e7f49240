"""First zones from a complementarity problem on cells of constant pressure."""

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from ..contact_solvers import active_set
from ..errors import BadArgument, NotConverged
from ..model.intervals import distance_to_root, runs
from ..model.problem import Problem
from ..model.quadrature import gauss_rule
from ..model.scales import classical_rise
from ..model.types import Array, CornerZones, Flags, Integers, Interval
from .kernels import cell_rule, on_the_line
from .panels import Panel, short_enough
from .second_body_kernel import second_body_flexibility


def first_zones(problem: Problem, load: float) -> Iterator[CornerZones]:
    """Yields zones {corner number: ((left, right), ...)} of all corners, finer each time; raises NotConverged
    if the obstacle asks for too many cells.
    """
    cells = _first_cells(problem)
    of_all = 2000
    most = of_all / len(problem.law.corners)
    rounds = 10
    if len(cells) > most:
        raise NotConverged(
            f"more than {of_all} cells of varied size would be needed to see all features of the obstacle"
        )
    closed: Flags | None = None
    trials = 0
    for number in range(rounds):
        forces, closed = _pressed(problem, load, cells, closed)
        wide = np.diff(cells)[:, 0] > 4 * np.spacing(np.abs(cells).max())
        parts = np.where(_unresolved(closed) & wide, 4, 1)
        if parts.max() == 1 or number == rounds - 1 or parts.sum() > most:
            yield dict(enumerate(_zones(problem, cells, *columns) for columns in zip(forces, closed)))
            trials += 1
            parts = np.where(_changing(closed) & wide, 4, 1)
            if trials == 4 or parts.sum() > most:
                return
        cells = _divided(cells, parts)
        closed = np.repeat(closed, parts, axis=1)


def _first_cells(problem: Problem) -> Array:
    """Returns left and right ends of equal cells, shorter than features of the obstacle, array (n, 2)."""
    ends = np.array([end for corner in range(len(problem.shifts)) for end in problem.ends_of(corner)])
    cells = []
    for left, right in problem.stretches:
        edges = np.union1d(np.linspace(left, right, 49), ends[(left < ends) & (ends < right)]).tolist()
        for start, end in pairwise(edges):
            parts = short_enough(problem, Panel(start, end - start, False))
            cells += [(x, x + width) for x, width, _ in parts]
    return np.array(cells)


def _divided(cells: Array, parts: Integers) -> Array:
    """Returns cells, array (n, 2), divided into so many equal parts each, array (n,)."""
    number = np.arange(parts.sum()) - np.repeat(np.cumsum(parts) - parts, parts)
    left = np.repeat(cells[:, 0], parts)
    width = np.repeat((cells[:, 1] - cells[:, 0]) / parts, parts)
    return np.column_stack((left + number * width, left + (number + 1) * width))


def _pressed(problem: Problem, load: float, cells: Array, start: Flags | None) -> tuple[Array, Flags]:
    """Returns pressures of cells (n, 2) and which are closed, arrays (corners, n), from a first guess."""
    count = len(problem.law.corners)
    x = cells.mean(axis=1)
    widths = cells[:, 1] - cells[:, 0]
    gaps = problem.initial_gap(np.repeat(np.arange(count), len(x)), np.tile(x, count))
    if start is None:  # where a classical contact would be, over a parabola
        start = gaps <= gaps.min() + classical_rise(load, problem.E_star)
    try:
        solution = active_set.solve(_flexibility(problem, x, widths), gaps, load=load, start=start.ravel())
    except BadArgument as failure:
        if failure.name != "matrix":
            raise
        words = "the contact is too narrow beside the obstacle for rounding"
        raise NotConverged(words) from failure
    return solution.forces.reshape(count, -1) / widths, solution.closed.reshape(count, -1)


def _unresolved(closed: Flags) -> Flags:
    """Returns which cells lie in and beside short zones and holes, array (n,)."""
    few = np.zeros(closed.shape[1], bool)
    for flags in closed:
        before = np.cumsum(flags)
        holes = ~flags & (before > 0) & (before < flags.sum())  # not beyond the outermost zones
        for first, last in [*runs(flags), *runs(holes)]:
            few[max(first - 1, 0) : last + 2] |= last - first < 2
    return few


def _changing(closed: Flags) -> Flags:
    """Returns which cells have a neighbour that is open or closed otherwise, array (n,)."""
    changes = np.any(closed[:, 1:] != closed[:, :-1], axis=0)
    return np.append(changes, False) | np.insert(changes, 0, False)


def _zones(problem: Problem, cells: Array, pressures: Array, closed: Flags) -> tuple[Interval, ...]:
    """Returns intervals of closed cells, array (n,), of which those of two stretches are two."""
    stretch = np.searchsorted([left for left, _ in problem.stretches], cells.mean(axis=1))
    return tuple(
        (_edge(cells, pressures, first, last, 1), _edge(cells, pressures, last, first, -1))
        for number in np.unique(stretch)
        for first, last in runs(closed & (stretch == number))
    )


def _edge(cells: Array, p: Array, first: int, last: int, way: int) -> float:
    """Returns where the zone from cell `first` to `last` begins, with the others to the `way` of it."""
    border = cells[first, (1 - way) // 2]
    if first == last:
        return float(border)
    x = cells[[first, first + way]].mean(axis=1)
    past = distance_to_root(way * (x[1] - x[0]), p[first], p[first + way])
    if not np.isfinite(past):
        return float(border)
    return float(x[0] - way * min(past, cells[first, 1] - cells[first, 0]))


def _flexibility(problem: Problem, x: Array, widths: Array) -> Array:
    """Returns gaps of all corners from pressures of cells about x, arrays (n,): array (corners n,
    corners n).
    """
    if problem.law.clamps_rotation:
        matrix = _averages(problem, x, widths, (3,))[0]
    elif len(problem.law.corners) == 1:
        matrix = _averages(problem, x, widths, (0,))[0]
    else:
        U, V, W = _averages(problem, x, widths, (0, 1, 2))
        levers = [problem.lever(np.full(len(x), corner), x) for corner in range(2)]
        matrix = np.block([[U + a[:, None] * b * W + (a[:, None] - b) * V for b in levers] for a in levers])
    if problem.counter is not None:
        matrix = matrix + second_body_flexibility(problem, x, widths)
    return (matrix + matrix.T) / 2


def _averages(problem: Problem, x: Array, widths: Array, which: Sequence[int]) -> Array:
    """Returns kernels at x_i averaged over cell j: array (len(which), n, n)."""
    distance = x[:, None] - x
    itself = np.eye(len(x), dtype=bool)
    # two Gauss points are enough farther away than 2.9 lengths, which is no distance of equal cells
    near = np.abs(distance) < 2.9 * np.maximum(widths, widths[:, None])
    points, weights = cell_rule(0, 1, 16)
    singular = np.concatenate((0.5 - points, 0.5 + points)), np.tile(weights / 2, 2)
    averages = np.empty((len(which), len(x), len(x)))
    rules = (~near, gauss_rule(2)), (near & ~itself, gauss_rule(10)), (itself, singular)
    for pairs, (points, weights) in rules:
        column = np.nonzero(pairs)[1]
        distances = distance[pairs][:, None] - widths[column][:, None] * (points - 0.5)
        averages[:, pairs] = on_the_line(problem.solid, distances, which) @ weights
    return averages
