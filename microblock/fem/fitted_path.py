"""The load path of a block: events from two meshes, states on fitted ones."""

from functools import cached_property
from itertools import groupby

import numpy as np

from ..corners import active_set
from ..corners.nodal import zones_of
from ..halfplane.kernels import coalescence_exponent
from ..model.events import Event, LoadPath
from ..model.zones import zone_changes
from ..threads import bounded


class FittedPath(LoadPath):
    """The load path of a block.

    Events are those of two meshes of equal elements. Where zones meet on the axis the load, off by h^(2 s)
    (docs/theory/halfplane.md), is extrapolated; `warnings` name events that one mesh alone sees.
    """

    @cached_property
    @bounded
    def events(self):
        """Zones that are born, merge, split or vanish, ascending in load."""
        solver, (coarse, fine) = self.problem.solver, self._seen
        slowest, found = 2 ** (2 * coalescence_exponent(self.problem.solid)) - 1, []
        for (kind, zone, number), (load, x) in fine.items():
            if (kind, zone, number) in coarse:
                correction = (load - coarse[kind, zone, number][0]) / slowest
                load += correction if solver.symmetric and x == 0 and load > 0 else 0.0
                found.append(Event(load, abs(correction), kind, zone, x))
        return sorted(found, key=lambda event: event.load)

    @cached_property
    @bounded
    def _seen(self):
        return [self._on_mesh(self.problem.solver, count) for count in (16, 32)]

    @property
    def warnings(self):
        coarse, fine = self._seen
        seen = coarse | fine
        return [
            f"one of two meshes alone sees {zone} {kind}, at about load {seen[kind, zone, count][0]:.3g}: it "
            "is left out; look at states around it"
            for kind, zone, count in sorted(coarse.keys() ^ fine.keys(), key=lambda key: seen[key])
        ]

    def _on_mesh(self, solver, count):
        """{(kind, zone, how many before): (load, x)} on a mesh."""
        law, body = solver.law, solver.evenly(self.last, 4, count)
        flexibility, gaps, share = body.compliance.corner_system(law, solver.obstacle)
        history = active_set.path(flexibility, gaps, [solver.share(self.last)], c=share).events
        closed, before, found = np.zeros((len(law.corners), len(body.weights)), bool), None, {}
        for load, changes in groupby(history, key=lambda event: event.load):
            for change in changes:
                closed.ravel()[change.corner] = change.kind == "closes"
            after = _zones(solver, body.points[:, 0], closed)
            for zone, intervals in after.items():
                for kind, x in zone_changes(before[zone] if before else [], intervals):
                    number = sum(key[:2] == (kind, zone) for key in found)
                    found[kind, zone, number] = (float(load * (2 if solver.symmetric else 1)), float(x))
            before = after
        return found


def _zones(solver, x, closed):
    """{name: intervals} of the whole line; a node stands for half the way to its neighbours."""
    if solver.symmetric:
        closed = closed.copy()
        closed[:, 0] = closed[:, 0].any()  # one multiplier on the axis
        closed = np.column_stack((closed[::-1, :0:-1], closed))
        x = np.concatenate((-x[:0:-1], x))
    return zones_of(x, closed, solver.law)
