"""A contact problem along x1 as every solver takes it."""

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from ..errors import require
from .corner_geometry import Blocks
from .intervals import contains, joined
from .law import BUILT_IN, Law, horizontal_surface, is_even, is_uniform
from .material import Cosserat, joint_modulus
from .obstacles import RigidObstacle, as_obstacle, heights, jumps_of, scales
from .piecewise_chebyshev import EMPTY_PROXY, Proxy
from .types import Array, CornerZones, Integers, Interval, ObstacleLike

GROWTH = 4.0  # of panels away from an edge


@dataclass(frozen=True)
class Problem:
    """The problem on the line: solid, law and obstacle.

    With `mirror` all is symmetric about x = 0, and the first corner alone is computed, on x >= 0 if it is the
    only one. Without `candidates` the obstacle is smooth between its named places. `counter` is the solid of
    a second body.
    """

    solid: Cosserat
    law: Law
    obstacle: RigidObstacle  # or what `as_obstacle` makes one of
    mirror: bool = False
    candidates: Any = field(default=None, compare=False, repr=False)  # ContactCandidates, or None
    counter: Cosserat | None = None
    blocks: Blocks = field(default=cast(Any, None), compare=False, repr=False)  # of the law

    def __post_init__(self) -> None:
        object.__setattr__(self, "obstacle", as_obstacle(self.obstacle))
        if self.blocks is None:
            object.__setattr__(self, "blocks", Blocks(self.law, self.solid.ell))

    @property
    def ell(self) -> float:
        return self.solid.ell

    @property
    def E_star(self) -> float:
        return joint_modulus(self.solid, self.counter)

    @property
    def corners(self) -> range:
        """Numbers of the corners that are computed."""
        return range(1 if self.mirror else len(self.law.corners))

    @property
    def shifts(self) -> tuple[float, ...]:
        """How far right of each corner its contact point lies (lengths)."""
        return self.blocks.shifts

    @cached_property
    def _places(self) -> Array:
        """Contact points with a corner at a slope discontinuity or an edge, ascending."""
        named = [*self.obstacle.kinks, *self.obstacle.ends]
        under_corners = [place + shift for place in named for shift in self.shifts]
        places = np.sort([*under_corners, *self._angle.singular])
        # ell a multiple of the spacing of samples, corners meet them up to rounding
        size = np.abs(places[np.isfinite(places)]).max(initial=0.0) + self.ell  # an obstacle may have one end
        with np.errstate(invalid="ignore"):  # of corners that meet no end
            far = np.diff(places) > 1e-13 * size
        return np.concatenate((places[:1], places[1:][far]))

    @property
    def _angle(self) -> Proxy:
        return EMPTY_PROXY if self.candidates is None else self.candidates.angle

    def _first_of(self, places: ArrayLike) -> list[float]:
        """Returns for each place the first of those that are one with it but for rounding."""
        return self._places[np.searchsorted(self._places, np.ravel(places), side="right") - 1].tolist()

    @cached_property
    def kinks(self) -> dict[float, dict[int, float]]:
        """{contact point: {corner: jump of its initial gap's slope}}."""
        met = [
            (x + shift, i, jump) for x, jump in jumps_of(self.obstacle) for i, shift in enumerate(self.shifts)
        ]
        # where psi0's slope jumps, that of the levers does, or of the gaps as well
        size = self.ell / 2 * self.law.psi0_in_gaps
        angles = zip(self._angle.singular, self._angle.jumps)
        met += [(x, i, sign * size * jump) for x, jump in angles for i, sign in ((0, 1), (1, -1))]
        kinks: dict[float, dict[int, float]] = {}
        for place, (_, corner, jump) in zip(self._first_of([place for place, *_ in met]), met):
            jumps = kinks.setdefault(place, {})
            jumps[corner] = jumps.get(corner, 0.0) + float(jump)
        return kinks

    @cached_property
    def apexes(self) -> dict[int, Array]:
        """{corner: contact points at which its initial gap has a peak towards the body, array (k,)}."""
        return {
            corner: np.array([x for x, jumps in self.kinks.items() if jumps.get(corner, 0.0) > 0])
            for corner in range(len(self.shifts))
        }

    @cached_property
    def _pieces(self) -> list[tuple[Array, Array]]:
        """[(edges, lengths), ...] of gaps and levers, in x of the contact point."""
        if self.candidates is None:
            return []
        pieces = [(self.candidates.edges + shift, self.candidates.lengths) for shift in self.shifts]
        pieces.append((self._angle.edges, self._angle.lengths))
        return [(edges, lengths) for edges, lengths in pieces if np.isfinite(lengths).any()]

    @cached_property
    def stretches(self) -> list[Interval]:
        low = self.candidates.stretches
        return joined((left + shift, right + shift) for left, right in low for shift in self.shifts)

    @property
    def reach(self) -> Interval:
        """(left, right) of x, beyond which no corner touches."""
        return self.stretches[0][0], self.stretches[-1][1]

    def sample_points(self, corner: int) -> Array:
        """Returns contact points with a corner under a sampled place of the obstacle, or of psi0."""
        return np.union1d(self.candidates.sample_points + self.shifts[corner], self._angle.samples)

    def scale(self, left: float, right: float, grading: float = GROWTH - 1) -> float:
        """Returns how long panels may be on an interval: as pieces on which heights and psi0 are polynomials,
        and `grading` times the distance from shorter ones.
        """
        longest = np.inf
        for edges, lengths in self._pieces:
            distances = np.maximum(np.maximum(edges[:-1] - right, left - edges[1:]), 0.0)
            longest = min(longest, float((lengths[:-1] + grading * distances).min(initial=np.inf)))
        return longest

    @cached_property
    def ends(self) -> dict[int, tuple[float, ...]]:
        """{corner: left and right ends of each piece of the obstacle}, beyond which it meets none."""
        return {corner: ends for corner in self.corners if (ends := self.ends_of(corner))}

    def ends_of(self, corner: int) -> tuple[float, ...]:
        return tuple(self._first_of(np.add(self.obstacle.ends, self.shifts[corner])))

    def all_zones(self, zones: CornerZones) -> CornerZones:
        """Returns the zones of all corners {corner: ((left, right), ...)} from the computed ones."""
        if not self.mirror or half_line(self):
            return zones
        return {0: zones[0], 1: tuple((-right, -left) for left, right in reversed(zones[0]))}

    def computed(self, zones: CornerZones) -> CornerZones:
        """Returns the computed ones of all zones, on a half-line with their mirror images."""
        if not half_line(self):
            return {corner: zones[corner] for corner in self.corners}
        right = [(max(left, 0.0), right) for left, right in zones[0] if right > 0]
        return {0: tuple(joined([*right, *((-right, -left) for left, right in right)]))}

    def levers(self, x: Array) -> Array:
        """Returns the levers of (29) at x, array (corners, ...); 0 where psi is prescribed."""
        return self.blocks.levers(x) * (not self.law.clamps_rotation)

    def lever(self, corner: Integers, x: Array) -> Array:
        """Returns levers of the corners numbered `corner` at x, arrays (n,)."""
        if self.blocks.uniform:
            return self._levers_of_block[corner]
        return np.choose(corner, self.levers(x))

    @cached_property
    def _levers_of_block(self) -> Array:
        """Levers of a block of a uniform law, array (corners,)."""
        return self.levers(np.zeros(1))[:, 0]

    def initial_gaps(self, x: Array) -> Array:
        """Returns the initial gaps at x, array (corners, n)."""
        return np.array(
            [self.blocks.initial_gap(self.obstacle, corner, x) for corner in range(len(self.shifts))]
        )

    def pieces_of(self, corner: int) -> Array:
        """Returns left and right ends of the parts of x in which a corner meets an obstacle, array (k, 2)."""
        return np.reshape(self.ends_of(corner) or (-np.inf, np.inf), (-1, 2))

    def initial_gap(self, corner: Integers, x: Array) -> Array:
        """Returns initial gaps of the corners numbered `corner` at x, arrays (n,); inf beyond `ends_of`."""
        gaps = np.full(np.shape(x), np.inf)
        for number in np.unique(corner).tolist():  # places next to an end count as on it
            of_corner = (corner == number) & contains(self.pieces_of(number), x)
            gaps[of_corner] = self.blocks.initial_gap(self.obstacle, number, x)[of_corner]
        return gaps


def half_line(problem: Problem) -> bool:
    return problem.mirror and len(problem.law.corners) == 1


def require_even(law: Law, obstacle: ObstacleLike, ell: float) -> None:
    """Raises BadArgument where obstacle or law say that they are `even` and are not."""
    x = scales(ell)
    same = 1e-9
    law.initial_rotation(np.zeros(0))  # which a law of surfaces has not
    if as_obstacle(obstacle).even:
        above = heights(obstacle, x)
        alike = np.isclose(above, above[::-1], rtol=same, atol=same * ell)
        place = x[np.argmin(alike)]
        words = f"says that it is even, but its height differs at x = {place:.4g} and {-place:.4g}"
        require(alike.all(), "obstacle", obstacle, words)
    if is_even(law):
        levers = Blocks(law, ell).levers(x)
        words = "says that it is even, but its levers are not those of a mirror image"
        require(np.allclose(levers, -levers[::-1, ::-1], rtol=same, atol=same), "law", law, words)
        places = law.places(*horizontal_surface(x))
        image = places[::-1, ::-1] * (-1.0, 1.0)
        words = "says that it is even, but its places are not those of a mirror image"
        require(np.allclose(places, image, rtol=0.0, atol=same), "law", law, words)


def require_uniform(law: Law, ell: float) -> None:
    """Raises BadArgument where a law says that it is `uniform` and is not."""
    if type(law) in BUILT_IN or not is_uniform(law):
        return
    points = horizontal_surface(scales(ell))[0]
    for normal in ((0.0, 1.0), (0.6, 0.8)):
        normals = np.tile(normal, (len(points), 1))
        geometry = Blocks(law, 1.0).under(lambda x: 0 * x, points, normals)
        for name, arms, uniform in (
            ("arms", law.arms(points, normals), geometry.offsets_from_centre),
            ("places", law.places(points, normals), geometry.offsets_from_contact_point),
        ):
            words = f"says that it is uniform, but its {name} are not the same at all points in their frame"
            require(np.allclose(arms, uniform, rtol=0.0, atol=1e-9), "law", law, words)


def require_jumps(obstacle: ObstacleLike, ell: float) -> None:
    """Raises BadArgument where the slope of an obstacle does not jump by what its `jumps` say.

    A jump is told from curvature and one power of the distance to a hundredth. Several powers below 2 at one
    place hide wrong jumps, or have right ones refused.
    """
    kinks, jumps = np.reshape([pair for pair in jumps_of(obstacle) if pair[1]], (-1, 2)).T
    if not len(kinks):
        return
    change, _, uncertainty = _changes_of_slope(obstacle, kinks, ell)
    wrong = np.abs(change - jumps) > 0.01 * np.abs(jumps) + uncertainty
    n = np.argmax(wrong)
    words = f"must be those of the slope of the height, which jumps by {change[n]:.3g} at x = {kinks[n]:.4g}"
    words += ": mind signs, and give kinks with all their digits"
    require(not wrong.any(), "jumps", tuple(jumps.tolist()), words)


def measured_jumps(obstacle: ObstacleLike, kinks: Array, ell: float) -> Array:
    """Returns by how much the slope of an obstacle jumps at places, arrays (k,), 0 where that is rounding, or
    no number that finer steps agree on.
    """
    change, before, uncertainty = _changes_of_slope(obstacle, kinks, ell)
    is_jump = (np.abs(change) > 100 * uncertainty) & (np.abs(change - before) < 0.01 * np.abs(change))
    return np.where(is_jump, change, 0.0)


def _changes_of_slope(obstacle: ObstacleLike, kinks: Array, ell: float) -> tuple[Array, Array, Array]:
    """Returns changes of the slope at places, array (k,), on small steps, less curvature and one power of the
    distance, the same on larger steps, and the uncertainty, arrays (k,).
    """
    steps = np.diff(np.unique(kinks)).min(initial=ell) / 4 * np.geomspace(1e-1, 1e-3, 5)[:, None]
    places = np.array((kinks - steps, kinks + 0 * steps, kinks + steps))
    part = steps[1] / steps[0]
    left, middle, right = heights(obstacle, places.ravel()).reshape(places.shape)
    with np.errstate(invalid="ignore", divide="ignore"):  # inf - inf, at an edge
        changes = (left - 2 * middle + right) / steps
        changes = (changes[1:] - part * changes[:-1]) / (1 - part)  # less curvature, which is as the step
        falls = np.diff(changes, axis=0)
        ratio = falls[1:] / falls[:-1]
        # what a power of the distance adds is a geometric series, two of them are not quite
        shrinks = (ratio > 0) & (ratio < 1)
        before, change = changes[2:] + np.where(shrinks, falls[1:] * ratio / (1 - ratio), 0.0)
        rounding = np.abs(middle) + np.abs(kinks * (right - left) / steps)  # of heights and places
        uncertainty = 3 * np.abs(change - before) * shrinks[-1] + 5e-14 * (rounding / steps)[-1]
    return change, before, uncertainty
