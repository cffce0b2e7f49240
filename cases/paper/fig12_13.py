"""
Figures 12 and 13: layers below the contact
===========================================
The two contact laws differ in a layer of the thickness :math:`\\ell` below full contact; no exception
appears for small blocks.

:Geometry:  half-plane under a rigid cylinder, the same load with two laws: microblock and unilateral (M =
            0)
:Equations: (10)-(18) in the half-plane; the fit (51) of two exponentials
:Method:    panels on the contact line, and the modes of the half-plane below it
:Reference: :math:`L_\\mathrm{bl} = \\ell/\\sqrt\\beta` of the thick strip, (49)
:Units:     lengths over :math:`a_\\mathrm{Hz}`, microrotations as :math:`\\psi R/a_\\mathrm{Hz}`
"""

import matplotlib.pyplot as plt
import numpy as np

from cases import layers


def solve(alpha=0.05, positions=(0.1, 0.3, 0.5, 0.7), alphas=(0.01, 0.02, 0.05, 0.1), lines=60):
    """Profiles for Fig. 12, lengths of the layers for Fig. 13.

    Parameters
    ----------
    alpha : of Fig. 12a, side of a block over a_Hz
    positions : of Fig. 12a, x1 over a_Hz
    alphas : of Fig. 13
    lines : positions of Fig. 13 at which the mode is separated without a fit
    """
    x1 = np.linspace(0.05, 0.98, lines)
    return {
        "laws": (positions, layers.profiles(alpha, positions)),
        "differences": {size: layers.profiles(size, (0.3, 0.6)) for size in (0.01, 0.05, 0.1)},
        "layers": layers.solve(alphas)["layers"],
        "modes": (x1, {size: layers.profiles(size, x1, x2=[0.0])[-1] / size for size in alphas}),
    }


def fig12(positions, laws, differences):
    """(a) psi of microblocks (full) and unilateral (dotted); (b) its difference and the fit (51) (black)."""
    drawing, (top, bottom) = plt.subplots(2, 1, figsize=(3.54, 4.8), sharex=True, layout="constrained")
    x2, microblock, unilateral, _ = laws
    for number, x1 in enumerate(positions):
        top.plot(x2, microblock[number], f"C{number}", label=f"$x_1 = {x1:g}$")
        top.plot(x2, unilateral[number], f"C{number}:")
    for number, (alpha, (x2, microblock, unilateral, _)) in enumerate(differences.items()):
        for values, style, x1 in zip(microblock - unilateral, ("-", "--"), (0.3, 0.6)):
            lengths, amplitudes, *_ = layers.fitted_exponentials(x2, values, alpha, 0.0, 2.0)
            bottom.plot(x2, values, f"C{number}{style}", label=rf"$\alpha = {alpha:g}$, $x_1 = {x1:g}$")
            bottom.plot(x2[::3], np.exp(np.divide.outer(x2[::3], lengths)) @ amplitudes, "k.", markersize=2)
    top.set(
        ylabel=r"$\psi R/a_\mathrm{Hz}$",
        xlim=(-0.5, 0.005),
        ylim=(0, None),
        title="(a) microblock; dotted: unilateral",
    )
    bottom.set(
        xlabel=r"$x_2/a_\mathrm{Hz}$",
        ylabel=r"$\Delta\psi R/a_\mathrm{Hz}$",
        title="(b) difference; dots: fit (51)",
    )
    for axis in (top, bottom):
        axis.legend()
    return drawing


def fig13(rows, x1, modes):
    """Length of the layer: marks by the fit (51), lines by the micropolar mode, without a fit."""
    drawing = layers.figure({"layers": [{**row, "mode_length_over_ell": None} for row in rows]})
    axis = drawing.axes[0]
    for number, lengths in enumerate(modes.values()):
        # the quotient is unbounded next to the end of full contact
        shown = np.where((lengths > 0.6) & (lengths < 1.3), lengths, np.nan)
        shown[1:][np.diff(shown) < -0.2] = np.nan
        axis.plot(x1, shown, f"C{number}")
    axis.set(ylim=(0.6, 1.3), xlim=(0, 1))
    return drawing


def figure(result):
    """Both figures of the paper."""
    return {
        "fig12": fig12(*result["laws"], result["differences"]),
        "fig13": fig13(result["layers"], *result["modes"]),
    }


if __name__ == "__main__":
    result = solve()
    for row in result["layers"]:
        print("alpha = {alpha:g}, x1 = {x1:g}: L_bl/ell = {L_bl_over_ell}".format(**row))
    figure(result)
    plt.show()
