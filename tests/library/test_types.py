"""The type hints are those of the program: mypy agrees, and a program that uses the library sees them."""

import subprocess
import sys
from pathlib import Path

import pytest

import microblock as mb

TOP = Path(mb.__file__).parents[1]
PROGRAM = """
import microblock as mb

solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.085)
problem = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Microblock())
state = problem.solve(load=1.0, rtol=1e-4)
reveal_type(state.zones)
reveal_type(problem.path(1.0).events)
for body in (mb.Block(solid, 10.0), mb.HalfPlane(solid, period=1.0)):
    mb.Contact(body, lambda x: x**2, mb.Unilateral(), mb.Cells())
problem.solve(load="1.0")
mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), "microblock")
"""


def mypy(folder, *arguments):
    pytest.importorskip("mypy")
    options = ["--config-file", TOP / "setup.cfg", "--cache-dir", folder / "cache"]
    command = [sys.executable, "-m", "mypy", *options, *arguments]
    return subprocess.run(command, cwd=TOP, capture_output=True, text=True)


@pytest.mark.slow
def test_mypy_passes_and_programs_see_the_types(tmp_path):
    """Both on one cache: most of the time goes to numpy and matplotlib."""
    whole = mypy(tmp_path, "microblock")
    assert whole.returncode == 0, whole.stdout
    program = tmp_path / "program.py"
    program.write_text(PROGRAM)
    seen = mypy(tmp_path, program).stdout
    assert "dict[str, list[tuple[float, float]]]" in seen
    assert "Sequence[microblock.model.events.Event]" in seen
    wrong = [line for line in seen.splitlines() if ": error:" in line]
    assert len(wrong) == 2 and "[arg-type]" in wrong[0] and "[arg-type]" in wrong[1], seen


def test_names_for_mypy_are_the_public_ones():
    stub = (TOP / "microblock" / "__init__.pyi").read_text()
    assert {line.split()[-1] for line in stub.splitlines() if line.startswith("from")} == set(mb.__all__)
