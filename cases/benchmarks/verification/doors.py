"""What users hand over: samples, heights and files, in arrays of every kind, and windows of a period.

Scene k comes from (SEED, 60, k): an obstacle that is known exactly, in a dress: a type of numbers, an order,
a mask, a window, a unit of length, a place. It is answered, or refused; then the advice of the refusal is
followed, and that is answered. The judge is a classical half-plane on uniform cells, by active sets and dense
matrices, which shares nothing with the library; it compares what the part left of a place carries.
"""

from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from math import inf, pi
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace

import numpy as np

import microblock as mb
from microblock.data.samples import read_samples

from . import SEED, NoAnswer
from .judging import Case
from .obstacles import log

CELLS = 160, 320  # of the judge: their distance is its error
FAR = 24.0  # half-widths that the judge looks at first


@dataclass
class Scene:
    """What is handed over, and what it means.

    Attributes
    ----------
    words : str
    solve : callable, which returns a State or raises an error
    height : callable, heights at x for the judge (over the unit of length)
    window : (left, right) of x over the unit that holds the contact, or the period
    refusal : words of the error that is right, or ""
    mended : callable, `solve` after the advice of the error
    """

    words: str
    solve: object
    height: object
    window: tuple
    load: float
    unit: float = 1.0
    E_star: float = 100 / 0.91
    period: float | None = None
    refusal: str = ""
    mended: object = None

    def answer(self):
        """The State, after the advice of a refusal has been followed; raises AssertionError where one is
        missing.
        """
        if self.refusal:
            try:
                self.solve()
            except mb.BadArgument as failure:
                if self.refusal not in str(failure):
                    raise
                return self.mended()
            raise AssertionError(f"was taken; {self.refusal!r} was expected")
        try:
            return self.solve()
        except mb.NotConverged as failure:
            if failure.rtol_reached is None:
                raise
            return self.solve(rtol=failure.rtol_reached)

    def verify(self, state):
        """(distance, estimate, error of the judge) of what is carried on the left, over the load."""
        coarse, fine = (self.carried(count) for count in CELLS)
        places = fine[0]
        x = np.clip(places * self.unit, state.x[0], state.x[-1])
        order = np.argsort(state.x)
        sums = np.cumsum((state.weights * state.pressure)[order])
        middle = sums - (state.weights * state.pressure)[order] / 2
        mine = np.interp(x, state.x[order], middle, left=0.0, right=sums[-1]) / sums[-1]
        if self.period:  # a period may begin at any place
            mine, fine, coarse = (part - part[0] for part in (mine, fine[1], np.interp(places, *coarse)))
        else:
            fine, coarse = fine[1], np.interp(places, *coarse)
        # next to ends and between pieces cells converge by their root: twice the difference is not all
        return np.abs(mine - fine).max(), state.error_estimate, 3 * np.abs(fine - coarse).max() + 1e-3

    def carried(self, count):
        """(edges of cells, share of the load on their left) of so many cells about the contact."""
        left, right = self.window
        for _ in range(3):
            edges = np.linspace(left, right, count + 1)
            p = pressed(self.height, edges, self.load, self.E_star, self.period)
            if self.period:
                break
            touched = edges[:-1][p > 0], edges[1:][p > 0]
            width = touched[1][-1] - touched[0][0]
            left = max(left, touched[0][0] - 0.1 * width - 2 * (edges[1] - edges[0]))
            right = min(right, touched[1][-1] + 0.1 * width + 2 * (edges[1] - edges[0]))
        return edges, np.concatenate(([0.0], np.cumsum(p * np.diff(edges)))) / self.load


def pressed(height, edges, load, E_star, period=None):
    """Pressures of cells under a rigid obstacle on a classical half-plane, by active sets."""
    x, widths, count = (edges[1:] + edges[:-1]) / 2, np.diff(edges), len(edges) - 1
    gaps = np.asarray(height(x), float)
    there = np.isfinite(gaps)
    if period is None:
        along = x[:, None] - edges
        parts = along * np.log(np.maximum(np.abs(along), 1e-300) / (edges[-1] - edges[0])) - along
        flexibility = 2 / (pi * E_star) * np.diff(parts, axis=1)
    else:  # u of a wave is 2 p/(E* k)
        k = 2 * pi / period * np.arange(1, count // 2 + 1)
        cell = np.sinc(k * widths[0] / (2 * pi)) * (1 - (np.arange(1, count // 2 + 1) == count // 2) / 2)
        waves = np.cos(np.outer(x - x[0], k)) @ (2 / (E_star * k) * cell) * 2 / count
        numbers = np.arange(count)
        flexibility = waves[np.abs(numbers[:, None] - numbers)]
    closed = there & (gaps <= gaps[there].min() + load / E_star)
    for _ in range(200):
        numbers = np.flatnonzero(closed)
        system = np.zeros((len(numbers) + 1,) * 2)
        system[:-1, :-1] = flexibility[np.ix_(numbers, numbers)]
        system[:-1, -1], system[-1, :-1] = -1.0, widths[numbers]
        solution = np.linalg.solve(system, np.append(-gaps[numbers], load))
        p = np.zeros(count)
        p[numbers] = solution[:-1]
        opens = closed & (p < 0)
        gap = np.where(there, gaps, inf) + flexibility @ p - solution[-1]
        closes = ~closed & (gap < -1e-12 * np.abs(gap[there]).max())
        if not opens.any() and not closes.any():
            return p
        closed = (closed & ~opens) | (closes & ~opens.any())
    raise NoAnswer("the judge's cells do not settle")


def case(k):
    """Scene k as a `Case`; its refusals and the states after their advice count as what they are."""
    scene = drawn(k)
    return Case(scene.words, 0.01, scene.answer, scene.verify)


def drawn(k):
    """Scene k: every kind in turn."""
    rng = np.random.default_rng((SEED, 60, k))
    return KINDS[k % len(KINDS)](rng)


def body_of(rng, unit, period=None):
    """(words, half-plane, law, factor of the load) of a classical solid, in a random unit of stress."""
    stress = 10.0 ** rng.integers(-3, 13)
    plane = mb.HalfPlane(mb.Elastic(100 * stress, 0.3), period=period and period * unit)
    return f"E {100 * stress:.0e}", plane, stress * unit


def shape(rng, half):
    """(words, heights at x) of a smooth obstacle that touches over some half-width."""
    place, R = half * rng.uniform(-0.5, 0.5), 10.0
    size, wave = half**2 / R * log(rng, 0.01, 0.1), half * rng.uniform(1, 3)
    skew = rng.uniform(0, 0.1) / half
    return [
        ("parabola", lambda x: (x - place) ** 2 / (2 * R)),
        ("ripples", lambda x: (x - place) ** 2 / (2 * R) + size * np.cos(2 * pi * x / wave)),
        ("skew", lambda x: (x - place) ** 2 / (2 * R) * np.exp(np.clip(skew * x, -1, 1))),
        ("wedge", lambda x: half / R * np.abs(x - place)),
    ][rng.integers(4)]


def load_of(half):
    return pi / 4 * 100 / 0.91 * half**2 / 10


def series(values):
    """A Series of pandas with an index of its own; an array without pandas."""
    try:
        from pandas import Series
    except ImportError:
        return np.array(values)
    return Series(values, index=np.arange(len(values))[::-1] + 7)


NUMBERS = {
    "float64": np.float64,
    "float32": np.float32,
    "longdouble": np.longdouble,
    "list": list,
    "tuple": tuple,
    "fractions": lambda values: np.array([Fraction(float(value)) for value in values], object),
    "decimals": lambda values: [Decimal(float(value)) for value in values],
    "series": series,
    "strided": lambda values: np.repeat(values, 2)[::2],
    "read-only": lambda values: np.frombuffer(np.array(values, float).tobytes()),
    "big-endian": lambda values: np.array(values, ">f8"),
}


def samples(rng):
    """Samples, in an order, with holes, somewhere."""
    half = log(rng, 0.05, 0.5)
    name, height = shape(rng, half)
    reach, count = half * rng.uniform(3, 5), int(rng.integers(9, 34))
    x = np.linspace(-reach, reach, count)
    if rng.random() < 0.3:
        x[1:-1] += 0.3 * (x[1] - x[0]) * rng.uniform(-1, 1, count - 2)
    unit = float(10.0 ** rng.integers(-9, 10)) if rng.random() < 0.4 else 1.0
    move = float(rng.choice((0.0, 0.0, 0.0, 7.0, 1e6))) * half
    kind = [*NUMBERS, "int"][rng.integers(len(NUMBERS) + 1)]
    return _samples(rng, f"{name} n {count}", (x, height(x)), half, unit, move, kind)


def _samples(rng, words, profile, half, unit, move, kind):
    x, z = profile
    order = rng.choice(("as it is", "as it is", "reversed", "unsorted", "repeated", "one"))
    holes = rng.choice(("none", "none", "none", "mask", "nan", "inf", "None", "masked list"))
    number = NUMBERS.get(kind, np.int64)
    if kind == "int":  # lengths of thousands
        unit = 1.0
        fine = 4000 / np.abs(x).max()
        x, z, half = np.round(fine * x), np.round(fine * z), fine * half
    if kind in ("float32", "int"):  # of seven digits none are left far away
        move = 0.0
        x, z = (np.array(number(part), float) for part in (x, z))
    gone = np.zeros(len(x), bool)
    if holes != "none":
        gone[rng.integers(1, len(x) - 1, max(1, len(x) // 10))] = True
    body_words, plane, force = body_of(rng, unit)
    second, load = rng.random() < 0.15, load_of(half)

    def dressed(z, gone):
        masked = np.ma.array(np.where(gone, -9999.0, z), mask=gone)
        if holes == "None":
            return [None if out else float(value) for value, out in zip(z, gone)]
        empty = {"nan": np.nan, "inf": np.inf}.get(holes)
        kinds = {"mask": masked, "masked list": list(masked), "none": number(z)}
        return np.where(gone, empty, z) if empty else kinds[holes]

    def solve(taken=np.arange(len(x)), **options):
        obstacle = mb.Obstacle.from_samples(
            number((x[taken] + move) * unit), dressed(z[taken] * unit, gone[taken])
        )
        obstacle = mb.Deformable(plane, obstacle) if second else obstacle
        return mb.Contact(plane, obstacle, mb.Unilateral()).solve(load * force, **options)

    taken, refusal = {
        "as it is": (np.arange(len(x)), ""),
        "reversed": (np.arange(len(x))[::-1], ""),
        "unsorted": (rng.permutation(len(x)), "sort it"),
        "repeated": (np.repeat(np.arange(len(x)), 1 + (np.arange(len(x)) == 2)), "average duplicates"),
        "one": (np.arange(1), "at least two"),
    }[order]
    words = f"samples {words} {kind} {order} holes {holes} unit {unit:.0e} at {move:.0e} {body_words}"
    return Scene(
        words + " second" * second,
        lambda **options: solve(taken, **options),
        polygon(x + move, np.where(gone, np.nan, z)),
        (x[0] + move, x[-1] + move),
        load,
        unit,
        100 / 0.91 / (1 + second),
        None,
        refusal,
        solve,
    )


def polygon(x, z):
    """The height of straight lines between samples of which both are there, inf where none is."""

    def height(places):
        after = np.clip(np.searchsorted(x, places) - 1, 0, len(x) - 2)
        share = (places - x[after]) / (x[after + 1] - x[after])
        above = z[after] + share * (z[after + 1] - z[after])
        return np.where(np.isnan(above) | (share < 0) | (share > 1), np.inf, above)

    return height


def functions(rng):
    """Heights that return numbers of every kind, or none."""
    half = log(rng, 0.05, 0.5)
    name, height = shape(rng, half)
    unit = float(10.0 ** rng.integers(-9, 10)) if rng.random() < 0.4 else 1.0
    move = float(rng.choice((0.0, 0.0, 0.0, 7.0, 1e6))) * half
    ends = tuple(half * np.array((-1, 1)) * rng.uniform(0.5, 2, 2)) if rng.random() < 0.5 else (-inf, inf)
    body_words, plane, force = body_of(rng, unit)
    load = load_of(half)

    def there(x):
        return (ends[0] <= x - move) & (x - move <= ends[1])

    def known(x):
        return np.where(there(x), height(x - move), np.inf)

    def plain(x):
        return unit * height(x / unit - move)

    def masked(x):
        return np.ma.array(plain(x), mask=~there(x / unit))

    def cut(x):
        return np.where(there(x / unit), plain(x), np.inf)

    def spoiling(x):
        above = cut(x)
        x *= 0.0
        return above

    given = {
        "mask": (masked, ""),
        "inf": (cut, ""),
        "list": (lambda x: list(cut(x)), ""),
        "tuple": (lambda x: tuple(cut(x)), ""),
        "series": (lambda x: series(cut(x)), ""),
        "longdouble": (lambda x: cut(x).astype(np.longdouble), ""),
        "writes into x": (spoiling, ""),
        "one number at a time": (np.vectorize(lambda x: float(cut(np.array(x))), otypes=[float]), ""),
        "masked invalid": (lambda x: np.ma.masked_invalid(np.where(there(x / unit), plain(x), np.nan)), ""),
        "nan": (lambda x: np.where(there(x / unit), plain(x), np.nan), "inf where there is no obstacle"),
        "all nan": (lambda x: np.full(len(x), np.nan), "must be a number"),
        "complex": (lambda x: cut(x) + 0j, "no real numbers"),
        "dates": (lambda x: np.zeros(len(x), "datetime64[s]"), "no real numbers"),
        "texts": (lambda x: [str(value) for value in cut(x)], "no real numbers"),
        "column": (lambda x: cut(x)[:, None], "one number"),
        "too few": (lambda x: cut(x)[1:], "one number"),
        "a scalar": (lambda x: 0.0, "one number"),
        "if": (lambda x: 0.0 if x > 0 else 1.0, "np.vectorize"),
        "nothing": (lambda x: None, ""),
        "a class": (mb.Punch, "must be an instance"),
        "raises": (lambda x: {}[0], "must take an array"),
    }
    dress = [*given][rng.integers(len(given))]
    function, refusal = given[dress]
    if dress in ("nan",) and not np.isfinite(ends).all():
        refusal = ""
    refusal = "one number" if dress == "nothing" else refusal

    def named():
        """With ends that are named: a piece far away is not seen among all scales."""
        obstacle = SimpleNamespace(height=plain, ends=tuple((np.array(ends) + move) * unit))
        return mb.Contact(plane, obstacle, mb.Unilateral()).solve(load * force)

    def solve(height=function, **options):
        return mb.Contact(plane, height, mb.Unilateral()).solve(load * force, **options)

    words = f"function {name} {dress} ends {np.round(np.divide(ends, half), 1)} "
    words += f"unit {unit:.0e} at {move:.0e} {body_words}"
    window = tuple(np.clip(ends, -FAR * half, FAR * half) + move)
    mended = lambda: solve(cut)  # noqa: E731
    if move > 1e3 * half and np.isfinite(ends).all():
        refusal, mended = refusal or "name its ends", named
    return Scene(words, solve, known, window, load, unit, refusal=refusal, mended=mended)


def periods(rng):
    """A wave on any window of its period."""
    long, unit = 1.0, float(10.0 ** rng.integers(-9, 10)) if rng.random() < 0.4 else 1.0
    size, phase, second = log(rng, 1e-4, 1e-2), rng.uniform(0, 1), rng.uniform(0, 0.3)
    start = float(rng.choice((-0.5, 0.0, -1.0, rng.uniform(-1, 0.5), 7.0)))
    dress = rng.choice(("both", "left", "right", "function", "half open", "mask", "reversed"))
    count = int(rng.integers(12, 40))
    body_words, plane, force = body_of(rng, unit, long)
    load = pi * size * 100 / 0.91 * log(rng, 0.05, 0.7)

    def height(x):
        return size * (1 - np.cos(2 * pi * (x - phase)) + second * np.cos(4 * pi * x))

    x = start + np.linspace(0, long, count + 1)
    x = {"left": x[:-1], "right": x[1:], "reversed": x[::-1]}.get(dress, x)
    z = height(x)

    def function(x):
        beyond = (x / unit > start + long) if dress != "half open" else (x / unit >= start + long)
        beyond |= x / unit < start
        above = unit * height(x / unit)
        return np.ma.array(above, mask=beyond) if dress == "mask" else np.where(beyond, np.inf, above)

    by_function = dress in ("function", "half open", "mask")
    if by_function and start > 0.5:
        start = 0.25
    corners = np.linspace(0, long, count + 1) + start

    def known(places):
        if by_function:
            return height(places)
        return np.interp((places - start) % long + start, corners, height(corners))

    def solve(**options):
        obstacle = function if by_function else mb.Obstacle.from_samples(x * unit, z * unit)
        return mb.Contact(plane, obstacle, mb.Unilateral()).solve(load * force, **options)

    words = f"period {dress} from {start:.2f} n {count} unit {unit:.0e} {body_words}"
    return Scene(words, solve, known, (-long / 2, long / 2), load, unit, period=long)


def files(rng):
    """Samples by a text file."""
    half = log(rng, 0.05, 0.5)
    name, height = shape(rng, half)
    x = np.linspace(-4 * half, 4 * half, int(rng.integers(9, 34)))
    x, z = np.round(x, 4), np.round(height(x), 6)
    separator, comma = [("\t", True), (";", True), (",", False), ("  ", False), ("\t", False), (" ", True)][
        rng.integers(6)
    ]
    encoding = rng.choice(("utf-8", "utf-8-sig", "latin-1", "utf-16"))
    unit = rng.choice(("mm", "um", "nm", "none"))
    parts = {"mm": (1.0, 1.0), "um": (1.0, 1e3), "nm": (1e3, 1e6), "none": (1.0, 1.0)}[unit]
    units = {"mm": ("mm", "mm"), "um": ("mm", "µm"), "nm": ("µm", "nm"), "none": ("", "")}[unit]
    head = rng.choice(("titles", "count and titles", "prose"))
    lines = {"titles": [], "count and titles": [str(len(x))], "prose": ["Measured by hand", "operator: me"]}[
        head
    ]
    if unit != "none" or head == "titles":
        lines = [
            *lines,
            separator.join(f"{letter} [{part}]".replace(" []", "") for letter, part in zip("xz", units)),
        ]
    gone = rng.random(len(x)) < 0.1 * rng.integers(0, 2)
    for row, out in zip(np.column_stack((x * parts[0], z * parts[1])), gone):
        cells = [f"{row[0]:.9g}", "NaN" if out else f"{row[1]:.9g}"]
        lines.append(separator.join(cells).replace(".", "," if comma else "."))
    text = "\n".join(lines) + "\n"
    body_words, plane, force = body_of(rng, 1.0)
    load = load_of(half)

    def solve(**options):
        with TemporaryDirectory() as folder:
            file = Path(folder) / "profile.txt"
            with open(file, "w", encoding=str(encoding), newline="\r\n") as written:
                written.write(text)
            obstacle = read_samples(file, unit="mm")
        return mb.Contact(plane, obstacle, mb.Unilateral()).solve(load * force, **options)

    words = (
        f"file {name} {separator!r} {encoding} {unit} {head} comma {comma} missing {gone.sum()} {body_words}"
    )
    return Scene(words, solve, polygon(x, np.where(gone, np.nan, z)), (x[0], x[-1]), load)


KINDS = (samples, functions, samples, periods, files)
