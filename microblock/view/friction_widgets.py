"""Sliders for a FrictionExplorer in Jupyter."""

import math

from ..errors import MicroblockError
from .widgets import SAME, arranged, refusal

LEAST = 0.05  # of the first load: the other end of its slider
STEP = 0.01  # of f P


class FrictionPanel:
    """The widgets of one FrictionExplorer; `box` holds them all."""

    def __init__(self, explorer, ipywidgets):
        self.explorer = explorer
        self.controls = {
            "shear": ipywidgets.FloatSlider(value=0.0, min=-1.0, max=1.0, step=STEP, description="Q/(fP)"),
            "load": ipywidgets.FloatSlider(
                value=explorer.load,
                min=LEAST * explorer.load,
                max=explorer.load,
                step=STEP * explorer.load,
                description="load P",
                readout_format=".3g",
            ),
        }
        self.again = ipywidgets.Button(description="from the beginning")
        self.picture = ipywidgets.Image(value=explorer.png(), format="png")
        self.table, self.told = ipywidgets.HTML(explorer.state._repr_html_()), ipywidgets.HTML()
        for name, control in self.controls.items():
            control.observe(lambda change, name=name: self._changed(name, change["new"]), names="value")
        self.again.on_click(lambda _: self._restart())
        parts = {
            "controls": [*self.controls.values(), self.again, self.told],
            "picture": [self.picture],
            "numbers": [self.table],
        }
        self.box = arranged(ipywidgets, parts, self.picture)

    def _changed(self, name, value):
        """The next step; where there is none the picture stays and a line says why."""
        if math.isclose(value, getattr(self.explorer, name), rel_tol=SAME, abs_tol=SAME):
            return
        try:
            self.explorer.update(**{name: value})
        except MicroblockError as failure:
            self.told.value = refusal(failure)
            return
        self._show()

    def _restart(self):
        self.explorer.restart()
        for name, control in self.controls.items():
            control.value = getattr(self.explorer, name)
        self._show()

    def _show(self):
        self.told.value, self.picture.value = "", self.explorer.png()
        self.table.value = self.explorer.state._repr_html_()
