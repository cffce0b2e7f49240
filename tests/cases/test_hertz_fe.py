"""`hertz --model fe` and the size effect by finite elements, from the command line."""

import json

import numpy as np
import pytest

from cases.__main__ import main
from cases.scenes import hertz, size_effect, size_effect_fe


def answer(words, tmp_path):
    path = tmp_path / "answer.json"
    assert main(["hertz", "--model", "fe", *words.split(), "--json", str(path)]) == 0
    return json.loads(path.read_text())


def test_command(tmp_path):
    found = answer("--loads 1 0.05 --rtol 1e-3", tmp_path)
    full, two = found["states"]
    reference = hertz.result(hertz.Parameters(rtol=1e-5))
    assert found["model"] == "fe" and found["parameters"]["method"] == "condensed"
    assert full["approach"] is None
    for name in ("pressure_centre", "pressure_max", "half_width", "micromoment_max", "hardness_apparent"):
        assert full[name] == pytest.approx(reference["states"][0][name], rel=2e-3)  # rtol in L2
    profile = {name: np.array(values) for name, values in full["profile"].items()}
    assert profile["weight"] @ profile["pressure"] == pytest.approx(np.pi / 2, rel=1e-9)
    assert np.all(np.diff(profile["x"]) > 0)
    assert len(two["zones"]["contact"]) == 2 and two["inner_half_width"] > 0
    kinds = {(event["kind"], event["zone"]): event for event in found["events"]}
    merged, true = kinds["merged", "contact"], reference["events"][-1]
    assert abs(merged["load"] - true["load"]) <= merged["load_error"] < 0.1 * merged["load"]


def test_command_on_a_uniform_mesh(tmp_path):
    paper, condensed = (
        answer(f"--method {method} --mesh uniform --h 0.2 --order 1 --domain 18", tmp_path)
        for method in ("al", "condensed")
    )
    first, second = (one["states"][0] for one in (paper, condensed))
    assert first["profile"]["pressure"] == pytest.approx(second["profile"]["pressure"], abs=1e-9)
    assert first["error_estimate"] is None
    assert first["approach"] == pytest.approx(second["approach"], rel=1e-9)
    assert paper["unknowns"] > condensed["unknowns"]


def test_a_block_that_the_squares_do_not_fit_into_is_refused_by_name(capsys):
    words = "hertz --model fe --mesh uniform --h 0.1 --domain 1.5"
    assert main(words.split()) == 2
    printed = capsys.readouterr()
    assert printed.err.count("\n") == 1 and "--domain" in printed.err


@pytest.mark.slow
def test_coalescence():
    """Inner edges prescribed, load free: alpha_mid of the half-plane, whose way to it is another one."""
    alpha_mid, error = size_effect_fe.coalescence_ratio(0.3, 1.0)
    assert error < 2e-5 and abs(alpha_mid - 0.8343132323) < error  # value: tests of the half-plane


def test_bilinear_elements_see_coalescence_too_late():
    """The paper's 0.8874 lies on the way to the limit: h^(2 s) with s = 0.32 is slow."""
    first, second = (size_effect_fe.ratio_of_h(0.3, 1.0, (h,))[0] for h in (0.2, 0.1))
    assert first[1] > second[1] > 0.95 and first[0] > second[0]


def test_size_effect_by_finite_elements():
    given = size_effect.Parameters(alphas=(0.5,), model="fe", rtol=1e-2)
    found = [
        size_effect_fe.nominal_hardness(given.hertz(alpha, law).resolved())
        for alpha, law in ((0.02, "unilateral"), (0.5, "unilateral"), (0.5, "microblock"))
    ]
    classical, unilateral, microblock = (value for value, _ in found)
    # Fig. 11b: both rise with alpha, the microblock law's more
    assert classical < unilateral < microblock
    assert all(0 < error < 1e-3 * value for value, error in found)
