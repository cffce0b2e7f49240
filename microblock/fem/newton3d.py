"""Contact of a body in three dimensions by penalty (31) or augmented Lagrangian (37), without factorisation.

The functional is minimised over the fields and the approach at once, the multipliers being fixed: a piecewise
quadratic, convex problem, of which Newton's method solves a linear system for each set A of closed corners,
those with ``lambda + rho g <= 0``. With S the values (u, phi1, phi2) at the nodes, D = (1, lever) and w the
areas of the nodes it is

    (K + S^T D^T rho w D S) u - c d = -S^T D^T w (lambda + rho g0),     c = S^T D^T rho w,
    -c.u + (sum rho w) d = P + sum w (lambda + rho g0),

sums over A. When A stays, the multipliers become min(lambda + rho g, 0), (40), until no gap of a closed
corner is left; the penalty method ends with the first A that stays. Corner forces that are not unique do no
harm: the matrix is positive definite whatever they are.

Systems are solved by conjugate gradients. Their preconditioner takes each field by itself, as a scalar
problem with its own springs, by the Cholesky factor of a sixth of the unknowns: a 36th of the memory. Korn's
inequality bounds the number of steps, whatever the mesh.
"""

import ngsolve as ng
import numpy as np
from scipy.sparse.linalg import LinearOperator, cg

from .. import cost
from ..errors import NOT_YET, BadArgument, NotConverged
from ..model.progress import counted
from ..model.solver import SOLVED
from ..threads import bounded
from .body import FIELDS3D, HELD3D, Fields
from .condensation import LINKED, of_factors, require_pressed, with_psi_constrained
from .facets import ContactNodes
from .solver3d import RESIDUAL, Solver3D
from .state3d import State3D

RHO = {"al": 8.0, "penalty": 1e3}  # times lambda + 2 mu over the length of a facet
LINEAR = 1e-2  # residual of the linear systems, relative, over that of the contact conditions so far
LOOSEST, TIGHTEST = 1e-4, 1e-10  # the same at most and at least
LINEAR_STEPS = 3000  # of conjugate gradients
COPIES = 2  # of the matrix of the bulk, with what builds it
NEWTON_STEPS = 60  # for one set of multipliers
UPDATES = 60  # of the multipliers


class NewtonSolver3D(Solver3D):
    """States of a body in space by penalty or augmented Lagrangian; its `options` are `Newton`."""

    @property
    def nodes(self):
        """The contact nodes of the body, of which a law that prescribes psi fixes psi1 and psi2."""
        body, clamped = self.body, self.surface_law.clamped
        require_pressed(body, body.contact, condensed=True)
        own = with_psi_constrained(body, body.contact) if clamped else body
        return body.once(("nodes", clamped), lambda: ContactNodes(own))

    @property
    def system(self):
        """The linear systems of the body; its matrix and preconditioner are made once."""
        return self.nodes.body.once("systems", lambda: Systems(self.nodes))

    @bounded
    def solve(self, load, approach, rtol, initial=None, progress=False):
        """Returns the State3D; parameters and errors are those of `Solver.solve`."""
        self.require_no_rtol(rtol)
        nodes, w = self.nodes, self.nodes.weights
        g0 = self.reachable_gaps()
        if load is None and approach <= g0.min():
            raise BadArgument("approach", approach, NOT_YET)
        rho = self.options.rho or self._usual_rho(nodes)
        multipliers, unknowns, steps, kkt = np.zeros(g0.shape), None, 0, 1.0
        updated = self.options.kind == "al"
        for _ in range(UPDATES):
            linear = min(max(LINEAR * kkt, TIGHTEST), LOOSEST) if updated else TIGHTEST
            unknowns, gaps, taken = self._newton(g0, rho, multipliers, load, approach, unknowns, linear)
            steps += taken
            pressed = np.minimum(multipliers + rho * np.where(np.isfinite(gaps), gaps, np.inf), 0.0)
            left = np.where(pressed < 0, np.abs(gaps), np.maximum(-gaps, 0.0)).max()
            multipliers = pressed
            kkt = left / np.abs((nodes.onto @ unknowns[:-1])[: len(w)]).max()
            if not updated or kkt <= RESIDUAL and linear <= 10 * LINEAR * RESIDUAL:
                return self._finished(unknowns, -multipliers * w, gaps, kkt, steps)
        raise NotConverged(
            f"gaps of {kkt:.1e} of the displacement are left after {UPDATES} updates of the multipliers: "
            "take a larger rho",
            iterations=steps,
        )

    def _usual_rho(self, nodes):
        """Stiffness of a facet's length of the solid, and more for the penalty (stress per length)."""
        length = np.sqrt(nodes.weights.sum() / len(nodes.facets)) / nodes.body.order
        return RHO[self.options.kind] * (self.solid.lam + 2 * self.solid.mu) / length

    def _newton(self, g0, rho, multipliers, load, approach, unknowns, linear):
        """(unknowns and approach, gaps, steps) for these multipliers."""
        nodes, directions = self.nodes, self.directions(self.nodes.points)
        if unknowns is None:
            closed = (
                g0 <= g0.min() + 1e-9 * np.ptp(g0[np.isfinite(g0)]) if load is not None else g0 < approach
            )
            unknowns = np.zeros(nodes.onto.shape[1] + 1)
        else:
            closed = multipliers < 0
        unknowns[-1] = approach if load is None else unknowns[-1]
        seen = set()
        for step in range(NEWTON_STEPS):
            counted()
            own = np.where(closed, nodes.weights, 0.0)
            force = own * np.where(closed, multipliers + rho * np.where(closed, g0, 0.0), 0.0)
            unknowns = self.system.solve(
                rho * own,
                directions,
                -np.einsum("cin,cn->in", directions, force),
                load,
                force.sum(),
                unknowns,
                linear,
            )
            surface = (nodes.onto @ unknowns[:-1]).reshape(3, -1)
            gaps = g0 - unknowns[-1] + np.einsum("cin,in->cn", directions, surface)
            before, wanted = closed, multipliers + rho * gaps
            closed = wanted <= 0
            # whether a corner without force counts as closed is a matter of rounding
            if np.abs(wanted[before != closed]).max(initial=0.0) <= linear * -wanted.min():
                return unknowns, gaps, step + 1
            if closed.tobytes() in seen:
                if linear == TIGHTEST:
                    break
                linear, seen = TIGHTEST, set()
            seen.add(closed.tobytes())
        raise NotConverged(
            f"the set of closed corners still changes after {step + 1} steps with rho = {rho:.3g}: take "
            "another rho, or Condensed()",
            iterations=step + 1,
        )

    def _finished(self, unknowns, forces, gaps, kkt, steps):
        """The state of these unknowns and corner forces."""
        nodes, law = self.nodes, self.surface_law
        forces = self.of_least_norm(forces, (forces > 0) | (gaps <= 0))
        loads = np.einsum("cin,cn->in", self.directions(nodes.points), forces)
        state = ng.GridFunction(nodes.body.space)
        state.vec.FV().NumPy()[:] = unknowns[:-1]
        exerted = self.system.product(unknowns[:-1]) - nodes.onto.T @ loads.ravel()
        fields = Fields(nodes.body, state.components, exerted)
        unbalanced = np.abs(exerted[np.array(nodes.body.space.FreeDofs())]).max() / np.abs(loads).max()
        if law.clamped:  # but what planes of symmetry exert
            m1, m2 = (nodes.moments_of(name, exerted) for name in ("psi1", "psi2"))
            loads[1:] = np.array((-m2, m1)) * 2 / self.solid.ell
            loads[1:] *= [nodes.is_free(name, self.body) for name in ("psi2", "psi1")]
        surface = (nodes.onto @ unknowns[:-1]).reshape(3, -1)
        found = State3D(
            self.contact,
            float(forces.sum()),
            float(unknowns[-1]),
            nodes,
            dict(zip(law.names, forces / nodes.weights)),
            surface,
            loads,
            (forces > 0).sum(axis=0),
            float(max(kkt, unbalanced)),
            steps,
            method="newton",
            found=fields,
        )
        moved = np.subtract(gaps, self.initial_gaps, out=np.zeros_like(gaps), where=np.isfinite(gaps))
        self.require_clear(found, moved + found.approach)
        return found


class Systems:
    """The linear systems of a body with springs at its contact nodes, solved by conjugate gradients.

    Parameters
    ----------
    nodes : ContactNodes
    """

    def __init__(self, nodes):
        self.nodes, body = nodes, nodes.body
        rows, linked = body.space.FreeDofs().NumSet(), LINKED * body.order
        needed = COPIES * cost.ENTRY * rows * linked + len(FIELDS3D) * of_factors(rows / 6, linked / 6)
        cost.require_room(needed, f"a body of {rows} unknowns", "take longer elements or a lower order")
        self.matrix = body.bulk().mat
        self._free = np.append(np.array(body.space.FreeDofs(), bool), True)
        self._parts = {name: alone(body, name) for name in FIELDS3D}
        self._springs = ng.GridFunction(ng.H1(body.mesh, order=1))
        trace = nodes.traces["u3"]
        vertices = np.diff(trace.indptr) == 1  # the first unknowns are those of the vertices
        self._vertices = vertices, trace.indices[trace.indptr[:-1]][vertices]
        self._in, self._out = (self.matrix.CreateColVector() for _ in range(2))
        self.products, self._prepared = 0, b""

    def product(self, fields):
        """K times unknowns."""
        self._in.FV().NumPy()[:] = fields
        self._out.data = self.matrix * self._in
        return self._out.FV().NumPy().copy()

    def precondition(self, forces):
        """Each field by itself."""
        found = np.empty_like(forces)
        for name, (part, *_) in self._parts.items():
            own = self.nodes.body.unknowns_of(name)
            right, solution = part.CreateColVector(), part.CreateColVector()
            right.FV().NumPy()[:] = forces[own]
            solution.data = part * right
            found[own] = solution.FV().NumPy()
        return found

    def _prepare(self, blocks):
        """Make the preconditioner of fields with springs, array (3, 3, n), anew."""
        half, (nodes, vertices) = self.nodes.body.solid.ell / 2, self._vertices
        for row, (name, factor) in enumerate((("u3", 1.0), ("psi2", half), ("psi1", half))):
            density = factor**2 * blocks[row, row] / self.nodes.weights
            self._springs.vec.FV().NumPy()[vertices] = density[nodes]
            self._parts[name] = alone(self.nodes.body, name, self._springs)

    def solve(self, springs, directions, force, load, more, start, linear):
        """Unknowns and approach of the system above.

        Parameters
        ----------
        springs : array (corners, n), stiffness of each
        directions : array (corners, 3, n)
        force : array (3, n), nodal loads
        load : float, or None where the last of `start` is the approach
        more : float, what is added to the load
        start : array (unknowns + 1,)
        linear : float, relative residual
        """
        onto = self.nodes.onto
        blocks = np.einsum("cin,cn,cjn->ijn", directions, springs, directions)
        across = onto.T @ np.einsum("cin,cn->in", directions, springs).ravel()
        free, whole = self._free.copy(), springs.sum()
        right = np.append(onto.T @ force.ravel(), 0.0)
        if load is None:
            right[:-1] += start[-1] * across
            free[-1] = False
        else:
            right[-1] = load + more

        def product(vector):
            self.products += 1
            vector = np.where(free, vector, 0.0)
            fields, d = vector[:-1], vector[-1]
            exerted = np.einsum("ijn,jn->in", blocks, (onto @ fields).reshape(3, -1)).ravel()
            found = self.product(fields) + onto.T @ exerted - d * across
            return np.where(free, np.append(found, whole * d - across @ fields), 0.0)

        def precondition(vector):
            return np.where(free, np.append(self.precondition(vector[:-1]), vector[-1] / whole), 0.0)

        if self._prepared != springs.tobytes():
            self._prepare(blocks)
            self._prepared = springs.tobytes()
        system, inverse = (LinearOperator((len(right),) * 2, each) for each in (product, precondition))
        found, right = np.where(free, start, 0.0), np.where(free, right, 0.0)
        left, size, before, failed = right - product(found), np.linalg.norm(right), np.inf, False
        # with a large rho `right` is a small difference of large numbers: what is left is to be small beside
        # the internal forces, and is solved for again as long as rounding lets it shrink
        while not failed and linear * size < (now := np.linalg.norm(left)) < before / 2:
            step, failed = cg(system, left, rtol=0, atol=linear * size, maxiter=LINEAR_STEPS, M=inverse)
            found, before = found + step, now
            left, size = right - product(found), np.linalg.norm(self.product(found[:-1])[free[:-1]])
        off = np.linalg.norm(left) / max(size, 1e-300)
        if not off <= max(10 * linear, SOLVED):
            raise NotConverged(
                f"conjugate gradients stand at the relative residual {off:.1e} after {LINEAR_STEPS} steps: "
                f"take a smaller rho, or Condensed(); {HELD3D}"
            )
        return np.where(free, found, start if load is None else 0.0)


def alone(body, name, stiff=None):
    """The scalar problem of a field of a body: (its inverse or multigrid, what that is made of, ...), which
    it does not keep itself; `stiff` is the stiffness of springs on the contact boundary, an expression."""
    solid, space = body.solid, ng.H1(body.mesh, order=body.order, dirichlet=body.fixed.get(name, ""))
    trial, test = space.TnT()
    form = ng.BilinearForm(space, symmetric=True)
    slope = solid.mu * ng.InnerProduct(ng.grad(trial), ng.grad(test))
    if name.startswith("u"):
        form += slope * ng.dx
    else:
        form += (solid.curvature * solid.ell**2 / 2 * slope + 4 * solid.mu_c * trial * test) * ng.dx
    if stiff is not None:
        form += stiff * trial * test * ng.ds(definedon=body.boundary(body.contact))
    form.Assemble()
    return form.mat.Inverse(space.FreeDofs(), "sparsecholesky"), form, space
