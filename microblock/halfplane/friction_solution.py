"""A state of a history of frictional contact on cells of any width."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..contact_solvers.friction_pivots import AT_LIMIT
from ..contact_solvers.frictional_contact import FrictionState
from ..errors import BadArgument
from ..model.history import PairSolution
from ..model.intervals import contains, distance_to_ends, runs
from ..model.missed_contact import open_with_neighbours, overlaps
from ..model.periodic import EQUAL
from ..model.problem import Problem
from ..model.refinement import FEWEST_GRADED
from ..model.solution import ErrorParts
from ..model.types import Array, Flags, Integers, Zones
from .friction_cells import singular_points
from .friction_edges import zones_on_cells
from .subsurface import HalfPlaneBelow, below_cells


@dataclass(frozen=True)
class FrictionErrors(ErrorParts):
    """Parts of the relative L2 error of pressure, M/ell and q/f.

    Attributes
    ----------
    discretisation : what finer levels would change, and the loss where q/f jumps
    """

    discretisation: float


@dataclass(frozen=True, eq=False, repr=False)
class FrictionCells(PairSolution):
    """A solution at a pair of loads, on cells of constant tractions.

    Attributes
    ----------
    edges : array (n, 2), of the cells
    friction_state : FrictionState, forces and gaps, with a tangential force for each cell
    displacement, psi, micromoment : arrays (n,), averages over the cells
    opposite : array (corners, n), displacement of a second body under the corners
    unknowns : number of forces
    estimate : FrictionErrors, or None without a level before
    notes : why cells were taken
    """

    solver: Any
    problem: Problem
    edges: Array
    friction_state: FrictionState
    displacement: Array
    psi: Array
    micromoment: Array
    unknowns: int
    opposite: Array
    estimate: FrictionErrors | None = None
    notes: tuple[str, ...] = ()

    @property
    def friction(self) -> float:
        law: Any = self.problem.law
        return float(law.friction)

    @cached_property
    def x(self) -> Array:
        return self.edges.mean(axis=1)

    @cached_property
    def weights(self) -> Array:
        return self.edges[:, 1] - self.edges[:, 0]

    @cached_property
    def pressures(self) -> Array:
        return self.friction_state.normal.reshape(-1, len(self.x)) / self.weights

    @property
    def closed(self) -> Flags:
        return self.friction_state.closed.reshape(-1, len(self.x))

    @property
    def load(self) -> float:
        return self.friction_state.load

    @property
    def approach(self) -> float:
        return self.friction_state.approach

    @property
    def residual(self) -> float:
        return self.friction_state.residual

    @property
    def iterations(self) -> int:
        return self.friction_state.iterations

    @cached_property
    def _fitted(self) -> tuple[Zones, dict[float, float]]:
        return zones_on_cells(
            self.edges,
            self.closed,
            self.friction_state.stick & ~self.friction_state.at_limit,
            self.pressures,
            self.friction * self.pressures.sum(axis=0),
            self.shear_traction,
            singular_points(self.problem),
            self.problem.law.corners,
        )

    @property
    def zones_by_name(self) -> Zones:
        return self._fitted[0]

    @property
    def doubts(self) -> dict[float, float]:
        """{edge: how far it may be off (length)}."""
        return self._fitted[1]

    @cached_property
    def jumping(self) -> Integers:
        """Numbers of cells with a jump of q/f by more than half of the pressure."""
        p = self.pressures.sum(axis=0)
        q = self.shear_traction / self.friction
        jumping = (p[1:] > 0) & (p[:-1] > 0) & (np.abs(np.diff(q)) > (p[1:] + p[:-1]) / 4)
        return np.flatnonzero(jumping)

    @property
    def lost_in_jumps(self) -> float:
        """Relative L2 error of q/f where it jumps."""
        p = self.pressures.sum(axis=0)
        at = self.jumping
        half = np.diff(self.shear_traction)[at] / self.friction / 2
        return float(np.sqrt(half**2 @ (self.norm[at] + self.norm[at + 1]) / (self.norm @ p**2)))

    @cached_property
    def hidden(self) -> list[float]:
        """Places where a corner that is open overlaps the obstacle, which cells are too wide to see."""
        least = EQUAL * np.ptp(self.friction_state.gap_changes)
        places: list[float] = []
        for corner, closed in enumerate(self.closed):
            x = self.problem.sample_points(corner)
            x = x[contains(self.edges, x)]
            valleys = self.problem.candidates.minima + self.problem.shifts[corner]
            looked_at = contains(self.edges[open_with_neighbours(closed)], x)
            looked_at |= np.isin(x, valleys) & ~contains(self.edges[closed], x)
            gaps = np.where(looked_at, self.gap(corner, x), np.nan)
            places += [overlap.place for overlap in overlaps(corner, x, gaps, 1.0, least)]
        return places

    @cached_property
    def spots(self) -> list[tuple[int, int]]:
        """Contacts of fewer than FEWEST_GRADED cells: (first, last) of their cells."""
        return [(i, j) for i, j in runs(np.any(self.closed, axis=0)) if j - i < FEWEST_GRADED - 1]

    @property
    def lost_in_spots(self) -> float:
        """Relative L2 norm of the pressure of `spots`."""
        squares = self.norm * self.pressures.sum(axis=0) ** 2
        return float(np.sqrt(sum(squares[i : j + 1].sum() for i, j in self.spots) / squares.sum()))

    @cached_property
    def norm(self) -> Array:
        """Weights of errors, array (n,); at an edge of the obstacle times the distance."""
        ends = self.problem.obstacle.ends
        return self.weights * distance_to_ends(self.x, ends, self.problem.shifts)

    @cached_property
    def fields(self) -> HalfPlaneBelow:
        edges = self.edges[:, 0], self.edges[:, 1]
        loads = self.pressures, self.micromoment, self.shear_traction
        return below_cells(self.problem, edges, *loads, bulk=self.friction_state.bulk)

    def pressure(self, corner: int, x: Array) -> Array:
        """Returns the pressure of a corner at x, arrays (n,): a polygon through the centres."""
        pressed = contains(self.edges[self.closed[corner]], x)
        return np.where(pressed, np.interp(x, self.x, self.pressures[corner]), 0.0)

    def gap(self, corner: int, x: Array) -> Array:
        """Returns the gap of a corner at x, arrays (n,); raises BadArgument beyond the cells."""
        low = self.edges[0, 0]
        high = self.edges[-1, 1]
        if not np.all((x >= low) & (x <= high)):
            raise BadArgument("x", x, f"must lie within the cells, from {low} to {high}")
        gap_changes = self.friction_state.gap_changes.reshape(-1, len(self.x))[corner]
        return self.problem.initial_gaps(x)[corner] - self.approach + np.interp(x, self.x, gap_changes)


def one_force_a_cell(forces: FrictionState, n: int) -> FrictionState:
    """Returns the FrictionState of n cells, where corners may have tangential forces of their own."""
    if len(forces.tangential) == n:
        return forces
    normal = forces.normal.reshape(-1, n)
    tangential = forces.tangential.reshape(-1, n)
    closed = forces.closed.reshape(-1, n)
    total = tangential.sum(axis=0)
    together = np.abs(total) >= (1 - AT_LIMIT) * np.abs(tangential).sum(axis=0)
    at_limit = np.all(forces.at_limit.reshape(-1, n) | ~closed, axis=0)
    slip = (normal * forces.slip.reshape(-1, n)).sum(axis=0)
    return replace(
        forces,
        tangential=total,
        slip=slip / np.maximum(normal.sum(axis=0), np.finfo(float).tiny),
        stick=np.any(forces.stick.reshape(-1, n), axis=0),
        at_limit=at_limit & closed.any(axis=0) & together,
    )
