"""Speed against accuracy: processor time over true error of every method, and other programs beside them."""

from cases.benchmarks.speed import figure, solve, to_dict  # noqa: F401
