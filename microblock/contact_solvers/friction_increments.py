"""Increments of frictional contact at the points of a level surface: cells of one grid, or nodes of a mesh.

At given loads (P, Q) the corner forces f and the shear forces q, array (2, ...), satisfy

    gaps  g0 + H f + G q - d >= 0,  f >= 0,  f g = 0,  sum f = P,
    slip  v = D - S q - C f - a,    |q| <= friction sum f,   v along q where |q| is at this limit, else v = 0,

with the approach d and the motion D of the obstacle, and ``a = D - S q - C f`` at the increment before. An
increment alternates between the first line at given q and the second one at given f (Panagiotopoulos, Ing.-
Arch. 44 (1975) 421) until the gaps stay. Uncoupled, G q is left out.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from ..errors import NotConverged
from ..model.progress import counted
from ..model.types import Array, Flags
from .coulomb_discs import SlidingProblem, slide
from .discs import AT_RIM
from .projected_gradients import solve_matrix_free

RESIDUAL = 1e-7  # of an increment: far below what cells, nodes and increments leave
ALTERNATIONS = 60  # 3 to 12 are met
NEARLY_SLIPS = 0.98  # of f P, beyond which the way of the obstacle was seen to change by more than 5 %
DOUBTFUL = 0.05  # of the dissipation: a change from the coarser history, which is said
NEGLIGIBLE = 1e-4  # of f times the work: smaller dissipations come and go with single cells


@dataclass(frozen=True, eq=False)
class Increment:
    """Forces and displacements of points at loads (P, Q), and what happened on the way.

    Attributes
    ----------
    load, shear : P, and Q, array (2,)
    forces : array (corners, ...)
    tangential, slip : arrays (2, ...), q, and slip since first contact (length)
    apart : array (2, ...), a, displacement of the obstacle less that of the face (length)
    approach, motion : d, and D, array (2,)
    stick : boolean array (...), points in contact below the limit of friction
    energy, work, dissipation : float
    residual : largest violation over the displacement
    iterations : products with H and outer steps for the shear
    """

    load: float
    shear: Array
    forces: Array
    tangential: Array
    slip: Array
    apart: Array
    approach: float
    motion: Array
    stick: Flags
    energy: float = 0.0
    work: float = 0.0
    dissipation: float = 0.0
    residual: float = 0.0
    iterations: int = 0

    @cached_property
    def pressing(self) -> Array:
        """Normal forces of the points, array (...)."""
        return np.asarray(self.forces.sum(axis=0))


class SlidingSolution:
    """Base of solutions in space with an `increment`: each of its points stands for an area of `areas`, one
    for all or an array (...), and ``along_surface(values, places)`` has values (...) between them.
    """

    solver: Any
    increment: Any
    areas: Any
    along_surface: Any

    @property
    def energy(self) -> float:
        return float(self.increment.energy)

    @property
    def work(self) -> float:
        return float(self.increment.work)

    @property
    def stiffness(self) -> None:
        """None: sticking places make it larger than without friction, and it has a value for each way on."""

    @property
    def shear_traction(self) -> Array:
        """q, array (2, ...) (stress)."""
        return np.asarray(self.increment.tangential / self.areas)

    @property
    def slip(self) -> Array:
        """Slip since first contact, array (2, ...) (length)."""
        return np.asarray(self.increment.slip)

    @property
    def stick(self) -> Flags:
        return np.asarray(self.increment.stick)

    def with_friction(self) -> dict[str, Any]:
        return {
            "shear": self.increment.shear,
            "shear_traction": self.shear_traction.reshape(2, -1).T,
            "stick": self.stick.ravel(),
            "dissipation": float(self.increment.dissipation),
            "tangential_approach": self.increment.motion,
        }

    def shear_at(self, places: Array) -> Array:
        """Returns q at places, array (n, 2), linear between the points, within what friction allows."""
        q = np.array([self.along_surface(values, places) for values in self.shear_traction])
        pressing = self.along_surface(self.increment.pressing / self.areas, places)
        sizes = np.maximum(np.hypot(*q), np.finfo(float).tiny)
        return np.asarray((q * np.minimum(1.0, self.solver.law.friction * pressing / sizes)).T)


def noted_state(solution: Any, coarser: Increment) -> Any:
    """Returns the State of a solution, noting how little is known of its way: `coarser` is the increment
    after half as many ones, on cells also on half as many along an axis. Near full slip directions of slip,
    and with them its length, follow Q ever more slowly.
    """
    increment = solution.increment
    state = solution.state()
    share = np.hypot(*increment.shear) / (solution.solver.law.friction * increment.load)
    if share > NEARLY_SLIPS:
        return state.noting(
            f"the shear force is {share:.4g} of f P: tangential_approach and dissipation depend on the loads "
            "given on the way, and at f P are the least that the forces allow"
        )
    change = abs(increment.dissipation - coarser.dissipation)
    largest = max(increment.dissipation, coarser.dissipation)
    if change <= DOUBTFUL * max(largest, NEGLIGIBLE * solution.solver.law.friction * increment.work):
        return state
    return state.noting(
        f"dissipation changes by {change / largest:.2g} of itself where cells and increments are halved in "
        "number: take finer cells or elements, or give more loads on the way"
    )


class ShearResponse(Protocol):
    """What the faces of a body answer to shear forces q, array (2, ...), and to corner forces f."""

    def moved(self, tangential: Array, /) -> Array:
        """Returns S q, displacements of the faces, array (2, ...)."""

    def inverse(self, displacement: Array, /) -> Array:
        """Returns an approximate inverse of S, arrays (2, ...)."""

    def raised(self, tangential: Array, /) -> Array:
        """Returns G q, what shear forces do to the gaps, array (corners, ...)."""

    def dragged(self, forces: Array, /) -> Array:
        """Returns C f, what corner forces do to the faces, array (2, ...)."""


@dataclass(frozen=True, eq=False)
class FrictionIncrements:
    """The contact with friction at the points of a surface.

    Attributes
    ----------
    H : MatrixFree, gaps from corner forces
    g0 : array (corners, ...), initial gaps
    faces : ShearResponse
    friction : float
    coupled : bool
    residual : float, largest violation of an increment over its displacement
    given : boolean array (2,), whether Q is given along an axis; else D is 0, across a plane of symmetry
    """

    H: Any
    g0: Array
    faces: ShearResponse
    friction: float
    coupled: bool
    residual: float
    given: Flags = field(default_factory=lambda: np.ones(2, bool))

    def at_rest(self) -> Increment:
        """Returns the increment before the first contact."""
        none = np.zeros((2, *self.g0.shape[1:]))
        return Increment(
            load=0.0,
            shear=np.zeros(2),
            forces=np.zeros(self.g0.shape),
            tangential=none,
            slip=none,
            apart=none,
            approach=float(self.g0.min()),
            motion=np.zeros(2),
            stick=np.zeros(self.g0.shape[1:], bool),
        )

    def follow(self, loads: Array, count: int) -> Iterator[Increment]:
        """Yields the increments at the ends of legs through loads, array (k, 3), as `legs` cuts them."""
        increment = self.at_rest()
        for leg in legs(loads, count):
            for load, *shear in leg.tolist():
                counted(load=load)
                increment = self.advanced(increment, load, np.array(shear))
            yield increment

    def advanced(self, before: Increment, load: float, shear: Array) -> Increment:
        """Returns the next increment, at loads P and Q; raises NotConverged where alternations do not settle.

        1. normal forces at the gaps that the shear forces leave,
        2. shear forces within the limits of these normal forces,
        3. until the gaps stay.
        """
        forces = before.forces if before.load else None
        tangential = before.tangential
        raised = self.faces.raised(tangential) * self.coupled
        over_obstacle = np.isfinite(self.g0)
        steps = 0
        for _ in range(ALTERNATIONS):
            pressed = solve_matrix_free(  # 1
                self.H, self.g0 + raised, load=load, start=forces, rtol=self.residual
            )
            forces = pressed.forces
            radii = self.friction * forces.sum(axis=0)
            dragged = self.faces.dragged(forces)
            slid = slide(  # 2
                SlidingProblem(
                    self.faces.moved,
                    self.faces.inverse,
                    radii,
                    dragged + before.apart,
                    shear,
                    self.friction,
                    self.given,
                ),
                tangential,
                self.residual,
            )
            tangential = slid.forces
            steps += pressed.iterations
            raised_now = self.faces.raised(tangential)
            change = np.abs(raised_now - raised).max() if self.coupled else 0.0  # 3
            size = float(
                np.abs(pressed.approach + pressed.gaps[over_obstacle] - self.g0[over_obstacle]).max()
            )
            if change <= 10 * self.residual * size:
                break
            raised = raised_now
        else:
            raise NotConverged(
                f"normal and shear forces still change each other by {change / size:.1e} of the displacement "
                f"after {ALTERNATIONS} alternations: take a smaller friction or coupled=False",
                iterations=ALTERNATIONS,
            )
        touching = radii > 0
        after = Increment(
            load=load,
            shear=shear,
            forces=forces,
            tangential=tangential,
            slip=before.slip + np.where(touching, slid.slip, 0.0),
            apart=_at_points(slid.motion, tangential) - self.faces.moved(tangential) - dragged,
            approach=pressed.approach,
            motion=slid.motion,
            stick=touching & (np.hypot(*tangential) < (1 - AT_RIM) * radii),
            residual=max(pressed.kkt, slid.residual, change / size),
            iterations=before.iterations + steps,
        )
        return self._with_energies(before, after, slid.slip, raised_now)

    def _with_energies(self, before: Increment, after: Increment, slip: Array, raised: Array) -> Increment:
        """Returns an increment with its elastic energy, the dissipation by the means of the limits of
        friction over the increment, and their sum, the work of the loads.
        """
        lowered = self.H @ after.forces + raised
        moved = _at_points(after.motion, after.apart) - after.apart
        energy = float((after.forces * lowered).sum() + (after.tangential * moved).sum()) / 2
        limits = self.friction * (after.pressing + before.pressing) / 2
        lost = before.dissipation + float((limits * np.hypot(*slip))[~after.stick].sum())
        return replace(after, energy=energy, work=energy + lost, dissipation=lost)


def _at_points(motion: Array, values: Array) -> Array:
    """Returns a motion, array (2,), at the points of values, array (2, ...): one that numpy broadcasts."""
    return motion.reshape(2, *[1] * (values.ndim - 1))


def legs(loads: Array, count: int) -> Iterator[Array]:
    """Yields of each leg through loads, array (k, 3), the loads of its increments, arrays (m, 3)."""
    start = np.zeros(3)
    for end in loads:
        yield increments(start, end, float(loads[:, 0].max()), count)
        start = end


def increments(start: Array, end: Array, largest: float, count: int) -> Array:
    """Returns the loads (P, Q1, Q2) of the increments of a leg, array (m, 3), the last one its end. Cube
    roots of P are equally far from each other, as radii under a sphere are: `count` of them up to the largest
    P, and an eighth of these at a constant one.
    """
    first, last = np.cbrt((start[0], end[0]))
    growth = abs(last - first) / np.cbrt(largest)
    number = int(np.ceil(count * max(growth, 1 / 8)))
    share = np.arange(1, number + 1) / number
    if growth:
        share = ((first + share * (last - first)) ** 3 - start[0]) / (end[0] - start[0])
    share[-1] = 1.0
    return np.asarray(start + share[:, None] * (end - start))
