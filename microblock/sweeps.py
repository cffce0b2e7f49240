"""Parameter studies: a function at many points, on many processes or machines, kept point by point in a file.

The file has a line a point (JSON), written and forced to the disk as soon as the point is known, so that what stops a
study (an interruption, a power cut) costs the points that were being computed and no other. A line is used again where
its key agrees: the digest of the function, the point and the versions (`microblock.provenance`).
"""

import fcntl
import json
import os
import platform
import time
from collections.abc import Mapping
from concurrent.futures import BrokenExecutor, CancelledError, as_completed
from contextlib import contextmanager
from itertools import product
from multiprocessing import get_context
from numbers import Real

import cloudpickle
import numpy as np
from pebble import ProcessPool
from tqdm import tqdm

from . import provenance
from .errors import BadArgument, NotConverged, require_values, require_whole

OWN = ("seconds", "error")      # columns that each row has besides the point's and the answer's
PINNED = {f"{library}_NUM_THREADS": "1" for library in ("OPENBLAS", "OMP", "MKL")}


def sweep(function, over, *, executor=None, workers=None, records=None, retry=False, quiet=False):
    """Call ``function(**point)`` at each point, in parallel; a row a point, in their order.

    A point that fails does not stop the others. After KeyboardInterrupt, or whatever else stops the sweep, a call with
    the same file goes on where it stopped.

    Parameters
    ----------
    function : callable that returns a number, or a mapping of names to numbers, texts, None or lists of them
    over : {argument: values}, whose every combination is a point (the last argument varies fastest), or a list of points
        {argument: value}; values are numbers, texts, lists, obstacles, laws and other dataclasses, functions
    executor : any `concurrent.futures.Executor`, a Dask cluster's by ``Client(...).get_executor()``; without one local
        processes of one thread each, in which also functions of a notebook run; a script that is no module needs the
        usual ``if __name__ == "__main__":`` around the call
    workers : number of local processes; without it one a core
    records : path of the file of records; one sweep at a time writes to it
    retry : compute again what is recorded as failed
    quiet : no progress bar

    Returns
    -------
    list of {argument: value, ..., answer: value, ..., "seconds": float, "error": None or "type of error: message"};
    all rows have the same columns, so that `study.write_records` makes a CSV of them

    Raises
    ------
    BadArgument
        Also for records of another kind, or in use.
    NotConverged
        If the executor breaks down, or local processes do not start; what is done by then is kept.

    Examples
    --------
    >>> from concurrent.futures import ThreadPoolExecutor
    >>> def area(width, height):
    ...     return {"area": width*height}
    >>> rows = mb.sweep(area, {"width": (1, 2), "height": (3,)}, executor=ThreadPoolExecutor(), quiet=True)
    >>> [row["area"] for row in rows]
    [3, 6]
    """
    points = _points(over)
    if executor is not None and workers is not None:
        raise BadArgument("workers", workers, "belongs to local processes, not to an executor")
    if workers is not None:
        require_whole(1, workers=workers)
    with _opened(records) as file:
        keys = _keys(function, points) if file else range(len(points))
        known = {key: file.found[key] for key in keys if file and key in file.found and not (retry and file.found[key]["error"])}
        missing = {key: point for key, point in zip(keys, points) if key not in known}
        with tqdm(total=len(known) + len(missing), initial=len(known), disable=quiet, unit="point") as progress:
            def keep(key, found):
                known[key] = {"key": key, "point": _shown(missing[key]), **found}
                if file:
                    file.append(known[key])
                progress.update()

            _compute(function, missing, executor, workers, keep)
    return _rows(points, [known[key] for key in keys])


def _keys(function, points):
    base = provenance.digest(function, provenance.software())
    return [provenance.digest(base, point) for point in points]


def _points(over):
    """Points {argument: value} of a grid or a list."""
    if isinstance(over, Mapping):
        for name, values in over.items():
            if isinstance(values, (str, Mapping)) or not np.iterable(values):
                raise BadArgument("over", {name: values}, "must give each argument a list of values")
        return [dict(zip(over, values)) for values in product(*over.values())]
    points, = require_values(over=over)
    for point in points:
        if not isinstance(point, Mapping):
            raise BadArgument("over", point, "must be {argument: values}, or a list of points {argument: value}")
    return [dict(point) for point in points]


def _compute(function, points, executor, workers, keep):
    """Call keep(key, outcome) for points {key: point} as they come; when interrupted, for what has come by then."""
    if not points:
        return
    with _submitter(executor, workers) as submit:
        keys = {submit(function, point): key for key, point in points.items()}
        waiting = dict(keys)
        try:
            for future in as_completed(keys):
                keep(keys[future], _outcome(future))
                del waiting[future]
        except BaseException:
            for future, key in waiting.items():
                if not future.cancel() and future.done() and not future.exception():
                    keep(key, future.result())
            raise


@contextmanager
def processes(workers=None):
    """A pool of local processes (pebble), fresh ones of one thread each, one a core without `workers`; left, it stops them."""
    before = {name: os.environ.get(name) for name in PINNED}
    os.environ.update(PINNED)      # for the processes, before they import numpy
    pool = ProcessPool(workers or os.cpu_count(), context=get_context("spawn"))      # forked ones share NGSolve's locks
    try:
        yield pool
    finally:
        pool.stop()
        pool.join()
        for name, value in before.items():
            os.environ.pop(name, None) if value is None else os.environ.update({name: value})


@contextmanager
def _submitter(executor, workers):
    """submit(function, point) -> Future, on an executor or on local processes."""
    if executor is not None:
        yield lambda function, point: executor.submit(attempt, function, point)
        return
    with processes(workers) as pool:
        yield lambda function, point: pool.schedule(_unpacked, (cloudpickle.dumps((function, point)),))


def _unpacked(pickled):
    return attempt(*cloudpickle.loads(pickled))


def attempt(function, point):
    """{answer, error, seconds, machine} of one point, whatever becomes of it."""
    start = time.perf_counter()
    try:
        answer, error = _answer(function(**point), point), None
    except Exception as failure:      # whatever it is, the others go on
        answer, error = None, _told(failure)
    return {"answer": answer, "error": error, "seconds": time.perf_counter() - start, "machine": platform.node()}


def _answer(given, point):
    """What a function returned as JSON's types; BadArgument for what could not be kept."""
    answer = {name: _plain(name, value) for name, value in (given if isinstance(given, Mapping) else {"value": given}).items()}
    for name in answer:
        if not isinstance(name, str) or name in point or name in OWN:
            raise BadArgument("answer", name, "must be a text that is neither an argument nor " + " nor ".join(OWN))
    return answer


def _plain(name, value):
    value = value.tolist() if isinstance(value, (np.ndarray, np.generic)) else value
    if isinstance(value, (list, tuple)):
        return [_plain(name, one) for one in value]
    if value is None or isinstance(value, (str, bool)) or isinstance(value, Real) and abs(value) < float("inf"):
        return value
    raise BadArgument(f"answer {name}", value, "must be a finite number, a text, None, or a list of them")


def _outcome(future):
    """What a future has, or what became of it."""
    try:
        return future.result()
    except (BrokenExecutor, CancelledError) as failure:
        raise NotConverged(f"the processes broke down ({_told(failure)}); what is recorded is kept, call again. If none ever "
                           'starts: a script needs `if __name__ == "__main__":` around the call') from failure
    except Exception as failure:      # the process died over the point, or the point does not travel
        return {"answer": None, "error": _told(failure), "seconds": None, "machine": None}


def _told(failure):
    return f"{type(failure).__name__}: {' '.join(str(failure).split())}"


def _shown(point):
    """A point as JSON's types; objects by their text."""
    return {name: _scalar(value) for name, value in point.items()}


def _scalar(value):
    value = value.item() if isinstance(value, np.generic) else value
    return value if value is None or isinstance(value, (str, bool, int, float)) else repr(value)


def _rows(points, found):
    names = dict.fromkeys(name for one in found for name in one["answer"] or ())
    arguments = dict.fromkeys(name for point in points for name in point)
    return [{**{name: one["point"].get(name) for name in arguments}, **{name: (one["answer"] or {}).get(name) for name in names},
             **{name: one[name] for name in OWN}} for one in found]


@contextmanager
def _opened(path):
    """The file of records, locked, or None."""
    if path is None:
        yield None
        return
    try:
        file = open(path, "a+b", buffering=0)
    except OSError as failure:
        raise BadArgument("records", str(path), f"cannot be written to ({failure.strerror})") from failure
    with file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as failure:
            raise BadArgument("records", str(path), "is in use by another sweep") from failure
        yield _Records(path, file)


class _Records:
    """Lines of a file of records {key: record}; a last one that is torn is cut off."""

    def __init__(self, path, file):
        self.file, self.found, self.end, self.written = file, {}, 0, set()
        file.seek(0)
        for number, line in enumerate(file.read().splitlines(keepends=True)):
            record = _record(line)
            if record is None:
                if _torn(line):
                    break
                raise BadArgument("records", str(path), f"has no record of a sweep in line {number + 1}")
            self.found[record["key"]] = record
            self.end += len(line)

    def append(self, record):
        """Write a record once, over whatever an interruption left of one."""
        line = json.dumps({**record, "versions": provenance.software()}, allow_nan=False).encode() + b"\n"
        if record["key"] in self.written:
            return
        self.file.truncate(self.end)
        if self.file.write(line) != len(line):
            raise OSError(f"no room for a record in {self.file.name}")
        os.fsync(self.file.fileno())
        self.end += len(line)
        self.written.add(record["key"])


def _record(line):
    """A line as a record, or None if it is none."""
    try:
        record = json.loads(line) if line.endswith(b"\n") else None
    except ValueError:
        return None
    return record if isinstance(record, dict) and {"key", "point", "answer", *OWN} <= set(record) else None


def _torn(line):
    """Whether a line is the beginning of a record, or what a power cut leaves of one."""
    head = b'{"key": "'
    return not line.endswith(b"\n") and (line[:len(head)] == head[:len(line)] or not line.strip(b"\0"))
