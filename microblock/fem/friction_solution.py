"""Histories with friction of bodies on meshes: their states, by the monolithic Newton method or condensed."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..corners.follower import AT_LIMIT, Follower
from ..corners.nodal import zones_of
from ..errors import BadArgument
from ..halfplane.friction_events import events
from ..model import law as laws
from ..model.deformable import body_of
from ..model.history import History, OfMoment
from ..model.state import State
from .body_solution import BodySolution
from .friction import FrictionFacets, MonolithicFriction
from .newton_solver import NewtonSolution
from .slip_nodes import slip_nodes


class _AtNodes(OfMoment):
    """Base of solutions at nodes with `touching` and `sticks`, boolean arrays (n,) in the order of x1."""

    @property
    def tangential_approach(self):
        """Displacement of the obstacle along x1."""
        return self.moment.offset

    @cached_property
    def zones_by_name(self):
        """Zones of the corners, and those of nodes in contact that stick and that slip."""
        bound = self.law.friction * self.pressures.sum(axis=0)
        stick = self.sticks & (np.abs(self.shear_traction) < bound - AT_LIMIT * bound.max())
        own = {"stick": stick, "slip": self.touching & ~stick}
        plain = laws.Unilateral()
        return super().zones_by_name | {
            name: zones_of(self.x, flags[None], plain, self.apart, self.end)["contact"]
            for name, flags in own.items()
        }


@dataclass(frozen=True, eq=False, repr=False)
class NewtonFrictionSolution(_AtNodes, NewtonSolution):
    """A solution of the monolithic Newton method at a pair of loads.

    Attributes
    ----------
    moment : friction.NodalFriction, nodes as the facets have them
    error_estimate : float, relative error from meshes of twice the length; None on a mesh that was prescribed
    """

    moment: Any = None
    error_estimate: float | None = None

    @property
    def _facets(self):
        return self.moment.newton.facets.nodes

    @property
    def shear_traction(self):
        """q at the nodes, array (n,)."""
        return self.moment.shear_traction[self._order]

    @property
    def slip(self):
        """Way of the obstacle over the surface since first contact, array (n,)."""
        return self.moment.slip[self._order]

    @property
    def touching(self):
        """Nodes in contact, boolean array (n,)."""
        return (self.moment.stick | (self.moment.slips != 0))[self._order]

    @property
    def sticks(self):
        """Nodes that stick, boolean array (n,)."""
        return self.moment.stick[self._order]


@dataclass(frozen=True, eq=False, repr=False)
class BodyFrictionSolution(_AtNodes, BodySolution):
    """A solution on the contact nodes of a condensed body at a pair of loads.

    Attributes
    ----------
    moment : corners.follower.Moment
    """

    moment: Any = None

    end = None

    @property
    def nodes(self):
        """The body condensed to its contact nodes, with displacements along them."""
        return slip_nodes(self.solver)

    @property
    def touching(self):
        """Nodes in contact, boolean array (n,)."""
        return self.closed.any(axis=0)

    @property
    def sticks(self):
        """Nodes that stick, boolean array (n,)."""
        return self.moment.stick

    @property
    def _loads(self):
        """Nodal forces along n, moments and forces along the surface, array (3 n,)."""
        return self.nodes.loads(self.law, self.forces, self.moment.tangential)

    @cached_property
    def _moved(self):
        return np.split(self.nodes.response @ self._loads, 3)

    @property
    def psi(self):
        """At the nodes, array (n,)."""
        return self._moved[1]

    @property
    def displacement(self):
        """-u.n at the nodes, array (n,)."""
        return -self._moved[0]

    @property
    def micromoment(self):
        """M of corner forces and shear traction; where psi is prescribed, the reaction to it."""
        if self.law.clamps_rotation:
            return super().micromoment
        return self._loads[len(self.x) : 2 * len(self.x)] / self.weights

    @cached_property
    def fields(self):
        """Displacement, microrotation and stresses as NGSolve functions, by one back-substitution."""
        return self.nodes.fields(*np.split(self._loads, 3))


def _check(solver, rtol):
    """BadArgument for what histories on a mesh do not know: an rtol, an obstacle that deforms."""
    if body_of(solver.obstacle) is not None:
        raise BadArgument(
            "obstacle", solver.obstacle, "deforms: histories on a mesh take rigid obstacles alone"
        )
    if rtol is not None:
        raise BadArgument(
            "rtol", rtol, "is not for histories on a mesh, which stays as it is: refine it yourself"
        )


def of_newton(solver, pairs, coupled, rtol):
    """The History of a NewtonSolver through pairs, array (n, 2)."""
    _check(solver, rtol)
    if solver.options.kind != "al":
        raise BadArgument("kind", solver.options.kind, 'does not follow friction: Newton("al") does')
    facets = FrictionFacets(solver.supported, solver.law, solver.obstacle, solver.body.contact)
    newton = MonolithicFriction(facets, coupled=coupled)
    found, unknowns = list(newton.follow(pairs)), newton.unknowns
    states = [State(NewtonFrictionSolution(solver, one.nodal, unknowns, one)) for one in found]
    changes, friction = found[-1].changes, solver.law.friction
    return History(solver.contact, states, _events(changes, friction, states[-1], pairs))


def of_body(solver, pairs, coupled, rtol):
    """The History of a BodySolver through pairs, array (n, 2)."""
    _check(solver, rtol)
    nodes = slip_nodes(solver)
    contact = nodes.frictional(solver.law, solver.obstacle, coupled)
    path, states, count = Follower(contact), [], len(solver.law.corners)
    for P, Q in pairs:
        moment = path.to(float(P), float(Q))
        solution = BodyFrictionSolution(
            solver,
            moment.load,
            moment.approach,
            moment.normal.reshape(count, -1),
            contact.gaps.reshape(count, -1),
            solver.together(moment.closed),
            moment.residual,
            len(path.changes),
            moment=moment,
        )
        states.append(State(solution))
    return History(solver.contact, states, _events(path.changes, contact.friction, states[-1], pairs))


def _events(changes, friction, state, pairs):
    """HistoryEvents on the nodes of a state, which stand for half the way to their neighbours."""
    borders = np.concatenate((state.x[:1], (state.x[1:] + state.x[:-1]) / 2, state.x[-1:]))
    return events(changes, friction, np.column_stack((borders[:-1], borders[1:])), pairs)
