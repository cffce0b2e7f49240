"""States on the contact line: closed forms, symmetry, scaling, convergence, coalescence, errors held."""

import numpy as np
import pytest

from microblock import contact_line, line_state, obstacles, picture
from microblock.errors import BadArgument, NotConverged
from microblock.grid_contact import GridContact
from microblock.halfplane import HalfPlane, coalescence_exponent
from microblock.law import Microblock, Microclamped, Unilateral
from microblock.material import Cosserat
from microblock.observables import contact_zones, distance
from microblock.scene import Contact

LOAD = np.pi/2      # with E* = 2 and R = 1 lengths are over a_Hz and pressures over p_Hz
LAWS = {"microblock": Microblock(), "turned": Microblock(0.1), "lever": Microblock(-0.05, "lever"), "unilateral": Unilateral(),
        "microclamped": Microclamped()}
BY_LAW = pytest.mark.parametrize("law", LAWS.values(), ids=LAWS.keys())


def scene(alpha, law, obstacle=obstacles.Cylinder(1.0), nu=0.3, beta=1.0):
    return Contact(HalfPlane(Cosserat(E=2*(1 - nu**2), nu=nu, ell=alpha, beta=beta)), obstacle, law)


@BY_LAW
@pytest.mark.parametrize("alpha", [0.05, 0.25, 1.0])
def test_conditions_26_and_the_load(law, alpha):
    state = scene(alpha, law).at(LOAD, rtol=1e-6)
    assert state.estimate.total <= 1e-6
    assert state.weights @ state.pressures.sum(axis=0) == pytest.approx(LOAD, rel=1e-13)
    assert line_state.violation(state) < 1e-6      # of the sizes, outside the nodes as well
    corners = range(len(state.pressures))
    for corner in corners:
        closed = state.pressures[corner] > 0
        # collocated at these points; the matrix's conditioning, some 1e4, is left of rounding
        assert np.abs(state.gaps(corner, state.x[closed])).max() < 1e-9
        assert np.all(state.pressures[corner] > -1e-6)


@pytest.mark.parametrize("alpha", [0.1, 0.25, 0.5])
def test_full_contact_turns_the_blocks_along(alpha):
    state = scene(alpha, Microblock()).at(LOAD, rtol=1e-6)
    (left, right), = contact_zones(state.all_zones, "AB")["full"]
    x = np.linspace(left, right, 23)[1:-1]
    # g_A = g_B = 0 says psi = x/R in full contact, between the collocation points too
    assert state.rotation(x) == pytest.approx(x, abs=1e-6)


@pytest.mark.parametrize("law", [Microblock(), Unilateral()])
def test_hertz_is_the_limit(law):
    deviations = []
    for alpha in (0.04, 0.02, 0.01):
        state = scene(alpha, law).at(LOAD, rtol=1e-6)
        edge = max(right for intervals in state.all_zones.values() for _, right in intervals)
        deviations.append(abs(edge - 1))
    rate = np.log2(deviations[0]/deviations[2])/2
    assert rate == pytest.approx(1, abs=0.1)      # the edge moves like alpha
    assert deviations[-1] < 0.01


def test_classical_solids_reproduce_their_closed_forms():
    """Hardly any coupling: Hertz ellipse, inverse square root of the flat punch, logarithm of the wedge."""
    def classical(obstacle):
        return scene(0.25, Unilateral(), obstacle, beta=1e-8).at(LOAD, rtol=1e-4)

    state = classical(obstacles.Cylinder(1.0))
    inside = np.abs(state.x) < 0.999
    assert state.pressures[0][inside] == pytest.approx(np.sqrt(1 - state.x[inside]**2), abs=1e-4)
    punch = classical(obstacles.Punch(1.0))
    middle = np.abs(punch.x) < 0.999
    assert punch.pressures[0][middle] == pytest.approx(LOAD/np.pi/np.sqrt(1 - punch.x[middle]**2), rel=1e-4)
    wedge = classical(obstacles.Wedge(0.5))
    a = wedge.zones[0][0][1]
    assert a == pytest.approx(LOAD/(2*0.5), rel=1e-4)      # P = E* a slope
    off = (np.abs(wedge.x) > 1e-3*a) & (np.abs(wedge.x) < 0.99*a)
    assert wedge.pressures[0][off] == pytest.approx(2*0.5/np.pi*np.arccosh(a/np.abs(wedge.x[off])), rel=1e-3)


@pytest.mark.parametrize("psi0", [0.03, 0.1])
def test_mirrored_blocks_mirror_the_state(psi0):
    left, right = (scene(0.25, Microblock(turn)).at(LOAD, rtol=1e-6) for turn in (psi0, -psi0))
    for a, b in zip(left.all_zones[0], reversed(right.all_zones[1])):
        assert a == pytest.approx((-b[1], -b[0]), abs=1e-6)
    assert left.micromoment[::-1] == pytest.approx(-right.micromoment, abs=1e-5)


def test_symmetric_scene_is_the_same_without_the_symmetry():
    whole = scene(0.25, Microblock(), lambda x: x**2/2).at(LOAD, rtol=1e-6)
    half = scene(0.25, Microblock()).at(LOAD, rtol=1e-6)
    assert not whole.line.mirror and half.line.mirror and len(whole.q) == 2*len(half.q)
    assert line_state.difference(half, whole) < 1e-6


def test_scaling_of_load_radius_and_modulus():
    """Normalised results depend on alpha, nu, beta and psi0 R/a alone, up to psi0 in the levers: a/R is kept here."""
    reference = scene(0.25, Microblock(0.05)).at(LOAD, order=10)
    E, R = 70.0, 3.0
    P = np.pi*E*R/(4*0.91)      # a = R
    other = Contact(HalfPlane(Cosserat(E=E, nu=0.3, ell=0.25*R, beta=1)), obstacles.Cylinder(R), Microblock(0.05)).at(P, order=10)
    assert other.x/R == pytest.approx(reference.x, abs=1e-8)
    assert other.pressures/(2*P/(np.pi*R)) == pytest.approx(reference.pressures, abs=1e-7)


def test_work_of_the_load_is_the_change_of_the_energy():
    states = [scene(0.25, Microblock(0.05)).at(LOAD*share, order=14) for share in (0.999, 1.0, 1.001)]
    slope = (states[2].energy - states[0].energy)/(states[2].approach - states[0].approach)
    assert slope == pytest.approx(states[1].load, rel=1e-5)      # central difference of step 1e-3


@BY_LAW
def test_orders_converge(law):
    states = [scene(0.25, law).at(LOAD, order=order) for order in (6, 10, 14, 20)]
    errors = [line_state.difference(state, states[-1]) for state in states[:-1]]
    assert errors[1] < errors[0]/20 and errors[2] < errors[1]/20 and errors[2] < 1e-6


@pytest.mark.parametrize("rtol", [1e-3, 1e-6])
def test_error_obtained_is_below_the_error_asked_for(rtol):
    """A seeded sample against the same scenes on panels of order 26; another kind of reference is below."""
    rng = np.random.default_rng(11)
    for _ in range(8):
        alpha, nu, beta = float(10**rng.uniform(-1.3, 0.2)), rng.uniform(0, 0.49), rng.uniform(0.2, 1.9)
        law = (Microblock(), Unilateral(), Microblock(rng.uniform(-0.1, 0.1)))[rng.integers(3)]
        here = scene(alpha, law, nu=nu, beta=beta)
        state = here.at(LOAD, rtol=rtol)
        fine = here.at(LOAD, order=26, near=state)
        assert line_state.difference(state, fine) <= rtol, (alpha, nu, beta, law)


@BY_LAW
def test_a_uniform_grid_of_cells_tends_to_the_same_state(law):
    """Another discretisation and another solver: constant pressure on cells and block pivoting; first order in h."""
    from microblock import active_set
    fine = scene(0.25, law).at(LOAD, rtol=1e-6)
    errors = []
    for cells in (151, 301):
        x = np.linspace(-1.5, 1.5, cells)
        H, gaps, share = HalfPlane(fine.line.solid).compliance(x, law.clamps_rotation).corner_system(law, obstacles.Cylinder(1.0))
        state = active_set.solve(H, gaps, load=LOAD, c=share)
        pressure = state.forces.reshape(len(law.corners), -1).sum(axis=0)/(x[1] - x[0])
        exact = sum(fine.pressure(corner, x) for corner in range(len(law.corners)))
        errors.append(np.sqrt(np.mean((pressure - exact)**2)/np.mean(exact**2)))
    assert errors[0] < 0.02 and errors[1] < 0.01      # the edges' square roots on cells of 0.02 and 0.01


def test_coalescence():
    """alpha_mid from both sides of coalescence, by two orders, with the exponent of the high-wavenumber limit."""
    here = scene(1.0, Microblock())
    results = [here.coalescence(order) for order in (10, 14)]
    (first, error), (second, other) = results
    assert abs(first - second) <= error + other and max(error, other) < 1e-8*first
    assert 1/np.sqrt(2*first/np.pi) == pytest.approx(0.83431323, abs=2e-8)
    # observed exponent: the load misses coalescence by b^(2 s)
    loads = [contact_line.load_at_inner_edge(here.line, 10.0**-digits, 1.4, 14)[0] for digits in (4.0, 4.5, 5.0)]
    observed = np.log10((loads[0] - loads[1])/(loads[1] - loads[2]))/0.5/2
    assert observed == pytest.approx(coalescence_exponent(here.body.solid), abs=5e-4)      # next term b^(4 s)


def cube(x):
    return np.abs(x)**3


@pytest.mark.parametrize("law", [Microblock(), Microblock(0.01)])
def test_obstacles_less_smooth_than_the_panels_are_answered(law):
    solid = Cosserat(E=100, nu=0.2, ell=0.085, beta=0.5)
    named = obstacles.Shape(cube, kinks=(0.0,))
    for load in (0.8, 1.0, 1.3, 2.1, 2.7):      # the edges of one corner's zone are next to where the other's gap is not smooth
        fine = Contact(HalfPlane(solid), named, law).at(load, rtol=1e-6)
        state = Contact(HalfPlane(solid), cube, law).at(load)
        p = [fine.pressure(corner, state.x) - state.pressures[corner] for corner in (0, 1)]
        # both promise their rtol
        assert distance(state.weights, p[0] + p[1], (p[0] - p[1])/2, state.pressures.sum(axis=0)) <= 1e-3


def test_kinks_make_sharp_tips_as_good_as_smooth_ones(monkeypatch):
    solid = Cosserat(E=100, nu=0.2, ell=0.085, beta=0.5)
    tip = obstacles.Shape(lambda x: np.abs(x)**1.5, kinks=(0.0,))
    state = Contact(HalfPlane(solid), tip, Microblock()).at(1.0, rtol=1e-6)
    cells = GridContact(HalfPlane(solid), tip, Microblock(), window=(-0.4, 0.4)).at(1.0, nodes=16000)
    p = [state.pressure(corner, cells.x) - cells.pressures[corner] for corner in (0, 1)]
    found = distance(cells.weights, p[0] + p[1], (p[0] - p[1])/2, cells.pressures.sum(axis=0))
    assert found <= 1.5*cells.error_estimate < 1e-2      # the cells' own, an estimate
    bare = Contact(HalfPlane(solid), tip.height, Microblock())
    assert bare.at(1.0, rtol=1e-6).half_width == pytest.approx(state.half_width, rel=1e-6)      # found, not told
    monkeypatch.setattr(picture, "seen", lambda obstacle, found: obstacle)
    with pytest.raises(NotConverged):      # negative control: what is not seen the panels do not follow
        bare.at(1.0, rtol=1e-6)


@pytest.mark.parametrize("given", [{"height": 3.0}, {"kinks": (np.nan,)}, {"kinks": (0.0,), "jumps": (1.0, 2.0)}])
def test_shapes_are_checked(given):
    with pytest.raises(BadArgument, match=[*given][-1]):
        obstacles.Shape(**{"height": cube, **given})


def test_states_next_to_coalescence():
    here = scene(0.25, Microblock())
    meeting, _ = here.coalescence(10)
    for share, zones in ((0.95, 2), (0.9999, 2), (1.01, 1), (1.05, 1)):
        state = here.at(share*meeting, rtol=1e-3)
        assert state.estimate.total <= 1e-3 and len(contact_zones(state.all_zones, "AB")["contact"]) == zones


def test_punch_and_obstacle_of_ones_own():
    state = scene(0.25, Microblock(), obstacles.Punch(1.0)).at(LOAD, rtol=1e-3)
    zones = contact_zones(state.all_zones, "AB")["contact"]
    assert zones[0][0] == pytest.approx(-1.125) and zones[-1][1] == pytest.approx(1.125)      # corners at +-ell/2
    quartic = scene(0.25, Microblock(), lambda x: x**4).at(LOAD, rtol=1e-4)
    assert line_state.violation(quartic) < 1e-4


@pytest.mark.parametrize("ask, failure", [
    (lambda: scene(0.25, Microblock()).at(0.0), BadArgument), (lambda: scene(0.25, Microblock()).at(np.nan), BadArgument),
    (lambda: scene(0.25, Microblock()).at(LOAD, rtol=2.0), BadArgument),
    (lambda: scene(0.25, Microblock()).at(LOAD, rtol=1e-16), NotConverged),
    (lambda: scene(0.25, Unilateral()).coalescence(), BadArgument),
    (lambda: scene(0.25, Microblock(), lambda x: 0*x).at(LOAD), NotConverged)])
def test_what_cannot_be_done_is_said(ask, failure):
    with pytest.raises(failure):
        ask()
