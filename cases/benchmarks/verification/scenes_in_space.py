"""100 contacts of bodies on meshes in space, drawn by program: shapes of body and boundary, obstacles, laws,
orders, cells of the mesh, loads, approaches, tolerances and units.

Contact k comes from (SEED, 80, k); its kind is k modulo the number of KINDS. What judges it:

closed       closed forms of symmetric profiles (`shapes.Symmetric`), on a quarter of a block
half-space   a half-space of the same solid, by cells
finer        the same body with facets of 0.45 times the length, or 0.7 times
tolerance    one of these, for a state that was refined to an rtol
invariance   the same contact turned, mirrored, or in other units
methods      the same mesh by another method
refusal      what has no answer: the error that is right is part of the contact

Of each state the supports balance the load and its moments, and no pressure is tensile. Errors are those of
`pressure_at` and `micromoment_at` in L2 over the contact boundary, by a rule of this file.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from types import SimpleNamespace

import ngsolve as ng
import numpy as np
from scipy.spatial import cKDTree

import microblock as mb
from microblock.fem import meshes3d

from . import SEED, bodies_in_space, shapes
from .judging import Case
from .obstacles import log

R = 10.0  # of obstacles, so that slopes are about a tenth
EXACT = 1e-6  # of balance and tension, which no mesh spoils
SAME = 1e-5  # relative difference of states that are alike: residuals are 1e-9
FINER = 0.45  # length of facets of the reference, and where one takes a minute
LESS_FINER = 0.7
HALF_SPACE = 5e-3  # what the sides of a block of some six contact radii are worth
PLANES = meshes3d.supports("bottom", x1="left", x2="front")
RULES = {kind: ng.IntegrationRule(kind, 9) for kind in (ng.TRIG, ng.QUAD)}


@dataclass(frozen=True)
class Scene:
    """A contact on meshes whose facets have any length.

    Attributes
    ----------
    words : str
    problem : callable, the Contact on facets of a length
    size : float
    level : {"load" or "approach": value}
    exact : callable, (pressure, couples over ell), (k,) and (k, 2), at places, (k, 3), and what the judge
        does not know; None to take a finer mesh
    weight : callable, weight of squares at places
    rtol : float or None
    """

    words: str
    problem: Callable
    size: float
    level: dict
    exact: Callable | None = None
    weight: Callable = lambda places: np.ones(len(places))
    rtol: float | None = None

    def case(self):
        return Case(self.words, self.rtol or 0.0, self.solve, self.verify)

    def solve(self):
        return self.problem(self.size).solve(**self.level, rtol=self.rtol)

    def verify(self, state):
        """(Error, estimate, what the judge does not know)."""
        if unbalanced(state) > EXACT:
            return np.inf, state.error_estimate, 0.0
        if self.exact:
            exact, bar = self.exact()
            return error(state, exact, state, self.weight), state.error_estimate, bar
        body = state.fields.body
        ratio = LESS_FINER if body.order > 1 + (not body.rotates) else FINER
        finer = self.problem(ratio * self.size).solve(**self.level)
        distance = error(state, fields_of(finer), finer, self.weight)
        # errors fall like the length of facets: what the finer state is off, the distance has not
        return distance, state.error_estimate, 0.0


def fields_of(state):
    """The pressure and the couples over ell of a State at places."""

    def exact(places):
        couples = state.micromoment_at(places[:, :2]) / state.solid.ell
        return state.pressure_at(places[:, :2]), couples

    return exact


def on_cells(state):
    """The same of a State on cells, beside which nothing is pressed, and couples are not known."""
    tree = cKDTree(state.points)
    halves = np.sqrt(state.weights) / 2

    def exact(places):
        apart, nearest = tree.query(places, p=np.inf)
        known = apart < halves[nearest]
        p = np.zeros(len(places))
        couples = np.full((len(places), 2), np.nan)
        p[known], couples[known] = fields_of(state)(places[known])
        return p, couples

    return exact


def error(state, exact, on, weight):
    """The larger relative error of p and M/ell of a State on the boundary of the state `on`."""
    places, weights = points(on.fields.body)
    weights = weights * weight(places)
    p, couples = fields_of(state)(places)
    true, true_couples = exact(places)
    squares = weights @ (p - true) ** 2, weights @ np.nansum((couples - true_couples) ** 2, axis=1)
    return float(np.sqrt(max(squares) / (weights @ true**2)))


def points(body):
    """Points of a rule on the contact boundary of a Body, array (k, 3), and their areas, (k,)."""
    places = []
    areas = []
    for facet in body.mesh.Boundaries(body.contact).Elements():
        trafo = body.mesh.GetTrafo(facet)
        for point in RULES[facet.type]:
            mapped = trafo(*point.point)
            places.append(mapped.point)
            areas.append(mapped.measure * point.weight)
    return np.array(places), np.array(areas)


def unbalanced(state):
    """How far pressures are off from what carries the load and its moments, and tension."""
    forces = (state.weights * state.pressure)[:, None] * -state.normals
    reaction = reaction_of(state)
    arms = np.ptp(state.points, axis=0).max()
    off = [state.load + forces[:, 2].sum(), *(reaction.force + forces.sum(axis=0))]
    moments = reaction.moment + np.cross(state.points, forces).sum(axis=0) + couple(state)
    tension = min(np.min(p, initial=0.0) for p in state.pressures.values()) / state.pressure.max()
    return max(np.abs(off).max() / state.load, np.abs(moments).max() / (state.load * arms), -tension)


def reaction_of(state):
    """The Reaction of all supports."""
    patterns = {pattern for pattern in state.fields.body.fixed.values() if pattern}
    return state.fields.reaction("|".join(sorted(patterns)))


def couple(state):
    """The sum of the couples of a state, array (3,)."""
    if isinstance(state.law, mb.Microclamped):  # supports exert them
        return np.zeros(3)
    n = state.normals
    moments = state.weights[:, None] * state.micromoment
    sides = (np.eye(3)[i] - n[:, i : i + 1] / (1 + n[:, 2:]) * (n + np.eye(3)[2]) for i in range(2))
    return sum(moments[:, i] @ t for i, t in enumerate(sides))


# ---- what is drawn


def solid_of(rng, classical):
    nu = rng.uniform(0.05, 0.45)
    E = 1 - nu**2  # E* = 1
    if classical:
        return mb.Elastic(E, nu)
    return mb.Cosserat(E, nu, ell=log(rng, 0.05, 0.5), beta=rng.uniform(0.3, 1.7))


def laws(rng):
    """A law, and whether its solid may be classical."""
    kind = rng.integers(5)
    pair = tuple(rng.uniform(-0.03, 0.03, 2).tolist())
    law = (mb.Unilateral(), mb.Unilateral(), mb.Microblock(), mb.Microblock(psi0=pair), mb.Microclamped())
    return law[kind], kind == 0


def load_of(rng):
    """The load of a sphere of radius R that touches within some 0.5 to 1.1."""
    return 4 / 3 / R * log(rng, 0.5, 1.1) ** 3


def smooth(rng):
    """(words, obstacle) without edges and ridges."""
    place = rng.uniform(-0.3, 0.3, 2)
    size = log(rng, 1e-3, 1e-2)
    wave = rng.uniform(2, 5)
    apart = rng.uniform(0.3, 0.7)
    rough = mb.RoughSurface(period=4.0, slope=log(rng, 2e-3, 1e-2), waves=(2, 6), seed=int(rng.integers(99)))
    return [
        ("sphere", mb.Sphere(R)),
        ("ellipsoid", mb.Ellipsoid(R, R * log(rng, 0.2, 2))),
        ("shifted", lambda x, y: ((x - place[0]) ** 2 + (y - place[1]) ** 2) / (2 * R) + 0.01 * x),
        ("wave", lambda x, y: (x**2 + y**2) / (2 * R) + size * np.cos(wave * x) * np.cos(wave * y)),
        ("hills", lambda x, y: np.minimum((x - apart) ** 2, (x + apart) ** 2 + 5e-3) / (0.8 * R) + y**2 / R),
        ("rough", lambda x, y: (x**2 + y**2) / (2 * R) + rough.height(x, y)),
    ][rng.integers(6)]


def sharp(rng):
    """(words, obstacle, weight) with edges, tips or ridges."""
    side = rng.uniform(0.6, 1.1)
    tilt = rng.uniform(0, 0.02)
    slope = log(rng, 0.03, 0.1)
    edge = 1 + 1e-9

    def from_round(places):
        return np.clip(1 - np.hypot(*places.T[:2]) / side, 0, None) ** 2

    def from_square(places):
        return np.clip(1 - np.abs(places[:, :2]).max(axis=1) / side, 0, None) ** 2

    even = Scene.weight
    return [
        ("cone", mb.Cone(slope), even),
        ("ridge", lambda x, y: slope * np.abs(x) + y**2 / (2 * R), even),
        ("pyramid", lambda x, y: slope * np.maximum(np.abs(x), np.abs(y)), even),
        ("valley", lambda x, y: (x**2 + y**2) / (2 * R) - 0.5 * slope * np.abs(x), even),
        ("round punch", mb.FlatPunch(side), from_round),
        ("square punch", mb.FlatPunch(side, "square"), from_square),
        ("tilted punch", lambda x, y: np.where(np.hypot(x, y) <= side * edge, tilt * x, np.inf), from_round),
    ][rng.integers(7)]


def cells(rng, rows, classical=True):
    """(words, mesh of facets of a length, order, length) of hexahedra in rows, or of tetrahedra."""
    if rng.random() < 0.4:
        order = int(rng.integers(1, 4 if classical else 3))  # six fields of order 3 take a minute
        return f"hexahedra {order}", rows, order, log(rng, 0.25, 0.4) * (1, 1.7, 2.4)[order - 1]
    order = int(rng.integers(1, 3))
    size = log(rng, 0.25, 0.4) * (1, 1.6 if classical else 2.1)[order - 1]
    return f"tetrahedra {order}", lambda size: bodies_in_space.cut(rows(size)), order, size


def layered(rng, mesh, solid, classical):
    """(Mesh of facets of a length, solids) of a body whose coating of a solid lies on another one."""
    layer = rng.uniform(0.4, 1.0)
    stiff = log(rng, 0.2, 5)
    base = mb.Elastic(stiff, 0.3) if classical else mb.Cosserat(stiff, 0.3, ell=solid.ell, beta=1)
    return lambda size: bodies_in_space.layered(mesh(size), layer), {"base": base, "coating": solid}


def contact_on(mesh, solid, order, obstacle, law, size, method=None, fixed="bottom", contact="contact"):
    """The Contact on facets of a length."""
    made = mesh(size)
    if made.GetCurveOrder() > 1:  # beyond the order rigid rotations are none of the displacements
        made.Curve(order)
    body = mb.Body(made, solid, order, fixed=fixed, contact=contact)
    return mb.Contact(body, obstacle, law, method)


# ---- a function a kind


def closed(rng, rtol=None):
    """Symmetric profiles on a quarter of a block, beside closed forms."""
    kind = shapes.KINDS[rng.integers(len(shapes.KINDS))]
    steep = log(rng, 0.03, 0.1)
    edge = rng.uniform(0.7, 1.0)
    profile = shapes.profile_of(rng, kind, edge, edge * rng.uniform(0.3, 0.9), steep, rng.integers(2))
    load = steep * edge**2 * np.pi / 4 * log(rng, 0.4, 1.1)
    true = shapes.Symmetric(profile, 1.0, load, in_space=True)
    while true.contact > 1.3:  # within the square that is pressed
        load /= 1.3
        true = shapes.Symmetric(profile, 1.0, load, in_space=True)
    words, mesh, order, size = cells(rng, bodies_in_space.quarter)
    if rtol:
        words, order, size = ("tetrahedra 2", 2, 0.5)
        mesh = lambda size: bodies_in_space.cut(bodies_in_space.quarter(size))  # noqa: E731
    obstacle = shapes.obstacle_of(kind, profile, edge, steep, in_space=True)
    solid = solid_of(rng, classical=True)

    def exact(places):
        r = np.hypot(*places.T[:2])
        return true.pressure(r), np.zeros((len(r), 2))

    return Scene(
        f"closed {words} {profile.name} size {size:.2f}",
        partial(contact_on, mesh, solid, order, obstacle, mb.Unilateral(), fixed=PLANES),
        size,
        {"load": load / 4},
        lambda: (exact, HALF_SPACE),
        lambda places: true.weight(np.hypot(*places.T[:2])),
        rtol,
    )


def half_space(rng):
    """Blocks and clamped rotations beside a half-space; those of order 2 on a quarter of the body."""
    solid = solid_of(rng, classical=False)
    name, obstacle = smooth(rng)
    pair = tuple(rng.uniform(-0.03, 0.03, 2).tolist())
    law = (mb.Microblock(), mb.Microblock(psi0=pair), mb.Microclamped())[rng.integers(3)]
    load = load_of(rng)
    words, mesh, order, size = cells(rng, partial(bodies_in_space.block, half=4.0, depth=5.0), False)
    fixed = "bottom"
    share = 1
    if order > 1:
        words, mesh, order, size = cells(rng, partial(bodies_in_space.quarter, length=6.0), False)
        name, obstacle = ("sphere", mb.Sphere(R))
        law = (mb.Microblock(), mb.Microclamped())[rng.integers(2)]
        fixed = PLANES
        share = 4

    def exact():
        state = mb.Contact(mb.HalfSpace(solid), obstacle, law).solve(load=load, rtol=0.03)
        return on_cells(state), state.error_estimate + 2 * HALF_SPACE

    return Scene(
        f"half-space {words} {name} {law} size {size:.2f} ell {solid.ell:.2f}",
        partial(contact_on, mesh, solid, order, obstacle, law, fixed=fixed),
        size,
        {"load": load / share},
        exact,
    )


def finer(rng, rtol=None):
    """Small bodies with their sides near the contact, beside the same with smaller facets."""
    name = ("block", "layered", "cylinder", "holed", "block", "layered")[rng.integers(6)]
    law, classical = laws(rng)
    words, mesh, order, size = cells(rng, bodies_in_space.block, classical)
    if rtol:
        name = "block"
        order = 2
        classical = True
        law = mb.Unilateral()
        words = "tetrahedra 2"
        mesh = lambda size: bodies_in_space.cut(bodies_in_space.block(size))  # noqa: E731
    solid = solid_of(rng, classical)
    if name == "layered":
        mesh, solid = layered(rng, mesh, solid, classical)
    if name in ("cylinder", "holed"):
        mesh = getattr(bodies_in_space, name)
        order = min(order, 2)
        words = f"tetrahedra {order}"
    return beside_finer(rng, f"{name} {words}", mesh, solid, order, size, smooth(rng), law, rtol)


def beside_finer(rng, words, mesh, solid, order, size, obstacle, law, rtol=None, **options):
    """The Scene of a load or an approach that is judged by smaller facets."""
    level = {"load": load_of(rng)} if rng.random() < 0.6 else {"approach": rng.uniform(0.5, 1) ** 2 / R}
    words_of_obstacle, height, *weight = obstacle
    return Scene(
        f"finer {words} {words_of_obstacle} {law} {level} size {size:.2f}",
        partial(contact_on, mesh, solid, order, height, law, **options),
        size,
        level,
        None,
        *weight,
        rtol=rtol,
    )


def curved(rng):
    """Curved, tilted and broken boundaries, and several pieces, beside smaller facets."""
    name = ("cap", "dome", "roof", "posts", "tilted")[rng.integers(5)]
    law, classical = laws(rng)
    words, mesh, order, size = cells(rng, bodies_in_space.block, classical)
    tilt = rng.uniform(-0.03, 0.03)
    angle = rng.uniform(0.05, 0.4)
    slope = log(rng, 0.03, 0.1)
    step = rng.uniform(-0.02, 0.02)
    obstacle = [("plane", lambda x, y: tilt * x + 0 * y), ("sphere", mb.Sphere(R))][rng.integers(2)]
    shapes_of_top = {
        "dome": lambda size: bodies_in_space.lowered(mesh(size), lambda x, y: (x**2 + y**2) / (2 * R)),
        "roof": lambda size: bodies_in_space.lowered(mesh(size), lambda x, y: slope * np.abs(x)),
        "tilted": lambda size: bodies_in_space.tilted(mesh(size), angle),
        "cap": bodies_in_space.cap,
        "posts": partial(bodies_in_space.posts, heights=(0.0, step)),
    }
    if name in ("cap", "posts"):
        order = min(order, 2)
        words = f"tetrahedra {order}"
    if name == "tilted":
        obstacle = ("sphere", mb.Sphere(R))
    contact = "first|second" if name == "posts" else "contact"
    made = shapes_of_top[name]
    solid = solid_of(rng, classical)
    words = f"{name} {words}"
    return beside_finer(rng, words, made, solid, order, size, obstacle, law, contact=contact)


def edges(rng):
    """Obstacles with edges, tips and ridges beside smaller facets; one corner, or clamped rotations."""
    classical = rng.random() < 0.6
    law = mb.Unilateral() if classical or rng.random() < 0.5 else mb.Microclamped()
    words, mesh, order, size = cells(rng, bodies_in_space.block, classical)
    return beside_finer(rng, words, mesh, solid_of(rng, classical), order, size, sharp(rng), law)


def tolerance(rng):
    """Tetrahedra that are refined to an rtol."""
    rtol = log(rng, 0.1, 0.25)
    return closed(rng, rtol) if rng.random() < 0.6 else finer(rng, rtol)


def invariance(rng):
    """A contact turned by 90 degrees, mirrored, or in other units."""
    kind = ("turned", "mirrored", "units")[rng.integers(3)]
    name, obstacle = smooth(rng)
    height = getattr(obstacle, "height", obstacle)
    law, classical = laws(rng)
    solid = solid_of(rng, classical)
    order = int(rng.integers(1, 3))
    mesh = bodies_in_space.block(0.35 * order)
    if kind != "mirrored" and rng.random() < 0.7:
        mesh = bodies_in_space.cut(mesh)
    load = load_of(rng)
    length = log(rng, 1e-6, 1e6)
    stress = log(rng, 1e-6, 1e12)
    pair = getattr(law, "psi0", 0.0)

    def turned():
        other = mb.Microblock(psi0=(-pair[1], pair[0])) if pair else law
        netgen = bodies_in_space.moved(mesh, lambda x: np.column_stack((-x[:, 1], x[:, 0], x[:, 2])))
        return netgen, lambda x, y: height(y, -x), other

    def mirrored():
        other = mb.Microblock(psi0=(pair[0], -pair[1])) if pair else law
        return mesh, lambda x, y: height(-x, y), other

    changes = {  # of places, and of couples
        "turned": (turned, lambda x: np.column_stack((-x[:, 1], x[:, 0])), lambda m: np.array((-m[1], m[0]))),
        "mirrored": (mirrored, lambda x: x[:, :2] * (-1, 1), lambda m: np.array((m[0], -m[1]))),
        "units": (lambda: (mesh, obstacle, law), lambda x: x[:, :2], lambda m: m),
    }
    make, place, moment = changes[kind]

    def solve():
        return contact_on(lambda size: mesh, solid, order, obstacle, law, 1.0).solve(load=load)

    def verify(state):
        if kind == "units":
            return in_units(state, mesh, solid, order, height, law, load, length, stress), 0.0, 0.0
        netgen, changed, other = make()
        twin = contact_on(lambda size: netgen, solid, order, changed, other, 1.0).solve(load=load)
        p = twin.pressure_at(place(state.points))
        couples = moment(state.micromoment.T).T - twin.micromoment_at(place(state.points))
        return (
            differences(
                (p - state.pressure, state.pressure),
                (couples / state.solid.ell, state.pressure),
                (twin.approach - state.approach, state.approach),
                # where an edge runs is decided by rounding in few facets
                ((twin.error_estimate - state.error_estimate) / 100, state.error_estimate),
            ),
            0.0,
            0.0,
        )

    return Case(f"{kind} {name} {law} order {order} unit {length:.0e} {stress:.0e}", SAME, solve, verify)


def contact_in_units(mesh, solid, order, height, law, length, stress):
    """The Contact on a mesh in other units: so many lengths and stresses are one."""
    material = {"E": solid.E * stress, "nu": solid.nu}
    if not isinstance(solid, mb.Elastic):
        material |= {"ell": solid.ell * length, "beta": solid.beta}
    return contact_on(
        lambda size: bodies_in_space.moved(mesh, lambda x: x * length),
        type(solid)(**material),
        order,
        lambda x, y: length * height(x / length, y / length),
        law,
        1.0,
    )


def in_units(state, mesh, solid, order, height, law, load, length, stress):
    """How far the state in other units differs."""
    contact = contact_in_units(mesh, solid, order, height, law, length, stress)
    twin = contact.solve(load=load * stress * length**2)
    return differences(
        (twin.pressure / stress - state.pressure, state.pressure),
        ((twin.micromoment / (stress * length) - state.micromoment) / state.solid.ell, state.pressure),
        (twin.approach / length - state.approach, state.approach),
        ((twin.error_estimate - state.error_estimate) / 100, state.error_estimate),
    )


def differences(*pairs):
    """The largest of differences over sizes."""
    return float(max(np.abs(difference).max() / np.abs(size).max() for difference, size in pairs))


def methods(rng):
    """A state by two methods on one mesh."""
    name, obstacle = smooth(rng)
    law, classical = laws(rng)
    solid = solid_of(rng, classical)
    order = int(rng.integers(1, 3))
    kind = ("al", "al", "penalty")[rng.integers(3)]
    mesh = bodies_in_space.block(0.45 * order)
    if rng.random() < 0.5:
        mesh = bodies_in_space.cut(mesh)
    level = {"load": load_of(rng)} if rng.random() < 0.6 else {"approach": rng.uniform(0.4, 1) ** 2 / R}
    contact = partial(contact_on, lambda size: mesh, solid, order, obstacle, law, 1.0)

    def verify(state):
        if unbalanced(state) > EXACT:
            return np.inf, None, 0.0
        twin = contact().solve(**level)
        return (
            differences(
                (twin.pressure - state.pressure, twin.pressure),
                (twin.approach - state.approach, twin.approach),
                (twin.load - state.load, twin.load),
            ),
            None,
            0.0,
        )

    allowed = 0.05 if kind == "penalty" else SAME
    words = f"methods {kind} {name} {law} order {order} {level} {mesh.ne} elements"
    return Case(words, allowed, lambda: contact(mb.Newton(kind)).solve(**level), verify)


def refusal(rng, number):
    """What has no answer."""
    solid = mb.Elastic(0.91, 0.3)
    blocks = mb.Cosserat(0.91, 0.3, ell=0.1, beta=1)
    hexes = bodies_in_space.block(0.6)
    skew = bodies_in_space.moved(hexes, lambda points: points + 0.1 * points[:, [1, 0, 2]])
    tets = bodies_in_space.cut(hexes)
    quarter = bodies_in_space.quarter(0.6)
    free = {"u1": "front", "u2": "left", "u3": "bottom"}  # turns about x3
    sphere = mb.Sphere(R)
    unilateral = mb.Unilateral()

    def solve(mesh, solid, law=unilateral, obstacle=sphere, order=1, method=None, fixed="bottom", **level):
        return contact_on(lambda size: mesh, solid, order, obstacle, law, 1.0, method, fixed).solve(**level)

    contacts = [
        ("rtol of hexahedra", partial(solve, skew, solid, load=0.1, rtol=0.1), "needs a mesh of tetrahedra"),
        ("order 3 of tetrahedra", partial(solve, tets, solid, order=3, load=0.1), "order"),
        ("above first touch", partial(solve, tets, solid, approach=-0.01), "approach"),
        ("free rotation", partial(solve, quarter, solid, fixed=free, load=0.1), "rigid motions"),
        (
            "free rotation, Newton",
            partial(solve, quarter, blocks, mb.Microblock(), method=mb.Newton(), fixed=free, load=0.1),
            "a rotation about x3 free",
        ),
        ("u3 free", partial(solve, tets, solid, fixed={"u1": "bottom", "u2": "bottom"}, load=0.1), "u3"),
        ("blocks of Elastic", partial(solve, tets, solid, mb.Microblock(), load=0.1), "without blocks"),
        (
            "nowhere over the body",
            partial(solve, tets, solid, obstacle=lambda x, y: np.where(x > 9, 0.0, np.inf) + 0 * y, load=0.1),
            "obstacle",
        ),
        ("nan", partial(solve, tets, solid, obstacle=lambda x, y: x * np.nan + y, load=0.1), "nan"),
        ("held contact", partial(solve, tets, solid, fixed="bottom|contact", load=0.1), "contact|held|hold"),
    ]
    words, attempt, pattern = contacts[number % len(contacts)]

    def answer():
        try:
            state = attempt()
        except mb.MicroblockError as failure:
            return SimpleNamespace(warnings=[], failure=str(failure))
        return SimpleNamespace(warnings=state.warnings, failure="")

    def verify(row):
        return float(not re.search(pattern, row.failure + "; ".join(row.warnings))), None, 0.5

    return Case(f"refusal {words}", 0.0, answer, verify)


KINDS = (closed, half_space, finer, curved, edges, tolerance, invariance, methods, finer, refusal)


def case(k):
    """Contact k as a Case."""
    rng = np.random.default_rng((SEED, 80, k))
    kind = KINDS[k % len(KINDS)]
    drawn = kind(rng, k // len(KINDS)) if kind is refusal else kind(rng)
    return drawn if isinstance(drawn, Case) else drawn.case()
