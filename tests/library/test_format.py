"""One formatter and one linter for all of the code: those of .pre-commit-config.yaml."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FOLDERS = "microblock", "cases", "tests", "docs"


@pytest.mark.parametrize("words", [("check",), ("format", "--check")], ids=" ".join)
def test_ruff_finds_nothing(words):
    done = subprocess.run(
        [sys.executable, "-m", "ruff", *words, "--no-cache", *FOLDERS],
        cwd=ROOT,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_ruff_would_find_something(tmp_path):
    file = tmp_path / "unused.py"
    file.write_text("import os\n")
    config = f"--config={ROOT / 'pyproject.toml'}"
    done = subprocess.run(
        [sys.executable, "-m", "ruff", "check", config, "--no-cache", str(file)],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 1 and "F401" in done.stdout


def test_pre_commit_runs_the_ruff_of_the_tests():
    """Another version would format otherwise."""
    hooks, setup = ((ROOT / name).read_text() for name in (".pre-commit-config.yaml", "setup.cfg"))
    assert "rev: v0.17.6" in hooks and "ruff ==0.17.6" in setup
