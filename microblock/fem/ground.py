"""Contact of a block with a rigid obstacle: what all meshes share."""

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..errors import require, require_depth
from ..model.bodies import Block
from ..model.contact_candidates import ContactCandidates
from ..model.intervals import distance_to_root, runs
from ..model.obstacles import heights
from ..model.problem import Problem
from ..model.solver import Solver
from ..model.types import Array, Flags, Interval

FAR = 1000.0  # size of an unbounded block over the reach of its contact boundary
WITHIN = 0.98  # of a bounded block, up to which the contact boundary may reach


@dataclass(frozen=True)
class Within:
    """An obstacle as far as a bounded body goes, |x| < `far`."""

    obstacle: Any
    far: float

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return getattr(self.obstacle, name)

    def height(self, x: Array) -> Array:
        """Returns the height at x, array (n,); inf beyond the body."""
        return np.where(np.abs(x) < self.far, heights(self.obstacle, np.asarray(x, float)), np.inf)

    def without_edges_of_body(self, candidates: ContactCandidates) -> ContactCandidates:
        """Returns ContactCandidates without ends and height jumps of the body."""

        def inside(place: float) -> bool:
            return abs(place) < self.far * (1 - 1e-6)

        ends = tuple(end if inside(end) else math.copysign(math.inf, end) for end in candidates.ends)
        if all(map(math.isinf, ends)):
            ends = ()
        height_jumps = tuple(filter(inside, candidates.height_jumps))
        detected = candidates.detected and bool(ends or candidates.kinks)
        return replace(candidates, ends=ends, height_jumps=height_jumps, detected=detected)

    def __repr__(self) -> str:
        return repr(self.obstacle)


class GroundSolver(Solver):
    """What solvers of a Block have in common."""

    body: Block
    verifies = True
    candidates: Any = None  # ContactCandidates at a load, or None

    def set_up(self) -> None:
        self.has_approach = self.domain < math.inf
        if not self.has_approach:
            self.require_lowest()

    @property
    def domain(self) -> float:
        """Half of the block's width, and its depth (length); inf for a half-plane."""
        return self.body.size

    @cached_property
    def problem(self) -> Problem:
        """The problem along x1, of a symmetric one of a half."""
        parts = (self.solid, self.law, self.obstacle, self.symmetric, self.candidates)
        return Problem(*parts, blocks=self.blocks)

    def first_load(self, approach: float) -> float:
        """Returns a load of about this approach; raises BadArgument unless it lies above first touch, on a
        bounded block.
        """
        words = (
            "has no meaning on an unbounded block, whose approach is that of the place where it is cut off: "
            "give the load, or a size"
        )
        require(self.has_approach, "approach", approach, words)
        places = np.linspace(-1, 1, 4097) * self.domain * WITHIN
        # the corner stands at the places
        shifts = enumerate(self.problem.shifts)
        lowest = min(self.problem.initial_gaps(places + shift)[corner].min() for corner, shift in shifts)
        require_depth(approach, approach - lowest, self.domain)
        return float(self.solid.E_star * (approach - lowest) / 2)

    def share(self, load: float) -> float:
        """Returns the load of the computed part."""
        return load / 2 if self.symmetric else load

    def runs(self, x: Array, closed: Flags, pressures: Array) -> dict[int, tuple[Interval, ...]]:
        """Returns {corner: intervals} of closed nodes, at x, (n,), from arrays (corners, n); at their ends
        p^2, continued linearly, vanishes.
        """
        closed = closed.copy()
        if self.symmetric:  # there one multiplier stands for all corners
            closed[:, 0] = closed[:, 0].any() & closed[:, 1]
            pressures = np.where(x == 0, pressures.mean(axis=0), pressures)
        zones = {}
        for corner, (flags, p) in enumerate(zip(closed, pressures)):
            ends = ((self._end(x, p, i, j, -1), self._end(x, p, j, i, 1)) for i, j in runs(flags))
            zones[corner] = tuple(ends)
        return zones

    def _end(self, x: Array, p: Array, i: int, j: int, side: int) -> float:
        """Returns where the zone of the closed nodes from i to j ends beside i."""
        fixed = [end for end in self.ends() if math.isclose(end, x[i])]
        if fixed or (self.symmetric and x[i] == 0):
            return float(x[i])
        outside = abs(x[min(max(i + side, 0), len(x) - 1)] - x[i])
        if i == j:
            return float(x[i] + side * outside / 2)
        past = distance_to_root(abs(x[i] - x[i - side]), p[i], p[i - side])
        return float(x[i] + side * min(outside, past))

    def ends(self) -> list[float]:
        """Returns contact points at which a corner meets an end of the obstacle."""
        return [end for corner in range(len(self.law.corners)) for end in self.problem.ends_of(corner)]
