"""Cuts of the triangles or tetrahedra of a mesh."""

from typing import Any

import netgen.meshing as netgen
import ngsolve as ng
import numpy as np

from ..model.types import Array, Flags


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


def facets_at(mesh: Any, region: Any, x: Array) -> Flags:
    """Returns whether places x, (k,), lie at each facet of a boundary, about, array (k, facets)."""
    ends = np.array([[mesh[vertex].point[0] for vertex in facet.vertices] for facet in region.Elements()])
    left = ends.min(axis=1)
    right = ends.max(axis=1)
    return np.abs(x[:, None] - (left + right) / 2) <= 0.55 * (right - left)
