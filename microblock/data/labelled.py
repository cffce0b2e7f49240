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
UNITS_IN_SPACE = {
    **dict.fromkeys(("load", "shear"), "force"),
    **dict.fromkeys(("contact_area", "weights"), "length^2"),
    **dict.fromkeys(("energy", "dissipation", "work"), "energy"),
}


def data_set(result: Any) -> Any:
    """Returns the xarray.Dataset of a State, History or LoadPath."""
    try:
        import xarray
    except ModuleNotFoundError as failure:
        raise MissingExtra("to_xarray()", "xarray", "xarray") from failure
    if isinstance(result, State):
        return xarray.Dataset(*_of_state(result))
    data = xarray.Dataset()
    if isinstance(result, History):
        states = [_numbered(xarray.Dataset(*_of_state(state))) for state in result.states]
        data = xarray.concat(states, "state", data_vars="all", coords="all", compat="equals", join="outer")
    data.attrs = {"warnings": "; ".join(result.warnings)}
    events = [asdict(event) for event in result.events]
    if events:
        for name in events[0]:
            if name not in ("shear", "pair") or isinstance(result, History):
                values = [_number(event[name]) for event in events]
                data[f"event_{name}"] = ("event", values, _unit(name))
    return data


def _number(value: Any) -> Any:
    """Returns a value, NaN for None."""
    if value is None:
        return np.nan
    return value


def _unit(name: str, flat: bool = True) -> dict[str, str]:
    """Returns the attributes of a quantity: its unit, if it has one."""
    units = UNITS
    if not flat:
        units = UNITS | UNITS_IN_SPACE
    if name in units:
        return {"units": units[name]}
    return {}


def _axes(state: State) -> dict[str, Any]:
    """Returns {name: coordinates (m,)} of the axes along which a state lies; none of points in space."""
    if state.shape:
        return {"x1": state.x1, "x2": state.x2}
    if state.flat:
        return {"x": state.x}
    return {}


def _of_state(state: State) -> tuple[dict[str, Any], dict[str, Any], dict[str, str]]:
    """Returns variables, coordinates and attributes of a state."""
    variables: dict[str, Any] = {}
    shape = state.shape or (len(state.weights),)
    axes = _axes(state)
    along = tuple(axes) or ("point",)
    may_lack = ("approach", "error_estimate", "tangential_approach", "seen_width")
    for name in state.listed:
        value = getattr(state, name)
        units = _unit(name, state.flat)
        if name == "pressures":
            variables[name] = (("corner", *along), np.reshape([*value.values()], (-1, *shape)), units)
        elif name == "zones":
            for zone, intervals in value.items():
                variables[f"zone_{zone}"] = ((f"of_{zone}", "end"), np.reshape(intervals, (-1, 2)), units)
        elif isinstance(value, np.ndarray) and name in ("shear", "tangential_approach"):
            variables[name] = ("component", value, units)
        elif isinstance(value, np.ndarray) and name not in ("x", "x1", "x2", "points"):
            dimensions = along
            if value.ndim > 1:
                dimensions = (*along, "component")
            variables[name] = (dimensions, np.reshape(value, (*shape, *value.shape[1:])), units)
        elif isinstance(value, (int, float)) or (value is None and name in may_lack):
            variables[name] = ((), _number(value), units)
    coordinates: dict[str, Any] = {name: (name, values, _unit("x")) for name, values in axes.items()}
    if not axes:
        points = zip(("x1", "x2", "x3"), state.points.T)
        coordinates = {name: ("point", values, _unit("x")) for name, values in points}
    coordinates["corner"] = [*state.pressures]
    coordinates["end"] = ["left", "right"]
    texts = {"method": state.method, "caption": state.caption, "warnings": "; ".join(state.warnings)}
    return variables, coordinates, texts


def _numbered(data: Any) -> Any:
    """Returns the data set of a state over the numbers of its points, so that others can stand beside it; in
    space over the cells, which all states of a history share.
    """
    if "x" not in data.dims:
        return data
    data = data.reset_index("x").reset_coords("x").rename_dims(x="point")
    numbers = {name: range(size) for name, size in data.sizes.items() if name not in data.indexes}
    return data.assign_coords(numbers)
