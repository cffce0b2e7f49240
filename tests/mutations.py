"""The library is broken on purpose, in places drawn by program: which test sees it?

    python -m tests.mutations [--first K] [--count N] [--seconds S] [--json FILE] [--list] [--map]

draws 60 places of `microblock/` from SEED, a room's share by its statements and kinds in equal parts:

sign        a + b is a - b, -a is a                 term     a + b is a, or b
factor      a number is doubled, a product doubled or halved   index    a[0] is a[1], a[1:] is a[2:]
order       an order of integration or of elements less one    compare  a < b is a <= b, or a >= b
corner      "A" is "B", a loop over corners lacks the last     check    a refusal is gone, `and` is `or`

Each is made in a copy of the last commit. Of the tests that execute the place (`--map` records that once, in
the user's cache, with the package coverage) the quickest come first, and the first that fails ends it, once
it has passed without the mutation; those of a file that hand on what they computed stay together. Tests that
take more than S seconds together are left out. A test that hangs has failed.

Not drawn: texts and what is in a `raise` (messages), annotations and decorators, which decide nothing; in
`view` numbers and products, constants, and arguments of methods of matplotlib: places, sizes and colours of
pictures. A place whose syntax tree stays equal is none. `<` becomes `<=` where whole numbers are compared,
since real ones are not equal.
"""

from __future__ import annotations

import argparse
import ast
import functools
import json
import os
import re
import subprocess
import sys
import tempfile
import time
from collections import defaultdict, namedtuple
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest

SEED = 7351  # of the places; another seed draws others
PLACES = 60
SECONDS = 600.0  # of the tests of a mutation, as they were recorded
BATCHES = 0.0, 0.3, 3.0, 30.0, np.inf  # seconds of tests that share a process, and how long one may hang
ROOT = Path(__file__).parents[1]
CACHE = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "microblock"
SHARED = re.compile(r"^ *@.*(cache\b|scope=)", re.M)  # what a test of the file leaves for the next ones
LINES = "MICROBLOCK_LINES"  # environment variable: the file to which the plugin of pytest writes
ORDER = re.compile(r"order|degree|GAUSS", re.I)
OTHER = {ast.Lt: "<= >=", ast.LtE: "< >", ast.Gt: ">= <=", ast.GtE: "> <", ast.Eq: "!=", ast.NotEq: "=="}
WHOLE = re.compile(r"\blen\(|\.size\b|\.ndim\b|\.shape\b|^\d+ |[<>=] \d+$|count|number")  # of whole numbers
SMALL = 1e-4  # literals below are thresholds, which 10^4 changes and 2 does not
# what a place's line says, and why no test can see the mutation: decided by hand
EQUIVALENT = {
    "path.py:537: index: 0 -> 1": "the width is a scale of thresholds, less its first point",
    "factor: SETTLED * forces.sum()": "half of a threshold of what counts as settled",
    "factor: floor / half": "a sampled profile to twice the height that is negligible",
    "compare: there.sum(axis=1) < 0.6": "60 % of 27 places is no whole number",
}


# bytes `start` to `end` of a file, in a statement of some lines, are replaced
Place = namedtuple("Place", "file kind lines start end before after")


def words_of(place):
    short = (" ".join(text.split())[:70] for text in (place.before, place.after))
    return f"{place.file}:{place.lines.start}: {place.kind}: {' -> '.join(short)}"


def broken(place):
    """The file's bytes with the mutation."""
    text = (ROOT / place.file).read_bytes()
    return text[: place.start] + place.after.encode() + text[place.end :]


def variants(node, view):
    """(kind, node that is replaced, its new text) of a node of the syntax tree."""
    text = ast.unparse
    match node:
        case ast.UnaryOp(op=ast.USub()):
            yield "sign", node, f"({text(node.operand)})"
        case ast.BinOp(op=ast.Add() | ast.Sub()) if not re.search(r"['\"]", text(node)):
            left, right = f"({text(node.left)})", f"({text(node.right)})"
            signs = ("-", "") if isinstance(node.op, ast.Add) else ("+", "-")
            changed = f"({left} {signs[0]} {right})", left, f"({signs[1]}{right})"
            yield from ((kind, node, new) for kind, new in zip(("sign", "term", "term"), changed))
        case ast.BinOp(op=ast.Mult() | ast.Div()) if not view:
            yield from (("factor", node, f"(({text(node)}) {change})") for change in ("* 2", "/ 2"))
        case ast.Constant(value=int() | float() as value) if not view and not isinstance(value, bool):
            yield "factor", node, repr(value * (1e4 if 0 < value < SMALL else 2) or 1)
        case ast.Subscript(slice=index):
            for part in (index.lower, index.upper) if isinstance(index, ast.Slice) else (index,):
                if part is not None and re.fullmatch(r"-?\d+", text(part)):
                    yield "index", part, str(int(text(part)) + 1)
        case ast.Compare(ops=[op]) if type(op) in OTHER:
            boundary, *opposite = OTHER[type(op)].split()
            for other in (boundary, *opposite) if WHOLE.search(text(node)) else opposite or (boundary,):
                yield "compare", node, f"({text(node.left)} {other} {text(node.comparators[0])})"
        case ast.Constant(value="A" | "B"):
            yield "corner", node, repr("AB".replace(node.value, ""))
        case ast.For() | ast.comprehension() if "corner" in text(node.target) + text(node.iter):
            yield "corner", node.iter, f"list({text(node.iter)})[:-1]"
        case ast.BoolOp():
            word = " or " if isinstance(node.op, ast.And) else " and "
            yield "check", node, f"({word.join(f'({text(value)})' for value in node.values)})"
        case ast.If(body=[*_, ast.Raise()], orelse=[]):
            yield "check", node, "pass"
        case ast.Expr(value=ast.Call(func=called)) if re.search(r"(^|\.)_?(require|check)\w*$", text(called)):
            yield "check", node, "pass"
    if isinstance(node, ast.Call | ast.keyword):
        for part in node.args if isinstance(node, ast.Call) else [node.value]:
            named = node.arg if isinstance(node, ast.keyword) else text(part)
            if ORDER.search(named or "") and isinstance(part, ast.Name | ast.Attribute | ast.BinOp):
                yield "order", part, f"({text(part)} - 1)"


def breaks(node, view, lines=range(1, 2), module=True):
    """(kind, node that is replaced, its new text, lines of its statement) of all that is below a node."""
    if isinstance(node, ast.stmt):
        body = () if isinstance(node, ast.FunctionDef) else getattr(node, "body", ())
        lines = range(node.lineno, max(body[0].lineno if body else node.end_lineno + 1, node.lineno + 1))
        module = module and not isinstance(node, ast.FunctionDef)
    if not (view and module):
        yield from ((*variant, lines) for variant in variants(node, view))
    drawn = view and isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)
    for name, value in ast.iter_fields(node):
        if name not in ("annotation", "returns", "decorator_list") and (name == "func" or not drawn):
            for child in value if isinstance(value, list) else [value]:
                left_out = isinstance(child, ast.Raise | ast.JoinedStr) or not isinstance(child, ast.AST)
                if not left_out and "TYPE_CHECKING" not in ast.dump(child)[:60]:
                    yield from breaks(child, view, lines, module)


def places(file):
    """All places of a file."""
    text = (ROOT / file).read_bytes()
    starts = np.cumsum([0, *map(len, text.splitlines(keepends=True))])
    for kind, old, new, lines in breaks(ast.parse(text), "/view/" in file):
        start = int(starts[old.lineno - 1]) + old.col_offset
        end = int(starts[old.end_lineno - 1]) + old.end_col_offset
        yield Place(file, kind, lines, start, end, text[start:end].decode(), new)


def drawn(seed=SEED, count=PLACES):
    """The places of a seed, room by room."""
    rooms, sizes = defaultdict(list), defaultdict(int)
    for path in sorted((ROOT / "microblock").rglob("*.py")):
        rooms[path.parent] += places(str(path.relative_to(ROOT)))
        sizes[path.parent] += sum(
            isinstance(node, ast.stmt) for node in ast.walk(ast.parse(path.read_bytes()))
        )
    ends = np.rint(np.cumsum(list(sizes.values())) * count / sum(sizes.values())).astype(int)
    for number, (room, share) in enumerate(zip(rooms, np.diff(ends, prepend=0))):
        rng, chosen = np.random.default_rng((seed, number)), {}
        kinds = sorted({place.kind for place in rooms[room]})
        while len(chosen) < share:
            kind = kinds[rng.integers(len(kinds))]
            choice = [place for place in rooms[room] if place.kind == kind]
            place = choice[rng.integers(len(choice))]
            same = ast.dump(ast.parse(broken(place))) == ast.dump(ast.parse((ROOT / place.file).read_bytes()))
            if place.start not in chosen and not same:
                chosen[place.start] = place
        yield from chosen.values()


class Recorder:
    """Plugin of pytest: which lines of the library a test executes, in coverage's file, and its seconds."""

    def __init__(self, lines):
        import coverage

        self.file, self.seconds = Path(lines), {}
        self.coverage = coverage.Coverage(data_file=lines, source=["microblock"], config_file=False)
        self.coverage.set_option("run:relative_files", True)
        self.coverage.start()

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item):
        modules = [vars(module) for name, module in sys.modules.items() if name.startswith("microblock")]
        for value in [value for module in modules for value in module.values()]:
            if isinstance(value, functools._lru_cache_wrapper):
                value.cache_clear()  # what an earlier test computed is computed again
        self.coverage.switch_context(item.nodeid)
        start = time.perf_counter()
        result = yield
        self.seconds[item.nodeid] = time.perf_counter() - start
        self.coverage.switch_context("")
        return result

    def pytest_sessionfinish(self):
        self.coverage.stop()
        self.coverage.save()
        self.file.with_suffix(".json").write_text(json.dumps(self.seconds))


def pytest_configure(config):
    if LINES in os.environ:
        config.pluginmanager.register(Recorder(os.environ[LINES]))


def run_pytest(root, *arguments, **more):
    """What pytest prints in a checkout, and whether all tests have passed."""
    paths = os.pathsep.join(filter(None, (str(root), os.environ.get("PYTHONPATH"))))
    environment = {**os.environ, "PYTHONPATH": paths, "PYTHONDONTWRITEBYTECODE": "1", "PYTHONUNBUFFERED": "1"}
    command = [sys.executable, "-m", "pytest", "-vv", "-p", "no:cacheprovider", *map(str, arguments)]
    done = subprocess.run(command, cwd=root, env=environment | more, capture_output=True, text=True)
    return done.stdout, done.returncode == 0


def lines_of(test_file):
    """Coverage's file of the lines that the tests of a file execute, named by what it depends on."""
    file = ROOT / test_file
    beside = file.with_name(file.stem.removeprefix("test_"))  # a package of what it reads
    read = [file, *sorted((ROOT / "microblock").rglob("*.py")), *sorted(beside.rglob("*.*"))]
    key = sha256(b"".join(path.read_bytes() for path in read if path.suffix != ".pyc")).hexdigest()[:12]
    return CACHE / "lines" / f"{test_file.replace('/', '.')}.{key}.db"


def test_files():
    return sorted(str(file.relative_to(ROOT)) for file in (ROOT / "tests").rglob("test_*.py"))


def make_map():
    """Record the lines of every test file that has changed since, or the library with it."""
    (CACHE / "lines").mkdir(parents=True, exist_ok=True)
    for test_file in test_files():
        lines = lines_of(test_file)
        if not lines.with_suffix(".json").exists():
            start = time.perf_counter()
            run_pytest(ROOT, "-p", "tests.mutations", test_file, **{LINES: str(lines)})
            print(f"{test_file}: {time.perf_counter() - start:.0f} s", flush=True)


def tests_of(place):
    """{test, or file whose tests belong together: recorded seconds} of those that execute a place.

    Statements of a module or class are executed by what imports it: of them all tests of the file count.
    """
    import coverage

    units = {}
    for test_file in test_files():
        lines = lines_of(test_file)
        if not lines.with_suffix(".json").exists():
            raise SystemExit(f"lines of {test_file} are not recorded: --map")
        seconds, data = json.loads(lines.with_suffix(".json").read_text()), coverage.CoverageData(lines)
        data.read()
        contexts = data.contexts_by_lineno(place.file)
        here = set().union(*(contexts.get(line, ()) for line in place.lines))
        tests = set(seconds) & (set().union(*contexts.values()) if here == {""} else here)
        whole = tests and SHARED.search((ROOT / test_file).read_text())
        units |= {test_file: sum(seconds.values())} if whole else {test: seconds[test] for test in tests}
    return units


def first_failure(root, units):
    """The first of the tests, quickest first, that fails or hangs, "" where none begins, or None."""
    for low, high in zip(BATCHES, BATCHES[1:]):
        some = sorted((seconds, unit) for unit, seconds in units.items() if low <= seconds < high)
        if some:
            hang = f"faulthandler_timeout={60 + 20 * some[-1][0]:.0f}", "faulthandler_exit_on_timeout=true"
            printed, passed = run_pytest(
                root, "-x", "-o", hang[0], "-o", hang[1], *(unit for _, unit in some)
            )
            if not passed:
                begun = re.findall(r"^(tests/\S+?\.py::.*?)(?: [A-Z]+ .*)?$", printed, re.M)
                return begun[-1] if begun else ""  # not even imported
    return None


def judged(root, place, most):
    """(test that finds a mutation or None, number of tests that may) in a checkout, which stays as it was."""
    units, file = tests_of(place), root / place.file
    total = np.cumsum(sorted(units.values()))
    units = {unit: seconds for unit, seconds in units.items() if not most < total[total >= seconds][0]}
    while True:
        file.write_bytes(broken(place))
        test = first_failure(root, units)
        file.write_bytes((ROOT / place.file).read_bytes())
        unit = test if test in units else str(test).split("::")[0]
        if test is None or first_failure(root, {test: units.get(unit, 0.0)} if test else units) is None:
            return test, len(units)
        del units[unit]  # it fails without the mutation, too


def main():
    words = argparse.ArgumentParser(prog="python -m tests.mutations", description=__doc__.split("\n")[0])
    for name, usual in {"first": 0, "count": PLACES, "seconds": SECONDS, "json": ""}.items():
        words.add_argument(f"--{name}", type=type(usual), default=usual)
    for name, does in {"list": "print the places alone", "map": "record what tests execute"}.items():
        words.add_argument(f"--{name}", action="store_true", help=does)
    given, rows = words.parse_args(), []
    if given.map:
        return make_map()
    with tempfile.TemporaryDirectory() as root:
        archive = subprocess.run(["git", "archive", "HEAD"], cwd=ROOT, capture_output=True, check=True).stdout
        subprocess.run(["tar", "-x", "-C", root], input=archive, check=True)
        for number, place in list(enumerate(drawn()))[given.first : given.first + given.count]:
            start, said = time.perf_counter(), ""
            if not given.list:
                test, count = judged(Path(root), place, given.seconds)
                why = next((why for text, why in EQUIVALENT.items() if text in words_of(place)), None)
                found = (
                    f"found by {test or 'the import'}"
                    if test is not None
                    else f"equivalent: {why}"
                    if why
                    else "SURVIVED"
                )
                said = f": {found}, of {count}, {time.perf_counter() - start:.0f} s"
            print(f"{number} {words_of(place)}{said}", flush=True)
            rows.append((number, words_of(place), said))
    if given.json:
        Path(given.json).write_text(json.dumps(rows, indent=1))


if __name__ == "__main__":
    main()
