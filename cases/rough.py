"""Rough obstacle and rough psi0(x) on a half-plane with microblocks: a large problem, matrix-free.

Geometry   half-plane x2 < 0; a self-affine profile of one period (seeded phases) pressed down by a mean pressure; blocks of
           side ell, turned by a psi0(x) that is as rough as the profile.
Equations  (10)-(18) in the half-plane, the corner gaps (20)-(22) and conditions (26) on its surface.
Model      one period of uniform cells, products by FFT, no mesh (docs/theory.md, "Large problems").
Reference  four times as many cells.
Look at    ten thousand cells in contact, dozens of zones, some 150 products; psi0 tears the zones of the corners apart.
Units      lengths over the period, pressures over E* times the root mean square slope; M over that and ell.
"""

import math
import time
from dataclasses import asdict, dataclass, replace

import numpy as np

from cases.options import command, option
from cases.records import keep, returned
from microblock import plots
from microblock.errors import BadArgument, require_finite
from microblock.grid import PeriodicHalfPlane
from microblock.grid_contact import GridContact
from microblock.law import Microblock, Unilateral
from microblock.material import Cosserat
from microblock.obstacles import Rough
from microblock.study import column

DRAWN = 2000      # cells around the largest pressure that the records keep


@dataclass(frozen=True)
class Parameters:
    nodes: int = option(2**16, "cells of the period", int)
    seed: int = option(1, "seed of the phases of the profile; psi0 has the next one", int)
    load: float = option(0.05, "mean pressure over E* times the slope")
    slope: float = option(0.1, "root mean square slope of the profile")
    hurst: float = option(0.8, "exponent of the profile, 0 to 1")
    longest: int = option(4, "longest wave, in waves to the period", int)
    shortest: int = option(256, "shortest wave, in waves to the period", int)
    ell: float = option(2e-3, "length scale of the material over the period")
    nu: float = option(0.3, "Poisson's ratio, -1 < nu < 1/2")
    beta: float = option(1.0, "coupling number, 0 < beta < 2")
    psi0_deg: float = option(1.0, "root mean square of psi0 in degrees")
    contact: str = option("microblock", "contact law", str, choices=("microblock", "unilateral"))

    def __post_init__(self):
        require_finite(load=self.load, slope=self.slope, hurst=self.hurst, ell=self.ell, psi0_deg=self.psi0_deg, beta=self.beta)
        for name in ("load", "slope", "ell"):
            if not getattr(self, name) > 0:
                raise BadArgument(name, getattr(self, name), "must be positive")
        if not 0 < self.beta < 2:
            raise BadArgument("beta", self.beta, "must satisfy 0 < beta < 2")
        if not 1 <= self.longest <= self.shortest:
            raise BadArgument("longest", self.longest, "must lie between 1 and --shortest")
        if not 4*self.shortest <= self.nodes <= 2**22:
            raise BadArgument("nodes", self.nodes, f"must lie between four to the shortest wave ({4*self.shortest}) and {2**22}")
        if not 0 <= self.psi0_deg <= 10:
            raise BadArgument("psi0_deg", self.psi0_deg, "must lie between 0 and 10")
        if self.contact != "microblock" and self.psi0_deg != type(self).psi0_deg:
            raise BadArgument("psi0_deg", self.psi0_deg, f"has no place in the {self.contact} law")
        self.profile, self.solid

    @property
    def solid(self):
        """E* slope = 1."""
        return Cosserat(E=(1 - self.nu**2)/self.slope, nu=self.nu, ell=self.ell, beta=self.beta)

    @property
    def profile(self):
        return Rough(1.0, self.slope, self.hurst, (self.longest, self.shortest), self.seed)

    @property
    def turns(self):
        """psi0(x): the slope of another such profile, brought to the root mean square asked for."""
        return rough_turns(Rough(1.0, 1.0, self.hurst, (self.longest, self.shortest), self.seed + 1), math.radians(self.psi0_deg))

    @property
    def scene(self):
        law = Microblock(self.turns) if self.contact == "microblock" else Unilateral()
        return GridContact(PeriodicHalfPlane(self.solid, 1.0), self.profile, law)


def rough_turns(profile, size):
    """psi0(x) of a root mean square `size` (radians), with the waves of a Rough profile."""
    height = math.sqrt(np.sum(np.abs(profile.amplitudes)**2)/2)
    return lambda x: size/height*profile.height(x)


def solve(parameters):
    """GridState."""
    return parameters.scene.at(parameters.load, nodes=parameters.nodes)


def reference(parameters):
    """GridState on four times as many cells, to hold the error estimate against."""
    return solve(replace(parameters, nodes=4*parameters.nodes))


def result(parameters):
    """The case's object."""
    start = time.perf_counter()
    state = solve(parameters)
    pressure = state.pressures.sum(axis=0)
    profile = {"x": state.x.tolist(), "weight": state.weights.tolist(), "pressure": pressure.tolist(),
               "micromoment": (state.micromoment/parameters.ell).tolist(), "psi": state.psi.tolist()}
    return returned(parameters, start, model="halfplane", unknowns=state.pressures.size + 1,
                    contact_fraction=float(np.mean(pressure > 0)),
                    full_contact_fraction=float(np.mean((state.pressures > 0).all(axis=0))),
                    zones=[len(intervals) for intervals in state.zones.values()], pressure_max=float(pressure.max()),
                    micromoment_max=float(np.abs(state.micromoment).max()/parameters.ell), approach=state.approach,
                    energy=state.energy, kkt=state.kkt, products=state.products, error_estimate=state.error_estimate,
                    profile=profile)


def run(parameters, out=None, quiet=False):
    """Solve, print what came out, draw the pressures around the largest into the folder `out`."""
    answer = result(parameters)
    if not quiet:
        for name in ("unknowns", "contact_fraction", "full_contact_fraction", "zones", "pressure_max", "micromoment_max",
                     "approach", "kkt", "products", "error_estimate"):
            print(f"{name:>22}  {answer[name]}")
        print(f"{'seconds':>22}  {answer['seconds']['solve']:.3g}")
    if out:
        keep(out, "rough", rows(parameters, answer), figure)
    return answer


def rows(parameters, answer):
    """A row a cell around the largest pressure, with every parameter."""
    common = {"command": command("rough", parameters), **asdict(parameters), "error_estimate": answer["error_estimate"]}
    middle = int(np.argmax(answer["profile"]["pressure"]))
    chosen = slice(max(middle - DRAWN//2, 0), middle + DRAWN//2)
    profile = {name: answer["profile"][name][chosen] for name in ("x", "pressure", "micromoment", "psi")}
    return [{**common, **dict(zip(profile, node))} for node in zip(*profile.values())]


def records(parameters):
    """What `figure` draws."""
    return rows(parameters, result(parameters))


def figure(records):
    """Rough obstacle and rough psi0(x): pressure (a) and micromoment (b) around the largest pressure, one corner's zones torn
    from the other's."""
    drawing, axes = plots.figure(1, 2)
    for axis, name in zip(axes, ("pressure", "micromoment")):
        axis.plot(column(records, "x"), column(records, name), linewidth=0.8)
    axes[0].set(xlabel="$x_1$ over the period", ylabel=r"$p/(E^* h'_\mathrm{rms})$", title="(a)")
    axes[1].set(xlabel="$x_1$ over the period", ylabel=r"$M/(E^* h'_\mathrm{rms}\,\ell)$", title="(b)")
    return drawing
