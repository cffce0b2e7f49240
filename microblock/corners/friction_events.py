"""Events of a history of frictional contact: first and full slip, reversals, stick zones."""

from itertools import groupby, pairwise

import numpy as np

from ..model.events import Event
from ..model.history import SLIDING
from ..model.zones import runs


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
    """Returns the events on cells with edges, array (n, 2), in order, of the changes of a Follower."""
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
            parts = list(_parts(stick, stick | slip, edges, zones))
            vanished = [zone for zone in zones if not (zone & stick).any()]
            born = [part for part in parts if not any((part & zone).any() for zone in zones)]
            for kind, several in (("vanished", vanished), ("born", born)):
                for where in several:
                    note(share, kind, "stick", where)
            zones = parts
        if slides:
            note(1.0, "full slip", "slip", stick if stick.any() else slip)
            zones = []
    return found


def _parts(stick, touching, edges, zones):
    """Yields flags of the stretches that stick, if they are wide or belong to one of the zones."""
    for first, last in runs(stick):
        part = np.zeros(len(stick), bool)
        part[first : last + 1] = True
        wide = last - first > 4 and np.ptp(edges[part]) >= 0.05 * np.ptp(edges[touching])
        if wide or any((part & zone).any() for zone in zones):
            yield part
