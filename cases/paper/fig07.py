"""
Figure 7: the mesh below the cylinder
=====================================
A mesh with nodes at both edges of the contact, T and O, needs 7 000 unknowns for an error of 1e-4; the paper
has 130 000 on bilinear elements.

:Geometry:  square of 18 :math:`a_\\mathrm{Hz}`, half of the symmetric problem, :math:`\\alpha = 0.25`
:Equations: (10)-(18) in the solid, corner gaps (20)-(22), contact conditions (26)
:Method:    fitted triangles of high order, refined until the estimated error is below rtol
:Reference: the half-plane, from which the square differs in the third digit
:Units:     lengths over :math:`a_\\mathrm{Hz}`
"""

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import PolyCollection

import microblock as mb
from cases import hertz


def solve(alpha=0.25, size=18.0, rtol=1e-4):
    """The state on the square.

    Parameters
    ----------
    alpha : side of a block over a_Hz
    size : side of the square over a_Hz
    rtol : relative error of pressure and micromoment
    """
    problem = hertz.problem(alpha)
    square = mb.Block(problem.solid, size * hertz.a_Hz)
    return problem.with_(body=square).solve(load=hertz.P, rtol=rtol)


def figure(state):
    """(a) All of the mesh, (b) below the contact, (c) at the end T of full contact, (d) at the edge O."""
    drawing, axes = plt.subplots(2, 2, figsize=(3.54, 3.8), layout="constrained")
    mesh = state.fields.body.mesh
    corners = [
        np.array([mesh[vertex].point for vertex in element.vertices]) / hertz.a_Hz
        for element in mesh.Elements()
    ]
    marks = {"T": state.zones["full"][0][1] / hertz.a_Hz, "O": state.half_width / hertz.a_Hz}
    widest = max(points[:, 0].max() for points in corners)
    windows = (0, widest), (0, 1.6), *((x - 0.04, x + 0.04) for x in marks.values())
    for axis, name, (left, right) in zip(axes.flat, "abcd", windows):
        axis.add_collection(PolyCollection(corners, facecolors="none", edgecolors="0.4", linewidths=0.5))
        axis.set(
            xlim=(left, right),
            ylim=(left - right, 0),
            aspect="equal",
            xlabel=r"$x_1/a_\mathrm{Hz}$",
            ylabel=r"$x_2/a_\mathrm{Hz}$",
        )
        axis.set_title(f"({name})", loc="left")
        axis.locator_params(nbins=3)
        for mark, x in marks.items():
            if left < x < right < widest:
                arrow = {"arrowstyle": "-|>", "color": "C1", "shrinkA": 0, "shrinkB": 0}
                look = {"color": "C1", "ha": "center", "arrowprops": arrow, "textcoords": "offset points"}
                axis.annotate(mark, (x, 0), (0, 9), annotation_clip=False, **look)
    return drawing


if __name__ == "__main__":
    state = solve()
    print(f"{state.unknowns} unknowns, error {state.error_estimate:.1e}")
    figure(state)
    plt.show()
