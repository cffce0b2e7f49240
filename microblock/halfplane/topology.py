"""Which zones there are: seen first on a coarse uniform grid, then mended where a fitted state shows them
wrong.
"""

import numpy as np

from ..corners import active_set
from ..errors import NotConverged
from ..model import picture
from ..model.problem import half_line
from ..model.zones import joined, runs, without, zone_edges
from .counter import counter_flexibility

CELLS = (80, 160)  # of the coarse grid; finer while no zones fit
# of the width: opposite edges of the two corners this near to each other may be joined or apart
MEETING = 0.1
APART, OVERLAP = 0.3, 0.15  # of the way between such edges, where the other way round is tried
# of the way to the next edge: half the distance at which two edges that have met are put on the other side
CROSSED = 0.1
MARGIN = 1.3  # of the coarse grid around the contact
FARTHEST_OUT = 1.2  # cells from the middle of the last closed cell to the edge: 0.5 to 1 are met
SNAP = 1.5  # cells within which an edge is taken for an end of the obstacle, to begin with
# of what `tolerated` allows next to edges: overlap apart from them is not the panels' own error
UNSEEN = 1e-3
BESIDE = 0.05  # of its width: an overlap this near to a zone belongs to it
# of ell, from an end of the obstacle for one corner to the edge of the zone in which the other stands alone
# beyond it: 0.09 to 0.16 under flat punches of half-widths from 1.7 ell on
RIM = 0.15
# of ell, from such an end, where an edge is put there: of cells, which see no more, and of mended zones
NEXT_TO = 0.5, 0.05
# width of a partial zone over ell as ell -> 0 (2.39 at nu = 0.3, beta = 1): a first guess
PARTIAL = 2.4


def coarse(problem, body, load, cells):
    """Zones {corner number: ((left, right), ...)} at a load, as so many equal cells around the lowest point
    see them.
    """
    centre = 0.0 if problem.mirror else problem.picture.lowest
    half = classical(problem, load)[0][0][1]
    reach = 1.5 * half + problem.solid.ell
    for _ in range(12):
        around = np.linspace(-reach, reach, cells + 1 - cells % 2)
        forces = _forces(problem, body, load, centre + around, np.abs(around) <= half)
        outer = np.abs(around[(forces > 0).any(axis=0)]).max(initial=0.0)
        if outer > 0.95 * reach or outer == 0:
            reach *= 1.6
        elif MARGIN * 1.5 * outer < reach and outer > 3 * (around[1] - around[0]):
            reach = MARGIN * outer
        else:
            break
    return set_apart(problem, _intervals(problem, centre + around, forces), around[1] - around[0])


def _forces(problem, body, load, x, guess):
    """Forces on the corners of each cell: array (corners, n). Those of the guessed cells (boolean array (n,))
    are closed to begin with.
    """
    compliance = body.compliance(x, clamped=problem.law.clamps_rotation)
    flexibility, gaps, share = compliance.corner_system(problem.law, problem.obstacle)
    if problem.counter is not None:
        flexibility = flexibility + counter_flexibility(problem, x, x[1] - x[0])
    if not problem.mirror or half_line(problem):
        start = np.tile(guess, len(problem.law.corners))
        forces = _pressed(active_set.solve(flexibility, gaps, load=load, c=share, start=start))
        return forces.reshape(len(problem.law.corners), -1)
    n = len(x)  # corner B mirrors A
    folded = flexibility[:n, :n] + flexibility[:n, n:][:, ::-1]
    forces = _pressed(active_set.solve(folded, gaps[:n], load=load / 2, c=share[:n], start=guess))
    return np.array((forces, forces[::-1]))


def _pressed(state):
    """Forces of a ContactState, above 0 wherever it is closed."""
    return np.where(state.closed, np.maximum(state.forces, np.finfo(float).tiny), 0.0)


def _intervals(problem, x, forces):
    """{corner: intervals} of the cells with a force; next to an end of the obstacle they reach to it."""
    width, zones = x[1] - x[0], {}
    for corner in problem.corners:
        first, last = problem.ends.get(corner, (-np.inf, np.inf))
        own = forces[corner]
        zones[corner] = tuple(
            (
                _snap(x[i] - width * _beyond_middle(own[i : j + 1]), first, width),
                _snap(x[j] + width * _beyond_middle(own[i : j + 1][::-1]), last, width),
            )
            for i, j in runs(own > 0)
        )
    return zones


def _beyond_middle(forces):
    """How far an edge lies beyond the middle of its cell, over a cell, from forces inwards: their squares
    grow evenly.
    """
    if len(forces) < 2 or forces[0] >= forces[1]:
        return 0.5
    return min(forces[0] ** 2 / (forces[1] ** 2 - forces[0] ** 2), FARTHEST_OUT)


def _snap(edge, end, width):
    return float(end if abs(end - edge) < SNAP * width else edge)


def set_apart(problem, zones, width):
    """Outer edges of the two corners that fall on one cell are moved a partial zone's width apart; ends of
    the obstacle stay.
    """
    if len(problem.law.corners) == 1:  # exactly symmetric where the problem is
        return {0: ((-zones[0][-1][1], zones[0][-1][1]),)} if problem.mirror else zones
    if not all(zones.values()):
        return zones
    apart = PARTIAL * problem.solid.ell
    narrow = apart < 3 * width
    a, free_left = list(map(list, zones[0])), zones[0][0][0] not in problem.ends.get(0, ())
    if problem.mirror:
        if narrow and free_left and len(a) == 1 and abs(a[0][0] + a[0][1]) < 1.5 * width:
            a[0][0] = apart - a[0][1]
        return {0: tuple(map(tuple, a))}
    b = list(map(list, zones[1]))
    if narrow and free_left and abs(a[0][0] - b[0][0]) < 1.5 * width:
        a[0][0] = b[0][0] + apart
    if narrow and b[-1][1] not in problem.ends.get(1, ()) and abs(a[-1][1] - b[-1][1]) < 1.5 * width:
        b[-1][1] = a[-1][1] - apart
    for first, second in ((a, b), (b, a)):  # two edges on one cell overlap a little, to begin with
        for one in first:
            for other in second:
                if abs(one[0] - other[1]) < width / 4:
                    one[0], other[1] = one[0] - width / 4, other[1] + width / 4
    return {0: tuple(map(tuple, a)), 1: tuple(map(tuple, b))}


def variants(problem, zones, near=np.inf):
    """These zones, and where opposite edges of two corners nearly meet (within `near`) also the same taken
    apart, or joined.
    """
    found = [zones]
    if len(problem.law.corners) == 1:
        return found
    rims = _beyond_ends(problem, zones, NEXT_TO[0])
    found += [rims] if rims != zones else []
    a, b = zones[0], [(-right, -left) for left, right in zones[0]] if problem.mirror else zones[1]
    for i, one in enumerate(a):
        for j, other in enumerate(b):
            # A's left edge with B's right one, and the other way round
            for side in (0, 1):
                gap, size = one[side] - other[1 - side], max(one[1], other[1]) - min(one[0], other[0])
                if 0 < abs(gap) < min(MEETING * size, near):
                    middle = (one[side] + other[1 - side]) / 2
                    half = -gap * (APART if gap * (1 - 2 * side) < 0 else OVERLAP)
                    new = {0: _moved(a, i, side, middle + half)}
                    if not problem.mirror:
                        new[1] = _moved(b, j, 1 - side, middle - half)
                    found.append(new)
    return found


def alike(zones, others, tolerance):
    """Whether two sets of zones have as many intervals, and edges that differ by no more than a tolerance
    times their width.
    """
    if any(len(own) != len(others[corner]) for corner, own in zones.items()):
        return False
    first, second = (np.concatenate([np.ravel(own) for own in each.values()]) for each in (zones, others))
    return bool(np.abs(first - second).max() <= tolerance * np.ptp(first))


def healed(zones, tolerance):
    """Zones with those of one corner joined that are apart by less than a tolerance times the width of all:
    a single panel in tension may open such a gap, and nothing closes it.
    """
    least = tolerance * np.ptp(zone_edges(zones))
    return {corner: tuple(joined(intervals, least)) for corner, intervals in zones.items()}


def crossed(problem, zones, edges):
    """Zones with two neighbouring edges that have met exchanged: apart by a share of the way to the next
    edge, on the other side; without the zone whose two edges they are.

    Returns None where they are edges of two zones of one corner, or nothing would be left.
    """
    (left, right), middle = edges, sum(edges) / 2
    gone = (edges, (-right, -left)) if problem.mirror else (edges,)
    rest = {corner: tuple(pair for pair in pairs if pair not in gone) for corner, pairs in zones.items()}
    if rest != zones and any(rest.values()):
        return rest
    own = {
        (corner, float(edge)): side
        for corner, intervals in zones.items()
        for pair in intervals
        for edge, side in zip(pair, (0, 1))
    }
    if problem.mirror:
        own |= {(1 - corner, -edge): 1 - side for (corner, edge), side in own.items()}
    first, second = ([key for key in own if key[1] == edge] for edge in edges)
    if not first or not second or first[0][0] == second[0][0] or own[first[0]] == own[second[0]]:
        return None
    others = [edge for _, edge in own if edge not in edges]
    half = CROSSED * min([abs(edge - middle) for edge in others], default=right - left)
    places = {first[0]: middle + half, second[0]: middle - half}
    if problem.mirror:
        places |= {(1 - corner, -edge): -place for (corner, edge), place in list(places.items())}
    return {
        corner: tuple(tuple(places.get((corner, float(edge)), edge) for edge in pair) for pair in intervals)
        for corner, intervals in zones.items()
    }


def _beyond_ends(problem, zones, near):
    """Zones with edges next to an end for the other corner put beyond it: its pressure has no bound there
    and draws them.
    """
    found = {}
    for corner, intervals in zones.items():
        left, right = _ends_of_other(problem, corner)

        def put(edge, end, step):  # those that lie short of it, or at it
            return float(end + step) if 0 <= (end - edge) * np.sign(step) < near * problem.solid.ell else edge

        step = RIM * problem.solid.ell
        moved = [(put(a, right, step), put(b, left, -step)) for a, b in intervals]
        found[corner] = tuple(each if each[0] < each[1] else old for each, old in zip(moved, intervals))
    return found


def _ends_of_other(problem, corner):
    """Ends of the obstacle for the other corner; infinite if there are none."""
    if problem.mirror:
        left, right = problem.ends.get(corner, (-np.inf, np.inf))
        return -right, -left
    return problem.ends.get(1 - corner, (-np.inf, np.inf))


def _moved(intervals, number, side, edge):
    intervals = list(map(list, intervals))
    intervals[number][side] = edge
    return tuple(map(tuple, intervals))


def tolerated(order):
    """Violation of (26) that panels of an order may leave: about ten times their usual error."""
    return 10 ** (-(order + 6) / 4)


def amended(state, found, tolerance):
    """Zones without what is in tension and with what overlaps on a fitted state with this Survey; None if
    nothing does.

    Violations next to edges that are worth less than `tolerance`, or than what panels of this order leave,
    stay: the estimate has them.

    Raises
    ------
    NotConverged
        If nothing would be left, or a symmetric zone would have to open in the middle.
    """
    own = tolerated(state.panels.order)
    edges = np.array(zone_edges(state.all_zones))

    def apart(each):
        return each.depth > 0 and np.abs(edges - (each.left + each.right) / 2).min() > each.right - each.left

    zones = {corner: list(own) for corner, own in state.zones.items()}
    wrong = [
        each
        for each in found.violations
        if each.worth > (UNSEEN * own if apart(each) else max(tolerance, own))
    ]
    for each in wrong:
        left, right = each.left, each.right
        if each.depth:
            slack = BESIDE * (right - left)
            beside = [
                edge for own in zones[each.corner] for edge in own if left - slack < edge < right + slack
            ]
            left, right = min([left, *beside]), max([right, *beside])
        zones[each.corner] = (
            joined([*zones[each.corner], (left, right)])
            if each.depth
            else sorted(set(without(zones[each.corner], left, right)))
        )
    if not wrong:
        return None
    if half_line(state.problem) or not any(zones.values()):
        raise NotConverged(
            f"corners would overlap the obstacle, or be in tension, on these zones at load {state.load:g}"
        )
    zones = {corner: tuple(own) for corner, own in zones.items()}
    return (
        zones
        if len(zones) == 1 and not state.problem.mirror
        else _beyond_ends(state.problem, zones, NEXT_TO[1])
    )


def classical(problem, load):
    """The one zone of a symmetric problem without corners, with the half-width of a classical contact."""
    half = picture.classical(problem, load, problem.picture.lowest)[0]
    return {0: ((-half, half),)}
