"""
Figures 8 to 10: pressure and micromoment under the cylinder
============================================================
Two zones of contact meet at 0.0898 of the load for :math:`\\alpha = 0.25`, that is at
:math:`\\alpha_\\mathrm{mid} = 0.8343`; the 0.8874 of the paper is that of its mesh.

:Geometry:  half-plane under a rigid cylinder; blocks aligned (Figs 8, 10) or rotated by :math:`\\psi_0`
            (Fig. 9)
:Equations: (10)-(18) in the solid, corner gaps (20)-(22), contact conditions (26)
:Method:    panels on the contact line; finite elements beside them (marks), fitted or bilinear and uniform
:Reference: Hertz for small blocks
:Units:     lengths over :math:`a_\\mathrm{Hz}`, pressures over :math:`p_\\mathrm{Hz}`, (50), loads over P
"""

import math

import matplotlib.pyplot as plt
import numpy as np

import microblock as mb
from cases import hertz, size_effect
from microblock.halfplane.kernels import coalescence_exponent

ROTATIONS = (5.0, "gaps and levers"), (5.0, "levers"), (0.5, "gaps and levers")


def solve(
    loads=(0.02, 0.05, 0.1, 0.25, 0.5, 0.75, 1.0),
    rotated_loads=(0.25, 0.5, 1.0),
    alphas=(0.01, 0.25, 0.5, 0.75, 1.0, 1.25),
    squares=(0.2, 0.1, 0.05, 0.025, 0.01937),
):
    """States for each figure, and alpha_mid on uniform meshes.

    Parameters
    ----------
    loads : of Fig. 8, over P
    rotated_loads : of Fig. 9, over P
    alphas : of Fig. 10, sides of a block over a_Hz
    squares : sides of bilinear elements over half of a block, about over a_Hz
    """
    aligned = hertz.problem()
    elements = aligned.with_(body=mb.Block(aligned.solid))
    rotated = [
        aligned.with_(law=mb.Microblock(psi0=math.radians(degrees), psi0_in=place))
        for degrees, place in ROTATIONS
    ]
    return {
        "loads": hertz.solve(loads=loads),
        "elements": [elements.solve(load=load * hertz.P, rtol=1e-3) for load in loads],
        "rotated": [
            [problem.solve(load=load * hertz.P, rtol=1e-4) for load in rotated_loads] for problem in rotated
        ],
        "alphas": {
            law: [hertz.solve(alpha, loads=(1.0,), contact=law)[0] for alpha in alphas]
            for law in ("microblock", "unilateral")
        },
        "uniform": size_effect.bilinear(hertz.nu, hertz.beta, squares),
        "alpha_mid": size_effect.by_panels(hertz.nu, hertz.beta)[0][0],
    }


def row(state):
    """A state of a table: lengths over a_Hz, the pressure over p_Hz, the load over P."""
    return {
        "alpha": state.solid.ell / hertz.a_Hz,
        "psi0_deg": math.degrees(getattr(state.law, "psi0", 0.0)),
        "load": state.load / hertz.P,
        "half_width": state.half_width / hertz.a_Hz,
        "pressure_max": state.pressure.max() / hertz.p_Hz,
        "error_estimate": state.error_estimate,
    }


def table(result):
    """What is printed."""
    states = {
        "fig8": result["loads"],
        "fig8 elements": result["elements"],
        **{f"fig10 {law}": group for law, group in result["alphas"].items()},
        **{
            f"fig9 {degrees:g} degrees in {place}": rotated
            for (degrees, place), rotated in zip(ROTATIONS, result["rotated"])
        },
    }
    squares = [{"h": h, "alpha_mid": alpha} for h, alpha in result["uniform"]]
    rows = {name: [row(state) for state in group] for name, group in states.items()}
    return rows | {"uniform": squares, "alpha_mid": result["alpha_mid"]}


def profiles(axes, states, mark="", count=1201):
    """Pressure, and micromoment if there is a second panel; from dark to light in the order of the states.

    The lightest colour has a contrast of 3 to a white page.
    """
    x = np.linspace(-1.4, 1.4, count)
    for colour, state in zip(plt.cm.viridis(np.linspace(0, 0.6, len(states))), states):
        axes[0].plot(x, state.pressure_at(x * hertz.a_Hz) / hertz.p_Hz, mark, color=colour, markersize=3)
        if len(axes) > 1:
            moment = np.interp(x * hertz.a_Hz, state.x, state.micromoment, left=0, right=0)
            axes[1].plot(x, moment / (hertz.p_Hz * state.solid.ell), mark, color=colour, markersize=3)
    axes[0].set_ylabel(r"$p_n/p_\mathrm{Hz}$")


def key(drawing, axis, words, title):
    """A legend above the panels for the first lines of an axis."""
    drawing.legend(axis.lines[: len(words)], words, loc="outside upper center", ncols=4, title=title)


def fig8(states, elements):
    """Pressure (a) and micromoment (b) of aligned blocks; marks: finite elements."""
    drawing, axes = plt.subplots(2, 1, figsize=(3.54, 4.6), sharex=True, layout="constrained")
    profiles(axes, states)
    profiles(axes, elements, ".", 36)
    key(drawing, axes[0], [f"{state.load / hertz.P:g}" for state in states], r"$P/P_\mathrm{max}$")
    axes[1].set(xlabel=r"$x_1/a_\mathrm{Hz}$", ylabel=r"$M/(p_\mathrm{Hz}\,\ell)$")
    return drawing


def fig9(rotated):
    """A row for each reading of the initial rotation: at 5 degrees in the gaps corner A never touches."""
    drawing, axes = plt.subplots(3, 2, figsize=(3.54, 4.8), sharex=True, layout="constrained")
    for pair, states, (degrees, place) in zip(axes, rotated, ROTATIONS):
        profiles(pair, states)
        pair[0].set_title(rf"$\psi_0 = {degrees:g}^\circ$ in {place}", loc="left")
        pair[1].set_ylabel(r"$M/(p_\mathrm{Hz}\,\ell)$")
    key(drawing, axes[0, 0], [f"{state.load / hertz.P:g}" for state in rotated[0]], r"$P/P_\mathrm{max}$")
    for axis in axes[-1]:
        axis.set_xlabel(r"$x_1/a_\mathrm{Hz}$")
    return drawing


def fig10(laws):
    """Larger blocks widen and split the contact (a); without corners they narrow it (b). Dashed: Hertz."""
    drawing, axes = plt.subplots(2, 1, figsize=(3.54, 4.4), sharex=True, layout="constrained")
    x = np.linspace(-1, 1, 201)
    for axis, name, (law, states) in zip(axes, "ab", laws.items()):
        profiles([axis], states)
        axis.plot(x, np.sqrt(1 - x**2), "k--", linewidth=0.8)
        axis.set_title(f"({name}) {law}", loc="left")
    key(drawing, axes[0], [f"{state.solid.ell / hertz.a_Hz:g}" for state in states], r"$\alpha$")
    axes[1].set_xlabel(r"$x_1/a_\mathrm{Hz}$")
    return drawing


def meshes(uniform, alpha_mid):
    """alpha_mid over the side of bilinear squares, scaled as h^(2 zeta), in which it is a straight line."""
    drawing, axis = plt.subplots(figsize=(3.54, 2.8), layout="constrained")
    h, alphas = np.array(uniform).T
    power = 2 * coalescence_exponent(hertz.problem().solid)
    rate = (alphas[-1] - alpha_mid) / h[-1] ** power
    axis.plot([0, h[0] ** power], [alpha_mid, alpha_mid + rate * h[0] ** power], "--", color="0.5")
    axis.plot(h**power, alphas, "o", label="bilinear squares")
    axis.plot(0.02**power, 0.8874, "s", markersize=8, markerfacecolor="none", label="the paper, 0.8874")
    axis.plot(0, alpha_mid, "D", clip_on=False, label=f"half-plane, {alpha_mid:.4f}")
    ticks = np.array((0, 0.02, 0.05, 0.1, 0.2))
    axis.set_xticks(ticks**power, [f"{tick:g}" for tick in ticks])
    axis.set(
        xlabel=r"$h/a_\mathrm{Hz}$, scaled as $h^{2\zeta}$", ylabel=r"$\alpha_\mathrm{mid}$", xlim=(0, None)
    )
    axis.legend()
    return drawing


def figure(result):
    """The three figures of the paper, and what its mesh does to alpha_mid."""
    return {
        "fig8": fig8(result["loads"], result["elements"]),
        "fig9": fig9(result["rotated"]),
        "fig10": fig10(result["alphas"]),
        "alpha_mid": meshes(result["uniform"], result["alpha_mid"]),
    }


if __name__ == "__main__":
    result = solve()
    print(f"alpha_mid = {result['alpha_mid']:.10f}; zones meet at {(0.25 / result['alpha_mid']) ** 2:.5f} P")
    figure(result)
    plt.show()
