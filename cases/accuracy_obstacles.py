"""`accuracy --obstacles`: what becomes of states and load paths under obstacles that are meant to be hard.

Each scene of `cases.obstacle_sample` is asked for at each rtol and judged by `cases.obstacle_cells`; where their error is not
below what is to be judged there are finer cells once. A run is

ok        error below the larger of rtol and estimate, to the judge's own error, and no zone missed;
wrong     the same not so, without a word: an error above, or a zone that carries load and is not there, or the other way round;
refused   `NotConverged`, with its message;
crashed   any other error, also a typed one that blames the arguments;
slow      not done after LIMIT seconds;
unjudged  answered, but there is no judge.
"""

import signal
import time
from collections import Counter

import numpy as np
from tqdm import tqdm

from cases import limits_pool, obstacle_cells, reference_line
from cases.obstacle_sample import Draw, sample
from cases.options import command
from cases.records import kept, returned
from microblock.errors import MicroblockError, NotConverged
from microblock.observables import distance
from microblock.study import grouped

OUTCOMES = "ok", "wrong", "refused", "crashed", "slow", "unjudged"
LIMIT = 60                 # seconds of a state
CARRIES = 1e-4             # share of the load from which a zone counts
TWICE = 2.0                # so much more, or less, is a difference
FINER = 1.5                # times as many cells, where the first ones do not decide
SURE = 5.0                 # times the judge's own error: farther off is wrong under finer cells too
PATIENCE = 20              # seconds for the reference line
EVERY = 10                 # scenes of which one is judged by the reference line too
ORDERS = 8, 12, 14         # of the reference line
EDGES = 8                  # of the zones of all corners, up to which it is asked
KINK = 0.3                 # of ell: features narrower than that are where panels of the reference line break
FALLS = 0.05               # its error from rung to rung at most; slower, and their difference is no error
BELIEVED = 1e-7            # violation of (26) of a reference
MEASURES = ("outcome", "error", "estimate", "judge_error", "certain", "line_error", "line_own", "zones", "unlike", "method",
            "seconds", "judge_seconds", "message")


class OutOfTime(BaseException):
    """Not an Exception: what catches those must not catch this."""


def within(seconds, function):
    """function(), or OutOfTime; in a process's main thread."""
    def stop(*_):
        raise OutOfTime
    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        return function()
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def pressure(state, corner, x):
    """Pressure of a corner at x of any state: its own between its nodes, or a polygon."""
    if hasattr(state, "pressure"):
        return state.pressure(corner, x)
    return np.interp(x, state.x, state.pressures[corner], left=0.0, right=0.0)


def error(state, cells):
    """max(|dp|, |dM|/ell)/|p| in L2 of a state against cells, also where these are not; its M against its own pressures."""
    setting, off = cells.setting, np.ones(len(state.x), bool)
    off &= ~_among(state.x, obstacle_cells._merged(list(zip(cells.left, cells.right))))
    levers, x = setting.levers, np.concatenate((cells.x, state.x[off]))
    weights = np.concatenate((cells.weights, state.weights[off]))
    own = np.array([pressure(state, corner, x) for corner in setting.corners])
    p = np.concatenate((cells.pressures.sum(axis=0), np.zeros(off.sum())))
    seen, total = state.micromoment/setting.ell, state.pressures.sum(axis=0)
    turned = 0*p
    if setting.problem.clamped:
        itself = distance(state.weights, 0*seen, seen - cells.moment_at(state.x), total)
    else:
        turned = levers @ own/2 - np.concatenate((cells.micromoment, np.zeros(off.sum())))
        itself = distance(state.weights, 0*seen, seen - levers @ state.pressures/2, total)
    load = abs(state.weights @ total/setting.load - 1)
    found = max(distance(weights, own.sum(axis=0) - p, turned, p), itself, load)
    return found if np.isfinite(found) else np.inf


def unlike(state, cells, rtol=CARRIES):
    """What zones of a state and of cells differ in, in words; empty where they are alike.

    A zone that carries TWICE of CARRIES in one must carry half as much in the other, and what lies between two zones no more
    than that or rtol.
    """
    setting, found = cells.setting, []
    kinds = {"contact": slice(None)}
    kinds |= {name: slice(number, number + 1) for number, name in enumerate(setting.problem.law.corners)}
    for name, chosen in kinds.items():
        if len(setting.levers) == 1 and name != "contact":
            continue
        rules = [(one.x, one.weights*one.pressures[chosen].sum(axis=0)/setting.load, one.named_zones[name])
                 for one in (state, cells)]
        for (x, load, zones), (other_x, other, _), who in ((*rules, "too many"), (*rules[::-1], "missing")):
            spare = 2*np.interp([sum(pair)/2 for pair in zones], cells.x, cells.weights) if len(zones) else ()
            for (a, b), more in zip(zones, spare):
                share, more = load[(x >= a) & (x <= b)].sum(), more + 0.05*(b - a)
                if share > TWICE*CARRIES and other[(other_x >= a - more) & (other_x <= b + more)].sum() < share/2:
                    found.append(f"{name} {who} at {(a + b)/2:.4g}, width {b - a:.2g}, {share:.2g} of the load")
            for (_, a), (b, _) in zip(zones, zones[1:]):
                inside = (other_x > a + 0.1*(b - a)) & (other_x < b - 0.1*(b - a))
                between = other[inside].sum()
                if between > max(TWICE*CARRIES, rtol):
                    found.append(f"{name} {'missing' if who == 'too many' else 'too many'} between {a:.4g} and {b:.4g}, "
                                 f"{between:.2g} of the load")
    return "; ".join(dict.fromkeys(found))


def _among(x, intervals):
    inside = np.zeros(len(x), bool)
    for a, b in intervals:
        inside |= (a <= x) & (x <= b)
    return inside


class Judge:
    """The cells of a draw, made when they are first needed, and finer ones where those do not decide."""

    def __init__(self, draw):
        self.draw, self.scene = draw, draw.scene()
        self.seconds, self.complaint, self.cells, self.own, self.finer = 0.0, "", None, None, False
        self._look(obstacle_cells.MOST)

    def _look(self, most):
        start = time.perf_counter()
        try:
            self.cells, self.own = obstacle_cells.judged(self.scene, self.draw.load, self.draw.window, most=most)
        except (MicroblockError, ArithmeticError, ValueError, np.linalg.LinAlgError) as failure:
            if self.cells is None:
                self.complaint = f"judge: {failure}"
        self.seconds += time.perf_counter() - start

    def verdict(self, state, rtol):
        """{measures} of a state."""
        if self.cells is None and not self.finer:
            self._again()
        if self.cells is None:
            return {"outcome": "unjudged", "message": self.complaint}
        limit = max(rtol, state.error_estimate)
        off = error(state, self.cells)
        near = limit < off + self.own and off < limit + SURE*self.own      # where finer cells may say something else
        if not self.finer and near and (limit >= CARRIES or off > self.own):
            self._again()
            off = error(state, self.cells)
        wrong = off > limit + self.own
        words = unlike(state, self.cells, rtol)
        return {"outcome": "wrong" if wrong or words else "ok", "error": off, "judge_error": self.own,
                "certain": bool(off + self.own <= limit or wrong or words), "unlike": words,
                "zones": len(self.cells.named_zones["contact"])}

    def _again(self):
        self.finer = True
        self._look(int(FINER*obstacle_cells.MOST))


def _by_line(state, rtol, reference, own):
    """{measures} of a state against the reference line, where there is one."""
    if reference is None:
        return {}
    from cases.accuracy import error as line_error      # which imports this module
    off = line_error(state, reference)
    return {"line_error": off, "line_own": own, **({"outcome": "wrong"} if off > max(rtol, state.error_estimate) + own else {})}


def line_reference(judge):
    """(reference of another kind, its own error) where it applies, else None: zones of the cells, edges by Newton's method."""
    cells = judge.cells
    if cells is None or 2*sum(map(len, cells.zones.values())) > EDGES:
        return None
    problem = reference_line.Problem(judge.scene, judge.draw.load)
    problem.kinks, problem.mirror = sorted({x for x, width in cells.setting.places if width < KINK*cells.setting.ell}), False
    zones = {corner: list(pairs) for corner, pairs in cells.zones.items()}
    try:
        states = within(PATIENCE, lambda: reference_line.fit(problem, zones, ORDERS))
        breaks = reference_line.breaks(states)
        before, own = (reference_line.distance(reference_line.fields(coarse), reference_line.fields(states[-1]), breaks)
                       for coarse in states[:-1])
        fine = states[-1]
        if reference_line.violation(fine) > BELIEVED or own > FALLS*before:
            return None
    except (OutOfTime, MicroblockError, ArithmeticError, ValueError, np.linalg.LinAlgError):
        return None
    far = reference_line.fields(fine)(cells.x)[0] - cells.pressures.sum(axis=0)      # the same state, not another one
    alike = distance(cells.weights, far, 0*far, cells.pressures.sum(axis=0)) <= 2*judge.own
    return (fine, own) if alike else None


def runs(seed, number, rtols, every=EVERY):
    """Records of one scene, one for each rtol; of those numbered by a multiple of `every` also against the reference line."""
    draw = Draw(seed, number)
    about = {"seed": seed, "number": number, "kind": draw.kind, "contact": draw.contact, "load": draw.load, **draw.material,
             "psi0": draw.psi0}
    judge, line, rows = Judge(draw), None, []
    for rtol in rtols:
        row = {**about, "rtol": rtol, **dict.fromkeys(MEASURES)}
        start = time.perf_counter()
        try:
            state = within(LIMIT, lambda rtol=rtol: judge.scene.at(draw.load, rtol=rtol))
        except OutOfTime:
            row.update(outcome="slow", message=f"stopped after {LIMIT} s")
        except Exception as failure:      # whatever it is, it is a finding
            row.update(outcome="refused" if isinstance(failure, NotConverged) else "crashed", message=_line(failure))
        row["seconds"] = time.perf_counter() - start
        if row["outcome"] is None:
            row.update(judge.verdict(state, rtol), estimate=state.error_estimate, method=getattr(state, "method", None))
            if every and number % every == 0 and row["outcome"] == "ok":
                line = line or line_reference(judge) or (None, None)
                row.update(_by_line(state, rtol, *line))
        rows.append(row)
    for row in rows:
        row["judge_seconds"] = judge.seconds
    return rows


def _line(failure):
    return f"{type(failure).__name__}: {' '.join(str(failure).split())}"


def result(parameters, quiet=True):
    """The case's object: a row a run, and how often each outcome came, by kind and law."""
    start = time.perf_counter()
    work = [(parameters.seed, number, tuple(parameters.rtols)) for number in range(parameters.scenes)]
    with tqdm(total=len(work), disable=quiet, unit="scene") as progress:
        found = limits_pool.answers(runs, work, parameters.workers, LIMIT*(len(parameters.rtols) + 4), progress.update, _lost)
    rows = [row for own in found for row in own]
    return returned(parameters, start, table=table(rows), scenes=rows, bad=bad(rows), paths=_paths(parameters, quiet))


def _paths(parameters, quiet):
    """Records of the load paths, see `cases.obstacle_paths`."""
    from cases.obstacle_paths import path      # which takes the limits and outcomes of this module
    work = [(parameters.seed, number) for number in range(parameters.paths)]
    with tqdm(total=len(work), disable=quiet, unit="path") as progress:
        return limits_pool.answers(path, work, parameters.workers, 30*LIMIT, progress.update, _path_lost) if work else []


def _path_lost(arguments, words):
    seed, number = arguments
    draw = Draw(seed, number)
    return {"seed": seed, "number": number, "kind": draw.kind, "contact": draw.contact, "load": draw.load, **draw.material,
            "psi0": draw.psi0, "outcome": "crashed" if "died" in words else "slow", "events": None, "looked": 0, "unjudged": 0,
            "unlike": "", "seconds": None, "message": words}


def _lost(arguments, words):
    """Records of a scene whose process had to be stopped, or died."""
    seed, number, rtols = arguments
    draw = Draw(seed, number)
    return [{"seed": seed, "number": number, "kind": draw.kind, "contact": draw.contact, "load": draw.load, **draw.material,
             "psi0": draw.psi0, "rtol": rtol, **dict.fromkeys(MEASURES), "outcome": "crashed" if "died" in words else "slow",
             "message": words} for rtol in rtols]


def table(rows):
    """One row for each rtol and kind, law, and for all."""
    found = []
    for rtol, of_rtol in grouped(rows, "rtol").items():
        laws = {f"law {law}": own for law, own in grouped(of_rtol, "contact").items()}
        for name, chosen in {**grouped(of_rtol, "kind"), **laws, "all": of_rtol}.items():
            counts = Counter(row["outcome"] for row in chosen)
            own = [row["judge_error"] for row in chosen if row["judge_error"] is not None]
            found.append({"rtol": rtol, "of": name, "runs": len(chosen), **{outcome: counts[outcome] for outcome in OUTCOMES},
                          "certain": sum(bool(row["certain"]) for row in chosen),
                          "line": sum(row["line_error"] is not None for row in chosen),
                          "judge_median": float(np.median(own)) if own else None,
                          "seconds": float(np.mean([row["seconds"] or 0 for row in chosen]))})
    return found


def bad(rows):
    """Those that are not ok, the worst first."""
    order = "wrong", "crashed", "slow", "refused", "unjudged"
    return sorted((row for row in rows if row["outcome"] != "ok"),
                  key=lambda row: (order.index(row["outcome"]), -(row["error"] or 0), row["number"]))


def told(row):
    """A record on one line."""
    words = [f"number={row['number']}", row["kind"], row["contact"], f"rtol={row['rtol']:g}", row["outcome"]]
    if row["error"] is not None:
        words.append(f"error {row['error']:.1e}, estimate {row['estimate']:.1e}, judge {row['judge_error']:.1e}")
    return "  ".join([*words, *(one for one in (row["unlike"], row["message"]) if one)])


def run(parameters, out=None, quiet=False):
    """Judge the sample, print the table and what is not ok, write the records into the folder `out`."""
    answer = result(parameters, quiet)
    if not quiet:
        show(answer)
    if out:
        for name, rows in (("accuracy_obstacles", answer["scenes"]), ("accuracy_obstacle_paths", answer["paths"])):
            if rows:
                kept(out/f"{name}.csv", [{**row, "command": command("accuracy", parameters)} for row in rows])
    return answer


def show(answer):
    """Print the table and what is not ok."""
    names = list(answer["table"][0])
    print("  ".join(f"{name:>12.16}" for name in names))
    for row in answer["table"]:
        print("  ".join(f"{row[name]:12.3g}" if isinstance(row[name], float) else f"{row[name]!s:>12}" for name in names))
    for row in answer["bad"]:
        print(told(row))
    if answer["paths"]:
        counts = Counter(row["outcome"] for row in answer["paths"])
        print("paths:", ", ".join(f"{number} {outcome}" for outcome, number in counts.items()))
    for row in answer["paths"]:
        if row["outcome"] != "ok":
            print("  ".join(("path", f"number={row['number']}", row["kind"], row["contact"], row["outcome"],
                             row["unlike"] or row["message"] or "")))
