"""Symbol, kernels and compliance of the half-plane: against the field equations in 60 digits, quadrature on
the real axis and each other; anything admissible has finite kernels and a state or a typed error.
"""

from decimal import Decimal, localcontext
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings, strategies
from scipy.integrate import quad
from scipy.special import k0

import microblock as mb
from microblock import (
    Contact,
    Cosserat,
    Cylinder,
    HalfPlane,
    Microblock,
    Microclamped,
    NotConverged,
    Panels,
    Punch,
    Unilateral,
    Wedge,
)
from microblock.contact_solvers.cell_path import CellScan
from microblock.halfplane.kernels import LineKernels, clamped, plane_symbol
from microblock.model.events import Event
from tests import closed_forms

DIGITS = 60
DECADES = 10.0 ** np.arange(-6, 7)
SOLIDS = [  # nu, beta, gamma'
    (nu, beta, curvature)
    for nu in (-0.9, 0.4999)
    for beta in (1e-12, 1.0, 1.999999)
    for curvature in (0.01, 100.0)
] + [(0.3, 0.0, 2.0)]
# the last two have a root of D next to the line of the rotated wavenumbers
FEW = [
    (0.3, 1.0, 2.0),
    (0.0, 0.2, 2.0),
    (0.49, 1.9, 1.0),
    (-0.5, 0.01, 5.0),
    (0.0, 1.99, 2.0),
    (-0.9, 1.999, 2.0),
]
WEAK = (0.3, 1e-4, 2.0)  # D turns next to the branch point


def solid_of(nu, beta, curvature, ell=0.37, E=3.0):
    return Cosserat(E=E, nu=nu, ell=ell, beta=beta, curvature=curvature)


def stiffness(solid):
    """c = (1 - nu)/mu and the high-wavenumber limits c_u, c_phi of k U and of k W (docs/theory)."""
    c = (1 - solid.nu) / solid.mu
    return c, c / (1 + (1 - solid.nu) * solid.beta), c / (4 * solid.curvature * (1 - solid.nu))


# --- the modes of the half-plane, in 60 digits
# A field is [a, b, c, d] for ((a + b x2) cos(k x1) + (c + d x2) sin(k x1)) exp(rate x2), an array of
# Decimals.


def field(a=0, b=0, c=0, d=0):
    return np.array([Decimal(value) for value in (a, b, c, d)])


def along(f, k):
    return k * f[[2, 3, 0, 1]] * np.array([1, 1, -1, -1])


def upwards(f, rate):
    return rate * f + f[[1, 1, 3, 3]] * np.array([1, 0, 1, 0])


class Mode:
    """Fields of one mode exp(rate x2) with its stresses."""

    def __init__(self, exact, k, rate, u1, u2, psi=None):
        self.k = k
        self.rate = rate
        self.u1 = u1
        self.u2 = u2
        gradient = {(i, j): self.slope(u, j) for i, u in enumerate((u1, u2)) for j in (0, 1)}
        self.rotation = (gradient[1, 0] - gradient[0, 1]) / 2
        self.psi = self.rotation if psi is None else psi
        self.stress = closed_forms.stress(exact, gradient, self.psi)
        self.couple = closed_forms.couple_stress(exact, (self.slope(self.psi, 0), self.slope(self.psi, 1)))

    def slope(self, f, direction):
        return upwards(f, self.rate) if direction else along(f, self.k)

    def imbalance(self):
        """Left-hand sides of (14), each with the largest of its terms."""
        (s11, s12), (s21, s22) = self.stress
        for terms in (
            (self.slope(s11, 0), self.slope(s12, 1)),
            (self.slope(s21, 0), self.slope(s22, 1)),
            (self.slope(self.couple[0], 0), self.slope(self.couple[1], 1), s21 - s12),
        ):
            yield sum(terms), max(abs(value) for term in terms for value in term)

    def surface(self):
        """sigma_22 ~ cos, sigma_12 ~ sin and m_2 ~ sin at x2 = 0, and u2 ~ cos, psi ~ sin; the rest is 0."""
        fields = self.stress[1][1], self.stress[0][1], self.couple[1], self.u2, self.psi
        assert all(f[component] == 0 for f, component in zip(fields, (2, 0, 0, 2, 0)))
        return [f[place] for f, place in zip(fields, (0, 2, 2, 0, 2))]


def modes(solid, k):
    """The two classical modes, psi being their rotation, and the micropolar one with its stream function."""
    nu, beta, ell, curvature = map(Decimal, (solid.nu, solid.beta, solid.ell, solid.curvature))
    mu, eta = Decimal(solid.E) / (2 * (1 + nu)), Decimal(solid.eta)
    exact = SimpleNamespace(
        mu=mu, lam=2 * mu * nu / (1 - 2 * nu), mu_c=eta * mu, ell=ell, curvature=curvature
    )
    q = curvature * ell**2
    s = (k * k + 4 * eta / (1 + eta) / (curvature * ell**2)).sqrt()
    return [
        Mode(exact, k, k, field(c=-k), field(a=k)),
        Mode(exact, k, k, field(d=-k), field(b=k, a=-(3 - 4 * nu))),
        Mode(exact, k, s, field(c=-q * s / 2), field(a=q * k / 2), psi=field(c=1)),
    ]


def solve(matrix, right):
    """Gauss-Jordan in Decimals."""
    rows = [list(row) + [value] for row, value in zip(matrix, right)]
    for i in range(len(rows)):
        pivot = max(range(i, len(rows)), key=lambda j: abs(rows[j][i]))
        rows[i], rows[pivot] = rows[pivot], rows[i]
        rows[i] = [value / rows[i][i] for value in rows[i]]
        rows = [
            row if j == i else [a - row[i] * b for a, b in zip(row, rows[i])] for j, row in enumerate(rows)
        ]
    return [row[-1] for row in rows]


def response(solid, k):
    """Displacements (-u2, u1, phi) of the surface, (3 loads, 3), under p cos(k x1), a shear sin(k x1) along
    x1 and m sin(k x1), m = 2 M/ell, of the modes, which satisfy the field equations and die out downwards.
    """
    half = Decimal(solid.ell) / 2
    solutions = modes(solid, Decimal(k))
    for mode in solutions:
        assert mode.rate > 0
        for left, size in mode.imbalance():
            # shear of layers far shorter than the wave is what mu_c times w leaves: 1e-22 of it
            assert max(abs(value) for value in left) <= size * Decimal("1e-35")
    loads = list(zip(*(mode.surface()[:3] for mode in solutions)))
    moved = [(-mode.u2[0], mode.u1[2], half * mode.psi[2]) for mode in solutions]
    rights = ((-1, 0, 0), (0, 1, 0), (0, 0, half))
    return [[sum(np.multiply(solve(loads, right), values)) for values in zip(*moved)] for right in rights]


@pytest.mark.parametrize("solid", SOLIDS)
def test_symbol_is_that_of_the_modes(solid):
    """Ten roundings and none amplified: s - k is as small as 1e-24 k."""
    solid = solid_of(*solid)
    waves = DECADES / solid.ell
    with localcontext() as context:
        context.prec = DIGITS
        exact = np.array([response(solid, k) for k in waves], float)
    U, V, W = plane_symbol(solid, waves)
    np.testing.assert_allclose((U, V, W), exact[:, [0, 0, 2], [0, 2, 2]].T, rtol=3e-15, atol=1e-55)
    Y = U - 1 / (2 * solid.mu * waves)
    stated = np.array([[U, -Y, V], [-Y, U, -V], [V, -V, W]]).transpose(2, 1, 0)
    # Y is a difference that leaves 1/70 of U at nu = 0.49; each entry is as good as its row and column
    sizes = np.sqrt(np.einsum("nii,njj->nij", stated, stated))
    np.testing.assert_array_less(np.abs(exact - stated) / sizes, 3e-14)
    assert np.linalg.eigvalsh(stated / sizes).min() > 0 and np.all(clamped(U, V, W) > 0)


# --- kernels on the line


def kernel_by_quadrature(solid, number, x):
    """Kernel `number` at x > 0 from the symbol on the real axis, ell = mu = 1; from 5 on those of shear.

    What dies out like 1/k is taken off with a transform known in closed form: 1/hypot(k, r) gives K0(r x),
    1/k the logarithm or a jump and k/(k^2 + r^2) the exponential. The rest falls like k^-2 or faster. U and
    number 3 are taken from 1/k by the identities that `test_far_field_splits_off` has checked; of shear they
    lack what the surface does under a classical one, 1/(2 (1 - nu) k).
    """
    r = 1 / solid.layer_length
    base = {5: 0, 6: 1, 7: 3, 8: 4}.get(number, number)
    c, c_u, c_psi = stiffness(solid)
    odd, lift = number in (1, 4, 5, 7), base in (0, 3)
    tail = (c_u / c - 1, 0, c_psi / c, c_u / c - 1, solid.beta * c_u / c * 2 * (1 - solid.nu))[base]

    def rest(k):
        k = max(k, 1e-100)  # quad looks at 0, too
        U, V, W = plane_symbol(solid, np.array([k]))[:, 0]
        value = (-2 * solid.curvature * (1 - solid.nu) * k * V / c, V / c, W / c, -V / W / 2, V / W)[base]
        return value - tail * (k / (k * k + r * r) if odd else 1 / np.hypot(k, r))

    closed = tail * (np.pi / 2 * np.exp(-r * x) if odd else k0(r * x))
    if lift:
        closed += (1 - 1 / (2 * (1 - solid.nu))) * np.pi / 2 if odd else -np.log(x)
    weight = "sin" if odd else "cos"
    return (
        closed + quad(rest, 0, np.inf, weight=weight, wvar=x, epsabs=1e-12, limlst=500, limit=500)[0]
    ) / np.pi


@pytest.mark.parametrize("solid", FEW)
def test_far_field_splits_off(solid):
    """U = c/k - 2 gamma' ell (1 - nu) k V and U - V^2/W = c/k - c ell V/(2 W): two of the three are
    enough."""
    solid, k = solid_of(*solid), DECADES
    U, V, W = plane_symbol(solid, k)
    c = (1 - solid.nu) / solid.mu
    # rounding of c/k, of which c_u/c = 1/5 is the least that is left
    np.testing.assert_allclose(
        U, c / k - 2 * solid.curvature * solid.ell * (1 - solid.nu) * k * V, rtol=1e-14
    )
    np.testing.assert_allclose(clamped(U, V, W), c / k - c * solid.ell / 2 * V / W, rtol=1e-14)


@pytest.mark.parametrize("solid", [*FEW, WEAK])
def test_kernels_are_transforms_of_the_symbol(solid):
    """Of the table, which is integrated along a rotated ray, 1e-12 is promised; quad obtains 1e-14."""
    x = np.array([0.02, 0.3, 1.0, 4.0, 30.0])
    table, solid = LineKernels(*solid), solid_of(*solid, ell=1.0)
    direct = [[kernel_by_quadrature(solid, number, place) for place in x] for number in range(9)]
    np.testing.assert_allclose(table(x, range(9)), direct, rtol=0, atol=2e-12)


@pytest.mark.parametrize("solid", FEW)
def test_near_the_load_kernels_are_logarithms(solid):
    table = LineKernels(*solid)
    L = solid_of(*solid, ell=1.0).layer_length
    c, c_u, c_psi = stiffness(solid_of(*solid))
    near, nearer = table(L * np.array([1e-7, 1e-8]), range(5)).T
    # the next terms are x^2 log(x): 1e-13; the rest is that of the table
    for number, limit in ((0, c_u), (2, c_psi), (3, c_u)):
        step = pytest.approx(limit / c * np.log(10) / np.pi, abs=5e-13 * (1 + near[number]))
        assert nearer[number] - near[number] == step
    assert 0 < nearer[1] < near[1] < 1e-5  # V like x log(x)
    # number 4 jumps from -1/2 to 1/2 of what V/W of 1/k leaves
    assert nearer[4] == pytest.approx(solid[1] * c_u / c * (1 - solid[0]), abs=1e-6)


@pytest.mark.parametrize("solid", FEW)
def test_far_from_the_load_kernels_are_classical(solid):
    table, x = LineKernels(*solid), np.array([1e7, 1e8, 1e10])
    U, V, W, fixed, moment = table(x, range(5))
    # corrections are of the order (L/x)^2 = 1e-13
    np.testing.assert_allclose(U, -np.log(x) / np.pi, rtol=1e-12)
    np.testing.assert_allclose(fixed, -np.log(x) / np.pi, rtol=1e-12)
    np.testing.assert_allclose(x * V, 1 / (2 * np.pi), rtol=1e-9)
    # W(k) = W(0) - (c ell^2/4) k + ..., its kink makes the tail; at 1e10 it is 1e-10 of V
    np.testing.assert_allclose(x**2 * W, -1 / (4 * np.pi), rtol=1e-5)
    # V/W at k = 0, and pi x from the jump of the sign of k
    U, V, W = plane_symbol(solid_of(*solid, ell=1.0), np.array([1e-12]))[:, 0]
    np.testing.assert_allclose(x * moment, V / W / np.pi, rtol=1e-9)


# --- anything admissible

fuzzed = settings(derandomize=True, deadline=None, database=None)  # the same examples on every machine


def decades(low, high):
    return strategies.floats(low, high).map(lambda power: 10**power)


materials = strategies.tuples(
    strategies.floats(-0.95, 0.4999),
    decades(-12, 0).map(lambda share: 2 * share / (1 + 1e-6)),
    decades(-3, 3),
)  # beta from 2e-12 to 1.999998


@settings(fuzzed, max_examples=60)
@given(
    materials,
    strategies.lists(strategies.one_of(strategies.just(0.0), decades(-20, 12)), min_size=1, max_size=5),
)
def test_kernels_of_anything(material, x):
    table = LineKernels(*material)
    values = table(np.array(x), range(5))
    assert np.all(np.isfinite(values))
    np.testing.assert_array_equal(table(-np.array(x), (0, 1)), values[:2] * [[1], [-1]])
    x = np.geomspace(1e-10, 1e9, 40)
    # a load sinks more the nearer it is: rounding apart
    for number in (0, 3):
        assert np.all(np.diff(table(x, (number,))[0]) < 1e-12)


# --- solids without coupling


@pytest.mark.parametrize("method", [None, mb.Cells(256)])
def test_without_coupling_a_half_plane_without_blocks_is_the_classical_one(method):
    """One rule for panels and cells, with a period or not: nothing has to hold what does not rotate. The
    length is that of the contact, which is that of the classical solid's kernels.
    """
    half_width, _ = mb.hertz_scales(mb.Elastic(100, 0.3), R=10, P=1.0)
    free, classical = (
        mb.Contact(mb.HalfPlane(solid), mb.Cylinder(10), mb.Unilateral(), method).solve(load=1.0)
        for solid in (mb.Cosserat(E=100, nu=0.3, ell=half_width, beta=0), mb.Elastic(100, 0.3))
    )
    assert classical.solid.ell == pytest.approx(half_width, rel=1e-9)
    x = np.linspace(-0.5, 0.5, 11)
    assert np.allclose(free.pressure_at(x), classical.pressure_at(x), rtol=1e-9, atol=1e-9)  # as the lengths


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
def test_an_elastic_solid_has_the_half_width_and_the_pressure_of_hertz(size):
    """At every size, without a word on blocks; the pressure at a place is worth ten times rtol."""
    solid = mb.Elastic(100, 0.3)
    problem = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10 * size), mb.Unilateral())
    state = problem.solve(load=size, rtol=1e-5)
    half_width, pressure = mb.hertz_scales(solid, R=10 * size, P=size)
    assert state.half_width == pytest.approx(half_width, rel=1e-5)
    assert state.pressure_at(0.0) == pytest.approx(pressure, rel=1e-4)
    assert not state.warnings


# --- anything admissible: a state or a typed error, never NaN, never a warning (the suite turns warnings into


rotations = strategies.one_of(strategies.just(0.0), strategies.floats(-0.5, 0.5), decades(-6, -1))
acts_in = strategies.sampled_from(["gaps and levers", "levers"])
laws = strategies.one_of(
    strategies.builds(Microblock, rotations, acts_in),
    strategies.just(Unilateral()),
    strategies.just(Microclamped()),
)
solids = strategies.builds(
    lambda E, nu, ell, beta: Cosserat(E=E, nu=nu, ell=ell, beta=beta),
    decades(-3, 3),
    strategies.floats(-0.9, 0.499),
    decades(-2, 0.7),
    decades(-4, 0.3),
)


def is_a_state(state, load):
    assert state.weights @ state.pressure == pytest.approx(load, rel=1e-12)
    for values in (
        *state.pressures.values(),
        state.micromoment,
        state.psi,
        state.energy,
        state.solution.approach,
    ):
        assert np.all(np.isfinite(values))
    # the norm of the check that refuses a topology
    assert state.residual < 1e-3


@settings(fuzzed, max_examples=60)
@given(solids, laws, decades(-3, 1))
def test_a_cylinder_always_has_a_state(solid, law, load):
    state = Contact(HalfPlane(solid), Cylinder(1.0), law).solve(load=load * solid.E)
    assert 0 <= state.error_estimate <= 1e-3
    is_a_state(state, load * solid.E)


@settings(fuzzed, max_examples=15)
@given(
    solids,
    laws,
    decades(-2, 0),
    strategies.one_of(strategies.builds(Wedge, decades(-2, 0)), strategies.builds(Punch, decades(-1, 1))),
)
def test_slope_discontinuities_and_edges_give_a_state_or_say_why_not(solid, law, load, obstacle):
    try:
        state = Contact(HalfPlane(solid), obstacle, law, Panels(order=8)).solve(load=load * solid.E)
    except NotConverged as failure:
        assert "load" in str(failure)
    else:
        is_a_state(state, load * solid.E)


def test_places_and_chains_of_events_on_cells():
    """An event lies in the middle of its cells, on a period by the shorter way; and what vanishes elsewhere,
    or at a load a tenth larger, does not undo a birth.
    """
    grid = SimpleNamespace(axes=(np.linspace(-0.95, 0.95, 20),), width=0.1, count=20)
    line, ring = (CellScan(SimpleNamespace(period=period, dimensions=1), grid) for period in (None, 2.0))
    assert line.middle(np.array([[3], [6]])) == pytest.approx(-0.5)
    assert ring.middle(np.array([[19], [0]])) == pytest.approx(1.0)
    born = Event(1.0, 0.0, "born", "A", 0.0)
    beside = Event(1.01, 0.0, "vanished", "A", 0.2)
    elsewhere = Event(1.01, 0.0, "vanished", "A", 5.0)
    later = Event(1.15, 0.0, "vanished", "A", 0.2)
    assert line.steady([born, elsewhere]) == [born, elsewhere]
    assert line.steady([born, later]) == [born, later]
    assert line.steady([born, beside]) == []
