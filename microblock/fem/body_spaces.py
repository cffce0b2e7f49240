"""The fields of a Cosserat body on a mesh of one, two or three dimensions: names, spaces and kinematics."""

from collections.abc import Callable, Iterable, Sequence
from functools import cached_property
from typing import Any, TypeVar, cast

import ngsolve as ng
import numpy as np

from ..errors import require, require_whole
from ..model.material import Cosserat, Elastic, Moduli
from ..model.types import AnyArray, Flags, Integers
from . import contact_term, regions
from .meshes import elements_at

FIELDS3D = ("u1", "u2", "u3", "psi1", "psi2", "psi3")
# place of a field among the components of u and psi as vectors
COMPONENTS = {name: number for number, name in enumerate(FIELDS3D)} | {"psi": 5}

Made = TypeVar("Made")


class BodySpaces:
    """Base of `Body`, which fills what is not set here: `contact`, `prescribed`, `fixed`, `spaces`, `space`.

    Attributes
    ----------
    mesh : ngsolve.Mesh
    solid : Cosserat, the stiffest at the contact boundary, with numbers
    solids : list of Cosserat, of each material of the mesh
    moduli : Moduli, of all of the body
    order, order_psi : int, the largest of u and of psi, 0 without psi
    element_orders : array (elements,) of int, or None where they have one order
    periodic : bool
    rotates : bool, whether psi is unknown
    all_names, names : fields of this dimension, and those that are unknown
    contact : str, name of the boundary that an obstacle may touch
    prescribed : {field: {boundary: value}}
    fixed : {field: pattern of the boundaries on which supports hold it}
    spaces : list, of each unknown field
    space : their product
    """

    contact: str
    prescribed: dict[str, Any]
    fixed: dict[str, str]
    spaces: list[Any]
    space: Any
    solid: Cosserat

    def __init__(
        self, mesh: Any, solids: list[Cosserat], order: Any, order_psi: int | None, periodic: bool
    ) -> None:
        self.mesh = mesh
        self.solids = solids
        self.moduli: Moduli = regions.moduli_of(solids)
        self.periodic = periodic
        self.element_orders: Integers | None = None
        if not isinstance(order, int | np.integer):
            self.element_orders = self._element_orders(np.asarray(order), order_psi)
            order = int(self.element_orders.max())
        self.order = order
        self.order_psi = order if order_psi is None else order_psi
        require_whole(1, order=self.order)
        require_whole(0 if self.is_classical else 1, order_psi=self.order_psi)
        self.rotates = self.order_psi > 0 and not self._elastic.all()
        self.order_psi *= self.rotates
        self.all_names = FIELDS3D if mesh.dim == 3 else ("u1", "u2", "psi")
        self.names = tuple(name for name in self.all_names if self.rotates or name[0] == "u")
        self.derived: dict[Any, Any] = {}  # what costs a factorisation, see `once`

    def field_space(self, name: str, **options: Any) -> Any:
        """Returns the space of a field: psi ends, free of couples, where the solid is Elastic."""
        if name.startswith("u"):
            return self.scalar(self.order, **options)
        if not self._elastic.any():
            return self.scalar(self.order_psi, **options)
        turning = regions.region(self.mesh, ~self._elastic)
        space = self.scalar(self.order_psi, definedon=turning, **options)
        for unused in np.flatnonzero(~np.array(space.GetDofs(turning))):  # else free on other boundaries
            space.SetCouplingType(int(unused), ng.COUPLING_TYPE.UNUSED_DOF)
        space.FinalizeUpdate()
        return space

    def _element_orders(self, orders: AnyArray, order_psi: int | None) -> Integers:
        """Returns the orders; raises BadArgument unless there is one for each element that the body can
        have.
        """
        fit = orders.shape == (self.mesh.ne,) and orders.dtype.kind == "i" and orders.min() >= 1
        require(
            fit and not order_psi and not self.periodic and self.mesh.dim == 2,
            "order",
            orders,
            f"must be an integer of at least 1, or {self.mesh.ne} of them, one an element: orders of "
            "single elements are for 2D bodies that are not periodic, and for all fields at once",
        )
        return orders

    @property
    def in_space(self) -> bool:
        return self.mesh.dim == 3

    @property
    def is_classical(self) -> bool:
        """Whether displacements and microrotation do not act on each other anywhere."""
        return all(solid.is_classical for solid in self.solids)

    @cached_property
    def _elastic(self) -> Flags:
        """Whether a material has no psi, boolean array (materials,)."""
        return np.array([isinstance(solid, Elastic) for solid in self.solids])

    def require_psi(self, name: str, value: Any, boundary: Any = None) -> None:
        """Raises BadArgument, of this argument, where a value acts upon psi in the body, or on a region of
        its boundary, beside a solid that has none.
        """
        if not self._elastic.any():
            return
        if boundary is None:
            elastic = regions.region(self.mesh, self._elastic)
            lost = ng.Integrate(ng.Norm(ng.CF(value)), self.mesh, definedon=elastic) > 0
        else:
            beside = [ng.ElementId(ng.VOL, int(number)) for number in elements_at(self.mesh, boundary)]
            lost = any(self._elastic[self.mesh[element].index] for element in beside)
        require(not lost, name, value, "acts where the solid is Elastic, which has no psi to turn")

    def by_region(self, make: Callable[[Any], Any]) -> Any:
        """Returns the function that is `make(region)` in each region of one solid."""
        functions: list[Any] = [None] * len(self.solids)
        for _, materials in regions.alike(self.solids):
            function = make(regions.region(self.mesh, materials))
            for number in np.flatnonzero(materials):
                functions[number] = function
        return ng.CF(functions)

    def once(self, key: Any, make: Callable[[], Made]) -> Made:
        """Returns what `make()` returns, made once for a key."""
        if key not in self.derived:
            self.derived[key] = make()
        return self.derived[key]

    @property
    def unknowns(self) -> int:
        """How many supports leave free."""
        return self.space.FreeDofs().NumSet()

    def unknowns_of(self, name: str) -> slice:
        """Returns the slice of the unknowns of a field."""
        unknowns = self.space.Range(self.names.index(name))
        return slice(unknowns.start, unknowns.stop)

    def boundary(self, pattern: str, argument: str = "boundary") -> Any:
        """Returns the region of the boundaries that a pattern names; raises BadArgument, of this argument,
        for no name.
        """
        return regions.named_region(
            self.mesh.Boundaries, self.mesh.GetBoundaries(), pattern, argument, "boundaries"
        )

    def scalar(self, order: int, **options: Any) -> Any:
        """Returns a scalar H1 space, periodic or of the elements' own orders as the body is."""
        if self.element_orders is None:
            # of multigrid the coarse unknowns are those of vertices
            space = ng.H1(self.mesh, order=order, wb_withedges=False, **options)
            return ng.Periodic(space) if self.periodic else space
        usual = int(np.bincount(self.element_orders).argmax())
        space = ng.H1(self.mesh, order=usual, **options)
        for kind, orders in ((ng.ELEMENT, self.element_orders), (ng.EDGE, self._edge_orders)):
            for number in np.flatnonzero(orders != usual).tolist():
                space.SetOrder(ng.NodeId(kind, number), int(orders[number]))
        space.UpdateDofTables()
        return space

    @cached_property
    def _edge_orders(self) -> Integers:
        """The larger order of the elements at each edge, array (edges,)."""
        orders: Integers = np.ones(self.mesh.nedge, int)
        for element, order in zip(self.mesh.Elements(), cast(Integers, self.element_orders)):
            edges = [edge.nr for edge in element.edges]
            orders[edges] = np.maximum(orders[edges], order)
        return orders

    @property
    def bonus(self) -> int:
        """Integration orders beyond NGSolve's: on curved elements, and of moduli that are functions, the
        energy is no polynomial of the fields' order.
        """
        bonus = 4 if self.mesh.GetCurveOrder() > 1 else 0  # energies of order 1 then err by 4e-9
        if any(solid.functions for solid in self.solids):
            bonus += self.order + 2
        return bonus

    def integrated(self, density: Any, **options: Any) -> Any:
        """Returns the integral over the body of a quadratic function of fields."""
        order = 2 * max(self.order, self.order_psi) + self.bonus
        return ng.Integrate(density, self.mesh, order=order, **options)

    def vectors(self, components: Iterable[Any]) -> tuple[Any, Any]:
        """Returns u and psi of components, with three components each."""
        parts = [ng.CF(0)] * len(FIELDS3D)
        for name, component in zip(self.names, components):
            parts[COMPONENTS[name]] = component
        return ng.CF(tuple(parts[:3])), ng.CF(tuple(parts[3:]))

    def strains(self, components: Sequence[Any], slopes: Iterable[Any] | None = None) -> tuple[Any, Any]:
        """Returns relative deformation (1) and curvature, 3 x 3, from components and their gradients, or
        others, `slopes`; derivatives that are missing are 0.
        """
        if slopes is None:
            slopes = map(ng.grad, components)
        zero = ng.CF(0)
        rows: list[tuple[Any, ...]] = [(zero,) * 3] * len(FIELDS3D)
        for name, slope in zip(self.names, slopes):
            derivatives = [slope[i] for i in range(self.mesh.dim)]
            if self.mesh.dim == 1:  # the only coordinate is x2
                derivatives.insert(0, zero)
            rows[COMPONENTS[name]] = (*derivatives, zero)[:3]
        gradient = ng.CF(sum(rows[:3], ()), dims=(3, 3))
        kappa = ng.CF(sum(rows[3:], ()), dims=(3, 3))
        return contact_term.relative_deformation(gradient, self.vectors(components)[1]), kappa

    def energy(self, *components: Any) -> Any:
        """Returns the energy density (10) as an expression."""
        return contact_term.energy(self.moduli, self.strains(components))


def free_unknowns(space: Any, condense: bool = False) -> Flags:
    """Returns which unknowns of a space are free, with `condense` those of interiors of elements apart:
    boolean array (n,). NumPy would ask a BitArray for its entries one by one.
    """
    free = space.FreeDofs(condense)
    ones = ng.BaseVector(len(free))
    ones[:] = 1.0
    ng.Projector(free, True).Project(ones)
    return np.array(ones.FV().NumPy() > 0)
