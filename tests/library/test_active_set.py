"""Contact states on a compliance: solve, path, seeded small problems and an independent solver."""

from collections import Counter

import numpy as np
import pytest

from microblock import MicroblockError, NotConverged
from microblock.corners.active_set import _kkt, _pivoting, _problems, path, solve

KINDS = ("plain", "indefinite", "inf", "weights", "duplicates", "ties", "pairs", "singular", "rigid", "tiny")
KKT = 1e-10  # what is promised; the solver aims at 1e-15


def spd(rng, m, rank=None):
    factors = rng.normal(size=(m, rank or m))
    return factors @ factors.T


def problem(seed):
    """(kind, H, g0, c, options) of one seeded small problem; from "duplicates" on degenerate by
    construction.
    """
    rng = np.random.default_rng(seed)
    kind, m = KINDS[seed % len(KINDS)], int(rng.integers(1, 13))
    H, g0, c = spd(rng, m), rng.normal(size=m), np.ones(m)
    if kind == "indefinite":
        H -= 10.0 ** rng.uniform(0, 3)
    elif kind == "inf":
        g0[rng.random(m) < 0.4] = np.inf
        g0[rng.integers(m)] = 0.0
    elif kind == "weights":
        c = 10.0 ** rng.uniform(-2, 2, m)
    elif kind == "duplicates":
        copy = rng.integers(0, m, m)
        H, g0 = H[np.ix_(copy, copy)], g0[copy] + rng.choice([0, 0, 1e-15, 0.1], m)
    elif kind == "ties":  # a circulant of integers on integer gaps
        row = rng.integers(-2, 3, m)
        row = row + np.roll(row[::-1], 1)
        H = row[(np.arange(m)[:, None] - np.arange(m)) % m] + 0.0
        H += np.eye(m) * (1 - min(np.linalg.eigvalsh(H).min().round(), 0))
        g0 = rng.integers(0, 2, m) + 0.0
    elif kind == "pairs":  # two corners at each node, mirrored
        half = spd(rng, m)
        other = 0.3 * (half + half[::-1, ::-1])
        H = np.block([[half + half[::-1, ::-1], other], [other, half + half[::-1, ::-1]]])
        g0 = np.abs(g0 + g0[::-1])
        g0, c = np.tile(g0, 2), np.ones(2 * m)
    elif kind == "singular":
        H = spd(rng, m, rank=max(1, m // 2)) + 10.0 ** rng.uniform(-16, -10) * np.eye(m)
    elif kind == "rigid":
        stiff = rng.random(m) < 0.5
        H[stiff], H[:, stiff] = 0, 0
        g0[stiff] = rng.integers(0, 2, stiff.sum())
    elif kind == "tiny":  # weights of a graded mesh in rows, columns and gaps
        c = 10.0 ** rng.uniform(-12, 0, m)
        H, g0 = H * c[:, None] * c, g0 * c
    approach = kind not in ("indefinite", "rigid") and rng.random() < 0.3
    scale = 10.0 ** rng.uniform(-4, 3)
    level = {"approach": (g0 / c).min() + scale} if approach else {"load": scale}
    return kind, H, g0, c, level


def residual(H, g0, c, state, load=None):
    """Largest relative residual of (a), in shares of the load and from the data alone."""
    touch = np.isfinite(g0)
    share = c * state.forces
    assert np.all(share >= 0) and np.all(share[~touch] == 0)
    H, g0 = H[np.ix_(touch, touch)] / c[touch, None] / c[touch], g0[touch] / c[touch]
    gaps, share = g0 - state.approach + H @ share[touch], share[touch]
    length = (np.abs(g0) + abs(state.approach) + np.abs(H) @ share)[state.closed[touch]].max(initial=0) or 1.0
    if share.sum() == 0:
        return max(0, -gaps.min())
    parts = [max(0, -gaps.min()) / length, np.abs(share * gaps).sum() / (share.sum() * length)]
    return max(parts + ([] if load is None else [abs(share.sum() - load) / load]))


@pytest.mark.nightly(10_000)
def test_ten_thousand_small_problems(seeds, capsys):
    failures, worst, used = Counter(), Counter(), Counter()
    for seed in seeds:
        kind, H, g0, c, level = problem(seed)
        try:
            state = solve(H, g0, c=c, **level)
        except MicroblockError as failure:
            # forces that grow beyond 1e13 of the load of a well-posed one: rigid corners within rounding
            spectrum = np.linalg.eigvalsh(H)
            if not (kind == "singular" and "approach" in level and spectrum[0] < 1e-13 * spectrum[-1]):
                failures[f"{kind}: {type(failure).__name__}: {str(failure)[:60]}"] += 1
            continue
        error = residual(H, g0, c, state, level.get("load"))
        worst[kind] = max(worst[kind], error, state.kkt)
        used.update(
            single=state.single_pivots > 0, dropped=state.dropped > 0, raised=state.regularisation > 1e-12
        )
        assert error < KKT and state.kkt < KKT, (seed, kind, error)
    with capsys.disabled():
        print(
            "\nfailures:",
            dict(failures),
            "\nworst residuals:",
            {kind: f"{worst[kind]:.0e}" for kind in KINDS},
            "\nproblems that needed it:",
            dict(used),
        )
    assert sum(failures.values()) == 0
    assert used["single"] > 0 and used["dropped"] > 0


def test_an_approach_that_rigid_corners_cannot_take_is_refused():
    """The two corners move against each other alone: 1e8 of force on both changes no sum of their gaps, and
    beside H f a missing gap of 1 is small."""
    H = np.zeros((6, 6))
    H[np.ix_([3, 5], [3, 5])] = [[1.0, -1.0], [-1.0, 1.0]]
    with pytest.raises(NotConverged, match="rigid corners"):
        solve(H, np.array([0.0, 0, 0, 0, 0, -1]), approach=0.0, c=np.array([1.0, 1, 1, 100, 1, 0.01]))


@pytest.mark.nightly(4000)
def test_plain_active_set_cycles(seeds):
    """Negative control: the same exchanges of (b) without the safeguard come back to where they were."""
    cycles = 0
    for seed in [s for s in seeds if KINDS[s % len(KINDS)] in ("plain", "singular")]:
        _, H, g0, c, level = problem(seed)
        if "approach" in level:
            continue
        [(r, K)] = next(_problems(H, g0, c, free=True)).reduced.items()
        q = np.delete(g0 - g0[r] + level["load"] * (H[:, r] - H[r, r]), r)
        nothing = np.zeros(len(q), bool)
        with_safeguard, _ = _pivoting(K, q, nothing, Counter())
        try:
            plain, _ = _pivoting(K, q, nothing, Counter(), patience=np.inf)
        except NotConverged:  # more sets tried than the 2^11 there are
            cycles += 1
        else:
            assert np.array_equal(plain > 0, with_safeguard > 0)
    print(cycles, "cycles")
    assert cycles > 0


@pytest.mark.nightly(2000)
def test_path_and_solve_agree_on_small_problems(seeds):
    events = 0
    for seed in seeds:
        kind, H, g0, c, level = problem(seed)
        if "approach" in level:
            continue
        load = level["load"]
        found = path(H, g0, [load, load / 3], c=c)
        events += len(found.events)
        for state, asked in zip(found.states, (load / 3, load), strict=True):
            assert residual(H, g0, c, state, asked) < KKT
            direct = solve(H, g0, load=asked, c=c)
            moved = c * (state.forces - direct.forces) / asked
            # what the data determine: the energy of the difference, so forces too where H is regular
            size = (
                np.abs(c * direct.forces) @ np.abs(H / c / c[:, None]) @ np.abs(c * direct.forces) / asked**2
            )
            assert moved @ (H / c / c[:, None]) @ moved <= 1e-12 * size + 1e-30
        closed = np.zeros(len(g0), bool)
        for event in found.events:
            assert closed[event.corner] == (event.kind == "opens")
            closed[event.corner] = event.kind == "closes"
        assert np.all(np.diff([event.load for event in found.events]) >= 0)
        # the set that the path ended with is not repaired by the refinement, except where forces are not
        # unique
        if kind in ("plain", "indefinite", "inf", "weights", "tiny"):
            assert np.array_equal(closed, solve(H, g0, load=load, c=c).closed), seed
    assert events > len(seeds)


@pytest.mark.parametrize(
    "kinds", [("plain", "inf", "weights", "ties", "pairs"), ("duplicates", "singular", "rigid")]
)
@pytest.mark.nightly(600)
def test_an_independent_solver_agrees(kinds, seeds):
    """Against the dual method of Goldfarb and Idnani: forces where they are unique, else the objective."""
    import quadprog

    checked = 0
    for seed in seeds:
        kind, H, g0, c, level = problem(seed)
        if kind not in kinds or "approach" in level:
            continue
        touch, load = np.isfinite(g0), level["load"]
        G, a, weights = H[np.ix_(touch, touch)], g0[touch], c[touch]
        unique = np.linalg.cond(G) < 1e6
        # it needs a definite matrix, well conditioned enough for its own digits
        regular = G if unique else G + 1e-6 * (np.trace(G) or 1.0) * np.eye(len(a))
        constraints = np.column_stack((weights, np.eye(len(a))))
        theirs = quadprog.solve_qp(regular, -a, constraints, np.append(load, np.zeros(len(a))), meq=1)[0]
        ours = solve(H, g0, load=load, c=c).forces[touch]
        if unique:
            assert ours == pytest.approx(theirs, abs=1e-8 * np.abs(ours).max())  # condition 1e6, some 1e-14
        theirs = np.maximum(theirs, 0)
        theirs *= load / (weights @ theirs)  # it takes the constraints to 1e-6 where H is singular
        objective = [f @ G @ f / 2 + a @ f for f in (ours, theirs)]
        size = np.abs(a) @ ours + ours @ np.abs(G) @ ours
        assert objective[0] <= objective[1] + 1e-13 * size  # no admissible forces have less: rounding
        assert objective[1] <= objective[0] + 1e-9 * size + (
            0 if unique else 1e-6 * (np.trace(G) or 1.0) * load**2
        )
        checked += 1
    assert checked >= len(seeds) // 6


def test_one_corner():
    state = solve([[2.0]], [0.5], load=3)
    assert (state.forces[0], state.approach, state.closed[0]) == (3, 6.5, True)
    assert solve([[2.0]], [0.5], approach=6.5).forces[0] == pytest.approx(3, rel=1e-15)


def test_two_corners_by_hand():
    """H = [[2, 1], [1, 2]], g0 = (0, 1): alone the first until 2 P - 1 = P, at P = 1, d = 2."""
    H, g0 = [[2, 1], [1, 2]], [0, 1]
    found = path(H, g0, [0.5, 3])
    assert [(e.corner, e.kind) for e in found.events] == [(0, "closes"), (1, "closes")]
    assert [(e.load, e.approach) for e in found.events] == [(0, 0), pytest.approx((1, 2), rel=1e-11)]
    first, second = found.states
    assert first.forces == pytest.approx([0.5, 0]) and first.gaps == pytest.approx([0, 0.5], abs=1e-15)
    # both: 2 f1 + f2 = d, f1 + 2 f2 = d - 1, so f1 - f2 = 1
    assert second.forces == pytest.approx([2, 1], rel=1e-14)
    assert second.approach == pytest.approx(5, rel=1e-14)


def test_two_corners_with_weights_by_hand():
    """c = (1, 2) and the same: closed both, 2 f1 + f2 = d, f1 + 2 f2 = 2 d - 1, f1 + 2 f2 = P."""
    state = solve([[2, 1], [1, 2]], [0, 1], load=3, c=[1, 2])
    assert state.approach == pytest.approx(2, rel=1e-14)  # 2 d - 1 = 3
    assert state.forces == pytest.approx([1 / 3, 4 / 3], rel=1e-13) and state.load == pytest.approx(
        3, rel=1e-15
    )
    alone = solve([[2, 1], [1, 2]], [0, 1], load=0.1, c=[1, 2])  # d = 2 f1 = 0.2
    assert alone.gaps == pytest.approx([0, 1 - 2 * 0.2 + 0.1], abs=1e-15)


@pytest.mark.parametrize(
    "forces, closed, approach, expected",
    [
        ([2, 1], [1, 1], 5, 0),
        ([2, 1], [1, 1], 6, 1 / 11),
        ([2, 2], [1, 1], 6, 1 / 3),
        ([3, 0], [1, 0], 6, 2 / 12),
    ],
)
def test_kkt_sees_every_violation(forces, closed, approach, expected):
    """H = [[2, 1], [1, 2]], g0 = (0, 1), P = 3: none; closed gaps -1 of 6 + 5; load 4; open gap -2 of 12."""
    H, g0, forces = np.array([[2.0, 1], [1, 2]]), np.array([0.0, 1]), np.array(forces, float)
    kkt = _kkt(H, g0, forces, np.array(closed, bool), approach, 3.0)
    assert kkt == pytest.approx(expected, rel=1e-14)


def test_a_corner_opens_again():
    """The second corner is the stiffer one and pulls the first off the obstacle: H_12 > H_22."""
    H, g0 = [[4, 2], [2, 1.5]], [0, 1]
    found = path(H, g0, [10])
    assert [(e.corner, e.kind) for e in found.events] == [(0, "closes"), (1, "closes"), (0, "opens")]
    # closes where 4 P = 1 + 2 P; with both, 4 f1 + 2 f2 = 1 + 2 f1 + 3/2 f2 and f1 + f2 = P: f1 = 0 at P = 2
    assert [e.load for e in found.events] == pytest.approx([0, 0.5, 2], rel=1e-11)
    assert found.states[0].forces == pytest.approx([0, 10]) and list(found.states[0].closed) == [False, True]
    cold = solve(H, g0, load=10)
    assert cold.dropped == 1 and np.array_equal(cold.closed, found.states[0].closed)


def parabola(n=300, width=3.0):
    """Log kernel -ln|x|/pi, exact cell means on a uniform mesh, gap x^2/2: Hertz with a^2 = 2 P/pi."""
    x, h = (np.arange(n) - (n - 1) / 2) * width / n, width / n
    primitive = [r * np.log(np.abs(r)) - r for r in (x[:, None] - x + h / 2, x[:, None] - x - h / 2)]
    return -(primitive[0] - primitive[1]) / (np.pi * h), x**2 / 2, x, h


def test_parabola_gives_the_ellipse():
    H, g0, x, h = parabola()
    load = np.pi / 2
    state = solve(H, g0, load=load)
    ellipse = np.sqrt(np.maximum(1 - x**2, 0))
    # cells of 1 % of the contact: the error sits in the two at the edge, h^1.5 in L2
    assert np.sqrt(h * np.sum((state.forces / h - ellipse) ** 2)) < 2 * h**1.5
    assert h * state.closed.sum() / 2 == pytest.approx(1, abs=h)
    assert state.kkt < 1e-14 and state.single_pivots == 0 and state.iterations < 20
    assert state.forces == pytest.approx(state.forces[::-1], abs=1e-13)


def test_parabola_path_closes_pair_by_pair():
    H, g0, x, _ = parabola()
    found = path(H, g0, [np.pi / 2])
    count = found.states[0].closed.sum()
    assert len(found.events) == count and {event.kind for event in found.events} == {"closes"}
    for one, other in zip(found.events[::2], found.events[1::2], strict=True):
        assert (one.load, one.corner) == (other.load, len(x) - 1 - other.corner)  # both at once
    loads = [event.load for event in found.events[::2]]
    assert np.all(np.diff(loads) > 0)
    assert loads[0] == 0 and loads[-1] < np.pi / 2


def rough(seed=1, n=60):
    H, g0, x, _ = parabola(n)
    return H + 0.5, g0 + 0.02 * np.random.default_rng(seed).normal(size=n), x


def test_flat_punch_touches_at_once():
    H, _, x, _ = parabola(100)
    g0 = np.where(np.abs(x) < 1, 0, np.inf)
    found = path(H, g0, [1.0])
    assert {event.load for event in found.events} == {0.0} and len(found.events) == np.isfinite(g0).sum()
    assert np.all(found.states[0].gaps[np.abs(x) > 1] == np.inf)


def test_a_tie_at_first_touch_may_leave_corners_open():
    """As in `test_a_corner_opens_again`, both touching at once: the stiff corner takes it all from the
    beginning.
    """
    found = path([[4, 2], [2, 1.5]], [0, 0], [1])
    assert [(e.load, e.corner, e.kind) for e in found.events] == [(0, 1, "closes")]
    assert found.states[0].forces == pytest.approx([0, 1]) and found.states[0].approach == pytest.approx(1.5)


def test_path_does_not_depend_on_the_loads_asked_for():
    H, g0, _ = rough()
    whole, part = path(H, g0, np.linspace(0, 2, 9)), path(H, g0, [2.0, 0.5])
    assert whole.events == part.events
    assert [state.load for state in part.states] == pytest.approx([0.5, 2], rel=1e-15)
    for one, other in zip(part.states, (whole.states[2], whole.states[8]), strict=True):
        assert np.array_equal(one.forces, other.forces)
    short = path(H, g0, [0.5])
    assert short.events == [event for event in whole.events if event.load <= 0.5]
    assert path(H, g0, [0.0]).states[0].forces.sum() == 0


def dense(seed=2, m=40):
    """No kernel: corners open again, the first to touch among them."""
    rng = np.random.default_rng(seed)
    return spd(rng, m) - 5.0, rng.normal(size=m)


@pytest.mark.parametrize("case", [dense, lambda: rough()[:2]], ids=["dense", "rough"])
def test_sets_change_at_the_events(case):
    H, g0 = case()
    events = path(H, g0, [2.0]).events
    assert {event.kind for event in events} == ({"closes", "opens"} if case is dense else {"closes"})
    closed = np.zeros(len(g0), bool)
    for event, following in zip(events, events[1:] + [None], strict=True):
        closed[event.corner] = event.kind == "closes"
        upper = following.load if following else 2.0
        state = solve(H, g0, load=(event.load + upper) / 2)  # from nothing, not from the path
        assert np.array_equal(state.closed, closed)


@pytest.mark.parametrize("case", [dense, lambda: rough()[:2]], ids=["dense", "rough"])
def test_work_of_the_load_is_the_energy(case):
    H, g0 = case()
    events = path(H, g0, [2.0]).events
    last = solve(H, g0, load=2.0)
    load, approach = np.array([(point.load, point.approach) for point in [*events, last]]).T
    energy = last.forces @ H @ last.forces / 2
    # load over approach is piecewise linear with corners at the events: the trapezoidal rule is exact, the
    # events are good to the regularisation, 1e-12
    assert np.trapezoid(load, approach) == pytest.approx(energy, rel=1e-11)
    assert np.trapezoid(approach, load) == pytest.approx(energy + last.forces @ g0, rel=1e-11)
    without = np.trapezoid(load[[0, -1]], approach[[0, -1]])  # and only there
    assert abs(without - energy) > 1e-3 * abs(energy)


def test_approach_is_the_inverse_of_load():
    H, g0, _ = rough()
    for load in (0.01, 0.3, 2.0):
        pressed = solve(H, g0, load=load)
        back = solve(H, g0, approach=pressed.approach)
        assert back.load == pytest.approx(load, rel=1e-11)  # condition of H some 1e3
        assert back.forces == pytest.approx(pressed.forces, abs=1e-12 * load)
        assert np.array_equal(back.closed, pressed.closed)


def test_rigid_level_moves_the_approach_alone():
    H, g0, _ = rough()
    c = np.linspace(0.5, 2, len(g0))
    for tau in (-10.0, 10.0):
        plain, raised = solve(H, g0, load=1.5, c=c), solve(H + tau * np.outer(c, c), g0, load=1.5, c=c)
        assert raised.forces == pytest.approx(plain.forces, abs=1e-12)  # rounding of tau P
        assert raised.approach - plain.approach == pytest.approx(1.5 * tau, rel=1e-12)
        assert np.array_equal(raised.closed, plain.closed)


def test_units_do_not_matter():
    H, g0, _ = rough()
    plain, scaled = solve(H, g0, load=1.5), solve(H * 1e-20, g0 * 1e-9, load=1.5e11)
    assert scaled.forces == pytest.approx(1e11 * plain.forces, rel=1e-11)
    one, other = path(H, g0, [1.5]).events, path(H * 1e-20, g0 * 1e-9, [1.5e11]).events
    assert [(e.corner, e.kind) for e in one] == [(e.corner, e.kind) for e in other]
    assert [1e11 * e.load for e in one] == pytest.approx([e.load for e in other], rel=1e-10)


def test_a_good_start_saves_pivots():
    H, g0, _ = rough()
    cold = solve(H, g0, load=1.5)
    warm = solve(H, g0, load=1.5, start=cold.closed)
    assert warm.iterations <= 3 < cold.iterations and np.array_equal(warm.closed, cold.closed)
    anywhere = solve(H, g0, load=1.5, start=~cold.closed)
    assert np.array_equal(anywhere.closed, cold.closed)


def test_duplicates_share_their_force():
    state = solve(np.full((3, 3), 2.0), np.zeros(3), load=3)
    assert state.forces.sum() == pytest.approx(3, rel=1e-15) and state.approach == pytest.approx(6, rel=1e-15)
    single = solve([[2, 1], [1, 2]], [0, 0.5], load=3)
    double = solve([[2, 2, 1], [2, 2, 1], [1, 1, 2]], [0, 0, 0.5], load=3)
    assert double.forces[:2].sum() == pytest.approx(single.forces[0], rel=1e-12)
    assert len(path([[2, 2, 1], [2, 2, 1], [1, 1, 2]], [0, 0, 0.5], [3]).events) == 3


def test_slightly_indefinite_compliance_is_regularised_more():
    H = np.ones((3, 3)) - 1e-11 * np.eye(3)  # a duplicate computed to 1e-11
    state = solve(H, [0, 0, 0.5], load=3)
    assert state.regularisation == 1e-10 and state.kkt < 1e-10
    assert state.approach == pytest.approx(3, rel=1e-10)
    assert list(state.closed) == [True, True, False]


def test_no_contact_is_a_state():
    H, g0, _ = rough()
    for state in (solve(H, g0, load=0), solve(H, g0, approach=g0.min() - 1)):
        assert state.load == 0 and not state.closed.any() and state.kkt == 0
    assert solve(H, g0, load=0).approach == g0.min()


def test_rigid_corner_cannot_take_an_approach():
    with pytest.raises(NotConverged, match="rigid corners"):
        solve(np.zeros((2, 2)), [0, 1], approach=0.5)


def test_exhausted_pivots_are_named(monkeypatch):
    monkeypatch.setattr(
        "microblock.corners.active_set._complementary",
        lambda K, q, closed: (np.zeros(len(q)), np.ones(len(q), bool)),
    )
    H, g0, _ = rough()
    with pytest.raises(NotConverged, match="60 corners still changing.*follow the path") as caught:
        solve(H + 10 * H.max(), g0, approach=g0.min() + 1)
    assert caught.value.iterations > 5000


def test_the_path_is_followed_where_pivots_make_no_progress():
    """A matrix of a third of the full rank can take thousands of pivots; the path takes an event a corner."""
    factors = np.random.default_rng(2).normal(size=(120, 40))
    H, g0 = factors @ factors.T, np.abs(np.random.default_rng(102).normal(size=120))
    state = solve(H, g0, load=1.0)
    assert state.followed and residual(H, g0, np.ones(120), state, 1.0) < KKT


def test_path_says_where_it_stopped(monkeypatch):
    """A tableau spoilt on the way is no P-matrix: named, with the load that was reached."""

    def spoilt(tableau, block):
        if len(block):
            raise np.linalg.LinAlgError("singular")

    whole = path(*dense(), [2.0])
    monkeypatch.setattr("microblock.corners.active_set._exchange", spoilt)
    with pytest.raises(NotConverged, match="path stopped at load") as caught:
        path(*dense(), [2.0])
    assert caught.value.reached == whole.events[0].load


def test_events_of_long_paths_are_where_states_change():
    """Of more events than the tableau takes before it is made anew, every thirtieth: the state beyond it has
    the corner closed or open, as it says, and the state before it has not.
    """
    random = np.random.default_rng(5)
    x = np.linspace(0, 1, 300)
    H = np.exp(-300 * np.abs(x[:, None] - x))
    g0 = random.uniform(0, 1, 300)
    events = path(H, g0, [1e3]).events
    assert len(events) > 250
    for event, later in list(zip(events, events[1:]))[9::30]:
        between = (event.load + later.load) / 2
        states = [solve(H, g0, load=load) for load in (event.load * (1 - 1e-9), between)]
        assert [state.closed[event.corner] for state in states] == [
            event.kind == "opens",
            event.kind == "closes",
        ]


def test_rigid_corners_without_gaps_take_the_load_from_a_compliant_one():
    """Each gap and force of the compliant corner vanishes: no length is left to which a residual could be
    relative.
    """
    flexibility = np.diag([0.0, 0.0, 0.5625])
    state = solve(flexibility, np.zeros(3), load=10.0)
    assert state.forces.sum() == pytest.approx(10.0, rel=1e-12)  # rounding of a sum
    assert abs(state.approach) <= 1e-14 and state.forces[2] <= 1e-14  # of 0.5625*10 and 10, rounding
    # two that share one spring: what rounding leaves in their gap is nothing beside spring and load
    flexibility = np.zeros((5, 5))
    flexibility[np.ix_((2, 4), (2, 4))] = 1.0
    state = solve(flexibility, np.zeros(5), load=1.0)
    assert state.forces[[0, 1, 3]].sum() == pytest.approx(1.0, rel=1e-12) and state.kkt <= 1e-11
