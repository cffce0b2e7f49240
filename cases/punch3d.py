"""
Flat punch on a block
=====================
Blocks beside a flat face still stand below it with some of their corners, which spreads the pressure beyond
the face.

The rim of the face lies where the area of a row of nodes ends. Corners stand half of a block beside it; with
eight facets and blocks of half of the half-width another row ends there. The bottom of the block is fixed:
its finite size takes a part from the approach that falls like 1/size.

:Geometry:  block of the half-width and depth s, of which a quarter is modelled; rigid square or round face
:Equations: (10)-(17) in three dimensions, gaps of four corners, conditions (26) on each of them
:Method:    hexahedra condensed to their contact nodes; beside them square cells of a half-space
:Reference: the half-space, which shares neither mesh nor kernel with the block
:Units:     lengths over the half-width of the face, pressures over :math:`P/A` with its area A, M over
            :math:`P \\ell/A`
"""

import math
from typing import Literal

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import ListedColormap

import microblock as mb
from microblock.fem import meshes3d


def quarter(solid, size, facets):
    """A quarter of the block, with `facets` elements along the half-width of the face."""
    step = 1 / (facets + 0.5)
    reach = 1 + step + solid.ell / 2  # corners stand half of a block beside their nodes
    x = meshes3d.graded(step * math.ceil(reach / step), step, size, growth=1.8)
    depth = meshes3d.graded(0.5, step, size, growth=1.8)
    mesh = meshes3d.block(x, x, -depth[::-1], reach=reach)
    return mb.Body(mesh, solid, 1, fixed=meshes3d.supports("bottom", x1="left", x2="front"))


def solve(
    alpha=0.5, face: Literal["square", "round"] = "square", nu=0.3, beta=1.0, size=5.0, facets=8, cells=96
):
    """Returns the states of the block and of the half-space at the load 1.

    Parameters
    ----------
    alpha : size of a block over the half-width of the face
    face : face of the punch
    nu : Poisson's ratio, -1 < nu < 1/2
    beta : coupling number 2 eta/(1 + eta), 0 < beta < 2
    size : half-width and depth of the block over the half-width of the face
    facets : elements along the half-width of the face
    cells : cells a side of the half-space
    """
    solid, punch = mb.Cosserat(E=1 - nu**2, nu=nu, ell=alpha, beta=beta), mb.FlatPunch(1.0, face)
    block = mb.Contact(quarter(solid, size, facets), punch, mb.Microblock())
    half_space = mb.Contact(mb.HalfSpace(solid), punch, mb.Microblock(), mb.Cells(nodes=cells, residual=1e-6))
    return {"block": block.solve(load=0.25), "half-space": half_space.solve(load=1.0)}


def figure(result):
    """Corners that touch at the nodes of the quarter (a); pressure and micromoment along x1 (b)."""
    drawing, (above, below) = plt.subplots(2, 1, figsize=(3.54, 5.0), layout="constrained")
    block, half_space = result.values()
    closed = np.ma.masked_equal(block.closed, 0)
    colours = plt.get_cmap("viridis_r")(np.linspace(0.35, 1, 4))  # seen on white, and turned round on black
    look = {"cmap": ListedColormap(colours), "vmin": 0.5, "vmax": 4.5}
    shown = above.scatter(block.x1, block.x2, s=9, c=closed, plotnonfinite=False, **look)
    drawing.colorbar(shown, ax=above, ticks=range(1, 5), label="corners that touch")
    above.set(xlabel="$x_1/a$", ylabel="$x_2/a$", aspect="equal")
    ell, area = block.problem.solid.ell, {"square": 4.0, "round": math.pi}[block.problem.obstacle.face]
    row, cut = block.x2 == 0, half_space.along("x1")
    for number, (nodes, cells, scale, words) in enumerate(
        (
            (block.pressure[row], cut["pressure"], area, "$p A/P$"),
            (block.micromoment[row, 1], cut["m2"], area / ell, r"$M_2 A/(P\ell)$"),
        )
    ):
        below.plot(cut["x1"], scale * cells, color=f"C{number}", label=f"{words}, half-space")
        below.plot(block.x1[row], scale * nodes, "o", color=f"C{number}", label=f"{words}, block")
    below.axvline(1, linestyle=":", color="gray", label="rim of the face")
    below.set(xlabel="$x_1/a$", ylabel="on the axis $x_2 = 0$", xlim=(0, block.x1.max()))
    drawing.legend(*below.get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return drawing


if __name__ == "__main__":
    result = solve()
    for name, state in result.items():
        area = state.contact_area / state.load  # a quarter carries a quarter of the load
        print(f"{name:10}  approach {state.approach:.4f}  contact area {area:.4f}")
    figure(result)
    plt.show()
