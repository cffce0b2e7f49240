"""Supports of a body: where its fields are fixed or prescribed."""

from collections.abc import Mapping, Sequence
from typing import Any

import ngsolve as ng
import numpy as np
from scipy.linalg import null_space

from ..errors import require
from ..model.types import Array
from .body_spaces import COMPONENTS, FIELDS3D, BodySpaces
from .facet_rules import ROUNDED
from .mesh_surface import SymmetryPlane

# fields that are 0 on a plane of symmetry across x1, and x2
ODD_FIELDS = (("u1", "psi", "psi2", "psi3"), ("u2", "psi1", "psi3"))


def patterns(body: BodySpaces, fixed: Any) -> dict[str, str]:
    """Returns {field: pattern of all boundaries where a body holds it}, also of a psi that it does not
    have.
    """
    named = isinstance(fixed, (str, Mapping)) or (isinstance(fixed, tuple) and not fixed)
    require(named, "fixed", fixed, 'must be boundaries, "left|bottom", or {field: boundaries}')
    if isinstance(fixed, str):
        fixed = dict.fromkeys(body.all_names, fixed)
    held = {name: [pattern] for name, pattern in dict(fixed).items()}
    for name, values in body.prescribed.items():
        held.setdefault(name, []).extend(values)
    for name, boundaries in held.items():
        names = body.names if name in body.prescribed else body.all_names
        require(name in names, "field", name, f"fields are {', '.join(names)}")
        for pattern in boundaries:
            body.boundary(pattern, "prescribed" if pattern in body.prescribed.get(name, ()) else "fixed")
    for name, values in body.prescribed.items():
        for pattern, value in values.items():
            if name.startswith("psi") and not (isinstance(value, (int, float)) and value == 0):
                body.require_psi("prescribed", value, body.boundary(pattern))
    return {name: "|".join(boundaries) for name, boundaries in held.items()}


def held_on(body: BodySpaces, boundary: str) -> list[str]:
    """Returns the fields that are fixed or prescribed on a part of a boundary at least."""
    mask = body.boundary(boundary).Mask()
    return [name for name, pattern in body.fixed.items() if any(body.boundary(pattern).Mask() & mask)]


def pressed(body: BodySpaces) -> Any:
    """Returns the region of the contact boundary; in the plane raises BadArgument where u2 is held there."""
    region = body.boundary(body.contact, "contact")
    words = (
        f"is constrained in u2 by the supports on {body.fixed.get('u2')}: "
        "an obstacle cannot press what cannot move; constrain other boundaries, or psi alone"
    )
    held = not body.in_space and "u2" in held_on(body, body.contact)
    require(not held, "boundary", body.contact, words)
    return region


def require_held(body: BodySpaces) -> None:
    """Raises BadArgument where a displacement is held nowhere."""
    for name in body.names:
        words = f"must hold the body: {name} is not fixed on any boundary, and nothing else stops it"
        require(name in body.fixed or not name.startswith("u"), "fixed", body.fixed, words)


def free_motions(body: BodySpaces, points: Array, normals: Array) -> list[str]:
    """Returns the rigid motions, "a rotation about x3", that no support stops and that change no gap along
    normals at points, arrays (n, dim): where forces have no part along them, displacements hold up to these.
    """
    vertices = np.array([vertex.point for vertex in body.mesh.vertices])
    if body.mesh.dim == 1:  # the only coordinate is x2
        vertices = np.pad(vertices, ((0, 0), (1, 0)))
    middle = vertices.mean(axis=0)
    size = np.abs(vertices - middle).max()
    rows = [_motions((points - middle) / size, normals)]
    for name in body.fixed:
        facets = body.boundary(body.fixed[name]).Elements()
        held = sorted({vertex.nr for facet in facets for vertex in facet.vertices})
        axis = np.eye(len(FIELDS3D))[COMPONENTS[name]]
        places = (vertices[held] - middle) / size
        if name.startswith("u"):
            rows.append(_motions(places, np.tile(axis[: places.shape[1]], (len(places), 1))))
        elif not body.is_classical:  # psi is the rotation of a rigid motion
            rows.append(axis[None])
    possible = [0, 1, 2, 3, 4, 5] if body.in_space else [0, 1] if body.periodic else [0, 1, 5]
    _, triangle = np.linalg.qr(np.pad(np.vstack(rows)[:, possible], ((0, len(FIELDS3D)), (0, 0))))
    free = null_space(triangle, rcond=ROUNDED)
    motions = np.zeros((len(FIELDS3D), free.shape[1]))
    motions[possible] = free
    words = []
    for motion in motions.T:
        turns = np.abs(motion[3:]).max() > ROUNDED
        kind = "rotation about" if turns else "translation along"
        words.append(f"a {kind} x{1 + np.argmax(np.abs(motion[3:] if turns else motion[:3]))}")
    return sorted(set(words))


def _motions(places: Array, directions: Array) -> Array:
    """Returns displacements along directions of translations and rotations along and about the axes, at
    places, arrays (k, dim): array (k, 6).
    """
    pad = ((0, 0), (0, 3 - places.shape[1]))
    along = np.pad(directions, pad)
    return np.hstack((along, np.cross(np.pad(places, pad), along)))


def require_periodic(body: BodySpaces) -> None:
    """Raises BadArgument for several values or functions on a periodic body: they may differ at points that
    the mesh identifies.
    """
    if not body.periodic:
        return
    for values in body.prescribed.values():
        numbers = set(dict(values).values())
        functions = any(isinstance(value, ng.CoefficientFunction) for value in numbers)
        words = "must be one number for each field on a periodic body, whose mesh identifies points"
        require(len(numbers) < 2 and not functions, "prescribed", body.prescribed, words)


def planes_of_symmetry(body: BodySpaces, region: Any) -> list[SymmetryPlane]:
    """Returns the planes across x1, and in space x2, at which a boundary ends and supports hold what is odd
    there, and nothing else.
    """
    vertices = body.mesh.ngmesh.Coordinates()

    def along(part: Any, axis: int) -> Array:
        return vertices[[vertex.nr for facet in part.Elements() for vertex in facet.vertices], axis]

    planes = []
    for axis, odd in enumerate(ODD_FIELDS[: body.mesh.dim - 1]):
        names = [name for name in body.names if name in odd]
        for boundary in sorted(set(body.mesh.GetBoundaries())):
            if sorted(held_on(body, boundary)) != sorted(names):
                continue
            places = along(body.boundary(boundary), axis)
            ends = along(region, axis)
            rounding = 1e-9 * np.ptp(vertices)
            for place, side in ((ends.min(), 1), (ends.max(), -1)):
                if np.abs(places - place).max() <= rounding:
                    planes.append(SymmetryPlane(axis, float(place), side))
    return planes


def prescribe(body: BodySpaces, components: Sequence[Any]) -> None:
    """Sets the prescribed values in the grid functions of the fields."""
    for name, values in body.prescribed.items():
        region = body.boundary("|".join(values))
        _set_on(body, region, components[body.names.index(name)], body.mesh.BoundaryCF(dict(values)))


def values_on(body: BodySpaces, region: Any, name: str, value: Any) -> Array:
    """Returns coefficients of a function on a region of the boundary, 0 elsewhere: array (unknowns of the
    field,).
    """
    function = ng.GridFunction(body.spaces[body.names.index(name)])
    _set_on(body, region, function, value)
    return function.vec.FV().NumPy().copy()


def _set_on(body: BodySpaces, region: Any, component: Any, value: Any) -> None:
    """Sets a component on a region of the boundary. Where elements are as wide as the period NGSolve counts
    an unknown twice: what 1 becomes is its share.
    """
    component.Set(value, definedon=region)
    if body.periodic:
        share = ng.GridFunction(component.space)
        share.Set(1, definedon=region)
        shares = share.vec.FV().NumPy()
        ends = np.abs(shares) > 0.25  # not the rounding of an edge's unknowns
        component.vec.FV().NumPy()[ends] /= shares[ends]
