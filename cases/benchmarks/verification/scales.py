"""The same problems in other units of length and stress: the same digits must come back.

Problem k comes from (SEED, 30, k); its kind is k modulo the number of KINDS. It is solved in its own units
and in three other systems, drawn from 1e-9 to 1e9 of lengths and 1e-12 to 1e12 of stresses.

`python -m cases.benchmarks.verification scales` prints a line a problem.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np

import microblock as mb
from microblock.fem import meshes, meshes3d

from . import SEED
from .judging import Case

SYSTEMS = 3  # of units beside that of the problem
ROUNDING = 1e-9  # of the largest pressure, through some thousand sums


@dataclass(frozen=True)
class Units:
    """Sizes of the units in which a problem is drawn, in those in which it is solved."""

    length: float = 1.0
    stress: float = 1.0

    def height(self, function: Callable[..., Any]) -> Callable[..., Any]:
        return lambda *x: self.length * function(*(along / self.length for along in x))

    def force(self, flat: bool) -> float:
        """Unit of the load: per thickness in the plane."""
        return self.stress * self.length ** (1 if flat else 2)


Drawn = tuple[str, Callable[[], Any]]  # what a problem is, and a function that gives its State


def solid_of(rng: np.random.Generator, u: Units, classical: bool, ell: float = 0.0) -> Any:
    nu = rng.uniform(0, 0.45)
    beta = rng.uniform(0.2, 1.8)
    side = 10 ** rng.uniform(-2, -0.3)
    if classical:
        return mb.Elastic(E=100.0 * u.stress, nu=nu)
    return mb.Cosserat(E=100.0 * u.stress, nu=nu, ell=(ell or side) * u.length, beta=beta)


def law_of(rng: np.random.Generator, classical: bool) -> Any:
    laws = mb.Microblock(), mb.Microblock(rng.uniform(-0.02, 0.02)), mb.Unilateral(), mb.Microclamped()
    law = laws[rng.integers(4)]
    return mb.Unilateral() if classical else law


def profile_of(rng: np.random.Generator, u: Units) -> Any:
    """Returns an obstacle over a line, some 0.1 to 1 wide in contact."""
    R = 10 ** rng.uniform(0, 2)
    slope = rng.uniform(0.02, 0.1)
    shift = rng.choice([0.0, rng.normal(), 1e3])
    tilt = rng.uniform(-2e-3, 2e-3)
    distance = rng.uniform(0.3, 2)
    noise = rng.normal(size=17)
    x = np.linspace(-1, 1, 17)
    kinds = (
        mb.Cylinder(R=R * u.length),
        mb.Wedge(slope=slope),
        mb.Punch(half_width=0.3 * u.length, tilt=tilt),
        u.height(lambda x: (x - shift) ** 2 / (2 * R)),
        u.height(lambda x: np.minimum((x - distance) ** 2, (x + distance) ** 2 * 1.1) / (2 * R)),
        u.height(lambda x: np.abs(x - shift) ** 1.7 / R),
        u.height(lambda x: x**2 / (2 * R) + 0.002 * np.sin(7 * x + 1)),
        SimpleNamespace(height=u.height(lambda x: x**2 / (2 * R)), ends=(-0.2 * u.length, 0.2 * u.length)),
        mb.Obstacle.from_samples(u.length * x, u.length * (x**2 / (2 * R) + 2e-4 * noise)),
    )
    return kinds[rng.integers(len(kinds))]


def surface_of(rng: np.random.Generator, u: Units) -> Any:
    """Returns an obstacle over a plane."""
    R1 = 10 ** rng.uniform(0, 1.5)
    R2 = 10 ** rng.uniform(0, 1.5)
    slope = rng.uniform(0.02, 0.1)
    shift = rng.normal(size=2)
    kinds = (
        mb.Sphere(R=R1 * u.length),
        mb.Ellipsoid(R1=R1 * u.length, R2=R2 * u.length),
        mb.Cone(slope=slope),
        mb.FlatPunch(half_width=0.3 * u.length),
        u.height(lambda x, y: ((x - shift[0]) ** 2 + (y - shift[1]) ** 2) / (2 * R1)),
    )
    return kinds[rng.integers(len(kinds))]


# ---- a function a kind: (random numbers, units, whether the solid is classical) -> words, solve


def on_line(
    rng: np.random.Generator, u: Units, classical: bool, method: Any = None, second: bool = False
) -> Drawn:
    load = 10 ** rng.uniform(-1, 0) * u.force(flat=True)
    rtol = 10 ** -rng.uniform(2, 4)
    body = mb.HalfPlane(solid_of(rng, u, classical))
    law = law_of(rng, classical)
    obstacle = profile_of(rng, u)
    if second:
        obstacle = mb.Deformable(mb.HalfPlane(solid_of(rng, u, True)), obstacle)
    problem = mb.Contact(body, obstacle, law, method)
    words = f"line, {method or f'rtol {rtol:.0e}'}{', two bodies' * second}"
    return words, lambda: problem.solve(load=load, rtol=None if method else rtol)


def on_period(rng: np.random.Generator, u: Units, classical: bool) -> Drawn:
    load = rng.uniform(0.02, 0.3) * u.force(flat=True)
    seed = int(rng.integers(1000))
    amplitude = 10 ** rng.uniform(-3, -2)
    obstacle: Any = mb.Wave(amplitude * u.length, u.length)
    if seed % 2:
        obstacle = mb.Rough(period=u.length, slope=0.02, waves=(2, 16), seed=seed)
    body = mb.HalfPlane(solid_of(rng, u, classical), period=u.length)
    problem = mb.Contact(body, obstacle, law_of(rng, classical))
    return "period", lambda: problem.solve(load=load)


def on_block(rng: np.random.Generator, u: Units, classical: bool) -> Drawn:
    load = 10 ** rng.uniform(-1, 0) * u.force(flat=True)
    size = float(rng.choice([np.inf, 5.0]))
    rtol = 10 ** -rng.uniform(2, 3)
    body = mb.Block(solid_of(rng, u, classical), size * u.length)
    problem = mb.Contact(body, mb.Cylinder(R=10 * u.length), law_of(rng, classical))
    return f"block of {size:g}", lambda: problem.solve(load=load, rtol=rtol)


def on_mesh(rng: np.random.Generator, u: Units, classical: bool) -> Drawn:
    load = 10 ** rng.uniform(-1, 0) * u.force(flat=True)
    order = int(rng.integers(1, 4))
    rtol = rng.choice([None, 5e-2])
    method = rng.choice(np.array([None, mb.Newton()], object))
    solid = solid_of(rng, u, classical, ell=0.2)
    across = u.length * np.linspace(-2, 2, 17)
    up = u.length * np.linspace(-2, 0, 9)
    mesh = meshes.rectangles(across, up, True, ("bottom", "right", "contact", "left"))
    body = mb.Body(mesh, solid, order=order, fixed="bottom")
    problem = mb.Contact(body, mb.Cylinder(R=10 * u.length), law_of(rng, classical), method)
    words = f"mesh of order {order}, {method}, {rtol}"
    return words, lambda: problem.solve(load=load, rtol=None if method else rtol)


def in_space(rng: np.random.Generator, u: Units, classical: bool) -> Drawn:
    load = 10 ** rng.uniform(-1, 0) * u.force(flat=False)
    nodes = rng.choice(np.array([None, 48, 64], object))
    periodic = rng.uniform() < 0.3
    solid = solid_of(rng, u, classical)
    law = law_of(rng, classical)
    obstacle = surface_of(rng, u)
    body = mb.HalfSpace(solid)
    if periodic:
        load *= 0.1
        body = mb.HalfSpace(solid, period=u.length)
        obstacle = u.height(lambda x, y: 1e-3 * (2 - np.cos(2 * np.pi * x) - np.cos(2 * np.pi * y)))
    fixed = isinstance(obstacle, mb.FlatPunch) or nodes  # edges of punches take many cells
    problem = mb.Contact(body, obstacle, law, mb.Cells(nodes=nodes or 48) if fixed else None)
    return f"space{', period' * periodic}, {nodes} nodes", lambda: problem.solve(load=load)


def on_solid_mesh(rng: np.random.Generator, u: Units, classical: bool) -> Drawn:
    load = 10 ** rng.uniform(-1, 0) * u.force(flat=False)
    solid = solid_of(rng, u, classical, ell=0.2)
    x = meshes3d.graded(reach=0.6 * u.length, step=0.2 * u.length, far=3.0 * u.length, growth=2.0)
    mesh = meshes3d.block(x, x, -x[::-1], reach=0.6 * u.length)
    body = mb.Body(mesh, solid, order=1, fixed=meshes3d.supports("bottom", x1="left", x2="front"))
    problem = mb.Contact(body, mb.Sphere(R=10 * u.length), law_of(rng, classical))
    return "mesh in space", lambda: problem.solve(load=load)


def by_friction(rng: np.random.Generator, u: Units, classical: bool) -> Drawn:
    load = 10 ** rng.uniform(-1, 0) * u.force(flat=True)
    fraction = rng.uniform(0.2, 0.9)
    friction = rng.uniform(0.1, 0.8)
    equal = classical and rng.uniform() < 0.4
    body = mb.HalfPlane(solid_of(rng, u, classical))
    obstacle: Any = mb.Cylinder(R=10 * u.length)
    if equal:
        obstacle = mb.Deformable(body, obstacle)
    law = mb.Unilateral(friction=friction) if classical else mb.Microblock(friction=friction)
    problem = mb.Contact(body, obstacle, law)
    pairs = [(load, 0), (load, fraction * friction * load)]
    return f"friction{', equal bodies' * equal}", lambda: problem.history(pairs, rtol=0.1).states[-1]


def along_path(rng: np.random.Generator, u: Units, classical: bool) -> Drawn:
    body = mb.HalfPlane(solid_of(rng, u, classical))
    distance = rng.uniform(0.3, 1)
    twins = u.height(lambda x: np.minimum((x - distance) ** 2, (x + distance) ** 2 + 1e-3) / 20)
    problem = mb.Contact(body, twins, mb.Unilateral() if classical else mb.Microclamped(), mb.Panels())
    load = 0.1 * u.force(flat=True)
    return "path", lambda: problem.path(load=load).at(load / 2)


# kind, whether the solid is classical (None: drawn), and its options
KINDS: tuple[tuple[Callable[..., Drawn], bool | None, dict[str, Any]], ...] = (
    (on_line, True, {}),
    (on_line, False, {}),
    (on_line, True, {"method": mb.Cells()}),
    (on_line, False, {"method": mb.Cells(nodes=512)}),
    (on_line, True, {"method": mb.Panels(order=8)}),
    (on_line, None, {"second": True}),
    (on_period, None, {}),
    (on_block, None, {}),
    (on_mesh, None, {}),
    (in_space, True, {}),
    (in_space, False, {}),
    (on_solid_mesh, None, {}),
    (by_friction, None, {}),
    (along_path, None, {}),
)


def systems(rng: np.random.Generator) -> list[Units]:
    """Returns the units of the problem and others."""
    powers = rng.uniform(-1, 1, (SYSTEMS, 2)) * (9, 12)
    return [Units(), *(Units(10.0**length, 10.0**stress) for length, stress in powers)]


def drawn(k: int, u: Units) -> Drawn:
    """Problem k in these units."""
    rng = np.random.default_rng((SEED, 30, k))
    systems(rng)
    kind, classical, options = KINDS[k % len(KINDS)]
    if classical is None:
        classical = bool(rng.integers(2))
    words, solve = kind(rng, u, classical, **options)
    return f"{words}, {'classical' if classical else 'blocks'}", solve


def numbers(state: Any, u: Units, places: np.ndarray) -> dict[str, np.ndarray]:
    """Returns what a state says, over its units; `places` are points of a surface over the unit of length."""
    force = u.force(state.flat)
    values = {
        "load": [state.load / force],
        "area": [state.contact_area * u.stress / force],
        "pressure": state.pressure_at(places * u.length) / u.stress,
        "moment": np.ravel(state.micromoment) / (u.stress * u.length),
        "psi": np.ravel(state.psi),
    }
    zones = {name: np.ravel(intervals) / u.length for name, intervals in (state.zones or {}).items()}
    return {name: np.asarray(value, float) for name, value in (values | zones).items()}


def places_of(state: Any) -> np.ndarray:
    """Returns places in the contact at which states are compared."""
    if not state.flat:
        return state.points[state.pressure > 0.1 * state.pressure.max()][:200]
    edges = np.reshape(state.zones["contact"], (-1, 2))
    # an even number: middles of symmetric contacts are places where panels meet
    fractions = (1 - np.cos(np.pi * (np.arange(20) + 0.5) / 20)) / 2
    return (edges[:, :1] + np.diff(edges) * fractions).ravel()


def difference(first: dict[str, np.ndarray], second: dict[str, np.ndarray]) -> float:
    """Returns the largest relative difference of two dictionaries of `numbers`; inf where shapes differ."""
    if first.keys() != second.keys() or any(first[name].shape != second[name].shape for name in first):
        return np.inf
    changes = [np.max(np.abs(first[name] - second[name]), initial=0.0) for name in first]
    sizes = [np.max(np.abs(first[name]), initial=1e-12) for name in first]
    return float(np.max(np.divide(changes, sizes)))


def answer(k: int, u: Units) -> Any:
    """The State of problem k in these units, or its error."""
    try:
        return drawn(k, u)[1]()
    except mb.MicroblockError as failure:
        return failure


def case(k: int) -> Case:
    """Problem k: its error is the largest difference between its own units and three others."""
    units = systems(np.random.default_rng((SEED, 30, k)))

    def solve() -> list[Any]:
        answers = [answer(k, u) for u in units]
        failures = [failure for failure in answers if isinstance(failure, mb.MicroblockError)]
        if len(failures) == len(answers):
            raise failures[0]
        if failures:
            raise ValueError(f"refused in {len(failures)} of {len(answers)} systems of units: {failures[0]}")
        return answers

    def verify(states: list[Any]) -> tuple[float, float, float]:
        places = places_of(states[0])
        first, *others = (numbers(state, u, places) for state, u in zip(states, units))
        worst = max(difference(first, other) for other in others)
        if len({state.method for state in states}) > 1:
            worst = np.inf
        return worst, (states[0].error_estimate or 0.0) / 10, 0.0

    return Case(drawn(k, Units())[0], ROUNDING, solve, verify)
