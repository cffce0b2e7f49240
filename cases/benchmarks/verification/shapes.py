"""100 standard shapes in the plane and in space, drawn by program, beside closed forms: what the library
answers without an rtol. Nothing of the library is used here but what is judged.

A symmetric profile h(r) touches within r < c. With flat punches of all widths t < c superposed (Sneddon 1965;
in the plane the same with 1/sqrt(t^2 - x^2) in place of the punch in space) its pressure is

    p(r) = E*/pi times the integral over r < t < c of dG(t)/sqrt(t^2 - r^2),

    plane   G(t) = integral over 0 < s < t of s h'(s)/sqrt(t^2 - s^2),     load E* G(c),
    space   G(t) = integral over 0 < s < t of t h'(s)/sqrt(t^2 - s^2),     load 2 E* times that of t dG(t),

and at an edge r = a of the obstacle that the contact reaches that of a flat punch with the rest of the load.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import inf, pi, sqrt

import numpy as np
from scipy.optimize import brentq
from scipy.special import ellipe, ellipkm1

from . import SEED
from .judging import Case
from .obstacles import log

PARTS = 1500  # of the radii, denser towards corners of the profile and the edge of the contact


@dataclass(frozen=True)
class Profile:
    """A profile, its slope, and radii at which the slope or the curvature jumps; `edge` where it ends."""

    name: str
    height: Callable
    slope: Callable
    corners: tuple = ()
    edge: float = inf


def powers(b, n):
    return Profile(f"r^{n:.2f}", lambda r: b * r**n, lambda r: b * n * r ** (n - 1))


def blunted(b, slope):
    """Cone or wedge with a flat tip."""
    return Profile("blunted", lambda r: slope * np.maximum(r - b, 0), lambda r: slope * (r > b), corners=(b,))


def truncated(b, R):
    """Paraboloid or parabola with a flat tip."""
    return Profile(
        "truncated", lambda r: np.maximum(r**2 - b**2, 0) / (2 * R), lambda r: r / R * (r > b), corners=(b,)
    )


def rounded(b, R):
    """Flat punch with rounded shoulders."""
    return Profile(
        "rounded punch",
        lambda r: np.maximum(r - b, 0) ** 2 / (2 * R),
        lambda r: np.maximum(r - b, 0) / R,
        corners=(b,),
    )


def tipped(b, slope):
    """Cone or wedge with a rounded tip."""
    return Profile(
        "rounded tip",
        lambda r: np.where(r < b, slope * r**2 / (2 * b), slope * (r - b / 2)),
        lambda r: slope * np.minimum(r / b, 1),
        corners=(b,),
    )


def ended(whole, a):
    """A profile with an edge."""
    return Profile(
        f"{whole.name} to an edge",
        lambda r: np.where(r <= a, whole.height(np.minimum(r, a)), inf),
        whole.slope,
        tuple(corner for corner in whole.corners if corner < a),
        a,
    )


class Symmetric:
    """Pressure under a Profile in the plane or in space."""

    def __init__(self, profile, modulus, load, in_space):
        self.profile, self.modulus, self.in_space = profile, modulus, in_space
        reach = profile.edge if profile.edge < inf else 1.0
        while profile.edge == inf and self._load(reach) < load:
            reach *= 2
        full = self._load(reach)
        self.contact = reach if full <= load else brentq(lambda c: self._load(c) - load, 1e-9 * reach, reach)
        self.rest = max(load - full, 0.0)
        self.nodes = self._nodes(self.contact)
        self.values = self._values(self.nodes)
        self.approach = self.values[-1]
        if in_space:
            self.approach += self.rest / (2 * modulus * self.contact)

    def _nodes(self, contact):
        """Radii up to the contact, denser towards its edge and corners of the profile."""
        ends = [0.0, *(corner for corner in self.profile.corners if corner < contact), contact]
        dense = (1 - np.cos(pi * np.arange(PARTS + 1) / PARTS)) / 2
        parts = [left + (right - left) * dense**1.5 for left, right in zip(ends, ends[1:])]
        return np.unique(np.concatenate(parts))

    def _values(self, t):
        """G at radii, array (n,): Gauss's rule would not see corners, where the angle is parted."""
        x, weights = np.polynomial.legendre.leggauss(48)
        bounds = [0.0, *self.profile.corners, inf]
        total = np.zeros_like(t)
        safe = np.maximum(t, 1e-300)
        for left, right in zip(bounds, bounds[1:]):
            low, high = (np.arcsin(np.clip(end / safe, 0, 1)) for end in (left, right))
            angle = low[:, None] + (high - low)[:, None] * (x + 1) / 2
            s = t[:, None] * np.sin(angle)
            inner = np.clip(s, left * (1 + 1e-12), right)  # rounding may step over a corner
            part = self.profile.slope(inner) * (t[:, None] if self.in_space else s)
            total += (part @ weights) * (high - low) / 2
        return total

    def _load(self, contact):
        nodes = self._nodes(contact)
        values = self._values(nodes)
        if not self.in_space:
            return self.modulus * values[-1]
        return 2 * self.modulus * np.sum(np.diff(values) * (nodes[1:] + nodes[:-1]) / 2)

    def pressure(self, r):
        """Pressure at r, array (n,), G linear between nodes."""
        found = np.zeros(len(r))
        t, slopes = self.nodes, np.diff(self.values) / np.diff(self.nodes)
        for i in np.flatnonzero(r < self.contact):
            x = max(r[i], 1e-9 * self.contact)
            found[i] = slopes @ np.diff(np.arccosh(np.maximum(t / x, 1)))
        found *= self.modulus / pi
        inside = r < self.contact
        root = np.sqrt(self.contact**2 - r[inside] ** 2)
        found[inside] += self.rest / (2 * pi * self.contact * root if self.in_space else pi * root)
        return found

    @property
    def places(self):
        """Radii between which pressures are smooth."""
        return [*(corner for corner in self.profile.corners if corner < self.contact), self.contact]

    def weight(self, r):
        """Of squares, as docs/methods.md says."""
        a = self.profile.edge
        if a == inf:
            return np.ones_like(r)
        return np.minimum(np.abs(a - r) / a, 1) ** (2 if self.in_space else 1)


class Elliptic:
    """Pressure under an ellipsoid (Johnson 1985, 4.2)."""

    def __init__(self, R1, R2, modulus, load):
        long, short = max(R1, R2), min(R1, R2)
        ratio = brentq(lambda q: self._curvatures(q) - long / short, 1e-7, 1 - 1e-9)  # b/a
        K, E, square = self._integrals(ratio)
        # z = A x^2 + B y^2 with 2 A = 1/long, A = p0 b (K - E)/(E* e^2 a^2), p0 = 3 P/(2 pi a b)
        a = (3 * load * (K - E) / (2 * pi * modulus * square) * 2 * long) ** (1 / 3)
        self.axes = (a, a * ratio) if R1 >= R2 else (a * ratio, a)
        self.peak = 1.5 * load / (pi * a * a * ratio)
        self.approach = self.peak * a * ratio * K / modulus

    @staticmethod
    def _integrals(ratio):
        return ellipkm1(ratio**2), ellipe(1 - ratio**2), 1 - ratio**2

    def _curvatures(self, ratio):
        K, E, _ = self._integrals(ratio)
        return (E / ratio**2 - K) / (K - E)

    def error(self, state):
        """Relative error in L2 of pressures, on rings that end at the edge."""
        r, turns = rings([1.0], 1.3), 2 * pi * (np.arange(180) + 0.5) / 180
        middles, widths = (r[1:] + r[:-1]) / 2, np.diff(r)
        x, y = (axis * np.outer(middles, way(turns)) for axis, way in zip(self.axes, (np.cos, np.sin)))
        true = self.peak * np.sqrt(np.maximum(1 - middles**2, 0))[:, None]
        values = state.pressure_at(np.column_stack((x.ravel(), y.ravel()))).reshape(x.shape)
        weights = (middles * widths)[:, None]
        return sqrt(np.sum(weights * (values - true) ** 2) / np.sum(weights * true**2 * np.ones_like(x)))


def rings(places, most):
    """Bounds of rings up to `most` times the last of places, denser towards each of them."""
    ends = [0.0, *places, most * places[-1]]
    dense = (1 - np.cos(pi * np.arange(161) / 160)) / 2
    return np.unique(np.concatenate([a + (b - a) * dense for a, b in zip(ends, ends[1:])]))


def error(state, true):
    """Relative error in L2 of the pressure of a state beside a Symmetric one, in the norm of its estimate."""
    r = rings(true.places, 1.0 if true.rest else 1.3)
    middles, widths = (r[1:] + r[:-1]) / 2, np.diff(r)
    p, weights = true.pressure(middles), widths * true.weight(middles)
    if not true.in_space:
        wrong = [state.pressure_at(side * middles) - p for side in (-1, 1)]
        return sqrt(np.sum(weights * np.array(wrong) ** 2) / np.sum(2 * weights * p**2))
    turns = 2 * pi * (np.arange(96) + 0.5) / 96
    x, y = (np.outer(middles, way(turns)) for way in (np.cos, np.sin))
    wrong = state.pressure_at(np.column_stack((x.ravel(), y.ravel()))).reshape(x.shape) - p[:, None]
    weights *= middles
    return sqrt(np.sum(weights[:, None] * wrong**2) / np.sum(len(turns) * weights * p**2))


def drawn(k):
    """(words, Contact, load, truth) of shape k: 45 in the plane, 55 in space."""
    import microblock as mb

    rng = np.random.default_rng((SEED, *b"shapes", k))
    in_space = k >= 45
    E, nu = log(rng, 0.1, 1000), rng.uniform(0, 0.45)
    modulus, size = E / (1 - nu**2), log(rng, 0.1, 10)  # of the contact
    solid = mb.Elastic(E=E, nu=nu)
    body = mb.HalfSpace(solid) if in_space else mb.HalfPlane(solid)
    kinds = ("powers", "blunted", "truncated", "rounded", "tipped", "ended", "punch", "cone", "sphere")
    kind = (*kinds, "ellipsoid", "ellipsoid")[k % 11] if in_space else kinds[k % 9]
    b, steep = size * rng.uniform(0.2, 0.95), log(rng, 1e-3, 0.1)
    if kind == "ellipsoid":
        R1, R2 = size * log(rng, 10, 100), size * log(rng, 0.1, 100)
        load = modulus * log(rng, 1e-4, 1e-2) * min(R1, R2) ** 2
        true = Elliptic(R1, R2, modulus, load)
        return f"ellipsoid {R1 / R2:.3g}", mb.Contact(body, mb.Ellipsoid(R1, R2), mb.Unilateral()), load, true
    profile = {
        "powers": lambda: powers(steep * size ** (1 - (n := rng.uniform(1.2, 6))), n),
        "blunted": lambda: blunted(b, steep),
        "truncated": lambda: truncated(b, size / steep),
        "rounded": lambda: rounded(b, size / steep),
        "tipped": lambda: tipped(b, steep),
        "ended": lambda: ended(truncated(b, size / steep) if k % 2 else powers(steep / size, 2), size),
        "punch": lambda: ended(powers(0.0, 2), size),
        "cone": lambda: powers(steep, 1),
        "sphere": lambda: powers(steep / size, 2),
    }[kind]()
    known = {
        "punch": lambda: mb.FlatPunch(size) if in_space else mb.Punch(size),
        "cone": lambda: mb.Cone(steep) if in_space else mb.Wedge(steep),
        "sphere": lambda: (mb.Sphere if in_space else mb.Cylinder)(size / steep / 2),
    }
    if kind in known:
        obstacle = known[kind]()
    elif in_space:
        obstacle = lambda x1, x2: profile.height(np.hypot(x1, x2))  # noqa: E731
    else:
        obstacle = mb.Obstacle(lambda x: profile.height(np.abs(x)))
    mean = steep * modulus * (size * pi / 4 if in_space else 1)
    load = mean * size * (log(rng, 0.3, 2) if kind != "punch" else 1.0)
    true = Symmetric(profile, modulus, load, in_space)
    return profile.name, mb.Contact(body, obstacle, mb.Unilateral()), load, true


def case(k):
    """Shape k as a Case, to 1 so that its estimate alone decides."""
    words, problem, load, true = drawn(k)

    def verify(state):
        wrong = true.error(state) if isinstance(true, Elliptic) else error(state, true)
        return wrong, state.error_estimate, 2e-5  # what rings and nodes leave

    return Case(f"{'space' if k >= 45 else 'plane'} {words}", 0.0, lambda: problem.solve(load=load), verify)
