"""Problems on a line and their judges: the second code `panels` for the half-plane, `period` for a period,
fitted elements at rtol/30 for a body.

`fresh(method, k)` is problem k of a method that estimates its error, `hard(k)` a problem of `obstacles`.
"""

from math import inf, pi

import numpy as np

import microblock as mb
from microblock.fem import meshes
from microblock.model.intervals import zone_edges

from . import SEED, obstacles, panels, period
from .judging import Case
from .obstacles import log

METHODS = "panels", "cells", "fitted", "body"
LAWS = ("microblock", "microblock", "unilateral", "microclamped")
KINDS = ("cylinder", "wedge", "punch", "twins", "power", "ripples", "offset", "samples")
E = 100.0
PERIOD_CELLS, PERIOD_BAR = 8192, 5e-4  # of the judge, and what cells leave at the edges


def fields(state):
    """A function: x -> (pressure, micromoment over ell) of a State, from the pressures of its corners."""

    def values(x):
        levers = state.law.levers(x)
        pressures = {corner: state.pressure_at(x, corner) for corner in levers}
        return sum(pressures.values()), sum(levers[corner] * p for corner, p in pressures.items()) / 2

    return values


def error(state, true):
    """max(|dp|, |dM|/ell)/|p| in L2 of a State beside a more accurate State, or a `panels.Reference`."""
    second_code = isinstance(true, panels.Reference)
    shifts = state.problem.blocks.shifts
    kinks, ends = (
        [x - shift for x in getattr(state.obstacle, name, None) or () for shift in shifts]
        for name in ("kinks", "ends")
    )
    places = [*panels.all_edges(true.zones), *zone_edges(state.zones), *kinks]
    first = fields(state)
    second = fields(true)
    if second_code:
        second = true.fields
        places += true.problem.places
    if not state.law.clamps_rotation:
        return panels.distance(first, second, places, ends)
    of_moment = 0.0
    if second_code:  # M of microclamped states is known at their own points
        wrong = state.micromoment / state.solid.ell - true.fields(state.x)[1]
        distances = [np.minimum(1, np.abs(state.x - end) / np.ptp(ends) * 2) for end in ends]
        weights = state.weights * np.prod(distances, axis=0)
        of_moment = np.sqrt(weights @ wrong**2 / (weights @ state.pressure**2))
    of_pressure = panels.distance(
        lambda x: (first(x)[0], 0 * x), lambda x: (second(x)[0], 0 * x), places, ends
    )
    return max(of_moment, of_pressure)


def by_panels(problem, load, **obstacle):
    """A `Case.verify` by the second code; `obstacle` are its features and window."""

    def verify(state):
        true, bar = panels.reference(problem, load, state, **obstacle)
        return error(state, true), state.error_estimate, bar

    return verify


def by_elements(problem, load, rtol, meshed):
    """A `Case.verify` by fitted elements on the same block, or where they do not reach rtol by the problem
    `meshed`, to six times that.
    """

    def verify(state):
        try:
            true = problem.solve(load=load, rtol=rtol)
        except mb.NotConverged:
            true = meshed.solve(load=load, rtol=6 * rtol)
        return error(state, true), state.error_estimate, true.error_estimate

    return verify


def by_period(problem, height, load, name):
    """A `Case.verify` by the second code of a period."""
    s, long = problem.solid, problem.body.period

    def verify(state):
        x, forces = period.pressures(height, long, PERIOD_CELLS, (s.E, s.nu, s.beta, s.ell), name, load)
        wrong = np.array([state.pressure_at(x, corner) for corner in state.pressures]) - forces
        levers = (0.5, -0.5) if len(wrong) == 2 else (0.0,)
        distance = max(np.linalg.norm(wrong.sum(0)), np.linalg.norm(np.dot(levers, wrong)))
        return distance / np.linalg.norm(forces.sum(0)), state.error_estimate, PERIOD_BAR

    return verify


def hard(k, seed=SEED, rtol=1e-3):
    """Problem k of the obstacles that are meant to be hard; the seed of the records before was 2020."""
    words, problem, load, window, features = obstacles.drawn(seed, k, mb)
    verify = by_panels(problem, load, window=window, features=features)
    return Case(words, rtol, lambda: problem.solve(load=load, rtol=rtol), verify)


def fresh(method, k):
    """Problem k of a method that estimates its error."""
    words, problem, load, rtol, verify = drawn(method, k)
    return Case(words, rtol, lambda: problem.solve(load=load, rtol=rtol), verify)


RANGES = {
    "panels": (1e-5, 1e-2),
    "cells": (3e-3, 3e-2),
    "fitted": (1e-4, 1e-2),
    "body": (5e-3, 5e-2),
}  # of rtol


def drawn(method, k):
    """(words, Contact, load, rtol, verify) of that problem."""
    rng = np.random.default_rng((SEED, 10 + METHODS.index(method), k))
    nu = rng.uniform(0, 0.45)
    beta = rng.uniform(0.05, 1.9)
    name = LAWS[rng.integers(4)]
    psi0 = rng.uniform(-0.01, 0.01) if name == "microblock" and rng.random() < 0.3 else 0.0
    rtol = {other: log(rng, *ends) for other, ends in RANGES.items()}[method]
    if method == "cells" and rng.random() < 0.5:
        words, problem, load, verify = on_period(rng, nu, beta, name)
    else:
        words, problem, load, verify = on_line(rng, method, (nu, beta, psi0), name, rtol)
    return words, problem, load, rtol, verify


def law_of(name, psi0=0.0):
    laws = {"unilateral": mb.Unilateral(), "microclamped": mb.Microclamped()}
    return laws.get(name, mb.Microblock(psi0))


def on_period(rng, nu, beta, name):
    """(words, Contact, load, verify) of a surface of period 1."""
    height, obstacle, load, ell, kind = _periodic(rng, E / (1 - nu**2))
    body = mb.HalfPlane(mb.Cosserat(E=E, nu=nu, beta=beta, ell=ell), period=1.0)
    problem = mb.Contact(body, obstacle, law_of(name), mb.Cells())
    return f"{kind:9s}{name:13s}ell {ell:.1e}", problem, load, by_period(problem, height, load, name)


def on_line(rng, method, material, name, rtol):
    """(words, Contact, load, verify) of a half-plane, or of a body for elements."""
    nu, beta, psi0 = material
    a = log(rng, 0.05, 0.5)
    kind = KINDS[rng.integers(len(KINDS))]
    narrow = method in ("cells", "body")
    ell = a * log(rng, 1e-2 if narrow else 1e-4, 3 if method == "body" else 1e2)
    load = pi / 4 * E / (1 - nu**2) * a * a / 10 * rng.uniform(0.5, 1.5)
    obstacle, features = _obstacle(rng, a, kind)
    solid = mb.Cosserat(E=E, nu=nu, beta=beta, ell=ell)
    problem = mb.Contact(mb.HalfPlane(solid), obstacle, law_of(name, psi0 * a))
    verify = by_panels(problem, load, features=features, window=(-12 * a, 12 * a))
    words = f"{kind:9s}{name:13s}ell/a {ell / a:.1e} nu {nu:.2f} beta {beta:.2f} psi0 {psi0:+.3f}"
    if method == "body":
        ground = meshes.Ground(far=8 * a, reach=(-2 * a, 2 * a), half=False)
        block = problem.with_(body=mb.Block(solid, 8 * a), method=mb.Fitted())
        body = mb.Body(meshes.uniform(ground, a / 2), solid, order=3, fixed="bottom")
        problem = problem.with_(body=body)
        return words, problem, load, by_elements(block, load, rtol / 30, problem)
    if method == "fitted":
        return words, problem.with_(body=mb.Block(solid, inf), method=mb.Fitted()), load, verify
    return words, problem.with_(method=mb.Panels() if method == "panels" else mb.Cells()), load, verify


def _obstacle(rng, a, kind):
    """(obstacle, features) of a contact of half-width about a."""
    R = 10.0
    shift = a * rng.uniform(-3, 3)
    if kind == "twins":
        return _twins(rng, a, R), ()
    if kind == "power":
        p = rng.uniform(1.2, 4)
        obstacle = mb.Obstacle(lambda x: abs(x - shift) ** p * a ** (2 - p) / (2 * R), kinks=(shift,))
        return obstacle, [(shift, a * obstacles.sharp(p))]
    if kind == "ripples":
        size = a * a / R * log(rng, 0.003, 0.1)
        wave = a * rng.uniform(0.7, 3)
        return mb.Obstacle(lambda x: (x - shift) ** 2 / (2 * R) + size * np.cos(2 * pi * x / wave)), ()
    if kind == "punch":
        return mb.Punch(a, a / R * rng.uniform(0, 0.1)), ()
    if kind == "samples":
        x = np.linspace(-8 * a, 8 * a, 33)
        return mb.Obstacle.from_samples(x, x**2 / (2 * R) + a * a / R * 0.01 * rng.standard_normal(33)), ()
    return {
        "cylinder": mb.Cylinder(R),
        "wedge": mb.Wedge(a / R),
        "offset": mb.Obstacle(lambda x: (x - shift) ** 2 / (2 * R) + 0.3 * (x - shift) ** 4 / (R * a * a)),
    }[kind], ()


def _twins(rng, a, R):
    """Two cylinders, that on the right smaller and higher."""
    d = a * log(rng, 0.5, 4)
    z = a * a / R * rng.uniform(0, 0.2)
    S = R * log(rng, 0.3, 1)
    difference = 1 / (2 * R) - 1 / (2 * S), d / R + d / S, d * d / (2 * R) - d * d / (2 * S) - z
    kinks = np.sort(np.roots(difference).real)
    jumps = tuple(-abs((x - d) / S - (x + d) / R) for x in kinks)

    def height(x):
        return np.minimum((x + d) ** 2 / (2 * R), z + (x - d) ** 2 / (2 * S))

    return mb.Obstacle(height, kinks=tuple(kinks), jumps=jumps)


def _periodic(rng, E_star):
    """(height, obstacle, load, ell, words) of a surface of period 1."""
    size = log(rng, 1e-4, 1e-2)
    ell = log(rng, 3e-3, 1)
    load = pi * size * E_star * log(rng, 0.05, 4)  # over what closes a classical wave
    if rng.random() < 0.6:
        return lambda x: size * (1 - np.cos(2 * pi * x)), mb.Wave(size, 1.0), load, ell, "wave"
    m = np.arange(1, int(rng.integers(3, 9)))
    phases = rng.uniform(0, 2 * pi, len(m))

    def height(x):
        return np.sum(m**-2.0 * size * np.cos(2 * pi * m * np.asarray(x)[..., None] + phases), axis=-1)

    return height, mb.Obstacle(height), load, ell, "rough"
