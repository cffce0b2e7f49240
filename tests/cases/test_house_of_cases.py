"""Who may import whom among the cases: folders downwards, no circle, imports inside functions included."""

import ast
from dataclasses import fields
from graphlib import TopologicalSorter
from pathlib import Path

import cases
from cases.common.catalog import all_cases
from cases.common.options import Checked

ROOT = Path(cases.__file__).parent
MAY_IMPORT = {
    "common": set(),
    "commands": {"common"},
    "scenes": {"common"},
    "paper": {"common", "scenes"},
    "studies": {"common", "scenes"},
    "report": {"common", "scenes", "paper", "studies"},
    "__main__": {"common"},
    "__init__": set(),
}


def dotted(path):
    return ".".join(("cases", *path.relative_to(ROOT).with_suffix("").parts))


MODULES = {dotted(path): path for path in ROOT.rglob("*.py") if path.name != "__init__.py"}


def imported(path):
    """The modules of the cases that a file imports anywhere, dotted."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            # relative, so that the cases also run as microblock.cases
            assert node.level or node.module.partition(".")[0] != "cases", path
            home = dotted(path).rsplit(".", node.level)[0] if node.level else ""
            module = ".".join(filter(None, (home, node.module)))
            found |= {module, *(f"{module}.{alias.name}" for alias in node.names)}
    return found & set(MODULES)


def test_imports_of_cases_run_downwards():
    for name, path in MODULES.items():
        folder = name.split(".")[1]
        used = {one.split(".")[1] for one in imported(path)} - {folder}
        assert used <= MAY_IMPORT[folder], name


def test_no_circle_of_cases():
    # raises CycleError
    TopologicalSorter({name: imported(path) for name, path in MODULES.items()}).prepare()


def test_a_circle_would_be_seen():
    graph = {"a": {"b"}, "b": {"a"}}
    try:
        TopologicalSorter(graph).prepare()
    except ValueError as failure:
        assert "cycle" in str(failure)
    else:
        raise AssertionError("the sorter sees no circles")


def test_parameters_are_checked_in_one_place():
    """Each case declares its ranges; what a class adds is for fields that do not go together."""
    for name, module in all_cases().items():
        assert issubclass(module.Parameters, Checked), name
        assert "__post_init__" not in vars(module.Parameters), name
        assert all("rule" in entry.metadata for entry in fields(module.Parameters)), name
