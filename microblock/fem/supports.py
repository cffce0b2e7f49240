"""Supports of a body: where its fields are fixed or prescribed."""

from collections.abc import Mapping

import ngsolve as ng
import numpy as np

from ..errors import require


def patterns(body, fixed):
    """{field: pattern of all boundaries where a body holds it}, also of a psi that it does not have."""
    known = isinstance(fixed, (str, Mapping)) or (isinstance(fixed, tuple) and not fixed)
    require(known, "fixed", fixed, 'must be boundaries, "left|bottom", or {field: boundaries}')
    given = dict.fromkeys(body.all_names, fixed) if isinstance(fixed, str) else dict(fixed)
    found = {name: [pattern] for name, pattern in given.items()}
    for name, values in body.prescribed.items():
        found.setdefault(name, []).extend(values)
    for name, named in found.items():
        names = body.names if name in body.prescribed else body.all_names
        require(name in names, "field", name, f"fields are {', '.join(names)}")
        for pattern in named:
            body.boundary(pattern, "prescribed" if pattern in body.prescribed.get(name, ()) else "fixed")
    return {name: "|".join(named) for name, named in found.items()}


def held_on(body, boundary):
    """The fields that are fixed or prescribed on a part of a boundary at least."""
    mask = body.boundary(boundary).Mask()
    return [name for name, pattern in body.fixed.items() if any(body.boundary(pattern).Mask() & mask)]


def pressed(body):
    """The region of the contact boundary; in the plane BadArgument where u2 is held there."""
    region = body.boundary(body.contact, "contact")
    words = (
        f"is constrained in u2 by the supports on {body.fixed.get('u2')}: "
        "an obstacle cannot press what cannot move; constrain other boundaries, or psi alone"
    )
    held = not body.in_space and "u2" in held_on(body, body.contact)
    require(not held, "boundary", body.contact, words)
    return region


def require_held(body):
    """BadArgument where a displacement is held nowhere."""
    for name in body.names:
        words = f"must hold the body: {name} is not fixed on any boundary, and nothing else stops it"
        require(name in body.fixed or not name.startswith("u"), "fixed", body.fixed, words)


def require_periodic(body):
    """BadArgument for several values or functions on a periodic body: they may differ at points that the mesh
    identifies.
    """
    for own in (dict(values).values() for values in body.prescribed.values() if body.periodic):
        functions = any(isinstance(value, ng.CoefficientFunction) for value in own)
        words = "must be one number for each field on a periodic body, whose mesh identifies points"
        require(len(set(own)) < 2 and not functions, "prescribed", body.prescribed, words)


def prescribe(body, components):
    """Set the prescribed values in the grid functions of the fields."""
    for name, values in body.prescribed.items():
        region = body.boundary("|".join(values))
        _set_on(body, region, components[body.names.index(name)], body.mesh.BoundaryCF(dict(values)))


def values_on(body, region, name, value):
    """Coefficients of a function on a region of the boundary, 0 elsewhere."""
    function = ng.GridFunction(body.spaces[body.names.index(name)])
    _set_on(body, region, function, value)
    return function.vec.FV().NumPy().copy()


def _set_on(body, region, component, value):
    """Set a component on a region of the boundary. Where elements are as wide as the period NGSolve counts an
    unknown twice: what 1 becomes is its share.
    """
    component.Set(value, definedon=region)
    if body.periodic:
        share = ng.GridFunction(component.space)
        share.Set(1, definedon=region)
        shares = share.vec.FV().NumPy()
        ends = np.abs(shares) > 0.25  # not the rounding of an edge's unknowns
        component.vec.FV().NumPy()[ends] /= shares[ends]
