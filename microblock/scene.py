"""What a user types: a body, an obstacle and a law put together, and states asked for by load and accuracy."""

import math
from dataclasses import dataclass, replace
from functools import cached_property

from . import contact_line, picture
from .cells_instead import by_cells
from .display import scene_summary
from .errors import BadArgument, MicroblockError, NotConverged, require_kind, require_positive, require_tolerance, require_whole
from .halfplane import HalfPlane
from .law import symmetric
from .line_solver import LineSolver, LooksTooNear
from .line_state import LineState
from .obstacles import check_lowest
from .panels import Line
from .path import LinePath
from .scene_view import SceneView
from .surface_view import StateView
from .threads import bounded

OUTER_AT_TOUCH = 1.4      # edge of the contact over ell when two zones of partial contact touch: a first guess
PICTURED = 4.0        # factor of the load for which one picture of the obstacle serves
FIXED_ORDERS = 2, 100     # least and most that may be fixed
LOOSER = (1e-11, 1e-10, 1e-8)      # rtol that are tried, to tell what can be had where rounding keeps from a smaller one
WIDEST = 8            # times farther than a classical half-plane asks for is looked at most
WIDE = 2e5            # blocks under a contact, up to which zones were found; at 2e6 none were


@dataclass(frozen=True)
class Contact(SceneView):
    """Frictionless contact of a half-plane with a rigid obstacle; of a `Body` on a mesh it makes a `BodyContact`.

    Parameters
    ----------
    body : HalfPlane, or Body
    obstacle : an obstacle of `microblock.obstacles`, or a callable height(x) that takes an array of x1 and returns one of x2;
        an object with a method ``height(x)`` may also have, as attributes or properties,
        `kinks` : tuple of abscissae, ascending, at which its slope or a higher derivative jumps; nodes are put there,
        `jumps` : as long, by how much the slope jumps at each (left to right, dimensionless), 0 where it does not,
        `ends` : (left, right), beyond which there is no obstacle (height inf);
        `microblock.Shape` makes one of a function and its kinks
    law : a law of `microblock.law`

    Examples
    --------
    >>> solid = mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1)
    >>> scene = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Microblock())
    >>> state = scene.at(1.0, rtol=1e-4)
    >>> state.error_estimate <= 1e-4, round(float(state.weights @ state.pressures.sum(axis=0)), 9)
    (True, 1.0)
    >>> [event.kind for event in scene.load(1.0).events]
    ['born', 'born', 'born', 'born', 'born', 'merged']
    """

    body: object
    obstacle: object
    law: object

    def __new__(cls, body=None, *scene, **named):
        if hasattr(body, "mesh"):
            from .body_contact import BodyContact      # here, for it loads NGSolve
            return BodyContact(body, *scene, **named)
        return super().__new__(cls)

    stands_on = "body", HalfPlane, "a HalfPlane or a Body (mb.HalfPlane(solid)?)"

    def __post_init__(self):
        super().__post_init__()
        check_lowest(self.obstacle, self.solid.ell)

    def summary(self):
        return scene_summary("Contact scene", "half-plane", self.body.solid, self.obstacle, self.law)

    usual_rtol = 1e-3

    @property
    def solid(self):
        return self.body.solid

    def varied(self, solid, obstacle, law):
        """The scene with these; the half-plane's kernels depend on nu, beta and gamma' alone and are kept."""
        return replace(self, body=type(self.body)(solid), obstacle=obstacle, law=law)

    def follow(self, load, rtol, near):
        """The state at a load from the zones of one `near`, as far as they fit."""
        if not isinstance(near, LineState) or len(near.line.law.corners) != len(self.law.corners):
            return self.at(load, rtol)
        zones = {corner: near.all_zones[corner] for corner in self.line.corners}
        return self.at(load, rtol, near=replace(near, zones=zones) if any(zones.values()) else None)      # one may touch nowhere

    @property
    def line(self):
        """The problem on the contact line; a symmetric scene is solved for one corner."""
        return Line(self.body.solid, self.law, self.obstacle, self.symmetric)

    def _line(self, load, wider=1):
        """The same with the obstacle's picture for a load."""
        found = self._picture(load, wider)
        if found.steps:
            raise BadArgument("obstacle", self.obstacle, f"must not jump, as its height does at x = {found.steps[0]:g}: "
                              "pressures have no norm there that an rtol could refer to; GridContact takes it, on so many nodes")
        return replace(self.line, obstacle=picture.seen(self.obstacle, found), picture=found)

    def _picture(self, load, wider=1):
        """The obstacle's Picture, made once for many loads; `wider`: times farther looked at."""
        bracket = PICTURED**math.ceil(math.log(load)/math.log(PICTURED) - 1e-9)
        if (bracket, wider) not in self._pictures:
            try:
                self._pictures[bracket, wider] = picture.picture(self.line, bracket, picture.BOUND*wider)
            except MicroblockError:      # it may carry this load, though not that of the bracket
                self._pictures[bracket, wider] = picture.picture(self.line, load, picture.BOUND*wider)
        return self._pictures[bracket, wider]

    @cached_property
    def _pictures(self):
        """{(highest load, wider): Picture}."""
        return {}

    @property
    def symmetric(self):
        """Whether obstacle and blocks are known to be symmetric about x = 0."""
        return symmetric(self.law, self.obstacle)

    @bounded
    def at(self, load, rtol=usual_rtol, order=None, near=None, fallback=True):
        """The state at a load (force per thickness) to a relative L2 error of pressure and micromoment.

        Parameters
        ----------
        rtol : float; chooses the order of the panels, unless `order` fixes it
        near : state to start from, of a nearby load or a scene that differs little; its zones and order are taken over
        fallback : bool, whether uniform cells answer where panels do not; without it, and where the order is fixed, they do not

        Returns
        -------
        LineState; its `estimate` has no discretisation error where the order is fixed. GridState where cells answer: its
            `method` is "cells", not "panels", and its `warnings` say why.

        Raises
        ------
        NotConverged
            If the accuracy is out of reach, or the zones are not found.
        """
        self._check(load, rtol, order, near)
        self._check_width(load)
        near = near if isinstance(near, LineState) else None      # zones of cells are no better than those that are found anyway
        try:
            return self._solved(load, rtol, order, near)
        except NotConverged as failure:
            if order is not None:
                raise
            failure = self._reachable(load, rtol, failure)
            if not fallback:
                raise failure
            return by_cells(self, self._picture(load), load, rtol, failure)

    def _reachable(self, load, rtol, failure):
        """The failure, with what can be had where rounding keeps the edges from an rtol."""
        for looser in (each for each in LOOSER if each > rtol and failure.reached is None):
            try:
                reached = self._solved(load, looser, None, None).error_estimate
            except NotConverged as other:
                reached = other.reached
            if reached is not None:
                return NotConverged(f"rtol = {rtol:g} was not reached at load {load:g}, the smallest error estimate was "
                                    f"{reached:.1e}; ask for that", reached=reached)
        return failure

    def _solved(self, load, rtol, order, near, wider=1):
        try:
            return LineSolver(self._line(load, wider), self.body, load).solve(rtol, order, near)
        except LooksTooNear:
            if wider > WIDEST:
                raise NotConverged(f"at load {load:g} the half-plane touches the obstacle farther and farther away") from None
            return self._solved(load, rtol, order, near, 2*wider)

    @staticmethod
    def _check(load, rtol, order=None, near=None):
        """BadArgument for what cannot be asked for."""
        require_positive(load=load)
        require_tolerance(rtol)
        if order is not None:
            require_whole(*FIXED_ORDERS, order=order)
        if near is not None:
            require_kind(StateView, "a state", near=near)

    def _check_width(self, load):
        """NotConverged where the contact has more blocks than zones are found for: before minutes are spent on them."""
        if len(self.law.corners) == 1:
            return
        blocks = 2*self._picture(load).half_width/self.solid.ell
        if blocks > WIDE:
            raise NotConverged(f"the contact at load {load:g} is some {blocks:.1g} blocks wide, and up to {WIDE:.0g} are in "
                               "reach: take a larger ell, or the unilateral law, from which this one hardly differs there")

    def load(self, last, rtol=1e-3, progress=False):
        """The load path from first touch to `last` (force per thickness): its `events`, and states `at` any load.

        With `progress` a bar counts states; an interrupted path keeps them.
        """
        self._check(last, rtol)
        return LinePath(self, last, rtol, progress)

    @property
    def may_meet_on_axis(self):
        """Whether two zones of partial contact may meet on the axis: corners, symmetric, under an obstacle without ends."""
        return self.symmetric and len(self.law.corners) == 2 and not self.line.ends

    @bounded
    def coalescence(self, order=14):
        """Load at which the two zones of partial contact touch on the axis, and its error; symmetric scenes only."""
        require_whole(*FIXED_ORDERS, order=order)
        if not self.may_meet_on_axis:
            raise BadArgument("scene", self, "must be a symmetric one of microblocks under an obstacle without ends")
        return contact_line.coalescence(self.line, OUTER_AT_TOUCH*self.body.solid.ell, order)

