"""Computes the table of the playground: pressures under a cylinder for sides and rotations of the blocks.

`python -m cases.playground.table` writes table.js beside this script; some minutes. Each state has, for both
corners, the ends of the zone in which the corner touches and its pressures between them, at places that
are dense near the ends. The page interpolates all of them bilinearly, and so does `interpolated`.
Lengths are over a_Hz, pressures over p_Hz.
"""

import base64
import json
import math
from pathlib import Path

import numpy as np

import microblock as mb
from cases.hertz import P, R, a_Hz, p_Hz, problem

ALPHAS = np.geomspace(0.05, 2.0, 56)
PSI0S = np.linspace(0.0, 1.1, 42)  # degrees; the mirror image has negative ones
NODES = (1 - np.cos(np.pi * np.arange(20) / 19)) / 2  # between the ends, where pressures vanish
STEP_X, STEP_P = 1 / 8000, 1 / 180  # of the whole numbers that are written, one byte for a pressure
CHECKS, SEED = 200, 1


def row(state, before):
    """Returns whole numbers of a state: for A and B both ends, then the pressures between them.

    A corner that touches nowhere has its ends where it touched before, and no pressure.
    """
    numbers = []
    for corner, ends in zip("AB", before):
        zones = state.zones[corner]
        if zones:
            ends[:] = np.array([zones[0][0], zones[-1][1]]) / a_Hz
        else:
            ends[:] = np.mean(ends)
        x = ends[0] + NODES[1:-1] * (ends[1] - ends[0])
        pressure = state.pressure_at(x * a_Hz, corner) / p_Hz if zones else 0 * x
        numbers += [*np.round(ends / STEP_X), *np.round(pressure / STEP_P)]
    return numbers


def table():
    """Returns numbers (alphas, psi0s, numbers of a state)."""
    numbers = []
    for alpha in ALPHAS:
        state, ends = None, np.zeros((2, 2))
        for psi0 in PSI0S:
            state = problem(alpha, psi0).solve(load=P, rtol=1e-3, initial=state)
            numbers.append(row(state, ends))
        print(f"alpha = {alpha:.3f}: {len(numbers)} states", flush=True)
    return np.array(numbers).reshape(len(ALPHAS), len(PSI0S), -1)


def interpolated(numbers, alpha, psi0, x):
    """Returns the pressures (2, n) of A and B at x (n,), as the page does."""
    places = np.log(alpha / ALPHAS[0]) / np.log(ALPHAS[1] / ALPHAS[0]), psi0 / PSI0S[1]
    (i, s), (j, t) = (
        (min(int(place), most - 2), place - min(int(place), most - 2))
        for place, most in zip(places, numbers.shape)
    )
    state = (1 - s) * ((1 - t) * numbers[i, j] + t * numbers[i, j + 1]) + s * (
        (1 - t) * numbers[i + 1, j] + t * numbers[i + 1, j + 1]
    )
    pressures = []
    for corner in np.split(state, 2):
        left, right = corner[:2] * STEP_X
        angle = np.arccos(np.clip(1 - 2 * (x - left) / max(right - left, STEP_X), -1, 1))
        pressures.append(np.interp(angle, np.arccos(1 - 2 * NODES), [0, *corner[2:] * STEP_P, 0]))
    return np.array(pressures)


def errors(numbers):
    """Returns errors in L2 of the pressures of both corners at random places off the table, over that of
    their sum.
    """
    random, found = np.random.default_rng(SEED), []
    for place in random.uniform(size=(CHECKS, 2)):
        alpha, psi0 = ALPHAS[0] * (ALPHAS[-1] / ALPHAS[0]) ** place[0], PSI0S[-1] * place[1]
        state = problem(alpha, psi0).solve(load=P, rtol=1e-3)
        exact = np.array([state.pressures[corner] for corner in "AB"]) / p_Hz
        error = interpolated(numbers, alpha, psi0, state.x / a_Hz) - exact
        found.append(math.sqrt((error**2).sum(0) @ state.weights / (exact.sum(0) ** 2 @ state.weights)))
    return np.array(found)


def write():
    """Writes the table with its errors, as a script that the page loads."""
    numbers = table()
    found = errors(numbers)
    corners = numbers.reshape(*numbers.shape[:2], 2, -1)
    packed = {
        name: base64.b64encode(part.tobytes()).decode()
        for name, part in (
            ("edges", corners[..., :2].astype("<i2")),
            ("pressures", corners[..., 2:].astype("u1")),
        )
    }
    facts = {
        "alphas": [float(ALPHAS[0]), float(ALPHAS[-1]), len(ALPHAS)],
        "psi0s": [float(PSI0S[-1]), len(PSI0S)],
        "nodes": len(NODES),
        "steps": [STEP_X, STEP_P],
        "checks": CHECKS,
        "error": {
            "median": float(np.median(found)),
            "most": float(np.quantile(found, 0.95)),
            "largest": float(found.max()),
        },
        "slope": a_Hz / R,
        "version": mb.__version__,
    }
    file = Path(__file__).with_name("table.js")
    file.write_text(f"const TABLE = {json.dumps(facts | packed)};\n")
    print(facts, file.stat().st_size, "bytes")


if __name__ == "__main__":
    write()
