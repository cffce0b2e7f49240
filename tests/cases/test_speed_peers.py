"""Other programs on the classical line contact: they solve the problem that they are timed on."""

import math
import subprocess
import sys

import numpy as np
import pytest

from cases.studies import speed_ngsolve, speed_skfem
from cases.studies.speed_methods import APPROACH, FAR, REACH, contact_boundary, on_squares, scikit_fem
from cases.studies.speed_scenes import CLASSICAL, LOAD, OBSTACLE, SCENES
from microblock import NotConverged

SCENE = SCENES["classical"]
MODULI = SCENE.solid.lam, SCENE.solid.mu
# what is left of the coupling is of the order beta log(beta)
LEFT = -10 * CLASSICAL * math.log(CLASSICAL)


def squares(order):
    return on_squares(SCENE, 0.2, order, "condensed", math.inf, reach=REACH).solve(load=LOAD).solution


@pytest.mark.parametrize("order", [1, 2])
def test_scikit_fem_and_condensed_elements_are_one_discrete_problem(order):
    theirs = speed_skfem.Ground(*MODULI, FAR * REACH, REACH, 0.2, order).solve(OBSTACLE.height, LOAD / 2, 1.0)
    ours = squares(order)
    own = ours.forces[0][: len(theirs.x)]
    assert theirs.forces == pytest.approx(own, abs=LEFT * own.max()) and np.array_equal(
        theirs.forces > 0, own > 0
    )
    assert theirs.approach == pytest.approx(ours.approach, rel=LEFT)
    x = np.linspace(0, 2.5, 97)
    assert theirs.pressure(x) == pytest.approx(ours.pressure(0, x), abs=LEFT)


def test_active_set_of_scikit_fem_forgets_where_it_starts():
    ground = speed_skfem.Ground(*MODULI, FAR * REACH, REACH, 0.25)
    exact, wide, narrow = (ground.solve(OBSTACLE.height, LOAD / 2, start) for start in (1.0, 2.0, 0.1))
    for other in (wide, narrow):
        # one linear system for one set
        assert other.forces == pytest.approx(exact.forces, abs=1e-12) and other.iterations > exact.iterations


def test_contact_boundary_is_the_nodal_problem_for_stiff_penalty():
    """Two Gauss points hold both ends of a bilinear element's penetration, on a chord h^2/12 off the
    parabola at the nodes.
    """
    ours = squares(1)

    def off(rho):
        theirs = speed_ngsolve.Ground(*MODULI, FAR * REACH, REACH, 0.2, 1, rho).solve(LOAD / 2, APPROACH)
        return theirs.approach - ours.approach + 0.2**2 / 12

    stiff, soft = off(1e6), off(1e4)
    # the penetration falls like 1/rho; beside it is the counterpart's own side off the parabola, (h/8)^2/8
    assert abs(stiff) < 0.025**2 / 8 and soft - stiff == pytest.approx(1 / 1e4, rel=0.7)


@pytest.mark.parametrize(
    "run, settings",
    [
        (scikit_fem, {"order": 2}),
        (contact_boundary, {"order": 2, "rho": 1e3}),
        (contact_boundary, {"order": 1, "rho": 10**2.5}),
    ],
)
def test_peers_approach_the_ellipse(run, settings):
    coarse, fine = (run(SCENE, h=h, **settings) for h in (1.0, 0.25))
    first, last = (SCENE.errors(answer.found)["error_p"] for answer in (coarse, fine))
    # of order 1 for a root at the edge of the contact, if that falls on nodes as it does here
    assert last < first / 2.5 and last < 0.04
    assert fine.unknowns > coarse.unknowns and min(fine.setup, fine.solve) > 0


def test_both_readings_of_the_penalty_carry_the_load():
    state = speed_ngsolve.Ground(*MODULI, FAR * REACH, REACH, 0.25, 2, 1e2).solve(LOAD / 2, APPROACH)
    points, weights = np.polynomial.legendre.leggauss(5)
    x = (state.ends[:-1, None] + (points + 1) * np.diff(state.ends)[:, None] / 2).ravel()
    weights = (weights * np.diff(state.ends)[:, None] / 2).ravel()
    # nodal forces are those of equilibrium, up to what slopes of 1/RADIUS change in the gap; the
    # penetration is cut at 0 on
    # one facet, where Gauss points do not see it all
    assert weights @ state.by_forces(x) == pytest.approx(LOAD / 2, rel=1e-6)
    assert weights @ state.by_penetration(x) == pytest.approx(LOAD / 2, rel=1e-2)


def test_cases_are_listed_without_the_peers():
    """They are extras: only what runs them needs them."""
    code = (
        "import sys; sys.modules.update(skfem=None, tamaas=None); from cases.__main__ import main; "
        "assert main([]) == 0"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True).returncode == 0


def test_peers_that_do_not_end_say_so(monkeypatch):
    monkeypatch.setattr(speed_skfem, "STEPS", 1)
    monkeypatch.setattr(speed_ngsolve, "STEPS", 1)
    with pytest.raises(NotConverged, match="active set"):
        speed_skfem.Ground(*MODULI, FAR * REACH, REACH, 0.5).solve(OBSTACLE.height, LOAD / 2, 2.0)
    with pytest.raises(NotConverged, match="Newton"):
        speed_ngsolve.Ground(*MODULI, FAR * REACH, REACH, 0.5, 1, 1e3).solve(LOAD / 2, APPROACH)
