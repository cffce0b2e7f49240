"""The errors microblock raises on purpose; each says what was wrong and what to try."""


import numpy as np

LONGEST = 80     # characters of a value in a message
MANY = 6         # entries of a sequence from which its first FEW are shown
FEW = 3
NUMBERS = int, float, np.integer, np.floating
MOST = 2**62     # whole number where no other limit stands: what arrays are counted by
SMALLEST, LARGEST = 1e-50, 1e50      # of lengths, stresses and loads: products of a few of them stay within 1e+-300


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


def require_finite(**arguments):
    """Raise BadArgument for the first argument that is no finite real number, or larger than products of it can be."""
    for name, value in arguments.items():
        if isinstance(value, bool) or not isinstance(value, NUMBERS) or not abs(value) < float("inf"):
            raise BadArgument(name, value, "must be a finite number")
        if value:
            require_size(least=0.0, **{name: value})


def require_size(least=SMALLEST, **arguments):
    """Raise BadArgument for the first number, other than 0, whose products with others double precision cannot carry."""
    for name, value in arguments.items():
        size = abs(value) if isinstance(value, int) else abs(float(value))      # float32 knows no LARGEST
        if not least <= size <= LARGEST:
            raise BadArgument(name, value, f"must lie between {SMALLEST:g} and {LARGEST:g} in absolute value: double precision "
                              "does not carry products of others; take other units")


def require_positive(**arguments):
    """Raise BadArgument for the first argument that is no positive, finite number of a size that can be computed with."""
    require_finite(**arguments)
    for name, value in arguments.items():
        if not value > 0:
            raise BadArgument(name, value, "must be positive")
        require_size(**{name: value})


def require_tolerance(rtol, name="rtol"):
    """Raise BadArgument unless rtol is a relative tolerance."""
    require_finite(**{name: rtol})
    if not 0 < rtol < 1:
        raise BadArgument(name, rtol, f"must satisfy 0 < {name} < 1")


def require_whole(least, most=None, **arguments):
    """Raise BadArgument for the first argument that is no whole number from `least` on, up to `most` if there is one."""
    for name, value in arguments.items():
        whole = isinstance(value, (int, np.integer)) and not isinstance(value, bool)
        if not whole or not least <= value <= (MOST if most is None else most):
            raise BadArgument(name, value, "must be a whole number"
                              + (f", at least {least}" if most is None else f" between {least} and {most}"))


def require_choice(known, **arguments):
    """Raise BadArgument for the first argument that is none of the known words."""
    for name, value in arguments.items():
        if not isinstance(value, str) or value not in known:
            raise BadArgument(name, value, f"must be one of {', '.join(known)}")


def require_kind(kinds, words, **arguments):
    """Raise BadArgument for the first argument that is of none of these classes, `words` saying which they are."""
    for name, value in arguments.items():
        if not isinstance(value, kinds):
            raise BadArgument(name, value, f"must be {words}")


def require_values(**arguments):
    """[list of values of each argument]; BadArgument for the first argument that cannot be gone through."""
    try:
        for name, value in arguments.items():
            arguments[name] = list(value)
    except TypeError as failure:
        raise BadArgument(name, value, "must be a sequence") from failure
    return list(arguments.values())


def require_pair(**arguments):
    """Raise BadArgument for the first argument that is not (left, right), two finite numbers with left < right."""
    for name, value in arguments.items():
        try:
            left, right = value
            require_finite(left=left, right=right)
        except (TypeError, ValueError) as failure:      # a BadArgument is a ValueError
            raise BadArgument(name, value, "must be (left, right), two finite numbers") from failure
        if not left < right:
            raise BadArgument(name, value, "must be (left, right), left < right")
