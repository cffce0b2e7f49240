"""Draws docs/figures/block.svg: one block of the surface, its corners, gaps, levers and signs.

`python docs/figures/block.py` writes the file beside this script.
"""

import math
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import Arc, FancyArrowPatch, Polygon

ELL, PSI0 = 2.0, math.radians(14)  # side and rotation of the block that is drawn, both without a unit
C = np.array([0.0, 0.0])  # the contact point, on the surface x2 = 0
N = np.array([-math.sin(PSI0), math.cos(PSI0)])  # normal of the block
S = np.array([math.cos(PSI0), math.sin(PSI0)])  # its tangent
CENTRE, A, B = C - ELL / 2 * N, C - ELL / 2 * S, C + ELL / 2 * S
INK, GREY, CORNER_A, CORNER_B = "#1b1b1b", "#8a8a8a", "#0b62a8", "#b3470a"
STYLE = {"font.size": 11, "mathtext.fontset": "cm", "svg.fonttype": "path", "svg.hashsalt": "block"}


def obstacle(x):
    """Height of the lower surface of the obstacle."""
    return 0.62 + 0.07 * (x - 0.5) ** 2


def arrow(axis, start, end, colour=INK, style="-|>", width=1.3):
    axis.add_patch(
        FancyArrowPatch(
            start,
            end,
            arrowstyle=style,
            color=colour,
            linewidth=width,
            mutation_scale=10,
            shrinkA=0,
            shrinkB=0,
        )
    )


def curved(axis, centre, radius, start, end, colour=INK):
    """An arc from one angle to another (degrees), with a head at its end."""
    axis.add_patch(Arc(centre, 2 * radius, 2 * radius, theta1=start, theta2=end, color=colour, linewidth=1.3))
    points = [centre + radius * np.array([math.cos(t), math.sin(t)]) for t in np.radians([end - 6, end + 2])]
    arrow(axis, *points, colour)


def draw():
    """The figure, 7 by 4.4 inches."""
    figure, axis = plt.subplots(figsize=(7.0, 4.4))
    axis.set_aspect("equal")
    axis.axis("off")
    x = np.linspace(-2.6, 4.1, 200)
    axis.fill_between(x, obstacle(x), 2.05, color="#d9d9d9", linewidth=0)
    axis.plot(x, obstacle(x), color=INK, linewidth=1.5)
    axis.text(-2.45, 1.62, "obstacle", ha="left", va="center")
    axis.plot([-2.6, 4.1], [0, 0], color=GREY, linewidth=1.0, linestyle=(0, (6, 3)))
    axis.text(4.05, -0.08, "surface of the body", color="#5c5c5c", ha="right", va="top")
    corners = [A, B, B - ELL * N, A - ELL * N]
    axis.add_patch(Polygon(corners, closed=True, facecolor="#f4ead2", edgecolor=INK, linewidth=1.8, zorder=2))
    for point, name, colour, side in ((A, "A", CORNER_A, -1), (B, "B", CORNER_B, 1)):
        axis.plot(*point, "o", color=colour, markersize=7, zorder=4)
        place = point + (0.2 * side, 0.12 if name == "A" else -0.12)
        axis.text(*place, name, color=colour, ha="center", va="center", fontsize=13, weight="bold")
        top = (point[0], obstacle(point[0]))
        arrow(axis, point, top, colour, "<|-|>", 1.2)
        axis.text(
            point[0] - 0.1,
            (point[1] + top[1]) / 2 + (0.12 if name == "A" else 0.0),
            f"$g_{name}$",
            color=colour,
            ha="right",
            va="center",
            fontsize=13,
        )
    for point in (C, CENTRE):
        axis.plot(*point, "o", color=INK, markersize=4.5, zorder=4)
    axis.text(0.12, -0.08, "C", ha="left", va="top", zorder=5)
    axis.text(CENTRE[0] - 0.12, CENTRE[1] - 0.05, "O", ha="right", va="top", zorder=5)
    # levers: distances of the corners from O along the surface
    low = -2.32
    for point in (A, B, CENTRE):
        start = point[1] - 0.05 if point is CENTRE else point[1]
        axis.plot(
            [point[0], point[0]], [start, low - 0.1], color=GREY, linewidth=0.8, linestyle=":", zorder=3
        )
    arrow(axis, (CENTRE[0], low), (A[0], low), CORNER_A, "<|-|>", 1.2)
    arrow(axis, (CENTRE[0], low), (B[0], low), CORNER_B, "<|-|>", 1.2)
    axis.text(
        A[0], low - 0.12, r"$\frac{\ell}{2}(1+\psi_0)$", color=CORNER_A, ha="left", va="top", fontsize=13
    )
    axis.text(
        CENTRE[0] + 0.08,
        low - 0.12,
        r"$\frac{\ell}{2}(1-\psi_0)$",
        color=CORNER_B,
        ha="left",
        va="top",
        fontsize=13,
    )
    axis.text(A[0] - 0.12, low, "levers", ha="right", va="center")
    # side and rotation
    beside = B + 0.48 * S - 0.12 * N
    arrow(axis, beside, beside - ELL * N, INK, "<|-|>", 1.0)
    axis.text(*(beside - ELL / 2 * N + 0.12 * S), r"$\ell$", ha="left", va="center", fontsize=14)
    axis.plot([0, 2.05], [0, 2.05 * math.tan(PSI0)], color=INK, linewidth=0.9, linestyle=":", zorder=3)
    curved(axis, C, 1.9, 0, math.degrees(PSI0) - 1)
    axis.text(2.0, 0.22, r"$\psi_0$", ha="left", va="center", fontsize=13)
    # signs
    origin = np.array([2.7, -1.5])
    arrow(axis, origin, origin + (0.0, 0.75))
    arrow(axis, origin, origin + (0.75, 0.0))
    axis.text(*(origin + (0.0, 0.8)), r"$x_2,\ \mathbf{n}$", ha="center", va="bottom", fontsize=13)
    axis.text(*(origin + (0.8, 0.0)), r"$x_1$", ha="left", va="center", fontsize=13)
    turn = origin + (-0.25, -0.62)
    curved(axis, turn + (0.3, 0.0), 0.26, -70, 200)
    axis.text(*(turn + (0.72, 0.0)), r"$\psi,\ \psi_0,\ M > 0$", ha="left", va="center", fontsize=13)
    axis.set_xlim(-2.7, 4.2)
    axis.set_ylim(-2.85, 2.05)
    figure.subplots_adjust(0, 0, 1, 1)
    return figure


if __name__ == "__main__":
    with matplotlib.rc_context(STYLE):
        figure = draw()
        folder = Path(__file__).parent
        figure.savefig(folder / "block.svg", facecolor="white", metadata={"Date": None})
