"""What results and solvers ask of a contact problem, which stands above them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

from .bodies import BodyLike
from .law import Law
from .material import Cosserat
from .methods import MethodLike
from .types import ObstacleLike


class ContactLike(Protocol):
    """A contact problem, as `microblock.Contact`."""

    @property
    def body(self) -> BodyLike:
        """The body that is pressed."""

    @property
    def obstacle(self) -> ObstacleLike:
        """What presses it, rigid or a second body."""

    @property
    def law(self) -> Law:
        """The contact law."""

    @property
    def method(self) -> MethodLike | None:
        """The method that was named, if one was."""

    @property
    def solid(self) -> Cosserat:
        """The solid of the body."""

    @property
    def solver(self) -> Any:
        """The Solver of the method."""

    @property
    def blocks(self) -> Any:
        """The Blocks of the law on the solid."""

    def solve(self, load: float | None = None, **options: Any) -> Any:
        """Returns the State at a load, or with ``approach=`` at an approach."""

    def states(self, loads: Sequence[float], **options: Any) -> list[Any]:
        """Returns the States at loads, each computed from the one before."""

    def with_(self, **parts: Any) -> ContactLike:
        """Returns the problem with some of its parts replaced."""

    def path(self, load: float, **options: Any) -> Any:
        """Returns the LoadPath up to a load."""

    def history(self, pairs: Any, **options: Any) -> Any:
        """Returns the History through pairs of loads."""
