"""Moduli of a Cosserat solid from measured contacts, with intervals that the data determine."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from ..contact import Contact
from ..errors import (
    BadArgument,
    plain,
    require,
    require_choice,
    require_finite,
    require_kind,
    require_numbers,
    require_positive,
    require_tolerance,
    require_values,
)
from ..model.material import Cosserat
from ..model.methods import Cells
from ..model.progress import counting
from ..model.results import PlainData, line, number, saved
from ..model.state import MODULI, State, neighbours
from ..model.types import Array, Axes, Figure, Interval, Target
from ..model.views import pictures
from ..threads import bounded
from . import likelihood

# {column of data: what it reads of a state}
READINGS = {"depth": "approach", "half_width": "half_width", "area": "contact_area", "radius": "contact_area"}
RANGE = 1e3  # factor about a first guess in which a modulus is looked for
# where a modulus ends however the data are; of nu and beta the solid does as well
ENDS = {
    "E": (0.0, math.inf),
    "nu": (-1.0, 0.5),
    "ell": (0.0, math.inf),
    "beta": (0.0, 2.0),
    "curvature": (0.0, math.inf),
}
FOLLOW_ZONES = "panels", "fitted"  # methods whose meshes end at the edges of zones
ROUNDING = 1e-8  # of readings, a scatter that is not theirs: models have fewer digits
DOUBTFUL = 1e-3  # probability of a misfit, below which it contradicts the readings
MODULUS_STEP = 0.02  # relative, of moduli in differences of states: cells and meshes leave noise over it
CELLS_ALONG_AXIS = {"line": 512, "surface": 64}  # which stay, where nobody names them


@dataclass(frozen=True, eq=False, repr=False)
class Identification(PlainData):
    """Moduli that `identify` has found.

    Attributes
    ----------
    values : dict of float
        {modulus: value of the least misfit}.
    intervals : dict of (low, high)
        Intervals of confidence at `level`, by profile likelihood. On a side where the data do not determine a
        modulus the interval ends where the modulus itself does, as (0, high) or (low, inf): the other end is
        a one-sided bound.
    determined : dict of bool
        Whether the profile closes on both sides.
    level : float
    misfit : float
        Sum of squares of the residuals over `sigma`; without one of the residuals.
    freedom : int
        Number of readings less that of the moduli.
    covariance : array (p, p)
        Of the values, in the order of `values`, by the linearised model; inf where it is singular.
    profiles : dict of arrays (2, k)
        {modulus: (values, excess of the misfit over the least one, over the square of the scatter)}; the
        interval ends at `threshold`.
    threshold : float
    readings : list of dict
        A row a reading: "scene" (number), "load", "kind" (of the reading), "measured", "predicted", "sigma",
        without a given one that of the residuals.
    solid : Cosserat
        The solid with these values.
    warnings : list of str
        What the model leaves uncertain beside the scatter, and a misfit that contradicts a given one.

    Examples
    --------
    >>> ground = mb.HalfPlane(mb.Elastic(E=80, nu=0.3))
    >>> problem = mb.Contact(ground, mb.Cylinder(R=10), mb.Unilateral())
    >>> mb.identify(problem, {"load": [1, 2], "half_width": [0.3404, 0.4814]}, ["E"], sigma=0.001)
    <Identification: E = 99.99 (99.33 to 100.7), at 95 %>
    """

    values: dict[str, float]
    intervals: dict[str, Interval]
    determined: dict[str, bool]
    level: float
    misfit: float
    freedom: int
    covariance: Array
    profiles: dict[str, Array]
    threshold: float
    readings: list[dict[str, Any]]
    solid: Cosserat
    warnings: list[str]

    _keys = (
        *("values", "intervals", "determined", "level", "misfit", "freedom", "covariance", "profiles"),
        *("threshold", "readings", "warnings"),
    )

    @property
    def residuals(self) -> Array:
        """Measured less predicted readings, array (n,), each in its unit."""
        return np.array([row["measured"] - row["predicted"] for row in self.readings])

    def parts_to_save(self) -> tuple[type, dict[str, Any]]:
        return Identification, {entry.name: getattr(self, entry.name) for entry in fields(self)}

    def plot(self, file: Target = None, ax: Axes | None = None) -> Figure:
        """Returns a figure of the readings over the load with the fit, and of the profiles.

        Parameters
        ----------
        file : str or Path, optional
            File of the figure (PNG, PDF or SVG, by its ending).
        ax : matplotlib.axes.Axes, optional
            Where to draw readings and fit alone.
        """
        return saved(pictures().draw_identification(self, ax), file, ax, self.warnings)

    def __repr__(self) -> str:
        words = [self._sentence(name) for name in self.values]
        return line("Identification", f"{', '.join(words)}, at {100 * self.level:g} %", self.warnings)

    def _sentence(self, name: str) -> str:
        """Returns a modulus with its interval, or what is known of it."""
        low, high = self.intervals[name]
        if self.determined[name]:
            return f"{name} = {number(self.values[name])} ({number(low)} to {number(high)})"
        bounds = [f"above {number(low)}"] * (low > ENDS[name][0]) + [f"below {number(high)}"] * (
            high < ENDS[name][1]
        )
        return f"{name} undetermined{''.join(f', {bound}' for bound in bounds)}"


@dataclass(frozen=True)
class Scene:
    """A contact and what was measured of it: loads, {kind: readings} and {kind: scatter}, arrays (n,)."""

    problem: Contact
    loads: Array
    readings: dict[str, Array]
    sigma: dict[str, Array]


@bounded
def identify(
    problem: Contact | Sequence[Contact],
    data: Mapping[str, ArrayLike] | Sequence[Mapping[str, ArrayLike]],
    free: Sequence[str] = ("ell",),
    *,
    sigma: Any = None,
    level: float = 0.95,
    rtol: float | None = None,
    progress: bool | None = None,
) -> Identification:
    """Returns moduli of a solid from what was measured of its contacts.

    The sum of squares of residuals over their scatter is least (`scipy.optimize.least_squares`, with the
    derivatives of `State.sensitivity` where a method has them, and else with differences of states 2 % of a
    modulus beside it). Intervals are those of the profile likelihood; a modulus whose profile does not close
    up to a thousandth and a thousand times its first guess is said to be undetermined.

    Parameters
    ----------
    problem : Contact, or sequence of these
        The contact that was measured, its solid with first guesses of the unknown moduli and the values of
        all others; several contacts, as of obstacles with other radii, with equal solids. Cells stay as many,
        64 along an axis on a half-space, unless the method names them.
    data : mapping of arrays (n,), or sequence of these, one a contact
        "load" (force, in the plane per thickness), and of "depth" (approach), "half_width", "radius" (of the
        circle with the contact's area) and "area" one or several; units are yours.
    free : sequence of str
        The unknown moduli: of "E", "beta", "ell", "nu", "curvature".
    sigma : float, array (n,), or mapping {reading: float or array}; of several contacts also a sequence
        Standard deviations of the readings, in their units; loads are taken as exact. Without it all readings
        are of one kind, and their residuals tell one scatter.
    level : float
        Confidence of the intervals, each modulus by itself.
    rtol : float, optional
        As of `Contact.solve`; without it 1e-6 on panels, and the cells or the mesh otherwise.
    progress : bool, optional
        As of `Contact.solve`.

    Returns
    -------
    Identification

    Raises
    ------
    BadArgument
        If data have other columns, lengths that differ, numbers that are not finite or a load that is not
        positive; if there are no more readings than unknown moduli; if a scatter is not positive, or
        none is given and the readings are those of the model; if a modulus is unknown, or the body has no
        such reading.
    NotConverged
        If the contact cannot be solved at the first guesses.

    Examples
    --------
    >>> solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)
    >>> problem = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Microblock())
    >>> data = {"load": [0.3, 1.0, 3.0], "half_width": [0.2031, 0.3583, 0.6175]}
    >>> mb.identify(problem, data, free=("E",), sigma=0.001).determined
    {'E': True}
    """
    names = [free] if isinstance(free, str) else require_values(free=free)
    for name in names:
        require_choice(MODULI, free=name)
    require(names and len({*names}) == len(names), "free", free, "must name one modulus or more, each once")
    level = plain(level)
    require_finite(level=level)
    require(0 < level < 1, "level", level, "must lie between 0 and 1")
    scenes = scenes_of(problem, data, sigma, len(names))
    model = _Model(scenes, names, require_tolerance(rtol))
    with counting("identification", progress):
        largest = max(np.abs(part).max() for scene in scenes for part in scene.readings.values())
        rounding = ROUNDING * float(largest)
        fit = likelihood.fit(model, model.bounds, float(level), sigma is not None, rounding)
    return model.result(fit, float(level))


def scenes_of(problem: Any, data: Any, sigma: Any, unknowns: int) -> list[Scene]:
    """Returns the Scenes of the arguments of `identify`; raises BadArgument of others."""
    if isinstance(data, Mapping):
        problem = [problem]
        data = [data]
        sigma = [sigma]
    problems = require_values(problem=problem)
    tables = require_values(data=data)
    sigmas = sigma if isinstance(sigma, (list, tuple)) else [sigma] * len(tables)
    words = "must be as many as there are contacts"
    require(tables and len(tables) == len(problems), "data", data, words)
    require(len(sigmas) == len(problems), "sigma", sigma, words)
    scenes = [scene_of(*parts) for parts in zip(problems, tables, sigmas)]
    for scene in scenes:
        words = "must have the same solid as the first contact, with the first guesses"
        require(scene.problem.solid == scenes[0].problem.solid, "problem", scene.problem, words)
    count = sum(len(scene.loads) * len(scene.readings) for scene in scenes)
    require(
        count > unknowns, "data", data, f"has {count} readings: more than the {unknowns} unknowns are needed"
    )
    kinds = {kind for scene in scenes for kind in scene.readings}
    words = "must be given where readings are of several kinds"
    require(len(kinds) == 1 or None not in sigmas, "sigma", None, words)
    return scenes


def scene_of(problem: Any, data: Any, sigma: Any) -> Scene:
    """Returns the Scene of a contact, its data and their scatter."""
    require_kind(Contact, "a Contact, or several", problem=problem)
    require_kind(Mapping, "a mapping of columns, such as {'load': ..., 'depth': ...}", data=data)
    columns = {name: require_numbers(**{name: data[name]}) for name in require_columns(data)}
    loads = columns.pop("load")
    for name, column in columns.items():
        require(
            len(column) == len(loads), name, data[name], f"must have as many entries as load, {len(loads)}"
        )
        require(name == "depth" or (column > 0).all(), name, data[name], "must be positive")
    require((loads > 0).all(), "load", data["load"], "must be positive")
    by_kind = sigma if isinstance(sigma, Mapping) else dict.fromkeys(columns, 1.0 if sigma is None else sigma)
    words = f"must have the readings {', '.join(columns)}"
    require(by_kind.keys() == columns.keys(), "sigma", sigma, words)
    scatter = {}
    for name, value in by_kind.items():
        numbers = require_numbers(sigma=value)
        require_positive(sigma=float(numbers.min(initial=1.0)))
        require(len(numbers) in (1, len(loads)), "sigma", value, f"must be one number or {len(loads)}")
        scatter[name] = np.broadcast_to(numbers, loads.shape)
    return Scene(discretised(problem, {*columns}), loads, columns, scatter)


def require_columns(data: Mapping[str, Any]) -> list[str]:
    """Returns the names of columns; raises BadArgument unless they are load and readings."""
    for name in data:
        require_choice(("load", *READINGS), data=name)
    words = f"must have the column load, and of {', '.join(READINGS)} one or more"
    require("load" in data and len(data) > 1, "data", [*data], words)
    return [*data]


def discretised(problem: Any, kinds: set[str]) -> Any:
    """Returns the problem with its usual method, cells being as many for all moduli; raises BadArgument of
    readings that it does not have.
    """
    solver = problem.solver
    flat = solver.in_space is None
    no_approach = "has no approach: give half_width or area, or take a HalfSpace, a Block or a period"
    require("depth" not in kinds or solver.has_approach, "depth", solver.body, no_approach)
    require("radius" not in kinds or not flat, "radius", solver.body, "is flat: give half_width or area")
    require(
        "half_width" not in kinds or flat, "half_width", solver.body, "lies in space: give radius or area"
    )
    options = problem.method or solver.options
    if isinstance(options, Cells) and options.nodes is None:
        options = replace(options, nodes=CELLS_ALONG_AXIS["line" if flat else "surface"])
    return problem.with_(method=options)


class _Model:
    """The model of `likelihood`: logarithms of the free moduli over their first guesses, array (p,), to
    residuals over the scatter.

    Attributes
    ----------
    bounds : pair of arrays (p,)
    """

    def __init__(self, scenes: list[Scene], names: list[str], rtol: float | None) -> None:
        self.scenes = scenes
        self.names = names
        self.rtol = rtol
        problem: Any = scenes[0].problem
        self.first: Cosserat = problem.solid
        for name in names:
            neighbours(problem, name)  # which refuses a modulus that is no number, or 0
        widest = np.full(len(names), math.log(RANGE))
        lowest = -widest
        if "nu" in names:  # which is above -1
            lowest[names.index("nu")] = 1e-3 - math.log(1.5 / (0.5 - self.first.nu))
        self.bounds = lowest, widest
        self._computed: dict[bytes, list[dict[str, Any]]] = {}

    def solid(self, x: Array) -> Cosserat:
        """Returns the solid of parameters."""
        return self.first.scaled(**dict(zip(self.names, np.exp(x).tolist())))

    def __call__(self, x: Array) -> tuple[Array, Array]:
        rows = self.rows(x)
        self._computed[x.tobytes()] = rows
        sigma = np.array([row["sigma"] for row in rows])
        residuals = np.array([row["predicted"] - row["measured"] for row in rows]) / sigma
        return residuals, np.array([row["derivatives"] for row in rows]) / sigma[:, None]

    def rows(self, x: Array) -> list[dict[str, Any]]:
        """Returns all readings as of `Identification`, with "derivatives" by the parameters, array (p,), and
        the error of the prediction that is "left".
        """
        rows = []
        for number_of_scene, scene in enumerate(self.scenes):
            problem = scene.problem.with_(solid=self.solid(x))
            for k, load in enumerate(scene.loads.tolist()):
                state = problem.solve(load=load, **self.options(problem, scene))
                derivatives = self.derivatives(state, {READINGS[kind] for kind in scene.readings})
                for kind, measured in scene.readings.items():
                    value, slope = _reading(state, kind)
                    rows.append(
                        {
                            "scene": number_of_scene,
                            "load": load,
                            "kind": kind,
                            "measured": float(measured[k]),
                            "predicted": value,
                            "sigma": float(scene.sigma[kind][k]),
                            "derivatives": slope * derivatives[READINGS[kind]],
                            "left": _left(state, kind, value),
                        }
                    )
        return rows

    def options(self, problem: Contact, scene: Scene) -> dict[str, Any]:
        """Returns options of `Contact.solve`: panels are exact, and cells estimate the error of depths."""
        if "depth" in scene.readings and "depth" in problem.solver.accuracies:
            return {"rtol": self.rtol, "accuracy": "depth"}
        on_panels = problem.solver.has_fitted_zones and not problem.solver.has_approach
        return {"rtol": 1e-6 if on_panels and self.rtol is None else self.rtol}

    def derivatives(self, state: State, readings: set[str]) -> dict[str, Array]:
        """Returns {attribute of a state: derivatives by the parameters, array (p,)}."""
        of_moduli = [self.changes(state, name, readings) for name in self.names]
        return {reading: np.array([changes[reading] for changes in of_moduli]) for reading in readings}

    def changes(self, state: State, name: str, readings: set[str]) -> dict[str, float]:
        """Returns {attribute of a state: derivative by the parameter of a modulus}."""
        try:
            sensitivity = state.sensitivity(name)
        except BadArgument:
            sensitivity = {}
        rate = _rate(state.solid, name)
        changes = {reading: rate * change for reading, change in sensitivity.items()}
        missing = readings - changes.keys()
        if missing:
            pair = neighbours(state.problem, name, MODULUS_STEP)
            low, high = (near.solve(load=state.load, rtol=self.rtol) for near in pair)
            for reading in missing:
                changes[reading] = (getattr(high, reading) - getattr(low, reading)) / (2 * MODULUS_STEP)
        return changes

    def result(self, fit: likelihood.Fit, level: float) -> Identification:
        """Returns the Identification of a Fit."""
        solid = self.solid(fit.x)
        values = {name: float(getattr(solid, name)) for name in self.names}
        by_name = dict(zip(self.names, fit.profiles))
        rates = [_rate(solid, name) for name in self.names]
        rows = self._computed[fit.x.tobytes()]
        left = 0.0
        for row in rows:
            del row["derivatives"]
            row["sigma"] *= fit.scatter
            left = max(left, row.pop("left") / row["sigma"])
        freedom = len(rows) - len(values)
        return Identification(
            values,
            {name: self.interval(name, profile) for name, profile in by_name.items()},
            {name: None not in (profile.low, profile.high) for name, profile in by_name.items()},
            level,
            fit.misfit,
            freedom,
            fit.covariance * np.outer(rates, rates),
            {
                name: np.array([self.moduli(name, profile.values), profile.excess])
                for name, profile in by_name.items()
            },
            fit.threshold,
            rows,
            solid,
            [*self.far_from_guesses(fit.x), *self.warnings(left, fit, freedom)],
        )

    def far_from_guesses(self, x: Array) -> list[str]:
        """Returns sentences on moduli whose parameters, array (p,), end where they are looked for."""
        at_low, at_high = likelihood.at_bounds(x, self.bounds)
        return [
            f"{name} is looked for up to a factor of {RANGE:g} about its first guess, "
            f"{getattr(self.first, name):g}, and the fit ends there: begin with another one"
            for name, is_at_end in zip(self.names, at_low | at_high)
            if is_at_end and math.inf in ENDS[name]  # nu and beta end there however data are
        ]

    def warnings(self, left: float, fit: likelihood.Fit, freedom: int) -> list[str]:
        """Returns what makes intervals doubtful: errors of the model of `left` scatters, and a misfit that
        readings of this scatter have in one set of a thousand.
        """
        warnings = []
        if left > 0.5:
            words = f"leave predictions uncertain by up to {left:.2g} of the scatter"
            if any(isinstance(scene.problem.method, Cells) for scene in self.scenes):
                warnings.append(f"cells {words}: name Cells(nodes=...) with more of them")
            else:
                warnings.append(f"errors of the model {words}: give a smaller rtol, or a finer mesh")
        if fit.scatter_is_known and stats.chi2.sf(fit.misfit, freedom) < DOUBTFUL:
            words = f"the misfit is {fit.misfit:.3g} at {freedom} degrees of freedom"
            warnings.append(
                f"{words}: model and scatter contradict the readings, and intervals are too narrow"
            )
        return warnings

    def moduli(self, name: str, parameters: Array) -> Array:
        """Returns values of a modulus at its parameters, arrays (k,)."""
        factors = np.exp(parameters).tolist()
        return np.array([getattr(self.first.scaled(**{name: factor}), name) for factor in factors])

    def interval(self, name: str, profile: likelihood.Profile) -> Interval:
        """Returns the interval of a modulus, to where it ends however data are on a side that is open."""
        low, high = ENDS[name]
        if profile.low is not None:
            low = float(self.moduli(name, np.array([profile.low]))[0])
        if profile.high is not None:
            high = float(self.moduli(name, np.array([profile.high]))[0])
        return low, high


def _rate(solid: Cosserat, name: str) -> float:
    """Returns the derivative of a modulus by the logarithm of its factor, as of `Cosserat.scaled`."""
    if name == "beta":
        return solid.beta * (1 - solid.beta / 2)
    if name == "nu":
        return 0.5 - solid.nu
    return float(getattr(solid, name))


def _reading(state: State, kind: str) -> tuple[float, float]:
    """Returns a reading of a state, and its derivative by the attribute that it reads."""
    value = getattr(state, READINGS[kind])
    if kind == "radius":
        radius = math.sqrt(value / math.pi)
        return radius, 1 / (2 * math.pi * radius)
    return value, 1.0


def _left(state: State, kind: str, value: float) -> float:
    """Returns the error of a reading that the discretisation leaves: of the depth the estimate, of what is
    read off the edge of zones half a cell or, where it follows them, a tenth of the estimate; 0 without one.
    """
    relative = state.error_estimate or 0.0
    if kind == "depth":
        return relative * abs(value)
    if state.method in FOLLOW_ZONES:
        return relative / 10 * value
    largest = float(state.weights[state.closed > 0].max(initial=0.0))
    if state.flat:
        return largest / 2 if kind == "half_width" else largest
    half = math.sqrt(largest) / 2
    return half if kind == "radius" else 2 * math.sqrt(math.pi * value) * half
