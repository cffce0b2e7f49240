"""Closed forms of the strip and of a thin layer: nothing here knows of a mesh."""

import math
from dataclasses import dataclass

import numpy as np


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

    def __post_init__(self):
        self.k = math.sqrt(2 * self.beta / self.curvature) / self.ell  # inverse decay length of the layer
        self.L_psi, self.L_u = 1 / (self.k * math.tanh(self.k)), math.tanh(self.k) / self.k  # (49)
        self.oedometric = 2 * (1 - self.nu) / (1 - 2 * self.nu)  # (lambda + 2 mu)/mu
        bending = self.curvature * self.ell**2 * self.k * math.tanh(self.k)  # M over the rotation
        lever, size = self.ell / 2 * (1 - abs(self.psi0)), abs(self.psi0)
        compression = bending / (lever * self.oedometric)  # while one corner carries all, M = lever t_n, (45)
        self.delta_fc = size * (lever + compression)  # at which the second corner closes, (47)
        self.state = "partial"
        turned, strain = self.delta / (lever + compression), 0.0
        if self.delta <= 0:
            self.state, turned = "separation", 0.0
        elif self.delta >= self.delta_fc:
            self.state, turned, strain = "full", size, self.delta - lever * size
        self.rotation = math.copysign(turned, self.psi0)
        self.traction = -self.oedometric * (strain if self.state == "full" else turned * compression)
        self.micromoment = -bending * self.rotation

    def psi(self, x2):
        """Returns the microrotation (46) (radians) at x2, array (n,)."""
        even = np.exp(self.k * (x2 - 1)) + np.exp(-self.k * (x2 + 1))  # 2 cosh(k x2)/exp(k): no overflow
        return -self.rotation * even / (1 + math.exp(-2 * self.k))

    def u1(self, x2):
        """Returns the horizontal displacement (46) over H at x2, array (n,)."""
        odd = -np.exp(self.k * (x2 - 1)) * np.expm1(-2 * self.k * x2)  # 2 sinh(k x2)/exp(k): no cancellation
        return self.rotation * self.beta / self.k * odd / (1 + math.exp(-2 * self.k))

    def u2(self, x2):
        """Returns the vertical displacement (46) over H at x2, array (n,)."""
        return self.traction / self.oedometric * x2


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

    def pressures(self, depth):
        """Returns the pressures of both corners, array (2, n), for psi0 = 0 in the levers; `depth` is
        the approach minus initial gaps, an array like it (lengths).
        """
        rotational = self.ell**2 / 4 / self.rotational if self.rotational else math.inf
        compliances = np.array((1 / self.normal, rotational))[:, None]
        together = np.array((depth[0] + depth[1], depth[0] - depth[1])) / 2 / compliances  # p, 2 M/ell
        closed = np.array((together[0] + together[1], together[0] - together[1])) / 2
        alone = np.maximum(depth, 0) / (1 / self.normal + rotational)
        first = (alone[0] >= alone[1]) == np.array((True, False))[:, None]
        return np.where((closed >= 0).all(axis=0), closed, np.where(first, alone, 0))

    def approach(self, load, gaps, weights):
        """Returns the approach (length) at which pressures carry a load, from initial gaps, array (2, n),
        and the weights of a quadrature rule (n,) (lengths).
        """
        from scipy.optimize import brentq  # here: half a second that pictures do without

        def lacking(approach):
            return load - float(weights @ self.pressures(approach - gaps).sum(axis=0))

        low = float(np.min(gaps))
        way = load / self.normal / np.sum(weights)
        while lacking(low + way) > 0:
            way *= 3
        return float(brentq(lacking, low, low + way, xtol=1e-300, rtol=1e-15))
