"""A contact problem and its state under parameters that change one by one, with sliders in Jupyter."""

from __future__ import annotations

from dataclasses import replace
from html import escape
from typing import TYPE_CHECKING, Any

from ..contact import Contact
from ..errors import MicroblockError, MissingExtra, require_kind
from ..model.law import Microblock, Microclamped, Unilateral
from ..model.material import Elastic
from ..model.obstacles import Cylinder
from ..model.surfaces import Sphere
from .below import QUANTITIES

if TYPE_CHECKING:
    from ipywidgets import Box


def explore(problem: Contact, load: float, rtol: float | None = None) -> Box:
    """Returns sliders for load, psi0, R, ell and law with a figure that follows, for Jupyter.

    A list has the fields below the surface, which states on cells do not have. A state that is not found
    leaves the figure as it is, and a sentence says why.

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
    numbers, laws = offered(problem)
    controls = {"load": load, **numbers}
    for name, value in controls.items():
        low, high = (value - 0.05, value + 0.05) if name == "psi0" else (value / 20, 4 * value)
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
    picture, below = (widgets.Image(format="png", layout={"max_width": "100%"}) for _ in range(2))
    table, failed = widgets.HTML(), widgets.HTML()

    def show(change=None):
        nonlocal state
        failed.value = ""
        try:
            if change and change["owner"] is not field:
                values = {name: control.value for name, control in controls.items()}
                changed = varied(problem, **values)
                state = changed.solve(load=values["load"], rtol=rtol, initial=state)
            table.value, picture.value = f"<pre>{escape(repr(state))}</pre>", state.plot()._repr_png_()
            below.value = b""  # which a state without fields leaves
            if field.value != "none":
                below.value = state.plot_below(field.value)._repr_png_()
        except MicroblockError as failure:
            failed.value = escape(str(failure))

    for control in (*controls.values(), field):
        control.observe(show, "value")
    show()
    columns = [*controls.values(), field, failed, table], [picture, below]
    return widgets.Box([widgets.VBox(own) for own in columns], layout={"flex_flow": "row wrap"})


def offered(problem):
    """Numbers of sliders by name, and the laws of the list, the problem's own as it is."""
    law, obstacle, solid = problem.law, problem.obstacle, problem.solid
    numbers = {"R": obstacle.R} if isinstance(obstacle, (Cylinder, Sphere)) else {}
    if isinstance(solid, Elastic):  # without blocks
        return numbers, {type(law).__name__: law}
    psi0 = law.psi0 if isinstance(law, Microblock) else 0.0
    numbers |= {"ell": solid.ell} | ({"psi0": psi0} if isinstance(psi0, (int, float)) else {})
    kinds = Microblock, Unilateral, Microclamped
    return numbers, {kind.__name__: kind() for kind in kinds} | {type(law).__name__: law}


def varied(problem, load, law, psi0=None, R=None, ell=None):
    """The problem with other numbers and another law."""
    return problem.with_(
        law=replace(law, psi0=psi0) if psi0 is not None and isinstance(law, Microblock) else law,
        solid=None if ell is None else replace(problem.solid, ell=ell),
        obstacle=None if R is None else replace(problem.obstacle, R=R),
    )
