"""Ten loads the paper's way and on fitted meshes: time at a tenth of the error.

Geometry   the cylinder on the half-plane of `hertz`, aligned blocks; loads up to P, ascending.
Equations  those of `hertz`.
Model      the paper's way: squares of side --h on the domain of 18 a_Hz, bilinear elements, augmented Lagrangian Newton,
           load by load from first touch. Fitted: the domain of 1000 a_Hz, every load meshed and refined for itself from
           nothing, twice: "asked" for a tenth of the error that the paper's way has at that load, and with a loose rtol
           at which a tenth is "obtained", since the estimate is on the safe side.
Reference  the half-plane at rtol 1e-8 judges both, max(|dp|, |dM|/ell)/|p| in L2 between the nodes too.
Look at    `ratio`: processor time of the paper's way over that of all fitted loads; `worst`: the largest obtained error
           over a tenth of the paper's (1 and below: kept). At its own nodes alone the paper's way errs less: `nodes`.
Units      those of `hertz`; seconds of one thread, assembly, factors and all passes counted.
"""

import time
from dataclasses import dataclass

import numpy as np

from cases import hertz, hertz_fe
from cases.options import command, option
from cases.records import keep, returned
from microblock import plots
from microblock.errors import BadArgument, require_finite
from microblock.halfplane import gauss_rule
from microblock.observables import distance
from microblock.panels import zone_edges
from microblock.study import column

LOADS = tuple(round(0.1*step, 1) for step in range(1, 11))
SHARE = 0.1              # of the error of the paper's way, asked for on fitted meshes
DOMAIN = "18"            # of the paper, over a_Hz
LOOSE = 1e-2             # rtol at which a tenth is obtained for the paper's h; `worst` tells whether it is
BESIDE = 1e-13           # a step aside of breaks between the panels of the half-plane
REFERENCE_RTOL = 1e-8    # of the half-plane that judges
POINTS = 6               # Gauss points of the judge between two nodes, edges or quarter points


@dataclass(frozen=True)
class Parameters:
    alpha: float = option(0.25, "ell over a_Hz")
    loads: tuple = option(LOADS, "loads as multiples of P", nargs="+", metavar="LOAD")
    h: float = option(hertz_fe.PAPER_H, "side of the paper's squares over a_Hz")
    nu: float = option(0.3, "Poisson's ratio, -1 < nu < 1/2")
    beta: float = option(1.0, "coupling number, 0 < beta < 2")

    def __post_init__(self):
        object.__setattr__(self, "loads", tuple(float(load) for load in self.loads))
        require_finite(h=self.h)
        if not 0 < self.h <= 1:
            raise BadArgument("h", self.h, "must lie between 0 and 1")
        self.paper, self.judge      # bad values are named here

    def scene(self, **changes):
        return hertz.Parameters(**{"alpha": self.alpha, "nu": self.nu, "beta": self.beta, "loads": self.loads, **changes})

    @property
    def paper(self):
        """The paper's way, as parameters of `hertz`."""
        return self.scene(model="fe", mesh="uniform", method="al", h=self.h, order=1, domain=DOMAIN).resolved()

    @property
    def judge(self):
        return self.scene(rtol=REFERENCE_RTOL).resolved()

    def fitted(self, load, rtol):
        return self.scene(loads=(load,), model="fe", rtol=rtol).resolved()


def between(state, reference):
    """max(|dp|, |dM|/ell)/|p| in L2, by Gauss points between all nodes of `state` and all edges of both."""
    cuts = np.unique(np.concatenate((state.x, zone_edges(state.all_zones), zone_edges(reference.all_zones))))
    cuts = np.sort(np.concatenate((cuts, cuts[:-1] + np.diff(cuts)/100, cuts[1:] - np.diff(cuts)/100)))   # square roots at edges
    points, weights = gauss_rule(POINTS)
    x = (cuts[:-1, None] + np.diff(cuts)[:, None]*points).ravel()
    weight = (np.diff(cuts)[:, None]*weights).ravel()
    own, true = (np.array([one.pressure(corner, x) for corner in range(len(one.line.law.corners))]) for one in (state, reference))
    levers = np.array([state.line.lever(np.full(len(x), corner), x) for corner in range(len(own))])
    return distance(weight, (own - true).sum(axis=0), (levers*(own - true)).sum(axis=0)/2, true.sum(axis=0))


def nodal(state, reference):
    """The same for the pressure alone, by the state's own nodes and weights."""
    corners = range(len(state.line.law.corners))
    true = sum(reference.pressure(corner, state.x*(1 + BESIDE)) for corner in corners)
    own = state.pressures.sum(axis=0)
    return float(np.sqrt(state.weights @ (own - true)**2/(state.weights @ true**2)))


def timed(parameters):
    """States of `hertz`, and the seconds that they took: of the processor, and of the clock."""
    start = time.process_time(), time.perf_counter()
    states = [state for state, _ in hertz.solve(parameters)]
    return states, np.array((time.process_time() - start[0], time.perf_counter() - start[1]))


def result(parameters):
    """One object: a row for each load, the times of all ways and their ratios."""
    start = time.perf_counter()
    references = [state for state, _ in hertz.solve(parameters.judge)]
    timed(parameters.fitted(parameters.loads[-1], LOOSE))      # libraries are loaded by the first solve
    papers, seconds = timed(parameters.paper)
    found, spent = [], {"asked": np.zeros(2), "obtained": np.zeros(2)}
    for load, paper, reference in zip(parameters.loads, papers, references):
        error = between(paper, reference)
        row = {"load": load, "error_paper": error, "nodes_paper": nodal(paper, reference), "iterations_paper": paper.iterations,
               "unknowns_paper": paper.unknowns}
        for name, rtol in (("asked", SHARE*error), ("obtained", LOOSE)):
            (own,), took = timed(parameters.fitted(load, rtol))
            spent[name] += took
            row |= {f"rtol_{name}": rtol, f"error_{name}": between(own, reference), f"nodes_{name}": nodal(own, reference),
                    f"estimate_{name}": own.estimate.total, f"unknowns_{name}": own.unknowns, f"passes_{name}": own.iterations,
                    f"seconds_{name}": float(took[0])}
        found.append(row)
    ways = {name: {"seconds": float(own[0]), "wall": float(own[1]), "ratio": float(seconds[0]/own[0]),
                   "ratio_wall": float(seconds[1]/own[1]), "worst": _worst(found, f"error_{name}", "error_paper"),
                   "nodes": _worst(found, f"nodes_{name}", "nodes_paper")} for name, own in spent.items()}
    return returned(parameters, start, paper={"seconds": float(seconds[0]), "wall": float(seconds[1])}, **ways, loads=found)


def _worst(found, name, paper):
    return max(row[name]/(SHARE*row[paper]) for row in found)


def run(parameters, out=None, quiet=False):
    """Both ways, a table, and the errors over the load into the folder `out`."""
    answer = result(parameters)
    if not quiet:
        columns = ("load", "error_paper", "nodes_paper", "error_asked", "nodes_asked", "estimate_asked", "seconds_asked",
                   "error_obtained", "nodes_obtained", "seconds_obtained")
        print("  ".join(f"{name:>16}" for name in columns))
        for row in answer["loads"]:
            print("  ".join(f"{row[name]:16.4g}" for name in columns))
        print(f"the paper's way: {answer['paper']['seconds']:.1f} s")
        for name in ("asked", "obtained"):
            print("a tenth {0}: {seconds:.2f} s, {ratio:.0f} times faster; error over a tenth of the paper's at most "
                  "{worst:.2f}, at the nodes alone {nodes:.2f}".format(name, **answer[name]))
    if out:
        keep(out, "paper_way", rows(parameters, answer), figure)
    return answer


def rows(parameters, answer):
    """A result as records: command, parameters and what it gave, a row for each load."""
    common = {"command": command("paper_way", parameters), "alpha": parameters.alpha, "nu": parameters.nu,
              "beta": parameters.beta, "h": parameters.h, "seconds_paper": answer["paper"]["seconds"],
              "ratio_asked": answer["asked"]["ratio"], "ratio_obtained": answer["obtained"]["ratio"]}
    return [{**common, **row} for row in answer["loads"]]


def figure(records):
    """Errors of both ways over the load."""
    drawing, axis = plots.figure(height=3.0)
    axis.semilogy(column(records, "load"), column(records, "error_paper"), "s-", label="the paper's way")
    for name, style in (("asked", "o-"), ("obtained", "^--")):
        axis.semilogy(column(records, "load"), column(records, f"error_{name}"), style, markerfacecolor="none",
                      label=f"fitted, {name}")
    axis.semilogy(column(records, "load"), SHARE*np.array(column(records, "error_paper")), "k:", linewidth=0.8,
                  label="a tenth of the paper's")
    axis.set(xlabel=r"$P/P_{\max}$", ylabel="relative error in $L^2$")
    plots.legend_below(axis)
    return drawing
