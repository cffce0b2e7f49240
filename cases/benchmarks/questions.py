"""Questions of the study `limits`: {question: (map, condition on its runs, where it fails, what to do)}."""

ALMOST_TWO, ALMOST_ZERO = "eta > 30", "eta < 0.03"  # beta = 2 eta/(1 + eta) beyond 1.93, and below 0.06
PANELS, FITTED = "method == 'panels' and ", "method == 'fitted' and "
QUESTIONS = {
    "Do panels keep their promise as the coupling vanishes?": (
        "asked", PANELS + ALMOST_ZERO,
        "nowhere; the second code took too long",
        ""),
    "Do panels keep their promise towards couple stresses?": (
        "asked", PANELS + ALMOST_TWO,
        "nowhere",
        ""),
    "Do panels follow blocks rotated by next to nothing, or by 20 degrees?": (
        "asked", PANELS + "contact in ('rotated', 'levers')",
        "nowhere",
        ""),
    "Do panels keep their promise under wedges, blunt and steep, wide and narrow?": (
        "asked", PANELS + "contact.str.startswith('wedge')",
        "nowhere; the second code took too long",
        ""),
    "Do panels keep their promise where two zones touch?": (
        "event", "kind_of != 'touching'",
        "within 1e-4 of alpha_mid, rtol below 1e-6",
        "ask for 1e-5, or for the load itself: the event of problem.path()"),
    "Do panels keep their promise where the second corner begins to touch?": (
        "event", "kind_of == 'touching'",
        "nowhere",
        ""),
    "Do cells keep the tolerance that they are asked for?": (
        "asked", "method == 'cells'",
        "wedges, rtol below 2e-3",
        "panels"),
    "Does refinement of a user's mesh keep the tolerance that it is asked for?": (
        "asked", "method == 'mesh'",
        "nowhere",
        ""),
    "Do fitted elements keep their promise as the coupling vanishes?": (
        "asked", FITTED + ALMOST_ZERO,
        "nowhere",
        ""),
    "Do fitted elements keep their promise towards couple stresses?": (
        "asked", FITTED + ALMOST_TWO,
        "nowhere",
        ""),
    "Do fitted elements follow blocks that are rotated far?": (
        "asked", FITTED + "contact in ('rotated', 'levers') and psi0 > 0.003",
        "nowhere",
        ""),
    "Do equal squares follow blocks that are rotated far?": (
        "squares", "contact == 'rotated' and psi0 > 0.003",
        "thin layers, low orders",
        "fitted elements"),
    "Are degenerate contact states solved, up to the very degeneracy?": (
        "states", "",
        "nowhere",
        ""),
    "Where is the length of the layer not determined, and is the reason said?": (
        "layer", "",
        "alpha above 0.1, or places outside the contact: the reason is said",
        "read the length of the micropolar mode"),
    "Do squares of one order for all fields lock towards couple stresses?": (
        "squares", ALMOST_TWO,
        "2 - beta below 0.06, at every order",
        "fitted elements, or panels"),
    "Do squares of one order for all fields lock as the coupling vanishes?": (
        "squares", ALMOST_ZERO,
        "1/2 - nu below 0.01, low orders",
        "order 4, fitted elements, or panels"),
    "How wrong are fluxes where a layer is thinner than an element?": (
        "strip", "kind_of == 'al' and ell_over_h < 0.2",
        "elements longer than 5 ell, by 100 % and more",
        "elements of a third of ell at order 2; warnings say so"),
    "Does the shape of the elements of a user's ground change the contact?": (
        "stretched", "",
        "elements more than twice as high as long",
        "flat or square elements at the contact"),
    "Do nodal pressures oscillate, or become tensile between the nodes?": (
        "squares", "order > 1",
        "next to edges of zones between nodes, tension between them",
        "order 1, or fitted elements"),
    "Strip: which rho of the penalty is large enough, and where does it spoil the matrix?": (
        "strip", "kind_of == 'penalty' and ell_over_h > 1",
        "rho H/(lambda + 2 mu) below 10; above 1e7 rounding",
        "the augmented Lagrangian"),
    "Cylinder: which rho of the penalty is large enough, and where does it spoil the matrix?": (
        "newton", "kind_of == 'penalty'",
        "rho a_Hz/(lambda + 2 mu) below 10",
        "the augmented Lagrangian, which needs no rho"),
    "Strip: does the augmented Lagrangian depend on rho?": (
        "strip", "kind_of == 'al' and ell_over_h > 1",
        "nowhere",
        ""),
    "Cylinder: does the augmented Lagrangian depend on rho?": (
        "newton", "kind_of == 'al'",
        "nowhere",
        ""),
    "What becomes of matrices that are singular, or nearly?": (
        "supported", "",
        "too few supports; psi free at beta = 0: an error",
        "fix what the error names"),
    "Up to which friction has contact under a cylinder one answer, and is it said beyond?": (
        "friction", "body != 'square'",
        "friction above 2.5 on a half-plane, above 4 on a block",
        "a smaller friction, or coupled=False"),
    "Up to which friction has contact on all of a square's side one answer?": (
        "friction", "body == 'square'",
        "friction above 2.3",
        "a smaller friction, or coupled=False"),
}  # fmt: skip
