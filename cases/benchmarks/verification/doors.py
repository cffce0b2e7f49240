"""What users hand over: samples, heights and files, in arrays of every kind, and windows of a period.

Input k comes from (SEED, 60, k): an obstacle that is known exactly, in a dress: a type of numbers, an order,
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
E_STAR = 100 / 0.91


@dataclass
class Input:
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
    E_star: float = E_STAR
    period: float | None = None
    refusal: str = ""
    mended: object = None

    def answer(self):
        """The State, after the advice of a refusal has been followed; raises AssertionError where one is
        missing.
        """
        try:
            state = self.solve()
        except mb.BadArgument as failure:
            if not self.refusal or self.refusal not in str(failure):
                raise
            return self.mended()
        except mb.NotConverged as failure:
            if self.refusal or failure.rtol_reached is None:
                raise
            return self.solve(rtol=failure.rtol_reached)
        if self.refusal:
            raise AssertionError(f"was taken; {self.refusal!r} was expected")
        return state

    def verify(self, state):
        """(distance, estimate, error of the judge) of what is carried on the left, over the load."""
        coarse, (edges, true) = (self.carried(count) for count in CELLS)
        rough = np.interp(edges, *coarse)
        order = np.argsort(state.x)
        forces = (state.weights * state.pressure)[order]
        sums = np.cumsum(forces)
        x = np.clip(edges * self.unit, state.x[0], state.x[-1])
        fraction = np.interp(x, state.x[order], sums - forces / 2, left=0.0, right=sums[-1]) / sums[-1]
        if self.period:  # a period may begin at any place
            fraction, true, rough = (values - values[0] for values in (fraction, true, rough))
        # next to ends and between pieces cells converge by their root: twice the difference is not all
        return np.abs(fraction - true).max(), state.error_estimate, 3 * np.abs(true - rough).max() + 1e-3

    def carried(self, count):
        """(edges of cells, part of the load on their left) of so many cells about the contact."""
        left, right = self.window
        for _ in range(1 if self.period else 3):
            edges = np.linspace(left, right, count + 1)
            p = pressed(self.height, edges, self.load, self.E_star, self.period)
            touched = np.flatnonzero(p > 0)
            rim = 0.1 * (edges[touched[-1] + 1] - edges[touched[0]]) + 2 * (edges[1] - edges[0])
            left = max(left, edges[touched[0]] - rim)
            right = min(right, edges[touched[-1] + 1] + rim)
        return edges, np.concatenate(([0.0], np.cumsum(p * np.diff(edges)))) / self.load


def flexibility(edges, E_star, period):
    """Displacements of the middles of cells under pressures on them, by a logarithm or by waves."""
    count = len(edges) - 1
    x = (edges[1:] + edges[:-1]) / 2
    if period is None:
        along = x[:, None] - edges
        integrals = along * np.log(np.maximum(np.abs(along), 1e-300) / (edges[-1] - edges[0])) - along
        return 2 / (pi * E_star) * np.diff(integrals, axis=1)
    k = 2 * pi / period * np.arange(1, count // 2 + 1)  # u of a wave is 2 p/(E* k)
    cell = np.sinc(k * (edges[1] - edges[0]) / (2 * pi)) * (1 - (k == k[-1]) / 2)
    waves = np.cos(np.outer(x - x[0], k)) @ (2 / (E_star * k) * cell) * 2 / count
    numbers = np.arange(count)
    return waves[np.abs(numbers[:, None] - numbers)]


def closing(matrix, gaps, widths, closed, load):
    """Pressures that close the gaps of some cells under the load, and the approach."""
    numbers = np.flatnonzero(closed)
    system = np.zeros((len(numbers) + 1,) * 2)
    system[:-1, :-1] = matrix[np.ix_(numbers, numbers)]
    system[:-1, -1] = -1.0
    system[-1, :-1] = widths[numbers]
    solution = np.linalg.solve(system, np.append(-gaps[numbers], load))
    p = np.zeros(len(widths))
    p[numbers] = solution[:-1]
    return p, solution[-1]


def pressed(height, edges, load, E_star, period=None):
    """Pressures of cells under a rigid obstacle on a classical half-plane, by active sets."""
    widths = np.diff(edges)
    gaps = np.asarray(height((edges[1:] + edges[:-1]) / 2), float)
    solid = np.isfinite(gaps)
    matrix = flexibility(edges, E_star, period)
    closed = solid & (gaps <= gaps[solid].min() + load / E_star)
    for _ in range(200):
        p, approach = closing(matrix, gaps, widths, closed, load)
        opens = closed & (p < 0)
        gap = np.where(solid, gaps, inf) + matrix @ p - approach
        closes = ~closed & (gap < -1e-12 * np.abs(gap[solid]).max())
        if not opens.any() and not closes.any():
            return p
        closed = (closed & ~opens) | (closes & ~opens.any())
    raise NoAnswer("the judge's cells do not settle")


def case(k):
    """Input k as a `Case`; its refusals and the states after their advice count as what they are."""
    user = drawn(k)
    return Case(user.words, 0.01, user.answer, user.verify)


def drawn(k):
    """Input k: every kind in turn."""
    rng = np.random.default_rng((SEED, 60, k))
    return KINDS[k % len(KINDS)](rng)


class HalfPlane:
    """A classical half-plane in a random unit of stress, and a unit of length; `words` about it."""

    def __init__(self, rng, unit, period=None):
        stress = 10.0 ** rng.integers(-3, 13)
        self.body = mb.HalfPlane(mb.Elastic(100 * stress, 0.3), period=period and period * unit)
        self.force = stress * unit
        self.words = f"E {100 * stress:.0e}"

    def solve(self, obstacle, load, **options):
        return mb.Contact(self.body, obstacle, mb.Unilateral()).solve(load * self.force, **options)


def unit_of(rng):
    """A random unit of length, or 1."""
    if rng.random() < 0.4:
        return float(10.0 ** rng.integers(-9, 10))
    return 1.0


def place_of(rng, half):
    """A place near, or far away from, the origin."""
    return float(rng.choice((0.0, 0.0, 0.0, 7.0, 1e6))) * half


def shape(rng, half):
    """(words, heights at x) of a smooth obstacle that touches over some half-width."""
    place = half * rng.uniform(-0.5, 0.5)
    R = 10.0
    size = half**2 / R * log(rng, 0.01, 0.1)
    wave = half * rng.uniform(1, 3)
    skew = rng.uniform(0, 0.1) / half
    return [
        ("parabola", lambda x: (x - place) ** 2 / (2 * R)),
        ("ripples", lambda x: (x - place) ** 2 / (2 * R) + size * np.cos(2 * pi * x / wave)),
        ("skew", lambda x: (x - place) ** 2 / (2 * R) * np.exp(np.clip(skew * x, -1, 1))),
        ("wedge", lambda x: half / R * np.abs(x - place)),
    ][rng.integers(4)]


def load_of(half):
    return pi / 4 * E_STAR * half**2 / 10


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
    "int": np.int64,
}
ORDERS = {  # of so many samples, and words of the error that is right
    "as it is": (lambda rng, n: np.arange(n), ""),
    "reversed": (lambda rng, n: np.arange(n)[::-1], ""),
    "unsorted": (lambda rng, n: rng.permutation(n), "sort it"),
    "repeated": (lambda rng, n: np.repeat(np.arange(n), 1 + (np.arange(n) == 2)), "average duplicates"),
    "one": (lambda rng, n: np.arange(1), "at least two"),
}
HOLES = {  # heights, of which some are missing
    "none": lambda z, missing, number: number(z),
    "mask": lambda z, missing, number: np.ma.array(np.where(missing, -9999.0, z), mask=missing),
    "masked list": lambda z, missing, number: list(HOLES["mask"](z, missing, number)),
    "nan": lambda z, missing, number: np.where(missing, np.nan, z),
    "inf": lambda z, missing, number: np.where(missing, np.inf, z),
    "None": lambda z, missing, number: [None if out else float(v) for v, out in zip(z, missing)],
}


def samples(rng):
    """Samples, in an order, with holes, somewhere."""
    half = log(rng, 0.05, 0.5)
    name, height = shape(rng, half)
    reach = half * rng.uniform(3, 5)
    count = int(rng.integers(9, 34))
    x = np.linspace(-reach, reach, count)
    if rng.random() < 0.3:
        x[1:-1] += 0.3 * (x[1] - x[0]) * rng.uniform(-1, 1, count - 2)
    unit = unit_of(rng)
    move = place_of(rng, half)
    kind = [*NUMBERS][rng.integers(len(NUMBERS))]
    z = height(x)
    if kind == "int":  # lengths of thousands
        unit = 1.0
        fine = 4000 / np.abs(x).max()
        x = np.round(fine * x)
        z = np.round(fine * z)
        half *= fine
    if kind in ("float32", "int"):  # of seven digits none are left far away
        move = 0.0
        x = np.array(NUMBERS[kind](x), float)
        z = np.array(NUMBERS[kind](z), float)
    return with_holes(rng, f"{name} n {count} {kind}", x + move, z, NUMBERS[kind], unit, load_of(half), move)


def with_holes(rng, words, x, z, number, unit, load, move):
    """The Input of samples (x, z) as numbers of a kind, with a random order, holes, and second body."""
    order = rng.choice(("as it is", "as it is", "reversed", "unsorted", "repeated", "one"))
    holes = rng.choice(("none", "none", "none", "mask", "nan", "inf", "None", "masked list"))
    missing = np.zeros(len(x), bool)
    if holes != "none":
        missing[rng.integers(1, len(x) - 1, max(1, len(x) // 10))] = True
    plane = HalfPlane(rng, unit)
    second = rng.random() < 0.15

    def solve(rows=np.arange(len(x)), **options):
        heights = HOLES[holes](z[rows] * unit, missing[rows], number)
        obstacle = mb.Obstacle.from_samples(number(x[rows] * unit), heights)
        if second:
            obstacle = mb.Deformable(plane.body, obstacle)
        return plane.solve(obstacle, load, **options)

    arrange, refusal = ORDERS[order]
    rows = arrange(rng, len(x))
    return Input(
        f"samples {words} {order} holes {holes} unit {unit:.0e} at {move:.0e} {plane.words}"
        + " second" * second,
        lambda **options: solve(rows, **options),
        polygon(x, np.where(missing, np.nan, z)),
        (x[0], x[-1]),
        load,
        unit,
        E_STAR / (1 + second),
        refusal=refusal,
        mended=solve,
    )


def polygon(x, z):
    """The height of straight lines between samples of which both are there, inf where none is."""

    def height(places):
        after = np.clip(np.searchsorted(x, places) - 1, 0, len(x) - 2)
        fraction = (places - x[after]) / (x[after + 1] - x[after])
        above = z[after] + fraction * (z[after + 1] - z[after])
        return np.where(np.isnan(above) | (fraction < 0) | (fraction > 1), np.inf, above)

    return height


def spoiling(height):
    """A height that writes into its x."""

    def spoiled(x):
        above = height(x)
        x *= 0.0
        return above

    return spoiled


def dresses(plain, within, cut):
    """{name: (height, words of the error that is right)} of a height `plain` that is there `within` some
    places, and inf elsewhere, `cut`.
    """
    return {
        "mask": (lambda x: np.ma.array(plain(x), mask=~within(x)), ""),
        "inf": (cut, ""),
        "list": (lambda x: list(cut(x)), ""),
        "tuple": (lambda x: tuple(cut(x)), ""),
        "series": (lambda x: series(cut(x)), ""),
        "longdouble": (lambda x: cut(x).astype(np.longdouble), ""),
        "writes into x": (spoiling(cut), ""),
        "one number at a time": (np.vectorize(lambda x: float(cut(np.array(x))), otypes=[float]), ""),
        "masked invalid": (lambda x: np.ma.masked_invalid(np.where(within(x), plain(x), np.nan)), ""),
        "nan": (lambda x: np.where(within(x), plain(x), np.nan), "inf where there is no obstacle"),
        "all nan": (lambda x: np.full(len(x), np.nan), "must be a number"),
        "complex": (lambda x: cut(x) + 0j, "no real numbers"),
        "dates": (lambda x: np.zeros(len(x), "datetime64[s]"), "no real numbers"),
        "texts": (lambda x: [str(value) for value in cut(x)], "no real numbers"),
        "column": (lambda x: cut(x)[:, None], "one number"),
        "too few": (lambda x: cut(x)[1:], "one number"),
        "a scalar": (lambda x: 0.0, "one number"),
        "if": (lambda x: 0.0 if x > 0 else 1.0, "np.vectorize"),
        "nothing": (lambda x: None, "one number"),
        "a class": (mb.Punch, "must be an instance"),
        "raises": (lambda x: {}[0], "must take an array"),
    }


def functions(rng):
    """Heights that return numbers of every kind, or none."""
    half = log(rng, 0.05, 0.5)
    name, height = shape(rng, half)
    unit = unit_of(rng)
    move = place_of(rng, half)
    ends = np.array((-inf, inf))
    if rng.random() < 0.5:
        ends = half * np.array((-1, 1)) * rng.uniform(0.5, 2, 2)
    plane = HalfPlane(rng, unit)

    def plain(x):
        return unit * height(x / unit - move)

    def within(x):
        return (ends[0] <= x / unit - move) & (x / unit - move <= ends[1])

    def cut(x):
        return np.where(within(x), plain(x), np.inf)

    choices = dresses(plain, within, cut)
    dress = [*choices][rng.integers(len(choices))]
    function, refusal = choices[dress]
    bounded = np.isfinite(ends).all()
    if dress == "nan" and not bounded:
        refusal = ""
    mended = cut
    if bounded and move > 1e3 * half:  # a piece far away is not seen among all scales
        mended = SimpleNamespace(height=plain, ends=tuple((ends + move) * unit))
        refusal = refusal or "name its ends"
    return Input(
        f"function {name} {dress} ends {np.round(ends / half, 1)} "
        f"unit {unit:.0e} at {move:.0e} {plane.words}",
        lambda **options: plane.solve(function, load_of(half), **options),
        lambda x: cut(x * unit) / unit,
        tuple(np.clip(ends, -FAR * half, FAR * half) + move),
        load_of(half),
        unit,
        refusal=refusal,
        mended=lambda: plane.solve(mended, load_of(half)),
    )


def periods(rng):
    """A wave on any window of its period, 1."""
    unit = unit_of(rng)
    size = log(rng, 1e-4, 1e-2)
    phase = rng.uniform(0, 1)
    second = rng.uniform(0, 0.3)
    start = float(rng.choice((-0.5, 0.0, -1.0, rng.uniform(-1, 0.5), 7.0)))
    dress = rng.choice(("both", "left", "right", "function", "half open", "mask", "reversed"))
    count = int(rng.integers(12, 40))
    plane = HalfPlane(rng, unit, 1.0)
    load = pi * size * E_STAR * log(rng, 0.05, 0.7)

    def height(x):
        return size * (1 - np.cos(2 * pi * (x - phase)) + second * np.cos(4 * pi * x))

    if dress in ("function", "half open", "mask"):
        if start > 0.5:
            start = 0.25
        obstacle = on_window(height, start, unit, dress)
        true = height
    else:
        corners = start + np.linspace(0, 1, count + 1)
        x = {"left": corners[:-1], "right": corners[1:], "reversed": corners[::-1]}.get(dress, corners)
        obstacle = mb.Obstacle.from_samples(x * unit, height(x) * unit)
        true = lambda x: np.interp((x - start) % 1 + start, corners, height(corners))  # noqa: E731
    return Input(
        f"period {dress} from {start:.2f} n {count} unit {unit:.0e} {plane.words}",
        lambda **options: plane.solve(obstacle, load, **options),
        true,
        (-0.5, 0.5),
        load,
        unit,
        period=1.0,
    )


def on_window(height, start, unit, dress):
    """A height on a period from `start`, inf or masked beyond it."""

    def function(x):
        beyond = (x / unit < start) | (x / unit > start + 1)
        if dress == "half open":
            beyond |= x / unit == start + 1
        above = unit * height(x / unit)
        return np.ma.array(above, mask=beyond) if dress == "mask" else np.where(beyond, np.inf, above)

    return function


SEPARATORS = [("\t", True), (";", True), (",", False), ("  ", False), ("\t", False), (" ", True)]
UNITS = {  # of the columns of a file: names, and lengths over a millimetre
    "mm": (("mm", "mm"), (1.0, 1.0)),
    "um": (("mm", "µm"), (1.0, 1e3)),
    "nm": (("µm", "nm"), (1e3, 1e6)),
    "none": (("", ""), (1.0, 1.0)),
}


def files(rng):
    """Samples by a text file."""
    half = log(rng, 0.05, 0.5)
    name, height = shape(rng, half)
    places = np.linspace(-4 * half, 4 * half, int(rng.integers(9, 34)))
    x = np.round(places, 4)
    z = np.round(height(places), 6)
    separator, comma = SEPARATORS[rng.integers(6)]
    encoding = str(rng.choice(("utf-8", "utf-8-sig", "latin-1", "utf-16")))
    unit = rng.choice(("mm", "um", "nm", "none"))
    head = rng.choice(("titles", "count and titles", "prose"))
    missing = rng.random(len(x)) < 0.1 * rng.integers(0, 2)
    text = file_of(x, np.where(missing, np.nan, z), separator, comma, unit, head)
    plane = HalfPlane(rng, 1.0)
    load = load_of(half)

    def solve(**options):
        with TemporaryDirectory() as folder:
            file = Path(folder) / "profile.txt"
            file.write_text(text, encoding=encoding, newline="\r\n")
            obstacle = read_samples(file, unit="mm")
        return plane.solve(obstacle, load, **options)

    words = f"file {name} {separator!r} {encoding} {unit} {head} comma {comma} missing {missing.sum()}"
    height = polygon(x, np.where(missing, np.nan, z))
    return Input(f"{words} {plane.words}", solve, height, (x[0], x[-1]), load)


def file_of(x, z, separator, comma, unit, head):
    """The text of a file with a head, and titles of the columns where they are needed."""
    titles, sizes = UNITS[unit]
    lines = {"titles": [], "count and titles": [str(len(x))], "prose": ["Measured by hand", "operator: me"]}[
        head
    ]
    if unit != "none" or head == "titles":
        columns = [f"{letter} [{title}]".replace(" []", "") for letter, title in zip("xz", titles)]
        lines = [*lines, separator.join(columns)]
    for row in np.column_stack((x, z)) * sizes:
        cells = separator.join(f"{value:.9g}" for value in row).replace("nan", "NaN")
        lines.append(cells.replace(".", "," if comma else "."))
    return "\n".join(lines) + "\n"


KINDS = (samples, functions, samples, periods, files)
