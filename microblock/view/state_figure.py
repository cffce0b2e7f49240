"""Pictures of a contact state that are made once and then only given new data: curves, zones and rotated
blocks.
"""

import math
from collections import defaultdict

import matplotlib
import numpy as np
from matplotlib.collections import PolyCollection

from . import blocks, plots

SIZE = 7.0, 7.4  # inches, two columns of a page
# of the picture of blocks, over its width: all of it, and above the surface
BLOCKS_HEIGHT, ABOVE = 0.33, 0.1
# of an axis, below which it ends elsewhere; and what more it then has than needed
LEAST_USE, ROOM = 0.25, 1.7
# ends of axes, times a power of ten
STEPS = np.array((1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0))
CORNER_COLOURS = {"A": plots.COLOURS[0], "B": plots.COLOURS[1], "C": plots.COLOURS[6]}
CORNER_LINES = {"A": "-", "B": "--", "C": "-"}  # distinguished without colours
PEAK = 4.0  # of the mean pressure, beyond which it is cut off; a cylinder has 1.3
SMALL = 6  # letters that say so, points
TICKS = 5  # intervals on an axis, at most
GAP_SHOWN = 0.5  # of the half-width of the contact, beyond it, in which gaps set the end of their axis
OUT_OF_CONTACT = "0.85"
NEAR = 1e-6  # of ell, to which the edge of a zone is at an end of the obstacle
MOST_TOLD = 3  # places that are listed
CLOSED = 1e-6  # of the range of displacements: gaps that are rounding


def colour_of(corner):
    """The colour of a corner, whatever its name: the same for the same name."""
    return CORNER_COLOURS.get(corner, plots.COLOURS[sum(map(ord, corner)) % len(plots.COLOURS)])


class StateFigure:
    """Pressures, micromoment, corner gaps, rotation, zones and blocks of a state; `update` shows another one
    of the same law.

    `drawing` is the figure.
    """

    def __init__(self, corners):
        with matplotlib.rc_context(plots.STYLE):
            self.drawing = plots.Drawing(figsize=SIZE, layout="constrained")
            grid = self.drawing.add_gridspec(
                4, 2, height_ratios=(2, 2, 0.2 + 0.2 * (len(corners) + (len(corners) == 2)), 2.7)
            )
            self.axes = {}
            for name, row, column, above in (
                ("pressure", 0, 0, None),
                ("micromoment", 0, 1, None),
                ("gap", 1, 0, "pressure"),
                ("turn", 1, 1, "micromoment"),
            ):
                self.axes[name] = self.drawing.add_subplot(grid[row, column], sharex=self.axes.get(above))
            self.axes["zones"], self.axes["blocks"] = (
                self.drawing.add_subplot(grid[row, :]) for row in (2, 3)
            )
            self.corners = corners
            self._lines = {name: self._curve(name) for name in ("micromoment", "turn")}
            self._own = {
                (kind, corner): self._curve(kind, corner)
                for kind in ("pressure", "gap")
                for corner in corners
            }
            self._total = []  # the sum of both corners; of one it would be the same
            if len(corners) == 2:
                self._total = self.axes["pressure"].plot([], [], color="0.45", linewidth=0.8, label="$p$")
            self._bars = self._zone_bars()
            self.blocks = BlocksPanel(self.axes["blocks"], corners)
            self._ends, self._frames = defaultdict(End), {"blocks": Window(), "curves": Window()}
            self._cut = {
                name: self.axes[name].text(
                    1, 1.02, "", transform=self.axes[name].transAxes, ha="right", fontsize=SMALL
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
        gap = "corner gap" if len(self.corners) == 2 else "gap"
        labels = {
            "pressure": "pressure $p$ (stress)",
            "micromoment": r"$M/\ell$ (stress)",
            "gap": f"{gap} $g$ (length)",
            "turn": f"rotation {_turn(self.corners)} (degrees)",
        }
        for name, text in labels.items():
            self.axes[name].set(ylabel=text)
            self.axes[name].locator_params(nbins=TICKS)  # labels are what takes time to draw
            if name in ("gap", "turn"):
                self.axes[name].set_xlabel("$x_1$ (length)")
            else:
                self.axes[name].tick_params(labelbottom=False)
            self.axes[name].axhline(0, color=OUT_OF_CONTACT, linewidth=0.6, zorder=0)
        self.axes["zones"].set_xlabel("$x_1$ (length)")
        if len(self.corners) == 2:
            for name in ("pressure", "gap"):
                self.axes[name].legend(
                    loc="lower left",
                    bbox_to_anchor=(0, 1),
                    ncols=3,
                    borderaxespad=0.1,
                    handlelength=1.6,
                    columnspacing=1.0,
                    handletextpad=0.4,
                )

    def update(self, state, window=None):
        """Show a state; `window` (left, right) of x1, or the contact and its surroundings."""
        ell, zones = state.solid.ell, state.zones
        needed = {"blocks": blocks.window(ell, zones["contact"]), "curves": _around(zones["contact"], ell)}
        self._renewed = not all(self._frames[name].fits(frame) for name, frame in needed.items())
        # then everything at once: the eye, and the clock, have one jump instead of several
        if self._renewed:
            for name, frame in needed.items():
                self._frames[name].renew(frame)
        near, wide = self._frames["blocks"].value, window or self._frames["curves"].value
        surface = state.surface((min(wide[0], near[0]), max(wide[1], near[1])))
        self._draw(surface, zones)
        self._limit(surface, zones["contact"], (max(wide[0], surface.x[0]), min(wide[1], surface.x[-1])))
        self._tell_cuts(surface, unbounded(state))
        self.blocks.update(blocks.blocks(surface, zones["contact"], blocks.within(near, surface)))
        return self

    def _draw(self, surface, zones):
        x = surface.x
        for kind, rows in (
            ("pressure", surface.pressures),
            ("gap", np.where(np.isfinite(surface.gaps), surface.gaps, np.nan)),
        ):
            for corner, row in zip(self.corners, rows):
                self._own[kind, corner].set_data(x, row)
        for total in self._total:
            total.set_data(x, surface.pressures.sum(axis=0))
        self._lines["micromoment"].set_data(x, surface.micromoment / surface.ell)
        self._lines["turn"].set_data(x, np.degrees(surface.rotation))
        for number, (name, bar) in enumerate(self._bars.items()):
            bar.set_data(
                [edge for a, b in zones[name] for edge in (a, b, math.nan)],
                np.full(3 * len(zones[name]), number),
            )

    def _limit(self, surface, contact, window):
        """Ends of all axes: kept while they fit, so that the eye has something to hold on to."""
        shown = (surface.x >= window[0]) & (surface.x <= window[1])
        for name in ("pressure", "micromoment", "gap", "turn", "zones"):
            self.axes[name].set_xlim(*window)
        gaps, turn = surface.gaps[:, shown], np.degrees(surface.rotation[shown])
        gaps = gaps[np.isfinite(gaps) & (gaps > CLOSED * np.ptp(surface.displacement))]
        pressure = surface.pressures.sum(axis=0)
        # at the ends of a punch the pressure is infinite
        most = (
            PEAK
            * np.trapezoid(pressure, surface.x)
            / max(sum(right - left for left, right in contact), 1e-300)
        )
        for name, values in (("pressure", np.minimum(pressure[shown], most)), ("gap", gaps)):
            self.axes[name].set_ylim(0, self._ends[name].holding(values.max(initial=0.0), self._renewed))
        for name, values in (
            ("micromoment", np.clip(surface.micromoment[shown] / surface.ell, -most, most)),
            ("turn", turn),
        ):
            size = np.abs(values).max(initial=0.0)
            low, high = (
                side.holding(max(size / 10, (sign * values).max(initial=0.0)), self._renewed)
                for sign, side in ((-1, self._ends[name, "low"]), (1, self._ends[name, "high"]))
            )
            self.axes[name].set_ylim(-low, high)

    def _tell_cuts(self, surface, places):
        """Say where an axis ends below the curve, and why."""
        curves = {
            "pressure": surface.pressures.sum(axis=0),
            "micromoment": np.abs(surface.micromoment) / surface.ell,
        }
        for name, values in curves.items():
            (left, right), ends = self.axes[name].get_xlim(), np.abs(self.axes[name].get_ylim())
            top = values[(surface.x >= left) & (surface.x <= right)].max(initial=0.0)
            why = f"unbounded at {_listed(places)}" if places else f"largest {top:.3g}"
            self._cut[name].set_text(f"cut: {why}" if top > ends.max() else "")

    @property
    def moving(self):
        """[(axes, artist)] of what a new state changes, in the order of drawing."""
        lines = [
            *self._lines.values(),
            *self._own.values(),
            *self._bars.values(),
            *self._total,
            *self._cut.values(),
        ]
        return [(line.axes, line) for line in lines] + self.blocks.moving


class BlocksPanel:
    """Blocks, surface and obstacle on an Axes."""

    def __init__(self, axis, corners):
        self.axis, self.corners = axis, corners
        self._squares = axis.add_collection(
            PolyCollection([], facecolor="#FBE3D0", edgecolor=plots.COLOURS[1], linewidth=0.8)
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
        if len(corners) == 2:
            axis.legend(loc="lower right", bbox_to_anchor=(1, 1), ncols=2, borderaxespad=0.1)

    def update(self, shown):
        """Show other Blocks; heights from the uppermost point of the surface on."""
        left, right = shown.window
        width = right - left
        top = np.nanmax(shown.surface[:, 1], initial=shown.squares[..., 1].max(initial=-math.inf))
        down = np.array((0.0, top))
        self._squares.set_verts(shown.squares - down)
        self._surface.set_data(*(shown.surface - down).T)
        self._obstacle.set_verts([_under(piece - down, ABOVE * width) for piece in _pieces(shown.obstacle)])
        for vertex, (name, dots) in enumerate(zip("AB", self._corners)):
            if name in self.corners:
                touching = shown.closed[:, self.corners.index(name)]
                dots.set_data(*(shown.squares[touching, vertex] - down).T)
        self.axis.set(xlim=(left, right), ylim=((ABOVE - BLOCKS_HEIGHT) * width, ABOVE * width))
        touches = "" if len(self.corners) == 2 else "; their middle touches"
        self._title.set_text(
            f"blocks rotated by {_turn(self.corners)}{touches}; heights and angles "
            f"{shown.magnification:g} times"
        )
        return self

    @property
    def moving(self):
        artists = self._obstacle, self._squares, self._surface, *self._corners[::-1], self._title
        return [(self.axis, artist) for artist in artists]


class BlocksFigure:
    """The rotated blocks alone; as `StateFigure`."""

    def __init__(self, corners):
        with matplotlib.rc_context(plots.STYLE):
            self.drawing, axis = plots.figure(width=SIZE[0], height=3.2)
            self.panel = BlocksPanel(axis, corners)

    def update(self, state, window=None):
        contact = state.zones["contact"]
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

    def renew(self, needed):
        more = 0.0 if self.value is None else (ROOM - 1) * (needed[1] - needed[0]) / 2
        self.value = needed[0] - more, needed[1] + more


def unbounded(state):
    """Places x1 within the contact at which the pressure is infinite: where a corner meets an end or an edge
    of the obstacle.
    """
    law, ell, zones = state.law, state.solid.ell, state.zones
    shifts = dict(zip(law.corners, law.shifts(ell)))
    kinks, jumps, ends = (
        getattr(state.solution.problem.obstacle, name, ()) for name in ("kinks", "jumps", "ends")
    )
    points = [*(kink for kink, jump in zip(kinks, jumps) if jump > 0), *ends]
    margin = NEAR * ell
    return sorted(
        {
            float(point + shift)
            for corner, shift in shifts.items()
            for point in points
            for left, right in zones[corner if len(shifts) == 2 else "contact"]
            if left - margin <= point + shift <= right + margin
        }
    )


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
