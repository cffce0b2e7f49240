"""Pictures of a contact state that are made once and then only given new data: curves, zones and rotated
blocks.
"""

import math
from collections import defaultdict
from dataclasses import dataclass, field

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.legend_handler import HandlerTuple
from matplotlib.patches import Patch

from ..model.closed_forms import hertz
from ..model.sharp import unbounded
from . import blocks, plots


@dataclass(frozen=True)
class Format:
    """Size of a StateFigure (inches) and its panels.

    Attributes
    ----------
    size : (width, height)
    above, height : float, of the picture of blocks, over its width: above the surface, and all of it
    ticks : int, intervals on an axis, at most
    places : {panel: (left, bottom, width, height)} (inches), or None where matplotlib lays them out
    zones_under : panel with whose x1 the zones go, or None
    beside : {panel: from its left side to the label of its vertical axis (inches)}; others follow the numbers
    labels : {panel: label of the vertical axis}, the others' are those of `LABELS`
    """

    size: tuple
    above: float
    height: float
    ticks: int
    places: dict | None = None
    zones_under: str | None = None
    beside: dict = field(default_factory=dict)
    labels: dict = field(default_factory=dict)


LABELS = {
    "pressure": "pressure $p$ (stress)",
    "micromoment": r"$M/\ell$ (stress)",
    "gap": "{gap} $g$ (length)",
    "turn": "rotation {turn} (degrees)",
}
PAGE = Format((7.0, 7.4), above=0.1, height=0.33, ticks=5, zones_under="pressure")  # two columns of a page
# beside sliders: all of it is in view on 1366 x 768 pixels
SCREEN = Format(
    (6.5, 5.5),
    above=0.07,
    height=0.275,
    ticks=4,
    places={
        "pressure": (0.9, 4.31, 2.38, 0.95),
        "micromoment": (4.03, 4.31, 2.38, 0.95),
        "gap": (0.9, 3.13, 2.38, 0.95),
        "turn": (4.03, 3.13, 2.38, 0.95),
        "zones": (0.9, 2.67, 2.38, 0.38),
        "blocks": (0.25, 0.4, 6.0, 1.65),
    },
    zones_under="pressure",
    beside={"pressure": 0.54, "gap": 0.54, "micromoment": 0.41, "turn": 0.41},
    labels={
        "pressure": "pressure\n$p$ (stress)",
        "gap": "{gap}\n$g$ (length)",
        "turn": "rotation\n{turn} (deg.)",
    },
)
# of an axis, below which it ends elsewhere; and what more it then has than needed
LEAST_USE, ROOM = 0.25, 1.7
LITTLE_ROOM = 1.2  # the same beyond the ends of a surface, where there is nothing to see
# ends of axes, times a power of ten
STEPS = np.array((1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0))
CORNER_COLOURS = {"A": plots.COLOURS[0], "B": plots.COLOURS[1], "C": plots.COLOURS[6]}
# fills of blocks by which of A and B are closed; the colours of the corners are for what is theirs alone
BLOCK_FILLS = {
    (False, False): "white",
    (True, False): "#CFE4F3",
    (False, True): "#FBDCC4",
    (True, True): "#DCD0E8",
}
BLOCK_EDGE = "0.35"
CORNER_LINES = {"A": "-", "B": "--", "C": "-"}  # distinguished without colours
PEAK = 4.0  # of the mean pressure, beyond which it is cut off; a cylinder has 1.3
SMALL = 6  # letters that say so, points
GAP_SHOWN = 0.5  # of the half-width of the contact, beyond it, in which gaps set the end of their axis
OUT_OF_CONTACT = "0.85"
MOST_TOLD = 3  # places that are listed
HERTZ_POINTS = 101  # of its ellipse
CLOSED = 1e-6  # of the range of displacements: gaps that are rounding


def colour_of(corner):
    """The colour of a corner, whatever its name: the same for the same name."""
    return CORNER_COLOURS.get(corner, plots.COLOURS[sum(map(ord, corner)) % len(plots.COLOURS)])


class StateFigure:
    """Pressures, micromoment, corner gaps, rotation, zones and blocks of a state; `update` shows another one
    of the same law.

    `drawing` is the figure, `format` one of PAGE and SCREEN.
    """

    def __init__(self, corners, format=PAGE):
        with plots.styled():
            self.drawing, self.axes = _panels(format, len(corners))
            self.corners, self._format = corners, format
            self._lines = {name: self._curve(name) for name in ("micromoment", "turn")}
            self._own = {
                (kind, corner): self._curve(kind, corner)
                for kind in ("pressure", "gap")
                for corner in corners
            }
            self._total = []  # the sum of both corners; of one it would be the same
            if len(corners) == 2:
                self._total = self.axes["pressure"].plot([], [], color="0.45", linewidth=0.8, label="$p$")
            self._hertz = self.axes["pressure"].plot([], [], ":", color=plots.COLOURS[2], label="Hertz")[0]
            self._hertz.set_visible(False)
            self._bars = self._zone_bars()
            self.blocks = BlocksPanel(self.axes["blocks"], corners, format)
            self._ends, self._frames = defaultdict(End), {"blocks": Window(), "curves": Window()}
            self._shown = {"blocks": Window(), "curves": Window()}
            above = 1.02 if format.places else 1.13  # the key, which it meets where the panel is narrow
            self._cut = {
                name: self.axes[name].text(
                    1, above, "", transform=self.axes[name].transAxes, ha="right", fontsize=SMALL
                )
                for name in ("pressure", "micromoment")
            }
            self._label()

    def _curve(self, kind, corner=None):
        colour = colour_of(corner) if corner else plots.COLOURS[2]
        label = (
            rf"${'p' if kind == 'pressure' else 'g'}_{{\rm {corner}}}$"
            if corner and len(corner) > 1
            else (rf"${'p' if kind == 'pressure' else 'g'}_{corner}$" if corner else None)
        )
        return self.axes[kind].plot([], [], CORNER_LINES.get(corner, "-"), color=colour, label=label)[0]

    def _zone_bars(self):
        axis = self.axes["zones"]
        several = len(self.corners) > 1
        names = [*self.corners, "full"] if several else ["contact"]
        words = {"full": "both closed" if len(self.corners) == 2 else "all closed", "contact": "contact"}
        words |= {corner: f"{corner} closed" for corner in self.corners}
        colours = {"full": plots.COLOURS[6], "contact": plots.COLOURS[6]}
        colours |= {corner: colour_of(corner) for corner in self.corners if several}
        bars = {
            name: axis.plot([], [], color=colours[name], linewidth=5, solid_capstyle="butt")[0]
            for name in names
        }
        axis.set_yticks(range(len(names)), [words[name] for name in names])
        axis.set_ylim(len(names) - 0.4, -0.6)
        axis.tick_params(axis="y", length=0)
        return bars

    def _label(self):
        words = {"gap": "corner gap" if len(self.corners) == 2 else "gap", "turn": _turn(self.corners)}
        below = self._format.zones_under
        for name, text in (LABELS | self._format.labels).items():
            self.axes[name].set(ylabel=text.format(**words))
            if name in self._format.beside:
                width = self._format.places[name][2]
                self.axes[name].yaxis.set_label_coords(-self._format.beside[name] / width, 0.5)
            self.axes[name].locator_params(nbins=self._format.ticks)  # labels are what takes time to draw
            if name == "turn" or (name == "gap" and not below):
                self.axes[name].set_xlabel("$x_1$ (length)")
            else:
                self.axes[name].tick_params(labelbottom=False)
            self.axes[name].axhline(0, color=OUT_OF_CONTACT, linewidth=0.6, zorder=0)
        self.axes["zones"].set_xlabel("$x_1$ (length)")
        for name in ("pressure", "gap"):
            self._explain(name)

    def _explain(self, name):
        """The legend of the lines of a panel, above it, where there are several."""
        lines = [line for line in self.axes[name].lines if line.get_visible() and line.get_label()[0] != "_"]
        self.axes[name].legend(
            handles=lines if len(lines) > 1 else [],
            loc="lower left",
            bbox_to_anchor=(0, 1),
            ncols=4,
            borderaxespad=0.3,
            borderpad=0.0,
            handlelength=1.1,
            columnspacing=0.5,
            handletextpad=0.25,
        )

    @property
    def compared(self):
        """Whether the pressure of Hertz is shown beside that of the state."""
        return self._hertz.get_visible()

    def compare(self, shown):
        """Show the pressure of Hertz, of a cylinder under the same load, or no longer; `update` draws it."""
        self._hertz.set_visible(shown)
        with plots.styled():
            self._explain("pressure")

    def update(self, state, window=None):
        """Show a state; `window` (left, right) of x1, or the contact and its surroundings."""
        ell, zones = state.solid.ell, state.solution.zones_by_name
        needed = {"blocks": blocks.window(ell, zones["contact"]), "curves": _around(zones["contact"], ell)}
        self._renewed = not all(self._frames[name].fits(frame) for name, frame in needed.items())
        # then everything at once: the eye, and the clock, have one jump instead of several
        if self._renewed:
            for name, frame in needed.items():
                self._frames[name].renew(frame)
        near, wide = self._frames["blocks"].value, window or self._frames["curves"].value
        surface = blocks.without_rounding(state.surface((min(wide[0], near[0]), max(wide[1], near[1]))))
        self._draw(surface, zones)
        if self.compared:
            self._draw_hertz(state)
        # a surface on a mesh may end sooner, and elsewhere in each state
        ends = max(wide[0], surface.x[0]), min(wide[1], surface.x[-1])
        self._limit(surface, zones["contact"], self._kept("curves", wide, ends))
        self._tell_cuts(surface, unbounded(state))
        near = self._kept("blocks", near, blocks.within(near, surface))
        self.blocks.update(blocks.blocks(surface, zones["contact"], near))
        return self

    def _kept(self, name, whole, ends):
        """(left, right) of a panel: the whole where the surface has it, else a frame around its ends that
        stays while they fit.
        """
        frame = self._shown[name]
        if ends == whole:
            frame.value = whole
        elif self._renewed or not frame.fits(ends):
            frame.renew(ends, LITTLE_ROOM)
            frame.value = max(frame.value[0], whole[0]), min(frame.value[1], whole[1])
        return frame.value

    def _draw_hertz(self, state):
        """The ellipse of a classical half-plane of the same E*, under the same load."""
        half = math.sqrt(4 * state.load * state.obstacle.R / (math.pi * state.solid.E_star))
        x = half * np.sin(np.linspace(-math.pi / 2, math.pi / 2, HERTZ_POINTS))
        self._hertz.set_data(x, hertz(x, state.load, half))

    def _draw(self, surface, zones):
        def draw(line, values):
            line.set_data(*blocks.interrupted(surface, surface.x, values))

        for kind, rows in (
            ("pressure", surface.pressures),
            ("gap", np.where(np.isfinite(surface.gaps), surface.gaps, np.nan)),
        ):
            for corner, row in zip(self.corners, rows):
                draw(self._own[kind, corner], row)
        for total in self._total:
            draw(total, surface.pressures.sum(axis=0))
        draw(self._lines["micromoment"], surface.micromoment / surface.ell)
        draw(self._lines["turn"], np.degrees(surface.rotation))
        for number, (name, bar) in enumerate(self._bars.items()):
            bar.set_data(
                [edge for a, b in zones[name] for edge in (a, b, math.nan)],
                np.full(3 * len(zones[name]), number),
            )

    def _limit(self, surface, contact, window):
        """Ends of all axes: kept while they fit, so that the eye has something to hold on to."""
        shown = (surface.x >= window[0]) & (surface.x <= window[1])
        for name in ("pressure", "micromoment", "gap", "turn", "zones"):
            _limited(self.axes[name], "x", window)
        gaps, turn = surface.gaps[:, shown], np.degrees(surface.rotation[shown])
        gaps = gaps[np.isfinite(gaps) & (gaps > CLOSED * np.ptp(surface.displacement))]
        pressure = surface.pressures.sum(axis=0)
        # at the ends of a punch the pressure is infinite
        most = (
            PEAK
            * np.trapezoid(pressure, surface.x)
            / max(sum(right - left for left, right in contact), 1e-300)
        )
        least = self._hertz.get_ydata().max(initial=0.0) if self.compared else 0.0
        for name, values, low in (("pressure", np.minimum(pressure[shown], most), least), ("gap", gaps, 0.0)):
            end = self._ends[name].holding(values.max(initial=low), self._renewed)
            _limited(self.axes[name], "y", (0.0, end))
        for name, values in (
            ("micromoment", np.clip(surface.micromoment[shown] / surface.ell, -most, most)),
            ("turn", turn),
        ):
            size = np.abs(values).max(initial=0.0)
            low, high = (
                side.holding(max(size / 10, (sign * values).max(initial=0.0)), self._renewed)
                for sign, side in ((-1, self._ends[name, "low"]), (1, self._ends[name, "high"]))
            )
            _limited(self.axes[name], "y", (-low, high))

    def _tell_cuts(self, surface, places):
        """Say where an axis or a curve ends below what it should show, and why."""
        curves = {
            "pressure": surface.pressures.sum(axis=0),
            "micromoment": np.abs(surface.micromoment) / surface.ell,
        }
        for name, values in curves.items():
            (left, right), ends = self.axes[name].get_xlim(), np.abs(self.axes[name].get_ylim())
            top = values[(surface.x >= left) & (surface.x <= right)].max(initial=0.0)
            why = f"unbounded at {_listed(places)}" if places else f"largest {top:.3g}"
            # next to such a place a curve may also end below the end of its axis
            told = f"cut: {why}" if top > ends.max() else why if places and top > 0 else ""
            self._cut[name].set_text(told)

    @property
    def moving(self):
        """[(axes, artist)] of what a new state changes, in the order of drawing."""
        lines = [
            *self._lines.values(),
            *self._own.values(),
            *self._bars.values(),
            *self._total,
            self._hertz,
            *(text for text in self._cut.values() if text.get_text()),
        ]
        return [(line.axes, line) for line in lines if line.get_visible()] + self.blocks.moving

    @property
    def still(self):
        """{panel: (ends of its axes, words)}: what it has to be drawn anew for, beside `moving`."""
        ends = {name: (*axis.get_xlim(), *axis.get_ylim()) for name, axis in self.axes.items()}
        words = {"blocks": self.blocks.title}
        # heights of the blocks have no labels
        return {name: (ends[name][: 2 if name == "blocks" else 4], words.get(name, "")) for name in ends}


def _panels(format, corners):
    """(drawing, {name: axes}) without content."""
    drawing = plots.Drawing(figsize=format.size, layout=None if format.places else "constrained")
    if format.places:
        wide, high = format.size
        places = {
            name: (left / wide, bottom / high, width / wide, height / high)
            for name, (left, bottom, width, height) in format.places.items()
        }
        add = drawing.add_axes
    else:
        grid = drawing.add_gridspec(4, 2, height_ratios=(2, 2, 0.2 + 0.2 * (corners + (corners == 2)), 2.7))
        places = {
            "pressure": grid[0, 0],
            "micromoment": grid[0, 1],
            "gap": grid[1, 0],
            "turn": grid[1, 1],
            "zones": grid[2, 0],
            "blocks": grid[3, :],
        }
        add = drawing.add_subplot
    above, axes = {"gap": "pressure", "turn": "micromoment", "zones": format.zones_under}, {}
    for name, place in places.items():
        axes[name] = add(place, sharex=axes.get(above.get(name)))
    return drawing, axes


class BlocksPanel:
    """Blocks, surface and obstacle on an Axes."""

    def __init__(self, axis, corners, format=PAGE):
        self.axis, self.corners, self._format = axis, corners, format
        self._squares = axis.add_collection(
            PolyCollection([], facecolor="white", edgecolor=BLOCK_EDGE, linewidth=0.8)
        )
        self._obstacle = axis.add_collection(
            PolyCollection([], facecolor="0.75", edgecolor="k", linewidth=0.8, zorder=0.5)
        )
        self._surface = axis.plot([], [], color="k", linewidth=0.7)[0]
        # a circle around a square: both are seen where two blocks meet
        self._corners = [
            axis.plot(
                [],
                [],
                marker,
                color=colour_of(name),
                markersize=size,
                markerfacecolor=face,
                zorder=zorder,
                linestyle="none",
                label=f"{name} ({side}) closed",
            )[0]
            for name, side, marker, size, face, zorder in (
                ("A", "left", "o", 6, "none", 4),
                ("B", "right", "s", 3, None, 3),
            )
        ]
        axis.set(aspect="equal", xlabel="$x_1$ (length)")
        axis.tick_params(axis="y", left=False, labelleft=False)
        axis.spines["left"].set_visible(False)
        self._title = axis.text(0, 1.02, "", transform=axis.transAxes)
        # two lines where the figure may be made as narrow as a column
        self._lines, columns = (" ", 3) if format.places else ("\n", 1)
        if len(corners) == 2:
            self._explain(columns)

    def _explain(self, columns):
        """The key to marks and fills, above the picture."""
        fills = [
            Patch(facecolor=BLOCK_FILLS[closed], edgecolor=BLOCK_EDGE, linewidth=0.8)
            for closed in ((True, False), (False, True), (True, True))
        ]
        marks = [(fill, *dots) for fill, dots in zip(fills, [*([dots] for dots in self._corners), []])]
        self.axis.legend(
            marks,
            ["A (left)", "B (right)", "both closed"],
            handler_map={tuple: HandlerTuple(ndivide=1)},
            loc="lower right",
            bbox_to_anchor=(1, 1),
            ncols=columns,
            borderaxespad=0.1,
            labelspacing=0.2,
            columnspacing=0.8,
            handlelength=1.4,
            handletextpad=0.4,
        )

    def update(self, shown):
        """Show other Blocks; heights from the uppermost point of the surface on."""
        left, right = shown.window
        width = right - left
        top = np.nanmax(shown.surface[:, 1], initial=shown.squares[..., 1].max(initial=-math.inf))
        down, above = np.array((0.0, top)), self._format.above
        self._squares.set_verts(shown.squares - down)
        self._squares.set_facecolor([_fill(closed) for closed in shown.closed])
        self._surface.set_data(*(shown.surface - down).T)
        self._obstacle.set_verts([_under(piece - down, above * width) for piece in _pieces(shown.obstacle)])
        for vertex, (name, dots) in enumerate(zip("AB", self._corners)):
            if name in self.corners:
                touching = shown.closed[:, self.corners.index(name)]
                dots.set_data(*(shown.squares[touching, vertex] - down).T)
        _limited(self.axis, "x", (left, right))
        _limited(self.axis, "y", ((above - self._format.height) * width, above * width))
        touches = "" if len(self.corners) == 2 else "; their middle touches"
        self._title.set_text(
            f"blocks rotated by {_turn(self.corners)}{touches};{self._lines}heights and angles "
            f"{shown.magnification:g} times"
        )
        return self

    @property
    def title(self):
        return self._title.get_text()

    @property
    def moving(self):
        artists = self._obstacle, self._squares, self._surface, *self._corners[::-1]
        return [(self.axis, artist) for artist in artists]


@plots.styled()
def draw_pressures(axis, state, window=None):
    """The figure of an axis, into which the pressures of the corners of a state are drawn."""
    drawing, axis = plots.in_place(axis)
    surface = state.surface(window or _around(state.zones["contact"], state.solid.ell))
    for corner, row in zip(surface.corners, surface.pressures):
        look = {"color": colour_of(corner), "linestyle": CORNER_LINES.get(corner, "-")}
        axis.plot(*blocks.interrupted(surface, surface.x, row), **look, label=rf"$p_{{\rm {corner}}}$")
    axis.set(xlabel="$x_1$ (length)", ylabel=LABELS["pressure"])
    return drawing


class BlocksFigure:
    """The rotated blocks alone; as `StateFigure`."""

    def __init__(self, corners, axis=None):
        with plots.styled():
            self.drawing, axis = plots.in_place(axis, width=PAGE.size[0], height=3.6)
            self.panel = BlocksPanel(axis, corners)

    def update(self, state, window=None):
        contact = state.solution.zones_by_name["contact"]
        surface = state.surface(window or blocks.window(state.solid.ell, contact))
        self.panel.update(blocks.blocks(surface, contact, window))
        return self


class End:
    """The end of an axis that starts at 0: a round number, kept while values use it well."""

    value = None

    def holding(self, needed, renew):
        """The end for what is needed; `renew` where the panel is drawn anew anyway."""
        if self.value is None:
            self.value = _nice(needed)
        elif renew or not self.value * LEAST_USE <= needed <= self.value:
            self.value = _nice(ROOM * needed)
        return self.value


class Window:
    """(left, right) as `value`: tight at first, then with room."""

    value = None

    def fits(self, needed):
        """Whether what is needed is within and uses it well."""
        if self.value is None:
            return False
        left, right = self.value
        return (
            left <= needed[0] and needed[1] <= right and needed[1] - needed[0] >= LEAST_USE * (right - left)
        )

    def renew(self, needed, room=ROOM):
        more = 0.0 if self.value is None else (room - 1) * (needed[1] - needed[0]) / 2
        self.value = needed[0] - more, needed[1] + more


def _fill(closed):
    """The colour of a block by its closed corners; of laws with others than two it tells all from some."""
    if len(closed) != 2:
        closed = closed.all(), closed.all()
    return BLOCK_FILLS[tuple(map(bool, closed))]


def _limited(axis, side, ends):
    """Give the x or y axis of a panel its ends; the same ones again would cost a millisecond each."""
    if tuple(getattr(axis, f"get_{side}lim")()) != tuple(ends):
        getattr(axis, f"set_{side}lim")(*ends)


def _listed(places):
    shown = [float(f"{place:.3g}") for place in places]
    words = list(
        dict.fromkeys(
            f"\u00b1{abs(place):g}" if place and -place in shown else f"{place:g}" for place in shown
        )
    )
    return ", ".join(words[:MOST_TOLD]) + (", ..." if len(words) > MOST_TOLD else "")


def _around(contact, ell):
    if not len(contact):
        return -ell, ell
    margin = GAP_SHOWN * (contact[-1][1] - contact[0][0]) / 2 + 1.5 * ell
    return contact[0][0] - margin, contact[-1][1] + margin


def _turn(corners):
    return r"$\psi_0 + \psi$" if len(corners) == 2 else r"$\psi$"


def _nice(value):
    """The next round number above."""
    if not value > 0:
        return 1.0
    decade = 10.0 ** np.floor(np.log10(value))
    return float(decade * STEPS[np.searchsorted(STEPS, min(1.03 * value / decade, 10.0))])


def _pieces(line):
    """A line cut where it is nan: [array (n, 2), ...]."""
    known = np.isfinite(line[:, 1])
    cuts = np.flatnonzero(np.diff(known.astype(int))) + 1
    return [piece for piece in np.split(line, cuts) if len(piece) > 1 and np.isfinite(piece[0, 1])]


def _under(piece, top):
    """The obstacle as an area from its surface up to the top of the picture, without what lies above that on
    either side.
    """
    below = np.flatnonzero(piece[:, 1] < top)
    if not len(below):
        return np.empty((0, 2))
    piece = piece[max(below[0] - 1, 0) : below[-1] + 2].copy()
    for end, inner in ((0, 1), (-1, -2)):
        if piece[end, 1] > top:
            piece[end] = piece[inner] + (piece[end] - piece[inner]) * (top - piece[inner, 1]) / (
                piece[end, 1] - piece[inner, 1]
            )
    low = np.minimum(piece[:, 1], top)
    return np.concatenate((np.column_stack((piece[:, 0], low)), [(piece[-1, 0], top), (piece[0, 0], top)]))
