"""Parameter studies: a function at many points, on many processes or machines, with a folder of records.

The folder has a file a point (JSON), which is used again while function, point and all modules that its
process had loaded are the same.
"""

from __future__ import annotations

import json
import math
import os
import pickle
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future, as_completed
from contextlib import contextmanager, nullcontext
from functools import cache, partial
from importlib import import_module
from itertools import chain, product
from multiprocessing import get_context
from numbers import Real
from pathlib import Path
from typing import Any, SupportsIndex, TypeAlias, overload
from unittest.mock import patch

import numpy as np
from tqdm import tqdm

from ..errors import (
    BadArgument,
    MissingExtra,
    NotConverged,
    made_folder,
    require,
    require_choice,
    require_flag,
    require_kind,
    require_values,
    require_whole,
)
from ..model.progress import counted, counting
from ..model.results import saved
from ..model.types import Axes, Figure, Target
from ..model.views import pictures
from .provenance import digest, loaded, made_of
from .records import write_text

Key: TypeAlias = int | str  # the place of a point, or the digest of its call
Point: TypeAlias = dict[str, Any]
Record: TypeAlias = dict[str, Any]  # answer, error, seconds, modules, and the point


class Rows(list[dict[str, Any]]):
    """The rows of a sweep, a dict a point. A slice, and a sum with the rows of another sweep, are `Rows` too.

    Attributes
    ----------
    arguments : tuple of str
        Columns that are arguments of the function.
    """

    def __init__(self, rows: Iterable[dict[str, Any]], arguments: Iterable[str]) -> None:
        super().__init__(rows)
        self.arguments = tuple(arguments)

    @overload
    def __getitem__(self, key: SupportsIndex, /) -> dict[str, Any]: ...

    @overload
    def __getitem__(self, key: slice, /) -> Rows: ...

    def __getitem__(self, key: SupportsIndex | slice, /) -> Any:
        part: Any = super().__getitem__(key)
        return Rows(part, self.arguments) if isinstance(key, slice) else part

    def __add__(self, others: list[Any], /) -> Any:
        added = others.arguments if isinstance(others, Rows) else ()
        return Rows(super().__add__(others), dict.fromkeys((*self.arguments, *added)))

    def plot(self, x: str, y: str, file: Target = None, ax: Axes | None = None) -> Figure:
        """Returns a figure of a column over another one, a curve for each value of the other arguments.

        Parameters
        ----------
        x, y : str
            Names of columns; rows of failed points, or without a finite number in both, are left out.
        file : str or Path, optional
            File of the figure (PNG, PDF or SVG, by its ending).
        ax : matplotlib.axes.Axes, optional
            Where to draw, for a scale or labels of your own.

        Raises
        ------
        BadArgument
            If there is no such column, or no row with numbers in both.
        """
        for name, column in (("x", x), ("y", y)):
            require_choice(tuple(dict.fromkeys(chain.from_iterable(self))), **{name: column})
        shown = [row for row in self if _is_number(row.get(x)) and _is_number(row.get(y))]
        require(bool(shown), "y", y, f"has no number in a row with one of {x}")
        others = [name for name in self.arguments if name not in (x, y)]
        left_out = len(self) - len(shown)
        warnings = [f"{left_out} of {len(self)} points have no numbers to draw"] if left_out else []
        return saved(pictures().draw_rows(shown, x, y, others, ax), file, ax, warnings)


def _is_number(value: object) -> bool:
    """Returns whether a value is a finite number."""
    return isinstance(value, Real) and not isinstance(value, bool) and math.isfinite(value)


def sweep(
    function: Callable[..., object],
    over: Mapping[str, Iterable[object]] | Iterable[Mapping[str, object]],
    *,
    executor: Executor | None = None,
    workers: int | None = None,
    records: str | os.PathLike[str] | None = None,
    quiet: bool = False,
) -> Rows:
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
    Rows
        A list with a dict a point, in their order: {argument: value, ..., answer: value, ..., "seconds":
        float, "error": None or "type of error: message"}, all with the same columns; its `plot` draws an
        answer over an argument.

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
    folder = None
    keys: Sequence[Key] = range(len(points))
    records_of: dict[Key, Record] = {}
    if records is not None:
        keys = [digest(function, point) for point in points]
        folder = made_folder(records, "records")
        records_of = _recorded(folder, keys, quiet)
    missing = {key: point for key, point in zip(keys, points) if key not in records_of}
    with counting("sweep", False if quiet else None, total=len(missing)):
        for key, outcome in _outcomes(executor, workers, function, missing, folder is not None):
            record = {"point": missing[key], **outcome}
            records_of[key] = record
            if folder is not None and not outcome["error"]:
                write_text(folder / f"{key}.json", json.dumps(record, default=str), "records")
            counted()
    return _rows(points, [records_of[key] for key in keys])


@contextmanager
def processes(workers: int | None = None) -> Iterator[Any]:
    """Context with a `pebble.ProcessPool` of fresh processes of one thread each, by default one a core.
    Raises MissingExtra without pebble or cloudpickle.
    """
    try:
        pebble = import_module("pebble")
        import_module("cloudpickle")
    except ModuleNotFoundError as failure:
        raise MissingExtra("sweep()", str(failure.name), "study") from failure
    threads = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    spawn = get_context("spawn")  # forked ones share NGSolve's locks
    with patch.dict(os.environ, threads):  # for the processes, before they import numpy
        pool = pebble.ProcessPool(workers or os.cpu_count() or 1, context=spawn)
        try:
            yield pool
        finally:
            pool.stop()
            pool.join()


def _schedule(pool: Any, function: Callable[..., object], *arguments: object) -> Future[Any]:
    """Returns the future of a call on a pool of `processes`, also of a function of a notebook, which pickles
    of Python do not carry.
    """
    import cloudpickle

    return pool.schedule(_called, (cloudpickle.dumps(partial(function, *arguments)),))


def _called(call: bytes) -> Any:
    return pickle.loads(call)()


def _points(over: Mapping[str, Iterable[object]] | Iterable[Mapping[str, object]]) -> list[Point]:
    """Returns the points of a study; raises BadArgument if there are none such."""
    if isinstance(over, Mapping):
        for name, values in over.items():
            listed = np.iterable(values) and not isinstance(values, (str, Mapping))
            require(listed, "over", {name: values}, "must give each argument a list of values")
        return [dict(zip(over, values)) for values in product(*over.values())]
    points = require_values(over=over)
    for point in points:
        require_kind(Mapping, "{argument: values} or a list of {argument: value}", over=point)
    return [dict(point) for point in points]


def _outcomes(
    executor: Executor | None,
    workers: int | None,
    function: Callable[..., object],
    points: Mapping[Key, Point],
    recorded: bool,
) -> Iterator[tuple[Key, Record]]:
    """Yields the key and the outcome of each point, as they are done."""
    if not points:
        return
    pools: Any = nullcontext(executor)
    if executor is None:
        pools = processes(workers)
    with pools as pool:
        submit: Any = partial(_schedule, pool)
        if executor is not None:
            submit = executor.submit
        keys = {submit(_attempt, function, point, recorded): key for key, point in points.items()}
        try:
            for future in as_completed(keys):
                yield keys[future], _outcome(future)
        finally:  # an interruption, too
            for future in keys:
                future.cancel()


def _attempt(function: Callable[..., object], point: Point, recorded: bool) -> Record:
    """Returns {answer, error, seconds, modules} of a point."""
    start = time.perf_counter()
    answer = None
    error = None
    try:
        with counting("point", False):  # the sweep has a bar
            answer = _answer(function(**point), point)
    except Exception as failure:  # whatever it is, the others go on
        error = _text(failure)
    seconds = time.perf_counter() - start
    modules = None
    if recorded:
        modules = loaded()
    return {"answer": answer, "error": error, "seconds": seconds, "modules": modules}


def _answer(returned: object, point: Point) -> Any:
    """Returns an answer as JSON's types; raises BadArgument if it has others."""
    answer: Any = returned
    if not isinstance(returned, Mapping):
        answer = {"value": returned}
    taken = {*point, "seconds", "error"} & answer.keys()
    require(not taken, "answer", sorted(taken), "must be neither an argument nor 'seconds' nor 'error'")
    try:  # arrays and numbers of numpy as lists and numbers
        return json.loads(json.dumps(answer, allow_nan=False, default=lambda value: value.tolist()))
    except (AttributeError, TypeError, ValueError) as failure:
        raise BadArgument(
            "answer", answer, "must be a finite number, a text, None, or a list of them, or a mapping to such"
        ) from failure


def _outcome(future: Future[Any]) -> Record:
    """Returns the outcome of a point; raises NotConverged if the processes broke down."""
    try:
        return future.result()
    except (BrokenExecutor, CancelledError) as failure:
        words = (
            f"the processes broke down ({_text(failure)}); what is recorded is kept, call again. If "
            'none ever starts: a script needs `if __name__ == "__main__":` around the call'
        )
        raise NotConverged(words) from failure
    except Exception as failure:  # the process died over the point, or the point does not travel
        return {"answer": None, "error": _text(failure), "seconds": None, "modules": None}


def _text(failure: BaseException) -> str:
    """Returns the type and the message of an error on one line."""
    return f"{type(failure).__name__}: {' '.join(str(failure).split())}"


def _rows(points: Sequence[Point], records: Sequence[Record]) -> Rows:
    """Returns a row a point, all with the columns of all."""
    rows = [point | (record["answer"] or {}) for point, record in zip(points, records)]
    columns: dict[str, Any] = dict.fromkeys(name for row in rows for name in row)
    complete = [
        columns | row | {"seconds": record["seconds"], "error": record["error"]}
        for row, record in zip(rows, records)
    ]
    return Rows(complete, dict.fromkeys(name for point in points for name in point))


def _recorded(folder: Path, keys: Sequence[Key], quiet: bool) -> dict[Key, Record]:
    """Returns {key: record} of what is in the folder and would be computed alike now."""
    files = {key: folder / f"{key}.json" for key in keys}
    records = {key: json.loads(file.read_text()) for key, file in files.items() if file.exists()}
    made_now = cache(made_of)
    valid = {
        key: record
        for key, record in records.items()
        if all(made_now(name) == origin for name, origin in record["modules"].items())
    }
    if len(valid) < len(records) and not quiet:
        tqdm.write(f"{folder}: {len(records) - len(valid)} points of other code are computed anew")
    return valid
