"""Counts, tables and figures of states on nodes that are given."""

from .. import library_said


def rows():
    return library_said.on_nodes()
