"""The fields of a solution on a mesh, and the reactions of its supports."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

import ngsolve as ng
import numpy as np
from numpy.typing import ArrayLike

from ..errors import BadArgument, require
from ..model.fields import PointFields, SpaceFields
from ..model.fields import points as at_points
from ..model.types import Array, Integers
from . import contact_term, supports
from .body_spaces import COMPONENTS, BodySpaces

# of u1, u2, psi, s11, s12, s21, s22, m1, m2, s33: which have the other sign at -x1 of a symmetric state
ODD_FIELDS = np.array([1, 0, 1, 0, 1, 1, 0, 0, 1, 0], bool)


def point_fields(x1: Array, x2: Array, *values: Array) -> PointFields:
    """Returns the PointFields of values in the order of ODD_FIELDS."""
    u1, u2, psi, s11, s12, s21, s22, m1, m2, s33 = values
    stress = np.array(((s11, s12), (s21, s22)))
    return PointFields(x1, x2, psi, np.array((u1, u2)), stress, np.array((m1, m2)), s33)


class Reaction(NamedTuple):
    """Force (f1, f2) and moment about the origin, counterclockwise, that supports exert on a body per
    thickness (in 1D per area); in three dimensions arrays (3,).
    """

    force: Array
    moment: float | Array


class BodyFields:
    """The fields of a state, as NGSolve functions: u1, u2, psi; in three dimensions u1, u2, u3, psi1,
    psi2, psi3 and the vectors u and psi.

    On a boundary stresses are those of the element beside it; `reaction` balances the loads to rounding, and
    their moments where the mesh is curved to no higher order than u: on others rotations are not among the
    displacements.

    Parameters
    ----------
    body : Body
    components : grid functions of the fields
    forces : array (unknowns,), what supports exert
    mirrored : whether they are the half x1 > 0 of a symmetric state
    second : BodyFields of a second body, or None

    Examples
    --------
    >>> from microblock.fem import meshes
    >>> from microblock.fem.body import Loads
    >>> body = mb.Body(meshes.column(depth=1.0, elements=2),
    ...                mb.Cosserat(E=2.6, nu=0.3, ell=0.2, beta=1), order=4,
    ...                fixed={"u1": "middle", "u2": "middle"}, periodic=True)
    >>> fields = body.solve(Loads(traction={"contact": (0, -1)}))
    >>> import ngsolve as ng
    >>> round(ng.Integrate(fields.stress[1, 1], body.mesh, definedon=body.mesh.Boundaries("middle")), 9)
    -0.5
    >>> force, moment = fields.reaction("middle")
    >>> round(float(force[1]), 9)
    0.5
    """

    resolved = 0.0
    u1: Any
    u2: Any
    u3: Any
    psi1: Any
    psi2: Any
    psi3: Any

    def __init__(
        self,
        body: BodySpaces,
        components: Iterable[Any],
        forces: Array,
        mirrored: bool = False,
        second: BodyFields | None = None,
    ) -> None:
        self.body = body
        self.components = tuple(components)[: len(body.names)]
        self.forces = forces
        self.mirrored = mirrored
        self.second = second
        self.psi = ng.CF(0)  # without it
        for name, component in zip(body.names, self.components):
            setattr(self, name, component)
        if body.in_space:
            self.u, self.psi = body.vectors(self.components)

    def __iter__(self) -> Iterator[Any]:
        return iter(self.components)

    def __reduce__(self) -> tuple[Any, ...]:
        """A copy has its values on a body made anew."""
        numbers = _dofs_by_element(self.body)
        return _remade, (self.body, self.values[numbers], self.forces[numbers], self.mirrored, self.second)

    @property
    def values(self) -> Array:
        """Values of all unknowns, array (unknowns,)."""
        return np.concatenate([component.vec.FV().NumPy() for component in self])

    def __call__(
        self, x1: ArrayLike, x2: ArrayLike, x3: ArrayLike | None = None
    ) -> PointFields | SpaceFields:
        """Returns the PointFields at points, arrays (n,) or numbers, in space, with x3, the SpaceFields;
        raises BadArgument for a point outside of the body.
        """
        dim = 3 if self.body.in_space else 2
        x, shape = at_points(x1, x2, x3, self.body.in_space)
        sign = np.where(self.mirrored & (x[0] < 0), -1.0, 1.0)
        evaluated = (self.u, self.psi, self.stress, self.couple_stress) if dim == 3 else self.plane_fields
        points = self.body.mesh(sign * x[0], *x[1:])
        outside = np.flatnonzero(points["nr"] < 0)
        if len(outside):
            point = [float(values[outside[0]]) for values in x]
            raise BadArgument("x1, x2, x3"[: 4 * dim - 2], point, "must lie in the body")
        values = ng.CF(evaluated)(points).T
        if dim == 2:
            return point_fields(*x, *np.where(ODD_FIELDS[:, None], sign, 1.0) * values).shaped(shape)
        stress, couple_stress = values[6:].reshape(2, 3, 3, -1)
        return SpaceFields(x[0], x[1], x[2], values[3:6], values[:3], stress, couple_stress).shaped(shape)

    @property
    def plane_fields(self) -> tuple[Any, ...]:
        """What `point_fields` takes, as functions."""
        return self.u1, self.u2, self.psi, self.stress, self.couple_stress, self._sigma[2, 2]

    @property
    def _sigma(self) -> Any:
        """Force stress (16), 3x3."""
        sigma = contact_term.stress(self.body.moduli, self.body.strains(self.components)[0])
        return ng.BoundaryFromVolumeCF(sigma)  # else gradients are 0 there, in silence

    @property
    def stress(self) -> Any:
        """Force stress (16), 2x2, in three dimensions 3x3."""
        sigma = self._sigma
        if self.body.in_space:
            return sigma
        return ng.CF((sigma[0, 0], sigma[0, 1], sigma[1, 0], sigma[1, 1]), dims=(2, 2))

    @property
    def couple_stress(self) -> Any:
        """Couple stress, (m1, m2), in three dimensions 3x3."""
        m = contact_term.couple_stress(self.body.moduli, self.body.strains(self.components)[1])
        return ng.BoundaryFromVolumeCF(m if self.body.in_space else ng.CF((m[2, 0], m[2, 1])))

    def reaction(self, boundary: str) -> Reaction:
        """Returns the Reaction of the supports on a boundary, from nodal forces.

        All supports together balance loads and contact. What is exerted where two boundaries meet is part of
        both: name them together, "bottom|side". In 1D and of a periodic body f2 has no arm.

        Raises
        ------
        BadArgument
            For a boundary on which nothing is supported.
        """
        body = self.body
        region = body.boundary(boundary)
        held = supports.held_on(body, boundary)
        supported = ", ".join(f"{name} on {pattern}" for name, pattern in body.fixed.items()) or "none"
        words = "is supported in no field, so that no support exerts anything there; supported are "
        require(held, "boundary", boundary, words + supported)
        motions = self._rigid_motions()
        work = np.zeros(6)
        for name in held:
            part = region * body.boundary(body.fixed[name])
            values = [supports.values_on(body, part, name, motion[COMPONENTS[name]]) for motion in motions]
            work += np.array(values) @ self.forces[body.unknowns_of(name)]
        if body.in_space:
            return Reaction(work[:3], work[3:])
        return Reaction(work[:2], float(work[5]))

    def _rigid_motions(self) -> list[Any]:
        """Returns u and psi, six components, of the three translations and rotations."""
        dim = self.body.mesh.dim
        place = [ng.x, ng.y, ng.z][:dim] + [0] * (3 - dim)
        if dim == 1:
            place = [0, ng.x, 0]
        elif self.body.periodic:  # along a period forces have no arm
            place[: dim - 1] = [0] * (dim - 1)
        axes = [ng.CF(tuple(map(float, axis))) for axis in np.eye(3)]
        motions = [ng.CF((axis, 0 * axis)) for axis in axes]
        return motions + [ng.CF((ng.Cross(axis, ng.CF(tuple(place))), axis)) for axis in axes]

    def energy(self) -> float:
        """Returns the elastic energy of the whole body (in 1D: per area)."""
        return (1 + self.mirrored) * self.body.integrated(self.body.energy(*self))


def _remade(
    body: BodySpaces, values: Array, forces: Array, mirrored: bool, second: BodyFields | None
) -> BodyFields:
    """Returns the BodyFields of values and forces, element by element."""
    state = ng.GridFunction(body.space)
    exerted = np.zeros(body.space.ndof)
    numbers = _dofs_by_element(body)
    state.vec.FV().NumPy()[numbers] = values
    exerted[numbers] = forces
    return BodyFields(body, state.components, exerted, mirrored, second)


def _dofs_by_element(body: BodySpaces) -> Integers:
    """Returns the unknowns, element by element: a copied mesh keeps the order of elements, not of edges."""
    return np.concatenate([body.space.GetDofNrs(element) for element in body.space.Elements()])
