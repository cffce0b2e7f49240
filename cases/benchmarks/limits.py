"""Where methods fail

Every returned result met its tolerance, or says in a warning that it did not; the remaining runs raised an
error or ran out of time.

:Geometry:  problems of `verification`, and others next to a degenerate end of a parameter
:Equations: those of the paper and, with friction, Coulomb's law
:Method:    every method of the toolkit, a question and its seeded problems each
:Reference: a closed form, a second code, a finer method, or a balance of energy
:Units:     processor seconds; errors relative to what is measured

`python -m cases limits` makes the table; the figure is of its record. Where no accuracy is promised an error
above USEFUL counts as a failure.
"""

import math
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import NamedTuple

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from tqdm import tqdm

import microblock as mb
from microblock.data.records import versions
from microblock.errors import require_choice
from microblock.fem import meshes, meshes3d

from .. import strip
from .verification import SEED, doors, judging, lines, scales, space_problems
from .verification.judging import Case
from .verification.obstacles import log

RECORD = Path(__file__).parent / "results" / "limits.csv"
USEFUL = 0.1  # largest relative error of an answer that is of some use
LOAD = math.pi / 2  # under which a classical contact has the half-width 1
ALPHA_MID = 0.8343132323  # where two zones meet, for nu = 0.3 and beta = 1
HIGHEST = 26  # order of panels that judge others
CLAPEYRON = 1e-6  # what a matrix with supports leaves of energy = work/2, and one without does not
# what became of a run, by the classes of `judging`
KINDS = {
    "right": "delivered",
    "error": "typed error",
    "warned": "error above the tolerance, with a warning",
    "wrong": "missed",
    "unjudged": "no verdict",
    "slow": "time limit",
    "crash": "untyped error",
}
SUPPORTS = (
    {"u1": "bottom", "u2": "bottom", "psi": "bottom"},
    {"u1": "bottom", "u2": "bottom"},
    {"u2": "bottom", "psi": "bottom"},
    {"u1": "bottom", "psi": "bottom"},
    {"u1": "bottom"},
    {},
)


class Question(NamedTuple):
    """A row of the table: what is asked of problem k, where it fails, what to do, and whether an accuracy is
    promised.
    """

    text: str
    case: Callable[[int], Case]
    where: str = "nowhere"
    advice: str = ""
    promised: bool = True


def cylinder(alpha, nu=0.3, beta=1.0):
    """The contact problem of a cylinder on a half-plane in units a_Hz = p_Hz = 1."""
    solid = mb.Cosserat(E=20 * (1 - nu**2), nu=nu, ell=alpha, beta=beta)
    return mb.Contact(mb.HalfPlane(solid), mb.Cylinder(10.0), mb.Microblock())


def beside_panels(problem, text, contact):
    """The Case of a discretisation whose error is not estimated, verified by panels."""

    def verify(state):
        true = problem.solve(load=LOAD, rtol=1e-5)
        return lines.error(state, true), None, true.error_estimate

    return Case(text, USEFUL, lambda: contact.solve(load=LOAD), verify)


def meeting_zones(k):
    """Two zones that nearly touch, or have just met; Newton's method of the second code does not settle on
    edges so close, so that panels of the highest order are the judge.
    """
    rng = np.random.default_rng((SEED, 70, k))
    distance = log(rng, 1e-5, 1e-1)
    rtol = log(rng, 1e-8, 1e-2)
    problem = cylinder(ALPHA_MID * (1 + rng.choice((-1, 1)) * distance))

    def verify(state):
        true = problem.with_(method=mb.Panels(order=HIGHEST)).solve(load=LOAD, initial=state)
        return lines.error(state, true), state.error_estimate, 0.0

    text = f"{distance:.0e} from the meeting of two zones"
    return Case(text, rtol, lambda: problem.solve(load=LOAD, rtol=rtol), verify)


def squares(k):
    """Equal squares of one order for all fields, where 2 - beta is small."""
    rng = np.random.default_rng((SEED, 71, k))
    order = int(rng.integers(1, 7))
    problem = cylinder(log(rng, 0.1, 1.0), beta=2 - log(rng, 1e-3, 0.3))
    method = mb.Uniform(h=order * log(rng, 0.15, 0.33), order=order, reach=2.0)
    block = problem.with_(body=mb.Block(problem.solid), method=method)
    return beside_panels(problem, f"order {order}, beta {problem.solid.beta:.4g}", block)


def tall_elements(k):
    """A user's block whose elements are up to 100 times as high as long, or as long as high."""
    rng = np.random.default_rng((SEED, 72, k))
    order = int(rng.integers(1, 5))
    height_over_length = log(rng, 1e-2, 1e2)
    side = order * log(rng, 0.15, 0.33)
    right = meshes3d.graded(2.0, side, 100.0, growth=1.7)
    height = min(side * height_over_length, 50.0)
    depth = meshes3d.graded(height, height, 100.0, growth=1.7)
    names = "bottom", "right", "contact", "left"
    mesh = meshes.rectangles(np.concatenate((-right[:0:-1], right)), -depth[::-1], True, names)
    problem = cylinder(log(rng, 0.1, 1.0))
    body = mb.Body(mesh, problem.solid, order, fixed="bottom")
    text = f"order {order}, height over length {height_over_length:.1e}"
    return beside_panels(problem, text, problem.with_(body=body))


def penalty(k):
    """The penalty on the paper's block."""
    rng = np.random.default_rng((SEED, 73, k))
    problem = cylinder(log(rng, 0.1, 1.0))
    rho = log(rng, 1e-2, 1e6)
    newton = mb.Newton("penalty", rho * (problem.solid.lam + 2 * problem.solid.mu))
    method = mb.Uniform(h=0.25, newton=newton, reach=2.0)
    block = problem.with_(body=mb.Block(problem.solid, 18.0), method=method)
    return beside_panels(problem, f"rho {rho:.1e} (lambda + 2 mu)/a_Hz", block)


def thin_strip(k):
    """Traction, micromoment and layer lengths of the strip in partial contact, on long and short elements."""
    rng = np.random.default_rng((SEED, 75, k))
    elements = int(log(rng, 1, 64))
    order = int(rng.integers(1, 5))
    ell_over_h = log(rng, 0.03, 10.0)
    contact = strip.problem(ell_over_h / elements, 0.1, order=order, elements=elements)
    half = strip.problem(ell_over_h / elements, 0.1, order=8, elements=64)

    def verify(state):
        exact = strip.closed_form(state)
        values = -state.pressure[0], state.micromoment[0], *strip.lengths(state)
        true = exact.traction, exact.micromoment, exact.L_psi, exact.L_u
        return np.abs(np.divide(values, true) - 1).max(), None, 0.0

    text = f"ell over an element {ell_over_h:.2f}, order {order}"
    return Case(text, USEFUL, lambda: contact.solve(approach=strip.full_contact(half) / 2), verify)


def supported(k):
    """A block with more or fewer supports than it needs, verified by Clapeyron: energy is half the work."""
    rng = np.random.default_rng((SEED, 76, k))
    fixed = SUPPORTS[k % len(SUPPORTS)]
    solid = mb.Cosserat(E=2.0, nu=0.3, ell=log(rng, 0.01, 1.0), beta=2 - log(rng, 1e-6, 2.0))
    mesh = meshes.rectangles(np.linspace(-1, 1, 9), np.linspace(-1, 0, 5))
    body = mb.Body(mesh, solid, int(rng.integers(1, 5)), fixed=fixed, contact="top")

    def solve():  # contact problems without supports are errors
        return mb.Contact(body, mb.Cylinder(1.0), mb.Microblock()).solve(load=0.01)

    def verify(state):
        return abs(state.fields.energy() / state.energy - 1), None, 0.0

    return Case(f"fixed {fixed}, beta {solid.beta:.2g}", CLAPEYRON, solve, verify)


def large_friction(k):
    """Pressed, sheared to full slip and back: work is energy and dissipation."""
    rng = np.random.default_rng((SEED, 77, k))
    friction = log(rng, 0.3, 10.0)
    solid = mb.Cosserat(E=1.82, nu=0.3, ell=log(rng, 0.05, 1.0), beta=1.0)
    mesh = meshes.rectangles(np.linspace(-1, 1, 9), np.linspace(-2, 0, 9))
    square = mb.Body(mesh, solid, 2, fixed="bottom", contact="top")
    cylindrical = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(1.0), mb.Microblock(friction=friction))
    problem = (cylindrical, cylindrical.with_(body=square, obstacle=mb.Plane()))[k % 2]
    pairs = [(LOAD, fraction * friction * LOAD) for fraction in (0.0, 0.5, 0.999, -0.999)]

    def verify(state):
        return abs(state.work - state.energy - state.dissipation) / abs(state.work), None, 0.0

    text = f"friction {friction:.2f} on a {('half-plane', 'square')[k % 2]}"
    return Case(text, 1e-8, lambda: problem.history(pairs, rtol=(0.3, None)[k % 2]).states[-1], verify)


QUESTIONS = {
    "panels": Question("Do panels keep the tolerance that is asked for?", partial(lines.fresh, "panels")),
    "obstacles": Question("And under obstacles that are meant to be hard?", lines.hard),
    "zones": Question(
        "And where two zones touch?",
        meeting_zones,
        "within 1e-4 of alpha_mid, rtol below 1e-6",
        "ask for 1e-5, or for the load itself: the event of problem.path()",
    ),
    "cells": Question(
        "Do cells keep the tolerance that is asked for?",
        partial(lines.fresh, "cells"),
        "wedges, rtol below 2e-3",
        "panels",
    ),
    "fitted": Question("Do fitted elements?", partial(lines.fresh, "fitted")),
    "mesh": Question("Does refinement of a user's mesh?", partial(lines.fresh, "body")),
    "space": Question(
        "Do cells of a half-space?",
        space_problems.case,
        "surfaces without an edge to their contact; summits far apart",
        "a window about those that carry",
    ),
    "units": Question("Are digits the same in other units?", scales.case),
    "data": Question(
        "Are samples, heights and files taken as they come, or refused with advice?", doors.case
    ),
    "locking": Question(
        "Do squares of one order for all fields lock towards couple stresses?",
        squares,
        "2 - beta below 0.06, at every order",
        "fitted elements, or panels",
        False,
    ),
    "strip": Question(
        "How wrong are fluxes where a layer is thinner than an element?",
        thin_strip,
        "elements longer than 5 ell, by 100 % and more",
        "elements of a third of ell at order 2; warnings say so",
        False,
    ),
    "stretched": Question(
        "Does the shape of the elements of a user's ground change the contact?",
        tall_elements,
        "elements more than twice as high as long",
        "flat or square elements at the contact",
        False,
    ),
    "penalty": Question(
        "Which rho of the penalty is large enough?",
        penalty,
        "rho a_Hz/(lambda + 2 mu) below 10",
        "the augmented Lagrangian, which needs no rho",
        False,
    ),
    "supported": Question(
        "What becomes of matrices that are singular, or nearly?",
        supported,
        "too few supports; psi free at beta = 0: an error",
        "fix what the error names",
    ),
    "friction": Question(
        "Up to which friction has contact one answer, and is it said beyond?",
        large_friction,
        "friction above 2.3",
        "a smaller friction, or coupled=False",
    ),
}
# curves of the figure: runs to which a tolerance was promised
CURVES = {
    "panels": "panels",
    "hard obstacles": "obstacles",
    "panels at an event": "zones",
    "cells": "cells",
    "fitted elements": "fitted",
    "a user's mesh": "mesh",
    "half-space": "space",
}


def solve(quick=False, only: tuple[str, ...] = (), count=12, seconds=60.0, out=None):
    """Returns the runs of all questions: a table, a row a run.

    Parameters
    ----------
    quick : two runs of each question
    only : names of questions to ask
    count : runs of each question
    seconds : of a run, beyond which it is stopped
    """
    for name in only:
        require_choice(QUESTIONS, only=name)
    runs = [(name, k) for name in only or QUESTIONS for k in range(2 if quick else count)]
    rows = [run(name, k, seconds) for name, k in tqdm(runs, unit="run", disable=None)]
    frame = pd.DataFrame(rows).assign(**{f"version_{name}": value for name, value in versions().items()})
    if out:
        frame.to_csv(out / "limits.csv", index=False)
    return frame


def run(name, k, seconds):
    """The row of problem k of a question."""
    case = QUESTIONS[name].case(k)
    row = judging.outcome(case, seconds)
    kind = KINDS[row.pop("class")]
    if not QUESTIONS[name].promised and kind in (KINDS["wrong"], KINDS["warned"]):
        kind = f"error above {USEFUL:.0%}"
    return {"map": name, "number": k, "text": case.text, "rtol": case.rtol, "kind": kind, **row}


def table(frame):
    """What fails where: a row a question, with the fraction of the runs that fail, by kind."""
    rows = []
    for name, question in QUESTIONS.items():
        kinds = frame.kind[frame["map"] == name]
        fractions = kinds[kinds != KINDS["right"]].value_counts() / max(len(kinds), 1)
        failed = ", ".join(f"{fraction:.0%} {kind}" for kind, fraction in fractions.items())
        if not failed:
            failed = "none" if len(kinds) else "not run"
        rows.append((question.text, len(kinds), failed, question.where, question.advice))
    return pd.DataFrame(rows, columns=("question", "runs", "failed", "where", "what to do"))


def to_dict(frame):
    """Plain data: counts of outcomes by question, and the table; runs are in the file of the folder `out`."""
    return {
        "counts": pd.crosstab(frame["map"], frame.kind).reset_index().to_dict("records"),
        "table": table(frame).to_dict("records"),
    }


def figure(frame=None):
    """Performance profile: the fraction of runs whose true error is below a multiple of the promise."""
    if frame is None:
        frame = pd.read_csv(RECORD)
    drawing, axis = plt.subplots(layout="constrained", figsize=(3.54, 3.2))
    axis.axvline(1, color="0.5", linewidth=0.8)
    for number, (label, name) in enumerate(CURVES.items()):
        runs = frame[frame["map"] == name]
        ratios = np.sort(runs.ratio.dropna().clip(1e-5))
        if len(ratios):
            fractions = np.append(np.arange(len(ratios) + 1), len(ratios)) / len(runs)
            style = ("-", "--", "-.", ":")[number % 4]
            axis.step([1e-5, *ratios, 1e2], fractions, style, where="post", label=label)
    axis.set(
        xscale="log",
        xlim=(1e-5, 1e2),
        ylim=(0, 1.05),
        xlabel="true error over promised error",
        ylabel="fraction of runs",
    )
    drawing.legend(*axis.get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return drawing
