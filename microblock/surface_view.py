"""What states of every kind show along the surface, in one form, and what they have in common when they show themselves."""

import math
from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np

from .display import Row, Shown, Summary, call, intervals, number
from .errors import BadArgument
from .observables import contact_zones, half_widths
from .obstacles import gap, returned

ZONES = ("A", "B", "full", "contact")
LARGE_TURN = math.radians(10)      # of a block: the small-angle form (41) misses 1.5 % there
STEEP = 0.2                        # slope of the surface: beyond small strain, and of a cylinder beyond its parabola
FEWEST = 9           # nodes across a zone, whose edges half a spacing may misplace by 1/16 of its width
NEXT_TO = 1e-6                     # of the contact's width, over which the obstacle's slope at an edge is taken


@dataclass(frozen=True)
class Surface:
    """A state along the surface, at points in the order of x1.

    Attributes
    ----------
    points, normals : arrays (n, 2), of the undeformed surface
    pressures, gaps : arrays (corners, n); a gap is inf where there is no obstacle over the corner
    micromoment, psi, turn : arrays (n,); turn is psi, with psi0 where that acts in the gaps
    sinking : array (n,), -u.n (of a half-plane up to its level)
    obstacle : array (n,), height of the obstacle over the undeformed surface along n, at the state's approach
    corners : their names
    ell : side of a block
    """

    points: np.ndarray
    normals: np.ndarray
    pressures: np.ndarray
    gaps: np.ndarray
    micromoment: np.ndarray
    psi: np.ndarray
    turn: np.ndarray
    sinking: np.ndarray
    obstacle: np.ndarray
    corners: tuple
    ell: float

    @property
    def x(self):
        return self.points[:, 0]


def surface(scene, approach, points, normals, *, pressures, micromoment, psi, sinking):
    """The Surface of a state of a `scene` with obstacle, law and ell, from its fields at the points."""
    law, ell, x = scene.law, scene.ell, points[:, 0]
    initial = np.array(list(law.initial_gaps(points, normals, ell, scene.obstacle).values()))
    levers = np.array(list(law.levers(x).values()))
    gaps = initial - approach*normals[:, 1] + sinking + ell/2*levers*psi
    turned = law.angle(x) if getattr(law, "reading", None) == "gap" else np.zeros_like(x)
    over = gap(scene.obstacle, points, normals) - approach*normals[:, 1]
    return Surface(points, normals, np.asarray(pressures), gaps, micromoment, psi, turned + psi, sinking, over, law.corners, ell)


class ErrorParts:
    """Base of frozen dataclasses of parts of the relative L2 error of pressure and micromoment; `total` is their sum."""

    @property
    def total(self):
        """The sum, float; None where a part is not known."""
        parts = [getattr(self, entry.name) for entry in fields(self)]
        return None if None in parts else sum(parts)


@dataclass(frozen=True)
class Setting:
    """What `surface` needs to know of a scene."""

    obstacle: object
    law: object
    ell: float


class StateView(Shown):
    """Base of contact states of every kind: on panels, cells and meshes they go by the same names.

    Attributes
    ----------
    load, approach : float, force per thickness (on a period, of one) and approach of the obstacle
    error_estimate : float, relative L2 error of pressure and micromoment; None where a mesh or an order was prescribed
    named_zones : {"A": [(left, right), ...], "B": ..., "full": ..., "contact": ...}, intervals of x1, ascending: where the left
        corner A is closed, the right one B, both, either; of laws without corners "contact" alone is not empty
    half_width : float
    x, weights, psi : arrays (n,), points of the surface, the lengths they stand for, microrotation
    pressures : array (corners, n), of A and B, or of the one contact point
    micromoment : array (n,), (29)
    energy : float, per thickness
    obstacle, solid : of the scene
    warnings : list of sentences
    setting, surface() : what pictures are drawn from
    """

    @property
    def half_width(self):
        """Half of the distance between the outermost edges of `named_zones["contact"]`, float; 0 where nothing touches."""
        return half_widths(self.named_zones["contact"])[0]

    @property
    def obstacle(self):
        return self.setting.obstacle

    @property
    def caption(self):
        """Obstacle, law, load and error estimate in a line, as pictures have it above them."""
        error = "no error estimate" if self.error_estimate is None else f"error {self.error_estimate:.1g}"
        return f"{call(self.obstacle)}, {call(self.setting.law)}, load {number(self.load)}, {error}"

    @property
    def warnings(self):
        """Where the small-strain model leaves its ground, or a mesh without error estimate is coarse: a list of sentences."""
        setting, found = self.setting, []
        turn = float(np.abs(self.turn).max())
        if turn > LARGE_TURN:
            found.append(f"blocks turn by {math.degrees(turn):.0f} degrees: beyond the small-angle form (41)")
        slope = self._slope()
        if slope > STEEP:
            found.append(f"slope {slope:.2g} at the edge of the contact: beyond small strain")
        contact = self.named_zones["contact"]
        if len(contact) and contact[-1][1] - contact[0][0] < 2*setting.ell:
            found.append("blocks are larger than the half-width of the contact")
        return found

    def _few_nodes(self, advice):
        """A warning where nodes are few in a zone of the contact and no error estimate speaks for itself, as a list."""
        numbers = [np.count_nonzero((self.x >= left) & (self.x <= right)) for left, right in self.named_zones["contact"]]
        if self.error_estimate is not None or min(numbers, default=FEWEST) >= FEWEST:
            return []
        where = "in contact" if len(numbers) == 1 else "in a zone of the contact"
        return [f"only {min(numbers)} nodes {where} and no error estimate: {advice}"]

    def moved_on(self, earlier, share):
        """This state, moved on by a share of the way from an earlier one if that helps to find the next; by default it stays."""
        return self

    @property
    def turn(self):
        """psi0 + psi at `x` (psi alone where psi0 acts in the levers only), array (n,)."""
        law = self.setting.law
        return self.psi + (law.angle(self.x) if getattr(law, "reading", None) == "gap" else 0.0)

    def _slope(self):
        """Largest slope of the obstacle at an edge of the contact."""
        edges = np.array([edge for interval in self.named_zones["contact"] for edge in interval], float)
        if not len(edges):
            return 0.0
        step = NEXT_TO*max(np.ptp(edges), NEXT_TO*self.setting.ell)
        around = np.array([returned(self.setting.obstacle, edges + sign*step) for sign in (-1, 1)])
        known = np.isfinite(around).all(axis=0)
        return float(np.abs(np.diff(around[:, known], axis=0)/(2*step)).max(initial=0.0))

    def summary(self):
        zones, setting = self.named_zones, self.setting
        names = [name for name in ZONES if name == "contact" or len(setting.law.corners) == 2]
        named = {"A": "corner A closed", "B": "corner B closed", "full": "both closed", "contact": "contact"}
        rows = [Row("load", "P", self.load, "force per thickness"),
                Row("approach", "d", self.approach, "length" + self._level),
                Row("largest nodal pressure", "p", float(self.pressures.sum(axis=0).max()), "stress"),
                Row("largest nodal micromoment", "|M|", float(np.abs(self.micromoment).max()), "stress x length"),
                Row("largest turn of a block", "|&psi;<sub>0</sub> + &psi;|", math.degrees(np.abs(self.turn).max()), "degrees"),
                *(Row(named[name], "", intervals(zones[name]), "x1, length") for name in names),
                *scales(setting.obstacle, self.solid, self.load),
                Row("error estimate", "", self.error_estimate, "relative, of p and M in L2")]
        brief = f"load {number(self.load)}, contact {intervals(zones['contact'])}, error estimate {number(self.error_estimate)}"
        return Summary("Contact state", brief, tuple(rows), tuple(self.warnings))

    _level = ""

    def plot(self, path=None, window=None):
        """Pressures, micromoment, corner gaps, turn, zones and the turned blocks over x1, as a Figure.

        Parameters
        ----------
        path : where to write it (PNG, PDF or SVG, by its ending), if anywhere
        window : (left, right) of x1; the contact and its surroundings
        """
        from .state_figure import StateFigure      # here: whoever does not draw does not load matplotlib
        return _saved(StateFigure(self.setting.law.corners).update(self, window).drawing.captioned(self.caption), path)

    def plot_blocks(self, path=None, window=None):
        """The turned blocks under the obstacle, as in Fig. 3 of the paper; as `plot`."""
        from .state_figure import BlocksFigure
        return _saved(BlocksFigure(self.setting.law.corners).update(self, window).drawing.captioned(self.caption), path)

    def plot_below(self, quantity="psi", path=None):
        """A Figure of a field below the contact: "psi", "s22", "s11", "skew" or "shear"; not of states on cells."""
        if not hasattr(self, "fields_below"):
            raise BadArgument("state", self, "must be one of Contact or FittedContact: cells have no fields below the surface")
        from .below import draw_below
        return _saved(draw_below(self, quantity), path)


def _saved(drawing, path):
    """A Figure, written where a path is given."""
    if path is not None:
        drawing.savefig(path)
    return drawing


class LineView(StateView):
    """Base of states along x1 that know their scene as a `line`, `all_zones`, and where psi is held the reaction `_held`.

    The keys of `all_zones` are corner numbers, 0 for A (left) and 1 for B (right), or 0 alone; `named_zones` has names.
    """

    @property
    def solid(self):
        return self.line.solid

    @property
    def setting(self):
        return Setting(self.line.obstacle, self.line.law, self.line.solid.ell)

    @property
    def named_zones(self):
        """{"A", "B", "full", "contact": intervals} of x1."""
        return contact_zones(self.all_zones, self.line.law.corners)

    @cached_property
    def micromoment(self):
        """M of (29) at `x`, array (n,); where psi is prescribed, the reaction to it."""
        if self.line.law.clamps_rotation:
            return self._held()
        levers = [self.line.lever(np.full(len(self.x), corner), self.x) for corner in range(len(self.pressures))]
        return self.line.solid.ell/2*np.sum(levers*self.pressures, axis=0)

    @cached_property
    def energy(self):
        """Elastic energy per thickness, half the work of the corner forces; of a half-plane up to its arbitrary level."""
        numbers = range(len(self.pressures))
        sunk = np.array([self.approach - self.line.initial_gap(np.full(len(self.x), number), self.x) for number in numbers])
        work = np.where(self.pressures != 0, self.pressures*np.where(np.isfinite(sunk), sunk, 0.0), 0.0)
        return float(np.sum(work @ self.weights)/2)


def scales(obstacle, solid, load):
    """Rows with the scales of Hertz' contact, (50), where the obstacle is a cylinder."""
    R = getattr(obstacle, "R", None)
    if R is None:
        return ()
    a, p = math.sqrt(4*load*R/(math.pi*solid.E_star)), math.sqrt(load*solid.E_star/(math.pi*R))
    return (Row("Hertz' half-width", "a<sub>Hz</sub>", a, "length"), Row("Hertz' pressure", "p<sub>Hz</sub>", p, "stress"),
            Row("size of a block", "&alpha; = &ell;/a<sub>Hz</sub>", solid.ell/a))
