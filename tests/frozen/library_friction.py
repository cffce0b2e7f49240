"""Frozen problems of friction in the names of the library: see `tests.frozen.library`."""

from dataclasses import dataclass

import numpy as np

import microblock as mb
from microblock.corners import active_set, coulomb, exchange, projected_gradients
from microblock.corners.friction import FrictionalContact, FrictionPath

SAME = 1e-9  # share of a leg, within which changes are one event
NODES = {"stick", "slip"}  # states of a node that touches


@dataclass(frozen=True)
class Followed:
    """A path of loads as any follower gives it.

    Attributes
    ----------
    events : list of (leg, share, kind, number)
        Corners "close" and "open"; nodes "stick", "slip" or "leave". What changes to and fro at one load is
        left out, as is that all nodes slip at a pair Q = f P; those at one load are in alphabetical order.
    forces : array (legs, corners n + n)
        Corner forces and tangential forces at the pairs.
    energies : array (legs, 3)
        Energy, work and dissipation.
    motions : array (legs, 2)
        Approach and tangential displacement of the obstacle.
    slip : array (legs, n)
    residual : float
    """

    events: list
    forces: np.ndarray
    energies: np.ndarray
    motions: np.ndarray
    slip: np.ndarray
    residual: float


def solve_system(compliance, gaps, friction, path, coupled=True):
    """The path of a small system, `Followed`, by the follower of cells."""
    corners, n = gaps.shape
    m = corners * n
    own = FrictionPath(
        FrictionalContact(
            compliance[:m, :m], compliance[m:, :m], compliance[m:, m:], gaps.ravel(), friction, coupled
        )
    )
    found, first = [own.to(*pair) for pair in path], (0, 0.0, "close", int(np.argmin(gaps)))
    return Followed(
        _events([first] + [_plain(one) for one in own.changes], path, friction, anew=True),
        np.array([np.concatenate((one.normal, one.tangential)) for one in found]),
        np.array([(one.energy, one.work, one.dissipation) for one in found]),
        np.array([(one.approach, one.offset) for one in found]),
        np.array([one.slip for one in found]),
        max(one.residual for one in found),
    )


def answer(solve, system):
    """What a follower gives, or the name of the error that it raises."""
    try:
        return solve(**system)
    except mb.MicroblockError as failure:
        return type(failure).__name__


def solve_system_by_newton(compliance, gaps, friction, path, coupled=True):
    """The same by the follower of bodies, whose unknowns are the displacements of corners and nodes."""
    corners, n = gaps.shape
    m = corners * n
    signs = np.where(np.arange(m + n) < m, -1.0, 1.0)  # of displacements along n, and of pressures
    one = np.eye(m + n)
    system = coulomb.System(
        np.linalg.inv(compliance * signs * signs[:, None]),
        np.zeros(m + n),
        tuple(one[c * n : (c + 1) * n] for c in range(corners)),
        one[m:],
        one[m:],
        gaps,
        np.tile([0.0, 1.0], (n, 1)),
        np.ones(n),
        friction,
        1.0,
    )
    found = list(coulomb.History((system if coupled else system.uncoupled()).reduced()).follow(path))
    forces = np.array([np.concatenate((one.iterate.pressures.ravel(), one.iterate.shear)) for one in found])
    works = np.array([(one.work, one.dissipation) for one in found])
    return Followed(
        _events([_plain(one) for one in found[-1].changes], path, friction),
        forces,
        np.column_stack((np.einsum("ij,jk,ik->i", forces, compliance, forces) / 2, works)),
        np.array([(one.iterate.approach, one.iterate.shift) for one in found]),
        np.array([one.slip for one in found]),
        max(one.residual for one in found),
    )


def touching(compliance, gaps, load):
    """{solver: (corner forces, gaps, approach)} without friction at a load, and events on the way there."""
    m = gaps.size
    H, initial = compliance[:m, :m], gaps.ravel()
    there = np.isfinite(initial)
    state = active_set.solve(H, initial, load=load)
    pressed = active_set.solve(H, initial, approach=state.approach)
    path = active_set.path(H, initial, [load / 2, load])
    products = projected_gradients.solve(_Dense(H), initial.reshape(gaps.shape), load=load, rtol=1e-13)
    found = {
        "active set": (state.forces, state.gaps, state.approach),
        "approach given": (pressed.forces, pressed.gaps, pressed.approach),
        "path": (path.states[-1].forces, path.states[-1].gaps, path.states[-1].approach),
        "gradients": (products.forces.ravel(), products.gaps.ravel(), products.approach),
    }
    faces = exchange.exchange(H[np.ix_(there, there)], initial[there], np.ones(there.sum(), bool), load)
    if faces is not None:
        forces = np.zeros(m)
        forces[there] = faces[0]
        bare = initial + H @ forces
        approach = float(bare[forces > 0].mean())
        found["exchange"] = forces, bare - approach, approach
    return found, [(one.kind, one.corner, one.load) for one in path.events]


class _Dense:
    """A flexibility by its products alone, as `projected_gradients.solve` takes it."""

    def __init__(self, H):
        self._H = H

    def __matmul__(self, forces):
        return (self._H @ forces.ravel()).reshape(forces.shape)

    def precondition(self, values):
        return values / np.diag(self._H).reshape(values.shape)


def _plain(change):
    return change.leg, float(change.share), change.kind, change.index


def _events(changes, path, friction, anew=False):
    """What changes at each load, as of `Followed`.

    On a leg from full slip to full slip all nodes that touch count as slipping. `anew`: a follower that sets
    them so, and to stick after it, without a word.
    """
    raw, shown, found = {}, {}, []
    full = [0.0] + [np.sign(Q) * (abs(Q) >= friction * P * (1 - SAME)) for P, Q in path]
    sliding = [before != 0 and before == after for before, after in zip(full, full[1:])]
    for leg, slides in enumerate(sliding):
        if anew and (slides or leg and sliding[leg - 1]):
            kind = "slip" if slides else "stick"
            raw |= {key: kind for key in raw if raw[key] in NODES}
        for share, group in _groups([one[1:] for one in changes if one[0] == leg]):
            raw |= {(kind in ("close", "open"), number): kind for _, kind, number in group}
            last = full[leg + 1] and share >= 1 - SAME
            for key in sorted(raw, key=lambda key: (raw[key], key)):
                now, before = raw[key], shown.get(key, "open" if key[0] else "leave")
                now = "slip" if slides and now == "stick" else now
                if now != before and not (last and {now, before} == NODES):
                    found.append((leg, share, now, key[1]))
                    shown[key] = now
    return found


def _groups(changes):
    """[(share, changes there), ...] of a leg, from share 0 on."""
    found = [(0.0, [])]
    for one in changes:
        if one[0] > found[-1][0] + SAME:
            found.append((one[0], []))
        found[-1][1].append(one)
    return found
