"""What README, the pages and docstrings say: examples run, links lead somewhere, names exist, letters and
words are those of the notation, numbers those of the records.
"""

import csv
import doctest
import json
import pkgutil
import re
import unicodedata
from configparser import ConfigParser
from importlib import import_module
from pathlib import Path
from xml.etree import ElementTree

import netgen.occ as occ
import ngsolve as ng
import numpy as np
import pytest

import microblock as mb
from cases.__main__ import cases
from microblock.fem import meshes3d
from microblock.model.results import PlainData
from tests.bodies import on_ground, quarter
from tests.choice import params

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
README = ROOT / "README.md"
PAGES = [
    README,
    ROOT / "CONTRIBUTING.md",
    *(page for page in sorted(DOCS.rglob("*.md")) if page.name != "description.md"),
    *sorted(DOCS.glob("tutorials/*.ipynb")),
]
REFERENCE = "".join(page.read_text() for page in sorted(DOCS.glob("reference/*.rst")))
SETUP = ConfigParser()
SETUP.read(ROOT / "setup.cfg")
# words that nobody but us has for what the field has words for
PRIVATE = (
    "scenes?|sinking|mattress|rungs?|ladders?|held|turned|judged?|refused|told|pulls|"
    "paper's way|clocked|GridContact|FittedContact"
)
METHODS = {  # rows of README's table, and the methods of the records
    "`Panels` on a `HalfPlane`": "half-plane",
    "`Cells` on a `HalfPlane`": "cells",
    "`Fitted` elements in a `Block`": "fitted fe",
    "uniform bilinear mesh, augmented Lagrangian": "AL, order 1",
}


def text(page):
    """What a page says; of a notebook its words and its code."""
    if page.suffix == ".ipynb":
        return "\n".join("".join(cell["source"]) for cell in json.loads(page.read_text())["cells"])
    return page.read_text()


def table(page):
    """{first cell: the other cells} of the rows of all tables of a page."""
    rows = re.findall(r"^\| (.+) \|$", text(page).replace("| |", "|  |"), re.M)
    return {row[0]: row[1:] for row in ([cell.strip() for cell in line.split("|")] for line in rows)}


@pytest.mark.parametrize(
    "page", [page for page in PAGES if "```python\n" in text(page)], ids=lambda page: page.stem
)
def test_examples_of_pages_run_and_print_what_the_page_says(page, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)  # some write files
    names = {}
    for block, printed in re.findall(
        r"```python\n(.*?)```(?:\n\n```text\n(.*?)```)?", page.read_text(), re.S
    ):
        assert ("assert" in block or printed) and block.count("\n") <= 40  # each says what it shows
        exec(compile(block, str(page), "exec"), names)
        assert capsys.readouterr().out == printed


def lower_levels():
    """Names below the top that have an example."""
    for room in ("model", "contact_solvers", "halfplane", "fem"):
        for _, name, _ in pkgutil.iter_modules(import_module(f"microblock.{room}").__path__):
            module = import_module(f"microblock.{room}.{name}")
            for attribute, value in vars(module).items():
                example = getattr(value, "__module__", "") == module.__name__ and ">>>" in (
                    value.__doc__ or ""
                )
                if example and attribute not in mb.__all__:
                    yield f"{room}.{name}.{attribute}"
    for kind in (mb.State, mb.LoadPath, mb.History, mb.Contact, PlainData):
        for name, method in vars(kind).items():
            if ">>>" in (method.__doc__ or "") and not name.startswith("_"):
                yield f"{kind.__module__.removeprefix('microblock.')}.{kind.__name__}.{name}"


@pytest.mark.parametrize("name", [*mb.__all__, *lower_levels()])
def test_example_of_a_name_runs(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    public = pkgutil.resolve_name(f"microblock.{name}")
    example = doctest.DocTestParser().get_doctest(public.__doc__, {"mb": mb, "np": np}, name, None, None)
    printed = []
    assert example.examples and not doctest.DocTestRunner().run(example, out=printed.append).failed, printed


def test_reference_lists_every_public_name():
    listed = re.findall(r"^\.\. auto(?:class|function):: microblock\.(\S+)$", REFERENCE, re.M)
    assert sorted(name for name in listed if "." not in name) == mb.__all__ and len(listed) == len({*listed})
    assert not {name for name in lower_levels() if name.split(".")[0] in ("contact_solvers", "fem")} - {
        *listed
    }
    assert (
        sorted(re.findall(r":(?:class|func):`~microblock\.(\w+)`", text(DOCS / "reference" / "index.rst")))
        == mb.__all__
    )


def test_links_names_and_words_of_pages():
    """Files and headings that links name, files, tests, cases and public names in code; no private words."""
    tests = "".join(path.read_text() for path in (ROOT / "tests").rglob("*.py"))
    folders = [ROOT, *(path.parent for path in (ROOT / "microblock").rglob("__init__.py"))]
    for page in PAGES:
        said = text(page)
        for target, anchor in re.findall(r"\]\(([^)#:]*)(?:#([^)]*))?\)", said):
            aim = (page.parent / target).resolve() if target else page
            assert aim.exists(), (page, target)
            headings = (
                [
                    re.sub(r"[^\w\- ]", "", title.lower())
                    for title in re.findall(r"^#+ (.*)$", text(aim), re.M)
                ]
                if anchor
                else ()
            )
            assert not anchor or anchor in [heading.replace(" ", "-") for heading in headings], (page, anchor)
        for file in re.findall(r"`((?:[\w*]+/)*[\w*]+\.py)`", said):
            assert any(list(folder.glob(file)) for folder in folders), (page, file)
        assert {*re.findall(r"python -m cases\s+([a-z]\w*)", said)} <= {*cases(), "speed", "limits"}, page
        assert all(f"def {name}(" in tests for name in re.findall(r"`(test_\w+)`", said)), page
        assert {*re.findall(r"\bmb\.(\w+)", said)} <= {*mb.__all__}, page
        plain = re.sub(r"```.*?```|`[^`\n]*`", "", said, flags=re.S)
        assert not re.findall(rf"\b(?:{PRIVATE})\b", plain, re.I), page


def folders_imported(folder):
    """Folders of the library from which the files of one import, at whatever place in a file."""
    module = ROOT / "microblock" / folder
    paths = module.glob("*.py") if module.is_dir() else [module.with_suffix(".py")]
    pattern = rf"^\s*from {'.' * (1 + module.is_dir())}(\w+)"
    return {name for path in paths for name in re.findall(pattern, path.read_text(), re.M)}


def test_the_architecture_page_draws_the_imports():
    """Its first table has each arrow between folders and no other; files that it names exist."""
    page = text(DOCS / "architecture.md")
    rows = re.findall(r"^\| `(\w+)` \| .* \| (.*) \|$", page.partition("## The way")[0], re.M)
    floors = [name for name, _ in rows]
    assert {path.name for path in (ROOT / "microblock").iterdir() if (path / "__init__.py").exists()} < {
        *floors
    }
    for name, below in rows:
        assert folders_imported(name) & {*floors} == {*re.findall(r"`(\w+)`", below)}, name
    for file in re.findall(r"\b((?:\w+/)+\w+\.py)\b", page):
        assert (ROOT / "microblock" / file).exists(), file


def test_the_workflow_runs_what_contributing_says():
    yaml = pytest.importorskip("yaml", reason="the extra `docs` brings it")
    jobs = yaml.safe_load((ROOT / ".github" / "workflows" / "ci.yml").read_text())["jobs"]
    commands = [step.get("run", "") for job in jobs.values() for step in job["steps"]]
    assert ".ci/run" in commands and any(".ci/site" in command for command in commands)
    classifiers = re.findall(r"Python :: (3\.\d+)", SETUP["metadata"]["classifiers"])
    assert jobs["tests"]["strategy"]["matrix"]["python"] == classifiers


def letters(latex):
    """Letters of an equation without indices, whatever their face."""
    translate = pytest.importorskip("docutils.utils.math.latex2mathml").tex2mathml
    root = ElementTree.fromstring(translate(latex.strip(), True).replace("&ApplyFunction;", ""))
    for node in root.iter():  # an index says of what, not what; an exponent is a quantity
        if node.tag.rpartition("}")[2] in ("msub", "munder", "msubsup", "munderover"):
            node.remove(node[1])
    texts = [node.text.strip() for node in root.iter() if node.tag.endswith("}mi") or node.tag == "mi"]
    # a bold letter is the same letter, but not ℓ; signs are no quantities
    plain = {letter for letter in texts if len(letter) == 1} - {*"∂Δd∞…"}
    return {letter if letter == "ℓ" else unicodedata.normalize("NFKC", letter) for letter in plain}


def test_every_letter_of_an_equation_is_in_the_notation_once_and_terms_are_in_order():
    first = re.findall(r"^\| (\$.*?) \|", text(DOCS / "notation.md"), re.M)
    rows = [set().union(*map(letters, re.findall(r"\$([^$]+)\$", row))) for row in first]
    defined = [letter for row in rows for letter in row]
    assert len(rows) > 50 and all(len(row) == 1 for row in rows) and len(defined) == len({*defined})
    for page in (*DOCS.glob("theory/*.md"), DOCS / "differences.md", DOCS / "notation.md"):
        plain = re.sub(r"^```.*?^```|`[^`\n]*`", "", text(page), flags=re.S | re.M)
        for latex in re.findall(r"\$\$?([^$]+)\$\$?", plain):
            assert not letters(latex) - {*defined}, (page, latex)
    assert letters(r"\mathbf{u}_1 = \frac{\ell}{2} \exp(-\mathrm{i} k x) + p_A^2") == set("uℓikxp")
    lines = re.findall(r"^- (.*)$", text(DOCS / "notation.md").partition("## Glossary")[2], re.M)
    terms = [re.sub(r"[^a-z0-9 ]", "", re.match(r"\*\*(.+?)\*\*: ", line)[1].lower()) for line in lines]
    assert terms == sorted({*terms}) and {"born", "vanished", "merged", "split", "full", "contact"} <= {
        *terms
    }


def test_speeds_of_readme_and_methods_are_those_of_the_records():
    """Each number to the digits that it has; a blank where no run came so far."""
    with (ROOT / "cases" / "benchmarks" / "results" / "speed.csv").open() as file:
        runs = [row for row in csv.DictReader(file) if row["error"]]

    def least(scene, method, most):
        """(seconds up to an error, least error) of a method."""
        runs_of_method = [row for row in runs if (row["scene"], row["method"]) == (scene, method)]
        seconds = [
            float(row["setup"]) + float(row["solve"]) for row in runs_of_method if float(row["error"]) <= most
        ]
        return min(seconds, default=np.inf), min(float(row["error"]) for row in runs_of_method)

    said = {method: table(README)[name] for name, method in METHODS.items()}
    values = [
        (
            *(least("microblock-0.25", method, most)[0] for most in (1e-2, 1e-4)),
            least("microblock-0.25", method, 1)[1],
        )
        for method in said
    ]
    values += [
        [least("classical", method, most)[0] for most in (1e-2, 1e-3)] for method in ("tamaas", "cells")
    ]
    sentence = re.search(
        r"In the classical limit tamaas.*?`Cells` take .*? s and .*? s", text(DOCS / "methods.md"), re.S
    )
    numbers = re.findall(r"([\d.]+) s", sentence[0])
    pages = [*said.values(), numbers[:2], numbers[2:]]
    for value, number in zip(
        np.concatenate(values), (cell.removesuffix(" s") or "inf" for row in pages for cell in row)
    ):
        digits = len(number.partition("e")[0].replace(".", "").lstrip("0"))
        assert f"{value:.{digits}g}" == f"{float(number):.{digits}g}", pages
    asked = [
        float(row["error"]) / float(row["rtol"])
        for row in runs
        if row["rtol"] and row["method"] in ("half-plane", "fitted fe")
    ]
    assert f"In all {len(asked)} benchmark runs with a tolerance" in " ".join(text(README).split())
    assert f"at most {max(asked):.2g} times the tolerance" in text(README)


def test_what_travels():
    """One version, extras that messages name, a description without links to files, no cases in the wheel."""
    sources = "".join(path.read_text() for path in (ROOT / "microblock").rglob("*.py"))
    named = {*re.findall(r'MissingExtra\(.*, "(\w+)"\)', sources)}
    assert {"vtk", "xarray"} < named <= {*SETUP["options.extras_require"]}
    headings = re.findall(r"\n## \[(.*)\]", (ROOT / "CHANGELOG.md").read_text())
    released = [heading for heading in headings if heading != "Unreleased"]
    assert (headings[0] == "Unreleased") == mb.__version__.endswith(".dev0")
    # one that is not released is later than all that are
    assert (mb.__version__ not in released) == mb.__version__.endswith(".dev0")
    numbers = [[*map(int, words.split(".")[:3])] for words in (mb.__version__, *released)]
    assert numbers[0] == max(numbers)
    assert f"\nversion: {released[0]}\n" in (ROOT / "CITATION.cff").read_text()
    assert not re.findall(r"\]\((?!https?://)", (DOCS / "description.md").read_text())
    assert SETUP["options.packages.find"]["include"].split() == ["microblock", "microblock.*"]
    assert len(text(README).splitlines()) <= 100


SOLID = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.2)
LINE = mb.Contact(mb.HalfPlane(SOLID), mb.Cylinder(R=10), mb.Microblock())
SPACE = mb.Contact(mb.HalfSpace(SOLID), mb.Sphere(R=10), mb.Microblock(), mb.Cells(nodes=32))
WAVE = mb.Contact(mb.HalfPlane(SOLID, period=1.0), mb.Wave(0.01, 1.0), mb.Microblock(), mb.Cells(nodes=64))


def mesh():
    return LINE.with_(body=on_ground(SOLID, 0.2, 2, reach=0.8))


def block():
    return mb.Contact(quarter(SOLID, 0.2, 2.0), mb.Sphere(R=10), mb.Microblock())


def above():
    """A body over the first one, its contact boundary below."""
    face = occ.MoveTo(-3, 0).Rectangle(6, 2).Face()
    face.edges.Max(occ.Y).name = "back"
    face.edges.Min(occ.Y).name = "contact"
    return mb.Body(ng.Mesh(occ.OCCGeometry(face, dim=2).GenerateMesh(maxh=0.4)), SOLID, 2, fixed="back")


def above_in_space():
    x = meshes3d.graded(reach=0.6, step=0.2, far=2.0, growth=2.0)
    fixed = meshes3d.supports("contact", x1="left", x2="front")
    return mb.Body(meshes3d.block(x, x, x), SOLID, 1, fixed=fixed, contact="bottom")


SECOND = {  # a deformable body on top, for the body of each column of README's table
    "half-plane": lambda: mb.HalfPlane(SOLID),
    "mesh in the plane": above,
    "half-space": lambda: mb.HalfSpace(SOLID),
    "mesh in space": lambda: above_in_space(),
}
BODIES = dict(zip(SECOND, (lambda: LINE, mesh, lambda: SPACE, block)))
FEATURES = {  # rows of that table: what a problem of the column must do, or refuse
    "tolerance `rtol`, error estimate": lambda problem, _: mb.Contact(
        problem.body, problem.obstacle, problem.law
    ).solve(load=0.3, rtol=0.3),
    "load path with its events": lambda problem, _: problem.path(load=0.1),
    "prescribed approach": lambda problem, _: (WAVE if problem is LINE else problem).solve(approach=0.005),
    "rotated blocks, `psi0`": lambda problem, _: problem.with_(law=mb.Microblock(psi0=0.001)).solve(load=0.3),
    "Coulomb friction, histories": lambda problem, _: problem.with_(law=mb.Unilateral(friction=0.3)).history(
        [(0.3, 0.0), (0.3, 0.03)]
    ),
    "second elastic body": lambda problem, second: problem.with_(
        obstacle=mb.Deformable(second(), problem.obstacle)
    ).solve(load=0.3),
    "fields below the surface": lambda problem, _: problem.solve(load=0.3).fields,
}


CELLS = {(feature, column): {feature, column} for feature in FEATURES for column in BODIES}


@pytest.mark.parametrize("feature, column", params(CELLS))
def test_a_body_can_do_what_readme_says(feature, column):
    """ "yes" computes, "no" raises BadArgument or has no such attribute; a half-plane has an approach with a
    period alone. Each row and each column of the table has a cell here, and the others with `-m nightly`.
    """
    said = dict(zip(table(README)["feature"], table(README)[feature]))[column]
    if said == "no":
        with pytest.raises((mb.BadArgument, AttributeError)):
            FEATURES[feature](BODIES[column](), SECOND[column])
    else:
        assert said in ("yes", "with a period")
        assert FEATURES[feature](BODIES[column](), SECOND[column]) is not None
    with pytest.raises(mb.BadArgument, match="arbitrary"):
        LINE.solve(approach=0.01)
