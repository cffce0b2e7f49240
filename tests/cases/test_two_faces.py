"""The strip with its own psi0 on either face: the closed form tested before it verifies, then finite elements
against it.
"""

import json
import math
from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from cases.__main__ import main
from cases.scenes import two_faces
from microblock import Body, Microblock, Plane
from microblock.fem import meshes
from microblock.fem.facets import ContactFacets
from microblock.fem.newton import MonolithicNewton
from microblock.model.closed_forms import Strip, TwoFacedStrip

# rotations of equal and of opposite sign, one face aligned, thick blocks at which one face rotates the wrong
# way at first, thin layers
STRIPS = [
    TwoFacedStrip(*values, 0.0, curvature)
    for *values, curvature in (
        (0.5, 0.02, -0.01, 0.3, 1.0, 2.0),
        (0.5, 0.02, 0.01, 0.3, 1.0, 2.0),
        (0.3, 0.0, -0.03, 0.45, 1.9, 2.0),
        (20.0, 0.1, -0.02, 0.3, 1.0, 2.0),
        (0.01, -0.02, 0.01, 0.3, 0.5, 1.0),
        (2.0, -0.03, -0.05, -0.5, 0.1, 2.0),
    )
]


def loaded():
    """Before, between and beyond the closings, and on them."""
    for strip in STRIPS:
        low, high = sorted(strip.delta_fc)
        for delta in (low / 2, low, (low + high) / 2, high, 2 * high):
            if delta > 0:
                yield replace(strip, delta=delta)


@pytest.mark.parametrize("strip", list(loaded()))
def test_contact_conditions_at_all_four_corners(strip):
    """(26) from psi, u2 and M alone, each corner by (21), (22), (29) in the frame of its own face."""
    (psi_u, psi_l), (M_u, M_l), p = strip.surface, strip.micromoments, strip.pressure
    depths, gaps, forces = [], [], []
    for psi0, psi, M in ((strip.upper, psi_u, M_u), (strip.lower, psi_l, M_l)):
        # p_A + p_B = p and (ell/2)[(psi0 + 1) p_A + (psi0 - 1) p_B] = M
        p_A = (2 * M / strip.ell + (1 - psi0) * p) / 2
        levels = (
            max(strip.ell * psi0, 0) + strip.ell / 2 * (psi0 + 1) * psi,
            max(-strip.ell * psi0, 0) + strip.ell / 2 * (psi0 - 1) * psi,
        )
        depths.append(min(levels))  # of the plane into the face, until its nearer corner touches
        gaps.append(np.subtract(levels, min(levels)))
        forces.append((p_A, p - p_A))
    rounding = 1e-12 * p
    assert np.min(forces) > -rounding * max(1.0, strip.ell)
    assert np.max(np.abs(np.multiply(forces, gaps))) < rounding * strip.ell
    # the planes come nearer by what the strip is squeezed and what its blocks lean back
    squeezed = strip.u2(-1.0) - strip.u2(1.0)
    assert squeezed + sum(depths) == pytest.approx(2 * strip.delta, rel=1e-12)


@pytest.mark.parametrize("strip", list(loaded()))
def test_equilibrium(strip):
    x2, step = np.linspace(-0.9, 0.9, 7), 1e-3 / max(1, strip.k)
    eta = strip.beta / (2 - strip.beta)

    def slope(field, at, width=step):
        return (field(at + width) - field(at - width)) / (2 * width)

    psi, size = strip.psi(x2), np.abs(strip.surface).max()
    skew = 2 * eta * (slope(strip.u1, x2) / 2 + psi)
    # central differences leave (k h)^2 = 1e-6, and rounding of 1e-16/(k h)
    assert slope(strip.u1, x2) + skew == pytest.approx(0, abs=3e-6 * size * (1 + eta))
    G = strip.curvature * strip.ell**2
    couple = G * (strip.psi(x2 + step) - 2 * psi + strip.psi(x2 - step)) / step**2
    assert couple - 2 * skew == pytest.approx(0, abs=1e-5 * size * max(G, 1.0))
    short = 1e-4 / max(1, strip.k)
    for number, (x, sign) in enumerate(((1.0, 1), (-1.0, -1))):
        assert strip.psi(x) == pytest.approx(strip.surface[number], rel=1e-12)
        # a difference of values as large as psi
        assert sign * G * slope(strip.psi, x, short) == pytest.approx(
            strip.micromoments[number], rel=1e-6, abs=1e-11 * G * size / short
        )
    assert strip.oedometric * slope(strip.u2, x2) == pytest.approx(-strip.pressure, rel=1e-8)


@pytest.mark.parametrize("psi0, share", list(product((0.02, -0.05), (0.4, 1.0, 1.5))))
def test_equal_rotations_are_the_papers_strip(psi0, share):
    paper = Strip(0.3, psi0, 0.3, 1.0, 0.0)
    paper = replace(paper, delta=share * paper.delta_fc)
    both = TwoFacedStrip(0.3, psi0, psi0, 0.3, 1.0, paper.delta)
    x2 = np.linspace(0, 1, 5)
    assert both.delta_fc == pytest.approx((paper.delta_fc, paper.delta_fc), rel=1e-14)
    assert set(both.states) == {paper.state}
    assert both.pressure == pytest.approx(-paper.traction, rel=1e-13)
    assert both.psi(x2) == pytest.approx(paper.psi(x2), rel=1e-13)
    assert both.micromoments == pytest.approx((paper.micromoment, paper.micromoment), rel=1e-13)


def test_a_second_corner_closes_where_the_first_alone_would_not():
    """Thick blocks that differ: the more rotated face, the weaker lever, follows the other at first, away
    from its plane.
    """
    strip = STRIPS[3]
    early = replace(strip, delta=strip.delta_fc[1] / 2)
    assert early.surface[0] * strip.upper > 0 and early.surface[1] * strip.lower < 0
    assert strip.delta_fc[1] < strip.delta_fc[0] < math.inf


@pytest.mark.parametrize(
    "words",
    [
        {},
        {"upper_deg": 2.0, "lower_deg": 2.0},
        {"lower_deg": 0.0},
        {"ell_over_H": 0.05},
        {"upper_deg": 5.0, "lower_deg": -1.0, "ell_over_H": 20.0},
        {"curvature": 1.0, "nu": 0.45, "beta": 1.9},
    ],
)
@pytest.mark.parametrize("share", [0.3, 0.9, 1.5])
def test_finite_elements_meet_the_closed_form(words, share):
    parameters = two_faces.Parameters(**words)
    delta = min(1.0, share * max(two_faces.reference(parameters).delta_fc))
    parameters = replace(parameters, delta_over_H=delta)
    found = two_faces.result(parameters)
    assert max(found["errors"].values()) < parameters.rtol  # what was asked for
    assert found["state"] == list(two_faces.reference(parameters).states)


def test_opposite_rotations_are_half_a_strip_with_psi_constrained_in_its_middle():
    """Augmented Lagrangian on a half: for opposite rotations psi is odd in x2, so that Newton's contact on
    one face answers too.
    """
    parameters = two_faces.Parameters(upper_deg=1.0, lower_deg=-1.0)
    body = Body(
        meshes.line(1.0, 2), parameters.solid, 10, fixed={"u1": "contact", "u2": "middle", "psi": "middle"}
    )
    facets = ContactFacets(
        body, Microblock(parameters.psi0[0]), Plane(parameters.ell_over_H / 2 * parameters.psi0[0])
    )
    for delta in (0.01, 0.04):
        state = MonolithicNewton(body, facets).solve(delta)
        exact = two_faces.reference(parameters, delta)
        # both are converged to ten digits
        assert state.psi[0] == pytest.approx(exact.surface[0], rel=1e-9)
        assert -exact.surface[1] == pytest.approx(exact.surface[0], rel=1e-13)
        assert state.micromoment[0] == pytest.approx(exact.micromoments[0], rel=1e-9)
        assert state.traction[0] == pytest.approx(-exact.pressure, rel=1e-9)


def test_command(tmp_path, capsys):
    assert main(["two_faces", "--json", str(tmp_path / "a.json"), "--out", str(tmp_path)]) == 0
    answer = json.loads((tmp_path / "a.json").read_text())
    assert answer["state"] == ["partial", "full"] and "upper" in capsys.readouterr().out
    assert {"two_faces.csv", "two_faces.png", "two_faces.pdf"} <= {path.name for path in tmp_path.iterdir()}


def test_accuracy_out_of_reach(capsys):
    assert main(["two_faces", "--rtol", "1e-17"]) == 1
    assert "1e-17" in capsys.readouterr().err
