"""What a user types: a body, an obstacle and a law put together, and states asked for by load and accuracy."""

from dataclasses import dataclass, replace
from functools import partial

from . import contact_line, line_state, topology
from .adapt import climb
from .display import scene_summary
from .errors import BadArgument, NotConverged, require_kind, require_positive, require_tolerance, require_whole
from .halfplane import HalfPlane
from .law import symmetric
from .obstacles import Shape, check_lowest, returned
from .panels import Line, half_line
from .path import LinePath
from .scene_view import SceneView
from .smoothness import kinks
from .threads import bounded

OUTER_AT_TOUCH = 1.4      # edge of the contact over ell when two zones of partial contact touch: a first guess
ORDERS = (6, 10, 14, 18, 22, 26)
FIXED_ORDERS = 2, 100          # least and most that may be fixed
FIXED_ORDER_EDGES = 1e-9       # tolerance of the edges where the order is fixed: rounding
MENDINGS = 4          # of zones that a fitted state shows wrong
EDGE_SHARE = 0.1      # of rtol, to which the edges are driven
NEAR_STEPS = 5        # of the edges, from a neighbour's on: if there are more the coarse grid is the shorter way
LOOSER = (1e-11, 1e-10, 1e-8, 1e-6)      # rtol that are tried, to tell what can be had where rounding keeps from a smaller one
WIDE = 2e5            # blocks under a contact, up to which zones were found; at 2e6 none were
AMPLE = 0.03          # of rtol: a neighbour as good as that had more order than needed


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
        if len(near.line.law.corners) != len(self.law.corners):
            return self.at(load, rtol)
        zones = {corner: near.all_zones[corner] for corner in self.line.corners}
        return self.at(load, rtol, near=replace(near, zones=zones) if any(zones.values()) else None)      # one may touch nowhere

    @property
    def line(self):
        """The problem on the contact line; a symmetric scene is solved for one corner."""
        return Line(self.body.solid, self.law, self.obstacle, self.symmetric)

    @property
    def symmetric(self):
        """Whether obstacle and blocks are known to be symmetric about x = 0."""
        return symmetric(self.law, self.obstacle)

    @bounded
    def at(self, load, rtol=usual_rtol, order=None, near=None):
        """The state at a load (force per thickness) to a relative L2 error of pressure and micromoment.

        Parameters
        ----------
        rtol : float; chooses the order of the panels, unless `order` fixes it
        near : LineState to start from, of a nearby load or a scene that differs little; its zones and order are taken over

        Returns
        -------
        LineState; its `estimate` has no discretisation error where the order is fixed

        Raises
        ------
        NotConverged
            If the accuracy is out of reach, or the zones are not found.
        """
        self._check(load, rtol, order, near)
        named = self._named(load)
        if named is not self:
            return named.at(load, rtol, order, near)
        self._check_width(load)
        if order is not None:
            return self._found(load, rtol, order, near)
        try:
            return self._found(load, rtol, order, near)
        except NotConverged as failure:
            reached = self._reachable(load, rtol) if failure.reached is None else None
            if reached is None:
                raise
            raise NotConverged(f"rtol = {rtol:g} was not reached at load {load:g}, the smallest error estimate was "
                               f"{reached:.1e}; ask for that", reached=reached) from failure

    @staticmethod
    def _check(load, rtol, order=None, near=None):
        """BadArgument for what cannot be asked for."""
        require_positive(load=load)
        require_tolerance(rtol)
        if order is not None:
            require_whole(*FIXED_ORDERS, order=order)
        if near is not None:
            require_kind(line_state.LineState, "a LineState", near=near)

    def _named(self, load):
        """The scene, the singular points of a mere function named as far as they are seen and matter at this load."""
        if hasattr(self.obstacle, "height"):
            return self
        places, jumps = kinks(partial(returned, self.obstacle), *topology.surroundings(self.line, load))
        return replace(self, obstacle=Shape(self.obstacle, places, jumps)) if places else self

    def _reachable(self, load, rtol):
        """The smallest error estimate seen where less is asked for; None if there is none."""
        for looser in (each for each in LOOSER if each > rtol):
            try:
                return self._found(load, looser, None, None).error_estimate
            except NotConverged as failure:
                if failure.reached is not None:
                    return failure.reached
        return None

    def _found(self, load, rtol, order, near):
        """The state at a load on the first zones that fit."""
        ladder = ORDERS if order is None else (order,)
        tolerance = EDGE_SHARE*rtol if order is None else FIXED_ORDER_EDGES
        failure = None
        for zones, orders in self._trials(load, near, ladder, rtol):
            try:
                states = self._on(load, zones, orders, tolerance)
                if order is not None:
                    return states[order]
                return self._climb(states, rtol, tolerance)
            except NotConverged as objection:
                if objection.reached is not None:
                    raise NotConverged(f"{objection}{self._hint}", reached=objection.reached,
                                       iterations=objection.iterations) from objection
                failure = objection
        raise NotConverged(f"no zones fit at load {load:g}: {failure}; {self._advice}") from failure

    def _check_width(self, load):
        """NotConverged where the contact has more blocks than zones are found for: before minutes are spent on them."""
        if len(self.law.corners) == 1:
            return
        (left, right), = topology.classical(self.line, load)[0]
        blocks = (right - left)/self.solid.ell
        if blocks > WIDE:
            raise NotConverged(f"the contact at load {load:g} is some {blocks:.1g} blocks wide, and up to {WIDE:.0g} are in "
                               "reach: take a larger ell, or the unilateral law, from which this one hardly differs there")

    @property
    def _advice(self):
        """What to try where no zones fit."""
        return f"next to a load at which zones meet only a larger rtol is in reach; else take uniform cells{self._hint}"

    @property
    def _hint(self):
        """What besides, under a bare callable."""
        return "" if hasattr(self.obstacle, "height") else "; where the height is not smooth say so by mb.Shape"

    def load(self, last, rtol=1e-3, progress=False):
        """The load path from first touch to `last` (force per thickness): its `events`, and states `at` any load.

        With `progress` a bar counts states; an interrupted path keeps them.
        """
        self._check(last, rtol)
        return LinePath(self, last, rtol, progress)

    def _trials(self, load, near, ladder, rtol):
        """Zones and orders to try, the likely ones first: next to coalescence a coarse one may fit neither side."""
        line, orders = self.line, ladder[:2]
        if near:      # if they do not fit at once, a coarse grid is the shorter way
            yield near.zones, _orders_of(near, rtol) if len(ladder) > 1 else ladder
        elif half_line(line):
            yield from ((topology.classical(line, load), (order,)) for order in orders)
        for cells in topology.CELLS:
            variants = topology.variants(line, topology.coarse(line, self.body, load, cells))
            yield from ((zones, (order,)) for order in orders for zones in variants)

    def _on(self, load, zones, orders, tolerance):
        """{order: state} from these zones on: orders before the last are near it and fit soon, or not at all."""
        states = {}
        for order in orders[:-1]:
            states[order] = contact_line.fit(self.line, load, zones, order=order, tolerance=tolerance, steps=NEAR_STEPS)
            zones = states[order].zones
        states[orders[-1]] = self._settled(load, zones, orders[-1], tolerance)
        return states

    def _settled(self, load, zones, order, tolerance):
        """The state on these zones, mended where they do not hold.

        Where mending leads back to the same zones, what is left is the panels' own error, of which the estimate speaks: under
        an obstacle less smooth than they take it for.
        """
        state = contact_line.fit(self.line, load, zones, order=order, tolerance=tolerance)
        for _ in range(MENDINGS):
            better = topology.mended(state)
            if better is None:
                return self._completed(state, tolerance)
            state = contact_line.fit(self.line, load, better, order=order, tolerance=tolerance)
        raise NotConverged(f"zones still changing after {MENDINGS} mendings at load {load:g}")

    def _completed(self, state, tolerance):
        """The state with a zone that hardly began to touch, where there is one."""
        zones = topology.newborn(state)
        if zones is None:
            return state
        try:
            return contact_line.fit(self.line, state.load, zones, order=state.panels.order, tolerance=tolerance)
        except NotConverged:      # none after all
            return state

    def _climb(self, states, rtol, tolerance):
        """State on the ladder of orders, from the lowest of {order: state} on."""
        load, first = states[max(states)].load, min(states)

        def rung(order):
            if order not in states:
                zones = states[max(states)].zones
                states[order] = self._settled(load, zones, order, tolerance)
            return states[order]

        def error(coarse, fine):
            parts = replace(fine.estimate, discretisation=line_state.difference(coarse, fine))
            states[fine.panels.order] = replace(fine, estimate=parts)
            return parts.total

        fine, _ = climb(rung, ORDERS[ORDERS.index(first):], error, rtol)
        return states[fine.panels.order]

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


def _orders_of(near, rtol):
    """(an order, the next) for the neighbour of a state: up to its own, or to one lower where that was ample."""
    number = max(1, ORDERS.index(near.panels.order) if near.panels.order in ORDERS else 1)
    if number > 1 and near.error_estimate is not None and near.error_estimate < AMPLE*rtol:
        number -= 1
    return ORDERS[number - 1], ORDERS[number]
