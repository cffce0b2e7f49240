"""Parameter studies: a function at many points, on many processes or machines, with a folder of records.

The folder has a file a point (JSON), which is used again while function, point and all modules that its
process had loaded are the same.
"""

import json
import os
import pickle
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import BrokenExecutor, CancelledError, Executor, as_completed
from contextlib import contextmanager, nullcontext
from functools import cache, partial
from importlib import import_module
from itertools import product
from multiprocessing import get_context
from typing import Any
from unittest.mock import patch

import numpy as np
from tqdm import tqdm

from ..errors import (
    BadArgument,
    MissingExtra,
    NotConverged,
    made_folder,
    require,
    require_flag,
    require_kind,
    require_values,
    require_whole,
)
from ..model.progress import counted, counting
from .provenance import digest, loaded, made_of
from .records import write_text


def sweep(
    function: Callable[..., object],
    over: Mapping[str, Iterable] | Iterable[Mapping[str, object]],
    *,
    executor: Executor | None = None,
    workers: int | None = None,
    records: str | os.PathLike | None = None,
    quiet: bool = False,
) -> list[dict]:
    """Call ``function(**point)`` at each point, in parallel; a point that fails does not stop the others.

    Parameters
    ----------
    function : callable
        It returns a number, or a mapping of names to numbers, texts, None or lists of them.
    over : mapping or iterable of mappings
        Either {argument: values}, whose combinations are the points (the last argument varies fastest), or a
        list of points {argument: value}. Values are numbers, texts, lists, obstacles, laws, functions.
    executor : concurrent.futures.Executor, optional
        A Dask cluster's comes from ``Client(...).get_executor()``; its workers keep loaded modules. Without
        one, local processes of one thread each start; a script then needs ``if __name__ == "__main__":``
        around the call.
    workers : int, optional
        Number of local processes, by default one a core.
    records : str or path, optional
        A folder of records, a file a point, with which an interrupted sweep goes on. A point is computed
        again if it failed, and after a change of a loaded file of the user's or of microblock, of a package's
        version, or of the script, if that defines the function: in a module of its own the function outlives
        it.
    quiet : bool
        Whether to leave out the bar, else as that of `Contact.solve`, and the number of outdated records.

    Returns
    -------
    list of dict
        A row a point, in their order: {argument: value, ..., answer: value, ..., "seconds": float, "error":
        None or "type of error: message"}, all with the same columns.

    Raises
    ------
    BadArgument
        If an argument does not pickle or is defined in a notebook, or no folder can be there.
    NotConverged
        If the executor breaks down, or local processes do not start; what is done is recorded.
    MissingExtra
        If local processes lack the extra `study`.

    Examples
    --------
    >>> from concurrent.futures import ThreadPoolExecutor
    >>> def area(width, height):
    ...     return {"area": width*height}
    >>> rows = mb.sweep(area, {"width": (1, 2), "height": (3,)}, executor=ThreadPoolExecutor(), quiet=True)
    >>> [row["area"] for row in rows]
    [3, 6]
    """
    require(callable(function), "function", function, "must be a function")
    require_flag(quiet=quiet)
    points = _points(over)
    if executor is not None:
        require_kind(Executor, "a concurrent.futures.Executor", executor=executor)
        require(workers is None, "workers", workers, "belongs to local processes, not to an executor")
    if workers is not None:
        require_whole(1, workers=workers)
    keys = range(len(points)) if records is None else [digest(function, point) for point in points]
    folder = None if records is None else made_folder(records, "records")
    known = {} if folder is None else _known(folder, keys, quiet)
    missing = {key: point for key, point in zip(keys, points) if key not in known}
    with counting("sweep", False if quiet else None, total=len(missing)):
        for key, outcome in _outcomes(executor, workers, function, missing, folder is not None):
            known[key] = {"point": missing[key], **outcome}
            if folder is not None and not outcome["error"]:
                write_text(folder / f"{key}.json", json.dumps(known[key], default=str), "records")
            counted()
    return _rows(points, [known[key] for key in keys])


@contextmanager
def processes(workers: int | None = None) -> Iterator[Any]:
    """Context with a `pebble.ProcessPool` of fresh processes of one thread each, by default one a core.
    Raises MissingExtra without pebble or cloudpickle.
    """
    try:
        pools, _ = import_module("pebble"), import_module("cloudpickle")
    except ModuleNotFoundError as failure:
        raise MissingExtra("sweep()", str(failure.name), "study") from failure
    threads = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    spawn = get_context("spawn")  # forked ones share NGSolve's locks
    with patch.dict(os.environ, threads):  # for the processes, before they import numpy
        pool = pools.ProcessPool(workers or os.cpu_count() or 1, context=spawn)
        try:
            yield pool
        finally:
            pool.stop()
            pool.join()


def carried(pool, *call):
    """Schedules a call, also of a function of a notebook, which pickles of Python do not carry."""
    import cloudpickle

    return pool.schedule(_called, (cloudpickle.dumps(partial(*call)),))


def _called(call):
    return pickle.loads(call)()


def _points(over):
    if isinstance(over, Mapping):
        for name, values in over.items():
            listed = np.iterable(values) and not isinstance(values, (str, Mapping))
            require(listed, "over", {name: values}, "must give each argument a list of values")
        return [dict(zip(over, values)) for values in product(*over.values())]
    points = require_values(over=over)
    for point in points:
        require_kind(Mapping, "{argument: values} or a list of {argument: value}", over=point)
    return [dict(point) for point in points]


def _outcomes(executor, workers, function, points, recorded):
    if not points:
        return
    with processes(workers) if executor is None else nullcontext(executor) as pool:
        submit = partial(carried, pool) if executor is None else pool.submit
        waiting = {submit(_attempt, function, point, recorded): key for key, point in points.items()}
        try:
            for future in as_completed(waiting):
                yield waiting[future], _outcome(future)
        finally:  # an interruption, too
            for future in waiting:
                future.cancel()


def _attempt(function, point, recorded):
    """{answer, error, seconds, modules} of a point."""
    start = time.perf_counter()
    try:
        with counting("point", False):  # the sweep has a bar
            answer, error = _answer(function(**point), point), None
    except Exception as failure:  # whatever it is, the others go on
        answer, error = None, _told(failure)
    seconds, modules = time.perf_counter() - start, loaded() if recorded else None
    return {"answer": answer, "error": error, "seconds": seconds, "modules": modules}


def _answer(given, point):
    """An answer as JSON's types, or BadArgument."""
    given = given if isinstance(given, Mapping) else {"value": given}
    taken = {*point, "seconds", "error"} & given.keys()
    require(not taken, "answer", sorted(taken), "must be neither an argument nor 'seconds' nor 'error'")
    try:  # arrays and numbers of numpy as lists and numbers
        return json.loads(json.dumps(given, allow_nan=False, default=lambda value: value.tolist()))
    except (AttributeError, TypeError, ValueError) as failure:
        raise BadArgument(
            "answer", given, "must be a finite number, a text, None, or a list of them, or a mapping to such"
        ) from failure


def _outcome(future):
    try:
        return future.result()
    except (BrokenExecutor, CancelledError) as failure:
        words = (
            f"the processes broke down ({_told(failure)}); what is recorded is kept, call again. If "
            'none ever starts: a script needs `if __name__ == "__main__":` around the call'
        )
        raise NotConverged(words) from failure
    except Exception as failure:  # the process died over the point, or the point does not travel
        return {"answer": None, "error": _told(failure), "seconds": None, "modules": None}


def _told(failure):
    return f"{type(failure).__name__}: {' '.join(str(failure).split())}"


def _rows(points, found):
    rows = [point | (record["answer"] or {}) for point, record in zip(points, found)]
    columns = dict.fromkeys(name for row in rows for name in row)
    ends = ("seconds", "error")
    return [columns | row | {name: record[name] for name in ends} for row, record in zip(rows, found)]


def _known(folder, keys, quiet):
    """Returns {key: record} of what is in the folder and would be computed alike now."""
    files = {key: folder / f"{key}.json" for key in keys}
    records = {key: json.loads(file.read_text()) for key, file in files.items() if file.exists()}
    now = cache(made_of)
    known = {
        key: record
        for key, record in records.items()
        if all(now(name) == value for name, value in record["modules"].items())
    }
    if len(known) < len(records) and not quiet:
        tqdm.write(f"{folder}: {len(records) - len(known)} points of other code are computed anew")
    return known
