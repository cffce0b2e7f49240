"""`accuracy --obstacles`: what becomes of states and load paths under obstacles that are meant to be hard.

Each problem of `obstacle_sample` is asked for at each rtol and verified by `obstacle_cells`; where their
error is not below what is to be verified there are finer cells once. A run is

ok        error below the larger of rtol and estimate, to DOUBT of the own error of the cells, and no zone
          missed;
wrong     the same not so, without a word: an error above, or a zone that carries load and is not there, or
          the other way round;
refused   raised `NotConverged`, with its message;
crashed   any other error, also a typed one that blames the arguments;
slow      not done after LIMIT seconds of processor time;
unjudged  answered, but not verified: the cells failed, or were not done after JUDGE_LIMIT seconds of
          processor time.
"""

import time
from collections import Counter

import numpy as np
from tqdm import tqdm

from microblock.data.records import grouped
from microblock.errors import MicroblockError, NotConverged
from microblock.model.zones import distance, joined

from ..common.options import command
from ..common.records import kept, print_table, returned
from . import judged_line, obstacle_cells, reference_line
from .limits_pool import OutOfTime, answers, told_on_a_line, within
from .obstacle_paths import path, path_lost
from .obstacle_sample import CARRIES, JUDGE_LIMIT, LIMIT, TWICE, Draw

OUTCOMES = "ok", "wrong", "refused", "crashed", "slow", "unjudged"
FINER = 1.5  # times as many cells, where the first ones do not decide
DOUBT = 1.25  # times the cells' own error, which is an estimate as well: a state is not wrong within
SURE = 5.0  # times the cells' own error: farther off is wrong under finer cells too
PATIENCE = 20  # seconds for the reference line
WALL = 3  # seconds on the clock for one of the processor, before a process counts as stuck
EVERY = 10  # problems of which one is verified by the reference line too
ORDERS = 8, 12, 14  # of the reference line
EDGES = 8  # of the zones of all corners, up to which it is asked
KINK = 0.3  # of ell: features narrower than that are where panels of the reference line break
FALLS = 0.05  # its error from level to level at most; slower, and their difference is no error
BELIEVED = 1e-7  # violation of (26) of a reference
MEASURES = (
    "outcome",
    "error",
    "estimate",
    "judge_error",
    "certain",
    "line_error",
    "line_own",
    "zones",
    "unlike",
    "method",
    "seconds",
    "judge_seconds",
    "message",
)


def error(state, cells):
    """max(|dp|, |dM|/ell)/|p| in L2 of a State against cells, also where these are not; its M against its own
    pressures.
    """
    setting, off = cells.setting, ~_among(state.x, joined(zip(cells.left, cells.right)))
    levers, x = setting.levers, np.concatenate((cells.x, state.x[off]))
    weights = np.concatenate((cells.weights, state.weights[off]))
    own = np.array([state.pressure_at(x, corner) for corner in state.pressures])
    p = np.concatenate((cells.pressures.sum(axis=0), np.zeros(off.sum())))
    seen, total = state.micromoment / setting.ell, state.pressure
    moment = 0 * p
    if setting.problem.clamped:
        itself = distance(state.weights, 0 * seen, seen - cells.moment_at(state.x), total)
    else:
        moment = levers @ own / 2 - np.concatenate((cells.micromoment, np.zeros(off.sum())))
        itself = distance(state.weights, 0 * seen, seen - levers @ _of_corners(state) / 2, total)
    load = abs(state.weights @ total / setting.load - 1)
    found = max(distance(weights, own.sum(axis=0) - p, moment, p), itself, load)
    return found if np.isfinite(found) else np.inf


def _of_corners(state):
    """Pressures of a State, array (corners, n)."""
    return np.array(list(state.pressures.values()))


def unlike(state, cells, rtol=CARRIES):
    """What zones of a State and of cells differ in, in words; empty where they are alike.

    A zone that carries TWICE of CARRIES in one must carry half as much in the other, and what lies between
    two zones no more than that or rtol.
    """
    setting, found = cells.setting, []
    kinds = {"contact": slice(None)}
    kinds |= {name: slice(number, number + 1) for number, name in enumerate(setting.problem.law.corners)}
    for name, chosen in kinds.items():
        if len(setting.levers) == 1 and name != "contact":
            continue
        rules = [
            (one.x, one.weights * p[chosen].sum(axis=0) / setting.load, zones[name])
            for one, p, zones in (
                (state, _of_corners(state), state.zones),
                (cells, cells.pressures, cells.named_zones),
            )
        ]
        for (x, load, zones), (other_x, other, _), who in ((*rules, "too many"), (*rules[::-1], "missing")):
            spare = (
                2 * np.interp([sum(pair) / 2 for pair in zones], cells.x, cells.weights) if len(zones) else ()
            )
            for (a, b), more in zip(zones, spare):
                share, more = load[(x >= a) & (x <= b)].sum(), more + 0.05 * (b - a)
                if (
                    share > TWICE * CARRIES
                    and other[(other_x >= a - more) & (other_x <= b + more)].sum() < share / 2
                ):
                    found.append(
                        f"{name} {who} at {(a + b) / 2:.4g}, width {b - a:.2g}, {share:.2g} of the load"
                    )
            for (_, a), (b, _) in zip(zones, zones[1:]):
                inside = (other_x > a + 0.1 * (b - a)) & (other_x < b - 0.1 * (b - a))
                between = other[inside].sum()
                if between > max(TWICE * CARRIES, rtol):
                    found.append(
                        f"{name} {'missing' if who == 'too many' else 'too many'} between {a:.4g} "
                        f"and {b:.4g}, "
                        f"{between:.2g} of the load"
                    )
    return "; ".join(dict.fromkeys(found))


def _among(x, intervals):
    inside = np.zeros(len(x), bool)
    for a, b in intervals:
        inside |= (a <= x) & (x <= b)
    return inside


class Judge:
    """The cells of a draw, made when they are first needed, and finer ones where those do not decide."""

    def __init__(self, draw):
        self.draw, self.problem = draw, draw.problem()
        self.seconds, self.complaint, self.cells, self.own, self.finer = 0.0, "", None, None, False
        self._look(obstacle_cells.MOST)

    def _look(self, most):
        start = time.perf_counter()
        try:
            self.cells, self.own = within(
                JUDGE_LIMIT,
                lambda: obstacle_cells.judged(self.problem, self.draw.load, self.draw.window, most=most),
            )
        except OutOfTime:
            self.finer = True  # finer cells would take longer
            self.complaint = f"judge: stopped after {JUDGE_LIMIT:g} s"
        except (MicroblockError, ArithmeticError, ValueError, np.linalg.LinAlgError) as failure:
            self.complaint = f"judge: {failure}"
        self.seconds += time.perf_counter() - start

    def verdict(self, state, rtol):
        """{measures} of a State."""
        if self.cells is None and not self.finer:
            self._again()
        if self.cells is None:
            return {"outcome": "unjudged", "message": self.complaint}
        limit = max(rtol, state.error_estimate)
        off = error(state, self.cells)
        # where finer cells may say something else
        near = limit < off + self.own and off < limit + SURE * self.own
        if not self.finer and near and (limit >= CARRIES or off > self.own):
            self._again()
            off = error(state, self.cells)
        wrong = off > limit + DOUBT * self.own
        words = unlike(state, self.cells, rtol)
        return {
            "outcome": "wrong" if wrong or words else "ok",
            "error": off,
            "judge_error": self.own,
            "certain": bool(off + self.own <= limit or wrong or words),
            "unlike": words,
            "zones": len(self.cells.named_zones["contact"]),
        }

    def _again(self):
        self.finer = True
        self._look(int(FINER * obstacle_cells.MOST))


def _by_line(state, rtol, reference, own):
    """{measures} of a State against the reference line, where there is one."""
    if reference is None:
        return {}
    off = judged_line.error(state, reference)
    wrong = off > max(rtol, state.error_estimate) + own
    return {"line_error": off, "line_own": own, **({"outcome": "wrong"} if wrong else {})}


def line_reference(judge):
    """(reference of another kind, its own error) where it applies, else None: zones of the cells, edges by
    Newton's method.
    """
    cells = judge.cells
    if cells is None or 2 * sum(map(len, cells.zones.values())) > EDGES:
        return None
    problem = reference_line.Problem(judge.problem, judge.draw.load)
    problem.kinks, problem.mirror = (
        sorted({x for x, width in cells.setting.places if width < KINK * cells.setting.ell}),
        False,
    )
    zones = {corner: list(pairs) for corner, pairs in cells.zones.items()}
    try:
        states = within(PATIENCE, lambda: reference_line.fit(problem, zones, ORDERS))
        breaks = reference_line.breaks(states)
        before, own = (
            reference_line.distance(reference_line.fields(coarse), reference_line.fields(states[-1]), breaks)
            for coarse in states[:-1]
        )
        fine = states[-1]
        if reference_line.violation(fine) > BELIEVED or own > FALLS * before:
            return None
    except (OutOfTime, MicroblockError, ArithmeticError, ValueError, np.linalg.LinAlgError):
        return None
    # the same state, not another one
    far = reference_line.fields(fine)(cells.x)[0] - cells.pressures.sum(axis=0)
    alike = distance(cells.weights, far, 0 * far, cells.pressures.sum(axis=0)) <= 2 * judge.own
    return (fine, own) if alike else None


def runs(seed, number, rtols, every=EVERY):
    """Records of one problem, one for each rtol; of those numbered by a multiple of `every` also against the
    reference line.
    """
    draw = Draw(seed, number)
    judge, line, rows = Judge(draw), None, []
    for rtol in rtols:
        row = {**draw.about, "rtol": rtol, **dict.fromkeys(MEASURES)}
        start = time.process_time()
        try:
            state = within(LIMIT, lambda rtol=rtol: judge.problem.solve(load=draw.load, rtol=rtol))
        except OutOfTime:
            row.update(outcome="slow", message=f"stopped after {LIMIT} s")
        except Exception as failure:  # whatever it is, it is a finding
            row.update(
                outcome="refused" if isinstance(failure, NotConverged) else "crashed",
                message=told_on_a_line(failure),
            )
        row["seconds"] = time.process_time() - start
        if row["outcome"] is None:
            row.update(judge.verdict(state, rtol), estimate=state.error_estimate, method=state.method)
            if every and number % every == 0 and row["outcome"] == "ok":
                line = line or line_reference(judge) or (None, None)
                row.update(_by_line(state, rtol, *line))
        rows.append(row)
    for row in rows:
        row["judge_seconds"] = judge.seconds
    return rows


def result(parameters, quiet=True):
    """The case's object: a row a run, and how often each outcome came, by kind and law."""
    start = time.perf_counter()
    work = [(parameters.seed, number, tuple(parameters.rtols)) for number in range(parameters.scenes)]
    longest = WALL * (LIMIT * len(parameters.rtols) + 2 * JUDGE_LIMIT + PATIENCE)
    with tqdm(total=len(work), disable=quiet, unit="problem") as progress:
        found = answers(runs, work, parameters.workers, longest, progress.update, _lost)
    rows = [row for own in found for row in own]
    return returned(
        parameters, start, table=table(rows), scenes=rows, bad=bad(rows), paths=_paths(parameters, quiet)
    )


def _paths(parameters, quiet):
    """Records of the load paths, see `cases.studies.obstacle_paths`."""
    work = [(parameters.seed, number) for number in range(parameters.paths)]
    with tqdm(total=len(work), disable=quiet, unit="path") as progress:
        return answers(path, work, parameters.workers, 30 * LIMIT, progress.update, path_lost) if work else []


def _lost(arguments, words):
    """Records of a problem whose process had to be stopped, or died."""
    seed, number, rtols = arguments
    return [
        {
            **Draw(seed, number).about,
            "rtol": rtol,
            **dict.fromkeys(MEASURES),
            "outcome": "crashed" if "died" in words else "slow",
            "message": words,
        }
        for rtol in rtols
    ]


def table(rows):
    """One row for each rtol and kind, law, and for all."""
    found = []
    for rtol, of_rtol in grouped(rows, "rtol").items():
        laws = {f"law {law}": own for law, own in grouped(of_rtol, "contact").items()}
        for name, chosen in {**grouped(of_rtol, "kind"), **laws, "all": of_rtol}.items():
            counts = Counter(row["outcome"] for row in chosen)
            own = [row["judge_error"] for row in chosen if row["judge_error"] is not None]
            found.append(
                {
                    "rtol": rtol,
                    "of": name,
                    "runs": len(chosen),
                    **{outcome: counts[outcome] for outcome in OUTCOMES},
                    "certain": sum(bool(row["certain"]) for row in chosen),
                    "line": sum(row["line_error"] is not None for row in chosen),
                    "judge_median": float(np.median(own)) if own else None,
                    "seconds": float(np.mean([row["seconds"] or 0 for row in chosen])),
                }
            )
    return found


def bad(rows):
    """Those that are not ok, the worst first."""
    order = "wrong", "crashed", "slow", "refused", "unjudged"
    return sorted(
        (row for row in rows if row["outcome"] != "ok"),
        key=lambda row: (order.index(row["outcome"]), -(row["error"] or 0), row["number"]),
    )


def told(row):
    """A record on one line."""
    words = [f"number={row['number']}", row["kind"], row["contact"], f"rtol={row['rtol']:g}", row["outcome"]]
    if row["error"] is not None:
        words.append(
            f"error {row['error']:.1e}, estimate {row['estimate']:.1e}, judge {row['judge_error']:.1e}"
        )
    return "  ".join([*words, *(one for one in (row["unlike"], row["message"]) if one)])


def run(parameters, out=None, quiet=False):
    """Verify the sample, print the table and what is not ok, write the records into the folder `out`."""
    answer = result(parameters, quiet)
    if not quiet:
        show(answer)
    if out:
        for name, rows in (
            ("accuracy_obstacles", answer["scenes"]),
            ("accuracy_obstacle_paths", answer["paths"]),
        ):
            if rows:
                kept(
                    out / f"{name}.csv", [{**row, "command": command("accuracy", parameters)} for row in rows]
                )
    return answer


def show(answer):
    """Print the table and what is not ok."""
    print_table(answer["table"], tuple(answer["table"][0]))
    for row in answer["bad"]:
        print(told(row))
    if answer["paths"]:
        counts = Counter(row["outcome"] for row in answer["paths"])
        print("paths:", ", ".join(f"{number} {outcome}" for outcome, number in counts.items()))
    for row in answer["paths"]:
        if row["outcome"] != "ok":
            print(
                "  ".join(
                    (
                        "path",
                        f"number={row['number']}",
                        row["kind"],
                        row["contact"],
                        row["outcome"],
                        row["unlike"] or row["message"] or "",
                    )
                )
            )
