"""Contact of a body in three dimensions by penalty (31) or augmented Lagrangian (37), without factorisation.

The functional is minimised over the fields and the approach at once, the multipliers being given: a piecewise
quadratic, convex problem, of which Newton's method solves a linear system for each set of closed corners,
those with ``lambda + rho g <= 0``. Its residual and tangent are those of the contact term
(`microblock.fem.contact_term`) and of the bulk. When the set stays, the multipliers become (40), until no gap
of a closed corner is left; the penalty method ends with the first set that stays. Corner forces that are not
unique do no harm: the matrix is positive definite whatever they are.

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
from . import contact_term
from .body import FIELDS3D, HELD3D, Fields
from .bulk import as_csr
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
        term, steps, kkt = Penalised(nodes, g0, self.law, rho, load), 0, 1.0
        unknowns = np.zeros(nodes.body.space.ndof + 1)
        # from first touch on, else the approach would be free
        first = g0.min() + 1e-9 * np.ptp(g0[np.isfinite(g0)])
        unknowns[-1] = first if approach is None else approach
        updated = self.options.kind == "al"
        for _ in range(UPDATES):
            linear = min(max(LINEAR * kkt, TIGHTEST), LOOSEST) if updated else TIGHTEST
            unknowns, taken = self._newton(term, unknowns, linear)
            steps += taken
            gaps = term.gaps(unknowns)
            pressed = contact_term.effective(gaps, term.multipliers, rho)
            left = np.where(pressed < 0, np.abs(gaps), np.maximum(-gaps, 0.0)).max()
            kkt = left / np.abs(nodes.traces["u3"] @ unknowns[nodes.body.unknowns_of("u3")]).max()
            if not updated or kkt <= RESIDUAL and linear <= 10 * LINEAR * RESIDUAL:
                return self._finished(unknowns, -pressed * w, gaps, kkt, steps)
            term.update(pressed)
        raise NotConverged(
            f"gaps of {kkt:.1e} of the displacement are left after {UPDATES} updates of the multipliers: "
            "take a larger rho",
            iterations=steps,
        )

    def _usual_rho(self, nodes):
        """Stiffness of a facet's length of the solid, and more for the penalty (stress per length)."""
        length = np.sqrt(nodes.weights.sum() / len(nodes.facets)) / nodes.body.order
        return RHO[self.options.kind] * (self.solid.lam + 2 * self.solid.mu) / length

    def _newton(self, term, unknowns, linear):
        """(Unknowns and approach, steps) for these multipliers."""
        seen, before = set(), None
        for step in range(NEWTON_STEPS + 1):
            counted()
            wanted = term.multipliers + term.rho * term.gaps(unknowns)
            closed = wanted <= 0
            if before is not None:
                # whether a corner without force counts as closed is a matter of rounding
                if np.abs(wanted[before != closed]).max(initial=0.0) <= linear * -wanted.min():
                    return unknowns, step
                if closed.tobytes() in seen:
                    if linear == TIGHTEST:
                        break
                    linear, seen = TIGHTEST, set()
                seen.add(closed.tobytes())
            before, unknowns = closed, self.system.solve(term, closed, unknowns, linear)
        raise NotConverged(
            f"the set of closed corners still changes after {step} steps with rho = {term.rho:.3g}: take "
            "another rho, or Condensed()",
            iterations=step,
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


class Penalised:
    """The contact term of nodes with given multipliers, on the unknowns of the body and the approach.

    Parameters
    ----------
    nodes : ContactNodes
    g0 : array (corners, n)
        Initial gaps; inf where a corner cannot touch.
    law : Law
    rho : float
        Regularisation (stress per length).
    load : float or None
        Under approach control None.

    Attributes
    ----------
    multipliers : array (corners, n)
    form : BilinearForm, the term's variations
    """

    def __init__(self, nodes, g0, law, rho, load):
        self.nodes, self.g0, self.rho, self.load = nodes, g0, rho, load
        body, self.multipliers = nodes.body, np.zeros(g0.shape)
        self.arms = body.solid.ell * law.arms(nodes.points, nodes.normals)
        self._moved = [nodes.motion(nodes.normals, arms) for arms in self.arms]
        self._given = [ng.GridFunction(nodes.multipliers) for _ in g0]
        space = body.space * ng.NumberSpace(body.mesh, definedon=nodes.region)
        *fields, d = space.TrialFunction()
        lowering, vectors = nodes.lowering(d), body.vectors(fields)
        term = contact_term.contact(nodes, g0, self.arms, *vectors, self._given, lowering, rho)
        if load is not None:
            term -= nodes.integral(load / nodes.weights.sum() * d)
        self.form = ng.BilinearForm(space)
        self.form += ng.Variation(term)

    def update(self, multipliers):
        """Take other multipliers, array (corners, n)."""
        self.multipliers = multipliers
        for function, values in zip(self._given, multipliers):
            function.vec.data = self.nodes.field(values).vec

    def gaps(self, unknowns):
        """Gaps (22), array (corners, n)."""
        return self.g0 - [moved @ unknowns[:-1] for moved in self._moved] - unknowns[-1]

    def linearised(self, unknowns):
        """(First variation, array; tangent, csr_matrix) at unknowns and approach, array."""
        state = ng.GridFunction(self.form.space).vec
        state.FV().NumPy()[:] = unknowns
        residual = state.CreateVector()
        self.form.Apply(state, residual)
        self.form.AssembleLinearization(state)
        return residual.FV().NumPy().copy(), as_csr(self.form.mat)


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
        self._one_field = [self._parts["u3"][0].CreateColVector() for _ in range(2)]
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
            right, solution = self._one_field
            right.FV().NumPy()[:] = forces[own]
            solution.data = part * right
            found[own] = solution.FV().NumPy()
        return found

    def _prepare(self, term, closed):
        """Make the preconditioner of fields with springs at closed corners, array (corners, n), anew."""
        nodes, vertices = self._vertices
        factors = {"u3": 1.0, "psi1": term.arms[..., 1], "psi2": term.arms[..., 0]}
        for name, factor in factors.items():
            density = term.rho * np.sum(closed * factor**2, axis=0)
            self._springs.vec.FV().NumPy()[vertices] = density[nodes]
            self._parts[name] = alone(self.nodes.body, name, self._springs)

    def solve(self, term, closed, unknowns, linear):
        """Unknowns and approach at which the functional is stationary for this set of closed corners.

        Parameters
        ----------
        term : Penalised
        closed : boolean array (corners, n)
        unknowns : array (unknowns + 1,), that have this set
        linear : float, residual relative to the internal forces
        """
        free = self._free.copy()
        free[-1] = term.load is not None
        first, tangent = term.linearised(unknowns)
        stiff = term.rho * np.sum(closed * self.nodes.weights)

        def product(vector):
            self.products += 1
            vector = np.where(free, vector, 0.0)
            found = tangent @ vector
            found[:-1] += self.product(vector[:-1])
            return np.where(free, found, 0.0)

        def precondition(vector):
            return np.where(free, np.append(self.precondition(vector[:-1]), vector[-1] / stiff), 0.0)

        if self._prepared != closed.tobytes() + bytes(str(term.rho), "ascii"):
            self._prepare(term, closed)
            self._prepared = closed.tobytes() + bytes(str(term.rho), "ascii")
        first[:-1] += self.product(unknowns[:-1])
        left, step, before, failed = np.where(free, -first, 0.0), np.zeros_like(first), np.inf, False
        right, size = left, np.linalg.norm(left)
        system, inverse = (LinearOperator((len(left),) * 2, each) for each in (product, precondition))
        # with a large rho `right` is a small difference of large numbers: what is left is to be small beside
        # the internal forces, and is solved for again as long as rounding lets it shrink
        while not failed and linear * size < (now := np.linalg.norm(left)) < before / 2:
            more, failed = cg(system, left, rtol=0, atol=linear * size, maxiter=LINEAR_STEPS, M=inverse)
            step, before = step + more, now
            left = right - product(step)
            size = np.linalg.norm(self.product((unknowns + step)[:-1])[free[:-1]])
        off = np.linalg.norm(left) / max(size, 1e-300)
        if not off <= max(10 * linear, SOLVED):
            raise NotConverged(
                f"conjugate gradients stand at the relative residual {off:.1e} after {LINEAR_STEPS} steps: "
                f"take a smaller rho, or Condensed(); {HELD3D}"
            )
        return unknowns + step


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
