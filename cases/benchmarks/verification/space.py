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

from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import product
from math import inf, pi, sqrt

import numpy as np
from numpy.polynomial.chebyshev import chebder, chebval, chebvander
from scipy.fft import irfft2, next_fast_len, rfft2
from scipy.interpolate import CubicSpline
from scipy.special import jn_zeros, jv, yv

CURVATURE = 2.0  # gamma' of (12); alpha' = beta' = 0
DEGREE = 12  # of the elements in depth; 16 changes symbols by less than 1e-10
NODES = 7  # Chebyshev nodes along a side of an island: what lies a side away is met to 1e-5
TOLERANCE = 3e-6  # of complementarity, over load and displacement
KNOWN = 1e-4  # kernels and iterations, over any figure
LAWS = ("unilateral", "microblock", "microclamped")


# ---- symbols ----


def moduli(nu, beta):
    """Lamé's first and the antisymmetric modulus over mu."""
    return 2 * nu / (1 - 2 * nu), beta / (2 - beta)


def energy(terms):
    """Hessian of a sum of modulus times square of a measure of strain, (modulus, row) each."""
    return sum(modulus * np.outer(row.conj(), row) for modulus, row in terms)


def plane_energy(k, lam, mu_c):
    """Hessian of the energy in (u1, u3, psi2, and their derivatives in depth), gamma_ij = u_i,j + e_ijk
    psi_k.
    """
    u1, u3, psi, u1z, u3z, psiz = np.eye(6, dtype=complex)
    g11 = 1j * k * u1
    g33 = u3z
    g13 = u1z - psi
    g31 = 1j * k * u3 + psi
    curvatures = [(CURVATURE, 1j * k * psi), (CURVATURE, psiz)]
    return energy([(lam, g11 + g33), (2, g11), (2, g33), (1, g13 + g31), (mu_c, g13 - g31), *curvatures])


def across_energy(k, mu_c):
    """The same in (u2, psi1, psi3)."""
    u2, psi1, psi3, u2z, psi1z, psi3z = np.eye(6, dtype=complex)
    g12 = psi3
    g21 = 1j * k * u2 - psi3
    g23 = u2z + psi1
    g32 = -psi1
    curvatures = [(CURVATURE, row) for row in (1j * k * psi1, 1j * k * psi3, psi1z, psi3z)]
    return energy([(1, g12 + g21), (mu_c, g12 - g21), (1, g23 + g32), (mu_c, g23 - g32), *curvatures])


@lru_cache
def _element(degree):
    """Values and derivatives of Lagrange polynomials of Chebyshev-Lobatto nodes on [0, 1] at Gauss points;
    weights.
    """
    nodes = (1 - np.cos(pi * np.arange(degree + 1) / degree)) / 2
    points, weights = np.polynomial.legendre.leggauss(degree + 2)
    points = 2 * ((points + 1) / 2) - 1  # rounded as points of [0, 1]
    inverse = np.linalg.inv(chebvander(2 * nodes - 1, degree))
    values = chebvander(points, degree) @ inverse
    slopes = np.stack([chebval(points, chebder(row)) for row in np.eye(degree + 1)])
    return values, 2 * slopes.T @ inverse, weights / 2


def compliance(hessian, k, top, degree=DEGREE):
    """Values of the fields `top` at the surface under unit loads conjugate to them; the bottom is clamped
    at 20/k, and each element is condensed to its upper end, the deepest first.
    """
    edges = [0.0, min(1.0, 1.0 / k)]
    while edges[-1] < 20 / k:  # what reaches the bottom is exp(-40) of what counts
        edges.append(2 * edges[-1])
    values, slopes, weights = _element(degree)
    size = 3 * degree
    below = np.zeros((0, 0))
    energy = hessian.reshape(2, 3, 2, 3)
    for h in np.diff(edges)[::-1]:
        basis = np.stack([values, -slopes / h])  # depth counts downwards, x3 upwards
        block = np.einsum("aqi,bqj,afbg,q->ifjg", basis, basis, energy, weights * h, optimize=True)
        block = block.reshape(size + 3, size + 3)[: size + len(below), : size + len(below)]
        block[size:, size:] += below
        below = block[:3, :3] - block[:3, 3:] @ np.linalg.solve(block[3:, 3:], block[3:, :3])
    return np.linalg.inv(below)[np.ix_(top, top)]


def symbol(k, nu, beta):
    """U, U under psi = 0, v, W across and W along k of one wavenumber: w = U p - i v M_perp, psi_perp = i v
    p + W M_perp.
    """
    lam, mu_c = moduli(nu, beta)
    plane = compliance(plane_energy(k, lam, mu_c), k, [1, 2])
    u = plane[0, 0].real
    w = plane[1, 1].real
    along = compliance(across_energy(k, mu_c), k, [1])[0, 0].real
    return u, u - abs(plane[0, 1]) ** 2 / w, plane[0, 1].imag, w, along


@lru_cache
def symbols(nu, beta):
    """Splines in ln k of k U, k Uc, (1 + k) v, (1 + k) W, (1 + k) W_par, which tend to constants at both
    ends.
    """
    k = np.geomspace(1e-6, 1e6, 133)
    scales = np.array([k, k, 1 + k, 1 + k, 1 + k]).T
    spline = CubicSpline(np.log(k), scales * [symbol(wave, nu, beta) for wave in k])

    def at(q):
        u, clamped, v, w, along = np.moveaxis(spline(np.clip(np.log(q), *np.log(k[[0, -1]]))), -1, 0)
        return u / q, clamped / q, v / (1 + q), w / (1 + q), along / (1 + q)

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

    def _scaled(self, r, derivative=0):
        return np.moveaxis(self.table(np.log(np.clip(r, *self.ends)), derivative), -1, 0)

    def values(self, r):
        """(force, phi, moment, turn) at r."""
        force, phi, moment, turn = self._scaled(r)
        q = 1 + r
        return force * r, phi / q, moment * r / q, turn / q**2

    def slopes(self, r):
        """Their derivatives at r."""
        force, phi, moment, turn = self._scaled(r)
        inside = (r > self.ends[0]) & (r < self.ends[1])
        in_force, in_phi, in_moment, in_turn = self._scaled(r, 1) * inside
        q = 1 + r
        return (
            force + in_force,
            (in_phi / r - phi / q) / q,
            (in_moment + moment / q) / q,
            (in_turn / r - 2 * turn / q) / q**2,
        )


def force_transform(at, column, r):
    """Hankel transform of a symbol of `symbols` that falls like 1/k: the force of `Kernels`."""
    x, weights = ogata(1)
    low, high = (at(k)[column] * k for k in (1e-6, 1e6))
    near = 1 - (sqrt(1 + 1 / r**2) - 1 / r)  # of (1 - exp(-k))/k, which has both ends right
    remainder = (at(x / r)[column] * x / r - low + (high - low) * np.expm1(-x / r)) / x
    return low + (high - low) * near + remainder @ weights


def moment_transforms(at, r):
    """Hankel transforms of v, W and their difference: the slope of phi over ln r, moment and turn, scaled."""
    x, weights = ogata(1)
    _, _, v, w, along = at(x / r)
    slope = -(v * x / r) @ weights
    return slope, w @ weights * (1 + r) / r, (along - w) @ weights * (1 + r) ** 2 / r


@lru_cache
def kernels(nu, beta, clamped=False):
    at = symbols(nu, beta)
    radii = np.geomspace(1e-5, 1e5, 161)
    rows = np.zeros((len(radii), 4))
    rows[:, 0] = [force_transform(at, int(clamped), r) for r in radii]
    if not clamped:
        rows[:, 1:] = [moment_transforms(at, r) for r in radii]
    rows /= 2 * pi
    phi = CubicSpline(np.log(radii), rows[:, 1]).antiderivative()(np.log(radii))
    rows[:, 1] = (phi - phi[-1] - rows[-1, 1]) * (1 + radii)  # phi is like 1/r far away
    return Kernels(CubicSpline(np.log(radii), rows), (radii[0], radii[-1]))


def edge_values(table, x, y, moments):
    """{name: what is integrated along the edges of cells across x}."""
    r = np.hypot(x, y)
    force, phi, moment, turn = table.values(r)
    if not moments:
        return {"U": force * x / r**2}
    return {
        "U": force * x / r**2,
        "phi": phi,
        "W": moment * x / r**2,
        "same": x / r * turn,
        "other": y / r * turn,
    }


def edge_integrals(table, n, sides, axis, moments):
    """{name: integrals along the edges of cells across `axis`, one edge less the one before}."""
    points, weights = np.polynomial.legendre.leggauss(6)
    across = (np.arange(-n[axis], n[axis] + 1) - 0.5) * sides[axis]
    along = (np.arange(-n[1 - axis], n[1 - axis])[:, None] + points / 2) * sides[1 - axis]
    values = edge_values(table, *np.broadcast_arrays(across[:, None, None], along), moments)
    integrals = {
        name: np.diff(value @ (weights * sides[1 - axis] / 2), axis=0) for name, value in values.items()
    }
    return integrals if axis == 0 else {name: value.T for name, value in integrals.items()}


def cell_kernels(table, n, sides, moments):
    """Integrals of the kernels over cells at offsets (-n1..n1-1, -n2..n2-1): array (3, 3) or (1, 1) of (2
    n1, 2 n2).

    Components are (w, psi1, psi2) under (p, M1, M2).
    """
    first, second = (edge_integrals(table, n, sides, axis, moments) for axis in (0, 1))
    u = first["U"] + second["U"]
    if not moments:
        return u[None, None]
    w = first["W"] + second["W"]
    return tensor(u, -second["phi"], first["phi"], w + first["same"], w + second["same"], first["other"])


def point_kernels(table, x, y, moments):
    """The same of point loads, at offsets (x, y) of target from source."""
    r = np.hypot(x, y)
    force, phi, moment, turn = table.slopes(r)
    if not moments:
        return (force / r)[None, None]
    c = x / r
    s = y / r
    ratio = table.values(r)[3] / r
    w = moment / r + ratio
    turn = turn - ratio
    return tensor(force / r, -phi * s, phi * c, w + c * c * turn, w + s * s * turn, c * s * turn)


def tensor(u, psi1, psi2, w11, w22, w12):
    """(w, psi1, psi2) under (p, M1, M2); a moment moves the surface as a pressure turns it."""
    return np.array([[u, -psi1, -psi2], [psi1, w11, w12], [psi2, w12, w22]])


# ---- islands ----


@dataclass(frozen=True)
class Box:
    """A rectangle: its middle and its half-widths."""

    x: float
    y: float
    a: float
    b: float

    @property
    def longer(self):
        return max(self.a, self.b)

    def gap(self, box):
        return max(abs(self.x - box.x) - self.a - box.a, abs(self.y - box.y) - self.b - box.b)

    def joined(self, box):
        """The smallest Box about two."""
        left = min(self.x - self.a, box.x - box.a)
        right = max(self.x + self.a, box.x + box.a)
        low = min(self.y - self.b, box.y - box.b)
        high = max(self.y + self.b, box.y + box.b)
        return Box((left + right) / 2, (low + high) / 2, (right - left) / 2, (high - low) / 2)


def merged(boxes):
    """Boxes nearer than a quarter of the smaller one's side become one."""
    boxes = list(boxes)
    for i, first in enumerate(boxes):
        for j, second in enumerate(boxes[:i]):
            if first.gap(second) < 0.5 * min(first.longer, second.longer):
                others = [box for number, box in enumerate(boxes) if number not in (i, j)]
                return merged([*others, first.joined(second)])
    return boxes


def cells_of(box, n):
    """Cells along both sides of a Box, n along the longer one; a long box has long cells."""
    if box.longer > 6 * min(box.a, box.b):
        return tuple(n if side == box.longer else max(16, n // 4) for side in (box.a, box.b))
    return tuple(max(16, int(round(n * side / box.longer))) for side in (box.a, box.b))


class Island:
    """Cells of a box, with their own response."""

    def __init__(self, box, n, table, moments):
        self.box = box
        self.n = cells_of(box, n)
        self.sides = 2 * box.a / self.n[0], 2 * box.b / self.n[1]
        self.area = self.sides[0] * self.sides[1]
        self.x, self.y = (
            middle + (np.arange(count) - (count - 1) / 2) * side
            for middle, count, side in zip((box.x, box.y), self.n, self.sides)
        )
        kernel = cell_kernels(table, self.n, self.sides, moments)
        self.scale = kernel[0, 0, self.n[0], self.n[1]]
        self.shape = tuple(next_fast_len(2 * count, real=True) for count in self.n)
        self.kernel = rfft2(self._cyclic(kernel))
        nodes = np.cos(pi * (np.arange(NODES) + 0.5) / NODES)
        grid = np.meshgrid(box.x + box.a * nodes, box.y + box.b * nodes, indexing="ij")
        self.nodes = [places.ravel() for places in grid]
        inverse = np.linalg.inv(chebvander(nodes, NODES - 1))
        self.in_x = chebvander((self.x - box.x) / box.a, NODES - 1) @ inverse
        self.in_y = chebvander((self.y - box.y) / box.b, NODES - 1) @ inverse

    def _cyclic(self, kernel):
        """A kernel at all offsets, in the order of a Fourier transform."""
        cyclic = np.zeros((*kernel.shape[:2], *self.shape))
        i, j = (np.arange(-count, count) % size for count, size in zip(self.n, self.shape))
        cyclic[:, :, i[:, None], j] = kernel
        return cyclic

    def response(self, loads):
        spectrum = np.einsum("abij,bij->aij", self.kernel, rfft2(loads, self.shape))
        return irfft2(spectrum, self.shape)[:, : self.n[0], : self.n[1]]

    def gathered(self, loads):
        """Loads on cells as forces on nodes."""
        return np.einsum("xi,cxy,yj->cij", self.in_x, loads * self.area, self.in_y).reshape(len(loads), -1)

    def expanded(self, values):
        """Fields at nodes as fields on cells."""
        return np.einsum("xi,cij,yj->cxy", self.in_x, values.reshape(len(values), NODES, NODES), self.in_y)


class Sheet:
    """All cells of a period, n x n; without a mean displacement."""

    def __init__(self, period, n, nu, beta, law):
        self.n = (n, n)
        self.area = period**2 / n / n
        self.x = self.y = (np.arange(n) + 0.5) * period / n
        self.scale = period / n
        along = np.fft.fftfreq(n, 1 / n)[:, None]
        across = np.fft.rfftfreq(n, 1 / n)
        self.kernel = 0.0
        for i, j in product((-1, 0, 1), (-1, 0, 1)):  # aliases of the cells' edges
            waves = along + i * n, across + j * n
            of_waves = self._symbols(*(2 * pi / period * wave for wave in waves), nu, beta, law)
            self.kernel = self.kernel + of_waves * np.sinc(waves[0] / n) * np.sinc(waves[1] / n)
        self.kernel[:, :, 0, 0] = 0
        if law == "microblock":  # a uniform moment turns all blocks alike
            self.kernel[[1, 2], [1, 2], 0, 0] = symbols(nu, beta)(1e-6)[3]

    @staticmethod
    def _symbols(k1, k2, nu, beta, law):
        k = np.maximum(np.hypot(k1, k2), 1e-30)
        u, clamped, v, w, along = symbols(nu, beta)(np.maximum(k, 1e-6))
        if law != "microblock":
            return np.array([[clamped if law == "microclamped" else u]])
        c = k1 / k
        s = k2 / k
        turns = w * s * s + along * c * c, w * c * c + along * s * s, (along - w) * c * s
        return tensor(u, -1j * v * s, 1j * v * c, *turns)

    def response(self, loads):
        return irfft2(np.einsum("abij,bij->aij", self.kernel, rfft2(loads)), self.n)

    def gathered(self, loads):
        return np.zeros((len(loads), 1))

    def expanded(self, values):
        return 0.0


# ---- contact ----


@dataclass(frozen=True)
class Problem:
    """A rigid surface and its load.

    Parameters
    ----------
    height : function of (x1, x2)
    boxes : (x, y, half-widths) of obstacle points, which contain all contacts; none of a whole period
    load : force
    solid : (E, nu, beta, ell)
    law : one of `LAWS`
    summits : places (x, y), whose loads are asked for
    period : of the surface, along x1 and x2
    features : (x, y, width) of what is narrow
    fixed : whether grids end where the boxes do
    """

    height: object
    boxes: list
    load: float
    solid: tuple
    law: str
    summits: tuple = ()
    period: float | None = None
    features: tuple = ()
    fixed: bool = False

    @property
    def unit(self):
        """mu and ell."""
        E, nu, _, ell = self.solid
        return E / 2 / (1 + nu), ell

    def scaled(self):
        """The problem in units mu = ell = 1; boxes are those of corners, as `Box`."""
        mu, ell = self.unit
        shifts = [(a / 2, b / 2) for a, b in self.corners]
        boxes = [Box(*(length / ell for length in box)) for box in self.boxes]
        return replace(
            self,
            height=lambda x, y: self.height(ell * x, ell * y) / ell,
            boxes=merged(Box(box.x - a, box.y - b, box.a, box.b) for box in boxes for a, b in shifts),
            load=self.load / mu / ell**2,
            summits=[tuple(length / ell for length in place) for place in self.summits],
            period=self.period and self.period / ell,
            features=[tuple(length / ell for length in feature) for feature in self.features],
        )

    @property
    def corners(self):
        """Places of the corners of a block, over half of ell."""
        return list(product((-1, 1), (-1, 1))) if self.law == "microblock" else [(0, 0)]


class Model:
    """The response of all islands to the forces of all corners, and the initial gaps, of a scaled problem;
    without boxes of a whole period.
    """

    def __init__(self, problem, boxes, n):
        _, nu, beta, _ = problem.solid
        law = problem.law
        self.problem = problem
        self.corners = problem.corners
        self.moments = law == "microblock"
        self.far = {}
        if not boxes:
            self.islands = [Sheet(problem.period, n, nu, beta, law)]
        else:
            table = kernels(nu, beta, law == "microclamped")
            self.islands = [Island(box, self._cells(box, n), table, self.moments) for box in boxes]
            for i, first in enumerate(self.islands):
                for j, second in enumerate(self.islands[:i]):
                    self.far[i, j] = self._coupling(table, first, second)
        self.height = [
            np.array([problem.height(*places) for places in self.places(island)]) for island in self.islands
        ]

    def _cells(self, box, n):
        """At least n/6 cells across the narrowest feature (x, y, width) in the box, if 400 are enough."""
        reach = 0.5 if self.moments else 0.0
        widths = [
            width
            for x, y, width in self.problem.features
            if abs(x - box.x) < box.a + reach and abs(y - box.y) < box.b + reach
        ]
        return min(4 * n, max(n, int(n / 6 * 2 * box.longer / min(widths, default=inf))))

    def places(self, island):
        """x1 and x2 of the cells of an island at each corner."""
        return [np.meshgrid(island.x + a / 2, island.y + b / 2, indexing="ij") for a, b in self.corners]

    def _coupling(self, table, first, second):
        """Kernel from nodes or cells of `second` to those of `first`: of the smaller box nodes, of the
        larger cells.
        """
        near = first.box.gap(second.box) < max(first.box.longer, second.box.longer)
        large = first if first.box.longer >= second.box.longer else second

        def places(island):
            if near and island is large:
                return [grid.ravel() for grid in np.meshgrid(island.x, island.y, indexing="ij")]
            return island.nodes

        to_x, to_y = places(first)
        from_x, from_y = places(second)
        return point_kernels(table, to_x[:, None] - from_x, to_y[:, None] - from_y, self.moments)

    def response(self, forces):
        """Displacements of the corners into the body under their pressures (lists of (corners, n1, n2))."""
        loads = [self._resultants(force) for force in forces]
        fields = [island.response(load) for island, load in zip(self.islands, loads)]
        nodes = [island.gathered(load) for island, load in zip(self.islands, loads)]
        at_nodes = [np.zeros_like(force) for force in nodes]
        for (i, j), kernel in self.far.items():
            for to, of, way in ((i, j, "abts,bs->at"), (j, i, "abts,at->bs")):
                sources = nodes[of]
                if kernel.shape[3 if of == j else 2] != NODES**2:
                    sources = loads[of].reshape(len(sources), -1) * self.islands[of].area
                field = at_nodes[to] if kernel.shape[3 if to == j else 2] == NODES**2 else fields[to]
                field += np.einsum(way, kernel, sources, optimize=True).reshape(field.shape)
        return [
            self._at_corners(field + island.expanded(values))
            for field, island, values in zip(fields, self.islands, at_nodes)
        ]

    def _resultants(self, force):
        if not self.moments:
            return force
        m1 = sum(-b / 2 * f for (a, b), f in zip(self.corners, force))
        m2 = sum(a / 2 * f for (a, b), f in zip(self.corners, force))
        return np.array([force.sum(0), m1, m2])

    def _at_corners(self, field):
        if not self.moments:
            return field
        w, psi1, psi2 = field
        return np.array([w - b / 2 * psi1 + a / 2 * psi2 for a, b in self.corners])


@dataclass
class Solution:
    """Pressures of the corners on each island at a load; lengths in ell, stresses in mu."""

    model: Model
    forces: list
    approach: float
    residual: float

    @property
    def loads(self):
        """Force of the corners that are nearest to each of the summits."""
        problem = self.model.problem
        return sum(
            island.area
            * np.bincount(
                nearest(*places, problem.summits, problem.period).ravel(),
                pressure.ravel(),
                len(problem.summits),
            )
            for island, force in zip(self.model.islands, self.forces)
            for places, pressure in zip(self.model.places(island), force)
        )

    @property
    def peak(self):
        return max(force.sum(0).max() for force in self.forces)

    @property
    def norm(self):
        """Square root of the integral of the pressure's square."""
        islands = self.model.islands
        return sqrt(sum(i.area * (force.sum(0) ** 2).sum() for i, force in zip(islands, self.forces)))

    def regrown(self):
        """(Boxes about what presses, with a rim of two cells and 6 %; whether some rim presses, which makes
        its box half as large again).
        """
        boxes = []
        grown = False
        for island, force in zip(self.model.islands, self.forces):
            pressed = force.sum(0) > 0
            if isinstance(island, Sheet) or not pressed.any():
                continue
            if pressed[[0, -1]].any() or pressed[:, [0, -1]].any():
                box = island.box
                boxes.append(Box(box.x, box.y, 1.4 * box.a, 1.4 * box.b))
                grown = True
            else:
                boxes.append(rimmed(island, pressed))
        return merged(boxes), grown

    def figures(self, problem):
        """Approach, L2 norm and peak of the pressure, loads on the summits, in the units of a problem."""
        mu, ell = problem.unit
        loads = (self.loads * mu * ell**2).tolist() if problem.summits else []
        return {
            "approach": self.approach * ell,
            "norm": self.norm * mu * ell,
            "peak": self.peak * mu,
            "loads": loads,
        }


def rimmed(island, pressed):
    """The Box about what presses on an island, with a rim of two cells and 6 %."""
    i, j = np.nonzero(pressed)
    left, right = island.x[[i.min(), i.max()]]
    low, high = island.y[[j.min(), j.max()]]
    a = 1.06 * (right - left) / 2 + 2 * island.sides[0]
    b = 1.06 * (high - low) / 2 + 2 * island.sides[1]
    return Box((left + right) / 2, (low + high) / 2, a, b)


class Unknowns:
    """All pressures of a `Model` in one array p = metric * dual, for which steepest descent sees equal
    stiffness everywhere; `finite` tells where the surface has a height.
    """

    def __init__(self, model):
        self.model = model
        self.sizes = [height.size for height in model.height]
        self.height = np.concatenate([height.ravel() for height in model.height])
        self.finite = np.isfinite(self.height)
        self.height[~self.finite] = 0
        self.area = np.repeat([island.area for island in model.islands], self.sizes)
        self.metric = np.repeat([1 / island.scale for island in model.islands], self.sizes)

    def split(self, p):
        """Arrays (corners, n1, n2), one for each island."""
        islands = np.split(p, np.cumsum(self.sizes)[:-1])
        return [part.reshape(height.shape) for part, height in zip(islands, self.model.height)]

    def displacement(self, p):
        return np.concatenate([field.ravel() for field in self.model.response(self.split(p))])

    def start(self, load):
        """Pressures of an eighth of the cells, the lowest."""
        heights = np.sort(self.height[self.finite])
        above = self.height - heights[0]
        reach = heights[min(len(heights) - 1, max(8, len(heights) // 8))] - heights[0]
        p = np.where(self.finite, np.sqrt(np.maximum(reach - above, 0)) + (above <= 0), 0.0)
        return p * (load / (self.area @ p))


def gradients(model, tolerance=TOLERANCE, limit=500):
    """Polonsky and Keer's projected conjugate gradients, on pressures scaled by each island's own
    compliance.
    """
    cells = Unknowns(model)
    load = model.problem.load
    p = cells.start(load)
    direction = np.zeros_like(p)
    before = 1.0
    conjugate = 0.0
    for _ in range(limit):
        displacement = cells.displacement(p)
        closed = p > 0
        weights = cells.area * cells.metric * closed
        gaps = displacement + cells.height
        approach = (weights @ gaps) / weights.sum()
        gaps = gaps - approach
        deepest = max(np.abs(displacement[closed]).max(), 1e-300)
        error = (cells.area * p) @ np.abs(gaps) / load / deepest
        overlap = max(0.0, -(gaps[cells.finite & ~closed]).min(initial=0.0)) / deepest
        if error < tolerance and overlap < 30 * tolerance:
            break
        square = weights @ gaps**2
        direction = np.where(closed, cells.metric * gaps + conjugate * square / before * direction, 0.0)
        before = square
        image = cells.displacement(direction)
        image = image - (weights @ image) / weights.sum()
        step = ((cells.area * gaps) @ direction) / ((cells.area * image) @ direction)
        p = np.where(closed, np.maximum(p - step * direction, 0.0), p)
        overlapping = cells.finite & (p == 0) & (gaps < 0)
        conjugate = 0.0 if overlapping.any() else 1.0
        p[overlapping] -= step * (cells.metric * gaps)[overlapping]
        p *= load / (cells.area @ p)
    return Solution(model, cells.split(p), approach, max(error, overlap))


# ---- answers ----


def solve(problem, n):
    """Two `Solution`s of n/2 and n cells along each box, which is made to fit what presses unless the boxes
    are fixed.
    """
    problem = problem.scaled()
    boxes = problem.boxes
    if boxes and not problem.fixed:
        for cells in (24, 32):
            boxes, _ = gradients(Model(problem, boxes, cells), 1e-4).regrown()
    pair = []
    for cells in (n // 2, n):
        for _ in range(4):
            solution = gradients(Model(problem, boxes, cells))
            regrown, grown = solution.regrown()
            if problem.fixed or not grown:
                break
            boxes = regrown
        pair.append(solution)
    return pair


def answer(problem, n=96):
    """The state at the load: its `Solution.figures`, and `bars` of what is not known of them.

    Bars come from grids of n/2 and n cells; loads are those of the corners nearest to a summit.
    """
    pair = solve(problem, n)
    coarse, fine = (solution.figures(problem) for solution in pair)
    changes = {name: abs(coarse[name] / fine[name] - 1) for name in ("approach", "norm", "peak")}
    of_loads = np.abs(np.subtract(coarse["loads"], fine["loads"])) / problem.load
    changes["loads"] = of_loads.max(initial=0.0)
    bars = {name: 2 * float(change) + KNOWN for name, change in changes.items()}
    return fine | {"bars": bars, "residual": max(solution.residual for solution in pair)}


def nearest(x, y, summits, period=None):
    """The number of the summit that is nearest to each place."""
    period = period or 1e300
    ways = [(x - a, y - b) for a, b in summits]
    return np.argmin([sum((d - period * np.round(d / period)) ** 2 for d in way) for way in ways], axis=0)


def hertz(E, nu, R, load):
    """Radius, peak pressure and approach of classical contact with a sphere."""
    stiffness = E / (1 - nu**2)
    a = (3 * load * R / 4 / stiffness) ** (1 / 3)
    return a, 3 * load / (2 * pi * a * a), a * a / R
