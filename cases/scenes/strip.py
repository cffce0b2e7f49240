"""Infinite strip with rotated microblocks, compressed by two rigid planes (section 4.1).

Geometry   thickness 2 H; by symmetry the half 0 <= x2 <= H, u1 = u2 = 0 at x2 = 0. The blocks of
           the surface are rotated by psi0; the plane at x2 = H starts in touch with one corner of each
           and moves by delta. Fields depend on x2 only.
Equations  (10)-(18) in the strip, the corner gaps (42), (43) at the surface.
Model      line: the depth alone, a 1D mesh; column: one column of 2D elements, periodic sideways.
           Both run the contact terms (31), (37).
Reference  the closed form (46)-(49), microblock.model.closed_forms; not used in the computation.
Look at    the layers of thickness ell/sqrt(beta) in psi and u1, and the kink of everything at
           delta_fc, where the second corner closes.
Units      lengths over H, stresses over mu.
"""

import time
from dataclasses import asdict, dataclass, fields, replace

import numpy as np

import microblock as mb
from microblock.data.records import column, versions
from microblock.errors import at_most, out_of_reach
from microblock.fem import meshes
from microblock.fem.facets import ContactFacets
from microblock.fem.newton import METHODS, MonolithicNewton, NodalState
from microblock.fem.newton_path import next_event
from microblock.model.refinement import refine
from microblock.model.zones import layer_lengths, relative_error

from ..common.case import profiles
from ..common.options import Checked, coupling, option, poisson
from ..common.records import print_entries

MODELS = ("line", "column")
RTOL = (1e-9, 1e-6, 1e-3)  # where nothing is asked for: the first that rounding allows
PAPER = dict(order=1, elements=20)  # the paper's mesh of the half-thickness
ORDERS = (2, 4, 6, 8, 10, 12, 14, 16)
LAYERS_PER_ELEMENT = 8  # of the coarsest mesh: exp(-8) over an element is within reach of order 16
DOUBLINGS = 3  # of the coarsest mesh before the refinement ends
MOST_ELEMENTS = 4000
AT_EVENT = 1e-11  # relative distance to delta_fc that counts as "at" it: rounding of a solve
SMALL_ANGLE = np.radians(10)  # beyond it sin and tan leave the small-angle form (41) by over 1 %


@dataclass(frozen=True)
class Parameters(Checked):
    ell_over_H: float = option(0.5, "length scale of the material over H", at_least=1e-6, at_most=1e6)
    psi0_deg: float = option(
        1.0, "initial rotation of the blocks in degrees, counterclockwise", at_least=-45, at_most=45
    )
    nu: float = poisson()
    beta: float = coupling()
    delta_over_H: float = option(
        0.02, "approach of each plane over H, counted from first touch", at_least=-1, at_most=1
    )
    curvature: float = option(2.0, "coefficient gamma' of the curvature energy", at_least=1e-6, at_most=1e6)
    model: str = option("line", "depth alone, or one periodic column of 2D elements", str, choices=MODELS)
    method: str = option("al", "augmented Lagrangian or penalty", str, choices=METHODS)
    rho: float | None = option(
        None,
        "regularisation over mu/H; without it the stiffness of the strip (al), "
        "or what rtol asks for (penalty)",
        at_least=1e-12,
        at_most=1e16,
    )
    order: int | None = option(
        None,
        "polynomial order of u and psi, 1 to 20 (1 if only --elements is given)",
        int,
        at_least=1,
        at_most=20,
    )
    elements: int | None = option(
        None,
        "elements per half-thickness (20 if only --order is given)",
        int,
        at_least=1,
        at_most=MOST_ELEMENTS,
    )
    rtol: float | None = option(
        None,
        "relative L2 error asked for; chooses order and elements, not together "
        f"with them ({RTOL[0]:g} if nothing is given)",
        above=0,
        below=1,
        not_with={"order": "it chooses the order", "elements": "it chooses the elements"},
    )

    @property
    def psi0(self):
        """Initial rotation in radians."""
        return float(np.radians(self.psi0_deg))

    @property
    def solid(self):
        """The material in units of mu and H."""
        return mb.Cosserat(
            E=2 * (1 + self.nu), nu=self.nu, ell=self.ell_over_H, beta=self.beta, curvature=self.curvature
        )

    def resolved(self):
        """These parameters with every default filled in that does not need a computation."""
        if self.order is None and self.elements is None:
            return replace(self, rtol=RTOL[0] if self.rtol is None else self.rtol)
        return replace(self, order=self.order or PAPER["order"], elements=self.elements or PAPER["elements"])


@dataclass(frozen=True)
class Solution:
    """One discretisation of the strip, solved: its fields over the depth and its state."""

    parameters: Parameters
    newton: MonolithicNewton
    state: NodalState
    delta_fc: float
    setup: float
    solve: float

    def fields(self, x2):
        """psi (n,) and u (2, n) over H at the depths x2, array (n,) in [0, 1]."""
        mesh = self.newton.body.mesh
        if mesh.dim == 1:
            points = mesh(np.asarray(x2) - 1)
        else:
            side = max(vertex.point[0] for vertex in mesh.vertices)
            points = mesh(np.full(np.shape(x2), side / 2), np.asarray(x2) - 1)
        u1, u2, psi = (field(points).ravel() for field in self.state.fields)
        return psi, np.array((u1, u2))

    def rule(self):
        """Gauss points and weights over the half-thickness, exact for what the errors need."""
        elements, order = self.parameters.elements, self.parameters.order
        points, weights = np.polynomial.legendre.leggauss(order + 8)
        left = np.arange(elements)[:, None]
        return ((left + (points + 1) / 2) / elements).ravel(), np.tile(weights / (2 * elements), elements)


def solve_once(parameters, mesh=None):
    """The strip on the mesh (of its model, if it is given) and with the order that the parameters name."""
    start = time.perf_counter()
    build = meshes.line if parameters.model == "line" else meshes.column
    body = mb.Body(
        mesh or build(1.0, parameters.elements),
        parameters.solid,
        parameters.order,
        fixed={"u1": "middle", "u2": "middle"},
        periodic=parameters.model == "column",
    )
    # counted from first touch: the plane begins over the corner that sticks out
    plane = mb.Plane(parameters.ell_over_H / 2 * abs(parameters.psi0))
    facets = ContactFacets(body, mb.Microblock(parameters.psi0), plane)
    newton = MonolithicNewton(body, facets, method=parameters.method, rho=parameters.rho)
    ready = time.perf_counter()
    delta_fc = full_contact(newton, parameters.psi0)
    state = newton.solve(parameters.delta_over_H)
    done = time.perf_counter()
    return Solution(replace(parameters, rho=newton.rho), newton, state, delta_fc, ready - start, done - ready)


def full_contact(newton, psi0):
    """The approach delta_fc at which the lagging corner closes: the event ahead of two partial states."""
    gaps = newton.facets.initial_gaps
    lag = float(np.abs(gaps["A"] - gaps["B"]).max())
    if lag == 0:
        return 0.0
    # closes the lag if the blocks rotate as if free, so delta_fc lies above
    rigid = lag / 2 * (1 - abs(psi0))
    event = next_event(*(newton.solve(share * rigid) for share in (0.25, 0.5)))
    if event is None:
        raise mb.NotConverged(
            f"the lagging corner does not close: rounding at rho = {newton.rho:g}; take a smaller rho"
        )
    return event.level


def solve(parameters):
    """The strip to the accuracy, or on the discretisation, that the resolved parameters ask for.

    Returns (Solution, error estimate or None, all solutions on the way); raises NotConverged where
    rounding, or a rho given, keeps from the accuracy.
    """
    passes = []

    def level(discretisation):
        passes.append(solve_once(replace(parameters, **discretisation, rtol=None)))
        return passes[-1]

    if parameters.rtol is None:
        return level({}), None, passes
    solution, estimate = refine(level, refinements(parameters), distance, parameters.rtol)
    if parameters.method == "penalty" and parameters.rho is not None:
        estimate += penetration_error(solution, level)
    return solution, estimate, passes


def refinements(parameters):
    """Orders 2 to 16 on a mesh of the layer's scale, then on its halvings; rho rises along unless it is
    given.
    """
    solid = parameters.solid
    coarsest = max(1, int(np.ceil(1 / (LAYERS_PER_ELEMENT * solid.layer_length))))
    if coarsest > MOST_ELEMENTS:
        raise mb.NotConverged(
            f"the layer of thickness {solid.layer_length:.1e} H is too thin for a uniform "
            f"mesh of {MOST_ELEMENTS} elements; take a larger ell_over_H"
        )
    for doubling in range(DOUBLINGS + 1):
        for order in ORDERS:
            step = dict(elements=coarsest * 2**doubling, order=order)
            if parameters.method == "penalty" and parameters.rho is None:
                # its error falls along with the mesh's
                step["rho"] = (solid.lam + 2 * solid.mu) * 10.0 ** (order // 2 + 1)
            yield step


def distance(coarse, fine):
    """Estimated relative error: of psi and u in L2, delta_fc and forces by their difference, and what
    rounding leaves.
    """
    x2, weights = fine.rule()
    parameters = fine.parameters
    scale = abs(parameters.delta_over_H)
    errors = [relative_error(*pair, weights, scale) for pair in zip(coarse.fields(x2), fine.fields(x2))]
    errors.append(abs(coarse.delta_fc - fine.delta_fc) / (fine.delta_fc or 1.0))
    ell, pressure = parameters.ell_over_H, abs(float(fine.state.traction[0]))
    for name, size in (("traction", 1.0), ("micromoment", ell)):
        pair = (getattr(one.state, name)[:1] for one in (coarse, fine))
        errors.append(relative_error(*pair, np.ones(1), size * pressure))
    errors.append(fine.state.kkt)
    lag = ell * abs(parameters.psi0)
    if lag:  # the corner gaps are differences of lengths as large as delta
        errors.append(np.finfo(float).eps * scale / lag)
    return max(float("inf") if error is None else error for error in errors)


def penetration_error(solution, level):
    """The penalty's own error, like 1/rho, from a state with tenfold rho on the same mesh."""
    parameters = solution.parameters
    stiffer = level(dict(order=parameters.order, elements=parameters.elements, rho=10 * parameters.rho))
    return 10 / 9 * distance(solution, stiffer)


def state_name(solution):
    """separation, partial or full (from delta_fc on, up to rounding)."""
    delta, slack = solution.parameters.delta_over_H, max(AT_EVENT, solution.state.kkt)
    if delta <= 0:
        return "separation"
    return "full" if delta >= solution.delta_fc * (1 - slack) else "partial"


def reference(parameters, curvature=None):
    """The closed form (46)-(49) for these parameters."""
    from microblock.model.closed_forms import Strip

    return Strip(
        ell=parameters.ell_over_H,
        psi0=parameters.psi0,
        nu=parameters.nu,
        beta=parameters.beta,
        delta=parameters.delta_over_H,
        curvature=curvature or parameters.curvature,
    )


def errors(solution):
    """Relative L2 errors over the thickness against the closed form: of psi, of u, and of psi as printed."""
    x2, weights = solution.rule()
    psi, u = solution.fields(x2)
    parameters = solution.parameters
    exact, printed = reference(parameters), reference(parameters, curvature=2.0)
    scale = abs(parameters.delta_over_H)
    return {
        "error_psi": relative_error(psi, exact.psi(x2), weights, scale),
        "error_u": relative_error(u, np.array((exact.u1(x2), exact.u2(x2))), weights, scale),
        "error_psi_paper": relative_error(psi, printed.psi(x2), weights, scale),
    }


def observe(solution, estimate=None):
    """Everything that a solution shows, as plain numbers."""
    state, name = solution.state, state_name(solution)
    micromoment, traction = float(state.micromoment[0]), float(state.traction[0])
    psi, u1 = float(state.psi[0]), float(solution.newton.facets.at_nodes("u1", state.fields.u1)[0])
    lengths = layer_lengths(solution.parameters.solid, psi, u1, micromoment, traction)
    noise = 10 * state.kkt * solution.parameters.ell_over_H * abs(traction)
    if name == "separation" or abs(micromoment) <= noise:
        lengths = (None, None)
    x2 = np.linspace(0, 1, max(solution.parameters.elements, PAPER["elements"]) + 1)
    profile_psi, profile_u = solution.fields(x2)
    return {
        "state": name,
        "psi_surface": psi,
        "u1_surface": u1,
        "u2_surface": float(solution.newton.facets.at_nodes("u2", state.fields.u2)[0]),
        "traction": traction,
        "micromoment": micromoment,
        "delta_fc": solution.delta_fc,
        "L_psi": lengths[0],
        "L_u": lengths[1],
        "error_estimate": estimate,
        "unknowns": solution.newton.unknowns,
        "iterations": state.iterations,
        "kkt": state.kkt,
        "profile": {
            "x2": x2.tolist(),
            "psi": profile_psi.tolist(),
            "u1": profile_u[0].tolist(),
            "u2": profile_u[1].tolist(),
        },
    }


def warnings(parameters):
    """Where the small-strain model leaves its ground."""
    found = []
    if abs(parameters.psi0) > SMALL_ANGLE:
        found.append(f"psi0 = {parameters.psi0_deg:g} degrees: beyond the small-angle form (41)")
    if parameters.delta_over_H <= 0:
        found.append(
            f"delta = {parameters.delta_over_H:g} H: the planes do not press, all fields are zero "
            "(separation)"
        )
    if parameters.delta_over_H > 0.1:
        found.append(f"delta = {parameters.delta_over_H:g} H: beyond small strain")
    if parameters.ell_over_H > 1:
        found.append(f"ell = {parameters.ell_over_H:g} H: the blocks are larger than the half-thickness")
    if parameters.elements:
        longest = meshes.longest_element(parameters.solid, parameters.order)
        if 1 / parameters.elements > longest:
            found.append(
                f"elements of order {parameters.order} longer than {at_most(longest)} H do not resolve "
                "the layer: take more, or a higher order, or ask for an --rtol"
            )
    return found


def result(parameters, quiet=True):
    """The contract's object: parameters as resolved, versions, seconds, observables and errors."""
    asked = parameters.resolved()
    warned = warnings(asked)
    demanded = parameters.rtol is not None or asked.rtol is None
    try:
        solution, estimate, passes = solve(asked)
    except mb.NotConverged as failure:
        if demanded:
            raise
        asked, (solution, estimate, passes) = _as_good_as_it_gets(asked, failure)
        warned.append(f"computed to rtol = {asked.rtol:g}: {failure}")
    if demanded and asked.rtol and estimate > asked.rtol:
        besides = f"take another penalty than rho = {asked.rho:g}, or the augmented Lagrangian"
        raise out_of_reach(asked.rtol, estimate, besides=besides)
    observed = observe(solution, estimate)
    try:
        compared = errors(solution)
    except ModuleNotFoundError:
        compared = dict.fromkeys(("error_psi", "error_u", "error_psi_paper"))
        warned.append("microblock.model.closed_forms is missing: no errors against the closed form")
    return {
        "parameters": {**asdict(solution.parameters), "rtol": asked.rtol},
        "versions": versions(),
        "seconds": {"setup": sum(one.setup for one in passes), "solve": sum(one.solve for one in passes)},
        **observed,
        **compared,
        "warnings": warned,
    }


def _as_good_as_it_gets(asked, failure):
    """Where nothing was asked for and rounding keeps from the first of RTOL: the next that can be had."""
    for rtol in RTOL[1:]:
        try:
            return replace(asked, rtol=rtol), solve(replace(asked, rtol=rtol))
        except mb.NotConverged as another:
            failure = another
    raise failure


def show(answer):
    print_entries(
        answer, [name for name in answer if name not in ("parameters", "versions", "seconds", "profile")]
    )


def rows(parameters, answer):
    """A row a node along the depth, with all numbers of the strip."""
    kept = [
        name for name in answer if name not in ("parameters", "versions", "seconds", "profile", "warnings")
    ]
    return profiles([answer], *kept)


def figure(records):
    """psi and u1 over the depth: markers from the records, on the closed form for the same parameters."""
    from microblock.view import plots

    given = {entry.name: records[0][entry.name] for entry in fields(Parameters)}
    drawing, axes = plots.figure(2, 1, height=1.9)
    for axis, name, symbol in zip(axes, ("psi", "u1"), (r"$\psi$ (rad)", "$u_1/H$")):
        axis.plot(
            column(records, "x2"),
            column(records, name),
            "o",
            color=plots.COLOURS[1],
            label=f"finite elements ({given['model']})",
        )
        axis.set(xlabel="$x_2/H$", ylabel=symbol)
        try:
            exact = reference(Parameters(**given))
        except ModuleNotFoundError:
            continue
        x2 = np.linspace(0, 1, 201)
        axis.plot(x2, getattr(exact, name)(x2), color=plots.COLOURS[0], label="closed form", zorder=1)
    axes[0].legend()
    return drawing


FIGURES = {"strip": (rows, figure)}
