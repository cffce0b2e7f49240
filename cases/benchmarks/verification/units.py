"""The same problems in other units, moved and mirrored: the same state must come back.

Scenes of the kinds "units" and "scale" of `space_problems` ask the same of the half-space.
"""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np

import microblock as mb
from microblock.model.intervals import zone_edges

from . import lines, panels
from .judging import Case

SCALE_FREE = 1e-6  # of the same computation in other units: rounding, through a few thousand sums


@dataclass(frozen=True)
class Change:
    """x -> sign*length*x + shift of lengths, stress*p of stresses."""

    name: str
    stress: float = 1.0
    length: float = 1.0
    shift: float = 0.0
    sign: int = 1


CHANGES = (
    Change("moduli x 1e9", stress=1e9),
    Change("lengths x 1e-6", length=1e-6),
    Change("shifted", shift=10.0),
    Change("mirrored", sign=-1),
)


def changed(contact, change):
    """A contact problem on a half-plane after the change."""
    a, b, old = change.sign * change.length, change.shift * change.length, contact.obstacle
    rigid = getattr(old, "height", old)
    obstacle = SimpleNamespace(height=lambda x: change.length * rigid((np.asarray(x) - b) / a))
    for name in ("kinks", "ends"):
        if getattr(old, name, None):
            setattr(obstacle, name, tuple(sorted(a * x + b for x in getattr(old, name))))
    solid = replace(contact.solid, E=contact.solid.E * change.stress, ell=contact.solid.ell * change.length)
    law = contact.law
    if len(law.corners) == 2:
        law = replace(law, psi0=law.psi0 * change.sign)
    period = contact.body.period and contact.body.period * change.length
    return contact.with_(body=mb.HalfPlane(solid, period=period), obstacle=obstacle, law=law)


def back(state, law, change):
    """x -> (p, M/ell) of a state of the changed problem, in the terms of the plain one."""
    a, b, swap = change.sign * change.length, change.shift * change.length, {"A": "B", "B": "A"}

    def values(x):
        levers = law.levers(x)
        own = {c: swap.get(c, c) if change.sign < 0 else c for c in levers}
        p = {c: state.pressure_at(a * x + b, own[c]) / change.stress for c in levers}
        return sum(p.values()), sum(levers[c] * p[c] for c in levers) / 2

    return values


def on_lines(method, k):
    """Cases of problem k of a method on the half-plane, one for each change."""
    words, contact, load, rtol, _ = lines.drawn(method, k)
    for change in CHANGES:

        def verify(state, change=change):
            plain = changed(contact, Change("plain")).solve(load=load, rtol=rtol)
            a, b = change.sign * change.length, change.shift * change.length
            places = [*zone_edges(plain.zones), *((np.array(zone_edges(state.zones)) - b) / a)]
            places += getattr(contact.obstacle, "kinks", ())  # a point there sees rounding of the place alone
            ends = getattr(contact.obstacle, "ends", ())
            apart = panels.distance(back(state, contact.law, change), lines.fields(plain), places, ends)
            return apart, max(state.error_estimate, plain.error_estimate), 0.0

        def solve(change=change):
            force = load * change.stress * change.length
            return changed(contact, change).solve(load=force, rtol=rtol)

        yield Case(f"{words} {change.name}", SCALE_FREE, solve, verify)
