"""Meshes. Boundaries are named by role; the contact surface lies at x2 = 0, the body below it."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

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
from ..model.material import Cosserat
from ..model.types import Array, Integers, Interval

# of netgen, away from the surface; from 0.6 on some meshes are slivers, and ten times worse than others
GRADING = 0.5
RATIO = 0.15  # of the elements towards a graded vertex
KINDS = (ng.SEGM, ng.TRIG, ng.QUAD, ng.TET, ng.PRISM, ng.PYRAMID, ng.HEX)  # of elements
LOCKED = 20.0  # lambda/mu at which elements of order 1 leave displacements a tenth off
SLIVER = 1e-9  # of the reach, below which two edges are one

Spacing: TypeAlias = tuple[float, float, float]  # (left, right, length of the elements between)
Size: TypeAlias = tuple[float, float]  # (x1, longest element there)
Counts: TypeAlias = Callable[[float], tuple[float, float]]  # elements on the surface and in all, by length


def longest_element(solid: Cosserat, order: int) -> float:
    """Returns the length of an element beyond which a layer at the surface is off by a tenth."""
    if solid.beta == 0:
        return math.inf
    if order == 1:
        return solid.ell / math.sqrt(solid.eta)
    return 0.9 * order**1.6 * solid.layer_length  # elements of order 2, 4, 6 hold 2.7, 8.3, 16 layers


def locking(solid: Cosserat, order: int, depth: float, half_width: float) -> list[str]:
    """Returns sentences on elements, `depth` deep below a contact, that lock: they are off by about
    0.02 lambda/mu (depth/half_width)^(2 order), and those of order 1, however fine they are there, by the
    locking of all others.
    """
    ratio = solid.lam / solid.mu
    stiffer = ratio * min(depth / half_width, 1.0) ** (2 * order)
    if order == 1 and stiffer < 2.5 and ratio > LOCKED:
        return [
            f"elements of order 1 lock where nu = {solid.nu:.4g}, also far from the contact: displacements "
            "are a tenth too small, or more; take order 2"
        ]
    if order > 2 or stiffer < 2.5:
        return []
    return [
        f"elements of order {order} that reach {depth:.2g} deep below the contact lock where nu = "
        f"{solid.nu:.4g}, so that pressures may be far off: take order 3 or more, or smaller elements"
    ]


def elements_beside(mesh: Any, region: Any) -> list[Any]:
    """Returns the elements beside each facet of a boundary."""
    facets = [(facet.faces or facet.edges or facet.vertices)[0] for facet in region.Elements()]
    return [mesh[facet].elements for facet in facets]


def elements_at(mesh: Any, region: Any) -> Integers:
    """Returns the numbers of the elements at the facets of a boundary, array (facets,)."""
    elements = elements_beside(mesh, region)
    require(all(elements), "mesh", mesh, "has facets in its boundary that belong to no element")
    return np.array([beside[0].nr for beside in elements])


def thicknesses(mesh: Any, region: Any) -> Array:
    """Returns how far the elements at the facets of a boundary reach below them, array (facets,)."""
    points = mesh.ngmesh.Coordinates()
    depths = []
    for facet, number in zip(region.Elements(), elements_at(mesh, region)):
        element = mesh[ng.ElementId(ng.VOL, int(number))]
        corners = points[[vertex.nr for vertex in facet.vertices]]
        middle = corners.mean(axis=0)
        *_, normal = np.linalg.svd(corners - middle)[2]
        below = points[[vertex.nr for vertex in element.vertices]] - middle
        depths.append(np.abs(below @ normal).max())
    return np.array(depths)


def extent(mesh: Any) -> float:
    """Returns the largest distance of two vertices along an axis (length)."""
    return float(max(np.ptp(along) for along in np.array([vertex.point for vertex in mesh.vertices]).T))


def require_sound(mesh: Any) -> None:
    """Raises BadArgument unless the elements of a mesh have an area (a volume) and one orientation.

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
    rules = _rules_of_soundness(mesh.GetCurveOrder())
    # points that are no numbers are what is looked for
    with np.errstate(invalid="ignore", over="ignore"):
        slopes = np.asarray(ng.specialcf.JacobianMatrix(mesh.dim)(mesh.MapToAllElements(rules, ng.VOL)))
        slopes = slopes.reshape(-1, mesh.dim, mesh.dim)
        sides = np.prod(np.linalg.norm(slopes, axis=1), axis=1)
        sines = np.linalg.det(slopes) / np.maximum(sides, np.finfo(float).tiny)
    wrong = ~(sines * np.sign(np.nanmedian(sines)) > 1e-12)  # sine of the angle between two sides
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


def _rules_of_soundness(curve_order: int) -> dict[Any, Any]:
    """Returns {kind of an element: NGSolve's rule} of points at which an element must have an area."""
    if curve_order > 1:
        return interior_rules(2 * curve_order + 4)
    return corner_rules()


def interior_rules(order: int) -> dict[Any, Any]:
    """Returns {kind of an element: NGSolve's rule of an order}."""
    return {kind: ng.IntegrationRule(kind, order) for kind in KINDS}


def corner_rules() -> dict[Any, Any]:
    """Returns {kind of an element: NGSolve's rule} of its vertices."""
    corners = {kind: ng.fem.ElementTopology(kind).vertices for kind in KINDS}
    corners[ng.PYRAMID] = corners[ng.PYRAMID][:4]  # the tip of a pyramid is singular
    return {kind: ng.IntegrationRule(points, [0.0] * len(points)) for kind, points in corners.items()}


def line(depth: float, elements: int) -> Any:
    """Returns a 1D mesh of [-depth, 0], for fields of x2 alone; points "contact" at x2 = 0, "middle" at
    -depth.
    """
    require_positive(depth=depth)
    require_whole(1, elements=elements)
    return named(Make1DMesh(elements, mapping=lambda x: depth * (x - 1)), "middle", "contact")


def column(depth: float, elements: int) -> Any:
    """Returns one column of 2D squares over [-depth, 0], periodic sideways.

    Boundaries: "contact" on top, "middle" below, "left" and "right" identified.
    """
    require_positive(depth=depth)
    require_whole(1, elements=elements)
    mesh = MakeStructured2DMesh(
        nx=1, ny=elements, periodic_x=True, mapping=lambda x, y: (depth / elements * x, depth * (y - 1))
    )
    return named(mesh, "middle", "right", "contact", "left")


def named(mesh: Any, *names: str) -> Any:
    """Returns the mesh with these names of its boundaries."""
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
    reach: Interval
    half: bool = True

    def __post_init__(self) -> None:
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
    def start(self) -> float:
        """x1 of the left side (length)."""
        return 0.0 if self.half else -self.far

    @property
    def left_side(self) -> str:
        """Name of the boundary on the left."""
        return "axis" if self.half else "side"

    @property
    def supports(self) -> dict[str, str]:
        """{field: boundaries}; the sides are free."""
        odd = "bottom|axis" if self.half else "bottom"  # odd fields are 0 on the axis
        return {"u1": odd, "u2": "bottom", "psi": odd}


def fitted_triangles(
    ground: Ground,
    edges: Iterable[float],
    *,
    spacings: Sequence[Spacing],
    levels: int,
    sizes: Sequence[Size] = (),
) -> Any:
    """Returns a mesh of triangles from netgen with vertices at `edges` on the surface, towards which `levels`
    of elements shrink by RATIO.

    Parameters
    ----------
    ground : Ground
    edges : abscissae within the reach; those closer than SLIVER of it are one
    spacings : lengths of the elements on the boundary "contact", ((left, right, length), ...), ascending;
        away from it they grow by GRADING
    sizes : ((x, length), ...), places on the surface at which elements are no longer, about

    Raises
    ------
    BadArgument
        Also for a spacing that memory does not hold.
    NotConverged
        If netgen fails or leaves a hole.
    """
    least = min(length for _, _, length in spacings)
    require_positive(spacing=least)
    count = sum((right - left) / length for left, right, length in spacings) + len(sizes)
    # of a graded mesh, 3 to 6 elements for one at the surface
    _require_room("spacing", least, lambda length: (count * least / length, 4 * count * least / length))
    rounding = SLIVER * (ground.reach[1] - ground.reach[0])
    grading_points = [float(x) for x, _ in joined([(x, x) for x in edges], rounding)]
    # netgen has tolerances of 1e-7 and less, whatever the unit of length
    unit = max(abs(x) for x in ground.reach) / 1000
    netgen_mesh = _triangulated(ground, grading_points, spacings, sizes, unit)
    netgen_mesh.SetGeometry(None)  # which knows the mesh in its own unit alone
    netgen_mesh.Scale(unit)
    points = netgen_mesh.Coordinates()  # off by a rounding: an edge would not be that of the obstacle
    for exact in (*grading_points, *ground.reach):
        points[(points[:, 1] == 0) & (np.abs(points[:, 0] - exact) < rounding / 10), 0] = exact
    mesh = ng.Mesh(netgen_mesh)
    if levels and grading_points:
        mesh.RefineHP(levels, RATIO)
    return mesh


def _triangulated(
    ground: Ground,
    grading_points: Sequence[float],
    spacings: Sequence[Spacing],
    sizes: Sequence[Size],
    unit: float,
) -> Any:
    """Returns netgen's mesh, in its own unit of length, of the arguments of `fitted_triangles`."""

    def scaled(lengths: Iterable[float]) -> list[float]:
        """Returns lengths in the unit, to 12 digits: as in any other unit."""
        ratios = [length / unit for length in lengths]
        return [round(x, 12 - math.ceil(math.log10(max(abs(x), 1000)))) for x in ratios]

    (far,) = scaled([ground.far])
    left, right = scaled(ground.reach)
    block = Ground(far, (left, right), ground.half)
    vertices = scaled(grading_points)
    lengths = [scaled(spacing) for spacing in spacings]
    longest = [scaled(size) for size in sizes]
    for grading in (GRADING, 0.9 * GRADING, 0.8 * GRADING):
        parameters = netgen.MeshingParameters(maxh=far / 3, grading=grading)
        for x, length in longest:
            parameters.RestrictH(x, 0, 0, length)
        try:
            mesh = _face(block, vertices, lengths).GenerateMesh(mp=parameters)
        except Exception as failure:
            reason = str(failure)
            continue
        missing = 1 - ng.Integrate(1, ng.Mesh(mesh)) / (far * (far - block.start))
        if abs(missing) < SLIVER:
            return mesh
        reason = f"{missing:.1g} of the area is in no element"
    raise NotConverged(f"netgen finds no mesh for edges {list(grading_points)}: {reason}")


def _face(ground: Ground, grading_points: Sequence[float], spacings: Iterable[Sequence[float]]) -> Any:
    """Returns the rectangle of a Ground as a geometry, `grading_points` marked."""
    left, right = ground.reach
    ends = {left, right, *grading_points}
    borders = {x for spacing in spacings for x in spacing[:2] if min(abs(x - end) for end in ends) > SLIVER}
    surface = sorted({*ends, *borders, ground.start, ground.far})
    corners = [(x, 0.0) for x in surface] + [(ground.far, -ground.far), (ground.start, -ground.far)]
    vertices = [occ.Vertex(occ.Pnt(*corner, 0)) for corner in corners]
    for vertex, x in zip(vertices, surface):
        vertex.hpref = float(x in grading_points)
    sides = [occ.Edge(*pair) for pair in zip(vertices, [*vertices[1:], vertices[0]])]
    for side, x, following in zip(sides, surface, surface[1:]):
        middle = (x + following) / 2
        side.name = "free"
        if left <= x < right:
            side.name = "contact"
            for start, end, length in spacings:
                if start < middle < end:
                    side.maxh = length
    for side, name in zip(sides[-3:], ("side", "bottom", ground.left_side)):
        side.name = name
    return occ.OCCGeometry(occ.Face(occ.Wire(sides)), dim=2)


def uniform(ground: Ground, h: float, quads: bool = True) -> Any:
    """Returns squares of side h (length) for 0 < |x1| < reach and as deep, growing to the far field.

    The whole surface is "contact". With ``quads=False`` each element is cut into two triangles.
    """
    require_finite(h=h)
    reach = ground.reach[1]
    require(
        0 < h <= reach, "h", h, f"must be positive and no longer than the region of equal squares, {reach}"
    )
    quarters = 1 if ground.half else 2  # of the plane, below the surface

    def elements(length: float) -> tuple[float, float]:
        count = reach / length * (1 + math.log1p(3 * (ground.far / reach - 1)) / 3)  # about
        return quarters * count, quarters * count * count

    _require_room("h", h, elements)
    lines = uniform_lines(reach, ground.far, h)
    across = lines if ground.half else np.concatenate((-lines[:0:-1], lines))
    return rectangles(across, -lines[::-1], quads, ("bottom", "side", "contact", ground.left_side))


def rectangles(
    across: Array, up: Array, quads: bool = True, names: Sequence[str] = ("bottom", "right", "top", "left")
) -> Any:
    """Returns rectangles between lines x1 = across[i] and x2 = up[j], ascending arrays (n,) and (m,), or
    triangles; `names` of the boundaries go counterclockwise from below.
    """
    mesh = netgen.Mesh(dim=2)
    points = np.stack(np.meshgrid(across, up, 0.0), axis=-1).reshape(-1, 3)
    mesh.AddPoints(points)
    number = np.arange(len(points)).reshape(len(up), len(across))

    def add(dim: int, name: str, elements: Integers) -> None:
        mesh.AddElements(dim, mesh.AddRegion(name, dim=dim), np.ascontiguousarray(elements, np.int32))

    add(2, "dom", squares(number) if quads else halves(number))
    sides = (number[0], number[:, -1], number[-1, ::-1], number[::-1, 0])
    for name, side in zip(names, sides):
        add(1, name, np.stack((side[:-1], side[1:]), axis=-1))
    mesh.Compress()
    return ng.Mesh(mesh)


def _require_room(name: str, length: float, elements: Counts) -> None:
    """Raises BadArgument where elements of this length need more memory than is there."""

    def shortage(length: float) -> str:
        surface, count = elements(length)
        # a square of order 1 has 80 entries of a matrix
        return str(cost.too_much(cost.dense_bytes(surface) + cost.plane_factor_bytes(3 * count, 80 * count)))

    if words := shortage(length):
        least = length
        while shortage(least):
            least *= 2
        raise BadArgument(
            name,
            length,
            f"makes {elements(length)[1]:.2g} elements, whose matrices {words}: take {name} of "
            f"{at_least(least)} or more, a larger ell where it follows from that, or a half-plane",
        )


def uniform_lines(reach: float, far: float, h: float) -> Array:
    """Returns ascending distances from 0 to far, array (n,): steps of h within the reach, then growing in
    proportion to h over it.
    """
    near = np.linspace(0, reach, max(1, round(reach / h)) + 1)
    growth = 1 + 3 * near[1] / reach
    count = max(1, round(np.log1p((far - reach) * (growth - 1) / near[1]) / np.log(growth)))
    return stretched(near, far, growth ** np.arange(1, count + 1))


def stretched(near: Array, far: float, steps: Sequence[float] | Array) -> Array:
    """Returns ascending places `near`, array (n,), continued up to `far` in the ratios of `steps`, (m,):
    array (n + m,).
    """
    outer = near[-1] + (far - near[-1]) * np.cumsum(steps[:-1]) / np.sum(steps)
    return np.concatenate((near, outer, [far]))


def falling_orders(mesh: Any, ground: Ground, grading_points: Sequence[float], top: int) -> Integers:
    """Returns orders of the elements, array (elements,): `top` near the surface, about half of it at
    `grading_points` and far away.
    """
    points = mesh.ngmesh.Coordinates()
    corners = [points[[vertex.nr for vertex in element.vertices]] for element in mesh.Elements()]
    centres = np.array([vertices.mean(axis=0) for vertices in corners])
    reach = max(abs(x) for x in ground.reach)
    lowest = max(1, (top - 3) // 2)
    # what an error far away does to the surface falls with its distance alone, wherever the body ends; errors
    # of a far field that is not symmetric tilt the surface
    far = lowest if ground.half else max(2, (top - 2) // 2)
    fall = (1.6 if ground.half else 1.0) / 3
    decades = np.log10(np.maximum(np.hypot(*centres.T) / reach, 1))
    orders = far + (top - far) * np.maximum(1 - fall * decades, 0)
    if len(grading_points):
        distance = np.abs(centres[:, None, 0] - np.asarray(grading_points)) + np.abs(centres[:, None, 1])
        smallest = min(np.ptp(vertices, axis=0).max() for vertices in corners)
        first = max(0.4 * reach, 2 * smallest) / smallest
        along = np.log(np.clip(distance.min(axis=1) / smallest, 1, first)) / np.log(first)
        orders = np.minimum(orders, lowest + (top - lowest) * along)
    return np.rint(np.minimum(orders, top)).astype(int)
