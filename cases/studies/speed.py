"""Speed against accuracy: time and unknowns over true error, one curve a method.

Geometry   the strip of section 4.1; a cylinder on a half-plane for both laws, alpha = 0.01 (the layers),
           0.05, 0.25, 1; its classical limit.
Equations  those of `strip` and `hertz`.
Model      half-plane, fitted finite elements, uniform squares and triangles condensed (orders 1, 2, 4, 6),
           the paper's bilinear mesh with nodal augmented Lagrangian ("AL, order 1": UMFPACK, block of
           18 a_Hz), the same of order 2, penalty with several rho, uniform cells; tamaas and scikit-fem
           where installed, and NGSolve's own ContactBoundary, in the classical limit. Levels that take a
           minute (the paper's own mesh) in one problem only, alpha = 0.25.
Reference  the closed form (strip, Hertz ellipse); else panels of another kind (reference_line.py), whose own
           error, the distance of two of its levels, is the floor of the charts. Methods are told apart
           down to 100 times the floor.
Look at    the slope of each curve; requested against obtained error; which rho is best on which mesh; psi in
           the layers; where the time goes; growth of time and memory
           up to 10^6 unknowns, and the distance to one factorisation (cases/studies/speed_growth.py).
Tuned      in favour of others: rho of the penalty and period of tamaas, the best for each mesh, as only one
           knows who has the answer; cells are given the edge of the contact, scikit-fem starts with it; more
           in cases/studies/speed_skfem.py and cases/studies/speed_ngsolve.py. Nothing where an accuracy is
           asked for.
Units      processor seconds of one thread, setup (what further loads reuse) and solving apart, each the best
           of --repeats after a warm-up; a run of more than ONCE seconds counts itself. Errors as in
           cases/studies/speed_scenes.py, all relative.
"""

import os
import time
from dataclasses import dataclass
from importlib import metadata

from tqdm import tqdm

from microblock.data.records import versions
from microblock.errors import MicroblockError

from ..common.options import Checked, command, names, option
from ..common.records import kept, print_table, returned
from . import speed_growth
from .speed_methods import METHODS, NAMES, clock
from .speed_scenes import QUICK, SCENES

ONCE = 1.0  # seconds of a warm-up beyond which it counts itself
ENOUGH = 1.0  # seconds of all runs of a setting, beyond which it is not repeated further
STOP = 5.0  # times dearer, at most, is the next level of a method
QUICK_LEVELS = 2  # settings of a method
GROWTH = "growth"  # in --only: the part of cases/studies/speed_growth.py
# by rho and by period, for each mesh
TUNED = ("penalty", "tamaas", *(name for name in NAMES if name.startswith("ContactBoundary")))
BETTER = 100  # times, that a reference should be better than a method
SHOWN = ("rtol", "h", "elements", "nodes", "rho", "period")  # of them, in the table
SETTINGS = (
    "rtol",
    "h",
    "order",
    "elements",
    "model",
    "solver",
    "rho",
    "domain",
    "reach",
    "shape",
    "nodes",
    "period",
    "residual",
)


@dataclass(frozen=True)
class Parameters(Checked):
    only: tuple = names(
        f"problems ({', '.join(SCENES)}), methods ({', '.join(NAMES)}) and the part {GROWTH} to run",
        (*SCENES, *NAMES, GROWTH),
    )
    repeats: int = option(3, "runs after the warm-up, of which the best counts", int, at_least=1, at_most=100)
    limit: float = option(100.0, "seconds of a run beyond which a method is not refined", above=0, below=1e5)
    quick: bool = option(False, f"{len(QUICK)} problems, {QUICK_LEVELS} settings of each method", bool)

    def chosen(self, known):
        """Of the known names those that were asked for; all of them if none was."""
        return [name for name in known if name in self.only] or list(known)

    @property
    def grows(self):
        """Whether the growth of time and memory is asked for."""
        return not self.only or GROWTH in self.only


def plan(parameters):
    """[(scene, method, settings)] of a study."""
    found = []
    if set(parameters.only) == {GROWTH}:
        return found
    for name in parameters.chosen(SCENES):
        if parameters.quick and not parameters.only and name not in QUICK:
            continue
        for method in METHODS:
            wanted = method.name in parameters.chosen(NAMES) and SCENES[name].kind in method.kinds
            if wanted and method.available:
                settings = method.levels(SCENES[name])[: QUICK_LEVELS if parameters.quick else None]
                found.append((SCENES[name], method, settings))
    return found


def blank(scene, method, setting):
    """Record of a setting that has not been run."""
    return {
        "scene": scene.name,
        **scene.parameters,
        "method": method.name,
        **{name: setting.get(name) for name in SETTINGS},
        "unknowns": None,
        "contact_nodes": None,
        "error": None,
        "error_p": None,
        "error_m": None,
        "error_psi": None,
        "error_u": None,
        "floor": scene.floor,
        "floor_psi": scene.floor_psi,
        "judged": None,
        "setup": None,
        "solve": None,
        "spent": None,
        "repeats": 0,
        "iterations": None,
        "estimate": None,
        "best": None,
        "failure": None,
    }


def measure(scene, method, setting, repeats):
    """Record of one setting; a failed one says why."""
    row = blank(scene, method, setting)
    start = clock()
    try:
        answer = method.run(scene, **setting)  # the warm-up
        row["spent"] = clock() - start
        answers = [answer] if row["spent"] > ONCE else repeated(lambda: method.run(scene, **setting), repeats)
    except (MicroblockError, MemoryError, RuntimeError) as failure:  # NGSolve's own are RuntimeErrors
        return {
            **row,
            "spent": clock() - start,
            "failure": f"{type(failure).__name__}: {' '.join(str(failure).split())}",
        }
    errors = scene.errors(answer.found)
    error = max(errors.values())
    row.update(
        errors,
        **scene.remarks(answer),
        error=error,
        judged=error >= BETTER * scene.floor,
        repeats=0 if answers[0] is answer else len(answers),
        setup=min(one.setup for one in answers),
        solve=min(one.solve for one in answers),
    )
    return {
        **row,
        **{name: getattr(answer, name) for name in ("unknowns", "contact_nodes", "iterations", "estimate")},
    }


def repeated(work, most):
    """Answers of a work done up to `most` times, as long as ENOUGH lasts."""
    start, found = clock(), []
    while not found or (len(found) < most and clock() - start < ENOUGH):
        found.append(work())
    return found


def refined(scene, method, settings, parameters, progress):
    """Records of a method's levels, up to where the next one would take too long: that one says so."""
    rows = []
    for setting in settings:
        progress.set_description(f"{scene.name}, {method.name}")
        progress.update()
        last = rows[-1] if rows else None
        if last and last["spent"] * STOP > parameters.limit and _dearer(setting, last):
            why = (
                f"left out: the level before took {last['spent']:.1f} s, and this one may take {STOP:g} "
                f"times as long, "
                f"beyond --limit {parameters.limit:g}"
            )
            rows.append({**blank(scene, method, setting), "failure": why})
            progress.update(len(settings) - len(rows))
            break
        rows.append(measure(scene, method, setting, parameters.repeats))
    return rows


def _dearer(setting, last):
    """Whether a setting has a finer mesh than a record."""
    return any(setting.get(name) != last[name] for name in ("h", "elements", "nodes", "rtol"))


def marked(rows):
    """The records; of those of TUNED that share problem and mesh the one of the least error is marked."""
    groups = {}
    for row in rows:
        if row["method"] in TUNED:
            groups.setdefault(
                tuple(row[name] for name in ("scene", "method", "h", "elements", "nodes")), []
            ).append(row)
    for mine in groups.values():
        good = [row for row in mine if row["error"] is not None]
        for row in mine:
            row["best"] = bool(good) and row is min(good, key=lambda row: row["error"])
    return rows


def result(parameters, quiet=True):
    """The case's object: a row a run, growth of the cost, threads."""
    start, work, rows = time.perf_counter(), plan(parameters), []
    for scene in {id(scene): scene for scene, *_ in work}.values():
        scene.floor  # the references, made before anything is timed
    ready = time.perf_counter()
    larger = speed_growth.plan(parameters.quick) if parameters.grows else []
    with tqdm(
        total=sum(len(settings) for *_, settings in (*work, *larger)), disable=quiet, unit="run"
    ) as progress:
        for scene, method, settings in work:
            rows += refined(scene, method, settings, parameters, progress)
        cost = speed_growth.result(larger, progress)
    return returned(
        parameters,
        ready,
        ready - start,
        versions={**versions(), **_peers()},
        threads=threads(),
        runs=marked(rows),
        cost=cost,
    )


def threads():
    """The pinned numbers of threads, as the libraries are told."""
    return {name: os.environ.get(name) for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS")}


def _peers():
    owners = metadata.packages_distributions()
    needed = {method.needs for method in METHODS if method.needs and method.available}
    return {owner: metadata.version(owner) for name in sorted(needed) for owner in owners[name]}


def run(parameters, out=None, quiet=False):
    """Measure, print a table, write and draw the records into the folder `out`."""
    answer = result(parameters, quiet)
    if not quiet:
        show(answer)
    if out:
        from microblock.view import plots

        from . import speed_figures  # when something is drawn

        peers = {f"version_{name}": version for name, version in _peers().items()}
        extra = {"command": command("speed", parameters), **answer["threads"], **peers}
        for name, rows, plates in (
            ("speed", answer["runs"], speed_figures.PLATES),
            ("speed_cost", answer["cost"]["runs"], speed_figures.COST_PLATES),
        ):
            if rows:
                records = kept(out / f"{name}.csv", [{**row, **extra} for row in rows])
                for plate, drawing in plates.items():
                    plots.draw(drawing, records, out, f"speed_{plate}")
    return answer


def show(answer):
    """A line a run, then the growth."""
    rows = [
        {
            **row,
            "setting": " ".join(f"{name} {row[name]:g}" for name in SHOWN if row[name] is not None),
            "remark": row["failure"] or ("best" if row["best"] else ""),
        }
        for row in answer["runs"]
    ]
    print_table(
        rows, ("scene", "method", "setting", "error", "floor", "unknowns", "setup", "solve", "remark")
    )
    speed_growth.show(answer["cost"])
