"""The homogeneous half-space x3 < 0 as a body."""

from typing import ClassVar

from ..halfplane.kernels import is_classical
from ..model.bodies import Unbounded
from ..model.methods import Cells
from .symbol import require_stable


class HalfSpace(Unbounded):
    """The half-space x3 < 0 of one solid.

    Obstacles are those of `microblock.model.surfaces`, or any ``height(x1, x2)`` of two arrays.
    Approaches count from the surface far away, on a period from its mean.

    Parameters
    ----------
    solid : Cosserat
        Its ``alpha'`` and ``beta'`` act where blocks turn about the direction in which fields change. One
        with ``beta=0`` serves as the second of two bodies (`Deformable`).
    period : float, optional
        Length after which obstacle and loads repeat along x1 and x2.

    Raises
    ------
    BadArgument
        If the solid is no Cosserat, or lets the surface turn by itself, or the period is not positive.

    Examples
    --------
    >>> solid = mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1)
    >>> problem = mb.Contact(mb.HalfSpace(solid), mb.Sphere(R=10), mb.Microblock(), mb.Cells(nodes=64))
    >>> state = problem.solve(load=1.0)
    >>> radius = (state.contact_area / np.pi) ** 0.5
    >>> round(radius, 2), round(state.approach, 4)      # Hertz has 0.409 and 0.0167 for ell -> 0
    (0.44, 0.0158)
    """

    solvers: ClassVar[dict[type, str]] = {Cells: "halfspace.surface_solver.SurfaceSolver"}
    methods, in_space = (Cells,), True

    def __post_init__(self) -> None:
        super().__post_init__()
        if not is_classical(self.solid):
            require_stable(self.solid)
