"""The solids of a body by the materials of its mesh: which is where, admissible moduli, and the surface's."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import ngsolve as ng
import numpy as np

from ..errors import BadArgument, require, require_kind
from ..model.material import Cosserat, Elastic, Moduli
from ..model.types import Array, Flags
from .meshes import corner_rules, elements_at, interior_rules

SIDE_ROUNDING = 1e-9  # of ell, a difference that is the rounding of a function


def named_region(select: Any, names: Iterable[str], pattern: Any, argument: str, kind: str) -> Any:
    """Returns the region that `select`, a mesh's Boundaries or Materials, gives to a pattern of these names;
    raises BadArgument, of this argument, for no name.
    """
    names = sorted(set(names))
    require(isinstance(pattern, str), argument, pattern, f"must be a name or pattern of {', '.join(names)}")
    try:
        region = select(pattern)
    except RuntimeError as failure:
        raise BadArgument(argument, pattern, f"is no regular expression: {failure}") from failure
    missing = [name for name in pattern.split("|") if name.isidentifier() and name not in names]
    if missing or not any(region.Mask()):
        which = "" if missing in ([], [pattern]) else f"{', '.join(missing)} "
        raise BadArgument(argument, pattern, f"{which}is none of the mesh's {kind}, {', '.join(names)}")
    return region


def solids_of(mesh: Any, solid: Any) -> list[Cosserat]:
    """Returns the solid of each material of a mesh, from one of all or {pattern of materials: solid}; raises
    BadArgument unless each material is named once.
    """
    materials = mesh.GetMaterials()
    if not isinstance(solid, Mapping):
        require_kind(Cosserat, "a Cosserat, or {material of the mesh: Cosserat}", solid=solid)
        return [solid] * len(materials)
    chosen: list[list[Cosserat]] = [[] for _ in materials]
    for pattern, part in solid.items():
        require(isinstance(part, Cosserat), "solid", part, f"must be a Cosserat for {pattern}")
        mask = named_region(mesh.Materials, materials, pattern, "solid", "materials").Mask()
        for number in np.flatnonzero(mask):
            chosen[number].append(part)
    words = "must name each material of the mesh once"
    for wrong, count in (("missing", 0), ("named twice", 2)):
        names = {name for name, solids in zip(materials, chosen) if min(len(solids), 2) == count}
        if names:
            words += f"; {wrong}: {', '.join(sorted(names))}"
    require(all(len(solids) == 1 for solids in chosen), "solid", solid, words)
    return [solids[0] for solids in chosen]


def has_one_solid(solids: Sequence[Cosserat]) -> bool:
    """Returns whether all materials have one solid, of numbers."""
    return not solids[0].functions and all(solid is solids[0] for solid in solids)


def moduli_of(solids: Sequence[Cosserat]) -> Moduli:
    """Returns the Moduli of a body: numbers of one solid, else functions."""
    if has_one_solid(solids):
        return Moduli(*(getattr(solids[0], name) for name in Moduli._fields))
    return Moduli(*(ng.CF([getattr(solid, name) for solid in solids]) for name in Moduli._fields))


def alike(solids: Sequence[Cosserat]) -> list[tuple[Cosserat, Flags]]:
    """Returns solids with the materials that have them, boolean arrays (materials,); with functions each
    material is by itself.
    """
    keys = [(solid, number if solid.functions else None) for number, solid in enumerate(solids)]
    return [(key[0], np.array([key == candidate for candidate in keys])) for key in dict.fromkeys(keys)]


def region(mesh: Any, materials: Flags) -> Any:
    """Returns the region of materials, boolean array (materials,)."""
    return ng.Region(mesh, ng.VOL, ng.BitArray(materials.tolist()))


def require_admissible(mesh: Any, solids: Sequence[Cosserat], order: int) -> None:
    """Raises BadArgument where functions violate (13) at the points of a rule of this order."""
    rules = interior_rules(order)
    for solid, materials in alike(solids):
        if not solid.functions:
            continue
        values = _evaluated(mesh, solid, mesh.MapToAllElements(rules, region(mesh, materials)))
        functions = values[: len(solid.functions)]
        summed = [name in ("alpha_prime", "beta_prime", "curvature") for name in solid.functions]
        bounded = np.vstack((functions, -functions, functions[summed].sum(axis=0)))
        for number in bounded.argmin(axis=1):  # (13) has bounds of each, and of a sum: extremes decide
            _solid_at(solid, values[:, number])


def surface_solid(mesh: Any, solids: Sequence[Cosserat], contact: str) -> Cosserat:
    """Returns the stiffest solid at the vertices of a contact boundary, without one of the body, with numbers
    for functions; an Elastic where a part is. Raises BadArgument where blocks differ in their side.
    """
    if has_one_solid(solids):
        return solids[0]
    boundary = mesh.Boundaries(contact)
    facets = list(boundary.Elements())
    below = elements_at(mesh, boundary)
    touched = {(number, vertex.nr) for number, facet in zip(below, facets) for vertex in facet.vertices}
    rules = corner_rules()
    candidates: list[Cosserat] = []
    for solid, materials in alike(solids):
        part = region(mesh, materials)
        rows = [
            not facets or (element.nr, vertex.nr) in touched
            for element in part.Elements()
            for vertex in element.vertices[: len(rules[element.type])]
        ]
        if not solid.functions and any(rows):
            candidates.append(solid)
        elif any(rows):
            places = _evaluated(mesh, solid, mesh.MapToAllElements(rules, part))[:, rows]
            candidates += [_solid_at(solid, place) for place in places.T]
    stiffest = max(candidates, key=lambda solid: solid.E_star)
    if any(isinstance(solid, Elastic) for solid in candidates):
        return stiffest if isinstance(stiffest, Elastic) else Elastic(stiffest.E, stiffest.nu)
    sides = [solid.ell for solid in candidates]
    words = f"must be one number on the boundary {contact}, the side of its blocks"
    require(not facets or np.ptp(sides) <= SIDE_ROUNDING * max(sides), "ell", (min(sides), max(sides)), words)
    return stiffest


def _evaluated(mesh: Any, solid: Cosserat, points: Any) -> Array:
    """Returns the functions of a solid, and below them the coordinates, at points: array (functions + dim,
    points).
    """
    functions: dict[str, Any] = dict(solid.functions)
    for name, function in functions.items():
        words = "must be a real function with one component"
        require(not function.is_complex and function.dim == 1, name, function, words)
    coordinates = (ng.x, ng.y, ng.z)[: mesh.dim]
    return np.asarray(ng.CF((*functions.values(), *coordinates))(points)).T


def _solid_at(solid: Cosserat, values: Array) -> Cosserat:
    """Returns the solid with numbers, from the values of its functions and the coordinates of a place, array
    (functions + dim,).
    """
    count = len(solid.functions)
    try:
        return solid.at(**dict(zip(solid.functions, values.tolist())))
    except BadArgument as failure:
        place = ", ".join(f"{x:.4g}" for x in values[count:])
        words = f"{failure.allowed}; it is so at ({place})"
        raise type(failure)(failure.name, failure.value, words) from failure
