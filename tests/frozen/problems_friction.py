"""Problems of friction in plain data: seeded systems of a few nodes, and histories."""

import numpy as np

from .problems import (
    BELOW,
    CYLINDER,
    FUNCTIONS,
    MICROBLOCK,
    MICROCLAMPED,
    TILTED,
    UNILATERAL,
    WAVE,
    WEDGE,
    problem,
    solid,
)

SEED = 20261123
GOLDEN = (5**0.5 - 1) / 2
SETS = {
    "random": 245,
    "two corners": 210,
    "line": 240,
    "wedged": 110,
    "pressed": 35,
    "ties": 35,
    "sliding": 25,
}  # systems
LEAST = 0.05  # eigenvalue of a compliance over the largest, times its size
WEDGED = ((0.5, 3.0), 3.0, 0.003)  # friction, coupling and LEAST of the last set: some answers are not unique
TIED = (0.05, 0.9), 1.0, LEAST, True  # the same of evenly spaced nodes under an even obstacle


def system(name, number):
    """{compliance, gaps, friction, path, coupled} of a seeded system of 2 to 12 nodes.

    The compliance (corners n + n, corners n + n) gives what corner forces, one corner after the other, and
    tangential forces add to the gaps (corners, n), and the tangential displacements; the path has pairs of
    loads (P, Q).
    """
    draw = np.random.default_rng((SEED, list(SETS).index(name), number))
    n = int(draw.integers(2, 13))
    corners = 1 + (name == "two corners" or number % 3 == 0)
    make = _at_random if name in ("random", "two corners", "pressed", "sliding") else _on_a_line
    limits, *line_options = {"wedged": WEDGED, "ties": TIED}.get(name, ((0.05, 0.9),))
    friction = float(draw.uniform(*limits))
    gaps = draw.exponential(draw.choice([0.1, 0.3, 1.0]), size=(corners, n))
    if draw.random() < 0.1:
        gaps[-1, draw.integers(n)] = np.inf
    compliance = make(draw, corners, n, *line_options)
    path = _path(draw, friction, n)
    if name == "pressed":  # nodes open that stick, without any shear
        compliance = _coupled(compliance, 0.0, n)
        path = [(P * share, 0.0) for P, _ in path for share in (1.0, 0.3)]
    if name == "sliding":  # corners close and open while all nodes slip
        (P, _), sign = path[0], draw.choice([-1.0, 1.0])
        path = [(P * share, sign * friction * P * share) for share in (0.3, 1.2, 0.5)] + [(P, 0.0)]
    if name == "ties":
        gaps = np.round((gaps + gaps[:, ::-1]) * 2) / 4
    return {
        "compliance": compliance,
        "gaps": gaps - gaps.min(),
        "friction": friction,
        "path": path,
        "coupled": bool(draw.random() < 0.8),
    }


def _at_random(draw, corners, n):
    """Positive definite; the coupling is a share of what a full random matrix has."""
    size = (corners + 1) * n
    root = draw.normal(size=(size, size))
    return _coupled(root @ root.T / size + 0.1 * np.eye(size), draw.uniform(0.1, 1.0), n)


def _on_a_line(draw, corners, n, coupling=1.0, least=LEAST, even=False):
    """Responses that fall with the distance on a line, those of the coupling odd in it."""
    x = np.linspace(0, 3, n) if even else np.sort(draw.uniform(0, 3, size=n))
    apart = x[:, None] - x
    symmetric = np.exp(-np.abs(apart))
    odd = np.sign(apart) * np.exp(-np.abs(apart))
    signs = (1.0, -1.0)[:corners]
    turned = draw.uniform(0.1, 0.9) * np.exp(-2 * np.abs(apart))
    normal = np.block([[symmetric + a * b * turned for b in signs] for a in signs]) + 0.1 * np.eye(
        corners * n
    )
    cross = np.hstack([draw.uniform(0.5, 1.0) * odd + a * turned for a in signs])
    compliance = np.block([[normal, cross.T], [cross, draw.uniform(0.7, 1.5) * symmetric + 0.1 * np.eye(n)]])
    for share in coupling * 0.9 ** np.arange(50):
        coupled = _coupled(compliance, share, n)
        values = np.linalg.eigvalsh(coupled)
        if values[0] > least * values[-1] / len(values):
            return coupled
    raise ValueError("no coupling is small enough")


def _coupled(whole, share, n):
    """The compliance with its coupling times a share."""
    compliance = whole.copy()
    compliance[-n:, :-n] *= share
    compliance[:-n, -n:] *= share
    return compliance


def _path(draw, friction, n):
    """Two to five pairs (P, Q): pressing, then both forces up, down, back, or over to full slip."""
    P, pairs = n * draw.uniform(0.2, 1.0), []
    if draw.random() < 0.7:
        pairs.append((P, 0.0))
    for _ in range(draw.integers(2, 6) - len(pairs)):
        P = P * (1.0 if draw.random() < 0.5 else draw.uniform(0.4, 1.6))
        pairs.append((P, float(np.clip(draw.uniform(-1.15, 1.15), -1, 1)) * friction * P))
    return pairs


def history(name, method, law, pairs, obstacle=CYLINDER, **options):
    """A history: as the problems of `problems`, with pairs of loads in place of the load.

    cells     (reach, number) of cells that are longer towards the ends, in place of a tolerance
    levels    number of levels of graded cells, in place of a tolerance
    second    arguments of the solid of a second half-plane; {} of one like the first
    full      numbers of the states of which all is frozen; of others integrals alone
    supports  boundary whose forces are frozen
    """
    entries = problem(name, method, obstacle, law, None, pairs=pairs, coupled=True, full=(1,))
    return {**entries, "solid": solid(**options.pop("moduli", {})), "at": POINTS, **options}


def _law(name, friction=0.3, **options):
    return name, {"friction": friction, **options}


POINTS = (-0.22, 0.07)
FORTH = ((1.0, 0.0), (1.0, 0.2), (1.0, -0.15), (0.6, 0.1))  # pressed, sheared, back, and unloaded
OVER = (*FORTH, (0.6, 0.18))  # over to full slip
TOGETHER = ((0.4, 0.08), (1.0, 0.25), (0.7, 0.15))  # shear that grows with the normal force
MEMORY = ((1.0, 0.0), (1.0, 0.2), (1.0, -0.1), (0.8, -0.05), (1.2, -0.05))  # that panels follow
CELLS = (2.5, 64)
BEHIND = {"E": 150.0, "nu": 0.1, "ell": 0.2, "beta": 0.6}
SHORT = {"h": 0.2, "reach": 0.6, "order": 2}

HISTORIES = [
    history("cells microblock", "cells", _law("Microblock"), OVER, cells=CELLS, full=(3,)),
    history(
        "cells microblock uncoupled",
        "cells",
        _law("Microblock"),
        FORTH,
        cells=CELLS,
        coupled=False,
        full=(2,),
    ),
    history("cells unilateral wedge", "cells", _law("Unilateral", 0.6), TOGETHER, WEDGE, cells=CELLS),
    history(
        "cells unilateral punch", "cells", _law("Unilateral", 0.2), FORTH[:3], TILTED, cells=CELLS, full=(2,)
    ),
    history("cells microclamped", "cells", _law("Microclamped"), FORTH, cells=CELLS, full=(2,)),
    history(
        "cells microblock skew",
        "cells",
        _law("Microblock", 0.5),
        TOGETHER,
        "skew wedge",
        cells=CELLS,
        full=(1,),
    ),
    history(
        "cells unilateral on a body",
        "cells",
        _law("Unilateral"),
        FORTH,
        cells=CELLS,
        second=BEHIND,
        full=(3,),
    ),
    history(
        "cells microblock on a body",
        "cells",
        _law("Microblock"),
        FORTH[:3],
        cells=CELLS,
        second=BEHIND,
        full=(2,),
    ),
    history("cells of two levels", "cells", _law("Microblock"), FORTH[:2], "skew wedge", levels=2, full=()),
    history(
        "panels cylinder",
        "panels",
        _law("Unilateral"),
        MEMORY,
        second={},
        rtol=1e-6,
        full=(4,),
        beside=(0.8,),
    ),
    history(
        "panels wedge",
        "panels",
        _law("Unilateral"),
        TOGETHER,
        WEDGE,
        second={},
        rtol=1e-5,
        full=(2,),
        beside=(1.5,),
    ),
    history(
        "body microblock",
        "body",
        _law("Microblock"),
        OVER,
        mesh="block",
        order=2,
        below=BELOW,
        supports="bottom",
        full=(3,),
    ),
    history(
        "body microclamped uncoupled",
        "body",
        _law("Microclamped"),
        FORTH,
        mesh="block",
        order=2,
        coupled=False,
        supports="bottom",
        full=(2,),
    ),
    history(
        "newton microblock",
        "newton",
        _law("Microblock"),
        FORTH,
        mesh="block",
        order=2,
        below=BELOW[:1],
        supports="bottom",
        full=(2,),
    ),
    history(
        "newton cap microblock",
        "newton",
        _law("Microblock"),
        FORTH[:3],
        ("Plane", {"level": 1.0}),
        moduli={"ell": 0.1},
        mesh="cap",
        order=2,
        supports="base",
        full=(2,),
    ),
    history(
        "newton cap unilateral uncoupled",
        "newton",
        _law("Unilateral"),
        FORTH[:2],
        ("Plane", {"level": 1.0}),
        moduli={"ell": 0.1},
        mesh="cap",
        order=2,
        coupled=False,
        supports="base",
        full=(1,),
    ),
    history("uniform microblock", "uniform", _law("Microblock"), FORTH, domain=2.0, **SHORT, full=(2,)),
    history(
        "uniform unilateral newton",
        "uniform",
        _law("Unilateral"),
        FORTH[:2],
        domain=2.0,
        **SHORT,
        newton="al",
        full=(1,),
    ),
]

MEASURED = history("estimates", "cells", _law("Microblock"), FORTH[:2], second=BEHIND, rtol=0.3)

FUNCTIONS["valley"] = lambda x: 0.04 * np.abs(np.abs(x) - 0.15)


def between(name, method, law, obstacle=CYLINDER, second=None, **options):
    """A state without friction between a half-plane and a second one."""
    entries = {"beside": 0.38, **problem(name, method, obstacle, law, at=POINTS, **options)}
    return {**entries, "second": second or {}}


BETWEEN = [
    between("between panels microblock alike", "panels", MICROBLOCK, order=8),
    between("between panels microblock behind", "panels", MICROBLOCK, second=BEHIND, rtol=1e-4),
    between("between panels microblock wedge", "panels", MICROBLOCK, WEDGE, BEHIND, order=8),
    between("between panels unilateral", "panels", UNILATERAL, second=BEHIND, order=8),
    between("between panels microclamped classical", "panels", MICROCLAMPED, second={"beta": 0.0}, order=8),
    between(
        "valley panels unilateral",
        "panels",
        UNILATERAL,
        ("Shape", {"height": "valley", "kinks": (-0.15, 0.0, 0.15), "jumps": (0.08, -0.08, 0.08)}),
        order=8,
        load=2.0,
    ),
    between("between cells microblock", "cells", MICROBLOCK, second=BEHIND, nodes=96, window=(-0.7, 0.7)),
    between(
        "between cells unilateral punch", "cells", UNILATERAL, TILTED, BEHIND, nodes=64, window=(-0.4, 0.4)
    ),
    between(
        "between cells of a period",
        "cells",
        MICROBLOCK,
        WAVE,
        {"E": 150.0, "beta": 0.0},
        load=0.1,
        period=1.0,
        nodes=64,
    ),
]

IN_SPACE = {  # name: law, whether coupled
    "space points": ("Unilateral", True),
    "space clamped uncoupled": ("Microclamped", False),
    "space blocks": ("Microblock", True),
}
