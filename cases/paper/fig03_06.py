"""
Figures 3 to 6: the strip between rigid planes
==============================================
Compressed blocks rotate back within a layer of a few :math:`\\ell` below the surface, until both corners
touch.

:Geometry:  strip of the thickness 2 H between rigid planes, blocks rotated by :math:`\\psi_0 = 1` degree
            (paper, Fig. 2)
:Equations: closed fields (44), with the conditions (45) of partial contact and with those of full contact
:Method:    20 bilinear elements over the half-thickness as in the paper; elements of high order for Fig. 5
:Reference: closed form (46)-(49)
:Units:     lengths over :math:`\\ell` (Fig. 3) or H
"""

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np

from cases import strip

RATIOS, PAPER = (0.1, 0.2, 0.5, 1.0), {"order": 1, "elements": 20}
MARKS = "os^Dv"


def solve(psi0_deg=1.0, nu=0.3, beta=1.0, delta_over_H=0.02):
    """States for Figs 3 and 4, for Fig. 5, and for Fig. 6.

    Parameters
    ----------
    psi0_deg : initial rotation of the blocks in degrees
    nu : Poisson's ratio
    beta : coupling of rotations, between 0 and 2
    delta_over_H : approach of each plane over H, but in Fig. 6
    """
    solid = {"psi0_deg": psi0_deg, "nu": nu, "beta": beta}
    thin = [beta**0.5 / thickness for thickness in np.geomspace(0.1, 20, 17)]
    contact = strip.problem(0.5, **solid, **PAPER)
    delta_fc = strip.full_contact(contact)
    return {
        "fields": [strip.solve(ratio, deltas=(delta_over_H,), **solid, **PAPER)[0] for ratio in RATIOS],
        "lengths": [strip.solve(ratio, deltas=(delta_over_H,), order=12, **solid)[0] for ratio in thin],
        "loads": [contact.solve(approach=fraction * delta_fc) for fraction in np.linspace(0.125, 2, 16)],
        "delta_fc": delta_fc,
    }


# %%
# Fig. 3: blocks at four heights, rotated by psi0 + psi (30 times), and the displacement u1 (25 times). The
# uppermost block hangs below the plane and touches it with a corner.


def fig3(states):
    """The deformed strips, a panel for each thickness, lengths over ell."""
    drawing, axes = plt.subplots(1, 4, figsize=(3.54, 1.9), sharey=True, layout="constrained")
    for axis, state in zip(axes, states):
        H = 1 / state.solid.ell
        x2 = np.linspace(0, 1, 200)
        axis.axhline(H, color="0.5")
        for place, fraction in enumerate((1, 2 / 3, 1 / 3, 0)):
            u1 = 25 * H * strip.fields_over_height(state, x2)[1]
            axis.plot([1.5 * place, 1.5 * place], [0, H], "--", color="0.5", linewidth=0.5)
            axis.plot(1.5 * place + u1, x2 * H, "C0", linewidth=0.9)
            block = np.array([-1 - 1j, 1 - 1j, 1 + 1j, -1 + 1j, -1 - 1j]) / 2
            block *= np.exp(30j * (state.law.psi0 + strip.fields_over_height(state, [fraction])[0][0]))
            height = min(fraction * H, H - block.imag.max())
            x1 = 1.5 * place + np.interp(height, x2 * H, u1)
            axis.plot(x1 + block.real, height + block.imag, "C1", linewidth=0.9)
        axis.set(
            title=rf"$\ell/H = {state.solid.ell:g}$",
            xlabel=r"$x_1/\ell$",
            aspect="equal",
            xlim=(-1, 5.7),
            ylim=(-1, 10.5),
        )
    axes[0].set_ylabel(r"$x_2/\ell$")
    return drawing


# %%
# Figs 4 to 6: marks are computed, lines the closed form


def fig4(states):
    """Microrotation (a) and displacement (b) over the height; dashed: tangents at the surface."""
    drawing, axes = plt.subplots(2, 1, figsize=(3.54, 4.0), sharex=True, layout="constrained")
    x2, fine = np.linspace(0, 1, 11), np.linspace(0, 1, 301)
    for number, state in enumerate(states):
        exact, (psi, u1, _) = strip.closed_form(state), strip.fields_over_height(state, x2)
        rows = (exact.psi, psi, -exact.psi0, exact.L_psi), (exact.u1, u1, exact.delta, exact.L_u)
        for axis, (form, values, scale, length) in zip(axes, rows):
            axis.plot(fine, form(fine) / scale, f"C{number}")
            look = {"color": f"C{number}", "markerfacecolor": "none", "clip_on": False}
            axis.plot(x2, values / scale, MARKS[number], label=f"{exact.ell:g}", **look)
            axis.plot([1 - length, 1], [0, form(1.0) / scale], "--", color=f"C{number}", linewidth=0.7)
    axes[0].set(ylabel=r"$-\psi/\psi_0$", ylim=(-0.03, 1))
    axes[1].set(xlabel="$x_2/H$", ylabel=r"$u_1/\delta$", xlim=(0, 1.02), ylim=(0, None))
    handles = axes[0].get_legend_handles_labels()
    drawing.legend(*handles, loc="outside upper center", ncols=4, title=r"$\ell/H$")
    return drawing


def fig5(states):
    """Lengths of the layers over the thickness, both times the root of beta over ell."""
    drawing, axis = plt.subplots(figsize=(3.54, 2.8), layout="constrained")
    scales = np.array([state.solid.beta**0.5 / state.solid.ell for state in states])
    fine = np.geomspace(0.1, 20, 200)
    lengths = np.array([strip.lengths(state) for state in states]).T * scales
    for number, (name, form) in enumerate(((r"\psi", 1 / np.tanh(fine)), ("u", np.tanh(fine)))):
        axis.loglog(fine, form, f"C{number}")
        axis.loglog(scales, lengths[number], f"C{number}{MARKS[number]}", mfc="none", label=f"$L_{name}$")
    axis.set(xlabel=r"$\beta^{1/2}H/\ell$", ylabel=r"$\beta^{1/2}L/\ell$")
    axis.legend()
    return drawing


def surface(exact):
    """Micromoment, traction, psi, u1 and u2 of a closed form at the surface."""
    return np.array(
        [exact.micromoment, exact.traction, *(field(1.0) for field in (exact.psi, exact.u1, exact.u2))]
    )


def fig6(states, delta_fc):
    """Micromoment (a), microrotation and displacements (b) at the surface over the approach."""
    drawing, axes = plt.subplots(2, 1, figsize=(3.54, 4.2), sharex=True, layout="constrained")
    exact = strip.closed_form(states[0])
    full, fine = replace(exact, delta=exact.delta_fc), np.linspace(1e-3, 2, 401)
    lines = np.array([surface(replace(exact, delta=fraction * exact.delta_fc)) for fraction in fine]).T
    marks = [
        (s.micromoment[0], -s.pressure[0], *np.ravel(strip.fields_over_height(s, [1.0]))) for s in states
    ]
    fractions, marks = np.array([state.approach for state in states]) / delta_fc, np.array(marks).T
    lever, sizes = exact.ell / 2 * (1 - exact.psi0), np.abs(surface(full))
    curves = (
        (axes[0], r"$M/M(\delta_{fc})$", lambda s: s[0] / surface(full)[0]),
        (axes[0], r"$M/[t_n\ell(1-\psi_0)/2]$", lambda s: s[0] / (s[1] * lever)),
        *(
            (axes[1], name, lambda s, k=k: s[k] / sizes[k])
            for k, name in ((2, r"$\psi$"), (3, "$u_1$"), (4, "$u_2$"))
        ),
    )
    for number, (axis, words, value) in enumerate(curves):
        axis.plot(fine, value(lines), f"C{number}")
        axis.plot(fractions, value(marks), f"C{number}{MARKS[number]}", markerfacecolor="none", label=words)
    axes[0].set(ylabel="micromoment", ylim=(0, 1.1))
    axes[1].set(xlabel=r"$\delta/\delta_{fc}$", ylabel=r"over $|$value at $\delta_{fc}|$")
    for axis in axes:
        axis.legend()
    return drawing


def figure(result):
    """The four figures of the paper."""
    fields, lengths, loads, delta_fc = result.values()
    return {"fig3": fig3(fields), "fig4": fig4(fields), "fig5": fig5(lengths), "fig6": fig6(loads, delta_fc)}


if __name__ == "__main__":
    result = solve()
    print(f"delta_fc = {result['delta_fc']:.6f} H")
    figure(result)
    plt.show()
