"""Any rigid obstacle on a half-plane: its height as a formula in x, or as samples in a file."""

from microblock.__main__ import __doc__, figure, solve, table  # noqa: F401  also `microblock contact`
