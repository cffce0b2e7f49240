"""Maps of finite elements: locking, layers thinner than an element, element shapes, oscillating pressures, turned blocks.

Contact is judged by the half-plane, the strip and the bulk by closed forms. Elements of order p and side p times `spacing`
have as many nodes a length as those of order 1.
"""

import math
from dataclasses import replace

import ngsolve as ng
import numpy as np
from netgen.occ import OCCGeometry, Rectangle
from ngsolve.meshes import MakeStructured2DMesh

from cases import accuracy, accuracy_fe, strip
from cases.accuracy import Draw
from cases.limits_maps import Axis, Map, Outcome, choice
from microblock import meshes
from microblock.body import Body
from microblock.body_contact import BodyContact
from microblock.condensation import ContactNodes
from microblock.errors import NotConverged
from microblock.facets import ContactFacets
from microblock.fitted import FittedContact
from microblock.meshes import Ground, uniform
from microblock.newton import Newton
from microblock.newton_path import load_path
from microblock.uniform import UniformContact

REACH = 2.0           # of equal squares, over a_Hz
JUDGE = 1e-5          # rtol of the half-plane
PSI0_DEG = 0.1        # of the strip's blocks
SHARE = 0.5           # of the strip's approach over that at which both corners are closed
INSIDE = 0.8          # of the smallest edge, within which a pressure is expected to be smooth
ROUNDING = 1e-12      # of a pressure over its maximum
SAMPLES = 2001        # of the interpolated pressure
BOUNDED = 18.0        # size of the ground over a_Hz where Newton's method solves for all of it
FAR = 100.0           # size of a user's block of ground over a_Hz: its truncation error is some 1e-4

BETA_LARGE = Axis("beta", r"$2 - \beta$", 1.0, 1e-3, "gap", "high", 2.0)
BETA_SMALL = Axis("beta", r"$\beta$", 1.0, 1e-4, degenerate="high")
NU = Axis("nu", r"$1/2 - \nu$", 0.5, 1e-4, "gap", "high", 0.5)
ALPHA = Axis("alpha", r"$\alpha$", 0.05, 1.0)
SPACING = Axis("spacing", r"spacing of nodes$/a_\mathrm{Hz}$", 0.3, 0.15)


def _closed_form(ell, psi0, nu, beta, delta):
    from microblock.references import Strip      # judges only: the computation does without
    return Strip(ell, psi0, nu, beta, delta)


def half_plane(scene, rtol=JUDGE):
    """The judge of a contact; what it cannot do is told apart from failures of what is judged."""
    try:
        return scene.at(accuracy.LOAD, rtol=rtol)
    except NotConverged as failure:
        raise NotConverged(f"no judgement: {failure}") from failure


def squares(scene, order, spacing):
    """The state on equal squares, condensed."""
    contact = UniformContact(scene.body.solid, scene.obstacle, scene.law, math.inf, order*spacing, order, REACH)
    return contact.states([accuracy.LOAD])[0]


def locking(order, nu, beta, alpha, spacing):
    scene = Draw("", "microblock", alpha, nu, beta).scene()
    state = squares(scene, order, spacing)
    return Outcome(accuracy_fe.error(state, half_plane(scene)), iterations=state.iterations)


def strip_of(order, ell_over_h, elements, beta, nu, **more):
    """The strip in partial contact, solved on one discretisation."""
    ell = ell_over_h/elements
    full = _closed_form(ell, math.radians(PSI0_DEG), nu, beta, 1.0).delta_fc
    return strip.solve_once(strip.Parameters(ell_over_H=ell, psi0_deg=PSI0_DEG, nu=nu, beta=beta, delta_over_H=SHARE*full,
                                             order=order, elements=elements, **more))


def thin_layer_fields(**setting):
    solution = strip_of(**setting)
    found = strip.errors(solution)
    return Outcome(max(found["error_psi"], found["error_u"]), iterations=solution.state.iterations)


def thin_layer_fluxes(**setting):
    """Largest relative error of traction, micromoment and both layer lengths."""
    solution = strip_of(**setting)
    seen, exact = strip.observe(solution), strip.reference(solution.parameters)
    return Outcome(max(abs(seen[name]/getattr(exact, name) - 1) for name in ("traction", "micromoment", "L_psi", "L_u")),
                   iterations=solution.state.iterations)


def column_shape(shape, order, aspect, elements, ell_over_h):
    """A column of elements `aspect` times as wide as high."""
    ell = ell_over_h/elements
    full = _closed_form(ell, math.radians(PSI0_DEG), 0.3, 1.0, 1.0).delta_fc
    parameters = strip.Parameters(ell_over_H=ell, psi0_deg=PSI0_DEG, delta_over_H=SHARE*full, model="column", order=order,
                                  elements=elements)
    mesh = meshes.column(1.0, elements, aspect/elements, quads=shape == "quadrilaterals")
    solution = strip.solve_once(parameters, mesh)
    found = strip.errors(solution)
    return Outcome(max(found["error_psi"], found["error_u"]), iterations=solution.state.iterations)


def stretched_mesh(shape, aspect, elements):
    """The unit square in `elements` a side, stretched to the width `aspect`; boundaries "default"."""
    if shape == "unstructured triangles":
        mesh = OCCGeometry(Rectangle(1, 1).Face(), dim=2).GenerateMesh(maxh=1/elements)
        mesh.Coordinates()[:, 0] *= aspect
        mesh.Update()
        return ng.Mesh(mesh)
    return MakeStructured2DMesh(quads=shape == "quadrilaterals", nx=elements, ny=elements, mapping=lambda x, y: (aspect*x, y))


def bulk_shape(shape, order, aspect, elements, ell):
    """The strip's layer as a field of the bulk, prescribed all around a stretched square."""
    exact = _closed_form(ell, math.radians(PSI0_DEG), 0.3, 1.0, math.inf)
    a, k = exact.rotation, exact.k
    known = {"u1": a/k*ng.sinh(k*ng.y)/math.cosh(k), "u2": ng.CF(0.0), "psi": -a*ng.cosh(k*ng.y)/math.cosh(k)}
    mesh = stretched_mesh(shape, aspect, elements)
    solid = strip.Parameters(ell_over_H=ell).solid
    fields = Body(mesh, solid, order, prescribed={name: {".*": value} for name, value in known.items()}).solve()
    errors = [math.sqrt(ng.Integrate((found - value)**2, mesh, order=2*order + 6)/ng.Integrate(value**2, mesh, order=2*order + 6))
              for found, value in ((fields.u1, known["u1"]), (fields.psi, known["psi"]))]
    return Outcome(max(errors))


def ground_mesh(shape, order, spacing, aspect):
    """A half of the ground: elements `aspect` times as long as high at the surface, growing downwards and outwards."""
    across = _growing(np.arange(0, REACH + order*spacing/2, order*spacing), order*spacing)
    down = _growing(np.zeros(1), order*spacing/aspect)
    nx, ny = len(across) - 1, len(down) - 1
    mesh = MakeStructured2DMesh(quads=shape == "quadrilaterals", nx=nx, ny=ny,
                                mapping=lambda x, y: (across[round(x*nx)], -down[ny - round(y*ny)]))
    for number, name in enumerate(mesh.GetBoundaries()):
        mesh.ngmesh.SetBCName(number, {"top": "contact", "bottom": "bottom", "right": "side", "left": "axis"}[name])
    return ng.Mesh(mesh.ngmesh)


def _growing(lines, step, growth=1.7):
    """Lines continued to FAR in steps that grow."""
    lines = list(lines)
    while lines[-1] + step < FAR:
        lines.append(lines[-1] + step)
        step *= growth
    return np.append(lines[:max(len(lines) - 1, 1)], FAR)


def ground_shape(shape, order, aspect, spacing, alpha):
    """A user's stretched block of ground under a cylinder."""
    scene = Draw("", "microblock", alpha, 0.3, 1.0).scene()
    supports = Ground(FAR, (0.0, REACH)).supports
    solid = scene.body.solid
    state = BodyContact(Body(ground_mesh(shape, order, spacing, aspect), solid, order, fixed=supports), scene.obstacle,
                        scene.law).at(accuracy.LOAD/2)
    true = half_plane(scene)
    return Outcome(state.difference(true.pressure), iterations=state.iterations)


def oscillating(contact, order, spacing, alpha, nu):
    """What alternates from node to node in the error of the pressure, and tension between nodes, over the largest pressure."""
    scene = Draw("", contact, alpha, nu, 1.0).scene()
    state, true = squares(scene, order, spacing), half_plane(scene)
    return Outcome(accuracy_fe.error(state, true), iterations=state.iterations, **unsteady(state.pressure, state.x, true))


def unsteady(pressure, nodes, true):
    """Measures of `oscillating`, from pressure(corner, x) >= 0 that are polynomials between the nodes (ascending)."""
    inner = INSIDE*min(abs(edge) for own in true.all_zones.values() for pair in own for edge in pair)
    middle, corners = nodes[np.abs(nodes) <= inner], range(len(true.line.law.corners))
    wrong = sum(pressure(corner, middle) - true.pressure(corner, middle) for corner in corners)
    alternating = (wrong[:-2] - 2*wrong[1:-1] + wrong[2:])/4
    interpolated = np.array([pressure(corner, np.linspace(-REACH, REACH, SAMPLES)) for corner in corners])
    largest = float(interpolated.sum(axis=0).max())
    tension = float(-interpolated.min())/largest
    return {"oscillation": float(np.sqrt(np.mean(alternating**2)))/largest if len(alternating) else None,
            "wrong_sign": tension if tension > ROUNDING else 0.0}


def ruled(rule, order, spacing, alpha, nu):
    """Multipliers of the augmented Lagrangian on equal squares by a rule; their error in the rule of the nodes."""
    scene = Draw("", "unilateral", alpha, nu, 1.0).scene()
    true, ground = half_plane(scene), Ground(BOUNDED, (0.0, REACH))
    body = Body(uniform(ground, order*spacing), scene.body.solid, order, fixed=ground.supports)
    facets, nodes = ContactFacets(body, scene.law, scene.obstacle, rule=rule), ContactNodes(body)
    solid = scene.body.solid
    *_, state = load_path(Newton(body, facets, rho=solid.lam + 2*solid.mu, control="load"), [accuracy.LOAD/2])
    p, exact = -state.multipliers["C"], true.pressure(0, facets.points[:, 0])
    near = facets.points[:, 0] <= REACH
    return Outcome(math.sqrt(facets.weights @ (p - exact)**2/(facets.weights @ exact**2)), iterations=state.iterations,
                   **unsteady(lambda corner, x: nodes.interpolate(p, np.abs(x)), facets.points[near, 0], true))


def turned(method, psi0_deg, alpha, nu, reading):
    """Blocks turned by up to 20 degrees, a_Hz/R = 0.1."""
    psi0 = math.radians(psi0_deg)*accuracy.RADIUS
    scene = Draw("", "microblock", alpha, nu, 1.0, psi0, reading).scene()
    if method == "equal squares":
        state = squares(scene, 1, 0.2)
        return Outcome(accuracy_fe.error(state, half_plane(scene)), iterations=state.iterations)
    return fitted_of(scene, 1e-2)


def fitted_of(scene, rtol):
    state = FittedContact(scene.body.solid, scene.obstacle, scene.law).at(accuracy.LOAD, rtol)
    true = half_plane(scene, rtol/100)
    return Outcome(accuracy_fe.error(state, true), rtol, state.iterations, state.estimate.total)


def fitted(contact, nu, beta, alpha, rtol):
    return fitted_of(Draw("", contact, alpha, nu, beta).scene(), rtol)


ORDER = choice("order", "order", 1, 2, 3, 4, 5, 6)
ELEMENTS = Axis("elements", "elements", 1, 64, whole=True)
ELL_OVER_H = Axis("ell_over_h", r"$\ell/h$", 0.01, 100.0, degenerate="low")
ANY_BETA, ANY_NU = Axis("beta", r"$\beta$", 0.05, 1.9, "linear"), Axis("nu", r"$\nu$", 0.0, 0.45, "linear")
ASPECT = Axis("aspect", "length/height of an element", 1e-4, 1e4, degenerate="both")
SHAPES = "quadrilaterals", "triangles"
LAWS = ("contact", ("microblock", "unilateral"))
MAPS = (
    Map("locking_beta_large", "Do elements of one order for all fields lock towards couple stresses, and with 1/2 - nu?", locking,
        (BETA_LARGE, NU, ALPHA, SPACING), ("order", (1, 2, 4)), 0.5),
    Map("locking_beta_small", "Do elements of one order for all fields lock as the coupling vanishes?", locking,
        (BETA_SMALL, NU, ALPHA, SPACING), ("order", (1, 2, 4)), 0.3),
    Map("locking_strip", "Do elements of one order lock in the strip, where only beta -> 2 constrains anything?",
        thin_layer_fields, (BETA_LARGE, ELL_OVER_H, NU, ELEMENTS), ("order", (1, 2, 4)), 0.7),
    Map("thin_layer_fields", "How wrong are psi and u where a layer is thinner than an element?", thin_layer_fields,
        (ELL_OVER_H, ELEMENTS, ANY_BETA, ANY_NU), ("order", (1, 2, 4, 6)), 0.7),
    Map("thin_layer_fluxes", "How wrong are traction, micromoment and layer lengths where a layer is thinner than an element?",
        thin_layer_fluxes, (ELL_OVER_H, ELEMENTS, ANY_BETA, ANY_NU), ("order", (1, 2, 4, 6)), 0.7),
    Map("shape_column", "Does the shape of an element change the strip?", column_shape,
        (ASPECT, ORDER, Axis("elements", "elements", 2, 16, whole=True), Axis("ell_over_h", r"$\ell/h$", 0.5, 8.0)),
        ("shape", SHAPES), 0.7),
    Map("shape_bulk", "Do stretched elements keep the accuracy of a layer across them?", bulk_shape,
        (ASPECT, ORDER, Axis("elements", "elements", 2, 12, whole=True), Axis("ell", r"$\ell$", 0.1, 1.0)),
        ("shape", (*SHAPES, "unstructured triangles")), 0.7),
    Map("shape_ground", "Does the shape of the elements of a user's ground change the contact of a cylinder?", ground_shape,
        (Axis("aspect", "length/height of an element", 1e-2, 1e4, degenerate="both"), ORDER, SPACING, ALPHA),
        ("shape", SHAPES), 0.4),
    Map("oscillation", "Do nodal pressures oscillate, or pull between the nodes?", oscillating,
        (replace(SPACING, low=0.2, high=0.12), choice("order", "order", 1, 2, 3, 4, 6, 8, 10), ALPHA, ANY_NU), LAWS, 0.5),
    Map("oscillation_rule", "Is Gauss's rule steadier than the nodal one?", ruled,
        (SPACING, choice("order", "order", 1, 2, 3, 4), ALPHA, ANY_NU), ("rule", ("nodal", "gauss")), 0.4),
    Map("turned", "Do finite elements follow blocks that are turned far?", turned,
        (Axis("psi0_deg", r"$\psi_0$ (degrees)", 0.0, 20.0, "linear", "both"), ALPHA, ANY_NU,
         choice("reading", "reading", "gap", "lever")),
        ("method", ("fitted", "equal squares")), 0.4),
    Map("fitted_beta_large", "Do fitted elements hold what they promise towards couple stresses?", fitted,
        (BETA_LARGE, NU, ALPHA, Axis("rtol", "rtol", 1e-2, 1e-3)), LAWS, 0.4),
    Map("fitted_beta_small", "Do fitted elements hold what they promise as the coupling vanishes?", fitted,
        (BETA_SMALL, NU, ALPHA, Axis("rtol", "rtol", 1e-2, 1e-3)), LAWS, 0.4),
)
