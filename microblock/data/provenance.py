"""What a result depends on: a function and its arguments as a digest, and the loaded modules, the user's by
their files, installed ones by the versions of their packages.
"""

import hashlib
import sys
from dataclasses import fields, is_dataclass
from functools import _lru_cache_wrapper, cache
from importlib import metadata, util
from io import BytesIO
from pathlib import Path
from types import CodeType, FunctionType

import cloudpickle

from ..errors import BadArgument


def digest(*parts: object) -> str:
    """Returns one digest (SHA-256) of values, functions and classes; raises BadArgument if an object, such as
    a file, cannot be told from others.

    Code of scripts and notebooks counts by what it does, other code by its name (see `loaded`).
    """
    text = BytesIO()
    try:
        _Pickler(text).dump((sys.version, parts))
    except Exception as failure:  # pickles fail in many ways
        allowed = f"cannot be told from others, for it does not pickle ({failure})"
        raise BadArgument("value", parts, allowed) from failure
    return hashlib.sha256(text.getvalue()).hexdigest()


def loaded() -> dict[str, object]:
    """Returns {module: `made_of` it when first asked} of what is loaded beside Python and the script."""
    names = {name.partition(".")[0] for name in list(sys.modules)} - {"__main__", "__mp_main__"}
    return {name: _first(name) for name in sorted(names - sys.stdlib_module_names)}


def made_of(name: str) -> object:
    """Returns the versions of the packages that install a module, of others one digest of the files; None
    without any.
    """
    try:
        spec = util.find_spec(name)
    except ValueError:  # of a module that was made in memory
        spec = None
    if spec is None:
        return None
    places = [Path(place) for place in spec.submodule_search_locations or [spec.origin or ""]]
    if any({"site-packages", "dist-packages"} & {*place.parts} for place in places):
        return [metadata.version(package) for package in _distributions().get(name, ())]
    files = [file for place in places for file in sorted(place.rglob("*.py")) or [place] if file.is_file()]
    return hashlib.sha256(b"".join(hashlib.sha256(file.read_bytes()).digest() for file in files)).hexdigest()


_first = cache(made_of)


@cache
def _distributions():
    """{module: names of the installed packages that bring it}."""
    return metadata.packages_distributions()


class _Pickler(cloudpickle.Pickler):
    """Definitions of scripts and notebooks by value, the rest by name."""

    def reducer_override(self, value):
        if type(value) is object:
            raise TypeError("an object() has nothing but its identity")
        if isinstance(value, _lru_cache_wrapper):  # it pickles by name even where a notebook defines it
            return str, (), value.__wrapped__
        if is_dataclass(value) and not isinstance(value, type):  # without what is cached
            return str, (), [type(value), *(getattr(value, entry.name) for entry in fields(value))]
        if isinstance(value, CodeType):
            counts = value.co_argcount, value.co_posonlyargcount, value.co_kwonlyargcount, value.co_flags
            names = value.co_names, value.co_varnames, value.co_freevars, value.co_cellvars
            raises = getattr(value, "co_exceptiontable", b"")  # of Python 3.11 on
            constants = [one if isinstance(one, CodeType) else _ordered(one) for one in value.co_consts]
            return str, (), [repr((value.co_code, raises, names, counts)), constants]
        reduced = super().reducer_override(value)
        if reduced is NotImplemented or len(reduced) < 3:  # by name
            return reduced
        if isinstance(value, FunctionType):
            known = value.__globals__
            used = {name: known[name] for name in _names(value.__code__) if name in known}
            around = value.__defaults__, value.__kwdefaults__, value.__closure__, vars(value), used
            return str, (), [value.__code__, *around]
        return str, (value.__qualname__,), (value.__bases__, reduced[2])  # short of a random number


def _ordered(constant):
    """A constant of a function as text, with sets in order."""
    return sorted(map(repr, constant)) if isinstance(constant, frozenset) else repr(constant)


def _names(code):
    """Sorted names in a code object and those inside."""
    inner = (_names(one) for one in code.co_consts if isinstance(one, CodeType))
    return sorted({*code.co_names}.union(*inner))
