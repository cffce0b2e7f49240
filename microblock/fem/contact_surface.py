"""The contact term for forms of one's own, in the plane and in space.

A boundary of any mesh gets nodes and a rule; a law and an obstacle give it corners; the corners give gaps
(20)-(22), the penalty functional (31), the augmented Lagrangian (37) and its virtual work (39) as NGSolve
expressions of trial functions of one's own. Nothing else of this library is needed.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import ngsolve as ng
import numpy as np

from ..errors import BadArgument, require, require_flag, require_kind, require_positive, require_whole
from ..model import law as laws
from ..model.corner_geometry import Blocks
from ..model.law import Law
from ..model.types import Array, Flags, ObstacleLike
from . import contact_term
from .body_spaces import free_unknowns
from .facet_nodes import FacetNodes
from .facet_rules import require_nodal_rule
from .facets import gaps_at_points
from .meshes import elements_beside
from .regions import named_region


class ContactSurface(FacetNodes):
    """The nodes of a named boundary of a mesh in the plane or in space.

    Parameters
    ----------
    mesh : ngsolve.Mesh
    boundary : str
        Name or pattern of the boundary that an obstacle may touch.
    order : int
        That of the displacement, and no other: the rule of a facet has the nodes of this order, and
        integrates u exactly. It is the order of the multipliers, too.
    periodic : bool
        Whether the spaces are `ngsolve.Periodic`.

    Attributes
    ----------
    points, normals, weights, ... : as of `FacetNodes`
    multipliers : scalar H1 space on the boundary, of the multiplier of one corner, an unknown for each node

    Raises
    ------
    BadArgument
        For an unknown boundary, a facet without a nodal rule of this order, or one within the mesh.

    Examples
    --------
    >>> import ngsolve as ng
    >>> from ngsolve.meshes import MakeStructured2DMesh
    >>> from microblock.fem.contact_surface import ContactSurface
    >>> mesh = MakeStructured2DMesh(nx=8, ny=8)
    >>> boundary = ContactSurface(mesh, "top", order=2)
    >>> corners = boundary.corners(mb.Microblock(), lambda x: (x - 0.5) ** 2 + 1, ell=0.1)
    >>> V, W, L = ng.VectorH1(mesh, order=2, dirichlet="bottom"), ng.H1(mesh, order=2), boundary.multipliers
    >>> u, psi, *lam = (V * W * L * L).TrialFunction()
    >>> term = ng.Variation(corners.lagrangian(u, psi, lam, rho=10.0, approach=0.01))
    """

    def __init__(self, mesh: Any, boundary: str = "contact", order: int = 1, periodic: bool = False) -> None:
        require_kind(ng.Mesh, "an ngsolve.Mesh", mesh=mesh)
        require(mesh.dim > 1, "mesh", mesh, "must be of two or three dimensions")
        require_whole(1, order=order)
        require_flag(periodic=periodic)
        region = named_region(mesh.Boundaries, mesh.GetBoundaries(), boundary, "boundary", "boundaries")
        alone = all(len(beside) == 1 for beside in elements_beside(mesh, region))
        require(alone, "boundary", boundary, "must have the mesh on one side, not on both")
        require_nodal_rule(region.Elements(), order)
        self.periodic = periodic
        self.order = order
        space = ng.H1(mesh, order=order)
        if periodic:
            space = ng.Periodic(space)
        super().__init__(region, space, [order] * len(list(region.Elements())))

    def scalar(self, order: int, **options: Any) -> Any:
        space = super().scalar(order, **options)
        return ng.Periodic(space) if self.periodic else space

    def corners(
        self, law: Law, obstacle: ObstacleLike, ell: float | None = None, rotation: Any = None
    ) -> ContactCorners:
        """Returns the corners of a law at the nodes, under an obstacle.

        Parameters
        ----------
        law : Law
            `Microblock`, `Unilateral` or one of your own, without friction. Where it prescribes psi, as
            `Microclamped` does, the Dirichlet conditions of the space of psi have to.
        obstacle : obstacle or callable, as of `Contact`
        ell : float, optional
            Side of a block (length); a law with one corner at the contact point needs none.
        rotation : H1 space of psi in the plane, optional
            Where its Dirichlet conditions hold psi, the corners of a block cannot close independently, and
            the nearest one is taken alone: two multipliers would be one too many.

        Raises
        ------
        BadArgument
            If the law has friction, a length is missing or not positive, or the obstacle is over no node.
        """
        return ContactCorners(self, law, obstacle, ell, rotation)


class ContactCorners:
    """The corners of a law at the nodes of a `ContactSurface`, see `ContactSurface.corners`.

    Attributes
    ----------
    boundary : ContactSurface
    names : tuple of str, of the corners
    initial_gaps : array (corners, n)
        Initial gaps along the normals (lengths), inf where nothing can touch.
    arms : array (corners, n, dim)
        Places of the corners from the centres of their blocks (lengths).

    Notes
    -----
    Trial functions: u is a `VectorH1` of the dimension of the mesh; psi in the plane an `H1`,
    counterclockwise, in space a `VectorH1`, or None. Multipliers are stresses, negative in contact: the
    pressure of a corner is -lambda. The approach moves the obstacle along -e2, in space -e3; it is a number,
    a `Parameter`, or a trial function of ``NumberSpace(mesh, definedon=boundary.region)``. rho is a stress
    over a length. In space blocks have four corners and three motions: where all four close, multipliers are
    not unique, and the matrix is singular; take `penalty`, or a `Body`.
    """

    def __init__(
        self, boundary: ContactSurface, law: Law, obstacle: ObstacleLike, ell: float | None, rotation: Any
    ) -> None:
        in_space = boundary.dim == 3
        laws.check(law, in_space)
        words = "must be 0: these terms know no shear tractions"
        require(not law.friction, "friction", law.friction, words)
        self.boundary = boundary
        self.law = law
        if ell is None:
            alone = type(law) in laws.BUILT_IN and not isinstance(law, laws.Microblock)
            require(alone, "ell", ell, "must be given: the side of a block, from which its corners follow")
            ell = 1.0  # times arms that are 0
        require_positive(ell=ell)
        blocks = Blocks(law, ell, in_space)
        self.names = blocks.names
        geometry = blocks.under(obstacle, boundary.points, boundary.normals)
        self.arms = np.broadcast_to(geometry.offsets_from_centre, (len(self.names), *boundary.points.shape))
        self.initial_gaps = gaps_at_points(geometry)
        if rotation is not None:
            self._keep_nearest(rotation)

    def _keep_nearest(self, rotation: Any) -> None:
        """Leaves the nearest corner alone at nodes where psi is held."""
        words = "must be the scalar H1 space of psi on the mesh, in the plane"
        plane = self.boundary.dim == 2 and isinstance(rotation, (ng.H1, ng.Periodic))
        require(plane and rotation.mesh is self.boundary.mesh, "rotation", rotation, words)
        free = free_unknowns(rotation)
        held = abs(self.boundary.trace(rotation)) @ free == 0
        nearest = np.argmin(self.initial_gaps, axis=0)
        others = np.arange(len(self.names))[:, None] != nearest
        self.initial_gaps = np.where(held & others, np.inf, self.initial_gaps)

    def gaps(self, u: Any, psi: Any = None, approach: Any = 0.0) -> list[Any]:
        """Returns the gaps (20)-(22) of the corners, expressions (lengths); where nothing can touch their
        initial part is 0 instead of inf.
        """
        return [g for g, _ in self._gaps(self.initial_gaps, u, psi, approach)]

    def _gaps(self, initial: Array, u: Any, psi: Any, approach: Any) -> Iterator[tuple[Any, Flags]]:
        """Yields the gap of each corner, and where it can touch, boolean array (n,)."""
        boundary = self.boundary
        u, psi = self._vectors(u, psi)
        upwards = (0, 1, 0) if boundary.dim == 2 else (0, 0, 1)
        moved = -approach * ng.CF(upwards)
        yield from contact_term.gaps(boundary, initial, self.arms, u, psi, moved)

    def _vectors(self, u: Any, psi: Any) -> tuple[Any, Any]:
        """Returns u and psi with three components; raises BadArgument for others than those of the mesh."""
        dim = self.boundary.dim
        require_kind(ng.CoefficientFunction, "an NGSolve function", u=u)
        self._require_order(u)
        require(u.dim == dim, "u", u, f"must have {dim} components on a mesh of {dim} dimensions")
        components = [u[axis] for axis in range(dim)]
        u = ng.CF((*components, 0)[:3])
        if psi is None:
            require(
                not self.arms.any(), "psi", psi, f"must be given: {self.law} has corners beside the centre"
            )
            return u, ng.CF((0, 0, 0))
        require_kind(ng.CoefficientFunction, "an NGSolve function", psi=psi)
        words = "must have one component in the plane, and three in space"
        require(psi.dim == (1 if dim == 2 else 3), "psi", psi, words)
        return u, psi if dim == 3 else ng.CF((0, 0, psi))

    def _require_order(self, u: Any) -> None:
        """Raises BadArgument for a trial function or a grid function of another order than the surface."""
        if isinstance(u, (ng.comp.ProxyFunction, ng.GridFunction)):
            parts = getattr(u.space, "components", None) or [u.space]
            vectors = [part for part in (u.space, *parts) if "VectorH1" in part.type]
            orders = {part.globalorder for part in vectors}
            allowed = ", ".join(map(str, sorted(orders)))
            words = f"must be the order of u, {allowed}, which the rule integrates exactly"
            order = self.boundary.order
            require(not orders or order in orders, "order", order, words)

    def penalty(self, u: Any, psi: Any = None, *, rho: float, approach: Any = 0.0) -> Any:
        """Returns the penalty functional of (31), the integral of rho/2 <g>_-^2 of all corners, for
        `ngsolve.Variation`.
        """
        require_positive(rho=rho)
        return self.lagrangian(u, psi, [ng.CF(0)] * len(self.names), rho=rho, approach=approach)

    def lagrangian(
        self, u: Any, psi: Any, multipliers: Sequence[Any], *, rho: float, approach: Any = 0.0
    ) -> Any:
        """Returns the contact term of (37), the integral of (38) of all corners, for `ngsolve.Variation`.

        NGSolve takes mixed second derivatives from sums, so that steps of Newton's method lose digits where
        rho is more than 10^6 times the modulus over a length of the body; those of `virtual_work` do not.
        """
        require_positive(rho=rho)
        self._require_each(multipliers=multipliers)
        total = contact_term.density(
            self.boundary, self._gaps(self.initial_gaps, u, psi, approach), multipliers, rho
        )
        return self.boundary.integral(total)

    def virtual_work(
        self,
        u: Any,
        psi: Any,
        multipliers: Sequence[Any],
        v: Any,
        phi: Any,
        varied: Sequence[Any],
        *,
        rho: float,
        approach: Any = 0.0,
        varied_approach: Any = 0.0,
    ) -> Any:
        """Returns the contact term of the augmented virtual work (39) with (40), an integral.

        Parameters
        ----------
        u, psi, multipliers : trial functions, of multipliers one for each corner
        v, phi, varied : their test functions
        rho : float, stress over length
        approach, varied_approach : approach of the obstacle (length); its test function if it is an unknown

        Raises
        ------
        BadArgument
            If a function has other components than the mesh, a corner has no multiplier, or rho is not
            positive.
        """
        require_positive(rho=rho)
        self._require_each(multipliers=multipliers, varied=varied)
        gaps = self._gaps(self.initial_gaps, u, psi, approach)
        variations = self._gaps(np.zeros(self.initial_gaps.shape), v, phi, varied_approach)
        total: Any = 0
        for (g, can_touch), (dg, _), lam, dlam in zip(gaps, variations, multipliers, varied):
            total += contact_term.work(self.boundary, g, dg, lam, dlam, rho, can_touch)
        return self.boundary.integral(total)

    def _require_each(self, **functions: Sequence[Any]) -> None:
        for name, values in functions.items():
            words = f"must be {len(self.names)}, one for each of the corners {', '.join(self.names)}"
            if np.ndim(values) == 0 and not isinstance(values, Sequence):
                raise BadArgument(name, values, words)
            require(len(values) == len(self.names), name, values, words)
            for value in values:
                require(value.dim == 1, name, values, f"{words}, from the space `multipliers`")

    def pressures(self, multipliers: Sequence[Any]) -> Array:
        """Returns the pressures of the corners at the nodes, array (corners, n) (stress), from multipliers,
        grid functions: -lambda where the corner is closed.
        """
        self._require_each(multipliers=multipliers)
        return np.array([-self.boundary.at_nodes(multiplier) for multiplier in multipliers])

    def penalty_pressures(self, u: Any, psi: Any = None, *, rho: float, approach: float = 0.0) -> Array:
        """Returns the pressures ``rho <g>_-`` of the penalty method at the nodes, array (corners, n)
        (stress).
        """
        gaps = self._gaps(self.initial_gaps, u, psi, approach)
        values = [np.where(can_touch, self.boundary.at_nodes(g), 0.0) for g, can_touch in gaps]
        return rho * np.maximum(0.0, -np.array(values))
