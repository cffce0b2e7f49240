"""Results for other programs: states, load paths and studies as CSV, surface and fields as VTK files.

Everything is in the units of the problem. Fields of bodies are written by NGSolve, the rest by meshio (extra
`vtk`).
"""

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from ..errors import BadArgument, MissingExtra, require_kind, require_place
from ..halfspace.state import SurfaceState
from ..model.events import LoadPath
from ..model.state import State
from ..model.zones import zone_edges
from .records import write_records

ACROSS, DOWN = 81, 41  # points of the grid below a contact, if none is given
REACH = 1.5  # of the contact: width and depth of that grid
FINEST = 3  # halvings of an element at most


def profile(state: State) -> dict[str, np.ndarray]:
    """Return what a state has along the contact surface.

    Parameters
    ----------
    state : State
        A state of any method.

    Returns
    -------
    dict of arrays (n,)
        Values at the nodes, ascending in x1: "x1", "x2", "weight" (the length of the surface that a node
        stands for), "pressure" of all corners together and of each ("pressure_A" and "pressure_B", or
        "pressure_C"), "micromoment", "psi".
    """
    corners = {f"pressure_{name}": own for name, own in state.pressures.items()}
    return {
        "x1": np.asarray(state.x, float),
        "x2": state.solution.points[:, 1],
        "weight": state.weights,
        "pressure": state.pressure,
        **corners,
        "micromoment": state.micromoment,
        "psi": state.psi,
    }


def cells(state: SurfaceState) -> dict[str, np.ndarray]:
    """Return what a state of a half-space has on its cells.

    Parameters
    ----------
    state : SurfaceState

    Returns
    -------
    dict of arrays (n, n)
        Values at the centres of the cells: "x1", "x2", "weight" (the area of a cell), "pressure" of all
        corners together, "m1", "m2" (micromoment), "psi1", "psi2", "displacement", "counter_displacement" (of
        a second body) and "closed".
    """
    x1, x2 = np.meshgrid(state.x1, state.x2, indexing="ij")
    return {
        "x1": x1,
        "x2": x2,
        "weight": state.weights,
        "pressure": state.pressure,
        "m1": state.micromoment[0],
        "m2": state.micromoment[1],
        "psi1": state.psi[0],
        "psi2": state.psi[1],
        "displacement": state.displacement,
        "counter_displacement": state.counter_displacement,
        "closed": state.closed,
    }


def to_csv(
    what: State | SurfaceState | LoadPath | Sequence[Mapping[str, object]], path: str | os.PathLike
) -> None:
    """Write a state, the events of a load path, or the rows of a study as CSV, with the versions in each row.

    `microblock.data.records.read_records` reads it back: numbers digit by digit, None as None, anything else
    as its text.

    Parameters
    ----------
    what : state, load path, or list of dict
        Of a state the table has its `profile`, a row a node, with load, approach and error estimate; of one
        of a half-space its `cells`, a row a cell. Of a load path: a row an event, with load, load_error,
        kind, zone and x. Of dicts with the same keys, as `sweep` returns them, it has a row a dict.
    path : str or path
        Where to write it, with its ending.

    Raises
    ------
    BadArgument
        If `what` is anything else, or no file can be there; then no file is written.

    Examples
    --------
    >>> from microblock.data.records import read_records
    >>> solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)
    >>> problem = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Microblock())
    >>> mb.to_csv(problem.solve(load=1.0), "state.csv")
    >>> rows = read_records("state.csv")
    >>> round(sum(row["weight"]*row["pressure"] for row in rows), 9)
    1.0
    """
    require_place(path)
    if isinstance(what, State):
        rows = _nodes(what, profile(what))
    elif isinstance(what, SurfaceState):
        rows = _nodes(what, cells(what))
    elif isinstance(what, LoadPath):
        rows = [asdict(event) for event in what.events]
    else:
        rows = _same_columns(what)
    write_records(path, rows)


def _nodes(state, columns):
    columns = {name: np.asarray(values, float).ravel().tolist() for name, values in columns.items()}
    common = {"load": float(state.load), "approach": state.approach, "error_estimate": state.error_estimate}
    return [{**dict(zip(columns, node)), **common} for node in zip(*columns.values())]


def _same_columns(rows):
    """Rows that make a table, or BadArgument."""
    if not isinstance(rows, (list, tuple)) or not rows or not all(isinstance(row, Mapping) for row in rows):
        raise BadArgument(
            "what",
            rows,
            "must be a state, a load path, or a list of at least one dict, as sweep() returns it",
        )
    for number, row in enumerate(rows):
        if row.keys() != rows[0].keys():
            raise BadArgument(
                f"row {number}", list(row), f"must have the columns of the first one, {list(rows[0])}"
            )
    return rows


def to_vtk(
    state: State | SurfaceState,
    path: str | os.PathLike,
    x1: ArrayLike | None = None,
    x2: ArrayLike | None = None,
) -> list[Path]:
    """Write a state as VTK files: the contact surface, and the fields below it where the state has them.

    The surface consists of lines, with the `profile` at its nodes. The body has u (3 components), psi, stress
    (11, 12, 21, 22) and couple stress (2): of a half-plane on a grid, of a mesh on its elements, which are
    cut into smaller ones by their order (of a symmetric problem on the half that was computed). States on
    cells have the surface alone.

    Parameters
    ----------
    state : State
        A state of any method; one of a half-space has the surface alone, with its `cells`.
    path : str or path
        The beginning of the files' names, to which "_surface.vtu" and "_body.vtu" are added; an ending ".vtu"
        of its own is left out.
    x1, x2 : array_like, optional
        The grid of a half-plane, ascending, with x2 <= 0. By default it is 1.5 times as wide and as deep as
        the contact, and finer towards the surface.

    Returns
    -------
    list of Path
        The files that were written.

    Raises
    ------
    BadArgument
        If a grid is given for a state that has nodes of its own, or if points lie above the surface.
    MissingExtra
        If meshio is not installed.

    Examples
    --------
    >>> import meshio
    >>> solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)
    >>> problem = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Microblock())
    >>> surface, body = mb.to_vtk(problem.solve(load=1.0), "state", x1=np.linspace(-1, 1, 5),
    ...     x2=np.linspace(-1, 0, 4))
    >>> meshio.read(body).point_data["stress"].shape
    (20, 4)
    """
    require_kind((State, SurfaceState), "a state", state=state)
    require_place(path if Path(path).suffix else f"{path}.vtu")
    path = str(path).removesuffix(".vtu")
    surface, body = (Path(f"{path}_{part}.vtu") for part in ("surface", "body"))
    if state.method != "panels" and (x1 is not None or x2 is not None):
        raise BadArgument(
            "x1, x2",
            (x1, x2),
            "belong to a state on the contact line of a half-plane; others have their own nodes",
        )
    if isinstance(state, SurfaceState):
        _write_cells(state, surface)
        return [surface]
    _write_surface(state, surface)
    if state.method == "panels":
        _write_grid(state, body, *_grid(state, x1, x2))
    elif hasattr(state.solution, "fields"):
        _write_mesh(state.fields, body)
    else:
        return [surface]
    return [surface, body]


def _write_cells(state, path):
    """The surface of a half-space: values at the centres of its cells, quadrilaterals between them."""
    data = {name: values.ravel() for name, values in cells(state).items()}
    numbers = np.arange(state.pressure.size).reshape(state.pressure.shape)
    points = np.column_stack((data.pop("x1"), data.pop("x2"), np.zeros(numbers.size)))
    _write(path, points, [("quad", _quadrilaterals(numbers))], data)


def _quadrilaterals(numbers):
    """Those between the points of a grid that have these numbers."""
    corners = (numbers[:-1, :-1], numbers[:-1, 1:], numbers[1:, 1:], numbers[1:, :-1])
    return np.column_stack([one.ravel() for one in corners])


def _write_surface(state, path):
    data = profile(state)
    x1, numbers = data["x1"], np.arange(len(data["x1"]) - 1)
    middle = (x1[:-1] + x1[1:]) / 2
    if state.method == "panels":  # its nodes lie in contact alone: no line across a gap
        intervals = [zone for zones in state.zones.values() for zone in zones]
        numbers = numbers[np.any([(left <= middle) & (middle <= right) for left, right in intervals], axis=0)]
    points = np.column_stack((x1, data.pop("x2"), np.zeros_like(x1)))
    _write(path, points, [("line", np.column_stack((numbers, numbers + 1)))], data)


def _grid(state, x1, x2):
    """Abscissae and depths of the grid, those that are given or the usual ones."""
    edges = zone_edges({"contact": state.zones["contact"]})
    middle, reach = (edges[-1] + edges[0]) / 2, REACH * (edges[-1] - edges[0]) / 2
    x1 = middle + reach * np.linspace(-1, 1, ACROSS) if x1 is None else np.asarray(x1, float)
    return x1, -2 * reach * np.linspace(1, 0, DOWN) ** 2 if x2 is None else np.asarray(x2, float)


def _write_grid(state, path, x1, x2):
    across, down = (part.ravel() for part in np.meshgrid(x1, x2))
    found, zero = state.fields(across, down), np.zeros_like(across)
    numbers = np.arange(across.size).reshape(len(x2), len(x1))
    data = {
        "u": np.column_stack((*found.u, zero)),
        "psi": found.psi,
        "stress": found.stress.reshape(4, -1).T,
        "couple_stress": found.couple_stress.T,
    }
    quads = _quadrilaterals(numbers)
    _write(path, np.column_stack((across, down, zero)), [("quad", quads)], data)


def _write(path, points, cells, data):
    try:
        import meshio
    except ModuleNotFoundError as failure:
        raise MissingExtra("to_vtk()", "meshio", "vtk") from failure
    data = {name: np.ascontiguousarray(values) for name, values in data.items()}
    meshio.Mesh(points, cells, point_data=data).write(path)


def _write_mesh(fields, path):
    import ngsolve as ng  # here, for half-planes do without it

    body, stress = fields.body, fields.stress
    pieces = min(math.ceil(math.log2(max(body.order, body.order_psi))), FINEST)
    data = {
        "u": ng.CF((fields.u1, fields.u2, 0)),
        "psi": fields.psi,
        "stress": ng.CF(tuple(stress[i, j] for i in (0, 1) for j in (0, 1))),
        "couple_stress": fields.couple_stress,
    }
    ng.VTKOutput(
        body.mesh,
        list(data.values()),
        list(data),
        str(path.with_suffix("")),
        subdivision=pieces,
        same_type_subdivision=True,
    ).Do()
