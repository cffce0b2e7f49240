"""Results for other programs: states, load paths and studies as CSV, surface and fields as VTK files (ParaView, meshio, PyVista).

Everything is in the units of the scene. Fields of bodies are written by NGSolve, the rest by meshio (extra `vtk`).
"""

import math
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path

import numpy as np

from . import subsurface
from .errors import BadArgument, MissingExtra
from .line_state import LineState
from .panels import zone_edges
from .path import PathView
from .study import write_records
from .surface_view import StateView

CORNERS = {1: ("C",), 2: ("A", "B")}
ACROSS, DOWN = 81, 41       # points of the grid below a contact, if none is given
REACH = 1.5                 # of the contact: width and depth of that grid
FINEST = 3                  # halvings of an element at most


def profile(state):
    """{name: array (n,)} along the contact surface, ascending in x1: x1, x2, weight, pressures, micromoment, psi.

    weight : length of the surface that a node stands for; pressure : of all corners, and of each that the law has
    """
    x = np.asarray(state.x, float)
    height = state.nodes.points[:, 1] if hasattr(state, "nodes") else np.zeros_like(x)
    corners = {f"pressure_{name}": own for name, own in zip(CORNERS[len(state.pressures)], state.pressures)}
    return {"x1": x, "x2": height, "weight": state.weights, "pressure": np.sum(state.pressures, axis=0), **corners,
            "micromoment": state.micromoment, "psi": state.psi}


def to_csv(what, path):
    """Write a state, the events of a load path, or the rows of a study as CSV, with the versions in each row.

    `microblock.study.read_records` reads it back: numbers digit by digit, None as None, anything else as its text.

    Parameters
    ----------
    what : a state, as the `at` of a scene returns it: its `profile`, a row a node, with load, approach and error estimate;
        a load path, as the `load` of a scene returns it: a row an event, with load, load_error, kind, zone and x;
        a list of dicts with the same keys, as `sweep` returns it: a row a dict
    path : where to write it, with its ending

    Raises
    ------
    BadArgument
        For anything else, before a file is written.

    Examples
    --------
    >>> from microblock.study import read_records
    >>> scene = mb.Contact(mb.HalfPlane(mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)), mb.Cylinder(R=10), mb.Microblock())
    >>> mb.to_csv(scene.at(1.0), "state.csv")
    >>> rows = read_records("state.csv")
    >>> round(sum(row["weight"]*row["pressure"] for row in rows), 9)
    1.0
    """
    if isinstance(what, StateView):
        rows = _nodes(what)
    elif isinstance(what, PathView):
        rows = [asdict(event) for event in what.events]
    else:
        rows = _same_columns(what)
    write_records(path, rows)


def _nodes(state):
    columns = {name: np.asarray(values, float).tolist() for name, values in profile(state).items()}
    common = {"load": float(state.load), "approach": float(state.approach), "error_estimate": state.error_estimate}
    return [{**dict(zip(columns, node)), **common} for node in zip(*columns.values())]


def _same_columns(rows):
    """Rows that make a table, or BadArgument."""
    if not isinstance(rows, (list, tuple)) or not rows or not all(isinstance(row, Mapping) for row in rows):
        raise BadArgument("what", rows, "must be a state, a load path, or a list of at least one dict, as sweep() returns it")
    for number, row in enumerate(rows):
        if row.keys() != rows[0].keys():
            raise BadArgument(f"row {number}", list(row), f"must have the columns of the first one, {list(rows[0])}")
    return rows


def to_vtk(state, path, x1=None, x2=None):
    """Write a state as VTK files: the contact surface, and the fields below it where the state has them.

    Files are `path` with "_surface.vtu" and "_body.vtu" added: the surface as lines with the `profile` at its nodes; the
    body with u (3 components), psi, stress (11, 12, 21, 22) and couple stress (2), for a half-plane on a grid, for meshes
    on their elements, cut into smaller ones by their order (of a symmetric scene the half that was computed). States on
    cells (GridState) have the surface alone.

    Parameters
    ----------
    state : what the `at` of a scene returns
    path : str or Path, the beginning of the files' names
    x1, x2 : ascending arrays, of a half-plane's grid (x2 <= 0); without them the grid is 1.5 times as wide and as
        deep as the contact, and finer towards the surface

    Returns
    -------
    list of the paths written

    Raises
    ------
    BadArgument
        For a grid of a state that has nodes of its own, or points above the surface.
    MissingExtra
        Without meshio.

    Examples
    --------
    >>> import meshio
    >>> scene = mb.Contact(mb.HalfPlane(mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)), mb.Cylinder(R=10), mb.Microblock())
    >>> surface, body = mb.to_vtk(scene.at(1.0), "state", x1=np.linspace(-1, 1, 5), x2=np.linspace(-1, 0, 4))
    >>> meshio.read(body).point_data["stress"].shape
    (20, 4)
    """
    surface, body = (Path(f"{path}_{part}.vtu") for part in ("surface", "body"))
    if not isinstance(state, LineState) and (x1 is not None or x2 is not None):
        raise BadArgument("x1, x2", (x1, x2), "belong to a state on the contact line of a half-plane; others have their "
                          "own nodes")
    _write_surface(state, surface)
    if isinstance(state, LineState):
        _write_grid(state, body, *_grid(state, x1, x2))
    elif hasattr(state, "fields"):
        _write_mesh(state.fields, body)
    else:
        return [surface]
    return [surface, body]


def _write_surface(state, path):
    data = profile(state)
    x1, numbers = data["x1"], np.arange(len(data["x1"]) - 1)
    middle = (x1[:-1] + x1[1:])/2
    if isinstance(state, LineState):      # its nodes lie in contact alone: no line across a gap
        intervals = [zone for zones in state.all_zones.values() for zone in zones]
        numbers = numbers[np.any([(left <= middle) & (middle <= right) for left, right in intervals], axis=0)]
    points = np.column_stack((x1, data.pop("x2"), np.zeros_like(x1)))
    _write(path, points, [("line", np.column_stack((numbers, numbers + 1)))], data)


def _grid(state, x1, x2):
    """Abscissae and depths of the grid, those that are given or the usual ones."""
    edges = zone_edges(state.all_zones)
    middle, reach = (edges[-1] + edges[0])/2, REACH*(edges[-1] - edges[0])/2
    x1 = middle + reach*np.linspace(-1, 1, ACROSS) if x1 is None else np.asarray(x1, float)
    return x1, -2*reach*np.linspace(1, 0, DOWN)**2 if x2 is None else np.asarray(x2, float)


def _write_grid(state, path, x1, x2):
    across, down = (part.ravel() for part in np.meshgrid(x1, x2))
    found, zero = subsurface.fields(state, across, down), np.zeros_like(across)
    numbers = np.arange(across.size).reshape(len(x2), len(x1))
    corners = (numbers[:-1, :-1], numbers[:-1, 1:], numbers[1:, 1:], numbers[1:, :-1])
    data = {"u": np.column_stack((*found.u, zero)), "psi": found.psi, "stress": found.stress.reshape(4, -1).T,
            "couple_stress": found.couple.T}
    _write(path, np.column_stack((across, down, zero)), [("quad", np.column_stack([one.ravel() for one in corners]))], data)


def _write(path, points, cells, data):
    try:
        import meshio
    except ModuleNotFoundError as failure:
        raise MissingExtra("to_vtk()", "meshio", "vtk") from failure
    data = {name: np.ascontiguousarray(values) for name, values in data.items()}
    meshio.Mesh(points, cells, point_data=data).write(path)


def _write_mesh(fields, path):
    import ngsolve as ng      # here, for half-planes do without it
    body, stress = fields.body, fields.stress
    pieces = min(math.ceil(math.log2(max(body.order, body.order_psi))), FINEST)
    data = {"u": ng.CF((fields.u1, fields.u2, 0)), "psi": fields.psi,
            "stress": ng.CF(tuple(stress[i, j] for i in (0, 1) for j in (0, 1))), "couple_stress": fields.couple_stress}
    ng.VTKOutput(body.mesh, list(data.values()), list(data), str(path.with_suffix("")), subdivision=pieces,
                 same_type_subdivision=True).Do()
