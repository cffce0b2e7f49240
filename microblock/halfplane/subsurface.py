"""Fields below the surface of the half-plane, from the modes of a state (docs/theory/halfplane.md).

For loads exp(i k x1), k > 0, the classical rotation is R exp(k x2) and the micropolar mode Theta exp(s x2).
With G = gamma' ell^2 mu, c, s and the page's D,

    Theta = (M/G + i k c p)/(s D),    R = -i c p + c G k (s - k) Theta,

and Airy's (A + B x2) exp(k x2) bears the pressure p + i k s G Theta and the shear G k^2 Theta. Integrals run
along k = tau exp(i pi/4) for sources to the left, along its mirror image for those to the right.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..errors import BadArgument, require_whole
from ..model.fields import PointFields, points
from ..model.problem import Problem
from ..model.quadrature import gauss_rule, lagrange
from ..model.types import AnyArray, Array, Flags, Integers
from ..threads import bounded
from .kernels import ray_rule, roots
from .panels import PanelGrid

CUT = 3.0  # ratio of distances from the point that an interval of sources spans
FAR_TAIL = 32.0  # exp(-32/sqrt(2)) = 1.5e-10
FIELD_NAMES = ("psi", "theta", "theta_slope", "u1", "u2", "s11", "s12", "s21", "s22", "m1", "m2")
IMAGINARY_OF_P = ("psi", "theta", "theta_slope", "u1", "s12", "s21", "m2")  # and real of M; others conversely
TINY = np.finfo(float).tiny  # of parameters, so that an anchor is not divided by


@dataclass(frozen=True, eq=False)
class HalfPlaneFields(PointFields):
    """Fields at points x2 <= 0; theta, theta_slope: the micropolar part of psi, its slope along x2."""

    theta: Array
    theta_slope: Array


@bounded
def fields_at(solution: Any, x1: ArrayLike, x2: ArrayLike, accuracy: int = 10) -> HalfPlaneFields:
    """Returns the fields of a `PanelSolution` at points, arrays or numbers; `accuracy`, Gauss points on a
    piece of the path, of 10 leaves about 1e-8 of the largest values. Raises BadArgument above the surface.
    """
    require_whole(1, 100, accuracy=accuracy)
    x1, x2, shape = points(x1, x2)
    if not np.all(x2 <= 0):
        raise BadArgument("x2", x2, "must not be above the surface")
    # nearer to the surface rounding shows in theta,2
    depth = np.minimum(x2, -1e-7 * solution.problem.solid.ell)
    values = np.empty((len(FIELD_NAMES), len(x1)))
    for abscissa in np.unique(x1):
        on_line = x1 == abscissa
        values[:, on_line] = _on_vertical(solution, abscissa, depth[on_line], accuracy)
    psi, theta, slope, u1, u2, s11, s12, s21, s22, m1, m2 = values
    stress = np.array(((s11, s12), (s21, s22)))
    fields = HalfPlaneFields(x1, x2, psi, np.array((u1, u2)), stress, np.array((m1, m2)), theta, slope)
    return fields.shaped(shape)


def _on_vertical(state: Any, x1: float, x2: Array, accuracy: int) -> Array:
    """Returns all fields at depths x2, array (n,), below the abscissa x1: array (fields, n)."""
    solid = state.problem.solid
    edges = np.concatenate((state.panels.e, state.panels.e + state.panels.h))
    size = np.abs(x1) + np.abs(edges).max() + np.abs(x2).max() + solid.ell
    lowest = 1e-9 / size  # the rest of the integral is dropped
    pieces = int(np.ceil(np.log(FAR_TAIL / np.abs(x2).min() / lowest)))
    k, dk = (part.ravel() for part in ray_rule(lowest, pieces, accuracy))
    p_sum, p_difference, M_sum, M_difference = _transforms(state, x1, k, np.abs(x2).min() / 20, accuracy + 4)
    # symbols that are real for real k go with the sum of left and right sources, imaginary ones with their
    # difference
    amplitudes = _modes(state.problem, k, p_sum, M_difference)
    crossed = _modes(state.problem, k, p_difference, M_sum)
    amplitudes |= {name: crossed[name] for name in IMAGINARY_OF_P}
    a, b, d = np.array([amplitudes[name] for name in FIELD_NAMES]).swapaxes(0, 1) * dk
    classical = np.exp(np.outer(k, x2))
    micropolar = classical * np.expm1(np.outer(roots(solid, k)[1], x2))
    fields = np.real(a @ classical + x2 * (b @ classical) + d @ micropolar) / np.pi
    # the path leaves out the arc around k = 0, where u1 -> i (1 - 2 nu) p/(2 mu k)
    fields[FIELD_NAMES.index("u1")] -= (1 - 2 * solid.nu) / (8 * solid.mu) * p_difference[0].real
    # the rigid-body constant: there u2 -> -(1 - nu) p/(mu k), and the integral of exp(i k ell)/k, which is
    # this, is taken off
    constant = np.euler_gamma + np.log(lowest * solid.ell)
    fields[FIELD_NAMES.index("u2")] -= (1 - solid.nu) / (np.pi * solid.mu) * state.load * constant
    return fields


def _modes(problem: Problem, k: AnyArray, p: AnyArray, M: AnyArray) -> dict[str, AnyArray]:
    """Returns the amplitudes a, b, d of all fields (a + b x2 + d expm1((s - k) x2)) exp(k x2) from those of
    pressure and micromoment, arrays (k,): arrays (3, k) by name.
    """
    solid = problem.solid
    nu, mu = solid.nu, solid.mu
    c = (1 - nu) / mu
    i = 1j
    g = solid.curvature * solid.ell**2
    s, s_minus_k = roots(solid, k)
    if problem.law.clamps_rotation:  # M is whatever keeps psi = R + Theta = 0
        Theta = i * c * p / (1 + c * g * mu * k * s_minus_k)
    else:
        Theta = (M / (g * mu) + i * k * c * p) / (s * (1 + g * (1 - nu) * k * (k / s) * s_minus_k))
    R = -i * c * p + c * g * mu * k * s_minus_k * Theta
    X = g * mu * Theta
    w = p + i * k * s_minus_k * X
    zero = 0 * k
    psi = np.array((R + Theta, zero, Theta))
    theta = np.array((Theta, zero, Theta))
    s11 = np.array((p - 2 * w, -k * w, -i * k * s * X))
    s22 = np.array((-p, k * w, i * k * s * X))
    s12 = np.array((zero, i * k * w, -(k**2) * X))
    return {
        "psi": psi,
        "theta": theta,
        "theta_slope": s * theta,
        "u1": ((1 - nu) * s11 - nu * s22) / (2 * i * mu * k),
        "u2": np.array((-2 * (1 - nu) * w / k, w, i * k * X)) / (2 * mu),
        "s11": s11,
        "s12": s12,
        "s21": s12 - g * mu / solid.layer_length**2 * theta,
        "s22": s22,
        "m1": i * g * mu * k * psi,
        "m2": g * mu * np.array((k * R + s * Theta, zero, s * Theta)),
    }


def _transforms(state: Any, x1: float, k: AnyArray, nearest: float, order: int) -> AnyArray:
    """Returns sum and difference over left and right of the integrals of p, then M, times exp(i k |x1 - x|):
    array (4, k).
    """
    transforms = np.zeros((4, len(k)), complex)
    size = np.abs(k)
    for distance, weights in _sources(state, x1, nearest, order):
        # in short waves what is this far away has decayed
        short = np.searchsorted(size, FAR_TAIL / distance.min())
        transforms[:, :short] += weights @ np.exp(np.outer(distance, 1j * k[:short]))
    return transforms


@dataclass(frozen=True, eq=False)
class PanelHalves:
    """Panels cut at the points nearest to an abscissa, with the distance from it as their coordinate.

    Attributes
    ----------
    panel : array (n,), number of the panel
    v0, way : arrays (n,), the parameter of the nearest point, and the sign with which v goes away from there
    start, end : arrays (n,), distances there and at the end of the panel (lengths)
    h, root : arrays (n,), length of the panel, and whether its abscissae are quadratic in v
    """

    panel: Integers
    v0: Array
    way: Array
    start: Array
    end: Array
    h: Array
    root: Flags

    def select(self, numbers: Integers) -> "PanelHalves":
        """Returns those of the numbers, array (m,), as columns (m, 1)."""
        return PanelHalves(**{name: values[numbers, None] for name, values in vars(self).items()})

    def step(self, distance: Array) -> Array:
        """Returns |v - v0| at distances, columns (m, 1)."""
        ratio = (distance - self.start) / self.h
        v = np.sqrt(np.maximum(self.v0**2 + self.way * ratio, 0))
        return ratio / np.maximum(self.mean_slope(v), TINY)

    def mean_slope(self, v: Array) -> Array:
        """Returns the mean of |dx/dv|/h from v0 to v, array like v."""
        return np.where(self.root, self.v0 + v, 1.0)


def _halves(panels: PanelGrid, x1: float) -> PanelHalves:
    """Returns both halves of all panels about the abscissa x1, the lower ones first."""
    numbers = np.arange(len(panels.e))
    along = np.clip((x1 - panels.e) / panels.h, 0, 1)
    v0 = panels.parameter(numbers, x1)
    start = np.abs(x1 - panels.x(numbers, v0))
    start[(along > 0) & (along < 1)] = 0.0
    h = np.abs(panels.h)
    return PanelHalves(
        panel=np.tile(numbers, 2),
        v0=np.tile(v0, 2),
        way=np.repeat((-1.0, 1.0), len(v0)),
        start=np.tile(start, 2),
        end=np.concatenate((start + h * along, start + h * (1 - along))),
        h=np.tile(h, 2),
        root=np.tile(panels.root, 2),
    )


def _sources(state: Any, x1: float, nearest: float, order: int) -> Iterator[tuple[Array, Array]]:
    """Yields distances and weights of pressure and micromoment, (m,) and (4, m), from near to far. Distances
    are sums of steps: as differences of abscissae they would miss the slope of theta at the surface by
    percents.
    """
    halves = _halves(state.whole[0], x1)
    count = max(0, int(np.ceil(np.log(halves.end.max() / nearest) / np.log(CUT))))
    cuts = np.concatenate(([0.0], nearest * CUT ** np.arange(count + 1)))
    first = np.maximum(halves.start, cuts[:-1, None])
    last = np.minimum(halves.end, cuts[1:, None])
    shell, number = np.nonzero(first < last)
    pieces = halves.select(number)
    low = pieces.step(first[shell, number, None])
    high = pieces.step(last[shell, number, None])
    sigma, gauss = gauss_rule(order)
    step = low + (high - low) * sigma
    v = pieces.v0 + pieces.way * step
    distance = pieces.start + pieces.h * step * pieces.mean_slope(v)
    weights = _force_and_moment(state, pieces, v, (high - low) * gauss)
    for cut in np.unique(shell):
        between = shell == cut
        yield distance[between].ravel(), weights[:, between].reshape(4, -1)


def _force_and_moment(state: Any, pieces: PanelHalves, v: Array, dv: Array) -> Array:
    """Returns force and moment of pieces at parameters v with weights dv, arrays (m, n), as sum and
    difference of sources to the left and to the right: array (4, m, n).
    """
    panels, rows = state.whole
    panel = pieces.panel
    q = np.einsum("ijn,in->ij", lagrange(panels.points[0], v), rows[panel[:, 0]])
    force = dv * (q + panels.slope(panel, v) * panels.logarithm(panel, np.maximum(v, TINY)))
    # 1 where the source lies left of x1
    side = np.broadcast_to(-np.sign(panels.h)[panel] * pieces.way, v.shape)
    lever = state.problem.lever(np.broadcast_to(panels.corner[panel], v.shape), panels.x(panel, v))
    moment = state.problem.solid.ell / 2 * lever * force
    return np.array((force, side * force, moment, side * moment))
