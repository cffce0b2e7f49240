"""Panels, quadrature and matrices of the reference that verifies the contact line; see
`cases.studies.reference_line`.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.polynomial.legendre import leggauss, legvander

from . import reference_kernels

PLAIN, ROOT, LOG = 0, 1, 2
EXTRA = 12  # Gauss points beyond the degree, for targets not nearer than NEAR
NEAR = 0.25  # of a panel, in its parameter
DE_STEP, DE_REACH = 0.05, 3.4
INNERMOST = 0.2  # last panel at a break, over ell or the way to the next
GROWTH = 2.0  # end of a panel over its beginning, as seen from the break
ROWS, PAIRS = 256, 2000  # targets at a time, and near pairs of target and panel


@lru_cache(maxsize=16)
def gauss(order):
    """Gauss points and weights on [0, 1]."""
    points, weights = leggauss(order)
    return (points + 1) / 2, weights / 2


@lru_cache(maxsize=1)
def tanh_sinh():
    """Points on [0, 1], their distances from 1, and weights; good to rounding with logarithms at either
    end.
    """
    t = np.arange(-DE_REACH, DE_REACH + DE_STEP / 2, DE_STEP)
    grow = np.exp(np.pi * np.sinh(t))
    return grow / (1 + grow), 1 / (1 + grow), DE_STEP * np.pi * np.cosh(t) * grow / (1 + grow) ** 2


class Problem:
    """A contact problem in plain numbers: gaps, levers and tables of the kernels for each pair of corners.

    Parameters
    ----------
    contact : microblock.Contact with psi0 a number
    load : force per thickness
    """

    def __init__(self, contact, load):
        self.solid, self.law, self.load = contact.solid, contact.law, load
        self.ell, self.c = self.solid.ell, (1 - self.solid.nu) / self.solid.mu
        self.height = getattr(contact.obstacle, "height", contact.obstacle)
        self.clamped = self.law.clamps_rotation
        half, count = self.ell / 2, len(self.law.corners)
        psi0 = self.law.psi0 if count == 2 else 0.0
        self.levers = (1 + psi0, psi0 - 1) if count == 2 else (0.0,)
        self.shifts = (-half, half) if count == 2 else (0.0,)  # of a corner from the contact point, (20)
        lift = half * psi0 if count == 2 and self.law.psi0_in == "gaps and levers" else 0.0
        self.lifts = (lift, -lift) if count == 2 else (0.0,)
        self.kinks = sorted(
            {kink - shift for kink in getattr(contact.obstacle, "kinks", ()) for shift in self.shifts}
        )
        # cylinders and wedges
        self.mirror = count == 2 and psi0 == 0 and hasattr(contact.obstacle, "height")
        self.tables = {
            (t, s): self._table(self.levers[t], self.levers[s]) for t in range(count) for s in range(count)
        }
        self.reaction = reference_kernels.table(self.solid, {}, {"reaction": -0.5})

    def _table(self, target, source):
        if self.clamped:
            return reference_kernels.table(self.solid, {"clamped": self.c}, {})
        return reference_kernels.table(
            self.solid, {"U": self.c, "W": self.c * target * source}, {"V": self.c * (target - source)}
        )

    @property
    def corners(self):
        """Corners whose pressure is unknown: of two mirrored ones, the first."""
        return (0,) if self.mirror else tuple(range(len(self.levers)))

    def gap(self, corner, x):
        """Initial gap of a corner."""
        return self.height(x + self.shifts[corner]) + self.lifts[corner]


@dataclass(frozen=True)
class Mesh:
    """Panels ``x = e + h v`` (``e + h v^2`` for ROOT), 0 <= v <= 1, h signed, of all corners."""

    corner: np.ndarray
    e: np.ndarray
    h: np.ndarray
    kind: np.ndarray
    order: int

    def mirrored(self):
        return Mesh(1 - self.corner, -self.e, -self.h, self.kind, self.order)

    def x(self, panel, v):
        return self.e[panel] + self.h[panel] * np.where(self.kind[panel] == ROOT, v * v, v)

    @property
    def density(self):
        """p dx = f density dv with f expanded in the basis: p = f, but f/v for ROOT."""
        return np.abs(self.h) * np.where(self.kind == ROOT, 2.0, 1.0)

    def basis(self, kind, v):
        """Basis functions of f at v > 0: array v.shape + (order,)."""
        if kind != LOG:
            return legvander(2 * v - 1, self.order - 1)
        logs = self.order // 3
        plain = legvander(2 * v - 1, self.order - logs - 1)
        return np.concatenate((plain, np.log(v)[..., None] * plain[..., :logs]), axis=-1)


def graded(left, right, kinds, ways):
    """Panels (e, h, kind) between two breaks, shrinking towards both; kinds ROOT or LOG, ways to what is next
    to each.
    """
    half, found = (right - left) / 2, []
    for end, sign, kind, way in ((left, 1, kinds[0], ways[0]), (right, -1, kinds[1], ways[1])):
        done, size = 0.0, INNERMOST * min(way, half)
        while done < half:
            until = size if done == 0 else done * GROWTH
            until = half if until > 0.8 * half else until
            found.append((end + sign * done, sign * (until - done), kind if done == 0 else PLAIN))
            done = until
    return found


def mesh(problem, zones, order):
    """Panels on the zones {corner: [(left, right), ...]}, broken at the edges of both corners and at
    kinks.
    """
    edges = {edge for pairs in zones.values() for pair in pairs for edge in pair}
    edges |= {-edge for edge in edges} if problem.mirror else set()
    found, all_breaks = [], np.array(sorted({*edges, *problem.kinks}))

    def way(x):
        return min(problem.ell, np.abs(all_breaks[all_breaks != x] - x).min())

    for corner, pairs in zones.items():
        for left, right in pairs:
            breaks = sorted({x for x in {*edges, *problem.kinks} if left <= x <= right})
            for a, b in zip(breaks, breaks[1:]):
                kinds = tuple(ROOT if x in edges else LOG for x in (a, b))
                found += [(corner, *row) for row in graded(a, b, kinds, (way(a), way(b)))]
    corner, e, h, kind = (np.array(entry) for entry in zip(*found))
    return Mesh(corner, e, h, kind, order)


def matrix(problem, panels, x, corner):
    """Gaps of one corner at x (n,) from all coefficients: array (n, panels*order)."""
    blocks = [
        rows(problem, panels, part, lambda s: problem.tables[corner, s])
        for part in np.array_split(x, 1 + len(x) // ROWS)
    ]
    return np.concatenate(blocks)


def rows(problem, panels, x, table):
    """Integrals at x (n,) of the kernels `table(corner of the source)` times the basis: array (n,
    panels*order).
    """
    found = _one_side(problem, panels, x, table)
    return found + _one_side(problem, panels.mirrored(), x, table) if problem.mirror else found


def _one_side(problem, panels, x, table):
    v, weights = gauss(panels.order + EXTRA)
    number = np.arange(len(panels.e))
    source = panels.x(number[:, None], v)
    expansion = panels.basis(PLAIN, v) * weights[:, None]
    found = np.empty((len(x), len(number), panels.order))
    for corner in np.unique(panels.corner):
        own = panels.corner == corner
        kernel = table(corner)((x[:, None, None] - source[own]) / problem.ell)
        found[:, own] = (kernel @ expansion) * panels.density[own][:, None]
    along = (x[:, None] - panels.e) / panels.h
    root = panels.kind == ROOT
    near = np.where(root, (along > -1) & (along < 2), (along > -NEAR) & (along < 1 + NEAR)) | (
        panels.kind == LOG
    )
    for kind in (PLAIN, ROOT, LOG):
        for corner in np.unique(panels.corner):
            row, panel = np.nonzero(near & (panels.kind == kind) & (panels.corner == corner))
            for part in np.array_split(np.arange(len(row)), 1 + len(row) // PAIRS):
                found[row[part], panel[part]] = _near(
                    problem, panels, x[row[part]], panel[part], kind, table(corner)
                )
    return found.reshape(len(x), -1)


def _near(problem, panels, x, panel, kind, table):
    """Integrals over near panels, cut at the parameter v0 nearest to the target: array (pairs, order)."""
    share, rest, weights = tanh_sinh()
    e, h = panels.e[panel], panels.h[panel]
    along = np.clip((x - e) / h, 0, 1)
    outside = np.where((x - e) / h == along, 0.0, x - (e + h * along))[:, None]  # exactly 0 inside
    v0 = (np.sqrt(along) if kind == ROOT else along)[:, None]
    v = np.concatenate((v0 * rest, v0 + (1 - v0) * share), axis=1)
    back = np.concatenate((v0 * share, -(1 - v0) * share), axis=1)  # v0 - v
    weights = np.concatenate((v0 * weights, (1 - v0) * weights), axis=1)
    distance = outside + h[:, None] * (back * (v0 + v) if kind == ROOT else back)
    kernel = table(distance / problem.ell) * weights
    v = np.maximum(v, 1e-300)  # log of it, where v0 = 0 leaves nothing to integrate
    return np.einsum("pq,pqj->pj", kernel, panels.basis(kind, v)) * panels.density[panel][:, None]
