"""The reference of another kind, tested before it verifies, and a quick sample of what it says of the
solver.
"""

import json

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.linalg import schur
from scipy.special import exp1

import microblock as mb
from cases.__main__ import main
from cases.studies import accuracy, judged_line, reference_kernels
from cases.studies import reference_line as judge
from microblock.corners import active_set

LOAD = np.pi / 2  # with E* = 2 and R = 1 lengths are over a_Hz and pressures over p_Hz
MATERIALS = pytest.mark.parametrize("nu, beta", [(0.0, 0.2), (0.3, 1.0), (0.49, 1.9)])


def problem(alpha, law, obstacle=mb.Cylinder(1.0), beta=1.0):
    solid = mb.Cosserat(E=2 * (1 - 0.3**2), nu=0.3, ell=alpha, beta=beta)
    return mb.Contact(mb.HalfPlane(solid), obstacle, law)


def surface_compliance(solid, k):
    """(u1, u2, psi) from (sigma_12, sigma_22, m_2) for waves exp(i k x1), from the decaying solutions of
    (14)-(17).

    In z = (u1, u2, psi, sigma_12, sigma_22, m_2) they are the invariant subspace of z' = H z with growth
    along x2.
    """
    mu, lam, mu_c, G = solid.mu, solid.lam, solid.mu_c, solid.curvature * solid.ell**2 * solid.mu
    u1, u2, psi, s12, s22, m2 = np.eye(6, dtype=complex)
    du1 = (s12 - (mu - mu_c) * (1j * k * u2 - psi)) / (mu + mu_c) - psi
    du2 = (s22 - lam * 1j * k * u1) / (lam + 2 * mu)
    s11 = (lam + 2 * mu) * 1j * k * u1 + lam * du2
    s21 = (mu + mu_c) * (1j * k * u2 - psi) + (mu - mu_c) * (du1 + psi)
    H = np.array((du1, du2, m2 / G, -1j * k * s11, -1j * k * s21, s12 - s21 + k * k * G * psi))
    _, basis, count = schur(H, output="complex", sort="rhp")
    assert count == 3
    return basis[:3, :3] @ np.linalg.inv(basis[3:, :3])


@MATERIALS
@pytest.mark.parametrize("k", [0.1, 1.0, 7.0])
def test_symbol_of_the_reference_solves_the_field_equations(nu, beta, k):
    solid = mb.Cosserat(E=3.0, nu=nu, ell=0.7, beta=beta)
    C = surface_compliance(solid, k)
    found = reference_kernels.symbols(nu, beta, solid.curvature, k * solid.ell)
    scale, half = (1 - nu) / solid.mu * solid.ell, solid.ell / 2  # symbols are over c, wavenumbers times ell
    # the defective double root of the classical modes costs half the digits of a root, few of the subspace
    assert C[1, 1] == pytest.approx(scale * found["U"], rel=1e-8)
    assert C[2, 2] * half**2 == pytest.approx(scale * found["W"], rel=1e-8)
    assert -C[1, 2] * half == pytest.approx(1j * scale * found["V"], rel=1e-8)


@MATERIALS
@pytest.mark.parametrize("x", [0.03, 0.5, 4.0])
def test_kernels_of_the_reference_are_the_transforms_on_the_real_axis(nu, beta, x):
    solid = mb.Cosserat(E=1.0, nu=nu, ell=1.0, beta=beta)

    def transform(name, start, wave):
        return (
            quad(
                lambda k: reference_kernels.symbols(nu, beta, 2.0, max(k, 1e-300))[name],
                start,
                np.inf,
                weight=wave,
                wvar=x,
                # which keeps it from warning of rounding
                epsabs=1e-12,
                limit=500,
                limlst=200,
                full_output=1,
            )[0]
            / np.pi
        )

    level = quad(
        lambda k: np.cos(k * x) * reference_kernels.symbols(nu, beta, 2.0, k)["U"] - np.exp(-k) / k,
        0,
        1,
        epsabs=1e-13,
    )[0]
    expected = {
        "U": transform("U", 1.0, "cos") + (level - exp1(1.0)) / np.pi,
        "W": transform("W", 0.0, "cos"),
        "V": transform("V", 0.0, "sin"),
        "reaction": transform("reaction", 0.0, "sin"),
    }
    for name, value in expected.items():
        parts = ({}, {name: 1.0}) if name in reference_kernels.ODD else ({name: 1.0}, {})
        kernel = reference_kernels.table(solid, *parts)
        sign = -1 if name in reference_kernels.ODD else 1
        # what the quadrature asks of itself, on the cycles of the wave
        assert kernel(np.array([x, -x])) == pytest.approx([value, sign * value], abs=2e-12), name


@pytest.mark.parametrize(
    "obstacle, edge, pressure",
    [
        (mb.Cylinder(1.0), 1.0, lambda x: np.sqrt(1 - x**2)),
        (mb.Wedge(0.5), LOAD, lambda x: 1 / np.pi * np.arccosh(LOAD / np.abs(x))),
    ],
)
def test_reference_meets_closed_forms_of_classical_contact(obstacle, edge, pressure):
    here = judge.Problem(problem(0.25, mb.Unilateral(), obstacle, beta=1e-9), LOAD)
    state = judge.fit(here, {0: [(-1.03 * edge, 0.98 * edge)]}, (8, 14))[-1]
    # what is left of the coupling is of the order beta log(beta)
    assert state.zones[0][0] == pytest.approx((-edge, edge), abs=1e-7)
    x = edge * np.array([-0.99, -0.5, -1e-3, 0.2, 0.7, 0.9999])
    assert state.pressure(0, x) == pytest.approx(pressure(x), abs=1e-7)


@pytest.mark.parametrize(
    "law, zones",
    [(mb.Microblock(), {0: [(-0.5, 1.05)]}), (mb.Microblock(0.05), {0: [(-0.42, 1.05)], 1: [(-1.04, 0.58)]})],
)
def test_levels_of_the_reference_converge(law, zones):
    states = judge.fit(judge.Problem(problem(0.25, law), LOAD), zones, (6, 8, 14, 17))
    errors = [
        judge.distance(judge.fields(state), judge.fields(states[-1]), judge.breaks(states))
        for state in states[:-1]
    ]
    # 5.8 to the power of the order, down to the rounding of a first-kind equation
    assert errors[1] < errors[0] / 5 and errors[1] < 1e-7 and errors[2] < 5e-11
    assert judge.violation(states[-1]) < 1e-10  # (26): rounding of the gaps


def test_a_uniform_grid_tends_to_the_reference():
    """Constant pressure on cells and block pivoting: another basis still, first order in the cell."""
    here = problem(0.25, mb.Microblock(0.05))
    state = judge.fit(judge.Problem(here, LOAD), {0: [(-0.42, 1.05)], 1: [(-1.04, 0.58)]}, (8, 12))[-1]
    errors = []
    for cells in (151, 301):
        x = np.linspace(-1.5, 1.5, cells)
        H, gaps, share = here.body.compliance(x).corner_system(here.law, here.obstacle)
        found = active_set.solve(H, gaps, load=LOAD, c=share).forces.reshape(2, -1) / (x[1] - x[0])
        exact = np.array([state.pressure(corner, x) for corner in (0, 1)])
        errors.append(np.sqrt(np.mean((found - exact) ** 2) / np.mean(exact**2)))
    # the edges' square roots on cells of 0.02 and 0.01
    assert errors[0] < 0.03 and errors[1] < 0.6 * errors[0]


def test_judge_sees_what_a_coarse_state_misses():
    draw = judged_line.Draw("psi0", "microblock", 0.25, 0.3, 1.0, psi0=0.3)
    fine, own = judged_line.reference(draw.problem())
    states = [
        draw.problem().with_(method=mb.Panels(order=order)).solve(load=judged_line.LOAD)
        for order in (6, 10, 14)
    ]
    errors = [judged_line.error(state, fine) for state in states]
    x = np.linspace(-1.3, 1.3, 100001)
    p = np.array([states[0].pressure_at(x, corner) for corner in "AB"])
    exact = np.array([fine.pressure(corner, x) for corner in (0, 1)])
    scale, levers = np.linalg.norm(exact.sum(axis=0)), (1.03, -0.97)  # psi0 = 0.3/R
    plain = max(np.linalg.norm((p - exact).sum(axis=0)), np.linalg.norm(levers @ (p - exact) / 2)) / scale
    assert errors[0] == pytest.approx(plain, rel=0.02)  # points that know nothing of the edges
    assert own < 1e-10
    # a state of low order is no state of rtol 1e-9, and orders converge to the judge
    assert errors[0] > 1e-8 and errors[1] < errors[0] / 5 and errors[2] < errors[1] / 5


def test_quick_sample_holds_what_was_asked():
    rows = accuracy.result(accuracy.Parameters(scenes=8, rtols=(1e-3, 1e-6)))["scenes"]
    errors = [row["error_over_rtol"] for row in rows if row["error_over_rtol"] is not None]
    assert {row["kind"] for row in rows} == set(accuracy.MODELS["halfplane"].sample.kinds)
    # of 16: a wedge may refuse 1e-6, no state may miss its rtol
    assert len(errors) >= 15 and max(errors) < 1
    assert all(row["kind"] == "wedge" and "NotConverged" in row["failure"] for row in rows if row["failure"])


def test_command(tmp_path, capsys):
    words = [
        "accuracy",
        "--scenes",
        "2",
        "--rtols",
        "1e-3",
        "--json",
        str(tmp_path / "a.json"),
        "--out",
        str(tmp_path / "o"),
    ]
    assert main(words) == 0
    assert "below" in capsys.readouterr().out
    answer = json.loads((tmp_path / "a.json").read_text())
    assert {"parameters", "versions", "seconds", "table", "scenes", "failures"} == set(answer)
    assert answer["table"][-1]["kind"] == "all" and answer["table"][-1]["below"] == 2
    assert {path.suffix for path in (tmp_path / "o").iterdir()} == {".csv", ".png", ".pdf"}
