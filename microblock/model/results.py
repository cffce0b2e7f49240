"""How results show themselves: in a line of a terminal, in the file of a figure, as plain data, as labelled
data sets, and in files.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from ..errors import require_place, writing
from .archive import Saved
from .types import Axes, Figure, Interval, Target
from .views import tables

if TYPE_CHECKING:
    import xarray


# names of what all states have, of what those in the plane have besides, of what friction adds, and of what
# those in space have
LISTED = {
    "all": (
        "load", "approach", "contact_area", "energy", "error_estimate", "residual", "iterations", "unknowns",
        "method", "warnings", "weights", "pressure", "pressures", "micromoment", "psi", "displacement",
    ),
    "plane": ("half_width", "zones", "error_parts", "x"),
    "friction": ("shear", "dissipation", "work", "tangential_approach", "shear_traction", "slip"),
    "space": ("points", "shape", "x1", "x2", "width", "seen_width", "closed", "opposite", "accuracy"),
}  # fmt: skip


class PlainData(Saved):
    """Base of results as plain data; `_keys` names the attributes."""

    _keys: ClassVar[tuple[str, ...]] = ()

    def to_dict(self) -> dict[str, Any]:
        """Returns the numbers, arrays, intervals and texts among the attributes, by their names.

        Returns
        -------
        dict
            Plain data for JSON in full precision: arrays and tuples are lists, results and events
            dictionaries; NaN and infinity None.

        Examples
        --------
        >>> solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)
        >>> problem = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Microblock())
        >>> problem.path(load=1.0).to_dict()["events"][0]["kind"]
        'born'
        """
        return {name: plain_data(getattr(self, name)) for name in self._keys}

    def to_xarray(self) -> xarray.Dataset:
        """Returns the result as a labelled data set, with units in attributes.

        Returns
        -------
        xarray.Dataset
            Of a state over "x" (in space over "point", or "x1" and "x2" of a grid), of a history over "state"
            and "point", with NaN where a state has fewer points; events over "event". Texts are attributes.

        Raises
        ------
        MissingExtra
            If xarray is not installed.

        Examples
        --------
        >>> solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)
        >>> problem = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Microblock())
        >>> data = problem.solve(load=1.0).to_xarray()
        >>> data.pressures.dims, data.pressures.units, round(float(data.weights @ data.pressure), 9)
        (('corner', 'x'), 'stress', 1.0)
        """
        return tables().data_set(self)


def plain_data(value: Any) -> Any:
    """Returns a value as JSON has it, None for NaN or infinity."""
    if isinstance(value, PlainData):
        return value.to_dict()
    if is_dataclass(value):
        value = {entry.name: getattr(value, entry.name) for entry in fields(value)}
    if isinstance(value, Mapping):
        return {str(name): plain_data(entry) for name, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain_data(entry) for entry in value]
    if isinstance(value, (np.ndarray, np.generic)):
        objects = np.where(np.isfinite(value), value, np.array(None))  # numbers of Python and None
        return objects.tolist()
    return None if isinstance(value, float) and not math.isfinite(value) else value


def line(title: str, words: str, warnings: Iterable[str] = ()) -> str:
    """Returns what a terminal shows of a result, warnings below."""
    return f"<{title}: {words}{''.join(f'{chr(10)}  warning: {text}' for text in warnings)}>"


def number(value: float | None) -> str:
    """Returns a number in four digits, None as a dash."""
    return "-" if value is None else f"{value:.4g}"


def intervals(pairs: Iterable[Interval]) -> str:
    """Returns a union of intervals in words, many as number and length."""
    pairs = [(float(left), float(right)) for left, right in pairs]
    if not pairs:
        return "none"
    if len(pairs) > 4:
        return f"{len(pairs)} intervals, {number(sum(right - left for left, right in pairs))} together"
    return ", ".join(f"[{number(left)}, {number(right)}]" for left, right in pairs)


def saved(drawing: Any, file: Target, ax: Axes | None, warnings: Iterable[str], caption: str = "") -> Figure:
    """Returns a Figure, unless it is that of an axis with caption and warnings above it, written to a file if
    there is one; raises BadArgument where no file can be.
    """
    if ax is None and (warnings or caption):
        lines = [caption or drawing.get_suptitle(), *(f"Warning: {text}" for text in warnings)]
        # broken to the width of the figure: `wrap` alone breaks lines after the layout has made room for them
        broken = (fill(line, int(14 * drawing.get_figwidth())) for line in "\n".join(lines).splitlines())
        drawing.suptitle("\n".join(broken).strip(), fontsize=8, parse_math=False, wrap=True)
    if file is not None:
        require_place(file, "file", formats := drawing.canvas.get_supported_filetypes())
        path = Path(file)
        has_format = path.suffix[1:].lower() in formats  # what follows another point may be a number's digits
        with writing(file, "file"):
            drawing.savefig(path if has_format else path.with_name(f"{path.name}.png"))
    return drawing
