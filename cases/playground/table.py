"""Computes the table of the playground: states under a cylinder for sides and rotations of the blocks.

`python -m cases.playground.table` writes table.js beside this script, in some minutes. Lengths are over a_Hz
and pressures over p_Hz. curves.js does in the page what `Table` and `Interpolated` do here.

A state has the edges of the zones of A and of B, and factors. A corner that touches in
``left < x < right`` has the pressure ``sqrt((x - left) (right - x))`` times its factor. Beside the edge of
the other corner a factor goes like the square root of the distance. So a zone has two parts, with and without
the other corner. The factor of a part is a polynomial of the angle in ``x = middle - half cos(angle)``, given
at Chebyshev points.

Edges and factors are smooth in side and rotation, and cubic polynomials interpolate them.
"""

import base64
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import BarycentricInterpolator

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
WHOLE = 2**15 - 1  # the largest whole number of two bytes
INSIDE = 1e-5  # distance from an edge, over the width of the zone, at which its factor is taken
CHECKS, SEED = 1000, 1

# The picture of the page: where it draws a point, in units of the page, and how wide a line is
SIDE, SCALE_X, SCALE_P, LINE = 2.2, 175.0, 165.0, 2.5
POINTS = 48  # of a part


def angles(count: int) -> np.ndarray:
    """Returns Chebyshev points (count,) of 0 to pi, with both ends."""
    return np.pi / 2 * (1 - np.cos(np.pi * np.arange(count) / (count - 1)))


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


@dataclass(frozen=True)
class Interpolated:
    """A state of the table: edges (4,), and factors (corner, part, node)."""

    edges: np.ndarray
    factors: np.ndarray

    def mirrored(self) -> "Interpolated":
        """Returns the mirror image, in which A is B."""
        return Interpolated(-self.edges[::-1], self.factors[::-1, ::-1, ::-1])

    def pressure(self, corner: int, x: np.ndarray) -> np.ndarray:
        """Returns the pressures (n,) of a corner, 0 for A and 1 for B, at x (n,)."""
        left, right = self.edges[2 * corner : 2 * corner + 2]
        pressure = np.zeros(len(x))
        for (start, end), values in zip(parts(self.edges, corner), self.factors[corner]):
            inside = (x >= start) & (x <= end) & (x > left) & (x < right)
            if start < end and inside.any():
                place = x[inside]
                angle = np.arccos(np.clip(1 - 2 * (place - start) / (end - start), -1, 1))
                factor = BarycentricInterpolator(angles(NODES), values)(angle)
                pressure[inside] = np.sqrt((place - left) * (right - place)) * factor
        return pressure

    def outline(self, corner: int) -> np.ndarray:
        """Returns the points (n, 2), x and pressure, between which the page draws straight lines."""
        inside = [points_of(start, end, POINTS) for start, end in parts(self.edges, corner) if start < end]
        x = np.concatenate([[-SIDE], *inside, [SIDE]])
        return np.column_stack([x, self.pressure(corner, x)])


def points_of(start: float, end: float, count: int) -> np.ndarray:
    """Returns count + 1 places from start to end, dense at both."""
    return start + (end - start) * (1 - np.cos(np.pi * np.arange(count + 1) / count)) / 2


def touches_once(state: mb.State) -> bool:
    """Whether both corners touch in one zone, that of A to the right of that of B."""
    zones = state.zones
    return len(zones["A"]) == len(zones["B"]) == 1 and zones["A"][0][1] > zones["B"][0][1]


def largest_rotation(alpha: float) -> float:
    """Returns the rotation in degrees up to which the table goes."""
    below, above = 0.3, 1.2
    while above - below > 1e-3:
        middle = (below + above) / 2
        if touches_once(problem(alpha, middle).solve(load=P, rtol=1e-3)):
            below = middle
        else:
            above = middle
    return round(REACH * below, 3)


def stored(state: mb.State) -> Interpolated:
    """Returns edges and factors of a computed state."""
    edges = np.array([edge for corner in "AB" for edge in state.zones[corner][0]]) / a_Hz
    factors = np.empty((2, 2, NODES))
    for corner in (0, 1):
        left, right = edges[2 * corner : 2 * corner + 2]
        margin = INSIDE * (right - left)
        for part, (start, end) in enumerate(parts(edges, corner)):
            x = start + (end - start) * (1 - np.cos(angles(NODES))) / 2
            x = np.clip(x, left + margin, right - margin)
            pressure = state.pressure_at(x * a_Hz, "AB"[corner]) / p_Hz
            factors[corner, part] = pressure / np.sqrt((x - left) * (right - x))
    return Interpolated(edges, factors)


@dataclass(frozen=True)
class Table:
    """Sides (rows,), largest rotations in degrees (rows,), whole numbers (rows, columns, numbers), and the
    steps of edges and of factors that they count.
    """

    alphas: np.ndarray
    rotations: np.ndarray
    numbers: np.ndarray
    steps: tuple[float, float]

    def largest_rotation(self, alpha: float) -> float:
        """Returns the largest rotation in degrees of blocks of that side."""
        return float(np.interp(np.log(alpha), np.log(self.alphas), self.rotations))

    def state(self, alpha: float, psi0: float) -> Interpolated:
        """Returns the state of blocks of side alpha that are rotated by psi0 degrees."""
        if psi0 < 0:
            return self.state(alpha, -psi0).mirrored()
        row, row_weights = cubic(np.log(self.alphas), np.log(alpha))
        column, column_weights = cubic(COLUMNS, psi0 / self.largest_rotation(alpha))
        cell = self.numbers[row : row + 4, column : column + 4]
        numbers = np.einsum("i,j,ijk", row_weights, column_weights, cell)
        step_edge, step_factor = self.steps
        return Interpolated(numbers[:4] * step_edge, numbers[4:].reshape(2, 2, NODES) * step_factor)


def cubic(nodes: np.ndarray, place: float) -> tuple[int, np.ndarray]:
    """Returns the first of the four nodes about a place, and their weights in the cubic polynomial."""
    first = int(np.clip(np.searchsorted(nodes, place) - 2, 0, len(nodes) - 4))
    four = nodes[first : first + 4]
    weights = [
        np.prod([(place - other) / (node - other) for other in four if other != node]) for node in four
    ]
    return first, np.array(weights)


def computed() -> Table:
    """Returns the table, computed anew."""
    rotations = np.array([largest_rotation(alpha) for alpha in ALPHAS])
    rows = []
    for alpha, largest in zip(ALPHAS, rotations):
        state, row = None, []
        for column in COLUMNS:
            state = problem(alpha, column * largest).solve(load=P, rtol=RTOL, initial=state)
            if not touches_once(state):
                raise RuntimeError(f"zones {state.zones} at alpha = {alpha}, psi0 = {column * largest}")
            values = stored(state)
            if column == 0:  # symmetric to the last digit
                mirrored = values.mirrored()
                values = Interpolated(
                    np.r_[values.edges[:2], mirrored.edges[2:]],
                    np.stack([values.factors[0], mirrored.factors[1]]),
                )
            row.append(np.r_[values.edges, values.factors.ravel()])
        rows.append(row)
        print(f"alpha = {alpha:.3f}: up to {largest} degrees", flush=True)
    numbers = np.array(rows)
    steps = (abs(numbers[..., :4]).max() / WHOLE, abs(numbers[..., 4:]).max() / WHOLE)
    step = np.repeat(steps, [4, numbers.shape[-1] - 4])
    return Table(ALPHAS, rotations, np.round(numbers / step), steps)


def read() -> tuple[Table, dict[str, Any]]:
    """Returns the table of table.js, and all that the page knows of it."""
    facts = json.loads(FILE.read_text().removeprefix("const TABLE = ").rstrip(";\n"))
    numbers = np.frombuffer(base64.b64decode(facts["numbers"]), "<i2").astype(float)
    alphas, rotations = np.array(facts["alphas"]), np.array(facts["rotations"])
    numbers = numbers.reshape(len(alphas), len(COLUMNS), -1)
    return Table(alphas, rotations, numbers, tuple(facts["steps"])), facts


def settings(table: Table, count: int, seed: int) -> list[tuple[float, float]]:
    """Returns random sides and rotations in degrees at which the sliders of the page can stand."""
    random = np.random.default_rng(seed)
    low, high = table.alphas[[0, -1]]
    drawn = []
    for number in range(count):
        alpha = low * (high / low) ** (0.002 * random.integers(0, 501))
        steps = int(table.largest_rotation(alpha) / 0.005)
        step = random.integers(-steps, steps + 1)
        if number % 10 == 0:  # symmetric
            step = 0
        elif number % 5 == 0:  # the end of the slider
            step = steps
        drawn.append((alpha, 0.005 * step))
    return drawn


def distances(points: np.ndarray, line: np.ndarray) -> np.ndarray:
    """Returns the distances (n,) of points (n, 2) from the straight lines between the points of a line."""
    start, way = line[:-1], np.diff(line, axis=0)
    length = (way**2).sum(1)
    offset = points[:, None] - start
    share = np.clip((offset * way).sum(2) / np.where(length > 0, length, 1), 0, 1)
    return np.sqrt(((offset - share[..., None] * way) ** 2).sum(2).min(1))


def errors(table: Table, alpha: float, psi0: float) -> tuple[float, float]:
    """Returns the largest distance of the curves that are drawn from those of the solver, both ways and in
    widths of a line, and the largest error of an edge over a_Hz.
    """
    state = problem(alpha, psi0).solve(load=P, rtol=RTOL)
    edges = np.array([edge for corner in "AB" for edge in state.zones[corner][0]]) / a_Hz
    drawn = table.state(alpha, psi0)
    scale = np.array([SCALE_X, SCALE_P])
    distance = 0.0
    for corner in (0, 1):
        pieces = [points_of(start, end, 3 * POINTS) for start, end in parts(edges, corner)]
        x = np.concatenate([[-SIDE], *pieces, [SIDE]])
        exact = np.column_stack([x, state.pressure_at(x * a_Hz, "AB"[corner]) / p_Hz]) * scale
        outline = drawn.outline(corner) * scale
        distance = max(distance, distances(exact, outline).max(), distances(outline, exact).max())
    return distance / LINE, float(abs(drawn.edges - edges).max())


def write(table: Table) -> None:
    """Writes a table with its errors, as a script that the page loads."""
    checks = np.array([errors(table, *setting) for setting in settings(table, CHECKS, SEED)])
    facts = {
        "alphas": [float(f"{alpha:.12g}") for alpha in table.alphas],
        "rotations": table.rotations.tolist(),
        "columns": len(COLUMNS),
        "nodes": NODES,
        "points": POINTS,
        "steps": [float(step) for step in table.steps],
        "picture": [SIDE, SCALE_X, SCALE_P, LINE],
        "checks": CHECKS,
        "distance": {"median": float(np.median(checks[:, 0])), "largest": float(checks[:, 0].max())},
        "edge": float(checks[:, 1].max()),
        "slope": a_Hz / R,
        "version": mb.__version__,
    }
    numbers = base64.b64encode(table.numbers.astype("<i2").tobytes()).decode()
    FILE.write_text(f"const TABLE = {json.dumps(facts | {'numbers': numbers})};\n")
    print(facts, FILE.stat().st_size, "bytes")


if __name__ == "__main__":
    write(computed())
