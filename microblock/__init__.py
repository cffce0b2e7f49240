"""microblock: contact of bodies with microstructure, on NGSolve.

The names of `__init__.pyi` are what a script needs; those that live on a mesh load NGSolve when first used.
"""

import re
from importlib import import_module
from pathlib import Path

from .model import views

__version__ = "0.4.0.dev0"

# {public name: its module}; type checkers read the same lines
_STUB = Path(__file__).with_suffix(".pyi").read_text()
_HOME = {name: module for module, name in re.findall(r"^from \.(\S+) import (\w+)", _STUB, re.M)}

_RENAMED = {
    "Body3D": "is mb.Body now, of order 2 where none is named: mb.Body(mesh, solid, order=1)",
    "HistoryEvent": "is mb.Event now: its normal is load, its error load_error, a force",
}

__all__ = sorted(_HOME)


def _pictures() -> views.Pictures:
    from .view import pictures

    return pictures


def _tables() -> views.Tables:
    from .data import labelled

    return labelled


views.offer(_pictures, _tables)


def __getattr__(name: str) -> object:
    if name in _HOME:
        return getattr(import_module(f".{_HOME[name]}", __name__), name)
    if name in _RENAMED:
        from .errors import BadArgument

        raise BadArgument("name", name, _RENAMED[name])
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*__all__, *(name for name in globals() if name.startswith("__"))})
