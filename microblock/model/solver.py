"""The contract between `Contact` and every solver."""

from __future__ import annotations

from copy import copy
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..cost import Cost
from ..errors import BadArgument, NotConverged, require
from .bodies import offered_by
from .contact_like import ContactLike
from .deformable import body_of
from .events import LoadPath
from .law import is_even, require_shifts
from .obstacles import as_obstacle, check_lowest, heights, scales
from .refinement import Usual
from .solution import Solution
from .types import Array

# of load, approach and residual: what rounding may leave of them, beside the stiffest of penalties
SOLVED = 1e-6
ACCURACIES = "pressure", "load", "depth", "stiffness"  # what rtol and error estimate may be of

if TYPE_CHECKING:
    from .history import History


class Solver:
    """Base of solvers, made of a `Contact` and the method that the user has named, its `options`.

    It defines `solve`; it may define `path` for events, `history` for friction and `sensitivity`.

    Attributes
    ----------
    contact, body, solid, obstacle, law, blocks
        Of the problem.
    takes_bulk_stress : bool
        Whether it follows histories with one.
    has_approach : bool
        Whether the approach means something.
    has_fitted_zones : bool
        Whether the edges of zones are unknowns (`halfplane.zone_path`).
    usual_rtol, usual_history_rtol : float or None
        Relative error of states and of histories where the user names none.
    most_corners : int or None
        Corners that a law may have.
    counter_bodies : tuple of classes
        Second bodies that it knows.
    counter : object or None
        Second body on a mesh, condensed.
    in_space : "cells", "nodes" or None
        What its states have in three dimensions.
    time_factor : float
        By how much longer than the usual method it may seem to take: states of that know more.
    accuracies : tuple of str
        What its error estimate can be of: ACCURACIES.
    accuracy : str
        What the estimates and rtol of this one are of; see `estimating`.
    verifies : bool
        Whether `require_solved` looks at the residual; else the error estimate speaks of it.
    """

    has_approach = True
    takes_bulk_stress = False
    has_fitted_zones = False
    usual_rtol: float | None = None
    usual_history_rtol: float | None = None
    most_corners: int | None = 2
    counter_bodies: tuple[type, ...] = ()
    counter: Any = None
    in_space: str | None = None
    accuracies: tuple[str, ...] = ("pressure",)
    accuracy = "pressure"
    verifies = False
    time_factor = 2.0

    def __init__(self, contact: ContactLike, options: Any) -> None:
        self.contact = contact
        self.options = options
        self.body = contact.body
        self.obstacle = as_obstacle(contact.obstacle)
        self.law = contact.law
        self.solid = self.body.solid
        self.blocks = contact.blocks
        self._require_counter_body()
        if self.in_space is None and (self.has_fitted_zones or body_of(self.obstacle) is not None):
            require_shifts(self.law, self.solid.ell)
        self._require_corners()
        self.set_up()

    def set_up(self) -> None:
        """Checks and keeps what a method asks for besides."""

    def _require_corners(self) -> None:
        """Raises BadArgument for a law with more corners than the method takes."""
        count = len(self.law.corners)
        most = self.most_corners
        clamps = self.law.clamps_rotation
        words = (
            f"has {count} corners{' and constrains psi' * clamps}: {type(self.options).__name__}() takes up "
            f"to {most}, or one where psi is constrained; Condensed() and GivenCompliance() take any number"
        )
        require(most is None or count <= (1 if clamps else most), "law", self.law, words)

    def _require_counter_body(self) -> None:
        """Raises BadArgument for an obstacle whose body this method does not know, or of another period."""
        counter = body_of(self.obstacle)
        if counter is None:
            return
        allowed = " or ".join(kind.__name__ for kind in self.counter_bodies)
        takes = f"takes a {allowed} as second body alone" if allowed else "takes rigid obstacles alone"
        words = f"deforms, and {type(self.options).__name__}() on a {type(self.body).__name__} {takes}"
        require(isinstance(counter, self.counter_bodies), "obstacle", self.obstacle, words)
        first, second = (offered_by(body).period for body in (self.body, counter))
        require(second == first, "period", second, f"of the second body must be that of the first, {first}")

    def __getstate__(self) -> dict[str, Any]:
        return {
            name: value
            for name, value in vars(self).items()
            if not isinstance(getattr(type(self), name, None), cached_property)
        }

    @property
    def symmetric(self) -> bool:
        return is_even(self.law) and bool(self.obstacle.even)

    def require_lowest(self) -> None:
        """Raises BadArgument for an obstacle that falls without bounds, or is no number somewhere."""
        check_lowest(self.obstacle)
        if self.solid.has_length:
            heights(self.obstacle, scales(self.solid.ell))

    def estimating(self, accuracy: str) -> Solver:
        """Returns the solver whose estimates and rtol are of another quantity; raises BadArgument where they
        are not.
        """
        words = (
            f"is estimated by Cells() on a HalfSpace alone; {type(self.options).__name__}() on a "
            f"{type(self.body).__name__} estimates the error of pressure and micromoment"
        )
        require(accuracy in self.accuracies, "accuracy", accuracy, words)
        if accuracy == self.accuracy:
            return self
        solver = copy(self)
        solver.accuracy = accuracy
        return solver

    def goal(self, rtol: float | None) -> float | None:
        """Returns the relative error to aim at: rtol, or the `Usual` one of the method if none is given."""
        return Usual(self.usual_rtol) if rtol is None and self.usual_rtol else rtol

    def history_goal(self, rtol: float | None) -> float | None:
        """Returns the relative error that histories aim at, as `goal`."""
        return Usual(self.usual_history_rtol) if rtol is None and self.usual_history_rtol else rtol

    def solve(
        self, load: float | None, approach: float | None, rtol: float | None, initial: Solution | None = None
    ) -> Solution:
        """Returns the Solution at a load (force per thickness) or an approach (length), the other being None;
        `initial` is a solution of a similar problem. Raises BadArgument if the method does not take an
        argument, NotConverged if the accuracy is out of reach; for an rtol that is `Usual` it returns the
        best solution instead.
        """
        raise NotImplementedError

    def predicted(self, load: float | None, approach: float | None, rtol: float | None) -> Cost | None:
        """Returns the Cost that is expected of `solve`, None if the method predicts nothing; raises a
        MicroblockError where it cannot answer.
        """
        return None

    def require_solved(self, state: Any, load: float | None, approach: float | None) -> None:
        """Raises NotConverged unless a state has the load or approach that was asked for, its pressures carry
        its load, and its residual is rounding or below the error estimate.
        """
        carried = np.sum(state.weights * state.pressure * state.normals[:, -1])
        off = {"sum of the pressures": abs(carried - state.load) / state.load}
        if load is not None:
            off["load"] = abs(state.load - load) / load
        if approach is not None:
            off["approach"] = abs(state.approach - approach) / np.abs(state.displacement).max()
        if self.verifies and not self.penalizes and state.residual > (state.error_estimate or 0.0):
            off["residual"] = state.residual
        worst = max(off, key=lambda name: off[name])
        if not off[worst] <= SOLVED:
            raise NotConverged(
                f"at load {state.load:g} the {worst} is off by {off[worst]:.1e} of its size: take a smaller "
                "rho where there is one, less stretched elements, or another method",
                iterations=state.iterations,
            )

    def sensitivity(self, solution: Any, low: ContactLike, high: ContactLike) -> dict[str, float]:
        """Returns changes of readings of a solution of this method at its load from one problem to another
        next to it, whose solids differ by one modulus, on the contact set of the solution: {"approach",
        "half_width" or "contact_area": change (length, area)}, empty where the method has none.
        """
        return {}

    @property
    def penalizes(self) -> bool:
        """Whether gaps of closed corners are those of a penalty."""
        return False

    def path(self, last: float, rtol: float | None) -> LoadPath:
        """Returns the LoadPath up to a load; raises BadArgument without events."""
        raise BadArgument(
            "method",
            type(self.options).__name__,
            "cannot follow events; Panels(), Cells(), Condensed(), in the plane Fitted() and in space "
            "Newton() can. Solve the loads one by one",
        )

    def follows(self, pairs: Array) -> bool:
        """Returns whether the method follows a history, array (n, 2), in space and with a bulk stress, which
        solvers get that take it, (n, 3).
        """
        return True

    def history(self, pairs: Array, coupled: bool, rtol: float | None) -> History:
        """Returns the History through pairs (P, Q), array (n, 2); raises BadArgument if it cannot."""
        raise BadArgument(
            "method",
            type(self.options).__name__,
            f"cannot follow friction on a {type(self.body).__name__}: take a HalfSpace, a HalfPlane without "
            "a period, a Body on a mesh, in space by Condensed(), or Uniform(h=...) on a Block",
        )
