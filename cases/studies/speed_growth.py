"""How time and memory grow with the problem, up to 10^6 unknowns; a part of the study `speed`.

Each run is a process of its own: imports, a warm-up on the first level, then the run. Seconds are those of
the processor; what is quick is repeated, and the best counts. Memory is the peak of the resident set during
the first run over what was resident before it. The floor is one factorisation, by the fastest solver for it
that was found, of the matrix that the method factorises; for a dense method one dense solve, for one without
a matrix one product with the flexibility.
"""

import json
import math
import os
import subprocess
import sys
from collections.abc import Callable
from cProfile import Profile
from dataclasses import dataclass
from pathlib import Path
from pstats import Stats

import numpy as np

from microblock.data.records import grouped

from ..common.records import print_table
from .speed_methods import METHODS, PAPER_DOMAIN, REACH, Answer, clock, levels, nodes_of, on_cells, on_squares
from .speed_scenes import LOAD, SCENES

SCENE = "microblock-0.25"
WINDOW = 1.5  # of the cells, over a_Hz: a little more than the contact
LONGEST = 190.0  # seconds that a run may be expected to take
# exponents over unknowns for that expectation; factors in the plane
STEEPEST = {"seconds": 1.4, "megabytes": 1.25}
SPARE = 0.7  # share of the free memory that a run may be expected to take
OVERDUE = 3600.0  # wall seconds after which a run has failed
REPEATS, QUICKLY = 3, 1.0  # of runs that take less than so many seconds
QUICK = {"condensed, order 1": 2}  # levels of the short form
DECADE = 10.0
# below it the clock or the allocator's reserves are what is seen
TOLD = {"seconds": 1e-4, "megabytes": 2.0}
# where the time goes: the functions whose cumulative time makes each phase, by what the profile calls them
PHASES = {
    "mesh": ("uniform",),
    "assembly": ("_assemble", "assemble of newton"),
    "residual": ("_look of newton",),
    "factor": ("_factorise of condensation", "_factorise of newton"),
    "condensation": ("_matrix of condensation",),
    "states": ("solve of active_set", "solve of projected_gradients"),
    "tables": ("kernels", "prepare of cell_solver"),
}
FILES = {"uniform": "meshes", "_assemble": "condensation", "kernels": "kernels"}
SETTINGS = ("h", "order", "solver", "domain", "nodes", "rtol")
MEASURED = (
    "unknowns",
    "contact_nodes",
    "setup",
    "solve",
    "seconds",
    "iterations",
    "megabytes",
    "before",
    "floor",
    "distance",
    *(f"share_{phase}" for phase in PHASES),
)
SIZES = ("unknowns", "contact_nodes")
COSTS = ("seconds", "megabytes")
THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS")


@dataclass(frozen=True)
class Family:
    """A method that grows, its settings from the smallest on.

    `run(**setting)` gives an Answer and what it was prepared with; of that `floor` makes the work that is the
    floor.
    """

    name: str
    run: Callable
    floor: Callable
    settings: tuple


def bulk(h, order=1, solver="condensed", domain=math.inf):
    """(Answer, what was prepared) on equal squares."""
    start = clock()
    problem = on_squares(SCENES[SCENE], h, order, solver, domain, reach=REACH)
    problem.solver.prepare()
    ready = clock()
    state = problem.solve(load=LOAD)
    answer = Answer(
        state, int(state.unknowns), nodes_of(state), ready - start, clock() - ready, state.iterations
    )
    return answer, problem.solver.prepare()


def cells(nodes):
    start = clock()
    problem = on_cells(SCENES[SCENE], nodes, WINDOW)
    ready = clock()
    state = problem.solve(load=LOAD)
    answer = Answer(state, state.unknowns, nodes, ready - start, clock() - ready, state.iterations)
    return answer, problem.solver.prepare(nodes)


def half_plane(rtol):
    method = next(method for method in METHODS if method.name == "half-plane")
    answer = method.run(SCENES[SCENE], rtol=rtol)
    return answer, answer.unknowns


def of_condensed(prepared):
    form = prepared[0].form
    return lambda: form.mat.Inverse(form.space.FreeDofs(True), "sparsecholesky")


def of_newton(prepared):
    """Its matrix is not definite."""
    newton = prepared[-1]
    return lambda: newton.matrix.Inverse(newton.free, "umfpack")


def of_cells(prepared):
    _, flexibility, gaps = prepared
    return lambda: flexibility @ np.ones_like(gaps)


def of_dense(unknowns):
    matrix = np.eye(unknowns) + 1 / unknowns
    return lambda: np.linalg.solve(matrix, matrix[0])


FAMILIES = {
    family.name: family
    for family in (
        Family(
            "half-plane", half_plane, of_dense, levels("rtol", (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8))
        ),
        Family("cells", cells, of_cells, levels("nodes", (2**11, 2**14, 2**17, 2**20))),
        Family("condensed, order 4", bulk, of_condensed, levels("h", (1.0, 0.5, 0.25, 0.125), order=4)),
        Family(
            "AL, order 1",
            bulk,
            of_newton,
            levels("h", (0.2, 0.1, 0.05, 0.025, 0.0125), solver="al", domain=PAPER_DOMAIN),
        ),
        Family("condensed, order 1", bulk, of_condensed, levels("h", (0.2, 0.1, 0.05, 0.025, 0.0125))),
    )
}


def measure(family, setting):
    """Record of one run in this process, after a warm-up on the first level."""
    family.run(**family.settings[0])
    before = resident("VmRSS")
    reset_peak()
    profile, start = Profile(clock), clock()
    answer, prepared = profile.runcall(family.run, **setting)
    spent, peak = clock() - start, resident("VmHWM")
    answers = [answer] if spent > QUICKLY else [family.run(**setting)[0] for _ in range(REPEATS)]
    floor = timed(family.floor(prepared))
    setup, solve = min(one.setup for one in answers), min(one.solve for one in answers)
    return {
        "unknowns": answer.unknowns,
        "contact_nodes": answer.contact_nodes,
        "setup": setup,
        "solve": solve,
        "seconds": setup + solve,
        "iterations": answer.iterations,
        "megabytes": peak and peak - before,
        "before": before,
        "floor": floor,
        "distance": (setup + solve) / floor,
        **shares(profile, spent),
    }


def shares(profile, spent):
    """Shares of the phases of a profiled run."""
    named = {}
    for (path, _, function), (*_, total, _) in Stats(profile).stats.items():
        module = os.path.basename(path).removesuffix(".py")
        short = function.rstrip(">}").split(".")[-1]  # Python 3.13 names methods with their class
        if path == "~" or FILES.get(short) == module:
            named[short] = named.get(short, 0.0) + total
        named[f"{short} of {module}"] = total
    return {
        f"share_{phase}": sum(named.get(name, 0.0) for name in names) / spent
        for phase, names in PHASES.items()
    }


def timed(work):
    """Processor seconds of a work, per run: as often as it takes to be seen by the clock."""
    start, runs = clock(), 0
    while not runs or clock() - start < 0.05:
        work()
        runs += 1
    return (clock() - start) / runs


def resident(which):
    """Megabytes of the resident set of this process, now ("VmRSS") or at its peak ("VmHWM"); None where /proc
    does not say.
    """
    try:
        lines = Path("/proc/self/status").read_text().splitlines()
    except FileNotFoundError:
        return None
    return next(int(line.split()[1]) / 1024 for line in lines if line.startswith(which))


def reset_peak():
    """Let the peak of the resident set begin again, where the system can do that; else the warm-up, which is
    small, counts.
    """
    try:
        Path("/proc/self/clear_refs").write_text("5")
    except OSError:
        return


def blank(family, setting):
    """Record of a run that has not been done."""
    return {
        "method": family.name,
        "scene": SCENE,
        **SCENES[SCENE].parameters,
        **dict.fromkeys(SETTINGS),
        **setting,
        **dict.fromkeys(MEASURED),
        "failure": None,
    }


def apart(family, setting):
    """`measure` in a process of its own; one that fails says why."""
    words = [sys.executable, "-m", __spec__.name if __spec__ else __name__, family.name, json.dumps(setting)]
    environment = {
        **os.environ,
        **dict.fromkeys(THREADS, "1"),
        "PYTHONPATH": os.pathsep.join(entry or os.getcwd() for entry in sys.path),
    }
    try:
        child = subprocess.run(words, capture_output=True, text=True, timeout=OVERDUE, env=environment)
    except subprocess.TimeoutExpired:
        return {**blank(family, setting), "failure": f"not done after {OVERDUE:g} s"}
    if child.returncode:
        said = child.stderr.strip().splitlines() or [f"ended with status {child.returncode}"]
        return {**blank(family, setting), "failure": said[-1]}
    return {**blank(family, setting), **json.loads(child.stdout.splitlines()[-1])}


def refined(family, settings, progress):
    """Records of a family's levels, up to where the next one would take too long, or too much memory: that
    one says so.
    """
    rows = []
    for setting in settings:
        progress.set_description(f"growth, {family.name}")
        why = refused([row for row in rows if not row["failure"]])
        if why:
            rows.append({**blank(family, setting), "failure": why})
            progress.update(len(settings) - len(rows) + 1)
            break
        rows.append(apart(family, setting))
        progress.update()
    return rows


def refused(rows):
    """Why the next level, taken as much larger as the last one was, is left out; None if it is not."""
    if len(rows) < 2:
        return None
    larger = rows[-1]["unknowns"] / rows[-2]["unknowns"]
    seconds, megabytes = ((rows[-1][cost] or 0) * larger**power for cost, power in STEEPEST.items())
    if seconds > LONGEST:
        return f"left out: about {seconds:.0f} s would go beyond {LONGEST:g} s"
    free = available()
    if free and megabytes > SPARE * free:
        return (
            f"left out: about {megabytes / 1024:.1f} GiB would go beyond {SPARE:.0%} of the "
            f"{free / 1024:.1f} GiB that are free"
        )
    return None


def available():
    """Megabytes of free memory; None where /proc does not say."""
    try:
        lines = Path("/proc/meminfo").read_text().splitlines()
    except FileNotFoundError:
        return None
    return next(int(line.split()[1]) / 1024 for line in lines if line.startswith("MemAvailable"))


def plan(quick):
    """[(family, settings)]"""
    chosen = QUICK if quick else dict.fromkeys(FAMILIES)
    return [(FAMILIES[name], FAMILIES[name].settings[:count]) for name, count in chosen.items()]


def result(work, progress):
    """{"runs": a record a run, "slopes": exponents} of a plan."""
    rows = []
    for family, settings in work:
        rows += refined(family, settings, progress)
    return {"scene": SCENE, "runs": rows, "slopes": slopes(rows)}


def slopes(rows):
    """Exponents of seconds and memory over unknowns and contact nodes, fitted to the last decade of unknowns
    of each method.
    """
    found = []
    for method, mine in grouped([row for row in rows if not row["failure"]], "method").items():
        last = [row for row in mine if row["unknowns"] * DECADE >= mine[-1]["unknowns"]]
        last = last if len(last) > 1 else mine[-2:]
        for size in SIZES:
            row = {"method": method, "over": size, "from": last[0][size], "to": last[-1][size]}
            sizes = [one[size] for one in last]
            found.append(
                {**row, **{cost: _slope(sizes, [one[cost] for one in last], TOLD[cost]) for cost in COSTS}}
            )
    return found


def _slope(sizes, costs, least):
    """Exponent by least squares in logarithms; None where sizes or costs do not tell."""
    if len(set(sizes)) < 2 or any(not cost or cost < least for cost in costs):
        return None
    return float(np.polyfit(np.log(sizes), np.log(costs), 1)[0])


def show(answer):
    """A line a run, then the exponents."""
    if not answer["runs"]:
        return
    print_table(
        answer["runs"],
        (
            "method",
            "unknowns",
            "contact_nodes",
            "setup",
            "solve",
            "megabytes",
            "floor",
            "distance",
            "failure",
        ),
    )
    for row in answer["slopes"]:
        powers = " and ".join(
            f"{cost} to the power {row[cost]:.2f}" for cost in COSTS if row[cost] is not None
        )
        print(
            f"{row['method']:>20}  over {row['over']} from {row['from']} to {row['to']}: "
            f"{powers or 'no growth to be told'}"
        )


if __name__ == "__main__":
    print(json.dumps(measure(FAMILIES[sys.argv[1]], json.loads(sys.argv[2]))))
