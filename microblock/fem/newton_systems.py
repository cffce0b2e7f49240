"""Linear systems of Newton's method."""

from collections.abc import Container, Iterable
from functools import reduce
from operator import add
from typing import Any

import ngsolve as ng
from ngsolve.krylovspace import CGSolver

from .. import cost
from ..errors import NotConverged
from .body import Body
from .condensation import LINKED, factor_bytes


class Direct:
    """Saddle-point or penalty systems, of the stiffness of the bulk and the tangent of a contact term, by
    factorisation.

    Parameters
    ----------
    body : Body
    space : product of the body's space and others, the last of the approach

    Attributes
    ----------
    stiffness : matrix of the bulk
    rtol : float, relative residual at which Newton's iteration ends
    advice : str
    """

    rtol = 1e-11
    advice = "another rho, or less stretched elements; is the body supported?"
    _inverse: Any = None

    def __init__(self, body: Body, space: Any) -> None:
        self.space = space
        self.stiffness = body.bulk(space).mat

    def add(self, tangent: Any, free: Any) -> None:
        """Takes stiffness + `tangent`, with the same places at each call, on the free unknowns, a
        BitArray.
        """
        system = (self.stiffness + tangent).CreateSparseMatrix()
        cost.require_room(
            cost.plane_factor_bytes(system.height, system.nze),
            f"factors of {sum(free)} unknowns",
            "take longer elements or a lower order, or condense the body to its contact nodes: Condensed()",
        )
        try:
            if self._inverse is None:
                self._matrix = system
                self._inverse = system.Inverse(free, "umfpack")
            else:
                self._matrix.AsVector().data = system.AsVector()
                self._inverse.Update()  # in the order that was found first
        except Exception as failure:
            self._inverse = None
            raise NotConverged(
                f"no factorisation: {failure}; is the body supported, and is something in contact?"
            ) from failure

    def solve(self, residual: Any) -> Any:
        """Returns the solution, a vector."""
        return (self._inverse * residual).Evaluate()


class ConjugateGradients:
    """The same of positive definite systems in space, preconditioned by Cholesky factors of each field.

    `touching` are the fields that move corners along n.
    """

    rtol = 1e-9
    advice = "another rho, or Condensed()"

    def __init__(self, body: Body, space: Any, touching: Container[str]) -> None:
        rows = body.unknowns
        linked = LINKED * body.order
        count = len(body.names)
        numbers = [number for number, name in enumerate(body.names) if name in touching]
        self._touching = [*numbers, count]  # with the approach
        needed = 3 * cost.ENTRY * rows * linked + count * factor_bytes(rows / count, linked / count)
        cost.require_room(needed, f"a body of {rows} unknowns", "take longer elements or a lower order")
        self.space = space
        self.stiffness = body.bulk(space).mat
        self._factors: dict[int, Any] = {}
        self._factorise(self.stiffness, space.FreeDofs(), range(count))

    def _factorise(self, matrix: Any, free: Any, fields: Iterable[int]) -> None:
        """Takes Cholesky factors of the blocks of fields, by their numbers."""
        for number in fields:
            unknowns = self.space.Range(number)
            block = ng.BitArray(free)
            block[: unknowns.start] = False
            block[unknowns.stop :] = False
            self._factors[number] = matrix.Inverse(block, "sparsecholesky")

    def add(self, tangent: Any, free: Any) -> None:
        """As of `Direct`."""
        self._matrix = (self.stiffness + tangent).CreateSparseMatrix()
        self._factorise(self._matrix, free, self._touching)

    def solve(self, residual: Any) -> Any:
        """Returns the solution but for a ten-thousandth of the residual, a vector."""
        blocks = reduce(add, self._factors.values())
        return (CGSolver(self._matrix, blocks, tol=1e-4, maxiter=3000) * residual).Evaluate()
