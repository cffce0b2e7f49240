"""A contact with friction that is led on load by load, with the loop that it walks."""

from ..contact import Contact
from ..errors import BadArgument, require_finite, require_kind, require_positive
from ..halfplane.friction_solver import FrictionSolver
from ..halfplane.kernels import HalfPlane
from ..model.history import pairs_of
from ..model.state import State
from ..model.summary import Row, Shown, Summary, number
from ..threads import bounded
from .friction_figure import FrictionFigure, slip_and_shear

SEEN = 0.5  # of f P, to either side: shear loads whose edges say where cells have to be small


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
    load, shear : float, P (force per thickness) and Q/(f P)
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
        self.load, self.shear = self._first, 0.0
        return self._step()

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
        load, shear = self.load if load is None else load, self.shear if shear is None else shear
        require_positive(load=load)
        require_finite(shear=shear)
        if load > self._first:
            raise BadArgument("load", load, f"must be at most the first one, {self._first}")
        if not abs(shear) <= 1:
            raise BadArgument("shear", shear, "must lie between -1 and 1: it is Q/(f P)")
        self.load, self.shear = float(load), float(shear)
        return self._step()

    def _step(self):
        friction = self.problem.law.friction
        self.state = State(self._walk.to(self.load, self.shear * friction * self.load))
        self.loop.append(slip_and_shear(self.state))
        self.figure.update(self.state, self.loop)
        return self.state

    def png(self):
        """The figure as a PNG, bytes."""
        return self.figure.drawing._repr_png_()

    def summary(self):
        rows = (Row("load", "P", self.load), Row("shear", "Q/(fP)", self.shear))
        brief = f"load {number(self.load)}, shear {number(self.shear)} f P, {len(self.loop)} steps"
        return Summary("Explorer of friction", brief, rows, tuple(self.state.warnings))
