"""Fields of a body on a mesh at the points of a picture."""

import numpy as np

from . import meshes


class BelowOnMesh:
    """Base of states with `fields` of the computed part, or of the half x1 > 0 (`mirrored`)."""

    mirrored = False

    def locking(self, nodes):
        """Sentences where elements below contact nodes lock."""
        body, zones = nodes.body, self.zones_by_name["contact"]
        if self.error_estimate is not None or not zones or not self.has_edges:
            return []
        ends = np.array(
            [[body.mesh[v].point[0] for v in facet.vertices] for facet in nodes.region.Elements()]
        )
        below = np.any([(ends.min(1) < right) & (left < ends.max(1)) for left, right in zones], axis=0)
        depth = meshes.thicknesses(body.mesh, nodes.region)[1][below].max(initial=0.0)
        return meshes.locking(body.solid, body.order, depth, max(right - left for left, right in zones) / 2)

    def overlap(self):
        """Sentences where a penalty lets corners far into the obstacle."""
        inside, moved = -self.surface().gaps.min(), np.abs(self.displacement).max()
        if not self.solver.penalizes or inside <= 0.01 * moved:
            return []
        return [
            f"corners lie {inside / moved:.1g} of the displacement inside the obstacle: take a larger rho"
        ]

    def fields_below(self, box, cut=4):
        """What `draw_below` and `draw_body` ask for, in elements within the box, sides cut in `cut`."""
        import ngsolve as ng

        fields, mesh = self.fields, self.fields.body.mesh
        rules, cuts, points = {}, {}, [(i, j) for j in range(cut + 1) for i in range(cut + 1)]
        halves = [((i, j), (i + 1, j), (i, j + 1)) for i, j in points]
        halves += [((i + 1, j), (i + 1, j + 1), (i, j + 1)) for i, j in points]
        for kind, most in ((ng.ET.TRIG, cut), (ng.ET.QUAD, 2 * cut)):
            numbers = {point: number for number, point in enumerate(p for p in points if sum(p) <= most)}
            own = [half for half in halves if numbers.keys() >= {*half}]
            cuts[kind] = np.array([[numbers[point] for point in half] for half in own])
            rules[kind] = ng.IntegrationRule([(i / cut, j / cut) for i, j in numbers], [0.0] * len(numbers))
        places = mesh.MapToAllElements(rules, ng.VOL)
        x1, x2, psi, stress = (
            np.asarray(function(places)) for function in (ng.x, ng.y, fields.psi, fields.stress)
        )
        triangles, first = [], 0
        for element in mesh.Elements():
            triangles.append(first + cuts[element.type])
            first += len(rules[element.type])
        triangles, stress = np.concatenate(triangles), stress.reshape(-1, 2, 2)
        return _cut_to(box, x1.ravel(), x2.ravel(), triangles, psi.ravel(), stress, self.mirrored)


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
