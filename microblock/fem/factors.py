"""Cholesky factors of a stiffness matrix, with the unknowns of the contact boundary last.

With ``K = L L^T`` in such an order the trailing block of L is the Cholesky factor of the Schur complement of
the contact boundary. Two libraries are used: CHOLMOD (Chen, Davis, Hager and Rajamanickam, ACM Trans. Math.
Softw. 35 (2008) 22), supernodal and 3 to 5 times faster, where cvxopt is installed; else SciPy's SuperLU.
"""

import importlib.util
from abc import ABC, abstractmethod
from functools import cache

import numpy as np
from scipy.sparse import csc_matrix, tril
from scipy.sparse.linalg import splu

# no pivoting: K is positive definite
SYMMETRIC = {"diag_pivot_thresh": 0.0, "options": {"SymmetricMode": True}}


class Singular(ArithmeticError):
    """The matrix is not positive definite."""


class Factors(ABC):
    """Factors of the part of a matrix that belongs to inner and contact unknowns.

    Parameters
    ----------
    matrix : symmetric sparse matrix (unknowns, unknowns)
    inner, contact : arrays of int, their numbers

    Attributes
    ----------
    contact : array (m,), the numbers of the contact unknowns in the order of the block
    block : array (m, m)
        Lower triangular, the Cholesky factor of their Schur complement.
    least : float, the smallest square of a diagonal entry of L over that of the matrix
    entries : int, of L and L^T

    Raises
    ------
    Singular
        If the matrix is not positive definite.
    MemoryError
        If there is no room for the factors.
    """

    contact: np.ndarray
    block: np.ndarray
    least: float
    entries: int

    @abstractmethod
    def __init__(self, matrix, inner, contact): ...

    @abstractmethod
    def solve(self, right):
        """The solution for a right-hand side, array (unknowns,); 0 where an unknown is none of the two."""


class SuperLU(Factors):
    """By SciPy's SuperLU: of ``K = L U``, L = U^T/diag U. It is called twice, as it gives no order alone."""

    def __init__(self, matrix, inner, contact):
        try:
            first = splu(csc_matrix(matrix[inner][:, inner]), permc_spec="MMD_AT_PLUS_A", **SYMMETRIC)
            self._order = np.concatenate((inner[np.argsort(first.perm_c)], contact))
            del first
            own = csc_matrix(matrix[self._order][:, self._order])
            self._factors = splu(own, permc_spec="NATURAL", **SYMMETRIC)
            straight = np.arange(len(self._order))
            if np.any(self._factors.perm_r != straight) or np.any(self._factors.perm_c != straight):
                raise Singular("the factorisation pivots")
        except RuntimeError as failure:
            raise Singular(str(failure)) from failure
        self.entries = self._factors.L.nnz + self._factors.U.nnz
        upper = self._factors.U[len(inner) :, len(inner) :].toarray()
        self.least = float((self._factors.U.diagonal() / own.diagonal()).min())
        if not self.least > 0:
            raise Singular("the matrix is not positive definite")
        self.contact, self.block = contact, (upper / np.sqrt(np.diag(upper))[:, None]).T

    def solve(self, right):
        found = np.zeros_like(right)
        found[self._order] = self._factors.solve(right[self._order])
        return found


class Cholmod(Factors):
    """By CHOLMOD, in the order of AMD for the inner unknowns."""

    def __init__(self, matrix, inner, contact):
        from cvxopt import amd, cholmod

        self._free, count = np.concatenate((inner, contact)), len(inner)
        self._own = _sparse(tril(matrix[self._free][:, self._free], format="csc").tocoo())
        order = np.array(amd.order(self._own[:count, :count], "L")).ravel() if count else np.arange(0)
        self._order = np.concatenate((order, np.arange(count, len(self._free))))
        try:
            self._factorise()
        except ArithmeticError as failure:
            raise Singular("the matrix is not positive definite") from failure
        # CHOLMOD orders once more, by postorder: the contact unknowns keep their order, with inner ones that
        # have nothing to do with those before between them
        place = self._solved(np.arange(len(self._free), dtype=float), 7).astype(int)
        last = np.flatnonzero(place >= count)
        self.contact = self._free[place[last]]
        diagonal = np.array(cholmod.diag(self._factors)).ravel()
        self.least = float((diagonal**2 / matrix.diagonal()[self._free[place]]).min())
        factor = cholmod.getfactor(self._factors)
        self.entries, columns = 2 * len(factor), factor[:, _dense(last)]
        self._factors = None  # cvxopt gives L away, and is left with the pattern of a slower kind
        block = csc_matrix(tuple(np.array(part).ravel() for part in columns.CCS)[::-1], columns.size)
        self.block = block[last].toarray()

    def _factorise(self):
        from cvxopt import cholmod

        before = dict(cholmod.options)
        cholmod.options.update(nmethods=1, supernodal=2)  # in the order that is given; by blocks
        try:
            self._factors = cholmod.symbolic(self._own, p=_dense(self._order), uplo="L")
        finally:
            cholmod.options.clear()
            cholmod.options.update(before)
        cholmod.numeric(self._own, self._factors)

    def solve(self, right):
        if self._factors is None:
            self._factorise()
        found = np.zeros_like(right)
        found[self._free] = self._solved(right[self._free], 0)
        return found

    def _solved(self, right, system):
        from cvxopt import cholmod

        values = _dense(right)
        cholmod.solve(self._factors, values, sys=system)
        return np.array(values).ravel()


@cache
def usual():
    """The class of Factors that is taken: Cholmod where cvxopt is installed."""
    return Cholmod if importlib.util.find_spec("cvxopt") else SuperLU


def _sparse(matrix):
    from cvxopt import spmatrix

    return spmatrix(matrix.data, matrix.row, matrix.col, matrix.shape)


def _dense(values):
    from cvxopt import matrix

    return matrix(values)
