"""Contact states on a compliance: one load or approach by block pivoting, or the whole load path event by
event.

Corner forces f >= 0 and the approach d leave the gaps

    g = g0 - c d + H f >= 0,     f.g = 0,     c.f = P,                                              (a)

H the symmetric flexibility of the corners, c > 0 the weights of their forces in the load. In shares of the
load c_i f_i and gaps g_i/c_i the weights are 1 and c.f = 0 reads "zero-sum"; so everything below works.

Free approach. Let corner r be closed. Then g_r = 0 gives d, c.f = P gives f_r, and for the others there
remains

    w = q + K z >= 0,  z >= 0,  w.z = 0,     K_ij = H_ij - H_ir - H_rj + H_rr,                        (b)
                                             q_i  = g0_i - g0_r + P (H_ir - H_rr),

in which H + tau c c^T leaves K and q as they are: the rigid level of H touches no force. K is positive
definite if and only if H is on zero-sum vectors, so a P-matrix, and (b) has one solution. If it has f_r >= 0
it solves (a). If f_r < 0 corner r is open in (a), as a state with it closed would be a second solution of
(b); it is dropped for good and the largest force becomes r. So at most m problems (b) give (a). With d
prescribed (a) itself is (b), with K = H and q = g0 - c d.

Safeguard. Problem (b) with a P-matrix is what the proof covers. Block pivoting exchanges all corners with z
or w < 0; when PATIENCE exchanges bring no fewer of them, the first such corner alone is exchanged until there
are fewer (Judice and Pires, Comput. Oper. Res. 21 (1994) 587; Portugal, Judice and Vicente, Math. Comp. 63
(1994) 625).
Exchanging the first one ends for every P-matrix and q, degenerate or not (Murty, Opsearch 11 (1974) 123;
Kostreva, Linear Algebra Appl. 21 (1978) 207; Rohn, Math. Program. 46 (1990) 255), by induction: the last
corner moves only when the others are solved with it fixed. Were it to move back, the two solutions x, y would
have (x - y)_i (K (x - y))_i <= 0 for all i, which no P-matrix allows. All this in exact arithmetic; against
rounding stands a budget of pivots.

Duplicated rows make H semidefinite. H + D is what is solved, D a diagonal just above rounding, and the forces
found, f', shift the gaps to g0 - D f' for the next solve (proximal point method, Rockafellar, SIAM J. Control
Optim. 14 (1976) 877). What a solve leaves in (a) is D (f - f'). Duplicates share their force, evenly to
1e-16/D or so.
"""

from collections import Counter
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from ..errors import BadArgument, NotConverged, require_finite, require_numbers
from ..threads import bounded, released
from .follower import Follower, FrictionalContact

ROUNDING = 1e-14  # relative to its own terms, some rounding errors: below it a sign means nothing
ROUNDED = 1e-15  # relative residual that no refinement improves
ACCEPTED = 1e-11  # relative residual at which a state counts as solved
# D over the largest entry of the row: above the rounding of H and of its factors, m 1e-16; the others for
# compliances computed less well
REGULARISATION = (1e-12, 1e-10, 1e-8)
# change of the load from one refinement to the next, relative: where rigid corners cannot take an
# approach the forces grow by as much again each time, and no gap beside H f would show it
SETTLED = 1e-2
REFINEMENTS = 30  # solves of the proximal point method; 2 or 3 do unless H is nearly singular
PATIENCE = 5  # block exchanges without progress before single ones; 3 to 10 in the literature
PIVOTS = 500  # at a load, before its path is followed instead, which is faster by then
SYMMETRY = 1e-8  # of the largest entry: a compliance off by more was put together wrongly
SINGULAR = "closed corners have a flexibility that is singular to rounding: are two of them one?"


@dataclass(frozen=True)
class ContactState:
    """One contact state.

    Attributes
    ----------
    forces, gaps : arrays (m,); gaps are recomputed from H and the forces, inf where a corner cannot touch
    closed : boolean array (m,), the solver's own set; a closed corner may carry no force
    approach, load : float, d and c.f
    iterations : int, complementary sets that were tried
    single_pivots : int, those by the safeguard
    dropped : int, corners that were taken for closed to eliminate the approach, and were not
    regularisation : float, D over the largest entry of each row
    kkt : float
        Largest relative residual of load, complementarity and feasibility.
    followed : bool
        Whether the load path was followed to here, as pivots made no progress: matrices without full rank may
        do that.
    """

    forces: np.ndarray
    gaps: np.ndarray
    closed: np.ndarray
    approach: float
    load: float
    iterations: int
    single_pivots: int
    dropped: int
    regularisation: float
    kkt: float
    followed: bool = False


@dataclass(frozen=True)
class CornerEvent:
    """A corner that closes or opens at this load; at load 0 the first touch."""

    load: float
    approach: float
    corner: int
    kind: str


@dataclass(frozen=True)
class Path:
    """States at the loads asked for, ascending, and every event from first touch to the last of them."""

    states: list
    events: list


@dataclass(frozen=True)
class _Problem:
    """Corners that can touch, in shares of the load: weights 1."""

    H: np.ndarray
    g0: np.ndarray
    c: np.ndarray
    touch: np.ndarray
    level: float  # of regularisation
    D: np.ndarray
    regular: np.ndarray  # H + D
    reduced: dict  # {r: K}, as far as they were needed


@bounded
def solve(H, g0, *, load=None, approach=None, c=None, start=None):
    """The contact state at a load or at an approach, (a).

    Parameters
    ----------
    H : array (m, m), length per force; positive semidefinite, at a given load on zero-sum vectors only
    g0 : array (m,), initial gaps; inf where a corner can never touch
    load, approach : float, one of them
    c : array (m,), weights > 0 of the forces in the load; 1 without it
    start : boolean array (m,), closed corners to begin with

    Raises
    ------
    BadArgument
        Also for an H that is not positive semidefinite: no unique state then.
    NotConverged
        If pivots are used up at a given approach (at a load the path is followed then: `followed`), or if
        rigid corners cannot take the approach.
    """
    if (load is None) == (approach is None):
        raise BadArgument("load", load, "give either load or approach")
    if approach is not None:
        require_finite(approach=approach)
    else:
        require_finite(load=load)
        load = _loads(load, "load")[0]
    singular = None
    for problem in _problems(H, g0, c, free=load is not None):
        try:
            return _state(problem, _start(start, problem), load, approach)
        except np.linalg.LinAlgError as failure:
            singular = failure  # more of D, then
        except NotConverged as failure:
            if load is None or not failure.iterations:  # not the pivots
                raise
            return replace(path(H, g0, [load], c=c).states[0], followed=True)
    raise NotConverged(SINGULAR) from singular


@bounded
def path(H, g0, loads, *, c=None):
    """States at the `loads` and all events from first touch to the last load.

    Between events the state is affine in the load, from event to event of a `follower.Follower`.
    The states are refined by `solve` on the set found. Parameters and errors as there; `reached` is the last
    load.
    """
    loads = _loads(loads, "loads")
    singular = None
    for problem in _problems(H, g0, c, free=True):
        try:
            return _follow(problem, loads)
        except NotConverged as failure:
            singular = failure
            if not isinstance(failure.__cause__, np.linalg.LinAlgError):
                raise  # and with more of D otherwise
    raise singular


def _follow(problem, loads):
    """The Path of one problem."""
    H, g0 = problem.H, problem.g0
    lift = H.diagonal().max() - min(H.min(), 0.0)  # no force feels it; with it H is definite
    none = np.zeros((0, len(g0)))
    follower, pieces = Follower(FrictionalContact(H + lift, none, none[:, :0], g0, 0.0)), []
    try:
        for share in follower.pieces(loads[-1]):
            load = float(share * loads[-1])
            pieces.append((load, follower.approach - lift * load, follower.closed.copy()))
    except (NotConverged, np.linalg.LinAlgError) as failure:
        reached = pieces[-1][0] if pieces else 0.0
        raise NotConverged(
            f"path stopped at load {reached} on the way to {loads[-1]:g}: {failure}; ask for smaller "
            "loads, or for single states",
            reached=reached,
        ) from failure
    states, events, before = [], [], np.zeros(len(problem.touch), bool)
    ends = [load for load, _, _ in pieces[1:]] + [np.inf]
    for (load, approach, closed), end in zip(pieces, ends, strict=True):
        events += [
            CornerEvent(load, approach, int(problem.touch[i]), "closes" if closed[i] else "opens")
            for i in np.flatnonzero(closed != before)
        ]
        try:
            states += [_state(problem, closed, load=asked) for asked in loads if load <= asked < end]
        except np.linalg.LinAlgError as failure:
            raise NotConverged(SINGULAR, reached=load) from failure
        before = closed
    return Path(states, events)


def _problems(H, g0, c, free):
    """The _Problem, with more and more of D."""
    H, g0 = np.array(H, float), np.array(g0, float)
    if g0.ndim != 1 or np.any(np.isnan(g0) | (g0 == -np.inf)) or not np.any(np.isfinite(g0)):
        raise BadArgument("g0", g0, "must be one-dimensional, finite or inf, somewhere finite")
    if H.shape != (len(g0), len(g0)) or not np.all(np.isfinite(H)):
        raise BadArgument("H", H, f"must be a finite matrix of {len(g0)} rows and columns, as g0 has")
    c = np.ones(len(g0)) if c is None else np.array(c, float)
    if c.shape != g0.shape or not np.all((c > 0) & (c < np.inf)):
        raise BadArgument("c", c, "must be positive and finite, one for each corner")
    touch = np.flatnonzero(np.isfinite(g0))
    H, g0 = (H / c[:, None] / c)[np.ix_(touch, touch)], (g0 / c)[touch]
    rows = np.abs(H).max(axis=1)
    if np.abs(H - H.T).max() > SYMMETRY * rows.max():
        raise BadArgument("H", H, "must be symmetric")
    H = (H + H.T) / 2
    rows[rows == 0] = rows.max() or 1.0
    nearest = int(np.argmin(g0))
    found = False
    # where a row is nothing beside the others, its own size does not stand against their rounding
    for scale, level in product((rows, np.full_like(rows, rows.max())), REGULARISATION):
        regular = H + np.diag(level * scale)
        reduced = {nearest: _without(regular, nearest)} if free else {}
        if _is_positive(reduced[nearest] if free else regular):
            found = True
            yield _Problem(H, g0, c, touch, level, level * scale, regular, reduced)
    if not found:
        allowed = "where the approach is given; give the load, or add a rigid level tau c c^T"
        allowed = "on vectors with c.f = 0" if free else allowed
        raise BadArgument("H", H, f"must be positive semidefinite {allowed}")


def _is_positive(H):
    try:
        with released(len(H)):
            np.linalg.cholesky(H)
    except np.linalg.LinAlgError:
        return False
    return True


def _without(H, r):
    """K of (b), for the corners other than r."""
    column = np.delete(H[r], r)
    K = np.delete(np.delete(H, r, 0), r, 1)
    K -= column[:, None]
    K -= column - H[r, r]
    return K


def _start(start, problem):
    if start is None:
        return np.zeros(len(problem.touch), bool)
    start = np.asarray(start)
    if start.shape != problem.c.shape or start.dtype != bool:
        raise BadArgument("start", start, "must be a boolean array, one for each corner")
    return start[problem.touch]


def _loads(loads, name):
    values = np.sort(require_numbers(**{name: loads}))
    if not len(values) or values[0] < 0:
        raise BadArgument(name, loads, "must be finite and not negative")
    return values


def _state(problem, closed, load=None, approach=None):
    """Proximal point method on (a), the state with the smallest residual."""
    H, g0, D, regular = problem.H, problem.g0, problem.D, problem.regular
    steps, best, forces = Counter(), None, np.zeros(len(g0))
    if load == 0 or (load is None and approach <= g0.min()):
        d = g0.min() if load == 0 else approach
        return _report(problem, forces, np.zeros(len(g0), bool), d, 0.0, steps)
    for _ in range(REFINEMENTS):
        before = forces
        if load is None:
            forces, closed = _pivoting(regular, g0 - D * forces - approach, closed, steps)
        else:
            forces, closed = _at_load(regular, g0 - D * forces, load, closed, steps, problem.reduced)
        forces = np.maximum(forces, 0)  # rounding
        d = approach if load is None else forces @ (g0 + H @ forces) / forces.sum()  # so that f.g = 0
        residual = _kkt(H, g0, forces, closed, d, load)
        if load is None and abs(forces.sum() - before.sum()) > SETTLED * forces.sum():
            residual = max(residual, np.nextafter(ACCEPTED, 1))
        gain = best is None or residual < best[0] / 2
        if best is None or residual < best[0]:
            best = residual, forces, closed, d
        if residual <= ROUNDED or (best[0] <= ACCEPTED and not gain):
            break
    if best[0] > ACCEPTED:
        raise NotConverged(
            f"relative residual {best[0]:.1e} after {REFINEMENTS} refinements at "
            f"{f'approach {approach:g}' if load is None else f'load {load:g}'}: "
            "are rigid corners pressed into the obstacle? Give the load instead of the approach"
        )
    return _report(problem, *best[1:], best[0], steps)


def _report(problem, forces, closed, d, kkt, steps):
    m, touch, c = len(problem.c), problem.touch, problem.c[problem.touch]
    whole = {"forces": np.zeros(m), "gaps": np.full(m, np.inf), "closed": np.zeros(m, bool)}
    whole["forces"][touch] = forces / c
    whole["gaps"][touch] = c * (problem.g0 - d + problem.H @ forces)
    whole["closed"][touch] = closed
    return ContactState(
        **whole,
        approach=float(d),
        load=float(forces.sum()),
        kkt=float(kkt),
        iterations=steps["sets"],
        single_pivots=steps["single"],
        dropped=steps["dropped"],
        regularisation=problem.level,
    )


def _kkt(H, g0, forces, closed, d, load):
    """Largest residual of (a); gaps over the largest terms that make up a gap where it matters."""
    gaps = g0 - d + H @ forces
    wrong = np.where(closed, np.abs(gaps), np.maximum(-gaps, 0))
    terms = np.abs(g0) + abs(d) + np.abs(H) @ forces
    length = terms[closed | (wrong > 0)].max(initial=0.0)
    # rigid corners that take all of it leave nothing but rounding: ROUNDED of H load is ACCEPTED
    if load is not None:
        length = max(length, ROUNDED / ACCEPTED * np.abs(H).max() * load)
    parts = [wrong.max() / length if length else 0.0]
    if load is not None:
        parts.append(abs(forces.sum() - load) / load)
    return max(parts)


def _at_load(H, g0, load, closed, steps, reduced):
    """Forces and set of (a) by problems (b); `closed` is where to begin, `reduced` keeps {r: K}."""
    left = np.arange(len(g0))
    r = int(np.argmin(np.where(closed, g0, np.inf) if closed.any() else g0))
    while True:
        other = left[left != r]
        q = g0[other] - g0[r] + load * (H[other, r] - H[r, r])
        if r not in reduced:
            reduced[r] = _without(H, r)
        K, rows = reduced[r], other - (other > r)
        z, chosen = _pivoting(
            K if len(rows) == len(K) else K[np.ix_(rows, rows)], q, closed[other], steps, budget=PIVOTS
        )
        forces, closed = np.zeros(len(g0)), np.zeros(len(g0), bool)
        forces[other], closed[other] = z, chosen
        forces[r], closed[r] = load - z.sum(), True
        if forces[r] >= -ROUNDING * load:
            return forces, closed
        steps["dropped"] += 1
        left, r = other, int(other[np.argmax(z)])


def _pivoting(K, q, closed, steps, patience=PATIENCE, budget=None):
    """z and closed set of (b) by block pivoting; without the safeguard if `patience` is infinite."""
    closed, fewest, left = closed.copy(), len(q) + 1, patience
    budget = budget or 5000 + 10 * len(q)  # single pivots: 2^m at worst, seldom above m
    for _ in range(budget):
        z, wrong = _complementary(K, q, closed)
        steps["sets"] += 1
        count = np.count_nonzero(wrong)
        if count == 0:
            return z, closed
        left = patience if count < fewest else left - 1
        fewest = min(fewest, count)
        if left >= 0:
            closed ^= wrong
        else:
            closed[np.argmax(wrong)] ^= True
            steps["single"] += 1
    raise NotConverged(
        f"contact set of {len(q)} corners still changing after {budget} pivots, at best {fewest} "
        "corners wrong; start from a state at a nearby load, or follow the path",
        iterations=budget,
    )


def _complementary(K, q, closed):
    """z of the set, w = 0 where closed and z = 0 where open, and where z or w is negative beyond rounding."""
    z, columns = np.zeros(len(q)), K[:, closed]
    with released(columns.shape[1]):
        z[closed] = np.linalg.solve(columns[closed], -q[closed])
    if not np.all(np.isfinite(z)):
        raise NotConverged(f"forces of {closed.sum()} closed corners overflow; scale the flexibility")
    w = q + columns @ z[closed]
    rounding = ROUNDING * (np.abs(q) + np.abs(columns) @ np.abs(z[closed]))
    return z, np.where(closed, z < -ROUNDING * np.abs(z).max(initial=0.0), w < -rounding)
