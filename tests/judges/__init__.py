"""Second codes, which import nothing of the library, and the problems that they judge, drawn by program.

`SEED` was drawn at random before any of them was written; problem k of a set is drawn from (SEED, set, k).
"""

SEED = 66032643
