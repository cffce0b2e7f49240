"""What states of bodies in space say of themselves, and contacts drawn by program beside what judges them."""

import netgen.occ as occ
import ngsolve as ng
import numpy as np
import pytest

import microblock as mb
from cases.benchmarks.verification import bodies_in_space, judging, scenes_in_space
from microblock.fem import meshes, meshes3d, supports
from microblock.fem.contact_nodes import ContactNodes

CLASSICAL = mb.Elastic(E=0.91, nu=0.3)  # E* = 1
BLOCKS = mb.Cosserat(E=0.91, nu=0.3, ell=0.1, beta=1)
SPHERE = mb.Sphere(R=10.0)
ROWS = bodies_in_space.block(0.4)


def pressed(mesh=ROWS, solid=CLASSICAL, obstacle=SPHERE, law=mb.Unilateral(), method=None, **options):
    """The Contact of a body of order 1."""
    body = mb.Body(mesh, solid, 1, **{"fixed": "bottom"} | options)
    return mb.Contact(body, obstacle, law, method)


# ---- scenes


# of each kind those that take the least
@pytest.mark.parametrize("k", [6, 7, 9, 10, 29])
def test_scenes_are_right_or_warned(k):
    row = judging.outcome(scenes_in_space.case(k))
    assert row["class"] in ("right", "warned"), row


@pytest.mark.nightly
@pytest.mark.parametrize("k", range(100))
def test_all_scenes_are_right_or_warned(k):
    row = judging.outcome(scenes_in_space.case(k))
    assert row["class"] in ("right", "warned"), row


def test_scenes_tell_a_wrong_state():
    """Of pressures that are half of what they should be."""
    scene = scenes_in_space.closed(np.random.default_rng(1))
    state = scene.solve()
    error, estimate, bar = scene.verify(state)
    assert error < estimate + bar
    exact, _ = scene.exact()

    def heavier(places):
        return 2 * exact(places)[0], exact(places)[1]

    assert scenes_in_space.error(state, heavier, state, scene.weight) == pytest.approx(0.5, abs=error)


# ---- supports that leave a rigid motion free


FREE = {"u1": "front", "u2": "left", "u3": "bottom"}  # both lie across the motion


@pytest.mark.parametrize("solid", [CLASSICAL, BLOCKS], ids=["classical", "blocks"])
@pytest.mark.parametrize("held, free", [
    ({}, True),
    ({"psi3": "bottom"}, False),  # a couple between psi and the rotation of the material
    ({"u1": "front|back"}, False),
])  # fmt: skip
def test_a_free_rotation_is_told(solid, held, free):
    """Newton's conjugate gradients need no support along what no force drives; factors do."""
    x = meshes3d.graded(reach=0.6, step=0.3, far=1.0)
    mesh = meshes3d.block(x, x, -x[::-1], reach=0.6)
    free = free or (solid is CLASSICAL and "psi3" in held)
    state = pressed(mesh, solid, method=mb.Newton(), fixed=FREE | held).solve(load=0.01)
    words = "supports leave a rotation about x3 free: displacements hold up to a rigid motion"
    assert (words in state.warnings) == free


def test_rigid_motions_that_no_support_stops():
    """A rotation about x2 moves the contact, but in a line along x2."""
    x = np.linspace(-1, 1, 3)
    fixed = {"u1": "bottom", "u2": "front", "u3": "left"}
    body = mb.Body(meshes3d.block(x, x, x - 1), CLASSICAL, 1, fixed=fixed)
    up = np.tile((0.0, 0.0, 1.0), (3, 1))
    points = np.array([(0.0, 0, 0), (0, 1, 0), (1, 0, 0)])
    assert supports.free_motions(body, points, up) == []
    # about the line in which "left" and "bottom" meet: points on "left" alone move along x1
    points[:, 0] = -1
    assert supports.free_motions(body, points, up) == ["a rotation about x2"]
    with pytest.raises(mb.NotConverged, match="supports leave a rotation about x2 free, which other"):
        mb.Contact(body, mb.Sphere(R=10), mb.Unilateral(), mb.Condensed()).solve(load=0.1)


# ---- penalties, small strain, what lies beside the boundary or inside the body


def test_the_overlap_of_a_penalty_counts():
    """Without it the estimate of the softest one was a quarter of the error."""
    exact = scenes_in_space.fields_of(pressed().solve(load=0.1))
    for rho, soft in ((0.1, True), (1.0, True), (100.0, False)):
        state = pressed(method=mb.Newton("penalty", rho=rho)).solve(load=0.1)
        error = scenes_in_space.error(state, exact, state, lambda x: 1.0)
        assert error < state.error_estimate
        assert ("take a larger rho" in "; ".join(state.warnings)) == soft
    assert error < 0.02  # p/rho is 6e-4 of an approach of 0.07


def test_deep_indentation_is_told():
    assert "beyond small strain" not in "; ".join(pressed().solve(approach=0.1).warnings)
    assert "the obstacle presses 0.3 deep into a body 2.2 deep" in "; ".join(
        pressed().solve(approach=0.3).warnings
    )


def test_a_needle_beside_the_boundary_is_told():
    """Between the vertices of the surface there, 0.2 apart."""

    def with_needle(x1, x2):
        needle = 0.3 * np.exp(-((x1 - 1.65) ** 2 + x2**2) / 0.08**2)
        return (x1**2 + x2**2) / 20 - needle

    free = ROWS.ngmesh.Coordinates()
    assert np.hypot(*(free[:, :2] - (1.65, 0)).T).min() > 0.1
    words = "beside the contact boundary the obstacle reaches 0.2"
    assert words in "; ".join(pressed(obstacle=with_needle).solve(load=0.1).warnings)
    assert "beside" not in "; ".join(pressed().solve(load=0.1).warnings)


def test_a_boundary_inside_the_body_is_refused():
    upper = occ.Box((-1, -1, -0.5), (1, 1, 0))
    lower = occ.Box((-1, -1, -1), (1, 1, -0.5))
    upper.faces.Min(occ.Z).name = "contact"
    lower.faces.Min(occ.Z).name = "bottom"
    mesh = ng.Mesh(occ.OCCGeometry(occ.Glue([upper, lower])).GenerateMesh(maxh=1.0))
    with pytest.raises(mb.BadArgument, match="must have the body on one side"):
        pressed(mesh).solve(load=0.1)


def test_a_rotation_of_blocks_that_varies_is_looked_at_on_the_boundary_alone():
    """On a round boundary; corners of the square about it were places without a number."""
    tilts = (lambda x1, x2: 0.01 * x1, lambda x1, x2: 0 * x1)
    state = pressed(bodies_in_space.cylinder(0.6), BLOCKS, law=mb.Microblock(psi0=tilts)).solve(load=0.1)
    assert isinstance(state.warnings, list)


@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize("order", [1, 2])
def test_the_surface_goes_round_a_corner(side, order):
    """Nodes of the right side came before the corner, which was a zone of its own, with no pressure on its
    left.
    """
    face = occ.WorkPlane().MoveTo(-1, -1).Rectangle(2, 1).Face()
    face.edges.name = "contact"
    face.edges.Min(occ.Y).name = "bottom"
    mesh = ng.Mesh(occ.OCCGeometry(face, dim=2).GenerateMesh(maxh=0.3))
    body = mb.Body(mesh, CLASSICAL, order, fixed="bottom")
    obstacle = lambda x1: (x1 - side) ** 2 / 2  # noqa: E731
    state = mb.Contact(body, obstacle, mb.Unilateral(), mb.Newton()).solve(load=0.02)
    (zone,) = state.zones["contact"]
    assert max(side * np.array(zone)) == pytest.approx(1)
    assert state.pressure_at(side * 0.97) > 0
    # a dozen nodes of the side lie at the place where the zone ends
    few = np.count_nonzero(state.pressure)
    assert f"only {few} nodes in contact and no error estimate" in "; ".join(state.warnings)


def test_short_facets_are_no_vertical_sides():
    """Of a width that is rounding beside the body, as next to an edge of a zone that reaches an end."""
    lines = np.array([-1.0, 0.5, 0.5 + 2e-13, 0.5 + 4e-13, 1.0])
    body = mb.Body(meshes.rectangles(lines, np.array([-1.0, 0.0])), CLASSICAL, 2, contact="top")
    x = ContactNodes(body).points[:, 0]
    assert len(x) == 9 and np.all(np.diff(x) > 0)


# ---- states from one before


@pytest.mark.parametrize("law", [mb.Unilateral(), mb.Microblock()], ids=["unilateral", "microblock"])
def test_a_state_begins_at_the_one_before(law):
    """Another law has other corners, and a body of its own other nodes: both begin anew."""
    problem = pressed(solid=BLOCKS, law=law)
    before = problem.solve(load=0.1)
    anew = problem.solve(load=0.11)
    after = problem.solve(load=0.11, initial=before)
    assert after.iterations < anew.iterations
    assert np.abs(after.pressure - anew.pressure).max() < 1e-6 * anew.pressure.max()  # residuals are 1e-9
    other_mesh = bodies_in_space.block(0.5)
    for other in (pressed(solid=BLOCKS, law=mb.Microclamped()), pressed(other_mesh, BLOCKS, law=law)):
        assert other.solve(load=0.11, initial=before).iterations == other.solve(load=0.11).iterations
