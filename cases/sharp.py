"""
Wedge and punch
===============
Where the classical pressure is infinite once, at the edge of a wedge or at the end of a punch, that of
microblocks is infinite twice: half a block to either side.

:Geometry:  half-plane :math:`x_2 < 0`; a wedge with flanks of slope s, or a punch of the half-width b, flat
            or tilted, pressed down by a force P per thickness
:Equations: (10)-(18) in the solid, corner gaps (20)-(22), contact conditions (26)
:Method:    panels on the contact line, no mesh
:Reference: classical wedge :math:`P/(\\pi a)\\, \\mathrm{arcosh}(a/|x_1|)` with :math:`a = P/(E^* s)`,
            classical punch :math:`(P/\\pi - E^* s\\, x_1/2)/\\sqrt{b^2 - x_1^2}` with a tilt s
:Units:     wedge: lengths over the block's side, pressures over :math:`E^* s`; punch: lengths over b,
            pressures over :math:`P/(2 b)`
"""

import math

import matplotlib.pyplot as plt
import numpy as np

import microblock as mb

# %%
# The problems are linear in slope and load together: any small slope gives the same states.

SLOPE = 0.01


def body(ell, nu=0.3, beta=1.0):
    """A half-plane with E* = 1."""
    return mb.HalfPlane(mb.Cosserat(E=1 - nu**2, nu=nu, ell=ell, beta=beta))


# %%
# A light wedge touches the corners on either side of its edge one by one. At one load the two zones meet.
# A tilted punch leans on its deeper end; a classical one lies on all its width from the load pi/2 E* s b on.


def solve(loads=(0.3, 1.0, 4.0), tilted=0.5, alpha=0.3, nu=0.3, beta=1.0, rtol=1e-4):
    """States under the wedge, under the flat and the tilted punch, and the load at which the zones meet.

    Parameters
    ----------
    loads : on the wedge, over E* s ell
    tilted : load on the tilted punch, over that of full classical contact
    alpha : side of a block over the half-width of the punch
    nu : Poisson's ratio
    beta : coupling of rotations, between 0 and 2
    rtol : relative error of each state
    """
    wedge = mb.Contact(body(1.0, nu, beta), mb.Wedge(SLOPE), mb.Microblock())
    merged = [event.load for event in wedge.path(load=10 * SLOPE).events if event.kind == "merged"]
    flat = mb.Contact(body(alpha, nu, beta), mb.Punch(1.0), mb.Microblock())
    leaning = flat.with_(obstacle=mb.Punch(1.0, tilt=SLOPE))
    return {
        "wedge": [wedge.solve(load=SLOPE * load, rtol=rtol) for load in loads],
        "flat punch": flat.solve(load=SLOPE, rtol=rtol),
        "tilted punch": leaning.solve(load=tilted * math.pi / 2 * SLOPE, rtol=rtol),
        "zones meet at load": merged[0] / SLOPE,
    }


# %%
# Closed forms of the classical contact, and the figure


def classical_wedge(x, a):
    """Pressure over E* s under a wedge whose contact has the half-width a, at x != 0."""
    return np.arccosh(np.maximum(a / np.abs(x), 1)) / math.pi


def classical_punch(x, tilted=math.inf):
    """Pressure over P/(2 b) at -b < x < b; `tilted` as of `solve`, infinite for the flat punch."""
    if tilted < 1:
        return 2 / math.pi / tilted * np.sqrt(np.maximum(2 * tilted / (1 + x) - 1, 0))
    return 2 / math.pi * (1 - x / tilted) / np.sqrt(1 - x**2)


def figure(result):
    """(a) Wedge at rising loads, (b) flat and tilted punch; dashed: classical."""
    drawing, (wedge, punch) = plt.subplots(2, 1, figsize=(3.54, 4.4), layout="constrained")
    for number, state in enumerate(result["wedge"]):
        x = np.linspace(-1.05, 1.05, 2000) * state.half_width
        words, colour = rf"$P/(E^* s\,\ell) = {state.load / SLOPE:g}$", f"C{number}"
        wedge.plot(x, state.pressure_at(x) / SLOPE, colour, label=words)
        wedge.plot(x, classical_wedge(x, state.load / SLOPE), colour, linestyle="--", linewidth=0.7)
    x = np.linspace(-1.2, 1.2, 2000)
    for number, name in enumerate(("flat punch", "tilted punch")):
        state = result[name]
        tilted = math.inf if name == "flat punch" else state.load / (math.pi / 2 * SLOPE)
        inside = x[abs(x) < 1]
        punch.plot(x, 2 * state.pressure_at(x) / state.load, f"C{number}", label=name)
        punch.plot(inside, classical_punch(inside, tilted), f"C{number}", linestyle="--", linewidth=0.7)
    wedge.set(
        xlabel=r"$x_1/\ell$", ylabel=r"$p/(E^* s)$", ylim=(0, 3.2), title="(a) wedge; dashed: classical"
    )
    punch.set(xlabel="$x_1/b$", ylabel="$2 b\\,p/P$", ylim=(0, 6), title="(b) punch; dashed: classical")
    for axis in (wedge, punch):
        axis.legend()
    return drawing


if __name__ == "__main__":
    result = solve()
    print(f"zones under the wedge meet at P = {result['zones meet at load']:.6f} E* s ell")
    figure(result)
    plt.show()
