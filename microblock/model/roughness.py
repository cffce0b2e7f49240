"""What the roughness of surfaces and profiles is called by."""

Statistics = dict[str, float | None]


def of_surface(height: float, slope: float, laplacian: float | None) -> Statistics:
    """Returns rms_height, rms_slope, rms_curvature (half the Laplacian) and nayak from mean squares of
    heights, gradients and Laplacians; None where there is no such value, of a curvature without a Laplacian,
    or of a flat surface.

    Nayak's parameter ``m0 m4/m2^2`` (J. Lubr. Technol. 93 (1971) 398) has the moments of the profiles of an
    isotropic surface, ``m2 = rms_slope^2/2`` and ``m4 = 3/2 rms_curvature^2``.
    """
    if laplacian is None:
        return _statistics(height, slope, None, None)
    nayak = height * (3 / 8 * laplacian) / (slope / 2) ** 2 if slope > 0 else None
    return _statistics(height, slope, laplacian / 4, nayak)


def of_profile(height: float, slope: float, second: float) -> Statistics:
    """Returns the same from mean squares of heights, and of first and second derivatives."""
    return _statistics(height, slope, second, height * second / slope**2)


def _statistics(height: float, slope: float, curvature: float | None, nayak: float | None) -> Statistics:
    """Returns the roots of mean squares, and Nayak's parameter, by their names."""
    statistics: Statistics = {"rms_height": height**0.5, "rms_slope": slope**0.5}
    statistics["rms_curvature"] = None if curvature is None else curvature**0.5
    statistics["nayak"] = nayak
    return statistics
