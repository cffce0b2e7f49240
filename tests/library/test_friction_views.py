"""Histories in figures, and walked step by step with sliders."""

import io

import numpy as np
import pytest

import microblock as mb
from microblock.view.friction_explorer import FrictionExplorer
from microblock.view.friction_figure import slip_and_shear

SOLID = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)
PROBLEM = mb.Contact(mb.HalfPlane(SOLID), mb.Cylinder(R=10), mb.Unilateral(friction=0.3))


@pytest.fixture(scope="module")
def explorer():
    return FrictionExplorer(PROBLEM, load=1.0)


def test_a_walk_is_the_history_of_its_steps(explorer):
    """A walk keeps its cells, a history chooses its own: both are good to some percent."""
    explorer.restart()
    for shear in (0.5, 1.0, -0.2):
        explorer.update(shear=shear)
    f = PROBLEM.law.friction
    history = PROBLEM.history([(1, 0), (1, 0.5 * f), (1, f), (1, -0.2 * f)], rtol=0.02)
    walked, followed = np.transpose(explorer.loop), np.transpose([slip_and_shear(s) for s in history.states])
    assert walked[1] == pytest.approx(followed[1], abs=1e-12)
    assert walked[0] == pytest.approx(followed[0], abs=0.03 * np.ptp(followed[0]))
    dissipated = history.states[-1].dissipation
    assert explorer.state.dissipation == pytest.approx(dissipated, rel=0.03)


def test_steps_between_change_nothing(explorer):
    """From event to event nothing is discretised along the loads: rounding is left."""
    explorer.restart()
    direct = explorer.update(shear=0.8)
    explorer.restart()
    for shear in np.linspace(0, 0.8, 9)[1:]:
        stepped = explorer.update(shear=shear)
    assert stepped.shear_traction == pytest.approx(direct.shear_traction, abs=1e-9 * direct.pressure.max())
    assert stepped.slip == pytest.approx(direct.slip, abs=1e-9 * np.abs(direct.slip).max())


@pytest.mark.parametrize("change", [{"shear": 1.1}, {"shear": float("nan")}, {"load": 1.5}, {"load": 0.0}])
def test_what_cannot_be_stepped_to_leaves_all_as_it_was(explorer, change):
    before = explorer.state
    with pytest.raises(mb.BadArgument) as caught:
        explorer.update(**change)
    assert caught.value.name == next(iter(change)) and explorer.state is before


def test_a_walk_needs_a_half_plane():
    periodic = PROBLEM.with_(body=mb.HalfPlane(SOLID, period=5.0))
    with pytest.raises(mb.BadArgument, match="without a period"):
        FrictionExplorer(periodic, load=1.0)


def test_sliders_walk_and_begin_again():
    pytest.importorskip("ipywidgets")
    import ipywidgets

    from microblock.view.friction_widgets import FrictionPanel

    panel = FrictionPanel(FrictionExplorer(PROBLEM, load=1.0), ipywidgets)
    first = panel.picture.value
    panel.controls["shear"].value = 0.5
    assert panel.explorer.shear == 0.5 and panel.picture.value != first and len(panel.explorer.loop) == 2
    panel.controls["load"].value = 0.6
    assert panel.explorer.load == pytest.approx(0.6) and len(panel.explorer.loop) == 3
    panel.again.click()
    assert panel.explorer.shear == 0 and panel.explorer.load == 1 and len(panel.explorer.loop) == 1
    assert panel.controls["shear"].value == 0


def test_explore_opens_sliders_of_shear():
    pytest.importorskip("ipywidgets")
    box = mb.explore(PROBLEM, load=1.0)
    assert "microblock-explore" in box._dom_classes
    with pytest.raises(mb.BadArgument, match="rtol"):
        mb.explore(PROBLEM, load=1.0, rtol=1e-3)


def test_a_history_is_drawn():
    """The loop has a point for each state; the traction is that of the last one."""
    history = PROBLEM.history([(1, 0), (1, 0.2), (1, 0.1)], rtol=0.1)
    drawing = history.plot()
    tractions, loop = drawing.axes
    assert len(loop.lines[0].get_xdata()) == 3
    assert tractions.lines[0].get_ydata() == pytest.approx(history.states[-1].shear_traction)
    written = io.BytesIO()
    drawing.savefig(written, format="png")
    assert len(written.getvalue()) > 5000
