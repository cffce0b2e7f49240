"""Bodies condensed to their contact nodes, against plain solves of the same body."""

import netgen.occ as occ
import ngsolve as ng
import numpy as np
import pytest

from microblock import Body, Cosserat, Cylinder, Microblock, Punch, Wedge
from microblock.corners import active_set
from microblock.fem import meshes
from microblock.fem.between import Facets
from microblock.fem.body import Loads
from microblock.fem.condensation import Condensed
from microblock.fem.facets import ContactFacets
from microblock.fem.recovery import cut

SOLID = Cosserat(E=2.0, nu=0.3, ell=0.2, beta=1.0)
GROUND = meshes.Ground(5.0, (0.0, 1.3))
EDGES = (0.5, 1.0)
ROUNDING = 1e-11  # of direct solves of some thousand unknowns


def graded_body(top=6, solid=SOLID, ground=GROUND, edges=EDGES, levels=3):
    mesh = meshes.graded(ground, edges, spacing=0.5, levels=levels)
    return Body(mesh, solid, meshes.falling_orders(mesh, ground, edges, top), fixed=ground.supports)


@pytest.fixture(scope="module")
def graded():
    return Condensed(graded_body())


def disc(order=4):
    """A half-disc whose round side is pressed from above."""
    face = occ.Circle((0, 0), 1).Face() - occ.Rectangle(4, 4).Face().Move((-2, -4, 0))
    for edge in face.edges:
        edge.name = "contact" if edge.center.y > 0.1 else "bottom"
    mesh = ng.Mesh(occ.OCCGeometry(face, dim=2).GenerateMesh(maxh=0.4))
    mesh.Curve(order)
    return Body(mesh, SOLID, order, fixed="bottom")


def test_uniform_traction_is_that_of_a_plain_solve(graded):
    pressure, moment = 0.7, 0.3
    plain = graded.body.solve(Loads(traction={"contact": (0, -pressure)}, micromoment={"contact": moment}))
    # the Lobatto rule integrates a constant times a shape function exactly
    loads = np.concatenate((-pressure * graded.weights, moment * graded.weights))
    values = graded.compliance.matrix @ loads
    mesh = graded.body.mesh
    for field, found in zip((plain.u2, plain.psi), np.split(values, 2)):
        expected = [field(mesh(x, 0.0)) for x, _ in graded.points]
        assert found == pytest.approx(expected, abs=ROUNDING)
    fields = graded.fields(*np.split(loads, 2))
    for field, expected in zip(fields, plain):
        assert ng.Integrate((field - expected) ** 2, mesh) ** 0.5 < ROUNDING


def scaled_ground(unit, half):
    ground = meshes.Ground(1000 * unit, (0.0 if half else -1.3 * unit, 1.3 * unit), half)
    return ground, [0.37 * unit, 0.9 * unit, 0.9000001 * unit]


@pytest.mark.parametrize("half", [True, False])
def test_graded_meshes_are_the_same_in_every_unit(half):
    """To twelve digits; netgen itself makes others, up to a tenth more elements, and none at all below
    1e-3.
    """
    found = []
    for unit in (1.0, 1e-9, 1e-6, 0.3048, 1e6):
        ground, edges = scaled_ground(unit, half)
        mesh = meshes.graded(ground, edges, spacing=0.15 * unit, levels=2)
        x = np.array([vertex.point for vertex in mesh.vertices])
        found.append(
            ([tuple(vertex.nr for vertex in element.vertices) for element in mesh.Elements()], x / unit)
        )
        assert all(np.any(x[x[:, 1] == 0, 0] == edge) for edge in (*edges, *ground.reach))
        assert np.count_nonzero(x[:, 1] == 0) > 20  # exactly there
        assert not half or np.count_nonzero(x[:, 0] == 0) > 5
    for elements, x in found[1:]:
        assert elements == found[0][0] and np.abs(x - found[0][1]).max() < 1e-9  # of 1000


def test_a_graded_mesh_can_be_cut():
    """Where it is, in its own unit: it was made in another."""
    ground = meshes.Ground(4e-3, (-1e-3, 1e-3), half=False)
    mesh = meshes.graded(ground, [0.3e-3], spacing=0.3e-3, levels=0)
    finer = ng.Mesh(mesh.ngmesh.Copy())
    cut(finer, np.arange(mesh.ne) < 20)
    finer.Curve(3)
    assert finer.ne > mesh.ne and ng.Integrate(1, finer) == pytest.approx(2 * (4e-3) ** 2, rel=1e-12)


@pytest.mark.parametrize("make", [graded_body, disc])
def test_energy_is_half_the_work(make):
    body = Condensed(make())
    x = body.points[:, 0]
    # loads as rough as noise would see that quadrilaterals that are no parallelograms are integrated to their
    # order only
    loads = np.concatenate((body.weights * np.cos(x), 0.3 * body.weights * np.sin(2 * x)))
    energy = body.fields(*np.split(loads, 2)).energy()
    # integration on curved sides
    assert energy == pytest.approx(loads @ body.compliance.matrix @ loads / 2, rel=1e-7)


@pytest.mark.parametrize("make", [graded_body, disc])
def test_what_is_between_nodes_follows_from_those_of_each_facet(make):
    """Facets of several orders, and curved ones, whose nodes lie elsewhere: all at once, and one by one."""
    nodes = Condensed(make())
    facets = Facets(nodes)
    x = np.random.default_rng(0).uniform(facets.left[0], facets.right[-1], 200)
    values = np.cos(nodes.points[:, 0]), nodes.points[:, 0] ** 2
    on = facets.below(x) >= 0  # a boundary that faces downwards elsewhere
    found = facets.interpolate(np.array(values), x[on])
    upper = np.unique(np.concatenate(facets.members))
    assert len(nodes.points) >= len(upper) and on.any()
    for own, each in zip(found, values):
        for number, members in enumerate(facets.members):
            here = facets.below(x[on]) == number
            polynomial = np.polynomial.Polynomial.fit(
                nodes.points[members, 0], each[members], len(members) - 1
            )
            # rounding of polynomials of order 6 or less; places of curved facets' nodes are rounded to 1e-9
            assert own[here] == pytest.approx(polynomial(x[on][here]), abs=1e-8)


def test_nodes_lie_where_the_contact_facets_have_theirs():
    body = disc()
    nodes, facets = Condensed(body), ContactFacets(body, Microblock(), Cylinder(3.0))
    for name in ("points", "weights", "normals"):
        assert getattr(nodes, name) == pytest.approx(getattr(facets, name), abs=1e-14)
    # outwards, on the circle to the accuracy of its curved sides
    assert nodes.normals == pytest.approx(nodes.points, abs=1e-2)
    assert np.linalg.eigvalsh(nodes.compliance.matrix).min() > -1e-13  # 0 where the ends are held


def test_normals_point_outwards_whichever_way_the_geometry_runs():
    for points in ([(0, 0), (1, 0), (1, -1), (0, -1)], [(0, 0), (0, -1), (1, -1), (1, 0)]):
        face = occ.Face(
            occ.Wire(
                [
                    occ.Edge(occ.Vertex(occ.Pnt(*a, 0)), occ.Vertex(occ.Pnt(*b, 0)))
                    for a, b in zip(points, points[1:] + points[:1])
                ]
            )
        )
        for edge in face.edges:
            edge.name = "contact" if edge.center.y > -1e-9 else "bottom"
        mesh = ng.Mesh(occ.OCCGeometry(face, dim=2).GenerateMesh(maxh=0.7))
        body = Body(mesh, SOLID, 2, fixed="bottom")
        assert np.all(Condensed(body).normals[:, 1] == 1)
        assert np.all(ContactFacets(body, Microblock(), Cylinder(3.0)).normals[:, 1] == 1)


@pytest.mark.parametrize("obstacle", [Cylinder(3.0), Wedge(0.1)])
def test_axis_node_has_one_multiplier(graded, obstacle):
    flexibility, gaps, share = graded.compliance.corner_system(Microblock(), obstacle)
    count = len(graded.weights)
    assert graded.points[0, 0] == 0
    assert np.isfinite(gaps[0]) and np.isinf(gaps[count]) and np.isfinite(np.delete(gaps, count)).all()
    kept = np.isfinite(gaps)
    assert np.linalg.eigvalsh(flexibility[np.ix_(kept, kept)]).min() > 0
    # what the second would do
    assert np.linalg.matrix_rank(flexibility[np.ix_([0, count], [0, count])]) == 1


def block_with_hole(spacing, order):
    """A block of 4 x 2 with a hole under its surface, from a geometry of the user's."""
    face = occ.Rectangle(4, 2).Face().Move((-2, -2, 0)) - occ.Circle((0.3, -0.9), 0.4).Face()
    for edge in face.edges:
        edge.name = "bottom" if abs(edge.center.y + 2) < 1e-9 else "free"
        if abs(edge.center.y) < 1e-9:
            edge.name, edge.maxh = "contact", spacing
    mesh = ng.Mesh(occ.OCCGeometry(face, dim=2).GenerateMesh(maxh=0.5, grading=0.4))
    mesh.Curve(order)
    return Condensed(Body(mesh, SOLID, order, fixed="bottom"))


# pressures of the punch have no bound at its edges
@pytest.mark.parametrize("obstacle, change", [(Cylinder(5.0), 1e-4), (Punch(0.5, 0.02), 1e-2)])
def test_block_with_hole(obstacle, change):
    """A body that is no half-plane: energy of the fields and work of the corners, and convergence of the
    approach.
    """
    law, approaches = Microblock(), []
    for spacing, order in ((0.2, 2), (0.1, 4), (0.05, 5)):
        body = block_with_hole(spacing, order)
        flexibility, gaps, share = body.compliance.corner_system(law, obstacle)
        state = active_set.solve(flexibility, gaps, load=0.05, c=share)
        loads = body.compliance.onto_corners(law).T @ state.forces
        per_corner = state.forces.reshape(len(law.corners), -1)
        assert body.compliance.loads(law, per_corner) == pytest.approx(loads, abs=1e-13)  # rounding
        energy = body.fields(*np.split(loads, 2)).energy()
        pressed = state.forces > 0
        work = state.forces[pressed] @ (state.approach * share[pressed] - gaps[pressed]) / 2
        # rounding; integration on curved sides
        assert energy == pytest.approx(work, rel=1e-8 if order >= 4 else 1e-5)
        approaches.append(state.approach)
    assert abs(approaches[2] - approaches[1]) < change * approaches[2]


def test_orders_of_elements_reach_the_edges():
    body = graded_body()
    numbers = body.element_orders
    assert numbers.max() == 6 and numbers.min() == 1
    everywhere = Body(body.mesh, SOLID, 6, fixed=GROUND.supports)
    # at the tips; a square this small has no far field
    assert sum(body.space.FreeDofs()) < 0.6 * sum(everywhere.space.FreeDofs())
    same = Body(body.mesh, SOLID, np.full(body.mesh.ne, 3), fixed=GROUND.supports)
    plain = Body(body.mesh, SOLID, 3, fixed=GROUND.supports)
    assert same.space.ndof == plain.space.ndof
    load = Loads(traction={"contact": (0, -1)})
    assert same.solve(load).energy() == pytest.approx(plain.solve(load).energy(), rel=1e-12)


def test_graded_mesh_shrinks_towards_the_edges():
    coarse, fine = (meshes.graded(GROUND, EDGES, spacing=0.5, levels=levels) for levels in (0, 4))
    nearest = [
        min(abs(x - 0.5) for x in (vertex.point[0] for vertex in mesh.vertices) if abs(x - 0.5) > 1e-12)
        for mesh in (coarse, fine)
    ]
    assert nearest[1] < 1.01 * meshes.RATIO**4 * nearest[0] and fine.ne < 2 * coarse.ne + 60
    assert set(fine.GetBoundaries()) == {"contact", "free", "side", "bottom", "axis"}


def test_uniform_mesh_is_the_papers():
    mesh = meshes.uniform(meshes.Ground(18.0, (0.0, 2.0)), 0.02)
    assert 3 * mesh.nv == pytest.approx(130_000, rel=0.02)  # "about 130 000 unknowns"
    surface = np.sort([vertex.point[0] for vertex in mesh.vertices if vertex.point[1] == 0])
    assert np.diff(surface)[:100] == pytest.approx(np.full(100, 0.02)) and surface[-1] == 18
