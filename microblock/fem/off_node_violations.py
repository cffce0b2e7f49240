"""Violations of the contact conditions between nodes.

A height missed by d between nodes w apart, and an overlap of depth d on a width w, are worth ``E* d/sqrt(w)``
in L2 of the pressure.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ..halfplane.transmitted_singularities import log_sizes
from ..model import missed_contact
from ..model.corner_geometry import Blocks
from ..model.intervals import joined, runs
from ..model.missed_contact import PLACES, Violation
from ..model.obstacles import STEEPEST
from ..model.problem import Problem
from ..model.types import Array, CornerZones, Flags, Interval, ObstacleLike
from .facet_polynomials import FacetPolynomials

LOW = 2.0  # times the indentation: above a higher gap a body is not looked at


def missed_heights(
    facets: FacetPolynomials,
    closed: Flags,
    blocks: Blocks,
    obstacle: ObstacleLike,
    sample_points: Iterable[Array],
) -> Array:
    """Returns what nodes miss of the height on closed facets: squares of pressures in L2, array (corners,
    facets), for `closed` corners, (corners, nodes), at the contact points `sample_points` of each, [(n,)].
    """
    missed = np.zeros((len(closed), len(facets.members)))
    at_nodes = blocks.under(obstacle, facets.points, facets.normals).initial_gaps
    for corner, (flags, gaps, x) in enumerate(zip(closed, at_nodes, sample_points)):
        below = facets.below(x)
        pressed = (below >= 0) & facets.pressed(flags)[below]
        x = x[pressed]
        with np.errstate(invalid="ignore"):  # gaps of inf, beyond an end of the obstacle
            off = np.abs(facets.initial_gaps(blocks, obstacle, x)[corner] - facets.interpolate(gaps, x))
        np.maximum.at(missed[corner], below[pressed], np.where(np.isfinite(off), off, 0.0))
    return (facets.solid.E_star * missed) ** 2 / facets.spacing


def overlaps_between_nodes(
    facets: FacetPolynomials, solution: Any, closed: Flags, sample_points: Iterable[Array]
) -> Iterator[Violation]:
    """Yields the Violations of all corners of a MeshSolution between open nodes, with worths in force per
    length^(3/2); `closed`, (corners, nodes), and the contact points `sample_points` of each, [(n,)].
    """
    for corner, (flags, x) in enumerate(zip(closed, sample_points)):
        below = facets.below(x)
        x = x[(below >= 0) & ~facets.pressed(flags)[below]]
        fields = facets.interpolate(np.array((solution.displacement, solution.psi)), x)
        gaps = solution.corner_gaps(*facets.surface(x), *fields)[corner]
        yield from missed_contact.overlaps(corner, x, gaps, facets.solid.E_star)


def pulled_at_valleys(
    problem: Problem, zones: CornerZones, x: Array, pressures: Array, edges: Sequence[float], reach: float
) -> Iterator[Violation]:
    """Yields Violations of no depth about slope discontinuities at which a corner is closed in tension.

    ``p = K log(r0/r)``, K < 0 (`log_sizes`), is negative up to r0, worth sqrt(2 r0) |K| in L2 on either side.
    Opened, the zone ends at about 2 r0.

    Parameters
    ----------
    zones : {corner number: intervals} of the whole line
    x, pressures : arrays (nodes,), (corners, nodes) of the computed part
    edges : places where pressures are singular
    reach : length, below which r0 stays
    """
    sizes = log_sizes(replace(problem, mirror=False), zones, 0)
    for place in problem.kinks:
        for corner, K in sizes.get(place, {}).items():
            if K >= 0 or not x[0] <= place <= x[-1]:
                continue
            far = min([reach, *(0.4 * abs(edge - place) for edge in edges if edge != place)])
            r = np.abs(x - place)
            sides = np.count_nonzero([(x < place).any(), (x > place).any()])
            i = np.argmin(np.where(r > 0.02 * far, r, np.inf))  # nearer nodes do not follow the logarithm
            r0, worth = missed_contact.log_tension(r[i], pressures[corner, i], K, far)
            yield Violation(corner, place - 2 * r0, place + 2 * r0, 0.0, worth * float(np.sqrt(sides)))


def missed_by_nodes(solution: Any) -> Array:
    """Returns what a MeshSolution misses, squares of pressures in the weighted L2, array (facets,); raises
    BadArgument as of its `sampled`.
    """
    nodes = solution.nodes
    problem = solution.sampled
    squares = np.zeros(len(nodes.facets))
    if problem.candidates is None:
        return squares
    facets = nodes.polynomials(STEEPEST)
    blocks = solution.solver.blocks
    sample_points = [problem.sample_points(corner) for corner in range(len(blocks.names))]
    heights = missed_heights(facets, solution.closed, blocks, solution.solver.obstacle, sample_points)
    wholly = np.array([solution.closed[:, nodes].all(axis=1) for nodes in facets.members])
    for corner, shift in enumerate(problem.shifts):
        below = facets.below(np.add(problem.candidates.height_jumps, shift))
        heights[corner, below[(below >= 0) & ~wholly[below, corner]]] = 0.0  # `recovery` has the edge there
    squares[facets.numbers] += heights.sum(axis=0)
    # what is off beside edges `recovery` has already
    touched = np.array([solution.closed[:, nodes].any() for nodes in facets.members])
    touched = touched | np.append(touched[1:], False) | np.append(False, touched[:-1])
    for overlap in overlaps_between_nodes(facets, solution, solution.closed, sample_points):
        number = int(facets.below(np.array([(overlap.left + overlap.right) / 2]))[0])
        if not touched[number]:
            squares[facets.numbers[number]] += overlap.worth**2
    squares[facets.numbers] *= solution.norm_weights(np.array((facets.left, facets.right))).max(axis=0)
    return squares


def low_stretches(solution: Any) -> tuple[Interval, ...]:
    """Returns intervals of x1 of the corners in which the gaps of a MeshSolution are low."""
    facets = solution.nodes.polynomials(STEEPEST)
    blocks = solution.solver.blocks
    count = max(40, PLACES // max(len(facets.left), 1))
    x = np.unique([np.linspace(left, right, count) for left, right in zip(facets.left, facets.right)])
    gaps = facets.initial_gaps(blocks, solution.solver.obstacle, x)
    stretches = []
    for corner, shift in enumerate(blocks.shifts):
        places = np.concatenate((x[:1], x, x[-1:])) - shift
        low = gaps[corner] < solution.gaps.min() + LOW * max(solution.indentation, 0.0)
        stretches += [(float(places[i]), float(places[j + 2])) for i, j in runs(low)]
    return tuple(joined(stretches))
