"""Closed forms to check against: nothing here knows of a mesh."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from microblock.model.material import hertz as hertz  # beside the others
from microblock.model.types import Array, Interval

StripState: TypeAlias = Literal["separation", "partial", "full"]


@dataclass
class Strip:
    """The strip between rigid planes, (44)-(49), for any curvature coefficient gamma'; it occupies -1 <= x2
    <= 1.

    Lengths are over H, stresses over mu, and ``k = sqrt(2 beta/gamma')/ell``. The fields are ``psi = -a
    cosh(k x2)/cosh(k)``, ``u1 = a (beta/k) sinh(k x2)/cosh(k)`` and u2 linear; `ell` is ell/H, `psi0` the
    initial rotation (radians), `delta` the approach over H from first touch, `curvature` gamma', which is 2
    in the paper. `state` is "separation" (delta <= 0), "partial" or "full" (from `delta_fc` on), `rotation`
    a, `traction` t_n over mu, `micromoment` M = m_2 at x2 = 1 over mu H, `L_psi` and `L_u` the layer lengths.
    """

    ell: float
    psi0: float
    nu: float
    beta: float
    delta: float
    curvature: float = 2.0

    def __post_init__(self) -> None:
        self.k = math.sqrt(2 * self.beta / self.curvature) / self.ell  # inverse decay length of the layer
        self.L_psi, self.L_u = 1 / (self.k * math.tanh(self.k)), math.tanh(self.k) / self.k  # (49)
        self.oedometric = 2 * (1 - self.nu) / (1 - 2 * self.nu)  # (lambda + 2 mu)/mu
        bending = self.curvature * self.ell**2 * self.k * math.tanh(self.k)  # M over the rotation
        lever, size = self.ell / 2 * (1 - abs(self.psi0)), abs(self.psi0)
        compression = bending / (lever * self.oedometric)  # while one corner carries all, M = lever t_n, (45)
        self.delta_fc = size * (lever + compression)  # at which the second corner closes, (47)
        self.state: StripState = "partial"
        turned, strain = self.delta / (lever + compression), 0.0
        if self.delta <= 0:
            self.state, turned = "separation", 0.0
        elif self.delta >= self.delta_fc:
            self.state, turned, strain = "full", size, self.delta - lever * size
        self.rotation = math.copysign(turned, self.psi0)
        self.traction = -self.oedometric * (strain if self.state == "full" else turned * compression)
        self.micromoment = -bending * self.rotation
        self._strain = self.traction / self.oedometric

    def psi(self, x2: ArrayLike) -> Array:
        """Returns the microrotation (46) (radians) at x2, array (n,)."""
        return -self.rotation * self._even(x2)

    def u1(self, x2: ArrayLike) -> Array:
        """Returns the horizontal displacement (46) over H at x2, array (n,)."""
        return self.rotation * self.beta / self.k * self._odd(x2)

    def u2(self, x2: ArrayLike) -> Array:
        """Returns the vertical displacement (46) over H at x2, array (n,)."""
        return self._strain * np.asarray(x2, float)

    def _even(self, x2: ArrayLike) -> Array:
        """Returns cosh(k x2)/cosh(k) without overflow."""
        x2 = np.asarray(x2, float)
        return (np.exp(self.k * (x2 - 1)) + np.exp(-self.k * (x2 + 1))) / (1 + math.exp(-2 * self.k))

    def _odd(self, x2: ArrayLike) -> Array:
        """Returns sinh(k x2)/cosh(k) without overflow or cancellation."""
        x2 = np.asarray(x2, float)
        return -np.exp(self.k * (x2 - 1)) * np.expm1(-2 * self.k * x2) / (1 + math.exp(-2 * self.k))


def punch(x: ArrayLike, load: float, half_width: float) -> Array:
    """Returns the pressure of a flat punch of that half-width on a classical half-plane: P/(pi sqrt(a^2 -
    x^2)), 0 outside.
    """
    inside = half_width**2 - np.asarray(x, float) ** 2
    return np.where(inside > 0, load / (math.pi * np.sqrt(np.where(inside > 0, inside, 1))), 0)


def tilted_punch(
    x: ArrayLike, load: float, half_width: float, tilt: float, E_star: float
) -> tuple[Array, Interval]:
    """Returns the pressure at x, array (n,), of a punch |x| < b of the slope `tilt` on a classical
    half-plane, and its contact (left, right).

    From the deeper edge of the punch on the contact extends over ``4 P/(pi E* |tilt|)``, with the pressure
    ``E* |tilt|/2 sqrt(r/s)``, r from the free edge of the contact, s from the edge of the punch; where that
    width exceeds 2 b the pressure is ``(P/pi - E* tilt x/2)/sqrt(b^2 - x^2)`` (Muskhelishvili, Some basic
    problems, 115).
    """
    x, b = np.asarray(x, float), half_width
    if load >= math.pi / 2 * E_star * abs(tilt) * b:
        square = b**2 - x**2
        pressure = (load / math.pi - E_star * tilt * x / 2) / np.sqrt(np.where(square > 0, square, 1))
        return np.where(square > 0, pressure, 0), (-b, b)
    sign, width = math.copysign(1, tilt), 4 * load / (math.pi * E_star * abs(tilt))
    s = b + sign * x  # from the deeper edge, which is the left one for tilt > 0
    inside = (s > 0) & (s < width)
    pressure = E_star * abs(tilt) / 2 * np.sqrt(np.where(inside, width - s, 0) / np.where(inside, s, 1))
    left, right = sorted((-sign * b, sign * (width - b)))
    return np.where(inside, pressure, 0), (left, right)


def wedge(x: ArrayLike, load: float, half_width: float) -> Array:
    """Returns the pressure of a blunt wedge on a classical half-plane: P/(pi a) arccosh(a/|x|) at x != 0,
    with P = E* slope a.
    """
    return load / (math.pi * half_width) * np.arccosh(np.maximum(half_width / np.abs(x), 1))


@dataclass(frozen=True)
class Wavy:
    """Wavy obstacle on a classical half-plane, with its lowest points at 0, +-wavelength, ... (Westergaard,
    J. Appl. Mech. 6 (1939) A49; Johnson, Contact Mechanics, 13.2).

    `closure` is the mean pressure of full closure, pi E* amplitude/wavelength, and `mean` the mean pressure,
    above 0 (stresses).
    """

    closure: float
    wavelength: float
    mean: float

    @property
    def half_width(self) -> float:
        """a of ``mean = closure sin(pi a/wavelength)^2``; wavelength/2 from full closure on."""
        return self.wavelength / math.pi * math.asin(math.sqrt(min(self.mean / self.closure, 1.0)))

    @property
    def approach_over_amplitude(self) -> float:
        """Approach over the mean level: ``r (1 - log r)``, r = mean/closure; 1 from full closure on."""
        r = min(self.mean / self.closure, 1.0)
        return r * (1 - math.log(r))

    def pressure(self, x: ArrayLike) -> Array:
        """Returns p at x, array (n,): 2 mean/s_a^2 cos(pi x/wavelength) sqrt(s_a^2 - s^2), s = sin(pi
        x/wavelength).
        """
        phase = math.pi * np.asarray(x, float) / self.wavelength
        if self.mean >= self.closure:
            return self.mean + self.closure * np.cos(2 * phase)
        rest = self.mean / self.closure - np.sin(phase) ** 2
        return 2 * self.closure * np.abs(np.cos(phase)) * np.sqrt(np.maximum(rest, 0))


@dataclass(frozen=True)
class ThinLayer:
    """Winkler foundation: an elastic layer on a rigid base, thin against contact and block
    (docs/theory/model.md).

    `normal` is the stress per normal displacement, (lambda + 2 mu)/h on a bonded base, E/(1 - nu^2)/h on a
    sliding one with free sides; `rotational` the micromoment per microrotation (stress x length), gamma'
    ell^2 mu/h where psi is constrained on the base, else 0.
    """

    normal: float
    rotational: float
    ell: float

    def pressures(self, penetration: Array) -> Array:
        """Returns the corner pressures, array (corners, n), for psi0 = 0 in the levers, from approach minus
        initial gaps, an array like it (lengths).
        """
        depth = np.maximum(penetration, -1e100)  # where there is no obstacle
        if len(depth) == 1:
            return self.normal * np.maximum(depth, 0)
        rotational = self.ell**2 / 4 / self.rotational if self.rotational else math.inf
        compliances = np.array((1 / self.normal, rotational))[:, None]
        both = np.array((depth[0] + depth[1], depth[0] - depth[1])) / 2 / compliances  # p, 2 M/ell
        closed = np.array((both[0] + both[1], both[0] - both[1])) / 2
        alone = np.maximum(depth, 0) / (1 / self.normal + rotational)
        first = (alone[0] >= alone[1]) == np.array((True, False))[:, None]
        return np.where((closed >= 0).all(axis=0), closed, np.where(first, alone, 0))

    def approach(self, load: float, gaps: Array, weights: Array) -> float:
        """Returns the approach (length) at which pressures carry a load, from initial gaps, array (corners,
        n), and the weights of a quadrature rule (n,) (lengths).
        """
        from scipy.optimize import brentq  # here: half a second that pictures do without

        def lacking(approach: float) -> float:
            return load - float(weights @ self.pressures(approach - gaps).sum(axis=0))

        low = float(np.min(gaps))
        way = load / self.normal / np.sum(weights)
        while lacking(low + way) > 0:
            way *= 3
        return float(brentq(lacking, low, low + way, xtol=1e-300, rtol=1e-15))
