"""The load path of a block: events from two meshes, states on fitted ones."""

from dataclasses import replace
from functools import cached_property

from ..corners.nodal import NodalPath
from ..halfplane.kernels import coalescence_exponent
from ..model.events import LoadPath, following


class FittedPath(LoadPath):
    """The load path of a block.

    Events are those of two meshes of equal elements. Where zones meet on the axis the load, off by h^(2 s)
    (docs/theory/halfplane.md), is extrapolated; `warnings` name events that one mesh alone sees.
    """

    @cached_property
    def events(self):
        """Zones that are born, merge, split or vanish, ascending in load."""
        (coarse, fine), found = self._seen, []
        slowest = 2 ** (2 * coalescence_exponent(self.problem.solid)) - 1
        for key in filter(coarse.__contains__, fine):  # in their order, which a set has not
            event, missing = fine[key], (fine[key].load - coarse[key].load) / slowest
            load = event.load + missing * (self.problem.solver.symmetric and event.x == 0 < event.load)
            found.append(replace(event, load=load, load_error=abs(missing)))
        return sorted(found, key=lambda event: event.load)

    @property
    def warnings(self):
        coarse, fine = self._seen
        alone = [event for key, event in (coarse | fine).items() if key not in coarse or key not in fine]
        return [
            f"one of two meshes alone sees {event.zone} {event.kind}, at about load {event.load:.3g}: it is "
            "left out; look at states around it"
            for event in sorted(alone, key=lambda event: event.load)
        ]

    @cached_property
    @following
    def _seen(self):
        """[{(kind, zone, how many before): Event}] on two meshes."""
        found = {16: {}, 32: {}}
        for count, seen in found.items():
            followed = self.problem.solver.evenly(self.last, count)
            for event in NodalPath(self.problem, self.last, None, followed).events:
                number = sum(key[:2] == (event.kind, event.zone) for key in seen)
                seen[event.kind, event.zone, number] = event
        return list(found.values())
