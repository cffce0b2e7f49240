"""Coverage of intervals of identified moduli: how many of 1 000 sets of readings have the true value in them.

:Geometry:  cylinders of the radii 4 and 20 on a half-plane with microblocks; loads at which a block is 0.1 to
            0.45 of the half-width
:Method:    readings drawn about the true half-widths, each set fitted by `microblock.data.likelihood`, the
            engine of `microblock.identify`. Half-widths over those of Hertz are a table in ell over the
            half-width and the coupling, at Chebyshev points, with its derivatives
:Reference: the true moduli; of some sets the intervals of `microblock.identify` itself, without the table
:Units:     as they come: E = 100, ell = 0.085; scatter relative to the readings

"coverage" counts the sets in which a modulus is called determined. Where these are not all, the others are no
fair share of the sets, as a profile stays open where the scatter has the modulus near its end; "all" counts
these as well, by their one-sided bounds.
"""

import argparse
import math
from pathlib import Path
from time import process_time as clock

import numpy as np
import pandas as pd
from numpy.polynomial import chebyshev

import microblock as mb
from microblock.data import likelihood

RECORD = Path(__file__).parent / "results" / "identification.csv"
SEED = 20261130
SETS = 1000
LEVEL = 0.95
RADII = (4.0, 20.0)
TRUE = {"E": 100.0, "ell": 0.085, "beta": 1.0}
FIRST = {"E": 80.0, "ell": 0.11, "beta": 0.8}  # first guesses
# unknown moduli, relative scatter, and whether the fit is told it
STUDIES = [
    (("E", "ell"), 0.005, True),
    (("E", "ell"), 0.005, False),
    (("E", "beta"), 0.002, True),
    (("ell", "beta"), 0.0005, True),
    (("ell", "beta"), 0.001, True),
    (("E", "ell", "beta"), 0.0005, True),
]
RATIOS = (0.1, 0.14, 0.2, 0.3, 0.45)  # ell over Hertz' half-width of the loads
ALPHA = (0.02, 0.78)  # range of the table in ell over Hertz' half-width, below the load at which zones merge
ETA = (0.02, 50.0)  # and in mu_c/mu
POINTS = (28, 20)


def solid_of(moduli):
    """The solid of {modulus: value}, the others being those of TRUE."""
    return mb.Cosserat(nu=0.3, **TRUE | moduli)


def contact(moduli, R):
    return mb.Contact(mb.HalfPlane(solid_of(moduli)), mb.Cylinder(R=R), mb.Microblock())


def load(ratio, R, E=TRUE["E"]):
    """The load at which Hertz' half-width is ell over a ratio."""
    return math.pi * E / 0.91 * (TRUE["ell"] / ratio) ** 2 / (4 * R)


def half_width(alpha, eta):
    """Half-width over Hertz' one, of E* = pi/4 under R = 1 with the load 1, where Hertz' half-width is 1."""
    solid = mb.Cosserat(E=0.91 * math.pi, nu=0.3, ell=alpha, eta=eta)
    hertz = mb.hertz_scales(solid, R=1000.0, P=1.0)[0]
    problem = mb.Contact(
        mb.HalfPlane(solid.with_length(alpha * hertz)), mb.Cylinder(R=1000.0), mb.Microblock()
    )
    return problem.solve(load=1.0, rtol=1e-7).half_width / hertz


class Table:
    """Half-widths over Hertz' ones, as Chebyshev series in the logarithms of ALPHA and ETA."""

    def __init__(self):
        points = [chebyshev.chebpts1(count) for count in POINTS]
        at = [self.ends(range_) for range_ in (ALPHA, ETA)]
        alphas, etas = (np.exp(middle + half * x) for (middle, half), x in zip(at, points))
        values = np.array([[half_width(alpha, eta) for eta in etas] for alpha in alphas])
        inverses = [np.linalg.inv(chebyshev.chebvander(x, len(x) - 1)) for x in points]
        self.series = inverses[0] @ values @ inverses[1].T
        self.slopes = [chebyshev.chebder(self.series, axis=axis) for axis in (0, 1)]

    @staticmethod
    def ends(range_):
        low, high = np.log(range_)
        return (low + high) / 2, (high - low) / 2

    def __call__(self, alpha, eta):
        """Values, arrays (n,), and their derivatives by the logarithms of alpha and eta."""
        places = []
        halves = []
        for value, range_ in ((alpha, ALPHA), (eta, ETA)):
            middle, half = self.ends(range_)
            places.append((np.log(value) - middle) / half)
            halves.append(half)
        if np.max(np.abs(places)) > 1:
            raise mb.NotConverged("beyond the table")
        values = chebyshev.chebval2d(*places, self.series)
        return values, *(chebyshev.chebval2d(*places, s) / h for s, h in zip(self.slopes, halves))


class Readings:
    """Half-widths of all loads and radii, of the logarithms of unknown moduli over their first guesses."""

    def __init__(self, table, unknown):
        self.table = table
        self.unknown = unknown
        self.R, ratios = (np.ravel(part) for part in np.meshgrid(RADII, RATIOS, indexing="ij"))
        self.loads = load(ratios, self.R)
        self.first = {name: FIRST[name] if name in unknown else TRUE[name] for name in TRUE}

    def moduli(self, x):
        """{modulus: value} of parameters, array (p,)."""
        first = solid_of(self.first)
        solid = first.scaled(**dict(zip(self.unknown, np.exp(x).tolist())))
        return {name: getattr(solid, name) for name in self.unknown}

    def __call__(self, x):
        """Half-widths, array (n,), and derivatives by the parameters, array (n, p)."""
        moduli = TRUE | self.moduli(x)
        hertz = np.sqrt(4 * self.loads * self.R * 0.91 / (math.pi * moduli["E"]))
        eta = moduli["beta"] / (2 - moduli["beta"])
        values, by_alpha, by_eta = self.table(moduli["ell"] / hertz, np.full(len(hertz), eta))
        slopes = {"E": (by_alpha - values) / 2, "ell": by_alpha, "beta": by_eta}
        derivatives = np.reshape([hertz * slopes[name] for name in self.unknown], (-1, len(hertz)))
        return hertz * values, derivatives.T

    def true(self):
        """Half-widths of the true moduli."""
        exact = Readings(self.table, ())
        return exact(np.zeros(0))[0]

    def fitted(self, measured, scatter, told=True):
        """{modulus: [low, high]} of readings, array (n,), None at an end that is open."""
        sigma = scatter * measured

        def residuals(x):
            values, derivatives = self(x)
            return (values - measured) / sigma, derivatives / sigma[:, None]

        size = np.full(len(self.unknown), math.log(1e3))
        fit = likelihood.fit(residuals, (-size, size), LEVEL, told)
        return {
            name: [None if end is None else self.modulus(name, end) for end in (profile.low, profile.high)]
            for name, profile in zip(self.unknown, fit.profiles)
        }

    def modulus(self, name, parameter):
        """Value of an unknown modulus at its parameter."""
        return getattr(solid_of(self.first).scaled(**{name: math.exp(parameter)}), name)


def holds(interval, value):
    """Whether a value lies in an interval, [low, high] with None at open ends."""
    low, high = interval
    return (low is None or low <= value) and (high is None or value <= high)


def covered(table, unknown, scatter, told, sets, seed):
    """A row of the record for each unknown modulus."""
    rng = np.random.default_rng(seed)
    readings = Readings(table, unknown)
    exact = readings.true()
    start = clock()
    found = []
    for _ in range(sets):
        measured = exact * (1 + scatter * rng.standard_normal(len(exact)))
        found.append(readings.fitted(measured, scatter, told))
    seconds = clock() - start
    for name in unknown:
        every = [intervals[name] for intervals in found]
        intervals = [interval for interval in every if None not in interval]
        hits = sum(holds(interval, TRUE[name]) for interval in intervals)
        widths = [(high - low) / TRUE[name] for low, high in intervals]
        yield {
            "unknown": " ".join(unknown),
            "scatter": scatter,
            "told": told,
            "modulus": name,
            "sets": sets,
            "determined": len(intervals),
            "covered": hits,
            "coverage": hits / max(len(intervals), 1),
            "all": sum(holds(interval, TRUE[name]) for interval in every) / sets,
            "width": float(np.median(widths)) if widths else None,
            "seed": seed,
            "seconds": seconds,
            "version": mb.__version__,
        }


def differences(table, unknown, scatter, seed):
    """Largest difference of the ends of intervals from those of `microblock.identify`, over their widths."""
    rng = np.random.default_rng(seed)
    readings = Readings(table, unknown)
    measured = readings.true() * (1 + scatter * rng.standard_normal(len(readings.R)))
    of_radius = [readings.R == R for R in RADII]
    data = [{"load": readings.loads[part], "half_width": measured[part]} for part in of_radius]
    sigma = [scatter * measured[part] for part in of_radius]
    problems = [contact(readings.first, R) for R in RADII]
    exact = mb.identify(problems, data, unknown, sigma=sigma, level=LEVEL).intervals
    by_table = readings.fitted(measured, scatter)
    return max(
        np.abs(np.subtract(by_table[name], exact[name])).max() / np.ptp(exact[name]) for name in unknown
    )


def main(words=None):
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--sets", type=int, default=SETS)
    sets = parser.parse_args(words).sets
    table = Table()
    rows = [row for study in STUDIES for row in covered(table, *study, sets, SEED)]
    runs = pd.DataFrame(rows)
    runs.to_csv(RECORD, index=False, float_format="%.5g")
    print(runs.to_string())


if __name__ == "__main__":
    main()
