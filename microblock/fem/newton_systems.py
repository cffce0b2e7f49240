"""Linear systems of Newton's method."""

import ngsolve as ng
import numpy as np
from scipy.sparse.linalg import LinearOperator, cg

from .. import cost
from ..errors import NotConverged
from .body import FIELDS3D
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
        added = self._values[self._places]
        self._values[self._places] = self._own
        found = (self.matrix * vector).Evaluate().FV().NumPy().copy()
        self._values[self._places] = added
        return found

    def add(self, tangent, free):
        """Take K + `tangent`, with the same places at each call, on the free unknowns, a BitArray."""
        if not len(self._places):
            self._places = _places(self.matrix, tangent)
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

    def solve(self, residual, size):
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
        self._factors = {name: self._of_field(name) for name in FIELDS3D}
        self._vectors = [self.matrix.CreateColVector() for _ in range(2)]

    def _of_field(self, name):
        """Cholesky factors of the block of a field."""
        own, chosen = self.body.unknowns_of(name), ng.BitArray(self.space.FreeDofs())
        chosen[: own.start] = False
        chosen[own.stop :] = False
        return self.matrix.Inverse(chosen, "sparsecholesky")

    def add(self, tangent, free):
        super().add(tangent, free)
        self._free = np.array(free)
        self._factors |= {name: self._of_field(name) for name in ("u3", "psi1", "psi2")}  # with springs

    def solve(self, residual, size):
        """The solution but for a residual of this size, a vector."""
        blocks = sum(list(self._factors.values())[1:], list(self._factors.values())[0])
        last = self.space.ndof - 1
        softness = 1 / self.matrix[last, last] if self._free[last] else 0.0

        def product(values):
            return np.where(self._free, self._applied(self.matrix, values), 0.0)

        def precondition(values):
            found = self._applied(blocks, values)
            found[last] = values[last] * softness
            return found

        right = np.where(self._free, residual.FV().NumPy(), 0.0)
        system, inverse = (LinearOperator((len(right),) * 2, each) for each in (product, precondition))
        found, _ = cg(system, right, rtol=0, atol=size, maxiter=3000, M=inverse)
        solution = self.matrix.CreateColVector()
        solution.FV().NumPy()[:] = found
        return solution

    def _applied(self, operator, values):
        given, found = self._vectors
        given.FV().NumPy()[:] = values
        found.data = operator * given
        return found.FV().NumPy().copy()


def _places(matrix, other):
    """Numbers of the values that belong to those of another matrix."""
    (_, columns, starts), (_, wanted, ends) = matrix.CSR(), other.CSR()
    columns, wanted = np.asarray(columns), np.asarray(wanted)
    starts, ends = np.array(starts, int), np.array(ends, int)
    rows = np.flatnonzero(np.diff(ends))
    parts = [(slice(starts[row], starts[row + 1]), slice(ends[row], ends[row + 1])) for row in rows]
    return np.concatenate([one.start + np.searchsorted(columns[one], wanted[own]) for one, own in parts])
