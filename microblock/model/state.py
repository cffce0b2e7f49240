"""The contact state: its data, and what its interpolant answers."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..errors import (
    BadArgument,
    plain,
    require,
    require_choice,
    require_floats,
    require_numbers,
    require_pair,
    shown,
)
from .archive import Absent
from .contact_like import ContactLike
from .interpolant import Interpolant, Response, SurfaceResponse, set_read_only
from .law import Law
from .material import Cosserat
from .peaks import Peak, peak
from .results import LISTED, PlainData, intervals, line, number, plain_data, saved
from .surface import Surface
from .types import Array, Axes, Figure, Flags, Integers, Interval, ObstacleLike, Target, ZoneErrors, Zones
from .views import pictures

EVALUATED = "_response", "energy", "stiffness", "work"  # of a state, when it is first read
MODULI = "E", "nu", "ell", "beta", "curvature"
# relative, of moduli beside a state: cubes and rounding of kernels, 1e-13 of them, over it leave 1e-8
STEP = 3e-4
NO_FIELDS = "has no fields below the surface: its body gives a compliance alone"


@dataclass(frozen=True, eq=False, repr=False)
class State(PlainData):
    """A contact state, of whatever body, law and method.

    Attributes
    ----------
    problem : Contact
        The problem, of a refined mesh the one on that mesh.
    solid, obstacle, law
        Of the problem. Of a body of several solids, or of functions, the solid is that at the contact
        boundary, the stiffest where they differ.
    load : float
        Force per thickness, of a period where there is one.
    approach : float or None
        Approach of the obstacle (length), counted from height 0 of the obstacle on the level of the surface;
        None where the constant of a half-plane is arbitrary.
    x, weights : arrays (n,)
        Points of the contact surface, ascending, and their lengths: ``weights @ pressure`` is the load (of a
        curved surface with the normals' second component as a factor).
    points, normals : arrays (n, 2)
        The same points (lengths), and outward unit normals.
    interrupted : boolean array (n - 1,) or None
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
        friction f also of q/f: the error of q itself may be f times as much. Beside edges of the obstacle (on
        meshes also where its height jumps), where pressures are unbounded, squares have the weight
        min(1, d/b) in the plane and min(1, d/b)^2 in space, d the distance to the nearest edge and b the
        half-width of the face. None where the discretisation was prescribed, inf where the obstacle would
        touch between the cells.
    accuracy : str
        What `error_estimate` is of instead, "load", "depth" or "stiffness", where it is not "pressure".
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
    stiffness : float or None
        Derivative of the load by the approach (force per thickness and length), with the corners in contact:
        those that open or close on the way have no force then. inf in full contact on a period; None without
        an approach, with friction, and by `Newton` and `Uniform`. It takes a linear system when it is read.
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
        Areas: ``weights @ pressure`` is the load (on a part of a symmetric body that of the part; of a tilted
        surface with n3 as a factor).
    micromoment, psi : arrays (n, 2)
        M1 and M2, and microrotations about x1 and x2; of a tilted surface about the sides t1 and t2 of the
        blocks, see `Body`.
    pressures : dict of arrays (n,)
        Of the corners `--`, `-+`, `+-`, `++` (signs of x1 and x2), or {"C": ...}. Where all four are closed
        they are those of least norm; `pressure` and `micromoment` are unique.
    closed : array (n,) of int
        Number of corners with a force, and all four where no gap is open.
    contact_area : float
        Area on which a corner touches (length^2). It counts whole cells, or nodes: it is known to about half
        a cell's width times the length of the contact's edge.
    shear, tangential_approach : arrays (2,)
        With friction the components along x1 and x2 of Q and of the obstacle's motion, on a period less the
        mean of the surface.
    shear_traction, slip : arrays (n, 2)
        q and slip along x1 and x2. Where all slides, slip is the least along Q that no point contradicts.
    stick : boolean array (n,)
        With friction whether a cell or node in contact has less than the largest shear.
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

    solution: Interpolant
    problem: ContactLike
    solid: Cosserat
    obstacle: ObstacleLike
    law: Law
    method: str
    load: float
    approach: float | None
    error_estimate: float | None
    error_parts: Any  # ErrorParts, or None
    residual: float
    iterations: int
    unknowns: int
    notes: tuple[str, ...]

    points: Array
    normals: Array
    weights: Array
    pressure: Array
    pressures: dict[str, Array]
    closed: Integers
    contact_area: float

    # of the plane, None in space
    x: Array
    zones: Zones
    half_width: float
    interrupted: Flags | None

    accuracy: str = "pressure"

    # with friction
    shear: Any = None  # a float, in space an array (2,), as the tangential approach
    shear_traction: Array | None = None
    dissipation: float | None = None
    tangential_approach: Any = None
    zone_errors: ZoneErrors | None = None
    stick: Flags | None = None

    # of cells or nodes in space
    squares: tuple[Any, ...] | None = None
    triangles: Integers | None = None
    shape: tuple[int, int] | None = None
    x1: Array | None = None
    x2: Array | None = None
    width: float | None = None
    seen_width: float | None = None

    def __post_init__(self) -> None:
        set_read_only(self)

    @property
    def centre(self) -> tuple[float, ...]:
        """Centre of pressure: x1, in three dimensions x1 and x2 (length)."""
        forces = self.weights * self.pressure
        return tuple((forces @ self.points[:, :-1] / forces.sum()).tolist())

    def noting(self, sentence: str) -> State:
        """Returns the state with one more sentence among its `warnings`."""
        return changed(self, notes=(*self.notes, sentence))

    @property
    def flat(self) -> bool:
        """Whether the state is one of the plane."""
        return self.zones is not None

    @property
    def _rules(self) -> _InPlane | _InSpace:
        """What differs between the plane and space."""
        return IN_PLANE if self.flat else IN_SPACE

    @property
    def listed(self) -> tuple[str, ...]:
        """Names of what `to_dict` has."""
        return self._rules.listed(self)

    # what the interpolant evaluates when it is first read

    @cached_property
    def _response(self) -> Response:
        return self.solution.response()

    @property
    def micromoment(self) -> Array:
        return self._response.micromoment

    @property
    def psi(self) -> Array:
        return self._response.psi

    @property
    def displacement(self) -> Array:
        return self._response.displacement

    @property
    def opposite(self) -> Array | None:
        return self._response.opposite

    @property
    def slip(self) -> Array | None:
        return self._response.slip

    @property
    def rotation(self) -> Array | None:
        return self._response.rotation

    @cached_property
    def energy(self) -> float:
        return plain(self.solution.energy)

    @cached_property
    def stiffness(self) -> float | None:
        return None if self.approach is None else plain(self.solution.stiffness)

    def sensitivity(self, modulus: str) -> dict[str, float]:
        """Returns the derivatives of readings by a modulus of the solid, at this load and contact set.

        The way of the stiffness: the equations on the corners in contact are differentiated, of which
        operators next to the modulus, a few 1e-4 of it apart, tell the terms. Where a corner closes or a zone
        merges derivatives jump: there they are those of the zones of this state.

        Parameters
        ----------
        modulus : str
            "E", "nu", "ell", "beta" or "curvature".

        Returns
        -------
        dict
            On panels "half_width" and "contact_area", on cells with an approach "approach": units of these
            over those of the modulus.

        Raises
        ------
        BadArgument
            If the modulus is none of these or the solid has none, the solid is one of functions, or the
            method has no such derivatives.

        Examples
        --------
        >>> solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)
        >>> state = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Unilateral()).solve(load=1.0)
        >>> state.sensitivity("E")["half_width"] < 0
        True
        """
        require_choice(MODULI, modulus=modulus)
        require(self.shear is None, "law", self.law, "has friction, whose histories have no sensitivities")
        low, high = neighbours(self.problem, modulus)
        changes: dict[str, float] = self.solution.sensitivity(low, high)
        words = "has no sensitivities of this state: Panels(), and Cells() where there is an approach, have"
        require(changes, "method", self.method, words)
        step = getattr(high.solid, modulus) - getattr(low.solid, modulus)
        return {reading: change / step for reading, change in changes.items()}

    @cached_property
    def work(self) -> float | None:
        return plain(self.solution.work)

    @cached_property
    def warnings(self) -> list[str]:
        return [*self.solution.warnings(self), *self.notes]

    def parts_to_save(self) -> tuple[type, dict[str, Any]]:
        entries = {entry.name: getattr(self, entry.name) for entry in fields(self)}
        names = [entry.name for entry in fields(SurfaceResponse)]
        stored = Stored(
            "what lies between the points of a state",
            SurfaceResponse(**{name: getattr(self._response, name) for name in names}),
            self.energy,
            self.work,
            self.warnings[: len(self.warnings) - len(self.notes)],
            self.solution.surface(None) if self.flat else None,
        )
        return State, entries | {"solution": stored}

    def pressure_at(self, x: ArrayLike, corner: str | None = None) -> Array:
        """Returns the pressure at x, of one corner or of all together.

        Parameters
        ----------
        x : float or array (n,), in three dimensions array (n, 2) or (n, 3)
            Abscissae x1, or x1 and x2 of places seen from above (lengths).
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
        places = self._rules.places(x)
        numbers = range(len(self.pressures)) if corner is None else [self._number(corner)]
        pressures: Any = sum(self.solution.pressure(number, places) for number in numbers)
        return self._rules.shaped(pressures, x)

    def shear_traction_at(self, x: ArrayLike) -> Array:
        """Returns the shear traction along x1 at x, of a state of a history.

        Parameters
        ----------
        x : float or array
            As of `pressure_at`.

        Returns
        -------
        array (n,), or a float for one number; in three dimensions array (n, 2)
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
        return self._rules.shaped(self.solution.shear_at(self._rules.places(x)), x)

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
        return self._rules.shaped(self.solution.moment_at(self._rules.places(x)), x)

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
            As `pressure_at`, and in three dimensions, where ``height - approach + displacement`` is the gap
            of `Unilateral` at `points`.

        Examples
        --------
        >>> solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)
        >>> state = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Unilateral()).solve(load=1.0)
        >>> bool(state.gap_at("C", 1.0) > 0)
        True
        """
        self._require_flat("gap between its points")
        places = self._rules.places(x)
        return self._rules.shaped(self.solution.gap(self._number(corner), places), x)

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
        return self._rules.shaped(self.solution.counter_displacement(self._rules.places(x)), x)

    def _require_flat(self, what: str) -> None:
        """Raises BadArgument in three dimensions."""
        require(self.flat, "method", self.method, f"has no {what} in three dimensions")

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
        first, second = np.mean([square.middle for square in squares], axis=0)
        cuts = []
        for square, values in zip(squares, np.split(fields, len(squares), axis=1)):
            x1 = square.axes[0]
            x2 = second + (x1 - first if direction == "diagonal" else 0 * x1)
            inside = square.distance_outside(x1, x2) <= 0
            grids = values.reshape(-1, square.count, square.count)
            on_line = [square.interpolated(grid, False, x1[inside], x2[inside]) for grid in grids]
            cuts.append([x1[inside], *on_line])
        along = np.hstack(cuts)
        names = "x1", "pressure", "m1", "m2", "psi1", "psi2"
        return dict(zip(names, along[:, np.argsort(along[0], kind="stable")]))

    def _number(self, corner: str) -> int:
        require_choice(self.pressures, corner=corner)
        return list(self.pressures).index(corner)

    @property
    def fields(self) -> Any:
        """Fields below the surface: ``fields(x1, x2)``, in three dimensions ``fields(x1, x2, x3)``, has u,
        psi, stress and couple stress at points, `von_mises`, `max_shear` and `principal`. `second` are those
        of a second body, or None. Of finite elements u1, u2, psi and stress are NGSolve functions.

        Raises
        ------
        BadArgument
            If the body is one of your own, which gives a compliance alone.

        Examples
        --------
        >>> solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)
        >>> state = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Microblock()).solve(load=1.0)
        >>> state.fields([-0.1, 0.1], -0.2).psi.shape
        (2,)
        """
        fields = self.solution.fields
        if fields is None:
            raise BadArgument("method", self.method, NO_FIELDS)
        return fields

    def peak(self, quantity: str) -> Peak:
        """Returns where a quantity is largest, and how large it is.

        Parameters
        ----------
        quantity : str
            "pressure", or below the surface "von_mises", "max_shear" or "tension", the largest principal
            stress.

        Returns
        -------
        Peak
            A tuple of `value` (stress), `place`, (x1, x2), in three dimensions (x1, x2, x3) (lengths), and
            `resolved`: on cells the search ends half a cell below the surface, and False says that finer
            cells may have more, as the place is at most two and a half cells below it, or the pressure is
            convex on both sides, as at a tip. Below rough obstacles it begins at the dozen largest pressures
            and at points between.

        Raises
        ------
        BadArgument
            For another quantity, and where it has no bound, as below the edge of a punch.

        Examples
        --------
        >>> ground = mb.HalfPlane(mb.Elastic(E=100, nu=0.3))
        >>> state = mb.Contact(ground, mb.Cylinder(R=10), mb.Unilateral()).solve(load=1.0, rtol=1e-5)
        >>> largest = state.peak("max_shear")
        >>> a, p = mb.hertz_scales(ground.solid, R=10, P=1.0)
        >>> round(largest.value / p, 4), round(-largest.place[1] / a, 3)      # .3003 p at .786 a
        (0.3003, 0.786)
        """
        return peak(self, quantity)

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
        return self.solution.reaction_on(boundary)

    def surface(self, window: Interval | None = None) -> Surface:
        """Returns the Surface of a state of the plane on an interval (left, right) of x1, without it around
        the contact.
        """
        self._require_flat("surface along x1")
        return self.solution.surface(None if window is None else require_pair(window=window))

    @property
    def _of_accuracy(self) -> str:
        """What the error estimate is of, in words, where it is not of the pressure."""
        return "" if self.accuracy == "pressure" else f" of the {self.accuracy}"

    @cached_property
    def caption(self) -> str:
        error = f"no error estimate{self._of_accuracy}"
        if self.error_estimate is not None:
            error = f"error{self._of_accuracy} {self.error_estimate:.1e}"
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
        return {**data, "profile": self._rules.profile(self, data)}

    def __repr__(self) -> str:
        contact = self._rules.contact(self)
        error = f"error estimate{self._of_accuracy} {number(self.error_estimate)}"
        return line("Contact state", f"load {number(self.load)}, contact {contact}, {error}", self.warnings)

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
        drawing = pictures().draw_state(self, ax)
        return saved(drawing, file, ax, self.warnings, self.caption)

    def plot_blocks(self, file: Target = None, ax: Axes | None = None) -> Figure:
        """Returns a figure of the rotated blocks under the obstacle, as Fig. 3 of the paper; of cells in
        three dimensions in the row along x1 with the largest pressure, where a corner of the picture stands
        for two, half a block before the row and behind it. Rotations and heights are magnified and motions
        along the surface left out, so that sides of blocks may overlap.

        Parameters
        ----------
        file, ax : optional
            As of `plot`.

        Raises
        ------
        BadArgument
            In three dimensions, if the law has no blocks, or the state is one of nodes.
        """
        return saved(pictures().draw_blocks(self, ax), file, ax, self.warnings, self.caption)

    def plot_below(
        self, field: str = "psi", file: Target = None, ax: Axes | None = None, x2: float | None = None
    ) -> Figure:
        """Returns a figure of a field below the contact, in three dimensions in a plane along x1 and x3.

        Parameters
        ----------
        field : str
            "psi", the rotation in the plane of the figure, "s11", "s22", "s33", "skew" and "shear" (of
            stresses in this plane), "max_shear" or "von_mises".
        file, ax : optional
            As of `plot`.
        x2 : float, optional
            In three dimensions the plane, without it that of the centre of pressure (length).

        Raises
        ------
        BadArgument
            If the body is one of your own, the field unknown, or a plane given in two dimensions.
        """
        require(self.solution.fields is not None, "method", self.method, NO_FIELDS)
        place = None if x2 is None else float(require_numbers(x2=x2)[0])
        caption = f"{self.caption}\ncontact in black"
        return saved(pictures().draw_below(self, field, ax, place), file, ax, self.warnings, caption)


def neighbours(problem: ContactLike, modulus: str, step: float = STEP) -> tuple[ContactLike, ContactLike]:
    """Returns the problems with a modulus of the solid a relative step smaller and larger, as
    `Cosserat.scaled`.
    """
    solid = problem.solid
    require(not solid.functions, "solid", solid, "is of functions of the place, whose moduli are no numbers")
    low, high = (solid.scaled(**{modulus: factor}) for factor in (1 - step, 1 + step))
    words = "must be positive: without a coupling no difference of it is small"
    require(low != high, modulus, getattr(solid, modulus), words)
    return problem.with_(solid=low), problem.with_(solid=high)


def changed(state: State, **others: Any) -> State:
    """Returns a state with other fields, of which nothing that was evaluated of the fields, the energy and
    the work depends.
    """
    evaluated = {name: value for name, value in vars(state).items() if name in EVALUATED}
    state = replace(state, **others)
    vars(state).update(evaluated)
    return state


@dataclass(frozen=True, eq=False, repr=False)
class Stored(Absent):
    """Interpolant of a state from a file: it has what was evaluated at the points, and refuses the rest."""

    computed: SurfaceResponse
    energy: float
    work: float | None
    sentences: list[str]
    along: Surface | None

    def response(self) -> SurfaceResponse:
        """Returns the response of the bodies at the points."""
        return self.computed

    def warnings(self, state: State) -> list[str]:
        """Returns the sentences of the state that was saved."""
        return self.sentences

    def surface(self, window: Interval | None) -> Any:
        """Returns the Surface of the state that was saved, whatever the window."""
        return self.along


class _InPlane:
    """Rules of states in the plane."""

    def places(self, x: ArrayLike) -> Array:
        """Returns abscissae as an array (n,)."""
        return require_numbers(x=x)

    def shaped(self, values: Array, x: ArrayLike) -> Array:
        """Returns values at x in the shape of x."""
        return np.reshape(values, np.shape(x))[()]

    def listed(self, state: State) -> tuple[str, ...]:
        """Returns names of what `State.to_dict` has."""
        friction = (*LISTED["friction"], "zone_errors") if state.shear is not None else ()
        return LISTED["all"] + LISTED["plane"] + friction

    def profile(self, state: State, data: dict[str, Any]) -> dict[str, Any]:
        """Returns columns of plain data over x."""
        profile = {"x": data["x"], "weight": data["weights"], "pressure": data["pressure"]}
        profile |= {f"pressure_{name}": data["pressures"].get(name) for name in "AB"}
        profile |= {"micromoment": data["micromoment"], "psi": data["psi"]}
        if "slip" in data:
            profile |= {"shear": data["shear_traction"], "slip": data["slip"]}
        return profile

    def contact(self, state: State) -> str:
        """Returns the contact in words."""
        return intervals(state.zones["contact"])


class _InSpace:
    """Rules of states in space."""

    def places(self, x: ArrayLike) -> Array:
        """Returns places as an array (n, 2) or (n, 3)."""
        words = "must be an array (k, 2) or (k, 3) of finite numbers"
        places = require_floats(words, points=x)
        good = places.ndim == 2 and places.shape[1] in (2, 3) and np.isfinite(places).all()
        require(good, "points", x, words)
        return places

    def shaped(self, values: Array, x: ArrayLike) -> Array:
        """Returns values as they are."""
        return values

    def listed(self, state: State) -> tuple[str, ...]:
        """Returns names of what `State.to_dict` has."""
        friction = (*LISTED["friction"], "stick") if state.shear is not None else ()
        return LISTED["all"] + LISTED["space"] + friction

    def profile(self, state: State, data: dict[str, Any]) -> dict[str, Any]:
        """Returns the state on cells along the axis x1 and the diagonal."""
        cuts = {"axis": "x1", "diagonal": "diagonal"} if state.squares else {}
        return {name: plain_data(state.along(cut)) for name, cut in cuts.items()}

    def contact(self, state: State) -> str:
        """Returns the contact in words."""
        return f"area {number(state.contact_area)}"


IN_PLANE = _InPlane()
IN_SPACE = _InSpace()
