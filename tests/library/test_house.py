"""Who may import whom, what runs without NGSolve, what the package says of itself."""

import ast
import subprocess
import sys
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

import microblock
from tests import insides

ROOT = Path(microblock.__file__).parent
GROUND = {"errors", "threads", "cost"}  # may be used by all
MAY_IMPORT = {  # a room, and the rooms below it that it may use
    "errors": set(),
    "threads": set(),
    "cost": set(),
    "__init__": set(),
    "model": set(),
    "corners": {"model"},
    "halfplane": {"model", "corners"},
    "halfspace": {"model", "corners", "halfplane"},  # its part in a plane is the half-plane's
    # the first zones of fitted meshes are those of a half-plane; the law over a surface that of a half-space
    "fem": {"model", "corners", "halfplane", "halfspace"},
    "path": {"model", "halfplane"},
    "contact": {"model", "halfplane", "halfspace", "fem", "path"},
    "view": {"model", "corners", "halfplane", "halfspace", "fem", "path", "contact"},
    "data": {"model", "corners", "halfplane", "halfspace", "fem", "path", "contact", "__init__"},
}
WHEN_CALLED = {  # rooms above that are loaded by a call alone: what draws, and what needs NGSolve
    "model": {"view"},
    "halfplane": {"view"},
    "halfspace": {"view"},
    "fem": {"view"},
}


def imports(path):
    """(modules of the package that are imported with the module, those that functions import when called),
    dotted."""
    package = ("microblock", *path.relative_to(ROOT).parts[:-1])
    tree = ast.parse(path.read_text())
    found = {True: set(), False: set()}
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.level:
            above = package[: len(package) - node.level + 1]
            base = ".".join((*above, *(node.module or "").split("."))).strip(".")
            for alias in node.names:
                whole = f"{base}.{alias.name}"
                is_module = (ROOT.parent / whole.replace(".", "/")).with_suffix(".py").exists()
                found[node.col_offset == 0].add(whole if is_module else base)
    return found[True], found[False]


def dotted(path):
    """The name of the module in a file."""
    return ".".join(("microblock", *path.relative_to(ROOT).with_suffix("").parts))


def room(module):
    """The room of a dotted module, or its own name where it stands at the top."""
    return module.split(".")[1] if "." in module else "__init__"


def test_imports_run_downwards():
    for path in ROOT.rglob("*.py"):
        own = room(dotted(path))
        at_once, later = ({room(one) for one in names} - GROUND - {own} for names in imports(path))
        assert at_once <= MAY_IMPORT[own], path.name
        assert later <= MAY_IMPORT[own] | WHEN_CALLED.get(own, set()), path.name


def test_no_circle_of_modules():
    graph = {dotted(path): imports(path)[0] for path in ROOT.rglob("*.py")}
    tuple(TopologicalSorter(graph).static_order())  # CycleError names the circle


@pytest.mark.parametrize("name", ["model", "corners", "halfplane"])
def test_rooms_without_a_mesh_load_neither_ngsolve_nor_matplotlib(name):
    files = (ROOT / name).glob("*.py")
    modules = [f"microblock.{name}.{path.stem}" for path in files if path.stem != "__init__"]
    code = (
        f"import sys; import {', '.join(modules)}; assert not {{'ngsolve', 'matplotlib'}} & set(sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code]).returncode == 0


def test_numbers_do_without_ngsolve():
    code = (
        "import sys; import microblock as mb; import microblock.model.closed_forms; "
        "mb.Cosserat(1, 0.3, 0.1, beta=1); mb.Microblock(); mb.Cylinder(1.0); "
        "assert 'ngsolve' not in sys.modules"
    )
    assert subprocess.run([sys.executable, "-c", code]).returncode == 0


def test_public_names_exist():
    for name in microblock.__all__:
        assert getattr(microblock, name).__doc__


def test_insides_that_tests_use_are_listed_with_a_reason():
    """`python -m tests.insides --names` names them, `--write` counts them anew in tests/INSIDES.md."""
    listed = insides.listed()
    assert {name: counts for name, (counts, *_) in listed.items()} == insides.counted()
    assert [name for name, (_, part, why) in listed.items() if not (part and why)] == []


def test_uses_of_insides_are_counted(tmp_path):
    (tmp_path / "some.py").write_text(
        "import microblock as mb, sys\n"
        "from microblock.fem import meshes, body as b\n"
        "from microblock.corners.active_set import _kkt, solve\n"
        "def test(monkeypatch, state, mesh=meshes.uniform):\n"
        "    monkeypatch.setattr(b, 'Loads', None)\n"
        "    monkeypatch.setattr('microblock.cost._x', 1)\n"
        "    monkeypatch.setattr('time.sleep', None), monkeypatch.setitem(sys.modules, 'x', None)\n"
        "    return state.solution.thing, state._hidden, state._repr_html_(), mb.State, meshes.uniform\n"
    )
    kinds = [kind for kind, _ in insides.uses(tmp_path / "some.py")]
    assert {kind: kinds.count(kind) for kind in insides.KINDS} == dict(
        imports=2, private=3, patches=2, reached=1
    )
