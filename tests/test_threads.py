"""One BLAS thread inside the library, what was there before afterwards; no test here reads a clock."""

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from threading import Barrier

import numpy as np
import pytest
import scipy.linalg.blas  # noqa: F401      (its library is one of those that are looked at)
from threadpoolctl import threadpool_info, threadpool_limits

import microblock as mb
from microblock import meshes, threads
from microblock.threads import LARGE, bounded, released

SOLID = mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1)


def numbers():
    return {library["filepath"]: library["num_threads"] for library in threadpool_info()}


@pytest.fixture(autouse=True)
def two_threads():
    """Two threads outside, whatever the machine has: OpenBLAS takes any number."""
    import ngsolve  # noqa: F401      (brings a BLAS of its own)
    with threadpool_limits(2):
        if set(numbers().values()) != {2}:
            pytest.fail(f"threads cannot be set here: {numbers()}")
        yield
        assert set(numbers().values()) == {2}      # given back, whatever the test did


class Watching:
    """A cylinder that notes the threads while it is asked for its height."""

    def __init__(self, fails=False):
        self.seen, self.fails = set(), fails

    def height(self, x):
        self.seen |= set(numbers().values())
        if self.fails:
            raise KeyboardInterrupt
        return np.asarray(x)**2/20


def body():
    mesh = meshes.uniform(mb.Ground(far=2.0, reach=(-1.0, 1.0), half=False), 0.5)
    return mb.Body(mesh, SOLID, order=3, fixed="bottom")


def newton(obstacle):
    held = body()
    return mb.Newton(held, mb.ContactFacets(held, mb.Unilateral(), obstacle), control="load")


LAW = mb.Unilateral()
ENTRIES = {
    "Contact.at": lambda obstacle: mb.Contact(mb.HalfPlane(SOLID), obstacle, LAW).at(1.0, rtol=1e-2),
    "LinePath.at": lambda obstacle: mb.Contact(mb.HalfPlane(SOLID), obstacle, LAW).load(1.0).at(0.5),
    "LinePath.events": lambda obstacle: mb.Contact(mb.HalfPlane(SOLID), obstacle, LAW).load(1.0).events,
    "GridContact.at": lambda obstacle: mb.GridContact(mb.HalfPlane(SOLID), obstacle, LAW, window=(-1, 1)).at(1.0, nodes=64),
    "FittedContact.at": lambda obstacle: mb.FittedContact(SOLID, obstacle, LAW, domain=10.0).at(1.0, rtol=3e-2),
    "FittedContact.of_order": lambda obstacle: mb.FittedContact(SOLID, obstacle, LAW, domain=10.0).of_order(1.0, 4),
    "UniformContact.states": lambda obstacle: mb.UniformContact(SOLID, obstacle, LAW, domain=4.0, h=0.2, reach=0.8).states([0.5]),
    "BodyContact.at": lambda obstacle: mb.BodyContact(body(), obstacle, LAW).at(0.5),
    "BodyPath.events": lambda obstacle: mb.BodyContact(body(), obstacle, LAW).load(0.5).events,
    "Explorer": lambda obstacle: mb.Explorer(mb.Contact(mb.HalfPlane(SOLID), obstacle, LAW), load=1.0),
}


@pytest.mark.parametrize("entry", ENTRIES)
def test_inside_there_is_one_thread_and_outside_what_was_there(entry, monkeypatch):
    watching = Watching()
    # what scenes ask of an obstacle when they are made is a few numbers, before any work
    monkeypatch.setattr("microblock.obstacles.check", lambda obstacle: None)
    for module in ("scene", "ground"):
        monkeypatch.setattr(f"microblock.{module}.check_lowest", lambda *arguments: None)
    ENTRIES[entry](watching)
    assert watching.seen == {1}, entry


def test_newton_has_one_thread_too(monkeypatch):
    solver, seen = newton(mb.Cylinder(10.0)), set()
    look = solver._look
    monkeypatch.setattr(solver, "_look", lambda *arguments: seen.update(numbers().values()) or look(*arguments))
    solver.solve(0.5)
    assert seen == {1}


def test_threads_come_back_after_an_interruption_and_after_a_refusal():
    scene = mb.Contact(mb.HalfPlane(SOLID), mb.Shape(Watching().height), LAW)
    object.__setattr__(scene, "obstacle", Watching(fails=True))
    with pytest.raises(KeyboardInterrupt):
        scene.at(1.0)
    with pytest.raises(mb.BadArgument):
        scene.at(-1.0)
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
    code = ("from microblock.threads import bounded\n"
            "from threadpoolctl import threadpool_info\n"
            "def numbers(): return [library['num_threads'] for library in threadpool_info()]\n"
            "@bounded\n"
            "def outer():\n"
            "    before = len(numbers())\n"
            "    import ngsolve\n"
            "    return before, bounded(numbers)()\n"
            "before, inside = outer()\n"
            "assert len(inside) > before and set(inside) == {1}, inside\n"
            "assert set(numbers()) == {2}, numbers()")
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "2", "OMP_NUM_THREADS": "2"}
    subprocess.run([sys.executable, "-c", code], check=True, env=environment)


def test_libraries_are_looked_for_only_when_modules_came(monkeypatch):
    """A look takes a millisecond, the state of a half-plane fifteen."""
    bounded(lambda: None)()
    monkeypatch.setattr(threads, "_look", lambda: pytest.fail("looked again"))
    bounded(lambda: bounded(lambda: None)())()
