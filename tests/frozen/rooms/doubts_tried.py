"""Single steps of the search for zones on panels, from zones that are wrong: edges, violations, minima."""

from .. import library_said


def rows():
    return library_said.trials()
