"""The cells that verify hard obstacles, tested before they do; then a dozen problems, and paths under two."""

import json

import numpy as np
import pytest

import microblock as mb
from cases.__main__ import main
from cases.studies import accuracy_obstacles as outcomes
from cases.studies import obstacle_cells as judge
from cases.studies import obstacle_paths as paths
from cases.studies.obstacle_sample import KINDS, LAWS, STIFFNESS, Draw, sample
from microblock.model.zones import distance

LOAD = np.pi / 2  # with E* = 20 and R = 10: a_Hz = 1
WINDOW = judge.Window(-5, 5, 1.0)
SEED = 2020
# of several kinds and all laws, those that take the judge least
SHORT = 0, 2, 7, 11, 13, 14, 17, 24, 30, 31, 32, 42


def cylinder(x):
    return x**2 / 20


def problem(obstacle, law, alpha=0.25, beta=1.0):
    solid = mb.Cosserat(E=20 * (1 - 0.3**2), nu=0.3, ell=alpha, beta=beta)
    return mb.Contact(mb.HalfPlane(solid), obstacle, law)


class Moved:
    """A state that is wrong on purpose: another one, moved along the surface, with other forces."""

    def __init__(self, state, way=0.0, factor=1.0):
        self.load, self.weights, self.x = state.load, state.weights, state.x + way
        self.pressure, self.micromoment = factor * state.pressure, factor * state.micromoment
        self.pressures = {corner: factor * own for corner, own in state.pressures.items()}
        self.zones = {name: [(a + way, b + way) for a, b in zones] for name, zones in state.zones.items()}
        self.error_estimate = state.error_estimate
        self.pressure_at = lambda x, corner: factor * state.pressure_at(x - way, corner)


def test_cells_meet_hertz_within_their_own_error():
    cells, own = judge.judged(problem(cylinder, mb.Unilateral(), beta=1e-9), LOAD, WINDOW)
    p = np.sqrt(np.clip(1 - cells.x**2, 0, None))
    off = distance(cells.weights, cells.pressures[0] - p, 0 * p, p)
    assert off < own < 3e-4  # what is left of the coupling is of the order beta log(beta)
    assert own < 20 * off  # conservative, not useless
    assert np.ravel(cells.zones[0]) == pytest.approx([-1, 1], abs=1e-3)  # a first cell at an edge


@pytest.mark.parametrize("law", [mb.Microblock(), mb.Microblock(0.02), mb.Unilateral(), mb.Microclamped()])
def test_cells_meet_the_contact_line_where_that_is_known_to_be_right(law):
    here = problem(cylinder, law)
    cells, own = judge.judged(here, LOAD, WINDOW)
    state = here.solve(load=LOAD, rtol=1e-8)
    assert outcomes.error(state, cells) < own < 3e-4
    assert not outcomes.unlike(state, cells)


def test_two_far_cylinders_carry_half_each():
    cells, _ = judge.judged(
        problem(lambda x: np.minimum(cylinder(x - 15), cylinder(x + 15)), mb.Microblock()),
        LOAD,
        judge.Window(-20, 20, 1.0),
    )
    (a, b), (c, d) = cells.named_zones["contact"]
    assert cells.share((a, b)) == pytest.approx(0.5, abs=1e-6)  # cells are not quite mirrored
    assert (-d, -c) == pytest.approx((a, b), abs=2e-3)  # of edges to a first cell


def test_a_narrow_hill_far_from_the_contact_is_found():
    def height(x):
        return cylinder(x) - 0.222 * np.exp(-(((x - 2) / 0.3) ** 2))

    # of which the window says nothing
    cells, _ = judge.judged(problem(height, mb.Unilateral()), LOAD, WINDOW)
    assert len(cells.named_zones["contact"]) == 2


def test_wrong_answers_are_called_wrong():
    """One cylinder of two, a state a hundredth off, one that carries too much, another M: none passes; the
    right one does.
    """
    pair = problem(lambda x: np.minimum(cylinder(x - 3), cylinder(x + 3)), mb.Microblock())
    one = problem(lambda x: cylinder(x - 3), mb.Microblock())
    judges = []
    for here in (pair, one):
        verdict = outcomes.Judge.__new__(outcomes.Judge)
        verdict.problem, verdict.seconds, verdict.complaint, verdict.finer = here, 0.0, "", True
        verdict.cells, verdict.own = judge.judged(here, LOAD, judge.Window(-8, 8, 1.0))
        judges.append(verdict)
    state = one.solve(load=LOAD, rtol=1e-3)
    assert judges[1].verdict(state, 1e-3)["outcome"] == "ok"
    alone = judges[0].verdict(state, 1e-3)
    assert alone["outcome"] == "wrong" and alone["error"] > 0.5 and "contact missing at -3" in alone["unlike"]
    assert judges[1].verdict(Moved(state, way=0.01), 1e-3)["outcome"] == "wrong"
    assert judges[1].verdict(Moved(state, factor=1.01), 1e-3)["outcome"] == "wrong"
    turned = Moved(state)
    turned.micromoment = -turned.micromoment
    assert judges[1].verdict(turned, 1e-3)["outcome"] == "wrong"


def test_a_zone_that_carries_little_is_missed_by_name():
    """Under a hill that carries some thousandth of the load, a state without it is not told by the L2 norm
    at 1e-1 alone.
    """

    def height(x):
        return cylinder(x) - 0.05 * np.exp(-(((x - 1.6) / 0.2) ** 2))

    cells, _ = judge.judged(problem(height, mb.Unilateral()), LOAD, judge.Window(-5, 5, 0.2, ((1.6, 0.2),)))
    share = cells.share(cells.named_zones["contact"][-1])
    assert 2 * outcomes.CARRIES < share < 0.02
    state = problem(cylinder, mb.Unilateral()).solve(load=LOAD, rtol=1e-3)
    assert outcomes.error(state, cells) < 0.1 and "missing at 1.5" in outcomes.unlike(state, cells, 1e-3)


def test_every_problem_can_be_made_again():
    first, again = sample(40, SEED), sample(60, SEED)
    x = np.linspace(-3, 3, 101)
    for one, other in zip(first, again):
        assert one.material == other.material and one.load == other.load and one.psi0 == other.psi0
        heights = [
            getattr(draw.problem().obstacle, "height", draw.problem().obstacle)(x) for draw in (one, other)
        ]
        assert np.array_equal(*heights)
    assert {draw.kind for draw in first} == set(KINDS) and {
        draw.contact for draw in sample(150, SEED)
    } == set(LAWS)


def test_obstacles_are_hard_but_fair():
    """Slopes finite as far as a body could follow, and heights that grow towards either side of the window
    and beyond.
    """
    for draw in sample(len(KINDS) * 4, SEED):
        obstacle, window = draw.problem().obstacle, draw.window
        height = getattr(obstacle, "height", obstacle)
        x = np.linspace(window.left, window.right, 200_001)
        with np.errstate(over="ignore"):  # exp beyond the window
            beyond = [height(np.array([place])) for place in (window.left - 50, window.right + 50)]
        low = height(x) < height(x).min() + 10 * draw.load / STIFFNESS  # far above what is met in contact
        assert np.abs(np.diff(height(x)) / np.diff(x))[low[1:]].max() < 8, draw  # half of what is met
        assert min(map(np.min, beyond)) > height(x).min() and min(height(x[[0, -1]])) > height(x).min(), draw


@pytest.mark.parametrize("number", [135, 146])
def test_a_reference_of_another_kind_agrees_where_contacts_are_far_apart(number):
    """Panels on the cells' zones, their edges by Newton's method: (26) hold, and cells are as near as they
    say.
    """
    draw = Draw(SEED, number)
    known = outcomes.Judge(draw)
    assert len(known.cells.named_zones["contact"]) > 1
    line, own = outcomes.line_reference(known)  # None if they do not agree
    p = known.cells.pressures[0]
    assert (
        own < 1e-7
        and distance(known.cells.weights, line.pressure(0, known.cells.x) - p, 0 * p, p) < known.own < 3e-4
    )


@pytest.mark.parametrize("number", SHORT)
def test_obstacles_are_answered_right(number):
    (row,) = outcomes.runs(SEED, number, (1e-3,), every=0)
    assert row["outcome"] == "ok", outcomes.told(row)


def test_cells_that_do_not_end_leave_an_answer_unjudged(monkeypatch):
    """An active set that never settles is stopped; what was answered, and what first cells say of it,
    stays.
    """

    def forever(*_, **__):
        while True:
            sum(range(1000))

    known = outcomes.Judge(Draw(SEED, 0))
    state = known.problem.solve(load=known.draw.load, rtol=1e-3)
    monkeypatch.setattr(judge, "judged", forever)
    monkeypatch.setattr(outcomes, "JUDGE_LIMIT", 0.2)
    (row,) = outcomes.runs(SEED, 0, (1e-3,), every=0)
    assert row["outcome"] == "unjudged" and row["message"] == "judge: stopped after 0.2 s"
    assert row["error"] is None and row["estimate"] == state.error_estimate and row["method"] == "panels"
    known.own = 1.0  # so uncertain that finer cells are asked for, which do not end
    found = known.verdict(state, 1e-3)
    assert found["outcome"] == "ok" and known.finer and found["error"] < 1e-3


def test_events_are_counted_and_cells_say_how_many_there_must_be():
    """Two far cylinders are two zones, whatever hardly carries left aside; a path that tells of one of them
    is below that.
    """
    events = [
        mb.Event(0.0, 0.0, "born", "contact", 0.0),
        mb.Event(0.1, 0.0, "born", "contact", 1.0),
        mb.Event(0.2, 0.0, "merged", "contact", 0.5),
    ]
    assert [paths.count(events, "contact", load) for load in (0.05, 0.15, 0.25)] == [1, 2, 1]
    cells, _ = judge.judged(
        problem(lambda x: np.minimum(cylinder(x - 15), cylinder(x + 15)), mb.Microblock()),
        LOAD,
        judge.Window(-20, 20, 1.0),
        enough=1e-2,
    )
    assert {zone: paths.bounds(cells, zone) for zone in ("contact", "A", "B", "full")} == dict.fromkeys(
        ("contact", "A", "B", "full"), (2, 2)
    )


def test_loads_beside_events_have_no_other_event_between():
    events = [mb.Event(load, 1e-6, "born", "contact", 0.0) for load in (0.0, 0.5, 0.505, 0.8)]
    loads = np.array(paths.beside(events, 1.0, np.random.default_rng(1)))
    assert all(0 < load <= 1 for load in loads)
    for low, high in ((0.1, 0.5), (0.5, 0.505), (0.505, 0.8), (0.8, 1.0)):  # on either side of each
        assert np.any((loads > low) & (loads < high))


def test_command(tmp_path, capsys):
    words = [
        "accuracy",
        "--obstacles",
        "--scenes",
        "1",
        "--seed",
        "7",
        "--rtols",
        "1e-2",
        "--workers",
        "1",
        "--paths",
        "1",
        "--json",
        str(tmp_path / "a.json"),
        "--out",
        str(tmp_path / "o"),
    ]
    assert main(words) == 0
    answer = json.loads((tmp_path / "a.json").read_text())
    assert len(answer["scenes"]) == 1 and answer["scenes"][0]["outcome"] in outcomes.OUTCOMES
    assert {path.name for path in (tmp_path / "o").iterdir()} == {
        "accuracy_obstacles.csv",
        "accuracy_obstacle_paths.csv",
    }
    assert "judge_median" in capsys.readouterr().out
