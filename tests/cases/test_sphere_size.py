"""The case sphere_size: against an axisymmetric solver of another kind, itself tested, and both its ends."""

import json
from functools import cache

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import gamma, hyp2f1, j0, jv

from cases.__main__ import main
from cases.scenes import sphere, sphere_size
from microblock.halfplane.kernels import clamped, short_waves, symbol

TERMS = 10  # of the pressure


class Radial:
    """A sphere on a half-space by the Hankel transform, without cells: p = sum c_n (1 - (r/a)^2)^(n + 1/2).

    Each term has closed forms of its transform, and of its displacement under a response C/k. What is left of
    U(k) beside C/k for short waves falls like k^-3 and is integrated by Gauss points. There is no term that
    is infinite at the rim, so that the approach belongs to the radius.
    """

    def __init__(self, solid, hold):
        self.solid, self.hold, self.short = solid, hold, short_waves(solid)[0]
        panels = np.concatenate(([0, 1e-3, 1e-2, 0.1], np.arange(0.5, 600, 1.5)))
        points, weights = np.polynomial.legendre.leggauss(12)
        widths = np.diff(panels)[:, None]
        self.k = (panels[:-1, None] + widths * (points + 1) / 2).ravel()  # times a
        self.dk = (widths * weights / 2).ravel()
        self.rho = np.sin(np.pi / 2 * (np.arange(3 * TERMS) + 0.5) / (3 * TERMS))
        mu = np.arange(TERMS) + 0.5
        self.size = 2**mu * gamma(mu + 1)
        self.transforms = self.size[:, None] * np.array([jv(m + 1, self.k) / self.k ** (m + 1) for m in mu])
        own = np.sqrt(np.pi) / (2 ** (mu + 1) * gamma(mu + 1.5))
        self.closed = (
            np.array([hyp2f1(0.5, -m - 0.5, 1, self.rho**2) for m in mu]) * (self.size * own)[:, None]
        )

    def response(self, k):
        U, V, W = symbol(self.solid, k)
        return clamped(U, V, W) if self.hold else U

    def of_radius(self, a, R):
        """(load, approach, pressures c_n) of a contact of radius a, least squares in the displacement."""
        left = self.response(self.k / a) - self.short * a / self.k
        waves = j0(np.outer(self.rho, self.k)) * (left * self.k * self.dk)
        u = self.short * a * self.closed.T + waves @ self.transforms.T
        system = np.hstack((u, -np.ones((len(self.rho), 1))))
        found, *_ = np.linalg.lstsq(system, -((a * self.rho) ** 2) / (2 * R), rcond=None)
        c, d = found[:-1], found[-1]
        assert np.abs(system @ found + (a * self.rho) ** 2 / (2 * R)).max() < 1e-4 * a**2 / R
        load = 2 * np.pi * a**2 * np.sum(c / (2 * np.arange(TERMS) + 3))
        return load, d, c

    def of_load(self, load, R):
        """(radius, approach)."""
        a = brentq(lambda a: self.of_radius(a, R)[0] / load - 1, 0.3, 1.5, xtol=1e-12)
        return a, self.of_radius(a, R)[1]


@cache
def radial(alpha, contact):
    """Radius and approach in the case's units."""
    parameters = sphere.Parameters(alpha=alpha, contact=contact)
    a, d = Radial(parameters.solid(), contact == "microclamped").of_load(1.0, 1.0)
    return {"radius": a / parameters.a_Hz, "approach": d / parameters.a_Hz**2}


def test_the_radial_solver_is_hertz_at_both_ends():
    small, large = (radial(alpha, "unilateral") for alpha in (1e-4, 1e3))
    # ell/a_Hz is left
    assert small == pytest.approx({"radius": 1.0, "approach": 1.0}, rel=1e-3)
    end = sphere_size.reference(sphere_size.Parameters(), "unilateral")
    assert large == pytest.approx({name: end[name] for name in large}, rel=1e-2)


def test_the_radial_solver_keeps_its_own_energy():
    """dE/da = P dd/da: load and approach come from different parts of it."""
    solver = Radial(sphere.Parameters(alpha=0.5).solid(), False)
    radii = np.linspace(0.75, 0.85, 5)
    found = [solver.of_radius(a, 1.0) for a in radii]
    n = np.arange(TERMS)
    energies = [
        # half of the integral of p (d - r^2/2): moments of (1 - rho^2)^(n + 1/2) and of rho^2 with it
        np.pi * a**2 * np.sum(c * (d / (2 * n + 3) - a**2 / ((2 * n + 3) * (2 * n + 5))))
        for a, (_, d, c) in zip(radii, found)
    ]
    work = [load * d for load, d, _ in found]
    slope_energy, slope_approach = (
        np.polynomial.Polynomial.fit(radii, values, 4).deriv()(0.8)
        for values in (energies, [d for _, d, _ in found])
    )
    assert slope_energy == pytest.approx(found[2][0] * slope_approach, rel=1e-6) and np.all(np.diff(work) > 0)


@pytest.mark.parametrize("contact", ["unilateral", "microclamped"])
@pytest.mark.parametrize("alpha", [0.2, 1.0, 4.0])
def test_cells_agree_with_the_radial_solver(alpha, contact):
    found = sphere_size.solve(sphere_size.Parameters(), alpha, contact)
    for name, exact in radial(alpha, contact).items():
        error = abs(found[name] - exact)
        assert error <= found[f"{name}_error"] + 1e-4 and found[f"{name}_error"] < 0.02 * exact


def test_ends_of_all_laws():
    parameters = sphere_size.Parameters()
    for contact in sphere.LAWS:
        small = sphere_size.solve(parameters, 1e-3, contact)
        assert small["radius"] == pytest.approx(1, rel=1e-2) and small["approach"] == pytest.approx(
            1, rel=5e-3
        )
    end = sphere_size.reference(parameters, "microblock")
    distances = [
        abs(sphere_size.solve(parameters, alpha, "microblock")["approach"] / end["approach"] - 1)
        for alpha in (3.0, 6.0)
    ]
    # contacts ell apart push each other down like 1/ell
    assert distances[1] < 0.65 * distances[0] < 0.2


def test_the_command_returns_its_table_and_picture(capsys, tmp_path):
    words = ["sphere_size", "--alphas", "0.5", "1", "--json", "-", "--out", str(tmp_path)]
    assert main(words) == 0
    answer = json.loads(capsys.readouterr().out)
    rows = {(row["contact"], row["alpha"]): row for row in answer["states"]}
    assert len(rows) == 6 and set(answer["ends"]) == set(sphere.LAWS)
    # microblocks soften, the others harden
    assert rows["microblock", 1.0]["hardness"] < rows["microblock", 0.5]["hardness"] < 1
    assert rows["unilateral", 1.0]["hardness"] > rows["unilateral", 0.5]["hardness"] > 1
    assert (tmp_path / "sphere_size.png").stat().st_size > 10_000
