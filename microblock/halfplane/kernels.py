"""The homogeneous half-plane x2 < 0 without a mesh: its surface response in Fourier space and on the line.

For loads exp(i k x1), k > 0, with c = (1 - nu)/mu, s^2 = k^2 + 1/L^2, L the layer length, phi = ell psi/2, m
= 2 M/ell, a shear q along x1, its displacement u1 and Y = U - 1/(2 mu k) (docs/theory/halfplane.md and
friction.md, U, V, W in `symbol_of_roots`),

    u = -u2 = U p - i Y q + i V m,     u1 = i Y p + U q - V m,     phi = -i V p - V q + W m

On the line the kernels are integrals along k = tau exp(i pi/4), tabulated in log x.
"""

from collections.abc import Sequence
from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.polynomial import chebyshev
from numpy.typing import ArrayLike

from ..errors import BadArgument
from ..model.bodies import Unbounded
from ..model.material import UNCOUPLED, Cosserat
from ..model.methods import Cells, Panels
from ..model.problem import Problem
from ..model.quadrature import gauss_rule, lagrange
from ..model.types import AnyArray, Array
from ..threads import bounded

TABULATED = 1e-16, 1e10  # x/ell between which the kernels are tabulated
ODD_KERNELS = 1, 4, 5, 7  # 5 and 7 are next to x = 0 half of a step
LAYER_RATES = 1e-12, 1e12  # ell over the layer length, between which the quadrature is good


def plane_symbol(solid: Cosserat, k: ArrayLike) -> Array:
    """Returns U, V, W at the wavenumbers k > 0, array (n,): array (3, n) of lengths per stress."""
    k = np.asarray(k, float)
    if not np.all(k > 0):
        raise BadArgument("k", k, "wavenumbers must be positive")
    return symbol_of_roots(solid, k, *roots(solid, k))


def symbol_of_roots(solid: Cosserat, k: AnyArray, s: AnyArray, s_minus_k: AnyArray) -> AnyArray:
    """Returns U, V, W; `s_minus_k` is s - k without cancellation."""
    c = (1 - solid.nu) / solid.mu
    g = solid.curvature * solid.ell**2
    D = 1 + g * (1 - solid.nu) * k * (k / s) * s_minus_k
    return np.array(
        (
            c / (k * D),
            c * solid.ell / 2 * s_minus_k / (s * D),
            c * solid.ell**2 / 4 * (1 / (g * (1 - solid.nu)) + k * s_minus_k) / (s * D),
        )
    )


def at_rest(solid: Cosserat) -> float:
    """Returns W for k -> 0, where an even moment rotates all blocks alike (length per stress)."""
    longest = min(solid.layer_length, solid.ell / LAYER_RATES[0])  # of a classical solid it is inf
    return longest / (4 * solid.curvature * solid.mu)


def clamped(U: AnyArray, V: AnyArray, W: AnyArray) -> AnyArray:
    """Returns u over p where psi = 0 on the whole surface."""
    return U - V**2 / W


def short_waves(solid: Cosserat) -> tuple[float, float]:
    """Returns limits of k U and k W for k -> infinity, lengths per stress times k."""
    c = (1 - solid.nu) / solid.mu
    return c / (1 + (1 - solid.nu) * solid.beta), c / (4 * solid.curvature * (1 - solid.nu))


def coalescence_exponent(solid: Cosserat) -> float:
    """Returns s of p ~ x^s where two zones of partial contact touch, ``cos(pi s) = (c_u - c_phi)/(c_u +
    c_phi)`` with `short_waves`.
    """
    displacement, rotation = short_waves(solid)
    return float(np.arccos((displacement - rotation) / (displacement + rotation)) / np.pi)


def counter_short_waves(counter: Cosserat | None) -> float:
    """Returns the limit of k U of the second body; 0 of a rigid obstacle."""
    return 0.0 if counter is None else float(short_waves(counter)[0])


class LineKernels:
    """The responses on the line to a unit line load, over c = (1 - nu)/mu.

    0 to 2 are U, V, W: ``u = U*p - V*m`` and ``phi = V*p + W*m`` with the convolution ``*``. With shear, ``u1
    = -Y*p + U*q - V'*m``, Y is 5, V' (the even transform of V) 6. Where psi = 0 on the whole surface, 3 is u
    and 4, over 1/ell, -m from p, 7 is Y, and 8, over 1/ell, m from q. U -> -log(x/ell)/pi for x -> infinity.

    Raises BadArgument for beta = 0 or next to it, and for layers below 1e-12 ell.
    """

    @bounded
    def __init__(self, nu: float, beta: float, curvature: float = 2.0) -> None:
        solid = Cosserat(E=2 * (1 + nu), nu=nu, ell=1.0, beta=beta, curvature=curvature)
        if not LAYER_RATES[0] <= 1 / solid.layer_length <= LAYER_RATES[1]:
            raise BadArgument(
                "beta",
                beta,
                f"2 beta/gamma' must lie between {LAYER_RATES[0] ** 2:g} and {LAYER_RATES[1] ** 2:g} "
                "on a half-plane: for beta = 0 nothing holds its rotation",
            )
        # Chebyshev points on a piece, 1 wide in log x; polynomials of so few terms on parts of it, cheap to
        # look up: both 1e-13
        points = 14
        parts = 20
        terms = 6
        pieces = int(np.ceil(np.log(TABULATED[1] / TABULATED[0])))
        self._start = np.log(TABULATED[0])
        self._step = 1 / parts
        self._parts = parts * pieces
        logarithms = self._start + np.arange(pieces)[:, None] + (chebyshev.chebpts1(points) + 1) / 2
        table = self._values(solid, np.exp(logarithms)) @ _parting(points, parts, terms).T
        self._table = np.moveaxis(table.reshape(-1, self._parts, terms), 2, 1).copy()

    def _values(self, solid: Cosserat, x: Array) -> Array:
        """Returns all kernels at x > 0 on pieces like those of `ray_rule`, array (pieces, n): array
        (9, pieces, n).
        """
        # from where waves are 1 under the first piece, to where nothing is left of them
        lowest = 1e-16 / x[0, -1]
        pieces = int(np.ceil(np.log(50 / x[0, 0] / lowest)))
        k, weights, constant = rotated_weights(solid, lowest * np.exp(1.0 - len(x)), len(x) + pieces - 1)
        sums = weights.real.sum(axis=2, dtype=np.longdouble)
        below = np.cumsum(sums, axis=1) - sums
        # k x are the same numbers for the next piece of x and the one before of k
        waves = np.exp(1j * k[len(x) - 1 :, :, None] * x[0]).reshape(-1, x.shape[1])
        weights = sliding_window_view(weights, pieces, axis=1).swapaxes(2, 3).reshape(-1, len(waves))
        values = (weights @ waves).real.reshape(-1, *x.shape) + below[:, : len(x), None]
        values = values[:, ::-1].astype(float)
        values[[0, 3]] -= constant
        # the arc from real wavenumbers to the ray around k = 0
        values[list(ODD_KERNELS[2:])] -= solid.nu / (4 * (1 - solid.nu))
        return values

    def __call__(self, x: ArrayLike, which: Sequence[int] = (0, 1, 2)) -> Array:
        """Returns the kernels numbered `which` at x/ell, array of any shape: array (len(which), ...)."""
        distances = np.ravel(x).astype(float)
        values = np.empty((len(which), distances.size))
        block = 2**15  # numbers that fit into a cache
        for start in range(0, distances.size, block):
            near = distances[start : start + block]
            place = (np.log(np.clip(np.abs(near), *TABULATED)) - self._start) / self._step
            part = np.minimum(place.astype(np.intp), self._parts - 1)
            t = 2 * (place - part) - 1
            for value, number in zip(values[:, start : start + block], which):
                coefficients = self._table[number]
                value[...] = coefficients[-1].take(part)
                for row in coefficients[-2::-1]:  # Horner
                    value *= t
                    value += row.take(part)
                if number in ODD_KERNELS:
                    value *= np.sign(near)
        return values.reshape(len(which), *np.shape(x))


def _parting(points: int, parts: int, terms: int) -> Array:
    """Returns the matrix from values at Chebyshev points of a piece to coefficients in powers of t in [-1, 1]
    on its parts, array (parts terms, points).
    """
    fine = chebyshev.chebpts1(terms)
    places = 2 * (np.arange(parts)[:, None] + (fine + 1) / 2) / parts - 1
    values = lagrange(chebyshev.chebpts1(points), places)
    return (np.linalg.inv(np.vander(fine, increasing=True)) @ values).reshape(-1, points)


class HalfPlane(Unbounded):
    """The half-plane x2 < 0 of one solid, with or without loads that repeat.

    The rigid-body constant of its normal displacement is arbitrary; on a period the mean displacement is 0.

    Parameters
    ----------
    solid : Cosserat
    period : float, optional
        Length after which obstacle and loads repeat.

    Raises
    ------
    BadArgument
        If the solid is no Cosserat, or the period not positive.

    Examples
    --------
    >>> solid = mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1)
    >>> problem = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Unilateral())
    >>> round(problem.solve(load=1.0).half_width, 3)      # Hertz has 0.340 for ell -> 0
    0.306
    >>> problem = mb.Contact(mb.HalfPlane(solid, period=1.0), mb.Wave(0.001, 1.0), mb.Microblock(),
    ...     mb.Cells(nodes=128))
    >>> state = problem.solve(load=0.05)
    >>> round(float(state.pressure.mean()), 6)
    0.05
    """

    @property
    def methods(self) -> tuple[type[Panels | Cells], ...]:
        """The methods that solve on it, the usual one first."""
        return (Panels, Cells) if self.period is None else (Cells,)

    def cells(self, count: int, width: float, which: tuple[int, ...] = tuple(range(5))) -> Array:
        """Returns kernels averaged over a cell of a width (length), at distances of 0, 1, ... cells: array
        (len(which), count).
        """
        averages = np.empty((len(which), count))
        block = 2**12  # cells that fit into a cache
        starts = np.array((0, 1, 16, 256, *range(block, count, 2 * block)))
        for near, far in pairwise((*starts[starts < count], count)):
            # at n cells p points leave (4 n)^(-2 p), rounding
            order = (24, 6, 3, 2)[int(np.searchsorted((16, 256, block), near, side="right"))]
            places, weights = cell_rule(near, far, order)
            values = on_the_line(self.solid, places * width, which)
            averages[:, near:far] = values.reshape(len(which), far - near, order) @ weights
        averages[np.isin(which, ODD_KERNELS), 0] = 0
        return averages


def cell_rule(near: int, far: int, order: int) -> tuple[Array, Array]:
    """Returns places in the cells from `near` to `far`, in cells, and weights of averages over each."""
    points, gauss = gauss_rule(order)
    if not near:  # over the cell itself x = sigma^8 flattens the logarithm; odd kernels average out
        return points**8 / 2, gauss * 8 * points**7
    return (np.arange(near, far)[:, None] + points - 0.5).ravel(), gauss


@lru_cache(maxsize=64)
def kernels(nu: float, beta: float, curvature: float, kind: type[LineKernels] = LineKernels) -> LineKernels:
    """Returns the tables of a material, made once."""
    return kind(nu, beta or UNCOUPLED, curvature)


def is_classical(solid: Cosserat) -> bool:
    """Returns whether U is c/k to rounding."""
    return not 1 / solid.layer_length * solid.ell > LAYER_RATES[0]


def on_the_line(solid: Cosserat, distance: Array, which: Sequence[int] = (0, 1, 2)) -> Array:
    """Returns the kernels of lengths per force numbered `which` at distances, array of any shape: array
    (len(which), ...).
    """
    table = kernels(solid.nu, solid.beta, solid.curvature)
    return (1 - solid.nu) / solid.mu * table(distance / solid.ell, which)


def normal_symbol(solid: Cosserat, k: Array) -> Array:
    """Returns U at the wavenumbers k > 0, array (n,), also of a classical solid."""
    return plane_symbol(solid, k)[0]


def ray_rule(low: float, count: int, order: int) -> tuple[AnyArray, AnyArray]:
    """Returns k and dk at Gauss points on so many pieces of the ray tau exp(i pi/4), from tau = low on, 1
    wide in log tau: arrays (count, order).
    """
    points, gauss = gauss_rule(order)
    k = np.exp(0.25j * np.pi) * low * np.exp(np.arange(count)[:, None] + points)
    return k, k * gauss


def rotated_weights(solid: Cosserat, low: float, count: int) -> tuple[AnyArray, AnyArray, float]:
    """Returns (k, weights, constant) of the integrals of all kernels over c by a `ray_rule`: arrays (count,
    16), (9, count, 16), and a float taken off numbers 0 and 3, which diverge at k = 0.
    """
    k, dk = ray_rule(low, count, 16)
    U, V, W = symbol_of_roots(solid, k, *roots(solid, k))
    c = (1 - solid.nu) / solid.mu
    i = 1j
    fixed = clamped(U, V, W)
    over_c = (U, -i * V, W, fixed, -i * c * V / W, -i * U, V, -i * fixed, c * V / W)
    # taken off, it leaves -log(x) of the classical 1/k
    return k, np.array(over_c) / c * dk / np.pi, np.sum(np.exp(i * k) / k * dk).real / np.pi


def roots(solid: Cosserat, k: AnyArray) -> tuple[AnyArray, AnyArray]:
    """Returns s and s - k at wavenumbers with positive real parts, arrays like k."""
    rate = 1 / solid.layer_length
    s = np.sqrt(k**2 + rate**2)
    return s, rate / (s + k) * rate


def gap_kernel(problem: Problem, distance: Array, target: Array, source: Array) -> Array:
    """Returns the gap of a corner with lever `target` under a unit force on one with lever `source`, at
    distances (length/force): arrays that broadcast.
    """
    which: tuple[int, ...] = (0, 1, 2)
    if problem.law.clamps_rotation:
        which = (3,)
    elif len(problem.law.corners) == 1:
        which = (0, 1)[: 1 + bool(np.any(target))]
    U, V, W = (*on_the_line(problem.solid, distance, which), 0.0, 0.0)[:3]
    return U + target * source * W + (target - source) * V


def both_gap_kernels(problem: Problem, distance: Array, target: Array, source: Array) -> Array:
    """Returns `gap_kernel` of the levers 0 and 1 instead of `target`: array (2, ...)."""
    levers = np.array((0.0, 1.0)).reshape(2, *[1] * np.ndim(distance))
    return gap_kernel(problem, distance, levers, source)


def clamping_kernel(problem: Problem, distance: Array, target: Array, source: Array) -> Array:
    """Returns M that holds psi = 0 under a unit force, at distances (dimensionless)."""
    table = kernels(problem.solid.nu, problem.solid.beta, problem.solid.curvature)
    # m = 2 M/ell, and the kernel of m is over ell
    return -table(distance / problem.solid.ell, (4,))[0] / 2
