"""Contact states on products with the flexibility: gradient projection and conjugate gradients.

Conditions (a) of `active_set` with c = 1 are those of the minimum of

    q(f) = f.H f/2 + g0.f     on     Omega = {f >= 0, sum f = P},
    (c)

or, at a given approach d, of q(f) - d sum f on {f >= 0}. An outer step is

1. gradient projection: f' = proj(f - alpha grad q), alpha smaller until q falls by |f' - f|^2/(10 alpha),
   begun with the step of Barzilai and Borwein (IMA J. Numer. Anal. 8 (1988) 141);
2. conjugate gradients on the face {f'_i > 0} without the signs, zero-sum by a constraint preconditioner;
3. projected search: proj(f' + t (f_face - f')), t = 1, 1/4, ... until q does not rise, else f' itself.

It is GPCG of More and Toraldo (SIAM J. Optim. 1 (1991) 93) with the simplex in place of the box, and
converges linearly (Luo and Tseng, Ann. Oper. Res. 46 (1993) 157).
"""

import numpy as np

from ..errors import BadArgument, NotConverged, at_least, require
from ..model.progress import counted
from ..threads import bounded
from .active_set import ContactState, require_given
from .rounding import EPS_SUM, EPS_TERM

STEPS = 60  # of conjugate gradients on a face; of alpha, each smaller by half or more
OUTER_STEPS = 300  # 5 to 40 are met
# of the response of a corner to itself: curvatures below are rounding, eigenvalues of H are above 0.01
FLAT = 1e-6
# of the load on one corner: the least range of displacements over which a residual is taken
LEAST = 1e-3


@bounded
def solve(flexibility, g0, *, load=None, approach=None, start=None, rtol=1e-10):
    """The state at a load or at an approach.

    Parameters
    ----------
    flexibility : object with ``@`` of arrays like g0, and ``on_face(there)``, a preconditioner of some
        corners; optionally ``settled(forces, g0, slope)``, forces of lower q, of the same gaps unless
        ``settling_displaces``
    g0 : array (corners, n), initial gaps; inf where a corner can never touch
    load, approach : float, one of them
    start : array like g0, forces to begin with; scaled to the load
    rtol : float, largest penetration, or gap under a force, over the range of H f

    Returns a ContactState, whose iterations are products with H.

    Raises BadArgument, also for a flexibility that is not positive definite where the approach is given, and
    NotConverged if rtol is out of reach.
    """
    problem = _Problem(flexibility, g0, load, approach)
    if load is None:
        rtol = min(rtol, problem.below_full() / 100)
    forces = problem.project(problem.first(start))
    slope, alpha, best, face = problem.slope(forces), 1 / problem.unit, np.inf, None
    for _ in range(OUTER_STEPS):
        counted()
        forces, slope, alpha = _gradient_step(problem, forces, slope, alpha)
        forces, slope = problem.settled(forces, slope)
        face, before = forces > 0, face
        inner = 1e-3 if np.array_equal(face, before) else 0.5  # a better one on a wrong face is of no use
        trial, ahead = _face_step(problem, forces, slope, rtol, inner)
        forces, slope = _projected_search(problem, forces, slope, trial, ahead)
        forces, slope = problem.settled(forces, slope)
        kkt = problem.residual(forces, slope)
        best = min(best, kkt)
        if kkt <= rtol:
            return problem.report(forces, slope, kkt)
    raise NotConverged(
        f"relative residual {at_least(best)} instead of {rtol:g} after {OUTER_STEPS} outer steps and "
        f"{problem.products} products on {forces.size} corners; take Cells(residual=...) larger, "
        "an `initial` state, or, where blocks are much smaller than a cell, the unilateral law",
        iterations=OUTER_STEPS,
    )


class _Problem:
    """(c) in the corners that can touch, g0 less a given approach or the least of them; counts products with
    H.
    """

    def __init__(self, flexibility, g0, load, approach):
        self.all_gaps = g0 = require_given(g0, load, approach)
        self.H, self.load, self.approach, self.products = flexibility, load, approach, 1
        self.touch = np.isfinite(g0)
        # a load leaves the level free: a large one would take digits from small displacements
        self.lowest = float(g0[self.touch].min()) if approach is None else approach
        self.g0, one = g0[self.touch] - self.lowest, np.zeros(g0.shape)
        one.ravel()[np.argmax(self.touch)] = 1
        self.unit = float(np.ptp(flexibility @ one))  # range of the displacement under a unit force

    def spread(self, values):
        whole = np.zeros(self.touch.shape)
        whole[self.touch] = values
        return whole

    def below_full(self):
        """Distance of the given approach from full contact, over the range of g0, or inf where no forces on
        all corners leave them where they are; BadArgument unless it is positive.
        """
        if len(self.g0) < self.touch.size:
            return np.inf
        forces = self.preconditioner(True)(np.ones(len(self.g0)))
        displaced = np.abs(self.displacement(forces)).max() > LEAST * self.unit * forces.max()
        if displaced or forces.min() < 0:
            return np.inf
        below, size = float(forces @ self.g0 / forces.sum()), np.ptp(self.g0)
        if below <= 1e-9 * size:  # which leaves the load to rounding
            raise BadArgument(
                "approach",
                self.approach,
                f"must stay below the mean height of the obstacle, {self.approach + below:.10g} on these "
                "cells, where the contact is full and more load presses no deeper; give the load instead",
            )
        return below / size

    def displacement(self, forces):
        self.products += 1
        return (self.H @ self.spread(forces))[self.touch]

    def preconditioner(self, face):
        on_face = self.H.on_face(self.spread(face) > 0)
        return lambda values: on_face(self.spread(values))[self.touch] * face

    def settled(self, forces, slope):
        settle = getattr(self.H, "settled", None)
        if settle is None:
            return forces, slope
        found = settle(self.spread(forces), self.all_gaps, self.spread(slope))[self.touch]
        return found, self.slope(found) if getattr(self.H, "settling_displaces", False) else slope

    def slope(self, forces):
        """grad q: the gaps, up to a free approach."""
        return self.g0 + self.displacement(forces)

    def level(self, forces, slope):
        """The free approach, such that f.g = 0, else 0."""
        return 0.0 if self.load is None else float(forces @ slope / forces.sum())

    def first(self, start):
        if start is None:
            return np.full(len(self.g0), 0.0 if self.load is None else self.load / len(self.g0))
        start = np.asarray(start, float)
        require(
            start.shape == self.touch.shape and np.all(np.isfinite(start)),
            "start",
            start,
            f"must be finite, of the shape {self.touch.shape}",
        )
        chosen = np.maximum(start[self.touch], 0)
        return chosen if self.load is None or not chosen.sum() else chosen * (self.load / chosen.sum())

    def project(self, values):
        """Nearest point of Omega: max(values - tau, 0) with sum P."""
        if self.load is None:
            return np.maximum(values, 0)
        whole = values[values > 0].sum()
        if abs(whole - self.load) <= EPS_SUM * self.load:  # else rounding lifts all others above 0
            return np.maximum(values, 0) * (self.load / whole)
        sums = np.cumsum(np.sort(values)[::-1]) - self.load
        found = np.maximum(values - (sums / np.arange(1, len(sums) + 1)).max(), 0)
        if not found.any():
            raise NotConverged(
                f"the load {self.load:g} is lost in the rounding of gaps of {np.abs(self.g0).max():g}: "
                "ask for a larger one"
            )
        return found

    def size(self, forces, slope):
        return max(np.ptp(slope - self.g0), LEAST * self.unit * forces.sum())

    def residual(self, forces, slope):
        gaps, size = slope - self.level(forces, slope), self.size(forces, slope)
        wrong = max(-gaps.min(), (gaps * (forces > 0)).max())
        return max(wrong, 0) / size if size else 0.0

    def report(self, forces, slope, kkt):
        level = self.level(forces, slope)
        gaps = np.full(self.touch.shape, np.inf)
        gaps[self.touch] = slope - level
        approach = self.approach if self.load is None else self.lowest + level
        whole, load = self.spread(forces), float(forces.sum())
        return ContactState(whole, gaps, whole > 0, approach, load, self.products, float(kkt))


def _gradient_step(problem, forces, slope, alpha):
    """1: the projected step, its slope, and the next alpha."""
    slope_here = slope - problem.level(forces, slope)
    for _ in range(STEPS):
        moved = problem.project(forces - alpha * slope_here)
        change = moved - forces
        length = change @ change
        if not length > 0:
            return forces, slope, 2 * alpha
        ahead = problem.slope(moved)
        rise, rounding = _rise(problem, forces, change, slope, ahead)
        if rise <= -0.1 * length / alpha or abs(rise) <= rounding:
            return moved, ahead, _curvature_step(problem, change, ahead - slope) or 2 * alpha
        alpha = min(_curvature_step(problem, change, ahead - slope) or alpha, alpha / 2)
    raise NotConverged(
        "no step of gradient projection lowers the energy: is the flexibility positive semidefinite? "
        "At a given approach it must be so with its level; give the load instead"
    )


def _curvature_step(problem, change, bend):
    """Step from the change of slope; 0 where that is unknown."""
    curvature, length = change @ bend, change @ change
    return length / curvature if curvature > FLAT * problem.unit * length else 0.0


def _rise(problem, forces, change, slope, ahead):
    """The rise of q over a change, and its rounding."""
    middle = (slope + ahead) / 2
    middle = middle - problem.level(forces, middle)  # the change has the sum zero, but for rounding
    return change @ middle, EPS_TERM * problem.size(forces, ahead) * np.abs(change).sum()


def _face_step(problem, forces, slope, rtol, inner):
    """2: forces and slope near the minimum on the face."""
    face, free = forces > 0, problem.load is not None
    precondition = problem.preconditioner(face)
    ones = precondition(face * 1.0) if free else 0.0
    residual = _on_face(slope, face, free)
    enough = max(inner * np.abs(residual).max(), rtol * problem.size(forces, slope) / 4)
    forces, slope, direction, before = forces.copy(), slope.copy(), np.zeros(len(forces)), np.inf
    for _ in range(STEPS):
        if np.abs(residual).max() <= enough:
            break
        z = precondition(residual)
        if free:
            z -= ones * (z.sum() / ones.sum())
        product = residual @ z
        if not abs(product) > 0:  # underflow: nothing is left to gain
            break
        direction *= product / before
        direction -= z
        before = product
        answer = problem.displacement(direction)
        curvature = direction @ answer
        if not curvature > FLAT * problem.unit * (direction @ direction):
            if free:
                break
            raise BadArgument(
                "approach",
                problem.approach,
                "needs a flexibility that is positive definite with its level; give the load instead",
            )
        forces += product / curvature * direction
        slope += product / curvature * answer
        residual = _on_face(slope, face, free)
    return forces, slope


def _on_face(slope, face, free):
    residual = slope * face
    return residual - residual.sum() / np.count_nonzero(face) * face if free else residual


def _projected_search(problem, forces, slope, trial, ahead):
    """3: forces and slope of the first trial that does not rise."""
    if trial.min() >= 0:
        return trial, ahead
    for part in (1, 1 / 4, 1 / 4**2):
        moved = problem.project(forces + part * (trial - forces))
        there = problem.slope(moved)
        rise, rounding = _rise(problem, forces, moved - forces, slope, there)
        if rise <= rounding:
            return moved, there
    return forces, slope
