"""200 surfaces in three dimensions, drawn by program, beside the second code `space`: approach, norm of the
pressure and load on each summit.

`truth` solves any of them. Answers of the first 200 are kept in `space_truth.json`, null where no state
exists, with `bars` of what the second code does not know of them.
"""

import json
from dataclasses import dataclass, replace
from math import cos, inf, pi, sin, sqrt
from pathlib import Path

import numpy as np

import microblock as mb

from . import SEED, NoAnswer, space
from .judging import Case
from .obstacles import log

RTOL = 1e-2
TRUTH = Path(__file__).with_name("space_truth.json")
MATERIALS = [(0.91, 0.3, 1.0), (0.91, 0.3, 1.0), (1.2, 0.2, 0.4), (0.8, 0.4, 1.7)]  # E, nu, beta
LAWS = {"unilateral": mb.Unilateral, "microblock": mb.Microblock, "microclamped": mb.Microclamped}


@dataclass(frozen=True)
class Surface:
    """A surface, its load and its solid; `boxes` (x, y, half-widths) contain every contact, None where no
    state exists; `features` are (x, y, half-width).
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


def paraboloids(summits, radii, heights):
    def height(x, y):
        parts = [z + ((x - a) ** 2 + (y - b) ** 2) / (2 * r) for (a, b), r, z in zip(summits, radii, heights)]
        return np.min(np.broadcast_arrays(*parts), axis=0)

    return height


def hertz_load(E, nu, a):
    """Load under which a sphere of radius 1 touches within a."""
    return 4 / 3 * E / (1 - nu**2) * a**3


def around(summits, radii, heights, solid, load):
    """Boxes about the paraboloids that may touch: those below the approach of each of them alone."""
    depth = min(z + space.hertz(*solid[:2], r, load)[2] for r, z in zip(radii, heights))
    radii_of_boxes = [1.02 * sqrt(2 * r * max(depth - z, 0)) for r, z in zip(radii, heights)]
    return [(x, y, reach, reach) for (x, y), reach in zip(summits, radii_of_boxes) if reach > 0]


def _base(rng, low=0.005, high=0.3):
    """Hertz radius under a sphere of radius 1, its load, a solid and a law."""
    E, nu, beta = MATERIALS[rng.integers(len(MATERIALS))]
    a = log(rng, low, high)
    ell = a * log(rng, 1e-2, 10)
    return a, hertz_load(E, nu, a), (E, nu, beta, ell), tuple(LAWS)[rng.integers(3)]


def summits(rng):
    a, load, solid, law = _base(rng)
    count = int(rng.integers(1, 10))
    if law == "microblock" and solid[3] > 0.7 * a:
        count = min(count, 3)
    radii = [log(rng, 0.05, 2) for _ in range(count)]
    extent = a * log(rng, 5, 1000)
    places = []
    while len(places) < count:
        place = tuple(rng.uniform(-extent, extent, 2))
        if all(np.hypot(place[0] - x, place[1] - y) > 3 * a for x, y in places):
            places.append(place)
        extent *= 1.02
    depth = min(space.hertz(*solid[:2], r, load / count)[2] for r in radii)
    heights = [rng.uniform(0, 0.5) * depth if rng.random() < 0.4 else 0.0 for _ in range(count)]
    height = paraboloids(places, radii, heights)
    boxes = around(places, radii, heights, solid, load)
    note = f"{count} in {extent / a:.0f} a"
    return Surface("summits", height, boxes, load, solid, law, tuple(places), note=note)


def _outside(r, a):
    """Gap of a sphere of radius 1 outside of its Hertz contact."""
    u = ((2 * a * a - r * r) * np.arcsin(a / r) + r * a * sqrt(1 - (a / r) ** 2)) / pi
    return r * r / 2 - a * a + u


def pin(rng):
    a, load, solid, law = _base(rng, 0.01, 0.3)
    solid = (*solid[:3], a * log(rng, 1e-3, 0.5))
    rho = a * rng.uniform(1.05, 4)
    width = a * log(rng, 0.02, 0.5)
    angle = rng.uniform(0, 2 * pi)
    tip = _outside(rho, a) + 0.1 * a * a  # stands below the deformed surface: it must carry
    place = (rho * cos(angle), rho * sin(angle))
    shape = ("cosine", "parabola")[rng.random() >= 0.5]

    def height(x, y):
        r = np.hypot(x - place[0], y - place[1])
        sphere = (x * x + y * y) / 2
        if shape == "cosine":
            return sphere - np.where(r < width / 2, tip * (1 + np.cos(2 * pi * r / width)) / 2, 0.0)
        return np.minimum(sphere, rho * rho / 2 - tip + r * r * 4 * (tip + rho * width) / width**2)

    return Surface(
        "pin",
        height,
        [(0, 0, a, a), (*place, 0.52 * width, 0.52 * width)],
        load,
        solid,
        law,
        ((0.0, 0.0), place),
        ((*place, width / 2),),
        note=f"{shape} of width {width / a:.3f} a at {rho / a:.2f} a",
    )


def about_ellipsoid(angle, ratio, solid, load):
    """The box about an ellipsoid of radii 1 and `ratio`, turned by an angle; its approach is at most
    that of a sphere.
    """
    depth = 1.6 * space.hertz(*solid[:2], sqrt(ratio), load)[2]
    axes = sqrt(2 * depth) * np.array([[cos(angle), sin(angle)], [sin(angle), cos(angle)]])
    return (0, 0, *np.hypot(*(axes * [1, sqrt(ratio)]).T))


def ridge(rng):
    """A cylinder, along which nothing rises, or a long ellipsoid."""
    _, load, solid, law = _base(rng, 0.01, 0.1)
    draw = rng.random()
    angle = 0.0
    ratio = inf
    note = "cylinder"
    boxes = None
    if draw >= 0.25:
        ratio = log(rng, 5, 200 if draw < 0.6 else 20)
    if draw < 0.25 or draw >= 0.6:
        angle = rng.uniform(0, pi)
    if ratio < inf:
        note = f"ellipsoid {ratio:.0f}:1 turned by {angle:.2f}"
        boxes = [about_ellipsoid(angle, ratio, solid, load)]

    def height(x, y):
        across = x * cos(angle) + y * sin(angle)
        along = y * cos(angle) - x * sin(angle)
        return across**2 / 2 + along**2 / (2 * ratio)

    return Surface("ridge", height, boxes, load, solid, law, note=note)


def about_two(places, k, solid, load):
    """Boxes about two summits of curvature 1 and k, at (0, -b) and (0, b)."""
    b = places[1][1]
    depth = 1.3 * space.hertz(*solid[:2], k**-0.5, load)[2]
    inner = b - sqrt(max(b * b - sqrt(8 * b * b * depth / k), 0))
    reach = max(inner, sqrt(2 * depth / k))
    return [(*place, sqrt(2 * depth), reach) for place in places]


def saddle(rng):
    a, load, solid, law = _base(rng, 0.01, 0.1)
    draw = rng.random()
    k = log(rng, 0.01, 1)
    if draw < 0.4:
        return Surface(
            "saddle", lambda x, y: x**2 / 2 - k * y**2 / 2, None, load, solid, law, note="falls for ever"
        )
    if draw < 0.6:
        plateau = log(rng, 1e-2, 1) * a**2
        height = lambda x, y: np.minimum((x**2 + y**2) / 2, plateau)  # noqa: E731
        return Surface("saddle", height, None, load, solid, law, note="rises to a plateau")
    b = a * log(rng, 2, 200)
    note = f"two summits at {b / a:.1f} a, curvature {k:.2f}"  # of curvature 1 and k, a saddle between them
    height = lambda x, y: x * x / 2 + k * (y * y - b * b) ** 2 / (8 * b * b)  # noqa: E731
    places = (0.0, -b), (0.0, b)
    return Surface("saddle", height, about_two(places, k, solid, load), load, solid, law, places, note=note)


def _sphere(kind, a, solid, law, **options):
    sphere = [(0.0, 0.0)], [1.0], [0.0]
    load = hertz_load(*solid[:2], a)
    return Surface(kind, paraboloids(*sphere), around(*sphere, solid, load), load, solid, law, **options)


def light(rng):
    _, _, solid, law = _base(rng)
    a = log(rng, 1e-4, 0.02)
    return _sphere("light", a, (*solid[:3], a * log(rng, 1e-3, 1e3)), law, note=f"a {a:.1e}")


def scale(rng):
    a, _, solid, law = _base(rng, 0.05, 1)
    ell = 10 ** rng.uniform(-7, 4)
    return _sphere("scale", a, (*solid[:3], ell), law, note=f"ell/a {ell / a:.1e}")


def window(rng):
    a, _, solid, law = _base(rng)
    reach = a * 1.5 * log(rng, 1.2, 1000) + solid[3]
    return _sphere("window", a, solid, law, window=(-reach, reach), note=f"{reach / a:.0f} a wide")


def wavy(rng):
    E, nu, beta = MATERIALS[rng.integers(len(MATERIALS))]
    size = log(rng, 1e-3, 0.1)
    law = tuple(LAWS)[rng.integers(3)]
    ell = log(rng, 0.003, 0.1)
    x0, y0 = rng.uniform(-0.5, 0.5, 2)
    product = rng.random() < 0.4

    def height(x, y):
        c = np.cos(2 * pi * (x - x0))
        d = np.cos(2 * pi * (y - y0))
        return size * (1 - c * d if product else 2 - c - d)

    places = ((x0, y0), (x0 + 0.5, y0 + 0.5))[: 1 + product]
    a = log(rng, 1e-3, 0.3)
    R = 1 / (4 * pi**2 * size)
    load = hertz_load(E, nu, a) / R * len(places)
    note = f"Hertz radius {a:.1e} of 1"
    return Surface("wavy", height, [], load, (E, nu, beta, ell), law, places, period=1.0, note=note)


FACES = (  # up to this number of a draw: face, its size, radius of the sphere, distance
    (0.3, "round punch", 1, inf, np.hypot),
    (0.55, "square punch", 1, inf, lambda x, y: np.maximum(abs(x), abs(y))),
    (0.8, "sphere cut by a plane", 0.5, 1.0, lambda x, y: x + 0 * y),
    (1, "sphere cut round", 0.5, 1.0, np.hypot),
)


def face(draw):
    return next(row[1:] for row in FACES if draw < row[0])


def ends(rng):
    a, load, solid, law = _base(rng, 0.02, 0.2)
    x0, y0 = a * rng.uniform(-50, 50, 2)
    name, size, R, distance = face(rng.random())
    size *= a * rng.uniform(0.5, 1.2)

    def height(x, y):
        return np.where(distance(x - x0, y - y0) <= size, ((x - x0) ** 2 + (y - y0) ** 2) / (2 * R), inf)

    boxes = [(x0, y0, size, size)]  # which end where the obstacle does: cells of any size fit it
    if "plane" in name:
        boxes = [(x0 - 0.75 * a + size / 2, y0, 0.75 * a + size / 2, 1.5 * a)]
    return Surface("ends", height, boxes, load, solid, law, ((x0, y0),), norm=False, note=name)


def units(rng):
    plain = summits(rng)
    while len(plain.summits) > 4:
        plain = summits(rng)
    unit = (1e9, 1e-6) if rng.random() < 0.6 else (1.0, 1.0)
    s, t = rng.uniform(-1e3, 1e3, 2) * (plain.solid[3] + 0.1)
    return replace(
        plain,
        kind="units",
        height=lambda x, y: plain.height(x - s, y - t),
        boxes=[(x + s, y + t, *sides) for x, y, *sides in plain.boxes],
        summits=tuple((x + s, y + t) for x, y in plain.summits),
        unit=unit,
    )


KINDS = {
    summits: 60,
    pin: 30,
    ridge: 14,
    saddle: 10,
    light: 12,
    scale: 24,
    window: 12,
    wavy: 16,
    ends: 12,
    units: 10,
}


def surface(k):
    """Surface k; kinds are mixed, so that a part shows all, and come again after 200."""
    kinds = [kind for kind, count in KINDS.items() for _ in range(count)]
    order = np.random.default_rng((SEED, 3)).permutation(len(kinds))
    return kinds[order[k % len(kinds)]](np.random.default_rng((SEED, 3, k)))


def problem(s):
    """The contact problem of a surface in its units, and the load."""
    E, nu, beta, ell = s.solid
    stress, length = s.unit
    solid = mb.Cosserat(E=E * stress, nu=nu, beta=beta, ell=ell * length)
    height = s.height
    if length != 1:
        height = lambda x, y: s.height(x / length, y / length) * length  # noqa: E731
    method = s.window and mb.Cells(window=tuple(length * end for end in s.window))
    body = mb.HalfSpace(solid, s.period and s.period * length)
    return mb.Contact(body, height, LAWS[s.law](), method), s.load * stress * length**2


def truth(s):
    """Figures of the second code and its `bars`, or None where no state exists."""
    if s.boxes is None:
        return None
    n = 256
    if s.boxes:
        n = 64 if s.norm else 160
    surface = space.Problem(
        s.height, s.boxes, s.load, s.solid, s.law, s.summits, s.period, s.features, fixed=not s.norm
    )
    return space.answer(surface, n)


def figures(state, s):
    """Approach, norm of the pressure and loads on the summits, in the surface's units."""
    stress, length = s.unit
    x, y = state.points[:, :2].T / length
    area = np.ravel(state.weights) / length**2
    loads = np.zeros(len(s.summits))
    for name, force in state.pressures.items():
        arm = [{"-": -0.5, "+": 0.5}[c] * s.solid[3] for c in name] if len(name) == 2 else (0.0, 0.0)
        corner = space.nearest(x + arm[0], y + arm[1], s.summits, s.period)
        loads += np.bincount(corner, np.ravel(force) / stress * area, len(loads))
    norm = np.sqrt(area @ (np.ravel(state.pressure) / stress) ** 2)
    return {"approach": float(state.approach) / length, "norm": float(norm), "loads": loads}


def case(k):
    """Surface k as a case; the error is the figure that is worst beside its bar."""
    s = surface(k)
    contact, load = problem(s)

    def verify(state):
        stored = json.loads(TRUTH.read_text())
        true = stored[str(k)] if str(k) in stored else truth(s)
        if true is None:  # no state exists
            return inf, 0.0, 0.0
        answer = figures(state, s)
        depth = abs(true["approach"]) + (4 * s.load / s.solid[0] / s.period if s.period else 0)
        errors = {
            "approach": abs(answer["approach"] - true["approach"]) / depth,
            "norm": abs(answer["norm"] / true["norm"] - 1) * s.norm,
            "loads": np.abs(answer["loads"] - true["loads"]).max() / s.load,
        }
        allowed = max(RTOL, state.error_estimate or 0.0)
        worst = max(errors, key=lambda name: errors[name] / (allowed + true["bars"][name]))
        narrowest = min((2 * r for _, _, r in s.features), default=inf)
        if narrowest < (state.seen_width or 0) / s.unit[1] and errors[worst] > allowed + true["bars"][worst]:
            raise NoAnswer("below the promised width")
        return errors[worst], state.error_estimate, true["bars"][worst]

    return Case(
        f"{s.kind:8s}{s.law:13s}{s.note:36s}", RTOL, lambda: contact.solve(load=load, rtol=RTOL), verify
    )
