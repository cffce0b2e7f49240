"""A second code for frictionless contact on a half-plane with a period, on a row of equal cells; nothing of
the library. Projected conjugate gradients of Polonsky and Keer on the forces of all corners at the load.
"""

from math import pi

import numpy as np

from .kernels import symbols

CURVATURE = 2.0  # gamma' of (12)

ALIASES = 3  # on either side, of the cells' edges
TOLERANCE = 1e-9  # of complementarity, over load and displacement


def compliance(k, nu, beta, law):
    """Displacement w = -u3, and psi of "microblock", under p and M of waves k (n,): array (a, a, n), a = 1 or
    2.
    """
    of_wave = symbols(nu, beta, CURVATURE, np.maximum(abs(k), 1e-6))
    U, V, W, clamped, _ = (1 - nu) * np.array([*of_wave.values()])
    if law == "microblock":
        return np.array([[U, -2j * V * np.sign(k)], [2j * V * np.sign(k), 4 * W]])
    return np.array([[clamped if law == "microclamped" else U]])


class Row:
    """Cells of a period without a mean displacement, in units mu = ell = 1."""

    def __init__(self, period, n, nu, beta, law):
        self.n = n
        self.side = period / n
        self.x = (np.arange(n) + 0.5) * self.side
        self.arms = np.array([-0.5, 0.5]) if law == "microblock" else np.zeros(1)
        waves = np.fft.rfftfreq(n, 1 / n)
        self.kernel = sum(
            compliance(2 * pi / period * (waves + alias * n), nu, beta, law) * np.sinc(waves / n + alias)
            for alias in range(-ALIASES, ALIASES + 1)
        )
        mean = compliance(np.zeros(1), nu, beta, law)[:, :, 0]
        mean[0, 0] = 0
        self.kernel[:, :, 0] = mean  # a uniform moment rotates all blocks alike

    def displacement(self, forces):
        """Displacements of the corners into the body under their pressures (corners, n)."""
        arms = self.arms[:, None]
        moments = [(arms * forces).sum(0)] if len(forces) == 2 else []
        spectrum = np.fft.rfft([forces.sum(0), *moments])
        fields = np.fft.irfft(np.einsum("abi,bi->ai", self.kernel, spectrum), self.n)
        return fields[0] + arms * fields[-1]


def gradients(row, heights, load):
    """Pressures (corners, n) that carry the load under these heights (corners, n)."""
    low = heights.min()
    reach = np.sort(heights.ravel())[min(heights.size - 1, max(8, heights.size // 8))] - low
    p = np.sqrt(np.maximum(reach - (heights - low), 0)) + (heights <= low)
    p *= load / (row.side * p.sum())
    direction = np.zeros_like(p)
    before = 1.0
    restart = True
    for _ in range(4000):
        displacement = row.displacement(p)
        closed = p > 0
        gaps = displacement + heights
        gaps -= gaps[closed].mean()
        deepest = max(np.abs(displacement[closed]).max(), 1e-300)
        error = row.side * np.sum(p * np.abs(gaps)) / load / deepest
        if error < TOLERANCE and -gaps[~closed].min(initial=0.0) < 30 * TOLERANCE * deepest:
            break
        square = np.sum(gaps[closed] ** 2)
        conjugate = 0.0 if restart else square / before
        direction = np.where(closed, gaps + conjugate * direction, 0.0)
        before = square
        image = row.displacement(direction)
        image -= image[closed].mean()
        step = np.sum(gaps * direction) / np.sum(image * direction)
        p = np.where(closed, np.maximum(p - step * direction, 0.0), p)
        overlapping = (p == 0) & (gaps < 0)
        restart = overlapping.any()
        p[overlapping] -= step * gaps[overlapping]
        p *= load / (row.side * p.sum())
    return p


def pressures(height, period, n, solid, law, load):
    """Places x (n,), and the pressures there: (1, n), or (2, n) of "microblock", whose arms are ell/2."""
    E, nu, beta, ell = solid
    mu = E / 2 / (1 + nu)
    row = Row(period / ell, n, nu, beta, law)
    heights = height(ell * (row.x + row.arms[:, None])) / ell
    return ell * row.x, mu * gradients(row, heights, load / mu / ell)
