"""The response of the surface to pressure, shear and moment, against the field equations by collocation."""

import numpy as np
import pytest

import microblock as mb
from microblock.halfplane import kernels

POINTS, DEPTH = 90, 25.0  # of collocation, and wavelengths over 2 pi: exp(-25) is rounding


def collocation(depth):
    """Derivative by depth at Chebyshev points of [-depth, 0], the surface first: array (n, n)."""
    n = np.arange(POINTS + 1)
    x = np.cos(np.pi * n / POINTS)
    signs = np.where((n == 0) | (n == POINTS), 2.0, 1.0) * (-1.0) ** n
    apart = x[:, None] - x + np.eye(len(n))
    D = np.outer(signs, 1 / signs) / apart
    return (D - np.diag(D.sum(axis=1))) * 2 / depth


def surface(solid, k, loads):
    """(u1, u2, psi) at the surface under sigma_12, sigma_22 and m_2 times exp(i k x1): the balances of
    forces and of moments at all points, with the stresses of the weak law.
    """
    D = collocation(DEPTH / k)
    one, none = np.eye(len(D)), np.zeros((len(D), len(D)))
    mu, mu_c, G = solid.mu, solid.mu_c, solid.curvature * solid.ell**2 * solid.mu
    lam, across = 2 * mu * solid.nu / (1 - 2 * solid.nu), 1j * k * one
    e11, e22 = np.array((across, none, none)), np.array((none, D, none))
    g12, g21 = np.array((D, none, one)), np.array((none, across, -one))
    s11, s22 = (lam + 2 * mu) * e11 + lam * e22, lam * e11 + (lam + 2 * mu) * e22
    s12, s21 = (mu + mu_c) * g12 + (mu - mu_c) * g21, (mu - mu_c) * g12 + (mu + mu_c) * g21
    m1, m2 = G * np.array((none, none, across)), G * np.array((none, none, D))

    def divergence(first, second):
        return 1j * k * first + np.array([D @ each for each in second])

    blocks = (divergence(s11, s12), divergence(s21, s22), divergence(m1, m2) - s12 + s21)
    system, right = np.vstack([np.hstack(rows) for rows in blocks]), np.zeros(3 * len(D), complex)
    for number, (traction, value) in enumerate(zip((s12, s22, m2), loads)):
        system[number * len(D)] = np.hstack([rows[0] for rows in traction])
        right[number * len(D)] = value
        bottom = number * len(D) + POINTS
        system[bottom] = np.arange(3 * len(D)) == bottom
    return np.linalg.solve(system, right)[:: len(D)]


@pytest.mark.parametrize(
    "nu, beta, ell, curvature", [(0.3, 1.0, 0.7, 2.0), (0.1, 0.4, 2.0, 1.0), (0.45, 1.7, 0.3, 3.0)]
)
def test_symbol_solves_the_field_equations(nu, beta, ell, curvature):
    """docs/theory/friction.md, "Surface with shear"; collocation leaves 1e-11 of the displacements."""
    solid, k = mb.Cosserat(E=2.6, nu=nu, ell=ell, beta=beta, curvature=curvature), 1.3
    U, V, W = kernels.symbol(solid, np.array([k]))[:, 0]
    Z = U - 1 / (2 * solid.mu * k)
    matrix = np.array(((U, -1j * Z, 1j * V), (1j * Z, U, -V), (-1j * V, -V, W)))
    assert np.all(np.linalg.eigvalsh(matrix) > 0)
    for number, (p, q, m) in enumerate(np.eye(3)):
        u1, u2, psi = surface(solid, k, (q, -p, m * ell / 2))
        assert np.array((-u2, u1, ell / 2 * psi)) == pytest.approx(matrix[:, number], abs=1e-10)
