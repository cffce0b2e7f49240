"""Any rigid obstacle on a half-plane: its height as a formula in x, or as samples in a file.

Geometry   half-plane x2 < 0, pressed by an obstacle; blocks of side ell at each point, rotated by psi0.
Equations  (10)-(18) in the half-plane, the corner gaps (20)-(22) and conditions (26) on its surface.
Method     panels fitted to the zones of each corner; between the ends of a window uniform cells.
Units      as given, any that go together, such as mm, MPa and N/mm.
EXPR       numbers, x, pi, e, inf (no obstacle there), + - * / **, parentheses, and of numpy abs sqrt cbrt exp
           log sin cos tan arcsin arccos arctan sinh cosh tanh sign floor ceil minimum maximum hypot arctan2
           power clip where, comparisons (1 where they hold, else 0). An expression that begins with a minus
           is written --height=EXPR.
FILE       a text of two columns, x and height, as instruments write it: with tabs, semicolons, commas or
           blanks, decimal points or commas, below a header. What was understood is printed; --columns, --unit
           and --skip settle the rest. The height is that of the obstacle's lower side, upwards. Straight
           lines between the samples, no obstacle beyond them and where heights are missing. Each sample is a
           jump of the slope: a thousand in contact take minutes, with a window a second. A warning says what
           the samples, and their --noise, leave open of the pressure if --rtol is far below.
"""

import sys
from math import radians
from typing import Any, Literal

from . import (
    BadArgument,
    Cells,
    Contact,
    Cosserat,
    HalfPlane,
    Microblock,
    Microclamped,
    Unilateral,
    __version__,
)
from .command import did_you_mean, quiet, run
from .data.expressions import function_of_x
from .data.samples import obstacle_of, read_profile
from .errors import require
from .model.sharp import unbounded


def solve(
    height: str | None = None,
    samples: str | None = None,
    noise: float | None = None,
    columns: tuple[str, str] | None = None,
    unit: str | None = None,
    skip: int | None = None,
    window: tuple[float, float] | None = None,
    loads: tuple[float, ...] = (1.0,),
    E: float = 100.0,
    nu: float = 0.3,
    beta: float = 1.0,
    ell: float = 0.1,
    psi0_deg: float = 0.0,
    contact: Literal["microblock", "unilateral", "microclamped"] = "microblock",
    rtol: float | None = None,
    path: bool = False,
) -> dict[str, Any]:
    """Returns the states of an obstacle on a half-plane at each load, in the order given.

    Parameters
    ----------
    height : height of the obstacle, a formula in x such as 'x**2/20' (length)
    samples : file with samples x and height (lengths) of the obstacle's lower side; a profile z measured from
    above
        has the heights -z
    noise : standard deviation of the heights of the samples (length)
    columns : those of x and height in the file, by numbers from 1 or titles, with a unit as in 1:mm 2:um
    unit : unit of length of the problem, such as mm, that samples are brought to; else that of x in the file
    skip : lines to leave out at the beginning of the file
    window : both ends of the part of x1 in which the obstacle may touch: uniform cells in place of panels
    loads : forces per thickness
    E : Young's modulus (stress)
    nu : Poisson's ratio, -1 < nu < 1/2
    beta : coupling number 2 eta/(1 + eta), 0 < beta < 2
    ell : length scale of the material, and side of a block (length)
    psi0_deg : initial rotation of the blocks in degrees, counterclockwise
    contact : the contact law
    rtol : relative L2 error of pressure and micromoment (0.001 if not given, 0.01 with a window)
    path : whether to follow the events from first touch to the largest load
    """
    words = "either this or --samples FILE must be given"
    require((height is None) != (samples is None), "height", height or "EXPR", words)
    of_file = {"noise": noise, "columns": columns, "unit": unit, "skip": skip}
    for option, value in of_file.items():
        require(value is None or samples is not None, option, value, "belongs to --samples FILE")
    words = "belongs to --contact microblock"
    require(not psi0_deg or contact == "microblock", "psi0_deg", psi0_deg, words)
    profile = None
    obstacle: Any = None
    if height is not None:
        obstacle = function_of_x(height, "height")
    elif samples is not None:
        profile = read_profile(samples, "samples", columns, unit, skip or 0)
        obstacle = obstacle_of(profile, samples, "samples", noise)
    if rtol is None:
        rtol = 1e-2 if window else 1e-3
    laws = {"unilateral": Unilateral(), "microclamped": Microclamped()}
    law = laws.get(contact, Microblock(radians(psi0_deg)))
    result: dict[str, Any] = {"parameters": {"rtol": rtol}}
    if profile:
        result["parameters"]["understood"] = profile.understood
    try:
        body = HalfPlane(Cosserat(E, nu, ell, beta=beta))
        problem = Contact(body, obstacle, law, Cells(window=window) if window else None)
        result["states"] = problem.states(loads, rtol=rtol)
        if path:
            result["events"] = problem.path(load=max(loads), rtol=rtol).to_dict()["events"]
    except BadArgument as failure:
        if failure.name != "obstacle":
            raise
        # the advice of an obstacle that is too wide for panels
        words = failure.allowed.replace("Cells(nodes=..., window=...) take", "--window L R takes")
        name = "samples" if height is None else "height"
        raise BadArgument(name, samples if height is None else height, words) from failure
    return result


def figure(result: dict[str, Any]) -> dict[str, Any]:
    """Returns pressure, micromoment and zones of each state."""
    return {f"contact_{state.load}": state.plot() for state in result["states"]}


def table(result: dict[str, Any]) -> dict[str, Any]:
    """Returns what is printed: material and law as taken, and a row a state."""
    rows = [
        {
            "load": state.load,
            "contact_length": state.contact_area,
            "zones": len(state.zones["contact"]),
            "pressure_max": "unbounded" if unbounded(state.solution) else float(state.pressure.max()),
            "error_estimate": state.error_estimate,
        }
        for state in result["states"]
    ]
    first = result["states"][0]
    parameters = result["parameters"]
    taken = {"solid": repr(first.solid), "law": repr(first.law), "rtol": parameters["rtol"]}
    if "understood" in parameters:
        taken["samples"] = [f"{words};" for words in parameters["understood"]]
    return {**taken, "states": rows, "events": result.get("events", {})}


@quiet
def main(words: list[str] | None = None) -> int:
    """Runs the command `microblock contact ...`; returns the exit status."""
    if words is None:
        words = sys.argv[1:]
    if words[:1] == ["contact"]:
        return run("microblock contact", sys.modules[__name__], words[1:])
    if words[:1] == ["--version"]:
        print(f"microblock {__version__}")
        return 0
    if words and words[0] not in ("-h", "--help"):
        elsewhere = ": contact is one, and python -m cases lists the others"
        hint = did_you_mean(words[0], ["contact"]) or elsewhere
        print(f"microblock: {words[0]}: no such command{hint}", file=sys.stderr)
        return 2
    print("contact      " + __doc__.partition("\n")[0] + "\n\nmicroblock contact --help: its options")
    return 0


if __name__ == "__main__":
    sys.exit(main())
