"""Which zones there are: seen first on a coarse uniform grid, then mended where a fitted state shows them wrong."""

from functools import partial

import numpy as np

from . import active_set
from .errors import NotConverged
from .line_state import violations
from .observables import runs
from .obstacles import SCALES, returned
from .panels import half_line, zone_edges

CELLS = (80, 160)     # of the coarse grid; finer while no zones fit
MEETING = 0.1         # of the width: opposite edges of the two corners this near to each other may be joined or apart
APART, OVERLAP = 0.3, 0.15      # of the way between such edges, where the other way round is tried
MARGIN = 1.3          # of the coarse grid around the contact
SNAP = 1.5            # cells within which an edge is taken for an end of the obstacle, to begin with
LOOKED_AT, ZOOMS = 64, 6      # places where a gap is looked at, and how often nearer next to its least
UNSEEN = 1e-3         # of what `tolerated` allows next to edges: overlap off them that is not the panels' own error
RIM = 0.15            # of ell, from an end of the obstacle for one corner to the edge of the zone in which the other stands alone
                      # beyond it: 0.09 to 0.16 under flat punches of half-widths from 1.7 ell on
NEXT_TO = 0.5, 0.05   # of ell, from such an end, where an edge is put there: of cells, which see no more, and of mended zones
PARTIAL = 2.4         # width of a partial zone over ell as ell -> 0 (2.39 at nu = 0.3, beta = 1): a first guess


def coarse(line, body, load, cells):
    """Zones {corner number: ((left, right), ...)} of a body's line at a load, as so many equal cells see them."""
    centre = 0.0 if line.mirror else _lowest(line)
    reach = _reach(line, load, centre)
    for _ in range(12):
        around = np.linspace(-reach, reach, cells + 1 - cells % 2)
        closed = _closed(line, body, load, centre + around)
        outer = np.abs(around[closed.any(axis=0)]).max(initial=0.0)
        if outer > 0.95*reach or outer == 0:
            reach *= 1.6
        elif MARGIN*1.5*outer < reach and outer > 3*(around[1] - around[0]):
            reach = MARGIN*outer
        else:
            break
    return _set_apart(line, _intervals(line, centre + around, closed), around[1] - around[0])


def _lowest(line):
    """Where the obstacle is lowest among its ends, its kinks and places around x = 0 at all scales of ell."""
    scales = line.solid.ell*SCALES
    places = np.concatenate(([0.0], scales, -scales, getattr(line.obstacle, "ends", ()), getattr(line.obstacle, "kinks", ())))
    return float(places[np.argmin(_height(line)(places))])


def _height(line):
    return partial(returned, line.obstacle)


def _closed(line, body, load, x):
    """Whether the corners of each cell are closed: array (corners, n)."""
    compliance = body.compliance(x, clamped=line.law.clamps_rotation)
    flexibility, gaps, share = compliance.corner_system(line.law, line.obstacle)
    if not line.mirror or half_line(line):
        return active_set.solve(flexibility, gaps, load=load, c=share).closed.reshape(len(line.law.corners), -1)
    n = len(x)      # corner B mirrors A
    folded = flexibility[:n, :n] + flexibility[:n, n:][:, ::-1]
    closed = active_set.solve(folded, gaps[:n], load=load/2, c=share[:n]).closed
    return np.array((closed, closed[::-1]))


def _intervals(line, x, closed):
    """{corner: intervals} of the closed cells; next to an end of the obstacle they reach to it."""
    width, zones = x[1] - x[0], {}
    for corner in line.corners:
        first, last = line.ends.get(corner, (-np.inf, np.inf))
        zones[corner] = tuple((_snap(x[i] - width/2, first, width), _snap(x[j] + width/2, last, width))
                              for i, j in runs(closed[corner]))
    return zones


def _snap(edge, end, width):
    return float(end if abs(end - edge) < SNAP*width else edge)


def _set_apart(line, zones, width):
    """Outer edges of the two corners that fall on one cell are moved a partial zone's width apart; ends of the obstacle stay."""
    if len(line.law.corners) == 1:      # exactly symmetric where the scene is
        return {0: ((-zones[0][-1][1], zones[0][-1][1]),)} if line.mirror else zones
    if not all(zones.values()):
        return zones
    apart = PARTIAL*line.solid.ell
    narrow = apart < 3*width
    a, free_left = list(map(list, zones[0])), zones[0][0][0] not in line.ends.get(0, ())
    if line.mirror:
        if narrow and free_left and len(a) == 1 and abs(a[0][0] + a[0][1]) < 1.5*width:
            a[0][0] = apart - a[0][1]
        return {0: tuple(map(tuple, a))}
    b = list(map(list, zones[1]))
    if narrow and free_left and abs(a[0][0] - b[0][0]) < 1.5*width:
        a[0][0] = b[0][0] + apart
    if narrow and b[-1][1] not in line.ends.get(1, ()) and abs(a[-1][1] - b[-1][1]) < 1.5*width:
        b[-1][1] = a[-1][1] - apart
    for first, second in ((a, b), (b, a)):      # two edges on one cell overlap a little, to begin with
        for one in first:
            for other in second:
                if abs(one[0] - other[1]) < width/4:
                    one[0], other[1] = one[0] - width/4, other[1] + width/4
    return {0: tuple(map(tuple, a)), 1: tuple(map(tuple, b))}


def variants(line, zones):
    """These zones, and where opposite edges of two corners nearly meet also the same taken apart, or joined."""
    found = [zones]
    if len(line.law.corners) == 1:
        return found
    rims = _beyond_ends(line, zones, NEXT_TO[0])
    found += [rims] if rims != zones else []
    a, b = zones[0], [(-right, -left) for left, right in zones[0]] if line.mirror else zones[1]
    for i, one in enumerate(a):
        for j, other in enumerate(b):
            # A's left edge with B's right one, and the other way round
            for side in (0, 1):
                gap, size = one[side] - other[1 - side], max(one[1], other[1]) - min(one[0], other[0])
                if 0 < abs(gap) < MEETING*size:
                    middle = (one[side] + other[1 - side])/2
                    half = -gap*(APART if gap*(1 - 2*side) < 0 else OVERLAP)
                    new = {0: _moved(a, i, side, middle + half)}
                    if not line.mirror:
                        new[1] = _moved(b, j, 1 - side, middle - half)
                    found.append(new)
    return found


def _beyond_ends(line, zones, near):
    """Zones with edges next to an end for the other corner put beyond it: its pressure has no bound there and draws them."""
    found = {}
    for corner, intervals in zones.items():
        left, right = _ends_of_other(line, corner)

        def put(edge, end, step):      # those that lie short of it, or at it
            return float(end + step) if 0 <= (end - edge)*np.sign(step) < near*line.solid.ell else edge

        step = RIM*line.solid.ell
        moved = [(put(a, right, step), put(b, left, -step)) for a, b in intervals]
        found[corner] = tuple(each if each[0] < each[1] else old for each, old in zip(moved, intervals))
    return found


def _ends_of_other(line, corner):
    """Ends of the obstacle for the other corner; infinite if there are none."""
    if line.mirror:
        left, right = line.ends.get(corner, (-np.inf, np.inf))
        return -right, -left
    return line.ends.get(1 - corner, (-np.inf, np.inf))


def _moved(intervals, number, side, edge):
    intervals = list(map(list, intervals))
    intervals[number][side] = edge
    return tuple(map(tuple, intervals))


def tolerated(order):
    """Violation of (26) that panels of an order may leave: about ten times their usual error."""
    return 10**(-(order + 6)/4)


def mended(state):
    """Zones without what is pulled and with what is pressed in on a fitted state; None where nothing is.

    Raises
    ------
    NotConverged
        If nothing would be left, or a symmetric zone would have to open in the middle.
    """
    zones, changed = {}, False
    for corner, (x, wrong) in violations(state).items():
        intervals = list(state.zones[corner])
        edges = np.array(intervals).ravel()
        for first, last in runs(wrong > tolerated(state.panels.order)):
            left = (x[first - 1] + x[first])/2 if first else x[first]
            right = (x[last] + x[last + 1])/2 if last + 1 < len(x) else x[last]
            intervals = _toggled(intervals, left, right, inside=bool(np.searchsorted(edges, (left + right)/2) % 2))
            changed = True
        zones[corner] = tuple(intervals)
    if not changed:
        return None
    if half_line(state.line) or not any(zones.values()):
        raise NotConverged(f"corners would be pressed in, or pulled, on these zones at load {state.load:g}")
    return zones if len(zones) == 1 and not state.line.mirror else _beyond_ends(state.line, zones, NEXT_TO[1])


def newborn(state):
    """Zones with one more where a gap closes between the places that `violations` looks at; None where none does.

    That is narrow against its distance from all edges: next to the load at which a corner begins to touch.
    """
    line, edges = state.line, np.array(zone_edges(state.all_zones))
    if half_line(line):
        return None
    beyond = (edges[-1] - edges[0])/2 + line.solid.ell
    looked = np.linspace(edges[0] - beyond, edges[-1] + beyond, LOOKED_AT)
    heights = line.initial_gap(np.zeros(LOOKED_AT, int), looked)
    overlap = UNSEEN*tolerated(state.panels.order)*np.ptp(heights[np.isfinite(heights)])
    born = {corner: _closing(state, corner, looked, overlap, _elsewhere_inf(looked, *found))
            for corner, found in state.gaps_off_zones(looked).items()}
    return {corner: sorted([*state.zones[corner], *born[corner]]) for corner in born} if any(born.values()) else None


def _closing(state, corner, looked, overlap, gaps):
    """Intervals, about, where a corner's gap is below -overlap next to a local minimum that lies off its zones."""
    found = []
    lower = (gaps[1:-1] < gaps[:-2]) & (gaps[1:-1] <= gaps[2:]) & np.isfinite(gaps[:-2] + gaps[2:])
    for i in 1 + np.flatnonzero(lower):
        left, right = looked[i - 1], looked[i + 1]
        for _ in range(ZOOMS):
            x = np.linspace(left, right, 9)
            values = _elsewhere_inf(x, *state.gaps_off_zones(x)[corner])
            least = int(np.clip(np.argmin(values), 1, 7))
            left, right = x[least - 1], x[least + 1]
            if values.min() < -overlap:
                step, closed = (x[1] - x[0])/4, x[values < 0]
                found.append((float(closed[0] - step), float(closed[-1] + step)))
                break
    return found


def _elsewhere_inf(x, places, values):
    """Values at x from those at some of them, inf at the others."""
    found = np.full(len(x), np.inf)
    found[np.isin(x, places)] = values
    return found


def _toggled(intervals, left, right, inside):
    """Intervals with (left, right) taken out, or put in."""
    if not inside:
        touching = [each for each in intervals if each[0] <= right and left <= each[1]]
        apart = [each for each in intervals if each not in touching]
        joined = (min([left, *(each[0] for each in touching)]), max([right, *(each[1] for each in touching)]))
        return sorted([*apart, joined])
    pieces = [piece for a, b in intervals for piece in ((a, min(b, left)), (max(a, right), b))]
    return sorted({(a, b) for a, b in pieces if a < b})


def surroundings(line, load):
    """(left, right), twice as far as a first coarse grid reaches."""
    centre = _lowest(line)
    reach = 2*_reach(line, load, centre)
    return centre - reach, centre + reach


def _reach(line, load, centre):
    """Half-width of a first coarse grid: where a classical contact would carry the load, and a block more."""
    return 1.5*_classical(line, load, centre) + line.solid.ell


def classical(line, load):
    """The one zone of a symmetric scene without corners, with the half-width of a classical contact."""
    half = _classical(line, load, 0.0)
    return {0: ((-half, half),)}


def _classical(line, load, centre):
    """Half-width over which the obstacle rises by what the load sinks a classical half-plane under a parabola."""
    half = line.solid.ell*np.geomspace(1e-9, 1e9, 721)
    heights = _height(line)(centre + np.outer((-1.0, 0.0, 1.0), half).ravel()).reshape(3, -1)
    rise = np.ptp(np.minimum(heights, 1e300), axis=0)
    enough = np.flatnonzero(np.pi/2*line.solid.E_star*rise >= load)
    if not len(enough):
        raise NotConverged(f"the obstacle does not rise enough to carry the load {load:g}")
    n = enough[0]
    return float(np.interp(load, np.pi/2*line.solid.E_star*rise[n - 1:n + 1], half[n - 1:n + 1]) if n else half[0])
