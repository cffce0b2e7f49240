"""Load paths of bodies that are meshes in space: events against cells of a half-space and plane bodies.

A column below one period of a wave that is even in x1 and x2, between four planes of symmetry, is a periodic
half-space but for exp(-2 pi) of its depth, and a slab between two such planes is a body in the plane.
"""

import netgen.occ as occ
import ngsolve as ng
import numpy as np
import pytest
from ngsolve.meshes import MakeStructured2DMesh

import microblock as mb
from microblock.contact_solvers.cell_path import CellScan
from microblock.contact_solvers.fft_compliance import spots
from microblock.fem import meshes3d
from microblock.fem.contact_nodes import ContactNodes
from microblock.fem.path3d import NodeScan
from tests.library.test_tetrahedra import flat

CLASSICAL = mb.Elastic(E=100, nu=0.3)
NEARLY = mb.Cosserat(E=100, nu=0.3, ell=1e-3, beta=1e-3)  # which a half-space takes for it
HEIGHT = 1e-3
SIDE = 0.5  # of the column, half a period


def hexahedra(count, depth=1.0):
    """A column of as many facets along each side."""
    x = np.linspace(0, SIDE, count + 1)
    return meshes3d.block(x, x, -meshes3d.graded(SIDE, SIDE / count, depth, 1.5)[::-1])


def tetrahedra(size, depth=1.0):
    box = occ.Box((0, 0, -depth), (SIDE, SIDE, 0))
    sides = {occ.X: ("left", "right"), occ.Y: ("front", "back"), occ.Z: ("bottom", "contact")}
    for axis, (least, most) in sides.items():
        box.faces.Min(axis).name = least
        box.faces.Max(axis).name = most
    box.faces.Max(occ.Z).maxh = size
    return ng.Mesh(occ.OCCGeometry(box).GenerateMesh(maxh=3 * size))


def column(mesh, order, solid=CLASSICAL):
    fixed = meshes3d.supports("bottom", x1="left|right", x2="front|back")
    return mb.Body(mesh, solid, order, fixed=fixed)


class OfColumn(CellScan):
    """Cells of a half-space, of which those above the column count."""

    def labels(self, flags):
        half = len(flags) // 2
        labels = np.zeros(flags.shape, int)
        labels[half:, half:] = spots(flags[half:, half:], False)
        return labels


def on_cells(obstacle, last, nodes):
    """Events of a periodic half-space, with loads of a quarter of the period."""
    solver = mb.Contact(
        mb.HalfSpace(NEARLY, period=2 * SIDE), obstacle, mb.Unilateral(), mb.Cells(nodes=nodes)
    ).solver
    scan = OfColumn(solver, solver.window_of(4 * last).with_count(nodes))
    _, events = scan.down_from(4 * last)
    return [(event.kind, event.zone, event.load / 4, event.x) for event in events]


def crossed(x1, x2):
    """Waves in both directions: crests over two corners of the column, and a saddle in its middle."""
    return HEIGHT * (1 - np.cos(2 * np.pi * x1) * np.cos(2 * np.pi * x2))


CLOSED = np.sqrt(2) * np.pi * NEARLY.E_star * HEIGHT / 4  # Johnson, Greenwood and Higginson: full contact


def drawn(seed):
    """An even wave, and a load that closes a part of it."""
    amplitudes = np.random.default_rng(seed).normal(size=(3, 3)) / np.add.outer(
        1.0 + np.arange(3), np.arange(3)
    )
    numbers = [(i, j) for i in range(3) for j in range(3) if i + j]

    def height(x1, x2):
        waves = (
            amplitudes[i, j] * np.cos(2 * np.pi * i * x1) * np.cos(2 * np.pi * j * x2) for i, j in numbers
        )
        return 0.01 - HEIGHT * sum(waves)

    full = sum(abs(amplitudes[i, j]) * np.hypot(i, j) for i, j in numbers)
    return height, 0.15 * np.pi * NEARLY.E_star * HEIGHT * full


def compared(seed, mesh, order, cells):
    """[(true error, load_error), ...] of the events on a drawn wave, over their loads."""
    obstacle, last = drawn(seed)
    reference = on_cells(obstacle, last, cells)
    path = mb.Contact(column(mesh, order), obstacle, mb.Unilateral()).path(load=last)
    errors = []
    for event in path.events:
        if event.load > path.first:
            load = min(
                (
                    load
                    for kind, zone, load, x in reference
                    if (kind, zone) == (event.kind, event.zone) and abs(x - event.x) < 0.2
                ),
                key=lambda load: abs(load - event.load),
            )
            errors.append((abs(event.load - load) / load, event.load_error / load))
    return errors


@pytest.mark.parametrize(
    "mesh, order",
    [pytest.param("hexahedra", 1, marks=pytest.mark.nightly), ("hexahedra", 2), ("tetrahedra", 2)],
)
def test_crossed_waves_merge_where_cells_do(mesh, order):
    # nodes are 1/16 apart, and on tetrahedra somewhat less
    mesh = tetrahedra(0.1) if mesh == "tetrahedra" else hexahedra(8 // order)
    path = mb.Contact(column(mesh, order), crossed, mb.Unilateral()).path(load=0.8 * CLOSED)
    [reference] = [load for kind, _, load, _ in on_cells(crossed, 0.8 * CLOSED, 64) if kind == "merged"]
    *born, merged = path.events
    # of crests over tetrahedra no node lies as low as another
    assert [(event.kind, event.load <= event.load_error) for event in born] == [("born", True)] * 2
    assert (merged.kind, merged.zone) == ("merged", "contact")
    assert abs(merged.load - reference) <= merged.load_error < 0.2 * merged.load
    assert merged.x == pytest.approx(SIDE / 2, abs=SIDE / 8)
    before, after = (path.at(factor * merged.load).contact_area for factor in (0.9, 1.1))
    assert before < after


def test_events_of_a_drawn_wave_are_within_their_errors():
    errors = compared(2, hexahedra(4), 2, cells=64)
    assert len(errors) == 2
    assert all(error <= load_error < 0.1 for error, load_error in errors)


@pytest.mark.nightly
def test_errors_of_events_hold_and_are_not_wide():
    """Of fourteen waves, in two of which nothing happens above the first load."""
    errors = [compared(seed, hexahedra(6), 2, cells=128) for seed in range(14)]
    assert sum(map(bool, errors)) >= 8
    true, load_errors = np.concatenate([scene for scene in errors if scene]).T
    assert np.all(true <= load_errors)
    assert np.median(load_errors / true) < 5


BLOCKS = mb.Cosserat(E=100, nu=0.3, ell=0.2, beta=1)


@pytest.mark.parametrize(
    "solid, law, height, last, allowed",
    [
        (CLASSICAL, mb.Unilateral(), lambda x1: HEIGHT * (1.1 - np.cos(4 * np.pi * x1) + x1 / 10), 0.8, 0.05),
        # edges of two corners cross: the load converges like the distance of nodes to the power 0.7
        pytest.param(
            BLOCKS, mb.Microblock(), lambda x1: x1**2 / 20, 1.0, 1.0, marks=pytest.mark.nightly, id="blocks"
        ),
    ],
)
def test_a_slab_has_the_events_of_a_body_in_the_plane(solid, law, height, last, allowed):
    width = 0.06
    x = np.linspace(-0.5, 0.5, 17)
    depths = -meshes3d.graded(0.25, 1 / 16, 1.0, 1.6)[::-1]
    fixed = meshes3d.supports("bottom", x2="front|back")
    slab = mb.Body(meshes3d.block(x, [0, width], depths), solid, 2, fixed=fixed)
    mesh = MakeStructured2DMesh(nx=64, ny=40, mapping=lambda s, t: (s - 0.5, t**2 / 4 + 0.75 * t - 1))
    plane = mb.Body(mesh, solid, 2, fixed="bottom", contact="top")
    path = mb.Contact(slab, lambda x1, x2: height(x1), law).path(load=last * width)
    reference = mb.Contact(plane, height, law).path(load=last)
    merged = [event for event in path.events if event.kind == "merged"]
    expected = [event for event in reference.events if event.kind == "merged"]
    assert len(merged) == len(expected) > 0
    for event, other in zip(merged, expected):
        assert event.x == pytest.approx(other.x, abs=1 / 32)
        # nodes in the plane are half as far apart
        assert abs(event.load - width * other.load) <= event.load_error + width * other.load_error
        assert event.load_error < allowed * event.load


def test_a_flat_punch_touches_all_at_once_and_stays():
    x = np.linspace(-1, 1, 9)
    body = mb.Body(meshes3d.block(x, x, np.linspace(-1, 0, 5)), CLASSICAL, 1, fixed="bottom")
    for obstacle in (mb.FlatPunch(0.55), flat):
        path = mb.Contact(body, obstacle, mb.Unilateral()).path(load=0.5)
        [event] = path.events
        assert (event.load, event.load_error, event.kind, event.zone) == (0.0, 0.0, "born", "contact")
        assert event.x == pytest.approx(0, abs=1e-12)


def test_full_contact_begins_below_the_middle_of_a_sphere():
    """Where an obstacle is twisted four corners close on lines alone, which are no zones."""
    solid = mb.Cosserat(E=100, nu=0.3, ell=0.15, beta=1)
    body = column(hexahedra(4), 2, solid)
    path = mb.Contact(body, mb.Sphere(R=10), mb.Microblock()).path(load=0.15)
    [event] = [event for event in path.events if event.zone == "full"]
    assert event.kind == "born"
    # on 96 x 96 cells of a period: full contact of 0.0039 at a load of 0.1, and of 0.0156 at 0.15
    assert event.load - event.load_error < 0.05 < 0.1 < event.load + event.load_error
    assert path.warnings == [
        f"up to load {event.load + event.load_error:.2g} zones have few nodes: events there may be missing; "
        "take smaller elements"
    ]
    events = mb.Contact(body, crossed, mb.Microblock()).path(load=2 * CLOSED).events
    assert {event.zone for event in events} == {"contact"}


def test_a_path_down_is_the_path_up():
    problem = mb.Contact(column(hexahedra(4), 1), crossed, mb.Unilateral())
    loads = [0.1 * CLOSED, 0.4 * CLOSED, 0.8 * CLOSED]
    up = problem.states(loads)
    down = problem.states(loads[::-1])[::-1]
    for rising, falling in zip(up, down):
        assert falling.contact_area == rising.contact_area
        assert falling.pressure == pytest.approx(rising.pressure, rel=1e-9, abs=1e-9 * rising.pressure.max())


def test_paths_take_an_rtol_where_meshes_are_refined():
    refined = mb.Contact(column(tetrahedra(0.25), 2), crossed, mb.Unilateral()).path(
        load=0.1 * CLOSED, rtol=0.5
    )
    assert refined.at(0.1 * CLOSED).error_estimate <= 0.5
    assert [event.kind for event in refined.events] == ["born", "born"]
    hexahedral = mb.Contact(column(hexahedra(2), 1), crossed, mb.Unilateral())
    with pytest.raises(mb.BadArgument, match="does not follow events"):
        hexahedral.with_(method=mb.Newton("penalty", rho=1e4)).path(load=0.1)


@pytest.mark.nightly
def test_newtons_method_has_the_events_of_condensed_bodies():
    problem = mb.Contact(column(hexahedra(4), 1), crossed, mb.Unilateral())
    condensed, newton = (
        problem.with_(method=method).path(load=0.8 * CLOSED).events
        for method in (mb.Condensed(), mb.Newton())
    )
    assert [event.kind for event in newton] == ["born", "born", "merged"]
    for event, other in zip(newton, condensed):
        # zones are the same, and residuals 1e-9
        assert event.load == other.load
        assert event.load_error == pytest.approx(other.load_error, rel=1e-6)


@pytest.mark.parametrize("mesh, size, order, alone", [(hexahedra, 2, 2, 1), (tetrahedra, 0.25, 2, 0)])
def test_nodes_are_connected_along_facets(mesh, size, order, alone):
    nodes = ContactNodes(column(mesh(size), order))
    everywhere = np.ones(len(nodes.points), bool)
    assert np.all(nodes.connected(everywhere) == 1) and np.all(nodes.filling(everywhere))
    x1, x2 = nodes.points[:, 0], nodes.points[:, 1]
    halves = nodes.connected((x1 < 0.2) | (x1 > 0.3))
    assert set(halves[x1 < 0.2]) == {1} and set(halves[x1 > 0.3]) == {2}
    corner = np.zeros(len(x1), bool)
    corner[np.argmin(x1 + x2)] = True
    assert not nodes.filling(corner).any()
    assert np.count_nonzero(nodes.beside(corner)) == np.count_nonzero(nodes.neighbours[corner].toarray())


def test_a_scan_of_nodes_names_places():
    scan = NodeScan(mb.Contact(column(hexahedra(4), 1), crossed, mb.Unilateral()).solver)
    x1, x2 = scan.nodes.points[:, 0], scan.nodes.points[:, 1]
    labels = scan.labels((x1 + x2 < 0.2) | (x1 + x2 > 0.8))
    [merged] = scan.changes(labels, scan.labels(labels >= 0))
    assert (merged.kind, scan.place(merged)) == ("merged", pytest.approx(SIDE / 2, abs=SIDE / 8))
    [born] = scan.changes(labels * (labels == 1), labels)
    assert (born.kind, scan.place(born)) == ("born", pytest.approx(x1[labels == 2].mean()))


def test_the_stiffness_below_the_surface_has_its_error():
    """Three layers of elements are too stiff by 1 %, which pressures, of as fine facets, do not see."""

    def wave(x1, x2):
        return HEIGHT * (2 - np.cos(2 * np.pi * x1) - np.cos(2 * np.pi * x2))

    x = np.linspace(0, SIDE, 9)
    loads = []
    errors = []
    for z in ([-1.0, -0.4, -0.15, 0.0], np.linspace(-1, 0, 13)):
        problem = mb.Contact(column(meshes3d.block(x, x, np.array(z)), 1), wave, mb.Unilateral())
        state = problem.solve(approach=4 * HEIGHT)
        loads.append(state.load)
        errors.append(NodeScan(state.solution.solver).stiffness_error(state.solution))
    assert 0.2 * errors[0] < loads[0] / loads[1] - 1 < errors[0]
    assert errors[1] < errors[0] / 2
