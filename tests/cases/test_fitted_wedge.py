"""Fitted elements under a wedge, beside the second code of the contact line."""

import numpy as np
import pytest

import microblock as mb
from cases.benchmarks.verification import lines

LAWS = {"microblock": mb.Microblock, "unilateral": mb.Unilateral}


@pytest.mark.parametrize("law, alpha", [("unilateral", 0.34), ("microblock", 0.24)])
def test_kinks_are_graded_as_deep_as_the_error_asks(law, alpha):
    """On refinement levels of equal depth the logarithm between two nodes is the same: 3.8 rtol without a
    warning; on the axis it was not graded.
    """
    E = np.pi / 2 / (0.02 * 6.0 * alpha) * (1 - 0.1**2)  # half-width of 6 ell
    solid = mb.Cosserat(E=E, nu=0.1, ell=alpha, beta=0.6)
    contact = mb.Contact(mb.Block(solid), mb.Wedge(0.02), LAWS[law]())
    state = contact.solve(load=np.pi / 2, rtol=1e-3)
    assert lines.by_panels(contact.with_(body=mb.HalfPlane(solid)), np.pi / 2)(state)[0] < 1e-3
