"""Fields of a body on a mesh at the points of a picture."""

from typing import Any

import ngsolve as ng
import numpy as np

from ..model.fields import PointFields, grid_below, halves
from ..model.types import Integers, Interval
from .body_fields import ODD_FIELDS, BodyFields, point_fields
from .facet_rules import rule_at


def below(fields: BodyFields, box: tuple[Interval, float], cut: int = 4) -> tuple[PointFields, Integers]:
    """Returns the fields at points in elements within the box, ((left, right), depth), sides cut in `cut`,
    and triangles, (m, 3); in mirrored ones what is odd in x1 has the other sign.
    """
    mesh = fields.body.mesh
    (left, right), depth = box
    ticks = np.linspace(0, 1, cut + 1)
    s, t = np.meshgrid(ticks, ticks)
    squares = {ng.ET.QUAD: (s, t), ng.ET.TRIG: (s, t * (1 - s))}  # one side of which is a vertex
    rules = {kind: rule_at(np.reshape(places, (2, -1)).T) for kind, places in squares.items()}
    values = ng.CF((ng.x, ng.y, *fields.plane_fields))(mesh.MapToAllElements(rules, ng.VOL)).T
    first = s.size * np.arange(mesh.ne)[:, None, None]
    triangles = (first + halves(np.arange(s.size).reshape(s.shape))).reshape(-1, 3)
    if fields.mirrored:
        triangles = np.concatenate((triangles, triangles + values.shape[1]))
        values = np.hstack((values, np.array([[-1, 1, *np.where(ODD_FIELDS, -1, 1)]]).T * values))
    across, up = values[:2, triangles]  # of large ones the box may hold no corner
    reach = (across.max(axis=1) >= left) & (across.min(axis=1) <= right) & (up.max(axis=1) >= -depth)
    used, triangles = np.unique(triangles[reach], return_inverse=True)
    return point_fields(*values[:, used]), triangles.reshape(-1, 3)


def cut(fields: BodyFields, box: tuple[Interval, float], x2: float) -> tuple[Any, Integers]:
    """Returns the fields of a body in space at points of the plane x2 in the box, ((left, right), depth), as
    far as they lie in the body, and triangles between these, (m, 3).
    """
    x1, x3, triangles = grid_below(box)
    places = np.array((x1, np.full_like(x1, x2), x3))
    inside = fields.body.mesh(*places)["nr"] >= 0
    used, triangles = np.unique(triangles[inside[triangles].all(axis=1)], return_inverse=True)
    return fields(*places[:, used]), triangles.reshape(-1, 3)
