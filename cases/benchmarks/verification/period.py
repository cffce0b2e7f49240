"""A second code for frictionless contact on a half-plane with a period: equal cells, symbols of `space`, no
library.
"""

from __future__ import annotations

from math import pi

import numpy as np
from scipy.fft import irfft, rfft

from . import space


class Line:
    """Cells of a period with a corner ("unilateral", "microclamped") or two ("microblock", arms ell/2)."""

    def __init__(self, height, period, n, solid, law):
        E, nu, beta, self.ell = solid
        self.law, self.n, self.side = law, n, period / n
        self.x = (np.arange(n) + 0.5) * self.side
        self.arms = (-self.ell / 2, self.ell / 2) if law == "microblock" else (0.0,)
        self.height = np.array([height(self.x + arm) for arm in self.arms])
        self.kernel = self._kernel(E / 2 / (1 + nu), nu, beta, 2 * pi / period)

    def _kernel(self, mu, nu, beta, wave):
        """Normal displacement and rotation under pressure and moment; cells as 7 aliases of their edges."""
        total = np.zeros((2, 2, self.n // 2 + 1), complex)
        for alias in range(-3, 4):
            m = np.arange(self.n // 2 + 1) + alias * self.n
            k = np.maximum(abs(m), 1e-9) * wave * self.ell
            u, clamped, v, w, _ = space.symbols(nu, beta)(k)
            rotation = np.sign(m) * 1j * v
            u = (clamped if self.law == "microclamped" else u) * self.ell
            block = np.array([[u, -rotation], [rotation, w / self.ell]]) / mu * np.sinc(m / self.n)
            total += block * (m != 0)
        total[1, 1, 0] = space.symbols(nu, beta)(np.array([1e-6]))[3][0] / mu / self.ell
        return total

    def response(self, forces):
        moment = sum(arm * f for arm, f in zip(self.arms, forces))
        spectrum = rfft(np.array([forces.sum(0), moment]))
        w, psi = irfft(np.einsum("abk,bk->ak", self.kernel, spectrum), self.n)
        return np.array([w + arm * psi for arm in self.arms])

    def solve(self, load, tolerance=1e-9, limit=4000):
        """Pressures of the corners (corners, n) and the residual: Polonsky and Keer's conjugate gradients."""
        p = np.full_like(self.height, load / self.height.size / self.side)
        t, before, delta = np.zeros_like(p), 1.0, 0.0
        for _ in range(limit):
            gap = self.response(p) + self.height
            on = p > 0
            g = gap - gap[on].mean()
            deep = np.ptp(gap[on] - self.height[on]) + np.ptp(self.height) * 1e-9
            error = max(self.side * (p * abs(g)).sum() / load, -g[~on].min(initial=0.0)) / deep
            if error < tolerance:
                break
            square = (g[on] ** 2).sum()
            t = np.where(on, g + delta * square / before * t, 0.0)
            before = square
            image = self.response(t)
            image -= image[on].mean()
            tau = (g * t)[on].sum() / (image * t)[on].sum()
            p = np.where(on, np.maximum(p - tau * t, 0.0), 0.0)
            more = ~on & (g < 0)
            delta = 0.0 if more.any() else 1.0
            p[more] -= tau * g[more]
            p *= load / p.sum() / self.side
        return p, error
