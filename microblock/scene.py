"""What a user types: a body, an obstacle and a law put together, and states asked for by load and accuracy."""

from dataclasses import dataclass

import numpy as np

from . import active_set, contact_line, obstacles
from .panels import Line
from .adapt import climb
from .errors import BadArgument, NotConverged, require_finite
from .law import Microblock

OUTER_AT_TOUCH = 1.4      # edge of the contact over ell when two zones of partial contact touch: a first guess
CELLS = 80            # of the coarse grid that finds the topology of the zones; doubled while the fit objects
REFINEMENTS = 3
MEETING = 0.1         # of the width: zones of the two corners this near to each other may be joined or apart
MARGIN = 1.3          # of the coarse grid around the contact
PARTIAL = 2.4         # width of a partial zone over ell as ell -> 0 (2.39 at nu = 0.3, beta = 1): a first guess
ORDERS = (6, 10, 14, 18, 22)
FIXED_ORDER_EDGES = 1e-9       # tolerance of the edges where the order is fixed: rounding
EDGE_SHARE = 0.1      # of rtol, to which the edges are driven
KINK_LEVELS, KINK_RATIO = 5, 0.15      # panels that shrink towards a kink, where the pressure is logarithmic


@dataclass(frozen=True)
class Contact:
    """Frictionless contact of a half-plane with a rigid obstacle.

    Parameters
    ----------
    body : HalfPlane
    obstacle : an obstacle of `microblock.obstacles`, or a callable height(x)
    law : a law of `microblock.law`
    """

    body: object
    obstacle: object
    law: object

    @property
    def line(self):
        """The problem on the contact line; a symmetric scene is solved for one corner."""
        return Line(self.body.solid, self.law, self.obstacle, self.symmetric)

    @property
    def symmetric(self):
        """Whether obstacle and blocks are known to be symmetric about x = 0."""
        even = isinstance(self.obstacle, (obstacles.Plane, obstacles.Cylinder, obstacles.Wedge)) or (
            isinstance(self.obstacle, obstacles.Punch) and self.obstacle.tilt == 0)
        return even and (not isinstance(self.law, Microblock) or (not callable(self.law.psi0) and self.law.psi0 == 0))

    def at(self, load, rtol=1e-3, order=None, near=None, search=True):
        """The state at a load (force per thickness) to a relative L2 error of pressure and micromoment.

        Parameters
        ----------
        rtol : float; chooses the order of the panels, unless `order` fixes it
        near : LineState of a nearby load to start from
        search : whether another topology is looked for if that of `near` does not hold

        Returns
        -------
        (LineState, error estimate or None)

        Raises
        ------
        NotConverged
            If the accuracy is out of reach, or the zones are not found.
        """
        require_finite(load=load)
        if not load > 0:
            raise BadArgument("load", load, "must be positive")
        zones = near.zones if near else self._topology(load, CELLS)
        if order is not None:
            return self._fit(load, order, zones, FIXED_ORDER_EDGES, search=search), None
        tolerance = EDGE_SHARE*rtol
        states = self._first_rung(load, zones, tolerance)

        def rung(order):
            if order not in states:
                start = states[max(states)].zones if states else zones
                states[order] = self._fit(load, order, start, tolerance, looked=not states, search=search)
            return states[order]

        first = ORDERS.index(min(states, default=ORDERS[1]))
        return climb(rung, ORDERS[first:], contact_line.difference, rtol)

    def _first_rung(self, load, zones, tolerance):
        """{order: state} of the first of ORDERS that fits these zones: next to coalescence a coarse one may fit neither side."""
        for order in ORDERS[:2]:
            try:
                return {order: self._fit(load, order, zones, tolerance, search=False)}
            except NotConverged:
                continue
        return {}

    def _fit(self, load, order, zones, tolerance, looked=True, search=True):
        """Fit the edges; where the topology does not hold, look again on finer and finer coarse grids."""
        kinks, fixed = self._features()
        failure = None
        for refinement in range(REFINEMENTS + 1 if search else 1):
            for trial in _either_side(zones, self.line.mirror):
                try:
                    state = contact_line.fit(self.line, load, trial, order=order, tolerance=tolerance, kinks=kinks, fixed=fixed)
                    if looked:
                        contact_line.check(state)
                    return state
                except NotConverged as objection:
                    failure = objection
            if search:
                zones = self._topology(load, CELLS*2**refinement)
        raise NotConverged(f"no zones fit at load {load:g}: {failure}") from failure

    @property
    def smooth_and_symmetric(self):
        """Whether two corners meet symmetric about x = 0 under an obstacle without kinks and ends."""
        kinks, fixed = self._features()
        return self.symmetric and len(self.law.corners) == 2 and not kinks and not fixed

    def coalescence(self, order=14):
        """Load at which the two zones of partial contact touch on the axis, and its error; symmetric scenes only."""
        if not self.smooth_and_symmetric:
            raise BadArgument("scene", self, "must be a symmetric one of microblocks under a smooth obstacle")
        return contact_line.coalescence(self.line, OUTER_AT_TOUCH*self.body.solid.ell, order)

    def _features(self):
        """Abscissae of the contact point at which a corner meets a kink, or an end, of the obstacle."""
        shifts = self._shifts()
        grading = self.body.solid.ell*KINK_RATIO**np.arange(KINK_LEVELS)
        kinks = {kink + shift for kink in getattr(self.obstacle, "kinks", ()) for shift in shifts}
        graded = {float(kink + sign*step) for kink in kinks for step in (0.0, *grading) for sign in (1, -1)}
        return tuple(sorted(graded)), tuple(end + shift for end in getattr(self.obstacle, "ends", ()) for shift in shifts)

    def _shifts(self):
        half = self.body.solid.ell/2
        return (0.0,) if len(self.law.corners) == 1 else (half, -half)

    def _topology(self, load, cells):
        """Zones of each corner as a coarse uniform grid sees them."""
        reach = self._reach(load)
        for _ in range(12):
            x = np.linspace(-reach, reach, cells + 1 - cells % 2)
            compliance = self.body.compliance(x, clamped=self.law.clamps_rotation)
            flexibility, gaps, share = compliance.corner_system(self.law, self.obstacle)
            if self.symmetric and len(self.law.corners) == 2:      # B mirrors A
                half = len(x)
                folded = flexibility[:half, :half] + flexibility[:half, half:][:, ::-1]
                closed = active_set.solve(folded, gaps[:half], load=load/2, c=share[:half]).closed
                closed = np.array((closed, closed[::-1]))
            else:
                closed = active_set.solve(flexibility, gaps, load=load, c=share).closed.reshape(len(self.law.corners), -1)
            outer = np.abs(x[closed.any(axis=0)]).max(initial=0.0)
            if outer > 0.95*reach or outer == 0:
                reach *= 1.6
            elif MARGIN*1.5*outer < reach and outer > 3*(x[1] - x[0]):
                reach = MARGIN*outer
            else:
                break
        return self._zones(x, closed)

    def _zones(self, x, closed):
        """{corner: intervals} of the closed cells; the corners' edges are set apart where a cell cannot tell them."""
        width = x[1] - x[0]
        zones = {}
        for corner in self.line.corners:
            flags = np.concatenate(([False], closed[corner], [False]))
            starts, stops = np.flatnonzero(np.diff(flags.astype(int)) == 1), np.flatnonzero(np.diff(flags.astype(int)) == -1)
            zones[corner] = tuple((x[i] - width/2, x[j - 1] + width/2) for i, j in zip(starts, stops))
        _, fixed = self._features()
        snapped = {corner: tuple(tuple(self._snap(edge, fixed, width) for edge in interval) for interval in intervals)
                   for corner, intervals in zones.items()}
        return self._set_apart(snapped, width)

    @staticmethod
    def _snap(edge, fixed, width):
        close = [end for end in fixed if abs(end - edge) < 1.5*width]
        return min(close, key=lambda end: abs(end - edge), default=edge)

    def _set_apart(self, zones, width):
        """Outer edges of the two corners that fall on one cell are moved a partial zone's width apart."""
        if len(self.law.corners) == 1:      # exactly symmetric where the scene is
            return {0: ((-zones[0][-1][1], zones[0][-1][1]),)} if self.line.mirror else zones
        if not all(zones.values()):
            return zones
        apart = PARTIAL*self.body.solid.ell
        first, last = zones[0][0][0], zones[0][-1][1]
        if self.line.mirror:
            if abs(last + first) < 1.5*width and apart < 3*width:
                return {0: ((apart - last, last), *zones[0][1:])} if len(zones[0]) == 1 else zones
            return zones
        a, b = list(map(list, zones[0])), list(map(list, zones[1]))
        if abs(a[0][0] - b[-1][1]) < width/4:      # the two meet on one cell: overlapping a little, to begin with
            a[0][0], b[-1][1] = a[0][0] - width/4, b[-1][1] + width/4
        if abs(a[0][0] - b[0][0]) < 1.5*width and apart < 3*width:
            a[0][0] = b[0][0] + apart
        if abs(a[-1][1] - b[-1][1]) < 1.5*width and apart < 3*width:
            b[-1][1] = a[-1][1] - apart
        return {0: tuple(map(tuple, a)), 1: tuple(map(tuple, b))}

    def _reach(self, load):
        """Half-width of a first coarse grid: where a classical contact would carry the load, and a block more."""
        height = getattr(self.obstacle, "height", self.obstacle)
        reach = self.body.solid.ell/100
        for _ in range(200):
            rise = np.ptp(np.minimum(height(np.linspace(-reach, reach, 9)), 1e300))
            if 1.3*self.body.solid.E_star*rise >= load:
                return 1.5*reach + self.body.solid.ell
            reach *= 1.3
        raise NotConverged(f"the obstacle does not rise enough to carry the load {load:g}")


def _either_side(zones, mirror):
    """These zones, and where two of the corners nearly meet also the same taken apart, or joined."""
    if mirror and zones[0]:
        (left, right), *rest = zones[0]
        if abs(left) < MEETING*right:
            return [zones, {0: ((-0.3*left, right), *rest)}]
    elif len(zones) == 2 and all(zones.values()):
        (a, outer), (b, inner) = zones[0][0], zones[1][-1]
        if abs(a - inner) < MEETING*(outer - b):
            middle, half = (a + inner)/2, 0.15*(a - inner)
            return [zones, {0: ((middle - half, outer), *zones[0][1:]), 1: (*zones[1][:-1], (b, middle + half))}]
    return [zones]
