"""Contact with friction, and without it, followed from event to event through a history of loads.

The unknowns x and y are those of (c) in `microblock.contact_solvers.frictional_contact`. It begins at first
touch, where one corner is closed and its node sticks. Between two events all are linear in the loads. A leg,
straight from one pair of loads to the next, repeats

1. the rates of x and y while the loads grow;
2. the limits: the force of a closed corner, the gap of an open one, what the bound f n leaves of t where a
   node sticks, and slip against t where it slips. Pairs whose limit is reached and violated by the rates are
   exchanged, all at once, and if that brings no fewer the first one alone (Murty, Opsearch 11 (1974) 123),
   and the rates anew, until none is;
3. NotConverged where states turn back or another choice in 2 were possible, too;
4. a step up to the next limit, and the work and the dissipation on the way;
5. exchange of the pairs that are at their limit there;

6. at the end of the leg rounding is corrected.
"""

from copy import copy, deepcopy
from dataclasses import dataclass

import numpy as np

from ..errors import NotConverged
from ..model.progress import counted
from ..model.types import Array, Flags, Integers
from .friction_pivots import AT_LIMIT, UNIQUE, ActiveSets
from .frictional_contact import FrictionalContact, FrictionState
from .rounding import EPS_PIVOT

BUDGET = 500  # times the number of pairs: exchanges at one load, and events on one leg


@dataclass(frozen=True)
class Change:
    """A corner closes or opens, or a node slips, sticks or leaves, at a fraction of a leg."""

    leg: int
    fraction: float
    kind: str
    index: int


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
    """The contact along loads (P, Q) and a bulk stress, from first touch on.

    Attributes
    ----------
    x, y : arrays (corners n + n + 2,), of (c) over `FrictionalContact.size`
    sets : ActiveSets
    changes : list of Change
    legs : number of legs so far
    bulk : bulk stress
    work, dissipation : float
        A bulk stress does the work that the forces do not do as they are dragged along with it.
    """

    def __init__(self, contact: FrictionalContact) -> None:
        rows = contact.rows
        n = contact.nodes
        self.contact = contact
        self.rows = rows
        self.legs = 0
        self.bulk = 0.0
        self.changes: list[Change] = []
        self.work = 0.0
        self.dissipation = 0.0
        self._motions = contact.motions
        self._size = contact.size
        self._random = np.random.default_rng(0)
        self._first_contact = np.full(n, np.nan)  # place of the obstacle, from which slip counts
        self._noted = np.zeros(rows.nodes.stop)  # of corners, then of nodes, see `_note_changes`
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
        """(P, Q) and the bulk stress."""
        return np.append(self.y[self.rows.motions], self.bulk)

    def follow(self, load: float, shear: float, bulk: float = 0.0) -> FrictionState:
        """Follows loads (P, Q) and a bulk stress on a straight way; returns the state at its end. Raises
        NotConverged if rates are not unique or there are none; `reached` says where.
        """
        end = np.array((load, shear, bulk))
        try:
            self._follow_leg(end, end - self.loads)
        except NotConverged as failure:
            P, Q, _ = self.loads.tolist()
            raise NotConverged(
                f"the history stopped at ({P:.6g}, {Q:.6g}) on the way to ({load:.6g}, {shear:.6g}): "
                f"{failure}",
                reached=(P, Q),
            ) from failure
        self.legs += 1
        return self.state()

    def _follow_leg(self, end: Array, way: Array) -> None:
        """Follows loads from where they are by a `way` to the end of a leg, arrays (3,)."""
        if self.sets.flat:
            self._stop_at_full_slip(end, way)
        done = 0.0
        for _ in range(BUDGET * len(self.x)):
            counted()
            limits = self.find_rates(way)  # 1 and 2
            self._require_unique(limits, way)  # 3
            self._note_changes(done)
            step, numbers = limits.step(1 - done)  # 4
            self._advance(limits, step, way)
            if step == 1 - done:
                self.y[self.rows.motions] = end[:2]
                self.bulk = float(end[2])
                self._correct_rounding()  # 6
                return
            done += step
            for number in numbers.tolist():
                self.sets.exchange(number, limits.velocity)  # 5
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
        _, nodes, motions = self.rows
        exchanged = self.sets.tableau.exchanged
        stretched = way[2] / self._size * self.contact.stretch
        given = np.zeros(len(self.x))
        given[motions] = way[:2]
        given[nodes] = np.where(exchanged[nodes], -stretched, 0.0)
        rows = slice(nodes.start if way[2] else motions.start, motions.stop)
        rates = self.sets.tableau.times(rows, given[rows])
        dx = np.where(exchanged, rates, given)
        dy = np.where(exchanged, given, rates)
        dy[nodes] += stretched
        dx[nodes] += self.sets.slips * self._bound(dx)
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

    def find_rates(self, way: Array) -> Limits:
        """Exchanges pairs until no limit is violated, and returns the Limits; NotConverged if there are no
        such rates.
        """
        fewest = np.inf
        without_gain = 0
        for _ in range(BUDGET * len(self.x)):
            limits = self.limits(way)  # 1
            velocity = limits.velocity
            violated = limits.violated  # 2
            if not len(violated):
                return limits
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
        """3: NotConverged where states turn back or another set of pairs violates no limit."""
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

    def _advance(self, limits: Limits, step: float, way: Array) -> None:
        """4: goes on by a step of a way; means over the step make work and dissipation exact."""
        corners, nodes, motions = self.rows
        mean_x = self.x + step / 2 * limits.dx
        mean_loads = self.y[motions] + step / 2 * limits.dy[motions]
        self.work += step * self._size * float(mean_loads @ limits.dx[motions])
        self.work -= step * way[2] * float(np.sum(mean_x[nodes] * self.contact.stretch))
        self.bulk += step * way[2]
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
        y[self.rows.nodes] += self.bulk / self._size * self.contact.stretch
        can_touch = np.isfinite(self.y)
        return np.where(can_touch, y, 0.0) - np.where(can_touch, self.y, 0.0)

    def _correct_rounding(self) -> None:
        """6: solves (c) for the forces, motions, gaps and slip that its residual leaves."""
        residual = self._residual()
        exchanged = self.sets.tableau.exchanged
        correction = self.sets.tableau.times(exchanged, residual[exchanged])
        self.x = self.x - np.where(exchanged, correction, 0.0)
        self.y = self.y + np.where(exchanged, 0.0, residual - correction)
        self._put_at_limits()

    def _note_changes(self, fraction: float) -> None:
        """Notes the changes of corners and nodes since it was called before, at a fraction of the leg."""
        sets = self.sets
        conditions = np.concatenate((sets.closed, np.where(sets.stick, 2.0, sets.slips)))
        count = len(sets.closed)
        for row in np.flatnonzero(conditions != self._noted).tolist():
            kinds = {0.0: "open", 1.0: "close"}
            if row >= count:
                kinds = {0.0: "leave", -1.0: "slip", 1.0: "slip", 2.0: "stick"}
            number = row if row < count else row - count
            self.changes.append(Change(self.legs, fraction, kinds[conditions[row]], number))
        touches_first = np.isnan(self._first_contact) & sets.in_contact
        self._first_contact[touches_first] = -self.y[self.rows.nodes][touches_first]
        self._noted = conditions

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
        load, shear, bulk = self.loads.tolist()
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
            at_limit=self.sets.in_contact & (bound - np.abs(tangential) <= AT_LIMIT * bound.max()),
            iterations=len(self.changes),
            approach=approach,
            offset=offset,
            energy=float(energy / 2),
            work=self.work,
            dissipation=self.dissipation,
            residual=self._largest_residual(max(np.abs(gap_changes).max(), np.abs(displaced).max())),
            bulk=bulk,
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
