"""Results for other programs: CSV tables and VTK files, in the units of the problem."""

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np
from scipy.spatial import Delaunay

from ..errors import BadArgument, MissingExtra, require_kind, require_place, writing
from ..model.events import Event, LoadPath
from ..model.history import History
from ..model.intervals import contains
from ..model.state import State
from .records import write_records


def profile(state: State) -> dict[str, np.ndarray]:
    """Returns what a state has on the contact surface: {name: array (n,)} at nodes or centres of cells.

    Names are "x1", "x2" ("x3" in space), "weight", "pressure" and that of corners ("pressure_A", ...),
    "micromoment" and "psi" ("m1", "m2", "psi1", "psi2" in space), "displacement"; with friction
    "shear_traction" and "slip", of a second body "counter_displacement", in space the number "closed".
    """
    turned = ("micromoment", "psi") if state.flat else ("m1", "m2", "psi1", "psi2")
    found = {
        **dict(zip(("x1", "x2", "x3"), state.points.T)),
        "weight": state.weights,
        "pressure": state.pressure,
        **{f"pressure_{name}": own for name, own in state.pressures.items()},
        **dict(zip(turned, np.vstack((state.micromoment.T, state.psi.T)))),
        "displacement": state.displacement,
        "closed": None if state.flat else state.closed,
        "counter_displacement": state.opposite,
        "shear_traction": state.shear_traction,
        "slip": state.slip,
    }
    return {name: np.asarray(values, float) for name, values in found.items() if values is not None}


def to_csv(
    what: State | History | LoadPath | Sequence[State | Event | Mapping[str, object]], path: str | os.PathLike
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


def _nodes(state):
    columns = {name: values.tolist() for name, values in profile(state).items()}
    names = ["load", "approach", "error_estimate", "energy", "residual", "method"]
    names += ["shear", "tangential_approach", "dissipation", "work"] * (state.shear is not None)
    common = {name: getattr(state, name) for name in names} | {"warnings": "; ".join(state.warnings)}
    return [{**dict(zip(columns, node)), **common} for node in zip(*columns.values())]


def _rows(what):
    """Rows that make a table, or BadArgument."""
    if isinstance(what, State):
        return _nodes(what)
    if isinstance(what, LoadPath):
        return [{**asdict(event), "warnings": "; ".join(what.warnings)} for event in what.events]
    rows = what.states if isinstance(what, History) else what if isinstance(what, (list, tuple)) else ()
    if all(isinstance(row, State) for row in rows):
        rows = [{"state": number, **row} for number, state in enumerate(rows) for row in _nodes(state)]
    rows = [asdict(row) if isinstance(row, Event) else row for row in rows]
    if not rows or not all(isinstance(row, Mapping) for row in rows):
        words = "must be a state, a history, a load path, or a list of at least one state, event or dict"
        raise BadArgument("what", what, words)
    return rows


def to_vtk(state: State | History, path: str | os.PathLike) -> list[Path]:
    """Write a state as VTK files: the contact surface, and the fields below it.

    The surface has the `profile`. The body has u (3 components), psi, stress (11, 12, 21, 22) and couple
    stress (2), in space psi (3), stress and couple stress (9, by rows), on a grid 1.5 times as wide and deep
    as the contact or on elements, cut by their order. States on cells, and on panels with friction, have no
    body.

    Parameters
    ----------
    state : State or History
        Each state of a history has its files.
    path : str or path
        Beginning of the files' names before "_surface.vtu" and "_body.vtu"; in a history "_surface_0.vtu" and
        so on, which ParaView opens as a series.

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
    path = str(path).removesuffix(".vtu")
    states = {"": state}
    if isinstance(state, History):
        states = {f"_{number}": own for number, own in enumerate(state.states)}
    return [file for number, own in states.items() for file in _written(own, path, number)]


def _written(state, path, number):
    surface, body = (Path(f"{path}_{part}{number}.vtu") for part in ("surface", "body"))
    fields = getattr(state.solution, "fields", None)
    if hasattr(fields, "body"):  # the body first, since it may raise an error: then no file is written
        _write_mesh(fields, body)
    elif fields is not None:
        _write_grid(state, body)
    _write_surface(state, surface)
    return [surface] if fields is None else [surface, body]


def _write_surface(state, path):
    data = profile(state)
    points = np.pad(state.points, ((0, 0), (0, 3 - state.points.shape[1])))
    if state.flat:
        kind, cells = "line", _lines(state)
    else:
        kind, cells = "triangle", state.triangles if state.squares is None else _triangles(*points.T[:2])
    if not len(cells):  # the surface of a column is one point
        kind, cells = "vertex", np.zeros((1, 1), int)
    _write(path, points, [(kind, cells)], data)


def _triangles(x, y):
    """Triangles between points, array (m, 3)."""
    return Delaunay(np.column_stack((x, y))).simplices


def _lines(state):
    """Ends of lines between neighbouring nodes, but across no gap."""
    together = np.ones(len(state.x) - 1, bool) if state.apart is None else ~state.apart
    if state.method == "panels":  # its nodes lie in contact alone
        intervals = [zone for zones in state.zones.values() for zone in zones]
        together = contains(intervals, (state.x[:-1] + state.x[1:]) / 2)
    return np.flatnonzero(together)[:, None] + np.arange(2)


def _write_grid(state, path):
    left, right = state.zones["contact"][0][0], state.zones["contact"][-1][1]
    middle, reach = (right + left) / 2, 1.5 * (right - left) / 2
    x1 = middle + reach * np.linspace(-1, 1, 81)
    x2 = -2 * reach * np.linspace(1, 0, 41) ** 2
    across, down = (part.ravel() for part in np.meshgrid(x1, x2))
    found, zero = state.solution.fields(across, down), np.zeros_like(across)
    data = {
        "u": np.column_stack((*found.u, zero)),
        "psi": found.psi,
        "stress": found.stress.reshape(4, -1).T,
        "couple_stress": found.couple_stress.T,
    }
    cells = [("triangle", _triangles(across, down))]
    _write(path, np.column_stack((across, down, zero)), cells, data)


def _write_mesh(fields, path):
    import ngsolve as ng  # here, for half-planes do without it

    body = fields.body
    pieces = min(math.ceil(math.log2(max(body.order, body.order_psi))), 3)
    data = {
        "u": fields.u if body.mesh.dim == 3 else ng.CF((fields.u1, fields.u2, 0)),
        "psi": fields.psi,
        "stress": fields.stress.Reshape((fields.stress.dim,)),
        "couple_stress": fields.couple_stress.Reshape((fields.couple_stress.dim,)),
    }
    ng.VTKOutput(
        body.mesh,
        list(data.values()),
        list(data),
        str(path.with_suffix("")),
        subdivision=pieces,
        same_type_subdivision=True,
    ).Do()


def _write(path, points, cells, data):
    try:
        import meshio
    except ModuleNotFoundError as failure:
        raise MissingExtra("to_vtk()", "meshio", "vtk") from failure
    data = {name: np.ascontiguousarray(values) for name, values in data.items()}
    with writing(path):
        meshio.Mesh(points, cells, point_data=data).write(path)
