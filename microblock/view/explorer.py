"""A contact problem and its state under parameters that change one by one, with sliders in Jupyter."""

from __future__ import annotations

import time
from dataclasses import replace
from html import escape
from typing import TYPE_CHECKING

from ..contact import Contact
from ..errors import (
    BadArgument,
    MicroblockError,
    MissingExtra,
    require_choice,
    require_kind,
    require_positive,
)
from ..model.law import Microblock, Microclamped, Unilateral
from ..model.material import Elastic
from ..model.obstacles import Cylinder
from ..model.results import saved
from ..model.state import State
from ..threads import bounded
from .below import QUANTITIES
from .state_figure import draw

if TYPE_CHECKING:
    from ipywidgets import Box

LABELS = {"load": "load P", "psi0": "ψ₀", "R": "radius R", "ell": "side ℓ", "law": "law"}
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

    def __init__(self, problem, load, rtol=None):
        require_kind(Contact, "a Contact", problem=problem)
        if problem.solver.in_space:
            raise BadArgument("problem", problem, "must be one of the plane: of a half-space, state.plot()")
        law, obstacle = problem.law, problem.obstacle
        named, psi0 = type(law).__name__.lower(), getattr(law, "psi0", 0.0)
        if type(law) is not LAWS.get(named):
            raise BadArgument("law", law, f"must be one of {', '.join(LAWS)}")
        self._law, self._rtol, self._drawings = law, rtol, {}
        self.state = problem.solve(load=load, rtol=rtol)  # which refines a mesh
        known = {
            "load": float(load),
            "psi0": None if callable(psi0) else psi0,
            "R": obstacle.R if isinstance(obstacle, Cylinder) else None,
            "ell": problem.solid.ell,
            "law": named,
        }
        if isinstance(problem.solid, Elastic):  # without blocks
            known = {name: known[name] for name in ("load", "R")}
        self.choice = {name: value for name, value in known.items() if value is not None}

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
            law = self._law if type(self._law) is LAWS[named] else LAWS[named]()
            if named == "microblock" and "psi0" in choice:
                law = replace(law, psi0=choice["psi0"])
            problem = problem.with_(
                law=law,
                solid=replace(problem.solid, ell=choice["ell"]) if "ell" in choice else None,
                obstacle=replace(problem.obstacle, R=choice["R"]) if "R" in choice else None,
            )
        self.state = State(problem.solver.follow(choice["load"], self._rtol, self.state.solution))
        self.choice = choice
        return self.state

    @property
    def problem(self):
        return self.state.problem

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


def explore(problem: Contact, load: float, rtol: float | None = None) -> Box:
    """Returns sliders for load, psi0, R, ell and law with a figure that follows, for Jupyter.

    A list has the fields below half-planes on panels and bodies on meshes.

    Parameters
    ----------
    problem : Contact
    load : float
        First force per thickness.
    rtol : float, optional
        As of `Contact.solve`; it refines a mesh for the first state.

    Returns
    -------
    ipywidgets.Box

    Raises
    ------
    MissingExtra
        If ipywidgets is not installed (extra `notebook`); scripts have `microblock.view.explorer.Explorer`.

    Examples
    --------
    >>> solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)
    >>> box = mb.explore(mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Microblock()), load=1.0)
    """
    start = time.perf_counter()
    explorer = Explorer(problem, load, rtol)
    try:
        import ipywidgets
    except ImportError as failure:
        raise MissingExtra("explore()", "ipywidgets", "notebook") from failure
    return Panel(explorer, ipywidgets, time.perf_counter() - start < 0.5).box


class Panel:
    """The widgets of an Explorer, all in `box`; sliders follow the hand, or wait until it lets go."""

    def __init__(self, explorer, widgets, follows=False):
        self.explorer = explorer
        self.controls = {
            name: _control(widgets, name, value, follows) for name, value in explorer.choice.items()
        }
        known = QUANTITIES if hasattr(explorer.state.solution, "fields_below") else ()
        self.field = widgets.Dropdown(options=["none", *known], description="below")
        self.table, self.told = widgets.HTML(), widgets.HTML()
        whole = {"max_width": "100%"}
        self.picture, self.below = (widgets.Image(format="png", layout=whole) for _ in range(2))
        for control in (*self.controls.values(), self.field):
            control.observe(self._changed, names="value")
        left = widgets.VBox([*self.controls.values(), self.field, self.told, self.table])
        right = widgets.VBox([self.picture, self.below])
        self.box = widgets.Box([left, right], layout={"flex_flow": "row wrap"})
        self._show()

    def _changed(self, _):
        """Shows the state of what is set, or says why not."""
        values = {name: control.value for name, control in self.controls.items()}
        before, self.told.value = self.explorer.choice, ""
        changes = {name: value for name, value in values.items() if value != before[name]}
        try:
            if changes:
                self.explorer.update(**changes)
            self._show()
        except MicroblockError as failure:
            self.told.value = f"<span style='color:#a04000'>{failure}</span>"

    def _show(self):
        field, state = self.field.value, self.explorer.state
        self.picture.value, self.table.value = self.explorer.png(), f"<pre>{escape(repr(state))}</pre>"
        self.below.value = b"" if field == "none" else state.plot_below(field)._repr_png_()


def _control(widgets, name, value, follows):
    """The widget of a parameter."""
    if name == "law":
        return widgets.Dropdown(options=list(LAWS), value=value, description=LABELS[name])
    turns = name == "psi0"
    low, high, step = (value - 0.05, value + 0.05, 5e-4) if turns else (value / 20, 4 * value, value / 20)
    return widgets.FloatSlider(
        value,
        min=low,
        max=high,
        step=step,
        readout_format=".4f" if turns else ".3g",
        description=LABELS[name],
        continuous_update=follows,
    )
