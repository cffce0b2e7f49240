"""How far fitted finite elements are from the half-plane: a seeded sample.

Geometry   cylinders and wedges on a half-plane, both contact laws; alpha 0.05 to 1.25, nu 0 to 0.45, beta 0.2 to 1.8, psi0 of
           both signs and readings in a quarter of the scenes.
Equations  those of `hertz`.
Model      fe, `FittedContact` asked for each rtol anew; at rtols below 1e-4 for the first scenes of each kind only.
Reference  the contact line of the half-plane at rtol 1e-8, judged itself by `accuracy`.
Look at    error over rtol, max(|dp|, |dM|/ell)/|p| in L2: below 1 in 98 % of the scenes, and never above 3; time and unknowns.
Units      a_Hz = 1, R = 10, P = pi/2; for wedges the half-width of a classical contact is some ell.
"""

import time
from dataclasses import asdict, dataclass

import numpy as np
from tqdm import tqdm

from cases import accuracy
from cases import reference_line as judge
from cases.accuracy import Draw
from cases.options import command, option
from cases.records import keep, returned
from microblock.errors import BadArgument, MicroblockError, NotConverged
from microblock.fitted import FittedContact
from microblock.study import column, grouped

KINDS = {"microblock": 0.35, "unilateral": 0.30, "psi0": 0.25, "wedge": 0.10}      # shares of the sample
JUDGES = 1e-8, 1e-7, 1e-6       # rtol of the half-plane, the first that it reaches
DEAR = 1e-4                     # rtols below it are asked of a third of the scenes


@dataclass(frozen=True)
class Parameters:
    scenes: int = option(60, "scenes of the sample", int)
    seed: int = option(77, "of the random numbers", int)
    rtols: tuple = option((1e-2, 1e-3, 1e-4, 1e-5), "accuracies asked for", nargs="+", metavar="RTOL")

    def __post_init__(self):
        accuracy.Parameters(self.scenes, self.seed, self.rtols)      # which checks them
        object.__setattr__(self, "rtols", tuple(float(rtol) for rtol in self.rtols))
        if self.scenes < 4:
            raise BadArgument("scenes", self.scenes, "must be at least 4")


def sample(count, seed):
    """`count` draws, the kinds by their shares, alpha stratified in its logarithm."""
    rng = np.random.default_rng(seed)
    numbers = np.diff(np.round(np.cumsum([0.0, *KINDS.values()])*count).astype(int))
    return [draw for kind, number in zip(KINDS, numbers) for draw in _draws(rng, kind, number)]


def _draws(rng, kind, count):
    places = (rng.permutation(count) + rng.uniform(size=count))/max(count, 1)
    for number, place in enumerate(places):
        material = {"alpha": float(0.05*25**place), "nu": float(rng.uniform(0, 0.45)), "beta": float(rng.uniform(0.2, 1.8))}
        if kind == "psi0":
            turn = float(rng.choice((-1, 1))*10**rng.uniform(-2, 0))      # over a_Hz/R
            yield Draw(kind, "microblock", **material, psi0=turn, reading=("gap", "lever")[number % 2])
        elif kind == "wedge":
            yield Draw(kind, ("microblock", "unilateral")[number % 2], **material, width=float(rng.uniform(1.5, 8)))
        else:
            yield Draw(kind, kind, **material)


def reference(scene):
    """The half-plane's state at the smallest rtol of JUDGES that it reaches; NotConverged if none."""
    for rtol in JUDGES:
        try:
            return scene.at(accuracy.LOAD, rtol=rtol)
        except NotConverged as failure:
            objection = failure
    raise objection


def error(state, true):
    """Relative L2 distance of a SurfaceState to a LineState, between all edges, kinks, and ends of facets."""
    facets = [end for left, right, _ in state.body.interpolation for end in (left, right)]
    edges = [edge for one in (state, true) for pairs in one.all_zones.values() for pair in pairs for edge in pair]
    half = state.line.solid.ell/2
    kinks = [kink + shift for kink in state.line.kinks for shift in (half, 0, -half)]
    outermost = max(map(abs, edges))
    places = {sign*x for x in (*facets, *edges, *kinks) for sign in (1, -1) if abs(x) <= 1.01*outermost}
    return judge.distance(_seen(state), _seen(true), sorted(places))


def _seen(state):
    """x -> (p, M/ell)."""
    def seen(x):
        p = [state.pressure(corner, x) for corner in range(len(state.line.law.corners))]
        return sum(p), sum(state.line.lever(np.full(len(x), corner), x)*own for corner, own in enumerate(p))/2
    return seen


def judged(draw, rtols):
    """Records of one scene, one for each rtol."""
    scene, rows = draw.scene(), []
    try:
        true, objection = reference(scene), ""
    except NotConverged as failure:
        true, objection = None, f"reference: {failure}"
    for rtol in rtols:
        row = {**asdict(draw), "rtol": rtol, "error_over_rtol": None, "estimate_over_rtol": None,
               "reference_error": true and true.error_estimate, "unknowns": None, "seconds": None, "failure": objection}
        start = time.perf_counter()
        try:
            state = FittedContact(scene.body.solid, scene.obstacle, scene.law).at(accuracy.LOAD, rtol)
        except MicroblockError as failure:
            row["failure"] = f"{type(failure).__name__}: {failure}"
        row["seconds"] = time.perf_counter() - start
        if not row["failure"]:
            row.update(estimate_over_rtol=state.estimate.total/rtol, unknowns=state.unknowns,
                       error_over_rtol=error(state, true)/rtol)
        rows.append(row)
    return rows


def table(rows):
    """`accuracy.table` with medians and maxima of time and unknowns."""
    found = accuracy.table(rows)
    for line in found:
        own = [row for row in rows if row["rtol"] == line["rtol"] and line["kind"] in (row["kind"], "all")]
        for name in ("seconds", "unknowns"):
            values = [value for value in column(own, name) if value is not None]
            line[f"{name}_median"] = float(np.median(values)) if values else None
            line[f"{name}_most"] = max(values, default=None)
    return found


def result(parameters, quiet=True):
    """Table, scenes and failures as one object."""
    start = time.perf_counter()
    draws, rows = sample(parameters.scenes, parameters.seed), []
    often = [rtol for rtol in parameters.rtols if rtol >= DEAR]
    dear = [draw for own in grouped([{"kind": draw.kind, "draw": draw} for draw in draws], "kind").values()
            for draw in column(own, "draw")[:-(-len(own)//3)]]
    for draw in tqdm(draws, disable=quiet, unit="scene"):
        rows += judged(draw, parameters.rtols if draw in dear else often)
    return returned(parameters, start, table=table(rows), scenes=rows, failures=grouped(accuracy.misses(rows), "failure"))


def run(parameters, out=None, quiet=False):
    """Judge the sample, print the table and what missed, draw errors into the folder `out`."""
    answer = result(parameters, quiet)
    if not quiet:
        show(answer)
    if out:
        rows = [{**row, "command": command("accuracy_fe", parameters)} for row in answer["scenes"]]
        keep(out, "accuracy_fe", rows, accuracy.figure)
    return answer


def show(answer):
    """Print the table and the misses."""
    accuracy.show(answer, ("rtol", "kind", "scenes", "judged", "below", "above_3", "failed", "worst", "median", "reference_worst",
                           "seconds_median", "seconds_most", "unknowns_median", "unknowns_most"))
