"""Frictional contact along a history of loads."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..errors import require, require_floats
from .contact_like import ContactLike
from .events import Event
from .intervals import common, distance, without
from .results import PlainData, line, saved
from .solution import PlaneSolution
from .state import State
from .types import Array, Axes, Figure, Interval, Target, Zones
from .views import pictures

SLIDING = 1e-9  # relative, by which a pair may be beyond f P: rounding of what a user has multiplied


class PairSolution(PlaneSolution):
    """Base of solutions at a pair of loads, with shear and energies of their `friction_state`: energy and
    work up to a constant where the rigid motion is arbitrary.
    """

    friction_state: Any
    tangential_approach: Any = None  # a float, where it is known

    @property
    def energy(self) -> float:
        return float(self.friction_state.energy)

    @property
    def shear_traction(self) -> Array:
        return self.friction_state.tangential / self.weights

    @property
    def slip(self) -> Array:
        return self.friction_state.slip

    @property
    def work(self) -> float:
        return self.friction_state.work

    def with_friction(self) -> dict[str, Any]:
        return {
            "shear": self.friction_state.shear,
            "shear_traction": self.shear_traction,
            "dissipation": self.friction_state.dissipation,
            "tangential_approach": self.tangential_approach,
        }


def change(finer: PairSolution, coarser: PairSolution, weights: Array, ell: float, friction: float) -> float:
    """Returns the largest relative L2 change of pressure, M/ell and q/f from one solution to a finer one,
    with its weights, array (n,) (lengths).
    """
    fields = [
        (solution.pressures.sum(axis=0), solution.micromoment / ell, solution.shear_traction / friction)
        for solution in (finer, coarser)
    ]
    p, M, q = (fine - np.interp(finer.x, coarser.x, coarse) for fine, coarse in zip(*fields))
    return distance(weights, p, M, fields[0][0], q)


def with_stick(zones: Zones, stick: Sequence[Interval]) -> Zones:
    """Returns zones with "stick", as far as it is in contact, and "slip", the rest of the contact."""
    sticking = common(stick, zones["contact"])
    slip = zones["contact"]
    for pair in sticking:
        slip = without(slip, *pair)
    return {**zones, "stick": sticking, "slip": slip}


class History(PlainData):
    """The states of a frictional problem along a history of loads.

    Attributes
    ----------
    problem : Contact
    states : list of State
        One for each pair of loads, in the given order.
    events : list of Event
        What happens on the way, in order; none in three dimensions.
    warnings : list of str
        What its states warn of, each sentence once.

    Examples
    --------
    >>> solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)
    >>> problem = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Unilateral(friction=0.3))
    >>> history = problem.history([(1.0, 0.0), (1.0, 0.3), (1.0, 0.0)], rtol=0.05)
    >>> [state.shear for state in history.states], "reversal" in [event.kind for event in history.events]
    ([0.0, 0.3, 0.0], True)
    """

    _keys = "states", "events", "warnings"

    def __init__(self, problem: ContactLike, states: Sequence[State], events: Sequence[Event]) -> None:
        self.problem, self.states, self.events = problem, list(states), list(events)

    def parts_to_save(self) -> tuple[type, dict[str, Any]]:
        return History, {"problem": self.problem, "states": self.states, "events": self.events}

    def noting(self, sentence: str) -> History:
        """Returns the history with one more sentence among the warnings of each state."""
        return History(self.problem, [state.noting(sentence) for state in self.states], self.events)

    @property
    def warnings(self) -> list[str]:
        return list(dict.fromkeys(text for state in self.states for text in state.warnings))

    @property
    def error_estimate(self) -> float | None:
        """The largest one of its states; None where the discretisation was prescribed."""
        errors = [state.error_estimate for state in self.states if state.error_estimate is not None]
        return max(errors, default=None)

    def plot(self, file: Target = None, ax: Axes | None = None) -> Figure:
        """Returns a figure of the last state's shear traction within what friction allows, of the shear
        force over the slip of all states, and of the dissipated energy.

        Parameters
        ----------
        file, ax : optional
            As of `State.plot`; an axis has the shear force alone.

        Examples
        --------
        >>> solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)
        >>> problem = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Unilateral(friction=0.3))
        >>> figure = problem.history([(1.0, 0.0), (1.0, 0.3)], rtol=0.05).plot("history.pdf")
        """
        return saved(pictures().draw_history(self.states, ax), file, ax, self.warnings)

    def __repr__(self) -> str:
        return line("History", f"{len(self.states)} pairs, {len(self.events)} events", self.warnings)


def pairs_of(pairs: ArrayLike, friction: float, in_space: bool = False) -> Array:
    """Returns pairs (P, Q) as an array (n, 2), in space (P, Q1, Q2) and with a bulk stress that is not 0
    (P, Q, S) as (n, 3), with |Q| beyond f P by rounding as f P; raises BadArgument unless they are finite,
    with P > 0 and |Q| <= f P.
    """
    what = "triples (P, Q1, Q2)" if in_space else "pairs (P, Q), or (P, Q, bulk stress),"
    columns = 3 if in_space else 2
    loads = require_floats(f"must be {what} of numbers", pairs=pairs)
    good = loads.ndim == 2 and loads.shape[1] in (columns, 3) and len(loads) and np.isfinite(loads).all()
    require(good, "pairs", pairs, f"must be one or more {what} of finite numbers")
    forces = loads[:, :columns]
    bulk = loads[:, columns:]
    for P, *Q in forces.tolist():
        require(P > 0, "pairs", (P, *Q), "must have a positive normal force P")
        words = f"must have |Q| <= f P = {friction * P}: beyond it the obstacle slides on without end"
        require(np.hypot(*Q, *[0.0] * (3 - columns)) <= friction * P * (1 + SLIDING), "pairs", (P, *Q), words)
    normal = forces[:, :1]
    sizes = np.linalg.norm(forces[:, 1:], axis=1, keepdims=True)
    within = np.divide(friction * normal, sizes, out=np.ones_like(sizes), where=sizes > friction * normal)
    return np.hstack((normal, forces[:, 1:] * within, bulk[:, bulk.any(axis=0)]))
