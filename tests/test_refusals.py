"""Bad input gets one clear error that names the argument: of every argument of the public names."""

import pytest

from tests import refusals


@pytest.mark.slow
def test_every_argument_has_rows_and_every_row_is_as_it_was():
    """What differs is repaired, or rewritten on purpose by `python -m tests.refusals --write`."""
    rows, differ = refusals.differences()
    assert not differ, "\n".join(differ)
    assert not refusals.uncovered(rows)
