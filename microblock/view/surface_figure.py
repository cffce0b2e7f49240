"""Figures of a state in three dimensions."""

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm, ListedColormap, Normalize
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from mpl_toolkits.mplot3d.axes3d import Axes3D
from scipy.interpolate import RegularGridInterpolator

from ..corners.surface_law import on_surface
from ..errors import BadArgument, require_kind
from . import plots
from .blocks import magnification

CUBE = np.array([(a, b, c) for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)]) / 2  # over ell
FACES = {(1, 3, 7, 5): 1.0, (0, 1, 5, 4): 0.75, (4, 5, 7, 6): 0.75}  # top, front and right, and their light


@plots.styled
def draw(state, axis=None):
    """The figure of a state on cells or at nodes; of an axis with the pressure alone."""
    if axis is None:  # panels of equal sides, which else push labels out
        figure, axes = plots.figure(1, 3, 2.4, 2 * plots.COLUMN, layout="compressed")
    else:
        figure, axes = plots.in_place(axis)
    pressure, *others = np.ravel(axes)
    _from_above(pressure, state, state.pressure, "$p$", cmap="cividis")
    if others:
        moment = np.hypot(*state.micromoment.T) / state.solid.ell
        _from_above(others[0], state, moment, r"$|M|/\ell$", cmap="cividis")
        # not white at nodes: a mark has to be seen
        look = _look(state, "0.85" if state.squares is None else "w")
        bar = _from_above(others[1], state, state.closed, "closed corners", **look)
        bar.set_ticks(range(len(state.pressures) + 1))
    return figure


@plots.styled
def draw_blocks(axis, state):
    """The figure of an axis of three dimensions, or a new one, with blocks of a state on cells, of several
    squares in that with the largest load: displacements ``u + psi x r``, (21), magnified, with psi0.
    Raises BadArgument if the law has no blocks, or the state is at nodes.
    """
    law, ell = on_surface(state.law), state.solid.ell
    if not law.psi0:
        raise BadArgument("law", state.law, "has no blocks: plot_blocks() is for Microblock")
    if state.squares is None:
        raise BadArgument(
            "method", state.method, "has no cells on which blocks are drawn in three dimensions"
        )
    count, n = len(state.squares), state.squares[0].count
    most = np.argmax((state.weights * state.pressure).reshape(count, -1).sum(axis=1))
    square = state.squares[most]
    cells = np.column_stack((state.psi, state.displacement, state.closed)).reshape(count, n, n, 4)[most]
    x1, x2 = _contact_points(square, cells[..., 3] > 0, ell)
    psi1, psi2, u, closed = RegularGridInterpolator(square.axes, cells, "nearest")((x1, x2)).T
    turned, deep = np.hypot(psi1, psi2).max(), np.abs(u).max() / (1.5 * ell)
    magnified, tilt = magnification(turned, deep), law.tilt(x1, x2)  # (-psi0_2, psi0_1)
    psi = magnified * np.column_stack((psi1 + tilt[1], psi2 - tilt[0], np.zeros_like(u)))
    middle = np.column_stack((x1, x2, -ell / 2 - magnified * u))
    corners = middle[:, None] + ell * CUBE + np.cross(psi[:, None], ell * CUBE[None])  # (n, 8, 3)
    if axis is None:
        axis = plots.Drawing((plots.COLUMN, 3.0), layout="constrained").add_subplot(projection="3d")
    require_kind(Axes3D, "an Axes of matplotlib in three dimensions", ax=axis)
    look = _look(state, "w")
    faces = np.concatenate([corners[:, members] for members in FACES])
    colours = look["cmap"](closed.astype(int))[:, :3]
    shown = np.concatenate([light * colours for light in FACES.values()])
    axis.add_collection3d(
        Poly3DCollection(faces, facecolors=shown, edgecolors="0.25", linewidths=0.3, clip_on=False)
    )
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    axis.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axis.set(xlabel="$x_1$", ylabel="$x_2$", zticks=())
    axis.set_title(f"displacement and rotation {magnified:g} times as large")
    axis.locator_params(nbins=4)
    axis.set_box_aspect(high - low)
    axis.view_init(elev=50)
    bar = axis.figure.colorbar(ScalarMappable(**look), ax=axis, shrink=0.5, label="closed corners")
    bar.set_ticks(range(len(law.names) + 1))
    return axis.figure


def _from_above(axis, state, values, label, **look):
    """The colour bar of values at cells or nodes, (n,), drawn from above."""
    if state.squares is not None:
        look = {"norm": Normalize(values.min(), values.max()), **look}
        for square, own in zip(state.squares, np.split(values, len(state.squares))):
            rows = own.reshape(square.count, square.count).T
            shown = axis.pcolormesh(*square.axes, rows, rasterized=True, **look)
    elif "norm" in look:  # numbers have nothing between nodes
        shown = axis.scatter(state.x1, state.x2, c=values, s=5, linewidths=0, **look)
    else:
        places = state.x1, state.x2, state.triangles
        shown = axis.tripcolor(*places, values, shading="gouraud", rasterized=True, **look)
    axis.set(xlabel="$x_1$", ylabel="$x_2$", title=label)
    axis.set(aspect="equal", adjustable="datalim", box_aspect=1)  # a row of squares has room above it
    axis.locator_params(nbins=4)  # as many as are there when the layout is made
    return axis.figure.colorbar(shown, ax=axis, shrink=0.9, pad=0.02)


def _look(state, none):
    """Colours for numbers of closed corners."""
    corners = len(state.pressures)
    colours = ListedColormap([none, *("#C6DBEF", "#6BAED6", "#3182BD", "#08306B")[-corners:]])
    return {"cmap": colours, "norm": BoundaryNorm(np.arange(-0.5, corners + 1), colours.N)}


def _contact_points(square, closed, ell):
    """Contact points of at most 19 blocks a side in a square, of whose cells some are closed, arrays (n,)."""
    box = []
    for x, there in zip(square.axes, (closed.any(axis=1), closed.any(axis=0))):
        first, last = x[there][[0, -1]]
        middle, half = (first + last) / 2, 0.625 * (last - first) + ell
        own = middle + ell * np.arange(-9, 10)
        box.append(own[(np.abs(own - middle) <= half) & (own >= x[0]) & (own <= x[-1])])
    x1, x2 = np.meshgrid(*box, indexing="ij")
    return x1.ravel(), x2.ravel()
