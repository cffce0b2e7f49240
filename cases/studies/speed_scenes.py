"""Problems of the study `speed`: each with its reference by another method, that reference's own error, and
the error measure.

A contact on a line is verified by max(|dp|, |dM|/ell)/|p| in L2, all methods on the same points: Gauss points
on cells that shrink geometrically towards every edge and kink of the reference, and are nowhere longer than
CELL. The strip is verified by the larger one of the relative L2 errors of psi and u over the thickness. At
alpha = DEEP psi below x1 = WHERE is verified too: relative L2 over the depths of Figs 12 and 13 (evenly in
log(1 + depth/ell)) against the half-plane's modes from a state at rtol PSI_RTOLS[-1].
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

import microblock as mb

from ..scenes import layers, strip
from . import judged_line
from . import reference_line as judge

LOAD, NU = math.pi / 2, 0.3  # with E* = 2 and R = 1 lengths are over a_Hz and pressures over p_Hz
CLASSICAL = 1e-10  # coupling beta of the classical limit
CELL = 0.005  # of the rule, over a_Hz: a quarter of the finest finite element
# halvings of the cells towards an edge (a root there is lost below 1e-12); points on each
GRADES, POINTS = 40, 4
BEYOND = 1.5  # of the outermost edge: as far as pressures are looked at
OBSTACLE = mb.Cylinder(1.0)
DEEP, WHERE = 0.01, 0.5  # alpha of the layers; the vertical line, over a_Hz
# of the states that give psi: the distance of both is the reference's own error
PSI_RTOLS = (1e-7, 1e-9)
PSI_ACCURACY = 14  # of the modes' integrals of the finer one; runs have the usual one


@dataclass(frozen=True)
class LineScene:
    """A cylinder on a half-plane: `contact` names the law, alpha is ell over a_Hz; beta = CLASSICAL is
    verified by the ellipse.
    """

    name: str
    contact: str
    alpha: float
    beta: float = 1.0
    measures = ("error_p", "error_m")

    @property
    def deep(self):
        """Whether psi below the surface is verified."""
        return self.alpha == DEEP

    @property
    def kind(self):
        return "line" if self.beta > CLASSICAL else "classical"

    @property
    def parameters(self):
        return {"contact": self.contact, "alpha": self.alpha, "nu": NU, "beta": self.beta}

    @property
    def solid(self):
        return mb.Cosserat(E=2 * (1 - NU**2), nu=NU, ell=self.alpha, beta=self.beta)

    @property
    def law(self):
        return mb.Microblock() if self.contact == "microblock" else mb.Unilateral()

    @property
    def half_plane(self):
        return mb.Contact(mb.HalfPlane(self.solid), OBSTACLE, self.law)

    @cached_property
    def _reference(self):
        """(x -> (p, M/ell), edges and kinks, own error)."""
        if self.kind == "line":
            fine, own = judged_line.reference(self.half_plane)
            return judge.fields(fine), judge.breaks([fine]), own
        from microblock.model import closed_forms  # verifies only: the computation does without

        # what is left of the coupling is of the order beta log(beta)
        return (
            (lambda x: (closed_forms.hertz(x, LOAD, 1.0), 0 * x)),
            [-1.0, 1.0],
            -CLASSICAL * math.log(CLASSICAL),
        )

    @property
    def floor(self):
        """Error of the reference itself."""
        return self._reference[2]

    @property
    def outer(self):
        """Outermost edge of the reference."""
        return max(self._reference[1])

    @cached_property
    def _known(self):
        """Points and weights of the rule, p and M/ell of the reference there."""
        fields, places, _ = self._reference
        x, weights = rule([-BEYOND * self.outer, *places, BEYOND * self.outer])
        return x, weights, *fields(x)

    def errors(self, fields):
        """Errors of x -> (p, M/ell): {measure: value}."""
        x, weights, *known = self._known
        size = weights @ known[0] ** 2
        return {
            name: float(np.sqrt(weights @ (found - exact) ** 2 / size))
            for name, found, exact in zip(self.measures, fields(x), known)
        }

    @cached_property
    def _known_psi(self):
        """Depths x2 and psi there, and its own error."""
        x2 = layers.depths(self.alpha)
        states = [self.half_plane.solve(load=LOAD, rtol=rtol) for rtol in PSI_RTOLS]
        coarse, fine = states[0].fields(WHERE, x2).psi, states[1].fields(WHERE, x2, PSI_ACCURACY).psi
        return x2, fine, _relative(coarse, fine)

    @property
    def floor_psi(self):
        """Error of the reference of psi below the surface; None where that is not verified."""
        return self._known_psi[2] if self.deep else None

    def remarks(self, answer):
        """What is recorded beside the errors: error_psi where psi is verified and the answer has it."""
        if not self.deep or not answer.psi:
            return {}
        x2, psi, _ = self._known_psi
        return {"error_psi": _relative(answer.psi(WHERE, x2), psi)}


@dataclass(frozen=True)
class StripScene:
    """The strip of the paper, verified by its closed form."""

    name: str = "strip"
    kind = "strip"
    measures = ("error_psi", "error_u")
    floor_psi = None
    floor = 4 * float(np.finfo(float).eps)  # rounding of the closed form

    @property
    def parameters(self):
        given = strip.Parameters()
        return {"contact": "microblock", "alpha": given.ell_over_H, "nu": given.nu, "beta": given.beta}

    def errors(self, solution):
        found = strip.errors(solution)
        return {name: found[name] for name in self.measures}

    def remarks(self, answer):
        return {}


def _relative(found, exact):
    return float(np.linalg.norm(found - exact) / np.linalg.norm(exact))


def rule(places):
    """Points and weights between the ends of `places`, graded to each of them."""
    borders = [np.arange(places[0], places[-1], CELL), places]
    shares = 0.5 ** np.arange(1, GRADES)
    for left, right in zip(places, places[1:]):
        borders += [left + (right - left) * shares, right - (right - left) * shares]
    borders = np.unique(np.concatenate(borders))
    points, weights = np.polynomial.legendre.leggauss(POINTS)
    half = np.diff(borders)[:, None] / 2
    return ((borders[:-1, None] + half) + half * points).ravel(), (half * weights).ravel()


ALPHAS = (DEEP, 0.05, 0.25, 1.0)
SCENES = {
    scene.name: scene
    for scene in (
        StripScene(),
        LineScene("classical", "unilateral", 1.0, CLASSICAL),
        *(
            LineScene(f"{law}-{alpha:g}", law, alpha)
            for law in ("microblock", "unilateral")
            for alpha in ALPHAS
        ),
    )
}
QUICK = ("strip", "classical", "microblock-0.25")
