"""What the maps of the finite elements found, kept: locking, layers thinner than an element, oscillating
pressures.
"""

import pytest

import microblock as mb
from cases.scenes import hertz, strip
from cases.studies import limits_meshes
from microblock.fem import meshes


def fluxes(order, beta, ell_over_h):
    return limits_meshes.thin_layer_fluxes(
        order=order, ell_over_h=ell_over_h, elements=16, beta=beta, nu=0.3
    ).error


@pytest.mark.parametrize("beta", [0.1, 1.0, 1.9, 1.99])
@pytest.mark.parametrize("order", [1, 2, 4, 6])
def test_the_longest_element_is_where_a_tenth_is_wrong(order, beta):
    longest = meshes.longest_element(mb.Cosserat(E=1, nu=0.3, ell=1.0, beta=beta), order)
    assert fluxes(order, beta, 1 / longest) < 0.3  # a tenth, within a factor of three
    assert fluxes(order, beta, 0.3 / longest) > 0.1  # and three times longer ones are worse than that


def test_order_one_locks_and_order_four_does_not():
    assert fluxes(1, 1.99, 1.0) > 1  # micromoment more than twice too large
    assert fluxes(4, 1.99, 1.0) < 1e-3  # negative control: 2e-5 with elements as long


@pytest.mark.parametrize("elements, order, told", [(2, 1, True), (40, 1, False), (2, 6, False)])
def test_strip_warns_of_layers_thinner_than_an_element(elements, order, told):
    answer = strip.result(strip.Parameters(ell_over_H=0.1, elements=elements, order=order))
    assert any("resolve the layer" in one for one in answer["warnings"]) == told
    assert (answer["error_psi"] > 0.1) == told


@pytest.mark.parametrize("alpha, told", [(0.05, True), (1.0, False)])
def test_hertz_warns_of_layers_thinner_than_an_element(alpha, told):
    answer = hertz.result(
        hertz.Parameters(alpha=alpha, model="fe", mesh="uniform", h=0.4, order=1, domain="18")
    )
    assert any("resolve the layer" in one for one in answer["warnings"]) == told


def test_order_two_is_tensile_between_the_nodes_and_order_one_is_not():
    one, two = (limits_meshes.oscillating("unilateral", order, 0.2, 0.15, 0.2) for order in (1, 2))
    assert one.wrong_sign == 0 and one.oscillation < 3e-3  # the second difference of a smooth error
    # what is drawn between the nodes, not only at the edge
    assert two.wrong_sign > 0.01 and two.error > 0.01


def test_gauss_oscillates_more_than_the_nodal_rule():
    nodal, gauss = (limits_meshes.ruled(rule, 1, 0.25, 0.25, 0.3) for rule in ("nodal", "gauss"))
    # multipliers of Gauss's rule are signed in the mean only
    assert nodal.wrong_sign == 0 and gauss.wrong_sign > 0
    assert gauss.oscillation > 3 * nodal.oscillation
