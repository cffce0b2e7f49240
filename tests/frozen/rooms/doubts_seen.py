"""What is seen of obstacles before anything is solved: widths, places, first zones, bounds."""

from .. import library_said


def rows():
    return library_said.pictures()
