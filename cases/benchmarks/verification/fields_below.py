"""Fields below half-planes and half-spaces beside those of finite elements, 10 points of a state.

State k comes from (SEED, 70, k): a solid, a law, a load; three of four are lines. Panels and cells on these
stand beside fitted elements of a half-plane, cells with friction beside uniform elements of a block as deep
as 400 half-widths, and cells below a sphere beside a quarter of a block of hexahedra, supported 20 radii
away: finite elements share neither symbol nor quadrature with them. The error is the largest distance of
force stress, couple stress and rotation over the largest one at the points. Gradients of quadratic rotations
on hexahedra of 0.3 radii are off by 0.1: couple stresses in space count a third.
"""

import numpy as np

import microblock as mb
from microblock.fem import meshes3d

from . import SEED
from .judging import Case

POINTS = 10
KINDS = "panels", "cells", "friction", "space"
# what supports that are so far away, elements and cells leave: uniform elements a tenth of the contact long
CLOSE = {"panels": 4e-3, "cells": 4e-3, "friction": 1.5e-2, "space": 4e-2}
R = 10.0
LAWS = mb.Microblock, mb.Unilateral, mb.Microclamped


def case(k):
    """The Case of a state."""
    rng = np.random.default_rng((SEED, 70, k))
    kind = KINDS[k % len(KINDS)]
    law = LAWS[rng.integers(3)]
    nu = rng.uniform(0.0, 0.45)
    E_star = 100 / (1 - nu**2)
    in_space = kind == "space"
    a = (3 * R / (4 * E_star)) ** (1 / 3) if in_space else np.sqrt(4 * R / (np.pi * E_star))
    ell = a * np.exp(rng.uniform(np.log(0.15), np.log(0.8)))
    solid = mb.Cosserat(E=100, nu=nu, beta=rng.uniform(0.2, 1.7), ell=ell)
    x = a * rng.uniform(-1.2, 1.2, (2 if in_space else 1, POINTS))
    points = np.vstack((np.abs(x) if in_space else x, -a * rng.uniform(0.15, 1.5, POINTS)))
    share = rng.uniform(0.3, 0.95)

    def solve():
        if in_space:
            return mb.Contact(mb.HalfSpace(solid), mb.Sphere(R), law(), mb.Cells(nodes=64)).solve(load=1.0)
        ground = mb.HalfPlane(solid)
        if kind == "friction":
            rubbed = mb.Contact(ground, mb.Cylinder(R), law(friction=0.4), mb.Cells())
            return rubbed.history([(1.0, 0.4 * share)], rtol=2e-2).states[-1]
        method = mb.Panels() if kind == "panels" else mb.Cells(nodes=2048)
        return mb.Contact(ground, mb.Cylinder(R), law(), method).solve(load=1.0)

    def judge():
        if in_space:
            return on_quarter(solid, law(), a)
        if kind == "friction":
            elements = mb.Uniform(h=a / 7, order=3)
            rubbed = mb.Contact(mb.Block(solid, 400 * a), mb.Cylinder(R), law(friction=0.4), elements)
            return rubbed.history([(1.0, 0.4 * share)]).states[-1]
        return mb.Contact(mb.Block(solid), mb.Cylinder(R), law()).solve(load=1.0, rtol=1e-4)

    def verify(state):
        share_of_couples = 1 / 3 if in_space else 1.0
        far = distance(state.fields(*points), judge().fields(*points), share_of_couples)
        return far, CLOSE[kind], 0.0

    words = f"{kind}, {law.__name__}, nu {nu:.2f}, beta {solid.beta:.2f}, ell/a {ell / a:.2f}"
    return Case(words, CLOSE[kind], solve, verify)


def distance(at, expected, share_of_couples=1.0):
    """Largest distance of fields over their largest value, of couple stresses a share."""
    names = {"psi": 1.0, "stress": 1.0, "couple_stress": share_of_couples}
    pairs = [(getattr(at, name), getattr(expected, name), share) for name, share in names.items()]
    return max(share * float(np.abs(a - b).max() / np.abs(b).max()) for a, b, share in pairs)


def on_quarter(solid, law, a):
    """The State of a quarter of a block of hexahedra, supported 20 radii away, with a quarter of the load."""
    x = meshes3d.graded(reach=1.5 * a, step=0.3 * a, far=20 * a, growth=2.0)
    down = -meshes3d.graded(reach=1.2 * a, step=0.3 * a, far=20 * a, growth=2.0)[::-1]
    mesh = meshes3d.block(x, x, down, reach=1.4 * a)
    fixed = meshes3d.supports("bottom|right|back", x1="left", x2="front")
    if law.clamps_rotation:  # on the whole surface, as of a half-space
        fixed |= {name: f"{fixed[name]}|top" for name in ("psi1", "psi2")}
    return mb.Contact(mb.Body(mesh, solid, 2, fixed=fixed), mb.Sphere(R), law).solve(load=0.25)
