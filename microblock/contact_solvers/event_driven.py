"""Contact with friction, and without it, followed from event to event through a history of loads.

Corner forces n >= 0 and tangential forces t at nodes leave the gaps g and drag the surface by s along it. The
obstacle moves by u = (d, D), d along -e2 and D along e1, and bears the loads (P, Q):

    g = g0 + H n + C^T t - B_n u,     s = C n + T t,     (P, Q) = B_n^T n + B_t^T t,                    (c)

with the rows (n2, -n1) of B_n and (n1, n2) of B_t at the normal (n1, n2). A node sticks while B_t u - s does
not change; it slips in the direction of t while |t| = f times the sum of n. Uncoupled, C^T t is left out.

M = [[A, -B], [B^T, 0]] pairs corner forces with gaps, tangential forces with the slip, motions with loads.
Closed corners, nodes that stick, and motions are exchanged (principal pivots); t = tau + f sigma n where a
node slips. Pairs beyond their limit are exchanged at once, and if that brings no fewer the
first one alone (Murty, Opsearch 11 (1974) 123).
"""

from copy import copy, deepcopy
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg.blas import dgemm

from ..errors import NotConverged, require
from ..model.law import tangents
from ..model.progress import counted
from ..model.types import Array, Flags, Integers
from ..threads import with_outer_threads
from .rounding import EPS_PIVOT

AT_LIMIT = 1e-9  # of the largest bound: a node that is so near to its own slips or begins to
BUDGET = 500  # times the number of pairs: exchanges at one load, and events on one leg
PENDING = 48  # pivots that are not yet in the tableau
UNIQUE = "the friction may be too large for a unique answer: try a smaller one, or coupled=False"


class Rows(NamedTuple):
    """Rows of corners, nodes and motions in M: x are forces and motions, y are gaps, slip and loads."""

    corners: slice
    nodes: slice
    motions: slice


@dataclass(frozen=True, eq=False)
class FrictionalContact:
    """Compliances of corners and nodes (c).

    Attributes
    ----------
    normal : array (corners n, corners n), H (length per force), corner by corner
    cross : array (n, corners n), C
    tangential : array (n, n), T; symmetric as H
    gaps : array (corners n,), g0 (lengths), inf where a corner cannot touch
    coupled : whether tangential forces act on gaps
    normals : array (n, 2), of the nodes; (0, 1) without it
    """

    normal: Array
    cross: Array
    tangential: Array
    gaps: Array
    friction: float
    coupled: bool = True
    normals: Array | None = None

    def __post_init__(self) -> None:
        require(self.nodes, "tangential", self.tangential, "must be of one node or more")

    @property
    def nodes(self) -> int:
        return len(self.tangential)

    @property
    def rows(self) -> Rows:
        corners = len(self.gaps)
        forces = corners + self.nodes
        return Rows(slice(0, corners), slice(corners, forces), slice(forces, forces + 2))

    def displaced(self, normal: Array, tangential: Array) -> Array:
        """Returns changes of the gaps, then the drag s, under forces: array (corners n + n,)."""
        gaps = self.normal @ normal
        if self.coupled:
            gaps += self.cross.T @ tangential
        return np.concatenate((gaps, self.cross @ normal + self.tangential @ tangential))

    @property
    def size(self) -> float:
        """Largest displacement of a node under a unit shear force there (length per force)."""
        return float(np.abs(np.diag(self.tangential)).max()) or 1.0

    @property
    def motions(self) -> Array:
        """B: rows of corners, then of nodes; columns d and D."""
        n = self.nodes
        normals = np.tile((0.0, 1.0), (n, 1)) if self.normals is None else self.normals
        return np.vstack((*[tangents(normals)] * (len(self.gaps) // n), normals))

    @property
    def matrix(self) -> Array:
        """M, compliances over `size`."""
        corners, nodes, motions = self.rows
        B = self.motions
        M = np.zeros(2 * [motions.stop], order="F")
        M[corners, corners] = self.normal
        M[nodes, corners] = self.cross
        M[nodes, nodes] = self.tangential
        M[corners, nodes] = self.cross.T * self.coupled
        M /= self.size
        fixed = corners.stop + np.flatnonzero(np.diag(self.tangential) == 0)  # which could not stick alone
        M[fixed, fixed] = np.sqrt(np.finfo(float).eps)
        M[: motions.start, motions] = -B
        M[motions, : motions.start] = B.T
        return M


@dataclass(frozen=True, eq=False)
class FrictionState:
    """The contact at one pair of loads.

    Attributes
    ----------
    load, shear : P and Q (force)
    normal, gaps : arrays (corners n,), forces and gaps
    tangential, slip : arrays (n,), forces, and slip since first contact (length)
    gap_changes : array (corners n,), changes of the gaps by forces (lengths)
    closed : boolean array (corners n,)
    stick : boolean array (n,)
    at_limit : boolean array (n,), nodes with the largest shear force
    iterations : changes so far
    approach, offset : d and D (length)
    residual : largest violated condition over the largest force or displacement
    """

    load: float
    shear: float
    normal: Array
    gaps: Array
    tangential: Array
    slip: Array
    gap_changes: Array
    closed: Flags
    stick: Flags
    at_limit: Flags
    iterations: int
    approach: float
    offset: float
    energy: float
    work: float
    dissipation: float
    residual: float


@dataclass(frozen=True)
class Change:
    """A corner closes or opens, or a node slips, sticks or leaves, at a fraction of a leg."""

    leg: int
    fraction: float
    kind: str
    index: int


class PivotTableau:
    """y = M x after exchanges of some x_i with their y_i; pivots wait as products until there are PENDING.

    Parameters
    ----------
    matrix : array (N, N) in Fortran's order, which is overwritten

    Attributes
    ----------
    exchanged : boolean array (N,)
    sign : that of the product of all pivots
    """

    def __init__(self, matrix: Array) -> None:
        self.sign = 1.0
        self.exchanged = np.zeros(len(matrix), bool)
        self._matrix = matrix
        self._pending = 0
        self._columns, self._rows = np.zeros((2, PENDING, len(matrix))).transpose(0, 2, 1)

    def times(self, rows: slice | Flags, values: Array) -> Array:
        """Returns what values, array (k,), in k rows yield in all rows, array (N,)."""
        return self._matrix[:, rows] @ values + self._columns @ (self._rows[rows].T @ values)

    def entries(self, rows: int | Integers, columns: int | Integers) -> Array:
        pending = (self._columns[rows] * self._rows[columns]).sum(axis=-1)
        return np.asarray(self._matrix[rows, columns] + pending)

    def pivot(self, i: int) -> bool:
        """Exchanges a pair and returns True, unless the pivot is 0 to rounding."""
        column = self._matrix[:, i] + self._columns @ self._rows[i]
        row = self._matrix[i] + self._rows @ self._columns[i]
        pivot = column[i]
        if abs(pivot) <= EPS_PIVOT:
            return False
        self.exchanged[i] ^= True
        self.sign *= np.sign(pivot)
        row /= -pivot
        column[i] = row[i] = self._columns[i] = self._rows[i] = 0.0
        self._matrix[i] = row
        self._matrix[:, i] = column / pivot
        self._matrix[i, i] = 1 / pivot
        self._columns[:, self._pending] = column
        self._rows[:, self._pending] = row
        self._pending = (self._pending + 1) % PENDING
        if not self._pending:
            self._apply_pending()
        return True

    def _apply_pending(self) -> None:
        with with_outer_threads(len(self._matrix)):
            self._matrix = dgemm(
                1.0, self._columns, self._rows, 1.0, self._matrix, trans_b=True, overwrite_c=True
            )
        self._columns[:] = self._rows[:] = 0.0

    def add_friction_coupling(self, shear: int, corners: Integers, factor: float) -> None:
        """Replaces x_shear by x_shear - factor*sum(x_corners); where it is not exchanged, the corners are
        not.
        """
        if not factor:  # of most
            return
        if self.exchanged[shear]:
            closed = self.exchanged[corners]
            self._matrix[shear] -= factor * self._matrix[corners[closed]].sum(axis=0)
            self._columns[shear] -= factor * self._columns[corners[closed]].sum(axis=0)
            self._matrix[shear, corners[~closed]] -= factor
        else:
            self._matrix[:, corners] += factor * self._matrix[:, shear, None]
            self._rows[corners] += factor * self._rows[shear]


class Pivot(NamedTuple):
    """The exchange of one limit: a corner closes or opens, or a node slips, sticks or leaves.

    Attributes
    ----------
    pairs : rows of M that are exchanged
    node : number of the node
    slip : sign of its tangential force afterwards if it slips, else 0
    """

    pairs: list[int]
    node: int
    slip: float


class ActiveSets:
    """Closed corners and nodes that stick or slip, with their tableau.

    Limits are numbered: a corner's force or gap as the corner, the bound of a node's tangential force
    forwards as its row in M, backwards n further.

    Parameters
    ----------
    pairs : rows in M of closed corners, nodes that stick and motions, in this order

    Attributes
    ----------
    slips : array (n,), sign of t where a node slips, else 0
    corners_of : array (corners, n), rows of each node's corners
    flat : whether all normals are (0, 1)

    Raises NotConverged if the answer is not unique.
    """

    def __init__(self, contact: FrictionalContact, pairs: list[int]) -> None:
        self.contact = contact
        self.rows = contact.rows
        self.slips = np.zeros(contact.nodes)
        self.tableau = PivotTableau(contact.matrix)
        self.corners_of = np.arange(len(contact.gaps)).reshape(-1, contact.nodes)
        self.flat = not contact.motions[self.rows.corners, 1].any()
        if not all([self.tableau.pivot(pair) for pair in pairs]):
            raise NotConverged(f"the rates of the contact are not unique; {UNIQUE}")
        self.tableau.sign = 1.0

    @property
    def closed(self) -> Flags:
        return self.tableau.exchanged[self.rows.corners]

    @property
    def stick(self) -> Flags:
        return self.tableau.exchanged[self.rows.nodes]

    @property
    def last_sticks(self) -> bool:
        """Whether one node alone sticks."""
        return self.flat and np.count_nonzero(self.stick) == 1

    def may_slip(self, direction: float) -> Flags:
        """Returns the nodes that stick and may begin to slip, boolean array (n,): the last one only where
        another, which slips the other way, can stick instead.
        """
        return self.stick & (not self.last_sticks or bool(np.any(self.slips == -direction)))

    def pivot_of(self, limit: int, velocity: Array) -> Pivot:
        """Returns the Pivot of a limit; see `exchange`."""
        first = self.rows.nodes.start
        node = (limit - first) % len(self.slips)
        shear = first + node
        slip = float(self.slips[node])
        if limit >= first:
            if slip:
                return Pivot([shear], node, 0.0)
            if not self.stick[node]:
                return Pivot([], node, 0.0)
            return Pivot([shear], node, 1.0 if limit == shear else -1.0)
        closed = self.closed[self.corners_of[:, node]].sum()
        if closed != self.closed[limit]:  # others of the node are closed
            return Pivot([limit], node, slip)
        if self.stick[node]:
            return Pivot([shear, limit], node, 0.0)
        if closed:
            return Pivot([limit], node, 0.0)
        if abs(velocity[node]) <= AT_LIMIT * np.abs(velocity).max():
            return Pivot([limit, shear], node, 0.0)
        return Pivot([limit], node, float(np.sign(velocity[node])))

    def exchange(self, limit: int, velocity: Array) -> bool:
        """Closes or opens a corner, or lets a node slip or stick; returns False where that is singular.

        Parameters
        ----------
        limit : int
        velocity : array (n,), of the obstacle over the surface
        """
        pairs, node, slip = self.pivot_of(limit, velocity)
        shear = self.rows.nodes.start + node
        corners = self.corners_of[:, node]
        factor = (slip - self.slips[node]) * self.contact.friction
        if shear in pairs and self.stick[node] and self.last_sticks and not self._hold(slip, velocity):
            return False
        if slip:
            self.tableau.add_friction_coupling(shear, corners, factor)
        done = [pair for pair in pairs if self.tableau.pivot(pair)]
        if done != pairs or not pairs:
            for pair in done:
                self.tableau.pivot(pair)
            if slip:
                self.tableau.add_friction_coupling(shear, corners, -factor)
            return False
        if not slip:
            self.tableau.add_friction_coupling(shear, corners, factor)
        self.slips[node] = slip
        return True

    def _hold(self, slip: float, velocity: Array) -> bool:
        """Lets the slowest node that slips another way stick, before the last one that sticks slips."""
        candidates = np.flatnonzero((self.slips != 0) & (self.slips != slip))
        if not len(candidates):
            return False
        slowest = candidates[np.argmin(np.abs(velocity[candidates]))]
        return self.exchange(self.rows.nodes.start + int(slowest), velocity)

    def determinant(self, limit: int, velocity: Array) -> float:
        """Returns the determinant of the pivots of a limit."""
        pairs, node, slip = self.pivot_of(limit, velocity)
        entries = self.tableau.entries
        shear = self.rows.nodes.start + node
        pivots = entries(np.reshape(pairs, (-1, 1)), np.array(pairs, int))
        if slip and slip != self.slips[node]:  # t = tau + f slip n from then on
            if limit < self.rows.nodes.start:
                slope = entries(limit, shear)
            else:
                corners = self.corners_of[:, node]
                slope = -entries(corners[self.closed[corners]], shear).sum()
            pivots = pivots + (slip - self.slips[node]) * self.contact.friction * slope
        return float(np.linalg.det(pivots))


@dataclass(frozen=True, eq=False)
class Limits:
    """Rates of x and y while loads grow, and limits of forces and gaps, numbered as in `ActiveSets`.

    Attributes
    ----------
    dx, dy : arrays (N,), over the leg
    velocity : array (n,), of the obstacle over the surface
    distance : array (corners n + 2 n,)
        Forces of closed corners and gaps of open ones; what bounds leave of the tangential forces of nodes
        that stick, 0 where a node slips. inf without a limit.
    fall : array like `distance`
        Rates at which distances fall, and that of slip against t; 0 where they rise, or do not change.
    rounding : array like `distance`
        Distances that are no more.
    """

    dx: Array
    dy: Array
    velocity: Array
    distance: Array
    fall: Array
    rounding: Array

    @property
    def reached(self) -> Flags:
        return self.distance <= self.rounding

    @property
    def violated(self) -> Integers:
        return np.flatnonzero(self.reached & (self.fall > 0))

    def step(self, remaining: float) -> tuple[float, Integers]:
        """Returns the fraction of the leg up to the next limit, and the numbers of those reached there."""
        steps = np.full(len(self.fall), remaining)
        falls = self.fall > 0
        np.divide(np.maximum(self.distance, 0), self.fall, out=steps, where=falls)
        step = float(steps.min())
        numbers = np.flatnonzero(falls & (self.distance - step * self.fall <= self.rounding))
        if step >= remaining * (1 - EPS_PIVOT):
            step = remaining
        return step, numbers


class EventDrivenContact:
    """The contact along loads (P, Q), from first touch on.

    A leg to the next pair of loads repeats

    1. rates: pairs whose limits are violated are exchanged until none is;
    2. a step up to the next limit;
    3. exchange of the pairs that are at their limit there.

    Attributes
    ----------
    x, y : arrays (corners n + n + 2,), of (c) over `FrictionalContact.size`
    sets : ActiveSets
    changes : list of Change
    legs : number of legs so far
    work, dissipation : float
    """

    def __init__(self, contact: FrictionalContact) -> None:
        rows = contact.rows
        n = contact.nodes
        self.contact = contact
        self.rows = rows
        self.legs = 0
        self.changes: list[Change] = []
        self.work = 0.0
        self.dissipation = 0.0
        self._motions = contact.motions
        self._size = contact.size
        self._random = np.random.default_rng(0)
        self._first_contact = np.full(n, np.nan)  # place of the obstacle, from which slip counts
        self._noted_closed = np.zeros(len(contact.gaps), bool)
        self._noted_stick = np.zeros(n, bool)
        self._noted_slips = np.zeros(n)
        self.x = np.zeros(rows.motions.stop)
        self.y = np.zeros(rows.motions.stop)
        self.y[rows.corners] = contact.gaps / self._size
        self._gap_rounding = EPS_PIVOT * float(np.ptp(self.y[np.isfinite(self.y)]))
        # displacements under a unit force: 1 of nodes
        self._responses = np.append(np.abs(contact.normal).max(axis=1) / self._size, np.ones(2 * n))
        down = self._motions[rows.corners, 0]
        reachable = np.isfinite(contact.gaps) & (down > 0)
        gaps = np.where(reachable, self.y[rows.corners], np.inf)
        approaches = gaps / np.where(reachable, down, 1.0)
        corner = int(np.argmin(approaches))
        approach_row = rows.motions.start
        self.x[approach_row] = approaches[corner]
        self.y[:approach_row] -= approaches[corner] * self._motions[:, 0]
        first_node = rows.nodes.start + corner % n
        self.sets = ActiveSets(contact, [corner, first_node, approach_row, approach_row + 1])

    @property
    def loads(self) -> Array:
        """(P, Q)."""
        return self.y[self.rows.motions].copy()

    def follow(self, load: float, shear: float) -> FrictionState:
        """Follows loads (P, Q) on a straight way; returns the state at its end. Raises NotConverged if rates
        are not unique or there are none; `reached` says where.
        """
        end = np.array((load, shear))
        try:
            self._follow_leg(end, end - self.loads)
        except NotConverged as failure:
            P, Q = self.loads.tolist()
            raise NotConverged(
                f"the history stopped at ({P:.6g}, {Q:.6g}) on the way to ({load:.6g}, {shear:.6g}): "
                f"{failure}",
                reached=(P, Q),
            ) from failure
        self.legs += 1
        return self.state()

    def _follow_leg(self, end: Array, way: Array) -> None:
        if self.sets.flat:
            self._stop_at_full_slip(end, way)
        done = 0.0
        for _ in range(BUDGET * len(self.x)):
            counted()
            limits, step, numbers = self.find_rates(way, 1 - done)
            self._note_changes(done)
            self._advance(limits, step)
            if step == 1 - done:
                self.y[self.rows.motions] = end
                self._correct_rounding()
                return
            done += step
            for number in numbers.tolist():
                self.sets.exchange(number, limits.velocity)
        raise NotConverged("corners open and nodes slip to and fro without end")

    def _stop_at_full_slip(self, end: Array, way: Array) -> None:
        """Follows a leg beyond full slip up to it, then raises NotConverged."""
        friction = self.contact.friction
        start = self.loads
        direction = np.sign(end[1])
        reserve_before = friction * start[0] - direction * start[1]
        reserve_after = friction * end[0] - direction * end[1]
        if reserve_after < -AT_LIMIT * friction * end[0]:
            fraction = reserve_before / (reserve_before - reserve_after)
            self._follow_leg(start + fraction * way, fraction * way)
            raise NotConverged("all nodes slip, and the shear load cannot grow further")

    def _bound(self, x: Array) -> Array:
        """Returns the largest tangential forces, f times the sum of n: array (n,)."""
        return self.contact.friction * x[self.rows.corners].reshape(self.sets.corners_of.shape).sum(axis=0)

    def _rates(self, way: Array) -> tuple[Array, Array]:
        """Returns rates of x and y, arrays (N,), while loads grow by `way` over the leg."""
        exchanged = self.sets.tableau.exchanged
        given = np.zeros(len(self.x))
        given[self.rows.motions] = way
        rates = self.sets.tableau.times(self.rows.motions, way)
        dx = np.where(exchanged, rates, given)
        dy = np.where(exchanged, given, rates)
        dx[self.rows.nodes] += self.sets.slips * self._bound(dx)
        return dx, dy

    def limits(self, way: Array) -> Limits:
        """Returns the Limits while loads grow by `way` over the leg."""
        corners, nodes, _ = self.rows
        sets = self.sets
        dx, dy = self._rates(way)
        slipping = sets.slips != 0
        shear = self.x[nodes]
        bound = self._bound(self.x)
        forwards = np.where(sets.may_slip(1), bound - shear, np.where(slipping, 0.0, np.inf))
        backwards = np.where(sets.may_slip(-1), bound + shear, np.inf)
        gaps_or_forces = np.where(sets.closed, self.x[corners], self.y[corners])
        distance = np.concatenate((gaps_or_forces, forwards, backwards))
        bound_rate = self._bound(dx)
        fall_forwards = np.where(slipping, sets.slips * dy[nodes], dx[nodes] - bound_rate)
        fall_corners = np.where(sets.closed, -dx[corners], -dy[corners])
        fall = np.concatenate((fall_corners, fall_forwards, -dx[nodes] - bound_rate))
        are_forces = np.concatenate((sets.closed, ~slipping, ~slipping))
        # a hundred terms of one size in a gap or a slip
        scale = np.where(are_forces, 1.0, 100 * self._responses)
        least_fall = EPS_PIVOT * np.abs(dx[: nodes.stop]).max() * scale
        rounding = np.full(len(distance), EPS_PIVOT * self.x[corners].max())
        rounding[corners][~sets.closed] = self._gap_rounding
        return Limits(dx, dy, -dy[nodes], distance, np.where(fall > least_fall, fall, 0.0), rounding)

    def find_rates(self, way: Array, remaining: float) -> tuple[Limits, float, Integers]:
        """Exchanges pairs until no limit is violated; returns the Limits, the step up to the next one, and
        the numbers of those reached there. Raises NotConverged if there is none or more than one way on.
        """
        fewest = np.inf
        without_gain = 0
        for _ in range(BUDGET * len(self.x)):
            limits = self.limits(way)
            velocity = limits.velocity
            violated = limits.violated
            if not len(violated):
                self._require_unique(limits, way)
                return limits, *limits.step(remaining)
            without_gain = 0 if len(violated) < fewest else without_gain + 1
            fewest = min(fewest, len(violated))
            if without_gain >= 3:  # the first one alone (Murty), and after many of them one by chance
                violated = violated[:1]
            if without_gain >= 50 + 3 * limits.reached.sum():
                pool = violated if self._random.random() < 0.5 else np.flatnonzero(limits.reached)
                violated = self._random.choice(pool, 1)
                velocity = 0 * velocity
            for number in violated.tolist():
                self.sets.exchange(number, velocity)
        raise NotConverged(f"no rates were found; {UNIQUE}")

    def _require_unique(self, limits: Limits, way: Array) -> None:
        """NotConverged where states turn back or there are two ways on."""
        sets = self.sets
        if sets.tableau.sign <= 0:
            raise NotConverged(f"the answer may not be unique, as states turn back; {UNIQUE}")
        if not self.contact.friction:
            return
        first = self.rows.nodes.start
        reached = np.flatnonzero(limits.reached)
        slipping = (reached >= first) & (sets.slips[(reached - first) % len(sets.slips)] != 0)
        diagonal = np.where(slipping, reached, 0)
        pivots = sets.tableau.entries(diagonal, diagonal)
        pivots[~slipping] = [
            sets.determinant(number, limits.velocity) for number in reached[~slipping].tolist()
        ]
        for number in reached[pivots < -1e-8].tolist():  # beyond rounding
            trial = copy(self)
            trial.sets = deepcopy(sets)
            if trial.sets.exchange(number, limits.velocity) and not len(trial.limits(way).violated):
                raise NotConverged(f"the answer is not unique, as there are several ways on; {UNIQUE}")

    def _advance(self, limits: Limits, step: float) -> None:
        """Goes on; means over the step make work and dissipation exact."""
        corners, nodes, motions = self.rows
        mean_x = self.x + step / 2 * limits.dx
        mean_loads = self.y[motions] + step / 2 * limits.dy[motions]
        self.work += step * self._size * float(mean_loads @ limits.dx[motions])
        if not self.contact.coupled:  # the gaps do not know what the shear does to them; its work they do
            self.work += step * float(limits.dx[nodes] @ self.contact.cross @ mean_x[corners])
        power = (mean_x[nodes] * limits.dy[nodes])[self.sets.slips != 0].sum()
        self.dissipation -= step * self._size * float(power)
        self.x = self.x + step * limits.dx
        self.y = self.y + step * limits.dy
        self._put_at_limits()

    def _put_at_limits(self) -> None:
        """Puts all that is at its limit there exactly."""
        corners, nodes, _ = self.rows
        closed = self.sets.closed
        self.x[corners][~closed] = 0.0
        self.y[corners][closed] = 0.0
        self.x[nodes] = np.where(self.sets.stick, self.x[nodes], self.sets.slips * self._bound(self.x))

    def _residual(self) -> Array:
        """Returns what (c) has beyond y: gaps, slip and loads, array (N,)."""
        corners, nodes, motions = self.rows
        displaced = self.contact.displaced(self.x[corners], self.x[nodes]) / self._size
        y = np.append(displaced - self._motions @ self.x[motions], self._motions.T @ self.x[: nodes.stop])
        y[corners] += self.contact.gaps / self._size
        can_touch = np.isfinite(self.y)
        return np.where(can_touch, y, 0.0) - np.where(can_touch, self.y, 0.0)

    def _correct_rounding(self) -> None:
        residual = self._residual()
        exchanged = self.sets.tableau.exchanged
        correction = self.sets.tableau.times(exchanged, residual[exchanged])
        self.x = self.x - np.where(exchanged, correction, 0.0)
        self.y = self.y + np.where(exchanged, 0.0, residual - correction)
        self._put_at_limits()

    def _note_changes(self, fraction: float) -> None:
        """Notes the changes of corners and nodes since it was called before."""
        sets = self.sets
        closed = sets.closed
        stick = sets.stick
        slips = sets.slips != 0
        for i in np.flatnonzero(closed != self._noted_closed).tolist():
            self._note(fraction, "close" if closed[i] else "open", i)
        node_changes = (stick != self._noted_stick) | (sets.slips != self._noted_slips)
        for i in np.flatnonzero(node_changes).tolist():
            self._note(fraction, "stick" if stick[i] else "slip" if slips[i] else "leave", i)
        touches_first = np.isnan(self._first_contact) & (stick | slips)
        self._first_contact[touches_first] = -self.y[self.rows.nodes][touches_first]
        self._noted_closed = closed.copy()
        self._noted_stick = stick.copy()
        self._noted_slips = sets.slips.copy()

    def _note(self, fraction: float, kind: str, number: int) -> None:
        self.changes.append(Change(self.legs, fraction, kind, number))

    def state(self) -> FrictionState:
        """Returns the FrictionState at the loads reached."""
        corners, nodes, motions = self.rows
        contact = self.contact
        normal = self.x[corners].copy()
        tangential = self.x[nodes].copy()
        gap_changes, displaced = np.split(contact.displaced(normal, tangential), [corners.stop])
        energy = normal @ gap_changes + tangential @ displaced
        if not contact.coupled:
            energy += tangential @ contact.cross @ normal
        slip = -self.y[nodes] - self._first_contact
        bound = self._bound(self.x)
        in_contact = self.sets.stick | (self.sets.slips != 0)
        load, shear = self.loads.tolist()
        approach, offset = (self._size * self.x[motions]).tolist()
        return FrictionState(
            load=load,
            shear=shear,
            normal=normal,
            gaps=self.y[corners] * self._size,
            tangential=tangential,
            slip=self._size * np.where(np.isnan(slip), 0.0, slip),
            gap_changes=gap_changes,
            closed=self.sets.closed.copy(),
            stick=self.sets.stick.copy(),
            at_limit=in_contact & (bound - np.abs(tangential) <= AT_LIMIT * bound.max()),
            iterations=len(self.changes),
            approach=approach,
            offset=offset,
            energy=float(energy / 2),
            work=self.work,
            dissipation=self.dissipation,
            residual=self._largest_residual(max(np.abs(gap_changes).max(), np.abs(displaced).max())),
        )

    def _largest_residual(self, displacement: float) -> float:
        """Returns the largest violated condition over the largest force or the largest displacement."""
        corners, nodes, motions = self.rows
        residual = self._residual()
        normal = self.x[corners]
        beyond_bound = np.abs(self.x[nodes]) - self._bound(self.x)
        gaps = self.y[corners] + residual[corners]
        force = max(
            -normal.min(),
            np.where(self.sets.slips != 0, np.abs(beyond_bound), beyond_bound).max(),
            np.abs(residual[motions]).max(),
        )
        length = max(np.where(self.sets.closed, np.abs(gaps), -gaps).max(), np.abs(residual[nodes]).max())
        largest_length = displacement / self._size or 1.0
        return float(max(0.0, force / (normal.max() or 1.0), length / largest_length))
