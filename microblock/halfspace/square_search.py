"""Where squares of cells are needed: a window grows and shrinks to the contact, and parts.

1. Squares about the lowest places (`microblock.halfspace.candidate_squares`) are solved on few cells.
2. Connected cells that press get a square, with a free rim; a square whose rim presses grows.
3. Samples outside of all squares whose gaps are negative get one as well.
4. Squares close to each other are joined.

This ends when no square is new and none shrinks much. `solver` is a `SurfaceSolver`, `state` a
`SurfaceCells`.
"""

from typing import Any, NamedTuple

import numpy as np
from scipy.ndimage import find_objects, map_coordinates, minimum_filter

from ..contact_solvers.fft_compliance import Grid, spots
from ..errors import NotConverged
from ..model.periodic import EQUAL
from ..model.progress import counted
from ..model.types import Array, Flags
from .candidate_squares import CandidateSquares
from .squares import Squares, chebyshev_nodes, corner_response, node_places, response_matrix

TRIES = 60  # windows
SEARCH_CELLS = 48  # along an axis of a window that is looked for
RIM = 1.16 + 6 / SEARCH_CELLS  # of a contact's width: a twelfth and three cells free on either side
JOINING_GAP = 0.5  # of the smaller side, gap below which two squares become one
MOST_SQUARES = 64  # whose pairs would fill the memory
NO_WINDOW = f"no window holds the contact after {TRIES} tries; give Cells(window=(left, right))"


class Patch(NamedTuple):
    """A rectangle that a square must hold.

    Attributes
    ----------
    box : array (2, 2), the least and the largest x1 and x2
    side : least side of the square (length)
    """

    box: Array
    side: float

    def needed(self, times: float) -> float:
        """Returns the side of a square so many times as wide as the rectangle."""
        return float(max(self.side, times * np.ptp(self.box, axis=0).max()))


def find_squares(
    solver: Any, candidates: CandidateSquares, load: float | None, approach: float | None, places: Array
) -> Grid | Squares:
    """Returns the squares about the contact and about places, array (k, 2): a Grid if one is enough."""
    reach = 3 * candidates.radius
    squares = _about(solver, [Patch(box, reach) for box in _clusters(places, 1.5 * reach)], 1.5, 0.0)
    for number in range(TRIES):
        if squares == solver.given_window():
            return squares
        counted(squares=len(squares.grids))
        state = solver.solved(squares, load, approach, solver.coarse_residual(SEARCH_CELLS))  # 1
        outside = violations(state, candidates)[0]
        places = np.vstack((places, outside))
        patches, grows = _patches(state, places, len(outside) > 0)  # 2
        patches = [Patch(box, reach) for box in _clusters(outside, 1.5 * reach)] + patches  # 3
        # squares that join and part without end are one
        most = MOST_SQUARES if 2 * number < TRIES else 1
        before = squares
        squares = _about(solver, patches, RIM, before.grids[0].width, most)  # 4
        sides = np.sort([grid.side for grid in squares.grids])
        sides_before = np.sort([grid.side for grid in before.grids])
        settled = len(sides) == len(sides_before) and bool(np.all(sides >= 0.3 * RIM * sides_before))
        if settled and not grows and not len(outside):
            return squares
    raise NotConverged(NO_WINDOW)


def _patches(state: Any, places: Array, touches_outside: bool) -> tuple[list[Patch], bool]:
    """Returns a Patch of each contact and of places that do not press, and whether a square grows, since its
    rim presses.
    """
    patches = []
    grows = False
    for grid, rim_presses, contacts in zip(state.grid.grids, reaches_rim(state, 2), rectangles_of(state)):
        images = state.grid.nearest_images(grid, *places.T).T
        held = images[grid.distance_outside(*images.T) <= 0]
        for low, high in contacts:
            held = held[np.any((held < low) | (held > high), axis=1)]
        if rim_presses and not touches_outside:
            patches.append(Patch(_box(np.vstack((*contacts, held))), 1.5 * grid.side))
            grows = True
        else:  # what was named but does not press may lie between cells
            patches += [Patch(box, grid.side / 8) for box in _clusters(held, grid.side / 8)]
            patches += [Patch(contact, 0.0) for contact in contacts]
    return patches, grows


def _about(
    solver: Any, patches: list[Patch], times: float, width: float, most: int = MOST_SQUARES
) -> Grid | Squares:
    """Returns squares about patches, so many times as wide; one instead of more than `most`, or where three
    times as many cells of one have the width of the smallest.
    """
    period = solver.period
    shifts = np.zeros((1, 2))
    if solver.second is not None:
        shifts = solver.solid.ell / 2 * (solver.offsets[:, None] - solver.offsets).reshape(-1, 2)
    box = _box(np.vstack([patch.box for patch in patches]))
    single = Patch(box, max(Patch(box, 0.0).needed(times), *(patch.side for patch in patches)))
    patches = _joined(patches, times, period, shifts)
    least = min(patch.side for patch in patches)
    if len(patches) > most or (len(patches) > 1 and 3 * len(patches) * least**2 > single.side**2):
        patches = [single]
    widest = max(patch.side for patch in patches)
    if period and widest > period / 2:
        return solver.given_window()
    grids = []
    for box, needed in patches:
        # few widths share tables, and those of the widest cells come first: their curvatures are least
        side = float(widest / 2.0 ** (np.floor(3 * np.log2(widest / needed)) / 3))
        step = width / 2 if width and len(patches) == 1 else side / SEARCH_CELLS
        middle = np.rint(box.mean(axis=0) / step) * step  # symmetric where the obstacle is
        grids.append(Grid(SEARCH_CELLS, side / SEARCH_CELLS, tuple(middle.tolist())))
    grids.sort(key=lambda grid: -grid.width)
    return grids[0] if len(grids) == 1 and not period else Squares(tuple(grids), period)


def _joined(patches: list[Patch], times: float, period: float | None, shifts: Array) -> list[Patch]:
    """Returns patches with the sides of their squares, of which those are one whose gaps are below
    JOINING_GAP of the smaller side, also when shifted.
    """
    while True:
        sides = np.array([patch.needed(times) for patch in patches])
        middles = np.array([patch.box.mean(axis=0) for patch in patches])
        distances = middles[:, None] - middles
        images = (period or 0.0) * np.rint(distances / (period or 1.0))
        gaps = np.abs((distances - images)[..., None, :] + shifts).max(axis=-1).min(axis=-1)
        gaps -= (sides[:, None] + sides) / 2
        close = np.argwhere(np.triu(gaps < JOINING_GAP * np.minimum.outer(sides, sides), 1))
        if not len(close):
            return [Patch(patch.box, side) for patch, side in zip(patches, sides.tolist())]
        i, j = close[0]
        box = _box(np.vstack((patches[i].box, patches[j].box + images[i, j])))
        patches = [patch for number, patch in enumerate(patches) if number not in (i, j)]
        patches.append(Patch(box, float(max(sides[i], sides[j]))))


def violations(state: Any, candidates: CandidateSquares) -> tuple[Array, Array]:
    """Returns places with the most negative gaps, beside the squares and between cells: arrays (k, 2)."""
    solver = state.solver
    grid = state.grid
    least = candidates.lowest[2]
    low = candidates.low(state.approach)
    if solver.period:
        low[:, :2] -= solver.period * np.rint(low[:, :2] / solver.period)

    def negative(places: Array, added: Array) -> Array:
        gaps = (solver.gaps(*places.T) - state.approach + added).min(axis=0)
        deepest = np.argsort(gaps)[:256]
        return places[deepest[gaps[deepest] < -EQUAL * (state.approach - least)]]

    is_outside = grid.distance_outside(*low[:, :2].T) > 0
    outside = low[is_outside, :2]
    # on one square that may grow all count: which of them are deepest decides what it grows to
    if not isinstance(grid, Grid) or solver.options.window is not None:
        outside = _lowest_of_cells(Squares(grid.grids, solver.period), low[is_outside])
    inside = low[~is_outside]
    cells = grid.nearest(*inside[:, :2].T)
    H, g0 = solver.prepared(grid)
    f = g0.min(axis=0)
    neighbours = minimum_filter(f, (1, 3, 3)[-f.ndim :], mode="wrap" if state.is_whole else "nearest")
    is_tip = inside[:, 2] < neighbours[tuple(cells)] - (state.approach - least) / 20
    added = (H @ (state.pressures * grid.area))[(slice(None), *cells[:, is_tip])]
    return negative(outside, gaps_beside(state, outside)), negative(inside[is_tip, :2], added)


def _lowest_of_cells(squares: Squares, low: Array) -> Array:
    """Returns the lowest sample, of an array (m, 3), in each cell of squares twice as wide: array (k, 2)."""
    low = low[np.argsort(low[:, 2])]
    widths = (squares.side / SEARCH_CELLS)[squares.nearest(*low[:, :2].T)[0], None]
    cells = np.floor(low[:, :2] / widths)
    return low[np.unique(cells, axis=0, return_index=True)[1], :2]


def gaps_beside(state: Any, places: Array) -> Array:
    """Returns what a state adds to gaps at places, array (k, 2), outside of its squares, array (corners, k):
    of a square on one twice as wide, farther away by the loads at its nodes.
    """
    solver = state.solver
    squares = state.grid
    forces = state.pressures * squares.area
    loads = solver.prepared(squares)[0].resultants(forces)
    gaps = np.zeros((len(forces), len(places)))
    for grid, forces_here, loads_here in zip(squares.grids, _by_grid(forces), _by_grid(loads)):
        images = squares.nearest_images(grid, *places.T)
        wide = Grid(2 * SEARCH_CELLS, grid.side / SEARCH_CELLS, grid.middle)
        is_close = wide.distance_outside(*images) < -wide.width / 2
        if is_close.any():
            applied = np.zeros((len(forces), wide.count, wide.count))
            np.add.at(applied, (slice(None), *wide.nearest(*grid.places)), forces_here)
            added = solver.alone(wide, False) @ applied
            steps = wide.steps(*images[:, is_close])
            gaps[:, is_close] += [map_coordinates(of_corner, steps, order=1) for of_corner in added]
        for where, images_alone in ((~is_close, False), (is_close & bool(solver.period), True)):
            if where.any():
                far = _gaps_far_away(solver, grid, forces_here, loads_here, images[:, where], images_alone)
                gaps[:, where] += far
    return gaps


def _by_grid(values: Array) -> Array:
    """Returns values on cells of squares, array (rows, ..., n, n), as array (squares, rows, n, n)."""
    return values.reshape(len(values), -1, *values.shape[-2:]).swapaxes(0, 1)


def _gaps_far_away(
    solver: Any, grid: Grid, forces: Array, loads: Array, places: Array, images_alone: bool
) -> Array:
    """Returns what forces, array (corners, n, n), and loads (p, m) at the nodes of a grid add to gaps at
    places, array (2, k), or what their images add.
    """
    x, y = places[:, :, None] - node_places(grid, 1)[:, None]
    shares = chebyshev_nodes(grid.count, 1)[1]

    def displaced(response: Array, values: Array) -> Array:
        at_nodes = (shares.T @ values @ shares).reshape(len(values), -1)
        return np.asarray(np.einsum("rckn,cn->rk", response, at_nodes))

    u, *phi = displaced(response_matrix(solver.response(x, y, images_alone), len(loads)), loads)
    levers = solver.tilt(*places) - solver.offsets[:, : len(phi), None]
    gaps = u + np.sum(levers * np.array(phi).reshape(levers.shape[1:]), axis=1)
    if solver.second is not None:
        corners = solver.solid.ell / 2 * solver.offsets
        gaps += displaced(corner_response(solver.second_response, corners, x, y, images_alone), forces)
    return gaps


def rectangles_of(state: Any) -> list[list[Array]]:
    """Returns the rectangles of connected cells that press, arrays (2, 2), of each square."""
    count = state.grid.count
    rectangles = []
    for grid, closed in zip(state.grid.grids, state.closed.reshape(-1, count, count)):
        low = np.array(grid.middle) - grid.side / 2
        slices = find_objects(spots(closed, periodic=False))
        cells = [np.transpose([(along.start, along.stop) for along in spot]) for spot in slices]
        rectangles.append([low + grid.width * numbers for numbers in cells])
    return rectangles


def reaches_rim(state: Any, rim: int) -> Flags:
    """Returns whether cells at the rims of squares press, never on the whole of a period: bool (squares,)."""
    closed = state.closed.reshape(len(state.grid.grids), state.grid.count, -1) > 0
    inner = closed[:, rim:-rim, rim:-rim].sum(axis=(1, 2))
    return np.asarray((inner < closed.sum(axis=(1, 2))) & (not state.is_whole))


def _box(places: Array) -> Array:
    """Returns the least and the largest x1 and x2 of places, array (2, 2)."""
    return np.array((places.min(axis=0), places.max(axis=0)))


def _clusters(places: Array, reach: float) -> list[Array]:
    """Returns rectangles about places, arrays (2, 2), farther than that from each other."""
    boxes = []
    while len(places):
        box = _box(places[:1])
        box_before = places[:0]
        while not np.array_equal(box, box_before):
            inside = np.all((places >= box[0] - reach) & (places <= box[1] + reach), axis=1)
            box_before = box
            box = _box(places[inside])
        boxes.append(box)
        places = places[~inside]
    return boxes
