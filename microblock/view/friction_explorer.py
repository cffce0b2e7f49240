"""A contact with friction that is led on load by load, with the loop that it walks."""

import time
from dataclasses import dataclass

from ..contact import Contact
from ..errors import BadArgument, require_finite, require_kind, require_positive
from ..halfplane.friction_solver import FrictionSolver
from ..halfplane.kernels import HalfPlane
from ..model.history import pairs_of
from ..model.state import State
from ..model.summary import Row, Shown, Summary, number
from ..threads import bounded
from .friction_figure import FrictionFigure, slip_and_shear

ROUNDING = 1e-9  # of the end of a slider whose scale is logarithmic
SEEN = 0.5  # of f P, to either side: shear loads whose edges say where cells have to be small


@dataclass(frozen=True)
class Loads:
    """What may be changed: load (force per thickness), shear over friction times load."""

    load: float
    shear: float


class FrictionExplorer(Shown):
    """A contact with friction on a half-plane, at loads that follow each other.

    Cells stay as they are, so that each step costs what happens on its way alone: 1e-2 as a rule, without an
    estimate; `Contact.history` has one.

    Parameters
    ----------
    problem : Contact, on a half-plane without a period, under a law with friction
    load : float, the first normal force per thickness

    Attributes
    ----------
    choice : Loads, `load` P (force per thickness) and `shear` Q/(f P)
    seconds : float, what the last step took
    state : State
    loop : list of (mean slip with the pressure as weight, Q/(f P)), one for each step

    Raises
    ------
    BadArgument
        If the load is not positive, or the body is no half-plane.

    Examples
    --------
    >>> solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)
    >>> problem = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Unilateral(friction=0.3))
    >>> from microblock.view.friction_explorer import FrictionExplorer
    >>> explorer = FrictionExplorer(problem, load=1.0)
    >>> for shear in (0.5, 1.0, 0.5):
    ...     state = explorer.update(shear=shear)
    >>> len(explorer.loop), explorer.loop[3][0] > explorer.loop[1][0]      # slip that remains
    (4, True)
    """

    RANGE = 0.05, 1.0  # of the first load, the ends of its slider

    @bounded
    def __init__(self, problem, load):
        require_kind(Contact, "a Contact", problem=problem)
        require_positive(load=load)
        self.problem, self._first = problem, float(load)
        if not isinstance(problem.body, HalfPlane) or problem.body.period is not None:
            raise BadArgument(
                "body", problem.body, "must be a half-plane without a period; else take Contact.history"
            )
        if not getattr(problem.law, "friction", 0.0):
            raise BadArgument("law", problem.law, "has no friction: take Explorer")
        pairs = [(load, share * problem.law.friction * load) for share in (0.0, SEEN, -SEEN)]
        self._solver = FrictionSolver(problem.solver, pairs_of(pairs, problem.law.friction), True)
        self.figure = FrictionFigure()
        self.restart()

    @bounded
    def restart(self):
        """Goes back to the first load without shear; returns the state."""
        self._walk, self.loop = self._solver.walk(), []
        return self._step(Loads(self._first, 0.0))

    @bounded
    def update(self, load=None, shear=None):
        """Goes straight on to a normal force, or to a shear force over f P; returns the state.

        Raises
        ------
        BadArgument
            If the load is not positive or more than the first one, or the shear beyond -1 or 1.
        NotConverged
            If the answer is not unique.
        """
        load = self.choice.load if load is None else load
        shear = self.choice.shear if shear is None else shear
        require_positive(load=load)
        require_finite(shear=shear)
        if load > self._first * (1 + ROUNDING):
            raise BadArgument("load", load, f"must be at most the first one, {self._first}")
        if not abs(shear) <= 1:
            raise BadArgument("shear", shear, "must lie between -1 and 1: it is Q/(f P)")
        return self._step(Loads(min(float(load), self._first), float(shear)))

    def _step(self, choice):
        start, self.choice = time.perf_counter(), choice
        shear = choice.shear * self.problem.law.friction * choice.load
        self.state = State(self._walk.to(choice.load, shear))
        self.seconds = time.perf_counter() - start
        self.loop.append(slip_and_shear(self.state))
        self.figure.update(self.state, self.loop)
        return self.state

    def png(self):
        """The figure as a PNG, bytes."""
        return self.figure.drawing._repr_png_()

    def summary(self):
        load, shear = self.choice.load, self.choice.shear
        rows = (Row("load", "P", load), Row("shear", "Q/(fP)", shear))
        brief = f"load {number(load)}, shear {number(shear)} f P, {len(self.loop)} steps"
        return Summary("Explorer of friction", brief, rows, tuple(self.state.warnings))
