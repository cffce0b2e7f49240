"""Other programs on the classical line contact, a rigid cylinder R = 1 with E* = 2 at the load pi/2.

scikit-fem has no contact of its own; this is what its users write: nodes of the active set are Dirichlet
nodes on the obstacle, their reactions the forces. NGSolve's ContactBoundary is used as in its tutorial 6.2,
with Newton's method and a penalty. Both have half of the ground on the mesh of
`microblock.fem.meshes.uniform`, and the load by two right-hand sides of one factorisation. Each is tuned in
its favour: scikit-fem starts with the exact contact and has the best ordering for its matrices;
ContactBoundary starts at about the right approach, its counterpart is finer than the ground, and the better
of two readings of its pressure counts; period and rho are the best of each mesh.
"""

from collections.abc import Callable
from dataclasses import dataclass
from time import process_time as clock  # what other programs do on this machine does not count

import netgen.meshing as netgen
import ngsolve as ng
import numpy as np
from scipy.sparse.linalg import splu

from microblock import NotConverged
from microblock.fem.facet_rules import lobatto
from microblock.fem.meshes import uniform_lines
from microblock.model.quadrature import lagrange

LOAD, REACH, FAR = np.pi / 2, 2.0, 2000.0  # half-width of the equal squares; where the ground ends, over a_Hz
STEPS = 40  # of active sets and of Newton's method; two to six are needed
# the gap is measured between nearest points of the deformed bodies: at this radius slopes change it by 1e-8
RADIUS = 1e4
FINER = 8  # elements of a bilinear counterpart on one of the ground: a chord is off the parabola


@dataclass(frozen=True)
class Answer:
    """What a run gives: x -> (p, M/ell), or several readings of it, unknowns, and processor seconds."""

    fields: Callable | list
    unknowns: int
    setup: float
    solve: float
    estimate: float | None = None


def tamaas(problem, nodes, period):
    """E* = 2 here and 1 there: half the load gives half the pressures on the same zone."""
    import tamaas as library

    library.initialize(1)  # threads
    library.set_log_level(library.LogLevel.error)
    x, start = (np.arange(nodes) - nodes // 2) * period / nodes, clock()
    model = library.ModelFactory.createModel(library.model_type.basic_1d, [float(period)], [nodes])
    model.E, model.nu = 1.0, 0.0
    solver = library.PolonskyKeerRey(model, -(x**2) / 2, 1e-7)
    ready = clock()
    solver.solve(LOAD / 2 / period)
    spent, p = clock() - ready, 2 * np.array(model.traction).ravel()
    return Answer(lambda at: (np.interp(at, x, p, left=0, right=0), 0 * at), nodes, ready - start, spent)


def on_facets(ends, places, values):
    """A function of x: on each facet between `ends` the polynomial with these values (facets, points) at
    places in [0, 1]; even, and zero beyond.
    """

    def pressure(x):
        x = np.abs(x)
        facet = np.clip(np.searchsorted(ends, x) - 1, 0, len(values) - 1)
        shape = lagrange(places, (x - ends[facet]) / (ends[1] - ends[0]))
        return np.where(x <= ends[-1], np.einsum("ij,ij->i", shape, values[facet]), 0), 0 * x

    return pressure


def scikit_fem(problem, h, order):
    import skfem
    from skfem.models.elasticity import linear_elasticity

    start, lines = clock(), uniform_lines(REACH, FAR, h)
    element = skfem.ElementVector((skfem.ElementQuad1, skfem.ElementQuad2)[order - 1]())
    basis = skfem.Basis(skfem.MeshQuad.init_tensor(lines, -lines[::-1]), element)
    matrix = linear_elasticity(problem.solid.lam, problem.solid.mu).assemble(basis).tocsc()
    axis, bottom = (basis.get_dofs(where) for where in (lambda x: x[0] == 0, lambda x: x[1] == -FAR))
    inside = np.setdiff1d(np.arange(basis.N), [*axis.all("u^1"), *bottom.all()])
    ready = clock()
    nodes = basis.get_dofs(lambda x: x[1] == 0).all("u^2")
    x = basis.doflocs[0, nodes]
    nodes, x = nodes[np.argsort(x)], np.sort(x)
    nodes, x = nodes[x <= REACH * (1 + 1e-9)], x[x <= REACH * (1 + 1e-9)]
    closed = x <= 1.0
    for _ in range(STEPS):
        free, fixed = np.setdiff1d(inside, nodes[closed]), nodes[closed]
        columns = np.zeros((basis.N, 2))  # u2 of the closed nodes: their gaps, and one
        columns[fixed] = np.column_stack((x[closed] ** 2 / 2, np.ones(len(fixed))))
        columns[free] = splu(
            matrix[free][:, free].tocsc(),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        ).solve(-(matrix[free] @ columns))
        reactions = -(matrix[fixed] @ columns)
        of_gaps, of_one = reactions.sum(axis=0)
        share = np.array([1, -(of_gaps - LOAD / 2) / of_one])
        forces = np.zeros(len(x))
        forces[closed] = reactions @ share
        wanted = np.where(closed, forces > 0, x**2 / 2 + share[1] < columns[nodes] @ share)
        if np.array_equal(wanted, closed):
            break
        closed = wanted
    else:
        raise NotConverged(f"the active set still changes after {STEPS} steps", iterations=STEPS)
    spent, places = clock() - ready, lobatto(order)
    return Answer(from_forces(x[::order], *places, forces), len(inside), ready - start, spent)


def from_forces(ends, places, shares, forces):
    """Pressures of nodal forces over the lengths that nodes stand for, as `on_facets` reads them."""
    order, side = len(places) - 1, ends[1] - ends[0]
    lengths = np.zeros(len(forces))
    for place, share in enumerate(shares):
        lengths[place : len(lengths) - order + place : order] += share * side
    lengths[-1] *= 2  # goes on beyond the reach
    values = forces / lengths
    return on_facets(
        ends, places, np.array([values[n : n + order + 1] for n in range(0, len(values) - 1, order)])
    )


def contact_boundary(problem, h, order, rho):
    start, lines = clock(), uniform_lines(REACH, FAR, h)
    mesh = ground_and_counterpart(lines, FINER if order == 1 else 1)
    space = ng.VectorH1(mesh, order=order, dirichletx="bottom|axis", dirichlety="bottom")
    u = space.TrialFunction()
    strain = ng.Sym(ng.Grad(u))
    energy = problem.solid.lam / 2 * ng.Trace(strain) ** 2 + problem.solid.mu * ng.InnerProduct(
        strain, strain
    )
    form = ng.BilinearForm(space, symmetric=True)
    form += ng.Variation(energy * ng.dx("ground"))
    contact = ng.ContactBoundary(mesh.Boundaries("contact"), mesh.Boundaries("under"))
    place = ng.CF((ng.x, ng.y))
    penetration = (place + u - place.Other() - u.Other()) * contact.normal
    contact.AddEnergy(ng.IfPos(penetration, rho / 2 * penetration**2, 0))
    state, lowered = ng.GridFunction(space), ng.GridFunction(space)
    state.Set(ng.CF((0, ng.x**2 / 2 / RADIUS)), definedon=mesh.Materials("tool"))
    lowered.Set(ng.CF((0, -1)), definedon=mesh.Materials("tool"))
    contact.Update(state, form, intorder=2 * order + 1, maxdist=1e-2)
    free = space.FreeDofs() & ~space.GetDofs(mesh.Materials("tool"))
    ready = clock()
    # the far field of this mesh approaches by 4.15, within a percent
    approach = lower(form, free, state, lowered, LOAD / 2 / RADIUS, 4.15 / RADIUS, rho)
    spent, rule = clock() - ready, ng.IntegrationRule(ng.SEGM, 2 * order + 1)
    points = mesh.MapToAllElements({ng.SEGM: rule}, mesh.Boundaries("contact"))
    x, u2 = (np.ravel(field(points)) for field in (ng.x, state.components[1]))
    x, u2 = (values[np.argsort(x)].reshape(-1, len(rule)) for values in (x, u2))
    ends = np.linspace(0, REACH, len(x) + 1)
    places, penalty = x[0] / ends[1], rho * RADIUS * (u2 - x**2 / 2 / RADIUS + approach)
    nodes, shares = lobatto(order)
    weights, forces = np.polynomial.legendre.leggauss(order + 1)[1] / 2, np.zeros(order * len(x) + 1)
    for facet, own in enumerate(np.maximum(penalty, 0) * weights @ lagrange(nodes, places) * ends[1]):
        forces[order * facet : order * facet + order + 1] += own
    by_penetration = on_facets(ends, places, penalty)
    readings = [
        from_forces(ends, nodes, shares, forces),
        lambda x: (np.maximum(by_penetration(x)[0], 0), 0 * x),
    ]
    return Answer(readings, sum(free), ready - start, spent)


def lower(form, free, state, lowered, load, approach, rho):
    """Newton's method for the state and its approach, which is returned."""
    state.vec.data += approach * lowered.vec
    residual, moved, first, second, product = (state.vec.CreateVector() for _ in range(5))
    inside = ng.Projector(free, True)
    # rounding of rho times the penetration; all is as small as the slopes
    enough = max(1e-10 * load, 10 * np.finfo(float).eps * rho * approach * REACH)
    for _ in range(STEPS):
        form.Apply(state.vec, residual)
        force = ng.InnerProduct(lowered.vec, residual)
        product.data = inside * residual
        if max(product.Norm(), abs(force - load)) < enough:
            return approach
        form.AssembleLinearization(state.vec)
        inverse = form.mat.Inverse(free, "sparsecholesky")
        moved.data = form.mat * lowered.vec
        first.data, second.data = inverse * residual, inverse * moved
        stiffness = ng.InnerProduct(lowered.vec, moved) - ng.InnerProduct(moved, second)
        further = (load - force + ng.InnerProduct(moved, first)) / stiffness
        state.vec.data += further * lowered.vec - first - further * second
        approach += further
    raise NotConverged(f"Newton has not ended after {STEPS} steps", iterations=STEPS)


def ground_and_counterpart(lines, finer):
    """One mesh of quadrilaterals: the ground, and above the reach a row of elements, boundary "under"."""
    mesh, near = netgen.Mesh(dim=2), round(np.searchsorted(lines, REACH * (1 + 1e-9))) - 1
    sides = {
        "bottom": np.s_[0, :],
        "side": np.s_[:, -1],
        "axis": np.s_[::-1, 0],
        "contact": np.s_[-1, near::-1],
        "free": np.s_[-1, : near - 1 : -1],
    }
    above = {"under": np.s_[0, :], "right": np.s_[:, -1], "over": np.s_[1, ::-1], "left": np.s_[::-1, 0]}
    rows = np.linspace(0, REACH, near * finer + 1), np.array((0, lines[1]))
    for name, across, up, boundaries in (("ground", lines, -lines[::-1], sides), ("tool", *rows, above)):
        points = [netgen.MeshPoint(netgen.Pnt(float(x), float(y), 0)) for y in up for x in across]
        nodes = np.array([mesh.Add(point).nr for point in points]).reshape(len(up), len(across))
        domain = mesh.AddRegion(name, dim=2)
        cells = np.stack((nodes[:-1, :-1], nodes[:-1, 1:], nodes[1:, 1:], nodes[1:, :-1]), axis=-1)
        for cell in cells.reshape(-1, 4).tolist():
            mesh.Add(netgen.Element2D(domain, [netgen.PointId(node) for node in cell]))
        for boundary, index in boundaries.items():
            number, line = mesh.AddRegion(boundary, dim=1), nodes[index].tolist()
            for ends in zip(line, line[1:]):
                mesh.Add(netgen.Element1D([netgen.PointId(node) for node in ends], index=number))
    return ng.Mesh(mesh)
