"""No contact is missed: obstacles with several low places, narrow features, and zones that are born far
from the others."""

import numpy as np
import pytest

import microblock as mb
from microblock.halfplane import line_solver
from microblock.model.picture import picture
from microblock.model.problem import Problem
from tests.states import apart

SOLID = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.085)
HERTZ = np.sqrt(4 * 10 / (np.pi * SOLID.E_star))  # a of a cylinder of radius 10 under the load 1
LAWS = pytest.mark.parametrize(
    "law",
    [mb.Unilateral(), mb.Microblock(), mb.Microblock(0.01), mb.Microclamped()],
    ids=["unilateral", "microblock", "rotated", "microclamped"],
)


def cylinders(half_distance):
    return lambda x: np.minimum((x - half_distance) ** 2, (x + half_distance) ** 2) / 20


def hill(x):
    return x**2 / 20 - 0.05 * np.exp(-(((x - 1.1) / 0.14) ** 2))


def contact(obstacle, law, method=None):
    return mb.Contact(mb.HalfPlane(SOLID), obstacle, law, method)


def of_cells(obstacle, law, load, nodes=2**14):
    """The state on cells of all of the window in which the obstacle could touch."""
    stretches = picture(Problem(SOLID, law, obstacle), load).stretches
    window = stretches[0][0] - 0.2, stretches[-1][1] + 0.2
    return contact(obstacle, law, mb.Cells(nodes=nodes, window=window)).solve(load=load)


def missed(state, cells):
    """Relative L2 difference of the pressure at the cells, for which these are good to their own estimate."""
    return float(np.linalg.norm(state.pressure_at(cells.x) - cells.pressure) / np.linalg.norm(cells.pressure))


@LAWS
@pytest.mark.parametrize("distance", [2.5, 10, 50])
def test_each_of_two_cylinders_carries_its_half(law, distance):
    state = contact(cylinders(distance * HERTZ / 2), law).solve(load=1.0, rtol=1e-4)
    left = state.x < 0
    share = state.weights[left] @ state.pressure[left]
    assert share == pytest.approx(0.5, abs=2e-4)  # two errors of 1e-4 in L2 of p
    # each as if it were alone, but for (a/distance)^2 and what blocks that lean do to the two of them
    if distance == 50:
        alone = contact(mb.Cylinder(R=10), law).solve(load=0.5, rtol=1e-4)
        assert state.pressure.max() == pytest.approx(alone.pressure.max(), rel=2e-3)


@LAWS
def test_a_hill_beside_a_cylinder_is_seen(law):
    state, cells = contact(hill, law).solve(load=1.0, rtol=1e-4), of_cells(hill, law, 1.0)
    counts = [{name: len(own) for name, own in each.zones.items()} for each in (state, cells)]
    assert counts[0] == counts[1]
    assert state.zones["contact"][-1][0] > 1 and missed(state, cells) < cells.error_estimate


@pytest.mark.parametrize("seed", range(6))
def test_random_waves_on_a_parabola_are_those_of_cells(seed):
    rng = np.random.default_rng(seed)
    k, phase, size = rng.uniform(2, 12, 5), rng.uniform(0, 2 * np.pi, 5), rng.uniform(0.2, 1, 5)

    def height(x):
        return x**2 / 20 + 0.004 * np.sum(size * np.cos(np.multiply.outer(x, k) + phase), axis=-1)

    law = (mb.Unilateral(), mb.Microblock(), mb.Microblock(-0.01))[seed % 3]
    state, cells = contact(height, law).solve(load=1.0, rtol=1e-4), of_cells(height, law, 1.0)
    assert missed(state, cells) < cells.error_estimate


@pytest.mark.parametrize("width", [0.01, 0.003])
def test_narrow_pits_have_panels_of_their_own(width):
    def height(x):
        return x**2 / 20 + 0.2 * width**2 * np.exp(-(((x - 0.1) / (width * HERTZ)) ** 2))

    here = contact(height, mb.Unilateral())
    rough, fine = here.solve(load=1.0, rtol=1e-3), here.solve(load=1.0, rtol=1e-7)
    assert apart(rough, fine) < rough.error_estimate <= 1e-3
    plain = contact(mb.Cylinder(R=10), mb.Unilateral()).solve(load=1.0, rtol=1e-3)
    # the pit shows: what an estimate that does not see it would leave
    assert apart(plain, fine) > 1e-3
    cells = of_cells(height, mb.Unilateral(), 1.0, nodes=2**15)
    assert missed(fine, cells) < cells.error_estimate


@pytest.mark.nightly(24, *range(6))
def test_smooth_bumps_and_short_waves_are_answered(seeds):
    """Three bumps and three waves, at night twelve: zones there are narrow, many, and next to meeting each
    other.
    """
    rng, worst = np.random.default_rng(1080), 0.0
    for number in seeds:
        size, width, place = rng.uniform(0.0005, 0.01), rng.uniform(0.1, 0.4), rng.uniform(-0.2, 0.2)
        bump = (
            (lambda x: x**2 / 20 - size * np.exp(-(((x - place) / width) ** 2)))
            if number % 2
            else (lambda x: x**2 / 20 + size / 10 * np.cos(x / width * 6 + place))
        )
        state = contact(bump, mb.Microblock()).solve(load=rng.choice([0.1, 0.5, 2.0]), rtol=1e-3)
        worst = max(worst, state.error_estimate)
    assert worst <= 1e-3


def test_what_a_neighbour_leaves_out_is_seen():
    """A state of one cylinder of two to begin with: the other overlaps, far from all zones."""
    alone = contact(lambda x: (x - 1.5) ** 2 / 20, mb.Unilateral()).solve(load=1.0)
    state = contact(cylinders(1.5), mb.Unilateral()).solve(load=1.0, rtol=1e-4, initial=alone)
    left = state.x < 0
    assert state.weights[left] @ state.pressure[left] == pytest.approx(0.5, abs=2e-4)  # by symmetry, to rtol


def test_cells_answer_where_panels_do_not(monkeypatch):
    def fails(*_):
        raise mb.NotConverged("no zones fit")

    here = contact(cylinders(1.5), mb.Microblock())
    panels = here.solve(load=1.0, rtol=1e-4)
    monkeypatch.setattr(line_solver.LineSolver, "solve", fails)
    state = here.solve(load=1.0, rtol=1e-2)
    assert (panels.method, state.method) == ("panels", "cells")
    assert any("uniform cells instead of panels (no zones fit)" in each for each in state.warnings)
    assert missed(panels, state) < state.error_estimate <= 1e-2
    with pytest.raises(mb.NotConverged, match="uniform cells: rtol = 1e-08 was not reached .*ask for rtol="):
        here.solve(load=1.0, rtol=1e-8)
    with pytest.raises(mb.NotConverged, match="^no zones fit$"):
        here.with_(method=mb.Panels(fallback=False)).solve(load=1.0)


def test_noise_is_refused_by_name_and_soon():
    with pytest.raises(mb.BadArgument, match="obstacle = .*smooth but for some places"):
        contact(lambda x: x**2 / 20 + 1e-5 * np.sin(1e9 * x), mb.Unilateral()).solve(load=1.0)
    with pytest.raises(mb.BadArgument, match="psi0 = .*smooth but for some places"):
        contact(mb.Cylinder(R=10), mb.Microblock(lambda x: 0.01 * np.sin(1e7 * x))).solve(load=1.0)


@pytest.mark.parametrize(
    "obstacle",
    [
        lambda x: np.where(x < 0.1, x**2 / 20, x**2 / 20 + 0.01),
        lambda x: np.where(np.abs(np.abs(x) - 1) < 0.3, 0 * x, np.inf),
    ],
    ids=["step", "two punches"],
)
def test_heights_that_jump_are_refused(obstacle):
    with pytest.raises(mb.BadArgument, match="must not jump, as its height does at x ="):
        contact(obstacle, mb.Unilateral()).solve(load=1.0)


def test_edges_of_a_mere_function_are_found():
    told = contact(mb.Punch(half_width=0.3), mb.Unilateral()).solve(load=1.0, rtol=1e-4)
    height = contact(lambda x: np.where(np.abs(x) <= 0.3, 0 * x, np.inf), mb.Unilateral())
    bare = height.solve(load=1.0, rtol=1e-4)
    assert bare.half_width == pytest.approx(told.half_width, rel=1e-12)
    x = np.linspace(-0.29, 0.29, 7)
    assert bare.pressure_at(x) == pytest.approx(told.pressure_at(x), rel=1e-4)  # both promise it in L2


def test_a_second_contact_is_born_where_cells_have_it():
    """Two higher cylinders beside the first: on either side of each birth cells have as many zones as the
    path."""

    def height(x):
        return np.minimum(x**2, (np.abs(x) - 1.2 * HERTZ) ** 2 + 0.02 * HERTZ**2) / 20

    law = mb.Unilateral()
    path = contact(height, law).path(load=0.3)
    births = [
        event
        for event in path.events
        if event.kind == "born" and event.zone == "contact" and event.load > 1e-3
    ]
    assert {np.sign(event.x) for event in births} == {-1, 1}
    for beside, there in ((0.98, False), (1.02, True)):
        cells = of_cells(height, law, beside * births[0].load)
        outer = [own for own in cells.zones["contact"] if abs(own[0] + own[1]) > HERTZ]
        assert bool(outer) == there
    assert all(event.load_error < 1e-3 * event.load for event in births)


def test_a_zone_that_is_born_and_merges_within_one_step_of_the_scan_is_found():
    def height(x):  # a flat bump beside the cylinder's edge: touched just before the edge arrives
        return x**2 / 20 - 0.0011 * np.exp(-(((x - 0.45) / 0.05) ** 2))

    events = contact(height, mb.Unilateral()).path(load=1.5).events
    born = next(event for event in events if event.kind == "born" and event.load > 0)
    merged = next(event for event in events if event.kind == "merged")
    assert born.x > 0.3 and 1 < merged.load / born.load < 2.5  # the step of the scan
    for load, number in (
        (0.99 * born.load, 1),
        ((born.load * merged.load) ** 0.5, 2),
        (1.01 * merged.load, 1),
    ):
        assert len(of_cells(height, mb.Unilateral(), load).zones["contact"]) == number


def test_a_narrow_bump_between_two_contacts_is_found_as_soon_as_it_touches():
    """The gap of the two contacts alone says how high it is then."""

    def twins(x):
        return np.minimum((x + 0.5) ** 2, (x - 0.6) ** 2) / 20

    def state(height, rtol=1e-3):
        problem = mb.Contact(mb.HalfPlane(SOLID), mb.Obstacle(height), mb.Unilateral(), mb.Panels())
        return problem.solve(load=0.6, rtol=rtol)

    least = float(twins(0.05) - state(twins, 1e-5).gap_at("C", np.array([0.05]))[0])
    for share, count in ((0.99, 3), (1.01, 2)):
        bump = state(lambda x, z=share * least: np.minimum(twins(x), (x - 0.05) ** 2 / 0.02 + z))
        assert len(bump.zones["contact"]) == count
