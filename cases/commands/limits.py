"""Where methods fail: seeded runs, a fifth of them near a degeneracy; the table "what fails where"."""

from cases.benchmarks.limits import figure, solve, to_dict  # noqa: F401
