"""The load path of a block: events from two meshes, states on fitted ones."""

from dataclasses import replace
from functools import cached_property
from typing import Any

from ..contact_solvers.nodal import NodalPath
from ..halfplane.kernels import coalescence_exponent
from ..model.events import Event, SeenTwice, following


class FittedPath(SeenTwice):
    """The load path of a block.

    Events are those of two meshes of equal elements. Where zones meet on the axis the load, off by h^(2 s)
    (docs/theory/halfplane.md), is extrapolated. `load_error` is that of the finer mesh, as of a `NodalPath`,
    plus what the coarser one lets expect to be missing, for two meshes may agree by chance. It is wide, a
    fifth or a quarter of the load; states on either side of an event, at small `rtol`, tell it more closely.
    """

    def judged(self, coarse: Event, fine: Event) -> Event:
        slowest = 2 ** (2 * coalescence_exponent(self.problem.solid)) - 1
        missing = (fine.load - coarse.load) / slowest
        load = fine.load
        if self.problem.solver.symmetric and fine.x == 0 < load:
            load += missing
        return replace(fine, load=load, load_error=abs(missing) + fine.load_error)

    @cached_property
    @following
    def _seen(self) -> list[Any]:  # type: ignore[override]
        solver: Any = self.problem.solver
        contacts = (solver.evenly(self.last, count) for count in (16, 32))
        paths = (NodalPath(self.problem, self.last, None, contact) for contact in contacts)
        return [self.numbered(path.events) for path in paths]
