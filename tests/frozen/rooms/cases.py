"""Commands whose names, options and keys are promised: exit status and numbers of their JSON."""

import json

from .. import library, of_kind, problems
from ..states import leaves


def rows(choice):
    commands = {f"cases {words}:": words for words in problems.COMMANDS}
    for name in choice.named({name: traits_of(words) for name, words in commands.items()}):
        words = commands[name]
        wanted, kind, tolerance = problems.COMMANDS[words]
        status, printed = library.answered(words)
        yield f"cases {words}: exit status", status, "outcome"
        numbers = dict(leaves(json.loads(printed)))
        estimates = [value for name, value in numbers.items() if name.endswith("error_estimate")]
        tolerance = max(estimates, default=tolerance)
        for name, value in numbers.items():
            if name.startswith(wanted) and not (words in problems.ENDLESS and name.endswith("energy")):
                yield of_kind(f"cases {words}: {name}", value, kind, tolerance)
    for words in problems.REFUSED_COMMANDS:
        yield f"cases {words}: exit status", library.answered(words)[0], "outcome"


def traits_of(words):
    """What a command line shows: its command, and its model."""
    command, _, options = words.partition(" ")
    return {command, *(f"{command} {model}" for model in ("column", "fe") if f"--model {model}" in options)}
