"""The sentences of docs/methods.md, each with the numbers that bear it out."""

import math

from .facts import Fact, Range, below, best, claim, cost, count, of_finest, quantile, share, worst_ratio

HEAD = """# Which method, and where it breaks

Each sentence is checked against the records of `python -m cases speed` and `python -m cases limits`
(cases/data), and the table at the end says which ones: study, measure, selection, number of runs ("AL,
order 1", a uniform bilinear mesh with augmented Lagrangian, is "paper's way" in records of 0.1). Seconds
are processor seconds of one thread, setup and solving together; errors are relative, of pressure and
micromoment in L2 unless said otherwise. `python -m cases methods --out DIR` writes this page, and stops at
a sentence that the records do not bear out."""

SCENE = "microblock-0.25"
ASKED = ("half-plane", "fitted fe")  # methods that are asked for an accuracy
UNIFORM = (
    "AL, order 1",
    "penalty",
    "AL, order 2",
    *(f"{shape}, order {order}" for shape in ("condensed", "triangles") for order in (1, 2, 4, 6)),
)
LINE = ("line_beta_small", "line_beta_large", "line_turned", "line_wedge", "line_touching")
FITTED = ("fitted_beta_large", "fitted_beta_small")
LAGRANGIAN = ("lagrangian_strip", "lagrangian_squares")
FRICTION = ("friction_cylinder", "friction_square")
DEFECTS = ("missed", "not finite", "time limit", "untyped error", "crash")


def seconds(method, error, scene=SCENE):
    """What a true error costs by a method."""
    return Fact("speed", {"scene": scene, "method": method}, cost(error))


def least(method, scene=SCENE, **where):
    """Least true error that a method came to."""
    return Fact("speed", {"scene": scene, "method": method, **where}, best)


def largest(column, method):
    """A column of the largest run of a method in the study of growth."""
    return Fact("speed_cost", {"method": method}, of_finest(column, "unknowns"))


def runs(name, measure, **where):
    """A measure of the runs of a map, or of several."""
    return Fact("limits", {"map": name, **where}, measure)


def worst(column="error"):
    return quantile(column, 1.0)


def middle(column="error"):
    return quantile(column, 0.5)


def quotient(slow, fast, **_):
    return slow / fast


HALF_PLANE = (
    "A homogeneous half-plane: the contact line",
    (
        claim(
            "A cylinder at alpha = 0.25 to 1 %: the contact line (`Panels` on a `HalfPlane`) takes "
            "{fast:.2g} s, a uniform bilinear mesh with augmented Lagrangian"
            " (`hertz --model fe --mesh uniform --method al`) {slow:.2g} s, {times:.0f} times as long.",
            lambda times, **_: times > 10,
            {"times": quotient},
            slow=seconds("AL, order 1", 1e-2),
            fast=seconds("half-plane", 1e-2),
        ),
        claim(
            "To 1e-4 it takes {fast:.2g} s, fitted finite elements (`Block`) {slow:.2g} s, "
            "{times:.0f} times as long:"
            " those are for a bounded body.",
            lambda times, **_: times > 2,
            {"times": quotient},
            slow=seconds("fitted fe", 1e-4),
            fast=seconds("half-plane", 1e-4),
        ),
        claim(
            "What is asked for is obtained: over all scenes of `speed` the error is at most {worst:.2g} "
            "times the rtol.",
            lambda worst: worst < 1,
            worst=Fact("speed", {"method": ASKED, "judged": ("True", True)}, worst_ratio("error", "rtol")),
        ),
        claim(
            "Of {runs:.0f} seeded problems (nu to 0.4999, beta from 1e-4 to 1.999, blocks rotated to 20 "
            "degrees, wedges, corners"
            " that just touch) {missed:.1%} exceeded their tolerance and {refused:.1%} raised a typed error.",
            lambda missed, refused, **_: missed < 0.01 and refused < 0.1,
            runs=runs(LINE, count),
            missed=runs(LINE, share("missed")),
            refused=runs(LINE, share("typed error")),
        ),
        claim(
            "Where two zones meet (alpha within 1e-4 of alpha_mid) {fine:.0%} of the requests for 1e-5 or "
            "less raise a typed error, of"
            " those for 1e-3 or more {coarse:.0%}: ask for less there, or for the load itself, "
            "`problem.solver.coalescence()`.",
            lambda fine, coarse: fine > coarse,
            fine=runs("line_coalescence", share("typed error"), distance=Range(0, 1e-4), rtol=Range(0, 1e-5)),
            coarse=runs("line_coalescence", share("typed error"), distance=Range(0, 1e-4), rtol=Range(1e-3)),
        ),
        claim(
            "A fit determines the layer's length inside the contact (x1 < 0.9 a_Hz) in {thin:.0%} of the "
            "runs with alpha < 0.1,"
            " in {thick:.0%} of those with alpha > 0.3; else it is null, with the reason.",
            lambda thin, thick: thin > 0.7 > thick,
            thin=runs("layer_fit", share("delivered"), x1=Range(0, 0.9), alpha=Range(0, 0.1)),
            thick=runs("layer_fit", share("delivered"), x1=Range(0, 0.9), alpha=Range(0.3)),
        ),
    ),
)

BODIES = (
    "Bodies: finite elements",
    (
        claim(
            "No uniform mesh here comes below {uniform:.1g} at alpha = 0.25, whatever its order: the edges "
            "of the zones set the"
            " rate. Fitted ones reach {fitted:.1g}.",
            lambda uniform, fitted: fitted < uniform / 30,
            uniform=least(UNIFORM),
            fitted=least("fitted fe"),
        ),
        claim(
            "On uniform meshes order 4 pays nevertheless: 2 % take {fast:.2g} s, at order 1 {slow:.2g} s.",
            lambda slow, fast: slow > fast,
            slow=seconds("condensed, order 1", 2e-2),
            fast=seconds("condensed, order 4", 2e-2),
        ),
        claim(
            "In thin layers (alpha = 0.01) bilinear squares with augmented Lagrangian come to {slow:.2g} on "
            "the finest mesh here, condensed squares of"
            " order 6 to {fast:.2g}, fitted ones to {fitted:.1g}.",
            lambda slow, fast, fitted: fitted < fast < slow,
            slow=least("AL, order 1", "microblock-0.01"),
            fast=least("condensed, order 6", "microblock-0.01"),
            fitted=least("fitted fe", "microblock-0.01"),
        ),
        claim(
            "Of fluxes (traction, micromoment, layer lengths) of the strip, {thin:.0%} are right to 10 % at "
            "order 1 where ell is"
            " below a fifth of an element, {four:.0%} at order 4, and {resolved:.0%} at order 2 where ell is "
            "three elements or"
            " more; `warnings` say so.",
            lambda thin, four, resolved: thin < 0.2 and thin <= four < 0.5 and resolved > 0.9,
            thin=runs("thin_layer_fluxes", below(0.1), order=1, ell_over_h=Range(0, 0.2)),
            four=runs("thin_layer_fluxes", below(0.1), order=4, ell_over_h=Range(0, 0.2)),
            resolved=runs("thin_layer_fluxes", below(0.1), order=2, ell_over_h=Range(3)),
        ),
        claim(
            "One order for all fields locks towards couple stresses: with 2 - beta < 5e-3 the median error "
            "is {one:.2g},"
            " {two:.2g}, {four:.2g} at orders 1, 2, 4, with 2 - beta > 0.05 it is {calm:.2g} at order 1. "
            "Take fitted elements, or"
            " the contact line.",
            lambda one, two, four, calm: one > two > four > 0.1 and one > calm,
            **{
                name: runs("locking_beta_large", middle(), order=order, beta=Range(1.995))
                for name, order in (("one", 1), ("two", 2), ("four", 4))
            },
            calm=runs("locking_beta_large", middle(), order=1, beta=Range(0, 1.95)),
        ),
        claim(
            "And for nu towards 1/2: with 1/2 - nu < 5e-4 and beta < 1 the median error is {one:.2g} at "
            "order 1, {four:.2g} at"
            " order 4, with 1/2 - nu > 0.05 {calm:.2g} at order 1.",
            lambda one, four, calm: one > four and one > calm,
            one=runs("locking_beta_small", middle(), order=1, nu=Range(0.4995)),
            four=runs("locking_beta_small", middle(), order=4, nu=Range(0.4995)),
            calm=runs("locking_beta_small", middle(), order=1, nu=Range(0, 0.45)),
        ),
        claim(
            "Fitted elements nearly always hold what they promise there too: {missed:.1%} of {runs:.0f} runs "
            "exceeded it, at most"
            " {worst:.2g} times the rtol was left, and {refused:.1%} raised a typed error.",
            lambda missed, worst, refused, **_: missed < 0.02 and worst < 3 and refused < 0.05,
            worst=runs(FITTED, worst_ratio("error", "promise")),
            runs=runs(FITTED, count),
            missed=runs(FITTED, share("missed")),
            refused=runs(FITTED, share("typed error")),
        ),
        claim(
            "Blocks rotated by up to 20 degrees cost them nothing: at most {worst:.2g} times the rtol.",
            lambda worst, found: found == 1 and worst < 1,
            worst=runs("turned", worst_ratio("error", "promise"), method="fitted"),
            found=runs("turned", share("delivered"), method="fitted"),
        ),
        claim(
            "Flat elements are harmless, tall ones at the contact are not: with length/height below 0.05 the "
            "median error is"
            " {tall:.2g}, above 1 {flat:.2g}.",
            lambda tall, flat: tall > 2 * flat,
            tall=runs("shape_ground", middle(), aspect=Range(0, 0.05)),
            flat=runs("shape_ground", middle(), aspect=Range(1)),
        ),
        claim(
            "A mesh of your own, refined to an rtol, kept it in {kept:.0%} of {runs:.0f} runs.",
            lambda kept, **_: kept == 1,
            kept=runs("body_asked", share("delivered")),
            runs=runs("body_asked", count),
        ),
    ),
)

CONTACT_TERM = (
    "The contact term: rule, penalty, Newton",
    (
        claim(
            "With the nodal rule the pressure of order 1 is never tensile between its nodes; that of orders "
            "2 to 8 is, by {high:.1%} of the largest pressure"
            " in the median.",
            lambda low, high: low == 0 < high,
            low=runs("oscillation", worst("wrong_sign"), order=1),
            high=runs("oscillation", middle("wrong_sign"), order=(2, 3, 4, 6, 8)),
        ),
        claim(
            "Order 2 oscillates: the alternating part of its nodal pressures is {two:.2%} of the pressure in "
            "the median, of order"
            " 1 {one:.2%}.",
            lambda one, two: two > 3 * one,
            one=runs("oscillation", middle("oscillation"), order=1),
            two=runs("oscillation", middle("oscillation"), order=2),
        ),
        claim(
            "Gauss's rule is no cure: at order 1 {gauss:.1%} alternate and the pressure is tensile by "
            "{pull:.1%}, with the nodal rule"
            " {nodal:.2%} alternate and nothing is tensile.",
            lambda gauss, pull, nodal, none: gauss > nodal and pull > 0 == none,
            gauss=runs("oscillation_rule", middle("oscillation"), order=1, rule="gauss"),
            pull=runs("oscillation_rule", middle("wrong_sign"), order=1, rule="gauss"),
            nodal=runs("oscillation_rule", middle("oscillation"), order=1, rule="nodal"),
            none=runs("oscillation_rule", worst("wrong_sign"), order=1, rule="nodal"),
        ),
        claim(
            "The penalty wants its rho found anew for each mesh: in the strip (32 elements or more) the "
            "median error falls from"
            " {low:.1g} with rho below 1 to {high:.0e} with rho above 1e8 (lambda + 2 mu)/H, and no run up "
            "to 1e10 failed; under"
            " a cylinder {stiff:.0%} of the runs with rho above 1e9 (lambda + 2 mu)/a_Hz end in a typed "
            "error, and {soft:.0%}"
            " with rho below 0.2, where the penetration is as large as the contact.",
            lambda low, high, found, stiff, soft: (
                low > 1e3 * high and found == 1 and stiff > 0.3 and soft > 0.5
            ),
            low=runs("penalty_strip", middle(), rho=Range(0, 1), elements=Range(32)),
            high=runs("penalty_strip", middle(), rho=Range(1e8, 1e10), elements=Range(32)),
            found=runs("penalty_strip", share("delivered"), rho=Range(0, 1e10)),
            stiff=runs("penalty_squares", share("typed error"), rho=Range(1e9)),
            soft=runs("penalty_squares", share("typed error"), rho=Range(0, 0.2)),
        ),
        claim(
            "The augmented Lagrangian gives the same state over twelve decades of rho, to {worst:.0e} in at "
            "most {most:.0f}"
            " iterations.",
            lambda worst, found, decades, **_: worst < 1e-6 and found == 1 and decades > 11.9,
            {"decades": lambda softest, stiffest, **_: math.log10(stiffest / softest)},
            worst=runs(LAGRANGIAN, worst()),
            most=runs(LAGRANGIAN, worst("iterations")),
            found=runs(LAGRANGIAN, share("delivered")),
            softest=runs(LAGRANGIAN, quantile("rho", 0.0)),
            stiffest=runs(LAGRANGIAN, worst("rho")),
        ),
        claim(
            "A body without enough supports raises a typed error, or answers with the right state: "
            "{wrong:.0%} of"
            " {runs:.0f} runs gave a wrong one.",
            lambda wrong, **_: wrong == 0,
            wrong=runs("supports", share(*DEFECTS)),
            runs=runs("supports", count),
        ),
    ),
)

STATES = (
    "Contact states and cells",
    (
        claim(
            "The plain primal-dual active set ends without an answer in {plain:.1%} of {runs:.0f} random "
            "problems; block pivoting"
            " and the path answer all of them.",
            lambda plain, pivoting, path, **_: plain > 0 and pivoting == path == 1,
            plain=runs("states_random", share("typed error"), method="plain"),
            runs=runs("states_random", count, method="plain"),
            pivoting=runs("states_random", share("delivered", "other method"), method="pivoting"),
            path=runs("states_random", share("delivered", "other method"), method="path"),
        ),
        claim(
            "Degenerate ones (weights, gaps and pivots down to 1e-16, copies of nodes) leave a residual of "
            "at most {worst:.0e};"
            " where pivoting stalls the path is followed, and the state says so ({other:.1%} of the runs).",
            lambda worst, **_: worst < 1e-10,
            worst=runs("states_degenerate", worst()),
            other=runs("states_degenerate", share("other method")),
        ),
        claim(
            "Cells asked for an rtol exceeded it in {missed:.0%} of {runs:.0f} runs, alpha from 1e-3 to 3: "
            "at most {worst:.2g}"
            " times the rtol; {refused:.1%} raised a typed error.",
            lambda missed, refused, **_: missed == 0 and refused < 0.05,
            missed=runs("cells_asked", share("missed")),
            refused=runs("cells_asked", share("typed error")),
            runs=runs("cells_asked", count),
            worst=runs("cells_asked", worst_ratio("error", "promise")),
        ),
        claim(
            "Friction was followed through {runs:.0f} histories, f from 0.3 to 10, under a cylinder and on "
            "all of a square's side, by cells and finite elements: {wrong:.0%} are wrong. {refused:.0%} "
            "raised a typed error, which advises a smaller friction or coupled=False, but {few:.0%} of those "
            "with f < 1.9; what was answered has {apart:.2g} of the force in another place than another "
            "method at most.",
            lambda wrong, few, apart, **_: wrong == few == 0 and apart < 0.1,
            runs=runs(FRICTION, count),
            wrong=runs(FRICTION, share(*DEFECTS)),
            refused=runs(FRICTION, share("typed error")),
            few=runs(FRICTION, share("typed error"), friction=Range(0, 1.9)),
            apart=runs("friction_cylinder", worst()),
        ),
        claim(
            "A million cells, two corners each, take {seconds:.0f} s and {memory:.0f} MiB, matrix-free; a "
            "million unknowns of"
            " condensed finite elements {bulk:.0f} s and {more:.0f} MiB.",
            lambda seconds, bulk, cells, unknowns, **_: (
                seconds < bulk and 0.9e6 < unknowns < 1.1e6 and 0.9e6 < cells < 1.1e6
            ),
            seconds=largest("seconds", "cells"),
            memory=largest("megabytes", "cells"),
            bulk=largest("seconds", "condensed, order 1"),
            more=largest("megabytes", "condensed, order 1"),
            cells=largest("contact_nodes", "cells"),
            unknowns=largest("unknowns", "condensed, order 1"),
        ),
    ),
)

PEERS = (
    "Other programs, in the classical limit",
    (
        claim(
            "tamaas, with its best period, reaches 2 % in {rough:.2g} s, 0.5 % in {tamaas:.2g} s and 0.1 % "
            "in {fine:.2g} s, cells here, without one, in {rough_cells:.2g} s, {cells:.2g} s and "
            "{fine_cells:.2g} s.",
            lambda rough, tamaas, fine, rough_cells, cells, fine_cells: (
                rough < rough_cells and cells < 1.1 * tamaas and fine_cells < fine
            ),
            rough=seconds("tamaas", 2e-2, "classical"),
            tamaas=seconds("tamaas", 5e-3, "classical"),
            fine=seconds("tamaas", 1e-3, "classical"),
            rough_cells=seconds("cells", 2e-2, "classical"),
            cells=seconds("cells", 5e-3, "classical"),
            fine_cells=seconds("cells", 1e-3, "classical"),
        ),
        claim(
            "tamaas came to {tamaas:.1g} at its finest (periodic images, cells cut by the edge), cells here "
            "to {cells:.1g}, the"
            " contact line to {line:.1g}.",
            lambda tamaas, cells, line: line < cells < tamaas,
            tamaas=least("tamaas", "classical"),
            cells=least("cells", "classical"),
            line=least("half-plane", "classical"),
        ),
        claim(
            "scikit-fem with a nodal active set, on the same squares, needs {peer:.2g} s for 2 %, condensed "
            "squares {ours:.2g} s"
            " (which carry psi besides).",
            lambda peer, ours: peer < ours,
            peer=seconds("scikit-fem, order 1", 2e-2, "classical"),
            ours=seconds("condensed, order 1", 2e-2, "classical"),
        ),
        claim(
            "NGSolve's ContactBoundary, with the rho that is best on each mesh, comes to 1.05 % in "
            "{peer:.2g} s, fitted finite"
            " elements in {ours:.2g} s, without one.",
            lambda peer, ours: ours < peer,
            peer=seconds(
                tuple(f"ContactBoundary, order {order}" for order in (1, 2, 4)), 1.05e-2, "classical"
            ),
            ours=seconds("fitted fe", 1e-2, "classical"),
        ),
    ),
)

SECTIONS = (HALF_PLANE, BODIES, CONTACT_TERM, STATES, PEERS)
