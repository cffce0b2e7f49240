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
    """Boundary layers in the compressed strip for four thicknesses, lengths in units of ell: u1 (lines,
    magnified 25 times) off the dashed initial positions, and microblocks rotated by psi0 + psi (magnified
    30 times, so that their corners pass the plane) at the surface and at three depths, each on its line.
    """
    drawing, axes = plots.figure(1, len(RATIOS), height=3.6, width=1.8, sharey=True)
    for axis, (ratio, nodes) in zip(axes, grouped(rows, "ell_over_H").items()):
        x2, psi, u1 = (np.array(column(nodes, name)) for name in ("x2", "psi", "u1"))
        H = 1 / ratio
        # the uppermost block hangs below the plane, and rotates like the surface
        for place, (centre, depth) in enumerate(((H - 0.5, 1), (2 / 3 * H, 2 / 3), (H / 3, 1 / 3), (0, 0))):
            line = 1.5 * place
            axis.plot([line, line], [0, H], "--", color="0.5", linewidth=0.6)
            axis.plot(line + U1_MAGNIFIED * u1 * H, x2 * H, color=plots.COLOURS[0])
            angle = ROTATION_MAGNIFIED * (np.radians(nodes[0]["psi0_deg"]) + np.interp(depth, x2, psi))
            square = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]]) / 2
            rotation = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
            shift = line + U1_MAGNIFIED * H * np.interp(depth, x2, u1)
            axis.plot(*((square @ rotation) + (shift, centre)).T, color=plots.COLOURS[1], linewidth=0.9)
        axis.axhline(H, color="k", linewidth=1)
        axis.set(
            title=rf"$\ell/H = {ratio:g}$",
            xlabel=r"$x_1/\ell$",
            aspect="equal",
            xlim=(-1, 5.5),
            ylim=(-1, 10.5),
            xticks=[0, 2, 4],
        )
    axes[0].set_ylabel(r"$x_2/\ell$")
    return drawing


def fig4_draw(rows):
    """Microrotation (a) and horizontal displacement (b) over the depth: closed form (lines), 20 bilinear
    elements per half-thickness (markers, every second node) and the tangents at the surface (dashed) whose
    feet mark the layer lengths."""
    drawing, axes = plots.figure(1, 2)
    for number, (ratio, nodes) in enumerate(grouped(rows, "ell_over_H").items()):
        strip_exact, fine = exact(nodes[0]), np.linspace(0, 1, 301)
        psi0, delta = np.radians(nodes[0]["psi0_deg"]), nodes[0]["delta_over_H"]
        for axis, name, scale, length in (
            (axes[0], "psi", -psi0, strip_exact.L_psi),
            (axes[1], "u1", delta, strip_exact.L_u),
        ):
            (line,) = axis.plot(
                fine, getattr(strip_exact, name)(fine) / scale, label=rf"$\ell/H = {ratio:g}$"
            )
            axis.plot(
                column(nodes, "x2")[::2],
                np.array(column(nodes, name))[::2] / scale,
                plots.MARKERS[number],
                color=line.get_color(),
                markerfacecolor="none",
                clip_on=False,
            )
            surface = getattr(strip_exact, name)(1.0) / scale
            axis.plot([1 - length, 1], [0, surface], "--", color=line.get_color(), linewidth=0.7)
    axes[0].set(xlabel="$x_2/H$", ylabel=r"$-\psi/\psi_0$", title="(a)", xlim=(-0.35, 1.02))
    axes[1].set(xlabel="$x_2/H$", ylabel=r"$u_1/\delta$", title="(b)", xlim=(0, 1.02))
    axes[1].plot([], [], "ko", markerfacecolor="none", label="finite elements")
    axes[1].plot([], [], "k--", linewidth=0.7, label="tangent at the surface")
    axes[1].legend(loc="upper left")
    return drawing


def fig5_records():
    thickness = np.geomspace(0.1, 20, 17)  # sqrt(beta) H/ell
    return [run_row(ell_over_H=float(1 / ratio), rtol=1e-9) for ratio in thickness]


def fig5_draw(rows):
    """Layer lengths over the thickness of the strip: closed form (49) (lines) and computed surface values
    over fluxes (markers)."""
    drawing, axis = plots.figure()
    fine = np.geomspace(0.1, 20, 200)
    beta = np.array(column(rows, "beta"))
    thickness = np.sqrt(beta) / np.array(column(rows, "ell_over_H"))
    for name, symbol, form, marker in (
        ("L_psi", r"\psi", 1 / np.tanh(fine), "o"),
        ("L_u", "u", np.tanh(fine), "s"),
    ):
        (line,) = axis.plot(fine, form, label=rf"$L_{symbol}$, closed form")
        axis.plot(
            thickness,
            np.array(column(rows, name)) * thickness,
            marker,
            color=line.get_color(),
            markerfacecolor="none",
            label=rf"$L_{symbol}$, computed",
        )
    axis.set(xscale="log", yscale="log", xlabel=r"$\beta^{1/2}H/\ell$", ylabel=r"$\beta^{1/2}L/\ell$")
    axis.legend()
    return drawing


def fig6_records():
    delta_fc = run_row(**PAPER_MESH)["delta_fc"]
    return [
        run_row(delta_over_H=float(share * delta_fc), **PAPER_MESH) for share in np.linspace(0.125, 2, 16)
    ]


def fig6_draw(rows):
    """Micromoment (a) and surface microrotation and displacements (b) while the strip of ell/H = 0.5 is
    compressed: closed form (lines), 20 bilinear elements per half-thickness (markers)."""
    drawing, axes = plots.figure(1, 2)
    lever = rows[0]["ell_over_H"] / 2 * (1 - np.radians(rows[0]["psi0_deg"]))
    delta_fc = exact(rows[0]).delta_fc
    fine = [exact(rows[0], delta=share * delta_fc) for share in np.linspace(1e-6, 2, 401)]
    full = exact(rows[0], delta=delta_fc)
    curves = (
        (axes[0], r"$M/M(\delta_{fc})$", "-", lambda s: s["micromoment"] / full.micromoment),
        (axes[0], r"$M/[t_n\ell(1-\psi_0)/2]$", "--", lambda s: s["micromoment"] / (s["traction"] * lever)),
        (axes[1], r"$-\psi/\psi_0$", "-", lambda s: s["psi_surface"] / full.psi(1.0)),
        (axes[1], r"$u_1/|u_1(\delta_{fc})|$", "--", lambda s: s["u1_surface"] / abs(full.u1(1.0))),
        (axes[1], r"$u_2/|u_2(\delta_{fc})|$", "-.", lambda s: s["u2_surface"] / abs(full.u2(1.0))),
    )
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
        axis.plot([s.delta / delta_fc for s in fine], form, style, color=colour, label=label)
        axis.plot(
            np.array(column(rows, "delta_over_H")) / delta_fc,
            [value(row) for row in rows],
            plots.MARKERS[number],
            color=colour,
            markerfacecolor="none",
            markevery=(number % 2, 2),
        )
    for axis, name in zip(axes, "ab"):
        axis.set(xlabel=r"$\delta/\delta_{fc}$", title=f"({name})")
        axis.legend()
    axes[0].set(ylim=(0, 1.1), ylabel="normalised micromoment")
    axes[1].set(ylabel="normalised surface values")
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
    """Accuracy of the strip on its 1D mesh. (a) Bilinear elements: error of psi over elements per layer
    length ell/sqrt(beta), with slope 2. (b) Error over unknowns by order, ell/H = 0.1. (c) Accuracy asked
    for by rtol and the larger of the errors of psi and u obtained."""
    drawing, axes = plots.figure(1, 3, width=2.33, height=2.9)
    fixed, asked = (
        [row for row in rows if row["rtol"] is None],
        [row for row in rows if row["rtol"] is not None],
    )
    for number, (ratio, runs) in enumerate(grouped(fixed, "ell_over_H").items()):
        runs = [row for row in runs if row["order"] == 1 and row["elements"] >= 4]
        per_layer = np.array(column(runs, "elements")) * ratio / np.sqrt(runs[0]["beta"])
        axes[0].loglog(
            per_layer, column(runs, "error_psi"), plots.MARKERS[number] + "-", label=rf"$\ell/H = {ratio:g}$"
        )
    slope = np.array([1.0, 100.0])
    axes[0].loglog(slope, 0.3 * slope**-2, "k:", label="slope $-2$")
    thin = [row for row in fixed if row["ell_over_H"] == 0.1]
    families = [([row for row in thin if row["order"] == order], f"order {order}") for order in (1, 2, 4, 8)]
    families.append(([row for row in thin if row["elements"] == 1], "one element"))
    for number, (runs, label) in enumerate(families):
        runs = sorted(runs, key=lambda row: row["unknowns"])
        axes[1].loglog(
            column(runs, "unknowns"), column(runs, "error_psi"), plots.MARKERS[number] + "-", label=label
        )
    for number, (ratio, runs) in enumerate(grouped(asked, "ell_over_H").items()):
        obtained = [max(row["error_psi"], row["error_u"]) for row in runs]
        axes[2].loglog(column(runs, "rtol"), obtained, plots.MARKERS[number], label=rf"$\ell/H = {ratio:g}$")
    limits = np.array([1e-11, 1e-2])
    axes[2].loglog(limits, limits, "k:", label="obtained = asked")
    labels = r"elements per $\ell/\beta^{1/2}$", r"unknowns ($\ell/H = 0.1$)", "rtol asked for"
    for axis, name, label in zip(axes, "abc", labels):
        axis.set(title=f"({name})", xlabel=label)
        plots.legend_below(axis, 2 if name == "b" else 1)
    axes[0].set_ylabel(r"relative $L_2$ error of $\psi$")
    axes[1].set_ylabel(r"relative $L_2$ error of $\psi$")
    axes[2].set_ylabel(r"relative $L_2$ error obtained")
    return drawing


def regularisation_records():
    strength = [float(10**power) for power in np.arange(-4.0, 10.1, 0.5)]
    return [
        run_row(method=method, rho=rho, order=12, elements=1, delta_over_H=0.04)
        for method in ("al", "penalty")
        for rho in strength
    ]


def regularisation_draw(rows):
    """What rho does, strip of ell/H = 0.5 in full contact: errors against the closed form. psi of the
    augmented Lagrangian does not depend on rho, the penalty's error falls like 1/rho; the tractions of both
    carry the rounding of rho times a difference of displacements."""
    drawing, axis = plots.figure(height=3.2)
    runs = grouped(rows, "method")
    names = {"al": "augmented Lagrangian", "penalty": "penalty"}
    for number, (method, points) in enumerate(runs.items()):
        # a difference of exactly nothing is drawn at the last digit
        traction = [max(abs(row["traction"] / exact(row).traction - 1), 1e-16) for row in points]
        for error, symbol, style in ((column(points, "error_psi"), r"\psi", "-"), (traction, "t_n", "--")):
            axis.loglog(
                column(points, "rho"),
                error,
                plots.MARKERS[number] + style,
                color=plots.COLOURS[number],
                markersize=3,
                label=f"{names[method]}, ${symbol}$",
            )
    slope = np.array([1e2, 1e8])
    axis.loglog(slope, 0.3 / slope, "k:", label=r"slope $-1$")
    axis.set(xlabel=r"$\varrho H/\mu$", ylabel="relative error")
    plots.legend_below(axis)
    return drawing


def curvature_records():
    return [
        row
        for curvature in (1.0, 2.0)
        for row in profile_rows(ell_over_H=0.2, curvature=curvature, rtol=1e-9)
        + profile_rows(ell_over_H=0.2, curvature=curvature, order=2, elements=20)
    ]


def curvature_draw(rows):
    """The curvature coefficient: (18) as printed has gamma' = 1, but the closed form (46) (line) is met by
    gamma' = 2 only; gamma' = 1 gives layers thinner by a factor sqrt(2)."""
    drawing, axis = plots.figure()
    fine = np.linspace(0, 1, 301)
    axis.plot(
        fine,
        exact(rows[0], curvature=2.0).psi(fine) / -np.radians(rows[0]["psi0_deg"]),
        "k",
        label="closed form (46) as printed",
    )
    meshed = [row for row in rows if row["rtol"] is None]
    for number, (curvature, nodes) in enumerate(grouped(meshed, "curvature").items()):
        axis.plot(
            column(nodes, "x2"),
            np.array(column(nodes, "psi")) / -np.radians(nodes[0]["psi0_deg"]),
            plots.MARKERS[number],
            color=plots.COLOURS[number],
            markerfacecolor="none",
            label=rf"computed, $\gamma' = {curvature:g}$",
        )
    axis.set(xlabel="$x_2/H$", ylabel=r"$-\psi/\psi_0$")
    axis.legend()
    return drawing


FIGURES = {
    "fig3": (fields_records, fig3_draw),
    "fig4": (fields_records, fig4_draw),
    "fig5": (fig5_records, fig5_draw),
    "fig6": (fig6_records, fig6_draw),
    "strip_convergence": (convergence_records, convergence_draw),
    "strip_regularisation": (regularisation_records, regularisation_draw),
    "strip_curvature": (curvature_records, curvature_draw),
}


def table_strip():
    """The strip at the paper's parameters, computed (rtol 1e-9) and by the closed form."""
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
