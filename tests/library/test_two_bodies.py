"""An obstacle that deforms: closed forms, quadrature, balance, reciprocity, exponents, meshes, estimates."""

import netgen.occ as occ
import ngsolve as ng
import numpy as np
import pytest

import microblock as mb
from microblock.halfplane.kernels import normal_symbol, symbol
from microblock.halfplane.transmitted_singularities import log_sizes
from microblock.model.problem import Problem
from tests.states import apart

OTHER = mb.Cosserat(E=60, nu=0.2, ell=0.2, beta=0.7)
CYLINDER = mb.Cylinder(R=10)
LAWS = [mb.Unilateral(), mb.Microclamped(), mb.Microblock(), mb.Microblock(psi0=0.02)]


def slanted(x):
    return 0.1 * (np.cosh(x) - 1) + 0.01 * x


def on_panels(solid, shape, law, ell=0.1, **options):
    body = mb.HalfPlane(mb.Cosserat(E=100, nu=0.3, ell=ell, beta=1))
    return mb.Contact(body, mb.Deformable(mb.HalfPlane(solid), shape), law, mb.Panels(**options))


@pytest.mark.parametrize("order", [4, 12])
def test_logarithms_are_carried_as_far_as_panels_of_an_order_see(order):
    """A digit for each four points: of all that a tip carries those above 10^(-order/4) of the largest."""
    here = Problem(
        mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1), mb.Microblock(), mb.Wedge(0.02), counter=OTHER
    )
    zones = {0: ((-1.5, 1.4),), 1: ((-1.4, 1.5),)}

    def found(order):
        places = log_sizes(here, zones, order).items()
        return {(place, corner): size for place, own in places for corner, size in own.items()}

    every, carried = found(100), found(order)
    least = 10 ** (-order / 4) * max(map(abs, every.values()))
    # the two tips carry to the same places, each as far
    assert all(abs(size - carried.get(at, 0.0)) <= least for at, size in every.items())
    assert all(abs(size) >= least for size in carried.values()) and len(carried) < len(every)


def test_of_small_blocks_the_contact_is_that_of_hertz_with_both_moduli():
    """Bodies differ by a multiple of ell, so that two sizes extrapolate to Hertz: 1e-5 is left."""
    hertz, found = np.sqrt(40 / np.pi * (1 / OTHER.E_star + (1 - 0.3**2) / 100)), []
    for ell in (0.004, 0.002):
        small = mb.Cosserat(E=60, nu=0.2, ell=ell, beta=0.7)
        state = on_panels(small, CYLINDER, mb.Microblock(), ell).solve(load=1.0, rtol=1e-4)
        found.append(state.half_width / hertz - 1)
    assert abs(found[0]) > 1e-4 > 10 * abs(2 * found[1] - found[0])


def test_all_closed_on_a_period_corners_follow_the_waves():
    """Amplitudes of the corners' pressures from the symbols of both bodies, each corner where it stands."""
    ell, k, depth = 0.3, 2 * np.pi, 0.001
    one, other = mb.Cosserat(E=100, nu=0.3, ell=ell, beta=1), mb.Cosserat(E=50, nu=0.1, ell=0.2, beta=1.5)
    obstacle = mb.Deformable(mb.HalfPlane(other, period=1.0), mb.Wave(depth, 1.0))
    method = mb.Cells(nodes=256, residual=1e-12)
    state = mb.Contact(mb.HalfPlane(one, period=1.0), obstacle, mb.Microblock(), method).solve(load=1.0)
    (U,), (V,), (W,) = symbol(one, np.array([k]))
    phase = np.exp(1j * k * np.array((-ell / 2, ell / 2)))  # from the contact point to A and to B
    matrix = np.array([[U + a * b * W + 1j * V * (b - a) for b in (1, -1)] for a in (1, -1)])
    matrix = matrix + normal_symbol(other, np.array([k])) * np.outer(phase, phase.conj())
    wanted = np.linalg.solve(matrix, depth * phase)  # height -depth cos(k x), the pressure cos(k x) and more
    for name, amplitude in zip("AB", wanted):
        p = state.pressures[name]
        assert p.min() > 0
        assert 2 * np.mean(p * np.exp(-1j * k * state.x)) == pytest.approx(amplitude, rel=1e-8)  # residual


def block(sign, spacing, E=100.0):
    """A square of 12 above or below x2 = 0 with "contact" for |x1| < 1, or above for 1.3."""
    reach, size = 1.15 + 0.15 * sign, 6.0
    places = [(size, 0), (size, size), (-size, size), (-size, 0), (-reach, 0), (reach, 0)]
    vertices = [occ.Vertex(occ.Pnt(x, sign * y, 0)) for x, y in places]
    edges = [occ.Edge(vertex, vertices[(i + 1) % 6]) for i, vertex in enumerate(vertices)]
    for edge, name in zip(edges, ["side", "back", "side", "free", "contact", "free"]):
        edge.name = name
    edges[4].maxh = spacing
    shape = occ.OCCGeometry(occ.Face(occ.Wire(edges)), dim=2)
    mesh = ng.Mesh(shape.GenerateMesh(maxh=size / 2, grading=0.5))
    return mb.Body(mesh, mb.Cosserat(E=E, nu=0.3, ell=0.3, beta=1), 3, fixed="back")


@pytest.mark.parametrize("law", LAWS[1:3], ids=str)
def test_on_meshes_a_stiff_body_is_rigid_and_twins_meet_halfway(law):
    """Meshes do not match: twins differ by what elements of a tenth of the half-width leave."""
    lower = block(-1, 0.05)
    shapes = CYLINDER, mb.Deformable(block(1, 0.06, 1e12), CYLINDER)
    rigid, stiff = (mb.Contact(lower, shape, law).solve(load=1.0) for shape in shapes)
    assert stiff.pressure == pytest.approx(rigid.pressure, abs=1e-8 * rigid.pressure.max())
    assert stiff.approach == pytest.approx(rigid.approach, rel=1e-8)
    half = mb.Contact(lower, mb.Cylinder(20), mb.Unilateral()).solve(load=1.0)
    twins = mb.Contact(lower, mb.Deformable(block(1, 0.06), CYLINDER), mb.Unilateral()).solve(load=1.0)
    assert twins.approach == pytest.approx(2 * half.approach, rel=2e-3)
    off = np.sqrt(half.weights @ (twins.pressure - half.pressure) ** 2)
    assert off < 0.02 * np.sqrt(half.weights @ half.pressure**2)


def test_on_meshes_corners_press_where_they_stand():
    """Against half-planes of the same solids: blocks of 15 half-widths are off by 1e-2 besides the nodes."""
    lower, upper = block(-1, 0.1), block(1, 0.12, 50.0)
    bodies = (lower, upper), (mb.HalfPlane(lower.solid), mb.HalfPlane(upper.solid))
    state, exact = (
        mb.Contact(one, mb.Deformable(other, slanted), mb.Microblock()).solve(load=1.0)
        for one, other in bodies
    )
    p = exact.pressure_at(state.x)
    assert state.weights @ (state.pressure - p) ** 2 < 0.06**2 * (state.weights @ p**2)
    # sampled at a place, what is closed in the mean over a node's polynomial
    assert np.abs(state.gap_at("A", state.x[state.pressures["A"] > 0])).max() < 1e-2 * state.approach


def seeded(seed):
    rng = np.random.default_rng([17, seed])
    ell, (nu, nu2), (beta, beta2) = (
        10 ** rng.uniform(-0.9, 0),
        rng.uniform(-0.2, 0.45, 2),
        rng.uniform(0.05, 1.9, 2),
    )
    body = mb.HalfPlane(mb.Cosserat(E=100, nu=nu, ell=ell, beta=beta))
    counter = mb.Cosserat(E=10 ** rng.uniform(1, 4), nu=nu2, ell=0.2, beta=beta2 * rng.integers(2))
    law = [*LAWS, mb.Microblock(psi0=rng.uniform(-0.3, 0.3))][seed % 5]
    obstacle = mb.Deformable(
        mb.HalfPlane(counter), [CYLINDER, mb.Wedge(slope=0.05), slanted][rng.integers(3)]
    )
    return mb.Contact(body, obstacle, law, mb.Panels()), 10 ** rng.uniform(-0.5, 0.7)


@pytest.mark.nightly(20, 2, 3, 4, 5, 11)  # one of each law, and where the estimate is least above the error
def test_error_estimates_hold(seed):
    problem, load = seeded(seed)
    state, fine = (problem.solve(load=load, rtol=rtol) for rtol in (1e-3, 1e-5))
    assert apart(state, fine) <= state.error_estimate <= 1e-3
