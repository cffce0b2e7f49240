"""Linear systems of Newton's method."""

from functools import reduce
from operator import add

import ngsolve as ng
import numpy as np
from ngsolve.krylovspace import CGSolver

from .. import cost
from ..errors import NotConverged
from .body import FIELDS3D
from .bulk import as_csr
from .condensation import LINKED, of_factors


class Systems:
    """Base of linear systems: K of the bulk and the tangent of a contact term.

    Parameters
    ----------
    body : Body
    space : product of the body's space and others, the last of the approach
    nodes : ContactNodes

    Attributes
    ----------
    rtol : float, relative residual at which Newton's iteration ends
    advice : str
    """

    def __init__(self, body, space, nodes):
        self.body, self.space, self.matrix = body, space, body.bulk(space, nodes).mat
        self._values = self.matrix.AsVector().FV().NumPy()
        self._places, self._own = np.zeros(0, int), np.zeros(0)

    def internal(self, vector):
        """K x, array, of the vector x."""
        added, self._values[self._places] = self._values[self._places], self._own
        found = (self.matrix * vector).Evaluate().FV().NumPy().copy()
        self._values[self._places] = added
        return found

    def add(self, tangent, free):
        """Take K + `tangent`, with the same places at each call, on the free unknowns, a BitArray."""
        if not len(self._places):
            numbers, other = as_csr(self.matrix), as_csr(tangent).tocoo()
            numbers.data[:] = np.arange(numbers.nnz)
            self._places = np.asarray(numbers[other.row, other.col], int).ravel()
            self._own = self._values[self._places]
        self._values[self._places] = self._own + tangent.AsVector().FV().NumPy()


class Direct(Systems):
    """Saddle-point or penalty systems, by factorisation."""

    rtol, advice = 1e-11, "another rho, or less stretched elements; is the body supported?"
    _inverse = None

    def add(self, tangent, free):
        super().add(tangent, free)
        cost.require_room(
            cost.of_factors(self.space.ndof, self.matrix.nze),
            f"factors of {sum(free)} unknowns",
            "take longer elements or a lower order, or condense the body to its contact nodes: Condensed()",
        )
        try:
            if self._inverse is None:
                self._inverse = self.matrix.Inverse(free, "umfpack")
            else:
                self._inverse.Update()  # in the order that was found first
        except Exception as failure:
            self._inverse = None
            raise NotConverged(
                f"no factorisation: {failure}; is the body supported, and is something in contact?"
            ) from failure

    def solve(self, residual):
        """The solution, a vector."""
        return (self._inverse * residual).Evaluate()


class ConjugateGradients(Systems):
    """Positive definite systems in space, preconditioned by Cholesky factors of each field."""

    rtol, advice = 1e-9, "another rho, or Condensed()"

    def __init__(self, body, space, nodes):
        rows, linked = body.space.FreeDofs().NumSet(), LINKED * body.order
        needed = 2 * cost.ENTRY * rows * linked + len(FIELDS3D) * of_factors(rows / 6, linked / 6)
        cost.require_room(needed, f"a body of {rows} unknowns", "take longer elements or a lower order")
        super().__init__(body, space, nodes)
        self._free = space.FreeDofs()
        self._factors = {name: self._of_unknowns(body.unknowns_of(name)) for name in FIELDS3D}

    def _of_unknowns(self, own):
        """Cholesky factors of the block of a slice of unknowns."""
        chosen = ng.BitArray(self._free)
        chosen[: own.start] = False
        chosen[own.stop :] = False
        return self.matrix.Inverse(chosen, "sparsecholesky")

    def add(self, tangent, free):
        super().add(tangent, free)
        self._free, last = free, self.space.ndof - 1
        springs = {name: self.body.unknowns_of(name) for name in ("u3", "psi1", "psi2")}
        springs["approach"] = slice(last, last + 1)
        self._factors |= {name: self._of_unknowns(own) for name, own in springs.items()}

    def solve(self, residual):
        """The solution but for a ten-thousandth of the residual, a vector."""
        blocks = reduce(add, self._factors.values())
        return (CGSolver(self.matrix, blocks, tol=1e-4, maxiter=3000) * residual).Evaluate()
