"""Obstacles from text files of samples, as instruments write them."""

from __future__ import annotations

import codecs
import csv
import os
import re
import unicodedata
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..errors import LARGEST, BadArgument, require, require_values, require_whole, shown
from ..model.obstacles import Obstacle, Samples
from ..model.types import Array

# cells without a number
MISSING = {"", "-", "--", "---", "*", "***", "nan", "na", "n/a", "#n/a", "null", "none", "bad", "no data"}
MISSING.add("-99999.9999")  # of Keyence
METRES = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "nm": 1e-9, "å": 1e-10}
METRES |= {"inch": 0.0254, "mil": 2.54e-5}
SPELT = {"μm": "um", "micron": "um", "microns": "um", "angstrom": "å", "angstroms": "å", "inches": "inch"}
PREFIXES = {"": "m", "centi": "cm", "milli": "mm", "micro": "um", "nano": "nm"}
SPELT |= {prefix + word: unit for prefix, unit in PREFIXES.items() for word in ("meter", "metre")}
SPELT |= {f"{word}s": unit for word, unit in SPELT.items() if word.endswith(("meter", "metre"))}
# words of the header that call the unit that follows that of one axis
AXES = {"horizontal": "x", "lateral": "x", "vertical": "z", "height": "z"}
TITLES = {"x": {"x", "lateral", "distance", "position", "scan", "length"}, "z": {"z", "height", "profile"}}
BY_COLUMNS = "not by column: say the units by columns, such as 1:um 2:nm"
COUNTS = {"", "index", "no", "nr", "n", "i", "row", "point"}  # titles of columns that number the rows
NO_COLUMNS = "has no two columns of numbers"
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

    x: Array
    z: Array
    unit: str | None
    understood: list[str]


class _Table(NamedTuple):
    """Numbers of a text, array (n, columns), the titles of the columns, the lines above and below them."""

    numbers: Array
    titles: list[str]
    above: list[str]
    below: list[str]


class _Column(NamedTuple):
    """Number of a column, from 0, and its unit, None where it is not known."""

    number: int
    unit: str | None


class _Layout(NamedTuple):
    """What stands between the cells of a row, None for blanks, and whether commas are decimal signs."""

    separator: str | None
    decimal_comma: bool

    def numbers(self, line: str) -> list[float]:
        """Returns the numbers of a line, NaN for those that are missing; none if it holds anything else."""
        numbers = []
        for cell in _cells(line, self.separator):
            text = cell
            if self.decimal_comma and "." not in cell:
                text = cell.replace(",", ".")
            if cell.lower() in MISSING:
                text = "nan"
            try:
                numbers.append(float(text))
            except ValueError:
                return []
        if "_" in line or any(abs(number) > LARGEST for number in numbers):
            return []
        return numbers


class _NoProfile(Exception):
    """Says of a file why no profile is read from it."""


def read_samples(
    path: str | os.PathLike[str], name: str = "path", noise: float | None = None, **options: Any
) -> Samples:
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


def obstacle_of(
    profile: Profile, path: str | os.PathLike[str], name: str = "path", noise: float | None = None
) -> Samples:
    """Returns the obstacle of a `Profile`; raises BadArgument, by `name`, if it is none."""
    try:
        return Obstacle.from_samples(profile.x, profile.z, noise)
    except BadArgument as failure:
        if failure.name == "noise":
            raise
        raise BadArgument(name, str(path), f"{failure.name} {failure.allowed}") from failure


def read_profile(
    path: str | os.PathLike[str],
    name: str = "path",
    columns: Sequence[int | str] | None = None,
    unit: str | None = None,
    skip: int = 0,
) -> Profile:
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

    require_whole(0, skip=skip)
    target = None
    if unit is not None:
        target = _unit(str(unit))
        require(target, "unit", unit, f"must be one of {', '.join(METRES)}")
    try:
        table = _table(_text(path).splitlines(), skip, columns is not None)
        return _profile(table, _columns(table, columns), target, skip)
    except _NoProfile as failure:
        raise BadArgument(name, str(path), str(failure)) from failure.__cause__


def _profile(table: _Table, columns: tuple[_Column, _Column], target: str | None, skip: int) -> Profile:
    """Returns the profile of the columns of x and height in the unit of `target`, without it in that of x."""
    x_column, z_column = columns
    target = target or x_column.unit
    x = _lengths(table, x_column, target)
    has_x = np.isfinite(x)
    understood = [f"{np.sum(has_x)} samples"]
    for quantity, column in zip(("x", "height"), columns):
        understood.append(f"{quantity} from column {column.number + 1} ({column.unit or 'no unit named'})")
    if target:
        understood.append(f"taken in {target}")
    left_out = {
        "lines above": skip + len(table.above),
        "lines below": len(table.below),
        "rows without x": np.sum(~has_x),
    }
    understood += [f"{lines} left out: {count}" for lines, count in left_out.items() if count]
    return Profile(x[has_x], _lengths(table, z_column, target)[has_x], target, understood)


def _lengths(table: _Table, column: _Column, target: str | None) -> Array:
    """Returns the lengths of a column, array (n,), in the unit of `target`, as they are if none is known."""
    lengths = table.numbers[:, column.number]
    if column.unit is None or target is None:
        return lengths
    return lengths * (METRES[column.unit] / METRES[target])


def _text(path: str | os.PathLike[str]) -> str:
    """Returns the text of a file in UTF-8, UTF-16 with or without a mark, or Latin-1."""
    try:
        if not os.path.isfile(path):  # a device may have no end
            raise _NoProfile("is no file")
        content = Path(path).read_bytes()
    except OSError as failure:
        raise _NoProfile(f"cannot be read ({failure})") from failure
    try:
        text = content.decode(_codec(content))
    except UnicodeDecodeError:
        text = content.decode("latin-1")
    if re.search(r"[\x00-\x08\x0e-\x1f]", text.rstrip("\x1a")):
        raise _NoProfile("is no text that can be read: save it as UTF-8")
    return unicodedata.normalize("NFKC", text).replace("\u2212", "-")  # a minus of typesetters


def _codec(content: bytes) -> str:
    """Returns UTF-16, by its mark or because every second byte of plain text is 0 then, else UTF-8."""
    if content[:2] in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE):
        return "utf-16"
    first_zeros = content[::2].count(0)
    second_zeros = content[1::2].count(0)
    if 4 * max(first_zeros, second_zeros) < len(content):
        return "utf-8-sig"
    if first_zeros > second_zeros:
        return "utf-16-be"
    return "utf-16-le"


def _table(lines: Sequence[str], skip: int, settled: bool) -> _Table:
    """Returns the `_Table` of lines; refuses lines that are no rows of it, and commas that may be decimal
    signs, unless the columns are `settled`.
    """
    texts = {n: line.strip(" \x1a") for n, line in enumerate(lines, 1) if n > skip and line.strip(" \x1a")}
    candidates = {n: line for n, line in texts.items() if line[0] not in "#%!'"}
    layout = _layout(list(candidates.values())[:2000])
    rows = {n: layout.numbers(line) for n, line in candidates.items()}
    width = _width(rows.values())
    complete = [n for n, row in rows.items() if len(row) == width and not np.isnan(row).all()]
    if not complete:
        raise _NoProfile(NO_COLUMNS)
    first = complete[0]
    last = complete[-1]
    if layout.separator == "," and not layout.decimal_comma and not settled:
        filled = max(int(np.isfinite(rows[n]).sum()) for n in complete)
        _refuse_decimal_commas([candidates[n] for n in complete], width, filled)
    for n, line in candidates.items():
        if len(rows[n]) != width and (first <= n <= last or _is_row(line, rows[n], layout, width)):
            words = f"has {shown(line)} in line {n}, where rows have {width} numbers: mend it"
            if sum(place > n for place in complete) > len(complete) / 2:  # above most of them: of the header
                words += f", or leave out all up to it by skip {n}"
            raise _NoProfile(words)
    above = [line.lstrip("#%!' ") for n, line in texts.items() if n < first]
    below = [line for n, line in texts.items() if n > last]
    numbers = np.array([row for n, row in rows.items() if first <= n <= last])
    return _Table(numbers, _titles(above, layout, numbers), above, below)


def _layout(lines: Sequence[str]) -> _Layout:
    """Returns the layout that reads most lines as rows of several numbers, of equals the first."""

    def rows(layout: _Layout) -> int:
        return sum(len(layout.numbers(line)) > 1 for line in lines)

    return max((_Layout(separator, comma) for separator in SEPARATORS for comma in (False, True)), key=rows)


def _width(rows: Iterable[Sequence[float]]) -> int:
    """Returns how many numbers most rows of several have, of equals the first."""
    counts = Counter(map(len, rows))
    widths = {width: count for width, count in counts.items() if width > 1}
    if widths:
        return max(widths, key=widths.__getitem__)
    if counts[1]:
        raise _NoProfile(f"{NO_COLUMNS}, but one: x is missing")
    raise _NoProfile(NO_COLUMNS)


def _refuse_decimal_commas(lines: Sequence[str], width: int, filled: int) -> None:
    """Refuses rows between whose numbers stand commas, if these may be decimal signs: no number has a point,
    and rows have more than two that are filled, or one such as "05".
    """
    if any("." in line for line in lines):
        return
    if filled > 2 or any(re.search(r"\b0\d", line) for line in lines):
        raise _NoProfile(
            "has commas that may be decimal signs: put semicolons between columns, or say by columns which "
            f"of the {width} are x and height, such as 1 {width}"
        )


def _is_row(line: str, numbers: Sequence[float], layout: _Layout, width: int) -> bool:
    """Returns whether a line above or below the table looks like a row of it: it has several numbers alone,
    or as many cells, the first of which is a number.
    """
    cells = _cells(line, layout.separator)
    return len(numbers) > 1 or (len(cells) == width and bool(layout.numbers(cells[0])))


def _titles(above: Sequence[str], layout: _Layout, numbers: Array) -> list[str]:
    """Returns the titles of the columns of numbers, from up to two lines above them, such as names and units;
    columns without a number, behind the last separators, may have none.
    """
    width = numbers.shape[1]
    filled = 1 + int(np.flatnonzero(np.isfinite(numbers).any(axis=0))[-1])
    titles = [""] * width
    for line in above[-2:]:
        splits = [_cells(line, separator) for separator in (layout.separator, *SEPARATORS)]
        splits.append(re.split(r"\s{2,}", line))
        padded = [cells + [""] * (width - len(cells)) for cells in splits if filled <= len(cells) <= width]
        cells = next(iter(padded), [])
        if cells and not any(layout.numbers(cell) for cell in cells[:filled]):
            titles = [f"{title} {cell}".strip() for title, cell in zip(titles, cells)]
    return titles


def _cells(line: str, separator: str | None) -> list[str]:
    """Returns the cells of a line; between blanks a unit in brackets belongs to what stands before."""
    if separator is None:
        return re.split(r"\s+(?![\[(<])", line.strip())
    return [cell.strip() for cell in next(csv.reader([line], delimiter=separator, skipinitialspace=True))]


def _columns(table: _Table, entries: Sequence[int | str] | None) -> tuple[_Column, _Column]:
    """Returns the columns of x and height: those of entries, by number or title with or without a unit, or
    those that are clear; refuses the unit of one alone.
    """
    if entries is None:
        columns = [_Column(number, None) for number in _clear_columns(table)]
    else:
        columns = [_column(table, str(entry)) for entry in require_values(columns=entries)]
    distinct = {column.number for column in columns}
    require(len(columns) == len(distinct) == 2, "columns", entries, "must be two, those of x and height")
    x_column, z_column = (_with_unit(table, column, letter) for column, letter in zip(columns, "xz"))
    if x_column.unit is None and z_column.unit is None:
        _refuse_units_of_no_column(table.above[-1:])
    if (x_column.unit is None) != (z_column.unit is None):
        raise _NoProfile(
            f"names a unit of one column alone, {x_column.unit or z_column.unit}: say both by columns, such "
            f"as {x_column.number + 1}:mm {z_column.number + 1}:um"
        )
    return x_column, z_column


def _refuse_units_of_no_column(lines: Iterable[str]) -> None:
    """Refuses the line above the rows if it names units of length, of columns that are not told."""
    for line in lines:
        units = {unit for unit in _units(line) if len(unit) > 1}  # a letter may be that of a name
        if units:
            raise _NoProfile(f"names {' and '.join(sorted(units))} above the rows, but {BY_COLUMNS}")


def _clear_columns(table: _Table) -> list[int]:
    """Returns the numbers, from 0, of the columns of x and height where titles or values tell them."""
    title_words = [set(re.findall(r"[^\W\d_]+", title.lower())) for title in table.titles]
    filled = [i for i, column in enumerate(table.numbers.T) if np.isfinite(column).any()]
    varied = [i for i in filled if np.nanmin(table.numbers[:, i]) < np.nanmax(table.numbers[:, i])]
    named = [i for letter in "xz" for i in filled if title_words[i] & TITLES[letter]]
    choices = [named, filled]
    if len(filled) == 3 or any(table.titles):  # else a matrix, of which two columns vary
        choices.append(varied)
    if len(filled) > 2 and any("y" in title_words[i] for i in varied):  # a line across, not along x
        choices = [filled, varied]
    for columns in choices:
        if len({*columns}) == len(columns) == 2:
            _refuse_count(table, columns[0])
            return columns
    count = len(table.titles)
    raise _NoProfile(
        f"has {count} columns of numbers: say by columns which are x and height, such as 1 {count}; "
        "height maps are read by RoughSurface.from_file"
    )


def _refuse_count(table: _Table, number: int) -> None:
    """Refuses a column, in place of x, whose values count rows and whose title says so or is missing."""
    title = table.titles[number].strip("#. ").lower()
    counts = bool((np.diff(table.numbers[:, number]) == 1).all())
    if counts and title in COUNTS and any(table.titles):
        words = "counts its rows and has no x: if the count is x, say so by columns, such as"
        raise _NoProfile(f"{words} 1 {len(table.titles)}")


def _column(table: _Table, entry: str) -> _Column:
    """Returns the column of an entry of `columns`, with its unit if the entry has it."""
    label, _, ending = entry.rpartition(":")
    unit = _unit(ending)
    if not (label and unit):
        label = entry
        unit = None
    count = len(table.titles)
    matches = [
        number
        for number, title in enumerate(table.titles)
        if label.strip().lower() in (str(number + 1), title.lower())
    ]
    titles = ", ".join(filter(None, table.titles)) or "none"
    words = f"must be a number from 1 to {count}, or a title: {titles}"
    require(len(matches) == 1, "columns", entry, words)
    return _Column(matches[0], unit)


def _with_unit(table: _Table, column: _Column, letter: str) -> _Column:
    """Returns a column, of x or z, with its unit, if its entry, its title or the header names it; refuses a
    title with a number beside the unit, a factor.
    """
    if column.unit:
        return column
    title = table.titles[column.number]
    unit = _unit(title)
    if unit and re.search(r"[\[(<][^\])>]*\d[^\])>]*[\])>]", title):
        raise _NoProfile(f"has a number in the unit of {title!r}: say by columns, such as 1:um 2:nm")
    return _Column(column.number, unit or _unit_above(table.above, letter))


def _unit(text: str) -> str | None:
    """Returns the unit of length that a text ends with or has in brackets, or None."""
    lower = unicodedata.normalize("NFKC", text).lower()
    brackets = re.findall(r"[\[(<]\s*([^\W\d_]+)\s*[\])>]", lower)
    spelling = SPELT
    if brackets:  # else a word of English
        spelling = SPELT | {"in": "inch"}
    for word in brackets + re.findall(r"[^\W\d_]+", lower)[-1:]:
        unit = spelling.get(word, word)
        if unit in METRES:
            return unit
    return None


def _units(line: str) -> set[str]:
    """Returns the units of length among the words of a line; one letter counts at its end or in brackets."""
    words = re.findall(r"[^\W\d_]{2,}", line.lower())
    units = {SPELT.get(word, word) for word in words} | {_unit(line) or ""}
    return units & set(METRES)


def _unit_above(lines: Iterable[str], letter: str) -> str | None:
    """Returns the unit that the header names, of both columns or of the one called by a letter; refuses
    several.
    """
    units = set[str]()
    for line in lines:
        axes = re.findall(r"\b[xyz](?=\b|[ _-]?units?)", line.lower())
        axes += [AXES[word] for word in re.findall(r"[^\W\d_]+", line.lower()) if word in AXES]
        if "unit" in line.lower() and (not axes or letter in axes):
            units |= _units(line)
    if len(units) > 1:
        raise _NoProfile(f"names {' and '.join(sorted(units))} above the rows, but {BY_COLUMNS}")
    return units.pop() if units else None
