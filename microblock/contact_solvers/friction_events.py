"""Events of a history of frictional contact: first and full slip, reversals, stick zones."""

from itertools import groupby, pairwise

import numpy as np

from ..model.events import Event
from ..model.history import SLIDING
from ..model.intervals import runs


def legs(pairs, friction):
    """Yields pairs (P, Q) at the ends of a leg, whether shear turns at the first, and full slip begins at the
    second.
    """
    direction = 0.0
    for before, after in pairwise(np.vstack(((0.0, 0.0), pairs))):
        change = after[1] - before[1]
        limits = [abs(Q) >= friction * P * (1 - SLIDING) for P, Q in (before, after)]
        goes_on = limits[0] and before[0] and before[1] * after[1] > 0
        yield before, after, change * direction < 0, bool(limits[1] and not goes_on)
        direction = change or direction


def events(changes, friction, edges, pairs):
    """Returns the events on cells with edges, array (n, 2), in order, from changes of contact."""
    nodes = [one for one in changes if one.kind in ("stick", "slip", "leave")]
    x, found, zones = edges.mean(axis=1), [], []
    # where corners have tangential forces of their own, each counts
    corners = 1 + max((one.index for one in nodes), default=0) // len(x)
    sticks, slips = np.zeros((2, corners, len(x)), bool)
    stick = slip = sticks[0]

    for leg, (before, after, turns, slides) in enumerate(legs(pairs, friction)):

        def note(share, kind, zone, where):
            P, Q = before + share * (after - before)
            found.append(Event(P, None, kind, zone, x[where].mean(), Q, leg))

        if turns and slip.any():
            note(0.0, "reversal", "slip", slip)
        own = [one for one in nodes if one.leg == leg]
        for share, group in groupby(own, key=lambda one: round(one.share, 9)):
            for one in group:
                place = divmod(one.index, len(x))
                sticks[place], slips[place] = one.kind == "stick", one.kind == "slip"
            stick = sticks.any(axis=0)
            slip = slips.any(axis=0) & ~stick
            if slip.any() and all(event.kind != "first slip" for event in found):
                note(share, "first slip", "slip", np.argmax(slip))
            # new zones are wide ones
            parts = [
                (i, j)
                for i, j in runs(stick)
                if _meets((i, j), zones)
                or (j - i > 4 and np.ptp(edges[i : j + 1]) >= 0.05 * np.ptp(edges[stick | slip]))
            ]
            for kind, several, others in (("vanished", zones, parts), ("born", parts, zones)):
                for i, j in several:
                    if not _meets((i, j), others):
                        note(share, kind, "stick", slice(i, j + 1))
            zones = parts
        if slides:
            note(1.0, "full slip", "slip", stick if stick.any() else slip)
            zones = []
    return found


def _meets(part, others):
    """Whether a stretch (first, last) of cells has one in common with some others."""
    return any(part[0] <= last and first <= part[1] for first, last in others)
