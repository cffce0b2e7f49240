"""A second code for frictionless contact of a rigid surface with a Cosserat half-space; it imports nothing
of the library.

Symbols: the energy (11), (12) of fields exp(i k x1) is minimised in depth with spectral elements, for each
wavenumber. Kernels: Hankel transforms of the symbols (Ogata's rule) give functions of r/ell alone; their
integrals over rectangles are integrals along the edges, by the divergence theorem, for whatever ratio of
cell and ell. Contact: rectangular grids ("islands") at places that the caller names, coupled through
Chebyshev nodes; projected conjugate gradients of Polonsky and Keer on the forces of all corners at the
load.

Units inside: mu = 1, ell = 1. Axes: x3 points out of the body, pressures are positive, `w = -u3`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from math import inf, pi, sqrt

import numpy as np
from scipy.fft import irfft2, next_fast_len, rfft2
from scipy.interpolate import CubicSpline
from scipy.special import jn_zeros, jv, yv

CURVATURE = 2.0  # gamma' of (12); alpha' = beta' = 0
DEGREE = 12  # of the elements in depth; 16 changes symbols by less than 1e-10
LAWS = ("unilateral", "microblock", "microclamped")


# ---- symbols ----


def _plane(k, lam, mu_c):
    """Hessian of the energy in (u1, u3, psi2, and their derivatives in depth), gamma_ij = u_i,j + e_ijk
    psi_k.
    """
    u1, u3, psi, u1z, u3z, psiz = np.eye(6, dtype=complex)
    g11, g33, g13, g31 = 1j * k * u1, u3z, u1z - psi, 1j * k * u3 + psi
    terms = [(lam, g11 + g33), (2, g11), (2, g33), (1, g13 + g31), (mu_c, g13 - g31)]
    terms += [(CURVATURE, 1j * k * psi), (CURVATURE, psiz)]
    return sum(c * np.outer(g.conj(), g) for c, g in terms)


def _across(k, lam, mu_c):
    """The same in (u2, psi1, psi3)."""
    u2, psi1, psi3, u2z, psi1z, psi3z = np.eye(6, dtype=complex)
    g12, g21, g23, g32 = psi3, 1j * k * u2 - psi3, u2z + psi1, -psi1
    terms = [(1, g12 + g21), (mu_c, g12 - g21), (1, g23 + g32), (mu_c, g23 - g32)]
    terms += [(CURVATURE, g) for g in (1j * k * psi1, 1j * k * psi3, psi1z, psi3z)]
    return sum(c * np.outer(g.conj(), g) for c, g in terms)


@lru_cache
def _element(degree):
    """Values and derivatives of Lagrange polynomials of Chebyshev-Lobatto nodes on [0, 1] at Gauss points;
    weights.
    """
    nodes = (1 - np.cos(pi * np.arange(degree + 1) / degree)) / 2
    t, w = np.polynomial.legendre.leggauss(degree + 2)
    t, w = (t + 1) / 2, w / 2
    inverse = np.linalg.inv(np.polynomial.chebyshev.chebvander(2 * nodes - 1, degree))
    value = np.polynomial.chebyshev.chebvander(2 * t - 1, degree) @ inverse
    slope = np.stack(
        [
            np.polynomial.chebyshev.chebval(2 * t - 1, np.polynomial.chebyshev.chebder(c))
            for c in np.eye(degree + 1)
        ]
    )
    return value, 2 * slope.T @ inverse, w


def compliance(hessian, k, top, degree=DEGREE):
    """Values of the fields `top` at the surface under unit loads conjugate to them; the bottom is clamped
    at 20/k, and each element is condensed to its upper end, the deepest first.
    """
    edges = [0.0, min(1.0, 1.0 / k)]
    while edges[-1] < 20 / k:  # what reaches the bottom is exp(-40) of what counts
        edges.append(2 * edges[-1])
    (value, slope, w), below, size = _element(degree), np.zeros((0, 0)), 3 * degree
    for h in np.diff(edges)[::-1]:
        b = np.stack([value, -slope / h])  # depth counts downwards, x3 upwards
        block = np.einsum("aqi,bqj,afbg,q->ifjg", b, b, hessian.reshape(2, 3, 2, 3), w * h, optimize=True)
        block = block.reshape(size + 3, size + 3)[: size + len(below), : size + len(below)]
        block[size:, size:] += below
        below = block[:3, :3] - block[:3, 3:] @ np.linalg.solve(block[3:, 3:], block[3:, :3])
    return np.linalg.inv(below)[np.ix_(top, top)]


def symbol(k, nu, beta):
    """U, U under psi = 0, v, W across and W along k of one wavenumber: w = U p - i v M_perp, psi_perp = i v
    p + W M_perp.
    """
    lam, mu_c = 2 * nu / (1 - 2 * nu), beta / (2 - beta)
    s = compliance(_plane(k, lam, mu_c), k, [1, 2])
    clamped = s[0, 0].real - abs(s[0, 1]) ** 2 / s[1, 1].real
    along = compliance(_across(k, lam, mu_c), k, [1])[0, 0].real
    return s[0, 0].real, clamped, s[0, 1].imag, s[1, 1].real, along


@lru_cache
def symbols(nu, beta):
    """Splines in ln k of k U, k Uc, (1 + k) v, (1 + k) W, (1 + k) W_par, which tend to constants at both
    ends.
    """
    k = np.geomspace(1e-6, 1e6, 133)
    u, c, v, w, along = np.transpose([symbol(each, nu, beta) for each in k])
    spline = CubicSpline(np.log(k), np.transpose([k * u, k * c, (1 + k) * v, (1 + k) * w, (1 + k) * along]))

    def at(q):
        a, b, c, d, e = np.moveaxis(spline(np.clip(np.log(q), *np.log(k[[0, -1]]))), -1, 0)
        return a / q, b / q, c / (1 + q), d / (1 + q), e / (1 + q)

    return at


# ---- kernels ----


@lru_cache
def ogata(order, step=0.001, terms=5000):
    """Nodes x and weights of integrals of f(x) J_order(x) over x > 0 (Ogata 2005), f smooth in ln x."""
    zeros = jn_zeros(order, terms)
    t = step * zeros / pi
    inner = np.minimum(pi / 2 * np.sinh(t), 300)
    x = zeros * np.tanh(inner)
    slope = np.tanh(inner) + t * pi / 2 * np.cosh(t) / np.cosh(inner) ** 2
    weights = pi * yv(order, zeros) / jv(order + 1, zeros) * jv(order, x) * slope
    counts = abs(weights) > 1e-25  # far out the nodes are the zeros themselves
    return x[counts], weights[counts]


@dataclass(frozen=True)
class Kernels:
    """Functions of r that all kernels are made of, in a table over ln r; lengths in ell, stresses in mu.

    force(r) = int_0^r G s ds of the displacement G(r) under a unit force, phi(r) with psi = (-d2, d1) phi,
    moment(r) as force(r) for the isotropic part of psi under moments, turn(r) its rest: d_j(x_i/r turn).
    """

    table: CubicSpline
    ends: tuple[float, float]

    def __call__(self, r, derivative=False):
        x = np.log(np.clip(r, *self.ends))
        f, phi, w, t = np.moveaxis(self.table(x), -1, 0)
        q = 1 + r
        values = f * r, phi / q, w * r / q, t / q**2
        if not derivative:
            return values
        fl, phil, wl, tl = np.moveaxis(self.table(x, 1), -1, 0)
        inside = (r > self.ends[0]) & (r < self.ends[1])
        fl, phil, wl, tl = (each * inside for each in (fl, phil, wl, tl))
        return values, (f + fl, (phil / r - phi / q) / q, (wl + w / q) / q, (tl / r - 2 * t / q) / q**2)


@lru_cache
def kernels(nu, beta, clamped=False):
    at = symbols(nu, beta)
    radii = np.geomspace(1e-5, 1e5, 161)
    column = 1 if clamped else 0
    ends = [at(k)[column] * k for k in (1e-6, 1e6)]

    x, weights = ogata(1)

    def integrals(r):
        values = at(x / r)
        near = 1 - (sqrt(1 + 1 / r**2) - 1 / r)  # of (1 - exp(-k))/k, which has both ends right
        rest = (values[column] * x / r - ends[0] + (ends[1] - ends[0]) * np.expm1(-x / r)) / x
        f = ends[0] + (ends[1] - ends[0]) * near + rest @ weights
        if clamped:
            return f, 0, 0, 0
        _, _, v, w, along = values
        slope = -(v * x / r) @ weights  # of phi over ln r
        return f, slope, w @ weights * (1 + r) / r, (along - w) @ weights * (1 + r) ** 2 / r

    rows = np.array([integrals(r) for r in radii]) / (2 * pi)
    phi = CubicSpline(np.log(radii), rows[:, 1]).antiderivative()(np.log(radii))
    rows[:, 1] = (phi - phi[-1] - rows[-1, 1]) * (1 + radii)  # phi is like 1/r far away
    return Kernels(CubicSpline(np.log(radii), rows), (radii[0], radii[-1]))


def cell_kernels(table, n, sides, moments):
    """Integrals of the kernels over cells at offsets (-n1..n1-1, -n2..n2-1): array (3, 3) or (1, 1) of (2
    n1, 2 n2).

    Components are (w, psi1, psi2) under (p, M1, M2).
    """
    t, weights = np.polynomial.legendre.leggauss(6)
    total = {}

    def edges(axis):
        """Contributions of the edges across `axis`: each integral along them, differences taken later."""
        a, b = axis, 1 - axis
        at = (np.arange(-n[a], n[a] + 1) - 0.5) * sides[a]
        along = (np.arange(-n[b], n[b])[:, None] + t / 2) * sides[b]
        x = np.broadcast_to(at[:, None, None], (len(at), *along.shape))
        y = np.broadcast_to(along, x.shape)
        r = np.hypot(x, y)
        force, phi, moment, turn = table(r)
        line = {"U": force * x / r**2}
        if moments:
            line |= {"phi": phi, "W": moment * x / r**2, "same": x / r * turn, "other": y / r * turn}
        for name, value in line.items():
            integral = np.diff(value @ (weights * sides[b] / 2), axis=0)
            total[name, axis] = integral if axis == 0 else integral.T

    edges(0), edges(1)
    u = total["U", 0] + total["U", 1]
    if not moments:
        return u[None, None]
    iso = total["W", 0] + total["W", 1]
    w = iso + total["same", 0], iso + total["same", 1], total["other", 0]
    return tensor(u, -total["phi", 1], total["phi", 0], *w)


def point_kernels(table, x, y, moments):
    """The same of point loads, at offsets (x, y) of target from source."""
    r = np.hypot(x, y)
    (_, _, _, turn), (fr, phir, wr, tr) = table(r, derivative=True)
    if not moments:
        return (fr / r)[None, None]
    c, s, rest, iso = x / r, y / r, tr - turn / r, (wr + turn) / r
    return tensor(fr / r, -phir * s, phir * c, iso + c * c * rest, iso + s * s * rest, c * s * rest)


def tensor(u, psi1, psi2, w11, w22, w12):
    """(w, psi1, psi2) under (p, M1, M2); a moment moves the surface as a pressure turns it."""
    return np.array([[u, -psi1, -psi2], [psi1, w11, w12], [psi2, w12, w22]])


# ---- islands ----

NODES = 7  # Chebyshev nodes along a side: what lies a side away is met to 1e-5


@dataclass(frozen=True)
class Box:
    """A rectangle: its middle and its half-widths."""

    x: float
    y: float
    a: float
    b: float

    def gap(self, other):
        return max(abs(self.x - other.x) - self.a - other.a, abs(self.y - other.y) - self.b - other.b)

    def with_(self, other):
        left, right = min(self.x - self.a, other.x - other.a), max(self.x + self.a, other.x + other.a)
        low, high = min(self.y - self.b, other.y - other.b), max(self.y + self.b, other.y + other.b)
        return Box((left + right) / 2, (low + high) / 2, (right - left) / 2, (high - low) / 2)


def merged(boxes):
    """Boxes nearer than a quarter of the smaller one's side become one."""
    boxes = list(boxes)
    for i, first in enumerate(boxes):
        for j in range(i):
            other = boxes[j]
            if first.gap(other) < 0.5 * min(max(first.a, first.b), max(other.a, other.b)):
                rest = [each for k, each in enumerate(boxes) if k not in (i, j)]
                return merged([*rest, first.with_(other)])
    return boxes


class Island:
    """Cells of a box, with their own response."""

    def __init__(self, box, n, table, moments):
        longer = max(box.a, box.b)
        self.box = box
        self.n = tuple(max(16, int(round(n * side / longer))) for side in (box.a, box.b))
        if longer > 6 * min(box.a, box.b):  # a long box has long cells
            self.n = tuple(n if side == longer else max(16, n // 4) for side in (box.a, box.b))
        self.sides = 2 * box.a / self.n[0], 2 * box.b / self.n[1]
        self.area = self.sides[0] * self.sides[1]
        self.x, self.y = (
            m + (np.arange(k) - (k - 1) / 2) * s for m, k, s in zip((box.x, box.y), self.n, self.sides)
        )
        full = cell_kernels(table, self.n, self.sides, moments)
        self.shape = tuple(next_fast_len(2 * k, real=True) for k in self.n)
        kernel = np.zeros((*full.shape[:2], *self.shape))
        i, j = (np.arange(-k, k) % m for k, m in zip(self.n, self.shape))
        kernel[:, :, i[:, None], j] = full
        self.scale = full[0, 0, self.n[0], self.n[1]]
        self.kernel = rfft2(kernel)
        nodes = np.cos(pi * (np.arange(NODES) + 0.5) / NODES)
        self.nodes = [
            g.ravel() for g in np.meshgrid(box.x + box.a * nodes, box.y + box.b * nodes, indexing="ij")
        ]
        van = np.linalg.inv(np.polynomial.chebyshev.chebvander(nodes, NODES - 1))
        self.bx = np.polynomial.chebyshev.chebvander((self.x - box.x) / box.a, NODES - 1) @ van
        self.by = np.polynomial.chebyshev.chebvander((self.y - box.y) / box.b, NODES - 1) @ van

    def own(self, loads):
        spectrum = rfft2(loads, self.shape)
        return irfft2(np.einsum("abij,bij->aij", self.kernel, spectrum), self.shape)[
            :, : self.n[0], : self.n[1]
        ]

    def gathered(self, loads):
        return np.einsum("xi,cxy,yj->cij", self.bx, loads * self.area, self.by).reshape(len(loads), -1)

    def spread(self, values):
        return np.einsum("xi,cij,yj->cxy", self.bx, values.reshape(len(values), NODES, NODES), self.by)


class Sheet:
    """All cells of a period, n x n, or a row of (n, 1); without a mean displacement."""

    def __init__(self, period, n, nu, beta, law):
        self.n = (n1, n2) = np.broadcast_to(n, 2).tolist()
        self.area = period**2 / n1 / n2
        self.x, self.y = ((np.arange(each) + 0.5) * period / each for each in self.n)
        waves, across = np.fft.fftfreq(n1, 1 / n1)[:, None], np.fft.rfftfreq(n2, 1 / n2)
        total, aliases = 0.0, 3 if n2 == 1 else 1  # on either side, of the cells' edges
        for i, j in product(range(-aliases, aliases + 1), (-1, 0, 1)):
            a, b = waves + i * n1, across + j * n2
            symbols_ = self._symbols(2 * pi / period * a, 2 * pi / period * b, nu, beta, law)
            total = total + symbols_ * np.sinc(a / n1) * np.sinc(b / n2)
        total[:, :, 0, 0] = 0
        if law == "microblock":  # a uniform moment turns all blocks alike
            total[1, 1, 0, 0] = total[2, 2, 0, 0] = symbols(nu, beta)(1e-6)[3]
        self.kernel, self.scale = total, period / n1

    @staticmethod
    def _symbols(k1, k2, nu, beta, law):
        k = np.maximum(np.hypot(k1, k2), 1e-30)
        u, clamped, v, w, along = symbols(nu, beta)(np.maximum(k, 1e-6))
        if law != "microblock":
            return np.array([[clamped if law == "microclamped" else u]])
        c, s = k1 / k, k2 / k
        turns = w * s * s + along * c * c, w * c * c + along * s * s, (along - w) * c * s
        return tensor(u, -1j * v * s, 1j * v * c, *turns)

    def own(self, loads):
        return irfft2(np.einsum("abij,bij->aij", self.kernel, rfft2(loads)), self.n)

    def gathered(self, loads):
        return np.zeros((len(loads), 1))

    def spread(self, values):
        return 0.0


class Model:
    """The response of all islands to the forces of all corners, and the initial gaps; without boxes of a
    whole period.
    """

    def __init__(self, height, boxes, n, nu, beta, law, period=None, features=()):
        moments = law == "microblock"
        self.corners = [(a, b) for a in (-1, 1) for b in (-1, 1)] if moments else [(0, 0)]
        self.far = {}
        if not boxes:
            self.islands = [Sheet(period, n, nu, beta, law)]
        else:
            table = kernels(nu, beta, law == "microclamped")
            self.islands = [Island(box, self._cells(box, n, features), table, moments) for box in boxes]
            for i, first in enumerate(self.islands):
                for j, other in enumerate(self.islands[:i]):
                    self.far[i, j] = self._coupling(table, first, other, moments)
        self.height = [np.array([height(*xy) for xy in self.places(each)]) for each in self.islands]

    def _cells(self, box, n, features):
        """At least n/6 cells across the narrowest feature (x, y, width) in the box, if 400 are enough."""
        reach = 0.5 if len(self.corners) > 1 else 0.0
        widths = [
            w for x, y, w in features if abs(x - box.x) < box.a + reach and abs(y - box.y) < box.b + reach
        ]
        return min(4 * n, max(n, int(n / 6 * 2 * max(box.a, box.b) / min(widths, default=inf))))

    def places(self, island):
        """x1 and x2 of the cells of an island at each corner."""
        return [np.meshgrid(island.x + a / 2, island.y + b / 2, indexing="ij") for a, b in self.corners]

    def _coupling(self, table, first, other, moments):
        """Kernel from nodes or cells of `other` to those of `first`: of the smaller box nodes, of the
        larger cells.
        """
        near = first.box.gap(other.box) < max(first.box.a, first.box.b, other.box.a, other.box.b)
        large, small = (
            (first, other)
            if max(first.box.a, first.box.b) >= max(other.box.a, other.box.b)
            else (other, first)
        )

        def places(island):
            if near and island is large:
                return [g.ravel() for g in np.meshgrid(island.x, island.y, indexing="ij")]
            return island.nodes

        (x, y), (xi, eta) = places(first), places(other)
        dx, dy = x[:, None] - xi, y[:, None] - eta
        return point_kernels(table, dx, dy, moments)

    def response(self, forces):
        """Displacements of the corners into the body under their pressures (lists of (corners, n1, n2))."""
        loads = [self._resultants(f) for f in forces]
        fields = [island.own(load) for island, load in zip(self.islands, loads)]
        nodes = [island.gathered(load) for island, load in zip(self.islands, loads)]
        at_nodes = [np.zeros_like(each) for each in nodes]
        for (i, j), kernel in self.far.items():
            for to, of, way in ((i, j, "abts,bs->at"), (j, i, "abts,at->bs")):
                source, target = (kernel.shape[3 if k == j else 2] == NODES**2 for k in (of, to))
                cells = (loads[of] * self.islands[of].area).reshape(len(loads[of]), -1)
                values = np.einsum(way, kernel, nodes[of] if source else cells, optimize=True)
                into = at_nodes if target else fields
                into[to] += values.reshape(into[to].shape)
        fields = [f + island.spread(v) for f, island, v in zip(fields, self.islands, at_nodes)]
        return [self._at_corners(f) for f in fields]

    def _resultants(self, force):
        if len(self.corners) == 1:
            return force
        m1 = sum(-b / 2 * f for (a, b), f in zip(self.corners, force))
        m2 = sum(a / 2 * f for (a, b), f in zip(self.corners, force))
        return np.array([force.sum(0), m1, m2])

    def _at_corners(self, field):
        if len(self.corners) == 1:
            return field
        w, psi1, psi2 = field
        return np.array([w - b / 2 * psi1 + a / 2 * psi2 for a, b in self.corners])


@dataclass
class Solved:
    """Pressures of the corners on each island at a load; lengths in ell, stresses in mu."""

    model: Model
    forces: list
    gaps: list
    approach: float
    residual: float

    def loads(self, summits, period):
        """Force of the corners that are nearest to each of the summits."""
        return sum(
            island.area * np.bincount(nearest(*corner, summits, period).ravel(), f.ravel(), len(summits))
            for island, force in zip(self.model.islands, self.forces)
            for corner, f in zip(self.model.places(island), force)
        )

    @property
    def peak(self):
        return max(f.sum(0).max() for f in self.forces)

    @property
    def norm(self):
        """Square root of the integral of the pressure's square."""
        return sqrt(sum(i.area * (f.sum(0) ** 2).sum() for i, f in zip(self.model.islands, self.forces)))

    def regrown(self):
        """Boxes about what presses, with a rim of two cells and 6 %; half as large again where the rim
        presses.
        """
        boxes, again = [], False
        for island, force in zip(self.model.islands, self.forces):
            on = force.sum(0) > 0
            i, j = np.nonzero(on)
            if isinstance(island, Sheet) or not len(i):
                continue
            if on[[0, -1]].any() or on[:, [0, -1]].any():
                boxes.append(Box(island.box.x, island.box.y, 1.4 * island.box.a, 1.4 * island.box.b))
                again = True
            else:
                (left, right), (low, high) = island.x[[i.min(), i.max()]], island.y[[j.min(), j.max()]]
                a, b = (
                    1.06 * (right - left) / 2 + 2 * island.sides[0],
                    1.06 * (high - low) / 2 + 2 * island.sides[1],
                )
                boxes.append(Box((left + right) / 2, (low + high) / 2, a, b))
        return merged(boxes), again


def gradients(model, load, tolerance=3e-6, limit=500):
    """Polonsky and Keer's projected conjugate gradients, on pressures scaled by each island's own
    compliance.
    """
    height, size = np.concatenate([h.ravel() for h in model.height]), [h.size for h in model.height]
    open_ = np.isfinite(height)
    height[~open_] = 0
    # p = metric * dual: steepest descent sees equal stiffness everywhere
    area, metric = (
        np.repeat([f(i) for i in model.islands], size) for f in (lambda i: i.area, lambda i: 1 / i.scale)
    )

    def split(p):
        parts = np.split(p, np.cumsum(size)[:-1])
        return [part.reshape(h.shape) for part, h in zip(parts, model.height)]

    def times(p):
        return np.concatenate([d.ravel() for d in model.response(split(p))])

    low = height[open_].min()
    reach = np.sort(height[open_])[min(open_.sum() - 1, max(8, open_.sum() // 8))] - low
    p = np.where(open_, np.sqrt(np.maximum(reach - (height - low), 0)) + (height <= low), 0.0)
    p *= load / (area @ p)
    t, before, delta = np.zeros_like(p), 1.0, 0.0
    for _ in range(limit):
        displacement = times(p)
        gap = displacement + height
        on = p > 0
        weight = area * metric * on
        level = (weight @ gap) / weight.sum()
        g = gap - level
        deep = max(np.abs(displacement[on]).max(), 1e-300)
        error = (area * p) @ np.abs(g) / load / deep
        worst = max(0.0, -(g[open_ & ~on]).min(initial=0.0)) / deep
        if error < tolerance and worst < 30 * tolerance:
            break
        square = weight @ g**2
        t = np.where(on, metric * g + delta * square / before * t, 0.0)
        before = square
        image = times(t)
        image = image - (weight @ image) / weight.sum()
        tau = ((area * g) @ t) / ((area * image) @ t)
        p = np.where(on, np.maximum(p - tau * t, 0.0), p)
        more = open_ & (p == 0) & (g < 0)
        delta = 0.0 if more.any() else 1.0
        p[more] -= tau * (metric * g)[more]
        p *= load / (area @ p)
    return Solved(model, split(p), split(g), level, max(error, worst))


# ---- answers ----


def answer(height, boxes, load, solid, law, summits=(), period=None, n=96, features=(), fixed=False):
    """The state under height(x1, x2) at places that `boxes` contain, all of them: (x, y, half-widths) of
    obstacle points.

    Returns approach, L2 norm and peak of the pressure, load on each summit, and `bars` of what is not known
    of them: solid = (E, nu, beta, ell); loads are those of the corners nearest to a summit (x, y). Bars
    come from grids of n/2 and n cells along each box, which is made to fit what presses unless it is `fixed`.
    """
    E, nu, beta, ell = solid
    mu = E / 2 / (1 + nu)

    def scaled(x, y):
        return height(ell * x, ell * y) / ell

    features, peaks = ([tuple(v / ell for v in each) for each in some] for some in (features, summits))
    sites = [Box(*(v / ell for v in box)) for box in boxes]
    if law == "microblock":
        sites = [Box(s.x - a / 2, s.y - b / 2, s.a, s.b) for s in sites for a in (-1, 1) for b in (-1, 1)]

    def model(boxes, n):
        return Model(scaled, boxes, n, nu, beta, law, period and period / ell, features)

    force = load / mu / ell**2
    sites = merged(sites)
    for cells in (24, 32) if sites and not fixed else ():
        sites, _ = gradients(model(sites, cells), force, 1e-4).regrown()
    pair = []
    for cells in (n // 2, n):
        for _ in range(4):
            found = gradients(model(sites, cells), force)
            boxes, again = found.regrown()
            if fixed or not again:
                break
            sites = boxes
        pair.append(found)
    coarse, fine = (
        {
            "approach": s.approach * ell,
            "norm": s.norm * mu * ell,
            "peak": s.peak * mu,
            "loads": (s.loads(peaks, period and period / ell) * mu * ell**2).tolist() if summits else [],
        }
        for s in pair
    )
    bars = {name: abs(coarse[name] / fine[name] - 1) for name in ("approach", "norm", "peak")}
    shares = np.abs(np.subtract(coarse["loads"], fine["loads"])) / load
    bars["loads"] = shares.max(initial=0.0)
    # twice the change, 1e-4 of kernels and iteration
    bars = {name: 2 * float(bar) + 1e-4 for name, bar in bars.items()}
    return fine | {"bars": bars, "residual": max(s.residual for s in pair)}


def nearest(x, y, summits, period=None):
    """The number of the summit that is nearest to each place."""
    period = period or 1e300
    ways = [(x - a, y - b) for a, b in summits]
    return np.argmin([sum((d - period * np.round(d / period)) ** 2 for d in way) for way in ways], axis=0)


def hertz(E, nu, R, load):
    """Radius, peak pressure and approach of classical contact with a sphere."""
    star = E / (1 - nu**2)
    a = (3 * load * R / 4 / star) ** (1 / 3)
    return a, 3 * load / (2 * pi * a * a), a * a / R
