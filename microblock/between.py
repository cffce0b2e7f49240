"""What the nodes of a contact boundary do not see of an obstacle: its heights and the gaps at places between them.

A pressure closes gaps at nodes, so that it follows not the obstacle but its polynomial through the nodes of each facet. What that
misses by d on a facet of length w and order k, and an overlap of depth d on a width w, are worth ``E* d/sqrt(w/k)`` and
``E* d/sqrt(w)`` in L2 of the pressure, as overlaps in front of panels are (`survey`).
"""

from dataclasses import dataclass

import numpy as np

from .observables import runs


@dataclass(frozen=True)
class Overlap:
    """An interval of x1 in which a corner (its number) overlaps the obstacle by `depth` (length), and what that is worth (force
    per length^(3/2): a pressure in L2)."""

    corner: int
    left: float
    right: float
    depth: float
    worth: float


def initial_gaps(nodes, law, obstacle, corner, x):
    """Initial gaps of a corner at x1 = x on the contact boundary of a body, array (n,)."""
    points = np.column_stack((x, nodes.interpolate(nodes.points[:, 1], x)))
    normals = np.column_stack([nodes.interpolate(part, x) for part in nodes.normals.T])
    normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]
    return list(law.initial_gaps(points, normals, nodes.body.solid.ell, obstacle).values())[corner]


def missed(nodes, closed, law, obstacle, sites):
    """What nodes miss of the height on closed facets: array (facets,) of squares of pressures in L2, in the order of `interpolation`.

    Parameters
    ----------
    closed : boolean array (corners, nodes)
    sites : [array, ...], places of each corner's contact point at which the height is looked at, ascending
    """
    found, stiffness = np.zeros(len(nodes.interpolation)), nodes.body.solid.E_star
    for corner, (own, x) in enumerate(zip(closed, sites)):
        here = _facets(nodes, x)
        pressed = np.array([own[members].sum() > 1 for _, _, members in nodes.interpolation])
        x, here = (each[(here >= 0) & pressed[here]] for each in (x, here))
        if not len(x):
            continue
        at_nodes = list(law.initial_gaps(nodes.points, nodes.normals, nodes.body.solid.ell, obstacle).values())[corner]
        whole = np.array([np.isfinite(at_nodes[members]).all() for _, _, members in nodes.interpolation])
        off = np.abs(initial_gaps(nodes, law, obstacle, corner, x) - nodes.interpolate(np.where(np.isfinite(at_nodes), at_nodes, 0.0), x))
        deepest = np.zeros(len(found))
        np.maximum.at(deepest, here, np.where(whole[here] & np.isfinite(off), off, 0.0))
        spacing = np.array([(right - left)/(len(members) - 1) for left, right, members in nodes.interpolation])
        found += (stiffness*deepest)**2/spacing
    return found


def overlaps(nodes, closed, law, obstacle, sites, *, approach, raised, psi):
    """[Overlap] of all corners between open nodes, with the approach and the surface's u.n and psi at the nodes."""
    found, ell, stiffness = [], nodes.body.solid.ell, nodes.body.solid.E_star
    for corner, (own, x) in enumerate(zip(closed, sites)):
        here = _facets(nodes, x)
        pressed = np.array([own[members].sum() > 1 for _, _, members in nodes.interpolation])
        x = x[(here >= 0) & ~pressed[here]]
        if not len(x):
            continue
        lever = list(law.levers(x).values())[corner]
        steep = nodes.interpolate(nodes.normals[:, 1], x)
        gaps = (initial_gaps(nodes, law, obstacle, corner, x) - approach*steep - nodes.interpolate(raised, x)
                + ell/2*lever*nodes.interpolate(psi, x))
        borders = np.concatenate((x[:1], (x[1:] + x[:-1])/2, x[-1:]))
        for first, last in runs(gaps < 0):
            left, right, depth = float(borders[first]), float(borders[last + 1]), float(-gaps[first:last + 1].min())
            if right > left:
                found.append(Overlap(corner, left, right, depth, stiffness*depth/np.sqrt(right - left)))
    return found


def _facets(nodes, x):
    """Number of the facet above which each x1 lies, in the order of `interpolation`; -1 beyond the boundary."""
    facets = nodes.interpolation
    place = np.searchsorted([right for _, right, _ in facets], x)
    inside = (place < len(facets)) & (x >= facets[0][0])
    return np.where(inside, np.minimum(place, len(facets) - 1), -1)
