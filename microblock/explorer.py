"""Scene, state and picture for parameters that change one by one: what sliders need, and scripts as well.

A state starts from the zones of the last one, moved on as the last two moved under the same parameter; the half-plane's
kernels depend on nu, beta and gamma' alone and are kept. The picture only gets new data.
"""

import math
from dataclasses import dataclass, fields, replace

from . import topology
from .display import Row, Shown, Summary, number
from .errors import BadArgument, NotConverged, require_positive
from .frames import Frames
from .law import Microblock, Microclamped, Unilateral
from .state_figure import StateFigure

LAWS = {"microblock": Microblock, "unilateral": Unilateral, "microclamped": Microclamped}
FURTHEST = 2.0       # steps of the last length, by which zones are moved on


@dataclass(frozen=True)
class Choice:
    """What may be changed: load (force per thickness), psi0 (radians), radius (length), alpha = ell/a_ref, law (by name).

    psi0 and radius are None where the scene has none, or none that is one number.

    Examples
    --------
    >>> mb.Choice(load=1.0, psi0=0.0, radius=10.0, alpha=0.25, law="microblock").alpha
    0.25
    """

    load: float
    psi0: float | None
    radius: float | None
    alpha: float
    law: str


class Explorer(Shown):
    """A scene on the half-plane (`Contact`) under changing parameters.

    Attributes
    ----------
    choice : Choice, the parameters of the state
    state : LineState
    figure : StateFigure that shows it
    reference : float, the length a_ref in alpha = ell/a_ref: the half-width of a classical contact under the first load

    Parameters
    ----------
    scene : Contact
    load : float, force per thickness
    rtol : float, as of `Contact.at`

    Examples
    --------
    >>> solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)
    >>> explorer = mb.Explorer(mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Microblock(psi0=0)), load=1.0)
    >>> explorer.choice.law
    'microblock'
    """

    def __init__(self, scene, load, rtol=1e-3):
        require_positive(load=load)
        self._scene, self._rtol, self._before, self._frames = scene, rtol, None, None
        self.reference = reference_length(scene, load)
        names = {law: name for name, law in LAWS.items()}
        if type(scene.law) not in names:
            raise BadArgument("law", scene.law, f"must be one of {', '.join(LAWS)}")
        psi0 = getattr(scene.law, "psi0", 0.0)
        self.choice = Choice(float(load), None if callable(psi0) else float(psi0), _number(getattr(scene.obstacle, "R", None)),
                             scene.body.solid.ell/self.reference, names[type(scene.law)])
        self.state = self.scene().at(load, rtol)
        self.show()

    def scene(self, choice=None):
        """The Contact of a choice, or of the present one."""
        choice, scene = choice or self.choice, self._scene
        solid = replace_solid(scene.body.solid, choice.alpha*self.reference)
        law = LAWS[choice.law]()
        if choice.law == "microblock":
            own = scene.law if isinstance(scene.law, Microblock) else Microblock()
            law = own if choice.psi0 is None else replace(own, psi0=choice.psi0)
        obstacle = scene.obstacle if choice.radius is None else replace(scene.obstacle, R=choice.radius)
        return replace(scene, body=type(scene.body)(solid), obstacle=obstacle, law=law)

    def solve(self, **changes):
        """Change parameters (names of `Choice`) and return the new state; where there is none, all stays as it was.

        Raises
        ------
        BadArgument
            For a name or a value that the scene does not have.
        NotConverged
        """
        choice = self._changed(changes)
        scene, name = self.scene(choice), next(iter(changes)) if len(changes) == 1 else None
        state = scene.at(choice.load, self._rtol, near=self._guess(scene, choice, name))
        value = getattr(self.choice, name) if name else None
        self._before = (name, value, self.state) if name and not isinstance(value, str) else None
        self.choice, self.state = choice, state
        return state

    def update(self, **changes):
        """As `solve`, and show the state in the figure."""
        self.solve(**changes)
        self.show()
        return self.state

    def png(self):
        """The figure as a PNG, bytes: what has not changed since the last call is not drawn again."""
        if self._frames is None:
            self._frames = Frames(self.figure)
        self._frames.draw()
        return self._frames.png()

    def _changed(self, changes):
        known = {entry.name for entry in fields(Choice)}
        for name, value in changes.items():
            if name not in known or getattr(self.choice, name) is None:
                raise BadArgument(name, value, "is not a parameter of this scene; it has "
                                  + ", ".join(each for each in sorted(known) if getattr(self.choice, each) is not None))
            if name == "law" and value not in LAWS:
                raise BadArgument("law", value, f"must be one of {', '.join(LAWS)}")
            if name in ("load", "radius", "alpha"):
                require_positive(**{name: value})
        return replace(self.choice, **changes)

    def _guess(self, scene, choice, name):
        """The last state with its zones moved on, as far as they fit the new scene; None if they do not."""
        state, line = self.state, scene.line
        if len(state.line.law.corners) != len(line.law.corners):
            return None
        zones = state.all_zones
        if self._before is not None and self._before[0] == name:
            _, value, earlier = self._before
            step = getattr(self.choice, name) - value
            share = (getattr(choice, name) - getattr(self.choice, name))/step if step else 0.0
            zones = _moved_on(earlier.all_zones, zones, share)
        zones = {corner: zones[corner] for corner in line.corners}
        return replace(state, zones=zones) if any(zones.values()) else None      # a corner of a turned block may touch nowhere

    def show(self):
        corners = self.state.line.law.corners
        if getattr(self, "figure", None) is None or self.figure.corners != corners:
            self.figure, self._frames = StateFigure(corners), None
        self.figure.update(self.state)

    def summary(self):
        shown = [(entry.name, getattr(self.choice, entry.name)) for entry in fields(Choice)]
        rows = tuple(Row(name, "", value) for name, value in shown if value is not None)
        return Summary("Explorer", ", ".join(f"{name} {number(value)}" for name, value in shown if value is not None), rows)


def _moved_on(earlier, zones, share):
    """Zones moved on by a share of the way from the earlier ones, if they are alike and none is turned inside out."""
    if not abs(share) <= FURTHEST or any(len(earlier[corner]) != len(own) for corner, own in zones.items()):
        return zones
    moved = {corner: tuple(tuple(edge + share*(edge - old) for edge, old in zip(interval, before))
                           for interval, before in zip(own, earlier[corner])) for corner, own in zones.items()}
    edges = [edge for own in moved.values() for interval in own for edge in interval]
    fits = all(a < b for own in moved.values() for interval in own for a, b in [interval])
    apart = all(a[1] < b[0] for own in moved.values() for a, b in zip(own, own[1:]))
    return moved if fits and apart and all(map(math.isfinite, edges)) else zones


def reference_length(scene, load):
    """Half-width of a classical contact under the load: a_Hz of a cylinder, half a punch, as `topology` guesses it elsewhere."""
    obstacle = scene.obstacle
    if hasattr(obstacle, "R"):
        return math.sqrt(4*load*obstacle.R/(math.pi*scene.body.solid.E_star))
    if getattr(obstacle, "ends", ()):
        return (obstacle.ends[-1] - obstacle.ends[0])/2
    try:
        return topology.classical(scene.line, load)[0][0][1]
    except NotConverged:
        return scene.body.solid.ell


def replace_solid(solid, ell):
    """The same solid with blocks of another size."""
    return type(solid)(solid.E, solid.nu, ell, eta=solid.eta, curvature=solid.curvature)


def _number(value):
    return None if value is None else float(value)
