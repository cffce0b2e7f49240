"""Frictional contact along a history of loads: its states, and what happens on the way."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias, cast

import numpy as np
from numpy.typing import ArrayLike

from ..errors import BadArgument
from .plain_data import PlainData
from .state import Solution, State, _to_read
from .summary import Row, Shown, Summary, number, saved
from .types import Array, ContactLike, Interval, Target
from .zones import distance

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ZoneErrors: TypeAlias = "dict[str, list[Interval] | None]"  # of the left and right ends, by the zone's name
SLIDING = 1e-9  # relative, by which a pair may be beyond f P: rounding of what a user has multiplied


class FrictionSolution(Solution):
    """What a method computes at a pair of loads: the contract that a FrictionState rests on."""

    @property
    def zone_errors(self) -> ZoneErrors | None:
        """Errors of the edges of `zones_by_name` (lengths), as of `FrictionState`; None, unless a method
        estimates them.
        """
        return None

    if TYPE_CHECKING:

        @property
        def shear(self) -> float:
            """Q, force per thickness; `load` is P."""

        @property
        def shear_traction(self) -> Array:
            """q along x1, array (n,) (stress)."""

        @property
        def slip(self) -> Array:
            """Relative tangential displacement since first contact, array (n,) (length)."""

        @property
        def dissipation(self) -> float:
            """Energy per thickness that was dissipated since the beginning."""

        @property
        def work(self) -> float:
            """Work of the loads since the beginning, per thickness."""

        @property
        def tangential_approach(self) -> float | None:
            """Tangential displacement of the obstacle (length); None where a rigid-body constant is
            arbitrary.
            """


class OfMoment(FrictionSolution):
    """Base of solutions with the shear and the energies of a `corners.follower.Moment`, `moment`."""

    moment: Any

    @property
    def shear(self) -> float:
        """Q."""
        return float(self.moment.shear)

    @property
    def shear_traction(self) -> Array:
        """q, array (n,)."""
        traction: Array = self.moment.tangential / self.weights
        return traction

    @property
    def slip(self) -> Array:
        """Relative tangential displacement since first contact, array (n,)."""
        slip: Array = self.moment.slip
        return slip

    @property
    def energy(self) -> float:
        """Elastic energy, up to a constant where the rigid motion is arbitrary."""
        return float(self.moment.energy)

    @property
    def work(self) -> float:
        """Work of the loads, up to the same constant."""
        return float(self.moment.work)

    @property
    def dissipation(self) -> float:
        """Since the beginning."""
        return float(self.moment.dissipation)


def change(
    finer: FrictionSolution, coarser: FrictionSolution, weights: Array, ell: float, friction: float
) -> float:
    """Returns the largest relative L2 change of pressure, M/ell and q/f from one discretisation to the next.

    Parameters
    ----------
    finer, coarser : FrictionSolution
    weights : array (n,)
        Of the finer one's nodes (lengths).
    ell, friction : float
    """
    fields = [
        (one.pressures.sum(axis=0), one.micromoment / ell, one.shear_traction / friction)
        for one in (finer, coarser)
    ]
    p, M, q = (own - np.interp(finer.x, coarser.x, other) for own, other in zip(*fields))
    return distance(weights, p, M, fields[0][0], q)


@dataclass(frozen=True, eq=False, repr=False)
class FrictionState(State):
    """A state of a history: a contact state with a shear traction.

    It has all of `State`; its `zones` have "stick" and "slip" as well, intervals of x1 in contact. Its
    `micromoment` is that of the corner forces and of the shear traction, which acts on the blocks' faces.

    Attributes
    ----------
    normal, shear : float
        P and Q, forces per thickness; Q > 0 drags the surface along x1.
    shear_traction : array (n,)
        q along x1 at `x` (stress).
    slip : array (n,)
        Relative tangential displacement of obstacle and surface since first contact at `x` (length),
        positive in the direction of a positive q; 0 where there was no contact.
    dissipation, work : float
        Dissipated energy and work of the loads since the beginning, per thickness: `work` is the sum of
        `energy` and `dissipation`, up to what the rigid-body constant of a half-plane leaves open in `work`
        and `energy` alike.
    tangential_approach : float or None
        Tangential displacement of the obstacle (length); None where the rigid-body constant is arbitrary.
    zone_errors : dict or None
        Errors of the edges of `zones` in their order: {name: [(left, right), ...]} (lengths), and None for a
        name of which the coarser discretisation had another number of zones. None as a whole where a
        method does not estimate them.

    Examples
    --------
    >>> solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)
    >>> problem = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Unilateral(friction=0.3))
    >>> state = problem.history([(1.0, 0.0), (1.0, 0.15)], rtol=0.05).states[-1]
    >>> round(float(state.weights @ state.shear_traction), 9), state.dissipation > 0
    (0.15, True)
    """

    solution: FrictionSolution

    _keys = (
        *State._keys,
        *("normal", "shear", "dissipation", "work", "tangential_approach", "zone_errors"),
        *("shear_traction", "slip"),
    )

    @property
    def normal(self) -> float:
        """P, the normal force per thickness."""
        return self.load

    @property
    def shear(self) -> float:
        """Q, the shear force per thickness."""
        return float(self.solution.shear)

    @property
    def shear_traction(self) -> Array:
        """Shear traction at `x`, array (n,)."""
        return _to_read(self.solution.shear_traction)

    @property
    def slip(self) -> Array:
        """Relative tangential displacement since first contact at `x`, array (n,)."""
        return _to_read(self.solution.slip)

    @property
    def dissipation(self) -> float:
        """Dissipated energy since the beginning."""
        return float(self.solution.dissipation)

    @property
    def work(self) -> float:
        """Work of the loads since the beginning."""
        return float(self.solution.work)

    @property
    def tangential_approach(self) -> float | None:
        """Tangential displacement of the obstacle, or None."""
        return self.solution.tangential_approach

    @property
    def zone_errors(self) -> ZoneErrors | None:
        """Errors of the edges of `zones`, or None."""
        return self.solution.zone_errors

    def to_dict(self) -> dict[str, Any]:
        """Returns the state as plain data for JSON: `State.to_dict`, with the attributes of friction, and the
        columns "shear" and "slip" in "profile".
        """
        data = super().to_dict()
        data["profile"] |= {"shear": data["shear_traction"], "slip": data["slip"]}
        return data

    def summary(self) -> Summary:
        """Returns what a notebook shows of the state."""
        plain = super().summary()
        rows = (
            *plain.rows,
            Row("shear force", "Q", self.shear, "force per thickness"),
            Row("largest shear traction", "|q|", float(np.abs(self.shear_traction).max()), "stress"),
            Row("dissipation", "", self.dissipation, "energy per thickness"),
        )
        return Summary("Contact state with friction", plain.brief, rows, plain.warnings)


@dataclass(frozen=True)
class HistoryEvent:
    """What happens on the way from one pair of loads to the next.

    Attributes
    ----------
    pair : int
        Number of the pair that is on the way, from 0.
    normal, shear : float
        P and Q at which it happens (forces per thickness).
    error : float or None
        Error of that place as a share of the way from one pair to the next; None where it is not known.
    kind : str
        "first slip", "full slip", "reversal", "born" or "vanished".
    zone : str
        "slip" or "stick".
    x : float
        Abscissa x1 (length).

    Examples
    --------
    >>> solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)
    >>> problem = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Unilateral(friction=0.3))
    >>> history = problem.history([(1.0, 0.0), (1.0, 0.3), (1.0, 0.0)], rtol=0.05)
    >>> [event.pair for event in history.events if event.kind == "reversal"]
    [2]
    """

    pair: int
    normal: float
    shear: float
    error: float | None
    kind: str
    zone: str
    x: float


class History(Shown, PlainData):
    """The states of a frictional problem along a history of loads.

    Attributes
    ----------
    problem : Contact
    states : list of FrictionState
        One for each pair of loads, in the given order.
    events : list of HistoryEvent
        What happens on the way, in order.
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

    def __init__(
        self, problem: ContactLike, states: Sequence[FrictionState], events: Sequence[HistoryEvent]
    ) -> None:
        self.problem, self.states, self.events = problem, list(states), list(events)

    @property
    def warnings(self) -> list[str]:
        """What its states warn of, each sentence once."""
        return list(dict.fromkeys(text for state in self.states for text in state.warnings))

    def plot(self, path: Target = None) -> Figure:
        """Returns a figure of the last state's shear traction within what friction allows, and of the shear
        force over the slip of all states.

        Parameters
        ----------
        path : str or Path, optional
            File to which the figure is written (PNG, PDF or SVG, by its ending).

        Returns
        -------
        matplotlib.figure.Figure
        """
        from ..view.friction_figure import FrictionFigure, slip_and_shear

        loop = [slip_and_shear(state) for state in self.states]
        figure: Figure = FrictionFigure().update(self.states[-1], loop).drawing
        return saved(figure, path, self.warnings)

    def summary(self) -> Summary:
        """Returns the pairs of loads and the events."""
        rows = [
            Row(f"pair {index}", "P, Q", f"{number(one.normal)}, {number(one.shear)}", "force per thickness")
            for index, one in enumerate(self.states)
        ]
        rows += [
            Row(f"{event.zone}: {event.kind}", "P, Q", f"{number(event.normal)}, {number(event.shear)}")
            for event in self.events
        ]
        words = f"{len(self.states)} pairs, {len(self.events)} events"
        return Summary("History", words, tuple(rows), tuple(self.warnings))


def pairs_of(pairs: ArrayLike, friction: float) -> Array:
    """Returns pairs (P, Q) as an array (n, 2).

    Raises
    ------
    BadArgument
        Unless they are finite, with P > 0 and |Q| <= f P; a Q beyond f P by rounding becomes f P.
    """
    try:
        found = np.array(cast(Any, pairs), float)
    except (TypeError, ValueError, OverflowError) as failure:
        raise BadArgument("pairs", pairs, "must be pairs (P, Q) of numbers") from failure
    if found.ndim != 2 or found.shape[1] != 2 or not len(found) or not np.isfinite(found).all():
        raise BadArgument("pairs", pairs, "must be one or more pairs (P, Q) of finite numbers")
    for P, Q in found:
        if not P > 0:
            raise BadArgument("pairs", (float(P), float(Q)), "must have a positive normal force P")
        if abs(Q) > friction * P * (1 + SLIDING):
            raise BadArgument(
                "pairs",
                (float(P), float(Q)),
                f"must have |Q| <= f P = {friction * P}: beyond it the obstacle slides on without end",
            )
    found[:, 1] = np.clip(found[:, 1], -friction * found[:, 0], friction * found[:, 0])
    return found
