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

    def elastic(self, E: float, nu: float) -> mb.Elastic:
        return mb.Elastic(E=E * self.stress, nu=nu)

    def cosserat(self, E: float, nu: float, ell: float, beta: float) -> mb.Cosserat:
        return mb.Cosserat(E=E * self.stress, nu=nu, ell=ell * self.length, beta=beta)

    def height(self, function: Callable[..., Any]) -> Callable[..., Any]:
        return lambda *x: self.length * function(*(along / self.length for along in x))


Answer = Callable[[], Any]  # gives a State
Drawn = tuple[str, Callable[[Units], Answer]]


def solid_of(rng: np.random.Generator, u: Units, classical: bool, ell: float = 0.0) -> Any:
    nu, beta, side = rng.uniform(0, 0.45), rng.uniform(0.2, 1.8), 10 ** rng.uniform(-2, -0.3)
    return u.elastic(100.0, nu) if classical else u.cosserat(100.0, nu, ell or side, beta)


def law_of(rng: np.random.Generator, classical: bool) -> Any:
    laws = mb.Microblock(), mb.Microblock(rng.uniform(-0.02, 0.02)), mb.Unilateral(), mb.Microclamped()
    number = rng.integers(4)
    return mb.Unilateral() if classical else laws[number]


def profile_of(rng: np.random.Generator, u: Units) -> Any:
    """Returns an obstacle over a line, some 0.1 to 1 wide in contact."""
    R, slope, shift = 10 ** rng.uniform(0, 2), rng.uniform(0.02, 0.1), rng.choice([0.0, rng.normal(), 1e3])
    tilt, apart, noise = rng.uniform(-2e-3, 2e-3), rng.uniform(0.3, 2), rng.normal(size=17)
    x = np.linspace(-1, 1, 17)
    kinds = (
        mb.Cylinder(R=R * u.length),
        mb.Wedge(slope=slope),
        mb.Punch(half_width=0.3 * u.length, tilt=tilt),
        u.height(lambda x: (x - shift) ** 2 / (2 * R)),
        u.height(lambda x: np.minimum((x - apart) ** 2, (x + apart) ** 2 * 1.1) / (2 * R)),
        u.height(lambda x: np.abs(x - shift) ** 1.7 / R),
        u.height(lambda x: x**2 / (2 * R) + 0.002 * np.sin(7 * x + 1)),
        SimpleNamespace(height=u.height(lambda x: x**2 / (2 * R)), ends=(-0.2 * u.length, 0.2 * u.length)),
        mb.Obstacle.from_samples(u.length * x, u.length * (x**2 / (2 * R) + 2e-4 * noise)),
    )
    return kinds[rng.integers(len(kinds))]


def surface_of(rng: np.random.Generator, u: Units) -> Any:
    """Returns an obstacle over a plane."""
    R, other, slope = 10 ** rng.uniform(0, 1.5), 10 ** rng.uniform(0, 1.5), rng.uniform(0.02, 0.1)
    shift = rng.normal(size=2)
    kinds = (
        mb.Sphere(R=R * u.length),
        mb.Ellipsoid(R1=R * u.length, R2=other * u.length),
        mb.Cone(slope=slope),
        mb.FlatPunch(half_width=0.3 * u.length),
        u.height(lambda x, y: ((x - shift[0]) ** 2 + (y - shift[1]) ** 2) / (2 * R)),
    )
    return kinds[rng.integers(len(kinds))]


def on_line(rng: np.random.Generator, classical: bool, method: Any = None, second: bool = False) -> Drawn:
    load, rtol, state = 10 ** rng.uniform(-1, 0), 10 ** -rng.uniform(2, 4), rng.bit_generator.state

    def made(u: Units) -> Answer:
        rng.bit_generator.state = state
        solid, law, obstacle = solid_of(rng, u, classical), law_of(rng, classical), profile_of(rng, u)
        if second:
            obstacle = mb.Deformable(mb.HalfPlane(solid_of(rng, u, True)), obstacle)
        problem = mb.Contact(mb.HalfPlane(solid), obstacle, law, method)
        asked = None if method is not None else rtol
        return lambda: problem.solve(load=load * u.stress * u.length, rtol=asked)

    return f"line, {'classical' if classical else 'blocks'}, {method}{', two bodies' * second}", made


def on_period(rng: np.random.Generator, classical: bool) -> Drawn:
    share, seed, amplitude = rng.uniform(0.02, 0.3), int(rng.integers(1000)), 10 ** rng.uniform(-3, -2)
    state = rng.bit_generator.state

    def made(u: Units) -> Answer:
        rng.bit_generator.state = state
        solid, law = solid_of(rng, u, classical), law_of(rng, classical)
        rough = mb.Rough(period=u.length, slope=0.02, waves=(2, 16), seed=seed)
        obstacle = rough if seed % 2 else mb.Wave(amplitude * u.length, u.length)
        problem = mb.Contact(mb.HalfPlane(solid, period=u.length), obstacle, law)
        return lambda: problem.solve(load=share * u.stress * u.length)

    return f"period, {'classical' if classical else 'blocks'}", made


def on_block(rng: np.random.Generator, classical: bool) -> Drawn:
    load, size, rtol = 10 ** rng.uniform(-1, 0), rng.choice([np.inf, 5.0]), 10 ** -rng.uniform(2, 3)
    state = rng.bit_generator.state

    def made(u: Units) -> Answer:
        rng.bit_generator.state = state
        solid, law = solid_of(rng, u, classical), law_of(rng, classical)
        problem = mb.Contact(mb.Block(solid, float(size * u.length)), mb.Cylinder(R=10 * u.length), law)
        return lambda: problem.solve(load=load * u.stress * u.length, rtol=rtol)

    return f"block of {size:g}, {'classical' if classical else 'blocks'}", made


def on_mesh(rng: np.random.Generator, classical: bool) -> Drawn:
    load, order, rtol = 10 ** rng.uniform(-1, 0), int(rng.integers(1, 4)), rng.choice([None, 5e-2])
    method, state = rng.choice(np.array([None, mb.Newton()], object)), rng.bit_generator.state
    names = "bottom", "right", "contact", "left"

    def made(u: Units) -> Answer:
        rng.bit_generator.state = state
        solid, law = solid_of(rng, u, classical, ell=0.2), law_of(rng, classical)
        across, up = u.length * np.linspace(-2, 2, 17), u.length * np.linspace(-2, 0, 9)
        body = mb.Body(meshes.rectangles(across, up, True, names), solid, order=order, fixed="bottom")
        problem = mb.Contact(body, mb.Cylinder(R=10 * u.length), law, method)
        asked = None if method is not None else rtol
        return lambda: problem.solve(load=load * u.stress * u.length, rtol=asked)

    return f"mesh of order {order}, {'classical' if classical else 'blocks'}, {method}, {rtol}", made


def in_space(rng: np.random.Generator, classical: bool) -> Drawn:
    load, nodes = 10 ** rng.uniform(-1, 0), rng.choice(np.array([None, 48, 64], object))
    period, state = rng.uniform() < 0.3, rng.bit_generator.state

    def made(u: Units) -> Answer:
        rng.bit_generator.state = state
        solid, law, obstacle = solid_of(rng, u, classical), law_of(rng, classical), surface_of(rng, u)
        if period:
            obstacle = u.height(lambda x, y: 1e-3 * (2 - np.cos(2 * np.pi * x) - np.cos(2 * np.pi * y)))
        fixed = isinstance(obstacle, mb.FlatPunch) or nodes  # edges of punches take many cells
        method = mb.Cells(nodes=nodes or 48) if fixed else None
        body = mb.HalfSpace(solid, period=u.length if period else None)
        problem = mb.Contact(body, obstacle, law, method)
        share = 0.1 if period else 1.0
        return lambda: problem.solve(load=share * load * u.stress * u.length**2)

    return f"space{', period' * period}, {'classical' if classical else 'blocks'}, {nodes} nodes", made


def on_solid_mesh(rng: np.random.Generator, classical: bool) -> Drawn:
    load, state = 10 ** rng.uniform(-1, 0), rng.bit_generator.state

    def made(u: Units) -> Answer:
        rng.bit_generator.state = state
        solid, law = solid_of(rng, u, classical, ell=0.2), law_of(rng, classical)
        x = meshes3d.graded(reach=0.6 * u.length, step=0.2 * u.length, far=3.0 * u.length, growth=2.0)
        mesh = meshes3d.block(x, x, -x[::-1], reach=0.6 * u.length)
        fixed = meshes3d.supports("bottom", x1="left", x2="front")
        problem = mb.Contact(mb.Body(mesh, solid, order=1, fixed=fixed), mb.Sphere(R=10 * u.length), law)
        return lambda: problem.solve(load=load * u.stress * u.length**2)

    return f"mesh in space, {'classical' if classical else 'blocks'}", made


def by_friction(rng: np.random.Generator, classical: bool) -> Drawn:
    load, share, friction = 10 ** rng.uniform(-1, 0), rng.uniform(0.2, 0.9), rng.uniform(0.1, 0.8)
    equal, state = classical and rng.uniform() < 0.4, rng.bit_generator.state

    def made(u: Units) -> Answer:
        rng.bit_generator.state = state
        solid, obstacle = solid_of(rng, u, classical), mb.Cylinder(R=10 * u.length)
        law = (mb.Unilateral if classical else mb.Microblock)(friction=friction)
        pressed: Any = mb.Deformable(mb.HalfPlane(solid), obstacle) if equal else obstacle
        problem = mb.Contact(mb.HalfPlane(solid), pressed, law)
        P = load * u.stress * u.length
        return lambda: problem.history([(P, 0), (P, share * friction * P)], rtol=0.1).states[-1]

    return f"friction, {'classical' if classical else 'blocks'}{', equal bodies' * equal}", made


def along_path(rng: np.random.Generator, classical: bool) -> Drawn:
    state = rng.bit_generator.state

    def made(u: Units) -> Answer:
        rng.bit_generator.state = state
        solid, apart = solid_of(rng, u, classical), rng.uniform(0.3, 1)
        twins = u.height(lambda x: np.minimum((x - apart) ** 2, (x + apart) ** 2 + 1e-3) / 20)
        law = mb.Unilateral() if classical else mb.Microclamped()
        path = mb.Contact(mb.HalfPlane(solid), twins, law, mb.Panels()).path(load=0.1 * u.stress * u.length)
        return lambda: path.at(0.05 * u.stress * u.length)

    return f"path, {'classical' if classical else 'blocks'}", made


KINDS: tuple[Callable[[np.random.Generator], Drawn], ...] = (
    lambda rng: on_line(rng, True),
    lambda rng: on_line(rng, False),
    lambda rng: on_line(rng, True, mb.Cells()),
    lambda rng: on_line(rng, False, mb.Cells(nodes=512)),
    lambda rng: on_line(rng, True, mb.Panels(order=8)),
    lambda rng: on_line(rng, bool(rng.integers(2)), second=True),
    lambda rng: on_period(rng, bool(rng.integers(2))),
    lambda rng: on_block(rng, bool(rng.integers(2))),
    lambda rng: on_mesh(rng, bool(rng.integers(2))),
    lambda rng: in_space(rng, True),
    lambda rng: in_space(rng, False),
    lambda rng: on_solid_mesh(rng, bool(rng.integers(2))),
    lambda rng: by_friction(rng, bool(rng.integers(2))),
    lambda rng: along_path(rng, bool(rng.integers(2))),
)


def numbers(state: Any, u: Units, places: np.ndarray) -> dict[str, np.ndarray]:
    """Returns what a state says, over its units; `places` are points of a surface over the unit of length."""
    flat = state.flat
    force = u.stress * u.length ** (1 if flat else 2)
    values = {
        "load": [state.load / force],
        "area": [state.contact_area / u.length ** (1 if flat else 2)],
        "pressure": state.pressure_at(places * u.length) / u.stress,
        "moment": np.ravel(state.micromoment) / (u.stress * u.length),
        "psi": np.ravel(state.psi),
    }
    if state.zones:
        for name, intervals in state.zones.items():
            values[name] = np.ravel(intervals) / u.length
    return {name: np.asarray(value, float) for name, value in values.items()}


def places_of(state: Any) -> np.ndarray:
    """Returns places in the contact at which states are compared."""
    if not state.flat:
        return state.points[state.pressure > 0.1 * state.pressure.max()][:200]
    edges = np.reshape(state.zones["contact"], (-1, 2))
    # an even number: middles of symmetric contacts are places where panels meet
    shares = (1 - np.cos(np.pi * (np.arange(20) + 0.5) / 20)) / 2
    return (edges[:, :1] + np.diff(edges) * shares).ravel()


def difference(first: dict[str, np.ndarray], second: dict[str, np.ndarray]) -> float:
    """Returns the largest relative difference of two dictionaries of `numbers`; inf where shapes differ."""
    if first.keys() != second.keys() or any(first[name].shape != second[name].shape for name in first):
        return np.inf
    changes = [np.max(np.abs(first[name] - second[name]), initial=0.0) for name in first]
    sizes = [np.max(np.abs(first[name]), initial=1e-12) for name in first]
    return float(np.max(np.divide(changes, sizes)))


def case(k: int) -> Case:
    """Problem k: its error is the largest difference between its own units and three others."""
    rng = np.random.default_rng((SEED, 30, k))
    systems = [
        Units(10.0**length, 10.0**stress) for length, stress in rng.uniform(-1, 1, (SYSTEMS, 2)) * (9, 12)
    ]
    words, made = KINDS[k % len(KINDS)](rng)

    def solve() -> list[Any]:
        answers = []
        for u in (Units(), *systems):
            try:
                answers.append(made(u)())
            except mb.MicroblockError as failure:
                answers.append(failure)
        failures = [str(answer) for answer in answers if isinstance(answer, mb.MicroblockError)]
        if len(failures) == len(answers):  # in all of them
            raise next(answer for answer in answers if isinstance(answer, mb.MicroblockError))
        if failures:
            raise ValueError(f"refused in {len(failures)} of {len(answers)} systems of units: {failures[0]}")
        return answers

    def verify(states: list[Any]) -> tuple[float, float, float]:
        places = places_of(states[0])
        first = numbers(states[0], Units(), places)
        worst = max(difference(first, numbers(state, u, places)) for state, u in zip(states[1:], systems))
        worst = worst if len({state.method for state in states}) == 1 else np.inf
        return worst, (states[0].error_estimate or 0.0) / 10, 0.0

    return Case(words, ROUNDING, solve, verify)
