"""Panels on the contact line, fitted to the zones, and the gaps that pressures on them leave.

Panels run ``x = e + h v^2`` from where a pressure has a square root, ``x = e + h v`` elsewhere. The unknown
is ``q = p |dx/dv|`` at Gauss points v. At a kink of the obstacle panels, with v^2 as well, carry ``p =
q/|dx/dv| + log_size log(|h|/|x - e|)`` of known size.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache, reduce

import numpy as np
from scipy.special import beta, betainc, eval_legendre

from ..model.intervals import common, contains, joined, without
from ..model.problem import GROWTH, half_line
from ..model.quadrature import gauss_rule, lagrange
from .transmitted_singularities import carried_edges, log_sizes


def orders(simple, rtol):
    """Orders of panels up to the first that is expected to reach rtol."""
    known = range(6 if simple else 10, 27, 4)  # 6 shows nothing of rough obstacles
    enough = sum(unresolved(order) > rtol for order in known)
    return known[: max(2, enough + 1)]


def unresolved(order):
    """Relative error that panels of an order leave under a smooth obstacle."""
    return 10 ** -(0.55 * order + 0.7)


@dataclass(frozen=True)
class PanelGrid:
    """Panels of all corners: anchors e, signed lengths h; 0 <= v <= 1."""

    corner: np.ndarray
    e: np.ndarray
    h: np.ndarray
    root: np.ndarray
    log_size: np.ndarray
    order: int

    def x(self, panel, v):
        """Abscissae at the parameters v."""
        return self.e[panel] + self.h[panel] * np.where(self.root[panel], v * v, v)

    def slope(self, panel, v):
        return np.abs(self.h[panel]) * np.where(self.root[panel], 2 * v, 1.0)

    def parameter(self, panel, x):
        """v at the abscissae x, or the nearest end."""
        along = np.clip((x - self.e[panel]) / self.h[panel], 0, 1)
        return np.where(self.root[panel], np.sqrt(along), along)

    def logarithm(self, panel, v):
        """The known part of p at the parameters v > 0."""
        return -2 * self.log_size[panel] * np.log(v)

    def at(self, corner, x):
        """Numbers of a corner's panels at x or next to it, and the parameters."""
        own = np.flatnonzero(self.corner == corner)
        starts = np.minimum(self.e, self.e + self.h)[own]
        along = np.argsort(starts)
        here = np.searchsorted(starts[along], x, side="right") - 1
        number = own[along[np.maximum(here, 0)]]
        return number, self.parameter(number, x)

    def interpolated(self, values, number, v):
        """`values` (..., panels, order) at Gauss points, at parameters v: array (..., n)."""
        return np.einsum("nj,...nj->...n", lagrange(self.points[0], v), values[..., number, :])

    def whole(self, problem):
        """The panels of a Problem, with mirror images of a symmetric one."""
        if not problem.mirror:
            return self
        images = len(problem.law.corners) - 1 - self.corner, -self.e, -self.h, self.root, self.log_size
        own = self.corner, self.e, self.h, self.root, self.log_size
        return PanelGrid(*map(np.concatenate, zip(own, images)), self.order)

    @property
    def points(self):
        return gauss_rule(self.order)

    @cached_property
    def nodes(self):
        """Of all Gauss points: number of the panel, v, x and Gauss weight, arrays (m,)."""
        points, weights = self.points
        panel, v = np.repeat(np.arange(len(self.e)), self.order), np.tile(points, len(self.e))
        return panel, v, self.x(panel, v), np.tile(weights, len(self.e))

    @property
    def rule(self):
        """Weights for integrals over x at the nodes, array (m,), exact for logarithms."""
        panel, v, _, weights = self.nodes
        return self.slope(panel, v) * np.where(
            (self.log_size != 0)[panel], np.tile(_log_weights(self.order), len(self.e)), weights
        )


@lru_cache
def _log_weights(order):
    points, weights = gauss_rule(order)
    bend = weights * eval_legendre(order - 1, 2 * points - 1)
    values = points * np.log(points)
    return weights - bend * (weights @ values + 1 / 4) / (bend @ values)


def make_panels(problem, zones, order):
    """Panels on the zones {corner: ((left, right), ...)}, broken at edges and kinks."""
    sizes = log_sizes(problem, zones, order)
    rows = [
        (corner, *part)
        for corner, intervals in zones.items()
        for row in _rows(problem, zones, order, {*problem.kinks, *sizes}, intervals)
        for part in short_enough(problem, *row)
    ]
    corner, e, h, root = map(np.array, zip(*rows))
    log_size = [sizes.get(anchor, {}).get(number, 0.0) for number, anchor in zip(corner, e)]
    return PanelGrid(corner, e, h, root, np.array(log_size), order)


def panels_outside(problem, zones, order):
    """Panels of corner 0 where a corner out of contact could touch."""
    kinks, touched = log_sizes(problem, zones, order), joined(pair for own in zones.values() for pair in own)
    rest = [problem.reach]
    for left, right in reduce(common, zones.values()):
        rest = without(rest, left, right)
    rows = []
    for anchor, length, root in _rows(problem, zones, order, {*kinks}, rest):
        beside = contains(touched, np.array([anchor + length / 2])).any()
        rows += short_enough(problem, anchor, length, root) if beside else [(anchor, length, root)]
    e, h, root = np.reshape(rows, (-1, 3)).T
    return PanelGrid(np.zeros(len(e), int), e, h, root.astype(bool), np.zeros(len(e)), order)


def _rows(problem, zones, order, kinks, intervals):
    edges = carried_edges(problem, zones, order)
    singular = {*edges, *kinks}
    # at a tip the pressure has a power of r, perhaps below 1/2: panels bear the rest of it
    shorter, ell = min(1.0, 8.0 ** (6 - order / 2)), problem.solid.ell
    longest = {x: ell if any(jumps.values()) else shorter * ell for x, jumps in problem.kinks.items()}
    for left, right in intervals:
        if half_line(problem) and right < 0:
            continue
        start = max(left, 0.0) if half_line(problem) else left
        breaks = sorted({start, right, *(x for x in singular if start < x < right)})
        for pair in zip(breaks, breaks[1:]):
            roots = tuple(x in singular for x in pair)
            first = [
                min([longest.get(x, ell), *(abs(x - edge) for edge in edges if edge != x)]) for x in pair
            ]
            yield from _between(*pair, roots, first)


def _between(left, right, roots, first):
    """(anchor, signed length, root) of panels between two breaks, growing away from singular ones."""
    if not any(roots):
        return [(left, right - left, False)]
    meet = (left + right) / 2 if all(roots) else (left if roots[1] else right)
    found = []
    for end, sign, root, width in ((left, 1, roots[0], first[0]), (right, -1, roots[1], first[1])):
        if root:
            whole, breaks, step = abs(meet - end), [0.0], width
            # no panel is left that is much shorter than its neighbour
            while step + (step - breaks[-1]) / 2 <= whole:
                breaks.append(step)
                step *= GROWTH
            for near, far in zip(breaks, [*breaks[1:], whole]):
                found.append((end + sign * near, sign * (far - near), near == 0.0))
    return found


def short_enough(problem, anchor, length, root):
    """Parts of a panel no longer than features of the obstacle."""
    if abs(length) <= problem.scale(*sorted((anchor, anchor + length))):
        return [(anchor, length, root)]
    half = length / 2
    return short_enough(problem, anchor, half, root) + short_enough(problem, anchor + half, half, False)


def response(problem, panels, x, lever, kernel, shifts=(0.0, 0.0)):
    """Integrals of a kernel against q, (n, m) or (values, n, m), and against the known logarithms, (n,) or
    (values, n); `lever` 0 gives the normal displacement, 1 adds the rotation; targets lie `shifts` farther
    right of the sources of each corner.
    """
    panels = panels.whole(problem)
    matrix, known = _block(problem, panels, x[:, None] + np.array(shifts)[panels.corner], lever, kernel)
    half = matrix.shape[-1] // 2
    return (matrix[..., :half] + matrix[..., half:] if problem.mirror else matrix), known


def _block(problem, panels, x, target, kernel):
    panel, _, source, _ = panels.nodes
    order, logs, lever = panels.order, panels.log_size.any(), problem.lever(panels.corner[panel], source)
    values = kernel(problem, np.repeat(x, order, axis=1) - source, target[:, None], lever)
    values = values.reshape(*values.shape[:-1], len(panels.e), order)
    found = values * panels.points[1]
    if logs:
        found = np.concatenate((found, values @ _log_rule(order)[:, None]), axis=-1)
    ends = np.sort(np.array((panels.e, panels.e + panels.h)), axis=0)
    distance = np.maximum(ends[0] - x, x - ends[1])
    # farther away the nodes leave at most a tenth of what the panels do, 2e-6 at order 6, 1e-9 at 10
    row, near = np.nonzero(distance < np.abs(panels.h) * np.where(panels.log_size, 4, 0.5))
    if len(row):
        found[..., row, near, :] = _near_rows(problem, panels, x[row, near], target[row], near, kernel)
    known = found[..., order:].sum(axis=-1) @ (panels.log_size * np.abs(panels.h))
    return found[..., :order].reshape(*values.shape[:-2], len(source)), known


def _near_rows(problem, panels, x, target, panel, kernel):
    """Integrals over near panels, cut at the v0 nearest to the target: array (..., pairs, order, or one more
    for the logarithm).
    """
    same = 1e-13  # a distance of cuts that the quadrature does not see
    v0 = np.rint(panels.parameter(panel, x) / same) * same
    # x of the panel is x(v0) + sides (slope + bend sides)
    root, h, start = panels.root[panel], panels.h[panel], x - panels.x(panel, v0)
    slope, bend = np.where(root, 2 * v0, 1.0) * h, np.where(root, h, 0.0)
    along = np.argsort(v0, kind="stable")
    ends = np.flatnonzero(np.diff(v0[along], append=np.inf)) + 1
    rules = [_cut_rule(panels.order, cut, panels.log_size.any()) for cut in v0[along[ends - 1]].tolist()]
    sizes, counts = np.array([len(steps) for steps, _ in rules]), np.diff(ends, prepend=0)
    pair = along.repeat(sizes.repeat(counts))
    sides = np.concatenate([steps[None].repeat(count, 0).ravel() for (steps, _), count in zip(rules, counts)])
    lever = problem.lever(panels.corner[panel[pair]], panels.x(panel[pair], v0[pair] + sides))
    values = kernel(problem, start[pair] - sides * (slope[pair] + bend[pair] * sides), target[pair], lever)
    found, done = np.empty((*values.shape[:-1], len(x), rules[0][1].shape[1])), 0
    for (steps, basis), end, count in zip(rules, ends, counts):
        part = values[..., done : done + count * len(steps)].reshape(*values.shape[:-1], count, -1)
        found[..., along[end - count : end], :] = part @ basis
        done += count * len(steps)
    return found


@lru_cache(maxsize=4096)
def _cut_rule(order, v0, logs):
    """Quadrature on [0, 1] for a logarithm at v0: v - v0, (n,), and weights times the basis, array (n, order,
    or one more for the logarithm at 0).
    """
    n = 8  # v = v0 -+ length sigma^n: logarithms to rounding
    sigma, gauss = gauss_rule(2 * order + n)
    before = beyond = sigma**n, n * sigma ** (n - 1) * gauss
    if logs:  # flat at both ends
        sigma, gauss = gauss_rule(4 * order + 12)
        before = betainc(n, n, sigma), (sigma * (1 - sigma)) ** (n - 1) / beta(n, n) * gauss
    parts = [(length, *rule) for length, rule in ((1 - v0, beyond), (-v0, before)) if length]
    sides = np.concatenate([length * steps for length, steps, _ in parts])
    weights, v = np.concatenate([abs(length) * part for length, _, part in parts]), v0 + sides
    basis = lagrange(gauss_rule(order)[0], v)
    if logs:  # of `Panels.logarithm`, times dx/dv
        basis = np.column_stack((basis, -4 * v * np.log(np.maximum(v, np.finfo(float).tiny))))
    return sides, weights[:, None] * basis


@lru_cache
def _log_rule(order):
    v, basis = _cut_rule(order, 0.0, True)
    return basis[:, -1] @ lagrange(gauss_rule(order)[0], v)
