"""Seconds of the program beside those of other programs, its aims, and the floor of the machine.

:Geometry:  cylinders on half-planes, blocks and squares, a wave, a sphere, a rough period
:Method:    what a user calls, warm; other programs solve the same problem in turns with it, where installed
:Units:     least processor seconds of one thread. Aims are those of an idle processor; without a number the
            aim is the other program's time

The floor is what the largest linear algebra takes alone in the same run: a dense solution, a transform there
and back, or sparse Cholesky factors. A figure of the record stands for a program that is not installed.
"""

import importlib.util
import math
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from resource import RUSAGE_CHILDREN, getrusage
from time import process_time

import numpy as np
import pandas as pd
from scipy.fft import irfftn, rfftn

import microblock as mb
from microblock.threads import bounded
from microblock.view import state_figure

from . import peers, speed

RECORD = Path(__file__).parent / "results" / "beside.csv"
ELASTIC = mb.Elastic(E=1 - speed.NU**2, nu=speed.NU)  # E* = 1
BLOCKS = mb.Cosserat(E=1 - speed.NU**2, nu=speed.NU, ell=0.25, beta=1.0)
CYLINDER = speed.PROBLEMS["microblock-0.25"]
WAVE_LOAD = 1e-3 * math.pi * math.sin(math.pi * 0.15) ** 2  # of contact on 0.3 of the period
ROUGH_LOAD = 0.01
ROUNDS = 6  # of which the best counts


@dataclass(frozen=True)
class Work:
    """A row: functions that return what is timed, of the program, of another one, and of the floor; seconds
    to aim at; the module of the other program; and whether a run takes some ten seconds.
    """

    ready: Callable
    aim: float | None = None
    floor: Callable | None = None
    peer: str | None = None
    beside: Callable | None = None
    long: bool = False


def clock():
    """Processor seconds, those of finished commands included."""
    children = getrusage(RUSAGE_CHILDREN)
    return process_time() + children.ru_utime + children.ru_stime


@bounded
def in_turns(functions, rounds):
    """Least seconds of each function on one thread in rounds, of which the first warms up."""

    def seconds(function):
        start = clock()
        function()
        return clock() - start

    return np.min([[seconds(function) for function in functions] for _ in range(rounds)], axis=0)


# ---- what the program does


def solution(body, obstacle, law, method=None, **arguments):
    return lambda: mb.Contact(body, obstacle, law, method).solve(**arguments)


def from_neighbour(rtol, read=lambda state: state):
    contact = CYLINDER.half_plane
    initial = contact.solve(load=0.98 * speed.LOAD, rtol=rtol)
    return lambda: read(contact.solve(load=speed.LOAD, rtol=rtol, initial=initial))


def slider():
    """A picture in the figure of the state before, as of `explore`."""
    drawing = state_figure.draw(CYLINDER.half_plane.solve(load=speed.LOAD, rtol=1e-3))
    drawing.lay_out()
    return from_neighbour(1e-3, lambda state: state_figure.draw(state, drawing).png())


def squares(h, method, order=2, solid=BLOCKS, law=mb.Microblock):
    """A body made anew each time, since it keeps its factors."""
    scene = peers.Scene(2, order, h)
    fixed = scene.fixed | ({"psi": "axis|bottom"} if solid is BLOCKS else {})
    mesh = scene.mesh
    return lambda: solution(
        mb.Body(mesh, solid, order, fixed=fixed), scene.obstacle, law(), method, approach=scene.approach
    )()


def rough(nodes):
    return mb.RoughSurface(period=1.0, slope=0.1, hurst=0.8, waves=(2, nodes // 16), seed=1)


def rough_period(nodes, solid=ELASTIC, law=mb.Unilateral):
    method = mb.Cells(nodes=nodes)
    return solution(mb.HalfSpace(solid, period=1.0), rough(nodes), law(), method, load=ROUGH_LOAD)


def sphere(nodes, solid=ELASTIC, law=mb.Unilateral):
    """Of contact radius 1."""
    window = (-1.2, 1.2)
    return solution(mb.HalfSpace(solid), mb.Sphere(1.0), law(), mb.Cells(nodes, window=window), load=4 / 3)


def command(*words):
    """A command with byte code, as its users have it, which the first round compiles."""
    options = {"cwd": Path(__file__).parents[2], "env": os.environ | {"PYTHONDONTWRITEBYTECODE": ""}}
    return partial(subprocess.run, [sys.executable, *words], stdout=subprocess.DEVNULL, check=True, **options)


# ---- other programs


def tamaas(height, nodes, mean, axes=1):
    """Pressures on cells of a period of 1 with E* = 1 under a mean pressure."""
    import tamaas as library

    library.set_log_level(library.LogLevel.error)
    x = (np.arange(nodes) + 0.5) / nodes - 0.5
    surface = -height(*np.meshgrid(*[x] * axes, indexing="ij"))

    def solve():
        kind = getattr(library.model_type, f"basic_{axes}d")
        model = library.ModelFactory.createModel(kind, [1.0] * axes, [nodes] * axes)
        model.E = 1.0
        model.nu = 0.0
        library.PolonskyKeerRey(model, surface, 1e-7).solve(mean)
        return np.array(model.traction)

    return solve


def scikit_fem(h):
    """The load on the same squares of order 1 by scikit-fem: nodes close and open until none is wrong."""
    import skfem
    from skfem.models.elasticity import linear_elasticity

    scene = peers.Scene(2, 1, h)
    points = np.array([vertex.point for vertex in scene.mesh.vertices])
    quads = np.array([[vertex.nr for vertex in element.vertices] for element in scene.mesh.Elements()])
    mesh = skfem.MeshQuad(*(np.ascontiguousarray(array.T) for array in (points, quads)))
    x, y = mesh.p
    top = np.flatnonzero((y > -1e-9) & (x < peers.REACH + 1e-9))
    gaps = x[top] ** 2 / (2 * peers.R) - scene.approach
    bottom = y < y.min() + 1e-9

    def solve():
        basis = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementQuad1()))
        stiffness = skfem.asm(linear_elasticity(ELASTIC.lam, ELASTIC.mu), basis)
        along, up = basis.nodal_dofs
        held = np.concatenate((along[(x < 1e-9) | bottom], up[bottom]))
        closed = gaps < 0
        wrong = closed
        u = np.zeros(basis.N)
        while wrong.any():
            u[up[top[closed]]] = gaps[closed]
            u = skfem.solve(*skfem.condense(stiffness, x=u, D=np.union1d(held, up[top[closed]])))
            forces = -(stiffness @ u)[up[top]]
            wrong = np.where(closed, forces < -1e-15, u[up[top]] > gaps + 1e-15)
            closed = closed ^ wrong
        return forces.sum()

    return solve


# ---- floors


def dense(count):
    matrix = np.eye(count) + np.random.default_rng(0).random((count, count)) / count
    return partial(np.linalg.solve, matrix, np.ones(count))


def transform(*shape):
    values = np.random.default_rng(0).random(shape)
    return lambda: irfftn(rfftn(values), shape)


def cholesky(*arguments):
    body = squares(*arguments)().problem.body
    matrix = body.bulk(symmetric=True, condense=True).mat
    return partial(matrix.Inverse, body.space.FreeDofs(True), "sparsecholesky")


PARTS = mb.HalfPlane(CYLINDER.solid), mb.Cylinder(1.0), mb.Microblock()
WAVE = mb.HalfPlane(ELASTIC, period=1.0), mb.Wave(1e-3, 1.0), mb.Unilateral()
WORKS = {
    **{
        f"panels to {rtol:g}": Work(
            partial(solution, *PARTS, load=speed.LOAD, rtol=rtol), aim, partial(dense, unknowns)
        )
        for rtol, unknowns, aim in ((1e-3, 61, 0.004), (1e-6, 85, 0.007), (1e-9, 133, 0.012))
    },
    **{
        f"panels to {rtol:g} from a neighbour": Work(
            partial(from_neighbour, rtol), aim, partial(dense, unknowns)
        )
        for rtol, unknowns, aim in ((1e-3, 61, 0.002), (1e-6, 85, 0.005), (1e-9, 133, 0.01))
    },
    "cylinder to 1 %": Work(
        lambda: lambda: speed.PROBLEMS["classical"].half_plane.solve(load=speed.LOAD, rtol=1e-2),
        floor=partial(dense, 21),
        peer="tamaas",  # of its cells and periods the cheapest within 1 % in the record
        beside=lambda: partial(speed.tamaas, speed.PROBLEMS["classical"], 2048, 48),
    ),
    **{  # tamaas on the fewest cells, a power of 2, whose pressures are within rtol of Westergaard's
        f"wave to {rtol:g}": Work(
            partial(solution, *WAVE, load=WAVE_LOAD, rtol=rtol),
            floor=partial(transform, nodes),
            peer="tamaas",
            beside=partial(tamaas, WAVE[1].height, nodes, WAVE_LOAD),
        )
        for rtol, nodes in ((1e-2, 64), (1e-3, 1024))
    },
    "2^20 cells of a line": Work(
        partial(
            solution,
            mb.HalfPlane(speed.PROBLEMS["microblock-0.01"].solid),
            *PARTS[1:],
            mb.Cells(nodes=2**20, window=(-1.1, 1.1)),
            load=speed.LOAD,
        ),
        4.0,
        partial(transform, 2**21),
        long=True,
    ),
    **{
        f"fitted elements to {rtol:g}": Work(
            partial(solution, mb.Block(CYLINDER.solid), *PARTS[1:], load=speed.LOAD, rtol=rtol), aim
        )
        for rtol, aim in ((1e-3, 0.06), (1e-4, 0.09), (1e-5, 0.18))
    },
    "squares of order 1": Work(
        partial(squares, 0.04, mb.Condensed(), 1, ELASTIC, mb.Unilateral),
        floor=partial(cholesky, 0.04, mb.Condensed(), 1, ELASTIC, mb.Unilateral),
        peer="skfem",
        beside=partial(scikit_fem, 0.04),
    ),
    "squares beside ContactBoundary": Work(
        partial(squares, 0.15, mb.Condensed(), 1, ELASTIC, mb.Unilateral),
        peer="ngsolve",
        beside=lambda: partial(peers.contact_boundary, peers.Scene(2, 1, 0.15), 3.0, 8),
    ),
    "Newton, 138 000 unknowns": Work(
        partial(squares, 0.025, mb.Newton()), 12.0, partial(cholesky, 0.025, mb.Condensed()), long=True
    ),
    "condensed, 10^6 unknowns": Work(
        partial(squares, 0.0092, mb.Condensed()), 20.0, partial(cholesky, 0.0092, mb.Condensed()), long=True
    ),
    **{
        f"sphere on {nodes}^2 cells": Work(
            partial(sphere, nodes), floor=partial(transform, 2 * nodes, 2 * nodes), long=nodes > 128
        )
        for nodes in (64, 128, 256, 512)
    },
    "sphere on 64^2 cells with microblocks": Work(partial(sphere, 64, BLOCKS, mb.Microblock)),
    **{
        f"rough period of {nodes}^2 cells": Work(
            partial(rough_period, nodes),
            floor=partial(transform, nodes, nodes),
            peer="tamaas",
            beside=partial(tamaas, rough(nodes).height, nodes, ROUGH_LOAD, 2),
            long=True,
        )
        for nodes in (256, 512)
    },
    "rough period of 256^2 cells with microblocks": Work(
        partial(rough_period, 256, BLOCKS, mb.Microblock), long=True
    ),
    "python -m cases hertz --json -": Work(
        partial(command, "-m", "cases", "hertz", "--json", "-"),
        0.9,
        partial(command, "-c", "import scipy.linalg"),
    ),
    "import microblock": Work(
        partial(command, "-c", "import microblock"), 0.1, partial(command, "-c", "pass")
    ),
    "slider to picture": Work(slider, 0.05),
}


def row(name, record):
    """Columns of a work; `record` has the seconds of other programs by work."""
    work = WORKS[name]
    installed = work.peer is not None and importlib.util.find_spec(work.peer) is not None
    timed = {"seconds": work.ready, "beside": installed and work.beside, "floor": work.floor}
    timed = {column: make() for column, make in timed.items() if make}
    seconds = {"beside": record.get(name)}
    seconds |= dict(zip(timed, in_turns(timed.values(), 1 if work.long else ROUNDS)))
    aim = work.aim or seconds["beside"] or math.nan
    ratio = seconds["seconds"] / aim
    return {
        "work": name,
        "seconds": seconds["seconds"],
        "peer": f"{work.peer or ''}{'' if installed or not work.peer else ', stored'}",
        "beside": seconds["beside"],
        "aim": aim,
        "floor": seconds.get("floor"),
        "reached": "" if math.isnan(ratio) else "yes" if ratio <= 1 else f"no, {ratio:.2g}x",
    }


def table(only, long):
    """A table of the works of some words; without words of all, those that take long only if asked for."""
    record = pd.read_csv(RECORD).dropna(subset="beside").set_index("work").beside
    names = [name for name, work in WORKS.items() if long or only or not work.long]
    return pd.DataFrame([row(name, record) for name in names if any(word in name for word in only or ("",))])
