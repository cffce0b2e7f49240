"""The finite element side of `layers`: fields below the contact on fitted meshes that shrink towards the
lines.

psi is a classical rotation, which is harmonic, and the micropolar mode theta, which obeys L^2 lap(theta) =
theta. So theta = L^2 lap(psi), and by the balance of moments (14), div m = sigma_12 - sigma_21 with m = G
grad(psi), it is (L^2/G) (sigma_12 - sigma_21): separated exactly, by first derivatives of the computed
fields.
"""

import time
from dataclasses import dataclass

import numpy as np

import microblock as mb

RTOLS = 1e-4, 1e-5  # of the pressures: the last one gives the row, the distance to the first its error
SKIN = 1e-9  # over a_Hz: depth at which fields "at" the surface are taken
SLOPE_DEPTH = 2.0  # over ell, of the samples that give the slope of theta at the surface; but no deeper
# than the next edge of a zone is far
SLOPE_POINTS, SLOPE_ORDER = 60, 6  # of them, and of the polynomial through them: exp(-2) to 1e-6


@dataclass(frozen=True)
class Profiles:
    """Fields of both laws along vertical lines from one pair of meshes.

    Attributes
    ----------
    microblock, unilateral : arrays (positions, depths), psi R/a_Hz
    mode_length : array (positions,), theta's difference at the surface over its slope (over a_Hz)
    unknowns : int, of the larger mesh
    error : float, the larger estimate of both pressures
    seconds : float, of both states, all passes counted
    """

    microblock: np.ndarray
    unilateral: np.ndarray
    mode_length: np.ndarray
    unknowns: int
    error: float
    seconds: float


def refined(alpha, positions, nu, beta, x2):
    """Profiles at x2 (array (depths,)) under the positions, for each of RTOLS; units a_Hz = p_Hz = R = 1."""
    body = mb.Block(mb.Cosserat(E=2 * (1 - nu**2), nu=nu, ell=alpha, beta=beta))
    problems = [
        mb.Contact(body, mb.Cylinder(1.0), law, mb.Fitted(lines=tuple(positions)))
        for law in (mb.Microblock(), mb.Unilateral())
    ]
    states, found = (None, None), []
    for rtol in RTOLS:
        start = time.perf_counter()
        states = [
            problem.solve(load=np.pi / 2, rtol=rtol, initial=state)
            for problem, state in zip(problems, states)
        ]
        found.append(_profiles(states, positions, x2, time.perf_counter() - start))
    return found


def _profiles(states, positions, x2, seconds):
    lengths = [_mode_length(states, x1) for x1 in positions]
    return Profiles(
        *(along(state, state.fields.psi, positions, x2) for state in states),
        np.array(lengths),
        max(state.unknowns for state in states),
        max(state.error_estimate for state in states),
        seconds,
    )


def _mode_length(states, x1):
    edges = np.concatenate([np.ravel(zones) for state in states for zones in state.zones.values()])
    depth = min(SLOPE_DEPTH * states[0].solid.ell, np.abs(x1 - edges).min())
    x2 = -(np.sin(np.linspace(0, np.pi / 2, SLOPE_POINTS)) ** 2)
    thetas = [along(state, mode(state), (x1,), depth * x2)[0] for state in states]
    *_, slope, value = np.polyfit(x2, thetas[0] - thetas[1], SLOPE_ORDER)
    return depth * value / slope


def mode(state):
    """theta, the micropolar mode's share of psi, as an NGSolve function."""
    solid, stress = state.solid, state.fields.stress
    stiffness = solid.curvature * solid.mu * solid.ell**2
    return solid.layer_length**2 / stiffness * (stress[0, 1] - stress[1, 0])


def along(state, function, positions, x2):
    """Values of an NGSolve function along vertical lines, array (positions, depths)."""
    points = state.fields.body.mesh(
        np.repeat(positions, len(x2)), np.tile(np.minimum(x2, -SKIN), len(positions))
    )
    return np.asarray(function(points)).reshape(len(positions), len(x2))
