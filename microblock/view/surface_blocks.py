"""The blocks of a surface under an obstacle in three dimensions, cubes of side ell below their contact
points. Displacements ``u + psi x r``, (21), are drawn `magnified` times as large, with the initial rotation
psi0.
"""

import numpy as np
from matplotlib.cm import ScalarMappable
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from mpl_toolkits.mplot3d.axes3d import Axes3D
from scipy.interpolate import RegularGridInterpolator

from ..errors import BadArgument, require_kind
from ..halfspace.surface_law import on_surface
from . import plots
from .blocks import SHOWN_TURN
from .surface_figure import colours_of, numbered

MOST = 18  # blocks a side
AROUND = 1.25  # of the contact's half-width
LOWERED = 1.5  # of ell, as which the approach is drawn at most
SHADE = 0.75  # of a top's colour, the two sides' on which the light falls less
CUBE = np.array([(a, b, c) for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)]) / 2  # over ell
FACES = {"top": (1, 3, 7, 5), "front": (0, 1, 5, 4), "right": (4, 5, 7, 6)}


@plots.styled()
def draw(state, axis=None):
    """The figure of the blocks of a state on cells, or of a given axis of three dimensions.

    Raises
    ------
    BadArgument
        If the law has no blocks, or the state is one at nodes.
    """
    law = on_surface(state.law)
    if not law.psi0:
        raise BadArgument("law", state.law, "has no blocks: plot_blocks() is for Microblock")
    if state.shape is None:
        raise BadArgument(
            "method", state.method, "has no cells on which blocks are drawn in three dimensions"
        )
    ell = state.solid.ell
    x1, x2 = _places(state, ell)
    psi1, psi2, u = (_at(state, values, x1, x2) for values in (*state.psi.T, state.displacement))
    turned = np.hypot(psi1, psi2).max()
    magnified = min(SHOWN_TURN / max(turned, 1e-300), LOWERED * ell / max(np.abs(u).max(), 1e-300))
    tilt = law.tilt(x1, x2)  # (-psi0_2, psi0_1)
    psi = magnified * np.column_stack((psi1 + tilt[1], psi2 - tilt[0], np.zeros_like(u)))
    middle = np.column_stack((x1, x2, -ell / 2 - magnified * u))
    corners = middle[:, None] + ell * CUBE + np.cross(psi[:, None], ell * CUBE[None])  # (n, 8, 3)
    closed = _at(state, state.closed, x1, x2, "nearest").astype(int)

    if axis is None:
        axis = plots.Drawing((plots.COLUMN, 3.0), layout="constrained").add_subplot(projection="3d")
    require_kind(Axes3D, "an Axes of matplotlib in three dimensions", ax=axis)
    axis.set_title(f"displacement and rotation {magnified:.2g} times as large")
    look = colours_of(len(law.names))
    colours = look["cmap"](np.arange(len(law.names) + 1))
    faces = np.concatenate([corners[:, members] for members in FACES.values()])
    light = [np.append(np.full(3, 1.0 if face == "top" else SHADE), 1.0) for face in FACES]
    shown = np.concatenate([colours[closed] * each for each in light])
    axis.add_collection3d(
        Poly3DCollection(faces, facecolors=shown, edgecolors="0.25", linewidths=0.3, clip_on=False)
    )
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    axis.set(**dict(zip(("xlim", "ylim", "zlim"), zip(low, high))))
    axis.set(xlabel="$x_1$", ylabel="$x_2$", zticks=())
    axis.locator_params(nbins=4)
    axis.set_box_aspect(high - low, zoom=1.2)
    axis.view_init(elev=50, azim=-60)
    bar = axis.figure.colorbar(ScalarMappable(**look), ax=axis, shrink=0.6, pad=0.02, label="closed corners")
    numbered(bar, len(law.names))
    return axis.figure


def _places(state, ell):
    """Contact points of the blocks about the contact, at most MOST a side: arrays (n,)."""
    box = []
    closed = state.closed.reshape(state.shape)
    for x, there in ((state.x1, closed.any(axis=1)), (state.x2, closed.any(axis=0))):
        touching = x[there]
        middle, half = (touching[0] + touching[-1]) / 2, AROUND * (touching[-1] - touching[0]) / 2 + ell
        count = min(MOST, 1 + 2 * int(min(half, (x[-1] - x[0]) / 2) / ell))
        own = middle + ell * (np.arange(count) - (count - 1) / 2)
        box.append(own[(own >= x[0]) & (own <= x[-1])])
    x1, x2 = np.meshgrid(*box, indexing="ij")
    return x1.ravel(), x2.ravel()


def _at(state, values, x1, x2, method="linear"):
    """Values of cells at places between their centres, array (n,)."""
    cells = values.reshape(state.shape).astype(float)
    return RegularGridInterpolator((state.x1, state.x2), cells, method)((x1, x2))
