"""Where the pressure has no bound."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np

from .deformable import shape_of
from .height_map import HeightMap
from .intervals import contains
from .obstacles import Samples, jumps_of
from .problem import Problem
from .types import Array, Flags, Zones

# L2 norm of the ridges of pressure on bilinear facets over E* times that of the jumps of the slope: under
# spheres and paraboloids, 2 to 20 samples along a radius
RIDGES = 0.15
LEAST_RIDGES = 0.01  # of the pressure, which are said of states without an error estimate


class PlaneContact(Protocol):
    """Zones of a contact in the plane, and under what obstacle: a solution.

    Attributes
    ----------
    problem : Problem
        With the places of the obstacle that nobody has named.
    solver : Solver
        With the obstacle that was given.
    x : array (n,)
        Points of the surface (lengths).
    zones_by_name : dict of lists of (left, right)
    period : float or None
    """

    problem: Any
    solver: Any
    x: Any
    zones_by_name: Any
    period: Any


def touched(contact: PlaneContact, places: Sequence[float], within: float = 0.0) -> list[float]:
    """Returns the contact points x1, ascending, with a corner closed at one of the obstacle's places, up to
    `within` (length) beside a zone.
    """
    points, closed = _closed(contact, places, within)
    return sorted(set(points[closed].tolist()))


def _closed(contact: PlaneContact, places: Sequence[float], within: float) -> tuple[Array, Flags]:
    """Returns the contact points of places, array (corners, n), and whether the corner is closed there."""
    problem: Problem = contact.problem
    zones: Zones = contact.zones_by_name
    corners = problem.law.corners
    margin = max(1e-6 * problem.ell, within) * np.array((-1, 1))
    points = np.add.outer(problem.shifts, places)
    names = corners if len(corners) == 2 else ["contact"] * len(corners)
    closed = [contains(np.reshape(zones[name], (-1, 2)) + margin, row) for name, row in zip(names, points)]
    return points, np.array(closed)


def unbounded(contact: PlaneContact) -> list[float]:
    """Returns the places x1 in contact at which the pressure is infinite."""
    obstacle = contact.problem.obstacle
    return touched(contact, (*_peaks(obstacle), *obstacle.ends))


def _peaks(obstacle: Any) -> list[float]:
    """Returns the places at which the slope jumps upwards."""
    return [place for place, jump in jumps_of(obstacle) if jump > 0]


def of_samples(contact: PlaneContact) -> list[str]:
    """Returns sentences on heights that are NaN, and on a contact with the last sample or with edges between
    lines.
    """
    samples = shape_of(contact.solver.obstacle)
    if not isinstance(samples, Samples):
        return []
    sentences = _unknown(samples.unknown, len(samples.x))
    if not np.any(samples.jumps):  # a horizontal or tilted face is a punch
        return sentences
    period = contact.period
    x = contact.x
    if period is not None:
        samples = samples.closed(period)
    edges = samples.ends
    if period is not None and np.ptp(edges) >= period * (1 - 1e-6):
        edges = edges[1:-1]  # over a whole period the next one begins there
    for edge in _seen(edges, period):
        after = int(np.clip(np.searchsorted(x, edge), 1, len(x) - 1))
        if touched(contact, (edge,), x[after] - x[after - 1]):
            sentences.append(
                f"the contact reaches the last sample at x = {edge:g}, taken as a sharp edge: measure "
                "farther, or check the sign of the heights, which grow away from the body"
            )
    peaks = _seen(_peaks(samples), period)
    sharp = np.count_nonzero(_closed(contact, peaks, 0.0)[1].any(axis=0))
    if sharp:
        words = (
            f"straight lines between {len(samples.x)} samples: the pressure is unbounded at {sharp} of "
            "them; a smooth curve of SciPy has no such places: take curve = CubicSpline(x, z), or if the "
            "heights have noise UnivariateSpline(x, z, s=1.1 * len(x) * noise**2), and then "
            "Obstacle(lambda t: np.where((t < x[0]) | (t > x[-1]), np.inf, curve(t)))"
        )
        sentences.append(words if len(samples.ends) == 2 else words.partition(";")[0])
    return sentences


def of_map(obstacle: Any, state: Any) -> list[str]:
    """Returns sentences on heights of a map that are NaN, on what its samples leave open of the pressures of
    a state in space, and on a contact that reaches an edge of the map or of a hole in it: a cell and a
    corner's distance farther there is no obstacle.
    """
    heights = shape_of(obstacle)
    if not isinstance(heights, HeightMap):
        return []
    touching = state.closed > 0
    sentences = _unknown(heights.unknown, heights.heights.size) + _sampled(heights, state, touching)
    reach = np.sqrt(state.weights[touching])
    if len(state.pressures) > 1:
        reach = reach + state.solid.ell / 2
    x1, x2 = state.points[touching, :2].T
    beside = [(x1 + reach * a, x2 + reach * b) for a, b in ((1, 0), (-1, 0), (0, 1), (0, -1))]
    at_edge = np.isinf([heights.height(*places) for places in beside]).any(axis=0)
    if at_edge.any():
        place = int(np.argmax(at_edge))
        sentences.append(
            f"the contact reaches an edge of the map, as at ({x1[place]:.3g}, {x2[place]:.3g}), taken as "
            "sharp: measure farther, fill holes, take a rough map as a period (periodic=True), or check the "
            "sign of the heights, which grow away from the body"
        )
    return sentences


def _sampled(heights: HeightMap, state: Any, touching: Flags) -> list[str]:
    """Returns a sentence where facets between samples have ridges in the pressure that are larger than its
    error estimate, from the jumps of the slope under cells or nodes that touch, boolean array (n,). Cells as
    large as the spacing do not see facets.
    """
    weights = state.weights[touching]
    if not touching.any() or weights.min() > 0.9 * np.prod(heights.spacing):
        return []
    jumps = heights.slope_jumps(*state.points[touching, :2].T)
    of_ridges = RIDGES * state.solid.E_star * np.sqrt(weights @ jumps**2)
    uncertainty = of_ridges / np.sqrt(weights @ state.pressure[touching] ** 2)
    if state.accuracy != "pressure" or not uncertainty > (state.error_estimate or LEAST_RIDGES):
        return []
    return [
        f"the samples leave the pressure uncertain by {uncertainty:.1g}: facets between them have ridges of "
        "pressure; where the surface is smooth give it as a function, or measure it more finely"
    ]


def _unknown(count: int, size: int) -> list[str]:
    """Returns a sentence on how many heights are NaN."""
    if not count:
        return []
    return [f"{count} of {size} heights are NaN: taken as places without an obstacle"]


def _seen(places: Sequence[float], period: float | None) -> list[float]:
    """Returns places as a state names them: on a period those of its images about 0."""
    return [place if period is None else place - period * round(place / period) for place in places]
