"""What travels: packages, data, extras that messages name, one version."""

import re
from configparser import ConfigParser
from pathlib import Path

import microblock as mb

ROOT = Path(__file__).parents[2]
SETUP = ConfigParser()
SETUP.read(ROOT / "setup.cfg")


def listed(section, name):
    return SETUP[section][name].split()


def test_every_folder_of_code_is_a_package_of_the_wheel():
    """`cases` travels as microblock.cases, so that the wheel has one name at the top."""
    own = {".".join(path.parent.relative_to(ROOT).parts) for path in ROOT.glob("microblock/**/__init__.py")}
    cases = {".".join(path.parent.relative_to(ROOT).parts) for path in ROOT.glob("cases/**/__init__.py")}
    assert set(listed("options", "packages")) == own | {f"microblock.{name}" for name in cases}


def test_files_that_are_no_code_travel_too():
    """A file in a folder of code that no pattern of package_data names would stay behind."""
    patterns = {"microblock": "microblock", "microblock.cases": "cases"}
    carried = {
        path
        for package, folder in patterns.items()
        for pattern in re.split(r"[,\s]+", SETUP["options.package_data"][package].strip())
        for path in (ROOT / folder).glob(pattern)
        if path.suffix != ".py"
    }
    there = {
        path
        for folder in patterns.values()
        for path in (ROOT / folder).rglob("*")
        if path.is_file() and path.suffix not in (".py", ".pyc")
    }
    assert there == carried


def test_extras_of_messages_exist():
    extras = set(SETUP["options.extras_require"])
    used = set()
    for path in [*ROOT.glob("microblock/**/*.py"), *ROOT.glob("cases/**/*.py")]:
        used |= set(re.findall(r'MissingExtra\([^)]*"(\w+)"\)', path.read_text()))
    assert used and used <= extras


def test_one_version_everywhere():
    log = (ROOT / "CHANGELOG.md").read_text().splitlines()
    changes = next(line for line in log if line.startswith("## "))
    assert changes.split()[1].rstrip(",") == mb.__version__
    assert f"\nversion: {mb.__version__}\n" in (ROOT / "CITATION.cff").read_text()


def test_the_long_description_has_no_link_that_breaks_elsewhere():
    """A package index shows it without the files beside it."""
    text = (ROOT / SETUP["metadata"]["long_description"].removeprefix("file:").strip()).read_text()
    assert not re.findall(r"\]\((?!https?://)", text)


def test_pythons_of_the_classifiers_begin_with_the_one_required():
    versions = re.findall(r"Python :: 3\.(\d+)", SETUP["metadata"]["classifiers"])
    assert min(map(int, versions)) == int(SETUP["options"]["python_requires"].rpartition(".")[2])


def test_pre_commit_runs_the_ruff_of_the_extra():
    """Another version would format otherwise."""
    hooks = (ROOT / ".pre-commit-config.yaml").read_text()
    assert "rev: v" + re.search(r"ruff ==(\S+)", SETUP["options.extras_require"]["test"])[1] in hooks
