"""Contact states on a compliance: at a load or an approach by block pivoting, the load path by its events.

Corner forces f >= 0 and the approach d leave the gaps

    g = g0 - c d + H f >= 0,     f.g = 0,     c.f = P,                                              (a)

H the symmetric flexibility of the corners, c > 0 the weights of their forces in the load.

Wrong corners are exchanged all at once, or, when that brings no fewer, the first one alone (Judice and Pires,
Comput. Oper. Res. 21 (1994) 587). At an approach that ends for every definite H; at a load the path is
followed after many sets. Where H is semidefinite the proximal point method (Rockafellar, SIAM J. Control
Optim. 14 (1976) 877) solves H + D, D a diagonal just above rounding.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg.lapack import dposv, dpotrf

from ..errors import NotConverged, require, require_finite, require_positive
from ..model.types import Array, Flags, Integers
from ..threads import bounded, with_outer_threads
from .event_driven import EventDrivenContact
from .frictional_contact import FrictionalContact
from .rounding import EPS_PIVOT, EPS_SUM, EPS_TERM

PATIENCE = 5  # sets in a row that are no better, after which corners are exchanged one by one
MOST_SETS = 500  # of a load; of an approach for each corner
ACCEPTED = 1e-11  # relative residual at which a state counts as solved


@dataclass(frozen=True)
class ContactState:
    """One contact state.

    Attributes
    ----------
    forces, gaps : arrays (m,), of cells (corners, n, ...); gaps inf where a corner cannot touch
    closed : boolean array (m,); a closed corner may carry no force
    approach, load : d and c.f
    iterations : sets that were tried, or products with the flexibility
    kkt : largest relative residual of load, complementarity and feasibility
    """

    forces: Array
    gaps: Array
    closed: Flags
    approach: float
    load: float
    iterations: int
    kkt: float


@dataclass(frozen=True)
class CornerEvent:
    """A corner that closes or opens at this load; at load 0 the first touch."""

    load: float
    corner: int
    kind: str


@dataclass(frozen=True)
class _ScaledContact:
    """(a) of the k corners that can touch, with their parts c f of the load as unknowns.

    Attributes
    ----------
    H, g0 : arrays (k, k), (k,), flexibility and initial gaps over c
    c : array (m,), weights of all corners
    numbers : array (k,), of the corners among all
    D : array (k,), diagonal of the regularisation
    regular : array (k, k), H + D, at a load with a `rigid_constant`
    """

    H: Array
    g0: Array
    c: Array
    numbers: Integers
    D: Array
    regular: Array

    def state(
        self, forces: Array, closed: Flags, approach: float, iterations: int, kkt: float
    ) -> ContactState:
        """Returns the ContactState of all corners."""
        c = self.c[self.numbers]
        all_forces = np.zeros(len(self.c))
        all_gaps = np.full(len(self.c), np.inf)
        all_closed = np.zeros(len(self.c), bool)
        all_forces[self.numbers] = forces / c
        all_gaps[self.numbers] = c * (self.g0 - approach + self.H @ forces)
        all_closed[self.numbers] = closed
        load = float(forces.sum())
        return ContactState(all_forces, all_gaps, all_closed, float(approach), load, iterations, kkt)


@bounded
def solve(
    matrix: ArrayLike,
    g0: ArrayLike,
    *,
    load: float | None = None,
    approach: float | None = None,
    c: ArrayLike | None = None,
    start: Flags | None = None,
) -> ContactState:
    """Returns the contact state at a load or at an approach, (a).

    Parameters
    ----------
    matrix : array (m, m), H, length per force; positive semidefinite, at a load on zero-sum vectors only
    g0 : array (m,), initial gaps; inf where a corner can never touch
    load, approach : float, one of them
    c : array (m,), weights > 0; 1 without it
    start : boolean array (m,), closed corners to begin with

    Raises
    ------
    BadArgument
        Also for a matrix that is not positive semidefinite.
    NotConverged
        If sets do not settle at an approach, or rigid corners cannot take it.
    """
    gaps = require_gaps(g0, load, approach)
    closed = np.zeros(gaps.shape, bool) if start is None else np.asarray(start)
    require(
        closed.shape == gaps.shape and closed.dtype == bool,
        "start",
        start,
        "must be a boolean array, one for each corner",
    )
    for contact in _regularised(matrix, gaps, c, at_load=load is not None):
        try:
            return _proximal_point(contact, closed[contact.numbers], load, approach)
        except NotConverged as stopped:  # more of D, then
            if load is not None and stopped.iterations:
                changes = [event.corner for event in path(matrix, g0, load, c=c)]
                closed = np.bincount(changes, minlength=len(gaps)) % 2 == 1
                return solve(matrix, g0, load=load, c=c, start=closed)
            failure = stopped
    raise failure


@bounded
def path(matrix: ArrayLike, g0: ArrayLike, load: float, *, c: ArrayLike | None = None) -> list[CornerEvent]:
    """Returns all events from first touch to a load, by an `EventDrivenContact`. Parameters and errors are
    those of `solve`; `reached` is the last load.
    """
    contact = next(_regularised(matrix, require_gaps(g0, load), c, at_load=True))
    constant = rigid_constant(contact.H)
    no_coupling = np.zeros((1, len(contact.g0)))
    without_shear = EventDrivenContact(
        FrictionalContact(contact.H + constant, no_coupling, np.eye(1) * constant, contact.g0, 0.0)
    )
    try:
        without_shear.follow(load, 0.0)
    except NotConverged as failure:
        raise NotConverged(
            f"{failure}; ask for smaller loads, or for single states", reached=float(without_shear.loads[0])
        ) from failure
    return [
        CornerEvent(float(change.fraction * load), int(contact.numbers[change.index]), f"{change.kind}s")
        for change in without_shear.changes
        if change.kind in ("open", "close")
    ]


def _regularised(
    matrix: ArrayLike, g0: Array, c: ArrayLike | None, at_load: bool
) -> Iterator[_ScaledContact]:
    """Yields the contact with more and more of D."""
    H = np.array(matrix, float)
    require(g0.ndim == 1, "g0", g0, "must be one-dimensional")
    require(
        H.shape == 2 * g0.shape and np.all(np.isfinite(H)),
        "matrix",
        H,
        f"must be a finite matrix of {len(g0)} rows and columns, as g0 has",
    )
    weights = np.ones(len(g0)) if c is None else np.array(c, float)
    require(
        weights.shape == g0.shape and np.all((weights > 0) & (weights < np.inf)),
        "c",
        weights,
        "must be positive and finite, one for each corner",
    )
    numbers = np.flatnonzero(np.isfinite(g0))
    H = (H / weights[:, None] / weights)[np.ix_(numbers, numbers)]
    rows = np.abs(H).max(axis=1)
    # it was put together wrongly
    require(np.abs(H - H.T).max() <= 1e-8 * rows.max(), "matrix", H, "must be symmetric")
    H = (H + H.T) / 2
    rows[rows == 0] = rows.max() or 1.0
    semidefinite = False
    # D over the largest entry of the row: above the rounding of H and of its factors, m 1e-16; the last one
    # for compliances computed less well
    for fraction, constant in product(
        (0.0, EPS_PIVOT, 100 * EPS_PIVOT), (0.0, rigid_constant(H))[: 1 + at_load]
    ):
        regular = H + constant + np.diag(fraction * rows)
        with with_outer_threads(len(H)):
            factor, failed = dpotrf(regular)
        if not failed and np.all(factor.diagonal() ** 2 > EPS_SUM * regular.diagonal()):
            semidefinite = True
            yield _ScaledContact(H, (g0 / weights)[numbers], weights, numbers, fraction * rows, regular)
    where = "where the approach is given; give the load, or add a rigid-body constant tau c c^T"
    if at_load:
        where = "on vectors with c.f = 0"
    require(semidefinite, "matrix", H, f"must be positive semidefinite {where}")


def rigid_constant(H: Array) -> float:
    """Returns the rigid-body constant (length per force) that makes an H, array (k, k), definite that is so
    on zero-sum forces.
    """
    return float(np.abs(H).max() - min(H.min(), 0.0)) or 1.0


def require_gaps(g0: ArrayLike, load: float | None, approach: float | None = None) -> Array:
    """Returns initial gaps as an array; raises BadArgument unless they are finite or inf, and one of
    an approach and a positive load is given.
    """
    gaps = np.asarray(g0, float)
    require((load is None) != (approach is None), "load", load, "give either load or approach")
    if load is None:
        require_finite(approach=approach)
    else:
        require_positive(load=load)
    require(
        not np.any(np.isnan(gaps) | np.isneginf(gaps)) and np.any(np.isfinite(gaps)),
        "g0",
        gaps,
        "must be finite or inf, somewhere finite",
    )
    return gaps


def relative_residual(
    H: Array, g0: Array, forces: Array, closed: Flags, approach: float, load: float | None
) -> float:
    """Returns the largest relative residual of (a) for c = 1, of k corners."""
    gaps = g0 - approach + H @ forces
    violation = np.where(closed, np.abs(gaps), np.maximum(-gaps, 0))
    terms = np.abs(g0) + abs(approach) + np.abs(H) @ forces
    length = terms[closed | (violation > 0)].max(initial=0.0)
    # rigid corners that take all of it leave nothing but rounding of H load
    length = max(length, 1e-4 * np.abs(H).max() * (load or 0.0)) or 1.0
    imbalance = abs(forces.sum() - load) / load if load else 0.0
    return float(max(violation.max() / length, imbalance))


def _proximal_point(
    contact: _ScaledContact, closed: Flags, load: float | None, approach: float | None
) -> ContactState:
    """Returns the state of the smallest residual by the proximal point method:

    1. block pivoting of H + D, with gaps less D times the forces before;
    2. the approach such that f.g = 0, and the residual with H;
    3. the best state is kept, until no refinement improves it.
    """
    forces = np.zeros(len(contact.g0))
    if approach is not None and approach <= contact.g0.min():
        return contact.state(forces, forces > 0, approach, 0, 0.0)
    best = None
    iterations = 0
    least = np.inf
    for _ in range(30):  # 2 or 3 do unless H is nearly singular
        force_before = forces.sum()
        gaps = contact.g0 - (approach or 0.0) - contact.D * forces
        forces, closed, sets = block_pivoting(contact.regular, gaps, closed, load)  # 1
        iterations += sets
        d = approach
        if d is None:
            d = float(forces @ (contact.g0 + contact.H @ forces) / forces.sum())  # 2
        residual = relative_residual(contact.H, contact.g0, forces, closed, d, load)
        # where rigid corners cannot take an approach the forces grow by as much again each time, and no gap
        # beside H f would show it
        if load is None and abs(forces.sum() - force_before) > 1e-2 * forces.sum():
            residual = max(residual, np.nextafter(ACCEPTED, 1))
        least_before = least
        if residual < least:  # 3
            least = residual
            best = forces, closed, d
        # no refinement improves what is rounding
        if residual <= 4 * np.finfo(float).eps or (least <= ACCEPTED and not residual < least_before / 2):
            break
    if best is None or least > ACCEPTED:
        place = f"approach {approach:g}" if load is None else f"load {load:g}"
        raise NotConverged(
            f"relative residual {least:.1e} after many refinements at {place}: "
            "are rigid corners pressed into the obstacle? Give the load instead of the approach"
        )
    return contact.state(*best, iterations, least)


def block_pivoting(H: Array, g0: Array, closed: Flags, load: float | None) -> tuple[Array, Flags, int]:
    """Returns forces and closed corners of (a), and the number of sets tried. For a set,

    1. H f = d - g0 of closed corners is solved, at a load with the d that makes sum f = P;
    2. closed corners with f < 0 and open ones with g < 0 are wrong;
    3. all of them are exchanged, or after PATIENCE sets with no fewer the first one alone.

    Parameters
    ----------
    H : array (m, m), positive definite
    g0 : array (m,), finite; less a given approach
    closed : boolean array (m,), to begin with
    load : float, or None where the approach is given

    Raises NotConverged if the sets do not settle, or H is singular to rounding.
    """
    # at a load its path is faster by then
    budget = MOST_SETS * (len(g0) if load is None else 1)
    closed = closed.copy()
    diagonal = H.diagonal()
    fewest = len(g0) + 1
    sets_left = PATIENCE
    for count in range(1, budget + 1):
        if not closed.any():
            closed[np.argmin(g0)] = True
        on = np.flatnonzero(closed)
        base = 0.0 if load is None else g0[on].min()
        sides = np.column_stack((g0[on] - base, np.ones(len(on))))
        with with_outer_threads(len(on)):
            factor, solutions, failed = dposv(H[on[:, None], on].T, sides, overwrite_a=1)  # 1
        if failed or np.any(factor.diagonal() ** 2 < EPS_SUM * diagonal[on]):
            raise NotConverged(
                "closed corners have a flexibility that is singular to rounding: are two of them one?"
            )
        of_gaps, of_approach = solutions.T
        d = 0.0 if load is None else (load + of_gaps.sum()) / of_approach.sum()
        forces = np.zeros(len(g0))
        forces[on] = d * of_approach - of_gaps
        displacement = H[:, on] @ forces[on]
        gaps = g0 - base + displacement - d
        force_rounding = EPS_TERM * np.ptp(forces)
        gap_rounding = EPS_TERM * (np.ptp(displacement) + np.abs(g0[on]).max())
        wrong = np.where(closed, forces < -force_rounding, gaps < -gap_rounding)  # 2
        if not wrong.any():
            return np.maximum(forces, 0.0), closed, count
        wrong_count = int(np.count_nonzero(wrong))
        sets_left = PATIENCE if wrong_count < fewest else sets_left - 1
        fewest = min(fewest, wrong_count)
        if sets_left < 0:
            wrong = np.arange(len(wrong)) == np.argmax(wrong)
        closed ^= wrong  # 3
    raise NotConverged(
        f"contact set of {len(g0)} corners still changing after {budget} sets, at best {fewest} "
        "corners wrong; start from a state at a nearby load, or follow the path",
        iterations=budget,
    )
