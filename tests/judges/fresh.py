"""60 fresh states of each method that estimates its error, drawn by program, beside a truth of another kind.

    python -m tests.judges.fresh [--method NAME] [--first K] [--count N] [--json FILE]

prints a line for each state and for each method: how many errors exceed max(rtol, estimate), and median and
90 % of the estimate over the true error. The error is the larger of the relative L2 errors of what
`pressure_at` returns and of the micromoment over ell, at Gauss points between all edges that state or truth
have; under punches with the distance to their edges as weight, as the library says
(docs/theory/halfplane.md).

Truth: panels <- fitted elements on a block without bounds, or panels at rtol/1000 where those do not come;
cells <- panels, with a period the second code `plane`; fitted <- panels; body <- fitted elements at
rtol/30; half-space <- the second code `space`.
"""

from __future__ import annotations

import argparse
import json
import signal
import time
from collections import defaultdict
from dataclasses import dataclass
from math import inf, pi, sqrt
from pathlib import Path

import numpy as np
from scipy.interpolate import RegularGridInterpolator

from . import SEED, plane, space, space_scenes

METHODS = ("panels", "cells", "fitted", "body", "half-space")
SECONDS = 30  # of the processor, for a state, and again for its truth
LAWS = ("microblock", "microblock", "unilateral", "microclamped")


@dataclass(frozen=True)
class Problem:
    """A contact problem of the plane: heights, where they are singular, and what is asked."""

    kind: str
    height: object
    load: float
    solid: tuple
    law: str
    psi0: float
    rtol: float
    scale: float  # half-width of the contact, about
    kinks: tuple = ()
    jumps: tuple | None = None
    obstacle: tuple | None = None  # name and arguments of a class of the library
    period: float | None = None
    singular: tuple = ()  # edges of the obstacle

    def __str__(self):
        _, nu, beta, ell = self.solid
        named = f"{self.kind:9s}{self.law:13s}ell/a {ell / self.scale:.1e}"
        return f"{named} nu {nu:.2f} beta {beta:.2f} psi0 {self.psi0:+.3f} rtol {self.rtol:.0e}"


def log(rng, low, high):
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _obstacle(rng, a, draw):
    """Height over x of a contact of half-width about a, with its singular points: a dictionary."""
    R = 10.0
    shift = a * rng.uniform(-3, 3)
    if draw == "cylinder":
        return {"height": lambda x: x**2 / (2 * R), "obstacle": ("Cylinder", (R,))}
    if draw == "wedge":
        slope = a / R
        return {"height": lambda x: slope * abs(x), "obstacle": ("Wedge", (slope,))}
    if draw == "punch":
        tilt = a / R * rng.uniform(0, 0.1)

        def height(x):
            return np.where(abs(x) <= a, tilt * x, inf)

        return {"height": height, "obstacle": ("Punch", (a, tilt)), "singular": (-a, a)}
    if draw == "twins":
        d, z = a * log(rng, 0.5, 4), a * a / R * rng.uniform(0, 0.2)
        S = R * log(rng, 0.3, 1)

        def height(x):
            return np.minimum((x + d) ** 2 / (2 * R), z + (x - d) ** 2 / (2 * S))

        A, B, C = 1 / (2 * R) - 1 / (2 * S), d / R + d / S, d * d / (2 * R) - d * d / (2 * S) - z
        kinks = [-C / B] if A == 0 else [v for v in np.roots([A, B, C]).real]
        jumps = [(k - d) / S - (k + d) / R for k in kinks]
        order = np.argsort(kinks)
        jumps = [-abs(jumps[i]) for i in order]
        return {"height": height, "kinks": tuple(np.array(kinks)[order]), "jumps": tuple(jumps)}
    if draw == "power":
        p = rng.uniform(1.2, 4)
        return {"height": lambda x: abs(x - shift) ** p * a ** (2 - p) / (2 * R), "kinks": (shift,)}
    if draw == "ripples":
        amplitude, wave = a * a / R * log(rng, 0.003, 0.1), a * rng.uniform(0.7, 3)
        return {"height": lambda x: (x - shift) ** 2 / (2 * R) + amplitude * np.cos(2 * pi * x / wave)}
    if draw == "offset":
        return {"height": lambda x: (x - shift) ** 2 / (2 * R) + 0.3 * (x - shift) ** 4 / (R * a * a)}
    x = np.linspace(-8 * a, 8 * a, 33)  # samples
    z = x**2 / (2 * R) + a * a / R * 0.01 * rng.standard_normal(33)
    return {"height": None, "obstacle": ("samples", (x, z))}


KINDS = ("cylinder", "wedge", "punch", "twins", "power", "ripples", "offset", "samples")


def draw(method, k):
    """Problem k of a method of the plane."""
    rng = np.random.default_rng((SEED, 10 + METHODS.index(method), k))
    E, nu, beta = 100.0, rng.uniform(0, 0.45), rng.uniform(0.05, 1.9)
    law = LAWS[rng.integers(4)]
    psi0 = rng.uniform(-0.01, 0.01) if law == "microblock" and rng.random() < 0.3 else 0.0
    rtol = {
        "panels": log(rng, 1e-5, 1e-2),
        "cells": log(rng, 3e-3, 3e-2),
        "fitted": log(rng, 1e-4, 1e-2),
        "body": log(rng, 5e-3, 5e-2),
    }[method]
    if method == "cells" and rng.random() < 0.5:
        return _periodic(rng, (E, nu, beta), law, rtol)
    a = log(rng, 0.05, 0.5)
    kind = KINDS[rng.integers(len(KINDS))]
    low = 1e-2 if method in ("cells", "body") else 1e-4
    ell = a * log(rng, low, 1e2 if method != "body" else 3)
    load = pi / 4 * E / (1 - nu**2) * a * a / 10 * rng.uniform(0.5, 1.5)
    return Problem(
        kind,
        load=load,
        solid=(E, nu, beta, ell),
        law=law,
        psi0=psi0 * a,
        rtol=rtol,
        scale=a,
        **_obstacle(rng, a, kind),
    )


def _periodic(rng, material, law, rtol):
    E, nu, beta = material
    amplitude, ell = log(rng, 1e-4, 1e-2), log(rng, 3e-3, 1)
    full = pi * amplitude * E / (1 - nu**2)  # closes a classical wave
    load = full * log(rng, 0.05, 4)
    if rng.random() < 0.6:
        height, obstacle, kind = (
            lambda x: amplitude * (1 - np.cos(2 * pi * x)),
            ("Wave", (amplitude, 1.0)),
            "wave",
        )
    else:
        m = np.arange(1, int(rng.integers(3, 9)))
        c, t = m**-2.0 * amplitude, rng.uniform(0, 2 * pi, len(m))

        def height(x):
            return np.sum(c * np.cos(2 * pi * m * np.asarray(x)[..., None] + t), axis=-1)

        obstacle, kind = None, "rough"
    return Problem(
        kind, height, load, (E, nu, beta, ell), law, 0.0, rtol, 0.25, obstacle=obstacle, period=1.0
    )


# ---- states of the library ----


def obstacle(mb, p):
    if p.obstacle is None:
        return (
            mb.Obstacle(p.height, kinks=p.kinks or None, jumps=p.jumps) if p.kinks else mb.Obstacle(p.height)
        )
    name, arguments = p.obstacle
    return mb.Obstacle.from_samples(*arguments) if name == "samples" else getattr(mb, name)(*arguments)


def law(mb, p):
    if p.law == "microblock":
        return mb.Microblock(psi0=p.psi0)
    return {"unilateral": mb.Unilateral, "microclamped": mb.Microclamped}[p.law]()


def contact(mb, p, method):
    E, nu, beta, ell = p.solid
    solid = mb.Cosserat(E=E, nu=nu, beta=beta, ell=ell)
    size = 8 * p.scale
    if method == "panels":
        return mb.Contact(mb.HalfPlane(solid), obstacle(mb, p), law(mb, p), mb.Panels(fallback=False))
    if method == "cells":
        return mb.Contact(mb.HalfPlane(solid, period=p.period), obstacle(mb, p), law(mb, p), mb.Cells())
    if method == "fitted":
        return mb.Contact(mb.Block(solid, inf), obstacle(mb, p), law(mb, p), mb.Fitted())
    if method == "block":
        return mb.Contact(mb.Block(solid, size), obstacle(mb, p), law(mb, p), mb.Fitted())
    from microblock.fem import meshes

    mesh = meshes.uniform(meshes.Ground(far=size, reach=(-2 * p.scale, 2 * p.scale), half=False), p.scale / 2)
    return mb.Contact(mb.Body(mesh, solid, order=3, fixed="bottom"), obstacle(mb, p), law(mb, p))


class Cells:
    """The second code's state, constant on cells, with the names of a state."""

    def __init__(self, p, n=8192):
        line = plane.Line(p.height, p.period, n, p.solid, p.law)
        self.forces, self.residual = line.solve(p.load)
        self.n, self.period = n, p.period
        on = np.flatnonzero(np.diff(np.r_[0, (self.forces > 0).any(0), 0]))
        self.zones = {"contact": [tuple(v) for v in (on / n * p.period).reshape(-1, 2)]}

    def pressure_at(self, x, corner=None):
        i = (np.asarray(x) / self.period * self.n).astype(int) % self.n
        names = {"A": 0, "B": 1}
        return self.forces.sum(0)[i] if corner is None else self.forces[names[corner]][i]


def truth(mb, method, p):
    """A state that is better than what is asked by a factor of ten or more, of another method; and its
    name.
    """
    if p.period:
        return Cells(p), "plane"
    best = {"panels": p.rtol / 30, "cells": 1e-6, "fitted": 1e-6, "body": p.rtol / 30}[method]
    other = {"panels": "fitted", "cells": "panels", "fitted": "panels", "body": "block"}[method]
    try:
        signal.setitimer(signal.ITIMER_PROF, 12 if method == "panels" else SECONDS)
        if method != "panels" or best > 1e-5:
            return contact(mb, p, other).solve(load=p.load, rtol=best), other
    except (mb.MicroblockError, TooLong):
        if method != "panels":
            return None, "none"
    try:
        signal.setitimer(signal.ITIMER_PROF, SECONDS)
        return contact(mb, p, "panels").solve(load=p.load, rtol=max(p.rtol * 1e-3, 1e-9)), "panels finer"
    except (mb.MicroblockError, TooLong):
        return None, "none"


# ---- the error ----


def points(state, true, p):
    """Gauss points and weights between all edges, crowded at edges as those of Chebyshev are."""
    edges = {e for s in (state, true) for zones in s.zones.values() for zone in zones for e in zone}
    arms = (-p.solid[3] / 2, 0, p.solid[3] / 2)
    edges |= {s + arm for s in (*p.singular, *p.kinks) for arm in arms}
    if p.period:
        left = 0.0
        edges = {e % p.period for e in edges} | {left, left + p.period}
    edges = np.array(sorted(edges))
    edges = edges[np.r_[True, np.diff(edges) > 1e-13 * np.ptp(edges)]]
    t, w = np.polynomial.legendre.leggauss(300 if len(edges) < 40 else 60)
    s, ws = np.sin(pi / 2 * t), w * pi / 2 * np.cos(pi / 2 * t)
    middle, half = (edges[1:] + edges[:-1])[:, None] / 2, np.diff(edges)[:, None] / 2
    return (middle + half * s).ravel(), (half * ws).ravel()


def error(state, true, p):
    """Relative L2 error of pressure and of micromoment over ell."""
    x, w = points(state, true, p)
    if p.singular:
        arms = (-p.solid[3] / 2, p.solid[3] / 2) if p.law == "microblock" else (0.0,)
        ends = np.array([s + arm for s in p.singular for arm in arms])
        w = w * np.minimum(1, abs(x[:, None] - ends) / p.scale).prod(1)
    total = true.pressure_at(x)
    size = plane.norm(total, w)
    apart = plane.norm(state.pressure_at(x) - total, w)
    moment = 0.0
    if p.law == "microblock":

        def arm(s):
            return (1 + p.psi0) / 2 * s.pressure_at(x, "A") - (1 - p.psi0) / 2 * s.pressure_at(x, "B")

        moment = plane.norm(arm(state) - arm(true), w)
    return max(apart, moment) / size


def half_space(mb, k):
    """State k of the half-space: single contacts that one grid holds, and its error beside the second
    code's.
    """
    rng = np.random.default_rng((SEED, 10 + METHODS.index("half-space"), k))
    E, nu, beta = space_scenes.MATERIALS[rng.integers(4)]
    a, name, rtol = log(rng, 0.01, 0.3), space.LAWS[rng.integers(3)], log(rng, 5e-3, 3e-2)
    ell = a * log(rng, 1e-4, 1e2)
    load, kind = (
        4 / 3 * E / (1 - nu**2) * a**3,
        ("sphere", "ellipsoid", "quartic", "twins", "ripples")[rng.integers(5)],
    )
    c, d = rng.uniform(0.2, 1), a * rng.uniform(0.3, 1.5)
    height = {
        "sphere": lambda x, y: (x * x + y * y) / 2,
        "ellipsoid": lambda x, y: (x * x + c * y * y) / 2,
        "quartic": lambda x, y: (x * x + y * y) / 2 * (0.3 + c * (x * x + y * y) / a**2),
        "twins": lambda x, y: np.minimum((x - d) ** 2, (x + d) ** 2) / 2 + c * y * y / 2,
        "ripples": lambda x, y: (
            (x * x + y * y) / 2 + 0.05 * c * a * a * np.cos(3 * x / a) * np.cos(2 * y / a)
        ),
    }[kind]
    box = (0, 0, 2.2 * a / sqrt(c), 2.2 * a / sqrt(c))
    pair = [space.answer(height, [box], load, (E, nu, beta, ell), name, n=n) for n in (48, 128)]
    problem = space_scenes.Scene("fresh", height, [box], load, (E, nu, beta, ell), name)
    made, force = space_scenes.problem(mb, problem)
    start = time.process_time()
    signal.setitimer(signal.ITIMER_PROF, SECONDS)
    state = made.solve(load=force, rtol=rtol)
    signal.setitimer(signal.ITIMER_PROF, 0)
    seconds = time.process_time() - start
    values = _reader(state)
    mu = E / 2 / (1 + nu)
    apart = _surface_error(values, pair[1].solved, mu, ell)
    bar = _surface_error(_between_cells(pair[0].solved, mu, ell), pair[1].solved, mu, ell) * 48 / 128
    text = f"{kind:10s}{name:13s}ell/a {ell / a:.1e} rtol {rtol:.0e}"
    return text, apart, rtol, state.error_estimate, seconds, bar, state.warnings


def _reader(state):
    """Pressure of a half-space's state at places: by pressure_at, or constant on its cells."""
    if hasattr(state, "pressure_at"):
        return lambda x, y: state.pressure_at(np.column_stack([x.ravel(), y.ravel(), 0 * x.ravel()])).reshape(
            x.shape
        )
    return _on_grid(np.asarray(state.x1), np.asarray(state.x2), np.asarray(state.pressure))


def _on_grid(x1, x2, pressure):
    def values(x, y):
        i = np.rint((x - x1[0]) / (x1[1] - x1[0])).astype(int)
        j = np.rint((y - x2[0]) / (x2[1] - x2[0])).astype(int)
        inside = (i >= 0) & (i < len(x1)) & (j >= 0) & (j < len(x2))
        return np.where(inside, pressure[np.clip(i, 0, len(x1) - 1), np.clip(j, 0, len(x2) - 1)], 0.0)

    return values


def _between_cells(solved, mu, ell):
    """The second code's pressure, linear between the middles of its cells."""
    grids = [(i.x * ell, i.y * ell) for i in solved.model.islands]
    values = [np.pad(f.sum(0) * mu, 1) for f in solved.forces]

    def outer(v):
        return np.r_[2 * v[0] - v[1], v, 2 * v[-1] - v[-2]]

    parts = [
        RegularGridInterpolator((outer(x), outer(y)), v, bounds_error=False, fill_value=0.0)
        for (x, y), v in zip(grids, values)
    ]
    return lambda x, y: sum(part(np.stack([x, y], -1)) for part in parts)


def _surface_error(values, solved, mu, ell):
    """Relative L2 error of pressures at four points of each of the judge's cells."""
    true = _between_cells(solved, mu, ell)
    apart = size = 0.0
    for island in solved.model.islands:
        for a in (-0.25, 0.25):
            for b in (-0.25, 0.25):
                x, y = np.meshgrid(
                    (island.x + a * island.sides[0]) * ell,
                    (island.y + b * island.sides[1]) * ell,
                    indexing="ij",
                )
                t = true(x, y)
                apart += island.area * ((values(x, y) - t) ** 2).sum()
                size += island.area * (t**2).sum()
    return sqrt(apart / size)


# ---- the record ----


class TooLong(BaseException):  # not an Exception, which a library may catch
    pass


def _alarm(*_):
    raise TooLong


def record(mb, method, k):
    """One state: a dictionary with `error`, `rtol`, `estimate`, `bar` of the truth, `class` and a `text`."""
    row = {"k": k, "class": "state", "text": ""}
    signal.signal(signal.SIGPROF, _alarm)
    signal.setitimer(signal.ITIMER_PROF, SECONDS if method != "half-space" else 0)
    try:
        if method == "half-space":
            text, apart, rtol, estimate, seconds, bar, warnings = half_space(mb, k)
            return row | {
                "text": text,
                "error": apart,
                "rtol": rtol,
                "estimate": estimate,
                "seconds": seconds,
                "bar": bar,
                "warnings": list(warnings),
            }
        p = draw(method, k)
        row["text"] = str(p)
        start = time.process_time()
        state = contact(mb, p, method).solve(load=p.load, rtol=p.rtol)
        row["seconds"] = time.process_time() - start
        signal.setitimer(signal.ITIMER_PROF, 0)
        true, row["truth"] = truth(mb, method, p)
        if true is None:
            return row | {"class": "no truth"}
        bar = 5e-4 if p.period else (true.error_estimate or 0.0)
        return row | {
            "error": error(state, true, p),
            "rtol": p.rtol,
            "estimate": state.error_estimate,
            "bar": bar,
            "warnings": list(state.warnings),
        }
    except mb.MicroblockError as refused:
        return row | {"class": type(refused).__name__, "message": str(refused)}
    except TooLong:
        return row | {"class": "slow"}
    except Exception as crash:
        return row | {"class": "crash", "message": f"{type(crash).__name__}: {crash}"}
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)


def allowed(row):
    return max(row["rtol"], row["estimate"] or 0.0) + row["bar"]


def summary(rows):
    states = [r for r in rows if r["class"] == "state"]
    classes = defaultdict(int)
    for r in rows:
        classes[r["class"]] += 1
    beyond = [r for r in states if r["error"] > allowed(r)]
    dull = [r["estimate"] / r["error"] for r in states if r["estimate"] and r["error"] > 2 * r["bar"]]
    median, high = np.quantile(dull, [0.5, 0.9]) if dull else (np.nan, np.nan)
    quiet = sum(not r["warnings"] for r in beyond)
    worst = max((r["error"] / allowed(r) for r in states), default=0)
    return (
        f"{len(states)} states, {len(beyond)} beyond max(rtol, estimate) ({quiet} without a warning), "
        f"worst {worst:.2f}; "
        f"estimate/error median {median:.2f}, 90 % {high:.2f} (of {len(dull)}); {dict(classes)}"
    )


def line(method, row):
    text = f"{method} {row['k']:2d} {row['class']:9s} {row.get('seconds', 0):5.1f} s {row['text']}"
    if row["class"] != "state":
        return f"{text} {row.get('message', '')[:110]}"
    ratio = row["error"] / allowed(row)
    said = f"error {row['error']:.1e} estimate {row['estimate'] or np.nan:.1e}"
    other = f"truth {row.get('truth', 'space')} {row['bar']:.0e} {'BEYOND ' * (ratio > 1)}{ratio:.2f}"
    return f"{text} {said} {other} {'; '.join(row['warnings'])[:60]}"


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--method", choices=METHODS, action="append")
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args(arguments)
    import microblock as mb

    record_of = {}
    for method in options.method or METHODS:
        rows = record_of[method] = []
        for k in range(options.first, options.first + options.count):
            row = record(mb, method, k)
            rows.append(row)
            print(line(method, row), flush=True)
            if options.json:
                options.json.write_text(json.dumps(record_of, indent=1, default=float))
        print(f"== {method}: {summary(rows)}", flush=True)
    return record_of


if __name__ == "__main__":
    main()
