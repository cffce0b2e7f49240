"""What a user relies on without looking: paths that miss no zone, periods that fit, evenness that is so,
accuracy kept.
"""

import numpy as np
import pytest

import microblock as mb
from microblock.halfplane.kernels import short_waves

SOLID = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.085)


def skew(x):
    return x**2 / 20 + 0.003 * np.sin(7 * x + 1)


@pytest.mark.parametrize("last", [0.4, 1.0, 1.3])
def test_a_zone_that_is_born_and_merges_is_found_wherever_the_path_ends(last):
    """It lives from load 0.3104 to 0.38: between two loads of the scan, and no gap has a minimum at the
    first.
    """
    events = mb.Contact(mb.HalfPlane(SOLID), skew, mb.Unilateral()).path(last).events
    assert [event.kind for event in events] == ["born", "born", "merged"]
    # as by fitted elements, whose meshes see it to 0.1 %
    assert [event.load for event in events[1:]] == pytest.approx([0.3104, 0.3814], rel=2e-3)


def test_a_zone_of_one_corner_is_found_as_well():
    events = mb.Contact(mb.HalfPlane(SOLID), skew, mb.Microblock(0.01)).path(1.0).events
    kinds = [(event.zone, event.kind) for event in events if event.zone == "B" and event.load > 0.1]
    assert kinds == [("B", "born"), ("B", "merged")]


@pytest.mark.parametrize("slope, load", [(0.002, 1.0), (0.001, 0.5), (1e-4, 0.05)])
def test_a_slope_discontinuity_at_zero_of_a_mere_function_is_found(slope, load):
    """It lies at an edge of the intervals on which a symmetric height is sampled; not seen, the logarithm
    there costs 1e-3 to 2.5e-3 of the pressure.
    """

    def height(x):
        return x**2 / 20 + slope * np.abs(x)

    named = mb.Obstacle(height, kinks=(0.0,), jumps=(2 * slope,))
    found, right = (
        mb.Contact(mb.HalfPlane(SOLID), obstacle, mb.Unilateral()).solve(load=load, rtol=rtol)
        for obstacle, rtol in ((height, 1e-3), (named, 1e-5))
    )
    off = right.pressure - found.pressure_at(right.x)
    error = np.sqrt(right.weights @ off**2 / (right.weights @ right.pressure**2))
    assert error <= found.error_estimate + right.error_estimate


@pytest.mark.parametrize("law", [mb.Unilateral(), mb.Microblock()])
def test_wedges_as_mere_functions_are_wedges(law):
    named = mb.Contact(mb.HalfPlane(SOLID), mb.Wedge(0.05), law).solve(load=0.5, rtol=1e-5)
    found = mb.Contact(mb.HalfPlane(SOLID), lambda x: 0.05 * np.abs(x), law).solve(load=0.5)
    assert found.half_width == pytest.approx(named.half_width, rel=found.error_estimate)


@pytest.mark.parametrize(
    "obstacle, period",
    [(mb.Wave(0.001, 1.0), 1.5), (mb.Rough(1.0, 0.1), 0.7), (lambda x: (x - 1.2) ** 2 / 20, 3.0)],
)
def test_what_does_not_repeat_with_the_period_raises(obstacle, period):
    with pytest.raises(mb.BadArgument, match="period"):
        mb.Contact(mb.HalfPlane(SOLID, period=period), obstacle, mb.Microblock())


def test_rotations_repeat_with_the_period():
    with pytest.raises(mb.BadArgument, match="psi0"):
        mb.Contact(mb.HalfPlane(SOLID, period=1.0), mb.Wave(0.001, 1.0), mb.Microblock(lambda x: 0.01 * x))
    assert mb.Contact(mb.HalfPlane(SOLID, period=2.0), mb.Wave(0.001, 1.0), mb.Microblock(0.01)).solver


def test_evenness_is_looked_at():
    class Claimed:
        even = True

        def height(self, x):
            return skew(np.asarray(x))

    class EvenLaw(mb.Microblock):
        even = True

    for obstacle, law in ((Claimed(), mb.Unilateral()), (mb.Cylinder(10), EvenLaw(0.05))):
        with pytest.raises(mb.BadArgument, match="says that it is even"):
            mb.Contact(mb.HalfPlane(SOLID), obstacle, law)


def test_an_initial_state_keeps_the_accuracy_that_is_promised():
    cells = mb.Contact(mb.HalfPlane(SOLID), mb.Cylinder(10), mb.Microblock(), mb.Cells())
    few = cells.with_(method=mb.Cells(nodes=64)).solve(1.0)
    assert cells.solve(0.05, initial=few).error_estimate <= 1e-2


def test_a_rough_state_says_so():
    state = mb.Contact(mb.HalfPlane(SOLID), mb.Cylinder(10), mb.Microblock(), mb.Cells(32, (-5, 5))).solve(
        1.0
    )
    assert state.error_estimate > 0.1 and any("error estimate" in words for words in state.warnings)


def test_a_path_that_ends_among_many_small_zones_begins_at_first_touch():
    """Each zone is small against a block, but most are not there at first touch."""

    def height(x):
        return x**2 / 20 + 2e-4 * np.cos(2 * np.pi * x / 0.1 + 0.3)

    solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=1.0)
    path = mb.Contact(mb.HalfPlane(solid), height, mb.Unilateral()).path(0.3)
    late = [event for event in path.events if event.load > 0]
    assert len(late) > 1 and all(event.load_error < 1e-3 * event.load for event in late)
    # the number of zones of a state at the end is that of the events
    assert len(path.at(0.3).zones["contact"]) == 1 + sum(
        {"born": 1, "merged": -1}[event.kind] for event in late
    )


@pytest.mark.parametrize("rtol", [1e-3, 1e-4])
def test_no_gap_is_left_in_a_zone_where_nothing_keeps_it_open(rtol):
    """A panel in tension opens one on the way; fitted, it is 1e-7 wide and holds the same pressures."""
    solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.0476545)
    state = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(10.0), mb.Microblock(0.0121587)).solve(1.0, rtol=rtol)
    assert [len(state.zones[name]) for name in ("A", "B", "full")] == [1, 1, 1]
    assert state.residual < 1e-3  # as elsewhere


@pytest.mark.parametrize("law", [mb.Unilateral(), mb.Microclamped(), mb.Microblock(0.01)])
@pytest.mark.parametrize("slope", [0.004, 0.002])
def test_a_valley_within_a_zone_opens_it(law, slope):
    """The pressure has the logarithm of an infinite tension there, however near: the gap may be 1e-9 wide,
    and its tension be worth 1e-5 of the pressure; nodes do not see it.
    """

    def height(x):
        return x**2 / 20 - slope * np.abs(x)

    problem = mb.Contact(mb.HalfPlane(SOLID), height, law)
    rough, fine = (problem.solve(1.0, rtol=rtol) for rtol in (1e-3, 1e-6))
    assert max(len(zones) for zones in fine.zones.values()) >= 2
    near = np.geomspace(1e-14, 1e-2, 200)
    for middle in (0.0, *(sign * SOLID.ell / 2 for sign in (-1, 1))):  # where a corner stands at the valley
        for corner in law.corners:
            x = np.concatenate((middle - near, middle + near))
            assert fine.pressure_at(x, corner).min() > -1e-6 * fine.pressure.max()
    off = fine.weights @ (rough.pressure_at(fine.x) - fine.pressure) ** 2
    size = fine.weights @ fine.pressure**2
    assert np.sqrt(off / size) < max(rough.error_estimate, 1e-6)


@pytest.mark.parametrize("law", [mb.Microblock(), mb.Unilateral()])
def test_fitted_elements_open_the_valleys_of_an_obstacle(law):
    """The gap there is 1e-2 wide under one law and 1e-4 under the other, and its own edges are fitted."""
    obstacle = mb.Obstacle(lambda x: x**2 / 20 - 0.004 * np.abs(x), kinks=(0.0,))
    problem = mb.Contact(mb.Block(SOLID), obstacle, law)
    line = problem.with_(body=mb.HalfPlane(SOLID)).solve(load=1.0, rtol=1e-6)
    state = problem.solve(load=1.0, rtol=1e-3)
    x = line.half_width * np.linspace(-1, 1, 2000)  # not at 0, where the closed pressure has no bound
    off = state.pressure_at(x) - line.pressure_at(x)
    assert np.linalg.norm(off) <= state.error_estimate * np.linalg.norm(line.pressure_at(x))
    name = "A" if len(law.corners) > 1 else "contact"
    # edges are good to a twentieth of the gap: at 1e-3 of the pressure nothing asks for more
    gap = line.zones[name][0][1], line.zones[name][1][0]
    assert len(state.zones[name]) == 2
    found = state.zones[name][0][1], state.zones[name][1][0]
    assert found == pytest.approx(gap, abs=(gap[1] - gap[0]) / 20)


def test_zones_beside_a_valley_never_merge():
    obstacle = mb.Obstacle(lambda x: x**2 / 20 - 0.002 * np.abs(x), kinks=(0.0,))
    problem = mb.Contact(mb.HalfPlane(SOLID), obstacle, mb.Unilateral())
    # at the last load the gap is 3e-8 wide and not resolved to the usual accuracy
    assert len(problem.solve(load=1.0).zones["contact"]) == 1
    found = [(event.zone, event.kind, round(event.x, 6)) for event in problem.path(load=1.0).events]
    assert found == [("contact", "born", -0.02), ("contact", "born", 0.02)]


def test_a_named_slope_discontinuity_without_its_jump_is_measured():
    """The logarithm of the pressure at it was left to polynomials, which do not come below 1e-4."""

    def height(x):
        return x**2 / 20 - 0.001 * np.abs(x)

    named, whole = (mb.Obstacle(height, kinks=(0.0,), jumps=jumps) for jumps in (None, (-0.002,)))
    states = [
        mb.Contact(mb.HalfPlane(SOLID), obstacle, mb.Unilateral()).solve(load=1.0, rtol=1e-6)
        for obstacle in (named, whole)
    ]
    assert states[0].half_width == pytest.approx(states[1].half_width, rel=2e-6)


@pytest.mark.parametrize("load", [1e-4, 1e-6])
def test_two_equal_valleys_of_a_smooth_obstacle_carry_small_loads(load):
    """Each corner has its own low places: cells between them would be thousands."""
    state = mb.Contact(mb.HalfPlane(SOLID), lambda x: (x**2 - 0.25) ** 2 / 5, mb.Microblock()).solve(
        load=load
    )
    zones = np.array(state.zones["contact"])
    assert zones == pytest.approx(-zones[::-1, ::-1], abs=1e-4 * np.diff(zones).max())
    # a quarter of the load each, under a parabola of the curvature 2/5 at the lowest places: Hertz, with the
    # stiffness against waves shorter than a block; such zones are a percent of a block wide, or less
    stiffness = 2 / sum(short_waves(SOLID))
    hertz = np.sqrt(4 * (load / 4) / (np.pi * stiffness * 0.4))
    assert np.diff(zones).ravel() / 2 == pytest.approx(hertz, rel=2e-2)


def test_a_named_slope_discontinuity_where_nothing_touches_is_no_error():
    obstacle = mb.Obstacle(lambda x: x**2 / 20 - 0.004 * np.abs(x), kinks=(0.0,))
    state = mb.Contact(mb.HalfPlane(SOLID), obstacle, mb.Unilateral()).solve(load=1e-6)
    assert [round((left + right) / 2, 4) for left, right in state.zones["contact"]] == [-0.04, 0.04]


def test_changes_that_undo_each_other_within_their_errors_are_none():
    from microblock.path import _without_returns

    born, gone = (
        mb.Event(1.0 + step, 1e-3, kind, "full", 0.5) for step, kind in ((0, "born"), (1e-4, "vanished"))
    )
    again, far = mb.Event(1.0002, 1e-5, "born", "full", 0.5), mb.Event(1.0001, 1e-3, "vanished", "full", 0.9)
    (left, other) = _without_returns([born, gone, again, far], 1e-2)
    assert (left, other) == (again, far)
    early = mb.Event(0.9999, 1e-5, "born", "full", 0.5)
    (left,) = _without_returns([early, born, gone], 1e-2)
    # its error reaches what cannot be told from it
    assert left.load == early.load and left.load_error == pytest.approx(2e-4)
