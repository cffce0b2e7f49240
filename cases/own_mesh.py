"""
Bodies on a mesh of your own
============================
A hole moves the load to the firm side; a thin layer presses back like a Winkler foundation, a thick one
like a half-plane.

:Geometry:  a cylinder with the force P per thickness on (a) a block of 8 by 4 with a hole of the radius
            0.8, (b) layers of the thickness h; both are bonded to a rigid base, with no
            displacement and no rotation
:Equations: (10)-(18) in the body, corner gaps (20)-(22), contact conditions (26)
:Method:    finite elements on a mesh of Netgen, refined until the estimated error is below rtol
:Reference: thin layer: :math:`p = (\\lambda + 2\\mu)\\, u/h` and :math:`M = \\gamma' \\mu\\, \\ell^2\\,
            \\psi/h`; thick layer: panels on the half-plane
:Units:     those of Hertz' contact: lengths over :math:`a_\\mathrm{Hz}`, pressures over
            :math:`p_\\mathrm{Hz}`
"""

import matplotlib.pyplot as plt
import netgen.occ as occ
import ngsolve as ng
import numpy as np

import microblock as mb
from cases.closed_forms import ThinLayer

# %%
# With E* = 2 R and P = pi/2 both scales of Hertz are 1.

R, LOAD = 10.0, np.pi / 2


# %%
# The mesh needs the names of the contact boundary and of the supports, nothing else.


def body(solid, width, height, hole=None, order=4):
    """A rectangle below x2 = 0 on a rigid base; `hole`: the abscissa, depth and radius of a round hole."""
    face = occ.MoveTo(-width / 2, -height).Rectangle(width, height).Face()
    if hole:
        face = face - occ.MoveTo(hole[0], -hole[1]).Circle(hole[2]).Face()
    face.edges.Min(occ.Y).name = "base"
    face.edges.Max(occ.Y).name, face.edges.Max(occ.Y).maxh = "contact", 0.25
    mesh = ng.Mesh(occ.OCCGeometry(face, dim=2).GenerateMesh(maxh=np.clip(height, 0.1, 1.4)))
    return mb.Body(mesh.Curve(order), solid, order=order, fixed="base")


def solve(
    hole: tuple[float, float, float] = (0.6, 1.4, 0.8),
    thicknesses=(0.05, 0.2, 1.0, 5.0),
    alpha=0.1,
    nu=0.3,
    beta=1.0,
    rtol=1e-2,
):
    """States of the block without and with the hole, of the layers, and of the half-plane.

    Parameters
    ----------
    hole : abscissa and depth of its centre, and its radius, over a_Hz
    thicknesses : of the layers over a_Hz, the thinnest first
    alpha : side of a block of the microstructure over a_Hz
    nu : Poisson's ratio
    beta : coupling of rotations, between 0 and 2
    rtol : relative error of each state
    """
    if min(thicknesses) <= 0:
        raise mb.BadArgument("thicknesses", min(thicknesses), "must be positive")
    solid = mb.Cosserat(E=2 * R * (1 - nu**2), nu=nu, ell=alpha, beta=beta)
    bodies = {"solid block": body(solid, 8, 4), "block with a hole": body(solid, 8, 4, hole)}
    bodies |= {f"h = {h:g}": body(solid, 4 + 8 * h, h) for h in thicknesses}
    bodies |= {"half-plane": mb.HalfPlane(solid)}
    return {
        words: mb.Contact(body, mb.Cylinder(R), mb.Microblock()).solve(load=LOAD, rtol=rtol)
        for words, body in bodies.items()
    }


def foundation(x, h, solid):
    """Pressure of a Winkler foundation at even points x."""
    normal, rotational = solid.lam + 2 * solid.mu, solid.curvature * solid.mu * solid.ell**2
    springs = ThinLayer(normal / h, rotational / h, solid.ell)
    gaps = np.array([(x - solid.ell / 2) ** 2, (x + solid.ell / 2) ** 2]) / (2 * R)
    approach = springs.approach(LOAD, gaps, np.full(len(x), x[1] - x[0]))
    return springs.pressures(approach - gaps).sum(axis=0)


def figure(states):
    """Pressures (a) above a hole and (b) on layers, and the vertical stress around the hole."""
    drawing, axes = plt.subplots(2, 1, figsize=(3.54, 4.4), layout="constrained", sharex=True)
    x = np.linspace(-1.4, 1.4, 1001)
    *layers, half_plane = list(states)[2:]
    for axis, title, names in zip(axes, ("(a) block", "(b) layers"), (list(states)[:2], layers)):
        for words in names:
            axis.plot(x, states[words].pressure_at(x), label=words)
        axis.set(ylabel=r"$p/p_\mathrm{Hz}$", title=title)
    thinnest = float(layers[0].split()[-1])
    axes[1].plot(x, foundation(x, thinnest, states[half_plane].solid), "k--", label="Winkler foundation")
    axes[1].plot(x, states[half_plane].pressure_at(x), "k:", label=half_plane)
    axes[1].set_xlabel(r"$x_1/a_\mathrm{Hz}$")
    for axis in axes:
        axis.legend(loc="center left", bbox_to_anchor=(1, 0.5))
    stress, axis = plt.subplots(figsize=(3.54, 2.2), layout="constrained")
    states["block with a hole"].plot_below("s22", ax=axis)
    axis.set_title("around the hole; contact in black")
    return {"own_mesh": drawing, "own_mesh_stress": stress}


if __name__ == "__main__":
    states = solve()
    print(*states.values(), sep="\n")
    figure(states)
    plt.show()
