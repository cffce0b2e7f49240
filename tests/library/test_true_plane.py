"""What states of half-planes say is so: their readings, their estimates, and why a state is refused."""

import copy
import pickle

import numpy as np
import pytest

import microblock as mb
from cases.benchmarks.verification import SEED

LAWS = mb.Unilateral(), mb.Microclamped(), mb.Microblock(), mb.Microblock(psi0=0.01)
SOLID = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.05)
WAVE = mb.Wave(amplitude=0.01, wavelength=1.0)


@pytest.mark.parametrize(("ell", "spacing"), [(0.1, 0.05), (0.3, 0.1), (0.1, 0.1)])
def test_breaks_nearer_than_rounding_are_one(ell, spacing):
    """With ell a multiple of the spacing corner B meets the samples where A meets others."""
    x = np.arange(-30, 31) * spacing
    samples = mb.Obstacle.from_samples(x, x**2 / 2 + 0.002 * np.sin(7 * x))
    solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=ell)
    state = mb.Contact(mb.HalfPlane(solid), samples, mb.Microblock()).solve(load=1.0)
    assert state.method == "panels" and state.error_estimate <= 1e-3  # slivers make its system singular


@pytest.mark.parametrize("law", [mb.Unilateral(), mb.Microblock(psi0=0.01), mb.Microclamped()])
@pytest.mark.parametrize("two", [False, True])
def test_an_approach_at_the_mean_height_is_refused(law, two):
    """In full contact the approach is the mean height whatever the load."""
    body = mb.HalfPlane(SOLID, period=1.0)
    other = mb.HalfPlane(mb.Cosserat(E=200, nu=0.2, beta=0.5, ell=0.05), period=1.0)
    problem = mb.Contact(body, mb.Deformable(other, WAVE) if two else WAVE, law)
    full = problem.solve(load=9.0)
    for more in (0.0, 1e-12, 1e-5, 1e-2):
        with pytest.raises(mb.BadArgument, match="must stay below the mean height") as refused:
            problem.solve(approach=full.approach + more)
        assert refused.value.name == "approach"
    below = problem.solve(approach=full.approach - 1e-6)
    # near full contact the load changes by some 1e4 times the approach; residuals leave 1e-5 of its range
    assert problem.solve(load=below.load).approach == pytest.approx(below.approach, abs=2e-7)
    assert 0 < below.load < 9.0


def test_an_approach_above_the_mean_height_of_a_few_cells_is_below_that_of_many():
    """Of a narrow pit the first 256 cells see too little."""

    def height(x):
        pit = np.exp(-((((x + 0.2) % 1 - 0.5) / 2e-3) ** 2))
        return 0.01 * (1 - np.cos(2 * np.pi * x)) + 0.2 * pit

    for cells, sees in ((256, 0.01068), (1024, 0.01071)):
        assert height((np.arange(cells) + 0.5) / cells).mean() == pytest.approx(sees, rel=1e-3)
    problem = mb.Contact(mb.HalfPlane(SOLID, period=1.0), mb.Obstacle(height), mb.Unilateral(), mb.Cells())
    assert problem.solve(approach=0.0107, rtol=0.03).load > 0


def test_an_approach_at_the_mean_height_is_refused_in_space():
    body = mb.HalfSpace(SOLID, 1.0)
    obstacle = mb.Obstacle(lambda x, y: 0.01 * (2 - np.cos(2 * np.pi * x) - np.cos(2 * np.pi * y)))
    problem = mb.Contact(body, obstacle.height, mb.Unilateral())
    with pytest.raises(mb.BadArgument, match="mean height"):
        problem.solve(approach=problem.solve(load=20.0).approach)


@pytest.mark.parametrize("period", [None, 1.0])
def test_states_from_others_have_estimates(period):
    """By cells, whatever `initial` is."""
    method = mb.Cells(nodes=256) if period else mb.Cells(nodes=256, window=(-0.6, 0.6))
    problem = mb.Contact(mb.HalfPlane(SOLID, period), WAVE, mb.Microblock(), method)
    fresh = problem.solve(load=0.2)
    coarse = problem.with_(method=mb.Cells(nodes=100, window=method.window)).solve(load=0.21)
    for initial in (fresh, coarse):
        state = problem.solve(load=0.2, initial=initial)
        assert state.error_estimate == pytest.approx(fresh.error_estimate, rel=1e-3)  # of residuals


def compliance(solid, k):
    """Displacement under a unit wave of pressure, from three waves that decay with depth: a gradient,
    Papkovich's of classical elasticity with psi the rotation, and one of the spin between the two.
    """
    mu, mu_c, nu = solid.mu, solid.mu_c, solid.nu
    lam = 2 * mu * nu / (1 - 2 * nu)
    rate2 = 4 * mu_c / (solid.curvature * solid.ell**2 * (mu + mu_c))  # of moments against the spin
    s = np.sqrt(k**2 + rate2)
    # u1, u2, their slopes in depth, psi's and the spin, at the surface, under exp(i k x1)
    gradient = (1j * k, k, 1j * k**2, k**2, 0, 0)
    classical = (0, 3 - 4 * nu, -1j * k, k * (2 - 4 * nu), 1j * k**2 * (2 - 2 * nu), 0)
    spin = -mu / (2 * mu_c) * rate2
    rotation = (s, -1j * k, s**2, -1j * k * s, s * (spin - rate2 / 2), spin)
    conditions, raised = [], []
    for u1, u2, u1_slope, u2_slope, psi_slope, spin in (gradient, classical, rotation):
        shear = mu * (u1_slope + 1j * k * u2) + 2 * mu_c * spin
        conditions.append((lam * (1j * k * u1 + u2_slope) + 2 * mu * u2_slope, shear, psi_slope))
        raised.append(u2)
    return float(-(np.array(raised) @ np.linalg.solve(np.array(conditions).T, (-1.0, 0, 0))).real)


def difference(values, reference):
    """Relative in L2, at places that stand for equal lengths."""
    return float(np.sqrt(np.sum((values - reference) ** 2) / np.sum(reference**2)))


@pytest.mark.parametrize("rtol", [1e-2, 1e-3, 1e-4])
def test_cells_say_between_centres_what_the_estimate_speaks_of(rtol):
    """Full contact with a wave: the pressure is a wave, by the compliance at its length."""
    k = 2 * np.pi
    state = mb.Contact(mb.HalfPlane(SOLID, period=1.0), WAVE, mb.Unilateral()).solve(load=9.0, rtol=rtol)
    x = np.linspace(-0.5, 0.5, 20001)[1:]
    exact = 9.0 + WAVE.amplitude / compliance(SOLID, k) * np.cos(k * x)
    assert exact.min() > 0  # the contact is full
    assert difference(state.pressure_at(x), exact) <= state.error_estimate <= rtol
    assert state.weights @ state.pressure == pytest.approx(9.0, rel=1e-12)
    assert state.pressure_at(x).mean() == pytest.approx(9.0, rel=1e-9)  # a polygon's, but for its corners


@pytest.mark.parametrize("law", [mb.Unilateral(), mb.Microblock(), mb.Microclamped()])
def test_cells_keep_the_load_and_end_with_their_zones(law):
    """What is read between centres has the load, and nothing outside of the zones."""
    method = mb.Cells(nodes=300, window=(-0.9, 1.1))
    bumpy = mb.Obstacle(lambda x: x**2 / 20 + 0.004 * np.cos(15 * x))
    state = mb.Contact(mb.HalfPlane(SOLID), bumpy, law, method).solve(load=1.0)
    width = state.weights[0]
    # on halves of half cells, between which readings are straight
    x = (state.x[:, None] + width * np.array((-3, -1, 1, 3)) / 8).ravel()
    assert width / 4 * state.pressure_at(x).sum() == pytest.approx(1.0, rel=1e-12)
    outside = ~np.any([(left < x) & (x < right) for left, right in state.zones["contact"]], axis=0)
    assert len(state.zones["contact"]) > 1 and outside.any() and not state.pressure_at(x[outside]).any()


def drawn(number):
    """(problem, load) on a period: a rough wave, a law and a load."""
    rng = np.random.default_rng((SEED, 31, number))
    period, law = float(10 ** rng.uniform(-1, 1)), LAWS[rng.integers(len(LAWS))]
    ell, height = period * 10 ** rng.uniform(-2, -0.5), 0.01 * period * 10 ** rng.uniform(-0.7, 0.3)
    solid = mb.Cosserat(E=100, nu=rng.uniform(0, 0.45), beta=10 ** rng.uniform(-1, 0.25), ell=ell)
    waves, phases = rng.normal(size=6) / np.arange(1, 7) ** 1.5, rng.uniform(0, 2 * np.pi, 6)

    def rough(x):
        angles = 2 * np.pi / period * np.arange(1, 7)[:, None] * np.asarray(x) + phases[:, None]
        return height * waves @ np.cos(angles)

    body = mb.HalfPlane(solid, period=period)
    obstacle = mb.Deformable(body, rough) if rng.random() < 0.3 else rough
    return mb.Contact(body, obstacle, law), float(solid.E_star * height * 10 ** rng.uniform(-1.3, 1.2))


def moment(state, x):
    """Of the corners' pressures at x, of a reaction as a polygon."""
    if len(state.pressures) > 1:
        levers = state.law.levers(x)
        return state.solid.ell / 2 * sum(levers[name] * state.pressure_at(x, name) for name in levers)
    return np.interp(x, state.x, state.micromoment)


@pytest.mark.parametrize("number", range(8))
def test_estimates_hold_for_what_is_read(number):
    """Against cells some thirty times finer: pressure, and micromoment over ell."""
    problem, load = drawn(number)
    period, ell = problem.body.period, problem.solid.ell
    state = problem.solve(load=load, rtol=1e-2)
    finer = problem.with_(method=mb.Cells(nodes=max(2**14, 16 * len(state.x)))).solve(load=load)
    x = np.linspace(-period / 2, period / 2, 100001)[1:]
    total = finer.pressure_at(x)
    moments = [moment(one, x) / ell for one in (state, finer)]
    error = max(difference(state.pressure_at(x), total), difference(total + np.subtract(*moments), total))
    assert error <= state.error_estimate <= 1e-2


@pytest.mark.parametrize("load", [1e-7, 1e-4])
def test_light_loads_on_few_cells_are_not_estimated_as_nothing(load):
    """A contact of a cell has the load on every grid: that the load agrees says nothing of the pressure."""
    problem = mb.Contact(mb.HalfPlane(SOLID, period=1.0), WAVE, mb.Unilateral())
    coarse = problem.with_(method=mb.Cells(nodes=256)).solve(load=load)
    finer = problem.with_(method=mb.Cells(nodes=2**15)).solve(load=load)
    x = np.linspace(-0.01, 0.01, 400001)
    assert difference(coarse.pressure_at(x), finer.pressure_at(x)) <= coarse.error_estimate


def test_nothing_that_holds_a_rotation_is_said_early():
    solid = mb.Cosserat(E=100, nu=0.3, beta=0, ell=0.1)
    with pytest.raises(mb.BadArgument, match="nothing holds the rotation") as refused:
        mb.Contact(mb.HalfPlane(solid, period=1.0), WAVE, mb.Microblock()).solve(load=0.5)
    assert refused.value.name == "beta"


@pytest.mark.parametrize("load", [0.557, 0.558, 0.5596, 0.56])
def test_just_before_a_zone_is_born(load):
    """The trial zones have one more, which vanishes; no error is infinite."""
    solid = mb.Cosserat(E=100, nu=0, beta=0.05, ell=0.2555)

    def height(x):
        x = np.asarray(x)
        return np.minimum(x**2 / 20, 2e-4 + (x - 0.2) ** 2 / 2 / 0.00511)

    problem = mb.Contact(mb.HalfPlane(solid), height, mb.Unilateral())
    state = problem.solve(load=load, rtol=1e-3)
    assert state.method == "panels" and state.error_estimate <= 1e-3
    assert len(state.zones["contact"]) == 2 + (load > 0.5598)
    exact, x = problem.solve(load=load, rtol=1e-7), np.linspace(-0.3, 0.3, 20001)
    assert difference(state.pressure_at(x), exact.pressure_at(x)) <= state.error_estimate + 1e-7


def bumpy(x):
    return np.asarray(x) ** 2 / 20 + 0.002 * np.cos(9 * np.asarray(x))


USES = {  # what happens to a problem before it is asked again
    "copied": copy.copy,
    "copied deeply": copy.deepcopy,
    "pickled": lambda problem: pickle.loads(pickle.dumps(problem)),
    "solved by another method": lambda problem: problem.with_(method=OTHER).solve(load=0.4) and problem,
    "asked for a path": lambda problem: problem.path(load=0.3).at(0.2) and problem,
}
OTHER = mb.Cells(nodes=128)
CALM = mb.HalfPlane(mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1))
AGAIN = mb.HalfPlane(CALM.solid, period=1.0)
ASKED = {  # body, obstacle, method, and the tolerances that are asked for
    "panels": (CALM, mb.Cylinder(R=10), None, (1e-3, 1e-6)),
    "rough panels": (CALM, bumpy, None, (1e-3,)),
    "panels, second body": (CALM, mb.Deformable(CALM, mb.Cylinder(R=10)), None, (1e-3,)),
    "cells": (CALM, bumpy, mb.Cells(), (2e-2, 5e-3)),
    "cells of a number": (CALM, bumpy, mb.Cells(nodes=200, window=(-0.8, 0.8)), (None,)),
    "period": (AGAIN, WAVE, None, (2e-2, 2e-3)),
    "period of a number": (AGAIN, WAVE, mb.Cells(nodes=150), (None,)),
    "period, second body": (AGAIN, mb.Deformable(AGAIN, WAVE), None, (2e-2, 5e-3)),
}


@pytest.mark.parametrize("law", [mb.Unilateral(), mb.Microblock()])
@pytest.mark.parametrize("name", ASKED)
def test_what_was_asked_before_changes_no_answer(name, law):
    """In shuffled order, after copies, pickles, paths and other methods, and from any state."""
    body, obstacle, method, tolerances = ASKED[name]
    rng = np.random.default_rng((SEED, 34, [*ASKED].index(name)))
    questions = [{"load": load, "rtol": rtol} for load in (0.2, 0.8, 0.21) for rtol in tolerances]
    fresh = [mb.Contact(body, obstacle, law, method).solve(**asked) for asked in questions]
    follows = method is None and body is CALM and law == mb.Unilateral()  # paths of the others take long
    uses = [use for name, use in USES.items() if follows or name != "asked for a path"]
    uses = [use for use in uses if body is AGAIN or use is not USES["solved by another method"]]
    problem, before = mb.Contact(body, obstacle, law, method), None
    for number in rng.permutation([*range(len(questions))] * 2):
        problem, asked, expected = uses[rng.integers(len(uses))](problem), questions[number], fresh[number]
        state = problem.solve(**asked)
        left, right = expected.zones["contact"][0]
        x = left + (right - left) * (np.arange(2000) + 0.5) / 2000  # not at edges, where roots begin
        assert difference(state.pressure_at(x), expected.pressure_at(x)) == 0
        if before is not None:
            state = problem.solve(**asked, initial=pickle.loads(pickle.dumps(before)))
            error = difference(state.pressure_at(x), expected.pressure_at(x))
            assert error <= state.error_estimate + expected.error_estimate  # each is as good as it says
        before = state


def test_a_loose_residual_is_in_the_estimate():
    """Pressures that are solved for to a tenth are not good to a hundredth."""
    methods = (mb.Cells(nodes=1024, residual=residual) for residual in (0.1, 1e-9))
    loose, tight = (mb.Contact(AGAIN, WAVE, mb.Microblock(), one).solve(load=3.0) for one in methods)
    x = np.linspace(-0.5, 0.5, 20001)
    error = difference(loose.pressure_at(x), tight.pressure_at(x))
    assert loose.residual > 1e-6 and error <= loose.error_estimate


def test_messages_name_what_is_asked_too_much():
    solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=1e-12)
    with pytest.raises(mb.BadArgument, match="does not rise enough .* within 0.001"):  # 1e9 blocks
        mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=1), mb.Unilateral()).solve(load=1.0)
    state = mb.Contact(AGAIN, WAVE, mb.Unilateral()).solve(load=0.5)
    for x in (10**400, [0.0, np.inf]):  # no float holds the first
        with pytest.raises(mb.BadArgument, match="must be a"):
            state.pressure_at(x)


def test_what_cells_advise_works(monkeypatch):
    """An rtol that was not reached: the one that is advised is, and no method that a period does not take."""
    monkeypatch.setattr("microblock.halfplane.cell_solver.MOST", 2048)
    problem = mb.Contact(AGAIN, WAVE, mb.Microblock())
    with pytest.raises(mb.NotConverged, match="ask for rtol=") as failure:
        problem.solve(load=0.5, rtol=1e-6)
    assert "Panels" not in str(failure.value)
    assert problem.solve(load=0.5, rtol=failure.value.rtol_reached).error_estimate < 1
