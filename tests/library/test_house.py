"""Who may import whom, what runs without NGSolve and under Pyodide, what tests may know of the inside."""

import ast
import json
import subprocess
import sys
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

import microblock
import microblock as mb

ROOT = Path(microblock.__file__).parent
GROUND = {"errors", "threads", "cost"}  # may be used by all
MAY_IMPORT = {  # a room, and the rooms below it that it may use
    "__init__": {"model"},  # to which it tells where pictures and tables are
    "model": {"__init__"},  # the version, which files hold
    "contact_solvers": {"model"},
    "halfplane": {"model", "contact_solvers"},
    "halfspace": {"model", "contact_solvers", "halfplane"},  # its part in a plane is the half-plane's
    # the first zones of fitted meshes are those of a half-plane; the law over a surface that of a half-space
    "fem": {"model", "contact_solvers", "halfplane", "halfspace"},
    "contact": {"model", "halfplane", "halfspace", "fem"},
    "view": {"model", "contact_solvers", "halfplane", "halfspace", "fem", "contact"},
    "data": {"model", "contact_solvers", "halfplane", "halfspace", "fem", "contact", "__init__"},
    # a command is a user: it may ask for anything
    **dict.fromkeys(("command", "__main__"), {"__init__", "model", "data", "view", "contact", "command"}),
}
WHEN_CALLED = {"__init__": {"view", "data"}}  # where pictures and tables are
INSIDE = {  # what tests may name of the library beside its public names, and why
    "errors threads cost": "what all rooms share: values as they are shown, one thread, memory",
    "model": "closed forms, laws and proxies of obstacles: functions known by their values",
    "contact_solvers": "systems of corners at fixed nodes have no public name",
    "halfplane halfspace": "kernels and symbols against modes and quadrature; cells that judge",
    "fem": "loads without contact, the contact term by hand, meshes to solve on",
    "view": "sessions and pictures are looked at as they are drawn",
    "data command": "records are read back; options of commands",
}
PRIVATE = {  # modules of which tests take private names: there no public call reaches what is tested
    "microblock.contact_solvers.active_set": "pivoting alone, and a tableau that is spoilt",
    "microblock.halfspace.surface_solver": "cells of a state that are made finer, and loads beyond them",
    "microblock.halfplane.friction_solver": "errors of events of two levels alone",
    "microblock.fem.recovery": "pressure beyond the end of an obstacle alone",
}


def imports(path):
    """(modules of the package imported with the module, those imported when a function is called)."""
    package = ("microblock", *path.relative_to(ROOT).parts[:-1])
    modules = {True: set(), False: set()}
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.level:
            above = package[: len(package) - node.level + 1]
            base = ".".join((*above, *(node.module or "").split("."))).strip(".")
            for alias in node.names:
                dotted_name = f"{base}.{alias.name}"
                is_module = (ROOT.parent / dotted_name.replace(".", "/")).with_suffix(".py").exists()
                modules[node.col_offset == 0].add(dotted_name if is_module else base)
    return modules[True], modules[False]


def dotted(path):
    return ".".join(("microblock", *path.relative_to(ROOT).with_suffix("").parts))


def room(module):
    return module.split(".")[1] if "." in module else "__init__"


def test_imports_run_downwards_and_in_no_circle():
    files = list(ROOT.rglob("*.py"))
    for path in files:
        home = room(dotted(path))
        at_once, later = ({room(module) for module in names} - GROUND - {home} for names in imports(path))
        allowed = MAY_IMPORT.get(home, set())
        assert at_once <= allowed, path.name
        assert later <= allowed | WHEN_CALLED.get(home, set()), path.name
    # CycleError names the circle
    tuple(TopologicalSorter({dotted(path): imports(path)[0] for path in files}).static_order())


def test_no_circle_of_imports_is_left():
    """Those for types and inside functions counted; the root, which tells where pictures are, aside."""
    files = [path for path in ROOT.rglob("*.py") if path != ROOT / "__init__.py"]
    graph = {dotted(path): set().union(*imports(path)) - {"microblock"} for path in files}
    tuple(TopologicalSorter(graph).static_order())


def test_rooms_without_a_mesh_load_neither_ngsolve_nor_matplotlib():
    files = [
        path for name in ("model", "contact_solvers", "halfplane") for path in (ROOT / name).glob("*.py")
    ]
    modules = ", ".join(dotted(path) for path in files if path.stem != "__init__")
    code = f"import sys; import {modules}; assert not {{'ngsolve', 'matplotlib'}} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_a_state_on_panels_loads_no_more_than_it_needs():
    """A third of the seconds of a command were imports: of figures, of cells, of NumPy for nothing."""
    code = (
        "import sys, microblock as mb; assert 'numpy' not in sys.modules; from cases.commands import hertz; "
        "states = hertz.solutions(hertz.resolved()); "
        "assert not {'matplotlib', 'scipy.ndimage', 'scipy.optimize'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_public_names_say_what_they_are_and_type_checkers_know_them():
    assert all(getattr(microblock, name).__doc__ for name in microblock.__all__)
    stub = (ROOT / "__init__.pyi").read_text()
    assert {line.split()[-1] for line in stub.splitlines() if line.startswith("from")} == {
        *microblock.__all__
    }


def test_tests_know_little_of_the_inside():
    """Rooms of INSIDE, and private names of PRIVATE alone."""
    allowed = {room for rooms in INSIDE for room in rooms.split()}
    for path in Path(__file__).parents[1].rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("microblock."):
                assert room(node.module) in allowed, path
                private = [name.name for name in node.names if name.name.startswith("_")]
                assert not private or node.module in PRIVATE, path


# --- the half-plane runs where Pyodide does: without NGSolve, drawing, processes and a BLAS to bound


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
