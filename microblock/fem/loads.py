"""Dead loads of a body on a mesh."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import ngsolve as ng
import numpy as np

from ..errors import require, require_finite
from ..model.types import Array
from .body_spaces import BodySpaces


def require_finite_within(**arguments: Any) -> None:
    """Raises BadArgument for a value, or one in sequences and mappings, that is neither a finite number nor a
    CoefficientFunction.
    """
    for name, value in arguments.items():
        if isinstance(value, Mapping):
            value = list(value.values())
        if isinstance(value, (tuple, list, np.ndarray)):
            for entry in value:
                require_finite_within(**{name: entry})
        elif not isinstance(value, ng.CoefficientFunction):
            require_finite(**{name: value})


@dataclass(frozen=True)
class Loads:
    """Dead loads of (8): numbers or CoefficientFunctions, in three dimensions three.

    Parameters
    ----------
    force : body force (f1, f2) (force per volume)
    couple : body couple l, counterclockwise (moment per volume)
    traction : {boundary: (t1, t2)} (force per area)
    micromoment : {boundary: M} (moment per area)

    Examples
    --------
    >>> from microblock.fem.body import Loads
    >>> loads = Loads(force=(0, -1), micromoment={"contact": 0.1})
    >>> loads.couple, dict(loads.traction)
    (0, {})
    """

    force: Any = (0, 0)
    couple: Any = 0
    traction: Mapping[str, Any] = field(default_factory=dict)
    micromoment: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        require_finite_within(**vars(self))

    def acting_on(self, body: BodySpaces) -> Array:
        """Returns the forces in all unknowns of a body, array (unknowns,): what works on their variations in
        (8).
        """
        order = {"bonus_intorder": body.order + 4}
        u, psi = body.vectors(body.space.TestFunction())
        works = [("force", self.force, u, None), ("couple", self.couple, psi, None)]
        for name, values, varied in (("traction", self.traction, u), ("micromoment", self.micromoment, psi)):
            for boundary, value in values.items():
                works.append((name, value, varied, body.boundary(boundary)))
        form = ng.LinearForm(body.space)
        for name, value, varied, region in works:
            load = _vector(name, value, body.mesh.dim)
            if load is not None:
                words = "turns nothing: the body has no psi, as its solid is classical"
                require(body.rotates or varied is u, name, value, words)
                if varied is psi:
                    body.require_psi(name, value, region)
                measure = ng.dx(**order) if region is None else ng.ds(definedon=region, **order)
                form += ng.InnerProduct(ng.CF(load), varied) * measure
        return form.Assemble().vec.FV().NumPy().copy()


def _vector(name: str, value: Any, dim: int) -> tuple[Any, ...] | None:
    """Returns the three components of a load; None of one that is 0."""
    components = tuple(value) if np.iterable(value) else (value,)
    if all(isinstance(component, (int, float)) and component == 0 for component in components):
        return None
    count = 3
    if dim < 3:
        count = 1 if name in ("couple", "micromoment") else 2
    require(
        len(components) == count,
        name,
        value,
        f"must have {count} component{'s' * (count > 1)} on a body in {dim}D",
    )
    return (0, 0, *components) if count == 1 else (*components, 0)[:3]
