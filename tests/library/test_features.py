"""README says what each body can do: "yes" computes, "no" raises BadArgument or has no such attribute."""

import re
from pathlib import Path

import netgen.occ as occ
import ngsolve as ng
import pytest

import microblock as mb
from microblock.fem import meshes, meshes3d

README = Path(__file__).parents[2] / "README.md"
SOLID = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.2)
LINE = mb.Contact(mb.HalfPlane(SOLID), mb.Cylinder(R=10), mb.Microblock())
SPACE = mb.Contact(mb.HalfSpace(SOLID), mb.Sphere(R=10), mb.Microblock(), mb.Cells(nodes=32))
WAVE = mb.Contact(mb.HalfPlane(SOLID, period=1.0), mb.Wave(0.01, 1.0), mb.Microblock(), mb.Cells(nodes=64))


def mesh():
    ground = meshes.Ground(far=2.0, reach=(-0.8, 0.8), half=False)
    body = mb.Body(meshes.uniform(ground, 0.2), SOLID, order=2, fixed="bottom")
    return mb.Contact(body, mb.Cylinder(R=10), mb.Microblock())


def block():
    x = meshes3d.graded(reach=0.6, step=0.2, far=2.0, growth=2.0)
    body = mb.Body3D(
        meshes3d.block(x, x, -x[::-1], 0.6), SOLID, fixed=meshes3d.supports("bottom", x1="left", x2="front")
    )
    return mb.Contact(body, mb.Sphere(R=10), mb.Microblock())


def above():
    """A body over the first one, its contact boundary below."""
    face = occ.MoveTo(-3, 0).Rectangle(6, 2).Face()
    face.edges.Max(occ.Y).name, face.edges.Min(occ.Y).name = "back", "contact"
    shape = ng.Mesh(occ.OCCGeometry(face, dim=2).GenerateMesh(maxh=0.4))
    return mb.Body(shape, SOLID, 2, fixed="back")


def rotated(problem):
    return problem.with_(law=mb.Microblock(psi0=0.001)).solve(load=0.3)


def slides(problem):
    return problem.with_(law=mb.Unilateral(friction=0.3)).history([(0.3, 0.0), (0.3, 0.03)])


def pressed(problem, second):
    return problem.with_(obstacle=mb.Deformable(second, problem.obstacle)).solve(load=0.3)


COLUMNS = ("half-plane", "mesh in the plane", "half-space", "mesh in space")
FEATURES = {
    "tolerance `rtol`, error estimate": (
        lambda: LINE.solve(load=0.3, rtol=1e-2),
        lambda: mesh().solve(load=0.3, rtol=0.3),
        lambda: mb.Contact(mb.HalfSpace(SOLID), mb.Sphere(R=10), mb.Unilateral()).solve(load=0.3, rtol=0.1),
        lambda: block().solve(load=0.3, rtol=0.3),
    ),
    "load path with its events": (
        lambda: LINE.path(load=0.1, rtol=1e-2),
        lambda: mesh().path(load=0.1),
        lambda: SPACE.path(load=0.1),
        lambda: block().path(load=0.1),
    ),
    "prescribed approach": (
        lambda: WAVE.solve(approach=0.005),
        lambda: mesh().solve(approach=0.01),
        lambda: SPACE.solve(approach=0.01),
        lambda: block().solve(approach=0.01),
    ),
    "rotated blocks, `psi0`": tuple(
        lambda one=one: rotated(one()) for one in (lambda: LINE, mesh, lambda: SPACE, lambda: block())
    ),
    "Coulomb friction, histories": tuple(
        lambda one=one: slides(one()) for one in (lambda: LINE, mesh, lambda: SPACE, lambda: block())
    ),
    "second elastic body": (
        lambda: pressed(LINE, mb.HalfPlane(SOLID)),
        lambda: pressed(mesh(), above()),
        lambda: pressed(SPACE, mb.HalfSpace(SOLID)),
        lambda: pressed(block(), mb.HalfSpace(SOLID)),
    ),
    "fields below the surface": (
        lambda: LINE.solve(load=0.3).fields(0.0, -0.1),
        lambda: mesh().solve(load=0.3).fields.stress,
        lambda: SPACE.solve(load=0.3).fields,
        lambda: block().solve(load=0.3).fields.stress,
    ),
}


def table():
    """{feature: what README says of the bodies}."""
    rows = re.findall(r"^\| (.+) \|$", README.read_text(), re.M)
    cells = [[cell.strip() for cell in row.split("|")] for row in rows]
    return {row[0]: row[1:] for row in cells if row[0] in FEATURES}


def test_readme_names_the_features():
    assert list(table()) == [*FEATURES]


@pytest.mark.parametrize("column", range(4), ids=COLUMNS)
@pytest.mark.parametrize("feature", FEATURES)
def test_a_body_can_do_what_readme_says(feature, column):
    said = table()[feature][column]
    if said == "no":
        with pytest.raises((mb.BadArgument, AttributeError)):
            FEATURES[feature][column]()
    else:
        assert said in ("yes", "with a period")
        assert FEATURES[feature][column]() is not None


def test_a_half_plane_without_a_period_has_no_approach():
    with pytest.raises(mb.BadArgument, match="arbitrary"):
        LINE.solve(approach=0.01)
