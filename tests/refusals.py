"""Refusals: what every argument of the public names does with bad values, one row each in refusals.csv.

`python -m tests.refusals` makes every row again and prints those that differ, `--write` writes them. The
tests make those again that take no time, and a share of the others (`few`), but all with `-m nightly`. A row
has the callable, the argument and the value as expressions of the names below (of a command its words), the
type of the error that the call raises, the argument that the error names, and words that its message must
have. Of several arguments at once the names and the values are separated by commas. Rows are made by program,
of each argument by what it is (KINDS, NAMED) and of each option of a command of the contract by its type; a
row that is written into the file by hand, its error empty, stays there and gets its error from `--write`.
"""

import csv
import inspect
import math
import os
import re
import sys
import warnings
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from decimal import Decimal
from functools import cache
from importlib import import_module
from io import StringIO
from pathlib import Path
from shutil import rmtree
from tempfile import TemporaryDirectory
from types import SimpleNamespace
from unittest.mock import Mock, patch

import ngsolve as ng
import numpy as np
from ngsolve.meshes import MakeStructured3DMesh
from scipy.interpolate import CubicSpline

import cases.__main__ as commands
import microblock as mb
from microblock.command import flag, options
from microblock.contact_solvers import active_set, projected_gradients
from microblock.fem import body, condensation, facets, friction, meshes, meshes3d, newton
from microblock.halfplane import kernels
from tests import choice

TABLE = Path(__file__).with_name("refusals.csv")
COMMAND = "python -m cases "
# commands of the contract, with what they need, or what makes them quick
CONTRACT = (
    "contact --height x**2/20",
    "hertz --loads 1",
    "lattice",
    "layers --alphas 0.5 --positions 0.3",
    "size_effect --alphas 0.5",
    "sphere --cells 32",
    "strip",
    "tangential --shear 0 --rtol 0.3",
)

SOLID = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)
OTHER = mb.Cosserat(E=60, nu=0.2, ell=0.2, beta=0.7)
GRADED = mb.Cosserat(E=ng.x - 1.5, nu=0.3, beta=1, ell=0.1)  # negative in part of the meshes
GROUND = mb.HalfPlane(SOLID)
CYLINDER = mb.Cylinder(R=10)
SPHERE = mb.Sphere(R=10)
LAW = mb.Microblock()
WAVE = mb.Wave(0.001, 1.0)
MESH = meshes.uniform(meshes.Ground(far=2.0, reach=(-1.0, 1.0), half=False), 1.0)
BODY = mb.Body(MESH, SOLID, order=1, fixed="bottom")
COLUMN, LINE = (
    mb.Body(mesh, SOLID, 1, fixed={"u1": "middle", "u2": "middle"}, periodic=mesh.dim == 2)
    for mesh in (meshes.column(1.0, 2), meshes.line(1.0, 4))
)
ABOVE, NARROW = (
    mb.Body(meshes.rectangles(x, [0.0, 1.0, 2.0]), SOLID, 1, fixed="top", contact="bottom")
    for x in (np.linspace(-2, 2, 5), np.linspace(-0.5, 0.5, 3))
)
GRADES = meshes3d.graded(reach=0.6, step=0.3, far=3.0, growth=2.0)
MESH3D = meshes3d.block(GRADES, GRADES, -GRADES[::-1], reach=0.6)
SPACE = mb.Body(MESH3D, SOLID, 1, fixed=meshes3d.supports("bottom", x1="left", x2="front"))
PROBLEMS = {
    "panels": mb.Contact(GROUND, CYLINDER, LAW),
    "cells": mb.Contact(GROUND, CYLINDER, LAW, mb.Cells(nodes=64, window=(-1, 1))),
    "period": mb.Contact(mb.HalfPlane(SOLID, 1.0), WAVE, LAW, mb.Cells(nodes=64)),
    "fitted": mb.Contact(mb.Block(SOLID, 4.0), CYLINDER, LAW, mb.Fitted(order=2)),
    "uniform": mb.Contact(mb.Block(SOLID, 4.0), CYLINDER, LAW, mb.Uniform(h=0.2)),
    "condensed": mb.Contact(BODY, CYLINDER, LAW),
    "newton": mb.Contact(BODY, CYLINDER, LAW, mb.Newton()),
    "half-space": mb.Contact(mb.HalfSpace(SOLID), SPHERE, LAW, mb.Cells(nodes=32)),
    "space": mb.Contact(SPACE, SPHERE, LAW),
    "rubbed": mb.Contact(GROUND, CYLINDER, mb.Unilateral(friction=0.3)),
    "rubbed body": mb.Contact(BODY, CYLINDER, mb.Unilateral(friction=0.3)),
}


@contextmanager
def chdir(folder):  # as of contextlib from Python 3.11 on
    before = os.getcwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)


FACETS = facets.ContactFacets(BODY, LAW, CYLINDER)
NEWTON = newton.MonolithicNewton(FACETS, control="load")


def HILLS(x1, x2):
    return -0.01 * (np.cos(2 * np.pi * x1) + np.cos(2 * np.pi * x2))


@cache
def state(kind):
    if kind.startswith("rubbed"):
        return history(kind).states[-1]
    return PROBLEMS[kind].solve(load=0.1)


@cache
def path(kind):
    return PROBLEMS[kind].path(load=0.1)


@cache
def history(kind):
    return PROBLEMS[kind].history([(1.0, 0.0), (1.0, 0.1)], rtol=None if "body" in kind else 0.2)


@cache
def identified():
    return mb.identify(PROBLEMS["panels"], {"load": [0.1, 0.2], "half_width": [0.13, 0.17]}, ("E",))


def pressed(body=GROUND, obstacle=CYLINDER, law=LAW, method=None, load=0.1):
    return mb.Contact(body, obstacle, law, method).solve(load)


def raising(failure):
    """A function of places that raises this."""
    return Mock(spec=lambda x: x, side_effect=failure, __name__="height")  # and no other attribute


# calls that solve a problem of their own, if the bad value does not stop them
LONG = ("pressed", "Contact(", "identif")

# of expressions: what is above, and these
NAMES = {
    **globals(),
    **{name: getattr(mb, name) for name in mb.__all__},
    **{helper.__name__: helper for helper in (Decimal, CubicSpline, SimpleNamespace, ThreadPoolExecutor)},
    "MakeStructured3DMesh": MakeStructured3DMesh,
    "active_set": active_set,
    "friction": friction,
    "kernels": kernels,
    "projected_gradients": projected_gradients,
    "Loads": body.Loads,
    "Loads3D": body.Loads,  # and bodies, in space
    "Body3D": mb.Body,
    "Condensation": condensation.CondensedNodes,
    "ContactFacets": facets.ContactFacets,
    "MonolithicNewton": newton.MonolithicNewton,
    "nan": math.nan,
    "inf": math.inf,
}

# bad values by what an argument is; expressions are separated by blanks and have none
NUMBER = "None True '1' nan inf -inf 1j [] [1.0] np.ones(2) object() 10**400 Decimal('0.5')"
KINDS = {
    "number": f"{NUMBER} 1e300",
    "positive": f"{NUMBER} -1 0 1e300 1e-300",
    "not negative": f"{NUMBER} -1 1e300",
    "whole": f"{NUMBER} -1 0 1.5",
    "tolerance": f"{NUMBER} -1 0 1 2.0",
    "flag": "None 'x' nan -1 0 [] object() np.ones(2)",
    "word": "None 'x' '' -1 True [] object() np.array('x')",
    "pair": "None 'x' 1 nan [] (1,2,3) (1,0) (0,0) (nan,1) (0,inf) (None,1) object()",
    "array": "None True '1' 'x' nan [inf] 1j [[1.0]] object() 10**400 1e300",
    "place": "None -1 nan [] object() b'x' '' 'no/where' 'x.foo' '/proc/x.png' 'a\\0b' '.'",
    "part": "None 'x' -1 nan [] object() int SOLID GROUND CYLINDER SPHERE LAW BODY MESH",
    "function": "None 'x' -1 nan [] object() SOLID",
    "drawn": "-1 'x.foo' '/proc/x.png'",  # which is found after the drawing
    "pairs": "None 'x' 1 [] [1] [(1,)] [(1,0,0,0)] [(1,'x')] [(nan,0)] [(inf,0)] [(-1,0)] [(0,0)] [(1,9)]",
    # words for an option of a command, by the type of its values
    float: "nan inf x -1 0 1e300 1e-300",
    int: "1.5 x -1 0",
    str: "x",
    bool: "x",
    "angle": f"{NUMBER} 1.6 -1.6 (0.1,) (0.1,None) (0.1,1.6) SOLID",
}
FEW = "None '1' 'x' nan -1 0 2.0 (1,0) (1,9) SOLID CYLINDER SPHERE 10**400"
# which arguments are of a kind, by their names, or by callable and name where that differs
NAMED = {
    "positive": (
        "E ell side stiffness curvature R P R1 R2 half_width amplitude wavelength slope size period load "
        "approach residual spacing rho h reach far depth step growth width noise rms_slope rms_height "
        "identify.sigma"
    ),
    "number": "nu tilt level alpha_prime beta_prime x load_error Event.shear",
    "not negative": "beta eta mu_c friction hurst",
    "whole": "order order_psi nodes workers accuracy seed elements Event.pair plateau roll_off cut_off",
    "flag": "couples periodic even progress coupled quiet fill",
    "word": "face psi0_in kind zone shape rule contact corner boundary field direction control detrend unit "
    "quantity Contact.solve.accuracy Contact.states.accuracy Contact.plan.accuracy State.sensitivity.modulus",
    "pair": "window waves",
    "array": (
        "x1 x2 z points kinks jumps lines Obstacle.from_samples.x State.pressure_at.x State.gap_at.x "
        "State.micromoment_at.x State.shear_traction_at.x "
        "State.counter_displacement.x"
    ),
    "place": "path records file",
    "part": (
        "solid body obstacle law method mesh newton initial problem state what executor "
        "loads start facets ax Deformable.shape identify.data identify.free"
    ),
    "function": "height function over fixed prescribed",
    "tolerance": "rtol identify.level",
    "pairs": "pairs",
    "angle": "psi0",
    "drawn": (
        "State.plot.file State.plot_blocks.file State.plot_below.file History.plot.file LoadPath.plot.file "
        "Identification.plot.file "
    ),
}
ARGUMENTS = {name: kind for kind, names in NAMED.items() for name in names.split()}
# callables of the public names, with the arguments of a call that does: {expression: its arguments}
CALLS = {
    **dict.fromkeys(("HalfPlane", "HalfSpace", "Block"), "solid=SOLID"),
    "Body": "mesh=MESH, solid=SOLID",
    "Body3D": "mesh=MESH3D, solid=SOLID",
    **dict.fromkeys(("BODY.solve", "SPACE.solve"), ""),
    "BODY.on": "mesh=MESH",
    "BODY.boundary": "pattern='contact'",
    **dict.fromkeys(
        ("GROUND.of", "HalfSpace(SOLID).of", "Block(SOLID).of", "BODY.of", "SPACE.of"), "solid=SOLID"
    ),
    "Cosserat": "E=100, nu=0.3, ell=0.1, beta=1",
    "Elastic": "E=100, nu=0.3",
    "Cosserat.of_blocks": "side=1.0, stiffness=1.0",
    "hertz_scales": "solid=SOLID, R=1.0, P=1.0",
    "Plane": "",
    "Cylinder": "R=1.0",
    "Wedge": "slope=0.1",
    "Punch": "half_width=1.0",
    "Wave": "amplitude=0.1, wavelength=1.0",
    "Rough": "period=1.0, slope=0.1",
    "Rough.from_heights": "z=[0, 1], spacing=1.0",
    "Rough.from_spectrum": "period=1.0, rms_slope=0.1",
    "Obstacle": "height=np.square",
    "Obstacle.from_samples": "x=[0, 1], z=[0, 1]",
    "Sphere": "R=1.0",
    "Ellipsoid": "R1=1.0, R2=1.0",
    "Cone": "slope=0.1",
    "FlatPunch": "half_width=1.0",
    "RoughSurface": "period=1.0, slope=0.1",
    "RoughSurface.from_heights": "z=np.eye(3), spacing=1.0",
    "RoughSurface.from_file": "file='x'",
    "RoughSurface.from_spectrum": "period=1.0, rms_slope=0.1",
    "Deformable": "body=GROUND, shape=CYLINDER",
    **dict.fromkeys(("Microblock", "Unilateral", "Microclamped"), ""),
    **dict.fromkeys(("Panels", "Cells", "Condensed", "Newton"), ""),
    "Fitted": "order=4",
    "Uniform": "h=1.0",
    "Contact": "body=GROUND, obstacle=CYLINDER, law=LAW",
    **{f"PROBLEMS['{kind}'].solve": "load=0.1" for kind in PROBLEMS if not kind.startswith("rubbed")},
    "PROBLEMS['panels'].states": "loads=[0.1]",
    "PROBLEMS['panels'].plan": "load=0.1",
    **{f"PROBLEMS['{kind}'].path": "load=0.1" for kind in ("panels", "fitted", "condensed")},
    **{f"PROBLEMS['{kind}'].history": "pairs=[(1, 0)]" for kind in ("rubbed", "rubbed body")},
    **{f"PROBLEMS['{kind}'].with_": "" for kind in ("panels", "condensed", "half-space", "space")},
    **{f"path('{kind}').at": "load=0.1" for kind in ("panels", "fitted", "condensed")},
    "path('condensed').depths": "loads=[0.1]",
    **{
        f"state('{kind}').pressure_at": "x=0.0"
        for kind in ("panels", "cells", "fitted", "condensed", "rubbed")
    },
    **{f"state('{kind}').gap_at": "corner='A', x=0.0" for kind in ("panels", "cells", "fitted", "condensed")},
    **{f"state('{kind}').counter_displacement": "x=0.0" for kind in ("panels", "cells", "condensed")},
    **{f"state('{kind}').surface": "" for kind in ("panels", "condensed")},
    "state('half-space').pressure_at": "x=np.zeros((1, 2))",
    "state('panels').micromoment_at": "x=0.0",
    "state('rubbed').shear_traction_at": "x=0.0",
    "state('half-space').along": "direction='x1'",
    **{f"state('{kind}').sensitivity": "modulus='E'" for kind in ("panels", "half-space")},
    "identify": (
        "problem=PROBLEMS['panels'], data={'load': [0.1, 0.2], 'half_width': [0.13, 0.17]}, free=('E',)"
    ),
    "identified().plot": "",
    **{f"state('{kind}').plot": "" for kind in ("panels", "half-space", "space")},
    **{f"state('{kind}').plot_blocks": "" for kind in ("panels", "half-space")},
    **{f"state('{kind}').plot_below": "" for kind in ("panels", "condensed")},
    "state('condensed').reaction": "boundary='bottom'",
    "state('panels').fields": "x1=0.0, x2=-1.0",
    "state('panels').peak": "quantity='pressure'",
    "history('rubbed').plot": "",
    "path('panels').plot": "",
    "state('panels').save": "file='x'",
    "load": "file='x'",
    "to_csv": "what=state('panels'), path='x.csv'",
    "to_vtk": "state=state('panels'), path='x'",
    "sweep": "function=len, over=[], quiet=True",
    "explore": "problem=PROBLEMS['panels'], load=0.1",
    "Event": "load=0.1, load_error=0.0, kind='born', zone='A', x=0.0",
    # the documented level below
    "Loads": "",
    "Loads3D": "",
    "friction.FrictionFacets": "body=BODY, law=Unilateral(0.3), obstacle=CYLINDER",
    "Condensation": "body=BODY",
    "ContactFacets": "body=BODY, law=LAW, obstacle=CYLINDER",
    "MonolithicNewton": "facets=FACETS",
    "NEWTON.solve": "level=0.1",
    "active_set.solve": "matrix=np.eye(2), g0=np.zeros(2), load=1.0",
    "active_set.path": "matrix=np.eye(2), g0=np.zeros(2), load=1.0",
    "meshes.Ground": "far=10.0, reach=(-1.0, 1.0)",
    "meshes.line": "depth=1.0, elements=4",
    "meshes.column": "depth=1.0, elements=4",
    "meshes.uniform": "ground=meshes.Ground(far=2.0, reach=(-1.0, 1.0), half=False), h=1.0",
    "meshes3d.graded": "reach=1.0, step=0.1, far=2.0",
    "meshes3d.block": "x1=[0, 1], x2=[0, 1], x3=[-1, 0]",
}
# public callables without rows, or their arguments
LEFT_OUT = {
    name
    for names in (
        # takes fields of NGSolve, which checks them
        "BodySpaces.energy",
        # parts of solvers, which call them with what is checked
        "BodySpaces.boundary BodySpaces.scalar Body.bulk BodySpaces.unknowns_of BodySpaces.vectors "
        "BodySpaces.strains BodySpaces.integrated BodySpaces.once Body.on.changes State.noting "
        "BodySpaces.by_region BodySpaces.field_space BodySpaces.require_psi "
        "History.noting Cosserat.with_length Elastic.with_length Cosserat.at Elastic.at "
        "Cosserat.scaled Elastic.scaled "
        "HalfPlane.cells",
        # laws and obstacles, which solvers ask for places of theirs
        "Law.arms Law.initial_rotation Law.levers Law.places Microblock.angle "
        "Microblock.arms Microblock.initial_rotation Microblock.levers Microblock.places Unilateral.arms "
        "Unilateral.levers Unilateral.places Cone.height Cylinder.height Deformable.height Ellipsoid.height "
        "FlatPunch.height Plane.height Punch.height Rough.height RoughSurface.height Sphere.height "
        "Wave.height Wedge.height",
        # those of `from_heights`
        "HeightMap.from_file.options",
        # results, which the program makes, and errors, which it raises
        "State History LoadPath Identification",
        "MicroblockError BadArgument NotConverged MissingExtra Interrupted",
        # abstract: those of panels, fitted meshes and nodes have rows
        "LoadPath.at",
    )
    for name in names.split()
}


def evaluated(words):
    return eval(words, NAMES)


def outcome(call, argument, value):
    """(type of the error, the argument that it names, its message); "accepted" where there is none."""
    try:
        if call.startswith(COMMAND):
            return commanded([*call.removeprefix(COMMAND).split(), *argument.split(), *value.split()])
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            evaluated(call)(**arguments_of(call, argument, value))
    except mb.MicroblockError as failure:
        return type(failure).__name__, getattr(failure, "name", None) or "", str(failure)
    except Exception as failure:
        return f"raw {type(failure).__name__}", "", str(failure)
    return "accepted", "", ""


def arguments_of(call, argument, value):
    """Those of a call that does, with the bad ones in their places."""
    names = argument.split(", ") if argument else []
    usual = evaluated(f"dict({CALLS.get(call, '')})")
    instead = {"approach": "load", "eta": "beta", "mu_c": "beta"}  # of one argument stands another
    usual = {name: usual[name] for name in usual if name not in map(instead.get, names)}
    bad = evaluated(f"[{value}]") if len(names) != 1 else [evaluated(value)]
    return usual | dict(zip(names, bad, strict=True))


def commanded(words):
    """The outcome of a command line."""
    with redirect_stdout(StringIO()) as out, redirect_stderr(StringIO()) as err:
        try:
            status = commands.main(words)
        except SystemExit as stop:  # argparse's own way out
            status = stop.code
    line = err.getvalue().removesuffix("\n")
    named = re.search(r"(?<!\S)--[a-zA-Z][\w-]*(?=[ :=]|$)", line.partition(": ")[2])
    output = " with output" if out.getvalue() or not line.startswith(COMMAND.strip()) else ""
    return (f"status {status}{output}", named[0] if named else "", line) if status else ("accepted", "", "")


def wrong(call, name, message):
    """What is wrong with the form of a message: house rules that hold in every row."""
    if call.startswith(COMMAND):  # whose options may have many names
        return " in several lines" * ("\n" in message)
    return (
        " too long" * (len(message) > 300)  # a value and what a function said, 80 each, and what is allowed
        + " in several lines" * ("\n" in message)
        + " in another form" * (bool(name) and not message.startswith(f"{name} = "))
    )


def functions(public):
    """{qualified name: function} of a public name, and its public methods."""
    methods = inspect.getmembers(public, inspect.isfunction) if inspect.isclass(public) else []
    called = [public, *(method for name, method in methods if not name.startswith("_"))]
    return {function.__qualname__: function for function in called}


def arguments(call):
    """{argument: its default} of a callable."""
    return {
        name: entry.default for name, entry in inspect.signature(call).parameters.items() if name != "self"
    }


def whole(call, name):
    """An argument with the qualified name of its callable, of an object that is called that of its class."""
    return f"{getattr(call, '__qualname__', type(call).__qualname__)}.{name}"


def made():
    """(callable, argument, value) of the rows that are made by program: all values of what is called first by
    a name, of the same with other bodies and methods a few.
    """
    places = set()
    for call in CALLS:
        for name, default in arguments(evaluated(call)).items():
            place = whole(evaluated(call), name)
            kind = None if place in LEFT_OUT else ARGUMENTS.get(place, ARGUMENTS.get(name))
            for value in KINDS[kind].split() if kind else ():
                if not (value == "None" and default is None) and (
                    place not in places or value in FEW.split()
                ):
                    yield call, name, value
            places.add(place)
    for command in CONTRACT:
        for option in options(import_module(commands.cases()[command.split()[0]][0]).solve).values():
            for value in KINDS[option.kind].split():
                yield COMMAND + command, flag(option.name), value


def again(rows):
    """Rows made again, each in an empty folder; words that their message lacks are left out."""
    with (
        patch.object(commands, "cases", cache(commands.cases)),
        TemporaryDirectory() as folder,
        chdir(folder),
    ):
        for call, argument, value, *_, words in rows:
            error, named, message = outcome(call, argument, value)
            written = [*Path().iterdir()]
            if error != "accepted":
                error += " and writes" * bool(written) + wrong(call, named, message)
            for path in written:
                rmtree(path) if path.is_dir() else path.unlink()
            yield call, argument, value, error, named, words if words in message else ""


def uncovered(rows):
    """Arguments of the public names that no row gives a bad value."""
    called = {row[:2] for row in rows if row[0] in CALLS}
    covered = {whole(evaluated(call), name) for call, names in called for name in names.split(", ")}
    names = [*(getattr(mb, name) for name in mb.__all__)]
    public = {name: call for value in names for name, call in functions(value).items()}
    return sorted(
        f"{call}.{name}"
        for call, function in public.items()
        if call not in LEFT_OUT
        for name in arguments(function)
        if f"{call}.{name}" not in covered | LEFT_OUT
    )


def table():
    """The rows of the table."""
    with TABLE.open(newline="") as file:
        _, *rows = map(tuple, csv.reader(file))
    return rows


def few(rows):
    """Rows without most of those that take long: what is accepted, or solves a problem of its own before it
    is refused. Of these there is a tenth.
    """
    long = {
        " ".join(row[:3]): set()
        for row in rows
        if row[3] == "accepted" or (row[3] == "NotConverged" and row[0].startswith(LONG))
    }
    computed = choice.part(long)
    return [row for row in rows if " ".join(row[:3]) not in long.keys() - computed]


def differences(whole=True):
    """(rows as they are, those of them that differ and how): of the table, and of what the program makes."""
    before = table()
    keys = {row[:3] for row in before}
    rows = before + [(*row, "no row", "", "") for row in made() if row not in keys]
    if not whole:
        rows = few(rows)
    outcomes = list(again(rows))
    return outcomes, [
        " ".join(new[:3]) + f": {' '.join(old[3:])} -> {' '.join(new[3:])}"
        for old, new in zip(rows, outcomes)
        if old != new
    ]


if __name__ == "__main__":
    rows, differ = differences()
    print(*differ, f"{len(rows)} rows, {len(differ)} differ", sep="\n")
    if "--write" in sys.argv:
        with TABLE.open("w", newline="") as file:
            csv.writer(file, lineterminator="\n").writerows(
                [("callable", "argument", "value", "error", "named", "words"), *sorted(rows)]
            )
