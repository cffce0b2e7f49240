"""The methods by name: what a user may fix of each, and its solver.

`MethodAttributes` says what a method of a user's own offers.
"""

from dataclasses import dataclass, field, fields
from typing import Any, Protocol, TypeVar, cast

from ..errors import (
    Checked,
    checked,
    require,
    require_choice,
    require_flag,
    require_kind,
    require_numbers,
    require_pair,
    require_positive,
    require_whole,
)
from .types import Interval

SHAPES = "quadrilaterals", "triangles"
AnyOffer = TypeVar("AnyOffer")


@dataclass(frozen=True)
class MethodAttributes:
    """What a method offers, with defaults.

    1. A method is any object with a `solver`; a body names its class in `methods`.
    2. A class that is made without arguments is tried where the user names no method, but `by_name`.
    3. The solver's ``solve`` returns a `microblock.model.solution.Solution`, whose docstring lists
       what a `State` is filled with.

    Attributes
    ----------
    solver : class or str
        Derived from `microblock.model.solver.Solver`, or its dotted path below microblock.
    by_name : bool
        Whether the method serves only where the user names it.
    """

    solver: Any = None
    by_name: bool = False


def offered(given: Any, interface: type[AnyOffer]) -> AnyOffer:
    """Returns the interface, a dataclass of defaults, with what an object has of it."""
    missing = object()
    values = {entry.name: getattr(given, entry.name, missing) for entry in fields(cast(Any, interface))}
    return interface(**{name: value for name, value in values.items() if value is not missing})


_order = checked(require_whole, 1, 20)  # of elements


class MethodLike(Protocol):
    """A method: what it fixes, and the solver that it stands for."""

    @property
    def solver(self) -> str | type[Any]:
        """A Solver class, or its dotted path below microblock."""


@dataclass(frozen=True)
class Panels(Checked):
    """Panels of a half-plane's contact line, fitted to the zones: the method with the most digits. They
    follow friction between two equal bodies under the law `Unilateral`.

    Parameters
    ----------
    order : int, optional
        Order of the panels, from 2 to 100, without an error estimate; without it rtol chooses.

    Raises
    ------
    BadArgument
        If the order is no whole number from 2 to 100.

    Examples
    --------
    >>> solid = mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1)
    >>> problem = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Microblock(), mb.Panels(order=8))
    >>> problem.solve(load=1.0).error_estimate is None
    True
    """

    order: int | None = field(default=None, metadata=checked(require_whole, 2, 100))

    solver = "halfplane.panel_solver.PanelSolver"


@dataclass(frozen=True)
class Cells(Checked):
    """Uniform cells of constant pressure, matrix-free: large rough problems, and problems with a period. With
    friction cells are graded on a half-plane, and uniform on a half-space.

    Parameters
    ----------
    nodes : int, optional
        Number of cells, 32 to 2**26 (some 20 GB), on half-spaces along the sides of squares and of a period;
        without it rtol chooses.
    window : (left, right), optional
        Where the obstacle may touch (length), not on a period; without it wherever it is low enough.
    residual : float
        Relative residual of the contact problem; pressures are good to ten times that.

    Raises
    ------
    BadArgument
        If a value is out of range.

    Examples
    --------
    >>> solid = mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1)
    >>> problem = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Unilateral(), mb.Cells(nodes=256))
    >>> len(problem.solve(load=1.0).x)
    256
    """

    nodes: int | None = field(default=None, metadata=checked(require_whole, 32, 2**26))
    window: Interval | None = field(default=None, metadata=checked(require_pair))
    residual: float = field(default=1e-9, metadata=checked(require_positive))

    solver = "halfplane.line_solver.LineSolver"

    def __post_init__(self) -> None:
        super().__post_init__()
        require(self.residual < 1, "residual", self.residual, "must lie between 0 and 1")


@dataclass(frozen=True)
class Fitted(Checked):
    """Finite elements whose mesh follows the edges of the zones.

    Parameters
    ----------
    order : int, optional
        Order of the elements, from 1 to 20, without an error estimate; without it rtol chooses.
    spacing : float, optional
        Length of the elements on the surface, with `order`.
    lines : tuple of float
        Points x1 of the surface below which elements shrink as well.
    even : bool
        Whether all elements have one order: the approach of a block feels the far field.

    Raises
    ------
    BadArgument
        If a value is out of range, or a spacing is given without an order.

    Examples
    --------
    >>> solid = mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1)
    >>> problem = mb.Contact(mb.Block(solid, 10.0), mb.Cylinder(R=10), mb.Unilateral(), mb.Fitted(order=4))
    >>> problem.solve(load=1.0).method
    'fitted'
    """

    order: int | None = field(default=None, metadata=_order)
    spacing: float | None = field(default=None, metadata=checked(require_positive))
    lines: tuple[float, ...] = ()
    even: bool = field(default=False, metadata=checked(require_flag))

    solver = "fem.fitted.FittedSolver"

    def __post_init__(self) -> None:
        super().__post_init__()
        fixed = self.spacing is None or self.order is not None
        require(fixed, "spacing", self.spacing, "goes with an order: rtol chooses both")
        object.__setattr__(self, "lines", tuple(require_numbers(lines=self.lines).tolist()))


@dataclass(frozen=True)
class Newton(Checked):
    """Semismooth Newton on all unknowns at once, (31) or (37).

    Parameters
    ----------
    kind : "al" or "penalty"
        Augmented Lagrangian or penalty.
    rho : float, optional
        Regularisation (stress per length); without it one that suits the body.

    Raises
    ------
    BadArgument
        If the kind is unknown, or rho not positive.

    Examples
    --------
    >>> mb.Newton("penalty", rho=1e4)
    Newton(kind='penalty', rho=10000.0)
    """

    kind: str = field(default="al", metadata=checked(require_choice, ("al", "penalty")))
    rho: float | None = field(default=None, metadata=checked(require_positive))

    solver = "fem.newton_solver.NewtonSolver"


@dataclass(frozen=True)
class Uniform(Checked):
    """Equal squares near the contact, graded outwards: the mesh of section 4.2 of the paper.

    Parameters
    ----------
    h : float
        Side of the squares (length).
    order : int
        Order of all fields.
    reach : float, optional
        Half-width and depth of the squares (length); without it twice the half-width of a classical contact
        and a block.
    newton : Newton, optional
        Solves the monolithic system; without it the body is condensed to its contact nodes.
    shape : "quadrilaterals" or "triangles"
        Triangles halve the squares.

    Raises
    ------
    BadArgument
        If a value is out of range.

    Examples
    --------
    >>> solid = mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1)
    >>> problem = mb.Contact(mb.Block(solid, 4.0), mb.Cylinder(R=10), mb.Microblock(), mb.Uniform(h=0.1))
    >>> problem.solve(load=1.0).method
    'uniform'
    """

    h: float = field(metadata=checked(require_positive))
    order: int = field(default=1, metadata=_order)
    reach: float | None = field(default=None, metadata=checked(require_positive))
    newton: Newton | None = field(default=None, metadata=checked(require_kind, Newton, "a Newton(...)"))
    shape: str = field(default="quadrilaterals", metadata=checked(require_choice, SHAPES))

    solver = "fem.uniform.UniformSolver"
    by_name = True  # nothing but a user chooses h


@dataclass(frozen=True)
class Condensed:
    """A user's mesh condensed to its contact nodes; with rtol the mesh is refined by recovery.

    Examples
    --------
    >>> mb.Condensed()
    Condensed()
    """

    solver = "fem.body_solver.BodySolver"


@dataclass(frozen=True)
class GivenCompliance:
    """A body of one's own with a method ``compliance(clamped)``, which returns a
    `microblock.contact_solvers.compliance.Compliance`.
    """

    solver = "contact_solvers.nodal.NodalSolver"
