"""Closed forms to check against. numpy only: nothing here knows of a mesh."""

import math
from dataclasses import dataclass

import numpy as np


class _Layered:
    """What strips have in common, from their ell, nu, beta and curvature."""

    @property
    def k(self):
        """Inverse decay length of the layer, over 1/H."""
        return math.sqrt(2*self.beta/self.curvature)/self.ell

    @property
    def oedometric(self):
        """(lambda + 2 mu)/mu."""
        return 2*(1 - self.nu)/(1 - 2*self.nu)


@dataclass(frozen=True)
class Strip(_Layered):
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


@dataclass(frozen=True)
class TwoFacedStrip(_Layered):
    """The strip between rigid planes with blocks turned differently on its two faces (docs/theory.md, "Two faces").

    Lengths over half the thickness H, stresses over mu; the strip occupies -1 <= x2 <= 1. Equal turns give `Strip`. With
    `upper` and `lower` the faces, C = gamma' ell^2 k coth(2 k), S = gamma' ell^2 k/sinh(2 k), micromoments and surface values
    of psi obey ``M_u = C psi_u - S psi_l``, ``M_l = C psi_l - S psi_u``.

    Parameters
    ----------
    ell, nu, beta : float
    upper, lower : float, initial rotations psi0 (radians)
    delta : float, what each plane approaches from the first touch of both; only the sum counts
    curvature : float, gamma'
    """

    ell: float
    upper: float
    lower: float
    nu: float
    beta: float
    delta: float
    curvature: float = 2.0

    @property
    def _stiffness(self):
        """C, S over mu H, without overflow."""
        size = self.curvature*self.ell**2*self.k
        return size/math.tanh(2*self.k), -2*size*math.exp(-2*self.k)/math.expm1(-4*self.k)

    @property
    def _faces(self):
        """[(lever, |psi0|)] and the product of the signs of psi0."""
        turns = (self.upper, self.lower)
        same = math.copysign(1, self.upper)*math.copysign(1, self.lower)
        return [(self.ell/2*(1 - abs(turn)), abs(turn)) for turn in turns], same

    @property
    def closings(self):
        """Pressures at which the second corners of (upper, lower) close."""
        ((L, turn), (M, other)), same = self._faces
        C, S = self._stiffness
        size = self.curvature**2*self.ell**4*self.k**2      # C^2 - S^2
        alone = [_over(one*size, C*lever + same*S*far) for one, lever, far in ((turn, L, M), (other, M, L))]
        if alone[0] <= alone[1]:
            return alone[0], max(alone[0], (C*other - same*S*turn)/M)
        return max(alone[1], (C*turn - same*S*other)/L), alone[1]

    def rotations(self, pressure):
        """How far the blocks of (upper, lower) have turned back towards their planes, up to |psi0|."""
        ((L, turn), (M, other)), same = self._faces
        C, S = self._stiffness
        closed = [pressure >= load for load in self.closings]
        if all(closed):
            return turn, other
        if closed[0]:
            return turn, (M*pressure + same*S*turn)/C
        if closed[1]:
            return (L*pressure + same*S*other)/C, other
        size = self.curvature**2*self.ell**4*self.k**2
        return (C*L + same*S*M)*pressure/size, (C*M + same*S*L)*pressure/size

    def _approach(self, pressure):
        """delta at a pressure: half of what the strip is squeezed and its blocks lean back."""
        levers = [lever for lever, _ in self._faces[0]]
        return pressure/self.oedometric + sum(lever*turned for lever, turned in zip(levers, self.rotations(pressure)))/2

    @property
    def delta_fc(self):
        """delta at which the second corners of (upper, lower) close."""
        return tuple(self._approach(load) for load in self.closings)

    @property
    def states(self):
        """"separation", "partial" or "full" of (upper, lower)."""
        if self.delta <= 0:
            return "separation", "separation"
        return tuple("full" if self.delta >= event else "partial" for event in self.delta_fc)

    @property
    def pressure(self):
        """-sigma_22: piecewise linear in delta, with a kink at each closing."""
        if self.delta <= 0:
            return 0.0
        loads = [0.0, *sorted(self.closings)]
        first = max(load for load in loads if self._approach(load) <= self.delta)
        beyond = [load for load in loads if load > first]
        second = beyond[0] if beyond else first + self.oedometric*self.delta
        low, high = self._approach(first), self._approach(second)
        return first + (self.delta - low)/(high - low)*(second - first)

    @property
    def surface(self):
        """psi of (upper, lower)."""
        turns = zip((self.upper, self.lower), self.rotations(self.pressure))
        return tuple(-math.copysign(1, psi0)*turned for psi0, turned in turns)

    @property
    def micromoments(self):
        """M = n.m of (upper, lower)."""
        C, S = self._stiffness
        upper, lower = self.surface
        return C*upper - S*lower, C*lower - S*upper

    def psi(self, x2):
        """Microrotation."""
        upper, lower = self.surface
        x2 = np.asarray(x2, float)
        return upper*self._rise(x2, 1) + lower*self._rise(-x2, 1)

    def u1(self, x2):
        """Horizontal displacement; 0 at the lower face."""
        upper, lower = self.surface
        x2 = np.asarray(x2, float)
        at_bottom = upper*self._rise(-1.0, -1) - lower*self._rise(1.0, -1)
        return -self.beta/self.k*(upper*self._rise(x2, -1) - lower*self._rise(-x2, -1) - at_bottom)

    def u2(self, x2):
        """Vertical displacement; 0 at the lower face."""
        return -self.pressure/self.oedometric*(np.asarray(x2, float) + 1)

    def _rise(self, x2, sign):
        """sinh(k (1 + x2))/sinh(2 k) (sign 1) or cosh(k (1 + x2))/sinh(2 k) (sign -1)."""
        return (np.exp(self.k*(x2 - 1)) - sign*np.exp(-self.k*(x2 + 3)))/-math.expm1(-4*self.k)


def _over(size, slope):
    """The load at which what grows with this slope has the size; never if it does not grow."""
    return 0.0 if size == 0 else size/slope if slope > 0 else math.inf


def hertz(x, load, half_width):
    """Pressure of a cylinder on a classical half-plane: ellipse of the half-width a = sqrt(4 P R/(pi E*)), (50)."""
    return 2*load/(math.pi*half_width)*np.sqrt(np.maximum(1 - (np.asarray(x, float)/half_width)**2, 0))


def punch(x, load, half_width):
    """Pressure of a flat punch on a classical half-plane at |x| < a: P/(pi sqrt(a^2 - x^2)), 0 outside."""
    inside = half_width**2 - np.asarray(x, float)**2
    return np.where(inside > 0, load/(math.pi*np.sqrt(np.where(inside > 0, inside, 1))), 0)


def tilted_punch(x, load, half_width, tilt, E_star):
    """Pressure of a punch |x| < b turned by `tilt` on a classical half-plane, and the edges (left, right) of its contact.

    From the deeper end on it presses up to the distance ``4 P/(pi E* |tilt|)``, there like ``E* |tilt|/2 sqrt(r/s)``, r from
    the free edge, s from the end; where that exceeds 2 b like ``(P/pi - E* tilt x/2)/sqrt(b^2 - x^2)``. Both follow from
    ``pv int p(s)/(x - s) ds = pi E* tilt/2`` (Muskhelishvili, Some basic problems, 115).
    """
    x, b = np.asarray(x, float), half_width
    if load >= math.pi/2*E_star*abs(tilt)*b:
        inside = b**2 - x**2
        return np.where(inside > 0, (load/math.pi - E_star*tilt*x/2)/np.sqrt(np.where(inside > 0, inside, 1)), 0), (-b, b)
    sign, width = math.copysign(1, tilt), 4*load/(math.pi*E_star*abs(tilt))
    s = b + sign*x      # from the deeper end, which is the left one for tilt > 0
    inside = (s > 0) & (s < width)
    pressure = np.where(inside, E_star*abs(tilt)/2*np.sqrt(np.where(inside, width - s, 0)/np.where(inside, s, 1)), 0)
    return pressure, tuple(sorted((-sign*b, sign*(width - b))))


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

    @property
    def approach_over_amplitude(self):
        """Approach over the mean level: ``r (1 - log r)``, r = mean/closure; 1 from full closure on.

        Each increment of the load is a flat punch on the arc in contact, which sinks by ``-2/(pi E*) log(s_a)`` of it.
        """
        r = min(self.mean/self.closure, 1.0)
        return r*(1 - math.log(r))

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
