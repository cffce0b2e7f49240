"""What states on nodes that are given say of what they do not see."""

from .. import library_said

rows = library_said.warned
