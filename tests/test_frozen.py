"""The numbers of the library are those of tests/frozen.csv."""

import pytest

from tests import frozen

SHOWN = 12  # rows that the failure names


@pytest.mark.slow
def test_numbers_are_the_frozen_ones():
    compared = frozen.compared()
    wrong = sorted((row for row in compared if not row.agrees), key=lambda row: -row.off)
    assert not wrong, f"{len(wrong)} of {len(compared)} rows differ:\n" + "\n".join(map(str, wrong[:SHOWN]))
