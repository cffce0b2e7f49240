"""From state to state of the monolithic Newton method: load steps, halved where it fails; the next event."""

from dataclasses import dataclass

import numpy as np

from ..errors import BadArgument, NotConverged, require_finite, require_values


@dataclass(frozen=True)
class NodalEvent:
    """A corner at one node closes or opens at this level of the control parameter.

    Examples
    --------
    >>> from microblock.fem.newton_path import NodalEvent
    >>> event = NodalEvent(level=0.5, corner="A", node=3, kind="closes")
    >>> event.kind, event.level
    ('closes', 0.5)
    """

    level: float
    corner: str
    node: int
    kind: str


def next_event(first, second):
    """The first corner to change its contact state beyond two states of one path, or None.

    Between events all is affine in the level, so two states with the same active set give the event exactly.
    """
    changed = [corner for corner in first.closed if np.any(first.closed[corner] != second.closed[corner])]
    if changed or not second.level > first.level:
        raise BadArgument("second", second.level, f"must lie above {first.level:g} with the same active set")
    events = []
    for corner, closed in second.closed.items():
        for nodes, before, now, kind in (
            (~closed, first.gaps[corner], second.gaps[corner], "closes"),
            (closed, -first.multipliers[corner], -second.multipliers[corner], "opens"),
        ):
            for node in np.flatnonzero(nodes & np.isfinite(now) & (now < before)):
                ahead = (second.level - first.level) * now[node] / (before[node] - now[node])
                events.append(NodalEvent(float(second.level + ahead), corner, int(node), kind))
    return min(events, key=lambda event: event.level, default=None)


def load_path(newton, levels, *, start=None):
    """States at the `levels` of the control parameter, one after the other (a generator).

    A step at which Newton fails is halved; NotConverged is raised where it is 1e-4 of the way, with `reached`
    the last level that converged.

    Examples
    --------
    >>> from microblock.fem import meshes
    >>> from microblock.fem.facets import ContactFacets
    >>> from microblock.fem.newton import MonolithicNewton
    >>> from microblock.fem.newton_path import load_path
    >>> body = mb.Body(meshes.line(depth=1.0, elements=2), mb.Cosserat(E=2.6, nu=0.3, ell=0.2, beta=1),
    ...                order=4, fixed="middle")
    >>> newton = MonolithicNewton(body, ContactFacets(body, mb.Unilateral(), mb.Plane()), control="load")
    >>> [round(state.load, 9) for state in load_path(newton, [0.01, 0.02])]
    [0.01, 0.02]
    """
    if not hasattr(newton, "solve"):
        raise BadArgument("newton", newton, "must be a MonolithicNewton")
    reached = 0.0 if start is None else getattr(start, newton.control)
    for target in require_values(levels=levels)[0]:
        require_finite(level=target)
        step = whole = target - reached
        while True:
            trial = target if abs(step) >= abs(target - reached) else reached + step
            try:
                start, reached = newton.solve(trial, start), trial
            except NotConverged as failure:
                step /= 2
                if abs(step) < 1e-4 * abs(whole) or whole == 0:
                    raise NotConverged(
                        f"load stepping stopped at {newton.control} {reached} on the way to "
                        f"{target:g}: {failure}",
                        reached=reached,
                        iterations=failure.iterations,
                    ) from failure
                continue
            if reached == target:
                break
        yield start
