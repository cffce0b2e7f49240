"""Cylinder with friction under normal, then shear loads: stick, slip, and what is dissipated.

Geometry   half-plane x2 < 0; a cylinder of radius R, rigid or a second half-plane of that shape; blocks of
           side ell.
Equations  (10)-(18) in the half-plane, corner gaps and conditions (26); on each block's face one shear force
           of at most the friction times its normal force. The paper has no friction.
Model      cells graded towards all edges, loads followed from event to event (docs/theory/friction.md).
Reference  Cattaneo and Mindlin for two equal bodies and small blocks; for the rigid cylinder, uncoupled, the
           similar stick zone of the first loading.
Look at    stick zones that grow with the first shear, which turns the slip of one side, shrink as the shear
           grows, and grow again behind a reversal; microblocks lose them on the side to which the cylinder
           moves.
Units      E* and R of both bodies together: lengths over a_Hz, pressures over p_Hz, both of the load P
           (normal = 1); M over p_Hz ell, psi as psi R/a_Hz, slip over a_Hz^2/R, energies over P a_Hz^2/R,
           shear over f P.
"""

import math
import time
from dataclasses import dataclass, replace

import numpy as np

import microblock as mb
from microblock.data.records import column, grouped

from ..common import second_body
from ..common.case import of_kinds, over, profiles
from ..common.laws import LAWS
from ..common.options import Checked, coupling, option, poisson
from ..common.records import print_table, returned

RTOL = 1e-2
SHOWN = ("alpha", "normal", "shear", "half_width", "stick", "dissipation", "error_estimate", "balance")
SHORTEST = 0.1  # slip zone over a_Hz that has a mark in the figure
SECOND = "four numbers: E2 over the first body's modulus, NU2, BETA2, ALPHA2 (ell2 over a_Hz)"


@dataclass(frozen=True)
class Parameters(Checked):
    alpha: tuple = option((0.25,), "sizes of a block over a_Hz", above=0, nargs="+", metavar="ALPHA")
    friction: float = option(0.3, "coefficient of friction", above=0)
    normal: float = option(1.0, "normal load, a multiple of P", above=0)
    shear: tuple = option(
        (0.25, 0.5, 0.75, 1.0, 0.0),
        "shear loads over f P at this normal load, in the order in which they are followed; the state "
        "without shear comes before them",
        at_least=-1,
        at_most=1,
        nargs="+",
        metavar="SHEAR",
    )
    coupled: str = option("yes", "whether shear acts on the gaps", str, choices=("yes", "no"))
    contact: str = option("microblock", "contact law", str, choices=tuple(LAWS))
    nu: float = poisson()
    beta: float = coupling()
    second: tuple = option(
        second_body.RIGID,
        f"the cylinder: rigid, same as the half-plane, or {SECOND}",
        str,
        nargs="+",
        metavar="BODY",
    )
    rtol: float | None = option(
        None,
        "relative L2 error of pressure, of micromoment over ell and of shear traction over the friction, all "
        f"over the pressure ({RTOL:g} if nothing is given)",
        above=0,
        below=1,
    )

    def relate(self):
        self.second_solid(1.0)

    def resolved(self):
        return replace(self, rtol=RTOL if self.rtol is None else self.rtol)

    def second_solid(self, ell):
        """The second body's solid, if blocks of the first have the side ell; None of a rigid one."""
        numbers = second_body.numbers(self.second, SECOND)
        if numbers is None:
            return None if self.second == second_body.RIGID else self.solid(ell)
        E, nu, beta, alpha = numbers
        return mb.Cosserat(E=E * (1 - self.nu**2), nu=nu, ell=alpha, beta=beta)

    def solid(self, ell):
        """The half-plane's solid, of E* = 1."""
        return mb.Cosserat(E=1 - self.nu**2, nu=self.nu, ell=ell, beta=self.beta)

    @property
    def E_star(self):
        """That of both bodies together; with R = 1 and a_Hz = 1 it is the scale of all stresses."""
        other = self.second_solid(1.0)
        return 1.0 if other is None else 1 / (1 + 1 / other.E_star)

    @property
    def unit(self):
        """P, the load with a_Hz = 1."""
        return math.pi / 4 * self.E_star

    def problem(self, alpha):
        """The contact problem at one size of the blocks."""
        other, cylinder = self.second_solid(alpha), mb.Cylinder(R=1.0)
        obstacle = cylinder if other is None else mb.Deformable(mb.HalfPlane(other), cylinder)
        return mb.Contact(
            mb.HalfPlane(self.solid(alpha)), obstacle, LAWS[self.contact](friction=self.friction)
        )


def solve(parameters, alpha):
    """The history at one size of the blocks."""
    P = parameters.normal * parameters.unit
    pairs = [(P, share * parameters.friction * P) for share in (0.0, *parameters.shear)]
    coupled = parameters.coupled == "yes"
    return parameters.problem(alpha).history(pairs, coupled=coupled, rtol=parameters.rtol)


def observe(parameters, alpha, state):
    """What the case returns of a state."""
    P, p, data = parameters.unit, parameters.E_star / 2, state.to_dict()
    energy = {name: data[name] / P for name in ("dissipation", "energy", "work")}
    units = {"x": 1, "weight": 1, "pressure": p, "shear": p, "micromoment": p * alpha, "psi": 1, "slip": 1}
    return {
        "alpha": alpha,
        "normal": state.normal / P,
        "shear": state.shear / (parameters.friction * state.normal),
        "stick": data["zones"]["stick"],
        "slip": data["zones"]["slip"],
        "zones": {name: data["zones"][name] for name in ("A", "B", "full", "contact")},
        "half_width": state.half_width,
        **energy,
        "balance": abs(energy["work"] - energy["energy"] - energy["dissipation"]),
        "error_estimate": state.error_estimate,
        "unknowns": state.unknowns,
        "profile": over(data["profile"], units),
    }


def _event(parameters, alpha, event):
    P = parameters.unit
    return {
        "alpha": alpha,
        "pair": event.pair,
        "normal": event.normal / P,
        "shear": event.shear / (parameters.friction * parameters.normal * P),
        "error": event.error,
        "kind": event.kind,
        "zone": event.zone,
        "x": event.x,
    }


def result(parameters, quiet=True):
    """The case's object, of each size of the blocks one after the other: a state for each shear load, the one
    without shear before them as `pressed`, and the events.
    """
    start, chosen = time.perf_counter(), parameters.resolved()
    pressed, states, events = [], [], []
    for alpha in chosen.alpha:
        history = solve(chosen, alpha)
        first, *others = (observe(chosen, alpha, state) for state in history.states)
        pressed.append(first)
        states += others
        events += [_event(chosen, alpha, event) for event in history.events]
    return returned(chosen, start, model="halfplane", pressed=pressed, states=states, events=events)


def show(answer):
    """Print the states, with the stick zones as intervals, and the events."""
    states = _in_order(answer)
    stick = [" ".join(f"[{a:.4f}, {b:.4f}]" for a, b in one["stick"]) or "none" for one in states]
    print_table([{**one, "stick": own} for one, own in zip(states, stick)], SHOWN)
    print_table(answer["events"], ("alpha", "kind", "zone", "normal", "shear", "error", "x"))


def _in_order(answer):
    """All states of an answer, that without shear first, size by size."""
    return [
        state
        for first in answer["pressed"]
        for state in (first, *(one for one in answer["states"] if one["alpha"] == first["alpha"]))
    ]


def rows(parameters, answer):
    """A row for each cell of each state, and one for each stick zone."""
    states = [{**one, "state": number, "load": one["shear"]} for number, one in enumerate(_in_order(answer))]
    cells = profiles(states, "state", "alpha", "normal", "load", "error_estimate")
    zones = [
        {"state": one["state"], "alpha": one["alpha"], "load": one["load"], "left": left, "right": right}
        for one in states
        for left, right in one["stick"]
    ]
    return of_kinds(cell=cells, stick=zones)


def figure(records):
    """The first shear makes one side of the contact stick; from then on the stick zone shrinks as the shear
    grows.

    A rigid cylinder is pressed on a half-plane with friction, then pushed to the right, and back. (a) Shear
    traction over its bound f p, for the loads one after the other in the shades of (b). (b) Bars: stick
    zones, in the order of the loads from below; thin: slip zones, where a mark points the way in which the
    cylinder drags the surface. Pressing draws the surface inwards, so that both sides slip and the cylinder
    drags them outwards. A push to the right goes on with that at the right; at the left it would have to turn
    the slip, and all of that side sticks until the traction has passed from the lower bound to the upper.

    Seen: in (a) a curve that goes from the lower bound at the left to the upper one at the right, and others
    that leave the upper bound further and further to the left; in (b) a short bar in the middle, then one
    over the left half, which shrinks, none where all slips, and a long bar once the shear is taken back.
    """
    from microblock.view import plots

    kinds = grouped(records, "kind")
    alpha = kinds["cell"][0]["alpha"]
    cells = [row for row in kinds["cell"] if row["alpha"] == alpha and row["pressure"] > 0]
    zones = [row for row in kinds.get("stick", ()) if row["alpha"] == alpha]
    drawing, axes = plots.figure(2, 1, height=1.8, sharex=True)
    states = list(grouped(cells, "state").values())
    for bound in (-1, 1):
        axes[0].axhline(bound, linestyle=":", color="0.5", linewidth=0.8)
    for level, (colour, own) in enumerate(zip(plots.shades(len(states)), states)):
        x, bound = np.array(column(own, "x")), own[0]["friction"] * np.array(column(own, "pressure"))
        share = np.array(column(own, "shear")) / bound
        axes[0].plot(x, share, color=colour)
        axes[1].plot((x[0], x[-1]), (level, level), color=colour, linewidth=0.8)
        sticking = np.zeros(len(x), bool)
        for zone in (row for row in zones if row["state"] == own[0]["state"]):
            axes[1].plot(
                (zone["left"], zone["right"]),
                (level, level),
                color=colour,
                linewidth=5,
                solid_capstyle="butt",
            )
            sticking |= (x > zone["left"]) & (x < zone["right"])
        turns = np.flatnonzero(np.diff(np.where(sticking, 0, np.sign(share)))) + 1
        for part in np.split(np.arange(len(x)), turns):
            if not sticking[part[0]] and np.ptp(x[part]) > SHORTEST:
                mark = ">" if share[part[0]] > 0 else "<"
                axes[1].plot((x[part[0]] + x[part[-1]]) / 2, level, mark, color=colour)
    loads = [own[0]["load"] for own in states]
    reach = 1.05 * max(abs(row["x"]) for row in cells)
    axes[0].set(ylabel=r"$q/(f p_n)$", xlim=(-reach, reach))
    axes[1].set(xlabel=r"$x_1/a_\mathrm{Hz}$", ylabel=r"$Q/(fP)$", ylim=(-0.7, len(loads) - 0.3))
    axes[1].set_yticks(range(len(loads)), [f"{load:.3g}" for load in loads])
    plots.letter(axes)
    return drawing


FIGURES = {"tangential": (rows, figure)}
