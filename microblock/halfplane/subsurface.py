"""Fields below the surface of the half-plane, from the modes of a state (docs/theory/halfplane.md).

For loads exp(i k x1), k > 0, the classical rotation is R exp(k x2) and the micropolar mode Theta exp(s x2).
With G = gamma' ell^2 mu, c, s and the page's D, and a shear q on the surface,

    Theta = (M/G + i k c p + k c q)/(s D),    R = -i c p - c q + c G k (s - k) Theta,

and Airy's (A + B x2) exp(k x2) bears the pressure p + i k s G Theta and the shear q + G k^2 Theta. Integrals
run along k = tau exp(i pi/4) for sources to the left, along its mirror image for those to the right. On a
period the sources' images are a geometric series, 1/(1 - exp(i k period)); the path begins between the poles
0 and 2 pi/period, which leaves out the mean loads alone.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Generic, NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from ..errors import BadArgument, require_whole
from ..model.fields import FieldsBelow, PointFields, points
from ..model.material import Cosserat
from ..model.problem import Problem
from ..model.quadrature import gauss_rule, in_blocks
from ..model.types import AnyArray, Array
from ..threads import bounded
from .kernels import ray_rule, roots
from .surface_loads import SurfaceLoads, cell_loads

FAR_TAIL = 32.0  # exp(-32/sqrt(2)) = 1.5e-10
FIELD_NAMES = ("psi", "theta", "theta_slope", "u1", "u2", "s11", "s12", "s21", "s22", "m1", "m2")
IMAGINARY_OF_P = ("psi", "theta", "theta_slope", "u1", "s12", "s21", "m2")  # and real of M; others conversely
MIRRORED = ("psi", "theta", "u2", "s12", "s21", "m1")  # change sign with x2
DIAGONAL = np.exp(0.25j * np.pi)

Loads = TypeVar("Loads")


@dataclass(frozen=True, eq=False)
class HalfPlaneFields(PointFields):
    """Fields of a half-plane; theta, theta_slope: the micropolar part of psi, its slope along x2."""

    theta: Array
    theta_slope: Array


class Path(NamedTuple):
    """Wavenumbers of the path, steps, and by how much exp(i k x) decays on it, sqrt(2) Im k: arrays (k,)."""

    k: AnyArray
    dk: AnyArray
    decay: Array


@dataclass(frozen=True, eq=False)
class BelowSurface(Generic[Loads]):
    """Base of the fields of loads on a half-plane or half-space.

    Attributes
    ----------
    solid : Cosserat
    clamped : bool
        Whether psi = 0 on the whole surface, with whatever moments.
    loads : Loads
    period : float or None
    upper : bool
        Whether the body is the upper half, with the same loads on its surface: pressures, and q as it acts
        on it.
    second : FieldsBelow or None
        Of the second body, where there is one.
    bulk : float
        Stress along x1 far away, on a half-plane.
    """

    solid: Cosserat
    clamped: bool
    loads: Loads
    period: float | None = None
    upper: bool = False
    second: FieldsBelow | None = None
    bulk: float = 0.0

    def lowered(self, name: str, up: Array, shallowest: float) -> Array:
        """Returns coordinates along the normal as those of a lower half, arrays (n,), at least so far below
        the surface; raises BadArgument of this name beyond it.
        """
        down = -up if self.upper else up
        if not np.all(down <= 0):
            raise BadArgument(name, up, f"must not be {'below' if self.upper else 'above'} the surface")
        return np.minimum(down, -shallowest)


class HalfPlaneBelow(BelowSurface[Sequence[SurfaceLoads]]):
    """The fields of loads on a half-plane, of which the tractions are the sum: ``below(x1, x2)``."""

    @property
    def resolved(self) -> float:
        """As of FieldsBelow."""
        return min(loads.resolved for loads in self.loads)

    @bounded
    def __call__(
        self, x1: ArrayLike, x2: ArrayLike, x3: ArrayLike | None = None, accuracy: int = 10
    ) -> HalfPlaneFields:
        """Returns the fields at points, arrays or numbers; `accuracy`, Gauss points on a piece of the path,
        of 10 leaves about 1e-8 of the largest values. Raises BadArgument beyond the surface, and of x3.

        On cells tractions are linear in each: at depths below their width they are known as the pressures
        are. Points above a thousandth of it (on panels 1e-7 ell) are moved there.
        """
        require_whole(1, 100, accuracy=accuracy)
        (x1, x2), shape = points(x1, x2, x3, in_space=False)
        depth = self.lowered("x2", x2, min(loads.shallowest for loads in self.loads))
        values = np.empty((len(FIELD_NAMES), len(x1)))
        for abscissa in np.unique(x1):
            on_line = x1 == abscissa
            values[:, on_line] = self._on_vertical(abscissa, depth[on_line], accuracy)
        if self.upper:
            values[[FIELD_NAMES.index(name) for name in MIRRORED]] *= -1
        psi, theta, slope, u1, u2, s11, s12, s21, s22, m1, m2 = values
        strain = self.bulk / self.solid.E_star
        u1 = u1 + strain * x1
        u2 = u2 - strain * self.solid.nu / (1 - self.solid.nu) * x2
        s11 = s11 + self.bulk
        return HalfPlaneFields(
            x1,
            x2,
            psi,
            np.array((u1, u2)),
            np.array(((s11, s12), (s21, s22))),
            np.array((m1, m2)),
            self.solid.nu * (s11 + s22),
            theta,
            slope,
        ).shaped(shape)

    def _on_vertical(self, x1: float, x2: Array, accuracy: int) -> Array:
        """Returns all fields at depths x2, array (n,), below the abscissa x1: array (fields, n)."""
        solid = self.solid
        nearest = np.abs(x2).min()
        lowest = 1e-9 / (np.abs(x1) + max(load.extent for load in self.loads) + np.abs(x2).max() + solid.ell)
        path = self._path(lowest, FAR_TAIL / nearest, accuracy)
        p, p_difference, M, M_difference, q, q_difference = self._transforms(
            path, x1, nearest / 20, accuracy + 4
        )
        # symbols that are real for real k go with the sum of left and right sources, imaginary ones with
        # their difference
        amplitudes = modes(solid, self.clamped, path.k, p, M_difference, q_difference)
        crossed = modes(solid, self.clamped, path.k, p_difference, M, q)
        amplitudes |= {name: crossed[name] for name in IMAGINARY_OF_P}
        a, b, d = np.array([amplitudes[name] for name in FIELD_NAMES]).swapaxes(0, 1) * path.dk
        classical = np.exp(np.outer(path.k, x2))
        micropolar = classical * np.expm1(np.outer(roots(solid, path.k)[1], x2))
        fields = np.real(a @ classical + x2 * (b @ classical) + d @ micropolar) / np.pi
        u1 = FIELD_NAMES.index("u1")
        u2 = FIELD_NAMES.index("u2")
        if self.period is not None:
            return fields + self._of_mean_loads(x2)
        # the path leaves out the arc around k = 0, where u1 -> i (1 - 2 nu) p/(2 mu k) and u2 the same of q
        fields[u1] -= (1 - 2 * solid.nu) / (8 * solid.mu) * p_difference[0].real
        fields[u2] -= (1 - 2 * solid.nu) / (8 * solid.mu) * q_difference[0].real
        # the rigid-body constants: there u2 -> -(1 - nu) p/(mu k), u1 -> (1 - nu) q/(mu k), and the integral
        # of exp(i k ell)/k, which is this, is taken off
        constant = (1 - solid.nu) / (np.pi * solid.mu) * (np.euler_gamma + np.log(lowest * solid.ell))
        fields[u1] += constant * q[0].real
        fields[u2] -= constant * p[0].real
        return fields

    def _path(self, lowest: float, highest: float, accuracy: int) -> Path:
        """Returns the Path; without a period from `lowest` on, below which the integral is dropped."""
        if self.period is None:
            start = 0.0
            first = lowest
        else:
            start = np.pi / self.period
            first = min(start / 4, highest)
        k, dk = (part.ravel() for part in ray_rule(first, int(np.ceil(np.log(highest / first))), accuracy))
        if self.period is not None:
            sigma, gauss = gauss_rule(accuracy)
            k = np.append(DIAGONAL * first * sigma, k)
            dk = np.append(DIAGONAL * first * gauss, dk)
        return Path(start + k, dk, np.abs(k))

    def _transforms(self, path: Path, x1: float, nearest: float, order: int) -> AnyArray:
        """Returns sum and difference over left and right of the integrals of p, then M, then q, times
        exp(i k |x1 - x|): array (6, k).
        """
        transforms = np.zeros((6, len(path.k)), complex)
        for loads in self.loads:
            for distances, weights in loads.sources(x1, nearest, order):
                # in short waves what is this far away has decayed
                short = np.searchsorted(path.decay, FAR_TAIL / distances.min())
                for block in in_blocks(len(distances), short):
                    waves = np.exp(np.outer(distances[block], 1j * path.k[:short]))
                    transforms[:, :short] += weights[:, block] @ waves
        if self.period is not None:
            transforms /= -np.expm1(1j * path.k * self.period)
        return transforms

    @cached_property
    def _mean_loads(self) -> Array:
        """p, M and q, means over a period, array (3,)."""
        assert self.period is not None
        # each source has an image to the left of a point and one to the right
        sums = [weights[::2].sum(axis=1) for loads in self.loads for _, weights in loads.sources(0.0, 1.0, 2)]
        return np.sum([*sums, np.zeros(3)], axis=0) / (2 * self.period)

    def _of_mean_loads(self, x2: Array) -> Array:
        """Returns the fields of the mean loads of a period, without strain along x1 and displacement of the
        surface, at depths x2, array (n,): array (fields, n).
        """
        solid = self.solid
        p, M, q = self._mean_loads
        couple = solid.curvature * solid.ell**2 * solid.mu
        rate = 1 / solid.layer_length
        if self.clamped:
            M = couple * rate * q / (2 * solid.mu)
        decay = np.exp(rate * x2)
        theta = M / (couple * rate) * decay
        one = np.ones_like(x2)
        fields = {
            "psi": theta - q / (2 * solid.mu),
            "theta": theta,
            "theta_slope": rate * theta,
            "u1": q * x2 / solid.mu - M / (2 * solid.mu) * np.expm1(rate * x2),
            "u2": -p * (1 - 2 * solid.nu) / (2 * solid.mu * (1 - solid.nu)) * x2,
            "s11": -p * solid.nu / (1 - solid.nu) * one,
            "s12": q * one,
            "s21": q - couple * rate**2 * theta,
            "s22": -p * one,
            "m1": 0 * one,
            "m2": couple * rate * theta,
        }
        return np.array([fields[name] for name in FIELD_NAMES])


def below_cells(
    problem: Problem,
    edges: tuple[Array, Array],
    pressures: Array,
    micromoment: Array,
    shear: Array,
    period: float | None = None,
    bulk: float = 0.0,
) -> HalfPlaneBelow:
    """Returns the fields of means over cells from left to right edges, arrays (n,), of a problem: pressures
    of corners, array (corners, n), micromoment and shear, arrays (n,), of which on a second body each corner
    has a share as of the pressure. A bulk stress acts along x1.
    """
    clamped = problem.law.clamps_rotation
    total = pressures.sum(axis=0)
    pressed = total > 0
    means = np.array((total, 0 * shear if clamped else micromoment, shear))
    second = None
    if problem.counter is not None:
        share = pressures / np.where(pressed, total, 1.0)
        loads = [
            cell_loads(edges[0] - shift, edges[1] - shift, np.array((p, 0 * p, -part * shear)), p > 0, period)
            for p, part, shift in zip(pressures, share, problem.shifts)
        ]
        second = HalfPlaneBelow(problem.counter, False, loads, period, upper=True)
    loads = [cell_loads(*edges, means, pressed, period)]
    return HalfPlaneBelow(problem.solid, clamped, loads, period, second=second, bulk=bulk)


def modes(
    solid: Cosserat, clamped: bool, k: AnyArray, p: AnyArray, M: AnyArray, q: AnyArray
) -> dict[str, AnyArray]:
    """Returns the amplitudes a, b, d of all fields (a + b x2 + d expm1((s - k) x2)) exp(k x2) from those of
    pressure, micromoment and shear, arrays (k,): arrays (3, k) by name.
    """
    nu, mu = solid.nu, solid.mu
    c = (1 - nu) / mu
    i = 1j
    g = solid.curvature * solid.ell**2
    s, s_minus_k = roots(solid, k)
    if clamped:  # M is whatever keeps psi = R + Theta = 0
        Theta = c * (i * p + q) / (1 + c * g * mu * k * s_minus_k)
    else:
        Theta = (M / (g * mu) + k * c * (i * p + q)) / (s * (1 + g * (1 - nu) * k * (k / s) * s_minus_k))
    R = -c * (i * p + q) + c * g * mu * k * s_minus_k * Theta
    X = g * mu * Theta
    w = p - i * q + i * k * s_minus_k * X
    zero = 0 * k
    psi = np.array((R + Theta, zero, Theta))
    theta = np.array((Theta, zero, Theta))
    s11 = np.array((p - 2 * w, -k * w, -i * k * s * X))
    s22 = np.array((-p, k * w, i * k * s * X))
    s12 = np.array((q, i * k * w, -(k**2) * X))
    return {
        "psi": psi,
        "theta": theta,
        "theta_slope": s * theta,
        "u1": ((1 - nu) * s11 - nu * s22) / (2 * i * mu * k),
        "u2": np.array((-(2 * (1 - nu) * w + i * q) / k, w, i * k * X)) / (2 * mu),
        "s11": s11,
        "s12": s12,
        "s21": s12 - g * mu / solid.layer_length**2 * theta,
        "s22": s22,
        "m1": i * g * mu * k * psi,
        "m2": g * mu * np.array((k * R + s * Theta, zero, s * Theta)),
    }
