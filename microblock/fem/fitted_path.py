"""The load path of a block: events from two meshes, states on fitted ones."""

from dataclasses import replace
from functools import cached_property

from ..corners.nodal import NodalPath
from ..halfplane.kernels import coalescence_exponent
from ..model.events import SeenTwice, following


class FittedPath(SeenTwice):
    """The load path of a block.

    Events are those of two meshes of equal elements. Where zones meet on the axis the load, off by h^(2 s)
    (docs/theory/halfplane.md), is extrapolated.
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

    @cached_property
    @following
    def _seen(self):
        solvers = (self.problem.solver.evenly(self.last, count) for count in (16, 32))
        return [self.numbered(NodalPath(self.problem, self.last, None, own).events) for own in solvers]
