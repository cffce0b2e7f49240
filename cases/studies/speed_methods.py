"""Methods of the study `speed`, as data: a name, what it solves with a setting, and its settings by level.

A method's `run(scene, setting)` returns an `Answer`; setup is what further loads of the same problem reuse.
"""

import importlib.util
import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

import microblock as mb
from microblock.halfplane.cell_solver import halvings
from microblock.halfplane.kernels import gap_kernel, kernels

from ..common.three_ways import seen
from ..scenes import strip
from .speed_scenes import LOAD, NU, OBSTACLE

REACH = 2.0  # half-width and depth of the region of equal squares over a_Hz, the paper's
PAPER_DOMAIN = 18.0  # over a_Hz
FAR = 1000.0  # over REACH, size of an unbounded block as of microblock.fem.uniform
# (lambda + 2 mu)/REACH as E* = 2, what `Uniform` takes by itself
AL_RHO = 2 * (1 - NU) ** 2 / (1 - 2 * NU) / REACH
PAPER_SCENE = "microblock-0.25"  # alone has the levels that take a minute
# over a_Hz^2/R, of the far field of the uniform elements, within a percent: the first guess of a peer
APPROACH = 4.15
WIDENED = 1.1  # window of the cells over the outermost edge of the reference
SKIN = 1e-9  # over a_Hz: depth at which fields of elements "at" the surface are taken


@dataclass(frozen=True)
class Answer:
    """What a run found: fields for the problem's measure, its size, and processor seconds; psi(x1, x2s) below
    the surface.
    """

    found: object
    unknowns: int
    contact_nodes: int
    setup: float
    solve: float
    iterations: int | None = None
    estimate: float | None = None
    psi: Callable | None = None


@dataclass(frozen=True)
class Method:
    """A curve of the charts; `settings` from the cheapest on, `kinds` of problems that it can do, `dear`
    settings for one of them.
    """

    name: str
    run: Callable
    settings: tuple
    kinds: tuple
    needs: str | None = None
    dear: tuple = ()

    def levels(self, scene):
        """Settings for a problem."""
        return self.settings + (self.dear if scene.name == PAPER_SCENE else ())

    @property
    def available(self):
        """Whether the package that it needs is installed."""
        return self.needs is None or importlib.util.find_spec(self.needs) is not None


def clock():
    """Processor seconds: what other programs do on this machine does not count."""
    return time.process_time()


def half_plane(scene, rtol):
    start = clock()
    kernels.cache_clear()
    problem = scene.half_plane
    # the kernels' table of the material
    gap_kernel(problem.solver.problem, np.ones(1), np.zeros(1), np.zeros(1))
    ready = clock()
    state = problem.solve(load=LOAD, rtol=rtol)
    return Answer(
        seen(state),
        state.unknowns,
        state.unknowns - 1,
        ready - start,
        clock() - ready,
        state.iterations,
        state.error_estimate,
        lambda x1, x2: state.fields(x1, x2).psi,
    )


def fitted(scene, rtol):
    """Every load has meshes of its own: nothing is setup."""
    start = clock()
    state = scene.half_plane.with_(body=mb.Block(scene.solid)).solve(load=LOAD, rtol=rtol)
    psi = _below(scene, state)
    return Answer(
        seen(state),
        int(state.unknowns),
        nodes_of(state),
        0.0,
        clock() - start,
        state.iterations,
        state.error_estimate,
        psi,
    )


def _below(scene, state):
    """(x1, x2s) -> psi of a state of finite elements; where a problem asks for it the back-substitution is
    part of the work.
    """
    if not scene.deep:
        return None
    fields = state.fields
    return lambda x1, x2: fields(x1, np.minimum(x2, -SKIN)).psi


def nodes_of(state):
    """Contact nodes of the computed part of a state of finite elements."""
    return len(state.solution.body.weights)


def on_squares(scene, h, order, solver, domain, **more):
    """The problem of a block on equal squares; `solver`: "condensed", "al" or "penalty"."""
    rho = more.pop("rho", None)
    newton = None if solver == "condensed" else mb.Newton(solver, rho)
    method = mb.Uniform(h=h, order=order, newton=newton, **more)
    return scene.half_plane.with_(body=mb.Block(scene.solid, domain), method=method)


def uniform(
    scene, h, order=1, solver="condensed", rho=None, domain=math.inf, shape="quadrilaterals", reach=REACH
):
    start = clock()
    problem = on_squares(scene, h, order, solver, domain, rho=rho, shape=shape, reach=reach)
    problem.solver.prepare()
    ready = clock()
    state = problem.solve(load=LOAD)
    psi = _below(scene, state)
    return Answer(
        seen(state),
        int(state.unknowns),
        nodes_of(state),
        ready - start,
        clock() - ready,
        state.iterations,
        psi=psi,
    )


def cells(scene, nodes):
    start = clock()
    window = WIDENED * scene.outer
    problem = on_cells(scene, nodes, window)
    ready = clock()
    state = problem.solve(load=LOAD)
    p, moment = state.pressure, state.micromoment / scene.solid.ell
    return Answer(
        lambda x: (np.interp(x, state.x, p), np.interp(x, state.x, moment)),
        state.unknowns,
        nodes,
        ready - start,
        clock() - ready,
        state.iterations,
        state.error_estimate,
    )


def on_cells(scene, nodes, window):
    """The problem on cells between -window and window, with all that further loads reuse."""
    method = mb.Cells(nodes=nodes, window=(-window, window))
    problem = mb.Contact(mb.HalfPlane(scene.solid), OBSTACLE, scene.law, method)
    for size in halvings(nodes):
        problem.solver.prepare(size)
    return problem


def tamaas(scene, nodes, period, residual):
    """E* = 2 here and 1 there: half the load gives half the pressures on the same zone."""
    import tamaas as library

    library.initialize(1)  # threads
    library.set_log_level(library.LogLevel.error)
    x = (np.arange(nodes) - nodes // 2) * period / nodes
    start = clock()
    model = library.ModelFactory.createModel(library.model_type.basic_1d, [float(period)], [nodes])
    model.E, model.nu = 1.0, 0.0
    solver = library.PolonskyKeerRey(model, -(x**2) / 2, residual)
    ready = clock()
    solver.solve(LOAD / 2 / period)
    spent, p = clock() - ready, np.array(model.traction).ravel()
    return Answer(
        lambda at: (2 * np.interp(at, x, p, left=0, right=0), 0 * at), nodes, nodes, ready - start, spent
    )


def scikit_fem(scene, h, order):
    """The load of the half; the exact contact as first guess."""
    from . import speed_skfem as library

    start = clock()
    ground = library.Ground(scene.solid.lam, scene.solid.mu, FAR * REACH, REACH, h, order)
    ground.prepare()
    ready = clock()
    found = ground.solve(OBSTACLE.height, LOAD / 2, scene.outer)
    spent = clock() - ready
    return Answer(
        lambda x: (found.pressure(np.abs(x)), 0 * x),
        ground.unknowns,
        len(found.x),
        ready - start,
        spent,
        found.iterations,
    )


def contact_boundary(scene, h, order, rho):
    """The load of the half; the better one of two ways to read the pressure."""
    from . import speed_ngsolve

    start = clock()
    ground = speed_ngsolve.Ground(scene.solid.lam, scene.solid.mu, FAR * REACH, REACH, h, order, rho)
    ground.prepare()
    ready = clock()
    found = ground.solve(LOAD / 2, APPROACH)
    spent = clock() - ready
    readings = [
        lambda x, read=read: (read(np.abs(x)), 0 * x) for read in (found.by_penetration, found.by_forces)
    ]
    best = min(readings, key=lambda fields: scene.errors(fields)["error_p"])
    return Answer(
        best, ground.unknowns, order * (len(found.ends) - 1) + 1, ready - start, spent, found.iterations
    )


def the_strip(scene, solver="al", **setting):
    parameters = replace(strip.Parameters(), method=solver, **setting)
    solution, estimate, passes = strip.solve(parameters if parameters.rtol else parameters.resolved())
    return Answer(
        solution,
        int(solution.newton.unknowns),
        len(solution.newton.facets.weights),
        sum(one.setup for one in passes),
        sum(one.solve for one in passes),
        solution.state.iterations,
        estimate,
    )


def levels(name, values, **fixed):
    """Settings in which one parameter takes these values."""
    return tuple({name: value, **fixed} for value in values)


def elements(hs, order, solver="condensed", **chosen):
    """Settings of a uniform mesh: condensed on an unbounded block (none in the record), all else on that of
    the paper.
    """
    more = {"reach": REACH, "shape": "quadrilaterals"}
    if solver != "condensed":
        more |= {"domain": PAPER_DOMAIN, "rho": AL_RHO}
    return levels("h", hs, order=order, solver=solver, **{**more, **chosen})


PEER_RHOS = 1e2, 10**2.5, 1e3, 1e4  # of NGSolve's ContactBoundary, as RHOS
RHOS = tuple(10.0**power for power in range(1, 7))  # stress per length, E* = 2 over a_Hz = 1
# by order
HS = {1: (0.4, 0.2, 0.1, 0.05), 2: (0.8, 0.4, 0.2, 0.1), 4: (2.0, 1.0, 0.5, 0.25), 6: (2.0, 1.0, 0.5)}
STRIP_RHOS = 1e2, 1e3, 1e4, 1e5, 1e6, 1e8, 1e12  # over mu/H
LINES = ("line", "classical")


def penalties(hs):
    """Settings of the penalty: each h with all of RHOS."""
    return tuple(setting for h in hs for rho in RHOS for setting in elements((h,), 1, "penalty", rho=rho))


METHODS = (
    Method("half-plane", half_plane, levels("rtol", (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)), LINES),
    Method("fitted fe", fitted, levels("rtol", (1e-2, 1e-3, 1e-4, 1e-5)), LINES),
    *(Method(f"condensed, order {order}", uniform, elements(hs, order), LINES) for order, hs in HS.items()),
    *(
        Method(
            f"triangles, order {order}",
            uniform,
            elements(hs[:3], order, shape="triangles"),
            LINES,
            dear=elements(hs[3:], order, shape="triangles"),
        )
        for order, hs in HS.items()
    ),
    Method(
        "AL, order 1",
        uniform,
        elements((0.4, 0.2, 0.1, 0.05), 1, "al"),
        LINES,
        dear=elements((0.02,), 1, "al"),
    ),
    Method("AL, order 2", uniform, elements((0.8, 0.4, 0.2), 2, "al"), LINES, dear=elements((0.1,), 2, "al")),
    Method("penalty", uniform, penalties((0.4, 0.2, 0.1)), LINES, dear=penalties((0.05,))),
    Method("cells", cells, levels("nodes", (128, 512, 2048, 8192, 32768)), LINES),
    Method(
        "tamaas",
        tamaas,
        tuple(
            {"nodes": nodes, "period": period, "residual": 1e-7}
            for nodes in (512, 2048, 8192, 32768)
            for period in (24, 48, 96, 192)
        ),
        ("classical",),
        "tamaas",
    ),
    *(
        Method(
            f"scikit-fem, order {order}", scikit_fem, levels("h", sizes, order=order), ("classical",), "skfem"
        )
        for order, sizes in ((1, (0.4, 0.2, 0.1, 0.05)), (2, (0.8, 0.4, 0.2, 0.1)))
    ),
    *(
        Method(
            f"ContactBoundary, order {order}",
            contact_boundary,
            tuple({"h": h, "order": order, "rho": rho} for h in sizes for rho in PEER_RHOS),
            ("classical",),
        )
        for order, sizes in ((1, (0.4, 0.2, 0.1, 0.05)), (2, (0.8, 0.4, 0.2, 0.1)), (4, (1.0, 0.5, 0.25)))
    ),
    Method("line, rtol", the_strip, levels("rtol", (1e-2, 1e-4, 1e-6, 1e-8, 1e-10)), ("strip",)),
    Method("line, order 2", the_strip, levels("elements", (2, 8, 32, 128), order=2), ("strip",)),
    Method("line, order 4", the_strip, levels("elements", (1, 2, 4, 8, 16, 32), order=4), ("strip",)),
    Method("line, order 6", the_strip, levels("elements", (1, 2, 4, 8), order=6), ("strip",)),
    Method(
        "AL, order 1",
        the_strip,
        levels("elements", (5, 10, 20, 80, 320), order=1, model="column"),
        ("strip",),
    ),
    Method(
        "penalty",
        the_strip,
        tuple(
            {"elements": elements, "order": 1, "model": "column", "solver": "penalty", "rho": rho}
            for elements in (5, 20, 80, 320)
            for rho in STRIP_RHOS
        ),
        ("strip",),
    ),
)
NAMES = tuple(dict.fromkeys(method.name for method in METHODS))
