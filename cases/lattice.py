"""
Cylinder on rigid blocks with elastic interfaces
================================================
The forces on real blocks are those of the contact law; where both corners touch, their couples are about four
times as large.

A continuum does not know the height of a block. The equilibrium of the blocks at the surface gives a larger
coefficient of the couple. A continuum with this coefficient has the couples of the blocks,
except at the ends of the contact, where the pressure changes within a block.

:Geometry:  half-plane of blocks of side b, joined by interfaces with normal and shear springs; rigid cylinder
:Equations: balance of forces and couples on each block; conditions (26) on each corner
:Method:    Fourier sums along the surface of the blocks; panels on the continuum, averaged over each block
:Reference: moduli of long waves, :math:`\\nu = 0`, :math:`\\beta = 1`, :math:`\\gamma' = 1/6`
:Units:     :math:`a_\\mathrm{Hz} = R = 1` at the load 1: lengths over :math:`a_\\mathrm{Hz}`, forces over
            :math:`p_\\mathrm{Hz} b`, couples over :math:`p_\\mathrm{Hz} b^2`
"""

import math

import matplotlib.pyplot as plt
import numpy as np

import microblock as mb
from cases.hertz import LAWS
from cases.lattice_blocks import BlockHalfPlane, Springs

DERIVED = "microblock, derived couple"


# %%
# The blocks and beside them, where equal springs make it isotropic, the continuum of long waves under three
# laws, and that with the derived couple.
def problems(blocks_per_a, spring, far, reach, shift):
    """Contact problems, {name: Contact}; blocks up to the distance `reach` may touch."""
    springs, b = Springs(*spring), 1 / blocks_per_a
    waves, derived = (
        mb.Cosserat.of_blocks(b, springs.normal / b, couples=couples) for couples in (False, True)
    )
    x = (np.arange(-math.ceil(reach / b), math.ceil(reach / b) + 1) + shift) * b
    blocks = BlockHalfPlane(waves, springs, x, period=2 * math.ceil(far / b))
    contacts = {"blocks": mb.Contact(blocks, mb.Cylinder(R=1.0), mb.Microblock())}
    if math.isclose(*spring, rel_tol=1e-12):
        contacts |= {
            name: mb.Contact(mb.HalfPlane(waves), mb.Cylinder(R=1.0), law()) for name, law in LAWS.items()
        }
        contacts[DERIVED] = mb.Contact(mb.HalfPlane(derived), mb.Cylinder(R=1.0), mb.Microblock())
    return contacts


def solve(blocks_per_a=8.0, spring=(1.0, 1.0), far=9.0, loads=(1.0,), shift=0.0):
    """Returns the states at each load, {name: State}, of the blocks and of the continua.

    Parameters
    ----------
    blocks_per_a : blocks on Hertz's half-width at the load 1
    spring : normal and shear stiffness of the interfaces per length, times b
    far : half of the period of the Fourier sums over a_Hz
    loads : multiples of the load with the half-width a_Hz
    shift : place of the middle block over b, 0 under the apex, 1/2 for a joint there
    """
    reach, P = 1.2 * math.sqrt(max(loads)) + 3 / blocks_per_a, math.pi / 4 * Springs(*spring).E_star
    if far < 2 * reach:
        raise mb.BadArgument("far", far, f"must be at least {2 * reach:g} for these blocks and loads")
    contacts = problems(blocks_per_a, spring, far, reach, shift)
    return [
        {
            name: contact.solve(load=load * P, rtol=None if name == "blocks" else 1e-6)
            for name, contact in contacts.items()
        }
        for load in loads
    ]


def on_blocks(state, blocks):
    """Forces and couples, over p_Hz b and p_Hz b^2, that a state has on the n blocks of another: (2, n)."""
    x, b, p_Hz = blocks.x, blocks.solid.ell, blocks.problem.body.springs.E_star / 2
    if state is blocks:
        return np.array([state.pressure, state.micromoment / b]) / p_Hz
    points = (x[:, None] + b * (np.arange(0.5, 4000) / 4000 - 0.5)).ravel()
    corners = [state.pressure_at(points, name).reshape(len(x), -1).mean(axis=1) for name in state.pressures]
    return np.array([sum(corners), (corners[0] - corners[-1]) / 2]) / p_Hz


def figure(states):
    """Forces and couples on the blocks at the last load, beside those of the continua."""
    drawing, axes = plt.subplots(2, 1, sharex=True, figsize=(3.54, 3.6), layout="constrained")
    blocks, looks = states[-1]["blocks"], {"microblock": "-", DERIVED: "--", "blocks": "o"}
    for name in [name for name in looks if name in states[-1]]:
        for axis, values in zip(axes, on_blocks(states[-1][name], blocks)):
            axis.plot(blocks.x, values, looks[name], label=name)
    axes[0].set(ylabel=r"force$/(p_\mathrm{Hz} b)$")
    axes[1].set(xlabel=r"$x_1/a_\mathrm{Hz}$", ylabel=r"couple$/(p_\mathrm{Hz} b^2)$")
    drawing.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=2)
    return drawing


if __name__ == "__main__":
    states = solve()
    print("half-widths", {name: round(state.half_width, 4) for name, state in states[-1].items()})
    figure(states)
    plt.show()
