"""Sliders for an Explorer in Jupyter; what needs no browser is in `microblock.view.explorer`."""

from __future__ import annotations

import asyncio
import math
import statistics
import time
from base64 import b64encode
from collections import defaultdict, deque
from typing import TYPE_CHECKING

from ..errors import BadArgument, MicroblockError, MissingExtra, require_kind, require_positive
from .below import QUANTITIES
from .explorer import LAWS, Explorer

if TYPE_CHECKING:
    from ipywidgets import Box

    from ..contact import Contact

RANGE = 30.0  # between the ends of a slider on a logarithmic scale
STEPS = 200  # of such a slider
MOST_PSI0, STEP_PSI0 = 3.0, 0.01  # degrees: to either side, and from one value to the next
SAME = 1e-6  # of a value: what the browser sends of a slider that has not been moved is rounded
SLOW = 0.3  # seconds from a slider's value to its picture, from which on it waits until it is let go
TOO_SLOW = 1.0  # seconds of the first state, from which on no slider begins to follow while it moves
FRAMES = 3  # the last ones of a slider, of which the median counts
REST = 0.25  # seconds without a change, after which the field below is drawn
LABELS = {"load": "load P", "psi0": "ψ₀ (°)", "radius": "radius R", "alpha": "α = ℓ/a", "law": "law"}
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
        from .friction_widgets import FrictionPanel

        if rtol is not None:
            raise BadArgument("rtol", rtol, "is not for steps with friction: Contact.history takes it")
        return FrictionPanel(FrictionExplorer(problem, load), ipywidgets).box
    return Panel(Explorer(problem, load, rtol), ipywidgets).box


class Pace:
    """Whether the pictures of a slider come soon enough to follow it while it moves.

    The first picture of a slider does not count: it may have to set up what the later ones use.
    """

    def __init__(self, quick):
        self.quick, self._warm, self._seconds = quick, False, deque(maxlen=FRAMES)

    def took(self, seconds):
        """Take in what a picture took; returns `quick` as it is then."""
        if self._warm:
            self._seconds.append(seconds)
            self.quick = statistics.median(self._seconds) < SLOW
        self._warm = True
        return self.quick


class Panel:
    """The widgets of one Explorer; `box` holds them all."""

    def __init__(self, explorer, ipywidgets):
        self.explorer, self._widgets, self._awaited = explorer, ipywidgets, None
        self._paces = defaultdict(lambda: Pace(explorer.seconds < TOO_SLOW))
        self.controls = {
            name: self._control(name) for name in LABELS if getattr(explorer.choice, name) is not None
        }
        self.picture = ipywidgets.Image(value=explorer.png(), format="png")
        self.table, self.told = ipywidgets.HTML(explorer.state._repr_html_()), ipywidgets.HTML()
        self.hertz = ipywidgets.ToggleButton(description="Hertz", tooltip="pressure of a classical cylinder")
        self.beneath = ipywidgets.ToggleButton(
            description="field below", tooltip="the field below the surface"
        )
        self.quantity = ipywidgets.Dropdown(options=list(QUANTITIES), layout={"width": "80px"})
        self.below = ipywidgets.Image(format="png", layout={"display": "none"})
        for name, control in self.controls.items():
            control.observe(lambda change, name=name: self._changed(name, change["new"]), names="value")
        self.hertz.observe(lambda change: self._compare(change["new"]), names="value")
        for control in (self.beneath, self.quantity):
            control.observe(lambda _: self._show_below(), names="value")
        self.box = self._arranged()

    def _control(self, name):
        value, words = getattr(self.explorer.choice, name), {"description": LABELS[name]}
        if name == "law":
            return self._widgets.Dropdown(options=list(LAWS), value=value, **words)
        shown = {"continuous_update": self._paces[name].quick, **words}
        if name == "psi0":
            degrees = math.degrees(value)
            # whole steps to either side: the browser would move the value to a step, and tell so
            down, up = (max(math.ceil((MOST_PSI0 + side) / STEP_PSI0), 0) for side in (degrees, -degrees))
            ends = {"min": degrees - down * STEP_PSI0, "max": degrees + up * STEP_PSI0}
            return self._widgets.FloatSlider(value=degrees, step=STEP_PSI0, **ends, **shown)
        ends = math.log10(value / math.sqrt(RANGE)), math.log10(value * math.sqrt(RANGE))
        return self._widgets.FloatLogSlider(
            value=value,
            min=ends[0],
            max=ends[1],
            step=(ends[1] - ends[0]) / STEPS,
            readout_format=".3g",
            **shown,
        )

    def _arranged(self):
        """All widgets in a box that arranges them by the width it is given."""
        toggles = [self.hertz] if self.explorer.choice.radius is not None else []
        if hasattr(self.explorer.state.solution, "fields_below"):
            toggles += [self.beneath, self.quantity]
        for toggle in toggles:
            toggle.layout.width = toggle.layout.width or "92px"
        parts = {
            "controls": [*self.controls.values(), self._widgets.HBox(toggles), self.told],
            "picture": [self.picture],
            "below": [self.below],
            "numbers": [self.table],
        }
        return arranged(self._widgets, parts, self.picture)

    def _changed(self, name, value):
        """A new state; where there is none the picture stays and a line says why."""
        start, control = time.perf_counter(), self.controls[name]
        value = math.radians(value) if name == "psi0" else value
        if name != "law" and math.isclose(
            value, getattr(self.explorer.choice, name), rel_tol=SAME, abs_tol=SAME * math.radians(STEP_PSI0)
        ):
            return
        try:
            self.explorer.update(**{name: value})
        except MicroblockError as failure:
            self.told.value = refusal(failure)
            return
        self.picture.value = self.explorer.png()
        if name != "law":
            control.continuous_update = self._paces[name].took(time.perf_counter() - start)
        # the picture is on its way: the numbers follow
        self.told.value, self.table.value = "", self.explorer.state._repr_html_()
        self._at_rest(self._show_below)

    def _compare(self, shown):
        self.explorer.compare(shown)
        self.picture.value = self.explorer.png()

    def _show_below(self):
        if self.beneath.value:
            self._draw_below()
        else:
            self.below.layout.display = "none"

    def _draw_below(self):
        try:
            self.below.value = self.explorer.state.plot_below(self.quantity.value)._repr_png_()
        except MicroblockError as failure:
            self.told.value = refusal(failure)
            return
        self.below.layout.display = ""

    def _at_rest(self, work):
        """Do it when nothing has changed for a while, so that no slider waits for it; without a kernel at
        once.
        """
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


def arranged(ipywidgets, parts, picture):
    """Widgets {part: [widget, ...]} in a box that arranges the parts by the width it is given; where no
    widgets can be, the picture is shown.
    """
    boxes = [classed(ipywidgets.Box(own), f"microblock-{name}") for name, own in parts.items()]
    within = [ipywidgets.HTML(STYLE), classed(ipywidgets.Box(boxes), "microblock-panel")]
    return classed(shown_with_still(ipywidgets)(within, picture), "microblock-explore")


def refusal(failure):
    """The line that says why there is no new state, as HTML."""
    return f"<span style='color:#a04000'>{failure}</span>"


def shown_with_still(ipywidgets):
    """A class of boxes that leave their picture, an Image, beside themselves in a notebook's output.

    The still is not shown where the widgets are, in running notebooks; in pages made by nbconvert, which have
    no kernel, and often no net to load the widgets' script from, it is what is seen.
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
