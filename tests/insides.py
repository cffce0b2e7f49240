"""What the tests use of the inside of the library, by file.

    PYTHONPATH=. python -m tests.insides            the table
    PYTHONPATH=. python -m tests.insides --names    with the names
    PYTHONPATH=. python -m tests.insides --write    new counts into tests/INSIDES.md, whose reasons stay

imports  names from modules below `microblock`, although it may export them
private  names with a leading underscore, of the library, the cases or the tests
patches  places of the library or of the cases that a test replaces while it runs
reached  accesses to `Contact.solver` and `State.solution`, behind which the parts of the library stand

`tests/INSIDES.md` lists each file in which one of these is not zero, the part of the library on which the
file depends, and why. A test compares its counts with those of the files. Not counted is the package of
frozen numbers: one module of it alone knows the names of the library, and follows when they change.
"""

import ast
import builtins
import re
import sys
from collections import Counter
from functools import cache
from pathlib import Path

TESTS = Path(__file__).parent
LIST = TESTS / "INSIDES.md"
KINDS = ("imports", "private", "patches", "reached")
OURS = ("microblock", "cases")
FOREIGN = {"pyplot", "mathml"}  # of Matplotlib and of the site, imported by a call
ELSEWHERE = {"_exit", "_suptitle", "_dom_classes"}  # of Python, Matplotlib and ipywidgets
ROW = re.compile(r"\| `([^`]+)` \|" + r" (\d+) \|" * len(KINDS) + r" (.*) \| (.*) \|")


def is_ours(name):
    """Whether a dotted name lies in the library or in the cases."""
    return name.split(".")[0] in OURS


@cache
def is_module(name):
    """Whether a dotted name is a module of the library or of the cases."""
    path = TESTS.parent.joinpath(*name.split("."))
    return is_ours(name) and (path.is_dir() or path.with_suffix(".py").exists())


def is_inside(module, name):
    """Whether a name is taken from a module below `microblock`, where it is not promised to stay."""
    return module.startswith("microblock.")


def is_private(name):
    """Whether a name is private; protocols such as `__init__` and `_repr_html_` are not."""
    return name.startswith("_") and not name.endswith("_") and name not in ELSEWHERE


class Uses(ast.NodeVisitor):
    """Insides that a file uses, in the order of its lines: `found`, a list of (kind, name)."""

    def __init__(self):
        self.modules = {}  # imported name: dotted name
        self.found = []

    def add(self, kind, name):
        # a name is imported once; every private access, patch or reach is one more place that has to change
        if kind == "imports" and is_private(name.split(".")[-1]):
            return
        if kind != "imports" or (kind, name) not in self.found:
            self.found.append((kind, name))

    def visit_Import(self, node):
        for alias in node.names:
            top = alias.name.split(".")[0]
            self.modules[alias.asname or top] = alias.name if alias.asname else top

    def visit_ImportFrom(self, node):
        for alias in node.names:
            whole = f"{node.module or 'tests'}.{alias.name}"
            self.modules[alias.asname or alias.name] = whole
            if not is_module(whole) and is_inside(whole.rpartition(".")[0], alias.name):
                self.add("imports", whole)
            if is_private(alias.name):
                self.add("private", whole)

    def visit_Attribute(self, node):
        base = self.modules.get(node.value.id, "") if isinstance(node.value, ast.Name) else ""
        if is_module(base) and is_inside(base, node.attr):
            self.add("imports", f"{base}.{node.attr}")
        whole = ast.unparse(node)
        if is_private(node.attr) and not whole.startswith("self."):
            self.add("private", whole)
        if node.attr in ("solver", "solution"):
            self.add("reached", whole)
        self.generic_visit(node)

    def visit_Call(self, node):
        if isinstance(node.func, ast.Attribute) and node.func.attr in ("setattr", "setitem", "delattr"):
            place, *rest = node.args
            name = rest[0].value if rest and isinstance(rest[0], ast.Constant) else ""
            text = place.value if isinstance(place, ast.Constant) else f"{ast.unparse(place)}.{name}"
            root = text.split(".")[0].split("(")[0]
            if not isinstance(place, ast.Constant):
                foreign = hasattr(builtins, root) or root in FOREIGN
                root = self.modules.get(root, "" if foreign else "microblock")
            if is_ours(root):
                self.add("patches", text)
                if is_private(text.split(".")[-1]):
                    self.add("private", text)
        self.generic_visit(node)


def uses(path):
    """Insides that a file uses: a list of (kind, name)."""
    visitor = Uses()
    visitor.visit(ast.parse(path.read_text()))
    return visitor.found


def counted():
    """{file below tests/: {kind: count}} of the files that use an inside."""
    files = {path.relative_to(TESTS).as_posix(): path for path in sorted(TESTS.rglob("*.py"))}
    found = {
        name: Counter(kind for kind, _ in uses(path)) for name, path in files.items() if "frozen" not in name
    }
    return {name: {kind: count[kind] for kind in KINDS} for name, count in found.items() if count}


def listed():
    """{file below tests/: ({kind: count}, part of the library, reason)} of tests/INSIDES.md."""
    rows = (ROW.fullmatch(line) for line in LIST.read_text().splitlines())
    return {
        name: (dict(zip(KINDS, map(int, rest[: len(KINDS)]))), *rest[len(KINDS) :])
        for name, *rest in (row.groups() for row in rows if row)
    }


def write():
    """Writes the counts of today into tests/INSIDES.md; parts and reasons stay."""
    known = listed()
    head = LIST.read_text().split("\n| file |")[0]
    lines = [f"| file | {' | '.join(KINDS)} | part | why |", "|" + "---|" * (3 + len(KINDS))]
    for name, counts in counted().items():
        part, why = known.get(name, (None, "", ""))[1:]
        numbers = " | ".join(str(counts[kind]) for kind in KINDS)
        lines.append(f"| `{name}` | {numbers} | {part} | {why} |")
    LIST.write_text(head + "\n" + "\n".join(lines) + "\n")


def main(arguments):
    if "--write" in arguments:
        write()
    table = counted()
    print(f"{'file':36}" + "".join(f"{kind:>9}" for kind in KINDS))
    for name, counts in table.items():
        print(f"{name:36}" + "".join(f"{counts[kind]:>9}" for kind in KINDS))
        if "--names" in arguments:
            for (kind, place), times in Counter(uses(TESTS / name)).items():
                print(f"    {kind:9}{place}" + (f"  ({times} times)" if times > 1 else ""))
    print(
        f"{len(table):3} files{'':27}"
        + "".join(f"{sum(row[kind] for row in table.values()):>9}" for kind in KINDS)
    )


if __name__ == "__main__":
    main(sys.argv[1:])
