"""Other programs on the classical line contact, a rigid cylinder R = 1 with E* = 2 at the load pi/2.

scikit-fem has no contact of its own; this is what its users write: nodes of the active set are Dirichlet
nodes on the obstacle, their reactions the forces. It has half of the ground on the mesh of
`microblock.fem.meshes.uniform`, and the load by two right-hand sides of one factorisation. Each program is
tuned in its favour: scikit-fem starts with the exact contact and has the best ordering for its matrices; the
period of tamaas is the best of each grid.
"""

from collections.abc import Callable
from dataclasses import dataclass
from time import process_time as clock  # what other programs do on this machine does not count

import numpy as np
from scipy.sparse.linalg import splu

from microblock import NotConverged
from microblock.fem.facet_rules import lobatto
from microblock.fem.meshes import uniform_lines
from microblock.model.quadrature import lagrange

LOAD, REACH, FAR = np.pi / 2, 2.0, 2000.0  # half-width of the equal squares; where the ground ends, over a_Hz
STEPS = 40  # of active sets; two to six are needed


@dataclass(frozen=True)
class Answer:
    """What a run gives: x -> (p, M/ell), unknowns, and processor seconds."""

    fields: Callable
    unknowns: int
    setup: float
    solve: float
    estimate: float | None = None


def tamaas(problem, nodes, period):
    """E* = 2 here and 1 there: half the load gives half the pressures on the same zone."""
    import tamaas as library

    library.initialize(1)  # threads
    library.set_log_level(library.LogLevel.error)
    x = (np.arange(nodes) - nodes // 2) * period / nodes
    start = clock()
    model = library.ModelFactory.createModel(library.model_type.basic_1d, [float(period)], [nodes])
    model.E = 1.0
    model.nu = 0.0
    solver = library.PolonskyKeerRey(model, -(x**2) / 2, 1e-7)
    ready = clock()
    solver.solve(LOAD / 2 / period)
    spent = clock() - ready
    p = 2 * np.array(model.traction).ravel()
    return Answer(lambda at: (np.interp(at, x, p, left=0, right=0), 0 * at), nodes, ready - start, spent)


def scikit_fem(problem, h, order):
    import skfem
    from skfem.models.elasticity import linear_elasticity

    start = clock()
    lines = uniform_lines(REACH, FAR, h)
    element = skfem.ElementVector((skfem.ElementQuad1, skfem.ElementQuad2)[order - 1]())
    basis = skfem.Basis(skfem.MeshQuad.init_tensor(lines, -lines[::-1]), element)
    matrix = linear_elasticity(problem.solid.lam, problem.solid.mu).assemble(basis).tocsc()
    axis = basis.get_dofs(lambda x: x[0] == 0).all("u^1")
    bottom = basis.get_dofs(lambda x: x[1] == -FAR).all()
    inside = np.setdiff1d(np.arange(basis.N), [*axis, *bottom])
    ready = clock()
    nodes = basis.get_dofs(lambda x: x[1] == 0).all("u^2")
    nodes = nodes[np.argsort(basis.doflocs[0, nodes])]
    nodes = nodes[basis.doflocs[0, nodes] <= REACH * (1 + 1e-9)]
    x = basis.doflocs[0, nodes]
    forces = active_nodes(matrix, inside, nodes, x)
    spent = clock() - ready
    return Answer(pressure_of_forces(x[::order], order, forces), len(inside), ready - start, spent)


def active_nodes(matrix, inside, nodes, x):
    """Forces on the surface's nodes at x under half of the load; `inside` are the degrees of freedom that no
    support takes.
    """
    closed = x <= 1.0
    for _ in range(STEPS):
        free = np.setdiff1d(inside, nodes[closed])
        columns = np.zeros((matrix.shape[0], 2))  # u2 of the closed nodes: their gaps, and one
        columns[nodes[closed]] = np.column_stack((x[closed] ** 2 / 2, np.ones(closed.sum())))
        stiffness = matrix[free][:, free].tocsc()
        factors = splu(
            stiffness, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
        )
        columns[free] = factors.solve(-(matrix[free] @ columns))
        reactions = -(matrix[nodes[closed]] @ columns)
        of_gaps, of_unit = reactions.sum(axis=0)
        share = np.array([1, -(of_gaps - LOAD / 2) / of_unit])
        forces = np.zeros(len(x))
        forces[closed] = reactions @ share
        touching = np.where(closed, forces > 0, x**2 / 2 + share[1] < columns[nodes] @ share)
        if np.array_equal(touching, closed):
            return forces
        closed = touching
    raise NotConverged(f"the active set still changes after {STEPS} steps", iterations=STEPS)


def pressure_of_forces(ends, order, forces):
    """A function x -> (p, 0): nodal forces over the lengths that nodes stand for, on each facet between
    `ends` a polynomial; even, and zero beyond.
    """
    side = ends[1] - ends[0]
    places, shares = lobatto(order)
    lengths = np.zeros(len(forces))
    for place, share in enumerate(shares):
        lengths[place : len(lengths) - order + place : order] += share * side
    lengths[-1] *= 2  # goes on beyond the reach
    nodal = forces / lengths
    values = np.array([nodal[n : n + order + 1] for n in range(0, len(nodal) - 1, order)])

    def pressure(x):
        x = np.abs(x)
        facet = np.clip(np.searchsorted(ends, x) - 1, 0, len(values) - 1)
        shape = lagrange(places, (x - ends[facet]) / side)
        return np.where(x <= ends[-1], np.einsum("ij,ij->i", shape, values[facet]), 0), 0 * x

    return pressure
