"""A contact state of a half-space, on square cells of its surface."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import BadArgument, Named, require_choice
from ..model.plain_data import PlainData, plain_data
from ..model.summary import Row, Shown, Summary, number, saved
from ..model.types import AnyArray as Array
from ..model.types import ContactLike, Target

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, repr=False, eq=False)
class SurfaceState(Shown, PlainData):
    """A contact state of a half-space.

    Where all four corners of a block are closed their forces are not unique: four forces act on three degrees
    of freedom. `pressure` and `micromoment`, their resultants, are; `pressures` are those of least norm.

    Attributes
    ----------
    problem : Contact
    load : float
        Force; on a period, that of one period.
    approach : float
        Approach of the obstacle from the surface far away, on a period from its mean (length); of two bodies,
        by how much they come closer far away, or in the mean.
    x1, x2 : arrays (n,)
        Centres of the cells along either axis (length).
    width : float
        Side of a cell (length).
    pressures : dict of arrays (n, n)
        Of the corners "--", "-+", "+-", "++" (signs of x1 and x2 from the block's middle), or {"C": ...}.
    psi : array (2, n, n)
        Microrotations about x1 and x2 (radians).
    displacement : array (n, n)
        Normal displacement into the body (length).
    counter_displacement : array (n, n)
        Displacement along x3 of the surface of a second body (`Deformable`) above the cells; 0 of a rigid
        obstacle (length).
    micromoment : array (2, n, n)
        M1 and M2 of the corners' forces, or the reaction to psi = 0 (stress x length).
    closed : array (n, n) of int
        Number of closed corners at each cell: those with a force, and all four where no gap is open.
    error_estimate : float or None
        Relative error in L2 over the surface of what `pressure_at` returns, and of the micromoment over ell,
        with the share of the load on spots of few cells. None where there is no coarser grid.
    residual : float
        Largest relative residual of the contact conditions.
    iterations : int
        Products with the flexibility on the last grid.
    warnings : tuple of str
    seen_width : float or None
        Diameter of a disc that is always seen, within the cells and as far again on all sides of them, if the
        obstacle is lower there than as far again around it (length). Narrower summits may be missed.
    """

    problem: ContactLike
    load: float
    approach: float
    x1: Array
    x2: Array
    width: float
    pressures: dict[str, Array]
    psi: Array
    displacement: Array
    counter_displacement: Array
    micromoment: Array
    closed: Array
    residual: float
    iterations: int
    error_estimate: float | None = None
    warnings: tuple[str, ...] = ()
    seen_width: float | None = None

    method = "cells"
    _keys = (
        *("load", "approach", "radius", "contact_area", "energy", "error_estimate", "residual"),
        *("iterations", "unknowns", "method", "warnings", "seen_width", "width", "x1", "x2", "weights"),
        *("pressure", "pressures", "micromoment", "psi", "displacement", "counter_displacement", "closed"),
    )

    def __post_init__(self) -> None:
        object.__setattr__(self, "pressures", Named("corner", self.pressures))

    @cached_property
    def pressure(self) -> Array:
        """Total pressure, array (n, n) (stress)."""
        return np.sum(list(self.pressures.values()), axis=0)

    @property
    def period(self) -> float | None:
        """Of the body (length)."""
        return getattr(self.problem.body, "period", None)

    def pressure_at(self, points: Array, corner: str | None = None) -> Array:
        """Returns the pressure between the centres of cells, linear along either axis: array (k,).

        Parameters
        ----------
        points : array (k, 2) or (k, 3)
            x1 and x2 of places on the surface (lengths).
        corner : str, optional
            One of `pressures`; without it their sum.

        Raises
        ------
        BadArgument
            If the points are no such array of finite numbers, or there is no such corner.
        """
        try:
            found = np.asarray(points, float)
        except (TypeError, ValueError, OverflowError):
            found = np.empty(0)
        if found.ndim != 2 or found.shape[1] not in (2, 3) or not np.isfinite(found).all():
            raise BadArgument("points", points, "must be an array (k, 2) or (k, 3) of finite numbers")
        if corner is not None:
            require_choice(self.pressures, corner=corner)
        return self.interpolated(self.pressure if corner is None else self.pressures[corner], *found.T[:2])

    def interpolated(self, values: Array, x1: Array, x2: Array) -> Array:
        """Returns values on the cells, array (n, n), between their centres; 0 beyond the cells."""
        n, (i, j) = len(self.x1), ((x - axis[0]) / self.width for x, axis in ((x1, self.x1), (x2, self.x2)))
        inside = True
        if self.period is None:
            inside = (np.abs(i - (n - 1) / 2) <= n / 2) & (np.abs(j - (n - 1) / 2) <= n / 2)
            i, j = (np.clip(each, 0, n - 1) for each in (i, j))
        first, second = (np.floor(each).astype(int) for each in (i, j))
        s, t = i - first, j - second
        (a, b), (c, d) = ((each % n, (each + 1) % n) for each in (first, second))
        low, high = (1 - t) * values[a, c] + t * values[a, d], (1 - t) * values[b, c] + t * values[b, d]
        return np.where(inside, (1 - s) * low + s * high, 0.0)

    @property
    def weights(self) -> Array:
        """Areas of the cells, array (n, n): the sum of weights times pressure is the load."""
        return np.full(self.pressure.shape, self.width**2)

    @property
    def unknowns(self) -> int:
        """Corner forces."""
        return self.pressure.size * len(self.pressures)

    @property
    def contact_area(self) -> float:
        """Area on which a corner touches (length^2)."""
        return float(np.count_nonzero(self.closed) * self.width**2)

    @property
    def radius(self) -> float:
        """Radius of the circle with the contact's area (length)."""
        return float(np.sqrt(self.contact_area / np.pi))

    @property
    def hardness(self) -> float:
        """Load over the area of contact (stress)."""
        return self.load / self.contact_area

    @property
    def energy(self) -> float:
        """Elastic energy of both bodies: half the work of the corner forces from the unloaded state on."""
        solver: Any = self.problem.solver
        gaps = solver.initial_gaps(self.x1, self.x2)
        lowered = self.approach - np.where(np.isfinite(gaps), gaps, 0.0)
        forces = np.array(list(self.pressures.values())) * self.width**2
        return float(np.sum(forces * lowered) / 2)

    def along(self, direction: str) -> dict[str, Array]:
        """Returns the state along a line through the middle of the cells.

        Parameters
        ----------
        direction : "x1" or "diagonal"

        Returns
        -------
        dict of arrays (n,)
            "x1" (abscissae), "pressure", "m1", "m2", "psi1", "psi2".

        Notes
        -----
        With an even number of cells the axis runs between two rows, of which the mean is taken.
        """
        require_choice(("x1", "diagonal"), direction=direction)
        n = len(self.x1)
        if direction == "diagonal":
            pick = np.arange(n), np.arange(n)
            fields = [one[..., pick[0], pick[1]] for one in (self.pressure, self.micromoment, self.psi)]
        else:
            rows = [n // 2] if n % 2 else [n // 2 - 1, n // 2]
            fields = [one[..., rows].mean(axis=-1) for one in (self.pressure, self.micromoment, self.psi)]
        pressure, moment, psi = fields
        return {
            "x1": self.x1,
            "pressure": pressure,
            "m1": moment[0],
            "m2": moment[1],
            "psi1": psi[0],
            "psi2": psi[1],
        }

    def to_dict(self) -> dict[str, Any]:
        """Returns the state as plain data for JSON, in full precision.

        Returns
        -------
        dict
            The numbers, texts and arrays among the attributes, by their names: arrays are lists of lists,
            and a number that is NaN or infinite is None. "profile" has the state `along` the axis x1
            ("axis") and along the "diagonal".
        """
        cuts = {"axis": self.along("x1"), "diagonal": self.along("diagonal")}
        return {**super().to_dict(), "profile": plain_data(cuts)}

    def plot(self, file: Target = None) -> Figure:
        """Returns a figure of the pressure, of the number of closed corners, and of both along x1; of two
        bodies also what they are pressed in.

        Parameters
        ----------
        file : str or Path, optional
            File to which the figure is written (PNG, PDF or SVG, by its ending).
        """
        from ..view.surface_figure import draw

        return saved(draw(self), file, self.warnings)

    def plot_blocks(self, file: Target = None) -> Figure:
        """Returns a figure of the rotated blocks about the contact, coloured by how many corners touch.

        Parameters
        ----------
        file : str or Path, optional
            File to which the figure is written (PNG, PDF or SVG, by its ending).

        Raises
        ------
        BadArgument
            If the law has no blocks.
        """
        from ..view.surface_blocks import draw

        return saved(draw(self), file, self.warnings)

    def summary(self) -> Summary:
        """Returns load, approach, contact, pressure and error, for a notebook."""
        rows = (
            Row("load", "P", self.load, "force"),
            Row("approach", "d", self.approach, "length"),
            Row("radius of the contact's area", "a", self.radius, "length"),
            Row("largest pressure", "p", float(self.pressure.max()), "stress"),
            Row("largest micromoment", "|M|", float(np.hypot(*self.micromoment).max()), "stress x length"),
            Row("error estimate", "", self.error_estimate, "relative"),
            Row("narrowest summit seen", "", self.seen_width, "length"),
            Row("largest relative residual", "", self.residual),
            Row("unknowns", "", self.unknowns),
        )
        words = f"load {number(self.load)}, radius {number(self.radius)}"
        words += f", error estimate {number(self.error_estimate)}"
        return Summary("Contact state of a half-space", words, rows, tuple(self.warnings))
