"""Sliders for an Explorer in Jupyter."""

from __future__ import annotations

import math
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
        self.explorer, self._widgets = explorer, widgets
        words = {"continuous_update": follows}
        self.controls = {name: self._control(name, value, words) for name, value in explorer.choice.items()}
        known = QUANTITIES if hasattr(explorer.state.solution, "fields_below") else ()
        self.field = widgets.Dropdown(options=["none", *known], description="below")
        self.again = widgets.Button(description="from the beginning")
        self.table, self.told = widgets.HTML(), widgets.HTML()
        whole = {"max_width": "100%"}
        self.picture, self.below = (widgets.Image(format="png", layout=whole) for _ in range(2))
        for name, control in self.controls.items():
            control.observe(lambda change, name=name: self._changed(name, change["new"]), names="value")
        self.field.observe(lambda _: self._try(lambda: None), names="value")
        self.again.on_click(lambda _: self._restart())
        left = widgets.VBox([*self.controls.values(), self.field, self.again, self.told, self.table])
        right = widgets.VBox([self.picture, self.below])
        self.box = widgets.Box([left, right], layout={"flex_flow": "row wrap"})
        self._show()

    def _control(self, name, value, words):
        words |= {"value": value, "description": LABELS[name]}
        if name == "law":
            return self._widgets.Dropdown(options=list(LAWS), value=value, description=LABELS[name])
        if name == "psi0":
            words |= {"min": value - 0.05, "max": value + 0.05, "step": 5e-4, "readout_format": ".4f"}
        else:
            words |= {"min": value / 20, "max": 4 * value, "step": value / 20, "readout_format": ".3g"}
        return self._widgets.FloatSlider(**words)

    def _changed(self, name, value):
        before = self.explorer.choice[name]
        # what the browser sends of a slider that has not been moved is rounded
        if name == "law" or not math.isclose(value, before, rel_tol=1e-6, abs_tol=1e-8):
            self._try(lambda: self.explorer.update(**{name: value}))

    def _restart(self):
        self._try(self.explorer.restart)
        for name, value in self.explorer.choice.items():
            self.controls[name].value = value

    def _try(self, work):
        """Works, and shows the state, or says why not."""
        self.told.value = ""
        try:
            work()
            self._show()
        except MicroblockError as failure:
            self.told.value = f"<span style='color:#a04000'>{failure}</span>"

    def _show(self):
        field, state = self.field.value, self.explorer.state
        self.picture.value, self.table.value = self.explorer.png(), f"<pre>{escape(repr(state))}</pre>"
        self.below.value = b"" if field == "none" else state.plot_below(field)._repr_png_()
