"""Fields below the surface of the half-plane, from the modes of a state (docs/theory/halfplane.md).

For loads exp(i k x1), k > 0, the classical rotation is R exp(k x2) and the micropolar mode Theta exp(s x2).
With G = gamma' ell^2 mu, c, s and the page's D,

    Theta = (M/G + i k c p)/(s D),    R = -i c p + c G k (s - k) Theta,

and Airy's (A + B x2) exp(k x2) bears the pressure p + i k s G Theta and the shear G k^2 Theta. Integrals run
along k = tau exp(i pi/4) for sources to the left, along its mirror image for those to the right.
"""

from dataclasses import dataclass

import numpy as np

from ..errors import BadArgument, require_whole
from ..model.fields import PointFields, points
from ..model.quadrature import gauss_rule, lagrange
from ..threads import bounded
from .kernels import path, roots

CUT = 3.0  # ratio of distances from the point that an interval of sources spans
FAR_TAIL = 32.0  # exp(-32/sqrt(2)) = 1.5e-10
NAMES = ("psi", "theta", "theta_slope", "u1", "u2", "s11", "s12", "s21", "s22", "m1", "m2")
ODD = ("psi", "theta", "theta_slope", "u1", "s12", "s21", "m2")  # real symbols of M, imaginary ones of p


@dataclass(frozen=True, eq=False)
class Fields(PointFields):
    """Fields at points x2 <= 0; theta, theta_slope: the micropolar share of psi, its slope along x2."""

    theta: np.ndarray
    theta_slope: np.ndarray


@bounded
def fields_at(solution, x1, x2, accuracy=10):
    """Fields of a PanelSolution at points, arrays or numbers; `accuracy`, Gauss points on a piece of the
    path, of 10 leaves about 1e-8 of the largest values. Raises BadArgument above the surface.
    """
    require_whole(1, 100, accuracy=accuracy)
    x1, x2, shape = points(x1, x2)
    if not np.all(x2 <= 0):
        raise BadArgument("x2", x2, "must not be above the surface")
    # nearer to the surface rounding shows in theta,2
    depth = np.minimum(x2, -1e-7 * solution.problem.solid.ell)
    values = np.empty((len(NAMES), len(x1)))
    for place in np.unique(x1):
        here = x1 == place
        values[:, here] = _vertical(solution, place, depth[here], accuracy)
    psi, theta, slope, u1, u2, s11, s12, s21, s22, m1, m2 = values
    stress = np.array(((s11, s12), (s21, s22)))
    found = Fields(x1, x2, psi, np.array((u1, u2)), stress, np.array((m1, m2)), theta, slope)
    return found.shaped(shape)


def _vertical(state, x1, x2, accuracy):
    solid = state.problem.solid
    edges = np.concatenate((state.panels.e, state.panels.e + state.panels.h))
    size = np.abs(x1) + np.abs(edges).max() + np.abs(x2).max() + solid.ell
    lowest = 1e-9 / size  # the rest of the integral is dropped
    pieces = int(np.ceil(np.log(FAR_TAIL / np.abs(x2).min() / lowest)))
    k, dk = map(np.ravel, path(lowest, pieces, accuracy))
    p_sum, p_difference, M_sum, M_difference = _transforms(state, x1, k, np.abs(x2).min() / 20, accuracy + 4)
    # symbols that are real for real k go with the sum of left and right sources, imaginary ones with their
    # difference
    odd = _modes(state.problem, k, p_difference, M_sum)
    even = _modes(state.problem, k, p_sum, M_difference)
    chosen = np.array([(odd if name in ODD else even)[name] for name in NAMES]) * dk
    s_minus_k = roots(solid, k)[1]
    classical = np.exp(np.outer(k, x2))
    micropolar = classical * np.expm1(np.outer(s_minus_k, x2))
    found = (
        np.real(chosen[:, 0] @ classical + x2 * (chosen[:, 1] @ classical) + chosen[:, 2] @ micropolar)
        / np.pi
    )
    # the path leaves out the arc around k = 0, where u1 -> i (1 - 2 nu) p/(2 mu k)
    found[NAMES.index("u1")] -= (1 - 2 * solid.nu) / (8 * solid.mu) * p_difference[0].real
    # the level: there u2 -> -(1 - nu) p/(mu k), and the integral of exp(i k ell)/k, which is this, is taken
    # off
    found[NAMES.index("u2")] -= (
        (1 - solid.nu) / (np.pi * solid.mu) * state.load * (np.euler_gamma + np.log(lowest * solid.ell))
    )
    return found


def _modes(problem, k, p, M):
    """Amplitudes a, b, d of all fields (a + b x2 + d expm1((s - k) x2)) exp(k x2), arrays (3, k) by name."""
    solid = problem.solid
    nu, mu, c, i = solid.nu, solid.mu, (1 - solid.nu) / solid.mu, 1j
    g = solid.curvature * solid.ell**2
    s, s_minus_k = roots(solid, k)
    if problem.law.clamps_rotation:  # M is whatever keeps psi = R + Theta = 0
        Theta = i * c * p / (1 + c * g * mu * k * s_minus_k)
    else:
        Theta = (M / (g * mu) + i * k * c * p) / (s * (1 + g * (1 - nu) * k * (k / s) * s_minus_k))
    R, X, none = -i * c * p + c * g * mu * k * s_minus_k * Theta, g * mu * Theta, 0 * k
    w = p + i * k * s_minus_k * X
    psi, theta = np.array((R + Theta, none, Theta)), np.array((Theta, none, Theta))
    s11 = np.array((p - 2 * w, -k * w, -i * k * s * X))
    s22 = np.array((-p, k * w, i * k * s * X))
    s12 = np.array((none, i * k * w, -(k**2) * X))
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
        "m2": g * mu * np.array((k * R + s * Theta, none, s * Theta)),
    }


def _transforms(state, x1, k, nearest, points):
    """Sum and difference over left and right of the integrals of p, then M, times exp(i k |x1 - x|)."""
    found = np.zeros((4, len(k)), complex)
    # moments of sources as far as 0.1/|k|, which serve for their transform: 0.1^7/7! = 2e-11
    size, ik, factorials = np.abs(k), 1j * k, np.cumprod([1.0, *range(1, 7)])
    for distance, weights in _sources(state, x1, nearest, points):
        # long waves see moments only; in short ones what is this far away has decayed
        long, short = np.searchsorted(size, (0.1 / distance.max(), FAR_TAIL / distance.min()))
        found[:, long:short] += weights @ np.exp(np.outer(distance, ik[long:short]))
        powers = np.vander(ik[:long] * distance.max(), len(factorials), increasing=True) / factorials
        found[:, :long] += (
            weights @ np.vander(distance / distance.max(), len(factorials), increasing=True)
        ) @ powers.T
    return found


def _sources(state, x1, nearest, points):
    """Distances and weights of pressure and micromoment, (m,) and (4, m), from near to far. Distances are
    sums of steps: as differences of abscissae they would miss the slope of theta at the surface by percents.
    """
    panels, rows = state.whole
    v0, direction, start, end = _halves(panels, x1)
    count = max(0, int(np.ceil(np.log(end.max() / nearest) / np.log(CUT))))
    cuts = np.concatenate(([0.0], nearest * CUT ** np.arange(count + 1)))
    first, last = np.maximum(start, cuts[:-1, None]), np.minimum(end, cuts[1:, None])
    level, half = np.nonzero(first < last)
    panel = half % len(panels.e)
    v0, direction, start = v0[half, None], direction[half, None], start[half, None]
    h, root = np.abs(panels.h)[panel, None], panels.root[panel, None]

    def steps(distance):
        share = (distance - start) / h
        other = np.sqrt(np.maximum(v0**2 + direction * share, 0))
        return share / np.maximum(_mean_slope(v0, other, root), np.finfo(float).tiny)

    sigma, gauss = gauss_rule(points)
    low, high = steps(first[level, half, None]), steps(last[level, half, None])
    step = low + (high - low) * sigma
    v = v0 + direction * step
    distance = start + h * step * _mean_slope(v0, v, root)
    q = np.einsum("ijn,in->ij", lagrange(panels.points[0], v), rows[panel])
    numbers = panel[:, None]
    force = (
        (high - low)
        * gauss
        * (q + panels.slope(numbers, v) * panels.logarithm(numbers, np.maximum(v, np.finfo(float).tiny)))
    )
    # 1 where the source lies left of x1
    side = np.broadcast_to(-np.sign(panels.h)[panel, None] * direction, v.shape)
    lever = state.problem.lever(np.broadcast_to(panels.corner[numbers], v.shape), panels.x(numbers, v))
    moment = state.problem.solid.ell / 2 * lever * force
    weights = np.array((force, side * force, moment, side * moment))
    for number in np.unique(level):
        here = level == number
        yield distance[here].ravel(), weights[:, here].reshape(4, -1)


def _mean_slope(v, w, root):
    return np.where(root, v + w, 1.0)


def _halves(panels, x1):
    """Panels cut at the points nearest to x1: v there, direction, distances there and at the end."""
    along, numbers = np.clip((x1 - panels.e) / panels.h, 0, 1), np.arange(len(panels.e))
    v0 = panels.parameter(numbers, x1)
    start = np.abs(x1 - panels.x(numbers, v0))
    start[(along > 0) & (along < 1)] = 0.0
    length = np.abs(panels.h)
    ends = start + np.concatenate((length * along, length * (1 - along))).reshape(2, -1)
    return np.tile(v0, 2), np.repeat((-1.0, 1.0), len(v0)), np.tile(start, 2), ends.ravel()
