"""What leaves the library says what is true: messages, tables, bars, and what objects say of themselves."""

import copy
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
