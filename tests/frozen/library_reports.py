"""What states, paths and histories say of themselves: estimates and their parts, counts, tables, figures."""

import html
import os
import re
import tempfile
from dataclasses import replace
from itertools import product
from unittest.mock import patch

import meshio
import numpy as np

import microblock as mb
from microblock import command, cost
from microblock.fem import meshes, meshes3d
from microblock.halfplane import zone_search
from microblock.halfplane.first_zones import first_zones
from microblock.model import contact_candidates, intervals
from microblock.model.piecewise_chebyshev import proxy
from microblock.model.problem import Problem
from microblock.view import blocks
from tests.parts import BLOCKS, CLAMPED, CYLINDER, SOLID, UNILATERAL

from . import library
from . import problems as given

DOUBT = "doubt", 1e-2  # estimates are differences of states, which rounding moves by a share of them
STEPS = "doubt", 0.1  # of many of which one more may be taken elsewhere
FIXED = ("discrete", 1e-9)
CLOSE = ("estimated", 1e-6)
READ = ("estimated", 1e-3)
OTHER = mb.Cosserat(E=60, nu=0.2, beta=0.7, ell=0.2)
PLANE = mb.HalfPlane(SOLID)
SECOND = mb.HalfPlane(OTHER)
PERIOD = mb.HalfPlane(SOLID, 1.0)
WAVE = mb.Wave(0.01, 1.0)
ROUGH = mb.Rough(1.0, 0.1, waves=(2, 8), seed=3)
TURNED = mb.Microblock(0.004)
LEVERS = mb.Microblock(0.004, psi0_in="levers")
ANGLE = mb.Microblock(given.FUNCTIONS["slow wave"])
SHAPES = {name: given.FUNCTIONS[name] for name in ("two bumps", "tip", "skew wedge")}
SHAPES |= {"wedge": mb.Wedge(0.02), "punch": mb.Punch(0.4), "tilted": mb.Punch(0.4, tilt=0.005)}
PLACES = np.array([-0.31, -0.17, 0.03, 0.12, 0.26, 0.36])
GRADES = meshes3d.graded(reach=0.6, step=0.2, far=2.0, growth=2.0)
IN_A_CUBE = mb.Body(meshes3d.block(GRADES, GRADES, -GRADES[::-1], reach=0.6), SOLID, 1, fixed="bottom")
SLAB = mb.Body(library.mesh_of("block"), SOLID, 2, fixed="bottom")
FEW = mb.Cells(nodes=64, window=(-0.8, 0.8))
SHEARED = [(1.0, 0.0), (1.0, 0.2), (0.8, -0.1)]
RUB = mb.Unilateral(friction=0.3)
RUBS = mb.Microblock(friction=0.3)


def _hills(x1, x2):
    return (x1**2 + (x2 - 0.1) ** 2) / 10 + 0.01 * np.cos(9 * x1) * np.cos(7 * x2)


TO_RTOL = {
    **{
        f"panels {law}": (PLANE, CYLINDER, law, mb.Panels(), 1e-3)
        for law in (BLOCKS, UNILATERAL, CLAMPED, TURNED, LEVERS)
    },
    "panels angle": (PLANE, CYLINDER, ANGLE, mb.Panels(), 1e-3),
    **{f"panels {name}": (PLANE, shape, TURNED, mb.Panels(), 1e-3) for name, shape in SHAPES.items()},
    **{f"line {name}": (PLANE, shape, UNILATERAL, mb.Panels(), 1e-3) for name, shape in SHAPES.items()},
    **{
        f"two {law}": (PLANE, mb.Deformable(SECOND, CYLINDER), law, mb.Panels(), 1e-3)
        for law in (TURNED, UNILATERAL, CLAMPED)
    },
    **{
        f"cells {law}": (PLANE, SHAPES["two bumps"], law, mb.Cells(), 5e-2)
        for law in (TURNED, UNILATERAL, CLAMPED)
    },
    **{f"waves {law}": (PERIOD, WAVE, law, None, 2e-2) for law in (TURNED, UNILATERAL, CLAMPED)},
    "rough": (PERIOD, ROUGH, BLOCKS, None, 5e-2),
    **{
        f"fitted {law}": (mb.Block(SOLID), CYLINDER, law, None, 1e-2) for law in (TURNED, UNILATERAL, CLAMPED)
    },
    "fitted wedge": (mb.Block(SOLID, 4.0), SHAPES["wedge"], BLOCKS, None, 1e-2),
    "fitted bumps": (mb.Block(SOLID, 4.0), SHAPES["two bumps"], BLOCKS, None, 2e-2),
    **{f"body {law}": (SLAB, CYLINDER, law, None, 5e-2) for law in (TURNED, UNILATERAL)},
    "half-space": (mb.HalfSpace(SOLID), mb.Sphere(10), TURNED, None, 0.1),
    "half-space hills": (mb.HalfSpace(SOLID), _hills, UNILATERAL, None, 0.1),
    "half-space cone": (mb.HalfSpace(SOLID), mb.Cone(0.1), CLAMPED, None, 0.1),
}
ON_NODES = {
    "panels": (PLANE, CYLINDER, TURNED, mb.Panels(order=6)),
    "punch": (PLANE, mb.Punch(0.3), UNILATERAL, mb.Panels(order=6)),
    "cells": (PLANE, CYLINDER, LEVERS, FEW),
    "punch on cells": (PLANE, mb.Punch(0.3), TURNED, FEW),
    "punch on a body": (SLAB, mb.Punch(0.4), TURNED, None),
    "punch on a half-space": (mb.HalfSpace(SOLID), mb.FlatPunch(0.2), UNILATERAL, mb.Cells(32, (-0.4, 0.4))),
    "two": (PLANE, mb.Deformable(SECOND, CYLINDER), CLAMPED, FEW),
    "period": (PERIOD, WAVE, TURNED, mb.Cells(nodes=64)),
    "body": (SLAB, CYLINDER, TURNED, None),
    "newton": (SLAB, CYLINDER, CLAMPED, mb.Newton()),
    "uniform": (mb.Block(SOLID, 4.0), SHAPES["skew wedge"], BLOCKS, mb.Uniform(h=0.2, order=2)),
    "half-space": (mb.HalfSpace(SOLID), mb.Sphere(10), TURNED, mb.Cells(nodes=32)),
    "in space": (IN_A_CUBE, mb.Sphere(10), TURNED, None),
}
BROAD = ((-0.6, 0.6),)
NARROW = ((-0.05, 0.06),)
TWO = ((-0.36, -0.2), (0.15, 0.4))
TRIALS = {  # obstacle, law, zones of all corners or of each
    "broad": ("cylinder", TURNED, BROAD),
    "narrow": ("cylinder", BLOCKS, NARROW),
    "two": ("cylinder", UNILATERAL, TWO),
    "crossed": ("cylinder", TURNED, TWO, NARROW),
    "one for two": ("two bumps", TURNED, BROAD),
    "two bumps": ("two bumps", UNILATERAL, TWO),
    "left alone": ("two bumps", BLOCKS, TWO[:1]),
    "tip": ("tip", UNILATERAL, BROAD),
    "kink": ("skew wedge", TURNED, NARROW),
    "punch": ("tilted", TURNED, BROAD),
}
PROXIES = {
    "waves": lambda x: np.cos(9 * x) + 0.1 * x**2,
    "corners": lambda x: np.abs(np.sin(3 * x)) + x,
    "root": lambda x: np.sqrt(np.abs(x - 0.3)),
    "step": lambda x: x + (x > 0.7),
    "pit": lambda x: x**2 - 0.1 * np.exp(-(((x - 0.5) / 0.01) ** 2)),
    "ends": lambda x: np.where(np.abs(x - 0.4) < 0.9, x**2, np.inf),
    "curved": lambda x: np.abs(x - 0.2) ** 1.5 + np.maximum(x - 1, 0) ** 2,
}
ORDERS = (1, 2, 4)
IN_SPACE = {
    "sphere": mb.Sphere(10),
    "ellipsoid": mb.Ellipsoid(5.0, 20.0),
    "cone": mb.Cone(0.1),
    "punch": mb.FlatPunch(0.2),
    "hills": _hills,
}
WARNED = {  # with loads at which something is to be said
    "bump between nodes": (
        SLAB,
        lambda x: x**2 / 20 - 0.004 * np.exp(-(((x - 0.05) / 0.02) ** 2)),
        TURNED,
        None,
    ),
    "valley": (SLAB, mb.Obstacle(lambda x: x**2 - 0.02 * np.abs(x - 0.03), kinks=(0.03,)), UNILATERAL, None),
    "wedge": (SLAB, SHAPES["wedge"], BLOCKS, None),
    "bumps": (SLAB, SHAPES["two bumps"], UNILATERAL, None),
    "samples": (
        SLAB,
        mb.Obstacle.from_samples(np.linspace(-1, 1, 41), np.linspace(-1, 1, 41) ** 2),
        TURNED,
        None,
    ),
    "thin layers": (SLAB.of(mb.Cosserat(E=100, nu=0.4995, beta=1, ell=0.004)), CYLINDER, BLOCKS, None),
    "rough": (PERIOD, mb.Rough(1.0, 0.2, waves=(2, 30), seed=1), BLOCKS, mb.Cells(nodes=64)),
    "samples on cells": (
        PLANE,
        mb.Obstacle.from_samples([-1, -0.1, 0.2, 1], [0.05, 0, 0.001, 0.04]),
        UNILATERAL,
        FEW,
    ),
    "bumps on elements": (
        mb.Block(SOLID, 4.0),
        SHAPES["two bumps"],
        BLOCKS,
        mb.Uniform(h=0.2, reach=0.8, order=1),
    ),
    "pins": (mb.HalfSpace(SOLID), _hills, TURNED, mb.Cells(32, (-0.25, 0.25))),
}
PATHS = {
    "panels": (PLANE, CYLINDER, TURNED, None, 1e-3),
    "bumps": (PLANE, SHAPES["two bumps"], BLOCKS, None, 1e-3),
    "line": (
        PLANE,
        lambda x: x**2 / 20 - 0.0011 * np.exp(-(((x - 0.45) / 0.05) ** 2)),
        UNILATERAL,
        None,
        1e-3,
    ),
    "twins": (PLANE, lambda x: x**2 / 20 - 4e-4 * np.cos(25 * (x - 2e-7)), UNILATERAL, None, 1e-3),
    "fitted": (mb.Block(SOLID, 4.0), CYLINDER, BLOCKS, None, 2e-2),
    "body": (SLAB, SHAPES["two bumps"], BLOCKS, None, None),
}
HISTORIES = {
    "panels": (PLANE, mb.Deformable(PLANE, CYLINDER), RUB, mb.Panels(), 0.02),
    "cells": (PLANE, CYLINDER, RUBS, None, 0.1),
    "wedge": (PLANE, SHAPES["wedge"], RUB, None, 0.1),
    "body": (SLAB, CYLINDER, RUBS, None, None),
}


def table(where, values, kind=FIXED):
    """Rows of texts as they are, and of numbers, all of which weigh in a sum."""
    for part, value in values.items():
        text = value is None or isinstance(value, str)
        yield (f"{where} {part}", value, "outcome") if text else (f"{where} {part}", ramp(value), *kind)


def ramp(values):
    """A sum in which every finite number has a share of its own."""
    numbers = np.ravel(values).astype(float)
    return float(np.where(np.isfinite(numbers), numbers, 0.0) @ np.linspace(1, 2, len(numbers)))


def words(thing):
    """What something says of itself, without marks."""
    marked = thing._repr_html_() if hasattr(thing, "_repr_html_") else ""
    return f"{thing!r} " + " ".join(html.unescape(re.sub("<[^>]+>", " ", marked)).split())


def of_state(name, state, kind=READ):
    """Rows of counts, of estimates, and of what is read between nodes."""
    error_parts = vars(state.error_parts) if state.error_parts else {}
    zone_errors = {zone: errors and np.sum(errors) for zone, errors in (state.zone_errors or {}).items()}
    forces = ["load", "approach", "energy", "contact_area", "dissipation", "work", "tangential_approach"]
    numbers = {part: getattr(state, part) for part in forces} | dict(state.zones or {})
    if state.flat:
        at = {f"gap {corner}": state.gap_at(corner, PLACES) for corner in state.law.corners}
        numbers |= {"pressures": state.pressure_at(PLACES), "moments": state.micromoment_at(PLACES), **at}
    sizes = [state.unknowns, *map(len, (state.zones or {}).values())]
    texts = {"method": f"{state.method} {sizes}", "warnings": " | ".join(state.warnings)}
    yield from table(name, texts | numbers, kind)
    yield from table(name, {"error": state.error_estimate, **error_parts}, DOUBT)
    yield from table(f"{name} error of", zone_errors, DOUBT)
    yield from table(name, {"iterations": state.iterations}, STEPS)


def of_files(name, state):
    """Rows of the numbers in what is written for other programs."""
    with tempfile.TemporaryDirectory() as folder:
        for file in mb.to_vtk(state, f"{folder}/state"):
            mesh = meshio.read(file)
            cells = {"cells": " ".join(f"{len(block.data)} {block.type}" for block in mesh.cells)}
            yield from table(f"{name} {file.stem}", cells | {"points": mesh.points} | mesh.point_data, CLOSE)


def of_figure(name, drawing, kind=FIXED):
    """Rows of the limits, ticks, texts, lines, images and collections of a figure."""
    for number, axis in enumerate(drawing.axes):
        texts = axis.get_xlabel(), axis.get_ylabel(), axis.get_title("left"), *axis.texts
        numbers = {
            "texts": " | ".join(getattr(text, "get_text", text.__str__)() for text in texts),
            "looks": str(
                [(artist.get_label(), artist.get_color(), artist.get_linestyle()) for artist in axis.lines]
            ),
            "limits": (*axis.get_xlim(), *axis.get_ylim(), *axis.get_yticks()),
            **{f"line {i}": artist.get_xydata() for i, artist in enumerate(axis.lines)},
            **{
                f"image {i}": (ramp(artist.get_array()), artist.get_extent()[0])
                for i, artist in enumerate(axis.images)
            },
        }
        for i, artist in enumerate(axis.collections):
            shown = [path.vertices for path in artist.get_paths()] + [
                artist.get_offsets(),
                artist.get_facecolor(),
            ]
            values = [] if artist.get_array() is None else artist.get_array()
            numbers[f"collection {i}"] = np.concatenate([np.ravel(vertices) for vertices in (*shown, values)])
        yield from table(f"{name} {number}", numbers, kind)


def room_of(body):
    """The room that has the states of a body."""
    if isinstance(body, mb.HalfPlane):
        return "halfplane"
    if isinstance(body, mb.HalfSpace):
        return "halfspace"
    return "bodies3d" if body is IN_A_CUBE else "fem"


def computed(problems, begin, choice):
    """(how the rows of a problem begin, what it is) of those of the named problems that are computed."""
    named = {f"{begin}{name}": problem for name, problem in problems.items()}
    names = choice.named({name: traits_of(*problem[:4]) for name, problem in named.items()})
    return ((name, *named[name]) for name in names)


def traits_of(body, obstacle, law, method):
    """What a problem shows: its bodies, its obstacle, and its law with its method."""
    kinds = {type(body).__name__, f"{type(law).__name__} {type(method).__name__}"}
    shape = obstacle
    if isinstance(obstacle, mb.Deformable):
        kinds.add(f"second {type(obstacle.body).__name__}")
        shape = obstacle.shape
    return kinds | {type(shape).__name__}


def of_room(problems, room, begin, choice):
    """Those of the named problems whose body belongs to a room, as of `computed`."""
    of_bodies = {name: problem for name, problem in problems.items() if room_of(problem[0]) == room}
    return computed(of_bodies, begin, choice)


def reports(room, choice):
    """Rows of what the states and load paths of a room say of themselves."""
    for name, *problem, rtol in of_room(TO_RTOL, room, "to rtol ", choice):
        yield from of_state(name, mb.Contact(*problem).solve(1.0, rtol=rtol))
    for name, *problem in of_room(WARNED, room, "warned ", choice):
        for load in (1.0, 0.05):
            state = mb.Contact(*problem).solve(load)
            yield from of_state(f"{name} {load}", state, FIXED)
            yield from table(f"{name} {load}", {"words": words(state)})
    for name, *problem in of_room(ON_NODES, room, "", choice):
        yield from of_shown_state(name, mb.Contact(*problem).solve(1.0))
    for name, *problem, rtol in of_room(PATHS, room, "path ", choice):
        yield from of_path(name, mb.Contact(*problem).path(1.0, rtol=rtol))


def of_shown_state(name, state):
    """Rows of a state, what it says in words, its figures and its files."""
    yield from of_state(name, state, FIXED)
    shown = state, state.problem, state.problem.body, state.law
    texts = {type(part).__name__: words(part) for part in shown}
    yield from table(f"{name} in words", texts | {"caption": state.caption})
    yield from of_figure(f"{name} figure", state.plot())
    yield from of_files(f"{name} file", state)
    for field in ("psi", "s22", "shear") if name in ("panels", "body") else ():
        yield from of_figure(f"{name} {field}", state.plot_below(field))
    if name == "half-space":
        yield from of_figure(f"{name} blocks", state.plot_blocks())


def of_path(name, path):
    """Rows of a load path and its events, and of the first one its figure, which solves 24 states."""
    events = path.events
    if name == "path panels":
        yield from of_figure(f"{name} figure", path.plot(), READ)
    yield from table(name, {"words": words(path), "first": path.first}, READ)
    for number, event in enumerate(events):
        row = f"{name} event {number}"
        yield from table(row, {part: getattr(event, part) for part in ("kind", "zone", "load", "x")}, DOUBT)
        # of rounding there is half of it, or twice as much
        tolerance = 1e-2 if event.load_error > 1e-7 else 1.0
        yield f"{row} load_error", event.load_error, "doubt", tolerance


def histories(choice):
    """Rows of histories, the estimates of their states and their events."""
    for name, *problem, rtol in computed(HISTORIES, "history ", choice):
        history = mb.Contact(*problem).history(SHEARED, rtol=rtol)
        yield from of_figure(f"{name} figure", history.plot(), READ)
        for number, state in enumerate(history.states):
            yield from of_state(f"{name} state {number}", state)
        for number, event in enumerate(history.events):
            numbers = {part: getattr(event, part) for part in ("kind", "shear", "load")}
            yield from table(f"{name} event {number}", numbers, DOUBT)


def seen(name, law, load=1.0):
    """The Problem of one of SHAPES with its picture."""
    problem = Problem(SOLID, law, (SHAPES | {"cylinder": CYLINDER})[name])
    return replace(problem, candidates=contact_candidates.find_candidates(problem, load))


def candidates_in_the_plane():
    """Rows of what is seen of obstacles in the plane before anything is solved."""
    laws = (TURNED, 1.0), (ANGLE, 1.0), (UNILATERAL, 1.0), (TURNED, 1e-4)  # over less than a block at last
    for name, (number, (law, load)) in product(SHAPES, enumerate(laws)):
        problem = seen(name, law, load)
        first = next(first_zones(problem, load))
        attributes = {part: getattr(problem.candidates, part) for part in ("half_width", "lengths", "edges")}
        attributes["sites"] = problem.candidates.sample_points
        attributes["lengths"] = attributes["lengths"][:-1]  # behind the last edge it is inf
        kinks = [(x, jump) for x, jumps in problem.kinks.items() for jump in jumps.values()]
        counts = (
            f"{[np.size(zones) for zones in attributes.values()]} {len(kinks)} {[*map(len, first.values())]}"
        )
        numbers = {
            "stretches": problem.stretches,
            "scale": problem.scale(0.1, 0.2),
            "sites of the last corner": problem.sample_points(len(law.corners) - 1),
            "kinks": kinks,
            "ends": [problem.ends_of(corner) for corner in problem.corners],
            "first zones": [edge for zones in first.values() for edge in np.ravel(zones)],
        }
        yield from table(f"seen {name} {number}", {"counts": counts} | attributes | numbers, CLOSE)


def candidates_in_space(choice):
    """Rows of what is seen of obstacles over a surface before anything is solved."""
    laws = (TURNED, None), (UNILATERAL, None), (TURNED, (-0.5, 0.5))
    levels = (1.0, None), (None, 0.02)
    asked = {
        f"seen {name} {law.corners[0]} {window} {level[0]}": (name, law, window, level)
        for name, (law, window), level in product(IN_SPACE, laws, levels)
    }
    traits = {
        row: {name, f"{law.corners[0]} {window}", level} for row, (name, law, window, level) in asked.items()
    }
    for row in choice.named(traits):
        name, law, window, (load, approach) = asked[row]
        contact = mb.Contact(mb.HalfSpace(SOLID), IN_SPACE[name], law, mb.Cells(nodes=32, window=window))
        squares = contact.solver.candidates(load, approach, contact.solver.given_window())
        numbers = {part: getattr(squares, part) for part in ("bound", "radius", "valleys", "lowest")}
        numbers |= {
            "samples": np.sort(squares.samples_below(squares.bound)[:, :2], axis=0),
            "separate": np.unique(np.round(squares.separate_valleys(squares.bound), 6), axis=0),
        }
        yield from table(row, numbers, CLOSE)


def trials():
    """Rows of single steps of the search for zones, from zones that are wrong."""
    for name, (shape, law, *wrong) in TRIALS.items():
        problem = seen(shape, law)
        start = dict(enumerate(wrong * len(problem.corners) if len(wrong) == 1 else wrong))
        for load in (1.0, 0.1):
            try:
                state = zone_search.newton_zone_edges(problem, load, start, 8, 1e-4)
            except mb.NotConverged as failure:
                yield f"trial {name} {load} fails", f"{failure} in {failure.iterations}", "outcome"
                continue
            violations_found = zone_search.contact_violations(state)
            amended = zone_search.amended(state, violations_found, 1e-6) or {}
            counts = state.iterations, len(violations_found)
            violation = {"zones": state.zones, "further": state.next_zones, "amended": amended}
            places = {
                part: [edge for violation in zones.values() for edge in np.ravel(violation)]
                for part, zones in violation.items()
            }
            violations = [
                (violation.corner, violation.left, violation.right, violation.depth)
                for violation in violations_found
            ]
            places |= {
                "violations": violations,
                "worth": np.linalg.norm([violation.worth for violation in violations_found]),
            }
            yield from table(f"trial {name} {load}", {"counts": str(counts)} | places, READ)
            yield from table(f"trial {name} {load}", {"share of edges": state.estimate.edges}, DOUBT)


def first_cells(law, count):
    """First zones of an obstacle over so many stretches of 48 cells."""
    problem = Problem(SOLID, law, lambda x: 0.01 * np.sin(np.pi * x) ** 2)
    stretches = tuple((place - 0.1, place + 0.1) for place in range(count))
    wide = replace(problem, candidates=contact_candidates.candidates_within(problem, stretches, 0.1, 0.01))
    return lambda: next(first_zones(wide, 0.1))


def solve(load: float, nodes=4, names: tuple[str, ...] = (), window: tuple[float, float] | None = None):
    """Computes.

    load : it
        goes on
    nodes, names : both
    """


def parts():
    """Rows of functions that take numbers and give numbers or words: samples, intervals, meshes, bytes."""
    yield from of_sampled_functions()
    for half, tips in ((True, (0.3,)), (False, (-0.2, 0.3))):
        ground = meshes.Ground(far=4.0, reach=(0.0, 0.5) if half else (-0.6, 0.5), half=half)
        yield from of_meshes(half, tips, ground)
    yield from table("of numbers", numbers_of_functions())
    texts = texts_of_intervals() | texts_of_functions()
    yield from table("in words", {name: str(value) for name, value in texts.items()})
    yield from trials()


def of_sampled_functions():
    """Rows of heights where they are sampled, and of piecewise polynomials of functions."""
    for name, shape in SHAPES.items():
        x, heights = contact_candidates._everywhere(shape, 1e-4, 24, 1e4, (0.0,))
        yield from table(f"places {name}", {"count": str(len(x)), "x": np.tanh(x), "h": np.tanh(heights)})
    for name, function in PROXIES.items():
        approximation = proxy(function, np.linspace(-1, 2, 13), 1e-9)
        properties = {
            part: np.asarray(value)
            for part, value in (approximation._asdict() | {"lengths": approximation.lengths[:-1]}).items()
        }
        sizes = {"sizes": str({part: len(value) for part, value in properties.items()})}
        yield from table(f"proxy {name}", sizes | properties, READ)


def of_meshes(half, tips, ground):
    """Rows of meshes that are graded towards tips, and of uniform ones."""
    finer = ((0.0, 0.2, 0.02), (0.2, 0.5, 0.1))
    graded = {
        "even": meshes.fitted_triangles(ground, tips, spacings=((*ground.reach, 0.1),), levels=3),
        "finer": meshes.fitted_triangles(ground, tips, spacings=finer, levels=3, sizes=((0.4, 0.01),)),
    }
    for name, mesh in graded.items():
        orders = meshes.falling_orders(mesh, ground, tips, 7)
        yield f"mesh {half} {name}", f"{mesh.ne} {mesh.nv} {np.bincount(orders).tolist()}", "outcome"
    for quads in (True, False):
        mesh = meshes.uniform(ground, 0.15, quads)
        properties = {"points": [vertex.point for vertex in mesh.vertices], "sizes": f"{mesh.ne} {mesh.nv}"}
        above = mesh.Boundaries("contact")
        properties["depths"] = meshes.elements_at(mesh, above), meshes.thicknesses(mesh, above)
        yield from table(f"mesh {half} {quads}", {"names": str(mesh.GetBoundaries())} | properties)


def numbers_of_functions():
    """{function: its values} of lengths of elements, bytes of matrices, windows of pictures."""
    return {
        "longest element": [meshes.longest_element(SOLID, order) for order in ORDERS],
        "grades": meshes3d.graded(reach=0.7, step=0.15, far=3.0, growth=1.7),
        "lines": meshes.uniform_lines(0.5, 4.0, 0.12),
        "bytes": (cost.plane_factor_bytes(1000, 50000), cost.dense_bytes(100)),
        "magnified": [
            blocks.magnification(*arguments)
            for arguments in ((0, 0), (0.1, 0.01), (0.001, 0.3), (1e-5, 1e-6))
        ],
        "window": [
            blocks.window(0.1, arguments) for arguments in ([], [(-0.3, 0.2)], [(-9.0, 1.0), (2.0, 3.0)])
        ],
    }


def texts_of_intervals():
    """{function: its values as text} of the arithmetic of intervals."""
    pairs = [(-1.0, 0.0), (0.25, 0.5), (0.5, 1.0)]
    shifted_pairs = [(-1.5, -0.5), (0.0, 0.25), (0.75, 2.0)]
    near = [(left + 0.01, right + 0.02) for left, right in pairs]
    x = np.linspace(-1, 1, 9)
    flags = np.array([0, 1, 0, 0, 1, 1, 0, 1], bool)
    return {
        "over the end": [
            intervals.over_the_end(pairs[:n], period) for n in (2, 3) for period in (None, 1.5, 2.0)
        ],
        "joined": [intervals.joined(reversed(pairs), slack) for slack in (0.0, 0.2, 0.25)],
        "without": [intervals.without(pairs, *arguments) for arguments in shifted_pairs],
        "common": intervals.common(pairs, shifted_pairs),
        "changes": [
            intervals.zone_changes(*arguments)
            for arguments in ((pairs, shifted_pairs), (shifted_pairs, pairs), (pairs, pairs))
        ],
        "contains": intervals.contains(shifted_pairs, x).tolist(),
        "interrupted": intervals.in_interruption(x, flags, np.linspace(-1.1, 1.1, 12)).tolist(),
        "runs": np.array(intervals.runs(flags)).tolist(),
        "contact zones": intervals.contact_zones({0: pairs, 1: shifted_pairs}, "AB"),
        "edges": intervals.zone_edges({0: pairs, 1: shifted_pairs}),
        "distance": intervals.distance_to_ends(x, (-0.5, 1.0), (0.1, -0.1)).round(12).tolist(),
        "moved": [intervals.moved_on({0: pairs}, {0: near}, share) for share in (0.5, 2.0, 2.1, -2.1)],
        "moved of others": intervals.moved_on({0: pairs}, {0: shifted_pairs[:2]}, 0.5),
    }


def texts_of_functions():
    """{function: its values as text} of what is said of solids, samples, options, costs and docstrings."""
    stiff = mb.Cosserat(E=100, nu=0.499, beta=1, ell=0.1)
    low, same, higher = (mb.Obstacle.from_samples([0, 1], [0, z]) for z in (1, 1.0, 2))
    texts = {
        "locking": [meshes.locking(stiff, order, 0.3, 0.4) for order in ORDERS],
        "elastic": words(mb.Elastic(100, 0.3)),
        "alike": [low == same, hash(low) == hash(same), low == higher, low == "x"],
        "options": [
            (option.name, option.kind.__name__, option.many, option.text)
            for option in command.options(solve).values()
        ],
        "first cells": [
            library.refused(first_cells(*arguments))
            for arguments in ((UNILATERAL, 42), (UNILATERAL, 3), (BLOCKS, 21), (BLOCKS, 3))
        ],
    }
    with patch.object(cost, "available", lambda: 8e9), patch.dict(os.environ, COLUMNS="32"):
        histories = [lambda n=n: cost.require_history(9, 3000, n) for n in (1, 10**6)]
        texts["histories"] = [library.refused(history) for history in histories]
        head = "A head of ``x`` that goes on, and on."
        item = "label  its words, of which some\nare many more"
        texts["help"] = command._plain(f"{head}\n\n{item}\n:of: :math:`y` alone")
    return texts
