"""What states on nodes that are given say of what they do not see."""

from .. import library_said


def rows():
    return library_said.warned()
