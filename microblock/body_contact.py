"""Contact of a body on a mesh with a rigid obstacle: condensed once, every state and event from its contact nodes.

On the body's own mesh the states are exact for the discrete problem, and so are the path and its events. With an rtol
the mesh is refined first, where `refined.estimate` asks for it.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import groupby

import numpy as np

from . import active_set
from .body import Body
from .body_state import BodyState, zones_of
from .condensation import condensed, require_pressed
from .display import path_summary, scene_summary
from .errors import require_kind, require_positive, require_tolerance
from .observables import zone_changes
from .path import Event, PathView, require_on_path
from .refined import refine_until
from .scene_view import SceneView
from .threads import bounded


@dataclass(frozen=True)
class BodyContact(SceneView):
    """Frictionless contact of a body with a rigid obstacle that comes down along -e2.

    Parameters
    ----------
    body : Body, two-dimensional; all rigid motions held, with the value 0, and u2 nowhere on the contact boundary
    obstacle : an obstacle of `microblock.obstacles`, or a callable height(x)
    law : a law of `microblock.law`; `Microclamped` adds psi = 0 on the contact boundary to the supports
    boundary : str, name or pattern of the contact boundary

    Examples
    --------
    >>> from microblock import meshes
    >>> mesh = meshes.uniform(mb.Ground(far=2.0, reach=(-1.0, 1.0), half=False), 0.5)
    >>> scene = mb.BodyContact(mb.Body(mesh, mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1), order=3, fixed="bottom"),
    ...                        mb.Cylinder(R=10), mb.Microblock())
    >>> scene.load(0.5).at(0.25).load
    0.25
    """

    body: Body
    obstacle: object
    law: object
    boundary: str = "contact"

    stands_on = "body", Body, "a Body"

    def __post_init__(self):
        super().__post_init__()
        require_kind(str, "the name of a boundary", boundary=self.boundary)
        require_pressed(self.body, self.boundary, condensed=True)

    def summary(self):
        words = f"body of {self.body.mesh.ne} elements, order {self.body.order}"
        return scene_summary("Contact scene", words, self.body.solid, self.obstacle, self.law)

    @property
    def solid(self):
        return self.body.solid

    def opened(self, load, rtol):
        state = self.at(load, rtol)
        return state.scene, state

    def varied(self, solid, obstacle, law):
        """The scene with these; the same solid is not condensed again."""
        body = self.body if solid == self.solid else self.body.on(self.body.mesh, solid=solid)
        return BodyContact(body, obstacle, law, self.boundary)

    def follow(self, load, rtol, near):
        """The state at a load on this mesh, whatever rtol; from the closed corners of one `near`."""
        return self.at(load, near=near if len(near.law.corners) == len(self.law.corners) else None)

    @property
    def nodes(self):
        """The body condensed to its contact nodes."""
        return condensed(self.body, self.boundary, self.law.clamps_rotation)

    @cached_property
    def _system(self):
        return self.nodes.compliance.corner_system(self.law, self.obstacle)

    @bounded
    def at(self, load, rtol=None, near=None, progress=False):
        """The state at a load (force per thickness).

        Parameters
        ----------
        rtol : float, relative error of pressures and fields (`refined.estimate`) to which the mesh is refined; None: on
            the mesh as it is; an interrupted refinement goes on when asked again
        near : BodyState of this scene at a nearby load to start from, on the same mesh

        Raises
        ------
        BadArgument
            Also for an obstacle that has no surface above the contact boundary.
        NotConverged
            If supports leave a rigid motion free, or the estimate stays above rtol.
        """
        require_positive(load=load)
        if near is not None:
            require_kind(BodyState, "a BodyState", near=near)
        if rtol is not None:
            require_tolerance(rtol)
            return refine_until(self, load, rtol, progress)
        flexibility, gaps, share = self._system
        start = near.closed.ravel() if near else None
        return self._state(load, active_set.solve(flexibility, gaps, load=load, c=share, start=start))

    def load(self, last, rtol=None, progress=False):
        """The load path from first touch to `last` (force per thickness): `events`, and states `at` any load of it.

        With `rtol` the mesh is that on which the state at the last load reaches it.
        """
        require_positive(load=last)
        if rtol is not None:
            return self.at(last, rtol, progress=progress).scene.load(last)
        return BodyPath(self, last)

    def on(self, mesh):
        """The same scene on another mesh of the same geometry."""
        return BodyContact(self.body.on(mesh), self.obstacle, self.law, self.boundary)

    def _state(self, load, found):
        count, gaps = len(self.law.corners), self._system[1]
        return BodyState(self, load, found.approach, found.forces.reshape(count, -1), gaps.reshape(count, -1),
                         self.together(found.closed), found.kkt, found.iterations)

    def together(self, closed):
        """Closed corners, array (corners, nodes): where psi is held one of them stands for all."""
        closed = closed.reshape(len(self.law.corners), -1)
        return closed | (self.nodes.compliance.held & closed.any(axis=0))


@dataclass(frozen=True, repr=False)
class BodyPath(PathView):
    """The states of a scene from first touch to the load `last`, on one mesh."""

    scene: BodyContact
    last: float

    def summary(self):
        return path_summary(self, self.__dict__.get("events"))

    def at(self, load):
        """The state at a load up to the last one."""
        require_on_path(load, self.last)
        return self.scene.at(load)

    @cached_property
    @bounded
    def nodal_events(self):
        """Every corner that closes or opens on the way (`active_set.Event`), ascending in load; exact for the mesh."""
        flexibility, gaps, share = self.scene._system
        return active_set.path(flexibility, gaps, [self.last], c=share).events

    @cached_property
    def events(self):
        """Zones that are born, merge, split or vanish, ascending in load.

        Zones are those of the nodes, so `load_error` is what the mesh leaves open: the way back to the nodal event before;
        x, also that of first touch, is good to the distance of two nodes.
        """
        law, x = self.scene.law, self.scene.nodes.points[:, 0]
        closed = np.zeros(len(law.corners)*len(x), bool)
        before, previous, found = zones_of(x, closed.reshape(-1, len(x)), law), 0.0, []
        for load, changes in groupby(self.nodal_events, key=lambda event: event.load):
            for change in changes:
                closed[change.corner] = change.kind == "closes"
            after = zones_of(x, self.scene.together(closed), law)
            found += [Event(load, load - previous, kind, zone, place)
                      for zone, intervals in after.items() for kind, place in zone_changes(before[zone], intervals)]
            before, previous = after, load
        return found
