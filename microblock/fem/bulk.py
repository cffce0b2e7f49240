"""The stiffness matrix of a body, factorised with the contact unknowns last."""

from typing import Any

import numpy as np
from scipy.sparse import csr_matrix

from ..errors import NotConverged
from ..model.solver import SOLVED
from ..model.types import Array, Flags, Integers
from . import factors, supports
from .body_spaces import BodySpaces, free_unknowns


class Bulk:
    """The matrix of a bilinear form and its factors.

    Parameters
    ----------
    body : Body
    form : BilinearForm of it, assembled; with condense=True nothing may act on interiors of elements
    seen : array of int, unknowns that the contact boundary sees
    advice : str, what to do where there is no memory

    Attributes
    ----------
    matrix : csr_matrix (unknowns, unknowns)
    contact : array (m,), the free ones that the contact boundary sees
    block : as of `factors.SuperLU`

    Raises
    ------
    NotConverged
        If there is no memory, or the matrix is not positive definite.
    """

    def __init__(self, body: BodySpaces, form: Any, seen: Integers, advice: str) -> None:
        self._body = body
        self._form = form  # whose memory `matrix` reads
        space = form.space
        self.matrix = csr_matrix(form.mat.CSR(), shape=2 * [space.ndof])
        self._free: Flags = free_unknowns(space, form.condense)
        on_contact = np.zeros(space.ndof, bool)
        on_contact[seen] = True
        inner = np.flatnonzero(self._free & ~on_contact)
        self.contact: Integers = np.flatnonzero(self._free & on_contact)
        try:
            self._factors = factors.usual(self.matrix, inner, self.contact)
        except MemoryError as failure:
            unknowns = space.FreeDofs().NumSet()
            raise NotConverged(f"no memory to factorise {unknowns} unknowns: {advice}") from failure
        except factors.Singular as failure:
            raise NotConverged(f"no factorisation of the bulk: {failure}; {self._held}") from failure
        # below, what is left of a diagonal entry is rounding: 1e-12 and less without supports, 1e-6 with them
        # for beta = 2 - 1e-6 and nu = 0.4999
        if not self._factors.least > 1e-11:
            raise NotConverged(f"singular matrix of the bulk; {self._held}")
        self.block = self._factors.block

    @property
    def _held(self) -> str:
        nowhere = np.empty((0, self._body.mesh.dim))
        free = supports.free_motions(self._body, nowhere, nowhere)
        if free:
            return f"supports leave {' and '.join(free)} free, which other supports must stop"
        words = "is psi fixed where beta is 0 or nearly so?"
        if self._form.space.mesh.dim == 3:
            words += (
                " With alpha' and beta' (13) does not make the energy of a body with a free surface positive"
            )
        return words

    def solve(self, right: Array, state: Any) -> Array:
        """Puts the fields under a right-hand side, array (unknowns,), into a grid function; returns what
        supports exert, (unknowns,).
        """
        vector = state.vec.FV().NumPy()
        vector[:] = self._factors.solve(right)
        left = np.where(self._free, right - self.matrix @ vector, 0.0)
        # forces and moments have units of their own: over the roots of the diagonal they have one
        sizes = np.sqrt(self.matrix.diagonal()[self._free])
        if not np.linalg.norm(left[self._free] / sizes) <= SOLVED * np.linalg.norm(right[self._free] / sizes):
            raise NotConverged(f"singular matrix of the bulk; {self._held}")
        vector += self._factors.solve(left)  # one step of refinement
        forces = self.matrix @ vector - right  # nothing acts on what is eliminated
        if self._form.condense:
            state.vec.data += self._form.harmonic_extension * state.vec
        return forces
