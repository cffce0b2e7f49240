"""States on the contact line: closed forms, symmetry, scaling, convergence, coalescence, errors held."""

import numpy as np
import pytest

from microblock import (
    BadArgument,
    Cells,
    Contact,
    Cosserat,
    Cylinder,
    HalfPlane,
    Microblock,
    Microclamped,
    NotConverged,
    Obstacle,
    Panels,
    Punch,
    Unilateral,
    Wedge,
)
from microblock.halfplane import contact_line
from microblock.halfplane.kernels import coalescence_exponent
from microblock.model.zones import distance
from tests.states import apart

LOAD = np.pi / 2  # with E* = 2 and R = 1 lengths are over a_Hz and pressures over p_Hz
LAWS = {
    "microblock": Microblock(),
    "rotated": Microblock(0.1),
    "levers": Microblock(-0.05, "levers"),
    "unilateral": Unilateral(),
    "microclamped": Microclamped(),
}
BY_LAW = pytest.mark.parametrize("law", LAWS.values(), ids=LAWS.keys())


def problem(alpha, law, obstacle=Cylinder(1.0), nu=0.3, beta=1.0, order=None):
    solid = Cosserat(E=2 * (1 - nu**2), nu=nu, ell=alpha, beta=beta)
    return Contact(HalfPlane(solid), obstacle, law, Panels(order=order))


@BY_LAW
@pytest.mark.parametrize("alpha", [0.05, 0.25, 1.0])
def test_conditions_26_and_the_load(law, alpha):
    state = problem(alpha, law).solve(load=LOAD, rtol=1e-6)
    assert state.error_estimate <= 1e-6
    assert state.weights @ state.pressure == pytest.approx(LOAD, rel=1e-13)
    assert state.residual < 1e-6  # of the sizes, outside the nodes as well
    for corner, pressure in state.pressures.items():
        closed = pressure > 0
        # collocated at these points; the matrix's conditioning, some 1e4, is left of rounding
        assert np.abs(state.gap_at(corner, state.x[closed])).max() < 1e-9
        assert np.all(pressure > -1e-6)


@pytest.mark.parametrize("alpha", [0.1, 0.25, 0.5])
def test_full_contact_turns_the_blocks_along(alpha):
    state = problem(alpha, Microblock()).solve(load=LOAD, rtol=1e-6)
    ((left, right),) = state.zones["full"]
    x = np.linspace(left, right, 23)[1:-1]
    # g_A = g_B = 0 says psi = x/R in full contact, between the collocation points too
    assert state.solution.rotation(x) == pytest.approx(x, abs=1e-6)


@pytest.mark.parametrize("law", [Microblock(), Unilateral()])
def test_hertz_is_the_limit(law):
    deviations = []
    for alpha in (0.04, 0.02, 0.01):
        state = problem(alpha, law).solve(load=LOAD, rtol=1e-6)
        deviations.append(abs(state.zones["contact"][-1][1] - 1))
    rate = np.log2(deviations[0] / deviations[2]) / 2
    assert rate == pytest.approx(1, abs=0.1)  # the edge moves like alpha
    assert deviations[-1] < 0.01


def test_classical_solids_reproduce_their_closed_forms():
    """Hardly any coupling: Hertz ellipse, inverse square root of the flat punch, logarithm of the wedge."""

    def classical(obstacle):
        return problem(0.25, Unilateral(), obstacle, beta=1e-8).solve(load=LOAD, rtol=1e-4)

    state = classical(Cylinder(1.0))
    inside = np.abs(state.x) < 0.999
    assert state.pressure[inside] == pytest.approx(np.sqrt(1 - state.x[inside] ** 2), abs=1e-4)
    punch = classical(Punch(1.0))
    middle = np.abs(punch.x) < 0.999
    assert punch.pressure[middle] == pytest.approx(LOAD / np.pi / np.sqrt(1 - punch.x[middle] ** 2), rel=1e-4)
    wedge = classical(Wedge(0.5))
    a = wedge.half_width
    assert a == pytest.approx(LOAD / (2 * 0.5), rel=1e-4)  # P = E* a slope
    off = (np.abs(wedge.x) > 1e-3 * a) & (np.abs(wedge.x) < 0.99 * a)
    assert wedge.pressure[off] == pytest.approx(
        2 * 0.5 / np.pi * np.arccosh(a / np.abs(wedge.x[off])), rel=1e-3
    )


@pytest.mark.parametrize("psi0", [0.03, 0.1])
def test_mirrored_blocks_mirror_the_state(psi0):
    left, right = (problem(0.25, Microblock(turn)).solve(load=LOAD, rtol=1e-6) for turn in (psi0, -psi0))
    for a, b in zip(left.zones["A"], reversed(right.zones["B"])):
        assert a == pytest.approx((-b[1], -b[0]), abs=1e-6)
    assert left.micromoment[::-1] == pytest.approx(-right.micromoment, abs=1e-5)


def test_a_symmetric_problem_is_the_same_without_the_symmetry():
    whole = problem(0.25, Microblock(), lambda x: x**2 / 2).solve(load=LOAD, rtol=1e-6)
    half = problem(0.25, Microblock()).solve(load=LOAD, rtol=1e-6)
    assert whole.unknowns > 1.9 * half.unknowns  # but for edges and load
    assert apart(half, whole) < 1e-6


def test_scaling_of_load_radius_and_modulus():
    """Normalised results depend on alpha, nu, beta and psi0 R/a alone, up to psi0 in the levers: a/R is
    kept here."""
    reference = problem(0.25, Microblock(0.05), order=10).solve(load=LOAD)
    E, R = 70.0, 3.0
    P = np.pi * E * R / (4 * 0.91)  # a = R
    body = HalfPlane(Cosserat(E=E, nu=0.3, ell=0.25 * R, beta=1))
    other = Contact(body, Cylinder(R), Microblock(0.05), Panels(order=10)).solve(load=P)
    assert other.x / R == pytest.approx(reference.x, abs=1e-8)
    for corner, pressure in other.pressures.items():
        assert pressure / (2 * P / (np.pi * R)) == pytest.approx(reference.pressures[corner], abs=1e-7)


def test_work_of_the_load_is_the_change_of_the_energy():
    here = problem(0.25, Microblock(0.05), order=14)
    states = [here.solve(load=LOAD * share) for share in (0.999, 1.0, 1.001)]
    slope = (states[2].energy - states[0].energy) / (
        states[2].solution.approach - states[0].solution.approach
    )
    assert slope == pytest.approx(states[1].load, rel=1e-5)  # central difference of step 1e-3


@BY_LAW
def test_orders_converge(law):
    states = [problem(0.25, law, order=order).solve(load=LOAD) for order in (6, 10, 14, 20)]
    errors = [apart(state, states[-1]) for state in states[:-1]]
    assert errors[1] < errors[0] / 20 and errors[2] < errors[1] / 20 and errors[2] < 1e-6


@pytest.mark.parametrize("rtol", [1e-3, 1e-6])
def test_error_obtained_is_below_the_error_asked_for(rtol):
    """A seeded sample against the same problems on panels of order 26; another kind of reference is below."""
    rng = np.random.default_rng(11)
    for _ in range(8):
        alpha, nu, beta = float(10 ** rng.uniform(-1.3, 0.2)), rng.uniform(0, 0.49), rng.uniform(0.2, 1.9)
        law = (Microblock(), Unilateral(), Microblock(rng.uniform(-0.1, 0.1)))[rng.integers(3)]
        here = problem(alpha, law, nu=nu, beta=beta)
        state = here.solve(load=LOAD, rtol=rtol)
        fine = here.with_(method=Panels(order=26)).solve(load=LOAD, initial=state)
        assert apart(state, fine) <= rtol, (alpha, nu, beta, law)


@BY_LAW
def test_a_uniform_grid_of_cells_tends_to_the_same_state(law):
    """Another discretisation and another solver: constant pressure on cells and block pivoting; first order
    in h."""
    from microblock.corners import active_set

    fine = problem(0.25, law).solve(load=LOAD, rtol=1e-6)
    errors = []
    for cells in (151, 301):
        x = np.linspace(-1.5, 1.5, cells)
        compliance = HalfPlane(fine.solid).compliance(x, law.clamps_rotation)
        H, gaps, share = compliance.corner_system(law, Cylinder(1.0))
        state = active_set.solve(H, gaps, load=LOAD, c=share)
        pressure = state.forces.reshape(len(law.corners), -1).sum(axis=0) / (x[1] - x[0])
        exact = fine.pressure_at(x)
        errors.append(np.sqrt(np.mean((pressure - exact) ** 2) / np.mean(exact**2)))
    assert errors[0] < 0.02 and errors[1] < 0.01  # the edges' square roots on cells of 0.02 and 0.01


def test_coalescence():
    """alpha_mid from both sides of coalescence, by two orders, with the exponent of the high-wavenumber
    limit."""
    here = problem(1.0, Microblock())
    results = [here.solver.coalescence(order) for order in (10, 14)]
    (first, error), (second, other) = results
    assert abs(first - second) <= error + other and max(error, other) < 1e-8 * first
    assert 1 / np.sqrt(2 * first / np.pi) == pytest.approx(0.83431323, abs=2e-8)
    # observed exponent: the load misses coalescence by b^(2 s)
    loads = [
        contact_line.load_at_inner_edge(here.solver.problem, 10.0**-digits, 1.4, 14)[0]
        for digits in (4.0, 4.5, 5.0)
    ]
    observed = np.log10((loads[0] - loads[1]) / (loads[1] - loads[2])) / 0.5 / 2
    assert observed == pytest.approx(coalescence_exponent(here.body.solid), abs=5e-4)  # next term b^(4 s)


def cube(x):
    return np.abs(x) ** 3


@pytest.mark.parametrize("law", [Microblock(), Microblock(0.01)])
def test_obstacles_less_smooth_than_the_panels_are_answered(law):
    solid = Cosserat(E=100, nu=0.2, ell=0.085, beta=0.5)
    named = Obstacle(cube, kinks=(0.0,))
    # the edges of one corner's zone are next to where the other's gap is not smooth
    for load in (0.8, 1.0, 1.3, 2.1, 2.7):
        fine = Contact(HalfPlane(solid), named, law).solve(load=load, rtol=1e-6)
        state = Contact(HalfPlane(solid), cube, law).solve(load=load)
        p = [fine.pressure_at(state.x, corner) - state.pressures[corner] for corner in "AB"]
        # both promise their rtol
        assert distance(state.weights, p[0] + p[1], (p[0] - p[1]) / 2, state.pressure) <= 1e-3


def test_kinks_make_sharp_tips_as_good_as_smooth_ones():
    solid = Cosserat(E=100, nu=0.2, ell=0.085, beta=0.5)
    tip = Obstacle(lambda x: np.abs(x) ** 1.5, kinks=(0.0,))
    state = Contact(HalfPlane(solid), tip, Microblock()).solve(load=1.0, rtol=1e-6)
    method = Cells(nodes=16000, window=(-0.4, 0.4))
    cells = Contact(HalfPlane(solid), tip, Microblock(), method).solve(load=1.0)
    p = [state.pressure_at(cells.x, corner) - cells.pressures[corner] for corner in "AB"]
    found = distance(cells.weights, p[0] + p[1], (p[0] - p[1]) / 2, cells.pressure)
    assert found <= 1.5 * cells.error_estimate < 1e-2  # the cells' own, an estimate
    bare = Contact(HalfPlane(solid), tip.height, Microblock())
    # found, not told
    assert bare.solve(load=1.0, rtol=1e-6).half_width == pytest.approx(state.half_width, rel=1e-6)


@pytest.mark.parametrize(
    "given", [{"height": 3.0}, {"kinks": (np.nan,)}, {"kinks": (0.0,), "jumps": (1.0, 2.0)}]
)
def test_obstacles_of_functions_are_checked(given):
    with pytest.raises(BadArgument, match=[*given][-1]):
        Obstacle(**{"height": cube, **given})


def test_states_next_to_coalescence():
    here = problem(0.25, Microblock())
    meeting, _ = here.solver.coalescence(10)
    for share, zones in ((0.95, 2), (0.9999, 2), (1.01, 1), (1.05, 1)):
        state = here.solve(load=share * meeting, rtol=1e-3)
        assert state.error_estimate <= 1e-3 and len(state.zones["contact"]) == zones


def test_punch_and_obstacle_of_ones_own():
    state = problem(0.25, Microblock(), Punch(1.0)).solve(load=LOAD, rtol=1e-3)
    zones = state.zones["contact"]
    # corners at +-ell/2
    assert zones[0][0] == pytest.approx(-1.125) and zones[-1][1] == pytest.approx(1.125)
    quartic = problem(0.25, Microblock(), lambda x: x**4).solve(load=LOAD, rtol=1e-4)
    assert quartic.residual < 1e-4


@pytest.mark.parametrize(
    "ask, failure",
    [
        (lambda: problem(0.25, Microblock()).solve(load=0.0), BadArgument),
        (lambda: problem(0.25, Microblock()).solve(load=np.nan), BadArgument),
        (lambda: problem(0.25, Microblock()).solve(load=LOAD, rtol=2.0), BadArgument),
        (lambda: problem(0.25, Microblock()).solve(load=LOAD, rtol=1e-16), NotConverged),
        (lambda: problem(0.25, Unilateral()).solver.coalescence(), BadArgument),
        (lambda: problem(0.25, Microblock(), lambda x: 0 * x).solve(load=LOAD), BadArgument),
    ],
)
def test_what_cannot_be_done_is_said(ask, failure):
    with pytest.raises(failure):
        ask()
