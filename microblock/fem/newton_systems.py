"""Linear systems of Newton's method."""

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from functools import reduce
from operator import add
from typing import Any

import ngsolve as ng
import numpy as np
from ngsolve.krylovspace import CGSolver

from .. import cost, threads
from ..errors import NotConverged
from ..model.types import Array
from . import contact_term
from .body import Body
from .body_spaces import FIELDS3D
from .condensation import LINKED, factor_bytes
from .contact_nodes import ContactNodes

MOST_FACTORISED = 20_000  # unknowns, beyond which multigrid takes less time than factors of the fields
SOFTEST = 1e-6  # springs at open nodes over the stiffest: as good as none
LEAST_ERROR = 1e-4  # of a step of Newton's method: (40) leaves more of it
MOST_ERROR = 0.1  # above it the closed corners change again
SPREAD = 0.01  # part of the springs that acts between nodes too: BDDC inverts the matrix of each facet


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

    def add(self, tangent: Any, free: Any, springs: Callable[[], Array]) -> None:
        """Takes stiffness + `tangent`, with the same places at each call, on the free unknowns, a BitArray.
        `springs` returns the stiffness of the tangent at contact nodes, array (fields, n), where it helps.
        """
        system = (self.stiffness + tangent).CreateSparseMatrix()
        cost.require_room(
            cost.plane_factor_bytes(system.height, system.nze),
            f"factors of {free.NumSet()} unknowns",
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

    def solve(self, residual: Any, error: float = 0.0) -> Any:
        """Returns the solution, a vector, with a relative error that may be as large as `error`."""
        return (self._inverse * residual).Evaluate()


class ConjugateGradients:
    """The same of positive definite systems in space, by conjugate gradients with a preconditioner of each
    field: Cholesky factors, or multigrid of more unknowns than `MOST_FACTORISED`.

    `facets` are those of the contact, and `touching` the fields that move corners along n.
    """

    rtol = 1e-9
    advice = "another rho, or Condensed()"

    def __init__(self, body: Body, space: Any, facets: ContactNodes) -> None:
        rows = body.unknowns
        count = len(body.names)
        linked = LINKED * body.order * count / len(FIELDS3D)
        needed = 3 * cost.ENTRY * rows * linked
        self._by_multigrid = rows > MOST_FACTORISED
        if self._by_multigrid:
            needed *= 1 + 1 / count
        else:
            needed += count * factor_bytes(rows / count, linked / count)
        cost.require_room(needed, f"a body of {rows} unknowns", "take longer elements or a lower order")
        self._body = body
        self._facets = facets
        self._touching = [number for number, name in enumerate(body.names) if name in facets.touching]
        self._approach = count
        self._preconditioners: dict[int, Any] = {}
        self.space = space
        with self._tasks():
            self.stiffness = body.bulk(space).mat
            for number in range(count):
                self._precondition(number, self.stiffness, space.FreeDofs())

    def add(self, tangent: Any, free: Any, springs: Callable[[], Array]) -> None:
        """As of `Direct`; multigrid is made of a form, and takes the springs."""
        of_fields = springs() if self._by_multigrid else [None] * self._approach
        with self._tasks():
            self._matrix = (self.stiffness + tangent).CreateSparseMatrix()
            for number in self._touching:
                self._precondition(number, self._matrix, free, of_fields[number])
        self._factorise(self._approach, self._matrix, free)

    def solve(self, residual: Any, error: float = 0.0) -> Any:
        """As of `Direct`, but for an error that is at least LEAST_ERROR and at most MOST_ERROR."""
        blocks = reduce(add, self._preconditioners.values())
        tolerance = float(np.clip(error, LEAST_ERROR, MOST_ERROR))
        with self._tasks():
            return (CGSolver(self._matrix, blocks, tol=tolerance, maxiter=3000) * residual).Evaluate()

    def _tasks(self) -> AbstractContextManager[Any]:
        """NGSolve's threads for large systems, where there is more than one outside."""
        return ng.TaskManager() if threads.workers(self.space.ndof) > 1 else nullcontext()

    def _precondition(self, number: int, matrix: Any, free: Any, springs: Array | None = None) -> None:
        """Takes the preconditioner of a field, by its number."""
        if self._by_multigrid:
            embedding = self.space.Embedding(number)
            multigrid = _multigrid(self._body, number, self._facets, springs)
            self._preconditioners[number] = embedding @ multigrid @ embedding.T
        else:
            self._factorise(number, matrix, free)

    def _factorise(self, number: int, matrix: Any, free: Any) -> None:
        """Takes Cholesky factors of the block of a field."""
        unknowns = self.space.Range(number)
        block = ng.BitArray(free)
        block[: unknowns.start] = False
        block[unknowns.stop :] = False
        self._preconditioners[number] = matrix.Inverse(block, "sparsecholesky")


def _multigrid(body: Body, number: int, facets: ContactNodes, springs: Array | None) -> Any:
    """Returns a preconditioner of a field of a body that springs hold at the nodes of its contact boundary,
    array (n,) or None: BDDC, with algebraic multigrid of the unknowns of vertices.
    """
    space = body.spaces[number]

    def strains(values: Any) -> tuple[Any, Any]:
        """Returns those of a displacement or rotation that has this component alone."""
        components = [ng.CF(0)] * len(body.names)
        components[number] = values
        slopes = [ng.CF((0, 0, 0))] * len(body.names)
        slopes[number] = ng.grad(values)
        return body.strains(components, slopes)

    trial, test = space.TnT()
    form = ng.BilinearForm(space, symmetric=True)
    work = sum(contact_term.virtual_work(body.moduli, strains(trial), strains(test)))
    form += work * ng.dx(bonus_intorder=body.bonus)
    if springs is not None and springs.any():
        root = facets.field(np.sqrt(np.maximum(springs, SOFTEST * springs.max())))  # its square has no sign
        held = root * root * trial * test
        form += facets.integral((1 - SPREAD) * held)
        form += SPREAD * held * ng.ds(definedon=facets.region)
    preconditioner = ng.Preconditioner(form, "bddc", coarsetype="h1amg")
    form.Assemble()
    return preconditioner.mat
