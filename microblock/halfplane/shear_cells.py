"""Averaged compliances with shear between cells of any width (docs/theory/friction.md)."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ..contact_solvers.frictional_contact import FrictionalContact, FrictionState
from ..errors import BadArgument
from ..model.material import Cosserat
from ..model.problem import Problem
from ..model.types import Array
from ..threads import bounded
from .averages import averaged
from .kernels import ODD_KERNELS


@bounded
def averages(solid: Cosserat, edges: Array, which: Sequence[int]) -> Array:
    """Returns kernels averaged over cell i and over cell j: array (len(which), n, n) of lengths per force.

    Parameters
    ----------
    edges : array (n, 2), of the cells (lengths)
    which : sequence of int, as in `LineKernels`
    """
    middle = edges.mean(axis=1)
    width = np.ptp(edges, axis=1)
    matrices = averaged(solid, middle[:, None] - middle, width, width[:, None], which)
    for number, matrix in zip(which, matrices):  # rounding apart they are
        sign = -1 if number in ODD_KERNELS else 1
        matrix[...] = (matrix + sign * matrix.T) / 2
    return matrices


def frictional_contact(
    problem: Problem, edges: Array, gaps: Array, coupled: bool = True
) -> FrictionalContact:
    """Returns the FrictionalContact of a half-plane and a rigid obstacle on cells.

    Parameters
    ----------
    edges : array (n, 2), of the cells (lengths)
    gaps : array (corners, n), averaged over the cells (lengths)
    coupled : whether shear acts on gaps

    Raises
    ------
    BadArgument
        If nothing holds the rotation.
    """
    law: Any = problem.law  # with friction
    if len(law.corners) == 1:
        normal, Y = averages(problem.solid, edges, (3, 7) if law.clamps_rotation else (0, 5))
        cross = -Y
        tangential = normal
    else:
        U, V, W, Y, even = averages(problem.solid, edges, (0, 1, 2, 5, 6))
        levers = 1, -1
        if not np.allclose(problem.levers(edges.mean(axis=1)).T, levers):
            words = "must have the levers 1 and -1 with friction on a half-plane: a Body on a mesh takes any"
            raise BadArgument("law", law, words)
        normal = np.block([[U + a * b * W + (a - b) * V for b in levers] for a in levers])
        cross = np.hstack([-(Y + V) - b * (even + W) for b in levers])
        tangential = U + 2 * even + W
    stretch = edges.mean(axis=1) / problem.solid.E_star
    return FrictionalContact(
        normal, cross, tangential, np.ravel(gaps), law.friction, coupled, stretch=stretch
    )


def with_second_body(contact: FrictionalContact, problem: Problem, edges: Array) -> FrictionalContact:
    """Returns a FrictionalContact with the second body, if any, and tangential forces of each corner."""
    if problem.counter is None:
        return contact
    count = len(problem.shifts)
    below = np.concatenate([edges - shift for shift in problem.shifts])
    normal, cross = averages(problem.counter, below, (0, 5))
    return replace(
        contact,
        normal=contact.normal + normal,
        cross=np.tile(contact.cross, (count, 1)) + cross,
        tangential=np.tile(contact.tangential, (count, count)) + normal,
        stretch=np.tile(contact.stretch, count),
    )


def surface(
    problem: Problem, edges: Array, gap_changes: Array, forces: FrictionState
) -> tuple[Array, Array, Array]:
    """Returns (displacement, psi, micromoment or reaction) averaged over cells, arrays (n,), from forces and
    the displacement of the corners, `gap_changes`, array (corners n,).
    """
    solid = problem.solid
    normal = forces.normal.reshape(-1, len(edges))
    half = solid.ell / 2
    zero = np.zeros(len(edges))
    if len(normal) > 1:
        A, B = gap_changes.reshape(2, -1)
        moments = (normal[0] - normal[1] - forces.tangential) / np.ptp(edges, axis=1)
        return (A + B) / 2, (A - B) / 2 / half, half * moments
    clamps = problem.law.clamps_rotation
    odd, even = averages(solid, edges, (4, 8) if clamps else (1, 6))
    rotated = odd @ normal[0] - even @ forces.tangential
    if clamps:
        return gap_changes, zero, -rotated * solid.mu / (1 - solid.nu) / 2
    return gap_changes, rotated / half, zero
