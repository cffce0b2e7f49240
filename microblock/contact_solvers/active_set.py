"""Contact states on a compliance: at a load or an approach by block pivoting, the load path by its events.

Corner forces f >= 0 and the approach d leave the gaps

    g = g0 - c d + H f >= 0,     f.g = 0,     c.f = P,                                              (a)

H the symmetric flexibility of the corners, c > 0 the weights of their forces in the load.

Wrong corners are exchanged all at once, or, when that brings no fewer, the first one alone (Judice and Pires,
Comput. Oper. Res. 21 (1994) 587). At an approach that ends for every definite H; at a load the path is
followed after many sets. Where H is semidefinite the proximal point method (Rockafellar, SIAM J. Control
Optim. 14 (1976) 877) solves H + D, D a diagonal just above rounding.
"""

from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.linalg.lapack import dposv, dpotrf

from ..errors import NotConverged, require, require_finite, require_positive
from ..threads import bounded, with_outer_threads
from .event_driven import EventDrivenContact, FrictionalContact
from .rounding import EPS_PIVOT, EPS_SUM, EPS_TERM

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

    forces: np.ndarray
    gaps: np.ndarray
    closed: np.ndarray
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
class _Problem:
    """Corners that can touch, in shares of the load."""

    H: np.ndarray
    g0: np.ndarray
    c: np.ndarray
    touch: np.ndarray
    D: np.ndarray  # of regularisation
    regular: np.ndarray  # H + D + a rigid level


@bounded
def solve(matrix, g0, *, load=None, approach=None, c=None, start=None):
    """The contact state at a load or at an approach, (a).

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
    g0 = require_given(g0, load, approach)
    start = np.zeros(np.shape(g0), bool) if start is None else np.asarray(start)
    require(
        start.shape == np.shape(g0) and start.dtype == bool,
        "start",
        start,
        "must be a boolean array, one for each corner",
    )
    for problem in _problems(matrix, g0, c, free=load is not None):
        try:
            return _state(problem, start[problem.touch], load, approach)
        except NotConverged as stopped:  # more of D, then
            if load is not None and stopped.iterations:
                changes = [event.corner for event in path(matrix, g0, load, c=c)]
                closed = np.bincount(changes, minlength=len(problem.c)) % 2 == 1
                return solve(matrix, g0, load=load, c=c, start=closed)
            failure = stopped
    raise failure


@bounded
def path(matrix, g0, load, *, c=None):
    """All events from first touch to a load, [CornerEvent], by an `EventDrivenContact`. Parameters and errors
    are those of `solve`; `reached` is the last load.
    """
    g0 = require_given(g0, load)
    problem = next(_problems(matrix, g0, c, free=True))
    lift, nothing = lifted(problem.H), np.zeros((1, len(problem.g0)))
    follower = EventDrivenContact(
        FrictionalContact(problem.H + lift, nothing, np.eye(1) * lift, problem.g0, 0.0)
    )
    try:
        follower.to(load, 0.0)
    except NotConverged as failure:
        raise NotConverged(
            f"{failure}; ask for smaller loads, or for single states", reached=failure.reached[0]
        ) from failure
    return [
        CornerEvent(float(one.share * load), int(problem.touch[one.index]), f"{one.kind}s")
        for one in follower.changes
        if one.kind in ("open", "close")
    ]


def _problems(H, g0, c, free):
    """Yields the _Problem with more and more of D."""
    H = np.array(H, float)
    require(g0.ndim == 1, "g0", g0, "must be one-dimensional")
    require(
        H.shape == 2 * g0.shape and np.all(np.isfinite(H)),
        "matrix",
        H,
        f"must be a finite matrix of {len(g0)} rows and columns, as g0 has",
    )
    c = np.ones(len(g0)) if c is None else np.array(c, float)
    require(
        c.shape == g0.shape and np.all((c > 0) & (c < np.inf)),
        "c",
        c,
        "must be positive and finite, one for each corner",
    )
    touch = np.flatnonzero(np.isfinite(g0))
    H, g0 = (H / c[:, None] / c)[np.ix_(touch, touch)], (g0 / c)[touch]
    rows = np.abs(H).max(axis=1)
    # it was put together wrongly
    require(np.abs(H - H.T).max() <= 1e-8 * rows.max(), "matrix", H, "must be symmetric")
    H = (H + H.T) / 2
    rows[rows == 0] = rows.max() or 1.0
    found, lifts = False, (0.0, lifted(H))[: 1 + free]
    # D over the largest entry of the row: above the rounding of H and of its factors, m 1e-16; the last one
    # for compliances computed less well
    for level, lift in product((0.0, EPS_PIVOT, 100 * EPS_PIVOT), lifts):
        regular = H + lift + np.diag(level * rows)
        with with_outer_threads(len(H)):
            factor, failed = dpotrf(regular)
        if not failed and np.all(factor.diagonal() ** 2 > EPS_SUM * regular.diagonal()):
            found = True
            yield _Problem(H, g0, c, touch, level * rows, regular)
    given = "where the approach is given; give the load, or add a rigid level tau c c^T"
    allowed = "on vectors with c.f = 0" if free else given
    require(found, "matrix", H, f"must be positive semidefinite {allowed}")


def lifted(H):
    """The rigid level that makes an H definite that is so on zero-sum forces."""
    return float(np.abs(H).max() - min(H.min(), 0.0)) or 1.0


def require_given(g0, load, approach=None):
    """Returns initial gaps as an array; raises BadArgument unless they are finite or inf, and one of
    an approach and a positive load is given.
    """
    g0 = np.asarray(g0, float)
    require((load is None) != (approach is None), "load", load, "give either load or approach")
    if load is None:
        require_finite(approach=approach)
    else:
        require_positive(load=load)
    require(
        not np.any(np.isnan(g0) | np.isneginf(g0)) and np.any(np.isfinite(g0)),
        "g0",
        g0,
        "must be finite or inf, somewhere finite",
    )
    return g0


def _state(problem, closed, load, approach):
    """The state of the smallest residual by the proximal point method."""
    H, g0, D, count = problem.H, problem.g0, problem.D, 0
    best, forces = (np.inf,), np.zeros(len(g0))
    if load is None and approach <= g0.min():
        return _report(problem, 0.0, forces, forces > 0, approach, 0)
    for _ in range(30):  # 2 or 3 do unless H is nearly singular
        size = forces.sum()
        ahead = g0 - (approach or 0.0) - D * forces
        forces, closed, sets = block_pivoting(problem.regular, ahead, closed, load)
        d = approach if load is None else forces @ (g0 + H @ forces) / forces.sum()  # so that f.g = 0
        residual, count = _kkt(H, g0, forces, closed, d, load), count + sets
        # where rigid corners cannot take an approach the forces grow by as much again each time, and no gap
        # beside H f would show it
        if load is None and abs(forces.sum() - size) > 1e-2 * forces.sum():
            residual = max(residual, np.nextafter(ACCEPTED, 1))
        least = best[0]
        if residual < least:
            best = residual, forces, closed, d
        # no refinement improves what is rounding
        if residual <= 4 * np.finfo(float).eps or (best[0] <= ACCEPTED and not residual < least / 2):
            break
    if best[0] <= ACCEPTED:
        return _report(problem, *best, count)
    raise NotConverged(
        f"relative residual {best[0]:.1e} after many refinements at "
        f"{f'approach {approach:g}' if load is None else f'load {load:g}'}: "
        "are rigid corners pressed into the obstacle? Give the load instead of the approach"
    )


def _report(problem, kkt, forces, closed, d, sets):
    m, touch, c = len(problem.c), problem.touch, problem.c[problem.touch]
    found = np.zeros(m), np.full(m, np.inf), np.zeros(m, bool)
    for whole, own in zip(found, (forces / c, c * (problem.g0 - d + problem.H @ forces), closed)):
        whole[touch] = own
    return ContactState(*found, float(d), float(forces.sum()), sets, float(kkt))


def _kkt(H, g0, forces, closed, d, load):
    """Largest residual of (a)."""
    gaps = g0 - d + H @ forces
    wrong = np.where(closed, np.abs(gaps), np.maximum(-gaps, 0))
    terms = np.abs(g0) + abs(d) + np.abs(H) @ forces
    length = terms[closed | (wrong > 0)].max(initial=0.0)
    # rigid corners that take all of it leave nothing but rounding of H load
    length = max(length, 1e-4 * np.abs(H).max() * (load or 0.0)) or 1.0
    return max(wrong.max() / length, abs(forces.sum() - load) / load if load else 0.0)


def block_pivoting(H, g0, closed, load, patience=5, budget=None):
    """Forces and closed corners of (a), and the number of sets tried. The first wrong corner is exchanged
    alone after `patience` sets with no fewer.

    Parameters
    ----------
    H : array (m, m), positive definite
    g0 : array (m,), finite; less a given approach
    closed : boolean array (m,), to begin with
    load : float, or None where the approach is given

    Raises NotConverged if the sets do not settle, or H is singular to rounding.
    """
    # at a load its path is faster by then
    budget = budget or 500 * (len(g0) if load is None else 1)
    closed, fewest, left, diagonal = closed.copy(), len(g0) + 1, patience, H.diagonal()
    for count in range(1, budget + 1):
        if not closed.any():
            closed[np.argmin(g0)] = True
        on = np.flatnonzero(closed)
        base = 0.0 if load is None else g0[on].min()
        sides = np.column_stack((g0[on] - base, np.ones(len(on))))
        with with_outer_threads(len(on)):
            factor, found, failed = dposv(H[on[:, None], on].T, sides, overwrite_a=1)
        if failed or np.any(factor.diagonal() ** 2 < EPS_SUM * diagonal[on]):
            raise NotConverged(
                "closed corners have a flexibility that is singular to rounding: are two of them one?"
            )
        pulled, pressed = found.T
        d = 0.0 if load is None else (load + pulled.sum()) / pressed.sum()
        forces = np.zeros(len(g0))
        forces[on] = d * pressed - pulled
        moved = H[:, on] @ forces[on]
        gaps = g0 - base + moved - d
        least = -EPS_TERM * np.ptp(forces), -EPS_TERM * (np.ptp(moved) + np.abs(g0[on]).max())
        wrong = np.where(closed, forces < least[0], gaps < least[1])
        if not wrong.any():
            return np.maximum(forces, 0.0), closed, count
        left = patience if np.count_nonzero(wrong) < fewest else left - 1
        fewest = min(fewest, np.count_nonzero(wrong))
        if left < 0:
            wrong = np.arange(len(wrong)) == np.argmax(wrong)
        closed ^= wrong
    raise NotConverged(
        f"contact set of {len(g0)} corners still changing after {budget} sets, at best {fewest} "
        "corners wrong; start from a state at a nearby load, or follow the path",
        iterations=budget,
    )
