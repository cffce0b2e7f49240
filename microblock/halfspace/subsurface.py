"""Fields below the surface of the half-space, from tractions on squares (docs/theory/halfspace.md).

Under waves exp(i k.x) of the tractions fields vary like (a + b x3 + d expm1((s - k) x3) + d1 expm1((s1 - k)
x3)) exp(k x3). In the plane of wave vector e and normal the amplitudes are those of the half-plane; those
across it, along t, are in `_across`. Components of fields that turn with e by 0, 1 or 2 angles, such as u1 +
i u2 = (u_e + i u_t) exp(i phi), under loads p, q1 + i q2 and M1 + i M2 are Hankel transforms of one Bessel
function each,

    F(r, theta) = exp(i m theta)/(2 pi) int i^m A(k, x3) J_m(k r) k dk.

On a vertical line sources count by their distance r and exp(i m theta) alone: all are projected on the
interpolating polynomials of a few nodes in r, which serve all depths.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..contact_solvers.fft_compliance import Grid
from ..halfplane.subsurface import BelowSurface, modes
from ..halfplane.surface_loads import SHALLOWEST, lesser_slopes
from ..model.fields import SpaceFields, points
from ..model.material import Cosserat
from ..model.quadrature import gauss_rule, in_blocks, lagrange
from ..model.types import AnyArray, Array, Flags
from ..threads import bounded
from .kernels import SCALES, Radial

SPLIT = 4.0  # widths of a part of a cell, within which of the point it is cut into four
MIDPOINT = 64.0  # widths, beyond which a cell acts at its centre
NODES_OF_PIECE = 8  # in a piece of distances: 1e-7 of kernels
PIECE_RATIO = 1.5  # ratio of the ends of a piece
CHEBYSHEV = (1 - np.cos(np.pi * (np.arange(NODES_OF_PIECE) + 0.5) / NODES_OF_PIECE)) / 2
QUARTERS = np.array(((-1, -1, 1, 1), (-1, 1, -1, 1)))  # centres of the quarters of a square
# of a period: waves go up to REACH_OF_WAVES/period times 1.6, LONG_WAVES to either side of 0, and what the
# filter leaves of others is 1e-7 at a distance of half a period
REACH_OF_WAVES = 84.0
LONG_WAVES = 21
TENSOR = ("ee", "et", "en", "te", "tt", "tn", "ne", "nt", "nn")
# what turns with e by so many angles: u3, u+, psi3, psi+, and of either stress: trace, skew, 33, +3, 3+, ++
TURNS = np.array((0, 1, 0, 1, *(0, 0, 0, 1, 1, 2) * 2))
# mirrored, psi, the skew stress and the couple stress, but for its skew part, change sign besides, as M does
AXIAL = np.isin(np.arange(len(TURNS)), (2, 3, 5, 10, 12, 13, 14, 15))
LOADS = ("p", "q", "M")


def _tensor_parts(t: dict[str, AnyArray]) -> list[AnyArray]:
    """Returns the parts of a tensor in the order of TURNS."""
    i = 1j
    return [
        t["ee"] + t["tt"],
        t["et"] - t["te"],
        t["nn"],
        t["en"] + i * t["tn"],
        t["ne"] + i * t["nt"],
        t["ee"] - t["tt"] + i * (t["et"] + t["te"]),
    ]


def _fields(
    u: tuple[AnyArray, ...],
    psi: tuple[AnyArray, ...],
    stress: dict[str, AnyArray],
    couple: dict[str, AnyArray],
) -> AnyArray:
    """Returns parts of fields in the order of TURNS of components along e, t and n."""
    zero = {name: 0 * u[0] for name in TENSOR}
    vectors = [part for v in (u, psi) for part in (v[2], v[0] + 1j * v[1])]
    return np.array([*vectors, *_tensor_parts(zero | stress), *_tensor_parts(zero | couple)])


def _along(solid: Cosserat, clamped: bool, k: Array, **load: AnyArray) -> AnyArray:
    """Returns amplitudes of the fields in the plane of e and n under p, q along e and M along t, array
    (fields, 4, k): the half-plane's, whose rotation is -psi_t.
    """
    loads = {name: 0j * k for name in ("p", "M", "q")} | load
    plane = modes(solid, clamped, k + 0j, loads["p"], -loads["M"], loads["q"])
    plane = {name: np.concatenate((a, 0 * a[:1])) for name, a in plane.items()}
    zero = 0 * plane["psi"]
    ratio = solid.beta_prime / solid.curvature
    stress = {"ee": plane["s11"], "en": plane["s12"], "ne": plane["s21"], "nn": plane["s22"]}
    stress["tt"] = solid.nu * (plane["s11"] + plane["s22"])
    couple = {"te": -plane["m1"], "tn": -plane["m2"], "et": -ratio * plane["m1"], "nt": -ratio * plane["m2"]}
    return _fields((plane["u1"], zero, plane["u2"]), (zero, -plane["psi"], zero), stress, couple)


class Rises(NamedTuple):
    """s - k and s1 - k at wavenumbers k, arrays (k,), without cancellation."""

    k: Array
    curl: Array
    gradient: Array

    @classmethod
    def of(cls, solid: Cosserat, k: Array) -> "Rises":
        rates = 2 * solid.beta / solid.curvature, 4 * solid.eta / gradient_bend(solid)
        curl, gradient = (
            rate / (np.hypot(k, np.sqrt(rate) / solid.ell) + k) / solid.ell**2 for rate in rates
        )
        return cls(k, curl, gradient)

    def slope(self, f: Array) -> Array:
        """Returns the amplitudes of the derivative along x3 of f, arrays (4, k), without b."""
        a = self.k * f[0] + self.curl * f[2] + self.gradient * f[3]
        return np.array((a, 0 * a, (self.k + self.curl) * f[2], (self.k + self.gradient) * f[3]))

    def at_depth(self, x3: float) -> Array:
        """Returns what the amplitudes a, b, d and d1 multiply, array (4, k)."""
        ones = np.ones_like(self.k)
        decays = np.array((ones, x3 * ones, np.expm1(self.curl * x3), np.expm1(self.gradient * x3)))
        return decays * np.exp(self.k * x3)


def gradient_bend(solid: Cosserat) -> float:
    """Returns alpha' + beta' + gamma', of gradients of psi."""
    return solid.alpha_prime + solid.beta_prime + solid.curvature


def _moved_across(solid: Cosserat, rises: Rises, q: float, M: float) -> tuple[Array, Array, Array]:
    """Returns amplitudes of u_t, psi_e and psi_n over i under q along t and M along e, arrays (4, k).

    With the modes of `symbol` and their amplitudes A, -i B, C, g = gamma' + beta', the surface conditions are

        k A = q/mu - 2 eta k B,    B b = g k (q/(2 mu) + s C),    b = 4 eta/ell^2 + (1 + eta) g k^2,
        -C D = b M/(mu ell^2) + g k q/(2 mu) (4 eta/ell^2 - g k (s1 - k)),

    and sums of the modes are written such that nothing cancels, neither for short waves nor for small eta.
    """
    k, rise, rise1 = rises
    eta = solid.eta
    g = solid.curvature + solid.beta_prime
    four = 4 * eta / solid.ell**2
    s = k + rise
    s1 = k + rise1
    bend = g * k**2
    b = four + (1 + eta) * bend
    half = q / (2 * solid.mu)
    D = 2 * solid.beta / solid.ell**2 * b + bend * (four - g * (k * rise1 + rise * (s1 + eta * k)))
    C = -(M * b / (solid.mu * solid.ell**2) + g * k * half * (four - g * k * rise1)) / D
    B = g * k * (half + s * C) / b
    X = ((1 + eta) * bend * half - four * s * C) / b + rise * C
    turned = four * (half + s * C) / b
    zero = 0 * k
    u_t = np.array(((2 * half - solid.beta * X) / k, zero, solid.beta * C, zero))
    psi_e = np.array((-turned, zero, -s * C, k * B))
    psi_n = np.array((turned - rise * C - rise1 * B, zero, k * C, -s1 * B))
    return u_t, psi_e, psi_n


def _across(solid: Cosserat, clamped: bool, k: Array, q: float, M: float) -> AnyArray:
    """Returns amplitudes of the fields under q along t and M along e, array (fields, 4, k)."""
    rises = Rises.of(solid, k)
    u_t, psi_e, psi_n = _moved_across(solid, rises, q, M)
    direct = solid.mu + solid.mu_c
    transposed = solid.mu - solid.mu_c
    i = 1j
    stress = {
        "te": i * (direct * k * u_t - 2 * solid.mu_c * psi_n),
        "et": i * (transposed * k * u_t + 2 * solid.mu_c * psi_n),
        "tn": direct * rises.slope(u_t) + 2 * solid.mu_c * psi_e,
        "nt": transposed * rises.slope(u_t) - 2 * solid.mu_c * psi_e,
    }
    bend = solid.curvature + solid.beta_prime
    trace = solid.alpha_prime * i * (k * psi_e + rises.slope(psi_n))
    couple = {
        "ee": trace + bend * i * k * psi_e,
        "nn": trace + bend * i * rises.slope(psi_n),
        "tt": trace,
        "en": solid.curvature * rises.slope(psi_e) - solid.beta_prime * k * psi_n,
        "ne": -solid.curvature * k * psi_n + solid.beta_prime * rises.slope(psi_e),
    }
    couple = {name: solid.mu * solid.ell**2 * m for name, m in couple.items()}
    none = 0j * u_t
    fields = _fields((none, u_t + none, none), (psi_e + none, none, i * psi_n), stress, couple)
    if not clamped or not q:
        return fields
    # M that holds psi_e = 0
    held = _across(solid, False, k, 0.0, 1.0)
    return np.asarray(fields - fields[3, 0] / held[3, 0] * held)


class Waves:
    """What waves of loads do below the surface, row by row.

    Parameters
    ----------
    solid : Cosserat
    clamped : bool
        Whether psi = 0 on the whole surface.
    loads : sequence of str
        Which of LOADS there are.

    Attributes
    ----------
    kinds : list of ((str, bool), int)
        Of LOADS, whether q1 - i q2 stands for q1 + i q2, and m.
    kind : array (rows,) of int
        Number of each row in these.
    orders : array (rows,) of int, |m|
    phases : array (rows,), 1 or i
    """

    def __init__(self, solid: Cosserat, clamped: bool, loads: Sequence[str]) -> None:
        self.solid = solid
        self.clamped = clamped
        steps = [(load, step) for load in loads for step in ((0,) if load == "p" else (-1, 1))]
        turns = np.concatenate([TURNS + step for _, step in steps])
        # q1 - i q2, where both turn on together
        conjugate = [(load, step > 0) for load, step in steps for _ in TURNS]
        rows = list(zip(conjugate, turns.tolist()))
        self.kinds = sorted(set(rows))
        self.kind = np.array([self.kinds.index(row) for row in rows])
        self.orders = np.abs(turns)
        # by mirror symmetry i^m A is real between loads and fields of one kind, else imaginary
        unlike = np.concatenate([(load == "M") != AXIAL for load, _ in steps])
        self.phases = np.where(unlike, 1j, 1.0)
        self._steps = steps
        self._at_scales = self._amplitudes(SCALES / solid.ell)

    def _amplitudes(self, k: Array) -> Array:
        """Returns a, b, d and d1 of all rows at wavenumbers, times i^m over `phases`: array (rows, 4, k)."""
        ones = np.ones_like(k)
        by_load: dict[str, tuple[AnyArray, AnyArray]] = {}
        pressed = _along(self.solid, self.clamped, k, p=ones)
        by_load["p"] = pressed, 0 * pressed
        by_load["q"] = (
            _along(self.solid, self.clamped, k, q=ones),
            _across(self.solid, self.clamped, k, 1.0, 0.0),
        )
        # a moment along e is one across the wave, and one along t acts in its plane
        by_load["M"] = _across(self.solid, False, k, 0.0, 1.0), _along(self.solid, False, k, M=ones)
        rows = []
        for load, step in self._steps:
            along_e, along_t = by_load[load]
            rows.append(along_e if load == "p" else (along_e + step * 1j * along_t) / 2)
        return np.real((1j**self.orders / self.phases)[:, None, None] * np.concatenate(rows))

    def turned(self, loads: AnyArray, turn: AnyArray) -> AnyArray:
        """Returns the `kinds` of loads, array (5, n), in the directions `turn`, exp(i phi), array (n,): array
        (kinds, n).
        """
        p, q1, q2, M1, M2 = loads
        complex_loads = {("p", False): p, ("q", False): q1 + 1j * q2, ("M", False): M1 + 1j * M2}
        complex_loads |= {("q", True): q1 - 1j * q2, ("M", True): M1 - 1j * M2}
        return np.array([complex_loads[load] * turn**m for load, m in self.kinds])

    def at_depth(self, x3: float, k: Array | None = None) -> Array:
        """Returns all rows at a depth and wavenumbers, without them at SCALES over ell: array (rows, k)."""
        amplitudes = self._at_scales
        if k is None:
            k = SCALES / self.solid.ell
        else:
            amplitudes = self._amplitudes(k)
        return np.einsum("rck,ck->rk", amplitudes, Rises.of(self.solid, k).at_depth(x3))


@dataclass(frozen=True, eq=False)
class SquareLoads:
    """Tractions on square cells, linear in each.

    Attributes
    ----------
    places : array (2, n), centres
    widths : array (n,)
    means, slopes : arrays (5, n) and (2, 5, n), p, q1, q2, M1 and M2, and their slopes along x1 and x2
    """

    places: Array
    widths: Array
    means: Array
    slopes: Array

    @property
    def loads(self) -> list[str]:
        """Which of LOADS there are."""
        there: Flags = np.any(self.means != 0, axis=1)
        return [name for name, used in zip(LOADS, (True, there[1:3].any(), there[3:].any())) if used]

    @property
    def shallowest(self) -> float:
        """Depth to which points nearer to the surface are moved (length)."""
        return SHALLOWEST * (float(self.widths.min()) if self.widths.size else 0.0)

    def sources(self, place: Array, depth: float, period: float = np.inf) -> tuple[Array, Array]:
        """Returns distances of a place, (2,), from points that stand for the loads, and forces, arrays (2, m)
        and (5, m), for depths from `depth` on: cells next to it are cut. On a period these are the images
        nearest to it.
        """
        offsets = place[:, None] - self.places
        if np.isfinite(period):
            offsets -= period * np.rint(offsets / period)
        cell = np.arange(self.widths.size)
        width: Array = self.widths
        middle = offsets
        points_of: list[tuple[Array, Array]] = []
        while cell.size:
            beside = np.maximum(np.abs(offsets) - width / 2, 0.0)
            distance = np.sqrt((beside**2).sum(axis=0) + depth**2)
            near = width * SPLIT > distance
            far = width * MIDPOINT < distance
            for chosen, order in ((far, 1), (~near & ~far, 2)):
                x, gauss = gauss_rule(order)
                steps = np.array(np.meshgrid(x - 0.5, x - 0.5)).reshape(2, 1, -1)
                numbers = cell[chosen, None]
                places = offsets[:, chosen, None] - width[chosen, None] * steps
                rise = np.einsum(
                    "iln,inm->lnm", self.slopes[..., cell[chosen]], middle[:, chosen, None] - places
                )
                area = width[chosen, None] ** 2 * np.outer(gauss, gauss).ravel()
                forces = (self.means[:, numbers] + rise) * area
                points_of.append((places.reshape(2, -1), forces.reshape(len(forces), -1)))
            quarter = width[near] / 4 * QUARTERS[..., None]
            offsets = (offsets[:, None, near] + quarter).reshape(2, -1)
            middle = np.tile(middle[:, near], 4)
            cell = np.tile(cell[near], 4)
            width = np.tile(width[near] / 2, 4)
        distances, all_forces = (np.hstack(arrays) for arrays in zip(*points_of))
        return distances, all_forces


def square_loads(grid: Grid, means: Array, periodic: bool) -> SquareLoads:
    """Returns the SquareLoads of means over cells, array (5, n, n): linear in each cell that is pressed,
    along each axis with the lesser slope of those to both neighbours, so that forces stay.
    """
    pressed = means[0] > 0
    slopes = []
    for axis in (0, 1):
        joined = pressed & np.roll(pressed, -1, axis)
        if not periodic:
            joined[(slice(None),) * axis + (-1,)] = False
        after = np.where(joined, np.roll(means, -1, axis + 1) - means, 0.0) / grid.width
        slopes.append(lesser_slopes(after, axis + 1))
    loaded = np.any(means != 0, axis=0)
    places = np.array(grid.places)[:, loaded]
    return SquareLoads(
        places, np.full(places.shape[1], grid.width), means[:, loaded], np.array(slopes)[..., loaded]
    )


def joined(parts: Sequence[SquareLoads]) -> SquareLoads:
    """Returns the SquareLoads of several together."""
    names = vars(parts[0])
    return SquareLoads(*(np.concatenate([vars(part)[name] for part in parts], axis=-1) for name in names))


class HalfSpaceBelow(BelowSurface[SquareLoads]):
    """The fields of loads on a half-space: ``below(x1, x2, x3)``."""

    @property
    def resolved(self) -> float:
        """As of FieldsBelow."""
        return float(self.loads.widths.min(initial=np.inf)) / 2

    @bounded
    def __call__(self, x1: ArrayLike, x2: ArrayLike, x3: ArrayLike | None = None) -> SpaceFields:
        """Returns the fields at points, arrays or numbers. Raises BadArgument beyond the surface, and without
        x3.

        Tractions are linear in each cell: at depths below their width they are known as the pressures are.
        Points above a thousandth of it are moved there.
        """
        (x1, x2, x3), shape = points(x1, x2, x3, in_space=True)
        depth = self.lowered("x3", x3, self.loads.shallowest)
        places, numbers = np.unique((x1, x2), axis=1, return_inverse=True)
        components = np.empty((len(TURNS), len(x1)), complex)
        kernels: dict[float, tuple[Radial, AnyArray]] = {}
        for number, place in enumerate(places.T):
            on_line = numbers.ravel() == number
            components[:, on_line] = self._on_vertical(place, depth[on_line], kernels)
        return _components(components, self.upper, x1, x2, x3).shaped(shape)

    @cached_property
    def _waves(self) -> Waves:
        loads = [name for name in self.loads.loads if name != "M" or not self.clamped]
        return Waves(self.solid, self.clamped, loads)

    def _kernel(self, x3: float) -> tuple[Radial, AnyArray]:
        """Returns the rows at a depth as functions of the distance, on a period without their long waves, and
        these waves, array (rows, k).
        """
        waves = self._waves
        sign = np.where(waves.orders == 2, -1.0, 1.0)[:, None]  # Radial has -J2

        def functions(k: Array) -> Array:
            return sign * waves.at_depth(x3) * (1 - self._long_waves(k))

        of_distance = Radial(functions, self.solid.ell, waves.orders)
        k, loads = self._series
        if self.period is None:
            return of_distance, loads
        sizes, number = np.unique(np.hypot(*k), return_inverse=True)
        rows = waves.at_depth(x3, sizes)[:, number.ravel()] * (-1j) ** waves.orders[:, None]
        return of_distance, rows * loads

    def _long_waves(self, k: Array) -> Array:
        """Returns the filter of long waves, none without a period."""
        if self.period is None:
            return np.zeros_like(k)
        return np.exp(-((k * self.period / REACH_OF_WAVES) ** 6))

    @cached_property
    def _series(self) -> tuple[Array, AnyArray]:
        """Long waves of a period, array (2, k), and the loads in them as they turn, array (rows, k)."""
        waves = self._waves
        if self.period is None:
            return np.empty((2, 0)), np.empty((len(waves.kind), 0))
        numbers = np.indices((2 * LONG_WAVES + 1,) * 2).reshape(2, -1) - LONG_WAVES
        k = np.asarray(2 * np.pi / self.period * numbers[:, numbers.any(axis=0)], float)
        # four points a cell
        places, forces = self.loads.sources(np.zeros(2), 2 * SPLIT * float(self.loads.widths.max()))
        loads = np.zeros((len(forces), k.shape[1]), complex)
        for block in in_blocks(places.shape[1], k.shape[1]):
            loads += forces[:, block] @ np.exp(1j * places[:, block].T @ k)
        loads *= self._long_waves(np.hypot(*k)) / self.period**2
        return k, waves.turned(loads, np.exp(1j * np.arctan2(k[1], k[0])))[waves.kind]

    def _on_vertical(
        self, place: Array, x3: Array, kernels: dict[float, tuple[Radial, AnyArray]]
    ) -> AnyArray:
        """Returns the parts of the fields at depths x3, array (n,), below a place, (2,): array (fields, n);
        `kernels` are those of depths that are known.
        """
        nearest = float(np.abs(x3).min())
        offsets, forces = self.loads.sources(place, nearest, self.period or np.inf)
        nodes, weights = projected(offsets, forces, self._waves, nearest / 2)
        shifted = np.exp(1j * place @ self._series[0])
        components = np.empty((len(TURNS), len(x3)), complex)
        for depth in np.unique(x3):
            if depth not in kernels:
                kernels[depth] = self._kernel(depth)
            of_distance, of_long_waves = kernels[depth]
            rows = (of_distance(nodes) * weights).sum(axis=1) + of_long_waves @ shifted
            rows = rows * self._waves.phases
            components[:, x3 == depth] = rows.reshape(-1, len(TURNS)).sum(axis=0)[:, None]
        if self.period is not None:
            components += self._of_mean_loads(x3)
        return components

    def _of_mean_loads(self, x3: Array) -> AnyArray:
        """Returns the parts of the fields of the mean loads of a period, without strains along x1 and x2 and
        displacement of the surface, at depths x3, array (n,): array (fields, n).
        """
        assert self.period is not None
        solid = self.solid
        mean = (self.loads.means * self.loads.widths**2).sum(axis=1) / self.period**2
        p, q, M = mean[0], mean[1] + 1j * mean[2], mean[3] + 1j * mean[4]
        couple = solid.mu * solid.ell**2
        rate = 1 / solid.layer_length
        if self.clamped:
            M = -1j * couple * solid.curvature * rate * q / (2 * solid.mu)
        decay = np.exp(rate * x3)
        psi = M / (solid.curvature * couple * rate) * decay
        ones = np.ones_like(x3)
        lateral = solid.nu / (1 - solid.nu)
        components = np.zeros((len(TURNS), len(x3)), complex)
        components[0] = -p * (1 - 2 * solid.nu) / (2 * solid.mu * (1 - solid.nu)) * x3
        components[1] = q / solid.mu * x3 - 1j * M / (2 * solid.mu) * np.expm1(rate * x3)
        components[3] = psi + 1j * q / (2 * solid.mu)
        components[4] = -2 * lateral * p * ones
        components[6] = -p * ones
        components[7] = q * ones
        components[8] = q - 1j * solid.curvature * couple * rate**2 * psi
        components[13] = M * decay
        components[14] = solid.beta_prime / solid.curvature * M * decay
        return components


def projected(offsets: Array, forces: Array, waves: Waves, first: float) -> tuple[Array, AnyArray]:
    """Returns nodes in distance, array (nodes,), and in each row weights at these of points at offsets with
    forces, arrays (2, m) and (5, m): array (rows, nodes). The first piece has the length `first`.
    """
    r = np.hypot(*offsets)
    piece = np.ceil(np.log(np.maximum(r / first, 1.0)) / np.log(PIECE_RATIO)).astype(int)
    order = np.argsort(piece, kind="stable")
    r = r[order]
    piece = piece[order]
    ends = np.asarray(first * PIECE_RATIO ** np.arange(piece[-1] + 1), float)
    starts = np.concatenate(([0.0], ends[:-1]))
    nodes = starts[:, None] + (ends - starts)[:, None] * CHEBYSHEV
    along = lagrange(CHEBYSHEV, (r - starts[piece]) / (ends - starts)[piece])
    # on the vertical itself only what does not turn has a kernel
    turn = np.where(r > 0, (offsets[0] + 1j * offsets[1])[order] / np.where(r > 0, r, 1.0), 1.0)
    bounds = np.searchsorted(piece, np.arange(len(ends) + 1))
    values = waves.turned(forces[:, order], turn)
    weights = np.hstack([values[:, i:j] @ along[i:j] for i, j in pairwise(bounds)])
    return nodes.ravel(), weights[waves.kind]


def _components(components: AnyArray, upper: bool, x1: Array, x2: Array, x3: Array) -> SpaceFields:
    """Returns the SpaceFields of parts of fields, array (fields, n), in the upper half-space mirrored."""
    turned = -1.0 if upper else 1.0
    u = np.array((components[1].real, components[1].imag, turned * components[0].real))
    psi = np.array((turned * components[3].real, turned * components[3].imag, components[2].real))
    stress = _tensor(components[4:10], turned)
    return SpaceFields(x1, x2, x3, psi, u, stress, turned * _tensor(components[10:], turned))


def _tensor(parts: AnyArray, turned: float) -> Array:
    """Returns the tensor, (3, 3, n), of its parts, of which those with one 3 are `turned`."""
    trace, skew, normal, right, left, deviator = parts
    right = turned * right
    left = turned * left
    rows = (
        ((trace + deviator).real / 2, (deviator.imag + skew.real) / 2, right.real),
        ((deviator.imag - skew.real) / 2, (trace - deviator).real / 2, right.imag),
        (left.real, left.imag, normal.real),
    )
    return np.array(rows)
