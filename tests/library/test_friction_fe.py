"""Friction at the corners of bodies on meshes: tangent, patch test, columns, half-planes, energy."""

import math
import pickle
from dataclasses import replace

import ngsolve as ng
import numpy as np
import pytest
from conftest import dome
from ngsolve.meshes import MakeStructured2DMesh
from scipy.optimize import brentq
from scipy.special import ellipk

import microblock as mb
from microblock.corners import coulomb
from microblock.fem import meshes
from microblock.fem.facets import ContactFacets
from microblock.fem.friction import FrictionFacets, MonolithicFriction
from microblock.fem.slip_nodes import SlipNodes

F = 0.3
R = 10.0
SOLID = mb.Cosserat(E=100, nu=0.2, ell=0.1, beta=1)
CYLINDER = mb.Cylinder(R=R)
PAIRS = [(1.0, 0.0), (1.0, 0.2), (1.0, 0.29), (1.0, -0.15), (0.6, 0.1)]


def block(h=0.1, solid=SOLID, far=2.0, reach=0.6, order=2):
    """A block of the half-width `far` whose contact region has squares of the side h."""
    mesh = meshes.uniform(meshes.Ground(far=far, reach=(-reach, reach), half=False), h)
    return mb.Body(mesh, solid, order=order, fixed="bottom")


def hertz(solid):
    """Half-width of classical contact at the load 1."""
    return math.sqrt(4 * R / (math.pi * solid.E_star))


def column(order=6):
    """The depth alone, of height 1."""
    solid = mb.Cosserat(E=2.6, nu=0.3, ell=0.2, beta=1)
    return mb.Body(meshes.line(depth=1.0, elements=2), solid, order=order, fixed="middle")


def history(body, law, pairs, method=None, coupled=True, obstacle=CYLINDER):
    return mb.Contact(body, obstacle, law, method).history(pairs, coupled=coupled)


@pytest.mark.parametrize("prescribed", [(False, False), (True, True), (False, True)])
@pytest.mark.parametrize("reduced", [True, False])
def test_equations_are_the_derivative_of_the_residual(prescribed, reduced):
    facets = FrictionFacets(block(0.3), mb.Microblock(friction=F), CYLINDER)
    system = MonolithicFriction(facets, reduced=reduced).system
    newton, random = coulomb.FrictionNewton(system, prescribed), np.random.default_rng(1)
    sizes = np.full(system.operators[0].shape[1], 1e-3)
    sizes[system.parts[1].start : system.parts[2].stop] *= 3 * system.rho  # so that nodes stick as well
    sizes[system.parts[2]] *= F
    sizes[system.parts[0]] /= 10
    kinds = set()
    for _ in range(5):
        before, now = (coulomb.Iterate(system, sizes * random.normal(size=sizes.shape)) for _ in range(2))
        sets, level = newton.sets(now, before), np.array([1.0, 0.1])
        kinds |= {*sets.slips[sets.closed.any(axis=0)]} | ({"open"} if not sets.closed.all() else set())
        way = sizes * random.normal(size=sizes.shape)
        ahead, behind = (
            newton.residual(coulomb.Iterate(system, now.values + sign * 1e-7 * way), before, level)
            for sign in (1, -1)
        )
        differences, derivative = (ahead - behind) / 2e-7, newton.equations(sets) @ way
        corners = derivative[system.parts[1]].reshape(sets.closed.shape)
        derivative[system.parts[2]] += (
            F * sets.slips * corners.sum(axis=0)
        )  # rows that a piece can do without
        # the residual is piecewise linear, so that differences err by rounding alone, 1e-16 over the step
        assert np.abs(differences - derivative).max() < 1e-6 * np.abs(derivative).max()
    assert kinds == {-1, 0, 1, "open"}


def test_a_step_of_newton_on_all_unknowns_ends_where_that_on_the_contact_does():
    facets = FrictionFacets(block(0.3), mb.Microblock(friction=F), CYLINDER)
    whole, own = (
        list(MonolithicFriction(facets, reduced=reduced).follow(PAIRS)) for reduced in (False, True)
    )
    for one, other in zip(whole, own):
        # two orders of elimination, each good to rounding times the matrix's condition, some 1e5
        assert np.allclose(one.pressures, other.pressures, rtol=0, atol=1e-9 * other.pressures.max())
        assert np.allclose(
            one.shear_traction, other.shear_traction, rtol=0, atol=1e-9 * other.pressures.max()
        )
        assert one.reached.iterate.fields == pytest.approx(other.reached.iterate.fields, abs=1e-12)
        assert one.dissipation == pytest.approx(other.dissipation, rel=1e-9)


@pytest.mark.parametrize("start", ["open", "stick", "slip", "random"])
def test_newton_finds_the_same_state_from_any_sets(start):
    facets = FrictionFacets(block(0.15), mb.Microblock(friction=F), CYLINDER)
    system = MonolithicFriction(facets).system
    past = coulomb.History(system).start()
    newton, shape, random = coulomb.FrictionNewton(system), system.gaps.shape, np.random.default_rng(3)
    first = {
        "open": past.ahead,
        "stick": coulomb.Sets(np.ones(shape, bool), np.zeros(shape[1], int)),
        "slip": coulomb.Sets(np.ones(shape, bool), np.where(np.arange(shape[1]), -1, 0)),
        "random": coulomb.Sets(random.random(shape) < 0.5, random.integers(-1, 2, shape[1])),
    }
    level = np.array([1.0, 0.2])
    usual, *_ = newton.solve(level, past.iterate, past.ahead)
    now, *_ = newton.solve(level, past.iterate, first[start])
    assert np.abs(newton.residual(now, past.iterate, level)).max() < 1e-9
    assert np.allclose(now.values, usual.values, rtol=0, atol=1e-9 * np.abs(usual.values).max())


@pytest.mark.parametrize(
    "law", [mb.Microblock(friction=F), mb.Unilateral(friction=F), mb.Microclamped(friction=F)]
)
def test_a_strip_sticks_with_uniform_tractions_until_all_of_it_slips(law):
    solid = mb.Cosserat(E=2.6, nu=0.3, ell=0.2, beta=1)
    body = mb.Body(
        meshes.column(depth=1.0, elements=4, width=0.5), solid, order=4, fixed="middle", periodic=True
    )
    P = 0.01
    found = history(body, law, [(P, 0.0), (P, 0.9 * F * P), (P, F * P)], obstacle=mb.Plane())
    for state in found.states:
        # an exact solution of the discrete problem up to the layer of psi, which order 4 has to 1e-6
        assert np.ptp(state.pressure) < 1e-9 * P and np.ptp(state.shear_traction) < 1e-9 * P
        assert state.weights @ state.shear_traction == pytest.approx(state.shear, abs=1e-12 * P)
    assert found.states[1].zones["slip"] == [] and found.states[1].zones["stick"]
    assert found.states[2].zones["stick"] == [] and found.states[2].zones["slip"]
    assert [event.kind for event in found.events] == ["full slip"]
    facets = FrictionFacets(mb.Contact(body, mb.Plane(), law, mb.Newton()).solver.supported, law, mb.Plane())
    with pytest.raises(mb.NotConverged, match="all nodes slip") as failure:
        list(MonolithicFriction(facets).follow([(P, 0.0), (P, 1.01 * F * P)]))
    assert failure.value.reached[1] == pytest.approx(F * P, rel=1e-6)  # the first part of Newton's way


def test_a_column_under_shear_follows_the_closed_form():
    """With psi = 0 at both ends, u1 = q/mu (H - beta L tanh(H/2L)) and the couple q/2 gamma' ell^2/L
    tanh(H/2L) at the top; corner B opens where that and the moment of q exceed (ell/2) P.
    """
    body, f, P, H = column(), 0.6, 0.01, 1.0
    solid = body.solid
    L, mu, ell, stiff = solid.layer_length, solid.mu, solid.ell, solid.curvature * solid.ell**2 * solid.mu
    tip = P / (1 + solid.curvature * ell / L * math.tanh(H / (2 * L)))
    facets = FrictionFacets(body, mb.Microblock(friction=f), mb.Plane())
    both, one = MonolithicFriction(facets).follow([(P, 0.9 * tip), (P, 0.5 * P)])
    q = 0.9 * tip
    assert both.reached.iterate.shift == pytest.approx(
        q / mu * (H - solid.beta * L * math.tanh(H / (2 * L))), rel=1e-6
    )
    pA, pB = both.pressures[:, 0]
    assert pA - pB == pytest.approx(q * P / tip, rel=1e-6) and both.stick.all()
    opens = [change.share for change in one.reached.changes if change.kind == "open"]
    assert opens == [pytest.approx(0.1 * tip / (0.5 * P - 0.9 * tip), rel=1e-5)]
    # beyond, A alone carries P, and psi at the top follows from the couple (ell/2)(P - q) there
    q, h = 0.5 * P, H / L
    B = ell / 2 * (P - q) * L / stiff
    A = (q / (2 * mu) + B * math.sinh(h)) / math.cosh(h)
    psi = A - q / (2 * mu)
    turned = -q * H / (2 * mu) + A * L * math.sinh(h) + B * L * (1 - math.cosh(h))
    u1 = (q * H - 2 * solid.mu_c * turned) / (mu + solid.mu_c)
    assert one.nodal.psi[0] == pytest.approx(psi, rel=1e-5)
    assert one.reached.iterate.shift == pytest.approx(u1 - ell / 2 * psi, rel=1e-5)


def test_a_column_dragged_beyond_the_limit_slips_and_dissipates():
    body, f, d = column(), 0.2, 0.004
    solid = body.solid
    P = (solid.lam + 2 * solid.mu) * d
    L = solid.layer_length
    stiffness = solid.mu / (1 - solid.beta * L * math.tanh(1 / (2 * L)))
    limit = f * P / stiffness
    facets = FrictionFacets(body, mb.Microblock(friction=f), mb.Plane())
    followed = MonolithicFriction(facets, control="approach").follow
    pressed, stuck, dragged, back = followed([(d, 0), (d, 0.5 * limit), (d, 3 * limit), (d, 0)])
    assert pressed.normal == pytest.approx(P, rel=1e-9) and stuck.dissipation == pytest.approx(0, abs=1e-18)
    assert stuck.shear == pytest.approx(0.5 * f * P, rel=1e-6)
    assert dragged.shear == pytest.approx(f * P, rel=1e-9) and dragged.slips.tolist() == [1]
    assert dragged.slip[0] == pytest.approx(2 * limit, rel=1e-6)
    assert dragged.dissipation == pytest.approx(2 * limit * f * P, rel=1e-6)
    assert back.shear == pytest.approx(-f * P, rel=1e-9) and back.slips.tolist() == [-1]
    assert back.dissipation == pytest.approx(3 * limit * f * P, rel=1e-6)  # back by 3, of which 2 are elastic


def test_a_block_on_springs_tips_where_the_shear_load_is_the_normal_one():
    """Both corners closed hold psi = 0, so pA - pB = q whatever the springs, and B opens at Q = P."""
    ell, f, (kn, kpsi, kt) = 1.0, 1.5, (2.0, 3.0, 1.0)
    corners = (np.array([[1.0, -ell / 2, 0.0]]), np.array([[1.0, ell / 2, 0.0]]))
    slip = np.array([[0.0, -ell / 2, 1.0]])
    system = coulomb.System(
        np.diag([kn, kpsi, kt]), np.zeros(3), corners, slip, slip, np.zeros((2, 1)),
        np.array([[0.0, 1.0]]), np.ones(1), f, 1.0,
    )  # fmt: skip
    stands, tipped = coulomb.History(system).follow([(1.0, 0.6), (1.0, 1.2)])
    assert stands.iterate.pressures[:, 0] == pytest.approx([0.8, 0.2], abs=1e-12)
    (change,) = [one for one in tipped.changes if one.kind == "open"]
    assert 0.6 + change.share * 0.6 == pytest.approx(1.0, abs=1e-12)
    psi = ell / 2 * (1.0 - 1.2) / kpsi  # the couple of p and q on the spring
    assert tipped.iterate.values[:3] == pytest.approx([-1 / kn, psi, 1.2 / kt], abs=1e-12)
    assert tipped.iterate.approach == pytest.approx(1 / kn + ell / 2 * psi, abs=1e-12)
    assert tipped.iterate.shift == pytest.approx(1.2 / kt - ell / 2 * psi, abs=1e-12)


@pytest.mark.parametrize("coupled", [True, False])
@pytest.mark.parametrize(
    "law", [mb.Microblock(friction=F), mb.Unilateral(friction=F), mb.Microclamped(friction=F)]
)
def test_newton_and_the_condensed_body_agree(law, coupled):
    solid = mb.Cosserat(E=100, nu=0.2, ell=0.05, beta=1)
    body = block(solid=solid)
    both = [history(body, law, PAIRS, method, coupled).states for method in (mb.Newton(), mb.Condensed())]
    for newton, condensed in zip(*both):
        size = condensed.pressure.max()
        # the same discrete problem by two algorithms: rounding, some 1e-13 of the pressure here
        for name in ("pressure", "shear_traction", "micromoment"):
            assert np.allclose(getattr(newton, name), getattr(condensed, name), rtol=0, atol=1e-10 * size), (
                name
            )
        for name in ("approach", "energy", "work", "dissipation", "tangential_approach"):
            own, other = getattr(newton, name), getattr(condensed, name)
            assert own == pytest.approx(other, rel=1e-9, abs=1e-12), name
        assert np.allclose(
            newton.slip, condensed.slip, rtol=0, atol=1e-9 * np.abs(condensed.slip).max() + 1e-14
        )
        assert newton.zones == condensed.zones
    sheared = [states[1].solution.fields for states in both]
    for name in ("u1", "u2", "psi"):
        own, other = (getattr(fields, name)(body.mesh(0.1, -0.2)) for fields in sheared)
        assert own == pytest.approx(other, rel=1e-9)


def test_random_histories_are_followed_by_both_algorithms():
    """Obstacles, laws, friction and loads by chance; of large friction there may be no state."""
    random = np.random.default_rng(7)
    for _ in range(8):
        f, nu, ell = 10 ** random.uniform(-1.5, 0), random.uniform(0, 0.45), 10 ** random.uniform(-2, 0)
        body = block(0.15, mb.Cosserat(E=100, nu=nu, ell=ell, beta=random.uniform(0.1, 1.9)), order=1)
        law = (mb.Microblock if random.random() < 0.7 else mb.Unilateral)(friction=f)
        obstacle = (CYLINDER, mb.Punch(half_width=0.4), mb.Wave(0.01, 0.7))[random.integers(3)]
        pairs = [(P, random.uniform(-0.97, 0.97) * f * P) for P in random.uniform(0.1, 2, 3)]
        coupled = bool(random.integers(2))
        newton, condensed = (
            history(body, law, pairs, method, coupled, obstacle).states[-1]
            for method in (mb.Newton(), mb.Condensed())
        )
        size = condensed.pressure.max()
        assert 0 < newton.residual < 1e-9 and 0 < condensed.residual < 1e-9
        assert np.allclose(newton.pressure, condensed.pressure, rtol=0, atol=1e-9 * size)
        assert np.allclose(newton.shear_traction, condensed.shear_traction, rtol=0, atol=1e-9 * size)
        assert newton.dissipation == pytest.approx(condensed.dissipation, rel=1e-9, abs=1e-12)
        assert newton.work == pytest.approx(newton.energy + newton.dissipation, rel=1e-9)


@pytest.mark.parametrize("method", [mb.Newton(), mb.Condensed()])
@pytest.mark.parametrize("coupled", [True, False])
def test_work_is_energy_and_dissipation(method, coupled):
    states = history(block(0.15), mb.Microblock(friction=F), PAIRS, method, coupled).states
    last = 0.0
    for state in states:
        # nothing is discretised in time: rounding
        assert state.work == pytest.approx(state.energy + state.dissipation, rel=1e-10)
        assert state.dissipation >= last - 1e-14 * state.energy
        last = state.dissipation
    assert last > 1e-2 * states[-1].energy


def test_energy_is_that_of_the_fields():
    for method in (mb.Newton(), mb.Condensed()):
        state = history(block(0.15), mb.Microblock(friction=F), PAIRS[:2], method).states[-1]
        fields = state.solution.fields
        energy = ng.Integrate(fields.body.energy(*fields), fields.body.mesh)
        assert state.energy == pytest.approx(energy, rel=1e-9)
        force, moment = fields.reaction("bottom")
        arm = state.weights @ (state.pressure * state.x - state.micromoment)
        inner = np.array(fields.body.space.FreeDofs())
        assert np.abs(fields.forces[inner]).max() < 1e-9  # what acts on the contact is in them
        # forces and moments of the supports balance P, Q and the moment of all tractions
        assert force == pytest.approx([-0.2, 1.0], abs=1e-9)
        assert moment == pytest.approx(arm, abs=1e-9)


def test_a_mirrored_history_has_mirrored_states():
    one, other = (
        history(block(), mb.Unilateral(friction=F), [(P, sign * Q) for P, Q in PAIRS]).states
        for sign in (1, -1)
    )
    for left, right in zip(one, other):
        size = left.pressure.max()
        assert np.allclose(left.pressure, right.pressure[::-1], rtol=0, atol=1e-9 * size)
        assert np.allclose(left.shear_traction, -right.shear_traction[::-1], rtol=0, atol=1e-9 * size)
        assert np.allclose(left.slip, -right.slip[::-1], rtol=0, atol=1e-12)
        assert left.dissipation == pytest.approx(right.dissipation, rel=1e-9, abs=1e-15)


@pytest.fixture(scope="module")
def half_plane():
    problem = mb.Contact(mb.HalfPlane(SOLID), CYLINDER, mb.Microblock(friction=F))
    return problem.history(PAIRS[:2], rtol=0.05).states


def test_a_large_block_is_near_the_half_plane(half_plane):
    """Pressure, couples and shear tractions, whose kernels come from the symbol and know no mesh."""
    found = history(block(0.05, far=8.0), mb.Microblock(friction=F), PAIRS[:2]).states
    for state, other in zip(found, half_plane):
        w, size = other.weights, math.sqrt(other.weights @ other.pressure**2)
        # squares of a seventh of the contact's half-width: 2, 2 and 6 % were seen
        for name, scale, tolerance in (
            ("pressure", 1.0, 0.04),
            ("micromoment", SOLID.ell, 0.04),
            ("shear_traction", F, 0.08),
        ):
            own = np.interp(other.x, state.x, getattr(state, name))
            assert math.sqrt(w @ (own - getattr(other, name)) ** 2) < tolerance * scale * size, name
        (edges,), (exact,) = state.zones["stick"], other.zones["stick"]
        assert edges == pytest.approx(exact, abs=0.04)


def test_classical_contact_sticks_and_slips_as_cattaneo_and_mindlin_say():
    """beta = 0 is classical elasticity, and nu = 0.499 hardly moves the surface sideways under pressure."""
    solid, Q = mb.Cosserat(E=100, nu=0.499, ell=0.01, beta=0), 0.6 * F
    a = hertz(solid)
    errors = []
    for h in (0.1, 0.05, 0.025):
        body = block(h, solid, far=6.0, reach=0.4)
        state = history(body, mb.Unilateral(friction=F), [(1, 0), (1, Q)], coupled=False).states[-1]
        c = a * math.sqrt(1 - Q / F)
        outer, inner = (np.sqrt(np.maximum(0, 1 - (state.x / r) ** 2)) for r in (a, c))
        p0 = 2 / (math.pi * a)
        wrong = state.shear_traction - F * p0 * (outer - c / a * inner)
        errors.append(math.sqrt(state.weights @ wrong**2 / (state.weights @ (F * p0 * outer) ** 2)))
    # first order, as edges lie within elements
    assert errors[1] < 0.6 * errors[0] and errors[2] < 0.6 * errors[1] and errors[2] < 0.12
    (stick,) = state.zones["stick"]
    assert stick == pytest.approx((-c, c), abs=0.03)


def test_classical_contact_under_growing_pressure_sticks_within_the_self_similar_zone():
    """Uncoupled, K'(c/a)/K(c/a) = (1 - 2 nu)/(2 (1 - nu) f), K of modulus c/a."""
    solid = mb.Cosserat(E=100, nu=0.3, ell=0.01, beta=0)
    a = hertz(solid)
    body = block(0.05, solid, far=24.0, reach=0.5)  # a smaller block adds shear of its own
    (state,) = history(body, mb.Unilateral(friction=F), [(1.0, 0.0)], coupled=False).states
    wanted = (1 - 2 * 0.3) / (2 * (1 - 0.3) * F)
    c = a * brentq(lambda k: ellipk(1 - k * k) / ellipk(k * k) - wanted, 0.01, 0.999)
    (stick,) = state.zones["stick"]
    assert stick == pytest.approx((-c, c), abs=0.025)  # nodes stand 0.025 apart
    assert (
        np.sign(state.shear_traction[state.x < -c / 2]).max()
        <= 0
        <= state.shear_traction[state.x > c / 2].min()
    )


def test_small_blocks_tend_to_classical_contact():
    """The moment -(ell/2) q and the layer vanish with ell: first order in it."""
    states = [
        history(block(0.05, mb.Cosserat(E=100, nu=0.2, ell=ell, beta=1)), law, PAIRS[:2]).states[-1]
        for ell, law in ((0.08, mb.Microblock(friction=F)), (0.02, mb.Microblock(friction=F)))
    ]
    classical = mb.Cosserat(E=100, nu=0.2, ell=0.02, beta=0)
    limit = history(block(0.05, classical), mb.Unilateral(friction=F), PAIRS[:2]).states[-1]
    far, near = (np.linalg.norm(state.shear_traction - limit.shear_traction) for state in states)
    assert near < 0.5 * far


def test_a_flat_punch_sticks_like_a_glued_one_where_friction_is_large():
    """With f so large that nothing slips, shear tractions are those of nodes with one displacement."""
    body, law = block(0.2), mb.Unilateral(friction=5.0)
    (_, state) = history(
        body, law, [(1.0, 0.0), (1.0, 0.3)], coupled=False, obstacle=mb.Punch(half_width=0.4)
    ).states
    nodes = SlipNodes(body)
    n, under = len(nodes.weights), np.flatnonzero(np.abs(nodes.points[:, 0]) < 0.4 + 1e-9)
    own = nodes.response[2 * n :][:, 2 * n :][np.ix_(under, under)]
    cross = nodes.response[2 * n :][:, :n][np.ix_(under, under)]
    pressed = -cross @ (state.pressure * state.weights)[under]
    glued = np.linalg.solve(own, np.column_stack((np.ones(len(under)), -pressed)))
    rigid = (0.3 - glued[:, 1].sum()) / glued[:, 0].sum()
    assert not state.zones["slip"]
    forces = (state.shear_traction * state.weights)[under]
    assert np.allclose(forces, glued @ [rigid, 1.0], rtol=0, atol=1e-9)


def test_on_a_curved_surface_supports_carry_both_loads():
    """Pressures and shear tractions both have parts along x1 and x2 there."""
    body = mb.Body(dome(order=2), SOLID, order=2, fixed="base")
    states = history(body, mb.Microblock(friction=F), PAIRS, mb.Newton(), obstacle=mb.Plane(level=1.0)).states
    for state in states:
        force, _ = state.solution.fields.reaction("base")
        assert force == pytest.approx([-state.shear, state.normal], abs=1e-9)
        assert state.work == pytest.approx(state.energy + state.dissipation, rel=1e-9)
        assert state.dissipation >= 0


def test_a_block_has_the_history_of_its_mesh():
    law = mb.Microblock(friction=F)
    body = block(0.15, reach=0.6)
    for newton in (None, mb.Newton()):
        method = mb.Uniform(h=0.15, order=2, reach=0.6, newton=newton)
        found = mb.Contact(mb.Block(SOLID, 2.0), CYLINDER, law, method).history(PAIRS[:2])
        own = history(body, law, PAIRS[:2], newton)
        for state, other in zip(found.states, own.states):
            assert np.allclose(state.shear_traction, other.shear_traction, rtol=0, atol=1e-9)
            assert state.zones == other.zones
    with pytest.raises(mb.NotConverged, match="leaves the region"):
        mb.Contact(mb.Block(SOLID, 2.0), CYLINDER, law, replace(method, reach=0.3)).history(PAIRS[:2])
    with pytest.raises(mb.BadArgument, match="size"):
        mb.Contact(mb.Block(SOLID), CYLINDER, law, method).history(PAIRS[:2])
    with pytest.raises(mb.BadArgument, match="Uniform"):
        mb.Contact(mb.Block(SOLID, 2.0), CYLINDER, law).history(PAIRS[:2])


def test_a_block_has_its_history_to_a_tolerance():
    """Estimates bound the distance to squares four times shorter, by no more than they have to."""
    law, pairs, method = mb.Microblock(friction=F), PAIRS[:2], mb.Uniform(h=0.2, order=1, reach=0.6)
    problem = mb.Contact(mb.Block(SOLID, 2.0), CYLINDER, law, method)
    found = problem.history(pairs, rtol=0.25)
    finest = problem.with_(method=replace(method, h=0.2 / 16)).history(pairs)
    for state, other in zip(found.states, finest.states):
        w, size = other.weights, math.sqrt(other.weights @ other.pressure**2)
        names = {"pressure": 1.0, "micromoment": SOLID.ell, "shear_traction": F}
        true = max(
            math.sqrt(
                w @ ((np.interp(other.x, state.x, getattr(state, name)) - getattr(other, name)) / scale) ** 2
            )
            for name, scale in names.items()
        )
        assert 0.1 * state.error_estimate < true / size < state.error_estimate <= 0.25
    newton = problem.with_(method=replace(method, newton=mb.Newton())).history(pairs, rtol=0.25)
    for state, other in zip(found.states, newton.states):  # the same meshes by the other algorithm
        assert state.error_estimate == pytest.approx(other.error_estimate, rel=1e-8)
    with pytest.raises(mb.NotConverged, match="smallest error estimate") as failure:
        problem.history(pairs[:1], rtol=1e-3)
    assert problem.history(pairs[:1], rtol=failure.value.rtol_reached).states  # what it advises


@pytest.mark.parametrize("method", [mb.Newton(), mb.Condensed()])
def test_states_travel(method):
    state = history(block(0.3), mb.Microblock(friction=F), PAIRS[:2], method).states[-1]
    other = pickle.loads(pickle.dumps(state))
    assert np.array_equal(other.shear_traction, state.shear_traction) and other.zones == state.zones
    assert other.solution.fields.u1(other.solution.fields.body.mesh(0.1, -0.2)) == pytest.approx(
        state.solution.fields.u1(state.solution.fields.body.mesh(0.1, -0.2)), rel=1e-9
    )


def test_what_does_not_know_friction_refuses_it():
    law = mb.Microblock(friction=F)
    with pytest.raises(mb.BadArgument, match="FrictionFacets"):
        ContactFacets(block(0.3), law, CYLINDER)
    with pytest.raises(mb.BadArgument, match="has no friction"):
        FrictionFacets(block(0.3), mb.Microblock(), CYLINDER)
    with pytest.raises(mb.BadArgument, match="kind"):
        history(block(0.3), law, PAIRS, mb.Newton("penalty"))
    with pytest.raises(mb.BadArgument, match="obstacle"):
        history(block(0.3), law, PAIRS, obstacle=mb.Deformable(mb.HalfPlane(SOLID), CYLINDER))
    mesh = MakeStructured2DMesh(nx=4, ny=2, mapping=lambda x, y: (4 * x - 2, y))
    above = mb.Body(mesh, SOLID, fixed="top", contact="bottom")
    with pytest.raises(mb.BadArgument, match="deforms: histories"):
        history(block(0.3), law, PAIRS, obstacle=mb.Deformable(above, CYLINDER))
    with pytest.raises(mb.BadArgument, match="rtol"):
        mb.Contact(block(0.3), CYLINDER, law).history(PAIRS, rtol=1e-2)
    with pytest.raises(mb.BadArgument, match="obstacle"):
        history(block(0.3), law, PAIRS, obstacle=mb.Obstacle(lambda x: np.full_like(x, np.nan)))
