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

Where changes of forces displace by products in single precision, a state is accepted by one in double
precision; f' = f after an outer step that halved the residual, and corners with negative gaps are on the
face.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ..errors import BadArgument, NotConverged, at_least, require
from ..model.progress import counted
from ..model.types import Array, Flags
from ..threads import bounded
from .active_set import ContactState, require_gaps
from .rounding import EPS_SUM, EPS_TERM

INNER_STEPS = 60  # of conjugate gradients on a face; of alpha, each smaller by half or more
OUTER_STEPS = 300  # 5 to 40 are met
# of the response of a corner to itself: curvatures below are rounding, eigenvalues of H are above 0.01
LEAST_CURVATURE = 1e-6
# of a residual: what steps in single precision can leave of it before they show in the slope
EPS_STEPS = 1e-4
# of the load on one corner: the least range of displacements over which a residual is taken
LEAST_DISPLACEMENT = 1e-3


class MatrixFree:
    """What `solve_matrix_free` needs of a flexibility H; a subclass defines the product and `on_face`.

    Arrays are like those of the initial gaps, (corners, n) or (corners, n, n).

    Attributes
    ----------
    unit : float, about the displacement of a corner under a unit force on it, or None where it is not known
    """

    unit: float | None = None

    def __matmul__(self, forces: Array) -> Array:
        """Returns the gaps that forces add."""
        raise NotImplementedError

    def on_face(self, face: Flags) -> Callable[[Array], Array]:
        """Returns a preconditioner, from gaps to forces, for the corners of a face."""
        raise NotImplementedError

    @property
    def settling_displaces(self) -> bool:
        """Whether `settled` changes gaps."""
        return False

    def settled(self, forces: Array, g0: Array, slope: Array) -> Array:
        """Returns forces of lower energy, with the same gaps unless `settling_displaces`."""
        return forces


class Iterate(NamedTuple):
    """Forces on the k corners that can touch, and grad q, which are the gaps up to a free approach; arrays
    (k,). The slope is `exact` to double precision, or to single precision of the steps.
    """

    forces: Array
    slope: Array
    exact: bool = True


@bounded
def solve_matrix_free(
    flexibility: MatrixFree,
    g0: Array,
    *,
    load: float | None = None,
    approach: float | None = None,
    start: Array | None = None,
    rtol: float = 1e-10,
    steps: MatrixFree | None = None,
) -> ContactState:
    """Returns the contact state at a load or at an approach; its iterations are products with H.

    Parameters
    ----------
    flexibility : MatrixFree
    g0 : array (corners, n) or (corners, n, n), initial gaps; inf where a corner can never touch
    load, approach : float, one of them
    start : array like g0, forces to begin with; scaled to the load
    rtol : float, largest penetration, or gap under a force, over the range of H f
    steps : MatrixFree, H to single precision for changes of forces, or None for H itself and a step down the
        slope each time

    Raises BadArgument, also for a flexibility that is not positive definite where the approach is given, and
    NotConverged if rtol is out of reach.
    """
    energy = _Energy(flexibility, g0, load, approach)
    if load is None:
        rtol = min(rtol, energy.below_full() / 100)
    point = energy.evaluate(energy.project(energy.first(start)))
    alpha = 1 / energy.unit
    kkt = exact_kkt = least = np.inf
    halved = False
    face: Flags | None = None
    for _ in range(OUTER_STEPS):
        counted()
        energy.steps = steps if steps and (halved or face is None) else flexibility
        if not halved:
            point, alpha = _gradient_step(energy, point, alpha)  # 1
            point = energy.settled(point)
        face_before = face
        face = energy.face(point, alpha, rtol) if steps else point.forces > 0
        # a better minimum on a wrong face is of no use
        reduction = 0.5 if face_before is None or np.any(face != face_before) else 1e-3
        trial = _face_step(energy, point, face, rtol, reduction)  # 2
        point = energy.settled(_projected_search(energy, point, trial))  # 3
        kkt_before = kkt
        kkt = energy.residual(point)
        if kkt <= max(rtol, EPS_STEPS * exact_kkt):
            point = energy.exact(point)
            kkt = energy.residual(point)
            exact_kkt = kkt
        least = min(least, kkt)
        if kkt <= rtol:
            return energy.state(point, kkt)
        halved = steps is not None and kkt < kkt_before / 2
    raise NotConverged(
        f"relative residual {at_least(least)} instead of {rtol:g} after {OUTER_STEPS} outer steps and "
        f"{energy.products} products on {len(point.forces)} corners; take Cells(residual=...) larger, "
        "an `initial` state, or, where blocks are much smaller than a cell, the unilateral law",
        iterations=OUTER_STEPS,
    )


@bounded
def state_of(
    flexibility: MatrixFree,
    g0: Array,
    forces: Array,
    *,
    load: float | None,
    approach: float | None,
    rtol: float,
) -> ContactState | None:
    """Returns the contact state with these forces, or None where its residual is above rtol."""
    energy = _Energy(flexibility, g0, load, approach)
    point = energy.evaluate(energy.project(energy.first(forces)))
    kkt = energy.residual(point)
    return energy.state(point, kkt) if kkt <= rtol else None


def forces_by_approach(flexibility: MatrixFree, face: Flags) -> Array:
    """Returns forces on a face, boolean array like the gaps, that move all its corners by 1, array like the
    face: the derivative of forces by the approach, since corners that open or close on the way have none
    then. Their sum is the stiffness.

    Raises NotConverged where rounding stops the conjugate gradients.
    """
    from scipy.sparse.linalg import LinearOperator, cg  # here: most states do without

    count = int(np.count_nonzero(face))

    def on_face(function: Callable[[Array], Array]) -> Any:
        """Returns an operator between values on the face."""

        def product(values: Array) -> Array:
            on_all = np.zeros(face.shape)
            on_all[face] = values
            return function(on_all)[face]

        return LinearOperator((count, count), matvec=product, dtype=float)

    displacement = on_face(flexibility.__matmul__)
    preconditioner = on_face(flexibility.on_face(face))
    forces, steps = cg(displacement, np.ones(count), rtol=1e-8, maxiter=1000, M=preconditioner)
    if steps:
        raise NotConverged(f"no stiffness of {count} closed corners after {steps} steps", iterations=steps)
    on_all = np.zeros(face.shape)
    on_all[face] = forces
    return on_all


class _Energy:
    """q of (c) in the k corners that can touch.

    Attributes
    ----------
    touch : boolean array like all gaps
    lowest : float, the given approach or the least initial gap
    g0 : array (k,), initial gaps less `lowest`
    unit : displacement, or its range, under a unit force (length per force)
    products : number of products with H
    steps : MatrixFree, H for changes of forces
    """

    def __init__(
        self, flexibility: MatrixFree, g0: Array, load: float | None, approach: float | None
    ) -> None:
        self.all_gaps = require_gaps(g0, load, approach)
        self.H = flexibility
        self.steps = flexibility
        self.load = load
        self.approach = approach
        self.products = 1
        self.touch = np.isfinite(self.all_gaps)
        self.all_touch = bool(self.touch.all())
        gaps = self.all_gaps[self.touch]
        # a load leaves the approach free: a large one would take digits from small displacements
        self.lowest = float(gaps.min()) if approach is None else approach
        self.g0 = gaps - self.lowest
        self.unit = flexibility.unit or self._range_under_unit_force()

    def _range_under_unit_force(self) -> float:
        unit_force = np.zeros(self.touch.shape)
        unit_force.ravel()[np.argmax(self.touch)] = 1
        return float(np.ptp(self.H @ unit_force))

    def on_all_corners(self, values: Array | Flags) -> Array:
        """Returns values, array (k,), on all corners, 0 where a corner cannot touch."""
        if self.all_touch:
            return np.asarray(values.reshape(self.touch.shape))
        on_all = np.zeros(self.touch.shape)
        on_all[self.touch] = values
        return on_all

    def below_full(self) -> float:
        """Distance of the given approach from full contact, over the range of g0, or inf where no forces on
        all corners leave them where they are; BadArgument unless it is positive.
        """
        if len(self.g0) < self.touch.size:
            return np.inf
        forces = self.preconditioner(np.ones(len(self.g0), bool))(np.ones(len(self.g0)))
        displacement = np.abs(self.displacement(forces, self.H)).max()
        if displacement > LEAST_DISPLACEMENT * self.unit * forces.max() or forces.min() < 0:
            return np.inf
        below = float(forces @ self.g0 / forces.sum())
        height = np.ptp(self.g0)
        if below <= 1e-9 * height:  # which leaves the load to rounding
            raise BadArgument(
                "approach",
                self.approach,
                f"must stay below the mean height of the obstacle, {self.lowest + below:.10g} on these "
                "cells, where the contact is full and more load presses no deeper; give the load instead",
            )
        return float(below / height)

    def touching(self, values: Array) -> Array:
        """Returns values on all corners of those that can touch, array (k,)."""
        return values.ravel() if self.all_touch else values[self.touch]

    def displacement(self, forces: Array, H: MatrixFree) -> Array:
        self.products += 1
        return self.touching(H @ self.on_all_corners(forces))

    def preconditioner(self, face: Flags) -> Callable[[Array], Array]:
        on_face = self.steps.on_face(self.on_all_corners(face) > 0)
        return lambda values: self.touching(on_face(self.on_all_corners(values)))

    def evaluate(self, forces: Array) -> Iterate:
        return Iterate(forces, self.g0 + self.displacement(forces, self.H))

    def exact(self, point: Iterate) -> Iterate:
        return point if point.exact else self.evaluate(point.forces)

    def moved(self, point: Iterate, change: Array, displacement: Array) -> Iterate:
        """Returns the point after a change of forces, which displaces by steps."""
        exact = point.exact and self.steps is self.H
        return Iterate(point.forces + change, point.slope + displacement, exact)

    def to(self, point: Iterate, forces: Array) -> Iterate:
        """Returns the point with these forces."""
        if self.steps is self.H:
            return self.evaluate(forces)
        change = forces - point.forces
        return self.moved(point, change, self.displacement(change, self.steps))._replace(forces=forces)

    def face(self, point: Iterate, alpha: float, rtol: float) -> Flags:
        """Returns which corners have a force, or would have one after a step down the slope where gaps are
        negative beyond rtol, boolean array (k,).
        """
        gaps = point.slope - self.free_approach(point)
        pressed = alpha * np.maximum(-gaps - rtol * self.size(point), 0)
        ahead = self.settled_forces(point.forces + pressed, point.slope)
        return np.asarray((point.forces > 0) | (ahead > 0))

    def settled_forces(self, forces: Array, slope: Array) -> Array:
        on_all = self.H.settled(self.on_all_corners(forces), self.all_gaps, self.on_all_corners(slope))
        return self.touching(on_all)

    def settled(self, point: Iterate) -> Iterate:
        forces = self.settled_forces(point.forces, point.slope)
        return self.evaluate(forces) if self.H.settling_displaces else point._replace(forces=forces)

    def free_approach(self, point: Iterate) -> float:
        """The free approach, such that f.g = 0, else 0."""
        return 0.0 if self.load is None else float(point.forces @ point.slope / point.forces.sum())

    def first(self, start: Array | None) -> Array:
        if start is None:
            return np.full(len(self.g0), (self.load or 0.0) / len(self.g0))
        start = np.asarray(start, float)
        require(
            start.shape == self.touch.shape and np.all(np.isfinite(start)),
            "start",
            start,
            f"must be finite, of the shape {self.touch.shape}",
        )
        forces = np.maximum(start[self.touch], 0)
        if self.load is not None and forces.any():
            forces *= self.load / forces.sum()
        return forces

    def project(self, values: Array) -> Array:
        """Nearest point of Omega: max(values - tau, 0) with sum P."""
        if self.load is None:
            return np.maximum(values, 0)
        positive_sum = values[values > 0].sum()
        if abs(positive_sum - self.load) <= EPS_SUM * self.load:  # else rounding lifts all others above 0
            return np.maximum(values, 0) * (self.load / positive_sum)
        # Newton's method for tau, from below after its first step
        above = values[values > 0] if positive_sum else values
        above = values[values > (above.sum() - self.load) / len(above)]
        rising = True
        while rising:
            count = len(above)
            tau = (above.sum() - self.load) / count
            above = above[above > tau]
            rising = len(above) < count
        forces = np.maximum(values - tau, 0)
        if not forces.any():
            raise NotConverged(
                f"the load {self.load:g} is lost in the rounding of gaps of {np.abs(self.g0).max():g}: "
                "ask for a larger one"
            )
        return forces

    def size(self, point: Iterate) -> float:
        """Returns the range of H f (length)."""
        return float(max(np.ptp(point.slope - self.g0), LEAST_DISPLACEMENT * self.unit * point.forces.sum()))

    def residual(self, point: Iterate) -> float:
        gaps = point.slope - self.free_approach(point)
        size = self.size(point)
        violation = float(max(-gaps.min(), (gaps * (point.forces > 0)).max(), 0))
        if size:
            return violation / size
        return np.inf if violation else 0.0

    def rise(self, before: Iterate, after: Iterate, change: Array) -> tuple[float, float]:
        """Returns the rise of q over a change of forces, array (k,), and its rounding."""
        mean = Iterate(before.forces, (before.slope + after.slope) / 2)
        gaps = mean.slope - self.free_approach(mean)  # the change has the sum zero, but for rounding
        scale = self.size(Iterate(before.forces, after.slope))
        return float(change @ gaps), float(EPS_TERM * scale * np.abs(change).sum())

    def curvature_step(self, before: Iterate, after: Iterate, change: Array) -> float:
        """Step of Barzilai and Borwein from the change of slope over that of forces, array (k,); 0 where that
        is unknown.
        """
        length = change @ change
        curvature = change @ (after.slope - before.slope)
        return float(length / curvature) if curvature > LEAST_CURVATURE * self.unit * length else 0.0

    def state(self, point: Iterate, kkt: float) -> ContactState:
        free = self.free_approach(point)
        gaps = np.full(self.touch.shape, np.inf)
        gaps[self.touch] = point.slope - free
        forces = self.on_all_corners(point.forces)
        # at a given approach it is 0
        approach, load = self.lowest + free, float(point.forces.sum())
        return ContactState(forces, gaps, forces > 0, approach, load, self.products, kkt)


def _gradient_step(energy: _Energy, point: Iterate, alpha: float) -> tuple[Iterate, float]:
    """1: the projected step and the next alpha."""
    gaps = point.slope - energy.free_approach(point)
    for _ in range(INNER_STEPS):
        forces = energy.project(point.forces - alpha * gaps)
        change = forces - point.forces
        length = change @ change
        if not length > EPS_TERM**2 * (forces @ forces):  # the rounding of forces, which sum to P
            return point, 2 * alpha
        trial = energy.to(point, forces)
        step = energy.curvature_step(point, trial, change)
        rise, rounding = energy.rise(point, trial, change)
        if rise <= -0.1 * length / alpha or abs(rise) <= rounding:
            return trial, step or 2 * alpha
        alpha = min(step or alpha, alpha / 2)
    raise NotConverged(
        "no step of gradient projection lowers the energy: is the flexibility positive semidefinite? "
        "At a given approach it must be so with its rigid-body constant; give the load instead"
    )


def _face_step(energy: _Energy, point: Iterate, face: Flags, rtol: float, reduction: float) -> Iterate:
    """2: a point near the minimum on the face, whose residual is smaller by `reduction`."""
    if not face.any():  # at an approach: no corner is pressed yet
        return point
    at_load = energy.load is not None
    closed = np.flatnonzero(face)
    precondition = energy.preconditioner(face)

    def on_all(values: Array) -> Array:
        spread = np.zeros(len(face))
        spread[closed] = values
        return spread

    ones = precondition(on_all(np.ones(len(closed))))[closed] if at_load else np.zeros(len(closed))
    slope = point.slope[closed]
    residual = slope - slope.mean() * at_load
    goal = max(reduction * np.abs(residual).max(), rtol * energy.size(point) / 4)
    direction = np.zeros(len(closed))
    change = np.zeros(len(closed))
    displacement = np.zeros(len(face))
    product_before = np.inf
    for _ in range(INNER_STEPS):
        if np.abs(residual).max() <= goal:
            break
        z = precondition(on_all(residual))[closed]
        if at_load:
            z -= ones * (z.sum() / ones.sum())
        product = float(residual @ z)
        if not abs(product) > 0:  # underflow: nothing is left to gain
            break
        direction *= product / product_before
        direction -= z
        product_before = product
        image = energy.displacement(on_all(direction), energy.steps)
        on_face = image[closed]
        curvature = direction @ on_face
        if not curvature > LEAST_CURVATURE * energy.unit * (direction @ direction):
            if at_load:
                break
            raise BadArgument(
                "approach",
                energy.approach,
                "needs a flexibility that is positive definite with its rigid-body constant; give the load "
                "instead",
            )
        step = product / curvature
        change += step * direction
        displacement += step * image
        slope += step * on_face
        residual = slope - slope.mean() * at_load
    return energy.moved(point, on_all(change), displacement)


def _projected_search(energy: _Energy, point: Iterate, trial: Iterate) -> Iterate:
    """3: the first trial that does not rise."""
    if trial.forces.min() >= 0:
        return trial
    for step in (1, 1 / 4, 1 / 4**2):
        projected = energy.to(point, energy.project(point.forces + step * (trial.forces - point.forces)))
        rise, rounding = energy.rise(point, projected, projected.forces - point.forces)
        if rise <= rounding:
            return projected
    return point
