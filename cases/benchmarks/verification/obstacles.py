"""Obstacles that are meant to be hard: a seeded sample of problems, each of which can be made again from
(seed, number).

Lengths are over the half-width of the classical contact of a cylinder R = 10 under the load pi/2, for E* =
20; loads spread over three decades about it. Heights are plain functions but for samples, their slopes are
finite, and they grow far away: a bounded height on a half-plane has no solution. Each kind is a function of
(generator, half-width at the load) that returns the height, a window that contains the contact, and features
[(x, width)], of width 0 where the slope jumps.
"""

import numpy as np

RADIUS, STIFFNESS, LOAD = 10.0, 20.0, np.pi / 2
LAWS = "microblock", "psi0", "unilateral", "lever", "microclamped", "microblock", "psi0"
TURNS = 0.003, 1.5  # psi0 over the half-width over R
NARROW = 0.003  # narrowest hill or pit
SLOPES = 0.01, 0.6  # steepest flanks of hills and pits


def drawn(seed, number, mb):
    """(words, Contact, load, window, features) of a problem: every kind in turn, and each with every law."""
    rng, name = np.random.default_rng([seed, number]), tuple(KINDS)[number % len(KINDS)]
    contact = LAWS[number // len(KINDS) % len(LAWS)]
    load = LOAD * log(rng, 0.02, 20.0)
    half = np.sqrt(load / LOAD)
    nu, ell, beta = rng.uniform(0, 0.49), half * log(rng, 0.02, 1.5), rng.uniform(0.2, 1.9)
    turned = contact in ("psi0", "lever")
    psi0 = float(rng.choice((-1, 1)) * log(rng, *TURNS) * half / RADIUS) if turned else 0.0
    height, window, features = KINDS[name](rng, half)
    acts_in = "levers" if contact == "lever" else "gaps and levers"
    laws = {"unilateral": mb.Unilateral(), "microclamped": mb.Microclamped()}
    solid = mb.Cosserat(E=STIFFNESS * (1 - nu**2), nu=nu, ell=ell, beta=beta)
    if isinstance(height, tuple):
        height = mb.Obstacle.from_samples(*height)
    problem = mb.Contact(mb.HalfPlane(solid), height, laws.get(contact, mb.Microblock(psi0, acts_in)))
    words = f"{name:16s}{contact:13s}ell/a {ell / half:.2f} nu {nu:.2f} beta {beta:.2f} psi0 {psi0:+.3f}"
    return words, problem, float(load), window, features


def log(rng, low, high):
    return float(low * (high / low) ** rng.uniform())


def _parabola(x):
    return x**2 / (2 * RADIUS)


def sharp(p):
    """Width of a panel that the pressure |x|^(p - 1) asks for: to the power p - 1/2 it is its part of L2."""
    return 1e-5 ** (1 / (p - 0.5))


def _about(centre, reach):
    return float(centre - reach), float(centre + reach)


def _hills(parts, heights, flat=1.0, shape=lambda s: np.exp(-(s**2))):
    """A parabola with the shapes [(place, width)] of these heights."""

    def height(x):
        shapes = [size * shape((x - place) / width) for size, (place, width) in zip(heights, parts)]
        return _parabola(x) / flat + sum(shapes)

    return height


def _lowest(*heights):
    return lambda x: np.min([height(x) for height in heights], axis=0)


def cylinders(rng, half):
    """One to six, 2 to 50 half-widths from each other, of different radii and heights."""
    count = int(rng.integers(1, 7))
    places = half * np.cumsum([0.0, *(log(rng, 2, 50) for _ in range(count - 1))])
    places -= places[rng.integers(count)] + half * rng.uniform(-1, 1)
    radii = RADIUS * np.array([log(rng, 0.3, 3) for _ in range(count)])
    lowest = half**2 / RADIUS * rng.choice((0.0, 0.05, 0.5), count) * rng.uniform(-1, 1, count)
    all_of_them = zip(places, radii, lowest)
    height = _lowest(*(lambda x, c=c, r=r, z=z: (x - c) ** 2 / (2 * r) + z for c, r, z in all_of_them))
    return height, (places[0] - 8 * half, places[-1] + 8 * half), ()


def hills(rng, half):
    """A cylinder with one to five Gaussian hills, or pits, down to NARROW."""
    count = rng.integers(1, 6)
    parts = [(half * rng.uniform(-1.5, 1.5), half * log(rng, NARROW, 1.0)) for _ in range(count)]
    heights = [rng.choice((-1, 1)) * log(rng, *SLOPES) * min(width, half**2 / RADIUS) for _, width in parts]
    return _hills(parts, heights), _about(0, 4 * half), parts


def side_hill(rng, half):
    """A smooth hill beside the contact, that may or may not touch."""
    place, width = half * rng.choice((-1, 1)) * rng.uniform(1.05, 3), half * log(rng, 0.01, 0.4)
    size = min(_parabola(place) * rng.uniform(0.5, 1.2), 0.6 * width)
    return _hills([(place, width)], [-size]), _about(0, 4 * half), [(place, width)]


def fourier(rng, half):
    """Random waves on a weak parabola."""
    flat, longest = log(rng, 1, 6), half * log(rng, 0.5, 3)
    m = np.arange(1, rng.integers(3, 13))
    sizes = m ** -rng.uniform(1.0, 2.0) * rng.normal(size=len(m))
    sizes *= half**2 / RADIUS * log(rng, 0.01, 1.0) / np.abs(sizes).sum()
    phases = rng.uniform(0, 2 * np.pi, len(m))

    def height(x):
        waves = (a * np.cos(2 * np.pi * k * x / longest + phase) for a, k, phase in zip(sizes, m, phases))
        return _parabola(x) / flat + sum(waves)

    return height, _about(0, 4 * half * flat**0.5 + half), ()


def rounded_punch(rng, half):
    """Flat, with parabolic shoulders: the curvature jumps."""
    flat, radius = half * log(rng, 0.1, 3), RADIUS * log(rng, 0.02, 1)
    tilt = half / RADIUS * rng.choice((0, 0.1)) * rng.uniform(-1, 1)
    ends = ((-flat, 0.0), (flat, 0.0))
    return (
        lambda x: np.maximum(np.abs(x) - flat, 0) ** 2 / (2 * radius) + tilt * x,
        _about(0, flat + 4 * half),
        ends,
    )


def chamfered_punch(rng, half):
    """Flat or slightly crowned, with straight shoulders: the slope jumps."""
    flat, slope = half * log(rng, 0.1, 3), log(rng, 0.1, 5) * half / RADIUS
    crown, ends = rng.choice((0.0, 0.1)), ((-flat, 0.0), (flat, 0.0))
    return (
        lambda x: slope * np.maximum(np.abs(x) - flat, 0) + crown * _parabola(x),
        _about(0, flat + 24 * half),
        ends,
    )


def sawtooth(rng, half):
    """Triangular teeth on a parabola."""
    period, size = half * log(rng, 0.3, 3), half**2 / RADIUS * log(rng, 0.02, 1)
    shift, skew = rng.uniform(-0.5, 0.5) * period, rng.uniform(0.3, 0.7)

    def height(x):
        along = (x - shift) / period % 1.0
        return _parabola(x) + size * np.where(along < skew, along / skew, (1 - along) / (1 - skew))

    numbers = np.arange(-np.ceil(4 * half / period), np.ceil(4 * half / period) + 1)
    kinks = [(shift + period * (number + part), 0.0) for number in numbers for part in (0, skew)]
    return height, _about(0, 4 * half), kinks


def power(rng, half):
    """|x|^p as steep at the half-width as the cylinder."""
    return _power(half, rng.uniform(1.2, 4), 0.0)


def shifted_power(rng, half):
    """|x - c|^p off the origin, near or far."""
    return _power(half, rng.uniform(1.2, 4), half * rng.choice((-1, 1)) * log(rng, 0.05, 30))


def _power(half, p, place):
    reach = min(half * 30 ** (2 / p), 40 * half)
    return (
        lambda x: half**2 / (2 * RADIUS) * np.abs((x - place) / half) ** p,
        _about(place, reach),
        ((place, half * sharp(p)),),
    )


def bump(rng, half):
    """Smooth and not symmetric."""
    scale, place, third = half * log(rng, 0.5, 5), half * rng.uniform(-2, 2), rng.uniform(0, 0.3)

    def height(x):
        s = np.clip((x - place) / scale, -700, 60)
        return scale**2 / RADIUS * (np.exp(s) - 1 - s + third * s**4)

    reach = 6 * half + 3 * scale
    return height, (place - 40 * half - reach, place + reach), ()


def profile(rng, half):
    """Samples of a cylinder with noise, as from a file."""
    count, reach = int(rng.integers(9, 34)), half * rng.uniform(3.5, 5)
    uneven = rng.uniform() < 0.3
    x = np.sort(rng.uniform(-reach, reach, count)) if uneven else np.linspace(-reach, reach, count)
    x[0], x[-1] = -reach, reach
    z = _parabola(x) + half**2 / RADIUS * log(rng, 1e-3, 0.3) * rng.normal(size=count)
    z[[0, -1]] = np.maximum(z[[0, -1]], 3 * half**2 / RADIUS)
    return (x, z), _about(0, reach), [(float(place), 0.0) for place in x[1:-1]]


def waves(rng, half):
    """A cylinder with a wave, from hardly seen to many contacts."""
    length, phase = half * log(rng, 0.08, 2), rng.uniform(0, 2 * np.pi)
    size = length**2 / RADIUS * log(rng, 0.003, 3)
    return lambda x: _parabola(x) + size * np.cos(2 * np.pi * x / length + phase), _about(0, 4 * half), ()


def cusps(rng, half):
    """The lower envelope of |x - c|^p, 1.2 < p < 1.8."""
    count = int(rng.integers(1, 5))
    places, powers = half * rng.uniform(-3, 3, count), rng.uniform(1.2, 1.8, count)
    lowest = half**2 / RADIUS * rng.uniform(0, 0.4, count)
    scale = half**2 / (2 * RADIUS) * log(rng, 0.5, 5)
    parts = zip(places, powers, lowest)
    height = _lowest(*(lambda x, c=c, p=p, z=z: scale * np.abs((x - c) / half) ** p + z for c, p, z in parts))
    features = [(float(place), float(half * sharp(p))) for place, p in zip(places, powers)]
    return height, _about(0, 40 * half), features


def steps(rng, half):
    """Smooth steps between plateaus, on a weak parabola."""
    parts = [(half * rng.uniform(-2, 2), half * log(rng, 0.01, 0.3)) for _ in range(rng.integers(1, 5))]
    signs = [(rng.choice((-1, 1)), log(rng, 0.01, 0.5)) for _ in parts]
    heights = [sign * min(half**2 / RADIUS * size, 0.5 * w) for (sign, size), (_, w) in zip(signs, parts)]
    flat = log(rng, 1, 10)
    return _hills(parts, heights, flat, np.tanh), _about(0, 4 * half * flat**0.5 + half), parts


def soft_cusps(rng, half):
    """Rounded wedges side by side: sqrt(x^2 + w^2), w down to NARROW."""
    count = int(rng.integers(1, 4))
    parts = [(half * rng.uniform(-3, 3), half * log(rng, NARROW, 0.3)) for _ in range(count)]
    lowest, slope = half**2 / RADIUS * rng.uniform(0, 0.3, count), half / RADIUS * log(rng, 0.3, 2)
    wedges = [lambda x, c=c, w=w, z=z: slope * np.hypot(x - c, w) + z for (c, w), z in zip(parts, lowest)]
    return _lowest(*wedges), _about(0, 30 * half), parts


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
