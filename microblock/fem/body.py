"""A Cosserat body on a mesh of one, two or three dimensions: its fields, energy, loads and supports."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import ngsolve as ng
import numpy as np

from .. import cost
from ..errors import BadArgument, require, require_finite, require_flag, require_kind, require_whole
from ..halfspace.symbol import require_stable
from ..model.fields import PointFields
from ..model.fields import points as at_points
from ..model.material import Cosserat, Elastic
from ..model.methods import Condensed, Newton
from ..model.results import line
from ..threads import bounded
from . import contact_term, supports
from .bulk import Bulk
from .meshes import extent, require_sound

FIELDS3D = ("u1", "u2", "u3", "psi1", "psi2", "psi3")
PLACES = {name: number for number, name in enumerate(FIELDS3D)} | {"psi": 5}  # among u and psi as vectors


def require_finite_within(**arguments):
    """BadArgument for a value, or one in sequences and mappings, that is neither a finite number nor a
    CoefficientFunction.
    """
    for name, value in arguments.items():
        if isinstance(value, (Mapping, tuple, list, np.ndarray)):
            for one in value.values() if isinstance(value, Mapping) else value:
                require_finite_within(**{name: one})
        elif not isinstance(value, ng.CoefficientFunction):
            require_finite(**{name: value})


@dataclass(frozen=True)
class Loads:
    """Dead loads of (8): numbers or CoefficientFunctions, in three dimensions three.

    Parameters
    ----------
    force : body force (f1, f2) (force per volume)
    couple : body couple l, counterclockwise (moment per volume)
    traction : {boundary: (t1, t2)} (force per area)
    micromoment : {boundary: M} (moment per area)

    Examples
    --------
    >>> from microblock.fem.body import Loads
    >>> loads = Loads(force=(0, -1), micromoment={"contact": 0.1})
    >>> loads.couple, dict(loads.traction)
    (0, {})
    """

    force: tuple = (0, 0)
    couple: object = 0
    traction: Mapping = field(default_factory=dict)
    micromoment: Mapping = field(default_factory=dict)

    def __post_init__(self):
        require_finite_within(**vars(self))

    def acting_on(self, body):
        """The forces in all unknowns of a body, array: what works on their variations in (8)."""
        more, form = {"bonus_intorder": body.order + 4}, ng.LinearForm(body.space)
        works = [("force", self.force, ng.dx(**more)), ("couple", self.couple, ng.dx(**more))]
        works += [
            (name, value, ng.ds(definedon=body.boundary(boundary), **more))
            for name in ("traction", "micromoment")
            for boundary, value in getattr(self, name).items()
        ]
        varied = body.vectors(body.space.TestFunction())
        for name, value, measure in works:
            turns = name in ("couple", "micromoment")
            load = _in_space(name, value, turns, body.mesh.dim)
            if load is not None:
                words = "turns nothing: the body has no psi, as its solid is classical"
                require(body.rotates or not turns, name, value, words)
                form += ng.InnerProduct(ng.CF(load), varied[turns]) * measure
        return form.Assemble().vec.FV().NumPy().copy()


class Body:
    """A linear Cosserat body: mesh, material, spaces and supports.

    In three dimensions its contact boundary is horizontal (normal e3), of quadrilaterals or of triangles of
    order 1. Obstacles are those over a surface, or any ``height(x1, x2)``, counted from x3 = 0.

    Parameters
    ----------
    mesh : ngsolve.Mesh
        Of triangles and quadrilaterals, a 1D mesh of the depth x2 (`meshes.line`), or one in three dimensions
        (`microblock.fem.meshes3d.block`). Geometries have tolerances of 1e-7 in their unit of length.
    solid : Cosserat
    order : int or array (elements,) of int
        Polynomial order of u; one for each element is that of all fields, on edges the larger one.
    order_psi : int, optional
        That of psi; without it that of u. A classical solid, `Elastic`, has no psi, and 0 takes it from a
        `Cosserat` with beta = 0: it is 0 everywhere, no unknown, and what `fixed` says of it is passed over.
    fixed : str or mapping
        Boundaries (NGSolve's patterns) on which all fields are 0, or {field: boundaries}. Fields are u1, u2
        and psi, in three dimensions u1, u2, u3, psi1, psi2 and psi3.
    prescribed : {field: {boundary: value}}, optional
        Values of fields, numbers or CoefficientFunctions.
    periodic : bool
        Whether fields are identified where the mesh is.
    contact : str
        Boundary that an obstacle may touch.

    Raises
    ------
    BadArgument
        If an argument is out of range, a boundary is unknown, prescribed values differ at identified points,
        or the mesh is not sound; in three dimensions also if the solid lets short waves of a free surface
        turn by themselves.

    Examples
    --------
    >>> from microblock.fem import meshes
    >>> from microblock.fem.body import Loads
    >>> mesh = meshes.uniform(meshes.Ground(far=2.0, reach=(-1.0, 1.0), half=False), 0.5)
    >>> body = mb.Body(mesh, mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1), order=2, fixed="bottom")
    >>> fields = body.solve(Loads(traction={"contact": (0, -1)}))
    >>> fields.u2(mesh(0.1, -0.1)) < 0
    True
    >>> body
    <Cosserat body: 32 elements in 2D, order 2, 408 unknowns>

    A quarter of a block in space, between two planes of symmetry:

    >>> from microblock.fem import meshes3d
    >>> x = meshes3d.graded(reach=0.6, step=0.15, far=3.0, growth=2.0)
    >>> mesh = meshes3d.block(x, x, -x[::-1], reach=0.6)
    >>> fixed = meshes3d.supports("bottom", x1="left", x2="front")
    >>> body = mb.Body(mesh, mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1), order=1, fixed=fixed)
    >>> state = mb.Contact(body, mb.Sphere(R=10), mb.Microblock()).solve(load=0.25)   # of the quarter
    >>> round(float(state.weights @ state.pressure), 9), state.approach > 0
    (0.25, True)
    """

    def __init__(
        self,
        mesh,
        solid: Cosserat,
        order=2,
        *,
        order_psi=None,
        fixed=(),
        prescribed=None,
        periodic=False,
        contact="contact",
    ):
        require_sound(mesh)
        require_kind(Cosserat, "a Cosserat", solid=solid)
        if mesh.dim == 3 and not solid.is_classical:  # else psi has nothing to do with u
            require_stable(solid)
        require_kind(str, "the name of a boundary", contact=contact)
        require_kind((Mapping, type(None)), "{field: {boundary: value}}", prescribed=prescribed)
        require_flag(periodic=periodic)
        if not solid.has_length:
            solid = solid.with_length(extent(mesh))
        self.mesh, self.solid, self.periodic, self.contact = mesh, solid, periodic, contact
        self.element_orders = None if isinstance(order, int | np.integer) else self._graded(order, order_psi)
        self.order = order if self.element_orders is None else int(self.element_orders.max())
        self.order_psi = self.order if order_psi is None else order_psi
        require_whole(1, order=self.order)
        require_whole(0 if solid.is_classical else 1, order_psi=self.order_psi)
        self.rotates = self.order_psi > 0 and not isinstance(solid, Elastic)
        self.order_psi *= self.rotates
        self.all_names = FIELDS3D if mesh.dim == 3 else ("u1", "u2", "psi")
        self.names = tuple(name for name in self.all_names if self.rotates or name[0] == "u")
        self.prescribed = dict(prescribed or {})
        require_finite_within(prescribed=self.prescribed)
        known = supports.patterns(self, fixed)
        self.fixed = {name: pattern for name, pattern in known.items() if name in self.names}
        self._made_of = {
            "mesh": mesh,
            "solid": solid,
            "order": order,
            "order_psi": order_psi,
            "fixed": known,
            "prescribed": self.prescribed,
            "periodic": periodic,
            "contact": contact,
        }
        self.spaces = [
            self.scalar(self.order if name[0] == "u" else self.order_psi, dirichlet=self.fixed.get(name, ""))
            for name in self.names
        ]
        self.space = ng.ProductSpace(*self.spaces)
        supports.require_periodic(self)
        if contact != "contact":
            self.boundary(contact, "contact")
        self.derived: dict = {}  # what costs a factorisation, see `once`

    def __reduce__(self):
        """A copy is made anew: NGSolve loses orders of single elements."""
        return _body_anew, (self._made_of, self.mesh.GetCurveOrder())

    def of(self, solid):
        """The same body of another solid; of the same one itself."""
        require_kind(Cosserat, "a Cosserat", solid=solid)
        return self if solid == self.solid else self.on(self.mesh, solid=solid)

    @property
    def in_space(self):
        return self.mesh.dim == 3

    def once(self, key, make):
        """What `make()` returns, made once for a key."""
        if key not in self.derived:
            self.derived[key] = make()
        return self.derived[key]

    def __repr__(self):
        kinds = f"in {self.mesh.dim}D" + ", periodic" * self.periodic
        order = f"{self.order} at most" if self.element_orders is not None else str(self.order)
        order += f", psi {self.order_psi}" if self.rotates and self.order_psi != self.order else ""
        return line(
            "Cosserat body", f"{self.mesh.ne} elements {kinds}, order {order}, {self.unknowns} unknowns"
        )

    @property
    def unknowns(self):
        """How many supports leave free."""
        return self.space.FreeDofs().NumSet()

    def boundary(self, pattern, argument="boundary"):
        """The region of the boundaries that a pattern names; BadArgument, of this argument, for no name."""
        names = sorted(set(self.mesh.GetBoundaries()))
        require(
            isinstance(pattern, str), argument, pattern, f"must be a name or pattern of {', '.join(names)}"
        )
        try:
            region = self.mesh.Boundaries(pattern)
        except RuntimeError as failure:
            raise BadArgument(argument, pattern, f"is no regular expression: {failure}") from failure
        missing = [name for name in pattern.split("|") if name.isidentifier() and name not in names]
        if missing or not any(region.Mask()):
            which = "" if missing in ([], [pattern]) else f"{', '.join(missing)} "
            words = f"{which}is none of the mesh's boundaries, {', '.join(names)}"
            raise BadArgument(argument, pattern, words)
        return region

    @property
    def bonus(self):
        """Integration orders beyond NGSolve's: on curved elements the energy is no polynomial."""
        return 4 if self.mesh.GetCurveOrder() > 1 else 0  # energies of order 1 then err by 4e-9

    def integrated(self, density, **options):
        """The integral over the body of a quadratic function of fields."""
        order = 2 * max(self.order, self.order_psi) + self.bonus
        return ng.Integrate(density, self.mesh, order=order, **options)

    def on(self, mesh, **changes):
        """The same body on another mesh, or with other arguments; BadArgument for another mesh where orders
        are those of single elements.
        """
        require(
            self.element_orders is None or mesh is self.mesh,
            "order",
            "one for each element",
            "belongs to one mesh: give one order for all elements",
        )
        return Body(**self._made_of | {"mesh": mesh} | changes)

    @property
    def methods(self):
        """Methods that solve on it, the usual one first."""
        alone = self.mesh.dim == 1 or (self.mesh.dim == 2 and self.periodic)
        return (Newton,) if alone else (Condensed, Newton)

    @property
    def solvers(self):
        """{method: where its solver is}, where not the plane's."""
        solvers = {Condensed: "fem.solver3d.Solver3D", Newton: "fem.newton_solver.NewtonSolver3D"}
        return solvers if self.in_space else {}

    def unknowns_of(self, name):
        """Slice of the unknowns of a field."""
        own = self.space.Range(self.names.index(name))
        return slice(own.start, own.stop)

    def scalar(self, order, **options):
        """A scalar H1 space, periodic or of the elements' own orders as the body is."""
        if self.element_orders is None:
            space = ng.H1(self.mesh, order=order, **options)
            return ng.Periodic(space) if self.periodic else space
        usual = int(np.bincount(self.element_orders).argmax())
        space = ng.H1(self.mesh, order=usual, **options)
        for kind, orders in ((ng.ELEMENT, self.element_orders), (ng.EDGE, self._edge_orders)):
            for number in np.flatnonzero(orders != usual).tolist():
                space.SetOrder(ng.NodeId(kind, number), int(orders[number]))
        space.UpdateDofTables()
        return space

    def _graded(self, orders, order_psi):
        """Orders of the elements, checked; those of the edges follow."""
        orders = np.asarray(orders)
        whole = orders.shape == (self.mesh.ne,) and orders.dtype.kind == "i" and orders.min() >= 1
        require(
            whole and not order_psi and not self.periodic and self.mesh.dim == 2,
            "order",
            orders,
            f"must be an integer of at least 1, or {self.mesh.ne} of them, one an element: orders of "
            "single elements are for 2D bodies that are not periodic, and for all fields at once",
        )
        self._edge_orders = np.ones(self.mesh.nedge, int)
        for element, own in zip(self.mesh.Elements(), orders):
            numbers = [edge.nr for edge in element.edges]
            self._edge_orders[numbers] = np.maximum(self._edge_orders[numbers], own)
        return orders

    def vectors(self, components):
        """u and psi of components, with three components each."""
        parts = [ng.CF(0)] * len(FIELDS3D)
        for name, component in zip(self.names, components):
            parts[PLACES[name]] = component
        return ng.CF(tuple(parts[:3])), ng.CF(tuple(parts[3:]))

    def strains(self, components, slopes=None):
        """Relative deformation (1) and curvature, 3 x 3, from components and their gradients, or others,
        `slopes`; derivatives that are missing are 0.
        """
        dim, zero = self.mesh.dim, ng.CF(0)
        rows = [(zero,) * 3] * len(FIELDS3D)
        for name, slope in zip(self.names, map(ng.grad, components) if slopes is None else slopes):
            own = [zero] * (dim == 1) + [slope[i] for i in range(dim)]  # in 1D the only coordinate is x2
            rows[PLACES[name]] = (*own, zero)[:3]
        gradient, kappa = (ng.CF(sum(part, ()), dims=(3, 3)) for part in (rows[:3], rows[3:]))
        return contact_term.relative_deformation(gradient, self.vectors(components)[1]), kappa

    def energy(self, *components):
        """Energy density (10) as an expression."""
        return contact_term.energy(self.solid, self.strains(components))

    def bulk(self, space=None, **options):
        """The assembled second variation of (10), on the space of the body or a product."""
        space = self.space if space is None else space
        trial, test = space.TnT()
        strains, varied = (self.strains(components[: len(self.names)]) for components in (trial, test))
        form = ng.BilinearForm(space, **options)
        for work in contact_term.virtual_work(self.solid, strains, varied):  # two are quicker than their sum
            form += work * ng.dx(bonus_intorder=self.bonus)
        return form.Assemble()

    @bounded
    def solve(self, loads=Loads()):
        """Equilibrium without contact, as Fields.

        Raises
        ------
        NotConverged
            If the supports leave a rigid motion free.
        """
        require_kind(Loads, "Loads", loads=loads)
        advice, matrix = "take longer elements or a lower order", self.bulk(symmetric=True)
        what = f"factors of the bulk, {self.space.ndof} unknowns,"
        cost.require_room(cost.of_factors(self.space.ndof, matrix.mat.nze), what, advice)
        bulk, state = Bulk(matrix, [], advice), ng.GridFunction(self.space)
        supports.prescribe(self, state.components)
        prescribed = state.vec.FV().NumPy().copy()
        exerted = bulk.solve(loads.acting_on(self) - bulk.matrix @ prescribed, state)
        state.vec.FV().NumPy()[:] += prescribed
        return Fields(self, state.components, exerted)


def _in_space(name, value, turns, dim):
    """The three components of a load; None of one that is 0. `turns` if it works on psi."""
    parts = tuple(value) if np.iterable(value) else (value,)
    if all(isinstance(part, (int, float)) and part == 0 for part in parts):
        return None
    count = 3 if dim == 3 else 1 if turns else 2
    require(
        len(parts) == count,
        name,
        value,
        f"must have {count} component{'s' * (count > 1)} on a body in {dim}D",
    )
    return (0, 0, *parts) if count == 1 else (*parts, 0)[:3]


class Reaction(NamedTuple):
    """Force (f1, f2) and moment about the origin, counterclockwise, that supports exert on a body per
    thickness (in 1D per area); in three dimensions arrays (3,).
    """

    force: np.ndarray
    moment: float | np.ndarray


class Fields:
    """The fields of a state, as NGSolve functions: u1, u2, psi; in three dimensions u1, u2, u3, psi1,
    psi2, psi3 and the vectors u and psi.

    On a boundary stresses are those of the element beside it; `reaction` balances the loads to rounding.

    Parameters
    ----------
    body : Body
    components : grid functions of the fields
    forces : array (unknowns,), what supports exert
    mirrored : whether they are the half x1 > 0 of a symmetric state

    Examples
    --------
    >>> from microblock.fem import meshes
    >>> from microblock.fem.body import Loads
    >>> body = mb.Body(meshes.column(depth=1.0, elements=2),
    ...                mb.Cosserat(E=2.6, nu=0.3, ell=0.2, beta=1), order=4,
    ...                fixed={"u1": "middle", "u2": "middle"}, periodic=True)
    >>> fields = body.solve(Loads(traction={"contact": (0, -1)}))
    >>> import ngsolve as ng
    >>> round(ng.Integrate(fields.stress[1, 1], body.mesh, definedon=body.mesh.Boundaries("middle")), 9)
    -0.5
    >>> force, moment = fields.reaction("middle")
    >>> round(float(force[1]), 9)
    0.5
    """

    def __init__(self, body, components, forces, mirrored=False):
        self.body, self.components = body, tuple(components)[: len(body.names)]
        self.forces, self.mirrored = forces, mirrored
        self.psi = ng.CF(0)  # without it
        for name, component in zip(body.names, self.components):
            setattr(self, name, component)
        if body.in_space:
            self.u, self.psi = body.vectors(self.components)

    def __iter__(self):
        return iter(self.components)

    def __reduce__(self):
        """A copy has its values on a body made anew."""
        numbers = dofs_by_element(self.body)
        return _fields_anew, (self.body, self.values[numbers], self.forces[numbers], self.mirrored)

    @property
    def values(self):
        return np.concatenate([part.vec.FV().NumPy() for part in self])

    def __call__(self, x1, x2):
        """The PointFields at points, arrays (n,) or numbers; BadArgument for a point outside of the body."""
        require(
            not self.body.in_space,
            "body",
            self.body,
            "lies in space: take fields.u, fields.stress, ... there",
        )
        x1, x2, shape = at_points(x1, x2)
        sign = np.where(self.mirrored & (x1 < 0), -1.0, 1.0)
        try:
            points = self.body.mesh(sign * x1, x2)
            values = ng.CF((self.u1, self.u2, self.psi, self.stress, self.couple_stress))(points).T
        except Exception as failure:  # NGSolve's own; it does not say which point
            raise BadArgument("x1, x2", (x1, x2), f"must lie in the body ({failure})") from failure
        odd = np.array([1, 0, 1, 0, 1, 1, 0, 0, 1], bool)[:, None]
        u1, u2, psi, *stress, m1, m2 = np.where(odd, sign, 1.0) * values
        stress = np.reshape(stress, (2, 2, -1))
        return PointFields(x1, x2, psi, np.array((u1, u2)), stress, np.array((m1, m2))).shaped(shape)

    @property
    def stress(self):
        """Force stress (16), 2x2, in three dimensions 3x3."""
        sigma = contact_term.stress(self.body.solid, self.body.strains(self)[0])
        if not self.body.in_space:
            sigma = ng.CF((sigma[0, 0], sigma[0, 1], sigma[1, 0], sigma[1, 1]), dims=(2, 2))
        return ng.BoundaryFromVolumeCF(sigma)  # else gradients are 0 there, in silence

    @property
    def couple_stress(self):
        """Couple stress, (m1, m2), in three dimensions 3x3."""
        m = contact_term.couple_stress(self.body.solid, self.body.strains(self)[1])
        return ng.BoundaryFromVolumeCF(m if self.body.in_space else ng.CF((m[2, 0], m[2, 1])))

    def reaction(self, boundary):
        """The Reaction of the supports on a boundary, from nodal forces.

        All supports together balance loads and contact. What is exerted where two boundaries meet is part of
        both: name them together, "bottom|side". In 1D and of a periodic body f2 has no arm.

        Raises
        ------
        BadArgument
            For a boundary on which nothing is supported.
        """
        body, region = self.body, self.body.boundary(boundary)
        held = supports.held_on(body, boundary)
        require(
            held,
            "boundary",
            boundary,
            "is supported in no field, so that no support exerts anything "
            "there; supported are "
            + (", ".join(f"{name} on {pattern}" for name, pattern in body.fixed.items()) or "none"),
        )
        axes, place, work = [ng.CF(tuple(map(float, axis))) for axis in np.eye(3)], self._place(), np.zeros(6)
        motions = [ng.CF((axis, 0 * axis)) for axis in axes]
        motions += [ng.CF((ng.Cross(axis, place), axis)) for axis in axes]
        for name in held:
            forces, part = self.forces[body.unknowns_of(name)], region * body.boundary(body.fixed[name])
            values = [supports.values_on(body, part, name, motion[PLACES[name]]) for motion in motions]
            work += np.array(values) @ forces
        return Reaction(work[:3], work[3:]) if body.in_space else Reaction(work[:2], float(work[5]))

    def _place(self):
        """The place, for moments: along a period forces have no arm."""
        dim, repeated = self.body.mesh.dim, self.body.periodic
        if dim == 1:
            return ng.CF((0, ng.x, 0))
        return ng.CF((0 if repeated else ng.x, 0 if repeated and dim == 3 else ng.y, ng.z if dim == 3 else 0))

    def energy(self):
        """Elastic energy of the whole body (in 1D: per area)."""
        return (1 + self.mirrored) * self.body.integrated(self.body.energy(*self))


def _body_anew(arguments, curve_order):
    """A body in a copy: NGSolve mixes up curves of a refined mesh."""
    if curve_order > 1:
        arguments["mesh"].Curve(curve_order)
    return Body(**arguments)


def _fields_anew(body, values, forces, mirrored):
    """The Fields of values and forces, element by element."""
    state, exerted, numbers = ng.GridFunction(body.space), np.zeros(body.space.ndof), dofs_by_element(body)
    state.vec.FV().NumPy()[numbers], exerted[numbers] = values, forces
    return Fields(body, state.components, exerted, mirrored)


def dofs_by_element(body):
    """Unknowns, element by element: a copied mesh keeps the order of elements, not of edges."""
    return np.concatenate([body.space.GetDofNrs(element) for element in body.space.Elements()])
