"""Contact problems beyond the paper: figures of cases on the smallest parameters that show
what they are about.

Each case says in its header what to look at, and is a command with all options.
"""

from ..common.case import figure_of
from ..scenes import (
    classical,
    coating,
    hole,
    punch,
    rough,
    rough3d,
    scatter,
    sphere_size,
    tangential,
    two_bodies,
    two_faces,
    wavy,
    wedge,
)

FIGURES = {
    "classical": figure_of(classical, "classical", nodes=(1000, 3000, 10000, 30000)),
    "punch": figure_of(punch, "punch", rtol=1e-3, nodes=4000, rtol_fe=0.1),
    "wedge": figure_of(wedge, "wedge", rtol=1e-4, nodes=2000, rtol_fe=0.1),
    "wavy": figure_of(wavy, "wavy", path_nodes=2048),
    "rough": figure_of(rough, "rough", nodes=2**15),
    "scatter": figure_of(scatter, "scatter", seeds=8, nodes=2048),
    "two_faces": figure_of(two_faces, "two_faces"),
    "coating": figure_of(coating, "coating", thicknesses=(0.1, 0.2, 0.4, 4.0, 8.0, 16.0)),
    "hole": figure_of(hole, "hole", rtols=(0.1, 0.03, 0.01)),
    "two_bodies": figure_of(two_bodies, "two_bodies"),
    "tangential": figure_of(tangential, "tangential", rtol=0.03),
    "sphere_size": figure_of(sphere_size, "sphere_size", alphas=(0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 4.0)),
    "rough3d": figure_of(rough3d, "rough3d", cells=128),
}
