"""Contact of the ground with a rigid obstacle by finite elements whose mesh follows the edges of the zones.

A pass closes the gaps on trial zones, on a mesh with vertices at their edges. At a free edge
``p = K0/sqrt(r) + K1 sqrt(r)``, and ``dK0_i/de_j = -delta_ij K1_i/2`` at the solution: to move the edges
outwards by ``2 K0/K1`` is Newton's method. Mesh and orders are refined until the estimate holds:

discretisation   difference of pressure and micromoment between two refinement levels
edges            p by K1 delta/(2 sqrt r) beside an edge, of its next step
truncation       2 (outer edge/far)^2 (docs/theory/finite_elements.md)
obstacle         what nodes miss of the height, and overlaps that change no zones

The first zones are those of a half-plane.
"""

import math
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from .. import cost
from ..errors import BOUNDED, BadArgument, NotConverged, out_of_reach, require
from ..halfplane.first_zones import first_zones
from ..halfplane.kernels import HalfPlane
from ..halfplane.zone_search import CONDITIONS_PART
from ..model import contact_candidates
from ..model.contact_candidates import ContactCandidates, may_touch
from ..model.contact_like import ContactLike
from ..model.intervals import common, zone_edges
from ..model.methods import Condensed, Panels
from ..model.obstacles import as_obstacle, heights, jumps_of
from ..model.problem import Problem
from ..model.progress import counted
from ..model.refinement import Abandoned, RefinementLevel, Usual, refine
from ..model.types import CornerZones
from .fitted_mesh import FittedMesh, MeshFitter
from .fitted_path import FittedPath
from .forecast import fitted_cost
from .ground import FAR, Within
from .mesh_solution import MeshSolution, of_block
from .meshes import RATIO, Ground

# (order, levels of elements at the edges). Orders from 5 on are odd: an even one has nearly the error of the
# odd one before it, and their difference would not see it
LEVELS = ((4, 3), (5, 4), *((order, (order + 1) // 2) for order in range(7, 14, 2)))
# a logarithm, or at an end 1/sqrt(r), between two nodes: sqrt(RATIO) a level in L2; levels of equal depth
# would share that error and not see it
LEVELS_AT_CORNERS = tuple((order, order) for order in range(4, 13))


@dataclass(frozen=True)
class MeshLevel(RefinementLevel[MeshSolution]):
    """A level with its FittedMesh, on which other loads are solved."""

    mesh: Any = None


class FittedSolver(MeshFitter):
    """States of a Block on fitted meshes; `candidates` and `obstacle` are those of one load."""

    usual_rtol = 1e-3

    def __init__(
        self, contact: ContactLike, options: Any, candidates: ContactCandidates | None = None
    ) -> None:
        self.candidates = candidates
        super().__init__(contact, options)
        if candidates is not None:
            self.obstacle = contact_candidates.with_detected_kinks(self.obstacle, candidates)

    @property
    def fixed(self) -> bool:
        """Whether the order is given."""
        return self.options.order is not None

    def solve(
        self, load: float | None, approach: float | None, rtol: float | None, initial: Any = None
    ) -> MeshSolution:
        words = "chooses the order: not together with Fitted(order=...)"
        require(not self.fixed or rtol is None, "rtol", rtol, words)
        wanted: Any = self.goal(rtol)
        if load is not None:
            return self._sampled(load)._fitted(load, wanted, initial).result
        level: Any = approach
        load = self.first_load(level)
        for number in range(60):
            solver = self._sampled(load)
            fitted = solver._fitted(load, wanted, initial)
            part = fitted.mesh.solved(approach=level)
            carried = part.load / self.share(1.0)
            solution = solver._solution(fitted.mesh, part, carried, fitted.result.iterations)
            # with the edges of a neighbour the pressure errs by a hundredth of what is asked for; those
            # of a low order may go to and fro
            if abs(carried - load) <= wanted / 100 * load or (self.fixed and number == 8):
                return solution
            load = carried
            initial = solution
        raise NotConverged(f"no load was found for the approach {approach:g}", reached=part.approach)

    def predicted(self, load: float | None, approach: float | None, rtol: float | None) -> cost.Cost:
        if load is None:
            level: Any = approach
            load = self.first_load(level)
        return fitted_cost(self._sampled(load), load, cast(float, rtol))

    def path(self, last: float, rtol: float | None) -> FittedPath:
        return FittedPath(self.contact, last, rtol)

    def _solution(self, mesh: FittedMesh, part: MeshSolution, load: float, iterations: int) -> MeshSolution:
        """Returns the MeshSolution of what was solved on a mesh."""
        return of_block(
            self,
            part,
            load,
            mesh.zones,
            estimate=mesh.estimate,
            error_estimate=mesh.estimate.total,
            iterations=iterations,
        )

    def _sampled(self, load: float) -> "FittedSolver":
        """Returns the solver with the candidates of a load."""
        obstacle = Within(self.obstacle, self.domain)
        problem = Problem(self.solid, self.law, as_obstacle(obstacle), self.symmetric, blocks=self.blocks)
        candidates = obstacle.without_edges_of_body(contact_candidates.find_candidates(problem, load))
        if candidates.height_jumps:
            place = candidates.height_jumps[0]
            raise NotConverged(
                f"the height of the obstacle jumps at x = {place:g}, where pressures have no bound"
            )
        return FittedSolver(self.contact, self.options, candidates)

    def _fitted(self, load: float, rtol: float, initial: Any) -> MeshLevel:
        """Returns the MeshLevel whose zones hold, from the zones of a neighbour on, for an rtol that is
        `Usual` the best one; raises NotConverged with `rtol_reached`, the smallest estimate, if one is known.
        """
        alike = isinstance(initial, MeshSolution) and len(initial.zones or ()) == len(self.law.corners)
        if alike and not self.fixed:  # whose state is the same from wherever
            with suppress(NotConverged):  # too far
                return self._refined(load, rtol, initial.zones, self.options.even, rtol)
        zones = self.inside(load, self.first_zones(load, rtol))
        failures = []
        # low orders beside the edges lock where beta is close to 2, most with nu close to 1/2
        for even in sorted({self.options.even, True}):
            try:
                return self._refined(load, rtol, zones, even, rtol)
            except NotConverged as failure:
                failures.append(failure.with_traceback(None))  # which holds meshes
                cannot_reach = failure.rtol_reached and self.left(LEVELS_AT_CORNERS[-1][1]) > 10 * rtol
                if cannot_reach or failure.__cause__:  # no orders help, or a mesh was too large
                    break
        raise min(failures, key=lambda failure: failure.rtol_reached or math.inf)

    def first_zones(self, load: float, rtol: float = usual_rtol) -> CornerZones:
        """Returns the zones of a half-plane."""
        if self.candidates.simple:
            with suppress(BadArgument, NotConverged):  # it may touch beyond the ends of a body
                contact: Any = self.contact.with_(body=HalfPlane(self.solid), method=Panels())
                # edges that move on need no more, and panels that miss it would look for what is in reach
                return contact.solver.solution_at(load, max(0.1 * rtol, 1e-8)).all_zones
        *_, zones = first_zones(self.problem, load)
        return zones

    def left(self, depth: int) -> float:
        """Returns what levels leave at ends and peaks in the contact, about: 0.4 to 1.8 of that were seen."""
        candidates = self.candidates
        half_width = candidates.half_width
        sizes = [(x, jump * half_width / candidates.rise / 2) for x, jump in jumps_of(candidates)]
        sizes += [(end, 1.0) for end in candidates.ends]
        within = may_touch(candidates, [x for x, _ in sizes])
        largest = max((size for (_, size), is_low in zip(sizes, within) if is_low), default=0.0)
        return largest * RATIO ** (depth / 2)

    def inside(self, load: float, zones: CornerZones) -> CornerZones:
        """Returns zones as far as they are looked for; raises BadArgument for none."""
        window = [(-self.furthest, self.furthest)]
        covered = {corner: common(intervals, window) for corner, intervals in zones.items()}
        if not any(covered.values()):
            raise self.unsettled(load, zones, 0)
        return covered

    def levels(self, rtol: float, even: bool) -> Sequence[tuple[int, int]]:
        """Returns refinement levels, ((order, levels of elements), ...), from the one before the first that
        may reach rtol; or that of the fixed order.
        """
        sharp = self.obstacle.kinks or self.obstacle.ends
        levels = LEVELS_AT_CORNERS if sharp else LEVELS
        levels = levels[even:]  # order 4 locks as low orders do
        order = self.options.order
        if order is not None:
            depths = [depth for top, depth in levels if top <= order]
            return ((order, max(depths, default=levels[0][1])),)
        first = sum(top < -2 * math.log10(rtol) - 0.3 for top, _ in levels[1:])
        return levels[min(first, len(levels) - 2) :]

    def _refined(self, load: float, rtol: float, zones: CornerZones, even: bool, aim: float) -> MeshLevel:
        """Returns as `_fitted`, from trial zones: the levels from those of an rtol `aim` on."""
        # so that truncation is at most a fifth of rtol; levels leave more at ends and peaks. The same for all
        # small rtol: with another one netgen makes another mesh, which may miss an rtol that was advised
        self.far = FAR if self.left(0) > 0 or rtol >= 10 / FAR**2 else 100 * FAR

        def refusal(best: MeshLevel, last: MeshLevel, failure: NotConverged | None) -> NotConverged:
            reason = f" ({failure})" if failure else ""
            besides = "" if failure else "fix the discretisation, Fitted(order=...)"
            return out_of_reach(rtol, best.error, reason, besides, len(made), load=load, margin=1.4)

        made: list[int] = []
        levels: Any = self._mesh_levels(load, rtol, zones, even, aim, made)
        level: Any = refine(levels, rtol, cast(Any, refusal))
        return level

    def _mesh_levels(
        self, load: float, rtol: float, zones: CornerZones, even: bool, aim: float, made: list[int]
    ) -> Iterator[MeshLevel]:
        """Yields the MeshLevels with an error estimate, or that of the order that is given, and adds the
        orders of all meshes to those `made`.
        """
        coarse = None
        estimated = False
        for level in self.levels(aim, even):
            try:
                mesh, zones = self._settled(load, rtol, zones, (*level, even), coarse, made)
            except NotConverged:  # this level's mesh, and not the estimate of the one before
                # no level is smaller, or memory is short
                if estimated or aim >= 0.01 or self.fixed or self.candidates.simple:
                    raise
                # the last two levels are those of all smaller ones
                yield from self._mesh_levels(load, rtol, zones, even, max(10 * aim, 1e-5), made)
                return
            if mesh is None:
                if self._leaves(zones):
                    break
                continue
            error: Any = math.inf if coarse is None else mesh.estimate.total
            if self.fixed or error <= rtol or (error < math.inf and not self._leaves(zones)):
                estimated = True
                solution = self._solution(mesh, mesh.part, load, len(made))
                mesh.coarse = None  # whose factors take memory
                seconds = cost.predict("fitted", 2 * mesh.part.unknowns).seconds
                answers = self.fixed or error <= rtol or isinstance(rtol, Usual)
                kept_mesh = mesh if answers else None  # which takes memory
                yield MeshLevel(solution, error, seconds, suffices=self.fixed, mesh=kept_mesh)
                kept_mesh = None
            coarse = mesh.part
            mesh = None
        if not estimated or self._leaves(zones):
            raise Abandoned(self.unsettled(load, zones, len(made)))

    def _leaves(self, zones: CornerZones) -> bool:
        """Returns whether zones reach beyond the part of the surface on which they are looked for."""
        return max(map(abs, zone_edges(zones)), default=0.0) > self.furthest

    def _settled(
        self,
        load: float,
        rtol: float,
        zones: CornerZones,
        level: tuple[int, int, bool],
        coarse: MeshSolution | None,
        made: list[int],
    ) -> tuple[FittedMesh | None, CornerZones]:
        """Returns the FittedMesh of a level whose zones hold, or None, and the next zones, and adds the
        orders of its meshes to those `made`. Zones are amended until they hold, and their edges moved until
        that adds little to the estimate, or no longer halves what it adds; those of a fixed order to
        rounding.
        """
        last = math.inf
        tolerance = rtol if self.fixed else CONDITIONS_PART * rtol
        located = 0.0 if self.fixed else 5 * rtol
        for passes in range(1, 7):
            counted()
            made.append(level[0])
            mesh: Any = None  # before the next, which takes as much memory
            mesh = FittedMesh(self, load, zones, *level, coarse)
            total: Any = mesh.estimate.total
            edges = mesh.estimate.edges
            holds = self.fixed or (coarse is not None and total <= rtol)
            amended = mesh.other_zones(tolerance, everywhere=holds)
            if amended is not None:
                zones = amended
                last = math.inf
                continue
            enough = edges <= located if coarse is None else not total - edges <= rtol < total
            # a first mesh reads exact edges less accurately
            if passes > 1 or coarse is not None or edges > located / 10:
                zones = mesh.moved
            if enough or edges > last / 2:
                break
            last = edges
        return mesh if amended is None else None, zones

    def unsettled(self, load: float, zones: CornerZones, passes: int) -> NotConverged | BadArgument:
        """Returns the error of zones that leave the surface, or do not settle."""
        if self._leaves(zones):
            if not np.ptp(heights(self.obstacle, np.linspace(-1, 1, 9) * self.domain)) > 0:
                return BadArgument("obstacle", self.contact.obstacle, f"does not rise at all: {BOUNDED}")
            left, *_, right = zone_edges(zones)
            words = (
                f"must be larger: at load {load:g} the contact, from {left:.3g} to {right:.3g}, reaches the "
                f"end of the surface, on which it is looked for up to |x1| = {self.furthest:g}; or move the "
                "obstacle towards x1 = 0"
            )
            return BadArgument("size", self.domain, words)
        return NotConverged(
            f"zones still changing after {passes} meshes at load {load:g}: is it next to a change of "
            "topology, or beta close to 2? Take another load, or the half-plane",
            iterations=passes,
        )

    def evenly(self, load: float, count: int) -> ContactLike:
        """Returns the Contact of a Body with `count` even elements over half of the reach of a load."""
        solver = self._sampled(load)
        ground, _ = solver.surface(solver.first_zones(load))
        left, right = ground.reach
        length = max(abs(left), abs(right)) / count
        grading_points = set(solver.features(ground))
        if self.symmetric:
            left = -right
            grading_points |= {0.0, *(-x for x in grading_points)}
        block = Ground(ground.far, (left, right), half=False)
        body = solver.meshed(block, sorted(grading_points), [(left, right, length)], 0, 4, even=True)
        return self.contact.with_(body=body, method=Condensed())
