"""Cylinder or wedge of a second body pressed on a Cosserat half-plane with microblocks.

Geometry   half-plane x2 < 0 with blocks of side ell at each point of its surface, rotated by psi0; above it a
           second half-plane, whose undeformed lower surface is a cylinder x^2/(2 R) or a wedge. They are
           pressed together by a force P per thickness.
Equations  (10)-(18) in both half-planes, the corner gaps (20)-(22) and conditions (26); a corner presses the
           second body where it stands, half a block beside the contact point. The second surface is smooth.
Model      panels on the contact line, fitted to the zones of each corner (docs/theory/two_bodies.md).
Reference  Hertz with both moduli, 1/E* = 1/E1* + 1/E2*, for alpha -> 0; the case hertz for a rigid one.
Look at    pressure and micromoment beside those under a rigid obstacle at the same alpha.
Units      those of Hertz with both moduli at load P, (50): lengths over a_Hz, pressures over p_Hz, M over
p_Hz
           ell, psi as psi R/a_Hz, energy (of both bodies) over p_Hz a_Hz^3/R, up to a constant.
"""

import math
import time
from dataclasses import dataclass, replace

import microblock as mb
from microblock.data.records import grouped

from ..common.options import Checked, coupling, option, poisson, rotation
from ..common.records import returned
from ..common.second_body import RIGID, SAME, numbers
from . import hertz

RTOL = 1e-3
ALPHA = 0.25


@dataclass(frozen=True)
class Parameters(Checked):
    second: tuple = option(
        SAME,
        "the second body: rigid, same (the solid of the first), or its E, nu, beta (0: classical) and "
        "ell over a_Hz",
        str,
        nargs="+",
        metavar="SOLID",
    )
    alpha: float = option(ALPHA, "ell over a_Hz of both bodies", above=0)
    E: float = option(100.0, "Young's modulus", above=0)
    nu: float = poisson()
    beta: float = coupling()
    R: float = option(10.0, "radius of the cylinder; sets the units for the wedge as well", above=0)
    P: float = option(1.0, "force per thickness", above=0)
    loads: tuple = option(
        (1.0,), "loads at which states are returned, as multiples of P", above=0, nargs="+", metavar="LOAD"
    )
    obstacle: str = option("cylinder", "shape of the second body", str, choices=("cylinder", "wedge"))
    wedge_deg: float = option(1.0, "slope of the wedge's flanks in degrees", above=0, at_most=45)
    psi0_deg: float = rotation()
    contact: str = option(
        "microblock", "contact law", str, choices=("microblock", "unilateral", "microclamped")
    )
    rtol: float = option(RTOL, "relative L2 error of pressure and of micromoment over ell", above=0, below=1)

    def relate(self):
        self._numbers()

    def _numbers(self):
        """E, nu, beta and alpha of the second body; None of one that is rigid or the same."""
        return numbers(self.second, "four numbers E NU BETA ALPHA")

    @property
    def E_star(self):
        """Modulus of both bodies (stress)."""
        one, given = self.E / (1 - self.nu**2), self._numbers()
        if self.second == RIGID:
            return one
        return 1 / (1 / one + (1 / one if given is None else (1 - given[1] ** 2) / given[0]))

    @property
    def a_Hz(self):
        """Hertz half-width (50) with both moduli."""
        return math.sqrt(4 * self.P * self.R / (math.pi * self.E_star))

    @property
    def p_Hz(self):
        """Hertz pressure (50)."""
        return 2 * self.P / (math.pi * self.a_Hz)

    @property
    def solid(self):
        return mb.Cosserat(self.E, self.nu, self.alpha * self.a_Hz, beta=self.beta)

    @property
    def shape(self):
        if self.obstacle == "cylinder":
            return mb.Cylinder(self.R)
        return mb.Wedge(math.tan(math.radians(self.wedge_deg)))

    @property
    def law(self):
        if self.contact == "microblock":
            return mb.Microblock(math.radians(self.psi0_deg))
        return mb.Unilateral() if self.contact == "unilateral" else mb.Microclamped()

    @property
    def problem(self):
        """The contact problem."""
        obstacle, given = self.shape, self._numbers()
        if self.second != RIGID:
            modulus, nu, beta, alpha = given or (self.E, self.nu, self.beta, self.alpha)
            solid = mb.Cosserat(modulus, nu, alpha * self.a_Hz, beta=beta)
            obstacle = mb.Deformable(mb.HalfPlane(solid), obstacle)
        return mb.Contact(mb.HalfPlane(self.solid), obstacle, self.law, mb.Panels(fallback=False))


def solve(parameters):
    """The state at each load."""
    problem, states = parameters.problem, []
    for load in parameters.loads:
        initial = states[-1] if states else None
        states.append(problem.solve(load=load * parameters.P, rtol=parameters.rtol, initial=initial))
    return states


def result(parameters, quiet=True):
    """The case's object: states as those of `hertz`, and events."""
    start = time.perf_counter()
    states = solve(parameters)
    return returned(
        parameters,
        start,
        states=[hertz.observe(parameters, state, state.error_estimate) for state in states],
        events=hertz.events(parameters, max(parameters.loads)),
        warnings=list(dict.fromkeys(words for state in states for words in state.warnings)),
    )


def show(answer):
    """A table of the states, and the events."""
    hertz.show(answer)


def rows(parameters, answer):
    """A row a point of the curve, of the first load; beside the second body as it is a rigid one."""
    found = []
    for second in dict.fromkeys((parameters.second, RIGID)):
        other = replace(parameters, second=second, loads=parameters.loads[:1])
        (state,) = solve(other)
        profile = hertz.drawn(other, state)
        names = "x", "pressure", "micromoment"
        nodes = zip(*(profile[name] for name in names))
        found += [{"body": " ".join(second), **dict(zip(names, node))} for node in nodes]
    return found


def figure(records):
    """A second body that deforms carries the kinks of the pressure from corner to corner: each comes back a
    block's side away.

    Pressure (a) and micromoment (b) under the second body and under a rigid one, in units of Hertz with both
    moduli, for blocks of the same size over Hertz's half-width.

    Seen: with blocks of 0.25, pressures and micromoments that differ by some percent; on the rigid obstacle
    one kink on either side, where full contact ends at 0.51; on the body that deforms the same at 0.56, and
    weaker ones at 0.81 and 0.31.
    """
    bodies = grouped(records, "body")
    return hertz.over_x({body if body == "rigid" else "deforms": nodes for body, nodes in bodies.items()})


FIGURES = {"two_bodies": (rows, figure)}
