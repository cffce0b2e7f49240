"""The strip against its closed form: the whole range of the command, accuracy asked for, rates."""

import math
from dataclasses import replace

import numpy as np
import pytest

from cases.paper import figures_strip
from cases.scenes import strip
from cases.scenes.strip import Parameters

LIMITS = {"ell_over_H": (0.05, 5.0), "psi0_deg": (-3.0, 3.0, 0.0), "nu": (0.0, 0.49), "beta": (1e-3, 1.99)}
SHARES = (0.5, 0.999999, 1.0, 1.000001, 2.0)  # of delta_fc


def sample(count, seed):
    """Seeded and stratified: each parameter once in each of `count` equal slices; every fifth sample near a
    limit.
    """
    rng = np.random.default_rng(seed)
    slices = (np.array([rng.permutation(count) for _ in range(5)]) + rng.random((5, count))) / count
    for number, (a, b, c, d, e) in enumerate(slices.T):
        drawn = dict(
            ell_over_H=float(0.05 * 100**a),
            psi0_deg=6 * b - 3,
            nu=0.49 * c,
            beta=0.01 + 1.98 * d,
            delta_over_H=0.1 * e,
        )
        if number % 5 == 0:
            name = list(LIMITS)[rng.integers(4)]
            drawn[name] = LIMITS[name][rng.integers(len(LIMITS[name]))]
            exact = strip.reference(Parameters(**drawn))
            drawn["delta_over_H"] = (0.0, *(share * exact.delta_fc for share in SHARES))[rng.integers(6)]
        yield Parameters(**drawn)


def check(parameters, rel):
    """Every number of the result against the closed form; `rel` of the largest size on the way."""
    found, exact = strip.result(parameters), strip.reference(parameters)
    assert found["state"] == exact.state
    # surface values carry the accuracy of the fields, fluxes and the event that of the energy or better
    for name, value in dict(
        psi_surface=exact.psi(1.0),
        u1_surface=exact.u1(1.0),
        u2_surface=exact.u2(1.0),
        traction=exact.traction,
        micromoment=exact.micromoment,
        delta_fc=exact.delta_fc,
    ).items():
        assert found[name] == pytest.approx(float(value), rel=rel, abs=1e-16), name
    if exact.state == "separation" or parameters.psi0_deg == 0:
        assert found["L_psi"] is None and found["L_u"] is None
    else:
        assert found["L_psi"] == pytest.approx(exact.L_psi, rel=rel)
        assert found["L_u"] == pytest.approx(exact.L_u, rel=rel)
    assert max(found["error_psi"], found["error_u"]) <= 1e-9
    return found


@pytest.mark.parametrize(
    "parameters", list(sample(60, seed=3)), ids=lambda parameters: f"{parameters.delta_over_H:.3g}"
)
def test_default_accuracy_over_the_whole_range(parameters):
    check(parameters, rel=1e-8)  # ten times what the default asks of the fields


@pytest.mark.parametrize(
    "share, state",
    [(-0.1, "separation"), (0.0, "separation"), (1 - 1e-9, "partial"), (1.0, "full"), (1 + 1e-9, "full")],
)
@pytest.mark.parametrize("psi0_deg", [1.0, -2.0])
@pytest.mark.parametrize("model", strip.MODELS)
def test_state_on_either_side_of_delta_fc_and_at_it(model, psi0_deg, share, state):
    base = Parameters(model=model, psi0_deg=psi0_deg)
    delta_fc = strip.reference(base).delta_fc
    assert strip.result(replace(base, delta_over_H=share * delta_fc))["state"] == state


# the penalty's rounding, eps rho over the stiffness, keeps it from nine digits just where a corner is about
# to close
@pytest.mark.parametrize(
    "method, rtol",
    [
        ("al", 1e-2),
        ("al", 1e-4),
        ("al", 1e-6),
        ("al", 1e-9),
        ("penalty", 1e-2),
        ("penalty", 1e-4),
        ("penalty", 1e-6),
    ],
)
def test_error_obtained_is_below_the_error_asked_for(method, rtol):
    for parameters in sample(10, seed=4):
        if method == "penalty" and parameters.beta < 0.1:
            # with hardly any coupling the pressure of partial contact drowns in the penalty's rounding
            continue
        found = strip.result(replace(parameters, rtol=rtol, method=method))
        assert max(found["error_psi"], found["error_u"]) <= rtol
        assert found["error_estimate"] <= rtol


# a micromoment that is small beside the forces that balance it, so that it shows the rounding first
LEAST_COUPLED = Parameters(ell_over_H=3.976, psi0_deg=0.93, nu=0.362, beta=0.914, delta_over_H=0.0872)


@pytest.mark.parametrize("order, elements", [(1, 20), (2, 5), (5, 3), (12, 2), (8, 20)])
def test_line_and_column_agree(order, elements):
    for parameters in [*sample(5, seed=5), LEAST_COUPLED]:
        line, column = (
            strip.result(replace(parameters, model=model, order=order, elements=elements))
            for model in strip.MODELS
        )
        assert line["state"] == column["state"]
        for name in ("psi_surface", "u1_surface", "u2_surface", "traction", "micromoment", "delta_fc"):
            # rounding: 1e-10 of the micromoment on one processor, 1.7e-10 on another
            assert line[name] == pytest.approx(column[name], rel=1e-9, abs=1e-16)


def test_triangles_agree_with_the_closed_form():
    """A column cut into triangles is not symmetric sideways; it still converges to the strip."""
    from microblock import Body, Microblock, Plane
    from microblock.fem import meshes
    from microblock.fem.facets import ContactFacets
    from microblock.fem.newton import MonolithicNewton

    parameters = Parameters()
    body = Body(
        meshes.column(1.0, 3, quads=False),
        parameters.solid,
        8,
        fixed={"u1": "middle", "u2": "middle"},
        periodic=True,
    )
    facets = ContactFacets(
        body, Microblock(parameters.psi0), Plane(parameters.ell_over_H / 2 * parameters.psi0)
    )
    state = MonolithicNewton(body, facets).solve(0.02)
    assert state.psi == pytest.approx(strip.reference(parameters).psi(1.0), rel=1e-9)


def test_bilinear_elements_converge_with_second_order():
    elements = np.array([20, 40, 80, 160])
    for name in ("error_psi", "error_u"):
        error = [strip.result(Parameters(model="column", order=1, elements=int(n)))[name] for n in elements]
        assert -np.polyfit(np.log(elements), np.log(error), 1)[0] == pytest.approx(2, abs=0.02)


@pytest.mark.parametrize("order", [1, 2, 3, 4, 5])
def test_orders_converge_with_p_plus_1(order):
    elements = np.array([4, 8, 16])
    error = [strip.result(Parameters(order=order, elements=int(n)))["error_psi"] for n in elements]
    assert -np.polyfit(np.log(elements), np.log(error), 1)[0] == pytest.approx(order + 1, abs=0.2)


@pytest.mark.parametrize("ell_over_H, order, elements", [(0.5, 12, 1), (0.1, 15, 2)])
def test_ten_digits_with_a_hundred_unknowns(ell_over_H, order, elements):
    found = strip.result(Parameters(ell_over_H=ell_over_H, order=order, elements=elements))
    assert found["unknowns"] <= 100 and max(found["error_psi"], found["error_u"]) < 1e-10


@pytest.mark.parametrize("thickness", np.geomspace(0.1, 20, 9))
@pytest.mark.parametrize("beta", [0.1, 1.0, 1.9])
def test_layer_lengths_49(thickness, beta):
    ell = math.sqrt(beta) / thickness
    found = strip.result(Parameters(ell_over_H=ell, beta=beta, rtol=1e-9))
    assert math.sqrt(beta) * found["L_psi"] / ell == pytest.approx(1 / math.tanh(thickness), rel=1e-9)
    assert math.sqrt(beta) * found["L_u"] / ell == pytest.approx(math.tanh(thickness), rel=1e-9)


def test_one_order_more_for_u_does_not_lock():
    """Towards the couple-stress limit bilinear elements lock; u of order 2 with psi of order 1 does not."""
    from microblock import Body, Microblock, Plane
    from microblock.fem import meshes
    from microblock.fem.facets import ContactFacets
    from microblock.fem.newton import MonolithicNewton

    def error(order, elements, beta):
        parameters = Parameters(beta=beta)
        body = Body(
            meshes.line(1.0, elements),
            parameters.solid,
            order,
            order_psi=1,
            fixed={"u1": "middle", "u2": "middle"},
        )
        plane = Plane(parameters.ell_over_H / 2 * parameters.psi0)
        state = MonolithicNewton(body, ContactFacets(body, Microblock(parameters.psi0), plane)).solve(0.02)
        exact = float(strip.reference(parameters).psi(1.0))
        return abs(state.psi[0] - exact) / abs(exact)

    locked, free = error(1, 8, 1.999), error(2, 6, 1.999)
    assert locked > 0.1 and free < 0.01  # negative control: equal orders lose the solution
    assert free < 2 * error(2, 6, 1.0)


def test_layer_lengths_do_not_depend_on_the_branch():
    partial, full = (strip.result(Parameters(delta_over_H=delta)) for delta in (0.01, 0.05))
    assert (partial["state"], full["state"]) == ("partial", "full")
    for name in ("L_psi", "L_u"):
        assert partial[name] == pytest.approx(full[name], rel=1e-10)


def test_printed_curvature_misses_the_closed_form_by_sqrt_2():
    printed = strip.result(Parameters(ell_over_H=0.05, curvature=1.0))
    needed = strip.result(Parameters(ell_over_H=0.05))
    assert needed["L_psi"] / printed["L_psi"] == pytest.approx(math.sqrt(2), rel=1e-9)
    assert printed["error_psi"] < 1e-9 and needed["error_psi_paper"] < 1e-9
    assert printed["error_psi_paper"] > 0.1


def test_rho_does_not_matter_over_eight_decades():
    found = [
        strip.result(Parameters(rho=10.0**power, order=10, elements=1, delta_over_H=0.04))
        for power in range(-4, 5)
    ]
    for name in ("psi_surface", "u1_surface", "u2_surface", "traction", "micromoment"):
        values = np.array([result[name] for result in found])
        assert values == pytest.approx(np.full(9, values[4]), rel=1e-9)


def test_penalty_error_falls_like_one_over_rho():
    rho = 10.0 ** np.arange(3, 8)
    error = [
        strip.result(Parameters(method="penalty", rho=float(value), order=12, elements=1))["error_psi"]
        for value in rho
    ]
    assert np.polyfit(np.log(rho), np.log(error), 1)[0] == pytest.approx(-1, abs=0.01)


@pytest.mark.parametrize("method, model", [("al", "line"), ("al", "column"), ("penalty", "line")])
def test_aligned_blocks_are_in_full_contact_at_once(method, model):
    for parameters in sample(8, seed=6):
        found = strip.result(replace(parameters, psi0_deg=0.0, delta_over_H=0.03, method=method, model=model))
        assert (found["state"], found["delta_fc"]) == ("full", 0.0)
        assert (found["L_psi"], found["error_psi"]) == (None, 0.0)
        assert found["error_u"] <= found["parameters"]["rtol"]


def test_rounding_of_the_gaps_is_part_of_the_estimate():
    """Corner gaps are differences of lengths as large as delta: tiny psi0 cannot be had to nine digits."""
    for psi0_deg in (1e-6, -1e-8):
        found = strip.result(Parameters(ell_over_H=0.05, psi0_deg=psi0_deg, delta_over_H=0.1))
        assert found["error_psi"] <= found["error_estimate"]
        assert "1e-09 was not reached" in found["warnings"][0]


def test_penalty_stiffness_given_is_kept_and_its_error_told():
    found = strip.result(Parameters(method="penalty", rho=1e4))
    assert found["parameters"]["rho"] == 1e4
    assert 1e-5 < max(found["error_psi"], found["error_u"]) <= found["error_estimate"]


def test_accuracy_out_of_reach_is_reported():
    from microblock import NotConverged

    with pytest.raises(NotConverged, match="rtol = 1e-17") as caught:
        strip.result(Parameters(rtol=1e-17))
    assert 0 < caught.value.rtol_reached < 1e-11
    with pytest.raises(NotConverged, match="rho = 1000"):
        strip.result(Parameters(method="penalty", rho=1e3, rtol=1e-6))


@pytest.mark.parametrize("method, rho", [("al", 1e10), ("al", 1e12), ("al", 1e16), ("penalty", 1e16)])
@pytest.mark.parametrize("asked", [dict(rtol=1e-3), dict(order=6, elements=2)])
def test_forces_drowned_by_rho_are_an_error_not_a_result(method, rho, asked):
    """Either the forces hold to what was asked (fixed mesh: to 1e-5, the worst residual accepted being 1e-6),
    or it is said.
    """
    from microblock import NotConverged

    parameters = Parameters(method=method, rho=rho, delta_over_H=0.04, **asked)
    try:
        found = strip.result(parameters)
    except NotConverged:
        return
    assert found["state"] == "full"
    assert found["traction"] == pytest.approx(
        strip.reference(parameters).traction, rel=asked.get("rtol", 1e-5)
    )


def test_model_out_of_its_ground_is_said():
    assert strip.result(Parameters())["warnings"] == []
    found = strip.result(Parameters(psi0_deg=20, ell_over_H=2, delta_over_H=0.2))["warnings"]
    assert len(found) == 3


def test_blocks_of_the_figure_hang_below_the_plane():
    drawing = figures_strip.fig3_draw(figures_strip.fields_records())
    for axis, ratio in zip(drawing.axes, figures_strip.RATIOS):
        blocks = [line.get_ydata() for line in axis.lines if len(line.get_ydata()) == 5]
        assert len(blocks) == 4 and max(map(max, blocks)) == pytest.approx(1 / ratio, abs=1e-12)
