"""At the door: what is unusual and allowed, and results that are no numbers (tests/refusals.csv has what is
not allowed).
"""

import json
import math
import os
from fractions import Fraction

import numpy as np
import pytest

import microblock as mb
from cases.__main__ import main
from microblock.data.records import json_text
from microblock.errors import replacing

SOLID = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.085)
PLANE, CYLINDER, LAW = mb.HalfPlane(SOLID), mb.Cylinder(R=10), mb.Microblock()
LINE = mb.Contact(PLANE, CYLINDER, LAW)


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


@pytest.mark.parametrize("result", [{"a": [1.0, {"b": math.nan}]}, [math.inf]])
def test_what_is_no_number_is_told_and_not_written(result):
    with pytest.raises(mb.NotConverged, match="NaN or infinite"):
        json_text(result)


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


@pytest.mark.parametrize("value", [np.float64(1.0), np.float32(1.0), np.int64(1), 1])
def test_numbers_of_numpy_are_numbers(value):
    assert mb.Cylinder(value).R == 1
    assert LINE.solve(value, rtol=1e-2).load == 1


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
