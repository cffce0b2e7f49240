"""Size effects under the cylinder: width, pressure and hardness over alpha (Figs 10, 11).

Geometry   the cylinder on the half-plane of `hertz`, at fixed load.
Equations  those of `hertz`, for the microblock and the unilateral law.
Model      halfplane: the contact line alone. fe: fitted finite elements, the nominal hardness on the domain
           of 18 a_Hz, alpha_mid also as uniform bilinear elements see it.
Reference  alpha -> 0: the Hertz contact, hardness 1; alpha_mid from two sides of coalescence.
Look at    width and hardness going opposite ways for the two laws; real and apparent hardness parting at
           alpha_mid.
Units      those of `hertz`; hardness over P/(2 a_Hz).
"""

import math
import time
from dataclasses import dataclass, replace

from tqdm import tqdm

import microblock as mb
from microblock.data.records import column

from ..common.options import Checked, coupling, option, poisson
from ..common.records import print_table, returned
from . import hertz, size_effect_fe

ALPHAS = (
    0.01,
    0.02,
    0.05,
    0.1,
    0.2,
    0.25,
    0.35,
    0.5,
    0.65,
    0.75,
    0.8,
    0.83,
    0.84,
    0.86,
    0.9,
    1.0,
    1.125,
    1.25,
)
RTOLS = {"halfplane": 1e-6, "fe": 1e-4}
LAWS = ("microblock", "unilateral")
COARSE = (6, 8, 10, 12, 14)  # orders of the panels for alpha_mid over the size of a panel's Gauss spacing
KEPT = ("half_width", "inner_half_width", "pressure_max", "hardness_apparent", "hardness_real")


@dataclass(frozen=True)
class Parameters(Checked):
    alphas: tuple = option(ALPHAS, "ratios ell/a_Hz", above=0, nargs="+", metavar="ALPHA")
    nu: float = poisson()
    beta: float = coupling()
    model: str | None = option(
        None,
        "fe or halfplane; without it the smallest that can answer, halfplane",
        str,
        choices=("fe", "halfplane"),
    )
    rtol: float | None = option(
        None,
        "relative L2 error of pressure and micromoment (1e-6 by halfplane, 1e-4 by fe)",
        above=0,
        below=1,
    )

    def relate(self):
        if self.rtol is None:
            object.__setattr__(self, "rtol", RTOLS[self.model or "halfplane"])

    def hertz(self, alpha, contact):
        """The parameters of `hertz` at one alpha."""
        return hertz.Parameters(
            alpha=alpha, nu=self.nu, beta=self.beta, contact=contact, model=self.model, rtol=self.rtol
        )


def coalescence_ratio(nu, beta, order=14):
    """alpha_mid, at which the two zones of partial contact touch, and its error.

    By scaling it is ell over the a_Hz that belongs to the load of coalescence.
    """
    solid = mb.Cosserat(E=2 * (1 - nu**2), nu=nu, ell=1.0, beta=beta)  # E* = 2: a_Hz^2 = 2 P R/pi
    problem = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(1.0), mb.Microblock())
    load, error = problem.solver.coalescence(order)
    alpha = 1 / math.sqrt(2 * load / math.pi)
    return alpha, alpha * error / load / 2


def result(parameters, quiet=True):
    """The contract's object."""
    start = time.perf_counter()
    if parameters.model == "fe":
        return _by_finite_elements(parameters, quiet, start)
    alpha_mid, error = coalescence_ratio(parameters.nu, parameters.beta)
    # panels have no h: it is the Gauss spacing over a_Hz at an edge panel of length ell, for ascending orders
    of_order = [
        (alpha_mid / order, coalescence_ratio(parameters.nu, parameters.beta, order)[0]) for order in COARSE
    ]
    laws = _laws(parameters, quiet)
    return returned(
        replace(parameters, model="halfplane"),
        start,
        laws=laws,
        alpha_mid=alpha_mid,
        alpha_mid_error=error,
        alpha_mid_of_h=of_order,
        warnings=["hardness_nominal needs an approach, which a half-plane has not: null"],
    )


def _laws(parameters, quiet):
    """{law: rows} of the contract, without the nominal hardness."""
    laws = {contact: [] for contact in LAWS}
    progress = tqdm(LAWS, disable=quiet, unit="law")
    for contact in progress:
        for alpha in parameters.alphas:
            progress.set_description(f"{contact}, alpha = {alpha:g}")
            chosen = parameters.hertz(alpha, contact).resolved()
            ((state, estimate),) = hertz.solve(chosen)
            seen = hertz.observe(chosen, state, estimate)
            laws[contact].append(
                {
                    "alpha": alpha,
                    **{name: seen[name] for name in KEPT},
                    "hardness_nominal": None,
                    "hardness_nominal_error": None,
                    "error_estimate": estimate,
                    "profile": seen["profile"],
                }
            )
    return laws


def fe_laws(parameters, quiet=True):
    """{law: rows} by finite elements, with the nominal hardness over its value for alpha -> 0."""
    laws = _laws(parameters, quiet)
    classical, classical_error = size_effect_fe.classical_hardness(
        lambda alpha: parameters.hertz(alpha, "unilateral").resolved()
    )
    for contact, found in laws.items():
        for row in found:
            chosen = parameters.hertz(row["alpha"], contact).resolved()
            nominal, error = size_effect_fe.nominal_hardness(chosen)
            row |= {
                "hardness_nominal": nominal / classical,
                "hardness_nominal_error": (error + classical_error) / classical,
            }
    return laws


def _by_finite_elements(parameters, quiet, start):
    """The contract's object from finite elements: with the nominal hardness, and alpha_mid as bilinear
    elements see it.
    """
    nu, beta = parameters.nu, parameters.beta
    laws = fe_laws(parameters, quiet)
    alpha_mid, error = size_effect_fe.coalescence_ratio(nu, beta)
    return returned(
        parameters,
        start,
        laws=laws,
        alpha_mid=alpha_mid,
        alpha_mid_error=error,
        alpha_mid_of_h=size_effect_fe.ratio_of_h(nu, beta),
        warnings=[],
    )


def show(answer):
    print(f"alpha_mid = {answer['alpha_mid']:.10f} +- {answer['alpha_mid_error']:.1e}")
    print_table(
        [{"law": law, **row} for law, found in answer["laws"].items() for row in found],
        ("law", "alpha", *KEPT),
        9,
    )


def rows(parameters, answer):
    """A row for each law and alpha."""
    common = {
        "model": parameters.model or "halfplane",
        "alpha_mid": answer["alpha_mid"],
        "alpha_mid_error": answer["alpha_mid_error"],
    }
    return [
        {"contact": contact, **{name: value for name, value in row.items() if name != "profile"}, **common}
        for contact, found in answer["laws"].items()
        for row in found
    ]


def figure(records):
    """Apparent and real hardness over 1/alpha for both laws."""
    from matplotlib.ticker import LogFormatter

    from microblock.view import plots

    drawing, axis = plots.figure(height=3.0)
    curves = (
        ("microblock", "hardness_apparent", "o-"),
        ("microblock", "hardness_real", "s--"),
        ("unilateral", "hardness_apparent", "^-"),
    )
    for contact, name, style in curves:
        chosen = [row for row in records if row["contact"] == contact]
        axis.semilogx(
            [1 / row["alpha"] for row in chosen],
            column(chosen, name),
            style,
            label=f"{contact}, {name.split('_')[1]}",
        )
    axis.axvline(1 / records[0]["alpha_mid"], color="0.6", linewidth=0.7, linestyle=":")
    for which in (axis.xaxis.set_major_formatter, axis.xaxis.set_minor_formatter):
        which(LogFormatter())  # plain numbers, and no minor ones over decades
    axis.set(xlabel=r"$1/\alpha$", ylabel=r"$H/H_\mathrm{Hz}$")
    plots.legend_below(axis)
    return drawing


FIGURES = {"size_effect": (rows, figure)}
