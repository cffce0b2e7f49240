"""How soon an interactive session answers: a new state, and a drawn frame, while one parameter moves.

Geometry   cylinder on a half-plane, as in `hertz`, and on a block of depth and half-width 6; a_ref = 1 at load and radius 1.
Equations  those of `hertz`.
Model      halfplane (on panels; on `cells`), finite elements condensed once (`body`); `microblock.Explorer` as the sliders of
           `scene.explore()` use it: each state starts from the last two.
Reference  none: times on this machine; the aims are 20 ms for a state and 100 ms for a frame.
Look at    the 95th percentile beside the median: frames in which the number of zones changes, or an axis gets other ends.
Units      milliseconds; a frame is the new state, the new data and the PNG of the whole picture. `elapsed` is what one waits,
           `processor` what this process used of it (other programs on the machine widen both).
"""

import math
import time
from dataclasses import dataclass

import numpy as np
from matplotlib.ticker import LogLocator, NullFormatter
from tqdm import tqdm

from cases.options import command, option
from cases.records import keep, returned
from microblock import meshes, plots
from microblock.body import Body
from microblock.errors import BadArgument, NotConverged, require_positive, require_tolerance
from microblock.explorer import LAWS, Explorer
from microblock.grid_contact import GridContact
from microblock.halfplane import HalfPlane
from microblock.law import Microblock
from microblock.material import Cosserat
from microblock.obstacles import Cylinder
from microblock.scene import Contact
from microblock.study import column, grouped

NU = 0.3
LOAD = math.pi/2       # with E* = 2, R = 1: a_ref = 1
LINES = "-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (1, 3))
AIMS = {"state": 20.0, "frame": 100.0}
# load over the first; psi0 R/a_ref
SLIDERS = {"load": (0.3, 2.0), "radius": (0.5, 2.0), "alpha": (0.1, 1.5), "psi0": (-0.1, 0.1)}


@dataclass(frozen=True)
class Parameters:
    alpha: float = option(0.25, "ell over a_ref where it does not move")
    psi0: float = option(0.05, "psi0 (radians, with R = a_ref) of the turned blocks where it does not move")
    steps: int = option(80, "positions of a slider from one end to the other", int)
    rtol: float = option(1e-3, "accuracy asked for")

    def __post_init__(self):
        require_positive(alpha=self.alpha)
        require_tolerance(self.rtol)
        if not abs(self.psi0) < 1:
            raise BadArgument("psi0", self.psi0, "must be below 1 in absolute value")
        if not 2 <= self.steps <= 10_000:
            raise BadArgument("steps", self.steps, "must lie between 2 and 10000")


def explorer(parameters, name):
    """The session of one of RUNS."""
    solid = Cosserat(E=2*(1 - NU**2), nu=NU, ell=parameters.alpha, beta=1)
    blocks = LAWS[name]() if name in LAWS else Microblock(parameters.psi0 if name == "turned" else 0.0)
    if name == "body":
        mesh = meshes.uniform(meshes.Ground(far=6.0, reach=(-3.0, 3.0), half=False), 0.2)
        return Explorer(Contact(Body(mesh, solid, order=3, fixed="bottom"), Cylinder(1.0), blocks), LOAD)
    if name == "cells":
        return Explorer(GridContact(HalfPlane(solid), Cylinder(1.0), blocks, window=(-4.0, 4.0)), LOAD)
    return Explorer(Contact(HalfPlane(solid), Cylinder(1.0), blocks), LOAD, parameters.rtol)


# {what is pressed: sliders}; alpha of a body is another matrix, and no matter of a frame
RUNS = {"microblock": tuple(SLIDERS), "turned": ("load", "radius", "alpha"), "unilateral": ("load", "radius", "alpha"),
        "microclamped": ("load", "radius", "alpha"), "cells": tuple(SLIDERS), "body": ("load", "radius", "psi0")}


def clocked(work):
    """(elapsed, processor) time of a call in milliseconds."""
    elapsed, processor = time.perf_counter(), time.process_time()
    work()
    return 1e3*(time.perf_counter() - elapsed), 1e3*(time.process_time() - processor)


def solve(parameters, name, slider):
    """Records of one slider from end to end, a row a frame; one without a state says why."""
    session, rows = explorer(parameters, name), []
    first, last = np.array(SLIDERS[slider])*(LOAD if slider == "load" else 1.0)
    session.update(**{slider: float(first)})      # the way to the end of the slider is a jump, and not looked at
    session.png()
    for value in np.linspace(first, last, parameters.steps + 1)[1:]:
        row = {"blocks": name, "slider": slider, "value": float(value), "failure": None}
        try:
            state = clocked(lambda: session.solve(**{slider: float(value)}))
        except NotConverged as failure:
            rows.append({**row, "failure": " ".join(str(failure).split())})
            continue
        drawn = clocked(lambda: session.show() or session.png())
        rows.append({**row, "state_elapsed": state[0], "state_processor": state[1], "frame_elapsed": state[0] + drawn[0],
                     "frame_processor": state[1] + drawn[1], "error_estimate": session.state.error_estimate})
    return rows


def digest(rows):
    """Median, 95th percentile and largest of each time, and how many of the frames have no state."""
    drawn = [row for row in rows if not row["failure"]]
    found = {"frames": len(rows), "failed": len(rows) - len(drawn)}
    for what in AIMS:
        for clock in ("elapsed", "processor"):
            times = np.array(column(drawn, f"{what}_{clock}")) if drawn else np.full(1, np.nan)
            found[f"{what}_{clock}"] = [float(np.percentile(times, share)) for share in (50, 95, 100)] if drawn else None
    return found


def result(parameters, quiet=True):
    """The case's object: a digest for each slider and for all of them, and the frames."""
    start = time.perf_counter()
    explorer(parameters, "microblock").png()      # tables, fonts
    ready = time.perf_counter()
    runs = [(name, slider) for name, sliders in RUNS.items() for slider in sliders]
    frames = [row for run in tqdm(runs, disable=quiet, unit="slider") for row in solve(parameters, *run)]
    digests = [{"blocks": name, "slider": slider, **digest(rows)} for name, own in grouped(frames, "blocks").items()
               for slider, rows in grouped(own, "slider").items()]
    return returned(parameters, ready, ready - start, aims=AIMS, all=digest(frames), sliders=digests, frames=frames)


def run(parameters, out=None, quiet=False):
    """Move every slider, print a table, draw the times into the folder `out`."""
    answer = result(parameters, quiet)
    if not quiet:
        show(answer)
    if out:
        keep(out, "frames", rows(parameters, answer), figure)
    return answer


def show(answer):
    """Milliseconds elapsed, a line for each slider; then those of the processor for all."""
    print(f"milliseconds elapsed: median, 95th percentile, largest{'state':>15}{'frame':>30}")
    for row in answer["sliders"]:
        print(f"{row['blocks']:>13} {row['slider']:>7} {_three(row['state_elapsed'])} {_three(row['frame_elapsed'])}"
              + (f"  {row['failed']} failed" if row["failed"] else ""))
    for clock in ("elapsed", "processor"):
        total = answer["all"]
        print(f"{'all, ' + clock:>21} {_three(total[f'state_{clock}'])} {_three(total[f'frame_{clock}'])}")
    print(f"aims: a state in {AIMS['state']:g} ms, a frame in {AIMS['frame']:g} ms")


def _three(times):
    return f"{'failed':>30}" if times is None else "".join(f"{each:>10.1f}" for each in times)


def rows(parameters, answer):
    """A row a frame."""
    return [{"command": command("frames", parameters), **row} for row in answer["frames"]]


def records(parameters):
    """What `figure` draws."""
    return rows(parameters, result(parameters))


def figure(records):
    """How soon a slider is answered on this machine: share of frames (a) whose state, (b) that as a whole took no longer than a
    time; dotted: the aims of 20 ms and 100 ms, and 95 percent.
    """
    drawing, axes = plots.figure(1, 2)
    for axis, (what, aim), letter in zip(axes, AIMS.items(), "ab"):
        for (name, rows), colour, style in zip(grouped(records, "blocks").items(), plots.COLOURS, LINES):
            times = np.sort([row[f"{what}_elapsed"] for row in rows if not row["failure"]])
            axis.semilogx(times, np.arange(1, len(times) + 1)/len(times), linestyle=style, color=colour, label=name)
        axis.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axis.xaxis.set_major_formatter("{x:g}")
        axis.xaxis.set_minor_formatter(NullFormatter())
        axis.axvline(aim, color="0.5", linestyle=":", linewidth=0.8)
        axis.axhline(0.95, color="0.5", linestyle=":", linewidth=0.8)
        axis.set(xlabel=f"time of a {what} (ms)", ylabel="share of frames", title=f"({letter}) {what}", ylim=(0, 1.02))
    plots.legend_of_all(drawing, axes[0], columns=3)
    return drawing
