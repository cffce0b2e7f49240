"""Results as labelled data sets of xarray; in one file and back, without pickles: arrays, and a text on what
they are.
"""

import json
import os
from collections.abc import Iterable
from dataclasses import asdict
from functools import partial
from importlib import import_module
from inspect import signature
from typing import Any

import numpy as np

from .. import __version__
from ..errors import BadArgument, MissingExtra, Named, replacing, require_place, shown
from .events import LoadPath
from .history import History
from .refinement import Usual
from .state import State, Surface
from .types import AnyArray, Interval

# of a result of each kind, what is written
NAMES: dict[Any, Iterable[str]] = {
    State: tuple({*State.names()} - {"solution"}),
    History: ("problem", "states", "events"),
    LoadPath: ("problem", *LoadPath._keys),
}
# of quantities, in the plane and where they differ in space
UNITS = {
    name: unit
    for unit, names in {
        "length": (
            "approach", "half_width", "contact_area", "zones", "x", "width", "seen_width",
            "weights", "displacement", "opposite", "tangential_approach", "slip",
        ),
        "stress": ("pressure", "pressures", "shear_traction"),
        "stress x length": ("micromoment",),
        "radian": ("psi",),
        "force per thickness": ("load", "shear", "load_error"),
        "energy per thickness": ("energy", "dissipation", "work"),
    }.items()
    for name in names
}  # fmt: skip
IN_SPACE = {"load": "force", "contact_area": "length^2", "energy": "energy", "weights": "length^2"}


class Absent:
    """What is not in a file, but for the Surface of a state: it refuses all else by name."""

    def __init__(self, text: str, along: Surface | None = None) -> None:
        self.text, self.along = text, along

    def __repr__(self) -> str:
        return self.text

    def surface(self, window: Interval | None) -> Any:
        """Returns the Surface of a state, whatever the window."""
        return self.along

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        words = "solve the problem again, of which a loaded state may be the `initial` one"
        raise BadArgument("file", repr(self), f"is not kept in files, and has no {name}: {words}")


def save(result: Any, file: str | os.PathLike[str]) -> None:
    """Writes a State, LoadPath or History, whole or not at all."""
    require_place(file, "file")
    arrays: dict[str, Any] = {}
    text = json.dumps(_packed(result, arrays))
    with replacing(file, "file") as part:
        np.savez_compressed(part, version=__version__, text=text, **arrays)


def load(file: str | os.PathLike[str]) -> State | LoadPath | History:
    """Returns what `save` of a State, LoadPath or History has written to a file, digit by digit.

    Parameters
    ----------
    file : str or path

    Returns
    -------
    State, LoadPath or History
        What lies between the points of a state is refused by name.

    Raises
    ------
    BadArgument
        If there is no such file, or it is of a version with other parts.

    Examples
    --------
    >>> solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)
    >>> problem = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Microblock())
    >>> problem.path(load=1.0).save("path.npz")
    >>> path = mb.load("path.npz")
    >>> path.events == problem.path(load=1.0).events, path.problem == problem, path.at(0.5).load
    (True, True, 0.5)
    """
    arrays: dict[str, AnyArray] = {}
    try:
        with np.load(file) as columns:
            arrays |= columns
        result = json.loads(arrays["text"].item(), object_hook=partial(_unpacked, arrays))
    except Exception as failure:  # files of others, and of other versions, fail in many ways
        version = f" of version {arrays.get('version')}, this is {__version__}" * ("version" in arrays)
        cause = str(failure).partition(". ")[0]  # NumPy goes on to advise loading pickles
        words = f"must be one that save() has written{version} ({cause})"
        raise BadArgument("file", file, words) from failure
    return result


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
        return {type(value).__name__: [_packed(one, arrays) for one in value]}
    if isinstance(value, dict):
        entries = [[name, _packed(one, arrays)] for name, one in value.items()]
        return {"dict": entries, "of": getattr(value, "what", None)}
    kind = next((each for each in NAMES if isinstance(value, each)), type(value))
    if kind.__module__.startswith("microblock."):
        names = NAMES.get(kind) or [name for name in signature(kind).parameters if name in vars(value)]
        parts = {name: getattr(value, name) for name in names}
        if kind is State and value.flat:
            parts["along"] = value.surface()
        packed = {name: _packed(one, arrays) for name, one in parts.items()}
        if kind in NAMES or '{"lost": ' not in json.dumps(packed):
            return {"class": [kind.__module__, kind.__qualname__], "parts": packed}
    return {"lost": repr(value) if isinstance(value, Absent) else shown(value)}


def _unpacked(arrays: dict[str, AnyArray], tree: dict[str, Any]) -> Any:
    """Returns what an object of JSON stands for, whose parts are unpacked."""
    if "array" in tree:
        return arrays[tree["array"]]
    if "usual" in tree:
        return Usual(tree["usual"])
    if "lost" in tree:
        return Absent(tree["lost"])
    if "dict" in tree:
        return dict(tree["dict"]) if tree["of"] is None else Named(tree["of"], tree["dict"])
    if "list" in tree or "tuple" in tree:
        return tree["list"] if "list" in tree else tuple(tree["tuple"])
    if "class" not in tree:
        return tree  # parts by their names
    (module, name), parts = tree["class"], tree["parts"]
    kind = getattr(import_module(module), name) if module.startswith("microblock.") else None
    if not isinstance(kind, type) or kind.__module__ != module:
        raise ValueError(f"{module}.{name} is no class of microblock")
    if kind is State:
        parts["solution"] = Absent("what lies between the points of a state", parts.pop("along", None))
    return kind(**parts)


def data_set(result: Any) -> Any:
    try:
        import xarray
    except ModuleNotFoundError as failure:
        raise MissingExtra("to_xarray()", "xarray", "xarray") from failure
    if isinstance(result, State):
        return xarray.Dataset(*_of_state(result))
    together = xarray.Dataset()
    if isinstance(result, History):
        states = [_numbered(xarray.Dataset(*_of_state(state))) for state in result.states]
        together = xarray.concat(
            states, "state", data_vars="all", coords="all", compat="equals", join="outer"
        )
    together.attrs = {"warnings": "; ".join(result.warnings)}
    events = [asdict(event) for event in result.events]
    for name in events[0] if events else ():
        if name not in ("shear", "pair") or isinstance(result, History):
            values = [np.nan if event[name] is None else event[name] for event in events]
            together[f"event_{name}"] = "event", values, _unit(name)
    return together


def _unit(name: str, flat: bool = True) -> dict[str, str]:
    units = UNITS if flat else UNITS | IN_SPACE
    return {"units": units[name]} if name in units else {}


def _of_state(state: State) -> tuple[dict[str, Any], dict[str, Any], dict[str, str]]:
    found, shape = dict[str, Any](), state.shape or (len(state.weights),)
    along = ("x1", "x2") if state.shape else ("x",) if state.flat else ()
    axes = {name: getattr(state, name) for name in along}
    places, along = axes or dict(zip(("x1", "x2", "x3"), state.points.T)), along or ("point",)
    texts = {"method": state.method, "caption": state.caption, "warnings": "; ".join(state.warnings)}
    may_lack = "approach", "error_estimate", "tangential_approach", "seen_width"
    for name in state.listed:
        value, units = getattr(state, name), _unit(name, state.flat)
        if name == "pressures":
            found[name] = ("corner", *along), np.reshape([*value.values()], (-1, *shape)), units
        elif name == "zones":
            for zone, pairs in value.items():
                found[f"zone_{zone}"] = (f"of_{zone}", "end"), np.reshape(pairs, (-1, 2)), units
        elif isinstance(value, np.ndarray) and name not in ("x", "x1", "x2", "points"):
            more = ("component",) * (value.ndim - 1)
            found[name] = (*along, *more), np.reshape(value, (*shape, *value.shape[1:])), units
        elif isinstance(value, (int, float)) or (value is None and name in may_lack):
            found[name] = (), np.nan if value is None else value, units
    known = {name: (name if name in along else "point", one, _unit("x")) for name, one in places.items()}
    return found, {**known, "corner": [*state.pressures], "end": ["left", "right"]}, texts


def _numbered(data: Any) -> Any:
    data = data.reset_index("x").reset_coords("x").rename_dims(x="point")  # histories are those of the plane
    return data.assign_coords(
        {name: range(size) for name, size in data.sizes.items() if name not in data.indexes}
    )
