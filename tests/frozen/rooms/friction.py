"""Histories with friction by every method: states, zones, events, energies."""

from .. import library_friction, library_reports, of_kind
from .. import problems_friction as problems

LEAST, MOST = 1e-9, 1e-3  # tolerances of edges
SOLVED = 1e-4  # of what increments on half-spaces add up to, each to 1e-7 of its displacement


def rows(choice):
    for problem in choice.of(problems.HISTORIES):
        yield from rows_of_history(problem)
    yield from rows_of_estimates(problems.MEASURED)
    yield from library_reports.histories(choice)
    for name in choice.named({name: set() for name in problems.IN_SPACE}):
        yield from rows_in_space(name)


def rows_in_space(name):
    """Rows of the states of a history on a half-space, to what is left of increments solved to 1e-7."""
    for number, state in enumerate(library_friction.history_in_space(*problems.IN_SPACE[name]).states):
        q1, q2 = state.shear_traction.T
        values = {
            "approach": state.approach,
            "motion 1": state.tangential_approach[0],
            "motion 2": state.tangential_approach[1],
            "energy": state.energy,
            "dissipation": state.dissipation,
            "squares of q1": state.weights @ q1**2,
            "squares of q2": state.weights @ q2**2,
            "squares of slip": state.weights @ (state.slip**2).sum(axis=1),
        }
        for quantity, value in values.items():
            yield f"{name} state {number} {quantity}", value, "estimated", SOLVED
        yield f"{name} state {number} error_estimate", state.error_estimate, "count"


def rows_of_history(problem):
    """Rows of the states of a history and of its events."""
    history = library_friction.history_of(problem)
    kind = "estimated" if "rtol" in problem else "discrete"
    worst = max(getattr(state, "error_estimate", None) or 0.0 for state in history.states)
    for number, state in enumerate(history.states):
        row = f"{problem['name']} state {number}"
        tolerance = state.error_estimate or 0.0
        values = library_friction.integrals(state, number in problem["full"])
        if number in problem["full"]:
            values |= library_friction.pointwise(state, problem)
            if kind == "discrete":
                values |= library_friction.profile(state)
            values |= {
                name: getattr(state, name)
                for name in ("method", "error_estimate", "residual", "iterations", "unknowns")
            }
        for name, value in values.items():
            yield of_kind(f"{row} {name}", value, kind, tolerance)
        yield (
            f"{row} zones",
            " ".join(f"{len(intervals)} {name}" for name, intervals in state.zones.items()),
            "outcome",
        )
        if number in problem["full"]:
            for name, edge, said in library_friction.zones(state):
                yield from edge_row(f"{row} {name}", edge, kind, max(said, tolerance))
    words = ", ".join(f"{event.kind} {event.zone} to pair {event.pair}" for event in history.events)
    yield f"{problem['name']} events", words, "outcome"
    for number, event in enumerate(history.events):
        row = f"{problem['name']} event {number}"
        yield of_kind(f"{row} normal + shear", event.load + event.shear, kind, worst)
        yield of_kind(f"{row} 1 + x", 1 + event.x, kind, worst**0.5)


def rows_of_estimates(problem):
    """Of a history to a loose tolerance what does not depend on it, and its estimates, which may change."""
    history = library_friction.history_of(problem)
    for number, state in enumerate(history.states):
        w, row = state.weights, f"{problem['name']} state {number}"
        forces = {"normal force": w @ state.pressure, "shear force": w @ state.shear_traction}
        forces["energies"] = (state.energy + state.dissipation) / state.work
        errors = [edge for pairs in state.zone_errors.values() for pair in pairs or () for edge in pair]
        counts = {"error_estimate": state.error_estimate}
        counts["zone errors"] = max(errors)
        zones = " ".join(f"{len(state.zones[name])} {name}" for name in ("A", "B", "contact"))
        yield f"{row} zones", zones, "outcome"
        yield f"{row} warnings", len(state.warnings), "outcome"
        yield from ((f"{row} {name}", value, "discrete") for name, value in forces.items())
        yield from ((f"{row} {name}", value, "count") for name, value in counts.items())
    worst = max(event.load_error or 0.0 for event in history.events)
    yield f"{problem['name']} error of events", worst, "count"


def edge_row(name, edge, kind, said):
    """A row of an edge of a zone, to what is said of its error."""
    if not said:
        yield name, edge, kind
    else:
        yield name, edge, "estimated", min(max(said / (abs(edge) or 1.0), LEAST), MOST)
