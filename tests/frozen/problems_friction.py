"""Problems of friction in plain data: seeded systems of a few nodes, and histories."""

import numpy as np

SEED = 20261123
SETS = {"random": 300, "two corners": 220, "line": 260, "wedged": 120}  # systems
LEAST = 0.05  # eigenvalue of a compliance over the largest, times its size
WEDGED = ((0.5, 3.0), 3.0, 0.003)  # friction, coupling and LEAST of the last set: some answers are not unique


def system(name, number):
    """{compliance, gaps, friction, path, coupled} of a seeded system of 2 to 12 nodes.

    The compliance (corners n + n, corners n + n) gives what corner forces, one corner after the other, and
    tangential forces add to the gaps (corners, n), and the tangential displacements; the path has pairs of
    loads (P, Q).
    """
    draw = np.random.default_rng((SEED, list(SETS).index(name), number))
    n, corners = int(draw.integers(2, 13)), 1 + (name == "two corners" or number % 3 == 0)
    make = _at_random if name in ("random", "two corners") else _on_a_line
    limits, *strong = WEDGED if name == "wedged" else ((0.05, 0.9),)
    friction = float(draw.uniform(*limits))
    gaps = draw.exponential(draw.choice([0.1, 0.3, 1.0]), size=(corners, n))
    if draw.random() < 0.1:
        gaps[-1, draw.integers(n)] = np.inf
    return {
        "compliance": make(draw, corners, n, *strong),
        "gaps": gaps - gaps.min(),
        "friction": friction,
        "path": _path(draw, friction, n),
        "coupled": bool(draw.random() < 0.8),
    }


def _at_random(draw, corners, n):
    """Positive definite; the coupling is a share of what a full random matrix has."""
    size = (corners + 1) * n
    root = draw.normal(size=(size, size))
    return _coupled(root @ root.T / size + 0.1 * np.eye(size), draw.uniform(0.1, 1.0), n)


def _on_a_line(draw, corners, n, coupling=1.0, least=LEAST):
    """Responses that fall with the distance on a line, those of the coupling odd in it."""
    x = np.sort(draw.uniform(0, 3, size=n))
    apart = x[:, None] - x
    even, odd = np.exp(-np.abs(apart)), np.sign(apart) * np.exp(-np.abs(apart))
    signs = (1.0, -1.0)[:corners]
    turned = draw.uniform(0.1, 0.9) * np.exp(-2 * np.abs(apart))
    normal = np.block([[even + a * b * turned for b in signs] for a in signs]) + 0.1 * np.eye(corners * n)
    cross = np.hstack([draw.uniform(0.5, 1.0) * odd + a * turned for a in signs])
    whole = np.block([[normal, cross.T], [cross, draw.uniform(0.7, 1.5) * even + 0.1 * np.eye(n)]])
    for share in coupling * 0.9 ** np.arange(50):
        found = _coupled(whole, share, n)
        values = np.linalg.eigvalsh(found)
        if values[0] > least * values[-1] / len(values):
            return found
    raise ValueError("no coupling is small enough")


def _coupled(whole, share, n):
    """The compliance with its coupling times a share."""
    found = whole.copy()
    found[-n:, :-n] *= share
    found[:-n, -n:] *= share
    return found


def _path(draw, friction, n):
    """Two to five pairs (P, Q): pressing, then both forces up, down, back, or over to full slip."""
    P, found = n * draw.uniform(0.2, 1.0), []
    if draw.random() < 0.7:
        found.append((P, 0.0))
    for _ in range(draw.integers(2, 6) - len(found)):
        P = P * (1.0 if draw.random() < 0.5 else draw.uniform(0.4, 1.6))
        found.append((P, float(np.clip(draw.uniform(-1.15, 1.15), -1, 1)) * friction * P))
    return found
