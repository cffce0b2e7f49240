"""Second codes, which import nothing of the library, and the problems that they judge, drawn by program.

`SEED` was drawn at random before any of them was written. Problem k of a set comes from (SEED, set, k).
"""

SEED = 66032643


class NoAnswer(Exception):
    """A second code did not come to an answer."""
