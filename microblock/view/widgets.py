"""Sliders for an Explorer in Jupyter."""

from __future__ import annotations

import time
from html import escape
from typing import TYPE_CHECKING

from ..errors import MicroblockError, MissingExtra
from .below import QUANTITIES
from .explorer import LAWS, Explorer

if TYPE_CHECKING:
    from ipywidgets import Box

    from ..contact import Contact

LABELS = {"load": "load P", "psi0": "ψ₀", "R": "radius R", "ell": "side ℓ", "law": "law"}


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
    return widgets.FloatSlider(
        value,
        min=value - 0.05 if turns else value / 20,
        max=value + 0.05 if turns else 4 * value,
        step=5e-4 if turns else value / 20,
        readout_format=".4f" if turns else ".3g",
        description=LABELS[name],
        continuous_update=follows,
    )
