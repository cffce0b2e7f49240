"""One BLAS thread inside the library, what was there before afterwards; no test here reads a clock."""

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from threading import Barrier

import numpy as np
import pytest
import scipy.linalg.blas  # noqa: F401      (its library is one of those that are looked at)
from threadpoolctl import ThreadpoolController, threadpool_info, threadpool_limits

import microblock as mb
from microblock import threads
from microblock.fem import meshes
from microblock.threads import LARGE, bounded, released
from microblock.view.explorer import Explorer

SOLID = mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1)


def numbers():
    """Threads of the libraries; cvxopt's own BLAS is built for a single one."""
    libraries = [library for library in threadpool_info() if "cvxopt" not in library["filepath"]]
    return {library["filepath"]: library["num_threads"] for library in libraries}


@pytest.fixture(autouse=True)
def two_threads():
    """Two threads outside, whatever the machine has: OpenBLAS takes any number."""
    import ngsolve  # noqa: F401      (brings a BLAS of its own)

    with threadpool_limits(2):
        if set(numbers().values()) != {2}:
            pytest.fail(f"threads cannot be set here: {numbers()}")
        yield
        assert set(numbers().values()) == {2}  # given back, whatever the test did


class Watching:
    """A cylinder that notes the threads while it is asked for its height."""

    def __init__(self, fails=False):
        self.seen, self.fails = set(), fails

    def height(self, x):
        self.seen |= set(numbers().values())
        if self.fails:
            raise KeyboardInterrupt
        return np.asarray(x) ** 2 / 20


def body():
    mesh = meshes.uniform(meshes.Ground(far=2.0, reach=(-1.0, 1.0), half=False), 0.5)
    return mb.Body(mesh, SOLID, order=3, fixed="bottom")


LAW, UNIFORM = mb.Unilateral(), mb.Uniform(h=0.2, reach=0.8)


def line(obstacle, method=None):
    return mb.Contact(mb.HalfPlane(SOLID), obstacle, LAW, method)


def block(obstacle, method=None):
    return mb.Contact(mb.Block(SOLID, 10.0), obstacle, LAW, method)


def on_body(obstacle, method=None):
    return mb.Contact(body(), obstacle, LAW, method)


ENTRIES = {  # how a problem is made, and what is asked of it
    "panels": (line, lambda problem: problem.solve(load=1.0, rtol=1e-2)),
    "panels, path": (line, lambda problem: problem.path(load=1.0).at(0.5)),
    "panels, events": (line, lambda problem: problem.path(load=1.0).events),
    "cells": (
        lambda obstacle: line(obstacle, mb.Cells(nodes=64, window=(-1, 1))),
        lambda problem: problem.solve(load=1.0),
    ),
    "fitted": (block, lambda problem: problem.solve(load=1.0, rtol=3e-2)),
    "fitted, path": (block, lambda problem: problem.path(load=1.0, rtol=3e-2).at(0.5)),
    "fitted, order": (
        lambda obstacle: block(obstacle, mb.Fitted(order=4)),
        lambda problem: problem.solve(load=1.0),
    ),
    "uniform": (
        lambda obstacle: mb.Contact(mb.Block(SOLID, 4.0), obstacle, LAW, UNIFORM),
        lambda problem: problem.solve(load=0.5),
    ),
    "body": (on_body, lambda problem: problem.solve(load=0.5)),
    "body, path": (on_body, lambda problem: problem.path(load=0.5).at(0.3)),
    "body, events": (on_body, lambda problem: problem.path(load=0.5).events),
    "newton": (lambda obstacle: on_body(obstacle, mb.Newton()), lambda problem: problem.solve(load=0.5)),
    "Explorer": (line, lambda problem: Explorer(problem, load=1.0)),
}


@pytest.mark.parametrize("entry", ENTRIES)
def test_inside_there_is_one_thread_and_outside_what_was_there(entry):
    watching, (make, ask) = Watching(), ENTRIES[entry]
    problem = make(watching)
    watching.seen.clear()  # a few numbers, before any work
    ask(problem)
    assert watching.seen == {1}, entry


def test_threads_come_back_after_an_interruption_and_after_a_refusal():
    problem = line(mb.Obstacle(Watching().height))
    object.__setattr__(problem, "obstacle", Watching(fails=True))
    with pytest.raises(KeyboardInterrupt):
        problem.solve(load=1.0)
    with pytest.raises(mb.BadArgument):
        problem.solve(load=-1.0)
    assert set(numbers().values()) == {2}


def test_large_matrices_get_back_what_was_there():
    @bounded
    def inside(rows):
        with released(rows):
            during = set(numbers().values())
        return during, set(numbers().values())

    assert inside(LARGE) == ({2}, {1}) and inside(LARGE - 1) == ({1}, {1})


def test_a_number_that_the_user_sets_is_kept():
    with threadpool_limits(1):
        bounded(lambda: None)()
        assert set(numbers().values()) == {1}
    bounded(bounded(lambda: None))()
    assert set(numbers().values()) == {2}


def test_entries_of_several_python_threads_are_counted_together():
    """The number belongs to the process: the first to leave must not give it back under the other."""
    first, both, left = Barrier(2, timeout=30), Barrier(2, timeout=30), Barrier(2, timeout=30)

    @bounded
    def early():
        first.wait()
        both.wait()

    @bounded
    def inner():
        both.wait()
        left.wait()
        return set(numbers().values())

    def late():
        first.wait()
        return inner()

    with ThreadPoolExecutor(2) as pool:
        leaving = pool.submit(lambda: (early(), left.wait()))
        assert pool.submit(late).result() == {1}
        leaving.result()
    assert set(numbers().values()) == {2}


def test_libraries_that_are_loaded_later_are_seen():
    """NGSolve's own BLAS comes when a mesh is first used, which may be within a call."""
    code = (
        "from microblock.threads import bounded\n"
        "from threadpoolctl import ThreadpoolController, threadpool_info\n"
        "def numbers(): return [library['num_threads'] for library in threadpool_info()]\n"
        "@bounded\n"
        "def outer():\n"
        "    before = len(numbers())\n"
        "    import ngsolve\n"
        "    return before, bounded(numbers)()\n"
        "before, inside = outer()\n"
        "assert len(inside) > before and set(inside) == {1}, inside\n"
        "assert set(numbers()) == {2}, numbers()"
    )
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "2", "OMP_NUM_THREADS": "2"}
    subprocess.run([sys.executable, "-c", code], check=True, env=environment)


def test_libraries_are_looked_for_only_when_modules_came(monkeypatch):
    """A look takes a millisecond, the state of a half-plane fifteen."""
    bounded(lambda: None)()
    monkeypatch.setattr(ThreadpoolController, "__init__", lambda *_: pytest.fail("looked again"))
    bounded(lambda: bounded(lambda: None)())()


def test_large_transforms_take_the_threads_that_were_there_outside():
    assert bounded(threads.workers)(threads.MANY) == 2
    assert bounded(threads.workers)(threads.MANY - 1) == 1
    with threadpool_limits(1):
        assert bounded(threads.workers)(threads.MANY) == 1


def test_states_of_a_half_space_are_the_same_with_either_number():
    problem = mb.Contact(mb.HalfSpace(SOLID, 1.0), mb.Sphere(1.0), mb.Microblock(), mb.Cells(nodes=256))
    two = problem.solve(load=1.0)
    with threadpool_limits(1):
        one = problem.solve(load=1.0)
    assert np.array_equal(one.pressure, two.pressure)  # a transform does the same sums along each line
