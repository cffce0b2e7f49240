"""A second code for contact with friction of half-planes; it imports nothing of the library.

Symbols are those of `space`.
Compliances: on equal cells, loads and displacements are averages; what symbols have in common with A/k and
A exp(-k ell)/k is in closed form, the rest is a Fourier series whose waves beyond the cells' are folded back.
Friction: small implicit steps in the loads; in each, corners are open or closed and cells stick or slip
forwards or back until no sign is violated. Steps and cells are of first order: twice as many tell the error.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from math import pi

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.linalg import solve

from . import NoAnswer, space

ENDS = 1e-6, 1e6  # of k ell, beyond which symbols are their limits
FINE = 1920  # equal cells of which others are made
NEAR = 40  # cells are smaller within this part of the window beside a feature
ALIASES = 4  # on either side, of the equal cells' waves
CELLS = 40  # of the first answer; the second one has twice as many
FIRST = 4  # times as many steps from nothing, where all of the contact is new
STEPS = 20  # of the loads from pair to pair, for the first answer
TRIALS = 400  # of the signs of a step
ROUNDING = 1e-11  # of the largest force, and of displacements


# ---- symbols and compliances ----


def symbol(k, nu, beta):
    """(u, u1, psi) under (p, q, M) with exp(i k x1), k > 0; u and p point into the body, mu = ell = 1."""
    order = [1, 0, 2]
    signs = np.array([-1, 1, -1])
    plane = space.compliance(space.plane_energy(k, *space.moduli(nu, beta)), k, [0, 1, 2])
    return plane[np.ix_(order, order)] * signs * signs[:, None]


@lru_cache
def symbols(nu, beta, clamped=False):
    """The symbol as a function of k, array (..., 3, 3); for psi = 0, `clamped`, with zeros for psi."""
    k = np.geomspace(*ENDS, 241)
    scale = np.array([[1, 1, 0], [1, 1, 0], [0, 0, 0]])

    def large(k):
        return np.where(scale, k[..., None, None], 1 + k[..., None, None])

    values = np.array([symbol(wave, nu, beta) for wave in k])
    if clamped:
        values = values - values[:, :, 2:] * values[:, 2:, :] / values[:, 2:, 2:]
    spline = CubicSpline(np.log(k), values * large(k))
    return lambda k: spline(np.log(np.clip(k, *ENDS))) / large(k)


def angles(widest):
    """Points and weights of integrals from 0 to pi, on panels that are small beside 0 and nowhere wider."""
    edges = [0.0, 1e-9]
    while edges[-1] < pi:
        edges.append(min(1.6 * edges[-1], edges[-1] + widest, pi))
    points, weights = np.polynomial.legendre.leggauss(8)
    half = np.diff(edges)[:, None] / 2
    return (np.array(edges[:-1])[:, None] + half * (1 + points)).ravel(), (half * weights).ravel()


def fourier(at, ends, n, side, shift):
    """Averages over 2 n - 1 cells of the part of the symbol `at` that falls fast, array (2 n - 1, 3, 3)."""
    low, high = ends
    angle, weights = angles(6 / (n + abs(shift) / side))  # a panel on which waves turn by a circle
    folded = 0
    for alias in range(-ALIASES, ALIASES + 1):
        k = (angle + 2 * pi * alias) / side
        size = abs(k)[:, None, None]
        smooth = at(abs(k)) - (high + (low - high) * np.exp(-size)) / size
        smooth = np.where(k[:, None, None] < 0, smooth.conj(), smooth)
        folded = folded + smooth * (np.sinc(k * side / 2 / pi) ** 2 * np.exp(1j * k * shift))[:, None, None]
    folded = (weights[:, None, None] * folded).reshape(-1, 9)
    blocks = np.array_split(np.arange(1 - n, n), 1 + n // 100)  # as memory allows
    series = np.concatenate([np.exp(1j * np.outer(block, angle)) @ folded for block in blocks])
    return series.real.reshape(-1, 3, 3) / pi / side


def logarithms(b, n, side, shift):
    """-log(b - i x), averaged over both cells."""
    z = b - 1j * (np.arange(-n, n + 1) * side + shift)
    return np.diff(z**2 / 2 * (np.log(np.where(z == 0, 1, z)) - 1.5), 2)[:, None, None] / side**2


@lru_cache(8)
def kernel(solid, n, side, shift=0.0, clamped=False):
    """Averages of (u, u1, psi ell) over cells under unit (p, q, M/ell) spread over others that stand left by
    (1 - n) to (n - 1) cells, and by `shift`: array (2 n - 1, 3, 3), lengths per force.
    """
    E, nu, beta, ell = solid
    side = side / ell
    shift = shift / ell
    at = symbols(nu, beta, clamped)
    low, high = (at(np.array(end)) * end for end in ENDS)
    series = fourier(at, (low, high), n, side, shift)
    closed_form = high * logarithms(0, n, side, shift) + (low - high) * logarithms(1, n, side, shift)
    return (series + closed_form.real / pi) * 2 * (1 + nu) / E


# ---- contact ----


@dataclass(frozen=True)
class Problem:
    """Plain data of a history.

    Parameters
    ----------
    height : of the obstacle, a function of x
    pairs : of loads (P, Q)
    solid : (E, nu, beta, ell)
    law : one of `space.LAWS`
    friction : coefficient
    second : solid of the obstacle, or None
    coupled : whether shear moves gaps
    ends : edges of the obstacle
    kinks : edges of its slope
    """

    height: object
    pairs: tuple
    solid: tuple
    law: str
    friction: float
    second: tuple | None = None
    coupled: bool = True
    ends: tuple = ()
    kinks: tuple = ()

    @property
    def arms(self):
        """Places of the corners of a block."""
        return (-self.solid[3] / 2, self.solid[3] / 2) if self.law == "microblock" else (0.0,)


def graded(n, fine, features):
    """Numbers of the equal cells (of `fine`) at which cells end, about `n` of them and more beside features,
    which are places from 0 to 1.
    """
    number = np.arange(fine + 1)
    distances = [abs(number / fine - place) for place in features]
    root = np.sqrt(NEAR * np.min(distances or [1 + 0 * number], axis=0))
    count = np.cumsum(np.r_[0, 1 / np.maximum(fine / n * np.minimum(1, root), 1)[1:]])
    evenly = np.linspace(0, count[-1], round(count[-1]) + 1)
    return np.unique(np.rint(np.interp(evenly, count, number)).astype(int))


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
        self.problem = problem
        self.fine = fine
        self.side = (high - low) / fine
        self.cells = graded(n, fine, [(place - low) / (high - low) for place in features])
        self.edges = low + self.cells * self.side
        self.x = (self.edges[1:] + self.edges[:-1]) / 2
        self.width = np.diff(self.edges)
        self.n = len(self.x)
        self.gap = self._gaps()
        self.split = len(self.gap)  # forces n before, t after it
        drags = len(problem.arms) if problem.second else 1
        self.corner_sums = np.tile(np.eye(self.n), len(problem.arms)) if drags == 1 else np.eye(self.split)
        self.energy_of = self._both_bodies(drags)
        self.A = self._system(self.energy_of)
        size = len(self.energy_of)
        self.z = np.zeros(size + 2)
        self.slip = np.zeros(size - self.split)
        self.closed = np.zeros(self.split, bool)
        self.mode = np.zeros(size - self.split, int)  # 0 sticks, 1 and -1 slip
        self.work = self.dissipation = self.energy = 0.0
        self.loads = np.zeros(2)

    def _gaps(self):
        """Initial gaps of the corners, averaged over cells."""
        points, weights = np.polynomial.legendre.leggauss(4)
        places = self.x[:, None] + points * self.width[:, None] / 2
        return np.concatenate([self.problem.height(places + arm) @ weights / 2 for arm in self.problem.arms])

    def _both_bodies(self, drags):
        """Displacements (u of corners, u1) of the bodies under (n, t)."""
        problem = self.problem
        arms = problem.arms
        half = 0.5 if len(arms) == 2 else 0.0
        rows = [(1, 0, -arm / problem.solid[3]) for arm in arms] + [(0, 1, -half)] * drags
        first = self._compliance(problem.solid, rows, [0] * len(rows), problem.law == "microclamped")
        if not problem.second:
            return first
        rows = [(1, 0, 0)] * len(arms) + [(0, -1, 0)] * drags
        return first + self._compliance(problem.second, rows, (*arms, *arms))

    def _compliance(self, solid, rows, places, clamped=False):
        shifts = {a - b for a in places for b in places}
        kernels = {shift: kernel(solid, self.fine, self.side, shift, clamped) for shift in shifts}
        left = self.cells[:-1]
        right = self.cells[1:]

        def block(i, j):
            values = np.einsum("a,xab,b->x", rows[i], kernels[places[i] - places[j]], rows[j])
            twice = np.cumsum(np.cumsum(np.r_[0, 0, values]))  # its second difference are the values

            def at(to, of):
                return twice[to[:, None] - of + self.fine]

            sums = at(right, left) + at(left, right) - at(left, left) - at(right, right)
            return sums / np.outer(self.width, self.width) * self.side**2

        return np.block([[block(i, j) for j in range(len(rows))] for i in range(len(rows))])

    def _system(self, compliance):
        """Matrix of (n, t, d, D) to (gap, slip, P, Q)."""
        split = self.split
        size = len(compliance)
        A = np.zeros((size + 2, size + 2))
        A[:size, :size] = compliance
        A[split:size, :size] *= -1
        if not self.problem.coupled:
            A[:split, split:size] = 0
        A[:split, size] = -1
        A[split:size, size + 1] = A[size, :split] = A[size + 1, split:size] = 1
        return A

    def step(self, P, Q=None, D=None):
        """To the load P and the shear Q or the obstacle's tangential place D; NoAnswer where no signs
        settle.
        """
        split = self.split
        A = self.A
        right = np.concatenate([-self.gap, self.slip, [P, D if Q is None else Q]])
        if Q is None:
            A = A.copy()
            A[-1] = np.arange(len(A)) == len(A) - 1
        closed = self.closed.copy()
        mode = self.mode.copy()
        if not closed.any():
            closed[np.argmin(self.gap)] = True
        room = np.ones(len(mode))
        moved = np.zeros(len(mode))
        draw = np.random.default_rng(0)
        for trial in range(TRIALS):
            touching = self.corner_sums @ closed > 0
            mode[~touching] = 0
            stick = touching & (mode == 0)
            if Q is not None and not stick.any():
                stick = self._last(mode, Q, np.where(touching, room, 0.0), moved)
            z = self._solved(A, right, closed, mode, stick)
            displacement = A @ z
            slip = displacement[split:-2]
            moved = slip - self.slip
            room = self.problem.friction * self.corner_sums @ z[:split]
            flips, turns = self._wrong(z, displacement[:split], closed, mode, stick, moved, room)
            if not flips.any() and not (turns != mode).any():
                break
            if trial > 15:  # a cycle
                flips, turns = few(draw, flips, turns, mode)
            closed = closed ^ flips
            mode = turns
        else:
            raise NoAnswer(f"no signs settle at P = {P}, Q = {Q}")
        t = z[split:-2]
        self._count(np.array([P, t.sum()]), z, t @ np.where(touching, moved, 0))
        self.slip = slip
        self.closed = closed
        self.mode = mode

    def _solved(self, A, right, closed, mode, stick):
        """(n, t, d, D) where closed corners have no gap, and cells stick, or slip at their limit."""
        split = self.split
        free = np.concatenate([closed, stick, [True, True]])
        slips = np.flatnonzero(mode)
        limits = np.zeros((len(slips), len(A)))
        limits[:, :split] = self.problem.friction * mode[slips, None] * self.corner_sums[slips] * closed
        rows = A[free]
        z = np.zeros(len(A))
        z[free] = solve(rows[:, free] + rows[:, split + slips] @ limits[:, free], right[free])
        z[split + slips] = limits @ z
        return z

    def _wrong(self, z, displacement, closed, mode, stick, moved, room):
        """(Corners that open or close, modes of the cells) by the signs of a trial."""
        pressures = z[: self.split]
        t = z[self.split : -2]
        small = ROUNDING * pressures.max()
        short = ROUNDING * np.ptp(displacement)
        flips = np.where(closed, pressures < -small, displacement + self.gap < -short)
        if self.problem.friction == 0:
            return flips, mode
        turns = np.where(stick & (abs(t) > room + small), np.sign(t), mode).astype(int)
        turns[(mode != 0) & (mode * moved < -short)] = 0
        return flips, turns

    def _count(self, loads, z, dissipated):
        """Loads and forces that a step has come to, and its energies."""
        self.dissipation += dissipated
        self.work += (loads + self.loads) / 2 @ (z[-2:] - self.z[-2:])
        self.energy = z[:-2] @ self.energy_of @ z[:-2] / 2
        self.z = z
        self.loads = loads

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
        except NoAnswer:
            if not halvings:
                raise
            self._on((self.loads + loads) / 2, halvings - 1)
            self._on(loads, halvings - 1)

    def to(self, P, Q, steps):
        """Straight on to (P, Q); from nothing so that a cylinder's edge moves on evenly."""
        first = self.loads.copy()
        fractions = np.linspace(0, 1, steps + 1)[1:]
        if not first[0]:
            fractions = np.linspace(0, 1, FIRST * steps + 1)[1:] ** 2
        for fraction in fractions:
            self._on(first + fraction * (np.array([P, Q]) - first))
        return self.state()

    def state(self):
        """What the loads have come to."""
        n = self.z[: self.split].reshape(-1, self.n) / self.width
        t = self.z[self.split : -2].reshape(-1, self.n).sum(0) / self.width
        moment = (n[0] - n[1] - t) / 2 if len(n) == 2 else 0 * t
        stick = (n.sum(0) > 0) & ~self.mode.reshape(-1, self.n).any(0)
        zones = np.pad([*(n > 0), stick], ((0, 0), (1, 1))).astype(int)
        edges = self.edges[np.diff(zones).any(0)]
        return State(np.array([n.sum(0), moment, t]), stick, edges, self.dissipation)


def few(draw, flips, turns, mode):
    """Some of the changes of a trial by chance, now and then a single one, to leave a cycle."""
    turned = turns != mode
    chance = draw.random(len(flips) + len(turns)) + np.concatenate([~flips, ~turned])
    drawn = chance <= max(chance.min(), draw.random() ** 3)
    split = len(flips)
    return flips & drawn[:split], np.where(turned & drawn[split:], turns, mode)


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
    if problem.ends:
        ell = problem.arms[-1]
        return problem.ends[0] - ell, problem.ends[1] + ell
    reach = 2.0 + problem.solid[3]
    while True:
        line = Line(replace(problem, friction=0.0, coupled=False), (-reach, reach), 60, fine=60)
        line.step(max(P for P, _ in problem.pairs), D=0.0)
        closed = np.flatnonzero(line.closed.reshape(-1, 60).any(0))
        if closed[0] > 3 and closed[-1] < 56:
            low, high = line.x[closed[[0, -1]]]
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
    return [follow(problem, times * cells, times * steps, features, where=where) for times in (1, 2)]
