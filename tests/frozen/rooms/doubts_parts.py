"""What functions give that take numbers, and single steps of the search for zones."""

from .. import library_said

rows = library_said.parts
