"""An obstacle that deforms: limits, twins, other discretisations, balance, and what refuses it."""

import copy
import pickle

import netgen.occ as occ
import ngsolve as ng
import numpy as np
import pytest
from scipy.integrate import quad

import microblock as mb
from microblock.halfplane import carried
from microblock.halfplane.averages import normal_averages
from microblock.halfplane.cells import CellGrid
from microblock.halfplane.counter import counter_flexibility
from microblock.halfplane.kernels import normal_kernel, normal_symbol, symbol
from tests.states import apart

SOLID = mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1)
OTHER = mb.Cosserat(E=60, nu=0.2, ell=0.2, beta=0.7)
CLASSICAL = mb.Cosserat(E=100, nu=0.3, ell=0.2, beta=0)
STIFF = mb.Cosserat(E=1e12, nu=0.3, ell=0.2, beta=0.5)
GROUND = mb.HalfPlane(SOLID)
CYLINDER = mb.Cylinder(R=10)
ROLLER = mb.Deformable(GROUND, CYLINDER)
LAWS = [mb.Unilateral(), mb.Microclamped(), mb.Microblock(), mb.Microblock(psi0=0.02)]


def slanted(x):
    return 0.1 * (np.cosh(x) - 1) + 0.01 * x


def ids(law):
    return f"{type(law).__name__} {getattr(law, 'psi0', '')}"


def on_panels(solid, shape, law, ell=0.1, **options):
    body = mb.HalfPlane(mb.Cosserat(E=100, nu=0.3, ell=ell, beta=1))
    obstacle = shape if solid is None else mb.Deformable(mb.HalfPlane(solid), shape)
    return mb.Contact(body, obstacle, law, mb.Panels(fallback=False, **options))


# limits


def test_equal_bodies_are_one_on_a_rigid_obstacle_of_half_the_height():
    """The surface between twins stays halfway, by symmetry; pressures at rtol 1e-10."""
    one = on_panels(None, mb.Cylinder(R=20), mb.Unilateral()).solve(load=1.0, rtol=1e-10)
    two = on_panels(SOLID, CYLINDER, mb.Unilateral()).solve(load=1.0, rtol=1e-10)
    assert apart(two, one) < 1e-10
    assert two.half_width == pytest.approx(one.half_width, rel=1e-10)


@pytest.mark.parametrize("law", LAWS, ids=ids)
@pytest.mark.parametrize("shape", [CYLINDER, slanted], ids=["cylinder", "slanted"])
def test_a_body_ten_orders_stiffer_is_rigid(law, shape):
    """Both to rtol 3e-9, their estimates bound what they differ by besides the 1e-10 of the stiffness."""
    rigid = on_panels(None, shape, law).solve(load=1.0, rtol=3e-9)
    stiff = on_panels(STIFF, shape, law).solve(load=1.0, rtol=3e-9)
    assert apart(stiff, rigid) < 1e-9


def test_of_small_blocks_the_contact_is_that_of_hertz_with_both_moduli():
    """Classical bodies differ by a multiple of ell, so that two sizes extrapolate to Hertz: 1e-5 is left."""
    modulus = 1 / (1 / SOLID.E_star + 1 / OTHER.E_star)
    hertz, found = np.sqrt(40 / (np.pi * modulus)), []
    for ell in (0.004, 0.002):
        small = mb.Cosserat(E=60, nu=0.2, ell=ell, beta=0.7)
        found.append(on_panels(small, CYLINDER, mb.Microblock(), ell).solve(load=1.0, rtol=1e-4))
    widths = [state.half_width for state in found]
    assert abs(widths[0] / hertz - 1) > 1e-4 > 10 * abs((2 * widths[1] - widths[0]) / hertz - 1)


def test_a_classical_body_is_the_limit_of_weak_coupling():
    for distance in (1e-6, 0.3, 50.0):
        weak = mb.Cosserat(E=100, nu=0.3, ell=0.2, beta=1e-11)
        values = [normal_kernel(solid, np.array([distance])) for solid in (weak, CLASSICAL)]
        # U changes by c beta (1 - nu) log at most
        assert values[0] == pytest.approx(values[1], rel=1e-9)
    assert normal_symbol(CLASSICAL, np.ones(1))[0] == 0.7 / CLASSICAL.mu


# other discretisations


@pytest.mark.parametrize("law", LAWS, ids=ids)
@pytest.mark.parametrize("ell, solid", [(0.05, OTHER), (0.3, CLASSICAL), (1.0, OTHER)])
def test_panels_and_cells_agree(law, ell, solid):
    """ell/a from 0.1 to 2; cells leave 1/n at the edges, 5e-4 on 2048, four times more on 512."""
    panels = on_panels(solid, slanted, law, ell).solve(load=1.0, rtol=1e-4)
    errors = []
    for nodes in (512, 2048):
        cells = panels.problem.with_(method=mb.Cells(nodes=nodes, window=(-1.6, 1.6))).solve(load=1.0)
        p = panels.pressure_at(cells.x)
        errors.append(np.sqrt(cells.weights @ (p - cells.pressure) ** 2 / (cells.weights @ p**2)))
    assert errors[1] < 1.5e-3 and errors[1] < 0.6 * errors[0]
    x = cells.x[::64]
    apart = [panels.gap_at(name, x) - cells.gap_at(name, x) for name in law.corners]
    # up to the arbitrary level of half-planes
    assert np.ptp(apart) < 1e-5


def test_all_closed_on_a_period_corners_follow_the_waves():
    """Amplitudes of the corners' pressures from the symbols of both bodies, each corner where it stands."""
    ell, k, depth = 0.3, 2 * np.pi, 0.001
    one, other = mb.Cosserat(E=100, nu=0.3, ell=ell, beta=1), mb.Cosserat(E=50, nu=0.1, ell=0.2, beta=1.5)
    obstacle = mb.Deformable(mb.HalfPlane(other, period=1.0), mb.Wave(depth, 1.0))
    method = mb.Cells(nodes=256, residual=1e-12)
    state = mb.Contact(mb.HalfPlane(one, period=1.0), obstacle, mb.Microblock(), method).solve(load=1.0)
    (U,), (V,), (W,) = symbol(one, np.array([k]))
    phase = np.exp(1j * k * np.array((-ell / 2, ell / 2)))  # from the contact point to A and to B
    matrix = [[U + a * b * W + 1j * V * (b - a) for b in (1, -1)] for a in (1, -1)]
    matrix = np.array(matrix) + normal_symbol(other, np.array([k])) * np.outer(phase, phase.conj())
    found = np.linalg.solve(matrix, depth * phase)  # height -depth cos(k x), the pressure cos(k x) and more
    for name, amplitude in zip("AB", found):
        p = state.pressures[name]
        assert p.min() > 0
        wave = 2 * np.mean(p * np.exp(-1j * k * state.x))
        assert wave == pytest.approx(amplitude, rel=1e-8)


def test_averages_over_cells_are_those_of_a_quadrature():
    for solid in (CLASSICAL, OTHER):
        for distance, source, target in (
            (0.0, 0.1, 0.1),
            (0.05, 0.1, 0.02),
            (0.3, 0.1, 0.1),
            (15.0, 0.1, 0.1),
        ):
            half, less = (source + target) / 2, abs(source - target) / 2
            breaks = sorted({-half, half, -less, less, *([-distance] if distance < half else [])})

            def weighed(t):
                share = max(0.0, min(source, target, half - abs(t))) / (source * target)
                return share * normal_kernel(solid, np.array([distance + t]))[0]

            whole = sum(quad(weighed, *pair, epsrel=1e-9)[0] for pair in zip(breaks, breaks[1:]))
            # what the logarithms leave is x^2 log x, by four points on a cell
            found = normal_averages(solid, np.array([distance]), source, target)[0]
            assert found == pytest.approx(whole, rel=2e-4)


# balance and reciprocity


def test_both_bodies_carry_the_same_force_and_moment():
    """Far from the contact the second body shows force and moment of what presses it."""
    state = on_panels(CLASSICAL, slanted, mb.Microblock(), 0.3).solve(load=1.0, rtol=1e-7)
    weights, x = state.weights, state.x
    moment = weights @ (x * state.pressure - state.micromoment)
    shares = [weights @ (p * (x - shift)) for p, shift in zip(state.pressures.values(), (0.15, -0.15))]
    assert sum(shares) == pytest.approx(moment, abs=1e-12) and weights @ state.pressure == pytest.approx(1.0)
    far, c = 300.0, 0.7 / CLASSICAL.mu
    right, left = state.counter_displacement(np.array([far, -far]))
    near = state.counter_displacement(np.array([far, -far]) / 10).mean()
    # of the dipole the next term is (a/far)^2, and 1e-10 that of the edges' q
    assert right - left == pytest.approx(2 * c / np.pi * moment / far, rel=1e-4)
    assert near - (right + left) / 2 == pytest.approx(c / np.pi * np.log(10), rel=1e-3)


def test_work_of_one_pressure_on_the_displacement_of_another_is_mutual():
    rng = np.random.default_rng(3)
    for period in (None, 1.0):
        body = mb.HalfPlane(SOLID, period)
        for law in (mb.Microblock(psi0=0.2), mb.Microblock(), mb.Unilateral()):
            grid = CellGrid(body, -0.5, 0.5, 64)
            flexibility = grid.flexibility(law, OTHER)
            f, g = rng.random((2, *flexibility.shape))
            assert np.sum(f * (flexibility @ g)) == pytest.approx(np.sum(g * (flexibility @ f)), rel=1e-12)
            small = f - f.mean()
            assert np.sum(small * (flexibility @ small)) > 0
    problem = on_panels(OTHER, CYLINDER, mb.Microblock()).solver.problem
    widths = rng.uniform(0.01, 0.2, 30)
    matrix = counter_flexibility(problem, np.cumsum(widths), widths)
    assert np.abs(matrix - matrix.T).max() < 1e-12 * np.abs(matrix).max()


# singular places that are carried on


def test_singularities_fall_off_by_the_factor_of_the_chain():
    """Pressures that are singular at every step of a long chain solve its equations."""
    problem = on_panels(OTHER, mb.Wedge(slope=0.1), mb.Microblock(), 0.1).solver.problem
    sizes = carried.log_sizes(problem, {0: ((-2.0, 2.0),)}, 20)
    places = [x for x in sorted(sizes) if x > 0.1]
    ratios = [abs(sizes[b][0] / sizes[a][0]) for a, b in zip(places, places[1:])]
    # the end of the chain is felt by its neighbours alone
    assert ratios[2] == pytest.approx(carried.decay(problem), rel=1e-3)


@pytest.mark.parametrize("shape", [CYLINDER, mb.Wedge(slope=0.05)], ids=["cylinder", "wedge"])
def test_panels_break_where_singularities_are_carried(shape):
    """With the breaks the error of order 10 is below 1e-5, without them above 1e-4."""
    problem = on_panels(CLASSICAL, shape, mb.Microblock(), 0.25, order=16)
    coarse = problem.with_(method=mb.Panels(fallback=False, order=10)).solve(load=1.0)
    assert apart(coarse, problem.solve(load=1.0)) < 1e-5


def test_zones_meet_with_the_exponent_that_knows_the_second_body():
    """Inner edges go like a power 1/(2 s) of the way to the load of coalescence, on either side."""
    problem = on_panels(OTHER, CYLINDER, mb.Microblock(), 1.0)
    load, error = problem.solver.coalescence()
    assert error < 1e-6 * load
    inner = [problem.solve(load=load * (1 - way), rtol=1e-4).zones["A"][0][0] for way in (1e-2, 1e-3)]
    exponent = np.log(10) / np.log(inner[0] / inner[1]) / 2
    state = problem.solve(load=load, rtol=1e-3).solution
    # the next term is as large as the inner edge's power: 1e-2
    assert carried.meeting_exponent(state.problem, state.all_zones, 0.0) == pytest.approx(exponent, rel=1e-2)


# bodies on meshes


def block(up, spacing, reach, E=100.0):
    """A square above or below x2 = 0 with "contact" for |x1| < reach."""
    size = 6.0
    places = [(size, 0), (size, size), (-size, size), (-size, 0), (-reach, 0), (reach, 0)]
    vertices = [occ.Vertex(occ.Pnt(x, y if up else -y, 0)) for x, y in places]
    edges = [occ.Edge(vertex, vertices[(i + 1) % 6]) for i, vertex in enumerate(vertices)]
    for edge, name in zip(edges, ["side", "back", "side", "free", "contact", "free"]):
        edge.name = name
    edges[4].maxh = spacing
    shape = occ.OCCGeometry(occ.Face(occ.Wire(edges)), dim=2)
    mesh = ng.Mesh(shape.GenerateMesh(maxh=size / 2, grading=0.5))
    return mb.Body(mesh, mb.Cosserat(E=E, nu=0.3, ell=0.3, beta=1), 3, fixed="back")


@pytest.fixture(scope="module")
def lower():
    return block(False, 0.1, 1.0)


@pytest.mark.parametrize("law", LAWS, ids=ids)
def test_on_a_mesh_a_body_ten_orders_stiffer_is_rigid(law, lower):
    stiff = mb.Deformable(block(True, 0.13, 1.3, 1e12), slanted)
    one, two = (mb.Contact(lower, shape, law).solve(load=1.0) for shape in (slanted, stiff))
    assert two.pressure == pytest.approx(one.pressure, abs=1e-8 * one.pressure.max())
    assert two.approach == pytest.approx(one.approach, rel=1e-8)


def test_on_meshes_twins_are_one_on_a_rigid_obstacle_of_half_the_height():
    """Meshes do not match; what is left falls with their elements (5.5 and 11 to the half-width)."""
    errors = []
    for spacing in (0.1, 0.05):
        one = mb.Contact(block(False, spacing, 1.0), mb.Cylinder(R=20), mb.Unilateral()).solve(load=1.0)
        twin = mb.Deformable(block(True, 1.2 * spacing, 1.1), CYLINDER)
        two = mb.Contact(one.problem.body, twin, mb.Unilateral()).solve(load=1.0)
        errors.append(np.sqrt(one.weights @ (two.pressure - one.pressure) ** 2))
        assert two.approach == pytest.approx(2 * one.approach, rel=2e-3)
    errors /= np.sqrt(one.weights @ one.pressure**2)
    assert errors[1] < 0.02 and errors[1] < 0.7 * errors[0]


def test_on_meshes_corners_press_where_they_stand(lower):
    """Against half-planes of the same solids: blocks of 15 half-widths are off by 1e-2 besides the nodes."""
    upper = block(True, 0.12, 1.3, 50.0)
    state = mb.Contact(lower, mb.Deformable(upper, slanted), mb.Microblock()).solve(load=1.0)
    planes = mb.Deformable(mb.HalfPlane(upper.solid), slanted)
    exact = mb.Contact(mb.HalfPlane(lower.solid), planes, mb.Microblock()).solve(load=1.0)
    p = exact.pressure_at(state.x)
    assert state.weights @ (state.pressure - p) ** 2 < 0.06**2 * (state.weights @ p**2)
    (gaps,) = (state.gap_at("A", state.x[state.pressures["A"] > 0]),)
    # sampled at a place, what is closed in the mean over a node's polynomial
    assert np.abs(gaps).max() < 1e-2 * state.approach
    assert state.residual < 1e-11 and not state.warnings


def test_second_bodies_on_meshes_that_do_not_fit_are_refused(lower):
    upper = block(True, 0.3, 1.3)
    problem = mb.Contact(lower, mb.Deformable(upper, CYLINDER), mb.Microblock())
    with pytest.raises(mb.BadArgument, match="rtol"):
        problem.solve(load=1.0, rtol=0.1)
    with pytest.raises(mb.BadArgument, match="above its contact boundary"):
        mb.Contact(lower, mb.Deformable(lower, CYLINDER), mb.Microblock())
    with pytest.raises(mb.BadArgument, match="reach over all corners"):
        mb.Contact(
            upper.on(lower.mesh), mb.Deformable(block(True, 0.3, 1.0), CYLINDER), mb.Microblock()
        ).solve(1.0)
    assert [event.kind for event in problem.path(load=0.1).events][:2] == ["born", "born"]


# error estimates


def seeded(seed):
    rng = np.random.default_rng([17, seed])
    ell = 10 ** rng.uniform(-0.9, 0)
    nu, nu2 = rng.uniform(-0.2, 0.45, 2)
    beta, beta2 = rng.uniform(0.05, 1.9, 2)
    body = mb.HalfPlane(mb.Cosserat(E=100, nu=nu, ell=ell, beta=beta))
    counter = mb.Cosserat(E=10 ** rng.uniform(1, 4), nu=nu2, ell=0.2, beta=beta2 * rng.integers(2))
    law = [*LAWS, mb.Microblock(psi0=rng.uniform(-0.3, 0.3))][seed % 5]
    shape = [CYLINDER, mb.Wedge(slope=0.05), slanted][rng.integers(3)]
    obstacle = mb.Deformable(mb.HalfPlane(counter), shape)
    return mb.Contact(body, obstacle, law, mb.Panels(fallback=False)), 10 ** rng.uniform(-0.5, 0.7)


@pytest.mark.nightly(20, 2, 3, 4, 5, 11)  # one of each law, and where the estimate is least above the error
def test_error_estimates_hold(seed):
    problem, load = seeded(seed)
    state, fine = (problem.solve(load=load, rtol=rtol) for rtol in (1e-3, 1e-5))
    assert apart(state, fine) <= state.error_estimate <= 1e-3


# what takes it, and what refuses it


def test_a_punch_that_deforms_is_left_to_cells():
    """At its edges zones open again and again."""
    problem = on_panels(OTHER, mb.Punch(half_width=0.5), mb.Microblock(psi0=0.1), 0.4)
    with pytest.raises(mb.NotConverged, match="zones open again and again"):
        problem.solve(load=1.0)
    cells = problem.with_(method=mb.Cells(nodes=512, window=(-1, 1))).solve(load=1.0)
    assert cells.residual < 1e-8
    smooth = on_panels(OTHER, mb.Punch(half_width=0.5), mb.Unilateral()).solve(load=1.0)
    assert smooth.method == "panels"


def test_states_show_the_second_body():
    state = mb.Contact(GROUND, ROLLER, mb.Microblock()).solve(load=1.0)
    surface = state.solution.surface()
    closed = surface.pressures > 0
    assert np.abs(surface.gaps[closed]).max() < 1e-4 * state.half_width**2 / 10
    assert "Deformable" in repr(state.problem.summary()) and state.fields(0.0, -0.1).stress.shape == (2, 2)


def test_heights_and_their_features_are_those_of_the_shape():
    shape = mb.Wedge(slope=0.1)
    both = mb.Deformable(GROUND, shape)
    assert both.height(np.ones(1)) == shape.height(np.ones(1))
    assert (both.kinks, both.jumps, both.even, both.formulas) == ((0.0,), (0.2,), True, True)
    assert not hasattr(both, "ends") and not hasattr(both, "period") and not hasattr(both, "R")
    assert mb.Deformable(GROUND, np.cosh).height(np.zeros(1)) == 1
    for again in (copy.deepcopy(both), pickle.loads(pickle.dumps(both))):
        assert again == both
