"""What the nodes of a contact boundary do not see of an obstacle: its heights and the gaps at places between
them.

A height that is missed by d between nodes w apart, and an overlap of depth d on a width w, are worth ``E*
d/sqrt(w)`` in L2 of the pressure. Where the slope of the obstacle falls, the pressure of a closed corner
falls to -inf with the logarithm of the distance: there the zone has to open.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..halfplane.carried import log_sizes
from ..model import picture
from ..model.obstacles import STEEPEST
from ..model.quadrature import lagrange
from ..model.zones import joined, runs

LOW = 2.0  # times the approach: above a higher gap a body is not looked at
AWAY = 0.4  # of the way from a valley to the next singular place: up to there its logarithm is read
CLOSE = 0.02  # of that: nearer to the valley nodes do not follow the logarithm
ROUNDED = 12  # digits of the places of nodes on a facet: those of straight facets of one order are alike
LOOKED_AT = 40  # places on each facet, from which that is seen


@dataclass(frozen=True)
class Overlap:
    """An interval of x1 in which a corner (its number) overlaps the obstacle by `depth` (length), and what
    that is worth (force per length^(3/2): a pressure in L2)."""

    corner: int
    left: float
    right: float
    depth: float
    worth: float


class Facets:
    """The facets of a contact boundary from left to right, but for those that are steeper than corners can
    touch, or than n2 = `steepest`; and functions of x1 on them.

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
        self.numbers = np.array(sorted(upper, key=lambda i: x[nodes.facets[i]].min()), int)
        self.members = [nodes.facets[i][np.argsort(x[nodes.facets[i]])] for i in self.numbers]
        self.left, self.right = (np.array([x[own[end]] for own in self.members]) for end in (0, -1))
        self.spacing = (self.right - self.left) / [len(own) - 1 for own in self.members]

    def below(self, x):
        """Number (here) of the facet at each x1, -1 where there is none."""
        place = np.minimum(np.searchsorted(self.right, x), len(self.right) - 1)
        return np.where((self.left[place] <= x) & (x <= self.right[place]), place, -1)

    def interpolate(self, values, x):
        """Nodal values, arrays (..., nodes), at places, (..., n): on each facet the polynomial through its
        nodes, 0 beyond them.
        """
        found, place = np.zeros((*np.shape(values)[:-1], len(x))), self.below(x)
        along = (x - self.left[place]) / (self.right - self.left)[place]
        for shape, number, members in self._alike:
            here = (place >= 0) & (number[place] >= 0)
            if here.any():
                own = members[number[place[here]]]
                found[..., here] = np.sum(values[..., own] * lagrange(shape, along[here]), axis=-1)
        return found

    @cached_property
    def _alike(self):
        """[(places of nodes on facets alike, in lengths; number of each facet among these, or -1; their
        nodes)]: arrays (k,), (facets,), (n, k).
        """
        groups = {}
        for i, (own, left, right) in enumerate(zip(self.members, self.left, self.right)):
            shape = np.round((self.nodes.points[own, 0] - left) / (right - left), ROUNDED)
            groups.setdefault(tuple(shape), []).append(i)
        found = []
        for shape, alike in groups.items():
            number = np.full(len(self.members), -1)
            number[alike] = np.arange(len(alike))
            found.append((np.array(shape), number, np.array([self.members[i] for i in alike])))
        return found

    def initial_gaps(self, law, obstacle, corner, x):
        """Initial gaps of a corner at places on the facets, array (n,)."""
        both = self.interpolate(np.vstack((self.nodes.points[:, 1], self.nodes.normals.T)), x).T
        normals = both[:, 1:] / np.linalg.norm(both[:, 1:], axis=1)[:, None]
        found = law.initial_gaps(
            np.column_stack((x, both[:, 0])), normals, self.nodes.body.solid.ell, obstacle
        )
        return list(found.values())[corner]

    def pressed(self, closed):
        """Whether two nodes or more of each facet are closed, boolean array (facets,)."""
        return np.array([closed[own].sum() > 1 for own in self.members])


def missed(facets, closed, law, obstacle, sites):
    """What nodes miss of the height on closed facets: squares of pressures in L2, array (facets,).

    `closed` is a boolean array (corners, nodes), `sites` are the contact points of each corner to look at.
    """
    nodes, found = facets.nodes, np.zeros(len(facets.members))
    at_nodes = np.array(
        list(law.initial_gaps(nodes.points, nodes.normals, nodes.body.solid.ell, obstacle).values())
    )
    for corner, (own, gaps, x) in enumerate(zip(closed, at_nodes, sites)):
        whole = facets.pressed(own) & [np.isfinite(gaps[members]).all() for members in facets.members]
        here = facets.below(x)
        x, here = (each[(here >= 0) & whole[here]] for each in (x, here))
        if len(x):
            smooth = facets.interpolate(np.where(np.isfinite(gaps), gaps, 0.0), x)
            off = np.abs(facets.initial_gaps(law, obstacle, corner, x) - smooth)
            deepest = np.zeros(len(found))
            np.maximum.at(deepest, here, np.where(np.isfinite(off), off, 0.0))
            found += (nodes.body.solid.E_star * deepest) ** 2 / facets.spacing
    return found


def overlaps(facets, closed, law, obstacle, sites, *, approach, raised, psi, counter=None):
    """[Overlap] of all corners between open nodes, with u.n and psi there; `counter` is the displacement of a
    second body, a function of x1.
    """
    nodes, found = facets.nodes, []
    ell, stiffness = nodes.body.solid.ell, nodes.body.solid.E_star
    for corner, (own, x) in enumerate(zip(closed, sites)):
        here = facets.below(x)
        x = x[(here >= 0) & ~facets.pressed(own)[here]]
        if not len(x):
            continue
        lever = list(law.levers(x).values())[corner]
        upwards, up, turned = facets.interpolate(np.array((nodes.normals[:, 1], raised, psi)), x)
        gaps = (
            facets.initial_gaps(law, obstacle, corner, x) - approach * upwards - up + ell / 2 * lever * turned
        )
        if counter is not None:
            gaps = gaps + counter(x - law.shifts(ell)[corner] * upwards) * upwards
        borders = np.concatenate((x[:1], (x[1:] + x[:-1]) / 2, x[-1:]))
        for first, last in runs(gaps < 0):
            left, right, depth = (
                float(borders[first]),
                float(borders[last + 1]),
                float(-gaps[first : last + 1].min()),
            )
            if right > left:
                found.append(
                    Overlap(corner, left, right, depth, float(stiffness * depth / np.sqrt(right - left)))
                )
    return found


def pulled_at_valleys(problem, zones, x, pressures, edges, reach):
    """[Overlap] of no depth about slope discontinuities at which a corner is closed in tension.

    ``p = A + B r + K log(1/r)``, K < 0 (`log_sizes`), is negative up to about ``r0 = exp(A/K)``, worth sqrt(2
    r0) |K| in L2 on either side. Opened, the zone ends at about 2 r0.

    Parameters
    ----------
    problem : Problem
    zones : {corner number: intervals} of the whole line, on which gaps are closed
    x, pressures : arrays (nodes,), (corners, nodes) of the computed part
    edges : list of float
        All places at which pressures of the computed part are singular.
    reach : float
        Farthest distance at which A and B are read (length).
    """
    found, sizes = [], log_sizes(replace(problem, mirror=False), zones, 0)
    for place in problem.kinks:
        for corner, K in sizes.get(place, {}).items():
            if K >= 0 or not x[0] <= place <= x[-1]:
                continue
            way = min([reach, *(AWAY * abs(edge - place) for edge in edges if edge != place)])
            sides = [_pulled(pressures[corner], (x - place) * sign, way, K) for sign in (-1, 1)]
            r0, square = max(sides), 2 * sum(sides) * K**2
            found.append(Overlap(corner, place - 2 * r0, place + 2 * r0, 0.0, float(np.sqrt(square))))
    return found


def _pulled(p, r, reach, K):
    """Distance from a valley up to which the pressure is negative on one side, 0 where there are no nodes."""
    here = (r > CLOSE * reach) & (r < reach)
    if not here.any():
        return 0.0
    smooth, line = p[here] + K * np.log(r[here]), np.vander(r[here], min(2, here.sum()), increasing=True)
    return float(min(reach, np.exp(np.linalg.lstsq(line, smooth, rcond=None)[0][0] / K)))


def of_body(state):
    """The same of a MeshSolution: what is missed and overlaps, array (facets,).

    Raises
    ------
    BadArgument
        For a height, or a psi0, of which no picture can be made.
    """
    nodes, law, obstacle = state.nodes, state.law, state.solver.obstacle
    facets, found = Facets(nodes), np.zeros(len(nodes.facets))
    stretches = _low(facets, state)
    if not stretches:
        return found
    problem = state.problem
    half = max((right - left) / 2 for left, right in stretches)
    known = picture.within(problem, state.load, stretches, half, LOW * state.approach)
    problem = replace(problem, picture=known)
    sites = [problem.sites(corner) for corner in range(len(law.corners))]
    found[facets.numbers] += missed(facets, state.closed, law, obstacle, sites)
    known = {"approach": state.approach, "raised": -state.displacement, "psi": state.psi}
    if state.problem.counter is not None:
        known["counter"] = state.counter_displacement
    # what is off beside edges `recovery` has already
    touched = np.array([state.closed[:, own].any() for own in facets.members])
    touched = touched | np.append(touched[1:], False) | np.append(False, touched[:-1])
    for each in overlaps(facets, state.closed, law, obstacle, sites, **known):
        here = int(facets.below(np.array([(each.left + each.right) / 2]))[0])
        if not touched[here]:
            found[facets.numbers[here]] += each.worth**2
    return found


def _low(facets, state):
    """((left, right), ...) of x1 of the corners, where their gaps are low."""
    law, obstacle, found = state.law, state.solver.obstacle, []
    x = np.unique([np.linspace(left, right, LOOKED_AT) for left, right in zip(facets.left, facets.right)])
    for corner in range(len(law.corners)):
        low = facets.initial_gaps(law, obstacle, corner, x) < LOW * max(state.approach, 0.0)
        shift = state.problem.shifts[corner]
        found += [
            (float(x[max(i - 1, 0)] - shift), float(x[min(j + 1, len(x) - 1)] - shift)) for i, j in runs(low)
        ]
    return tuple(joined(found))
