"""Where squares of cells are needed: a window grows and shrinks to the contact, and parts.

1. Squares about the lowest places (`microblock.halfspace.candidate_squares`) are solved on few cells.
2. Connected cells that press get a square, with a free rim; a square whose rim presses grows.
3. Samples outside of all squares whose gaps are negative get one as well.
4. Squares close to each other are joined.

This ends when no square is new and none shrinks much.
"""

import numpy as np
from scipy.ndimage import find_objects, map_coordinates, minimum_filter

from ..contact_solvers.cell_solver import spots
from ..contact_solvers.fft_compliance import Grid
from ..errors import NotConverged
from ..model.periodic import EQUAL
from ..model.progress import counted
from .squares import Squares, nodes, of_corners, of_nodes, on_rows

TRIES = 60  # windows
FEW = 48  # cells along an axis of a window that is looked for
FREE = 1.16 + 6 / FEW  # a twelfth and three cells on either side of a contact
NEAR = 0.5  # of the smaller side, gap below which two squares become one
MOST = 64  # squares, whose pairs would fill the memory
NO_WINDOW = f"no window holds the contact after {TRIES} tries; give Cells(window=(left, right))"


def window(solver, picture, load, approach, places):
    """Returns the squares about the contact and about places, array (k, 2): a Grid if one is enough."""
    reach = 3 * picture.radius
    found = _about(solver, [(box, reach) for box in _clusters(places, 1.5 * reach)], 1.5, 0.0)
    for number in range(TRIES):
        if found == solver.given_window():
            return found
        counted(squares=len(found.grids))
        state, before = solver.solved(found, load, approach, solver.coarse_residual(FEW)), found
        outside = touching(state, picture)[0]
        places = np.vstack((places, outside))
        parts, grows = [(box, reach) for box in _clusters(outside, 1.5 * reach)], False
        for grid, reaches, own in zip(before.grids, reach_of(state, 2), rectangles(state)):
            held = before.near(grid, *places.T).T
            held = held[grid.beyond(*held.T) <= 0]
            for low, high in own:
                held = held[np.any((held < low) | (held > high), axis=1)]
            if reaches and not len(outside):
                parts.append((_around(np.vstack((*own, held))), 1.5 * grid.side))
                grows = True
            else:  # what was named but does not press may lie between cells
                parts += [(box, grid.side / 8) for box in _clusters(held, grid.side / 8)]
                parts += [(spot, 0.0) for spot in own]
        # squares that join and part without end are one
        found = _about(solver, parts, FREE, before.grids[0].width, MOST if 2 * number < TRIES else 1)
        sides, others = (np.sort([grid.side for grid in each.grids]) for each in (found, before))
        settled = len(sides) == len(others) and bool(np.all(sides >= 0.3 * FREE * others))
        if settled and not grows and not len(outside):
            return found
    raise NotConverged(NO_WINDOW)


def _about(solver, parts, times, width, most=MOST):
    """Returns squares about parts, so many times as wide; one instead of more than `most`, or where three
    times as many cells of one have the width of the smallest.
    """
    shifts, period = np.zeros((1, 2)), solver.period
    if solver.second is not None:
        shifts = solver.solid.ell / 2 * (solver.offsets[:, None] - solver.offsets).reshape(-1, 2)
    box = _around(np.vstack([box for box, _ in parts]))
    single = box, max(times * np.ptp(box, axis=0).max(), *(side for _, side in parts))
    parts = _joined(parts, times, period, shifts)
    least, widest = min(side for _, side in parts), max(side for _, side in parts)
    if len(parts) > most or (len(parts) > 1 and 3 * len(parts) * least**2 > single[1] ** 2):
        parts, widest = [single], single[1]
    if period and widest > period / 2:
        return solver.given_window()
    grids = []
    for box, side in parts:
        # few widths share tables, and those of the widest cells come first: their curvatures are least
        side = float(widest / 2.0 ** (np.floor(3 * np.log2(widest / side)) / 3))
        step = width / 2 if width and len(parts) == 1 else side / FEW
        middle = np.rint(box.mean(axis=0) / step) * step  # symmetric where the obstacle is
        grids.append(Grid(FEW, side / FEW, tuple(middle.tolist())))
    grids.sort(key=lambda grid: -grid.width)
    return grids[0] if len(grids) == 1 and not period else Squares(tuple(grids), period)


def _joined(parts, times, period, shifts):
    """Returns parts with the sides of their squares, of which those are one whose gaps are below NEAR of the
    smaller side, also when shifted.
    """
    while True:
        sides = np.array([max(side, times * np.ptp(box, axis=0).max()) for box, side in parts])
        middles = np.array([box.mean(axis=0) for box, _ in parts])
        apart = middles[:, None] - middles
        images = (period or 0.0) * np.rint(apart / (period or 1.0))
        gaps = np.abs((apart - images)[..., None, :] + shifts).max(axis=-1).min(axis=-1)
        gaps -= (sides[:, None] + sides) / 2
        close = np.argwhere(np.triu(gaps < NEAR * np.minimum.outer(sides, sides), 1))
        if not len(close):
            return [(box, side) for (box, _), side in zip(parts, sides.tolist())]
        i, j = close[0]
        both = _around(np.vstack((parts[i][0], parts[j][0] + images[i, j])))
        parts = [part for number, part in enumerate(parts) if number not in (i, j)]
        parts.append((both, float(max(sides[i], sides[j]))))


def touching(state, picture):
    """Returns places with the most negative gaps, beside the squares and between cells: arrays (k, 2)."""
    low, grid, least, solver = picture.low(state.approach), state.grid, picture.lowest[2], state.solver
    if solver.period:
        low[:, :2] -= solver.period * np.rint(low[:, :2] / solver.period)
    out = grid.beyond(*low[:, :2].T) > 0
    # on one square that may grow all count: which of them are deepest decides what it grows to
    free = isinstance(grid, Grid) and solver.options.window is None
    squares = Squares(grid.grids, solver.period)
    outside, inside = low[out, :2] if free else _lowest(squares, low[out]), low[~out]
    cells, (H, g0) = grid.nearest(*inside[:, :2].T), solver.prepared(grid)
    f, mode = g0.min(axis=0), "wrap" if state.is_whole else "nearest"
    near = minimum_filter(f, (1, 3, 3)[-f.ndim :], mode=mode)[tuple(cells)]
    tip = inside[:, 2] < near - (state.approach - least) / 20
    added = (H @ (state.pressures * grid.area))[(slice(None), *cells[:, tip])]

    def negative(places, added):
        gaps = (solver.gaps(*places.T) - state.approach + added).min(axis=0)
        deepest = np.argsort(gaps)[:256]
        return places[deepest[gaps[deepest] < -EQUAL * (state.approach - least)]]

    return negative(outside, beyond(state, outside)), negative(inside[tip, :2], added)


def _lowest(window, low):
    """Returns the lowest sample, of an array (m, 3), in each cell of squares twice as wide: array (k, 2)."""
    low = low[np.argsort(low[:, 2])]
    cells = np.floor(low[:, :2] / (window.side / FEW)[window.nearest(*low[:, :2].T)[0], None])
    return low[np.unique(cells, axis=0, return_index=True)[1], :2]


def beyond(state, places):
    """Returns what a state adds to gaps at places outside of its squares, array (corners, k): of a square on
    one twice as wide, farther away by the loads at its nodes.
    """
    solver, window, forces = state.solver, state.grid, state.pressures * state.grid.area
    found, loads = np.zeros((len(forces), len(places))), solver.prepared(window)[0].resultants(forces)
    parts = (one.reshape(len(one), -1, *one.shape[-2:]).swapaxes(0, 1) for one in (forces, loads))
    for grid, *own in zip(window.grids, *parts):
        near, wide = window.near(grid, *places.T), Grid(2 * FEW, grid.side / FEW, grid.middle)
        beside = wide.beyond(*near) < -wide.width / 2
        if beside.any():
            applied = np.zeros((len(forces), wide.count, wide.count))
            np.add.at(applied, (slice(None), *wide.nearest(*grid.places)), own[0])
            added, where = solver.alone(wide, False) @ applied, wide.steps(*near[:, beside])
            found[:, beside] += [map_coordinates(one, where, order=1) for one in added]
        for there, itself in ((~beside, False), (beside & bool(solver.period), True)):
            if there.any():
                found[:, there] += _afar(solver, grid, own, near[:, there], itself)
    return found


def _afar(solver, grid, applied, places, itself):
    """Returns what forces and (p, m) at the nodes of a grid add to gaps, of `itself` only their images."""
    x, y = places[:, :, None] - of_nodes(grid, 1)[:, None]
    (forces, loads), B = applied, nodes(grid.count, 1)[1]

    def displaced(K, values):
        return np.einsum("rckn,cn->rk", K, (B.T @ values @ B).reshape(len(values), -1))

    u, *phi = displaced(on_rows(solver.response(x, y, itself), len(loads)), loads)
    levers = solver.tilt(*places) - solver.offsets[:, : len(phi), None]
    found = u + np.sum(levers * np.array(phi).reshape(levers.shape[1:]), axis=1)
    if solver.second is not None:
        corners = solver.solid.ell / 2 * solver.offsets
        found += displaced(of_corners(solver.second_response, corners, x, y, itself), forces)
    return found


def rectangles(state):
    """Returns the rectangles of connected cells that press, arrays (2, 2), of each square."""
    found = []
    for grid, closed in zip(state.grid.grids, state.closed.reshape(-1, *[state.grid.count] * 2)):
        low = np.array(grid.middle) - grid.side / 2
        parts = find_objects(spots(closed, periodic=False))
        found.append(
            [low + grid.width * np.transpose([(one.start, one.stop) for one in part]) for part in parts]
        )
    return found


def reach_of(state, rim):
    """Returns whether cells at the rims of squares press, never on the whole of a period: bool (squares,)."""
    closed = state.closed.reshape(len(state.grid.grids), state.grid.count, -1) > 0
    inner = closed[:, rim:-rim, rim:-rim].sum(axis=(1, 2))
    return (inner < closed.sum(axis=(1, 2))) & (not state.is_whole)


def _around(places):
    """Returns the least and the largest x1 and x2 of places, array (2, 2)."""
    return np.array((places.min(axis=0), places.max(axis=0)))


def _clusters(places, reach):
    """Returns rectangles about places, arrays (2, 2), farther than that from each other."""
    found = []
    while len(places):
        box, before = _around(places[:1]), places[:0]
        while not np.array_equal(box, before):
            inside = np.all((places >= box[0] - reach) & (places <= box[1] + reach), axis=1)
            box, before = _around(places[inside]), box
        found.append(box)
        places = places[~inside]
    return found
