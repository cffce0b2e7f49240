"""The playground: what its page draws, against the solver at settings of its sliders."""

import base64
import json
import shutil
import subprocess

import numpy as np
import pytest
from scipy.integrate import trapezoid

from cases.hertz import P, a_Hz, p_Hz, problem
from cases.playground import table

FACTS = json.loads(table.FILE.read_text().removeprefix("const TABLE = ").rstrip(";\n"))
FIRST = (0.25, 0.0)  # where the sliders stand when the page opens
needs_node = pytest.mark.skipif(shutil.which("node") is None, reason="no node is installed")


def settings(count, seed):
    """Random sides and rotations in degrees at which the sliders of the page can stand."""
    random = np.random.default_rng(seed)
    alphas = np.exp(random.uniform(*np.log([FACTS["alphas"][0], FACTS["alphas"][-1]]), count))
    largest = np.interp(np.log(alphas), np.log(FACTS["alphas"]), FACTS["rotations"])
    shares = random.choice((-1, -0.7, -0.2, 0, 0.4, 0.9, 1), count)
    return np.column_stack((alphas, shares * largest)).tolist()


def drawn(asked):
    """Edges, curves of A and of B, and their sum at settings, by the scripts of the page as they stand."""
    ask = f"const asked = {json.dumps(asked)}.map(([alpha, psi0]) => stateOf(alpha, psi0));"
    curves = "asked.map(state => [state.edges, outline(state, 0), outline(state, 1), total(state)])"
    script = [(table.FILE.with_name(name)).read_text() for name in ("table.js", "curves.js")]
    text = "".join([*script, ask, f"console.log(JSON.stringify({curves}))"])
    ran = subprocess.run(["node", "-"], input=text, check=True, capture_output=True, text=True, timeout=60)
    return [[np.array(part) for part in row] for row in json.loads(ran.stdout)]


@needs_node
def test_what_is_drawn_is_what_the_solver_has():
    """Every point of a curve lies between pressures of the solver a line's width to either side."""
    asked = [FIRST, *settings(24, seed=2)]
    shifts = table.LINE / table.SCALE_X * np.linspace(-1, 1, 21)
    for (alpha, psi0), (edges, *curves, _) in zip(asked, drawn(asked)):
        state = problem(alpha, psi0).solve(load=P, rtol=1e-5)
        exact = np.array([edge for corner in "AB" for edge in state.zones[corner][0]]) / a_Hz
        assert edges == pytest.approx(exact, abs=0.005)  # the page has two decimals
        for corner, curve in zip("AB", curves):
            pressures = state.pressure_at((curve[:, :1] + shifts).ravel() * a_Hz, corner) / p_Hz
            pressures = pressures.reshape(len(curve), -1)
            assert np.all(curve[:, 1] > pressures.min(axis=1) - table.LINE / table.SCALE_P)
            assert np.all(curve[:, 1] < pressures.max(axis=1) + table.LINE / table.SCALE_P)


@needs_node
def test_what_is_drawn_carries_the_load_and_is_symmetric():
    asked = settings(100, seed=3)
    mirrored = drawn([(alpha, -psi0) for alpha, psi0 in asked])
    for (edges, A, B, total), (turned, *_) in zip(drawn(asked), mirrored):
        assert edges == pytest.approx(-turned[::-1], abs=1e-14)
        assert min(A[:, 1].min(), B[:, 1].min()) >= 0
        # trapezoids leave 4e-4 beside edges
        assert trapezoid(total[:, 1], total[:, 0]) == pytest.approx(np.pi / 2, rel=2e-3)


def test_the_table_holds_what_is_computed():
    numbers = np.frombuffer(base64.b64decode(FACTS["numbers"]), "<i2").reshape(len(FACTS["alphas"]), 17, -1)
    step = np.repeat(FACTS["steps"], [4, numbers.shape[-1] - 4])
    for row, column in ((10, 0), (30, 16)):
        alpha = FACTS["alphas"][row]
        state = problem(alpha, table.COLUMNS[column] * FACTS["rotations"][row]).solve(load=P, rtol=table.RTOL)
        values = table.stored(state)
        assert numbers[row, column] * step == pytest.approx(values, abs=2e-3 * np.abs(values).max())
    assert table.mirrored(table.mirrored(values)) == pytest.approx(values)
    assert FACTS["columns"] == len(table.COLUMNS) and FACTS["nodes"] == table.NODES
