"""At the door: what is unusual and allowed, and results that are no numbers (tests/refusals.csv has what is
not allowed).
"""

import json
import os
from fractions import Fraction

import numpy as np
import pytest

import microblock as mb
from cases.__main__ import main
from microblock.errors import LONGEST, replacing, shown
from microblock.fem import meshes

SOLID = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.085)
PLANE, CYLINDER, LAW = mb.HalfPlane(SOLID), mb.Cylinder(R=10), mb.Microblock()


def test_the_empty_surroundings_of_a_punch_are_no_error(capsys):
    """Blocks ten times as wide as the punch: around one corner's edges there is nothing over the other's."""
    words = (
        "hertz --obstacle punch --contact microblock --P 1.45418e-07 --alpha 16.0308 --beta 0.00927023 "
        "--psi0-deg 6.107761 "
        "--punch-half-width 1.6965 --json -"
    )
    assert main(words.split()) in (0, 1)
    printed = capsys.readouterr()
    if printed.out:
        assert json.loads(printed.out, parse_constant=lambda word: pytest.fail(f"{word} in the JSON"))[
            "states"
        ]
    else:
        assert printed.err.count("\n") == 1


def test_a_file_is_written_whole_or_not_at_all(tmp_path):
    """What stops the writing leaves the file as it was, and a pipe where it is."""
    file, pipe = tmp_path / "file", tmp_path / "pipe"
    file.write_text("before")
    os.mkfifo(pipe)
    for place in (file, pipe):
        with pytest.raises(KeyboardInterrupt), replacing(place) as part:
            assert part == pipe or part.write_text("half")
            raise KeyboardInterrupt
    assert file.read_text() == "before" and sorted(tmp_path.iterdir()) == [file, pipe]


@pytest.mark.parametrize(
    "height",
    [
        lambda x: list(np.asarray(x) ** 2 / 20),
        lambda x: np.array([Fraction(float(one)) ** 2 / 20 for one in x], dtype=object),
    ],
)
def test_heights_that_return_lists_or_fractions_are_heights(height):
    found, known = (
        mb.Contact(PLANE, each, mb.Unilateral()).solve(1.0, rtol=1e-3) for each in (height, CYLINDER)
    )
    # two estimates below 1e-3
    assert found.half_width == pytest.approx(known.half_width, rel=2e-3)


# --- bad arguments of which `refusals.csv` can have no row: values as they are shown, too many elements


BLOCK = mb.Block(SOLID, 4.0)


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
        (mb.HalfPlane(mb.Cosserat(E=100, nu=0.3, beta=1, ell=1e-9)), mb.Panels(), "blocks wide, and up to"),
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
