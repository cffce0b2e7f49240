"""Meshes of three-dimensional bodies: rectangular blocks of hexahedra, smaller ones where contact is."""

import math

import netgen.meshing as netgen
import ngsolve as ng
import numpy as np

from ..errors import BadArgument, require_numbers, require_positive
from .body import FIELDS3D

SIDES = {(0, 0): "left", (0, 1): "right", (1, 0): "front", (1, 1): "back", (2, 0): "bottom", (2, 1): "top"}
CONTACT = "contact"
WHOLE = 1e-9  # of a step, by which a length may miss a whole number of them
PLANES = {0: ("u1", "psi2", "psi3"), 1: ("u2", "psi1", "psi3")}  # 0 on a plane of symmetry across the axis


def graded(reach, step, far, growth=1.5):
    """Coordinates from 0 to `far`: equal steps up to `reach`, then each longer than the one before.

    Parameters
    ----------
    reach, step, far : float
        Lengths; the steps are at most `step` long.
    growth : float
        Ratio of a step to the one before, at most.

    Returns
    -------
    array (n,), ascending; `reach` and `far` are among them

    Raises
    ------
    BadArgument
        If a length is not positive, far lies within reach, or growth is below 1.

    Examples
    --------
    >>> from microblock.fem.meshes3d import graded
    >>> graded(reach=1.0, step=0.5, far=4.0, growth=2.0).tolist()
    [0.0, 0.5, 1.0, 2.0, 4.0]
    """
    require_positive(reach=reach, step=step, far=far, growth=growth)
    if far < reach:
        raise BadArgument("far", far, f"must be at least reach = {reach}")
    if growth < 1:
        raise BadArgument("growth", growth, "must be at least 1")
    count = max(1, math.ceil(reach / step - WHOLE))
    inner, step = np.linspace(0.0, reach, count + 1), reach / count
    if far == reach:
        return inner
    steps = [step * growth]
    while sum(steps) < (far - reach) * (1 - WHOLE):
        steps.append(steps[-1] * growth)
    outer = reach + (far - reach) * np.cumsum(steps) / sum(steps)
    outer[-1] = far
    return np.concatenate((inner, outer))


def block(x1, x2, x3, reach=math.inf):
    """A rectangular block of hexahedra with vertices at given coordinates.

    Boundaries are "left" and "right" across x1, "front" and "back" across x2, "bottom", and on top "contact",
    where facets have their middle in the square of the half-width `reach` about the origin, else "top".

    Parameters
    ----------
    x1, x2, x3 : arrays, ascending
        Coordinates of the vertices (lengths).
    reach : float
        Half of the side of the square of contact (length).

    Returns
    -------
    ngsolve.Mesh

    Raises
    ------
    BadArgument
        If coordinates do not ascend, or no facet is within reach.

    Examples
    --------
    >>> from microblock.fem import meshes3d
    >>> x = meshes3d.graded(reach=1.0, step=0.5, far=4.0)
    >>> quarter = meshes3d.block(x, x, -x[::-1], reach=1.0)
    >>> quarter.ne, sorted(set(quarter.GetBoundaries()))
    (125, ['back', 'bottom', 'contact', 'front', 'left', 'right', 'top'])
    """
    axes = [_ascending(name, x) for name, x in (("x1", x1), ("x2", x2), ("x3", x3))]
    if not (isinstance(reach, float) and reach == math.inf):
        require_positive(reach=reach)
    middles = [(x[1:] + x[:-1]) / 2 for x in axes[:2]]
    if not all(np.any(np.abs(middle) < reach) for middle in middles):
        raise BadArgument("reach", reach, "must hold the middle of a facet at least")
    mesh = netgen.Mesh(dim=3)
    counts = [len(x) for x in axes]
    points = [
        mesh.Add(netgen.MeshPoint(netgen.Pnt(x, y, z))) for x in axes[0] for y in axes[1] for z in axes[2]
    ]
    numbers = np.arange(len(points)).reshape(counts)
    names = [*SIDES.values(), CONTACT]
    for number, name in enumerate(names, 1):
        mesh.Add(netgen.FaceDescriptor(surfnr=number, domin=1, domout=0, bc=number))
        mesh.SetBCName(number - 1, name)
    for i, j, k in np.ndindex(*(count - 1 for count in counts)):
        ends = numbers[i : i + 2, j : j + 2, k : k + 2]
        around = [ends[a][order] for a in (0, 1) for order in ((0, 0), (0, 1), (1, 1), (1, 0))]
        mesh.Add(netgen.Element3D(1, [points[number] for number in around]))
    for (axis, end), name in SIDES.items():
        side = np.take(numbers, -end, axis=axis)
        for i, j in np.ndindex(side.shape[0] - 1, side.shape[1] - 1):
            around = [side[i, j], side[i + 1, j], side[i + 1, j + 1], side[i, j + 1]]
            # the outward normal is right-handed
            around = around if bool(end) != (axis == 1) else around[::-1]
            pressed = name == "top" and abs(middles[0][i]) < reach and abs(middles[1][j]) < reach
            face = names.index(CONTACT if pressed else name) + 1
            mesh.Add(netgen.Element2D(face, [points[number] for number in around]))
    return ng.Mesh(mesh)


def supports(fixed="bottom", **planes):
    """What a body constrains on its fixed boundaries and on its planes of symmetry.

    Parameters
    ----------
    fixed : str
        Boundaries on which all fields are 0.
    planes : {"x1" or "x2": boundaries}
        Planes of symmetry across x1 and across x2.

    Returns
    -------
    {field: boundaries}, for `Body(fixed=...)`

    Examples
    --------
    >>> from microblock.fem.meshes3d import supports
    >>> supports("bottom", x1="left")["psi2"], supports("bottom", x1="left")["u3"]
    ('bottom|left', 'bottom')
    """
    found = {name: [fixed] for name in FIELDS3D}
    for axis, pattern in planes.items():
        if axis not in ("x1", "x2"):
            raise BadArgument("planes", axis, "must be x1 or x2, the axis across the plane")
        for name in PLANES[int(axis[1]) - 1]:
            found[name].append(pattern)
    return {name: "|".join(patterns) for name, patterns in found.items()}


def _ascending(name, values):
    """The coordinates as an array; BadArgument unless they are finite and ascend."""
    x = require_numbers(**{name: values})
    if len(x) < 2 or not np.all(np.diff(x) > 0):
        raise BadArgument(name, values, "must be an ascending array of at least two coordinates")
    return x
