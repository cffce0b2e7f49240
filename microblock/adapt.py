"""Ask for an accuracy, not for a mesh: climb a ladder of discretisations until it is reached."""

from .errors import NotConverged, require_tolerance


def climb(solve, ladder, distance, rtol):
    """Solve on finer and finer rungs until two neighbours agree to rtol.

    The finer of the two is returned; their distance bounds its error as long as a rung at least
    halves the error of the one before.

    Parameters
    ----------
    solve : rung -> result
    ladder : iterable of rungs, coarse to fine
    distance : (coarse result, fine result) -> relative difference
    rtol : float, in (0, 1)

    Returns
    -------
    (result, error estimate)

    Raises
    ------
    NotConverged
        At the end of the ladder, with the best estimate seen as `reached`.
    """
    require_tolerance(rtol)
    coarse, best = None, float("inf")
    for rung in ladder:
        fine = solve(rung)
        if coarse is not None:
            estimate = distance(coarse, fine)
            if estimate <= rtol:
                return fine, estimate
            best = min(best, estimate)
        coarse = fine
    raise NotConverged(f"rtol = {rtol:g} was not reached, the smallest error estimate was {best:.1e}; "
                       "ask for that, or fix the discretisation instead", reached=best)
