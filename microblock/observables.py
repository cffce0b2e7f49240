"""What a state shows: layer lengths from surface values and fluxes, relative errors."""

import numpy as np
from scipy.optimize import minimize_scalar

NEGLIGIBLE = 1e-13   # of the natural scale: some hundred rounding errors
REFINED = 1e-9       # of the way between two samples, to which a minimum is found: a parabola shows it no better


def layer_lengths(solid, psi, u1, micromoment, pressure):
    """Layer lengths L_psi and L_u, field over derivative at a surface free of shear, (48).

    The derivatives come from the fluxes, not from differentiating the fields: psi' from
    ``M = gamma' ell^2 mu psi'`` and u1' from ``sigma_12 = (mu + mu_c) u1' + 2 mu_c psi = 0``.

    Parameters
    ----------
    psi, u1, micromoment, pressure : float, at the surface

    Returns
    -------
    (L_psi, L_u), or (None, None) where M is nothing but rounding beside ell times the pressure
    """
    if abs(micromoment) <= NEGLIGIBLE*solid.ell*abs(pressure):
        return None, None
    slope_psi = micromoment/(solid.curvature*solid.ell**2*solid.mu)
    slope_u = -2*solid.mu_c*psi/(solid.mu + solid.mu_c)
    return psi/slope_psi, u1/slope_u


def distance(weights, pressure, moment, total):
    """max(|dp|, |dM|/ell)/|p| in L2, the norm of all error estimates; 0 without p.

    Parameters
    ----------
    weights, pressure, moment, total : arrays (n,), of the rule, dp, dM/ell and p
    """
    size = weights @ total**2
    return float(np.sqrt(max(weights @ pressure**2, weights @ moment**2)/size)) if size else 0.0


def relative_error(values, reference, weights, scale):
    """Relative L2 error of `values` against `reference` in a quadrature rule.

    Where the reference vanishes, up to rounding of `scale`: 0 if the values do too, else None.
    """
    def norm(field):
        return float(np.sqrt(weights @ np.sum(np.atleast_2d(field)**2, axis=0)))

    error, size = norm(np.subtract(values, reference)), norm(reference)
    if size > NEGLIGIBLE*scale:
        return error/size
    return 0.0 if error <= NEGLIGIBLE*scale else None


def joined(intervals):
    """Union of intervals [(left, right), ...], ascending and disjoint."""
    found = []
    for left, right in sorted(intervals):
        if found and left <= found[-1][1]:
            found[-1] = (found[-1][0], max(found[-1][1], right))
        else:
            found.append((left, right))
    return found


def common(first, second):
    """Intersection of two lists of intervals."""
    pairs = [(max(a[0], b[0]), min(a[1], b[1])) for a in first for b in second]
    return sorted(pair for pair in pairs if pair[0] < pair[1])


def contact_zones(zones, corners):
    """{"A", "B", "full", "contact": intervals} from the zones of each corner; A, B and full empty without corners.

    Intervals are pairs (left, right) of plain floats.
    """
    own = [[(float(left), float(right)) for left, right in zones[number]] for number in range(len(corners))]
    if len(corners) == 1:
        return {"A": [], "B": [], "full": [], "contact": own[0]}
    return {"A": own[0], "B": own[1], "full": common(*own), "contact": joined(own[0] + own[1])}


def half_widths(contact):
    """Half-width of the contact [(left, right), ...], and of the gap in its middle if there is one (else 0)."""
    if not len(contact):
        return 0.0, 0.0
    inner = [(left[1], right[0]) for left, right in zip(contact, contact[1:])]
    middle = max(inner, key=lambda gap: gap[1] - gap[0], default=(0.0, 0.0))
    return (contact[-1][1] - contact[0][0])/2, (middle[1] - middle[0])/2


def zone_changes(before, after):
    """What happened to a list of intervals between two neighbouring states: [(kind, x), ...].

    Kinds are "born", "merged", "split" and "vanished"; x is where.
    """
    def touching(interval, others):
        return [other for other in others if other[0] <= interval[1] and interval[0] <= other[1]]

    changes = [("born", sum(new)/2) for new in after if not touching(new, before)]
    changes += [("vanished", sum(old)/2) for old in before if not touching(old, after)]
    for kind, many, few in (("merged", before, after), ("split", after, before)):
        for interval in few:
            parts = touching(interval, many)
            changes += [(kind, (left[1] + right[0])/2) for left, right in zip(parts, parts[1:])]
    return changes


def largest(function, x, tolerance=1e-7):
    """Largest value of a function of arrays, and where: (value, [x, ...]), refined between the samples x (ascending)."""
    values = function(x)
    peaks = []
    padded = np.concatenate(([-np.inf], values, [-np.inf]))
    tops = (values >= padded[:-2]) & (values >= padded[2:]) & (values >= values.max()*(1 - 1e-3))
    for i in np.flatnonzero(tops):
        left, right = x[max(i - 1, 0)], x[min(i + 1, len(x) - 1)]
        found = minimize_scalar(lambda place: -function(np.array([place]))[0], bounds=(left, right), method="bounded",
                                options={"xatol": tolerance*(x[-1] - x[0])})
        place = np.array([found.x, x[i]])
        best = function(place)
        peaks.append((float(best.max()), float(place[np.argmax(best)])))
    top = max(value for value, _ in peaks)
    places = sorted(place for value, place in peaks if value >= top*(1 - 1e-9))
    apart = [place for number, place in enumerate(places) if number == 0 or place - places[number - 1] > 1e-6*(x[-1] - x[0])]
    return top, apart


def lowest(function, x):
    """Smallest value of a function of arrays, and where: (value, place), refined between the samples x (ascending).

    The place is None where the function is flat there, or equally low elsewhere; inf is passed over.
    """
    values = function(x)
    x, values = x[np.isfinite(values)], values[np.isfinite(values)]
    i, noise = int(np.argmin(values)), NEGLIGIBLE*np.abs(values).max()
    left, right = x[max(i - 1, 0)], x[min(i + 1, len(x) - 1)]
    low = x[values <= values[i] + noise]
    if len(low) > 2 or low[0] < left or low[-1] > right:
        return float(values[i]), None
    found = minimize_scalar(lambda place: function(np.array([place]))[0], bounds=(left, right), method="bounded",
                            options={"xatol": REFINED*(right - left)})
    if found.fun < values[i] - noise:
        return float(found.fun), float(found.x)
    return float(values[i]), float(x[i]) if len(low) == 1 else None


def runs(flags):
    """First and last index of each run of True in a boolean array (n,): [(first, last), ...]."""
    steps = np.diff(np.concatenate(([False], flags, [False])).astype(int))
    return list(zip(np.flatnonzero(steps == 1), np.flatnonzero(steps == -1) - 1))


def distance_to_ends(x, ends, shifts):
    """1; near ends (left, right) of the obstacle, where the pressure is infinite, the distance over half of its width.

    As a weight at x, array (n,), it makes the L2 norm finite. `shifts`: of the contact points from the obstacle's places.
    """
    distances = (2*np.abs(x - end - shift)/(ends[-1] - ends[0]) for end in ends for shift in shifts)
    return np.min([np.ones_like(x), *distances], axis=0)
