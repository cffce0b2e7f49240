"""Large and periodic problems on uniform cells: products, contact states, closed forms, commands."""

import importlib.util
import json
import math

import numpy as np
import pytest

import microblock as mb
from cases import classical, rough, wavy
from cases.__main__ import main
from microblock import active_set, projected_cg
from microblock.errors import BadArgument, NotConverged
from microblock.grid import Cells
from microblock.halfplane import gauss_rule, kernels, symbol
from microblock.references import Wavy

SOLID = mb.Cosserat(E=2.0, nu=0.3, ell=0.2, beta=1.0)
STEPS = np.random.default_rng(7).uniform(-0.2, 0.2, 400)


def jagged(x):
    """Rough beyond any smoothness, of either sign."""
    return STEPS[np.round((np.asarray(x) + 2)*97).astype(int) % len(STEPS)]


LAWS = {"unilateral": mb.Unilateral(), "microclamped": mb.Microclamped(), "microblock": mb.Microblock(),
        "rough psi0": mb.Microblock(jagged), "lever": mb.Microblock(jagged, reading="lever")}
OBSTACLES = {"cylinder": mb.Cylinder(1.0), "punch": mb.Punch(0.5, 0.1), "wave": mb.Wave(0.1, 0.3), "jagged": jagged}


def dense(cells, law, obstacle):
    return cells.body.compliance(cells.x, clamped=law.clamps_rotation).corner_system(law, obstacle)


@pytest.mark.parametrize("name", LAWS)
def test_products_are_those_of_the_dense_matrix(name):
    law, cells = LAWS[name], Cells(mb.HalfPlane(SOLID), -1.0, 1.3, 57)
    H, _, _ = dense(cells, law, mb.Cylinder(1.0))
    flexibility = cells.flexibility(law)
    forces = np.random.default_rng(0).standard_normal(flexibility.shape)
    expected = (H @ forces.ravel()).reshape(forces.shape)
    # the same kernels; FFT rounding grows like log n only
    assert np.abs(flexibility @ forces - expected).max() <= 1e-13*np.abs(expected).max()


def test_far_cells_need_fewer_gauss_points():
    table = mb.HalfPlane(SOLID)
    few, (many,) = table.cells(60, 0.07)[:, 40:41], [_averages(table, 40, 0.07)]
    assert few[:, 0] == pytest.approx(many, rel=1e-12, abs=1e-15)      # rounding of the table


def _averages(body, distance, width):
    points, gauss = gauss_rule(40)
    values = kernels(SOLID.nu, SOLID.beta, SOLID.curvature)((distance + points - 0.5)*width/SOLID.ell, range(5)) @ gauss
    return (1 - SOLID.nu)/SOLID.mu*values


@pytest.mark.parametrize("law", [mb.Unilateral(), mb.Microblock(jagged)])
def test_a_period_is_the_sum_of_its_images(law):
    """The symbol at k = 2 pi m/L against cells and many images of theirs, for forces that sum to nothing."""
    period, count, images = 2.0, 64, 60
    periodic = Cells(mb.PeriodicHalfPlane(SOLID, period), -1.0, 1.0, count).flexibility(law)
    x = np.linspace(-1, 1, count, endpoint=False) + 1/count
    smooth = np.array([np.cos(np.pi*x + corner) + 0.3*np.sin(3*np.pi*x) for corner in range(len(periodic.levers))])
    if len(smooth) == 2:      # whole waves in p and m: levers divided out
        a, b = periodic.levers
        smooth = np.array((smooth[1] - b*smooth[0], a*smooth[0] - smooth[1]))/(a - b)
    whole = Cells(mb.HalfPlane(SOLID), -1 - period*images, 1 + period*images, count*(2*images + 1))
    many = np.tile(smooth, 2*images + 1)
    wide = law if not isinstance(law, mb.Microblock) else mb.Microblock(lambda y: jagged((y + 1) % period - 1))
    direct = (whole.flexibility(wide) @ many)[:, count*images:count*(images + 1)]
    found = periodic @ smooth
    direct, found = direct - direct.mean(), found - found.mean()
    # cells see sin(k h/2)/(k h/2) of a wave, 4e-3 at the third; the images left out 1/images
    assert np.abs(found - direct).max() <= 1e-2*np.abs(found).max()


def test_a_uniform_moment_turns_all_blocks_alike():
    """The mean of p does nothing on a period, that of m what the symbol does for k -> 0."""
    flexibility = Cells(mb.PeriodicHalfPlane(SOLID, 1.0), -0.5, 0.5, 40).flexibility(mb.Microblock())
    u, phi = flexibility.surface(np.array([np.full(40, 0.5/40), np.full(40, -0.5/40)]))      # p = 0, m = 1 over the cells
    assert phi == pytest.approx(np.full(40, symbol(SOLID, [1e-9])[2, 0]), rel=1e-6) and np.abs(u).max() < 1e-15
    u, phi = flexibility.surface(np.full((2, 40), 1/40))
    assert np.abs(u).max() < 1e-15 and np.abs(phi).max() < 1e-15      # rounding


@pytest.mark.parametrize("periodic", [False, True])
@pytest.mark.parametrize("name", LAWS)
def test_products_are_symmetric_and_their_preconditioner_positive(name, periodic):
    body = mb.PeriodicHalfPlane(SOLID, 2.3) if periodic else mb.HalfPlane(SOLID)
    flexibility = Cells(body, -1.0, 1.3, 36).flexibility(LAWS[name])
    unit = np.eye(flexibility.levers.size).reshape(-1, *flexibility.shape)
    H = np.array([(flexibility @ one).ravel() for one in unit])
    M = np.array([flexibility.precondition(one).ravel() for one in unit])
    for matrix in (H, M):
        assert np.abs(matrix - matrix.T).max() <= 1e-13*np.abs(matrix).max()      # rounding
    assert np.linalg.eigvalsh(M)[0] > 0
    sums = np.eye(len(H)) - 1/len(H)
    assert np.linalg.eigvalsh(sums @ H @ sums)[1] > 0      # the first is that of the constant, 0


@pytest.mark.parametrize("obstacle", OBSTACLES)
@pytest.mark.parametrize("name", LAWS)
def test_states_agree_with_pivoting(name, obstacle):
    law, cells = LAWS[name], Cells(mb.HalfPlane(SOLID), -1.0, 1.3, 121)
    H, g0, _ = dense(cells, law, OBSTACLES[obstacle])
    for load in (0.01, 0.5):
        expected = active_set.solve(H, g0, load=load)
        found = projected_cg.solve(cells.flexibility(law), g0.reshape(len(law.corners), -1), load=load, rtol=1e-12)
        # residual times the condition of H on zero-sum vectors, some hundreds here
        assert np.abs(found.forces.ravel() - expected.forces).max() <= 1e-9*expected.forces.max()
        assert found.approach == pytest.approx(expected.approach, rel=1e-10, abs=1e-12)
        assert found.load == pytest.approx(load, rel=1e-13) and found.kkt <= 1e-12


def test_given_approach():
    law, cells = LAWS["rough psi0"], Cells(mb.PeriodicHalfPlane(SOLID, 2.3), -1.0, 1.3, 121)
    flexibility, g0 = cells.flexibility(law), np.array([mb.Wave(0.1, 2.3).height(cells.x)]*2)
    at_load = projected_cg.solve(flexibility, g0, load=0.05, rtol=1e-12)
    again = projected_cg.solve(flexibility, g0, approach=at_load.approach, rtol=1e-12)
    assert again.forces == pytest.approx(at_load.forces, abs=1e-9*at_load.forces.max())
    apart = projected_cg.solve(flexibility, g0, approach=-0.01)
    assert apart.load == 0 and apart.gaps == pytest.approx(g0 + 0.01)
    assert projected_cg.solve(flexibility, g0, load=0).approach == g0.min()


def test_indefinite_level_is_refused_by_name():
    cells = Cells(mb.HalfPlane(SOLID), -200.0, 200.0, 64)      # -log x < 0 far away
    with pytest.raises(BadArgument, match="give the load instead"):
        projected_cg.solve(cells.flexibility(mb.Unilateral()), cells.x[None]**2/1e3, approach=1.0)


def test_residual_out_of_reach(monkeypatch):
    monkeypatch.setattr(projected_cg, "OUTER_STEPS", 2)
    cells = Cells(mb.HalfPlane(SOLID), -1.0, 1.0, 64)
    with pytest.raises(NotConverged, match="relative residual") as failure:
        projected_cg.solve(cells.flexibility(mb.Unilateral()), cells.x[None]**2, load=0.5)
    assert 1e-10 < failure.value.reached < 1 and failure.value.iterations == 2


def test_energy_never_rises(monkeypatch):
    """What the proof rests on, watched on a rough problem."""
    law, cells = LAWS["rough psi0"], Cells(mb.HalfPlane(SOLID), -1.0, 1.3, 400)
    flexibility, g0 = cells.flexibility(law), np.array([jagged(cells.x), jagged(cells.x + 0.3)])
    seen, search = [], projected_cg._projected_search

    def watched(problem, *arguments):
        forces, slope = search(problem, *arguments)
        seen.append(forces @ (problem.g0 + slope)/2)
        return forces, slope

    monkeypatch.setattr(projected_cg, "_projected_search", watched)
    projected_cg.solve(flexibility, g0, load=0.5)
    assert len(seen) > 3 and np.diff(seen).max() <= 1e-12*np.abs(seen).max()      # rounding


def classical_wave():
    return wavy.Parameters().scene("unilateral", wavy.CLASSICAL_BETA)


@pytest.mark.parametrize("mean", [0.02, 0.3, 0.95])
def test_westergaard_and_the_order(mean):
    errors = []
    for nodes in (200, 400, 800, 1600):
        state = classical_wave().at(mean, nodes=nodes)
        errors.append(wavy.polygon_error(state.x, state.pressures[0], Wavy(1.0, 1.0, mean).pressure))
        assert errors[-1] <= 1.1*state.error_estimate      # 150 seeded states: at most 1.001
    order = -np.polyfit(np.log([200, 400, 800, 1600]), np.log(errors), 1)[0]
    assert order == pytest.approx(1, abs=0.35)      # roots at edges, which fall on the cells anyhow
    assert state.zones[0] == pytest.approx(np.array([[-1, 1]])*Wavy(1.0, 1.0, mean).half_width, abs=1/1600)


def test_westergaard_closes():
    for mean in (1.0, 1.7):
        state = classical_wave().at(mean, nodes=256)
        exact = Wavy(1.0, 1.0, mean).pressure(state.x)
        assert state.pressures[0] == pytest.approx(exact, abs=1e-8)      # linear then: the residual asked for
        assert state.approach == pytest.approx(wavy.AMPLITUDE, rel=1e-8)      # the mean level of the wave
    with pytest.raises(BadArgument, match="mean height"):
        classical_wave().at(approach=1.01*wavy.AMPLITUDE, nodes=256)      # no load presses deeper than the mean
    half = Wavy(1.0, 1.0, 0.5)
    assert half.pressure(np.linspace(-0.5, 0.5, 100001)).mean() == pytest.approx(0.5, rel=1e-4)      # rectangles
    assert half.half_width == pytest.approx(0.25)


def test_microblocks_close_where_their_waves_say():
    parameters = wavy.Parameters(ell_over_wavelength=0.2)
    closure, (p1, m1) = wavy.full_closure(parameters.solid(1.0))
    scene = parameters.scene("microblock", 1.0)
    state = scene.at(1.001*closure, nodes=512)
    assert np.all(state.pressures > 0)
    phase = 2*np.pi*state.x
    # linear then, and the symbol exact on the grid: the residual asked for
    assert state.pressures.sum(axis=0) == pytest.approx(1.001*closure + p1*np.cos(phase), abs=1e-7)
    assert state.micromoment == pytest.approx(0.1*m1*np.sin(phase), abs=1e-8)
    assert not np.all(scene.at(0.999*closure, nodes=512).pressures > 0)


def test_agrees_with_fitted_panels():
    solid = mb.Cosserat(E=2*(1 - 0.09), nu=0.3, ell=0.25, beta=1)
    for law in (mb.Microblock(0.02), mb.Microclamped()):
        fitted = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(1.0), law).at(1.5, rtol=1e-6)
        state = mb.GridContact(mb.HalfPlane(solid), mb.Cylinder(1.0), law, (-1.5, 1.5)).at(1.5, rtol=2e-3)
        exact = sum(fitted.pressure(corner, state.x) for corner in range(len(law.corners)))
        assert np.linalg.norm(state.pressures.sum(axis=0) - exact) <= state.error_estimate*np.linalg.norm(exact)
        assert state.error_estimate <= 2e-3
        moment = np.interp(fitted.x, state.x, state.micromoment)
        assert np.abs(moment - fitted.micromoment).max() <= 0.03*np.abs(moment).max()      # roots at edges, pointwise
        some = slice(None, None, 40)
        assert state.psi[some] == pytest.approx(fitted.rotation(state.x[some]), abs=1e-3*max(np.abs(state.psi).max(), 1e-9))
        assert state.energy == pytest.approx(fitted.energy, rel=1e-4)      # second order in the pressure


def test_far_images_do_not_matter():
    solid = mb.Cosserat(E=2*(1 - 0.09), nu=0.3, ell=0.25, beta=1)
    alone = mb.GridContact(mb.HalfPlane(solid), mb.Cylinder(1.0), mb.Microblock(), (-1.5, 1.5)).at(1.5, nodes=300)
    period = mb.GridContact(mb.PeriodicHalfPlane(solid, 60.0), mb.Cylinder(1.0), mb.Microblock()).at(1.5, nodes=6000)
    there = np.interp(alone.x, period.x, period.pressures.sum(axis=0))
    # images bend the surface by (pi a/L)^2 = 3e-3 of its curvature
    assert np.linalg.norm(there - alone.pressures.sum(axis=0)) <= 1e-2*np.linalg.norm(there)


def test_estimate_holds_on_rough_profiles():
    for seed in (1, 2, 3):
        parameters = rough.Parameters(nodes=1024, shortest=64, ell=0.01, seed=seed)
        state = rough.solve(parameters)
        best = rough.reference(parameters)
        p, q = best.pressures.sum(axis=0), state.pressures.sum(axis=0)
        error = np.linalg.norm(np.interp(best.x, state.x, q) - p)/np.linalg.norm(p)
        assert error <= state.error_estimate <= 10*error      # 48 seeded states: errors 0.19 to 0.54 of the estimate


def test_a_grid_is_refined_until_the_tolerance_holds():
    scene = classical_wave()
    for rtol in (3e-2, 3e-3):
        state = scene.at(0.2, rtol=rtol)
        assert state.error_estimate <= rtol
        assert wavy.polygon_error(state.x, state.pressures[0], Wavy(1.0, 1.0, 0.2).pressure) <= rtol
    near = scene.at(0.21, start=state)
    assert near.error_estimate is None and near.products < 60 and near.load == pytest.approx(0.21)


def test_contact_beyond_the_window_is_said():
    scene = mb.GridContact(mb.HalfPlane(SOLID), mb.Cylinder(1.0), mb.Unilateral(), (-0.3, 0.3))
    with pytest.raises(NotConverged, match="window"):
        scene.at(1.0, nodes=100)
    punch = mb.GridContact(mb.HalfPlane(SOLID), mb.Punch(0.3), mb.Unilateral(), (-0.3, 0.3))
    assert punch.at(1.0, nodes=100).load == pytest.approx(1.0)      # there it ends


@pytest.mark.parametrize("arguments, named", [
    (dict(load=1.0, approach=1.0), "load"), (dict(), "load"), (dict(load=-1.0), "load"), (dict(load=math.nan), "load"),
    (dict(load=1.0, nodes=3), "nodes"), (dict(load=1.0, nodes=100, rtol=0.1), "rtol"), (dict(load=1.0, rtol=2.0), "rtol")])
def test_bad_arguments(arguments, named):
    with pytest.raises(BadArgument) as failure:
        classical_wave().at(**arguments)
    assert failure.value.name == named


def test_bad_scenes():
    for period in (0, -1.0, math.inf):
        with pytest.raises(BadArgument, match="period"):
            mb.PeriodicHalfPlane(SOLID, period)
    with pytest.raises(BadArgument, match="window"):
        mb.GridContact(mb.HalfPlane(SOLID), mb.Cylinder(1.0), mb.Unilateral())
    with pytest.raises(BadArgument, match="window"):
        mb.GridContact(mb.PeriodicHalfPlane(SOLID, 1.0), mb.Cylinder(1.0), mb.Unilateral(), (0, 1))


def test_rough_profile_is_what_it_says():
    profile = mb.Rough(2.0, slope=0.1, waves=(2, 50), seed=3)
    x = np.linspace(0, 2, 4001)
    assert profile.height(x + 2) == pytest.approx(profile.height(x), abs=1e-12)
    assert np.sqrt(np.mean(np.gradient(profile.height(x), x)**2)) == pytest.approx(0.1, rel=1e-3)      # differences
    assert np.array_equal(mb.Rough(2.0, 0.1, waves=(2, 50), seed=3).height(x), profile.height(x))


def test_classical_orders():
    answer = classical.result(classical.Parameters(nodes=(500, 1000, 4000)))
    last = {row["obstacle"]: row for row in answer["runs"] if row["nodes"] == 4000}
    for obstacle, order in (("cylinder", 1), ("wedge", 0.5), ("punch", 0.25)):      # root, logarithm, inverse root at a cell
        assert last[obstacle]["order"] == pytest.approx(order, abs=0.03)
    panels = {row["obstacle"]: row for row in answer["runs"] if row["method"] == "panels"}
    assert panels["cylinder"]["error"] < 1e-4 and panels["punch"]["error"] < 1e-4


def test_commands(tmp_path, capsys):
    words = ["wavy", "--nodes", "256", "--loads", "0.5", "1.2"]
    assert main([*words, "--json", str(tmp_path/"a.json"), "--out", str(tmp_path)]) == 0
    assert "closed everywhere" in capsys.readouterr().out
    answer = json.loads((tmp_path/"a.json").read_text())
    assert [state["load"] for state in answer["states"]] == pytest.approx([0.5, 1.2])
    assert main(["rough", "--nodes", "2048", "--out", str(tmp_path)]) == 0
    assert {"wavy.csv", "wavy.png", "rough.csv", "rough.png"} <= {path.name for path in tmp_path.iterdir()}


@pytest.mark.parametrize("words, named", [
    ("wavy --loads 0", "--loads"), ("wavy --rtol 1e-3 --nodes 100", "--rtol"), ("wavy --beta 2", "--beta"),
    ("rough --nodes 100", "--nodes"), ("rough --psi0-deg 30", "--psi0-deg"), ("classical --nodes 100", "--nodes"),
    ("peers --repeats 0", "--repeats")])
def test_bad_options_get_one_clear_line(words, named, capsys):
    assert main(words.split()) == 2
    printed = capsys.readouterr()
    assert printed.out == "" and printed.err.count("\n") == 1 and named in printed.err


def test_the_comparison_says_what_is_missing(monkeypatch, capsys):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    assert main(["peers"]) == 1
    assert "microblock[bench]" in capsys.readouterr().err


@pytest.mark.parametrize("load", [0.008, 0.03])      # the tilted punch pressed on a part of its width, and on all of it
def test_estimate_holds_beside_ends_of_the_obstacle(load):
    """Without a weight the norm is infinite there: no number of cells met any rtol."""
    from microblock.observables import distance_to_ends
    from microblock.references import tilted_punch
    punch = mb.Punch(1.0, tilt=0.01)
    body = mb.HalfPlane(mb.Cosserat(E=1 - 0.3**2, nu=0.3, ell=0.3, beta=1e-10))
    state = mb.GridContact(body, punch, mb.Unilateral(), window=(-1.3, 1.3)).at(load, rtol=0.05)
    weights, exact = distance_to_ends(state.x, punch.ends, (0.0,)), tilted_punch(state.x, load, 1.0, 0.01, 1.0)[0]
    error = np.sqrt(weights @ (state.pressures[0] - exact)**2/(weights @ exact**2))
    assert error <= state.error_estimate <= 0.05 and len(state.x) < 2**17


def test_westergaards_approach():
    """Against the displacement of his pressure at x = 0 by quadrature, and full closure, where it is the mean level of the wave."""
    from scipy.integrate import quad
    for mean in (0.01, 0.3, 0.9):
        exact = Wavy(1.0, 1.0, mean)
        sunk = quad(lambda x: exact.pressure(x)*math.log(2*math.sin(math.pi*x)), 0, exact.half_width, limit=200)[0]
        assert exact.approach_over_amplitude == pytest.approx(-4*sunk, rel=1e-8)      # quadrature; E* = 1, amplitude 1/pi
    assert Wavy(1.0, 1.0, 1.0).approach_over_amplitude == Wavy(1.0, 1.0, 1.4).approach_over_amplitude == 1.0


@pytest.mark.parametrize("contact", wavy.LAWS)
def test_path_from_first_touch_to_full_closure(contact):
    parameters = wavy.Parameters(path=9, path_nodes=1024, contact=contact)
    rows = wavy.path(parameters)
    own, classical = rows[:9], rows[9:]
    for row in classical:
        assert row["contact_fraction"] == pytest.approx(row["contact_exact"], abs=2/1024)      # a cell at either edge
        assert row["approach"] == pytest.approx(row["approach_exact"], abs=2e-5)      # the cells' width squared
    closure = wavy.closure_of(parameters)
    for row in own:      # all corners that there are
        assert (row["full_contact_fraction"] == 1) == (row["load"] >= closure)
    assert own[0]["contact_fraction"] < 0.05 and own[-1]["load"] > closure > own[0]["load"]
    for name in ("contact_fraction", "approach"):
        assert np.all(np.diff([row[name] for row in own]) >= -1e-12)      # rounding, from full closure on
