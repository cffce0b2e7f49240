"""
Size effects beside published ones
==================================
Cosserat solids stiffen under small contacts, by a factor that is bounded; published materials do so by less,
by far more in bending, or the other way round.

What was published, as far as summaries say:

- Dense foams of closed cells have a relatively small coupling number, and size effects of *a factor 1.4 or
  less*; designed lattices have *more than a factor of 35* (R. S. Lakes, rodlakes.com/Conclusion.html).
- A lattice of triangular cells has 29 times the bending rigidity of a classical bar, and a bending length
  :math:`\\ell_b` of 8.8 mm (Z. Rueger and R. S. Lakes, Phys. Rev. Lett. 120, 065501, 2018).
- The modulus of an elastic polymer is constant under a sphere between depths of 5 and 25 micrometres, and
  rises under a pyramid where depths are small (J. Polym. Eng. 36, 103, 2016).
- Networks of filaments follow Hertz under spheres with radii above 12 segments. Below they seem softer, and
  the exponent of load over depth is above 3/2 (J. Merson, N. Parvez and R. C. Picu, Acta Biomater.,
  doi:10.1016/j.actbio.2022.03.053).

What fits: without corners the factor is at most :math:`3 - 2 \\nu`, and 1.4 needs a coupling number :math:`N`
of 0.53 alone; a cone feels the blocks more than a sphere does. What does not fit: the lattice is 29 times as
stiff at a thickness below :math:`\\ell_b`, where there is no continuum; and networks soften. A Cosserat solid
cannot, since its rotations store energy besides.

:Geometry:  half-space, rigid sphere or cone; a plate in plane bending
:Equations: (10)-(17), gaps of one or of four corners, conditions (26)
:Method:    square cells of the surface, to an error of the load
:Reference: :math:`1 + (1 - \\nu) \\beta`, the stiffness of a surface without corners under short waves
:Units:     :math:`E^* = 1`; the radius of the classical contact is 1
"""

import math

import matplotlib.pyplot as plt
import numpy as np

import microblock as mb

R = 10.0  # radius of the sphere
SLOPE = 0.1  # of the cone
COUPLE_STRESS = 1.999  # beta, next to its limit of a psi that is the rotation of the material
LATTICE = 29.0, 8.8  # bending rigidity over the classical one, and ell_b in mm
NETWORK = 12.0  # radius of a sphere over the length of a segment, from which on Hertz holds
REACH = 0.2  # radius of the contact over that of the sphere, at which it is compared
DEPTHS = np.array((1.0, 0.6, 0.36, 0.2))  # of 25 micrometres

# %%
# The modulus that someone infers from load and depth by the classical formula, over that of large contacts


def modulus(alpha, law, nu, beta, shape="sphere"):
    """Apparent modulus over E*, and exponent of the load over the depth, of blocks of the size `alpha`."""
    solid = mb.Cosserat(E=1 - nu**2, nu=nu, ell=alpha, beta=beta)
    obstacle = mb.Sphere(R) if shape == "sphere" else mb.Cone(SLOPE)
    load = 4 / (3 * R) if shape == "sphere" else math.pi / 2 * SLOPE
    state = mb.Contact(mb.HalfSpace(solid), obstacle, law).solve(load=load, rtol=3e-3, accuracy="load")
    if shape == "sphere":
        apparent = 3 * load / (4 * math.sqrt(R) * state.approach**1.5)
    else:
        apparent = math.pi * SLOPE * load / (2 * state.approach**2)
    return apparent, state.stiffness * state.approach / load


def bending(thickness, ell_b, nu):
    """Bending rigidity of a plate in plane strain over the classical one, whose microrotation is that of the
    material: couples of the modulus 4 ell_b^2 mu add to E h^3/12/(1 - nu^2), at any coupling.
    """
    return 1 + 24 * (1 - nu) * (ell_b / thickness) ** 2


def solve(alphas=(0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 100.0), deepest=0.1, nu=0.3, beta=1.0):
    """Returns apparent moduli and exponents over the size of blocks and over the depth.

    Parameters
    ----------
    alphas : sizes of a block over the radius of the classical contact
    deepest : the same of the largest of the depths, under the sphere and under the cone
    nu : Poisson's ratio, -1 < nu < 1/2
    beta : coupling number 2 eta/(1 + eta), 0 < beta < 2
    """
    laws = {
        "microblocks": (mb.Microblock(), beta),
        "no corners": (mb.Unilateral(), beta),
        "no corners, couple stress": (mb.Unilateral(), COUPLE_STRESS),
    }
    sizes = {
        name: np.array([modulus(alpha, law, nu, coupling) for alpha in alphas])
        for name, (law, coupling) in laws.items()
    }
    # contact radii go like the root of the depth under a sphere, and like the depth under a cone
    by_depth = {
        shape: [modulus(deepest / depth**power, mb.Unilateral(), nu, beta, shape)[0] for depth in DEPTHS]
        for shape, power in (("sphere", 0.5), ("cone", 1.0))
    }
    rigidity, ell_b = LATTICE
    thickness = ell_b * math.sqrt((bending(1.0, 1.0, nu) - 1) / (rigidity - 1))
    networks = {
        name: modulus(1 / (REACH * NETWORK), law, nu, coupling) for name, (law, coupling) in laws.items()
    }
    limits = {"no corners": 1 + (1 - nu) * beta, "no corners, couple stress": 3 - 2 * nu}
    return {
        "alphas": np.array(alphas),
        "sizes": sizes,
        "limits": limits,
        "by_depth": by_depth,
        "thickness": thickness,
        "networks": networks,
    }


# %%
# Moduli over the size of the contact (a), and over the depth (b)


def figure(result):
    """Apparent moduli with their limits, and where networks begin to soften (a); over the depth (b)."""
    drawing, (left, right) = plt.subplots(1, 2, figsize=(7.0, 3.2), layout="constrained")
    for number, (name, found) in enumerate(result["sizes"].items()):
        left.loglog(1 / result["alphas"], found[:, 0], "o-", color=f"C{number}", label=name)
        if name in result["limits"]:
            left.axhline(result["limits"][name], color=f"C{number}", linestyle=":")
    left.axvline(REACH * NETWORK, color="0.6", linestyle="--", label="networks soften to the left")
    left.set(xlabel=r"$a/\ell$", ylabel="apparent modulus over $E^*$", yticks=[1, 2, 3, 4])
    left.set_yticklabels(["1", "2", "3", "4"])
    left.minorticks_off()
    for number, (shape, moduli) in enumerate(result["by_depth"].items()):
        right.plot(DEPTHS, moduli, "o-", color=f"C{number + 3}", label=f"{shape}, no corners")
    right.set(xlabel="depth over the largest", ylabel="apparent modulus over $E^*$")
    drawing.legend(loc="outside upper center", ncols=3)
    return drawing


if __name__ == "__main__":
    result = solve()
    for name, limit in result["limits"].items():
        print(f"{name}: {result['sizes'][name][-1, 0]:.4f} of E*, limit {limit:.4f}")
    print(f"a plate bends {LATTICE[0]:g} times as stiffly at {result['thickness']:.1f} mm")
    for name, (apparent, exponent) in result["networks"].items():
        print(f"{name}, sphere of 12 blocks: {apparent:.3f} of E*, exponent {exponent:.3f}")
    for shape, moduli in result["by_depth"].items():
        print(f"{shape}, from the largest depth to a fifth: {moduli[-1] / moduli[0]:.3f}")
    figure(result)
    plt.show()
