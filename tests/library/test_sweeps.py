"""Parameter studies: order, what is kept, what is not computed twice, points that fail, processes that
die.
"""

import json
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import pytest

import microblock as mb
from microblock.data.records import read_records, write_records

ROOT = Path(mb.__file__).parents[1]


def called(log, x, y=0.0, wait=0.0):
    """x + y, with each call noted in a file."""
    time.sleep(wait)
    with open(log, "a") as notes:
        notes.write(f"{x:g} {os.getpid()}\n")
    return {"sum": x + y, "pid": os.getpid(), "threads": os.environ.get("OPENBLAS_NUM_THREADS")}


def calls(log):
    return [float(line.split()[0]) for line in log.read_text().splitlines()] if log.exists() else []


def picky(x):
    if x == 1:
        raise mb.NotConverged("no luck at 1; try 2")
    if x == 2:
        raise ZeroDivisionError("x is 2")
    if x == 3:
        os._exit(7)
    return float("nan") if x == 4 else {"twice": 2 * x}


def pressed(obstacle, law, load):
    """A real state: half-width of the contact under an obstacle."""
    problem = mb.Contact(mb.HalfPlane(mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)), obstacle, law)
    return {"edge": max(right for _, right in problem.solve(load=load).zones["contact"])}


def test_local_processes_answer_in_order_one_thread_each(tmp_path):
    rows = mb.sweep(
        partial(called, str(tmp_path / "log")),
        {"x": (3.0, 1.0, 2.0), "y": (0.5, 10.0)},
        workers=2,
        quiet=True,
    )
    assert [(row["x"], row["y"]) for row in rows] == [(3, 0.5), (3, 10), (1, 0.5), (1, 10), (2, 0.5), (2, 10)]
    assert [row["sum"] for row in rows] == [3.5, 13, 1.5, 11, 2.5, 12] and all(
        row["error"] is None for row in rows
    )
    assert os.getpid() not in {row["pid"] for row in rows} and {row["threads"] for row in rows} == {"1"}


def test_a_second_run_computes_what_is_missing_and_no_more(tmp_path):
    log, file = tmp_path / "log", tmp_path / "study.jsonl"
    function = partial(called, str(log))
    with ThreadPoolExecutor(2) as threads:
        first = mb.sweep(function, {"x": (1.0, 2.0)}, executor=threads, records=file, quiet=True)
        both = mb.sweep(function, {"x": (3.0, 2.0, 1.0, 3.0)}, executor=threads, records=file, quiet=True)
    assert sorted(calls(log)) == [1, 2, 3] and len(file.read_text().splitlines()) == 3
    assert [row["sum"] for row in both] == [3, 2, 1, 3] and both[2] == first[0]


def test_other_code_or_arguments_are_computed_anew(tmp_path):
    log, file = tmp_path / "log", tmp_path / "study.jsonl"
    offset = 1.0

    def shifted(x):
        return called(str(log), x + offset)["sum"]

    with ThreadPoolExecutor(1) as thread:
        for offset in (1.0, 1.0, 2.0):  # noqa: B007, it counts what the function takes from around it
            rows = mb.sweep(in_a_script(shifted), {"x": (1.0,)}, executor=thread, records=file, quiet=True)
    assert calls(log) == [2, 3] and rows[0]["value"] == 3


def in_a_script(function):
    """The function as if a script or notebook had defined it."""
    function.__module__ = "__main__"
    return function


@pytest.mark.parametrize("torn", ['{"key": "abc", "poi', '{"k', "\0\0\0"])
def test_a_torn_last_line_is_dropped_and_computed_again(tmp_path, torn):
    log, file = tmp_path / "log", tmp_path / "study.jsonl"
    with ThreadPoolExecutor(1) as thread:
        study = partial(
            mb.sweep, partial(called, str(log)), {"x": (1.0, 2.0)}, executor=thread, records=file, quiet=True
        )
        first = study()
        lines = file.read_text().splitlines(keepends=True)
        file.write_text(lines[0] + torn)
        # of another call
        assert study() == [first[0], {**first[1], "seconds": pytest.approx(first[1]["seconds"], abs=1)}]
    assert calls(log) == [1, 2, 2] and [
        json.loads(line)["key"] for line in file.read_text().splitlines()
    ] == [json.loads(line)["key"] for line in lines]


@pytest.mark.parametrize("text", ["a,b\n1,2\n", "notes", '{"a": 1}\n'])
def test_a_file_of_another_kind_is_left_alone(tmp_path, text):
    (tmp_path / "notes").write_text(text)
    with pytest.raises(mb.BadArgument, match="no record of a sweep in line 1"):
        mb.sweep(picky, {"x": (5,)}, records=tmp_path / "notes", quiet=True)
    assert (tmp_path / "notes").read_text() == text


def test_failures_are_recorded_and_retried_only_if_asked(tmp_path):
    file = tmp_path / "study.jsonl"
    study = partial(mb.sweep, picky, {"x": (0, 1, 2, 3, 4, 5)}, workers=2, records=file, quiet=True)
    rows = study()
    errors = [row["error"] for row in rows]
    assert (
        errors[0] is errors[5] is None
        and [rows[0]["twice"], rows[5]["twice"]] == [0, 10]
        and rows[1]["twice"] is None
    )
    assert errors[1] == "NotConverged: no luck at 1; try 2" and errors[2].startswith("ZeroDivisionError")
    assert errors[3].startswith("ProcessExpired") and errors[4].startswith("BadArgument: answer value = nan")
    assert study() == rows and len(file.read_text().splitlines()) == 6
    assert [row["error"] for row in study(retry=True)] == errors and len(file.read_text().splitlines()) == 10
    write_records(tmp_path / "study.csv", rows)  # failed points too
    assert [row["x"] for row in read_records(tmp_path / "study.csv")] == [0, 1, 2, 3, 4, 5]


def test_obstacles_and_laws_are_arguments(tmp_path):
    over = {
        "obstacle": (mb.Cylinder(R=10), mb.Wedge(slope=0.02)),
        "law": (mb.Microblock(), mb.Unilateral()),
        "load": (1.0,),
    }
    with ThreadPoolExecutor(1) as thread:
        rows = mb.sweep(pressed, over, executor=thread, records=tmp_path / "r.jsonl", quiet=True)
        assert mb.sweep(pressed, over, executor=thread, records=tmp_path / "r.jsonl", quiet=True) == rows
    assert rows[0]["obstacle"] == "Cylinder(R=10)" and len({row["edge"] for row in rows}) == 4


def test_two_sweeps_do_not_share_a_file(tmp_path):
    def nested(x):
        with pytest.raises(mb.BadArgument, match="in use"):
            mb.sweep(picky, {"x": (5,)}, records=tmp_path / "r.jsonl", quiet=True)
        return x

    with ThreadPoolExecutor(1) as thread:
        (row,) = mb.sweep(nested, {"x": (1,)}, executor=thread, records=tmp_path / "r.jsonl", quiet=True)
    assert row["error"] is None


@pytest.mark.filterwarnings("ignore")  # the scheduler tells of the lost worker in many ways
def test_a_dask_cluster_may_lose_a_worker(tmp_path):
    distributed = pytest.importorskip("distributed", reason="a Dask cluster needs the extra `study`")
    log, file = tmp_path / "log", tmp_path / "r.jsonl"
    study = partial(
        mb.sweep,
        partial(called, str(log), wait=0.2),
        {"x": [float(x) for x in range(16)]},
        records=file,
        quiet=True,
    )
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
        ) as cluster,
        distributed.Client(cluster) as client,
        ThreadPoolExecutor(1) as aside,
    ):
        running = aside.submit(study, executor=client.get_executor())
        while len(calls(log)) < 4:
            assert not running.done(), running.result()
            time.sleep(0.02)
        first = log.read_text().split()[1]
        os.kill(int(first), signal.SIGKILL)
        rows = running.result(120)
    assert [row["sum"] for row in rows] == [float(x) for x in range(16)] and all(
        row["error"] is None for row in rows
    )
    assert len({row["pid"] for row in rows} - {int(first)}) >= 1
    kept = [json.loads(line)["point"]["x"] for line in file.read_text().splitlines()]
    assert sorted(kept) == [float(x) for x in range(16)]  # each once
    with ThreadPoolExecutor(1) as thread:  # and no other executor computes them again
        before = len(calls(log))
        assert study(executor=thread) == rows and len(calls(log)) == before


SCRIPT = """
import sys
from concurrent.futures import ThreadPoolExecutor
import microblock as mb
from test_sweeps import called, partial

if __name__ == "__main__":
    executor = ThreadPoolExecutor(1) if sys.argv[1] == "threads" else None
    mb.sweep(partial(called, "log", wait=0.3), {"x": [float(x) for x in range(20)]}, records="r.jsonl",
    executor=executor,
             workers=None if executor else 2)
"""


@pytest.mark.parametrize("how, executor", [(signal.SIGINT, "processes"), (signal.SIGKILL, "threads")])
def test_an_interruption_loses_nothing_and_leaves_a_valid_file(tmp_path, how, executor):
    (tmp_path / "study.py").write_text(SCRIPT)
    environment = {**os.environ, "PYTHONPATH": f"{ROOT}:{Path(__file__).parent}"}
    study = subprocess.Popen(
        [sys.executable, "study.py", executor], cwd=tmp_path, env=environment, stderr=subprocess.PIPE
    )
    while len(calls(tmp_path / "log")) < 3:
        assert study.poll() is None, study.stderr.read().decode()
        time.sleep(0.02)
    study.send_signal(how)
    assert study.wait(30) != 0
    study.stderr.close()
    kept = [json.loads(line) for line in (tmp_path / "r.jsonl").read_text().splitlines()]
    assert 2 <= len(kept) < 20 and all(record["error"] is None for record in kept)
    assert len(calls(tmp_path / "log")) - len(kept) <= 2  # those being computed
    again = subprocess.run(
        [sys.executable, "study.py", executor], cwd=tmp_path, env=environment, capture_output=True, text=True
    )
    assert again.returncode == 0, again.stderr
    after = [json.loads(line) for line in (tmp_path / "r.jsonl").read_text().splitlines()]
    assert after[: len(kept)] == kept and sorted(record["point"]["x"] for record in after) == [
        float(x) for x in range(20)
    ]


NOTEBOOK = """
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
import microblock as mb

@dataclass(frozen=True)
class Wall:
    height: float
    kind: str = "plain wall"

    def area(self, width):
        return self.height*width

@cache
def factor(kind):
    return {FACTOR} if kind in {"plain wall", "brick", "stone", "clay", "glass", "steel", "wood"} else 0

def area(wall, width):
    import helper
    print("called")
    return helper.rounded(factor(wall.kind)*wall.area(width) + Wall(1.0).area(width))

with ThreadPoolExecutor(1) as thread:
    row, = mb.sweep(area, [{"wall": Wall(2.0), "width": 3}], records="r.jsonl", executor=thread, quiet=True)
print(row["value"])
"""


def test_a_script_of_its_own_classes_and_helpers_is_computed_anew_when_any_of_them_changes(tmp_path):
    def runs(factor, digits, number):
        """The script as a notebook runs it: under another name of its file each time."""
        (tmp_path / "helper.py").write_text(
            "from digits import DIGITS\n\n\ndef rounded(x):\n    return round(x, DIGITS)\n"
        )
        (tmp_path / "digits.py").write_text(f"DIGITS = {digits}\n")
        code = f"exec(compile({NOTEBOOK.replace('{FACTOR}', factor)!r}, 'cell {number}', 'exec'))"
        environment = {**os.environ, "PYTHONPATH": f"{ROOT}:{tmp_path}", "PYTHONHASHSEED": str(number)}
        done = subprocess.run(
            [sys.executable, "-c", code], cwd=tmp_path, env=environment, capture_output=True, text=True
        )
        assert done.returncode == 0, done.stderr
        return done.stdout.split()

    assert runs("1", 1, 1) == ["called", "9.0"] and runs("1", 1, 2) == ["9.0"]
    assert runs("2", 1, 3) == ["called", "15.0"]  # a cached helper, which pickles by name
    # what a helper imports
    assert runs("1/7", 1, 4) == ["called", "3.9"] and runs("1/7", 2, 5) == ["called", "3.86"]
    assert runs("1/7", 2, 6) == ["3.86"]


def test_a_torn_first_line_is_dropped(tmp_path):
    with ThreadPoolExecutor(1) as thread:
        (tmp_path / "r.jsonl").write_text('{"key": "abc", "po')
        assert (
            mb.sweep(
                called,
                {"log": [str(tmp_path / "log")], "x": (1.0,)},
                executor=thread,
                records=tmp_path / "r.jsonl",
                quiet=True,
            )[0]["sum"]
            == 1
        )
    assert len((tmp_path / "r.jsonl").read_text().splitlines()) == 1


@pytest.mark.parametrize("missing, options", [("pebble", {"workers": 1}), ("cloudpickle", {"workers": 1})])
def test_without_the_library_of_processes_the_extra_is_named(monkeypatch, missing, options):
    monkeypatch.setitem(sys.modules, missing, None)  # as if it were not installed
    with pytest.raises(mb.MissingExtra, match=f"{missing}.*study"):
        mb.sweep(picky, {"x": (5,)}, quiet=True, **options)


def test_an_answer_named_like_an_argument_is_an_error_of_its_point():
    with ThreadPoolExecutor(1) as thread:
        (row,) = mb.sweep(lambda x: {"x": 1.0}, {"x": (5,)}, executor=thread, quiet=True)
        assert row["error"].startswith("BadArgument: answer = 'x'")
