"""Estimates, counts and errors of states on half-planes."""

from .. import library_said


def rows():
    return library_said.to_rtol(library_said.IN_THE_PLANE)
