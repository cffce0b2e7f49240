"""Digests of what a result depends on: arguments, code, files and versions. Equal digests mean equal results.

All Python files of both packages count; of a user's function its pickle by value (cloudpickle), the files of
the user's modules that it imports (modulefinder), the versions of the installed packages that it imports.
Where that cannot be told, a digest is a new one each time.
"""

import hashlib
import json
import os
import site
import sys
import sysconfig
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from functools import _lru_cache_wrapper, cache, partial
from importlib import metadata, util
from io import BytesIO
from modulefinder import ModuleFinder
from pathlib import Path, PurePath
from types import CodeType, FunctionType, ModuleType

import cloudpickle
import numpy as np

from ..errors import BadArgument
from .records import software

PACKAGES = "microblock", "cases"  # all their files count, whatever a function imports
INSTALLED = tuple(
    Path(folder).resolve()
    for folder in (
        sysconfig.get_path("stdlib"),
        sysconfig.get_path("platstdlib"),
        *site.getsitepackages(),
        site.getusersitepackages(),
    )
)

_first: dict = {}  # {module: digest of its file when this process first read it}


def digest(*parts: object, read: dict | None = None, fresh: bool = False) -> str:
    """Returns one digest (SHA-256) of values, functions and classes, of the packages and of their versions.

    `read` has what was read of modules before: one dict for many digests. `fresh` says that the code runs in
    processes that start now; others may have loaded a file before it changed, so that after a change within
    this process the digest is one that no other process has. Raises BadArgument if an object, such as a mesh,
    cannot be told from others.
    """
    read = {} if read is None else read
    if PACKAGES not in read:
        read[PACKAGES] = [software(), _runs("", _packages(), fresh)]
    try:
        return _sha(json.dumps([read[PACKAGES], *(_plain(part, read, fresh) for part in parts)]).encode())
    except RecursionError as failure:
        raise BadArgument("value", parts, "holds itself") from failure


def content(*paths: Path) -> str | None:
    """Returns one digest of the names and contents of files, None if one of them does not exist."""
    if not all(path.is_file() for path in paths):
        return None
    return _sha(*(part for path in paths for part in (path.name.encode(), path.read_bytes())))


def _sha(*parts):
    """Digest of bytes; lengths tell ("ab", "c") from ("a", "bc")."""
    return hashlib.sha256(b"".join(b"%d:%b" % (len(part), part) for part in parts)).hexdigest()


def _packages():
    """One digest of all Python files of both packages."""
    specs = [spec for spec in map(util.find_spec, PACKAGES) if spec]
    folders = [Path(folder) for spec in specs for folder in spec.submodule_search_locations or ()]
    return content(*(path for folder in folders for path in sorted(folder.rglob("*.py"))))


def _runs(name, now, fresh):
    """Digest of the code that runs: the file's now, but where a module may be older than its file both."""
    first = _first.setdefault(name, now)
    return now if fresh or first == now else [first, now]


_runs("", _packages(), False)


def _plain(value, read, fresh):
    """A value in JSON's types, the same for equal values and different for others."""

    def each(values):
        return [_plain(one, read, fresh) for one in values]

    if value is None or isinstance(value, (bool, int, str)):
        return value
    if isinstance(value, float):
        return {"float": value.hex()}
    if isinstance(value, PurePath):
        return {"path": str(value)}
    if isinstance(value, np.generic):
        return _plain(value.item(), read, fresh)
    if isinstance(value, np.ndarray) and value.dtype != object:
        return {"array": [value.dtype.str, value.shape, _sha(value.tobytes())]}
    if isinstance(value, (list, tuple)):
        return {type(value).__name__: each(value)}
    if isinstance(value, Mapping):
        return {"mapping": [each(pair) for pair in value.items()]}
    if isinstance(value, partial):
        return {"partial": each((value.func, value.args, value.keywords))}
    if is_dataclass(value) and not isinstance(value, type):
        return {"held": each([type(value), *(getattr(value, entry.name) for entry in fields(value))])}
    if callable(value) or isinstance(value, ModuleType):
        return {"code": _code(value, read, fresh)}
    if type(value).__module__.partition(".")[0] in PACKAGES:
        return {"held": each((type(value), vars(value)))}
    raise BadArgument(
        "value",
        value,
        "cannot be told from others of its kind, so that no record could "
        "name it: pass numbers, texts, dataclasses or functions, and make other things of them "
        "inside",
    )


def _code(value, read, fresh):
    """A function, class or callable object: digests of its pickle and of the modules that it names."""
    text = BytesIO()
    pickler = _Pickler(text)
    try:
        pickler.dump(value)
    except Exception as failure:  # pickles fail in many ways
        allowed = f"cannot be told from others, for it does not pickle ({failure})"
        raise BadArgument("value", value, allowed) from failure
    used = frozenset(pickler.modules), tuple(pickler.codes)
    if used not in read:
        read[used] = _imported(*used, fresh)
    return [_sha(text.getvalue()), read[used]]


class _Pickler(cloudpickle.Pickler):
    """Definitions of scripts and notebooks by value, without places and identities; the rest by name. Modules
    that are named and code objects that are written are noted.
    """

    def __init__(self, file):
        super().__init__(file)
        self.modules, self.codes = set(), []

    def reducer_override(self, value):
        home = value.__name__ if isinstance(value, ModuleType) else getattr(value, "__module__", None)
        self.modules.update([home] if isinstance(home, str) else [])
        if isinstance(value, _lru_cache_wrapper):  # it pickles by name even where a notebook defines it
            return str, (), value.__wrapped__
        if isinstance(value, CodeType):
            self.codes.append(value)
            counts = value.co_argcount, value.co_posonlyargcount, value.co_kwonlyargcount, value.co_flags
            names = value.co_names, value.co_varnames, value.co_freevars, value.co_cellvars
            raises = getattr(value, "co_exceptiontable", b"")  # of Python 3.11 on
            constants = [one if isinstance(one, CodeType) else _told(one) for one in value.co_consts]
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


def _told(constant):
    """A constant of a function as text; each process has its own order of texts in a set."""
    return sorted(map(repr, constant)) if isinstance(constant, frozenset) else repr(constant)


def _names(code):
    """All names in a code object and in those inside, sorted."""
    inner = (_names(one) for one in code.co_consts if isinstance(one, CodeType))
    return sorted({*code.co_names}.union(*inner))


def _imported(modules, codes, fresh):
    """Digests of the files of the user's modules that these and codes import, on any line but by computed
    names, and versions of the installed ones.
    """
    own = {
        name: Path(module.__file__).resolve()
        for name, module in list(sys.modules.items())
        if "." not in name and getattr(module, "__file__", None) and not _installed(module.__file__)
    }
    beside = sorted(str(file.parents[hasattr(sys.modules[name], "__path__")]) for name, file in own.items())
    places = [entry for entry in sys.path if not _installed(entry)]
    finder = ModuleFinder([*places, *beside], excludes=PACKAGES)
    try:
        for name in sorted(filter(_followed, modules)):
            finder.import_hook(name, fromlist=["*"])
        for code in codes:
            finder.scan_code(code, finder.add_module("__main__"))
    except Exception:  # such as a package without __init__.py, or a module without a file
        return os.urandom(16).hex()
    files = [
        [name, _runs(name, content(Path(module.__file__)), fresh)]
        for name, module in sorted(finder.modules.items())
        if module.__file__
    ]
    known = _distributions()
    others = {name.partition(".")[0] for name in (*modules, *finder.badmodules)}
    packages = {package for name in others for package in known.get(name, ())}
    return [files, sorted((package, metadata.version(package)) for package in packages)]


@cache
def _distributions():
    """{module: names of the installed packages that bring it}; to read them takes a third of a second."""
    return metadata.packages_distributions()


def _followed(name):
    """Whether a loaded module is the user's, whose files count one by one."""
    top = name.partition(".")[0]
    scripts = "__main__", "__mp_main__"  # their functions count one by one, and not their file
    if top in (*PACKAGES, *scripts, *sys.stdlib_module_names) or name not in sys.modules:
        return False
    file = getattr(sys.modules[name], "__file__", None) or getattr(sys.modules.get(top), "__file__", None)
    return file is None or not _installed(file)


def _installed(path):
    """Whether a path is the standard library's or an installed package's."""
    return any(Path(path).resolve().is_relative_to(folder) for folder in INSTALLED)
