"""Figures of section 4.1: what is computed for each, and how it is drawn.

Markers are records; the lines beside them are the closed form for the parameters in the same records.
"""

import numpy as np

from microblock.data.records import column, grouped
from microblock.view import plots

from ..common.case import records
from ..scenes import strip

RATIOS = (0.1, 0.2, 0.5, 1.0)  # ell/H
PAPER_MESH = dict(model="column", order=1, elements=20)
U1_MAGNIFIED, ROTATION_MAGNIFIED = 25, 30  # as in the paper's Fig. 3


def profile_rows(**changes):
    """One run as records along the depth: each row a node."""
    return records(strip, "strip", strip.Parameters(**changes))


def run_row(**changes):
    """One run as a record: its command, its parameters and what it gave."""
    row = profile_rows(**changes)[0]
    return {name: value for name, value in row.items() if name not in ("x2", "psi", "u1", "u2")}


def exact(row, **changes):
    """The closed form that belongs to a record."""
    from microblock.model.closed_forms import Strip  # here, so that cases run without it

    given = dict(
        ell=row["ell_over_H"],
        psi0=np.radians(row["psi0_deg"]),
        nu=row["nu"],
        beta=row["beta"],
        delta=row["delta_over_H"],
        curvature=row["curvature"],
    )
    return Strip(**{**given, **changes})


def fields_records():
    return [row for ratio in RATIOS for row in profile_rows(ell_over_H=ratio, **PAPER_MESH)]


def fig3_draw(rows):
    """Between two rigid planes the blocks are rotated back at the surface, within a layer of a few ell.

    The paper's Fig. 3: upper half of the compressed strip for four thicknesses H, lengths in units of ell.
    Blue: the horizontal displacement u1, 25 times too large, off the dashed initial lines. Orange:
    microblocks rotated by psi0 + psi, 30 times too much; the uppermost one, which rotates like the surface,
    touches the plane with a corner.

    Seen: four panels; squares are tilted by some 30 degrees at depth in the thick strips at the left and by
    less towards the plane at the top, where a few degrees are left; in the thinnest strip, at the right, all
    are tilted by 5 to 15 degrees.
    """
    drawing, axes = plots.figure(1, len(RATIOS), height=1.9, sharey=True)
    for axis, (ratio, nodes) in zip(axes, grouped(rows, "ell_over_H").items()):
        x2, psi, u1 = (np.array(column(nodes, name)) for name in ("x2", "psi", "u1"))
        H = 1 / ratio
        highest = H
        for place, share in enumerate((1, 2 / 3, 1 / 3, 0)):
            line = 1.5 * place
            axis.plot([line, line], [0, H], "--", color="0.5", linewidth=0.5)
            axis.plot(line + U1_MAGNIFIED * u1 * H, x2 * H, color=plots.COLOURS[0], linewidth=0.9)
            depth = share * highest / H
            angle = ROTATION_MAGNIFIED * (np.radians(nodes[0]["psi0_deg"]) + np.interp(depth, x2, psi))
            rotation = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
            square = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]]) / 2 @ rotation
            if place == 0:  # rotates like the surface, and hangs below the plane
                highest = H - square[:, 1].max()
            centre = min(share * highest, H - square[:, 1].max())
            shift = line + U1_MAGNIFIED * H * np.interp(depth, x2, u1)
            axis.plot(*(square + (shift, centre)).T, color=plots.COLOURS[1], linewidth=0.8)
        axis.axhline(H, color="k", linewidth=1)
        axis.set(
            title=rf"$\ell/H = {ratio:g}$",
            xlabel=r"$x_1/\ell$",
            aspect="equal",
            xlim=(-1, 5.7),
            ylim=(-1, 10.5),
            xticks=[0, 2, 4],
        )
    axes[0].set_ylabel(r"$x_2/\ell$")
    return drawing


def fig4_draw(rows):
    """Microrotation and displacement decay from the surface of the strip over layers of ell/sqrt(beta).

    The paper's Fig. 4: microrotation (a) and horizontal displacement (b) over the depth for four thicknesses.
    Lines: closed form (46); open marks: 20 bilinear elements per half-thickness, every second node; dashed:
    tangents at the surface, whose feet at the zero of the ordinate mark the lengths of the layers.

    Seen: curves that rise towards the surface, the more steeply the thinner the blocks; the marks lie on them
    within two per cent.
    """
    drawing, axes = plots.figure(2, 1, height=1.9, sharex=True)
    lines = grouped(rows, "ell_over_H")
    for number, (colour, nodes) in enumerate(zip(plots.shades(len(lines)), lines.values())):
        strip_exact, fine = exact(nodes[0]), np.linspace(0, 1, 301)
        psi0, delta = np.radians(nodes[0]["psi0_deg"]), nodes[0]["delta_over_H"]
        for axis, name, scale, length in (
            (axes[0], "psi", -psi0, strip_exact.L_psi),
            (axes[1], "u1", delta, strip_exact.L_u),
        ):
            axis.plot(fine, getattr(strip_exact, name)(fine) / scale, color=colour)
            axis.plot(
                column(nodes, "x2")[::2],
                np.array(column(nodes, name))[::2] / scale,
                plots.MARKERS[number],
                color=colour,
                markerfacecolor="none",
                clip_on=False,
            )
            surface = getattr(strip_exact, name)(1.0) / scale
            axis.plot([1 - length, 1], [0, surface], "--", color=colour, linewidth=0.7)
    axes[0].set(ylabel=r"$-\psi/\psi_0$", ylim=(-0.05, 1))
    axes[1].set(xlabel="$x_2/H$", ylabel=r"$u_1/\delta$", xlim=(0, 1.02))
    first, *others = (f"{ratio:g}" for ratio in lines)
    words = [rf"$\ell/H = {first}$", *others]
    plots.key(drawing, words, plots.shades(len(lines)), plots.MARKERS, markerfacecolor="none")
    plots.letter(axes)
    return drawing


def fig5_records():
    thickness = np.geomspace(0.1, 20, 17)  # sqrt(beta) H/ell
    return [run_row(ell_over_H=float(1 / ratio), rtol=1e-9) for ratio in thickness]


def fig5_draw(rows):
    """Layers of microrotation and displacement are ell/sqrt(beta) long in strips thicker than three of them.

    The paper's Fig. 5: both lengths over the thickness, by the closed form (49) (lines) and from computed
    surface values over fluxes (marks).

    Seen: two curves on logarithmic axes, one falling and one rising to the same level, which they reach at a
    thickness of three layers.
    """
    drawing, axis = plots.figure(height=2.4)
    fine = np.geomspace(0.1, 20, 200)
    beta = np.array(column(rows, "beta"))
    thickness = np.sqrt(beta) / np.array(column(rows, "ell_over_H"))
    for (name, symbol, form, up), marker, colour in zip(
        (("L_psi", r"\psi", 1 / np.tanh(fine), 1), ("L_u", "u", np.tanh(fine), -1)), "os", plots.COLOURS
    ):
        axis.plot(fine, form, color=colour)
        values = np.array(column(rows, name)) * thickness
        axis.plot(thickness, values, marker, color=colour, markerfacecolor="none")
        place = np.searchsorted(fine, 0.25)
        what = "microrotation" if name == "L_psi" else "displacement"
        plots.label(
            axis, fine[place], form[place], rf"$L_{symbol}$ of the {what}", colour, (8, 4 * up), ha="left"
        )
    axis.set(xscale="log", yscale="log", xlabel=r"$\beta^{1/2}H/\ell$", ylabel=r"$\beta^{1/2}L/\ell$")
    return drawing


def fig6_records():
    delta_fc = run_row(**PAPER_MESH)["delta_fc"]
    return [
        run_row(delta_over_H=float(share * delta_fc), **PAPER_MESH) for share in np.linspace(0.125, 2, 16)
    ]


def fig6_draw(rows):
    """From full contact on, at delta_fc, micromoment and rotation stay what they are.

    The paper's Fig. 6: the strip of ell/H = 0.5 is compressed by delta; at delta_fc the second corner of each
    block closes. (a) Micromoment, over its value there and over the largest that the traction can carry; (b)
    surface values of microrotation and displacements over the size of those at delta_fc. Lines: closed form,
    marks: 20 bilinear elements per half-thickness.

    Seen: curves with a break at one: proportional before, constant beyond, but for the normal displacement,
    which falls with the slope -1 before and -1.2 beyond, and the micromoment over the traction, which is
    constant before and falls beyond.
    """
    drawing, axes = plots.figure(2, 1, height=1.8, sharex=True)
    lever = rows[0]["ell_over_H"] / 2 * (1 - np.radians(rows[0]["psi0_deg"]))
    delta_fc = exact(rows[0]).delta_fc
    fine = [exact(rows[0], delta=share * delta_fc) for share in np.linspace(1e-6, 2, 401)]
    full = exact(rows[0], delta=delta_fc)
    curves = (
        (axes[0], r"$M/M(\delta_{fc})$", "-", lambda s: s["micromoment"] / full.micromoment),
        (axes[0], r"$M/[t_n\ell(1-\psi_0)/2]$", "--", lambda s: s["micromoment"] / (s["traction"] * lever)),
        (axes[1], r"$\psi$", "-", lambda s: s["psi_surface"] / full.psi(1.0)),
        (axes[1], r"$u_1$", "--", lambda s: s["u1_surface"] / abs(full.u1(1.0))),
        (axes[1], r"$u_2$", "-.", lambda s: s["u2_surface"] / abs(full.u2(1.0))),
    )
    ends = {id(axis): [] for axis in axes}
    for number, (axis, label, style, value) in enumerate(curves):
        form = [
            value(
                dict(
                    micromoment=s.micromoment,
                    traction=s.traction,
                    psi_surface=s.psi(1.0),
                    u1_surface=s.u1(1.0),
                    u2_surface=s.u2(1.0),
                )
            )
            for s in fine
        ]
        colour = plots.COLOURS[number]
        axis.plot([s.delta / delta_fc for s in fine], form, style, color=colour)
        axis.plot(
            np.array(column(rows, "delta_over_H")) / delta_fc,
            [value(row) for row in rows],
            plots.MARKERS[number],
            color=colour,
            markerfacecolor="none",
            markevery=(number % 2, 2),
        )
        ends[id(axis)].append((form[-1], label, colour))
    axes[0].set(ylim=(0, 1.1), ylabel="micromoment")
    axes[1].set(xlabel=r"$\delta/\delta_{fc}$", ylabel=r"over $|$value at $\delta_{fc}|$", xlim=(0, 2.05))
    for axis in axes:
        plots.label_ends(axis, ends[id(axis)], gap=0.12)
    plots.letter(axes)
    return drawing


def convergence_records():
    meshes = [(1, 2**k) for k in range(2, 10)]
    meshes += [(order, 2**k) for order in (2, 4, 8) for k in range(7) if order * 2**k <= 130]
    meshes += [(order, 1) for order in range(2, 19, 2)]
    runs = [
        run_row(ell_over_H=ratio, order=order, elements=elements)
        for ratio in (0.1, 0.5)
        for order, elements in dict.fromkeys(meshes)
    ]
    return runs + [
        run_row(ell_over_H=ratio, rtol=10.0**-digits) for ratio in (0.1, 0.5) for digits in range(2, 12)
    ]


def convergence_draw(rows):
    """What is asked for is obtained, and one element of high order is the cheapest.

    Relative L2 errors against the closed form on the 1D mesh. (a) Error of the microrotation over unknowns
    for ell/H = 0.1: elements of orders 1 to 8, refined, and one element of rising order. (b) The larger one
    of the errors of psi and u over the rtol that was asked for; below the dotted line the request is met.

    Seen: straight lines that fall the faster the higher the order, and in the lower panel marks that all lie
    below the line.
    """
    drawing, axes = plots.figure(2, 1, height=2.1)
    fixed, asked = (
        [row for row in rows if row["rtol"] is None],
        [row for row in rows if row["rtol"] is not None],
    )
    thin = [row for row in fixed if row["ell_over_H"] == 0.1]
    families = [([row for row in thin if row["order"] == order], f"order {order}") for order in (1, 2, 4, 8)]
    families.append(([row for row in thin if row["elements"] == 1], "one element"))
    colours = (*plots.shades(4), plots.COLOURS[1])
    for (runs, name), colour, marker in zip(families, colours, plots.MARKERS):
        runs = sorted(runs, key=lambda row: row["unknowns"])
        axes[0].loglog(column(runs, "unknowns"), column(runs, "error_psi"), marker + "-", color=colour)
        last = runs[-1]
        shift = {"one element": (-4, 0), "order 2": (1, -8)}.get(name, (5, 0))
        plots.label(axes[0], last["unknowns"], last["error_psi"], name, colour, shift)
    for number, (ratio, runs) in enumerate(grouped(asked, "ell_over_H").items()):
        obtained = [max(row["error_psi"], row["error_u"]) for row in runs]
        colour = plots.COLOURS[number]
        axes[1].loglog(column(runs, "rtol"), obtained, plots.MARKERS[number], color=colour)
        last = runs[0]
        # the last two marks are so near that their names would touch
        plots.label(axes[1], last["rtol"], obtained[0], rf"$\ell/H = {ratio:g}$", colour, (6, 4 - 9 * number))
    limits = np.array([1e-11, 1e-2])
    axes[1].loglog(limits, limits, "k:")
    plots.label(axes[1], 1e-6, 1e-6, "as asked for", "k", (-3, 5))
    axes[0].set(xlabel=r"unknowns ($\ell/H = 0.1$)", ylabel=r"$L_2$ error of $\psi$", xlim=(None, 2e4))
    axes[1].set(xlabel="rtol asked for", ylabel=r"$L_2$ error obtained", xlim=(None, 0.5))
    for axis in axes:
        axis.minorticks_off()
    plots.letter(axes)
    return drawing


def curvature_records():
    return [
        row
        for curvature in (1.0, 2.0)
        for row in profile_rows(ell_over_H=0.2, curvature=curvature, rtol=1e-9)
        + profile_rows(ell_over_H=0.2, curvature=curvature, order=2, elements=20)
    ]


def curvature_draw(rows):
    """The curvature term of the energy needs twice the coefficient that (18) prints.

    Microrotation over the depth of the strip of ell/H = 0.2. Line: the paper's closed form (46); marks:
    computed with the coefficient gamma' = 2, on the line, and with gamma' = 1 as printed in (18), which makes
    the layer thinner by sqrt(2).

    Seen: squares on the black curve; circles below it in the layer and above it at the surface.
    """
    drawing, axis = plots.figure(height=2.4)
    fine = np.linspace(0, 1, 301)
    form = exact(rows[0], curvature=2.0).psi(fine) / -np.radians(rows[0]["psi0_deg"])
    axis.plot(fine, form, "k")
    plots.label(axis, 0.7, np.interp(0.7, fine, form), "closed form (46)", "k", (-4, 4))
    meshed = [row for row in rows if row["rtol"] is None]
    for number, (curvature, nodes) in enumerate(grouped(meshed, "curvature").items()):
        values = np.array(column(nodes, "psi")) / -np.radians(nodes[0]["psi0_deg"])
        colour = plots.COLOURS[number]
        axis.plot(column(nodes, "x2"), values, plots.MARKERS[number], color=colour, markerfacecolor="none")
        place, shift = (0.9, (4, -4)) if curvature == 1 else (0.85, (-4, 2))
        at = np.interp(place, column(nodes, "x2"), values)
        plots.label(axis, place, at, rf"$\gamma' = {curvature:g}$", colour, shift)
    axis.set(xlabel="$x_2/H$", ylabel=r"$-\psi/\psi_0$")
    return drawing


FIGURES = {
    "fig3": (fields_records, fig3_draw),
    "fig4": (fields_records, fig4_draw),
    "fig5": (fig5_records, fig5_draw),
    "fig6": (fig6_records, fig6_draw),
    "strip_convergence": (convergence_records, convergence_draw),
    "strip_curvature": (curvature_records, curvature_draw),
}


def table_strip():
    """The strip at the paper's parameters is computed to 1e-9 of its closed form.

    Surface values, fluxes and layer lengths for the four thicknesses, asked for rtol 1e-9; stresses over mu,
    lengths over H.
    """
    rows = []
    for ratio in RATIOS:
        row = run_row(ell_over_H=ratio, rtol=1e-9)
        form = exact(row)
        pairs = {
            "delta_fc": form.delta_fc,
            "psi_surface": form.psi(1.0),
            "u1_surface": form.u1(1.0),
            "u2_surface": form.u2(1.0),
            "traction": form.traction,
            "micromoment": form.micromoment,
            "L_psi": form.L_psi,
            "L_u": form.L_u,
        }
        kept = {
            name: row[name]
            for name in (
                "ell_over_H",
                "psi0_deg",
                "nu",
                "beta",
                "delta_over_H",
                "curvature",
                "model",
                "method",
                "state",
                "unknowns",
            )
        }
        rows += [
            {
                "quantity": name,
                "computed": row[name],
                "closed_form": float(value),
                "difference": row[name] - float(value),
                **kept,
                "command": row["command"],
            }
            for name, value in pairs.items()
        ]
    return rows


TABLES = {"strip_table": table_strip}
