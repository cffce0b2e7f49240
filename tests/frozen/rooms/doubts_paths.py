"""Errors of the events of load paths, and estimates of the states of histories."""

from .. import library_said

rows = library_said.on_the_way
