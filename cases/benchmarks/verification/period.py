"""A second code for frictionless contact on a half-plane with a period: a row of equal cells of `space`,
under a surface that is the same all along x2. No library.
"""

from . import space


def pressures(height, period, n, solid, law, load):
    """Places x (n,), and the pressures there: (1, n), or (2, n) of "microblock", whose arms are ell/2."""
    E, nu, beta, ell = solid
    mu = E / 2 / (1 + nu)
    model = space.Model(lambda x, _: height(ell * x) / ell, [], (n, 1), nu, beta, law, period / ell)
    forces = space.gradients(model, load / mu * period / ell**2, 1e-9, 4000).forces[0][:, :, 0]
    sides = 2 if law == "microblock" else 1  # of the blocks; each of them has two corners along x2
    return ell * model.islands[0].x, mu * forces.reshape(sides, -1, n).sum(axis=1)
