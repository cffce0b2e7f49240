"""The playground: what its page draws, against the solver at settings of its sliders."""

import json
import shutil
import subprocess

import numpy as np
import pytest

from cases.hertz import P, a_Hz, p_Hz, problem
from cases.playground import table as playground

TABLE, FACTS = playground.read()
FIRST = (0.25, 0.0)  # where the sliders stand when the page opens
SETTINGS = [FIRST, *playground.settings(TABLE, 49, seed=2)]
# 1/300 of the height of the picture, 475, over the width of a line
SEEN = 475 / 300 / playground.LINE


def test_what_is_drawn_is_what_the_solver_has():
    """Every curve, point by point at 50 settings, and the edges of all zones."""
    errors = np.array([playground.errors(TABLE, *setting) for setting in SETTINGS])
    assert errors[:, 0].max() < SEEN
    # the page has two decimals
    assert errors[:, 1].max() < 0.005
    # what the page says of its errors was measured at other settings: a half is left to chance
    assert errors[:, 0].max() < 1.5 * FACTS["distance"]["largest"]
    assert np.median(errors[:, 0]) < 1.5 * FACTS["distance"]["median"]
    assert FACTS["distance"]["largest"] < SEEN


def test_symmetric_problems_are_symmetric():
    for alpha in np.geomspace(0.05, 2.0, 31):
        state = TABLE.state(alpha, 0.0)
        x = np.linspace(-2, 2, 801)
        # to rounding: the numbers of B are those of A
        assert state.edges == pytest.approx(-state.edges[::-1], abs=1e-14)
        assert state.pressure(0, x) == pytest.approx(state.pressure(1, -x), abs=1e-9)
        turned = TABLE.state(alpha, -0.2)
        assert turned.pressure(0, x) == pytest.approx(TABLE.state(alpha, 0.2).pressure(1, -x), abs=1e-9)


def test_what_is_drawn_carries_the_load():
    """At 300 settings, without the solver: the sum under both curves, over that of Hertz."""
    x = np.linspace(-playground.SIDE, playground.SIDE, 881)
    for alpha, psi0 in playground.settings(TABLE, 300, seed=3):
        state = TABLE.state(alpha, psi0)
        pressure = state.pressure(0, x) + state.pressure(1, x)
        assert pressure.min() >= 0
        # the rule of rectangles leaves 4e-4 beside edges
        assert pressure.sum() * (x[1] - x[0]) == pytest.approx(np.pi / 2, rel=1e-3)


def test_the_first_setting_has_no_false_peak():
    """It had one of .74 at .58, where the pressure of A falls, and the zone of B began at -1.04."""
    drawn, state = TABLE.state(*FIRST), problem(*FIRST).solve(load=P, rtol=1e-5)
    x = np.linspace(0.45, 0.7, 51)
    exact = state.pressure_at(x * a_Hz, "A") / p_Hz
    # a curve may be as far as a line is wide, and its slope here is up to 20 just left of .51
    assert drawn.pressure(0, x) == pytest.approx(exact, abs=0.005)
    assert abs(x[np.argmax(drawn.pressure(0, x))] - x[np.argmax(exact)]) < 0.011
    assert [f"{edge:.2f}" for edge in drawn.edges] == ["-0.51", "1.05", "-1.05", "0.51"]


@pytest.mark.skipif(shutil.which("node") is None, reason="no node is installed")
def test_the_page_computes_the_same():
    """Its script is evaluated as it stands."""
    folder = playground.FILE.parent
    ask = f"const asked = {json.dumps(SETTINGS)}.map(([alpha, psi0]) => stateOf(alpha, psi0));"
    curves = "asked.map(state => [outline(state, 0), outline(state, 1), total(state)])"
    tell = f"console.log(JSON.stringify({curves}))"
    script = (folder / "table.js").read_text() + (folder / "curves.js").read_text() + ask + tell
    ran = subprocess.run(["node", "-"], input=script, check=True, capture_output=True, text=True, timeout=60)
    for (alpha, psi0), (A, B, total) in zip(SETTINGS, json.loads(ran.stdout)):
        state = TABLE.state(alpha, psi0)
        for corner, curve in enumerate((A, B)):
            # the order of sums differs, and arccos of places beside an edge loses half of the digits
            assert np.array(curve) == pytest.approx(state.outline(corner), abs=1e-6)
        x, both = np.array(total).T
        assert both == pytest.approx(state.pressure(0, x) + state.pressure(1, x), abs=1e-6)
