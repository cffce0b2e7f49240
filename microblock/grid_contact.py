"""Contact on uniform cells, matrix-free: large rough problems, and problems that repeat with a period."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from tqdm.auto import tqdm

from . import projected_cg
from .display import scene_summary
from .errors import (BadArgument, NotConverged, require_finite, require_kind, require_pair, require_positive, require_tolerance,
                     require_whole)
from .grid import Cells, PeriodicHalfPlane
from .halfplane import HalfPlane
from .law import corner_shifts
from .observables import contact_zones, distance, distance_to_ends, runs
from .scene_view import SceneView
from .surface_view import Setting, StateView, surface
from .threads import bounded

FIRST, MOST = 128, 2**21       # cells of the coarsest and finest grid that rtol may ask for
MOST_GIVEN = 2**26             # that may be given: some 20 GB
COARSEST = 1024                # at which halving a given number of cells ends, after two halvings at the earliest
COARSE_RESIDUAL = 0.01         # of the coarser grids, over their nodes: far below what the next one changes
RESIDUAL = 1e-9                # of the state; its pressures are good to some ten times that
ENOUGH = 1e-3                 # of rtol: residual of states that only follow others
SLOWEST = 1.4                  # ratio of successive changes from grid to grid taken for the slowest convergence; 2 is expected


@dataclass(frozen=True, repr=False)
class GridState(StateView):
    """A state on uniform cells.

    Attributes
    ----------
    scene : GridContact
    x, weights : arrays (n,), centres and lengths of the cells
    pressures : array (corners, n), of each corner
    micromoment, psi, sinking : arrays (n,), M of (29) (where psi is prescribed the reaction to it), microrotation, -u2
    load, approach : force per thickness (and per period), approach over the level of the body
    energy : float, half the work of the forces, up to the same level
    kkt : float, largest relative residual of (a), see `microblock.projected_cg.GridForces`
    products : int, spent on this grid
    error_estimate : float, relative L2 error of pressure and micromoment over ell, next to an end of the obstacle, where the
        pressure is infinite, with the distance from it as weight; None without coarser grids
    instead : str, why cells were taken where panels were asked for, "" where they were not
    """

    scene: object
    x: np.ndarray
    weights: np.ndarray
    pressures: np.ndarray
    micromoment: np.ndarray
    psi: np.ndarray
    sinking: np.ndarray
    load: float
    approach: float
    energy: float
    kkt: float
    products: int
    error_estimate: float | None = None
    instead: str = ""

    method = "cells"

    @property
    def warnings(self):
        return super().warnings + ([self.instead] if self.instead else [])

    @property
    def zones(self):
        """{corner number: array (k, 2) of the intervals of cells with pressure}; 0 is A (left), 1 is B (right)."""
        half = self.weights[0]/2
        return {number: np.array([(self.x[first] - half, self.x[last] + half) for first, last in runs(own > 0)]).reshape(-1, 2)
                for number, own in enumerate(self.pressures)}

    @property
    def solid(self):
        return self.scene.body.solid

    @property
    def setting(self):
        return Setting(self.scene.repeated_obstacle, self.scene.law, self.scene.body.solid.ell)

    @property
    def obstacle(self):
        """Of the scene; on a period, without its images."""
        return self.scene.obstacle

    @property
    def named_zones(self):
        """{"A", "B", "full", "contact": intervals} of x1."""
        return contact_zones({number: [tuple(pair) for pair in own.tolist()] for number, own in self.zones.items()},
                             self.scene.law.corners)

    def surface(self, window=None):
        """The Surface at the centres of the cells."""
        return surface(self.setting, self.approach, np.column_stack((self.x, np.zeros_like(self.x))),
                       np.tile([0.0, 1.0], (len(self.x), 1)), pressures=self.pressures, micromoment=self.micromoment,
                       psi=self.psi, sinking=self.sinking)


@dataclass(frozen=True)
class GridContact(SceneView):
    """Frictionless contact of a half-plane with a rigid obstacle, on uniform cells.

    Parameters
    ----------
    body : HalfPlane, or PeriodicHalfPlane for a scene that repeats
    obstacle : an obstacle of `microblock.obstacles`, or a callable height(x); on a period, what it is between
        -period/2 and period/2
    law : a law of `microblock.law`; a callable psi0 is looked at at the centres of the cells
    window : (left, right), for a HalfPlane: where the obstacle may touch

    Examples
    --------
    >>> solid = mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1)
    >>> scene = mb.GridContact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Microblock(), window=(-1, 1))
    >>> state = scene.at(1.0, rtol=0.1)
    >>> state.error_estimate <= 0.1, len(state.x) >= 512
    (True, True)
    """

    body: object
    obstacle: object
    law: object
    window: tuple | None = None

    stands_on = "body", HalfPlane, "a HalfPlane or a PeriodicHalfPlane (mb.HalfPlane(solid)?)"
    usual_rtol = 1e-2

    @property
    def solid(self):
        return self.body.solid

    def varied(self, solid, obstacle, law):
        """The scene with these, on the same period or window."""
        body = type(self.body)(solid, *(() if self._period is None else (self._period,)))
        return replace(self, body=body, obstacle=obstacle, law=law)

    def follow(self, load, rtol, near):
        """The state at a load on as many cells as one `near`, or on more if rtol asks for them."""
        state = self.at(load, nodes=len(near.x), residual=max(RESIDUAL, ENOUGH*rtol))
        return state if state.error_estimate <= rtol else self.at(load, rtol=rtol)

    def summary(self):
        where = f"window {self.window}" if self._period is None else f"period {self._period:g}"
        return scene_summary("GridContact", f"half-plane on cells, {where}", self.body.solid, self.obstacle, self.law)

    def __post_init__(self):
        super().__post_init__()
        if isinstance(self.body, PeriodicHalfPlane):
            if self.window is not None:
                raise BadArgument("window", self.window, "belongs to a half-plane without images; here it is the period")
            return
        if self.window is None:
            raise BadArgument("window", None, "must be (left, right): where the obstacle may touch")
        require_pair(window=self.window)

    @bounded
    def at(self, load=None, *, approach=None, nodes=None, rtol=None, residual=RESIDUAL, start=None, progress=False):
        """The state at a load or an approach, on so many nodes, or on as many as a tolerance asks for.

        The grids below are solved first, each from the one before. Pressures are compared as polygons through the
        centres; the error of the state is taken for the last change, or more where changes fall by less than two.

        Parameters
        ----------
        load, approach : float, one of them; on a period the load of one period, the approach over the mean level
        nodes : int
        rtol : float, relative L2 error of pressure and of micromoment over ell, both over the pressure; 1e-2 without nodes
        residual : float, to which (a) is solved
        start : GridState of a nearby scene; coarser grids are then left out, and its `error_estimate` is None
        progress : bool, a bar of the cells of all grids; grids that are done are kept if that is interrupted, and the same
            call goes on with the next

        Returns
        -------
        GridState

        Raises
        ------
        NotConverged
            If the accuracy is out of reach, or the contact reaches the end of the window.
        """
        if nodes is not None and rtol is not None:
            raise BadArgument("rtol", rtol, "chooses the nodes: not together with nodes")
        self._check(load, approach, nodes, rtol, residual, start)
        if start is not None:
            return self._solve(nodes or len(start.x), load, approach, start, residual)
        if nodes is not None:
            *_, last = self._states(load, approach, halvings(nodes), residual, progress)
            return last
        rtol = self.usual_rtol if rtol is None else rtol
        doublings = FIRST*2**np.arange(int(np.log2(MOST/FIRST)) + 1)
        state = self.upto(load, rtol, doublings, approach=approach, residual=residual, progress=progress)
        if state.error_estimate <= rtol:
            return state
        raise NotConverged(f"error {state.error_estimate:.1e} instead of {rtol:g} on {len(state.x)} nodes; a fitted scene "
                           "(Contact) reaches more under smooth obstacles", reached=state.error_estimate)

    def upto(self, load, rtol, sizes, least=4*FIRST, approach=None, residual=RESIDUAL, progress=False):
        """The first state on grids of these sizes that has rtol and at least so many cells, or that of the last grid."""
        for state in self._states(load, approach, sizes, residual, progress):
            if state.error_estimate is not None and state.error_estimate <= rtol and len(state.x) >= least:
                break
        return state

    @staticmethod
    def _check(load, approach, nodes, rtol, residual, start):
        """BadArgument for what cannot be asked for."""
        if (load is None) == (approach is None):
            raise BadArgument("load", load, "give either load or approach")
        require_finite(load=0.0 if load is None else load, approach=0.0 if approach is None else approach)
        if load:      # 0 is first touch
            require_positive(load=load)
        require_tolerance(residual, "residual")
        if nodes is not None:
            require_whole(32, MOST_GIVEN, nodes=nodes)
        if rtol is not None:
            require_tolerance(rtol)
        if start is not None:
            require_kind(GridState, "a GridState", start=start)

    def _states(self, load, approach, sizes, residual, progress):
        """States on grids of the given sizes, each started from the one before."""
        state, changes, asked = None, [], (load, approach, residual, sizes[-1])
        done, total = self._interrupted.pop(asked, {}), None if sizes[-1] == MOST else int(sum(sizes))
        with tqdm(total=total, unit=" cells", unit_scale=True, disable=not progress) as bar:
            for size in map(int, sizes):
                try:
                    enough = residual if size == sizes[-1] else max(residual, COARSE_RESIDUAL/size)
                    finer = done[size] = done.get(size) or self._solve(size, load, approach, state, enough)
                except KeyboardInterrupt:
                    self._interrupted[asked] = done
                    raise
                if state is not None:
                    changes.append(difference(finer, state, self.body.solid.ell, self._period, self._end_weights(finer.x)))
                state = finer
                bar.update(size)
                yield replace(state, error_estimate=_estimate(changes))

    @cached_property
    def _interrupted(self):
        """{what was asked for: {cells: state}} of the grids that were done."""
        return {}

    @property
    def _period(self):
        return getattr(self.body, "period", None)

    def _end_weights(self, x):
        """1, and towards ends of the obstacle, where the pressure has no bound, falling with the distance."""
        return distance_to_ends(x, getattr(self.obstacle, "ends", ()), corner_shifts(self.law, self.body.solid.ell))

    def _cells(self, nodes):
        if self._period is not None:
            return Cells(self.body, -self._period/2, self._period/2, nodes)
        return Cells(self.body, *self.window, nodes)

    @property
    def repeated_obstacle(self):
        """The obstacle; on a period, with its images."""
        return self.obstacle if self._period is None else _repeated(self.obstacle, self._period)

    def _gaps(self, x):
        normals = np.tile([0.0, 1.0], (len(x), 1))
        gaps = self.law.initial_gaps(np.column_stack((x, np.zeros_like(x))), normals, self.body.solid.ell, self.repeated_obstacle)
        return np.array(list(gaps.values()))

    @cached_property
    def _grids(self):
        return {}

    @bounded
    def prepare(self, nodes):
        """Cells, flexibility and initial gaps on so many nodes, made once and kept for further loads."""
        require_whole(1, MOST_GIVEN, nodes=nodes)
        if nodes not in self._grids:
            cells = self._cells(nodes)
            self._grids[nodes] = cells, cells.flexibility(self.law), self._gaps(cells.x)
        return self._grids[nodes]

    def _solve(self, nodes, load, approach, start, residual):
        cells, flexibility, gaps = self.prepare(nodes)
        forces = None
        if start is not None:
            forces = np.array([_polygon(cells.x, start.x, p, self._period) for p in start.pressures])*cells.width
        found = projected_cg.solve(flexibility, gaps, load=load, approach=approach, start=forces, rtol=residual)
        self._check_window(cells, found.forces)
        return self._state(cells, flexibility, gaps, found)

    def _check_window(self, cells, forces):
        if self._period is not None:
            return
        outside = self._gaps(np.array((cells.x[0] - cells.width, cells.x[-1] + cells.width)))
        if np.any((forces[:, [0, -1]] > 0) & np.isfinite(outside)):
            raise NotConverged(f"the contact reaches the end of the window {self.window}; widen it")

    def _state(self, cells, flexibility, gaps, found):
        half, pressures = self.body.solid.ell/2, found.forces/cells.width
        sinking, phi = flexibility.surface(found.forces)
        if len(pressures) == 2:
            moment = half*(flexibility.levers*pressures).sum(axis=0)
        elif self.law.clamps_rotation:
            moment, phi = half*flexibility.besides(pressures), np.zeros(cells.count)
        else:
            moment, phi = np.zeros(cells.count), flexibility.besides(found.forces)
        sunk = np.where(found.forces > 0, found.approach - gaps, 0)
        return GridState(self, cells.x, np.full(cells.count, cells.width), pressures, moment, phi/half, sinking, found.load,
                         found.approach, float(np.sum(sunk*found.forces)/2), found.kkt, found.products)


def difference(finer, coarser, ell, period=None, weights=1.0):
    """max(|dp|, |dM|/ell)/|p| in L2 with these weights on the centres of the finer grid, both states as polygons."""
    def change(name):
        fine, coarse = (np.atleast_2d(getattr(state, name)).sum(axis=0) for state in (finer, coarser))
        return fine - _polygon(finer.x, coarser.x, coarse, period)

    weights = np.broadcast_to(weights, len(finer.x))
    return distance(weights, change("pressures"), change("micromoment")/ell, finer.pressures.sum(axis=0))


def _estimate(changes):
    """Error of the last state from the changes from grid to grid, a geometric series of a ratio between SLOWEST and 2.

    A last change that is more than twice smaller than the one before is luck, where a cell falls on an edge.
    """
    if not changes:
        return None
    before, last = changes[-2:] if len(changes) > 1 else (2*changes[-1], changes[-1])
    last = max(last, before/2)
    return last/(max(before/last, SLOWEST) - 1) if last else 0.0


def halvings(nodes):
    """Sizes of the grids below one of so many nodes, and its own, ascending."""
    sizes = [nodes]
    while sizes[-1] > 2*COARSEST or len(sizes) < 3:
        sizes.append((sizes[-1] + 1)//2)
    return sizes[::-1]


def _polygon(x, nodes, values, period):
    if period is None:
        return np.interp(x, nodes, values)
    return np.interp(x, np.concatenate((nodes[-1:] - period, nodes, nodes[:1] + period)),
                     np.concatenate((values[-1:], values, values[:1])))


def _repeated(obstacle, period):
    """An obstacle's height with a period."""
    height = getattr(obstacle, "height", obstacle)
    if not callable(height):
        return obstacle      # refused by name in `obstacles.gap`
    return lambda x: height((np.asarray(x, float) + period/2) % period - period/2)
