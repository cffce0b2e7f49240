"""States of the playground: a cylinder on microblocks in scaled form, on the pieces between its edges.

Lengths are over a_Hz, stresses over p_Hz, heights over a_Hz^2/R and angles over a_Hz/R, all of the state's
own load. With small a_Hz/R a state depends on alpha = ell/a_Hz and psi0 R/a_Hz alone: what psi0 adds to the
levers, psi0 against 1, is of the order a_Hz/R.

A state is piecewise smooth: its pieces lie between all edges of zones, and on each of them the same corners
are closed. On each piece two functions say everything: both pressures where both corners are closed, the
pressure and psi where one is, the mean gap of the corners and psi where none is. They are sampled at points
that crowd at both ends as ``1 - cos(theta)``: a pressure that ends like a square root is a smooth function of
theta.
"""

import math
from dataclasses import dataclass

import numpy as np

import microblock as mb
from microblock.model.zones import distance

NU, BETA = 0.3, 1.0  # those of the case `hertz`
SLOPE = 1e-6  # a_Hz/R: small enough for psi0 in the levers to be rounding of the page
LOAD = math.pi / 2  # the load whose a_Hz and p_Hz are 1
FAR = 12.0  # half of the length that is sampled, over a_Hz: the page shows up to 11
NODES = 24  # on each piece: what is left of the states is below 1e-4, see the tests
RTOL = 1e-5  # of the states: nothing beside the interpolation
JOINED = 1e-5  # a zone with a gap that narrow is one: the page could not show it
A, B, BOTH = 1, 2, 3  # which corners are closed: one bit each
NEAR = np.linspace(-3, 3, 61)  # over a_Hz: where gaps are looked at
SHARE = (1 - np.cos(np.linspace(0, math.pi, NODES))) / 2


def solve(alpha, psi0=0.0, law="microblock", slope=SLOPE):
    """The State at alpha and psi0 (over a_Hz/R), in a scene with a_Hz = p_Hz = 1 and such a slope a_Hz/R."""
    E = 4 * LOAD * (1 - NU**2) / (math.pi * slope)  # (50)
    body = mb.HalfPlane(mb.Cosserat(E=E, nu=NU, beta=BETA, ell=alpha))
    rule = mb.Microblock(psi0=psi0 * slope) if law == "microblock" else mb.Unilateral()
    return mb.Contact(body, mb.Cylinder(R=1 / slope), rule, mb.Panels(fallback=False)).solve(
        load=LOAD, rtol=RTOL
    )


@dataclass(frozen=True, eq=False)
class Sampled:
    """A state as the page has it.

    Attributes
    ----------
    edges : array (m,), edges of all zones, ascending
    closed : tuple of m + 1 numbers, which corners are closed on each piece; 0 is none
    values : array (m + 1, 2, NODES), the two functions of each piece
    """

    edges: np.ndarray
    closed: tuple
    values: np.ndarray

    @property
    def ends(self):
        """Ends of all pieces, array (m + 2,)."""
        return np.concatenate(([-FAR], self.edges, [FAR]))

    def zones(self, corner):
        """[(left, right), ...] of the pieces on which a corner is closed, those that touch as one."""
        found = []
        for left, right, closed in zip(self.ends, self.ends[1:], self.closed):
            if closed & corner and found and found[-1][1] == left:
                found[-1] = found[-1][0], right
            elif closed & corner:
                found.append((left, right))
        return found

    def mirrored(self):
        """The state of -psi0: A and B change places, psi its sign."""
        closed = tuple((one & A) << 1 | (one & B) >> 1 for one in reversed(self.closed))
        values = self.values[::-1, :, ::-1].copy()
        for one, code in zip(values, closed):
            one[:] = one[::-1] if code == BOTH else one
            if code != BOTH:
                one[1] *= -1
        return Sampled(-self.edges[::-1], closed, values)


def sampled(state):
    """The Sampled of a State of `solve`."""
    zones = {number: joined(own) for number, own in state.solution.all_zones.items()}
    edges = np.unique([edge for own in zones.values() for interval in own for edge in interval])
    ends = np.concatenate(([-FAR], edges, [FAR]))
    pieces = [_piece(state, zones, *pair) for pair in zip(ends, ends[1:])]
    return Sampled(edges, tuple(code for code, _ in pieces), np.array([values for _, values in pieces]))


def joined(zones):
    """Intervals, with those that nearly touch as one."""
    found = []
    for left, right in zones:
        if found and left - found[-1][1] < JOINED:
            found[-1] = found[-1][0], right
        else:
            found.append((left, right))
    return found


def _piece(state, zones, left, right):
    """(which corners are closed, the two functions there) of a piece."""
    solution, x = state.solution, left + (right - left) * SHARE
    own = [number for number in zones if any(a < (left + right) / 2 < b for a, b in zones[number])]
    code = sum(1 << number for number in own)
    pressures = [_pressure(solution, number, zones[number], x) for number in own]
    if code == BOTH:
        return code, pressures
    displacement = solution.displacement_at(x, np.zeros_like(x))
    psi = (solution.displacement_at(x, np.ones_like(x)) - displacement) * 2 / state.solid.ell / SLOPE
    if pressures:
        return code, [*pressures, psi]
    gap = x**2 / 2 + corner_rise(state.solid.ell, len(zones)) + (displacement - solution.approach) / SLOPE
    return code, [np.maximum(gap, 0.0), psi]


def corner_rise(ell, corners):
    """What the obstacle rises above the contact point, in the mean over the corners."""
    return ell**2 / 8 if corners == 2 else 0.0


def _pressure(solution, number, zones, x):
    """Pressure of a corner at the nodes of a piece; 0 at its own edges, where the solution has 0/0."""
    found = solution.pressure(number, x)
    return np.where(np.isin(x, np.ravel(zones)), 0.0, found)


def weights(where, nodes):
    """Lagrange's weights of neighbouring nodes, arrays (k, n) for places (n,) and nodes (k, n)."""
    own = np.ones((len(nodes), *np.shape(where)))
    for i, j in np.ndindex(len(nodes), len(nodes)):
        if i != j:
            own[i] *= (where - nodes[j]) / (nodes[i] - nodes[j])
    return own


def on_nodes(values, theta):
    """Values (..., NODES) between the nodes, at theta in their numbers, by cubics."""
    first = np.clip(np.floor(theta).astype(int) - 1, 0, NODES - 4)
    nodes = first + np.arange(4)[:, None]
    return np.sum(weights(theta, nodes) * values[..., nodes], axis=-2)


def fields(state, x, alpha, psi0, law="microblock"):
    """Pressures of A and B (of the one point and 0), psi and the mean gap at x, array (4, n)."""
    found, ends = np.zeros((4, len(x))), state.ends
    piece = np.clip(np.searchsorted(ends, x, side="right") - 1, 0, len(state.closed) - 1)
    for number, code in enumerate(state.closed):
        here = piece == number
        if not here.any():
            continue
        width = max(ends[number + 1] - ends[number], 1e-300)
        along = np.clip((x[here] - ends[number]) / width, 0, 1)
        one, other = on_nodes(state.values[number], np.arccos(1 - 2 * along) * (NODES - 1) / math.pi)
        if code == BOTH:
            found[:3, here] = one, other, x[here] - psi0
        elif code:
            found[code - 1, here], found[2, here] = one, other
            # of two corners the open one has all of the difference alpha (psi0 + psi - x)
            found[3, here] = np.abs(alpha * (psi0 + other - x[here])) / 2 if law == "microblock" else 0.0
        else:
            found[2:, here] = other, one
    return found


def error(given, state, alpha, psi0, law="microblock"):
    """Relative error in L2 of pressure and micromoment of a Sampled against a State, the library's norm."""
    p = fields(given, state.x, alpha, psi0, law)[: len(state.pressures)] - list(state.pressures.values())
    moment = (p[0] - p[-1]) / 2  # over ell: the levers are 1 and -1
    return distance(state.weights, p.sum(axis=0), moment, state.pressure)


def gap_error(given, state, alpha, psi0, law="microblock"):
    """The largest error of the mean gap of the corners, over a_Hz^2/R, near the contact."""
    gaps = np.mean([state.gap_at(corner, NEAR) for corner in state.law.corners], axis=0) / SLOPE
    return float(np.abs(fields(given, NEAR, alpha, psi0, law)[3] - gaps).max())
