"""Meshes. Boundaries are named by role; the contact surface lies at x2 = 0, the body below it."""

import netgen.meshing as netgen
import ngsolve as ng
from ngsolve.meshes import MakeStructured2DMesh

from .errors import BadArgument, require_finite


def line(depth, elements):
    """The depth alone: a 1D mesh of [-depth, 0] for fields that depend on x2 only.

    Boundary points: "contact" at x2 = 0, "middle" at x2 = -depth.
    """
    _check(depth, elements)
    mesh = netgen.Mesh(dim=1)
    points = [mesh.Add(netgen.MeshPoint(netgen.Pnt(depth*(i/elements - 1), 0, 0))) for i in range(elements + 1)]
    solid = mesh.AddRegion("solid", dim=1)
    for pair in zip(points, points[1:]):
        mesh.Add(netgen.Element1D(list(pair), index=solid))
    for name, point in (("middle", points[0]), ("contact", points[-1])):
        mesh.Add(netgen.Element0D(point, index=mesh.AddRegion(name, dim=0)))
    return ng.Mesh(mesh)


def column(depth, elements, width=None, quads=True):
    """One column of 2D elements over [-depth, 0], periodic sideways.

    Boundaries: "contact" on top, "middle" below, "left" and "right" identified with each other.
    `width` (length) is that of one element; a square element without it. With ``quads=False`` each
    element is cut into two triangles.
    """
    _check(depth, elements)
    width = depth/elements if width is None else width
    mesh = MakeStructured2DMesh(quads=quads, nx=1, ny=elements, periodic_x=True,
                                mapping=lambda x, y: (width*x, depth*(y - 1)))
    for number, name in enumerate(mesh.GetBoundaries()):
        mesh.ngmesh.SetBCName(number, {"bottom": "middle", "top": "contact"}.get(name, name))
    return ng.Mesh(mesh.ngmesh)


def _check(depth, elements):
    require_finite(depth=depth)
    if not depth > 0:
        raise BadArgument("depth", depth, "must be positive")
    if not (isinstance(elements, int) and elements >= 1):
        raise BadArgument("elements", elements, "must be an integer of at least 1")
