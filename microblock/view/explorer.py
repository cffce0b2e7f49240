"""Problem, state and figure for parameters that change one by one: what sliders need, and scripts as well.

A state starts from the last one, its zones moved on as the last two moved under the same parameter.
"""

import math
import time
from dataclasses import asdict, dataclass, replace

from ..contact import Contact
from ..errors import (
    BadArgument,
    require_choice,
    require_finite,
    require_kind,
    require_positive,
    require_tolerance,
)
from ..model.law import Microblock, Microclamped, Unilateral
from ..model.obstacles import Cylinder
from ..model.picture import classical
from ..model.problem import Problem
from ..model.state import State
from ..model.summary import Row, Shown, Summary, number
from ..threads import bounded
from .frames import Frames
from .state_figure import SCREEN, StateFigure

LAWS = {"microblock": Microblock, "unilateral": Unilateral, "microclamped": Microclamped}


@dataclass(frozen=True)
class Choice:
    """What may be changed: load (force per thickness), psi0 (radians), radius (length), alpha = ell/a_ref,
    law (by name).

    psi0 and radius are None where the problem has none, or none that is one number.

    Examples
    --------
    >>> Choice(load=1.0, psi0=0.0, radius=10.0, alpha=0.25, law="microblock").alpha
    0.25
    """

    load: float
    psi0: float | None
    radius: float | None
    alpha: float
    law: str


class Explorer(Shown):
    """A contact problem under changing parameters.

    Attributes
    ----------
    choice : Choice, the parameters of the state
    problem : Contact of these parameters; of a body on a mesh, on the mesh of the first state
    state : State
    seconds : float, what the state took
    reference : float, a_ref in alpha = ell/a_ref: half-width of a classical contact under the first load

    Parameters
    ----------
    problem : Contact
    load : float, force per thickness
    rtol : float, as of `Contact.solve`

    Examples
    --------
    >>> solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)
    >>> explorer = Explorer(mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Microblock(psi0=0)),
    ...     load=1.0)
    >>> explorer.choice.law
    'microblock'
    """

    RANGE = 30**-0.5, 30**0.5  # of a value, the ends of its slider

    @bounded
    def __init__(self, problem, load, rtol=None):
        require_kind(Contact, "a Contact", problem=problem)
        require_positive(load=load)
        if rtol is not None:
            require_tolerance(rtol)
        if problem.solver.in_space:
            raise BadArgument("problem", problem, "must be one of the plane: of a half-space, state.plot()")
        self._before, self._drawn, self._rtol, self._compared = None, {}, rtol, False
        self.reference = reference_length(problem, load)
        names = {law: name for name, law in LAWS.items()}
        if type(problem.law) not in names:
            raise BadArgument("law", problem.law, f"must be one of {', '.join(LAWS)}")
        psi0 = getattr(problem.law, "psi0", 0.0)
        self.choice = Choice(
            float(load),
            None if callable(psi0) else float(psi0),
            float(problem.obstacle.R) if isinstance(problem.obstacle, Cylinder) else None,
            problem.solid.ell / self.reference,
            names[type(problem.law)],
        )
        self._microblock = problem.law if isinstance(problem.law, Microblock) else Microblock()
        self.state = self._timed(lambda: State(problem.solver.solve(load, None, self._rtol)))
        self.problem = self.state.problem
        self.show()

    def _timed(self, work):
        start = time.perf_counter()
        found = work()
        self.seconds = time.perf_counter() - start
        return found

    def _problem(self, choice):
        """The problem of a choice; of the present one, what does not change with it is kept."""
        now, problem = self.choice, self.problem
        if replace(choice, load=now.load) == now:
            return problem
        law = LAWS[choice.law]()
        if choice.law == "microblock":
            law = self._microblock if choice.psi0 is None else replace(self._microblock, psi0=choice.psi0)
        changed = {"law": law}
        if choice.alpha != now.alpha:
            changed["solid"] = replace(problem.solid, ell=choice.alpha * self.reference)
        if choice.radius != now.radius:
            changed["obstacle"] = replace(problem.obstacle, R=choice.radius)
        return problem.with_(**changed)

    @bounded
    def solve(self, **changes):
        """Change parameters (names of `Choice`) and return the new state; where there is none, all stays as
        it was.

        Raises
        ------
        BadArgument
            For a name or a value that the problem does not have.
        NotConverged
        """
        choice, name = self._changed(changes), next(iter(changes)) if len(changes) == 1 else None
        problem = self._problem(choice)
        state = self._timed(
            lambda: State(problem.solver.follow(choice.load, self._rtol, self._near(choice, name)))
        )
        value = getattr(self.choice, name) if name else None
        self._before = (name, value, self.state) if name and not isinstance(value, str) else None
        self.choice, self.problem, self.state = choice, problem, state
        return state

    def _near(self, choice, name):
        """The last solution, moved on if this parameter has moved before."""
        if self._before is None or self._before[0] != name:
            return self.state.solution
        _, value, earlier = self._before
        step = getattr(self.choice, name) - value
        share = (getattr(choice, name) - getattr(self.choice, name)) / step if step else 0.0
        return self.state.solution.moved_on(earlier.solution, share)

    def update(self, **changes):
        """As `solve`, and show the state in the figure."""
        self.solve(**changes)
        self.show()
        return self.state

    @property
    def figure(self):
        """The StateFigure that shows the state."""
        return self.frames.figure

    @bounded
    def png(self):
        """The figure as a PNG, bytes: what has not changed since the last call is not drawn again."""
        return self.frames.png()

    def _known(self):
        """{name: value} of the parameters that the problem has."""
        return {name: value for name, value in asdict(self.choice).items() if value is not None}

    def _changed(self, changes):
        for name, value in changes.items():
            if name not in self._known():
                words = f"is not a parameter of this problem; it has {', '.join(sorted(self._known()))}"
                raise BadArgument(name, value, words)
            if name == "law":
                require_choice(LAWS, law=value)
            if name in ("load", "radius", "alpha"):
                require_positive(**{name: value})
            if name == "psi0":
                require_finite(psi0=value)
        return replace(self.choice, **changes)

    def show(self):
        """Show the state in the figure, of which each set of corners has one."""
        corners = self.state.law.corners
        if corners not in self._drawn:
            self._drawn[corners] = Frames(StateFigure(corners, SCREEN))
        self.frames = self._drawn[corners]
        if self.figure.compared != self._compared:
            self.figure.compare(self._compared)
        self.figure.update(self.state)

    def compare(self, shown):
        """Show the pressure of Hertz beside that of the state, or no longer.

        Raises
        ------
        BadArgument
            If the obstacle is no cylinder.
        """
        if shown and self.choice.radius is None:
            raise BadArgument(
                "obstacle", self.problem.obstacle, "must be a cylinder to be compared with Hertz"
            )
        self._compared = bool(shown)
        self.show()

    def summary(self):
        known = self._known()
        rows = tuple(Row(name, "", value) for name, value in known.items())
        brief = ", ".join(f"{name} {number(value)}" for name, value in known.items())
        return Summary("Explorer", brief, rows, tuple(self.state.warnings))


def reference_length(problem, load):
    """Half-width of a classical contact under the load: a_Hz of a cylinder, half a punch."""
    obstacle, solid = problem.obstacle, problem.solid
    if isinstance(obstacle, Cylinder):
        return math.sqrt(4 * load * obstacle.R / (math.pi * solid.E_star))
    if getattr(obstacle, "ends", ()):
        return (obstacle.ends[-1] - obstacle.ends[0]) / 2
    try:
        return classical(Problem(solid, problem.law, obstacle), load, 0.0)[0]
    except BadArgument:  # an obstacle of bounded height, on a period or a body that ends
        return solid.ell
