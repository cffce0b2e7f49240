"""Results that come back from files."""

import os

from ..model.archive import read
from ..model.events import LoadPath
from ..model.history import History
from ..model.state import State


def load(file: str | os.PathLike[str]) -> State | LoadPath | History:
    """Returns what `save` of a State, LoadPath or History has written to a file, digit by digit.

    Parameters
    ----------
    file : str or path

    Returns
    -------
    State, LoadPath or History
        What lies between the points of a state is refused by name.

    Raises
    ------
    BadArgument
        If there is no such file, or it is of a version with other parts.

    Examples
    --------
    >>> solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)
    >>> problem = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Microblock())
    >>> problem.path(load=1.0).save("path.npz")
    >>> path = mb.load("path.npz")
    >>> path.events == problem.path(load=1.0).events, path.problem == problem, path.at(0.5).load
    (True, True, 0.5)
    """
    return read(file)
