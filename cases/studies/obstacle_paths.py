"""Load paths under the obstacles of `cases.studies.obstacle_sample`: the zones that their events tell of,
beside those of cells.

Events tell how many zones of each kind there are at any load. Cells are solved on either side of each event
and at random loads; what they count has two bounds: zones that carry much, with what hardly parts them
closed, and all of them. A gap between two zones of the path's own state, or a zone, that is narrower than
what cells see counts on neither side.
"""

import time

import numpy as np

from microblock.errors import MicroblockError, NotConverged

from . import obstacle_cells
from .limits_pool import OutOfTime, told_on_a_line, within
from .obstacle_sample import CARRIES, JUDGE_LIMIT, LIMIT, TWICE, Draw

# of the load, where cells look on either side of an event; more if its error is larger
BESIDE = 0.03
LOOKS = 6  # events of a path, the latest ones, beside which cells are looked at
RANDOM = 3  # random loads between a tenth of the last one and the last
APART = 1e-3  # of the load: cells do not tell states apart that are nearer to an event
TIMES = 4  # LIMIT, for the events of a path
STEPS = {"born": 1, "split": 1, "vanished": -1, "merged": -1}
NARROW = 0.05  # of the narrower of two zones, or of ell: what is as narrow is not told from nothing


def count(events, zone, load):
    """How many zones of a kind there are at a load, as events tell."""
    return sum(STEPS[event.kind] for event in events if event.zone == zone and event.load <= load)


def bounds(cells, zone):
    """(least, most) zones of a kind that a right path may tell of at the load of these cells."""
    corners = {name: [number] for number, name in enumerate(cells.setting.problem.law.corners)}.get(
        zone, slice(None)
    )
    force = cells.weights * cells.pressures[corners].sum(axis=0) / cells.setting.load
    zones = cells.named_zones[zone]
    carries = [force[(cells.x >= a) & (cells.x <= b)].sum() > TWICE * CARRIES for a, b in seen(zones, cells)]
    return sum(carries), len(zones)


def seen(zones, cells):
    """Intervals without those, and without the gaps between them, that cells do not tell from nothing."""
    joined = []
    for a, b in zones:
        size = np.interp((a + b) / 2, cells.x, cells.weights)
        if b - a <= max(3 * size, NARROW * cells.setting.ell):
            continue
        if joined and a - joined[-1][1] <= max(NARROW * min(b - a, joined[-1][1] - joined[-1][0]), 3 * size):
            joined[-1] = joined[-1][0], b
        else:
            joined.append((a, b))
    return joined


def beside(events, last, rng):
    """Loads at which cells look: on either side of the latest events, no other between, and random ones."""
    loads = sorted({event.load for event in events if event.load > 1e-3 * last})[-LOOKS:]
    every = np.array(sorted({event.load for event in events} | {0.0, last * (1 + BESIDE)}))
    found = list(last * 10 ** -rng.uniform(0, 1, RANDOM))
    for load in loads:
        error = max(event.load_error for event in events if event.load == load)
        for sign in (-1, 1):
            ahead = every[every > load] if sign > 0 else every[every < load][::-1]
            way = (
                min(max(BESIDE * load, 3 * error), abs(ahead[0] - load) / 2) if len(ahead) else BESIDE * load
            )
            if way > max(1.5 * error, APART * load) and 0 < load + sign * way <= last:
                found.append(load + sign * way)
    return sorted(map(float, found))


BLANK = {
    "outcome": None,
    "events": None,
    "looked": 0,
    "unjudged": 0,
    "unlike": "",
    "seconds": None,
    "message": None,
}


def path_lost(arguments, words):
    """Record of a path whose process had to be stopped, or died."""
    return {
        **Draw(*arguments).about,
        **BLANK,
        "outcome": "crashed" if "died" in words else "slow",
        "message": words,
    }


def path(seed, number):
    """Record of one path: what disagrees, at which loads."""
    draw = Draw(seed, number)
    row = {**draw.about, **BLANK}
    start, problem = time.perf_counter(), draw.problem()
    try:
        followed = problem.path(load=draw.load)
        events = within(TIMES * LIMIT, lambda: followed.events)
    except OutOfTime:
        return {
            **row,
            "outcome": "slow",
            "seconds": time.perf_counter() - start,
            "message": f"stopped after {TIMES * LIMIT} s",
        }
    except Exception as failure:  # whatever it is, it is a finding
        return {
            **row,
            "outcome": "refused" if isinstance(failure, NotConverged) else "crashed",
            "seconds": time.perf_counter() - start,
            "message": told_on_a_line(failure),
        }
    row.update(events=len(events), seconds=time.perf_counter() - start)
    words = []
    for load in beside(events, draw.load, np.random.default_rng([seed, number, 1])):
        try:
            cells, _ = within(
                JUDGE_LIMIT, lambda load=load: obstacle_cells.judged(problem, load, draw.window, enough=3e-3)
            )
            state = within(LIMIT, lambda load=load: followed.at(load))
        except (OutOfTime, MicroblockError, ArithmeticError, ValueError, np.linalg.LinAlgError):
            row["unjudged"] += 1
            continue
        row["looked"] += 1
        for zone in ("contact",) if len(cells.pressures) == 1 else ("A", "B", "full", "contact"):
            told, (least, most) = count(events, zone, load), bounds(cells, zone)
            own = state.zones[zone]
            if not (least <= told and told - len(own) + len(seen(own, cells)) <= most):
                words.append(f"{zone}: {told} at load {load:.6g}, cells {least} to {most}")
    return {
        **row,
        "outcome": "wrong" if words else "ok" if row["looked"] else "unjudged",
        "unlike": "; ".join(words),
    }
