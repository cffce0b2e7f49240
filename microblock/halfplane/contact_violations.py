"""The conditions (26) on a fitted state, wherever a corner could touch.

Displacement and rotation are interpolated out of contact on panels. Overlaps are those of
`microblock.model.missed_contact`.
"""

from collections.abc import Iterator

import numpy as np
from numpy.polynomial.legendre import legvander

from ..contact_solvers.rounding import EPS_TERM
from ..errors import BadArgument
from ..model.intervals import borders, contains, local_minima, runs
from ..model.missed_contact import Violation, log_tension, overlaps
from ..model.problem import Problem, half_line
from ..model.types import Array
from .panel_solution import PanelSolution
from .panels import panels_outside


def contact_violations(state: PanelSolution) -> list[Violation]:
    """Returns the Violations of a state; raises BadArgument if the obstacle could touch where no contact was
    expected.
    """
    problem = state.problem
    outside = _OutOfContact(state)
    # a violation that is computed stands for its mirror image, too
    size = np.sqrt(state.weights @ state.tractions.sum(axis=0) ** 2 / (2 if problem.mirror else 1))
    violations = [*_tensile(state, size), *_at_valleys(state, size)]
    for corner in problem.corners:
        violations += _overlaps(state, corner, _gaps(state, outside, corner), problem.E_star / size)
        if outside.reaches_high_places(corner):
            raise BadArgument(
                "obstacle",
                problem.obstacle,
                f"could touch at load {state.load:g} where it is too high for that under a classical "
                "half-plane",
            )
    return violations


class _OutOfContact:
    """Changes of the gaps of a state out of contact, interpolated on panels."""

    def __init__(self, state: PanelSolution) -> None:
        self.problem: Problem = state.problem
        self.panels = panels_outside(state.problem, state.zones, 10)
        points, weights = self.panels.points
        x = self.panels.nodes[2]
        order = self.panels.order
        u, psi = state.displacement_and_rotation(x)
        rises = [u - state.approach + state.counter_displacement(x - shift) for shift in self.problem.shifts]
        self._values = np.reshape((*rises, self.problem.ell / 2 * psi), (len(rises) + 1, -1, order))
        # the last terms of a Legendre series are the error of the others
        last = np.arange(order - 2, order)
        series = (2 * last + 1) * weights[:, None] * legvander(2 * points - 1, order - 1)[:, -2:]
        self._noise = 4 * np.abs(self._values @ series).sum(axis=(0, 2))

    def __call__(self, corner: int, x: Array) -> tuple[Array, Array]:
        """Returns changes of the gaps, and their errors, at x out of contact: arrays (n,)."""
        panel, v = self.panels.locate(0, x)
        rise, phi = self.panels.interpolated(self._values[[corner, -1]], panel, v)
        return rise + self.problem.lever(np.full(len(x), corner), x) * phi, self._noise[panel]

    def gaps(self, corner: int, x: Array) -> Array:
        """Returns x, gaps there and their errors, array (3, n)."""
        rise, noise = self(corner, x)
        return np.array((x, self.problem.initial_gap(np.full(len(x), corner), x) + rise, noise))

    def places(self, corner: int) -> Array:
        """Returns contact points to look at, array (n,), ascending."""
        count = 4 * self.panels.order
        panel = np.repeat(np.arange(len(self.panels.e)), count)
        even = self.panels.x(panel, np.resize((np.arange(count) + 0.5) / count, len(panel)))
        sample_points = self.problem.sample_points(corner)
        inside = (sample_points > even.min(initial=np.inf)) & (sample_points < even.max(initial=-np.inf))
        return np.union1d(even, sample_points[inside])

    def reaches_high_places(self, corner: int) -> bool:
        """Returns whether a corner could touch where no contact was expected."""
        x = self.places(corner)
        shift = self.problem.shifts[corner]
        x = x[~contains(np.add(self.problem.candidates.stretches, shift), x)]
        rise, noise = self(corner, x)
        return bool(np.any(self.problem.candidates.allowed(x - shift) + rise < -noise))


def _gaps(state: PanelSolution, outside: _OutOfContact, corner: int) -> Array:
    """Returns places, ascending, gaps, nan at edges of zones, and their errors: array (3, n)."""
    zones = state.zones[corner]
    places = outside.places(corner)
    edges = np.full((3, 2 * len(zones)), np.nan)
    edges[0] = np.ravel(zones)
    rows = np.concatenate((outside.gaps(corner, places[~contains(zones, places)]), edges), axis=1)
    for _ in range(4):
        rows = rows[:, np.argsort(rows[0], kind="stable")]
        x, gaps, _ = rows
        least = local_minima(gaps)
        # what a parabola through three neighbours, and twice that, may fall below the middle one
        above = np.maximum(gaps[least - 1], gaps[least + 1])
        least = least[above - gaps[least] > np.maximum(gaps[least], _rounding(state))]
        if not len(least):
            break
        finer = np.linspace(x[least - 1], x[least + 1], 9).ravel()
        rows = np.concatenate((rows, outside.gaps(corner, np.setdiff1d(finer, x))), axis=1)
    return rows[:, np.argsort(rows[0], kind="stable")]


def _rounding(state: PanelSolution) -> float:
    """Returns gaps (length) that are sums of larger terms."""
    return float(EPS_TERM * (abs(state.approach) + state.load / state.problem.E_star))


def _overlaps(state: PanelSolution, corner: int, rows: Array, unit: float) -> Iterator[Violation]:
    """Returns the overlaps of `_gaps`, array (3, n), worth `unit` as of `overlaps`."""
    x, gaps, noise = rows
    doubtful = np.abs(gaps) < noise
    if doubtful.any():
        gaps[doubtful] = state.gap(corner, x[doubtful])
    least = _rounding(state)
    for first, last in runs(gaps < -least):
        beside = [max(first - 1, 0), min(last + 1, len(x) - 1)]
        # next to an edge, where the gap begins with 0
        if doubtful[first : last + 1].all() and np.isnan(gaps[beside]).any():
            gaps[first : last + 1] = np.nan
    return overlaps(corner, x, gaps, unit, least)


def _tensile(state: PanelSolution, size: float) -> Iterator[Violation]:
    """Yields intervals of nodes in tension, worth their part of a norm of the pressure."""
    for corner in state.problem.corners:
        for zone in state.zones[corner]:
            left = max(zone[0], 0.0) if half_line(state.problem) else zone[0]
            inside = (left <= state.x) & (state.x <= zone[1])
            p = state.tractions[corner, inside]
            squares = state.weights[inside] * p**2
            edges = borders(state.x[inside], left, zone[1]).tolist()
            for first, last in runs(p < 0):
                worth = np.sqrt(squares[first : last + 1].sum()) / size
                yield Violation(corner, edges[first], edges[last + 1], 0.0, float(worth))


def _at_valleys(state: PanelSolution, size: float) -> Iterator[Violation]:
    """Yields tension beside slope discontinuities, where ``p = A + K log(|h|/r)`` with K < 0."""
    panels = state.panels
    v = panels.points[0][:1]
    valleys = np.flatnonzero(panels.log_size < 0)
    smooth = state.q[valleys * panels.order] / panels.slope(valleys, v)
    hidden = smooth + panels.logarithm(valleys, v) > 0  # else the nodes show it
    for panel, A in zip(valleys[hidden], smooth[hidden]):
        r0, worth = log_tension(abs(panels.h[panel]), A, panels.log_size[panel])
        end = float(panels.e[panel] + np.copysign(r0, panels.h[panel]))
        left, right = sorted((float(panels.e[panel]), end))
        yield Violation(int(panels.corner[panel]), left, right, 0.0, worth / size)
