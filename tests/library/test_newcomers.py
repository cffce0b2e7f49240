"""What someone meets who tries the toolkit with data, meshes and bodies of their own."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import microblock as mb

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
        return [words for words in state.warnings if "straight lines" in words]

    (words,) = sentences(PARABOLA)
    assert "21 samples" in words and "unbounded at 1" in words and "CubicSpline(x, z)" in words
    assert not sentences(mb.Obstacle(CubicSpline(X, X**2 / 20)))
    # heights on one line within rounding have no kinks
    assert not sentences(mb.Obstacle.from_samples(X, 0.01 * X + 0.3))
