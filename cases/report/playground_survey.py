"""The survey of the playground's map: the curves on which zones change, then the states of all patches."""

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from microblock.errors import NotConverged
from microblock.halfplane.kernels import coalescence_exponent

from .playground_map import ALONE, ROWS, TIP, Map, Patch, interpolated, uncrowded
from .playground_states import SLOPE, joined, sampled, solve

LOOKED = 201  # points at which the gap of A and its pressure are looked at
# alpha: below PARTED the zone of A parts inside that of B before it leaves it; at LEVEL A is born inside that
# of B and beside it at once; up to INSIDE zones of A inside are a patch, from APART on those apart are: below
# that they are so in one per cent of psi0. Up to FINE the edge of A moves fast where it has almost parted.
PARTED, LEVEL, INSIDE, APART, FINE = 0.145, 0.128, 0.118, 0.33, 0.25
NEXT_TO = 0.05  # the row next to TIP, where edges are too near to each other
# (alpha, psi0) at which zones meet: first guesses
MEETING = np.array(
    [(0.145, 0.3926), (0.1862, 0.4316), (0.2274, 0.4618), (0.3069, 0.4996), (0.4143, 0.5145)]
    + [(0.5320, 0.4883), (0.6498, 0.4149), (0.7549, 0.2890), (TIP, 0.0)]
)
SETTLED, STEPS = 2e-4, 10  # of psi0, to which the curve of meeting is followed, and states that this may take
STEP = 0.26  # between rows
LONGEST = 0.5  # between those of a curve that bounds patches
# what of psi0, or of the way between two curves, is left to strips
BEFORE_PARTING, BEFORE_MEETING, BEFORE_BIRTH, BETWEEN = 0.015, 0.004, 0.002, 0.03
ROUNDING = 1e-9  # of alpha, from its logarithm and back
NEARLY = 0.8  # of psi0 at which zones meet: from there on rows of FINE are closer


def node(alpha, psi0, law="microblock"):
    """A state of the map."""
    return sampled(solve(alpha, psi0, law))


def alone(alpha):
    """(the state in which B alone touches, psi0 below which A touches).

    The state does not depend on psi0, which adds alpha psi0 to the gap of A.
    """
    state = solve(alpha, ALONE)
    ((left, right),) = state.zones["B"]
    beside = right + (right - left + 2 * alpha) * np.linspace(0, 1, LOOKED)[1:] ** 2
    x = np.concatenate((np.linspace(left, right, LOOKED), beside))
    psi0 = ALONE - state.gap_at("A", x) / (SLOPE * alpha)
    i = int(np.argmax(psi0))
    top = np.polynomial.Polynomial.fit(x[i - 1 : i + 2], psi0[i - 1 : i + 2], 2)
    return sampled(state), float(top(top.deriv().roots()[0]))


def overlap(state):
    """The length on which the rightmost zone of A overlaps that of B, or less than 0 what is between, to the
    power that is linear in psi0 next to 0; nan where A does not reach beyond B.
    """
    own, other = (joined(state.solution.all_zones[number]) for number in (0, 1))
    if not own or own[-1][1] < other[-1][1]:
        return math.nan
    length = other[-1][1] - own[-1][0]
    return math.copysign(abs(length) ** (2 * coalescence_exponent(state.solid)), length)


def meeting(alpha):
    """psi0 at which the zones of A and B meet, by secants."""
    guess = float(np.interp(alpha, *MEETING.T))
    if alpha > MEETING[-2, 0]:  # there psi0^2 is linear
        guess = MEETING[-2, 1] * math.sqrt((TIP - alpha) / (TIP - MEETING[-2, 0]))
    known, psi0 = [], guess
    for _ in range(STEPS):
        found = overlap(solve(alpha, psi0))
        if math.isnan(found):
            psi0 *= 0.98
            continue
        known.append((psi0, found))
        if len(known) == 1:
            psi0 *= 0.98
            continue
        (before, one), (last, other) = known[-2:]
        psi0 = last - other * (last - before) / (other - one)
        if abs(psi0 - last) < SETTLED:
            return psi0
        psi0 = min(max(psi0, last - 0.1 * guess), last + 0.1 * guess)
    raise NotConverged(f"psi0 at which the zones of alpha = {alpha:g} meet was not found in {STEPS} states")


def dip(state):
    """The least pressure of A beside its right edge, before it rises towards its middle."""
    left, right = state.zones["A"][0][0], state.zones["A"][-1][1]
    x = right - (right - left) * np.geomspace(1, 1e-3, LOOKED)
    p = state.pressure_at(x, "A")
    return float(min(p[i] for i in range(1, len(x) - 1) if p[i - 1] > p[i] <= p[i + 1]))


def parting(alpha):
    """psi0 at which the zone of A parts inside that of B: the least pressure there is linear in psi0."""
    guess = math.sqrt(alpha) * (1.105 - 0.7 * alpha)
    near, far = 0.98 * guess, 0.94 * guess
    one, other = (dip(solve(alpha, psi0)) for psi0 in (near, far))
    return near + one * (near - far) / (other - one)


@dataclass(frozen=True)
class Curve:
    """psi0 over the rows of a patch; 0 where there are none."""

    rows_are: str
    rows: np.ndarray
    values: np.ndarray
    span: tuple

    def __call__(self, alpha):
        if not self.span[0] * (1 - ROUNDING) <= alpha <= self.span[1] * (1 + ROUNDING):
            return 0.0
        return interpolated(self.rows, ROWS[self.rows_are][0](alpha), self.values)


@dataclass(frozen=True)
class Curves:
    """Where zones change, and the bounds of patches beside that, as functions of alpha.

    Attributes
    ----------
    births : (Curve, Curve), where A is born inside the zone of B, for alpha up to LEVEL, and beside it
    parts, meets : Curve, where the zone of A parts, and where it meets that of B
    """

    births: tuple
    parts: Curve
    meets: Curve

    def nothing(self, alpha):
        return 0.0

    def born(self, alpha):
        return self.births[int(alpha > LEVEL)](alpha)

    def before_birth(self, alpha):
        born = self.born(alpha)
        return born - min(BETWEEN * (born - self.meets(alpha)), BEFORE_BIRTH * born)

    def before_parting(self, alpha):
        return (1 - BEFORE_PARTING) * self.parts(alpha)

    def parted(self, alpha):  # where what A has beside B is gone, too
        return (1.01 + 0.02 * (alpha / INSIDE) ** 2) * self.parts(alpha)

    def nearly(self, alpha):
        return NEARLY * self.meets(alpha)

    def before_meeting(self, alpha):
        return (1 - BEFORE_MEETING) * self.meets(alpha)

    def apart(self, alpha):
        met = self.meets(alpha)
        return met + min(BETWEEN * (self.born(alpha) - met), 2 * BEFORE_MEETING * met)


# patches: name, columns, alpha between which, how many times closer rows are, lower and upper curve, columns
REGIONS = (
    ("full", "even", 0.0, PARTED, 1, Curves.nothing, Curves.before_parting, 8),
    ("full", "even", PARTED, FINE, 2, Curves.nothing, Curves.nearly, 6),
    ("full", "upper", PARTED, FINE, 4, Curves.nearly, Curves.before_meeting, 12),
    ("full", "upper", FINE, TIP, 2, Curves.nothing, Curves.before_meeting, 11),
    ("inside", "both", 0.0, INSIDE, 1, Curves.parted, Curves.before_birth, 8),
    ("apart", "both", APART, TIP, 2, Curves.apart, Curves.before_birth, 8),
    ("apart", "upper", TIP, math.inf, 1, Curves.nothing, Curves.before_birth, 9),
)


def require_alike(patch):
    """NotConverged where zones of a patch's states differ, so that none lie between them."""
    usual = patch.states[0][0].closed
    for row, states in zip(patch.rows, patch.states):
        for column, state in enumerate(states):
            if state.closed != usual:
                alpha = patch.alpha(row)
                psi0 = patch.psi0(alpha, column / (patch.columns - 1))
                raise NotConverged(
                    f"zones at alpha = {alpha:g}, psi0 = {psi0:g} are not those of the other states called "
                    f"{patch.name!r}: take another --fineness"
                )


@dataclass(frozen=True)
class Survey:
    """Makes a Map.

    Attributes
    ----------
    span : (first, last), alpha between which the map is made
    fineness : float, how many times closer than usual rows and columns are
    mapped : (function, [arguments, ...], what is done) -> [answer, ...]
    """

    span: tuple
    fineness: float
    mapped: object

    @property
    def step(self):
        return STEP / self.fineness

    def map(self):
        """The Map, without errors."""
        alone_patches = [self.alone(low, high) for low, high in pairwise((self.span[0], LEVEL, self.span[1]))]
        births = tuple(Curve("even", one.rows, one.lower, one.span) for one in alone_patches)
        curves = Curves(
            births,
            self.curve(parting, self.span[0], PARTED, 1, "where A parts"),
            self.curve(meeting, PARTED, TIP, 2, "where A and B meet"),
        )
        return Map([*alone_patches, *self.regions(curves)], self.unilateral())

    def rows(self, rows_are, low, high, step):
        """Rows between two values of alpha, so far apart or less, three or more; not at TIP itself."""
        row = ROWS[rows_are][0]
        first = NEXT_TO if low == TIP else row(low)
        last = -NEXT_TO if high == TIP else row(high)
        return np.linspace(first, last, max(3, math.ceil((last - first) / step) + 1))

    def alone(self, low, high):
        """The patch in which B alone touches."""
        rows = self.rows("even", low, high, min(self.step, LONGEST) / 2)
        found = self.mapped(alone, [(math.exp(row),) for row in rows], "B alone")
        born, states = np.array([psi0 for _, psi0 in found]), [[state] for state, _ in found]
        return Patch("B alone", "even", "even", (low, high), rows, born, born, 1, states)

    def curve(self, function, low, high, closer, words):
        """A function of alpha as a Curve; a patch that it bounds must not reach beyond what it means."""
        rows = self.rows("crowded", low, high, min(self.step, LONGEST) / closer)
        values = self.mapped(function, [(uncrowded(row),) for row in rows], words)
        return Curve("crowded", rows, np.array(values), (low, high))

    def regions(self, curves):
        """The patches of REGIONS."""
        patches = []
        for name, columns_are, low, high, closer, *bounds, columns in REGIONS:
            span = max(low, self.span[0]), min(high, self.span[1])
            rows = self.rows("crowded", *span, self.step / closer)
            lower, upper = (np.array([bound(curves, uncrowded(row)) for row in rows]) for bound in bounds)
            columns = max(3, round(columns * self.fineness))
            patches.append(Patch(name, "crowded", columns_are, span, rows, lower, upper, columns))
        places = [
            (uncrowded(row), patch.psi0(uncrowded(row), column / (patch.columns - 1)))
            for patch in patches
            for row in patch.rows
            for column in range(patch.columns)
        ]
        found = iter(self.mapped(node, places, "states"))
        for patch in patches:
            patch.states = [[next(found) for _ in range(patch.columns)] for _ in patch.rows]
            require_alike(patch)
        return patches

    def unilateral(self):
        """The patch of the unilateral law."""
        rows = self.rows("even", *self.span, self.step / 2)
        states = self.mapped(node, [(math.exp(row), 0.0, "unilateral") for row in rows], "unilateral")
        zero = np.zeros(len(rows))
        states = [[state] for state in states]
        return Patch("unilateral", "even", "even", self.span, rows, zero, zero, 1, states)


def middles(found):
    """[(patch, cell along rows, along columns or None for the strip above, alpha, psi0)] of all cells and
    strips of a Map, in their middle.
    """
    places = []
    for patch in (*found.patches, found.unilateral):
        n, m = patch.cells
        for i in range(n):
            alpha = patch.alpha((patch.rows[i] + patch.rows[i + 1]) / 2)
            places += [(patch, i, j, alpha, patch.psi0(alpha, (j + 0.5) / m)) for j in range(m)]
            own = found.across(alpha) if patch is not found.unilateral else [patch]
            after = own[own.index(patch) + 1 :] if patch in own else []
            if after and after[0].ends(alpha)[0] > patch.ends(alpha)[1]:
                places.append((patch, i, None, alpha, (patch.ends(alpha)[1] + after[0].ends(alpha)[0]) / 2))
    return places
