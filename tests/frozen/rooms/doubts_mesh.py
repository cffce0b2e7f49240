"""Estimates, counts and errors of states on elements, and on a half-space."""

from functools import partial

from .. import library_said

rows = partial(library_said.to_rtol, library_said.ON_MESHES)
