"""
Rigid blocks with elastic interfaces
====================================
Square blocks in rows and columns: the microstructure that the contact law idealises.

A block of side b has the displacement (u1, u2) of its centre and the rotation psi. Over an interface of
length b the normal stiffness k_n and the shear stiffness k_s (stress per displacement) are constant, so that
a relative normal displacement D + E s at the distance s from the middle, and a slip T, store

    W = (k_n b D^2 + k_n b^3/12 E^2 + k_s b T^2)/2,

E the difference of the rotations: the interface has a rolling stiffness. Below, `normal` = k_n b and
`shear` = k_s b are stresses. Forces and couples are per thickness.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse

import microblock as mb
from microblock.contact_solvers.compliance import Compliance
from microblock.errors import require_positive
from microblock.model.methods import GivenCompliance


@dataclass(frozen=True)
class Springs:
    """Stiffness of the interfaces per length, times the side of a block: `normal` and `shear` (stresses).

    Raises BadArgument for a stiffness that is not positive.
    """

    normal: float = 1.0
    shear: float = 1.0

    def __post_init__(self):
        require_positive(normal=self.normal, shear=self.shear)

    @property
    def moduli(self):
        """Closed form for long waves, ell = b: E and nu along the rows, beta, gamma' and the anisotropy.

        The strain energy has no product of u1,1 and u2,2, nor of u1,2 + psi and u2,1 - psi: lambda = 0 and
        mu = mu_c = shear/2. The solid is isotropic if E = 2 mu, that is for equal springs.
        """
        ratio = self.normal / self.shear
        return {"E": self.normal, "nu": 0.0, "beta": 1.0, "gamma'": ratio / 6, "anisotropy": ratio}

    @property
    def E_star(self):
        """Contact modulus of long waves along a surface of rows: that of a solid of square symmetry."""
        return 2 * self.normal / np.sqrt(2 + 2 * self.normal / self.shear)

    @property
    def decay(self):
        """Ratio of the rotations of neighbouring rows under couples that are the same on all blocks of a row.

        Without shear a row of blocks is rotated back by its side faces alone, shear b^2 psi, and by the
        differences of the rotations above and below, normal b^2/12 times these.
        """
        half = 1 + 6 * self.shear / self.normal
        return half - np.sqrt(half**2 - 1)

    @property
    def surface_couple(self):
        """Couple on the blocks of the surface over b^2 times their rotation, where all rotate alike."""
        return self.shear + self.normal / 12 * (1 - self.decay)

    @property
    def full_contact_couple(self):
        """M/(-b^2 dp/dx1) where both corners are closed and the pressure p varies slowly; in an isotropic
        continuum gamma' (1 - nu), ell = b.

        The stress along the rows is -p. The joint below row j (0 at the surface) carries (j + 1) b dp/dx1,
        and the side faces of row j carry (j + 1/2 - decay^j/2) b dp/dx1, for obstacle and corners rotate the
        blocks of the surface with their row. The couple on these is what the joint below takes: b/2 times its
        shear (1/2), and its rolling by the opening of that joint and by the side faces (the other terms).
        """
        return 1 / 2 + (1 + self.normal / self.shear * (3 - self.decay) / 2) / 12


def assembly(columns, rows, springs, b=1.0, periodic=False):
    """Stiffness of an assembly of n blocks, sparse (3 n, 3 n): (u1, u2, psi) of each block.

    The block in column i and row j has the number i + columns j, rows are counted upwards. `periodic`: the
    last column touches the first one.
    """
    number = np.arange(columns * rows).reshape(rows, columns)
    beside = (number, np.roll(number, -1, axis=1)) if periodic else (number[:, :-1], number[:, 1:])
    joints = np.reshape(beside, (2, -1)), np.reshape((number[:-1], number[1:]), (2, -1))
    strains, stiffness = [], []
    for (first, second), normal, along, sign in zip(joints, (0, 1), (1, 0), (-1, 1)):
        for terms in (
            ((first, normal, -1), (second, normal, 1)),  # opening
            ((first, 2, -1), (second, 2, 1)),  # rolling
            (
                (first, along, -1),
                (second, along, 1),
                (first, 2, sign * b / 2),
                (second, 2, sign * b / 2),
            ),  # slip
        ):
            places = np.concatenate([3 * block + freedom for block, freedom, _ in terms])
            factors = np.repeat([factor for *_, factor in terms], len(first))
            lines = np.tile(np.arange(len(first)), len(terms))
            strains.append(sparse.csr_matrix((factors, (lines, places)), (len(first), 3 * number.size)))
        stiffness += np.repeat(
            [springs.normal, springs.normal * b**2 / 12, springs.shear], len(first)
        ).tolist()
    strain = sparse.vstack(strains).tocsr()
    return (strain.T @ sparse.diags(stiffness) @ strain).tocsr()


def rows_in_waves(theta, springs, b=1.0):
    """Stiffness between rows whose blocks move in waves exp(i theta i) along them, theta an array (n,).

    Complex array (3, 3, n, 3, 3): forces on row j, counted upwards, from motions of row k of three rows, of
    which the highest has nothing above it.
    """
    blocks = assembly(3, 3, springs, b).toarray().reshape(3, 3, 3, 3, 3, 3)[:, 1]  # forces on middle blocks
    return np.einsum("jrkcs,nc->jknrs", blocks, np.exp(1j * np.multiply.outer(theta, (-1, 0, 1))))


def waves_on_blocks(theta1, theta2, springs, b=1.0):
    """Stiffness of plane waves exp(i (theta1 i + theta2 j)) of (u1, u2, psi), complex array (n, 3, 3)."""
    below, row, above = rows_in_waves(theta1, springs, b)[1]
    phase = np.exp(1j * np.asarray(theta2))[:, None, None]
    return below / phase + row + above * phase


def rotation_stiffness(number, angle, springs):
    """Couple on a block (b = 1) over its rotation, in waves of rotation without forces, array (n,).

    In an isotropic solid it is 4 mu mu_c/(mu + mu_c) + gamma' mu ell^2 k^2.
    """
    wave = waves_on_blocks(number * np.cos(angle), number * np.sin(angle), springs)
    moved = np.linalg.solve(wave[:, :2, :2], wave[:, :2, 2:])
    return (wave[:, 2, 2] - np.einsum("ni,nij->n", wave[:, 2, :2], moved)).real


def identified(springs, lengths=(80, 100, 125, 160, 200, 250, 320)):
    """Moduli of long waves on the blocks: {name: (value, residual of the fit)}.

    Waves along a row and on the diagonal give the strain energy of a Cosserat solid of square symmetry: E,
    nu along the rows, beta and the anisotropy, (C11 - C12)/(2 mu). gamma' is that of waves of rotation along
    a row, without forces on the blocks, from the wave numbers k and 2 k. All are continued to infinite length
    by a cubic in the square of the wave number; the residual is the largest misfit of that cubic.
    """
    k = 2 * np.pi / np.array(lengths)
    row, diagonal = (waves_on_blocks(k, way * k, springs) for way in (0, 1))
    couple, twice = (rotation_stiffness(times * k, 0, springs) for times in (1, 2))
    C11, mu_c = row[:, 0, 0].real / k**2, abs(row[:, 1, 2]) / (2 * k)
    mu = row[:, 1, 1].real / k**2 - mu_c
    C12 = diagonal[:, 0, 1].real / k**2 - mu + mu_c
    nu = C12 / (C11 + C12)
    moduli = {
        "E": C11 * (1 + nu) * (1 - 2 * nu) / (1 - nu),
        "nu": nu,
        "beta": 2 * mu_c / (mu + mu_c),
        "gamma'": (twice - couple) / (3 * k**2 * mu),
        "anisotropy": (C11 - C12) / (2 * mu),
    }
    fits = {name: np.polynomial.Polynomial.fit(k**2, values, 3) for name, values in moduli.items()}
    return {name: (float(fit(0.0)), float(abs(fit(k**2) - moduli[name]).max())) for name, fit in fits.items()}


def surface_stiffness(theta, springs, b=1.0):
    """Stiffness of the surface of a half-plane of blocks against waves exp(i theta i) along it: (n, 3, 3).

    Cyclic reduction: every second layer is eliminated until those that are left do not feel each other.
    Theta is an array without multiples of 2 pi, where the surface moves without force. Raises NotConverged
    for waves that are too long.
    """
    rows = rows_in_waves(theta, springs, b)
    surface, inner, coupling = rows[2, 2], rows[1, 1], rows[1, 0]  # to the row below
    for _ in range(60):  # each doubles the depth; 20 do for waves of a million blocks
        back = coupling.conj().swapaxes(1, 2)
        down, up = np.linalg.solve(inner, back), np.linalg.solve(inner, coupling)
        if np.abs(coupling).max() <= 1e-17 * springs.normal:  # a tenth of rounding
            return surface
        surface = surface - coupling @ down
        inner = inner - coupling @ down - back @ up
        coupling = -coupling @ up
    raise mb.NotConverged("layers at great depth are still coupled; take shorter waves")


@dataclass(frozen=True)
class BlockHalfPlane:
    """Half-plane of blocks, known by the response of its surface; the blocks `x` among them can be touched.

    Attributes
    ----------
    solid : Cosserat, of long waves (its ell is the side of a block)
    springs : Springs
    x : array (n,), centres of neighbouring blocks, ascending by their side
    period : int, blocks after which the Fourier sums repeat. The images that come with them are taken away
        to leading order, so that what is left of them falls like the fourth power of 1/period.
    """

    solid: object
    springs: Springs
    x: np.ndarray
    period: int

    methods = (GivenCompliance,)

    def compliance(self, clamped=False):
        """Displacement and rotation of blocks from forces along x2 and couples on blocks.

        Raises BadArgument under Microclamped, whose rotations no response to given couples has.
        """
        if clamped:
            raise mb.BadArgument("law", "Microclamped", "must be Microblock or Unilateral on rigid blocks")
        n, b = len(self.x), self.solid.ell
        step = np.arange(n)[:, None] - np.arange(n)
        (uu, pu), (up, pp) = self.responses[:2, 0][:, step], self.responses[:2, 1][:, step]
        matrix = np.block([[uu, up], [pu, pp]])
        points = np.column_stack((self.x, 0 * self.x))
        return Compliance(points, 0 * points + [0, 1], np.full(n, b), (matrix + matrix.T) / 2, b)

    @cached_property
    def responses(self):
        """(u2, psi) of the block n to the right from a unit force and couple on block 0: array (2, 2, N);
        u2 up to a constant.
        """
        N, b = self.period, self.solid.ell
        theta = 2 * np.pi * np.arange(1, N // 2 + 1) / N
        waves = np.linalg.inv(surface_stiffness(theta, self.springs, b))[:, 1:, 1:]
        mean = [np.diag([0, 1 / (b**2 * self.springs.surface_couple)])]
        return np.fft.irfft(np.concatenate((mean, waves)), N, axis=0).transpose(1, 2, 0) + self._images()

    def _images(self):
        """Response of the half-plane less that of period N, in the long waves c/k, ik c/k, k^2 c/k."""
        N, b = self.period, self.solid.ell
        n = np.fft.fftfreq(N, 1 / N)
        angle = np.pi * np.where(n == 0, 1, n) / N  # limits at 0 are named
        u = np.where(n == 0, 0, np.log(np.abs(np.sin(angle) / angle)))
        slope = np.where(n == 0, 0, 1 / np.tan(angle) - 1 / angle) * np.pi / N
        bend = np.where(n == 0, 1 / 3, 1 / np.sin(angle) ** 2 - 1 / angle**2) * (np.pi / N) ** 2
        return 2 / (self.springs.E_star * np.pi) * np.array([[u, -slope / b], [slope / b, bend / b**2]])
