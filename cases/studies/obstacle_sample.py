"""Obstacles that are meant to be hard: a seeded sample of problems of which each can be made again from
(seed, number).

Lengths are over the half-width of the classical contact of a cylinder R = 10 under the load pi/2, for E* =
20; loads spread over three decades about it. Heights are plain functions but for those from a file, their
slopes are finite, and they grow far away: a bounded height on a half-plane has no solution.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

import microblock as mb

from .obstacle_cells import Window

LIMIT = 60  # seconds of processor time of a state
JUDGE_LIMIT = 120  # of the cells that verify it; their active set may take for ever
CARRIES = 1e-4  # share of the load from which a zone counts
TWICE = 2.0  # so much more, or less, is a difference
RADIUS, STIFFNESS, LOAD = 10.0, 20.0, np.pi / 2
LAWS = "microblock", "psi0", "unilateral", "lever", "microclamped", "microblock", "psi0"
LOADS = 0.02, 20.0  # over LOAD
ALPHAS = 0.02, 1.5  # ell over the half-width of the classical contact at the load
TURNS = 0.003, 1.5  # psi0 over that half-width over R
NARROW = 0.003  # narrowest hill or pit
SLOPES = 0.01, 0.6  # steepest flanks of hills and pits


@dataclass(frozen=True)
class Draw:
    """One problem of the sample."""

    seed: int
    number: int

    @property
    def kind(self):
        return tuple(KINDS)[self.number % len(KINDS)]

    @property
    def contact(self):
        """The law: a word of LAWS."""
        return LAWS[self.number // len(KINDS) % len(LAWS)]

    @cached_property
    def _drawn(self):
        rng = np.random.default_rng([self.seed, self.number])
        load = LOAD * _log(rng, *LOADS)
        half = np.sqrt(load / LOAD)
        material = {
            "nu": float(rng.uniform(0, 0.49)),
            "ell": float(half * _log(rng, *ALPHAS)),
            "beta": float(rng.uniform(0.2, 1.9)),
        }
        psi0 = 0.0
        if self.contact in ("psi0", "lever"):
            psi0 = float(rng.choice((-1, 1)) * _log(rng, *TURNS) * half / RADIUS)
        return load, material, psi0, *KINDS[self.kind](rng, half)

    @property
    def load(self):
        return float(self._drawn[0])

    @property
    def material(self):
        return self._drawn[1]

    @property
    def psi0(self):
        return self._drawn[2]

    @property
    def window(self):
        """What the cells that verify know of the obstacle: see `cases.studies.obstacle_cells.Window`."""
        return self._drawn[4]

    @property
    def about(self):
        """What records say of it."""
        return {
            "seed": self.seed,
            "number": self.number,
            "kind": self.kind,
            "contact": self.contact,
            "load": self.load,
            **self.material,
            "psi0": self.psi0,
        }

    def problem(self):
        """The `Contact` of this draw."""
        ell, nu, beta = (self.material[name] for name in ("ell", "nu", "beta"))
        acts_in = "levers" if self.contact == "lever" else "gaps and levers"
        law = {"unilateral": mb.Unilateral(), "microclamped": mb.Microclamped()}.get(
            self.contact, mb.Microblock(self.psi0, acts_in)
        )
        solid = mb.Cosserat(E=STIFFNESS * (1 - nu**2), nu=nu, ell=ell, beta=beta)
        return mb.Contact(mb.HalfPlane(solid), self._drawn[3], law)


def sample(count, seed):
    """`count` draws: every kind in turn, and each with every law in turn."""
    return [Draw(seed, number) for number in range(count)]


def _log(rng, low, high):
    return float(low * (high / low) ** rng.uniform())


def _sharp(p):
    """Width of the cells that the pressure |x|^(p - 1) asks for: to the power p - 1/2 it is what one of them
    leaves in L2.
    """
    return 3e-4 ** (1 / (p - 0.5))


def _parabola(x):
    return x**2 / (2 * RADIUS)


def _reach(half, least=0.0):
    """To where a cylinder could be touched at a load of this half-width, generously."""
    return 4 * half + least


# each kind: (rng, half-width at the load) -> obstacle, Window


def cylinders(rng, half):
    """One to six, apart by 2 to 50 half-widths, of different radii and heights."""
    count = int(rng.integers(1, 7))
    places = half * np.cumsum([0.0, *(_log(rng, 2, 50) for _ in range(count - 1))])
    places -= places[rng.integers(count)] + half * rng.uniform(-1, 1)
    radii = RADIUS * np.array([_log(rng, 0.3, 3) for _ in range(count)])
    levels = half**2 / RADIUS * rng.choice((0.0, 0.05, 0.5), count) * rng.uniform(-1, 1, count)

    def height(x):
        return np.min(
            [(x - place) ** 2 / (2 * radius) + level for place, radius, level in zip(places, radii, levels)],
            axis=0,
        )

    return height, Window(places[0] - 2 * _reach(half), places[-1] + 2 * _reach(half), half)


def hills(rng, half):
    """A cylinder with one to five Gaussian hills, or pits, down to NARROW."""
    parts = [
        (half * rng.uniform(-1.5, 1.5), half * _log(rng, NARROW, 1.0)) for _ in range(rng.integers(1, 6))
    ]
    heights = [rng.choice((-1, 1)) * _log(rng, *SLOPES) * min(width, half**2 / RADIUS) for _, width in parts]

    def height(x):
        return _parabola(x) + sum(
            size * np.exp(-(((x - place) / width) ** 2)) for size, (place, width) in zip(heights, parts)
        )

    return height, Window(-_reach(half), _reach(half), half, tuple(parts))


def side_hill(rng, half):
    """A smooth hill beside the contact, that may or may not touch."""
    place, width = half * rng.choice((-1, 1)) * rng.uniform(1.05, 3), half * _log(rng, 0.01, 0.4)
    size = _parabola(place) * rng.uniform(0.5, 1.2)
    size = min(size, 0.6 * width)

    def height(x):
        return _parabola(x) - size * np.exp(-(((x - place) / width) ** 2))

    return height, Window(-_reach(half), _reach(half), half, ((place, width),))


def fourier(rng, half):
    """Random waves on a weak parabola."""
    flat, longest = _log(rng, 1, 6), half * _log(rng, 0.5, 3)
    m = np.arange(1, rng.integers(3, 13))
    sizes = m ** -rng.uniform(1.0, 2.0) * rng.normal(size=len(m))
    sizes *= half**2 / RADIUS * _log(rng, 0.01, 1.0) / np.abs(sizes).sum()
    phases = rng.uniform(0, 2 * np.pi, len(m))

    def height(x):
        return _parabola(x) / flat + sum(
            a * np.cos(2 * np.pi * k * x / longest + phase) for a, k, phase in zip(sizes, m, phases)
        )

    reach = _reach(half) * flat**0.5 + half
    return height, Window(-reach, reach, longest / m[-1] / 2)


def rounded_punch(rng, half):
    """Flat, with parabolic shoulders: the curvature jumps."""
    flat, radius, tilt = (
        half * _log(rng, 0.1, 3),
        RADIUS * _log(rng, 0.02, 1),
        half / RADIUS * rng.choice((0, 0.1)) * rng.uniform(-1, 1),
    )

    def height(x):
        return np.maximum(np.abs(x) - flat, 0) ** 2 / (2 * radius) + tilt * x

    return height, Window(
        -flat - _reach(half), flat + _reach(half), half, ((-flat, 0.02 * half), (flat, 0.02 * half))
    )


def chamfered_punch(rng, half):
    """Flat or slightly crowned, with straight shoulders: the slope jumps."""
    flat, slope = half * _log(rng, 0.1, 3), _log(rng, 0.1, 5) * half / RADIUS
    crown = rng.choice((0.0, 0.1))

    def height(x):
        return slope * np.maximum(np.abs(x) - flat, 0) + crown * _parabola(x)

    return height, Window(
        -flat - _reach(half) * 6, flat + _reach(half) * 6, half, ((-flat, 0.0), (flat, 0.0))
    )


def sawtooth(rng, half):
    """Triangular teeth on a parabola."""
    period, size = half * _log(rng, 0.3, 3), half**2 / RADIUS * _log(rng, 0.02, 1)
    shift, skew = rng.uniform(-0.5, 0.5) * period, rng.uniform(0.3, 0.7)

    def height(x):
        along = (x - shift) / period % 1.0
        return _parabola(x) + size * np.where(along < skew, along / skew, (1 - along) / (1 - skew))

    numbers = np.arange(-np.ceil(_reach(half) / period), np.ceil(_reach(half) / period) + 1)
    kinks = tuple(
        (float(place), 0.0)
        for number in numbers
        for place in (shift + period * number, shift + period * (number + skew))
    )
    return height, Window(-_reach(half), _reach(half), period / 4, kinks)


def power(rng, half):
    """|x|^p as steep at the half-width as the cylinder."""
    p = rng.uniform(1.2, 4)

    def height(x):
        return half**2 / (2 * RADIUS) * np.abs(x / half) ** p

    reach = half * 30 ** (2 / p)
    return height, Window(-min(reach, 40 * half), min(reach, 40 * half), half, ((0.0, half * _sharp(p)),))


def shifted_power(rng, half):
    """|x - c|^p off the origin, near or far."""
    p, place = rng.uniform(1.2, 4), half * rng.choice((-1, 1)) * _log(rng, 0.05, 30)

    def height(x):
        return half**2 / (2 * RADIUS) * np.abs((x - place) / half) ** p

    reach = min(half * 30 ** (2 / p), 40 * half)
    return height, Window(place - reach, place + reach, half, ((place, half * _sharp(p)),))


def bump(rng, half):
    """Smooth and not symmetric."""
    scale, place, third = half * _log(rng, 0.5, 5), half * rng.uniform(-2, 2), rng.uniform(0, 0.3)

    def height(x):
        s = np.clip((x - place) / scale, -700, 60)
        return scale**2 / RADIUS * (np.exp(s) - 1 - s + third * s**4)

    reach = 6 * half + 3 * scale
    return height, Window(place - 40 * half - reach, place + reach, half)


def profile(rng, half):
    """Samples of a cylinder with noise, as from a file."""
    count, reach = int(rng.integers(9, 34)), half * rng.uniform(3.5, 5)
    x = (
        np.sort(rng.uniform(-reach, reach, count))
        if rng.uniform() < 0.3
        else np.linspace(-reach, reach, count)
    )
    x[0], x[-1] = -reach, reach
    z = _parabola(x) + half**2 / RADIUS * _log(rng, 1e-3, 0.3) * rng.normal(size=count)
    z[[0, -1]] = np.maximum(z[[0, -1]], 3 * half**2 / RADIUS)
    kinks = tuple((float(place), 0.0) for place in x[1:-1])
    return mb.Obstacle.from_samples(x, z), Window(-reach, reach, half, kinks)


def waves(rng, half):
    """A cylinder with a wave, from hardly seen to many contacts."""
    length, phase = half * _log(rng, 0.08, 2), rng.uniform(0, 2 * np.pi)
    size = length**2 / RADIUS * _log(rng, 0.003, 3)

    def height(x):
        return _parabola(x) + size * np.cos(2 * np.pi * x / length + phase)

    return height, Window(-_reach(half), _reach(half), length / 2)


def cusps(rng, half):
    """The lower envelope of |x - c|^p, 1.2 < p < 1.8."""
    count = int(rng.integers(1, 5))
    places, powers = half * rng.uniform(-3, 3, count), rng.uniform(1.2, 1.8, count)
    levels = half**2 / RADIUS * rng.uniform(0, 0.4, count)
    scale = half**2 / (2 * RADIUS) * _log(rng, 0.5, 5)

    def height(x):
        return np.min(
            [
                scale * np.abs((x - place) / half) ** p + level
                for place, p, level in zip(places, powers, levels)
            ],
            axis=0,
        )

    features = tuple((float(place), float(half * _sharp(p))) for place, p in zip(places, powers))
    return height, Window(-40 * half, 40 * half, half, features)


def steps(rng, half):
    """Smooth steps between plateaus, on a weak parabola."""
    parts = [(half * rng.uniform(-2, 2), half * _log(rng, 0.01, 0.3)) for _ in range(rng.integers(1, 5))]
    heights = [
        rng.choice((-1, 1)) * min(half**2 / RADIUS * _log(rng, 0.01, 0.5), 0.5 * width) for _, width in parts
    ]
    flat = _log(rng, 1, 10)

    def height(x):
        return _parabola(x) / flat + sum(
            size * np.tanh((x - place) / width) for size, (place, width) in zip(heights, parts)
        )

    reach = _reach(half) * flat**0.5 + half
    return height, Window(-reach, reach, half, tuple((float(place), width) for place, width in parts))


def soft_cusps(rng, half):
    """Rounded wedges side by side: sqrt(x^2 + w^2), w down to NARROW."""
    count = int(rng.integers(1, 4))
    parts = [(half * rng.uniform(-3, 3), half * _log(rng, NARROW, 0.3)) for _ in range(count)]
    levels, slope = half**2 / RADIUS * rng.uniform(0, 0.3, count), half / RADIUS * _log(rng, 0.3, 2)

    def height(x):
        return np.min(
            [slope * np.hypot(x - place, width) + level for (place, width), level in zip(parts, levels)],
            axis=0,
        )

    return height, Window(-30 * half, 30 * half, half, tuple((float(place), width) for place, width in parts))


KINDS = {
    each.__name__: each
    for each in (
        cylinders,
        hills,
        side_hill,
        fourier,
        rounded_punch,
        chamfered_punch,
        sawtooth,
        power,
        shifted_power,
        bump,
        profile,
        waves,
        cusps,
        steps,
        soft_cusps,
    )
}
