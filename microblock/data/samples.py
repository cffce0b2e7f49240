"""Obstacles from files of samples."""

import os
import re
from pathlib import Path

from ..errors import LARGEST, BadArgument, shown
from ..model.obstacles import Obstacle
from .records import number


def read_samples(path, name="path", noise=None):
    """Returns the obstacle of a text file of two columns, x (ascending) and height, with comma, semicolon or
    blanks between; a header and lines with # are left out; `noise` as of `Obstacle.from_samples`.

    Raises BadArgument, by `name` and with the line, if the file holds anything else.

    Examples
    --------
    >>> from microblock.data.samples import read_samples
    >>> with open("samples.csv", "w") as file:
    ...     _ = file.write("x, height\\n-1, 0.5\\n0, 0\\n1, 0.5")
    >>> read_samples("samples.csv").height(np.array([0.5])).tolist()
    [0.25]
    """

    def wrong(words):
        return BadArgument(
            name, str(path), f"{words}; it must hold two columns of numbers with decimal points, x and height"
        )

    try:
        if not os.path.isfile(path):  # a device may have no end
            raise wrong("is no file")
        text = Path(path).read_text("utf-8-sig")
    except (OSError, UnicodeDecodeError) as failure:
        raise wrong(f"is no text that can be read ({failure})") from failure
    numbered = enumerate(map(str.strip, text.splitlines()), 1)
    lines = [(place, line) for place, line in numbered if line and line[0] != "#"]
    samples = []
    for place, line in lines:
        values = [number(cell) for cell in re.split(r"\s*[,;]\s*|\s+", line)]
        known = [value for value in values if isinstance(value, (int, float))]
        if (place, line) == lines[0] and not known:
            continue  # a header
        numbers = tuple(float(value) for value in known if abs(value) <= LARGEST)
        if len(numbers) != 2 or len(values) != 2:
            raise wrong(f"has {shown(line)} in line {place}")
        if samples and not numbers > samples[-1][:1] + (LARGEST,):
            raise wrong(f"does not ascend in x in line {place}, {shown(line)}: sort it, average duplicates")
        samples.append(numbers)
    if len(samples) < 2:
        raise wrong(f"holds {len(samples)} samples of the two that it takes")
    x, height = zip(*samples)
    return Obstacle.from_samples(x, height, noise)
