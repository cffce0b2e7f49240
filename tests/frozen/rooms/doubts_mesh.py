"""Estimates, counts and errors of states on elements, and on a half-space."""

from .. import library_said


def rows():
    return library_said.to_rtol(library_said.ON_MESHES)
