"""Closed forms to check against. numpy only: nothing here knows of a mesh."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from .types import Array, Interval

StripState: TypeAlias = Literal["separation", "partial", "full"]


@dataclass(frozen=True)
class Strip:
    """The strip between rigid planes, (44)-(49), for any curvature coefficient gamma'.

    Lengths are over H, stresses over mu. The strip occupies -1 <= x2 <= 1; fields are those at 0 <= x2 <= 1.
    With ``k = sqrt(2 beta/gamma')/ell`` (sqrt(beta)/ell in the paper, where gamma' = 2) the fields are
    ``psi = -a cosh(k x2)/cosh(k)``, ``u1 = a (beta/k) sinh(k x2)/cosh(k)`` and u2 linear; `a` is the
    rotation of the surface blocks back towards the plane. ``psi0 < 0`` is the mirror image.

    Parameters
    ----------
    ell, psi0, nu, beta, delta : float
        ell/H, initial rotation (radians), Poisson's ratio, coupling, approach over H from first touch.
    curvature : float
        gamma'; 2 is the paper's closed form as printed.
    """

    ell: float
    psi0: float
    nu: float
    beta: float
    delta: float
    curvature: float = 2.0

    @property
    def k(self) -> float:
        """Inverse decay length of the layer, over 1/H."""
        return math.sqrt(2 * self.beta / self.curvature) / self.ell

    @property
    def oedometric(self) -> float:
        """(lambda + 2 mu)/mu."""
        return 2 * (1 - self.nu) / (1 - 2 * self.nu)

    @property
    def _lever(self) -> float:
        return self.ell / 2 * (1 - abs(self.psi0))

    @property
    def _compression(self) -> float:
        """u2(1) over the rotation a while one corner carries all, from M = lever t_n, (45)."""
        micromoment = self.curvature * self.ell**2 * self.k * math.tanh(self.k)
        return micromoment / (self._lever * self.oedometric)

    @property
    def delta_fc(self) -> float:
        """Approach at which the second corner closes, (47)."""
        return abs(self.psi0) * (self._lever + self._compression)

    @property
    def state(self) -> StripState:
        """ "separation" (delta <= 0), "partial" or "full" (from delta_fc on)."""
        if self.delta <= 0:
            return "separation"
        return "full" if self.delta >= self.delta_fc else "partial"

    @property
    def rotation(self) -> float:
        """a = -psi(1), with the sign of psi0."""
        if self.state == "separation":
            return 0.0
        if self.state == "full":
            return self.psi0
        return math.copysign(self.delta / (self._lever + self._compression), self.psi0)

    def psi(self, x2: ArrayLike) -> Array:
        """Returns the microrotation (46) (radians) at x2, array (n,)."""
        return -self.rotation * self._even(x2)

    def u1(self, x2: ArrayLike) -> Array:
        """Returns the horizontal displacement (46) over H at x2, array (n,)."""
        return self.rotation * self.beta / self.k * self._odd(x2)

    def u2(self, x2: ArrayLike) -> Array:
        """Returns the vertical displacement (46) over H at x2, array (n,)."""
        return self.traction / self.oedometric * np.asarray(x2, float)

    @property
    def traction(self) -> float:
        """t_n = sigma_22 over mu."""
        if self.state == "separation":
            return 0.0
        if self.state == "full":
            return -self.oedometric * (self.delta - self._lever * abs(self.psi0))
        return -self.oedometric * abs(self.rotation) * self._compression

    @property
    def micromoment(self) -> float:
        """M = m_2 at x2 = 1 over mu H, with gamma' of (12)."""
        return -self.curvature * self.ell**2 * self.k * math.tanh(self.k) * self.rotation

    @property
    def L_psi(self) -> float:
        """Layer length of psi over H, coth(k)/k, (49)."""
        return 1 / (self.k * math.tanh(self.k))

    @property
    def L_u(self) -> float:
        """Layer length of u1 over H, tanh(k)/k, (49)."""
        return math.tanh(self.k) / self.k

    def _even(self, x2: ArrayLike) -> Array:
        """Returns cosh(k x2)/cosh(k) without overflow."""
        x2 = np.asarray(x2, float)
        return (np.exp(self.k * (x2 - 1)) + np.exp(-self.k * (x2 + 1))) / (1 + math.exp(-2 * self.k))

    def _odd(self, x2: ArrayLike) -> Array:
        """Returns sinh(k x2)/cosh(k) without overflow or cancellation."""
        x2 = np.asarray(x2, float)
        return -np.exp(self.k * (x2 - 1)) * np.expm1(-2 * self.k * x2) / (1 + math.exp(-2 * self.k))


def hertz(x: ArrayLike, load: float, half_width: float) -> Array:
    """Returns the pressure of a cylinder on a classical half-plane, (50).

    It is an ellipse of the half-width a = sqrt(4 P R/(pi E*)).

    Parameters
    ----------
    x : array (n,)
        Abscissae (lengths).
    load : float
        Force per thickness.
    half_width : float
        a (length).

    Returns
    -------
    array (n,)
        Stresses.
    """
    rest = np.maximum(1 - (np.asarray(x, float) / half_width) ** 2, 0)
    return 2 * load / (math.pi * half_width) * np.sqrt(rest)


def punch(x: ArrayLike, load: float, half_width: float) -> Array:
    """Returns the pressure of a flat punch on a classical half-plane: P/(pi sqrt(a^2 - x^2)), 0 outside.

    Parameters and returned values are those of `hertz`; a is half of the punch's width.
    """
    inside = half_width**2 - np.asarray(x, float) ** 2
    return np.where(inside > 0, load / (math.pi * np.sqrt(np.where(inside > 0, inside, 1))), 0)


def tilted_punch(
    x: ArrayLike, load: float, half_width: float, tilt: float, E_star: float
) -> tuple[Array, Interval]:
    """Returns the pressure of a punch |x| < b rotated by `tilt` on a classical half-plane, and its contact.

    From the deeper edge of the punch on the contact extends over ``4 P/(pi E* |tilt|)``, with the pressure
    ``E* |tilt|/2 sqrt(r/s)``, r from the free edge of the contact, s from the edge of the punch; where that
    width exceeds 2 b the pressure is ``(P/pi - E* tilt x/2)/sqrt(b^2 - x^2)``. Both follow from ``pv int
    p(s)/(x - s) ds = pi E* tilt/2`` (Muskhelishvili, Some basic problems, 115).

    Parameters
    ----------
    x : array (n,)
        Abscissae (lengths).
    load : float
        Force per thickness.
    half_width : float
        b (length).
    tilt : float
        Slope of the punch (dimensionless).
    E_star : float
        Plane-strain contact modulus (stress).

    Returns
    -------
    pressure : array (n,)
        Stresses.
    contact : (left, right)
        Edges of the contact (lengths).
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
    """Returns the pressure of a blunt wedge on a classical half-plane: P/(pi a) arccosh(a/|x|), with P = E*
    slope a.

    Parameters and returned values are those of `hertz`, at x != 0.
    """
    return load / (math.pi * half_width) * np.arccosh(np.maximum(half_width / np.abs(x), 1))


@dataclass(frozen=True)
class Wavy:
    """Wavy obstacle on a classical half-plane, with its lowest points at 0, +-wavelength, ...

    Westergaard, J. Appl. Mech. 6 (1939) A49; Johnson, Contact Mechanics, 13.2.

    Parameters
    ----------
    closure : float
        Mean pressure of full closure, pi E* amplitude/wavelength (stress).
    wavelength : float
        Distance of two crests (length).
    mean : float
        Mean pressure, above 0 (stress).
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
        """Approach over the mean level: ``r (1 - log r)``, r = mean/closure; 1 from full closure on.

        Each increment of the load is a flat punch on the arc in contact, whose normal displacement is
        ``-2/(pi E*) log(s_a)`` times the increment.
        """
        r = min(self.mean / self.closure, 1.0)
        return r * (1 - math.log(r))

    def pressure(self, x: ArrayLike) -> Array:
        """Returns p at x, array (n,); with s = sin(pi x/wavelength), s_a at the edge: 2 mean/s_a^2 cos(pi
        x/wavelength) sqrt(s_a^2 - s^2).
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

    Parameters
    ----------
    normal : float
        Stress per normal displacement: (lambda + 2 mu)/h on a bonded base, E/(1 - nu^2)/h on a sliding one
        with free sides.
    rotational : float
        Micromoment per microrotation (stress x length): gamma' ell^2 mu/h where psi is constrained on the
        base, 0 where it is free.
    ell : float
        Side of a microblock (length).
    """

    normal: float
    rotational: float
    ell: float

    def pressures(self, penetration: Array) -> Array:
        """Returns the corner pressures, array (corners, n), for psi0 = 0 in the levers.

        Parameters
        ----------
        penetration : array (corners, n)
            Approach minus initial gap of each corner, of one corner or of (A, B) (lengths).

        Returns
        -------
        array (corners, n)
            Stresses.
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
        """Returns the approach (length) at which the pressures carry a load, by bisection.

        Parameters
        ----------
        load : float
            Force per thickness.
        gaps : array (corners, n)
            Initial gaps (lengths).
        weights : array (n,)
            Weights of a quadrature rule (lengths).
        """
        low = high = np.min(gaps)
        while weights @ self.pressures(high - gaps).sum(axis=0) < load:
            high += 2 * (high - low) or load / self.normal / np.sum(weights)
        for _ in range(100):
            middle = (low + high) / 2
            enough = weights @ self.pressures(middle - gaps).sum(axis=0) >= load
            low, high = (low, middle) if enough else (middle, high)
        return high
