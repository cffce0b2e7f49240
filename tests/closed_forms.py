"""Closed forms of classical contact on a line, to check against: nothing here knows of a mesh."""

import math
from dataclasses import dataclass

import numpy as np


def hertz(x, load, half_width):
    """Returns the pressure of a cylinder on a classical half-plane, (50)."""
    below_ellipse = np.maximum(1 - (np.asarray(x, float) / half_width) ** 2, 0)
    return 2 * load / (math.pi * half_width) * np.sqrt(below_ellipse)


def punch(x, load, half_width):
    """Returns the pressure of a flat punch of that half-width on a classical half-plane: P/(pi sqrt(a^2 -
    x^2)), 0 outside.
    """
    inside = half_width**2 - x**2
    return np.where(inside > 0, load / (math.pi * np.sqrt(np.where(inside > 0, inside, 1))), 0)


def tilted_punch(x, load, half_width, tilt, E_star):
    """Returns the pressure at x, array (n,), of a punch |x| < b of the slope `tilt` on a classical
    half-plane, and its contact (left, right).

    From the deeper edge of the punch on the contact extends over ``4 P/(pi E* |tilt|)``, with the pressure
    ``E* |tilt|/2 sqrt(r/s)``, r from the free edge of the contact, s from the edge of the punch; where that
    width exceeds 2 b the pressure is ``(P/pi - E* tilt x/2)/sqrt(b^2 - x^2)`` (Muskhelishvili, Some basic
    problems, 115).
    """
    b = half_width
    if load >= math.pi / 2 * E_star * abs(tilt) * b:
        square = b**2 - x**2
        pressure = (load / math.pi - E_star * tilt * x / 2) / np.sqrt(np.where(square > 0, square, 1))
        return np.where(square > 0, pressure, 0), (-b, b)
    sign = math.copysign(1, tilt)
    width = 4 * load / (math.pi * E_star * abs(tilt))
    s = b + sign * x  # from the deeper edge, which is the left one for tilt > 0
    inside = (s > 0) & (s < width)
    pressure = E_star * abs(tilt) / 2 * np.sqrt(np.where(inside, width - s, 0) / np.where(inside, s, 1))
    left, right = sorted((-sign * b, sign * (width - b)))
    return np.where(inside, pressure, 0), (left, right)


def wedge(x, load, half_width):
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
    def half_width(self):
        """a of ``mean = closure sin(pi a/wavelength)^2``; wavelength/2 from full closure on."""
        return self.wavelength / math.pi * math.asin(math.sqrt(min(self.mean / self.closure, 1.0)))

    @property
    def approach_over_amplitude(self):
        """Approach over the mean level: ``r (1 - log r)``, r = mean/closure; 1 from full closure on."""
        r = min(self.mean / self.closure, 1.0)
        return r * (1 - math.log(r))

    def pressure(self, x):
        """Returns p at x, array (n,): 2 mean/s_a^2 cos(pi x/wavelength) sqrt(s_a^2 - s^2), s = sin(pi
        x/wavelength).
        """
        phase = math.pi * x / self.wavelength
        if self.mean >= self.closure:
            return self.mean + self.closure * np.cos(2 * phase)
        inside = self.mean / self.closure - np.sin(phase) ** 2
        return 2 * self.closure * np.abs(np.cos(phase)) * np.sqrt(np.maximum(inside, 0))


def stress(solid, gradient, psi):
    """Returns the force stress (16) in plane strain, rows ((s11, s12), (s21, s22)), of the displacement
    gradient {(i, j)} or (2, 2, ...) and the microrotation; sigma_12 works on gamma_12 = u1,2 + psi.
    """
    (u11, u12), (u21, u22) = ((gradient[i, 0], gradient[i, 1]) for i in (0, 1))
    pressure, shear = solid.lam * (u11 + u22), solid.mu * (u12 + u21)
    skew = 2 * solid.mu_c * ((u12 - u21) / 2 + psi)
    return (pressure + 2 * solid.mu * u11, shear + skew), (shear - skew, pressure + 2 * solid.mu * u22)


def couple_stress(solid, kappa):
    """Returns the couple stress m = gamma' ell^2 mu grad psi, (17), of the gradient of psi."""
    stiffness = solid.curvature * solid.ell**2 * solid.mu
    return stiffness * kappa[0], stiffness * kappa[1]
