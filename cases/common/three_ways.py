"""What cases on the contact line share: a problem solved on panels, verified by fitted elements, by cells and
by a closed form.
"""

import time

import numpy as np

import microblock as mb
from microblock.data.records import column, grouped
from microblock.model.zones import distance, distance_to_ends, half_widths

from .options import option

CLASSICAL = 1e-10  # coupling of the classical limit: results differ from it by as much
LAWS = {"classical": mb.Unilateral, "unilateral": mb.Unilateral, "microblock": mb.Microblock}
WINDOW = 1.1  # of cells over the contact


def cells_that_verify(default):
    """The parameter that says how many cells verify the panels."""
    return option(default, "cells that verify the panels", int, at_least=256, at_most=2**20)


def elements_that_verify():
    """The parameter that says what is asked of the finite elements that verify the panels."""
    return option(1e-2, "of the finite elements that verify the panels", at_least=1e-4, below=1)


def solid_of(parameters, law):
    """The solid with E* = 1, classical for the law of that name."""
    beta = CLASSICAL if law == "classical" else parameters.beta
    return mb.Cosserat(E=1 - parameters.nu**2, nu=parameters.nu, ell=parameters.alpha, beta=beta)


def on_panels(solid, obstacle, law, load, rtol):
    """(State, seconds)."""
    start = time.perf_counter()
    state = mb.Contact(mb.HalfPlane(solid), obstacle, LAWS[law]()).solve(load=load, rtol=rtol)
    return state, time.perf_counter() - start


def on_cells(state, nodes):
    """State of the problem of another one on cells, on a window around its contact."""
    contact = state.zones["contact"]
    middle, half = (contact[-1][1] + contact[0][0]) / 2, WINDOW * (contact[-1][1] - contact[0][0]) / 2
    method = mb.Cells(nodes=nodes, window=(middle - half, middle + half))
    return state.problem.with_(method=method).solve(load=state.load)


def verified(state, nodes, rtol, exact=None):
    """Relative L2 distances of a State to the other ways, at the centres of the cells; None where a way does
    not answer.

    Next to the ends of the obstacle the distance from them is the weight. `exact`: pressure(x) of the one
    corner, if known.
    """
    cells = on_cells(state, nodes)
    found = {
        "difference_cells": difference(state, cells.x, cells.pressures),
        "estimate_cells": cells.error_estimate,
        "error": None if exact is None else difference(state, cells.x, {"C": exact(cells.x)}),
    }
    try:
        elements = mb.Contact(mb.Block(state.solid), state.obstacle, state.law).solve(
            load=state.load, rtol=rtol
        )
    except mb.MicroblockError as failure:
        return {
            **found,
            "difference_fe": None,
            "estimate_fe": None,
            "failure_fe": " ".join(str(failure).split()),
        }
    there = {corner: elements.pressure_at(cells.x, corner) for corner in state.law.corners}
    return {
        **found,
        "difference_fe": difference(state, cells.x, there),
        "estimate_fe": elements.error_estimate,
        "failure_fe": None,
    }


def seen(state):
    """A function: x -> (pressure, micromoment over ell) of a State, from the pressures of its corners."""

    def fields(x):
        levers = state.law.levers(x)
        pressures = {corner: state.pressure_at(x, corner) for corner in levers}
        return sum(pressures.values()), sum(levers[corner] * own for corner, own in pressures.items()) / 2

    return fields


def difference(state, x, pressures):
    """max(|dp|, |dM|/ell)/|p| between a State and other pressures {corner: array (n,)} at even x."""
    weights = distance_to_ends(x, getattr(state.obstacle, "ends", ()), state.law.shifts(state.solid.ell))
    levers = state.law.levers(x)
    own = {corner: state.pressure_at(x, corner) for corner in levers}
    wrong = {corner: own[corner] - pressures[corner] for corner in levers}
    return distance(
        weights,
        sum(wrong.values()),
        sum(levers[corner] * wrong[corner] for corner in levers) / 2,
        sum(own.values()),
    )


def zones_of(state):
    """{"A", "B", "full", "contact": intervals} of a State as lists, and (half_width, inner_half_width)."""
    zones = {name: list(map(list, intervals)) for name, intervals in state.zones.items()}
    return zones, half_widths(zones["contact"])


def centre(state):
    """Where the resultant of the corner forces acts: mean of the corners' places, each corner weighted with
    its force.
    """
    shifts = state.law.shifts(state.solid.ell)
    return float(
        sum(state.weights @ (own * (state.x - shift)) for own, shift in zip(state.pressures.values(), shifts))
        / state.load
    )


def profile_of(state, unit):
    """Rows along the contact line: number of the interval of contact, x, pressure of all corners, micromoment
    over ell, psi.

    unit : float, a pressure over which pressure and micromoment over ell are given
    """
    zone = np.searchsorted([right for _, right in state.zones["contact"]], state.x)
    columns = zone, state.x, state.pressure / unit, state.micromoment / state.solid.ell / unit, state.psi
    return [
        dict(zip(("zone", "x", "pressure", "micromoment", "psi"), map(float, node))) for node in zip(*columns)
    ]


def draw_zones(axis, nodes, name, **style):
    """A column of records over x, each interval of contact a line of its own."""
    for number, own in enumerate(grouped(nodes, "zone").values()):
        axis.plot(
            column(own, "x"),
            column(own, name),
            **{**style, "label": style.get("label") if number == 0 else None},
        )
