"""The questions of the study `limits`: {question: (map, condition on its runs, where it fails, what to do)}."""

ALMOST_TWO, ALMOST_ZERO = "eta > 30", "eta < 0.03"  # beta = 2 eta/(1 + eta) beyond 1.93, and below 0.06
PANELS, FITTED = "method == 'panels' and ", "method == 'fitted' and "
EQUAL = "rule == 'nodal' and "
QUESTIONS = {
    "Do panels keep their promise as the coupling vanishes?": (
        "asked", PANELS + ALMOST_ZERO, "", ""),
    "Do panels keep their promise towards couple stresses?": (
        "asked", PANELS + ALMOST_TWO, "", ""),
    "Do panels follow blocks rotated by next to nothing, or by 20 degrees?": (
        "asked", PANELS + "contact in ('rotated', 'levers')", "", ""),
    "Do panels keep their promise under wedges, blunt and steep, wide and narrow?": (
        "asked", PANELS + "contact.str.startswith('wedge')", "", ""),
    "Do panels keep their promise where two zones touch?": (
        "event", "kind_of != 'touching'", "", ""),
    "Do panels keep their promise where the second corner begins to touch?": (
        "event", "kind_of == 'touching'", "", ""),
    "Do cells keep the tolerance that they are asked for?": (
        "asked", "method == 'cells'", "", ""),
    "Does refinement of a user's mesh keep the tolerance that it is asked for?": (
        "asked", "method == 'mesh'", "", ""),
    "Do fitted elements keep their promise as the coupling vanishes?": (
        "asked", FITTED + ALMOST_ZERO, "", ""),
    "Do fitted elements keep their promise towards couple stresses?": (
        "asked", FITTED + ALMOST_TWO, "", ""),
    "Do fitted elements follow blocks that are rotated far?": (
        "asked", FITTED + "contact in ('rotated', 'levers') and psi0 > 0.05", "", ""),
    "Do equal squares follow blocks that are rotated far?": (
        "squares", EQUAL + "contact == 'rotated' and psi0 > 0.05", "", ""),
    "What does a plain active set do that block pivoting and the path do not?": (
        "states", "method == 'plain'", "", ""),
    "Are degenerate contact states solved, up to the very degeneracy?": (
        "states", "method != 'plain'", "", ""),
    "Where is the length of the layer not determined, and is the reason said?": (
        "layer", "", "", ""),
    "Do squares of one order for all fields lock towards couple stresses?": (
        "squares", EQUAL + ALMOST_TWO, "", ""),
    "Do squares of one order for all fields lock as the coupling vanishes?": (
        "squares", EQUAL + ALMOST_ZERO, "", ""),
    "How wrong are fluxes where a layer is thinner than an element?": (
        "strip", "kind_of == 'al' and ell_over_h < 0.2", "", ""),
    "Does the shape of the elements of a user's ground change the contact?": (
        "stretched", "", "", ""),
    "Do nodal pressures oscillate, or become tensile between the nodes?": (
        "squares", EQUAL + "order > 1 and tension > 0.01", "", ""),
    "Is Gauss's rule steadier than the nodal rule?": (
        "squares", "rule == 'gauss'", "", ""),
    "Strip: which rho of the penalty is large enough, and where does it spoil the matrix?": (
        "strip", "kind_of == 'penalty' and ell_over_h > 1", "", ""),
    "Cylinder: which rho of the penalty is large enough, and where does it spoil the matrix?": (
        "newton", "kind_of == 'penalty'", "", ""),
    "Strip: does the augmented Lagrangian depend on rho?": (
        "strip", "kind_of == 'al' and ell_over_h > 1", "", ""),
    "Cylinder: does the augmented Lagrangian depend on rho?": (
        "newton", "kind_of == 'al'", "", ""),
    "What becomes of matrices that are singular, or nearly?": (
        "supported", "", "", ""),
    "Up to which friction has contact under a cylinder one answer, and is it said beyond?": (
        "friction", "body != 'square'", "", ""),
    "Up to which friction has contact on all of a square's side one answer?": (
        "friction", "body == 'square'", "", ""),
}  # fmt: skip
