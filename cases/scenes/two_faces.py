"""Strip between rigid planes whose blocks are rotated differently on its upper and lower face.

Geometry   the whole thickness -H <= x2 <= H; blocks rotated by --upper-deg at x2 = H and --lower-deg at x2 =
           -H. Each plane starts in touch with one corner of every block and moves by delta. Fields depend on
           x2 only; no half of the strip stands for both.
Equations  (10)-(18) in the strip, the corner gaps (21), (22) and conditions (26) at both faces, with their
           own normals.
Model      the depth alone, a 1D mesh of the whole thickness, condensed to how much the strip is squeezed and
           how its faces rotate under a pressure and two micromoments. The pressure is the path's parameter;
           which second corners are closed is tried.
Reference  closed form `TwoFacedStrip`: (44)-(49) for two faces (docs/theory/model.md, "Two faces"); not used
           in the computation.
Look at    two kinks, one for each face whose second corner closes; beside a face rotated the other way a
           block rotates back less.
Units      lengths over H, stresses over mu.
"""

import time
from dataclasses import dataclass
from functools import cached_property

import numpy as np

import microblock as mb
from microblock.data.records import column, grouped
from microblock.fem import meshes
from microblock.fem.body import Loads
from microblock.model.refinement import refine

from ..common.options import Checked, coupling, option, poisson
from ..common.records import print_entries, returned

RTOL = 1e-9
ORDERS = (4, 6, 8, 10, 12, 14, 16)
LAYERS_PER_ELEMENT = 8  # order 16 sees exp(-8) over an element
DOUBLINGS = 3
MOST_ELEMENTS = 2000
FACES = {"upper": ("contact", 1.0), "lower": ("middle", -1.0)}  # boundary of `meshes.line`, depth
SAMPLES = 41  # depths of a profile
APPROACHES = 25  # of the figure, up to PAST the last closing
PAST = 1.4
SLACK = 1e-9  # of forces and rotations next to 0 or their bounds: far above rounding, far below
# what is seen


@dataclass(frozen=True)
class Parameters(Checked):
    upper_deg: float = option(
        1.0,
        "initial rotation of the upper face's blocks in degrees, counterclockwise",
        at_least=-45,
        at_most=45,
    )
    lower_deg: float = option(-0.5, "the same of the lower face's", at_least=-45, at_most=45)
    ell_over_H: float = option(
        0.5, "length scale of the material over half the thickness", at_least=1e-3, at_most=1e3
    )
    nu: float = poisson()
    beta: float = coupling()
    delta_over_H: float = option(
        0.02, "approach of each plane over H, counted from the first touch of both", at_least=0, at_most=1
    )
    curvature: float = option(2.0, "coefficient gamma' of the curvature energy", at_least=1e-6, at_most=1e6)
    rtol: float = option(RTOL, "relative error asked for; chooses order and elements", above=0, below=1)

    @property
    def solid(self):
        """The material in units of mu and H."""
        return mb.Cosserat(
            E=2 * (1 + self.nu), nu=self.nu, ell=self.ell_over_H, beta=self.beta, curvature=self.curvature
        )

    @property
    def psi0(self):
        """psi0 of (upper, lower) in radians."""
        return float(np.radians(self.upper_deg)), float(np.radians(self.lower_deg))


class Strip:
    """A strip on one mesh: what its faces do under loads, and the states of contact that follow.

    A face whose first corner carries p - t and whose second carries t has the micromoment -sign(psi0) (L p -
    ell t) with L = (ell/2)(1 - |psi0|), (29). Its blocks rotate back by r = -sign(psi0) psi, which leaves the
    second corner the gap ell (|psi0| - r), and lets the plane approach by L r more, (21), (22).
    """

    def __init__(self, parameters, order, elements):
        self.parameters, self.order, self.elements = parameters, order, elements
        self.body = mb.Body(
            meshes.line(2.0, elements), parameters.solid, order, fixed={"u1": "middle", "u2": "middle"}
        )
        self.initial = np.abs(parameters.psi0)
        self.sign = np.where(np.array(parameters.psi0) < 0, -1.0, 1.0)
        self.lever = parameters.ell_over_H / 2 * (1 - self.initial)

    @cached_property
    def unit_states(self):
        """Fields under a unit pressure on both faces, and under a unit micromoment on the upper and on the
        lower one.
        """
        loads = (
            Loads(traction={"contact": (0, -1)}),
            *(Loads(micromoment={name: 1}) for name, _ in FACES.values()),
        )
        return [self.body.solve(load) for load in loads]

    def at(self, x2, loads):
        """u1, u2, psi at depths -1 <= x2 <= 1 under (pressure, M upper, M lower), array (3, n)."""
        points = [self.body.mesh(float(one) - 1) for one in np.atleast_1d(x2)]
        return sum(
            load * np.array([[field(point) for point in points] for field in fields])
            for load, fields in zip(loads, self.unit_states)
        )

    @cached_property
    def flexibility(self):
        """(squeeze, r upper, r lower) from (pressure, -sign M upper, -sign M lower), array (3, 3)."""
        ends = [depth for _, depth in FACES.values()]
        columns = [self.at(ends, load) for load in np.eye(3)]
        rows = np.array([(fields[1, 1] - fields[1, 0], *fields[2]) for fields in columns]).T
        signs = np.array([1.0, *-self.sign])
        return signs[:, None] * rows * signs

    def rotations(self, pressure, second):
        """r of both faces and the forces t of the second corners where those of `second`, array (2,) of bool,
        are closed.
        """
        ell, compliance = self.parameters.ell_over_H, self.flexibility[1:, 1:]
        alone = self.flexibility[1:] @ np.array([pressure, *self.lever * pressure])
        force = np.zeros(2)
        if second.any():
            force[second] = np.linalg.solve(
                ell * compliance[np.ix_(second, second)], (alone - self.initial)[second]
            )
        return alone - ell * compliance @ force, force

    @cached_property
    def closings(self):
        """Pressures at which the second corners close, array (2,): between them everything is affine in the
        pressure.
        """
        second = self.initial == 0
        found = np.where(second, 0.0, np.inf)
        while not second.all():
            start, slope = (self.rotations(load, second)[0] for load in (0.0, 1.0))
            slope = slope - start
            ahead = np.where(
                second | (slope <= 0), np.inf, (self.initial - start) / np.where(slope > 0, slope, 1.0)
            )
            first = int(np.argmin(ahead))
            found[first], second = ahead[first], second | (np.arange(2) == first)
        return found

    def approach(self, pressure):
        """delta of a pressure."""
        rotation, loads = self.state(pressure)
        squeeze = self.flexibility[0] @ np.array([pressure, *-self.sign * loads[1:]])
        return (squeeze + self.lever @ rotation) / 2

    def state(self, pressure):
        """r of both faces and the loads (pressure, M upper, M lower)."""
        rotation, force = self.rotations(pressure, pressure >= self.closings)
        slack = SLACK * (pressure or 1.0)
        beyond = rotation > self.initial + SLACK * self.initial.max() + slack
        if (force < -slack).any() or (force > pressure + slack).any() or beyond.any():
            raise mb.NotConverged(f"the corners closed at the pressure {pressure:g} do not meet (26)")
        return rotation, np.array(
            [pressure, *-self.sign * (self.lever * pressure - self.parameters.ell_over_H * force)]
        )

    def pressure(self, delta):
        """The pressure of an approach, by interpolation between the closings, and beyond them."""
        loads = np.array([0.0, *np.sort(self.closings)])
        loads = np.append(loads, loads[-1] + 1.0)
        approaches = np.array([self.approach(load) for load in loads])
        if delta > approaches[-1]:
            slope = (loads[-1] - loads[-2]) / (approaches[-1] - approaches[-2])
            return loads[-1] + (delta - approaches[-1]) * slope
        return float(np.interp(delta, approaches, loads))


def solve(parameters):
    """(Strip, error estimate) to the accuracy asked for."""
    return refine(lambda level: Strip(parameters, *level), refinements(parameters), distance, parameters.rtol)


def refinements(parameters):
    """Orders on a mesh of the layer's scale, then on its halvings."""
    coarsest = max(1, int(np.ceil(2 / (LAYERS_PER_ELEMENT * parameters.solid.layer_length))))
    if coarsest > MOST_ELEMENTS:
        raise mb.NotConverged(
            f"the layer of thickness {parameters.solid.layer_length:.1e} H is too thin for "
            f"{MOST_ELEMENTS} elements; take a larger ell_over_H"
        )
    return ((order, coarsest * 2**doubling) for doubling in range(DOUBLINGS + 1) for order in ORDERS)


def distance(coarse, fine):
    """Relative difference of surface values, forces and closings, and of psi and u over the depth."""
    numbers = [
        np.array([*one["psi"], *one["micromoment"], one["pressure"], *one["delta_fc"]])
        for one in map(observe, (coarse, fine))
    ]
    parts = np.split(np.abs(numbers[1]), (2, 4, 5))  # psi, M, pressure, delta_fc
    scales = np.concatenate([np.full(len(part), part.max() or 1.0) for part in parts])
    loads = observe(fine)["loads"]
    x2 = np.linspace(-1, 1, SAMPLES)
    fields = [one.at(x2, loads) for one in (coarse, fine)]
    sizes = np.abs(fields[1]).max(axis=1)
    return float(
        max(
            np.max(np.abs(numbers[0] - numbers[1]) / scales),
            np.max(np.abs(fields[0] - fields[1]).max(axis=1) / np.where(sizes > 0, sizes, 1.0)),
        )
    )


def observe(strip, delta=None):
    """What a strip shows at an approach, that of its parameters if none is given."""
    delta = strip.parameters.delta_over_H if delta is None else delta
    pressure = strip.pressure(delta)
    rotation, loads = strip.state(pressure)
    second = pressure >= strip.closings
    return {
        "delta": delta,
        "state": ["separation" if delta == 0 else "full" if full else "partial" for full in second],
        "pressure": float(pressure),
        "psi": (-strip.sign * rotation).tolist(),
        "micromoment": loads[1:].tolist(),
        "delta_fc": [float(strip.approach(load)) for load in strip.closings],
        "loads": loads.tolist(),
    }


def reference(parameters, delta=None):
    """The closed form."""
    from microblock.model.closed_forms import TwoFacedStrip  # for verification only

    upper, lower = parameters.psi0
    return TwoFacedStrip(
        parameters.ell_over_H,
        upper,
        lower,
        parameters.nu,
        parameters.beta,
        parameters.delta_over_H if delta is None else delta,
        parameters.curvature,
    )


def errors(parameters, found, profile):
    """Largest relative differences to the closed form, of each over the larger of both faces."""
    exact = reference(parameters)
    pairs = {
        "psi": exact.surface,
        "micromoment": exact.micromoments,
        "pressure": exact.pressure,
        "delta_fc": exact.delta_fc,
    }
    known = {name: (found[name], values) for name, values in pairs.items()}
    for name in ("psi", "u1", "u2"):
        known[f"profile_{name}"] = (profile[name], getattr(exact, name)(profile["x2"]))
    return {
        name: float(np.max(np.abs(np.subtract(*pair))) / (np.max(np.abs(pair[1])) or 1.0))
        for name, pair in known.items()
    }


def result(parameters, quiet=True):
    """The case's object; states along the path beside the one asked for."""
    start = time.perf_counter()
    strip, estimate = solve(parameters)
    found = observe(strip)
    x2 = np.linspace(-1, 1, SAMPLES)
    u1, u2, psi = strip.at(x2, found.pop("loads"))
    profile = {"x2": x2.tolist(), "psi": psi.tolist(), "u1": u1.tolist(), "u2": u2.tolist()}
    last = PAST * max(*found["delta_fc"], parameters.delta_over_H) or 1e-2
    path = [observe(strip, float(delta)) for delta in np.linspace(0, last, APPROACHES)]
    return returned(
        parameters,
        start,
        **found,
        errors=errors(parameters, found, profile),
        error_estimate=estimate,
        order=strip.order,
        elements=strip.elements,
        unknowns=int(sum(strip.body.space.FreeDofs())),
        profile=profile,
        path=[
            {name: value for name, value in one.items() if name not in ("loads", "delta_fc")} for one in path
        ],
    )


def show(answer):
    print("faces: upper, lower")
    print_entries(
        answer,
        (
            "state",
            "psi",
            "micromoment",
            "delta_fc",
            "pressure",
            "unknowns",
            "order",
            "elements",
            "error_estimate",
        ),
    )
    print(
        "over the closed form, minus it: "
        + ", ".join(f"{name} {value:.1e}" for name, value in answer["errors"].items())
    )


def rows(parameters, answer):
    """A row a state of the path and a row a depth of the profile, distinguished by `kind`."""
    blank = dict.fromkeys(
        ("delta", "pressure", "psi_upper", "psi_lower", "M_upper", "M_lower", "x2", "psi", "u1", "u2")
    )
    path = [
        {
            "kind": "path",
            **blank,
            "delta": one["delta"],
            "pressure": one["pressure"],
            **{
                f"{short}_{face}": one[name][number]
                for short, name in (("psi", "psi"), ("M", "micromoment"))
                for number, face in enumerate(FACES)
            },
        }
        for one in answer["path"]
    ]
    profile = [
        {"kind": "profile", **blank, **dict(zip(answer["profile"], node))}
        for node in zip(*answer["profile"].values())
    ]
    return [{**row, "error_estimate": answer["error_estimate"]} for row in path + profile]


def figure(records):
    """A strip whose faces are rotated differently has two breaks, one for each face that comes to lie flat.

    Blocks are rotated by 1 degree at the upper and by -0.5 degrees at the lower face. Microrotation (a) and
    micromoment (b) at both faces over the approach delta of the planes, and the microrotation over the depth
    (c) at the dotted line of (a) and (b), where the lower face lies flat and the upper one does not. Marks:
    computed; lines: closed form.

    Seen: in (a) and (b) two curves of opposite sign that rise and fall up to a break, the lower face's first;
    beyond it the microrotation is constant, the micromoment of the lower face still rises a little until the
    upper face has its break too, and from there on all are constant. In (c) a curve that falls through the
    depth, steepest at the faces, most of all at the upper one.
    """
    from microblock.view import plots

    given = Parameters(**{name: records[0][name] for name in Parameters.__dataclass_fields__})
    kinds = grouped(records, "kind")
    drawing, axes = plots.figure(3, 1, height=1.5)
    _draw_path(axes[:2], kinds["path"], given)
    for axis in axes[:2]:
        axis.axvline(given.delta_over_H, color="0.5", linewidth=0.8, linestyle=":", zorder=0)
    colour = plots.COLOURS[2]
    x2 = np.linspace(-1, 1, 301)
    axes[2].plot(x2, reference(given).psi(x2), color=colour)
    found = column(kinds["profile"], "x2"), column(kinds["profile"], "psi")
    axes[2].plot(*found, "o", color=colour, markersize=3, markerfacecolor="none")
    axes[2].set(ylabel=r"$\psi$ (rad)", xlabel="$x_2/H$", xticks=(-1, -0.5, 0, 0.5, 1))
    plots.letter(axes, "", "", rf"$\delta/H = {given.delta_over_H:g}$")
    return drawing


def _draw_path(axes, rows, given):
    from microblock.view import plots

    deltas = np.linspace(0, rows[-1]["delta"], 301)
    exact = [reference(given, delta) for delta in deltas]
    for number, (face, psi0) in enumerate(zip(FACES, (given.upper_deg, given.lower_deg))):
        style = dict(color=plots.COLOURS[number], markerfacecolor="none")
        label = rf"{face} face, $\psi_0 = {psi0:g}^\circ$"
        axes[0].plot(column(rows, "delta"), column(rows, f"psi_{face}"), plots.MARKERS[number], **style)
        axes[0].plot(deltas, [one.surface[number] for one in exact], **style, zorder=1)
        axes[1].plot(column(rows, "delta"), column(rows, f"M_{face}"), plots.MARKERS[number], **style)
        axes[1].plot(deltas, [one.micromoments[number] for one in exact], **style, zorder=1)
        # right of the line that shows where (c) is
        place = int(np.searchsorted(deltas, min(given.delta_over_H, deltas[-1])))
        value = exact[-1].surface[number]
        plots.label(axes[0], deltas[place], value, label, style["color"], (5, -9 if value > 0 else 12))
    axes[0].set(ylabel=r"$\psi$ (rad)")
    axes[1].locator_params(axis="x", nbins=5)
    axes[1].set(xlabel=r"$\delta/H$", ylabel=r"$M/(\mu H)$")
    axes[0].sharex(axes[1])
    axes[0].tick_params(labelbottom=False)


FIGURES = {"two_faces": (rows, figure)}
