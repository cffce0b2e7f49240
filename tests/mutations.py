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
import faulthandler
import functools
import json
import os
import re
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest

SEED = 7351  # of the places; another seed draws others
PLACES = 60
SECONDS = 600.0  # of the tests of a mutation, as they were recorded
HANG = 60.0, 20.0  # seconds, and times the recorded ones, after which a test hangs
ROOT = Path(__file__).parents[1]
CACHE = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "microblock"
SHARED = re.compile(r"^ *@.*(cache\b|scope=)", re.M)  # what a test of the file leaves for the next ones
PLUGIN = "MICROBLOCK_MUTATIONS"  # environment variable: what the plugin does in a process of pytest
ORDER = re.compile(r"order|degree|GAUSS", re.I)
OTHER = {ast.Lt: "<= >=", ast.LtE: "< >", ast.Gt: ">= <=", ast.GtE: "> <", ast.Eq: "!=", ast.NotEq: "=="}
WHOLE = re.compile(r"\blen\(|\.size\b|\.ndim\b|\.shape\b|^\d+ |[<>=] \d+$|count|number")  # of whole numbers
SMALL = 1e-4  # literals below are thresholds, which 10^4 changes and 2 does not
EQUIVALENT = {}  # number: why no test can see the mutation


@dataclass(frozen=True)
class Place:
    """A mutation: bytes `start` to `end` of a file, in a statement of some lines, are replaced."""

    file: str
    kind: str
    lines: range
    start: int
    end: int
    before: str
    after: str

    def __str__(self):
        short = (" ".join(text.split())[:70] for text in (self.before, self.after))
        return f"{self.file}:{self.lines.start}: {self.kind}: {' -> '.join(short)}"

    def broken(self, text):
        return text[: self.start] + self.after.encode() + text[self.end :]


def variants(node, view):
    """(kind, node that is replaced, its new text) of a node of the syntax tree."""
    text = ast.unparse
    match node:
        case ast.UnaryOp(op=ast.USub()):
            yield "sign", node, f"({text(node.operand)})"
        case ast.BinOp(op=ast.Add() | ast.Sub()) if not re.search(r"['\"]", text(node)):
            plus = isinstance(node.op, ast.Add)
            left, right = f"({text(node.left)})", f"({text(node.right)})"
            yield "sign", node, f"({left} {'-' if plus else '+'} {right})"
            yield "term", node, left
            yield "term", node, right if plus else f"(-{right})"
        case ast.BinOp(op=ast.Mult() | ast.Div()) if not view:
            yield "factor", node, f"(2 * ({text(node)}))"
            yield "factor", node, f"(({text(node)}) / 2)"
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


def places(file):
    """All places of a file."""
    text = (ROOT / file).read_bytes()
    starts = np.cumsum([0, *map(len, text.splitlines(keepends=True))])
    tree, view, found = ast.parse(text), "/view/" in file, []

    def visit(node, lines, module):
        if isinstance(node, ast.Raise | ast.JoinedStr):
            return
        if isinstance(node, ast.stmt):
            body = getattr(node, "body", None)
            module = module and not isinstance(node, ast.FunctionDef)
            whole = isinstance(node, ast.FunctionDef) or not body
            lines = range(node.lineno, (node.end_lineno if whole else body[0].lineno - 1) + 1)
            lines = lines or range(node.lineno, node.lineno + 1)
        if not (view and module):
            for kind, old, new in variants(node, view):
                start, end = (
                    int(starts[line - 1]) + column
                    for line, column in ((old.lineno, old.col_offset), (old.end_lineno, old.end_col_offset))
                )
                found.append(Place(file, kind, lines, start, end, text[start:end].decode(), new))
        drawn = view and isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)
        for name, value in ast.iter_fields(node):
            if name in ("annotation", "returns", "decorator_list") or (drawn and name != "func"):
                continue
            for child in value if isinstance(value, list) else [value]:
                if isinstance(child, ast.AST) and "TYPE_CHECKING" not in ast.dump(child)[:60]:
                    visit(child, lines, module)

    visit(tree, range(1, 2), True)
    return found


def is_other(place):
    """Whether the mutated file is Python, and not the same."""
    text = (ROOT / place.file).read_bytes()
    try:
        return ast.dump(ast.parse(place.broken(text))) != ast.dump(ast.parse(text))
    except SyntaxError:
        return False


def drawn(seed=SEED, count=PLACES):
    """The places of a seed, room by room."""
    rooms, sizes = defaultdict(list), defaultdict(int)
    for path in sorted((ROOT / "microblock").rglob("*.py")):
        file = str(path.relative_to(ROOT))
        rooms[str(Path(file).parent)] += places(file)
        sizes[str(Path(file).parent)] += sum(
            isinstance(node, ast.stmt) for node in ast.walk(ast.parse(path.read_bytes()))
        )
    ends = np.rint(np.cumsum(list(sizes.values())) * count / sum(sizes.values())).astype(int)
    for number, (room, share) in enumerate(zip(rooms, np.diff(ends, prepend=0))):
        rng, seen = np.random.default_rng((seed, number)), set()
        kinds = sorted({place.kind for place in rooms[room]})
        while share:
            kind = kinds[rng.integers(len(kinds))]
            choice = [place for place in rooms[room] if place.kind == kind]
            place = choice[rng.integers(len(choice))]
            if place.start not in seen and is_other(place):
                seen.add(place.start)
                share -= 1
                yield place


class Recorder:
    """Plugin: which lines of the library a test executes, in coverage's file, and the seconds of what passes."""

    def __init__(self, lines):
        import coverage

        self.file, self.seconds, self.failed = Path(lines), {}, set()
        self.coverage = coverage.Coverage(data_file=lines, source=["microblock"], config_file=False)
        self.coverage.set_option("run:relative_files", True)
        self.coverage.start()

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item):
        for name, module in list(sys.modules.items()):  # what an earlier test computed is computed again
            if name.startswith("microblock"):
                for value in vars(module).values():
                    if isinstance(value, functools._lru_cache_wrapper):
                        value.cache_clear()
        self.coverage.switch_context(item.nodeid)
        result = yield
        self.coverage.switch_context("")
        return result

    def pytest_runtest_logreport(self, report):
        self.seconds[report.nodeid] = self.seconds.get(report.nodeid, 0.0) + report.duration
        if report.outcome != "passed":
            self.failed.add(report.nodeid)

    def pytest_sessionfinish(self):
        self.coverage.stop()
        self.coverage.save()
        passed = {test: seconds for test, seconds in self.seconds.items() if test not in self.failed}
        self.file.with_suffix(".json").write_text(json.dumps(passed))


class Chooser:
    """Plugin: the tests of a mutation in their order; which of them began, and what came of it, is in a file."""

    def __init__(self, seconds, report):
        self.seconds, self.report = json.loads(Path(seconds).read_text()), Path(report)
        self.order = {unit: number for number, unit in enumerate(self.seconds)}

    def unit(self, test):
        return test if test in self.order else test.split("::")[0]

    def say(self, test, outcome):
        self.report.write_text(json.dumps({"test": test, "outcome": outcome}))

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, items):
        chosen = [item for item in items if self.unit(item.nodeid) in self.order]
        items[:] = sorted(chosen, key=lambda item: self.order[self.unit(item.nodeid)])

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item):
        self.say(item.nodeid, "hangs")
        least, times = HANG
        limit = least + times * self.seconds[self.unit(item.nodeid)]
        faulthandler.dump_traceback_later(limit, exit=True)
        result = yield
        faulthandler.cancel_dump_traceback_later()
        return result

    def pytest_runtest_logreport(self, report):
        if report.outcome == "failed":
            self.say(report.nodeid, "fails")

    def pytest_sessionfinish(self, exitstatus):
        if not exitstatus:
            self.say("", "passed")


def pytest_configure(config):
    if PLUGIN in os.environ:
        kind, given = json.loads(os.environ[PLUGIN])
        config.pluginmanager.register({"record": Recorder, "choose": Chooser}[kind](**given))


def run_pytest(root, arguments, *plugin):
    """A finished process of pytest in a checkout, with a plugin."""
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join(filter(None, (str(root), os.environ.get("PYTHONPATH")))),
        "PYTHONDONTWRITEBYTECODE": "1",
        PLUGIN: json.dumps(plugin),
    }
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", "-p", "tests.mutations"]
    return subprocess.run([*command, *arguments], cwd=root, env=environment, capture_output=True, text=True)


def text_of(*files):
    return sha256(b"".join(file.read_bytes() for file in files)).hexdigest()[:12]


@functools.cache
def library():
    return text_of(*sorted((ROOT / "microblock").rglob("*.py")))


def lines_of(test_file):
    """Coverage's file of the lines that the tests of a file execute, named by what it depends on."""
    file = ROOT / test_file
    beside = file.with_name(file.stem.removeprefix("test_"))  # a package of what it reads
    key = text_of(file, *sorted(path for path in beside.rglob("*.*") if path.suffix in (".py", ".csv")))
    return CACHE / "lines" / f"{test_file.replace('/', '.')}.{library()}.{key}.db"


def test_files():
    return sorted(str(file.relative_to(ROOT)) for file in (ROOT / "tests").rglob("test_*.py"))


def make_map():
    """Record the lines of every test file that has changed since, or the library with it."""
    (CACHE / "lines").mkdir(parents=True, exist_ok=True)
    for test_file in test_files():
        lines = lines_of(test_file)
        if not lines.with_suffix(".json").exists():
            start = time.perf_counter()
            run_pytest(ROOT, ["--maxfail=9", test_file], "record", {"lines": str(lines)})
            print(f"{test_file}: {time.perf_counter() - start:.0f} s", flush=True)


def executed(place):
    """{file: lines} whose tests may see a place: its statement's; of a constant, those that name it; else all."""
    file = ast.parse((ROOT / place.file).read_bytes())
    for node in file.body:
        if isinstance(node, ast.Assign) and node.lineno in place.lines:
            names = re.compile(
                "|".join(rf"\b{name}\b" for name in re.findall(r"[A-Z_]+", ast.unparse(node.targets[0])))
            )
            return {
                str(path.relative_to(ROOT)): [
                    k for k, line in enumerate(path.open(), 1) if names.search(line)
                ]
                for path in (ROOT / "microblock").rglob("*.py")
            }
    return {place.file: place.lines}


def tests_of(place):
    """{test, or file whose tests belong together: recorded seconds} of those that execute a place, quickest first."""
    import coverage

    units = {}
    for test_file in test_files():
        lines = lines_of(test_file)
        if not lines.with_suffix(".json").exists():
            continue
        seconds, data = json.loads(lines.with_suffix(".json").read_text()), coverage.CoverageData(str(lines))
        data.read()
        tests = set()
        for file, wanted in executed(place).items():
            by_line = data.contexts_by_lineno(file)
            here = {test for line in wanted for test in by_line.get(line, ())}
            tests |= here if here - {""} else {test for all_of in by_line.values() for test in all_of if here}
        tests &= set(seconds)
        if tests and SHARED.search((ROOT / test_file).read_text()):
            units[test_file] = sum(seconds.values())
        else:
            units |= {test: seconds[test] for test in tests}
    return dict(sorted(units.items(), key=lambda unit: unit[1]))


def outcome(root, units):
    """{"test", "outcome"} of the first of the tests that fails or hangs in a checkout, or of all."""
    with tempfile.TemporaryDirectory() as place:
        seconds, report = Path(place) / "seconds", Path(place) / "report"
        seconds.write_text(json.dumps(units))
        files = sorted({unit.split("::")[0] for unit in units})
        run_pytest(root, files, "choose", {"seconds": str(seconds), "report": str(report)})
        if report.exists():
            return json.loads(report.read_text())
        return {"test": "", "outcome": "fails"}


def judged(root, place, most):
    """{"outcome", "test", "tests", "left out"} of a mutation, made in a checkout and taken back."""
    units, kept, total = tests_of(place), {}, 0.0
    for unit, seconds in units.items():
        total += seconds
        if total < most:
            kept[unit] = seconds
    counts = {"tests": len(kept), "left out": len(units) - len(kept)}
    file = root / place.file
    text = file.read_bytes()
    while kept:
        file.write_bytes(place.broken(text))
        try:
            result = outcome(root, kept)
        finally:
            file.write_bytes(text)
        test = result["test"] or min(kept, key=kept.get)  # "" where not even the import worked
        unit = test if test in kept else test.split("::")[0]
        if result["outcome"] == "passed" or outcome(root, {test: kept[unit]})["outcome"] == "passed":
            return {**result, **counts}
        del kept[unit]  # fails without the mutation, too
    return {"test": "", "outcome": "passed", **counts}


def main():
    words = argparse.ArgumentParser(prog="python -m tests.mutations", description=__doc__.split("\n")[0])
    words.add_argument("--first", type=int, default=0, metavar="K")
    words.add_argument("--count", type=int, default=PLACES, metavar="N")
    words.add_argument("--seconds", type=float, default=SECONDS, metavar="S")
    words.add_argument("--json", metavar="FILE")
    words.add_argument("--list", action="store_true", help="print the places")
    words.add_argument("--map", action="store_true", help="record which tests execute which lines")
    given = words.parse_args()
    if given.map:
        return make_map()
    rows = []
    with tempfile.TemporaryDirectory() as place:
        archive = subprocess.run(["git", "archive", "HEAD"], cwd=ROOT, capture_output=True, check=True).stdout
        subprocess.run(["tar", "-x", "-C", place], input=archive, check=True)
        for number, mutation in list(enumerate(drawn()))[given.first : given.first + given.count]:
            start = time.perf_counter()
            row = {} if given.list else judged(Path(place), mutation, given.seconds)
            found = row.get("outcome") in ("fails", "hangs")
            said = f"found: {row['test']} {row['outcome']}" if found else f"SURVIVED {row or ''}"
            said = f"equivalent: {EQUIVALENT[number]}" if number in EQUIVALENT and not found else said
            words = "" if given.list else f": {said}, {time.perf_counter() - start:.0f} s"
            print(f"{number} {mutation}{words}", flush=True)
            rows.append({"number": number, "place": str(mutation), "said": said, **row})
    if given.json:
        Path(given.json).write_text(json.dumps(rows, indent=1))


if __name__ == "__main__":
    main()
