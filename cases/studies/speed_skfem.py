"""The classical line contact in scikit-fem: plane strain, nodal contact, primal-dual active set.

Geometry   half of a square of ground, graded to the far field: line for line the mesh of
           `microblock.fem.meshes.uniform`.
Equations  classical elasticity, unilateral contact of the nodes of the surface (those of the Gauss-Lobatto
           rule of each side).
Model      skfem's bilinear or biquadratic quadrilaterals. scikit-fem has no contact of its own; this is what
           its users write: the nodes of the active set are Dirichlet nodes on the obstacle, their reactions
           the forces (Hintermueller, Ito and Kunisch, SIAM J. Optim. 13 (2003) 865). With the set given the
           state is affine in the approach: two right-hand sides of one factorisation meet the load.
Tuned      in favour of scikit-fem: the set starts as the exact contact; SuperLU factorises in symmetric mode,
           with the ordering that is best for these matrices, instead of scipy's default.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse.linalg import splu

from microblock.errors import NotConverged
from microblock.fem.meshes import uniform_lines
from microblock.model.quadrature import lagrange

ELEMENTS = {1: "ElementQuad1", 2: "ElementQuad2"}
STEPS = 30  # of the active set; four or so are needed
SYMMETRIC = {"permc_spec": "MMD_AT_PLUS_A", "diag_pivot_thresh": 0.0, "options": {"SymmetricMode": True}}


@dataclass(frozen=True)
class Surface:
    """A state on the surface: contact nodes, nodal forces and lengths that they stand for, arrays (n,); of
    the half x1 > 0.
    """

    x: np.ndarray
    forces: np.ndarray
    weights: np.ndarray
    approach: float
    iterations: int
    order: int

    def pressure(self, x):
        """At x1 >= 0, array (n,): on each side of an element the polynomial through the nodal forces over
        their lengths.
        """
        nodal, ends, width = self.forces / self.weights, self.x[:: self.order], self.order + 1
        facet = np.clip(np.searchsorted(ends, x) - 1, 0, len(ends) - 2)
        members = self.order * facet[:, None] + np.arange(width)
        shape = lagrange(np.linspace(0, 1, width), (x - ends[facet]) / (ends[1] - ends[0]))
        return np.where(x <= ends[-1], np.einsum("ij,ij->i", shape, nodal[members]), 0)


@dataclass(frozen=True)
class Ground:
    """A quarter of ground, 0 < x1 < far and -far < x2 < 0, with equal squares within `reach`; lengths over
    one unit.

    Parameters
    ----------
    lam, mu : Lame's constants of plane strain
    far, reach, h : size, region of equal squares, their side
    order : 1 or 2
    """

    lam: float
    mu: float
    far: float
    reach: float
    h: float
    order: int = 1

    def prepare(self):
        """Mesh and matrix, made once and kept."""
        return self._system

    @cached_property
    def _system(self):
        import skfem  # an extra: this module is imported without it, too
        from skfem.models.elasticity import linear_elasticity

        lines = uniform_lines(self.reach, self.far, self.h)
        mesh = skfem.MeshQuad.init_tensor(lines, -lines[::-1])
        basis = skfem.Basis(mesh, skfem.ElementVector(getattr(skfem, ELEMENTS[self.order])()))
        return basis, linear_elasticity(self.lam, self.mu).assemble(basis).tocsc()

    @property
    def unknowns(self):
        """Free unknowns of the bulk."""
        return len(self._free)

    @cached_property
    def _free(self):
        basis, _ = self.prepare()
        x, y = basis.doflocs
        across = np.zeros(basis.N, bool)
        across[basis.get_dofs(lambda x: x[0] == 0).all("u^1")] = True
        return np.flatnonzero(~across & (y > y.min()))

    @cached_property
    def _nodes(self):
        """Vertical unknowns on the surface within the reach, in the order of x1; abscissae; lengths by
        Lobatto's rule.
        """
        basis, _ = self.prepare()
        vertical = basis.get_dofs(lambda x: x[1] == 0).all("u^2")
        vertical = vertical[np.argsort(basis.doflocs[0, vertical])]
        x = basis.doflocs[0, vertical]
        ends = x[:: self.order]
        weights, shares = np.zeros(len(x)), ((1 / 2, 1 / 2), (1 / 6, 2 / 3, 1 / 6))[self.order - 1]
        for place, share in enumerate(shares):
            np.add.at(weights, self.order * np.arange(len(ends) - 1) + place, share * np.diff(ends))
        near = x <= self.reach * (1 + 1e-9)
        return vertical[near], x[near], weights[near]

    def solve(self, height, load, start):
        """The state under a rigid obstacle height(x1) at half the whole load; `start`: half-width of the
        first active set.

        Raises
        ------
        NotConverged
            If the active set still changes after STEPS.
        """
        nodes, x, weights = self._nodes
        gaps, closed = height(x), x <= start
        for iteration in range(1, STEPS + 1):
            forces, raised, approach = self._state(nodes, gaps, closed, load)
            wanted = np.where(closed, forces > 0, gaps - approach < raised)
            if np.array_equal(wanted, closed):
                return Surface(x, forces, weights, approach, iteration, self.order)
            closed = wanted
        raise NotConverged(f"the active set still changes after {STEPS} steps", iterations=STEPS)

    def _state(self, nodes, gaps, closed, load):
        """Nodal forces, u2 of the nodes and approach for an active set."""
        basis, matrix = self.prepare()
        constrained = nodes[closed]
        free = np.setdiff1d(self._free, constrained, assume_unique=True)
        columns = np.zeros((basis.N, 2))  # u2 of the constrained nodes: their gaps, and one
        columns[constrained] = np.column_stack((gaps[closed], np.ones(closed.sum())))
        rows = matrix[free]
        columns[free] = splu(rows[:, free].tocsc(), **SYMMETRIC).solve(-(rows @ columns))
        reactions = -(matrix[constrained] @ columns)
        of_gaps, of_one = reactions.sum(axis=0)
        approach = (of_gaps - load) / of_one
        forces = np.zeros(len(nodes))
        forces[closed] = reactions @ (1, -approach)
        return forces, columns[nodes] @ (1, -approach), float(approach)
