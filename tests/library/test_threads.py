"""One BLAS thread inside the library, what was there before afterwards; no test here reads a clock."""

import numpy as np
import pytest
import scipy.linalg.blas  # noqa: F401      (its library is one of those that are looked at)
from threadpoolctl import threadpool_info, threadpool_limits

import microblock as mb
from microblock import threads
from microblock.fem import meshes

SOLID, LAW = mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1), mb.Unilateral()
MESH = meshes.uniform(meshes.Ground(far=2.0, reach=(-1.0, 1.0), half=False), 0.5)
GROUND, BODY = mb.HalfPlane(SOLID), mb.Body(MESH, SOLID, order=3, fixed="bottom")


def numbers():
    """Threads of the libraries; cvxopt's own BLAS is built for a single one."""
    return {one["num_threads"] for one in threadpool_info() if "cvxopt" not in one["filepath"]}


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
    "panels, first": (GROUND, None, lambda problem: problem.path(load=1.0).first),
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
    problem = mb.Contact(body, watching, LAW, method)
    watching.seen.clear()  # a few numbers, before any work
    ask(problem)
    assert watching.seen == {1}


def test_threads_come_back_after_an_interruption_and_after_a_refusal():
    watching = Watching()
    problem = mb.Contact(GROUND, watching, LAW)
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
