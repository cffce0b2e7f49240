"""Digests of what a result depends on: arguments, the code that is run, versions. Equal digests, equal results.

Of installed packages the version counts; of other modules their files and those of all modules that they import; of
scripts and notebooks the functions that are used, each with what it takes from around it. Comments and docstrings do not.
"""

import ast
import dis
import hashlib
import importlib.util
import inspect
import json
import sys
import sysconfig
from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass
from functools import cache, partial
from pathlib import Path, PurePath
from types import BuiltinFunctionType, CodeType, FunctionType, MethodType, ModuleType

import numpy as np

from .errors import BadArgument
from .study import versions

LENGTH = 32      # hexadecimal digits that are kept of a digest: 128 bits
INSTALLED = tuple(Path(sysconfig.get_path(kind)).resolve() for kind in ("stdlib", "platstdlib", "purelib", "platlib"))
GLOBALS = ("LOAD_GLOBAL", "LOAD_NAME")
SCRIPTS = ("__main__", "__mp_main__")      # scripts and notebooks: what they define counts function by function


@dataclass(frozen=True)
class File:
    """A file as a value: in a digest it is what is in it at that time, wherever it lies.

    path : Path
    """

    path: Path

    @property
    def content(self):
        """Its SHA-256 as hexadecimal digits; None where there is no file."""
        return hashlib.sha256(self.path.read_bytes()).hexdigest() if self.path.is_file() else None


def digest(*parts):
    """One digest of values, functions and classes (see `described`), as hexadecimal digits.

    Raises
    ------
    BadArgument
        For an object that cannot be told from others, such as a mesh.
    """
    seen = {}
    try:
        text = json.dumps([described(part, seen) for part in parts], sort_keys=True)
    except RecursionError as failure:
        raise BadArgument("value", parts, "holds itself") from failure
    return hashlib.sha256(text.encode()).hexdigest()[:LENGTH]


@cache
def software():
    """Versions that a result depends on, without the machine."""
    return {name: version for name, version in versions().items() if name != "machine"}


def described(value, seen):
    """A value in JSON's types, the same for equal values and different for others; of functions also what they use.

    `seen` numbers the functions and classes that were described before, each once.
    """
    if value is None or isinstance(value, (bool, int, str)):
        return value
    if isinstance(value, float):
        return {"float": value.hex()}
    if isinstance(value, File):
        return {"file": value.content}
    if isinstance(value, PurePath):
        return {"path": str(value)}
    if isinstance(value, np.generic):
        return described(value.item(), seen)
    if isinstance(value, np.ndarray) and value.dtype != object:
        return {"array": [value.dtype.str, list(value.shape), hashlib.sha256(np.ascontiguousarray(value)).hexdigest()]}
    if isinstance(value, (list, tuple)):
        return {type(value).__name__: [described(one, seen) for one in value]}
    if isinstance(value, (set, frozenset)):
        return {"set": sorted(json.dumps(described(one, seen), sort_keys=True) for one in value)}
    if isinstance(value, Mapping):
        return {"mapping": [[described(key, seen), described(one, seen)] for key, one in value.items()]}
    return _of_code(value, seen) or _of_object(value, seen)


def _of_code(value, seen):
    """A module, function, class or code object described, else None."""
    if isinstance(value, ModuleType):
        return _version(value.__name__) if foreign(value.__name__) else {"module": sources(value.__name__)}
    if isinstance(value, partial):
        return {"partial": [described(part, seen) for part in (value.func, value.args, value.keywords)]}
    if isinstance(value, MethodType):
        return {"method": [described(value.__func__, seen), described(value.__self__, seen)]}
    if isinstance(value, CodeType):
        constants = [described(one, seen) for one in value.co_consts]
        return {"code": [value.co_code.hex(), list(value.co_names), constants]}
    value = inspect.unwrap(value) if callable(value) else value
    if not isinstance(value, (FunctionType, BuiltinFunctionType, type, np.ufunc)):
        return None
    home = _home(value)
    named = [home, getattr(value, "__qualname__", value.__name__)]
    if foreign(home):
        return {"named": named, "version": _version(home)}
    if value in seen:
        return {"again": seen[value]}
    seen[value] = len(seen)
    told = {"named": named[1], **({} if home in SCRIPTS else {"module": sources(home)})}
    if isinstance(value, FunctionType):
        return {**told, **_of_function(value, seen)}
    return {**told, **_of_class(value, seen)} if home in SCRIPTS else told


def _home(value):
    """The module of a function or class; of a function that did not come with its module's file, the script."""
    home = getattr(value, "__module__", None) or type(value).__module__
    if isinstance(value, FunctionType) and value.__globals__ is not getattr(sys.modules.get(home), "__dict__", None):
        return SCRIPTS[0]
    return home


def _of_function(function, seen):
    """Its code, defaults, what it takes from around it by name, and in scripts, whose file does not count, what it imports."""
    code, cells = function.__code__, zip(function.__code__.co_freevars, function.__closure__ or ())
    constants = tuple(None if one == function.__doc__ else one for one in code.co_consts)
    taken, imported = {name: cell.cell_contents for name, cell in cells}, None
    if _home(function) in SCRIPTS:
        taken |= {name: function.__globals__[name] for name in _named(code, GLOBALS) if name in function.__globals__}
        imported = sources(*_named(code, ("IMPORT_NAME",)))
    parts = code.replace(co_consts=constants), function.__defaults__, function.__kwdefaults__, taken, imported
    return {"function": [described(part, seen) for part in parts]}


def _named(code, operations):
    """Names that operations of a code object, and of those inside, refer to; sorted."""
    found = {step.argval for step in dis.get_instructions(code) if step.opname in operations}
    return sorted(found.union(*(_named(one, operations) for one in code.co_consts if isinstance(one, CodeType))))


def _of_class(kind, seen):
    plain = {name: getattr(member, "fget", None) or getattr(member, "func", None) or getattr(member, "__func__", member)
             for name, member in vars(kind).items()}
    kept = {name: member for name, member in plain.items()
            if isinstance(member, (FunctionType, int, float, str)) and name not in ("__doc__", "__module__")}
    return {"bases": [described(base, seen) for base in kind.__bases__], "members": described(kept, seen)}


def _of_object(value, seen):
    """An object of a frozen dataclass, or of a class of this project or the user's, by what it holds."""
    kind = type(value)
    if is_dataclass(value):
        held = {entry.name: getattr(value, entry.name) for entry in fields(value)}
    elif kind.__module__.partition(".")[0] == "microblock" or not foreign(kind.__module__):
        held = vars(value)
    else:
        raise BadArgument("value", value, "cannot be told from others of its kind, so that no record could name it: "
                          "pass numbers, texts, dataclasses or functions, and make other things of them inside")
    return {"class": described(kind, seen), "held": described(held, seen)}


@cache
def foreign(name):
    """Whether a module is the standard library's or of an installed package, whose version stands for it."""
    top = name.partition(".")[0]
    if top in SCRIPTS:
        return False
    if top in sys.stdlib_module_names:
        return True
    spec = _spec(top)
    origin = spec and (spec.origin or next(iter(spec.submodule_search_locations or ()), None))
    if origin is None or origin in ("built-in", "frozen"):
        return spec is not None
    return any(Path(origin).resolve().is_relative_to(folder) for folder in INSTALLED)


def _version(name):
    top = name.partition(".")[0]
    return [name, str(getattr(sys.modules.get(top), "__version__", ""))]


@cache
def _spec(name):
    try:
        return importlib.util.find_spec(name)
    except (ImportError, ValueError):      # no such module, or one without a file
        return None


def sources(*modules):
    """Digest of modules (of packages all that is in them) and of what they import, on any line, short of foreign ones."""
    waiting, found = [one for name in modules for one in (name, *_rooms(name))], {}
    while waiting:
        name = waiting.pop()
        if name not in found:
            found[name], used = _module(name)
            waiting += used
    return digest(sorted(found.items()))


def _module(name):
    """(digest of a module's code, modules that it may import); (None, ()) of foreign ones."""
    spec = None if foreign(name) else _spec(name)
    if spec is None or not spec.has_location:
        return None, ()
    package = name if spec.submodule_search_locations else name.rpartition(".")[0]
    return _parsed(spec.origin, Path(spec.origin).stat().st_mtime_ns, package)


@cache
def _parsed(path, changed, package):
    """The same of a file; `changed`, the time of its last change, tells the cache one version from the next."""
    tree = ast.parse(Path(path).read_text())
    used = tuple(one for node in ast.walk(tree) for one in _imported(node, package) if not foreign(one))
    return digest(ast.dump(_bare(tree))), used


def _imported(node, package):
    """Names of modules that a statement may import."""
    if isinstance(node, ast.Import):
        for alias in node.names:
            yield from (alias.name, *_rooms(alias.name))
    elif isinstance(node, ast.ImportFrom):
        base = importlib.util.resolve_name("."*node.level + (node.module or ""), package) if node.level else node.module
        rooms, names = _rooms(base), {f"{base}.{alias.name}" for alias in node.names if not alias.name.startswith("__")}
        yield from (base, *(rooms if names - set(rooms) else names))


@cache
def _rooms(package):
    """All modules of a package, any of which an attribute of it may load; none of a module or foreign package."""
    spec = None if foreign(package) else _spec(package)
    return tuple(f"{package}.{path.stem}" for folder in spec and spec.submodule_search_locations or ()
                 for path in Path(folder).glob("*.py") if path.stem not in ("__init__", "__main__"))


def _bare(tree):
    """The tree without docstrings."""
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list) and body and isinstance(body[0], ast.Expr) and isinstance(body[0].value, ast.Constant):
            del body[0]
    return tree
