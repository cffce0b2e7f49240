"""Cuts of the triangles, of tetrahedra and of rows of hexahedra of a mesh."""

from collections.abc import Iterator, Sequence
from itertools import product
from typing import Any

import netgen.meshing as netgen
import ngsolve as ng
import numpy as np

from ..model.types import Array, Flags, Integers


def too_small(mesh: Any) -> Flags:
    """Returns elements to be cut no more, boolean array (elements,): of their sides rounding leaves four
    digits.
    """
    points = mesh.ngmesh.Coordinates()
    cells = mesh.ngmesh.Elements3D() if mesh.dim == 3 else mesh.ngmesh.Elements2D()
    corners = points[cells.NumPy()["nodes"][:, : mesh.dim + 1] - 1]
    sizes = np.ptp(corners, axis=1).max(axis=1)
    return sizes <= 1e4 * np.finfo(float).eps * np.abs(points).max()


def cut(mesh: Any, chosen: Flags) -> None:
    """Cuts the chosen simplices of a mesh, boolean array (elements,), but for those that are `too_small`."""
    mesh.SetRefinementFlags((chosen & ~too_small(mesh)).tolist())
    mesh.Refine()


def of_triangles(mesh: Any) -> Any:
    """Returns a mesh with quadrilaterals cut along their shorter diagonals; None without any."""
    triangles = mesh.ngmesh.Copy()
    cells = triangles.Elements2D()
    points = triangles.Coordinates()
    quads = np.array([element.type == ng.ET.QUAD for element in mesh.Elements()])
    if not quads.any():
        return None
    corners = points[cells.NumPy()["nodes"] - 1]
    first, second = np.linalg.norm(corners[:, :2] - corners[:, 2:], axis=2).T
    for number in np.flatnonzero(quads).tolist():
        a, b, c, d = cells[number].vertices
        if second[number] < first[number]:
            a, b, c, d = b, c, d, a
        region = cells[number].index
        cells[number] = netgen.Element2D(region, [a, b, c])
        triangles.Add(netgen.Element2D(region, [a, c, d]))
    return ng.Mesh(triangles).Curve(mesh.GetCurveOrder())


def grid_lines(mesh: Any) -> list[Array] | None:
    """Returns the coordinates x1, x2 and x3, ascending, between which the elements of a mesh are all boxes of
    a grid; None of other meshes.
    """
    if mesh.GetCurveOrder() > 1 or any(element.type != ng.ET.HEX for element in mesh.Elements()):
        return None
    lines = [np.unique(along) for along in mesh.ngmesh.Coordinates().T]
    corners = _corners(mesh.ngmesh, mesh.ngmesh.Elements3D(), 8)
    rows = _rows_of(corners, lines)
    ends = np.array([np.searchsorted(line, x) for line, x in zip(lines, corners.max(axis=1).T)])
    counts = [len(line) - 1 for line in lines]
    fills = len(np.unique(rows, axis=1).T) == mesh.ne == np.prod(counts)
    return lines if fills and np.array_equal(ends, rows + 1) else None


def with_rows_halved(mesh: Any, lines: Sequence[Array], chosen: Flags) -> Any:
    """Returns a mesh of boxes between grid `lines` in which all rows along each axis are halved that hold one
    of the chosen elements, boolean array (elements,).
    """
    old = mesh.ngmesh
    boxes = old.Elements3D()
    rows = _rows_of(_corners(old, boxes, 8)[chosen], lines)
    halved = [np.bincount(numbers, minlength=len(line)) > 0 for numbers, line in zip(rows, lines)]
    middles = [(line + np.roll(line, -1))[cut] / 2 for line, cut in zip(lines, halved)]
    finer_lines = [np.sort(np.concatenate(pair)) for pair in zip(lines, middles)]
    counts = [len(line) for line in finer_lines]
    finer = netgen.Mesh(dim=3)
    points = [finer.Add(netgen.MeshPoint(netgen.Pnt(*map(float, place)))) for place in product(*finer_lines)]
    for face in old.FaceDescriptors():
        finer.Add(netgen.FaceDescriptor(face.surfnr, face.domin, face.domout, face.bc))
    for number, name in enumerate(mesh.GetBoundaries()):
        finer.SetBCName(number, name)
    for number, name in enumerate(mesh.GetMaterials(), 1):
        finer.SetMaterial(number, name)
    for kind, elements, count in ((netgen.Element3D, boxes, 8), (netgen.Element2D, old.Elements2D(), 4)):
        for element, corners in zip(elements, _corners(old, elements, count)):
            for part in _parts(corners, lines, halved):
                places = [np.searchsorted(line, x) for line, x in zip(finer_lines, part.T)]
                vertices = np.ravel_multi_index(places, counts)
                finer.Add(kind(element.index, [points[vertex] for vertex in vertices]))
    return ng.Mesh(finer)


def _parts(corners: Array, lines: Sequence[Array], halved: Sequence[Flags]) -> Iterator[Array]:
    """Yields the corners, arrays (k, 3), of the parts of a box, or of a side of one, between grid lines whose
    rows are halved or not.
    """
    low, high = corners.min(axis=0), corners.max(axis=0)
    ends = []
    for axis, row in enumerate(_rows_of(corners[None], lines)[:, 0]):
        cut = low[axis] < high[axis] and halved[axis][row]
        ends.append((low[axis], high[axis]) if cut else (None,))
    middle = (low + high) / 2
    for opposite in product(*ends):
        moves = np.array([corners[:, axis] == end for axis, end in enumerate(opposite)]).T
        yield np.where(moves, middle, corners)


def _rows_of(corners: Array, lines: Sequence[Array]) -> Integers:
    """Returns the rows of a grid in which elements with corners, array (elements, k, 3), begin, along each
    axis: array (3, elements).
    """
    return np.array([np.searchsorted(line, x) for line, x in zip(lines, corners.min(axis=1).T)])


def _corners(mesh: Any, elements: Any, count: int) -> Array:
    """Returns the corners of elements with `count` of them, array (elements, count, 3)."""
    return np.asarray(mesh.Coordinates()[elements.NumPy()["nodes"][:, :count] - 1], float)


def facets_at(mesh: Any, region: Any, x: Array) -> Flags:
    """Returns whether places x, (k,), lie at each facet of a boundary, about, array (k, facets)."""
    ends = np.array([[mesh[vertex].point[0] for vertex in facet.vertices] for facet in region.Elements()])
    left = ends.min(axis=1)
    right = ends.max(axis=1)
    return np.abs(x[:, None] - (left + right) / 2) <= 0.55 * (right - left)
