"""Events of a load path: what was read before does not change them, and their errors hold."""

from threadpoolctl import threadpool_limits

import microblock as mb

HERTZ = 0.34038918691829767  # half-width of the classical contact at load 1


def leaning(psi0, last=10.0):
    """The path of a cylinder on blocks that lean to one side: full contact is born beside a zone that was
    just born.
    """
    solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1 * HERTZ)
    return mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Microblock(psi0=psi0)).path(load=last)


def test_events_are_the_same_whatever_was_read_before():
    """The first states were computed with the threads that were there outside, which rounds otherwise."""
    with threadpool_limits(2):
        alone, later = leaning(0.005, 0.1), leaning(0.005, 0.1)
        assert later.first == later.to_dict()["first"] > 0
        assert alone.events == later.events
