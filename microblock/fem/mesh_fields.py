"""Fields of a body on a mesh at the points of a picture."""

import ngsolve as ng
import numpy as np


def below(fields, box, cut=4):
    """x1, x2, triangles, psi, stress in elements within the box, sides cut in `cut`."""
    rules, cuts, points = {}, {}, [(i, j) for j in range(cut + 1) for i in range(cut + 1)]
    halves = [((i, j), (i + 1, j), (i, j + 1)) for i, j in points]
    halves += [((i + 1, j), (i + 1, j + 1), (i, j + 1)) for i, j in points]
    for kind, most in ((ng.ET.TRIG, cut), (ng.ET.QUAD, 2 * cut)):
        numbers = {point: number for number, point in enumerate(p for p in points if sum(p) <= most)}
        own = [half for half in halves if numbers.keys() >= {*half}]
        cuts[kind] = np.array([[numbers[point] for point in half] for half in own])
        rules[kind] = ng.IntegrationRule([(i / cut, j / cut) for i, j in numbers], [0.0] * len(numbers))
    places = fields.body.mesh.MapToAllElements(rules, ng.VOL)
    x1, x2, psi, stress = (
        np.asarray(function(places)) for function in (ng.x, ng.y, fields.psi, fields.stress)
    )
    kinds = [element.type for element in fields.body.mesh.Elements()]
    firsts = np.cumsum([0, *(len(rules[kind]) for kind in kinds)])
    triangles = np.concatenate([first + cuts[kind] for first, kind in zip(firsts, kinds)])
    stress = stress.reshape(-1, 2, 2)
    return _cut_to(box, x1.ravel(), x2.ravel(), triangles, psi.ravel(), stress, fields.mirrored)


def _cut_to(box, x1, x2, triangles, psi, stress, mirrored):
    """Points and triangles within the box; mirrored ones with psi and shear stresses of the other sign."""
    (left, right), depth = box
    if mirrored:
        odd = np.array([[1, -1], [-1, 1]])
        triangles = np.concatenate((triangles, triangles + len(x1)))
        x1, x2, psi = np.concatenate((x1, -x1)), np.tile(x2, 2), np.concatenate((psi, -psi))
        stress = np.concatenate((stress, odd * stress))
    across, up = x1[triangles], x2[triangles]  # of large ones the box may hold no corner
    reach = (across.max(axis=1) >= left) & (across.min(axis=1) <= right) & (up.max(axis=1) >= -depth)
    triangles = triangles[reach]
    used, triangles = np.unique(triangles, return_inverse=True)
    return x1[used], x2[used], triangles.reshape(-1, 3), psi[used], np.moveaxis(stress[used], 0, -1)
