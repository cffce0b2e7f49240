"""Obstacles from text files of samples, as instruments write them."""

import codecs
import csv
import os
import re
import unicodedata
from collections import Counter
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..errors import LARGEST, BadArgument, require, require_values, require_whole, shown
from ..model.obstacles import Obstacle

# cells without a number
MISSING = {"", "-", "--", "---", "*", "***", "nan", "na", "n/a", "#n/a", "null", "none", "bad", "no data"}
MISSING.add("-99999.9999")  # of Keyence
METRES = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "nm": 1e-9, "å": 1e-10}
METRES |= {"inch": 0.0254, "mil": 2.54e-5}
SPELT = {"μm": "um", "micron": "um", "microns": "um", "micrometer": "um", "angstrom": "å"}
TITLES = {"x": {"x", "lateral", "distance", "position", "scan", "length"}, "z": {"z", "height", "profile"}}
SEPARATORS = ("\t", ";", ",", None)  # None: blanks


class Profile(NamedTuple):
    """What a file of samples holds.

    Attributes
    ----------
    x, z : arrays (n,)
        Abscissae, and heights, NaN where the file has none, in one unit of length.
    unit : str or None
        This unit, None where it is not known.
    understood : list of str
        Which columns, units and lines were read, and what was left out.
    """

    x: np.ndarray
    z: np.ndarray
    unit: str | None
    understood: list[str]


class _Table(NamedTuple):
    """Numbers of a text, array (n, columns), the titles of the columns, the lines above and below them."""

    numbers: np.ndarray
    titles: list[str]
    above: list[str]
    below: list[str]


def read_samples(path, name="path", noise=None, **options):
    """Returns the obstacle of a text file of samples: `noise` as of `Obstacle.from_samples`, other options as
    of `read_profile`.

    Examples
    --------
    >>> from microblock.data.samples import read_samples
    >>> with open("samples.csv", "w") as file:
    ...     _ = file.write("x, height\\n-1, 0.5\\n0, 0\\n1, 0.5")
    >>> read_samples("samples.csv").height(np.array([0.5])).tolist()
    [0.25]
    """
    return obstacle_of(read_profile(path, name, **options), path, name, noise)


def obstacle_of(profile, path, name="path", noise=None):
    """Returns the obstacle of a `Profile`; raises BadArgument, by `name`, if it is none."""
    try:
        return Obstacle.from_samples(profile.x, profile.z, noise)
    except BadArgument as failure:
        if failure.name == "noise":
            raise
        raise BadArgument(name, str(path), f"{failure.name} {failure.allowed}") from failure


def read_profile(path, name="path", columns=None, unit=None, skip=0):
    """Returns the `Profile` of a text file: rows of numbers, with tabs, semicolons, commas or blanks between,
    and points or commas as decimal signs, below a header.

    Parameters
    ----------
    path : str or path
        A file in UTF-8, UTF-16 or Latin-1.
    name : str
        What errors call it.
    columns : pair, optional
        Those of x and height, by numbers (from 1) or titles, where a file has more than two; with the unit
        behind a colon, such as "3:um", where the file does not name it.
    unit : str, optional
        Unit of length that x and heights are brought to; without it the one of x. A file that names no unit
        is taken to be in it.
    skip : int
        Lines to leave out at the beginning.

    Raises
    ------
    BadArgument
        If the file holds no profile, or could be read in several ways; the message names the argument that
        settles it.
    """

    def wrong(words):
        return BadArgument(name, str(path), words)

    require_whole(0, skip=skip)
    target = None if unit is None else _unit(str(unit))
    require(unit is None or target, "unit", unit, f"must be one of {', '.join(METRES)}")
    table = _table(_text(path, wrong).splitlines(), skip, wrong, columns is not None)
    numbers, units = [], []
    for entry in _clear_columns(table, wrong) if columns is None else require_values(columns=columns):
        number, own = _column(table, str(entry))
        letter = "xz"[len(numbers) % 2]
        numbers.append(number)
        units.append(own or _unit(table.titles[number]) or _unit_above(table.above, letter))
    require(len(numbers) == len({*numbers}) == 2, "columns", columns, "must be two, those of x and height")
    if (units[0] is None) != (units[1] is None):
        words = f"names a unit of one column alone, {units[0] or units[1]}: say both by columns, such as "
        raise wrong(words + f"{numbers[0] + 1}:mm {numbers[1] + 1}:um")
    target = target or units[0]
    x, z = (
        table.numbers[:, number] * (METRES[own] / METRES[target] if own else 1.0)
        for number, own in zip(numbers, units)
    )
    there = np.isfinite(x)
    understood = [f"{np.sum(there)} samples"]
    for quantity, number, own in zip(("x", "height"), numbers, units):
        understood.append(f"{quantity} from column {number + 1} ({own or 'no unit named'})")
    if target:
        understood.append(f"taken in {target}")
    left_out = {
        "lines above": skip + len(table.above),
        "lines below": len(table.below),
        "rows without x": sum(~there),
    }
    understood += [f"{lines} left out: {count}" for lines, count in left_out.items() if count]
    return Profile(x[there], z[there], target, understood)


def _text(path, wrong):
    """Returns the text of a file in UTF-8, UTF-16 with or without a mark, or Latin-1."""
    try:
        if not os.path.isfile(path):  # a device may have no end
            raise wrong("is no file")
        content = Path(path).read_bytes()
    except OSError as failure:
        raise wrong(f"cannot be read ({failure})") from failure
    zeros = [content[half::2].count(0) for half in (0, 1)]  # in UTF-16 one half of plain text is 0
    codec = "utf-16-be" if zeros[0] > zeros[1] else "utf-16-le"
    if content[:2] in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE):
        codec = "utf-16"
    elif 4 * max(zeros) < len(content):
        codec = "utf-8-sig"
    try:
        text = content.decode(codec)
    except UnicodeDecodeError:
        text = content.decode("latin-1")
    if re.search(r"[\x00-\x08\x0e-\x1f]", text.rstrip("\x1a")):
        raise wrong("is no text that can be read: save it as UTF-8")
    return unicodedata.normalize("NFKC", text).replace("\u2212", "-")  # a minus of typesetters


def _table(lines, skip, wrong, settled):
    """Returns the `_Table` of lines; raises what `wrong` makes of lines that are no rows of it, and of commas
    that may be decimal signs, unless the columns are `settled`.
    """
    texts = {n: line.strip(" \x1a") for n, line in enumerate(lines, 1) if n > skip and line.strip(" \x1a")}
    plain = {n: line for n, line in texts.items() if line[0] not in "#%!'"}
    ways = [(separator, comma) for separator in SEPARATORS for comma in (False, True)]
    few = list(plain.values())[:2000]
    separator, comma = max(ways, key=lambda way: sum(len(_row(line, *way)) > 1 for line in few))
    rows = {n: _row(line, separator, comma) for n, line in plain.items()}
    widths = Counter(len(row) for row in rows.values() if len(row) > 1)
    if not widths:
        raise wrong("has no two columns of numbers" + ", but one: x is missing" * any(rows.values()))
    width = max(widths, key=widths.__getitem__)
    whole = [n for n, row in rows.items() if len(row) == width and not np.isnan(row).all()]
    filled = max(np.isfinite(rows[n]).sum() for n in whole)
    commas = separator == "," and not comma and not any("." in plain[n] for n in whole)
    if commas and not settled and (filled > 2 or any(re.search(r"\b0\d", plain[n]) for n in whole)):
        raise wrong(
            "has commas that may be decimal signs: put semicolons between columns, or say by columns which "
            f"of the {width} are x and height, such as 1 {width}"
        )
    for n, row in rows.items():
        cells = _cells(plain[n], separator)
        inside = whole[0] <= n <= whole[-1] or len(row) > 1
        if len(row) != width and (inside or len(cells) == width and _row(cells[0], separator, comma)):
            words = f"has {shown(plain[n])} in line {n}, where rows have {width} numbers: mend it"
            header = sum(place > n for place in whole) > len(whole) / 2
            raise wrong(words + f", or leave out all up to it by skip {n}" * header)
    above = [line.lstrip("#%!' ") for n, line in texts.items() if n < whole[0]]
    titles = [""] * width
    for line in above[-2:]:
        split = (_cells(line, way) for way in (separator, *SEPARATORS))
        cells = next((cells for cells in split if len(cells) == width), [])
        if not any(_row(cell, separator, comma) for cell in cells):
            titles = [f"{title} {cell}".strip() for title, cell in zip(titles, cells)] or titles
    numbers = [row for n, row in rows.items() if whole[0] <= n <= whole[-1]]
    return _Table(np.array(numbers), titles, above, [line for n, line in texts.items() if n > whole[-1]])


def _cells(line, separator):
    """Returns the cells of a line; between blanks a unit in brackets belongs to what stands before."""
    if separator is None:
        return re.split(r"\s+(?![\[(<])", line.strip())
    return [cell.strip() for cell in next(csv.reader([line], delimiter=separator, skipinitialspace=True))]


def _row(line, separator, comma):
    """Returns the numbers of a line, NaN for those that are missing; none if it holds anything else."""
    numbers = []
    for cell in _cells(line, separator):
        text = cell.replace(",", ".") if comma and "." not in cell else cell
        try:
            numbers.append(np.nan if cell.lower() in MISSING else float(text))
        except ValueError:
            return []
    plain = "_" not in line and not any(abs(number) > LARGEST for number in numbers)
    return numbers if plain else []


def _clear_columns(table, wrong):
    """Returns the numbers, from 1, of the columns of x and height where titles or values tell them."""
    words = [set(re.findall(r"[^\W\d_]+", title.lower())) for title in table.titles]
    filled = [i for i, column in enumerate(table.numbers.T) if np.isfinite(column).any()]
    varied = [i for i in filled if np.nanmin(table.numbers[:, i]) < np.nanmax(table.numbers[:, i])]
    named = [i for letter in "xz" for i in filled if words[i] & TITLES[letter]]
    across = len(filled) > 2 and any("y" in words[i] for i in varied)
    for columns in ([] if across else named, filled, varied):
        if len({*columns}) == len(columns) == 2:
            return [i + 1 for i in columns]
    count = table.numbers.shape[1]
    raise wrong(f"has {count} columns of numbers: say by columns which are x and height, such as 1 {count}")


def _column(table, entry):
    """Returns the place of a column, from 0, and its unit if it is given, of an entry of `columns`."""
    label, _, own = entry.rpartition(":")
    label = label if _unit(own) and label else entry
    count, known = table.numbers.shape[1], [title.lower() for title in table.titles]
    matches = [number for number in range(count) if label.strip().lower() in (str(number + 1), known[number])]
    words = (
        f"must be a number from 1 to {count}, or a title: {', '.join(filter(None, table.titles)) or 'none'}"
    )
    require(len(matches) == 1, "columns", entry, words)
    return matches[0], _unit(own) if label != entry else None


def _unit(text):
    """Returns the unit of length that a text ends with or has in brackets, or None."""
    lower = unicodedata.normalize("NFKC", text).lower()
    brackets = re.findall(r"[\[(<]\s*([^\W\d_]+)\s*[\])>]", lower)
    units = [SPELT.get(word, word) for word in brackets + re.findall(r"[^\W\d_]+", lower)[-1:]]
    units = ["inch" if unit == "in" and brackets else unit for unit in units]
    return next((unit for unit in units if unit in METRES), None)


def _unit_above(lines, letter):
    """Returns the unit that a line of the header names, of both columns or of the one called by a letter."""
    for line in lines:
        axes = re.findall(r"\b[xyz](?=\b|[ _-]?units?)", line.lower())
        if "unit" in line.lower() and _unit(line) and (not axes or letter in axes):
            return _unit(line)
    return None
