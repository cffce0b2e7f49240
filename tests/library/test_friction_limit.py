"""Where friction is so large that contact has more than one answer: systems by hand, meshes, cells."""

import contextlib
import itertools
from types import SimpleNamespace

import numpy as np
import pytest

import microblock as mb
from microblock.corners import coulomb
from microblock.corners.follower import Follower, FrictionalContact
from microblock.fem import meshes

# Two nodes under a flat obstacle, of unit compliances; the first is GAP away, and its gap falls by C t under
# its shear force t, its displacement s by C n. Both in contact,
#     2 n1 = P - GAP + C t1,        2 t1 = Q + C n1 if both stick and nothing had sheared before.
# Where node 1 slips forwards n1 = (P - GAP)/(2 - C f): from f = 2/C on its force falls as P grows.
C, GAP = 0.8, 1.0  # f = 2.5 is the critical friction
P, Q = 2.0, 1.68


def wedged(load):
    """(n1, t1) of both nodes sticking under (load, Q), first pressed to (P, 0)."""
    t = (Q + C / 2 * (load - GAP)) / (2 - C * C / 2)
    return (load - GAP + C * t) / 2, t


def slips_at(f):
    """The load under Q at which t1 = f n1, from `wedged`."""
    t0, slope = wedged(GAP)[1], (C / 2) / (2 - C * C / 2)
    return GAP + t0 * (1 - C * f / 2) / (f / 2 - slope * (1 - C * f / 2))


def on_cells(f, coupled=True):
    cross = np.diag([-C, 0.0])
    return FrictionalContact(np.eye(2), cross, np.eye(2), np.array([GAP, 0.0]), f, coupled)


def as_body(contact, rho=1.0):
    """The System of the same contact: a body whose unknowns are -u2 and u1 of the nodes."""
    n = contact.nodes
    response = np.block([[contact.normal, -contact.cross.T], [-contact.cross, contact.tangential]])
    one = np.eye(2 * n)
    made = coulomb.System(
        np.linalg.inv(response), np.zeros(2 * n), (one[:n],), one[n:], one[n:], contact.gaps[None],
        np.tile([0.0, 1.0], (n, 1)), np.ones(n), contact.friction, rho,
    )  # fmt: skip
    return made if contact.coupled else made.uncoupled()


def followed(solver, f, pairs, coupled=True):
    """[(n, t)] at the pairs of loads."""
    if solver == "cells":
        path = Follower(on_cells(f, coupled))
        return [(one.normal, one.tangential) for one in (path.to(*pair) for pair in pairs)]
    system = as_body(on_cells(f, coupled))
    system = system.reduced() if solver == "reduced" else system
    return [(one.iterate.pressures[0], one.iterate.shear) for one in coulomb.History(system).follow(pairs)]


NEWTON = mb.Newton()
RTOL = {NEWTON: None, None: 0.3}
SOLVERS = ("cells", "reduced", "whole")
WAY = [(P, 0.0), (P, Q)]


@pytest.mark.parametrize("solver", SOLVERS)
def test_both_solvers_follow_the_wedged_node_up_to_where_it_snaps(solver):
    f = 3.0
    snap = slips_at(f)
    *_, (n, t) = followed(solver, f, [*WAY, (snap + 1e-3, Q)])
    assert (n[0], t[0]) == pytest.approx(wedged(snap + 1e-3), rel=1e-12)
    with pytest.raises(mb.NotConverged, match="unique") as failure:
        followed(solver, f, [*WAY, (snap - 1e-3, Q)])
    if solver != "cells":
        assert failure.value.reached == pytest.approx((snap, Q), rel=1e-5)


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("f, coupled", [(2.4, True), (3.0, False)])
def test_what_is_advised_helps(solver, f, coupled):
    """A smaller friction, or no coupling: node 1 slips, and opens at P = GAP, as the way on says."""
    (n, t), (last, _) = followed(solver, f, [*WAY, (1.02, Q), (0.97, Q)], coupled)[-2:]
    wanted = 0.02 / (2 - C * f) if coupled else 0.01
    assert (n[0], t[0]) == pytest.approx((wanted, f * wanted), rel=1e-9) and abs(last[0]) < 1e-12


@pytest.mark.parametrize("f,continues", [(0.9 / C, True), (1.1 / C, False)])
def test_one_node_on_given_motions_snaps_from_f_c_over_h_on(f, continues):
    """Klarbring's node: n - C t = d, t - C n = D, so that (1 - C f) n = d where it slips: f = 1/C."""
    response = np.array([[1.0, C], [C, 1.0]])
    system = coulomb.System(
        np.linalg.inv(response), np.zeros(2), (np.eye(1, 2),), np.eye(1, 2, 1), np.eye(1, 2, 1),
        np.zeros((1, 1)), np.array([[0.0, 1.0]]), np.ones(1), f, 1.0,
    )  # fmt: skip
    D = 0.5
    history = coulomb.History(system, (True, True))
    slips = D * (1 - f * C) / (f - C)  # t = f n, both from d and D
    way = [(1.0, 0.0), (1.0, D), (slips + 0.01, D)]
    *_, last = history.follow(way)
    d = slips + 0.01
    assert last.iterate.pressures[0, 0] == pytest.approx((d + C * D) / (1 - C * C), rel=1e-12)
    if continues:
        *_, last = history.follow([*way, (slips / 2, D)])
        assert last.iterate.pressures[0, 0] == pytest.approx(slips / 2 / (1 - C * f), rel=1e-12)
    else:
        assert slips < 0  # held while the obstacle is lifted
        with pytest.raises(mb.NotConverged, match="unique") as failure:
            list(history.follow([*way, (slips - 0.01, D)]))
        assert failure.value.reached == pytest.approx((slips, D), rel=1e-4)


def drawn(seed, least=-0.5):
    """A FrictionalContact by chance, of two to four nodes, with a friction of 10^least or more."""
    random = np.random.default_rng(seed)
    n, f = int(random.integers(2, 5)), 10 ** random.uniform(least, least + 1.2)
    root = random.normal(size=(2 * n, 2 * n))
    response, gaps = root @ root.T / (2 * n) + 0.05 * np.eye(2 * n), random.uniform(0, 1, n)
    return FrictionalContact(
        response[:n, :n], response[n:, :n], response[n:, n:], gaps - gaps.min(), float(f)
    )


def all_states(contact, before, loads):
    """Corner forces of all states under loads on the way from a Moment, one array a state: each node open,
    sticking or slipping either way, from the compliances alone.
    """
    n, f, found = contact.nodes, contact.friction, []
    way = before.offset - (contact.cross @ before.normal + contact.tangential @ before.tangential)
    whole = np.block([[contact.normal, contact.cross.T], [contact.cross, contact.tangential]])
    for kinds in itertools.product(("open", "stick", 1, -1), repeat=n):
        closed = np.array([kind != "open" for kind in kinds])
        stick = np.array([kind == "stick" for kind in kinds])
        sigma = np.array([kind if kind in (1, -1) else 0 for kind in kinds])
        rows, right = np.zeros((2 * n + 2, 2 * n + 2)), np.zeros(2 * n + 2)
        rows[:-2, :-2] = whole
        rows[:n, -2] = rows[n:-2, -1] = -1
        right[:-2] = np.concatenate((-contact.gaps, -way))
        for k in range(n):
            if not closed[k]:
                rows[k], right[k] = np.eye(2 * n + 2)[k], 0
            if not stick[k]:
                rows[n + k], right[n + k] = np.eye(2 * n + 2)[n + k] - f * sigma[k] * np.eye(2 * n + 2)[k], 0
        rows[-2:], right[-2:] = np.repeat(np.eye(2), n, axis=1) @ np.eye(2 * n, 2 * n + 2), loads
        if abs(np.linalg.det(rows)) < 1e-12:
            continue
        values = np.linalg.solve(rows, right)
        gaps, slips = contact.gaps - values[-2] + (whole @ values[:-2])[:n], values[-1] - way
        slips = slips - (whole @ values[:-2])[n:]
        p, q = values[:n], values[n:-2]
        conditions = (p, gaps, f * p - abs(q), np.where(closed, sigma * slips, 0))
        if min(one.min() for one in conditions) > -1e-12:
            found.append(p)
    return found


@pytest.mark.nightly(40, 84)
def test_no_way_on_is_one_of_several_without_a_word(seeds, monkeypatch):
    """Wherever a history goes on, enumeration finds one state near the last one, or Newton has refused."""
    seen, checked = [], coulomb.History._require_unique

    def compared(history, state, level, sets, on):
        refused = False
        try:
            checked(history, state, level, sets, on)
        except mb.NotConverged:
            refused = True
        now = state.iterate
        before = SimpleNamespace(normal=now.pressures[0], tangential=now.shear, offset=now.shift)
        if np.any(state.level):
            found = [abs(one - now.pressures[0]).max() for one in all_states(contact, before, level)]
            seen.append((sum(apart < 1e-4 for apart in found), refused))
        if refused:
            raise mb.NotConverged("as compared")

    monkeypatch.setattr(coulomb.History, "_require_unique", compared)
    for seed in seeds:
        contact = drawn(seed, -0.3)
        if contact.nodes == 4:
            continue  # whose 256 pieces take long
        ends = [(1.0, shear * contact.friction) for shear in (0.0, 0.9, -0.9)]
        with contextlib.suppress(mb.NotConverged):
            list(coulomb.History(as_body(contact).reduced()).follow(ends))
    assert len(seen) > len(seeds) and set(seen) == {(1, False), (2, True)}


LOAD = np.pi / 2  # a_Hz = 1
TALL = mb.Cosserat(E=2 * (1 - 0.3**2), nu=0.3, ell=3.0, beta=1.0)


def cylinder(f, body, method=None, coupled=True):
    """Pressed, and sheared to full slip one way and half of it the other way."""
    pairs = [(LOAD, 0.0), (LOAD, 0.999 * f * LOAD), (LOAD, -0.999 * f * LOAD)]
    law = mb.Microblock(friction=f)
    return mb.Contact(body, mb.Cylinder(1.0), law, method).history(pairs, coupled=coupled, rtol=RTOL[method])


def block(h=0.2):
    mesh = meshes.uniform(meshes.Ground(far=4.0, reach=(-1.6, 1.6), half=False), h)
    return mb.Body(mesh, TALL, order=2, fixed="bottom")


def test_a_mesh_on_which_states_jump_says_so():
    """Blocks three times as long as the contact: Newton finds states that are not next to the last one."""
    with pytest.raises(mb.NotConverged, match="jumps"):
        cylinder(4.0, block(), NEWTON)
    for f, coupled in ((3.0, True), (4.0, False)):  # what it advises
        state = cylinder(f, block(), NEWTON, coupled).states[-1]
        assert state.work == pytest.approx(state.energy + state.dissipation, rel=1e-9)
