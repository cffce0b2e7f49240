"""Contact problems whose numbers are frozen, as plain data; obstacles and laws go by their names.

A problem has a name, a method and what the method needs:

solid      arguments of the Cosserat solid (SOLID, with what differs from it)
obstacle   (name, arguments), or the name of one of FUNCTIONS
law        (name, arguments)
method     "panels" and "cells" of a half-plane, "fitted" and "uniform" meshes of a half-plane or block,
           "body" on another mesh, "newton" on one, monolithic
load       force per thickness (None where an `approach` is given)
at         abscissae of the contact points at which pressure, gap, rotation and micromoment are evaluated
below      points (x1, x2) at which the fields below the surface are evaluated

All other entries are options of the method. Under the cylinder Hertz' half-width is 0.34 at load 1.
All abscissae keep away from the edges of the zones.
"""

import numpy as np

SOLID = {"E": 100.0, "nu": 0.3, "ell": 0.085, "beta": 1.0}  # ell is 0.25 of Hertz' half-width
CYLINDER = ("Cylinder", {"R": 10.0})
WEDGE = ("Wedge", {"slope": 0.02})
PUNCH = ("Punch", {"half_width": 0.4})
TILTED = ("Punch", {"half_width": 0.4, "tilt": 0.01})
WAVE = ("Wave", {"amplitude": 0.01, "wavelength": 1.0})
ROUGH = ("Rough", {"period": 1.0, "slope": 0.1, "waves": (2, 16), "seed": 3})
MICROBLOCK = ("Microblock", {})
UNILATERAL = ("Unilateral", {})
MICROCLAMPED = ("Microclamped", {})
ROTATED = ("Microblock", {"psi0": 0.01})
LEVERS = ("Microblock", {"psi0": 0.01, "reading": "lever"})
VARYING = ("Microblock", {"psi0": "slow wave"})
AT = (-0.27, 0.06, 0.5)
BELOW = ((0.05, -0.02), (-0.2, -0.1), (0.3, -0.5))

FUNCTIONS = {
    "slow wave": lambda x: 0.01 * np.cos(3 * np.asarray(x)),
    "fast wave": lambda x: 0.01 * np.cos(40 * np.asarray(x)),
    "shifted parabola": lambda x: (x - 0.1) ** 2 / 20,
    "two bumps": lambda x: 0.005 * ((x / 0.3) ** 2 - 1) ** 2 + 0.001 * x,
    "tip": lambda x: np.abs(x) ** 1.5,
    "skew wedge": lambda x: np.where(x < 0.1, -0.02 * (x - 0.1), 0.05 * (x - 0.1)),
}


def solid(**other):
    return {**SOLID, **other}


def problem(name, method, obstacle=CYLINDER, law=MICROBLOCK, load=1.0, **options):
    entries = {
        "name": name,
        "method": method,
        "solid": SOLID,
        "obstacle": obstacle,
        "law": law,
        "load": load,
        **options,
    }
    if "approach" in options:
        entries["load"] = None
    return entries


PANELS = [
    problem("panels microblock cylinder alpha=0.25 rtol=1e-6", "panels", rtol=1e-6, at=AT, below=BELOW),
    problem("panels microblock cylinder alpha=0.25 rtol=1e-3", "panels", rtol=1e-3, at=AT),
    problem("panels microblock cylinder alpha=0.25 order=10", "panels", order=10, at=AT),
    problem(
        "panels microblock cylinder alpha=0.05 rtol=1e-6",
        "panels",
        solid=solid(ell=0.017),
        rtol=1e-6,
        at=(-0.25, 0.06, 0.5),
    ),
    problem(
        "panels microblock cylinder alpha=1 rtol=1e-6",
        "panels",
        solid=solid(ell=0.34),
        rtol=1e-6,
        at=(-0.27, 0.06, 0.6),
    ),
    problem(
        "panels microblock cylinder load=0.01 rtol=1e-6",
        "panels",
        load=0.01,
        rtol=1e-6,
        at=(-0.05, 0.03, 0.2),
    ),
    problem(
        "panels microblock cylinder nu=0.45 beta=1.9 rtol=1e-6",
        "panels",
        solid=solid(nu=0.45, beta=1.9),
        rtol=1e-6,
        at=AT,
    ),
    problem(
        "panels microblock cylinder beta=0.1 curvature=1 rtol=1e-6",
        "panels",
        solid=solid(beta=0.1, curvature=1.0),
        rtol=1e-6,
        at=AT,
    ),
    problem("panels unilateral cylinder rtol=1e-6", "panels", law=UNILATERAL, rtol=1e-6, at=AT, below=BELOW),
    problem(
        "panels microclamped cylinder rtol=1e-6", "panels", law=MICROCLAMPED, rtol=1e-6, at=AT, below=BELOW
    ),
    problem(
        "panels microblock psi0=0.01 cylinder rtol=1e-6", "panels", law=ROTATED, rtol=1e-6, at=AT, below=BELOW
    ),
    problem(
        "panels microblock psi0=0.01 in levers cylinder rtol=1e-6", "panels", law=LEVERS, rtol=1e-6, at=AT
    ),
    problem("panels microblock psi0(x) cylinder rtol=1e-6", "panels", law=VARYING, rtol=1e-6, at=AT),
    problem("panels microblock wedge rtol=1e-5", "panels", WEDGE, rtol=1e-5, at=(-0.1, 0.06, 0.7)),
    problem(
        "panels unilateral wedge rtol=1e-5", "panels", WEDGE, UNILATERAL, rtol=1e-5, at=(-0.1, 0.06, 0.7)
    ),
    problem("panels microblock punch rtol=1e-5", "panels", PUNCH, rtol=1e-5, at=(-0.2, 0.06)),
    problem("panels unilateral punch rtol=1e-5", "panels", PUNCH, UNILATERAL, rtol=1e-5, at=(-0.2, 0.06)),
    problem("panels microblock tilted punch rtol=1e-5", "panels", TILTED, rtol=1e-5, at=(-0.27, -0.1)),
    problem(
        "panels microblock samples rtol=1e-4",
        "panels",
        ("Profile", {"x": (-1.0, -0.1, 0.2, 1.0), "z": (0.03, 0.0, 0.001, 0.04)}),
        rtol=1e-4,
        at=(-0.2, 0.06, 0.7),
    ),
    problem(
        "panels microblock function with a kink rtol=1e-5",
        "panels",
        ("Shape", {"height": "tip", "kinks": (0.0,)}),
        rtol=1e-5,
        at=(-0.05, 0.02, 0.4),
    ),
    problem(
        "panels unilateral function with a corner rtol=1e-5",
        "panels",
        ("Shape", {"height": "skew wedge", "kinks": (0.1,), "jumps": (0.07,)}),
        UNILATERAL,
        rtol=1e-5,
        at=(0.0, 0.15, 0.7),
    ),
    problem(
        "panels microblock bare function rtol=1e-5",
        "panels",
        "shifted parabola",
        rtol=1e-5,
        at=(-0.17, 0.12, 0.6),
    ),
    problem(
        "panels unilateral two bumps rtol=1e-4",
        "panels",
        "two bumps",
        UNILATERAL,
        load=0.5,
        rtol=1e-4,
        at=(-0.3, 0.06, 0.6),
    ),
]

CELLS = [
    problem("cells microblock cylinder nodes=1024", "cells", window=(-0.6, 0.6), nodes=1024, at=AT),
    problem("cells microblock cylinder rtol=1e-3", "cells", window=(-0.6, 0.6), rtol=1e-3, at=AT),
    problem(
        "cells unilateral cylinder nodes=512", "cells", law=UNILATERAL, window=(-0.6, 0.6), nodes=512, at=AT
    ),
    problem(
        "cells microclamped cylinder nodes=512",
        "cells",
        law=MICROCLAMPED,
        window=(-0.6, 0.6),
        nodes=512,
        at=AT,
    ),
    problem(
        "cells microblock psi0=0.01 cylinder nodes=512",
        "cells",
        law=ROTATED,
        window=(-0.6, 0.6),
        nodes=512,
        at=AT,
    ),
    problem(
        "cells microblock psi0(x) wedge nodes=512",
        "cells",
        WEDGE,
        VARYING,
        window=(-0.8, 0.8),
        nodes=512,
        at=(-0.1, 0.15, 0.7),
    ),
    problem(
        "cells microblock punch nodes=512", "cells", PUNCH, window=(-0.6, 0.6), nodes=512, at=(-0.2, 0.06)
    ),
    problem(
        "cells of a period microblock wave nodes=512",
        "cells",
        WAVE,
        load=0.5,
        period=1.0,
        nodes=512,
        at=(-0.1, 0.06, 0.3),
    ),
    problem(
        "cells of a period microclamped wave nodes=512",
        "cells",
        WAVE,
        MICROCLAMPED,
        load=0.5,
        period=1.0,
        nodes=512,
        at=(-0.1, 0.06, 0.3),
    ),
    problem(
        "cells of a period unilateral wave approach=0.003 nodes=512",
        "cells",
        WAVE,
        UNILATERAL,
        approach=0.003,
        period=1.0,
        nodes=512,
        at=(-0.1, 0.06, 0.3),
    ),
    problem(
        "cells of a period microblock psi0(x) rough nodes=2048",
        "cells",
        ROUGH,
        ("Microblock", {"psi0": "fast wave"}),
        solid=solid(ell=0.005),
        load=0.5,
        period=1.0,
        nodes=2048,
    ),
    problem(
        "cells of a period microblock plane nodes=128",
        "cells",
        ("Plane", {"level": 0.01}),
        ROTATED,
        load=0.5,
        period=1.0,
        nodes=128,
        at=(-0.27, 0.06),
    ),
    problem(
        "cells of a period microblock samples nodes=512",
        "cells",
        ("Profile", {"x": (-0.5, -0.1, 0.2, 0.5), "z": (0.01, 0.0, 0.001, 0.01)}),
        load=0.5,
        period=1.0,
        nodes=512,
        at=(-0.04, 0.06, 0.45),
    ),
]

UNIT = {"E": 0.91, "nu": 0.3, "ell": 1.0, "beta": 1.0}  # E* = 1
SHARP = [
    problem(
        f"{method} unilateral {name} of E*=1 {nodes}",
        method,
        obstacle,
        UNILATERAL,
        load,
        solid=UNIT,
        **options,
    )
    for name, obstacle, load in (
        ("cylinder", ("Cylinder", {"R": 1.0}), np.pi / 4),
        ("punch", ("Punch", {"half_width": 1.0}), 1.0),
        ("wedge", ("Wedge", {"slope": 1.0}), 1.0),
    )
    for method, nodes, options in (
        ("cells", "nodes=400", {"nodes": 400, "window": (-1.5, 1.5), "at": (-0.45, 0.123)}),
        ("cells", "nodes=1000", {"nodes": 1000, "window": (-1.5, 1.5), "at": (-0.45, 0.123)}),
        ("panels", "rtol=1e-4", {"rtol": 1e-4, "at": (-0.45, 0.123)}),
    )
]
FULL = np.pi * 0.05  # mean pressure that closes the wave by Westergaard, times E* = 1
WAVY = [
    problem(
        f"cells of a period {name} wave of E*=1 load={part:g}",
        "cells",
        ("Wave", {"amplitude": 0.05, "wavelength": 1.0}),
        law,
        part * FULL,
        solid={**UNIT, "ell": 0.05},
        period=1.0,
        nodes=512,
        at=(0.031, 0.22),
    )
    for name, law in (("microblock", MICROBLOCK), ("unilateral", UNILATERAL))
    for part in (0.1, 0.8)
] + [
    problem(
        "cells of a period microblock rough of E*=1 nodes=1024",
        "cells",
        ("Rough", {"period": 1.0, "slope": 0.1, "waves": (4, 64), "seed": 1}),
        solid={**UNIT, "ell": 0.01},
        load=0.005,
        period=1.0,
        nodes=1024,
    )
]

FITTED = [
    problem("fitted microblock cylinder rtol=1e-4", "fitted", rtol=1e-4, at=AT[:2], below=BELOW[1:]),
    problem(
        "fitted microblock cylinder block=6 rtol=1e-3", "fitted", domain=6.0, even=True, rtol=1e-3, at=AT[:2]
    ),
    problem("fitted microblock cylinder block=6 order=6", "fitted", domain=6.0, order=6, at=AT[:2]),
    problem(
        "fitted unilateral cylinder block=6 rtol=1e-3",
        "fitted",
        law=UNILATERAL,
        domain=6.0,
        rtol=1e-3,
        at=AT[:2],
    ),
    problem("fitted microclamped cylinder rtol=1e-3", "fitted", law=MICROCLAMPED, rtol=1e-3, at=AT[:2]),
    problem(
        "fitted microblock psi0=0.01 cylinder block=6 rtol=1e-4",
        "fitted",
        law=ROTATED,
        domain=6.0,
        rtol=1e-4,
        at=AT[:2],
    ),
    problem("fitted microblock wedge rtol=1e-3", "fitted", WEDGE, rtol=1e-3, at=(-0.1, 0.06)),
    problem(
        "fitted unilateral punch block=6 rtol=1e-3",
        "fitted",
        PUNCH,
        UNILATERAL,
        domain=6.0,
        rtol=1e-3,
        at=(-0.2, 0.06),
    ),
    problem(
        "fitted unilateral wave block=1.5 rtol=1e-3",
        "fitted",
        WAVE,
        UNILATERAL,
        load=0.3,
        domain=1.5,
        rtol=1e-3,
        at=(0.06, 0.5),
    ),
    problem(
        "fitted unilateral bare function rtol=1e-3",
        "fitted",
        "shifted parabola",
        UNILATERAL,
        rtol=1e-3,
        at=(-0.17, 0.12),
    ),
]

COARSE = {"domain": 4.0, "h": 0.04, "reach": 0.8}
UNIFORM = [
    problem("uniform microblock cylinder condensed", "uniform", **COARSE, at=AT, below=BELOW),
    problem(
        "uniform microblock cylinder order=3 condensed",
        "uniform",
        domain=4.0,
        h=0.1,
        reach=0.8,
        order=3,
        at=AT,
    ),
    problem(
        "uniform microblock cylinder augmented Lagrangian",
        "uniform",
        **COARSE,
        newton="al",
        at=AT,
        below=BELOW,
    ),
    problem("uniform microblock cylinder penalty", "uniform", **COARSE, newton="penalty", at=AT),
    problem(
        "uniform microblock cylinder penalty rho=1e5", "uniform", **COARSE, newton="penalty", rho=1e5, at=AT
    ),
    problem(
        "uniform microclamped cylinder augmented Lagrangian",
        "uniform",
        law=MICROCLAMPED,
        **COARSE,
        newton="al",
        at=AT,
    ),
    problem(
        "uniform unilateral cylinder triangles", "uniform", law=UNILATERAL, **COARSE, shape="triangles", at=AT
    ),
    problem(
        "uniform microblock psi0=0.01 cylinder condensed",
        "uniform",
        law=ROTATED,
        domain=4.0,
        h=0.1,
        reach=0.8,
        order=2,
        at=AT,
    ),
]

BODIES = [
    problem("body block microblock cylinder", "body", mesh="block", at=AT, below=BELOW),
    problem("body block unilateral wedge", "body", WEDGE, UNILATERAL, mesh="block", at=(-0.1, 0.06)),
    problem("body block microclamped cylinder", "body", law=MICROCLAMPED, mesh="block", at=AT),
    problem("body block microblock psi0(x) cylinder", "body", law=VARYING, mesh="block", at=AT),
    problem("body block microblock cylinder rtol=1e-3", "body", mesh="block", rtol=1e-3, at=AT),
    problem("body block unilateral rough", "body", ROUGH, UNILATERAL, mesh="block", load=0.2),
    problem(
        "body dome microblock plane",
        "body",
        ("Plane", {"level": 1.0}),
        solid=solid(ell=0.1),
        mesh="dome",
        at=(-0.1, 0.13),
    ),
]

STRIP = {"E": 2.6, "nu": 0.3, "ell": 0.2, "beta": 1.0}
NEWTON = [
    problem(
        "newton strip line",
        "newton",
        ("Plane", {"level": 0.002}),
        ("Microblock", {"psi0": 0.02}),
        solid=STRIP,
        approach=0.01,
        mesh="line",
        order=6,
    ),
    problem(
        "newton strip line partial",
        "newton",
        ("Plane", {"level": 0.002}),
        ("Microblock", {"psi0": 0.02}),
        solid=STRIP,
        approach=0.004,
        mesh="line",
        order=6,
    ),
    problem(
        "newton strip column",
        "newton",
        ("Plane", {"level": 0.002}),
        ("Microblock", {"psi0": -0.02}),
        solid=STRIP,
        approach=0.01,
        mesh="column",
        order=6,
    ),
    problem(
        "newton strip column penalty",
        "newton",
        ("Plane", {"level": 0.002}),
        ("Microblock", {"psi0": 0.02}),
        solid=STRIP,
        approach=0.01,
        mesh="column",
        order=4,
        newton="penalty",
    ),
    problem(
        "newton strip column unilateral",
        "newton",
        ("Plane", {}),
        UNILATERAL,
        solid=STRIP,
        load=0.01,
        mesh="column",
        order=4,
    ),
    problem(
        "newton block microblock psi0=0.01 cylinder",
        "newton",
        law=ROTATED,
        approach=0.02,
        mesh="block",
        order=2,
    ),
    problem(
        "newton block microblock cylinder penalty",
        "newton",
        load=0.5,
        mesh="block",
        order=2,
        newton="penalty",
        rho=1e6,
    ),
    problem("newton block unilateral wedge", "newton", WEDGE, UNILATERAL, load=0.5, mesh="block", order=2),
    problem(
        "newton dome microblock plane",
        "newton",
        ("Plane", {"level": 1.0}),
        ROTATED,
        solid=solid(ell=0.1),
        approach=0.02,
        mesh="dome",
        order=3,
    ),
]

# load paths: their events from first touch to the load, and the half-width at `states` on the way
PATHS = [
    problem("path panels microblock cylinder", "panels", load=1.0, rtol=1e-6, states=(0.3,)),
    problem(
        "path panels microblock psi0=0.01 cylinder", "panels", law=ROTATED, load=1.0, rtol=1e-4, states=(0.5,)
    ),
    problem("path panels unilateral wedge", "panels", WEDGE, UNILATERAL, load=1.0, rtol=1e-4, states=(0.5,)),
    problem(
        "path panels unilateral two bumps", "panels", "two bumps", UNILATERAL, load=3.0, rtol=1e-3, states=()
    ),
    problem("path body block microblock cylinder", "body", mesh="block", load=1.0, states=(0.3,)),
    problem(
        "path body dome microblock plane",
        "body",
        ("Plane", {"level": 1.0}),
        solid=solid(ell=0.1),
        mesh="dome",
        load=0.5,
        states=(0.3,),
    ),
]

# loads at which two zones of partial contact touch on the axis
COALESCENCE = [
    problem("coalescence panels microblock cylinder", "panels"),
    problem("coalescence panels microblock cylinder beta=0.5", "panels", solid=solid(beta=0.5)),
    problem("coalescence panels microblock wedge", "panels", WEDGE),
    problem("coalescence uniform microblock cylinder", "uniform", solid=solid(ell=0.34), **COARSE),
]

# command lines: beginnings of the numbers of their JSON that are kept, their kind, and the tolerance of
# what is estimated where no error estimate stands beside it
COMMANDS = {
    "strip": (("",), "discrete", None),
    "strip --model column --method penalty --rho 1e6 --order 4 --elements 5 --psi0-deg -1.5": (
        ("psi", "u1", "u2", "tr", "mi", "de", "L"),
        "discrete",
        None,
    ),
    "strip --ell-over-H 0.2 --delta-over-H 0.03 --rtol 1e-6 --curvature 1": (
        ("state", "psi", "tr", "mi", "de", "L", "unknowns", "profile"),
        "estimated",
        1e-6,
    ),
    "hertz": (("model", "unknowns", "states", "events"), "estimated", 1e-3),
    "hertz --contact unilateral --loads 0.5 2": (("states",), "estimated", 1e-3),
    "hertz --contact microclamped --alpha 0.5": (("states",), "estimated", 1e-3),
    "hertz --obstacle wedge --psi0-deg 0.1 --rtol 1e-4": (("states",), "estimated", 1e-4),
    "hertz --obstacle punch --tilt-deg 0.1 --psi0-reading lever --psi0-deg 0.1": (
        ("states",),
        "estimated",
        1e-3,
    ),
    "hertz --model fe": (("unknowns", "states"), "estimated", 1e-3),
    "hertz --model fe --mesh uniform --h 0.2 --order 1 --method al --domain 9 --rho 100": (
        ("states",),
        "discrete",
        None,
    ),
    "size_effect --alphas 0.25 1 --rtol 1e-4": (("alpha_mid", "laws"), "estimated", 1e-4),
    "layers --alphas 0.1 --positions 0.3 0.6": (("layers", "mode"), "estimated", 1e-3),
}
ENDLESS = {"hertz --model fe"}  # on half-planes, whose energy grows with the size of the mesh
REFUSED_COMMANDS = [
    "strip --nu 0.5",
    "strip --rtol 1e-17",
    "hertz --alpha -1",
    "hertz --h 0.1",
    "hertz --alpha 1e-8",
    "strap",
    "strip --unknown 1",
]
