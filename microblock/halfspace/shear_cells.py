"""The response of a half-space to shear forces on square cells."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.fft import next_fast_len

from ..contact_solvers.convolution import FourierOperator, circulant_spectrum
from ..contact_solvers.fft_compliance import Grid, wavenumbers
from ..model.types import Array
from .kernels import ShearKernels, shear_along_axes, shear_spectra
from .symbol import ShearSymbol

Symbol = Callable[[Array], ShearSymbol]  # of wavenumbers (1/length)

# of the components z1, z2, then 11, 12, 22 of displacement and rotation: whether they are odd in x1 and x2
ODD_SPECTRA = ((True, False), (False, True), *((False, False), (True, True), (False, False)) * 2)


@dataclass(frozen=True, eq=False)
class ShearCells:
    """What shear forces q on cells do, array (2, n, n), and what the others do to the face of blocks.

    Attributes
    ----------
    symbol : function of wavenumbers, the ShearSymbol of the body
    length : float, at which it changes from short to long waves
    grid : Grid
    mean : (displacement, rotation) of the face under a mean shear of a period (length per stress), or None
        without a period
    clamped : bool, whether psi = 0 on the whole surface: rotations are then the moments that hold it
    second : function of wavenumbers, the ShearSymbol of a second body, or None
    second_length : float, of its symbol
    """

    symbol: Symbol
    length: float
    grid: Grid
    mean: tuple[float, float] | None = None
    clamped: bool = False
    second: Symbol | None = None
    second_length: float = 1.0

    @property
    def periodic(self) -> bool:
        return self.mean is not None

    @cached_property
    def near(self) -> int:
        """Cells of the period of the preconditioner."""
        return self.grid.count if self.periodic else next_fast_len(self.grid.count, real=True)

    @cached_property
    def _period(self) -> tuple[int, int]:
        length = self.near if self.periodic else 2 * self.near
        return length, length

    @cached_property
    def _spectrum(self) -> Array:
        """z1, z2, and the tensors of displacement and rotation on waves, array (8, ...)."""
        if self.mean is not None:
            return self._periodic_spectrum(*self.mean)
        count, width = self.grid.count, self.grid.width
        averages = ShearKernels(self.symbol, self.length).cells(count, width)
        if self.clamped:
            averages[5:] *= width**2
        if self.second is not None:
            averages[:5] += _opposed(ShearKernels(self.second, self.second_length).cells(count, width)[:5])
        waves = [
            circulant_spectrum(values, self._period[0], *odd) for values, odd in zip(averages, ODD_SPECTRA)
        ]
        return np.array(waves)

    def _periodic_spectrum(self, moved: float, turned: float) -> Array:
        """Returns the spectrum of the symbols, with what a mean shear does."""
        width = self.grid.width
        length = self._period[0]
        ways, k = wavenumbers(length, width, 2)
        spectrum = shear_along_axes(shear_spectra(self.symbol(k)), *ways)
        spectrum[:, 0, 0] = (0, 0, moved, 0, moved, turned, 0, turned)
        spectrum[: 5 if self.clamped else 8] /= width**2
        if self.second is not None:
            second = shear_along_axes(shear_spectra(self.second(k)), *ways)[:5] / width**2
            second[:, 0, 0] = 0
            spectrum[:5] += _opposed(second)
        shortest = np.pi / width * (1 - 0.5 / length)  # of which cells see no odd part
        for values, odd in zip(spectrum, ODD_SPECTRA):
            for way, is_odd in zip(ways, odd):
                values *= (np.abs(way) < shortest) | (not is_odd)
        return spectrum

    @cached_property
    def moved(self) -> FourierOperator:
        """From q to the displacement of the face, arrays (2, n, n)."""
        _, _, S11, S12, S22, *_ = self._spectrum
        return FourierOperator(self._period, [[S11, S12], [S12, S22]], (2, 2))

    @cached_property
    def dragged(self) -> FourierOperator:
        """From (p, m), array (3, n, n), or p alone, to the displacement of the face."""
        z1, z2, _, _, _, X11, X12, X22 = self._spectrum
        return FourierOperator(self._period, [[-z1, X11, X12], [-z2, X12, X22]], (0, 1))

    @cached_property
    def dragged_by_pressure(self) -> FourierOperator:
        """From p, array (1, n, n), to the displacement of the face."""
        return FourierOperator(self._period, [[-self._spectrum[0]], [-self._spectrum[1]]], (0, 1))

    @cached_property
    def lifted(self) -> FourierOperator:
        """From q to (u, phi), array (3, n, n), where psi = 0 to (u, m)."""
        z1, z2, _, _, _, X11, X12, X22 = self._spectrum
        return FourierOperator(self._period, [[-z1, -z2], [X11, X12], [X12, X22]], (1, 0))

    @cached_property
    def inverse(self) -> FourierOperator:
        """An approximate inverse of `moved`."""
        width = self.grid.width
        ways, k = wavenumbers(self.near, width, 2)
        symbol = self.symbol(k)
        along, across = symbol.along, symbol.across
        if self.second is not None:
            second = self.second(k)
            along = along + second.along
            across = across + second.across
        softness = ShearSymbol(0 * k, width**2 / along, width**2 / across, 0 * k, 0 * k)
        _, _, S11, S12, S22, *_ = shear_along_axes(shear_spectra(softness), *ways)
        return FourierOperator((self.near, self.near), [[S11, S12], [S12, S22]], (2, 2))


@dataclass(frozen=True, eq=False)
class ShearedFaces:
    """The ShearResponse of cells.

    Attributes
    ----------
    H : Flexibility
    cells : ShearCells
    """

    H: Any
    cells: ShearCells

    @property
    def moved(self) -> FourierOperator:
        return self.cells.moved

    @property
    def inverse(self) -> FourierOperator:
        return self.cells.inverse

    def raised(self, tangential: Array) -> Array:
        surface = self.cells.lifted(tangential)
        if self.H.one_corner:
            return surface[:1]
        gaps = np.tensordot(self.H.rows, surface, 1)
        return np.asarray(gaps + (self.H.tilt * surface[1:]).sum(axis=0))

    def dragged(self, forces: Array) -> Array:
        loads = self.H.resultants(forces)
        return self.cells.dragged_by_pressure(loads) if self.H.one_corner else self.cells.dragged(loads)


def _opposed(components: Array) -> Array:
    """Returns components of a second body, its mirror image: z has the other sign."""
    return np.asarray(components * np.array((-1, -1, 1, 1, 1))[:, None, None])
