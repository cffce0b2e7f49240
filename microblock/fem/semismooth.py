"""Newton's method for forms of one's own that have a contact term."""

import math
from dataclasses import dataclass
from typing import Any

import ngsolve as ng
import numpy as np

from ..errors import NotConverged, require, require_choice, require_kind, require_positive, require_whole
from ..model.progress import counted
from ..model.types import Array
from ..threads import bounded

HALVINGS = 10  # of a step after which the form has values again
ROUNDING = 1e-14  # of a step: no smaller change can be asked for
RECOVERED = 0.05  # relative error of a drawn vector: 2e-3 where fields are badly scaled, above .3 if singular
DRAWS = 3  # of such vectors, since any may lie well
CAUSES = (
    "are rigid motions of the body constrained, does the obstacle touch it where it is free to move, are the "
    "multipliers those of the contact surface, none of them where u is constrained, and is the term added by "
    "Variation(lagrangian) or as virtual_work?"
)


@dataclass(frozen=True)
class NewtonResult:
    """How an iteration ended.

    Attributes
    ----------
    iterations : int
        Steps, of which each solved one linear system.
    change : float
        Work of the residual on the last step, over that of the system on the state, its root: a relative
        error in the norm of energy.
    """

    iterations: int
    change: float


@bounded
def solve(
    form: Any, state: Any, free: Any = None, rtol: float = 1e-10, most: int = 50, inverse: str = "umfpack"
) -> NewtonResult:
    """Solves ``form(state) = 0`` by the semismooth Newton method, which is an active-set method where the
    form has the term of `ContactCorners`: each step takes the corners as closed or open by (40).

    Parameters
    ----------
    form : ngsolve.BilinearForm
        Not assembled; of energies by `Variation`, of works by integrals, or both.
    state : ngsolve.GridFunction
        On the same space: a first guess with the prescribed values, and the solution afterwards.
    free : BitArray, optional
        Unknowns that change; those that are free in the space without it.
    rtol : float
        Of the change by the last step.
    most : int
        Steps.
    inverse : str
        NGSolve's solver of linear systems, one for indefinite matrices: "umfpack", "pardiso" or "mumps".

    Returns
    -------
    NewtonResult

    Raises
    ------
    NotConverged
        If a matrix is singular, a step leads where the form has no values, or `most` steps do not suffice;
        the state is then that of the last step.
    BadArgument
        If an argument is of another kind or size.
    """
    require_kind(ng.BilinearForm, "an ngsolve.BilinearForm", form=form)
    require_kind(ng.GridFunction, "an ngsolve.GridFunction", state=state)
    require(form.space == state.space, "state", state, "must be on the space of the form")
    require(not form.condense, "form", form, "must not be condensed")
    require_positive(rtol=rtol)
    require(ROUNDING <= rtol < 1, "rtol", rtol, f"must be at least {ROUNDING} and below 1")
    require_whole(1, most=most)
    require_choice(("umfpack", "pardiso", "mumps"), inverse=inverse)
    free = form.space.FreeDofs() if free is None else free
    require_kind(ng.BitArray, "an ngsolve.BitArray", free=free)
    words = f"must have {form.space.ndof} entries, one set at least"
    require(len(free) == form.space.ndof and free.NumSet() > 0, "free", free, words)
    residual = _residual(form, state.vec)
    require(_finite(residual), "state", state, "must be a guess at which the form has finite values")
    for iteration in range(1, most + 1):
        counted()
        form.AssembleLinearization(state.vec)
        try:
            factors = form.mat.Inverse(free, inverse)
            step = (factors * residual).Evaluate()
        except Exception as failure:
            raise NotConverged(
                f"no factorisation in step {iteration}: {failure}; {CAUSES}", iterations=iteration
            ) from failure
        work = _work(form.space, residual, step, free)
        start = state.vec.Copy()
        length = 1.0
        for _ in range(HALVINGS):
            state.vec.data = start - length * step
            residual = _residual(form, state.vec)
            if _finite(residual):
                break
            length /= 2
        else:
            raise NotConverged(
                f"step {iteration} leads where the form has no finite values: take smaller steps of the load",
                iterations=iteration,
            )
        scale = _work(form.space, (form.mat * state.vec).Evaluate(), state.vec, None)
        change = math.sqrt(work / scale) if scale > 0 else math.inf * work if work else 0.0
        if change <= rtol and length == 1.0:
            if not _is_regular(form, factors, state.vec, free):
                raise NotConverged(
                    f"the matrix of step {iteration} is singular; {CAUSES}", iterations=iteration
                )
            return NewtonResult(iteration, change)
    raise NotConverged(
        f"after {most} steps the state still changes by {change:.1e}: take smaller steps of the load, "
        "another rho, or a better first guess",
        iterations=most,
    )


def _is_regular(form: Any, factors: Any, state: Any, free: Any) -> bool:
    """Returns whether factors of a matrix recover drawn vectors from their products with it: a rigid motion
    that nothing constrains adds to them what rounding leaves of it, and solvers do not always see its pivot
    of 0.
    """
    rng = np.random.default_rng(0)
    ranges = _ranges(form.space)
    vector = state.CreateVector()
    for _ in range(DRAWS):
        drawn = rng.standard_normal(form.space.ndof) * np.array(free)
        for part in ranges:
            drawn[part] *= np.abs(state.FV().NumPy()[part]).max(initial=0.0) or 1.0
        vector.FV().NumPy()[:] = drawn
        recovered = (factors * (form.mat * vector).Evaluate()).Evaluate().FV().NumPy()
        for part in ranges:
            error = np.abs(recovered[part] - drawn[part]).max(initial=0.0)
            if not error <= RECOVERED * np.abs(drawn[part]).max(initial=0.0):
                return False
    return True


def _residual(form: Any, vector: Any) -> Any:
    """Returns the form at a vector, a vector."""
    residual = vector.CreateVector()
    form.Apply(vector, residual)
    return residual


def _finite(vector: Any) -> bool:
    return bool(np.isfinite(vector.FV().NumPy()).all())


def _work(space: Any, forces: Any, displacements: Any, free: Any) -> float:
    """Returns the work of forces on displacements, the sum of its sizes over the fields of a space: fields
    have units of their own, their works have one.
    """
    works: Array = forces.FV().NumPy() * displacements.FV().NumPy()
    if free is not None:
        works = np.where(np.array(free), works, 0.0)
    return float(sum(abs(works[part].sum()) for part in _ranges(space)))


def _ranges(space: Any) -> list[slice]:
    """Returns the unknowns of each field of a space."""
    if not isinstance(space, ng.ProductSpace):
        return [slice(0, space.ndof)]
    ranges = [space.Range(number) for number in range(len(space.components))]
    return [slice(part.start, part.stop) for part in ranges]
