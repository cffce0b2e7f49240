"""Contact with friction, and without it, followed from event to event through a history of loads or motions.

Corner forces n >= 0 and tangential forces t at nodes leave the gaps g and drag the surface by s along it. The
obstacle moves by u = (d, D), d along -e2 and D along e1, and bears the loads (P, Q):

    g = g0 + H n + C^T t - B_n u,     s = C n + T t,     (P, Q) = B_n^T n + B_t^T t,                    (c)

with the rows (n2, -n1) of B_n and (n1, n2) of B_t, of the normal (n1, n2) at the node. A node sticks while
B_t u - s does not change; it slips while |t| = f times the sum of n at the node, and B_t u - s changes in the
direction of t. Uncoupled, C^T t is left out of the gaps.

In M = [[A, -B], [B^T, 0]] each force has its partner: corner forces the gaps, tangential forces the slip,
motions the loads. Closed corners, nodes that stick, and motions whose load is given are exchanged with their
partners (principal pivots); where a node slips t = tau + f sigma n stands in place of t. While no set changes
all is affine in the loads: rates are a column of the tableau, and the first sign that changes ends a piece.
All that stands at a limit and would go beyond it is exchanged at once, and if that brings no fewer of them
the first one alone (Murty, Opsearch 11 (1974) 123). Work = energy + dissipation holds to rounding.

The product of all pivots is the determinant of the exchanged part of M. Where it is not positive, states turn
back while loads grow; where a single exchange with a negative pivot also gives rates that hold, there are two
ways on. Both are refused.
"""

from __future__ import annotations

from collections.abc import Iterator
from copy import deepcopy
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.blas import dgemm

from ..errors import NotConverged
from ..model.progress import counted
from ..model.types import Array, Flags
from ..threads import released
from .rounding import PATHS

Numbers = NDArray[np.integer[Any]]
SETS = "closed", "stick", "slips", "x", "y", "_tableau"  # what an exchange changes

AT_LIMIT = 1e-9  # of the largest bound: a node that is so near to its own slips or begins to
TURNED = -1e-8  # pivots below it are negative beyond rounding
PATIENCE = 3  # exchanges of all violated without fewer of them, before single ones
SINGLE = 50, 3  # of them, and for each pair at a limit, before chance decides
BUDGET = 60  # times the number of pairs: exchanges at one load, and events on one leg
PENDING = 48  # pivots that are not yet in the tableau
UNIQUE = "the friction may be too large for a unique answer: try a smaller one, or coupled=False"


@dataclass(frozen=True, eq=False)
class FrictionalContact:
    """Compliances of corners and nodes (c).

    Attributes
    ----------
    normal : array (corners n, corners n)
        H: gaps from corner forces, corner by corner (length per force); symmetric.
    cross : array (n, corners n)
        C: tangential displacements from corner forces.
    tangential : array (n, n)
        T: tangential displacements from tangential forces; symmetric. Without a node nothing rubs.
    gaps : array (corners n,)
        Initial gaps (lengths), inf where a corner cannot touch.
    friction : float
    coupled : bool
        Whether tangential forces act on gaps.
    normals : array (n, 2), optional
        Of the nodes; (0, 1) without it.
    """

    normal: Array
    cross: Array
    tangential: Array
    gaps: Array
    friction: float
    coupled: bool = True
    normals: Array | None = None

    @property
    def nodes(self) -> int:
        """Number of nodes."""
        return len(self.tangential)

    def moved(self, n: Array, t: Array) -> Array:
        """What forces add to the gaps, and how far they drag the surface: array (corners n + n,)."""
        gaps = self.normal @ n + (self.cross.T @ t if self.coupled else 0.0)
        return np.concatenate((gaps, self.cross @ n + self.tangential @ t))

    @property
    def motions(self) -> Array:
        """B: rows of corners, then of nodes; columns d and, where something rubs, D."""
        n, corners = self.nodes, len(self.gaps)
        if not n:
            return np.ones((corners, 1))
        n1, n2 = np.tile([[0.0], [1.0]], n) if self.normals is None else self.normals.T
        across = np.tile(np.column_stack((n2, -n1)), (corners // n, 1))
        return np.vstack((across, np.column_stack((n1, n2))))


@dataclass(frozen=True, eq=False)
class Moment:
    """The contact at one pair of loads or motions.

    Attributes
    ----------
    load, shear : float
        P and Q (force).
    normal, gaps : arrays (corners n,)
        Corner forces and gaps.
    tangential, slip : arrays (n,)
        Forces at the nodes, and way of the obstacle over the surface since first contact (length).
    closed : boolean array (corners n,)
    stick, at_limit : boolean arrays (n,)
        Nodes that stick, and nodes whose shear force is as large as friction allows.
    slips : array (n,)
        Sign of t where a node slips, else 0.
    raised : array (corners n,)
        What forces have added to the gaps (lengths).
    pieces : int
        Changes so far.
    approach, offset : float
        d and D (length).
    energy, work, dissipation : float
    residual : float
        The largest violated condition over the largest force, or over the largest displacement, computed
        anew.
    """

    load: float
    shear: float
    normal: Array
    gaps: Array
    tangential: Array
    slip: Array
    raised: Array
    closed: Flags
    stick: Flags
    slips: Array
    at_limit: Flags
    pieces: int
    approach: float
    offset: float
    energy: float
    work: float
    dissipation: float
    residual: float


@dataclass(frozen=True)
class Change:
    """A corner that closes or opens, or a node that begins to slip or to stick, or leaves, at a share of a
    leg."""

    leg: int
    share: float
    kind: str
    index: int


class Tableau:
    """y = M x after an exchange of some x_i with their y_i: row i is what follows of the pair i.

    Pivots wait as products of columns and rows until there are PENDING of them: a pass over a large matrix
    costs more than the pivot.

    Parameters
    ----------
    matrix : array (N, N) in Fortran's order, which is overwritten
    exchanged : boolean array (N,)

    Attributes
    ----------
    exchanged : boolean array (N,)
    sign : float, of the determinant of what was exchanged, over that at the beginning
    """

    def __init__(self, matrix: Array, exchanged: Flags) -> None:
        self._made, self.exchanged, self.sign, self._pending = matrix, exchanged, 1.0, 0
        self._left, self._right = np.zeros((2, PENDING, len(matrix))).transpose(0, 2, 1)
        columns = np.array(matrix[:, exchanged], order="F")
        inverse = np.linalg.inv(columns[exchanged])
        rows = -inverse @ matrix[exchanged]
        rows[:, exchanged], columns[exchanged], matrix[:, exchanged] = inverse, 0.0, 0.0
        self._add(columns, rows.T)
        self._made[exchanged] = rows

    def _add(self, columns: Array, rows: Array) -> None:
        with released(len(self._made)):
            self._made = dgemm(1.0, columns, rows, 1.0, self._made, trans_b=True, overwrite_c=True)

    def columns(self, numbers: Any) -> Array:
        """Columns with these numbers, or the column of one number."""
        found: Array = self._made[:, numbers] + self._left @ self._right[numbers].T
        return found

    def entries(self, rows: Any, columns: Any) -> Any:
        """Entries at places, as numpy indexes."""
        return self._made[rows, columns] + (self._left[rows] * self._right[columns]).sum(axis=-1)

    def pivot(self, i: int) -> bool:
        """Exchanges a pair, unless the pivot is 0 to rounding: whether it did."""
        column, row = self.columns(i), self._made[i] + self._right @ self._left[i]
        pivot = column[i]
        if abs(pivot) <= PATHS:
            return False
        self.exchanged[i] ^= True
        self.sign *= np.sign(pivot)
        row /= -pivot
        column[i] = row[i] = self._left[i] = self._right[i] = 0.0
        self._made[i], self._made[:, i] = row, column / pivot
        self._made[i, i] = 1 / pivot
        self._left[:, self._pending], self._right[:, self._pending] = column, row
        self._pending = (self._pending + 1) % PENDING
        if not self._pending:
            self._add(self._left, self._right)
            self._left[:] = self._right[:] = 0.0
        return True

    def add_rows(self, row: int, others: Numbers, ones: Numbers, share: float) -> None:
        """Adds a share of other rows, and of rows of the identity, to a row."""
        self._made[row] += share * self._made[others].sum(axis=0)
        self._left[row] += share * self._left[others].sum(axis=0)
        self._made[row, ones] += share

    def add_column(self, columns: Numbers, other: int, share: float) -> None:
        """Adds a share of a column to others."""
        self._made[:, columns] += share * self._made[:, other, None]
        self._right[columns] += share * self._right[other]


class Follower:
    """The contact from nothing on; `to` follows loads, or motions, straight to the next ones.

    Parameters
    ----------
    contact : FrictionalContact
    by_motions : bool
        Whether (d, D) is given in place of (P, Q).

    Attributes
    ----------
    changes : list of Change

    Raises
    ------
    NotConverged
        If motions are given and the obstacle overlaps the body at the beginning.
    """

    def __init__(self, contact: FrictionalContact, by_motions: bool = False) -> None:
        n, m = contact.nodes, len(contact.gaps)
        self.contact, self.by_motions, self.legs = contact, by_motions, 0
        self.changes: list[Change] = []
        self._m, self._n, self._motions, self._nodes = m, n, contact.motions, slice(m, m + n)
        self._of = np.arange(m).reshape(-1, n) if n else np.zeros((0, 0), int)  # corners of each node
        self._u = np.arange(m + n, m + n + self._motions.shape[1])
        self._flat = not by_motions and not self._motions[:m, 1:].any()
        self._size = float(np.abs(np.diag(contact.tangential if n else contact.normal)).max()) or 1.0
        self.closed, self.stick, self.slips = np.zeros(m, bool), np.zeros(n, bool), np.zeros(n)
        self.x, self.y = np.zeros((2, m + n + len(self._u)))
        self.y[:m] = contact.gaps / self._size
        self._span = float(np.ptp(self.y[np.isfinite(self.y)]))
        self.first, self.work, self.dissipation = np.full(n, np.nan), 0.0, 0.0
        self._sliding, self._seen = 0.0, (self.closed.copy(), self.slips.copy())
        if by_motions and (self.y[:m] < -PATHS * self._span).any():
            raise NotConverged("the obstacle overlaps the body before it moves: begin with gaps")
        if not by_motions:
            down = self._motions[:m, 0]
            reached = np.isfinite(contact.gaps) & (down > 0)
            heights = np.where(reached, self.y[:m], np.inf) / np.where(reached, down, 1.0)
            corner = int(np.argmin(heights))
            self.x[self._u[0]] = heights[corner]
            self.y[: m + n] -= heights[corner] * self._motions[:, 0]
            self.closed[corner], self.y[corner] = True, 0.0
            self.stick[corner % n if n else slice(0)] = True
            self.first[self.stick] = -self.y[self._nodes][self.stick]
        self._rebuild()

    # ---- sets ----

    def _rebuild(self) -> None:
        """The tableau of the sets as they are."""
        own, m, nodes, forces = self.contact, self._m, self._nodes, slice(0, self._nodes.stop)
        matrix = np.zeros((len(self.x),) * 2, order="F")
        matrix[:m, :m], matrix[nodes, :m], matrix[nodes, nodes] = own.normal, own.cross, own.tangential
        matrix[:m, nodes] = own.cross.T if own.coupled else 0.0
        matrix /= self._size
        matrix[forces, self._u], matrix[self._u, forces] = -self._motions, self._motions.T
        self._terms = np.abs(matrix[:m, :m]).max(axis=1)
        for corners in self._of:
            matrix[:, corners] += own.friction * self.slips * matrix[:, nodes]
        given = np.full(len(self._u), not self.by_motions)
        given[1:] &= not self._sliding
        try:
            self._tableau = Tableau(matrix, np.concatenate((self.closed, self.stick, given)))
        except np.linalg.LinAlgError as failure:
            raise NotConverged(f"the rates of the contact are not unique; {UNIQUE}") from failure

    def _exchange(self, number: int, passing: Array) -> bool:
        """Exchanges what is numbered as in `_look`, unless that is singular. `passing`: the rates at which
        the obstacle moves over the surface.
        """
        m, n = self._m, self._n
        node = (number - m) % n if n else 0
        if number < m:
            return (self._open if self.closed[number] else self._close)(number, node, passing)
        if self.stick[node]:
            return self._slip(node, 1.0 if number < m + n else -1.0, passing)
        return bool(self.slips[node]) and number < m + n and self._hold(node)

    def _alone(self, corner: int, node: int) -> bool:
        """Whether a corner closes as the first or opens as the last one of its node."""
        return self._n > 0 and bool(self.closed[self._of[:, node]].sum() == self.closed[corner])

    def _last(self) -> bool:
        """Whether one node alone sticks, and holds an obstacle whose shear force is given."""
        return self._flat and bool(self._tableau.exchanged[-1]) and np.count_nonzero(self.stick) == 1

    def _hand_over(self, others: Numbers, passing: Array) -> bool:
        """The last node that sticks leaves it to another one, that over which the obstacle moves least."""
        if not self._last():
            return True
        return len(others) > 0 and self._hold(int(others[np.argmin(np.abs(passing[others]))]))

    def _open(self, corner: int, node: int, passing: Array) -> bool:
        alone, pivot, row = self._alone(corner, node), self._tableau.pivot, self._m + node
        holds = alone and bool(self.stick[node])
        if holds and not (self._hand_over(np.flatnonzero(self.slips), passing) and pivot(row)):
            return False
        if not pivot(corner):
            if holds:
                pivot(row)
            return False
        self.closed[corner], self.x[corner], self.y[corner] = False, 0.0, 0.0
        if alone:
            self._leave(node)
        return True

    def _leave(self, node: int) -> None:
        self._pass_on(node, -self.slips[node])
        self.stick[node], self.slips[node], self.x[self._m + node] = False, 0.0, 0.0

    def _pass_on(self, node: int, sign: float) -> None:
        """Of an open node: corner forces bring their friction along."""
        self._tableau.add_column(self._of[:, node], self._m + node, sign * self.contact.friction)

    def _close(self, corner: int, node: int, passing: Array) -> bool:
        """A corner touches; with the first of its node the node slips as the obstacle passes, or sticks."""
        alone, row = self._alone(corner, node), self._m + node
        if alone:
            self.slips[node] = self._direction(node, passing)
            self._pass_on(node, self.slips[node])
        if not self._tableau.pivot(corner):
            if alone:
                self._leave(node)
            return False
        self.closed[corner], self.x[corner], self.y[corner] = True, 0.0, 0.0
        if alone:
            self.stick[node] = not self.slips[node] and self._tableau.pivot(row)
            self.first[node] = -self.y[row] if np.isnan(self.first[node]) else self.first[node]
        return True

    def _direction(self, node: int, passing: Array) -> float:
        """In which a node slips that touches, or 0."""
        still = abs(passing[node]) <= 100 * PATHS * np.abs(passing).max()
        return self._sliding or (0.0 if still else float(np.sign(passing[node])))

    def _slip(self, node: int, direction: float, passing: Array) -> bool:
        if not self._hand_over(np.flatnonzero(self.slips == -direction), passing):  # where the obstacle turns
            return False
        self._add_normal(node, -direction)
        if not self._tableau.pivot(self._m + node):
            self._add_normal(node, direction)
            return False
        self.stick[node], self.slips[node] = False, direction
        return True

    def _hold(self, node: int) -> bool:
        if not self._tableau.pivot(self._m + node):
            return False
        self._add_normal(node, self.slips[node])
        self.stick[node], self.slips[node] = True, 0.0
        return True

    def _add_normal(self, node: int, sign: float) -> None:
        """Adds f times the sum of the node's normal forces to the row of its tangential force."""
        corners = self._of[:, node]
        closed = self.closed[corners]
        self._tableau.add_rows(
            self._m + node, corners[closed], corners[~closed], sign * self.contact.friction
        )

    # ---- the way ----

    def to(self, *target: float) -> Moment:
        """Follows loads (P, Q), or motions (d, D), straight to the next ones; returns the contact there.

        Raises
        ------
        NotConverged
            If rates are not unique or there are none: `reached` says where.
        """
        for _ in self.pieces(*target):
            pass
        return self.moment()

    def pieces(self, *target: float) -> Iterator[float]:
        """Follows as `to`, and yields the share of the way at which each affine piece begins.

        Raises
        ------
        NotConverged
            As `to`.
        """
        scale = self._size if self.by_motions else 1.0
        end = np.array(target) / scale
        try:
            yield from self._pieces(end, end - self._given[self._u])
        except NotConverged as failure:
            now = tuple(float(scale * each) for each in self._given[self._u])
            words = [", ".join(f"{each:.6g}" for each in pair) for pair in (now, target)]
            raise NotConverged(
                f"the history stopped at ({words[0]}) on the way to ({words[1]}): {failure}", reached=now
            ) from failure
        self.legs += 1

    @property
    def _given(self) -> Array:
        """Where the loads or motions stand that are given."""
        return self.x if self.by_motions else self.y

    def _pieces(self, end: Array, way: Array) -> Iterator[float]:
        done = 0.0
        if self._flat and self._n:
            self._begin(self._given[self._u], end)
        for _ in range(BUDGET * (SINGLE[0] + len(self.x))):
            counted()
            dx, dy, event, step = self._settled(way, 1 - done)
            self._note(done)
            yield done
            before = self.x, self.y
            self._advance(dx, dy, step)
            self._check_last(*before)
            if event is None:
                self._given[self._u] = end
                self._correct()
                return
            done += step
            self._snap(event)
        raise NotConverged("corners open and nodes slip to and fro without end")

    def _begin(self, start: Array, end: Array) -> None:
        """Where all has slid, or begins to, the state of each node in contact is set anew."""
        f, sliding = self.contact.friction, 0.0
        largest = PATHS * f * max(start[0], end[0])
        if start[0] > 0 and start[1] * end[1] > 0:
            sliding = float(np.sign(end[1])) * all(abs(abs(q) - f * p) <= largest for p, q in (start, end))
        if sliding != self._sliding:
            touching = np.asarray(self.closed[self._of].any(axis=0))
            self.stick, self.slips = touching & (sliding == 0), np.where(touching, sliding, 0.0)
            self._sliding = sliding
            self._rebuild()

    def _bound(self) -> Array:
        """f times the normal force of each node."""
        found: Array = self.contact.friction * self.x[self._of].sum(axis=0)
        return found

    def _rates(self, way: Array) -> tuple[Array, Array]:
        """Rates of x and y."""
        active, nodes, rest = self._tableau.exchanged, self._nodes, np.zeros(len(self.x))
        rest[self._u] = np.where(active[self._u] | self.by_motions, way, 0.0)
        rates = self._tableau.columns(self._u) @ rest[self._u]
        dx, dy = np.where(active, rates, rest), np.where(active, rest, rates)
        if self._n:
            dx[nodes] += self.contact.friction * self.slips * dx[self._of].sum(axis=0)
        if self._sliding:  # the obstacle moves just so that no node slips back
            dx[-1] = self._sliding * (self._sliding * dy[nodes][self.slips != 0]).max()
            dy[nodes], dy[-1] = dy[nodes] - dx[-1], way[-1]
        return dx, dy

    def _look(self, way: Array) -> tuple[Array, Array, Array, Array, Flags]:
        """Rates of x and y; of all that must not be negative, numbered so: values, rates at which they fall,
        0 if that is rounding, and whether they stand at the limit. These are forces of closed corners or gaps
        of open ones; bounds forwards or rates of slip of nodes; bounds backwards of nodes that stick.
        """
        dx, dy = self._rates(way)
        m, nodes, closed, stick, slips = self._m, self._nodes, self.closed, self.stick, self.slips
        value, fall = np.where(closed, self.x[:m], self.y[:m]), np.where(closed, -dx[:m], -dy[:m])
        force, tiny = PATHS * np.abs(dx[: nodes.stop]).max(), PATHS * self.x[:m].max()
        small = force * np.where(closed, 1.0, 100 * self._terms)
        limit = value <= np.where(closed, tiny, PATHS * self._span)
        if self._n:
            last, slipping = self._last(), (slips != 0) & (not self._sliding)
            bound, dbound = self._bound(), self.contact.friction * dx[self._of].sum(axis=0)
            up, down = (stick & (not last or np.any(slips == sign)) for sign in (-1, 1))
            t, dt = self.x[nodes], dx[nodes]
            forwards = np.where(up, bound - t, np.where(slipping, 0.0, np.inf))
            backwards = np.where(down, bound + t, np.inf)
            value = np.concatenate((value, forwards, backwards))
            fall = np.concatenate((fall, np.where(slipping, slips * dy[nodes], dt - dbound), -dt - dbound))
            small = np.concatenate((small, force * np.where(slipping, 100.0, 1.0), np.full(self._n, force)))
            limit = np.concatenate((limit, forwards <= tiny, backwards <= tiny))
        return dx, dy, value, np.where(fall > small, fall, 0.0), limit

    def _settled(self, way: Array, remaining: float) -> tuple[Array, Array, int | None, float]:
        """Rates after exchanges of all that stands at a limit and would go beyond it, the first event, and
        the way to it.
        """
        random, fewest, idle = np.random.default_rng(0), np.inf, 0
        for _ in range(BUDGET * (SINGLE[0] + len(self.x))):
            dx, dy, value, fall, limit = self._look(way)
            passing, violated = -dy[self._nodes], np.flatnonzero(limit & (fall > 0))
            if not len(violated):
                self._require_unique(np.flatnonzero(limit), way, passing)
                falling = np.flatnonzero((fall > 0) & np.isfinite(value))
                steps = np.maximum(value[falling], 0) / fall[falling]
                if not len(steps) or steps.min() >= remaining * (1 - PATHS):
                    return dx, dy, None, remaining
                first = int(np.argmin(steps))
                return dx, dy, int(falling[first]), float(steps[first])
            idle = 0 if len(violated) < fewest else idle + 1
            fewest, patience = min(fewest, len(violated)), SINGLE[0] + SINGLE[1] * int(limit.sum())
            if idle >= PATIENCE:
                violated = violated[:1]
            if idle >= patience:
                pool = violated if random.random() < 0.5 else np.flatnonzero(limit)
                violated, passing = random.choice(pool, 1), 0 * passing
            if not any([self._exchange(int(each), passing) for each in violated]):
                idle = patience
        raise NotConverged(f"no rates were found; {UNIQUE}")

    def _require_unique(self, limit: Numbers, way: Array, passing: Array) -> None:
        """NotConverged where states turn back while loads grow, or where there are two ways on."""
        if self._tableau.sign <= 0:
            raise NotConverged(f"the answer may not be unique, as states turn back; {UNIQUE}")
        if not self._n:
            return
        slipping = (limit >= self._m) & (self.slips[(limit - self._m) % self._n] != 0)
        pivots = self._tableau.entries(limit[slipping], limit[slipping])
        others = [each for each in limit[~slipping].tolist() if self._determinant(each, passing) < TURNED]
        for number in [*limit[slipping][pivots < TURNED].tolist(), *others]:
            kept = deepcopy({name: self.__dict__[name] for name in SETS})
            holds = self._exchange(number, passing)
            *_, fall, still = self._look(way)
            self.__dict__ |= kept
            if holds and not np.any(still & (fall > 0)):
                raise NotConverged(f"the answer is not unique, as there are several ways on; {UNIQUE}")

    def _determinant(self, number: int, passing: Array) -> float:
        """Of the exchange of a corner, or of a node that sticks."""
        m, f, T = self._m, self.contact.friction, self._tableau.entries
        node = (number - m) % self._n
        row, corners = m + node, self._of[:, node]
        if number >= m:
            slope = T(corners, row)[self.closed[corners]].sum()
            return float(T(row, row) - (f if number < m + self._n else -f) * slope)
        alone = self._alone(number, node)
        direction = self._direction(node, passing) if alone and not self.closed[number] else 0.0
        if not alone or self.slips[node] or direction:
            return float(T(number, number) + f * direction * T(number, row))
        return float(T(number, number) * T(row, row) - T(number, row) * T(row, number))

    def _advance(self, dx: Array, dy: Array, step: float) -> None:
        """Goes on by a part of the leg; averages make work and dissipation exact."""
        nodes, u, m, size = self._nodes, self._u, self._m, self._size
        x, y = self.x + step / 2 * dx, self.y[u] + step / 2 * dy[u]
        self.work += step * size * float(y @ dx[u])
        if not self.contact.coupled:  # the gaps do not know what the shear does to them; its work they do
            self.work += step * float(dx[nodes] @ self.contact.cross @ x[:m])
        self.dissipation -= step * size * float((x[nodes] * dy[nodes])[self.slips != 0].sum())
        self.x, self.y = self.x + step * dx, self.y + step * dy
        self.x[nodes] = np.where(self.slips != 0, self.slips * self._bound(), self.x[nodes])

    def _snap(self, event: int) -> None:
        """What has reached its limit stands there exactly."""
        if event < self._m:
            (self.x if self.closed[event] else self.y)[event] = 0.0
        else:
            node = (event - self._m) % self._n
            self.x[self._m + node] = self._bound()[node] * (1 if event < self._m + self._n else -1)

    def _off(self) -> Array:
        """What rounding has left in the equations of all pairs."""
        m, nodes = self._m, self._nodes
        moved = self.contact.moved(self.x[:m], self.x[nodes]) / self._size
        found = np.append(moved - self._motions @ self.x[self._u], self._motions.T @ self.x[: nodes.stop])
        found[:m] += self.contact.gaps / self._size
        there = np.isfinite(self.y)
        return np.where(there, found, 0.0) - np.where(there, self.y, 0.0)

    def _correct(self) -> None:
        """Takes off what rounding has left."""
        off, active, nodes = self._off(), self._tableau.exchanged, self._nodes
        fix = self._tableau.columns(active) @ off[active]
        self.x, self.y = self.x - np.where(active, fix, 0.0), self.y + np.where(active, 0.0, off - fix)
        self.x[nodes] = np.where(self.slips != 0, self.slips * self._bound(), self.x[nodes])

    def _check_last(self, x: Array, y: Array) -> None:
        """NotConverged where the last node that sticks, before at x and y, is beyond what friction allows."""
        if not self._last():
            return
        node, f = int(np.argmax(self.stick)), self.contact.friction
        before, now = (f * z[self._of[:, node]].sum() - abs(z[self._m + node]) for z in (x, self.x))
        if now < -AT_LIMIT * self._bound().max():
            self.y = y + max(before, 0.0) / (max(before, 0.0) - now) * (self.y - y)
            raise NotConverged("all nodes slip, and the shear load cannot grow further")

    def _note(self, share: float) -> None:
        """Notes what has changed since the last time."""
        now, kinds = (
            (self.closed.copy(), np.where(self.stick, 2.0, self.slips)),
            ("leave", "slip", "stick", "slip"),
        )
        for number, (before, after) in enumerate(zip(self._seen, now)):
            for i in np.flatnonzero(before != after).tolist():
                kind = kinds[int(after[i])] if number else "close" if after[i] else "open"
                self.changes.append(Change(self.legs, share, kind, i))
        self._seen = now

    @property
    def approach(self) -> float:
        """d (length)."""
        return float(self._size * self.x[self._u[0]])

    def moment(self) -> Moment:
        """The contact as it stands."""
        own, m, size, off = self.contact, self._m, self._size, self._off()
        n, t, bound = self.x[:m].copy(), self.x[self._nodes].copy(), self._bound()
        raised, displaced = np.split(own.moved(n, t), [m])
        across = t @ own.cross @ n
        energy = (n @ raised + t @ displaced + (0.0 if own.coupled else across)) / 2
        ways, gaps = -self.y[self._nodes], self.y[:m] + off[:m]
        short = np.where(self.slips != 0, np.abs(np.abs(t) - bound), np.abs(t) - bound)
        forces = -n.min(), short.max(initial=0.0), np.abs(off[self._u]).max()
        lengths = np.where(self.closed, np.abs(gaps), -gaps).max(), np.abs(off[self._nodes]).max(initial=0.0)
        longest = max(np.abs(raised).max(), np.abs(displaced).max(initial=0.0)) / size or 1.0
        P, Q, d, D = (each for part in (self.y, size * self.x) for each in (*part[self._u], 0.0)[:2])
        return Moment(
            load=float(P),
            shear=float(Q),
            normal=n,
            gaps=self.y[:m] * size,
            tangential=t,
            slip=size * np.where(np.isnan(self.first), 0.0, ways - self.first),
            raised=raised,
            closed=self.closed.copy(),
            stick=self.stick.copy(),
            slips=self.slips.copy(),
            at_limit=(self.stick | (self.slips != 0))
            & (bound - np.abs(t) <= AT_LIMIT * bound.max(initial=0.0)),
            pieces=len(self.changes),
            approach=float(d),
            offset=float(D),
            energy=float(energy),
            work=self.work,
            dissipation=self.dissipation,
            residual=float(max(0.0, max(forces) / (n.max() or 1.0), max(lengths) / longest)),
        )
