"""How far contact-line states are from a reference of another kind: a seeded sample.

Geometry   cylinders and wedges on a half-plane, all contact laws; alpha 0.01 to 2, nu 0 to 0.49, beta 0.2 to 1.9,
           psi0 of both signs and readings from 1e-3 a_Hz/R to beyond what lets both corners touch.
Equations  those of `hertz`.
Model      halfplane, asked for each rtol anew.
Reference  graded Legendre panels in x with kernels, quadrature and edges of their own (cases/reference_line.py), checked for
           (26); its own error is the distance of two of its rungs.
Look at    error over rtol, max(|dp|, |dM|/ell)/|p| in L2: below 1 in 98 % of the scenes, and never above 3.
Obstacles  --obstacles: a sample of hard ones instead, judged by graded cells on all of the window (cases/obstacle_cells.py).
Units      a_Hz = 1, R = 10, P = pi/2; for wedges the half-width of a classical contact is some ell.
"""

import time
from dataclasses import asdict, dataclass

import numpy as np
from tqdm import tqdm

from cases import reference_line as judge
from cases.options import command, option
from cases.records import keep, returned
from microblock import active_set, plots
from microblock.errors import BadArgument, MicroblockError, NotConverged
from microblock.halfplane import HalfPlane
from microblock.law import Microblock, Microclamped, Unilateral
from microblock.material import Cosserat
from microblock.obstacles import Cylinder, Wedge
from microblock.panels import zone_edges
from microblock.scene import Contact
from microblock.study import column, grouped

LOAD, RADIUS = np.pi/2, 10.0       # with E* = 20: a_Hz = 1
KINDS = {"microblock": 0.30, "unilateral": 0.20, "microclamped": 0.14, "psi0": 0.26, "wedge": 0.10}      # shares of the sample
SLOPE = 0.02                       # of wedges
QUICK = 10                         # scenes
SCENES = {False: 60, True: 2000}   # without and with --obstacles
RTOLS = {False: (1e-3, 1e-6, 1e-9), True: (1e-3, 1e-6)}
PATHS = 100                        # of the obstacles
ORDERS = 8, 12, 14                 # rungs of the reference; the last one judges
FINER = 100                        # times rtol, that a reference should be better than; counted in the table
BELIEVED = 1e-7                    # largest violation of (26) of a reference
START = 1e-3                       # rtol of the solver's zones from which the reference starts
CELLS = 200, 600                   # of the grids from which it starts where the solver has none, or wrong ones
COLUMNS = ("rtol", "kind", "scenes", "judged", "below", "above_3", "failed", "worst", "median", "fine_enough",
           "reference_worst", "reference_median")


@dataclass(frozen=True)
class Parameters:
    scenes: int | None = option(None, f"scenes of the sample (default {SCENES[False]}, {SCENES[True]} of obstacles)", int)
    seed: int = option(2020, "of the random numbers", int)
    rtols: tuple = option((), f"accuracies asked for (default {' '.join(map(str, RTOLS[False]))}, without the last of obstacles)",
                          nargs="+", metavar="RTOL")
    quick: bool = option(False, f"{QUICK} scenes only", bool)
    obstacles: bool = option(False, "a sample of obstacles that are meant to be hard, judged by cells instead", bool)
    paths: int | None = option(None, f"load paths of such obstacles (default {PATHS} of the full sample, else none)", int)
    workers: int = option(2, "processes, of obstacles", int)

    def __post_init__(self):
        for name, usual in (("scenes", SCENES[self.obstacles]), ("rtols", RTOLS[self.obstacles])):
            object.__setattr__(self, name, usual if getattr(self, name) in (None, ()) else getattr(self, name))
        if self.paths is None:
            object.__setattr__(self, "paths", PATHS if self.obstacles and self.scenes >= SCENES[True] else 0)
        for name, least in (("paths", 0), ("workers", 1)):
            if getattr(self, name) < least:
                raise BadArgument(name, getattr(self, name), f"must be at least {least}")
        object.__setattr__(self, "rtols", tuple(float(rtol) for rtol in self.rtols))
        if self.quick:
            object.__setattr__(self, "scenes", min(self.scenes, QUICK))
        if self.scenes < 1:
            raise BadArgument("scenes", self.scenes, "must be at least 1")
        if self.seed < 0:
            raise BadArgument("seed", self.seed, "must not be negative")
        if not self.rtols or not all(0 < rtol < 1 for rtol in self.rtols):
            raise BadArgument("rtols", self.rtols, "must be numbers between 0 and 1")


@dataclass(frozen=True)
class Draw:
    """One scene of the sample: kind, and its parameters as drawn (psi0 times R/a_Hz; wedges: half-width over ell)."""

    kind: str
    contact: str
    alpha: float
    nu: float
    beta: float
    psi0: float = 0.0
    reading: str = "gap"
    width: float | None = None

    def scene(self):
        """The `Contact` of this draw."""
        law = {"microblock": Microblock(self.psi0/RADIUS, self.reading), "unilateral": Unilateral(),
               "microclamped": Microclamped()}[self.contact]
        stiffness = 2*RADIUS if self.width is None else LOAD/(SLOPE*self.width*self.alpha)      # E*
        obstacle = Cylinder(RADIUS) if self.width is None else Wedge(SLOPE)
        solid = Cosserat(E=stiffness*(1 - self.nu**2), nu=self.nu, ell=self.alpha, beta=self.beta)
        return Contact(HalfPlane(solid), obstacle, law)


def sample(count, seed):
    """`count` draws, the kinds by their shares, alpha and psi0 stratified in their logarithms."""
    rng = np.random.default_rng(seed)
    shares = np.cumsum([0.0, *KINDS.values()])
    numbers = np.diff(np.round(shares*count).astype(int))
    return [draw for kind, number in zip(KINDS, numbers) for draw in _draws(rng, kind, number)]


def _draws(rng, kind, count):
    def strata(low, high):
        place = (rng.permutation(count) + rng.uniform(size=count))/max(count, 1) - np.arange(count)/max(count, 1)
        return np.geomspace(low, high, count + 1)[:-1]*(high/low)**place

    alphas, turns, widths = strata(0.01, 2.0), strata(1e-3, 1.5), strata(1.5, 8.0)
    for number in range(count):
        material = {"alpha": float(alphas[number]), "nu": float(rng.uniform(0, 0.49)), "beta": float(rng.uniform(0.2, 1.9))}
        if kind == "psi0":
            yield Draw(kind, "microblock", **material, psi0=float(rng.choice((-1, 1))*turns[number]),
                       reading=("gap", "lever")[number % 2])
        elif kind == "wedge":
            yield Draw(kind, ("microblock", "unilateral")[number % 2], **material, width=float(widths[number]))
        else:
            yield Draw(kind, kind, **material)


def reference(scene, load=LOAD, orders=ORDERS):
    """(reference, its own error) of a scene at a load: the last two of its rungs, on zones on which (26) hold.

    Raises
    ------
    NotConverged
        If none is found.
    """
    problem, complaint = judge.Problem(scene, load), "no zones to start from"
    for start in (_zones_of_solver, *(_zones_of_grid(cells) for cells in CELLS)):
        try:
            zones = {corner: list(pairs) for corner, pairs in start(scene, load).items() if corner in problem.corners}
            *_, coarse, fine = judge.fit(problem, zones, orders)
        except (MicroblockError, ArithmeticError, ValueError, np.linalg.LinAlgError) as failure:
            complaint = str(failure)
            continue
        violation = judge.violation(fine)
        if violation < BELIEVED:
            return fine, judge.distance(judge.fields(coarse), judge.fields(fine), judge.breaks([coarse, fine]))
        complaint = f"(26) violated by {violation:.1e}"
    raise NotConverged(f"no reference: {complaint}")


def _zones_of_solver(scene, load):
    return scene.at(load, rtol=START).all_zones


def _zones_of_grid(cells):
    """A function: scene and load -> zones {corner: [(left, right), ...]} of the closed cells of a uniform grid."""
    def zones(scene, load):
        reach = 1.6 if scene.symmetric and isinstance(scene.obstacle, Cylinder) else 3.0
        reach = reach + 2*scene.body.solid.ell
        for _ in range(3):
            x = np.linspace(-reach, reach, cells + 1)
            system = scene.body.compliance(x, scene.law.clamps_rotation).corner_system(scene.law, scene.obstacle)
            state = active_set.solve(system[0], system[1], load=load, c=system[2])
            closed = state.closed.reshape(len(scene.law.corners), -1)
            reach = min(reach, 1.2*np.abs(x[closed.any(axis=0)]).max() + 3*(x[1] - x[0]))
        half = (x[1] - x[0])/2
        found = {}
        for corner, flags in enumerate(closed):
            steps = np.diff(np.concatenate(([0], flags.astype(int), [0])))
            # the corners set apart by a hair: coinciding edges are one break too few
            hair = (0.1 + 0.2*corner)*half
            found[corner] = [(x[i] - half + hair, x[j - 1] + half - hair)
                             for i, j in zip(np.flatnonzero(steps == 1), np.flatnonzero(steps == -1))]
        return found
    return zones


def error(state, fine):
    """max(|dp|, |dM|/ell)/|p| in L2 of a state of the solver against the reference.

    By tanh-sinh between all edges and breaks of either; M of microclamped states, which are known at their own points
    only, by those.
    """
    ell, law = state.line.solid.ell, state.line.law
    panels = fine.panels
    places = {sign*x for sign in (1, -1) for x in (*panels.e, *(panels.e + panels.h), *zone_edges(state.all_zones))}
    turning = 0.0
    if law.clamps_rotation:
        wrong = state.micromoment/ell - fine.micromoment(state.x)
        turning = np.sqrt(state.weights @ wrong**2/(state.weights @ state.pressures.sum(axis=0)**2))

    def seen(x):
        pressures = [state.pressure(corner, x) for corner in range(len(law.corners))]
        levers = fine.problem.levers if not law.clamps_rotation else (0.0,)
        return sum(pressures), sum(lever*p for lever, p in zip(levers, pressures))/2

    def known(x):
        p = sum(fine.pressure(corner, x) for corner in range(len(law.corners)))
        return p, 0*x if law.clamps_rotation else fine.micromoment(x)

    return max(float(turning), judge.distance(seen, known, sorted(places)))


def judged(draw, rtols):
    """Records of one scene, one for each rtol; `failure` is the type and text of what the solver, or the judge, raised."""
    scene, rows = draw.scene(), []
    try:
        fine, own = reference(scene)
    except NotConverged as failure:
        fine, own, objection = None, None, f"reference: {failure}"
    for rtol in rtols:
        row = {**asdict(draw), "rtol": rtol, "error_over_rtol": None, "estimate_over_rtol": None, "reference_error": own,
               "zones": None, "seconds": None, "failure": "" if fine else objection}
        start = time.perf_counter()
        try:
            state = scene.at(LOAD, rtol=rtol)
        except MicroblockError as failure:
            row["failure"] = f"{type(failure).__name__}: {failure}"
        else:
            zones = {corner: len(pairs) for corner, pairs in state.all_zones.items()}
            row.update(estimate_over_rtol=state.error_estimate/rtol, zones=str(zones))
            if fine:
                row["error_over_rtol"] = error(state, fine)/rtol
        row["seconds"] = time.perf_counter() - start
        rows.append(row)
    return rows


def table(rows):
    """One row for each kind and rtol, and for all kinds: how many, how far."""
    found = []
    for rtol, of_rtol in grouped(rows, "rtol").items():
        for kind, chosen in {**grouped(of_rtol, "kind"), "all": of_rtol}.items():
            errors = [row["error_over_rtol"] for row in chosen if row["error_over_rtol"] is not None]
            own = [row["reference_error"] for row in chosen if row["reference_error"] is not None]
            found.append({"rtol": rtol, "kind": kind, "scenes": len(chosen), "judged": len(errors),
                          "below": sum(one < 1 for one in errors), "above_3": sum(one > 3 for one in errors),
                          "failed": sum(bool(row["failure"]) for row in chosen),
                          "worst": max(errors, default=None), "median": float(np.median(errors)) if errors else None,
                          "fine_enough": sum(one <= rtol/FINER for one in own), "reference_worst": max(own, default=None),
                          "reference_median": float(np.median(own)) if own else None})
    return found


def result(parameters, quiet=True):
    """Table, scenes and failures as one object."""
    start = time.perf_counter()
    rows = [row for draw in tqdm(sample(parameters.scenes, parameters.seed), disable=quiet, unit="scene")
            for row in judged(draw, parameters.rtols)]
    return returned(parameters, start, table=table(rows), scenes=rows, failures=grouped(misses(rows), "failure"))


def misses(rows):
    """The records that failed, or whose error is above rtol (`failure` then says so)."""
    found = [row for row in rows if row["failure"]]
    return found + [{**row, "failure": "error above rtol"} for row in rows if (row["error_over_rtol"] or 0) > 1]


def run(parameters, out=None, quiet=False):
    """Judge the sample, print the table and what missed, draw errors into the folder `out`."""
    if parameters.obstacles:
        from cases import accuracy_obstacles      # which takes the judge of this sample for some of its own
        return accuracy_obstacles.run(parameters, out, quiet)
    answer = result(parameters, quiet)
    if not quiet:
        show(answer)
    if out:
        keep(out, "accuracy", [{**row, "command": command("accuracy", parameters)} for row in answer["scenes"]], figure)
    return answer


def show(answer, names=COLUMNS):
    """Print the table and the misses."""
    print("  ".join(f"{name:>12.12}" for name in names))
    for row in answer["table"]:
        print("  ".join(f"{row[name]:12.3g}" if isinstance(row[name], float) else f"{row[name]!s:>12}" for name in names))
    for failure, rows in answer["failures"].items():
        print(failure)
        for row in rows:
            over = "" if row["error_over_rtol"] is None else f"  error/rtol {row['error_over_rtol']:.3g}"
            print("   ", ", ".join(f"{name}={row[name]!r}" for name in Draw.__dataclass_fields__), f"rtol={row['rtol']:g}{over}")


def figure(records):
    """Obtained error over the one asked for, scene by scene, by kind."""
    drawing, axis = plots.figure(height=3.0)
    for marker, (kind, chosen) in zip("os^dv", grouped([row for row in records if row["error_over_rtol"]], "kind").items()):
        axis.loglog([row["rtol"]*(1 + 0.15*"os^dv".index(marker)) for row in chosen],
                    np.multiply(column(chosen, "error_over_rtol"), column(chosen, "rtol")), marker, markersize=3, label=kind)
    ends = min(column(records, "rtol")), max(column(records, "rtol"))
    axis.loglog(ends, ends, color="0.6", linewidth=0.7, label="as asked for")
    axis.set(xlabel="rtol asked for", ylabel="relative $L_2$ error obtained")
    plots.legend_below(axis)
    return drawing
