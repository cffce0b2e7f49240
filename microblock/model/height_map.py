"""Measured heights over a surface: samples of a regular grid, and what a roughness is called by."""

from __future__ import annotations

import os
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..errors import (
    BadArgument,
    require,
    require_choice,
    require_flag,
    require_floats,
    require_heights,
    require_kind,
    require_numbers,
)
from . import roughness
from .obstacles import RigidObstacle
from .roughness import Statistics
from .types import Array, Flags

ON_SAMPLE = 1e-9  # of a spacing: nearer to a sample its neighbours do not count, holes among them
SAME = 1e-9  # relative, of the periods along both axes


class HeightMap(RigidObstacle):
    """Heights of a regular grid, bilinear between four samples that are there; no obstacle elsewhere.

    The middle of the map lies over the origin. A periodic map repeats after its columns and rows, each as
    wide as the spacing, so that cells as many as the samples of a period have their heights.

    Parameters
    ----------
    heights : array (rows, columns)
        Heights of the lower side (lengths), columns along x1 and rows along x2; inf where there is none.
    spacing : (float, float)
        Distances of columns and of rows (lengths).
    periodic : bool
    unknown : int
        Number of heights that were masked or NaN, of which states warn.

    Raises
    ------
    BadArgument
        Of `RoughSurface.from_heights`.
    """

    def __init__(
        self, heights: Array, spacing: tuple[float, float], periodic: bool = False, unknown: int = 0
    ) -> None:
        self.heights = heights
        self.spacing = spacing
        self.periodic = periodic
        self.unknown = unknown
        self.heights.setflags(write=False)
        if periodic:
            lengths = self.lengths
            words = f"must make one period, and {lengths[0]:g} along x1 is not {lengths[1]:g} along x2"
            require(abs(lengths[0] - lengths[1]) <= SAME * lengths[0], "spacing", spacing, words)
            self.period = lengths[0]

    def __repr__(self) -> str:
        rows, columns = self.heights.shape
        missing = np.count_nonzero(~self._there)
        holes = f", {missing} of them missing" if missing else ""
        return f"HeightMap({rows} x {columns} heights{holes}, {self.lengths[0]:.4g} x {self.lengths[1]:.4g})"

    @property
    def lengths(self) -> tuple[float, float]:
        """Lengths along x1 and x2 for which the samples stand."""
        rows, columns = self.heights.shape
        return columns * self.spacing[0], rows * self.spacing[1]

    @cached_property
    def _there(self) -> Flags:
        """Whether a sample is there, boolean array (rows, columns)."""
        return np.isfinite(self.heights)

    def height(self, x1: ArrayLike, x2: ArrayLike) -> Array:
        """Returns heights at (x1, x2), arrays of one shape (lengths)."""
        rows, columns = self.heights.shape
        first = self._between(np.asarray(x1, float) / self.spacing[0] + (columns - 1) / 2, columns)
        second = self._between(np.asarray(x2, float) / self.spacing[1] + (rows - 1) / 2, rows)
        below = np.where(self._there, self.heights, 0.0)
        height = np.zeros(np.broadcast_shapes(np.shape(x1), np.shape(x2)))
        missing = np.zeros(height.shape, bool)
        for row, along_row in second:
            for column, along_column in first:
                share = along_row * along_column
                height = height + share * below[row, column]
                missing |= (share != 0) & ~self._there[row, column]
        return np.where(missing | np.isnan(height), np.inf, height)  # nan beyond the map

    def _between(self, place: Array, count: int) -> list[tuple[Any, Array]]:
        """Returns (numbers, shares) of the samples before and behind places, in spacings from the first one;
        nan shares beyond the map.
        """
        nearest = np.rint(place)
        place = np.where(np.abs(place - nearest) <= ON_SAMPLE, nearest, place)
        if self.periodic:
            before = np.floor(place).astype(int)
            share = place - before
            return [(before % count, 1 - share), ((before + 1) % count, share)]
        before = np.clip(np.floor(place), 0, count - 2).astype(int)
        share = np.where((place >= 0) & (place <= count - 1), place - before, np.nan)
        return [(before, 1 - share), (before + 1, share)]

    def slope_jumps(self, x1: Array, x2: Array) -> Array:
        """Returns by how much slopes jump at the samples nearest to places, arrays (n,), the root of the sum
        of squares along x1 and x2: array (n,), 0 at holes and borders.
        """
        rows, columns = self.heights.shape
        numbers = [
            np.rint(x / step + (count - 1) / 2).astype(int) % count
            for x, step, count in zip((x2, x1), self.spacing[::-1], (rows, columns))
        ]
        return self._slope_jumps[tuple(numbers)]

    @cached_property
    def _slope_jumps(self) -> Array:
        z = np.where(self._there, self.heights, np.nan)
        squares = np.zeros(z.shape)
        for axis, step in ((1, self.spacing[0]), (0, self.spacing[1])):
            turned = np.moveaxis(z, axis, -1)
            beyond = (turned[..., -1:], turned[..., :1]) if self.periodic else (np.nan * turned[..., :1],) * 2
            jumps = np.diff(np.concatenate((beyond[0], turned, beyond[1]), axis=-1), 2) / step
            squares += np.moveaxis(np.nan_to_num(jumps) ** 2, -1, axis)
        return np.asarray(np.sqrt(squares))

    def coarser(self) -> HeightMap:
        """Returns the map of every second sample: what it changes is what the samples leave open."""
        rows, columns = self.heights.shape
        words = "must be even of a periodic map, of which every second one is left out"
        even = rows % 2 == 0 and columns % 2 == 0
        require(even or not self.periodic, "heights", self.heights.shape, words)
        spacing = (2 * self.spacing[0], 2 * self.spacing[1])
        return HeightMap(self.heights[::2, ::2].copy(), spacing, self.periodic)

    def statistics(self) -> Statistics:
        """Returns rms_height, rms_slope, rms_curvature (half the Laplacian) and nayak, Nayak's parameter: by
        Fourier's series of a periodic map without holes, else by differences of neighbours that are there.
        None is what a flat map, or one of two rows, does not have.
        """
        z = np.where(self._there, self.heights, np.nan)
        z = z - np.nanmin(z)  # a flat map has no rounding then
        z = z - np.nanmean(z)
        if self.periodic and self._there.all():
            waves = [2 * np.pi * np.fft.fftfreq(n, d) for n, d in zip(z.shape, self.spacing[::-1])]
            square = waves[0][:, None] ** 2 + waves[1] ** 2
            power = np.abs(np.fft.fft2(z) / z.size) ** 2
            return roughness.of_surface(*(float(np.sum(square**n * power)) for n in (0, 1, 2)))
        slopes = [np.diff(z, axis=1 - axis) / self.spacing[axis] for axis in (0, 1)]
        second = [np.diff(slopes[axis], axis=1 - axis) / self.spacing[axis] for axis in (0, 1)]
        laplacian = second[0][1:-1] + second[1][:, 1:-1]
        slope = sum(float(np.nanmean(along**2)) for along in slopes)
        curved = np.isfinite(laplacian).any()
        return roughness.of_surface(
            float(np.nanmean(z**2)), slope, float(np.nanmean(laplacian**2)) if curved else None
        )

    @staticmethod
    def from_heights(
        z: ArrayLike,
        spacing: float | tuple[float, float],
        periodic: bool = False,
        detrend: str | None = None,
        fill: bool = False,
    ) -> HeightMap:
        """Returns the obstacle of measured heights: bilinear between four samples that are there, and no
        obstacle (inf) elsewhere.

        Parameters
        ----------
        z : array (rows, columns)
            Heights (length) of the obstacle's lower side, upwards: -z of what was measured from above.
            Columns run along x1 and rows along x2, in the order of the file, and the middle of the map lies
            over the origin. Where z is masked, NaN or inf there is no obstacle; states say how many
            heights are masked or NaN.
        spacing : float or (float, float)
            Distance of samples along x1 and x2 (length).
        periodic : bool
            Whether the map repeats: columns and rows times their spacings are the period.
        detrend : "mean" or "plane", optional
            What is taken off the heights first, by least squares.
        fill : bool
            Whether holes are filled: linear between the samples about them.

        Raises
        ------
        BadArgument
            If z is no such array, of unsigned integers, -inf, or nowhere has four neighbours; a spacing is
            not positive, or periods along x1 and x2 differ.

        Examples
        --------
        >>> valley = mb.RoughSurface.from_heights([[0.2, 0.1, 0.2], [0.1, 0.0, 0.1]], spacing=0.5)
        >>> valley.height(np.array([0.0, 0.25, 2.0]), np.array([0.25, 0.25, 0.0])).round(3).tolist()
        [0.0, 0.05, inf]
        """
        words = "must be an array (rows, columns) of numbers, two by two at least"
        heights = require_floats(words, z=z)
        require_heights(z=z)
        require_flag(periodic=periodic)
        require_flag(fill=fill)
        require(heights.ndim == 2 and min(heights.shape) >= 2, "z", z, words)
        require(
            not np.isneginf(heights).any(), "z", z, "must not be -inf: inf, NaN and masks mean no obstacle"
        )
        lengths = require_numbers(spacing=np.broadcast_to(np.asarray(spacing), np.shape(spacing) or (2,)))
        positive = len(lengths) == 2 and lengths.min() > 0
        require(positive, "spacing", spacing, "must be a positive length, or two, along x1 and x2")
        if detrend is not None:
            require_choice(("mean", "plane"), detrend=detrend)
        there = np.isfinite(heights)
        squares = there[1:, 1:] & there[1:, :-1] & there[:-1, 1:] & there[:-1, :-1]
        require(squares.any(), "z", z, "must have four neighbours that are neither masked, NaN nor inf")
        if detrend:
            heights = heights - _trend(heights, there, detrend)
        if fill and not there.all():
            heights = _filled(heights, there)
        unknown = np.isnan(heights)
        heights = np.where(unknown, np.inf, heights)
        count = int(np.count_nonzero(unknown))
        return HeightMap(heights, (float(lengths[0]), float(lengths[1])), periodic, count)

    @staticmethod
    def from_file(
        file: str | os.PathLike[str],
        spacing: float | tuple[float, float] | None = None,
        unit: str | None = None,
        **options: Any,
    ) -> HeightMap:
        """Returns the obstacle of a file: with a `spacing` of a matrix of numbers as of `from_heights`, else
        of an instrument, by SurfaceTopography (extra `files`), measured from above and turned over.

        Parameters
        ----------
        file : path
            A matrix is an array of numpy (NPY), or a text with blanks, commas or semicolons between numbers,
            of whose comments ("#") nothing is read.
        spacing : float or (float, float), optional
            Of a matrix (length).
        unit : str, optional
            Unit of lengths, as "um"; that of the file without it. A matrix has none.
        **options
            `periodic`, `detrend` and `fill` of `from_heights`.

        Raises
        ------
        BadArgument
            If the file cannot be read, or is a list of points where a spacing says that it is a matrix; if
            the extra is missing.
        """
        require_kind((str, os.PathLike), "a path", file=file)
        require(Path(file).is_file(), "file", file, "must be a file")
        if spacing is not None:
            require(
                unit is None, "unit", unit, "must be left out with a spacing, which has that of the heights"
            )
            return HeightMap.from_heights(_matrix(file), spacing, **options)
        try:
            from SurfaceTopography import read_topography
        except ImportError as failure:
            words = "needs the extra `files`, SurfaceTopography; a matrix of numbers needs its `spacing`"
            raise BadArgument("file", file, words) from failure
        try:
            topography = read_topography(str(file))
            has_unit = topography.unit is not None
            if unit is not None and has_unit:
                topography = topography.to_unit(unit)
            heights: Array = np.ma.filled(np.ma.asarray(topography.heights(), dtype=float), np.nan)
            sizes = topography.physical_sizes
        except Exception as failure:  # of each reader its own
            cause = str(failure).partition("\n")[0]
            raise BadArgument("file", file, f"is none that SurfaceTopography reads ({cause})") from failure
        words = "must be left out: the file names none, and lengths are as they stand"
        require(unit is None or has_unit, "unit", unit, words)
        require(heights.ndim == 2, "file", file, "must be a map: `Obstacle.from_samples` takes profiles")
        lengths = (sizes[0] / heights.shape[0], sizes[1] / heights.shape[1])
        # its first axis is x1, and heights are measured from above
        return HeightMap.from_heights(-heights.T, lengths, **{"periodic": topography.is_periodic} | options)


def _matrix(file: str | os.PathLike[str]) -> Array:
    """Returns the array (rows, columns) of a file of numpy or of a text; refuses lists of points."""
    try:
        if Path(file).suffix == ".npy":
            return require_floats("must be an array of numbers", file=np.load(file))
        lines = Path(file).read_text(encoding="latin-1").splitlines()  # of comments in any encoding
        first = next(line for line in lines if line.strip() and line[0] != "#")
        separator = next((sign for sign in ";," if sign in first), None)
        heights: Array = np.loadtxt(lines, ndmin=2, delimiter=separator)
    except (ValueError, StopIteration) as failure:
        raise BadArgument("file", file, f"must be a matrix of numbers ({failure})") from failure
    columns = heights.shape[1]
    profile = columns == 2 and len(heights) > 2 and (np.diff(heights[:, 0]) > 0).all()
    require(not profile, "file", file, "must be a matrix: it has a profile, abscissae and heights")
    points = columns == 3 and len(heights) > 3 and _is_grid(heights[:, 0], heights[:, 1])
    require(
        not points, "file", file, "must be a matrix: it has x1, x2 and height of points, without `spacing`"
    )
    return heights


def _is_grid(x1: Array, x2: Array) -> bool:
    """Returns whether points (x1, x2), arrays (n,), are those of a grid, each once, with few missing."""
    crossings = len(np.unique(x1)) * len(np.unique(x2))
    return len(x1) == len(np.unique(np.array((x1, x2)), axis=1)[0]) and crossings <= 2 * len(x1)


def _trend(heights: Array, there: Flags, detrend: str) -> Array:
    """Returns the mean or the least-squares plane of heights that are there, array (rows, columns)."""
    rows, columns = np.indices(heights.shape)
    terms = np.array((np.ones(heights.shape), rows, columns))
    if detrend == "mean":
        terms = terms[:1]
    factors = np.linalg.lstsq(terms[:, there].T, heights[there], rcond=None)[0]
    return np.asarray(np.tensordot(factors, terms, 1))


def _filled(heights: Array, there: Flags) -> Array:
    """Returns heights with holes filled, linear between samples about them, else the nearest sample."""
    from scipy.interpolate import griddata  # here: most maps have no holes

    known = np.argwhere(there)
    holes = np.argwhere(~there)
    filled = heights.copy()
    values = griddata(known, heights[there], holes)
    outside = np.isnan(values)
    values[outside] = griddata(known, heights[there], holes[outside], method="nearest")
    filled[~there] = values
    return filled
