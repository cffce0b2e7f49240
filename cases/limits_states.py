"""Maps of contact states without a mesh of their own: active sets, uniform cells, users' meshes, fields below the surface."""

from functools import lru_cache, partial

import numpy as np

import microblock as mb
from cases import bodies, layers, rough, wavy
from cases.limits_maps import Axis, Map, Outcome
from microblock import active_set, subsurface
from microblock.errors import NotConverged
from microblock.panels import zone_edges

LOAD = np.pi/2                # with E* = 2 and R = 1: a_Hz = 1
NU = 0.3
KKT = 1e-10                   # what `active_set` promises
SETS = 1000                   # of a plain active set before it counts as lost
LINE = 1e-6                   # rtol of the contact line where it judges
THIN = 1e-3                   # alpha below which Hertz judges: he is off by about as much
RESIDUAL = 1e-7               # of a grid whose state is known in closed form: some hundred times the residual asked for
FIELDS = 1e-6                 # over the largest pressure: hundred times what `subsurface.fields` promises, for the rules here
BOX = 24                      # Gauss points on a side of the box whose equilibrium is looked at


# contact states on a compliance

def _spd(rng, size, logarithm):
    """A positive definite matrix whose eigenvalues are spread evenly in the logarithm over so many decades."""
    basis = np.linalg.qr(rng.normal(size=(size, size)))[0]
    return (basis*10.0**rng.uniform(-logarithm, 0, size)) @ basis.T


def _references():
    from microblock import references      # judge only: the computation does without
    return references


def _residual(H, g0, c, state, load):
    """Largest relative residual of (a) from the data alone, as the tests of `active_set` measure it."""
    touch, share = np.isfinite(g0), c*state.forces
    H, g0, share = H[np.ix_(touch, touch)]/c[touch, None]/c[touch], g0[touch]/c[touch], share[touch]
    gaps = g0 - state.approach + H @ share
    length = (np.abs(g0) + abs(state.approach) + np.abs(H) @ share)[state.closed[touch]].max(initial=0) or 1.0
    return max(0.0, -gaps.min()/length, np.abs(share*gaps).sum()/(share.sum()*length), -share.min()/load,
               abs(share.sum() - load)/load)


def _plain(H, g0, load):
    """(forces, approach, sets tried) by the primal-dual active set as it is written most often."""
    closed, seen = g0 - g0.min() <= 0, set()
    for steps in range(1, SETS):
        chosen = np.flatnonzero(closed)
        one = np.ones((len(chosen), 1))
        system = np.block([[H[np.ix_(chosen, chosen)], -one], [one.T, np.zeros((1, 1))]])
        solution = np.linalg.lstsq(system, np.append(-g0[chosen], load), rcond=None)[0]
        forces, approach = np.zeros(len(g0)), solution[-1]
        forces[chosen] = solution[:-1]
        gaps = g0 - approach + H @ forces
        fresh = np.where(closed, forces > 0, gaps < -1e-13*(np.abs(g0) + np.abs(H) @ np.abs(forces)))
        if np.array_equal(fresh, closed):
            return forces, approach, steps
        if fresh.tobytes() in seen or not fresh.any():
            raise NotConverged(f"the plain active set {'cycles' if fresh.any() else 'opens every corner'} after {steps} sets; "
                               "active_set.solve does not", iterations=steps)
        seen.add(fresh.tobytes())
        closed = fresh
    raise NotConverged(f"the plain active set still changes after {SETS} sets", iterations=SETS)


def random_states(method, condition, size, load, start, seed):
    """Forces of a random problem of a condition number 10^condition."""
    rng, size = np.random.default_rng(int(seed)), int(round(size))
    H, g0, c = _spd(rng, size, condition), rng.normal(size=size), np.ones(size)
    return _solved(method, H, g0, c, load, start, rng)


def _solved(method, H, g0, c, load, start, rng):
    if method == "plain":
        forces, approach, steps = _plain(H/c/c[:, None], g0/c, load)
        state = active_set.ContactState(forces/c, g0, forces > 0, approach, load, steps, 0, 0, 0.0, 0.0)
    elif method == "path":
        state = active_set.path(H, g0, [load/7, load], c=c).states[1]
    else:
        first = active_set.solve(H, g0, load=load, c=c)
        closed = {"nothing": None, "near": active_set.solve(H, g0, load=0.9*load, c=c).closed, "absurd": ~first.closed,
                  "random": rng.random(len(g0)) < 0.5}[start]
        state = active_set.solve(H, g0, load=load, c=c, start=closed)
    return Outcome(_residual(H, g0, c, state, load), KKT, state.iterations, state.kkt, "load path" if state.followed else None)


def degenerate_states(problem, degree, size, method, seed):
    """Forces of a problem that is degenerate up to `degree`: vanishing weights, copies, no gaps, pairs, missing rank."""
    rng, size = np.random.default_rng(int(seed)), int(round(size))
    H, g0, c = _spd(rng, size, 2), np.abs(rng.normal(size=size)), np.ones(size)
    if problem == "weights":      # some stand for next to no surface, as ends of facets of unequal length
        c = np.where(rng.random(size) < 0.5, degree, 1.0)
        H, g0 = H*c*c[:, None], g0*c
    elif problem == "copies":
        copy = rng.integers(0, size, size)
        H, g0 = H[np.ix_(copy, copy)], g0[copy] + degree*rng.choice((0, 1), size)
    elif problem == "no gaps":
        g0 = degree*rng.choice((-1, 0, 1), size)
    elif problem == "pairs":      # corners of one node under a flat obstacle, mirrored
        even, odd = (one + one[::-1, ::-1] for one in (_spd(rng, size, 2), degree*_spd(rng, size, 2)))
        H, c = np.block([[even + odd, even - odd], [even - odd, even + odd]]), np.ones(2*size)
        g0 = np.tile(np.abs(rng.normal(size=size)).round(), 2)
    elif problem == "rank":
        factors = rng.normal(size=(size, max(1, size//3)))
        H = factors @ factors.T + degree*np.eye(size)
    return _solved(method, H, g0, c, 1.0, "nothing", rng)


# uniform cells

def _ground(alpha, beta=1.0):
    return mb.HalfPlane(mb.Cosserat(E=2*(1 - NU**2), nu=NU, ell=alpha, beta=beta))


def cells_of_cylinder(nodes, ratio, slack, psi0, contact):
    """A cylinder on cells; `ratio` is ell over a cell, `slack` what the window is wider than the contact."""
    nodes = int(round(nodes))
    law = mb.Microblock(psi0) if contact == "microblock" else mb.Unilateral()
    alpha = ratio*2/nodes      # the contact is some 2 wide
    if alpha < THIN:
        edges, exact = (-1.0, 1.0), partial(_references().hertz, load=LOAD, half_width=1.0)
    else:
        fitted = mb.Contact(_ground(alpha), mb.Cylinder(1.0), law).at(LOAD, rtol=LINE)
        edges, exact = zone_edges(fitted.all_zones), _total(fitted)
    middle, half = (max(edges) + min(edges))/2, slack*(max(edges) - min(edges))/2
    scene = mb.GridContact(_ground(alpha), mb.Cylinder(1.0), law, (middle - half, middle + half))
    return _beside(scene.at(LOAD, nodes=nodes), exact, None)


def _total(state):
    return lambda x: sum(state.pressure(corner, x) for corner in range(len(state.line.law.corners)))


def _beside(state, exact, rtol):
    true = exact(state.x)
    error = np.linalg.norm(state.pressures.sum(axis=0) - true)/np.linalg.norm(true)
    return Outcome(float(error), rtol, state.products, state.error_estimate)


def cells_asked(alpha, rtol, psi0):
    """A cylinder on as many cells as a tolerance asks for."""
    law = mb.Microblock(psi0)
    fitted = mb.Contact(_ground(alpha), mb.Cylinder(1.0), law).at(LOAD, rtol=LINE)
    reach = 1.5 + alpha
    state = mb.GridContact(_ground(alpha), mb.Cylinder(1.0), law, (-reach, reach)).at(LOAD, rtol=rtol)
    return _beside(state, _total(fitted), rtol)


def waves(contact, load, nodes, ell):
    """A cosine that is pressed flat; loads over that of full closure. Judged in closed form, or by four times as many cells."""
    nodes, parameters = int(round(nodes)), wavy.Parameters(ell_over_wavelength=ell)
    if contact == "unilateral":      # the classical limit, Westergaard's
        state = parameters.scene(contact, wavy.CLASSICAL_BETA).at(load, nodes=nodes)
        error = wavy.polygon_error(state.x, state.pressures[0], _references().Wavy(1.0, 1.0, load).pressure)
        return Outcome(error, None, state.products, state.error_estimate)
    closure, (p1, m1) = wavy.full_closure(parameters.solid(1.0))
    mean, scene = load*closure, parameters.scene(contact, 1.0)
    state = scene.at(mean, nodes=nodes)
    if load < 1:      # no closed form; finer cells
        best = scene.at(mean, nodes=4*nodes)
        true, turning = (np.interp(state.x, best.x, values, period=1.0)
                         for values in (best.pressures.sum(axis=0), best.micromoment))
        promise = None
    else:
        true, turning = mean + p1*np.cos(2*np.pi*state.x), ell*m1/2*np.sin(2*np.pi*state.x)
        promise = RESIDUAL
    wrong = state.pressures.sum(axis=0) - true, (state.micromoment - turning)/ell
    error = max(np.linalg.norm(each) for each in wrong)/np.linalg.norm(true)
    judge = "cells" if promise is None else "closed form"
    return Outcome(float(error), promise, state.products, state.error_estimate, judge=judge)


def roughness(load, ell, psi0_deg, seed):
    """A rough profile and rough psi0, judged by four times as many cells."""
    parameters = rough.Parameters(nodes=1024, shortest=64, ell=ell, load=load, psi0_deg=psi0_deg, seed=int(seed))
    state, best = rough.solve(parameters), rough.reference(parameters)
    p, q = (one.pressures.sum(axis=0) for one in (best, state))
    return Outcome(float(np.linalg.norm(np.interp(best.x, state.x, q) - p)/np.linalg.norm(p)), None, state.products,
                   state.error_estimate)


# users' meshes

LAWS = {"microblock": mb.Microblock(), "turned": mb.Microblock(0.05), "unilateral": mb.Unilateral()}
SIDE = 6.0                    # of the square, over a_Hz


@lru_cache(maxsize=12)
def _square(alpha, contact):
    """The same square on fitted elements, of one order everywhere: a judge makes no use of orders that fall with distance."""
    solid = mb.Cosserat(E=2*(1 - NU**2), nu=NU, ell=alpha, beta=1.0)
    return mb.FittedContact(solid, mb.Cylinder(1.0), LAWS[contact], SIDE, even=True).at(LOAD, 1e-3)


def _body(alpha, spacing, order, grading=1.0):
    """The square by netgen, its contact boundary in pieces; every other one is `grading` times shorter."""
    solid = mb.Cosserat(E=2*(1 - NU**2), nu=NU, ell=alpha, beta=1.0)
    return mb.Body(_mesh(SIDE, 1.8, spacing, grading), solid, order, fixed="bottom")


def own_mesh(spacing, order, alpha, contact):
    """A user's mesh as it is, from a handful of contact nodes on."""
    order = int(round(order))
    state = mb.Contact(_body(alpha, spacing, order), mb.Cylinder(1.0), LAWS[contact]).at(LOAD)
    other = _square(alpha, contact)
    return Outcome(state.difference(other.pressure), None, state.iterations, state.kkt)


def asked_of_mesh(rtol, alpha, contact):
    """A user's coarse mesh, refined until a tolerance holds."""
    state = mb.Contact(_body(alpha, 0.5, 3), mb.Cylinder(1.0), LAWS[contact]).at(LOAD, rtol)
    other = _square(alpha, contact)
    return Outcome(state.difference(other.pressure), rtol + other.estimate.total, state.unknowns, state.error_estimate)


def graded_mesh(grading, order, load, contact):
    """Facets of two lengths, so that the weights of nodes differ by their ratio times that of Lobatto's: KKT and the path."""
    scene = mb.Contact(_body(0.25, 0.4, int(round(order)), grading), mb.Cylinder(1.0), LAWS[contact])
    state = scene.at(load*LOAD)
    flexibility, gaps, share = scene.nodes.compliance.corner_system(scene.law, scene.obstacle)
    found = active_set.path(flexibility, gaps, [load*LOAD], c=share)
    error = max(_residual(flexibility, gaps, share, one, load*LOAD) for one in (
        found.states[0], active_set.solve(flexibility, gaps, load=load*LOAD, c=share)))
    return Outcome(error, KKT, len(found.events), state.kkt)


def _mesh(size, reach, spacing, grading):
    """Triangles for a square with "contact" for |x1| < reach in facets that are long and short by turns."""
    pairs = max(2, round(reach/spacing))
    lengths = np.tile((1.0, 1/grading), pairs)
    places = -reach + 2*reach*np.concatenate(([0.0], np.cumsum(lengths)))/lengths.sum()
    corners = [(size, 0), (size, -size), (-size, -size), (-size, 0), *((float(x), 0) for x in places)]
    names = ["side", "bottom", "side", "free", *["contact"]*len(lengths), "free"]
    return bodies.mesh_of(bodies.polygon(corners, names), size/3, 1)


# fields below the surface

@lru_cache(maxsize=8)
def _state(alpha, contact):
    return mb.Contact(_ground(alpha), mb.Cylinder(1.0), LAWS[contact]).at(LOAD, rtol=LINE)


def below(contact, alpha, depth, x1):
    """Fields around a box as deep as it lies below the surface, and at the surface over it.

    Force, moment and the closing of u and psi along its upper side from the stresses; -sigma_22 = p and sigma_12 = 0 above.
    """
    state = _state(alpha, contact)
    solid = state.line.solid
    share, weights = np.polynomial.legendre.leggauss(BOX)
    share, weights = (share + 1)/2, depth*weights/2
    across, down, ones = x1 + depth*share, -depth*(1 + share), np.ones(BOX)
    points = np.concatenate([(across, -depth*ones), (across, -2*depth*ones), (x1*ones, down), ((x1 + depth)*ones, down)], axis=1)
    found = subsurface.fields(state, *points)
    normals = np.repeat(((0, 1), (0, -1), (-1, 0), (1, 0)), BOX, axis=0).T
    traction, couple = np.einsum("ijn,jn->in", found.stress, normals), np.sum(found.couple*normals, axis=0)
    around = np.tile(weights, 4)
    lever = (points[0] - x1)*traction[1] - (points[1] + depth)*traction[0]
    balance = np.abs(around @ np.array((*traction, (lever + couple)/depth)).T)/depth
    ends = subsurface.fields(state, np.array((x1, x1 + depth)), -depth*np.ones(2))
    (s11, s12), (s21, s22) = found.stress[:, :, :BOX]
    turning = (s12 - s21)/(4*solid.mu_c) - found.psi[:BOX]
    slopes = np.array((((1 - NU)*s11 - NU*s22)/(2*solid.mu), (s12 + s21)/(4*solid.mu) - turning,
                       found.couple[0, :BOX]/(solid.curvature*solid.ell**2*solid.mu)))
    closing = np.abs(slopes @ weights - np.array((*np.diff(ends.u, axis=1)[:, 0], np.diff(ends.psi)[0])))*solid.mu/depth
    top, p = subsurface.fields(state, x1, 0.0), _total(state)(np.array([x1]))
    surface = abs(top.stress[1, 1] + p)[0], abs(top.stress[0, 1])[0]
    largest = state.pressures.sum(axis=0).max()
    return Outcome(float(max(*balance, *closing[:2], closing[2]*min(solid.ell, depth), *surface)/largest), FIELDS)


def layer(alpha, x1, beta):
    """The length of the layer by the fit (51), beside that of the micropolar mode; a fit that is not determined says why."""
    row, = layers._by_modes(alpha, layers.Parameters(alphas=(alpha,), positions=(x1,), beta=beta))[0]
    length, mode = row["L_bl_over_ell"], row["mode_length_over_ell"]
    if length is None:
        raise NotConverged(row["reason"])
    return Outcome(abs(length/mode - 1) if mode else None, None, None, row["L_bl_error"]/length)


SEED = Axis("seed", "", 0, 2**31, "linear")
SIZE = Axis("size", "corners", 2, 300)
STARTS = Axis("start", "", choices=("nothing", "near", "absurd", "random"))
CONTACTS = Axis("contact", "", choices=("microblock", "unilateral"))
ALL_LAWS = Axis("contact", "", choices=tuple(LAWS))
THIN_TO_THICK = Axis("alpha", r"$\alpha$", 1e-3, 2.0, degenerate="both")
ALPHAS = Axis("alpha", "", choices=(0.05, 0.25, 1.0))
MAPS = (
    Map("states_random", "What does a plain active set do that block pivoting and the path do not?", random_states,
        (Axis("condition", r"$\log_{10}$ of the condition number", 0.0, 14.0, "linear", "high"), SIZE,
         Axis("load", "load", 1.0, 1e4), STARTS, SEED), ("method", ("plain", "pivoting", "path")), 1.0, "residual of (a)"),
    Map("states_degenerate", "Are degenerate problems solved, up to the very degeneracy?", degenerate_states,
        (Axis("degree", "degree", 1.0, 1e-16, degenerate="high"), SIZE, Axis("method", "", choices=("pivoting", "path")), SEED),
        ("problem", ("weights", "copies", "no gaps", "pairs", "rank")), 1.0, "residual of (a)"),
    Map("cells_cylinder", "Which share of a layer may a cell be, and how tight the window?", cells_of_cylinder,
        (Axis("ratio", r"$\ell$/cell", 0.01, 100.0, degenerate="low"), Axis("nodes", "cells", 16, 1e5, degenerate="low"),
         Axis("slack", "", 1.001, 3.0, degenerate="low"), Axis("psi0", "", 1e-5, 0.3), CONTACTS), share=0.7),
    Map("cells_asked", "Does the grid keep the tolerance it is asked for?", cells_asked,
        (Axis("alpha", r"$\alpha$", 1e-3, 3.0, degenerate="both"), Axis("rtol", "rtol", 1e-1, 1e-3),
         Axis("psi0", "", 1e-5, 0.3)), share=0.5),
    Map("cells_wave", "What happens where a wave closes?", waves,
        (Axis("load", "load over full closure", 0.02, 2.0, "linear", "low"), Axis("nodes", "cells", 32, 2e4),
         Axis("ell", "", 1e-3, 1.0)), ("contact", ("unilateral", "microblock")), 0.7),
    Map("cells_rough", "Does the estimate hold on rough profiles?", roughness,
        (Axis("load", r"mean pressure/$E^*$ slope", 1e-4, 1.0), Axis("ell", r"$\ell$/period", 1e-4, 1.0),
         Axis("psi0_deg", "", 0.01, 10.0), SEED), share=0.3),
    Map("body_coarse", "How coarse may a user's mesh be?", own_mesh,
        (Axis("spacing", r"facet$/a_\mathrm{Hz}$", 1.0, 0.05, degenerate="low"), Axis("order", "order", 1, 8, "linear"),
         ALPHAS, ALL_LAWS), share=0.5),
    Map("body_asked", "Does refinement of a user's mesh keep the tolerance it is asked for?", asked_of_mesh,
        (Axis("rtol", "rtol", 3e-1, 5e-3), Axis("alpha", r"$\alpha$", 0.05, 1.0), CONTACTS), share=0.2),
    Map("body_graded", "Do vanishing weights of nodes spoil states and path?", graded_mesh,
        (Axis("grading", "ratio of facets", 1.0, 1e4, degenerate="high"), Axis("order", "order", 1, 10, "linear", "high"),
         Axis("load", "", 1e-3, 1.0), ALL_LAWS), share=0.3, error="residual of (a)"),
    Map("fields_below", "Are fields right at all depths below layers of all lengths?", below,
        (THIN_TO_THICK, Axis("depth", r"depth$/a_\mathrm{Hz}$", 1e-5, 1e2, degenerate="both"),
         Axis("x1", "", -3.0, 3.0, "linear"), CONTACTS), share=0.5),
    Map("layer_fit", "Where is the length of the layer determined, and is the reason said where it is not?", layer,
        (THIN_TO_THICK, Axis("x1", r"$x_1/a_\mathrm{Hz}$", 1e-3, 10.0, degenerate="both"),
         Axis("beta", "", 0.1, 1.9, "linear")), share=0.3, error=r"$|L_\mathrm{bl}/L_\mathrm{mode} - 1|$"),
)
