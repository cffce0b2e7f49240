"""Pictures of a contact state that are made once and then only given new data: curves, zones and rotated
blocks.
"""

import math

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.legend_handler import HandlerTuple
from matplotlib.patches import Patch

from ..model.material import hertz
from ..model.sharp import unbounded
from . import blocks, plots

PAGE, SCREEN = (7.0, 7.4), (6.5, 5.5)  # inches: two columns of a page; beside sliders, on 1366 x 768 pixels
PLACES = [["pressure", "micromoment"], ["gap", "turn"], ["zones", "turn"], ["blocks", "blocks"]]
LABELS = {
    "pressure": "pressure\n$p$ (stress)",
    "micromoment": "micromoment\n" r"$M/\ell$ (stress)",
    "gap": "gap\n$g$ (length)",
    "turn": "rotation\n{turn} (deg.)",
}
SYMBOLS = {"pressure": "p", "gap": "g"}
ABOVE, HEIGHT = 0.08, 0.29  # of the picture of blocks, over its width: above the surface, and all of it
# of an axis, below which it ends elsewhere; and what more it then has than needed
LEAST_USE, ROOM = 0.25, 1.7
CORNER_COLOURS = {"A": plots.COLOURS[0], "B": plots.COLOURS[1], "C": plots.COLOURS[6]}
# fills of blocks by which of A and B are closed; the colours of the corners are for what is theirs alone
BLOCK_FILLS = {
    (False, False): "white",
    (True, False): "#CFE4F3",
    (False, True): "#FBDCC4",
    (True, True): "#DCD0E8",
}
PEAK = 4.0  # of the mean pressure, beyond which it is cut off; a cylinder has 1.3
GAP_SHOWN = 0.5  # of the half-width of the contact, beyond it, in which gaps set the end of their axis
TOTAL = {"color": "0.45", "lw": 0.8}  # of the sum of both corners


def look_of(corner):
    """Colour and line of a corner, whatever its name: the same for the same name."""
    colour = CORNER_COLOURS.get(corner, plots.COLOURS[sum(map(ord, corner)) % len(plots.COLOURS)])
    return {"color": colour, "linestyle": "--" if corner == "B" else "-"}


class StateFigure:
    """Pressures, micromoment, corner gaps, rotation, zones and blocks of a state; `update` shows another one
    of the same law.

    `drawing` is the figure, `size` one of PAGE and SCREEN.
    """

    @plots.styled()
    def __init__(self, corners, size=PAGE):
        self.drawing, self.corners, self._ends = plots.Drawing(size, layout="constrained"), corners, {}
        rows = (1.8, 1.8, 0.2 + 0.2 * (len(corners) + (len(corners) == 2)), 3.1)
        self.axes = self.drawing.subplot_mosaic(PLACES, height_ratios=rows)
        for name, other in (("gap", "pressure"), ("turn", "micromoment"), ("zones", "pressure")):
            self.axes[name].sharex(self.axes[other])
        self._lines = {}
        for kind, symbol in SYMBOLS.items():
            for corner in corners:
                label = rf"${symbol}_{{\rm {corner}}}$" if len(corner) > 1 else f"${symbol}_{corner}$"
                self._lines[kind, corner] = self._curve(kind, label=label, **look_of(corner))
        if len(corners) == 2:  # the sum of both corners; of one it would be the same
            self._lines["pressure", "sum"] = self._curve("pressure", label="$p$", **TOTAL)
        for kind in ("micromoment", "turn"):
            self._lines[kind, "sum"] = self._curve(kind, color=plots.COLOURS[2])
        self._hertz = self._curve("pressure", ls=":", color=plots.COLOURS[2], label="Hertz", visible=False)
        self._bars = self._zone_bars()
        self.blocks = BlocksPanel(self.axes["blocks"], corners)
        self._cut = {
            name: self.axes[name].text(
                1, 1.02, "", transform=self.axes[name].transAxes, ha="right", fontsize=6
            )
            for name in ("pressure", "micromoment")
        }
        for name, text in LABELS.items():
            self.axes[name].set_ylabel(text.format(turn=_turn(corners)))
            self.axes[name].locator_params(nbins=4)  # labels are what takes time to draw
            self.axes[name].axhline(0, color="0.85", linewidth=0.6, zorder=0)
            self.axes[name].tick_params(labelbottom=name == "turn")
        for name in ("turn", "zones"):
            self.axes[name].set_xlabel("$x_1$ (length)")
        for kind in SYMBOLS:
            self._explain(kind)

    def _curve(self, kind, **look):
        return self.axes[kind].plot([], [], **look)[0]

    def _zone_bars(self):
        axis, several = self.axes["zones"], len(self.corners) > 1
        names = [*self.corners, "full"] if several else ["contact"]
        words = {corner: f"{corner} closed" for corner in self.corners}
        words |= {"full": "both closed" if len(self.corners) == 2 else "all closed", "contact": "contact"}
        axis.set_yticks(range(len(names)), [words[name] for name in names])
        axis.set_ylim(len(names) - 0.4, -0.6)
        axis.tick_params(axis="y", length=0)
        colours = {corner: look_of(corner)["color"] for corner in self.corners}
        look = {"linewidth": 5, "solid_capstyle": "butt"}
        return {name: self._curve("zones", color=colours.get(name, "k"), **look) for name in names}

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

    @plots.styled()
    def compare(self, shown):
        """Show the pressure of Hertz, of a cylinder under the same load, or no longer; `update` draws it."""
        self._hertz.set_visible(shown)
        self._explain("pressure")

    def update(self, state, window=None):
        """Show a state; `window` (left, right) of x1, or the contact and its surroundings."""
        ell, zones = state.solid.ell, state.solution.zones_by_name
        contact = zones["contact"]
        x = self._held({"curves": _around(contact, ell), "blocks": blocks.window(ell, contact)}, _about)
        wide, near = window or x["curves"], x["blocks"]
        surface = blocks.without_rounding(state.surface((min(wide[0], near[0]), max(wide[1], near[1]))))
        total, moment = surface.pressures.sum(axis=0), surface.micromoment / surface.ell
        sums = {"pressure": total, "micromoment": moment, "turn": np.degrees(surface.rotation)}
        of_corners = {"pressure": surface.pressures, "gap": surface.gaps}
        for (kind, corner), line in self._lines.items():
            own = sums[kind] if corner == "sum" else of_corners[kind][self.corners.index(corner)]
            line.set_data(*blocks.interrupted(surface, surface.x, np.where(np.isfinite(own), own, np.nan)))
        for number, (name, bar) in enumerate(self._bars.items()):
            edges = [edge for a, b in zones[name] for edge in (a, b, math.nan)]
            bar.set_data(edges, np.full(len(edges), number))
        if self.compared:  # the ellipse of a classical half-plane of the same E*, under the same load
            half = math.sqrt(4 * state.load * state.obstacle.R / (math.pi * state.solid.E_star))
            places = half * np.sin(np.linspace(-math.pi / 2, math.pi / 2, 101))
            self._hertz.set_data(places, hertz(places, state.load, half))
        # a surface on a mesh may end sooner
        ends = max(wide[0], surface.x[0]), min(wide[1], surface.x[-1])
        self._limit(surface, sums, contact, ends, unbounded(state))
        self.blocks.show(blocks.blocks(surface, contact, blocks.within(near, surface)))
        return self

    def _held(self, needed, widened):
        """Ends {name: (low, high)} of axes: those before while they fit, for the eye to hold on to; else all
        anew, ``widened(low, high, room)``.
        """
        before = {name: self._ends.get(name, (math.nan, math.nan)) for name in needed}
        if not all(_fit(before[name], ends) for name, ends in needed.items()):
            room = ROOM if needed.keys() <= self._ends.keys() else 1.0
            self._ends |= {name: widened(*ends, room) for name, ends in needed.items()}
        return {name: self._ends[name] for name in needed}

    def _limit(self, surface, sums, contact, window, places):
        """Ends of all axes; where one ends below what it should show, words say so, and why."""
        shown = (surface.x >= window[0]) & (surface.x <= window[1])
        # at the ends of a punch the pressure is infinite
        wide = max(sum(right - left for left, right in contact), 1e-300)
        most = PEAK * np.trapezoid(sums["pressure"], surface.x) / wide
        gaps = surface.gaps[:, shown]
        gaps = gaps[np.isfinite(gaps) & (gaps > blocks.CLOSED * np.ptp(surface.displacement))]
        peak = self._hertz.get_ydata().max(initial=0.0) if self.compared else 0.0
        needed = {
            "pressure": (0.0, np.minimum(sums["pressure"][shown], most).max(initial=peak)),
            "gap": (0.0, gaps.max(initial=0.0)),
            "micromoment": _both_sides(np.clip(sums["micromoment"][shown], -most, most)),
            "turn": _both_sides(sums["turn"][shown]),
        }
        for name, ends in self._held(needed, _rounded).items():
            self.axes[name].set(xlim=window, ylim=ends)
        for name, text in self._cut.items():
            top, ends = np.abs(sums[name][shown]).max(initial=0.0), np.abs(self.axes[name].get_ylim())
            why = f"unbounded at {_listed(places)}" if len(places) else f"largest {top:.3g}"
            # next to such a place a curve may also end below the end of its axis
            text.set_text(f"cut: {why}" if top > ends.max() else why if len(places) and top > 0 else "")

    @property
    def moving(self):
        """[artist] of what a new state changes, in the order of drawing."""
        lines = *self._lines.values(), *self._bars.values(), self._hertz, *self._cut.values()
        return [*lines, *self.blocks.moving]

    @property
    def still(self):
        """What all has to be drawn anew for: ends of axes and words; heights of blocks have no labels."""
        ends = [(*axis.get_xlim(), *axis.get_ylim()) for name, axis in self.axes.items() if name != "blocks"]
        return ends, self.axes["blocks"].get_xlim(), self.axes["blocks"].get_title("left"), self.compared


class BlocksPanel:
    """Blocks, surface and obstacle on an Axes."""

    def __init__(self, axis, corners):
        self.axis, self.corners = axis, corners
        look = {"edgecolor": "0.35", "linewidth": 0.8}
        self._squares = axis.add_collection(PolyCollection([], facecolor="white", **look))
        self._obstacle = axis.add_collection(
            PolyCollection([], facecolor="0.75", edgecolor="k", linewidth=0.8, zorder=0.5)
        )
        (self._surface,) = axis.plot([], [], color="k", linewidth=0.7)
        # a circle around a square: both are seen where two blocks meet
        marks = ("B", {"marker": "s", "ms": 3}), ("A", {"marker": "o", "ms": 6, "mfc": "none"})
        self._dots = {
            name: axis.plot([], [], color=look_of(name)["color"], ls="none", **mark)[0]
            for name, mark in marks
        }
        self._title = axis.set_title("", loc="left")
        axis.set(aspect="equal", xlabel="$x_1$ (length)")
        axis.tick_params(axis="y", left=False, labelleft=False)
        axis.spines["left"].set_visible(False)
        if len(corners) == 2:
            keys = {"A (left)": (True, False), "B (right)": (False, True), "both closed": (True, True)}
            fills = [Patch(facecolor=BLOCK_FILLS[closed], **look) for closed in keys.values()]
            axis.legend(
                [(fills[0], self._dots["A"]), (fills[1], self._dots["B"]), (fills[2],)],
                keys,
                handler_map={tuple: HandlerTuple(ndivide=1)},
                loc="lower right",
                ncols=3,
                borderaxespad=0.1,
                columnspacing=0.8,
                handlelength=1.4,
                handletextpad=0.4,
            )

    def show(self, shown):
        """Show other Blocks; heights from the uppermost point of the surface on."""
        left, right = shown.window
        width = right - left
        top = np.nanmax(shown.surface[:, 1], initial=shown.squares[..., 1].max(initial=-math.inf))
        down = np.array((0.0, top))
        self._squares.set_verts(shown.squares - down)
        self._squares.set_facecolor([_fill(closed) for closed in shown.closed])
        self._surface.set_data(*(shown.surface - down).T)
        self._obstacle.set_verts([_under(piece - down, ABOVE * width) for piece in _pieces(shown.obstacle)])
        for vertex, name in enumerate("AB"):
            if name in self.corners:
                touching = shown.closed[:, self.corners.index(name)]
                self._dots[name].set_data(*(shown.squares[touching, vertex] - down).T)
        self.axis.set(xlim=(left, right), ylim=((ABOVE - HEIGHT) * width, ABOVE * width))
        touches = "" if len(self.corners) == 2 else "; their middle touches"
        words = f"blocks: {_turn(self.corners)} and heights {shown.magnification:g} times{touches}"
        self._title.set_text(words)

    @property
    def moving(self):
        return [self._obstacle, self._squares, self._surface, *self._dots.values()]


@plots.styled()
def draw_blocks(axis, state, window=None):
    """The figure of an axis, or of none a new one, into which the rotated blocks are drawn."""
    drawing, axis = plots.in_place(axis, width=PAGE[0], height=3.1)
    contact = state.zones["contact"]
    surface = state.surface(window or blocks.window(state.solid.ell, contact))
    BlocksPanel(axis, tuple(state.pressures)).show(blocks.blocks(surface, contact, window))
    return drawing


@plots.styled()
def draw_curves(axis, state, window=None):
    """The figure of an axis, into which pressures and the micromoment of a state are drawn."""
    drawing, axis = plots.in_place(axis)
    surface = state.surface(window or _around(state.zones["contact"], state.solid.ell))
    curves = {
        rf"$p_{{\rm {name}}}$": (row, look_of(name)) for name, row in zip(surface.corners, surface.pressures)
    }
    if len(curves) > 1:
        curves["$p$"] = surface.pressures.sum(axis=0), TOTAL
    curves[r"$M/\ell$"] = surface.micromoment / surface.ell, {"color": plots.COLOURS[2], "linestyle": ":"}
    for label, (row, look) in curves.items():
        axis.plot(*blocks.interrupted(surface, surface.x, row), label=label, **look)
    axis.set(xlabel="$x_1$ (length)", ylabel="stress")
    axis.legend(loc="lower center", bbox_to_anchor=(0.5, 1), ncols=len(curves))
    return drawing


def _fit(ends, needed):
    """Whether what is needed lies within the ends and uses them well, or is nothing."""
    use = needed[1] - needed[0]
    used = not use or use >= LEAST_USE * (ends[1] - ends[0])
    return ends[0] <= needed[0] and needed[1] <= ends[1] and used


def _about(left, right, room):
    more = (room - 1) * (right - left) / 2
    return left - more, right + more


def _rounded(low, high, room):
    """Round numbers that have room for both; from 0 to 1 where there is nothing to show."""
    return -_nice(-room * low), _nice(room * high) or 1.0


def _both_sides(values):
    """Least and largest value, and a tenth of the larger one at least to either side of zero."""
    size = np.abs(values).max(initial=0.0) / 10
    return values.min(initial=-size), values.max(initial=size)


def _nice(value):
    """The next number above of which the second digit is 0 or 5."""
    if not value > 0:
        return 0.0
    decade = 10.0 ** np.floor(np.log10(value))
    return float(decade * np.ceil(2.06 * value / decade) / 2)


def _fill(closed):
    """The colour of a block by its closed corners; of laws with others than two it tells all from some."""
    if len(closed) != 2:
        closed = closed.all(), closed.all()
    return BLOCK_FILLS[tuple(map(bool, closed))]


def _listed(places):
    shown = [float(f"{place:.3g}") for place in places]
    pairs = (f"\u00b1{abs(at):g}" if at and -at in shown else f"{at:g}" for at in shown)
    words = list(dict.fromkeys(pairs))
    return ", ".join(words[:3]) + (", ..." if len(words) > 3 else "")


def _around(contact, ell):
    if not len(contact):
        return -ell, ell
    margin = GAP_SHOWN * (contact[-1][1] - contact[0][0]) / 2 + 1.5 * ell
    return contact[0][0] - margin, contact[-1][1] + margin


def _turn(corners):
    return r"$\psi_0 + \psi$" if len(corners) == 2 else r"$\psi$"


def _pieces(line):
    """A line cut where it is nan: [array (n, 2), ...]."""
    known = np.isfinite(line[:, 1])
    cuts = np.flatnonzero(np.diff(known.astype(int))) + 1
    return [piece for piece in np.split(line, cuts) if len(piece) > 1 and np.isfinite(piece[0, 1])]


def _under(piece, top):
    """The obstacle as an area from its surface up to the top of the picture, which cuts off what is above."""
    ends = (piece[-1, 0], 1e3 * top), (piece[0, 0], 1e3 * top)
    return np.concatenate((piece, ends))
