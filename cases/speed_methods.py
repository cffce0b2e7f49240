"""Methods of the study `speed`, as data: a name, what it solves with a setting, and its ladder of settings.

A method's `run(scene, setting)` returns an `Answer`; setup is what further loads of the same scene reuse.
"""

import importlib.util
import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from cases import layers_fe, peers, speed_ngsolve, strip
from cases.speed_scenes import LOAD, NU, OBSTACLE
from microblock import subsurface
from microblock.fitted import FittedContact
from microblock.grid_contact import GridContact, halvings
from microblock.halfplane import HalfPlane, kernels
from microblock.uniform import FAR, UniformContact

REACH = 2.0                # half-width and depth of the region of equal squares over a_Hz, the paper's
PAPER_DOMAIN = 18.0        # over a_Hz
AL_RHO = 2*(1 - NU)**2/(1 - 2*NU)/REACH      # (lambda + 2 mu)/REACH as E* = 2, what `UniformContact` takes by itself
PAPER_SCENE = "microblock-0.25"      # alone has the rungs that take a minute
APPROACH = 4.15            # over a_Hz^2/R, of the far field of the uniform elements, within a percent: the first guess of a peer
WIDENED = 1.1              # window of the cells over the outermost edge of the reference


@dataclass(frozen=True)
class Answer:
    """What a run found: fields for the scene's measure, its size, and processor seconds; psi(x1, x2s) below the surface."""

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
    """A curve of the charts; `settings` from the cheapest on, `kinds` of scenes that it can do, `dear` settings for one scene."""

    name: str
    run: Callable
    settings: tuple
    kinds: tuple
    needs: str | None = None
    dear: tuple = ()

    def rungs(self, scene):
        """Settings for a scene."""
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
    contact = scene.half_plane
    contact.line.kernel(np.ones(1), np.zeros(1), np.zeros(1))      # the kernels' table of the material
    ready = clock()
    state = contact.at(LOAD, rtol=rtol)
    return Answer(scene.fields(state), len(state.q) + 1, len(state.q), ready - start, clock() - ready, state.iterations,
                  state.error_estimate, lambda x1, x2: subsurface.fields(state, x1, x2).psi)


def fitted(scene, rtol):
    """Every load has meshes of its own: nothing is setup."""
    start = clock()
    state = FittedContact(scene.solid, OBSTACLE, scene.law).at(LOAD, rtol)
    psi = _below(scene, state)
    return Answer(scene.fields(state), int(state.unknowns), len(state.body.weights), 0.0, clock() - start, state.iterations,
                  state.estimate.total, psi)


def _below(scene, state):
    """(x1, x2s) -> psi of a state of finite elements; where a scene asks for it the back-substitution is part of the work."""
    if not scene.deep:
        return None
    function = state.fields.psi
    return lambda x1, x2: layers_fe.along(state, function, (x1,), x2)[0]


def uniform(scene, h, order=1, solver="condensed", rho=None, domain=math.inf, shape="quadrilaterals", rule="nodal", reach=REACH):
    start = clock()
    contact = UniformContact(scene.solid, OBSTACLE, scene.law, domain, h, order, reach, solver, rho, shape, rule)
    contact.prepare()
    ready = clock()
    state, = contact.states([LOAD])
    psi = _below(scene, state)
    return Answer(scene.fields(state), int(state.unknowns), len(state.body.weights), ready - start, clock() - ready,
                  state.iterations, psi=psi)


def cells(scene, nodes):
    start = clock()
    window = WIDENED*scene.outer
    contact = GridContact(HalfPlane(scene.solid), OBSTACLE, scene.law, window=(-window, window))
    for size in halvings(nodes):
        contact.prepare(size)
    ready = clock()
    state = contact.at(LOAD, nodes=nodes)
    p, moment = state.pressures.sum(axis=0), state.micromoment/scene.solid.ell
    return Answer(lambda x: (np.interp(x, state.x, p), np.interp(x, state.x, moment)), state.pressures.size, nodes, ready - start,
                  clock() - ready, state.products, state.error_estimate)


def tamaas(scene, nodes, period, residual):
    """E* = 2 here and 1 there: half the load gives half the pressures on the same zone."""
    import tamaas as library
    library.initialize(1)      # threads
    library.set_log_level(library.LogLevel.error)
    x = (np.arange(nodes) - nodes//2)*period/nodes
    spent = clock()
    p, setup, solve = peers.solve(-x**2/2, period, LOAD/2/period, residual)
    total, wall = clock() - spent, setup + solve
    return Answer(lambda at: (2*np.interp(at, x, p, left=0, right=0), 0*at), nodes, nodes, total*setup/wall, total*solve/wall)


def scikit_fem(scene, h, order):
    """The load of the half; the exact contact as first guess."""
    from cases import speed_skfem as library
    start = clock()
    ground = library.Ground(scene.solid.lam, scene.solid.mu, FAR*REACH, REACH, h, order)
    ground.prepare()
    ready = clock()
    found = ground.solve(OBSTACLE.height, LOAD/2, scene.outer)
    spent = clock() - ready
    return Answer(lambda x: (found.pressure(np.abs(x)), 0*x), ground.unknowns, len(found.x), ready - start, spent,
                  found.iterations)


def contact_boundary(scene, h, order, rho):
    """The load of the half; the better one of two readings of the pressure."""
    start = clock()
    ground = speed_ngsolve.Ground(scene.solid.lam, scene.solid.mu, FAR*REACH, REACH, h, order, rho)
    ground.prepare()
    ready = clock()
    found = ground.solve(LOAD/2, APPROACH)
    spent = clock() - ready
    readings = [lambda x, read=read: (read(np.abs(x)), 0*x) for read in (found.by_penetration, found.by_forces)]
    best = min(readings, key=lambda fields: scene.errors(fields)["error_p"])
    return Answer(best, ground.unknowns, order*(len(found.ends) - 1) + 1, ready - start, spent, found.iterations)


def the_strip(scene, solver="al", **setting):
    parameters = replace(strip.Parameters(), method=solver, **setting)
    solution, estimate, passes = strip.solve(parameters if parameters.rtol else parameters.resolved())
    return Answer(solution, int(solution.newton.unknowns), len(solution.newton.facets.weights), sum(one.setup for one in passes),
                  sum(one.solve for one in passes), solution.state.iterations, estimate)


def ladder(name, values, **fixed):
    """Settings in which one parameter takes these values."""
    return tuple({name: value, **fixed} for value in values)


def elements(hs, order, solver="condensed", **chosen):
    """Settings of a uniform mesh: condensed on an unbounded domain (none in the record), all else on the paper's."""
    more = {"reach": REACH, "shape": "quadrilaterals", "rule": "nodal"}
    if solver != "condensed":
        more |= {"domain": PAPER_DOMAIN, "rho": AL_RHO}
    return ladder("h", hs, order=order, solver=solver, **{**more, **chosen})


PEER_RHOS = 1e2, 10**2.5, 1e3, 1e4                     # of NGSolve's ContactBoundary, as RHOS
RHOS = tuple(10.0**power for power in range(1, 7))      # stress per length, E* = 2 over a_Hz = 1
HS = {1: (0.4, 0.2, 0.1, 0.05), 2: (0.8, 0.4, 0.2, 0.1), 4: (2.0, 1.0, 0.5, 0.25), 6: (2.0, 1.0, 0.5)}      # by order
STRIP_RHOS = 1e2, 1e3, 1e4, 1e5, 1e6, 1e8, 1e12        # over mu/H
LINES = ("line", "classical")


def penalties(hs):
    """Settings of the penalty: each h with all of RHOS."""
    return tuple(setting for h in hs for rho in RHOS for setting in elements((h,), 1, "penalty", rho=rho))


METHODS = (
    Method("half-plane", half_plane, ladder("rtol", (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)), LINES),
    Method("fitted fe", fitted, ladder("rtol", (1e-2, 1e-3, 1e-4, 1e-5)), LINES),
    *(Method(f"condensed, order {order}", uniform, elements(hs, order), LINES) for order, hs in HS.items()),
    *(Method(f"triangles, order {order}", uniform, elements(hs[:3], order, shape="triangles"), LINES,
             dear=elements(hs[3:], order, shape="triangles")) for order, hs in HS.items()),
    Method("paper's way", uniform, elements((0.4, 0.2, 0.1, 0.05), 1, "al"), LINES, dear=elements((0.02,), 1, "al")),
    Method("AL, triangles", uniform, elements((0.4, 0.2, 0.1), 1, "al", shape="triangles"), LINES),
    Method("AL, order 2", uniform, elements((0.8, 0.4, 0.2), 2, "al"), LINES, dear=elements((0.1,), 2, "al")),
    Method("AL, Gauss", uniform, elements((0.4, 0.2, 0.1), 1, "al", rule="gauss"), LINES),
    Method("AL, order 2, Gauss", uniform, elements((0.8, 0.4, 0.2), 2, "al", rule="gauss"), LINES,
           dear=elements((0.1,), 2, "al", rule="gauss")),
    Method("penalty", uniform, penalties((0.4, 0.2, 0.1)), LINES, dear=penalties((0.05,))),
    Method("cells", cells, ladder("nodes", (128, 512, 2048, 8192, 32768)), LINES),
    Method("tamaas", tamaas, tuple({"nodes": nodes, "period": period, "residual": 1e-7} for nodes in (512, 2048, 8192, 32768)
                                     for period in (24, 48, 96, 192)), ("classical",), "tamaas"),
    *(Method(f"scikit-fem, order {order}", scikit_fem, ladder("h", sizes, order=order), ("classical",), "skfem")
      for order, sizes in ((1, (0.4, 0.2, 0.1, 0.05)), (2, (0.8, 0.4, 0.2, 0.1)))),
    *(Method(f"ContactBoundary, order {order}", contact_boundary,
             tuple({"h": h, "order": order, "rho": rho} for h in sizes for rho in PEER_RHOS), ("classical",))
      for order, sizes in ((1, (0.4, 0.2, 0.1, 0.05)), (2, (0.8, 0.4, 0.2, 0.1)), (4, (1.0, 0.5, 0.25)))),
    Method("line, rtol", the_strip, ladder("rtol", (1e-2, 1e-4, 1e-6, 1e-8, 1e-10)), ("strip",)),
    Method("line, order 2", the_strip, ladder("elements", (2, 8, 32, 128), order=2), ("strip",)),
    Method("line, order 4", the_strip, ladder("elements", (1, 2, 4, 8, 16, 32), order=4), ("strip",)),
    Method("line, order 6", the_strip, ladder("elements", (1, 2, 4, 8), order=6), ("strip",)),
    Method("paper's way", the_strip, ladder("elements", (5, 10, 20, 80, 320), order=1, model="column"), ("strip",)),
    Method("penalty", the_strip, tuple({"elements": elements, "order": 1, "model": "column", "solver": "penalty", "rho": rho}
                                       for elements in (5, 20, 80, 320) for rho in STRIP_RHOS), ("strip",)),
)
NAMES = tuple(dict.fromkeys(method.name for method in METHODS))
