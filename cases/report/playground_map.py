"""The map of the playground: patches of alpha and psi0 in which zones are alike, and the strips between them.

psi0 < 0 is the mirror image of psi0 > 0. Above a curve psi0(alpha) B alone touches, and the state does not
depend on psi0 any more. Below it A has a zone too. For alpha above TIP it is apart from that of B; below TIP
it is so in a band, under which the two overlap ("full"). For alpha below some 0.12 the zone of A lies within
that of B in this band ("inside").

States are interpolated by cubics along rows (alpha) and columns (psi0) of a patch: the edges, and the two
functions on each piece between them, at nodes that move with the edges. In the strips between patches, a few
per cent of psi0 wide, zones are born, meet and part: there the states of both sides are blended.
"""

import math
from dataclasses import dataclass, field

import numpy as np

from microblock.model.zones import runs

from .playground_states import BOTH, FAR, SHARE, A, B, Sampled, fields, weights

TIP = 0.8343132  # alpha at which the zones of psi0 = 0 meet, `alpha_mid` of the case `size_effect`
WIDTH = 0.15  # of ln alpha, within which rows crowd towards TIP
PARTS = 8  # of the way between two edges, at which blended corners are looked at
HALVED = 20  # times, an interval with an edge of a blended zone
SAFETY = 1.5  # elsewhere in a cell the error may be larger than in the middle
NARROW = 1e-3  # over a_Hz: a blended zone that is narrower is none
ALONE = (
    1.0  # psi0 at which B alone touches, whatever alpha; where psi0 changes no zone, states are those of it
)


def crowded(alpha):
    """A coordinate of rows: ln(alpha/TIP) far from TIP, its root beside it, of which edges are smooth."""
    far = math.log(alpha / TIP)
    return math.copysign(math.sqrt((abs(far) + WIDTH) ** 2 - WIDTH**2), far)


def uncrowded(row):
    """The inverse of `crowded`."""
    return TIP * math.exp(math.copysign(math.hypot(row, WIDTH) - WIDTH, row))


ROWS = {"crowded": (crowded, uncrowded), "even": (math.log, math.exp)}
# how psi0 goes from the lower curve to the upper one along the columns, both from 0 to 1, and back
COLUMNS = {
    "even": (lambda column: column, lambda share: share),
    "upper": (lambda column: math.sin(math.pi / 2 * column), lambda share: math.asin(share) * 2 / math.pi),
    "both": (
        lambda column: math.sin(math.pi / 2 * column) ** 2,
        lambda share: math.asin(math.sqrt(share)) * 2 / math.pi,
    ),
}


@dataclass(eq=False)
class Patch:
    """A region of the map.

    Attributes
    ----------
    name : str
    rows_are, columns_are : str, of ROWS and COLUMNS
    span : (first, last), alpha between which the patch is used
    rows : array (n,), ascending
    lower, upper : arrays (n,), psi0 at the first and at the last column of each row
    columns : int; 1 where pressures and zones do not depend on psi0
    states : n lists of Sampled, one for each column
    errors : array (n - 1, columns - 1 or 1), of interpolated states in the middle of each cell
    strip : array (n - 1,), of blended states in the middle of the strip above, 0 where there is none
    """

    name: str
    rows_are: str
    columns_are: str
    span: tuple
    rows: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    columns: int
    states: list = field(default_factory=list)
    errors: np.ndarray = None
    strip: np.ndarray = None

    @property
    def cells(self):
        """Number of cells along rows and columns."""
        return len(self.rows) - 1, max(self.columns - 1, 1)

    def row(self, alpha):
        return ROWS[self.rows_are][0](alpha)

    def alpha(self, row):
        return ROWS[self.rows_are][1](row)

    def ends(self, alpha):
        """psi0 of the lower and of the upper curve."""
        return tuple(interpolated(self.rows, self.row(alpha), values) for values in (self.lower, self.upper))

    def psi0(self, alpha, share):
        """psi0 at a share of the columns, 0 to 1."""
        low, high = self.ends(alpha)
        return low + (high - low) * COLUMNS[self.columns_are][0](share)

    def column(self, alpha, psi0):
        """The column, in their numbers, at which psi0 is."""
        low, high = self.ends(alpha)
        if self.columns == 1 or high <= low:
            return 0.0
        share = min(max((psi0 - low) / (high - low), 0.0), 1.0)
        return COLUMNS[self.columns_are][1](share) * (self.columns - 1)

    def at(self, alpha, psi0):
        """The state, by cubics along rows and columns."""
        found = mean(
            [
                (one * other, self.states[i][j])
                for i, one in neighbours(self.rows, self.row(alpha), 4)
                for j, other in neighbours(np.arange(self.columns), self.column(alpha, psi0), 4)
            ]
        )
        return turned(found, alpha, psi0) if self.columns == 1 else found

    def cell(self, alpha, psi0):
        """Numbers of the cell along rows and columns; beyond the rows that of the nearest."""
        i = int(np.searchsorted(self.rows, self.row(alpha))) - 1
        n, m = self.cells
        return min(max(i, 0), n - 1), min(int(self.column(alpha, psi0)), m - 1)


def neighbours(nodes, where, count):
    """[(number, Lagrange's weight)] of the nodes around a place; beyond the last ones they extrapolate."""
    count = min(count, len(nodes))
    first = int(np.clip(np.searchsorted(nodes, where) - count // 2, 0, len(nodes) - count))
    own = weights(where, nodes[first : first + count])
    return [(first + number, float(weight)) for number, weight in enumerate(own)]


def interpolated(rows, row, values):
    """Values of the rows at one between them, by cubics."""
    return float(sum(weight * values[number] for number, weight in neighbours(rows, row, 4)))


def mean(nodes):
    """The weighted mean of states [(weight, Sampled)] with zones alike; edges stay in order."""
    edges = sum(weight * state.edges for weight, state in nodes)
    values = sum(weight * state.values for weight, state in nodes)
    return Sampled(np.maximum.accumulate(edges), nodes[0][1].closed, values)


def turned(state, alpha, psi0):
    """A state of psi0 = ALONE, in which B alone touches, as that of another psi0: all that is of B stays, the
    gap of A grows by what psi0 adds over the side of a block, the mean gap by half of that.
    """
    values = state.values.copy()
    values[np.equal(state.closed, 0), 0] += alpha * (psi0 - ALONE) / 2
    return Sampled(state.edges, state.closed, values)


def blended(nodes, alpha):
    """The weighted mean of states [(weight, Sampled, psi0)] of one alpha with other zones: a corner is closed
    where the mean of its pressures is larger than that of its gaps (over p_Hz and a_Hz^2/R).
    """

    def means(x):
        """Means of `fields` at x."""
        return sum(weight * fields(state, x, alpha, psi0) for weight, state, psi0 in nodes)

    def closing(corner):
        """Pressure less gap of a corner, as a function of x."""
        psi0 = sum(weight * own for weight, _, own in nodes)

        def function(x):
            one, other, psi, gap = means(x)
            half = alpha * (psi0 + psi - x) / 2
            return one - gap - half if corner == A else other - gap + half

        return function

    edges = np.unique(np.concatenate([state.edges for _, state, _ in nodes]))
    x = np.concatenate(([edges[0] - alpha], edges, [edges[-1] + alpha]))
    x = np.interp(np.arange((len(x) - 1) * PARTS + 1) / PARTS, np.arange(len(x)), x)
    zones = {corner: _positive(closing(corner), x) for corner in (A, B)}
    edges = np.unique([edge for own in zones.values() for interval in own for edge in interval])
    ends, closed, values = np.concatenate(([-FAR], edges, [FAR])), [], []
    for left, right in zip(ends, ends[1:]):
        middle = (left + right) / 2
        code = sum(one for one, own in zones.items() if any(a < middle < b for a, b in own))
        one, other, psi, gap = means(left + (right - left) * SHARE)
        closed.append(code)
        values.append({0: (gap, psi), A: (one, psi), B: (other, psi), BOTH: (one, other)}[code])
    return Sampled(edges, tuple(closed), np.array(values))


def _positive(function, x):
    """Intervals in which a function is positive, their ends halved out between samples x."""

    def zero(inside, outside):
        for _ in range(HALVED):
            middle = (inside + outside) / 2
            inside, outside = (middle, outside) if function(np.array([middle]))[0] > 0 else (inside, middle)
        return inside

    found = runs(function(x) > 0)
    edges = [(zero(x[i], x[max(i - 1, 0)]), zero(x[j], x[min(j + 1, len(x) - 1)])) for i, j in found]
    return [(left, right) for left, right in edges if right - left > NARROW]


@dataclass(eq=False)
class Map:
    """All patches of the microblock law, and the one of the unilateral law, whose states know no psi0."""

    patches: list
    unilateral: Patch

    def across(self, alpha):
        """The patches at alpha, psi0 ascending."""
        own = [patch for patch in self.patches if patch.span[0] <= alpha <= patch.span[1]]
        return sorted(own, key=lambda patch: patch.ends(alpha)[0])

    def place(self, alpha, psi0):
        """(patch, next one or None, share): psi0 >= 0 is in the patch, or at a share of the strip above."""
        own = self.across(alpha)
        for patch, after in zip(own, own[1:]):
            high, low = patch.ends(alpha)[1], after.ends(alpha)[0]
            if psi0 <= high:
                return patch, None, 0.0
            if psi0 < low:
                return patch, after, (psi0 - high) / (low - high)
        return own[-1], None, 0.0

    def at(self, alpha, psi0=0.0, law="microblock"):
        """The state at alpha and psi0 (over a_Hz/R)."""
        if law == "unilateral":
            return self.unilateral.at(alpha, ALONE)  # as it is, whatever psi0
        if psi0 < 0:
            return self.at(alpha, -psi0).mirrored()
        patch, after, share = self.place(alpha, psi0)
        if after is None:
            return patch.at(alpha, psi0)
        high, low = patch.ends(alpha)[1], after.ends(alpha)[0]
        return blended([(1 - share, patch.at(alpha, high), high), (share, after.at(alpha, low), low)], alpha)

    def error(self, alpha, psi0=0.0, law="microblock"):
        """The error that the page shows: SAFETY times the largest amid the cell and those around it."""
        patch, after, _ = (self.unilateral, None, 0) if law == "unilateral" else self.place(alpha, abs(psi0))
        i, j = patch.cell(alpha, abs(psi0))
        if after is not None:
            return SAFETY * float(patch.strip[max(i - 1, 0) : i + 2].max())
        return SAFETY * float(patch.errors[max(i - 1, 0) : i + 2, max(j - 1, 0) : j + 2].max())
