"""Results for other programs: CSV tables and VTK files, in the units of the problem."""

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import Delaunay

from ..errors import BadArgument, MissingExtra, require_kind, require_place, writing
from ..model.events import Event, LoadPath
from ..model.fields import halves
from ..model.history import History
from ..model.intervals import contains
from ..model.state import State
from ..model.types import Array, Integers
from .records import write_records


def profile(state: State) -> dict[str, Array]:
    """Returns what a state has on the contact surface: {name: array (n,)} at nodes or centres of cells.

    Names are "x1", "x2" ("x3" in space), "weight", "pressure" and that of corners ("pressure_A", ...),
    "micromoment" and "psi" ("m1", "m2", "psi1", "psi2" in space), "displacement"; with friction
    "shear_traction" and "slip" ("shear_traction1", ..., "slip2" and "stick" in space), of a second body
    "counter_displacement", in space the number "closed".
    """
    rotational: tuple[str, ...] = ("m1", "m2", "psi1", "psi2")
    closed: Integers | None = state.closed
    if state.flat:
        rotational = ("micromoment", "psi")
        closed = None
    sheared: dict[str, Any] = {}
    if state.shear is not None:
        sheared = _components(state, "shear_traction") | _components(state, "slip")
    columns = {
        **dict(zip(("x1", "x2", "x3"), state.points.T)),
        "weight": state.weights,
        "pressure": state.pressure,
        **{f"pressure_{corner}": pressure for corner, pressure in state.pressures.items()},
        **dict(zip(rotational, np.vstack((state.micromoment.T, state.psi.T)))),
        "displacement": state.displacement,
        "closed": closed,
        "counter_displacement": state.opposite,
        **sheared,
        "stick": state.stick,
    }
    return {name: np.asarray(values, float) for name, values in columns.items() if values is not None}


def _components(state: State, name: str) -> dict[str, Any]:
    """Returns {name: values} along the surface of a state in the plane, in space an entry for each component:
    name1, name2.
    """
    values = getattr(state, name)
    return {name: values} if state.flat else {f"{name}1": values[..., 0], f"{name}2": values[..., 1]}


def to_csv(
    what: State | History | LoadPath | Sequence[State | Event | Mapping[str, object]],
    path: str | os.PathLike[str],
) -> None:
    """Write states, events or the rows of a study as CSV, with the versions in each row;
    `microblock.data.records.read_records` reads it back.

    Parameters
    ----------
    what : state, History, LoadPath, or list of states, of events or of dict
        A state gives a row a node or cell: its `profile`, load, approach, error estimate, energy, residual,
        method and warnings; with friction also shear force, tangential approach, dissipation and work. Among
        states the column "state" counts from 0. Events and dicts give a row each, with empty cells where they
        lack a key of others.
    path : str or path
        With the ending ".csv", ".txt", ".dat" or none.

    Raises
    ------
    BadArgument
        If `what` is anything else, or no file can be there.

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
    require_place(path, endings=("csv", "txt", "dat"))
    write_records(path, _rows(what))


def _nodes(state: State) -> list[dict[str, object]]:
    """Returns a row a node of a state."""
    columns = {name: values.tolist() for name, values in profile(state).items()}
    names = ["load", "approach", "error_estimate", "energy", "residual", "method"]
    common: dict[str, object] = {name: getattr(state, name) for name in names}
    if state.shear is not None:
        common |= _components(state, "shear") | _components(state, "tangential_approach")
        common |= {"dissipation": state.dissipation, "work": state.work}
    common["warnings"] = "; ".join(state.warnings)
    return [{**dict(zip(columns, node)), **common} for node in zip(*columns.values())]


def _rows(what: object) -> list[Mapping[str, object]]:
    """Returns rows that make a table; raises BadArgument if there are none."""
    if isinstance(what, State):
        return [*_nodes(what)]
    if isinstance(what, LoadPath):
        return [{**asdict(event), "warnings": "; ".join(what.warnings)} for event in what.events]
    entries: Sequence[Any] = ()
    if isinstance(what, History):
        entries = what.states
    elif isinstance(what, (list, tuple)):
        entries = what
    if all(isinstance(entry, State) for entry in entries):
        entries = [{"state": number, **row} for number, state in enumerate(entries) for row in _nodes(state)]
    rows = [asdict(entry) if isinstance(entry, Event) else entry for entry in entries]
    if not rows or not all(isinstance(row, Mapping) for row in rows):
        words = "must be a state, a history, a load path, or a list of at least one state, event or dict"
        raise BadArgument("what", what, words)
    return rows


def to_vtk(state: State | History, path: str | os.PathLike[str]) -> list[Path]:
    """Write a state as VTK files: the contact surface, and the fields below it.

    The surface has the `profile`. The body has u (3 components), psi, stress (11, 12, 21, 22) and couple
    stress (2), in space psi (3), stress and couple stress (9, by rows), on a grid 1.5 times as wide and deep
    as the contact, of a half-space in the plane x2 of the centre of pressure, or on elements, cut by their
    order. Of two bodies on meshes the second one has a file as well.

    Parameters
    ----------
    state : State or History
        Each state of a history has its files.
    path : str or path
        Beginning of the files' names before "_surface.vtu", "_body.vtu" and "_second_body.vtu"; in a history
        "_surface_0.vtu" and so on, which ParaView opens as a series.

    Returns
    -------
    list of Path
        The files.

    Raises
    ------
    BadArgument
        If no file can be there.
    MissingExtra
        If meshio is not installed.

    Examples
    --------
    >>> import meshio
    >>> solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)
    >>> problem = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Microblock())
    >>> surface, body = mb.to_vtk(problem.solve(load=1.0), "state")
    >>> meshio.read(body).point_data["stress"].shape
    (3321, 4)
    """
    require_kind((State, History), "a state, or a history of states", state=state)
    require_place(path, endings=("vtu",))
    beginning = str(path).removesuffix(".vtu")
    if isinstance(state, State):
        return _write_state(state, beginning, "")
    files = []
    for number, step in enumerate(state.states):
        files += _write_state(step, beginning, f"_{number}")
    return files


def _write_state(state: State, beginning: str, ending: str) -> list[Path]:
    """Returns the files of a state, written."""
    surface = Path(f"{beginning}_surface{ending}.vtu")
    body = Path(f"{beginning}_body{ending}.vtu")
    fields: Any = state.solution.fields
    if fields is None:
        _write_surface(state, surface)
        return [surface]
    # the body first, since it may raise an error: then no file is written
    files = [surface, body]
    if not state.solution.fields_on_mesh:
        _write_grid(state, body)
    else:
        _write_mesh(fields, body)
        if fields.second is not None:
            files.append(Path(f"{beginning}_second_body{ending}.vtu"))
            _write_mesh(fields.second, files[-1])
    _write_surface(state, surface)
    return files


def _write_surface(state: State, path: Path) -> None:
    data = profile(state)
    points = np.pad(state.points, ((0, 0), (0, 3 - state.points.shape[1])))
    kind = "triangle"
    cells: Any = state.triangles
    if state.flat:
        kind = "line"
        cells = _lines(state)
    elif state.squares is not None:
        cells = _triangles(points[:, 0], points[:, 1])
    if not len(cells):  # the surface of a column is one point
        kind = "vertex"
        cells = np.zeros((1, 1), int)
    _write(path, points, kind, cells, data)


def _triangles(x: Array, y: Array) -> Integers:
    """Returns triangles between points, array (m, 3)."""
    return Delaunay(np.column_stack((x, y))).simplices


def _lines(state: State) -> Integers:
    """Returns the ends of lines between neighbouring nodes, but across no gap, array (m, 2)."""
    together = np.ones(len(state.x) - 1, bool)
    if state.method == "panels":  # its nodes lie in contact alone
        intervals = [interval for zones in state.zones.values() for interval in zones]
        together = contains(intervals, (state.x[:-1] + state.x[1:]) / 2)
    elif state.interrupted is not None:
        together = ~state.interrupted
    return np.flatnonzero(together)[:, None] + np.arange(2)


def _write_grid(state: State, path: Path) -> None:
    """Writes the fields of a half-plane, or of a half-space in a plane through the centre of pressure."""
    edges = np.ravel(state.zones["contact"]) if state.flat else state.points[state.closed > 0, 0]
    middle = (edges.max() + edges.min()) / 2
    reach = 1.5 * np.ptp(edges) / 2
    grid = np.meshgrid(middle + reach * np.linspace(-1, 1, 81), -2 * reach * np.linspace(1, 0, 41) ** 2)
    x1 = grid[0].ravel()
    down = grid[1].ravel()
    places = (x1, down) if state.flat else (x1, np.full_like(x1, state.centre[1]), down)
    fields = state.fields(*places)
    zero = np.zeros_like(x1)
    data = {
        "u": np.column_stack((*fields.u, zero)[:3]),
        "psi": fields.psi.T,
        "stress": fields.stress.reshape(-1, len(x1)).T,
        "couple_stress": fields.couple_stress.reshape(-1, len(x1)).T,
    }
    triangles = halves(np.arange(x1.size).reshape(grid[0].shape))
    _write(path, np.column_stack((*places, zero)[:3]), "triangle", triangles, data)


def _write_mesh(fields: Any, path: Path) -> None:
    """Writes the fields of a finite element solution on its elements, cut by their order."""
    import ngsolve as ng  # here, for half-planes do without it

    body = fields.body
    pieces = min(math.ceil(math.log2(max(body.order, body.order_psi))), 3)
    data = {
        "u": fields.u if body.mesh.dim == 3 else ng.CF((fields.u1, fields.u2, 0)),
        "psi": fields.psi,
        "stress": fields.stress.Reshape((fields.stress.dim,)),
        "couple_stress": fields.couple_stress.Reshape((fields.couple_stress.dim,)),
    }
    if body.mesh.dim == 1:
        _write_column(body.mesh, data, 2**pieces, path)
        return
    ng.VTKOutput(
        body.mesh,
        list(data.values()),
        list(data),
        str(path.with_suffix("")),
        subdivision=pieces,
        same_type_subdivision=True,
    ).Do()


def _write_column(mesh: Any, data: Mapping[str, Any], pieces: int, path: Path) -> None:
    """Writes fields of a mesh of one dimension, whose coordinate is x2, on its elements, each in pieces:
    NGSolve leaves the other coordinates of such points undefined.
    """
    import ngsolve as ng

    rule = ng.IntegrationRule([(piece / pieces,) for piece in range(pieces + 1)], [0.0] * (pieces + 1))
    places = mesh.MapToAllElements(rule, ng.VOL)
    values = {name: np.reshape(field(places), (len(places), -1)) for name, field in data.items()}
    points = np.zeros((len(places), 3))
    points[:, 1] = np.ravel(ng.x(places))
    first_points = np.arange(len(places)).reshape(mesh.ne, -1)[:, :-1].ravel()
    _write(path, points, "line", np.column_stack((first_points, first_points + 1)), values)


def _write(path: Path, points: Array, kind: str, cells: Integers, data: Mapping[str, Array]) -> None:
    """Writes data at points, (n, 3), and cells of a kind between them, (m, corners)."""
    try:
        import meshio
    except ModuleNotFoundError as failure:
        raise MissingExtra("to_vtk()", "meshio", "vtk") from failure
    arrays = {name: np.ascontiguousarray(values) for name, values in data.items()}
    with writing(path):
        meshio.Mesh(points, [(kind, cells)], point_data=arrays).write(path)
