"""Closed forms to check against. numpy only: nothing here knows of a mesh."""

import math
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Strip:
    """The strip between rigid planes, (44)-(49), for any curvature coefficient gamma'.

    Lengths over H, stresses over mu. The strip occupies -1 <= x2 <= 1; fields at depths 0 <= x2 <= 1.
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
    def k(self):
        """Inverse decay length of the layer, over 1/H."""
        return math.sqrt(2*self.beta/self.curvature)/self.ell

    @property
    def oedometric(self):
        """(lambda + 2 mu)/mu."""
        return 2*(1 - self.nu)/(1 - 2*self.nu)

    @property
    def _lever(self):
        return self.ell/2*(1 - abs(self.psi0))

    @property
    def _compression(self):
        """u2(1) over the rotation a while one corner carries all, from M = lever t_n, (45)."""
        micromoment = self.curvature*self.ell**2*self.k*math.tanh(self.k)
        return micromoment/(self._lever*self.oedometric)

    @property
    def delta_fc(self):
        """Approach at which the second corner closes, (47)."""
        return abs(self.psi0)*(self._lever + self._compression)

    @property
    def state(self):
        """"separation" (delta <= 0), "partial" or "full" (from delta_fc on)."""
        if self.delta <= 0:
            return "separation"
        return "full" if self.delta >= self.delta_fc else "partial"

    @property
    def rotation(self):
        """a = -psi(1), with the sign of psi0."""
        if self.state == "separation":
            return 0.0
        if self.state == "full":
            return self.psi0
        return math.copysign(self.delta/(self._lever + self._compression), self.psi0)

    def psi(self, x2):
        """Microrotation (46)."""
        return -self.rotation*self._even(x2)

    def u1(self, x2):
        """Horizontal displacement (46) over H."""
        return self.rotation*self.beta/self.k*self._odd(x2)

    def u2(self, x2):
        """Vertical displacement (46) over H."""
        return self.traction/self.oedometric*np.asarray(x2, float)

    @property
    def traction(self):
        """t_n = sigma_22 over mu."""
        if self.state == "separation":
            return 0.0
        if self.state == "full":
            return -self.oedometric*(self.delta - self._lever*abs(self.psi0))
        return -self.oedometric*abs(self.rotation)*self._compression

    @property
    def micromoment(self):
        """M = m_2 at x2 = 1 over mu H, with gamma' of (12)."""
        return -self.curvature*self.ell**2*self.k*math.tanh(self.k)*self.rotation

    @property
    def L_psi(self):
        """Layer length of psi over H, coth(k)/k, (49)."""
        return 1/(self.k*math.tanh(self.k))

    @property
    def L_u(self):
        """Layer length of u1 over H, tanh(k)/k, (49)."""
        return math.tanh(self.k)/self.k

    def _even(self, x2):
        """cosh(k x2)/cosh(k) without overflow."""
        x2 = np.asarray(x2, float)
        return (np.exp(self.k*(x2 - 1)) + np.exp(-self.k*(x2 + 1)))/(1 + math.exp(-2*self.k))

    def _odd(self, x2):
        """sinh(k x2)/cosh(k) without overflow or cancellation."""
        x2 = np.asarray(x2, float)
        return -np.exp(self.k*(x2 - 1))*np.expm1(-2*self.k*x2)/(1 + math.exp(-2*self.k))


def hertz(x, load, half_width):
    """Pressure of a cylinder on a classical half-plane: ellipse of the half-width a = sqrt(4 P R/(pi E*)), (50)."""
    return 2*load/(math.pi*half_width)*np.sqrt(np.maximum(1 - (np.asarray(x, float)/half_width)**2, 0))


def punch(x, load, half_width):
    """Pressure of a flat punch on a classical half-plane at |x| < a: P/(pi sqrt(a^2 - x^2)), 0 outside."""
    inside = half_width**2 - np.asarray(x, float)**2
    return np.where(inside > 0, load/(math.pi*np.sqrt(np.where(inside > 0, inside, 1))), 0)


def wedge(x, load, half_width):
    """Pressure of a blunt wedge on a classical half-plane at x != 0: P/(pi a) arccosh(a/|x|), with P = E* slope a."""
    return load/(math.pi*half_width)*np.arccosh(np.maximum(half_width/np.abs(x), 1))


@dataclass(frozen=True)
class Wavy:
    """Wavy obstacle on a classical half-plane (Westergaard, J. Appl. Mech. 6 (1939) A49; Johnson, Contact Mechanics, 13.2).

    Lowest points at 0, +-wavelength, ...; `closure` = pi E* amplitude/wavelength is the mean pressure of full closure.

    Parameters
    ----------
    closure, wavelength : float
    mean : float, mean pressure > 0
    """

    closure: float
    wavelength: float
    mean: float

    @property
    def half_width(self):
        """a of ``mean = closure sin(pi a/wavelength)^2``; wavelength/2 from full closure on."""
        return self.wavelength/math.pi*math.asin(math.sqrt(min(self.mean/self.closure, 1.0)))

    def pressure(self, x):
        """p(x); with s = sin(pi x/wavelength), s_a at the edge: 2 mean/s_a^2 cos(pi x/wavelength) sqrt(s_a^2 - s^2)."""
        phase = math.pi*np.asarray(x, float)/self.wavelength
        if self.mean >= self.closure:
            return self.mean + self.closure*np.cos(2*phase)
        rest = self.mean/self.closure - np.sin(phase)**2
        return 2*self.closure*np.abs(np.cos(phase))*np.sqrt(np.maximum(rest, 0))


@dataclass(frozen=True)
class ThinLayer:
    """Mattress of springs: an elastic layer on a rigid base, thin against contact and block (docs/theory.md, "Thin layers").

    Parameters
    ----------
    normal : float, stress per sinking: (lambda + 2 mu)/h on a bonded base, E/(1 - nu^2)/h on a sliding one with free sides
    rotational : float, micromoment per microrotation: gamma' ell^2 mu/h where the base holds psi, 0 where it does not
    ell : float, side of a microblock
    """

    normal: float
    rotational: float
    ell: float

    def pressures(self, sunk):
        """Corner pressures, array (corners, n), psi0 = 0 in the levers.

        Parameters
        ----------
        sunk : array (corners, n), approach minus initial gap of each corner; one corner or (A, B)
        """
        sunk = np.maximum(sunk, -1e100)      # where there is no obstacle
        if len(sunk) == 1:
            return self.normal*np.maximum(sunk, 0)
        turning = self.ell**2/4/self.rotational if self.rotational else math.inf
        both = np.array((sunk[0] + sunk[1], sunk[0] - sunk[1]))/2/np.array((1/self.normal, turning))[:, None]      # p, 2 M/ell
        closed = np.array((both[0] + both[1], both[0] - both[1]))/2
        alone = np.maximum(sunk, 0)/(1/self.normal + turning)
        first = (alone[0] >= alone[1]) == np.array((True, False))[:, None]
        return np.where((closed >= 0).all(axis=0), closed, np.where(first, alone, 0))

    def approach(self, load, gaps, weights):
        """Approach at which pressures over initial gaps, array (corners, n), carry the load in a quadrature rule; bisection."""
        low = high = np.min(gaps)
        while weights @ self.pressures(high - gaps).sum(axis=0) < load:
            high += 2*(high - low) or load/self.normal/np.sum(weights)
        for _ in range(100):
            middle = (low + high)/2
            enough = weights @ self.pressures(middle - gaps).sum(axis=0) >= load
            low, high = (low, middle) if enough else (middle, high)
        return high
