"""Rectangular blocks of hexahedra."""

import math
from typing import Any

import numpy as np
from ngsolve.meshes import MakeStructured3DMesh
from numpy.typing import ArrayLike

from ..errors import require, require_choice, require_numbers, require_positive
from ..model.types import Array
from .body_spaces import FIELDS3D
from .meshes import named, stretched


def graded(reach: float, step: float, far: float, growth: float = 1.5) -> Array:
    """Returns coordinates from 0 to `far`: equal steps up to `reach`, then each longer than the one before.

    Parameters
    ----------
    reach, step, far : float
        Lengths; the steps are at most `step` long.
    growth : float
        Largest ratio of a step to the one before.

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
    require(far >= reach, "far", far, f"must be at least reach = {reach}")
    require(growth >= 1, "growth", growth, "must be at least 1")
    count = max(1, math.ceil(reach / step - 1e-9))  # of a step, by which it may miss a whole number
    inner = np.linspace(0.0, reach, count + 1)
    if far == reach:
        return inner
    steps = [reach / count * growth]
    while sum(steps) < (far - reach) * (1 - 1e-9):
        steps.append(steps[-1] * growth)
    return stretched(inner, far, steps)


def block(x1: ArrayLike, x2: ArrayLike, x3: ArrayLike, reach: float = math.inf) -> Any:
    """Returns a rectangular block of hexahedra with vertices at given coordinates.

    Boundaries are "left" and "right" across x1, "front" and "back" across x2, "bottom", and on top "contact",
    where facets have their middle in the square of contact about the origin, else "top".

    Parameters
    ----------
    x1, x2, x3 : arrays, ascending
        Coordinates (lengths).
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
    across, along = (np.abs(x[1:] + x[:-1]) / 2 < reach for x in axes[:2])
    require(across.any() and along.any(), "reach", reach, "must hold the middle of a facet at least")
    nx, ny, nz = (len(x) - 1 for x in axes)

    def corner(*shares: float) -> list[float]:
        return [x[round(share * (len(x) - 1))] for x, share in zip(axes, shares)]

    mesh = MakeStructured3DMesh(nx=nx, ny=ny, nz=nz, mapping=corner)
    pressed = np.logical_and.outer(across, along).ravel()
    top = mesh.ngmesh.Elements2D().NumPy()[-pressed.size :]  # from the last coordinates to the first
    top["index"][pressed[::-1]] = mesh.ngmesh.AddRegion("contact", dim=2)
    return named(mesh, "left", "front", "right", "back", "bottom", "top")


def supports(fixed: str = "bottom", **planes: str) -> dict[str, str]:
    """Returns what a body constrains on its fixed boundaries and on its planes of symmetry.

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
    odd = {"x1": ("u1", "psi2", "psi3"), "x2": ("u2", "psi1", "psi3")}  # 0 on a plane across the axis
    patterns = dict.fromkeys(FIELDS3D, fixed)
    for axis, plane in planes.items():
        require_choice(tuple(odd), planes=axis)
        for name in odd[axis]:
            patterns[name] += f"|{plane}"
    return patterns


def _ascending(name: str, values: ArrayLike) -> Array:
    """Returns coordinates as an array (n,); raises BadArgument unless they are finite and ascend."""
    x = require_numbers(**{name: values})
    ascend = len(x) > 1 and np.all(np.diff(x) > 0)
    require(ascend, name, values, "must be an ascending array of at least two coordinates")
    return x + 0.0  # no -0.0
