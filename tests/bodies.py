"""Bodies on meshes that several tests press."""

import microblock as mb
from microblock.fem import meshes, meshes3d


def on_ground(solid, h, order, far=2.0, reach=1.0):
    """A block of half-width and depth `far`, held below, with squares of side h in its contact region."""
    mesh = meshes.uniform(meshes.Ground(far=far, reach=(-reach, reach), half=False), h)
    return mb.Body(mesh, solid, order, fixed="bottom")


def quarter(solid, step=0.3, far=3.0):
    """A quarter of a block in space between planes of symmetry, with facets of a side `step`."""
    x = meshes3d.graded(reach=0.6, step=step, far=far, growth=2.0)
    fixed = meshes3d.supports("bottom", x1="left", x2="front")
    return mb.Body(meshes3d.block(x, x, -x[::-1], reach=0.6), solid, 1, fixed=fixed)
