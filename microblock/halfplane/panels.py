"""Panels on the contact line, fitted to the zones, and the gaps that pressures on them leave.

Panels run ``x = e + h v^2`` from where a pressure has a square root, ``x = e + h v`` elsewhere. The unknown
is ``q = p |dx/dv|`` at Gauss points v. At a kink of the obstacle panels, with v^2 as well, carry ``p =
q/|dx/dv| + log_size log(|h|/|x - e|)`` of known size.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache, reduce
from typing import NamedTuple

import numpy as np
from scipy.special import beta, betainc, eval_legendre

from ..model.intervals import common, contains, joined, without
from ..model.problem import GROWTH, Problem, half_line
from ..model.quadrature import gauss_rule, lagrange
from ..model.types import Array, CornerZones, Flags, Integers, Interval
from .transmitted_singularities import log_sizes, singular_edges

# (problem, distance, lever of the target, lever of the source): length per force, or several of them first
Kernel = Callable[[Problem, Array, Array, Array], Array]


def orders(simple: bool, rtol: float) -> range:
    """Returns orders of panels up to the first that is expected to reach rtol."""
    ascending = range(6 if simple else 10, 27, 4)  # 6 shows nothing of rough obstacles
    enough = sum(unresolved(order) > rtol for order in ascending)
    return ascending[: max(2, enough + 1)]


def unresolved(order: int) -> float:
    """Returns the relative error that panels of an order leave under a smooth obstacle."""
    return float(10 ** -(0.55 * order + 0.7))


class Panel(NamedTuple):
    """A panel: from its anchor by a signed length, with x quadratic in the parameter or linear."""

    anchor: float
    length: float
    root: bool


@dataclass(frozen=True)
class PanelGrid:
    """Panels of all corners: numbers of the corners, anchors e, signed lengths h, whether x is quadratic in
    0 <= v <= 1, and sizes of the known logarithms, arrays (panels,).
    """

    corner: Integers
    e: Array
    h: Array
    root: Flags
    log_size: Array
    order: int

    def x(self, panel: Integers, v: Array) -> Array:
        """Returns abscissae at the parameters v."""
        return self.e[panel] + self.h[panel] * np.where(self.root[panel], v * v, v)

    def slope(self, panel: Integers, v: Array) -> Array:
        """Returns |dx/dv| at the parameters v."""
        return np.abs(self.h[panel]) * np.where(self.root[panel], 2 * v, 1.0)

    def parameter(self, panel: Integers, x: Array | float) -> Array:
        """Returns v at the abscissae x, or the nearest end."""
        along = np.clip((x - self.e[panel]) / self.h[panel], 0, 1)
        return np.where(self.root[panel], np.sqrt(along), along)

    def logarithm(self, panel: Integers, v: Array) -> Array:
        """Returns the known part of p at the parameters v > 0."""
        return -2 * self.log_size[panel] * np.log(v)

    def locate(self, corner: int, x: Array) -> tuple[Integers, Array]:
        """Returns numbers of a corner's panels at x or next to it, and the parameters, arrays (n,)."""
        numbers = np.flatnonzero(self.corner == corner)
        starts = np.minimum(self.e, self.e + self.h)[numbers]
        along = np.argsort(starts)
        position = np.searchsorted(starts[along], x, side="right") - 1
        panel = numbers[along[np.maximum(position, 0)]]
        return panel, self.parameter(panel, x)

    def interpolated(self, values: Array, panel: Integers, v: Array) -> Array:
        """Returns `values` (..., panels, order) at Gauss points, at parameters v: array (..., n)."""
        return np.einsum("nj,...nj->...n", lagrange(self.points[0], v), values[..., panel, :])

    def whole(self, problem: Problem) -> "PanelGrid":
        """Returns the panels of a Problem, with mirror images of a symmetric one."""
        if not problem.mirror:
            return self
        return PanelGrid(
            np.concatenate((self.corner, len(problem.law.corners) - 1 - self.corner)),
            np.concatenate((self.e, -self.e)),
            np.concatenate((self.h, -self.h)),
            np.tile(self.root, 2),
            np.tile(self.log_size, 2),
            self.order,
        )

    @property
    def points(self) -> tuple[Array, Array]:
        return gauss_rule(self.order)

    @cached_property
    def nodes(self) -> tuple[Integers, Array, Array, Array]:
        """Of all Gauss points: number of the panel, v, x and Gauss weight, arrays (m,)."""
        points, weights = self.points
        count = len(self.e)
        panel = np.repeat(np.arange(count), self.order)
        v = np.tile(points, count)
        return panel, v, self.x(panel, v), np.tile(weights, count)

    @property
    def rule(self) -> Array:
        """Weights for integrals over x at the nodes, array (m,), exact for logarithms."""
        panel, v, _, weights = self.nodes
        log_weights = np.tile(_log_weights(self.order), len(self.e))
        return self.slope(panel, v) * np.where(self.log_size[panel], log_weights, weights)


@lru_cache
def _log_weights(order: int) -> Array:
    """Returns Gauss weights corrected by the last Legendre polynomial for v log(v), array (order,)."""
    points, weights = gauss_rule(order)
    bend = weights * eval_legendre(order - 1, 2 * points - 1)
    values = points * np.log(points)
    return weights - bend * (weights @ values + 1 / 4) / (bend @ values)


def make_panels(problem: Problem, zones: CornerZones, order: int) -> PanelGrid:
    """Returns panels on the zones of all corners, broken at edges and slope discontinuities."""
    sizes = log_sizes(problem, zones, order)
    rows = [
        (corner, *part)
        for corner, intervals in zones.items()
        for panel in _graded(problem, zones, order, {*problem.kinks, *sizes}, intervals)
        for part in short_enough(problem, panel)
    ]
    corner, e, h, root = map(np.array, zip(*rows))
    log_size = [sizes.get(anchor, {}).get(number, 0.0) for number, anchor in zip(corner, e)]
    return PanelGrid(corner, e, h, root, np.array(log_size), order)


def panels_outside(problem: Problem, zones: CornerZones, order: int) -> PanelGrid:
    """Returns panels of corner 0 where a corner out of contact could touch."""
    touched = joined(interval for intervals in zones.values() for interval in intervals)
    free = [problem.reach]
    for left, right in reduce(common, zones.values()):
        free = without(free, left, right)
    whole = list(_graded(problem, zones, order, {*log_sizes(problem, zones, order)}, free))
    beside = contains(touched, np.array([panel.anchor + panel.length / 2 for panel in whole]))
    parts = [short_enough(problem, panel) if within else [panel] for panel, within in zip(whole, beside)]
    panels = [part for of_panel in parts for part in of_panel]
    e, h, root = np.reshape(panels, (-1, 3)).T
    return PanelGrid(np.zeros(len(e), int), e, h, root.astype(bool), np.zeros(len(e)), order)


def _graded(
    problem: Problem, zones: CornerZones, order: int, kinks: set[float], intervals: Iterable[Interval]
) -> Iterator[Panel]:
    """Yields panels on intervals, graded towards edges of the zones and slope discontinuities."""
    edges = singular_edges(problem, zones, order)
    singular = {*edges, *kinks}
    # at an apex the pressure has a power of r, perhaps below 1/2: panels bear the rest of it
    ell = problem.solid.ell
    shorter = ell * min(1.0, 8.0 ** (6 - order / 2))
    longest = {x: ell if any(jumps.values()) else shorter for x, jumps in problem.kinks.items()}
    for left, right in intervals:
        if half_line(problem) and right < 0:
            continue
        start = max(left, 0.0) if half_line(problem) else left
        breaks = sorted({start, right, *(x for x in singular if start < x < right)})
        for pair in zip(breaks, breaks[1:]):
            first = [min([longest.get(x, ell), *(abs(x - e) for e in edges if e != x)]) for x in pair]
            yield from _between(pair, [x in singular for x in pair], first)


def _between(breaks: Interval, roots: Sequence[bool], first: Sequence[float]) -> list[Panel]:
    """Returns panels between two breaks, growing from the first lengths away from those with roots."""
    left, right = breaks
    if not any(roots):
        return [Panel(left, right - left, False)]
    meet = (left + right) / 2
    if not all(roots):
        meet = left if roots[1] else right
    panels = []
    for end, sign, root, step in ((left, 1, roots[0], first[0]), (right, -1, roots[1], first[1])):
        if root:
            distances = [0.0]
            # no panel is left that is much shorter than its neighbour
            while step + (step - distances[-1]) / 2 <= abs(meet - end):
                distances.append(step)
                step *= GROWTH
            for near, far in zip(distances, [*distances[1:], abs(meet - end)]):
                panels.append(Panel(end + sign * near, sign * (far - near), near == 0.0))
    return panels


def short_enough(problem: Problem, panel: Panel) -> list[Panel]:
    """Returns parts of a panel no longer than features of the obstacle."""
    anchor, length, root = panel
    if abs(length) <= problem.scale(*sorted((anchor, anchor + length))):
        return [panel]
    half = length / 2
    return [
        *short_enough(problem, Panel(anchor, half, root)),
        *short_enough(problem, Panel(anchor + half, half, False)),
    ]


def response(
    problem: Problem,
    panels: PanelGrid,
    x: Array,
    lever: Array,
    kernel: Kernel,
    shifts: Sequence[float] = (0.0, 0.0),
) -> tuple[Array, Array]:
    """Returns integrals of a kernel against q, (n, m) or (values, n, m), and against the known logarithms,
    (n,) or (values, n), at targets x with levers, arrays (n,), that lie `shifts` farther right of the sources
    of each corner; `lever` 0 gives the normal displacement, 1 adds the rotation.
    """
    panels = panels.whole(problem)
    targets = x[:, None] + np.array(shifts)[panels.corner]
    matrix, logarithms = _responses(problem, panels, targets, lever, kernel)
    if problem.mirror:
        direct, images = np.split(matrix, 2, axis=-1)
        matrix = direct + images
    return matrix, logarithms


def _responses(
    problem: Problem, panels: PanelGrid, x: Array, target: Array, kernel: Kernel
) -> tuple[Array, Array]:
    """Returns what `response` does, of panels with mirror images and targets x, array (n, panels)."""
    panel, _, source, _ = panels.nodes
    order = panels.order
    lever = problem.lever(panels.corner[panel], source)
    values = kernel(problem, np.repeat(x, order, axis=1) - source, target[:, None], lever)
    values = values.reshape(*values.shape[:-1], len(panels.e), order)
    integrals = values * panels.points[1]
    if panels.log_size.any():
        integrals = np.concatenate((integrals, values @ _log_rule(order)[:, None]), axis=-1)
    ends = np.sort(np.array((panels.e, panels.e + panels.h)), axis=0)
    distance = np.maximum(ends[0] - x, x - ends[1])
    # farther away the nodes leave at most a tenth of what the panels do, 2e-6 at order 6, 1e-9 at 10
    row, near = np.nonzero(distance < np.abs(panels.h) * np.where(panels.log_size, 4, 0.5))
    if len(row):
        pairs = x[row, near], target[row], near
        integrals[..., row, near, :] = _near_responses(problem, panels, *pairs, kernel)
    logarithms = integrals[..., order:].sum(axis=-1) @ (panels.log_size * np.abs(panels.h))
    return integrals[..., :order].reshape(*values.shape[:-2], len(source)), logarithms


def _near_responses(
    problem: Problem, panels: PanelGrid, x: Array, target: Array, panel: Integers, kernel: Kernel
) -> Array:
    """Returns integrals over near panels, cut at the v0 nearest to the target: array (..., pairs, order, or
    one more for the logarithm), of pairs of a target x with a lever and the number of a panel, arrays
    (pairs,).
    """
    rounding = 1e-13  # a distance of cuts that the quadrature does not see
    v0 = np.rint(panels.parameter(panel, x) / rounding) * rounding
    ascending = np.argsort(v0, kind="stable")
    cuts, counts = np.unique(v0, return_counts=True)
    rules = [_cut_rule(panels.order, cut, bool(panels.log_size.any())) for cut in cuts.tolist()]
    lengths = np.array([len(rule.offsets) for rule in rules])
    pair = ascending.repeat(lengths.repeat(counts))
    offsets = np.concatenate([rule.offsets for rule, count in zip(rules, counts) for _ in range(count)])
    # x of the panel is x(v0) + offsets (slope + bend offsets)
    root = panels.root[panel]
    slope = np.where(root, 2 * v0, 1.0) * panels.h[panel]
    bend = np.where(root, panels.h[panel], 0.0)
    distance = (x - panels.x(panel, v0))[pair] - offsets * (slope[pair] + bend[pair] * offsets)
    lever = problem.lever(panels.corner[panel[pair]], panels.x(panel[pair], v0[pair] + offsets))
    values = kernel(problem, distance, target[pair], lever)
    integrals = np.empty((*values.shape[:-1], len(x), rules[0].basis.shape[1]))
    integrals[..., ascending, :] = _integrals_by_cuts(values, rules, counts)
    return integrals


class CutRule(NamedTuple):
    """Quadrature on [0, 1] for a logarithm at v0.

    Attributes
    ----------
    offsets : array (n,), v - v0
    basis : array (n, order, or one more for the logarithm at 0), weights times the polynomials
    """

    offsets: Array
    basis: Array


def _integrals_by_cuts(values: Array, rules: Sequence[CutRule], counts: Integers) -> Array:
    """Returns integrals of pairs in the order of their cuts, array (..., pairs, order or one more), from
    values at the nodes of their rules, one pair after the other: array (..., nodes).
    """
    integrals = []
    first = 0
    for rule, count in zip(rules, counts.tolist()):
        last = first + count * len(rule.offsets)
        of_cut = values[..., first:last].reshape(*values.shape[:-1], count, len(rule.offsets))
        integrals.append(of_cut @ rule.basis)
        first = last
    return np.concatenate(integrals, axis=-2)


@lru_cache(maxsize=4096)
def _cut_rule(order: int, v0: float, logs: bool) -> CutRule:
    n = 8  # v = v0 -+ length sigma^n: logarithms to rounding
    sigma, gauss = gauss_rule(2 * order + n)
    before = beyond = sigma**n, n * sigma ** (n - 1) * gauss
    if logs:  # flat at both ends
        sigma, gauss = gauss_rule(4 * order + 12)
        before = betainc(n, n, sigma), (sigma * (1 - sigma)) ** (n - 1) / beta(n, n) * gauss
    sides = [(length, *rule) for length, rule in ((1 - v0, beyond), (-v0, before)) if length]
    offsets = np.concatenate([length * powers for length, powers, _ in sides])
    weights = np.concatenate([abs(length) * part for length, _, part in sides])
    v = v0 + offsets
    basis = lagrange(gauss_rule(order)[0], v)
    if logs:  # of `PanelGrid.logarithm`, times dx/dv
        basis = np.column_stack((basis, -4 * v * np.log(np.maximum(v, np.finfo(float).tiny))))
    return CutRule(offsets, weights[:, None] * basis)


@lru_cache
def _log_rule(order: int) -> Array:
    """Returns weights of values at the nodes in the integral against the logarithm, array (order,)."""
    rule = _cut_rule(order, 0.0, True)
    return rule.basis[:, -1] @ lagrange(gauss_rule(order)[0], rule.offsets)
