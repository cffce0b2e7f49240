"""
Three findings
==============
Under a cylinder blocks touch with both corners in the middle of the contact, and with one corner beside it.

:Geometry:  half-plane whose surface consists of blocks of side :math:`\\ell`, pressed by a cylinder
:Equations: (10)-(18) in the solid, corner gaps (20)-(22), contact conditions (26)
:Method:    panels on the contact line
:Reference: :math:`\\alpha_\\mathrm{mid} = 0.8874` of the paper, Hertz, the layer length :math:`\\ell`
:Units:     any that go together
"""

import math

import numpy as np

from cases.hertz import P, a_Hz, problem

paper = 0.8874  # alpha_mid of the paper


def solve(alpha=0.25, wide=1.0, thin=0.05, rtol=1e-4):
    """Returns a state and three sentences.

    Parameters
    ----------
    alpha : side of a block over a_Hz of the state
    wide, thin : sides of a block over a_Hz for which hardness and layer are told
    rtol : relative error of pressure and micromoment
    """
    state = problem(alpha).solve(load=P, rtol=rtol)
    alpha_mid = alpha * math.sqrt(P / problem(alpha).path(load=P, rtol=rtol).events[-1].load)
    laws = "microblock", "unilateral"
    corners, plain = (a_Hz / problem(wide, contact=law).solve(load=P, rtol=rtol).half_width for law in laws)
    layers = [problem(thin, contact=law).solve(load=P, rtol=rtol) for law in laws]
    points = a_Hz * np.array([(0.3, 0.3), (-0.5 * thin, -1.5 * thin)])
    upper, lower = np.subtract(*(layer.fields(*points).psi for layer in layers))
    sentences = (
        f"The contact splits in two if blocks are larger than {alpha_mid:.4f} a_Hz, the half-width of Hertz' "
        f"contact. The paper reports {paper}; the {100 * (paper / alpha_mid - 1):.0f} % excess is a mesh "
        "effect.",
        f"The two laws show opposite size effects. At the side {wide:g} a_Hz of the blocks the apparent "
        f"hardness is {corners:.3f} of Hertz' with the corners of microblocks, and {plain:.3f} without "
        "corners.",
        f"Corners are felt in a layer as thick as a block. Below full contact, with blocks of {thin:g} a_Hz, "
        f"their effect falls by the factor {upper / lower:.2f} over the depth of a block.",
    )
    return {"state": state, "sentences": sentences}


def figure(result):
    """Returns the blocks that the cylinder rotates, and the pressures of their corners."""
    state = result["state"]
    drawing = state.plot_blocks()
    drawing.set(size_inches=(4.4, 3.7), layout_engine=None)
    drawing.suptitle("")
    blocks = drawing.axes[0]
    blocks.spines["bottom"].set_visible(False)
    blocks.set(xticks=[], xlabel="", position=(0.13, 0.48, 0.85, 0.34))
    below = drawing.add_axes((0.13, 0.13, 0.85, 0.36), xlim=blocks.get_xlim())
    x = np.linspace(*below.get_xlim(), 801)
    for corner, style in (("A", "-"), ("B", "--")):
        below.plot(x, state.pressure_at(x, corner), style, label=f"$p_{corner}$")
    below.plot(x, state.pressure_at(x), color="0.45", linewidth=0.8, label="$p_A + p_B$")
    below.set(xlabel="$x_1$ (length)", ylabel="pressure (stress)", ylim=(0, None))
    below.legend(loc="upper left", handlelength=1.2)
    return drawing


if __name__ == "__main__":
    result = solve()
    print(*result["sentences"], sep="\n")
    figure(result).savefig("findings.png")
