"""What a state shows: layer lengths from surface values and fluxes, relative errors."""

import numpy as np

NEGLIGIBLE = 1e-13   # of the natural scale: some hundred rounding errors


def layer_lengths(solid, psi, u1, micromoment, pressure):
    """Layer lengths L_psi and L_u, field over derivative at a surface free of shear, (48).

    The derivatives come from the fluxes, not from differentiating the fields: psi' from
    ``M = gamma' ell^2 mu psi'`` and u1' from ``sigma_12 = (mu + mu_c) u1' + 2 mu_c psi = 0``.

    Parameters
    ----------
    psi, u1, micromoment, pressure : float, at the surface

    Returns
    -------
    (L_psi, L_u), or (None, None) where M is nothing but rounding beside ell times the pressure
    """
    if abs(micromoment) <= NEGLIGIBLE*solid.ell*abs(pressure):
        return None, None
    slope_psi = micromoment/(solid.curvature*solid.ell**2*solid.mu)
    slope_u = -2*solid.mu_c*psi/(solid.mu + solid.mu_c)
    return psi/slope_psi, u1/slope_u


def relative_error(values, reference, weights, scale):
    """Relative L2 error of `values` against `reference` in a quadrature rule.

    Where the reference vanishes, up to rounding of `scale`: 0 if the values do too, else None.
    """
    def norm(field):
        return float(np.sqrt(weights @ np.sum(np.atleast_2d(field)**2, axis=0)))

    error, size = norm(np.subtract(values, reference)), norm(reference)
    if size > NEGLIGIBLE*scale:
        return error/size
    return 0.0 if error <= NEGLIGIBLE*scale else None
