"""The obstacle as far as it could touch: one picture of it, from which zones, panels, elements and the looking everywhere begin.

A corner touches at x only where the height is below approach plus normal displacement. Under the load P that is, at the
distance D from the lowest point, no more than some ``(2 P/(pi E*)) [1 + log(1 + 2 D/a)]`` above the lowest height (a: half-width
of a classical contact under P; the logarithm is that of the half-plane far from its load). So the heights within BOUND times that
are looked at: by values, first on all scales, then in the low stretches so densely that what is SEEN of a wide shows (`Proxy`).
"""

from dataclasses import dataclass

import numpy as np

from .errors import BadArgument, NotConverged
from .observables import runs
from .obstacles import Shape, heights
from .proxy import Proxy, TooRough, proxy

BOUND = 2.0              # of what a classical half-plane would ask for
SCALES = 1e-3, 1e5       # of ell, between which an obstacle is looked at
PER_DECADE = 400         # places on either side; of an obstacle that is known as formulas KNOWN
KNOWN = 24
FAR = 100.0              # half-widths, at least
ZOOMS, ZOOMED = 14, 300  # how often nearer, by 4, and at how many of the least heights
SEEN = 5e-4              # of a: distance of the samples of a function in a low stretch
INTERVALS = 4000         # first ones of all low stretches together, with samples further apart instead; beyond COARSEST none
COARSEST = 0.02          # of a
SITES = 65               # places in a stretch of an obstacle that is known as formulas
SAME = 1e-6              # of a: a singular point this near to one that is given is that one
ROUND = 1.95             # power of ``abs(x)**power`` from which a tip is round enough for panels
FEW, WIDE = 2, 0.25      # kinks of a simple obstacle at most; of a, its shortest piece at least
NEGLIGIBLE = 1e-11       # of the slope a contact of this load asks for: errors of the height per length that do not matter


@dataclass(frozen=True)
class Picture:
    """What is known of an obstacle for loads up to `load`.

    Attributes
    ----------
    load : float, force per thickness
    lowest : float, abscissa of the lowest point that was found
    half_width, rise : float, of a classical contact under the load there (lengths)
    stretches : ((left, right), ...), ascending: beyond them nothing touches
    sites, heights : arrays, ascending places in them and the heights there
    edges, lengths : arrays (n + 1,), (n,), pieces on which the height is a polynomial, inf where only its kinks and ends count
    kinks, jumps, ends : of the obstacle, as its own or as found
    steps : tuple, places at which the height itself jumps
    angle : Proxy of psi0 where that is a function, else None
    tips : tuple, kinks at which the curvature has no bound though the slope does not jump
    found : bool, whether kinks or ends are not the obstacle's own
    """

    load: float
    lowest: float
    half_width: float
    rise: float
    bound: float
    stretches: tuple
    sites: np.ndarray
    heights: np.ndarray
    edges: np.ndarray
    lengths: np.ndarray
    kinks: tuple
    jumps: tuple
    ends: tuple
    steps: tuple
    angle: Proxy | None
    tips: tuple = ()
    found: bool = False

    @property
    def minima(self):
        """Places of the least heights of all low stretches, about, array."""
        h = self.heights
        padded = np.concatenate(([np.inf], h, [np.inf]))
        return self.sites[(h < padded[:-2]) & (h <= padded[2:])]

    @property
    def simple(self):
        """Whether the obstacle has one lowest place and nothing beside it that is narrower than the contact."""
        few = len(self.minima) <= 1 and len(self.kinks) <= FEW and not self.found and self.angle is None
        return few and self.lengths.min(initial=np.inf) > WIDE*self.half_width

    def allowed(self, x):
        """Height at x below which a corner may touch, array (n,)."""
        away = np.abs(x - self.lowest)/self.half_width
        return self._least + self.bound*self.rise*(1 + np.log1p(2*away))

    @property
    def _least(self):
        return self.heights.min()


def picture(line, load, bound=BOUND):
    """The Picture of a Line's obstacle for loads up to one (force per thickness).

    Raises
    ------
    BadArgument
        For an obstacle, or a psi0, of which no picture can be made: noise, or too many features; and for one that stays so low
        far away that a half-plane touches it without end.
    NotConverged
        If the obstacle does not rise enough to carry the load.
    """
    obstacle, ell = line.obstacle, line.solid.ell
    known = getattr(obstacle, "formulas", False)
    farthest = SCALES[1]*ell
    while True:
        x, h = _everywhere(obstacle, ell, KNOWN if known else PER_DECADE, farthest)
        lowest = float(x[np.argmin(h)])
        half, rise = classical(line, load, lowest)
        half = max(half, _level_at(x, h, lowest, rise))
        if farthest >= FAR*half:
            break
        farthest = 2*FAR*half
    away = np.abs(x - lowest)/half
    low = h < h.min() + bound*rise*(1 + np.log1p(2*away))
    if low[0] or low[-1]:
        side = x[0] if low[0] else x[-1]
        raise BadArgument("obstacle", obstacle, f"must rise away from its lowest point: at x = {side:.2g} a half-plane under the "
                          f"load {load:g} still reaches it, and so without end; a scene that repeats is one of PeriodicHalfPlane")
    stretches = tuple((float(x[i - 1]), float(x[j + 1])) for i, j in runs(low))
    shape = _known(obstacle, stretches) if known else _looked_at(obstacle, stretches, half, NEGLIGIBLE*rise/half)
    angle = _angle(line.law, stretches, ell, half, NEGLIGIBLE*rise/ell)
    return Picture(load, lowest, half, rise, bound, stretches, angle=angle, **shape)


def within(line, load, stretches, half, rise):
    """The Picture of given stretches ((left, right), ...), for contacts of this half-width and rise (lengths) on any body."""
    obstacle, floor = line.obstacle, NEGLIGIBLE*rise
    known = getattr(obstacle, "formulas", False)
    shape = _known(obstacle, stretches) if known else _looked_at(obstacle, stretches, half, floor/half)
    angle = _angle(line.law, stretches, line.solid.ell, half, floor/line.solid.ell)
    lowest = float(shape["sites"][np.argmin(shape["heights"])])
    return Picture(load, lowest, half, rise, np.inf, stretches, angle=angle, **shape)


def seen(obstacle, found):
    """The obstacle with the kinks and ends of its Picture, where these are not its own."""
    if not found.found:
        return obstacle
    return Seen(getattr(obstacle, "height", obstacle), found.kinks, found.jumps, found.ends)


@dataclass(frozen=True)
class Seen(Shape):
    """A function with what was found of it: also `ends`, beyond which there is no obstacle."""

    ends: tuple = ()


def classical(line, load, centre):
    """(half-width, rise) over which the obstacle rises by what the load sinks a classical half-plane under a parabola."""
    half = line.solid.ell*np.geomspace(1e-9, 1e9, 721)
    above = np.minimum(heights(line.obstacle, centre + np.outer((-1.0, 0.0, 1.0), half).ravel()), 1e300).reshape(3, -1)
    rises = np.ptp(above, axis=0)
    rise = 2*load/(np.pi*line.solid.E_star)
    enough = np.flatnonzero(rises >= rise)
    if not len(enough):
        raise NotConverged(f"the obstacle does not rise enough to carry the load {load:g}")
    n = enough[0]
    return float(np.interp(rise, rises[n - 1:n + 1], half[n - 1:n + 1]) if n else half[0]), rise


def _level_at(x, h, lowest, rise):
    """Half of the width around the lowest place within which the height is below the rise: of a flat bottom with steep sides."""
    within = next((i, j) for i, j in runs(h <= h.min() + rise) if x[i] <= lowest <= x[j])
    return float(x[within[1]] - x[within[0]])/2


def _everywhere(obstacle, ell, per_decade, farthest):
    """Places on all scales, ascending, and the heights there; also next to the least of them, so near that a contact is seen."""
    scales = np.geomspace(SCALES[0]*ell, farthest, int(per_decade*np.log10(farthest/(SCALES[0]*ell))) + 1)
    own = [place for name in ("kinks", "ends") for place in getattr(obstacle, name, ())]
    x = np.unique((*-scales, 0.0, *scales, *own))
    h = heights(obstacle, x)
    lower = np.flatnonzero((h[1:-1] < h[:-2]) & (h[1:-1] <= h[2:])) + 1
    lower = lower[np.argsort(h[lower])[:ZOOMED]]
    left, right = x[lower - 1], x[lower + 1]
    more = [x]
    for _ in range(ZOOMS if len(lower) else 0):
        places = left[:, None] + (right - left)[:, None]*np.linspace(0, 1, 9)
        values = heights(obstacle, places.ravel()).reshape(places.shape)
        least = np.clip(np.argmin(values, axis=1), 1, 7)
        more.append(places[:, 1:-1].ravel())
        left, right = (np.take_along_axis(places, (least + side)[:, None], axis=1)[:, 0] for side in (-1, 1))
    x = np.unique(np.concatenate(more))
    return x, heights(obstacle, x)


def _known(obstacle, stretches):
    """Of an obstacle that is polynomials between its kinks and ends."""
    kinks, ends = tuple(getattr(obstacle, "kinks", ())), tuple(getattr(obstacle, "ends", ()))
    own = [place for place in (*kinks, *ends) if any(left <= place <= right for left, right in stretches)]
    sites = np.unique(np.concatenate([np.linspace(*each, SITES) for each in stretches] + [own]))
    above = heights(obstacle, sites)
    edges = np.array((stretches[0][0], stretches[-1][1]))
    there = np.isfinite(above)
    return {"sites": sites[there], "heights": above[there], "edges": edges, "lengths": np.array([np.inf]), "kinks": kinks,
            "jumps": tuple(getattr(obstacle, "jumps", ())), "ends": ends, "steps": ()}


def _looked_at(obstacle, stretches, half, floor):
    """Of any other: by its values in the low stretches."""
    own = dict(zip(getattr(obstacle, "kinks", ()), getattr(obstacle, "jumps", ())))
    ends = tuple(getattr(obstacle, "ends", ()))
    first = _first(stretches, half, (*own, *ends), obstacle)
    pieces = _proxies(lambda x: heights(obstacle, x), first, floor, obstacle, known=own)
    edges, lengths = _one_after_the_other(pieces)
    sites, above, singular, jumps, powers = (np.concatenate([getattr(each, name) for each in pieces])
                                             for name in ("samples", "values", "singular", "jumps", "powers"))
    sites, above = sites[np.isfinite(above)], above[np.isfinite(above)]
    gone = singular[np.isnan(jumps)].tolist()
    found = () if ends else _outermost(gone, sites)
    kinks = {place: jump for place, jump in zip(singular.tolist(), jumps.tolist()) if np.isfinite(jump)}
    kinks = {place: jump for place, jump in kinks.items() if not any(abs(place - mine) < SAME*half for mine in own)}
    measured = dict(zip(singular.tolist(), jumps.tolist()))
    for place, jump in own.items():      # as given; its jump, if that is not, as measured
        nearest = min(measured, key=lambda each: abs(each - place), default=place)
        kinks[place] = jump or (measured[nearest] if abs(nearest - place) < SAME*half and np.isfinite(measured[nearest]) else 0.0)
    kinks = dict(sorted(kinks.items()))
    return {"sites": sites, "heights": above, "edges": edges, "lengths": lengths,
            "kinks": tuple(kinks), "jumps": tuple(kinks.values()), "ends": ends or found,
            "steps": tuple(place for place in gone if place not in (*ends, *found)),
            "tips": tuple(singular[(jumps == 0) & (powers < ROUND)].tolist()), "found": len(kinks) > len(own) or bool(found)}


def _outermost(places, sites):
    """(left, right) ends of an obstacle, infinite where there is none, from places at which the height ends or jumps."""
    near = SAME*(sites[-1] - sites[0])
    left, right = (next((place for place in places if abs(place - site) <= near), None) for site in (sites[0], sites[-1]))
    return () if left is None and right is None else (-np.inf if left is None else left, np.inf if right is None else right)


def _first(stretches, half, breaks, obstacle):
    """First intervals of each stretch: [edges, ...]."""
    samples = 27      # of an interval, about: see `proxy`
    wide, spacing = sum(right - left for left, right in stretches), SEEN*half
    spacing = max(spacing, wide/(samples*INTERVALS))
    if spacing > COARSEST*half:
        raise BadArgument("obstacle", obstacle, f"could touch within {wide:.3g}, some {wide/half:.2g} half-widths of a contact: "
                          "too wide to be looked at everywhere; GridContact takes a part of it, on so many nodes")
    found = []
    for left, right in stretches:
        own = min(spacing, (right - left)/(40*samples))
        edges = np.linspace(left, right, 2 + int((right - left)/(samples*own)))
        found.append(np.union1d(edges, [place for place in breaks if left < place < right]))
    return found


def _proxies(function, intervals, floor, given, name="obstacle", known=()):
    try:
        return [proxy(function, edges, floor, [place for place in known if edges[0] < place < edges[-1]]) for edges in intervals]
    except TooRough as failure:
        raise BadArgument(name, given, f"must be smooth but for some places: {failure}; GridContact takes it as its nodes see it"
                          ) from failure


def _one_after_the_other(pieces):
    """(edges, lengths) of several proxies; between them nothing touches, and lengths are inf."""
    edges = np.concatenate([each.edges for each in pieces])
    lengths = [np.inf] + [length for each in pieces for length in (*each.lengths, np.inf)]
    return edges, np.array(lengths[1:-1])


def _angle(law, stretches, ell, half, floor):
    """The Proxy of psi0 over all of the stretches, None where it is a number."""
    if not callable(getattr(law, "psi0", None)):
        return None
    whole = ((stretches[0][0] - ell, stretches[-1][1] + ell),)
    return _proxies(law.angle, _first(whole, half, (), law.psi0), floor, law.psi0, "psi0")[0]
