"""Panels on the contact line, fitted to the zones of each corner, and the gaps that pressures on them leave.

A corner's pressure lives on intervals of the contact point x. It starts like the square root of the distance
from its own edges, and has a square root on one side of the other corner's edges: panels break at all of them and
run ``x = e + h v^2`` from there. The unknown on a panel is ``q = p |dx/dv|`` at Gauss points v.
"""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from .halfplane import gauss_rule, kernels

NEAR = 1.0           # panel lengths within which the kernel's logarithm asks for a quadrature of its own
CLUSTER = 8          # which puts its points at v0 -+ length sigma^8: logarithms to rounding with 2 order + 8 points
GROWTH = 4.0         # of panels away from an edge
SAME = 1e-13          # cuts of a panel this near to each other are one: the quadrature does not see it
SLIVER = 1e-9        # of a length, that rounding may leave of it
FIRST = 1.0          # length of a panel at an edge, over ell


@dataclass(frozen=True)
class Line:
    """The problem on the line: solid, law and obstacle, in one place.

    `mirror`: obstacle and blocks are symmetric about x = 0; then the first corner alone is computed, on x >= 0 if
    the law has one corner only.
    """

    solid: object
    law: object
    obstacle: object
    mirror: bool = False

    @property
    def corners(self):
        """Numbers of the corners that are computed."""
        return range(1 if self.mirror else len(self.law.corners))

    def lever(self, corner, x):
        """Levers of (29) for corner numbers and abscissae of the same shape."""
        if self.law.clamps_rotation:
            return np.zeros(np.shape(x))
        values = list(self.law.levers(np.asarray(x)).values())
        return values[0] if len(values) == 1 else np.where(corner == 0, *values)

    def initial_gap(self, corner, x):
        """Initial gaps of the corners numbered `corner` at x, arrays (n,)."""
        points = np.column_stack((x, np.zeros_like(x)))
        normals = np.tile([0.0, 1.0], (len(x), 1))
        values = list(self.law.initial_gaps(points, normals, self.solid.ell, self.obstacle).values())
        return values[0] if len(values) == 1 else np.where(corner == 0, *values)

    def kernel(self, distance, target, source):
        """Gap of a corner with lever `target` under a unit force on one with lever `source` (length/force)."""
        table = kernels(self.solid.nu, self.solid.beta, self.solid.curvature)
        scaled, c = distance/self.solid.ell, (1 - self.solid.nu)/self.solid.mu
        if self.law.clamps_rotation:
            return c*table(scaled, (3,))[0]
        if len(self.law.corners) == 1:
            U, V = table(scaled, (0, 1)) if np.any(target) else (table(scaled, (0,))[0], 0.0)
            return c*(U + target*V)
        U, V, W = table(scaled)
        return c*(U + target*source*W + (target - source)*V)


    def clamping_kernel(self, distance, target, source):
        """M that holds psi = 0 under a unit force (dimensionless); the levers play no part."""
        table = kernels(self.solid.nu, self.solid.beta, self.solid.curvature)
        return -table(distance/self.solid.ell, (4,))[0]/2      # m = 2 M/ell, and the kernel of m is over ell


@dataclass(frozen=True)
class Panels:
    """Panels of all corners: anchors e and signed lengths h, ``x = e + h v^2`` (root) or ``e + h v``, 0 <= v <= 1."""

    corner: np.ndarray
    e: np.ndarray
    h: np.ndarray
    root: np.ndarray
    order: int

    def x(self, panel, v):
        """Abscissae at the parameters v of the panels numbered `panel`."""
        return self.e[panel] + self.h[panel]*np.where(self.root[panel], v*v, v)

    def slope(self, panel, v):
        """|dx/dv|."""
        return np.abs(self.h[panel])*np.where(self.root[panel], 2*v, 1.0)

    def mirrored(self):
        """The panels of the other corner by symmetry."""
        return replace(self, corner=1 - self.corner, e=-self.e, h=-self.h)

    @property
    def points(self):
        """Gauss points and weights of v on one panel."""
        return gauss_rule(self.order)

    @property
    def nodes(self):
        """Of all Gauss points: number of the panel, v, x and Gauss weight, arrays (m,)."""
        points, weights = self.points
        panel, v = np.repeat(np.arange(len(self.e)), self.order), np.tile(points, len(self.e))
        return panel, v, self.x(panel, v), np.tile(weights, len(self.e))


def zone_edges(zones):
    """All edges of {corner: ((left, right), ...)}, ascending."""
    return sorted({edge for intervals in zones.values() for interval in intervals for edge in interval})


def make_panels(line, zones, kinks, order):
    """Panels on the zones {corner: ((left, right), ...)}, broken at all edges and at the kinks of the obstacle."""
    rows, edges = [], zone_edges(zones)
    if line.mirror:
        edges += [-edge for edge in edges]
    for corner, intervals in zones.items():
        for left, right in intervals:
            start = 0.0 if half_line(line) else left
            breaks = sorted({start, right, *(x for x in (*edges, *kinks) if start < x < right)})
            for pair in zip(breaks, breaks[1:]):
                roots = tuple(x in edges or x in kinks for x in pair)
                first = tuple(min([FIRST*line.solid.ell, *(abs(x - edge) for edge in edges if edge != x)]) for x in pair)
                rows += [(corner, *row) for row in _between(*pair, roots, first)]
    corner, e, h, root = zip(*rows)
    return Panels(np.array(corner), np.array(e), np.array(h), np.array(root), order)


def half_line(line):
    """Whether the one corner of a symmetric problem is computed on x >= 0 only."""
    return line.mirror and len(line.law.corners) == 1


def _between(left, right, roots, first):
    """Panels between two breaks, growing away from those with a square root: (anchor, signed length, root).

    The first at a break is as long as `first` says: no longer than ell, nor than the way to the next edge.
    """
    if not any(roots):
        return [(left, right - left, False)]
    meet = (left + right)/2 if all(roots) else (left if roots[1] else right)
    found = []
    for end, sign, root, width in ((left, 1, roots[0], first[0]), (right, -1, roots[1], first[1])):
        if not root:
            continue
        whole, done, start = abs(meet - end), 0.0, width
        while whole - done > SLIVER*whole:
            # no panel is left that is much shorter than its neighbour
            if whole - done - width < width/2:
                width = whole - done
            found.append((end + sign*done, sign*width, done == 0.0))
            done += width
            width *= GROWTH if done > start else GROWTH - 1
    return found


def gap_matrix(line, panels, x, corner):
    """Gaps of corners at x (arrays (n,)) from q at the Gauss points of the panels: array (n, m)."""
    return response(line, panels, x, line.lever(corner, x), line.kernel)


def response(line, panels, x, lever, kernel):
    """Integrals of a kernel of the line against q: array (n, m). `lever` 0 gives the sinking, 1 adds the turning."""
    matrix = _block(line, panels, x, lever, kernel)
    if line.mirror:
        matrix = matrix + _block(line, panels.mirrored(), x, lever, kernel)
    return matrix


def _block(line, panels, x, target, kernel):
    panel, _, source, weights = panels.nodes
    lever = line.lever(panels.corner[panel], source)
    matrix = kernel(x[:, None] - source, target[:, None], lever)*weights
    ends = np.sort(np.array((panels.e, panels.e + panels.h)), axis=0)
    distance = np.maximum(ends[0] - x[:, None], x[:, None] - ends[1])
    row, near = np.nonzero(distance < NEAR*np.abs(panels.h))
    columns = near[:, None]*panels.order + np.arange(panels.order)
    if len(row):
        matrix[row[:, None], columns] = _near_rows(line, panels, x[row], target[row], near, kernel)
    return matrix


def _near_rows(line, panels, x, target, panel, kernel):
    """Integrals of the kernel against the basis of a near panel: array (pairs, order).

    The panel is cut at the parameter v0 nearest to the target, and ``v = v0 -+ length sigma^CLUSTER`` flattens
    the logarithm on either side. Few values of v0 occur: the ends, and the Gauss points of panels that coincide.
    """
    along = np.clip((x - panels.e[panel])/panels.h[panel], 0, 1)
    cut = np.rint(np.where(panels.root[panel], np.sqrt(along), along)/SAME)
    by_cut = np.argsort(cut, kind="stable")
    cuts, starts = np.unique(cut[by_cut], return_index=True)
    groups = np.split(by_cut, starts[1:])
    rules = [_cut_rule(panels.order, float(each)*SAME) for each in cuts]
    sides = [np.broadcast_to(rule.sides, (len(group), len(rule.sides))).ravel() for rule, group in zip(rules, groups)]
    counts = np.concatenate([np.full(len(group), len(rule.sides)) for rule, group in zip(rules, groups)])
    sides, v0 = np.concatenate(sides), np.repeat(cut[by_cut]*SAME, counts)
    x, target, panel = (np.repeat(values[by_cut], counts) for values in (x, target, panel))
    h, root = panels.h[panel], panels.root[panel]
    # x - x(v) without the cancellation near v0
    difference = x - panels.x(panel, v0) - h*np.where(root, sides*(sides + 2*v0), sides)
    lever = line.lever(panels.corner[panel], panels.x(panel, v0 + sides))
    values, found, done = kernel(difference, target, lever), np.empty((len(cut), panels.order)), 0
    for rule, group in zip(rules, groups):
        size = len(group)*len(rule.sides)
        found[group] = values[done:done + size].reshape(len(group), -1) @ rule.basis
        done += size
    return found


@dataclass(frozen=True)
class CutRule:
    """Quadrature on [0, 1] for a logarithm at v0: v - v0, array (n,), and weights times the basis there, array (n, order)."""

    sides: np.ndarray
    basis: np.ndarray


@lru_cache(maxsize=4096)
def _cut_rule(order, v0):
    sigma, gauss = gauss_rule(2*order + 8)
    flat, slope = sigma**CLUSTER, CLUSTER*sigma**(CLUSTER - 1)*gauss
    parts = [(sign*length*flat, length*slope) for sign, length in ((-1, v0), (1, 1 - v0)) if length > 0]
    sides, weights = map(np.concatenate, zip(*parts))
    return CutRule(sides, weights[:, None]*lagrange(gauss_rule(order)[0], v0 + sides))


def lagrange(points, v):
    """Lagrange polynomials of the points at v: array v.shape + (points,)."""
    difference = points[:, None] - points + np.eye(len(points))
    apart = v[..., None] - points
    apart[np.abs(apart) < 1e-100] = 1e-100      # at a point itself its own term outweighs all others
    terms = 1/(difference.prod(axis=1)*apart)
    return terms/terms.sum(axis=-1, keepdims=True)
