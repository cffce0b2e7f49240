"""Coulomb friction at the corners of any linear body: semismooth Newton, and histories from event to event.

A block's face carries one tangential force, as its corners slip together. With the pressures p of the
corners, their gaps g, the shear traction q, and the way ds of the obstacle over the surface since the last
state,

    p = max(0, p - rho g),    q = (q + rho ds, but between -b and b),    b = f sum max(0, p - rho g)

at each node (Alart and Curnier 1991). All of it is piecewise linear: Newton's method with the derivative of
the piece is an active set method, in which corners are open or closed, and nodes stick or slip one way or the
other.
"""

from dataclasses import dataclass, fields, replace
from functools import cached_property
from itertools import chain, combinations

import numpy as np
from scipy import sparse
from scipy.linalg.lapack import dgetrf, dgetrs
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import splu

from ..errors import NotConverged
from ..model.progress import counted
from .follower import UNIQUE, Change

MAX_ITERATIONS = 60
MAX_VISITS = 3  # of one active set, before it counts as a cycle
# of the largest pressure or length, below which a violated condition is rounding
ALIKE = 1e-9
# of a leg of the history, over which Newton finds what opens, sticks and slips next; then again over less
FIRST = (1e-6, 1e-8)
JUMP = 1e-7  # of the largest pressure, by which a piece may be off the state that it starts from
MANY = 6  # nodes that change at once, beyond which not all subsets of them are looked at
MOST_EVENTS = 60  # times the number of nodes, on one leg, before it counts as going astray
STICKS = 2  # in place of the direction of slip
UNSOLVED = 1e-6  # of a right-hand side that a direct solve leaves if the matrix is singular to rounding
SINGULAR = (
    "the equations are singular: is the body supported, psi where beta = 0 as well, and does something stick?"
)
# no pivoting: a stiffness is positive definite
SYMMETRIC = {"diag_pivot_thresh": 0.0, "options": {"SymmetricMode": True}}
AT_ONCE = 64  # right-hand sides of the body's factors: more take memory alone
FILLED = 0.05  # part of a matrix without zeros, from which on it is factorised as a dense one


@dataclass(frozen=True, eq=False)
class System:
    """A discrete linear body with m unknowns, its corners at n nodes, and an obstacle that moves by `shift`
    along e1 and by `approach` along -e2.

    Attributes
    ----------
    stiffness : matrix (m, m), sparse or dense, kept as CSR like those below
    forces : array (m,), of loads besides the contact
    normal : sequence of matrices (n, m), displacement of each corner along n from the body's unknowns
    tangential : matrix (n, m), displacement of the corners along the tangent (n2, -n1)
    dragged : matrix (n, m), displacement conjugate to the shear traction; without coupling it is not
        `tangential`
    gaps : array (corners, n), initial gaps (lengths), inf where a corner cannot touch
    normals : array (n, 2)
    weights : array (n,), lengths of the surface
    friction : float, coefficient of Coulomb
    rho : float, regularisation (stress per length)
    unseen : sequence of matrices (n, m), displacement of each corner along n that is left out of `normal`

    Examples
    --------
    >>> from microblock.corners import coulomb
    >>> spring = coulomb.System(
    ...     np.diag([2.0, 1.0]), np.zeros(2), (np.array([[1.0, 0.0]]),), np.array([[0.0, 1.0]]),
    ...     np.array([[0.0, 1.0]]), np.zeros((1, 1)), np.array([[0.0, 1.0]]), np.ones(1), 0.5, 1.0)
    >>> *_, last = coulomb.History(spring).follow([(1.0, 0.0), (1.0, 0.25)])
    >>> round(last.iterate.approach, 12), round(last.iterate.shift, 12)      # 1/2 and 0.25/1
    (0.5, 0.25)
    """

    stiffness: object
    forces: np.ndarray
    normal: tuple
    tangential: object
    dragged: object
    gaps: np.ndarray
    normals: np.ndarray
    weights: np.ndarray
    friction: float
    rho: float
    unseen: tuple = ()

    def __post_init__(self):
        for name in ("stiffness", "tangential", "dragged"):
            object.__setattr__(self, name, sparse.csr_matrix(getattr(self, name)))
        object.__setattr__(self, "normal", tuple(map(sparse.csr_matrix, self.normal)))

    def __getstate__(self):
        """What it was made of: factors do not travel, and are made anew."""
        return {each.name: getattr(self, each.name) for each in fields(self)}

    def uncoupled(self):
        """The system in which shear tractions do not act on the gaps: the fields of the pressures and those
        of the shear tractions have unknowns of their own.
        """
        empty = sparse.csr_matrix(self.tangential.shape)
        return replace(
            self,
            stiffness=sparse.block_diag((self.stiffness, self.stiffness)),
            forces=np.concatenate((self.forces, np.zeros_like(self.forces))),
            normal=tuple(sparse.hstack((each, empty)) for each in self.normal),
            tangential=sparse.hstack((self.tangential, self.tangential)),
            dragged=sparse.hstack((empty, self.dragged)),
            unseen=tuple(sparse.hstack((empty, each)) for each in self.normal),
        )

    def reduced(self):
        """The system of the contact's unknowns alone, the body's eliminated by factors of its stiffness.

        Raises
        ------
        NotConverged
            If the stiffness is singular: the body then needs the contact as support.
        """
        n = self.nodes
        initial = self.operators[1][:, : len(self.forces)] @ self.factors(self.forces)
        return Reduced(
            stiffness=np.zeros((0, 0)),
            forces=np.zeros(0),
            normal=tuple(np.zeros((n, 0)) for _ in self.normal),
            tangential=np.zeros((n, 0)),
            dragged=np.zeros((n, 0)),
            gaps=self.gaps + initial.reshape(self.gaps.shape),
            normals=self.normals,
            weights=self.weights,
            friction=self.friction,
            rho=self.rho,
            unseen=tuple(np.zeros((n, 0)) for _ in self.unseen),
            whole=self,
        )

    @cached_property
    def factors(self):
        """A function that solves with the stiffness."""
        try:
            solve = splu(self.stiffness.tocsc(), permc_spec="MMD_AT_PLUS_A", **SYMMETRIC).solve
        except RuntimeError as failure:
            raise NotConverged(SINGULAR) from failure
        trial = np.ones(len(self.forces))
        if not np.abs(self.stiffness @ solve(trial) - trial).max() <= UNSOLVED:
            raise NotConverged(SINGULAR)
        return solve

    def fields(self, values):
        """Unknowns of the body, array (m,), of values of all unknowns."""
        return values[self.parts[0]]

    @property
    def nodes(self):
        """Number of nodes."""
        return len(self.weights)

    @cached_property
    def parts(self):
        """Slices of the unknowns: those of the body, pressures (corner after corner), shear tractions,
        (approach, shift).
        """
        m, n, corners = len(self.forces), self.nodes, len(self.gaps)
        ends = np.cumsum([0, m, corners * n, n, 2])
        return [slice(*pair) for pair in zip(ends[:-1], ends[1:])]

    @cached_property
    def operators(self):
        """Matrices (CSR) on all unknowns: equilibrium of the body, gaps less initial ones, way of the
        obstacle over the surface, the loads (P, Q), and displacements along n that the gaps leave out.
        """
        n, corners = self.nodes, len(self.gaps)
        normals = [self.normals[:, [i]] for i in range(2)]
        tangents = normals[1], -normals[0]
        weights = sparse.diags(self.weights)
        pressed = sparse.vstack(self.normal).T @ sparse.block_diag([weights] * corners)
        body = [self.stiffness, pressed, -self.dragged.T @ weights]
        gaps = np.tile(np.hstack((-normals[1], normals[0])), (corners, 1))
        ways = np.hstack((-tangents[1], tangents[0]))
        share = [
            (np.tile(sign * each.T * self.weights, corners), -sign * other.T * self.weights)
            for sign, each, other in ((1, normals[1], tangents[1]), (-1, normals[0], tangents[0]))
        ]
        m, rest = len(self.forces), sparse.csr_matrix((corners * n, corners * n + n + 2))
        rows = (
            [[*body, sparse.csr_matrix((m, 2))]],
            [[-sparse.vstack(self.normal), sparse.csr_matrix((corners * n, corners * n + n)), gaps]],
            [[-self.tangential, sparse.csr_matrix((n, corners * n + n)), ways]],
            [[sparse.csr_matrix((1, m)), *pair, sparse.csr_matrix((1, 2))] for pair in share],
            [[sparse.vstack(self.unseen or self.normal) * bool(self.unseen), rest]],
        )
        return [sparse.csr_matrix(sparse.bmat(each)) for each in rows]


@dataclass(frozen=True, eq=False)
class Reduced(System):
    """A System without the unknowns of the body: they follow from pressures and shear tractions.

    Attributes
    ----------
    whole : System
    """

    whole: System | None = None

    @cached_property
    def operators(self):
        """As of a System, dense; the way of the obstacle counts from that of the loads."""
        whole = self.whole
        body, *others = whole.operators
        m = len(whole.forces)
        found = [sparse.csr_matrix((0, body.shape[1] - m))]
        for each in others:
            own, acting = each[:, m:].toarray(), body[:, m:].T
            for first in range(0, own.shape[0] if each[:, :m].nnz else 0, AT_ONCE):
                some = slice(first, first + AT_ONCE)
                own[some] -= (acting @ whole.factors(each[some, :m].T.toarray())).T
            found.append(sparse.csr_matrix(own))
        return found

    def fields(self, values):
        """Unknowns of the body, array (m,)."""
        whole = self.whole
        right = whole.forces - whole.operators[0][:, len(whole.forces) :] @ values
        found = whole.factors(right)
        return found + whole.factors(right - whole.stiffness @ found)


@dataclass(frozen=True, eq=False)
class Iterate:
    """Values of all unknowns of a System, and what follows from them."""

    system: System
    values: np.ndarray

    @property
    def fields(self):
        """Unknowns of the body, array (m,)."""
        return self.system.fields(self.values)

    @property
    def pressures(self):
        """Array (corners, n)."""
        return self.values[self.system.parts[1]].reshape(len(self.system.gaps), -1)

    @property
    def shear(self):
        """Shear traction q, array (n,)."""
        return self.values[self.system.parts[2]]

    @property
    def approach(self):
        """Of the obstacle along -e2 (length)."""
        return float(self.values[-2])

    @property
    def shift(self):
        """Of the obstacle along e1 (length)."""
        return float(self.values[-1])

    @property
    def gaps(self):
        """Gaps, array (corners, n); inf where a corner cannot touch."""
        changes = (self.system.operators[1] @ self.values).reshape(self.system.gaps.shape)
        return self.system.gaps + changes

    @property
    def way(self):
        """How far the obstacle has moved over the surface along its tangent, array (n,)."""
        return self.system.operators[2] @ self.values

    @property
    def loads(self):
        """Normal and shear force per thickness, array (2,)."""
        return self.system.operators[3] @ self.values


@dataclass(frozen=True, eq=False)
class Sets:
    """Which corners are closed, boolean array (corners, n), and which nodes slip: array (n,) of 1 where the
    obstacle drags the surface along its tangent, -1 where against it, 0 where it sticks or is open.
    """

    closed: np.ndarray
    slips: np.ndarray

    @property
    def stick(self):
        """Closed nodes that do not slip, boolean array (n,)."""
        return self.closed.any(axis=0) & (self.slips == 0)

    @property
    def key(self):
        """The sets as bytes."""
        return self.closed.tobytes() + self.slips.tobytes()


class FrictionNewton:
    """Semismooth Newton of a System for one step from a state, loads or motions of the obstacle given.

    Parameters
    ----------
    system : System
    prescribed : pair of bool, whether approach and shift are given in place of the loads P and Q
    """

    def __init__(self, system, prescribed=(False, False)):
        self.system, self.prescribed = system, prescribed

    def augmented(self, now, before):
        """(p - rho g, q + rho ds) of an iterate `now` on the way from the state `before`; pressures are -inf
        where a corner cannot touch.
        """
        rho = self.system.rho
        return now.pressures - rho * now.gaps, now.shear + rho * (now.way - before.way)

    def sets(self, now, before):
        """The Sets to which an iterate belongs."""
        pressures, shear = self.augmented(now, before)
        closed = pressures > 0
        bound = self.system.friction * np.where(closed, pressures, 0).sum(axis=0)
        slips = np.where(np.abs(shear) > bound, np.sign(shear), 0) * closed.any(axis=0)
        return Sets(closed, slips.astype(int))

    def _carrying(self, sets, now, before):
        """Sets in which a corner is closed if P is given, and a node sticks if Q is, to carry them."""
        pressures, shear = self.augmented(now, before)
        closed, slips = sets.closed, sets.slips.copy()
        if not closed.any() and not self.prescribed[0]:
            closed = pressures == pressures.max()
        touching = closed.any(axis=0)
        if not np.any(touching & (slips == 0)) and not self.prescribed[1]:
            bound = self.system.friction * np.where(closed, pressures, 0).sum(axis=0)
            beyond = np.where(touching, np.abs(shear) - bound, np.inf)
            slips[beyond == beyond.min()] = 0
        return Sets(closed, slips)

    def _handed_over(self, sets, now, before):
        """Sets in which the last nodes that stick, beyond their bound, slip, and instead the first of those
        sticks that slip the other way, as the obstacle turns.
        """
        direction = np.sign((now.shear * sets.stick).sum())
        others = np.flatnonzero(sets.slips == -direction)
        if not len(others):
            raise NotConverged("no node can stick")
        ways, slips = np.abs(now.way - before.way)[others], np.where(sets.stick, direction, sets.slips)
        slips[others[ways <= ways.min() * (1 + ALIKE)]] = 0
        return Sets(sets.closed, slips.astype(int))

    def residual(self, now, before, level):
        """Residual of all equations, array: equilibrium, pressures, shear tractions, loads or motions."""
        system = self.system
        body, loads = system.operators[0], system.operators[3]
        pressures, shear = self.augmented(now, before)
        pressed = np.where(pressures > 0, pressures, 0.0)
        bound = system.friction * pressed.sum(axis=0)
        given = np.where(self.prescribed, now.values[system.parts[3]], loads @ now.values)
        return np.concatenate(
            (
                body @ now.values - system.forces,
                (now.pressures - pressed).ravel(),
                now.shear - np.clip(shear, -bound, bound),
                given - level,
            )
        )

    def equations(self, sets):
        """What holds on a piece, sparse: equilibrium, p = 0 or g = 0 of corners, no way or |q| = f p of
        nodes, loads or motions. It is the derivative of the residual but for corners' rows in those of nodes.

        The determinant is positive without friction; where it is not, states turn back while loads grow.
        """
        system, rho = self.system, self.system.rho
        body, gaps, way, loads, _ = system.operators
        one = sparse.identity(body.shape[1], format="csr")
        p, q, motions = (one[part] for part in system.parts[1:])
        closed, stick, slips = (
            sparse.diags(each.ravel().astype(float)) for each in (sets.closed, sets.stick, sets.slips)
        )
        sums = sparse.hstack([sparse.identity(system.nodes)] * len(system.gaps))
        corners = p - closed @ (p - rho * gaps)
        nodes = q - stick @ (q + rho * way) - system.friction * slips @ sums @ p
        given = [(motions if self.prescribed[i] else loads)[[i]] for i in range(2)]
        return sparse.vstack((body, corners, nodes, *given), format="csr")

    def solve(self, level, before, sets, single=False):
        """The Iterate at a level, the Sets it belongs to, and their Piece; from the first guess `sets`, all
        that is violated changed at once, or with `single` the most violated alone.

        Raises
        ------
        NotConverged
            If the sets cycle, or their equations are singular.
        """
        visits = {}
        most = MAX_ITERATIONS + 2 * self.system.nodes * single
        for _ in range(most):
            counted()
            on = Piece(self, before, sets)
            now = on.at(level)
            found = self._carrying(self.sets(now, before), now, before)
            if found.key == sets.key:
                if self._violation(now, before, level) <= ALIKE:
                    return now, sets, on
                found = self._handed_over(sets, now, before)
            visits[sets.key] = visits.get(sets.key, 0) + 1
            if visits[sets.key] >= MAX_VISITS:
                if self._violation(now, before, level) <= ALIKE:
                    return now, sets, on
                break
            sets = self._one_changed(sets, found, now, before) if single else found
        raise NotConverged(
            f"the sets of closed and of slipping nodes cycle; {UNIQUE}", iterations=sum(visits.values())
        )

    def _one_changed(self, sets, found, now, before):
        """Sets in which of all changes to those `found` only that of the largest violation is made."""
        pressures, shear = self.augmented(now, before)
        bound = self.system.friction * np.where(sets.closed, pressures, 0).sum(axis=0)
        stays = sets.closed.any(axis=0) & found.closed.any(axis=0)
        corners = np.where(sets.closed != found.closed, np.abs(pressures), 0)
        nodes = np.where((sets.slips != found.slips) & stays, np.abs(np.abs(shear) - bound), 0)
        closed, slips = sets.closed.copy(), sets.slips.copy()
        if corners.max() >= nodes.max():
            place = np.unravel_index(np.argmax(corners), corners.shape)
            closed[place] = found.closed[place]
        else:
            place = np.argmax(nodes)
            slips[place] = found.slips[place]
        if not np.any(closed.any(axis=0) & (slips == 0)):
            slips = np.where(found.slips == 0, 0, slips)  # one has to stick if the shear load is given
        return Sets(closed, np.where(closed.any(axis=0), slips, 0))

    def _violation(self, now, before, level):
        """The largest violated condition of contact and friction, over the largest pressure."""
        _, p, q, _ = self.system.parts
        residual = self.residual(now, before, level)
        return float(np.abs(residual[p.start : q.stop]).max() / max(np.abs(now.pressures).max(), 1e-300))


class Piece:
    """The equations of a FrictionNewton on fixed Sets, from a state `before` on: affine in the level.

    Attributes
    ----------
    sign : float, of the determinant
    """

    def __init__(self, newton, before, sets):
        self._newton, self._before, self._sets = newton, before, sets
        self._matrix = newton.equations(sets)
        self._right = self._constant(sets)
        self._solve, self.sign = _factorised(self._matrix)

    def _constant(self, sets):
        """Right-hand side for level 0, array."""
        system, rho = self._newton.system, self._newton.system.rho
        first = np.where(sets.closed, -rho * np.where(sets.closed, system.gaps, 0), 0)
        shear = -rho * sets.stick * self._before.way
        return np.concatenate((system.forces, first.ravel(), shear, np.zeros(2)))

    def opposite(self, other, most=None):
        """Yields Sets that have some nodes, `most` of them or any number, as in other Sets, wherever the
        determinant of their piece has the opposite sign.
        """
        system, rows = self._newton.system, self._newton.equations(other)
        first, differ = system.parts[1].start, np.unique((rows != self._matrix).nonzero()[0])
        columns = [self._solve(np.eye(1, rows.shape[1], number)[0]) for number in differ]
        exchanged = rows[differ] @ np.transpose(columns) if len(differ) else np.zeros((0, 0))
        own = (differ - first) % system.nodes
        nodes = np.unique(own)
        for order in range(1, (most or len(nodes)) + 1):
            for some in map(list, combinations(nodes, order)):
                chosen = np.isin(own, some)
                if np.linalg.det(exchanged[np.ix_(chosen, chosen)]) < 0:
                    closed, slips = self._sets.closed.copy(), self._sets.slips.copy()
                    closed[:, some], slips[some] = other.closed[:, some], other.slips[some]
                    yield Sets(closed, slips)

    def at(self, level):
        """The Iterate at a level."""
        right = self._right.copy()
        right[-2:] = level
        values = self._solve(right)
        left = right - self._matrix @ values
        if not np.linalg.norm(left) <= UNSOLVED * np.linalg.norm(right):
            raise NotConverged(SINGULAR)
        return Iterate(self._newton.system, values + self._solve(left))


def _factorised(matrix):
    """(function that solves with a sparse matrix, sign of its determinant), factorised as a dense one where
    it is nearly that.
    """
    try:
        if matrix.nnz > FILLED * np.prod(matrix.shape):
            triangles, swaps, singular = dgetrf(matrix.toarray())
            if singular:
                raise NotConverged(SINGULAR)
            odd = np.count_nonzero(swaps != np.arange(len(swaps))) % 2
            return lambda right: dgetrs(triangles, swaps, right)[0], _sign(triangles.diagonal(), odd)
        factors = splu(matrix.tocsc())
        odd = _odd(factors.perm_r) != _odd(factors.perm_c)
        return factors.solve, _sign(factors.U.diagonal(), odd)
    except RuntimeError as failure:  # SuperLU's word for a singular matrix
        raise NotConverged(SINGULAR) from failure


def _sign(diagonal, odd):
    """Sign of the product of a diagonal, turned where permutations are odd."""
    return float(np.prod(np.sign(diagonal))) * (-1) ** odd


def _odd(permutation):
    """Whether a permutation is odd: it has as many transpositions as places beyond one for each cycle."""
    size = len(permutation)
    moved = sparse.csr_matrix((np.ones(size), permutation, np.arange(size + 1)), (size, size))
    return bool((size - connected_components(moved, return_labels=False)) % 2)


@dataclass(frozen=True, eq=False)
class Reached:
    """A state of a history.

    Attributes
    ----------
    level : array (2,), the pair of loads or motions
    iterate : Iterate
    sets, ahead : Sets, on the way to the state, and those to be tried beyond
    touched : array (n,), way of the obstacle over the surface when the node first closed, NaN before
    work, dissipation : floats, per thickness, of the obstacle on the body and of friction since the
        beginning; without coupling the work has that of the pressures on what shear tractions do to the gaps
    changes : list of friction.Change, since the beginning
    """

    level: np.ndarray
    iterate: Iterate
    sets: Sets
    ahead: Sets
    touched: np.ndarray
    work: float
    dissipation: float
    changes: list

    @property
    def residual(self):
        """The largest violated condition of contact and friction, over the largest pressure."""
        now, system = self.iterate, self.iterate.system
        pressed = np.maximum(0, now.pressures - system.rho * now.gaps)
        bound = system.friction * pressed.sum(axis=0)
        wrong = (
            np.abs(now.pressures - pressed).max(),
            np.abs(now.shear - np.clip(now.shear, -bound, bound)).max(),
        )
        return float(max(wrong) / max(now.pressures.max(), 1e-300))

    @property
    def slip(self):
        """How far the obstacle has moved over the surface since first contact, array (n,); 0 before."""
        return np.where(np.isnan(self.touched), 0.0, self.iterate.way - np.nan_to_num(self.touched))


class History:
    """States of a System at pairs of loads or motions, exact on the straight lines between them.

    From a state, Newton's method finds over a short first part of the way what opens, closes, sticks and
    slips; on these sets the state is affine in the level, up to where a corner or a node leaves its set.
    """

    def __init__(self, system, prescribed=(False, False)):
        self.system, self.newton = system, FrictionNewton(system, prescribed)

    def start(self):
        """The Reached state of the unloaded body; touched, if loads are given."""
        system = self.system
        values = np.zeros(system.operators[0].shape[1])
        if np.any(system.forces):
            values[system.parts[0]] = _factorised(system.stiffness)[0](system.forces)
        first = Iterate(system, values)
        closed = np.zeros(system.gaps.shape, bool)
        if not self.newton.prescribed[0]:
            ahead = first.gaps / system.normals[:, 1]
            values[-2] = ahead.min()
            closed = ahead <= ahead.min() + ALIKE * np.ptp(ahead[np.isfinite(ahead)])
        touched = np.full(system.nodes, np.nan)
        nowhere = np.zeros(system.nodes, int)
        sets, ahead = Sets(np.zeros_like(closed), nowhere), Sets(closed, nowhere)
        return Reached(np.zeros(2), first, sets, ahead, touched, 0.0, 0.0, [])

    def follow(self, levels):
        """Yields the Reached state at each of the levels, pairs of numbers, in their order.

        Raises
        ------
        NotConverged
            Where no state follows, as when all nodes slip while the shear load is given; it says where.
        """
        state = self.start()
        for number, level in enumerate(levels):
            state = self._leg(state, number, np.asarray(level, float))
            yield state

    def _leg(self, state, number, target):
        begin = state.level
        length, done, events = target - begin, 0.0, 0
        while done < 1 and np.any(length):
            try:
                state, done = self._piece(state, number, begin, length, done)
            except NotConverged as failure:
                raise self._lost(state, target, failure) from failure
            events += 1
            if events > MOST_EVENTS * max(self.system.nodes, 5):
                raise self._lost(state, target, "corners open and nodes slip to and fro without end")
        return state

    def _lost(self, state, target, why):
        pair = "({:g}, {:g})".format
        now = state.iterate
        limit = self.system.friction * now.loads[0]
        limited = not self.newton.prescribed[1] and abs(now.loads[1]) >= limit * (1 - ALIKE)
        hint = "; all nodes slip, and the shear load cannot grow further" if limited else ""
        return NotConverged(
            f"the history stopped at {pair(*state.level)} on the way to {pair(*target)}: {why}{hint}",
            reached=tuple(float(one) for one in state.level),
            iterations=getattr(why, "iterations", 0) or 0,
        )

    def _piece(self, state, number, begin, length, done):
        """The state at the next change or at the end of the leg, and the part of the leg that is done."""
        for short in FIRST:
            first = min(1.0, done + short)
            near, sets, on = self._newton_from(state, begin + first * length)
            if self._goes_on(state, near, on):
                break
        else:
            raise NotConverged(f"the state jumps; {UNIQUE}")
        self._require_unique(state, begin + first * length, sets, on)
        now, part, ahead = near, 1.0, sets
        if first < 1:
            far = on.at(begin + length)
            part, ahead = _next_change(sets, near, far, self.system.friction)
            now = Iterate(self.system, near.values + part * (far.values - near.values))
            part = first + part * (1 - first)
        changes = _changes(state.sets, sets, number, done)
        return self._after(state, now, begin + part * length, sets, ahead, changes), part

    def _goes_on(self, state, near, on):
        """Whether a Piece starts from a state, and not only from one near it, with an Iterate on the way."""
        contact = slice(self.system.parts[1].start, self.system.parts[2].stop)
        apart = (on.at(state.level).values - state.iterate.values)[contact]
        return np.abs(apart).max() <= JUMP * np.abs(near.values[contact]).max()

    def _require_unique(self, state, level, sets, on):
        """NotConverged if the Piece on new Sets turns back, or a state at the level is on another that does,
        with some nodes as before, or with one that sticks in place of slipping.
        """
        old = state.sets
        if not old.closed.any() and not self.newton.prescribed[0]:  # loads: one node carries the first ones
            one = np.zeros_like(sets.closed)
            one.flat[np.argmax(state.ahead.closed)] = True
            old = Sets(one, np.zeros_like(sets.slips))
        stuck = Sets(sets.closed, np.zeros_like(sets.slips))
        changed = np.any(old.closed != sets.closed, axis=0) | (old.slips != sets.slips)
        others = on.opposite(old, None if np.count_nonzero(changed) <= MANY else 2), on.opposite(stuck, 1)
        if on.sign <= 0 or any(self._is_state(one, state, level) for one in chain(*others)):
            raise NotConverged(f"the answer is not unique; {UNIQUE}")

    def _is_state(self, sets, state, level):
        """Whether a state follows on these Sets."""
        try:
            now = Piece(self.newton, state.iterate, sets).at(level)
        except NotConverged:
            return False
        return self.newton._violation(now, state.iterate, level) <= ALIKE

    def _newton_from(self, state, level):
        """Newton from the sets of a state; where that fails from all closed nodes sticking, then change by
        change.
        """
        stuck = Sets(state.ahead.closed, np.zeros(self.system.nodes, int))
        for single in (False, True):
            for sets in (state.ahead, stuck):
                try:
                    return self.newton.solve(level, state.iterate, sets, single)
                except NotConverged as failure:
                    last = failure
        raise last

    def _after(self, state, now, level, sets, ahead, changes):
        before = state.iterate
        way, mean = now.way - before.way, (now.shear + before.shear) / 2
        slipped = np.where(sets.slips != 0, self.system.weights * mean * way, 0.0)
        motion = now.values - before.values
        work = (now.loads + before.loads) @ motion[-2:] / 2
        # what a system without coupling leaves out of the gaps, the pressures do all the same
        pressed = (now.pressures + before.pressures) * self.system.weights / 2
        work -= pressed.ravel() @ (self.system.operators[4] @ motion)
        new = np.isnan(state.touched) & sets.closed.any(axis=0)
        return Reached(
            level,
            now,
            sets,
            ahead,
            np.where(new, before.way, state.touched),
            state.work + float(work),
            state.dissipation + float(slipped.sum()),
            state.changes + changes,
        )


def _next_change(sets, near, far, friction):
    """(part of the way from `near` to `far`, Sets to be tried beyond) of the first change between two
    iterates of the same sets.
    """
    stress = max(np.abs(far.pressures).max(), np.abs(near.pressures).max(), 1e-300)
    length = max(np.abs(far.values[-2:]).max(), np.abs(near.values[-2:]).max(), 1e-300)
    bounds = [friction * one.pressures.sum(axis=0) for one in (near, far)]
    conditions = (
        (sets.closed, near.pressures, far.pressures, stress),
        (~sets.closed & np.isfinite(near.gaps), near.gaps, far.gaps, length),
        (sets.stick, bounds[0] - near.shear, bounds[1] - far.shear, stress),
        (sets.stick, bounds[0] + near.shear, bounds[1] + far.shear, stress),
    )
    parts = []
    for members, start, end, scale in conditions:
        violated = members & (np.where(members, end, 0) < -ALIKE * scale)
        start, end = np.where(violated, np.maximum(start, 0), 2), np.where(violated, end, 1)
        parts.append(start / (start - end))  # 2 where not violated
    part = min(one.min() for one in parts)
    if part > 1:
        return 1.0, sets
    opens, closes, forwards, backwards = (one <= part * (1 + ALIKE) for one in parts)
    closed = (sets.closed | closes) & ~opens
    slips = sets.slips + forwards.astype(int) - backwards
    return part, Sets(closed, np.where(closed.any(axis=0), slips, 0))


def _changes(before, after, leg, share):
    """The Changes from Sets to others at a share of a leg."""
    found = [
        Change(leg, share, "close" if after.closed.flat[corner] else "open", int(corner))
        for corner in np.flatnonzero(before.closed != after.closed)
    ]
    names = {0: "leave", STICKS: "stick", 1: "slip", -1: "slip"}
    old, new = (
        np.where(sets.closed.any(axis=0), np.where(sets.slips, sets.slips, STICKS), 0)
        for sets in (before, after)
    )
    return found + [
        Change(leg, share, names[int(new[node])], int(node)) for node in np.flatnonzero(old != new)
    ]
