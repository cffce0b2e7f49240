"""What is seen of obstacles before anything is solved."""

from .. import library_said

rows = library_said.pictures
