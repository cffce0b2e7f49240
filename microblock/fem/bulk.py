"""The assembled stiffness matrix of a body, factorised with the unknowns of its contact boundary last."""

import numpy as np
from scipy.sparse import csr_matrix

from ..errors import NotConverged
from ..model.solver import SOLVED
from . import factors

# of a diagonal entry, below which what is left of it is rounding: 1e-12 and less without supports, 1e-6 for
# beta = 2 - 1e-6 and nu = 0.4999 with them
CANCELLED = 1e-11


class Bulk:
    """The matrix of a bilinear form, interiors of elements eliminated, and its factors.

    Parameters
    ----------
    form : BilinearForm, assembled with condense=True
    seen : array of int, unknowns that the contact boundary sees
    advice, held : str, what to do where there is no memory, or the matrix is singular

    Attributes
    ----------
    matrix : csr_matrix (unknowns, unknowns)
    contact, block : as of `factors.Factors`

    Raises
    ------
    NotConverged
        If there is no memory, or the matrix is not positive definite.
    """

    def __init__(self, form, seen, advice, held):
        self._form, self._held, space = form, held, form.space
        self.matrix, self._free = as_csr(form.mat), np.array(space.FreeDofs(True))
        used = np.zeros(space.ndof, bool)
        used[seen] = True
        inner, contact = np.flatnonzero(self._free & ~used), np.flatnonzero(self._free & used)
        try:
            self._factors = factors.usual()(self.matrix, inner, contact)
        except MemoryError as failure:
            unknowns = space.FreeDofs().NumSet()
            raise NotConverged(f"no memory to factorise {unknowns} unknowns: {advice}") from failure
        except factors.Singular as failure:
            raise NotConverged(f"no factorisation of the bulk: {failure}; {held}") from failure
        if not self._factors.least > CANCELLED:
            raise NotConverged(f"singular matrix of the bulk; {held}")
        self.contact, self.block = self._factors.contact, self._factors.block

    def solve(self, right, state):
        """Put the fields under a right-hand side, array, into a grid function; returns what supports
        exert.
        """
        vector = state.vec.FV().NumPy()
        vector[:] = self._factors.solve(right)
        left = np.where(self._free, right - self.matrix @ vector, 0.0)
        if not np.linalg.norm(left) <= SOLVED * np.linalg.norm(right):
            raise NotConverged(f"singular matrix of the bulk; {self._held}")
        vector += self._factors.solve(left)  # one step of refinement
        forces = self.matrix @ vector - right  # inside the elements nothing acts
        state.vec.data += self._form.harmonic_extension * state.vec
        return forces


def as_csr(matrix):
    """A copy of an NGSolve matrix."""
    values, columns, starts = (np.array(part) for part in matrix.CSR())
    return csr_matrix((values, columns, starts), shape=(matrix.height, matrix.width))
