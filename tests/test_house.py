"""Who may import whom, what runs without NGSolve, what the package says of itself."""

import ast
import subprocess
import sys
from pathlib import Path

import microblock

ROOT = Path(microblock.__file__).parent
# a room and the rooms that it may use; errors, display and threads may be used by all
MAY_IMPORT = {
    "errors": set(), "material": set(), "obstacles": set(), "meshes": {"cost"}, "cost": set(), "references": set(), "observables": set(),
    "plots": set(), "adapt": set(), "proxy": set(), "picture": {"observables", "obstacles", "proxy"}, "survey": {"observables", "panels"},
    "cells_instead": {"grid_contact"}, "graded_cells": {"active_set", "halfplane", "observables", "panels"},
    "line_solver": {"adapt", "contact_line", "graded_cells", "line_state", "panels", "survey", "topology"},
    "study": {"__init__"}, "provenance": {"study"}, "sweeps": {"provenance"},
    "export": {"line_state", "panels", "path", "study", "subsurface", "surface_view"},
    "law": {"obstacles"}, "body": {"cost", "material", "meshes"},
    "condensation": {"body", "compliance", "cost", "facets", "panels"},
    "surface_state": {"condensation", "law", "mesh_fields", "observables", "panels", "surface_view"},
    "ground": {"law", "material", "observables", "obstacles", "panels", "scene_view"},
    "scene_view": {"explorer", "law", "obstacles", "widgets"},
    "uniform": {"active_set", "body", "condensation", "facets", "ground", "meshes", "newton", "newton_path", "surface_state"},
    "body_state": {"between", "law", "mesh_fields", "meshes", "observables", "surface_view"}, "mesh_fields": {"below"}, "refined": {"between", "facets", "panels"},
    "body_contact": {"active_set", "body", "body_state", "condensation", "observables", "path", "refined", "scene_view"},
    "meeting": {"halfplane"},
    "between": {"observables", "obstacles", "panels", "picture"},
    "fitted": {"active_set", "between", "body", "graded_cells", "line_solver", "picture", "topology", "condensation", "ground", "law", "meshes", "observables", "panels", "surface_state"},
    "compliance": set(), "halfplane": {"compliance", "material"}, "panels": {"halfplane", "law"}, "active_set": set(),
    "contact_line": {"line_state", "meeting", "panels"}, "subsurface": {"halfplane", "panels"},
    "line_state": {"below", "observables", "panels", "subsurface", "surface_view"}, "topology": {"active_set", "observables", "panels", "picture"},
    "path": {"halfplane", "observables"},
    "scene": {"body_contact", "cells_instead", "contact_line", "halfplane", "law", "line_solver", "line_state", "obstacles", "panels", "path", "picture", "scene_view", "surface_view"},
    "grid": {"halfplane"}, "projected_cg": set(), "grid_contact": {"grid", "halfplane", "law", "observables", "projected_cg", "scene_view", "surface_view"},
    "facets": {"body", "law"}, "newton": {"body", "cost", "facets", "law"}, "newton_path": set(), "__init__": set(),
    "display": set(), "threads": set(), "surface_view": {"below", "observables", "obstacles", "state_figure"}, "blocks": set(), "state_figure": {"blocks", "law", "plots"},
    "frames": {"plots"}, "below": {"plots"}, "explorer": {"frames", "law", "panels", "scene_view", "state_figure", "picture"}, "widgets": {"below"},
}


def imported(path):
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.level == 1:
            yield from [node.module] if node.module else (
                alias.name if (ROOT/f"{alias.name}.py").exists() else "__init__" for alias in node.names)


def test_imports_run_one_way():
    for path in ROOT.glob("*.py"):
        assert set(imported(path)) - {"errors", "display", "threads"} <= MAY_IMPORT[path.stem], path.name


def test_numbers_do_without_ngsolve():
    code = ("import sys; import microblock as mb; import microblock.references; "
            "mb.Cosserat(1, 0.3, 0.1, beta=1); mb.Microblock(); mb.Cylinder(1.0); "
            "assert 'ngsolve' not in sys.modules")
    assert subprocess.run([sys.executable, "-c", code]).returncode == 0


def test_public_names_exist():
    for name in microblock.__all__:
        assert getattr(microblock, name).__doc__


def test_lines_are_short_enough_to_stand_beside_each_other():
    long = [f"{path.name}:{number}" for folder in (ROOT, ROOT.parent/"cases") for path in sorted(folder.glob("*.py"))
            for number, line in enumerate(path.read_text().splitlines(), 1) if len(line) > 130]
    assert not long


def test_one_version_everywhere():
    top = ROOT.parent
    changes = next(line for line in (top/"CHANGELOG.md").read_text().splitlines() if line.startswith("## "))
    assert changes.split()[1].rstrip(",") == microblock.__version__
    assert f"\nversion: {microblock.__version__}\n" in (top/"CITATION.cff").read_text()
