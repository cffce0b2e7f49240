"""One Contact and one State for all bodies and methods in the plane: what every state has."""

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
DEPTH = CYLINDER.height(np.array([0.35]))[0]  # of the obstacle over the half-width: the size of the gaps


@cache
def body(kind):
    middle = {"u1": "middle", "u2": "middle"}
    if kind == "column":
        return mb.Body(meshes.column(depth=1.0, elements=4), SOLID, 4, fixed=middle, periodic=True)
    if kind == "line":
        return mb.Body(meshes.line(1.0, 4), SOLID, 4, fixed=middle)
    mesh = meshes.uniform(Ground(far=4.0, reach=(-0.6, 0.6), half=False), 0.12)
    return mb.Body(mesh, SOLID, 2, fixed="bottom")


def on_block(kind=None):
    return mb.Block(SOLID, 4.0), mb.Uniform(h=0.1, order=2, newton=kind and mb.Newton(kind))


KINDS = {  # body, method, rtol, residual that its iteration leaves, error of gaps over DEPTH, name
    "panels": (mb.HalfPlane(SOLID), None, 1e-4, 1e-5, 1e-5, "panels"),
    "cells": (mb.HalfPlane(SOLID), mb.Cells(nodes=512), None, 1e-8, 0.02, "cells"),
    "period": (mb.HalfPlane(SOLID, period=2.0), mb.Cells(nodes=512), None, 1e-8, 0.02, "cells"),
    "fitted": (mb.Block(SOLID, 4.0), None, 1e-2, 1e-11, 0.01, "fitted"),
    "unbounded": (mb.Block(SOLID), None, 1e-2, 1e-11, 0.01, "fitted"),
    "uniform": (*on_block(), None, 1e-11, 0.05, "uniform"),
    "uniform_al": (*on_block("al"), None, 1e-11, 0.05, "uniform"),
    "uniform_penalty": (*on_block("penalty"), None, 1e-11, 0.05, "uniform"),
    "condensed": ("body", None, None, 1e-11, 0.05, "condensed"),
    "newton_al": ("body", mb.Newton("al"), None, 1e-11, 0.05, "newton"),
    "newton_penalty": ("body", mb.Newton("penalty"), None, 1e-11, 0.05, "newton"),
    "column": ("column", None, None, 1e-11, 1e-9, "newton"),
    "line": ("line", None, None, 1e-11, 1e-9, "newton"),
}
NO_LEVEL = {"panels", "cells", "unbounded"}  # no approach
ONE_DIMENSIONAL = {"column", "line"}  # a plane presses them, all of the surface at once
EVERY = pytest.mark.parametrize("kind", KINDS)
EVERY_LAW = pytest.mark.parametrize("law", LAWS)


@cache
def problem(kind, law="microblock"):
    given, method, *_ = KINDS[kind]
    obstacle = mb.Plane() if kind in ONE_DIMENSIONAL else CYLINDER
    return mb.Contact(body(given) if isinstance(given, str) else given, obstacle, LAWS[law], method)


@cache
def solved(kind, law="microblock"):
    load = 0.1 if kind in ONE_DIMENSIONAL else 1.0
    return problem(kind, law).solve(load=load, rtol=KINDS[kind][2])


def contains(intervals, x, margin=0.0):
    """Whether x, array (n,), lies in one of the intervals, by a margin."""
    inside = [(x >= a + margin) & (x <= b - margin) for a, b in intervals]
    return np.any([np.zeros(len(x), bool), *inside], axis=0)


@EVERY
@EVERY_LAW
def test_every_state_has_all_of_it(kind, law):
    state, (_, _, rtol, residual, _, method) = solved(kind, law), KINDS[kind]
    assert state.law is LAWS[law] and state.solid == SOLID and state.method == method
    for values in (state.weights, state.pressure, state.micromoment, state.psi):
        assert values.shape == state.x.shape and np.all(np.isfinite(values))
        with pytest.raises(ValueError, match="read-only"):
            values[:] = 7.0
    assert state.rotation.shape == state.x.shape
    assert tuple(state.pressures) == (("A", "B") if "A" in state.law.corners else ("C",))
    assert sum(state.pressures.values()) == pytest.approx(state.pressure)
    assert state.weights @ state.pressure == pytest.approx(state.load, rel=1e-11)  # Newton's residual
    assert 0 <= state.residual <= residual and state.iterations >= 1 and state.unknowns > 20
    assert isinstance(state.energy, float) and (state.approach is None) == (kind in NO_LEVEL)
    estimated = rtol is not None or state.method == "cells"
    assert (state.error_estimate is not None) == estimated
    assert not estimated or 0 < state.error_estimate < (rtol or 0.1)
    assert state.error_parts is None or state.error_parts.total == state.error_estimate
    assert state.surface().gaps.shape[0] == len(state.pressures)
    assert f"load {state.load:g}" in repr(state) and state.caption
    assert np.all(np.diff(state.x) > 0) and (law != "unilateral" or np.all(state.micromoment == 0))


@EVERY
@EVERY_LAW
def test_zones_are_those_of_the_whole_line(kind, law):
    state = solved(kind, law)
    zones, contact = state.zones, state.zones["contact"]
    assert set(zones) == {"A", "B", "full", "contact"} and contact
    for own in zones.values():
        edges = [edge for interval in own for edge in interval]
        assert edges == sorted(edges) and {type(edge) for edge in edges} <= {float}
    assert state.half_width == (contact[-1][1] - contact[0][0]) / 2
    if len(state.pressures) == 1:
        assert not zones["A"] and not zones["B"] and not zones["full"]
    else:
        A, B, full, both = (contains(zones[name], state.x) for name in ("A", "B", "full", "contact"))
        assert np.array_equal(both, A | B) and np.array_equal(full, A & B)
    if LAWS[law].even and kind not in ONE_DIMENSIONAL:
        assert contact[0][0] == pytest.approx(-contact[-1][1], rel=1e-9)  # rounding
        assert 0.25 < state.half_width < 0.43
        # the left corner comes later on the left
        assert not zones["A"] or zones["A"][0][0] > zones["B"][0][0]
    if kind == "column":
        assert contact == [(0.0, pytest.approx(float(state.weights.sum())))]  # all of the period


@EVERY
@EVERY_LAW
def test_complementarity(kind, law):
    """Gaps are closed where a corner presses, open elsewhere; pressures at points are those at the nodes."""
    state, tolerance = solved(kind, law), KINDS[kind][4] * DEPTH
    spacing, reach = np.diff(state.x).max(initial=0.0), min(1.2 * state.half_width, state.x[-1])
    x = state.x if kind in ONE_DIMENSIONAL else np.linspace(-reach, reach, 41) + 1e-6
    for corner, p in state.pressures.items():
        gap, own = state.gap_at(corner, x), state.zones["contact" if corner == "C" else corner]
        inside = contains(own, x, 0.0 if kind in ONE_DIMENSIONAL else 0.51 * spacing)
        assert gap.min() > -tolerance and np.abs(gap[inside]).max(initial=0.0) < tolerance
        beyond = ~contains(own, x, -1.01 * spacing)
        assert not state.pressure_at(x, corner)[beyond].any() and np.all(gap[beyond] > -tolerance / 10)
        middle = contains(own, state.x, 0.2 * state.half_width) if kind == "panels" else slice(None)
        at_nodes = state.pressure_at(state.x[middle], corner)
        assert at_nodes == pytest.approx(p[middle], abs=1e-4 * p.max() + 1e-12)
        moments = state.micromoment_at(state.x[middle]) / SOLID.ell  # at an edge between nodes it jumps
        assert moments == pytest.approx(
            state.micromoment[middle] / SOLID.ell, abs=0.01 * state.pressure.max()
        )
    both = sum(state.pressure_at(x, corner) for corner in state.pressures)
    assert state.pressure_at(x) == pytest.approx(both)
