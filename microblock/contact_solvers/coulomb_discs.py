"""Shear forces of two components within Coulomb's discs, matrix-free.

With the displacement S q of the surface under shear forces q, array (2, n), a drive b and the motion D of the
obstacle, the slip of an increment is v = D - S q - b. Nodes stick, v = 0, or slip, v = (v/r) q with v >= 0 on
|q| = r. These are the conditions of the minimum of

    e(q) = q.S q/2 + b.q     on     {|q_i| <= r_i, sum q = Q},
    (d)

with D the multiplier of the sum. An outer step is

1. gradient projection: q' = proj(q - alpha (S q + b)), alpha smaller until e falls;
2. conjugate gradients for the Newton step on the face of q': nodes that stick move freely, nodes that slip
   along their circle, whose curvature adds v/r; the sum stays;
3. projected search towards its end, else q' itself.

It is `projected_gradients` with discs in place of half-lines.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..errors import NotConverged, at_least
from ..model.progress import counted
from ..model.types import Array, Flags
from .discs import AT_RIM, Discs
from .fft_compliance import Operator
from .rounding import EPS_TERM

MOST_ROUNDS = 200  # 3 to 20 are met
LEAST_SOFTNESS = 1e-200  # where no node moves
MOST_STEPS = 80  # of conjugate gradients; of alpha
# of the steps of gradients, over that which moves all by a radius: waves as long as the contact need the
# least, and the shortest ones a hundred to a thousand times as much
STEP_BOUNDS = 1e-3, 1e6


class SlidStep(NamedTuple):
    """The end of an increment.

    Attributes
    ----------
    forces : array (2, ...), q
    slip : array (2, ...), v of the increment (length); 0 where r is 0
    motion : array (2,), D (length)
    residual : largest violation of a condition, over the displacement when all slides
    """

    forces: Array
    slip: Array
    motion: Array
    residual: float


@dataclass(frozen=True, eq=False)
class SlidingProblem:
    """The problem (d) on the nodes with a radius.

    Attributes
    ----------
    S : function, displacements of the surface under shear forces, arrays (2, ...)
    inverse : function, an approximate inverse of S
    radii : array (...), largest shear force of each node
    drive : array (2, ...), b (length)
    resultant : array (2,)
    friction : float, radii over normal forces
    given : boolean array (2,), whether the resultant is given along an axis; else D is 0, and Q as well
    """

    S: Operator
    inverse: Operator
    radii: Array
    drive: Array
    resultant: Array
    friction: float
    given: Flags

    @cached_property
    def touch(self) -> Flags:
        """Nodes with a radius."""
        return self.radii > 0

    @cached_property
    def discs(self) -> Discs:
        return Discs(self.radii[self.touch], self.resultant, self.given)

    @cached_property
    def b(self) -> Array:
        return self.drive[:, self.touch]

    @cached_property
    def softness(self) -> float:
        """Largest displacement of a node when all slides along an axis, the first one along which supports
        let one move (length); not 0.
        """
        radii = self.discs.radii
        along_axes = (self.moved(np.outer(axis, radii)) for axis in np.eye(2))
        return next((float(np.abs(moved).max()) for moved in along_axes if moved.any()), LEAST_SOFTNESS)

    @cached_property
    def size(self) -> float:
        """Displacement over which a residual is taken: that when all slides, but under no more than the
        normal forces or the resultant, which large friction is far above; or the range of the drive (length).
        """
        sliding = float(np.hypot(*self.resultant)) / float(self.discs.radii.sum())
        share = min(1.0, max(sliding, 1 / self.friction))
        drives = np.where(self.given, np.ptp(self.b, axis=1), np.abs(self.b).max(axis=1))
        return max(share * self.softness, float(drives.max()))

    @property
    def unit_step(self) -> float:
        """Force by which a displacement of `softness` is a radius (force per length)."""
        return float(self.discs.radii.max()) / self.softness

    def on_all(self, values: Array) -> Array:
        """Returns values, array (2, n), on all nodes, 0 where a radius is 0."""
        on_all = np.zeros((2, *self.radii.shape))
        on_all[:, self.touch] = values
        return on_all

    def moved(self, forces: Array) -> Array:
        """Returns S q, arrays (2, n)."""
        return self.S(self.on_all(forces))[:, self.touch]

    def preconditioned(self, values: Array) -> Array:
        return self.inverse(self.on_all(values))[:, self.touch]


class _Point(NamedTuple):
    """Forces, and the gradient S q + b of the energy; arrays (2, n)."""

    forces: Array
    gradient: Array


def slide(problem: SlidingProblem, start: Array, rtol: float) -> SlidStep:
    """Returns the end of an increment that begins with shear forces `start`, array (2, ...); raises
    NotConverged unless the residual is at most rtol.
    """
    discs = problem.discs
    if discs.all_slide:
        return _all_slide(problem)
    point = _at(problem, discs.project(discs.within(start[:, problem.touch])))
    alpha = problem.unit_step
    least = np.inf
    for _ in range(MOST_ROUNDS):
        counted()
        residual, motion = _violation(problem, point)
        least = min(least, residual)
        if residual <= rtol:
            return _ended(problem, point, motion, residual)
        point, alpha = _gradient_step_on_discs(problem, point, motion, alpha)  # 1
        trial = _step_of_sticking(problem, point, rtol)  # 2
        point = _search_on_discs(problem, point, trial)  # 3
    raise NotConverged(
        f"relative residual {at_least(least)} of the shear forces instead of {rtol:g} after {MOST_ROUNDS} "
        "steps; take Cells(residual=...) larger",
        iterations=MOST_ROUNDS,
    )


def _at(problem: SlidingProblem, forces: Array) -> _Point:
    return _Point(forces, problem.moved(forces) + problem.b)


def _all_slide(problem: SlidingProblem) -> SlidStep:
    """Returns the end of an increment after which all slides along the resultant: the obstacle moves along it
    by the least that no node contradicts, and across it by the mean of the surface.
    """
    discs = problem.discs
    direction = discs.resultant / np.hypot(*discs.resultant)
    across = np.array((-direction[1], direction[0]))
    point = _at(problem, direction[:, None] * discs.radii)
    mean = point.gradient @ discs.radii / discs.radii.sum()
    motion = direction * (direction @ point.gradient).max() + across * (across @ mean) * problem.given.all()
    return _ended(problem, point, motion, 0.0)


def _ended(problem: SlidingProblem, point: _Point, motion: Array, residual: float) -> SlidStep:
    slip = motion[:, None] - point.gradient
    return SlidStep(problem.on_all(point.forces), problem.on_all(slip), motion, residual)


def _at_rim(problem: SlidingProblem, point: _Point) -> Flags:
    return np.hypot(*point.forces) >= (1 - AT_RIM) * problem.discs.radii


def _motion(problem: SlidingProblem, point: _Point) -> Array:
    """Returns D: the multiplier of the sum in the projection of a gradient step."""
    step = problem.unit_step
    return -problem.discs.shift(point.forces - step * point.gradient) / step


def _violation(problem: SlidingProblem, point: _Point) -> tuple[float, Array]:
    """Returns the largest violation of a condition over `size`, and D."""
    motion = _motion(problem, point)
    slip = motion[:, None] - point.gradient
    rim = _at_rim(problem, point)
    e = point.forces / problem.discs.radii
    along = np.where(rim, np.maximum((slip * e).sum(axis=0), 0.0), 0.0)
    return float(np.hypot(*(slip - along * e)).max() / problem.size), motion


def _rise(problem: SlidingProblem, before: _Point, after: _Point) -> tuple[float, float]:
    """Returns the rise of the energy from one point to another with the same resultant, and its rounding."""
    change = after.forces - before.forces
    mean = (before.gradient + after.gradient) / 2
    # the change has the sum 0 where a resultant is given, but for rounding
    mean = mean - problem.given[:, None] * mean.mean(axis=1, keepdims=True)
    return float((change * mean).sum()), float(EPS_TERM * problem.size * np.abs(change).sum())


def _gradient_step_on_discs(
    problem: SlidingProblem, point: _Point, motion: Array, alpha: float
) -> tuple[_Point, float]:
    """1: the projected step and the next alpha."""
    slip = motion[:, None] - point.gradient
    for _ in range(MOST_STEPS):
        trial_forces = problem.discs.project(point.forces + alpha * slip)
        change = trial_forces - point.forces
        length = float((change**2).sum())
        if np.abs(change).max() <= AT_RIM * problem.discs.radii.max():
            # rounding below a rim a node would count as one that sticks
            return _Point(trial_forces, point.gradient), problem.unit_step
        trial = _at(problem, trial_forces)
        curvature = float((change * (trial.gradient - point.gradient)).sum())
        step = length / curvature if curvature > 0 else 2 * alpha
        step = float(np.clip(step, *np.multiply(STEP_BOUNDS, problem.unit_step)))
        rise, rounding = _rise(problem, point, trial)
        if rise <= -0.1 * length / alpha or abs(rise) <= rounding:
            return trial, step
        alpha = min(step, alpha / 2)
    return point, alpha


def _step_of_sticking(problem: SlidingProblem, point: _Point, rtol: float) -> Array:
    """2: forces near the minimum of the quadratic model on the face of a point, array (2, n)."""
    rim = _at_rim(problem, point)
    radii = problem.discs.radii
    e = point.forces / radii
    tangent = np.array((-e[1], e[0]))
    slip = _motion(problem, point)[:, None] - point.gradient
    curvature = np.where(rim, np.maximum((slip * e).sum(axis=0), 0.0) / radii, 0.0)

    def on_face(values: Array) -> Array:
        return np.where(rim, tangent * (tangent * values).sum(axis=0), values)

    def precondition(values: Array) -> Array:
        return on_face(problem.preconditioned(values))

    axes = [np.outer(axis, np.ones(len(radii))) for axis in np.eye(2)]
    faces = np.array([on_face(axis) for axis in axes]) * problem.given[:, None, None]
    images = np.array([precondition(face) for face in faces])
    sums = np.linalg.pinv(np.einsum("acn,bcn->ab", faces, images), rcond=1e-10, hermitian=True)
    residual = on_face(slip)
    goal = max(1e-3 * np.abs(residual).max(), rtol * problem.size / 4)
    forces = np.zeros_like(point.forces)
    direction = np.zeros_like(forces)
    product_before = np.inf
    for _ in range(MOST_STEPS):
        z = precondition(residual)
        multipliers = sums @ np.einsum("acn,cn->a", faces, z)
        z -= np.einsum("a,acn->cn", multipliers, images)
        if np.abs(residual - np.einsum("a,acn->cn", multipliers, faces)).max() <= goal:
            break
        product = float((residual * z).sum())
        if not product > 0:
            break
        direction = z + product / product_before * direction
        product_before = product
        image = on_face(problem.moved(direction)) + curvature * direction
        bend = float((direction * image).sum())
        if not bend > 0:
            break
        forces += product / bend * direction
        residual -= product / bend * image
    return np.asarray(point.forces + forces)


def _search_on_discs(problem: SlidingProblem, point: _Point, trial: Array) -> _Point:
    """3: the first trial that does not rise."""
    for step in (1, 1 / 4, 1 / 4**2):
        projected = _at(problem, problem.discs.project(point.forces + step * (trial - point.forces)))
        rise, rounding = _rise(problem, point, projected)
        if rise <= rounding:
            return projected
    return point
