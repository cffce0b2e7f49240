"""What the nodes of a contact boundary do not see of an obstacle between them: heights and gaps.

A height missed by d between nodes w apart, and an overlap of depth d on a width w, are worth ``E* d/sqrt(w)``
in L2 of the pressure.
"""

from dataclasses import replace

import numpy as np

from ..halfplane.transmitted_singularities import log_sizes
from ..model import missed_contact
from ..model.corner_geometry import Blocks
from ..model.intervals import joined, runs
from ..model.missed_contact import PLACES, Violation
from ..model.obstacles import STEEPEST
from ..model.quadrature import lagrange
from ..model.types import Array, ObstacleLike

LOW = 2.0  # times the approach: above a higher gap a body is not looked at


class Facets:
    """The facets of a contact boundary from left to right, but for those with n2 up to `steepest`.

    Attributes
    ----------
    numbers : array (facets,), theirs in `nodes.facets`
    members : [array], the nodes of each
    left, right : arrays (facets,)
    """

    def __init__(self, nodes, steepest=STEEPEST):
        self.nodes, x = nodes, nodes.points[:, 0]
        upper = [
            i
            for i, own in enumerate(nodes.facets)
            if nodes.normals[own, 1].min() > steepest and np.ptp(x[own]) > 0
        ]
        self.numbers = np.array(sorted(upper, key=lambda i: nodes.facets[i].min()), int)
        self.members = [np.sort(nodes.facets[i]) for i in self.numbers]
        self.left, self.right = (np.array([x[own[end]] for own in self.members]) for end in (0, -1))
        self.spacing = (self.right - self.left) / [len(own) - 1 for own in self.members]

    def below(self, x):
        """Number (here) of the facet at each x1, -1 where there is none."""
        place = np.minimum(np.searchsorted(self.right, x), len(self.right) - 1)
        return np.where((self.left[place] <= x) & (x <= self.right[place]), place, -1)

    def interpolate(self, values, x):
        """Nodal values, arrays (..., nodes), at places, (..., n), by the facets' polynomials; 0 beyond
        them.
        """
        found, place = np.zeros((*np.shape(values)[:-1], len(x))), self.below(x)
        for number in np.unique(place[place >= 0]):
            own, here = self.members[number], place == number
            left, length = self.left[number], self.right[number] - self.left[number]
            shares = lagrange((self.nodes.points[own, 0] - left) / length, (x[here] - left) / length)
            found[..., here] = values[..., own] @ shares.T
        return found

    def surface(self, x):
        """Points at places on the facets and their unit normals, arrays (n, 2)."""
        x2, *normals = self.interpolate(np.vstack((self.nodes.points[:, 1], self.nodes.normals.T)), x)
        return np.column_stack((x, x2)), np.column_stack(normals / np.hypot(*normals))

    def initial_gaps(self, blocks: Blocks, obstacle: ObstacleLike, x: Array) -> Array:
        """Initial gaps of all corners at places on the facets, array (corners, n)."""
        return blocks.under(obstacle, *self.surface(x)).initial_gaps

    def pressed(self, closed):
        """Whether two nodes or more of each facet are closed."""
        return np.array([closed[own].sum() > 1 for own in self.members])


def missed(facets, closed, blocks, obstacle, sites):
    """What nodes miss of the height on closed facets: squares of pressures in L2, array (corners, facets),
    for `closed` corners, (corners, nodes), at the contact points `sites` of each.
    """
    nodes, found = facets.nodes, np.zeros((len(closed), len(facets.members)))
    at_nodes = blocks.under(obstacle, nodes.points, nodes.normals).initial_gaps
    for corner, (own, gaps, x) in enumerate(zip(closed, at_nodes, sites)):
        here = facets.below(x)
        x, here = (each[(here >= 0) & facets.pressed(own)[here]] for each in (x, here))
        with np.errstate(invalid="ignore"):  # gaps of inf, beyond an end of the obstacle
            off = np.abs(facets.initial_gaps(blocks, obstacle, x)[corner] - facets.interpolate(gaps, x))
        np.maximum.at(found[corner], here, np.where(np.isfinite(off), off, 0.0))
    return (nodes.body.solid.E_star * found) ** 2 / facets.spacing


def overlaps(facets, state, closed, sites):
    """Yields the Violations of all corners of a MeshSolution between open nodes, with worths in force per
    length^(3/2); `closed`, (corners, nodes), and the contact points `sites` of each.
    """
    for corner, (own, x) in enumerate(zip(closed, sites)):
        here = facets.below(x)
        x = x[(here >= 0) & ~facets.pressed(own)[here]]
        fields = facets.interpolate(np.array((state.displacement, state.psi)), x)
        gaps = state.corner_gaps(*facets.surface(x), *fields)[corner]
        yield from missed_contact.overlaps(corner, x, gaps, facets.nodes.body.solid.E_star)


def pulled_at_valleys(problem, zones, x, pressures, edges, reach):
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
            r, sides = np.abs(x - place), np.count_nonzero([(x < place).any(), (x > place).any()])
            i = np.argmin(np.where(r > 0.02 * far, r, np.inf))  # nearer nodes do not follow the logarithm
            r0, worth = missed_contact.log_tension(r[i], pressures[corner, i], K, far)
            yield Violation(corner, place - 2 * r0, place + 2 * r0, 0.0, worth * float(np.sqrt(sides)))


def of_body(state):
    """What a MeshSolution misses, squares of pressures in the weighted L2, array (facets,); BadArgument as of
    its `sampled`.
    """
    nodes, problem = state.nodes, state.sampled
    blocks, obstacle = state.solver.blocks, state.solver.obstacle
    facets, found = Facets(nodes), np.zeros(len(nodes.facets))
    if problem.candidates is None:
        return found
    sites = [problem.sites(corner) for corner in range(len(blocks.names))]
    squares = missed(facets, state.closed, blocks, obstacle, sites)
    wholly = np.array([state.closed[:, own].all(axis=1) for own in facets.members])
    for corner, shift in enumerate(problem.shifts):
        below = facets.below(np.add(problem.candidates.steps, shift))
        squares[corner, below[(below >= 0) & ~wholly[below, corner]]] = 0.0  # `recovery` has the edge there
    found[facets.numbers] += squares.sum(axis=0)
    # what is off beside edges `recovery` has already
    touched = np.array([state.closed[:, own].any() for own in facets.members])
    touched = touched | np.append(touched[1:], False) | np.append(False, touched[:-1])
    for each in overlaps(facets, state, state.closed, sites):
        here = int(facets.below(np.array([(each.left + each.right) / 2]))[0])
        if not touched[here]:
            found[facets.numbers[here]] += each.worth**2
    found[facets.numbers] *= state.tamed(np.array((facets.left, facets.right))).max(axis=0)
    return found


def low(state):
    """Intervals of x1 of the corners in which the gaps of a MeshSolution are low."""
    facets, found = Facets(state.nodes), []
    blocks, obstacle = state.solver.blocks, state.solver.obstacle
    count = max(40, PLACES // max(len(facets.left), 1))
    x = np.unique([np.linspace(left, right, count) for left, right in zip(facets.left, facets.right)])
    for corner in range(len(blocks.names)):
        near = facets.initial_gaps(blocks, obstacle, x)[corner] < LOW * max(state.approach, 0.0)
        places = np.concatenate((x[:1], x, x[-1:])) - state.problem.shifts[corner]
        found += [(float(places[i]), float(places[j + 2])) for i, j in runs(near)]
    return tuple(joined(found))
