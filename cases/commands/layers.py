"""Layers below the contact: what the microblock law adds to the microrotation (Figs 12, 13).

Geometry   half-plane x2 < 0 under a rigid cylinder, the same load with two laws: microblock (psi0 = 0) and
           unilateral (M = 0).
Equations  (10)-(18) in the half-plane, corner gaps and micromoment (21), (22), (29) at the surface.
Model      halfplane: pressures on panels of the contact line, the fields below them from the half-plane's
           modes. fe: fitted finite elements that shrink towards the lines too, domain 1000 a_Hz.
Reference  the bi-exponential decay (51), fitted to the difference of psi along vertical lines; 1/sqrt(beta)
           of the thick strip, (49).
Look at    L_bl/ell beside mode_length_over_ell: the micropolar mode's part of the difference over its
           derivative at the surface, which needs no fit. Both tend to 1/sqrt(beta) under the full-contact
           zone.
Units      lengths over a_Hz (alpha = ell/a_Hz), psi as psi R/a_Hz. L_bl_error is that of L_bl_over_ell: two
           standard deviations of the fit and the largest change when its depths are varied; with fe also the
           change from a coarser mesh. Beyond 10 % a length is null, and reason says why.
"""

from typing import Literal

import numpy as np

import microblock as mb

from .. import layers
from ..layers import figure  # noqa: F401
from . import MATERIAL, require_ranges

RTOLS = 1e-4, 1e-5  # of the meshes: the last gives the row, its distance to the first the error
RANGES = MATERIAL | {"alphas": (1e-3, 2.0), "positions": (1e-3, 100.0)}


def solve(
    alphas=(0.01, 0.02, 0.05, 0.1),
    positions=(0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95),
    nu=0.3,
    beta=1.0,
    model: Literal["halfplane", "fe"] = "halfplane",
):
    """Layer lengths below the positions.

    Parameters
    ----------
    alphas : length scales of the material over a_Hz
    positions : abscissae x1 > 0 of the vertical lines over a_Hz
    nu : Poisson's ratio, -1 < nu < 1/2
    beta : coupling number 2 eta/(1 + eta), 0 < beta < 2
    model : modes of the half-plane, or fitted finite elements
    """
    require_ranges(locals(), RANGES)
    if model == "halfplane":
        return {"model": model, **layers.solve(alphas, positions, nu, beta)}
    rows = [row for alpha in alphas for row in on_meshes(alpha, positions, nu, beta)]
    return {"model": model, "unknowns": max(row["unknowns"] for row in rows), "layers": rows}


def on_meshes(alpha, positions, nu, beta):
    """Rows of an alpha by finite elements; what a coarser mesh changes is an error, too."""
    problems = layers.problems(alpha, nu, beta, mb.Block, mb.Fitted(lines=tuple(positions)))
    x2 = layers.depths(alpha)
    coarse = [problem.solve(load=np.pi / 2, rtol=RTOLS[0]) for problem in problems]
    fine = [
        problem.solve(np.pi / 2, rtol=RTOLS[1], initial=state) for problem, state in zip(problems, coarse)
    ]
    for x1 in positions:
        values, before = (
            np.subtract(*(along(s, s.fields.psi, x1, x2) for s in pair)) for pair in (fine, coarse)
        )
        lengths, lengths_before = (
            layers.fitted_exponentials(x2, psi, alpha, 0.0, 2.0)[0] for psi in (values, before)
        )
        mode, mode_before = (mode_length(pair, x1) / alpha for pair in (fine, coarse))
        yield {
            "alpha": alpha,
            "x1": x1,
            **layers.layer(x2, values, alpha, np.abs(lengths - lengths_before)),
            "mode_length_over_ell": mode,
            "mode_length_error": abs(mode - mode_before),
            "unknowns": max(state.unknowns for state in fine),
            "state_error": max(state.error_estimate for state in fine),
        }


def mode_length(states, x1):
    """The micropolar mode's part of the difference over its derivative at the surface (over a_Hz).

    The slope is that of a polynomial of order 6 (exp(-2) to 1e-6) through samples down to 2 ell, or as deep
    as the next edge of a zone is far.
    """
    edges = np.concatenate([np.ravel(zones) for state in states for zones in state.zones.values()])
    depth = min(2 * states[0].solid.ell, np.abs(x1 - edges).min())
    x2 = -(np.sin(np.linspace(0, np.pi / 2, 60)) ** 2)
    thetas = [along(state, micropolar(state), x1, depth * x2) for state in states]
    *_, slope, value = np.polyfit(x2, thetas[0] - thetas[1], 6)
    return depth * value / slope


def micropolar(state):
    """theta, the micropolar mode's part of psi, up to a factor that its length does not have.

    The rest of psi is a classical rotation, which is harmonic, and L^2 lap(theta) = theta. So theta = L^2
    lap(psi). By the balance of moments (14), div m = sigma_12 - sigma_21 with m = G grad(psi), that is L^2/G
    times sigma_12 - sigma_21, of first derivatives of the computed fields.
    """
    stress = state.fields.stress
    return stress[0, 1] - stress[1, 0]


def along(state, function, x1, x2):
    """Values (n,) of an NGSolve function at x1 and the depths x2 (n,), from 1e-9 a_Hz below the surface."""
    points = state.fields.body.mesh(np.full(len(x2), x1), np.minimum(x2, -1e-9))
    return np.asarray(function(points)).ravel()
