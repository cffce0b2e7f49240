"""Fields of a body on a mesh at the points of a picture."""

import ngsolve as ng
import numpy as np

from ..model.fields import halves
from ..model.types import Array, Integers, Interval
from .body_fields import BodyFields
from .facet_rules import rule_at


def below(
    fields: BodyFields, box: tuple[Interval, float], cut: int = 4
) -> tuple[Array, Array, Integers, Array, Array]:
    """Returns x1 and x2, (n,), triangles, (m, 3), psi, (n,), and stress, (2, 2, n), in elements within the
    box, ((left, right), depth), sides cut in `cut`; in mirrored ones psi and shear stresses have the other
    sign.
    """
    mesh = fields.body.mesh
    (left, right), depth = box
    ticks = np.linspace(0, 1, cut + 1)
    s, t = np.meshgrid(ticks, ticks)
    squares = {ng.ET.QUAD: (s, t), ng.ET.TRIG: (s, t * (1 - s))}  # one side of which is a vertex
    rules = {kind: rule_at(np.reshape(places, (2, -1)).T) for kind, places in squares.items()}
    values = ng.CF((ng.x, ng.y, fields.psi, fields.stress))(mesh.MapToAllElements(rules, ng.VOL)).T
    first = s.size * np.arange(mesh.ne)[:, None, None]
    triangles = (first + halves(np.arange(s.size).reshape(s.shape))).reshape(-1, 3)
    if fields.mirrored:
        triangles = np.concatenate((triangles, triangles + values.shape[1]))
        values = np.hstack((values, np.array([[-1, 1, -1, 1, -1, -1, 1]]).T * values))
    across, up = values[:2, triangles]  # of large ones the box may hold no corner
    reach = (across.max(axis=1) >= left) & (across.min(axis=1) <= right) & (up.max(axis=1) >= -depth)
    used, triangles = np.unique(triangles[reach], return_inverse=True)
    x1, x2, psi, *stress = values[:, used]
    return x1, x2, triangles.reshape(-1, 3), psi, np.reshape(stress, (2, 2, -1))
