"""Fields of a body on a mesh at the points of a picture."""

import ngsolve as ng
import numpy as np


def below(fields, box, cut=4):
    """x1, x2, triangles, psi, stress in elements within the box, sides cut in `cut`; in mirrored ones psi and
    shear stresses have the other sign.
    """
    rules, cuts, points = {}, {}, [(i, j) for j in range(cut + 1) for i in range(cut + 1)]
    halves = [((i, j), (i + 1, j), (i, j + 1)) for i, j in points]
    halves += [((i + 1, j), (i + 1, j + 1), (i, j + 1)) for i, j in points]
    for kind, most in ((ng.ET.TRIG, cut), (ng.ET.QUAD, 2 * cut)):
        numbers = {point: number for number, point in enumerate(p for p in points if sum(p) <= most)}
        own = [half for half in halves if numbers.keys() >= {*half}]
        cuts[kind] = np.array([[numbers[point] for point in half] for half in own])
        rules[kind] = ng.IntegrationRule([(i / cut, j / cut) for i, j in numbers], [0.0] * len(numbers))
    places = fields.body.mesh.MapToAllElements(rules, ng.VOL)
    values = ng.CF((ng.x, ng.y, fields.psi, fields.stress))(places).T
    kinds = [element.type for element in fields.body.mesh.Elements()]
    firsts = np.cumsum([0, *(len(rules[kind]) for kind in kinds)])
    triangles = np.concatenate([first + cuts[kind] for first, kind in zip(firsts, kinds)])
    if fields.mirrored:
        triangles = np.concatenate((triangles, triangles + values.shape[1]))
        values = np.hstack((values, np.array([[-1, 1, -1, 1, -1, -1, 1]]).T * values))
    (left, right), depth = box
    across, up = values[:2, triangles]  # of large ones the box may hold no corner
    reach = (across.max(axis=1) >= left) & (across.min(axis=1) <= right) & (up.max(axis=1) >= -depth)
    used, triangles = np.unique(triangles[reach], return_inverse=True)
    x1, x2, psi, *stress = values[:, used]
    return x1, x2, triangles.reshape(-1, 3), psi, np.reshape(stress, (2, 2, -1))
