"""The half-plane runs where Pyodide does: without NGSolve, drawing, processes and a BLAS to bound
(docs/howto/command_line.md).
"""

import json
import subprocess
import sys

import pytest

import microblock as mb

# what is not there under Pyodide, and what only sweeps and pictures may need
MISSING = [
    *("ngsolve", "netgen", "matplotlib", "PIL"),
    *("pebble", "loky", "joblib", "dask", "distributed", "cloudpickle"),
    *("_multiprocessing", "multiprocessing.pool", "multiprocessing.process", "concurrent.futures.process"),
    *("fcntl", "resource"),
]
BLOCK = f"""
import json, sys, types

class Blocked:
    def find_spec(self, name, path=None, target=None):
        if any(name == one or name.startswith(one + ".") for one in {MISSING}):
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)

sys.meta_path.insert(0, Blocked())
blas = types.ModuleType("threadpoolctl")  # without a library that it knows
blas.ThreadpoolController = type("ThreadpoolController", (), {{"lib_controllers": []}})
sys.modules["threadpoolctl"] = blas
import microblock as mb
body = mb.HalfPlane(mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.085))
"""
SOLVE = """
state = mb.Contact(body, mb.Cylinder(R=10), mb.Microblock()).solve(load=1.0)
print(json.dumps([state.half_width, float(state.pressure_at(0.0)), state.zones["full"]]))
"""
EVENTS = """
events = mb.Contact(body, mb.Cylinder(R=10), mb.Microblock()).path(load=1.0).events
print(json.dumps([event.load for event in events]))
"""
CELLS = """
rough = mb.Contact(mb.HalfPlane(body.solid, period=1.0), mb.Rough(period=1.0, slope=0.1), mb.Microblock(),
    mb.Cells(nodes=256))
print(json.dumps(rough.solve(load=0.5).half_width))
"""


def run(code):
    """What a program prints in a process of its own in which all of MISSING is missing."""
    ran = subprocess.run([sys.executable, "-c", BLOCK + code], capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
    return json.loads(ran.stdout)


def test_the_half_plane_solves_where_pyodide_does():
    solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.085)
    state = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Microblock()).solve(load=1.0)
    half_width, pressure, full = run(SOLVE)
    # the same operations in the same libraries: nothing but rounding may differ
    assert half_width == pytest.approx(state.half_width, rel=1e-12)
    assert pressure == pytest.approx(float(state.pressure_at(0.0)), rel=1e-12)
    assert full == [pytest.approx(interval, rel=1e-12) for interval in state.zones["full"]]


@pytest.mark.parametrize("code", [EVENTS, CELLS], ids=["load path", "cells"])
def test_paths_and_cells_do_as_well(code):
    assert run(code)


def test_what_is_blocked_would_be_noticed():
    ran = subprocess.run(
        [sys.executable, "-c", BLOCK + "state = mb.Block(body.solid, 2.0); import ngsolve"],
        capture_output=True,
        text=True,
    )
    assert "No module named 'ngsolve'" in ran.stderr
