"""Which cases there are: the modules of the other folders that have `Parameters`, and `result` or `run`."""

import ast
from functools import cache
from importlib import import_module
from pathlib import Path

CASES = Path(__file__).parents[1]
PACKAGE = __package__.rpartition(".")[0]  # "cases" in a checkout, "microblock.cases" where it is installed
PROGRAM = "python -m cases" if PACKAGE == "cases" else "microblock"
DATA = CASES / "data"  # records of the studies that take long
FOLDERS = "commands", "scenes", "paper", "studies", "report"  # in the order in which cases are listed


@cache
def headlines():
    """{name: (dotted module, first line of its docstring)} of all cases, read from their files: nothing is
    imported.
    """
    found = {}
    for folder in FOLDERS:
        for path in sorted((CASES / folder).glob("*.py")):
            text = path.read_text()
            if "\nclass Parameters" not in text:
                continue
            tree = ast.parse(text)
            if {"result", "run"} & {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}:
                found[path.stem] = (
                    f"{PACKAGE}.{folder}.{path.stem}",
                    ast.get_docstring(tree).partition("\n")[0],
                )
    return found


def case(name):
    """The module of a case; None where there is no such case."""
    return import_module(headlines()[name][0]) if name in headlines() else None


def all_cases():
    """{name: module} of all cases; this imports them all."""
    return {name: case(name) for name in headlines()}
