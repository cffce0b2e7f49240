"""What the default number of BLAS threads does to calls of the library, beside one thread.

Geometry   a cylinder on a half-plane, on squares and on a block, as a user of the library would ask for it.
Equations  those of `hertz`.
Model      each method once, from scene to state; two processes, one started as a user starts Python, one with
           OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1, take turns call by call, so that what else the machine does meets both.
Reference  none: the ratio of the fastest calls; `microblock.threads` is what keeps it near 1.
Look at    `ratio`, 1.15 at most; `uniform 0.01`, with large dense matrices, may be below 1.
Units      milliseconds by the clock on the wall, the best of some repetitions.
"""

import json
import os
import subprocess
import sys
import time
from dataclasses import dataclass

from tqdm import tqdm

from cases.options import command, option
from cases.records import keep, returned
from microblock import plots
from microblock.errors import BadArgument, NotConverged

ONE = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
WORKER = "from cases.threads import serve; serve()"
LOAD = 1.0


@dataclass(frozen=True)
class Parameters:
    only: tuple = option((), "calls whose names begin with one of these words (all without it)", str, nargs="+", metavar="WORD")
    repeats: int = option(5, "repetitions, of which the fastest counts", int)

    def __post_init__(self):
        if not 1 <= self.repeats <= 100:
            raise BadArgument("repeats", self.repeats, "must lie between 1 and 100")
        for word in self.only:
            if not any(name.startswith(word) for name in NAMES):
                raise BadArgument("only", word, f"begins none of {', '.join(NAMES)}")


NAMES = ("half-plane 1e-3", "half-plane 1e-6", "half-plane path", "fitted 1e-3", "fitted 1e-4", "fitted 1e-5", "cells 1e-2",
         "cells 16384", "uniform 0.05", "uniform 0.01", "body", "body 1e-2", "body path", "newton")


def calls():
    """{name: call} of all methods."""
    import microblock as mb      # here: in the worker, whose environment it reads
    from microblock import meshes
    solid, obstacle, law = mb.Cosserat(E=100, nu=0.3, ell=0.085, beta=1), mb.Cylinder(R=10), mb.Microblock()
    plane = mb.HalfPlane(solid)

    def body(side=0.2, order=3):
        mesh = meshes.uniform(mb.Ground(far=4.0, reach=(-1.0, 1.0), half=False), side)
        return mb.Body(mesh, solid, order, fixed="bottom")

    def uniform(side):
        return mb.UniformContact(solid, obstacle, law, domain=4.0, h=side, reach=0.8).states([LOAD/2, LOAD])

    def newton():
        coarse = body(0.25, 2)
        return mb.Newton(coarse, mb.ContactFacets(coarse, law, obstacle), control="load").solve(LOAD)

    line, fitted = mb.Contact(plane, obstacle, law), mb.FittedContact(solid, obstacle, law)
    works = (lambda: line.at(LOAD, 1e-3), lambda: line.at(LOAD, 1e-6), lambda: line.load(LOAD).events,
             lambda: fitted.at(LOAD, 1e-3), lambda: fitted.at(LOAD, 1e-4), lambda: fitted.at(LOAD, 1e-5),
             lambda: mb.GridContact(plane, obstacle, law, window=(-1, 1)).at(LOAD, rtol=1e-2),
             lambda: mb.GridContact(plane, obstacle, law, window=(-1, 1)).at(LOAD, nodes=16384),
             lambda: uniform(0.05), lambda: uniform(0.01), lambda: mb.BodyContact(body(), obstacle, law).at(LOAD),
             lambda: mb.BodyContact(body(), obstacle, law).at(LOAD, 1e-2),
             lambda: mb.BodyContact(body(), obstacle, law).load(LOAD).events, newton)
    return dict(zip(NAMES, works, strict=True))


def serve():
    """A worker: for each name read, a line with the seconds that its call took."""
    answer, sys.stdout = sys.stdout, sys.stderr
    known = calls()
    for line in sys.stdin:
        start = time.perf_counter()
        known[line.strip()]()
        print(json.dumps(time.perf_counter() - start), file=answer, flush=True)


class _Worker:
    """A process with these variables in its environment, and no other word on threads."""

    def __init__(self, variables):
        rest = {name: value for name, value in os.environ.items() if not name.endswith("_NUM_THREADS")}
        environment = {**rest, **variables, "PYTHONPATH": os.pathsep.join(filter(None, sys.path + [os.getcwd()]))}
        self.process = subprocess.Popen([sys.executable, "-c", WORKER], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                        stderr=subprocess.DEVNULL, text=True, env=environment)

    def __call__(self, name):
        print(name, file=self.process.stdin, flush=True)
        line = self.process.stdout.readline()
        if not line:
            raise NotConverged(f"the process that timed {name} ended")
        return 1e3*json.loads(line)

    def close(self):
        self.process.stdin.close()
        self.process.wait()


def result(parameters, quiet=True):
    """The case's object: a row a call."""
    start = time.perf_counter()
    names = [name for name in NAMES if not parameters.only or any(name.startswith(word) for word in parameters.only)]
    workers, found = (_Worker({}), _Worker(ONE)), []
    try:
        for name in tqdm(names, disable=quiet, unit="call"):
            turns = [[worker(name) for worker in workers] for _ in range(parameters.repeats + 1)][1:]      # the first warms up
            default, one = (min(own) for own in zip(*turns))
            found.append({"call": name, "default": default, "one": one, "ratio": default/one})
    finally:
        for worker in workers:
            worker.close()
    return returned(parameters, start, cores=os.cpu_count(), runs=found)


def run(parameters, out=None, quiet=False):
    """Time, print a table, draw ratios into the folder `out`."""
    answer = result(parameters, quiet)
    if not quiet:
        print(f"{'call':>16}  {'default':>9}  {'one':>9}  ratio      (milliseconds; {answer['cores']} cores)")
        for row in answer["runs"]:
            print(f"{row['call']:>16}  {row['default']:9.1f}  {row['one']:9.1f}  {row['ratio']:.2f}")
    if out:
        keep(out, "threads", [{"command": command("threads", parameters), **row} for row in answer["runs"]], figure)
    return answer


def figure(records):
    """What the default number of threads costs: time over that with one thread, call by call."""
    drawing, axis = plots.figure(1, 1)
    axis.barh([row["call"] for row in records], [row["ratio"] for row in records], color=plots.COLOURS[0])
    axis.axvline(1.0, color="black", linewidth=0.8)
    axis.set(xlabel="time with default threads over that with one thread")
    return drawing
