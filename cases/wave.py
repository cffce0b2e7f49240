"""
Wavy surface, from first touch to full closure
==============================================
Under a rigid wave, microblocks of a twentieth of its length close with both corners only at 1.33 times the
mean pressure that closes a classical solid.

:Geometry:  half-plane :math:`x_2 < 0`; a rigid cosine of the length :math:`\\lambda` and the amplitude
            :math:`\\Delta`, pressed down by a mean pressure
:Equations: (10)-(18) in the solid, corner gaps (20)-(22), contact conditions (26)
:Method:    a period of uniform cells, products by Fourier transforms (``Cells``)
:Reference: Westergaard: classical contact of the length :math:`2a` at :math:`\\bar p = \\sin^2(\\pi
            a/\\lambda)`; microblocks: full closure in closed form
:Units:     lengths over :math:`\\lambda`, pressures over :math:`\\pi E^* \\Delta/\\lambda`, the mean
            pressure of classical closure
"""

import math

import matplotlib.pyplot as plt
import numpy as np

import microblock as mb

AMPLITUDE = 1e-3  # drops out: the problem is linear in amplitude and load together


def solve(ell_over_wavelength=0.05, nu=0.3, beta=1.0, nodes=1024, last=1.5, loads=30):
    """States of microblocks and of a classical solid (beta = 0) at mean pressures up to `last`.

    Parameters
    ----------
    ell_over_wavelength : side of a block over the wavelength
    nu : Poisson's ratio
    beta : coupling of rotations, between 0 and 2
    nodes : cells of a period
    last : the largest mean pressure, over that of classical closure
    loads : number of mean pressures
    """
    if loads < 1:
        raise mb.BadArgument("loads", loads, "must be at least 1")
    E = (1 - nu**2) / (math.pi * AMPLITUDE)  # which makes the unit of pressure 1
    result = {}
    for name, law, coupling in (("microblocks", mb.Microblock(), beta), ("classical", mb.Unilateral(), 0.0)):
        body = mb.HalfPlane(mb.Cosserat(E=E, nu=nu, ell=ell_over_wavelength, beta=coupling), period=1.0)
        problem = mb.Contact(body, mb.Wave(AMPLITUDE, wavelength=1.0), law, mb.Cells(nodes=nodes))
        result[name] = [problem.solve(load=load) for load in np.linspace(0, last, loads + 1)[1:]]
    return result


def in_contact(states, corners):
    """Lengths in contact over the wavelength: with `np.min` of all corners, with `np.max` of any."""
    return [np.mean(corners(list(state.pressures.values()), axis=0) > 0) for state in states]


def figure(result):
    """Length in contact over the mean pressure."""
    drawing, axis = plt.subplots(figsize=(3.54, 3.2), layout="constrained")
    loads = [state.load for state in result["classical"]]
    fine = np.linspace(0, loads[-1], 1000)
    westergaard = 2 / math.pi * np.arcsin(np.sqrt(np.minimum(fine, 1)))
    axis.plot(fine, westergaard, "0.5", label="classical, Westergaard")
    for name, corners, look, words in (
        ("classical", np.max, "ks", "classical"),
        ("microblocks", np.max, "C0.-", "microblocks, one corner or both"),
        ("microblocks", np.min, "C1.-", "microblocks, both corners"),
    ):
        axis.plot(loads, in_contact(result[name], corners), look, markersize=3, label=words)
    axis.set(
        xlabel=r"mean pressure, $\bar p\,\lambda/(\pi E^*\Delta)$", ylabel=r"length in contact over $\lambda$"
    )
    drawing.legend(loc="outside upper center")
    return drawing


if __name__ == "__main__":
    result = solve()
    print(*result["microblocks"], sep="\n")
    figure(result)
    plt.show()
