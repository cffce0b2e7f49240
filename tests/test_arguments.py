"""Bad arguments of which `refusals.csv` can have no row: values as they are shown, too many elements."""

import numpy as np
import pytest

import microblock as mb
from microblock.errors import LONGEST, shown
from microblock.fem import meshes

SOLID = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.085)
LAW, LINE, CYLINDER, BLOCK = mb.Microblock(), mb.Unilateral(), mb.Cylinder(R=10), mb.Block(SOLID, 4.0)


@pytest.mark.parametrize(
    "value, words",
    [
        (1.5, "1.5"),
        ("one", "'one'"),
        (np.float64(-1), "-1.0"),
        ([1, 2], "[1, 2]"),
        (len, "function len"),
        (mb.Plane, "class Plane"),
        (np.zeros((9, 2)), "9 entries ("),
        (tuple(range(7)), "7 entries (0, 1, 2, ...)"),
        (None, "None"),
        ("a" * 500, " ..."),
    ],
)
def test_values_are_shown_on_a_short_line(value, words):
    line = shown(value)
    assert words in line and "\n" not in line and len(line) <= LONGEST


@pytest.mark.parametrize(
    "body, method, words",
    [
        (mb.HalfPlane(mb.Cosserat(E=100, nu=0.3, beta=1, ell=1e-9)), None, "blocks wide, and up to"),
        (BLOCK, mb.Uniform(1e-9), "^h = 1e-09.*elements.*GB.*take h of"),
        (BLOCK, mb.Fitted(order=4, spacing=1e-9), "^spacing = 1e-09.*elements.*GB.*take spacing of"),
    ],
)
def test_what_no_memory_holds_is_refused_by_its_number(body, method, words):
    with pytest.raises(mb.MicroblockError, match=words):
        mb.Contact(body, CYLINDER, LAW, method).solve(load=0.1)


def test_microclamped_constrains_psi_on_a_surface_named_like_another():
    mesh = meshes.uniform(meshes.Ground(far=2.0, reach=(-1.0, 1.0), half=False), 1.0)
    mesh.ngmesh.SetBCName([*mesh.GetBoundaries()].index("side"), "contact_side")
    supports = {"u1": "bottom", "u2": "bottom", "psi": "contact_side"}
    body = mb.Body(meshes.ng.Mesh(mesh.ngmesh), SOLID, 1, fixed=supports)
    state = mb.Contact(body, CYLINDER, mb.Microclamped()).solve(load=0.1)
    assert not state.psi.any() and state.micromoment.any()
