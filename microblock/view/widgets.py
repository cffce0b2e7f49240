"""Sliders for an Explorer in Jupyter; what needs no browser is in `microblock.view.explorer`."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from ..errors import MicroblockError, MissingExtra
from .below import QUANTITIES
from .explorer import Explorer

if TYPE_CHECKING:
    from ipywidgets import HBox

    from ..contact import Contact

RANGE = 30.0  # between the ends of a slider on a logarithmic scale
MOST_PSI0 = 3.0  # degrees, to either side
SLOW = 0.15  # seconds for a state, from which on a slider waits until it is let go
LABELS = {"load": "load P", "radius": "radius R", "alpha": "α = ℓ/a"}


def explore(problem: Contact, load: float, rtol: float | None = None) -> HBox:
    """Returns sliders for load, psi0, radius, alpha and law with a figure that follows, for Jupyter.

    A half-plane, cells and a body on a mesh answer while a slider moves (alpha of a body on a mesh costs a
    factorisation); fitted meshes are made anew for each state, which takes longer.

    Parameters
    ----------
    problem : Contact
    load : float
        Force per thickness at which the sliders begin; alpha is ell over the half-width of a classical
        contact under it.
    rtol : float, optional
        As of `Contact.solve`; of a body on a mesh it refines the mesh for the first state.

    Returns
    -------
    ipywidgets.HBox

    Raises
    ------
    MissingExtra
        If ipywidgets is not installed (extra `notebook`). `microblock.view.explorer.Explorer` does the same
        from a script.

    Examples
    --------
    >>> solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)
    >>> box = mb.explore(mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Microblock()), load=1.0)
    """
    try:
        import ipywidgets
    except ImportError as failure:
        raise MissingExtra("explore()", "ipywidgets", "notebook") from failure
    return Panel(Explorer(problem, load, rtol), ipywidgets).box


class Panel:
    """The widgets of one Explorer; `box` holds them all."""

    def __init__(self, explorer, ipywidgets):
        self.explorer, self._widgets = explorer, ipywidgets
        self.controls = {
            name: self._control(name)
            for name in ("load", "psi0", "radius", "alpha", "law")
            if getattr(explorer.choice, name) is not None
        }
        self.picture = ipywidgets.Image(value=explorer.png(), format="png")
        self.table, self.told = ipywidgets.HTML(explorer.state._repr_html_()), ipywidgets.HTML()
        self.quantity = ipywidgets.Dropdown(options=list(QUANTITIES), description="below")
        self.button = ipywidgets.Button(description="draw the field below")
        self.below = ipywidgets.Image(format="png", layout={"display": "none"})
        self.button.on_click(lambda _: self._draw_below())
        for name, control in self.controls.items():
            control.observe(lambda change, name=name: self._changed(name, change["new"]), names="value")
        known = hasattr(explorer.state.solution, "fields_below")
        below = [ipywidgets.HBox([self.quantity, self.button]), self.below] if known else []
        self.aside = [*self.controls.values(), self.told, self.table, *below]
        self.box = ipywidgets.HBox([self.picture, ipywidgets.VBox(self.aside)])

    def _control(self, name):
        value = getattr(self.explorer.choice, name)
        shown = {"layout": {"width": "340px"}, "continuous_update": self.explorer.seconds < SLOW}
        if name == "law":
            return self._widgets.Dropdown(
                options=["microblock", "unilateral", "microclamped"], value=value, description="law"
            )
        if name == "psi0":
            degrees = math.degrees(value)
            return self._widgets.FloatSlider(
                value=degrees,
                min=min(-MOST_PSI0, degrees),
                max=max(MOST_PSI0, degrees),
                step=0.01,
                description="ψ₀ (degrees)",
                **shown,
            )
        ends = math.log10(value / math.sqrt(RANGE)), math.log10(value * math.sqrt(RANGE))
        return self._widgets.FloatLogSlider(
            value=value,
            min=ends[0],
            max=ends[1],
            step=(ends[1] - ends[0]) / 200,
            description=LABELS[name],
            readout_format=".3g",
            **shown,
        )

    def _changed(self, name, value):
        """A new state; where there is none the picture stays and a line says why."""
        try:
            self.explorer.update(**{name: math.radians(value) if name == "psi0" else value})
        except MicroblockError as failure:
            self.told.value = f"<span style='color:#a04000'>{failure}</span>"
            return
        self.told.value = ""
        self.picture.value, self.table.value = self.explorer.png(), self.explorer.state._repr_html_()
        self.below.layout.display = "none"

    def _draw_below(self):
        self.below.value = self.explorer.state.plot_below(self.quantity.value)._repr_png_()
        self.below.layout.display = ""
