"""The contact law on the nodes of a contact boundary, (25)-(40), in one to three dimensions."""

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import ngsolve as ng
import numpy as np
from scipy.sparse import vstack

from ..contact_solvers.compliance import nearest_alone
from ..errors import require
from ..model import law as laws
from ..model.corner_geometry import Blocks, CornerGeometry
from ..model.law import Law
from ..model.types import Array, Flags, ObstacleLike
from . import contact_term, supports
from .body import Body
from .contact_nodes import ContactNodes
from .facet_rules import ROUNDED


class ContactFacets(ContactNodes):
    """The nodes of a contact boundary and the terms of a contact law on them.

    Parameters
    ----------
    body : Body
    law : a law of `microblock.model.law`
    obstacle : see `microblock.model.obstacles.initial_gap`

    Attributes
    ----------
    points, normals, weights, ... : as of `ContactNodes`
    arms : array (corners, n, dim), places of the corners from the centres of their blocks (lengths)
    g0 : array (corners, n), initial gaps; inf where a corner cannot touch
    twins : boolean array (n,); there all corners have the same gap, and share one multiplier

    Examples
    --------
    >>> from microblock.fem import meshes
    >>> body = mb.Body(meshes.column(depth=1.0, elements=2),
    ...                mb.Cosserat(E=2.6, nu=0.3, ell=0.2, beta=1), order=4,
    ...                fixed={"u1": "middle", "u2": "middle"}, periodic=True)
    >>> from microblock.fem.facets import ContactFacets
    >>> facets = ContactFacets(body, mb.Microblock(psi0=0.02), mb.Plane(level=0.002))
    >>> facets.g0.shape, round(float(facets.weights.sum()), 9)
    ((2, 4), 0.5)
    """

    def __init__(self, body: Body, law: Law, obstacle: ObstacleLike) -> None:
        laws.check(law)
        words = "belongs to FrictionFacets: these terms know no shear tractions"
        friction = law.friction
        require(not friction, "friction", friction, words)
        super().__init__(body)
        self._made_of = (body, law, obstacle)
        require(
            body.element_orders is None,
            "body",
            body,
            "must have one order for all elements: the contact rule is the same on every facet",
        )
        self.law = law
        blocks = Blocks(law, body.solid.ell, body.in_space)
        geometry = blocks.under(obstacle, self.points, self.normals)
        self.arms = np.broadcast_to(geometry.offsets_from_centre, (len(blocks.names), *self.points.shape))
        self.g0 = gaps_at_nodes(geometry, self)
        if self.dim < 3:
            self._take_nearest()

    def _take_nearest(self) -> None:
        """Leaves the nearest corner alone where psi is held; corners with one gap are twins."""
        fixed = ~self.free["psi"]
        require(
            fixed.all() or not self.law.clamps_rotation,
            "law",
            self.law,
            "prescribes psi on the surface: the body must fix psi on its contact boundary",
        )
        held = ng.GridFunction(self.body.space)
        supports.prescribe(self.body, held.components)
        gaps = self.g0 - self.displacements(held.vec.FV().NumPy())
        rounding = ROUNDED * self.body.solid.ell
        self.twins = fixed & (len(gaps) > 1) & (gaps.max(axis=0) <= gaps.min(axis=0) + rounding)
        self.g0 = np.where(np.isfinite(nearest_alone(gaps, fixed)), self.g0, np.inf)

    @cached_property
    def _corner_rows(self) -> Any:
        """Displacements of corners along the normal from all unknowns, sparse (corners n, unknowns)."""
        return vstack([self.motion(self.normals, arms) for arms in self.arms], format="csr")

    def displacements(self, fields: Array) -> Array:
        """Returns displacements of corners along the normal, (corners, n), from unknowns of the body."""
        return (self._corner_rows @ fields).reshape(len(self.arms), -1)

    def exerted(self, forces: Array) -> Array:
        """Returns what corner forces along -n, (corners, n), add to the first variation, (unknowns,)."""
        return np.asarray(self._corner_rows.T @ forces.ravel())

    def contact(
        self, g0: Array, components: Sequence[Any], multipliers: Sequence[Any], approach: Any, rho: Any
    ) -> Any:
        """Returns the contact term of (37), or of (31), from initial gaps, array (corners, n)."""
        vectors = self.body.vectors(components)
        up = (0, 1, 0) if self.dim < 3 else (0, 0, 1)
        return contact_term.contact(self, g0, self.arms, *vectors, multipliers, -approach * ng.CF(up), rho)


def gaps_at_nodes(geometry: CornerGeometry, nodes: ContactNodes) -> Array:
    """Returns the initial gaps of corners at nodes, array (corners, n): inf where no obstacle is above, and
    in space where supports hold a node along n; raises BadArgument if all are.
    """
    nodes.require_upwards()
    if nodes.dim < 3:
        return gaps_at_points(geometry)
    return gaps_at_points(geometry, nodes.moves)


def gaps_at_points(geometry: CornerGeometry, free: Flags | bool = True) -> Array:
    """Returns the initial gaps of corners, array (corners, n): inf where no obstacle is above, or a point is
    not `free`; raises BadArgument if all are.
    """
    gaps = np.where(free, geometry.initial_gaps, np.inf)
    touching = np.isfinite(gaps).any()
    require(touching, "obstacle", geometry.obstacle, "lies over no node of the contact boundary")
    return gaps
