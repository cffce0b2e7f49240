"""The obstacle as far as it could touch.

Under the load P a corner touches at the distance D from the lowest point only where the height is no more
than some ``(2 P/(pi E*)) [1 + log(1 + 2 D/a)]`` above the lowest (a: half-width of a classical contact).
Heights within twice that are sampled so densely that features as wide as 5e-4 a show (`Proxy`).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from ..errors import BOUNDED, require
from .intervals import contains, local_minima, runs
from .law import rotation
from .obstacles import Obstacle, RigidObstacle, heights, jumps_of, named_places
from .piecewise_chebyshev import EMPTY_PROXY, Proxy, proxy
from .scales import classical_rise, lowest_part
from .types import Array, Flags, Function, Interval, ObstacleLike

if TYPE_CHECKING:
    from .problem import Problem


@dataclass(frozen=True, kw_only=True)
class ContactCandidates:
    """What is known of an obstacle for loads up to one.

    Attributes
    ----------
    lowest : float
        Abscissa of the lowest point.
    half_width, rise : float
        Of a classical contact (lengths).
    bound : float
        Multiple of the classical estimate below which heights are sampled.
    stretches : tuple of (left, right)
        Intervals beyond which nothing touches.
    angle : Proxy
        Of psi0 where that is a function, else one without pieces.
    sample_points, heights : arrays (m,)
        Ascending places where it could touch, and the heights there.
    edges, lengths : arrays (n + 1,)
        Pieces on which the height is a polynomial, as of `Proxy`; inf where only kinks and ends count.
    kinks, jumps, ends, height_jumps : tuples of float
        Slope discontinuities, their jumps and edges; places at which the height jumps.
    detected : bool
        Whether some of these are not named by the obstacle.
    """

    lowest: float
    half_width: float
    rise: float
    bound: float
    stretches: tuple[Interval, ...]
    angle: Proxy
    sample_points: Array
    heights: Array
    edges: Array
    lengths: Array
    kinks: tuple[float, ...]
    jumps: tuple[float, ...]
    ends: tuple[float, ...]
    height_jumps: tuple[float, ...]
    detected: bool

    @property
    def minima(self) -> Array:
        """Places lower than those beside them, the outermost ones included, array (k,)."""
        padded = np.pad(self.heights, 1, constant_values=np.inf)
        return self.sample_points[local_minima(padded) - 1]

    @property
    def simple(self) -> bool:
        """Whether nothing much narrower than the contact lies beside the one lowest place."""
        few = len(self.minima) <= 1 and len(self.kinks) <= 2 and len(self.angle.samples) == 0
        return few and not self.detected and bool(self.lengths.min(initial=np.inf) > self.half_width / 4)

    def allowed(self, x: Array) -> Array:
        """Returns the height at x below which a corner may touch, array (n,)."""
        distance = np.abs(x - self.lowest) / self.half_width
        return float(self.heights.min()) + self.bound * self.rise * (1 + np.log1p(2 * distance))


def find_candidates(problem: Problem, load: float) -> ContactCandidates:
    """Returns the ContactCandidates of a Problem's obstacle for loads up to one (force per thickness); raises
    BadArgument if obstacle or psi0 have too many features, or the obstacle does not rise enough.
    """
    obstacle = problem.obstacle
    per_decade = 24 if obstacle.formulas else 400
    nearest, farthest, centres = _range_of_places(problem, load)
    while True:
        x, h = _everywhere(obstacle, nearest, per_decade, farthest, centres)
        words = f"has no finite height at places up to x = {farthest:.2g}: move it near 0, or name its ends"
        require(np.isfinite(h).any(), "obstacle", obstacle, words)
        lowest = float(x[np.argmin(h)])
        half, rise = classical(problem, load, lowest)
        # as wide as the lowest part up to the rise, which may be a flat bottom
        bottom = next(x[j] - x[i] for i, j in runs(h <= h.min() + rise) if x[i] <= lowest <= x[j])
        half = max(half, float(bottom) / 2)
        if farthest >= (enough := 100 * half):
            break
        farthest = 2 * enough
    bound = 2.0
    low = h < h.min() + bound * rise * (1 + np.log1p(2 * np.abs(x - lowest) / half))
    words = (
        f"must rise away from its lowest point: at x = {x[0] if low[0] else x[-1]:.2g} a half-plane under "
        f"the load {load:g} still reaches it, and so without bounds; a problem that repeats has a "
        "HalfPlane(solid, period=...)"
    )
    require(not low[[0, -1]].any(), "obstacle", obstacle, words)
    stretches = tuple((float(x[i - 1]), float(x[j + 1])) for i, j in runs(low))
    return replace(candidates_within(problem, stretches, half, rise), bound=bound, lowest=lowest)


def candidates_within(
    problem: Problem, stretches: tuple[Interval, ...], half: float, rise: float
) -> ContactCandidates:
    """Returns the ContactCandidates of given stretches, for contacts of this half-width and rise."""
    # errors of the height per length that do not matter: of the slope that this load asks for
    floor = 1e-11 * rise
    obstacle = problem.obstacle
    named = dict(jumps_of(obstacle))
    ends = tuple(obstacle.ends)
    if obstacle.formulas:
        pieces = [_polynomial(obstacle, stretches, np.array((*named, *ends)))]
    else:
        pieces = _profiles(partial(heights, obstacle), stretches, half, floor / half, obstacle, named, ends)
    edges, lengths, singular, jumps, sample_points, above = map(np.concatenate, zip(*pieces))
    finite = np.isfinite(above)
    sample_points = sample_points[finite]
    above = above[finite]
    gone = singular[np.isnan(jumps)].tolist()
    edges_of_pieces = ends or _ends(partial(heights, obstacle), gone)
    kinks = _kinks(singular.tolist(), jumps.tolist(), named)
    return ContactCandidates(
        lowest=float(sample_points[np.argmin(above)]),
        half_width=half,
        rise=rise,
        bound=np.inf,
        stretches=stretches,
        angle=_initial_rotation(problem, stretches, half, floor),
        sample_points=sample_points,
        heights=above,
        edges=edges,
        lengths=lengths,
        kinks=tuple(kinks),
        jumps=tuple(kinks.values()),
        ends=edges_of_pieces,
        height_jumps=tuple(place for place in gone if place not in edges_of_pieces),
        detected=kinks != named or edges_of_pieces != ends,
    )


def _kinks(places: list[float], jumps: list[float], named: dict[float, float]) -> dict[float, float]:
    """Returns {place: jump of the slope}, ascending, of places with jumps, nan where the height jumps, and of
    those that an obstacle names; a named jump of 0 is as measured.
    """
    kinks = {place: jump for place, jump in zip(places, jumps) if np.isfinite(jump)}
    kinks |= {place: jump or kinks.get(place, 0.0) for place, jump in named.items()}
    return dict(sorted(kinks.items()))


def _initial_rotation(problem: Problem, stretches: tuple[Interval, ...], half: float, floor: float) -> Proxy:
    """Returns the Proxy of psi0 over stretches where that is a function, else one without pieces; `floor` is
    an error of the height that does not matter (length).
    """
    psi0 = problem.law.varying_psi0
    if psi0 is None:
        return EMPTY_PROXY
    ell = problem.solid.ell
    around = [(stretches[0][0] - ell, stretches[-1][1] + ell)]
    (angle,) = _profiles(partial(rotation, psi0), around, half, floor / ell, psi0, name="psi0")
    return angle


def may_touch(sampled: ContactCandidates, places: Array | Sequence[float]) -> Flags:
    """Returns whether a classical contact would reach places, boolean array (m,)."""
    return np.interp(places, sampled.sample_points, sampled.heights) <= sampled.heights.min() + sampled.rise


def with_detected_kinks(obstacle: RigidObstacle, sampled: ContactCandidates) -> RigidObstacle:
    """Returns the obstacle with the kinks and ends that its samples show, as it is if it names them all."""
    return (
        ObstacleWithDetectedKinks(obstacle.height, sampled.kinks, sampled.jumps, sampled.ends)
        if sampled.detected
        else obstacle
    )


@dataclass(frozen=True)
class ObstacleWithDetectedKinks(Obstacle):
    """A height with kinks and ends that nobody has named."""

    ends: tuple[float, ...] = ()


def classical(problem: Problem, load: float, centre: float) -> tuple[float, float]:
    """Returns (half-width, rise) of the classical parabolic contact."""
    half = problem.solid.ell * np.geomspace(1e-9, 1e9, 721)
    around = centre + np.outer((-1.0, 0.0, 1.0), half).ravel()
    above = np.minimum(heights(problem.obstacle, around), np.finfo(float).max).reshape(3, -1)
    rises = np.ptp(above, axis=0)
    rise = classical_rise(load, problem.E_star)
    enough = np.flatnonzero(rises >= rise)
    words = f"does not rise enough to carry the load {load:g} within {half[-1]:.1g}: {BOUNDED}"
    require(len(enough), "obstacle", problem.obstacle, words)
    bracket = slice(max(enough[0], 1) - 1, enough[0] + 1)
    return float(np.interp(rise, rises[bracket], half[bracket])), rise


def _range_of_places(problem: Problem, load: float) -> tuple[float, float, tuple[float, ...]]:
    """Returns the distances at which places begin and end at first, and the centres about which they lie:
    x1 = 0, and the lowest place where that is far from it (lengths).
    """
    nearest = 1e-3 * problem.ell
    farthest = 1e5 * problem.ell
    ends = lowest_part(problem.obstacle, classical_rise(load, problem.E_star))
    if ends is None:
        return nearest, farthest, (0.0,)
    half = (ends[1] - ends[0]) / 2
    middle = (ends[0] + ends[1]) / 2
    nearest *= 10.0 ** min(0, np.floor(np.log10(half / problem.ell)))  # the same places, and nearer ones
    far = abs(middle) > 100 * half
    return nearest, max(farthest, 8 * abs(middle)), (0.0, middle) if far else (0.0,)


def _everywhere(
    obstacle: ObstacleLike, nearest: float, per_decade: int, farthest: float, centres: Iterable[float]
) -> tuple[Array, Array]:
    """Returns places on all scales about centres, denser around the least heights, and the heights."""
    scales = np.geomspace(nearest, farthest, int(per_decade * np.log10(farthest / nearest)) + 1)
    around = [centre + way * scales for centre in centres for way in (-1, 1)]
    named = named_places(obstacle)
    x = np.unique(np.concatenate((*around, tuple(centres), named)))
    twins = np.flatnonzero(np.diff(x) <= 8 * np.finfo(float).eps * np.abs(x[1:]))
    x = np.delete(x, np.where(np.isin(x[twins], named), twins + 1, twins))  # by rounding, named ones stay
    h = heights(obstacle, x)
    lower = local_minima(h)
    lower = lower[np.argsort(h[lower])[:300]]
    left = x[lower - 1]
    right = x[lower + 1]
    for _ in range(14):  # each 4 times nearer
        places = np.linspace(left, right, 9)
        values = heights(obstacle, places.ravel()).reshape(places.shape)
        least = np.clip(np.argmin(values, axis=0), 1, 7)
        left, right = np.take_along_axis(places, np.array((least - 1, least + 1)), axis=0)
        x = np.append(x, places)
    x = np.unique(x)
    return x, heights(obstacle, x)


def _polynomial(obstacle: ObstacleLike, stretches: Sequence[Interval], named: Array) -> Proxy:
    """Returns the Proxy of a height that is a polynomial between its named places."""
    inside = named[contains(stretches, named)]
    sample_points = np.unique(np.concatenate((*(np.linspace(*pair, 65) for pair in stretches), inside)))
    edges = np.array((stretches[0][0], stretches[-1][1]))
    empty = np.empty(0)
    return Proxy(edges, np.full(2, np.inf), empty, empty, sample_points, heights(obstacle, sample_points))


def _ends(height: Function, places: Sequence[float]) -> tuple[float, ...]:
    """Returns left and right edges of the pieces of an obstacle, of places at which its height jumps or ends:
    -inf or inf where it goes on; none without an edge, or where pieces are narrower than what was looked at.
    """
    x = np.array(places)
    left, right = (np.isinf(height(np.nextafter(x, beyond))) for beyond in (-np.inf, np.inf))
    edges = [(place, bool(begins)) for place, begins, stops in zip(places, left, right) if begins != stops]
    if not edges:
        return ()
    edges = [(-np.inf, True)] * (not edges[0][1]) + edges + [(np.inf, False)] * edges[-1][1]
    alternate = all(begins != (number % 2) for number, (_, begins) in enumerate(edges))
    return tuple(place for place, _ in edges) if alternate else ()


def _profiles(
    function: Function,
    stretches: Iterable[Interval],
    half: float,
    floor: float,
    given: object,
    kinks: Iterable[float] = (),
    ends: Iterable[float] = (),
    name: str = "obstacle",
) -> list[Proxy]:
    """Returns the Proxy of a function on each stretch; raises BadArgument of too rough or too wide ones."""
    samples = 27  # of an interval, about: see `proxy`
    wide = sum(right - left for left, right in stretches)
    spacing = max(5e-4 * half, wide / (4000 * samples))
    words = (
        f"could touch within {wide:.3g}, some {wide / half:.2g} half-widths of a contact: too wide to be "
        "sampled everywhere; Cells(nodes=..., window=...) take a part of it"
    )
    require(spacing <= half / 50, name, given, words)
    pieces = []
    for left, right in stretches:
        distance = min(spacing, (right - left) / (40 * samples))
        edges = np.linspace(left, right, 2 + int((right - left) / (samples * distance)))
        edges = np.union1d(edges, [place for place in (*kinks, *ends) if left < place < right])
        named = [place for place in kinks if left < place < right]
        pieces.append(proxy(function, edges, floor, named, name, given))
    return pieces
