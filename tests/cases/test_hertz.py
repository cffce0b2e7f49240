"""The commands of section 4.2 on the contact line: contract, normalisation, events."""

import json

import numpy as np
import pytest

from cases.__main__ import main
from cases.scenes import hertz, size_effect
from cases.scenes.hertz import Parameters

STATE = {
    "load",
    "pressure_centre",
    "pressure_max",
    "pressure_max_at",
    "zones",
    "half_width",
    "inner_half_width",
    "hardness_apparent",
    "hardness_real",
    "energy",
    "micromoment_max",
    "approach",
    "iterations",
    "kkt",
    "error_estimate",
    "profile",
}


@pytest.fixture(scope="module")
def loaded():
    return hertz.result(Parameters(loads=(0.05, 0.5, 1.0)))


def test_contract(loaded):
    assert loaded["model"] == "halfplane" and loaded["parameters"]["alpha"] == 0.25
    json.dumps(loaded, allow_nan=False)
    for state in loaded["states"]:
        assert set(state) >= STATE and state["approach"] is None and state["error_estimate"] <= 1e-3
        profile = {name: np.array(values) for name, values in state["profile"].items()}
        assert np.all(np.diff(profile["x"]) > 0)
        assert profile["weight"] @ profile["pressure"] == pytest.approx(state["load"] * np.pi / 2, rel=1e-9)
        assert profile["pressure"] == pytest.approx(profile["pressure_A"] + profile["pressure_B"], abs=1e-14)
        assert profile["micromoment"] == pytest.approx(
            (profile["pressure_A"] - profile["pressure_B"]) / 2, abs=1e-12
        )
        assert state["half_width"] == pytest.approx(state["zones"]["contact"][-1][1], abs=1e-9)
        assert state["hardness_apparent"] == pytest.approx(state["load"] / state["half_width"])


def test_two_zones_at_first_full_contact_later(loaded):
    small, middle, full = loaded["states"]
    assert len(small["zones"]["contact"]) == 2 and small["zones"]["full"] == []
    assert small["pressure_centre"] == 0
    assert small["inner_half_width"] > 0 and small["hardness_real"] > small["hardness_apparent"]
    assert len(full["zones"]["contact"]) == 1 and len(full["zones"]["full"]) == 1
    assert full["pressure_max_at"] == pytest.approx([0], abs=1e-3)


def test_events(loaded):
    kinds = [(event["kind"], event["zone"]) for event in loaded["events"]]
    assert kinds[:4] == [("born", "A"), ("born", "B"), ("born", "contact"), ("born", "contact")]
    assert set(kinds[4:]) == {("born", "full"), ("merged", "contact")}
    # by scaling the zones meet at (alpha/alpha_mid)^2
    alpha_mid, error = size_effect.coalescence_ratio(0.3, 1.0)
    meeting = loaded["events"][-1]
    assert meeting["load"] == pytest.approx((0.25 / alpha_mid) ** 2, abs=meeting["load_error"] + 1e-8)
    assert meeting["x"] == 0 and error < 1e-8


def state_of(**changes):
    """The record of one state, without the events."""
    parameters = Parameters(**changes).resolved()
    return hertz.observe(parameters, *hertz.solve(parameters)[0])


def test_units_do_not_matter():
    first = state_of(psi0_deg=0.2, order=8)
    # psi0 is an angle like a/R, so P/(E R) is kept
    scaled = state_of(E=7.0, R=0.3, P=7.0 * 0.3 / 1000, psi0_deg=0.2, order=8)
    for name in ("half_width", "pressure_max", "micromoment_max", "hardness_apparent", "energy"):
        assert scaled[name] == pytest.approx(first[name], rel=1e-8)
    other = state_of(E=7.0, R=0.3, P=0.02, psi0_deg=0.2, order=8)
    assert other["half_width"] != pytest.approx(first["half_width"], rel=1e-3)


def test_reading_of_psi0():
    gap, lever = (state_of(psi0_deg=5, psi0_reading=reading) for reading in ("gap", "lever"))
    assert gap["zones"]["A"] == [] and gap["zones"]["full"] == []  # the strip's geometry: A never touches
    assert len(lever["zones"]["A"]) == 1 and len(lever["zones"]["full"]) == 1


@pytest.mark.parametrize("contact", ["unilateral", "microclamped"])
def test_laws_without_corners(contact):
    state = state_of(contact=contact)
    assert state["zones"]["A"] == state["zones"]["B"] == state["zones"]["full"] == []
    assert state["profile"]["pressure_A"] is None
    assert (state["micromoment_max"] == 0) == (contact == "unilateral")


def test_infinite_values_are_null():
    punch = state_of(obstacle="punch")
    assert punch["pressure_max"] is None and punch["pressure_max_at"] == []


@pytest.mark.slow
def test_events_of_rotated_blocks():
    """Born aside, then merged: bracketed to what is claimed, and seen by two states on either side."""
    parameters = Parameters(psi0_deg=0.5).resolved()
    found = {(event["kind"], event["zone"]): event for event in hertz.events(parameters, 1.0)}
    born, merged = found["born", "A"], found["merged", "contact"]
    assert 0 < born["load"] < merged["load"] < 1 and max(born["load_error"], merged["load_error"]) < 0.05
    for event, zone, before, after in ((born, "A", 0, 1), (merged, "contact", 2, 1)):
        for side, count in ((-1, before), (1, after)):
            load = event["load"] + side * (event["load_error"] + 0.01 * event["load"])
            assert len(state_of(psi0_deg=0.5, loads=(load,))["zones"][zone]) == count


def test_figures_of_single_runs(tmp_path):
    assert main(["hertz", "--order", "8", "--out", str(tmp_path)]) == 0
    assert main(["size_effect", "--alphas", "0.5", "1", "--rtol", "1e-3", "--out", str(tmp_path)]) == 0
    written = {path.name for path in tmp_path.iterdir()}
    assert written == {
        f"{case}.{kind}" for case in ("hertz", "size_effect") for kind in ("csv", "png", "pdf")
    }


def test_curves_are_no_polygons():
    """Straight lines from point to point of the figure are the pressure; its nodes alone miss it by 0.7 %."""
    parameters = Parameters()
    resolved = parameters.resolved()
    ((state, _),) = hertz.solve(resolved)
    points = hertz.curves(parameters, hertz.result(parameters))
    x = np.linspace(state.x[0], state.x[-1], 5001)
    drawn = np.interp(x / resolved.a_Hz, [row["x"] for row in points], [row["pressure"] for row in points])
    assert np.abs(drawn - state.pressure_at(x) / resolved.p_Hz).max() < 2e-3  # 0.1 mm where 1 is 5 cm


def test_size_effect():
    answer = size_effect.result(size_effect.Parameters(alphas=(0.02, 0.5, 1.25), rtol=1e-4))
    json.dumps(answer, allow_nan=False)
    microblock, unilateral = (answer["laws"][name] for name in ("microblock", "unilateral"))
    assert np.all(np.diff([row["half_width"] for row in microblock]) > 0)
    assert np.all(np.diff([row["half_width"] for row in unilateral]) < 0)
    assert np.all(np.diff([row["pressure_max"] for row in unilateral]) > 0)
    assert microblock[0]["hardness_apparent"] == pytest.approx(1, abs=0.01)
    assert microblock[2]["hardness_real"] > microblock[2]["hardness_apparent"]
    assert answer["alpha_mid"] == pytest.approx(0.8343132323, abs=3 * answer["alpha_mid_error"] + 1e-9)
    assert all(row["hardness_nominal"] is None for row in microblock) and "approach" in answer["warnings"][0]
