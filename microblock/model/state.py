"""The contact state, and what a method gives for it."""

from __future__ import annotations

import math
from collections.abc import Callable
from copy import copy
from dataclasses import astuple, dataclass, fields
from functools import cached_property
from inspect import getattr_static
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import ArrayLike

from ..errors import Named, require, require_choice, require_floats, require_numbers, require_pair, shown
from . import law as laws
from .deformable import body_of
from .intervals import contact_zones, over_the_end
from .material import Cosserat, Elastic
from .obstacles import gap, returned
from .results import LISTED, PlainData, intervals, line, number, plain_data, saved
from .sharp import of_samples
from .types import (
    Array,
    Axes,
    ContactLike,
    Figure,
    Flags,
    Integers,
    Interval,
    LawLike,
    ObstacleLike,
    Target,
    ZoneErrors,
    Zones,
)

NO_FIELDS = "has no fields below the surface; finite elements and panels without friction have"


@dataclass(frozen=True)
class Surface:
    """A state along the surface, at points in the order of x1; what is not said here is as of `State`.

    Attributes
    ----------
    points : array (n, 2)
        Points of the undeformed surface (lengths).
    pressures, gaps : arrays (corners, n)
        Stresses and lengths; a gap is inf where there is no obstacle over the corner.
    obstacle : array (n,)
        Height of the obstacle over the undeformed surface, along n (length).
    """

    points: Array
    normals: Array
    pressures: Array
    gaps: Array
    micromoment: Array
    psi: Array
    rotation: Array
    displacement: Array
    obstacle: Array
    corners: tuple[str, ...]
    ell: float
    apart: Flags | None = None

    @property
    def x(self) -> Array:
        """Abscissae x1 of the points, array (n,)."""
        return self.points[:, 0]


class ErrorParts:
    """Base of parts of the relative L2 error; `total` is their sum."""

    @property
    def total(self) -> float | None:
        """The sum; None where a part is unknown."""
        parts = astuple(cast(Any, self))
        return None if None in parts else sum(parts)


class Solution:
    """What a method computes, from which a State takes its fields.

    A method gives `solver`, `problem`, `load`, `approach`, `zones_by_name`, `weights`, `psi`, `micromoment`,
    `pressures` (corners, n), `energy`, `residual`, `iterations`, `unknowns`, `displacement`, in the plane
    `x`, and of a corner (number) at x, array (n,), ``pressure(corner, x)`` and ``gap(corner, x)``; with
    friction `shear`, `shear_traction`, `slip`, `dissipation`, `work` and, where they are known,
    `tangential_approach` and `zone_errors`; what it has not itself its `moment` gives, where it has one.

    Attributes
    ----------
    estimate : ErrorParts or None
        Parts of the error estimate.
    notes : tuple of str
        Sentences on the computation, such as a fallback that was taken.
    data_exhausted : bool
        Whether the notes say that the data mean no more, and no rtol helps.
    has_edges : bool
        Whether the contact ends somewhere.
    apart : boolean array (n - 1,) or None
        As of `State`.
    period : float or None
        Length after which the surface repeats.
    method : str
        Name of the method, without another word that of its class in small letters.
    """

    estimate: ErrorParts | None = None
    notes: tuple[str, ...] = ()
    data_exhausted: bool = False
    has_edges: bool = True
    apart: Flags | None = None
    period: float | None = None

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            """What a method gives."""

    @property
    def method(self) -> str:
        return type(self.solver.options).__name__.lower()

    @property
    def error_estimate(self) -> float | None:
        return None if self.estimate is None else self.estimate.total

    @property
    def points(self) -> Array:
        """Points of the surface, array (n, 2)."""
        return laws.level_surface(self.x)[0]

    @property
    def normals(self) -> Array:
        """Outward normals there, array (n, 2)."""
        return laws.level_surface(self.x)[1]

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
        problem, (x, upwards) = self.problem, (points[:, 0], normals[:, 1])
        lifted = (self.counter_displacement(x) - self.approach) * upwards
        return Surface(
            points,
            normals,
            pressures,
            self.corner_gaps(points, normals, displacement, psi),
            micromoment,
            psi,
            problem.blocks.rotation(x) + psi,
            displacement,
            gap(problem.obstacle, points, normals) + lifted,
            problem.law.corners,
            problem.ell,
            self.apart,
        )

    def corner_gaps(self, points: Array, normals: Array, displacement: Array, psi: Array) -> Array:
        """Returns the gaps (22) of all corners at points, array (corners, n)."""
        geometry = self.problem.blocks.under(self.problem.obstacle, points, normals)
        return geometry.gaps(displacement, psi, self.approach, self.counter_displacement)

    def gap(self, corner: int, x: Array) -> Array:
        """Returns the gap of a corner (number) at x, array (n,), with the exact height, between points that
        are `interpolated`; raises BadArgument of places that the solution does not reach.
        """
        whole = "" if self.apart is None or not self.apart.any() else " without its interruptions"
        words = f"must lie on the contact boundary, from {self.x[0]} to {self.x[-1]}{whole}"
        require(np.all(self.reaches(x)), "x", x, words)
        x2, n1, n2, displacement, psi = (
            self.interpolated(values, x)
            for values in (self.points[:, 1], *self.normals.T, self.displacement, self.psi)
        )
        points, normals = np.column_stack((x, x2)), np.column_stack((n1, n2)) / np.hypot(n1, n2)[:, None]
        return self.corner_gaps(points, normals, displacement, psi)[corner]

    def remarks(self) -> list[str]:
        """Returns sentences on what this method does not resolve."""
        return []

    def counter_displacement(self, x: Array) -> Array:
        """Returns the displacement along x2 of a second body's surface at x, array (n,) (length): between
        those under the corners, `opposite`, array (corners, n), of a solution that has them.
        """
        opposite = getattr(self, "opposite", None)
        if opposite is None:
            return np.zeros(len(x))
        places = np.concatenate([self.x - shift for shift in self.problem.shifts])
        order = np.argsort(places)
        return np.interp(x, places[order], opposite.ravel()[order], period=self.period)

    def shear_at(self, x: Array) -> Array:
        """Returns q at x, array (n,), linear between the points, within what friction allows."""
        pressures = sum(self.pressure(corner, x) for corner in range(len(self.pressures)))
        bound = self.problem.law.friction * np.maximum(pressures, 0.0)  # a polynomial may fall below 0
        return np.clip(np.interp(x, self.x, self.shear_traction), -bound, bound)

    def moment_at(self, x: Array) -> Array:
        """Returns M at x, array (n,), linear between the points; 0 beside the contact unless psi is
        prescribed.
        """
        pressed = sum(self.pressure(corner, x) for corner in range(len(self.pressures))) > 0
        return np.where(
            pressed | self.problem.law.clamps_rotation, np.interp(x, self.x, self.micromoment), 0.0
        )


class LineSolution(Solution):
    """Base of solutions along x1 with zones by the number of the corner."""

    def changed(self, **fields: Any) -> Any:
        """Returns a copy with other fields, of which nothing that was computed before depends."""
        found = copy(self)
        vars(found).update(fields)
        return found

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


@dataclass(frozen=True, eq=False)
class State(PlainData):
    """A contact state, of whatever body, law and method.

    Attributes
    ----------
    problem : Contact
        The problem, of a refined mesh the one on that mesh.
    solid, obstacle, law
        Of the problem.
    load : float
        Force per thickness, of a period where there is one.
    approach : float or None
        Approach of the obstacle (length); None where the constant of a half-plane is arbitrary.
    x, weights : arrays (n,)
        Points of the contact surface, ascending, and their lengths: ``weights @ pressure`` is the load (of a
        curved surface with the normals' second component as a factor).
    points, normals : arrays (n, 2)
        The same points (lengths), and outward unit normals.
    apart : boolean array (n - 1,) or None
        Whether the surface is interrupted between a point and the next; None where it nowhere is.
    pressure : array (n,)
        Total pressure (stress).
    micromoment : array (n,)
        Micromoment (29) (stress x length), or the reaction to a prescribed psi; with friction also that of q.
    psi, rotation : arrays (n,)
        Microrotation, and rotation of the blocks (radians): psi0 + psi, or psi where psi0 acts in the levers.
        On a mesh psi is 0 where neither the law nor the solid (`Elastic`, or beta = 0) couples it to u.
    displacement : array (n,)
        -u.n (length; of a half-plane up to a constant).
    pressures : dict of arrays (n,)
        Pressures of the corners: {"A": ..., "B": ...}, or {"C": ...} without corners.
    closed : array (n,) of int
        Number of corners with a pressure.
    zones : dict of lists of (left, right)
        Intervals of x1 where the corner "A" is closed, "B", both ("full") or any ("contact", the only one
        without corners); with friction "contact" consists of "stick" and "slip". On a period one may go on
        beyond the end.
    half_width, contact_area : float
        Half of the distance between the outermost edges of the contact, and its length without gaps.
    error_estimate : float or None
        Relative L2 error of `pressure_at` and of the micromoment over ell, both over the pressure, with
        friction also of q over the friction. Beside edges of the obstacle (on meshes also where its height
        jumps), where pressures are unbounded, squares have the weight min(1, d/b) in the plane and
        min(1, d/b)^2 in space, d the distance to the nearest edge and b the half-width of the face. None
        where the discretisation was prescribed.
    error_parts : ErrorParts or None
        The parts of which it is the sum.
    residual : float
        Largest relative residual of equilibrium, complementarity and feasibility; on panels the violations
        of (26) in the norm of the error.
    iterations, unknowns : int
        Of the method.
    method : str
        "panels", "cells", "fitted", "uniform", "condensed" or "newton"; else the name of
        its class in small letters.
    warnings : list of str
        Where the model leaves its range, the discretisation is coarse, or a fallback was taken.
    energy : float
        Elastic energy per thickness; of a half-plane up to a constant.
    caption : str
        Obstacle, law, load and error estimate.
    shear : float or None
        Force per thickness Q that drags the surface along x1; None without friction, as all that follows.
    shear_traction, slip : arrays (n,)
        q along x1 (stress), and slip since first contact (length), positive along a positive q.
    dissipation, work : float
        Dissipated energy, and work of the loads: the sum of `energy` and `dissipation` (per thickness).
    tangential_approach : float or None
        Tangential displacement of the obstacle (length); None where its constant is arbitrary.
    zone_errors : dict or None
        Errors of the edges of `zones`: {name: [(left, right), ...]} (lengths), None for a name whose number
        of zones differs on the coarser discretisation.
    opposite : array (n,) or None
        Displacement along x2 of a second body's surface (`Deformable`) at `x`.
    solution : Solution
        What the method has computed.

    Notes
    -----
    In three dimensions forces stand for forces per thickness, `zones`, `half_width`, `x` and `rotation` are
    None, and a state has instead:

    points, normals : arrays (n, 3)
        Centres of cells, row after row, or nodes of the contact boundary, and unit normals.
    weights : array (n,)
        Areas: ``weights @ pressure`` is the load (on a part of a symmetric body that of the part).
    micromoment, psi : arrays (n, 2)
        M1 and M2, and microrotations about x1 and x2.
    pressures : dict of arrays (n,)
        Of the corners `--`, `-+`, `+-`, `++` (signs of x1 and x2), or {"C": ...}. Where all four are closed
        they are those of least norm; `pressure` and `micromoment` are unique.
    closed : array (n,) of int
        Number of corners with a force, and all four where no gap is open.
    contact_area : float
        Area on which a corner touches (length^2).
    squares : tuple of Grid, or None
        Of cells: the squares in which they lie, the widest cells first, each with `count` cells a side,
        their `width`, its `side`, `middle` (lengths) and `axes` (x1 and x2 of centres). Cells of a square
        come row after row, one square after the other.
    shape, x1, x2, width
        Of cells in one square: numbers (n1, n2), centres along either axis, and side (length); None of
        several squares. Of nodes `x1` and `x2` are those of `points`, the others None.
    triangles : array (m, 3) of int, or None
        Numbers of nodes, of triangles between them.
    seen_width : float or None
        Diameter (length) of the narrowest summit that is seen in the squares and as far again around them: a
        disc on which the obstacle is lower than as far again around it. Farther away it is a third of the
        distance from a square, on a period as many parts of it.

    Examples
    --------
    >>> solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)
    >>> state = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Microblock()).solve(load=1.0, rtol=1e-4)
    >>> state.method, sorted(state.pressures), round(float(state.weights @ state.pressure), 9)
    ('panels', ['A', 'B'], 1.0)
    >>> problem = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Unilateral(friction=0.3))
    >>> state = problem.history([(1.0, 0.0), (1.0, 0.15)], rtol=0.05).states[-1]
    >>> round(float(state.weights @ state.shear_traction), 9), state.dissipation > 0
    (0.15, True)
    """

    solution: Any
    obstacle: ObstacleLike
    law: LawLike
    solid: Cosserat
    load: float
    residual: float
    iterations: int
    unknowns: int
    method: str
    energy: float
    x: Array
    weights: Array
    points: Array
    normals: Array
    micromoment: Array
    psi: Array
    displacement: Array
    apart: Flags | None
    shape: tuple[int, int] | None
    x1: Array | None
    x2: Array | None
    triangles: Integers | None
    squares: tuple[Any, ...] | None
    width: float | None
    seen_width: float | None
    error_estimate: float | None
    shear: float | None
    dissipation: float | None
    work: float | None
    tangential_approach: float | None
    zone_errors: ZoneErrors | None
    shear_traction: Array | None
    slip: Array | None

    def __init__(self, solution: Any, **given: Any) -> None:
        vars(self).update({name: _to_read(value) for name, value in given.items()}, solution=solution)

    if not TYPE_CHECKING:

        def __getattr__(self, name):
            entry, own = self.__dataclass_fields__.get(name), getattr_static(type(self), name, None)
            if isinstance(own, (property, cached_property)):  # which failed: once more for its own words
                return own.__get__(self)
            if entry is None or "solution" not in vars(self):
                raise AttributeError(f"a State has no {name}")
            of_problem, own = name in ("obstacle", "law", "solid"), self.solution
            holders = (self.problem,) if of_problem else (own, getattr(own, "moment", None))
            known = [one for one in holders if getattr_static(one, name, None) is not None]
            if not known and "None" not in entry.type:
                raise AttributeError(f"{type(self.solution).__name__} has no {name}")
            value = _to_read(getattr(known[0], name)) if known else None
            vars(self)[name] = value.item() if isinstance(value, np.generic) else value
            return vars(self)[name]

    def noting(self, sentence: str) -> State:
        """Returns the state with one more sentence among its `warnings`."""
        return State(**vars(self) | {"warnings": [*self.warnings, sentence]})

    @classmethod
    def names(cls) -> tuple[str, ...]:
        computed = (name for name, own in vars(cls).items() if isinstance(own, cached_property))
        return (*(entry.name for entry in fields(cls)), *computed)

    @property
    def flat(self) -> bool:
        """Whether the state is one of the plane."""
        return "zones" not in vars(self) or self.zones is not None

    @property
    def listed(self) -> tuple[str, ...]:
        """Names of what `to_dict` has."""
        if not self.flat:
            return LISTED["all"] + LISTED["space"]
        return LISTED["all"] + LISTED["plane"] + LISTED["friction"] * (self.shear is not None)

    @cached_property
    def problem(self) -> ContactLike:
        return self.solution.solver.contact

    @cached_property
    def approach(self) -> float | None:
        return float(self.solution.approach) if self.solution.solver.has_level else None

    @cached_property
    def error_parts(self) -> ErrorParts | None:
        return self.solution.estimate

    @cached_property
    def pressures(self) -> dict[str, Array]:
        return Named("corner", zip(self.law.corners, map(_to_read, self.solution.pressures)))

    @cached_property
    def pressure(self) -> Array:
        return _to_read(np.sum(list(self.pressures.values()), axis=0))

    @cached_property
    def closed(self) -> Integers:
        return np.sum([own > 0 for own in self.pressures.values()], axis=0)

    @cached_property
    def zones(self) -> Zones:
        zones, period = self.solution.zones_by_name, self.solution.period
        return Named("zone", {name: over_the_end(pairs, period) for name, pairs in zones.items()})

    @cached_property
    def half_width(self) -> float:
        """Half of the width of the contact at the middles of blocks (length)."""
        return float(np.ptp(self.zones["contact"] or 0)) / 2

    @cached_property
    def contact_area(self) -> float:
        """Length of the contact.

        Examples
        --------
        >>> solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)
        >>> state = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Unilateral()).solve(load=1.0)
        >>> state.contact_area == 2 * state.half_width      # one zone
        True
        """
        return sum(right - left for left, right in self.zones["contact"])

    @cached_property
    def rotation(self) -> Array:
        return self.psi + self.problem.blocks.rotation(self.x)

    @cached_property
    def opposite(self) -> Array | None:
        return None if body_of(self.obstacle) is None else self.solution.counter_displacement(self.x)

    @cached_property
    def warnings(self) -> list[str]:
        known = [*self.solution.remarks(), *self.solution.notes]
        own = (*_beyond_small_strain(self), *of_samples(self)) if self.flat else _far_off(self)
        return [*own, *known]

    def pressure_at(self, x: ArrayLike, corner: str | None = None) -> Array:
        """Returns the pressure at x, of one corner or of all together.

        Parameters
        ----------
        x : float or array (n,), in three dimensions array (n, 2) or (n, 3)
            Abscissae x1, or x1 and x2 (lengths).
        corner : str, optional
            Name of the corner.

        Returns
        -------
        array (n,), or a float for one number
            Stresses; 0 outside the contact. In three dimensions they are linear between points.

        Raises
        ------
        BadArgument
            If x is no such array of finite numbers, or the law has no such corner.

        Examples
        --------
        >>> solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)
        >>> state = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Unilateral()).solve(load=1.0)
        >>> state.pressure_at([0.0, 1.0]).round(2).tolist()
        [2.01, 0.0]
        """
        places = self._places(x)
        numbers = range(len(self.pressures)) if corner is None else [self._number(corner)]
        return self._like(x, sum(self.solution.pressure(number, places) for number in numbers))

    def shear_traction_at(self, x: ArrayLike) -> Array:
        """Returns the shear traction along x1 at x, of a state of a history.

        Parameters
        ----------
        x : float or array (n,)
            Abscissae x1 (lengths).

        Returns
        -------
        array (n,), or a float for one number
            Stresses, at most the friction times the pressure; 0 outside the contact.

        Raises
        ------
        BadArgument
            As `pressure_at`, and without friction.

        Examples
        --------
        >>> solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)
        >>> problem = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Unilateral(friction=0.3))
        >>> state = problem.history([(1.0, 0.0), (1.0, 0.2)], rtol=0.05).states[-1]
        >>> state.shear_traction_at([0.0, 1.0]).round(1).tolist()
        [0.6, 0.0]
        """
        require(self.shear is not None, "law", self.law, "has no friction, and so no shear traction")
        return self._like(x, self.solution.shear_at(self._places(x)))

    def micromoment_at(self, x: ArrayLike) -> Array:
        """Returns the micromoment (29) at x, or the reaction to psi where the law prescribes it.

        Parameters
        ----------
        x : float or array
            As of `pressure_at`, whose errors it raises.

        Returns
        -------
        array (n,), or a float for one number; in three dimensions array (n, 2)
            M, or M1 and M2 (stress x length); of panels and fitted elements that of the pressures at x, else
            linear between points.

        Examples
        --------
        >>> solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)
        >>> state = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Microblock()).solve(load=1.0)
        >>> state.micromoment_at([-0.2, 0.2, 1.0]).round(4).tolist()
        [-0.0712, 0.0712, 0.0]
        """
        places = self._places(x)
        if self.flat:
            return self._like(x, self.solution.moment_at(places))
        return np.column_stack([self.solution.between(one, places) for one in self.solution.micromoment])

    def gap_at(self, corner: str, x: ArrayLike) -> Array:
        """Returns the gap (22) of a corner at x.

        Parameters
        ----------
        corner : str
        x : float or array (n,)
            Abscissae x1 (lengths).

        Returns
        -------
        array (n,), or a float for one number
            Lengths; inf where there is no obstacle over the corner.

        Raises
        ------
        BadArgument
            As `pressure_at`, and in three dimensions.

        Examples
        --------
        >>> solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)
        >>> state = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Unilateral()).solve(load=1.0)
        >>> bool(state.gap_at("C", 1.0) > 0)
        True
        """
        self._require_flat("gap between its points")
        return self._like(x, self.solution.gap(self._number(corner), self._places(x)))

    def counter_displacement(self, x: ArrayLike) -> Array:
        """Returns the displacement along x2 (in three dimensions x3) of the surface of a second body,
        `Deformable`.

        Parameters
        ----------
        x : float or array
            As of `pressure_at`.

        Returns
        -------
        array (n,), or a float for one number
            Lengths, on half-planes up to a constant; 0 for a rigid obstacle, inf beyond the contact boundary
            of a body on a mesh.

        Examples
        --------
        >>> ground = mb.HalfPlane(mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1))
        >>> roller = mb.Deformable(ground, mb.Cylinder(R=10))
        >>> state = mb.Contact(ground, roller, mb.Unilateral()).solve(load=1.0)
        >>> bool(state.counter_displacement(0.0) > state.counter_displacement(1.0))
        True
        """
        return self._like(x, self.solution.counter_displacement(self._places(x)))

    def _require_flat(self, what: str) -> None:
        require(self.flat, "method", self.method, f"has no {what} in three dimensions")

    def _places(self, x: ArrayLike) -> Array:
        """Returns abscissae, array (n,), or places in space, array (n, 2) or (n, 3)."""
        if self.flat:
            return require_numbers(x=x)
        words = "must be an array (k, 2) or (k, 3) of finite numbers"
        places = require_floats(words, points=x)
        good = places.ndim == 2 and places.shape[1] in (2, 3) and np.isfinite(places).all()
        require(good, "points", x, words)
        return places

    def _like(self, x: ArrayLike, found: Any) -> Array:
        """Returns what was found at x in the shape of x, in three dimensions as it is."""
        return np.reshape(found, np.shape(x))[()] if self.flat else found

    def along(self, direction: str) -> dict[str, Array]:
        """Returns a state on cells in three dimensions along a line through the middle of the cells, in the
        squares that it meets.

        Parameters
        ----------
        direction : "x1" or "diagonal"
            With an even number of cells "x1" runs between two rows, of which the mean is taken.

        Returns
        -------
        dict of arrays (n,)
            "x1" (abscissae), "pressure", "m1", "m2", "psi1", "psi2".

        Raises
        ------
        BadArgument
            If the direction is none of these, or the state not one on cells.
        """
        require_choice(("x1", "diagonal"), direction=direction)
        require(self.squares, "direction", direction, "belongs to cells in three dimensions")
        squares: Any = self.squares
        fields = np.array([self.pressure, *self.micromoment.T, *self.psi.T])
        (first, second), cuts = np.mean([square.middle for square in squares], axis=0), []
        for square, values in zip(squares, np.split(fields, len(squares), axis=1)):
            x1 = square.axes[0]
            x2 = second + (x1 - first if direction == "diagonal" else 0 * x1)
            inside = square.beyond(x1, x2) <= 0
            grids = values.reshape(-1, square.count, square.count)
            own = [square.interpolated(one, False, x1[inside], x2[inside]) for one in grids]
            cuts.append([x1[inside], *own])
        along = np.hstack(cuts)
        names = "x1", "pressure", "m1", "m2", "psi1", "psi2"
        return dict(zip(names, along[:, np.argsort(along[0], kind="stable")]))

    def _number(self, corner: str) -> int:
        require_choice(self.pressures, corner=corner)
        return list(self.pressures).index(corner)

    @property
    def fields(self) -> Callable[..., Any]:
        """Fields below the surface: ``fields(x1, x2)`` has psi, stress and couple stress at points, and u
        where it is known; of finite elements also u1, u2, psi and stress as NGSolve functions.

        Raises
        ------
        BadArgument
            If the state is one on cells.

        Examples
        --------
        >>> solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)
        >>> state = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Microblock()).solve(load=1.0)
        >>> state.fields([-0.1, 0.1], -0.2).psi.shape
        (2,)
        """
        return self._offered("fields", "method", self.method, NO_FIELDS)

    def _offered(self, name: str, *refusal: Any) -> Any:
        """Returns what the solutions of some methods have; raises BadArgument of others."""
        require(hasattr(self.solution, name), *refusal)
        return getattr(self.solution, name)

    def reaction(self, boundary: str) -> tuple[Array, float]:
        """Returns what the supports of a body on a boundary exert on it.

        Parameters
        ----------
        boundary : str
            Name or pattern of boundaries of the mesh.

        Returns
        -------
        force : array (2,)
            Force per thickness.
        moment : float
            Moment about the origin, per thickness.

        Raises
        ------
        BadArgument
            If the body is a half-plane.

        Examples
        --------
        >>> solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)
        >>> problem = mb.Contact(mb.Block(solid, 4.0), mb.Cylinder(R=10), mb.Unilateral(), mb.Uniform(h=0.1))
        >>> round(float(problem.solve(load=1.0).reaction(".*").force[1]), 6)
        1.0
        """
        words = "belongs to a body on a mesh"
        return self._offered("reaction_on", "boundary", boundary, words)(boundary)

    def surface(self, window: Interval | None = None) -> Surface:
        """Returns the Surface of a state of the plane on an interval (left, right) of x1, without it around
        the contact.
        """
        self._require_flat("surface along x1")
        return self.solution.surface(None if window is None else require_pair(window=window))

    @cached_property
    def caption(self) -> str:
        error = "no error estimate" if self.error_estimate is None else f"error {self.error_estimate:.1e}"
        return f"{shown(self.obstacle)}, {shown(self.law)}, load {number(self.load)}, {error}"

    def to_dict(self) -> dict[str, Any]:
        """Returns the state as plain data for JSON, in full precision.

        Returns
        -------
        dict
            Attributes by their names: arrays and intervals are lists, NaN and infinity None. "profile" has
            columns "x", "weight", "pressure", "pressure_A", "pressure_B" (None without corners),
            "micromoment", "psi", with friction "shear" and "slip"; of cells in three dimensions the state
            `along` the "axis" x1 and the "diagonal".

        Examples
        --------
        >>> solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)
        >>> state = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Unilateral()).solve(load=1.0)
        >>> data = state.to_dict()
        >>> data["load"], data["approach"], data["profile"]["pressure"] == state.pressure.tolist()
        (1.0, None, True)
        """
        data = {name: plain_data(getattr(self, name)) for name in self.listed}
        if not self.flat:
            cuts = {"axis": "x1", "diagonal": "diagonal"} if self.squares else {}
            return {**data, "profile": {name: plain_data(self.along(cut)) for name, cut in cuts.items()}}
        profile = {"x": data["x"], "weight": data["weights"], "pressure": data["pressure"]}
        profile |= {f"pressure_{name}": data["pressures"].get(name) for name in "AB"}
        profile |= {"micromoment": data["micromoment"], "psi": data["psi"]}
        if "slip" in data:
            profile |= {"shear": data["shear_traction"], "slip": data["slip"]}
        return {**data, "profile": profile}

    def __repr__(self) -> str:
        contact = intervals(self.zones["contact"]) if self.flat else f"area {number(self.contact_area)}"
        words = f"load {number(self.load)}, contact {contact}, error estimate {number(self.error_estimate)}"
        return line("Contact state", words, self.warnings)

    def plot(self, file: Target = None, ax: Axes | None = None) -> Figure:
        """Returns a figure of pressures, micromoment, corner gaps, rotation, zones and blocks over x1; in
        three dimensions of pressure, micromoment and number of closed corners from above.

        Parameters
        ----------
        file : str or Path, optional
            File of the figure (PNG, PDF or SVG, by its ending).
        ax : matplotlib.axes.Axes, optional
            Where to draw pressures and micromoment alone.

        Returns
        -------
        matplotlib.figure.Figure

        Examples
        --------
        >>> solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)
        >>> state = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Microblock()).solve(load=1.0)
        >>> figure = state.plot("state.pdf")
        >>> _ = state.plot(ax=figure.axes[0])
        """
        from ..view import state_figure, surface_figure  # here: not without a picture

        if not self.flat:
            drawing = surface_figure.draw(self, ax)
        elif ax is None:
            drawing = state_figure.draw(self)
        else:
            drawing = state_figure.draw_curves(ax, self)
        return saved(drawing, file, ax, self.warnings, self.caption)

    def plot_blocks(self, file: Target = None, ax: Axes | None = None) -> Figure:
        """Returns a figure of the rotated blocks under the obstacle, as Fig. 3 of the paper; of cells in
        three dimensions in the row along x1 with the largest pressure, where a corner of the picture stands
        for two, half a block before the row and behind it.

        Parameters
        ----------
        file, ax : optional
            As of `plot`.

        Raises
        ------
        BadArgument
            In three dimensions, if the law has no blocks, or the state is one of nodes.
        """
        from ..view.blocks import draw

        return saved(draw(ax, self), file, ax, self.warnings, self.caption)

    def plot_below(self, field: str = "psi", file: Target = None, ax: Axes | None = None) -> Figure:
        """Returns a figure of a field below the contact.

        Parameters
        ----------
        field : str
            "psi", "s22", "s11", "skew" or "shear".
        file, ax : optional
            As of `plot`.

        Raises
        ------
        BadArgument
            If the state is one on cells or in three dimensions, or the field unknown.
        """
        self._require_flat("picture below the surface (to_vtk writes the fields of a mesh)")
        self._offered("fields_below", "method", self.method, NO_FIELDS)
        from ..view.below import draw_below

        caption = f"{self.caption}\ncontact in black"
        return saved(draw_below(self, field, ax), file, ax, self.warnings, caption)


def in_space(solution: Any, points: Array, weights: Array, **given: Any) -> State:
    """Returns a state of three dimensions, at points, array (n, 3), that stand for areas, array (n,)."""
    names, count = solution.solver.blocks.names, len(points)
    given |= dict.fromkeys(("zones", "half_width", "x", "rotation"))
    given |= {"points": points, "normals": np.tile([0.0, 0.0, 1.0], (count, 1)), "weights": weights}
    given |= {name: getattr(solution, name).reshape(2, count).T for name in ("psi", "micromoment")}
    given |= {name: getattr(solution, name).ravel() for name in ("displacement", "closed")}
    pressures = Named("corner", zip(names, map(_to_read, solution.pressures.reshape(-1, count))))
    return State(
        solution, **given, pressures=pressures, contact_area=float(weights[given["closed"] > 0].sum())
    )


def _to_read(value: Any) -> Any:
    """Returns an array as one that cannot be written to: states share values."""
    if isinstance(value, np.ndarray):
        value = value.view()
        value.flags.writeable = False
    return value


def _far_off(state: State) -> list[str]:
    error = state.error_estimate or 0.0
    words = f"the error estimate is {error:.1e}: pressures and edges are rough"
    return [words] * (error > 0.1 and not state.solution.data_exhausted)


def _beyond_small_strain(state: State) -> list[str]:
    """Returns sentences on the rotations, slopes and sizes of a state of the plane."""
    ell = 0.0 if isinstance(state.solid, Elastic) else state.solid.ell
    angle = math.degrees(np.abs(state.rotation).max(initial=0.0))
    edges = np.ravel(state.zones["contact"] if state.solution.has_edges else [])
    width = float(np.ptp(edges)) if len(edges) else math.inf
    sides = 1e-6 * np.array((-1, 1))[:, None] * max(width, 1e-6 * state.solid.ell)
    beside = returned(state.solution.problem.obstacle, np.ravel(edges + sides)).reshape(2, -1)
    known = np.isfinite(beside).all(axis=0)
    slope = np.abs(np.diff(beside[:, known], axis=0) / np.diff(sides, axis=0)).max(initial=0.0)
    return [
        # where the small-angle form misses 1.5 %
        *[f"blocks rotate by {angle:.0f} degrees: beyond the small-angle form (41)"] * (angle > 10),
        *[f"slope {slope:.2g} at the edge of the contact: beyond small strain"] * bool(slope > 0.2),
        *_far_off(state),
        *["blocks are larger than the half-width of the contact"] * (width < 2 * ell),
    ]
