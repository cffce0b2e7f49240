"""Results as plain data, as JSON has them: dictionaries, lists, texts, numbers, and None where a number does
not exist.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any, ClassVar

import numpy as np


class PlainData:
    """Base of results that return themselves as plain data; `_keys` names the attributes."""

    _keys: ClassVar[tuple[str, ...]] = ()

    def to_dict(self) -> dict[str, Any]:
        """Returns the numbers, arrays, intervals and texts among the attributes, by their names.

        Returns
        -------
        dict
            Plain data for JSON in full precision: arrays are lists (of lists), tuples are lists, parts that
            are results or events are dictionaries, and a number that is NaN or infinite is None.
        """
        return {name: plain_data(getattr(self, name)) for name in self._keys}


def plain_data(value: Any) -> Any:
    """Returns a value as JSON has it, and None for numbers that are NaN or infinite."""
    if isinstance(value, PlainData):
        return value.to_dict()
    if is_dataclass(value):
        value = {entry.name: getattr(value, entry.name) for entry in fields(value)}
    if isinstance(value, Mapping):
        return {str(name): plain_data(one) for name, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain_data(one) for one in value]
    if isinstance(value, (np.ndarray, np.generic)):
        return np.where(
            np.isfinite(value), value, np.array(None)
        ).tolist()  # of objects: floats of Python and None
    return None if isinstance(value, float) and not math.isfinite(value) else value
