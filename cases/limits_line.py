"""Maps of the contact line: what is asked for an accuracy."""

from cases import accuracy
from cases.accuracy import Draw
from cases.limits_maps import Axis, Map, Outcome

ALPHA = Axis("alpha", r"$\alpha = \ell/a_\mathrm{Hz}$", 0.01, 2.0)


def materials(contact, beta, nu, alpha, rtol):
    """A state of the half-plane asked for an accuracy, judged by a reference of another kind."""
    scene = Draw(contact, contact, alpha, nu, beta).scene()
    state = scene.at(accuracy.LOAD, rtol=rtol)
    true, _ = accuracy.reference(scene)
    return Outcome(accuracy.error(state, true), rtol, state.iterations, state.error_estimate)


MAPS = (
    Map("line_beta_small", "Does the contact line hold what it promises as the coupling vanishes?", materials,
        (Axis("beta", r"$\beta$", 1.0, 1e-4, degenerate="high"), Axis("nu", r"$1/2 - \nu$", 0.5, 1e-4, "gap", "high", 0.5),
         ALPHA, Axis("rtol", "rtol", 1e-2, 1e-6)), ("contact", ("microblock", "unilateral")), 0.5),
    Map("line_beta_large", "Does the contact line hold what it promises towards couple stresses?", materials,
        (Axis("beta", r"$2 - \beta$", 1.0, 1e-3, "gap", "high", 2.0), Axis("nu", r"$1/2 - \nu$", 0.5, 1e-4, "gap", "high", 0.5),
         ALPHA, Axis("rtol", "rtol", 1e-2, 1e-6)), ("contact", ("microblock", "unilateral")), 0.5),
)
