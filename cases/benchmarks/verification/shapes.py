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

import microblock as mb

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


def ended(profile, a):
    """A profile with an edge."""
    return Profile(
        f"{profile.name} to an edge",
        lambda r: np.where(r <= a, profile.height(np.minimum(r, a)), inf),
        profile.slope,
        tuple(corner for corner in profile.corners if corner < a),
        a,
    )


class Symmetric:
    """Pressure under a Profile in the plane or in space."""

    def __init__(self, profile, modulus, load, in_space):
        self.profile = profile
        self.modulus = modulus
        self.in_space = in_space
        self.contact = profile.edge
        if profile.edge == inf or self._load(profile.edge) > load:
            reach = profile.edge if profile.edge < inf else 1.0
            while profile.edge == inf and self._load(reach) < load:
                reach *= 2
            self.contact = brentq(lambda c: self._load(c) - load, 1e-9 * reach, reach)
        self.rest = 0.0
        if self.contact == profile.edge:
            self.rest = load - self._load(self.contact)
        self.nodes = self._nodes(self.contact)
        self.values = self._values(self.nodes)
        self.approach = self.values[-1]
        if in_space:
            self.approach += self.rest / (2 * modulus * self.contact)

    def _nodes(self, contact):
        """Radii up to the contact, denser towards its edge and corners of the profile."""
        ends = [0.0, *(corner for corner in self.profile.corners if corner < contact), contact]
        dense = (1 - np.cos(pi * np.arange(PARTS + 1) / PARTS)) / 2
        return np.unique([left + (right - left) * dense**1.5 for left, right in zip(ends, ends[1:])])

    def _values(self, t):
        """G at radii, array (n,): Gauss's rule would not see corners, where the angle is parted."""
        bounds = [0.0, *self.profile.corners, inf]
        return sum(self._part(t, left, right) for left, right in zip(bounds, bounds[1:]))

    def _part(self, t, left, right):
        """The part of G at radii t that radii from left to right make."""
        x, weights = np.polynomial.legendre.leggauss(48)
        low, high = (np.arcsin(np.clip(end / np.maximum(t, 1e-300), 0, 1)) for end in (left, right))
        angle = low[:, None] + (high - low)[:, None] * (x + 1) / 2
        s = t[:, None] * np.sin(angle)
        slopes = self.profile.slope(np.clip(s, left * (1 + 1e-12), right))  # rounding may step over a corner
        factor = t[:, None] if self.in_space else s
        return (slopes * factor @ weights) * (high - low) / 2

    def _load(self, contact):
        nodes = self._nodes(contact)
        values = self._values(nodes)
        if not self.in_space:
            return self.modulus * values[-1]
        return 2 * self.modulus * np.sum(np.diff(values) * (nodes[1:] + nodes[:-1]) / 2)

    def pressure(self, r):
        """Pressure at r, array (n,), G linear between nodes."""
        p = np.zeros(len(r))
        slopes = np.diff(self.values) / np.diff(self.nodes)
        inside = r < self.contact
        for i in np.flatnonzero(inside):
            x = max(r[i], 1e-9 * self.contact)
            p[i] = slopes @ np.diff(np.arccosh(np.maximum(self.nodes / x, 1))) * self.modulus / pi
        root = np.sqrt(self.contact**2 - r[inside] ** 2)
        p[inside] += self.rest / (2 * pi * self.contact * root if self.in_space else pi * root)
        return p

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

    def error(self, state):
        """Relative error in L2 of the pressure of a state, in the norm of its estimate."""
        r = rings(self.places, 1.0 if self.rest else 1.3)
        middles = (r[1:] + r[:-1]) / 2
        p = self.pressure(middles)
        weights = np.diff(r) * self.weight(middles)
        if self.in_space:
            x, y = around(middles, 96)
            values = state.pressure_at(np.column_stack((x.ravel(), y.ravel()))).reshape(x.shape).T
            weights *= middles
        else:
            values = np.array([state.pressure_at(side * middles) for side in (-1, 1)])
        return sqrt(np.sum(weights * (values - p) ** 2) / np.sum(len(values) * weights * p**2))


class Elliptic:
    """Pressure under an ellipsoid (Johnson 1985, 4.2)."""

    def __init__(self, R1, R2, modulus, load):
        long = max(R1, R2)
        short = min(R1, R2)
        ratio = brentq(lambda q: self._curvatures(q) - long / short, 1e-7, 1 - 1e-9)  # b/a
        K, E = self._integrals(ratio)
        # z = A x^2 + B y^2 with 2 A = 1/long, A = p0 b (K - E)/(E* e^2 a^2), p0 = 3 P/(2 pi a b)
        a = (3 * load * (K - E) / (2 * pi * modulus * (1 - ratio**2)) * 2 * long) ** (1 / 3)
        self.axes = (a, a * ratio) if R1 >= R2 else (a * ratio, a)
        self.peak = 1.5 * load / (pi * a * a * ratio)
        self.approach = self.peak * a * ratio * K / modulus

    @staticmethod
    def _integrals(ratio):
        return ellipkm1(ratio**2), ellipe(1 - ratio**2)

    def _curvatures(self, ratio):
        K, E = self._integrals(ratio)
        return (E / ratio**2 - K) / (K - E)

    def error(self, state):
        """Relative error in L2 of pressures, on rings that end at the edge."""
        r = rings([1.0], 1.3)
        middles = (r[1:] + r[:-1]) / 2
        points = np.stack([axis * way for axis, way in zip(self.axes, around(middles, 180))], axis=-1)
        true = self.peak * np.sqrt(np.maximum(1 - middles**2, 0))[:, None]
        values = state.pressure_at(points.reshape(-1, 2)).reshape(points.shape[:2])
        weights = (middles * np.diff(r))[:, None]
        return sqrt(np.sum(weights * (values - true) ** 2) / np.sum(weights * true**2 * np.ones_like(values)))


def rings(places, most):
    """Bounds of rings up to `most` times the last of places, denser towards each of them."""
    ends = [0.0, *places, most * places[-1]]
    dense = (1 - np.cos(pi * np.arange(161) / 160)) / 2
    return np.unique([a + (b - a) * dense for a, b in zip(ends, ends[1:])])


def around(r, count):
    """x and y, arrays (n, count), of points on circles of the radii r (n,)."""
    angle = 2 * pi * (np.arange(count) + 0.5) / count
    return np.outer(r, np.cos(angle)), np.outer(r, np.sin(angle))


KINDS = "powers", "blunted", "truncated", "rounded", "tipped", "ended", "punch", "cone", "sphere"


def drawn(k):
    """(words, Contact, load, truth) of shape k: 45 in the plane, 55 in space."""
    rng = np.random.default_rng((SEED, *b"shapes", k))
    in_space = k >= 45
    E = log(rng, 0.1, 1000)
    nu = rng.uniform(0, 0.45)
    modulus = E / (1 - nu**2)
    size = log(rng, 0.1, 10)  # of the contact
    body = (mb.HalfSpace if in_space else mb.HalfPlane)(mb.Elastic(E=E, nu=nu))
    kind = (*KINDS, "ellipsoid", "ellipsoid")[k % 11] if in_space else KINDS[k % 9]
    b = size * rng.uniform(0.2, 0.95)
    steep = log(rng, 1e-3, 0.1)
    if kind == "ellipsoid":
        return ellipsoid(rng, body, modulus, size)
    profile = profile_of(rng, kind, size, b, steep, k % 2)
    load = steep * modulus * size * (size * pi / 4 if in_space else 1)
    if kind != "punch":
        load *= log(rng, 0.3, 2)
    return (
        profile.name,
        mb.Contact(body, obstacle_of(kind, profile, size, steep, in_space), mb.Unilateral()),
        load,
        Symmetric(profile, modulus, load, in_space),
    )


def ellipsoid(rng, body, modulus, size):
    R1 = size * log(rng, 10, 100)
    R2 = size * log(rng, 0.1, 100)
    load = modulus * log(rng, 1e-4, 1e-2) * min(R1, R2) ** 2
    problem = mb.Contact(body, mb.Ellipsoid(R1, R2), mb.Unilateral())
    return f"ellipsoid {R1 / R2:.3g}", problem, load, Elliptic(R1, R2, modulus, load)


def profile_of(rng, kind, size, b, steep, odd):
    if kind == "powers":
        n = rng.uniform(1.2, 6)
        return powers(steep * size ** (1 - n), n)
    return {
        "blunted": blunted(b, steep),
        "truncated": truncated(b, size / steep),
        "rounded": rounded(b, size / steep),
        "tipped": tipped(b, steep),
        "ended": ended(truncated(b, size / steep) if odd else powers(steep / size, 2), size),
        "punch": ended(powers(0.0, 2), size),
        "cone": powers(steep, 1),
        "sphere": powers(steep / size, 2),
    }[kind]


def obstacle_of(kind, profile, size, steep, in_space):
    """The library's obstacle, or the height of the profile."""
    if kind == "punch":
        return mb.FlatPunch(size) if in_space else mb.Punch(size)
    if kind == "cone":
        return mb.Cone(steep) if in_space else mb.Wedge(steep)
    if kind == "sphere":
        return (mb.Sphere if in_space else mb.Cylinder)(size / steep / 2)
    if in_space:
        return lambda x1, x2: profile.height(np.hypot(x1, x2))
    return mb.Obstacle(lambda x: profile.height(np.abs(x)))


def case(k):
    """Shape k as a Case, to 0 so that its estimate alone decides."""
    words, problem, load, true = drawn(k)

    def verify(state):
        return true.error(state), state.error_estimate, 2e-5  # what rings and nodes leave

    return Case(f"{'space' if k >= 45 else 'plane'} {words}", 0.0, lambda: problem.solve(load=load), verify)
