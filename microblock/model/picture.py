"""The obstacle as far as it could touch: one picture of it, from which zones, panels and elements begin.

A corner touches at x only where the height is below approach plus normal displacement. Under the load P that
is, at the distance D from the lowest point, no more than some ``(2 P/(pi E*)) [1 + log(1 + 2 D/a)]`` above
the lowest height (a: half-width of a classical contact under P; the logarithm is that of the half-plane far
from its load). So the heights within BOUND times that are sampled, first on all scales, then in the low
stretches so densely that features as wide as SEEN times a show (`Proxy`).
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, cast

import numpy as np
from numpy.typing import ArrayLike

from ..errors import BOUNDED, BadArgument
from .obstacles import Obstacle, heights
from .proxy import Proxy, TooRough, proxy
from .types import AngledLaw, Array, Function, Interval, LawLike, ObstacleLike
from .zones import runs

if TYPE_CHECKING:
    from .problem import Problem

BOUND = 2.0  # of what a classical half-plane would ask for
SCALES = 1e-3, 1e5  # of ell, between which an obstacle is sampled
PER_DECADE = 400  # places on either side; of an obstacle that is known as formulas KNOWN
KNOWN = 24
FAR = 100.0  # half-widths, at least
ZOOMS, ZOOMED = 14, 300  # how often nearer, by 4, and at how many of the least heights
SEEN = 5e-4  # of a: distance of the samples of a function in a low stretch
INTERVALS = 4000  # first ones of all low stretches together, with samples further apart instead
COARSEST = 0.02  # of a: beyond this distance of the samples an error is raised
SITES = 65  # places in a stretch of an obstacle that is known as formulas
SAME = 1e-6  # of a: a singular point this near to one that is given is that one
ROUND = 1.95  # power of ``abs(x)**power`` from which a tip is round enough for panels
# slope discontinuities of a simple obstacle at most; of a, its shortest piece at least
FEW, WIDE = 2, 0.25
# of the slope a contact of this load asks for: errors of the height per length that do not matter
NEGLIGIBLE = 1e-11


@dataclass(frozen=True)
class Shape:
    """What is known of an obstacle from its height alone.

    Attributes
    ----------
    sites, heights : arrays (m,)
        Ascending places where it could touch, and the heights there (lengths).
    edges, lengths : arrays (n + 1,), (n,)
        Pieces on which the height is a polynomial; inf where only slope discontinuities and edges count.
    kinks, jumps, ends : tuples of float
        Slope discontinuities, jumps of the slope and edges of the obstacle, given or detected.
    steps : tuple of float
        Places at which the height itself jumps.
    tips : tuple of float
        Places at which the curvature has no bound though the slope does not jump.
    found : bool
        Whether slope discontinuities, jumps of the slope or edges were detected that the obstacle does not
        name.
    """

    sites: Array
    heights: Array
    edges: Array
    lengths: Array
    kinks: tuple[float, ...]
    jumps: tuple[float, ...]
    ends: tuple[float, ...]
    steps: tuple[float, ...] = ()
    tips: tuple[float, ...] = ()
    found: bool = False


@dataclass(frozen=True, kw_only=True)
class Picture(Shape):
    """What is known of an obstacle for loads up to `load`: its Shape, and where it could touch.

    Attributes
    ----------
    load : float
        Force per thickness.
    lowest : float
        Abscissa of the lowest point.
    half_width, rise : float
        Half-width and rise of a classical contact under the load there (lengths).
    bound : float
        Multiple of the classical estimate below which heights are sampled.
    stretches : tuple of (left, right)
        Intervals of x1, ascending, beyond which nothing touches.
    angle : Proxy or None
        The Proxy of psi0 where that is a function.
    """

    load: float
    lowest: float
    half_width: float
    rise: float
    bound: float
    stretches: tuple[Interval, ...]
    angle: Proxy | None

    @property
    def minima(self) -> Array:
        """Approximate places of the least heights of all low stretches, array (k,)."""
        h = self.heights
        padded = np.concatenate(([np.inf], h, [np.inf]))
        return self.sites[(h < padded[:-2]) & (h <= padded[2:])]

    @property
    def simple(self) -> bool:
        """Whether the obstacle has one lowest place and nothing narrower than the contact beside it."""
        few = len(self.minima) <= 1 and len(self.kinks) <= FEW and not self.found and self.angle is None
        return few and bool(self.lengths.min(initial=np.inf) > WIDE * self.half_width)

    def allowed(self, x: Array) -> Array:
        """Returns the height at x below which a corner may touch, array (n,)."""
        away = np.abs(x - self.lowest) / self.half_width
        return float(self.heights.min()) + self.bound * self.rise * (1 + np.log1p(2 * away))


def picture(problem: Problem, load: float, bound: float = BOUND) -> Picture:
    """Returns the Picture of a Problem's obstacle for loads up to one (force per thickness).

    Raises
    ------
    BadArgument
        If no picture can be made of the obstacle or of psi0, which are noise or have too many features; or if
        the obstacle stays so low far away that a half-plane touches it without bounds, or does not rise
        enough to carry the load.
    """
    obstacle, ell = problem.obstacle, problem.solid.ell
    known: bool = getattr(obstacle, "formulas", False)
    farthest = SCALES[1] * ell
    while True:
        x, h = _everywhere(obstacle, ell, KNOWN if known else PER_DECADE, farthest)
        lowest = float(x[np.argmin(h)])
        half, rise = classical(problem, load, lowest)
        half = max(half, _level_at(x, h, lowest, rise))
        if farthest >= FAR * half:
            break
        farthest = 2 * FAR * half
    away = np.abs(x - lowest) / half
    low = h < h.min() + bound * rise * (1 + np.log1p(2 * away))
    if low[0] or low[-1]:
        side = x[0] if low[0] else x[-1]
        raise BadArgument(
            "obstacle",
            obstacle,
            f"must rise away from its lowest point: at x = {side:.2g} a half-plane under the "
            f"load {load:g} still reaches it, and so without bounds; a problem that repeats has a "
            "HalfPlane(solid, period=...)",
        )
    stretches = tuple((float(x[i - 1]), float(x[j + 1])) for i, j in runs(low))
    return within(problem, load, stretches, half, rise, bound, lowest)


def within(
    problem: Problem,
    load: float,
    stretches: tuple[Interval, ...],
    half: float,
    rise: float,
    bound: float = np.inf,
    lowest: float | None = None,
) -> Picture:
    """Returns the Picture of given stretches, for contacts of this half-width and rise on any body; without
    `lowest` the lowest point is that of the sites.
    """
    obstacle, floor = problem.obstacle, NEGLIGIBLE * rise
    known: bool = getattr(obstacle, "formulas", False)
    shape = _known(obstacle, stretches) if known else _sampled(obstacle, stretches, half, floor / half)
    angle = _angle(problem.law, stretches, problem.solid.ell, half, floor / problem.solid.ell)
    return Picture(
        **vars(shape),
        load=load,
        lowest=float(shape.sites[np.argmin(shape.heights)]) if lowest is None else lowest,
        half_width=half,
        rise=rise,
        bound=bound,
        stretches=stretches,
        angle=angle,
    )


def seen(obstacle: ObstacleLike, found: Picture) -> ObstacleLike:
    """Returns the obstacle with the slope discontinuities and edges of its Picture, where it does not name
    them.
    """
    if not found.found:
        return obstacle
    height = cast("Callable[[Array], ArrayLike]", getattr(obstacle, "height", obstacle))
    return Seen(height, found.kinks, found.jumps, found.ends)


@dataclass(frozen=True)
class Seen(Obstacle):
    """A height with what was detected of it: also `ends`, beyond which there is no obstacle."""

    ends: tuple[float, ...] = ()


def classical(problem: Problem, load: float, centre: float) -> tuple[float, float]:
    """Returns (half-width, rise): the obstacle rises by the approach of a classical parabolic contact."""
    half = problem.solid.ell * np.geomspace(1e-9, 1e9, 721)
    around = centre + np.outer((-1.0, 0.0, 1.0), half).ravel()
    above = np.minimum(heights(problem.obstacle, around), 1e300).reshape(3, -1)
    rises = np.ptp(above, axis=0)
    rise = 2 * load / (np.pi * problem.E_star)
    enough = np.flatnonzero(rises >= rise)
    if not len(enough):
        raise BadArgument(
            "obstacle",
            problem.obstacle,
            f"does not rise enough to carry the load {load:g} within {half[-1]:.1g}: {BOUNDED}",
        )
    n = enough[0]
    return float(np.interp(rise, rises[n - 1 : n + 1], half[n - 1 : n + 1]) if n else half[0]), rise


def _level_at(x: Array, h: Array, lowest: float, rise: float) -> float:
    """Returns half of the width around the lowest place within which heights are below the rise, as on a flat
    bottom.
    """
    within = next((i, j) for i, j in runs(h <= h.min() + rise) if x[i] <= lowest <= x[j])
    return float(x[within[1]] - x[within[0]]) / 2


def _everywhere(obstacle: ObstacleLike, ell: float, per_decade: int, farthest: float) -> tuple[Array, Array]:
    """Returns places on all scales, ascending, and the heights there; around the least of them places are
    denser.
    """
    scales = np.geomspace(
        SCALES[0] * ell, farthest, int(per_decade * np.log10(farthest / (SCALES[0] * ell))) + 1
    )
    own: list[float] = [place for name in ("kinks", "ends") for place in getattr(obstacle, name, ())]
    x = np.unique((*-scales, 0.0, *scales, *own))
    h = heights(obstacle, x)
    lower = np.flatnonzero((h[1:-1] < h[:-2]) & (h[1:-1] <= h[2:])) + 1
    lower = lower[np.argsort(h[lower])[:ZOOMED]]
    left, right = x[lower - 1], x[lower + 1]
    more = [x]
    for _ in range(ZOOMS if len(lower) else 0):
        places = left[:, None] + (right - left)[:, None] * np.linspace(0, 1, 9)
        values = heights(obstacle, places.ravel()).reshape(places.shape)
        least = np.clip(np.argmin(values, axis=1), 1, 7)
        more.append(places[:, 1:-1].ravel())
        left, right = (np.take_along_axis(places, (least + side)[:, None], axis=1)[:, 0] for side in (-1, 1))
    x = np.unique(np.concatenate(more))
    return x, heights(obstacle, x)


def _known(obstacle: ObstacleLike, stretches: Sequence[Interval]) -> Shape:
    """Returns the Shape of an obstacle that is a polynomial between its slope discontinuities and edges."""
    kinks: tuple[float, ...] = tuple(getattr(obstacle, "kinks", ()))
    ends: tuple[float, ...] = tuple(getattr(obstacle, "ends", ()))
    own = [place for place in (*kinks, *ends) if any(left <= place <= right for left, right in stretches)]
    sites = np.unique(np.concatenate([np.linspace(*each, SITES) for each in stretches] + [own]))
    above = heights(obstacle, sites)
    edges = np.array((stretches[0][0], stretches[-1][1]))
    there = np.isfinite(above)
    return Shape(
        sites[there],
        above[there],
        edges,
        np.array([np.inf]),
        kinks,
        tuple(getattr(obstacle, "jumps", ())),
        ends,
    )


def _sampled(obstacle: ObstacleLike, stretches: Sequence[Interval], half: float, floor: float) -> Shape:
    """Returns the Shape of any other obstacle, from its values in the low stretches."""
    own: dict[float, float] = dict(zip(getattr(obstacle, "kinks", ()), getattr(obstacle, "jumps", ())))
    ends: tuple[float, ...] = tuple(getattr(obstacle, "ends", ()))
    first = _first(stretches, half, (*own, *ends), obstacle)
    pieces = _proxies(lambda x: heights(obstacle, x), first, floor, obstacle, known=own)
    edges, lengths = _one_after_the_other(pieces)
    sites, above, singular, jumps, powers = (
        np.concatenate([getattr(each, name) for each in pieces])
        for name in ("samples", "values", "singular", "jumps", "powers")
    )
    sites, above = sites[np.isfinite(above)], above[np.isfinite(above)]
    gone = singular[np.isnan(jumps)].tolist()
    found = () if ends else _outermost(gone, sites)
    kinks = {place: jump for place, jump in zip(singular.tolist(), jumps.tolist()) if np.isfinite(jump)}
    kinks = {
        place: jump
        for place, jump in kinks.items()
        if not any(abs(place - given) < SAME * half for given in own)
    }
    measured = dict(zip(singular.tolist(), jumps.tolist()))
    for place, jump in own.items():  # as given; its jump, if that is not, as measured
        nearest = min(measured, key=lambda each: abs(each - place), default=place)
        usable = abs(nearest - place) < SAME * half and np.isfinite(measured.get(nearest, np.nan))
        kinks[place] = jump or (measured[nearest] if usable else 0.0)
    kinks = dict(sorted(kinks.items()))
    return Shape(
        sites,
        above,
        edges,
        lengths,
        kinks=tuple(kinks),
        jumps=tuple(kinks.values()),
        ends=ends or found,
        steps=tuple(place for place in gone if place not in (*ends, *found)),
        tips=tuple(singular[(jumps == 0) & (powers < ROUND)].tolist()),
        found=len(kinks) > len(own) or bool(found) or any(kinks[x] != jump for x, jump in own.items()),
    )


def _outermost(places: Sequence[float], sites: Array) -> tuple[float, ...]:
    """Returns (left, right) edges of an obstacle from places at which the height ends or jumps; inf where
    none is.
    """
    near = SAME * (sites[-1] - sites[0])
    left, right = (
        next((place for place in places if abs(place - site) <= near), None) for site in (sites[0], sites[-1])
    )
    if left is None and right is None:
        return ()
    return -np.inf if left is None else left, np.inf if right is None else right


def _first(stretches: Sequence[Interval], half: float, breaks: Iterable[float], given: object) -> list[Array]:
    """Returns the first intervals of each stretch: [edges, ...]."""
    samples = 27  # of an interval, about: see `proxy`
    wide, spacing = sum(right - left for left, right in stretches), SEEN * half
    spacing = max(spacing, wide / (samples * INTERVALS))
    if spacing > COARSEST * half:
        raise BadArgument(
            "obstacle",
            given,
            f"could touch within {wide:.3g}, some {wide / half:.2g} "
            "half-widths of a contact: too wide to be sampled everywhere; Cells(nodes=..., "
            "window=...) take a part of it",
        )
    found = []
    for left, right in stretches:
        own = min(spacing, (right - left) / (40 * samples))
        edges = np.linspace(left, right, 2 + int((right - left) / (samples * own)))
        found.append(np.union1d(edges, [place for place in breaks if left < place < right]))
    return found


def _proxies(
    function: Function,
    intervals: Iterable[Array],
    floor: float,
    given: object,
    name: str = "obstacle",
    known: Collection[float] = (),
) -> list[Proxy]:
    """Returns a Proxy for each stretch; raises BadArgument, naming what was given, where the function is too
    rough.
    """
    try:
        return [
            proxy(function, edges, floor, [place for place in known if edges[0] < place < edges[-1]])
            for edges in intervals
        ]
    except TooRough as failure:
        raise BadArgument(
            name,
            given,
            f"must be smooth but for some places: {failure}; Cells(nodes=...) "
            "take it as their centres see it",
        ) from failure


def _one_after_the_other(pieces: Sequence[Proxy]) -> tuple[Array, Array]:
    """Returns (edges, lengths) of several proxies; between them nothing touches, and lengths are inf."""
    edges = np.concatenate([each.edges for each in pieces])
    lengths = [np.inf] + [length for each in pieces for length in (*each.lengths, np.inf)]
    return edges, np.array(lengths[1:-1])


def _angle(
    law: LawLike, stretches: Sequence[Interval], ell: float, half: float, floor: float
) -> Proxy | None:
    """Returns the Proxy of psi0 over all of the stretches, None where it is a number."""
    if not callable(getattr(law, "psi0", None)):
        return None
    law = cast(AngledLaw, law)
    whole = ((stretches[0][0] - ell, stretches[-1][1] + ell),)
    return _proxies(law.angle, _first(whole, half, (), law.psi0), floor, law.psi0, "psi0")[0]
