"""Contact of bodies in three dimensions: patch test, conditions and balances, warnings."""

import re

import netgen.occ as occ
import ngsolve as ng
import numpy as np
import pytest
from ngsolve.meshes import MakeStructured3DMesh
from scipy import sparse
from scipy.sparse.linalg import splu

import microblock as mb
from microblock import cost
from microblock.fem import factors, meshes3d
from microblock.fem.body import FIELDS3D as FIELDS

SOLID = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)
LAWS = pytest.mark.parametrize("law", [mb.Unilateral(), mb.Microblock(), mb.Microclamped()], ids=str)
SPHERE = mb.Sphere(10.0)
MODULUS = SOLID.lam + 2 * SOLID.mu  # of uniform compression


def box(n=2, order=1, fixed="bottom", height=1.0):
    """The unit square times [-height, 0]."""
    x = np.linspace(0, 1, n + 1)
    return mb.Body(meshes3d.block(x, x, height * (x - 1)), SOLID, order, fixed=fixed)


def quarter(x, depth, order=1, reach=0.6, ell=0.1):
    """A quarter of a block between planes of symmetry."""
    fixed = meshes3d.supports("bottom", x1="left", x2="front")
    solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=ell)
    return mb.Body(meshes3d.block(x, x, np.array(depth), reach=reach), solid, order, fixed=fixed)


@pytest.mark.parametrize("order", [1, 2])
def test_the_patch_test_on_facets_that_are_no_parallelograms(order):
    """On a surface at another height, pressed by a plane at that height."""
    mesh = MakeStructured3DMesh(
        nx=2, mapping=lambda x, y, z: (x + 0.6 * x * (1 - x) * y, y - 0.4 * y * (1 - y) * x, z - 0.3)
    )
    fixed = {"u1": "back|front", "u2": "left|right", **dict.fromkeys(("u3", *FIELDS[3:]), "bottom")}
    body = mb.Body(mesh, SOLID, order, fixed=fixed, contact="top")
    state = mb.Contact(body, lambda x1, x2: 0.7 + 0 * x1, mb.Microblock()).solve(approach=0.01)
    assert np.ptp(np.sort(state.weights)[:4]) > 0.01 * state.weights.mean()  # its corners differ
    assert state.pressure == pytest.approx(MODULUS * 0.01, rel=1e-7)  # the residual of the conditions


@pytest.mark.parametrize("order", [1, 2])
@LAWS
def test_conditions_and_balances(law, order):
    """Gaps from the fields in the body; forces and moments about the origin; energies."""

    def height(x1, x2):
        return (x1 - 0.4) ** 2 + (x2 - 0.55) ** 2

    state = mb.Contact(box(4 // order, order), height, law).solve(load=2.0)
    fields, half, moment = state.fields, SOLID.ell / 2, np.zeros(2)
    places = [fields.body.mesh(x1, x2, 0.0) for x1, x2 in zip(state.x1, state.x2)]
    u3, psi1, psi2 = (np.array([part(place) for place in places]) for part in (fields.u[2], *fields.psi[:2]))
    assert pytest.approx(np.array((psi1, psi2)), abs=1e-8 * np.abs(u3).max() / half) == state.psi.T
    for (a, b), own in zip(state.problem.solver.surface_law.offsets, state.pressures.values()):
        x1, x2 = state.x1 + half * a, state.x2 + half * b
        # (21): the corner goes with the block
        gap = height(x1, x2) - state.approach - u3 - half * (b * psi1 - a * psi2)
        assert own.min() >= 0 and gap.min() > -1e-7 * state.approach  # the residual of the conditions
        assert np.abs(gap[own > 0]).max() < 1e-7 * state.approach
        moment += np.array((-x2, x1)) @ (state.weights * own)
    moment += state.weights @ state.micromoment * law.clamps_rotation
    corners = np.column_stack((state.x1, state.x2))[state.triangles]
    areas = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 2
    assert areas.sum() == pytest.approx(1.0) and areas.min() > 0  # the surface as files have it
    force, turning = fields.reaction("bottom")
    assert force == pytest.approx([0, 0, 2.0], abs=1e-9)  # rounding of the factorisation
    assert turning == pytest.approx([-moment[0], -moment[1], 0], abs=1e-8)
    assert fields.energy() == pytest.approx(state.energy, rel=1e-8)


def test_steps_that_do_not_grow_are_equal():
    """Ten tenths are less than 1 by rounding, and no step more."""
    steps = meshes3d.graded(reach=1.0, step=0.1, far=2.0, growth=1.0)
    assert steps == pytest.approx(np.linspace(0, 2, 21))


def test_a_flat_punch_ends_at_its_nodes():
    """Coordinates of nodes are those of the mesh to the last digit, so that its edge is a row of nodes."""
    x = meshes3d.graded(reach=0.5, step=0.1, far=2.0, growth=3.0)
    body = quarter(x, [-2.0, -0.6, -0.2, 0.0], order=2, reach=0.5)
    at, beside = (
        mb.Contact(body, mb.FlatPunch(edge, face="square"), mb.Unilateral()).solve(load=0.25)
        for edge in (x[3], x[3] + 0.03)
    )
    below = (at.x1 <= x[3]) & (at.x2 <= x[3])
    assert np.count_nonzero(below) == 49 and np.array_equal(at.pressure > 0, below)
    told = [any("between nodes" in words for words in state.warnings) for state in (at, beside)]
    assert told == [False, True]


@pytest.mark.parametrize(
    "reach, step, ell, words",
    [
        (0.6, 0.06, 0.3, ""),
        (0.6, 0.2, 0.3, "nodes in contact"),
        (0.24, 0.06, 0.3, "beside the contact boundary"),
        (0.6, 0.06, 0.02, "resolve the layer"),
    ],
)
def test_states_say_what_they_cannot_estimate(reach, step, ell, words):
    x = meshes3d.graded(reach=0.6, step=step, far=2.0, growth=3.0)
    body = quarter(x, [-2.0, -0.5, -0.2, 0.0], reach=reach, ell=ell)
    told = mb.Contact(body, SPHERE, mb.Unilateral()).solve(load=0.25).warnings
    assert words in " ".join(told) and bool(words) == bool(told)


def tetrahedra(n):
    """The same box as `box(n)`."""
    mesh = MakeStructured3DMesh(hexes=False, nx=n, ny=n, nz=n, mapping=lambda x, y, z: (x, y, z - 1))
    return mb.Body(mesh, SOLID, 1, fixed="bottom", contact="top")


@pytest.mark.parametrize(
    "body, law",
    [
        (lambda: box(3), mb.Unilateral()),
        (lambda: box(3), mb.Microblock((0.01, -0.02))),
        (lambda: box(2, order=2), mb.Microclamped()),
        (lambda: tetrahedra(3), mb.Microblock()),
        (lambda: quarter(np.array((0.0, 0.1, 0.2, 1.0)), [-1.0, -0.4, 0.0], reach=1.0), mb.Unilateral()),
    ],
    ids=["hexahedra", "rotated blocks", "order 2", "tetrahedra", "graded"],
)
def test_a_spike_between_nodes_is_named(body, law):
    """1/400 of the surface wide, and deeper than the apex: it carried nothing, without a word."""

    def height(x1, x2):
        spike = np.hypot(x1 - 0.83, x2 - 0.58) < 1 / 800
        return np.where(spike, -0.01, (x1**2 + x2**2) / 20)

    said = " ".join(mb.Contact(body(), height, law).solve(load=0.01).warnings)
    (place,) = re.findall(r"between nodes, at x1 = ([\d.]+) and x2 = ([\d.]+), the obstacle reaches", said)
    assert [float(x) for x in place] == pytest.approx((0.83, 0.58), abs=1 / 800)


def test_a_surface_of_two_levels_is_read_between_its_nodes():
    """Nodes of a step lie one above the other: a triangulation of both levels was invalid."""
    low, high = occ.Box((-1, -1, -1), (0, 1, 0)), occ.Box((0, -1, -1), (1, 1, 0.25))
    for face in low.faces + high.faces:
        face.name = "side"
    low.faces.Max(occ.Z).name = high.faces.Max(occ.Z).name = "contact"
    low.faces.Min(occ.Z).name = high.faces.Min(occ.Z).name = "bottom"
    mesh = ng.Mesh(occ.OCCGeometry(occ.Glue([low, high])).GenerateMesh(maxh=0.7))
    state = mb.Contact(mb.Body(mesh, SOLID, 1, fixed="bottom"), step, mb.Unilateral()).solve(load=1.0)
    middles = state.points[state.triangles].mean(axis=1)
    expected = state.pressure[state.triangles].mean(axis=1)
    assert state.pressure_at(middles) == pytest.approx(expected, abs=1e-9 * expected.max())
    assert expected.any() and set(state.points[:, 2]) == {0.0, 0.25}


def step(x1, x2):
    """As high as the surface of two levels, and curved."""
    return np.where(x1 > 0, 0.25, 0.0) + (x1**2 + x2**2) / 20


def test_a_picture_below_the_surface_is_one_of_the_plane(tmp_path):
    """It said that finite elements have fields, of finite elements."""
    state = mb.Contact(box(), SPHERE, mb.Unilateral()).solve(load=1.0)
    with pytest.raises(mb.BadArgument, match="no picture .*to_vtk.* in three dimensions"):
        state.plot_below()
    assert len(mb.to_vtk(state, tmp_path / "state")) == 2


def test_a_penalty_leads_back_from_the_approach_to_the_load():
    """The first residual is measured against pressures of the penalty, far beyond those at rest."""
    x = np.linspace(0, 1, 6)
    body = mb.Body(meshes3d.block(x, x, np.linspace(-1, 0, 4)), SOLID, 1, fixed="bottom")
    problem = mb.Contact(body, lambda x1, x2: 0 * x1, mb.Microblock(), mb.Newton("penalty"))
    pressed = problem.solve(load=1.0)
    assert problem.solve(approach=pressed.approach).load == pytest.approx(1.0, rel=1e-8)  # of the residual


@pytest.mark.parametrize(
    "rate, measured",
    [
        # hexahedra of order 1 and 2, tetrahedra: unknowns, seconds of a busy core, bytes over those before
        (
            "condensed in space",
            [(3888, 0.3, 87e6), (12168, 2.1, 515e6), (27744, 4.9, 1.45e9), (27744, 4.4, 1.05e9)],
        ),
        (
            "condensed in space by SuperLU",
            [(3888, 0.5, 110e6), (6610, 1.8, 251e6), (12168, 6.1, 621e6), (12168, 5.2, 496e6)],
        ),
        (
            "newton in space",
            [(3888, 1.6, 25e6), (12168, 5.0, 86e6), (27744, 19.0, 239e6), (27744, 22.0, 415e6)],
        ),
    ],
)
def test_what_bodies_in_space_are_expected_to_take(rate, measured):
    """Within twice of the seconds and half as much of the memory: 0.8 GB were expected for 1.4 and 2.1."""
    for unknowns, seconds, memory in measured:
        expected = cost.of(rate, unknowns)
        assert 1 / 2 < expected.seconds / seconds < 2 and 1 / 1.5 < expected.memory / memory < 1.75


@pytest.mark.parametrize("usual, taken", [(factors.Cholmod, "condensed"), (factors.SuperLU, "newton")])
def test_the_better_method_of_a_body_in_space_is_taken(monkeypatch, memory, usual, taken):
    """SuperLU takes 33 s where Newton's method takes 19 and CHOLMOD 5; without memory none is begun."""
    monkeypatch.setattr(factors, "usual", usual)
    problem = mb.Contact(box(16), SPHERE, mb.Unilateral())
    assert problem.plan(load=1.0).candidates[0].name == taken
    memory(1.4e9)
    with pytest.raises(mb.NotConverged, match="GB of memory"):
        problem.with_(method=mb.Condensed()).solve(load=1.0)


def test_the_memory_of_systems_in_space_is_that_of_matrices_and_factors(memory):
    """Three matrices of 12 bytes an entry, and the factors of each field as another library fills them: no
    body that lacks this room is begun, and one with twice of it is.
    """
    mesh = MakeStructured3DMesh(nx=4, ny=4, nz=4, mapping=lambda x, y, z: (x, y, z - 1))
    body = mb.Body(mesh, mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1), 2, fixed="bottom", contact="top")
    rows, columns, values = map(np.array, body.bulk(body.space).mat.COO())
    matrix, free = sparse.csr_matrix((values, (rows, columns))), np.array(body.space.FreeDofs())
    fields = [np.arange(own.start, own.stop) for own in map(body.space.Range, range(len(FIELDS)))]
    factors = [splu(matrix[np.ix_(own[free[own]], own[free[own]])].tocsc()).L.nnz for own in fields]
    needed, newton = 12 * (3 * matrix.nnz + sum(factors)), mb.Newton()
    problem = mb.Contact(body, mb.Sphere(10.0), mb.Unilateral(), newton)
    memory(needed / 0.8)  # a fifth of what is there is left to others
    with pytest.raises(mb.NotConverged, match="memory"):
        problem.solve(load=0.1)
    memory(2 * needed / 0.8)
    assert problem.solve(load=0.1).load == pytest.approx(0.1, rel=1e-6)  # residual of the method
