"""Cylinder on rigid square blocks with elastic interfaces, beside the continuum with identified moduli.

Lengths are over a_Hz, the half-width at the load 1; forces on a block are over p_Hz b and couples over
p_Hz b^2, b the side of a block. Differences are in L2 over the blocks, over the norm of the values of blocks.
"""

import numpy as np

from cases import lattice
from cases.lattice import figure  # noqa: F401  that of the script
from cases.lattice_blocks import identified
from microblock.errors import BadArgument

from . import POSITIVE, require_ranges

RANGES = {"blocks_per_a": (1, 256), "far": (0, 1000), "loads": POSITIVE}


def solve(blocks_per_a=8.0, spring: tuple[float, float] = (1.0, 1.0), far=9.0, loads=(1.0,)):
    """Returns the states at each load, {name: State}, of the blocks and of the continua.

    Parameters
    ----------
    blocks_per_a : blocks on Hertz's half-width at the load 1, 1 to 256
    spring : normal and shear stiffness of the interfaces per length, times b
    far : half of the period of the Fourier sums over a_Hz, at most 1000
    loads : multiples of the load with the half-width a_Hz
    """
    require_ranges(locals(), RANGES)
    if len(spring) != 2 or not 0 < max(spring) <= 100 * min(spring):
        raise BadArgument("spring", spring, "must be two positive stiffnesses, at most a factor 100 apart")
    if 1.2 * max(loads) ** 0.5 * blocks_per_a > 512:
        raise BadArgument(
            "loads", loads, "press on over 512 blocks on either side; take fewer --blocks-per-a"
        )
    return lattice.solve(blocks_per_a, spring, far, loads)


def compared(kind, states):
    """Values on the blocks, of the continua, and the differences; `kind` is 0 for forces, 1 for couples."""
    blocks = states["blocks"]
    values = {name: lattice.on_blocks(state, blocks)[kind] for name, state in states.items()}
    exact = values.pop("blocks")
    if kind:
        values.pop("microclamped", None)  # its couples are reactions
    differences = {
        name: np.linalg.norm(value - exact) / np.linalg.norm(exact) for name, value in values.items()
    }
    return {
        "blocks": exact,
        "continuum": values.get("microblock"),
        "derived": values.get(lattice.DERIVED),
        "difference": differences.get("microblock"),
        "differences": differences,
    }


def to_dict(result):
    """Returns the JSON object: moduli, and states with the forces and couples on the blocks."""
    springs = result[0]["blocks"].problem.body.springs
    states = [
        {
            "load": states["blocks"].load / (np.pi / 4 * springs.E_star),
            "half_width": {name: state.half_width for name, state in states.items()},
            "residual": states["blocks"].residual,
            "x": states["blocks"].x,
            "forces": compared(0, states),
            "couples": compared(1, states),
        }
        for states in result
    ]
    return {
        "moduli": {
            name: {"value": value, "closed_form": springs.moduli[name], "residual": residual}
            for name, (value, residual) in identified(springs).items()
        },
        "decay": springs.decay,
        "full_contact_couple": springs.full_contact_couple,
        "forces": states[-1]["forces"],
        "couples": states[-1]["couples"],
        "states": states,
        "reason": None
        if lattice.DERIVED in result[-1]
        else "unequal springs: the solid of long waves is not isotropic, as the half-plane has to be",
    }
