"""The finite element side of `size_effect`: coalescence in the limit and on uniform bilinear meshes,
nominal hardness.
"""

import math
from dataclasses import replace

import microblock as mb
from microblock.corners import active_set
from microblock.halfplane.coalescence import coalescence

from . import hertz_fe

ORDERS = (7, 4), (9, 5)  # (order, levels) of two meshes for alpha_mid
SQUARES = 0.2, 0.1, 0.05, 0.025  # sides of the squares over a_Hz at which bilinear elements see alpha_mid
FINEST = 0.01  # over a_Hz: this and twice this give the nominal hardness for alpha -> 0
NEAR = 0.86  # ell over a_Hz there: an alpha near to what they see
DOMAIN = "18"  # of the paper, over a_Hz
EQUAL_SQUARES = 2.0  # over a_Hz


def _solid(nu, beta, ell):
    """A solid for which a_Hz^2 = 2 P R/pi."""
    return mb.Cosserat(E=2 * (1 - nu**2), nu=nu, ell=ell, beta=beta)


def coalescence_ratio(nu, beta):
    """alpha_mid in the limit of the elements and of the domain, and its error: extrapolation and order
    together.
    """
    problem = mb.Contact(mb.Block(_solid(nu, beta, 1.0)), mb.Cylinder(1.0), mb.Microblock())
    (coarse, _), (load, error) = (coalescence(problem.solver, *mesh) for mesh in ORDERS)
    alpha = 1 / math.sqrt(2 * load / math.pi)
    return alpha, alpha * (error + abs(load - coarse)) / load / 2


def axis_closes(solver):
    """Load (force per thickness) at which the node on the axis closes for good on the mesh of a condensed
    `Uniform` solver, of which half is computed.
    """
    if not solver.symmetric:
        raise mb.BadArgument("problem", solver.contact, "must be symmetric")
    _, flexibility, gaps, share = solver.prepare()
    # classical contact would fill the squares under some times that
    last = solver.solid.E_star * solver.reach**2 / 4
    history = active_set.path(flexibility, gaps, [last], c=share).events
    loads = [event.load for event in history if event.corner == 0 and event.kind == "closes"]
    if not loads:
        raise mb.NotConverged(f"the axis is open up to the load {2 * last:g}", reached=2 * last)
    return 2 * loads[-1]


def ratio_of_h(nu, beta, squares=SQUARES):
    """[(h over a_Hz, alpha_mid)] of bilinear elements on a uniform mesh: the axis node closes at that load.

    The mesh is fixed; a_Hz is that of the load.
    """
    found = []
    for h in squares:
        problem = mb.Contact(
            mb.Block(_solid(nu, beta, NEAR), float(DOMAIN)),
            mb.Cylinder(1.0),
            mb.Microblock(),
            mb.Uniform(h=h, reach=EQUAL_SQUARES),
        )
        a_Hz = math.sqrt(2 * axis_closes(problem.solver) / math.pi)
        found.append((h / a_Hz, NEAR / a_Hz))
    return found


def nominal_hardness(parameters):
    """P/(2 a_nom) of `hertz.Parameters` on the paper's domain, a_nom = sqrt(d (2 R - d)) from the approach d,
    and its error.

    The error is the distance from ten times the rtol.
    """
    problem, state, found = hertz_fe.fitted(replace(parameters, domain=DOMAIN)), None, []
    for rtol in (10 * parameters.rtol, parameters.rtol):
        state = problem.solve(load=parameters.P, rtol=rtol, initial=state)
        found.append(parameters.P / (2 * math.sqrt(state.approach * (2 * parameters.R - state.approach))))
    return found[1], abs(found[1] - found[0])


def classical_hardness(given):
    """The same for alpha -> 0, linear in alpha; `given` returns the parameters of `hertz` for an alpha."""
    (fine, fine_error), (coarse, coarse_error) = (
        nominal_hardness(given(alpha)) for alpha in (FINEST, 2 * FINEST)
    )
    return 2 * fine - coarse, 2 * fine_error + coarse_error
