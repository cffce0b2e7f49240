"""A contact state of a body in three dimensions, at the nodes of its contact boundary."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import Named, at_most
from ..model.plain_data import PlainData
from ..model.summary import Row, Shown, Summary, number, saved
from ..model.types import AnyArray as Array
from ..model.types import ContactLike, Target
from .body import Fields
from .meshes import locking, longest_element

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from .facets import ContactNodes

FEWEST = 25  # nodes in contact, below which a state says that they are few
BETWEEN = 0.05  # of the largest displacement, penetration between nodes from which on a state says so
BESIDE = 1e-3  # the same at vertices beside the contact boundary


@dataclass(frozen=True, repr=False, eq=False)
class State3D(Shown, PlainData):
    """A contact state of a body in space.

    Where all four corners of a block are closed their forces are not unique: four forces act on three degrees
    of freedom. `pressure` and `micromoment`, their resultants, are; `pressures` are those of least norm.
    On a part of a symmetric body load, energy and nodes are those of the part.

    Attributes
    ----------
    problem : Contact
    load : float
        Force.
    approach : float
        Approach of the obstacle (length).
    nodes : ContactNodes
    pressures : dict of arrays (n,)
        Of the corners "--", "-+", "+-", "++" (signs of x1 and x2 from the block's middle), or {"C": ...}.
    surface : array (3, n)
        Normal displacement u into the body and phi = (-psi2, psi1) ell/2 (lengths).
    loads : array (3, n)
        Nodal forces, and moments in the measure of phi, that act on the body (force).
    closed : array (n,) of int
        Number of closed corners at each node: those with a force, and all four where no gap is open.
    residual : float
        Largest relative residual of the contact conditions.
    iterations : int
        Products with the flexibility, or steps of Newton's method.
    method : "condensed" or "newton"
    found : Fields or None
        The fields, where the method has them.
    """

    problem: ContactLike
    load: float
    approach: float
    nodes: ContactNodes
    pressures: dict[str, Array]
    surface: Array
    loads: Array
    closed: Array
    residual: float
    iterations: int

    method: str = "condensed"
    found: Fields | None = None

    error_estimate = None
    _keys = (
        *("load", "approach", "contact_area", "energy", "error_estimate", "residual", "iterations"),
        *("unknowns", "method", "warnings", "points", "x1", "x2", "weights"),
        *("pressure", "pressures", "micromoment", "psi", "displacement", "closed"),
    )

    @property
    def points(self) -> Array:
        """Places of the nodes, array (n, 3) (lengths)."""
        return self.nodes.points

    def __post_init__(self) -> None:
        object.__setattr__(self, "pressures", Named("corner", self.pressures))

    @property
    def x1(self) -> Array:
        """Abscissae of the nodes along x1, array (n,) (length)."""
        return self.nodes.points[:, 0]

    @property
    def x2(self) -> Array:
        """The same along x2."""
        return self.nodes.points[:, 1]

    @property
    def weights(self) -> Array:
        """Areas of the nodes, array (n,): the sum of weights times pressure is the load."""
        return self.nodes.weights

    @cached_property
    def pressure(self) -> Array:
        """Total pressure, array (n,) (stress)."""
        return np.sum(list(self.pressures.values()), axis=0)

    @property
    def displacement(self) -> Array:
        """Normal displacement into the body, array (n,) (length)."""
        return self.surface[0]

    @property
    def psi(self) -> Array:
        """Microrotations about x1 and x2, array (2, n) (radians)."""
        return np.array((self.surface[2], -self.surface[1])) * 2 / self.problem.solid.ell

    @property
    def micromoment(self) -> Array:
        """M1 and M2 of the corners' forces, or the reaction to psi = 0, array (2, n) (stress x length)."""
        return np.array((self.loads[2], -self.loads[1])) / self.weights * self.problem.solid.ell / 2

    @property
    def unknowns(self) -> int:
        """Free unknowns of the body."""
        return int(self.nodes.body.space.FreeDofs().NumSet())

    @property
    def contact_area(self) -> float:
        """Area of the nodes at which a corner touches (length^2)."""
        return float(self.weights[self.closed > 0].sum())

    @property
    def energy(self) -> float:
        """Elastic energy: half the work of the corner forces from the unloaded state on."""
        gaps = self.problem.solver.initial_gaps  # type: ignore[attr-defined]
        lowered = self.approach - np.where(np.isfinite(gaps), gaps, 0.0)
        return float(np.sum(np.array(list(self.pressures.values())) * self.weights * lowered) / 2)

    @cached_property
    def fields(self) -> Fields:
        """Displacement, microrotation and stresses in the body, and the reactions of its supports."""
        if self.found is not None:
            return self.found
        fields: Fields = self.nodes.fields(self.loads)  # type: ignore[attr-defined]
        return fields

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """What the state has no estimate for, in words."""
        body, half_width = self.nodes.body, float(np.sqrt(self.contact_area / np.pi))
        locked = locking(body.solid, body.order, self._depth, half_width)
        own = self._few(), self._long(), *locked, self._beyond(), self._between()
        return tuple(words for words in own if words)

    @property
    def _depth(self) -> float:
        """How deep the deepest element below the contact reaches."""
        pressed = [bool(np.any(self.closed[own] > 0)) for own in self.nodes.facets]
        return float(self.nodes.depths[pressed].max())

    def _few(self) -> str:
        count = int(np.count_nonzero(self.closed))
        return f"only {count} nodes in contact and no error estimate: take a finer mesh" * (count < FEWEST)

    def _long(self) -> str:
        """Whether the elements below the contact are too long for the layer at the surface."""
        body = self.nodes.body
        longest = longest_element(body.solid, body.order)
        return (
            f"elements of order {body.order} that reach {self._depth:.2g} below the contact, more than "
            f"{at_most(longest)}, do not resolve the layer: take shorter ones, or a higher order"
        ) * bool(self._depth > longest)

    def _beyond(self) -> str:
        """Whether the obstacle reaches into the surface beside the contact boundary."""
        body, numbers = self.nodes.body, self.nodes.beyond
        places = np.array([body.mesh.vertices[int(number)].point for number in numbers]).reshape(-1, 3)
        low = self._gaps(places, np.zeros((3, len(numbers)))).min(axis=0, initial=np.inf) < 0
        if not low.any():
            return ""
        # an unknown of a vertex is the value there
        own = (getattr(self.fields, name).vec.FV().NumPy() for name in ("u3", "psi1", "psi2"))
        u3, psi1, psi2 = (values[numbers[low]] for values in own)
        half = self.problem.solid.ell / 2
        inside = -self._gaps(places[low], np.array((-u3, -half * psi2, half * psi1))).min()
        return (
            f"beside the contact boundary the obstacle reaches {inside:.2g} into the surface: name all that "
            "it may touch"
        ) * bool(inside > BESIDE * np.abs(self.displacement).max())

    def _between(self) -> str:
        """Whether the obstacle reaches into the surface between the nodes."""
        places, values = self.nodes.between
        inside = -self._gaps(places, np.array([values @ part for part in self.surface])).min()
        words = f"between nodes the obstacle reaches {inside:.2g} into the surface: take a finer mesh"
        return words * bool(inside > BETWEEN * np.abs(self.displacement).max())

    def _gaps(self, places: Array, surface: Array) -> Array:
        """Gaps of all corners at places, array (k, 3), with this (u, phi1, phi2), array (3, k)."""
        solver: Any = self.problem.solver
        gaps = solver.surface_law.initial_gaps(self.problem.obstacle, solver.solid.ell, *places[:, :2].T)
        added = np.einsum("cin,in->cn", solver.directions(places), surface)
        found: Array = gaps - places[:, 2] - self.approach + added
        return found

    def plot(self, path: Target = None) -> Figure:
        """Returns a figure of the pressure, of the number of closed corners, and of the micromoment.

        Parameters
        ----------
        path : str or Path, optional
            File to which the figure is written (PNG, PDF or SVG, by its ending).
        """
        from ..view.nodes_figure import draw

        return saved(draw(self), path, self.warnings)

    def summary(self) -> Summary:
        """Returns load, approach, contact and pressure, for a notebook."""
        rows = (
            Row("load", "P", self.load, "force"),
            Row("approach", "d", self.approach, "length"),
            Row("area of contact", "", self.contact_area, "length^2"),
            Row("largest nodal pressure", "p", float(self.pressure.max()), "stress"),
            Row("largest micromoment", "|M|", float(np.hypot(*self.micromoment).max()), "stress x length"),
            Row("largest relative residual", "", self.residual),
            Row("unknowns", "", self.unknowns),
        )
        words = f"load {number(self.load)}, approach {number(self.approach)}, {self.unknowns} unknowns"
        return Summary("Contact state of a body in 3D", words, rows, self.warnings)
