"""The finite element side of `size_effect`: coalescence in the limit and on the paper's meshes, nominal hardness."""

import math
from dataclasses import replace

from cases import hertz_fe
from microblock.fitted import FittedContact
from microblock.law import Microblock
from microblock.material import Cosserat
from microblock.meeting import coalescence
from microblock.obstacles import Cylinder
from microblock.uniform import UniformContact

ORDERS = (7, 4), (9, 5)            # (order, levels) of two meshes for alpha_mid
SQUARES = 0.2, 0.1, 0.05, 0.025    # sides of the squares over a_Hz at which bilinear elements see alpha_mid
FINEST = 0.01                      # over a_Hz: alphas of this and twice this give the nominal hardness for alpha -> 0
NEAR = 0.86                        # ell over a_Hz there: an alpha near to what they see
DOMAIN = "18"                      # of the paper, over a_Hz
EQUAL_SQUARES = 2.0                # over a_Hz


def _solid(nu, beta, ell):
    """A solid for which a_Hz^2 = 2 P R/pi."""
    return Cosserat(E=2*(1 - nu**2), nu=nu, ell=ell, beta=beta)


def coalescence_ratio(nu, beta):
    """alpha_mid in the limit of the elements and of the domain, and its error: extrapolation and order together."""
    scene = FittedContact(_solid(nu, beta, 1.0), Cylinder(1.0), Microblock())
    (coarse, _), (load, error) = (coalescence(scene, *mesh) for mesh in ORDERS)
    alpha = 1/math.sqrt(2*load/math.pi)
    return alpha, alpha*(error + abs(load - coarse))/load/2


def ratio_of_h(nu, beta, squares=SQUARES):
    """[(h over a_Hz, alpha_mid)] of bilinear elements on the paper's mesh: the axis node closes at that load.

    The mesh is fixed; a_Hz is that of the load.
    """
    found = []
    for h in squares:
        scene = UniformContact(_solid(nu, beta, NEAR), Cylinder(1.0), Microblock(), float(DOMAIN), h=h, reach=EQUAL_SQUARES)
        a_Hz = math.sqrt(2*scene.axis_closes()/math.pi)
        found.append((h/a_Hz, NEAR/a_Hz))
    return found


def nominal_hardness(parameters):
    """P/(2 a_nom) of `hertz.Parameters` on the paper's domain, a_nom = sqrt(d (2 R - d)) from the approach d, and its error.

    The error is the distance from ten times the rtol. One order for all elements: d feels the far field.
    """
    bounded = replace(parameters, domain=DOMAIN)
    scene, near, found = replace(hertz_fe.fitted(bounded), even=True), None, []
    for rtol in (10*parameters.rtol, parameters.rtol):
        near = scene.at(parameters.P, rtol, near=near)
        found.append(parameters.P/(2*math.sqrt(near.approach*(2*parameters.R - near.approach))))
    return found[1], abs(found[1] - found[0])


def classical_hardness(scene):
    """The same for alpha -> 0, linear in alpha; `scene` gives the parameters of `hertz` for an alpha."""
    (fine, fine_error), (coarse, coarse_error) = (nominal_hardness(scene(alpha)) for alpha in (FINEST, 2*FINEST))
    return 2*fine - coarse, 2*fine_error + coarse_error
