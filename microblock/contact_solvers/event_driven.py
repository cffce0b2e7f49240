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

import numpy as np
from scipy.linalg.blas import dgemm

from ..errors import NotConverged, require
from ..model.law import tangents
from ..model.progress import counted
from ..model.types import Array, Flags
from ..threads import with_outer_threads
from .rounding import EPS_PIVOT

KINDS = "leave", "slip", "stick", "open", "close", "slip"  # the last one backwards

AT_LIMIT = 1e-9  # of the largest bound: a node that is so near to its own slips or begins to
BUDGET = 500  # times the number of pairs: exchanges at one load, and events on one leg
PENDING = 48  # pivots that are not yet in the tableau
UNIQUE = "the friction may be too large for a unique answer: try a smaller one, or coupled=False"


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

    def __post_init__(self):
        require(self.nodes, "tangential", self.tangential, "must be of one node or more")

    @property
    def nodes(self):
        return len(self.tangential)

    def moved(self, n, t):
        """Changes of gaps, then drag s, of forces: array (corners n + n,)."""
        gaps = self.normal @ n + (self.cross.T @ t if self.coupled else 0.0)
        return np.concatenate((gaps, self.cross @ n + self.tangential @ t))

    @property
    def size(self):
        """Largest displacement of a node under a unit shear force there (length per force)."""
        return float(np.abs(np.diag(self.tangential)).max()) or 1.0

    @property
    def motions(self):
        """B: rows of corners, then of nodes; columns d and D."""
        n = self.nodes
        normals = np.tile((0.0, 1.0), (n, 1)) if self.normals is None else self.normals
        return np.vstack((*[tangents(normals)] * (len(self.gaps) // n), normals))

    @property
    def matrix(self):
        """M, compliances over `size`."""
        B, m = self.motions, len(self.gaps)
        M = np.zeros(2 * [len(B) + 2], order="F")
        M[:m, :m], M[m:-2, :m], M[m:-2, m:-2] = self.normal, self.cross, self.tangential
        M[:m, m:-2] = self.cross.T * self.coupled
        M /= self.size
        held = m + np.flatnonzero(np.diag(self.tangential) == 0)  # which could not stick alone
        M[held, held] = np.sqrt(np.finfo(float).eps)
        M[:-2, -2:], M[-2:, :-2] = -B, B.T
        return M


@dataclass(frozen=True, eq=False)
class FrictionState:
    """The contact at one pair of loads.

    Attributes
    ----------
    load, shear : P and Q (force)
    normal, gaps : arrays (corners n,), forces and gaps
    tangential, slip : arrays (n,), forces, and slip since first contact (length)
    raised : array (corners n,), changes of the gaps by forces (lengths)
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
    raised: Array
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
    """A corner closes or opens, or a node slips, sticks or leaves, at a share of a leg."""

    leg: int
    share: float
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

    def __init__(self, matrix):
        self._made, self.sign, self._count = matrix, 1.0, 0
        self.exchanged = np.zeros(len(matrix), bool)
        self._left, self._right = np.zeros((2, PENDING, len(matrix))).transpose(0, 2, 1)

    def times(self, numbers, weights):
        return self._made[:, numbers] @ weights + self._left @ (self._right[numbers].T @ weights)

    def entries(self, rows, columns):
        return self._made[rows, columns] + (self._left[rows] * self._right[columns]).sum(axis=-1)

    def pivot(self, i):
        """Exchanges a pair and returns True, unless the pivot is 0 to rounding."""
        column = self._made[:, i] + self._left @ self._right[i]
        row = self._made[i] + self._right @ self._left[i]
        pivot = column[i]
        if abs(pivot) <= EPS_PIVOT:
            return False
        self.exchanged[i] ^= True
        self.sign *= np.sign(pivot)
        row /= -pivot
        column[i] = row[i] = self._left[i] = self._right[i] = 0.0
        self._made[i], self._made[:, i] = row, column / pivot
        self._made[i, i] = 1 / pivot
        self._left[:, self._count], self._right[:, self._count] = column, row
        self._count = (self._count + 1) % PENDING
        if not self._count:
            with with_outer_threads(len(row)):
                self._made = dgemm(
                    1.0, self._left, self._right, 1.0, self._made, trans_b=True, overwrite_c=True
                )
            self._left[:] = self._right[:] = 0.0
        return True

    def add_friction_coupling(self, i, others, share):
        """Replaces x_i by x_i - share*sum(x_others); where it is not exchanged, the others are not."""
        there = self.exchanged[others]
        if not share:  # of most
            return
        if self.exchanged[i]:
            self._made[i] -= share * self._made[others[there]].sum(axis=0)
            self._left[i] -= share * self._left[others[there]].sum(axis=0)
            self._made[i, others[~there]] -= share
        else:
            self._made[:, others] += share * self._made[:, i, None]
            self._right[others] += share * self._right[i]


class ActiveSets:
    """Closed corners and nodes that stick or slip, with their tableau.

    Parameters
    ----------
    pairs : numbers of closed corners, nodes that stick and motions, in this order

    Attributes
    ----------
    slips : array (n,), sign of t where a node slips, else 0
    of : array (corners, n), numbers of each node's corners
    flat : whether all normals are (0, 1)

    Raises NotConverged if the answer is not unique.
    """

    def __init__(self, contact, pairs):
        m, n = len(contact.gaps), contact.nodes
        self.contact, self.slips, self.tableau = contact, np.zeros(n), PivotTableau(contact.matrix)
        self.of, self.flat = np.arange(m).reshape(-1, n), not contact.motions[:m, 1].any()
        if not all([self.tableau.pivot(pair) for pair in pairs]):
            raise NotConverged(f"the rates of the contact are not unique; {UNIQUE}")
        self.tableau.sign = 1.0

    @property
    def closed(self):
        return self.tableau.exchanged[: self.of.size]

    @property
    def stick(self):
        return self.tableau.exchanged[self.of.size : -2]

    @property
    def last(self):
        """Whether one node alone sticks."""
        return self.flat and np.count_nonzero(self.stick) == 1

    def pivots_for(self, number, passing):
        """Pairs to exchange, the node, and its slip then."""
        m, n = len(self.closed), len(self.slips)
        node = (number - m) % n
        shear, slips, corners = m + node, float(self.slips[node]), self.of[:, node]
        if number >= m:
            direction = (1.0 if number == shear else -1.0) if self.stick[node] else 0.0
            return [shear] if direction or slips else [], node, direction
        if self.closed[corners].sum() != self.closed[number]:  # others of the node are closed
            return [number], node, slips
        if self.closed[number]:
            return [shear, number] if self.stick[node] else [number], node, 0.0
        still = abs(passing[node]) <= AT_LIMIT * np.abs(passing).max()
        direction = 0.0 if still else float(np.sign(passing[node]))
        return [number] if direction else [number, shear], node, direction

    def exchange(self, number, passing):
        """Closes or opens a corner, or lets a node slip or stick; returns False where that is singular.

        Parameters
        ----------
        number : int
            Of a corner; corners + node, for slip forwards or stick; corners + n + node for slip back.
        passing : array (n,)
            Velocity of the obstacle over the surface.
        """
        pairs, node, direction = self.pivots_for(number, passing)
        shear = len(self.closed) + node
        turn = shear, self.of[:, node], (direction - self.slips[node]) * self.contact.friction
        if shear in pairs and self.stick[node] and self.last:
            # another node holds the obstacle then, that over which it moves least
            others = np.flatnonzero((self.slips != 0) & (self.slips != direction))
            numbers = others[np.argsort(np.abs(passing[others]))[:1]] + len(self.closed)
            if not any([self.exchange(int(other), passing) for other in numbers]):
                return False
        if direction:
            self.tableau.add_friction_coupling(*turn)
        done = [pair for pair in pairs if self.tableau.pivot(pair)]
        if done != pairs or not pairs:
            for pair in done:
                self.tableau.pivot(pair)
            if direction:
                self.tableau.add_friction_coupling(*turn[:2], -turn[2])
            return False
        if not direction:
            self.tableau.add_friction_coupling(*turn)
        self.slips[node] = direction
        return True

    def determinant(self, number, passing):
        pairs, node, direction = self.pivots_for(number, passing)
        T, row, corners = self.tableau.entries, len(self.closed) + node, self.of[:, node]
        found = T(np.reshape(pairs, (-1, 1)), np.array(pairs, int))
        if direction and direction != self.slips[node]:  # t = tau + f direction n from then on
            slope = T(number, row) if number < row - node else -T(corners[self.closed[corners]], row).sum()
            found = found + (direction - self.slips[node]) * self.contact.friction * slope
        return float(np.linalg.det(found))


class EventDrivenContact:
    """The contact along loads (P, Q), from first touch on."""

    def __init__(self, contact):
        n, m = contact.nodes, len(contact.gaps)
        self.contact, self.legs = contact, 0
        self.changes = []
        self._m, self._motions, self._nodes, self._u = (
            m,
            contact.motions,
            slice(m, m + n),
            np.array([m + n, m + n + 1]),
        )
        self._size, (self.x, self.y) = contact.size, np.zeros((2, m + n + 2))
        self.y[:m] = contact.gaps / self._size
        self._span = float(np.ptp(self.y[np.isfinite(self.y)]))
        self._terms = 100 * np.append(np.abs(contact.normal).max(axis=1) / self._size, np.ones(2 * n))
        self.first, self.work, self.dissipation = np.full(n, np.nan), 0.0, 0.0
        self._random = np.random.default_rng(0)
        self._seen, down = np.repeat((3.0, 0.0), (m, n)), self._motions[:m, 0]
        reached = np.isfinite(contact.gaps) & (down > 0)
        heights = np.where(reached, self.y[:m], np.inf) / np.where(reached, down, 1.0)
        corner = int(np.argmin(heights))
        self.x[m + n] = heights[corner]
        self.y[: m + n] -= heights[corner] * self._motions[:, 0]
        self.sets = ActiveSets(contact, [corner, m + corner % n, m + n, m + n + 1])

    def to(self, *target):
        """Follows loads (P, Q) on a straight way; returns the Moment at its end. Raises NotConverged if rates
        are not unique or there are none; `reached` says where.
        """
        end = np.array(target)
        try:
            self._follow(end, end - self.y[self._u])
        except NotConverged as failure:
            now = tuple(self.y[self._u].tolist())
            words = [", ".join(f"{each:.6g}" for each in pair) for pair in (now, target)]
            raise NotConverged(
                f"the history stopped at ({words[0]}) on the way to ({words[1]}): {failure}", reached=now
            ) from failure
        self.legs += 1
        return self.moment()

    def _follow(self, end, way):
        done = 0.0
        start, f = self.y[self._u], self.contact.friction
        if self.sets.flat:
            left = [f * P - np.sign(end[1]) * Q for P, Q in (start, end)]  # of what friction allows
            if left[1] < -AT_LIMIT * f * end[0]:
                share = left[0] / (left[0] - left[1])
                self._follow(start + share * way, share * way)
                raise NotConverged("all nodes slip, and the shear load cannot grow further")
        for _ in range(BUDGET * len(self.x)):
            counted()
            dx, dy, step, changing = self._settled(way, 1 - done)
            self._note(done)
            self._advance(dx, dy, step)
            if step == 1 - done:
                self.y[self._u] = end
                self._correct()
                return
            done += step
            for number in changing.tolist():
                self.sets.exchange(number, -dy[self._nodes])
        raise NotConverged("corners open and nodes slip to and fro without end")

    def _bound(self, x):
        return self.contact.friction * x[: self._m].reshape(self.sets.of.shape).sum(axis=0)

    def _rates(self, way):
        active, nodes, rest = self.sets.tableau.exchanged, self._nodes, np.zeros(len(self.x))
        rest[self._u] = way
        rates = self.sets.tableau.times(self._u, way)
        dx, dy = np.where(active, rates, rest), np.where(active, rest, rates)
        dx[nodes] += self.sets.slips * self._bound(dx)
        return dx, dy

    def evaluate_limits(self, way):
        """Rates of x and y; then values, rates of falling and flags of limits, of forces or gaps of corners,
        of bounds forwards or rates of slip, and of bounds backwards.
        """
        (dx, dy), m, nodes = self._rates(way), self._m, self._nodes
        closed, stick, slips = self.sets.closed, self.sets.stick, self.sets.slips
        last, slipping = self.sets.last, slips != 0
        bound, dbound = self._bound(self.x), self._bound(dx)
        up, down = (stick & (not last or np.any(slips == sign)) for sign in (-1, 1))
        t, dt, gap = self.x[nodes], dx[nodes], np.where(closed, self.x[:m], self.y[:m])
        forwards = np.where(up, bound - t, np.where(slipping, 0.0, np.inf))
        value = np.concatenate((gap, forwards, np.where(down, bound + t, np.inf)))
        rubs = np.where(slipping, slips * dy[nodes], dt - dbound)
        fall = np.concatenate((np.where(closed, -dx[:m], -dy[:m]), rubs, -dt - dbound))
        force, tiny = EPS_PIVOT * np.abs(dx[: nodes.stop]).max(), EPS_PIVOT * self.x[:m].max()
        forces = np.concatenate((closed, ~slipping, ~slipping))
        small, most = np.where(forces, 1.0, self._terms), np.full(len(value), tiny)
        most[:m][~closed] = EPS_PIVOT * self._span
        return dx, dy, value, np.where(fall > force * small, fall, 0.0), most

    def _settled(self, way, remaining):
        fewest, idle = np.inf, 0
        for _ in range(BUDGET * len(self.x)):
            dx, dy, value, fall, most = self.evaluate_limits(way)
            limit = value <= most
            passing, violated = -dy[self._nodes], np.flatnonzero(limit & (fall > 0))
            if not len(violated):
                self._require_unique(np.flatnonzero(limit), way, passing)
                steps = np.full(len(fall), remaining)
                np.divide(np.maximum(value, 0), fall, out=steps, where=fall > 0)
                step = float(steps.min())
                changing = np.flatnonzero((fall > 0) & (value - step * fall <= most))
                return dx, dy, step if step < remaining * (1 - EPS_PIVOT) else remaining, changing
            idle = 0 if len(violated) < fewest else idle + 1
            fewest = min(fewest, len(violated))
            if idle >= 3:  # the first one alone (Murty), and after many of them one by chance
                violated = violated[:1]
            if idle >= 50 + 3 * limit.sum():
                pool = violated if self._random.random() < 0.5 else np.flatnonzero(limit)
                violated, passing = self._random.choice(pool, 1), 0 * passing
            for each in violated:
                self.sets.exchange(int(each), passing)
        raise NotConverged(f"no rates were found; {UNIQUE}")

    def _require_unique(self, limit, way, passing):
        """NotConverged where states turn back or there are two ways on."""
        if self.sets.tableau.sign <= 0:
            raise NotConverged(f"the answer may not be unique, as states turn back; {UNIQUE}")
        if not self.contact.friction:
            return
        own, node = self.sets, (limit - self._m) % len(self.sets.slips)
        slipping = (limit >= self._m) & (own.slips[node] != 0)
        pivots = own.tableau.entries(*2 * [np.where(slipping, limit, 0)])
        pivots[~slipping] = [own.determinant(int(each), passing) for each in limit[~slipping]]
        for number in limit[pivots < -1e-8]:  # beyond rounding
            other = copy(self)
            other.sets = deepcopy(own)
            holds = other.sets.exchange(int(number), passing)
            *_, value, fall, most = other.evaluate_limits(way)
            if holds and not np.any((value <= most) & (fall > 0)):
                raise NotConverged(f"the answer is not unique, as there are several ways on; {UNIQUE}")

    def _advance(self, dx, dy, step):
        """Goes on; means over the step make work and dissipation exact."""
        nodes, u, m, size = self._nodes, self._u, self._m, self._size
        x, y = self.x + step / 2 * dx, self.y[u] + step / 2 * dy[u]
        self.work += step * size * float(y @ dx[u])
        if not self.contact.coupled:  # the gaps do not know what the shear does to them; its work they do
            self.work += step * float(dx[nodes] @ self.contact.cross @ x[:m])
        self.dissipation -= step * size * float((x[nodes] * dy[nodes])[self.sets.slips != 0].sum())
        self.x, self.y = self.x + step * dx, self.y + step * dy
        self._snap()

    def _snap(self):
        """Puts all that is at its limit there exactly."""
        closed, stick, slips = self.sets.closed, self.sets.stick, self.sets.slips
        self.x[: self._m][~closed] = self.y[: self._m][closed] = 0.0
        self.x[self._nodes] = np.where(stick, self.x[self._nodes], slips * self._bound(self.x))

    def _off(self):
        """The residual of (c)."""
        m, nodes = self._m, self._nodes
        moved = self.contact.moved(self.x[:m], self.x[nodes]) / self._size
        found = np.append(moved - self._motions @ self.x[self._u], self._motions.T @ self.x[: nodes.stop])
        found[:m] += self.contact.gaps / self._size
        there = np.isfinite(self.y)
        return np.where(there, found, 0.0) - np.where(there, self.y, 0.0)

    def _correct(self):
        off, active = self._off(), self.sets.tableau.exchanged
        fix = self.sets.tableau.times(active, off[active])
        self.x, self.y = self.x - np.where(active, fix, 0.0), self.y + np.where(active, 0.0, off - fix)
        self._snap()

    def _note(self, share):
        now = np.concatenate((3.0 + self.sets.closed, np.where(self.sets.stick, 2.0, self.sets.slips)))
        for i in np.flatnonzero(now != self._seen).tolist():
            self.changes.append(Change(self.legs, share, KINDS[int(now[i])], i - self._m * (i >= self._m)))
        new = np.isnan(self.first) & (now[self._nodes] != 0)
        self._seen, self.first[new] = now, -self.y[self._nodes][new]

    def moment(self):
        own, m, size, off = self.contact, self._m, self._size, self._off()
        n, t, bound = self.x[:m].copy(), self.x[self._nodes].copy(), self._bound(self.x)
        raised, displaced = np.split(own.moved(n, t), [m])
        across = t @ own.cross @ n
        energy = (n @ raised + t @ displaced + (0.0 if own.coupled else across)) / 2
        ways, gaps = -self.y[self._nodes], self.y[:m] + off[:m]
        short = np.where(self.sets.slips != 0, np.abs(np.abs(t) - bound), np.abs(t) - bound)
        forces = -n.min(), short.max(), np.abs(off[self._u]).max()
        lengths = np.where(self.sets.closed, np.abs(gaps), -gaps).max(), np.abs(off[self._nodes]).max()
        longest = max(np.abs(raised).max(), np.abs(displaced).max()) / size or 1.0
        (P, Q), (d, D) = self.y[self._u], size * self.x[self._u]
        return FrictionState(
            load=float(P),
            shear=float(Q),
            normal=n,
            gaps=self.y[:m] * size,
            tangential=t,
            slip=size * np.where(np.isnan(self.first), 0.0, ways - self.first),
            raised=raised,
            closed=self.sets.closed.copy(),
            stick=self.sets.stick.copy(),
            at_limit=(self.sets.stick | (self.sets.slips != 0))
            & (bound - np.abs(t) <= AT_LIMIT * bound.max()),
            iterations=len(self.changes),
            approach=float(d),
            offset=float(D),
            energy=float(energy),
            work=self.work,
            dissipation=self.dissipation,
            residual=float(max(0.0, max(forces) / (n.max() or 1.0), max(lengths) / longest)),
        )
