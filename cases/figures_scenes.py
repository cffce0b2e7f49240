"""Scenes beyond the paper, and what a state costs: figures of cases on the smallest parameters that show what they are about.

Each case says in its header what to look at, and has the full form as a command of its own. The case `frames` is not here: with
fewer positions of a slider than its own it would time other states.
"""

from functools import partial

from cases import classical, coating, hole, punch, rough, scatter, timing, two_faces, wavy, wedge

WAVY = wavy.Parameters(path=0)
COATING = coating.Parameters(thicknesses=(0.1, 0.4, 4.0, 16.0), rtol=1e-2)
HOLE = hole.Parameters(rtols=(0.1, 0.03, 0.01))

# the functions are the cases' own, so that records hold while that case is unchanged, whatever becomes of the others
PLATES = {
    "punch": (partial(punch.records, punch.Parameters(rtol=1e-3, nodes=4000, rtol_fe=0.1)), punch.figure),
    "wedge": (partial(wedge.records, wedge.Parameters(rtol=1e-4, nodes=2000, rtol_fe=0.1)), wedge.figure),
    "two_faces": (partial(two_faces.records, two_faces.Parameters()), two_faces.figure),
    "scatter": (partial(scatter.records, scatter.Parameters(seeds=8, nodes=2048)), scatter.figure),
    "rough": (partial(rough.records, rough.Parameters(nodes=2**15)), rough.figure),
    "wavy": (partial(wavy.records, WAVY), wavy.figure),
    "wavy_path": (partial(wavy.path_records, wavy.Parameters(path_nodes=2048)), wavy.draw_path),
    "coating": (partial(coating.records, COATING), coating.figure),
    "coating_body": (partial(coating.body_records, COATING), coating.body_figure),
    "hole": (partial(hole.records, HOLE), hole.figure),
    "hole_body": (partial(hole.body_records, HOLE), hole.body_figure),
    "classical": (partial(classical.records, classical.Parameters(nodes=(1000, 3000, 10000, 30000))), classical.figure),
    "timing": (partial(timing.records, timing.Parameters(alphas=(0.05, 0.25, 1.0), rtols=(1e-3, 1e-6), repeats=2)),
               timing.figure),
}
CLOCKED = ("timing",)      # its records are times: nothing runs beside it
