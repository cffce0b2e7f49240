"""What a method computes, and how it fills a State."""

from __future__ import annotations

import math
from copy import copy
from dataclasses import astuple
from functools import cached_property
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import ArrayLike

from ..errors import BadArgument, Named, plain
from . import law as laws
from .contact_like import ContactLike
from .deformable import body_of
from .fields import FieldsBelow, grid_below
from .interpolant import Response, read_only
from .intervals import along_surface, contact_zones, over_the_end
from .material import Elastic
from .obstacles import as_obstacle, initial_gap, returned
from .sharp import of_map, of_samples
from .state import State
from .surface import Surface
from .types import Array, Flags, Integers, Interval, Zones


class ErrorParts:
    """Base of parts of the relative L2 error; `total` is their sum."""

    @property
    def total(self) -> float | None:
        """The sum; None where a part is unknown."""
        parts = astuple(cast(Any, self))
        return None if None in parts else sum(parts)


class Solution:
    """Base of what methods compute, an `Interpolant` whose ``state()`` fills a State.

    A method gives `solver`, `load`, `approach`, `weights`, `pressures`, `psi`, `micromoment`, `displacement`,
    `energy`, `residual`, `iterations` and `unknowns`, and ``pressure(corner, places)``.

    Attributes
    ----------
    estimate : ErrorParts or None
        Parts of the error estimate.
    notes : tuple of str
        Sentences on the computation, such as a fallback that was taken.
    data_exhausted : bool
        Whether the notes say that the data mean no more, and no rtol helps.
    fields_on_mesh : bool
        Whether `fields` are those of a `body` on a mesh, NGSolve functions.
    period : float or None
        Length after which the surface repeats.
    method : str
        Name of the method, without another word that of its class in small letters.
    """

    estimate: ErrorParts | None = None
    notes: tuple[str, ...] = ()
    data_exhausted: bool = False
    fields_on_mesh: bool = False
    period: float | None = None
    if TYPE_CHECKING:  # read-only: methods have properties or fields of these names

        @property
        def fields(self) -> FieldsBelow | None:
            """Fields below the surface."""

        @property
        def work(self) -> float | None:
            """Work of the loads, of a history."""

        @property
        def stiffness(self) -> float | None:
            """Derivative of the load by the approach."""

        def __getattr__(self, name: str) -> Any:
            """What a method gives."""

    else:
        fields = None
        work = None
        stiffness = None

    @property
    def method(self) -> str:
        return type(self.solver.options).__name__.lower()

    def sensitivity(self, low: ContactLike, high: ContactLike) -> dict[str, float]:
        """Returns changes of readings from one problem to another next to it, as `Solver.sensitivity`."""
        changes: dict[str, float] = self.solver.sensitivity(self, low, high)
        return changes

    @property
    def error_estimate(self) -> float | None:
        return None if self.estimate is None else self.estimate.total

    def changed(self, **fields: Any) -> Any:
        """Returns a copy with other fields, of which nothing that was computed before depends."""
        solution = copy(self)
        vars(solution).update(fields)
        return solution

    def state(self) -> State:
        """Returns the State at the points of the solution."""
        raise NotImplementedError

    def with_friction(self) -> dict[str, Any]:
        """Returns the fields of a State that friction adds: `shear`, `shear_traction`, `dissipation`, and if
        they are known `tangential_approach`, in the plane `zone_errors`, in space `stick`.
        """
        return {}

    def _of_problem(self) -> dict[str, Any]:
        """Returns the fields of a State that say what was solved, and how."""
        solver = self.solver
        return {
            "solution": self,
            "problem": solver.contact,
            "solid": solver.contact.solid,
            "obstacle": solver.contact.obstacle,
            "law": solver.contact.law,
            "method": self.method,
            "load": plain(self.load),
            "approach": float(self.approach) if solver.has_approach else None,
            "error_estimate": plain(self.error_estimate),
            "accuracy": solver.accuracy,
            "error_parts": self.estimate,
            "residual": plain(self.residual),
            "iterations": plain(self.iterations),
            "unknowns": plain(self.unknowns),
            "notes": tuple(self.notes),
        }

    def remarks(self) -> list[str]:
        """Returns sentences on what this method does not resolve."""
        return []

    def fields_below(self, box: tuple[Interval, float], x2: float | None = None) -> tuple[Any, Integers]:
        """Returns what is drawn of `fields`, as of `Interpolant`."""
        across, up, triangles = grid_below(box)
        fields: Any = self.fields
        return fields(across, up) if x2 is None else fields(across, x2, up), triangles

    def reaction_on(self, boundary: str) -> tuple[Array, Any]:
        """Returns force and moment of the supports on a boundary of a mesh."""
        raise BadArgument("boundary", boundary, "belongs to a body on a mesh")


class PlaneSolution(Solution):
    """Base of solutions in the plane, with pressures an array (corners, n).

    A method gives besides `problem`, `x`, `zones_by_name`, ``covers(x)`` and ``interpolated(values, x)``, or
    ``gap(corner, x)`` instead of these two.

    Attributes
    ----------
    has_edges : bool
        Whether the contact ends somewhere.
    interrupted : boolean array (n - 1,) or None
        As of `State`, as all that follows.
    opposite : array (corners, n) or None
        Displacement of a second body under the corners (length).
    """

    has_edges: bool = True
    interrupted: Flags | None = None
    opposite: Any = None

    if TYPE_CHECKING:

        @property
        def slip(self) -> Array | None:
            """Slip since the first contact, array (n,)."""

    else:
        slip = None

    @property
    def points(self) -> Array:
        """Points of the surface, array (n, 2)."""
        return laws.horizontal_surface(self.x)[0]

    @property
    def normals(self) -> Array:
        """Outward normals there, array (n, 2)."""
        return laws.horizontal_surface(self.x)[1]

    def state(self) -> State:
        pressures = np.asarray(self.pressures)
        zones = {name: over_the_end(pairs, self.period) for name, pairs in self.zones_by_name.items()}
        contact = zones["contact"]
        return State(
            **self._of_problem(),
            x=self.x,
            points=self.points,
            normals=self.normals,
            weights=self.weights,
            interrupted=self.interrupted,
            pressure=pressures.sum(axis=0),
            pressures=Named(zip(self.problem.law.corners, map(read_only, pressures)), "corner"),
            closed=np.sum(pressures > 0, axis=0),
            zones=Named(zones, "zone"),
            half_width=float(np.ptp(contact or 0)) / 2,
            contact_area=sum(right - left for left, right in contact),
            **{name: plain(value) for name, value in self.with_friction().items()},
        )

    def response(self) -> Response:
        """Returns the response of the bodies at `x`."""
        return PlaneResponse(self)

    def warnings(self, state: State) -> list[str]:
        """Returns sentences on where the model leaves its range, the data mean less, or the method does."""
        return [*_beyond_small_strain(state, self), *of_samples(self), *self.remarks()]

    def surface(self, window: Interval | None = None) -> Surface:
        """Returns the Surface at `x`; a window (left, right) is for methods that know what lies between."""
        fields = self.pressures, self.micromoment, self.psi, self.displacement
        return self.surface_at(self.points, self.normals, *fields)

    def surface_at(
        self,
        points: Array,
        normals: Array,
        pressures: Array,
        micromoment: Array,
        psi: Array,
        displacement: Array,
    ) -> Surface:
        """Returns the Surface of fields at points."""
        x = points[:, 0]
        lifted = self.counter_along(points, normals) - self.approach * normals[:, 1]
        return Surface(
            points,
            normals,
            pressures,
            self.corner_gaps(points, normals, displacement, psi),
            micromoment,
            psi,
            self.problem.blocks.rotation(x) + psi,
            displacement,
            initial_gap(self.problem.obstacle, points, normals) + lifted,
            self.problem.law.corners,
            self.problem.ell,
            self.interrupted,
        )

    def corner_gaps(self, points: Array, normals: Array, displacement: Array, psi: Array) -> Array:
        """Returns the gaps (22) of all corners at points, array (corners, n)."""
        geometry = self.problem.blocks.under(self.problem.obstacle, points, normals)
        return geometry.gaps(displacement, psi, self.approach, self.counter_along)

    def gap(self, corner: int, x: Array) -> Array:
        """Returns the gap of a corner (number) at x, array (n,), with the exact height, between points that
        are `interpolated`; raises BadArgument of places that the solution does not reach.
        """
        interruptions = (
            "" if self.interrupted is None or not self.interrupted.any() else " without its interruptions"
        )
        if not np.all(self.covers(x)):
            words = f"must lie on the contact boundary, from {self.x[0]} to {self.x[-1]}{interruptions}"
            raise BadArgument("x", x, words)
        x2, n1, n2, displacement, psi = (
            self.interpolated(values, x)
            for values in (self.points[:, 1], *self.normals.T, self.displacement, self.psi)
        )
        points = np.column_stack((x, x2))
        normals = np.column_stack((n1, n2)) / np.hypot(n1, n2)[:, None]
        return self.corner_gaps(points, normals, displacement, psi)[corner]

    def counter_displacement(self, x: Array) -> Array:
        """Returns the displacement along x2 of a second body's surface at x, array (n,) (length): between
        those under the corners, `opposite`, of a solution that has them.
        """
        if self.opposite is None:
            return np.zeros(len(x))
        places = np.concatenate([self.x - shift for shift in self.problem.shifts])
        order = np.argsort(places)
        return np.interp(x, places[order], self.opposite.ravel()[order], period=self.period)

    def counter_along(self, points: Array, normals: Array) -> Array:
        """Returns the displacement along unit normals of a second body's surface over points, arrays (n, 2):
        array (n,) (length).
        """
        return self.counter_displacement(points[:, 0]) * normals[:, 1]

    def shear_at(self, x: Array) -> Array:
        """Returns q at x, array (n,), linear between the points, within what friction allows."""
        pressures = sum(self.pressure(corner, x) for corner in range(len(self.pressures)))
        bound = self.problem.law.friction * np.maximum(pressures, 0.0)  # a polynomial may fall below 0
        return np.clip(along_surface(x, self.x, self.shear_traction), -bound, bound)

    def moment_at(self, x: Array) -> Array:
        """Returns M at x, array (n,), linear between the points; 0 beside the contact unless psi is
        prescribed.
        """
        pressed = sum(self.pressure(corner, x) for corner in range(len(self.pressures))) > 0
        return np.where(
            pressed | self.problem.law.clamps_rotation, along_surface(x, self.x, self.micromoment), 0.0
        )


class PlaneResponse:
    """Response at the points of a solution in the plane, each field evaluated when it is first read."""

    def __init__(self, solution: PlaneSolution) -> None:
        self._solution = solution

    @cached_property
    def micromoment(self) -> Array:
        return read_only(self._solution.micromoment)

    @cached_property
    def psi(self) -> Array:
        return read_only(self._solution.psi)

    @cached_property
    def displacement(self) -> Array:
        return read_only(self._solution.displacement)

    @cached_property
    def rotation(self) -> Array:
        return read_only(self._solution.problem.blocks.rotation(self._solution.x) + self.psi)

    @cached_property
    def opposite(self) -> Array | None:
        if body_of(self._solution.solver.obstacle) is None:
            return None
        return read_only(self._solution.counter_displacement(self._solution.x))

    @cached_property
    def slip(self) -> Array | None:
        slip = self._solution.slip
        return None if slip is None else read_only(slip)


class LineSolution(PlaneSolution):
    """Base of solutions along x1 with zones by the number of the corner."""

    @cached_property
    def zones_by_name(self) -> Zones:
        return contact_zones(self.all_zones, self.problem.law.corners)

    @cached_property
    def micromoment(self) -> Array:
        return self._moment(self.x, self.pressures)

    def moment_at(self, x: Array) -> Array:
        return self._moment(x, [self.pressure(corner, x) for corner in range(len(self.pressures))])

    def _moment(self, x: Array, pressures: ArrayLike) -> Array:
        """Returns M of (29) at x, array (n,), or the reaction."""
        if self.problem.law.clamps_rotation:
            return self.reaction(x)
        return self.problem.ell / 2 * np.sum(self.problem.levers(x) * pressures, axis=0)

    @cached_property
    def energy(self) -> float:
        """Elastic energy per thickness, half the work of the corners."""
        depth = np.where(self.pressures != 0, self.approach - self.problem.initial_gaps(self.x), 0.0)
        return float(np.sum((self.pressures * depth) @ self.weights) / 2)


class SpaceSolution(Solution):
    """Base of solutions in space: `pressures` (corners, ...), `micromoment` and `psi` (2, ...), with
    `displacement` and `closed` (...) at n points, and ``between(values, places)`` of values (...)."""

    if TYPE_CHECKING:

        @property
        def slip(self) -> Array | None:
            """Slip since the first contact, array (2, ...)."""

    else:
        slip = None

    def state_at(self, points: Array, normals: Array, weights: Array, **grid: Any) -> State:
        """Returns the State at points with normals, arrays (n, 3), that stand for areas, array (n,), with
        what is known of their grid: `squares`, `shape`, `x1`, `x2`, `width`, `seen_width`, `triangles`.
        """
        pressures = self.pressures.reshape(-1, len(points))
        closed = self.closed.ravel()
        in_the_plane: dict[str, Any] = dict.fromkeys(("x", "zones", "half_width", "interrupted"))
        return State(
            **self._of_problem(),
            **in_the_plane,
            points=points,
            normals=normals,
            weights=weights,
            pressure=pressures.sum(axis=0),
            pressures=Named(zip(self.solver.blocks.names, map(read_only, pressures)), "corner"),
            closed=closed,
            contact_area=float(weights[closed > 0].sum()),
            **self.with_friction(),
            **grid,
        )

    @property
    def touching(self) -> dict[str, Flags]:
        """{zone: which points are closed}."""
        zones = {"contact": self.closed > 0}
        if len(self.pressures) == 1:
            return zones
        return {"full": self.closed == len(self.pressures)} | zones

    def response(self) -> Response:
        """Returns the response of the bodies at the points of the state."""
        return SpaceResponse(self)

    def warnings(self, state: State) -> list[str]:
        """Returns sentences on what the state does not resolve."""
        return [*_far_off(state), *of_map(self.solver.obstacle, state), *self.remarks()]

    def moment_at(self, places: Array) -> Array:
        """Returns M1 and M2 at places, array (n, 2)."""
        return np.column_stack([self.between(moment, places) for moment in self.micromoment])

    def counter_displacement(self, places: Array) -> Array:
        """Returns the displacement along x3 of a second body at places, array (n,)."""
        return np.zeros(len(places))


class SpaceResponse:
    """Response at the points of a solution in space, each field evaluated when it is first read."""

    rotation = None

    def __init__(self, solution: SpaceSolution) -> None:
        self._solution = solution

    @cached_property
    def micromoment(self) -> Array:
        return read_only(self._solution.micromoment.reshape(2, -1).T)

    @cached_property
    def psi(self) -> Array:
        return read_only(self._solution.psi.reshape(2, -1).T)

    @cached_property
    def displacement(self) -> Array:
        return read_only(self._solution.displacement.ravel())

    @cached_property
    def opposite(self) -> Array | None:
        if body_of(self._solution.solver.obstacle) is None:
            return None
        return read_only(self._solution.opposite.ravel())

    @cached_property
    def slip(self) -> Array | None:
        slip = self._solution.slip
        return None if slip is None else read_only(slip.reshape(2, -1).T)


def _far_off(state: State) -> list[str]:
    """Returns a sentence on an error estimate beyond 10 %."""
    error = state.error_estimate or 0.0
    if error <= 0.1 or state.solution.data_exhausted:
        return []
    if error == np.inf:
        return ["no error estimate: the obstacle would touch where no cell is"]
    return [f"the error estimate is {error:.1e}: pressures and edges are rough"]


def _beyond_small_strain(state: State, solution: PlaneSolution) -> list[str]:
    """Returns sentences on the rotations, slopes and sizes of a state of the plane."""
    ell = 0.0 if isinstance(state.solid, Elastic) else state.solid.ell
    angle = math.degrees(np.abs(cast(Array, state.rotation)).max(initial=0.0))
    edges = np.ravel(state.zones["contact"] if solution.has_edges else [])
    width = float(np.ptp(edges)) if len(edges) else math.inf
    sides = 1e-6 * np.array((-1, 1))[:, None] * max(width, 1e-6 * state.solid.ell)
    heights = returned(solution.problem.obstacle, np.ravel(edges + sides)).reshape(2, -1)
    # with a rule of its own the gap says how far surfaces are from parallel, and not the height
    faced = np.isfinite(heights).all(axis=0) & (as_obstacle(solution.problem.obstacle).normal_gap is None)
    slope = np.abs(np.diff(heights[:, faced], axis=0) / np.diff(sides, axis=0)).max(initial=0.0)
    sentences = []
    if angle > 10:  # where the small-angle form misses 1.5 %
        sentences.append(f"blocks rotate by {angle:.0f} degrees: beyond the small-angle form (41)")
    if slope > 0.2:
        sentences.append(f"slope {slope:.2g} at the edge of the contact: beyond small strain")
    sentences += _far_off(state)
    if width < 2 * ell:
        sentences.append("blocks are larger than the half-width of the contact")
    return sentences
