"""Averaged compliances with shear between cells of any width (docs/theory/friction.md)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..corners.follower import FrictionalContact
from ..errors import BadArgument
from ..threads import bounded
from .averages import averaged
from .kernels import ODD, kernels


@bounded
def averages(solid, edges, which, shift=0.0):
    """Kernels averaged over cell i and over cell j, moved right by `shift` (length): array
    (len(which), n, n) of lengths per force.

    Parameters
    ----------
    edges : array (n, 2), of the cells (lengths)
    which : sequence of int, as in `Kernels`
    """
    middle, width = edges.mean(axis=1), np.ptp(edges, axis=1)
    found = averaged(solid, middle[:, None] - middle + shift, width, width[:, None], which)
    if not shift:
        for number, matrix in zip(which, found):  # rounding apart they are
            matrix[...] = (matrix - matrix.T) / 2 if number in ODD else (matrix + matrix.T) / 2
    return found


def frictional_contact(problem, edges, gaps, coupled=True):
    """The FrictionalContact of a half-plane and a rigid obstacle on cells.

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
    solid, law = problem.solid, problem.law
    kernels(solid.nu, solid.beta, solid.curvature)  # which refuse a solid whose rotation nothing holds
    if len(law.corners) == 1:
        U, Y = averages(solid, edges, (3, 7) if law.clamps_rotation else (0, 5))
        normal, cross, tangential = U, -Y, U
    else:
        U, V, W, Y, even = averages(solid, edges, (0, 1, 2, 5, 6))
        levers = 1, -1
        if not np.allclose(np.column_stack(list(law.levers(edges.mean(axis=1)).values())), levers):
            words = "must have the levers 1 and -1 with friction on a half-plane: a Body on a mesh takes any"
            raise BadArgument("law", law, words)
        normal = np.block([[U + a * b * W + (a - b) * V for b in levers] for a in levers])
        cross = np.hstack([-(Y + V) - b * (even + W) for b in levers])
        tangential = U + 2 * even + W
    return FrictionalContact(normal, cross, tangential, np.ravel(gaps), law.friction, coupled)


def with_counter(contact, problem, edges):
    """A FrictionalContact with the second body, if any, and tangential forces of each corner."""
    if problem.counter is None:
        return contact
    shifts = problem.shifts
    blocks = [[averages(problem.counter, edges, (0, 5), b - a) for b in shifts] for a in shifts]
    normal, cross = (np.block([[pair[i] for pair in row] for row in blocks]) for i in (0, 1))
    normal, count = (normal + normal.T) / 2, len(shifts)
    return replace(
        contact,
        normal=contact.normal + normal,
        cross=np.tile(contact.cross, (count, 1)) + cross,
        tangential=np.tile(contact.tangential, (count, count)) + normal,
    )


def surface(problem, edges, own, moment):
    """(displacement, psi, micromoment or reaction) of a Moment, averaged over cells: arrays (n,); `own` is
    without the second body.
    """
    solid, law = problem.solid, problem.law
    raised = own.normal @ moment.normal + own.cross.T @ moment.tangential
    width, half = edges[:, 1] - edges[:, 0], solid.ell / 2
    forces = moment.normal.reshape(-1, len(edges))
    if law.clamps_rotation:
        odd, even = averages(solid, edges, (4, 8)) * solid.mu / (1 - solid.nu) / solid.ell
        return raised, np.zeros(len(edges)), half * (even @ moment.tangential - odd @ forces[0])
    if len(law.corners) == 1:
        V, even = averages(solid, edges, (1, 6))
        return raised, (V @ forces[0] - even @ moment.tangential) / half, np.zeros(len(edges))
    A, B = raised.reshape(2, -1)
    return (A + B) / 2, (A - B) / 2 / half, half * (forces[0] - forces[1] - moment.tangential) / width
