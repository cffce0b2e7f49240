"""The second codes of the verification against closed forms, and a handful of problems that they judge."""

from math import pi, sqrt
from types import SimpleNamespace

import numpy as np
import pytest

import microblock as mb
from cases.benchmarks.verification import (
    SEED,
    friction,
    judging,
    kernels,
    lines,
    obstacles,
    panels,
    period,
    space,
    space_problems,
)

E, NU = 0.91, 0.3  # E* = 1
BLUNT = 1e-7  # ell of a solid that is classical at the scale of the contact


# ---- the line


@pytest.mark.parametrize("k", [0.1, 1.0, 7.0])
def test_symbols_of_two_derivations_agree(k):
    """A rational closed form, and energy minimised in depth."""
    u, clamped, v, w, _ = space.symbol(k, NU, 1.3)
    names, c = ("U", "clamped", "V", "W"), 2 * (1 - NU)  # over (1 - nu)/mu; blocks have arms of half of ell
    closed = kernels.symbols(NU, 1.3, 2.0, k)
    expected = [closed[name] * c / 2 * factor for name, factor in zip(names, (1, 1, 2, 4))]
    assert [u, clamped, abs(v), w] == pytest.approx(expected, rel=1e-8)  # spectral elements end there


def line_problem(law, obstacle=mb.Cylinder(1.0), beta=1.0):
    return mb.Contact(mb.HalfPlane(mb.Cosserat(E=2 * E, nu=NU, ell=0.25, beta=beta)), obstacle, law)


@pytest.mark.parametrize("obstacle, edge, form", [
    (mb.Cylinder(1.0), 1.0, lambda x: np.sqrt(1 - x**2)),
    (mb.Wedge(0.5), pi / 2, lambda x: np.arccosh(pi / 2 / np.abs(x)) / pi),
    (mb.Punch(1.0), 1.0, lambda x: 0.5 / np.sqrt(1 - x**2)),
])  # fmt: skip
def test_panels_meet_closed_forms_of_classical_contact(obstacle, edge, form):
    wide = 1.0 if isinstance(obstacle, mb.Punch) else 1.03
    setting = panels.Problem(line_problem(mb.Unilateral(), obstacle, beta=1e-9), pi / 2)
    state = panels.fitted(setting, {0: [(-wide * edge, edge)]}, (8, 14))[-1]
    x = edge * np.array([-0.99, -0.5, -1e-3, 0.2, 0.9999])
    # what is left of the coupling is of the order beta log(beta)
    assert state.pressure(0, x) == pytest.approx(form(x), abs=1e-6) and state.violation()[0] < 1e-7
    ends = np.array((state.panels.e, state.panels.e + state.panels.h))
    ends = ends[np.abs(ends) < 0.99 * edge]  # where panels meet; rounding leaves no point between them
    assert np.all(state.pressure(0, np.nextafter(ends, [[-9.0], [0.0], [9.0]]).ravel()) > 0)


def test_panels_tell_a_coarse_state_and_a_wrong_one():
    contact, load = line_problem(mb.Microblock(0.03)), pi / 2
    states = [contact.with_(method=mb.Panels(order=order)).solve(load=load) for order in (6, 10, 14)]
    verify = lines.by_panels(contact, load)
    (first, _, own), (second, _, _), (third, _, _) = map(verify, states)
    assert own < 1e-10 and first > 1e-8 and second < first / 5 and third < second / 5
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
    state, true = (
        problem.with_(method=mb.Cells()).solve(load=load, rtol=1e-2),
        problem.solve(load=load, rtol=1e-4),
    )
    assert true.method == "panels" and lines.error(state, true) <= max(1e-2, state.error_estimate)


# ---- the half-space


def test_sphere_of_hertz():
    a, p0, approach = space.hertz(E, NU, 1.0, 0.01)
    solid, patches = (E, NU, 1.0, BLUNT), [(0, 0, 1.5 * a, 1.5 * a)]
    got = space.answer(lambda x, y: (x * x + y * y) / 2, patches, 0.01, solid, "unilateral", n=32)
    assert got["approach"] == pytest.approx(approach, rel=1e-3)  # 16 cells along a radius
    assert got["peak"] == pytest.approx(p0, rel=5e-3)


def test_plane_in_partial_contact_of_a_wave():
    """Westergaard's: a of period 1 under sin(pi a)^2 of the load that closes all."""
    amplitude, half = 0.01, 0.2
    full = pi * amplitude * E / (1 - NU**2)
    x, forces = period.pressures(
        lambda x: amplitude * (1 - np.cos(2 * pi * x)), 1.0, 512, (E, NU, 1.0, 1e-5), "unilateral",
        full * np.sin(pi * half) ** 2,
    )  # fmt: skip
    x = (x + 0.5) % 1 - 0.5
    root = np.sqrt(np.maximum(np.sin(pi * half) ** 2 - np.sin(pi * x) ** 2, 0))
    true = 2 * full * np.cos(pi * x) * root
    assert np.linalg.norm(forces[0] - true) < 5e-3 * np.linalg.norm(true)  # edges within a cell of 1/200


# ---- friction ----

CLASSICAL = (E, NU, 1e-9, 1.0)  # blocks do not act on displacements
LOAD = pi / 4  # under which a rigid cylinder of R = 1 touches from -1 to 1
BAR = 0.02  # relative L2: cells of 1/30, of which edges know a quarter; steps of 1/20 are of the same order


def cylinder(pairs, f, solid=CLASSICAL, law="unilateral", **more):
    """Line of 80 cells and the states that a history has come to."""
    problem = friction.Problem("cylinder", lambda x: x**2 / 2, pairs, solid, law, f, **more)
    return friction.follow(problem, 80, 20, fine=80, where=(-1.35, 1.35))


def root(x, a):
    return np.sqrt(np.maximum(a * a - x * x, 0))


def off(values, true, size=None):
    return np.linalg.norm(values - true) / np.linalg.norm(true if size is None else size)


def test_friction_all_slides():
    """Pressure of a rigid cylinder that slides has powers 1/2 + g and 1/2 - g at its ends (Johnson 1985)."""
    f = 0.5
    line, _ = cylinder((), f)
    for place in range(1, 6):
        line.step(LOAD, D=0.5 * place)
    p, _, q = line.state().fields
    assert q == pytest.approx(f * p, rel=1e-9)
    g = np.arctan(f * (1 - 2 * NU) / 2 / (1 - NU)) / pi
    place, a = -2 * g, sqrt(1 / (1 - 4 * g * g))  # more behind the obstacle than ahead of it
    x = np.clip((line.x - place) / a, -1, 1)
    true = (1 + x) ** (0.5 - g) * (1 - x) ** (0.5 + g)
    assert off(p, LOAD * true / (true @ line.width)) < BAR


def test_friction_sticks_as_spence_says():
    """Pressed, a rigid cylinder sticks on a fixed part of its contact, 1/sqrt(2) at this friction."""
    line, (state,) = cylinder(((LOAD, 0.0),), 2 / 7, coupled=False)
    assert line.width[state.stick].sum() / 2 == pytest.approx(sqrt(0.5), abs=1.5 * line.width[0])


def test_friction_of_equal_bodies_and_its_reversal():
    """Cattaneo and Mindlin: at Q/(f P) = 1/2 all sticks within sqrt(1/2), after the reversal sqrt(5/8)."""
    f, P = 0.3, LOAD / 2  # two bodies are half as stiff
    pairs = (P, 0.0), (P, 0.5 * f * P), (P, -0.25 * f * P)
    line, (pressed, sheared, back) = cylinder(pairs, f, second=CLASSICAL)
    full = root(line.x, 1) / 4
    first = full - root(line.x, sqrt(0.5)) / 4
    assert off(pressed.fields[0], full) < BAR
    assert off(sheared.fields[2] / f, first, full) < BAR
    assert off(back.fields[2] / f, first - 2 * full + root(line.x, sqrt(5 / 8)) / 2, full) < BAR
    assert line.work == pytest.approx(line.energy + line.dissipation, abs=0.2 * line.dissipation)


@pytest.mark.parametrize("k", [2, 0])
def test_history_holds_its_estimate(k):
    row = judging.outcome(friction.case(k, cells=20))
    assert row["class"] in ("right", "warned") and row["ratio"] <= 1, row


@pytest.mark.parametrize("k", [3, 19, 31])  # kinds that take a second: large blocks, a saddle, a punch
def test_scene_is_not_silently_wrong(k):
    row = judging.outcome(space_problems.case(k))
    assert row["class"] in ("right", "warned", "error"), row
