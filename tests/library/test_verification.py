"""The second codes of the verification against closed forms, and problems that they judge: obstacles as users
hand them over, units, tolerances that are advised.
"""

from math import pi
from types import SimpleNamespace

import numpy as np
import pytest

import microblock as mb
from cases.benchmarks.verification import (
    SEED,
    doors,
    friction,
    judging,
    lines,
    obstacles,
    scales,
    space_problems,
)

E, NU = 0.91, 0.3  # E* = 1


# ---- the line


def line_problem(law, obstacle=mb.Cylinder(1.0), beta=1.0):
    return mb.Contact(mb.HalfPlane(mb.Cosserat(E=2 * E, nu=NU, ell=0.25, beta=beta)), obstacle, law)


def test_panels_tell_a_coarse_state_and_a_wrong_one():
    contact, load = line_problem(mb.Microblock(0.03)), pi / 2
    states = [contact.with_(method=mb.Panels(order=order)).solve(load=load) for order in (6, 10, 14)]
    verify = lines.by_panels(contact, load)
    (first, _, residual), (second, _, _), (third, _, _) = map(verify, states)
    assert residual < 1e-10 and first > 1e-8 and second < first / 5 and third < second / 5
    read = states[-1].pressure_at
    wrong = {
        name: getattr(states[-1], name) for name in ("law", "zones", "solid", "obstacle", "error_estimate")
    }
    for changed in (
        lambda x, c: 1.001 * read(x, c),
        lambda x, c: read(x - 1e-3, c),
        lambda x, c: read(x, "A"),
    ):
        assert verify(SimpleNamespace(**wrong, pressure_at=changed))[0] > 5e-4


def test_a_zone_that_a_state_overlooks_is_missed():
    """One cylinder of two: panels on its zones violate (26) beneath the other; there is a zone next time."""
    pair = line_problem(mb.Unilateral(), lambda x: np.minimum((x - 3) ** 2, (x + 3) ** 2) / 2)
    alone = line_problem(mb.Unilateral(), lambda x: (x - 3) ** 2 / 2).solve(load=pi / 2, rtol=1e-3)
    right = lines.by_panels(pair, pi / 2, window=(-6, 6))
    assert right(alone)[0] > 0.5 and right(pair.solve(load=pi / 2, rtol=1e-3))[0] < 1e-3


@pytest.mark.parametrize("number", [0, 2, 24])
def test_hard_obstacles_are_answered_right(number):
    row = judging.outcome(lines.hard(number, seed=2020))
    assert row["class"] == "right", row


@pytest.mark.parametrize("method, k", [("panels", 1), ("cells", 3), ("body", 1)])
def test_fresh_states_hold_their_estimate(method, k):
    row = judging.outcome(lines.fresh(method, k))
    assert row["class"] == "right", row


def test_a_peak_beside_an_edge_is_in_the_estimate():
    """Half a cell beside it: grids of 2048 and 4096 cells agreed there to 2.8e-3 and were off by 1.4e-2."""
    _, problem, load, *_ = obstacles.drawn(SEED, 100, mb)
    state = problem.with_(method=mb.Cells()).solve(load=load, rtol=1e-2)
    true = problem.solve(load=load, rtol=1e-4)
    assert true.method == "panels" and lines.error(state, true) <= max(1e-2, state.error_estimate)


# ---- histories, and surfaces in space


@pytest.mark.parametrize("k", [2, 0])
def test_history_holds_its_estimate(k):
    row = judging.outcome(friction.case(k))
    assert row["class"] in ("right", "warned") and row["ratio"] <= 1, row


@pytest.mark.parametrize("k", [3, 19, 31])  # kinds that take a second: large blocks, a saddle, a punch
def test_scene_is_not_silently_wrong(k):
    row = judging.outcome(space_problems.case(k))
    assert row["class"] in ("right", "warned", "error"), row


# --- obstacles as users hand them over, drawn by program, beside a judge of its own; and the judge itself


# known: a height that writes into its argument beside its own ends; a piece at 1e5 whose ends are named
@pytest.mark.nightly(300, 36, 56)
def test_what_users_hand_over_is_answered_or_refused_truly(seed):
    row = judging.outcome(doors.case(seed))
    assert row["class"] in ("right", "slow"), row


# --- no length decides that the user has not given: the same problem in any units has the same digits


ELASTIC = mb.Elastic(E=100, nu=0.3)
UNILATERAL = mb.Unilateral()


@pytest.mark.nightly(200)
def test_problems_of_every_kind_have_the_same_digits_in_any_units(seed):
    """To rounding, or where a branch hangs on rounding to a tenth of the estimate: of a wave of 1e-9 metres
    under 1e12 pascals, say. What is refused, is in all units.
    """
    row = judging.outcome(scales.case(seed), seconds=120)
    assert row["class"] in ("right", "error"), row["message"] or row["ratio"]


@pytest.mark.parametrize("unit", [1e-15, 1e-9, 1e-3, 1.0, 1e6])
@pytest.mark.parametrize("method", [None, mb.Cells(), mb.Cells(nodes=512)], ids=str)
def test_a_classical_cylinder_is_that_of_hertz_in_any_unit_of_length(unit, method):
    """Of a radius of 10 mm, in metres, cells had 4.3e-3 for 3.4e-4, or took seconds for hundredths."""
    problem = mb.Contact(mb.HalfPlane(ELASTIC), mb.Cylinder(R=10 * unit), UNILATERAL, method)
    state = problem.solve(load=1.0 * unit)
    half_width, _ = mb.hertz_scales(ELASTIC, R=10 * unit, P=1.0 * unit)
    # a cell of the window of some six half-widths
    assert state.half_width == pytest.approx(half_width, rel=2e-2 if method else 1e-4)
    assert state.unknowns < 3000


@pytest.mark.parametrize("middle", [0.0, 5.0])
def test_samples_over_200_micrometres_in_metres(middle):
    """They were said to have a finite height over no cell; a stage stands at 5 m as well as at 0."""
    x = np.linspace(-1e-4, 1e-4, 41)
    steel, R = mb.Elastic(E=1e11, nu=0.3), 1e-3
    load = np.pi * steel.E_star * 3.42e-5**2 / (4 * R)
    samples = mb.Obstacle.from_samples(middle + x, x**2 / (2 * R))
    state = mb.Contact(mb.HalfPlane(steel), samples, UNILATERAL).solve(load=load)
    # of lines between samples, a seventh of the half-width apart
    assert state.contact_area / 2 == pytest.approx(3.42e-5, rel=1e-2)
    assert any("samples" in words for words in state.warnings)


def test_what_is_lowest_far_away_is_found_whatever_the_unit():
    """It was refused beyond 1e5 lengths, of which nobody had given any."""
    for shift in (1e3, 1e6):
        problem = mb.Contact(mb.HalfPlane(ELASTIC), lambda x, shift=shift: (x - shift) ** 2 / 20, UNILATERAL)
        half_width, _ = mb.hertz_scales(ELASTIC, R=10, P=1.0)
        assert problem.solve(load=1.0).half_width == pytest.approx(half_width, rel=1e-4)
        blocks = mb.Cosserat(E=100, nu=0.3, ell=1e-3, beta=1)  # 1e9 blocks away
        state = problem.with_(body=mb.HalfPlane(blocks), law=mb.Microblock()).solve(load=1.0)
        assert state.half_width == pytest.approx(half_width, rel=1e-2)


def test_newton_solves_a_body_of_micrometres_and_gigapascals():
    """Mixed derivatives of the contact term were lost beside rho, of some 1e17: "no factorisation"."""
    for length, stress in ((1.0, 1.0), (5e-6, 5e9), (1e-9, 1e12)):
        row = scales.on_mesh(np.random.default_rng(50), scales.Units(length, stress), False)[1]()
        assert row.residual < 1e-9


def test_a_loaded_state_has_the_length_of_its_contact(tmp_path):
    """Gaps of a classical half-plane count from a level that follows from it."""
    state = mb.Contact(mb.HalfPlane(ELASTIC), mb.Cylinder(R=1e-3), UNILATERAL).solve(load=1e-4)
    state.save(tmp_path / "state.npz")
    loaded = mb.load(tmp_path / "state.npz")
    assert loaded.solid == ELASTIC and loaded.solid.ell == state.solid.ell == pytest.approx(3.4e-5, rel=1e-2)


@pytest.mark.parametrize("seed", [133, 147])
def test_a_block_in_micrometres_is_supported_as_in_metres(seed):
    """Forces beside moments, which were 1e8 times as many: "singular matrix of the bulk"."""
    row = judging.outcome(scales.case(seed), seconds=120)
    assert row["class"] == "right", row["message"]


@pytest.mark.parametrize("level", [0.0, 1e8])
@pytest.mark.parametrize("method", [None, mb.Cells()], ids=str)
def test_the_level_of_an_obstacle_takes_no_digits(level, method):
    """Heights of a map over sea level, say: gradient projection stalled, and panels went on for an hour."""
    x = np.linspace(-1, 1, 801)
    for obstacle in (mb.Obstacle.from_samples(x, x**2 / 20 + level), lambda x: x**2 / 20 + level):
        state = mb.Contact(mb.HalfPlane(ELASTIC), obstacle, UNILATERAL, method).solve(load=1.0)
        # heights of 1e8 are rounded by 1e-8, a millionth of what the obstacle rises
        assert state.half_width == pytest.approx(0.34039, rel=3e-3)
        assert state.error_estimate < 1e-2
