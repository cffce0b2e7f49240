"""BLAS threads: one while the library works on small problems, those that were there for large matrices.

From the outermost `bounded` entry on, BLAS (also NGSolve's own) and OpenMP have one thread; what was there
before is given back afterwards, and inside to what is `released`. BLAS has one number of threads for the
whole process, so that entries of all Python threads are counted together; OpenMP, and a BLAS built on it, has
one for each.
"""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from functools import wraps
from typing import ParamSpec, TypeVar

from threadpoolctl import ThreadpoolController

P = ParamSpec("P")
T = TypeVar("T")

_lock = threading.Lock()
# number of modules when libraries were last looked for: that takes a millisecond, and they come by imports
_seen = 0


class _Hold:
    """Libraries that have one thread while a call is inside and none is on a large matrix."""

    def __init__(self, libraries):
        self.libraries, self.inside, self.large, self.before = libraries, 0, 0, []

    def change(self, inside, large):
        """Counts entries; limits libraries, or gives them their threads back."""
        self.inside += inside
        self.large += large
        if self.inside and not self.large:
            for library in self.libraries[len(self.before) :]:
                self.before.append(library.get_num_threads() or 1)
                _set(library, 1)
        else:
            for library, number in zip(self.libraries, self.before):
                _set(library, number)
            self.before.clear()


class _OwnHold(_Hold, threading.local):
    """The same for each Python thread."""


_holds = _Hold([]), _OwnHold([])  # BLAS and OpenMP, with all libraries that were ever seen


def _set(library, number):
    """Sets a library's threads from any Python thread: threadpoolctl leaves OpenBLAS to the first."""
    free = getattr(library, "clear_controlling_thread", lambda force: None)
    free(force=True)
    library.set_num_threads(number)
    free(force=True)


def _change(inside: int = 0, large: int = 0) -> None:
    global _seen
    with _lock:
        if len(sys.modules) != _seen:
            known = {library.filepath for hold in _holds for library in hold.libraries}
            for library in ThreadpoolController().lib_controllers:
                if library.filepath not in known:
                    own = "openmp" in (library.user_api, getattr(library, "threading_layer", None))
                    _holds[own].libraries.append(library)
            _seen = len(sys.modules)
        for hold in _holds:
            hold.change(inside, large)


@contextmanager
def _entered(**counts: int) -> Iterator[None]:
    _change(**counts)
    try:
        yield
    finally:
        _change(**{name: -count for name, count in counts.items()})


def bounded(function: Callable[P, T]) -> Callable[P, T]:
    """Returns the function with one BLAS thread inside."""

    @wraps(function)
    def inside(*arguments: P.args, **named: P.kwargs) -> T:
        with _entered(inside=1):
            return function(*arguments, **named)

    return inside


def released(rows: int) -> AbstractContextManager[None]:
    """The threads from outside, for dense matrices of so many rows, if they gain: 1.4 to 2 at 2400 rows."""
    return _entered(large=int(rows >= 2000))


def workers(values: int) -> int:
    """Returns how many threads a Fourier transform of so many values takes."""
    outside = max((number for hold in _holds for number in hold.before), default=1)
    return outside if values >= 2**16 else 1
