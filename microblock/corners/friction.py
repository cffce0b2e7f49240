"""Frictional contact on a compliance, followed through a history of loads from event to event.

Corner forces n >= 0 and tangential forces t on cells leave gaps g and displacements s,

    g = g0 - d + H n + C^T t,     s = C n + T t,     |t_i| <= f (sum of n on cell i),

d the approach and D the tangential displacement of the obstacle. A cell sticks while D - s_i does not change;
it slips while |t_i| = f n_i, and then D - s_i changes in the direction of t_i. Shear that drags the surface
along is positive. Uncoupled, C^T t is left out of the gaps.

As long as no corner opens or closes and no cell begins or ends to slip everything is linear in the load. So
the path is followed exactly, piece by piece: on each the rates solve one linear system, and the first sign
that changes ends it. There the rates for what stands at a limit are found by principal pivoting: all violated
are exchanged at once, and if that brings no fewer of them the first one alone (Murty), which ends where the
solution is unique. No step is chosen, and work = energy + dissipation holds to rounding.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.blas import dger

from ..errors import NotConverged
from ..model.types import Array, Flags

Numbers = NDArray[np.integer[Any]]

ROUNDING = 1e-12  # of the largest value or rate: below it a sign means nothing
AT_LIMIT = 1e-9  # of the largest bound: a cell that is so near to its own slips or begins to
PATIENCE = 3  # exchanges of all violated at once without fewer of them, before single ones
REFRESH = 150  # updates of the inverse before it is computed anew
ROOM = 64  # rows that the inverse may grow by before it is copied
GAP = 32  # numbers of a matrix that are not worth a cut
MANY = 20  # exchanges at once, from which the inverse is computed anew
PIVOTS = 20  # per unknown at one load, before giving up
UNIQUE = "the friction may be too large for a unique answer: try a smaller one, or coupled=False"


@dataclass(frozen=True, eq=False)
class FrictionalContact:
    """Compliances of corners and cells.

    Attributes
    ----------
    normal : array (corners n, corners n)
        H: gaps from corner forces, corner by corner (length per force); symmetric.
    cross : array (n, corners n)
        C: tangential displacements from corner forces.
    tangential : array (n, n)
        T: tangential displacements from tangential forces; symmetric.
    gaps : array (corners n,)
        Initial gaps (lengths), inf where a corner cannot touch.
    friction : float
    coupled : bool
        Whether tangential forces act on gaps.
    """

    normal: Array
    cross: Array
    tangential: Array
    gaps: Array
    friction: float
    coupled: bool = True

    @property
    def cells(self) -> int:
        """Number of cells."""
        return len(self.tangential)


@dataclass(frozen=True, eq=False)
class Moment:
    """The contact at one pair of loads.

    Attributes
    ----------
    load, shear : float
        P and Q (force).
    normal, gaps : arrays (corners n,)
        Corner forces and gaps.
    tangential, slip : arrays (n,)
        Forces on the cells, and D - s since first contact (length); 0 where there was none.
    closed : boolean array (corners n,)
    stick, at_limit : boolean arrays (n,)
        Cells that stick, and cells whose shear force is as large as friction allows.
    raised : array (corners n,)
        What forces have added to the gaps (lengths).
    pieces : int
        Changes so far.
    approach, offset : float
        d and D (length).
    energy, work, dissipation : float
    residual : float
        The largest violated condition of contact, friction and loads over the largest force, and of gaps and
        slip over the largest displacement: these are computed anew, as those of the path are sums.
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
    pieces: int
    approach: float
    offset: float
    energy: float
    work: float
    dissipation: float
    residual: float


@dataclass(frozen=True)
class Change:
    """A corner that closes or opens, or a cell that begins to slip or to stick, at a share of a leg."""

    leg: int
    share: float
    kind: str
    index: int


@dataclass(frozen=True, eq=False)
class _Rates:
    """Rates over the way to the next pair: of n, t, d, D, gaps, and of D - s."""

    n: Array
    t: Array
    d: float
    D: float
    g: Array
    v: Array


def _spans(flags: Flags) -> list[slice]:
    """Slices that hold all that is flagged, and no long stretch that is not."""
    numbers = np.flatnonzero(flags)
    ends = np.flatnonzero(np.diff(numbers) > GAP)
    firsts, lasts = np.append(numbers[:1], numbers[ends + 1]), np.append(numbers[ends], numbers[-1:])
    return [slice(first, last + 1) for first, last in zip(firsts.tolist(), lasts.tolist())]


class FrictionPath:
    """The contact from (0, 0) on; `to` follows the loads to the next pair.

    Parameters
    ----------
    contact : FrictionalContact

    Attributes
    ----------
    changes : list of Change
    """

    def __init__(self, contact: FrictionalContact) -> None:
        n, m = contact.cells, len(contact.gaps)
        self.contact, self.legs = contact, 0
        self.changes: list[Change] = []
        self._m, self._cell = m, np.tile(np.arange(n), m // n)
        self._size = float(np.abs(np.diag(contact.tangential)).max())
        self._matrix = self._assemble()
        self.P = self.Q = self.work = self.dissipation = 0.0
        self.n, self.t, self.sigma = np.zeros(m), np.zeros(n), np.zeros(n)
        lowest = float(contact.gaps.min())
        self.d, self.D = lowest, 0.0
        self.g, self.r = contact.gaps - lowest, np.zeros(n)
        self.first = np.full(n, np.nan)
        self.closed, self.stick = np.zeros(m, bool), np.zeros(n, bool)
        self._sliding = False
        corner = int(np.argmin(contact.gaps))
        self.closed[corner] = self.stick[self._cell[corner]] = True
        self._note(0.0, "stick", int(self._cell[corner]))
        self.first[self._cell[corner]] = 0.0
        self._rebuild()

    def _assemble(self) -> Array:
        """The equations g - d, s - D, sum of n, sum of t over n, t, d, D; lengths over the size of T."""
        own, n = self.contact, self.contact.cells
        m = self._m
        matrix = np.zeros((m + n + 2, m + n + 2))
        matrix[:m, :m], matrix[m:-2, :m] = own.normal, own.cross
        matrix[m:-2, m:-2] = own.tangential
        if own.coupled:
            matrix[:m, m:-2] = own.cross.T
        matrix /= self._size
        matrix[:m, -2] = matrix[m:-2, -1] = -1
        matrix[-2, :m] = matrix[-1, m:-2] = 1
        return matrix

    def _columns(self, rows: Array, numbers: Array) -> Array:
        """The matrix with t = tau + f sigma n in place of t."""
        found = self._matrix[np.ix_(rows, numbers)]
        corner = np.flatnonzero(numbers < self._m)
        cells = self._cell[numbers[corner]]
        slipping = self.sigma[cells] != 0
        corner, cells = corner[slipping], cells[slipping]
        share = self.contact.friction * self.sigma[cells]
        found[:, corner] += self._matrix[np.ix_(rows, self._m + cells)] * share
        return found

    def _rebuild(self) -> None:
        """The inverse of the active equations, with room for more."""
        n = self._m + self.contact.cells
        ends = [n] if self._sliding else [n, n + 1]
        active = [*np.flatnonzero(self.closed), *(self._m + np.flatnonzero(self.stick)), *ends]
        self._active = np.array(active, int)
        count = len(active)
        self._inverse = np.zeros((count + ROOM, count + ROOM), order="F")
        try:
            self._inverse[:count, :count] = np.linalg.inv(self._columns(self._active, self._active))
        except np.linalg.LinAlgError as failure:
            raise NotConverged(f"the rates of the contact are not unique; {UNIQUE}") from failure
        self._updates = 0

    def _insert(self, number: int) -> None:
        count, new = len(self._active), np.array([number])
        if count == len(self._inverse):
            wider = np.zeros((count + ROOM, count + ROOM), order="F")
            wider[:count, :count] = self._inverse
            self._inverse = wider
        v, w = np.zeros((2, len(self._inverse)))
        v[:count] = self._columns(self._active, new)[:, 0]
        w[:count] = self._columns(new, self._active)[0]
        v, column = self._inverse @ v, v
        w = w @ self._inverse
        pivot = float(self._columns(new, new)[0, 0] - w @ column)
        self._require_positive(pivot)
        v[count] = w[count] = -1.0
        self._inverse = dger(1 / pivot, v, w, a=self._inverse, overwrite_a=1)
        self._active = np.append(self._active, number)

    def _require_positive(self, pivot: float) -> None:
        if not pivot > 0:
            raise NotConverged(
                f"the answer may not be unique at loads P = {self.P:.6g}, Q = {self.Q:.6g}; {UNIQUE}"
            )

    def _remove(self, number: int) -> None:
        last = len(self._active) - 1
        swapped, kept = [int(np.flatnonzero(self._active == number)[0]), last], self._inverse
        for each in (kept, kept.T, self._active):
            each[swapped] = each[swapped[::-1]]
        column, row, pivot = kept[:, last].copy(), kept[last].copy(), float(kept[last, last])
        self._require_positive(pivot)
        self._inverse = dger(-1 / pivot, column, row, a=kept, overwrite_a=1)
        self._inverse[last] = self._inverse[:, last] = 0.0
        self._active = self._active[:last]

    def _shear_of(self, cell: int, share: float) -> None:
        """In the inverse, tau of a cell that sticks becomes tau + share n."""
        row = int(np.flatnonzero(self._active == self._m + cell)[0])
        corners = np.flatnonzero((self._active < self._m) & (self._cell[self._active % self._m] == cell))
        self._inverse[row] += share * self._inverse[corners].sum(axis=0)

    def to(self, load: float, shear: float) -> Moment:
        """Follows the loads straight to the pair (P, Q), and returns the contact there.

        Raises
        ------
        NotConverged
            If rates are not unique or not found.
        """
        f = self.contact.friction
        dP, dQ, remaining = load - self.P, shear - self.Q, 1.0
        limits = [
            abs(abs(q) - f * p) <= ROUNDING * f * max(load, self.P)
            for p, q in ((self.P, self.Q), (load, shear))
        ]
        sliding = all(limits) and self.P > 0 and self.Q * shear > 0
        self._begin(sliding, np.sign(shear))
        while remaining > 0:
            rates = self._settled(dP, dQ, 1 - remaining)
            step, event = self._next(rates, remaining)
            self._advance(rates, dP, dQ, step)
            remaining = remaining - step if event is not None else 0.0
            if event is not None:
                self._exchange(event, rates, 1 - remaining)
        self.P, self.Q, self.legs = load, shear, self.legs + 1
        return self._moment()

    def _begin(self, sliding: bool, direction: float) -> None:
        """Where all has slid, or begins to, the state of each cell in contact is set anew."""
        touching = self._touching()
        if sliding:
            self.stick[:] = False
            self.sigma = np.where(touching, direction, 0.0)
        elif self._sliding:
            self.stick, self.sigma = touching, np.zeros(len(touching))
        if sliding or self._sliding:
            self._sliding = sliding
            self._rebuild()

    def _touching(self) -> Flags:
        touching = np.asarray(self.closed.reshape(-1, self.contact.cells).any(axis=0))
        return touching

    def _sum(self, n: Array) -> Array:
        """Of corner forces that of each cell."""
        return n.reshape(-1, self.contact.cells).sum(axis=0)

    def _rates(self, dP: float, dQ: float) -> _Rates:
        own, m = self.contact, self._m
        x = np.zeros(len(self._matrix))
        loads = np.where(self._active == len(x) - 2, dP, 0.0) + np.where(self._active == len(x) - 1, dQ, 0.0)
        count = len(loads)
        for k in np.flatnonzero(loads):
            x[self._active] += self._inverse[:count, k] * loads[k]
        n = x[:m]
        t = x[m:-2] + own.friction * self.sigma * self._sum(n)
        touching = self._touching()
        asked = np.concatenate((~self.closed, ~self.stick))
        moved = self._moved(asked, np.concatenate((n, t)))
        d, D, s = x[-2], x[-1], moved[m:]
        if self._sliding:
            direction = self.sigma[touching][0]
            D = direction * float((direction * s[touching]).max())
        g = np.where(self.closed, 0.0, moved[:m] - d)
        v = np.where(asked[m:], D - s, 0.0)
        return _Rates(n, t, float(d) * self._size, float(D) * self._size, g * self._size, v * self._size)

    def _moved(self, asked: Flags, forces: Array) -> Array:
        """Gaps and displacements under forces where they are asked for, over the size of T."""
        found, matrix = np.zeros(len(forces)), self._matrix
        acting = _spans(forces != 0)
        for rows in _spans(asked):
            for columns in acting:
                found[rows] += matrix[rows, columns] @ forces[columns]
        return found

    def _scales(self, rates: _Rates) -> tuple[float, float]:
        """Rates of forces and of lengths below which a sign means nothing."""
        force = max(np.abs(rates.n).max(), np.abs(rates.t).max())
        return ROUNDING * force, 100 * ROUNDING * force * self._size

    def _limits(self, rates: _Rates) -> tuple[Array, Array, Array]:
        """(values, rates, tolerances) of all that must not be negative: forces of closed corners, gaps of
        open ones, the two bounds of cells that stick, slip rates of those that slip; numbered so.
        """
        f, inf = self.contact.friction, np.inf
        force, length = self._scales(rates)
        bound, dbound = f * self._sum(self.n), f * self._sum(rates.n)
        several = (
            np.count_nonzero(self.stick) > 1
        )  # where all others slip one way, the last holds the obstacle
        up, down = (self.stick & (several or np.any(self.sigma == sign)) for sign in (-1, 1))
        slipping = ~self.stick & (self.sigma != 0) & ~np.bool_(self._sliding)
        values = [
            np.where(self.closed, self.n, inf),
            np.where(self.closed, inf, self.g),
            np.where(up, bound - self.t, inf),
            np.where(down, bound + self.t, inf),
            np.where(slipping, 0.0, inf),
        ]
        grow = [rates.n, rates.g, dbound - rates.t, dbound + rates.t, self.sigma * rates.v]
        tolerances = [force, length, force, force, length]
        return (
            np.concatenate(values),
            np.concatenate(grow),
            np.concatenate([np.full(len(one), tolerance) for one, tolerance in zip(grow, tolerances)]),
        )

    def _next(self, rates: _Rates, remaining: float) -> tuple[float, Numbers | None]:
        """The way to the first event and its number, or all of what remains and None."""
        values, grow, tolerance = self._limits(rates)
        falling = np.flatnonzero((grow < -tolerance) & np.isfinite(values))
        steps = np.maximum(values[falling], 0) / -grow[falling]
        if not len(steps) or steps.min() >= remaining * (1 - ROUNDING):
            return remaining, None
        first = int(np.argmin(steps))
        return float(steps[first]), falling[first : first + 1]

    def _settled(self, dP: float, dQ: float, share: float) -> _Rates:
        """The rates, after exchanges of all that stands at a limit and would go beyond it."""
        fewest, patience = np.inf, PATIENCE
        for _ in range(PIVOTS * len(self._matrix)):
            rates = self._rates(dP, dQ)
            values, grow, tolerance = self._limits(rates)
            largest = np.abs(self.n).max(), np.abs(self.g[np.isfinite(self.g)]).max(initial=0.0)
            m, n = self._m, self.contact.cells
            tiny = ROUNDING * np.concatenate(
                (np.full(m, largest[0]), np.full(m, largest[1]), np.full(3 * n, largest[0]))
            )
            violated = np.flatnonzero((values <= tiny) & (grow < -tolerance))
            if not len(violated):
                return rates
            if len(violated) < fewest:
                fewest, patience = len(violated), PATIENCE
            else:
                patience -= 1
            chosen = violated if patience > 0 else violated[:1]
            self._exchange(chosen, rates, share)
        raise NotConverged(f"no rates were found at loads P = {self.P:.6g}, Q = {self.Q:.6g}; {UNIQUE}")

    def _exchange(self, numbers: Numbers, rates: _Rates, share: float) -> None:
        """Exchanges what is numbered as in `_limits`."""
        m, n, many = self._m, self.contact.cells, len(numbers) > MANY
        for number in map(int, numbers):
            if number < m:
                self._open(number, many, share)
                self._note(share, "open", number)
            elif number < 2 * m:
                self._close(number - m, rates.v, many, share)
                self._note(share, "close", number - m)
            elif number < 2 * m + 2 * n:
                second, cell = divmod(number - 2 * m, n)
                if self.stick[cell] and self._held_without(cell, 1 - 2 * second, rates.v, many, share):
                    self._slip(cell, 1.0 - 2 * second, many, share)
            elif self.sigma[number - 2 * m - 2 * n] != 0:
                self._hold(number - 2 * m - 2 * n, many, share)
        self._updates += len(numbers)
        if many or self._updates > REFRESH:
            self._rebuild()

    def _held_without(self, cell: int, direction: int, v: Array, many: bool, share: float) -> bool:
        """Whether another cell sticks when this one slips; the last one hands over to the first of those that
        slip the other way, for which the obstacle would turn.
        """
        if np.count_nonzero(self.stick) > 1:
            return True
        others = np.flatnonzero(self.sigma == -direction)
        if not len(others):
            return False
        self._hold(int(others[np.argmin(np.abs(v[others]))]), many, share)
        return True

    def _note(self, share: float, kind: str, index: int) -> None:
        self.changes.append(Change(self.legs, share, kind, index))

    def _open(self, corner: int, many: bool, share: float) -> None:
        cell = int(self._cell[corner])
        last = np.count_nonzero(self.closed.reshape(-1, self.contact.cells)[:, cell]) == 1
        if last and self.stick[cell]:
            if np.count_nonzero(self.stick) == 1 and not self._sliding:
                others = np.where(np.arange(self.contact.cells) == cell, 0.0, self._sum(self.n))
                self._hold(int(np.argmax(others)), many, share)
            self.stick[cell] = False
            if not many:
                self._remove(self._m + cell)
        self.closed[corner], self.n[corner], self.g[corner] = False, 0.0, 0.0
        if not many:
            self._remove(corner)
        if last:
            self.sigma[cell] = self.t[cell] = 0.0
            self._note(share, "leave", cell)

    def _close(self, corner: int, v: Array, many: bool, share: float) -> None:
        """A corner touches; with the first of its cell the cell slips as the obstacle passes, or sticks."""
        cell = int(self._cell[corner])
        touched = bool(self._touching()[cell])
        self.closed[corner], self.g[corner] = True, 0.0
        if not touched:
            if np.isnan(self.first[cell]):
                self.first[cell] = self.r[cell]
            still = abs(v[cell]) <= ROUNDING * 100 * np.abs(v).max()
            self.sigma[cell] = self._sliding_sign() if self._sliding else 0.0 if still else np.sign(v[cell])
        if not many:
            self._insert(corner)
        if not touched and self.sigma[cell] == 0:
            self.stick[cell] = True
            if not many:
                self._insert(self._m + cell)
        if not touched:
            self._note(share, "stick" if self.stick[cell] else "slip", cell)

    def _sliding_sign(self) -> float:
        return float(np.sign(self.Q))

    def _slip(self, cell: int, sigma: float, many: bool, share: float) -> None:
        self._note(share, "slip", cell)
        self.stick[cell] = False
        if not many:
            self._shear_of(cell, -self.contact.friction * sigma)
            self._remove(self._m + cell)
        self.sigma[cell] = sigma

    def _hold(self, cell: int, many: bool, share: float) -> None:
        self._note(share, "stick", cell)
        sigma = float(self.sigma[cell])
        self.stick[cell] = True
        if not many:
            self._insert(self._m + cell)
            self._shear_of(cell, self.contact.friction * sigma)
        self.sigma[cell] = 0.0

    def _advance(self, rates: _Rates, dP: float, dQ: float, step: float) -> None:
        """Goes on by a share of the way to the next pair; averages make work and dissipation exact."""
        n, t = self.n + step / 2 * rates.n, self.t + step / 2 * rates.t
        P, Q = self.P + step / 2 * dP, self.Q + step / 2 * dQ
        self.work += step * (P * rates.d + Q * rates.D)
        if not self.contact.coupled:  # the gaps do not know what the shear does to them; its work they do
            self.work += step * float(rates.t @ self.contact.cross @ n)
        touching = self._touching() & ~self.stick
        self.dissipation += step * float(t[touching] @ rates.v[touching])
        self.n, self.t = self.n + step * rates.n, self.t + step * rates.t
        slipping = self.sigma != 0
        self.t[slipping] = (self.contact.friction * self.sigma * self._sum(self.n))[slipping]
        self.d, self.D = self.d + step * rates.d, self.D + step * rates.D
        self.g, self.r = self.g + step * rates.g, self.r + step * rates.v
        self.P, self.Q = self.P + step * dP, self.Q + step * dQ

    def _moment(self) -> Moment:
        own, touching, first = self.contact, self._touching(), self.first
        pressed, dragged, beside = own.normal @ self.n, own.tangential @ self.t, own.cross @ self.n
        energy = (self.n @ pressed + self.t @ dragged) / 2 + self.t @ beside
        raised = pressed + own.cross.T @ self.t if own.coupled else pressed
        bound = own.friction * self._sum(self.n)
        return Moment(
            load=self.P,
            shear=self.Q,
            normal=self.n.copy(),
            gaps=self.g.copy(),
            tangential=self.t.copy(),
            slip=np.where(np.isnan(first), 0.0, self.r - np.nan_to_num(first)),
            raised=raised,
            closed=self.closed.copy(),
            stick=self.stick.copy(),
            at_limit=touching & (bound - np.abs(self.t) <= AT_LIMIT * bound.max(initial=0.0)),
            pieces=len(self.changes),
            approach=self.d,
            offset=self.D,
            energy=float(energy),
            work=self.work,
            dissipation=self.dissipation,
            residual=self._residual(raised, beside + dragged, bound),
        )

    def _residual(self, raised: Array, displaced: Array, bound: Array) -> float:
        gaps = np.where(np.isfinite(self.contact.gaps), self.contact.gaps - self.d + raised, np.inf)
        short = np.where(self.sigma != 0, np.abs(np.abs(self.t) - bound), np.abs(self.t) - bound)
        forces = -self.n.min(), short.max(), abs(self.n.sum() - self.P), abs(self.t.sum() - self.Q)
        lengths = np.where(self.closed, np.abs(gaps), -gaps).max(), np.abs(self.D - displaced - self.r).max()
        size = max(np.abs(raised).max(), np.abs(displaced).max())
        return float(max(0.0, max(forces) / self.n.max(), max(lengths) / size))
