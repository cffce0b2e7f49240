"""
Sphere with friction
====================
The stick zone of a sheared sphere is not in the middle of its contact, and under microblocks it is less than
half as large as without blocks.

Pressing draws the surface inwards, against which friction acts outwards on all sides. A shear to the right
goes on with this slip at the right, and has to reverse it at the left: there all sticks, until the tractions
have turned. Blocks rotate with the sphere, and slip where they are pressed. Between equal bodies
nothing slips while they are pressed, and the stick zone is a disc in the middle.

:Geometry:  half-space :math:`x_3 < 0`, rigid sphere of radius R
:Equations: (10)-(17) in three dimensions, gaps of the corners with (26), and on each block a shear force of
            two components, at most f times its normal force
:Method:    square cells, loads followed in increments, normal and shear forces in turn
:Reference: Cattaneo and Mindlin: equal bodies with small blocks stick within
            :math:`a (1 - Q/(f P))^{1/3}`
:Units:     :math:`R = E^* = a_\\mathrm{Hz} = 1`: lengths over :math:`a_\\mathrm{Hz}`, tractions over f times
            the largest pressure of Hertz
"""

import math

import matplotlib.pyplot as plt
import numpy as np

import microblock as mb

P = 4 / 3  # the load with a_Hz = 1
LAWS = {"unilateral": mb.Unilateral, "microblock": mb.Microblock}


def solve(alpha=0.3, shear=0.5, friction=0.3, nu=0.3, beta=1.0, cells=40):
    """Returns the states that are pressed and then sheared along x1, of each law.

    Parameters
    ----------
    alpha : size of a block over a_Hz
    shear : shear force over f P, 0 <= shear < 1
    friction : coefficient f
    nu : Poisson's ratio, -1 < nu < 1/2
    beta : coupling number 2 eta/(1 + eta), 0 < beta < 2
    cells : cells a side
    """
    body = mb.HalfSpace(mb.Cosserat(E=1 - nu**2, nu=nu, ell=alpha, beta=beta))
    method = mb.Cells(nodes=cells, window=(-1.25, 1.25))
    loads = [(P, 0.0, 0.0), (P, shear * friction * P, 0.0)]
    return {
        name: mb.Contact(body, mb.Sphere(R=1.0), law(friction=friction), method).history(loads).states[-1]
        for name, law in LAWS.items()
    }


def stick_radius(state):
    """Radius of the circle with the area that sticks."""
    return math.sqrt(state.weights @ state.stick / math.pi)


def figure(result):
    """Size and direction of the shear traction from above, of the unilateral law (a) and of microblocks (b);
    the white line is the edge of the stick zone."""
    drawing, axes = plt.subplots(2, 1, figsize=(3.54, 5.6), layout="constrained")
    for axis, letter, (name, state) in zip(axes, "ab", result.items()):
        largest = state.law.friction * 1.5 * P / math.pi  # 3 P/(2 pi a^2)
        q = state.shear_traction.reshape(*state.shape, 2).transpose(2, 1, 0) / largest
        size = np.hypot(*q)
        shown = axis.pcolormesh(state.x1, state.x2, size, cmap="cividis", vmin=0, vmax=1, rasterized=True)
        axis.contour(state.x1, state.x2, state.stick.reshape(state.shape).T, [0.5], colors="w", linewidths=1)
        every = (slice(1, None, 3), slice(1, None, 3))
        x1, x2 = (places[every] for places in np.meshgrid(state.x1, state.x2))
        pressed = size[every] > 0
        arrows = (component[every][pressed] for component in q)
        axis.quiver(x1[pressed], x2[pressed], *arrows, color="w", width=0.005, pivot="mid")
        axis.set(xlabel=r"$x_1/a_\mathrm{Hz}$", ylabel=r"$x_2/a_\mathrm{Hz}$", aspect="equal")
        axis.set_title(f"({letter})  {name}", loc="left")
        drawing.colorbar(shown, ax=axis, label=r"$|q|/(f p_\mathrm{Hz})$")
    return drawing


if __name__ == "__main__":
    result = solve()
    for name, state in result.items():
        print(f"{name:10}  stick radius {stick_radius(state):.3f}  moved {state.tangential_approach[0]:.4f}")
    figure(result)
    plt.show()
