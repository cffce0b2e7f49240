"""What states of half-planes say is so: their readings, their estimates, and why a state is refused."""

import numpy as np
import pytest

import microblock as mb
from microblock.halfplane import contact_line

SOLID = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.05)
WAVE = mb.Wave(amplitude=0.01, wavelength=1.0)


@pytest.mark.parametrize(("ell", "spacing"), [(0.1, 0.05), (0.3, 0.1), (0.1, 0.1)])
def test_breaks_nearer_than_rounding_are_one(ell, spacing, monkeypatch):
    """With ell a multiple of the spacing corner B meets the samples where A meets others."""
    unknowns = []
    solve_zones = contact_line.solve_zones

    def counted(problem, panels, loads):
        unknowns.append(len(panels.nodes[0]))
        return solve_zones(problem, panels, loads)

    monkeypatch.setattr(contact_line, "solve_zones", counted)
    x = np.arange(-30, 31) * spacing
    samples = mb.Obstacle.from_samples(x, x**2 / 2 + 0.002 * np.sin(7 * x))
    solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=ell)
    state = mb.Contact(mb.HalfPlane(solid), samples, mb.Microblock()).solve(load=1.0)
    assert state.method == "panels" and not state.solution.notes and len(unknowns) <= 5
    assert np.abs(state.solution.panels.h).min() > 1e-9 * spacing  # a panel between two samples, no sliver
    assert np.diff(sorted(state.solution.problem.kinks)).min() > 0.9 * spacing


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
