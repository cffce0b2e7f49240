"""Ten loads the paper's way and on fitted meshes: time at a tenth of the error.

Geometry   the cylinder on the half-plane of `hertz`, aligned blocks; loads up to P, ascending.
Equations  those of `hertz`.
Model      the paper's way: squares of side --h on the domain of 18 a_Hz, bilinear elements, augmented Lagrangian Newton,
           load by load from first touch. Fitted: the domain of 1000 a_Hz, every load meshed and refined for itself from
           nothing; asked for a tenth of the error that the paper's way has at that load.
Reference  the half-plane at rtol 1e-8 judges both, max(|dp|, |dM|/ell)/|p| in L2 between the nodes too.
Look at    `ratio`, the time of the paper's way over that of all fitted loads; `worst`, the largest obtained error over a
           tenth of the paper's (1 and below: kept).
Units      those of `hertz`; seconds of one thread, assembly, factors and all passes counted.
"""

import time
from dataclasses import asdict, dataclass

import numpy as np

from cases import hertz, hertz_fe
from cases.options import command, option
from microblock import plots
from microblock.errors import BadArgument, require_finite
from microblock.halfplane import gauss_rule
from microblock.study import column, read_records, versions, write_records

LOADS = tuple(round(0.1*step, 1) for step in range(1, 11))
SHARE = 0.1              # of the error of the paper's way, asked for on fitted meshes
DOMAIN = "18"            # of the paper, over a_Hz
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


def distance(state, reference):
    """max(|dp|, |dM|/ell)/|p| in L2, by Gauss points between all nodes of `state` and all edges of both."""
    edges = [edge for one in (state, reference) for own in one.all_zones.values() for zone in own for edge in zone]
    cuts = np.unique(np.concatenate((state.x, edges)))
    cuts = np.sort(np.concatenate((cuts, cuts[:-1] + np.diff(cuts)/100, cuts[1:] - np.diff(cuts)/100)))   # square roots at edges
    points, weights = gauss_rule(POINTS)
    x = (cuts[:-1, None] + np.diff(cuts)[:, None]*points).ravel()
    weight = (np.diff(cuts)[:, None]*weights).ravel()
    own, true = (np.array([one.pressure(corner, x) for corner in range(len(one.line.law.corners))]) for one in (state, reference))
    levers = np.array([state.line.lever(np.full(len(x), corner), x) for corner in range(len(own))])
    errors = (own - true).sum(axis=0), (levers*(own - true)).sum(axis=0)/2
    return float(np.sqrt(max(weight @ error**2 for error in errors)/(weight @ true.sum(axis=0)**2)))


def timed(parameters):
    """States of `hertz`, and the seconds that they took."""
    start = time.perf_counter()
    states = [state for state, _ in hertz.solve(parameters)]
    return states, time.perf_counter() - start


def result(parameters):
    """One object: a row for each load, the time of both ways and their ratio."""
    start = time.perf_counter()
    references = [state for state, _ in hertz.solve(parameters.judge)]
    timed(parameters.fitted(parameters.loads[-1], 1e-2))      # libraries are loaded by the first solve
    setup = time.perf_counter() - start
    papers, seconds = timed(parameters.paper)
    found = []
    for load, paper, reference in zip(parameters.loads, papers, references):
        error = distance(paper, reference)
        (own,), spent = timed(parameters.fitted(load, SHARE*error))
        found.append({"load": load, "error_paper": error, "iterations_paper": paper.iterations, "unknowns_paper": paper.unknowns,
                      "error_fitted": distance(own, reference), "estimate_fitted": own.estimate.total,
                      "unknowns_fitted": own.unknowns, "passes_fitted": own.iterations, "seconds_fitted": spent})
    fitted = sum(column(found, "seconds_fitted"))
    return {"parameters": {**asdict(parameters), "loads": list(parameters.loads)}, "versions": versions(),
            "seconds": {"setup": setup, "solve": seconds + fitted}, "loads": found, "seconds_paper": seconds,
            "seconds_fitted": fitted, "ratio": seconds/fitted,
            "worst": max(row["error_fitted"]/(SHARE*row["error_paper"]) for row in found)}


def run(parameters, out=None, quiet=False):
    """Both ways, a table, and the errors over the load into the folder `out`."""
    answer = result(parameters)
    if not quiet:
        columns = ("load", "error_paper", "error_fitted", "estimate_fitted", "unknowns_fitted", "passes_fitted", "seconds_fitted")
        print("  ".join(f"{name:>15}" for name in columns))
        for row in answer["loads"]:
            print("  ".join(f"{row[name]:15.4g}" for name in columns))
        print(f"the paper's way {answer['seconds_paper']:.1f} s, fitted {answer['seconds_fitted']:.2f} s: "
              f"{answer['ratio']:.0f} times faster; error over a tenth of the paper's at most {answer['worst']:.2f}")
    if out:
        write_records(out/"paper_way.csv", rows(parameters, answer))
        plots.draw(figure, read_records(out/"paper_way.csv"), out, "paper_way")
    return answer


def rows(parameters, answer):
    """A result as records: command, parameters and what it gave, a row for each load."""
    common = {"command": command("paper_way", parameters), "alpha": parameters.alpha, "nu": parameters.nu,
              "beta": parameters.beta, "h": parameters.h, "seconds_paper": answer["seconds_paper"], "ratio": answer["ratio"]}
    return [{**common, **row} for row in answer["loads"]]


def figure(records):
    """Errors of both ways over the load."""
    drawing, axis = plots.figure(height=3.0)
    axis.semilogy(column(records, "load"), column(records, "error_paper"), "s-", label="the paper's way")
    axis.semilogy(column(records, "load"), column(records, "error_fitted"), "o-", label="fitted")
    axis.semilogy(column(records, "load"), SHARE*np.array(column(records, "error_paper")), "k:", linewidth=0.8,
                  label="a tenth of the paper's")
    axis.set(xlabel=r"$P/P_{\max}$", ylabel="relative error in $L^2$")
    plots.legend_below(axis)
    return drawing
