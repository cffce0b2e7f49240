"""What states, paths and histories say of themselves: estimates and their parts, counts, tables, figures."""

import html
import re
import tempfile
from dataclasses import replace
from unittest.mock import patch

import numpy as np
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

import microblock as mb
from microblock import cost
from microblock.fem import meshes, meshes3d
from microblock.halfplane.edges import fit
from microblock.halfplane.first_zones import first_zones
from microblock.halfplane.search import amended
from microblock.halfplane.survey import survey
from microblock.model.picture import _everywhere, picture
from microblock.model.problem import Problem
from microblock.model.proxy import proxy
from microblock.model.zones import (
    common,
    contains,
    distance_to_ends,
    interrupted,
    joined,
    moved_on,
    over_the_end,
    runs,
    without,
    zone_changes,
)
from microblock.view import blocks, surface_figure

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
GRADES = meshes3d.graded(reach=0.6, step=0.2, far=2.0, growth=2.0)
IN_A_CUBE = mb.Body(meshes3d.block(GRADES, GRADES, -GRADES[::-1], reach=0.6), SOLID, 1, fixed="bottom")
SLAB = mb.Body(library.mesh_of("block"), SOLID, 2, fixed="bottom")
FEW, SHEARED = mb.Cells(nodes=64, window=(-0.8, 0.8)), [(1.0, 0.0), (1.0, 0.2), (0.8, -0.1)]
RUB, RUBS = mb.Unilateral(friction=0.3), mb.Microblock(friction=0.3)


def _hills(x1, x2):
    return (x1**2 + (x2 - 0.1) ** 2) / 10 + 0.01 * np.cos(9 * x1) * np.cos(7 * x2)


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
    "half-space hills": (mb.HalfSpace(SOLID), _hills, LINE, None, 0.1),
    "half-space cone": (mb.HalfSpace(SOLID), mb.Cone(0.1), CLAMPED, None, 0.1),
}
FIXED = {  # on nodes that are given
    "panels": (PLANE, CYLINDER, TURNED, mb.Panels(order=6)),
    "punch": (PLANE, mb.Punch(0.3), LINE, mb.Panels(order=6)),
    "cells": (PLANE, CYLINDER, LEVERS, FEW),
    "punch on cells": (PLANE, mb.Punch(0.3), TURNED, FEW),
    "punch on a body": (SLAB, mb.Punch(0.4), TURNED, None),
    "punch on a half-space": (mb.HalfSpace(SOLID), mb.FlatPunch(0.2), LINE, mb.Cells(32, (-0.4, 0.4))),
    "two": (PLANE, mb.Deformable(SECOND, CYLINDER), CLAMPED, FEW),
    "period": (PERIOD, WAVE, TURNED, mb.Cells(nodes=64)),
    "body": (SLAB, CYLINDER, TURNED, None),
    "newton": (SLAB, CYLINDER, CLAMPED, mb.Newton()),
    "uniform": (mb.Block(SOLID, 4.0), SHAPES["skew wedge"], BLOCKS, mb.Uniform(h=0.2, order=2)),
    "half-space": (mb.HalfSpace(SOLID), mb.Sphere(10), TURNED, mb.Cells(nodes=32)),
    "in space": (IN_A_CUBE, mb.Sphere(10), TURNED, None),
}
BROAD, NARROW, TWO = ((-0.6, 0.6),), ((-0.05, 0.06),), ((-0.36, -0.2), (0.15, 0.4))
TRIALS = {  # obstacle, law, zones of all corners or of each
    "broad": (CYLINDER, TURNED, BROAD),
    "narrow": (CYLINDER, BLOCKS, NARROW),
    "two": (CYLINDER, LINE, TWO),
    "crossed": (CYLINDER, TURNED, TWO, NARROW),
    "one for two": (SHAPES["two bumps"], TURNED, BROAD),
    "two bumps": (SHAPES["two bumps"], LINE, TWO),
    "left alone": (SHAPES["two bumps"], BLOCKS, TWO[:1]),
    "tip": (SHAPES["tip"], LINE, BROAD),
    "kink": (SHAPES["skew wedge"], TURNED, NARROW),
    "punch": (SHAPES["tilted"], TURNED, BROAD),
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
    "valley": (SLAB, mb.Obstacle(lambda x: x**2 - 0.02 * np.abs(x - 0.03), kinks=(0.03,)), LINE, None),
    "wedge": (SLAB, SHAPES["wedge"], BLOCKS, None),
    "bumps": (SLAB, SHAPES["two bumps"], LINE, None),
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
        LINE,
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
    "line": (PLANE, lambda x: x**2 / 20 - 0.0011 * np.exp(-(((x - 0.45) / 0.05) ** 2)), LINE, None, 1e-3),
    "twins": (
        PLANE,
        lambda x: np.minimum(x**2, (np.abs(x - 1e-6) - 0.45) ** 2 + 0.003) / 20,
        LINE,
        None,
        1e-3,
    ),
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


def warned():
    """Rows of states of which something is to be said, under two loads."""
    for name, parts in WARNED.items():
        for load in (1.0, 0.05):
            state = mb.Contact(*parts).solve(load)
            yield from of_state(f"warned {name} {load}", state, "discrete")
            yield f"warned {name} {load} in words", words(state), "outcome"


def on_nodes():
    """Rows of states, what they say in words, and their figures."""
    for name, parts in FIXED.items():
        state = mb.Contact(*parts).solve(1.0)
        yield from of_state(f"on nodes {name}", state, "discrete")
        yield f"on nodes {name} caption", state.caption, "outcome"
        for part in (state, state.problem, state.problem.body, state.law):
            yield f"on nodes {name} {type(part).__name__} in words", words(part), "outcome"
        yield from of_figure(f"on nodes {name} figure", state.plot())
        yield from of_files(f"on nodes {name} file", state)
        if name == "half-space":
            with patch.object(surface_figure, "Poly3DCollection", wraps=Poly3DCollection) as made:
                state.plot_blocks()
            faces = made.call_args
            yield of(f"on nodes {name} faces", ramp(faces.args[0]), "discrete", 1e-9)
            yield of(f"on nodes {name} colours", ramp(faces.kwargs["facecolors"]), "discrete", 1e-9)
        for field in ("psi", "s22", "shear") if name in ("panels", "body") else ():
            yield from of_figure(f"on nodes {name} {field}", state.plot_below(field))


def on_the_way():
    """Rows of load paths and histories."""
    for name, (*parts, rtol) in PATHS.items():
        path = mb.Contact(*parts).path(1.0, rtol=rtol)
        yield from of_figure(f"path {name} figure", path.plot(), CLOSE / 10)
        yield f"path {name} first", path.first, "estimated", CLOSE / 10
        for number, event in enumerate(path.events):
            yield f"path {name} event {number}", f"{event.kind} {event.zone}", "outcome"
            for part in ("load", "load_error", "x"):
                yield of(f"path {name} event {number} {part}", getattr(event, part))
    for name, (*parts, rtol) in HISTORIES.items():
        history = mb.Contact(*parts).history(SHEARED, rtol=rtol)
        yield from of_figure(f"history {name} figure", history.plot(), CLOSE / 10)
        for number, state in enumerate(history.states):
            yield from of_state(f"history {name} state {number}", state)
        for number, event in enumerate(history.events):
            yield f"history {name} event {number} kind", event.kind, "outcome"
            yield of(f"history {name} event {number} shear", event.shear)


def pictures():
    """Rows of what is seen of obstacles before anything is solved, in the plane and in space."""
    for name, shape in SHAPES.items():
        for law in (TURNED, ANGLE, LINE):
            where, problem = f"seen {name} {law.corners} {law in (ANGLE,)}", Problem(SOLID, law, shape)
            found = picture(problem, 1.0)
            problem = replace(problem, picture=found)
            zones, longest = next(first_zones(problem, 1.0))
            kinks = [(x, jump) for x, jumps in problem.kinks.items() for jump in jumps.values()]
            yield (
                f"{where} counts",
                f"{len(found.sites)} {len(found.edges)} {len(kinks)} {len(zones[0])}",
                "outcome",
            )
            lengths = [
                float(own[np.isfinite(own)].sum()) for own in (found.lengths, found.edges, found.sites)
            ]
            numbers = {
                "half_width": found.half_width,
                **dict(zip(("lengths", "edges", "sites"), lengths)),
                "stretches": np.dot((1, 2), np.sum(problem.stretches, axis=0)),
                "scale": min(problem.scale(0.1, 0.2), 9.0),
                "sites of the last corner": problem.sites(len(law.corners) - 1).sum(),
                "kinks": np.dot((1, 2), np.sum(kinks or [(0, 0)], axis=0)),
                "tips": sum(problem.tips),
                "ends": sum(end for corner in problem.corners for end in problem.ends_of(corner)),
                "first zones": sum(np.dot((1, 2), np.sum(own, axis=0)) for own in zones.values()),
                "longest cell": longest,
            }
            yield from (of(f"{where} {part}", value, "estimated", 1e-6) for part, value in numbers.items())
    for name, shape in IN_SPACE.items():
        for law in (TURNED, LINE):
            for window in (None, (-0.5, 0.5)):
                contact = mb.Contact(mb.HalfSpace(SOLID), shape, law, mb.Cells(nodes=32, window=window))
                for level in ((1.0, None), (None, 0.02)):
                    own = contact.solver._picture(*level, contact.solver._given_window())
                    where = f"seen {name} {law.corners[0]} {window} {level[0]}"
                    numbers = {
                        "bound": own.bound,
                        "radius": own.radius,
                        "samples": own.samples[:, :2].sum(),
                        "valleys": own.valleys[:, 2].sum(),
                        "lowest": own.lowest[2],
                        "separate": len(own.separate(own.bound)),
                    }
                    yield from (
                        of(f"{where} {part}", value, "estimated", 1e-6) for part, value in numbers.items()
                    )


def trials():
    """Rows of single steps of the search for zones, from zones that are wrong."""
    for name, (shape, law, *wrong) in TRIALS.items():
        problem = Problem(SOLID, law, shape)
        problem = replace(problem, picture=picture(problem, 1.0))
        zones = dict(enumerate(wrong * len(problem.corners) if len(wrong) == 1 else wrong))
        for load in (1.0, 0.1):
            where = f"trial {name} load {load}"
            try:
                state = fit(problem, load, zones, 8, 1e-4)
            except mb.NotConverged as failure:
                yield f"{where} fails", f"{failure} in {failure.iterations}", "outcome"
                continue
            found = survey(state)
            further = amended(state, found, 1e-6)
            counts = state.iterations, len(found.violations), len(found.least)
            yield f"{where} steps, violations, minima, beyond", f"{counts} {found.beyond}", "outcome"
            yield of(f"{where} share of edges", state.estimate.edges)
            yield of(f"{where} worth", found.worth, tolerance=1e-4)
            for part, own in (("zones", state.zones), ("further", state.further), ("amended", further or {})):
                values = [np.dot((1, 2), np.sum(each, axis=0)) for each in own.values() if len(each)]
                yield of(f"{where} {part}", sum(values), "estimated", 1e-6)
            for number, each in enumerate(found.violations):
                place = np.dot((1, 2, 4, 8), (each.corner, each.left, each.right, each.depth))
                yield of(f"{where} violation {number}", place, "estimated", 1e-5)
            yield of(f"{where} minima", sum(x + 10 * gap for _, x, gap in found.least), "estimated", 1e-5)


def parts():
    """Rows of functions that take numbers and give numbers: samples, proxies, intervals, meshes, bytes."""
    for name, shape in (SHAPES | {"cylinder": CYLINDER}).items():
        for part, own in zip(("places", "heights"), _everywhere(shape, 0.1, 24, 1e4)):
            yield f"{part} of {name} number", len(own), "outcome"
            yield of(f"{part} of {name}", ramp(np.tanh(own)), "estimated", 1e-9)
    for name, function in PROXIES.items():
        own, sizes = proxy(function, np.linspace(-1, 2, 13), 1e-9), []
        for part in ("edges", "singular", "jumps", "powers", "samples", "values", "lengths"):
            values = np.asarray(getattr(own, part))
            sizes.append(f"{part} {len(values)}")
            yield of(f"proxy {name} {part}", ramp(values[np.isfinite(values)]), "estimated", 1e-5)
        yield f"proxy {name} sizes", " ".join(sizes), "outcome"
    pairs, other = [(-1.0, 0.0), (0.25, 0.5), (0.5, 1.0)], [(-1.5, -0.5), (0.0, 0.25), (0.75, 2.0)]
    x, flags = np.linspace(-1, 1, 9), np.array([0, 1, 0, 0, 1, 1, 0, 1], bool)
    texts = {
        "over the end": [
            over_the_end(each, period) for each in (pairs, pairs[:2]) for period in (None, 1.5, 2.0)
        ],
        "joined": [joined([*pairs, *other], slack) for slack in (0.0, 0.25)],
        "without": [without(pairs, *each) for each in other],
        "common": common(pairs, other),
        "changes": [zone_changes(*each) for each in ((pairs, other), (other, pairs), (pairs, pairs))],
        "contains": contains(pairs, x).tolist(),
        "interrupted": interrupted(x, flags, np.linspace(-1.1, 1.1, 12)).tolist(),
        "runs": runs(flags).__repr__().replace("np.int64", ""),
        "distance": distance_to_ends(x, (-0.5, 1.0), (0.1, -0.1)).round(12).tolist(),
        "moved": [moved_on({0: pairs}, {0: other}, share) for share in (0.5, 2.0, 2.1, -2.1)],
        "of others": moved_on({0: pairs}, {0: other[:2]}, 0.5),
    }
    yield from ((f"intervals {name}", str(value), "outcome") for name, value in texts.items())
    for half, tips in ((True, (0.3,)), (False, (-0.2, 0.3))):
        ground = meshes.Ground(far=4.0, reach=(0.0, 0.5) if half else (-0.6, 0.5), half=half)
        for name, spacing, sizes in (
            ("even", 0.1, ()),
            ("parts", ((0.0, 0.2, 0.02), (0.2, 0.5, 0.1)), ((0.4, 0.01),)),
        ):
            mesh = meshes.graded(ground, tips, spacing=spacing, levels=3, sizes=sizes)
            orders = meshes.falling_orders(mesh, ground, tips, 7)
            yield (
                f"mesh {half} {name} elements",
                f"{mesh.ne} {mesh.nv} {np.bincount(orders).tolist()}",
                "outcome",
            )
        for quads in (True, False):
            mesh = meshes.uniform(ground, 0.15, quads)
            points = ramp([vertex.point for vertex in mesh.vertices])
            _, depths = meshes.thicknesses(mesh, mesh.Boundaries("contact"))
            yield f"mesh {half} {quads} elements", f"{mesh.ne} {mesh.nv} {mesh.GetBoundaries()}", "outcome"
            yield of(f"mesh {half} {quads} points and depths", points + ramp(depths), "discrete", 1e-12)
    for order in (1, 2, 4):
        yield of(f"longest element {order}", meshes.longest_element(SOLID, order), "definition", 1e-12)
        stiff = mb.Cosserat(E=100, nu=0.499, beta=1, ell=0.1)
        yield f"locking {order}", str(meshes.locking(stiff, order, 0.3, 0.4)), "outcome"
    grades = meshes3d.graded(reach=0.7, step=0.15, far=3.0, growth=1.7)
    yield of("grades", ramp(grades), "discrete", 1e-12)
    yield of("lines", ramp(meshes.uniform_lines(0.5, 4.0, 0.12)), "discrete", 1e-12)
    yield of("bytes of factors", cost.of_factors(1000, 50000), "definition", 1e-12)
    yield of("bytes of nodes", cost.of_nodes(100), "definition", 1e-12)
    for pairs in (1, 1000, 10**6):
        with patch.object(cost, "available", lambda: 8e9):
            yield (
                f"history of {pairs}",
                library.refused(lambda pairs=pairs: cost.require_history(9, 3000, pairs)),
                "outcome",
            )
    for turn, depth in ((0.0, 0.0), (0.1, 0.01), (0.001, 0.3), (1.0, 2.0), (1e-5, 1e-6)):
        yield f"magnified {turn} {depth}", f"{blocks.magnification(turn, depth):g}", "outcome"
    for contact in ([], [(-0.3, 0.2)], [(-9.0, 1.0), (2.0, 3.0)]):
        yield f"window {contact}", str(np.round(blocks.window(0.1, contact), 12).tolist()), "outcome"


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
    yield f"{name} warnings", " | ".join(state.warnings), "outcome"
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


def ramp(values):
    """A sum in which every number has a share of its own."""
    values = np.nan_to_num(np.ravel(values).astype(float))
    return float(values @ np.linspace(1, 2, len(values)))


def words(thing):
    """What something says of itself, without marks."""
    table = thing._repr_html_() if hasattr(thing, "_repr_html_") else ""
    return f"{thing!r} " + " ".join(html.unescape(re.sub("<[^>]+>", " ", table)).split())


def of_files(name, state):
    """Rows of the numbers in what is written for other programs."""
    import meshio

    with tempfile.TemporaryDirectory() as folder:
        for file in mb.to_vtk(state, f"{folder}/state"):
            mesh, part = meshio.read(file), file.stem.rpartition("_")[2]
            yield (
                f"{name} {part} cells",
                " ".join(f"{len(own.data)} {own.type}" for own in mesh.cells),
                "outcome",
            )
            values = {"points": mesh.points, **mesh.point_data}
            for entry, own in values.items():
                yield of(f"{name} {part} {entry}", ramp(own), "discrete", 1e-6)


def of_figure(name, drawing, close=1e-9):
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
        yield of(f"{where} ticks", np.sum(axis.get_yticks()), "discrete", close)
        for line, own in enumerate(axis.lines):
            points = np.nan_to_num(np.array(own.get_data(), float))
            yield (
                f"{where} line {line} is",
                f"{own.get_label()} {own.get_color()} {own.get_linestyle()}",
                "outcome",
            )
            yield of(f"{where} line {line}", ramp(points), "discrete", close)
        for image, own in enumerate(axis.images):
            yield of(
                f"{where} image {image}", ramp(own.get_array()) + ramp(own.get_extent()), "discrete", close
            )
        for number, own in enumerate(axis.collections):
            points = np.concatenate([path.vertices for path in own.get_paths()] or [np.zeros((0, 2))])
            yield f"{where} collection {number} faces", len(np.unique(own.get_facecolor(), axis=0)), "outcome"
            shown = (
                ramp(points)
                + ramp(own.get_offsets())
                + ramp([] if own.get_array() is None else own.get_array())
            )
            yield of(f"{where} collection {number}", shown, "discrete", close)
