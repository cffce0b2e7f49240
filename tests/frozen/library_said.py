"""What states, paths and histories say of themselves: estimates and their parts, counts, tables, figures."""

import html
import re

import numpy as np

import microblock as mb

from . import library
from . import problems as given

CLOSE = 1e-2  # estimates are differences of states, which rounding moves by a share of them
ABOUT = 0.1  # steps, of many of which one more may be taken elsewhere
SOLID, OTHER = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1), mb.Cosserat(E=60, nu=0.2, beta=0.7, ell=0.2)
PLANE, SECOND, CYLINDER = mb.HalfPlane(SOLID), mb.HalfPlane(OTHER), mb.Cylinder(10)
PERIOD, WAVE, ROUGH = mb.HalfPlane(SOLID, 1.0), mb.Wave(0.01, 1.0), mb.Rough(1.0, 0.1, waves=(2, 8), seed=3)
BLOCKS, LINE, CLAMPED, TURNED = mb.Microblock(), mb.Unilateral(), mb.Microclamped(), mb.Microblock(0.004)
LEVERS, ANGLE = (mb.Microblock(0.004, psi0_in="levers"), mb.Microblock(given.FUNCTIONS["slow wave"]))
SHAPES = {name: given.FUNCTIONS[name] for name in ("two bumps", "tip", "skew wedge")}
SHAPES |= {"wedge": mb.Wedge(0.02), "punch": mb.Punch(0.4), "tilted": mb.Punch(0.4, tilt=0.005)}
PLACES = np.array([-0.31, -0.17, 0.03, 0.12, 0.26, 0.36])
SLAB = mb.Body(library.mesh_of("block"), SOLID, 2, fixed="bottom")
FEW, SHEARED = mb.Cells(nodes=64, window=(-0.8, 0.8)), [(1.0, 0.0), (1.0, 0.2), (0.8, -0.1)]
RUB, RUBS = mb.Unilateral(friction=0.3), mb.Microblock(friction=0.3)

IN_THE_PLANE = {  # to an accuracy
    **{
        f"panels {law}": (PLANE, CYLINDER, law, None, 1e-3) for law in (BLOCKS, LINE, CLAMPED, TURNED, LEVERS)
    },
    "panels angle": (PLANE, CYLINDER, ANGLE, None, 1e-3),
    **{f"panels {name}": (PLANE, shape, TURNED, None, 1e-3) for name, shape in SHAPES.items()},
    **{f"line {name}": (PLANE, shape, LINE, None, 1e-3) for name, shape in SHAPES.items()},
    **{
        f"two {law}": (PLANE, mb.Deformable(SECOND, CYLINDER), law, None, 1e-3)
        for law in (TURNED, LINE, CLAMPED)
    },
    **{
        f"cells {law}": (PLANE, SHAPES["two bumps"], law, mb.Cells(), 5e-2) for law in (TURNED, LINE, CLAMPED)
    },
    **{f"waves {law}": (PERIOD, WAVE, law, None, 2e-2) for law in (TURNED, LINE, CLAMPED)},
    "rough": (PERIOD, ROUGH, BLOCKS, None, 5e-2),
}
ON_MESHES = {
    **{f"fitted {law}": (mb.Block(SOLID), CYLINDER, law, None, 1e-2) for law in (TURNED, LINE, CLAMPED)},
    "fitted wedge": (mb.Block(SOLID, 4.0), SHAPES["wedge"], BLOCKS, None, 1e-2),
    "fitted bumps": (mb.Block(SOLID, 4.0), SHAPES["two bumps"], BLOCKS, None, 2e-2),
    **{f"body {law}": (SLAB, CYLINDER, law, None, 5e-2) for law in (TURNED, LINE)},
    "half-space": (mb.HalfSpace(SOLID), mb.Sphere(10), TURNED, None, 0.1),
}
FIXED = {  # on nodes that are given
    "panels": (PLANE, CYLINDER, TURNED, mb.Panels(order=6)),
    "punch": (PLANE, mb.Punch(0.3), LINE, mb.Panels(order=6)),
    "cells": (PLANE, CYLINDER, LEVERS, FEW),
    "two": (PLANE, mb.Deformable(SECOND, CYLINDER), CLAMPED, FEW),
    "period": (PERIOD, WAVE, TURNED, mb.Cells(nodes=64)),
    "body": (SLAB, CYLINDER, TURNED, None),
    "newton": (SLAB, CYLINDER, CLAMPED, mb.Newton()),
    "uniform": (mb.Block(SOLID, 4.0), SHAPES["skew wedge"], BLOCKS, mb.Uniform(h=0.2, order=2)),
    "half-space": (mb.HalfSpace(SOLID), mb.Sphere(10), TURNED, mb.Cells(nodes=32)),
}
PATHS = {
    "panels": (PLANE, CYLINDER, TURNED, None, 1e-3),
    "bumps": (PLANE, SHAPES["two bumps"], BLOCKS, None, 1e-3),
    "line": (PLANE, lambda x: x**2 / 20 - 0.0011 * np.exp(-(((x - 0.45) / 0.05) ** 2)), LINE, None, 1e-3),
    "fitted": (mb.Block(SOLID, 4.0), CYLINDER, BLOCKS, None, 2e-2),
    "body": (SLAB, SHAPES["two bumps"], BLOCKS, None, None),
}
HISTORIES = {
    "panels": (PLANE, mb.Deformable(PLANE, CYLINDER), RUB, mb.Panels(), 0.02),
    "cells": (PLANE, CYLINDER, RUBS, None, 0.1),
    "wedge": (PLANE, SHAPES["wedge"], RUB, None, 0.1),
    "body": (SLAB, CYLINDER, RUBS, None, None),
}


def to_rtol(states):
    for name, (*parts, rtol) in states.items():
        yield from of_state(f"to rtol {name}", mb.Contact(*parts).solve(1.0, rtol=rtol))


def on_nodes():
    """Rows of states, what they say in words, and their figures."""
    for name, parts in FIXED.items():
        state = mb.Contact(*parts).solve(1.0)
        yield from of_state(f"on nodes {name}", state, "discrete")
        for part in (state, state.problem, state.problem.body, state.law):
            yield f"on nodes {name} {type(part).__name__} in words", words(part), "outcome"
        yield from of_figure(f"on nodes {name} figure", state.plot())
        for field in ("psi", "s22", "shear") if name in ("panels", "body") else ():
            yield from of_figure(f"on nodes {name} {field}", state.plot_below(field))


def on_the_way():
    """Rows of load paths and histories."""
    for name, (*parts, rtol) in PATHS.items():
        path = mb.Contact(*parts).path(1.0, rtol=rtol)
        yield f"path {name} first", path.first, "estimated", CLOSE / 10
        for number, event in enumerate(path.events):
            yield f"path {name} event {number}", f"{event.kind} {event.zone}", "outcome"
            for part in ("load", "load_error", "x"):
                yield of(f"path {name} event {number} {part}", getattr(event, part))
    for name, (*parts, rtol) in HISTORIES.items():
        history = mb.Contact(*parts).history(SHEARED, rtol=rtol)
        for number, state in enumerate(history.states):
            yield from of_state(f"history {name} state {number}", state)
        for number, event in enumerate(history.events):
            yield f"history {name} event {number} kind", event.kind, "outcome"
            yield of(f"history {name} event {number} shear", event.shear)


def of(name, value, kind="doubt", tolerance=CLOSE):
    return (
        (name, value, "outcome")
        if value is None or isinstance(value, str)
        else (name, value, kind, tolerance)
    )


def of_state(name, state, kind="estimated"):
    """Rows of counts, of estimates, and of what is read between nodes."""
    tolerance = 1e-3 if kind == "estimated" else 1e-9
    yield f"{name} unknowns", state.unknowns, "outcome"
    yield f"{name} method", state.method, "outcome"
    yield f"{name} warnings number", len(state.warnings), "outcome"
    yield of(f"{name} iterations", state.iterations, tolerance=ABOUT)
    yield of(f"{name} error_estimate", state.error_estimate)
    for part, value in vars(state.error_parts or object).items() if state.error_parts else ():
        yield of(f"{name} {part}", value)
    for part in ("load", "approach", "energy", "contact_area", "dissipation", "work", "tangential_approach"):
        yield of(f"{name} {part}", getattr(state, part), kind, tolerance)
    for zone, own in (state.zones or {}).items():
        yield f"{name} {zone} number", len(own), "outcome"
        yield of(f"{name} {zone} edges", np.sum(own), kind, tolerance)
    for zone, errors in (state.zone_errors or {}).items():
        yield of(f"{name} {zone} errors", None if errors is None else np.sum(errors))
    if state.flat:
        yield of(f"{name} pressures", PLACES**2 @ state.pressure_at(PLACES), kind, tolerance)
        yield of(f"{name} micromoments", PLACES**3 @ state.micromoment_at(PLACES), kind, tolerance)
        for corner in state.law.corners:
            gaps = np.where(np.isfinite(state.gap_at(corner, PLACES)), state.gap_at(corner, PLACES), 0.0)
            yield of(f"{name} gaps {corner}", PLACES**3 @ gaps, kind, tolerance)


def words(thing):
    """What something says of itself, without marks."""
    table = thing._repr_html_() if hasattr(thing, "_repr_html_") else ""
    return f"{thing!r} " + " ".join(html.unescape(re.sub("<[^>]+>", " ", table)).split())


def of_figure(name, drawing):
    """Rows of the limits, ticks, texts, lines and collections of a figure."""
    for number, axis in enumerate(drawing.axes):
        where = f"{name} {number}"
        yield f"{where} texts", " | ".join(text.get_text() for text in axis.texts), "outcome"
        yield (
            f"{where} labels",
            f"{axis.get_xlabel()} | {axis.get_ylabel()} | {axis.get_title('left')}",
            "outcome",
        )
        yield of(
            f"{where} limits", np.dot((1, 2, 3, 4), (*axis.get_xlim(), *axis.get_ylim())), "discrete", 1e-9
        )
        yield of(f"{where} ticks", np.sum(axis.get_yticks()), "discrete", 1e-9)
        for line, own in enumerate(axis.lines):
            points = np.nan_to_num(np.array(own.get_data(), float))
            yield (
                f"{where} line {line} is",
                f"{own.get_label()} {own.get_color()} {own.get_linestyle()}",
                "outcome",
            )
            yield of(f"{where} line {line}", np.sum(points @ np.arange(points.shape[1])), "discrete", 1e-9)
        for number, own in enumerate(axis.collections):
            points = np.concatenate([path.vertices for path in own.get_paths()] or [np.zeros((0, 2))])
            yield f"{where} collection {number} faces", len(np.unique(own.get_facecolor(), axis=0)), "outcome"
            yield of(f"{where} collection {number}", np.sum(points), "discrete", 1e-9)
