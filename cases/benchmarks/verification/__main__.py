"""Seeded problems of a set beside its second code, a line each: python -m cases.benchmarks.verification SET.

panels cells fitted body   60 problems of each method that estimates its error
obstacles                  2000 obstacles that are meant to be hard (--seed 2020: those of the records before)
space                      200 surfaces of a half-space
friction                   20 histories
shapes                     100 standard shapes without an rtol, beside closed forms
scales                     200 problems of every kind in four systems of units
doors                      300 obstacles as users hand them over
named                      200 states on discretisations that are named
bodies_in_space            100 contacts of bodies on meshes in space
friction_in_space          30 histories of bodies on meshes in space
fields                     20 states, 10 points below each
"""

import argparse
from functools import partial

from . import (
    SEED,
    doors,
    fields_below,
    friction,
    friction_in_space,
    judging,
    lines,
    named,
    scales,
    scenes_in_space,
    shapes,
    space_problems,
)

SETS = {
    **dict.fromkeys(lines.METHODS, 60),
    "obstacles": 2000,
    "space": 200,
    "friction": 20,
    "scales": 200,
    "shapes": 100,
    "doors": 300,
    "named": 200,
    "bodies_in_space": 100,
    "friction_in_space": 30,
    "fields": 20,
}


def cases(name, numbers, seed=SEED, rtol=1e-3):
    """Yields (number, Case) of a set."""
    makers = {
        **{method: partial(lines.fresh, method) for method in lines.METHODS},
        "obstacles": partial(lines.hard, seed=seed, rtol=rtol),
        "space": space_problems.case,
        "friction": friction.case,
        "scales": scales.case,
        "shapes": shapes.case,
        "doors": doors.case,
        "named": named.case,
        "bodies_in_space": scenes_in_space.case,
        "friction_in_space": friction_in_space.case,
        "fields": fields_below.case,
    }
    for k in numbers:
        yield k, makers[name](k)


def main(words=None):
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("set", choices=SETS)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, help="problems, by default all of the set")
    parser.add_argument("--seconds", type=float, default=60, help="of the processor, for a state")
    parser.add_argument("--seed", type=int, default=SEED, help="of obstacles")
    parser.add_argument("--rtol", type=float, default=1e-3, help="of obstacles")
    options = parser.parse_args(words)
    numbers = range(options.first, options.first + (options.count or SETS[options.set]))
    return judging.run(options.set, cases(options.set, numbers, options.seed, options.rtol), options.seconds)


if __name__ == "__main__":
    main()
