"""The names for type checkers are the public ones; `.ci/lint` runs mypy, on tests/typed_program.py too."""

from pathlib import Path

import microblock as mb


def test_names_for_mypy_are_the_public_ones():
    stub = (Path(mb.__file__).parent / "__init__.pyi").read_text()
    assert {line.split()[-1] for line in stub.splitlines() if line.startswith("from")} == set(mb.__all__)
