"""Contact states on discretisations that are named: orders of panels, numbers of cells, elements, meshes.

State k comes from (SEED, 49, k). Its pressures and gaps alone say how far it is off:

load             the pressures carry it
complementarity  no pressure is tensile, and no open corner overlaps the obstacle, also between the unknowns,
                 but for two nodes beside the contact; an overlap of depth d on a width w is worth
                 ``E* d/sqrt(w)`` over the pressure in L2
equilibrium      under `Unilateral` on `Elastic` half-planes: gaps from the pressures by the logarithm of
                 Flamant, constant where the contact is closed, by a quadrature of its own

All of these hold to BAR or thrice the state's error estimate.
"""

import numpy as np

import microblock as mb
from microblock.fem import meshes

from . import SEED, obstacles
from .judging import Case
from .obstacles import log

BAR = 0.1  # of the pressure in L2, or of the depth: coarse discretisations are what was asked for
EXACT = 1e-6  # of load and tension, which no discretisation spoils
CELLS = 4000  # places between which gaps are looked at
STRIPS = 500  # of the quadrature in a zone, one less than its edges
METHODS = "panels", "cells", "period", "block", "mesh"


def drawn(k):
    """(words, Contact, load, window) of state k."""
    rng = np.random.default_rng([SEED, 49, k])
    kind = METHODS[k % len(METHODS)]
    half = log(rng, 0.2, 2.0)
    name, height, window = lands(rng, half) if rng.random() < 0.4 else hard(rng, half)
    load = obstacles.LOAD * half**2 * log(rng, 0.1, 3.0)
    solid, law = material(rng, half)
    size = 1.1 * max(map(abs, window))
    body, method = discretised(rng, kind, solid, size)
    if kind == "period":
        name = "waves"
        height = waves(rng, half, size)
        window = (-size, size)
    kind = f"{kind:7s}{name:16s}{type(law).__name__:13s}"
    return kind, mb.Contact(body, height, law, method), float(load), window


def material(rng, half):
    """(solid, law)"""
    nu = rng.uniform(0, 0.45)
    ell = half * log(rng, 0.02, 1.0)
    E = obstacles.STIFFNESS * (1 - nu**2)
    law = (mb.Unilateral(), mb.Microblock(), mb.Microclamped())[rng.integers(3)]
    if type(law) is mb.Unilateral:
        return mb.Elastic(E, nu), law
    return mb.Cosserat(E, nu, ell=ell, beta=1.0), law


def discretised(rng, kind, solid, size):
    """(body, method) of a kind, for a contact within `size`."""
    if kind == "panels":
        return mb.HalfPlane(solid), mb.Panels(order=int(rng.integers(4, 15)))
    if kind == "cells":
        return mb.HalfPlane(solid), mb.Cells(nodes=int(log(rng, 100, 3000)))
    if kind == "period":
        return mb.HalfPlane(solid, period=2 * size), mb.Cells(nodes=int(log(rng, 100, 3000)))
    if kind == "block":
        return mb.Block(solid, 4 * size), mb.Uniform(h=size / int(rng.integers(8, 40)), reach=size)
    ground = meshes.Ground(far=4 * size, reach=(-1.5 * size, 1.5 * size), half=False)
    mesh = meshes.uniform(ground, size / rng.integers(8, 30))
    return mb.Body(mesh, solid, order=2, fixed="bottom"), None


def hard(rng, half):
    name = tuple(obstacles.KINDS)[rng.integers(len(obstacles.KINDS))]
    height, window, _ = obstacles.KINDS[name](rng, half)
    if isinstance(height, tuple):
        height = mb.Obstacle.from_samples(*height)
    return name, height, window


def lands(rng, half):
    """Flat lands with grooves between them, as samples, from shallow to deep and from slopes to steps."""
    x = [0.0]
    z = [0.0]
    for number in range(rng.integers(1, 5)):
        if number:
            groove = half * log(rng, 0.05, 2.0)
            flank = groove * log(rng, 1e-3, 0.4)
            depth = groove * log(rng, 0.01, 5.0)
            x += [x[-1] + flank, x[-1] + groove - flank, x[-1] + groove]
            z += [depth, depth, 0.0]
        x.append(x[-1] + half * log(rng, 0.3, 3.0))
        z.append(0.0)
    x = np.array(x) - x[-1] / 2
    return "lands", mb.Obstacle.from_samples(x, z), (x[0], x[-1])


def waves(rng, half, size):
    """A height of the period 2 size, of some waves and a tooth between cells or none."""
    m = np.arange(1, rng.integers(2, 9))
    sizes = half**2 / obstacles.RADIUS * m ** -rng.uniform(1.0, 2.0) * rng.normal(size=len(m))
    place = size * rng.uniform(-0.8, 0.8)
    width = half * log(rng, 1e-3, 0.3)
    depth = rng.choice((0.0, 1.0)) * half**2 / obstacles.RADIUS

    def height(x):
        smooth = sizes @ np.cos(np.pi * np.outer(m, x) / size)
        distance = 2 * size / np.pi * np.sin(np.pi * (x - place) / (2 * size))
        return smooth - depth * np.exp(-((distance / width) ** 2))

    return height


def check(problem, state, load, window):
    """{what: how far it is off} of a state, of its pressures and gaps alone."""
    norm = np.sqrt(state.weights @ state.pressure**2)
    x = np.linspace(*window, CELLS)
    x = x[(x > state.x[0]) & (x < state.x[-1])]
    errors = {
        "load": abs(state.weights @ state.pressure - load) / load,
        "tension": -min(np.min(p, initial=0.0) for p in state.pressures.values()) / state.pressure.max(),
        "overlap": np.sqrt(sum(overlap(state, corner, x) for corner in state.pressures)) / norm,
    }
    infinite = isinstance(problem.body, mb.HalfPlane) and problem.body.period is None
    if infinite and isinstance(state.solid, mb.Elastic):
        errors["equilibrium"] = unlevel(state)
    return errors


def overlap(state, corner, x):
    """Square of the worth of all overlaps of a corner at places x."""
    gaps = np.where(far(state, corner, x), state.gap_at(corner, x), 0.0)
    bounds = np.diff(np.concatenate(([0], (gaps < 0).astype(int), [0])))
    return sum(
        (state.solid.E_star * gaps[first:last].min()) ** 2 / ((last - first) * (x[1] - x[0]))
        for first, last in zip(np.flatnonzero(bounds > 0), np.flatnonzero(bounds < 0))
    )


def far(state, corner, x):
    """Whether places lie farther than two nodes from what is closed; on panels, which fit zones, all do."""
    if state.method == "panels":
        return np.ones(len(x), bool)
    node = np.searchsorted(state.x, x)
    closed = np.pad(state.pressures[corner] > 0, 2)
    return ~np.any([closed[node + shift] for shift in range(4)], axis=0)


def unlevel(state):
    """How far gaps from the pressures alone differ in the middle half of each zone, over load/E*."""
    zones = np.array(state.zones["contact"])[:, :, None]
    left = zones[:, 0]
    right = zones[:, 1]
    edges = (left + right) / 2 - (right - left) / 2 * np.cos(np.linspace(0, np.pi, STRIPS))
    first = edges[:, :-1].ravel()
    last = edges[:, 1:].ravel()
    pressure = state.pressure_at((first + last) / 2)
    pressure *= state.load / (pressure @ (last - first))
    places = (left + (right - left) * np.linspace(0.25, 0.75, 9)).ravel()

    def primitive(t):
        return t * (np.log(np.abs(t) + 1e-300) - 1)

    integrals = primitive(places[:, None] - first) - primitive(places[:, None] - last)
    displacement = -2 / (np.pi * state.solid.E_star) * integrals @ pressure
    height = getattr(state.obstacle, "height", state.obstacle)
    return float(np.ptp(height(places) + displacement) / (state.load / state.solid.E_star))


def case(k):
    """State k as a Case; its error is the worst of all checks."""
    words, problem, load, window = drawn(k)

    def verify(state):
        errors = check(problem, state, load, window)
        worst = max(errors.values())
        if max(errors["load"], errors["tension"]) > EXACT:
            worst = np.inf
        return worst, 3 * (state.error_estimate or 0.0), 0.0

    return Case(words, BAR, lambda: problem.solve(load=load), verify)
