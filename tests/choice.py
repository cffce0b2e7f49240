"""Which problems of many the tests compute by default: a share that is chosen by their names.

Names are as good as chance, and the same at any time. What a problem shows, such as a method with a law, is
shown by one of those that are computed, whichever are left out; `-m nightly` has the others.
"""

from zlib import crc32

import pytest

SHARE = 10  # one of so many is computed, and those without which something would not be shown


def checksum(name):
    return crc32(name.encode())


def part(traits, share=SHARE):
    """Return the names that are computed of {name: what the problem shows}."""
    names = sorted(traits, key=checksum)
    chosen = {name for name in names if checksum(name) % share == 0}
    unseen = set().union(*traits.values()).difference(*(traits[name] for name in chosen))
    while unseen:
        name = max(names, key=lambda name: len(traits[name] & unseen))
        chosen.add(name)
        unseen -= traits[name]
    return chosen


def params(traits):
    """Return the parameters of a test of {(value, ...): what it shows}; most are left to `-m nightly`."""
    named = {" ".join(map(str, values)): values for values in traits}
    chosen = part({name: traits[values] for name, values in named.items()})
    return [
        pytest.param(*values, marks=() if name in chosen else pytest.mark.nightly)
        for name, values in named.items()
    ]
