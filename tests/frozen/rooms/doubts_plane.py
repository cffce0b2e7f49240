"""Estimates, counts and errors of states on half-planes."""

from functools import partial

from .. import library_said

rows = partial(library_said.to_rtol, library_said.IN_THE_PLANE)
