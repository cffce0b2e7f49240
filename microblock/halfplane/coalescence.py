"""The load at which two symmetric zones of partial contact meet on the axis.

The inner edge is prescribed; K0 and K1 of the edges are affine in the load. The load misses coalescence by
b^(2 s), b from the axis to the edge, p ~ x^s (docs/theory/halfplane.md).
"""

import numpy as np

from ..errors import NotConverged


def extrapolated(coefficients, solid, inner_edges, exponent):
    """Limit of the load for an inner edge on the axis, and its error: Richardson from gaps and overlaps.

    Parameters
    ----------
    coefficients : as of `load_at_inner_edge`
    inner_edges : -log10 of the inner edges over ell, equally spaced
    exponent : outer edge -> s of p ~ x^s at coalescence
    """
    limits, corrections, outer = [], [], 1.4 * solid.ell  # a first guess
    for side in (1, -1):
        column = []
        for digits in inner_edges:
            load, outer = load_at_inner_edge(coefficients, solid, side * solid.ell * 10.0**-digits, outer)
            column.append(load)
        for power in (2, 4):
            ratio = 10.0 ** (-power * exponent(outer) * (inner_edges[1] - inner_edges[0]))
            column = [(fine - ratio * coarse) / (1 - ratio) for coarse, fine in zip(column, column[1:])]
        limits.append(column[-1])
        corrections.append(abs(column[-1] - column[-2]))
    return sum(limits) / 2, max(*corrections, abs(limits[0] - limits[1]))


def load_at_inner_edge(coefficients, solid, inner, outer):
    """Load with the inner edge of corner A `inner` from the axis (> 0: a gap), and the outer edge;
    `coefficients` of (inner, outer, loads) are the (K0, K1) of both at the loads.
    """
    load = solid.E_star * outer
    for _ in range(12):
        inner_K, outer_K = np.array(coefficients(inner, outer, (load, 2 * load)))
        share = inner_K[0, 0] / (inner_K[0, 0] - inner_K[1, 0])
        K0, K1 = outer_K[0] + share * (outer_K[1] - outer_K[0])
        step = 2 * K0 / K1
        outer += float(np.clip(step, -0.3 * outer, 0.3 * outer))
        load = abs(load * (1 + share))
        if abs(step) < 1e-6 * outer:  # the load feels its square
            return float(load), outer
    raise NotConverged(f"the outer edge still moves by {step:.1e} at the inner edge {inner:g}", iterations=12)
