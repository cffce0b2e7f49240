"""Computes the table of the playground: states under a cylinder for sides and rotations of the blocks.

`python -m cases.playground.table` writes table.js beside this script, in some minutes. Lengths are over a_Hz
and pressures over p_Hz. curves.js interpolates in the page.

A state has the edges of the zones of A and of B, and factors. A corner that touches in
``left < x < right`` has the pressure ``sqrt((x - left) (right - x))`` times its factor. Beside the edge of
the other corner a factor goes like the square root of the distance. So a zone has two parts, with and without
the other corner. The factor of a part is a polynomial of the angle in ``x = middle - half cos(angle)``, given
at Chebyshev points.

Edges and factors are smooth in side and rotation, and cubic polynomials interpolate them.
"""

import base64
import json
from pathlib import Path

import numpy as np

import microblock as mb
from cases.hertz import P, R, a_Hz, p_Hz, problem

FILE = Path(__file__).with_name("table.js")
# Sides of blocks over a_Hz: denser where the zones of A and B meet at some rotation, since nothing is smooth
# across their meeting
ALPHAS = np.concatenate(
    [np.geomspace(0.05, 0.35, 16)[:-1], np.geomspace(0.35, 0.9, 30)[:-1], np.geomspace(0.9, 2.0, 7)]
)
COLUMNS = np.linspace(0.0, 1.0, 17)  # rotations over the largest one of a row
REACH = 0.87  # of the rotation at which the zone of A splits or vanishes: there its edges run away
NODES = 20  # of each part
RTOL = 1e-5  # of the states, a hundredth of what can be seen
LARGEST = 2**15 - 1  # whole number of two bytes
INSIDE = 1e-5  # distance from an edge, over the width of the zone, at which its factor is taken

# The picture of the page: where it draws a point, in units of the page, and how wide a line is
SIDE, SCALE_X, SCALE_P, LINE = 2.2, 175.0, 165.0, 2.5
POINTS = 48  # of a part


def parts(edges: np.ndarray, corner: int) -> list[tuple[float, float]]:
    """Returns the two parts of a corner's zone, from left to right: that in which the other corner touches
    too, and that in which it does not. Edges are (left, right) of A, then of B; A is on the right.
    """
    left_A, right_A, left_B, right_B = edges
    if corner == 0:
        meeting = max(left_A, right_B)
        return [(left_A, meeting), (meeting, right_A)]
    meeting = min(left_A, right_B)
    return [(left_B, meeting), (meeting, right_B)]


def touches_once(state: mb.State) -> bool:
    """Whether both corners touch in one zone, that of A to the right of that of B."""
    zones = state.zones
    return len(zones["A"]) == len(zones["B"]) == 1 and zones["A"][0][1] > zones["B"][0][1]


def largest_rotation(alpha: float) -> float:
    """Returns the rotation in degrees up to which the table goes."""
    below = 0.3
    above = 1.2
    while above - below > 1e-3:
        middle = (below + above) / 2
        if touches_once(problem(alpha, middle).solve(load=P, rtol=1e-3)):
            below = middle
        else:
            above = middle
    return round(REACH * below, 3)


def stored(state: mb.State) -> np.ndarray:
    """Returns edges (4,) and factors (corner, part, node) of a computed state, in one row."""
    edges = np.array([edge for corner in "AB" for edge in state.zones[corner][0]]) / a_Hz
    angles = np.pi / 2 * (1 - np.cos(np.pi * np.arange(NODES) / (NODES - 1)))
    factors = []
    for corner, name in enumerate("AB"):
        left, right = edges[2 * corner : 2 * corner + 2]
        margin = INSIDE * (right - left)
        for start, end in parts(edges, corner):
            x = start + (end - start) * (1 - np.cos(angles)) / 2
            x = np.clip(x, left + margin, right - margin)
            factors.append(state.pressure_at(x * a_Hz, name) / p_Hz / np.sqrt((x - left) * (right - x)))
    return np.concatenate([edges, *factors])


def mirrored(row: np.ndarray) -> np.ndarray:
    """Returns the row of the mirror image, in which A is B."""
    return np.concatenate([-row[3::-1], row[:3:-1]])


def row_of(alpha: float, largest: float) -> np.ndarray:
    """Returns the rows of all rotations of blocks of a side: (columns, numbers)."""
    rows = []
    state = None
    for column in COLUMNS:
        state = problem(alpha, column * largest).solve(load=P, rtol=RTOL, initial=state)
        if not touches_once(state):
            raise RuntimeError(f"zones {state.zones} at alpha = {alpha}, psi0 = {column * largest}")
        rows.append(stored(state))
    of_A = np.r_[:2, 4 : 4 + 2 * NODES]
    aligned = mirrored(rows[0])  # symmetric to the last digit
    aligned[of_A] = rows[0][of_A]
    rows[0] = aligned
    return np.array(rows)


def write() -> None:
    """Writes the table, computed anew, as a script that the page loads."""
    rotations = [largest_rotation(alpha) for alpha in ALPHAS]
    numbers = np.array([row_of(alpha, largest) for alpha, largest in zip(ALPHAS, rotations)])
    steps = (abs(numbers[..., :4]).max() / LARGEST, abs(numbers[..., 4:]).max() / LARGEST)
    whole = np.round(numbers / np.repeat(steps, [4, numbers.shape[-1] - 4]))
    facts = {
        "alphas": [float(f"{alpha:.12g}") for alpha in ALPHAS],
        "rotations": rotations,
        "columns": len(COLUMNS),
        "nodes": NODES,
        "points": POINTS,
        "steps": [float(step) for step in steps],
        "picture": [SIDE, SCALE_X, SCALE_P, LINE],
        "slope": a_Hz / R,
        "version": mb.__version__,
        "numbers": base64.b64encode(whole.astype("<i2").tobytes()).decode(),
    }
    FILE.write_text(f"const TABLE = {json.dumps(facts)};\n")


if __name__ == "__main__":
    write()
