"""The headings of the report: what stands under each, in its order, and what items are called there."""

from . import figures_scenes, figures_studies

# headings of the page, what an outsider should know there, and the items in their order
SECTIONS = {
    "The strip": (
        "A layer of a Cosserat solid between rigid planes; its microstructure is rotated by psi0 at the "
        "surface, so that of each block first one corner touches, later both. The closed form is known.",
        ("fig3", "fig4", "fig5", "fig6", "strip_curvature", "strip_convergence", "strip_table"),
    ),
    "The cylinder": (
        "A rigid cylinder on a half-plane of blocks of the size ell = alpha a_Hz; a_Hz and p_Hz are "
        "half-width and pressure of Hertz's contact without microstructure.",
        ("fig7", "fig8", "fig9", "fig10", "fig11", "coalescence", "facets", "limits_table"),
    ),
    "The layers below": (
        "Microrotation under the cylinder: the contact of the corners is felt within a layer.",
        ("fig12", "fig13", "layers_fe"),
    ),
    "Beyond the paper": (
        "Other obstacles, other bodies, and blocks that are rotated unevenly. Each is a case of its own, "
        "with all options on the command line.",
        (*figures_scenes.FIGURES, "friction_dissipation"),
    ),
    "Methods: speed": (
        "Processor time of one thread, from records that were measured with version 0.2 of this toolkit.",
        ("speed_classical", "speed_law", "speed_cost"),
    ),
    "Methods: limits": (
        "Some three thousand seeded runs, a fifth of them next to a degenerate end of a parameter, each "
        "against a reference of another kind. Which method for which problem: docs/methods.md.",
        ("limits_profile", *(f"limits_{name}" for name in figures_studies.MAPS), "limits_where"),
    ),
    "Methods: sliders": (
        "From a key, or a move of the mouse, to the painted picture of mb.explore, in JupyterLab and "
        "headless Chromium on this machine, from records that were measured while nothing else ran.",
        ("sliders",),
    ),
}
# what items are called whose names do not say enough
LABELS = {
    "paper_and_here": "the paper and here",
    "coalescence": "the mesh and alpha_mid",
    "facets": "between the nodes",
    "limits_table": "limits and symmetries",
    "layers_fe": "layers by finite elements",
    "strip_table": "strip: computed and closed form",
    "strip_curvature": "the curvature term",
    "strip_convergence": "convergence in the strip",
    "speed_classical": "the classical limit",
    "speed_law": "the microblock law",
    "speed_cost": "time and memory over size",
    "limits_profile": "errors over promises",
    "limits_where": "what fails where",
    "limits_coalescence": "where two zones touch",
    "limits_cells": "cells under a cylinder",
    "limits_touching": "where the second corner touches",
    "limits_layer_fit": "the fit of the layer",
    "limits_penalty": "penalty and augmented Lagrangian",
    "limits_supports": "supports of a body",
    "limits_friction": "how large friction may be",
    "sliders": "sliders of mb.explore",
    "classical": "the classical limit of obstacles",
    "punch": "a punch",
    "wedge": "a wedge",
    "wavy": "a wave",
    "rough": "a rough obstacle",
    "scatter": "unevenly rotated blocks",
    "two_faces": "a strip with two faces",
    "coating": "an elastic layer",
    "hole": "a block with a hole",
    "two_bodies": "two bodies that deform",
    "tangential": "a cylinder with friction",
    "friction_dissipation": "what a cycle of shear dissipates",
    "sphere_size": "a sphere, over the size of blocks",
    "rough3d": "a rough surface",
}
