"""What someone meets who tries the toolkit with data, meshes and bodies of their own."""

import re

import numpy as np
import pytest
from ngsolve.meshes import MakeStructured2DMesh, MakeStructured3DMesh
from scipy.interpolate import CubicSpline

import microblock as mb
from microblock.fem import fitted_mesh
from microblock.model.law import Law

SOLID = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)
X = np.linspace(-1, 1, 21)
PARABOLA = mb.Obstacle.from_samples(X, X**2 / 20)
PLACES = [
    (mb.HalfPlane(SOLID), (), mb.Unilateral()),
    (mb.HalfPlane(SOLID), (mb.Cells(512),), mb.Microblock()),
    (mb.Block(SOLID, 6.0), (mb.Uniform(h=0.1),), mb.Microblock()),
]


def warned(state, words):
    return sum(words in warning for warning in state.warnings)


@pytest.mark.parametrize(("body", "method", "law"), PLACES)
def test_a_contact_that_reaches_the_last_sample_says_so(body, method, law):
    def samples_reached(load, obstacle=PARABOLA):
        return warned(mb.Contact(body, obstacle, law, *method).solve(load=load), "last sample")

    assert (samples_reached(3.0), samples_reached(12.0)) == (0, 2)
    # a level face has sharp edges that are meant, as a Punch
    face = mb.Obstacle.from_samples([-1.0, 0.1, 1.0], [0.01, 0.01, 0.01])
    assert samples_reached(3.0, face) == samples_reached(3.0, mb.Punch(1.0)) == 0
    # samples over a whole period have no last one
    wave = mb.Obstacle.from_samples(X, -0.001 * np.cos(np.pi * X))
    whole = mb.Contact(mb.HalfPlane(SOLID, period=2.0), wave, law, mb.Cells(64)).solve(load=9.0)
    assert whole.zones["contact"] == [(-1.0, 1.0)] and not warned(whole, "last sample")


@pytest.mark.parametrize(("body", "method", "law"), PLACES)
def test_kinks_between_samples_are_named_with_a_curve_that_has_none(body, method, law):
    def sentences(obstacle, load=3.0):
        state = mb.Contact(body, obstacle, law, *method).solve(load=load)
        return [words for words in state.warnings if words.startswith("straight lines")]

    (words,) = sentences(PARABOLA)
    assert "21 samples" in words and "unbounded at 1" in words and "CubicSpline(x, z)" in words
    assert not sentences(mb.Obstacle(CubicSpline(X, X**2 / 20)))
    # heights on one line within rounding have no kinks
    assert not sentences(mb.Obstacle.from_samples(X, 0.01 * X + 0.3))


def test_jumps_that_the_slope_does_not_have_are_refused():
    """Methods take them as given: of the other sign a pressure was off by 0.9, with an estimate of 0.01. Of a
    place in six digits it was off by 2e-3, with one of 6e-4.
    """
    kinks, jumps = (0.26, 0.3, 0.34), np.array([-0.05, 0.1, -0.05])

    def tent(given, slope=0.05):
        def height(x):
            return x**2 / 20 - np.maximum(0, 0.04 - abs(x - 0.3)) * slope

        return mb.Contact(PLACES[0][0], mb.Obstacle(height, kinks, given), mb.Microblock())

    tent(jumps), tent(None), tent(1e-4 * jumps, 5e-6)  # a jump below what curvature does from side to side
    for given in (-jumps, jumps * (1, 0.5, 1)):
        with pytest.raises(mb.BadArgument, match="jumps by (-0.05 at x = 0.26|0.1 at x = 0.3): mind"):
            tent(given)

    def wedge(kink, jump=0.1, power=2.0):
        obstacle = mb.Obstacle(
            lambda x: 0.05 * abs(x - 1 / 3) + 0.05 * abs(x - 1 / 3) ** power, (kink,), (jump,)
        )
        return mb.Contact(PLACES[0][0], obstacle, mb.Microblock())

    wedge(0.333333333)
    with pytest.raises(mb.BadArgument, match="all their digits"):
        wedge(0.33333)
    for power in (1.05, 1.1, 1.5):  # of which differences beside the kink fall as slowly as the power says
        wedge(1 / 3, power=power)
        for given in (-0.1, 0.05, 0.09, 0.11):
            with pytest.raises(mb.BadArgument, match="jumps by 0.1 at x"):
                wedge(1 / 3, given, power)


PRESS = MakeStructured2DMesh(nx=4, ny=4, mapping=lambda x, y: (2 * x - 1, y - 1))
CUBE = MakeStructured3DMesh(hexes=False, nx=2, mapping=lambda x, y, z: (x, y, z - 1))
CUBOID = mb.Body(CUBE, SOLID, 1, fixed="bottom", contact="top")


class RightToLeft(Law):
    """Microblocks that name their right corner first."""

    corners = ("B", "A")

    def arms(self, points, normals):
        return mb.Microblock().arms(points, normals)[::-1]


REFUSED = {
    "support": (lambda: mb.Body(PRESS, SOLID, fixed="botom"), "fixed", "botom"),
    "prescribed": (lambda: mb.Body(PRESS, SOLID, prescribed={"u1": {"botom": 0}}), "prescribed", "botom"),
    "cylinder": (
        lambda: mb.Contact(CUBOID, mb.Cylinder(R=10), mb.Microblock()),
        "obstacle",
        "height(x) + 0*y",
    ),
    "sliding": (
        lambda: mb.Contact(
            mb.Body(PRESS, SOLID, fixed={"u1": "bottom"}, contact="top"), mb.Cylinder(10.0), mb.Microblock()
        ).solve(load=1.0),
        "fixed",
        "u2 is not fixed on any boundary",
    ),
    "in space": (
        lambda: mb.Contact(
            mb.Body(CUBE, SOLID, 1, fixed={"u3": "bottom"}, contact="top"), mb.Sphere(10.0), mb.Microblock()
        ).solve(load=1.0),
        "fixed",
        "u1 is not fixed on any boundary",
    ),
    "corners": (
        lambda: mb.Contact(mb.HalfPlane(SOLID), mb.Cylinder(10.0), RightToLeft()),
        "law",
        "from left to right",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_slips_are_refused_early_by_their_names(name):
    call, argument, words = REFUSED[name]
    with pytest.raises(mb.BadArgument, match=re.escape(words)) as caught:
        call()
    assert caught.value.name == argument


def test_the_advised_height_presses_a_body_in_space():
    state = mb.Contact(CUBOID, lambda x, y: x**2 / 20 + 0 * y, mb.Microblock()).solve(approach=0.001)
    assert state.load > 0


class TwoWedges:
    even = True

    def height(self, x):
        return 0.02 * np.abs(np.abs(x) - 1)


@pytest.mark.parametrize("most", [1100, 900])  # the levels need 1000 nodes and 1300
def test_levels_out_of_reach_say_what_the_ones_before_reached(most, monkeypatch):
    """Also where not even the first of these fits; and a block of a size is not sent to a half-plane."""
    monkeypatch.setattr(fitted_mesh, "MOST_NODES", most)
    problem = mb.Contact(mb.Block(SOLID, 4.0), TwoWedges(), mb.Unilateral())
    with pytest.raises(mb.NotConverged, match="larger rtol, or take a Body on a mesh") as caught:
        problem.solve(load=1.0, rtol=1e-4)
    assert 1e-4 < caught.value.rtol_reached < 1e-2
    assert problem.solve(load=1.0, rtol=caught.value.rtol_reached).error_estimate


def test_a_refusal_comes_without_the_tracebacks_of_what_was_tried():
    with pytest.raises(mb.NotConverged) as caught:
        mb.Contact(mb.HalfPlane(SOLID), mb.Cylinder(10.0), mb.Microblock()).solve(load=1.0, rtol=1e-14)
    failure = caught.value
    assert failure.rtol_reached and failure.__cause__ is None and failure.__suppress_context__


@pytest.mark.parametrize("name, value", [("kinks", None), ("ends", None), ("kinks", 3), ("kinks", ("a",))])
def test_what_an_obstacle_of_ones_own_has_besides_a_height_is_numbers(name, value):
    """A raw TypeError came back."""
    own = type("Own", (), {"height": lambda self, x: x**2, name: value})()
    with pytest.raises(mb.BadArgument, match=f"{name} = .*: must be a tuple of numbers; leave it out"):
        mb.Contact(mb.HalfPlane(SOLID), own, mb.Microblock())
