"""Meshes of bodies in space of which all, or a square, of the top is pressed. The same call with a smaller
`size`, the length of a facet where it is pressed, gives a finer mesh.

Lengths are over the radius of a contact, about 1. Rows of hexahedra take no time: maps make other shapes, and
cuts tetrahedra, of them. Geometries are there where rows do not go.
"""

import netgen.occ as occ
import ngsolve as ng
import numpy as np

from microblock.fem import meshes3d

THERE = 1e-6  # of coordinates of the geometry


# ---- rows of hexahedra


def quarter(size, length=12.0, pressed=1.5):
    """A quarter of a block between planes of symmetry."""
    x = meshes3d.graded(reach=pressed, step=size, far=length, growth=1.8)
    return meshes3d.block(x, x, -x[::-1], reach=pressed)


def block(size, half=2.0, depth=2.2, pressed=1.3):
    """A block about the x3 axis."""
    away = meshes3d.graded(reach=pressed, step=size, far=half, growth=2.0)
    down = meshes3d.graded(reach=size, step=size, far=depth, growth=2.0)
    across = np.concatenate((-away[:0:-1], away))
    return meshes3d.block(across, across, -down[::-1], reach=pressed)


def moved(mesh, change):
    """A mesh whose points, array (n, 3), are changed."""
    netgen = mesh.ngmesh.Copy()
    netgen.Coordinates()[:] = change(netgen.Coordinates().copy())
    return ng.Mesh(netgen)


def cut(mesh):
    """A mesh of tetrahedra of uneven sizes from one of hexahedra."""
    netgen = moved(mesh, skew).ngmesh.Copy()
    netgen.Split2Tets()
    return ng.Mesh(netgen)


def skew(points):
    """Uneven sizes: planes of symmetry and the top stay."""
    x, y, z = points.T
    return np.column_stack((x * (1 + 0.06 * np.sin(2 * y + 1)), y * (1 + 0.06 * np.cos(3 * x)), z))


def tilted(mesh, angle):
    """A mesh turned about an axis between x1 and x2."""
    cross = np.cross(np.eye(3), (0.6, 0.8, 0.0))
    turn = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    return moved(mesh, lambda points: points @ turn)


def lowered(mesh, drop):
    """A mesh whose top lies lower by drop(x1, x2), its bottom where it was."""

    def change(points):
        x, y, z = points.T
        return np.column_stack((x, y, z - drop(x, y) * (1 - z / z.min())))

    return moved(mesh, change)


def layered(mesh, layer):
    """A mesh with the materials "coating" down to a depth, and "base"."""
    netgen = mesh.ngmesh.Copy()
    netgen.SetMaterial(1, "coating")
    base = netgen.AddRegion("base", dim=3)
    elements = netgen.Elements3D().NumPy()
    count = len(mesh[ng.ElementId(ng.VOL, 0)].vertices)
    heights = netgen.Coordinates()[elements["nodes"][:, :count] - 1, 2]
    elements["index"][heights.mean(axis=1) < -layer] = base
    return ng.Mesh(netgen)


# ---- geometries


def tetrahedra(shape, sides, size, coarse, pressed="contact", curve=1):
    """The mesh of a geometry; `sides` are {name: function of the middle of a face}, others are free."""
    for face in shape.faces:
        middle = (face.center.x, face.center.y, face.center.z)
        face.name = next((name for name, holds in sides.items() if holds(*middle)), "free")
        if face.name in pressed.split("|"):
            face.maxh = size
    mesh = ng.Mesh(occ.OCCGeometry(shape).GenerateMesh(maxh=coarse, grading=0.4))
    return mesh.Curve(curve) if curve > 1 else mesh


def holed(size, radius=0.4, half=1.3, depth=2.0):
    """A block with a bore along x2 below the contact."""
    shape = occ.Box((-half, -half, -depth), (half, half, 0))
    bore = occ.Cylinder(occ.Pnt(0.2, -2 * half, -1.0), occ.Y, r=radius, h=4 * half)
    sides = {"bottom": lambda x, y, z: z < THERE - depth, "contact": lambda x, y, z: z > -THERE}
    return tetrahedra(shape - bore, sides, size, 1.0)


def cylinder(size, radius=1.3, depth=1.8):
    """A cylinder on its end, pressed up to its rim."""
    shape = occ.Cylinder(occ.Pnt(0, 0, -depth), occ.Z, r=radius, h=depth)
    sides = {"bottom": lambda x, y, z: z < THERE - depth, "contact": lambda x, y, z: z > -THERE}
    return tetrahedra(shape, sides, size, 1.0, curve=2)


def cap(size, radius=3.0, depth=0.7):
    """The cap of a sphere, its highest point at the origin."""
    ball = occ.Sphere(occ.Pnt(0, 0, -radius), radius)
    shape = ball * occ.Box((-2 * radius, -2 * radius, -depth), (2 * radius, 2 * radius, 2 * radius))
    sides = {"bottom": lambda x, y, z: z < THERE - depth, "contact": lambda x, y, z: True}
    return tetrahedra(shape, sides, size, 1.2, curve=2)


def posts(size, heights=(0.0, -0.01)):
    """A base with two square posts, whose tops "first" and "second" are pressed."""
    base = occ.Box((-2.0, -1.2, -2.2), (2.0, 1.2, -1))
    first, second = (occ.Box((x - 0.5, -0.5, -1), (x + 0.5, 0.5, z)) for x, z in zip((-1.0, 1.0), heights))
    sides = {
        "bottom": lambda x, y, z: z < THERE - 2.2,
        "first": lambda x, y, z: abs(z - heights[0]) < THERE and x < 0,
        "second": lambda x, y, z: abs(z - heights[1]) < THERE and x > 0,
    }
    return tetrahedra(base + first + second, sides, size, 1.0, "first|second")
