"""Maps of finite elements: locking, layers thinner than an element, element shapes, oscillation, rotated
blocks.

Contact is verified by the half-plane, the strip and the bulk by closed forms. Elements of order p and side p
times `spacing` have as many nodes a length as those of order 1.
"""

import math
from dataclasses import replace

import numpy as np

import microblock as mb
from microblock.errors import NotConverged
from microblock.fem.meshes import Ground, rectangles
from microblock.model.zones import zone_edges

from ..scenes import strip
from .judged_line import LOAD, RADIUS, Draw, error_of_elements
from .limits_maps import Axis, Map, Outcome, choice

REACH = 2.0  # of equal squares, over a_Hz
JUDGE = 1e-5  # rtol of the half-plane
PSI0_DEG = 0.1  # of the strip's blocks
SHARE = 0.5  # of the strip's approach over that at which both corners are closed
INSIDE = 0.8  # of the smallest edge, within which a pressure is expected to be smooth
ROUNDING = 1e-12  # of a pressure over its maximum
SAMPLES = 2001  # of the interpolated pressure
BOUNDED = 18.0  # size of the ground over a_Hz where Newton's method solves for all of it
FAR = 100.0  # size of a user's block of ground over a_Hz: its truncation error is some 1e-4

BETA_LARGE = Axis("beta", "2 - beta", 1.0, 1e-3, "gap", "high", 2.0)
BETA_SMALL = Axis("beta", "beta", 1.0, 1e-4, degenerate="high")
NU = Axis("nu", "1/2 - nu", 0.5, 1e-4, "gap", "high", 0.5)
ALPHA = Axis("alpha", "alpha", 0.05, 1.0)
SPACING = Axis("spacing", "spacing of nodes/a_Hz", 0.3, 0.15)


def _closed_form(ell, psi0, nu, beta, delta):
    from microblock.model.closed_forms import Strip  # verifies only: the computation does without

    return Strip(ell, psi0, nu, beta, delta)


def half_plane(problem, rtol=JUDGE):
    """What verifies a contact; where that fails it says so, and not that the verified method does."""
    try:
        return problem.solve(load=LOAD, rtol=rtol)
    except NotConverged as failure:
        raise NotConverged(f"not verified: {failure}") from failure


def squares(problem, order, spacing, size=math.inf, **method):
    """The state of a block on equal squares; `method`: further arguments of `Uniform`."""
    way = mb.Uniform(h=order * spacing, order=order, reach=REACH, **method)
    return problem.with_(body=mb.Block(problem.solid, size), method=way).solve(load=LOAD)


def locking(order, nu, beta, alpha, spacing):
    problem = Draw("", "microblock", alpha, nu, beta).problem()
    state = squares(problem, order, spacing)
    return Outcome(error_of_elements(state, half_plane(problem)), iterations=state.iterations)


def strip_of(order, ell_over_h, elements, beta, nu, **more):
    """The strip in partial contact, solved on one discretisation."""
    ell = ell_over_h / elements
    full = _closed_form(ell, math.radians(PSI0_DEG), nu, beta, 1.0).delta_fc
    return strip.solve_once(
        strip.Parameters(
            ell_over_H=ell,
            psi0_deg=PSI0_DEG,
            nu=nu,
            beta=beta,
            delta_over_H=SHARE * full,
            order=order,
            elements=elements,
            **more,
        )
    )


def thin_layer_fluxes(**setting):
    """Largest relative error of traction, micromoment and both layer lengths."""
    solution = strip_of(**setting)
    seen, exact = strip.observe(solution), strip.reference(solution.parameters)
    return Outcome(
        max(
            abs(seen[name] / getattr(exact, name) - 1) for name in ("traction", "micromoment", "L_psi", "L_u")
        ),
        iterations=solution.state.iterations,
    )


def ground_mesh(shape, order, spacing, aspect):
    """A half of the ground: elements `aspect` times as long as high at the surface, growing downwards and
    outwards.
    """
    across = _growing(np.arange(0, REACH + order * spacing / 2, order * spacing), order * spacing)
    down = _growing(np.zeros(1), order * spacing / aspect)
    names = ("bottom", "side", "contact", "axis")
    return rectangles(across, -down[::-1], shape == "quadrilaterals", names)


def _growing(lines, step, growth=1.7):
    """Lines continued to FAR in steps that grow."""
    lines = list(lines)
    while lines[-1] + step < FAR:
        lines.append(lines[-1] + step)
        step *= growth
    return np.append(lines[: max(len(lines) - 1, 1)], FAR)


def ground_shape(shape, order, aspect, spacing, alpha):
    """A user's stretched block of ground under a cylinder."""
    problem = Draw("", "microblock", alpha, 0.3, 1.0).problem()
    body = mb.Body(
        ground_mesh(shape, order, spacing, aspect),
        problem.solid,
        order,
        fixed=Ground(FAR, (0.0, REACH)).supports,
    )
    state = problem.with_(body=body).solve(load=LOAD / 2)
    true = half_plane(problem)
    return Outcome(state.solution.difference(true.solution.pressure), iterations=state.iterations)


def oscillating(contact, order, spacing, alpha, nu):
    """What alternates from node to node in the error of the pressure, and tension between nodes, over the
    largest pressure.
    """
    problem = Draw("", contact, alpha, nu, 1.0).problem()
    state, true = squares(problem, order, spacing), half_plane(problem)
    return Outcome(
        error_of_elements(state, true), iterations=state.iterations, **unsteady(state, state.x, true)
    )


def unsteady(state, nodes, true):
    """Measures of `oscillating`, from pressures that are polynomials between the nodes (ascending)."""
    middle = nodes[np.abs(nodes) <= INSIDE * min(map(abs, zone_edges(true.zones)))]
    wrong = state.pressure_at(middle) - true.pressure_at(middle)
    alternating = (wrong[:-2] - 2 * wrong[1:-1] + wrong[2:]) / 4
    between = np.linspace(-REACH, REACH, SAMPLES)
    interpolated = np.array([state.pressure_at(between, corner) for corner in state.pressures])
    largest = float(interpolated.sum(axis=0).max())
    tension = float(-interpolated.min()) / largest
    return {
        "oscillation": float(np.sqrt(np.mean(alternating**2))) / largest if len(alternating) else None,
        "wrong_sign": tension if tension > ROUNDING else 0.0,
    }


def ruled(rule, order, spacing, alpha, nu):
    """Multipliers of the augmented Lagrangian on equal squares by a rule; their error in the rule of the
    nodes.
    """
    problem = Draw("", "unilateral", alpha, nu, 1.0).problem()
    rho = problem.solid.lam + 2 * problem.solid.mu
    state = squares(problem, order, spacing, BOUNDED, newton=mb.Newton("al", rho), rule=rule)
    true = half_plane(problem)
    exact = true.pressure_at(state.x)
    error = math.sqrt(state.weights @ (state.pressure - exact) ** 2 / (state.weights @ exact**2))
    return Outcome(error, iterations=state.iterations, **unsteady(state, state.x[state.x >= 0], true))


def rotated(method, psi0_deg, alpha, nu, reading):
    """Blocks rotated by up to 20 degrees, a_Hz/R = 0.1."""
    psi0 = math.radians(psi0_deg) * RADIUS
    problem = Draw("", "microblock", alpha, nu, 1.0, psi0, reading).problem()
    if method == "equal squares":
        state = squares(problem, 1, 0.2)
        return Outcome(error_of_elements(state, half_plane(problem)), iterations=state.iterations)
    return fitted_of(problem, 1e-2)


def fitted_of(problem, rtol):
    state = problem.with_(body=mb.Block(problem.solid)).solve(load=LOAD, rtol=rtol)
    true = half_plane(problem, rtol / 100)
    return Outcome(error_of_elements(state, true), rtol, state.iterations, state.error_estimate)


def fitted(contact, nu, beta, alpha, rtol):
    return fitted_of(Draw("", contact, alpha, nu, beta).problem(), rtol)


ORDER = choice("order", "order", 1, 2, 3, 4, 5, 6)
ELEMENTS = Axis("elements", "elements", 1, 64, whole=True)
ELL_OVER_H = Axis("ell_over_h", "ell/h", 0.01, 100.0, degenerate="low")
ANY_BETA, ANY_NU = Axis("beta", "beta", 0.05, 1.9, "linear"), Axis("nu", "nu", 0.0, 0.45, "linear")
SHAPES = "quadrilaterals", "triangles"
LAWS = ("contact", ("microblock", "unilateral"))
MAPS = (
    Map(
        "locking_beta_large",
        "Do elements of one order for all fields lock towards couple stresses, and with 1/2 - nu?",
        locking,
        (BETA_LARGE, NU, ALPHA, SPACING),
        ("order", (1, 2, 4)),
        0.5,
    ),
    Map(
        "locking_beta_small",
        "Do elements of one order for all fields lock as the coupling vanishes?",
        locking,
        (BETA_SMALL, NU, ALPHA, SPACING),
        ("order", (1, 2, 4)),
        0.3,
    ),
    Map(
        "thin_layer_fluxes",
        "How wrong are traction, micromoment and layer lengths where a layer is thinner than an element?",
        thin_layer_fluxes,
        (ELL_OVER_H, ELEMENTS, ANY_BETA, ANY_NU),
        ("order", (1, 2, 4, 6)),
        0.7,
    ),
    Map(
        "shape_ground",
        "Does the shape of the elements of a user's ground change the contact of a cylinder?",
        ground_shape,
        (Axis("aspect", "length/height of an element", 1e-2, 1e4, degenerate="both"), ORDER, SPACING, ALPHA),
        ("shape", SHAPES),
        0.4,
    ),
    Map(
        "oscillation",
        "Do nodal pressures oscillate, or become tensile between the nodes?",
        oscillating,
        (replace(SPACING, low=0.2, high=0.12), choice("order", "order", 1, 2, 3, 4, 6, 8, 10), ALPHA, ANY_NU),
        LAWS,
        0.5,
    ),
    Map(
        "oscillation_rule",
        "Is Gauss's rule steadier than the nodal one?",
        ruled,
        (SPACING, choice("order", "order", 1, 2, 3, 4), ALPHA, ANY_NU),
        ("rule", ("nodal", "gauss")),
        0.4,
    ),
    Map(
        "turned",
        "Do finite elements follow blocks that are rotated far?",
        rotated,
        (
            Axis("psi0_deg", "psi0 in degrees", 0.0, 20.0, "linear", "both"),
            ALPHA,
            ANY_NU,
            choice("reading", "reading", "gap", "lever"),
        ),
        ("method", ("fitted", "equal squares")),
        0.4,
    ),
    Map(
        "fitted_beta_large",
        "Do fitted elements hold what they promise towards couple stresses?",
        fitted,
        (BETA_LARGE, NU, ALPHA, Axis("rtol", "rtol", 1e-2, 1e-3)),
        LAWS,
        0.4,
    ),
    Map(
        "fitted_beta_small",
        "Do fitted elements hold what they promise as the coupling vanishes?",
        fitted,
        (BETA_SMALL, NU, ALPHA, Axis("rtol", "rtol", 1e-2, 1e-3)),
        LAWS,
        0.4,
    ),
)
