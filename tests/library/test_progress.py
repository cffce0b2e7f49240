"""Bars appear where someone looks, Ctrl-C leaves what there was, one BLAS thread inside the library."""

import io
import signal
import sys
from itertools import count

import numpy as np
import pytest
import scipy.linalg.blas  # noqa: F401      (its library is one of those that are looked at)
from threadpoolctl import threadpool_info, threadpool_limits

import microblock as mb
from cases.__main__ import main
from microblock import threads
from microblock.contact_solvers.cell_solver import CellSolver
from microblock.contact_solvers.event_driven import EventDrivenContact
from microblock.fem import meshes
from microblock.fem.fitted import FittedSolver
from microblock.halfplane import friction_solver
from microblock.halfplane.panel_solver import PanelSolver
from microblock.model.progress import counted, counting
from tests.parts import BLOCKS, CYLINDER, SOLID, UNILATERAL

GROUND = mb.HalfPlane(SOLID)
CELLS = mb.Contact(GROUND, CYLINDER, BLOCKS, mb.Cells())


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.mark.parametrize(
    "screen, progress, modules, environment, seconds, shown",
    [
        (Terminal, None, {}, {}, 1.0, True),
        (Terminal, None, {}, {}, 0.01, False),  # five steps of it last less than a second
        (Terminal, True, {}, {}, 0.01, True),
        (Terminal, False, {}, {}, 1.0, False),
        (Terminal, None, {}, {"TQDM_DISABLE": "1"}, 1.0, False),
        (io.StringIO, None, {}, {}, 1.0, False),
        (io.StringIO, True, {}, {}, 1.0, True),
        (io.StringIO, None, {"ipykernel": None}, {}, 1.0, True),
    ],
)
def test_a_bar_appears_where_someone_looks(
    screen, progress, modules, environment, seconds, shown, monkeypatch
):
    written, ticks = screen(), count()
    monkeypatch.setattr("sys.stderr", written)
    monkeypatch.setattr("tqdm.std.time", lambda: seconds * next(ticks))
    monkeypatch.delenv("TQDM_DISABLE", raising=False)
    monkeypatch.delitem(sys.modules, "ipykernel", raising=False)
    for name, value in modules.items():
        monkeypatch.setitem(sys.modules, name, value)
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    with counting("outside", progress, total=5):
        for number in range(5):
            with counting("inside", True):  # the outermost decides
                counted(error=0.1 / (1 + number))
            counted()
    assert ("outside" in written.getvalue() and "error=0.02" in written.getvalue()) == shown
    assert shown or not written.getvalue()
    assert "inside" not in written.getvalue()


def interrupting(monkeypatch, owner, name, calls):
    """Ctrl-C after so many calls of a method."""
    method, left = getattr(owner, name), count(calls, -1)

    def called(self, *given, **more):
        if not next(left):
            signal.raise_signal(signal.SIGINT)
        return method(self, *given, **more)

    monkeypatch.setattr(owner, name, called)


def test_an_interrupted_solve_leaves_its_best_state(monkeypatch):
    """Which is that of a solve on as many cells, and says that it is not what was asked for."""
    interrupting(monkeypatch, CellSolver, "solved", 4)
    with pytest.raises(mb.Interrupted, match=r"^solve by Cells\(\): interrupted, level=5") as stop:
        CELLS.solve(load=1.0, rtol=1e-9)
    monkeypatch.undo()
    left = stop.value.reached
    assert not isinstance(stop.value, Exception) and left.load == 1.0
    assert any("interrupted" in words for words in left.warnings)
    fine = mb.Contact(GROUND, CYLINDER, BLOCKS, mb.Panels()).solve(load=1.0, rtol=1e-5)
    # what it says of its error bounds that of the largest pressure against another method
    assert 1e-9 < left.error_estimate < 0.5
    assert abs(left.pressure.max() / fine.pressure.max() - 1) < left.error_estimate
    with counting("afterwards"):  # nothing of it is left
        assert CELLS.solve(load=1.0, rtol=0.1).error_estimate <= 0.1


def test_interrupted_states_paths_and_histories_leave_what_is_done(monkeypatch):
    panels = mb.Contact(GROUND, CYLINDER, BLOCKS, mb.Panels())
    complete = panels.states([0.5, 1.0])
    events = panels.path(1.0).events
    interrupting(monkeypatch, PanelSolver, "solution_at", 2)
    with pytest.raises(mb.Interrupted, match=r"^states: interrupted, .*load=1") as stop:
        panels.states([0.5, 1.0, 2.0])
    assert [state.half_width for state in stop.value.reached] == [state.half_width for state in complete]
    monkeypatch.undo()
    path = panels.path(1.0)
    path.at(1.0)  # the scan of loads, before events are looked for
    interrupting(monkeypatch, type(path), "_between", 2)
    with pytest.raises(mb.Interrupted, match="^load path: interrupted") as stop:
        path.events
    first_events = stop.value.reached
    assert 0 < len(first_events) < len(events) and first_events == events[: len(first_events)]
    monkeypatch.undo()
    rubbed = mb.Contact(GROUND, CYLINDER, mb.Unilateral(friction=0.3), mb.Cells())
    interrupting(monkeypatch, EventDrivenContact, "follow", 3)  # in the middle of the second level
    with pytest.raises(mb.Interrupted, match="^history: interrupted, level=2") as stop:
        rubbed.history([(1.0, 0.0), (1.0, 0.1)], rtol=1e-3)
    loads = [(state.load, state.shear, state.error_estimate) for state in stop.value.reached.states]
    assert loads == [(1.0, 0.0, None), (1.0, 0.1, None)]


def test_a_history_that_is_interrupted_in_its_estimates_is_left(monkeypatch):
    """Nothing was, before the first level had been estimated."""

    def interrupted(changes, level):
        raise KeyboardInterrupt

    monkeypatch.setattr(friction_solver, "_estimates", interrupted)
    rubbed = mb.Contact(GROUND, CYLINDER, mb.Unilateral(friction=0.3), mb.Cells())
    with pytest.raises(mb.Interrupted, match="^history: interrupted, level=1") as stop:
        rubbed.history([(1.0, 0.0), (1.0, 0.1)], rtol=1e-3)
    assert [state.shear for state in stop.value.reached.states] == [0.0, 0.1]


@pytest.mark.parametrize(
    "body, obstacle, calls, told",
    [(GROUND, CYLINDER, 2, "load="), (mb.HalfSpace(SOLID), mb.Sphere(R=10), 4, "squares=1, level=")],
)
def test_an_interrupted_path_on_cells_leaves_no_state_for_events(body, obstacle, calls, told, monkeypatch):
    """Whose errors need both grids; in space states of the window come first."""
    path = mb.Contact(body, obstacle, BLOCKS, mb.Cells()).path(0.01)
    interrupting(monkeypatch, CellSolver, "solved", calls)
    with pytest.raises(mb.Interrupted, match=f"^load path: interrupted, {told}") as stop:
        path.events
    assert stop.value.reached is None


def test_an_interrupted_mesh_leaves_no_state_of_its_first_zones(monkeypatch):
    """Panels find them."""
    interrupting(monkeypatch, FittedSolver, "_settled", 0)
    with pytest.raises(mb.Interrupted, match=r"^solve by Fitted\(\): interrupted, at the beginning") as stop:
        mb.Contact(mb.Block(SOLID), CYLINDER, BLOCKS).solve(load=1.0)
    assert stop.value.reached is None


def test_an_interrupted_command_leaves_no_half_of_a_file(tmp_path, monkeypatch, capsys):
    words = ["sphere", "--json", str(tmp_path / "result.json"), "--out", str(tmp_path)]
    interrupting(monkeypatch, CellSolver, "solved", 1)
    assert main(words) == 130
    printed = capsys.readouterr()
    assert (
        "python -m cases sphere: solve by Cells(): interrupted, squares=1" in printed.err and not printed.out
    )
    monkeypatch.undo()

    def half(figure, place, **how):
        place.write_bytes(b"half")
        signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr("matplotlib.figure.Figure.savefig", half)
    assert main(words) == 130
    assert not [*tmp_path.iterdir()]


# --- one BLAS thread inside the library, what was there before afterwards; no test here reads a clock


MESH = meshes.uniform(meshes.Ground(far=2.0, reach=(-1.0, 1.0), half=False), 0.5)
BODY = mb.Body(MESH, SOLID, order=3, fixed="bottom")


def numbers():
    """Threads of the libraries; cvxopt's own BLAS is built for a single one."""
    return {library["num_threads"] for library in threadpool_info() if "cvxopt" not in library["filepath"]}


@pytest.fixture(autouse=True)
def two_threads():
    """Two threads outside, whatever the machine has: OpenBLAS takes any number."""
    with threadpool_limits(2):
        yield
        assert numbers() == {2}  # given back, whatever the test did


class Watching:
    """A cylinder that notes the threads while it is asked for its height."""

    def __init__(self, fails=False):
        self.seen, self.fails = set(), fails

    def height(self, x):
        self.seen |= numbers()
        if self.fails:
            raise KeyboardInterrupt
        return np.asarray(x) ** 2 / 20


ENTRIES = {  # body, method, and what is asked of the problem
    "panels": (GROUND, None, lambda problem: problem.solve(load=1.0, rtol=1e-2)),
    "panels, events": (GROUND, None, lambda problem: problem.path(load=1.0).events),
    "cells": (GROUND, mb.Cells(nodes=64, window=(-1, 1)), lambda problem: problem.solve(load=1.0)),
    "fitted": (mb.Block(SOLID, 10.0), None, lambda problem: problem.path(load=1.0, rtol=3e-2).at(0.5)),
    "uniform": (mb.Block(SOLID, 4.0), mb.Uniform(h=0.2, reach=0.8), lambda problem: problem.solve(load=0.5)),
    "body": (BODY, None, lambda problem: problem.solve(load=0.5)),
    "body, events": (BODY, None, lambda problem: problem.path(load=0.5).events),
    "newton": (BODY, mb.Newton(), lambda problem: problem.solve(load=0.5)),
}


@pytest.mark.parametrize("entry", ENTRIES)
def test_inside_there_is_one_thread_and_outside_what_was_there(entry):
    watching, (body, method, ask) = Watching(), ENTRIES[entry]
    problem = mb.Contact(body, watching, UNILATERAL, method)
    watching.seen.clear()  # a few numbers, before any work
    ask(problem)
    assert watching.seen == {1}


def test_threads_come_back_after_an_interruption_and_after_a_refusal():
    watching = Watching()
    problem = mb.Contact(GROUND, watching, UNILATERAL)
    watching.fails = True
    with pytest.raises(KeyboardInterrupt):
        problem.solve(load=1.0)
    with pytest.raises(mb.BadArgument):
        problem.solve(load=-1.0)


def test_large_matrices_alone_have_the_threads_from_outside():
    """Below 2000 rows threads cost more than they gain."""

    @threads.bounded
    def within(rows):
        with threads.with_outer_threads(rows):
            inside = numbers()
        return inside, numbers()

    assert [within(rows) for rows in (1999, 2000)] == [({1}, {1}), ({2}, {1})]
