"""Maps of friction: up to which coefficient contact has one answer, by cells and by finite elements."""

import numpy as np

import microblock as mb
from microblock.errors import NotConverged
from microblock.fem.meshes import rectangles

from .limits_maps import Axis, Map, Outcome
from .limits_states import CONTACTS, LOAD, NU

LAWS = {"microblock": mb.Microblock, "unilateral": mb.Unilateral}
SHEARS = (0.0, 0.5, 0.999, -0.999)  # over f P: pressed, sheared to full slip, reversed to full slip
BLOCK = 12.0  # half of its width, over a_Hz
REACH = 2.6  # half of the squares that may touch, over a_Hz
SIDE = 0.2  # of the squares there
COLUMNS = 8  # of the square block
CELLS = 0.3  # rtol of the cells, which their second level keeps
PLACES = np.linspace(-REACH, REACH, 105)
ALIKE = 1e-8  # of two algorithms for one discrete problem


def _solid(alpha):
    return mb.Cosserat(E=2 * (1 - NU**2), nu=NU, ell=alpha, beta=1.0)


def _history(body, obstacle, contact, friction, method=None, rtol=None):
    """The states at all shears."""
    law = LAWS[contact](friction=friction)
    pairs = [(LOAD, shear * friction * LOAD) for shear in SHEARS]
    return mb.Contact(body, obstacle, law, method).history(pairs, rtol=rtol).states


def _by_cells(friction, alpha, contact):
    return _history(mb.HalfPlane(_solid(alpha)), mb.Cylinder(1.0), contact, friction, rtol=CELLS)


def _by_mesh(friction, alpha, contact):
    squares = mb.Uniform(h=SIDE, order=2, reach=REACH, newton=mb.Newton())
    return _history(mb.Block(_solid(alpha), BLOCK), mb.Cylinder(1.0), contact, friction, squares)


METHODS = {"cells": _by_cells, "mesh": _by_mesh}


def left_of(state, values):
    """Forces left of PLACES from tractions at the state's x, over the load."""
    ends = np.append(state.x - state.weights / 2, state.x[-1] + state.weights[-1] / 2)
    return np.interp(PLACES, ends, np.append(0.0, np.cumsum(state.weights * values))) / LOAD


def misplaced(states, others, friction):
    """The largest share of the normal force, or of f times it, that stands elsewhere in other states."""
    return max(
        float(np.abs(left_of(one, getattr(one, name)) - left_of(other, getattr(other, name))).max() / scale)
        for one, other in zip(states, others)
        for name, scale in (("pressure", 1.0), ("shear_traction", friction))
    )


def _balanced(state):
    """What is left of a state's work over its energy and dissipation: the answer where no other method has
    one.
    """
    lost = abs(state.work - state.energy - state.dissipation) / abs(state.work)
    return Outcome(float(lost), ALIKE, judge="energy")


def cylinder(friction, alpha, contact, method):
    """A rigid cylinder pressed and sheared to full slip both ways, against the other method."""
    states = METHODS[method](friction, alpha, contact)
    (judge,) = set(METHODS) - {method}
    try:
        others = METHODS[judge](friction, alpha, contact)
    except NotConverged:
        return _balanced(states[-1])
    return Outcome(misplaced(states, others, friction), None, judge=judge)


def square(friction, alpha, contact):
    """A square block pressed by a plane on all of its side, and sheared to full slip both ways: Newton's
    method against the condensed body, or, where that raises an error, against the balance of its energy.
    """
    mesh = rectangles(np.linspace(-1, 1, COLUMNS + 1), np.linspace(-2, 0, COLUMNS + 1))
    body = mb.Body(mesh, _solid(alpha), 2, fixed="bottom", contact="top")
    states = _history(body, mb.Plane(), contact, friction, mb.Newton())
    try:
        others = _history(body, mb.Plane(), contact, friction, mb.Condensed())
    except NotConverged:
        return _balanced(states[-1])
    error = max(np.abs(one.pressure - other.pressure).max() for one, other in zip(states, others))
    return Outcome(float(error / states[-1].pressure.max()), ALIKE, judge="condensed")


FRICTION = Axis("friction", "f", 0.3, 10.0, degenerate="high")
ALPHA = Axis("alpha", "alpha", 0.01, 3.0, degenerate="both")
MAPS = (
    Map(
        "friction_cylinder",
        "Up to which friction is there one answer under a cylinder, and is it said beyond?",
        cylinder,
        (FRICTION, ALPHA, CONTACTS),
        ("method", tuple(METHODS)),
        0.6,
        "share of the force that stands elsewhere",
    ),
    Map(
        "friction_square",
        "Up to which friction is there one answer on a block that touches with all of its side?",
        square,
        (FRICTION, ALPHA, CONTACTS),
        share=0.4,
        error="pressure, or balance of energy",
    ),
)
