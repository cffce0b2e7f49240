"""BLAS threads: one while the library works on small problems, those that were there for large matrices.

From the outermost `bounded` entry on, BLAS (also NGSolve's own) and OpenMP have one thread; what was there
before is given back afterwards, and inside to what runs `with_outer_threads`. BLAS has one number of threads
for the whole process, so that entries of all Python threads are counted together.
"""

import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from functools import lru_cache
from typing import Any, TypeVar

from threadpoolctl import ThreadpoolController

Decorated = TypeVar("Decorated", bound=Callable[..., Any])

_lock = threading.Lock()
_inside = _large = 0  # entries, and those of them on large matrices
_before: dict[str, tuple[Any, int]] = {}  # libraries that have one thread, and what they had, by file


@lru_cache(maxsize=1)
def _libraries(modules: int) -> list[Any]:
    """Libraries, by the number of modules: they come by imports, and looking for them takes a millisecond."""
    return list(ThreadpoolController().lib_controllers)


def _set(library: Any, number: int) -> None:
    """Sets a library's threads from any Python thread: threadpoolctl leaves OpenBLAS to the first."""
    free = getattr(library, "clear_controlling_thread", lambda force: None)
    free(force=True)
    library.set_num_threads(number)
    free(force=True)


def _change(inside: int, large: int) -> None:
    global _inside, _large
    with _lock:
        _inside += inside
        _large += large
        if _inside and not _large:
            for library in _libraries(len(sys.modules)):
                if library.filepath not in _before:
                    _before[library.filepath] = library, library.get_num_threads() or 1
                    _set(library, 1)
        else:
            for library, number in _before.values():
                _set(library, number)
            _before.clear()


@contextmanager
def _entered(inside: int = 0, large: int = 0) -> Iterator[None]:
    _change(inside, large)
    try:
        yield
    finally:
        _change(-inside, -large)


def bounded(function: Decorated) -> Decorated:
    """Returns the function with one BLAS thread inside."""
    return _entered(inside=1)(function)


def with_outer_threads(rows: int) -> AbstractContextManager[None]:
    """The threads from outside, for dense matrices of so many rows, if they gain: 1.4 to 2 at 2400 rows."""
    return _entered(large=int(rows >= 2000))


def workers(values: int) -> int:
    """Returns how many threads a Fourier transform of so many values takes."""
    outside = max((number for _, number in _before.values()), default=1)
    return outside if values >= 2**16 else 1
