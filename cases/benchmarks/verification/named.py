"""Contact states on discretisations that are named: orders of panels, numbers of cells, elements, meshes.

python -m cases.benchmarks.verification.named [--first K] [--count N] draws states from a committed seed. It
knows their pressures and gaps alone:

load             the pressures carry it
complementarity  no pressure pulls, and no open corner overlaps the obstacle, also between the unknowns, but
                 for two nodes beside the contact; an overlap of depth d on a width w is worth
                 ``E* d/sqrt(w)`` over the pressure in L2
equilibrium      under `Unilateral` on `Elastic` half-planes: gaps from the pressures by the logarithm of
                 Flamant, level where the contact is closed, by an own quadrature

"right": all of these hold to BAR or thrice the state's error estimate; "wrong": they do not, without a word;
"warned", "error": they do not, and the state or the program says so.
"""

import argparse
import time
from collections import Counter

import numpy as np

import microblock as mb
from microblock.fem import meshes

from . import SEED, obstacles
from .judging import OutOfTime, within
from .obstacles import log

BAR = 0.1  # of the pressure in L2, or of the depth: coarse discretisations are what was asked for
CELLS = 4000  # of the quadrature in a zone, and places between which gaps are looked at
WAYS = "panels", "cells", "period", "block", "mesh"


def drawn(k):
    """(words, Contact, load, window) of state k."""
    rng = np.random.default_rng([SEED, 49, k])
    way = WAYS[k % len(WAYS)]
    half = log(rng, 0.2, 2.0)
    name, (height, window, _) = lands(rng, half) if rng.random() < 0.4 else hard(rng, half)
    load = obstacles.LOAD * half**2 * log(rng, 0.1, 3.0)
    nu, ell = rng.uniform(0, 0.45), half * log(rng, 0.02, 1.0)
    E = obstacles.STIFFNESS * (1 - nu**2)
    law = (mb.Unilateral(), mb.Microblock(), mb.Microclamped())[rng.integers(3)]
    solid = mb.Elastic(E, nu) if type(law) is mb.Unilateral else mb.Cosserat(E, nu, ell=ell, beta=1.0)
    size = 1.1 * max(map(abs, window))
    body, method = {
        "panels": lambda: (mb.HalfPlane(solid), mb.Panels(order=int(rng.integers(4, 15)))),
        "cells": lambda: (mb.HalfPlane(solid), mb.Cells(nodes=int(log(rng, 100, 3000)))),
        "period": lambda: (mb.HalfPlane(solid, period=2 * size), mb.Cells(nodes=int(log(rng, 100, 3000)))),
        "block": lambda: (
            mb.Block(solid, 4 * size),
            mb.Uniform(h=size / int(rng.integers(8, 40)), reach=size),
        ),
        "mesh": lambda: (_body(rng, solid, size), None),
    }[way]()
    if way == "period":
        name, height, window = "waves", waves(rng, half, size), (-size, size)
    words = f"{way:7s}{name:16s}{type(law).__name__:13s}"
    return words, mb.Contact(body, height, law, method), float(load), window


def hard(rng, half):
    name = tuple(obstacles.KINDS)[rng.integers(len(obstacles.KINDS))]
    height, window, features = obstacles.KINDS[name](rng, half)
    if isinstance(height, tuple):
        height = mb.Obstacle.from_samples(*height)
    return name, (height, window, features)


def lands(rng, half):
    """Flat lands with grooves between them, as samples, from shallow to deep and from slopes to steps."""
    x, z = [0.0], [0.0]
    for number in range(rng.integers(1, 5)):
        if number:
            groove = half * log(rng, 0.05, 2.0)
            flank, depth = groove * log(rng, 1e-3, 0.4), groove * log(rng, 0.01, 5.0)
            x += [x[-1] + flank, x[-1] + groove - flank, x[-1] + groove]
            z += [depth, depth, 0.0]
        x.append(x[-1] + half * log(rng, 0.3, 3.0))
        z.append(0.0)
    x = np.array(x) - x[-1] / 2
    return "lands", (mb.Obstacle.from_samples(x, z), (x[0], x[-1]), ())


def waves(rng, half, size):
    """A height of the period 2 size, of some waves and a tooth between cells or none."""
    m = np.arange(1, rng.integers(2, 9))
    sizes = half**2 / obstacles.RADIUS * m ** -rng.uniform(1.0, 2.0) * rng.normal(size=len(m))
    place, width = size * rng.uniform(-0.8, 0.8), half * log(rng, 1e-3, 0.3)
    deep = rng.choice((0.0, 1.0)) * half**2 / obstacles.RADIUS

    def height(x):
        smooth = sizes @ np.cos(np.pi * np.outer(m, x) / size)
        away = 2 * size / np.pi * np.sin(np.pi * (x - place) / (2 * size))
        return smooth - deep * np.exp(-((away / width) ** 2))

    return height


def _body(rng, solid, size):
    ground = meshes.Ground(far=4 * size, reach=(-1.5 * size, 1.5 * size), half=False)
    return mb.Body(meshes.uniform(ground, size / rng.integers(8, 30)), solid, order=2, fixed="bottom")


def check(problem, state, load, window):
    """{what: how far it is off} of a state, of its pressures and gaps alone."""
    E_star = state.solid.E_star
    norm = np.sqrt(state.weights @ state.pressure**2)
    off = {"load": abs(state.weights @ state.pressure - load) / load}
    off["tension"] = -min(np.min(p, initial=0.0) for p in state.pressures.values()) / state.pressure.max()
    x = np.linspace(*window, CELLS)
    x = x[(x > state.x[0]) & (x < state.x[-1])]
    square = 0.0
    for corner in state.pressures:
        gaps = np.where(far(state, corner, x), state.gap_at(corner, x), 0.0)
        wrong = np.concatenate(([0], (gaps < 0).astype(int), [0]))
        for first, last in zip(np.flatnonzero(np.diff(wrong) > 0), np.flatnonzero(np.diff(wrong) < 0)):
            width = (last - first) * (x[1] - x[0])
            square += (E_star * gaps[first:last].min()) ** 2 / width
    off["overlap"] = float(np.sqrt(square)) / norm
    body = problem.body
    if isinstance(state.solid, mb.Elastic) and isinstance(body, mb.HalfPlane) and body.period is None:
        off["equilibrium"] = unlevel(state, E_star)
    return off


def far(state, corner, x):
    """Whether places lie farther than two nodes from what is closed; on panels, which fit zones, all do."""
    if state.method == "panels":
        return np.ones(len(x), bool)
    node = np.searchsorted(state.x, x)
    closed = np.pad(state.pressures[corner] > 0, 2)
    return ~np.any([closed[node + way] for way in range(4)], axis=0)


def unlevel(state, E_star):
    """How far gaps from the pressures alone differ in the middle half of each zone, over load/E*."""
    zones = state.zones["contact"]
    edges = np.concatenate(
        [(a + b) / 2 - (b - a) / 2 * np.cos(np.linspace(0, np.pi, CELLS // 8)) for a, b in zones]
    )
    parts = [slice(n * (CELLS // 8), (n + 1) * (CELLS // 8)) for n in range(len(zones))]
    left = np.concatenate([edges[part][:-1] for part in parts])
    right = np.concatenate([edges[part][1:] for part in parts])
    pressure = state.pressure_at((left + right) / 2)
    pressure *= state.load / (pressure @ (right - left))
    places = np.concatenate([np.linspace(0.75 * a + 0.25 * b, 0.25 * a + 0.75 * b, 9) for a, b in zones])

    def primitive(t):
        return t * (np.log(np.abs(t) + 1e-300) - 1)

    away = primitive(places[:, None] - left) - primitive(places[:, None] - right)
    raised = -2 / (np.pi * E_star) * away @ pressure
    height = getattr(state.obstacle, "height", state.obstacle)
    gaps = height(places) + raised
    return float(np.ptp(gaps) / (state.load / E_star))


def outcome(k, seconds=60):
    """(class, words, off or message) of state k."""
    words, problem, load, window = drawn(k)
    try:
        state = within(seconds, lambda: problem.solve(load=load))
    except OutOfTime:
        return "slow", words, ""
    except mb.MicroblockError as failure:
        return "error", words, str(failure)
    off = check(problem, state, load, window)
    bar = max(BAR, 3 * (state.error_estimate or 0.0))
    worst = max(off, key=lambda name: off[name])
    if off["load"] < 1e-6 and off["tension"] <= 1e-6 and off[worst] <= bar:
        return "right", words, off
    return "warned" if state.warnings else "wrong", words, off | {"words": state.warnings}


def main(words=None):
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=200)
    given = parser.parse_args(words)
    classes = []
    for k in range(given.first, given.first + given.count):
        start = time.process_time()
        name, text, off = outcome(k)
        classes.append(name)
        print(f"{k:4d} {name:7s}{time.process_time() - start:5.1f} s  {text} {str(off)[:300]}", flush=True)
    print(f"== named: {dict(Counter(classes))}")


if __name__ == "__main__":
    main()
