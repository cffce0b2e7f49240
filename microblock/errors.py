"""The errors microblock raises on purpose; each says what was wrong and what to try."""


from numbers import Real

import numpy as np

LONGEST = 80     # characters of a value in a message
MANY = 6         # entries of a sequence from which its first FEW are shown
FEW = 3


class MicroblockError(Exception):
    """Base of all errors raised on purpose.

    Examples
    --------
    >>> issubclass(mb.BadArgument, mb.MicroblockError) and issubclass(mb.NotConverged, mb.MicroblockError)
    True
    """


class BadArgument(MicroblockError, ValueError):
    """An argument outside its range: names it, its value and what is allowed.

    Examples
    --------
    >>> mb.Cylinder(R=-1)
    Traceback (most recent call last):
        ...
    microblock.errors.BadArgument: R = -1: must be positive
    """

    def __init__(self, name, value, allowed):
        super().__init__(f"{name} = {shown(value)}: {allowed}")
        self.name, self.value, self.allowed = name, value, allowed


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
    """A computation stopped short of what was asked: says where it stood and what to try.

    Attributes
    ----------
    reached : float or None
        The last load or approach (or the accuracy) that was reached, None if there is none.
    iterations : int
        Iterations spent at the point of failure.

    Examples
    --------
    >>> failure = mb.NotConverged("no luck at load 0.3; try ...", reached=0.2)
    >>> failure.reached
    0.2
    """

    def __init__(self, message, *, reached=None, iterations=0):
        super().__init__(message)
        self.reached, self.iterations = reached, iterations


class MissingExtra(MicroblockError, ImportError):
    """A package that an optional part needs is not installed: says which extra brings it.

    Examples
    --------
    >>> print(mb.MissingExtra("explore()", "ipywidgets", "notebook"))
    explore() needs ipywidgets: python -m pip install 'microblock[notebook]'
    """

    def __init__(self, what, package, extra):
        super().__init__(f"{what} needs {package}: python -m pip install 'microblock[{extra}]'")


def shown(value):
    """A value on one short line: of a long sequence its length and first entries, of a function its name."""
    if callable(value) and hasattr(value, "__name__"):
        return f"{'class' if isinstance(value, type) else 'function'} {value.__name__}"
    if (isinstance(value, (list, tuple)) or isinstance(value, np.ndarray) and value.ndim) and len(value) > MANY:
        return f"{len(value)} entries ({', '.join(shown(one) for one in value[:FEW])}, ...)"
    return shortened(repr(value.item() if isinstance(value, np.generic) else value))


def shortened(words):
    """Words on one line of at most LONGEST characters."""
    line = " ".join(words.split())
    return line if len(line) <= LONGEST else line[:LONGEST - 4] + " ..."


def require_positive(**arguments):
    """Raise BadArgument for the first argument that is no positive, finite number."""
    require_finite(**arguments)
    for name, value in arguments.items():
        if not value > 0:
            raise BadArgument(name, value, "must be positive")


def require_tolerance(rtol):
    """Raise BadArgument unless rtol is a relative tolerance."""
    require_finite(rtol=rtol)
    if not 0 < rtol < 1:
        raise BadArgument("rtol", rtol, "must satisfy 0 < rtol < 1")


def require_finite(**arguments):
    """Raise BadArgument for the first argument that is no finite real number."""
    for name, value in arguments.items():
        if isinstance(value, bool) or not isinstance(value, Real) or not abs(value) < float("inf"):
            raise BadArgument(name, value, "must be a finite number")
