"""
Figure 11: hardness over the size of the contact
================================================
Hardness over the width of the contact falls with the size of microblocks and rises without corners; beyond
:math:`\\alpha_\\mathrm{mid}` the real hardness goes on falling.

:Geometry:  half-plane under a rigid cylinder; (b) square of 18 :math:`a_\\mathrm{Hz}`, as the approach
            needs a bounded body
:Equations: (10)-(18) in the solid, corner gaps (20)-(22), contact conditions (26)
:Method:    panels on the contact line (a), fitted finite elements (b)
:Reference: Hertz for small blocks
:Units:     hardness over that of the classical contact, :math:`\\alpha = \\ell/a_\\mathrm{Hz}`
"""

import matplotlib.pyplot as plt
import numpy as np

import microblock as mb
from cases import hertz, size_effect


def nominal(alpha, law, rtol=1e-3, size=18.0):
    """P/(2 a_nom) with a_nom = sqrt(d (2 R - d)), d the approach on a square of the given size over a_Hz."""
    problem = hertz.problem(alpha, contact=law)
    square = mb.Block(problem.solid, size * hertz.a_Hz)
    d = problem.with_(body=square).solve(load=hertz.P, rtol=rtol).approach
    return hertz.P / (2 * np.sqrt(d * (2 * hertz.R - d)))


def solve(
    alphas=(0.01, 0.05, 0.1, 0.2, 0.3, 0.5, 0.65, 0.75, 0.8, 0.83, 0.84, 0.86, 0.9, 1.0, 1.125, 1.25),
    nominal_alphas=(0.01, 0.05, 0.1, 0.25, 0.5, 0.75, 1.0, 1.25),
    rtol=1e-4,
):
    """Hardness of both laws: apparent and real over Hertz's, nominal over its value for small blocks.

    Parameters
    ----------
    alphas : of (a), sides of a block over a_Hz
    nominal_alphas : of (b)
    rtol : relative error of pressure and micromoment; that of (b) is ten times as large
    """
    # linear in alpha: the values at 0.01 and 0.02 say what is left at 0
    limit = 2 * nominal(0.01, "unilateral", 10 * rtol) - nominal(0.02, "unilateral", 10 * rtol)
    return {
        "sizes": size_effect.solve(alphas, rtol=rtol),
        "nominal_alphas": np.array(nominal_alphas),
        "nominal": {
            law: np.array([nominal(alpha, law, 10 * rtol) for alpha in nominal_alphas]) / limit
            for law in size_effect.LAWS
        },
    }


def figure(result):
    """(a) Apparent and real hardness, dotted: alpha_mid; (b) nominal hardness."""
    drawing, (top, bottom) = plt.subplots(2, 1, figsize=(3.54, 4.8), sharex=True, layout="constrained")
    sizes, inset = result["sizes"], top.inset_axes((0.52, 0.13, 0.46, 0.29))
    inverse = 1 / sizes["alphas"]
    for number, (law, kind) in enumerate(
        (("microblock", "apparent"), ("microblock", "real"), ("unilateral", "apparent"))
    ):
        for axis in (top, inset):
            axis.plot(inverse, sizes[law][kind], "os^"[number] + "-", markersize=3, label=f"{law}, {kind}")
    for axis in (top, inset):
        axis.axvline(1 / sizes["alpha_mid"], color="0.6", linestyle=":")
    inset.set(xlim=(0.78, 1.35), ylim=(0.72, 0.87))
    for law, look in (("microblock", "C0o-"), ("unilateral", "C2^-")):
        bottom.plot(1 / result["nominal_alphas"], result["nominal"][law], look, markersize=3)
    top.set(xscale="log", ylabel=r"$H/H_\mathrm{Hz}$", ylim=(0.6, 1.32))
    bottom.set(xlabel=r"$1/\alpha$", ylabel=r"$H_\mathrm{nom}/H_\mathrm{nom}^\infty$")
    drawing.legend(*top.get_legend_handles_labels(), loc="outside upper center")
    return drawing


if __name__ == "__main__":
    result = solve()
    print(f"nominal hardness at alpha = 1.25: {result['nominal']['microblock'][-1]:.4f}")
    figure(result)
    plt.show()
