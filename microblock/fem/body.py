"""A Cosserat body on a mesh of one, two or three dimensions: its fields, energy, loads and supports."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import reduce
from operator import mul
from typing import NamedTuple

import ngsolve as ng
import numpy as np

from .. import cost
from ..errors import BadArgument, require_finite, require_flag, require_kind, require_whole
from ..halfspace.obstacles import heights
from ..halfspace.symbol import require_stable
from ..model.fields import PointFields
from ..model.fields import points as at_points
from ..model.material import Cosserat
from ..model.methods import Condensed, Newton
from ..model.summary import Row, Shown, Summary
from ..threads import bounded
from . import contact_term
from .bulk import Bulk
from .meshes import require_sound

FIELDS3D = ("u1", "u2", "u3", "psi1", "psi2", "psi3")
PLACES = {name: number for number, name in enumerate(FIELDS3D)} | {"psi": 5}  # among u and psi as vectors


def require_finite_within(**arguments):
    """BadArgument for a value, or one in sequences and mappings of them, that is no finite number and no
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
    """Dead loads of (8); every value a number or an NGSolve CoefficientFunction, in three dimensions three.

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


class Body(Shown):
    """A linear Cosserat body: mesh, material, spaces and supports.

    In three dimensions its contact boundary is horizontal (normal e3, at one height or several), of
    quadrilaterals of any order or of triangles of order 1. Obstacles are those over a surface, `Sphere`
    and the like, or any ``height(x1, x2)``, counted from x3 = 0.

    Parameters
    ----------
    mesh : ngsolve.Mesh
        Of triangles and quadrilaterals, a 1D mesh of the depth x2 (`meshes.line`), or one in three dimensions
        (`microblock.fem.meshes3d.block`). The kernel of geometries has tolerances of 1e-7 in its unit of
        length: draw a body of 1e-9 m in nanometres.
    solid : Cosserat
    order : int or array (elements,) of int
        Polynomial order of u. With one for each element all fields have it, edges the larger one of their
        neighbours.
    order_psi : int, optional
        Polynomial order of psi; without it that of u.
    fixed : str or mapping
        Boundaries on which all fields are 0, or {field: boundaries}; names as NGSolve's patterns. Fields are
        u1, u2 and psi, in three dimensions u1, u2, u3, psi1, psi2 and psi3.
    prescribed : {field: {boundary: value}}, optional
        Boundaries on which a field has this value (a number or CoefficientFunction).
    periodic : bool
        Whether the fields are identified on boundaries that the mesh identifies.
    contact : str
        Name or pattern of the boundary that an obstacle may touch.

    Raises
    ------
    BadArgument
        If an argument is out of range, a boundary is unknown, prescribed values differ at identified points,
        or the mesh is not sound (`meshes.require_sound`); in three dimensions also if the solid lets short
        waves of a free surface turn by themselves.

    Examples
    --------
    >>> from microblock.fem import meshes
    >>> from microblock.fem.body import Loads
    >>> mesh = meshes.uniform(meshes.Ground(far=2.0, reach=(-1.0, 1.0), half=False), 0.5)
    >>> body = mb.Body(mesh, mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1), order=2, fixed="bottom")
    >>> fields = body.solve(Loads(traction={"contact": (0, -1)}))
    >>> fields.u2(mesh(0.1, -0.1)) < 0
    True
    >>> body                                  # in a notebook a table, with the moduli
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
        if mesh.dim == 3:
            self.check = require_heights
            if solid.beta > 0:  # else psi has nothing to do with u
                require_stable(solid)
        require_kind(str, "the name of a boundary", contact=contact)
        require_kind((Mapping, type(None)), "{field: {boundary: value}}", prescribed=prescribed)
        require_flag(periodic=periodic)
        self.mesh, self.solid, self.periodic, self.contact = mesh, solid, periodic, contact
        self.element_orders = None if isinstance(order, int | np.integer) else self._graded(order, order_psi)
        order = order if self.element_orders is None else int(self.element_orders.max())
        require_whole(1, order=order)
        require_whole(1, order_psi=order if order_psi is None else order_psi)
        self.order, self.order_psi = order, order if order_psi is None else order_psi
        self.names = FIELDS3D if mesh.dim == 3 else ("u1", "u2", "psi")
        self.prescribed = dict(prescribed or {})
        require_finite_within(prescribed=self.prescribed)
        self.fixed = self._patterns(fixed)
        self.spaces = [
            self.scalar(order if name[0] == "u" else self.order_psi, dirichlet=self.fixed.get(name, ""))
            for name in self.names
        ]
        self.space = reduce(mul, self.spaces)
        self._require_periodic_values()
        if contact != "contact":
            self.boundary(contact, "contact")
        self.derived: dict = {}  # what costs a factorisation, see `once`

    def __reduce__(self):
        """A copy, or what comes out of a file, is made anew: NGSolve loses orders of single elements."""
        return _body_anew, (self._made_of, self.mesh.GetCurveOrder())

    def of(self, solid):
        """The same body of another solid; the same one is not factorised again."""
        require_kind(Cosserat, "a Cosserat", solid=solid)
        return self if solid == self.solid else self.on(self.mesh, solid=solid)

    def once(self, key, make):
        """What `make()` returns, made once for a key."""
        if key not in self.derived:
            self.derived[key] = make()
        return self.derived[key]

    def summary(self):
        """Elements, orders, unknowns, supports and moduli, for a notebook."""
        kinds = f"in {self.mesh.dim}D" + ", periodic" * self.periodic
        order = f"{self.order} at most" if self.element_orders is not None else str(self.order)
        order += f", psi {self.order_psi}" if self.order_psi != self.order else ""
        free = self.space.FreeDofs().NumSet()
        supports = [
            Row(f"{name} constrained", "", pattern.replace("|", ", "), "boundaries")
            for name, pattern in self.fixed.items()
        ]
        rows = (
            Row("elements", "", self.mesh.ne, kinds),
            Row("order", "", order),
            Row("unknowns", "", free, "free"),
            *(supports or [Row("constrained", "", "nowhere")]),
            *self.solid.summary().rows,
        )
        return Summary(
            "Cosserat body", f"{self.mesh.ne} elements {kinds}, order {order}, {free} unknowns", rows
        )

    def _patterns(self, fixed):
        """{field: pattern of all boundaries where it is fixed or prescribed}."""
        if not isinstance(fixed, (str, Mapping)) and not (isinstance(fixed, tuple) and not fixed):
            raise BadArgument("fixed", fixed, 'must be boundaries, "left|bottom", or {field: boundaries}')
        patterns = (
            {name: [fixed] for name in self.names}
            if isinstance(fixed, str)
            else {name: [pattern] for name, pattern in dict(fixed).items()}
        )
        for name, values in self.prescribed.items():
            patterns.setdefault(name, []).extend(values)
        for name, named in patterns.items():
            if name not in self.names:
                raise BadArgument("field", name, f"fields are {', '.join(self.names)}")
            for pattern in named:
                self.boundary(pattern, "prescribed" if pattern in self.prescribed.get(name, ()) else "fixed")
        return {name: "|".join(named) for name, named in patterns.items()}

    def require_held(self):
        """BadArgument where a displacement is fixed or prescribed nowhere."""
        for name in self.names:
            if name.startswith("u") and name not in self.fixed:
                raise BadArgument(
                    "fixed",
                    self.fixed,
                    f"must hold the body: {name} is not fixed on any boundary, and nothing else stops it",
                )

    def boundary(self, pattern, argument="boundary"):
        """The region of the boundaries that a pattern names; BadArgument, of this argument, for a name of
        none.
        """
        names = sorted(set(self.mesh.GetBoundaries()))
        if not isinstance(pattern, str):
            raise BadArgument(argument, pattern, f"must be a name or pattern of {', '.join(names)}")
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
        """The integral over the body of a quadratic function of fields, by the rule of `dx`."""
        order = 2 * max(self.order, self.order_psi) + self.bonus
        return ng.Integrate(density, self.mesh, order=order, **options)

    @property
    def _made_of(self):
        """Its arguments by name."""
        graded = self.element_orders is not None
        return {
            "mesh": self.mesh,
            "solid": self.solid,
            "order": self.element_orders if graded else self.order,
            "order_psi": None if graded else self.order_psi,
            "fixed": self.fixed,
            "prescribed": self.prescribed,
            "periodic": self.periodic,
            "contact": self.contact,
        }

    def on(self, mesh, fixed=None, solid=None):
        """The same body on another mesh of its geometry, with other supports or of another solid.

        Only a body with one order for all elements goes to another mesh.
        """
        if self.element_orders is not None and mesh is not self.mesh:
            raise BadArgument(
                "order", "one for each element", "belongs to one mesh: give one order for all elements"
            )
        fixed, solid = (self.fixed if fixed is None else fixed), (self.solid if solid is None else solid)
        return Body(**self._made_of | {"mesh": mesh, "fixed": fixed, "solid": solid})

    @property
    def methods(self):
        """The methods that solve on it, the usual one first."""
        alone = self.mesh.dim == 1 or (self.mesh.dim == 2 and self.periodic)
        return (Newton,) if alone else (Condensed, Newton)

    @property
    def solvers(self):
        """{method: where its solver is}, of those that differ from the plane's."""
        solvers = {Condensed: "fem.solver3d.Solver3D", Newton: "fem.newton_solver.NewtonSolver3D"}
        return solvers if self.mesh.dim == 3 else {}

    def unknowns_of(self, name):
        """Slice of the unknowns of a field."""
        own = self.space.Range(self.names.index(name))
        return slice(own.start, own.stop)

    def scalar(self, order, **options):
        """A scalar H1 space of this body, periodic or of the elements' own orders where the body is."""
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
        """Orders of the elements, checked; those of the edges follow from them."""
        orders = np.asarray(orders)
        if orders.shape != (self.mesh.ne,) or orders.dtype.kind != "i" or orders.min() < 1:
            raise BadArgument(
                "order",
                orders,
                f"must be an integer of at least 1, or {self.mesh.ne} of them, one an element",
            )
        if order_psi is not None or self.periodic or self.mesh.dim != 2:
            raise BadArgument(
                "order",
                orders,
                "orders of single elements are for 2D bodies that are not periodic, "
                "and for all fields at once",
            )
        self._edge_orders = np.ones(self.mesh.nedge, int)
        for element, own in zip(self.mesh.Elements(), orders):
            numbers = [edge.nr for edge in element.edges]
            self._edge_orders[numbers] = np.maximum(self._edge_orders[numbers], own)
        return orders

    def held_on(self, boundary):
        """The fields that supports hold or prescribe on a part of a boundary at least."""
        mask = self.boundary(boundary).Mask()
        return [name for name, pattern in self.fixed.items() if any(self.boundary(pattern).Mask() & mask)]

    def pressed(self, boundary):
        """The region of a contact boundary; in the plane BadArgument where supports hold u2 there."""
        region = self.boundary(boundary, "contact" if boundary == self.contact else "boundary")
        if self.mesh.dim < 3 and "u2" in self.held_on(boundary):
            raise BadArgument(
                "boundary",
                boundary,
                f"is constrained in u2 by the supports on {self.fixed['u2']}: "
                "an obstacle cannot press what cannot move; constrain other boundaries, or psi alone",
            )
        return region

    def prescribe(self, components):
        """Set the prescribed values in the grid functions of u1, u2, psi."""
        for name, values in self.prescribed.items():
            region = self.boundary("|".join(values))
            self.set_on(region, components[self.names.index(name)], self.mesh.BoundaryCF(dict(values)))

    def set_on(self, region, component, value):
        """Set a component of a grid function of the body on a region of its boundary.

        Where elements are as wide as the period NGSolve counts an unknown twice: what 1 becomes is its share.
        """
        component.Set(value, definedon=region)
        if self.periodic:
            share = ng.GridFunction(component.space)
            share.Set(1, definedon=region)
            shares = share.vec.FV().NumPy()
            ends = np.abs(shares) > 0.25  # not the rounding of an edge's unknowns
            component.vec.FV().NumPy()[ends] /= shares[ends]

    def values_on(self, region, name, value):
        """Coefficients of a function in the space of a field on a region of the boundary, 0 elsewhere."""
        function = ng.GridFunction(self.spaces[self.names.index(name)])
        self.set_on(region, function, value)
        return function.vec.FV().NumPy().copy()

    def _require_periodic_values(self):
        """BadArgument where prescribed values differ at points that the mesh identifies."""
        for name, values in self.prescribed.items() if self.periodic else ():
            space, value, found = self.spaces[self.names.index(name)], self.mesh.BoundaryCF(dict(values)), {}
            for facet in self.boundary("|".join(values)).Elements():
                transformation = self.mesh.GetTrafo(facet)
                for vertex, dof, xi in zip(facet.vertices, space.GetDofNrs(facet), (1.0, 0.0)):
                    found.setdefault(dof, {}).setdefault(vertex.nr, value(transformation(xi)))
            largest = max(abs(one) for own in found.values() for one in own.values())
            if any(np.ptp(list(own.values())) > 1e-9 * largest for own in found.values()):
                raise BadArgument(
                    "prescribed",
                    self.prescribed,
                    f"must have the same {name} at points that the mesh identifies",
                )

    def vectors(self, components):
        """u and psi of components (trial or grid functions), with three components each."""
        parts = [ng.CF(0)] * len(FIELDS3D)
        for name, component in zip(self.names, components):
            parts[PLACES[name]] = component
        return ng.CF(tuple(parts[:3])), ng.CF(tuple(parts[3:]))

    def strains(self, components):
        """Relative deformation (1) and curvature, 3 x 3; derivatives that a dimension does not have are 0."""
        dim, zero = self.mesh.dim, ng.CF(0)
        rows = [(zero,) * 3] * len(FIELDS3D)
        for name, component in zip(self.names, components):
            slope = ng.grad(component)
            own = [zero] * (dim == 1) + [slope[i] for i in range(dim)]  # in 1D the only coordinate is x2
            rows[PLACES[name]] = (*own, zero)[:3]
        gradient, kappa = (ng.CF(sum(part, ()), dims=(3, 3)) for part in (rows[:3], rows[3:]))
        return contact_term.relative_deformation(gradient, self.vectors(components)[1]), kappa

    def energy(self, *components):
        """Energy density (10) as an expression."""
        return contact_term.energy(self.solid, self.strains(components))

    def acting(self, loads=Loads()):
        """The forces of loads in all unknowns, array: what works on their variations in (8)."""
        more, form = {"bonus_intorder": self.order + 4}, ng.LinearForm(self.space)
        works = [("force", loads.force, ng.dx(**more)), ("couple", loads.couple, ng.dx(**more))]
        for name in ("traction", "micromoment"):
            for boundary, value in getattr(loads, name).items():
                works.append((name, value, ng.ds(definedon=self.boundary(boundary), **more)))
        varied = self.vectors(self.space.TestFunction())
        for name, value, measure in works:
            turns = name in ("couple", "micromoment")
            load = self._load(name, value, turns)
            if load is not None:
                form += ng.InnerProduct(ng.CF(load), varied[turns]) * measure
        return form.Assemble().vec.FV().NumPy().copy()

    def _load(self, name, value, turns):
        """The three components of a load; None of one that is 0. `turns` if it works on psi."""
        parts = tuple(value) if np.iterable(value) else (value,)
        if all(isinstance(part, (int, float)) and part == 0 for part in parts):
            return None
        count = 3 if self.mesh.dim == 3 else 1 if turns else 2
        if len(parts) != count:
            words = f"must have {count} component{'s' * (count > 1)} on a body in {self.mesh.dim}D"
            raise BadArgument(name, value, words)
        return (0, 0, *parts) if count == 1 else (*parts, 0)[:3]

    def bulk(self, space=None, nodes=None, **options):
        """The bilinear form of the second variation of (10), assembled, on the space of the body or a
        product of it and others. With contact nodes its matrix has places for all that these and the last
        unknown couple.
        """
        trial, test = (self.space if space is None else space).TnT()
        strains, varied = (self.strains(components[: len(self.names)]) for components in (trial, test))
        form = ng.BilinearForm(self.space if space is None else space, **options)
        form += contact_term.virtual_work(self.solid, strains, varied).Compile() * self.dx
        if nodes is not None:
            form += nodes.integral(ng.Parameter(0.0) * trial[-1] * test[-1])
        form.Assemble()
        return form

    @property
    def dx(self):
        """The integral over the body, in forms."""
        return ng.dx(bonus_intorder=self.bonus)

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
        self.prescribe(state.components)
        prescribed = state.vec.FV().NumPy().copy()
        exerted = bulk.solve(self.acting(loads) - bulk.matrix @ prescribed, state)
        state.vec.FV().NumPy()[:] += prescribed
        return Fields(self, state.components, exerted)


def require_heights(obstacle):
    """BadArgument unless the obstacle has heights over a surface."""
    heights(obstacle, np.zeros(2), np.zeros(2))


class Reaction(NamedTuple):
    """What supports exert on a body per thickness (in 1D per area): force (f1, f2) and moment about the
    origin, counterclockwise, of force and couple stress together; in three dimensions arrays (3,).
    """

    force: np.ndarray
    moment: float | np.ndarray


class Fields:
    """The fields of a state, as NGSolve functions: u1, u2, psi; in three dimensions u1, u2, u3, psi1,
    psi2, psi3 and the vectors u and psi.

    On a boundary stresses are read from the element beside it (NGSolve's BoundaryFromVolumeCF; derivatives of
    your own need it), and are as good there as the mesh; `reaction` balances the loads to rounding.

    Parameters
    ----------
    body : Body
    components : grid functions of the fields
    forces : array (unknowns of the body,), internal forces less the loads: what supports exert

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
    >>> force, moment = fields.reaction("middle")   # of the support; the column is 0.5 wide
    >>> round(float(force[1]), 9)
    0.5
    """

    mirrored = False  # whether they are the half x1 > 0 of a symmetric state

    def __init__(self, body, components, forces=None):
        self.body, self.components, self.forces = body, tuple(components)[: len(body.names)], forces
        for name, component in zip(body.names, self.components):
            setattr(self, name, component)
        if body.mesh.dim == 3:
            self.u, self.psi = body.vectors(self.components)

    def __iter__(self):
        return iter(self.components)

    def __reduce__(self):
        """A copy, or what comes out of a file, has its values on a body made anew."""
        numbers = dofs_by_element(self.body)
        forces = None if self.forces is None else self.forces[numbers]
        return _fields_anew, (type(self), self.body, self.values[numbers], forces, self.mirrored)

    @property
    def values(self):
        """Of all unknowns of the body, array."""
        return np.concatenate([part.vec.FV().NumPy() for part in self])

    def unfolded(self):
        """The same fields of the half x1 > 0 of a symmetric body, with values at points of the whole one."""
        found = Fields(self.body, tuple(self), self.forces)
        found.mirrored = True
        return found

    def __call__(self, x1, x2):
        """The PointFields at points of the body, arrays (n,) or numbers.

        Raises
        ------
        BadArgument
            For a point outside of the body.
        """
        if self.body.mesh.dim == 3:
            raise BadArgument("body", self.body, "lies in space: take fields.u, fields.stress, ... there")
        x1, x2, shape = at_points(x1, x2)
        sign = np.where(self.mirrored & (x1 < 0), -1.0, 1.0)
        try:
            points = self.body.mesh(sign * x1, x2)
            u1, u2, psi, stress, couple = (
                np.asarray(part(points)) for part in (*self, self.stress, self.couple_stress)
            )
        except Exception as failure:  # NGSolve's own; it does not say which point
            raise BadArgument("x1, x2", (x1, x2), f"must lie in the body ({failure})") from failure
        odd = np.stack((np.ones_like(sign), sign, sign, np.ones_like(sign)))
        found = PointFields(
            x1,
            x2,
            sign * psi.ravel(),
            np.stack((sign * u1.ravel(), u2.ravel())),
            (odd * stress.reshape(-1, 4).T).reshape(2, 2, -1),
            np.stack((np.ones_like(sign), sign)) * couple.reshape(-1, 2).T,
        )
        return found.shaped(shape)

    @property
    def stress(self):
        """Force stress (16), 2x2, in three dimensions 3x3; on a boundary that of the element beside it."""
        sigma = contact_term.stress(self.body.solid, self.body.strains(self)[0])
        if self.body.mesh.dim < 3:
            sigma = ng.CF((sigma[0, 0], sigma[0, 1], sigma[1, 0], sigma[1, 1]), dims=(2, 2))
        return ng.BoundaryFromVolumeCF(sigma)  # else gradients are 0 there, in silence

    @property
    def couple_stress(self):
        """Couple stress, (m1, m2), in three dimensions 3x3; on a boundary that of the element beside it."""
        m = contact_term.couple_stress(self.body.solid, self.body.strains(self)[1])
        return ng.BoundaryFromVolumeCF(m if self.body.mesh.dim == 3 else ng.CF((m[2, 0], m[2, 1])))

    def reaction(self, boundary):
        """The Reaction that the body's supports on a boundary exert on it, from nodal forces.

        All supports together balance loads and contact to rounding. What is exerted where two supported
        boundaries meet is part of both: name them together, "bottom|side", for their sum. In 1D and of a
        periodic body f2 has no arm.

        Raises
        ------
        BadArgument
            For a boundary on which nothing is supported, and for fields without the forces that act on them.
        """
        body, region = self.body, self.body.boundary(boundary)
        held = body.held_on(boundary)
        if not held:
            raise BadArgument(
                "boundary",
                boundary,
                "is supported in no field, so that no support exerts anything "
                "there; supported are "
                + (", ".join(f"{name} on {pattern}" for name, pattern in body.fixed.items()) or "none"),
            )
        if self.forces is None:
            raise BadArgument(
                "forces",
                None,
                "must be given to know reactions: take the fields of a state, or of Body.solve",
            )
        parts = {name: region * body.boundary(body.fixed[name]) for name in held}

        def work(u, psi):
            """Of the supports on a rigid motion."""
            values = (*u, *psi)
            return sum(
                self.forces[body.unknowns_of(name)] @ body.values_on(parts[name], name, values[PLACES[name]])
                for name in held
            )

        axes, place = [tuple(map(float, axis)) for axis in np.eye(3)], self._place()
        turns = [ng.Cross(ng.CF(axis), place) for axis in axes]
        force = np.array([work(axis, (0.0,) * 3) for axis in axes])
        moment = np.array([work([turn[i] for i in range(3)], axis) for turn, axis in zip(turns, axes)])
        return Reaction(force, moment) if body.mesh.dim == 3 else Reaction(force[:2], float(moment[2]))

    def _place(self):
        """The place as an expression, for moments: along a period forces have no arm."""
        dim, repeated = self.body.mesh.dim, self.body.periodic
        if dim == 1:
            return ng.CF((0, ng.x, 0))
        return ng.CF((0 if repeated else ng.x, 0 if repeated and dim == 3 else ng.y, ng.z if dim == 3 else 0))

    def energy(self):
        """Elastic energy of the whole body (in 1D: per area)."""
        return (1 + self.mirrored) * self.body.integrated(self.body.energy(*self))


def _body_anew(arguments, curve_order):
    """A body in a copy: its curves are made anew, as NGSolve mixes up those of a refined mesh."""
    if curve_order > 1:
        arguments["mesh"].Curve(curve_order)
    return Body(**arguments)


def _fields_anew(kind, body, values, forces, mirrored):
    """The fields, of this class, of these values and forces of the unknowns, element by element."""
    state, numbers = ng.GridFunction(body.space), dofs_by_element(body)
    state.vec.FV().NumPy()[numbers] = values
    exerted = None if forces is None else np.zeros(body.space.ndof)
    if forces is not None:
        exerted[numbers] = forces
    fields = kind(body, state.components, exerted)
    fields.mirrored = mirrored
    return fields


def dofs_by_element(body):
    """Unknowns of a body, element by element: a copied mesh keeps the order of elements, not of edges."""
    return np.concatenate([body.space.GetDofNrs(element) for element in body.space.Elements()])
