"""Rows of states, of load paths and of JSON objects."""

import numpy as np

from . import library, of_kind

LONG = 12  # numbers of a list that is given by its integrals
DIGITS = 6  # of the loads by which events are put in order
LEFT_OUT = {
    "parameters",
    "versions",
    "seconds",
    "warnings",
    "load_error",
    "error_parts",
    "error_psi",
    "error_u",
    "error_psi_paper",
    "edges_error",
    "reason",
    "failure_fe",
    "L_bl_error",
    "fit_residual",
    "alpha_mid_error",
}


def rows_of(kind, *parts):
    """Rows of {name: value}, as functions return them."""
    for part in parts:
        yield from (of_kind(name, value, kind) for name, value in part().items())


def rows_of_states(problems, library=library):
    """Rows of the states of problems: estimated where an accuracy was asked for, discrete elsewhere."""
    for problem in problems:
        state = library.solve(problem)
        kind = "estimated" if library.estimated(problem) else "discrete"
        tolerance = getattr(state, "error_estimate", None) or 0.0
        for quantity, value in library.measured(state, problem).items():
            yield of_kind(f"{problem['name']} {quantity}", value, kind, tolerance)


def in_order(event):
    """What rounding does not change."""
    return float(f"{event.load:.{DIGITS}g}"), event.zone, event.kind, round(event.x, DIGITS)


def rows_of_paths(problems, library=library):
    """Events of load paths in an order that rounding does not change, and half-widths on the way."""
    for problem in problems:
        (events, at) = library.path_of(problem)
        kind = "estimated" if "rtol" in problem else "discrete"
        for number, event in enumerate(sorted(events, key=in_order)):
            row = f"{problem['name']} event {number}"
            tolerance = event.load_error / (event.load or 1.0)
            yield row, f"{event.kind} {event.zone}", "outcome"
            yield of_kind(f"{row} load", event.load, kind, tolerance)
            yield of_kind(f"{row} 1 + x", 1 + event.x, kind, np.sqrt(tolerance))
        for load, state in ((load, at(load)) for load in problem["states"]):
            row = f"{problem['name']} half_width at load={load:g}"
            yield of_kind(row, state.half_width, kind, state.error_estimate or 0.0)


def leaves(value, name=""):
    """(name, scalar) of all that a JSON object holds; long lists of numbers are left to `integrals`."""
    if isinstance(value, dict):
        if isinstance(value.get("x", value.get("x2")), list):
            yield from ((f"{name} {part}", number) for part, number in integrals(value).items())
            return
        for key, part in value.items():
            if key not in LEFT_OUT:
                yield from leaves(part, f"{name}.{key}" if name else key)
    elif isinstance(value, list):
        if len(value) <= LONG:
            for number, part in enumerate(value):
                yield from leaves(part, f"{name}.{number}")
    elif value is not None:
        yield name, value


def integrals(profile):
    """Integrals over a profile of its quantities and their squares, by its weights or by trapezia."""
    x = np.array(profile["x"] if "x" in profile else profile["x2"])
    weights = np.array(profile["weight"]) if "weight" in profile else np.convolve(np.diff(x) / 2, [1, 1])
    totals = {
        f"{name} squared": float(weights @ np.square(values))
        for name, values in profile.items()
        if name not in ("x", "x2", "weight", "zone") and values is not None
    }
    if "pressure" in profile:
        totals["pressure integral"] = float(weights @ np.array(profile["pressure"]))
    return totals
