"""A tenth of all problems drawn by program, in other units, moved and mirrored: the same state must come
back.

    python -m tests.judges.invariance [--method NAME] [--count N] [--seconds S]

prints a line where a moved state differs from the plain one by more than the larger of both estimates, or
is refused where the plain one is not; where only units differ, also differences above 1e-6 that the
estimates cover ("not free of scale").
"""

from __future__ import annotations

import argparse
import signal
from dataclasses import dataclass, replace
from math import inf

import numpy as np

from . import fresh, space_scenes

SCALE_FREE = 1e-6  # of the same computation in other units: rounding, through a few thousand sums
STEP = 10  # every tenth problem


@dataclass(frozen=True)
class Change:
    """x -> sign*length*x + shift of lengths, stress*p of stresses."""

    name: str
    stress: float = 1.0
    length: float = 1.0
    shift: float = 0.0  # in half-widths
    sign: int = 1

    @property
    def units_only(self):
        return self.shift == 0 and self.sign == 1


CHANGES = (
    Change("moduli x 1e9", stress=1e9),
    Change("lengths x 1e-6", length=1e-6),
    Change("shifted by 1e3", shift=1e3),
    Change("mirrored", sign=-1),
)


class Moved:
    """An obstacle of any place and unit, with the singular points that the problem names."""

    def __init__(self, p, change, height):
        a, b = change.sign * change.length, change.shift * p.scale * change.length
        self.height = lambda x: change.length * height((np.asarray(x) - b) / a)
        jumps = dict(zip(p.kinks, p.jumps or [0.0] * len(p.kinks)))
        kinks = sorted((a * k + b, jump) for k, jump in jumps.items())
        if kinks:
            self.kinks = tuple(k for k, _ in kinks)
            if p.jumps:
                self.jumps = tuple(jump for _, jump in kinks)
        if p.singular:
            self.ends = tuple(sorted(a * e + b for e in p.singular))


def _kinked(p):
    """The wedge's tip, which its class knows, as a singular point."""
    return replace(p, kinks=(0.0,), jumps=(2 * p.obstacle[1][0],)) if p.kind == "wedge" else p


def moved(mb, p, change, method):
    """The contact problem after the change, and its load."""
    if p.kind == "samples":
        x, z = p.obstacle[1]
        x = change.sign * x + change.shift * p.scale
        order = np.argsort(x)
        q = replace(p, obstacle=("samples", (change.length * x[order], change.length * z[order])))
        body = fresh.obstacle(mb, q)
    else:
        body = Moved(_kinked(p), change, p.height)
    E, nu, beta, ell = p.solid
    solid = (E * change.stress, nu, beta, ell * change.length)
    period = p.period and p.period * change.length
    q = replace(p, solid=solid, psi0=p.psi0 * change.sign, scale=p.scale * change.length, period=period)
    plain = fresh.contact(mb, replace(q, kind="given", obstacle=("Cylinder", (1.0,))), method)
    problem = mb.Contact(plain.body, body, plain.law, plain.method)
    return problem, p.load * change.stress * change.length


class Back:
    """A state of the changed problem in the plain problem's terms."""

    def __init__(self, state, p, change):
        self.state, self.change = state, change
        self.a, self.b = change.sign * change.length, change.shift * p.scale * change.length

        def back(zone):
            return tuple(sorted((np.array(zone) - self.b) / self.a))

        self.zones = {name: [back(zone) for zone in zones] for name, zones in state.zones.items()}

    def pressure_at(self, x, corner=None):
        if self.change.sign < 0 and corner in ("A", "B"):
            corner = {"A": "B", "B": "A"}[corner]
        return self.state.pressure_at(self.a * x + self.b, corner) / self.change.stress


def compared(mb, method, k, seconds):
    """Lines about problem k of a method."""
    p = fresh.draw(method, k)
    plain = _solved(mb, lambda: moved(mb, p, Change("plain"), method), p.rtol, seconds)
    if isinstance(plain, str):
        return [f"{method} {k} {p}: plain {plain}"]
    lines = []
    for change in CHANGES:
        if change.shift and (method == "body" or p.period):
            continue  # a body stays where it is
        name = f"{method} {k} {p} {change.name}"
        state = _solved(mb, lambda: moved(mb, p, change, method), p.rtol, seconds)
        if isinstance(state, str):
            lines.append(f"{name}: FAILED {state}")
            continue
        apart = fresh.error(Back(state, p, change), plain, p)
        allowed = max(state.error_estimate or 0.0, plain.error_estimate or 0.0)
        lines += _said(name, change, apart, allowed)
    return lines


def _said(name, change, apart, allowed):
    if not apart <= allowed:
        return [f"{name}: FAILED apart by {apart:.1e}, estimates {allowed:.1e}"]
    if change.units_only and apart > SCALE_FREE:
        return [f"{name}: not free of scale, {apart:.1e}, estimates {allowed:.1e}"]
    return []


def _solved(mb, made, rtol, seconds):
    signal.signal(signal.SIGPROF, fresh._alarm)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        problem, load = made()
        return problem.solve(load=load, rtol=rtol)
    except fresh.TooLong:
        return f"over {seconds} s"
    except mb.MicroblockError as error:
        return f"{type(error).__name__}: {error}"
    except Exception as error:
        return f"CRASH {type(error).__name__}: {error}"
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)


def in_space(mb, k, seconds):
    """Lines about scene k of the half-space."""
    s = space_scenes.scene(k)
    row = space_scenes.outcome(s, None, seconds=seconds)
    if row["figures"] is None:
        return [f"space {k} {s.kind} {s.note}: plain {row['class']} {row['message'][:90]}"]
    lines = []
    width = min((box[2] for box in s.boxes or [(0, 0, 1.0)]), default=0.1)
    for change in CHANGES:
        if change.shift and s.window:
            continue
        other = space_scenes.outcome(_scene(s, change, width), None, seconds=seconds)
        name = f"space {k} {s.kind} {s.note} {change.name}"
        if other["figures"] is None:
            lines.append(f"{name}: FAILED {other['class']} {other['message'][:90]}")
            continue
        size = max(row["figures"]["norm"], 1e-300)
        apart = max(
            abs(other["figures"]["norm"] - row["figures"]["norm"]) / size if s.norm else 0.0,
            abs(other["figures"]["approach"] / row["figures"]["approach"] - 1),
        )
        lines += _said(name, change, apart, max(row["estimate"] or 0.0, other["estimate"] or 0.0))
    return lines


def _scene(s, change, width):
    b = change.shift * width
    if change.units_only:
        return replace(s, unit=(s.unit[0] * change.stress, s.unit[1] * change.length))
    places = tuple((change.sign * x + b, y) for x, y in s.summits)
    return replace(s, height=lambda x, y: s.height(change.sign * (x - b), y), summits=places)


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--method", choices=("panels", "cells", "fitted", "body", "space"), action="append")
    parser.add_argument("--count", type=int, default=inf, help="problems of each method")
    parser.add_argument("--seconds", type=float, default=20)
    options = parser.parse_args(arguments)
    import microblock as mb

    failed = 0
    for method in options.method or ("panels", "cells", "fitted", "body", "space"):
        numbers = range(0, 200 if method == "space" else 60, STEP)
        for k in list(numbers)[: int(min(options.count, len(numbers)))]:
            check = in_space if method == "space" else lambda mb, k, seconds: compared(mb, method, k, seconds)
            lines = check(mb, k, options.seconds)
            failed += sum("FAILED" in line for line in lines)
            print("\n".join(line[:230] for line in lines) or f"{method} {k}: the same", flush=True)
    print(f"{failed} failed")
    return failed


if __name__ == "__main__":
    main()
