"""A second half-space, pressed and displaced where corners of blocks stand.

Corner (a, b) of the block at x presses the second body at x + (ell/2)(a, b), where its displacement u2 adds
to the gap. Cells of the second surface share its force by the weights S of the polynomial through five of
them along each axis, which keep force and moment, and

    gaps = S^T U2 S forces

is positive. U2 is on a period the symbol, else the displacement at the centre of a cell under pressure on
another.

Forces 1, -1, -1, 1 on a small block hardly displace the second body. These gaps get 0.003 of what short waves
displace besides.
"""

from functools import cached_property

import numpy as np
from scipy.fft import next_fast_len
from scipy.sparse import csr_array

from ..contact_solvers.convolution import FourierOperator, circulant_spectrum
from ..contact_solvers.fft_compliance import TWIST_MODE, wavenumbers
from ..errors import require
from ..halfplane.kernels import normal_symbol, short_waves
from .kernels import kernels

NODES = np.arange(-2, 3)  # cells about the nearest one that share a force: an odd number sees all waves
FLOOR = 1e-3  # of what short waves displace the first body by, for the twist in the preconditioner
WIDEST = 2.0  # windows, beyond which blocks are too large for the cells of the second body


class SecondBodyCells:
    """What a second body adds to the gaps of corners on count x count cells.

    Parameters
    ----------
    solid : Cosserat
        Second body, also classical.
    ell : float
        Side of the first body's blocks (length).
    offsets : array (corners, 2)
        (a, b) of the corners.
    width : float
        Of a cell (length).
    count : int
    periodic : bool

    Attributes
    ----------
    shares : dict of sparse arrays (m, n)
        By a or b: shares on m cells of forces on n cells along an axis, ``beyond`` fewer on either side.
    response : Waves
        Of u2 to forces on m x m cells.
    near : int
        Cells of the period of the preconditioner.
    held, twisted : float
        Least and most twist of a block (length per force).

    Raises
    ------
    BadArgument
        If corners stand WIDEST windows outside.
    """

    def __init__(self, solid, ell, offsets, width, count, periodic):
        self.solid, self.ell, self.offsets, self.width = solid, ell, offsets, width
        apart = ell / 2 / width * np.abs(offsets).max()
        require(
            periodic or apart <= WIDEST / 2 * count,
            "ell",
            ell,
            f"is above {WIDEST:g} times the window of {count * width:g}, beside which corners press the "
            "second body: give a wider one, Cells(window=(left, right))",
        )
        self.beyond = 0 if periodic or not apart else int(np.ceil(apart)) + 2
        signs = np.unique(offsets).tolist()
        self.shares = {sign: _shares(sign * apart, count, self.beyond) for sign in signs}
        if periodic:
            whole = _smooth(solid, count, width)
            whole[0, 0] = 0
        else:
            quarter = kernels(solid).cells(count + 2 * self.beyond, width)[0]
            whole = circulant_spectrum(quarter, next_fast_len(2 * len(quarter), real=True), False, False)
        self.response = FourierOperator((len(whole), len(whole)), [[whole]])
        self.held, (_, twist) = 3e-3 * short_waves(solid)[0] / width, _seen(ell, len(whole), width)
        self.twisted = self.held + float(np.max(whole * twist**2))
        self.near = count if periodic else next_fast_len(count, real=True)

    def __matmul__(self, forces):
        """Returns gaps from forces, arrays (corners, n, n)."""
        u2 = self.displacement(forces)
        gaps = np.array([self.shares[a].T @ u2 @ self.shares[b] for a, b in self.offsets.tolist()])
        if len(gaps) == len(TWIST_MODE):
            gaps += np.multiply.outer(TWIST_MODE, self.held * np.tensordot(TWIST_MODE, forces, 1))
        return gaps

    def pressed(self, forces):
        """Returns the forces on cells of the second surface, array (m, m)."""
        pairs = zip(self.offsets.tolist(), forces)
        return np.sum([self.shares[a] @ own @ self.shares[b].T for (a, b), own in pairs], axis=0)

    def displacement(self, forces):
        return self.response(self.pressed(forces)[None])[0]

    def above(self, forces):
        """Returns u2 at the contact points, array (n, n)."""
        u2 = self.displacement(forces)
        inside = slice(self.beyond, len(u2) - self.beyond)
        return u2[inside, inside]

    @cached_property
    def smooth(self):
        """U2 at the wavenumbers of the preconditioner, all positive."""
        return _smooth(self.solid, self.near, self.width)

    @cached_property
    def _corners(self):
        """What waves of u2 raise, twist and turn four corners by, array (4, ...)."""
        (u, *phi), twist = _seen(self.ell, self.near, self.width)
        return np.array((u, twist, *phi))

    def added(self, R, displaced):
        """Returns R of both bodies from that of the first, array (4, 4, ...), for u, w, phi1 and phi2 in
        gap = u + a b w - a phi1 - b phi2.
        """
        both = np.insert(np.insert(R, 1, 0.0, axis=0), 1, 0.0, axis=1)
        both[1, 1] = max(self.held, FLOOR * displaced / self.width)
        both += self.smooth * self._corners[:, None] * self._corners
        return both

    def with_short(self, short, displaced):
        """Returns what short waves displace, twist and turn, over the first body's displacement."""
        seen = (self._corners**2).mean(axis=(1, 2)) * short_waves(self.solid)[0] / displaced
        return np.insert(short, 1, 0.0) + np.maximum(seen, (0, FLOOR, 0, 0))


def _smooth(solid, length, width):
    k = wavenumbers(length, width, 2)[1]
    return normal_symbol(solid, k.ravel()).reshape(k.shape) / width**2


def _weights(shift):
    """Returns the cells that share a force aside, and their weights."""
    first = int(np.rint(shift))
    others = [np.delete(NODES, number) for number in range(len(NODES))]
    weights = [np.prod((shift - first - rest) / (own - rest)) for own, rest in zip(NODES, others)]
    return first + NODES, np.array(weights)


def _seen(ell, length, width):
    """Returns (u, phi1, phi2) and twist of four corners under waves of u2."""
    ways, weights = _weights(ell / 2 / width)
    turns = (np.exp(1j * width * k[..., None] * ways) @ weights for k in wavenumbers(length, width, 2)[0])
    (c1, s1), (c2, s2) = ((turn.real, turn.imag) for turn in turns)
    return (c1 * c2, s1 * c2, c1 * s2), -s1 * s2


def _shares(shift, count, beyond):
    """Returns shares of forces so many cells aside, sparse (m, n)."""
    ways, weights = _weights(shift)
    m, cells = count + 2 * beyond, np.arange(count)
    rows = (cells[:, None] + beyond + ways) % m  # on a period they go on where they began
    places = rows.ravel(), np.repeat(cells, len(ways))
    found = csr_array((np.tile(weights, count), places), shape=(m, count))
    found.eliminate_zeros()
    return found
