"""What leaves the library says what is true: messages, tables, bars, and what objects say of themselves."""

import copy
import math
import pickle
import re
from dataclasses import replace
from html import escape

import numpy as np
import pytest

import microblock as mb
from microblock.fem import fitted, meshes, meshes3d

SOLID = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)
GROUND, CYLINDER, LAW = mb.HalfPlane(SOLID), mb.Cylinder(R=10), mb.Microblock()
MESH = meshes.uniform(meshes.Ground(far=2.0, reach=(-1.0, 1.0), half=False), 1.0)
BODY = mb.Body(MESH, SOLID, order=1, fixed="bottom")
GRADES = meshes3d.graded(reach=0.6, step=0.3, far=3.0, growth=2.0)
SPACE = mb.Body3D(
    meshes3d.block(GRADES, GRADES, -GRADES[::-1], reach=0.6),
    SOLID,
    fixed=meshes3d.supports("bottom", x1="left", x2="front"),
)
PROBLEMS = {
    "panels": mb.Contact(GROUND, CYLINDER, LAW),
    "cells": mb.Contact(GROUND, CYLINDER, LAW, mb.Cells(nodes=64, window=(-1, 1))),
    "fitted": mb.Contact(mb.Block(SOLID, 4.0), CYLINDER, LAW, mb.Fitted(order=2)),
    "uniform": mb.Contact(mb.Block(SOLID, 4.0), CYLINDER, LAW, mb.Uniform(h=0.2)),
    "condensed": mb.Contact(BODY, CYLINDER, LAW),
    "newton": mb.Contact(BODY, CYLINDER, LAW, mb.Newton()),
    "half-space": mb.Contact(mb.HalfSpace(SOLID), mb.Sphere(1.0), LAW, mb.Cells(nodes=32)),
    "in space": mb.Contact(SPACE, mb.Sphere(10.0), LAW),
    "in space by Newton": mb.Contact(SPACE, mb.Sphere(10.0), LAW, mb.Newton()),
}
RUBBED = {
    "cells": mb.Contact(GROUND, CYLINDER, mb.Unilateral(friction=0.3)),
    "body": mb.Contact(BODY, CYLINDER, mb.Unilateral(friction=0.3)),
}


@pytest.mark.parametrize("kind", PROBLEMS)
def test_progress_is_shown_by_every_method(kind, capsys):
    problem = PROBLEMS[kind]
    problem.solve(load=0.1)
    assert not capsys.readouterr().err
    problem.solve(load=0.1, progress=True)
    assert "solve:" in capsys.readouterr().err


@pytest.mark.parametrize("kind", ["panels", "fitted", "condensed"])
def test_progress_of_paths_is_shown(kind, capsys):
    path = PROBLEMS[kind].path(load=0.1, progress=True)
    assert path.events and "load path:" in capsys.readouterr().err


@pytest.mark.parametrize("kind", RUBBED)
def test_progress_of_histories_is_shown(kind, capsys):
    rtol = 0.2 if kind == "cells" else None
    RUBBED[kind].history([(1.0, 0.0), (1.0, 0.1)], rtol=rtol, progress=True)
    assert "history:" in capsys.readouterr().err


@pytest.mark.parametrize("kind", [kind for kind in PROBLEMS if kind != "in space by Newton"])
def test_warnings_stand_in_what_a_state_says_of_itself(kind):
    """In the terminal, the notebook and above the figure alike."""
    tilted = PROBLEMS[kind].with_(law=mb.Microblock(psi0=0.3))  # 17 degrees: beyond small angles
    state = tilted.solve(load=1.0 if kind == "fitted" else 1e-3)
    if kind == "half-space":  # which warns of nothing there
        state = replace(state, warnings=("cells are few",))
    above = " ".join(state.plot().get_suptitle().split())
    assert state.warnings
    for text in state.warnings:
        assert text in str(state) and escape(text) in state._repr_html_() and text in above


def test_warnings_of_a_history_are_those_of_its_states():
    history = RUBBED["body"].history([(0.01, 0.0), (0.01, 0.001)])
    assert history.warnings == history.states[0].warnings == history.states[1].warnings  # each once
    assert history.warnings and all(text in str(history) for text in history.warnings)


def test_a_state_without_a_node_in_contact_says_so():
    """The obstacle touches between two nodes at most: no zone is wide enough to be seen."""
    state = PROBLEMS["uniform"].solve(load=1e-3)
    assert not state.zones["contact"] and any("only 0 nodes in contact" in text for text in state.warnings)


NUMBER = None, "no", math.nan, math.inf, 1j, [], object(), 10**400
POSITIVE = *NUMBER, -1, 0, 1e300, 1e-300
WHOLE = *POSITIVE, 1.5
FLAG = None, "no", math.nan, -1, 0, [], object(), np.ones(2)
WORD = "no", -1, 0, [], object(), np.array("a")
PAIR = "no", 1, math.nan, [], (1, 2, 3), (1, 0), (math.nan, 1), (0, math.inf), object()
PLACE = -1, math.nan, [], object(), b"x", "", "no/where", "x.foo", "/proc/x.png", "a\0b", "."
PART = "no", -1, math.nan, [], object(), int
ARRAY = None, "no", math.nan, [math.inf], 1j, [[1.0]], object(), 10**400, 1e300
POSITIVES = {
    mb.Cylinder: {"R": 1.0},
    mb.Wedge: {"slope": 0.1},
    mb.Punch: {"half_width": 1.0},
    mb.Wave: {"amplitude": 0.1, "wavelength": 1.0},
    mb.Rough: {"period": 1.0, "slope": 0.1},
    mb.RoughSurface: {"period": 1.0, "slope": 0.1},
    mb.Sphere: {"R": 1.0},
    mb.Ellipsoid: {"R1": 1.0, "R2": 1.0},
    mb.Cone: {"slope": 0.1},
    mb.FlatPunch: {"half_width": 1.0},
    mb.Uniform: {"h": 1.0},
    mb.Cosserat.of_blocks: {"side": 1.0, "stiffness": 1.0},
}
# (callable, what it is called with, its argument, bad values); of tests below, those of states and problems
TABLE = [
    *((make, usual, name, POSITIVE) for make, usual in POSITIVES.items() for name in usual),
    *((mb.Cosserat, dict(E=1.0, nu=0.3, ell=0.1, beta=1.0), name, POSITIVE) for name in ("E", "ell")),
    (mb.Cosserat, dict(E=1.0, ell=0.1, beta=1.0), "nu", (*NUMBER, 0.5, -1)),
    *(
        (mb.Cosserat, dict(E=1.0, nu=0.3, ell=0.1), name, (*NUMBER[1:], -1))
        for name in ("beta", "eta", "mu_c")
    ),
    (mb.Cosserat.of_blocks, dict(side=1.0, stiffness=1.0), "couples", FLAG),
    *((body, {}, "solid", (None, *PART)) for body in (mb.HalfPlane, mb.HalfSpace, mb.Block)),
    *((body, dict(solid=SOLID), "period", POSITIVE[1:]) for body in (mb.HalfPlane, mb.HalfSpace)),
    (mb.Block, dict(solid=SOLID), "size", [bad for bad in POSITIVE if bad is not math.inf]),
    (mb.Body, dict(solid=SOLID), "mesh", (None, *PART)),
    (mb.Body, dict(mesh=MESH), "solid", (None, *PART)),
    (mb.Body, dict(mesh=MESH, solid=SOLID), "order", WHOLE),
    (mb.Body, dict(mesh=MESH, solid=SOLID), "fixed", (None, 1, [], object(), np.array("a"))),
    (mb.Body, dict(mesh=MESH, solid=SOLID), "prescribed", (1, "no", [1], object())),
    (mb.Body, dict(mesh=MESH, solid=SOLID), "periodic", FLAG),
    (mb.Body, dict(mesh=MESH, solid=SOLID), "contact", (None, *WORD)),
    (mb.Body3D, dict(mesh=SPACE.mesh, solid=SOLID), "order", WHOLE),
    (mb.Plane, {}, "level", NUMBER),
    (mb.Punch, dict(half_width=1.0), "tilt", NUMBER),
    *(
        (rough, dict(period=1.0, slope=0.1), "hurst", (*NUMBER, -1, 2))
        for rough in (mb.Rough, mb.RoughSurface)
    ),
    *((rough, dict(period=1.0, slope=0.1), "waves", PAIR) for rough in (mb.Rough, mb.RoughSurface)),
    (mb.Rough, dict(period=1.0, slope=0.1), "seed", (*NUMBER, -1, 0.5)),
    (mb.FlatPunch, dict(half_width=1.0), "face", (None, *WORD)),
    (mb.Obstacle, {}, "height", (None, *PART[:-1])),
    (mb.Obstacle, dict(height=abs), "kinks", ("no", [None], [math.nan], object())),
    (mb.Obstacle.from_samples, dict(z=[0, 1]), "x", (len, [1, 0], *ARRAY)),
    (mb.Obstacle.from_samples, dict(x=[0, 1]), "z", (len, [1], *ARRAY)),
    (mb.Deformable, dict(shape=CYLINDER), "body", (None, *PART)),
    (mb.Microblock, {}, "psi0", (*NUMBER, 1.0, (0.1,))),
    (mb.Microblock, {}, "psi0_in", (None, *WORD)),
    *((law, {}, "friction", (*NUMBER, -1)) for law in (mb.Microblock, mb.Unilateral, mb.Microclamped)),
    (mb.Panels, {}, "order", WHOLE[1:]),
    (mb.Panels, {}, "fallback", FLAG),
    (mb.Cells, {}, "nodes", WHOLE[1:]),
    (mb.Cells, {}, "window", PAIR),
    (mb.Cells, {}, "residual", (*POSITIVE, 1)),
    (mb.Fitted, {}, "order", WHOLE[1:]),
    (mb.Fitted, dict(order=4), "spacing", POSITIVE[1:]),
    (mb.Fitted, {}, "even", FLAG),
    (mb.Newton, {}, "kind", (None, *WORD)),
    (mb.Newton, {}, "rho", POSITIVE[1:]),
    (mb.Uniform, dict(h=1.0), "order", WHOLE),
    (mb.Uniform, dict(h=1.0), "reach", POSITIVE[1:]),
    (mb.Uniform, dict(h=1.0), "newton", PART),
    (mb.Uniform, dict(h=1.0), "shape", (None, *WORD)),
    (mb.Uniform, dict(h=1.0), "rule", (None, *WORD)),
    (mb.Contact, dict(obstacle=CYLINDER, law=LAW), "body", (None, *PART)),
    (mb.Contact, dict(body=GROUND, law=LAW), "obstacle", (None, *PART)),
    (mb.Contact, dict(body=GROUND, obstacle=CYLINDER), "law", (None, *PART)),
    (mb.Contact, dict(body=GROUND, obstacle=CYLINDER, law=LAW), "method", PART),
    (mb.sweep, dict(over={"a": [1]}), "function", (None, *PART[:-1])),
    (mb.sweep, dict(function=len), "over", (None, 1, "no", {"a": 1}, [1], object())),
    (mb.sweep, dict(function=len, over=[], quiet=True), "workers", WHOLE[1:]),
    (mb.sweep, dict(function=len, over=[]), "records", PLACE[:-4]),
    *((mb.sweep, dict(function=len, over=[]), name, FLAG) for name in ("retry", "quiet")),
    (mb.explore, dict(load=1.0), "problem", (None, *PART)),
    (mb.explore, dict(problem=PROBLEMS["panels"]), "load", POSITIVE),
    (mb.Event, dict(load_error=0.0, kind="born", zone="A", x=0.0), "load", NUMBER),
]


def refused(call, usual, name, bad):
    """What is wrong with how a call refuses a value; None if nothing is."""
    try:
        call(**{**usual, name: bad})
    except mb.BadArgument as failure:
        named = failure.name == name or (name == "fixed" and failure.name in ("boundary", "field"))
        return None if named or name == "over" else f"names {failure.name}"
    except Exception as failure:
        return f"{type(failure).__name__}: {failure}"
    return "accepted"


def complaints(table):
    return [
        f"{getattr(call, '__qualname__', call)}({name}={bad!r}): {wrong}"
        for call, usual, name, values in table
        for bad in values
        if (wrong := refused(call, usual, name, bad))
    ]


def test_bad_values_are_refused_by_name():
    """Whatever an argument is given: one error that names it, its value and what is allowed."""
    assert not complaints(TABLE)


@pytest.mark.parametrize("kind", ["panels", "cells", "condensed", "half-space", "in space"])
def test_bad_values_are_refused_by_problems_and_states(kind, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    problem = PROBLEMS[kind]
    state = problem.solve(load=0.1)
    table = [
        (problem.solve, {}, "load", POSITIVE[1:]),
        (problem.solve, dict(load=0.1), "rtol", (*POSITIVE[1:-1], 1)),
        (problem.solve, dict(load=0.1), "initial", ("no", -1, [], object(), GROUND)),
        (problem.solve, dict(load=0.1), "progress", FLAG),
        (problem.path, {}, "load", POSITIVE),
        (problem.path, dict(load=0.1), "progress", FLAG),
        (problem.with_, {}, "solid", ("no", -1, [], object(), np.ones(2))),
        (mb.to_csv, dict(path="x.csv"), "what", (None, "no", -1, [], object(), [1], {"a": 1})),
        (mb.to_csv, dict(what=state), "path", PLACE),
        (mb.to_vtk, dict(path="x"), "state", (None, "no", -1, [], object(), [1], {"a": 1})),
        (mb.to_vtk, dict(state=state), "path", [bad for bad in PLACE if bad != "."]),
        *(
            (mb.to_vtk, dict(state=state, path="x"), name, ("no", [math.nan], object()))
            for name in ("x1", "x2")
        ),
        (state.plot, {}, "path", (-1, "x.foo", "/proc/x.png")),  # drawn before each
    ]
    if kind not in ("half-space", "in space"):
        table += [
            (problem.solve, {}, "approach", [bad for bad in POSITIVE[1:] if bad not in (-1, 0)]),
            (state.pressure_at, {}, "x", ARRAY),
            (state.pressure_at, dict(x=0.0), "corner", WORD),
            (state.gap_at, dict(x=0.0), "corner", (None, *WORD)),
            (state.gap_at, dict(corner="A"), "x", ARRAY),
            (state.counter_displacement, {}, "x", ARRAY),
            (state.surface, {}, "window", PAIR),
            (state.plot, {}, "window", PAIR),
            (state.plot_blocks, {}, "window", PAIR),
        ]
    if kind == "half-space":
        table += [(state.along, {}, "direction", (None, *WORD))]
    if kind in ("panels", "condensed"):
        table += [
            (problem.path(load=0.1).at, {}, "load", (*POSITIVE, 0.2)),
            (state.plot_below, {}, "field", (None, *WORD)),
        ]
    if kind == "panels":
        table += [(state.fields, dict(x1=0.0, x2=-1.0), "accuracy", WHOLE)]
    if kind == "condensed":
        table += [
            (state.reaction, {}, "boundary", (None, *WORD)),
            (state.plot_body, {}, "field", (None, *WORD)),
        ]
    assert not complaints(table)


def test_bad_histories_are_refused_by_name():
    problem = RUBBED["body"]
    pairs = None, "no", 1, [], [1], [(1,)], [(1, "a")], [(math.nan, 0)], [(math.inf, 0)], [(-1, 0)], [(1, 9)]
    table = [
        (problem.history, {}, "pairs", (*pairs, 10**400, [(10**400, 0)])),
        (problem.history, dict(pairs=[(1, 0)]), "coupled", FLAG),
        (problem.history, dict(pairs=[(1, 0)]), "progress", FLAG),
        (problem.history, dict(pairs=[(1, 0)]), "rtol", (*POSITIVE[1:-1], 1)),
    ]
    assert not complaints(table)


@pytest.mark.parametrize("kind", [kind for kind in PROBLEMS if kind != "half-space"])
def test_an_obstacle_that_is_nowhere_is_refused(kind):
    def nowhere(*x):
        return np.full(np.shape(x[0]), np.inf)

    with pytest.raises(mb.BadArgument):
        PROBLEMS[kind].with_(obstacle=nowhere).solve(load=0.1)


# what is out of reach, (problem, what keeps it from being reached, rtol): small caps stand for long waits
OUT_OF_REACH = {
    "panels": (mb.Contact(GROUND, CYLINDER, LAW), {}, 1e-15),
    "cells": (
        mb.Contact(GROUND, CYLINDER, LAW, mb.Cells()),
        {"microblock.halfplane.cell_solver.MOST": 512},
        1e-6,
    ),
    "fitted": (
        mb.Contact(mb.Block(SOLID, 4.0), CYLINDER, LAW),
        {"microblock.fem.fitted.LEVELS": fitted.LEVELS[:2]},
        1e-5,
    ),
    "condensed": (mb.Contact(BODY, CYLINDER, LAW), {"microblock.fem.recovery.PASSES": 3}, 1e-4),
    "half-space": (
        mb.Contact(mb.HalfSpace(SOLID), mb.Sphere(1.0), mb.Unilateral()),
        {"microblock.halfspace.solver.MOST": 128},
        1e-6,
    ),
}


@pytest.mark.parametrize("kind", OUT_OF_REACH)
def test_the_rtol_that_a_message_advises_is_met(kind, monkeypatch):
    problem, caps, rtol = OUT_OF_REACH[kind]
    for name, cap in caps.items():
        monkeypatch.setattr(name, cap)
    with pytest.raises(mb.NotConverged) as caught:
        problem.solve(load=0.1, rtol=rtol)
    advised = caught.value.rtol_reached
    assert caught.value.reached == pytest.approx(0.1) and f"ask for rtol={advised:.1e}" in str(caught.value)
    assert rtol < problem.solve(load=0.1, rtol=advised).error_estimate <= advised


def test_figures_that_bound_an_argument_are_within_its_bounds():
    """With six digits 1/3 was 0.333333, and 0.123456789 was 0.123457: each was refused when it was given."""

    def advised(call):
        with pytest.raises(mb.BadArgument) as caught:
            call()
        return float(re.findall(r"-?\d+\.\d+", str(caught.value))[-1])

    load = 0.1234567
    path = PROBLEMS["condensed"].path(load=load)
    assert path.at(advised(lambda: path.at(1.0))).load == pytest.approx(load)
    friction, P = 0.3, 0.123456789
    problem = mb.Contact(BODY, CYLINDER, mb.Unilateral(friction=friction))
    Q = advised(lambda: problem.history([(P, 1.0)]))
    assert problem.history([(P, Q)]).states
    ends = mb.Contact(BODY, CYLINDER, LAW).solve(load=0.1)
    end = advised(lambda: ends.gap_at("A", 5.0))
    assert np.isfinite(ends.gap_at("A", end))
    wave = mb.Wave(0.01, 1 / 3)
    period = advised(lambda: mb.Contact(mb.HalfPlane(SOLID, 0.5), wave, mb.Unilateral()))
    mb.Contact(mb.HalfPlane(SOLID, period), wave, mb.Unilateral())


def test_unknown_names_are_refused_by_name():
    state = PROBLEMS["cells"].solve(load=0.1)
    for table, what in ((state.zones, "zone"), (state.pressures, "corner")):
        with pytest.raises(mb.BadArgument, match="must be one of") as caught:
            table["Z"]
        assert caught.value.name == what and table.get("Z") is None and "Z" not in table
        copied = pickle.loads(pickle.dumps(table))
        assert copied.keys() == table.keys() == dict(table).keys()


@pytest.mark.parametrize(
    "failure",
    [
        mb.BadArgument("R", -1, "must be positive"),
        mb.NotConverged("no luck", reached=0.2, rtol_reached=0.1, iterations=3),
        mb.MissingExtra("explore()", "ipywidgets", "notebook"),
    ],
)
def test_errors_come_back_from_other_processes(failure):
    """Of BadArgument a raw TypeError came back: it was made anew of its message alone."""
    for back in (pickle.loads(pickle.dumps(failure)), copy.copy(failure)):
        assert type(back) is type(failure) and str(back) == str(failure) and vars(back) == vars(failure)
