"""Results as labelled data sets of xarray."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from ..errors import MissingExtra
from ..model.history import History
from ..model.state import State

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
