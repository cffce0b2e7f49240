"""Seeded contact problems on half-spaces: the estimate beside the error that four times as many cells
find.
"""

from types import SimpleNamespace

import numpy as np

import microblock as mb
from microblock.corners.on_cells import Grid

RTOL = 0.05
FINER = 4  # times as many cells along each axis


def scene(seed):
    """(words, Contact, load) of a seed; lengths over the radius a of the classical contact, E* = 1."""
    draw = np.random.default_rng(seed)
    nu, beta, curvature = draw.uniform(0, 0.45), draw.uniform(0.2, 1.8), draw.uniform(0.5, 3.0)
    alpha = float(np.exp(draw.uniform(np.log(0.05), np.log(2.0))))
    words, obstacle, period, load = OBSTACLES[seed % len(OBSTACLES)](draw)
    ell = alpha if period is None else alpha / 8  # a rough period has contacts of some 1/8
    solid = mb.Cosserat(1 - nu**2, nu, ell, beta=beta, curvature=curvature)
    law = LAWS[draw.integers(len(LAWS))](draw)
    return (
        f"{words:9s} {type(law).__name__:12s} alpha {alpha:.2f}",
        mb.Contact(mb.HalfSpace(solid, period), obstacle, law),
        load,
    )


def two_bodies(seed):
    """The same with a second body in place of the rigid obstacle, classical or not, softer or stiffer."""
    draw = np.random.default_rng([31, seed])
    words, problem, load = scene(seed)
    solid = mb.Cosserat(
        10 ** draw.uniform(-0.7, 2),
        draw.uniform(0, 0.45),
        problem.solid.ell * draw.uniform(0.3, 3),
        beta=draw.uniform(0.2, 1.8) * draw.integers(2),
    )
    second = mb.Deformable(mb.HalfSpace(solid, problem.body.period), problem.obstacle)
    return f"{words} E2 {solid.E:6.2f} beta2 {solid.beta:.1f}", problem.with_(obstacle=second), load


def _ellipsoid(draw):
    return "ellipsoid", mb.Ellipsoid(1.0, draw.uniform(0.3, 3.0)), None, 4 / 3


def _two(draw):
    apart, depth = draw.uniform(0.5, 2.0), draw.uniform(0, 0.3)

    def height(x1, x2):
        return np.minimum((x1 - apart) ** 2 / 2, (x1 + apart) ** 2 / 2 + depth) + x2**2 / 2

    return "two", height, None, 4 / 3


def _rough(draw):
    rough = mb.RoughSurface(1.0, 0.1, waves=(1, 6), seed=int(draw.integers(1000)))
    return "rough", rough, 1.0, 0.1 * draw.uniform(0.05, 1.0)


OBSTACLES = (
    lambda draw: ("sphere", mb.Sphere(1.0), None, 4 / 3),
    _ellipsoid,
    lambda draw: ("cone", mb.Cone(1.0), None, np.pi / 2),
    _two,
    _rough,
)
LAWS = (
    lambda draw: mb.Microblock(),
    lambda draw: mb.Microblock(tuple(draw.uniform(-0.1, 0.1, 2))),
    lambda draw: mb.Unilateral(),
    lambda draw: mb.Microclamped(),
)


def on_cells(state):
    """What a state on cells has, as arrays (n, n) over its cells, or (2, n, n) of what has two components."""
    flat = {name: getattr(state, name) for name in ("pressure", "displacement", "opposite", "closed")}
    turned = {name: getattr(state, name).T.reshape(2, *state.shape) for name in ("psi", "micromoment")}
    pressures = {name: values.reshape(state.shape) for name, values in state.pressures.items()}
    cells = {name: values if values is None else values.reshape(state.shape) for name, values in flat.items()}
    names = ("x1", "x2", "width", "approach", "load", "problem", "warnings", "seen_width")
    plain = {name: getattr(state, name) for name in names}
    return SimpleNamespace(**plain, **cells, **turned, pressures=pressures, weights=state.width**2)


def errors(problem, state):
    """max(|dp|, |dM|/ell)/|p| in L2, at the cells of a finer grid."""
    state = state.solution
    grid = state.grid
    fine = Grid(FINER * grid.count, grid.width / FINER, grid.middle)
    exact = problem.solver.solved(fine, state.load, None, 1e-7, state)
    places = fine.places
    pressure, first, second = (
        np.linalg.norm(state.interpolated(own, *places) - other)
        for own, other in zip((state.total, *state.micromoment), (exact.total, *exact.micromoment))
    )
    return max(pressure, np.hypot(first, second) / problem.solid.ell) / np.linalg.norm(exact.total)


def measured(seed, scene=scene):
    """(words, cells a side, estimate, error) of a scene at RTOL."""
    words, problem, load = scene(seed)
    state = problem.solve(load=load, rtol=RTOL)
    return words, len(state.x1), state.error_estimate, errors(problem, state)
