"""What scenes of every kind have in common: they show themselves, and sessions with sliders go on with them."""

from . import law, obstacles
from .display import Shown
from .errors import NotConverged, require_kind


class SceneView(Shown):
    """Base of scenes that have `obstacle`, `law` and `solid` and give states `at(load, rtol)`."""

    stands_on = "body", (object,), ""      # attribute, classes that it may have, and these in words
    usual_rtol = None      # of `at`, where a session is not told

    def __post_init__(self):
        """BadArgument for a body, an obstacle or a law that is none."""
        name, kinds, words = self.stands_on
        require_kind(kinds, words, **{name: getattr(self, name)})
        obstacles.check(self.obstacle)
        law.check(self.law)

    def explore(self, load, rtol=None):
        """Sliders for load, psi0, radius, alpha and law with a picture that follows (in Jupyter, extra `notebook`).

        `load` is where they begin; `alpha` is ell over the half-width of a classical contact under it. A half-plane, cells
        and a body on a mesh answer while a slider moves (alpha of a body on a mesh costs a factorisation); fitted meshes
        are made anew for each state, which takes longer.

        Raises
        ------
        MissingExtra
            Without ipywidgets. `microblock.Explorer` does the same from a script.
        """
        from .explorer import Explorer      # here, with matplotlib: a script that only solves does without
        from .widgets import explore
        return explore(Explorer(self, load, rtol))

    def opened(self, load, rtol):
        """(scene, state at the load) with which a session begins: the scene on the mesh, if any, that rtol has asked for."""
        return self, self.at(load, rtol=rtol)

    def varied(self, solid, obstacle, law):
        """The scene with these; what does not depend on those that differ is kept, not computed again."""
        raise NotImplementedError

    def follow(self, load, rtol, near):
        """The state at a load, soon: `near` is one of a scene that differs little."""
        if self._starts_from(near):
            try:
                return self.at(load, rtol, near=near)
            except NotConverged:      # too far
                pass
        return self.at(load, rtol)

    def _starts_from(self, near):
        """Whether a state can be started from that one."""
        return True
