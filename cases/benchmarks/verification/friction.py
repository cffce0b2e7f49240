"""20 histories of half-planes with friction, drawn by program, beside the second code `friction_code`:
pressure, micromoment over ell and shear traction, as means over cells.

`case` draws history (SEED, 20, k): its error is the largest relative L2 error, over the pressure, of p, M/ell
and q/f. What the second code does not know is the same distance between its two answers.
"""

from dataclasses import dataclass
from math import inf

import numpy as np

import microblock as mb

from . import SEED, friction_code
from .friction_code import CELLS, STEPS
from .judging import Case

LAWS = "microblock", "microblock", "unilateral", "microclamped"
SHAPES = "cylinder", "wedge", "power", "punch", "uneven"


@dataclass(frozen=True)
class History:
    """Lengths over the contact's half-width, E* about 1; `problem` is that of the second code, `obstacle` the
    library's.
    """

    kind: str
    obstacle: object
    problem: friction_code.Problem
    rtol: float = 0.05

    def __str__(self):
        p = self.problem
        words = f"{p.law:12s} {self.kind:8s} {'body' if p.second else '':4s} ell {p.solid[3]:4.2f}"
        return f"{words} f {p.friction:4.2f} {'' if p.coupled else 'un'}coupled rtol {self.rtol:.2f}"

    def solve(self):
        """The states of the library."""
        p = self.problem
        body, second = (
            solid and mb.HalfPlane(mb.Cosserat(*solid[:2], solid[3], beta=solid[2]))
            for solid in (p.solid, p.second)
        )
        law = {"microblock": mb.Microblock, "unilateral": mb.Unilateral, "microclamped": mb.Microclamped}
        obstacle = mb.Deformable(second, self.obstacle) if second else self.obstacle
        contact = mb.Contact(body, obstacle, law[p.law](friction=p.friction))
        return contact.history(p.pairs, coupled=p.coupled, rtol=self.rtol).states


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
    obstacle, height = shape(rng, kind)
    second = None
    if k % 7 in (3, 5) and kind != "punch":
        second = (rng.uniform(0.3, 3.0), rng.uniform(0, 0.45), rng.uniform(0.1, 1.9), rng.uniform(0.05, 0.5))
    if kind == "punch":
        alpha = 2 / round(2 / alpha)  # edges of both corners are edges of the second code's cells
    problem = friction_code.Problem(
        height,
        loads(rng, P, f),
        (1 - nu**2, nu, beta, alpha),
        law,
        f,
        second,
        bool(rng.random() < 0.75),
        (-1.0, 1.0) if kind == "punch" else (),
        () if kind in ("cylinder", "punch") else (0.0,),
    )
    if second and law == "microblock":
        return History(kind, obstacle, problem, 0.4)
    return History(kind, obstacle, problem, float(np.exp(rng.uniform(*np.log((0.02, 0.06))))))


def shape(rng, kind):
    """(The obstacle of a kind, its height)."""
    tilt = rng.uniform(0, 0.1)
    slope = rng.uniform(0.2, 0.6)
    power = rng.uniform(1.5, 4.0)
    height = {
        "cylinder": lambda x: x**2 / 2,
        "wedge": lambda x: slope * abs(x),
        "power": lambda x: abs(x) ** power / 2,
        "punch": lambda x: np.where(abs(x) < 1, tilt * x, inf),
        "uneven": lambda x: np.where(x > 0, 0.3, 0.8) * x**2,
    }[kind]
    obstacle = {"cylinder": mb.Cylinder(1.0), "wedge": mb.Wedge(slope), "punch": mb.Punch(1.0, tilt)}
    return obstacle.get(kind) or mb.Obstacle(height, (0.0,)), height


def loads(rng, P, f):
    """Pairs (P, Q) of loads."""
    pairs = [(P, rng.choice([0.0, rng.uniform(-0.8, 0.8)]) * f * P)]
    for _ in range(rng.integers(2, 4)):
        P *= 1.0 if rng.random() < 0.5 else rng.uniform(0.5, 1.5)
        pairs.append((P, rng.uniform(-0.95, 0.95) * f * P))
    return tuple((float(P), float(Q)) for P, Q in pairs)


def means(edges, x, weights, fields):
    """Means over cells between `edges` of fields (3, n) that are constant on cells x of lengths `weights`."""
    forces = weights * fields
    ends = np.column_stack([x - weights / 2, x + weights / 2]).ravel()
    steps = np.stack([0 * forces, forces], axis=-1).reshape(3, -1)
    sums = [np.interp(edges, np.maximum.accumulate(ends), total) for total in np.cumsum(steps, axis=1)]
    return np.diff(sums) / np.diff(edges)


def error(line, fields, x, weights, others):
    """The largest relative L2 error of p, M/ell and q/f of `others`, on cells x of lengths `weights`, beside
    `fields` on a Line; beside edges of the obstacle the distance is the weight.
    """
    p = line.problem
    wrong = means(line.edges, x, weights, others) - fields
    distances = [abs(line.x - end + arm) for end in p.ends for arm in p.arms]
    norm = line.width * np.min([np.ones_like(line.x), *distances], axis=0)
    return np.max(np.sqrt(wrong**2 @ norm / (fields[0] ** 2 @ norm)) / [1, 1, p.friction])


def compared(history, state, answers, pair):
    """(ratio to what is allowed, error, estimate, bar) of a State at a pair of loads, beside two answers."""
    p = history.problem
    (rough, coarse), (line, fine) = answers
    fields = fine[pair].fields
    moment = state.micromoment / p.solid[3] * (p.law == "microblock")
    of_state = np.array([state.pressure, moment, state.shear_traction])
    wrong = error(line, fields, state.x, state.weights, of_state)
    bar = error(rough, coarse[pair].fields, line.x, line.width, fields)
    ratio = wrong / (max(history.rtol, state.error_estimate) + bar)
    return ratio, wrong, state.error_estimate, bar


def case(k, cells=CELLS):
    """History k as a case, whose states are the library's; beside `cells`, and twice as many."""
    history = draw(k)

    def verify(states):
        answers = friction_code.answer(history.problem, cells, cells * STEPS // CELLS)
        rows = [compared(history, state, answers, pair) for pair, state in enumerate(states)]
        return tuple(map(float, max(rows)[1:]))

    return Case(str(history), history.rtol, history.solve, verify)
