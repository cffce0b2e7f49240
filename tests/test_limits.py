"""Limits: each method has the closed forms of classical contact where blocks or coupling vanish, friction has
those of Cattaneo, Mindlin and Spence, and a stiff second body is a rigid obstacle. A row a method.
"""

import math

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipk

import microblock as mb
from microblock.fem import meshes, meshes3d
from tests import closed_forms
from tests.states import apart

P = math.pi / 2  # in the plane with E* = 2 and R = 1: a_Hz = p_Hz = 1
WEAK = mb.Cosserat(E=2 * (1 - 0.3**2), nu=0.3, ell=0.25, beta=1e-8)  # classical but for beta
LINE, SQUARE = mb.HalfPlane(WEAK), mb.Block(WEAK, 18.0)
PRESSED = mb.Cylinder(1.0), mb.Unilateral()
WINDOW = mb.Cells(window=(-1.4, 1.4))
TILTED = mb.Punch(1.0, tilt=0.01), mb.Unilateral()
WAVE = mb.Wave(1 / math.pi, 1.0), mb.Unilateral()  # closes under the mean pressure 2


def on_tilted(x, load):
    return closed_forms.tilted_punch(x, load, 1.0, 0.01, 2.0)[0]


PLANE = {  # problem, load, rtol, closed form, ends where the pressure has no bound, error without rtol
    "panels, cylinder": (mb.Contact(LINE, *PRESSED), P, 1e-6, (closed_forms.hertz, 1.0), (), None),
    "cells, cylinder": (mb.Contact(LINE, *PRESSED, WINDOW), P, 3e-3, (closed_forms.hertz, 1.0), (), None),
    "fitted, cylinder": (mb.Contact(mb.Block(WEAK), *PRESSED), P, 1e-4, (closed_forms.hertz, 1.0), (), None),
    # elements of 1/20 of the half-width, in which the edge lies: h^1.5, and (a/far)^2 of the curvature
    "mesh, cylinder": (
        mb.Contact(SQUARE, *PRESSED, mb.Uniform(0.05, reach=2.0)), P, None,
        (closed_forms.hertz, 1.0), (), 0.02,
    ),
    "two half-planes": (
        mb.Contact(LINE, mb.Deformable(LINE, PRESSED[0]), mb.Unilateral()), P / 2, 1e-6,
        (closed_forms.hertz, 1.0), (), None,
    ),
    "panels, punch": (
        mb.Contact(LINE, mb.Punch(1.0), mb.Unilateral()), P, 1e-4, (closed_forms.punch, 1.0), (-1, 1), None,
    ),
    "panels, wedge": (
        mb.Contact(LINE, mb.Wedge(0.5), mb.Unilateral()), P, 1e-4, (closed_forms.wedge, P), (), None,
    ),
    "panels, tilted punch": (mb.Contact(LINE, *TILTED), 0.03, 1e-4, (on_tilted,), (-1, 1), None),
    # pressed on a part of its width, and on all of it
    "cells, punch in part": (mb.Contact(LINE, *TILTED, WINDOW), 0.016, 0.05, (on_tilted,), (-1, 1), None),
    "cells, tilted punch": (mb.Contact(LINE, *TILTED, WINDOW), 0.06, 0.05, (on_tilted,), (-1, 1), None),
    **{
        f"period, mean {mean}": (
            mb.Contact(mb.HalfPlane(WEAK, period=1.0), *WAVE), 2 * mean, 3e-3,
            (lambda x, load: closed_forms.Wavy(2.0, 1.0, load).pressure(x),), (), None,
        )
        for mean in (0.02, 0.3, 0.95, 1.7)
    },
}  # fmt: skip


@pytest.mark.parametrize("name", PLANE)
def test_plane_contact_is_classical_where_the_coupling_vanishes(name):
    """In L2 between nodes, with the distance to the ends of a punch as weight; beta = 1e-8 is worth 1e-8."""
    problem, load, rtol, (closed_form, *sizes), ends, most = PLANE[name]
    state = problem.solve(load=load, rtol=rtol)
    reach = 0.5 if "period" in name else 1.3 * state.half_width
    x = (np.arange(20000) + 0.5) / 10000 * reach - reach
    weights = np.min([np.ones_like(x), *(np.abs(x - end) for end in ends)], axis=0)
    exact = closed_form(x, load, *sizes)
    error = np.sqrt(weights @ (state.pressure_at(x) - exact) ** 2 / (weights @ exact**2))
    assert error <= (most or state.error_estimate) and (rtol is None or state.error_estimate <= rtol)


def test_a_wave_closes_as_westergaard_says():
    """The approach to a mean pressure, also beyond closure; nodes are linear then: the residual, 1e-8."""
    for mean in (0.3, 1.0, 1.7):
        state = mb.Contact(mb.HalfPlane(WEAK, period=1.0), *WAVE).solve(load=2 * mean, rtol=1e-3)
        exact = closed_forms.Wavy(1.0, 1.0, mean).approach_over_amplitude / math.pi
        assert state.approach == pytest.approx(exact, rel=1e-4 if mean < 1 else 1e-8)


@pytest.mark.parametrize("law", [mb.Microblock(), mb.Unilateral()], ids=str)
def test_edges_tend_to_those_of_hertz_as_the_side_of_blocks(law):
    """First order in ell/a, of which 1 % at ell/a = 1 %."""
    away = []
    for alpha in (0.04, 0.02, 0.01):
        solid = mb.Cosserat(E=WEAK.E, nu=0.3, ell=alpha, beta=1.0)
        away.append(
            abs(mb.Contact(mb.HalfPlane(solid), PRESSED[0], law).solve(load=P, rtol=1e-6).half_width - 1)
        )
    assert np.log2(away[0] / away[2]) / 2 == pytest.approx(1, abs=0.1) and away[2] < 0.01


# --- three dimensions: E* = 1, R = 1 under 4/3: a = d = 1


def small(ell=1e-5, modulus=1.0):
    return mb.Cosserat(E=modulus * (1 - 0.3**2), nu=0.3, beta=1, ell=ell)


SPACE = mb.HalfSpace(small())


def ellipsoid(r):
    return 2 / np.pi * np.sqrt(np.maximum(1 - r**2, 0))


def sneddon(r):
    return np.arccosh(1 / np.minimum(np.maximum(r, 1e-9), 1)) / 2


SURFACES = {  # problem, load, rtol, pressure of the radius, approach
    "sphere": (mb.Contact(SPACE, mb.Sphere(1.0), mb.Unilateral()), 4 / 3, 0.03, ellipsoid, 1.0),
    "sphere, fine": (mb.Contact(SPACE, mb.Sphere(1.0), mb.Unilateral()), 4 / 3, 0.01, ellipsoid, 1.0),
    "cone": (mb.Contact(SPACE, mb.Cone(1.0), mb.Unilateral()), np.pi / 2, 0.1, sneddon, np.pi / 2),
    "two half-spaces": (
        mb.Contact(SPACE, mb.Deformable(SPACE, mb.Sphere(1.0)), mb.Unilateral()), 2 / 3, 0.03,
        lambda r: ellipsoid(r) / 2, 1.0,
    ),
    # blocks far larger than the contact leave U of short waves, 1/(1 + (1 - nu) beta) of the others
    "large blocks": (
        mb.Contact(mb.HalfSpace(small(1e4)), mb.Sphere(1.0), mb.Unilateral()), 4 / 3 * 1.7, 0.03,
        lambda r: ellipsoid(r) * 1.7, 1.0,
    ),
    # the approach is that of the corners, which touch half a block farther out
    "blocks": (
        mb.Contact(mb.HalfSpace(small(1e-3)), mb.Sphere(1.0), mb.Microblock()), 4 / 3, 0.03, ellipsoid, 1.0,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", SURFACES)
def test_a_half_space_is_classical_where_blocks_are_small(name):
    """Read between cells: the error is below the estimate, and not below a quarter of it; the approach to
    1e-3, as stepped edges carry little."""
    problem, load, rtol, exact, approach = SURFACES[name]
    state = problem.solve(load=load, rtol=rtol)
    points = np.stack(np.meshgrid(*[np.linspace(-1.1, 1.1, 700)] * 2), axis=-1).reshape(-1, 2)
    true = exact(np.hypot(*points.T))
    error = np.linalg.norm(state.pressure_at(points) - true) / np.linalg.norm(true)
    assert error <= state.error_estimate <= rtol and (name == "cone" or state.error_estimate < 4 * error)
    assert state.approach == pytest.approx(approach, rel=1e-2 if name == "cone" else 1e-3)


def test_a_body_of_elements_has_hertz_where_blocks_are_small():
    """A quarter of a block of 8 radii, elements of 1/6: the edge of the contact lies within one."""
    x, depth = (meshes3d.graded(reach=reach, step=1 / 6, far=8.0, growth=1.8) for reach in (1.5, 0.6))
    mesh = meshes3d.block(x, x, -depth[::-1], reach=1.5)
    body = mb.Body(mesh, small(1e-3), 1, fixed=meshes3d.supports("bottom", x1="left", x2="front"))
    state = mb.Contact(body, mb.Sphere(1.0), mb.Unilateral()).solve(load=1 / 3)
    exact = ellipsoid(np.hypot(state.x1, state.x2))
    assert np.sqrt(state.weights @ (state.pressure - exact) ** 2 / (state.weights @ exact**2)) < 0.05


# --- second bodies


def slanted(x, *_):
    return 0.1 * (np.cosh(x) - 1) + 0.01 * x


TOUGH = mb.Cosserat(E=1e12, nu=0.3, ell=0.2, beta=0.5)
SOFT = mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1)
SECOND = {  # body, stiff one, shape, method, rtol
    "panels": (mb.HalfPlane(SOFT), mb.HalfPlane(TOUGH), slanted, mb.Panels(), 3e-9),
    "cells": (
        mb.HalfPlane(SOFT), mb.HalfPlane(TOUGH), slanted,
        mb.Cells(nodes=300, window=(-1, 1), residual=1e-12), None,
    ),
    "half-spaces": (
        mb.HalfSpace(SOFT), mb.HalfSpace(TOUGH), mb.Sphere(10), mb.Cells(nodes=32, residual=1e-11), None,
    ),
}  # fmt: skip


@pytest.mark.parametrize("law", [mb.Microblock(0.02), mb.Microclamped()], ids=str)
@pytest.mark.parametrize("name", SECOND)
def test_a_body_ten_orders_stiffer_is_a_rigid_obstacle(name, law):
    """1e-10 of the stiffness, and what either is solved to: together below 1e-9."""
    body, stiff, shape, method, rtol = SECOND[name]
    rigid, found = (
        mb.Contact(body, obstacle, law, method).solve(load=1.0, rtol=rtol)
        for obstacle in (shape, mb.Deformable(stiff, shape))
    )
    worst = np.abs(found.pressure - rigid.pressure).max() if name == "half-spaces" else apart(found, rigid)
    assert worst < 1e-9 * (rigid.pressure.max() if name == "half-spaces" else 1)


@pytest.mark.parametrize("name", ["panels", "half-spaces"])
def test_twins_are_one_body_on_an_obstacle_of_half_the_height(name):
    """The surface between twins of one corner stays halfway, by symmetry; to what either is solved to."""
    body, _, _, method, rtol = SECOND[name]
    shape = mb.Sphere if name == "half-spaces" else mb.Cylinder
    one, two = (
        mb.Contact(body, obstacle, mb.Unilateral(), method).solve(load=1.0, rtol=rtol)
        for obstacle in (shape(20.0), mb.Deformable(body, shape(10.0)))
    )
    assert two.pressure == pytest.approx(one.pressure, abs=1e-8 * one.pressure.max())


# --- friction: E* = 1, R = 1 under pi/4, between equal bodies pi/8: a = 1

F = 0.3


def classical(second, law=None, alpha=1e-5, beta=1.0, method=None):
    body = mb.HalfPlane(mb.Cosserat(E=1 - 0.3**2, nu=0.3, ell=alpha, beta=beta))
    cylinder = mb.Cylinder(R=1.0)
    obstacle = mb.Deformable(body, cylinder) if second else cylinder
    return mb.Contact(body, obstacle, law or mb.Unilateral(friction=F), method)


SHEARS = (0.0, 0.25, 0.5, 0.75, 0.25, -0.25)  # over f P, there and back
WIDTHS = np.sqrt([1, 0.75, 0.5, 0.25, 1 - 0.5 / 2, 1 - 1 / 2])  # of stick (Cattaneo, Mindlin)


@pytest.mark.parametrize(
    "method, beta, rtol, bar",
    [
        (mb.Panels(), 1e-8, 1e-7, 1e-7),
        # cells at an edge are 4e-4 and 1e-4 of the half-width, and fits leave some of that
        (mb.Cells(), 1.0, 1e-2, 2e-4),
        pytest.param(mb.Cells(), 1.0, 3e-3, 1e-4, marks=pytest.mark.nightly),
    ],
    ids=["panels", "cells", "fine cells"],
)
def test_stick_and_slip_are_those_of_cattaneo_and_mindlin(method, beta, rtol, bar):
    """Edges, what is said of their errors, shear traction, slip and dissipation, from full stick and back."""
    load, p0 = np.pi / 8, 0.25
    problem = classical(True, alpha=1e-5 if beta == 1 else 0.2, beta=beta, method=method)
    history = problem.history([(load, share * F * load) for share in SHEARS], rtol=rtol)
    for number, (state, width) in enumerate(zip(history.states, WIDTHS)):
        for name, exact in (("contact", 1.0), ("stick", width)):
            (found,), (errors,) = state.zones[name], state.zone_errors[name]
            off = np.abs(np.subtract(found, (-exact, exact)))
            assert off.max() < bar and (beta < 1 or np.all(off <= errors))
        x, weights = state.x, state.weights
        assert (weights @ state.pressure, weights @ state.shear_traction) == pytest.approx(
            (load, state.shear), abs=1e-9
        )
        if 0 < number < 4:
            roots = (np.sqrt(np.maximum(size**2 - x**2, 0)) for size in (1.0, width))
            q = F * p0 * np.subtract(*roots)
            assert np.sqrt(weights @ (state.shear_traction - q) ** 2 / (weights @ q**2)) < max(rtol, 1e-5)
            ratio = np.maximum(np.abs(x) / width, 1.0)  # the gap beside a smaller contact, of Hertz
            slip = F * width**2 / 2 * (ratio * np.sqrt(ratio**2 - 1) - np.arccosh(ratio))
            inside = state.pressure > 0
            assert state.slip[inside] == pytest.approx(slip[inside], abs=1e-7 if beta < 1 else 1e-3)
            lost = F * (weights @ (state.pressure * slip))
            assert state.dissipation == pytest.approx(lost, rel=max(1e-5, 2 * rtol))


def spence(friction, nu=0.3):
    """Share of the contact that sticks under a rigid cylinder: K'(c)/K(c) = beta_D/f, uncoupled."""
    dundurs = (1 - 2 * nu) / (2 * (1 - nu))
    return brentq(lambda c: ellipk(1 - c * c) / ellipk(c * c) - dundurs / friction, 1e-9, 1 - 1e-12)


@pytest.mark.parametrize(
    "friction",
    [pytest.param(0.2, marks=pytest.mark.nightly), pytest.param(2 / 7, marks=pytest.mark.nightly), 0.5],
)
def test_pressed_alone_a_cylinder_sticks_as_spence_says(friction):
    """Stick grows, so that f p - |q| is a power 3/2 at its edge; cells as above. One of three coefficients;
    `-m nightly` has the others.
    """
    state = classical(False, mb.Unilateral(friction=friction)).history(
        [(np.pi / 4, 0.0)], coupled=False, rtol=1e-3
    )
    (state,), part = state.states, spence(friction)
    assert state.half_width == pytest.approx(1, abs=1e-4)
    assert np.divide(state.zones["stick"][0], state.half_width) == pytest.approx((-part, part), abs=1e-4)


def ground(h, nu, far, reach):
    solid = mb.Cosserat(E=100, nu=nu, ell=0.01, beta=0)
    mesh = meshes.uniform(meshes.Ground(far=far, reach=(-reach, reach), half=False), h)
    return mb.Body(mesh, solid, 2, fixed="bottom"), np.sqrt(4 * 10 / (np.pi * solid.E_star))


def test_meshes_stick_and_slip_as_cattaneo_mindlin_and_spence_say():
    """Classical, and nu = 0.499 hardly moves the surface sideways; edges lie within elements: first order."""
    law, errors = mb.Unilateral(friction=F), []
    for h in (0.1, 0.05):
        body, a = ground(h, 0.499, 6.0, 0.4)
        (_, state) = (
            mb.Contact(body, mb.Cylinder(10.0), law).history([(1, 0), (1, 0.6 * F)], coupled=False).states
        )
        c = a * np.sqrt(0.4)
        outer, inner = (np.sqrt(np.maximum(0, r**2 - state.x**2)) * 2 / (np.pi * a**2) * F for r in (a, c))
        size = state.weights @ outer**2
        errors.append(np.sqrt(state.weights @ (state.shear_traction - outer + inner) ** 2 / size))
    assert errors[1] < 0.6 * errors[0] and errors[1] < 0.24
    assert state.zones["stick"] == [pytest.approx((-c, c), abs=0.05)]
    body, a = ground(0.05, 0.3, 24.0, 0.5)  # a smaller block adds shear of its own
    (state,) = mb.Contact(body, mb.Cylinder(10.0), law).history([(1.0, 0.0)], coupled=False).states
    assert state.zones["stick"] == [pytest.approx((-a * spence(F), a * spence(F)), abs=0.025)]  # half a node
