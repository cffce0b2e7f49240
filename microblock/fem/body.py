"""A Cosserat body on a mesh: the compound H1 space of (u1, u2, psi), its energy, loads and supports."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import ngsolve as ng
import numpy as np

from .. import cost
from ..errors import BadArgument, NotConverged, require_finite, require_flag, require_kind, require_whole
from ..model.fields import PointFields
from ..model.fields import points as at_points
from ..model.material import Cosserat
from ..model.methods import Condensed, Newton
from ..model.summary import Row, Shown, Summary
from ..threads import bounded
from .meshes import Travelling, body_anew, require_sound

USUAL_CONTACT = "contact"  # the name of the contact boundary
FIELDS = ("u1", "u2", "psi")
CURVED = 4  # more integration orders, with which energies of curved elements of order 1 err by 4e-9
GIVEN = 4  # more integration orders than a field has, for loads, which are functions of the user
SINGULAR = 1e-8  # relative residual of a direct solve beyond which the matrix counts as singular
# of the constant 1, from which on a coefficient is that of a vertex and not the rounding of an edge's
OWN = 0.25
SAME = 1e-9  # of the largest of prescribed values, within which two of them are one


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
    """Dead loads of (8); every value a number or an NGSolve CoefficientFunction.

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


class MeshBody(Shown):
    """Base of bodies on meshes, whatever their dimension.

    Attributes
    ----------
    names : tuple of str, of the fields
    mesh, solid, order, order_psi, element_orders, fixed, prescribed, periodic, contact : as of `Body`
    space : NGSolve's space of all fields
    """

    def __reduce__(self):
        """A copy, or what comes out of a file, is made anew: NGSolve loses orders of single elements."""
        return body_anew, (type(self), self._made_of | {"mesh": Travelling(self.mesh)})

    def of(self, solid):
        """The same body of another solid; the same one is not factorised again."""
        require_kind(Cosserat, "a Cosserat", solid=solid)
        return self if solid == self.solid else type(self)(**self._made_of | {"solid": solid})

    def once(self, key, make):
        """What `make()` returns, by a key: made once, and kept as long as the body."""
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
        """BadArgument where a displacement is fixed or prescribed on no boundary: a translation is free."""
        for name in self.names:
            if name.startswith("u") and name not in self.fixed:
                raise BadArgument(
                    "fixed",
                    self.fixed,
                    f"must hold the body: {name} is not fixed on any boundary, and nothing else stops it",
                )

    def boundary(self, pattern, argument="boundary"):
        """The region of the boundaries that a pattern names; BadArgument if there are none, also for one of
        its names, with the name of the argument that it was.
        """
        return region(self.mesh, pattern, argument)

    @property
    def bonus(self):
        """Integration orders beyond NGSolve's, of forms as of what is made of their solutions: on curved
        elements the energy is no polynomial. On quadrilaterals that are no parallelograms NGSolve's rule is a
        part of the discretisation.
        """
        return CURVED if self.mesh.GetCurveOrder() > 1 else 0

    def integrated(self, density, **options):
        """The integral over the body of a quadratic function of fields, by the rule of `dx`."""
        order = 2 * max(self.order, self.order_psi) + self.bonus
        return ng.Integrate(density, self.mesh, order=order, **options)


class Body(MeshBody):
    """A linear Cosserat body: mesh, material, spaces and supports.

    Parameters
    ----------
    mesh : ngsolve.Mesh
        Triangles, quadrilaterals (curved or not), or a 1D mesh of the depth x2 (`meshes.line`). The kernel of
        geometries that makes it has tolerances of 1e-7 in its unit of length: a body of 1e-9 m is drawn in
        nanometres.
        Numbers here have no unit, and results do not depend on it.
    solid : Cosserat
    order : int or array (elements,) of int
        Polynomial order of u. With one for each element all fields have it, and an edge has the larger one of
        its neighbours.
    order_psi : int, optional
        Polynomial order of psi; without it that of u.
    fixed : str or mapping
        Boundaries on which u1 = u2 = psi = 0, or {field: boundaries}; names as NGSolve's patterns.
    prescribed : {field: {boundary: value}}, optional
        Boundaries on which a field has this value (a number or CoefficientFunction); the same at identified
        points.
    periodic : bool
        Whether the fields are identified on boundaries that the mesh identifies.
    contact : str
        Name or pattern of the boundary that an obstacle may touch.

    Raises
    ------
    BadArgument
        If an argument is out of range, a boundary is unknown, or the mesh has points that are no numbers,
        elements without area or elements of the other orientation.

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
    """

    names = FIELDS

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
        contact=USUAL_CONTACT,
    ):
        require_sound(mesh)
        require_kind(Cosserat, "a Cosserat", solid=solid)
        require_kind(str, "the name of a boundary", contact=contact)
        require_kind((Mapping, type(None)), "{field: {boundary: value}}", prescribed=prescribed)
        require_flag(periodic=periodic)
        self.mesh, self.solid, self.periodic, self.contact = mesh, solid, periodic, contact
        self.element_orders = None if isinstance(order, int | np.integer) else self._graded(order, order_psi)
        order = order if self.element_orders is None else int(self.element_orders.max())
        orders = (order, order, order if order_psi is None else order_psi)
        for name, value in (("order", orders[0]), ("order_psi", orders[2])):
            require_whole(1, **{name: value})
        self.order, self.order_psi = orders[0], orders[2]
        self.prescribed = dict(prescribed or {})
        require_finite_within(prescribed=self.prescribed)
        self.fixed = self._patterns(fixed)
        self.spaces = [self.scalar(p, dirichlet=self.fixed.get(name, "")) for name, p in zip(FIELDS, orders)]
        self.space = self.spaces[0] * self.spaces[1] * self.spaces[2]
        self._require_periodic_values()
        if contact != USUAL_CONTACT:
            self.boundary(contact, "contact")
        self.derived: dict = {}  # what costs a factorisation, see `once`

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
        given = {"solid": solid, "fixed": fixed}
        given = {"mesh": mesh} | {name: one for name, one in given.items() if one is not None}
        return Body(**self._made_of | given)

    @property
    def methods(self):
        """The methods that solve on it, the usual one first."""
        return (Newton,) if self.periodic or self.mesh.dim == 1 else (Condensed, Newton)

    def scalar(self, order, **options):
        """A scalar H1 space of this body, periodic where the body is; of the elements' own orders where it
        has them.
        """
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
        """The region of a contact boundary; BadArgument where supports hold u2 on a part of it, which cannot
        be pressed.
        """
        region = self.boundary(boundary, "contact" if boundary == self.contact else "boundary")
        if "u2" in self.held_on(boundary):
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
            self.set_on(region, components[FIELDS.index(name)], self.mesh.BoundaryCF(dict(values)))

    def set_on(self, region, component, value):
        """Set a component of a grid function of the body on a region of its boundary.

        A facet of a body one element wide has the dof of its identified ends twice: NGSolve's Set counts it
        twice, but adds its value once. What 1 becomes is its share.
        """
        component.Set(value, definedon=region)
        if self.periodic:
            share = ng.GridFunction(component.space)
            share.Set(1, definedon=region)
            shares = share.vec.FV().NumPy()
            ends = np.abs(shares) > OWN
            component.vec.FV().NumPy()[ends] /= shares[ends]

    def values_on(self, region, number, value):
        """Coefficients of a function in the space of a field (its number) on a region of the boundary, 0
        elsewhere.
        """
        function = ng.GridFunction(self.spaces[number])
        self.set_on(region, function, value)
        return function.vec.FV().NumPy().copy()

    def _require_periodic_values(self):
        """BadArgument where prescribed values differ at points that the mesh identifies."""
        for name, values in self.prescribed.items() if self.periodic else ():
            space, value, found = self.spaces[FIELDS.index(name)], self.mesh.BoundaryCF(dict(values)), {}
            for facet in self.boundary("|".join(values)).Elements():
                transformation = self.mesh.GetTrafo(facet)
                for vertex, dof, xi in zip(facet.vertices, space.GetDofNrs(facet), (1.0, 0.0)):
                    found.setdefault(dof, {}).setdefault(vertex.nr, value(transformation(xi)))
            largest = max(abs(one) for own in found.values() for one in own.values())
            if any(np.ptp(list(own.values())) > SAME * largest for own in found.values()):
                raise BadArgument(
                    "prescribed",
                    self.prescribed,
                    f"must have the same {name} at points that the mesh identifies",
                )

    def gradients(self, u1, u2, psi):
        """Displacement gradient (2x2) and grad psi as expressions, in 1D with d/dx1 = 0."""
        if self.mesh.dim == 1:
            zero = ng.CF(0)
            gradient = ng.CF((zero, ng.grad(u1)[0], zero, ng.grad(u2)[0]), dims=(2, 2))
            return gradient, ng.CF((zero, ng.grad(psi)[0]))
        return ng.CF((ng.grad(u1), ng.grad(u2)), dims=(2, 2)), ng.grad(psi)

    def energy(self, u1, u2, psi):
        """Energy density (10) as an expression."""
        gradient, kappa = self.gradients(u1, u2, psi)
        return self.solid.energy(gradient, psi, kappa)

    def potential(self, u1, u2, psi, loads=Loads()):
        """Potential energy (8) as integrals, for ``ngsolve.Variation`` or ``Integrate``."""
        potential = self.energy(u1, u2, psi) * self.dx
        more = {"bonus_intorder": self.order + GIVEN}
        potential -= (loads.force[0] * u1 + loads.force[1] * u2 + loads.couple * psi) * ng.dx(**more)
        for boundary, (t1, t2) in loads.traction.items():
            potential -= (t1 * u1 + t2 * u2) * ng.ds(definedon=self.boundary(boundary), **more)
        for boundary, micromoment in loads.micromoment.items():
            potential -= micromoment * psi * ng.ds(definedon=self.boundary(boundary), **more)
        return potential

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
        state = ng.GridFunction(self.space)
        self.prescribe(state.components)
        form = ng.BilinearForm(self.space, symmetric=True)
        form += ng.Variation(self.potential(*self.space.TrialFunction(), loads))
        residual = state.vec.CreateVector()
        form.Apply(state.vec, residual)
        form.AssembleLinearization(state.vec)
        step = solve_linear(
            form.mat,
            self.space.FreeDofs(),
            residual,
            "the bulk; are rigid motions fixed, and psi where beta = 0?",
        )
        state.vec.data -= step
        form.Apply(state.vec, residual)
        return Fields(self, state.components, residual.FV().NumPy().copy())


class Reaction(NamedTuple):
    """What supports exert on a body: force (f1, f2), array, and moment about the origin, counterclockwise;
    per thickness.

    The moment is that of force and couple stress together. In 1D both are per area.
    """

    force: np.ndarray
    moment: float


class BodyFields:
    """Base of the fields of a state, grid functions one after the other.

    Attributes
    ----------
    body : Body or Body3D
    components : tuple of grid functions, all unknowns of the body
    forces : array (unknowns of the body,) or None, what supports exert in each unknown
    mirrored : bool, whether they are the half x1 > 0 of a symmetric state
    """

    mirrored = False

    def __init__(self, body, components, forces=None):
        self.body, self.components, self.forces = body, tuple(components), forces

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


class Fields(BodyFields):
    """The fields of a state: u1, u2, psi and what follows from them, as NGSolve functions.

    Stresses are those of the elements. On a boundary they are read from the element beside it (NGSolve's
    BoundaryFromVolumeCF, which `stress` and `couple_stress` have in them; derivatives of your own need it),
    and are as good there as the mesh. What a support exerts is better asked from `reaction`: it balances the
    loads to rounding on any mesh.

    Parameters
    ----------
    body : Body
    components : grid functions of u1, u2, psi
    forces : array (unknowns of the body,), internal forces less the loads: what supports exert in each
        unknown

    Examples
    --------
    >>> from microblock.fem import meshes
    >>> from microblock.fem.body import Loads
    >>> body = mb.Body(meshes.column(depth=1.0, elements=2),
    ...                mb.Cosserat(E=2.6, nu=0.3, ell=0.2, beta=1), order=4,
    ...                fixed={"u1": "middle", "u2": "middle"}, periodic=True)
    >>> fields = body.solve(Loads(traction={"contact": (0, -1)}))
    >>> import ngsolve as ng
    >>> round(ng.Integrate(fields.stress[1, 1], body.mesh)/ng.Integrate(1, body.mesh), 9)
    -1.0

    The stress on a boundary, and the force and the moment of the support there (the column is 0.5 wide):

    >>> round(ng.Integrate(fields.stress[1, 1], body.mesh, definedon=body.mesh.Boundaries("middle")), 9)
    -0.5
    >>> force, moment = fields.reaction("middle")
    >>> round(float(force[1]), 9)
    0.5
    """

    def __init__(self, body, components, forces=None):
        super().__init__(body, components[:3], forces)
        self.u1, self.u2, self.psi = self

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
        """Force stress (16), 2x2; on a boundary that of the element beside it."""
        gradient, _ = self.body.gradients(*self)
        rows = self.body.solid.stress(gradient, self.psi)
        # else gradients are 0 there, in silence
        return ng.BoundaryFromVolumeCF(ng.CF((*rows[0], *rows[1]), dims=(2, 2)))

    @property
    def couple_stress(self):
        """Couple stress m, two components; on a boundary that of the element beside it."""
        return ng.BoundaryFromVolumeCF(ng.CF(self.body.solid.couple_stress(self.body.gradients(*self)[1])))

    def reaction(self, boundary):
        """The Reaction: force and moment that the body's supports on a boundary exert on it, from nodal
        forces.

        All supports together balance loads and contact to rounding. What an unknown exerts that lies on two
        supported boundaries is part of the reaction of each: name them together, "bottom|side", for their
        sum. The moment is about the origin,
        of force stress and couple stress together; in 1D and of a periodic body, whose columns are all alike,
        f2 has no arm.

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
        across, up = (ng.CF(0) if body.periodic else ng.x, ng.y) if body.mesh.dim == 2 else (ng.CF(0), ng.x)
        parts = np.split(self.forces, np.cumsum([space.ndof for space in body.spaces])[:2])
        total, moment = np.zeros(3), 0.0
        for name in held:
            number = FIELDS.index(name)
            part, own = region * body.boundary(body.fixed[name]), parts[number]
            total[number] = own @ body.values_on(part, number, 1)
            if name != "psi":
                moment += own @ body.values_on(part, number, -up if name == "u1" else across)
        return Reaction(total[:2], float(moment + total[2]))

    def energy(self):
        """Elastic energy of the whole body (in 1D: per area)."""
        return (1 + self.mirrored) * self.body.integrated(self.body.energy(*self))


def region(mesh, pattern, argument="boundary"):
    """The region of the boundaries of a mesh that a pattern names; BadArgument if there are none, also for
    one of its names.
    """
    names = sorted(set(mesh.GetBoundaries()))
    if not isinstance(pattern, str):
        raise BadArgument(argument, pattern, f"must be a name or pattern of {', '.join(names)}")
    try:
        found = mesh.Boundaries(pattern)
    except RuntimeError as failure:
        raise BadArgument(argument, pattern, f"is no regular expression: {failure}") from failure
    missing = [name for name in pattern.split("|") if name.isidentifier() and name not in names]
    if missing or not any(found.Mask()):
        which = "" if missing in ([], [pattern]) else f"{', '.join(missing)} "
        raise BadArgument(argument, pattern, f"{which}is none of the mesh's boundaries, {', '.join(names)}")
    return found


def solve_linear(matrix, freedofs, rhs, what):
    """Solve matrix x = rhs on freedofs by UMFPACK, and check: a singular or too large matrix raises
    NotConverged.
    """
    cost.require_room(
        cost.of_factors(matrix.height, matrix.nze),
        f"factors of {what.split(';')[0]}, {matrix.height} unknowns,",
        "take longer elements or a lower order",
    )
    try:
        inverse = matrix.Inverse(freedofs, "umfpack")
    except Exception as failure:
        raise NotConverged(f"no factorisation of {what}: {failure}") from failure
    solution, left, scale = (rhs.CreateVector() for _ in range(3))
    solution.data = inverse * rhs
    left.data = rhs - matrix * solution
    solution.data += inverse * left  # one step of refinement
    left.data = rhs - matrix * solution
    scale.data = rhs
    kept = ng.Projector(freedofs, True)
    kept.Project(left)
    kept.Project(scale)
    if not left.Norm() <= SINGULAR * max(scale.Norm(), 1e-300):
        raise NotConverged(f"singular matrix of {what}")
    return solution


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
    """Numbers of the unknowns of a body, element by element: a copy of a mesh keeps the order of its elements
    but not that of its edges, of which those of the coarser meshes are forgotten."""
    return np.concatenate([body.space.GetDofNrs(element) for element in body.space.Elements()])
