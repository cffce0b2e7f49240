"""Friction on meshes in space: histories against closed forms, the plane, the half-space and symmetries."""

from functools import cache

import ngsolve as ng
import numpy as np
import pytest
from scipy.linalg import block_diag

import microblock as mb
from cases.benchmarks.verification import friction_in_space, judging
from cases.benchmarks.verification.bodies_in_space import moved
from microblock.contact_solvers.projected_gradients import solve_matrix_free
from microblock.data.records import read_records
from microblock.fem import friction3d, meshes, meshes3d, recovery
from microblock.fem.friction3d import SurfaceFriction

F = 0.3
P = 0.5
SOLID = mb.Cosserat(E=0.91, nu=0.3, ell=0.3, beta=1)  # E* = 1
SPHERE = mb.Sphere(R=1.0)
POINTS = mb.Unilateral(friction=F)
BLOCKS = mb.Microblock(friction=F)
LAWS = [POINTS, BLOCKS, mb.Microclamped(friction=F)]
STEP = 0.25
ROUGHLY = 1e-5  # residuals of increments are 1e-7, and ten times that where alternations end


def block(half=False, turn=0.0, solid=SOLID):
    """A block, or its half x2 > 0, turned about x3."""
    across = meshes3d.graded(reach=1.25, step=STEP, far=2.0, growth=2.0)
    whole = np.concatenate((-across[:0:-1], across))
    down = meshes3d.graded(reach=STEP, step=STEP, far=2.0, growth=1.8)
    mesh = meshes3d.block(whole, across if half else whole, -down[::-1], reach=1.25)
    c, s = np.cos(turn), np.sin(turn)
    turned = moved(mesh, lambda points: points @ ((c, s, 0), (-s, c, 0), (0, 0, 1)))
    planes = {"x2": "front"} if half else {}
    return mb.Body(turned, solid, order=1, fixed=meshes3d.supports("bottom", **planes))


def corners_of_random_nodes(seed, count=12):
    """A flexibility and initial gaps: springs that fall with the distance, and blocks on rough ground."""
    random = np.random.default_rng(seed)
    x = random.uniform(-1, 1, (count, 2))
    apart = np.linalg.norm(x[:, None] - x, axis=2)
    turning = np.exp(-2 * apart) / 2
    compliance = block_diag(np.exp(-apart), turning, turning, np.eye(2 * count))
    signs = np.array([(1, -a, -b) for a in (-1, 1) for b in (-1, 1)])
    directions = np.repeat(signs[:, :, None], count, axis=2)
    gaps = 0.3 * (x**2).sum(axis=1) + 0.02 * random.normal(size=(4, count))
    return friction3d.NodeFaces(compliance, directions), gaps


@cache
def states(law, *loads, half=False, turn=0.0):
    return mb.Contact(block(half, turn), SPHERE, law).history(P * np.array(loads)).states


def test_forces_of_four_corners_settle():
    """No flexibility sees the forces 1, -1, -1, 1 of a block; their work on its gaps is least at a bound. If
    it is not taken there, products are 24 times as many, and some systems are not solved.
    """
    systems = [corners_of_random_nodes(seed) for seed in range(10)]
    solved = [solve_matrix_free(H, gaps, load=3.0, rtol=1e-7) for H, gaps in systems]
    assert sum(state.iterations for state in solved) < 2000
    for state in solved:
        assert state.gaps.min() > -1e-6 and (state.forces * state.gaps).max() < 1e-6


@pytest.mark.parametrize("law", [POINTS, pytest.param(BLOCKS, marks=pytest.mark.nightly)], ids=str)
def test_a_half_between_planes_of_symmetry_has_the_states_of_the_whole(law):
    """Of half of the loads; across the plane the obstacle does not move, and no sum of shear is given."""
    loads = np.array([(1, 0, 0), (1, 0.5 * F, 0)])
    part = states(law, *map(tuple, loads / 2), half=True)
    for half, whole in zip(part, states(law, *map(tuple, loads))):
        assert half.approach == pytest.approx(whole.approach, rel=ROUGHLY)
        assert half.tangential_approach == pytest.approx(whole.tangential_approach, abs=ROUGHLY)
        assert 2 * half.work == pytest.approx(whole.work, rel=ROUGHLY)
        assert 2 * half.dissipation == pytest.approx(whole.dissipation, abs=ROUGHLY * whole.work)
        there = whole.points[:, 1] > -1e-9
        q = whole.shear_traction[there]
        assert half.shear_traction == pytest.approx(q, abs=1e-3 * np.abs(q).max())


@pytest.mark.parametrize(
    "ground",
    [pytest.param(mb.HalfSpace(SOLID), marks=pytest.mark.nightly), block()],
    ids=["half-space", "mesh"],
)
def test_near_full_slip_the_way_of_the_obstacle_is_doubtful(ground):
    """At 0.999 f P the dissipation of one leg is not that of two; below 0.98 f P no word is needed."""
    method = mb.Cells(nodes=32) if isinstance(ground, mb.HalfSpace) else None
    slight = mb.Contact(ground, SPHERE, mb.Unilateral(friction=0.01), method)
    loads = [(P, share * 0.01 * P, 0) for share in (0, 0.9, 0.99, 0.999)]
    steps = slight.history(loads).states
    at_once = slight.history([loads[0], loads[-1]]).states[-1]
    assert at_once.dissipation > 1.5 * steps[-1].dissipation
    doubtful = [any("of f P" in words for words in state.warnings) for state in (*steps, at_once)]
    assert doubtful == [False, False, True, True, True]


@pytest.mark.parametrize("law", [POINTS, pytest.param(BLOCKS, marks=pytest.mark.nightly)], ids=str)
def test_a_load_turned_by_a_quarter_has_turned_states(law):
    along_1 = states(law, (1, 0.5 * F, 0))[-1]
    along_2 = states(law, (1, 0, 0.5 * F))[-1]
    x1, x2 = np.round(along_1.points[:, :2].T, 9)
    first = np.lexsort((x1, x2))
    second = np.lexsort((x2, x1))
    q = along_1.shear_traction[first]
    assert along_2.shear_traction[second][:, ::-1] == pytest.approx(q, abs=1e-4 * np.abs(q).max())
    p = along_1.pressure[first]
    assert along_2.pressure[second] == pytest.approx(p, abs=1e-4 * p.max())
    assert along_2.dissipation == pytest.approx(along_1.dissipation, rel=1e-3)


def test_a_scene_turned_by_17_degrees_has_the_same_numbers():
    """Mesh and load; laws without blocks know no direction, so sides t1 and t2 do not matter."""
    turn = np.radians(17)
    usual = states(POINTS, (1, 0.5 * F, 0))[-1]
    turned = states(POINTS, (1, 0.5 * F * np.cos(turn), 0.5 * F * np.sin(turn)), turn=turn)[-1]
    assert np.hypot(*turned.tangential_approach) == pytest.approx(usual.tangential_approach[0], rel=ROUGHLY)
    assert turned.approach == pytest.approx(usual.approach, rel=ROUGHLY)
    assert turned.dissipation == pytest.approx(usual.dissipation, rel=1e-3)
    assert turned.stick.sum() == usual.stick.sum()
    sizes = (np.sort(np.hypot(*state.shear_traction.T)) for state in (usual, turned))
    assert next(sizes) == pytest.approx(next(sizes), abs=1e-4 * F * usual.pressure.max())


@pytest.mark.parametrize("law", [*LAWS[:2], pytest.param(LAWS[2], marks=pytest.mark.nightly)], ids=str)
def test_a_cylinder_on_a_strip_is_that_of_the_plane(law):
    """A strip of one element between planes of symmetry has the fields of the plane's quadrilaterals, whose
    events are exact: increments leave a hundredth of q, and less of the rest.
    """
    width = 0.5
    lines = meshes.uniform_lines(1.25, 2.0, 0.125)
    x = np.concatenate((-lines[:0:-1], lines))
    planes = meshes3d.supports("bottom", x2="front|back")
    strip = mb.Body(meshes3d.block(x, (0.0, width), -lines[::-1]), SOLID, order=1, fixed=planes)
    mesh = meshes.uniform(meshes.Ground(far=2.0, reach=(-1.25, 1.25), half=False), 0.125)
    ground = mb.Body(mesh, SOLID, order=1, fixed="bottom")
    pairs = np.array([(0.4, 0.0), (0.4, 0.06), (0.3, -0.03)])
    plane = mb.Contact(ground, mb.Cylinder(R=1.0), law).history(pairs).states
    triples = width * np.column_stack((pairs, 0 * pairs[:, 0]))
    solver = mb.Contact(strip, lambda x1, x2: x1**2 / 2 + 0 * x2, law).solver
    followed = SurfaceFriction(solver, triples, True)
    followed.count = 32
    for state, expected in zip(followed.history().states, plane):
        middle = state.points[:, 1] == 0
        size = np.linalg.norm(expected.pressure)
        assert np.linalg.norm(state.pressure[middle] - expected.pressure) < 2e-3 * size
        assert np.linalg.norm(state.shear_traction[middle, 0] - expected.shear_traction) < 0.01 * F * size
        assert state.approach == pytest.approx(expected.approach, rel=1e-4)
        if expected.shear:  # blocks that are pressed slide all, and nothing says where the obstacle stays
            moved = expected.tangential_approach
            assert state.tangential_approach[0] == pytest.approx(moved, rel=0.01, abs=1e-6)
        assert state.work / width == pytest.approx(expected.work, rel=1e-3)
        assert state.dissipation / width == pytest.approx(expected.dissipation, rel=0.05, abs=1e-6)


def test_without_drag_the_stick_zone_is_cattaneos_and_mindlins(monkeypatch):
    """Their assumption: pressures drag no face, and shear presses none. With nu = 0 short waves of shear and
    of pressure displace alike. Within half a step stick ends at a (1 - Q/(f P))^(1/3), and after a reversal
    at a (1 - dQ/(2 f P))^(1/3).
    """
    monkeypatch.setattr(friction3d.NodeFaces, "dragged", lambda faces, forces: 0.0)
    body = block(half=True, solid=mb.Cosserat(E=1.0, nu=0.0, ell=1e-3, beta=1))
    problem = mb.Contact(body, SPHERE, POINTS)
    shares = 0.7, 0.1
    loads = P / 2 * np.array([(1, 0, 0), *((1, share * F, 0) for share in shares)])
    pressed, sheared, back = problem.history(loads, coupled=False).states
    radii = [np.sqrt(2 * state.weights @ state.stick / np.pi) for state in (pressed, sheared, back)]
    a = (3 * P / 4) ** (1 / 3)
    assert radii[0] == pytest.approx(a, abs=STEP / 2)
    assert radii[1] == pytest.approx(radii[0] * 0.3 ** (1 / 3), abs=STEP / 2)
    assert radii[2] == pytest.approx(radii[0] * 0.7 ** (1 / 3), abs=STEP / 2)


# a sphere on half of a block between planes of symmetry, and on cells; the load that each carries
GROUNDS = {
    "mesh": (lambda law: mb.Contact(block(half=True), SPHERE, law), P / 2),
    "half-space": (
        lambda law: mb.Contact(mb.HalfSpace(SOLID), SPHERE, law, mb.Cells(nodes=32, window=(-1.3, 1.3))),
        4 / 3,
    ),
}


@pytest.mark.parametrize("ground, count", [("mesh", 9), ("half-space", 6)])
def test_all_slides_at_the_limit_and_work_is_lost(ground, count):
    """q = f p along Q. Work of the loads over pairs before, by their means: energy and dissipation."""
    problem, load = GROUNDS[ground]
    pairs = [(load, share * F * load, 0) for share in np.linspace(0, 1, count)]
    steps = problem(POINTS).history(pairs).states
    last = steps[-1]
    assert not last.stick.any()
    assert last.shear_traction[:, 0] == pytest.approx(F * last.pressure, abs=1e-9)
    assert np.abs(last.shear_traction[:, 1]).max() < 1e-9
    slid = (last.slip - steps[-2].slip)[last.closed > 0, 0]
    assert slid.max() > 0.02 and slid.min() > -1e-9  # forwards, and the least that nothing contradicts
    work = sum(
        (after.shear + before.shear) @ (after.tangential_approach - before.tangential_approach) / 2
        + (after.load + before.load) * (after.approach - before.approach) / 2
        for before, after in zip(steps[:-2], steps[1:-1])
    )
    assert work == pytest.approx(steps[-2].work - steps[0].work, rel=0.02)
    assert last.work == pytest.approx(last.energy + last.dissipation)
    lost = [state.dissipation for state in steps]
    assert sorted(lost) == lost and lost[-1] > lost[0]
    if ground == "mesh":
        assert last.fields.energy() == pytest.approx(last.energy, rel=1e-6)  # of the body's own strains
        held = last.solution.reaction_on("bottom").force
        assert held[[0, 2]] == pytest.approx((-last.shear[0], last.load), rel=1e-6)


@pytest.mark.parametrize("ground", GROUNDS)
def test_little_friction_changes_no_state(ground):
    """f = 1e-8, of the pressure as much: beside the residual 1e-7."""
    problem, load = GROUNDS[ground]
    (state,) = problem(mb.Microblock(friction=1e-8)).history([(load, 0, 0)]).states
    plain = problem(mb.Microblock()).solve(load=load)
    for name in ("pressure", "psi", "micromoment"):
        values = getattr(plain, name)
        assert getattr(state, name) == pytest.approx(values, abs=1e-5 * np.abs(values).max())


def test_the_estimate_sees_shear_and_increments():
    """Averaged tractions carry Q but for some per cent, as they carry P; of the increments is the change from
    half of them.
    """
    half = states(POINTS, (0.5, 0.4 * F, 0), half=True)[0]
    boundary = recovery._boundary(half.solution)
    body = half.solution.nodes.body
    tractions = recovery._tractions(half.fields, recovery._averaged(body, half.fields))
    force = ng.Integrate(tractions, body.mesh, definedon=body.mesh.Boundaries("contact"))[7:]
    assert force[[0, 2]] == pytest.approx((half.shear[0], -half.load), rel=0.15)
    assert boundary.nodal[3] == pytest.approx(half.shear_traction[:, 0] / F)
    of_mesh = recovery.estimate(half.solution).total
    assert half.error_estimate == pytest.approx(of_mesh + half.solution.of_increments, rel=1e-12)
    assert half.solution.of_increments > 1e-4


def test_results_go_where_others_go(tmp_path):
    history = mb.Contact(block(half=True), SPHERE, BLOCKS).history([(P / 8, 0.2 * P / 8, 0)])
    (state,) = history.states
    history.save(tmp_path / "history.npz")
    assert mb.load(tmp_path / "history.npz").to_dict() == history.to_dict()
    mb.to_csv(history, tmp_path / "history.csv")
    rows = read_records(tmp_path / "history.csv")
    assert sum(row["weight"] * row["shear_traction1"] for row in rows) == pytest.approx(0.2 * P / 8)
    mb.to_vtk(history, tmp_path / "history")
    assert history.plot(tmp_path / "history.png") and state.plot(tmp_path / "state.png")
    q = state.shear_traction_at([(0.0, 0.0), (5.0, 0.0)])
    assert q.shape == (2, 2) and not q[1].any()
    assert 0 < np.hypot(*q[0]) <= F * state.pressure_at([(0, 0)])[0] * (1 + 1e-9)
    assert state.stiffness is None and history.error_estimate == state.error_estimate


@pytest.mark.parametrize("ground", GROUNDS)
def test_moments_of_blocks_are_those_of_corners_less_that_of_shear(ground):
    problem, load = GROUNDS[ground]
    (state,) = problem(BLOCKS).history([(load, 0.2 * load, 0)]).states
    corners = np.array([(a, b) for a in (-1, 1) for b in (-1, 1)])
    m = -np.array([*state.pressures.values()]).T @ corners - state.shear_traction
    assert state.micromoment == pytest.approx(0.15 * np.column_stack((m[:, 1], -m[:, 0])), abs=1e-9)


def test_contact_beyond_the_candidates_is_followed(monkeypatch):
    """Candidates that begin with one node grow until two rows about the contact are among them."""
    expected = states(POINTS, (1, 0.4 * F, 0), half=True)[0]  # five nodes wide
    first = np.hypot(*expected.points[:, :2].T) < 0.1
    monkeypatch.setattr(SurfaceFriction, "_pressed", first)
    state = mb.Contact(block(half=True), SPHERE, POINTS).history([(P, 0.4 * F * P, 0)]).states[0]
    assert state.pressure == pytest.approx(expected.pressure, abs=1e-4)


def test_what_is_out_of_scope_is_said():
    body = block(half=True)
    x = np.linspace(-1, 1, 3)
    over = moved(meshes3d.block(x, x + 1, x - 1), lambda points: points * (1, 1, -1))
    above = mb.Body(over, SOLID, order=1, fixed="bottom")
    with pytest.raises(mb.BadArgument, match="must have Q2 = 0"):
        mb.Contact(body, SPHERE, POINTS).history([(1, 0, 0.1)])
    with pytest.raises(mb.BadArgument, match="refine it yourself"):
        mb.Contact(body, SPHERE, POINTS).history([(1, 0, 0)], rtol=0.1)
    with pytest.raises(mb.BadArgument, match="rigid obstacles alone"):
        mb.Contact(body, mb.Deformable(above), POINTS).history([(1, 0, 0)])
    with pytest.raises(mb.BadArgument, match=r"in space by Condensed\(\)"):
        mb.Contact(body, SPHERE, POINTS, mb.Newton()).history([(1, 0, 0)])
    slope = moved(meshes3d.block(x, x, x - 1), lambda points: points @ ((1, 0, 0.1), (0, 1, 0), (0, 0, 1)))
    tilted = mb.Body(slope, SOLID, order=1, fixed="bottom")
    with pytest.raises(mb.BadArgument, match="must be level"):
        mb.Contact(tilted, SPHERE, POINTS).history([(1, 0, 0)])


@pytest.mark.nightly
@pytest.mark.parametrize("k", range(30))
def test_drawn_histories_are_right_or_warned(k):
    row = judging.outcome(friction_in_space.case(k), 300)
    assert row["class"] in ("right", "warned"), row
