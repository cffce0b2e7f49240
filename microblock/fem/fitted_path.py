"""The load path of a block: events from two meshes, states on fitted ones."""

from dataclasses import replace
from functools import cached_property

from ..contact_solvers.nodal import NodalPath
from ..halfplane.kernels import coalescence_exponent
from ..model.events import SeenTwice, following
from ..model.refinement import GeometricSeries


class FittedPath(SeenTwice):
    """The load path of a block.

    Events are those of two meshes of equal elements. Where zones meet on the axis the load, off by h^(2 s)
    (docs/theory/halfplane.md), is extrapolated.
    """

    def judged(self, coarse, fine):
        series = GeometricSeries(2 ** (2 * coalescence_exponent(self.problem.solid)))
        missing = series.error([fine.load - coarse.load])
        load = fine.load + missing * (self.problem.solver.symmetric and fine.x == 0 < fine.load)
        return replace(fine, load=load, load_error=abs(missing))

    @cached_property
    @following
    def _seen(self):
        solvers = (self.problem.solver.evenly(self.last, count) for count in (16, 32))
        return [self.numbered(NodalPath(self.problem, self.last, None, own).events) for own in solvers]
