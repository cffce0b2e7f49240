"""A contact problem and its state under parameters that change one by one, with sliders in Jupyter."""

from __future__ import annotations

from dataclasses import replace
from html import escape
from typing import TYPE_CHECKING, Any

from ..contact import Contact
from ..errors import MicroblockError, MissingExtra, require_kind
from ..model.law import Law, Microblock, Microclamped, Unilateral
from ..model.material import Elastic
from ..model.obstacles import Cylinder
from ..model.results import saved
from ..model.surfaces import Sphere
from . import state_figure
from .below import QUANTITIES

if TYPE_CHECKING:
    from ipywidgets import Box


def explore(problem: Contact, load: float, rtol: float | None = None) -> Box:
    """Returns sliders for load, psi0, R, ell and law with a figure that follows, for Jupyter.

    A list has the fields below the surface. A state that is not found leaves the figure as it is, and a
    sentence says why.

    Parameters
    ----------
    problem : Contact
    load : float
        First force per thickness.
    rtol : float, optional
        As of `Contact.solve`, of each state.

    Returns
    -------
    ipywidgets.Box

    Raises
    ------
    BadArgument, NotConverged
        If there is no first state.
    MissingExtra
        If ipywidgets is not installed (extra `notebook`).

    Examples
    --------
    >>> solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)
    >>> box = mb.explore(mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Microblock()), load=1.0)
    """
    require_kind(Contact, "a Contact", problem=problem)
    try:
        import ipywidgets as widgets
    except ImportError as failure:
        raise MissingExtra("explore()", "ipywidgets", "notebook") from failure
    state: Any = problem.solve(load=load, rtol=rtol)
    numbers, laws = slider_values(problem)
    controls: dict[str, Any] = {}
    for name, value in {"load": load, **numbers}.items():
        low = value / 20
        high = 4 * value
        if name == "psi0":
            low = value - 0.05
            high = value + 0.05
        controls[name] = widgets.FloatSlider(
            value,
            description=name,
            continuous_update=False,
            min=low,
            max=high,
            step=(high - low) / 100,
            readout_format=".3g",
        )
    controls["law"] = widgets.Dropdown(options=laws, value=problem.law, description="law")
    field = widgets.Dropdown(options=["none", *QUANTITIES], description="below")
    picture = widgets.Image(format="png", layout={"max_width": "100%"})
    below = widgets.Image(format="png", layout={"max_width": "100%"})
    table = widgets.HTML()
    failed = widgets.HTML()
    drawing: Any = None

    def show(change: Any = None) -> None:
        nonlocal state, drawing
        failed.value = ""
        try:
            if change and change["owner"] is not field:
                values = {name: control.value for name, control in controls.items()}
                changed = varied(problem, **values)
                state = changed.solve(load=values["load"], rtol=rtol, initial=state)
            table.value = f"<pre>{escape(repr(state))}</pre>"
            if state.flat:
                drawing = saved(state_figure.draw(state, drawing), None, None, state.warnings, state.caption)
            else:
                drawing = state.plot()
            if not drawing.has_room():
                drawing.lay_out()
            picture.value = drawing.png()
            below.value = b""  # which a state without fields leaves
            if field.value != "none":
                below.value = state.plot_below(field.value)._repr_png_()
        except MicroblockError as failure:
            failed.value = escape(str(failure))

    for control in (*controls.values(), field):
        control.observe(show, "value")
    show()
    inputs = widgets.VBox([*controls.values(), field, failed, table])
    figures = widgets.VBox([picture, below])
    return widgets.Box([inputs, figures], layout={"flex_flow": "row wrap"})


def slider_values(problem: Contact) -> tuple[dict[str, float], dict[str, Law]]:
    """Returns the numbers of sliders by name, and the laws of the list, the problem's own as it is."""
    law = problem.law
    numbers = {}
    if isinstance(problem.obstacle, (Cylinder, Sphere)):
        numbers["R"] = problem.obstacle.R
    if isinstance(problem.solid, Elastic):  # without blocks
        return numbers, {type(law).__name__: law}
    numbers["ell"] = problem.solid.ell
    psi0: Any = 0.0
    if isinstance(law, Microblock):
        psi0 = law.psi0
    if isinstance(psi0, (int, float)):
        numbers["psi0"] = psi0
    laws = {kind.__name__: kind() for kind in (Microblock, Unilateral, Microclamped)}
    return numbers, laws | {type(law).__name__: law}


def varied(
    problem: Contact,
    load: float,
    law: Law,
    psi0: float | None = None,
    R: float | None = None,
    ell: float | None = None,
) -> Contact:
    """Returns the problem with other numbers and another law."""
    solid: Any = None
    obstacle: Any = problem.obstacle
    if psi0 is not None and isinstance(law, Microblock):
        law = replace(law, psi0=psi0)
    if ell is not None:
        solid = replace(problem.solid, ell=ell)
    if R is not None:
        obstacle = replace(obstacle, R=R)
    return problem.with_(law=law, solid=solid, obstacle=obstacle)
