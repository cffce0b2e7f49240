"""Statements of section 4.2 on one contact and its zones (Figs 7 to 9): what decides each."""

from functools import lru_cache

import numpy as np

from ..scenes import hertz
from .figures_hertz import ROTATED, ROTATED_LOADS
from .statement import Statement, above, below, no_verdict, printed

RTOL = 1e-6
FE_RTOL = 1e-5  # of the square of 18 a_Hz
FINE = 1e-9  # of the states whose slopes next to an edge are looked at
EDGE = 10  # errors of edges over that of the pressure: square roots at the edges are weak in L2
STEPS = np.geomspace(1e-5, 1e-3, 5)  # over a_Hz, from the edge of full contact
BESIDE = 1e-13  # of it: the value there, to the root of that
HALVES = 20_001  # points of the trapezoidal rule on x1 < 0: square roots to 1e-6


@lru_cache(maxsize=64)
def solved(load=1.0, **changes):
    """(parameters, state, error estimate, the contract's record) at one load."""
    parameters = hertz.Parameters(**{"loads": (load,), "rtol": RTOL, **changes}).resolved()
    ((state, estimate),) = hertz.solve(parameters)
    return parameters, state, estimate, hertz.observe(parameters, state, estimate)


def observed(name, load=1.0, **changes):
    """A number of the contract's record and its error."""
    _, _, estimate, record = solved(load, **changes)
    return record[name], EDGE * estimate


@lru_cache(maxsize=1)
def meeting():
    """Load over P_max at which the two zones meet for alpha = 0.25, and its error."""
    parameters = hertz.Parameters(alpha=0.25).resolved()
    load, error = parameters.problem.solver.coalescence()
    return load / parameters.P, error / parameters.P


def mesh_size(records):
    return records("fig7")[0]["unknowns"] / 130e3, 0.0


def domain_change(records):
    """Centre pressure on the square of 18 a_Hz over that of the half-plane, less 1."""
    parameters = hertz.Parameters(model="fe", domain="18", rtol=FE_RTOL).resolved()
    ((state, estimate),) = hertz.solve(parameters)
    bounded, whole = hertz.observe(parameters, state, estimate), solved()[3]
    return bounded["pressure_centre"] / whole["pressure_centre"] - 1, estimate


def classical_limit(records):
    """Half-width and largest pressure of a solid with hardly any coupling against (50)."""
    record, estimate = solved(contact="unilateral", beta=1e-8)[3:1:-1]
    return max(abs(record["half_width"] - 1), abs(record["pressure_max"] - 1)), EDGE * estimate


def axis_rotation(records):
    """|psi| at x1 = 0 where the symmetry is not made use of, psi R/a_Hz."""
    parameters = hertz.Parameters(rtol=RTOL).resolved()
    problem = parameters.problem.with_(obstacle=lambda x: x**2 / (2 * parameters.R))
    state = problem.solve(load=parameters.P, rtol=RTOL)
    psi = float(state.solution.rotation(np.zeros(1))[0])
    return abs(psi) * parameters.R / parameters.a_Hz, EDGE * state.error_estimate


def largest_change(one, other):
    names = ("half_width", "pressure_max", "micromoment_max")
    return max(abs(one[3][name] / other[3][name] - 1) for name in names), EDGE * (one[2] + other[2])


def units(records):
    return largest_change(solved(), solved(alpha=0.25, E=7.0, R=0.3, P=0.02))


def alpha_as_load(records):
    """A quarter of the load at alpha = 0.25 against alpha = 0.5, in the units of each."""
    small, whole = solved(0.25, alpha=0.25), solved(alpha=0.5)
    return abs(small[3]["half_width"] * 2 / whole[3]["half_width"] - 1), EDGE * (small[2] + whole[2])


def zones_before(records):
    """Zones of contact, of full contact: 2 and 0 at both loads below coalescence shown."""
    counts = [
        (len(record["zones"]["contact"]), len(record["zones"]["full"]))
        for record in (solved(0.02)[3], solved(0.05)[3])
    ]
    return np.mean([pair == (2, 0) for pair in counts]), 0.0


def paper_scaling(records):
    return (0.25 / 0.8874) ** 2, 0.0  # both numbers are the paper's


def zones_after(records):
    """Share of loads beyond coalescence with one zone of full contact inside one contact, partial on either
    side.
    """
    found = []
    for load in (0.1, 0.25, 0.5, 1.0):
        zones = solved(load)[3]["zones"]
        ((left, right),) = zones["contact"]
        inner = zones["full"]
        found.append(len(inner) == 1 and left < inner[0][0] < 0 < inner[0][1] < right)
    return np.mean(found), 0.0


def growth(records):
    """Smallest growth of the outer edge between loads, towards coalescence and beyond."""
    widths = [observed("half_width", load) for load in (0.02, 0.05, 0.1, 0.25, 0.5, 1.0)]
    return np.diff([width for width, _ in widths]).min(), 2 * max(error for _, error in widths)


def exponent(side, moment=False):
    """Exponent e of |f(c + side d) - f(c)| ~ d^e at the edge c of full contact, alpha = 0.25: 1 is a finite
    slope.
    """

    def compute(records):
        parameters, state, _, record = solved(rtol=FINE)
        a = parameters.a_Hz
        c = record["zones"]["full"][0][1]
        x = a * (c + side * np.append(BESIDE, STEPS))
        p_A, p_B = (state.pressure_at(x, corner) for corner in "AB")
        f = p_A - p_B if moment else p_A + p_B
        slopes = np.diff(np.log(np.abs(f[1:] - f[0]))) / np.diff(np.log(STEPS))
        return slopes[0], np.ptp(slopes)  # the steps nearest to c

    return compute


def coupling(records):
    """Largest deviation of |M| from p ell/2 in the zones of partial contact, over the largest."""
    record, estimate = solved()[3:1:-1]
    profile, (left, right) = record["profile"], record["zones"]["full"][0]
    x, p, M = (np.array(profile[name]) for name in ("x", "pressure", "micromoment"))
    partial = (x < left) | (x > right)
    return np.abs(np.abs(M) - p / 2)[partial].max(), estimate


def rotated(reading, degrees):
    return solved(psi0_deg=degrees, psi0_reading=reading)


def full_zone(record):
    zones = record["zones"]["full"]
    return zones[0] if zones else None


def off_centre(reading, degrees):
    """Distance of the load's centre from x1 = 0."""

    def compute(records):
        _, _, estimate, record = rotated(reading, degrees)
        profile = {name: np.array(record["profile"][name]) for name in ("x", "weight", "pressure")}
        force = profile["weight"] * profile["pressure"]
        return abs(force @ profile["x"]) / force.sum(), estimate

    return compute


def features(reading, degrees):
    """Width of the zone of full contact at the largest load; 0 if there is none."""

    def compute(records):
        _, _, estimate, record = rotated(reading, degrees)
        zone = full_zone(record)
        return (zone[1] - zone[0], EDGE * estimate) if zone else (0.0, 0.0)

    return compute


def left_over_right(reading, degrees):
    """Load carried at x1 < 0 over the whole load, less 1/2: smallest over the loads of Fig. 9."""

    def compute(records):
        found = []
        for load in ROTATED_LOADS:
            _, state, estimate, _ = solved(load, psi0_deg=degrees, psi0_reading=reading)
            x = np.linspace(state.x[0] - (state.x[1] - state.x[0]), 0, HALVES)
            found.append((np.trapezoid(state.pressure_at(x), x) / state.load - 0.5, estimate + 1e-6))
        return min(found)

    return compute


def shifted(reading, degrees):
    """Middle of the zone of full contact at the largest load."""

    def compute(records):
        _, _, estimate, record = rotated(reading, degrees)
        zone = full_zone(record)
        return (sum(zone) / 2, EDGE * estimate) if zone else (None, None)

    return compute


def rotated_statements():
    """The four sentences on Fig. 9 for each interpretation of its psi0."""
    for reading, degrees in ROTATED:
        what = "gaps and levers" if reading == "gap" else "levers only"
        place = f"4.2, Fig. 9; read: {degrees:g} deg, {what}"
        because = "the caption's angle" if degrees == 5 else "not the caption's angle, but its picture"
        yield Statement(
            place,
            "no longer symmetric with respect to x1 = 0",
            "centre of the load off the axis, over a_Hz",
            off_centre(reading, degrees),
            above(0),
            because,
        )
        yield Statement(
            place,
            "zones of separation, partial and full contact are preserved",
            "width of the full zone at P_max, over a_Hz",
            features(reading, degrees),
            above(0),
            "corner A lags by ell psi0, which the load cannot close"
            if (reading, degrees) == ("gap", 5.0)
            else because,
        )
        yield Statement(
            place,
            "higher pressures for x1 < 0 than for x1 > 0",
            "load on x1 < 0 over all, less 1/2; least over three loads",
            left_over_right(reading, degrees),
            above(0),
            because,
        )
        yield Statement(
            place,
            "transitions between full and partial contact are shifted to the right",
            "middle of the full zone at P_max, over a_Hz",
            shifted(reading, degrees),
            above(0),
            "there is no full contact" if (reading, degrees) == ("gap", 5.0) else because,
        )


STATEMENTS = (
    Statement(
        "4.2, Fig. 7",
        "the mesh: about 130 000 unknowns, dense region of 2 a_Hz, five times finer than drawn",
        "unknowns of the fitted mesh of Fig. 7 over 130 000",
        mesh_size,
        no_verdict,
        "its mesh; here the error estimate is 1e-4",
    ),
    Statement(
        "(50)",
        "a_Hz and p_Hz of the classical contact",
        "larger deviation of half-width and peak from (50), beta = 1e-8",
        classical_limit,
        below(1e-4),
        "beta = 1e-8 is as good as classical to 1e-4",
    ),
    Statement(
        "4.2, after (50)",
        "on the axis psi = 0 (and u1 = 0)",
        "|psi R/a_Hz| at x1 = 0 without use of symmetry",
        axis_rotation,
        below(1e-4),
        "the whole line solved, alpha = 0.25",
    ),
    Statement(
        "4.2, after (50)",
        "the domain is a square of 18 a_Hz (36 x 18 for Fig. 9)",
        "what it changes of the centre pressure, relative, alpha = 0.25",
        domain_change,
        no_verdict,
        "its choice; fitted elements on the square against the half-plane",
    ),
    Statement(
        "4.2",
        "E = 100, R = 10, P = 1; normalised results depend on nu, beta and alpha alone",
        "largest change of width, peak and max M with E = 7, R = 0.3, P = 0.02",
        units,
        below(1e-4),
        "aligned blocks",
    ),
    Statement(
        "4.2",
        "alpha specifies the load: the higher the load the lower alpha",
        "half-width at P_max/4 for alpha = 0.25 against alpha = 0.5, relative",
        alpha_as_load,
        below(1e-4),
        "a_Hz grows like the root of the load",
    ),
    Statement(
        "4.2, Fig. 8",
        "at first two separated zones of partial contact, one corner in each",
        "share of loads 0.02, 0.05 with two zones and no full contact",
        zones_before,
        printed(1, 0),
        "alpha = 0.25",
    ),
    Statement(
        "4.2, Fig. 8",
        "the zones grow with the load",
        "smallest growth of the outer edge over six loads",
        growth,
        above(0),
        "alpha = 0.25",
    ),
    Statement(
        "4.2, Fig. 8",
        "the two zones coalesce at P/P_max about 0.07",
        "load of coalescence over P_max, alpha = 0.25",
        lambda records: meeting(),
        printed(0.07, 0.005),
        "limit from both sides of coalescence; the paper's is that of its finite elements",
    ),
    Statement(
        "4.2, Figs 8, 10",
        "zones coalesce at P/P_max about 0.07 for alpha = 0.25, at P_max for alpha_mid = 0.8874",
        "(alpha/alpha_mid)^2 of these numbers of the paper, a load over P_max",
        paper_scaling,
        printed(0.07, 0.005),
        "alpha falls like the root of the load: the load is one number, printed twice",
    ),
    Statement(
        "4.2, Fig. 8",
        "after coalescence: full contact in the middle between two zones of partial contact",
        "share of loads 0.1 to 1 with that topology",
        zones_after,
        printed(1, 0),
        "alpha = 0.25",
    ),
    Statement(
        "4.2, Fig. 8a",
        "the pressure has a kink where full contact ends",
        "exponent of |p - p(c)| inside the full zone",
        exponent(-1),
        below(1),
        "more than a slope discontinuity: exponent 1/2, so the slope is infinite on the inside",
    ),
    Statement(
        "4.2, Fig. 8a",
        "the slope of the pressure is discontinuous where full contact ends",
        "exponent of |p - p(c)| outside the full zone",
        exponent(1),
        printed(1, 0.1),
        "a finite slope on the outside, an infinite one on the inside",
    ),
    Statement(
        "4.2, Fig. 8b",
        "the micromoment has a kink where full contact ends, as the pressure has",
        "exponent of |M - M(c)| inside the full zone",
        exponent(-1, moment=True),
        below(1),
        "as for the pressure",
    ),
    Statement(
        "4.2, Fig. 8b",
        "M is coupled to the local pressure",
        "largest ||M| - p ell/2| in partial contact, over p_Hz ell",
        coupling,
        below(1e-4),
        "(29) with one corner",
    ),
    *rotated_statements(),
    Statement(
        "4.2, after Fig. 9",
        "qualitative features depend on the load",
        "zones of contact at 0.05 P_max less those at P_max",
        lambda records: (
            len(solved(0.05)[3]["zones"]["contact"]) - len(solved()[3]["zones"]["contact"]),
            0.0,
        ),
        above(0),
        "alpha = 0.25",
    ),
)
