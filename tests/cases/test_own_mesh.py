"""Bodies on meshes of a user: equilibrium, and layers between the Winkler foundation and the half-plane."""

import dataclasses

import numpy as np
import pytest

from cases import own_mesh
from cases.closed_forms import ThinLayer

LAYER = ThinLayer(normal=3.0, rotational=0.4, ell=0.6)


def test_the_winkler_foundation_under_a_cylinder():
    """Half-width (3 P R h/(2 K))^(1/3), Johnson, Contact Mechanics, 5.8; no moment where psi is free."""
    x = np.linspace(-2, 2, 40001)
    gaps, weights = np.array([x**2 / 2] * 2), np.full(len(x), x[1] - x[0])
    exact = (3 * 1.7 / (2 * LAYER.normal)) ** (2 / 3) / 2
    assert LAYER.approach(1.7, gaps, weights) == pytest.approx(exact, rel=1e-6)  # trapezoidal rule
    free = dataclasses.replace(LAYER, rotational=0.0).pressures(np.array((0.3 - gaps[0], 0.25 - gaps[0])))
    assert free[0] == pytest.approx(free[1], abs=1e-15)


@pytest.fixture(scope="module")
def states():
    return own_mesh.solve(thicknesses=(0.05, 0.2, 1.5, 6.0), rtol=1e-2)


def test_equilibrium(states):
    for name, state in states.items():
        assert state.error_estimate <= 1e-2
        if name != "half-plane":  # energy of the fields, work of the corners; force of the base
            assert state.fields.energy() == pytest.approx(state.energy, rel=1e-8)
            assert state.reaction("base").force == pytest.approx((0, own_mesh.LOAD), abs=1e-8)


def test_a_hole_widens_the_contact_and_moves_the_load_away(states):
    solid, hole = states["solid block"], states["block with a hole"]
    assert hole.half_width > 1.2 * solid.half_width
    assert hole.weights @ (hole.x * hole.pressure) < -0.1 * hole.load
    assert abs(solid.weights @ (solid.x * solid.pressure)) < 5e-3 * solid.load  # an asymmetric mesh


def test_layers_between_their_limits(states):
    """Differences fall like (h/a)^(3/2) to the foundation, by its edges; like (a/h)^2 to the half-plane."""
    x, half_plane = np.linspace(-1.4, 1.4, 4001), states["half-plane"]

    def off(h, limit):
        return np.linalg.norm(states[f"h = {h:g}"].pressure_at(x) - limit) / np.linalg.norm(limit)

    thin, thinner = (off(h, own_mesh.foundation(x, h, half_plane.solid)) for h in (0.2, 0.05))
    thick, thicker = (off(h, half_plane.pressure_at(x)) for h in (1.5, 6.0))
    assert thinner < 0.4 * thin < 0.02 and thicker < thick / 10 + 1e-2
