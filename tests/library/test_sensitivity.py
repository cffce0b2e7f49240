"""Derivatives of readings by moduli beside closed forms, scaling and differences of tight states."""

import re

import pytest

import microblock as mb
from tests.parts import CYLINDER, ELASTIC, SPHERE

SOLID = mb.Cosserat(E=100, nu=0.3, ell=0.085, beta=1)
MODULI = "E", "nu", "ell", "beta", "curvature"
# a window that stays, as squares that follow the contact make other cells of each problem
FIXED = mb.Cells(nodes=48, window=(-0.15, 0.15), residual=1e-12)


def with_modulus(problem, name, value):
    solid = problem.solid
    moduli = {key: getattr(solid, key) for key in MODULI} | {name: value}
    return problem.with_(solid=mb.Cosserat(**moduli))


def difference(problem, load, name, reading, step, rtol):
    """The derivative by four states, free of the third power of the relative step."""
    value = getattr(problem.solid, name)

    def central(h):
        low, high = (
            getattr(with_modulus(problem, name, value * factor).solve(load=load, rtol=rtol), reading)
            for factor in (1 - h, 1 + h)
        )
        return (high - low) / (2 * h * value)

    return (4 * central(step) - central(2 * step)) / 3


@pytest.mark.parametrize("name", MODULI)
@pytest.mark.parametrize("law", [mb.Microblock(0.003), mb.Microclamped()], ids=str)
def test_edges_of_panels(law, name):
    """Tight states are known to 1e-9, and to some 1e-10 at the edges: over the step 1e-7."""
    problem = mb.Contact(mb.HalfPlane(SOLID), CYLINDER, law)
    state = problem.solve(load=1.0, rtol=1e-9)
    tight = difference(problem, 1.0, name, "half_width", 1e-3, 1e-9)
    assert state.sensitivity(name)["half_width"] == pytest.approx(tight, rel=1e-6)


def test_edges_where_places_of_the_obstacle_move_with_the_corners():
    problem = mb.Contact(mb.HalfPlane(SOLID), mb.Wedge(slope=0.02), mb.Microblock())
    state = problem.solve(load=1.0, rtol=1e-7)
    tight = difference(problem, 1.0, "ell", "contact_area", 1e-3, 1e-7)
    assert state.sensitivity("ell")["contact_area"] == pytest.approx(tight, rel=1e-6)


@pytest.mark.parametrize("name", ["E", "ell", "beta"])
@pytest.mark.parametrize(
    "problem, load",
    [
        (mb.Contact(mb.HalfSpace(SOLID), SPHERE, mb.Microblock(), FIXED), 0.01),
        (mb.Contact(mb.HalfSpace(SOLID), SPHERE, mb.Microclamped(), FIXED), 0.01),
        (
            mb.Contact(
                mb.HalfPlane(SOLID, period=1.0),
                mb.Wave(0.01, 1.0),
                mb.Microblock(),
                mb.Cells(nodes=256, residual=1e-12),
            ),
            0.3,
        ),
    ],
    ids=["blocks", "clamped", "period"],
)
def test_the_approach_of_cells(problem, load, name):
    """On cells that stay closed the state is smooth: steps of 1e-5 leave 1e-7."""
    state = problem.solve(load=load)
    tight = difference(problem, load, name, "approach", 1e-5, None)
    assert state.sensitivity(name)["approach"] == pytest.approx(tight, rel=1e-6)


def test_hertz():
    """a ~ ((1 - nu^2)/E)^(1/2) under a cylinder, and d ~ ((1 - nu^2)/E)^(2/3) under a sphere."""
    line = mb.Contact(mb.HalfPlane(ELASTIC), CYLINDER, mb.Unilateral()).solve(load=1.0, rtol=1e-6)
    a = mb.hertz_scales(ELASTIC, R=10, P=1.0)[0]
    assert line.sensitivity("E")["half_width"] == pytest.approx(-a / 200, rel=1e-6)
    assert line.sensitivity("nu")["half_width"] == pytest.approx(-a * 0.3 / 0.91, rel=1e-6)
    point = mb.Contact(mb.HalfSpace(ELASTIC), SPHERE, mb.Unilateral(), mb.Cells(nodes=64)).solve(load=1.0)
    # 1e3 cells in contact: some 1e-3 of the stiffness, of which the derivative is made
    assert point.sensitivity("E")["approach"] == pytest.approx(-2 / 3 * point.approach / 100, rel=3e-3)


@pytest.mark.parametrize("bodies", [1, 2])
def test_the_modulus_acts_as_the_load_does(bodies):
    """States under a rigid obstacle depend on P/E, of two bodies of one solid alike: E dd/dE = -P dd/dP. A
    modulus of the body leaves the other one.
    """
    obstacle = SPHERE
    if bodies == 2:
        obstacle = mb.Deformable(mb.HalfSpace(SOLID), SPHERE)
    state = mb.Contact(mb.HalfSpace(SOLID), obstacle, mb.Unilateral(), mb.Cells(nodes=32)).solve(load=0.01)
    of_load = -state.load / state.stiffness / bodies
    assert SOLID.E * state.sensitivity("E")["approach"] == pytest.approx(of_load, rel=1e-6)


def test_derivatives_jump_where_zones_merge():
    """Two contacts become one, and an edge is no edge any more: on either side differences of states there
    agree with the derivative, to what the other edges curve over the step.
    """
    problem = mb.Contact(mb.HalfPlane(SOLID), CYLINDER, mb.Microblock())
    merged = problem.path(load=0.2).events[-1]
    assert merged.kind == "merged"
    slopes = []
    for part in (0.995, 1.005):
        load = merged.load * part
        state = problem.solve(load=load, rtol=1e-6)
        slopes.append(state.sensitivity("ell")["contact_area"])
        tight = difference(problem, load, "ell", "contact_area", 1e-4, 1e-6)
        assert slopes[-1] == pytest.approx(tight, rel=1e-3)
    assert slopes[1] - slopes[0] > 0.05 * slopes[1]


def test_what_has_none_is_refused_by_name():
    state = mb.Contact(mb.HalfPlane(SOLID), CYLINDER, mb.Unilateral()).solve(load=1.0)
    with pytest.raises(mb.BadArgument, match="modulus = 'G': must be one of E, nu"):
        state.sensitivity("G")
    cells = mb.Contact(mb.HalfPlane(SOLID), CYLINDER, mb.Unilateral(), mb.Cells()).solve(load=1.0)
    with pytest.raises(mb.BadArgument, match=re.escape("Panels(), and Cells() where there is an approach")):
        cells.sensitivity("E")
    classical = mb.Contact(mb.HalfPlane(ELASTIC), CYLINDER, mb.Unilateral()).solve(load=1.0)
    with pytest.raises(mb.BadArgument, match="belongs to a Cosserat solid"):
        classical.sensitivity("ell")
