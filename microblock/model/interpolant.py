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
    def micromoment(self) -> Array: ...

    @property
    def psi(self) -> Array: ...

    @property
    def displacement(self) -> Array: ...

    @property
    def rotation(self) -> Array | None: ...

    @property
    def opposite(self) -> Array | None: ...

    @property
    def slip(self) -> Array | None: ...


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
    2. ``pressure(corner, places)`` is 0 beside the contact, and no tension.
    3. ``moment_at(places)`` is the micromoment of the pressures at these places, array (n,), in space (n, 2).
    4. ``counter_displacement(places)`` is 0 of a rigid obstacle.
    5. Of the plane alone: ``gap(corner, x)``, which raises BadArgument where the surface is not known,
       ``surface(window)``, and with friction ``shear_at(x)``, at most the friction times the pressure.
    6. `fields` are those below the surface, None of a method that has none; then ``fields_below(box, x2)``
       gives them at points in ((left, right), depth), in space in the plane x2, and triangles between these,
       (m, 3). `period` is that of the surface. `fields_on_mesh` says whether they have a `body` on a mesh.
       ``reaction_on(boundary)`` raises BadArgument but of bodies on a mesh.
    7. What ``response()`` has, `energy`, `work`, `stiffness` and ``warnings(state)`` cost: on panels a tenth
       of a solution. A State asks for each when it is first read, and keeps it.
    8. Every place that is no number, and corners that the law has not, are refused before.
    """

    @property
    def data_exhausted(self) -> bool: ...

    @property
    def fields(self) -> FieldsBelow | None: ...

    @property
    def fields_on_mesh(self) -> bool: ...

    @property
    def period(self) -> float | None: ...

    @property
    def energy(self) -> float: ...

    @property
    def work(self) -> float | None: ...
    @property
    def stiffness(self) -> float | None: ...

    def sensitivity(self, low: Any, high: Any, /) -> dict[str, float]: ...

    def pressure(self, corner: int, places: Array, /) -> Array: ...

    def moment_at(self, places: Array, /) -> Array: ...

    def counter_displacement(self, places: Array, /) -> Array: ...

    def gap(self, corner: int, x: Array, /) -> Array: ...

    def shear_at(self, x: Array, /) -> Array: ...

    def surface(self, window: Interval | None, /) -> Surface: ...

    def fields_below(self, box: tuple[Interval, float], x2: float | None, /) -> tuple[Any, Integers]: ...

    def reaction_on(self, boundary: str, /) -> tuple[Array, Any]: ...

    def response(self) -> Response: ...

    def warnings(self, state: Any, /) -> list[str]: ...
