"""The library is broken on purpose, in places drawn by program: which test sees it?

    python -m tests.mutations [--first K] [--count N] [--seconds S] [--list] [--map]

draws 60 places of `microblock/` from SEED, a room's share by its statements and kinds in equal parts:

sign        a + b is a - b, -a is a                 term     a + b is a, or b
factor      a number is doubled, a product doubled or halved   index    a[0] is a[1], a[1:] is a[2:]
order       an order of integration or of elements less one    compare  a < b is a <= b, or a >= b
corner      "A" is "B", a loop over corners lacks the last     check    a refusal is gone, `and` is `or`

Each is made in a copy of the last commit. Of the tests that execute the place (`--map` records that once, in
the user's cache, with the package coverage) the quickest come first, then those that execute its file, and
the first that fails ends it, once it has passed without the mutation. Tests beyond the first S seconds are
left out. A test that hangs has failed. This module is the plugin of pytest that does so.

Not drawn: texts and what is in a `raise` (messages), annotations and decorators, which decide nothing; in
`view` numbers and products, constants, and arguments of methods of matplotlib: places, sizes and colours of
pictures. A place whose syntax tree stays equal is none. `<` becomes `<=` where whole numbers are compared,
since real ones are not equal, nor 0.

The score is the number of mutations found of 60. A mutation that no test can see, because results stay the
same, is no hole: it is named in EQUIVALENT by hand, with the reason. Such a place is left out of the draw,
and the next place of its room takes its share, so that a score is always one of 60.
"""

from __future__ import annotations

import argparse
import ast
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections import defaultdict, namedtuple
from concurrent.futures import ThreadPoolExecutor
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest

SEED = 301130  # of the places; another seed draws others
PLACES = 60
SECONDS = 150.0  # of the tests of a mutation, as they were recorded
WORKERS = 2  # that run at a time
LONGEST = 180  # seconds that what pytest imports may take
ROOT = Path(__file__).parents[1]
CACHE = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "microblock"
ORDER = re.compile(r"(?<![a-z])orders?(?![a-z])|degree|GAUSS", re.I)  # and no border
OTHER = {ast.Lt: "<= >=", ast.LtE: "< >", ast.Gt: ">= <=", ast.GtE: "> <", ast.Eq: "!=", ast.NotEq: "=="}
WHOLE = re.compile(r"\blen\(|\.(size|ndim|shape)\b|^[1-9]\d* |[<>=] [1-9]\d*$|count|number")  # of whole ones
SMALL = 1e-4  # literals below are thresholds, which 10^4 changes and 2 does not
# what a mutation and its statement say, and why no test can see it: decided by hand
EQUIVALENT = {
    ("sign: 1 + level -> ", "stats.norm"): "a quantile whose square counts",
    ("sign: value - near[i] -> ", "start = "): "where a fit of others begins",
    ("index: 0 -> 1", "len(body.spaces[0].GetDofNrs(facet))"): "the space of u2 has the orders of that of u1",
    ("factor: 24 -> 48", "length * (1 / 24 if"): "of multipliers: another number of steps to the same state",
    ("index: 0 -> 1", "surface[0] -= "): "a preconditioner of rotated blocks: other steps to the same state",
    ("factor: (before.slope + after.slope) / 2 -> ", ""): "of a line search: other steps to the same state",
    ("factor: sines * np.sign(", ""): "the least sine of an angle: no mesh is between",
    ("index: 0 -> 1", "np.array(self.free)[u1]"): "another unknown that holds a free translation",
    ("index: 1 -> 2", "opposite = np.zeros(forces.shape[1:])"): "the shape of zeros that are added alone",
    ("factor: 0 -> 1", "times.max(initial=0)"): "a round that cuts no element",
    ("factor: 1 -> 2", "gaps.reshape(len(self.blocks.names), -1)"): "NumPy takes -2 for what is left, as -1",
    ("compare: 50 * step > 1 -> (50 * step >= 1)", ""): "of real numbers, which are not equal",
    ("factor: nearest / 20 -> ((nearest / 20) / 2)", ""): "finer integrals of the same fields",
    (
        "factor: (self.high - self.low) / 2 -> ",
        "step = min(",
    ): "bounds a step of differences: loads move within their errors",
}


def equivalents(place):
    """The entries of EQUIVALENT that name a place."""
    lines = (ROOT / place.file).read_text().splitlines()[place.lines.start - 1 : place.lines.stop - 1]
    statement, words = " ".join(lines), words_of(place)
    return {(what, where) for what, where in EQUIVALENT if what in words and where in statement}


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
            for replacement in (boundary, *opposite) if WHOLE.search(text(node)) else opposite or (boundary,):
                yield "compare", node, f"({text(node.left)} {replacement} {text(node.comparators[0])})"
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
    unused = EQUIVALENT.keys() - set().union(
        *(equivalents(place) for places_of_room in rooms.values() for place in places_of_room)
    )
    if unused:
        raise SystemExit(f"EQUIVALENT names no place by {unused}")
    ends = np.rint(np.cumsum(list(sizes.values())) * count / sum(sizes.values())).astype(int)
    for number, (room, share) in enumerate(zip(rooms, np.diff(ends, prepend=0))):
        rng, chosen = np.random.default_rng((seed, number)), {}
        kinds = sorted({place.kind for place in rooms[room]})
        while len(chosen) < share:
            kind = kinds[rng.integers(len(kinds))]
            choice = [place for place in rooms[room] if place.kind == kind]
            place = choice[rng.integers(len(choice))]
            same = ast.dump(ast.parse(broken(place))) == ast.dump(ast.parse((ROOT / place.file).read_bytes()))
            if place.start not in chosen and not (same or equivalents(place)):
                chosen[place.start] = place
        yield from chosen.values()


def started():
    """The file of tests that a run has started, with the seconds that each took."""
    return Path(os.environ["MUTATIONS_TESTS"]).with_suffix(".log")


def chosen():
    """{test: recorded seconds} that pytest runs, in this order; none where lines are recorded."""
    file = Path(os.environ["MUTATIONS_TESTS"])
    return json.loads(file.read_text()) if file.exists() else {}


def pytest_configure():
    signal.alarm(LONGEST)  # which ends the process: an import can hang, too


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items):
    if order := {name: number for number, name in enumerate(chosen())}:
        items[:] = sorted(
            (item for item in items if item.nodeid in order), key=lambda item: order[item.nodeid]
        )


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item):
    """A test that takes much longer than recorded ends the process; lines are recorded in its name."""
    with started().open("a") as log:
        print(0, item.nodeid, file=log, flush=True)
        if tests := chosen():
            signal.alarm(int(30 + 10 * tests[item.nodeid]))  # on a busy machine, too
        else:
            signal.alarm(0)
            import coverage

            coverage.Coverage.current().switch_context(item.nodeid)
        start = time.process_time()
        result = yield
        print(f"{time.process_time() - start:.2f}", item.nodeid, file=log)
    return result


def run_pytest(root, test_files, tests, *words):
    """(whether test files pass in a checkout, {test that has been started: its seconds}); `tests` is the
    file of those that run, by default all.
    """
    path = os.pathsep.join((str(root), *filter(None, [os.environ.get("PYTHONPATH")])))
    paths = {"PYTHONPATH": path, "PYTHONDONTWRITEBYTECODE": "1", "MUTATIONS_TESTS": str(tests)}
    command = [sys.executable, *words, "-m", "pytest", "-p", "no:cacheprovider", "-p", "tests.mutations"]
    command += [*test_files] if words else ["-x", *test_files]
    log = tests.with_suffix(".log")
    log.write_text("")
    done = subprocess.run(command, cwd=root, env=os.environ | paths, capture_output=True)
    lines = (line.split(" ", 1) for line in log.read_text().splitlines())
    return done.returncode == 0, {name: float(seconds) for seconds, name in lines}


def lines_of(test_file):
    """Coverage's file of the lines that each test of a file executes, named by what it depends on."""
    read = [ROOT / test_file, *sorted((ROOT / "microblock").rglob("*.py"))]
    key = sha256(b"".join(path.read_bytes() for path in read)).hexdigest()[:12]
    return CACHE / "lines" / f"{test_file.replace('/', '.')}.{key}.db"


def test_files():
    return [str(path.relative_to(ROOT)) for path in sorted((ROOT / "tests").rglob("test_*.py"))]


def record(test_file):
    """Record the lines of a test file, if it or the library has changed since."""
    lines = lines_of(test_file)
    if not lines.with_suffix(".json").exists():
        words = "-m", "coverage", "run", "--source=microblock", f"--data-file={lines}"
        passed, tests = run_pytest(ROOT, [test_file], lines.with_suffix(".none"), *words)
        lines.with_suffix(".json").write_text(json.dumps(tests))
        said = "" if passed else ", some fail"
        print(f"{test_file}: {len(tests)} tests, {sum(tests.values()):.0f} s{said}", flush=True)


def tests_of(place):
    """({test: recorded seconds} that may see a place, how many execute it): these first, the quickest first,
    then those that execute its file, as what a module computes once is not recorded for all.
    """
    import coverage

    at_place, beside = {}, {}
    for file in test_files():
        lines = lines_of(file)
        if lines.with_suffix(".json").exists():
            seconds = json.loads(lines.with_suffix(".json").read_text())
            data = coverage.CoverageData(lines)
            data.read()
            for line, names in data.contexts_by_lineno(str(ROOT / place.file)).items():
                tests = at_place if line in place.lines else beside
                tests.update((name, seconds[name]) for name in names if name in seconds)
    ordered = [dict(sorted(tests.items(), key=lambda item: item[1])) for tests in (at_place, beside)]
    return ordered[0] | {name: spent for name, spent in ordered[1].items() if name not in at_place}, len(
        at_place
    )


def judged(place, most):
    """What is said of a mutation, which is made in a copy of the last commit: the test that finds it, if one
    does, which fails, and passes after the same tests without the mutation.
    """
    tests, count = tests_of(place)
    tests = {
        name: spent for (name, spent), sum in zip(tests.items(), np.cumsum([*tests.values()])) if sum < most
    }
    with tempfile.TemporaryDirectory() as folder:
        root, file = Path(folder), Path(folder) / "tests.json"
        archive = subprocess.run(["git", "archive", "HEAD"], cwd=ROOT, capture_output=True, check=True).stdout
        subprocess.run(["tar", "-x", "-C", root], input=archive, check=True)
        good = (root / place.file).read_bytes()

        def passes(text, tests):
            (root / place.file).write_bytes(text)
            file.write_text(json.dumps(tests))
            return run_pytest(root, sorted({name.split("::")[0] for name in tests}), file)

        while tests:
            passed, run = passes(broken(place), tests)
            if passed:
                break
            last = [*run, *tests][len(run) - 1 if run else 0]  # without one, what is imported fails
            if passes(good, {name: tests[name] for name in (*run, last)})[0]:
                return f"found by {last if run else 'the import of ' + last.split('::')[0]}, of {count} tests"
            tests = {name: seconds for name, seconds in tests.items() if name not in run and name != last}
    return f"SURVIVED, of {count} tests"


def main():
    words = argparse.ArgumentParser(prog="python -m tests.mutations", description=__doc__.split("\n")[0])
    for name, usual in {"first": 0, "count": PLACES, "seconds": SECONDS}.items():
        words.add_argument(f"--{name}", type=type(usual), default=usual)
    for name, does in {"list": "print the places alone", "map": "record what tests execute"}.items():
        words.add_argument(f"--{name}", action="store_true", help=does)
    arguments = words.parse_args()

    def say(number, place):
        said = "" if arguments.list else f": {judged(place, arguments.seconds)}"
        print(f"{number} {words_of(place)}{said}", flush=True)

    with ThreadPoolExecutor(WORKERS) as pool:
        if arguments.map:
            (CACHE / "lines").mkdir(parents=True, exist_ok=True)
            list(pool.map(record, test_files()))
        else:
            chosen = [*enumerate(drawn())][arguments.first : arguments.first + arguments.count]
            list(pool.map(say, *zip(*chosen)))


if __name__ == "__main__":
    main()
