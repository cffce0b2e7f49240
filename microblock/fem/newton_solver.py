"""Contact of a body on a mesh by the monolithic Newton method, augmented Lagrangian or penalty."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..corners.nodal import AtNodes, zones_of
from ..errors import BadArgument
from ..model.solver import Solver
from .condensation import with_psi_constrained
from .facets import ContactFacets
from .mesh_fields import BelowOnMesh
from .newton import MonolithicNewton, NodalState
from .newton_path import load_path

ADRIFT = "no support holds u1: displacements along x1 hold up to a translation"


@dataclass(frozen=True, eq=False, repr=False)
class NewtonSolution(BelowOnMesh, AtNodes):
    """A solution with one multiplier a corner and node.

    Attributes
    ----------
    solver : NewtonSolver
    nodal : NodalState, nodes as the facets have them; all that follows is in the order of x1
    """

    solver: Solver
    nodal: NodalState
    unknowns: int

    method = "newton"

    @property
    def load(self):
        return self.nodal.load

    @property
    def approach(self):
        return self.nodal.approach

    @property
    def residual(self):
        return self.nodal.kkt

    @property
    def iterations(self):
        return self.nodal.iterations

    @property
    def fields(self):
        return self.nodal.fields

    @property
    def _facets(self):
        return self.solver.facets

    @cached_property
    def _order(self):
        return np.argsort(self._facets.points[:, 0], kind="stable")

    @property
    def points(self):
        return self._facets.points[self._order]

    @property
    def apart(self):
        """Whether the boundary is interrupted between a node and the next; None in one dimension."""
        return self._facets.apart if self.has_edges else None

    @property
    def normals(self):
        return self._facets.normals[self._order]

    @property
    def weights(self):
        return self._facets.weights[self._order]

    @property
    def psi(self):
        return self.nodal.psi[self._order]

    @cached_property
    def micromoment(self):
        """M of (29); where the law or supports of the contact boundary hold psi, the reaction to it."""
        facets, found = self._facets, self.nodal.micromoment
        if facets.psi_held:
            found = found + facets.moments_of("psi", self.fields.forces) / facets.weights
        return found[self._order]

    @cached_property
    def pressures(self):
        return np.array([-self.nodal.multipliers[corner] for corner in self._facets.corners])[:, self._order]

    @cached_property
    def displacement(self):
        """-u.n at the nodes."""
        u1, u2 = (self._facets.values(name, self.fields)[self._order] for name in ("u1", "u2"))
        return -(u1 * self.normals[:, 0] + u2 * self.normals[:, 1])

    @property
    def has_edges(self):
        return self.solver.body.mesh.dim == 2 and not self.solver.body.periodic

    @property
    def period(self):
        return None if self.has_edges else self.weights.sum()

    @property
    def end(self):
        """Where a period ends; None of a body with edges."""
        return None if self.has_edges else self.x[0] + self.period

    @cached_property
    def zones_by_name(self):
        """Zones of the nodes, within a period of a body that repeats, per unit length of a 1D one."""
        closed = np.array([self.nodal.closed[corner] for corner in self._facets.corners])[:, self._order]
        return zones_of(self.x, closed, self.law, self.apart, self.end)

    @cached_property
    def energy(self):
        """Elastic energy, of displacements and rotations that supports prescribe as well."""
        return float(self.fields.energy())

    def remarks(self):
        return (
            self.overlap()
            + self.locking(self._facets)
            + (self.few_nodes("take smaller elements") if self.has_edges else [])
            + ([] if "u1" in self.solver.body.fixed else [ADRIFT])
        )

    def interpolated(self, values, x):
        if self.has_edges:
            return super().interpolated(values, x)
        return np.interp(x, self.x, values, period=self.period)

    def reaches(self, x):
        return super().reaches(x) if self.has_edges else np.isfinite(x)


class NewtonSolver(Solver):
    """States of a body on a mesh, also a periodic or a one-dimensional one; its `options` are `Newton`.

    A law that prescribes psi adds psi = 0 on the contact boundary to the supports, where these do not
    prescribe it.
    """

    verifies = True

    def __init__(self, contact, options):
        super().__init__(contact, options)
        self.body.pressed(self.body.contact)  # BadArgument where it cannot be

    @cached_property
    def facets(self):
        """The contact nodes of the body."""
        return ContactFacets(self.supported, self.law, self.obstacle, boundary=self.body.contact)

    @cached_property
    def supported(self):
        """The body, with psi = 0 on the contact boundary where the law prescribes it."""
        body = self.body
        return with_psi_constrained(body, body.contact) if self.law.clamps_rotation else body

    def solve(self, load, approach, rtol, initial=None, progress=False):
        if rtol is not None:
            raise BadArgument(
                "rtol",
                rtol,
                "needs a condensed body or a mesh that the program makes; Newton() takes the mesh as it is",
            )
        newton = self.newton("load" if approach is None else "approach")
        start = initial.nodal if isinstance(initial, NewtonSolution) else None
        if start is not None and (start.vector is None or len(start.vector) != newton.space.ndof):
            start = None
        level = load if approach is None else approach
        if start is not None or level == 0:
            return NewtonSolution(self, newton.solve(level, start), newton.unknowns)
        (state,) = load_path(newton, [level])
        return NewtonSolution(self, state, newton.unknowns)

    def history(self, pairs, coupled, rtol, progress=False):
        from .friction_solution import of_newton  # here: it is made of these solutions

        return of_newton(self, pairs, coupled, rtol)

    def newton(self, control):
        """The MonolithicNewton of a control, "load" or "approach", made once."""
        if control not in self._systems:
            options = self.options
            self._systems[control] = MonolithicNewton(
                self.facets.body, self.facets, method=options.kind, rho=options.rho, control=control
            )
        return self._systems[control]

    @cached_property
    def _systems(self):
        """{control: MonolithicNewton}."""
        return {}
