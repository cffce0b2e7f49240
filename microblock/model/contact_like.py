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
    def body(self) -> BodyLike: ...

    @property
    def obstacle(self) -> ObstacleLike: ...

    @property
    def law(self) -> Law: ...

    @property
    def method(self) -> MethodLike | None: ...

    @property
    def solid(self) -> Cosserat: ...

    @property
    def solver(self) -> Any: ...

    @property
    def blocks(self) -> Any: ...

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
