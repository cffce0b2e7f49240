"""20 histories of half-planes with friction, drawn by program, beside answers of a second code: pressure,
micromoment over ell and shear traction, as means over cells.

The answers are kept in `friction_truth.json`, with `bar`, their distance from those of half as many cells and
steps. That code (kernels from the energy, small implicit steps in the loads, in each of which corners open or
close and cells stick or slip until no sign is violated) is in the history of this file.

`case` draws history (SEED, 20, k): its error is the largest relative L2 error, over the pressure, of p, M/ell
and q/f.
"""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import microblock as mb

from . import SEED, NoAnswer
from .judging import Case

TRUTH = Path(__file__).with_name("friction_truth.json")
LAWS = "microblock", "microblock", "unilateral", "microclamped"
SHAPES = "cylinder", "wedge", "power", "punch", "uneven"


@dataclass(frozen=True)
class Problem:
    """Plain data of a history: lengths over the contact's half-width, E* about 1; solids are (E, nu, beta,
    ell).
    """

    kind: str
    obstacle: object
    pairs: tuple
    solid: tuple
    law: str
    friction: float
    second: tuple | None = None  # solid of the obstacle
    coupled: bool = True
    rtol: float = 0.05

    def __str__(self):
        words = f"{self.law:12s} {self.kind:8s} {'body' if self.second else '':4s} ell {self.solid[3]:4.2f}"
        return f"{words} f {self.friction:4.2f} {'' if self.coupled else 'un'}coupled rtol {self.rtol:.2f}"

    def solve(self):
        """The states of the library."""
        body, second = (
            solid and mb.HalfPlane(mb.Cosserat(*solid[:2], solid[3], beta=solid[2]))
            for solid in (self.solid, self.second)
        )
        law = {"microblock": mb.Microblock, "unilateral": mb.Unilateral, "microclamped": mb.Microclamped}
        obstacle = mb.Deformable(second, self.obstacle) if second else self.obstacle
        problem = mb.Contact(body, obstacle, law[self.law](friction=self.friction))
        return problem.history(self.pairs, coupled=self.coupled, rtol=self.rtol).states


def draw(k):
    """History k: pressed, sheared, back and relieved, at random."""
    rng = np.random.default_rng((SEED, 20, k))
    law = LAWS[k % 4]
    kind = SHAPES[k % 5]
    alpha = float(np.exp(rng.uniform(*np.log((0.05, 1.0)))))
    f = float(np.exp(rng.uniform(*np.log((0.1, 0.6)))))
    nu = rng.uniform(0, 0.45)
    beta = rng.uniform(0.1, 1.9)
    P = rng.uniform(0.4, 1.0)
    obstacle = shape(rng, kind)
    second = None
    if k % 7 in (3, 5) and kind != "punch":
        second = (rng.uniform(0.3, 3.0), rng.uniform(0, 0.45), rng.uniform(0.1, 1.9), rng.uniform(0.05, 0.5))
    if kind == "punch":
        alpha = 2 / round(2 / alpha)  # edges of both corners were edges of the second code's cells
    return Problem(
        kind,
        obstacle,
        loads(rng, P, f),
        (1 - nu**2, nu, beta, alpha),
        law,
        f,
        second,
        bool(rng.random() < 0.75),
        0.4 if second and law == "microblock" else float(np.exp(rng.uniform(*np.log((0.02, 0.06))))),
    )


def shape(rng, kind):
    """The obstacle of a kind."""
    tilt = rng.uniform(0, 0.1)
    slope = rng.uniform(0.2, 0.6)
    power = rng.uniform(1.5, 4.0)
    return {
        "cylinder": mb.Cylinder(1.0),
        "wedge": mb.Wedge(slope),
        "power": mb.Obstacle(lambda x: abs(x) ** power / 2, (0.0,)),
        "punch": mb.Punch(1.0, tilt),
        "uneven": mb.Obstacle(lambda x: np.where(x > 0, 0.3, 0.8) * x**2, (0.0,)),
    }[kind]


def loads(rng, P, f):
    """Pairs (P, Q) of loads."""
    pairs = [(P, rng.choice([0.0, rng.uniform(-0.8, 0.8)]) * f * P)]
    for _ in range(rng.integers(2, 4)):
        P *= 1.0 if rng.random() < 0.5 else rng.uniform(0.5, 1.5)
        pairs.append((P, rng.uniform(-0.95, 0.95) * f * P))
    return tuple((float(P), float(Q)) for P, Q in pairs)


def means(edges, state, ell, blocks):
    """Means of p, M/ell and q of a State over the cells between `edges`, array (3, n)."""
    moment = state.micromoment / ell * blocks
    forces = state.weights * np.array([state.pressure, moment, state.shear_traction])
    ends = np.column_stack([state.x - state.weights / 2, state.x + state.weights / 2]).ravel()
    steps = np.stack([0 * forces, forces], axis=-1).reshape(3, -1)
    sums = [np.interp(edges, np.maximum.accumulate(ends), total) for total in np.cumsum(steps, axis=1)]
    return np.diff(sums) / np.diff(edges)


def error(history, state, edges, fields):
    """The largest relative L2 error of p, M/ell and q/f of a State beside `fields` (3, n) between `edges`;
    beside edges of the obstacle the distance is the weight.
    """
    wrong = means(edges, state, history.solid[3], history.law == "microblock") - fields
    x = (edges[1:] + edges[:-1]) / 2
    arms = (-history.solid[3] / 2, history.solid[3] / 2) if history.law == "microblock" else (0.0,)
    ends = history.obstacle.ends if history.kind == "punch" else ()
    distances = [abs(x - end + arm) for end in ends for arm in arms]
    weights = np.diff(edges) * np.min([np.ones_like(x), *distances], axis=0)
    return np.max(np.sqrt(wrong**2 @ weights / (fields[0] ** 2 @ weights)) / [1, 1, history.friction])


def case(k):
    """History k as a case, whose states are the library's."""
    history = draw(k)

    def verify(states):
        truth = json.loads(TRUTH.read_text())[str(k)]
        if truth is None:
            raise NoAnswer("no signs settled")
        edges = np.array(truth["edges"])
        rows = []
        for state, true in zip(states, truth["states"]):
            wrong = error(history, state, edges, np.array(true["fields"]))
            ratio = wrong / (max(history.rtol, state.error_estimate) + true["bar"])
            rows.append((ratio, wrong, state.error_estimate, true["bar"]))
        return tuple(map(float, max(rows)[1:]))

    return Case(str(history), history.rtol, history.solve, verify)
