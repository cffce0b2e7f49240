"""Cholesky factors of a stiffness matrix, with the unknowns of the contact boundary last.

CHOLMOD (Chen, Davis, Hager and Rajamanickam, ACM Trans. Math. Softw. 35 (2008) 22) is 3 to 5 times faster
than SciPy's SuperLU, and taken where cvxopt is installed.
"""

from functools import cached_property, partial
from typing import Any, Protocol

import numpy as np
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu

from ..model.types import Array, Integers

try:
    from cvxopt import amd, cholmod, spmatrix
    from cvxopt import matrix as dense
except ImportError:
    cholmod = None


class Singular(ArithmeticError):
    """The matrix is not positive definite."""


class Factors(Protocol):
    """What factors of the part of a matrix that belongs to inner and contact unknowns offer.

    Attributes
    ----------
    block : array (m, m), lower triangular, the Cholesky factor of the contact unknowns' Schur complement
    least : float, the smallest square of a diagonal entry of L over that of the matrix
    """

    block: Array
    least: float

    def __init__(self, matrix: Any, inner: Integers, contact: Integers) -> None:
        """Factorises a matrix, the unknowns `contact` last."""

    def solve(self, right: Array) -> Array:
        """Returns the solution, array (unknowns,); 0 of unknowns that are none of the two."""


class SuperLU:
    """Factors of the part of a matrix that belongs to inner and contact unknowns: ``K = L U``, L =
    U^T/diag U.

    SciPy gives no order alone, and is called twice.

    Parameters
    ----------
    matrix : symmetric csr_matrix (unknowns, unknowns)
    inner, contact : arrays of int, their numbers

    Raises
    ------
    Singular
        If the matrix is not positive definite.
    MemoryError
        If there is no room for the factors.
    """

    def __init__(self, matrix: Any, inner: Integers, contact: Integers) -> None:
        # no pivoting: a stiffness is positive definite
        factorise = partial(splu, diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        try:
            order = factorise(csc_matrix(matrix[inner][:, inner]), permc_spec="MMD_AT_PLUS_A").perm_c
            self._order = np.concatenate((inner[np.argsort(order)], contact))
            ordered = csc_matrix(matrix[self._order][:, self._order])
            self._factors = factorise(ordered, permc_spec="NATURAL")
        except RuntimeError as failure:
            raise Singular(str(failure)) from failure
        orders = np.array((self._factors.perm_r, self._factors.perm_c))
        if np.any(orders != np.arange(len(self._order))):
            raise Singular("the factorisation pivots")
        self.least = float((self._factors.U.diagonal() / ordered.diagonal()).min())
        if not self.least > 0:
            raise Singular("the matrix is not positive definite")
        upper = self._factors.U[len(inner) :, len(inner) :].toarray()
        self.block = (upper / np.sqrt(np.diag(upper))[:, None]).T

    def solve(self, right: Array) -> Array:
        """As of `Factors`."""
        solution = np.zeros_like(right)
        solution[self._order] = self._factors.solve(right[self._order])
        return solution


class Cholmod:
    """The same by CHOLMOD. cvxopt gives L away for the block: fields take factors made anew."""

    def __init__(self, matrix: Any, inner: Integers, contact: Integers) -> None:
        self._free = np.concatenate((inner, contact))
        count = len(inner)
        number = np.full(matrix.shape[0], -1, np.int32)
        number[self._free] = np.arange(len(self._free))
        columns = np.repeat(number, np.diff(matrix.indptr))  # of the transpose, in their order
        rows = number[matrix.indices]
        lower = (columns >= 0) & (rows >= columns)
        self._matrix = spmatrix(matrix.data[lower], rows[lower], columns[lower], 2 * (len(self._free),))
        last = np.arange(count, len(self._free))
        self._order = last
        if count:
            order = np.array(amd.order(self._matrix[:count, :count], "L")).ravel()
            self._order = np.concatenate((order, last))
        factors = self._factorised()
        diagonal = np.array(cholmod.diag(factors)).ravel()
        self.least = float((diagonal**2 / matrix.diagonal()[self._free[self._order]]).min())
        self.block = np.array(dense(cholmod.getfactor(factors)[count:, count:]))

    def solve(self, right: Array) -> Array:
        """As of `Factors`."""
        solution = np.zeros_like(right)
        values = dense(right[self._free])
        cholmod.solve(self._factors, values)
        solution[self._free] = np.array(values).ravel()
        return solution

    @cached_property
    def _factors(self) -> Any:
        return self._factorised()

    def _factorised(self) -> Any:
        """Returns CHOLMOD's factors."""
        options = dict(cholmod.options)
        cholmod.options.update(nmethods=1, supernodal=2, postorder=False)
        try:
            factors = cholmod.symbolic(self._matrix, p=dense(self._order), uplo="L")
            cholmod.numeric(self._matrix, factors)
        except ArithmeticError as failure:
            raise Singular("the matrix is not positive definite") from failure
        finally:
            cholmod.options.clear()
            cholmod.options.update(options)
        return factors


usual: type[Factors] = Cholmod if cholmod else SuperLU
