"""Frozen problems of friction in the names of the library: see `tests.frozen.library`."""

from dataclasses import dataclass

import numpy as np

import microblock as mb
from microblock.contact_solvers import active_set, projected_gradients
from microblock.contact_solvers.event_driven import EventDrivenContact
from microblock.contact_solvers.frictional_contact import FrictionalContact
from microblock.data import export
from microblock.halfplane.friction_solver import FrictionSolver
from microblock.model.history import History

from . import library
from . import problems_friction as problems

SAME = 1e-9  # share of a leg, within which changes are one event
BESIDE = (
    0.0041  # of the reach, by which cells stand to the right: alike to both sides, either of two may slip
)
OPEN = 1e-9  # of the largest pressure: less is the rounding of an open corner
NODES = {"stick", "slip"}  # states of a node that touches


@dataclass(frozen=True)
class Followed:
    """A path of loads as any follower gives it.

    Attributes
    ----------
    events : list of (leg, share, kind, number)
        Corners "close" and "open"; nodes "stick", "slip" or "leave". What changes to and fro at one load is
        left out, as is that all nodes slip at a pair Q = f P; those at one load are in alphabetical order.
    forces : array (legs, corners n + n)
        Corner forces and tangential forces at the pairs.
    energies : array (legs, 3)
        Energy, work and dissipation.
    motions : array (legs, 2)
        Approach and tangential displacement of the obstacle.
    slip : array (legs, n)
    residual : float
    """

    events: list
    forces: np.ndarray
    energies: np.ndarray
    motions: np.ndarray
    slip: np.ndarray
    residual: float


def solve_system(compliance, gaps, friction, path, coupled=True):
    """The path of a small system, `Followed`, by the follower of cells."""
    corners, n = gaps.shape
    m = corners * n
    solver = EventDrivenContact(
        FrictionalContact(
            compliance[:m, :m], compliance[m:, :m], compliance[m:, m:], gaps.ravel(), friction, coupled
        )
    )
    states = [solver.follow(*pair) for pair in path]
    return Followed(
        _events([_plain(each_state) for each_state in solver.changes], path, friction),
        np.array([np.concatenate((each_state.normal, each_state.tangential)) for each_state in states]),
        np.array([(each_state.energy, each_state.work, each_state.dissipation) for each_state in states]),
        np.array([(each_state.approach, each_state.offset) for each_state in states]),
        np.array([each_state.slip for each_state in states]),
        max(each_state.residual for each_state in states),
    )


def answer(solve, system):
    """What a follower gives, or the name of the error that it raises."""
    try:
        return solve(**system)
    except mb.MicroblockError as failure:
        return type(failure).__name__


def touching(compliance, gaps, load):
    """{solver: (corner forces, gaps, approach)} without friction at a load, and events on the way there."""
    m = gaps.size
    H, initial = compliance[:m, :m], gaps.ravel()
    finite = np.isfinite(initial)
    state = active_set.solve(H, initial, load=load)
    pressed = active_set.solve(H, initial, approach=state.approach)
    events = active_set.path(H, initial, load)
    changed = np.bincount([event.corner for event in events], minlength=m) % 2 == 1
    path = active_set.solve(H, initial, load=load, start=changed)
    products = projected_gradients.solve_matrix_free(
        _Dense(H), initial.reshape(gaps.shape), load=load, rtol=1e-13
    )
    solutions = {
        "active set": (state.forces, state.gaps, state.approach),
        "approach given": (pressed.forces, pressed.gaps, pressed.approach),
        "path": (path.forces, path.gaps, path.approach),
        "gradients": (products.forces.ravel(), products.gaps.ravel(), products.approach),
    }
    compact = H[np.ix_(finite, finite)]
    lift, forces = active_set.rigid_constant(compact), np.zeros(m)
    closed = np.ones(finite.sum(), bool)
    forces[finite], *_ = active_set.block_pivoting(compact + lift, initial[finite], closed, load)
    bare = initial + H @ forces
    approach = float(bare[forces > 0].mean())
    solutions["exchange"] = forces, bare - approach, approach
    return solutions, [(change.kind, change.corner, change.load) for change in events]


def touching_twice(compliance, gaps, load):
    """(gaps, forces of both, approach) without friction where every corner is there twice."""
    m = gaps.size
    twice = np.tile(np.arange(m), 2)
    state = active_set.solve(compliance[np.ix_(twice, twice)], gaps.ravel()[twice], load=load)
    return np.minimum(state.gaps[:m], 1e3), state.forces.reshape(2, m).sum(axis=0), state.approach


class _Dense(projected_gradients.MatrixFree):
    """A flexibility by its products alone, as `projected_gradients.solve_matrix_free` takes it."""

    def __init__(self, H):
        self._H = H

    def __matmul__(self, forces):
        return (self._H @ forces.ravel()).reshape(forces.shape)

    def on_face(self, there):
        return self._precondition

    def _precondition(self, values):
        return values / np.diag(self._H).reshape(values.shape)


def _plain(change):
    return change.leg, float(change.fraction), change.kind, change.index


def _events(changes, path, friction):
    """What changes at each load, as of `Followed`.

    On a leg from full slip to full slip all nodes that touch count as slipping.
    """
    raw = {}
    shown = {}
    events = []
    full = [0.0] + [np.sign(Q) * (abs(Q) >= friction * P * (1 - SAME)) for P, Q in path]
    sliding = [before != 0 and before == after for before, after in zip(full, full[1:])]
    for leg, slides in enumerate(sliding):
        for share, group in _groups([change[1:] for change in changes if change[0] == leg]):
            raw |= {(kind in ("close", "open"), number): kind for _, kind, number in group}
            last = full[leg + 1] and share >= 1 - SAME
            for key in sorted(raw, key=lambda key: (raw[key], key)):
                kind_after = raw[key]
                before = shown.get(key, "open" if key[0] else "leave")
                kind_after = "slip" if slides and kind_after == "stick" else kind_after
                if kind_after != before and not (last and {kind_after, before} == NODES):
                    events.append((leg, share, kind_after, key[1]))
                    shown[key] = kind_after
    return events


def _groups(changes):
    """[(share, changes there), ...] of a leg, from share 0 on."""
    groups = [(0.0, [])]
    for change in changes:
        if change[0] > groups[-1][0] + SAME:
            groups.append((change[0], []))
        groups[-1][1].append(change)
    return groups


def history_of(problem):
    """The History of a problem."""
    contact, pairs = contact_of(problem), np.array(problem["pairs"])
    if "cells" not in problem and "levels" not in problem:
        tolerance = library._given(problem, "rtol")
        return contact.history(problem["pairs"], coupled=problem["coupled"], **tolerance)
    solver = FrictionSolver(contact.solver, pairs, problem["coupled"])
    level = None
    for number in range(problem.get("levels", 0)):
        level = solver.refined(number, level)
    level = level or solver.on_cells(cells_of(*problem["cells"]))
    return History(contact, [solution.state() for solution in level.solutions], level.events)


def history_in_space(law, coupled):
    """The History of a sphere on cells of a half-space, sheared to one side, then to another while it is
    relieved."""
    solid = mb.Cosserat(E=1 - 0.3**2, nu=0.3, ell=0.3, beta=1)
    rubbing = {kind.__name__: kind for kind in (mb.Unilateral, mb.Microclamped, mb.Microblock)}[law](
        friction=0.3
    )
    cells = mb.Cells(nodes=32, window=(-1.3, 1.3))
    problem = mb.Contact(mb.HalfSpace(solid), mb.Sphere(R=1.0), rubbing, cells)
    return problem.history([(1.2, 0.2, 0.1), (0.8, 0.0, -0.15)], coupled=coupled)


def cells_of(reach, number):
    """Edges of cells that are longer towards the ends."""
    places = np.linspace(-1, 1, number + 1)
    places = reach * (places + places**3) / 2 + reach * BESIDE
    return np.column_stack((places[:-1], places[1:]))


def contact_of(problem):
    """The Contact, with a second body if there is one."""
    contact = library.contact_of(problem)
    if "second" not in problem:
        return contact
    second = mb.HalfPlane(mb.Cosserat(**{**problem["solid"], **problem["second"]}), problem.get("period"))
    return contact.with_(obstacle=mb.Deformable(second, contact.obstacle))


def integrals(state, full):
    """{quantity: number} of a state of a history, some of them unless it is `full`."""
    fields = {"pressure": state.pressure, "shear": state.shear_traction, "slip": state.slip}
    numbers = {"approach": state.approach, "work": state.work, "dissipation": state.dissipation}
    if full:
        fields |= {"micromoment": state.micromoment, "psi": state.psi}
        numbers |= {
            "tangential approach": state.tangential_approach,
            "half_width": state.half_width,
            "energy": state.energy,
            "normal force": state.weights @ state.pressure,
            "shear force": state.weights @ state.shear_traction,
        }
    return numbers | {f"{name} squared": state.weights @ values**2 for name, values in fields.items()}


def pointwise(state, problem):
    """{quantity at a point: number}: fields on the surface, gaps or pressures of corners, fields below."""
    numbers = {}
    law = state.law
    read = {True: "pressure", False: "gap"}
    values = {"shear": state.shear_traction, "slip": state.slip}
    values |= {"micromoment": state.micromoment} if len(law.corners) > 1 or law.clamps_rotation else {}
    values |= {} if law.clamps_rotation else {"psi": state.psi}
    fixed = {} if library.estimated(problem) else values  # there nodes follow from what is asked for
    for x in problem["at"]:
        numbers |= {f"{name} at {x:g}": np.interp(x, state.x, nodal) for name, nodal in fixed.items()}
        for corner in law.corners:
            pressure = state.pressure_at(x, corner)
            closed = bool(pressure > OPEN * state.pressure.max())
            value = float(pressure if closed else state.gap_at(corner, x))
            numbers[f"{read[closed]} {corner} at {x:g}"] = value
    for x in problem.get("beside", ()):  # of panels: between nodes they are as accurate as at them
        numbers[f"gap at {x:g}"] = state.gap_at(law.corners[0], x)
        moved = state.counter_displacement([x, 2 * x])
        numbers[f"counter displacement at {x:g} over {2 * x:g}"] = moved[0] - moved[1]
    for point in problem.get("below", ()):
        numbers |= library.below(state, *point)
    if "supports" in problem:
        force, moment = state.reaction(problem["supports"])
        numbers |= zip(("support force 1", "support force 2", "support moment"), (*force, moment))
    return numbers


def profile(state):
    """{quantity: sum over its values}: what is exported of a state, and its surface around the contact."""
    around = state.surface()
    values = {f"surface {name}": getattr(around, name) for name in ("x", "gaps", "displacement", "psi")}
    values |= {f"profile {name}": column for name, column in export.profile(state).items() if name != "x2"}
    return {name: digest(np.where(np.isfinite(column), column, 0.0)) for name, column in values.items()}


def digest(values):
    """A sum of positive terms with irrational weights: a sign, a place or a value that changes shows."""
    values = np.ravel(values)
    weights = 1 + problems.GOLDEN * np.arange(1, len(values) + 1) % 1
    return float(np.abs(values) @ (weights * np.where(values < 0, 1.3, 1.0)))


def zones(state):
    """[(name, edge, what is said of its error), ...] of all zones of a state; 0 where nothing is said."""
    said = getattr(state.solution, "doubts", {})
    return [
        (f"zone {name} {number} {side}", edge, said.get(edge, 0.0))
        for name, intervals in state.zones.items()
        if name not in ("full", "slip")  # they have the edges of the others
        for number, interval in enumerate(intervals)
        for side, edge in zip(("left", "right"), interval)
    ]
