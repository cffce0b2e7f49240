"""Frozen formulas of the plane in the names of the library: see `tests.frozen.library`."""

import numpy as np

import microblock as mb
from cases.commands import hertz
from cases.strip import relative_error
from microblock.contact_solvers import active_set, projected_gradients
from microblock.contact_solvers.fft_compliance import Grid
from microblock.halfplane import averages, first_zones, kernels, shear_cells, transmitted_singularities
from microblock.halfplane.friction_edges import zones_on_cells
from microblock.halfplane.loading_history import LoadingHistory
from microblock.halfplane.second_body_kernel import second_body_flexibility
from microblock.model import contact_candidates, intervals, quadrature
from microblock.model.corner_geometry import Blocks
from microblock.model.problem import Problem

from . import problems as given
from . import problems_friction as problems
from .library_friction import digest

LAWS = {"microblock": mb.Microblock(friction=0.3), "unilateral": mb.Unilateral(friction=0.3)}
LAWS["microclamped"] = mb.Microclamped(friction=0.3)
SOFT = {"beta": 0.3, "nu": 0.1, "curvature": 1.0, "ell": 0.2}
CLASSICAL = {"beta": 0.0, "nu": 0.2}
EDGES = np.array([-0.5, -0.3, -0.1, -0.04, 0.0, 0.01, 0.012, 0.2, 6.0, 6.1])


def solid_of(**other):
    return mb.Cosserat(**given.solid(**other))


def cells_of(edges=EDGES):
    return np.column_stack((edges[:-1], edges[1:]))


def of_shear_kernels():
    rows = {}
    places = np.array([0.01, -1.0, 50.0])
    few = [0, 1, 2, 15, 17, 255, 300, 4095, 4999]
    solids = {"beta=1": solid_of(), "beta=0.3": solid_of(**SOFT)}
    for name, solid in solids.items():
        moduli = solid.nu, solid.beta, solid.curvature
        table = enumerate(kernels.kernels(*moduli)(places, range(3, 9)), 3)
        twice = kernels.kernels(*moduli, averages.SecondAntiderivatives)(places, range(9))
        cells = zip("UVWYE", kernels.HalfPlane(solid).cells(5000, 0.003, (0, 1, 2, 3, 4)))
        rows |= {
            **{f"kernel {name} {i} at x/ell={x:g}": v for i, values in table for x, v in zip(places, values)},
            **{f"second antiderivative {name} {i}": digest(column) for i, column in enumerate(twice)},
            **{f"cells {name} {part}": digest(values[few]) for part, values in cells},
        }
    for name, moduli in {**solids, "classical": solid_of(**CLASSICAL)}.items():
        rows[f"normal kernel {name}"] = digest(kernels.on_the_line(moduli, places, (0,))[0])
        rows[f"normal symbol {name}"] = digest(kernels.normal_symbol(moduli, np.abs(places)))
    return rows


def of_averages():
    """Averages over cells of unlike widths, near and far."""
    rows, edges = {}, cells_of()
    middle, width = edges.mean(axis=1), np.ptp(edges, axis=1)
    for name, moduli, which in (
        ("beta=1", {}, range(9)),
        ("beta=0.3", SOFT, range(9)),
        ("classical", CLASSICAL, (0, 5)),
    ):
        solid = solid_of(**moduli)
        apart, widths = middle[:, None] - middle, (width, width[:, None])
        normal = averages.averaged(solid, apart, *widths, (0,))[0]
        alike = shear_cells.averages(solid, edges, which)
        shifted = averages.averaged(solid, apart + solid.ell, *widths, which)
        rows |= {
            **{
                f"averages {name} shift={shift:g} {i}": digest(matrix)
                for shift, matrices in ((0.0, alike), (solid.ell, shifted))
                for i, matrix in zip(which, matrices)
            },
            f"normal averages {name}": digest(normal),
            f"normal averages {name} of a cell": normal[3, 3],
            f"normal averages {name} far": float(averages.averaged(solid, [40.0], 0.1, 0.2, (0,))[0, 0]),
        }
    return rows | of_averaged_compliances(edges, middle, width)


def of_averaged_compliances(edges, middle, width):
    """The compliances that are made of averages over cells."""
    rows = {}
    for name, law in LAWS.items():
        problem = Problem(solid_of(), law, mb.Cylinder(R=10.0), counter=solid_of(**problems.BEHIND))
        corners, even = len(law.corners), np.linspace(-0.2, 0.2, 7)
        cells = shear_cells.frictional_contact(problem, edges, np.zeros(corners * len(edges)))
        with_second = shear_cells.with_second_body(cells, problem, edges)
        ways = {"": cells, " with a body, a force for each corner": with_second}
        rows |= {
            **{
                f"cells {name}{words} {part}": digest(getattr(way, part))
                for words, way in ways.items()
                for part in ("normal", "cross", "tangential")
            },
            **{f"cells {name}{words} cross entry": way.cross[2, 4] for words, way in ways.items()},
            f"counter flexibility {name}": digest(second_body_flexibility(problem, even, np.full(7, 0.05))),
            f"graded flexibility {name}": digest(first_zones._flexibility(problem, middle, width)),
        }
    return rows


def as_matrix(flexibility):
    """A product as a matrix, by unit forces."""
    shape = len(flexibility.offsets), *flexibility.tilt.shape[1:]
    forces = np.eye(np.prod(shape)).reshape(-1, *shape)
    return np.array([(flexibility @ unit).ravel() for unit in forces]).T


def flexibility(line, law, grid, second=None):
    flat = mb.Obstacle(lambda x: 0 * x) if line.period else mb.Cylinder(R=10.0)
    obstacle = flat if second is None else mb.Deformable(second, flat)
    return mb.Contact(line, obstacle, law, mb.Cells()).solver.flexibility(grid)


def of_products():
    """Products on equal cells by FFT with and without a period and a second body, and preconditioners."""
    rows = {}
    bodies = {"": None, " with a body": solid_of(**problems.BEHIND)}
    for words, period, count in (("", None, 40), (" of a period", 1.0, 41), (" of a long line", None, 300)):
        grid = Grid(count, 1 / count, (0.0,))
        line = mb.HalfPlane(solid_of(), period)
        for name, law in LAWS.items():
            forces = np.cos(np.arange(len(law.corners) * count)).reshape(len(law.corners), -1) + 1.1
            for body, second in bodies.items():
                response = flexibility(line, law, grid, second and mb.HalfPlane(second, period))
                values = {
                    "": response @ forces,
                    " back": response.on_face(np.ones(forces.shape, bool))(response @ forces),
                    " matrix": as_matrix(response) if count < 300 else None,
                }
                values[" aside"] = response.beside(forces) if len(law.corners) == 1 else None
                row = f"product{words} {name}{body}"
                rows |= {f"{row}{part}": digest(x) for part, x in values.items() if x is not None}
    return rows


def of_gradients():
    """A state on cells by products alone, and the same by exchange of faces."""
    (line, grid) = (mb.HalfPlane(solid_of()), Grid(60, 0.02, (0.0,)))
    rows = {}
    (x,) = grid.axes
    for name, law in LAWS.items():
        response = flexibility(line, law, grid)
        gaps = Blocks(law, 0.085).on_horizontal_surface(mb.Cylinder(R=10.0), x).initial_gaps
        products = projected_gradients.solve_matrix_free(response, gaps, load=1.0, rtol=1e-13)
        rows[f"gradients {name}"] = digest(products.forces)
        rows[f"gradients {name} approach"] = products.approach
        matrix = as_matrix(response)
        lift = active_set.rigid_constant(matrix)
        every = np.ones(gaps.size, bool)
        faces = active_set.block_pivoting(matrix + lift, gaps.ravel(), every, 1.0)
        rows[f"exchange {name}"] = digest(faces[0])
    return rows


def of_second_bodies():
    """What a second body carries from corner to corner."""
    rows, solid = {}, solid_of()
    for name, moduli in (("alike", {}), ("behind", problems.BEHIND), ("soft", {"E": 20.0, "nu": 0.45})):
        for obstacle in (mb.Cylinder(R=10.0), mb.Wedge(slope=0.02)):
            problem = Problem(solid, mb.Microblock(), obstacle, counter=solid_of(**moduli))
            row = f"carried {name} {type(obstacle).__name__}"
            zones = {0: ((-0.3, 0.1),), 1: ((-0.1, 0.3),)}
            rows |= {
                f"{row} decay": transmitted_singularities.decay(problem),
                f"{row} edges": digest(transmitted_singularities.singular_edges(problem, zones, 8)),
                f"{row} exponent": transmitted_singularities.meeting_exponent(problem, zones, 0.0),
                f"{row} logarithms": digest(
                    [
                        x
                        for place, sizes in transmitted_singularities.log_sizes(problem, zones, 8).items()
                        for x in (place, *sizes.values())
                    ]
                ),
            }
        rows[f"carried {name} modulus"] = problem.E_star
    return rows


def of_memories():
    """The superposition of Cattaneo and Mindlin along pairs that grow, turn back, fall and slide."""
    rows, memory = {}, LoadingHistory(np.zeros(1), np.zeros(1))
    for number, pair in enumerate(
        ((1.0, 0.1), (1.4, 0.1), (1.4, 0.3), (1.4, -0.1), (1.2, 0.05), (1.5, 0.1), (0.7, -0.21), (0.7, 0.1))
    ):
        memory = memory.extended(*pair, 0.3)
        rows |= {
            f"superposition {number} bounds": digest(memory.loads),
            f"superposition {number} shares": digest(np.diff(memory.shears) / np.diff(memory.loads)),
            f"superposition {number} stuck": memory.stuck,
        }
    return rows


SHAPES = {
    "cylinder": mb.Cylinder(R=10.0),
    "tilted punch": mb.Punch(0.4, 0.01),
    "rough": lambda x: x**2 / 20 + 2e-4 * np.cos(9 * x) * np.sin(4 * x + 1),
    "two bumps": lambda x: 0.005 * ((x / 0.3) ** 2 - 1) ** 2 + 0.001 * x,
    "skew wedge": given.FUNCTIONS["skew wedge"],
    "tip": given.FUNCTIONS["tip"],
    "step": lambda x: np.where(x < 0.1, 0.003, 0.0) + x**2,
    "ends": lambda x: np.where(np.abs(x - 0.1) < 0.3, x**2 / 20, np.inf),
    "samples": mb.Obstacle.from_samples((-1.0, -0.1, 0.2, 1.0), (0.03, 0.0, 0.001, 0.04)),
}


def of_pictures():
    """What is detected of obstacles from their heights: (name, value, how far it may move)."""
    for name, shape in SHAPES.items():
        candidates = contact_candidates.find_candidates(Problem(solid_of(), mb.Microblock(), shape), 1.0)
        parts = {
            "kinks": candidates.kinks,
            "ends": candidates.ends,
            "steps": candidates.height_jumps,
            "stretches": candidates.stretches,
            "minima": candidates.minima,
        }
        counts = [f"{len(values)} {part}" for part, values in parts.items() if len(values)]
        values = {"kinks": candidates.kinks, "jumps": candidates.jumps, "steps": candidates.height_jumps}
        values["end"] = np.clip(candidates.ends, -9, 9)
        yield f"picture {name}", f"{', '.join(counts)}{', simple' if candidates.simple else ''}", "outcome"
        yield f"picture {name} rise", candidates.rise, "definition"
        yield f"picture {name} 1 + lowest", 1 + candidates.lowest, "estimated", 1e-6
        yield f"picture {name} half_width", candidates.half_width, "estimated", 1e-3
        for part, numbers in values.items():
            yield from (
                (f"picture {name} {part} {i}", value, "estimated", 1e-6) for i, value in enumerate(numbers)
            )


def of_intervals():
    """Norms, distances, rules and extrema on a line."""
    x = np.linspace(-2, 4, 13)
    weights, values = np.linspace(0.1, 0.3, 13), np.cos(x)
    top, places = hertz.largest(lambda x: 1 - (x**2 - 1) ** 2, x)
    low, place = intervals.lowest(lambda x: (x - 0.3) ** 2, x)
    numbers = {
        "distance": intervals.distance(weights, values, 2 * values**2, 1 + values, values - 3),
        "relative error": relative_error(values, values**2, weights, 1.0),
        "distance to ends": digest(intervals.distance_to_ends(x, (-1.0, 1.0), (0.0, 0.1))),
        "lagrange": digest(quadrature.lagrange(np.array([0.1, 0.4, 0.9]), x)),
        "gauss rule": digest(quadrature.gauss_rule(7)),
    }
    for name, value in numbers.items():
        yield f"intervals {name}", value, "definition"
    yield "intervals largest", top, "estimated", 1e-9
    yield "intervals largest at", digest(places), "estimated", 1e-5
    yield "intervals lowest at", place, "estimated", 1e-5


def of_edges():
    """Edges of zones by fits to cells whose pressure and shear traction are those of Cattaneo and Mindlin."""
    edges = np.linspace(-1.5, 1.5, 61) + 0.01 * np.cos(np.arange(61))
    points, weights = quadrature.gauss_rule(12)
    x = edges[:-1, None] + np.diff(edges)[:, None] * points
    root = [
        np.sqrt(np.maximum(half**2 - (x - place) ** 2, 0)) @ weights
        for half, place in ((1.03, 0.0), (0.6, 0.05))
    ]
    p, q = root[0], 0.3 * (root[0] - 0.6 * root[1])
    closed, stick = p > 0, root[1] > 0
    q = np.where(stick, q, 0.3 * p)
    zones, _ = zones_on_cells(cells_of(edges), closed[None], stick, p[None], 0.3 * p, q, (), ["C"])
    for name, pairs in zones.items():
        for number, interval in enumerate(pairs):
            for side, edge in zip(("left", "right"), interval):
                yield f"edges {name} {number} {side}", edge, "estimated", 1e-3


def of_others():
    """Solids of blocks, and a rotation of blocks whose slope jumps."""
    law = mb.Microblock(psi0=lambda x: 0.01 * np.abs(x - 0.1))
    blocks = {couples: mb.Cosserat.of_blocks(0.1, 1000.0, couples=couples) for couples in (False, True)}
    problem = Problem(solid_of(), law, mb.Wedge(slope=0.02))
    problem = Problem(
        solid_of(), law, mb.Wedge(slope=0.02), candidates=contact_candidates.find_candidates(problem, 1.0)
    )
    return {
        **{
            f"of blocks couples={couples}": digest(
                [solid.E, solid.nu, solid.beta, solid.curvature, solid.eta]
            )
            for couples, solid in blocks.items()
        },
        **{
            f"kinks {i}": digest([1 + place, *(jumps[corner] for corner in sorted(jumps))])
            for i, (place, jumps) in enumerate(sorted(problem.kinks.items()))
        },
    }


def of_ways():
    """States one after the other, at a given approach, and by cells where panels have none."""
    half = mb.HalfPlane(solid_of())
    cylinder = mb.Cylinder(R=10.0)
    law = mb.Microblock()
    methods = {"panels": mb.Panels(order=8), "cells": mb.Cells(nodes=64, window=(-0.6, 0.6))}
    for name, method in methods.items():
        problem, state = mb.Contact(half, cylinder, law, method), None
        for number, load in enumerate((0.5, 1.0, 0.2)):
            state = problem.solve(load, initial=state)
            yield f"one after the other {name} {number} half_width", state.half_width, "discrete"
            yield f"one after the other {name} {number}", digest(state.pressure), "discrete"
    wave = mb.Contact(mb.HalfPlane(solid_of(), 1.0), mb.Wave(0.01, 1.0), mb.Unilateral(), mb.Cells(nodes=64))
    yield "cells of a period at an approach", wave.solve(approach=0.004).load, "discrete"
    noise = lambda x: x**2 + 1e-3 * np.sin(1e3 * x * x)  # noqa: E731
    for name, problem, rtol in (
        ("cells to an accuracy", mb.Contact(half, cylinder, mb.Unilateral(), mb.Cells()), 0.02),
        ("panels of samples", mb.Contact(half, SHAPES["samples"], law, mb.Panels()), 0.1),
        ("panels of noise", mb.Contact(half, noise, law, mb.Panels()), 0.1),
    ):
        try:
            state = problem.solve(1.0, rtol=rtol)
        except mb.MicroblockError as failure:
            yield name, type(failure).__name__, "outcome"
        else:
            yield f"{name} method", state.method, "outcome"
            yield f"{name} warnings", len(state.warnings), "outcome"
            yield f"{name} force", state.weights @ state.pressure, "discrete"
