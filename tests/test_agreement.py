"""Methods agree: each state is computed once, and compared with that of another method, body or dimension;
load is the slope of the energy, the approach leads back to the load, units and mirror images change nothing.
"""

from functools import cache

import numpy as np
import pytest
from ngsolve.meshes import MakeStructured2DMesh

import microblock as mb
from microblock.fem import meshes, meshes3d
from tests.choice import params
from tests.states import apart

SOLID = mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1)
HALF, BLOCK = mb.HalfPlane(SOLID), mb.Block(SOLID, 4.0)
F = 0.3
LAWS = {
    "microblock": mb.Microblock(),
    "rotated": mb.Microblock(0.005),
    "unilateral": mb.Unilateral(),
    "microclamped": mb.Microclamped(),
}
SHAPES = {
    "cylinder": mb.Cylinder(R=10),
    "wedge": mb.Wedge(0.05),
    "hill": lambda x: x**2 / 20 - 0.05 * np.exp(-(((x - 1.1) / 0.14) ** 2)),
}


def uniform(newton=None):
    return mb.Uniform(h=0.1, order=2, newton=newton)


@cache
def mesh(ell=0.1):
    found = meshes.uniform(meshes.Ground(far=2.0, reach=(-0.6, 0.6), half=False), 0.1)
    return mb.Body(found, mb.Cosserat(E=100, nu=0.3, ell=ell, beta=1), 2, fixed="bottom")


@cache
def cube(order=1):
    x = np.linspace(0, 1, 6 if order == 1 else 3)
    return mb.Body(meshes3d.block(x, x, x - 1), SOLID, order, fixed="bottom")


def bowl(x1, x2):
    return ((x1 - 0.4) ** 2 + (x2 - 0.55) ** 2) / 20


# --- methods with an estimate, beside panels

METHODS = {  # body, method, rtol
    "panels": (HALF, None, 1e-5),
    "cells": (HALF, mb.Cells(window=(-1.4, 1.6)), 2e-2),
    "fitted": (mb.Block(SOLID), None, 1e-2),
}


@cache
def state(method, shape, law):
    body, chosen, rtol = METHODS[method]
    return mb.Contact(body, SHAPES[shape], LAWS[law], chosen).solve(load=1.0, rtol=rtol)


PAIRS = {
    (method, shape, law): {f"{method} {shape}", f"{method} {law}"}
    for method in ("cells", "fitted")
    for shape in SHAPES
    for law in LAWS
}


@pytest.mark.parametrize("method, shape, law", params(PAIRS))
def test_methods_have_the_pressures_of_panels(method, shape, law):
    """By as much as both estimates allow, in L2 of pressure and moment; and as many zones of each kind. Each
    method with each shape and with each law; with each of both by `-m nightly`.
    """
    found, panels = state(method, shape, law), state("panels", shape, law)
    assert found.method == method and panels.method == "panels"
    own = {name: len(zones) for name, zones in found.zones.items()}
    assert own == {name: len(zones) for name, zones in panels.zones.items()}
    if method == "fitted" and shape == "wedge":  # where polynomials see less of the logarithm than nodes do
        x = np.linspace(-0.9, 0.9, 400) * panels.half_width
        off = found.pressure_at(x) - panels.pressure_at(x)
        assert np.linalg.norm(off) <= found.error_estimate * np.linalg.norm(panels.pressure_at(x))
    else:  # beside a logarithm the mean over a cell is not the value at its centre
        states = (found, panels) if shape == "wedge" else (panels, found)
        assert apart(*states) <= found.error_estimate + panels.error_estimate


@pytest.mark.parametrize("law", LAWS)
def test_fields_below_the_surface_are_those_of_modes(law):
    """Elements on a block without bounds: 2 % of the largest stress, also where symmetry gives them."""
    x1, x2 = (places.ravel() for places in np.meshgrid((-0.5, -0.13, 0.07, 0.4), (-0.05, -0.3)))
    exact, found = (state(method, "cylinder", law).fields(x1, x2) for method in ("panels", "fitted"))
    size = np.abs(exact.stress).max()
    for name, unit in (("psi", 1 / SOLID.mu), ("stress", 1.0), ("couple_stress", SOLID.ell)):
        assert getattr(found, name) == pytest.approx(getattr(exact, name), abs=0.02 * size * unit), name


# --- one discrete problem, two algorithms

AL = mb.Newton("al")
TWINS = {  # body, methods, obstacle, laws, what rounding and the residuals of both leave
    "uniform mesh": (BLOCK, (uniform(), uniform(AL)), SHAPES["cylinder"], LAWS.values(), 1e-8),
    "triangles": (
        BLOCK, (mb.Uniform(0.2, shape="triangles"), mb.Uniform(0.2, shape="triangles", newton=AL)),
        SHAPES["cylinder"], (mb.Microblock(),), 1e-8,
    ),
    "body": (mesh(), (None, AL), SHAPES["wedge"], LAWS.values(), 1e-8),
    # conjugate gradients to 1e-9 of the gaps, in pressures that nodes beside each other exchange
    "solid": (cube(), (None, mb.Newton()), bowl, (mb.Microblock(), mb.Unilateral()), 1e-6),
    "solid of order 2": (
        cube(2), (None, mb.Newton()), bowl, (mb.Microblock((0.01, lambda x1, x2: 0.02 * x1)),), 1e-6,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", TWINS)
def test_newton_finds_the_condensed_state(name):
    """The augmented Lagrangian on all unknowns, by the load and, in space, by the approach as well."""
    body, methods, obstacle, laws, close = TWINS[name]
    for law in laws:
        one, other = (mb.Contact(body, obstacle, law, method).solve(load=0.5) for method in methods)
        size = one.pressure.max()
        assert other.pressure == pytest.approx(one.pressure, abs=close * size)
        # next to the ends of a contact boundary neighbours share in the reaction to psi = 0
        here = slice(2, -2) if law == mb.Microclamped() else slice(None)
        assert other.micromoment[..., here] == pytest.approx(
            one.micromoment[..., here], abs=(close if here == slice(None) else 1e-3) * size * SOLID.ell
        )
        assert (other.approach, other.energy) == pytest.approx((one.approach, one.energy), rel=close)
        assert other.fields.energy() == pytest.approx(one.fields.energy(), rel=close)


@pytest.mark.parametrize(
    "body, obstacle, rho", [(mesh(), SHAPES["cylinder"], 1e5), (cube(), bowl, 1e4)], ids=["2D", "3D"]
)
def test_the_error_of_the_penalty_falls_like_one_over_rho(body, obstacle, rho):
    """It lets corners penetrate: the approach is larger; the next order in 1/rho is 10 %."""
    exact = mb.Contact(body, obstacle, mb.Microblock()).solve(load=0.25).approach
    off = [
        mb.Contact(body, obstacle, mb.Microblock(), mb.Newton("penalty", times * rho))
        .solve(load=0.25)
        .approach
        - exact
        for times in (1, 10)
    ]
    assert off[1] > 0 and off[0] / off[1] == pytest.approx(10, rel=0.1)


@pytest.mark.parametrize(
    "law", [mb.Microblock(friction=F), mb.Unilateral(friction=F), mb.Microclamped(friction=F)]
)
@pytest.mark.parametrize("coupled", [True, False])
def test_histories_of_newton_are_those_of_the_condensed_body(law, coupled):
    """One discrete problem: rounding, some 1e-13 of the pressure here."""
    pairs = [(1.0, 0.0), (1.0, 0.2), (1.0, 0.29), (1.0, -0.15), (0.6, 0.1)]
    histories = (
        mb.Contact(mesh(0.05), SHAPES["cylinder"], law, method).history(pairs, coupled=coupled).states
        for method in (mb.Newton(), mb.Condensed())
    )
    for newton, condensed in zip(*histories):
        for name in ("pressure", "shear_traction", "micromoment", "slip"):
            size = np.abs(getattr(condensed, name)).max() if name == "slip" else condensed.pressure.max()
            assert getattr(newton, name) == pytest.approx(
                getattr(condensed, name), abs=1e-9 * size + 1e-14
            ), name
        for name in ("approach", "energy", "work", "dissipation", "tangential_approach"):
            assert getattr(newton, name) == pytest.approx(getattr(condensed, name), rel=1e-9, abs=1e-12), name
        assert newton.zones == condensed.zones and 0 < max(newton.residual, condensed.residual) < 1e-9


# --- one problem in two and in three dimensions


def rows(x):
    return 0.05 * (1 - np.cos(2 * np.pi * x / 3)) + 0.01 * np.sin(2 * np.pi * x / 3)


def angle(x):
    return 0.03 * np.sin(4 * np.pi * x / 3 + 0.4) + 0.01


OTHER = mb.Cosserat(E=60, nu=0.2, ell=0.2, beta=0.7, alpha_prime=0.3, beta_prime=-0.2)
LINES = {  # law of the half-plane, of the half-space along x1, and along x2 (rotations are axial)
    "microblock": (mb.Microblock(), mb.Microblock(), mb.Microblock()),
    "rotated": (mb.Microblock(0.02), mb.Microblock(0.02), None),
    "psi0(x)": (
        mb.Microblock(angle), mb.Microblock((0.0, lambda x1, x2: -angle(x1))),
        mb.Microblock((lambda x1, x2: angle(x2), 0.0)),
    ),
    "in levers": (
        mb.Microblock(angle, "levers"), mb.Microblock((0.0, lambda x1, x2: -angle(x1)), "levers"),
        mb.Microblock((lambda x1, x2: angle(x2), 0.0), "levers"),
    ),
    "microclamped": (mb.Microclamped(), mb.Microclamped(), mb.Microclamped()),
}  # fmt: skip


BODIES = {"rigid": None, "two bodies": OTHER}
LINES_OF_BODIES = {(name, bodies): {name, bodies} for name in LINES for bodies in BODIES}


@pytest.mark.parametrize("name, bodies", params(LINES_OF_BODIES))
def test_a_height_of_one_direction_is_contact_of_the_half_plane(name, bodies):
    """By two programs on the same cells, to the residual of both; corners of a second body stand on cells.
    Each law once; with and without a second body by `-m nightly`.
    """
    period, count = 3.0, 32
    second = BODIES[bodies]
    solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.375, alpha_prime=0.3, beta_prime=-0.2)
    cells = mb.Cells(nodes=count, residual=1e-11)

    def solved(body, height, law, load):
        obstacle = mb.Deformable(type(body)(second, period), height) if second else height
        return mb.Contact(body, obstacle, law, cells).solve(load=load)

    plane, along, across = LINES[name]
    line = solved(mb.HalfPlane(solid, period), rows, plane, 0.6)
    for law, place in ((along, 0), (across, 1)):
        if law is None:
            continue
        surface = solved(
            mb.HalfSpace(solid, period), lambda *x, place=place: rows(x[place]), law, 0.6 * period
        )
        fields = [surface.pressure, (-1 if place == 0 else 1) * surface.micromoment[:, 1 - place]]
        for values, exact in zip(fields, (line.pressure, line.micromoment)):
            values = np.moveaxis(values.reshape(surface.shape), place, 0)
            assert values == pytest.approx(np.tile(exact[:, None], count), abs=1e-8 * line.pressure.max())
        assert surface.approach == pytest.approx(line.approach, rel=1e-9)


def test_a_slab_in_plane_strain_is_the_plane_body():
    """One layer of hexahedra with the fields of the plane: the same discrete problem, to its residual."""
    x, depth = np.linspace(-1, 1, 17), np.linspace(-1, 0, 9)
    slab = meshes3d.block(x, np.array([0.0, 0.5]), depth)
    fixed = {name: "bottom" for name in ("u1", "u3", "psi2")}
    fixed |= {name: "bottom|front|back" for name in ("u2", "psi1", "psi3")}
    flat = MakeStructured2DMesh(nx=16, ny=8, mapping=lambda s, t: (2 * s - 1, t - 1))
    flat.ngmesh.SetBCName([*flat.GetBoundaries()].index("top"), "contact")
    solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.2, alpha_prime=0.3, beta_prime=0.5)
    for order, law in ((1, mb.Microblock(0.02)), (2, mb.Microblock()), (1, mb.Unilateral())):
        body = mb.Body(meshes.ng.Mesh(flat.ngmesh), solid, order, fixed="bottom")
        line = mb.Contact(body, mb.Cylinder(2.0), law).solve(load=8.0)
        body = mb.Body(slab, solid, order, fixed=fixed)
        surface = mb.Contact(body, lambda x1, x2: x1**2 / 4 + 0 * x2, law).solve(load=4.0)
        row, close = np.flatnonzero(surface.x2 == 0), 1e-7 * line.pressure.max()
        assert surface.pressure[row] == pytest.approx(line.pressure, abs=close)
        assert -surface.micromoment[row, 1] == pytest.approx(line.micromoment, abs=close)
        assert -surface.psi[row, 1] == pytest.approx(line.psi, abs=1e-7)
        assert surface.approach == pytest.approx(line.approach, rel=1e-8)


# --- energy, units, mirror images, symmetry

SPACE = mb.HalfSpace(SOLID)
LEVELS = {  # problems with a level of the approach, and an approach
    "mesh": (mb.Contact(BLOCK, SHAPES["wedge"], mb.Microblock(), uniform(AL)), 0.03),
    "half-space": (
        mb.Contact(SPACE, mb.Sphere(10), mb.Microblock(), mb.Cells(nodes=48, window=(-0.7, 0.7))), 0.015,
    ),
    "two half-spaces": (
        mb.Contact(
            SPACE, mb.Deformable(mb.HalfSpace(OTHER), mb.Sphere(10)), mb.Microblock(),
            mb.Cells(nodes=32, window=(-0.9, 0.9)),
        ), 0.03,
    ),
    "solid": (mb.Contact(cube(), bowl, mb.Microblock()), 0.01),
}  # fmt: skip


@pytest.mark.parametrize("name", LEVELS)
def test_the_load_is_the_slope_of_the_energy_and_leads_back_to_the_approach(name):
    """Central differences of steps of 1/150, their square, and corners that open or close meanwhile."""
    problem, approach = LEVELS[name]
    low, found, high = (problem.solve(approach=approach * (1 + step / 150)) for step in (-1, 0, 1))
    assert (high.energy - low.energy) / (approach / 75) == pytest.approx(found.load, rel=5e-4)
    back = problem.solve(load=found.load)
    assert back.approach == pytest.approx(approach, rel=1e-6)
    assert back.pressure == pytest.approx(found.pressure, abs=1e-5 * found.pressure.max())


UNITS = {  # body and method of a length, rtol, what a mirror image may differ by
    "panels": (lambda solid, size: (mb.HalfPlane(solid), None), 1e-4, 2e-4),
    "cells": (lambda solid, size: (mb.HalfPlane(solid), mb.Cells(400, (-size, size))), None, 1e-8),
    "mesh": (lambda solid, size: (mb.Block(solid, 4 * size), mb.Uniform(0.1 * size)), None, 1e-8),
    "Newton": (
        lambda solid, size: (mb.Block(solid, 4 * size), mb.Uniform(0.1 * size, newton=AL)), None, 1e-8,
    ),
    # cells and their edges are others in a mirror: what both say of themselves
    "friction on cells": (lambda solid, size: (mb.HalfPlane(solid), None), 0.1, 0.2),
    "friction on a mesh": (
        lambda solid, size: (mb.Block(solid, 4 * size), mb.Uniform(0.1 * size)), None, 1e-8,
    ),
}  # fmt: skip


def moved(method, modulus=1.0, length=1.0, sign=1):
    """Pressure, or the shear traction, and a gap of a skew problem in other units, or of its mirror image."""
    solid = mb.Cosserat(100 * modulus, 0.3, 0.1 * length, beta=1)

    def height(x):
        x = sign * np.asarray(x, float) / length
        return length * (x**2 / 20 + 0.003 * np.sin(7 * x + 1))

    body, chosen = UNITS[method][0](solid, length)
    rubs, rtol, size = F * ("friction" in method), UNITS[method][1], modulus * length
    problem = mb.Contact(body, height, mb.Microblock(0.0 if rubs else sign * 0.005, friction=rubs), chosen)
    pairs = [(size, 0.0), (size, 0.2 * sign * size), (0.8 * size, -0.1 * sign * size)]
    found = problem.history(pairs, rtol=rtol).states[-1] if rubs else problem.solve(load=size, rtol=rtol)
    x = sign * length * np.linspace(-0.5, 0.5, 150)
    values = sign * np.interp(x, found.x, found.shear_traction) if rubs else found.pressure_at(x)
    return values / modulus, found.gap_at("AB"[::sign][0], x) / length


LONG = {"friction on cells"}  # as long as all the others


@pytest.mark.parametrize(
    "method", [pytest.param(name, marks=[pytest.mark.nightly] * (name in LONG)) for name in UNITS]
)
def test_units_and_mirror_images_change_nothing(method):
    """In other units to 1e-5, as edges are driven to less than rtol from starts that rounding moves; mirrored
    by the accuracy of the method. Friction on cells by `-m nightly`.
    """
    pressure, gap = moved(method)
    for change, close in (({"modulus": 1e9, "length": 1e-3}, 1e-5), ({"sign": -1}, UNITS[method][2])):
        other, other_gap = moved(method, **change)
        assert np.linalg.norm(other - pressure) <= close * np.linalg.norm(pressure), change
        assert np.ptp(other_gap - gap) <= max(close, 1e-6) * np.ptp(gap), change


def below_an_end(unit):
    """Approaches, over the unit of length, on fixed meshes with nodes or corners at the ends of punches."""
    solid, x = mb.Cosserat(E=100, nu=0.3, ell=0.1 * unit, beta=1), np.linspace(-1, 1, 11) * unit
    body = mb.Body(meshes3d.block(x, x, np.linspace(-1, 0, 4) * unit), solid, order=1, fixed="bottom")
    flat = mb.Block(solid, 4.0 * unit)
    problems = [
        *(
            mb.Contact(flat, mb.Punch(a * unit), mb.Microblock(), mb.Uniform(0.05 * unit))
            for a in (0.3, 0.35)
        ),
        mb.Contact(body, mb.FlatPunch(0.4 * unit), mb.Unilateral()),
        mb.Contact(body, mb.FlatPunch(0.55 * unit, "square"), mb.Microblock()),
    ]
    return [one.solve(load=unit ** (2 if one.body is body else 1)).approach / unit for one in problems]


def test_no_unit_decides_whether_a_node_lies_below_an_end():
    """To the residual; approaches were off by 2 to 18 %, where rounding put a node beside an end."""
    known = below_an_end(1.0)
    for unit in (1e3, 7.0):
        assert below_an_end(unit) == pytest.approx(known, rel=1e-6)


def test_a_symmetric_problem_is_the_same_without_the_symmetry():
    """Panels of an even problem and of a mere function, to rtol; a quarter of a body and the whole of it, to
    the residual and corners that are not unique."""
    whole, half = (
        mb.Contact(HALF, obstacle, mb.Microblock()).solve(load=1.0, rtol=1e-6)
        for obstacle in (lambda x: x**2 / 20, mb.Cylinder(10))
    )
    assert whole.unknowns > 1.9 * half.unknowns and apart(half, whole) < 1e-6
    x = meshes3d.graded(reach=0.6, step=0.15, far=2.0, growth=2.0)
    both = np.concatenate((-x[:0:-1], x))
    part, full = (
        mb.Body(meshes3d.block(y, y, -x[::-1], reach=0.6), SOLID, 1, fixed=fixed)
        for y, fixed in ((x, meshes3d.supports("bottom", x1="left", x2="front")), (both, "bottom"))
    )
    found, wanted = (
        mb.Contact(body, mb.Sphere(10), mb.Microblock()).solve(load=load)
        for body, load in ((part, 0.25), (full, 1.0))
    )
    here = (wanted.x1 >= 0) & (wanted.x2 >= 0)
    for name, own in wanted.pressures.items():
        assert found.pressures[name] == pytest.approx(own[here], abs=1e-6 * wanted.pressure.max())
    assert found.approach == pytest.approx(wanted.approach, rel=1e-8)
