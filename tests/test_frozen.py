"""The numbers of the library are those of tests/frozen."""

import pytest

from tests.frozen import ROOMS, TOLERANCES, Room

SHOWN = 12  # rows that the failure names
GUARDED = 1e-3  # a row that may move by more guards nothing


@pytest.mark.slow
@pytest.mark.parametrize("name", ROOMS)
def test_numbers_are_the_frozen_ones(name):
    rows = Room(name).compared()
    wrong = sorted((row for row in rows if not row.agrees), key=lambda row: -row.off)
    assert not wrong, f"{len(wrong)} of {len(rows)} rows differ:\n" + "\n".join(map(str, wrong[:SHOWN]))


@pytest.mark.parametrize("name", ROOMS)
def test_rows_guard_what_they_hold(name):
    rows = Room(name).known.values()
    assert rows
    for row in rows:
        assert row.kind in TOLERANCES, row.name
        assert row.kind in ("count", "doubt") or row.tolerance <= GUARDED, row.name
        assert row.kind != "outcome" or row.tolerance == 0, row.name
