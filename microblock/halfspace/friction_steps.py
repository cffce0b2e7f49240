"""Increments of frictional contact on the cells of one grid.

At given loads (P, Q) the corner forces f and the shear forces q, array (2, n, n), satisfy

    gaps  g0 + H f + G q - d >= 0,  f >= 0,  f g = 0,  sum f = P,
    slip  v = D - S q - C f - a,    |q| <= friction sum f,   v along q where |q| is at this limit, else v = 0,

with the approach d and the motion D of the obstacle, and ``a = D - S q - C f`` at the increment before. An
increment alternates between the first line at given q and the second one at given f (Panagiotopoulos, Ing.-
Arch. 44 (1975) 421) until the gaps stay. Uncoupled, G q is left out.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..contact_solvers.coulomb_discs import SlidingProblem, slide
from ..contact_solvers.discs import AT_RIM
from ..contact_solvers.projected_gradients import solve_matrix_free
from ..errors import NotConverged
from ..model.types import Array, Flags
from .shear_cells import ShearCells

ALTERNATIONS = 60  # 3 to 12 are met


@dataclass(frozen=True, eq=False)
class Increment:
    """Forces and displacements of cells at loads (P, Q), and what happened on the way.

    Attributes
    ----------
    load, shear : P, and Q, array (2,)
    forces : array (corners, n, n)
    tangential, slip : arrays (2, n, n), q, and slip since first contact (length)
    apart : array (2, n, n), a, displacement of the obstacle less that of the face (length)
    approach, motion : d, and D, array (2,)
    stick : boolean array (n, n), nodes in contact below the limit of friction
    energy, work, dissipation : float
    residual : largest violation over the displacement
    iterations : products with H and outer steps for the shear
    """

    load: float
    shear: Array
    forces: Array
    tangential: Array
    slip: Array
    apart: Array
    approach: float
    motion: Array
    stick: Flags
    energy: float = 0.0
    work: float = 0.0
    dissipation: float = 0.0
    residual: float = 0.0
    iterations: int = 0

    @cached_property
    def pressing(self) -> Array:
        """Normal forces of the cells, array (n, n)."""
        return np.asarray(self.forces.sum(axis=0))


@dataclass(frozen=True, eq=False)
class FrictionGrid:
    """The contact with friction on one grid.

    Attributes
    ----------
    H : Flexibility
    g0 : array (corners, n, n), initial gaps
    cells : ShearCells
    friction : float
    coupled : bool
    residual : float, largest violation of an increment over its displacement
    """

    H: Any
    g0: Array
    cells: ShearCells
    friction: float
    coupled: bool
    residual: float

    def at_rest(self) -> Increment:
        """Returns the increment before the first contact."""
        none = np.zeros((2, *self.g0.shape[1:]))
        return Increment(
            load=0.0,
            shear=np.zeros(2),
            forces=np.zeros(self.g0.shape),
            tangential=none,
            slip=none,
            apart=none,
            approach=float(self.g0.min()),
            motion=np.zeros(2),
            stick=np.zeros(self.g0.shape[1:], bool),
        )

    def raised(self, tangential: Array) -> Array:
        """Returns G q, what shear forces do to the gaps, array (corners, n, n)."""
        surface = self.cells.lifted(tangential)
        if self.H.one_corner:
            return surface[:1]
        gaps = np.tensordot(self.H.rows, surface, 1)
        return np.asarray(gaps + (self.H.tilt * surface[1:]).sum(axis=0))

    def dragged(self, forces: Array) -> Array:
        """Returns C f, what corner forces do to the face, array (2, n, n)."""
        loads = self.H.resultants(forces)
        return self.cells.dragged_by_pressure(loads) if self.H.one_corner else self.cells.dragged(loads)

    def advanced(self, before: Increment, load: float, shear: Array) -> Increment:
        """Returns the next increment, at loads P and Q; raises NotConverged where alternations do not settle.

        1. normal forces at the gaps that the shear forces leave,
        2. shear forces within the limits of these normal forces,
        3. until the gaps stay.
        """
        forces = before.forces if before.load else None
        tangential = before.tangential
        raised = self.raised(tangential) * self.coupled
        over_obstacle = np.isfinite(self.g0)
        steps = 0
        for _ in range(ALTERNATIONS):
            pressed = solve_matrix_free(  # 1
                self.H, self.g0 + raised, load=load, start=forces, rtol=self.residual
            )
            forces = pressed.forces
            dragged = self.dragged(forces)
            slid = slide(  # 2
                SlidingProblem(
                    self.cells.moved,
                    self.cells.inverse,
                    self.friction * forces.sum(axis=0),
                    dragged + before.apart,
                    shear,
                    self.friction,
                ),
                tangential,
                self.residual,
            )
            tangential = slid.forces
            steps += pressed.iterations
            raised_now = self.raised(tangential)
            change = np.abs(raised_now - raised).max() if self.coupled else 0.0  # 3
            size = float(
                np.abs(pressed.approach + pressed.gaps[over_obstacle] - self.g0[over_obstacle]).max()
            )
            if change <= 10 * self.residual * size:
                break
            raised = raised_now
        else:
            raise NotConverged(
                f"normal and shear forces still change each other by {change / size:.1e} of the displacement "
                f"after {ALTERNATIONS} alternations: take a smaller friction or coupled=False",
                iterations=ALTERNATIONS,
            )
        touching = forces.sum(axis=0) > 0
        radii = self.friction * forces.sum(axis=0)
        after = Increment(
            load=load,
            shear=shear,
            forces=forces,
            tangential=tangential,
            slip=before.slip + np.where(touching, slid.slip, 0.0),
            apart=slid.motion[:, None, None] - self.cells.moved(tangential) - dragged,
            approach=pressed.approach,
            motion=slid.motion,
            stick=touching & (np.hypot(*tangential) < (1 - AT_RIM) * radii),
            residual=max(pressed.kkt, slid.residual, change / size),
            iterations=before.iterations + steps,
        )
        return self._with_energies(before, after, slid.slip, raised_now)

    def _with_energies(self, before: Increment, after: Increment, slip: Array, raised: Array) -> Increment:
        """Returns an increment with its elastic energy, the dissipation by the means of the limits of
        friction over the increment, and their sum, the work of the loads.
        """
        lowered = self.H @ after.forces + raised
        moved = after.motion[:, None, None] - after.apart
        energy = float((after.forces * lowered).sum() + (after.tangential * moved).sum()) / 2
        limits = self.friction * (after.pressing + before.pressing) / 2
        lost = before.dissipation + float((limits * np.hypot(*slip))[~after.stick].sum())
        return replace(after, energy=energy, work=energy + lost, dissipation=lost)
