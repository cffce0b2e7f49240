"""Results in one file and back, without pickles: arrays, and a text on what they are."""

import json
import os
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from inspect import signature
from typing import Any

import numpy as np

from .. import __version__
from ..errors import BadArgument, Named, replacing, require_place, shown
from .refinement import Usual
from .types import AnyArray


@dataclass(frozen=True, eq=False, repr=False)
class Absent:
    """What is not in a file; it refuses by name whatever is asked of it."""

    text: str

    def __repr__(self) -> str:
        return self.text

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        words = "solve the problem again, of which a loaded state may be the `initial` one"
        raise BadArgument("file", repr(self), f"is not kept in files, and has no {name}: {words}")


class Saved:
    """Base of results that files keep."""

    def parts_to_save(self) -> tuple[type, dict[str, Any]]:
        """Returns the class that a file names, and the arguments that make an instance of it."""
        raise NotImplementedError

    def save(self, file: str | os.PathLike[str]) -> None:
        """Writes the result to a file, from which `load` brings it back digit by digit, functions and meshes
        as their names. `pressure_at`, `micromoment_at`, `gap_at`, `fields` and `stiffness` of what is loaded
        raise BadArgument.

        Parameters
        ----------
        file : str or path
            An archive of numpy's arrays (NPZ), without pickles, whatever the ending.

        Raises
        ------
        BadArgument
            If no file can be there.

        Examples
        --------
        >>> solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)
        >>> problem = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Microblock())
        >>> state = problem.solve(load=1.0)
        >>> state.save("state.npz")
        >>> mb.load("state.npz").to_dict() == state.to_dict()
        True
        """
        require_place(file, "file")
        arrays: dict[str, Any] = {}
        text = json.dumps(_packed(self, arrays))
        with replacing(file, "file") as part:  # whole or not at all
            np.savez_compressed(part, version=__version__, text=text, **arrays)


def read(file: str | os.PathLike[str]) -> Any:
    """Returns what `Saved.save` has written to a file; raises BadArgument of all other files."""
    arrays: dict[str, AnyArray] = {}
    try:
        with np.load(file) as columns:
            arrays |= columns
        return json.loads(arrays["text"].item(), object_hook=partial(_unpacked, arrays))
    except Exception as failure:  # files of others, and of other versions, fail in many ways
        version = f" of version {arrays.get('version')}, this is {__version__}" * ("version" in arrays)
        cause = str(failure).partition(". ")[0]  # NumPy goes on to advise loading pickles
        words = f"must be one that save() has written{version} ({cause})"
        raise BadArgument("file", file, words) from failure


def _packed(value: Any, arrays: dict[str, Any]) -> Any:
    """Returns a value as JSON has it, arrays as their names in `arrays`."""
    if isinstance(value, np.ndarray):
        name = str(len(arrays))
        arrays[name] = value
        return {"array": name}
    value = value.item() if isinstance(value, np.generic) else value
    if isinstance(value, Usual):
        return {"usual": float(value)}
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    if isinstance(value, (list, tuple)):
        return {type(value).__name__: [_packed(entry, arrays) for entry in value]}
    if isinstance(value, dict):
        entries = [[name, _packed(entry, arrays)] for name, entry in value.items()]
        return {"dict": entries, "of": getattr(value, "what", None)}
    if isinstance(value, Saved):
        return _instance(*value.parts_to_save(), arrays)
    kind = type(value)
    if kind.__module__.startswith("microblock."):
        parts = {name: getattr(value, name) for name in signature(kind).parameters if name in vars(value)}
        packed = _instance(kind, parts, arrays)
        if '{"lost": ' not in json.dumps(packed):
            return packed
    return {"lost": shown(value)}


def _instance(kind: type, parts: dict[str, Any], arrays: dict[str, Any]) -> dict[str, Any]:
    """Returns a class and the arguments of an instance as JSON has them."""
    packed = {name: _packed(part, arrays) for name, part in parts.items()}
    return {"class": [kind.__module__, kind.__qualname__], "parts": packed}


def _unpacked(arrays: dict[str, AnyArray], tree: dict[str, Any]) -> Any:
    """Returns what an object of JSON stands for, whose parts are unpacked."""
    if "array" in tree:
        return arrays[tree["array"]]
    if "usual" in tree:
        return Usual(tree["usual"])
    if "lost" in tree:
        return Absent(tree["lost"])
    if "dict" in tree:
        return dict(tree["dict"]) if tree["of"] is None else Named(tree["dict"], tree["of"])
    if "list" in tree or "tuple" in tree:
        return tree["list"] if "list" in tree else tuple(tree["tuple"])
    if "class" not in tree:
        return tree  # parts by their names
    module, name = tree["class"]
    kind = getattr(import_module(module), name) if module.startswith("microblock.") else None
    if not isinstance(kind, type) or kind.__module__ != module:
        raise ValueError(f"{module}.{name} is no class of microblock")
    return kind(**tree["parts"])
