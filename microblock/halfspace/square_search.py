"""Squares of cells that hold the contact on a half-space, from repeated solutions on few cells.

The contact is not known before, so the squares of cells are not, either. They are found from lowest places
of the obstacle (`microblock.halfspace.candidate_squares`) as follows:

1. Squares are laid about patches: rectangles that are contact, or may be.
   a. Patches with squares close to each other are joined.
   b. One square about all patches is taken if there are too many, or its cells are not many more.
   c. On a period the whole of it is taken if a square is wider than half of it.
   d. Sides and middles are rounded, so that squares share tables of compliances and symmetry is kept.
2. The contact problem is solved on SEARCH_CELLS cells along the sides of the squares.
3. Places beside the squares where the obstacle penetrates (`microblock.halfspace.penetration`) are added.
4. The next patches are
   a. the places of 3,
   b. connected cells that press, or all of a square whose rim presses, which grows,
   c. places that were looked for before and do not press: contact may lie between the cells.
5. Squares of these patches follow as in 1. If there are as many as before, none grows, none shrinks much and
   no place was added, they are the result; else 2 to 5 are repeated.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.ndimage import find_objects

from ..contact_solvers.fft_compliance import Grid, spots
from ..errors import NotConverged
from ..model.progress import counted
from ..model.types import Array, Flags
from .candidate_squares import CandidateSquares
from .penetration import penetration_outside
from .squares import SEARCH_CELLS, Squares

TRIES = 60  # repetitions
FIRST_MARGIN = 1.5  # side of the first squares over the width of their patches
MARGIN = 1.16 + 6 / SEARCH_CELLS  # of later ones: a twelfth and three cells free on either side
JOINING_GAP = 0.5  # of the smaller side, gap below which two squares become one
ROUNDED_GAP = 0.2  # the same of rounded squares; of two alike rounding leaves 0.22 of JOINING_GAP
LEAST_SIDE = 1e-3  # of the widest square, below which a place that does not press is left
MOST_SQUARES = 64  # whose pairs would fill the memory
NO_WINDOW = f"no window holds the contact after {TRIES} tries; give Cells(window=(left, right))"


class Patch(NamedTuple):
    """A rectangle that a square must hold.

    Attributes
    ----------
    box : array (2, 2), the least and the largest x1 and x2 (lengths)
    side : least side of the square (length)
    """

    box: Array
    side: float

    def with_margin(self, margin: float) -> "Patch":
        """Returns the patch with a square at least `margin` times as wide as the rectangle."""
        return Patch(self.box, float(max(self.side, margin * np.ptp(self.box, axis=0).max())))


def find_squares(
    solver: Any, candidates: CandidateSquares, load: float | None, approach: float | None, places: Array
) -> Grid | Squares:
    """Returns the squares about the contact under a load or at an approach (length), and about places, array
    (k, 2) (lengths): a Grid if one is enough.
    """
    layout = SquareLayout(solver)
    side = 3 * candidates.radius
    squares = layout.squares(_patches_about(places, 1.5 * side, side), FIRST_MARGIN)  # 1
    for number in range(TRIES):
        if squares == solver.given_window():
            return squares
        counted(squares=len(squares.grids))
        state = solver.solved(squares, load, approach, solver.coarse_residual(SEARCH_CELLS))  # 2
        penetrating = penetration_outside(state, candidates)  # 3
        places = np.vstack((places, penetrating))
        patches = _patches_about(penetrating, 1.5 * side, side)  # 4a
        contact_patches, grows = _contact_patches(state, places, len(penetrating) > 0)  # 4b, 4c
        patches += contact_patches
        # squares that join and part without end are one
        layout = SquareLayout(solver, squares.grids[0].width, MOST_SQUARES if 2 * number < TRIES else 1)
        squares_before = squares
        squares = layout.squares(patches, MARGIN)  # 5
        if not grows and not len(penetrating) and _are_alike(squares, squares_before):
            return squares
    raise NotConverged(NO_WINDOW)


@dataclass(frozen=True)
class SquareLayout:
    """Squares of cells about patches, for a SurfaceSolver.

    Attributes
    ----------
    solver : SurfaceSolver
    width : float
        Of the cells of a square before, on whose half cells the middle of a single square lies; 0 without
        one (length).
    most : int
        Number of squares.
    """

    solver: Any
    width: float = 0.0
    most: int = MOST_SQUARES

    def squares(self, patches: list[Patch], margin: float) -> Grid | Squares:
        """Returns squares that hold patches, `margin` times as wide: a Grid if one is enough."""
        period = self.solver.period
        single = _enclosing(patches, margin)
        patches = self._joined(patches, margin)  # 1a
        if len(patches) > self.most or self._costs_less(single, patches):  # 1b
            patches = [single]
        widest = max(patch.side for patch in patches)
        if period and widest > period / 2:  # 1c
            return self.solver.given_window()
        width = self.width if len(patches) == 1 else 0.0
        grids = [_rounded_square(patch, widest, width) for patch in patches]  # 1d
        # tables of the widest cells come first: their curvatures are least
        grids.sort(key=lambda grid: -grid.width)
        return grids[0] if len(grids) == 1 and not period else Squares(tuple(grids), period)

    def _costs_less(self, single: Patch, patches: list[Patch]) -> bool:
        """Returns whether one square has less than three times the cells of several, at one width."""
        least = min(patch.side for patch in patches)
        return len(patches) > 1 and 3 * len(patches) * least**2 > single.side**2

    def _joined(self, patches: list[Patch], margin: float) -> list[Patch]:
        """Returns patches with squares at least `margin` times as wide, farther than JOINING_GAP of the
        smaller side from each other, and than ROUNDED_GAP when they are rounded: a large square grows over a
        small one.
        """
        while True:
            patches = [patch.with_margin(margin) for patch in patches]
            sides = np.array([patch.side for patch in patches])
            images, gaps = self._distances(np.array([patch.box.mean(axis=0) for patch in patches]), sides)
            rounded = [_rounded_square(patch, float(sides.max()), 0.0) for patch in patches]
            middles = np.array([grid.middle for grid in rounded])
            _, rounded_gaps = self._distances(middles, np.array([grid.side for grid in rounded]))
            smaller = np.minimum.outer(sides, sides)
            too_close = (gaps < JOINING_GAP * smaller) | (rounded_gaps < ROUNDED_GAP * smaller)
            close = np.argwhere(np.triu(too_close, 1))
            if not len(close):
                return patches
            i, j = close[0]
            box = _box(np.vstack((patches[i].box, patches[j].box + images[i, j])))
            patches = [patch for number, patch in enumerate(patches) if number not in (i, j)]
            patches.append(Patch(box, float(max(sides[i], sides[j]))))

    def _distances(self, middles: Array, sides: Array) -> tuple[Array, Array]:
        """Returns the way from each square, of middles (k, 2) and sides (k,), to its image next to another
        one, array (k, k, 2), and the gap between the two, array (k, k), the least of corners of blocks on two
        bodies (lengths).
        """
        period = self.solver.period
        shifts = np.zeros((1, 2))
        if self.solver.second is not None:
            offsets = self.solver.offsets
            shifts = self.solver.solid.ell / 2 * (offsets[:, None] - offsets).reshape(-1, 2)
        distances = middles[:, None] - middles
        images = (period or 0.0) * np.rint(distances / (period or 1.0))
        gaps = np.abs((distances - images)[..., None, :] + shifts).max(axis=-1).min(axis=-1)
        return images, gaps - (sides[:, None] + sides) / 2


def _enclosing(patches: list[Patch], margin: float) -> Patch:
    """Returns the patch about all patches, at least `margin` times as wide."""
    box = _box(np.vstack([patch.box for patch in patches]))
    return Patch(box, max(patch.side for patch in patches)).with_margin(margin)


def _rounded_square(patch: Patch, widest: float, width: float) -> Grid:
    """Returns the Grid of a patch: its side is the widest one (length) over a power of the cube root of two,
    and its middle a multiple of half of a width (length), or of its own cells if that is 0.
    """
    thirds_of_octaves = np.floor(3 * np.log2(widest / patch.side))
    side = float(widest / 2.0 ** (thirds_of_octaves / 3))
    step = width / 2 if width else side / SEARCH_CELLS
    middle = np.rint(patch.box.mean(axis=0) / step) * step
    return Grid(SEARCH_CELLS, side / SEARCH_CELLS, tuple(middle.tolist()))


def _contact_patches(state: Any, places: Array, penetrates: bool) -> tuple[list[Patch], bool]:
    """Returns patches of the contact in the squares of a SurfaceCells and of places, array (k, 2), that do
    not press; and whether a square grows, as its rim presses and no place beside the squares `penetrates`.
    """
    patches = []
    grows = False
    for grid, rim_presses, contacts in zip(state.grid.grids, presses_at_rim(state, 2), contact_boxes(state)):
        images = state.grid.nearest_images(grid, *places.T).T
        open_places = images[grid.distance_outside(*images.T) <= 0]
        for low, high in contacts:
            open_places = open_places[np.any((open_places < low) | (open_places > high), axis=1)]
        if rim_presses and not penetrates:
            patches.append(Patch(_box(np.vstack((*contacts, open_places))), 1.5 * grid.side))  # 4b
            grows = True
        else:
            if grid.side > LEAST_SIDE * state.grid.grids[0].side:
                patches += _patches_about(open_places, grid.side / 8, grid.side / 8)  # 4c
            patches += [Patch(contact, 0.0) for contact in contacts]  # 4b
    return patches, grows


def _are_alike(squares: Grid | Squares, before: Grid | Squares) -> bool:
    """Returns whether squares are as many as before, and have at least 0.3 MARGIN of the sides."""
    sides = np.sort([grid.side for grid in squares.grids])
    sides_before = np.sort([grid.side for grid in before.grids])
    return len(sides) == len(sides_before) and bool(np.all(sides >= 0.3 * MARGIN * sides_before))


def enclosing(squares: Grid | Squares) -> Grid:
    """Returns the least square about all squares, as a Grid of one cell."""
    ends = [np.array(grid.middle) + side * grid.side / 2 for grid in squares.grids for side in (-1, 1)]
    low, high = _box(np.array(ends))
    return Grid(1, float(np.max(high - low)), tuple(((low + high) / 2).tolist()))


def contact_boxes(state: Any) -> list[list[Array]]:
    """Returns the rectangles of connected cells that press, arrays (2, 2) (lengths), of each square of a
    SurfaceCells.
    """
    count = state.grid.count
    boxes = []
    for grid, closed in zip(state.grid.grids, state.closed.reshape(-1, count, count)):
        low = np.array(grid.middle) - grid.side / 2
        slices = find_objects(spots(closed, periodic=False))
        cells = [np.transpose([(along.start, along.stop) for along in spot]) for spot in slices]
        boxes.append([low + grid.width * numbers for numbers in cells])
    return boxes


def presses_at_rim(state: Any, rim: int) -> Flags:
    """Returns whether `rim` rows of cells along the sides of squares press, never on the whole of a period:
    bool (squares,).
    """
    closed = state.closed.reshape(len(state.grid.grids), state.grid.count, -1) > 0
    inner = closed[:, rim:-rim, rim:-rim].sum(axis=(1, 2))
    return np.asarray((inner < closed.sum(axis=(1, 2))) & (not state.is_whole))


def _box(places: Array) -> Array:
    """Returns the least and the largest x1 and x2 of places, array (2, 2) (lengths)."""
    return np.array((places.min(axis=0), places.max(axis=0)))


def _patches_about(places: Array, distance: float, side: float) -> list[Patch]:
    """Returns patches about places, array (k, 2), farther than a distance from each other, with the least
    side of a square (lengths).
    """
    patches = []
    while len(places):
        box = _box(places[:1])
        box_before = places[:0]
        while not np.array_equal(box, box_before):
            inside = np.all((places >= box[0] - distance) & (places <= box[1] + distance), axis=1)
            box_before = box
            box = _box(places[inside])
        patches.append(Patch(box, side))
        places = places[~inside]
    return patches
