"""The library is broken on purpose, in places drawn by program: which test sees it?

python -m tests.mutations [--first K] [--count N] [--seconds S] [--json FILE] [--list] [--map]
"""

from __future__ import annotations

import functools
import json
import os
import re
import subprocess
import sys
import time
from hashlib import sha256
from pathlib import Path

import pytest

SEED = 7351  # of the places; another seed draws others
ROOT = Path(__file__).parents[1]
CACHE = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "microblock"
SHARED = re.compile(r"^ *@.*(cache\b|scope=)", re.M)  # what a test of the file leaves for the next ones
PLUGIN = "MICROBLOCK_MUTATIONS"  # environment variable: what the plugin does in a process of pytest


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


def pytest_configure(config):
    if PLUGIN in os.environ:
        given = json.loads(os.environ[PLUGIN])
        config.pluginmanager.register(Recorder(**given))


def text_of(file):
    return sha256(file.read_bytes()).hexdigest()[:12]


def lines_of(test_file):
    """Coverage's file of the lines that the tests of a file execute, named by what it depends on."""
    library = "".join(text_of(file) for file in sorted((ROOT / "microblock").rglob("*.py")))
    key = sha256((library + text_of(ROOT / test_file)).encode()).hexdigest()[:12]
    return CACHE / "lines" / f"{test_file.replace('/', '.')}.{key}.db"


def test_files():
    return sorted(str(file.relative_to(ROOT)) for file in (ROOT / "tests").rglob("test_*.py"))


def run_pytest(root, arguments, plugin, **options):
    """A finished process of pytest in a checkout."""
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join(filter(None, (str(root), os.environ.get("PYTHONPATH")))),
        "PYTHONDONTWRITEBYTECODE": "1",
        "OMP_NUM_THREADS": "1",
        "OPENBLAS_NUM_THREADS": "1",
        PLUGIN: json.dumps(plugin),
    }
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-p",
        "no:cacheprovider",
        "-p",
        "tests.mutations",
        *arguments,
    ]
    return subprocess.run(command, cwd=root, env=environment, capture_output=True, text=True, **options)


def make_map():
    """Record the lines of every test file that has changed since, or the library with it."""
    (CACHE / "lines").mkdir(parents=True, exist_ok=True)
    for test_file in test_files():
        lines = lines_of(test_file)
        if lines.with_suffix(".json").exists():
            continue
        start = time.perf_counter()
        run_pytest(ROOT, [test_file], {"lines": str(lines)})
        done = (
            json.loads(lines.with_suffix(".json").read_text()) if lines.with_suffix(".json").exists() else {}
        )
        print(f"{test_file}: {len(done)} tests passed, {time.perf_counter() - start:.0f} s", flush=True)


if __name__ == "__main__":
    make_map()
