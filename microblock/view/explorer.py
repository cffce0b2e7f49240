"""Problem and state for parameters that change one by one, for sliders and scripts."""

from dataclasses import replace

from ..contact import Contact
from ..errors import BadArgument, require_choice, require_kind, require_positive, require_tolerance
from ..model.law import Microblock, Microclamped, Unilateral
from ..model.material import Elastic
from ..model.obstacles import Cylinder
from ..model.results import saved
from ..model.state import State
from ..threads import bounded
from .state_figure import draw

LAWS = {"microblock": Microblock, "unilateral": Unilateral, "microclamped": Microclamped}


class Explorer:
    """A contact problem under changing parameters.

    Parameters are the load (force per thickness), psi0 (radians), R of a cylinder and ell (lengths),
    and the law, by name.

    Attributes
    ----------
    choice : dict, parameters by name
    problem : Contact of these; of a body on a mesh, on the mesh of the first state
    state : State

    Parameters
    ----------
    problem : Contact
    load : float, the first force per thickness
    rtol : float, of `Contact.solve`

    Raises
    ------
    BadArgument
        If the problem is not of the plane, or has friction or a law of its own.

    Examples
    --------
    >>> solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)
    >>> problem = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Microblock(psi0=0))
    >>> Explorer(problem, load=1.0).update(ell=0.2).solid.ell
    0.2
    """

    @bounded
    def __init__(self, problem, load, rtol=None):
        require_kind(Contact, "a Contact", problem=problem)
        require_positive(load=load)
        if rtol is not None:
            require_tolerance(rtol)
        if problem.solver.in_space:
            raise BadArgument("problem", problem, "must be one of the plane: of a half-space, state.plot()")
        if getattr(problem.law, "friction", 0.0):
            raise BadArgument("law", problem.law, "has friction: Contact.history takes it")
        if type(problem.law) is not LAWS.get(_name(problem.law)):
            raise BadArgument("law", problem.law, f"must be one of {', '.join(LAWS)}")
        self._first, self._rtol = problem, rtol
        self._load, self._drawings = float(load), {}
        self.restart()

    @bounded
    def restart(self):
        """Goes back to the first parameters; returns the state."""
        problem = self._first
        psi0 = getattr(problem.law, "psi0", 0.0)
        known = {
            "psi0": None if callable(psi0) else psi0,
            "R": problem.obstacle.R if isinstance(problem.obstacle, Cylinder) else None,
            "ell": problem.solid.ell,
            "law": _name(problem.law),
        }
        if isinstance(problem.solid, Elastic):  # without blocks
            known = {"R": known["R"]}
        choice = {"load": self._load} | {name: own for name, own in known.items() if own is not None}
        return self._go(problem, choice, None)

    @bounded
    def update(self, **changes):
        """Returns the state of changed parameters; where it raises BadArgument or NotConverged, all stays as
        it was.
        """
        for name, value in changes.items():
            if name not in self.choice:
                words = f"is not a parameter of this problem; it has {', '.join(sorted(self.choice))}"
                raise BadArgument(name, value, words)
        choice, problem = self.choice | changes, self.problem
        require_positive(load=choice["load"])
        if changes.keys() - {"load"}:
            named = choice.get("law", "unilateral")  # alone on a solid without blocks
            require_choice(LAWS, law=named)
            law, changed = LAWS[named](), {}
            if named == "microblock":
                first = self._first.law if isinstance(self._first.law, Microblock) else law
                law = replace(first, psi0=choice["psi0"]) if "psi0" in choice else first
            if "ell" in changes:
                changed["solid"] = replace(problem.solid, ell=choice["ell"])
            if "R" in changes:
                changed["obstacle"] = replace(problem.obstacle, R=choice["R"])
            problem = problem.with_(law=law, **changed)
        return self._go(problem, choice, self.state.solution)

    def _go(self, problem, choice, near):
        """Solves, from a near solution, and keeps the state."""
        self.state = State(problem.solver.follow(choice["load"], self._rtol, near))
        self.choice = choice
        self.problem = self.state.problem
        return self.state

    @bounded
    def png(self):
        """The figure of the state as a PNG, bytes."""
        law = type(self.state.law)  # which says what a figure holds
        drawing, room = self._drawings.get(law, (None, ()))
        drawing = saved(
            draw(self.state, drawing=drawing), None, None, self.state.warnings, self.state.caption
        )
        # panels are placed anew, which takes longer than all else, where letters need more room
        labels = [[len(label.get_text()) for label in axis.get_yticklabels()] for axis in drawing.axes]
        asked = drawing.get_suptitle().count("\n"), *(max(lengths, default=0) for lengths in labels)
        fits = room and all(now <= then for now, then in zip(asked, room, strict=True))
        drawing.set_layout_engine(None if fits else "constrained")
        self._drawings[law] = drawing, room if fits else asked
        return drawing._repr_png_()


def _name(law):
    return type(law).__name__.lower()
