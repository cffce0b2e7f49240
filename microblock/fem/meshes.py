"""Meshes. Boundaries are named by role; the contact surface lies at x2 = 0, the body below it."""

import math
from dataclasses import dataclass

import netgen.meshing as netgen
import netgen.occ as occ
import ngsolve as ng
import numpy as np
from ngsolve.meshes import Make1DMesh, MakeStructured2DMesh

from .. import cost
from ..errors import (
    BadArgument,
    NotConverged,
    at_least,
    require,
    require_finite,
    require_pair,
    require_positive,
    require_whole,
)
from ..model.fields import halves, squares
from ..model.intervals import joined

# of netgen, away from the surface; from 0.6 on some meshes are slivers, and ten times worse than others
GRADING = 0.5
RATIO = 0.15  # of the elements towards a graded vertex
SLIVER = 1e-9  # of the reach, below which two edges are one


def longest_element(solid, order):
    """Length of an element beyond which a layer at the surface is off by a tenth."""
    if solid.beta == 0:
        return math.inf
    # an element of order 2, 4, 6 holds 2.7, 8.3, 16 layers
    return solid.ell / math.sqrt(solid.eta) if order == 1 else 0.9 * order**1.6 * solid.layer_length


def locking(solid, order, depth, half_width):
    """Sentences on elements, `depth` deep below a contact, that lock: they are off by about 0.02 lambda/mu
    (depth/half_width)^(2 order).
    """
    stiffer = solid.lam / solid.mu * min(depth / half_width, 1.0) ** (2 * order)
    words = (
        f"elements of order {order} that reach {depth:.2g} deep below the contact lock where nu = "
        f"{solid.nu:.4g}, so that pressures may be far off: take order 3 or more, or smaller elements"
    )
    return [words] * bool(order <= 2 and stiffer >= 2.5)


def elements_at(mesh, region):
    """Numbers of the elements at the facets of a boundary."""
    beside = [mesh[(facet.faces or facet.edges)[0]].elements for facet in region.Elements()]
    require(all(beside), "mesh", mesh, "has facets in its boundary that belong to no element")
    return np.array([elements[0].nr for elements in beside])


def thicknesses(mesh, region):
    """How far the elements at the facets of a boundary reach below them, array (facets,)."""
    points, found = mesh.ngmesh.Coordinates(), []
    for facet, number in zip(region.Elements(), elements_at(mesh, region)):
        element = mesh[ng.ElementId(ng.VOL, int(number))]
        own, below = (points[[vertex.nr for vertex in part.vertices]] for part in (facet, element))
        middle = own.mean(axis=0)
        *_, normal = np.linalg.svd(own - middle)[2]
        found.append(np.abs((below - middle) @ normal).max())
    return np.array(found)


def extent(mesh: ng.Mesh) -> float:
    """Returns the largest distance of two vertices along an axis (length)."""
    return float(max(np.ptp(along) for along in np.array([vertex.point for vertex in mesh.vertices]).T))


def require_sound(mesh):
    """BadArgument unless the elements of a mesh have an area (a volume) and one orientation.

    Curved ones are looked at inside: in a corner on a smooth curve a quadrilateral is flat.
    """
    require(
        isinstance(mesh, ng.Mesh) and mesh.dim in (1, 2, 3),
        "mesh",
        mesh,
        "must be an ngsolve.Mesh of one, two or three dimensions",
    )
    require(mesh.ne > 0, "mesh", mesh, "must have elements")
    require(
        mesh.deformation is None,
        "mesh",
        mesh,
        "must not be deformed (SetDeformation): finer ones would not be; move its points",
    )
    curved, kinds = mesh.GetCurveOrder(), (ng.SEGM, ng.TRIG, ng.QUAD, ng.TET, ng.PRISM, ng.PYRAMID, ng.HEX)
    if curved > 1:
        rules = {kind: ng.IntegrationRule(kind, 2 * curved + 4) for kind in kinds}
    else:  # the corners, but for the tip of a pyramid, which is singular
        corners = {kind: ng.fem.ElementTopology(kind).vertices for kind in kinds}
        corners[ng.PYRAMID] = corners[ng.PYRAMID][:4]
        rules = {kind: ng.IntegrationRule(ends, [0.0] * len(ends)) for kind, ends in corners.items()}
    # points that are no numbers are what is looked for
    with np.errstate(invalid="ignore", over="ignore"):
        slopes = np.asarray(ng.specialcf.JacobianMatrix(mesh.dim)(mesh.MapToAllElements(rules, ng.VOL)))
        slopes = slopes.reshape(-1, mesh.dim, mesh.dim)
        areas = np.linalg.det(slopes)
        turned = areas / np.maximum(np.prod(np.linalg.norm(slopes, axis=1), axis=1), np.finfo(float).tiny)
    wrong = ~(turned * np.sign(np.nanmedian(turned)) > 1e-12)  # sine of the angle between two sides
    if wrong.any():
        counts = [len(rules[element.type]) for element in mesh.Elements()]
        numbers = np.unique(np.repeat(np.arange(mesh.ne), counts)[wrong])
        raise BadArgument(
            "mesh",
            mesh,
            f"{len(numbers)} of its {mesh.ne} elements (first number {numbers[0]}) have no "
            f"{'volume' if mesh.dim == 3 else 'area'}, are "
            "inverted against the others, or have points that are no numbers",
        )


def line(depth, elements):
    """A 1D mesh of [-depth, 0], for fields of x2 alone; points "contact" at x2 = 0, "middle" at -depth."""
    require_positive(depth=depth)
    require_whole(1, elements=elements)
    return named(Make1DMesh(elements, mapping=lambda x: depth * (x - 1)), "middle", "contact")


def column(depth, elements):
    """One column of 2D squares over [-depth, 0], periodic sideways.

    Boundaries: "contact" on top, "middle" below, "left" and "right" identified.
    """
    require_positive(depth=depth)
    require_whole(1, elements=elements)
    mesh = MakeStructured2DMesh(
        nx=1, ny=elements, periodic_x=True, mapping=lambda x, y: (depth / elements * x, depth * (y - 1))
    )
    return named(mesh, "middle", "right", "contact", "left")


def named(mesh, *names):
    """The mesh with these names of its boundaries."""
    for number, name in enumerate(names):
        mesh.ngmesh.SetBCName(number, name)
    return ng.Mesh(mesh.ngmesh)


@dataclass(frozen=True)
class Ground:
    """A block of ground whose surface is pressed near x1 = 0: -far < x2 < 0, 0 < x1 < far or -far < x1 < far.

    Boundaries are "contact" for x1 in `reach`, "free" beside it, "side", "bottom", and of a half "axis".

    Parameters
    ----------
    far : size of the domain (length)
    reach : (left, right) ends of the boundary "contact"; left is 0 on a half
    half : whether x1 = 0 is an axis

    Examples
    --------
    >>> from microblock.fem import meshes
    >>> ground = meshes.Ground(far=10.0, reach=(0.0, 1.0))
    >>> sorted(set(meshes.uniform(ground, 0.5).GetBoundaries()))
    ['axis', 'bottom', 'contact', 'side']
    """

    far: float
    reach: tuple
    half: bool = True

    def __post_init__(self):
        require_positive(far=self.far)
        require_pair(reach=self.reach)
        left, right = self.reach
        require(
            -self.far < left < right < self.far and (left == 0 or not self.half),
            "reach",
            self.reach,
            f"must be an interval within {self.far} of x1 = 0, from it on a half",
        )

    @property
    def supports(self):
        """{field: boundaries}; the sides are free."""
        axis = "|axis" if self.half else ""
        return {"u1": "bottom" + axis, "u2": "bottom", "psi": "bottom" + axis}


def graded(ground, edges, *, parts, levels, sizes=()):
    """Triangles from netgen with vertices at `edges` on the surface, towards which `levels` of elements
    shrink by RATIO.

    Parameters
    ----------
    ground : Ground
    edges : abscissae within the reach; those closer than SLIVER of it are one
    parts : lengths of the elements on the boundary "contact", ((left, right, length), ...), ascending; away
        from it they grow by GRADING
    sizes : ((x, length), ...), places on the surface at which elements are no longer, about

    Raises
    ------
    BadArgument
        Also for a spacing that memory does not hold.
    NotConverged
        If netgen fails or leaves a hole.
    """
    surface, reach = ground.reach[1] - ground.reach[0], max(abs(x) for x in ground.reach)
    least = min(length for _, _, length in parts)
    require_positive(spacing=least)
    count = sum((right - left) / length for left, right, length in parts) + len(sizes)
    # of a graded mesh, 3 to 6 elements for one at the surface
    _require_room("spacing", least, lambda length: (count * least / length, 4 * count * least / length))
    # netgen has tolerances of 1e-7 and less, whatever the unit of length
    unit, tips = reach / 1000, [float(x) for x, _ in joined([(x, x) for x in edges], SLIVER * surface)]
    scaled = Ground(_rounded(ground.far, unit), tuple(_rounded(x, unit) for x in ground.reach), ground.half)
    places, lengths, parts = (
        [tuple(_rounded(x, unit) for x in part) for part in some] for some in ([tips], sizes, parts)
    )
    for trial in (GRADING, 0.9 * GRADING, 0.8 * GRADING):
        wanted = netgen.MeshingParameters(maxh=scaled.far / 3, grading=trial)
        for place, length in lengths:
            wanted.RestrictH(place, 0, 0, length)
        try:
            made = _face(scaled, places[0], parts).GenerateMesh(mp=wanted)
            missing = 1 - ng.Integrate(1, ng.Mesh(made)) / scaled.far**2 / (1 if ground.half else 2)
            reason = f"{missing:.1g} of the area is in no element"
        except Exception as failure:
            reason, missing = failure, 1
        if abs(missing) < SLIVER:
            break
    else:
        raise NotConverged(f"netgen finds no mesh for edges {tips}: {reason}")
    made.SetGeometry(None)  # which knows the mesh in its own unit alone
    made.Scale(unit)
    points = made.Coordinates()  # off by a rounding: an edge would not be that of the obstacle
    for exact in (*tips, *ground.reach):
        points[(points[:, 1] == 0) & (np.abs(points[:, 0] - exact) < SLIVER * surface / 10), 0] = exact
    mesh = ng.Mesh(made)
    if levels and tips:
        mesh.RefineHP(levels, RATIO)
    return mesh


def _rounded(length, unit):
    """A length in a unit, to 12 digits: as in any other unit."""
    scaled = length / unit
    return round(scaled, 12 - math.ceil(math.log10(max(abs(scaled), 1000))))


def _face(ground, tips, parts):
    """The rectangle of a Ground as a geometry, its tips marked."""
    (left, right), far = ground.reach, ground.far
    start, known = 0.0 if ground.half else -far, {left, right, *tips}
    ends = {x for part in parts for x in part[:2] if min(abs(x - other) for other in known) > SLIVER}
    surface = sorted({*known, *ends, start, far})
    corners = [(x, 0.0) for x in surface] + [(far, -far), (start, -far)]
    names = ["contact" if left <= x < right else "free" for x in surface[:-1]]
    names += ["side", "bottom", "axis" if ground.half else "side"]
    vertices, edges = [occ.Vertex(occ.Pnt(*point, 0)) for point in corners], []
    for vertex, x in zip(vertices, surface):
        vertex.hpref = float(x in tips)
    for i, name in enumerate(names):
        edge = occ.Edge(vertices[i], vertices[(i + 1) % len(vertices)])
        edge.name, middle = name, (corners[i][0] + corners[(i + 1) % len(corners)][0]) / 2
        for a, b, length in parts:
            if name == "contact" and a < middle < b:
                edge.maxh = length
        edges.append(edge)
    return occ.OCCGeometry(occ.Face(occ.Wire(edges)), dim=2)


def uniform(ground, h, quads=True):
    """Squares of side h (length) for 0 < |x1| < reach and as deep, growing to the far field.

    The whole surface is "contact". With ``quads=False`` each element is cut into two triangles.
    """
    require_finite(h=h)
    reach = ground.reach[1]
    require(
        0 < h <= reach, "h", h, f"must be positive and no longer than the region of equal squares, {reach}"
    )

    def elements(length):
        count = reach / length * (1 + math.log1p(3 * (ground.far / reach - 1)) / 3)  # about
        return (count, count * count) if ground.half else (2 * count, 2 * count * count)

    _require_room("h", h, elements)
    lines = uniform_lines(reach, ground.far, h)
    across = lines if ground.half else np.concatenate((-lines[:0:-1], lines))
    left = "axis" if ground.half else "side"
    return rectangles(across, -lines[::-1], quads, ("bottom", "side", "contact", left))


def rectangles(across, up, quads=True, names=("bottom", "right", "top", "left")):
    """Rectangles between lines x1 = across[i] and x2 = up[j], ascending, or triangles; `names` of the
    boundaries go counterclockwise from below.
    """
    mesh, points = netgen.Mesh(dim=2), np.stack(np.meshgrid(across, up, 0.0), axis=-1).reshape(-1, 3)
    mesh.AddPoints(points)
    number = np.arange(len(points)).reshape(len(up), len(across))

    def add(dim, name, elements):
        mesh.AddElements(dim, mesh.AddRegion(name, dim=dim), np.ascontiguousarray(elements, np.int32))

    add(2, "dom", squares(number) if quads else halves(number))
    sides = number[0], number[:, -1], number[-1, ::-1], number[::-1, 0]
    for name, side in zip(names, sides):
        add(1, name, np.stack((side[:-1], side[1:]), axis=-1))
    mesh.Compress()
    return ng.Mesh(mesh)


def _require_room(name, length, elements):
    """BadArgument where elements of this length, `elements(length)` on the surface and in all, need more
    memory than is there.
    """

    def wrong(length):
        surface, count = elements(length)
        # a square of order 1 has 80 entries of a matrix
        return cost.too_much(cost.of_nodes(surface) + cost.of_factors(3 * count, 80 * count))

    if words := wrong(length):
        least = length
        while wrong(least):
            least *= 2
        raise BadArgument(
            name,
            length,
            f"makes {elements(length)[1]:.2g} elements, whose matrices {words}: take {name} of "
            f"{at_least(least)} or more, a larger ell where it follows from that, or a half-plane",
        )


def uniform_lines(reach, far, h):
    """Ascending distances from 0 to far: steps of h within the reach, then growing in proportion to h over
    it.
    """
    near = np.linspace(0, reach, max(1, round(reach / h)) + 1)
    growth = 1 + 3 * near[1] / reach
    count = max(1, round(np.log1p((far - reach) * (growth - 1) / near[1]) / np.log(growth)))
    return stretched(near, far, growth ** np.arange(1, count + 1))


def stretched(near, far, steps):
    """Ascending places, with more up to `far` in the ratios of these steps."""
    outer = near[-1] + (far - near[-1]) * np.cumsum(steps[:-1]) / np.sum(steps)
    return np.concatenate((near, outer, [far]))


def falling_orders(mesh, ground, tips, top):
    """Orders of the elements, array (elements,): `top` near the surface, about half of it at the tips and far
    away.
    """
    points = mesh.ngmesh.Coordinates()
    corners = [points[[vertex.nr for vertex in element.vertices]] for element in mesh.Elements()]
    centres = np.array([own.mean(axis=0) for own in corners])
    sizes = np.array([np.ptp(own, axis=0).max() for own in corners])
    reach, lowest = max(abs(x) for x in ground.reach), max(1, (top - 3) // 2)
    decades = np.log10(np.maximum(np.hypot(*centres.T) / reach, 1))
    # what an error far away does to the surface falls with its distance alone, wherever the body ends; errors
    # of a far field that is not symmetric tilt the surface
    fall, far = (1.6 / 3, lowest) if ground.half else (1 / 3, max(2, (top - 2) // 2))
    orders = far + (top - far) * np.maximum(1 - fall * decades, 0)
    if len(tips):
        distance = np.abs(centres[:, None, 0] - np.asarray(tips)) + np.abs(centres[:, None, 1])
        smallest = sizes.min()
        first = max(0.4 * reach, 2 * smallest) / smallest
        along = np.log(np.clip(distance.min(axis=1) / smallest, 1, first)) / np.log(first)
        orders = np.minimum(orders, lowest + (top - lowest) * along)
    return np.rint(np.minimum(orders, top)).astype(int)
