"""Sliders for an Explorer in Jupyter; what needs no browser is in `microblock.view.explorer`."""

from __future__ import annotations

import asyncio
import math
import statistics
import time
from base64 import b64encode
from collections import defaultdict, deque
from dataclasses import asdict
from typing import TYPE_CHECKING

from ..errors import BadArgument, MicroblockError, MissingExtra, require_kind, require_positive
from .below import QUANTITIES
from .explorer import LAWS, Explorer

if TYPE_CHECKING:
    from ipywidgets import Box

    from ..contact import Contact

STEPS = 200  # of a slider on a logarithmic scale
# from the first value to either end, and from one value to the next: whole steps, or the browser moves it
EITHER_SIDE = {"psi0": (3.0, 0.01), "shear": (1.0, 0.01)}
UNITS = {"psi0": math.degrees(1)}  # of sliders, over those of the problem
SAME = 1e-6  # of a value: what the browser sends of a slider that has not been moved is rounded
SLOW = 0.3  # seconds from a slider's value to its picture, from which on it waits until it is let go
TOO_SLOW = 1.0  # seconds of the first state, from which on no slider begins to follow while it moves
FRAMES = 3  # the last ones of a slider, of which the median counts
REST = 0.25  # seconds without a change, after which the field below is drawn
LABELS = {
    "shear": "Q/(fP)",
    "load": "load P",
    "psi0": "ψ₀ (°)",
    "radius": "radius R",
    "alpha": "α = ℓ/a",
    "law": "law",
}
# Sliders and numbers beside the picture where the notebook's column is wide enough, else above and below it;
# the picture may be smaller than it is, never of another shape. In the narrow column beside the picture the
# numbers are without symbols and units, which would break their lines.
STYLE = """<style>
.microblock-explore { container-type: inline-size; width: 100%; overflow: visible; }
.microblock-explore .microblock-panel { display: grid; gap: 0 14px; align-items: start; overflow: visible;
  grid-template: "controls picture" auto "numbers picture" 1fr ". below" auto / 285px minmax(0, 1fr); }
.microblock-controls { grid-area: controls; display: flex; flex-flow: row wrap; overflow: visible; }
.microblock-numbers { grid-area: numbers; overflow: visible; }
.microblock-picture { grid-area: picture; } .microblock-below { grid-area: below; }
.microblock-explore img { width: auto; max-width: 100%; height: auto; align-self: start; }
.microblock-controls > .jupyter-widgets { width: 277px; flex: 0 1 277px; }
.microblock-controls .widget-label { width: 62px; min-width: 62px; }
.microblock-controls .widget-readout { min-width: 58px; }
.microblock-numbers .widget-html-content { line-height: 1.3; font-size: 12px; white-space: normal; }
@container (min-width: 791px) {
  .microblock-numbers :is(.microblock > span, td:nth-child(2), td > span) { display: none; }
  .microblock-numbers td:last-child { white-space: nowrap; }
}
@container (max-width: 790px) {
  .microblock-explore .microblock-panel {
    grid-template: "controls" auto "picture" auto "below" auto "numbers" auto / minmax(0, 1fr); }
}
</style>"""


def explore(problem: Contact, load: float, rtol: float | None = None) -> Box:
    """Returns sliders for load, psi0, radius, alpha and law with a figure that follows, for Jupyter.

    Under a law with friction, on a half-plane, there are sliders for the normal and the shear force instead:
    each step goes on from the last one, and the loop of shear and slip is drawn as it is walked.

    A slider is followed while it moves as long as its last states have come soon enough, each slider for
    itself; else the state follows when the slider is let go. Buttons show the pressure of Hertz beside that
    of a cylinder, and the field below the surface of half-planes on panels and of bodies on meshes. The
    output holds a still picture as well, which is shown where no sliders can be: in exported pages.

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
    ipywidgets.Box

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
    from ..contact import Contact

    require_kind(Contact, "a Contact", problem=problem)
    require_positive(load=load)
    try:
        import ipywidgets
    except ImportError as failure:
        raise MissingExtra("explore()", "ipywidgets", "notebook") from failure
    if getattr(problem.law, "friction", 0.0):
        from .friction_explorer import FrictionExplorer

        if rtol is not None:
            raise BadArgument("rtol", rtol, "is not for steps with friction: Contact.history takes it")
        return Panel(FrictionExplorer(problem, load), ipywidgets).box
    return Panel(Explorer(problem, load, rtol), ipywidgets).box


class Panel:
    """The widgets of one Explorer or FrictionExplorer; `box` holds them all."""

    def __init__(self, explorer, ipywidgets):
        self.explorer, self._widgets, self._awaited = explorer, ipywidgets, None
        self._seconds = defaultdict(lambda: deque(maxlen=FRAMES))
        values = asdict(explorer.choice)
        self.controls = {
            name: self._control(name, values[name]) for name in LABELS if values.get(name) is not None
        }
        self.picture = ipywidgets.Image(value=explorer.png(), format="png")
        self.table, self.told = ipywidgets.HTML(explorer.state._repr_html_()), ipywidgets.HTML()
        narrow = {"width": "92px"}
        self.hertz = ipywidgets.ToggleButton(
            description="Hertz", tooltip="pressure of a classical cylinder", layout=narrow
        )
        self.beneath = ipywidgets.ToggleButton(
            description="field below", tooltip="the field below the surface", layout=narrow
        )
        self.quantity = ipywidgets.Dropdown(options=list(QUANTITIES), layout={"width": "80px"})
        self.again = ipywidgets.Button(description="from the beginning")
        self.below = ipywidgets.Image(format="png", layout={"display": "none"})
        for name, control in self.controls.items():
            control.observe(lambda change, name=name: self._changed(name, change["new"]), names="value")
        self.hertz.observe(lambda change: self._compare(change["new"]), names="value")
        for control in (self.beneath, self.quantity):
            control.observe(lambda _: self._show_below(), names="value")
        self.again.on_click(lambda _: self._restart())
        self.box = self._arranged()

    def _control(self, name, value):
        """The slider or the list of a parameter."""
        if name == "law":
            return self._widgets.Dropdown(options=list(LAWS), value=value, description=LABELS[name])
        words = {"description": LABELS[name], "continuous_update": self.explorer.seconds < TOO_SLOW}
        if name in EITHER_SIDE:
            side, step = EITHER_SIDE[name]
            value = value * UNITS.get(name, 1.0)
            return self._widgets.FloatSlider(
                value=value, min=value - side, max=value + side, step=step, **words
            )
        low, high = (math.log10(share * value) for share in self.explorer.RANGE)
        words |= {"step": (high - low) / STEPS, "readout_format": ".3g"}
        return self._widgets.FloatLogSlider(value=value, min=low, max=high, **words)

    def _arranged(self):
        """All widgets in a box that arranges them by its width; where no widgets can be, the picture."""
        toggles = [self.hertz] if "radius" in self.controls else []
        if hasattr(self.explorer.state.solution, "fields_below"):
            toggles += [self.beneath, self.quantity]
        toggles += [self.again] if hasattr(self.explorer, "restart") else []
        parts = {
            "controls": [*self.controls.values(), self._widgets.HBox(toggles), self.told],
            "picture": [self.picture],
            "below": [self.below],
            "numbers": [self.table],
        }
        boxes = [classed(self._widgets.Box(own), f"microblock-{name}") for name, own in parts.items()]
        within = [self._widgets.HTML(STYLE), classed(self._widgets.Box(boxes), "microblock-panel")]
        return classed(shown_with_still(self._widgets)(within, self.picture), "microblock-explore")

    def _tried(self, work):
        """Whether it could be done; else the pictures stay and a line says why."""
        try:
            work()
        except MicroblockError as failure:
            self.told.value = f"<span style='color:#a04000'>{failure}</span>"
            return False
        self.told.value = ""
        return True

    def _changed(self, name, value):
        """A new state, shown."""
        start, before = time.perf_counter(), getattr(self.explorer.choice, name)
        if name != "law":
            value = value / UNITS.get(name, 1.0)
            if math.isclose(value, before, rel_tol=SAME, abs_tol=SAME / 100):
                return
        if not self._tried(lambda: self.explorer.update(**{name: value})):
            return
        self.picture.value = self.explorer.png()
        seconds = self._seconds[name]
        seconds.append(time.perf_counter() - start)
        if name != "law" and len(seconds) == FRAMES:
            self.controls[name].continuous_update = statistics.median(seconds) < SLOW
        # the picture is on its way: the numbers follow
        self.table.value = self.explorer.state._repr_html_()
        self._at_rest(self._show_below)

    def _restart(self):
        self.explorer.restart()
        for name, control in self.controls.items():
            control.value = getattr(self.explorer.choice, name)
        self.picture.value, self.table.value = self.explorer.png(), self.explorer.state._repr_html_()

    def _compare(self, shown):
        self.explorer.compare(shown)
        self.picture.value = self.explorer.png()

    def _show_below(self):
        if not self.beneath.value:
            self.below.layout.display = "none"
        elif self._tried(self._draw_below):
            self.below.layout.display = ""

    def _draw_below(self):
        self.below.value = self.explorer.state.plot_below(self.quantity.value)._repr_png_()

    def _at_rest(self, work):
        """Do it when nothing has changed for a while; without a kernel at once."""
        if self._awaited is not None:
            self._awaited.cancel()
        try:
            self._awaited = asyncio.get_running_loop().call_later(REST, work)
        except RuntimeError:
            work()


def classed(box, name):
    """A box with the name of a class, by which STYLE finds it."""
    box.add_class(name)
    return box


def shown_with_still(ipywidgets):
    """A class of boxes that leave their picture, an Image, beside themselves in a notebook's output: it is
    what pages made by nbconvert show, which have no kernel.
    """

    class Shown(ipywidgets.Box):
        def __init__(self, children, picture):
            super().__init__(children)
            self._picture, self._own = picture, f"microblock-{self.model_id}"
            self.add_class(self._own)

        def _ipython_display_(self, **_):
            from IPython.display import display

            display(self._repr_mimebundle_(), raw=True)
            display(still_bundle(self._picture.value, self._own), raw=True)

    return Shown


def still_bundle(still, own):
    """A picture as HTML that hides itself while an element of the class `own` is on the page, and as PNG."""
    encoded = b64encode(still).decode()
    html = (
        f"<style>body:has(.{own}) .{own}-still {{ display: none; }}</style>"
        f'<img class="{own}-still" alt="contact state" src="data:image/png;base64,{encoded}">'
    )
    return {"text/html": html, "image/png": encoded, "text/plain": "<the first state as a picture>"}
