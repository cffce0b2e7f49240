import json
import os
import shlex
import signal

for library in ("OPENBLAS", "OMP"):  # before numpy and tamaas: threads stall small dense work
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    # a shell starts what runs in its background so, and some tests interrupt themselves
    signal.signal(signal.SIGINT, signal.default_int_handler)

import netgen.occ as occ  # noqa: E402
import ngsolve as ng  # noqa: E402
import pytest  # noqa: E402
from netgen.geom2d import SplineGeometry  # noqa: E402


def rectangle(width, height, maxh, quads=False):
    """Irregular mesh of [0, width] x [0, height] with boundaries left, right, bottom, top."""
    geometry = SplineGeometry()
    geometry.AddRectangle((0, 0), (width, height), bcs=("bottom", "right", "top", "left"))
    mesh = ng.Mesh(geometry.GenerateMesh(maxh=maxh, quad_dominated=quads))
    kinds = {element.type for element in mesh.Elements()}
    assert (ng.ET.QUAD in kinds) == quads
    return mesh


def dome(order=3, maxh=0.3, quads=False):
    """Half-disc above x2 = 0: curved "contact" on top, straight "base" below."""
    face = occ.WorkPlane().Circle(1.0).Face() * occ.WorkPlane().MoveTo(-2, 0).Rectangle(4, 2).Face()
    face.edges.name = "contact"
    face.edges.Min(occ.Y).name = "base"
    mesh = occ.OCCGeometry(face, dim=2).GenerateMesh(maxh=maxh, quad_dominated=quads)
    return ng.Mesh(mesh).Curve(order)


@pytest.fixture
def block():
    """A unit block of quadrilaterals with its contact boundary on top, at x2 = 0."""
    from ngsolve.meshes import MakeStructured2DMesh

    mesh = MakeStructured2DMesh(quads=True, nx=6, ny=3, mapping=lambda x, y: (2 * x - 1, y - 1))
    for number, name in enumerate(mesh.GetBoundaries()):
        mesh.ngmesh.SetBCName(number, {"top": "contact"}.get(name, name))
    return ng.Mesh(mesh.ngmesh)


def pytest_xdist_auto_num_workers(config):
    """At most four processes for `-n auto`: each takes about a gigabyte."""
    return min(4, len(os.sched_getaffinity(0)))


@pytest.fixture
def memory(monkeypatch):
    """memory(size): the machine has so many bytes left, and none are tried beyond them."""

    def left(size):
        monkeypatch.setattr("microblock.cost.available", lambda: size)
        monkeypatch.setattr("microblock.cost.LITTLE", 0)

    return left


@pytest.fixture
def forms(monkeypatch):
    """Bilinear forms that NGSolve makes, a list of their spaces: one for each body that is condensed."""
    spaces, form = [], ng.BilinearForm
    monkeypatch.setattr(ng, "BilinearForm", lambda space, **more: spaces.append(space) or form(space, **more))
    return spaces


def pytest_generate_tests(metafunc):
    """Tests marked nightly(count, *known) take a tenth of so many seeds, and known ones: those that a fault
    needed, or that a kind of problem has. With `-m nightly` they take all of them. An argument `seeds` is the
    list, `seed` one after the other. Without a count, the whole test is left to `-m nightly`.
    """
    for mark in metafunc.definition.iter_markers("nightly"):
        if not mark.args:
            continue
        count, *extra_seeds = mark.args
        few = sorted({*range(-(-count // 10)), *extra_seeds})
        seeds = (
            sorted({*range(count), *extra_seeds})
            if "nightly" in metafunc.config.getoption("-m").split()
            else few
        )
        if "seeds" in metafunc.fixturenames:
            metafunc.parametrize("seeds", [seeds], ids=[f"{len(seeds)}"])
        else:
            metafunc.parametrize("seed", seeds)


def pytest_collection_modifyitems(config, items):
    """Tests marked browser, site, or nightly without a count, run with `-m` and that name only. Slow ones
    begin: whichever is left to the end keeps one worker busy alone.
    """
    items.sort(key=lambda item: not item.get_closest_marker("slow"))
    for name in {"browser", "site", "nightly"} - {*config.getoption("-m").split()}:
        marked = [(item, item.get_closest_marker(name)) for item in items]
        left = [item for item, mark in marked if mark and not mark.args]
        config.hook.pytest_deselected(items=left)
        items[:] = [item for item in items if item not in left]


@pytest.fixture
def run(capsys):
    """A function of a command line: (exit status, standard output, standard error)."""
    from cases.__main__ import main

    def status_and_output(words):
        try:
            status = main(shlex.split(words))
        except SystemExit as stop:  # argparse's own way out
            status = stop.code
        return status, *capsys.readouterr()

    return status_and_output


@pytest.fixture
def answer(run):
    """A function of a command line: its JSON object, beside which nothing is printed."""

    def json_object(words):
        status, out, err = run(f"{words} --json -")
        assert status == 0 and all(line.startswith("warning: ") for line in err.splitlines())
        return json.loads(out, parse_constant=lambda word: pytest.fail(f"{word} in the JSON"))

    return json_object
