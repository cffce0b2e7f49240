"""Results as labelled data sets of xarray."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from ..errors import MissingExtra
from .events import LoadPath
from .history import History
from .plain_data import unit
from .state import State


def data_set(result: State | LoadPath | History) -> Any:
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
    own = unit(name, flat)
    return {"units": own} if own else {}


def _of_state(state: State) -> tuple[dict[str, Any], dict[str, Any], dict[str, str]]:
    found = dict[str, Any]()
    along: tuple[str, ...] = ("x",) if state.flat else ("point",)
    places: dict[str, Any] = {"x": state.x} if state.flat else dict(zip(("x1", "x2", "x3"), state.points.T))
    shape = state.shape or (len(state.weights),)
    if state.shape:
        along, places = ("x1", "x2"), {"x1": state.x1, "x2": state.x2}
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
    if "x" in data.indexes:
        data = data.reset_index("x").reset_coords("x").rename_dims(x="point")
    return data.assign_coords(
        {name: range(size) for name, size in data.sizes.items() if name not in data.indexes}
    )
