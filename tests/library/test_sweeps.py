"""Parameter studies: order, what is kept, what is computed anew, points that fail, processes that die."""

import json
import os
import pickle
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import pytest

import microblock as mb
from microblock.data.provenance import digest, loaded, made_of
from microblock.data.records import read_records, write_records

ROOT = Path(mb.__file__).parents[1]
THREAD = ThreadPoolExecutor(1)


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
    return {4: float("nan"), 6: {"x": 1.0}}.get(x, {"twice": 2 * x})


def test_processes_answer_in_order_with_one_thread_each(tmp_path):
    over = {"x": (3.0, 1.0, 2.0), "y": (0.5, 10.0)}
    start = time.monotonic()
    rows = mb.sweep(partial(called, str(tmp_path / "log")), over, workers=2, quiet=True)
    assert all(0 < row["seconds"] <= time.monotonic() - start for row in rows)
    assert [(row["x"], row["y"]) for row in rows] == [(3, 0.5), (3, 10), (1, 0.5), (1, 10), (2, 0.5), (2, 10)]
    assert [row["sum"] for row in rows] == [3.5, 13, 1.5, 11, 2.5, 12] and not any(
        row["error"] for row in rows
    )
    assert os.getpid() not in {row["pid"] for row in rows} and {row["threads"] for row in rows} == {"1"}


def test_a_second_run_computes_what_is_missing_and_no_more(tmp_path):
    log, folder = tmp_path / "log", tmp_path / "study"
    study = partial(mb.sweep, partial(called, str(log)), executor=THREAD, records=folder, quiet=True)
    first = study({"x": (1.0, 2.0)})
    second = study({"x": (3.0, 2.0, 1.0, 3.0)})
    assert calls(log) == [1, 2, 3] and second[2] == first[0]
    assert [row["sum"] for row in second] == [3, 2, 1, 3] and len([*folder.iterdir()]) == 3


def test_failures_do_not_stop_the_others_and_are_computed_again(tmp_path):
    folder, points = tmp_path / "study", tuple(range(7))
    study = partial(mb.sweep, picky, {"x": points}, workers=2, records=folder, quiet=True)
    rows = study()
    words = [row["error"] and row["error"].split(":")[0] for row in rows]
    failed = ["NotConverged", "ZeroDivisionError", "ProcessExpired", "BadArgument"]
    assert words == [None, *failed, None, "BadArgument"] and [rows[0]["twice"], rows[5]["twice"]] == [0, 10]
    assert len([*folder.iterdir()]) == 2
    again = study()
    assert [row["error"] for row in again] == [row["error"] for row in rows]
    anew = [repeated["seconds"] != before["seconds"] for repeated, before in zip(again, rows)]
    assert anew == [bool(row["error"] and row["seconds"]) for row in rows]
    write_records(tmp_path / "study.csv", rows)  # failed points too
    assert [row["x"] for row in read_records(tmp_path / "study.csv")] == [*points]


SCRIPT = """
import sys
from concurrent.futures import ThreadPoolExecutor
import microblock as mb
from test_sweeps import called, partial

if __name__ == "__main__":
    more = {"executor": ThreadPoolExecutor(1)} if sys.argv[1] == "threads" else {"workers": 2}
    points = {"x": [float(x) for x in range(12)]}
    mb.sweep(partial(called, "log", wait=0.15), points, records="r", **more)
"""


@pytest.mark.parametrize("how, executor", [(signal.SIGINT, "processes"), (signal.SIGKILL, "threads")])
def test_an_interruption_loses_nothing_and_leaves_a_valid_file(tmp_path, how, executor):
    (tmp_path / "study.py").write_text(SCRIPT)
    options = {"cwd": tmp_path, "env": {**os.environ, "PYTHONPATH": f"{ROOT}:{Path(__file__).parent}"}}
    command = [sys.executable, "study.py", executor]
    log = tmp_path / "log"
    folder = tmp_path / "r"
    study = subprocess.Popen(command, stderr=subprocess.DEVNULL, **options)
    while len(calls(log)) < 4:  # two processes: two have returned
        assert study.poll() is None
        time.sleep(0.02)
    study.send_signal(how)
    assert study.wait(30) != 0
    records = {file: file.read_text() for file in folder.glob("*.json")}
    assert 2 <= len(records) < 12 and len(calls(log)) - len(records) <= 2  # those being computed
    subprocess.run(command, check=True, capture_output=True, **options)
    after = {file: file.read_text() for file in folder.glob("*.json")}
    assert records.items() <= after.items()
    assert sorted(json.loads(record)["point"]["x"] for record in after.values()) == [*range(12)]


# what makes a point another one


STUDY = """
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
import microblock as mb

@dataclass(frozen=True)
class Wall:
    height: float

@cache
def factor(kind):
    return {FACTOR}

def area(wall, width):
    import helper
    print("called")
    return helper.rounded(factor("wall")*wall.height*width)

with ThreadPoolExecutor(1) as thread:
    row, = mb.sweep(area, [{"wall": Wall(3.0), "width": 3}], records="r", executor=thread, quiet=True)
print(row["value"])
"""


def test_a_script_is_computed_anew_when_any_of_what_it_uses_changes(tmp_path):
    """Its own classes, a cached helper, and what a helper imports; without a file it is refused."""
    (tmp_path / "helper.py").write_text(
        "from digits import DIGITS\n\ndef rounded(x):\n    return round(x, DIGITS)\n"
    )
    printed = []
    for number, (factor, digits) in enumerate((("1", 1), ("1", 1), ("1/7", 1), ("1/7", 2), ("1/7", 2))):
        (tmp_path / "digits.py").write_text(f"DIGITS = {digits}\n")
        (tmp_path / "study.py").write_text(STUDY.replace("{FACTOR}", factor))
        environment = {**os.environ, "PYTHONPATH": f"{ROOT}:{tmp_path}", "PYTHONHASHSEED": str(number)}
        # Python takes a module of the same second and length for the same
        environment["PYTHONDONTWRITEBYTECODE"] = "1"
        options = {"cwd": tmp_path, "env": environment, "capture_output": True, "text": True}
        printed.append(subprocess.run([sys.executable, "study.py"], check=True, **options).stdout.split())
    assert printed == [["called", "9.0"], ["9.0"], ["called", "1.3"], ["called", "1.29"], ["1.29"]]
    typed = subprocess.run([sys.executable, "-c", STUDY.replace("{FACTOR}", "1")], **options)
    assert "is defined in a notebook" in typed.stderr and not typed.stdout


def test_processes_find_what_threads_have_computed(tmp_path, capsys):
    """Records of other code are computed anew, and a line says so; a file of records is no folder."""
    log, folder = tmp_path / "log", tmp_path / "study"
    study = partial(mb.sweep, partial(called, str(log)), {"x": (1.0, 2.0)}, records=folder)
    assert study(executor=THREAD, quiet=True) == study(workers=1) and calls(log) == [1, 2]
    record = min(folder.iterdir())
    record.write_text(record.read_text().replace('"modules": {', '"modules": {"gone": "other", '))
    assert len(study(executor=THREAD)) == 2 and len(calls(log)) == 3
    assert "1 points of other code" in capsys.readouterr().out
    with pytest.raises(mb.BadArgument, match="folder"):
        study(executor=THREAD, records=record)
    word, equal = "steel", "".join(("st", "eel"))  # two objects
    assert digest(called, {"a": word, "b": word}) == digest(called, {"a": word, "b": equal})


def test_records_depend_on_packages_and_not_on_modules_of_python():
    names = loaded()
    assert {"numpy", "microblock"} <= names.keys() and not {"json", "os", "sys"} & names.keys()


def test_code_is_told_by_its_files_and_packages_by_their_versions(tmp_path, monkeypatch):
    """Equal code in another folder is the same, another line is not."""
    assert made_of("pytest") == [pytest.__version__]
    digests = []
    for folder, line in (("one", "x = 1"), ("other", "x = 1"), ("changed", "x = 2")):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "studied_here.py").write_text(line + "\n")
        with monkeypatch.context() as patch:
            patch.syspath_prepend(tmp_path / folder)
            digests.append(made_of("studied_here"))
    assert digests[0] == digests[1] != digests[2] and digests[0] is not None


def test_rows_are_drawn_a_curve_for_each_value_of_other_arguments(tmp_path):
    def ratio(a, b):
        return a / b  # fails at b = 0

    rows = mb.sweep(ratio, {"a": (2, 1), "b": (0, 2, 4)}, executor=ThreadPoolExecutor(), quiet=True)
    axis = rows.plot("a", "value", tmp_path / "rows.png").axes[0]
    curves = {line.get_label(): line.get_xydata().tolist() for line in axis.lines}
    assert curves == {"b = 2": [[1, 0.5], [2, 1.0]], "b = 4": [[1, 0.25], [2, 0.5]]}
    assert "2 of 6 points" in axis.figure.get_suptitle() and (tmp_path / "rows.png").exists()
    with pytest.raises(mb.BadArgument, match="y = 'c': must be"):
        rows.plot("a", "c")
    with pytest.raises(mb.BadArgument, match="no number"):
        rows.plot("a", "error")
    assert pickle.loads(pickle.dumps(rows)).arguments == ("a", "b")


def test_slices_and_sums_of_rows_are_drawn():
    def power(a, b=2):
        return a**b

    executor = ThreadPoolExecutor()
    squares = mb.sweep(power, {"a": (1, 2, 3)}, executor=executor, quiet=True)
    cubes = mb.sweep(power, {"a": (1, 2), "b": (3,)}, executor=executor, quiet=True)
    (line,) = squares[1:].plot("a", "value").axes[0].lines
    assert line.get_xydata().tolist() == [[2, 4], [3, 9]] and squares[0]["value"] == 1
    both = squares[:2] + cubes  # squares have no b
    curves = {line.get_label(): line.get_xydata().tolist() for line in both.plot("a", "value").axes[0].lines}
    assert curves == {"b = None": [[1, 1], [2, 4]], "b = 3": [[1, 1], [2, 8]]}
