"""Contact of a body in space by penalty (31) or augmented Lagrangian (37), without factorisation.

For given multipliers the functional is minimised over fields and approach by Newton's method: a linear system
for each set of closed corners, ``lambda + rho g <= 0``. When the set stays, the multipliers become (40),
until no gap of a closed corner is left. The matrix is positive definite even where corner forces are not
unique.

Systems are solved by conjugate gradients, preconditioned by Cholesky factors of each field by itself. Korn's
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
from .condensation import LINKED, of_factors, require_pressed, with_psi_constrained
from .facets import ContactNodes
from .newton import MAX_ITERATIONS, Tangent
from .solver3d import RESIDUAL, Solver3D
from .state3d import SurfaceNodes

RHO = {"al": 8.0, "penalty": 1e3}  # times lambda + 2 mu over the length of a facet
TIGHTEST = 1e-10  # residual of the linear systems, relative, at least
LINEAR_STEPS = 3000  # of conjugate gradients


class NewtonSolver3D(Solver3D):
    """States of a body in space by penalty or augmented Lagrangian; its `options` are `Newton`."""

    @property
    def nodes(self):
        """The contact nodes, psi1 and psi2 fixed there if the law prescribes psi."""
        body, clamped = self.body, self.surface_law.clamped
        require_pressed(body, body.contact, condensed=True)
        own = with_psi_constrained(body, body.contact) if clamped else body
        return body.once(("nodes", clamped), lambda: ContactNodes(own))

    @property
    def system(self):
        """The Systems of the body, made once."""
        return self.nodes.body.once("systems", lambda: Systems(self.nodes))

    @bounded
    def solve(self, load, approach, rtol, initial=None, progress=False):
        """Returns the SurfaceNodes; parameters and errors are those of `Solver.solve`."""
        self.require_no_rtol(rtol)
        nodes, w = self.nodes, self.nodes.weights
        g0 = self.reachable_gaps()
        if load is None and approach <= g0.min():
            raise BadArgument("approach", approach, NOT_YET)
        rho = self.options.rho or self._usual_rho(nodes)
        space, steps, kkt = self.system.space, 0, 1.0
        term = Penalised(nodes, space, g0, self.law, rho, load)
        unknowns = np.zeros(nodes.body.space.ndof + 1)
        # from first touch on, else the approach would be free
        first = g0.min() + 1e-9 * np.ptp(g0[np.isfinite(g0)])
        unknowns[-1] = first if approach is None else approach
        updated = self.options.kind == "al"
        for _ in range(MAX_ITERATIONS):
            linear = np.clip(kkt / 100, TIGHTEST, 1e-4) if updated else TIGHTEST
            unknowns, taken = self._newton(term, unknowns, linear)
            steps += taken
            gaps = term.gaps(unknowns)
            pressed = contact_term.effective(gaps, term.multipliers, rho)
            left = np.where(pressed < 0, np.abs(gaps), np.maximum(-gaps, 0.0)).max()
            kkt = left / np.abs(nodes.traces["u3"] @ unknowns[nodes.body.unknowns_of("u3")]).max()
            if not updated or kkt <= RESIDUAL and linear <= RESIDUAL / 10:
                return self._finished(unknowns, -pressed * w, gaps, kkt, steps)
            term.update(pressed)
        raise NotConverged(
            f"gaps of {kkt:.1e} of the displacement are left after {MAX_ITERATIONS} updates of the "
            "multipliers: take a larger rho",
            iterations=steps,
        )

    def _usual_rho(self, nodes):
        """Stiffness of a facet's length of the solid, and more for the penalty (stress per length)."""
        length = np.sqrt(nodes.weights.sum() / len(nodes.facets)) / nodes.body.order
        return RHO[self.options.kind] * (self.solid.lam + 2 * self.solid.mu) / length

    def _newton(self, term, unknowns, linear):
        """(Unknowns and approach, steps) for these multipliers."""
        seen, before = set(), None
        for step in range(MAX_ITERATIONS + 1):
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
        exerted = self.system.internal(unknowns)[:-1] - nodes.onto.T @ loads.ravel()
        fields = Fields(nodes.body, state.components, exerted)
        unbalanced = np.abs(exerted[np.array(nodes.body.space.FreeDofs())]).max() / np.abs(loads).max()
        if law.clamped:  # but what planes of symmetry exert
            loads[1:] = self.held_moments(exerted)
        surface = (nodes.onto @ unknowns[:-1]).reshape(3, -1)
        found = SurfaceNodes(
            self,
            float(forces.sum()),
            float(unknowns[-1]),
            nodes,
            forces / nodes.weights,
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
    """The contact term with given multipliers, on the unknowns of the body and the approach.

    Parameters
    ----------
    nodes : ContactNodes
    space : product of the body's space and that of the approach
    g0 : array (corners, n), initial gaps; inf out of reach
    law : Law
    rho : float, regularisation (stress per length)
    load : float, or None under approach control
    """

    def __init__(self, nodes, space, g0, law, rho, load):
        self.nodes, self.g0, self.rho, self.load = nodes, g0, rho, load
        body, self.multipliers = nodes.body, np.zeros(g0.shape)
        self.arms = body.solid.ell * law.arms(nodes.points, nodes.normals)
        self._moved = [nodes.motion(nodes.normals, arms) for arms in self.arms]
        self._given = [ng.GridFunction(nodes.multipliers) for _ in g0]
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


class Systems:
    """The linear systems of a body with springs at its ContactNodes, by conjugate gradients."""

    def __init__(self, nodes):
        self.nodes, body = nodes, nodes.body
        rows, linked = body.space.FreeDofs().NumSet(), LINKED * body.order
        needed = 2 * cost.ENTRY * rows * linked + len(FIELDS3D) * of_factors(rows / 6, linked / 6)
        cost.require_room(needed, f"a body of {rows} unknowns", "take longer elements or a lower order")
        self.space = body.space * ng.NumberSpace(body.mesh, definedon=nodes.region)
        self.tangent = Tangent(body, self.space, nodes, body.acting())
        self._free = np.array(self.space.FreeDofs(), bool)
        self._parts = {name: self._factors(name) for name in FIELDS3D}
        self._prepared = b""
        self._vectors = [self.tangent.matrix.CreateColVector() for _ in range(2)]

    def _factors(self, name):
        """Cholesky factors of the block of a field, as an operator on all unknowns."""
        own, chosen = self.nodes.body.unknowns_of(name), ng.BitArray(self.space.ndof)
        chosen.Clear()
        for number in np.flatnonzero(self._free[own]) + own.start:
            chosen.Set(int(number))
        return self.tangent.matrix.Inverse(chosen, "sparsecholesky")

    def _applied(self, operator, values):
        """What an operator of NGSolve makes of an array."""
        given, found = self._vectors
        given.FV().NumPy()[:] = values
        found.data = operator * given
        return found.FV().NumPy().copy()

    def internal(self, unknowns):
        """K x, array, of unknowns and approach."""
        self._vectors[0].FV().NumPy()[:] = unknowns
        return self.tangent.internal(self._vectors[0])

    def solve(self, term, closed, unknowns, linear):
        """Unknowns and approach, array, at which the functional is stationary for closed corners, boolean
        array (corners, n), to the residual `linear` over the internal forces.
        """
        free, stiff = self._free.copy(), term.rho * np.sum(closed * self.nodes.weights)
        free[-1] = term.load is not None
        state, residual = self._vectors
        state.FV().NumPy()[:] = unknowns
        term.form.Apply(state, residual)
        right = np.where(free, -residual.FV().NumPy() - self.internal(unknowns), 0.0)
        state.FV().NumPy()[:] = unknowns
        term.form.AssembleLinearization(state)
        matrix, set_of = self.tangent.add(term.form.mat), closed.tobytes() + str(term.rho).encode()
        if self._prepared != set_of:
            self._parts |= {name: self._factors(name) for name in ("u3", "psi1", "psi2")}  # with springs
            self._prepared = set_of
        blocks = sum(list(self._parts.values())[1:], list(self._parts.values())[0])

        def product(vector):
            return np.where(free, self._applied(matrix, np.where(free, vector, 0.0)), 0.0)

        def precondition(vector):
            found = self._applied(blocks, vector)
            found[-1] = free[-1] * vector[-1] / stiff
            return found

        left, step, before, failed = right, np.zeros_like(right), np.inf, False
        size = np.linalg.norm(left)
        system, inverse = (LinearOperator((len(left),) * 2, each) for each in (product, precondition))
        # with a large rho `right` is a small difference of large numbers: what is left is to be small beside
        # the internal forces, and is solved for again as long as rounding lets it shrink
        while not failed and linear * size < (now := np.linalg.norm(left)) < before / 2:
            more, failed = cg(system, left, rtol=0, atol=linear * size, maxiter=LINEAR_STEPS, M=inverse)
            step, before = step + more, now
            left = right - product(step)
            size = np.linalg.norm(self.internal(unknowns + step)[self._free])
        off = np.linalg.norm(left) / max(size, 1e-300)
        if not off <= max(10 * linear, SOLVED):
            raise NotConverged(
                f"conjugate gradients stand at the relative residual {off:.1e} after {LINEAR_STEPS} steps: "
                f"take a smaller rho, or Condensed(); {HELD3D}"
            )
        return unknowns + step
