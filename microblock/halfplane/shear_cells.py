"""Averaged compliances with shear between cells of any width (docs/theory/friction.md)."""

from dataclasses import replace

import numpy as np

from ..contact_solvers.event_driven import FrictionalContact
from ..errors import BadArgument
from ..threads import bounded
from .averages import averaged
from .kernels import ODD_KERNELS


@bounded
def averages(solid, edges, which):
    """Kernels averaged over cell i and over cell j: array (len(which), n, n) of lengths per force.

    Parameters
    ----------
    edges : array (n, 2), of the cells (lengths)
    which : sequence of int, as in `LineKernels`
    """
    middle, width = edges.mean(axis=1), np.ptp(edges, axis=1)
    found = averaged(solid, middle[:, None] - middle, width, width[:, None], which)
    for number, matrix in zip(which, found):  # rounding apart they are
        matrix[...] = (matrix - matrix.T) / 2 if number in ODD_KERNELS else (matrix + matrix.T) / 2
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
    if len(law.corners) == 1:
        U, Y = averages(solid, edges, (3, 7) if law.clamps_rotation else (0, 5))
        normal, cross, tangential = U, -Y, U
    else:
        U, V, W, Y, even = averages(solid, edges, (0, 1, 2, 5, 6))
        levers = 1, -1
        if not np.allclose(problem.levers(edges.mean(axis=1)).T, levers):
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
    count, shifted = len(problem.shifts), [edges - shift for shift in problem.shifts]
    normal, cross = averages(problem.counter, np.concatenate(shifted), (0, 5))
    return replace(
        contact,
        normal=contact.normal + normal,
        cross=np.tile(contact.cross, (count, 1)) + cross,
        tangential=np.tile(contact.tangential, (count, count)) + normal,
    )


def surface(problem, edges, raised, moment):
    """(displacement, psi, micromoment or reaction) of a Moment, averaged over cells: arrays (n,); `raised`
    is the displacement of the corners, array (corners n,).
    """
    solid, law, forces = problem.solid, problem.law, moment.normal.reshape(-1, len(edges))
    half, none = solid.ell / 2, np.zeros(len(edges))
    if len(law.corners) > 1:
        A, B = raised.reshape(2, -1)
        moments = (forces[0] - forces[1] - moment.tangential) / (edges[:, 1] - edges[:, 0])
        return (A + B) / 2, (A - B) / 2 / half, half * moments
    odd, even = averages(solid, edges, (4, 8) if law.clamps_rotation else (1, 6))
    turned = odd @ forces[0] - even @ moment.tangential
    if law.clamps_rotation:
        return raised, none, -turned * solid.mu / (1 - solid.nu) / 2
    return raised, turned / half, none
