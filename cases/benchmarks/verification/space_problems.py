"""200 surfaces in three dimensions, drawn by program, beside the second code `space`: approach, norm of the
pressure and load on each summit. Its answers are kept in `space_truth.json`.
"""

import json
from dataclasses import dataclass, replace
from math import cos, inf, pi, sin, sqrt
from pathlib import Path

import numpy as np

from . import SEED, NoAnswer, space
from .judging import Case
from .obstacles import log

RTOL = 1e-2
TRUTH = Path(__file__).with_name("space_truth.json")
MATERIALS = [(0.91, 0.3, 1.0), (0.91, 0.3, 1.0), (1.2, 0.2, 0.4), (0.8, 0.4, 1.7)]  # E, nu, beta
KINDS = (
    ("summits", 60), ("pin", 30), ("ridge", 14), ("saddle", 10), ("light", 12), ("scale", 24),
    ("window", 12), ("wavy", 16), ("ends", 12), ("units", 10),
)  # fmt: skip


@dataclass(frozen=True)
class Scene:
    """A surface, its load and its solid; `boxes` (x, y, half-widths) contain every contact, None where none
    exists.
    """

    kind: str
    height: object
    boxes: list | None
    load: float
    solid: tuple
    law: str
    summits: tuple = ((0.0, 0.0),)
    features: tuple = ()
    period: float | None = None
    window: tuple | None = None
    norm: bool = True  # whether the pressure has a finite L2 norm
    unit: tuple = (1.0, 1.0)  # of stress and of length
    note: str = ""


def paraboloids(summits, radii, levels):
    def height(x, y):
        x, y = np.broadcast_arrays(np.asarray(x, float), y)
        rise = np.full(x.shape, inf)
        for (a, b), r, z in zip(summits, radii, levels):
            rise = np.minimum(rise, z + ((x - a) ** 2 + (y - b) ** 2) / (2 * r))
        return rise

    return height


def _base(rng, low=0.005, high=0.3):
    """Hertz radius under a sphere of radius 1, its load, a solid and a law."""
    E, nu, beta = MATERIALS[rng.integers(len(MATERIALS))]
    a = log(rng, low, high)
    load = 4 / 3 * E / (1 - nu**2) * a**3
    return a, load, (E, nu, beta, a * log(rng, 1e-2, 10)), space.LAWS[rng.integers(3)]


def _reach(solid, radii, levels, load):
    """Half-widths that contain the contact of each summit: where the height is below the approach of one
    alone.
    """
    E, nu = solid[:2]
    depth = min(z + space.hertz(E, nu, r, load)[2] for r, z in zip(radii, levels))
    return [sqrt(2 * r * max(depth - z, 0)) for r, z in zip(radii, levels)]


def _boxes(summits, reach):
    return [(x, y, 1.02 * r, 1.02 * r) for (x, y), r in zip(summits, reach) if r > 0]


def summits(rng):
    a, load, solid, law = _base(rng)
    count = int(rng.integers(1, 10))
    if law == "microblock" and solid[3] > 0.7 * a:
        count = min(count, 3)  # every summit has four islands then
    radii = [log(rng, 0.05, 2) for _ in range(count)]
    spread = a * log(rng, 5, 1000)
    places = []
    while len(places) < count:
        place = tuple(rng.uniform(-spread, spread, 2))
        if all(np.hypot(place[0] - x, place[1] - y) > 3 * a for x, y in places):
            places.append(place)
        spread *= 1.02
    depth = min(space.hertz(*solid[:2], r, load / count)[2] for r in radii)
    levels = [rng.uniform(0, 0.5) * depth if rng.random() < 0.4 else 0.0 for _ in range(count)]
    height, boxes = paraboloids(places, radii, levels), _boxes(places, _reach(solid, radii, levels, load))
    note = f"{count} in {spread / a:.0f} a"
    return Scene("summits", height, boxes, load, solid, law, tuple(places), note=note)


def _outside(r, a):
    """Gap of a sphere of radius 1 outside of its Hertz contact."""
    u = ((2 * a * a - r * r) * np.arcsin(a / r) + r * a * sqrt(1 - (a / r) ** 2)) / pi
    return r * r / 2 - a * a + u


def pin(rng):
    a, load, solid, law = _base(rng, 0.01, 0.3)
    solid = (*solid[:3], a * log(rng, 1e-3, 0.5))
    rho, width, turn = a * rng.uniform(1.05, 4), a * log(rng, 0.02, 0.5), rng.uniform(0, 2 * pi)
    tip = _outside(rho, a) + 0.1 * a * a  # stands below the deformed surface: it must carry
    at = (rho * cos(turn), rho * sin(turn))
    cosine = rng.random() < 0.5

    def height(x, y):
        r = np.hypot(x - at[0], y - at[1])
        sphere = (x * x + y * y) / 2
        if cosine:
            return sphere - np.where(r < width / 2, tip * (1 + np.cos(2 * pi * r / width)) / 2, 0.0)
        return np.minimum(sphere, rho * rho / 2 - tip + r * r * 4 * (tip + rho * width) / width**2)

    boxes = [(0, 0, a, a), (*at, 0.52 * width, 0.52 * width)]
    note = f"{'cosine' if cosine else 'parabola'} of width {width / a:.3f} a at {rho / a:.2f} a"
    return Scene("pin", height, boxes, load, solid, law, ((0.0, 0.0), at), ((*at, width / 2),), note=note)


def ridge(rng):
    a, load, solid, law = _base(rng, 0.01, 0.1)
    draw = rng.random()
    if draw < 0.25:  # a cylinder: nothing rises along it
        turn = rng.uniform(0, pi)
        return Scene(
            "ridge",
            lambda x, y: (x * cos(turn) + y * sin(turn)) ** 2 / 2,
            None,
            load,
            solid,
            law,
            note="cylinder",
        )
    ratio, turn = log(rng, 5, 200 if draw < 0.6 else 20), 0.0 if draw < 0.6 else rng.uniform(0, pi)
    c, s = cos(turn), sin(turn)

    def height(x, y):
        return (x * c + y * s) ** 2 / 2 + (y * c - x * s) ** 2 / (2 * ratio)

    depth = 1.6 * space.hertz(*solid[:2], sqrt(ratio), load)[2]  # of an ellipsoid at most that of this sphere
    p, q = sqrt(2 * depth), sqrt(2 * depth * ratio)
    box = (0, 0, np.hypot(p * c, q * s), np.hypot(p * s, q * c))
    return Scene(
        "ridge", height, [box], load, solid, law, note=f"ellipsoid {ratio:.0f}:1 turned by {turn:.2f}"
    )


def saddle(rng):
    a, load, solid, law = _base(rng, 0.01, 0.1)
    draw, k = rng.random(), log(rng, 0.01, 1)
    if draw < 0.6:
        note, m = ("falls for ever", -inf) if draw < 0.4 else ("rises to a level", log(rng, 1e-2, 1) * a**2)

        def unbounded(x, y):
            return x * x / 2 - k * y * y / 2 if draw < 0.4 else np.minimum((x * x + y * y) / 2, m)

        return Scene("saddle", unbounded, None, load, solid, law, note=note)
    b = a * log(rng, 2, 200)  # two summits of curvature 1 and k, a saddle between them

    def height(x, y):
        return x * x / 2 + k * (y * y - b * b) ** 2 / (8 * b * b)

    places = ((0.0, -b), (0.0, b))
    depth = space.hertz(*solid[:2], k**-0.5, load)[2] * 1.3
    p, q = sqrt(2 * depth), b - sqrt(max(b * b - sqrt(8 * b * b * depth / k), 0))
    boxes = [(x, y, p, max(q, sqrt(2 * depth / k))) for x, y in places]
    return Scene(
        "saddle",
        height,
        boxes,
        load,
        solid,
        law,
        places,
        note=f"two summits at {b / a:.1f} a, curvature {k:.2f}",
    )


def _sphere(rng, kind, a, solid, law, **more):
    load, middle = 4 / 3 * solid[0] / (1 - solid[1] ** 2) * a**3, [(0.0, 0.0)]
    boxes = _boxes(middle, _reach(solid, [1.0], [0.0], load))
    return Scene(kind, paraboloids(middle, [1.0], [0.0]), boxes, load, solid, law, **more)


def light(rng):
    _, _, solid, law = _base(rng)
    a = log(rng, 1e-4, 0.02)
    return _sphere(rng, "light", a, (*solid[:3], a * log(rng, 1e-3, 1e3)), law, note=f"a {a:.1e}")


def scale(rng):
    a, _, solid, law = _base(rng, 0.05, 1)
    ell = 10 ** rng.uniform(-7, 4)
    return _sphere(rng, "scale", a, (*solid[:3], ell), law, note=f"ell/a {ell / a:.1e}")


def window(rng):
    a, _, solid, law = _base(rng)
    wide = a * 1.5 * log(rng, 1.2, 1000) + solid[3]
    return _sphere(rng, "window", a, solid, law, window=(-wide, wide), note=f"{wide / a:.0f} a wide")


def wavy(rng):
    E, nu, beta = MATERIALS[rng.integers(len(MATERIALS))]
    height_, law = log(rng, 1e-3, 0.1), space.LAWS[rng.integers(3)]
    ell = log(rng, 0.003, 0.1)
    x0, y0 = rng.uniform(-0.5, 0.5, 2)
    product, R = rng.random() < 0.4, 1 / (4 * pi**2 * height_)

    def height(x, y):
        c, d = np.cos(2 * pi * (x - x0)), np.cos(2 * pi * (y - y0))
        return height_ * (1 - c * d if product else 2 - c - d)

    places = ((x0, y0), (x0 + 0.5, y0 + 0.5))[: 2 if product else 1]
    a = log(rng, 1e-3, 0.3)
    load = 4 / 3 * E / (1 - nu**2) * a**3 / R * len(places)
    return Scene(
        "wavy",
        height,
        [],  # cells on all of the period
        load,
        (E, nu, beta, ell),
        law,
        places,
        period=1.0,
        note=f"Hertz radius {a:.1e} of 1",
    )


def ends(rng):
    a, load, solid, law = _base(rng, 0.02, 0.2)
    x0, y0 = a * rng.uniform(-50, 50, 2)
    draw, c = rng.random(), a * rng.uniform(0.5, 1.2)
    name, size, face = next(
        face
        for until, *face in (
            (0.3, "round punch", c, np.hypot),
            (0.55, "square punch", c, lambda x, y: np.maximum(abs(x), abs(y))),
            (0.8, "sphere cut by a plane", c / 2, lambda x, y: x + 0 * y),
            (1, "sphere cut round", c / 2, np.hypot),
        )
        if draw < until
    )

    def height(x, y):
        x, y = x - x0, y - y0
        return np.where(face(x, y) <= size, 0.0 if "punch" in name else (x**2 + y**2) / 2, inf)

    box = x0, y0, size, size  # boxes end where the obstacle does: cells of any size fit it
    if "plane" in name:
        box = x0 - 0.75 * a + size / 2, y0, 0.75 * a + size / 2, 1.5 * a
    return Scene("ends", height, [box], load, solid, law, ((x0, y0),), norm=False, note=name)


def units(rng):
    scene = summits(rng)
    while len(scene.summits) > 4:
        scene = summits(rng)
    length, stress = (1e-6, 1e9) if rng.random() < 0.6 else (1.0, 1.0)
    s, t = rng.uniform(-1e3, 1e3, 2) * (scene.solid[3] + 0.1)

    def moved(x, y):
        return scene.height(x - s, y - t)

    boxes = [(x + s, y + t, p, q) for x, y, p, q in scene.boxes]
    places = tuple((x + s, y + t) for x, y in scene.summits)
    return replace(scene, kind="units", height=moved, boxes=boxes, summits=places, unit=(stress, length))


def scene(k):
    """Scene k of 200."""
    rng = np.random.default_rng((SEED, 3, k))
    order = np.random.default_rng((SEED, 3)).permutation(
        sum(n for _, n in KINDS)
    )  # kinds mixed: a part shows all
    kind = np.repeat([name for name, _ in KINDS], [n for _, n in KINDS])[order[k]]
    return globals()[kind](rng)


# ---- the judge's answer ----


def truth(s):
    """The second code's figures, or None where no state exists."""
    if s.boxes is None:
        return None
    n = (64 if s.norm else 160) if s.boxes else 256
    return space.answer(
        s.height, s.boxes, s.load, s.solid, s.law, s.summits, s.period, n, s.features, fixed=not s.norm
    )


# ---- the library's ----


def problem(mb, s):
    """The scene as microblock's problem, in its units, and the load."""
    E, nu, beta, ell = s.solid
    stress, length = s.unit
    solid = mb.Cosserat(E=E * stress, nu=nu, beta=beta, ell=ell * length)
    law = {"unilateral": mb.Unilateral, "microblock": mb.Microblock, "microclamped": mb.Microclamped}[s.law]()
    height = s.height if length == 1 else lambda x, y: s.height(x / length, y / length) * length
    method = mb.Cells(window=tuple(length * v for v in s.window)) if s.window else None
    body = mb.HalfSpace(solid, s.period and s.period * length)
    return mb.Contact(body, height, law, method), s.load * stress * length**2


def solved(s):
    """The library's state of a scene."""
    import microblock as mb

    contact, load = problem(mb, s)
    return contact.solve(load=load, rtol=RTOL)


def figures(state, s):
    """Approach, norm of the pressure and loads on the summits, in the scene's units."""
    stress, length = s.unit
    x, y = state.points[:, :2].T / length
    area, loads = np.ravel(state.weights) / length**2, np.zeros(len(s.summits))
    for name, force in state.pressures.items():
        arm = [{"-": -0.5, "+": 0.5}[c] * s.solid[3] for c in name] if len(name) == 2 else (0.0, 0.0)
        corner = space.nearest(x + arm[0], y + arm[1], s.summits, s.period)
        loads += np.bincount(corner, np.ravel(force) / stress * area, len(loads))
    norm = np.sqrt(area @ (np.ravel(state.pressure) / stress) ** 2)
    return {"approach": float(state.approach) / length, "norm": float(norm), "loads": loads.tolist()}


def case(k):
    """Scene k as a case; the error is the figure that is worst beside its bar."""
    s = scene(k)

    def verify(state):
        known = json.loads(TRUTH.read_text())
        true, got = known[str(k)] if str(k) in known else truth(s), figures(state, s)
        if true is None:  # no state exists
            return inf, 0.0, 0.0
        whole = abs(true["approach"]) + (4 * s.load / s.solid[0] / s.period if s.period else 0)
        apart = {
            "approach": abs(got["approach"] - true["approach"]) / whole,
            "norm": abs(got["norm"] / true["norm"] - 1) if s.norm else 0.0,
            "loads": float(np.max(np.abs(np.subtract(got["loads"], true["loads"])))) / s.load,
        }
        allowed = max(RTOL, state.error_estimate or 0.0)
        worst = max(apart, key=lambda name: apart[name] / (allowed + true["bars"][name]))
        narrow = min((2 * r for _, _, r in s.features), default=inf) < (state.seen_width or 0) / s.unit[1]
        if narrow and apart[worst] > allowed + true["bars"][worst]:
            raise NoAnswer("below the promised width")
        return apart[worst], state.error_estimate, true["bars"][worst]

    return Case(f"{s.kind:8s}{s.law:13s}{s.note:36s}", RTOL, lambda: solved(s), verify)
