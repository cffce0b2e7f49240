"""What happens along a load path or a history."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, wraps
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from ..errors import (
    require,
    require_choice,
    require_finite,
    require_kind,
    require_positive,
    require_values,
    require_whole,
)
from ..threads import bounded
from .contact_like import ContactLike
from .progress import counting
from .refinement import Usual
from .results import PlainData, line, number, saved
from .types import Array, Axes, Figure, Target
from .views import pictures

if TYPE_CHECKING:
    from .state import State


@dataclass(frozen=True)
class Event:
    """What happens to a zone, or with friction to slip, at x.

    Attributes
    ----------
    load, load_error : float
        Force per thickness P, and its error; of a `History` that of P and Q together, None if unknown.
    kind : str
        "born", "vanished", "merged" or "split"; of a history also "first slip", "full slip" (of the whole
        contact) or "reversal".
    zone : str
        "A", "B", "full" or "contact"; of a history "slip" or "stick".
    x : float
        Abscissa x1 (length). At load 0 it is where the initial gap is least, or the middle of the first zone
        where it is equally small elsewhere.
    shear : float or None
        Shear force per thickness Q of a history.
    pair : int or None
        Number, from 0, of the pair of loads on the way to which it happens.

    Raises
    ------
    BadArgument
        If a number is none, the kind is none of these, or the zone no name.

    Examples
    --------
    >>> mb.Event(load=1, load_error=0, kind="born", zone="A", x=0)
    Event(load=1.0, load_error=0.0, kind='born', zone='A', x=0.0, shear=None, pair=None)
    """

    load: float
    load_error: Any  # a float; of a history also None
    kind: str
    zone: str
    x: float
    shear: float | None = None
    pair: int | None = None

    def __post_init__(self) -> None:
        if self.pair is not None:
            require_whole(0, pair=self.pair)
        unknown = "shear" if self.pair is None else "load_error"
        for name in ("load", "load_error", "x", "shear"):
            if name != unknown or getattr(self, name) is not None:
                require_finite(**{name: getattr(self, name)})
                object.__setattr__(self, name, float(getattr(self, name)))  # plain floats, not numpy's
        kinds = "born", "vanished", "merged", "split", "first slip", "full slip", "reversal"
        require_choice(kinds, kind=self.kind)
        require_kind(str, "the name of a zone", zone=self.zone)


class LoadPath(PlainData):
    """The states of a problem from first touch to a load, and the events on the way.

    Where the slope of the obstacle falls, zones on either side never merge: the gap gets narrower without
    end.

    Attributes
    ----------
    problem : Contact
    last : float
        Load at the end of the path (force per thickness).
    rtol : float or None
        Relative error of the states that `at` returns.
    first : float
        Load from which zones are followed. A zone that is there by then and did not begin at first touch is
        an event at half of that load, with as large an error.
    events : list of Event
        Zones that are born, merge, split or vanish, ascending in load.
    warnings : list of str
        What `events` may leave out.
    progress : bool or None
        As of `Contact.path`, for what is computed later.

    Examples
    --------
    >>> solid = mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1)
    >>> path = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Microblock()).path(load=1.0)
    >>> [event.kind for event in path.events]
    ['born', 'born', 'born', 'born', 'born', 'merged']
    >>> path.at(0.5).load
    0.5
    """

    _keys = "last", "rtol", "first", "events", "warnings"

    first: Any = 0.0  # a float; a subclass may have properties
    warnings: Any = ()
    progress: bool | None = None

    def __init__(self, problem: ContactLike, last: float, rtol: float | None, **known: Any) -> None:
        vars(self).update(known, problem=problem, last=last, rtol=rtol)

    if TYPE_CHECKING:  # of a subclass, or of a file
        problem: ContactLike
        last: float
        rtol: float | None

        @property
        def events(self) -> Sequence[Event]:
            """Events on the way, by ascending load."""

    def parts_to_save(self) -> tuple[type, dict[str, Any]]:
        return LoadPath, {name: getattr(self, name) for name in ("problem", *self._keys)}

    def at(self, load: float) -> State:
        """Returns the State at a load on the path (force per thickness); raises BadArgument of others, and
        NotConverged as `Contact.solve`.
        """
        require_on_path(load, self.last)
        return self.problem.solve(load=load, rtol=self._asked, progress=self.progress)

    def depths(self, loads: Sequence[float]) -> Array:
        """Returns the curve of load over depth: the approaches at loads on the path, of loading and of
        unloading, in any order. On a half-space rtol is that of the depth (`accuracy`).

        Parameters
        ----------
        loads : sequence of float
            Forces per thickness.

        Returns
        -------
        array (n,)
            Approaches (lengths).

        Raises
        ------
        BadArgument
            If a load is beyond the path, or the body has no approach.
        NotConverged
            As `Contact.solve`.

        Examples
        --------
        >>> ground = mb.HalfSpace(mb.Elastic(E=100, nu=0.3))
        >>> path = mb.Contact(ground, mb.Sphere(R=10), mb.Unilateral()).path(load=1.0)
        >>> path.depths([0.5, 1.0, 0.5]).round(4).tolist()
        [0.0105, 0.0167, 0.0105]
        """
        solver = self.problem.solver
        words = "has no approach: take a HalfSpace, a Block or a period"
        require(solver.has_approach, "body", solver.body, words)
        loads = require_values(loads=loads)
        for load in loads:
            require_on_path(load, self.last)
        accuracy = "depth" if "depth" in solver.accuracies else solver.accuracy
        states = self.problem.states(loads, rtol=self._asked, accuracy=accuracy, progress=self.progress)
        return np.array([state.approach for state in states])

    @property
    def _asked(self) -> float | None:
        """The rtol that `Contact.solve` takes, None where the path has the usual one."""
        return None if isinstance(self.rtol, Usual) else self.rtol

    def plot(self, file: Target = None, ax: Axes | None = None) -> Figure:
        """Returns a figure of the edges of zones over the load and the events; in space of the events alone.

        Parameters
        ----------
        file, ax : optional
            As of `State.plot`.

        Examples
        --------
        >>> solid = mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1)
        >>> path = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Microblock()).path(load=1.0)
        >>> figure = path.plot("path.pdf")
        """
        return saved(pictures().draw_path(self, ax), file, ax, self.warnings)

    def __repr__(self) -> str:
        is_searched = "events" in vars(self)  # which are searched for when they are asked for
        words = f"{len(self.events)}" if is_searched else "not yet looked for"
        warnings = self.warnings if is_searched else ()
        return line("Load path", f"up to load {number(self.last)}, events: {words}", warnings)


Numbered: TypeAlias = dict[tuple[str, str, int], Event]  # by kind, zone and how many before


class SeenTwice(LoadPath):
    """A load path whose events are those that two meshes see: `_seen`, [{(kind, zone, how many before):
    Event}] of the coarse one and of the fine one. `warnings` name events that one alone sees.
    """

    _seen: list[Numbered]

    @staticmethod
    def numbered(events: Sequence[Event]) -> Numbered:
        """Returns the events of a grid, ascending in load, by their keys."""
        events_by_key: Numbered = {}
        for event in events:
            number = sum(key[:2] == (event.kind, event.zone) for key in events_by_key)
            events_by_key[event.kind, event.zone, number] = event
        return events_by_key

    def judged(self, coarse: Event, fine: Event) -> Event:
        """Returns an event of both meshes with its error."""
        raise NotImplementedError

    @cached_property
    def events(self) -> list[Event]:
        """Zones that are born, merge, split or vanish, ascending in load."""
        coarse, fine = self._seen
        confirmed = [self.judged(coarse[key], fine[key]) for key in fine if key in coarse]
        return sorted(confirmed, key=lambda event: event.load)

    @property
    def warnings(self) -> list[str]:
        coarse, fine = self._seen
        alone = [event for key, event in (coarse | fine).items() if key not in coarse or key not in fine]
        return [
            f"one of two meshes alone sees {event.zone} {event.kind}, at about load {event.load:.3g}: it is "
            "left out; look at states around it"
            for event in sorted(alone, key=lambda event: event.load)
        ]


def following(method: Callable[..., Any]) -> Callable[..., Any]:
    """Returns the method of a LoadPath with one BLAS thread inside, and the bar that the path asks for."""

    @wraps(method)
    def followed(self: LoadPath, *given: Any, **named: Any) -> Any:
        with counting("load path", self.progress):
            return method(self, *given, **named)

    return bounded(followed)


def require_on_path(load: float, last: float) -> None:
    require_positive(load=load)
    require(load <= last, "load", load, f"must lie between 0 and the end of the path, {last}")
