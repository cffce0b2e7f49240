"""A second code for contact with friction of half-planes; it imports nothing of the library.

Symbols are those of `space`.
Compliances: on equal cells, loads and displacements are averages; what symbols have in common with A/k and
A exp(-k ell)/k is in closed form, the rest is a Fourier series whose waves beyond the cells' are folded back.
Friction: small implicit steps in the loads; in each, corners are open or closed and cells stick or slip
forwards or back until no sign is violated. Steps and cells are of first order: twice as many tell the error.

`case` draws history (SEED, 20, k): its error is the largest relative L2 error, over the pressure, of p, M/ell
and q/f.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from math import inf, pi

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.linalg import solve

from . import SEED, NoAnswer, space
from .judging import Case

CURVATURE = space.CURVATURE
ENDS = 1e-6, 1e6  # of k ell, beyond which symbols are their limits
FINE = 1920  # equal cells of which others are made
NEAR = 40  # cells are smaller within this part of the window beside a feature
CELLS = 40  # of the judge's first answer; its second one has twice as many
FIRST = 4  # times as many steps from nothing, where all of the contact is new
STEPS = 20  # of the loads from pair to pair, for the first answer
LAWS = "microblock", "microblock", "unilateral", "microclamped"


# ---- symbols and compliances ----


def symbol(k, nu, beta):
    """(u, u1, psi) under (p, q, M) with exp(i k x1), k > 0; u and p point into the body, mu = ell = 1."""
    order, signs = [1, 0, 2], np.array([-1, 1, -1])
    plane = space.compliance(space._plane(k, 2 * nu / (1 - 2 * nu), beta / (2 - beta)), k, [0, 1, 2])
    return plane[np.ix_(order, order)] * signs * signs[:, None]


@lru_cache
def symbols(nu, beta, clamped=False):
    """The symbol as a function of k, array (..., 3, 3); for psi = 0, `clamped`, with zeros for psi."""
    k = np.geomspace(*ENDS, 241)
    scale = np.array([[1, 1, 0], [1, 1, 0], [0, 0, 0]])

    def large(k):
        return np.where(scale, k[..., None, None], 1 + k[..., None, None])

    values = np.array([symbol(each, nu, beta) for each in k])
    if clamped:
        values = values - values[:, :, 2:] * values[:, 2:, :] / values[:, 2:, 2:]
    spline = CubicSpline(np.log(k), values * large(k))
    return lambda k: spline(np.log(np.clip(k, *ENDS))) / large(k)


@lru_cache(8)
def kernel(solid, n, side, shift=0.0, clamped=False):
    """Averages of (u, u1, psi ell) over cells under unit (p, q, M/ell) spread over others that stand left by
    (1 - n) to (n - 1) cells, and by `shift`: array (2 n - 1, 3, 3), lengths per force.
    """
    E, nu, beta, ell = solid
    side, shift, at = side / ell, shift / ell, symbols(nu, beta, clamped)
    low, high = (at(np.array(end)) * end for end in ENDS)
    widest = 6 / (n + abs(shift) / side)  # of a panel in the angle, on which waves turn by a circle
    edges = [0.0, 1e-9]
    while edges[-1] < pi:
        edges.append(min(1.6 * edges[-1], edges[-1] + widest, pi))
    points, weights = np.polynomial.legendre.leggauss(8)
    wide = np.diff(edges)[:, None] / 2
    angle, weights = (np.array(edges[:-1])[:, None] + wide * (1 + points)).ravel(), (wide * weights).ravel()
    total = 0
    for alias in range(-4, 5):
        k = (angle + 2 * pi * alias) / side
        size = abs(k)[:, None, None]
        rest = at(abs(k)) - (high + (low - high) * np.exp(-size)) / size
        rest = np.where(k[:, None, None] < 0, rest.conj(), rest)
        total = total + rest * (np.sinc(k * side / 2 / pi) ** 2 * np.exp(1j * k * shift))[:, None, None]
    total = (weights[:, None, None] * total).reshape(-1, 9)
    parts = np.array_split(np.arange(1 - n, n), 1 + n // 100)  # as memory allows
    found = np.concatenate([np.exp(1j * np.outer(part, angle)) @ total for part in parts])
    found = found.real.reshape(-1, 3, 3) / pi / side

    def logarithms(b):  # -log(b - i x), averaged over both cells
        z = b - 1j * ((np.arange(-n, n + 1)) * side + shift)
        return np.diff(z**2 / 2 * (np.log(np.where(z == 0, 1, z)) - 1.5), 2)[:, None, None] / side**2

    return (found + (high * logarithms(0) + (low - high) * logarithms(1)).real / pi) * 2 * (1 + nu) / E


# ---- contact ----


@dataclass(frozen=True)
class Problem:
    """Plain data of a history: lengths, E* about 1, and what is asked of the library."""

    kind: str
    height: object
    pairs: tuple
    solid: tuple  # E, nu, beta, ell
    law: str
    friction: float
    obstacle: tuple | None = None  # name and arguments of a class of the library
    second: tuple | None = None  # solid of the obstacle
    coupled: bool = True
    rtol: float = 0.05
    ends: tuple = ()  # edges of the obstacle
    kinks: tuple = ()  # and of its slope

    def __str__(self):
        words = f"{self.law:12s} {self.kind:8s} {'body' if self.second else '':4s} ell {self.solid[3]:4.2f}"
        return f"{words} f {self.friction:4.2f} {'' if self.coupled else 'un'}coupled rtol {self.rtol:.2f}"

    @property
    def arms(self):
        return (-self.solid[3] / 2, self.solid[3] / 2) if self.law == "microblock" else (0.0,)


class Line:
    """Cells of a window, about `n` and more beside `features`: forces n of corners and t along the surface,
    and what they have come to.

    Cells are unions of `fine` equal ones. A block has one t beside a rigid obstacle, and one for each corner
    beside a second body, which they drag where they stand; |t| is at most friction times n of its corners.
    """

    def __init__(self, problem, window, n, features=(), fine=FINE):
        low, high = window
        if problem.ends and len(problem.arms) == 2:  # edges of both corners are edges of cells
            blocks = round((high - low) / problem.solid[3])
            fine = blocks * round(fine / blocks)
        self.problem, self.fine, self.side = problem, fine, (high - low) / fine
        number = np.arange(fine + 1)
        away = [abs(number / fine - (each - low) / (high - low)) for each in features]
        root = np.sqrt(NEAR * np.min(away or [1 + 0 * number], axis=0))
        count = np.cumsum(np.r_[0, 1 / np.maximum(fine / n * np.minimum(1, root), 1)[1:]])
        evenly = np.linspace(0, count[-1], round(count[-1]) + 1)
        self.cells = np.unique(np.rint(np.interp(evenly, count, number)).astype(int))
        self.edges = low + self.cells * self.side
        self.n, self.x = len(self.cells) - 1, (self.edges[1:] + self.edges[:-1]) / 2
        self.width = np.diff(self.edges)
        arms, drags = problem.arms, len(problem.arms) if problem.second else 1
        points, weights = np.polynomial.legendre.leggauss(4)
        places = self.x[:, None] + points * self.width[:, None] / 2
        self.gap = np.concatenate([problem.height(places + arm) @ weights / 2 for arm in arms])
        half = 0.5 if problem.law == "microblock" else 0.0
        n, own = self.n, [(1, 0, -arm / problem.solid[3]) for arm in arms] + [(0, 1, -half)] * drags
        A = self._compliance(problem.solid, own, [0] * len(own), problem.law == "microclamped")
        if problem.second:
            other = [(1, 0, 0)] * len(arms) + [(0, -1, 0)] * drags
            A = A + self._compliance(problem.second, other, (*arms, *arms))
        self.split = split = len(arms) * n
        self.share = np.tile(np.eye(n), len(arms)) if drags == 1 else np.eye(split)
        self.energy_of = A.copy()
        A[split:] *= -1
        if not problem.coupled:
            A[:split, split:] = 0
        size = len(A)
        self.A = np.zeros((size + 2, size + 2))  # (n, t, d, D) to (gap, slip, P, Q)
        self.A[:size, :size] = A
        self.A[:split, size] = -1
        self.A[split:size, size + 1] = self.A[size, :split] = self.A[size + 1, split:size] = 1
        self.z, self.slip = np.zeros(size + 2), np.zeros(size - split)
        self.closed, self.mode = np.zeros(split, bool), np.zeros(size - split, int)
        self.work = self.dissipation = self.energy = 0.0
        self.loads = np.zeros(2)

    def _compliance(self, solid, rows, places, clamped=False):
        shifts = {a - b for a in places for b in places}
        kernels = {shift: kernel(solid, self.fine, self.side, shift, clamped) for shift in shifts}
        left, right = self.cells[:-1], self.cells[1:]

        def block(i, j):
            values = np.einsum("a,xab,b->x", rows[i], kernels[places[i] - places[j]], rows[j])
            twice = np.cumsum(np.cumsum(np.r_[0, 0, values]))  # its second difference are the values

            def at(own, other):
                return twice[own[:, None] - other + self.fine]

            sums = at(right, left) + at(left, right) - at(left, left) - at(right, right)
            return sums / np.outer(self.width, self.width) * self.side**2

        return np.block([[block(i, j) for j in range(len(rows))] for i in range(len(rows))])

    def step(self, P, Q=None, D=None):
        """To the load P and the shear Q or the obstacle's tangential place D; RuntimeError where no signs
        settle.
        """
        A, split, size, f = self.A, self.split, len(self.A) - 2, self.problem.friction
        right = np.concatenate([-self.gap, self.slip, [P, 0.0 if Q is None else Q]])
        if Q is None:
            A, right[-1] = A.copy(), D
            A[-1] = np.arange(size + 2) == size + 1
        closed, mode = self.closed.copy(), self.mode.copy()
        if not closed.any():
            closed[np.argmin(self.gap)] = True
        room, moved, draw = np.ones(size - split), np.zeros(size - split), np.random.default_rng(0)
        for trial in range(400):
            touching = self.share @ closed > 0
            mode[~touching] = 0
            stick = touching & (mode == 0)
            if Q is not None and not stick.any():
                stick = self._last(mode, Q, np.where(touching, room, 0.0), moved)
            free = np.concatenate([closed, stick, [True, True]])
            slips = np.flatnonzero(mode)
            limits = np.zeros((len(slips), size + 2))
            limits[:, :split] = f * mode[slips, None] * self.share[slips] * closed
            rows = A[free]
            matrix = rows[:, free] + rows[:, split + slips] @ limits[:, free]
            z = np.zeros(size + 2)
            z[free] = solve(matrix, right[free])
            z[split + slips] = limits @ z
            answer = A @ z
            gap, slip, room = answer[:split] + self.gap, answer[split:size], f * self.share @ z[:split]
            t, moved = z[split:size], slip - self.slip
            small, short = 1e-11 * z[:split].max(), 1e-11 * np.ptp(answer[:split])
            wrong = np.where(closed, z[:split] < -small, gap < -short)
            to = np.where(stick & (abs(t) > room + small), np.sign(t), mode)
            to[(mode != 0) & (mode * moved < -short)] = 0
            other = (to != mode) & (f > 0)
            if not wrong.any() and not other.any():
                break
            if trial > 15:  # a cycle: by chance some of them, now and then one alone
                chance = draw.random(len(wrong) + len(other)) + np.concatenate([~wrong, ~other])
                few = chance <= max(chance.min(), draw.random() ** 3)
                wrong, other = wrong & few[:split], other & few[split:]
            closed, mode = closed ^ wrong, np.where(other, to, mode).astype(int)
        else:
            raise RuntimeError(f"no signs settle at P = {P}, Q = {Q}")
        self.dissipation += t @ np.where(touching, moved, 0)
        loads = np.array([P, t.sum()])
        self.work += (loads + self.loads) / 2 @ (z[-2:] - self.z[-2:])
        self.z, self.slip, self.closed, self.mode, self.loads = z, slip, closed, mode, loads
        self.energy = z[:size] @ self.energy_of @ z[:size] / 2

    def _last(self, mode, Q, room, moved):
        """Lets the cell stick at which slip turns where all slip forwards and back, and Q is their sum."""
        order = np.argsort(-moved)
        order = order[room[order] > 0]
        forwards = np.cumsum(room[order])
        last = min(np.searchsorted(2 * forwards - forwards[-1], Q), len(order) - 1)
        mode[order] = np.where(np.arange(len(order)) < last, 1, -1)
        mode[order[last]] = 0
        return np.arange(len(mode)) == order[last]

    def _on(self, loads, halvings=8):
        """A step, or two where no signs settle."""
        try:
            self.step(*loads)
        except RuntimeError:
            if not halvings:
                raise
            self._on((self.loads + loads) / 2, halvings - 1)
            self._on(loads, halvings - 1)

    def to(self, P, Q, steps):
        """Straight on to (P, Q); from nothing so that a cylinder's edge moves on evenly."""
        first = self.loads.copy()
        share = (
            np.linspace(0, 1, steps + 1)[1:] if first[0] else np.linspace(0, 1, FIRST * steps + 1)[1:] ** 2
        )
        for each in share:
            self._on(first + each * (np.array([P, Q]) - first))
        return self.state()

    def state(self):
        """What the loads have come to."""
        n = self.z[: self.split].reshape(-1, self.n) / self.width
        t = self.z[self.split : -2].reshape(-1, self.n).sum(0) / self.width
        moment = (n[0] - n[1] - t) / 2 if len(n) == 2 else 0 * t
        stick = (n.sum(0) > 0) & ~self.mode.reshape(-1, self.n).any(0)
        zones = np.pad([*(n > 0), stick], ((0, 0), (1, 1))).astype(int)
        ends = self.edges[np.diff(zones).any(0)]
        return State(np.array([n.sum(0), moment, t]), stick, ends, self.dissipation)


@dataclass(frozen=True)
class State:
    """Pressure, M/ell and shear traction, array (3, n); cells that stick; edges of corners' zones and of
    stick; what has been dissipated.
    """

    fields: object
    stick: object
    edges: object
    dissipation: float


def window(problem):
    """Where contact may be, from a coarse answer without friction at the largest load."""
    P = max(P for P, _ in problem.pairs)
    if problem.ends:
        ell = problem.arms[-1]
        return problem.ends[0] - ell, problem.ends[1] + ell
    reach = 2.0 + problem.solid[3]
    while True:
        line = Line(replace(problem, friction=0.0, coupled=False), (-reach, reach), 60, fine=60)
        line.step(P, D=0.0)
        on = np.flatnonzero(line.closed.reshape(-1, 60).any(0))
        if on[0] > 3 and on[-1] < 56:
            low, high = line.x[on[0]], line.x[on[-1]]
            return low - 0.2 * (high - low), high + 0.2 * (high - low)
        reach *= 2


def follow(problem, cells, steps, features=(), fine=FINE, where=None):
    """(Line, its states at the pairs)."""
    line = Line(problem, where or window(problem), cells, features, fine)
    states = [line.to(P, Q, steps) for P, Q in problem.pairs]
    touching = [state.fields[0, end] > 0 for state in states for end in (0, -1)]
    assert problem.ends or not any(touching), "contact reaches the end of the window"
    return line, states


def answer(problem, cells=CELLS, steps=STEPS):
    """Two pairs (Line, its states at the pairs), the second one of twice as many cells and steps; cells are
    small beside the edges of what equal cells have come to, of the obstacle and of its slope.
    """
    where = window(problem)
    _, rough = follow(problem, cells, steps, fine=cells, where=where)
    singular = [place - arm for place in (*problem.ends, *problem.kinks) for arm in problem.arms]
    features = [*singular, *(edge for state in rough for edge in state.edges)]
    return [follow(problem, m * cells, m * steps, features, where=where) for m in (1, 2)]


# ---- 20 histories ----


def draw(k):
    """History k: pressed, sheared, back and relieved, at random; lengths over the contact's half-width."""
    rng = np.random.default_rng((SEED, 20, k))
    law, kind = LAWS[k % 4], ("cylinder", "wedge", "power", "punch", "uneven")[k % 5]
    alpha, f = (float(np.exp(rng.uniform(*np.log(ends)))) for ends in ((0.05, 1.0), (0.1, 0.6)))
    nu, beta = rng.uniform(0, 0.45), rng.uniform(0.1, 1.9)
    P = rng.uniform(0.4, 1.0)
    tilt, slope, power = rng.uniform(0, 0.1), rng.uniform(0.2, 0.6), rng.uniform(1.5, 4.0)
    second = None
    if k % 7 in (3, 5) and kind != "punch":
        second = (rng.uniform(0.3, 3.0), rng.uniform(0, 0.45), rng.uniform(0.1, 1.9), rng.uniform(0.05, 0.5))
    if kind == "punch":
        alpha = 2 / round(2 / alpha)  # edges of both corners are edges of cells
    height, obstacle, ends = {
        "cylinder": (lambda x: x**2 / 2, ("Cylinder", (1.0,)), ()),
        "wedge": (lambda x: slope * abs(x), ("Wedge", (slope,)), ()),
        "power": (lambda x: abs(x) ** power / 2, None, ()),
        "punch": (lambda x: np.where(abs(x) < 1, tilt * x, inf), ("Punch", (1.0, tilt)), (-1.0, 1.0)),
        "uneven": (lambda x: np.where(x > 0, 0.3, 0.8) * x**2, None, ()),
    }[kind]
    pairs = [(P, rng.choice([0.0, rng.uniform(-0.8, 0.8)]) * f * P)]
    for _ in range(rng.integers(2, 4)):
        P *= 1.0 if rng.random() < 0.5 else rng.uniform(0.5, 1.5)
        pairs.append((P, rng.uniform(-0.95, 0.95) * f * P))
    return Problem(
        kind,
        height,
        tuple((float(P), float(Q)) for P, Q in pairs),
        (1 - nu**2, nu, beta, alpha),
        law,
        f,
        obstacle,
        second,
        bool(rng.random() < 0.75),
        0.4 if second and law == "microblock" else float(np.exp(rng.uniform(*np.log((0.02, 0.06))))),
        ends,
        () if kind in ("cylinder", "punch") else (0.0,),
    )


def history(mb, p):
    """The states of the library."""
    body, second = (v and mb.HalfPlane(mb.Cosserat(*v[:2], v[3], beta=v[2])) for v in (p.solid, p.second))
    law = {"microblock": mb.Microblock, "unilateral": mb.Unilateral, "microclamped": mb.Microclamped}[p.law]
    name, arguments = p.obstacle or ("Obstacle", (p.height, (0.0,)))
    obstacle = getattr(mb, name)(*arguments)
    made = mb.Contact(body, mb.Deformable(second, obstacle) if second else obstacle, law(friction=p.friction))
    return made.history(p.pairs, coupled=p.coupled, rtol=p.rtol).states


def means(edges, x, weights, fields):
    """Means over cells between `edges` of fields that are constant on cells x of lengths `weights`."""
    ends = np.maximum.accumulate(np.column_stack([x - weights / 2, x + weights / 2]).ravel())
    forces = np.cumsum(
        (np.array([0, 1])[:, None] * (weights * fields).T[:, None]).reshape(2 * len(x), -1), axis=0
    )
    return np.array([np.diff(np.interp(edges, ends, force)) for force in forces.T]) / np.diff(edges)


def errors(line, fields, x, weights, others):
    """Relative L2 errors of p, M/ell and q/f beside `fields` on a Line, of means over its cells; beside edges
    of the obstacle the distance is the weight.
    """
    p = line.problem
    apart = means(line.edges, x, weights, others) - fields
    away = [abs(line.x - end + arm) for end in p.ends for arm in p.arms]
    norm = line.width * np.min([np.ones_like(line.x), *away], axis=0)
    return (apart**2 @ norm) ** 0.5 / (fields[0] ** 2 @ norm) ** 0.5 / [1, 1, p.friction]


def case(k, cells=CELLS):
    """History k as a case, whose states are the library's."""
    p = draw(k)

    def solve():
        import microblock as mb

        return history(mb, p)

    def verify(found):
        worst = (-1.0, 0.0, 0.0, 0.0)
        try:
            (rough, before), (line, states) = answer(p, cells, cells * STEPS // CELLS)
        except RuntimeError as failure:
            raise NoAnswer(str(failure)) from failure
        for less, true, state in zip(before, states, found):
            moment = state.micromoment / p.solid[3] * (p.law == "microblock")
            other = np.array([state.pressure, moment, state.shear_traction])
            apart = errors(line, true.fields, state.x, state.weights, other).max()
            bar = errors(rough, less.fields, line.x, line.width, true.fields).max()
            ratio = apart / (max(p.rtol, state.error_estimate) + bar)
            worst = max(worst, (ratio, apart, state.error_estimate, bar))
        return tuple(map(float, worst[1:]))

    return Case(str(p), p.rtol, solve, verify)
