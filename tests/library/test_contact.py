"""One Contact and one State for all bodies and methods: what every state has, and how the methods agree."""

from functools import cache

import numpy as np
import pytest

import microblock as mb
from microblock.fem import meshes
from microblock.fem.meshes import Ground

SOLID, CYLINDER = mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1), mb.Cylinder(R=10)
LAWS = {
    "microblock": mb.Microblock(),
    "rotated": mb.Microblock(0.005),
    "unilateral": mb.Unilateral(),
    "microclamped": mb.Microclamped(),
}
BOTTOM = {"u1": "bottom", "u2": "bottom", "psi": "bottom"}
MIDDLE = {"u1": "middle", "u2": "middle"}
DEPTH = CYLINDER.height(np.array([0.35]))[0]  # of the obstacle over the half-width: the size of the gaps


@cache
def body(kind):
    if kind == "column":
        return mb.Body(meshes.column(depth=1.0, elements=4), SOLID, 4, fixed=MIDDLE, periodic=True)
    if kind == "line":
        return mb.Body(meshes.line(1.0, 4), SOLID, 4, fixed=MIDDLE)
    mesh = meshes.uniform(Ground(far=4.0, reach=(-0.6, 0.6), half=False), 0.12)
    return mb.Body(mesh, SOLID, 2, fixed=BOTTOM)


def newton(kind):
    return mb.Uniform(h=0.1, order=2, newton=kind and mb.Newton(kind))


KINDS = {  # body, method, rtol, residual that its iteration leaves, error of gaps over DEPTH
    "panels": (mb.HalfPlane(SOLID), None, 1e-4, 1e-5, 1e-5),
    "cells": (mb.HalfPlane(SOLID), mb.Cells(nodes=512), None, 1e-8, 0.02),
    "period": (mb.HalfPlane(SOLID, period=2.0), mb.Cells(nodes=512), None, 1e-8, 0.02),
    "fitted": (mb.Block(SOLID, 4.0), None, 1e-2, 1e-11, 0.01),
    "unbounded": (mb.Block(SOLID), None, 1e-2, 1e-11, 0.01),
    "uniform": (mb.Block(SOLID, 4.0), newton(None), None, 1e-11, 0.05),
    "uniform_al": (mb.Block(SOLID, 4.0), newton("al"), None, 1e-11, 0.05),
    "uniform_penalty": (mb.Block(SOLID, 4.0), newton("penalty"), None, 1e-11, 0.05),
    "condensed": ("body", None, None, 1e-11, 0.05),
    "newton_al": ("body", mb.Newton("al"), None, 1e-11, 0.05),
    "newton_penalty": ("body", mb.Newton("penalty"), None, 1e-11, 0.05),
    "column": ("column", None, None, 1e-11, 1e-9),
    "line": ("line", None, None, 1e-11, 1e-9),
}
NO_LEVEL = {"panels", "cells", "unbounded"}
ONE_DIMENSIONAL = {"column", "line"}  # a plane presses them, all of the surface at once
METHODS = {
    "panels": "panels",
    "cells": "cells",
    "period": "cells",
    "fitted": "fitted",
    "unbounded": "fitted",
    "uniform": "uniform",
    "uniform_al": "uniform",
    "uniform_penalty": "uniform",
    "condensed": "condensed",
}
EVERY = pytest.mark.parametrize("kind", KINDS)
EVERY_LAW = pytest.mark.parametrize("law", LAWS)


@cache
def problem(kind, law="microblock"):
    given, method, *_ = KINDS[kind]
    obstacle = mb.Plane() if kind in ONE_DIMENSIONAL else CYLINDER
    return mb.Contact(body(given) if isinstance(given, str) else given, obstacle, LAWS[law], method)


@cache
def solved(kind, law="microblock"):
    return problem(kind, law).solve(load=load_of(kind), rtol=KINDS[kind][2])


def load_of(kind):
    return 0.1 if kind in ONE_DIMENSIONAL else 1.0


def contains(intervals, x, margin=0.0):
    """Whether x, array (n,), lies in one of the intervals, by a margin."""
    return np.any(
        [np.zeros(len(x), bool), *((x >= a + margin) & (x <= b - margin) for a, b in intervals)], axis=0
    )


@EVERY
@EVERY_LAW
def test_every_state_has_all_of_it(kind, law):
    state, load = solved(kind, law), load_of(kind)
    assert isinstance(state, mb.State) and isinstance(state.problem, mb.Contact)
    assert state.law is LAWS[law] and state.solid == SOLID
    assert state.method == METHODS.get(kind, "newton")
    assert np.all(np.diff(state.x) > 0) and isinstance(state.load, float)
    for values in (state.weights, state.pressure, state.micromoment, state.psi, state.rotation):
        assert values.shape == state.x.shape and np.all(np.isfinite(values))
    assert tuple(state.pressures) == (("A", "B") if "A" in state.law.corners else ("C",))
    assert sum(state.pressures.values()) == pytest.approx(state.pressure)
    assert state.weights @ state.pressure == pytest.approx(state.load, rel=1e-11)  # Newton's residual
    assert state.load == pytest.approx(load, rel=1e-11)
    assert 0 <= state.residual <= KINDS[kind][3]
    assert state.iterations >= 1 and state.unknowns > 20
    assert all(isinstance(one, str) for one in state.warnings)
    assert isinstance(state.energy, float) and (kind in NO_LEVEL or state.energy > 0)
    estimated = KINDS[kind][2] is not None or state.method == "cells"
    assert (state.error_estimate is not None) == estimated
    assert not estimated or 0 < state.error_estimate < (KINDS[kind][2] or 0.1)
    assert state.error_parts is None or state.error_parts.total == state.error_estimate
    assert state.surface().gaps.shape[0] == len(state.pressures)
    assert f"load {load:g}" in repr(state) and "residual" not in state._repr_html_() and state.caption
    if law == "unilateral":
        assert np.all(state.micromoment == 0)


@EVERY
@EVERY_LAW
def test_zones_are_those_of_the_whole_line(kind, law):
    state = solved(kind, law)
    zones, contact = state.zones, state.zones["contact"]
    assert set(zones) == {"A", "B", "full", "contact"} and contact
    for own in zones.values():
        edges = [edge for interval in own for edge in interval]
        assert edges == sorted(edges) and all(type(edge) is float for edge in edges)
        assert all(type(interval) is tuple for interval in own)
    assert state.half_width == (contact[-1][1] - contact[0][0]) / 2
    if len(state.pressures) == 1:
        assert not zones["A"] and not zones["B"] and not zones["full"]
    else:
        inside = [contains(zones[name], state.x) for name in ("A", "B", "full", "contact")]
        assert np.array_equal(inside[3], inside[0] | inside[1])
        assert np.array_equal(inside[2], inside[0] & inside[1])
    if LAWS[law].even and kind not in ONE_DIMENSIONAL:
        assert contact[0][0] == pytest.approx(-contact[-1][1], rel=1e-9)
        assert 0.25 < state.half_width < 0.43
    if kind == "column":
        assert contact == [(0.0, pytest.approx(float(state.weights.sum())))]  # all of the period


@EVERY
@EVERY_LAW
def test_complementarity(kind, law):
    """Gaps are closed where a corner presses, open elsewhere; pressures at points are those at the nodes."""
    state, tolerance = solved(kind, law), KINDS[kind][4] * DEPTH
    spacing = np.diff(state.x).max(initial=0.0)
    reach = min(1.2 * state.half_width, state.x[-1])
    x = state.x if kind in ONE_DIMENSIONAL else np.linspace(-reach, reach, 41) + 1e-6
    names = {"A": "A", "B": "B", "C": "contact"}
    for corner, p in state.pressures.items():
        gap, own = state.gap_at(corner, x), state.zones[names[corner]]
        inside = contains(own, x, 0.0 if kind in ONE_DIMENSIONAL else 0.51 * spacing)
        at_x = state.pressure_at(x, corner)
        assert gap.min() > -tolerance and np.abs(gap[inside]).max(initial=0.0) < tolerance
        open_ones = ~contains(own, x, -1.01 * spacing)
        assert np.all(at_x[open_ones] == 0) and np.all(gap[open_ones] > -tolerance / 10)
        middle = contains(own, state.x, 0.2 * state.half_width) if kind == "panels" else state.x == state.x
        assert state.pressure_at(state.x[middle], corner) == pytest.approx(
            p[middle], abs=1e-4 * p.max() + 1e-12
        )
    assert state.pressure_at(x) == pytest.approx(
        sum(state.pressure_at(x, corner) for corner in state.pressures)
    )
    for ask in (lambda: state.pressure_at(0.0, "D"), lambda: state.gap_at("D", 0.0)):
        with pytest.raises(mb.BadArgument, match="^corner = 'D'"):
            ask()


@pytest.mark.parametrize(
    "kind, law",
    [(kind, law) for kind in KINDS for law in LAWS if kind != "fitted" or law in ("rotated", "unilateral")],
)
def test_approach_is_the_inverse_of_the_load(kind, law):
    state, rtol = solved(kind, law), KINDS[kind][2]
    assert (state.approach is None) == (kind in NO_LEVEL)
    if state.approach is None:
        with pytest.raises(mb.BadArgument) as refused:
            problem(kind, law).solve(approach=0.01)
        assert refused.value.name in ("approach", "window")
        return
    back = problem(kind, law).solve(approach=state.approach, rtol=rtol)
    # cells to their residual, the others to rounding
    assert back.load == pytest.approx(state.load, rel=1e-7)
    assert back.approach == pytest.approx(state.approach, rel=1e-9)
    top = max(p.max() for p in state.pressures.values())
    for corner, p in state.pressures.items():
        assert back.pressures[corner] == pytest.approx(p, abs=1e-5 * top)


@EVERY_LAW
def test_methods_agree(law):
    """One discrete problem condensed and by Newton; the same body on meshes of one's own and of the
    program's.
    """
    for first, second in (("uniform", "uniform_al"), ("condensed", "newton_al")):
        one, other = solved(first, law), solved(second, law)
        assert other.approach == pytest.approx(one.approach, rel=1e-9)
        assert other.energy == pytest.approx(one.energy, rel=1e-9)
        assert other.psi == pytest.approx(one.psi, abs=1e-9)
        assert other.pressure == pytest.approx(one.pressure, abs=1e-8 * one.pressure.max())
        # but next to the contact boundary's ends, where the neighbours share in the reaction to psi = 0
        here = slice(2, -2)
        assert other.micromoment[here] == pytest.approx(
            one.micromoment[here], abs=1e-3 * SOLID.ell * one.pressure.max()
        )
    fitted = solved("fitted", law)
    for kind in ("uniform", "uniform_penalty", "condensed", "newton_penalty"):
        assert solved(kind, law).approach == pytest.approx(fitted.approach, rel=0.03)
        assert solved(kind, law).energy == pytest.approx(fitted.energy, rel=0.03)
    x = np.linspace(-0.2, 0.2, 9)
    panels = solved("panels", law).pressure_at(x)
    for kind, error in (("cells", 0.02), ("unbounded", 0.02), ("fitted", 0.05), ("condensed", 0.3)):
        assert solved(kind, law).pressure_at(x) == pytest.approx(panels, abs=error * panels.max())


@EVERY_LAW
def test_fields_at_points_agree(law):
    """Of the half-plane by modes and by finite elements, also on the side that symmetry gives."""
    x1, x2 = np.meshgrid((-0.5, -0.13, 0.07, 0.4), (-0.05, -0.3))
    exact, found = (solved(kind, law).fields(x1.ravel(), x2.ravel()) for kind in ("panels", "unbounded"))
    for name in ("psi", "stress", "couple_stress"):
        own, true = getattr(found, name), getattr(exact, name)
        assert own.shape == true.shape
        size = np.abs(exact.stress).max() * {"couple_stress": SOLID.ell, "psi": 1 / SOLID.mu}.get(name, 1.0)
        assert own == pytest.approx(true, abs=0.02 * size)
    apart = found.u - exact.u
    assert np.ptp(apart[1]) < 0.02 * np.ptp(exact.u[1]) and np.ptp(apart[0]) < 0.02 * np.ptp(exact.u[1])
    assert solved("panels", law).fields.largest_shear()[0] > 0


def test_cells_have_no_fields():
    for ask in (lambda: solved("cells").fields, lambda: solved("cells").plot_below("psi")):
        with pytest.raises(mb.BadArgument, match="method = 'cells': has no fields"):
            ask()


@pytest.mark.parametrize("kind", ["panels", "unbounded", "condensed"])
def test_paths_give_the_same_events(kind):
    own = problem(kind)
    if kind == "condensed":  # elements that see each zone of partial contact on its own
        mesh = meshes.uniform(Ground(far=4.0, reach=(-0.4, 0.4), half=False), 0.02)
        own = own.with_(body=mb.Body(mesh, SOLID, 2, fixed=BOTTOM))
    path = own.path(load=0.3, rtol=None if kind == "condensed" else 1e-2)
    assert isinstance(path, mb.LoadPath) and all(isinstance(event, mb.Event) for event in path.events)
    loads = [event.load for event in path.events]
    assert loads == sorted(loads) and all(event.load_error >= 0 for event in path.events)
    true = problem("panels").path(load=0.3).events
    found = {(event.kind, event.zone): event for event in path.events}
    assert sorted((event.kind, event.zone) for event in true) == [
        ("born", "A"),
        ("born", "B"),
        ("born", "contact"),
        ("born", "contact"),
        ("born", "full"),
        ("merged", "contact"),
    ]
    assert len(path.events) == len(true) and {(event.kind, event.zone) for event in true} == set(found)
    merged, exact = found["merged", "contact"], true[-1]
    assert merged.x == pytest.approx(0, abs=1e-9)
    apart = 0.25 if kind == "condensed" else 0.0  # edges on nodes: it falls like h^(2 s), s = 0.32
    assert abs(merged.load - exact.load) <= merged.load_error + exact.load_error + apart * exact.load
    assert path.at(0.2).load == pytest.approx(0.2) and f"{len(true)}" in repr(path)
    for load in (0.0, 0.31):
        with pytest.raises(mb.BadArgument, match="^load"):
            path.at(load)


@pytest.mark.parametrize("kind", ["cells", "period", "uniform", "uniform_al", "newton_al", "column"])
def test_methods_that_cannot_follow_events_say_so(kind):
    with pytest.raises(mb.BadArgument, match="method = .*cannot follow events"):
        problem(kind).path(load=1.0)


@pytest.mark.parametrize(
    "given, method",
    [
        (mb.HalfPlane(SOLID), "PanelSolver"),
        (mb.HalfPlane(SOLID, period=1.0), "CellSolver"),
        (mb.Block(SOLID, 4.0), "FittedSolver"),
        (mb.Block(SOLID), "FittedSolver"),
        ("body", "BodySolver"),
        ("column", "NewtonSolver"),
        ("line", "NewtonSolver"),
    ],
)
def test_the_body_chooses_the_method(given, method):
    own = mb.Contact(body(given) if isinstance(given, str) else given, mb.Plane(), mb.Unilateral())
    assert isinstance(own, mb.Contact) and own.method is None and type(own.solver).__name__ == method
    assert "Contact problem" in repr(own) and type(own.solver.options).__name__ in own._repr_html_()


@pytest.mark.parametrize("kind", ["panels", "period", "fitted", "uniform", "condensed", "newton_al"])
def test_with_parts_replaced_it_is_the_problem_made_anew(kind):
    own, stiffer = problem(kind), mb.Cosserat(E=200, nu=0.2, ell=0.1, beta=1)
    changed = own.with_(solid=stiffer, obstacle=mb.Cylinder(R=5), law=mb.Unilateral())
    assert changed.solid == stiffer and own.solid == SOLID and own.obstacle is CYLINDER
    given = own.body.of(stiffer)
    anew = mb.Contact(given, mb.Cylinder(R=5), mb.Unilateral(), own.method)
    first, second = (one.solve(load=1.0, rtol=KINDS[kind][2]) for one in (changed, anew))
    assert first.pressure == pytest.approx(second.pressure, abs=1e-12 * second.pressure.max())
    assert own.with_().solve(load=1.0, rtol=KINDS[kind][2]).half_width == solved(kind).half_width


def test_what_does_not_depend_on_the_replaced_parts_is_kept():
    own = problem("condensed")
    assert own.with_(obstacle=mb.Wedge(0.1), law=mb.Unilateral()).solver.nodes is own.solver.nodes
    assert own.with_(solid=SOLID).solver.nodes is own.solver.nodes
    assert problem("panels").with_(method=mb.Cells(nodes=64)).solve(load=1.0).method == "cells"


@EVERY
def test_initial_states_of_any_kind_do_no_harm(kind):
    """Of the same kind it is where the solution starts, of another kind it is passed over."""
    own, state, rtol = problem(kind), solved(kind), KINDS[kind][2]
    top = max(p.max() for p in state.pressures.values())
    near = own.solve(load=0.9 * state.load, rtol=rtol)
    strangers = [
        solved(other) for other in ("panels", "fitted", "line") if METHODS.get(other) != METHODS.get(kind)
    ]
    others = [solved(kind, "unilateral")] + strangers
    for initial in (near, *others):
        again = own.solve(load=state.load, rtol=rtol, initial=initial)
        at = state.x if kind in ONE_DIMENSIONAL else np.linspace(-0.3, 0.3, 21)
        assert again.pressure_at(at) == pytest.approx(
            state.pressure_at(at), abs=max(rtol or 1e-6, 1e-6) * top
        )
        assert again.half_width == pytest.approx(state.half_width, rel=rtol or 1e-9)
        if initial in strangers:
            assert again.pressure == pytest.approx(
                state.pressure, abs=1e-7 * top
            )  # residual of cells, some ten times
