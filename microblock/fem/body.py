"""A Cosserat body on a mesh of one, two or three dimensions: its supports, stiffness and equilibrium."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import ngsolve as ng
import numpy as np

from .. import cost
from ..errors import require, require_flag, require_kind
from ..halfspace.symbol import require_stable
from ..model.material import Cosserat
from ..model.methods import Condensed, Newton
from ..model.results import line
from ..threads import bounded
from . import contact_term, regions, supports
from .body_fields import BodyFields
from .body_spaces import BodySpaces
from .bulk import Bulk
from .loads import Loads, require_finite_within
from .mesh_surface import MeshSurface
from .meshes import extent, require_sound


class Body(BodySpaces):
    """A linear Cosserat body: mesh, material, spaces and supports.

    Contact boundaries may be tilted, curved or of several pieces, "top|side". Places that are steeper than 60
    degrees touch no obstacle. In three dimensions they consist of quadrilaterals of any order or of triangles
    of order 1 or 2. Obstacles are those over a surface, or any ``height(x1, x2)``, counted from x3 = 0.
    Blocks have sides t1 and t2 in the tangent plane: e1 and e2, turned as e3 is to n the shortest way.
    `Microclamped` holds psi1 and psi2 on a horizontal boundary, and psi3 as well on others.

    Parameters
    ----------
    mesh : ngsolve.Mesh
        Of triangles and quadrilaterals, a 1D mesh of the depth x2 (`meshes.line`), or one in three dimensions
        (`microblock.fem.meshes3d.block`). Geometries have tolerances of 1e-7 in their unit of length.
    solid : Cosserat or {materials of the mesh: Cosserat}
        Of all of the body, or of its parts, by NGSolve's names and patterns; their moduli and lengths may be
        CoefficientFunctions. Of an `Elastic` part psi is no unknown, and no couple acts upon its border. The
        attribute `solid` has numbers: it is that at the contact boundary, the stiffest where they differ, and
        an `Elastic` if a part of the boundary is.
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
        the mesh is not sound, a material has no solid or two, a function violates (13) in an integration
        point, or blocks on the contact boundary differ in their side; in three dimensions also if a solid
        lets short waves of a free surface turn by themselves.

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

    With functions, a coating that is stiffer at its surface:

    >>> import ngsolve as ng
    >>> graded = mb.Cosserat(E=100 * (1 + ng.exp(ng.y)), nu=0.3, ell=0.1, beta=1)
    >>> mb.Body(mesh, graded, fixed="bottom").solid
    Cosserat(E=200.0, nu=0.3, ell=0.1, beta=1, curvature=2)

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
        mesh: Any,
        solid: Cosserat | Mapping[str, Cosserat],
        order: Any = 2,
        *,
        order_psi: int | None = None,
        fixed: Any = (),
        prescribed: Mapping[str, Mapping[str, Any]] | None = None,
        periodic: bool = False,
        contact: str = "contact",
    ) -> None:
        require_sound(mesh)
        solids = regions.solids_of(mesh, solid)
        require_kind(str, "the name of a boundary", contact=contact)
        require_kind((Mapping, type(None)), "{field: {boundary: value}}", prescribed=prescribed)
        require_flag(periodic=periodic)
        super().__init__(mesh, solids, order, order_psi, periodic)
        if contact != "contact":
            self.boundary(contact, "contact")
        self.contact = contact
        regions.require_admissible(mesh, solids, 2 * self.order + self.bonus)
        self.solid = regions.surface_solid(mesh, solids, contact)
        if mesh.dim == 3:
            for part in {*solids, self.solid}:
                if not part.functions and not part.is_classical:  # else psi has nothing to do with u
                    require_stable(part)
        if not self.solid.has_length:
            self.solid = self.solid.with_length(extent(mesh))
        self.prescribed = dict(prescribed or {})
        require_finite_within(prescribed=self.prescribed)
        patterns = supports.patterns(self, fixed)
        self.fixed = {name: pattern for name, pattern in patterns.items() if name in self.names}
        self._made_of = {
            "mesh": mesh,
            "solid": solid if isinstance(solid, Cosserat) else dict(solid),
            "order": order,
            "order_psi": order_psi,
            "fixed": patterns,
            "prescribed": self.prescribed,
            "periodic": periodic,
            "contact": contact,
        }
        self.spaces = [self.field_space(name, dirichlet=self.fixed.get(name, "")) for name in self.names]
        self.space = ng.ProductSpace(*self.spaces)
        supports.require_periodic(self)

    def __reduce__(self) -> tuple[Any, ...]:
        """A copy is made anew: NGSolve loses orders of single elements."""
        return _remade, (self._made_of, self.mesh.GetCurveOrder())

    def __repr__(self) -> str:
        kinds = f"in {self.mesh.dim}D" + ", periodic" * self.periodic
        count = len(regions.alike(self.solids))
        if count > 1:
            kinds += f", {count} solids"
        order = f"{self.order} at most" if self.element_orders is not None else str(self.order)
        order += f", psi {self.order_psi}" if self.rotates and self.order_psi != self.order else ""
        return line(
            "Cosserat body", f"{self.mesh.ne} elements {kinds}, order {order}, {self.unknowns} unknowns"
        )

    def of(self, solid: Cosserat) -> Body:
        """Returns the same body of another solid; of the same one itself."""
        require_kind(Cosserat, "a Cosserat", solid=solid)
        if solid == self.solid:
            return self
        words = "is one solid, and this body has another one elsewhere: give a body"
        require(self._made_of["solid"] == self.solid, "solid", solid, words)
        return self.on(self.mesh, solid=solid)

    def on(self, mesh: Any, **changes: Any) -> Body:
        """Returns the same body on another mesh, or with other arguments; raises BadArgument for another mesh
        where orders are those of single elements.
        """
        require(
            self.element_orders is None or mesh is self.mesh,
            "order",
            "one for each element",
            "belongs to one mesh: give one order for all elements",
        )
        return Body(**self._made_of | {"mesh": mesh} | changes)

    @property
    def methods(self) -> tuple[type, ...]:
        """Methods that solve on it, the usual one first."""
        newton_alone = self.mesh.dim == 1 or (self.mesh.dim == 2 and self.periodic)
        return (Newton,) if newton_alone else (Condensed, Newton)

    @property
    def solvers(self) -> dict[type, str]:
        """{method: where its solver is}, where not the plane's."""
        if not self.in_space:
            return {}
        return {Condensed: "fem.solver3d.Solver3D", Newton: "fem.newton_solver.NewtonSolver3D"}

    def surface(self) -> MeshSurface:
        """Returns its contact boundary as an obstacle, made once: the shape of a second body."""
        require(self.mesh.dim > 1, "body", self, "must be two-dimensional, or in space")
        region = self.boundary(self.contact, "contact")
        return self.once("surface", lambda: MeshSurface(region, supports.planes_of_symmetry(self, region)))

    def bulk(self, space: Any = None, **options: Any) -> Any:
        """Returns the assembled second variation of (10), on the space of the body or a product."""
        space = self.space if space is None else space
        trial, test = space.TnT()
        strains = self.strains(trial[: len(self.names)])
        varied = self.strains(test[: len(self.names)])
        form = ng.BilinearForm(space, **options)
        for work in contact_term.virtual_work(self.moduli, strains, varied):  # two are quicker than their sum
            form += work * ng.dx(bonus_intorder=self.bonus)
        return form.Assemble()

    @bounded
    def solve(self, loads: Loads = Loads()) -> BodyFields:
        """Returns the equilibrium without contact.

        Raises
        ------
        NotConverged
            If the supports leave a rigid motion free.
        """
        require_kind(Loads, "Loads", loads=loads)
        advice = "take longer elements or a lower order"
        matrix = self.bulk(symmetric=True)
        factors = f"factors of the bulk, {self.space.ndof} unknowns,"
        cost.require_room(cost.plane_factor_bytes(self.space.ndof, matrix.mat.nze), factors, advice)
        bulk = Bulk(self, matrix, np.zeros(0, int), advice)
        state = ng.GridFunction(self.space)
        supports.prescribe(self, state.components)
        prescribed = state.vec.FV().NumPy().copy()
        exerted = bulk.solve(loads.acting_on(self) - bulk.matrix @ prescribed, state)
        state.vec.FV().NumPy()[:] += prescribed
        return BodyFields(self, state.components, exerted)


def _remade(arguments: dict[str, Any], curve_order: int) -> Body:
    """Returns a body in a copy: NGSolve mixes up curves of a refined mesh."""
    if curve_order > 1:
        arguments["mesh"].Curve(curve_order)
    return Body(**arguments)
