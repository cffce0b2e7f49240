"""What a method knows between the points of a state, and of the response of the body."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from .fields import FieldsBelow
from .surface import Surface
from .types import Array, Integers, Interval


def set_read_only(instance: Any) -> None:
    """Makes the arrays among the fields of a dataclass ones that cannot be written to: states share them."""
    for name, value in vars(instance).items():
        if isinstance(value, np.ndarray):
            object.__setattr__(instance, name, read_only(value))


def read_only(values: Array) -> Array:
    """Returns a view of an array that cannot be written to."""
    view = values.view()
    view.flags.writeable = False
    return view


class Response(Protocol):
    """Response of the bodies at the points of a state, as of `State`: `SurfaceResponse`, or an object that
    evaluates each field when it is first read.
    """

    @property
    def micromoment(self) -> Array:
        """Micromoment, array (n,), in space (n, 2) (stress x length)."""

    @property
    def psi(self) -> Array:
        """Microrotation, array (n,), in space (n, 2) (radians)."""

    @property
    def displacement(self) -> Array:
        """Displacement of the surface, array (n,) (length)."""

    @property
    def rotation(self) -> Array | None:
        """Rotation of the blocks with psi0, array (n,) of the plane alone (radians)."""

    @property
    def opposite(self) -> Array | None:
        """Displacement of a second body, array (n,) (length); None of a rigid obstacle."""

    @property
    def slip(self) -> Array | None:
        """Slip since the first contact, array (n,), in space (n, 2) (length); None without friction."""


@dataclass(frozen=True, eq=False)
class SurfaceResponse:
    """A `Response` whose fields are known, as it is saved.

    Attributes
    ----------
    micromoment, psi : arrays (n,), in space (n, 2)
    displacement : array (n,)
    rotation, opposite, slip : arrays (n,) or None
    """

    micromoment: Array
    psi: Array
    displacement: Array
    rotation: Array | None = None
    opposite: Array | None = None
    slip: Array | None = None

    def __post_init__(self) -> None:
        set_read_only(self)


class Interpolant(Protocol):
    """What lies between the points of a State, and what of its points takes time.

    Rules
    -----
    1. A corner is its number in `State.pressures`; places are abscissae, array (n,), in space an array (n, 2)
       or (n, 3).
    2. What ``response()`` has, `energy`, `work`, `stiffness` and ``warnings(state)`` cost: on panels a tenth
       of a solution. A State asks for each when it is first read, and keeps it.
    3. Every place that is no number, and corners that the law has not, are refused before.
    """

    @property
    def data_exhausted(self) -> bool:
        """Whether the data mean no more, and no rtol helps."""

    @property
    def fields(self) -> FieldsBelow | None:
        """Fields below the surface; None of a method that has none."""

    @property
    def fields_on_mesh(self) -> bool:
        """Whether `fields` have a `body` on a mesh."""

    @property
    def period(self) -> float | None:
        """Length after which the surface repeats."""

    @property
    def energy(self) -> float:
        """Elastic energy of the bodies."""

    @property
    def work(self) -> float | None:
        """Work of the loads along a history; None without friction."""

    @property
    def stiffness(self) -> float | None:
        """Change of the load with the approach; None where there is none."""

    def sensitivity(self, low: Any, high: Any, /) -> dict[str, float]:
        """Returns changes of readings between problems of lower and higher modulus."""

    def pressure(self, corner: int, places: Array, /) -> Array:
        """Returns the pressure of a corner at places: 0 beside the contact, and no tension."""

    def moment_at(self, places: Array, /) -> Array:
        """Returns the micromoment of the pressures at places, array (n,), in space (n, 2)."""

    def counter_displacement(self, places: Array, /) -> Array:
        """Returns the displacement of a second body at places, 0 of a rigid obstacle."""

    def gap(self, corner: int, x: Array, /) -> Array:
        """Returns the gap of a corner in the plane; raises BadArgument where the surface is not known."""

    def shear_at(self, x: Array, /) -> Array:
        """Returns the shear traction in the plane, at most the friction times the pressure."""

    def surface(self, window: Interval | None, /) -> Surface:
        """Returns the Surface along x1, in the plane."""

    def fields_below(self, box: tuple[Interval, float], x2: float | None, /) -> tuple[Any, Integers]:
        """Returns fields at points in ((left, right), depth), in space at x2, and triangles (m, 3)."""

    def reaction_on(self, boundary: str, /) -> tuple[Array, Any]:
        """Returns what the supports of a boundary exert; raises BadArgument but of bodies on a mesh."""

    def response(self) -> Response:
        """Returns the response of the bodies at the points of the state."""

    def warnings(self, state: Any, /) -> list[str]:
        """Returns sentences on what the state does not resolve."""
