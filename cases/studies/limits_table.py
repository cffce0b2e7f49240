"""Limits and symmetries of the contact on a half-plane, as numbers: what must hold, and how well it does.

Lengths over a_Hz and pressures over p_Hz (E* = 2, R = 1, P = pi/2) unless a row scales them.
"""

import math
from dataclasses import asdict, dataclass

import numpy as np

import microblock as mb
from microblock.halfplane import panel_solution
from microblock.model.zones import zone_edges

NU, BETA, LOAD = 0.3, 1.0, math.pi / 2
SMALL = (0.04, 0.02, 0.01)  # alphas on the way to Hertz
ORDER = 14  # of the panels: 1e-7 and better
PSI0 = 0.05
HALVED = (0.1, 0.05, 0.025, 0.0125)  # psi0 at fixed psi0 R/a_Hz
PATH = (0.3, 0.5, 0.7, 0.85, 1.0)  # loads over LOAD, of one topology
GAUSS = 10  # points of the work's integral over PATH


def problem(alpha, law, R=1.0):
    """Cylinder of radius R whose a_Hz is 1 at the load LOAD/R."""
    solid = mb.Cosserat(E=2 * (1 - NU**2), nu=NU, ell=alpha, beta=BETA)
    return mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R), law, mb.Panels(order=ORDER))


def hertz_distances(law):
    """Relative L2 distance of the pressure from the Hertz ellipse, and of the edge from 1, for SMALL:
    arrays.
    """
    found = []
    for alpha in SMALL:
        state = problem(alpha, law).solve(load=LOAD)
        ellipse = np.sqrt(np.maximum(1 - state.x**2, 0))
        off = math.sqrt(state.weights @ (state.pressure - ellipse) ** 2 / (state.weights @ ellipse**2))
        found.append((off, abs(zone_edges(state.zones)[-1] - 1)))
    return np.array(found).T


def rate(values):
    """Observed power of alpha (or psi0) from values at successive halvings: of the last pair."""
    return float(np.log2(values[-2] / values[-1]))


def units():
    """Largest change of normalised pressures and nodes under other P, R, E at fixed R/a_Hz, with psi0."""
    here, E, R = problem(0.25, mb.Microblock(PSI0)), 70.0, 3.0
    scaled = here.with_(solid=mb.Cosserat(E=E, nu=NU, ell=0.25 * R, beta=BETA), obstacle=mb.Cylinder(R))
    one, other = here.solve(load=LOAD), scaled.solve(load=math.pi * E * R / (4 * (1 - NU**2)))
    p_Hz = E / (2 * (1 - NU**2))
    changes = [np.abs(other.pressures[corner] / p_Hz - p).max() for corner, p in one.pressures.items()]
    return float(max(np.abs(other.x / R - one.x).max(), *changes))


def rotated_profile(psi0, x):
    """Normalised pressure at x, with psi0 R/a_Hz = PSI0."""
    R = PSI0 / psi0
    return problem(0.25, mb.Microblock(psi0), R).solve(load=LOAD / R).pressure_at(x) * R


def lever_changes():
    """Largest change of the normalised pressure at each halving of psi0 at fixed psi0 R/a_Hz: the levers
    carry psi0 itself.
    """
    x = np.linspace(-0.7, 0.7, 12)  # off the edges
    profiles = [rotated_profile(psi0, x) for psi0 in HALVED]
    return np.array([np.abs(fine - coarse).max() for coarse, fine in zip(profiles, profiles[1:])])


def mirrored():
    """Largest difference of edges and pressures under -psi0 from the mirror image."""
    left, right = (problem(0.25, mb.Microblock(psi0)).solve(load=LOAD) for psi0 in (PSI0, -PSI0))
    edges = [
        abs(edge + other)
        for zone, twin in zip(left.zones["A"], reversed(right.zones["B"]))
        for edge, other in zip(zone, reversed(twin))
    ]
    return float(
        max(
            *edges,
            *(
                np.abs(left.pressures[one] - right.pressures[other][::-1]).max()
                for one, other in ("AB", "BA")
            ),
        )
    )


def up_and_down():
    """Largest L2 difference, relative, of states reached with rising and with falling load, each from its
    neighbour.
    """
    here, up, down, state = problem(0.25, mb.Microblock(PSI0)), {}, {}, None
    for states, shares in ((up, PATH), (down, PATH[::-1])):
        for share in shares:
            states[share] = state = here.solve(load=share * LOAD, initial=state)
    return max(panel_solution.difference(up[share].solution, down[share].solution) for share in PATH)


def work():
    """Change of the energy over the work of the load between the ends of PATH, less 1.

    Integral of P dd by parts, d at Gauss points of P. The level of the half-plane is the same function of P
    in both: a level tau P of the approach adds tau P^2/2 to the energy.
    """
    here = problem(0.25, mb.Microblock(PSI0))
    first, last = (here.solve(load=share * LOAD) for share in (PATH[0], PATH[-1]))
    points, weights = np.polynomial.legendre.leggauss(GAUSS)
    half = (last.load - first.load) / 2
    loads = (first.load + last.load) / 2 + half * points
    between = [here.solve(load=float(load), initial=first) for load in loads]
    start, *approaches, end = (state.solution.approach for state in (first, *between, last))
    done = last.load * end - first.load * start - half * (weights @ approaches)
    return float((last.energy - first.energy) / done - 1)


@dataclass(frozen=True)
class Row:
    """One line of the table."""

    what: str
    value: float
    expected: str
    because: str


def table_limits():
    """Hertz's contact, symmetries and the balance of energy come out of the contact line as they must.

    What must hold, and how well it does, by panels of order 14 on a half-plane.
    """
    found = []
    for name, law in (("microblock", mb.Microblock()), ("unilateral", mb.Unilateral())):
        pressures, edges = hertz_distances(law)
        found += [
            Row(
                f"{name}: L2 distance from the Hertz ellipse, alpha = {SMALL[-1]:g}",
                pressures[-1],
                "-> 0",
                "classical limit",
            ),
            Row(
                f"{name}: its rate in alpha",
                rate(pressures),
                "1",
                "with logarithms and square roots at the edge",
            ),
            Row(
                f"{name}: rate of the edge in alpha",
                rate(edges),
                "1",
                "the edge moves by a fixed share of ell",
            ),
        ]
    changes = lever_changes()
    found += [
        Row(
            "other P, R, E at the same R/a_Hz, psi0",
            units(),
            "0",
            "exact: angles and ratios of lengths are kept",
        ),
        Row(
            f"fixed psi0 R/a_Hz, psi0 from {HALVED[-2]:g} to {HALVED[-1]:g}",
            changes[-1],
            "-> 0",
            "the levers carry psi0 itself",
        ),
        Row("its rate in psi0", rate(changes), "1", "levers 1 + psi0 and 1 - psi0"),
        Row("-psi0 against the mirror image", mirrored(), "0", "symmetry of half-plane and cylinder"),
        Row("load up against load down", up_and_down(), "0", "no friction: one state a load"),
        Row("energy over work of the load, less 1", work(), "0", "dE = P dd"),
    ]
    return [asdict(row) for row in found]


TABLES = {"limits_table": table_limits}
