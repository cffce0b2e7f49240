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

import numpy as np

from ..errors import NotConverged
from ..model.types import Array, Flags

ROUNDING = 1e-12  # of the largest value or rate: below it a sign means nothing
PATIENCE = 3  # exchanges of all violated at once without fewer of them, before single ones
REFRESH = 150  # updates of the inverse before it is computed anew
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
    displacement : array (n,)
        s (length).
    closed, stick : boolean arrays (corners n,), (n,)
    approach, offset : float
        d and D (length).
    energy, work, dissipation : float
    """

    load: float
    shear: float
    normal: Array
    gaps: Array
    tangential: Array
    slip: Array
    displacement: Array
    closed: Flags
    stick: Flags
    approach: float
    offset: float
    energy: float
    work: float
    dissipation: float


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
        self.contact, self.changes, self.legs = contact, [], 0
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
        n = self._m + self.contact.cells
        ends = [n] if self._sliding else [n, n + 1]
        self._active = np.concatenate(
            (np.flatnonzero(self.closed), self._m + np.flatnonzero(self.stick), ends)
        ).astype(int)
        try:
            self._inverse = np.linalg.inv(self._columns(self._active, self._active))
        except np.linalg.LinAlgError as failure:
            raise NotConverged(f"the rates of the contact are not unique; {UNIQUE}") from failure
        self._updates = 0

    def _insert(self, number: int) -> None:
        new = np.array([number])
        a, b = self._columns(self._active, new), self._columns(new, self._active)
        v, w = self._inverse @ a, b @ self._inverse
        pivot = float((self._columns(new, new) - b @ v)[0, 0])
        self._require_positive(pivot)
        self._inverse = np.block([[self._inverse + v @ w / pivot, -v / pivot], [-w / pivot, 1 / pivot]])
        self._active = np.append(self._active, number)

    def _require_positive(self, pivot: float) -> None:
        if not pivot > 0:
            raise NotConverged(
                f"the answer is not unique at loads P = {self.P:.6g}, Q = {self.Q:.6g}; {UNIQUE}"
            )

    def _remove(self, number: int) -> None:
        k = int(np.flatnonzero(self._active == number)[0])
        column, row, pivot = self._inverse[:, k], self._inverse[k], float(self._inverse[k, k])
        self._require_positive(pivot)
        left = self._inverse - np.outer(column, row / pivot)
        self._inverse = np.delete(np.delete(left, k, 0), k, 1)
        self._active = np.delete(self._active, k)

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
        limits = [abs(abs(q) - f * p) <= ROUNDING * f * max(load, self.P)
                  for p, q in ((self.P, self.Q), (load, shear))]
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
        return self.closed.reshape(-1, self.contact.cells).any(axis=0)

    def _sum(self, n: Array) -> Array:
        """Of corner forces that of each cell."""
        return n.reshape(-1, self.contact.cells).sum(axis=0)

    def _rates(self, dP: float, dQ: float) -> _Rates:
        own, m = self.contact, self._m
        x = np.zeros(len(self._matrix))
        loads = np.where(self._active == len(x) - 2, dP, 0.0) + np.where(self._active == len(x) - 1, dQ, 0.0)
        x[self._active] = self._inverse @ loads
        n = x[:m]
        t = x[m:-2] + own.friction * self.sigma * self._sum(n)
        moved = self._matrix[:-2, :-2] @ np.concatenate((n, t))
        d, D, s = x[-2], x[-1], moved[m:]
        touching = self._touching()
        if self._sliding:
            direction = self.sigma[touching][0]
            D = direction * float((direction * s[touching]).max())
        g = np.where(self.closed, 0.0, moved[:m] - d)
        v = np.where(self.stick, 0.0, D - s)
        return _Rates(n, t, float(d) * self._size, float(D) * self._size, g * self._size, v * self._size)

    def _scales(self, rates: _Rates) -> tuple[float, float]:
        """Rates of forces and of lengths below which a sign means nothing."""
        force = max(np.abs(rates.n).max(), np.abs(rates.t).max())
        return ROUNDING * force, 100 * ROUNDING * force * self._size

    def _limits(self, rates: _Rates) -> tuple[Array, Array, Array]:
        """(values, rates, tolerances) of all that must not be negative: forces of closed corners, gaps of open
        ones, the two bounds of cells that stick, slip rates of those that slip; numbered so.
        """
        f, inf = self.contact.friction, np.inf
        force, length = self._scales(rates)
        bound, dbound = f * self._sum(self.n), f * self._sum(rates.n)
        free = self.stick & (np.count_nonzero(self.stick) > 1)  # the last one holds the obstacle
        slipping = ~self.stick & (self.sigma != 0) & ~np.bool_(self._sliding)
        values = [
            np.where(self.closed, self.n, inf),
            np.where(self.closed, inf, self.g),
            np.where(free, bound - self.t, inf),
            np.where(free, bound + self.t, inf),
            np.where(slipping, 0.0, inf),
        ]
        grow = [rates.n, rates.g, dbound - rates.t, dbound + rates.t, self.sigma * rates.v]
        tolerances = [force, length, force, force, length]
        return (
            np.concatenate(values),
            np.concatenate(grow),
            np.concatenate([np.full(len(one), tolerance) for one, tolerance in zip(grow, tolerances)]),
        )

    def _next(self, rates: _Rates, remaining: float) -> tuple[float, Array | None]:
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

    def _exchange(self, numbers: Array, rates: _Rates, share: float) -> None:
        """Exchanges what is numbered as in `_limits`."""
        m, n, many = self._m, self.contact.cells, len(numbers) > MANY
        for number in map(int, numbers):
            if number < m:
                self._open(number, many)
                self._note(share, "open", number)
            elif number < 2 * m:
                self._close(number - m, rates.v, many)
                self._note(share, "close", number - m)
            elif number < 2 * m + 2 * n:
                second, cell = divmod(number - 2 * m, n)
                if self.stick[cell] and np.count_nonzero(self.stick) > 1:
                    self._slip(cell, -1.0 if second else 1.0, many)
                    self._note(share, "slip", cell)
            elif self.sigma[number - 2 * m - 2 * n] != 0:
                self._hold(number - 2 * m - 2 * n, many)
                self._note(share, "stick", number - 2 * m - 2 * n)
        self._updates += len(numbers)
        if many or self._updates > REFRESH:
            self._rebuild()

    def _note(self, share: float, kind: str, index: int) -> None:
        self.changes.append(Change(self.legs, share, kind, index))

    def _open(self, corner: int, many: bool) -> None:
        cell = int(self._cell[corner])
        last = np.count_nonzero(self.closed.reshape(-1, self.contact.cells)[:, cell]) == 1
        if last and self.stick[cell]:
            if np.count_nonzero(self.stick) == 1 and not self._sliding:
                others = np.where(np.arange(self.contact.cells) == cell, 0.0, self._sum(self.n))
                self._hold(int(np.argmax(others)), many)
            self.stick[cell] = False
            if not many:
                self._remove(self._m + cell)
        self.closed[corner], self.n[corner], self.g[corner] = False, 0.0, 0.0
        if not many:
            self._remove(corner)
        if last:
            self.sigma[cell] = self.t[cell] = 0.0

    def _close(self, corner: int, v: Array, many: bool) -> None:
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

    def _sliding_sign(self) -> float:
        return float(np.sign(self.Q))

    def _slip(self, cell: int, sigma: float, many: bool) -> None:
        self.stick[cell] = False
        if not many:
            self._shear_of(cell, -self.contact.friction * sigma)
            self._remove(self._m + cell)
        self.sigma[cell] = sigma

    def _hold(self, cell: int, many: bool) -> None:
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
        own = self.contact
        energy = self.n @ own.normal @ self.n / 2 + self.t @ own.tangential @ self.t / 2
        energy += self.t @ own.cross @ self.n
        slip = np.where(np.isnan(self.first), 0.0, self.r - np.nan_to_num(self.first))
        displacement = own.cross @ self.n + own.tangential @ self.t
        return Moment(
            self.P, self.Q, self.n.copy(), self.g.copy(), self.t.copy(), slip, displacement,
            self.closed.copy(), self.stick.copy(), self.d, self.D, float(energy), self.work, self.dissipation,
        )
