"""Zones whose edges have moved: edges stop at ends of the obstacle, zones vanish, merge or are halved.

A zone whose edges have met is gone, and so is a hole: its zones merge. A zone that carries a load cannot be
gone: it is half as wide instead. Edges of two corners that would pass each other by more than they meet come
half as near.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ..errors import NotConverged
from ..model.problem import Problem, half_line
from ..model.types import Array, CornerZones


@dataclass(frozen=True)
class Edge:
    """An edge of a zone on its way.

    Attributes
    ----------
    corner : number of the corner
    start, target : x before and after the step (lengths)
    pressed : whether it is the left edge of a zone that carries a load
    """

    corner: int
    start: float
    target: float
    pressed: bool = False


def moved_zones(problem: Problem, load: float, edges: Iterable[Edge]) -> CornerZones:
    """Returns the computed zones with edges at their targets, where those of two corners do not pass each
    other by more than they meet; raises NotConverged if none is left.
    """
    pieces = {corner: np.clip(problem.pieces_of(corner), *problem.reach) for corner in problem.corners}
    bounded = _without_met([_within_piece(pieces[edge.corner], edge) for edge in edges])
    if problem.mirror and not half_line(problem):
        bounded += [replace(e, corner=1 - e.corner, start=-e.start, target=-e.target) for e in bounded[::-1]]
    order = sorted(range(len(bounded)), key=lambda i: bounded[i].start)
    for i, j in pairwise(order):
        left = bounded[i]
        right = bounded[j]
        if left.corner != right.corner and left.start < right.start and left.target > right.target:
            middle = left.target + right.target
            half = (right.start - left.start) / 2
            bounded[i] = replace(left, target=(middle + half) / 2)
            bounded[j] = replace(right, target=(middle - half) / 2)
    bounded = _without_met(bounded)
    if not bounded:
        raise NotConverged(f"no zone is left at load {load:g}")
    targets = {corner: [e.target for e in bounded if e.corner == corner] for corner in problem.corners}
    return problem.computed({corner: tuple(zip(x[::2], x[1::2])) for corner, x in targets.items()})


def _within_piece(pieces: Array, edge: Edge) -> Edge:
    """Returns an edge whose target lies on the piece of the obstacle, of array (k, 2), that it moves in."""
    piece = np.searchsorted(pieces[1:, 0], edge.start, side="right")
    return replace(edge, target=float(np.clip(edge.target, *pieces[piece])))


def _without_met(edges: list[Edge]) -> list[Edge]:
    """Returns edges without neighbours of one corner that have met; a zone that carries a load is halved."""
    edges = list(edges)
    while True:
        widths = [
            right.target - left.target if left.corner == right.corner else np.inf
            for left, right in pairwise(edges)
        ]
        if not widths or min(widths) > 0:
            return edges
        i = int(np.argmin(widths))
        left, right = edges[i : i + 2]
        if left.pressed:
            half = (right.start - left.start) / 4
            middle = np.clip((left.target + right.target) / 2, left.start + half, right.start - half)
            left = replace(left, target=float(middle - half), pressed=False)
            edges[i : i + 2] = left, replace(right, target=float(middle + half), pressed=False)
        else:
            del edges[i : i + 2]


def order_of_edges(problem: Problem, zones: CornerZones) -> list[int]:
    """Returns the corners of all edges in the order of their abscissae."""
    every = problem.all_zones(zones).items()
    return [corner for _, corner in sorted((x, corner) for corner, own in every for x in np.ravel(own))]
