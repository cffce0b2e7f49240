"""A page that is alive without server, network or Python: a cylinder on rotated microblocks.

    python -m cases playground --out DIR

The table of states takes minutes. It is kept in cases/data/playground.json, from which the report makes its
page; the command computes it anew, and with --out cases/data keeps it.

Geometry   half-plane x2 < 0 with blocks of side ell at each point of its surface, rotated by psi0; a cylinder
           x^2/(2 R) is pressed on it with a force P per thickness: the case `hertz`.
Equations  (10)-(18) in the half-plane, (20)-(22) and (26) on its surface.
Model      states of panels on the contact line, made beforehand and interpolated in between. By similarity a
           state at fixed nu and beta depends on ell/a_Hz and psi0 R/a_Hz alone, both at its own load, as long
           as a_Hz/R is small: so the table has two dimensions, not three, and the load moves along a curve in
           it. Zones are born, meet and part on curves of that plane: between them states are interpolated on
           pieces that move with the edges, along the curves the states of both sides are blended.
Reference  the same states, computed: in the middle of each cell of the table, from which the page has the
           error that it shows, and at --checks other places.
Look at    DIR/playground.html. Zones part above alpha_mid = 0.834; psi0 opens one corner; at a large load
           both are closed. The address can name a state: playground.html#load=2&alpha=0.5&psi0=0.2.
Units      lengths over a_Hz, pressures over p_Hz, M over p_Hz ell, angles over a_Hz/R: on the page at load 1,
           in the answer at the state's own load. Errors are relative, in L2, of pressure and micromoment over
           ell; `gap_error_max` is that of the mean gap of the corners, over a_Hz^2/R. hertz, with a_Hz/R =
           0.034, differs by what psi0 adds to the levers (`hertz_difference`).
"""

import json
import math
import time
from contextlib import ExitStack
from dataclasses import dataclass

import numpy as np
from tqdm import tqdm

from microblock import __version__
from microblock.data.records import write_text
from microblock.data.sweeps import processes
from microblock.errors import NotConverged

from ..common.catalog import DATA, PROGRAM
from ..common.options import Checked, command, option
from ..common.records import print_table, returned
from ..scenes import hertz
from .playground_map import SAFETY
from .playground_page import packed, unpacked, written
from .playground_states import BETA, NU, SLOPE, error, gap_error, sampled, solve
from .playground_survey import ALONE, Survey, middles

PAGE, KEPT = "playground.html", "playground.json"
LARGEST = 3_000_000  # bytes of the page
SPAN = 0.0141, 9.0  # of alpha at the state's own load: a little more than the sliders reach
# psi0 over a_Hz/R, and alpha, of states that tell what psi0 adds to the levers of `hertz`
ROTATED = (0.25, 0.4), (0.25, 1.0), (1.0, 0.3)
# of the seeded checks: psi0 up to where zones change
CHECKED, SEED = 0.6, 1


@dataclass(frozen=True)
class Parameters(Checked):
    fineness: float = option(
        1.0, "how many times closer than usual the states of the table are", at_least=0.2, at_most=4
    )
    checks: int = option(40, "states at random places that are computed for comparison", int, at_least=0)
    workers: int = option(1, "processes", int, at_least=1, at_most=64)


class Work:
    """Calls of a function on many arguments, in this process or in several, with a bar that counts them."""

    def __init__(self, workers, quiet):
        self.workers, self.quiet, self.done, self._open = workers, quiet, 0, ExitStack()

    def __enter__(self):
        self._pool = self._open.enter_context(processes(self.workers)) if self.workers > 1 else None
        return self

    def __exit__(self, *failure):
        return self._open.__exit__(*failure)

    def __call__(self, function, work, words):
        """[function(*arguments) for arguments in work]."""
        self.done += len(work)
        calls = (function(*one) for one in work)
        if self._pool is not None:
            waiting = [self._pool.schedule(function, one) for one in work]
            calls = (one.result() for one in waiting)
        return list(tqdm(calls, desc=words, total=len(work), disable=self.quiet, unit=" states"))


def judge(found, work):
    """Give each patch of a Map the errors of its cells and strips; the largest error of their mean gaps."""
    places = middles(found)
    arguments = []
    for patch, _, _, alpha, psi0 in places:
        law = "unilateral" if patch is found.unilateral else "microblock"
        if patch.columns == 1:  # far from the curve where A is born, and from ALONE
            psi0 = (psi0 + ALONE) / 2
        arguments.append((found.at(alpha, psi0, law), alpha, psi0, law))
    for patch in (*found.patches, found.unilateral):
        patch.errors, patch.strip = np.zeros(patch.cells), np.zeros(patch.cells[0])
    errors = work(deviations, arguments, "errors of cells")
    for (patch, i, j, *_), (own, _) in zip(places, errors):
        if j is None:
            patch.strip[i] = own
        else:
            patch.errors[i, j] = own
    return max(gap for _, gap in errors)


def deviations(given, alpha, psi0, law="microblock"):
    """Errors of a Sampled against the state itself: of pressure and micromoment, and of the mean gap."""
    state = solve(alpha, psi0, law)
    return tuple(function(given, state, alpha, psi0, law) for function in (error, gap_error))


def deviation(given, alpha, psi0):
    """The first of the `deviations`, which the page shows."""
    return deviations(given, alpha, psi0)[0]


def checked(found, number, work):
    """Errors at seeded places, and what the page shows there."""
    random = np.random.default_rng(SEED)
    alphas = np.exp(random.uniform(*np.log(SPAN), number))
    places = [
        (float(alpha), float(psi0)) for alpha, psi0 in zip(alphas, random.uniform(-CHECKED, CHECKED, number))
    ]
    errors = work(deviation, [(found.at(*place), *place) for place in places], "checks")
    return [
        {"alpha": alpha, "psi0": psi0, "error": own, "error_shown": found.error(alpha, psi0)}
        for (alpha, psi0), own in zip(places, errors)
    ]


def difference_of_hertz(alpha, psi0):
    """What the levers 1 + psi0 and 1 - psi0 of the case `hertz` change."""
    usual = hertz.Parameters(alpha=alpha)
    slope = usual.a_Hz / usual.R
    return error(sampled(solve(alpha, psi0)), solve(alpha, psi0, slope=slope), alpha, psi0)


def summary(patch):
    """What the answer says of a patch."""
    return {
        "zones": patch.name,
        "alpha_from": patch.span[0],
        "alpha_to": patch.span[1],
        "states": len(patch.rows) * patch.columns,
        "error_median": float(np.median(patch.errors)),
        "error_max": float(patch.errors.max()),
        "strip_error_max": float(patch.strip.max()),
    }


def percent(number):
    return f"{100 * number:.2g}\N{NO-BREAK SPACE}%"


def fitting(page):
    """The page; NotConverged where it is too large to be handed on."""
    size = len(page.encode())
    if size > LARGEST:
        raise NotConverged(
            f"the page would have {size} bytes, more than {LARGEST}: take a smaller --fineness"
        )
    return page


def made(parameters, quiet=True):
    """(the case's object, what is kept of the table)."""
    start = time.perf_counter()
    with Work(parameters.workers, quiet) as work:
        # as the page has it, with its numbers of two bytes
        found = unpacked(packed(Survey(SPAN, parameters.fineness, work).map()))
        gap = judge(found, work)
        checks = checked(found, parameters.checks, work)
    difference = max(difference_of_hertz(*place) for place in ROTATED)
    patches = [summary(patch) for patch in (*found.patches, found.unilateral)]
    median = float(
        np.median(np.concatenate([one.errors.ravel() for one in (*found.patches, found.unilateral)]))
    )
    largest = max(max(one["error_max"], one["strip_error_max"]) for one in patches)
    states = sum(one["states"] for one in patches)
    above = sum(one["error"] > one["error_shown"] for one in checks)
    facts = {
        "states": states,
        "computed": work.done,
        "median": percent(median),
        "largest": percent(largest),
        "gap": f"{gap:.1g}",
        "difference": percent(difference),
        "safety": SAFETY,
        "checks": len(checks),
        "above": above,
        "checked": percent(max((one["error"] for one in checks), default=0.0)),
        "version": __version__,
        "command": command("playground", parameters),
    }
    kept = {"facts": facts, "map": packed(found)}
    answer = returned(
        parameters,
        start,
        nu=NU,
        beta=BETA,
        a_Hz_over_R=SLOPE,
        states=states,
        states_computed=work.done,
        bytes=len(page(kept).encode()),
        error_median=median,
        error_max=largest,
        gap_error_max=gap,
        hertz_difference=difference,
        checks_above=above,
        patches=patches,
        checks=checks,
    )
    return answer, kept


def page(kept):
    """The page of a table as text."""
    return fitting(written(kept["map"], kept["facts"]))


def kept_page(path=DATA / KEPT):
    """The page of the table that is kept, as text.

    Raises
    ------
    NotConverged
        If there is none.
    """
    if not path.exists():
        raise NotConverged(f"no {KEPT} in {path.parent}: {PROGRAM} playground --out {path.parent}")
    return page(json.loads(path.read_text()))


def result(parameters, quiet=True):
    """The case's object."""
    return made(parameters, quiet)[0]


def run(parameters, out=None, quiet=False):
    """Make the page, print what is known of its errors, and write it and its table into the folder `out`."""
    answer, kept = made(parameters, quiet)
    if not quiet:
        show(answer)
    if out:
        write_text(out / PAGE, page(kept))
        write_text(out / KEPT, json.dumps(kept, allow_nan=False))
    return answer


def show(answer):
    """Errors of the patches, and of the checks."""
    print_table(answer["patches"], tuple(answer["patches"][0]), 3)
    worst = max((one["error"] for one in answer["checks"]), default=math.nan)
    print(
        f"{answer['states']} states, {answer['bytes']} bytes; error {answer['error_median']:.1e} in the "
        f"median, {answer['error_max']:.1e} at most; at {len(answer['checks'])} other places {worst:.1e} at "
        f"most, {answer['checks_above']} times above what is shown; hertz differs by "
        f"{answer['hertz_difference']:.1e}"
    )
