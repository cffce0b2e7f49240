"""What cases of bodies on meshes share: geometries from netgen, balances of energy and work, pictures of a
deformed body.
"""

import netgen.occ as occ
import ngsolve as ng
import numpy as np

from microblock.data.records import column

# over that of a picture, at which it is cut at its sides; the surface has a dent
HEIGHTS = np.linspace(0.01, 0.85, 60)
SHOWN = 0.1  # largest displacement in a picture, over the height of what is shown
POINTS = ((0, 0), (0.5, 0), (1, 0), (0.5, 0.5), (0, 1), (0, 0.5))  # of a triangle, cut into four
FOUR = ((0, 1, 5), (1, 2, 3), (5, 3, 4), (1, 3, 5))


def mesh_of(face, maxh, order, grading=0.5):
    """Triangles for a face of OCC whose edges have names."""
    return ng.Mesh(occ.OCCGeometry(face, dim=2).GenerateMesh(maxh=maxh, grading=grading)).Curve(order)


def polygon(corners, names):
    """A face of OCC; the edge from each corner to the next has its name."""
    vertices = [occ.Vertex(occ.Pnt(*corner, 0)) for corner in corners]
    edges = [occ.Edge(vertex, following) for vertex, following in zip(vertices, vertices[1:] + vertices[:1])]
    for edge, name in zip(edges, names):
        edge.name = name
    return occ.Face(occ.Wire(edges))


def balances(state):
    """(energy of the fields, work of the load on the way from first touch) over the work of the corner
    forces, minus 1.

    Between nodal events the approach is affine in the load, so that the trapezoidal rule is exact.
    """
    events = state.problem.path(load=state.load).nodal_events
    loads = np.array([*(event.load for event in events), state.load])
    approaches = np.array([*(event.approach for event in events), state.approach])
    work = np.sum(np.diff(approaches) * (loads[1:] + loads[:-1])) / 2
    return float(state.fields.energy() / state.energy - 1), float(work / state.energy - 1)


def points_of(state, window):
    """Records of a body within a window (left, right, bottom): three rows a triangle, with displacements and
    stresses.
    """
    mesh, fields = state.problem.body.mesh, state.fields
    places = mesh.MapToAllElements(ng.IntegrationRule(list(POINTS), [0] * len(POINTS)), ng.VOL)
    names = ("x", "y", "u1", "u2", "psi", "s22")
    values = np.column_stack(
        [function(places).ravel() for function in (ng.x, ng.y, *fields, fields.stress[1, 1])]
    ).reshape(mesh.ne, len(POINTS), len(names))
    left, right, bottom = window
    centres = values[:, :, :2].mean(axis=1)
    inside = (centres[:, 0] > left) & (centres[:, 0] < right) & (centres[:, 1] > bottom)
    return [
        dict(zip(names, map(float, row)))
        for element in values[inside]
        for triangle in FOUR
        for row in element[list(triangle)]
    ]


def _whole(x, y):
    """(left, right) of what triangles, three points each, show at all heights: elements end where they
    like.
    """
    ends = np.stack((x, y), axis=1).reshape(-1, 3, 2)
    sides = np.concatenate([ends[:, pair] for pair in ((0, 1), (1, 2), (2, 0))])
    across = []
    for height in y.min() + HEIGHTS * np.ptp(y):
        low, high = sides[((sides[:, :, 1] - height).prod(axis=1) < 0)].transpose(1, 2, 0)
        found = low[0] + (high[0] - low[0]) * (height - low[1]) / (high[1] - low[1])
        across.append((found.min(), found.max()))
    left, right = zip(*across)
    return max(left), min(right)


def draw_body(axis, rows, length, pressure):
    """The deformed body with -sigma_22 in shades; displacements magnified, the largest to a tenth of the
    height. Returns how often.

    length, pressure : names of their units in the records
    """
    x, y, u1, u2, stress = (np.array(column(rows, name)) for name in ("x", "y", "u1", "u2", "s22"))
    magnified = SHOWN * np.ptp(y) / max(np.hypot(u1, u2).max(), 1e-300)
    top = np.quantile(-stress, 0.995)  # next to ends of a punch it has no bound
    colours = axis.tripcolor(
        x + magnified * u1,
        y + magnified * u2,
        np.arange(len(x)).reshape(-1, 3),
        -stress,
        shading="gouraud",
        cmap="cividis_r",
        vmin=min(0.0, np.quantile(-stress, 0.005)),
        vmax=top,
        rasterized=True,
    )
    bar = axis.figure.colorbar(
        colours, ax=axis, label=rf"$-\sigma_{{22}}/{pressure}$", location="bottom", aspect=30
    )
    bar.ax.locator_params(nbins=5)
    axis.set(aspect="equal", xlabel=f"$x_1/{length}$", ylabel=f"$x_2/{length}$", xlim=_whole(x, y))
    return magnified
