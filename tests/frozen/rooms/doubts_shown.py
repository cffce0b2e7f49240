"""Counts, words, figures and files of states on nodes that are given."""

from .. import library_said

rows = library_said.on_nodes
