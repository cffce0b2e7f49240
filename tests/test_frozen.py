"""The numbers of the library are those of tests/frozen."""

import pytest

from tests.frozen import ROOMS, TOLERANCES, Room, problems
from tests.frozen.choice import Choice, traits_of

SHOWN = 12  # rows that the failure names
GUARDED = 1e-3  # a row that may move by more guards nothing


def agree(room):
    """All rows that are computed agree with those of the file."""
    rows = room.compared()
    wrong = sorted((row for row in rows if not row.agrees), key=lambda row: -row.off)
    assert not wrong, f"{len(wrong)} of {len(rows)} rows differ:\n" + "\n".join(map(str, wrong[:SHOWN]))


@pytest.mark.slow
@pytest.mark.parametrize("name", ROOMS)
def test_numbers_are_the_frozen_ones(name):
    """Of a tenth of the problems, chosen by their names, and of those without which a method with a law, an
    obstacle or an option would be missing; the rows of the others are left out.
    """
    agree(Room(name, whole=False))


@pytest.mark.nightly
@pytest.mark.parametrize("name", ROOMS)
def test_all_numbers_are_the_frozen_ones(name):
    agree(Room(name))


def test_what_is_left_out_is_shown_by_others_and_its_rows_are_known():
    """Every trait of the problems is one of those that are computed; rows of the others alone are missing."""
    choice, given = Choice(whole=False), problems.PANELS + problems.CELLS
    computed = choice.of(given)
    names = {problem["name"] for problem in computed}
    assert len(computed) < 0.6 * len(given)
    assert set().union(*map(traits_of, given)) == set().union(*map(traits_of, computed))
    for problem in given:
        assert choice.leaves_out(f"{problem['name']} half_width") == (problem["name"] not in names)
    assert not choice.leaves_out("of no problem")
    assert Choice(whole=True).of(given) == given


@pytest.mark.parametrize("name", ROOMS)
def test_rows_guard_what_they_hold(name):
    rows = Room(name).known.values()
    assert rows
    for row in rows:
        assert row.kind in TOLERANCES, row.name
        assert row.kind in ("count", "doubt") or row.tolerance <= GUARDED, row.name
        assert row.kind != "outcome" or row.tolerance == 0, row.name
