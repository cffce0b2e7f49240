"""Two bodies that deform: Hertz for small blocks, and kinks that come back a block away."""

import numpy as np
import pytest

from cases import two_bodies


def test_kinks_of_the_pressure_come_back_a_block_away():
    """The slope jumps where full contact ends; under a body that deforms also a block beside it."""
    states = two_bodies.solve(rtol=1e-5)
    edge = {words: state.zones["full"][0][1] for words, state in states.items()}
    assert edge == pytest.approx({"deforms": 0.5595, "rigid": 0.5107}, abs=1e-4)  # of the edition before

    def bend(words, x):
        p = states[words].pressure_at(edge[words] + x + np.array((-3e-3, 0.0, 3e-3)))
        return abs(p[0] - 2 * p[1] + p[2])

    smooth = {words: max(bend(words, -0.12), bend(words, 0.1)) for words in states}
    assert all(bend("deforms", x) > 10 * smooth["deforms"] for x in (0.0, 0.25, -0.25))
    assert all(bend("rigid", x) < 10 * smooth["rigid"] < bend("rigid", 0) for x in (0.25, -0.25))
