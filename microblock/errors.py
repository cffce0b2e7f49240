"""The errors that microblock raises on purpose, the checks of arguments that raise them, and whole files."""

import os
import sys
import warnings
from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import fields
from decimal import ROUND_CEILING, ROUND_FLOOR, Context
from functools import partial
from pathlib import Path
from typing import Any, cast

import numpy as np

LONGEST_SHOWN = 80  # characters of a value in a message
NOT_YET = "must be larger: the obstacle touches no node or cell of the body yet"  # of an approach
BOUNDED = "a flat or low one presses a Body, whose surface ends, or with period= a surface that repeats"
# of lengths, stresses and loads: products of a few of them stay within 1e+-300
SMALLEST = 1e-50
LARGEST = 1e50
MARKS_OF_HOLES = 9999, 99999, 32767, 32768  # of grids of ESRI and of instruments of 16 bits, of either sign
LEAST_HUGE_MARK = 1e30  # of Surfer's 1.70141e38 and the largest number of 32 bits
SIZES = (
    f"must lie between {SMALLEST:g} and {LARGEST:g} in absolute value: double precision does not carry "
    "products of others; take other units"
)


class MicroblockError(Exception):
    """Base of the errors that microblock raises on purpose.

    Examples
    --------
    >>> issubclass(mb.BadArgument, mb.MicroblockError) and issubclass(mb.NotConverged, mb.MicroblockError)
    True
    """

    def __reduce__(self) -> tuple[Any, ...]:
        """A copy has the message, not what it was made of."""
        return type(self).__new__, (type(self), *self.args), vars(self)


class StandsFor:
    """Base of what stands for something that a user gave, which messages show in its place.

    Attributes
    ----------
    given : object
    """

    given: Any

    def __repr__(self) -> str:
        return shown(self.given)


class BadArgument(MicroblockError, ValueError):
    """An argument is outside its range; the message names it, its value and what is allowed.

    Attributes
    ----------
    name : str
        Name of the argument.
    value : object
        What was given.
    allowed : str
        What is allowed, as the end of the sentence.

    Examples
    --------
    >>> mb.Cylinder(R=-1)
    Traceback (most recent call last):
        ...
    microblock.errors.BadArgument: R = -1: must be positive
    """

    def __init__(self, name: str, value: object, allowed: str) -> None:
        if isinstance(value, StandsFor):
            value = value.given
        super().__init__(f"{name} = {shown(value)}: {allowed}")
        self.name = name
        self.value = value
        self.allowed = allowed


class Inadmissible(BadArgument):
    """Moduli for which the elastic energy is not elliptic, (13).

    Examples
    --------
    >>> mb.Cosserat(E=100, nu=0.5, ell=0.1, beta=1)
    Traceback (most recent call last):
        ...
    microblock.errors.Inadmissible: nu = 0.5: must satisfy -1 < nu < 1/2
    """


class NotConverged(MicroblockError, RuntimeError):
    """A computation stopped short of what was asked; the message says where it stood and what to try.

    Attributes
    ----------
    reached : float, tuple or None
        The last load or approach that was reached, of a history the last pair.
    rtol_reached : float or None
        An rtol that is met when it is asked for.
    iterations : int
        Iterations up to the failure.

    Examples
    --------
    >>> failure = mb.NotConverged("no luck at load 0.3; try ...", reached=0.2)
    >>> failure.reached
    0.2
    """

    def __init__(
        self,
        message: str,
        *,
        reached: float | tuple[float, ...] | None = None,
        iterations: int = 0,
        rtol_reached: float | None = None,
    ) -> None:
        super().__init__(message)
        self.reached = reached
        self.iterations = iterations
        self.rtol_reached = rtol_reached


class Interrupted(KeyboardInterrupt):
    """Ctrl-C stopped a computation; a KeyboardInterrupt, and so none of the errors of `except Exception`.

    Attributes
    ----------
    reached : State, History, list or None
        What there was by then, of a looser accuracy than what was asked for: of `solve` the State with the
        smallest error estimate, of `states` the list of those that are done, of `path` the events so far, of
        `history` the History with the smallest error estimate; None of `sweep`, whose records go on.

    Examples
    --------
    >>> issubclass(mb.Interrupted, KeyboardInterrupt), issubclass(mb.Interrupted, Exception)
    (True, False)
    """

    def __init__(self, message: str, reached: Any = None) -> None:
        super().__init__(message)
        self.reached = reached


class MissingExtra(MicroblockError, ImportError):
    """A package that an optional part needs is not installed.

    Parameters
    ----------
    what : str
        The function that needs the package.
    package, extra : str
        The package, and the extra of microblock that installs it.

    Examples
    --------
    >>> print(mb.MissingExtra("explore()", "ipywidgets", "notebook"))
    explore() needs ipywidgets: python -m pip install 'microblock[notebook]'
    """

    def __init__(self, what: str, package: str, extra: str) -> None:
        super().__init__(f"{what} needs {package}: python -m pip install 'microblock[{extra}]'")


class Named(dict[str, Any]):
    """Values by known names; another raises BadArgument by the name `what`. As other mappings it is made of
    pairs alone, by which `dataclasses.asdict` copies it.
    """

    def __init__(self, values: Any = (), what: str = "name") -> None:
        super().__init__(values)
        self.what = what

    def __missing__(self, name: object) -> Any:
        raise BadArgument(self.what, name, f"must be one of {', '.join(self)}")


def at_least(value: float, rounding: str = ROUND_CEILING) -> str:
    """Returns a positive number in two digits, rounded up."""
    return f"{float(Context(prec=2, rounding=rounding).create_decimal(repr(float(value)))):.1e}"


def at_most(value: float) -> str:
    """Returns a positive number in two digits, rounded down."""
    return at_least(value, ROUND_FLOOR)


def out_of_reach(
    rtol: float,
    best: float,
    why: str = "",
    besides: str = "",
    iterations: int = 0,
    *,
    load: Any = None,  # a float, of a history a pair
    approach: float | None = None,
    met_again: bool = True,
    margin: float = 1.0,
) -> NotConverged:
    """Returns the NotConverged of an rtol where the smallest estimate is `best`: it advises an rtol that is
    met, unless that is not known yet (`met_again`), and what `besides` names. The rtol is larger than `best`
    by a `margin` where a method goes another way for another rtol.
    """
    message = f"rtol = {rtol:g} was not reached"
    if load is not None:
        message += f" at load {load:g}"
    elif approach is not None:
        message += f" at approach {approach:g}"
    message += why
    if np.isfinite(best):
        message += f", the smallest error estimate was {at_least(best)}"
    met = float(at_least(margin * best))
    is_met = rtol < met < 1
    finer = ", which finer levels are expected to meet" if met < best else ""
    advice = [f"ask for rtol={met:.1e}{finer}"] if is_met and met_again else []
    if besides:
        advice.append(besides)
    if advice:
        message += "; " + " or ".join(advice)
    return NotConverged(
        message,
        reached=approach if load is None else load,
        rtol_reached=met if is_met else None,
        iterations=iterations,
    )


def shown(value: Any) -> str:
    """Returns a value on one short line, of a sequence its first entries."""
    if isinstance(value, type):
        return f"class {value.__name__}"
    if callable(value) and hasattr(value, "__name__"):
        return f"function {value.__name__}"
    sequence = isinstance(value, (list, tuple)) or (isinstance(value, np.ndarray) and value.ndim > 0)
    if sequence and len(value) > 6:
        return f"{len(value)} entries ({', '.join(shown(entry) for entry in value[:3])}, ...)"
    return shortened(repr(plain(value)))


def shortened(words: str) -> str:
    """Returns words on one line of at most LONGEST_SHOWN characters."""
    line = " ".join(words.split())
    return line if len(line) <= LONGEST_SHOWN else line[: LONGEST_SHOWN - 4] + " ..."


def _require(holds: Callable[[Any], object], words: str, arguments: dict[str, Any]) -> None:
    """Raises BadArgument for the first argument of which something does not hold."""
    for name, value in arguments.items():
        require(holds(value), name, value, words)


def require(holds: object, name: str, value: object, allowed: str) -> None:
    """Raises BadArgument of an argument unless something holds."""
    if not holds:
        raise BadArgument(name, value, allowed)


def plain(value: Any) -> Any:
    """Returns a number of numpy as Python's, since narrow integers overflow."""
    return value.item() if isinstance(value, (np.generic, np.ndarray)) and not value.ndim else value


class Checked:
    """Base of dataclasses whose numbers become Python's; "check" in a field's metadata is called with its
    value, but for None where that is the default, and what that returns takes its place.
    """

    def __post_init__(self) -> None:
        for field in fields(cast(Any, self)):
            value = plain(getattr(self, field.name))
            check = field.metadata.get("check")
            if check and (value is not None or field.default is not None):
                value = check(**{field.name: value}) or value
            object.__setattr__(self, field.name, value)


def checked(check: Callable[..., object], *limits: object) -> dict[str, Callable[..., object]]:
    """Returns the metadata of a `Checked` field: a function and its first arguments."""
    return {"check": partial(check, *limits)}


def require_finite(**arguments: object) -> None:
    """Raises BadArgument for what is no finite real number, or too large for products."""
    _require(
        lambda value: type(plain(value)) in (int, float) and abs(value) < float("inf"),
        "must be a finite number",
        arguments,
    )
    # float32 knows no LARGEST
    _require(lambda value: abs(plain(value)) <= LARGEST, SIZES, arguments)


def require_size(**arguments: object) -> None:
    """Raises BadArgument for what is no finite number, or neither 0 nor large enough for products."""
    require_finite(**arguments)
    _require(lambda value: not value or abs(plain(value)) >= SMALLEST, SIZES, arguments)


def require_positive(**arguments: object) -> None:
    """Raises BadArgument for what is no positive number of such a size."""
    require_finite(**arguments)
    _require(lambda value: value > 0, "must be positive", arguments)
    require_size(**arguments)


def require_tolerance(rtol: Any) -> Any:
    """Returns rtol as Python's number; raises BadArgument unless it is a tolerance or None."""
    rtol = plain(rtol)
    if rtol is not None:
        require_finite(rtol=rtol)
        require(0 < rtol < 1, "rtol", rtol, "must satisfy 0 < rtol < 1")
    return rtol


def require_whole(least: int, most: int | None = None, **arguments: object) -> None:
    """Raises BadArgument for what is no whole number from `least` to `most`."""
    words = f", at least {least}" if most is None else f" between {least} and {most}"
    _require(
        lambda value: type(plain(value)) is int and least <= value <= (most or sys.maxsize),
        f"must be a whole number{words}",
        arguments,
    )


def _names(path: object) -> bool:
    return isinstance(path, (str, os.PathLike)) and bool(str(path)) and "\0" not in str(path)


def require_place(
    path: str | os.PathLike[str], name: str = "path", endings: Collection[str] | None = None
) -> None:
    """Raises BadArgument unless a file can have this path: in a folder that can be written to, no folder
    itself, with one of the endings, or none.
    """
    require(_names(path) and not Path(path).is_dir(), name, path, "must name a file")
    folder = Path(path).parent
    words = f"must lie in a folder that can be written to, and {folder} is none"
    require(folder.is_dir() and os.access(folder, os.W_OK), name, str(path), words)
    ending = Path(path).suffix[1:].lower()  # what follows a point may as well be a number's digits
    allowed = sorted(endings or ())
    words = f"must end in .{', .'.join(allowed)} or in none of its own"
    require(not allowed or ending in allowed or not ending.isalpha(), name, str(path), words)


def made_folder(path: str | os.PathLike[str], name: str) -> Path:
    """Returns a folder, made if it is not there; raises BadArgument unless files can be written to it."""
    require(_names(path) and not Path(path).is_file(), name, path, "must name a folder")
    with writing(path, name):
        Path(path).mkdir(exist_ok=True, parents=True)
    require_place(Path(path) / "file", name)
    return Path(path)


@contextmanager
def writing(path: str | os.PathLike[str], name: str = "path") -> Iterator[None]:
    """Context in which a file is written; raises BadArgument where the system refuses."""
    try:
        yield
    except OSError as failure:
        words = f"cannot be written to ({failure.strerror or failure})"
        raise BadArgument(name, str(path), words) from failure


@contextmanager
def replacing(path: str | os.PathLike[str], name: str = "path") -> Iterator[Path]:
    """Context that gives a path beside the file, which takes its place at the end; of a device or pipe its
    own. Raises BadArgument as `writing`.
    """
    file = Path(path)
    with writing(path, name):
        if file.exists() and not file.is_file():  # a device or pipe
            yield file
            return
        beside = file.with_name(f".{file.name}.{os.getpid()}.npz")  # an ending that numpy leaves as it is
        try:
            yield beside
            beside.replace(file)
        finally:
            beside.unlink(missing_ok=True)


def require_choice(known: Collection[str], **arguments: object) -> None:
    """Raises BadArgument for what is none of the known words."""
    words = f"must be one of {', '.join(known)}"
    _require(lambda value: isinstance(value, str) and value in known, words, arguments)


def require_kind(kinds: type | tuple[type, ...], words: str, **arguments: object) -> None:
    """Raises BadArgument for what is of none of these classes, which `words` name."""
    _require(lambda value: isinstance(value, kinds), f"must be {words}", arguments)


def require_values(**arguments: Iterable[Any]) -> list[Any]:
    """Returns the list of values of a sequence; raises BadArgument of others."""
    ((name, values),) = arguments.items()
    try:
        return list(values)
    except TypeError as failure:
        raise BadArgument(name, values, "must be a sequence") from failure


require_flag = partial(require_kind, (bool, np.bool_), "True or False")


def require_depth(approach: float, depth: float, size: float) -> None:
    """Raises BadArgument for an approach by which an obstacle gets no deeper into a surface of this size
    (lengths) than rounding of heights and places.
    """
    rounding = 64 * np.finfo(float).eps * max(abs(approach), size)
    require(depth > rounding, "approach", approach, NOT_YET)


def _entries(values: Any) -> Any:
    """Returns the masked array of what NumPy reads as such; masked entries of a list stay masked."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # which NumPy says of these
        return np.ma.asarray(values)


def real_numbers(values: Any, masked: float = np.nan) -> Any:
    """Returns an array of floats of what holds numbers, with `masked` where it has a mask.

    Raises TypeError of complex numbers, dates and texts, which NumPy would read as numbers.
    """
    if type(values) is np.ndarray and values.dtype == float:  # masked arrays have another type
        return values.copy()
    entries = _entries(values)
    kind = entries.dtype.kind
    texts = kind == "O" and any(
        isinstance(entry, (str, bytes, np.datetime64)) for entry in entries.compressed()
    )
    if texts or kind not in "biufO":
        raise TypeError(f"these are no real numbers, but of the type {entries.dtype}")
    return entries.astype(float).filled(masked)


def require_floats(words: str, masked: float = np.nan, /, **arguments: Any) -> Any:
    """Returns an array of floats as `real_numbers`; raises BadArgument, by these words, of anything else."""
    ((name, values),) = arguments.items()
    try:
        return real_numbers(values, masked)
    except (TypeError, ValueError, OverflowError) as failure:
        raise BadArgument(name, values, words) from failure


def require_heights(**heights: Any) -> None:
    """Raises BadArgument of unsigned integers: -z of those, of what was measured from above, wraps round; and
    of a number by which files mark holes, where all other heights are farther from it than from each other.
    """
    ((name, values),) = heights.items()
    words = "must not be unsigned integers, whose negative wraps round: take them as float"
    require(_entries(values).dtype.kind != "u", name, values, words)
    finite = real_numbers(values)
    finite = finite[np.isfinite(finite)]
    marked = np.isin(np.abs(finite), MARKS_OF_HOLES) | (np.abs(finite) >= LEAST_HUGE_MARK)
    for mark in set(finite[marked].tolist()):
        others = finite[finite != mark]
        if others.size and np.abs(others - mark).min() > np.ptp(others):
            holes = finite.size - others.size
            raise BadArgument(name, mark, f"stands in {holes} places, and seems to mark holes: make them NaN")


def require_numbers(holes: bool = False, /, **arguments: Any) -> Any:
    """Returns an array (n,) of floats; raises BadArgument unless these are finite, with `holes` but for NaN
    and inf, which stands for what is masked as well.
    """
    ((name, values),) = arguments.items()
    words = "must be a number, or an array (n,) of numbers"
    numbers = np.atleast_1d(require_floats(words, np.inf if holes else np.nan, **arguments))
    good = np.abs(numbers) <= LARGEST
    if holes:
        good |= np.isnan(numbers) | (numbers == np.inf)
    flags = _entries(values).dtype.kind == "b"  # which NumPy reads as numbers
    if flags or numbers.ndim > 1 or not good.all():
        words = "must be a finite number, or an array (n,) of such"
        if not flags and numbers.ndim == 1 < numbers.size:
            first = int(np.argmin(good))
            words += f"; entry {first} is {numbers[first]:g}"
        raise BadArgument(name, values, words)
    return numbers


def require_pair(**arguments: tuple[float, float]) -> tuple[float, float]:
    """Returns (left, right) as floats; raises BadArgument unless finite, left < right."""
    ((name, value),) = arguments.items()
    pair = require_numbers(**arguments).tolist()
    words = "must be (left, right), two finite numbers, left < right"
    require(len(pair) == 2 and pair[0] < pair[1], name, value, words)
    return pair[0], pair[1]
